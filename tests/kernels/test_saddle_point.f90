!> Saddle point: the system of the paper, and the same correction as by null space.
module test_saddle_point
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_csr, only : csr_find, csr_from_entries, csr_multiply_transposed, csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_null_space, only : null_space_factorise, null_space_free, null_space_init, &
      null_space_multipliers, null_space_solve, null_space_t
   use emcon_saddle_point, only : saddle_point_factorise, saddle_point_free, saddle_point_init, &
      saddle_point_reset, saddle_point_solve, saddle_point_t
   use emcon_solver_registry, only : solver_default, solver_mumps
   use random_constraints, only : make_problem, problem_t, tol_dp
   use sparse_samples, only : dense_of
   implicit none
   private
   public :: collect_saddle_point

contains

   subroutine collect_saddle_point(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("blocks of the matrix", test_blocks), &
         test_case_t("same as null space", test_null_space), &
         test_case_t("dependent constraints are singular", test_singular), &
         test_case_t("contacts that give way are springs", test_springs), &
         test_case_t("symmetric: as such, negative pivots counted", test_symmetric)]
   end subroutine collect_saddle_point

   !> [N, -s Gb^T; s G1, 0].
   subroutine test_blocks(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(saddle_point_t) :: saddle
      real(wp), allocatable :: full(:, :)
      logical :: is_singular
      integer :: n
      real(wp) :: s

      call make_problem(problem)
      call saddle_point_init(saddle, problem%set, problem%matrix, error)
      if (allocated(error)) return
      call saddle_point_factorise(saddle, problem%set, problem%matrix, is_singular, error)
      if (allocated(error)) return
      call check_true(error, .not. is_singular, "it is regular")
      n = problem%numbering%n_unknown
      full = real(dense_of(saddle%full), wp)
      s = real(saddle%scale, wp)
      call check_near(error, full(:n, :n), real(dense_of(problem%matrix), wp), 0.0_wp, 1.0_wp, "N")
      call check_near(error, full(:n, n + 1:), &
         -s*transpose(real(dense_of(problem%set%force_rows), wp)), tol_dp, s, "Gb")
      call check_near(error, full(n + 1:, :n), s*real(dense_of(problem%set%gap_rows), wp), &
         tol_dp, s, "G1")
      call check_near(error, full(n + 1:, n + 1:), 0.0_wp*full(n + 1:, n + 1:), 0.0_wp, 1.0_wp, "0")
      call saddle%solver%free()
   end subroutine test_blocks

   !> One takes the residual with the contact forces of the old multipliers, the other without.
   subroutine test_null_space(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(saddle_point_t) :: saddle
      type(null_space_t) :: null_space
      real(wp), allocatable :: dq(:, :), lam(:, :), contact(:), rest(:)
      logical :: is_singular
      integer :: k

      do k = 1, 10
         call make_problem(problem)
         allocate(dq(size(problem%residual), 2), lam(problem%set%n, 2))
         allocate(contact(size(problem%residual)))
         call csr_multiply_transposed(problem%set%force_rows, problem%set%lam, contact)

         call saddle_point_init(saddle, problem%set, problem%matrix, error)
         if (allocated(error)) return
         call saddle_point_factorise(saddle, problem%set, problem%matrix, is_singular, error)
         if (allocated(error)) return
         call saddle_point_solve(saddle, problem%set, problem%residual - contact, dq(:, 1), &
            lam(:, 1), error)
         if (allocated(error)) return
         lam(:, 1) = problem%set%lam + lam(:, 1)

         call null_space_init(null_space, problem%set, size(problem%matrix%column), &
         problem%numbering)
         if (allocated(error)) return
         call null_space_factorise(null_space, problem%set, problem%matrix, .false., &
            is_singular, error)
         if (allocated(error)) return
         call null_space_solve(null_space, problem%set, problem%matrix, &
            problem%residual - contact, dq(:, 2), error)
         if (allocated(error)) return
         rest = problem%residual + matmul(real(dense_of(problem%matrix), wp), dq(:, 2))
         call null_space_multipliers(null_space, problem%set, problem%numbering, rest, lam(:, 2))

         call check_near(error, dq(:, 1), dq(:, 2), tol_dp, 1.0_wp + maxval(abs(dq)), "dq")
         call check_near(error, lam(:, 1), lam(:, 2), tol_dp, 10.0_wp + maxval(abs(lam)), "lam")
         deallocate(dq, lam, contact)
         if (allocated(error)) return
      end do
      call saddle%solver%free()
      call null_space_free(null_space)
   end subroutine test_null_space

   subroutine test_singular(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(saddle_point_t) :: saddle
      logical :: is_singular

      call make_problem(problem)
      problem%set%force_rows%value = 0.0_dp
      problem%set%gap_rows%value = 0.0_dp
      call saddle_point_init(saddle, problem%set, problem%matrix, error)
      if (allocated(error)) return
      call saddle_point_factorise(saddle, problem%set, problem%matrix, is_singular, error)
      if (allocated(error)) return
      call check_true(error, is_singular, "it is singular")
      call saddle%solver%free()
   end subroutine test_singular

   !> N dq - Gb^T dlam = -r, dlam = lack - slope (defect + G1 dq): by products of dense matrices.
   !> One of the slopes is so large that the contact hardly gives way.
   subroutine test_springs(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(saddle_point_t) :: saddle
      real(wp), allocatable :: dq(:), dlam(:), force(:, :), gap(:, :), spring(:)
      logical :: is_singular

      call make_problem(problem)
      associate (set => problem%set)
         set%penalty%is_on = .true.
         set%penalty%slope = [0.5_wp, 2.0_wp, 3.0_wp, 40.0_wp, 1.0e6_wp, 0.1_wp]
         set%penalty%lack = [0.3_wp, -0.2_wp, 0.0_wp, 1.0_wp, 0.5_wp, -2.0_wp]
         allocate(dq(size(problem%residual)), dlam(set%n))
         call saddle_point_init(saddle, set, problem%matrix, error)
         if (allocated(error)) return
         call saddle_point_factorise(saddle, set, problem%matrix, is_singular, error)
         if (allocated(error)) return
         call check_true(error, .not. is_singular, "it is regular")
         call saddle_point_solve(saddle, set, problem%residual, dq, dlam, error)
         if (allocated(error)) return
         force = real(dense_of(set%force_rows), wp)
         gap = real(dense_of(set%gap_rows), wp)
         spring = set%penalty%lack - set%penalty%slope*(set%defect + matmul(gap, dq))
         call check_near(error, dlam/(1.0_wp + set%penalty%slope), spring/(1.0_wp &
            + set%penalty%slope), &
            tol_dp, 10.0_wp + maxval(abs(dq)), "springs")
         call check_near(error, matmul(real(dense_of(problem%matrix), wp), dq) &
            - matmul(transpose(force), dlam), -problem%residual, tol_dp, &
            10.0_wp + maxval(abs(dlam)), "balance")
      end associate
      call saddle%solver%free()
   end subroutine test_springs

   !> N + N^T + shift and equal gradients: LDL^T gives the correction of LU. A definite N has as
   !> many negative pivots as there are constraints, fewer where one is repeated; what is not
   !> symmetric goes to LU.
   subroutine test_symmetric(error)
      type(error_t), allocatable, intent(out) :: error
      type(problem_t) :: problem
      type(saddle_point_t) :: saddle, other
      real(wp), allocatable :: dq(:, :), lam(:, :)
      logical :: is_singular
      integer :: n

      call make_problem(problem)
      n = size(problem%residual)
      call make_symmetric(problem%matrix)
      problem%set%gap_rows%value = problem%set%force_rows%value
      allocate(dq(n, 2), lam(problem%set%n, 2))
      call saddle_point_reset(saddle, solver_mumps)
      call solve(saddle, 1)
      call check_true(error, saddle%is_symmetric, "it is taken as symmetric")
      if (allocated(error)) return
      call check_equal(error, saddle%symmetric_solver%n_negative, problem%set%n, "negative pivots")
      call saddle_point_reset(other, solver_default)
      call solve(other, 2)
      if (allocated(error)) return
      call check_near(error, dq(:, 1), dq(:, 2), tol_dp, 1.0_wp + maxval(abs(dq)), "dq")
      call check_near(error, lam(:, 1), lam(:, 2), tol_dp, 10.0_wp + maxval(abs(lam)), "lam")

      problem%set%gap_rows%value(1) = 2.0_dp*problem%set%gap_rows%value(1) + 1.0_dp
      call solve(saddle, 1)
      call check_true(error, .not. saddle%is_symmetric, "it is not symmetric")
      problem%set%force_rows%value = 0.0_dp
      problem%set%gap_rows%value = 0.0_dp
      call saddle_point_factorise(saddle, problem%set, problem%matrix, is_singular, error)
      if (allocated(error)) return
      call check_true(error, is_singular .and. saddle%is_symmetric, "dependent: singular")
      call saddle_point_free(saddle)
      call saddle_point_free(other)

   contains

      subroutine solve(saddle, k)
         type(saddle_point_t), intent(inout) :: saddle
         integer, intent(in) :: k

         if (allocated(error)) return
         call saddle_point_init(saddle, problem%set, problem%matrix, error)
         if (.not. allocated(error)) call saddle_point_factorise(saddle, problem%set, &
            problem%matrix, is_singular, error)
         if (.not. allocated(error)) call check_true(error, .not. is_singular, "regular")
         if (.not. allocated(error)) call saddle_point_solve(saddle, problem%set, &
            problem%residual, dq(:, k), lam(:, k), error)
      end subroutine solve

   end subroutine test_symmetric

   !> N + N^T, definite by a diagonal that is larger than all others of its row.
   subroutine make_symmetric(matrix)
      type(csr_t), intent(inout) :: matrix
      type(csr_t) :: sum_of_both
      integer, allocatable :: row(:), column(:), slot(:)
      integer :: i, k, n

      n = size(matrix%column)
      column = matrix%column + 1
      allocate(row(n))
      do i = 1, matrix%n_row
         row(matrix%row_start(i) + 1:matrix%row_start(i + 1)) = i
      end do
      call csr_from_entries(sum_of_both, matrix%n_row, matrix%n_row, [row, column], [column, row], &
         slot)
      sum_of_both%value = 0.0_dp
      do k = 1, 2*n
         sum_of_both%value(slot(k)) = sum_of_both%value(slot(k)) &
            + matrix%value(1 + modulo(k - 1, n))
      end do
      do i = 1, matrix%n_row
         k = csr_find(sum_of_both, i, i)
         sum_of_both%value(k) = 2.0_dp*sum(abs(sum_of_both%value( &
            sum_of_both%row_start(i) + 1:sum_of_both%row_start(i + 1))))
      end do
      matrix = sum_of_both
   end subroutine make_symmetric

end module test_saddle_point
