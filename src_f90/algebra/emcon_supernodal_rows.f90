!> Many sparse right-hand sides through a factor of dense blocks at once: W = L^-1 G^T by panels,
!> one for each node that some of them reach.
!>
!> A node takes what its children hand up, for all right-hand sides that reach it: products of
!> dense matrices in place of one sum after the other. Single precision is taken in double.
module emcon_supernodal_rows
   use, intrinsic :: iso_fortran_env, only : sp => real32
   use emcon_blas, only : blas_enter, blas_leave, ieee_status_type
   use emcon_kinds, only : dp
   use emcon_row_panels, only : row_panel_t
   use emcon_supernodal_factor, only : supernodal_factor_t
   use emcon_supernodes, only : n_lane, n_side, packed_size, supernodes_t
   implicit none
   private
   public :: supernodal_rows

   !> Right-hand sides at a node, or what of them it hands up.
   type :: front_t
      integer, allocatable :: row(:)             !! (m) which these are, ascending
      real(dp), allocatable :: x(:, :)           !! (rows of the node, m)
   end type front_t

   !> What there is to take on the way through the nodes.
   type :: walk_t
      integer, allocatable :: start(:)           !! (n_node + 1) entries before those of each node
      integer, allocatable :: entry(:)           !! which these are
      integer, allocatable :: of(:)              !! right-hand side of each entry
      integer, allocatable :: child(:), next(:)  !! (n_node) first child of each, the one behind it
      type(front_t), allocatable :: passed(:)    !! (n_node) what waits for the parent
      integer, allocatable :: place(:)           !! (n_row) work space: 0
   end type walk_t

   interface
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

