! build: streams
!> Cholesky factors in single precision, node by node of a tree of dense fronts.
!>
!> For corrections that are repeated until a residual vanishes: their last digits are of no use, and
!> what is half as long is read twice as fast. Source: I. S. Duff, J. K. Reid, ACM Trans. Math.
!> Software 9 (1983) 302-325.
module emcon_supernodal_factor
   use, intrinsic :: iso_fortran_env, only : sp => real32
   use, intrinsic :: ieee_arithmetic, only : ieee_get_underflow_mode, ieee_set_underflow_mode, &
      ieee_support_underflow_control
   use emcon_blas, only : blas_enter, blas_leave, ieee_status_type
   use emcon_kinds, only : dp, int64
   use emcon_supernodes, only : n_lane, n_side, packed_size, supernodes_t
   implicit none
   private
   public :: supernodal_factor_t, supernodal_factorise, supernodal_free

   !> Entries are below it: sums of their squares in the range of single precision.
   real(dp), parameter :: largest = 2.0_dp**(maxexponent(1.0_sp)/4)

   !> Of a triangle that is inverted at once.
   integer, parameter :: most_rows = 128

   type :: supernodal_factor_t
      !> For each node the inverse of its triangle, packed column by column; then the block below
      !> it: `n_side` columns side by side, of these `n_lane` rows at a time.
      real(sp), allocatable :: value(:)
      real(sp), allocatable :: front(:)          !! (widest**2) work space
      real(sp), allocatable :: stack(:)          !! (n_stacked) updates that wait
      real(dp), allocatable :: zero(:)           !! (n) zeros between calls
   end type supernodal_factor_t

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
   end interface

