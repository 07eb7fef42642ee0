!> Factors of block-diagonal matrices: against LAPACK, what is kept, the bits of any number of
!> threads.
module test_diagonal_blocks
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_chosen_solver, only : chosen_solver_t
   use emcon_csr, only : csr_from_entries, csr_t
   use emcon_diagonal_blocks, only : blocks_analyse, blocks_factorise, blocks_free, &
      blocks_multiply, blocks_reach, blocks_solve, diagonal_blocks_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_solver_registry, only : solver_create, solver_default
   use emcon_sparse_solver, only : matrix_definite
   use sparse_samples, only : dense_of, quad_mesh_matrix
   implicit none
   private
   public :: collect_diagonal_blocks

   !> Round-off of a factorisation, for matrices whose condition is below 1e4.
   real(wp), parameter :: tol = 1.0e4_wp*max(real(epsilon(1.0_dp), wp), epsilon(1.0_wp))

   !> Of `make_sample`: three meshes, and 100 single unknowns, four of which make 1/64 of all.
   integer, parameter :: n_block = 3 + 100/4

contains

   subroutine collect_diagonal_blocks(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("both halves solve", test_solve), &
         test_case_t("a sparse right-hand side is a full one", test_reach), &
         test_case_t("the same bits in any number of threads", test_threads), &
         test_case_t("blocks that stay the same keep their factors", test_kept), &
         test_case_t("powers of two keep the bits", test_powers_of_two), &
         test_case_t("one block that is not definite", test_indefinite), &
         test_case_t("no factor of a pattern that is not symmetric", test_pattern), &
         test_case_t("incomplete factors know their pattern", test_incomplete)]
   end subroutine collect_diagonal_blocks

   subroutine test_solve(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(diagonal_blocks_t) :: blocks
      real(dp), allocatable :: b(:), x(:), expected(:, :), symmetric(:, :)
      logical :: is_singular

      call make_sample(a, error)
      if (.not. allocated(error)) call prepare(blocks, a, 1, error)
      if (allocated(error)) return
      allocate(b(a%n_row), x(a%n_row), expected(a%n_row, 1))
      call random_number(b)
      call solve(blocks, b, x, error)
      if (allocated(error)) return
      symmetric = 0.5_dp*(dense_of(a) + transpose(dense_of(a)))
      call dense_solve(symmetric, reshape(b, [size(b), 1]), expected, is_singular)
      call check_near(error, real(x, wp), real(expected(:, 1), wp), tol, real(maxval(abs(x)), wp), &
         "x")
      if (.not. allocated(error)) call check_equal(error, blocks%n_block, n_block, &
         "the large ones alone")
      call blocks_free(blocks)
   end subroutine test_solve

   !> Its entries stand in four blocks.
   subroutine test_reach(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(diagonal_blocks_t) :: blocks
      integer, parameter :: column(5) = [0, 1, 2, 7, 20]
      real(dp), parameter :: value(5) = [1.0_dp, -2.0_dp, 3.0_dp, 0.5_dp, 4.0_dp]
      real(dp), allocatable :: b(:), x(:), y(:), z(:)
      integer, allocatable :: index(:)
      integer :: n

      call make_sample(a, error)
      if (.not. allocated(error)) call prepare(blocks, a, 1, error)
      if (allocated(error)) return
      allocate(b(a%n_row), z(a%n_row), source=0.0_dp)
      allocate(x(a%n_row), y(a%n_row), index(a%n_row))
      b(column + 1) = value
      call blocks_solve(blocks, .false., b, y, error)
      if (.not. allocated(error)) call blocks_reach(blocks, column, value, n, index, x, error)
      if (allocated(error)) return
      z(index(:n) + 1) = x(:n)
      call check_near(error, real(z, wp), real(y, wp), tol, real(maxval(abs(y)), wp), "half")
      if (.not. allocated(error)) call check_true(error, n < a%n_row, "most of it is zero")
      call blocks_free(blocks)
   end subroutine test_reach

   subroutine test_threads(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_thread(4) = [2, 3, 4, 7]
      type(csr_t) :: a
      type(diagonal_blocks_t) :: blocks
      real(dp), allocatable :: b(:), x(:), first(:)
      integer :: k

      call make_sample(a, error)
      if (.not. allocated(error)) call prepare(blocks, a, 1, error)
      if (allocated(error)) return
      allocate(b(a%n_row), x(a%n_row), first(a%n_row))
      call random_number(b)
      call solve(blocks, b, first, error)
      call blocks_free(blocks)
      do k = 1, size(n_thread)
         if (allocated(error)) return
         call prepare(blocks, a, n_thread(k), error)
         if (.not. allocated(error)) call solve(blocks, b, x, error)
         if (.not. allocated(error)) call check_true(error, all(abs(x - first) <= 0.0_dp), "bits")
         call blocks_free(blocks)
      end do
   end subroutine test_threads

   subroutine test_kept(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(diagonal_blocks_t) :: blocks
      logical :: is_singular, is_new

      call make_sample(a, error)
      if (.not. allocated(error)) call prepare(blocks, a, 2, error)
      if (.not. allocated(error)) call check_equal(error, blocks%n_factor, n_block, &
         "one for each")
      if (.not. allocated(error)) call blocks_analyse(blocks, a, is_new, error)
      if (.not. allocated(error)) call check_true(error, .not. is_new, "the pattern is known")
      a%value(1) = 2.0_dp*a%value(1)
      if (.not. allocated(error)) call blocks_factorise(blocks, a, is_singular, error)
      if (.not. allocated(error)) call check_equal(error, blocks%n_factor, 2*n_block, &
         "another scale")
      a%value(2) = 0.75_dp*a%value(2)
      if (.not. allocated(error)) call blocks_factorise(blocks, a, is_singular, error)
      if (.not. allocated(error)) call check_equal(error, blocks%n_factor, 2*n_block + 1, &
         "one has changed")
      call blocks_free(blocks)
   end subroutine test_kept

   subroutine test_powers_of_two(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(diagonal_blocks_t) :: blocks
      real(dp), allocatable :: b(:), x(:), first(:)

      call make_sample(a, error)
      if (.not. allocated(error)) call prepare(blocks, a, 1, error)
      if (allocated(error)) return
      allocate(b(a%n_row), x(a%n_row), first(a%n_row))
      call random_number(b)
      call solve(blocks, b, first, error)
      call blocks_free(blocks)
      if (allocated(error)) return
      a%value = 2.0_dp**(-37)*a%value
      call prepare(blocks, a, 1, error)
      if (.not. allocated(error)) call solve(blocks, b, x, error)
      if (.not. allocated(error)) call check_true(error, all(abs(x*2.0_dp**(-37) - first) &
         <= 0.0_dp), "bits")
      call blocks_free(blocks)
   end subroutine test_powers_of_two

   subroutine test_indefinite(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(diagonal_blocks_t) :: blocks
      logical :: is_new, is_singular

      call make_sample(a, error)
      if (allocated(error)) return
      a%value(size(a%value)) = -1.0_dp
      call solver_create(solver_default, matrix_definite, blocks%kind)
      call blocks_analyse(blocks, a, is_new, error)
      if (.not. allocated(error)) call blocks_factorise(blocks, a, is_singular, error)
      if (.not. allocated(error)) call check_true(error, is_singular, "singular")
      call blocks_free(blocks)
   end subroutine test_indefinite

   subroutine test_pattern(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(diagonal_blocks_t) :: blocks
      integer, allocatable :: slot(:)
      logical :: is_new

      call csr_from_entries(a, 3, 3, [1, 2, 3, 1], [1, 2, 3, 3], slot)
      call solver_create(solver_default, matrix_definite, blocks%kind)
      call blocks_analyse(blocks, a, is_new, error)
      if (.not. allocated(error)) call check_true(error, .not. blocks%is_symmetric, "above")
      if (allocated(error)) return
      call csr_from_entries(a, 3, 3, [1, 2, 3, 3], [1, 2, 3, 1], slot)
      call blocks_analyse(blocks, a, is_new, error)
      if (.not. allocated(error)) call check_true(error, is_new .and. .not. blocks%is_symmetric, &
         "below")
      call blocks_free(blocks)
   end subroutine test_pattern

   !> The blocks keep no columns: the same pattern is found to be it, with other values, and one with
   !> an entry between two blocks is not, nor one with as many entries elsewhere in a block.
   subroutine test_incomplete(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a, other
      type(diagonal_blocks_t) :: blocks
      logical :: is_new
      integer :: k

      call make_sample(a, error)
      if (allocated(error)) return
      blocks%accuracy = 0.1_dp
      call solver_create(solver_default, matrix_definite, blocks%kind)
      select type (kind => blocks%kind)
      type is (chosen_solver_t)
         kind%prefers_iterations = .true.
      end select
      do k = 1, 4
         other = a
         if (k == 2) other%value = 3.0_dp*a%value
         if (k == 3) call move_coupling(a, .false., other)
         if (k == 4) call move_coupling(a, .true., other)
         call blocks_analyse(blocks, other, is_new, error)
         if (.not. allocated(error)) call check_true(error, is_new .eqv. k /= 2, "new ones are")
         if (.not. allocated(error)) call check_products(blocks, other, error)
         if (allocated(error)) return
      end do
      call blocks_free(blocks)
   end subroutine test_incomplete

   !> `a` with one coupling in another place: from unknown 1 to the farthest in its row, which goes to
   !> one of its own block that it does not meet, or to one of the next block.
   subroutine move_coupling(a, leaves, moved)
      type(csr_t), intent(in) :: a
      logical, intent(in) :: leaves              !! the block
      type(csr_t), intent(out) :: moved
      integer :: row(size(a%column)), column(size(a%column)), i, last, to
      integer, allocatable :: slot(:)

      do i = 1, a%n_row
         row(a%row_start(i) + 1:a%row_start(i + 1)) = i
      end do
      column = a%column + 1
      last = column(a%row_start(2))
      to = merge(2, last + 3, leaves)            ! unknowns of the first two blocks alternate
      where (row == 1 .and. column == last)
         column = to
      elsewhere (row == last .and. column == 1)
         row = to
      end where
      call csr_from_entries(moved, a%n_row, a%n_col, row, column, slot)
      moved%value(slot) = a%value
   end subroutine move_coupling

   !> Factors of `a` are incomplete, and products are those of its symmetric part.
   subroutine check_products(blocks, a, error)
      type(diagonal_blocks_t), intent(inout) :: blocks
      type(csr_t), intent(in) :: a
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: x(a%n_row), y(a%n_row)
      real(dp), allocatable :: symmetric(:, :)
      logical :: is_singular

      call blocks_factorise(blocks, a, is_singular, error)
      if (allocated(error)) return
      call random_number(x)
      call check_true(error, blocks%is_incomplete .and. .not. is_singular, "incomplete")
      if (.not. allocated(error)) call blocks_multiply(blocks, x, y, error)
      if (allocated(error)) return
      symmetric = 0.5_dp*(dense_of(a) + transpose(dense_of(a)))
      call check_near(error, real(y, wp), real(blocks%scale*matmul(symmetric, x), wp), tol, &
         real(maxval(abs(y)), wp), "A x")
   end subroutine check_products

   !> Factors of `a`, in `n_thread` threads.
   subroutine prepare(blocks, a, n_thread, error)
      type(diagonal_blocks_t), intent(inout) :: blocks
      type(csr_t), intent(in) :: a
      integer, intent(in) :: n_thread
      type(error_t), allocatable, intent(out) :: error
      logical :: is_new, is_singular

      call solver_create(solver_default, matrix_definite, blocks%kind)
      blocks%n_thread = n_thread
      call blocks_analyse(blocks, a, is_new, error)
      if (.not. allocated(error)) call blocks_factorise(blocks, a, is_singular, error)
      if (.not. allocated(error)) call check_true(error, is_new .and. .not. is_singular, "factors")
   end subroutine prepare

   !> x = A^-1 b
   subroutine solve(blocks, b, x, error)
      type(diagonal_blocks_t), intent(inout) :: blocks
      real(dp), intent(in), contiguous :: b(:)
      real(dp), intent(inout), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: y(size(b))

      call blocks_solve(blocks, .false., b, y, error)
      if (.not. allocated(error)) call blocks_solve(blocks, .true., y, x, error)
      x = blocks%scale*x
   end subroutine solve

   !> Two meshes whose unknowns alternate as far as they go, a third one behind them, and single
   !> unknowns in all places between.
   subroutine make_sample(a, error)
      type(csr_t), intent(out) :: a
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: part
      integer, allocatable :: row(:), column(:), slot(:)
      real(dp), allocatable :: value(:)
      integer, parameter :: first(3) = [1, 2, 241], stride(3) = [3, 3, 1]
      integer, parameter :: n_x(3) = [9, 5, 4], n_y(3) = [3, 4, 2]
      integer :: i, k, p

      allocate(row(0), column(0), value(0))
      do p = 1, 3
         call quad_mesh_matrix(n_x(p), n_y(p), 0.1_dp, part, error)
         if (allocated(error)) return
         do i = 1, part%n_row
            do k = part%row_start(i) + 1, part%row_start(i + 1)
               row = [row, first(p) + stride(p)*(i - 1)]
               column = [column, first(p) + stride(p)*part%column(k)]
               value = [value, part%value(k)]
            end do
         end do
      end do
      do i = 1, 270
         if (any(row == i)) cycle
         row = [row, i]
         column = [column, i]
         value = [value, real(i, dp)]
      end do
      call csr_from_entries(a, 270, 270, row, column, slot)
      a%value(slot) = value
   end subroutine make_sample

end module test_diagonal_blocks
