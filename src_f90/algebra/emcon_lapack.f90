!> Small dense linear algebra on LAPACK.
!>
!> The exceptions that BLAS kernels raise inside are kept from the caller.
module emcon_lapack
   use emcon_blas, only : blas_enter, blas_leave, ieee_status_type
   use emcon_blocks_lapack, only : dpotrf
   use emcon_errors, only : err_analysis, error_t, raise
   use emcon_kinds, only : dp
   use emcon_text, only : to_text
   implicit none
   private
   public :: dense_solve, dense_singular_values, dense_rank, dense_null_space
   public :: dense_eigen, dense_cholesky, dense_cholesky_solve
   public :: dense_lu_t, dense_lu, dense_lu_solve

   !> A = P L U of a square matrix.
   type :: dense_lu_t
      real(dp), allocatable, private :: lu(:, :)
      integer, allocatable, private :: pivot(:)
   end type dense_lu_t

   interface
      subroutine dgesv(n, nrhs, a, lda, ipiv, b, ldb, info)
         import :: dp
         integer, intent(in) :: n, nrhs, lda, ldb
         real(dp), intent(inout) :: a(lda, *), b(ldb, *)
         integer, intent(out) :: ipiv(*), info
      end subroutine dgesv

      subroutine dgetrf(m, n, a, lda, ipiv, info)
         import :: dp
         integer, intent(in) :: m, n, lda
         real(dp), intent(inout) :: a(lda, *)
         integer, intent(out) :: ipiv(*), info
      end subroutine dgetrf

      subroutine dgetrs(trans, n, nrhs, a, lda, ipiv, b, ldb, info)
         import :: dp
         character(len=1), intent(in) :: trans
         integer, intent(in) :: n, nrhs, lda, ldb
         real(dp), intent(in) :: a(lda, *)
         integer, intent(in) :: ipiv(*)
         real(dp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dgetrs

      subroutine dgesvd(jobu, jobvt, m, n, a, lda, s, u, ldu, vt, ldvt, work, lwork, info)
         import :: dp
         character(len=1), intent(in) :: jobu, jobvt
         integer, intent(in) :: m, n, lda, ldu, ldvt, lwork
         real(dp), intent(inout) :: a(lda, *)
         real(dp), intent(out) :: s(*), u(ldu, *), vt(ldvt, *), work(*)
         integer, intent(out) :: info
      end subroutine dgesvd

      subroutine dsyev(jobz, uplo, n, a, lda, w, work, lwork, info)
         import :: dp
         character(len=1), intent(in) :: jobz, uplo
         integer, intent(in) :: n, lda, lwork
         real(dp), intent(inout) :: a(lda, *)
         real(dp), intent(out) :: w(*), work(*)
         integer, intent(out) :: info
      end subroutine dsyev

      subroutine dpotrs(uplo, n, nrhs, a, lda, b, ldb, info)
         import :: dp
         character(len=1), intent(in) :: uplo
         integer, intent(in) :: n, nrhs, lda, ldb
         real(dp), intent(in) :: a(lda, *)
         real(dp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dpotrs
   end interface

contains

   !> x = A^-1 b, one column of `b` after the other.
   subroutine dense_solve(a, b, x, is_singular)
      real(dp), intent(in) :: a(:, :)                !! (n, n)
      real(dp), intent(in) :: b(:, :)                !! (n, n_rhs)
      real(dp), intent(out) :: x(:, :)               !! (n, n_rhs) zero if singular
      logical, intent(out) :: is_singular            !! a pivot is exactly zero
      real(dp), allocatable :: lu(:, :), solution(:, :)
      integer, allocatable :: pivot(:)
      type(ieee_status_type) :: status
      integer :: n, info

      n = size(a, 1)
      allocate(lu, source=a)
      allocate(solution, source=b)
      allocate(pivot(n))
      info = 0
      call blas_enter(status)
      if (n > 0) call dgesv(n, size(b, 2), lu, n, pivot, solution, n, info)
      call blas_leave(status)
      is_singular = info /= 0
      x = 0.0_dp
      if (.not. is_singular) x = solution
   end subroutine dense_solve

   !> Factorise A, to solve with it more than once.
   subroutine dense_lu(a, factor, is_singular)
      real(dp), intent(in) :: a(:, :)                !! (n, n)
      type(dense_lu_t), intent(inout) :: factor
      logical, intent(out) :: is_singular            !! a pivot is exactly zero: there is no factor
      type(ieee_status_type) :: status
      integer :: n, info

      n = size(a, 1)
      factor%lu = a
      if (allocated(factor%pivot)) deallocate(factor%pivot)
      allocate(factor%pivot(n))
      info = 0
      call blas_enter(status)
      if (n > 0) call dgetrf(n, n, factor%lu, n, factor%pivot, info)
      call blas_leave(status)
      is_singular = info /= 0
   end subroutine dense_lu

   !> x = A^-1 x by the factor of `dense_lu`, which is not singular.
   subroutine dense_lu_solve(factor, x)
      type(dense_lu_t), intent(in) :: factor
      real(dp), intent(inout), contiguous :: x(:)    !! (n)
      type(ieee_status_type) :: status
      integer :: info

      call blas_enter(status)
      if (size(x) > 0) call dgetrs("N", size(x), 1, factor%lu, size(x), factor%pivot, x, size(x), &
         info)
      call blas_leave(status)
   end subroutine dense_lu_solve

   !> The singular values of A, descending.
   subroutine dense_singular_values(a, sigma, error)
      real(dp), intent(in) :: a(:, :)                       !! (m, n)
      real(dp), allocatable, intent(out) :: sigma(:)        !! (min(m, n))
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: no_vt(1, 1)

      call decompose(a, "N", sigma, no_vt, error)
   end subroutine dense_singular_values

   !> Number of singular values above `rel` times the largest.
   subroutine dense_rank(a, rel, rank, error)
      real(dp), intent(in) :: a(:, :)
      real(dp), intent(in) :: rel                           !! > 0
      integer, intent(out) :: rank
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: sigma(:)

      rank = 0
      call dense_singular_values(a, sigma, error)
      if (allocated(error)) return
      if (size(sigma) > 0) rank = count(sigma > rel*sigma(1))
   end subroutine dense_rank

   !> Orthonormal columns z with A z = 0, up to singular values of `rel` times the largest.
   subroutine dense_null_space(a, rel, z, error)
      real(dp), intent(in) :: a(:, :)                       !! (m, n)
      real(dp), intent(in) :: rel
      real(dp), allocatable, intent(out) :: z(:, :)         !! (n, n - rank)
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: sigma(:), vt(:, :)
      integer :: n, rank

      n = size(a, 2)
      allocate(vt(n, n))
      call decompose(a, "A", sigma, vt, error)
      if (allocated(error)) return
      rank = 0
      if (size(sigma) > 0) rank = count(sigma > rel*sigma(1))
      z = transpose(vt(rank + 1:, :))
   end subroutine dense_null_space

   !> A = U sigma V^T: sigma, and with job "A" all rows of V^T.
   subroutine decompose(a, job, sigma, vt, error)
      real(dp), intent(in) :: a(:, :)
      character(len=1), intent(in) :: job                   !! "N": no V, "A": all of it
      real(dp), allocatable, intent(out) :: sigma(:)
      real(dp), intent(inout), contiguous :: vt(:, :)
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: copy(:, :), work(:)
      real(dp) :: no_u(1, 1)
      type(ieee_status_type) :: status
      integer :: m, n, i, info

      m = size(a, 1)
      n = size(a, 2)
      allocate(sigma(min(m, n)), source=0.0_dp)
      if (m == 0 .or. n == 0) then
         if (job == "A") then
            vt = 0.0_dp
            do i = 1, n
               vt(i, i) = 1.0_dp
            end do
         end if
         return
      end if
      allocate(copy, source=a)
      allocate(work(5*(m + n) + 3*max(m, n)))
      call blas_enter(status)
      call dgesvd("N", job, m, n, copy, m, sigma, no_u, 1, vt, size(vt, 1), work, size(work), info)
      call blas_leave(status)
      if (info == 0) return
      call raise(error, err_analysis, "singular values of a " // to_text(m) // " x " // to_text(n) &
         // " matrix: no convergence (dgesvd returns " // to_text(info) // ")")
   end subroutine decompose

   !> Eigenvalues, ascending, and eigenvectors of a symmetric matrix (the lower triangle is read).
   subroutine dense_eigen(a, lambda, vector, error)
      real(dp), intent(in) :: a(:, :)                       !! (n, n)
      real(dp), allocatable, intent(out) :: lambda(:)       !! (n)
      real(dp), allocatable, intent(out) :: vector(:, :)    !! (n, n) orthonormal columns
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: work(:)
      type(ieee_status_type) :: status
      integer :: n, info

      n = size(a, 1)
      allocate(vector, source=a)
      allocate(lambda(n))
      if (n == 0) return
      allocate(work(34*n))
      call blas_enter(status)
      call dsyev("V", "L", n, vector, n, lambda, work, size(work), info)
      call blas_leave(status)
      if (info /= 0) call raise(error, err_analysis, "eigenvalues of a matrix with " &
         // to_text(n) // " rows: no convergence (dsyev returns " // to_text(info) // ")")
   end subroutine dense_eigen

   !> A = L L^T of a symmetric matrix, in place of its lower triangle, which alone is read.
   subroutine dense_cholesky(a, is_definite)
      real(dp), intent(inout), contiguous :: a(:, :)        !! (n, n)
      logical, intent(out) :: is_definite                   !! else there is no factor
      type(ieee_status_type) :: status
      integer :: info

      info = 0
      call blas_enter(status)
      if (size(a) > 0) call dpotrf("L", size(a, 1), a, size(a, 1), info)
      call blas_leave(status)
      is_definite = info == 0
   end subroutine dense_cholesky

   !> x = A^-1 x by the factor of `dense_cholesky`.
   subroutine dense_cholesky_solve(l, x)
      real(dp), intent(in), contiguous :: l(:, :)           !! (n, n)
      real(dp), intent(inout), contiguous :: x(:)           !! (n)
      type(ieee_status_type) :: status
      integer :: info

      if (size(x) == 0) return
      call blas_enter(status)
      call dpotrs("L", size(x), 1, l, size(x), x, size(x), info)
      call blas_leave(status)
   end subroutine dense_cholesky_solve

end module emcon_lapack