contains

   !> Factorise a symmetric matrix, if it is definite and its entries are in range.
   subroutine supernodal_factorise(self, nodes, value, is_definite)
      type(supernodal_factor_t), intent(inout) :: self
      type(supernodes_t), intent(in) :: nodes
      real(dp), intent(in), contiguous :: value(:)     !! (n_slot)
      logical, intent(out) :: is_definite
      type(ieee_status_type) :: status
      logical :: is_gradual

      is_definite = all(abs(value) < largest)
      if (.not. is_definite) return
      if (.not. allocated(self%value)) allocate(self%value(nodes%value_start(nodes%n_node + 1)), &
         self%front(int(nodes%widest, int64)**2), self%stack(nodes%n_stacked))
      if (.not. allocated(self%zero)) allocate(self%zero(nodes%n), source=0.0_dp)
      call blas_enter(status)
      is_gradual = .true.
      if (ieee_support_underflow_control(1.0_sp)) then
         call ieee_get_underflow_mode(is_gradual)
         call ieee_set_underflow_mode(.false.)
      end if
      call factorise_nodes(self, nodes, value, is_definite)
      if (ieee_support_underflow_control(1.0_sp)) call ieee_set_underflow_mode(is_gradual)
      call blas_leave(status)
   end subroutine supernodal_factorise

   !> Node by node. What is below the smallest number is zero: with denormal ones, which entries far
   !> from the diagonal come to, processors are slow.
   subroutine factorise_nodes(self, nodes, value, is_definite)
      type(supernodal_factor_t), intent(inout) :: self
      type(supernodes_t), intent(in) :: nodes
      real(dp), intent(in), contiguous :: value(:)     !! (n_slot)
      logical, intent(out) :: is_definite
      integer(int64) :: top
      integer :: waiting(nodes%n_node), n_waiting, s, n_row, n_column, info

      is_definite = .false.
      top = 0
      n_waiting = 0
      do s = 1, nodes%n_node
         n_row = nodes%row_start(s + 1) - nodes%row_start(s)
         n_column = nodes%first(s + 1) - nodes%first(s)
         call begin_front(self%front, nodes, s, n_row, value)
         do while (n_waiting > 0)
            if (nodes%parent(waiting(n_waiting)) /= s) exit
            call take_update(self, nodes, waiting(n_waiting), n_row, top)
            n_waiting = n_waiting - 1
         end do
         call factorise_front(self%front, n_row, n_column, info)
         if (info /= 0) return
         call keep(self%front, n_row, n_column, &
            self%value(nodes%value_start(s) + 1:))
         if (n_row == n_column) cycle
         call push_update(self, n_row, n_column, top)
         n_waiting = n_waiting + 1
         waiting(n_waiting) = s
      end do
      is_definite = .true.
   end subroutine factorise_nodes

   !> Forget the factor.
   pure subroutine supernodal_free(self)
      type(supernodal_factor_t), intent(inout) :: self

      if (allocated(self%value)) deallocate(self%value, self%front, self%stack, self%zero)
   end subroutine supernodal_free

   !> The entries of the matrix in the front of node `s`.
   pure subroutine begin_front(front, nodes, s, n_row, value)
      integer, intent(in) :: s, n_row
      real(sp), intent(inout) :: front(n_row*n_row)
      type(supernodes_t), intent(in) :: nodes
      real(dp), intent(in), contiguous :: value(:)
      integer :: j, k

      do j = 1, n_row
         front((j - 1)*n_row + j:j*n_row) = 0.0_sp
      end do
      do k = nodes%slot_start(s) + 1, nodes%slot_start(s + 1)
         front(nodes%target(k)) = real(value(nodes%slot(k)), sp)
      end do
   end subroutine begin_front

   !> Add the update of node `s`, the last one of the stack, to the front of its parent.
   pure subroutine take_update(self, nodes, s, n_row, top)
      type(supernodal_factor_t), intent(inout) :: self
      type(supernodes_t), intent(in) :: nodes
      integer, intent(in) :: s
      integer, intent(in) :: n_row                     !! of the parent
      integer(int64), intent(inout) :: top             !! entries of the stack
      integer :: from, m

      from = nodes%row_start(s) + nodes%first(s + 1) - nodes%first(s)
      m = nodes%row_start(s + 1) - from
      top = top - packed_size(m)
      call extend_add(n_row, m, nodes%above(from + 1:from + m), self%stack(top + 1:), self%front)
   end subroutine take_update

   !> front(place, place) = front(place, place) + update, lower triangles.
   pure subroutine extend_add(n_row, m, place, update, front)
      integer, intent(in) :: n_row, m, place(m)
      real(sp), intent(in) :: update(*)                !! packed
      real(sp), intent(inout) :: front(n_row, n_row)
      integer :: i, j, k

      k = 0
      do j = 1, m
         do i = j, m
            front(place(i), place(j)) = front(place(i), place(j)) + update(k + i)
         end do
         k = k + m - j
      end do
   end subroutine extend_add

   !> The first columns of a front, their triangle inverted, and the update to the rest of it.
   subroutine factorise_front(front, n_row, n_column, info)
      integer, intent(in) :: n_row, n_column
      real(sp), intent(inout) :: front(n_row, n_row)
      integer, intent(out) :: info                     !! not 0: it is not definite
      integer :: m

      call spotrf("L", n_column, front, n_row, info)
      if (info /= 0) return
      m = n_row - n_column
      if (m > 0) then
         call strsm("R", "L", "T", "N", m, n_column, 1.0_sp, front, n_row, front(n_column + 1, 1), &
            n_row)
         call ssyrk("L", "N", m, n_column, -1.0_sp, front(n_column + 1, 1), n_row, 1.0_sp, &
            front(n_column + 1, n_column + 1), n_row)
      end if
      call invert_triangle(n_column, front, n_row, info)
   end subroutine factorise_front

   !> The inverse of a lower triangle in its place. OpenBLAS 0.3.21 crashes in STRTRI with more than
   !> 128 rows on processors that it does not know, so larger ones are inverted by halves.
   recursive subroutine invert_triangle(n, a, lda, info)
      integer, intent(in) :: n, lda
      real(sp), intent(inout) :: a(lda, *)
      integer, intent(out) :: info
      integer :: half

      if (n <= most_rows) then
         call strtri("L", "N", n, a, lda, info)
         return
      end if
      half = n/2
      associate (rest => n - half)
         call strsm("L", "L", "N", "N", rest, half, -1.0_sp, a(half + 1, half + 1), lda, &
            a(half + 1, 1), lda)
         call strsm("R", "L", "N", "N", rest, half, 1.0_sp, a, lda, a(half + 1, 1), lda)
         call invert_triangle(half, a, lda, info)
         if (info == 0) call invert_triangle(rest, a(half + 1, half + 1), lda, info)
      end associate
   end subroutine invert_triangle

   !> The columns of the factor as they are kept.
   pure subroutine keep(front, n_row, n_column, value)
      integer, intent(in) :: n_row, n_column
      real(sp), intent(in) :: front(n_row, n_row)
      real(sp), intent(inout) :: value(*)
      integer :: i, j, k, n, m

      k = 0
      do j = 1, n_column
         value(k + 1:k + n_column - j + 1) = front(j:n_column, j)
         k = k + n_column - j + 1
      end do
      do j = 0, n_column - 1, n_side
         n = min(n_side, n_column - j)
         do i = n_column, n_row - 1, n_lane
            m = min(n_lane, n_row - i)
            call keep_lanes(m, n, n_row, front(i + 1, j + 1), value(k + 1))
            k = k + n_lane*n
         end do
      end do
   end subroutine keep

   !> `m` rows of `n` columns, filled up by zeros.
   pure subroutine keep_lanes(m, n, n_row, front, value)
      integer, intent(in) :: m, n, n_row
      real(sp), intent(in) :: front(n_row, *)
      real(sp), intent(out) :: value(n_lane, n)

      value(:m, :) = front(:m, :n)
      value(m + 1:, :) = 0.0_sp
   end subroutine keep_lanes

   !> Put the update of a front on the stack.
   pure subroutine push_update(self, n_row, n_column, top)
      type(supernodal_factor_t), intent(inout) :: self
      integer, intent(in) :: n_row, n_column
      integer(int64), intent(inout) :: top
      integer :: j

      do j = n_column + 1, n_row
         self%stack(top + 1:top + n_row - j + 1) = self%front((j - 1)*n_row + j:j*n_row)
         top = top + n_row - j + 1
      end do
   end subroutine push_update

end module emcon_supernodal_factor
