!> Sparse Cholesky: closed form, LAPACK, indefinite matrices, scaling, reuse of the pattern.
module test_cholmod
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_cholmod, only : cholmod_t
   use emcon_csr, only : csr_from_elements, csr_multiply, csr_t
   use emcon_errors, only : err_internal, error_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use sparse_samples, only : dense_of, quad_mesh_matrix
   implicit none
   private
   public :: collect_cholmod

   !> Round-off of a factorisation, for matrices whose condition is below 1e4.
   real(wp), parameter :: tol = 1.0e4_wp*max(real(epsilon(1.0_dp), wp), epsilon(1.0_wp))

contains

   subroutine collect_cholmod(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("mass of a bar", test_bar), &
         test_case_t("random against LAPACK", test_random), &
         test_case_t("supernodal", test_large), &
         test_case_t("powers of two keep the bits", test_powers_of_two), &
         test_case_t("not positive definite", test_indefinite), &
         test_case_t("not a number", test_nan), &
         test_case_t("pattern is analysed once", test_reuse), &
         test_case_t("wrong order of calls", test_misuse), &
         test_case_t("free twice", test_free_twice)]
   end subroutine collect_cholmod

   !> Linear elements of mass (2 1; 1 2)/6: the rows of M sum to 1, at the ends to 1/2.
   subroutine test_bar(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(cholmod_t) :: solver
      real(wp) :: b(6), x(6)

      call sample_bar(a, error)
      if (allocated(error)) return
      b = 1.0_wp
      b([1, 6]) = 0.5_wp
      call solve(solver, a, b, x, error)
      if (allocated(error)) return
      call check_near(error, x, spread(1.0_wp, 1, 6), tol, 1.0_wp, "x")
      call check_equal(error, int(solver%n_factor), 11, "nonzeros of the factor")
      call check_true(error, solver%rcond > 0.1_dp .and. solver%rcond <= 1.0_dp, "rcond")
      call solver%free()
   end subroutine test_bar

   subroutine test_random(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 60
      type(csr_t) :: a
      type(cholmod_t) :: solver
      real(wp) :: b(n), x(n)
      real(dp) :: expected(n, 1)
      logical :: is_singular

      call quad_mesh_matrix(5, 4, 0.0_dp, a, error)
      if (allocated(error)) return
      call random_number(b)
      call solve(solver, a, b, x, error)
      if (allocated(error)) return
      call dense_solve(dense_of(a), reshape(real(b, dp), [n, 1]), expected, is_singular)
      call check_near(error, x, real(expected(:, 1), wp), tol, maxval(abs(x)), "x")
      call solver%free()
   end subroutine test_random

   subroutine test_large(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 2*61*61
      type(csr_t) :: a
      type(cholmod_t) :: solver
      real(wp), allocatable :: b(:), x(:), y(:)

      allocate(b(n), x(n), y(n))
      call quad_mesh_matrix(60, 60, 0.0_dp, a, error)
      if (allocated(error)) return
      call random_number(b)
      call solve(solver, a, b, x, error)
      if (allocated(error)) return
      call csr_multiply(a, x, y)
      call check_near(error, y, b, tol, 1.0_wp, "A x")
      call solver%free()
   end subroutine test_large

   subroutine test_powers_of_two(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: powers(5) = [-60, -41, -1, 37, 60]
      type(csr_t) :: a, scaled
      type(cholmod_t) :: solver
      real(wp) :: b(220), x(220), y(220)
      integer :: i_power

      call quad_mesh_matrix(10, 9, 0.0_dp, a, error)
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
      call solver%free()
   end subroutine test_powers_of_two

   !> Indefinite, semi-definite, negative in the first and in the last row; then regular again.
   subroutine test_indefinite(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(cholmod_t) :: solver
      real(wp) :: x(6)
      real(dp), allocatable :: good(:)
      integer :: i_case
      type(error_t), allocatable :: raised

      call sample_bar(a, error)
      if (allocated(error)) return
      good = a%value
      call solver%analyse(a, error)
      if (allocated(error)) return
      do i_case = 1, 4
         a%value = good
         select case (i_case)
         case (1)
            a%value(2) = 10.0_dp
            a%value(3) = 10.0_dp
         case (2)
            a%value = 0.0_dp
         case (3)
            a%value(1) = -1.0_dp
         case default
            a%value(size(good)) = -1.0_dp
         end select
         call solver%factorise(a%value, error)
         if (allocated(error)) return
         call check_true(error, solver%is_singular, "found not positive definite")
         call solver%solve(spread(1.0_wp, 1, 6), x, raised)
         call check_error(error, raised, err_internal, "no factorisation", "solve")
         if (allocated(error)) return
      end do
      a%value = good
      call solve(solver, a, spread(1.0_wp, 1, 6), x, error)
      call solver%free()
   end subroutine test_indefinite

   subroutine test_nan(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(cholmod_t) :: solver

      call sample_bar(a, error)
      if (allocated(error)) return
      a%value(4) = ieee_value(1.0_dp, ieee_quiet_nan)
      call solver%analyse(a, error)
      if (allocated(error)) return
      call solver%factorise(a%value, error)
      if (allocated(error)) return
      call check_true(error, solver%is_singular, "a NaN makes it singular")
      call solver%free()
   end subroutine test_nan

   subroutine test_reuse(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(cholmod_t) :: solver
      real(wp) :: b(6), x(6), y(6)

      call sample_bar(a, error)
      if (allocated(error)) return
      call random_number(b)
      call solve(solver, a, b, x, error)
      if (allocated(error)) return
      a%value = 3.0_dp*a%value
      call solve(solver, a, b, y, error)
      if (allocated(error)) return
      call check_near(error, 3.0_wp*y, x, tol, 1.0_wp, "x of 3 A")
      call check_equal(error, solver%n_analysis, 1, "analyses")
      call solver%free()
   end subroutine test_reuse

   subroutine test_misuse(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(cholmod_t) :: solver
      type(csr_t) :: empty
      real(wp) :: x(1)

      call solver%factorise([1.0_dp], raised)
      call check_error(error, raised, err_internal, "before", "factorise before analyse")
      call solver%solve([1.0_wp], x, raised)
      call check_error(error, raised, err_internal, "no factorisation", "solve before factorise")
      call solver%analyse(empty, raised)
      call check_error(error, raised, err_internal, "0 x 0", "no rows")
      call solver%free()
   end subroutine test_misuse

   subroutine test_free_twice(error)
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: a
      type(cholmod_t) :: solver
      real(wp) :: x(6)
      integer :: i

      call sample_bar(a, error)
      if (allocated(error)) return
      do i = 1, 3
         call solve(solver, a, spread(1.0_wp, 1, 6), x, error)
         if (allocated(error)) return
         call solver%free()
         call solver%free()
      end do
   end subroutine test_free_twice

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

   subroutine solve(solver, a, b, x, error)
      type(cholmod_t), intent(inout) :: solver
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

end module test_cholmod
