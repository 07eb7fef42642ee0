!> Unknowns and prescribed degrees of freedom.
module test_numbering
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_linear_rows, only : linear_rows_t
   use emcon_numbering, only : add_to_dofs, gather_dependent, numbering_init, numbering_t, &
      pick_magnitudes, pick_unknowns, spread_dependent, unresolved_t
   use emcon_steps, only : step_t
   use linear_scenes, only : begin_rows, dense_terms, make_random_rows, put_row
   use random_constraints, only : make_problem, problem_t
   use random_draws, only : draw_random
   use small_scenes, only : clamp, prescribe, shake
   implicit none
   private
   public :: collect_numbering

contains

   subroutine collect_numbering(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("numbers run over the nodes", test_numbers), &
         test_case_t("from fields to vectors and back", test_fields), &
         test_case_t("nothing and everything prescribed", test_limits), &
         test_case_t("dependent freedoms: terms", test_terms), &
         test_case_t("dependent freedoms: T and its transpose", test_transpose), &
         test_case_t("dependent freedoms: order and dead ones", test_dependent), &
         test_case_t("what cannot be used", test_unresolved)]
   end subroutine collect_numbering

   !> Node 1 free, 2 held in y, 3 held (and said twice), 4 held in x, 5 without element.
   subroutine make(numbering)
      type(numbering_t), intent(out) :: numbering
      type(step_t) :: step

      allocate(step%prescribed(0))
      call prescribe(step, 2, 2, 0.5_wp)
      call prescribe(step, 4, 1, 0.5_wp)
      call clamp(step, [3, 3])
      call numbering_init(numbering, spread([.true., .true., .true., .true., .false.], &
         1, 2), step%prescribed)
   end subroutine make

   subroutine test_numbers(error)
      type(error_t), allocatable, intent(out) :: error
      type(numbering_t) :: numbering

      call make(numbering)
      call check_equal(error, numbering%n_unknown, 4, "unknowns")
      call check_equal(error, reshape(numbering%unknown, [10]), [1, 2, 3, 0, 0, 0, 0, 4, 0, 0], &
         "numbers")
      call check_equal(error, numbering%dof, [1, 2, 3, 8], "places")
   end subroutine test_numbers

   subroutine test_fields(error)
      type(error_t), allocatable, intent(out) :: error
      type(numbering_t) :: numbering
      real(wp) :: field(2, 5), vector(4)

      call make(numbering)
      field = reshape([1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp, 5.0_wp, 6.0_wp, 7.0_wp, 8.0_wp, &
         9.0_wp, 9.0_wp], [2, 5])
      call pick_unknowns(numbering, field, vector)
      call check_near(error, vector, [1.0_wp, 2.0_wp, 3.0_wp, 8.0_wp], 0.0_wp, 1.0_wp, "vector")
      call add_to_dofs(numbering, vector, -2.0_wp, field)
      call check_near(error, field, reshape([-1.0_wp, -2.0_wp, -3.0_wp, 4.0_wp, 5.0_wp, 6.0_wp, &
         7.0_wp, -8.0_wp, 9.0_wp, 9.0_wp], [2, 5]), 0.0_wp, 1.0_wp, "field")
   end subroutine test_fields

   subroutine test_limits(error)
      type(error_t), allocatable, intent(out) :: error
      type(numbering_t) :: numbering
      type(step_t) :: step
      real(wp) :: field(2, 3), vector(0)

      allocate(step%prescribed(0))
      call numbering_init(numbering, spread([.true., .true., .true.], 1, 2), step%prescribed)
      call check_equal(error, numbering%dof, [1, 2, 3, 4, 5, 6], "all free")
      call clamp(step, [1, 2, 3])
      call numbering_init(numbering, spread([.true., .true., .true.], 1, 2), step%prescribed)
      call check_equal(error, numbering%n_unknown, 0, "none free")
      field = 1.0_wp
      call pick_unknowns(numbering, field, vector)
      call add_to_dofs(numbering, vector, 1.0_wp, field)
      call check_near(error, field, 0.0_wp*field + 1.0_wp, 0.0_wp, 1.0_wp, "field")
   end subroutine test_limits

   !> T fulfils the rows, and keeps translations where these do: to the roundings of a few sums.
   subroutine test_terms(error)
      type(error_t), allocatable, intent(out) :: error
      type(linear_rows_t) :: linear
      type(problem_t) :: problem
      real(wp) :: field(60), total
      integer :: k, d, s

      call make_random_rows(linear)
      call make_problem(problem, linear)
      associate (numbering => problem%numbering)
         call check_equal(error, numbering%n_dependent, 8, "dependent freedoms")
         call check_equal(error, numbering%n_unknown, 60 - 10 - 8, "unknowns")
         call check_equal(error, numbering%dependent, [1, 2, 5, 6, 7, 8, 35, 36], "which ones")
         call check_true(error, all(numbering%unknown(:, [1, 3, 4, 18]) == 0), "no unknowns")
         do d = 1, 60
            associate (from => numbering%start(d) + 1, to => numbering%start(d + 1))
               call check_near(error, sum(numbering%weight(from:to)), 1.0_wp, &
                  16.0_wp*epsilon(1.0_wp), 1.0_wp, "sum of weights")
               if (any(numbering%dependent == d)) cycle
               call check_equal(error, numbering%term(from:to), [d], "a term of its own")
            end associate
         end do
         call draw_random(field)
         call spread_dependent(numbering, field)
         do k = 1, linear%n
            total = 0.0_wp
            do s = linear%start(k) + 1, linear%start(k + 1)
               total = total + linear%weight(s)*field(linear%dof(s))
            end do
            call check_near(error, total, 0.0_wp, 16.0_wp*epsilon(1.0_wp), 1.0_wp, "row")
         end do
      end associate
   end subroutine test_terms

   !> Against the full matrix; spreading and gathering are adjoint, also over prescribed freedoms.
   subroutine test_transpose(error)
      type(error_t), allocatable, intent(out) :: error
      type(linear_rows_t) :: linear
      type(problem_t) :: problem
      real(wp), allocatable :: t(:, :), vector(:), x(:)
      real(wp) :: force(2, 30), motion(2, 30), before
      real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)

      call make_random_rows(linear)
      call make_problem(problem, linear)
      associate (numbering => problem%numbering)
         allocate(t, source=dense_terms(numbering))
         allocate(vector(numbering%n_unknown), x(numbering%n_unknown))
         call shake(force, 1.0_wp)
         call shake(motion, 1.0_wp)
         call pick_unknowns(numbering, force, vector)
         call check_near(error, vector, matmul(transpose(t), reshape(force, [60])), tol, 1.0_wp, &
            "T^T f")
         call pick_magnitudes(numbering, abs(force), x)
         call check_near(error, x, matmul(transpose(abs(t)), reshape(abs(force), [60])), tol, &
            1.0_wp, "|T|^T |f|")
         call check_true(error, all(x >= abs(vector)*(1.0_wp - tol)), "magnitudes bound")
         call draw_random(x)
         call spread_dependent(numbering, motion)
         before = sum(force*motion)
         call gather_dependent(numbering, force)
         call check_near(error, sum(force*motion), before, tol, 10.0_wp, "work")
         call check_near(error, maxval(abs(force(:, [1, 3, 4, 18]))), 0.0_wp, 0.0_wp, 1.0_wp, &
            "no force is left at dependent freedoms")
         call check_near(error, pack(force, numbering%unknown > 0), vector, tol, 1.0_wp, &
            "gathered at the unknowns")
         motion = 0.0_wp
         call add_to_dofs(numbering, x, 2.0_wp, motion)
         call check_near(error, reshape(motion, [60]), 2.0_wp*matmul(t, x), tol, 1.0_wp, "T x")
      end associate
   end subroutine test_transpose

   !> A row whose own freedom is prescribed takes another one; what is dead counts as prescribed.
   subroutine test_dependent(error)
      type(error_t), allocatable, intent(out) :: error
      type(linear_rows_t) :: linear
      type(numbering_t) :: numbering
      type(step_t) :: step
      type(unresolved_t), allocatable :: unresolved(:)
      logical :: is_alive(2, 3)

      is_alive = .true.
      is_alive(:, 2) = .false.
      allocate(step%prescribed(0))
      call prescribe(step, 1, 1, 0.5_wp)
      call begin_rows(linear)
      call put_row(linear, 1, [1, 5], [1.0_wp, -2.0_wp])
      call put_row(linear, 6, [2, 3, 6], [0.5_wp, 0.25_wp, 1.0_wp])
      call put_row(linear, 2, [2, 4], [1.0_wp, 1.0_wp])
      linear%is_used(3) = .false.
      call numbering_init(numbering, is_alive, step%prescribed, linear, unresolved)
      call check_equal(error, size(unresolved), 0, "unresolved rows")
      call check_equal(error, numbering%dependent, [5, 6], "dependent freedoms")
      call check_equal(error, numbering%dof, [2], "unknowns")
      call check_equal(error, numbering%term, [1, 2, 3, 4, 1, 2, 3], "terms")
      call check_equal(error, numbering%column, [0, 1, 0, 0, 0, 1, 0], "columns")
      call check_near(error, numbering%weight(5:), [0.5_wp, -0.5_wp, -0.25_wp], 0.0_wp, 1.0_wp, &
         "weights")
   end subroutine test_dependent

   !> Rows left with prescribed freedoms only, or with nothing.
   subroutine test_unresolved(error)
      type(error_t), allocatable, intent(out) :: error
      type(linear_rows_t) :: linear
      type(numbering_t) :: numbering
      type(step_t) :: step
      type(unresolved_t), allocatable :: unresolved(:)

      allocate(step%prescribed(0))
      call prescribe(step, 3, 1, 0.5_wp)
      call prescribe(step, 3, 2, 0.5_wp)
      call begin_rows(linear)
      call put_row(linear, 1, [1, 3, 5], [1.0_wp, 1.0_wp, -1.0_wp])
      call put_row(linear, 3, [1, 3, 6], [0.5_wp, 0.5_wp, -1.0_wp])
      call put_row(linear, 5, [5, 6], [0.5_wp, -0.25_wp])
      call put_row(linear, 3, [1, 3, 5], [0.5_wp, 0.5_wp, -0.5_wp])
      call numbering_init(numbering, spread([.true., .true., .true.], 1, 2), step%prescribed, &
         linear, unresolved)
      call check_equal(error, numbering%dependent, [1], "dependent freedoms")
      call check_equal(error, unresolved%row, [2, 3, 4], "unresolved rows")
      call check_equal(error, unresolved(1)%dof, [6, 5], "left of the second row")
      call check_near(error, unresolved(1)%weight, [-1.0_wp, 0.5_wp], 0.0_wp, 1.0_wp, "weights")
      call check_equal(error, unresolved(2)%dof, [5, 6], "left of the third row")
      call check_near(error, unresolved(2)%weight, [0.5_wp, -0.25_wp], 0.0_wp, 1.0_wp, "weights")
      call check_equal(error, size(unresolved(3)%dof), 0, "nothing is left of the fourth")
   end subroutine test_unresolved

end module test_numbering
