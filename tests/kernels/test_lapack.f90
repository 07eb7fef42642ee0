!> Small dense systems: closed forms and residuals of random matrices.
module test_lapack
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_eigen, dense_null_space, dense_rank, dense_solve
   implicit none
   private
   public :: collect_lapack

   !> Round-off of matrices of ten rows with a condition below 100.
   real(wp), parameter :: tol = 1.0e3_wp*max(real(epsilon(1.0_dp), wp), epsilon(1.0_wp))
   !> Singular values below this, relative to the largest, are taken as zero.
   real(dp), parameter :: rank_tol = 1.0e-12_dp

contains

   subroutine collect_lapack(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("solve", test_solve), &
         test_case_t("solve singular", test_solve_singular), &
         test_case_t("rank and null space", test_null_space), &
         test_case_t("null space of nothing", test_null_space_of_nothing), &
         test_case_t("eigenvalues of a chain", test_eigen)]
   end subroutine collect_lapack

   subroutine test_solve(error)
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: a(10, 10), x(10, 3), y(10, 3)
      logical :: is_singular
      integer :: i

      call random_number(a)
      do i = 1, 10
         a(i, i) = a(i, i) + 10.0_dp
      end do
      call random_number(x)
      call dense_solve(a, matmul(a, x), y, is_singular)
      call check_true(error, .not. is_singular, "regular")
      call check_near(error, real(y, wp), real(x, wp), tol, 1.0_wp, "x")
   end subroutine test_solve

   subroutine test_solve_singular(error)
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: a(2, 2), x(2, 1)
      logical :: is_singular

      a = 1.0_dp
      call dense_solve(a, reshape([1.0_dp, 2.0_dp], [2, 1]), x, is_singular)
      call check_true(error, is_singular, "singular")
      call check_near(error, real(x, wp), real(0.0_dp*x, wp), 0.0_wp, 1.0_wp, "x")
   end subroutine test_solve_singular

   !> A 5 x 8 matrix of rank 3 has a null space of dimension 5.
   subroutine test_null_space(error)
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: left(5, 3), right(3, 8), a(5, 8), gram(5, 5), unit(5, 5), zero(5, 5)
      real(dp), allocatable :: z(:, :)
      integer :: rank, i

      call random_number(left)
      call random_number(right)
      a = matmul(left, right)
      call dense_rank(a, rank_tol, rank, error)
      if (allocated(error)) return
      call check_equal(error, rank, 3, "rank")
      if (allocated(error)) return
      call dense_null_space(a, rank_tol, z, error)
      if (allocated(error)) return
      call check_equal(error, shape(z), [8, 5], "shape of z")
      if (allocated(error)) return
      unit = 0.0_dp
      zero = 0.0_dp
      do i = 1, 5
         unit(i, i) = 1.0_dp
      end do
      call check_near(error, real(matmul(a, z), wp), real(zero, wp), tol, 1.0_wp, "A z")
      gram = matmul(transpose(z), z)
      call check_near(error, real(gram, wp), real(unit, wp), tol, 1.0_wp, "z^T z")
   end subroutine test_null_space

   !> No rows, or rows of zeros: everything is in the null space.
   subroutine test_null_space_of_nothing(error)
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: none(0, 3), zero(2, 3)
      real(dp), allocatable :: z(:, :)
      integer :: rank

      call dense_null_space(none, rank_tol, z, error)
      if (allocated(error)) return
      call check_equal(error, shape(z), [3, 3], "shape of z without rows")
      zero = 0.0_dp
      if (allocated(error)) return
      call dense_null_space(zero, rank_tol, z, error)
      if (allocated(error)) return
      call check_equal(error, shape(z), [3, 3], "shape of z of zeros")
      if (allocated(error)) return
      call dense_rank(zero, rank_tol, rank, error)
      if (allocated(error)) return
      call check_equal(error, rank, 0, "rank of zeros")
   end subroutine test_null_space_of_nothing

   !> The chain (2, -1) of n: 4 sin^2(i pi/(2 n + 2)).
   subroutine test_eigen(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 6
      real(dp) :: a(n, n), expected(n), pi
      real(dp), allocatable :: lambda(:), vector(:, :)
      integer :: i

      pi = acos(-1.0_dp)
      a = 0.0_dp
      do i = 1, n
         a(i, i) = 2.0_dp
         expected(i) = 4.0_dp*sin(real(i, dp)*pi/real(2*n + 2, dp))**2
      end do
      do i = 2, n
         a(i, i - 1) = -1.0_dp
         a(i - 1, i) = -1.0_dp
      end do
      call dense_eigen(a, lambda, vector, error)
      if (allocated(error)) return
      call check_near(error, real(lambda, wp), real(expected, wp), tol, 4.0_wp, "eigenvalues")
      do i = 1, n
         call check_near(error, real(matmul(a, vector(:, i)), wp), &
            real(lambda(i)*vector(:, i), wp), tol, 4.0_wp, "A v")
      end do
   end subroutine test_eigen

end module test_lapack
