!> Ties and equations as rows over degrees of freedom.
module test_linear_rows
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_linear_rows, only : linear_rows_init, linear_rows_t
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use linear_scenes, only : add_equation, add_tie_by_hand
   use small_scenes, only : block_t, make_block
   implicit none
   private
   public :: collect_linear_rows

   !> A weight is divided by a size once, and two of them are summed up.
   real(wp), parameter :: tol = 4.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_linear_rows(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("candidates", test_candidates), &
         test_case_t("rows of a tie", test_rows), &
         test_case_t("equations", test_equations)]
   end subroutine collect_linear_rows

   !> A block of 4 x 1 cells whose upper nodes 6..10 follow the lower ones 1..5, a tie of nonsense
   !> geometry: `n` slave nodes, each between two masters.
   subroutine make(n, scene, linear)
      integer, intent(in) :: n
      type(scene_t), intent(out) :: scene
      type(linear_rows_t), intent(out) :: linear
      type(block_t) :: block
      integer :: k

      call make_block(scene, "CPE4", [4, 1], block)
      call add_tie_by_hand(scene, [(5 + k, k = 1, n)], &
         reshape([(k, k + 1, k = 1, n)], [2, n]), &
         reshape([(real(k, wp)/8.0_wp, 1.0_wp - real(k, wp)/8.0_wp, k = 1, n)], [2, n]), &
         [(real(k, wp), k = 1, n)])
      call linear_rows_init(linear, scene)
   end subroutine make

   subroutine test_candidates(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(linear_rows_t) :: linear

      call make(2, scene, linear)
      call add_equation(scene, [10, 1], [2, 1], [1.0_wp, -2.0_wp])
      call linear_rows_init(linear, scene)
      call check_equal(error, linear%n, 5, "candidates")
      call check_equal(error, linear%tie, [1, 1, 1, 1, 0], "ties")
      call check_equal(error, linear%place, [1, 1, 2, 2, 1], "places")
      call check_equal(error, linear%own, [11, 12, 13, 14, 20], "own freedoms")
      call check_near(error, linear%size, [1.0_wp, 1.0_wp, 2.0_wp, 2.0_wp, 4.0_wp], 0.0_wp, &
         1.0_wp, "sizes: of the rows, and the extent")
      call check_true(error, all(linear%is_used), "all are used")
   end subroutine test_candidates

   !> Row `n` is `weight` on the freedoms `dof` of displacement.
   subroutine check_row(error, linear, n, dof, weight)
      type(error_t), allocatable, intent(inout) :: error
      type(linear_rows_t), intent(in) :: linear
      integer, intent(in) :: n, dof(:)
      real(wp), intent(in) :: weight(:)

      associate (from => linear%start(n) + 1, to => linear%start(n + 1))
         call check_true(error, linear%is_used(n), "row " // to_text(n) // " is used")
         call check_equal(error, linear%dof(from:to), dof, "freedoms of row " // to_text(n))
         call check_near(error, linear%weight(from:to), weight, tol, 1.0_wp, &
            "weights of row " // to_text(n))
      end associate
   end subroutine check_row

   subroutine test_rows(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(linear_rows_t) :: linear

      call make(3, scene, linear)
      call check_row(error, linear, 1, [1, 3, 11], [-0.125_wp, -0.875_wp, 1.0_wp])
      call check_row(error, linear, 2, [2, 4, 12], [-0.125_wp, -0.875_wp, 1.0_wp])
      call check_row(error, linear, 6, [6, 8, 16], [-0.375_wp, -0.625_wp, 1.0_wp])
   end subroutine test_rows

   !> Coefficients relative to the largest; terms of one freedom become one.
   subroutine test_equations(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(linear_rows_t) :: linear

      call make(1, scene, linear)
      call add_equation(scene, [4, 2, 4], [2, 1, 2], [8.0_wp, -2.0_wp, -4.0_wp])
      call linear_rows_init(linear, scene)
      call check_row(error, linear, 3, [3, 8], [-0.25_wp, 0.5_wp])
   end subroutine test_equations

end module test_linear_rows
