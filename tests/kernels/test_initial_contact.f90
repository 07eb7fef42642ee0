!> Contact before the first step: what passes, what is refused, what is moved.
module test_initial_contact
   use check, only : check_error, check_near, check_true, test_case_t
   use emcon_errors, only : err_input, error_t
   use emcon_initial_contact, only : initial_contact_prepare
   use emcon_interactions, only : formulation_mortar, formulation_nts, formulation_segment
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_text, only : notes_t, to_text
   use small_scenes, only : add_surface, block_t, bottom, left, make_two_blocks, right, top
   implicit none
   private
   public :: collect_initial_contact

   integer, parameter :: formulations(3) = [formulation_nts, formulation_segment, &
      formulation_mortar]

contains

   subroutine collect_initial_contact(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("touching surfaces pass at any angle", test_touching), &
         test_case_t("overlap", test_overlap), &
         test_case_t("overlap of a surface with itself", test_self_overlap), &
         test_case_t("surfaces on the wrong side", test_sides), &
         test_case_t("surface that crosses itself", test_crossing), &
         test_case_t("master corner between slave nodes", test_corner), &
         test_case_t("blunt master corner between slave nodes", test_blunt)]
   end subroutine collect_initial_contact

   !> Prepare the scene under one formulation.
   subroutine prepare(scene, formulation, raised)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: formulation
      type(error_t), allocatable, intent(out) :: raised
      type(notes_t) :: notes

      scene%pair%formulation = formulation
      call initial_contact_prepare(scene, notes, raised)
   end subroutine prepare

   !> Rounding of the coordinates puts some nodes behind the surface.
   subroutine test_touching(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      real(wp) :: angle
      integer :: i, k, own

      do own = 0, 1
         do i = 1, 40
            angle = 0.37_wp*real(i, wp)
            call make_two_blocks(scene, 0.0_wp, lower, upper)
            if (own == 1) then
               scene%surface(1)%element = [scene%surface(1)%element, scene%surface(2)%element]
               scene%surface(1)%face = [scene%surface(1)%face, scene%surface(2)%face]
               scene%pair(1)%slave = 1
            end if
            if (mod(i, 2) == 0) scene%x(1, 11:) = scene%x(1, 11:) - 0.125_wp  ! nodes on nodes
            scene%x = matmul(reshape([cos(angle), sin(angle), -sin(angle), cos(angle)], [2, 2]), &
               scene%x)
            do k = 1, 3
               call prepare(scene, formulations(k), raised)
               call check_true(error, .not. allocated(raised), "touching, angle " // to_text(i))
            end do
         end do
      end do
   end subroutine test_touching

   !> All slave nodes slightly inside: an overlap, which ADJUST mends, not a wrong side.
   subroutine test_overlap(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      integer :: k

      do k = 1, 3
         call make_two_blocks(scene, -0.0625_wp, lower, upper)
         call prepare(scene, formulations(k), raised)
         call check_error(error, raised, err_input, "3 slave nodes of surface UPPER penetrate " // &
            "surface LOWER, by 0.0625 at most", "overlap")
         scene%pair(1)%adjust%distance = 0.0_wp
         call prepare(scene, formulations(k), raised)
         call check_true(error, .not. allocated(raised), "adjusted")
         call check_near(error, scene%x(2, 11:13), [0.0_wp, 0.0_wp, 0.0_wp], epsilon(1.0_wp), &
            1.0_wp, "moved onto the surface")
      end do
   end subroutine test_overlap

   !> The lower block's middle node lies inside the upper block, in one surface.
   subroutine test_self_overlap(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: lower, upper

      call make_two_blocks(scene, -0.0625_wp, lower, upper)
      scene%surface(1)%element = [scene%surface(1)%element, scene%surface(2)%element]
      scene%surface(1)%face = [scene%surface(1)%face, scene%surface(2)%face]
      scene%pair(1)%slave = 1
      call prepare(scene, formulation_nts, raised)
      call check_error(error, raised, err_input, "2 slave nodes of surface LOWER penetrate " // &
         "surface LOWER, by 0.0625 at most; node (depth): 8 (0.0625), 9 (0.0625)", "overlap")
      scene%pair(1)%adjust%distance = 0.0_wp
      call prepare(scene, formulation_nts, raised)
      call check_true(error, .not. allocated(raised), "adjusted")
      call check_near(error, scene%x(2, 6:10), [0.0_wp, 0.0_wp, -0.0625_wp, -0.0625_wp, 0.0_wp], &
         epsilon(1.0_wp), 1.0_wp, "moved onto the surface")
   end subroutine test_self_overlap

   subroutine test_sides(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      integer :: side

      do side = 1, 3
         call make_two_blocks(scene, 0.25_wp, lower, upper)
         call add_surface(scene, "LOWER_BOTTOM", lower, [bottom])
         call add_surface(scene, "UPPER_TOP", upper, [top])
         if (mod(side, 2) == 1) scene%pair(1)%master = 3
         if (side > 1) scene%pair(1)%slave = 4
         call prepare(scene, formulation_nts, raised)
         if (side == 2) then
            call check_error(error, raised, err_input, "normals of slave surface UPPER_TOP " // &
               "point away from surface LOWER", "slave")
         else
            call check_error(error, raised, err_input, "normals of master surface " // &
               "LOWER_BOTTOM point away from surface UPPER", "master")
         end if
      end do
   end subroutine test_sides

   !> The fourth edge of the top is laid across the first one.
   subroutine test_crossing(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      integer :: k

      do k = 0, 1
         call make_two_blocks(scene, 3.0_wp, lower, upper)
         scene%u0(:, 6:10) = reshape([1.5_wp, -1.0_wp, 1.5_wp, 1.0_wp, 0.0_wp, 1.0_wp, &
            1.0_wp, 0.0_wp, 2.0_wp, 0.0_wp], [2, 5]) - scene%x(:, 6:10)
         if (k == 1) scene%pair(1)%slave = 1
         call prepare(scene, formulation_nts, raised)
         call check_error(error, raised, err_input, "contact surface LOWER crosses itself: face " &
            // "S3 of element 4 (nodes 10, 9) and face S3 of element 1 (nodes 7, 6)", "crossing")
      end do
   end subroutine test_crossing

   !> A stamp between two slave nodes: node to segment cannot see it, integrated gaps must.
   subroutine test_corner(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      integer :: k

      do k = 1, 3
         call make_two_blocks(scene, -0.0625_wp, lower, upper)
         scene%x(1, 11:) = 0.5_wp + 0.25_wp*(scene%x(1, 11:) - 0.125_wp)
         call add_surface(scene, "STAMP", upper, [left, bottom, right])
         scene%pair(1)%slave = 1
         scene%pair(1)%master = 3
         call prepare(scene, formulations(k), raised)
         if (formulations(k) == formulation_nts) then
            call check_true(error, .not. allocated(raised), "not seen by the slave nodes")
         else
            call check_error(error, raised, err_input, "2 master nodes of surface STAMP " // &
               "penetrate surface LOWER, between its nodes, by 0.0625 at most", "corner")
         end if
      end do
   end subroutine test_corner

   !> Slave nodes on the polygon of a slightly curved master: its node between them is inside.
   subroutine test_blunt(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: lower, upper

      call make_two_blocks(scene, 0.0_wp, lower, upper)
      scene%x(2, 6:10) = -0.0625_wp*scene%x(1, 6:10)**2
      scene%x(1, 11:) = scene%x(1, 11:) - 0.625_wp           ! slave nodes at -1.5, -0.5, 0.5
      scene%x(2, 11:13) = [-0.15625_wp, -0.03125_wp, -0.03125_wp]
      call prepare(scene, formulation_mortar, raised)
      call check_true(error, .not. allocated(raised), "polygons of one curve")
      scene%x(2, 8) = 0.25_wp                                ! now a peak through the slave edge
      call prepare(scene, formulation_mortar, raised)
      call check_error(error, raised, err_input, "penetrate surface", "peak")
   end subroutine test_blunt

end module test_initial_contact
