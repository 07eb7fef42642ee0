!> Block-diagonal matrices whose blocks are band matrices: LU factors by LAPACK, solutions.
!>
!> Row i of a block of n rows holds the columns i - lower to i + upper of the block. A block of one
!> row is a band of width one like any other.
module emcon_band_blocks
   use emcon_blas, only : blas_enter, blas_leave, ieee_status_type
   use emcon_kinds, only : dp
   implicit none
   private
   public :: band_blocks_t, band_blocks_init, band_blocks_place, band_blocks_factorise
   public :: band_blocks_solve

   type :: band_blocks_t
      integer :: n_block = 0
      integer, allocatable :: start(:)           !! (n_block + 1) rows before each block
      integer, allocatable :: lower(:)           !! (n_block) diagonals below the main one
      integer, allocatable :: upper(:)           !! (n_block) and above
      integer, allocatable :: before(:)          !! (n_block + 1) places before each block
      !> In the form of dgbtrf: `lower` rows of room for pivoting, then the diagonals from above.
      real(dp), allocatable :: value(:)
      integer, allocatable :: pivot(:)           !! (rows)
      logical :: is_singular = .true.            !! no factors, or a pivot is exactly zero
   end type band_blocks_t

   interface
      subroutine dgbtrf(m, n, kl, ku, ab, ldab, ipiv, info)
         import :: dp
         integer, intent(in) :: m, n, kl, ku, ldab
         real(dp), intent(inout) :: ab(ldab, *)
         integer, intent(out) :: ipiv(*), info
      end subroutine dgbtrf

      subroutine dgbtrs(trans, n, kl, ku, nrhs, ab, ldab, ipiv, b, ldb, info)
         import :: dp
         character(len=1), intent(in) :: trans
         integer, intent(in) :: n, kl, ku, nrhs, ldab, ldb
         real(dp), intent(in) :: ab(ldab, *)
         integer, intent(in) :: ipiv(*)
         real(dp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dgbtrs
   end interface

contains

   !> Room for blocks of these sizes and band widths.
   pure subroutine band_blocks_init(self, start, lower, upper)
      type(band_blocks_t), intent(out) :: self
      integer, intent(in) :: start(:)                !! (n_block + 1) from 0 to the number of rows
      integer, intent(in) :: lower(:), upper(:)      !! (n_block)
      integer :: b

      self%n_block = size(lower)
      allocate(self%start, source=start)
      allocate(self%lower, source=lower)
      allocate(self%upper, source=upper)
      allocate(self%before(self%n_block + 1), source=0)
      do b = 1, self%n_block
         self%before(b + 1) = self%before(b) + leading(self, b)*(start(b + 1) - start(b))
      end do
      allocate(self%value(self%before(self%n_block + 1)), source=0.0_dp)
      allocate(self%pivot(start(self%n_block + 1)), source=0)
   end subroutine band_blocks_init

   !> Length of a column of block `b` in memory.
   pure integer function leading(self, b)
      type(band_blocks_t), intent(in) :: self
      integer, intent(in) :: b

      leading = 2*self%lower(b) + self%upper(b) + 1
   end function leading

   !> Where the entry (i, j) of block `b`, both from 1, stands in `value`; it is within the band.
   pure integer function band_blocks_place(self, b, i, j)
      type(band_blocks_t), intent(in) :: self
      integer, intent(in) :: b, i, j

      band_blocks_place = self%before(b) + (j - 1)*leading(self, b) &
         + self%lower(b) + self%upper(b) + 1 + i - j
   end function band_blocks_place

   !> Factors P L U in place of the values.
   subroutine band_blocks_factorise(self)
      type(band_blocks_t), intent(inout) :: self
      type(ieee_status_type) :: status
      integer :: b, n, info

      self%is_singular = .false.
      call blas_enter(status)
      do b = 1, self%n_block
         n = self%start(b + 1) - self%start(b)
         call dgbtrf(n, n, self%lower(b), self%upper(b), self%value(self%before(b) + 1:), &
            leading(self, b), self%pivot(self%start(b) + 1:), info)
         if (info /= 0) self%is_singular = .true.
      end do
      call blas_leave(status)
   end subroutine band_blocks_factorise

   !> x = A^-1 x or A^-T x in place, all blocks; the right-hand sides of a block stand behind each
   !> other, and those of one block behind those of the block before.
   subroutine band_blocks_solve(self, is_transposed, n_rhs, x)
      type(band_blocks_t), intent(in) :: self
      logical, intent(in) :: is_transposed
      integer, intent(in) :: n_rhs(:)                !! (n_block)
      real(dp), intent(inout), contiguous :: x(:)    !! (sum of rows times right-hand sides)
      type(ieee_status_type) :: status
      integer :: b, n, before, info

      before = 0
      call blas_enter(status)
      do b = 1, self%n_block
         n = self%start(b + 1) - self%start(b)
         if (n_rhs(b) > 0) then
            call dgbtrs(merge("T", "N", is_transposed), n, self%lower(b), self%upper(b), n_rhs(b), &
               self%value(self%before(b) + 1:), leading(self, b), self%pivot(self%start(b) + 1:), &
               x(before + 1:), n, info)
         end if
         before = before + n*n_rhs(b)
      end do
      call blas_leave(status)
   end subroutine band_blocks_solve

end module emcon_band_blocks
