!> Factors by dense blocks, rough ones and those of double precision: what they solve, sparse
!> right-hand sides, units, matrices that ask for more digits, and those that have no factor.
module test_supernodal
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only : real32
   use check, only : check_near, check_true, test_case_t
   use emcon_csr, only : csr_find, csr_from_elements, csr_from_values, csr_multiply, &
       csr_pick_rows, csr_t
   use emcon_errors, only : error_t
   use emcon_diagonal_blocks, only : blocks_analyse, blocks_factorise, blocks_free, &
      blocks_has_panels, blocks_reach, blocks_reach_rows, diagonal_blocks_t
   use emcon_kinds, only : dp, wp
   use emcon_row_panels, only : row_panel_t
   use emcon_row_pool, only : row_pool_add, row_pool_append, row_pool_fill_products, &
      row_pool_find, row_pool_forget, row_pool_subtract_products, row_pool_t
   use emcon_sparse_solver, only : matrix_definite
   use emcon_supernodal, only : supernodal_t
   use sparse_samples, only : quad_mesh_matrix
   implicit none
   private
   public :: collect_supernodal

   !> A mesh whose factor has long enough columns.
   integer, parameter :: n_x = 60, n_y = 60, n = 2*(n_x + 1)*(n_y + 1)
   !> Round-off of a factorisation, for matrices whose condition is below 1e4.
   real(wp), parameter :: tol = 1.0e4_wp*max(real(epsilon(1.0_dp), wp), epsilon(1.0_wp))
   !> Of the mass of a bar of five elements.
   real(wp), parameter :: row_sums(6) = [0.5_wp, 1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp, 0.5_wp]
   real(wp), parameter :: rough_tol = 1.0e4_wp*epsilon(1.0_real32)

