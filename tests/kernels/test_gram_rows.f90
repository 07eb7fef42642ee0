!> Rows in the measure of a diagonal: what of a vector is along none of them, by dense algebra.
module test_gram_rows
   use check, only : check_near, check_true, test_case_t
   use emcon_csr, only : csr_pick_rows, csr_t
   use emcon_errors, only : error_t
   use emcon_gram_rows, only : gram_rows_free, gram_rows_meet, gram_rows_project, gram_rows_t, &
      gram_rows_take
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_solver_registry, only : solver_create, solver_default
   use emcon_sparse_solver, only : matrix_definite
   use random_constraints, only : make_problem, problem_t, tol_dp
   use sparse_samples, only : dense_of
   implicit none
   private
   public :: collect_gram_rows

contains

   subroutine collect_gram_rows(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("projections and least vectors", test_project), &
         test_case_t("a row twice does not fit", test_dependent)]
   end subroutine collect_gram_rows

   !> y - W (W^T W)^-1 W^T y, and W (W^T W)^-1 of a rate, of all rows, of some, and of none.
   subroutine test_project(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(gram_rows_t) :: rows
      real(dp), allocatable :: w(:, :), mu(:, :), root(:), y(:), before(:), rate(:)
      logical :: is_fit, is_singular
      integer :: m, n, k

      call make_problem(problem)
      call solver_create(solver_default, matrix_definite, rows%solver)
      n = problem%numbering%n_unknown
      root = [(1.0_dp + modulo(0.37_dp*k, 1.0_dp), k = 1, n)]
      before = [(sin(1.7_dp*k), k = 1, n)]
      do m = problem%set%n_row, 0, -3
         call gram_rows_take(rows, problem%set%gap_rows, m, root, is_fit, error)
         if (allocated(error)) return
         call check_true(error, is_fit, "they fit")
         if (allocated(error)) return
         w = dense_of(problem%set%gap_rows)
         w = w(:m, :)/spread(root, 1, m)
         rate = [(cos(0.9_dp*k), k = 1, m)]
         allocate(mu(m, 2))
         call dense_solve(matmul(w, transpose(w)), reshape([matmul(w, before), rate], [m, 2]), &
            mu, is_singular)
         y = before
         call gram_rows_project(rows, y, error)
         if (.not. allocated(error)) call check_near(error, real(y, wp), &
            real(before - matmul(mu(:, 1), w), wp), tol_dp, 1.0_wp, "what is along no row")
         if (allocated(error)) return
         call gram_rows_meet(rows, rate, y, error)
         if (.not. allocated(error)) call check_near(error, real(y, wp), &
            real(matmul(mu(:, 2), w), wp), tol_dp, maxval(abs(real(y, wp))) + 1.0_wp, &
            "the least vector of a rate")
         if (allocated(error)) return
         deallocate(mu)
      end do
      call gram_rows_free(rows)
   end subroutine test_project

   subroutine test_dependent(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(gram_rows_t) :: rows
      type(csr_t) :: twice
      logical :: is_fit
      integer :: k

      call make_problem(problem)
      call solver_create(solver_default, matrix_definite, rows%solver)
      call csr_pick_rows(problem%set%gap_rows, [1, 2, 1], twice)
      call gram_rows_take(rows, twice, 3, [(1.0_dp, k = 1, twice%n_col)], is_fit, error)
      if (.not. allocated(error)) call check_true(error, .not. is_fit, "one follows from another")
      call gram_rows_free(rows)
   end subroutine test_dependent

end module test_gram_rows
