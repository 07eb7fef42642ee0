!> Gaps before the first step: of nodes over a flat surface, and what these nodes see of it.
module test_start_gaps
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_start_gaps, only : is_master, is_slave
   use emcon_start_gaps_plane, only : start_gaps_plane_init, start_gaps_plane_t
   use small_scenes, only : add_block, add_surface, block_t, bottom, left, right, scene_begin, top
   implicit none
   private
   public :: collect_start_gaps

   real(wp), parameter :: tol = 16.0_wp*epsilon(1.0_wp)
   !> Slave nodes, counter-clockwise: down the left side, along the bottom, up the right side.
   integer, parameter :: node(5) = [12, 9, 10, 11, 14]

contains

   subroutine collect_start_gaps(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("gaps over a flat surface", test_gaps), &
         test_case_t("the way to it", test_offset), &
         test_case_t("corners, and what faces it", test_corners), &
         test_case_t("surfaces that cross themselves", test_crossing)]
   end subroutine collect_start_gaps

   !> A block of 2 x 1 cells, 2 wide, `gap` over one of 3 x 1 and 4.5 wide, by displacements.
   subroutine begin(scene, gap, start, error)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: gap
      type(start_gaps_plane_t), intent(out) :: start
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: lower, upper

      call scene_begin(scene)
      call add_block(scene, "CPE4", [3, 1], [0.0_wp, -1.0_wp], [4.5_wp, 1.0_wp], lower)
      call add_block(scene, "CPE4", [2, 1], [1.0_wp, 5.0_wp], [2.0_wp, 1.0_wp], upper)
      call add_surface(scene, "LOWER", lower, [top])
      call add_surface(scene, "UPPER", upper, [left, bottom, right])
      scene%u0(2, 9:) = gap - 5.0_wp
      scene%pair = [contact_pair_t(slave=2, master=1)]
      call start_gaps_plane_init(start, scene, scene%pair(1), error)
   end subroutine begin

   !> Each node over the edge below it, as high as it is; past the end of the surface nothing is.
   subroutine test_gaps(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(start_gaps_plane_t) :: start
      real(wp) :: gap, height
      integer :: i
      logical :: is_over

      call begin(scene, 0.125_wp, start, error)
      if (allocated(error)) return
      call check_equal(error, start%n, 5, "slave nodes")
      call check_true(error, .not. start%is_self, "two surfaces")
      call check_equal(error, [start%surface(is_slave)%n_facet, start%surface(is_master)%n_facet], &
         [4, 3], "facets")
      do i = 1, 5
         call start%nearest(i, scene, gap, is_over)
         associate (k => start%node(i))
            height = scene%x(2, k) + scene%u0(2, k)
            call check_near(error, gap, height, tol, 1.0_wp, "gap")
            call check_true(error, is_over, "over it")
            associate (facet => start%surface(is_master)%facet(:, start%facet(i)))
               call check_true(error, scene%x(1, facet(2)) <= scene%x(1, k) .and. &
                  scene%x(1, k) <= scene%x(1, facet(1)), "the edge below")
            end associate
            call check_equal(error, start%surface(is_slave)%node(start%place(i)), k, "place")
         end associate
      end do
      call start%measure(scene)
      do i = 1, 5
         height = scene%x(2, start%node(i)) + scene%u0(2, start%node(i))
         if (start%state(i)%is_near) call check_near(error, start%state(i)%gap0, height, tol, &
            1.0_wp, "as measured")
         call check_true(error, start%state(i)%is_near .or. height > 1.0_wp, "near")
      end do
      scene%u0(1, 9:) = 3.0_wp
      call start_gaps_plane_init(start, scene, scene%pair(1), error)
      if (allocated(error)) return
      do i = 1, 5
         call start%nearest(i, scene, gap, is_over)
         call check_true(error, is_over .eqv. scene%x(1, start%node(i)) + 3.0_wp < 4.5_wp, &
            "past its end")
      end do
   end subroutine test_gaps

   !> What is behind or in front of the surface, and what lies on it but for round-off.
   subroutine test_offset(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: gap(4) = [0.0625_wp, -0.0625_wp, 0.5_wp*epsilon(1.0_wp), 0.0_wp]
      type(scene_t) :: scene
      type(start_gaps_plane_t) :: start
      real(wp) :: offset(2)
      integer :: i, k
      logical :: is_last

      do k = 1, size(gap)
         call begin(scene, 0.0_wp, start, error)
         if (allocated(error)) return
         scene%x(2, 9:) = scene%x(2, 9:) - 5.0_wp
         scene%u0(2, 9:) = gap(k)
         call start_gaps_plane_init(start, scene, scene%pair(1), error)
         if (allocated(error)) return
         call start%measure(scene)
         i = findloc(start%node, 10, 1)
         call start%offset(i, scene, 0.0_wp, offset, is_last)
         call check_near(error, offset, [0.0_wp, gap(k)], tol, 1.0_wp, "offset")
         call check_true(error, is_last .eqv. k > 2, "round-off")
      end do
   end subroutine test_offset

   !> Both lower corners turn by a right angle, the middle not at all, and the surface ends above.
   subroutine test_corners(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(start_gaps_plane_t) :: start
      real(wp) :: gap
      logical :: sharp(5), is_over
      integer :: i

      call begin(scene, 0.125_wp, start, error)
      if (allocated(error)) return
      call start%is_sharp(scene, 60.0_wp, sharp)
      call check_true(error, all([(sharp(findloc(start%node, node(i), 1)), i = 1, 5)] .eqv. &
         [.true., .true., .false., .true., .true.]), "corners and ends")
      call start%is_sharp(scene, 100.0_wp, sharp)
      call check_true(error, all([(sharp(findloc(start%node, node(i), 1)), i = 1, 5)] .eqv. &
         [.true., .false., .false., .false., .true.]), "ends alone")
      do i = 1, 5
         call start%nearest(i, scene, gap, is_over)
         call check_true(error, start%faces(i, scene) .eqv. any(start%node(i) == node(2:4)), &
            "faces it")
      end do
   end subroutine test_corners

   subroutine test_crossing(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(start_gaps_plane_t) :: start
      integer :: first, second

      call begin(scene, 0.125_wp, start, error)
      if (allocated(error)) return
      call start%crossing(is_slave, scene, first, second)
      call check_equal(error, [first, second], [0, 0], "none")
      ! The upper left node goes through the right side.
      scene%u0(:, 12) = scene%u0(:, 12) + [2.5_wp, -0.5_wp]
      call start%crossing(is_slave, scene, first, second)
      call check_equal(error, [first, second], [1, 4], "left and right side")
      call start%crossing(is_master, scene, first, second)
      call check_equal(error, [first, second], [0, 0], "none of the master")
   end subroutine test_crossing

end module test_start_gaps
