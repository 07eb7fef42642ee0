!> Sparse LU: against LAPACK, singular matrices, reuse of the pattern, scaling, misuse.
module test_umfpack
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_csr, only : csr_find, csr_from_elements, csr_from_entries, csr_multiply, csr_t
   use emcon_errors, only : err_internal, error_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_umfpack, only : ordering_amd, ordering_metis, umfpack_t
   use sparse_samples, only : dense_of, quad_mesh_matrix, random_sparse
   implicit none
   private
   public :: collect_umfpack

   !> Round-off of a factorisation, for matrices whose condition is below 1e4.
   real(wp), parameter :: tol = 1.0e4_wp*max(real(epsilon(1.0_dp), wp), epsilon(1.0_wp))

contains

   subroutine collect_umfpack(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("two by two", test_two), &
         test_case_t("random against LAPACK", test_random), &
         test_case_t("saddle point", test_saddle_point), &
         test_case_t("metis and refinement", test_metis), &
         test_case_t("the ordering that fills less", test_less_fill), &
         test_case_t("a cube is dissected", test_cube), &
         test_case_t("pattern is analysed once", test_reuse), &
         test_case_t("same bits again", test_same_bits), &
         test_case_t("powers of two keep the bits", test_powers_of_two), &
         test_case_t("zero pivot", test_zero_pivot), &
         test_case_t("empty row", test_empty_row), &
         test_case_t("dependent rows, then regular", test_dependent_rows), &
         test_case_t("not a number", test_nan), &
         test_case_t("huge and tiny values", test_extremes), &
         test_case_t("wrong order of calls", test_misuse), &
         test_case_t("free twice", test_free_twice)]
   end subroutine collect_umfpack

   !> (1 2; 3 4) x = (5, 11): x = (1, 2). Unsymmetric: A^T would give another answer.
   subroutine test_two(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(umfpack_t) :: solver
      real(wp) :: x(2)

      call sample_two(a)
      call solve(solver, a, [5.0_wp, 11.0_wp], x, error)
      if (allocated(error)) return
      call check_near(error, x, [1.0_wp, 2.0_wp], tol, 1.0_wp, "x")
      call check_true(error, .not. solver%is_singular, "regular")
      call check_true(error, solver%rcond > 0.1_dp, "rcond > 0.1")
      call check_true(error, solver%n_factor >= 4, "factors have four entries")
      call solver%free()
   end subroutine test_two

   subroutine test_random(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 60
      type(csr_t) :: a
      type(umfpack_t) :: solver
      real(wp) :: b(n), x(n)
      real(dp) :: expected(n, 1)
      logical :: is_singular

      call quad_mesh_matrix(5, 4, 0.5_dp, a, error)
      if (allocated(error)) return
      call random_number(b)
      call solve(solver, a, b, x, error)
      if (allocated(error)) return
      call dense_solve(dense_of(a), reshape(real(b, dp), [n, 1]), expected, is_singular)
      call check_near(error, x, real(expected(:, 1), wp), tol, maxval(abs(x)), "x")
      call solver%free()
   end subroutine test_random

   !> (N G^T; G 0) with N in units 1e10 times those of G: no scale was chosen for it.
   subroutine test_saddle_point(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(umfpack_t) :: solver
      integer, allocatable :: slot(:)
      real(wp), parameter :: big = 1.0e10_wp
      real(wp) :: x(4), b(4)

      call csr_from_entries(a, 4, 4, [1, 2, 3, 1, 4, 3, 4], [1, 2, 3, 4, 1, 4, 3], slot)
      a%value(slot) = [2.0e10_dp, 3.0e10_dp, 4.0e10_dp, 1.0_dp, 1.0_dp, -1.0_dp, -1.0_dp]
      call csr_multiply(a, [1.0_wp, 2.0_wp, 3.0_wp, 5.0_wp*big], b)
      call solve(solver, a, b, x, error)
      if (allocated(error)) return
      x(4) = x(4)/big
      call check_near(error, x, [1.0_wp, 2.0_wp, 3.0_wp, 5.0_wp], tol, 5.0_wp, "x")
      call solver%free()
   end subroutine test_saddle_point

   subroutine test_metis(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(umfpack_t) :: solver
      real(wp) :: b(882), x(882), y(882)

      call quad_mesh_matrix(20, 20, 0.5_dp, a, error)
      if (allocated(error)) return
      solver%ordering = ordering_metis
      solver%n_refine = 2
      call random_number(b)
      call solve(solver, a, b, x, error)
      if (allocated(error)) return
      call csr_multiply(a, x, y)
      call check_near(error, y, b, tol, 1.0_wp, "A x")
      call solver%free()
   end subroutine test_metis

   !> On a long strip minimum degree fills much less.
   subroutine test_less_fill(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: ordering(3) = [ordering_amd, ordering_metis, ordering_amd]
      type(csr_t) :: a
      type(umfpack_t) :: solver
      integer :: fill(3), k

      call quad_mesh_matrix(4, 300, 0.0_dp, a, error)
      if (allocated(error)) return
      do k = 1, 3
         call solver%free()
         solver%ordering = ordering(k)
         solver%seeks_less_fill = k == 3
         call solver%analyse(a, error)
         if (.not. allocated(error)) call solver%factorise(a%value, error)
         if (allocated(error)) return
         fill(k) = int(solver%n_factor)
      end do
      call solver%free()
      call check_true(error, fill(1) < fill(2), "the orderings differ")
      call check_equal(error, fill(3), fill(1), "the lesser fill")
   end subroutine test_less_fill

   !> Cells side by side, of an unknown at each corner: minimum degree fills more.
   subroutine test_cube(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: m = 18, n = m**3
      type(csr_t) :: a
      type(umfpack_t) :: solver, dissected
      integer :: dof(8, (m - 1)**3), i, j, k, e
      integer, allocatable :: slot(:)
      real(wp) :: b(n), x(n), y(n)

      e = 0
      do k = 1, m - 1
         do j = 1, m - 1
            do i = 1, m - 1
               e = e + 1
               dof(:, e) = i + m*(j - 1) + m*m*(k - 1) + [0, 1, m, m + 1, m*m, m*m + 1, m*m + m, &
                  m*m + m + 1]
            end do
         end do
      end do
      call csr_from_elements(a, n, [(8*i + 1, i = 0, e)], reshape(dof, [8*e]), slot, error)
      if (allocated(error)) return
      call random_number(a%value)
      do i = 1, n
         a%value(csr_find(a, i, i)) = 27.0_dp
      end do
      call random_number(b)
      call solve(solver, a, b, x, error)
      if (allocated(error)) return
      call csr_multiply(a, x, y)
      call check_near(error, y, b, tol, 1.0_wp, "A x")
      dissected%ordering = ordering_metis
      if (.not. allocated(error)) call solve(dissected, a, b, y, error)
      if (.not. allocated(error)) call check_equal(error, int(solver%n_factor), &
         int(dissected%n_factor), "entries of the factors")
      call solver%free()
      call dissected%free()
   end subroutine test_cube

   subroutine test_reuse(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a, b
      type(umfpack_t) :: solver
      real(wp) :: x(2)
      integer, allocatable :: slot(:)

      call sample_two(a)
      call solve(solver, a, [5.0_wp, 11.0_wp], x, error)
      if (allocated(error)) return
      a%value = 2.0_dp*a%value
      call solve(solver, a, [10.0_wp, 22.0_wp], x, error)
      if (allocated(error)) return
      call check_near(error, x, [1.0_wp, 2.0_wp], tol, 1.0_wp, "x")
      call check_equal(error, solver%n_analysis, 1, "analyses of one pattern")
      call csr_from_entries(b, 2, 2, [1, 2], [1, 2], slot)
      b%value = 4.0_dp
      call solve(solver, b, [4.0_wp, 8.0_wp], x, error)
      if (allocated(error)) return
      call check_near(error, x, [1.0_wp, 2.0_wp], tol, 1.0_wp, "x of the diagonal")
      call check_equal(error, solver%n_analysis, 2, "analyses of two patterns")
      call solver%free()
   end subroutine test_reuse

   subroutine test_same_bits(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(umfpack_t) :: first, second
      real(wp) :: b(882), x(882), y(882)

      call quad_mesh_matrix(20, 20, 0.5_dp, a, error)
      if (allocated(error)) return
      call random_number(b)
      call solve(first, a, b, x, error)
      if (allocated(error)) return
      call solve(second, a, b, y, error)
      if (allocated(error)) return
      call check_near(error, y, x, 0.0_wp, 1.0_wp, "x of another solver")
      call solve(first, a, b, y, error)
      if (allocated(error)) return
      call check_near(error, y, x, 0.0_wp, 1.0_wp, "x of a second factorisation")
      call first%free()
      call second%free()
   end subroutine test_same_bits

   !> 2^k A, and then every row by a power of its own, and the right-hand side with it.
   subroutine test_powers_of_two(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: powers(5) = [-60, -41, -1, 37, 60]
      type(csr_t) :: a, scaled
      type(umfpack_t) :: solver
      real(wp) :: b(220), x(220), y(220), scaled_b(220)
      integer :: i, k, i_power

      call quad_mesh_matrix(10, 9, 0.5_dp, a, error)
      if (allocated(error)) return
      call random_number(b)
      call solve(solver, a, b, x, error)
      if (allocated(error)) return
      scaled = a
      do i_power = 1, size(powers)
         scaled%value = scale(a%value, powers(i_power))
         call solve(solver, scaled, b, y, error)
         if (allocated(error)) return
         call check_near(error, scale(y, powers(i_power)), x, 0.0_wp, 1.0_wp, "x of 2^k A")
         if (allocated(error)) return
      end do
      do i = 1, a%n_row
         k = powers(1 + mod(i, 5))/2
         scaled_b(i) = scale(b(i), k)
         scaled%value(a%row_start(i) + 1:a%row_start(i + 1)) &
            = scale(a%value(a%row_start(i) + 1:a%row_start(i + 1)), k)
      end do
      call solve(solver, scaled, scaled_b, y, error)
      if (allocated(error)) return
      call check_near(error, y, x, 0.0_wp, 1.0_wp, "x of scaled rows")
      call solver%free()
   end subroutine test_powers_of_two

   subroutine test_zero_pivot(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a

      call sample_two(a)
      a%value = 1.0_dp
      call check_singular(error, a)
      a%value = 0.0_dp
      call check_singular(error, a)
   end subroutine test_zero_pivot

   subroutine test_empty_row(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      integer, allocatable :: slot(:)

      call csr_from_entries(a, 3, 3, [1, 1, 3], [1, 2, 3], slot)
      a%value = 1.0_dp
      call check_singular(error, a)
   end subroutine test_empty_row

   !> The solver recovers: after a singular matrix of the pattern comes a regular one.
   subroutine test_dependent_rows(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(csr_t) :: a
      type(umfpack_t) :: solver
      real(wp) :: x(2)

      call sample_two(a)
      call solver%analyse(a, error)
      if (allocated(error)) return
      call solver%factorise([1.0_dp, 2.0_dp, 2.0_dp, 4.0_dp], error)
      if (allocated(error)) return
      call check_true(error, solver%is_singular, "singular")
      call solver%solve([1.0_wp, 1.0_wp], x, raised)
      call check_error(error, raised, err_internal, "no factorisation", "solve after singular")
      if (allocated(error)) return
      call solve(solver, a, [5.0_wp, 11.0_wp], x, error)
      if (allocated(error)) return
      call check_near(error, x, [1.0_wp, 2.0_wp], tol, 1.0_wp, "x")
      call solver%free()
   end subroutine test_dependent_rows

   subroutine test_nan(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a

      call sample_two(a)
      a%value(2) = ieee_value(1.0_dp, ieee_quiet_nan)
      call check_singular(error, a)
   end subroutine test_nan

   !> Values near the limits of the range, and far apart, but regular.
   subroutine test_extremes(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(umfpack_t) :: solver
      real(dp) :: largest
      real(wp) :: x(2), b(2)

      largest = scale(1.0_dp, min(maxexponent(1.0_dp), maxexponent(1.0_wp)) - 8)
      call sample_two(a)
      a%value = [largest, 0.0_dp, 0.0_dp, 4.0_dp/largest]
      call csr_multiply(a, [1.0_wp, 2.0_wp], b)
      call solve(solver, a, b, x, error)
      if (allocated(error)) return
      call check_near(error, x, [1.0_wp, 2.0_wp], tol, 1.0_wp, "x")
      call solver%free()
   end subroutine test_extremes

   subroutine test_misuse(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(csr_t) :: a
      type(umfpack_t) :: solver
      real(wp) :: x(2)

      call solver%factorise([1.0_dp], raised)
      call check_error(error, raised, err_internal, "before", "factorise before analyse")
      call solver%solve([1.0_wp, 1.0_wp], x, raised)
      call check_error(error, raised, err_internal, "no factorisation", "solve before factorise")
      call sample_two(a)
      call solver%analyse(a, raised)
      call check_true(error, .not. allocated(raised), "analyse")
      call solver%factorise([1.0_dp], raised)
      call check_error(error, raised, err_internal, "1 values for 4", "too few values")
      call random_sparse(2, 3, 2, a)
      call solver%analyse(a, raised)
      call check_error(error, raised, err_internal, "2 x 3", "not square")
      call solver%free()
   end subroutine test_misuse

   subroutine test_free_twice(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(umfpack_t) :: solver
      real(wp) :: x(2)
      integer :: i

      call sample_two(a)
      do i = 1, 3
         call solve(solver, a, [5.0_wp, 11.0_wp], x, error)
         if (allocated(error)) return
         call check_near(error, x, [1.0_wp, 2.0_wp], tol, 1.0_wp, "x")
         if (allocated(error)) return
         call solver%free()
         call solver%free()
      end do
   end subroutine test_free_twice

   subroutine sample_two(a)
      type(csr_t), intent(out) :: a
      integer, allocatable :: slot(:)

      call csr_from_entries(a, 2, 2, [1, 1, 2, 2], [1, 2, 1, 2], slot)
      a%value(slot) = [1.0_dp, 2.0_dp, 3.0_dp, 4.0_dp]
   end subroutine sample_two

   subroutine solve(solver, a, b, x, error)
      type(umfpack_t), intent(inout) :: solver
      type(csr_t), intent(in) :: a
      real(wp), intent(in), contiguous :: b(:)
      real(wp), intent(out), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error

      x = 0.0_wp
      call solver%analyse(a, error)
      if (allocated(error)) return
      call solver%factorise(a%value, error)
      if (allocated(error)) return
      call solver%solve(b, x, error)
   end subroutine solve

   subroutine check_singular(error, a)
      type(error_t), allocatable, intent(inout) :: error
      type(csr_t), intent(in) :: a
      type(error_t), allocatable :: raised
      type(umfpack_t) :: solver

      call solver%analyse(a, raised)
      call check_true(error, .not. allocated(raised), "analyse a singular matrix")
      call solver%factorise(a%value, raised)
      call check_true(error, .not. allocated(raised), "factorise a singular matrix")
      call check_true(error, solver%is_singular, "the matrix is found singular")
      call check_near(error, real(solver%rcond, wp), 0.0_wp, 0.0_wp, 1.0_wp, "rcond")
      call solver%free()
   end subroutine check_singular

end module test_umfpack
