!> A step in the multipliers of its contacts alone, beside the whole linear system.
module test_condensation
   use check, only : check_near, check_true, test_case_t
   use emcon_condensation, only : condensation_free, condensation_make, condensation_move, &
      condensation_renew, condensation_t, condensation_take
   use emcon_correction, only : correction_free, correction_reset, correction_t
   use emcon_errors, only : error_t
   use emcon_kept_factor, only : kept_factor_free, kept_factor_may_condense, kept_factor_renew, &
      kept_factor_set_up, kept_factor_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_solver_registry, only : solver_default
   use emcon_steps, only : method_null_space, method_saddle_point
   use emcon_system, only : system_t
   use random_constraints, only : make_problem, make_rows, make_symmetric, problem_t, tol_dp
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
         test_case_t("the same by a factor that is kept", test_kept), &
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
      real(wp), allocatable :: lam(:), hold(:), dq(:), held(:)
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
            dq = 0.0_wp*problem%residual
            held = 0.0_wp*set%defect(:m)
            call condensation_move(condensation, correction%kept, lam, dq, held, error)
            if (.not. allocated(error)) call check_near(error, dq, real(x(:n, 1), wp), tol_dp, &
               maxval(abs(real(x, wp))), "motion")
            if (.not. allocated(error)) call check_near(error, held, real(x(n + 1:, 1), wp), &
               tol_dp, maxval(abs(real(x, wp))), "multipliers of what always holds")
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
      real(wp), allocatable :: by_later(:), by_anew(:)
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
            if (.not. allocated(error)) call moves_by(later, problem, correction%kept, by_later, &
               error)
            if (.not. allocated(error)) call moves_by(anew, problem, correction%kept, by_anew, &
               error)
            if (allocated(error)) return
            call check_near(error, [by_later, later%free], [by_anew, anew%free], tol_dp, &
               maxval(abs(by_anew)), "what is left")
            if (.not. allocated(error)) call check_near(error, [later%w], [anew%w], 0.0_wp, &
               1.0_wp, "and its flexibility")
            if (allocated(error)) return
         end do
      end associate
      call condensation_free(later)
      call condensation_free(anew)
      call correction_free(correction)
   end subroutine test_renew

   !> Motion and multipliers of what always holds where contacts push with 1, 2, 3, ...
   subroutine moves_by(condensation, problem, kept, found, error)
      type(condensation_t), intent(in) :: condensation
      type(problem_t), intent(in) :: problem
      type(kept_factor_t), intent(inout) :: kept
      real(wp), allocatable, intent(out) :: found(:)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: dq(size(problem%residual)), held(condensation%n_permanent)
      integer :: k

      call condensation_move(condensation, kept, [(real(k, wp), k = 1, size(condensation%free))], &
         dq, held, error)
      found = [dq, held]
   end subroutine moves_by

   !> By the symmetric part K of the tangent and the gradients of the rows, K dq = G^T lam - r, with
   !> the rows that always hold at 0 after it; and again for what is left later, by the same rows.
   subroutine test_kept(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(kept_factor_t) :: kept
      type(condensation_t) :: condensation
      real(dp), allocatable :: full(:, :), rhs(:, :), x(:, :), gap(:, :)
      real(wp), allocatable :: found(:), lam(:)
      integer :: n, m, k, time
      logical :: is_singular

      call make_symmetric(problem)
      call make_rows(problem)
      call kept_factor_set_up(kept, solver_default)
      call kept_factor_renew(kept, problem%base, error)
      if (allocated(error)) return
      n = problem%numbering%n_unknown
      associate (set => problem%set)
         call check_true(error, kept_factor_may_condense(kept, set%n_row), "it may condense them")
         gap = dense_of(set%gap_rows)
         do m = 0, set%n - 1
            set%n_permanent = m
            lam = [(real(k, wp), k = 1, set%n_row - m)]
            allocate(full(n + m, n + m), rhs(n + m, 1), x(n + m, 1), source=0.0_dp)
            full(:n, :n) = 0.5_dp*(dense_of(problem%base) + transpose(dense_of(problem%base)))
            full(:n, n + 1:) = -transpose(gap(:m, :))
            full(n + 1:, :n) = gap(:m, :)
            do time = 1, 2
               set%defect = -3.0_wp*set%defect
               problem%residual = 0.5_wp*problem%residual
               if (.not. allocated(error)) call condensation_take(condensation, kept, set, &
                  problem%residual, time == 1, error)
               if (.not. allocated(error)) call moves_by(condensation, problem, kept, found, error)
               if (allocated(error)) return
               rhs(:n, 1) = matmul(real(lam, dp), gap(m + 1:, :)) - real(problem%residual, dp)
               rhs(n + 1:, 1) = -real(set%defect(:m), dp)
               call dense_solve(full, rhs, x, is_singular)
               call check_near(error, found, real(x(:, 1), wp), tol_dp, maxval(abs(found)), &
                  "motion and multipliers of what always holds")
               if (.not. allocated(error)) call check_near(error, condensation%free &
                  + matmul(condensation%w, lam), set%defect(m + 1:) &
                  + real(matmul(gap(m + 1:, :), x(:n, 1)), wp), tol_dp, maxval(abs(found)), &
                  "values")
            end do
            deallocate(full, rhs, x)
         end do
      end associate
      call kept_factor_free(kept)
   end subroutine test_kept

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
