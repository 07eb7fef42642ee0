!> Ties and equations as rows over degrees of freedom.
module test_linear_rows
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_linear_rows, only : linear_rows_begin_step, linear_rows_init, linear_rows_t
   use emcon_scene, only : prescribed_t, scene_t, step_t
   use emcon_text, only : to_text
   use linear_scenes, only : add_equation, add_tie_by_hand
   use small_scenes, only : block_t, make_block, prescribe
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
         test_case_t("held ends are merged, by direction", test_merged), &
         test_case_t("both ends into the middle", test_middle), &
         test_case_t("held neighbours stay apart", test_held_neighbour), &
         test_case_t("closed chains have no ends", test_closed), &
         test_case_t("equations", test_equations), &
         test_case_t("one step after the other", test_steps)]
   end subroutine collect_linear_rows

   !> A block of 4 x 1 cells whose upper nodes 6..10 follow the lower ones 1..5, a tie of nonsense
   !> geometry: `n` slave nodes, each between two masters.
   subroutine make(n, scene, linear, step)
      integer, intent(in) :: n
      type(scene_t), intent(out) :: scene
      type(linear_rows_t), intent(out) :: linear
      type(step_t), intent(out) :: step
      type(block_t) :: block
      integer :: k

      call make_block(scene, "CPE4", [4, 1], block)
      call add_tie_by_hand(scene, [(5 + k, k = 1, n)], &
         reshape([(k, k + 1, k = 1, n)], [2, n]), &
         reshape([(real(k, wp)/8.0_wp, 1.0_wp - real(k, wp)/8.0_wp, k = 1, n)], [2, n]), &
         [(real(k, wp), k = 1, n)])
      allocate(step%prescribed(0))
      call linear_rows_init(linear, scene)
   end subroutine make

   subroutine test_candidates(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(linear_rows_t) :: linear
      type(step_t) :: step

      call make(2, scene, linear, step)
      call add_equation(scene, [10, 1], [2, 1], [1.0_wp, -2.0_wp])
      call linear_rows_init(linear, scene)
      call check_equal(error, linear%n, 5, "candidates")
      call check_equal(error, linear%tie, [1, 1, 1, 1, 0], "ties")
      call check_equal(error, linear%place, [1, 1, 2, 2, 1], "places")
      call check_equal(error, linear%own, [11, 12, 13, 14, 20], "own freedoms")
      call check_near(error, linear%size, [1.0_wp, 1.0_wp, 2.0_wp, 2.0_wp, 4.0_wp], 0.0_wp, &
         1.0_wp, "sizes: of the rows, and the extent")
      call check_true(error, .not. any(linear%is_used), "none is used yet")
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
      type(step_t) :: step

      call make(3, scene, linear, step)
      call linear_rows_begin_step(linear, scene, step%prescribed)
      call check_row(error, linear, 1, [1, 3, 11], [-0.125_wp, -0.875_wp, 1.0_wp])
      call check_row(error, linear, 2, [2, 4, 12], [-0.125_wp, -0.875_wp, 1.0_wp])
      call check_row(error, linear, 6, [6, 8, 16], [-0.375_wp, -0.625_wp, 1.0_wp])
   end subroutine test_rows

   !> The first slave node is held in y: its row goes to the second, in y only.
   subroutine test_merged(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(linear_rows_t) :: linear
      type(step_t) :: step

      call make(4, scene, linear, step)
      call prescribe(step, 6, 2, 0.0_wp)
      call linear_rows_begin_step(linear, scene, step%prescribed)
      call check_row(error, linear, 1, [1, 3, 11], [-0.125_wp, -0.875_wp, 1.0_wp])
      call check_true(error, .not. linear%is_used(2), "the row of the end is merged")
      call check_equal(error, linear%start(3), linear%start(2), "it has no entries")
      call check_row(error, linear, 4, [2, 4, 6, 12, 14], &
         [-0.125_wp, -0.875_wp - 0.5_wp, -1.5_wp, 1.0_wp, 2.0_wp]/3.0_wp)
      call check_near(error, linear%size(4), 3.0_wp, 0.0_wp, 1.0_wp, "sizes add up")
      call check_near(error, linear%size(3), 2.0_wp, 0.0_wp, 1.0_wp, "not in x")
      call check_row(error, linear, 8, [8, 10, 18], [-0.5_wp, -0.5_wp, 1.0_wp])
   end subroutine test_merged

   subroutine test_middle(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(linear_rows_t) :: linear
      type(step_t) :: step

      call make(3, scene, linear, step)
      call prescribe(step, 6, 1, 0.0_wp)
      call prescribe(step, 8, 1, 0.0_wp)
      call linear_rows_begin_step(linear, scene, step%prescribed)
      call check_true(error, all(linear%is_used .eqv. &
         [.false., .true., .true., .true., .false., .true.]), "the middle row is left in x")
      call check_row(error, linear, 3, [1, 3, 5, 7, 11, 13, 15], [-0.125_wp, -0.875_wp - 0.5_wp, &
         -1.5_wp - 1.125_wp, -1.875_wp, 1.0_wp, 2.0_wp, 3.0_wp]/6.0_wp)
      call check_near(error, linear%size(3), 6.0_wp, 0.0_wp, 1.0_wp, "sizes add up")
   end subroutine test_middle

   subroutine test_held_neighbour(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(linear_rows_t) :: linear
      type(step_t) :: step

      call make(2, scene, linear, step)
      call prescribe(step, 6, 1, 0.0_wp)
      call prescribe(step, 7, 1, 0.0_wp)
      call linear_rows_begin_step(linear, scene, step%prescribed)
      call check_true(error, all(linear%is_used), "two held ends of a chain of two")
      call check_row(error, linear, 1, [1, 3, 11], [-0.125_wp, -0.875_wp, 1.0_wp])
      ! The end of an isolated row has no neighbour at all.
      call make(1, scene, linear, step)
      call prescribe(step, 6, 1, 0.0_wp)
      call linear_rows_begin_step(linear, scene, step%prescribed)
      call check_true(error, all(linear%is_used), "a chain keeps one multiplier")
   end subroutine test_held_neighbour

   subroutine test_closed(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(linear_rows_t) :: linear
      type(step_t) :: step

      call make(3, scene, linear, step)
      scene%tie(1)%rows%neighbour = reshape([3, 2, 1, 3, 2, 1], [2, 3])
      call prescribe(step, 6, 1, 0.0_wp)
      call linear_rows_begin_step(linear, scene, step%prescribed)
      call check_true(error, all(linear%is_used), "all rows stand")
   end subroutine test_closed

   !> Coefficients relative to the largest; terms of one freedom become one.
   subroutine test_equations(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(linear_rows_t) :: linear
      type(step_t) :: step

      call make(1, scene, linear, step)
      call add_equation(scene, [4, 2, 4], [2, 1, 2], [8.0_wp, -2.0_wp, -4.0_wp])
      call linear_rows_init(linear, scene)
      call linear_rows_begin_step(linear, scene, step%prescribed)
      call check_row(error, linear, 3, [3, 8], [-0.25_wp, 0.5_wp])
   end subroutine test_equations

   !> What one step merges, the next one has back.
   subroutine test_steps(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(linear_rows_t) :: linear, fresh
      type(step_t) :: step, free

      call make(3, scene, linear, step)
      call make(3, scene, fresh, free)
      call prescribe(step, 6, 1, 0.0_wp)
      call linear_rows_begin_step(linear, scene, step%prescribed)
      call linear_rows_begin_step(linear, scene, free%prescribed)
      call linear_rows_begin_step(fresh, scene, free%prescribed)
      call check_true(error, all(linear%is_used), "all rows are back")
      call check_equal(error, linear%start, fresh%start, "starts")
      call check_near(error, linear%size, fresh%size, 0.0_wp, 1.0_wp, "sizes")
      call check_near(error, linear%weight(:linear%start(7)), fresh%weight(:fresh%start(7)), &
         0.0_wp, 1.0_wp, "weights")
   end subroutine test_steps

end module test_linear_rows