contains

   subroutine collect_supernodal(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("both halves solve", test_solve), &
         test_case_t("a sparse right-hand side has the bits of a full one", test_reach), &
         test_case_t("many right-hand sides together", test_rows), &
         test_case_t("those of several bodies", test_rows_of_blocks), &
         test_case_t("powers of two keep the bits", test_powers_of_two), &
         test_case_t("short columns have no blocks", test_small), &
         test_case_t("one dense block of any width", test_dense), &
         test_case_t("a large condition asks for all digits", test_condition), &
         test_case_t("so do numbers out of range", test_range), &
         test_case_t("not positive definite", test_indefinite), &
         test_case_t("mass of a bar", test_bar), &
         test_case_t("solutions to round-off", test_full), &
         test_case_t("no factor, then one", test_no_factor), &
         test_case_t("an entry has none across the diagonal", test_one_sided)]
   end subroutine collect_supernodal

   subroutine test_solve(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(supernodal_t) :: solver

      call quad_mesh_matrix(n_x, n_y, 0.0_dp, a, error)
      if (.not. allocated(error)) call prepare(solver, a, error)
      if (allocated(error)) return
      call check_true(error, solver%is_rough, "the factors are rough")
      if (.not. allocated(error)) call check_solution(solver, a, rough_tol, error)
      call solver%free()
   end subroutine test_solve

   subroutine test_reach(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(supernodal_t) :: solver

      call quad_mesh_matrix(n_x, n_y, 0.0_dp, a, error)
      if (.not. allocated(error)) call prepare(solver, a, error)
      if (.not. allocated(error)) call check_reach(solver, 0.0_wp, error)
      if (allocated(error)) return
      call fill(a, 1.0e-9_dp)
      call prepare(solver, a, error)
      if (allocated(error)) return
      call check_true(error, .not. solver%is_rough, "the factors are not rough")
      if (.not. allocated(error)) call check_reach(solver, 0.0_wp, error)
      call solver%free()
   end subroutine test_reach

   !> The first half by what a sparse right-hand side reaches is that by all.
   subroutine check_reach(solver, allowed, error)
      type(supernodal_t), intent(inout) :: solver
      real(wp), intent(in) :: allowed            !! of one
      type(error_t), allocatable, intent(inout) :: error
      integer, parameter :: column(3) = [17, n/2, n/2 + 3]
      real(dp) :: value(3), b(n), x(n), y(n), part(n)
      integer :: index(n), m, i_time

      do i_time = 1, 2
         call random_number(value)
         b = 0.0_dp
         b(column + 1) = value
         call solver%solve_half(.false., b, y, error)
         if (.not. allocated(error)) call solver%reach_half(column, value, m, index, part, error)
         if (allocated(error)) return
         x = 0.0_dp
         x(index(:m) + 1) = part(:m)
         call check_near(error, real(x, wp), real(y, wp), allowed, 1.0_wp, "L^-1 P b")
         if (.not. allocated(error)) call check_true(error, 4*m < n, "most of it is zero")
         if (allocated(error)) return
      end do
   end subroutine check_reach

   !> W of rows of neighbours and of unknowns far apart, one of them empty: its products with itself
   !> and with vectors are those of one right-hand side after the other.
   subroutine test_rows(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a

      call quad_mesh_matrix(n_x, n_y, 0.0_dp, a, error)
      if (.not. allocated(error)) call check_rows(a, 1, error)
   end subroutine test_rows

   !> Two meshes that do not meet, with rows across both.
   subroutine test_rows_of_blocks(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a, twice
      integer :: m

      call quad_mesh_matrix(n_x, n_y, 0.0_dp, a, error)
      if (allocated(error)) return
      m = size(a%column)
      twice%n_row = 2*n
      twice%n_col = 2*n
      twice%row_start = [a%row_start, m + a%row_start(2:)]
      twice%column = [a%column, n + a%column]
      twice%value = [a%value, 3.0_dp*a%value]
      call check_rows(twice, 2, error)
   end subroutine test_rows_of_blocks

   subroutine check_rows(a, n_block, error)
      type(csr_t), intent(in) :: a
      integer, intent(in) :: n_block             !! that it falls apart into
      type(error_t), allocatable, intent(inout) :: error
      integer, parameter :: n_row = 60
      type(diagonal_blocks_t) :: blocks
      type(csr_t) :: rows
      real(dp), allocatable :: w(:, :), part(:)
      real(dp) :: value(3*n_row)
      integer, allocatable :: index(:)
      integer :: i, k, m, column(3*n_row), row(3*n_row)
      logical :: is_new, is_singular

      allocate(supernodal_t :: blocks%kind)
      blocks%kind%symmetry = matrix_definite
      blocks%may_be_rough = .true.
      call blocks_analyse(blocks, a, is_new, error)
      if (.not. allocated(error)) call blocks_factorise(blocks, a, is_singular, error)
      if (allocated(error)) return
      call check_true(error, blocks%n_block == n_block .and. blocks_has_panels(blocks), "panels")
      call random_number(value)
      do k = 1, n_row
         row(3*k - 2:3*k) = merge(0, k, k == 7)
         column(3*k - 2:3*k) = 1 + modulo([97*k, 97*k + 1, 5*k*a%n_row/7], a%n_row)
      end do
      call csr_from_values(rows, n_row, a%n_row, row, column, real(value, wp))
      allocate(w(a%n_row, n_row), source=0.0_dp)
      allocate(index(a%n_row), part(a%n_row))
      do i = 1, n_row
         associate (first => rows%row_start(i) + 1, last => rows%row_start(i + 1))
            if (last < first) cycle
            call blocks_reach(blocks, rows%column(first:last), rows%value(first:last), m, index, &
               part, error)
         end associate
         if (allocated(error)) return
         w(index(:m) + 1, i) = part(:m)
      end do
      if (allocated(error)) return
      call check_pool(blocks, rows, w, error)
      call blocks_free(blocks)
   end subroutine check_rows

   !> Sets of some rows, each in another order: what one has in common with those before is not made
   !> again, and is nearly what is wanted.
   subroutine check_pool(blocks, rows, w, error)
      type(diagonal_blocks_t), intent(inout) :: blocks
      type(csr_t), intent(in) :: rows
      real(dp), intent(in) :: w(:, :)            !! (n_unknown, n) of these
      type(error_t), allocatable, intent(inout) :: error
      real(dp), parameter :: turned = 1.0e-3_dp
      type(row_pool_t) :: pool
      type(csr_t) :: near
      integer, allocatable :: missing(:)
      integer :: k

      associate (n => rows%n_row)
         call take_set(blocks, rows, [(k, k = 1, 2*n/3)], pool, error)
         if (.not. allocated(error)) call check_set(pool, w(:, :2*n/3), error)
         if (.not. allocated(error)) call take_set(blocks, rows, [(k, k = n, n/3, -1)], pool, error)
         if (.not. allocated(error)) call check_set(pool, w(:, n:n/3:-1), error)
         if (.not. allocated(error)) call take_set(blocks, rows, [(k, k = 1, n, 7)], pool, error)
         if (.not. allocated(error)) call check_set(pool, w(:, 1:n:7), error)
         if (allocated(error)) return
         call check_true(error, pool%n == n, "each row is made once")
         near = rows
         near%value = (1.0_dp + turned)*near%value
         call row_pool_find(pool, [(k, k = 1, n)], near, 2.0_dp*turned, missing)
         call check_true(error, size(missing) == 0, "gradients that have turned by little")
         call row_pool_find(pool, [(k, k = 1, n)], near, 0.1_dp*turned, missing)
         call check_true(error, size(missing) == n - 1, "those that have turned by more")
         call row_pool_forget(pool)
         if (.not. allocated(error)) call take_set(blocks, rows, [(k, k = 2, n)], pool, error)
         if (.not. allocated(error)) call check_set(pool, w(:, 2:), error)
      end associate
   end subroutine check_pool

   !> The rows `which` as a set of the pool.
   subroutine take_set(blocks, rows, which, pool, error)
      type(diagonal_blocks_t), intent(inout) :: blocks
      type(csr_t), intent(in) :: rows
      integer, intent(in) :: which(:)
      type(row_pool_t), intent(inout) :: pool
      type(error_t), allocatable, intent(inout) :: error
      type(row_panel_t), allocatable :: panel(:)
      type(csr_t) :: of_set, lacking
      integer, allocatable :: missing(:)

      call csr_pick_rows(rows, which, of_set)
      call row_pool_find(pool, which, of_set, 1.0e-2_dp, missing)
      if (size(missing) == 0) return
      call csr_pick_rows(of_set, missing, lacking)
      call blocks_reach_rows(blocks, lacking, size(missing), panel, error)
      if (.not. allocated(error)) call row_pool_append(pool, which, lacking, missing, panel)
   end subroutine take_set

   !> W of the present set, by products with itself and with vectors.
   subroutine check_set(pool, w, error)
      type(row_pool_t), intent(in) :: pool
      real(dp), intent(in) :: w(:, :)            !! (n_unknown, n)
      type(error_t), allocatable, intent(inout) :: error
      real(dp), dimension(size(w, 2), size(w, 2)) :: products, lower
      real(dp), dimension(size(w, 2)) :: mu, found
      real(dp), dimension(size(w, 1)) :: y, expected
      integer :: k

      products = 0.0_dp
      call row_pool_fill_products(pool, products)
      lower = matmul(transpose(w), w)
      do k = 2, size(mu)
         lower(:k - 1, k) = 0.0_dp
      end do
      call check_near(error, real(products, wp), real(lower, wp), tol, 1.0_wp, "W^T W")
      y = w(:, 2) - 0.5_dp*w(:, size(mu))
      mu = 1.0_dp
      found = mu
      call row_pool_subtract_products(pool, y, found)
      call check_near(error, real(found, wp), real(mu - matmul(transpose(w), y), wp), tol, 1.0_wp, &
         "W^T y")
      call random_number(mu)
      expected = y + matmul(w, mu)
      call row_pool_add(pool, mu, y)
      call check_near(error, real(y, wp), real(expected, wp), tol, 1.0_wp, "W mu")
   end subroutine check_set

   subroutine test_powers_of_two(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: powers(4) = [-600, -60, 37, 600]
      type(csr_t) :: a, scaled
      type(supernodal_t) :: solver
      real(dp) :: b(n), x(n), y(n)
      integer :: i_power

      call quad_mesh_matrix(n_x, n_y, 0.0_dp, a, error)
      if (.not. allocated(error)) call prepare(solver, a, error)
      if (allocated(error)) return
      call random_number(b)
      call solve(solver, b, x, error)
      if (allocated(error)) return
      scaled = a
      do i_power = 1, size(powers)
         scaled%value = scale(a%value, powers(i_power))
         call prepare(solver, scaled, error)
         if (.not. allocated(error)) call solve(solver, b, y, error)
         if (allocated(error)) return
         call check_near(error, real(y, wp), real(x, wp), 0.0_wp, 1.0_wp, "x of 2^k A")
         if (allocated(error)) return
      end do
      call solver%free()
   end subroutine test_powers_of_two

   subroutine test_small(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(supernodal_t) :: solver

      call quad_mesh_matrix(10, 9, 0.0_dp, a, error)
      if (.not. allocated(error)) call prepare(solver, a, error)
      if (allocated(error)) return
      call check_true(error, .not. solver%is_rough, "the factors are not rough")
      if (.not. allocated(error)) call check_solution(solver, a, tol, error)
      call solver%free()
   end subroutine test_small

   !> All unknowns meet: one triangle, which is inverted by parts where it is large.
   subroutine test_dense(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: width(4) = [128, 135, 143, 300]
      type(csr_t) :: a
      type(supernodal_t) :: solver
      integer :: i, j, k

      do k = 1, size(width)
         associate (m => width(k))
            a = csr_t(m, m, [(m*i, i = 0, m)], [((j, j = 0, m - 1), i = 1, m)], &
               [((merge(real(m, dp), -0.5_dp, i == j), j = 1, m), i = 1, m)])
         end associate
         call prepare(solver, a, error)
         if (allocated(error)) return
         call check_true(error, solver%is_rough, "the factors are rough")
         if (.not. allocated(error)) call check_solution(solver, a, rough_tol, error)
         call solver%free()
      end do
   end subroutine test_dense

   !> Off the diagonal -1, rows that sum to 1e-9 of what they have: a condition of 1e9 at least,
   !> which double precision bears. Then rows whose sums are larger.
   subroutine test_condition(error)
      type(error_t), allocatable, intent(out) :: error
      real(dp), parameter :: rest = 1.0e-9_dp
      type(csr_t) :: a
      type(supernodal_t) :: solver

      call quad_mesh_matrix(n_x, n_y, 0.0_dp, a, error)
      if (allocated(error)) return
      call fill(a, rest)
      call prepare(solver, a, error)
      if (allocated(error)) return
      call check_true(error, .not. solver%is_rough, "the factors are not rough")
      if (.not. allocated(error)) call check_solution(solver, a, tol, error)
      if (allocated(error)) return
      call fill(a, 0.1_dp)
      call prepare(solver, a, error)
      if (allocated(error)) return
      call check_true(error, solver%is_rough, "and then they are")
      if (.not. allocated(error)) call check_solution(solver, a, rough_tol, error)
      call solver%free()
   end subroutine test_condition

   !> One unknown is held by what squares to more than single precision has.
   subroutine test_range(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(supernodal_t) :: solver
      integer :: slot

      call quad_mesh_matrix(n_x, n_y, 0.0_dp, a, error)
      if (allocated(error)) return
      slot = csr_find(a, 9, 9)
      a%value(slot) = scale(a%value(slot), 70)
      call prepare(solver, a, error)
      if (allocated(error)) return
      call check_true(error, .not. (solver%is_rough .or. solver%is_singular), "all digits")
      if (.not. allocated(error)) call check_solution(solver, a, tol, error)
      call solver%free()
   end subroutine test_range

   subroutine test_indefinite(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(supernodal_t) :: solver

      call quad_mesh_matrix(n_x, n_y, 0.0_dp, a, error)
      if (allocated(error)) return
      a%value(csr_find(a, n, n)) = -1.0_dp
      call prepare(solver, a, error)
      if (allocated(error)) return
      call check_true(error, solver%is_singular, "found not positive definite")
      if (allocated(error)) return
      call fill(a, 1.0e-9_dp)
      call prepare(solver, a, error)
      if (allocated(error)) return
      call check_true(error, .not. solver%is_singular, "the next one is")
      if (.not. allocated(error)) call check_solution(solver, a, tol, error)
      call solver%free()
   end subroutine test_indefinite

   !> Linear elements of mass (2 1; 1 2)/6: the rows of M sum to 1, at the ends to 1/2.
   subroutine test_bar(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(supernodal_t) :: solver
      real(wp) :: x(6)

      call sample_bar(a, error)
      if (.not. allocated(error)) call solver%analyse(a, error)
      if (allocated(error)) return
      call check_true(error, solver%n_factor == 11, "entries of the factor")
      if (.not. allocated(error)) call solver%factorise(a%value, error)
      if (.not. allocated(error)) call solver%solve(row_sums, x, error)
      if (allocated(error)) return
      call check_near(error, x, spread(1.0_wp, 1, 6), tol, 1.0_wp, "x")
      call solver%free()
   end subroutine test_bar

   !> Without halves alone, whatever the columns are.
   subroutine test_full(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(supernodal_t) :: solver
      real(wp) :: b(n), x(n), y(n)

      call quad_mesh_matrix(n_x, n_y, 0.0_dp, a, error)
      if (allocated(error)) return
      call random_number(b)
      call solver%analyse(a, error)
      if (.not. allocated(error)) call solver%factorise(a%value, error)
      if (.not. allocated(error)) call solver%solve(b, x, error)
      if (allocated(error)) return
      call csr_multiply(a, x, y)
      call check_near(error, y, b, tol, 1.0_wp, "A x")
      call solver%free()
   end subroutine test_full

   !> Indefinite, zero, negative in the first and in the last row, not a number; then regular again.
   subroutine test_no_factor(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(supernodal_t) :: solver
      real(dp), allocatable :: good(:)
      real(wp) :: x(6)
      integer :: i_case

      call sample_bar(a, error)
      if (.not. allocated(error)) call solver%analyse(a, error)
      if (allocated(error)) return
      good = a%value
      do i_case = 1, 5
         a%value = good
         select case (i_case)
         case (1)
            a%value(2:3) = 10.0_dp
         case (2)
            a%value = 0.0_dp
         case (3)
            a%value(1) = -1.0_dp
         case (4)
            a%value(size(good)) = -1.0_dp
         case default
            a%value(4) = ieee_value(1.0_dp, ieee_quiet_nan)
         end select
         call solver%factorise(a%value, error)
         if (allocated(error)) return
         call check_true(error, solver%is_singular, "found not positive definite")
         if (allocated(error)) return
      end do
      call solver%factorise(good, error)
      if (.not. allocated(error)) call solver%solve(row_sums, x, error)
      if (allocated(error)) return
      call check_near(error, x, spread(1.0_wp, 1, 6), tol, 1.0_wp, "x")
      call solver%free()
   end subroutine test_no_factor

   subroutine test_one_sided(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(supernodal_t) :: solver

      call csr_from_values(a, 2, 2, [1, 1, 2], [1, 2, 2], spread(1.0_wp, 1, 3))
      call solver%analyse(a, error)
      if (.not. allocated(error)) call solver%factorise(a%value, error)
      if (allocated(error)) return
      call check_true(error, solver%is_singular, "no matrix of that pattern is symmetric")
      call solver%free()
   end subroutine test_one_sided

   !> Consistent mass of five bar elements.
   subroutine sample_bar(a, error)
      type(csr_t), intent(out) :: a
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: slot(:)
      integer :: k
      real(dp) :: entry

      call csr_from_elements(a, 6, [1, 3, 5, 7, 9, 11], [1, 2, 2, 3, 3, 4, 4, 5, 5, 6], slot, error)
      if (allocated(error)) return
      do k = 1, size(slot)
         entry = merge(2.0_dp, 1.0_dp, mod(k, 4) <= 1)/6.0_dp
         a%value(slot(k)) = a%value(slot(k)) + entry
      end do
   end subroutine sample_bar

   !> -1 off the diagonal; rows sum to `rest` times their number of entries.
   pure subroutine fill(a, rest)
      type(csr_t), intent(inout) :: a
      real(dp), intent(in) :: rest
      integer :: i

      a%value = -1.0_dp
      do i = 1, a%n_row
         a%value(csr_find(a, i, i)) = (1.0_dp + rest)*(a%row_start(i + 1) - a%row_start(i)) - 1.0_dp
      end do
   end subroutine fill

   !> A x = b, for random b.
   subroutine check_solution(solver, a, allowed, error)
      type(supernodal_t), intent(inout) :: solver
      type(csr_t), intent(in) :: a
      real(wp), intent(in) :: allowed            !! of the largest x
      type(error_t), allocatable, intent(inout) :: error
      real(dp) :: b(n), x(n)
      real(wp) :: y(n)

      call random_number(b(:a%n_row))
      call solve(solver, b(:a%n_row), x(:a%n_row), error)
      if (allocated(error)) return
      call csr_multiply(a, real(x(:a%n_row), wp), y(:a%n_row))
      y(:a%n_row) = real(solver%half_scale, wp)*y(:a%n_row)
      call check_near(error, y(:a%n_row), real(b(:a%n_row), wp), allowed, &
         1.0_wp + maxval(real(abs(x(:a%n_row)), wp)), "A x")
   end subroutine check_solution

   subroutine prepare(solver, a, error)
      type(supernodal_t), intent(inout) :: solver
      type(csr_t), intent(in) :: a
      type(error_t), allocatable, intent(out) :: error

      solver%symmetry = matrix_definite
      solver%needs_halves = .true.
      solver%may_be_rough = .true.
      call solver%analyse(a, error)
      if (.not. allocated(error)) call solver%factorise(a%value, error)
   end subroutine prepare

   !> By both halves.
   subroutine solve(solver, b, x, error)
      type(supernodal_t), intent(inout) :: solver
      real(dp), intent(in), contiguous :: b(:)
      real(dp), intent(inout), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: y(size(b))

      call solver%solve_half(.false., b, y, error)
      if (.not. allocated(error)) call solver%solve_half(.true., y, x, error)
   end subroutine solve

end module test_supernodal
