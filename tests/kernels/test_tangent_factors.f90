!> Factors of tangents that are definite, symmetric or neither: each solves, by the solver it is for.
module test_tangent_factors
   use check, only : check_near, check_true, test_case_t
   use emcon_constraints, only : constraint_set_t, constraints_are_gradients
   use emcon_csr, only : csr_find, csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_solver_registry, only : solver_default
   use emcon_tangent_factors, only : tangent_factors_create, tangent_factors_free, &
      tangent_factors_make, tangent_factors_solve, tangent_factors_t
   use random_constraints, only : make_problem, make_rows, problem_t, tol_dp
   use sparse_samples, only : dense_of, quad_mesh_matrix
   implicit none
   private
   public :: collect_tangent_factors

contains

   subroutine collect_tangent_factors(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a definite, an indefinite and a general matrix in turn", test_kinds), &
         test_case_t("a matrix without a factor", test_singular), &
         test_case_t("which constraints push along their gradients", test_gradients)]
   end subroutine collect_tangent_factors

   !> The same factors take one after the other, and the first one again.
   subroutine test_kinds(error)
      type(error_t), allocatable, intent(out) :: error
      type(tangent_factors_t) :: factors
      type(csr_t) :: matrix
      real(wp), allocatable :: x(:), rhs(:), got(:)
      logical :: is_singular
      integer :: k, i

      call tangent_factors_create(factors, solver_default)
      do k = 1, 4
         call quad_mesh_matrix(6, 5, merge(0.3_dp, 0.0_dp, k == 3), matrix, error)
         if (allocated(error)) return
         if (k == 2) then
            i = csr_find(matrix, 9, 9)
            matrix%value(i) = -matrix%value(i)
         end if
         call tangent_factors_make(factors, matrix, k /= 3, is_singular, error)
         if (allocated(error)) return
         call check_true(error, .not. is_singular, "it has factors")
         call check_true(error, factors%is_definite .eqv. (k == 1 .or. k == 4), &
            "what is definite is taken as such")
         if (allocated(error)) return
         x = [(real(mod(7*i, 11) - 5, wp), i = 1, matrix%n_row)]
         rhs = real(matmul(dense_of(matrix), real(x, dp)), wp)
         got = 0.0_wp*x
         call tangent_factors_solve(factors, rhs, got, error)
         if (allocated(error)) return
         got = real(matmul(dense_of(matrix), real(got, dp)), wp)
         call check_near(error, got, rhs, tol_dp, maxval(abs(rhs)), "A x")
         if (allocated(error)) return
      end do
      call tangent_factors_free(factors)
   end subroutine test_kinds

   subroutine test_singular(error)
      type(error_t), allocatable, intent(out) :: error
      type(tangent_factors_t) :: factors
      type(csr_t) :: matrix
      logical :: is_singular

      call quad_mesh_matrix(3, 3, 0.0_dp, matrix, error)
      if (allocated(error)) return
      matrix%value = 0.0_dp
      call tangent_factors_create(factors, solver_default)
      call tangent_factors_make(factors, matrix, .true., is_singular, error)
      if (allocated(error)) return
      call check_true(error, is_singular .and. .not. factors%is_definite, "there are no factors")
      call tangent_factors_free(factors)
   end subroutine test_singular

   !> Those of equilibrium, without friction, whose forces are along the gradients at the end.
   subroutine test_gradients(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(constraint_set_t) :: set

      call make_problem(problem)
      call make_rows(problem)
      set = problem%set
      set%frequency = 0.0_wp
      call check_true(error, .not. constraints_are_gradients(set), "forces along other directions")
      if (allocated(error)) return
      set%force_rows = set%gap_rows
      call check_true(error, constraints_are_gradients(set), "forces along gradients")
      if (allocated(error)) return
      set%frequency = 1.0_wp
      call check_true(error, .not. constraints_are_gradients(set), "a step with inertia")
      if (allocated(error)) return
      set%frequency = 0.0_wp
      set%item(1)%has_friction = .true.
      call check_true(error, .not. constraints_are_gradients(set), "one of them rubs")
   end subroutine test_gradients

end module test_tangent_factors
