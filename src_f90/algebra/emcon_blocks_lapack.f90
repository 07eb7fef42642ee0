!> What BLAS and LAPACK have for factors by dense blocks, by their names: what is handed over may be
!> an element that begins a block.
module emcon_blocks_lapack
   use, intrinsic :: iso_fortran_env, only : sp => real32
   use emcon_kinds, only : dp
   implicit none
   private
   public :: spotrf, strtri, strsm, ssyrk, dpotrf, dtrtri, dtrsm, dsyrk, dgemm, dtrmm

   interface
      subroutine spotrf(uplo, n, a, lda, info)
         import :: sp
         character(len=1), intent(in) :: uplo
         integer, intent(in) :: n, lda
         real(sp), intent(inout) :: a(lda, *)
         integer, intent(out) :: info
      end subroutine spotrf

      subroutine strtri(uplo, diag, n, a, lda, info)
         import :: sp
         character(len=1), intent(in) :: uplo, diag
         integer, intent(in) :: n, lda
         real(sp), intent(inout) :: a(lda, *)
         integer, intent(out) :: info
      end subroutine strtri

      subroutine strsm(side, uplo, transa, diag, m, n, alpha, a, lda, b, ldb)
         import :: sp
         character(len=1), intent(in) :: side, uplo, transa, diag
         integer, intent(in) :: m, n, lda, ldb
         real(sp), intent(in) :: alpha, a(lda, *)
         real(sp), intent(inout) :: b(ldb, *)
      end subroutine strsm

      subroutine ssyrk(uplo, trans, n, k, alpha, a, lda, beta, c, ldc)
         import :: sp
         character(len=1), intent(in) :: uplo, trans
         integer, intent(in) :: n, k, lda, ldc
         real(sp), intent(in) :: alpha, a(lda, *), beta
         real(sp), intent(inout) :: c(ldc, *)
      end subroutine ssyrk

      subroutine dpotrf(uplo, n, a, lda, info)
         import :: dp
         character(len=1), intent(in) :: uplo
         integer, intent(in) :: n, lda
         real(dp), intent(inout) :: a(lda, *)
         integer, intent(out) :: info
      end subroutine dpotrf

      subroutine dtrtri(uplo, diag, n, a, lda, info)
         import :: dp
         character(len=1), intent(in) :: uplo, diag
         integer, intent(in) :: n, lda
         real(dp), intent(inout) :: a(lda, *)
         integer, intent(out) :: info
      end subroutine dtrtri

      subroutine dtrsm(side, uplo, transa, diag, m, n, alpha, a, lda, b, ldb)
         import :: dp
         character(len=1), intent(in) :: side, uplo, transa, diag
         integer, intent(in) :: m, n, lda, ldb
         real(dp), intent(in) :: alpha, a(lda, *)
         real(dp), intent(inout) :: b(ldb, *)
      end subroutine dtrsm

      subroutine dsyrk(uplo, trans, n, k, alpha, a, lda, beta, c, ldc)
         import :: dp
         character(len=1), intent(in) :: uplo, trans
         integer, intent(in) :: n, k, lda, ldc
         real(dp), intent(in) :: alpha, a(lda, *), beta
         real(dp), intent(inout) :: c(ldc, *)
      end subroutine dsyrk

      subroutine dgemm(transa, transb, m, n, k, alpha, a, lda, b, ldb, beta, c, ldc)
         import :: dp
         character(len=1), intent(in) :: transa, transb
         integer, intent(in) :: m, n, k, lda, ldb, ldc
         real(dp), intent(in) :: alpha, a(lda, *), b(ldb, *), beta
         real(dp), intent(inout) :: c(ldc, *)
      end subroutine dgemm

      subroutine dtrmm(side, uplo, transa, diag, m, n, alpha, a, lda, b, ldb)
         import :: dp
         character(len=1), intent(in) :: side, uplo, transa, diag
         integer, intent(in) :: m, n, lda, ldb
         real(dp), intent(in) :: alpha, a(lda, *)
         real(dp), intent(inout) :: b(ldb, *)
      end subroutine dtrmm
   end interface

end module emcon_blocks_lapack
