!> Null space: P and DF, the reduced system, the choice of dependent unknowns.
module test_null_space
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraints, only : constraints_rows
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_null_space, only : null_space_factorise, null_space_init, null_space_multipliers, &
      null_space_solve, null_space_t
   use random_constraints, only : make_problem, problem_t, tol_dp
   use sparse_samples, only : dense_of
   implicit none
   private
   public :: collect_null_space

contains

   subroutine collect_null_space(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("P^T Gb^T = 0 and G1 DF = 0", test_orthogonal), &
         test_case_t("reduced matrix is P^T N DF", test_reduced), &
         test_case_t("correction and multipliers solve the full system", test_solution), &
         test_case_t("a poor pivot is passed over", test_pivot), &
         test_case_t("impossible without an unknown of its own", test_impossible)]
   end subroutine collect_null_space

   subroutine prepare(problem, null_space, error)
      type(problem_t), intent(out) :: problem
      type(null_space_t), intent(inout) :: null_space
      type(error_t), allocatable, intent(out) :: error
      logical :: is_singular

      call make_problem(problem)
      call null_space_init(null_space, problem%set, problem%matrix, problem%numbering, error)
      if (allocated(error)) return
      if (.not. null_space%is_possible) return
      call null_space_factorise(null_space, problem%set, problem%matrix, is_singular, error)
   end subroutine prepare

   subroutine test_orthogonal(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(null_space_t) :: null_space
      real(wp), allocatable :: product(:, :)
      integer :: k

      do k = 1, 10
         call prepare(problem, null_space, error)
         if (allocated(error)) return
         call check_true(error, null_space%is_possible, "elimination is possible")
         call check_equal(error, null_space%n_free, problem%numbering%n_unknown - problem%set%n, &
            "independent unknowns")
         product = real(matmul(dense_of(problem%set%force_rows), dense_of(null_space%p)), wp)
         call check_near(error, product, 0.0_wp*product, tol_dp, 1.0_wp, "Gb P")
         product = real(matmul(dense_of(problem%set%gap_rows), dense_of(null_space%d)), wp)
         call check_near(error, product, 0.0_wp*product, tol_dp, 1.0_wp, "G1 DF")
         if (allocated(error)) return
      end do
      call null_space%solver%free()
   end subroutine test_orthogonal

   subroutine test_reduced(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(null_space_t) :: null_space
      real(wp), allocatable :: expected(:, :)

      call prepare(problem, null_space, error)
      if (allocated(error)) return
      expected = real(matmul(transpose(dense_of(null_space%p)), &
         matmul(dense_of(problem%matrix), dense_of(null_space%d))), wp)
      call check_near(error, real(dense_of(null_space%reduced), wp), expected, tol_dp, &
         maxval(abs(expected)), "P^T N DF")
      call null_space%solver%free()
   end subroutine test_reduced

   !> N dq - Gb^T lam = -r and G1 dq = -defect.
   subroutine test_solution(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(null_space_t) :: null_space
      real(wp), allocatable :: dq(:), lam(:), rest(:)
      integer :: k

      do k = 1, 10
         call prepare(problem, null_space, error)
         if (allocated(error)) return
         allocate(dq, rest, source=problem%residual)
         allocate(lam, source=problem%set%lam)
         call null_space_solve(null_space, problem%set, problem%matrix, problem%residual, dq, error)
         if (allocated(error)) return
         rest = problem%residual + matmul(real(dense_of(problem%matrix), wp), dq)
         call null_space_multipliers(null_space, problem%set, rest, lam)
         rest = rest - matmul(lam, real(dense_of(problem%set%force_rows), wp))
         call check_near(error, rest, 0.0_wp*rest, tol_dp, 1.0_wp + maxval(abs(dq)), "equilibrium")
         call check_near(error, matmul(real(dense_of(problem%set%gap_rows), wp), dq), &
            -problem%set%defect, tol_dp, 1.0_wp + maxval(abs(dq)), "gaps")
         deallocate(dq, lam, rest)
         if (allocated(error)) return
      end do
      call null_space%solver%free()
   end subroutine test_solution

   !> The slave node's larger unknown is taken; where both of its entries vanish, a master's.
   subroutine test_pivot(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(null_space_t) :: null_space

      call make_problem(problem)
      associate (item => problem%set%item)
         item(1)%g(:, 1) = [0.6_wp, 0.8_wp]
         item(1)%c(:, 1) = [0.6_wp, 0.8_wp]
         item(3)%g(:, 1) = 0.0_wp
         item(3)%c(:, 1) = 0.0_wp
         item(3)%node(2) = 7                     ! in no other constraint
         item(3)%g(:, 2) = [0.0_wp, 1.0_wp]
         item(3)%c(:, 2) = [0.0_wp, 1.0_wp]
      end associate
      call constraints_rows(problem%set, problem%numbering)
      call null_space_init(null_space, problem%set, problem%matrix, problem%numbering, error)
      if (allocated(error)) return
      call check_equal(error, null_space%dependent(1), problem%numbering%unknown(2, 1), &
         "dependent unknown of the first constraint")
      call check_equal(error, null_space%dependent(3), problem%numbering%unknown(2, 7), &
         "dependent unknown of the third constraint")
      call null_space%solver%free()
   end subroutine test_pivot

   !> Two constraints on the same unknowns only.
   subroutine test_impossible(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(null_space_t) :: null_space

      call make_problem(problem)
      problem%set%item(2) = problem%set%item(1)
      call constraints_rows(problem%set, problem%numbering)
      call null_space_init(null_space, problem%set, problem%matrix, problem%numbering, error)
      if (allocated(error)) return
      call check_true(error, .not. null_space%is_possible, "elimination is impossible")
   end subroutine test_impossible

end module test_null_space
