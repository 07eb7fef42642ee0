!> The pattern of a Cholesky factor whose columns are taken together where they have the same rows:
!> nodes of a tree, each a dense block of columns.
!>
!> A node's front is the matrix of its rows, of which the first are its columns: factorising these
!> leaves an update to the other rows, which the front of the parent takes. Nodes stand in an order
!> in which updates can be stacked: the last ones not yet taken are those of the children.
module emcon_supernodes
   use emcon_csr, only : csr_t
   use emcon_kinds, only : int64
   implicit none
   private
   public :: supernodes_t, supernodes_init, supernodes_is_stack, packed_size, &
      n_lane, n_side

   !> Of the block below a triangle so many rows, filled up by zeros, and columns are kept together.
   integer, parameter :: n_lane = 8, n_side = 4

   type :: supernodes_t
      integer :: n = 0                               !! unknowns
      integer :: n_node = 0
      integer, allocatable :: order(:)               !! (n) unknown of each column
      integer, allocatable :: place(:)               !! (n) column of each unknown
      integer, allocatable :: of(:)                  !! (n) node of each column
      integer, allocatable :: first(:)               !! (n_node + 1) columns before each node
      integer, allocatable :: row_start(:)           !! (n_node + 1) rows before those of each
      integer, allocatable :: row(:)                 !! ascending, its own columns first
      integer, allocatable :: parent(:)              !! (n_node) > the node; 0: it is a root
      integer, allocatable :: above(:)               !! as `row`: places in the parent's front
      integer(int64), allocatable :: value_start(:)  !! (n_node + 1) entries before each
      integer, allocatable :: slot_start(:)          !! (n_node + 1) entries of the matrix before
      integer, allocatable :: slot(:)                !! which these are
      integer, allocatable :: target(:)              !! (slots) their places in the node's front
      integer :: widest = 0                          !! rows of the largest front
      integer(int64) :: n_stacked = 0_int64          !! most entries of updates at a time
   end type supernodes_t

contains

   !> Take what the analysis of a matrix has found; all from 0.
   pure subroutine supernodes_init(self, matrix, order, first, row_start, row)
      type(supernodes_t), intent(out) :: self
      type(csr_t), intent(in) :: matrix              !! of symmetric pattern
      integer, intent(in) :: order(:)                !! (n) unknown of each column
      integer, intent(in) :: first(:)                !! (n_node + 1) columns before each node
      integer, intent(in) :: row_start(:)            !! (n_node + 1) rows before those of each
      integer, intent(in) :: row(:)                  !! ascending, its own columns first
      integer :: k, s

      self%n = size(order)
      self%n_node = size(first) - 1
      self%order = order + 1
      self%first = first
      self%row_start = row_start
      self%row = row + 1
      allocate(self%place(self%n), self%of(self%n), self%parent(self%n_node), source=0)
      allocate(self%above(size(row)), source=0)
      allocate(self%value_start(self%n_node + 1), source=0_int64)
      self%place(self%order) = [(k, k = 1, self%n)]
      do s = 1, self%n_node
         self%of(first(s) + 1:first(s + 1)) = s
         self%widest = max(self%widest, row_start(s + 1) - row_start(s))
         self%value_start(s + 1) = self%value_start(s) + n_value(first(s + 1) - first(s), &
            row_start(s + 1) - row_start(s))
      end do
      call find_parents(self)
      call find_slots(self, matrix)
      call find_stack(self)
   end subroutine supernodes_init

   !> Entries of a packed triangle: half of n (n + 1).
   pure integer(int64) function packed_size(n)
      integer, intent(in) :: n

      packed_size = shiftr(int(n, int64)*(n + 1), 1)
   end function packed_size

   !> Entries of a node: the packed lower triangle, and the block below it.
   pure integer(int64) function n_value(n_column, n_row)
      integer, intent(in) :: n_column, n_row

      n_value = packed_size(n_column) &
         + int(n_column, int64)*(n_lane*((n_row - n_column + n_lane - 1)/n_lane))
   end function n_value

   !> `parent` and `above`: the parent has the first row below a node as a column, and all others.
   pure subroutine find_parents(self)
      type(supernodes_t), intent(inout) :: self
      integer :: s, p, k, at, n_column

      do s = 1, self%n_node
         n_column = self%first(s + 1) - self%first(s)
         if (self%row_start(s) + n_column == self%row_start(s + 1)) cycle
         p = self%of(self%row(self%row_start(s) + n_column + 1))
         self%parent(s) = p
         at = self%row_start(p) + 1
         do k = self%row_start(s) + n_column + 1, self%row_start(s + 1)
            do while (self%row(at) < self%row(k))
               at = at + 1
            end do
            self%above(k) = at - self%row_start(p)
         end do
      end do
   end subroutine find_parents

   !> Which entries of the matrix are summed into which front, and where.
   pure subroutine find_slots(self, matrix)
      type(supernodes_t), intent(inout) :: self
      type(csr_t), intent(in) :: matrix
      integer :: local(self%n), s, c, k, m, n_row, i

      m = (size(matrix%column) + self%n)/2
      allocate(self%slot_start(self%n_node + 1), self%slot(m), self%target(m), source=0)
      local = 0
      m = 0
      do s = 1, self%n_node
         n_row = self%row_start(s + 1) - self%row_start(s)
         do k = 1, n_row
            local(self%row(self%row_start(s) + k)) = k
         end do
         do c = self%first(s) + 1, self%first(s + 1)
            i = self%order(c)
            do k = matrix%row_start(i) + 1, matrix%row_start(i + 1)
               if (self%place(matrix%column(k) + 1) < c) cycle
               m = m + 1
               self%slot(m) = k
               self%target(m) = local(self%place(matrix%column(k) + 1)) &
                  + n_row*(c - self%first(s) - 1)
            end do
         end do
         self%slot_start(s + 1) = m
      end do
   end subroutine find_slots

   !> How much room the updates take that wait for their parents.
   pure subroutine find_stack(self)
      type(supernodes_t), intent(inout) :: self
      integer(int64) :: n
      integer :: waiting(self%n_node), n_waiting, s

      n = 0
      n_waiting = 0
      do s = 1, self%n_node
         do while (n_waiting > 0)
            if (self%parent(waiting(n_waiting)) /= s) exit
            n = n - n_update(self, waiting(n_waiting))
            n_waiting = n_waiting - 1
         end do
         if (self%parent(s) == 0) cycle
         n_waiting = n_waiting + 1
         waiting(n_waiting) = s
         n = n + n_update(self, s)
         self%n_stacked = max(self%n_stacked, n)
      end do
   end subroutine find_stack

   !> Entries of the update of a node, a packed lower triangle.
   pure integer(int64) function n_update(self, s)
      type(supernodes_t), intent(in) :: self
      integer, intent(in) :: s

      n_update = packed_size(self%row_start(s + 1) - self%row_start(s) &
         - (self%first(s + 1) - self%first(s)))
   end function n_update

   !> Do the nodes stand in an order in which updates can be stacked?
   pure logical function supernodes_is_stack(self)
      type(supernodes_t), intent(in) :: self
      integer :: waiting(self%n_node), n_waiting, s

      n_waiting = 0
      do s = 1, self%n_node
         do while (n_waiting > 0)
            if (self%parent(waiting(n_waiting)) /= s) exit
            n_waiting = n_waiting - 1
         end do
         if (self%parent(s) == 0) cycle
         n_waiting = n_waiting + 1
         waiting(n_waiting) = s
      end do
      supernodes_is_stack = n_waiting == 0
   end function supernodes_is_stack

end module emcon_supernodes
