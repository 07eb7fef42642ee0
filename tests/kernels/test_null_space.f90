!> Null space: P and DF, the reduced system, coupled constraints, the choice made anew.
module test_null_space
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_csr, only : csr_multiply, csr_multiply_transposed
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_null_space, only : null_space_factorise, null_space_free, null_space_init, &
      null_space_multipliers, null_space_solve, null_space_t, null_space_update, &
      obstacle_fill, obstacle_none, obstacle_pivot, obstacle_redundant
   use emcon_saddle_point, only : saddle_point_factorise, saddle_point_init, saddle_point_solve, &
      saddle_point_t
   use random_constraints, only : full_gradient, make_chain, make_problem, make_rows, problem_t, &
      tol_dp
   use sparse_samples, only : dense_of
   implicit none
   private
   public :: collect_null_space

   !> Samples: constraints with slave nodes of their own, and chains of constraints with standard
   !> and with nearly dual weights, in two parts, and numbered at random.
   integer, parameter :: n_sample = 6, n_chain = 40, sample_standard = 3, sample_dual = 4, &
      sample_parts = 5, sample_shuffled = 6
   !> Slave node before, own, next one.
   real(wp), parameter :: standard(3) = [1.0_wp, 4.0_wp, 1.0_wp]/6.0_wp, &
      dual(3) = [0.02_wp, 1.0_wp, -0.03_wp]
   !> Entries in a row of N so that chains of `n_chain` are eliminated, and so that they are not.
   integer, parameter :: n_many = 120, n_few = 4

