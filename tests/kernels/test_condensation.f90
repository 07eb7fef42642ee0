!> A step in the multipliers of its contacts alone, beside the whole linear system.
module test_condensation
   use check, only : check_near, check_true, test_case_t
   use emcon_condensation, only : condensation_free, condensation_make, condensation_renew, &
      condensation_t
   use emcon_correction, only : correction_free, correction_reset, correction_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_solver_registry, only : solver_default
   use emcon_steps, only : method_null_space, method_saddle_point
   use emcon_system, only : system_t
   use random_constraints, only : make_problem, make_rows, problem_t, tol_dp
   use sparse_samples, only : dense_of
   implicit none
   private
   public :: collect_condensation

contains

   subroutine collect_condensation(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("motion and values by any multipliers", test_motion), &
         test_case_t("another residual by the same tangent", test_renew), &
         test_case_t("what moves freely is told", test_free)]
   end subroutine collect_condensation

   !> N dq = F^T lam - r with the rows that always hold at 0 after it, whose multipliers are
   !> unknowns too: by LAPACK, for none, two and all but one of such rows, with curvature and
   !> without, with rows that are held, and by the saddle point, whose tangent is stiff along them.
   subroutine test_motion(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(system_t) :: system
      type(correction_t) :: correction
      type(condensation_t) :: condensation
      real(dp), allocatable :: full(:, :), rhs(:, :), x(:, :), force(:, :), gap(:, :)
      real(wp), allocatable :: lam(:), hold(:)
      integer :: n, m, k, case, kind
      logical :: is_singular

      call make_problem(problem)
      call make_rows(problem)
      system%space%numbering = problem%numbering
      system%matrix = problem%base
      n = problem%numbering%n_unknown
      associate (set => problem%set)
         force = dense_of(set%force_rows)
         gap = dense_of(set%gap_rows)
         do kind = 0, 15
            case = modulo(kind, 8)
            call correction_reset(correction, merge(method_saddle_point, method_null_space, &
               kind > 7), solver_default)
            m = min(set%n - 1, 2*(modulo(case, 6)/2))
            if (any(case == [4, 5])) m = set%n - 1
            set%n_permanent = m
            hold = 0.0_wp*set%defect
            if (case > 5) hold = [(real(k, wp), k = 1, size(hold))]
            condensation%hold = hold
            call condensation_make(condensation, system, set, correction, problem%residual, &
               mod(case, 2) == 0, error)
            if (allocated(error)) return
            lam = set%lam(m + 1:set%n)
            allocate(full(n + m, n + m), rhs(n + m, 1), x(n + m, 1), source=0.0_dp)
            full(:n, :n) = dense_of(problem%base)
            if (mod(case, 2) == 0) full(:n, :n) = dense_of(problem%matrix)
            do k = m + 1, size(hold)
               full(:n, :n) = full(:n, :n) + hold(k)*spread(force(k, :), 2, n) &
                  *spread(gap(k, :), 1, n)
            end do
            full(:n, n + 1:) = -transpose(force(:m, :))
            full(n + 1:, :n) = gap(:m, :)
            rhs(:n, 1) = matmul(real(lam, dp), force(m + 1:, :)) - real(problem%residual, dp)
            rhs(n + 1:, 1) = -real(set%defect(:m), dp)
            call dense_solve(full, rhs, x, is_singular)
            associate (move => condensation%motion, permanent => condensation%permanent)
               call check_near(error, move(:, 0) + matmul(move(:, 1:), lam), real(x(:n, 1), wp), &
                  tol_dp, maxval(abs(real(x, wp))), "motion")
               if (.not. allocated(error)) call check_near(error, permanent(:, 0) &
                  + matmul(permanent(:, 1:), lam), real(x(n + 1:, 1), wp), tol_dp, &
                  maxval(abs(real(x, wp))), "multipliers of what always holds")
            end associate
            if (allocated(error)) return
            call check_near(error, condensation%free + matmul(condensation%w, lam), &
               set%defect(m + 1:) + real(matmul(gap(m + 1:, :), x(:n, 1)), wp), tol_dp, &
               maxval(abs(real(x, wp))), "values")
            if (allocated(error)) return
            deallocate(full, rhs, x)
         end do
      end associate
      call condensation_free(condensation)
      call correction_free(correction)
   end subroutine test_motion

   !> What is left later, by the tangent of before, is what a new one with that tangent leaves.
   subroutine test_renew(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(system_t) :: system
      type(correction_t) :: correction
      type(condensation_t) :: later, anew
      integer :: m

      call make_problem(problem)
      call make_rows(problem)
      system%space%numbering = problem%numbering
      system%matrix = problem%base
      call correction_reset(correction, method_null_space, solver_default)
      associate (set => problem%set)
         do m = 0, set%n - 1, 2
            set%n_permanent = m
            set%defect = -3.0_wp*set%defect
            call condensation_make(later, system, set, correction, 0.5_wp*problem%residual, &
               .true., error)
            set%defect = set%defect/(-3.0_wp)
            if (.not. allocated(error)) call condensation_renew(later, set, problem%residual, error)
            if (.not. allocated(error)) call condensation_make(anew, system, set, correction, &
               problem%residual, .true., error)
            if (allocated(error)) return
            call check_near(error, [later%motion(:, 0), later%permanent(:, 0), later%free], &
               [anew%motion(:, 0), anew%permanent(:, 0), anew%free], tol_dp, &
               maxval(abs(anew%motion(:, 0))), "what is left")
            if (.not. allocated(error)) call check_near(error, [later%w], [anew%w], 0.0_wp, &
               1.0_wp, "and its flexibility")
            if (allocated(error)) return
         end do
      end associate
      call condensation_free(later)
      call condensation_free(anew)
      call correction_free(correction)
   end subroutine test_renew

   subroutine test_free(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(system_t) :: system
      type(correction_t) :: correction
      type(condensation_t) :: condensation

      call make_problem(problem)
      call make_rows(problem)
      system%space%numbering = problem%numbering
      system%matrix = problem%base
      system%matrix%value = 0.0_dp
      call correction_reset(correction, method_null_space, solver_default)
      call condensation_make(condensation, system, problem%set, correction, problem%residual, &
         .false., error)
      if (allocated(error)) return
      call check_true(error, condensation%is_singular, "it is singular")
      call condensation_free(condensation)
      call correction_free(correction)
   end subroutine test_free

end module test_condensation
