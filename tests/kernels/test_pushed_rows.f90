!> Rows that push with what is known, beside rows that hold: the whole linear system by LAPACK.
module test_pushed_rows
   use check, only : check_near, check_true, test_case_t
   use emcon_correction, only : correction_free, correction_reset, correction_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_pushed_rows, only : pushed_rows_solve, pushed_rows_t
   use emcon_solver_registry, only : solver_default
   use emcon_steps, only : method_saddle_point
   use emcon_system, only : system_t
   use random_constraints, only : make_problem, make_rows, problem_t, tol_dp
   use sparse_samples, only : dense_of
   implicit none
   private
   public :: collect_pushed_rows

contains

   subroutine collect_pushed_rows(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("motion and multipliers of rows that hold", test_motion), &
         test_case_t("rows that hold and follow from others are told", test_dependent)]
   end subroutine collect_pushed_rows

   !> N y - F_h^T mu_h = F_k^T mu_k - r and G_h y = 0: of all rows, of every other one, and of none
   !> the multipliers are known.
   subroutine test_motion(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(system_t) :: system
      type(correction_t) :: correction
      type(pushed_rows_t) :: rows
      real(dp), allocatable :: full(:, :), rhs(:, :), x(:, :), force(:, :), gap(:, :)
      integer, allocatable :: held(:)
      integer :: n, k, case
      logical :: is_singular

      call make_problem(problem)
      call make_rows(problem)
      system%space%numbering = problem%numbering
      system%matrix = problem%base
      n = problem%numbering%n_unknown
      call correction_reset(correction, method_saddle_point, solver_default)
      associate (set => problem%set)
         force = dense_of(set%force_rows)
         gap = dense_of(set%gap_rows)
         do case = 0, 2
            rows%is_known = [(case == 0 .or. (case == 1 .and. mod(k, 2) == 0), k = 1, set%n_row)]
            rows%mu = set%lam(:set%n_row)
            held = pack([(k, k = 1, set%n_row)], .not. rows%is_known)
            associate (m => size(held))
               allocate(full(n + m, n + m), rhs(n + m, 1), x(n + m, 1), source=0.0_dp)
               full(:n, :n) = dense_of(problem%matrix)
               full(:n, n + 1:) = -transpose(force(held, :))
               full(n + 1:, :n) = gap(held, :)
               rhs(:n, 1) = matmul(merge(real(rows%mu, dp), 0.0_dp, rows%is_known), force) &
                  - real(problem%residual, dp)
               call dense_solve(full, rhs, x, is_singular)
            end associate
            call pushed_rows_solve(rows, system, set, correction, problem%residual, error)
            if (allocated(error)) return
            call check_true(error, .not. rows%is_singular, "there is a motion")
            if (allocated(error)) return
            call check_near(error, rows%y, real(x(:n, 1), wp), tol_dp, &
               maxval(abs(real(x, wp))), "motion")
            if (.not. allocated(error)) call check_near(error, rows%mu(held), &
               real(x(n + 1:, 1), wp), tol_dp, maxval(abs(real(x, wp))), "multipliers")
            if (.not. allocated(error)) call check_near(error, &
               merge(rows%mu - set%lam(:set%n_row), 0.0_wp, rows%is_known), 0.0_wp*rows%mu, &
               0.0_wp, 1.0_wp, "what is known stays")
            if (allocated(error)) return
            deallocate(full, rhs, x)
         end do
      end associate
      call correction_free(correction)
   end subroutine test_motion

   !> The same row twice: as two that hold, and as one that holds beside one that pushes.
   subroutine test_dependent(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(system_t) :: system
      type(correction_t) :: correction
      type(pushed_rows_t) :: rows
      integer :: k, case

      call make_problem(problem)
      call correction_reset(correction, method_saddle_point, solver_default)
      associate (set => problem%set)
         set%item(2) = set%item(1)
         call make_rows(problem)
         system%space%numbering = problem%numbering
         system%matrix = problem%base
         do case = 0, 1
            rows%is_known = [(k == case, k = 1, set%n_row)]
            rows%mu = set%lam(:set%n_row)
            call pushed_rows_solve(rows, system, set, correction, problem%residual, error)
            if (.not. allocated(error)) call check_true(error, rows%is_singular .neqv. case == 1, &
               "only two that hold follow from each other")
            if (allocated(error)) return
         end do
      end associate
      call correction_free(correction)
   end subroutine test_dependent

end module test_pushed_rows
