!> Ties and equations as rows over degrees of freedom.
module test_linear_rows
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_constraint, only : condition_t
   use emcon_evaluation, only : evaluation_t
   use emcon_kinds, only : wp
   use emcon_linear_conditions, only : linear_conditions_init, linear_conditions_t
   use emcon_linear_rows, only : linear_rows_init, linear_rows_t
   use emcon_motion, only : motion_of
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use linear_scenes, only : add_equation, add_tie_by_hand, make_random_rows, put_row
   use small_scenes, only : block_t, make_block, shake
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
         test_case_t("equations", test_equations), &
         test_case_t("conditions of rows", test_conditions)]
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

   !> Values, and gradients by freedoms, of rows in any order: each node once, the own one first.
   subroutine test_conditions(error)
      type(error_t), allocatable, intent(out) :: error
      type(linear_rows_t) :: rows
      type(linear_conditions_t) :: conditions
      type(condition_t) :: item(3)
      real(wp) :: x(2, 30), u0(2, 30), du(2, 30), g(2, 30), expected(60)
      integer :: wanted(3), pass, k, i

      call make_random_rows(rows)
      call put_row(rows, 21, [3, 4, 21, 22], [0.25_wp, -0.5_wp, 1.0_wp, 2.0_wp])
      call linear_conditions_init(conditions, rows)
      call check_equal(error, conditions%n_constraint, rows%n, "one each")
      do pass = 1, 2
         wanted = merge([1, 3, 9], [2, 6, 8], pass == 1)
         x = 0.0_wp
         call shake(u0, 1.0_wp)
         call shake(du, 1.0_wp)
         call conditions%linearise(wanted, motion_of(evaluation_t(), x, u0, du), &
            spread(0.0_wp, 1, 3), item)
         do k = 1, 3
            expected = 0.0_wp
            do i = rows%start(wanted(k)) + 1, rows%start(wanted(k) + 1)
               expected(rows%dof(i)) = expected(rows%dof(i)) + rows%weight(i)
            end do
            associate (n => item(k)%n_node, one => item(k))
               call check_equal(error, one%node(1), (rows%own(wanted(k)) + 1)/2, "own node")
               call check_equal(error, one%n_slave, 1, "slave nodes")
               g = 0.0_wp
               g(:, one%node(:n)) = one%g(:, :n)
               call check_near(error, reshape(g, [60]), expected, tol, 1.0_wp, "gradient")
               call check_near(error, one%c(:, :n), one%g(:, :n), 0.0_wp, 1.0_wp, "at the end")
               do i = 1, n
                  call check_equal(error, count(one%node(:n) == one%node(i)), 1, "once each")
               end do
               call check_near(error, [one%gap0, one%dgap, one%gap1], &
                  [sum(expected*reshape(u0, [60])), sum(expected*reshape(du, [60])), &
                  sum(expected*reshape(u0 + du, [60]))], 4.0_wp*tol, 4.0_wp, "values")
               call check_near(error, one%size, rows%size(wanted(k)), 0.0_wp, 1.0_wp, "size")
            end associate
         end do
      end do
   end subroutine test_conditions

end module test_linear_rows
