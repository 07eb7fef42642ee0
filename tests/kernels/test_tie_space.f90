!> Constraint rows of ties in space: closed forms, linear fields, sums, nodes between corners.
module test_tie_space
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_couplings, only : tie_rows_t, tie_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : multiplier_dual, multiplier_standard
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use emcon_tie_space, only : tie_measure_space
   use random_draws, only : draw_random
   use space_scenes, only : add_box, space_begin
   implicit none
   private
   public :: collect_tie_space

   !> Entries, and moments of them, carry some 100 roundings of the size and the extent named.
   real(wp), parameter :: tol = 256.0_wp*epsilon(1.0_wp)
   integer, parameter :: multipliers(2) = [multiplier_dual, multiplier_standard]
   character(len=4), parameter :: kinds(4) = ["C3D8", "C3D4", "C3D8", "C3D4"], &
      below(4) = ["C3D8", "C3D8", "C3D4", "C3D4"]

contains

   subroutine collect_tie_space(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("matching meshes", test_matching), &
         test_case_t("linear fields at any ratio", test_linear)]
   end subroutine collect_tie_space

   !> Surface 1, the slave, is the bottom of a box at z >= 0, surface 2 the top of one below it; both
   !> on 0..2, 0..1.5. Nodes in the middle of the interface are moved along it by `shake`.
   subroutine make_boxes(scene, kind, n_upper, n_lower, shake)
      type(scene_t), intent(out) :: scene
      character(len=*), intent(in) :: kind(2)
      integer, intent(in) :: n_upper(3), n_lower(3)
      real(wp), intent(in) :: shake
      real(wp) :: draw(2)
      integer :: i

      call space_begin(scene)
      call add_box(scene, kind(1), [0.0_wp, 0.0_wp, 0.0_wp], [2.0_wp, 1.5_wp, 1.0_wp], n_upper)
      call add_side(scene, "UPPER", 1)
      i = size(scene%element%kind)
      call add_box(scene, kind(2), [0.0_wp, 0.0_wp, -1.0_wp], [2.0_wp, 1.5_wp, 1.0_wp], n_lower)
      call add_side(scene, "LOWER", i + 1)
      do i = 1, size(scene%x, 2)
         if (scene%x(3, i) > 0.0_wp .or. scene%x(3, i) < 0.0_wp) cycle
         call draw_random(draw)
         if (min(scene%x(1, i), scene%x(2, i)) <= 0.0_wp .or. scene%x(1, i) >= 2.0_wp &
            .or. scene%x(2, i) >= 1.5_wp) cycle
         scene%x(:2, i) = scene%x(:2, i) + shake*(2.0_wp*draw - 1.0_wp)
      end do
   end subroutine make_boxes

   !> Add the surface of the faces at z = 0 of elements from `first` on.
   subroutine add_side(scene, name, first)
      type(scene_t), intent(inout) :: scene
      character(len=*), intent(in) :: name
      integer, intent(in) :: first
      type(surface_t) :: surface
      integer :: e, f

      surface%name = name
      allocate(surface%element(0), surface%face(0))
      do e = first, size(scene%element%kind)
         associate (kind => scene%element%kinds(scene%element%kind(e)))
            do f = 1, kind%n_face
               if (any(abs(scene%x(3, scene%element%node(kind%face(f), e))) > 0.0_wp)) cycle
               surface%element = [surface%element, e]
               surface%face = [surface%face, f]
            end do
         end associate
      end do
      scene%surface = [scene%surface, surface]
   end subroutine add_side

   !> Rows of the tie of surface 1 to surface 2, no node of which is held or in another tie.
   subroutine measure(scene, multiplier, rows, error)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: multiplier
      type(tie_rows_t), intent(out) :: rows
      type(error_t), allocatable, intent(out) :: error
      type(tie_t) :: tie
      logical :: is_held(3, size(scene%x, 2))
      integer :: n_tie(size(scene%x, 2))

      tie%name = "SEAM"
      tie%slave = 1
      tie%master = 2
      tie%multiplier = multiplier
      is_held = .false.
      n_tie = 1
      call tie_measure_space(scene, tie, n_tie, is_held, rows, error)
   end subroutine measure

   !> Nodes that stand opposite each other are tied one to one.
   subroutine test_matching(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      integer :: k

      call make_boxes(scene, ["C3D8", "C3D8"], [3, 2, 1], [3, 2, 1], 0.0_wp)
      call measure(scene, multiplier_dual, rows, error)
      if (allocated(error)) return
      call check_equal(error, rows%start, [(2*k, k = 0, 12)], "two entries a row")
      if (allocated(error)) return
      do k = 1, 12
         call check_equal(error, rows%node(2*k - 1:2*k), [k, k + 36], "nodes of a row")
         call check_near(error, rows%weight(2*k - 1:2*k), rows%size(k)*[1.0_wp, -1.0_wp], tol, &
            rows%size(k), "weights of a row")
      end do
      call check_near(error, sum(rows%size), 3.0_wp, tol, 3.0_wp, "sizes are the area")
   end subroutine test_matching

   !> Linear fields pass unchanged, whatever the meshes; rows sum up to 0, sizes to the area, entries
   !> of a master node to the load of a unit pressure.
   subroutine test_linear(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      integer, parameter :: n(6, 4) = reshape([2, 2, 1, 3, 3, 1, 3, 3, 1, 2, 2, 1, 4, 1, 1, 1, 5, &
         1, 1, 1, 1, 7, 6, 1], [6, 4])
      integer :: i, j, k

      do i = 1, size(n, 2)
         do k = 1, size(kinds)
            call make_boxes(scene, [kinds(k), below(k)], n(:3, i), n(4:, i), 0.05_wp)
            do j = 1, 2
               call measure(scene, multipliers(j), rows, error)
               if (allocated(error)) return
               call check_rows(scene, rows, error)
               if (allocated(error)) return
            end do
         end do
      end do
   end subroutine test_linear

   subroutine check_rows(scene, rows, error)
      type(scene_t), intent(in) :: scene
      type(tie_rows_t), intent(in) :: rows
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: total(3)
      integer :: k

      do k = 1, size(rows%slave)
         associate (node => rows%node(rows%start(k) + 1:rows%start(k + 1)), &
               weight => rows%weight(rows%start(k) + 1:rows%start(k + 1)))
            call check_near(error, sum(weight), 0.0_wp, tol, rows%size(k), "sum of a row")
            total = matmul(scene%x(:, node), weight)
            call check_near(error, total, 0.0_wp*total, tol, 2.0_wp*rows%size(k), &
               "positions in row " // to_text(k))
            call check_true(error, rows%size(k) > 0.0_wp, "sizes are positive")
         end associate
      end do
      call check_near(error, sum(rows%size), 3.0_wp, tol, 3.0_wp, "sizes are the area")
   end subroutine check_rows

end module test_tie_space
