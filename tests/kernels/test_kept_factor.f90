!> Corrections by a kept factor: those of the saddle point, for the matrix and rows it was made of.
module test_kept_factor
   use check, only : check_near, check_true, test_case_t
   use emcon_constraint_rows, only : constraints_rows
   use emcon_csr, only : csr_from_entries, csr_t
   use emcon_errors, only : error_t
   use emcon_kept_factor, only : kept_factor_condense, kept_factor_correct, kept_factor_free, &
      kept_factor_has_room, kept_factor_let_iterate, kept_factor_look, kept_factor_multipliers, &
      kept_factor_renew, kept_factor_serves, kept_factor_set_up, kept_factor_t, kept_factor_take
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_solver_registry, only : find_solver_row, solver_default, solver_row, solver_row_t
   use random_constraints, only : make_problem, make_symmetric, problem_t, tol_dp
   use small_scenes, only : shake
   use sparse_samples, only : dense_of
   implicit none
   private
   public :: collect_kept_factor

contains

   subroutine collect_kept_factor(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("the correction of the saddle point", test_correction), &
         test_case_t("the same with forces beside the gradients", test_aside), &
         test_case_t("the same by iterations", test_iterations), &
         test_case_t("no correction where nothing is left", test_fixed_point), &
         test_case_t("multipliers of contacts that give way are unknowns too", test_soft), &
         test_case_t("constraints in their multipliers alone", test_condense), &
         test_case_t("no factor of a pattern that is not symmetric", test_pattern), &
         test_case_t("no factor of what is not definite", test_indefinite), &
         test_case_t("strong curvature is told", test_curvature), &
         test_case_t("it is known beforehand for how many constraints there is room", test_room), &
         test_case_t("a constraint takes up what is along its gradients", test_along)]
   end subroutine collect_kept_factor

   !> [K, G^T; G, 0] [dq; -mu] = -[r; c] by LAPACK, with K = (N + N^T)/2.
   subroutine test_correction(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(kept_factor_t) :: kept
      real(dp), allocatable :: full(:, :), rhs(:, :), x(:, :)
      real(wp), allocatable :: dq(:)
      logical :: is_fit, is_singular
      integer :: n, m

      call prepare(problem, kept, is_fit, error)
      if (allocated(error)) return
      call check_true(error, kept%is_made .and. is_fit, "there is a factor")
      n = problem%numbering%n_unknown
      m = problem%set%n
      allocate(dq(n))
      call kept_factor_correct(kept, problem%set, problem%residual, dq, error)
      if (allocated(error)) return
      allocate(full(n + m, n + m), rhs(n + m, 1), x(n + m, 1), source=0.0_dp)
      full(:n, :n) = 0.5_dp*(dense_of(problem%base) + transpose(dense_of(problem%base)))
      full(n + 1:, :n) = dense_of(problem%set%gap_rows)
      full(:n, n + 1:) = transpose(full(n + 1:, :n))
      rhs(:n, 1) = -real(problem%residual, dp)
      rhs(n + 1:, 1) = -real(problem%set%defect, dp)
      call dense_solve(full, rhs, x, is_singular)
      call check_near(error, dq, real(x(:n, 1), wp), tol_dp, maxval(abs(dq)), "dq")
      call kept_factor_free(kept)
   end subroutine test_correction

   !> [K, F^T; G, 0] [dq; -mu] = -[r; c] by LAPACK: two contacts slide in two directions.
   subroutine test_aside(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(kept_factor_t) :: kept
      real(dp), allocatable :: full(:, :), rhs(:, :), x(:, :)
      real(wp), allocatable :: dq(:)
      logical :: is_fit, is_singular
      integer :: k, n, m

      call make_symmetric(problem)
      problem%set%n_permanent = 0
      do k = 2, 5, 3
         associate (item => problem%set%item(k))
            allocate(item%t(2, size(item%node), 2), item%t1(2, size(item%node), 2))
            call shake(item%t(:, :, 1), 1.0_wp)
            call shake(item%t(:, :, 2), 1.0_wp)
            item%t1 = item%t
            item%has_friction = .true.
            item%response%mu_sigma = [0.3_wp, -0.2_wp]
         end associate
      end do
      call constraints_rows(problem%set, problem%numbering)
      call kept_factor_set_up(kept, solver_default)
      call kept_factor_renew(kept, problem%base, error)
      if (.not. allocated(error)) call kept_factor_take(kept, problem%set, .false., is_fit, error)
      if (allocated(error)) return
      call check_true(error, kept%is_made .and. is_fit, "there is a factor")
      n = problem%numbering%n_unknown
      m = problem%set%n
      allocate(dq(n))
      call kept_factor_correct(kept, problem%set, problem%residual, dq, error)
      if (allocated(error)) return
      allocate(full(n + m, n + m), rhs(n + m, 1), x(n + m, 1), source=0.0_dp)
      full(:n, :n) = 0.5_dp*(dense_of(problem%base) + transpose(dense_of(problem%base)))
      full(n + 1:, :n) = dense_of(problem%set%gap_rows)
      full(:n, n + 1:) = transpose(dense_of(problem%set%force_rows))
      rhs(:n, 1) = -real(problem%residual, dp)
      rhs(n + 1:, 1) = -real(problem%set%defect, dp)
      call dense_solve(full, rhs, x, is_singular)
      call check_near(error, dq, real(x(:n, 1), wp), tol_dp, maxval(abs(dq)), "dq")
      call kept_factor_free(kept)
   end subroutine test_aside

   !> The same with an incomplete factor: asked for two digits it meets the constraints to
   !> round-off, corrections of what is left come to the end, and of many digits one is enough.
   !> Contacts that give way are not for it.
   subroutine test_iterations(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(kept_factor_t) :: kept
      real(dp), allocatable :: k(:, :), g(:, :), full(:, :), rhs(:, :), x(:, :)
      real(wp), allocatable :: dq(:), more(:), residual(:)
      type(solver_row_t) :: row
      logical :: is_fit, is_singular
      integer :: n, m, i

      row = solver_row(find_solver_row("ITERATIVE"))
      call make_symmetric(problem)
      n = problem%numbering%n_unknown
      m = problem%set%n
      k = 0.5_dp*(dense_of(problem%base) + transpose(dense_of(problem%base)))
      g = dense_of(problem%set%gap_rows)
      allocate(full(n + m, n + m), rhs(n + m, 1), x(n + m, 1), source=0.0_dp)
      allocate(dq(n), more(n))
      full(:n, :n) = k
      full(n + 1:, :n) = g
      full(:n, n + 1:) = transpose(g)
      rhs(:n, 1) = -real(problem%residual, dp)
      rhs(n + 1:, 1) = -real(problem%set%defect, dp)
      call dense_solve(full, rhs, x, is_singular)
      call kept_factor_set_up(kept, row%code)
      call kept_factor_let_iterate(kept, .true.)
      call kept_factor_renew(kept, problem%base, error)
      if (.not. allocated(error)) call kept_factor_take(kept, problem%set, .true., is_fit, error)
      if (allocated(error)) return
      call check_true(error, is_fit .and. kept%blocks%is_incomplete, "it is an incomplete factor")
      if (allocated(error)) return
      call kept_factor_correct(kept, problem%set, problem%residual, dq, error)
      if (allocated(error)) return
      call check_near(error, real(matmul(g, real(dq, dp)), wp), -problem%set%defect, tol_dp, &
         maxval(abs(dq)), "constraints")
      residual = problem%residual
      problem%set%defect = 0.0_wp
      ! Forces along the rows are of no use: as many digits as each is asked for.
      do i = 1, 8
         if (allocated(error)) return
         residual = real(matmul(k, real(dq, dp)) - rhs(:n, 1) + matmul(x(n + 1:, 1), g), wp)
         call kept_factor_correct(kept, problem%set, residual, more, error)
         dq = dq + more
      end do
      if (allocated(error)) return
      call check_near(error, dq, real(x(:n, 1), wp), tol_dp, maxval(abs(dq)), "dq in the end")
      if (allocated(error)) return
      kept%blocks%accuracy = 1.0e-13_dp
      problem%set%defect = -real(rhs(n + 1:, 1), wp)
      call kept_factor_correct(kept, problem%set, problem%residual, more, error)
      if (.not. allocated(error)) call check_near(error, more, real(x(:n, 1), wp), tol_dp, &
         maxval(abs(dq)), "dq at once")
      if (allocated(error)) return
      call check_condensed(problem, kept, k, g, error)
      if (allocated(error)) return
      problem%set%penalty%is_on = .true.
      call kept_factor_take(kept, problem%set, .true., is_fit, error)
      if (.not. allocated(error)) call check_true(error, .not. is_fit, "contacts that give way")
      call kept_factor_free(kept)
   end subroutine test_iterations

   !> Condensed by an incomplete factor that was asked for all digits: values by no multipliers and
   !> what they gain by these are right.
   subroutine check_condensed(problem, kept, k, g, error)
      type(problem_t), intent(in) :: problem
      type(kept_factor_t), intent(inout) :: kept
      real(dp), intent(in) :: k(:, :), g(:, :)
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: rhs(size(k, 1), 1 + size(g, 1)), x(size(k, 1), 1 + size(g, 1))
      real(wp) :: w(size(g, 1), size(g, 1)), free(size(g, 1))
      logical :: is_singular

      call kept_factor_condense(kept, problem%set, problem%residual, w, free, error)
      if (allocated(error)) return
      rhs(:, 1) = -real(problem%residual, dp)
      rhs(:, 2:) = transpose(g)
      call dense_solve(k, rhs, x, is_singular)
      call check_near(error, free, problem%set%defect + real(matmul(g, x(:, 1)), wp), tol_dp, &
         1.0_wp + maxval(abs(free)), "values")
      if (.not. allocated(error)) call check_near(error, w, real(matmul(g, x(:, 2:)), wp), tol_dp, &
         maxval(abs(w)), "gains")
   end subroutine check_condensed

   !> A residual that the constraints bear, and no defect.
   subroutine test_fixed_point(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(kept_factor_t) :: kept
      real(wp), allocatable :: dq(:)
      logical :: is_fit

      call prepare(problem, kept, is_fit, error)
      if (allocated(error)) return
      allocate(dq(problem%numbering%n_unknown))
      problem%set%defect = 0.0_wp
      problem%residual = real(matmul(transpose(dense_of(problem%set%gap_rows)), &
         real(problem%set%lam, dp)), wp)
      call kept_factor_correct(kept, problem%set, problem%residual, dq, error)
      if (allocated(error)) return
      call check_near(error, dq, 0.0_wp*dq, tol_dp, maxval(abs(problem%residual)), "dq")
      call kept_factor_free(kept)
   end subroutine test_fixed_point

   !> [K, G^T; G, -1/s] [dq; -mu] = -[r; -lack/s] by LAPACK. One contact does not push.
   subroutine test_soft(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(kept_factor_t) :: kept
      real(dp), allocatable :: full(:, :), rhs(:, :), x(:, :)
      real(wp), allocatable :: dq(:), mu(:)
      logical :: is_fit, is_singular
      integer :: n, m, k

      call prepare(problem, kept, is_fit, error)
      if (allocated(error)) return
      n = problem%numbering%n_unknown
      m = problem%set%n
      associate (set => problem%set)
         set%defect = 0.0_wp
         set%n_permanent = 0
         set%penalty%is_on = .true.
         set%penalty%slope = [(0.5_wp**k, k = 1, m)]
         set%penalty%lack = [((-2.0_wp)**(k - m), k = 1, m)]
         set%penalty%slope(m) = 0.0_wp
         call kept_factor_take(kept, set, .true., is_fit, error)
         if (allocated(error)) return
         call check_true(error, is_fit, "there is a factor")
         allocate(full(n + m, n + m), rhs(n + m, 1), x(n + m, 1), source=0.0_dp)
         allocate(dq(n), mu(m))
         call kept_factor_correct(kept, set, problem%residual, dq, error)
         if (allocated(error)) return
         call kept_factor_multipliers(kept, mu)
         full(:n, :n) = 0.5_dp*(dense_of(problem%base) + transpose(dense_of(problem%base)))
         full(:n, n + 1:) = transpose(dense_of(set%gap_rows))
         rhs(:n, 1) = -real(problem%residual, dp)
         ! Rows times the slope: without one the multiplier is to vanish.
         do k = 1, m
            full(n + k, :n) = real(set%penalty%slope(k), dp)*full(:n, n + k)
            full(n + k, n + k) = -1.0_dp
            rhs(n + k, 1) = real(set%penalty%lack(k), dp)
         end do
      end associate
      call dense_solve(full, rhs, x, is_singular)
      call check_near(error, dq, real(x(:n, 1), wp), tol_dp, maxval(abs(dq)), "dq")
      if (allocated(error)) return
      call check_near(error, mu, real(-x(n + 1:, 1), wp), tol_dp, maxval(abs(mu)), "mu")
      call kept_factor_free(kept)
   end subroutine test_soft

   !> Values after a correction with any multipliers: defect + G dq, K dq = G^T lam - r, by LAPACK.
   subroutine test_condense(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(kept_factor_t) :: kept
      real(dp), allocatable :: k(:, :), g(:, :), rhs(:, :), x(:, :)
      real(wp), allocatable :: w(:, :), free(:)
      logical :: is_fit, is_singular

      call prepare(problem, kept, is_fit, error)
      if (allocated(error)) return
      associate (set => problem%set, n => problem%numbering%n_unknown)
         allocate(w(set%n, set%n), free(set%n), rhs(n, 1), x(n, 1))
         call kept_factor_condense(kept, set, problem%residual, w, free, error)
         if (allocated(error)) return
         k = 0.5_dp*(dense_of(problem%base) + transpose(dense_of(problem%base)))
         g = dense_of(set%gap_rows)
         rhs(:, 1) = matmul(real(set%lam, dp), g) - real(problem%residual, dp)
         call dense_solve(k, rhs, x, is_singular)
         call check_near(error, free + matmul(w, set%lam(:set%n)), set%defect(:set%n) &
            + real(matmul(g, x(:, 1)), wp), tol_dp, 1.0_wp + maxval(abs(w)), "values")
      end associate
      call kept_factor_free(kept)
   end subroutine test_condense

   subroutine test_pattern(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(kept_factor_t) :: kept

      call make_problem(problem)
      call kept_factor_set_up(kept, solver_default)
      call kept_factor_renew(kept, problem%base, error)
      if (.not. allocated(error)) call check_true(error, .not. kept%is_made, "no factor")
      call kept_factor_free(kept)
   end subroutine test_pattern

   subroutine test_indefinite(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(kept_factor_t) :: kept
      logical :: is_fit

      call make_symmetric(problem)
      problem%base%value = -problem%base%value
      call kept_factor_set_up(kept, solver_default)
      call kept_factor_renew(kept, problem%base, error)
      if (allocated(error)) return
      call check_true(error, .not. kept%is_made, "no factor")
      call kept_factor_take(kept, problem%set, .true., is_fit, error)
      call check_true(error, .not. is_fit, "nothing to solve with")
      call kept_factor_free(kept)
   end subroutine test_indefinite

   !> Entries of W^T W are counted against those of the matrix, and there is room for none at last:
   !> told before the factor is made as after.
   subroutine test_room(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(kept_factor_t) :: kept
      logical :: is_fit, has_room
      integer :: k, n_entry

      call make_symmetric(problem)
      n_entry = size(problem%base%column)
      call kept_factor_set_up(kept, solver_default)
      do k = problem%set%n**2/n_entry + 1, 0, -1
         kept%most_products = k
         has_room = kept_factor_has_room(kept, problem%set%n, n_entry)
         call kept_factor_renew(kept, problem%base, error)
         if (.not. allocated(error)) call kept_factor_take(kept, problem%set, .true., is_fit, error)
         if (allocated(error)) return
         call check_true(error, is_fit .eqv. problem%set%n**2 <= k*n_entry, "taken")
         call check_true(error, is_fit .eqv. has_room, "foretold")
         call check_true(error, is_fit .eqv. kept_factor_has_room(kept, problem%set%n, 0), "made")
         kept%is_made = .false.
      end do
      call kept_factor_free(kept)
   end subroutine test_room

   !> At a kink the second derivative of a gap is as large as one likes.
   subroutine test_curvature(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(kept_factor_t) :: kept
      logical :: is_fit

      call prepare(problem, kept, is_fit, error)
      if (allocated(error)) return
      problem%set%lam = 0.01_wp
      call kept_factor_look(kept, problem%set, problem%numbering)
      call check_true(error, kept_factor_serves(kept, problem%set, .true.), "it is small")
      do while (kept_factor_serves(kept, problem%set, .true.))
         problem%set%item(3)%h = 2.0_wp*problem%set%item(3)%h
         call kept_factor_look(kept, problem%set, problem%numbering)
      end do
      call check_true(error, kept_factor_serves(kept, problem%set, .false.), "far from the end")
      problem%set%item(3)%h = 8.0_wp*problem%set%item(3)%h
      call check_true(error, kept_factor_serves(kept, problem%set, .false.), "nobody has looked")
      call kept_factor_look(kept, problem%set, problem%numbering)
      call check_true(error, .not. kept_factor_serves(kept, problem%set, .false.), "far too large")
      call kept_factor_free(kept)
   end subroutine test_curvature

   !> Forces along the discrete gradient, and what only a motion along the one at the end would see:
   !> h = g a^T + b c^T, however large. One that is neither is told.
   subroutine test_along(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(kept_factor_t) :: kept
      real(wp), allocatable :: g(:), c(:), a(:)
      logical :: is_fit
      integer :: i, k, n

      call prepare(problem, kept, is_fit, error)
      if (allocated(error)) return
      problem%set%lam = 1.0e3_wp
      do k = 1, problem%set%n
         associate (item => problem%set%item(k))
            n = size(item%g, 1)*item%n_node
            g = reshape(item%g(:, :item%n_node), [n])
            c = reshape(item%c(:, :item%n_node), [n])
            a = [(sin(1.0_wp*(i + k)), i = 1, n)]
            item%h(:n, :n) = spread(g, 2, n)*spread(a, 1, n) + spread(a, 2, n)*spread(c, 1, n)
         end associate
      end do
      call kept_factor_look(kept, problem%set, problem%numbering)
      call check_true(error, kept_factor_serves(kept, problem%set, .true.), "the constraints' own")
      if (allocated(error)) return
      associate (item => problem%set%item(1))
         n = size(item%g, 1)*item%n_node
         item%h(:n, :n) = transpose(item%h(:n, :n))
      end associate
      call kept_factor_look(kept, problem%set, problem%numbering)
      call check_true(error, .not. kept_factor_serves(kept, problem%set, .true.), "across them")
      call kept_factor_free(kept)
   end subroutine test_along

   !> The factor of a problem, with its constraints.
   subroutine prepare(problem, kept, is_fit, error)
      type(problem_t), intent(out) :: problem
      type(kept_factor_t), intent(inout) :: kept
      logical, intent(out) :: is_fit
      type(error_t), allocatable, intent(out) :: error

      call make_symmetric(problem)
      call kept_factor_set_up(kept, solver_default)
      call kept_factor_renew(kept, problem%base, error)
      if (.not. allocated(error)) call kept_factor_take(kept, problem%set, .true., is_fit, error)
   end subroutine prepare

end module test_kept_factor
