!> Corrections of the constrained system: which method serves, and what has to be dropped.
module test_correction
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraints, only : constraints_select
   use emcon_correction, only : correction_factorise, correction_free, correction_lay_out, &
      correction_multipliers, correction_reason, correction_reset, correction_solve, correction_t, &
      correction_work
   use emcon_csr, only : csr_multiply, csr_multiply_transposed
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_linear_rows, only : linear_rows_t
   use emcon_solver_registry, only : solver_default
   use emcon_steps, only : method_null_space, method_saddle_point
   use emcon_system, only : system_t
   use linear_scenes, only : make_random_rows
   use random_constraints, only : make_chain, make_problem, make_rows, problem_t, tol_dp
   implicit none
   private
   public :: collect_correction

contains

   subroutine collect_correction(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("no common pivot: saddle point, as long as it lasts", test_pivot), &
         test_case_t("too many coupled: saddle point", test_fill), &
         test_case_t("contact of dependent freedoms", test_dependent), &
         test_case_t("what a correction works that closes gaps alone", test_work), &
         test_case_t("symmetric matrices, definite and not", test_symmetric), &
         test_case_t("redundant constraints are named, by either method", test_redundant)]
   end subroutine collect_correction

   !> Lay out, factorise, solve; the two right-hand sides are those of `problem`.
   subroutine correct(correction, problem, dq, is_singular, error)
      type(correction_t), intent(inout) :: correction
      type(problem_t), intent(inout) :: problem
      real(wp), allocatable, intent(out) :: dq(:)
      logical, intent(out) :: is_singular
      type(error_t), allocatable, intent(out) :: error
      type(system_t) :: system
      real(wp) :: dlam(problem%set%n)

      is_singular = .true.
      system%space%numbering = problem%numbering
      system%matrix = problem%base
      allocate(dq, source=problem%residual)
      call make_rows(problem)
      call correction_lay_out(correction, system, problem%set)
      if (allocated(error)) return
      call correction_multipliers(correction, system, problem%set, problem%residual)
      call correction_factorise(correction, system, problem%set, is_singular, error)
      if (allocated(error) .or. is_singular) return
      call correction_solve(correction, problem%set, problem%residual, dq, dlam, error)
   end subroutine correct

   !> The matrix holds the multipliers: they are set to zero before each comparison.
   subroutine compare(correction, problem, falls_back, error)
      type(correction_t), intent(inout) :: correction
      type(problem_t), intent(inout) :: problem
      logical, intent(in) :: falls_back
      type(error_t), allocatable, intent(out) :: error
      type(correction_t) :: saddle
      real(wp), allocatable :: dq(:), expected(:)
      logical :: is_singular
      integer :: k

      do k = 1, problem%set%n
         problem%set%item(k)%h = 0.0_wp
      end do
      call correct(correction, problem, dq, is_singular, error)
      if (allocated(error)) return
      call check_true(error, .not. is_singular, "regular")
      call check_true(error, correction%fell_back .eqv. falls_back, "solved as a saddle point")
      call check_true(error, (correction_reason(correction) /= "") .eqv. falls_back, "a reason")
      if (allocated(error)) return
      call correction_reset(saddle, method_saddle_point, solver_default)
      call correct(saddle, problem, expected, is_singular, error)
      if (allocated(error)) return
      call check_true(error, .not. saddle%fell_back, "the saddle point was asked for")
      call check_near(error, dq, expected, tol_dp, 1.0_wp + maxval(abs(dq)), "dq")
      call correction_free(saddle)
   end subroutine compare

   !> The gradient at the end is orthogonal to that of the forces, then parallel again.
   subroutine test_pivot(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(correction_t) :: correction
      integer :: k

      call make_problem(problem)
      call correction_reset(correction, method_null_space, solver_default)
      problem%set%item(1)%g = 0.0_wp
      problem%set%item(1)%g(1, 1) = 1.0_wp
      do k = 1, 3
         problem%set%item(1)%c = 0.0_wp
         problem%set%item(1)%c(merge(2, 1, k == 2), 1) = 1.0_wp
         ! Otherwise the gap does not depend on what the force moves.
         problem%set%item(1)%c(1, 2:) = 0.5_wp
         call compare(correction, problem, k == 2, error)
         if (allocated(error)) return
         call check_true(error, correction%uses_null_space .neqv. k == 2, "null space in use")
      end do
      call correction_free(correction)
   end subroutine test_pivot

   !> Multipliers of forces that constraints make are told all the same: a kept factor may serve.
   subroutine test_fill(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(correction_t) :: correction
      real(wp), allocatable :: dq(:), expected(:)
      logical :: is_singular
      integer :: k

      call make_chain([(k, k = 1, 30)], [1.0_wp, 4.0_wp, 1.0_wp]/6.0_wp, 30, 4, problem)
      call correction_reset(correction, method_null_space, solver_default)
      call compare(correction, problem, .true., error)
      if (allocated(error)) return
      expected = [(1.0_wp + modulo(7*k, 5), k = 1, problem%set%n)]
      call csr_multiply_transposed(problem%set%force_rows, expected, problem%residual)
      problem%set%lam = 0.0_wp
      call correct(correction, problem, dq, is_singular, error)
      if (allocated(error)) return
      call check_true(error, correction%knows_multipliers, "multipliers are known")
      call check_near(error, problem%set%lam, expected, tol_dp, maxval(expected), "multipliers")
      call correction_free(correction)
   end subroutine test_fill

   !> Slave and master nodes that follow others: null space against saddle point, and the
   !> multipliers of forces that constraints make.
   subroutine test_dependent(error)
      type(error_t), allocatable, intent(out) :: error
      type(linear_rows_t) :: linear
      type(problem_t) :: problem
      type(correction_t) :: correction
      real(wp), allocatable :: dq(:), expected(:)
      logical :: is_singular

      call make_random_rows(linear)
      ! With all of them so many constraints are coupled that a saddle point is cheaper.
      linear%is_used([2, 3, 6, 7]) = .false.
      call make_problem(problem, linear)
      call check_equal(error, problem%numbering%n_dependent, 4, "dependent freedoms")
      if (allocated(error)) return
      call correction_reset(correction, method_null_space, solver_default)
      call compare(correction, problem, .false., error)
      if (allocated(error)) return
      call check_true(error, correction%uses_null_space, "by null space")
      expected = problem%set%lam
      call csr_multiply_transposed(problem%set%force_rows, expected, problem%residual)
      problem%set%lam = 0.0_wp
      call correct(correction, problem, dq, is_singular, error)
      if (allocated(error)) return
      call check_near(error, problem%set%lam, expected, tol_dp, 1.0_wp, "multipliers")
      call correction_free(correction)
   end subroutine test_dependent

   !> A correction that closes gaps from a state of rest works c.N c, by either method, though there
   !> is no residual.
   subroutine test_work(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(correction_t) :: correction
      real(wp), allocatable :: dq(:), image(:)
      real(wp) :: work(2)
      logical :: is_singular
      integer :: i, k

      call make_problem(problem)
      do k = 1, problem%set%n
         problem%set%item(k)%h = 0.0_wp
      end do
      problem%residual = 0.0_wp
      do i = 1, 2
         call correction_reset(correction, merge(method_null_space, method_saddle_point, i == 1), &
            solver_default)
         call correct(correction, problem, dq, is_singular, error)
         if (allocated(error)) return
         allocate(image(size(dq)))
         call csr_multiply(problem%base, dq, image)
         work(i) = correction_work(correction, dq)
         call check_near(error, work(i), dot_product(dq, image), tol_dp, &
            dot_product(abs(dq), abs(image)), "c.N c")
         deallocate(image)
         call correction_free(correction)
      end do
      call check_near(error, work(1), work(2), tol_dp, abs(work(2)), "by either method")
      call check_true(error, abs(work(1)) > sqrt(epsilon(1.0_wp)), "it works")
   end subroutine test_work

   !> Without constraints: N dq = -r, also where a symmetric matrix is not definite.
   subroutine test_symmetric(error)
      type(error_t), allocatable, intent(out) :: error
      type(correction_t) :: correction
      type(system_t) :: system
      type(problem_t) :: problem
      real(wp), allocatable :: dq(:), image(:)
      real(wp) :: dlam(0)
      logical :: is_singular
      integer :: none(0), k, i, s

      call make_chain([1, 2, 3, 4], [1.0_wp, 4.0_wp, 1.0_wp]/6.0_wp, 4, 0, problem)
      call make_rows(problem)
      call constraints_select(problem%set, none)
      system%space%numbering = problem%numbering
      system%matrix = problem%matrix
      system%is_symmetric = .true.
      allocate(dq, image, source=problem%residual)
      do k = 1, 4
         ! Diagonal entries of 64 outweigh the rest of a row; 2: one of them is negative, 3: all are
         ! positive again, 4: a row and its column vanish.
         do i = 1, system%matrix%n_row
            do s = system%matrix%row_start(i) + 1, system%matrix%row_start(i + 1)
               system%matrix%value(s) = merge(64.0_dp, 1.0_dp, system%matrix%column(s) == i - 1)
               if (k == 2 .and. all([i, system%matrix%column(s) + 1] == 5)) then
                  system%matrix%value(s) = -system%matrix%value(s)
               end if
               if (k == 4 .and. any([i, system%matrix%column(s) + 1] == 5)) then
                  system%matrix%value(s) = 0.0_dp
               end if
            end do
         end do
         call correction_lay_out(correction, system, problem%set)
         if (allocated(error)) return
         call correction_factorise(correction, system, problem%set, is_singular, error)
         if (allocated(error)) return
         call check_true(error, is_singular .eqv. k == 4, "singular")
         if (k == 4) exit
         call correction_solve(correction, problem%set, problem%residual, dq, dlam, error)
         if (allocated(error)) return
         call csr_multiply(system%matrix, dq, image)
         call check_near(error, image, -problem%residual, tol_dp, 1.0_wp, "N dq")
      end do
      call correction_free(correction)
   end subroutine test_symmetric

   !> Three times the same constraint.
   subroutine test_redundant(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(correction_t) :: correction
      real(wp), allocatable :: dq(:)
      logical :: is_singular
      integer :: m

      call make_problem(problem)
      problem%set%item(4) = problem%set%item(2)
      problem%set%item(5) = problem%set%item(2)
      do m = 1, 2
         call correction_reset(correction, merge(method_null_space, method_saddle_point, &
            m == 1), solver_default)
         call correct(correction, problem, dq, is_singular, error)
         if (allocated(error)) return
         call check_true(error, is_singular, "singular")
         call check_equal(error, correction%n_redundant, 2, "redundant constraints")
         call check_equal(error, correction%redundant, [4, 5], "redundant constraints")
      end do
      call correction_free(correction)
   end subroutine test_redundant

end module test_correction