contains

   !> The panels of all right-hand sides.
   subroutine supernodal_rows(self, nodes, row_start, column, value, panel)
      type(supernodal_factor_t), intent(in) :: self
      type(supernodes_t), intent(in) :: nodes
      integer, intent(in) :: row_start(:)        !! (n_row + 1) entries before those of each
      integer, intent(in) :: column(:)           !! columns of the factor, from 1
      real(dp), intent(in) :: value(:)           !! as `column`
      type(row_panel_t), intent(inout) :: panel(:)   !! (n_node) without rows; some get them
      type(walk_t) :: walk
      type(front_t) :: front
      type(ieee_status_type) :: status
      integer :: s

      call begin_walk(walk, nodes, row_start, column)
      call blas_enter(status)
      do s = 1, nodes%n_node
         call gather(walk, nodes, s, column, value, front)
         if (size(front%row) == 0) cycle
         call substitute(self, nodes, s, front, walk%passed(s), panel(s))
      end do
      call blas_leave(status)
   end subroutine supernodal_rows

   !> The entries of each node, and its children.
   subroutine begin_walk(walk, nodes, row_start, column)
      type(walk_t), intent(out) :: walk
      type(supernodes_t), intent(in) :: nodes
      integer, intent(in) :: row_start(:), column(:)
      integer :: last(nodes%n_node), k, r, s

      allocate(walk%start(nodes%n_node + 1), source=0)
      allocate(walk%entry(size(column)), walk%of(size(column)))
      allocate(walk%place(size(row_start) - 1), walk%child(nodes%n_node), walk%next(nodes%n_node), &
         source=0)
      allocate(walk%passed(nodes%n_node))
      do k = 1, size(column)
         s = nodes%of(column(k))
         walk%start(s + 1) = walk%start(s + 1) + 1
      end do
      do s = 1, nodes%n_node
         walk%start(s + 1) = walk%start(s + 1) + walk%start(s)
      end do
      last = walk%start(:nodes%n_node)
      do r = 1, size(row_start) - 1
         do k = row_start(r) + 1, row_start(r + 1)
            s = nodes%of(column(k))
            last(s) = last(s) + 1
            walk%entry(last(s)) = k
            walk%of(k) = r
         end do
      end do
      do s = nodes%n_node, 1, -1                 ! children in ascending order
         if (nodes%parent(s) == 0) cycle
         walk%next(s) = walk%child(nodes%parent(s))
         walk%child(nodes%parent(s)) = s
      end do
   end subroutine begin_walk

   !> The right-hand sides that reach node `s`, summed up there.
   subroutine gather(walk, nodes, s, column, value, front)
      type(walk_t), intent(inout) :: walk
      type(supernodes_t), intent(in) :: nodes
      integer, intent(in) :: s
      integer, intent(in) :: column(:)
      real(dp), intent(in) :: value(:)
      type(front_t), intent(out) :: front
      integer :: c, i, j, k, n

      call mark(walk, s)
      front%row = pack([(i, i = 1, size(walk%place))], walk%place > 0)
      n = nodes%row_start(s + 1) - nodes%row_start(s)
      allocate(front%x(n, size(front%row)), source=0.0_dp)
      walk%place(front%row) = [(i, i = 1, size(front%row))]
      do i = walk%start(s) + 1, walk%start(s + 1)
         k = walk%entry(i)
         associate (to => front%x(column(k) - nodes%first(s), walk%place(walk%of(k))))
            to = to + value(k)
         end associate
      end do
      c = walk%child(s)
      do while (c > 0)
         if (allocated(walk%passed(c)%row)) then
            i = nodes%row_start(c) + nodes%first(c + 1) - nodes%first(c)
            do j = 1, size(walk%passed(c)%row)
               associate (to => front%x(:, walk%place(walk%passed(c)%row(j))))
                  do k = 1, size(walk%passed(c)%x, 1)
                     to(nodes%above(i + k)) = to(nodes%above(i + k)) + walk%passed(c)%x(k, j)
                  end do
               end associate
            end do
            deallocate(walk%passed(c)%row, walk%passed(c)%x)
         end if
         c = walk%next(c)
      end do
      walk%place(front%row) = 0
   end subroutine gather

   !> Which right-hand sides come to node `s`.
   pure subroutine mark(walk, s)
      type(walk_t), intent(inout) :: walk
      integer, intent(in) :: s
      integer :: c, i

      do i = walk%start(s) + 1, walk%start(s + 1)
         walk%place(walk%of(walk%entry(i))) = 1
      end do
      c = walk%child(s)
      do while (c > 0)
         if (allocated(walk%passed(c)%row)) walk%place(walk%passed(c)%row) = 1
         c = walk%next(c)
      end do
   end subroutine mark

   !> Solve with the triangle of node `s`, and hand up what the block below it makes of that.
   subroutine substitute(self, nodes, s, front, passed, panel)
      type(supernodal_factor_t), intent(in) :: self
      type(supernodes_t), intent(in) :: nodes
      integer, intent(in) :: s
      type(front_t), intent(inout) :: front
      type(front_t), intent(inout) :: passed
      type(row_panel_t), intent(inout) :: panel
      real(dp), allocatable :: dense(:, :)
      integer :: m, n, n_row

      n = nodes%first(s + 1) - nodes%first(s)
      n_row = size(front%x, 1)
      m = size(front%row)
      panel%first = nodes%first(s)
      panel%w = front%x(:n, :)
      allocate(dense(n, n), source=0.0_dp)
      call unpack_triangle(n, self%value(nodes%value_start(s) + 1:), dense)
      call dtrmm("L", "L", "N", "N", n, m, 1.0_dp, dense, n, panel%w, n)
      if (n_row > n) then
         passed%row = front%row
         passed%x = front%x(n + 1:, :)
         deallocate(dense)
         allocate(dense(n_lane*((n_row - n + n_lane - 1)/n_lane), n))
         call unpack_block(size(dense, 1)/n_lane, n, &
            self%value(nodes%value_start(s) + packed_size(n) + 1:), dense)
         call dgemm("N", "N", n_row - n, m, n, -1.0_dp, dense, size(dense, 1), panel%w, n, 1.0_dp, &
            passed%x, n_row - n)
      end if
      call move_alloc(front%row, panel%row)
   end subroutine substitute

   !> A packed triangle in full.
   pure subroutine unpack_triangle(n, packed, dense)
      integer, intent(in) :: n
      real(sp), intent(in) :: packed(*)
      real(dp), intent(inout) :: dense(n, n)     !! its lower triangle is set
      integer :: j, k

      k = 0
      do j = 1, n
         dense(j:, j) = packed(k + 1:k + n - j + 1)
         k = k + n - j + 1
      end do
   end subroutine unpack_triangle

   !> The block below it, whose columns stand side by side.
   pure subroutine unpack_block(n_lanes, n, packed, dense)
      integer, intent(in) :: n_lanes, n
      real(sp), intent(in) :: packed(*)
      real(dp), intent(out) :: dense(n_lane, n_lanes, n)
      integer :: i, j, k, m

      k = 0
      do j = 1, n, n_side
         m = min(n_side, n - j + 1)
         do i = 1, n_lanes
            dense(:, i, j:j + m - 1) = reshape(packed(k + 1:k + m*n_lane), [n_lane, m])
            k = k + m*n_lane
         end do
      end do
   end subroutine unpack_block

end module emcon_supernodal_rows