contains

   subroutine collect_null_space(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("P^T Gb^T = 0 and G1 DF = 0", test_orthogonal), &
         test_case_t("reduced matrix is P^T N DF", test_reduced), &
         test_case_t("correction and multipliers solve the full system", test_solution), &
         test_case_t("correction and multipliers are the saddle point's", test_saddle_point), &
         test_case_t("multipliers are good to the kind of the state", test_multipliers), &
         test_case_t("components and bands of chains", test_components), &
         test_case_t("a poor pivot is passed over", test_pivot), &
         test_case_t("the choice follows the gradients", test_choice), &
         test_case_t("not possible: redundant constraints", test_redundant), &
         test_case_t("not possible: no common pivot", test_no_pivot), &
         test_case_t("not possible: entries of P that grow", test_growth), &
         test_case_t("not worth it: too many coupled", test_fill)]
   end subroutine collect_null_space

   subroutine make_sample(i_sample, problem)
      integer, intent(in) :: i_sample
      type(problem_t), intent(out) :: problem
      integer :: k

      select case (i_sample)
      case (sample_standard)
         call make_chain([(k, k = 1, n_chain)], standard, n_chain, n_many, problem)
      case (sample_dual)
         call make_chain([(k, k = 1, n_chain)], dual, n_chain, n_many, problem)
      case (sample_parts)
         call make_chain([(k, k = 1, n_chain)], standard, n_chain/4, n_many, problem)
      case (sample_shuffled)
         ! 17 and n_chain have no common factor.
         call make_chain([(1 + mod(17*k, n_chain), k = 1, n_chain)], standard, n_chain, n_many, &
            problem)
      case default
         call make_problem(problem)
      end select
   end subroutine make_sample

   subroutine prepare(i_sample, problem, null_space, error)
      integer, intent(in) :: i_sample
      type(problem_t), intent(out) :: problem
      type(null_space_t), intent(inout) :: null_space
      type(error_t), allocatable, intent(out) :: error
      logical :: is_singular

      call make_sample(i_sample, problem)
      call null_space_init(null_space, problem%set, size(problem%matrix%column), &
         problem%numbering)
      if (allocated(error)) return
      call check_equal(error, null_space%obstacle, obstacle_none, "obstacle")
      if (allocated(error)) return
      call null_space_factorise(null_space, problem%set, problem%matrix, .false., is_singular, &
         error)
      if (allocated(error)) return
      call check_true(error, .not. is_singular, "the reduced matrix is regular")
   end subroutine prepare

   subroutine test_orthogonal(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(null_space_t) :: null_space
      real(wp), allocatable :: product(:, :)
      integer :: k

      do k = 1, n_sample
         call prepare(k, problem, null_space, error)
         if (allocated(error)) return
         call check_equal(error, null_space%n_free, problem%numbering%n_unknown - problem%set%n, &
            "independent unknowns")
         product = real(matmul(dense_of(problem%set%force_rows), dense_of(null_space%p)), wp)
         call check_near(error, product, 0.0_wp*product, tol_dp, 1.0_wp, "Gb P")
         product = real(matmul(dense_of(problem%set%gap_rows), dense_of(null_space%d)), wp)
         call check_near(error, product, 0.0_wp*product, tol_dp, 1.0_wp, "G1 DF")
         if (allocated(error)) return
      end do
      call null_space_free(null_space)
   end subroutine test_orthogonal

   subroutine test_reduced(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(null_space_t) :: null_space
      real(wp), allocatable :: expected(:, :)
      integer :: k

      do k = 1, n_sample
         call prepare(k, problem, null_space, error)
         if (allocated(error)) return
         expected = real(matmul(transpose(dense_of(null_space%p)), &
            matmul(dense_of(problem%matrix), dense_of(null_space%d))), wp)
         call check_near(error, real(dense_of(null_space%reduced), wp), expected, tol_dp, &
            maxval(abs(expected)), "P^T N DF")
      end do
      call null_space_free(null_space)
   end subroutine test_reduced

   !> Correction and multipliers of the linear problem.
   subroutine solve(problem, null_space, dq, lam, error)
      type(problem_t), intent(in) :: problem
      type(null_space_t), intent(inout) :: null_space
      real(wp), allocatable, intent(out) :: dq(:), lam(:)
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: rest(:)

      allocate(dq, rest, source=problem%residual)
      allocate(lam, source=problem%set%lam)
      call null_space_solve(null_space, problem%set, problem%matrix, problem%residual, dq, error)
      if (allocated(error)) return
      call csr_multiply(problem%matrix, dq, rest)
      rest = rest + problem%residual
      call null_space_multipliers(null_space, problem%set, problem%numbering, rest, lam)
   end subroutine solve

   !> N dq - Gb^T lam = -r and G1 dq = -defect.
   subroutine test_solution(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(null_space_t) :: null_space
      real(wp), allocatable :: dq(:), lam(:), rest(:), force(:), gap(:)
      integer :: k

      do k = 1, n_sample
         call prepare(k, problem, null_space, error)
         if (allocated(error)) return
         call solve(problem, null_space, dq, lam, error)
         if (allocated(error)) return
         allocate(rest, force, source=dq)
         allocate(gap, source=lam)
         call csr_multiply(problem%matrix, dq, rest)
         call csr_multiply_transposed(problem%set%force_rows, lam, force)
         rest = rest + problem%residual - force
         call check_near(error, rest, 0.0_wp*rest, tol_dp, 1.0_wp + maxval(abs(dq)), "equilibrium")
         call csr_multiply(problem%set%gap_rows, dq, gap)
         call check_near(error, gap, -problem%set%defect, tol_dp, 1.0_wp + maxval(abs(dq)), "gaps")
         deallocate(rest, force, gap)
         if (allocated(error)) return
      end do
      call null_space_free(null_space)
   end subroutine test_solution

   subroutine test_saddle_point(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(null_space_t) :: null_space
      type(saddle_point_t) :: saddle
      real(wp), allocatable :: dq(:), lam(:), dq_saddle(:), lam_saddle(:)
      logical :: is_singular
      integer :: k

      do k = 1, n_sample
         call prepare(k, problem, null_space, error)
         if (allocated(error)) return
         call solve(problem, null_space, dq, lam, error)
         if (allocated(error)) return
         allocate(dq_saddle, source=dq)
         allocate(lam_saddle, source=lam)
         call saddle_point_init(saddle, problem%set, problem%matrix, error)
         if (allocated(error)) return
         call saddle_point_factorise(saddle, problem%set, problem%matrix, is_singular, error)
         if (allocated(error)) return
         call saddle_point_solve(saddle, problem%set, problem%residual, dq_saddle, lam_saddle, &
            error)
         if (allocated(error)) return
         call check_near(error, dq, dq_saddle, tol_dp, 1.0_wp + maxval(abs(dq)), "dq")
         call check_near(error, lam, lam_saddle, tol_dp, real(n_many, wp) + maxval(abs(lam)), "lam")
         deallocate(dq_saddle, lam_saddle)
         if (allocated(error)) return
      end do
      call saddle%solver%free()
      call null_space_free(null_space)
   end subroutine test_saddle_point

   !> Forces of given multipliers, in the kind of the state. The blocks have conditions of some 10.
   subroutine test_multipliers(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(null_space_t) :: null_space
      real(wp), allocatable :: force(:), g(:), c(:), lam(:)
      integer :: k, i

      do i = 1, n_sample
         call prepare(i, problem, null_space, error)
         if (allocated(error)) return
         allocate(lam, source=problem%set%lam)
         allocate(g, c, force, source=problem%residual)
         force = 0.0_wp
         do k = 1, problem%set%n
            call full_gradient(problem, k, g, c)
            force = force + problem%set%lam(k)*g
         end do
         call null_space_multipliers(null_space, problem%set, problem%numbering, force, lam)
         call check_near(error, lam, problem%set%lam, 100.0_wp*epsilon(1.0_wp), 1.0_wp, "lam")
         deallocate(lam, g, c, force)
         if (allocated(error)) return
      end do
      call null_space_free(null_space)
   end subroutine test_multipliers

   !> However a chain is numbered, its band has one diagonal on each side.
   subroutine test_components(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(null_space_t) :: null_space

      call prepare(1, problem, null_space, error)
      if (allocated(error)) return
      call check_equal(error, null_space%present%bands%n_block, problem%set%n, &
         "components of uncoupled constraints")
      call expect(sample_standard, [0, n_chain])
      call expect(sample_dual, [0, n_chain])
      call expect(sample_parts, [0, n_chain/4, n_chain])
      call expect(sample_shuffled, [0, n_chain])
      call null_space_free(null_space)

   contains

      subroutine expect(i_sample, start)
         integer, intent(in) :: i_sample, start(:)

         if (allocated(error)) return
         call prepare(i_sample, problem, null_space, error)
         if (allocated(error)) return
         associate (bands => null_space%present%bands)
            call check_equal(error, bands%start, start, "components")
            call check_equal(error, maxval(bands%lower), 1, "diagonals below")
            call check_equal(error, maxval(bands%upper), 1, "diagonals above")
         end associate
      end subroutine expect

   end subroutine test_components

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
      call make_rows(problem)
      call null_space_init(null_space, problem%set, size(problem%matrix%column), &
         problem%numbering)
      if (allocated(error)) return
      call check_equal(error, null_space%present%dependent(1), problem%numbering%unknown(2, 1), &
         "dependent unknown of the first constraint")
      call check_equal(error, null_space%present%dependent(3), problem%numbering%unknown(2, 7), &
         "dependent unknown of the third constraint")
      call null_space_free(null_space)
   end subroutine test_pivot

   !> A normal that turns while the pattern stands: what comes out is what a new null space gives,
   !> and until the next factorisation the old one serves.
   subroutine test_choice(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(null_space_t) :: null_space, new
      real(wp), allocatable :: dq(:, :), lam(:, :)
      logical :: is_singular
      integer :: old

      call prepare(sample_standard, problem, null_space, error)
      if (allocated(error)) return
      allocate(dq(size(problem%residual), 3), lam(problem%set%n, 2))
      call null_space_solve(null_space, problem%set, problem%matrix, problem%residual, dq(:, 1), &
         error)
      if (allocated(error)) return
      old = null_space%present%dependent(1)
      associate (item => problem%set%item(1))
         item%g = cshift(item%g, 1, dim=1)
         item%c = cshift(item%c, 1, dim=1)
      end associate
      call make_rows(problem)
      call null_space_update(null_space, problem%set, problem%numbering)
      call check_equal(error, null_space%obstacle, obstacle_none, "obstacle")
      call check_true(error, null_space%present%dependent(1) /= old, "the choice is another")
      call null_space_solve(null_space, problem%set, problem%matrix, problem%residual, dq(:, 2), &
         error)
      if (allocated(error)) return
      call check_near(error, dq(:, 2), dq(:, 1), 0.0_wp, 1.0_wp, "with the old factors")

      call null_space_factorise(null_space, problem%set, problem%matrix, .false., is_singular, &
         error)
      if (allocated(error)) return
      call null_space_solve(null_space, problem%set, problem%matrix, problem%residual, dq(:, 2), &
         error)
      if (allocated(error)) return
      call null_space_multipliers(null_space, problem%set, problem%numbering, problem%residual, &
         lam(:, 1))
      call null_space_init(new, problem%set, size(problem%matrix%column), &
         problem%numbering)
      if (allocated(error)) return
      call null_space_factorise(new, problem%set, problem%matrix, .false., is_singular, &
         error)
      if (allocated(error)) return
      call null_space_solve(new, problem%set, problem%matrix, problem%residual, dq(:, 3), error)
      if (allocated(error)) return
      call null_space_multipliers(new, problem%set, problem%numbering, problem%residual, &
         lam(:, 2))
      call check_near(error, dq(:, 2), dq(:, 3), 0.0_wp, 1.0_wp, "dq, to the last bit")
      call check_near(error, lam(:, 1), lam(:, 2), 0.0_wp, 1.0_wp, "lam, to the last bit")
      call null_space_free(null_space)
      call null_space_free(new)
   end subroutine test_choice

   !> Two nodes that face each other, each slave of the other.
   subroutine test_redundant(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem

      call make_problem(problem)
      problem%set%item(4) = problem%set%item(2)
      problem%set%item(4)%g = -problem%set%item(2)%g
      problem%set%item(4)%c = -problem%set%item(2)%c
      call expect_obstacle(problem, obstacle_redundant, error)
   end subroutine test_redundant

   !> Forces along x, the gap along y.
   subroutine test_no_pivot(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem

      call make_problem(problem)
      associate (item => problem%set%item(1))
         item%g = 0.0_wp
         item%c = 0.0_wp
         item%g(1, 1) = 1.0_wp
         item%c(2, 1) = 1.0_wp
      end associate
      call expect_obstacle(problem, obstacle_pivot, error)
   end subroutine test_no_pivot

   subroutine expect_obstacle(problem, obstacle, error)
      type(problem_t), intent(inout) :: problem
      integer, intent(in) :: obstacle
      type(error_t), allocatable, intent(out) :: error
      type(null_space_t) :: null_space
      logical :: is_singular

      call make_rows(problem)
      call null_space_init(null_space, problem%set, size(problem%matrix%column), &
         problem%numbering)
      if (allocated(error)) return
      call check_equal(error, null_space%obstacle, obstacle, "obstacle")
      call null_space_factorise(null_space, problem%set, problem%matrix, .false., is_singular, &
         error)
      if (allocated(error)) return
      call check_true(error, is_singular, "nothing is factorised")
      call null_space_free(null_space)
   end subroutine expect_obstacle

   !> x_k + 9 x_(k+1), the last one on a master: each pivot alone passes, but x_1 = 9^4 x_5.
   subroutine test_growth(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(null_space_t) :: null_space
      logical :: is_singular
      integer :: k, i

      call make_chain([(k, k = 1, 4)], standard, 4, n_many, problem)
      do k = 1, 4
         associate (item => problem%set%item(k))
            item%g = 0.0_wp
            item%g(1, 1) = 1.0_wp
            i = item%n_node
            if (k < 4) i = findloc(item%node(:i), k + 1, dim=1)
            item%g(1, i) = 9.0_wp
            item%c = item%g
         end associate
      end do
      call make_rows(problem)
      call null_space_init(null_space, problem%set, size(problem%matrix%column), &
         problem%numbering)
      if (allocated(error)) return
      call check_equal(error, null_space%obstacle, obstacle_none, "obstacle at first sight")
      call null_space_factorise(null_space, problem%set, problem%matrix, .false., is_singular, &
         error)
      if (allocated(error)) return
      call check_equal(error, null_space%obstacle, obstacle_pivot, "obstacle")
      call null_space_free(null_space)
   end subroutine test_growth

   subroutine test_fill(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      integer :: k

      call make_chain([(k, k = 1, n_chain)], standard, n_chain, n_few, problem)
      call expect_obstacle(problem, obstacle_fill, error)
   end subroutine test_fill

end module test_null_space
