!> Which columns of a Cholesky factor are taken together as a node: those with the same rows below
!> them, and, for longer loops, some with nearly the same: the factor is filled up by some zeros.
!> Source: C. Ashcraft, R. Grimes, ACM Trans. Math. Software 15 (1989) 291-309.
module emcon_supernode_search
   use emcon_csr, only : csr_t
   use emcon_elimination_tree, only : elimination_tree_t
   use emcon_kinds, only : dp
   use emcon_sort, only : sort_few, sort_order
   use emcon_supernodes, only : supernodes_init, supernodes_t
   implicit none
   private
   public :: supernodes_find

   !> Nodes of up to so many columns may hold such a part of zeros.
   integer, parameter :: n_column_of(4) = [4, 16, 48, huge(1)]
   real(dp), parameter :: most_zeros(4) = [1.0_dp, 0.8_dp, 0.1_dp, 0.05_dp]

   !> Nodes that columns fall into.
   type :: partition_t
      integer, allocatable :: first(:)           !! (n_node + 1) columns before each node
      integer, allocatable :: parent(:)          !! (n_node) > the node; 0: it is a root
      integer, allocatable :: row_start(:)       !! (n_node + 1) rows before those of each
      integer, allocatable :: row(:)             !! from 0, ascending, its own columns first
   end type partition_t

contains

   !> The nodes of a factor, with their rows.
   pure subroutine supernodes_find(self, pattern, tree)
      type(supernodes_t), intent(out) :: self
      type(csr_t), intent(in) :: pattern         !! symmetric, with all of the diagonal
      type(elimination_tree_t), intent(in) :: tree     !! of it
      type(partition_t) :: part
      integer, allocatable :: head(:)

      call find_equal(tree, part%first)
      call join(tree, part%first, head)
      part%first = [head - 1, size(tree%order)]
      call find_parents(part, tree)
      call find_rows(part, pattern, tree)
      call supernodes_init(self, pattern, tree%order - 1, part%first, part%row_start, part%row)
   end subroutine supernodes_find

   !> Nodes of columns that differ by their own row alone: the first column of each.
   pure subroutine find_equal(tree, first)
      type(elimination_tree_t), intent(in) :: tree
      integer, allocatable, intent(out) :: first(:)
      logical :: begins(size(tree%order))
      integer :: j

      begins(1) = .true.
      do j = 2, size(begins)
         begins(j) = tree%parent(j - 1) /= j .or. tree%n_row(j - 1) /= tree%n_row(j) + 1
      end do
      first = pack([(j, j = 1, size(begins))], begins)
   end subroutine find_equal

   !> Join a node with the one behind it, from the last one on, where that is its parent, with all
   !> that was joined to it, and the zeros are few.
   pure subroutine join(tree, first, head)
      type(elimination_tree_t), intent(in) :: tree
      integer, intent(in) :: first(:)            !! (n_node) first columns
      integer, allocatable, intent(out) :: head(:)     !! those of the nodes that are left
      logical :: is_head(size(first)), joins
      real(dp) :: n_zero, n_more, n_row          ! of the node behind, with all joined to it
      integer :: n_column, n, s, last

      is_head = .true.
      last = size(tree%order)
      n_column = 0
      n_row = 0.0_dp
      n_zero = 0.0_dp
      do s = size(first), 1, -1
         n = last - first(s) + 1
         n_more = n*(n_row + n - tree%n_row(first(s)))
         joins = n_column > 0 .and. tree%parent(last) == last + 1
         if (joins) joins = may_join(n_column + n, n_row + n, n_zero + n_more)
         if (joins) then
            is_head(s + 1) = .false.
            n_column = n_column + n
            n_row = n_row + n
            n_zero = n_zero + n_more
         else
            n_column = n
            n_row = tree%n_row(first(s))
            n_zero = 0.0_dp
         end if
         last = first(s) - 1
      end do
      head = pack(first, is_head)
   end subroutine join

   !> May a node have so many columns and rows, and zeros among its entries?
   pure logical function may_join(n_column, n_row, n_zero)
      integer, intent(in) :: n_column
      real(dp), intent(in) :: n_row, n_zero
      real(dp) :: n_entry
      integer :: k

      n_entry = n_column*(n_row - 0.5_dp*(n_column - 1))
      k = findloc(n_column <= n_column_of, .true., dim=1)
      may_join = n_zero <= most_zeros(k)*n_entry
   end function may_join

   !> The node of the first row below each.
   pure subroutine find_parents(self, tree)
      type(partition_t), intent(inout) :: self   !! `first` is set
      type(elimination_tree_t), intent(in) :: tree
      integer :: of(0:size(tree%order)), s

      associate (n_node => size(self%first) - 1)
         of(0) = 0
         do s = 1, n_node
            of(self%first(s) + 1:self%first(s + 1)) = s
         end do
         self%parent = of(tree%parent(self%first(2:)))
      end associate
   end subroutine find_parents

   !> Rows of a node: its columns, and what is below them in the matrix and in the nodes below it.
   pure subroutine find_rows(self, pattern, tree)
      type(partition_t), intent(inout) :: self   !! `first` and `parent` are set
      type(csr_t), intent(in) :: pattern
      type(elimination_tree_t), intent(in) :: tree
      integer :: seen(size(tree%order)), place(size(tree%order)), child(size(self%parent)), &
         next(size(self%parent)), c, k, m, s, u

      call lay_out(self, tree, child, next)
      place(tree%order) = [(k, k = 1, size(place))]
      seen = 0
      do s = 1, size(self%parent)
         m = 0
         associate (row => self%row(self%row_start(s) + 1:self%row_start(s + 1)), &
            least => self%first(s))
            call take([(k, k = least, self%first(s + 1) - 1)], s, least, seen, row, m)
            do k = least + 1, self%first(s + 1)
               u = tree%order(k)
               call take(place(pattern%column(pattern%row_start(u) + 1:pattern%row_start(u + 1)) &
                  + 1) - 1, s, least, seen, row, m)
            end do
            c = child(s)
            do while (c > 0)
               call take(self%row(self%row_start(c) + 1:self%row_start(c + 1)), s, least, seen, &
                  row, m)
               c = next(c)
            end do
            call sort(row(self%first(s + 1) - least + 1:))
         end associate
      end do
   end subroutine find_rows

   !> Room for the rows: below a node are those of its last column. Nodes below it: `child` is the
   !> first one, `next` the one beside it.
   pure subroutine lay_out(self, tree, child, next)
      type(partition_t), intent(inout) :: self   !! `first` and `parent` are set
      type(elimination_tree_t), intent(in) :: tree
      integer, intent(out) :: child(:), next(:)  !! (n_node)
      integer :: s

      allocate(self%row_start(size(child) + 1), source=0)
      child = 0
      next = 0
      do s = 1, size(child)
         self%row_start(s + 1) = self%row_start(s) + self%first(s + 1) - self%first(s) &
            + tree%n_row(self%first(s + 1)) - 1
         if (self%parent(s) == 0) cycle
         next(s) = child(self%parent(s))
         child(self%parent(s)) = s
      end do
      allocate(self%row(self%row_start(size(child) + 1)), source=0)
   end subroutine lay_out

   !> Put those of `list` into `row` that node `s` has not seen yet.
   pure subroutine take(list, s, least, seen, row, m)
      integer, intent(in) :: list(:)             !! from 0
      integer, intent(in) :: s
      integer, intent(in) :: least               !! those before it are no rows of the node
      integer, intent(inout) :: seen(:)          !! (n) node that has seen a row last
      integer, intent(inout) :: row(:)
      integer, intent(inout) :: m                !! entries of `row`
      integer :: k

      do k = 1, size(list)
         if (list(k) < least) cycle
         if (seen(list(k) + 1) == s) cycle
         seen(list(k) + 1) = s
         m = m + 1
         row(m) = list(k)
      end do
   end subroutine take

   pure subroutine sort(list)
      integer, intent(inout) :: list(:)
      integer, parameter :: few = 32

      if (size(list) <= few) then
         call sort_few(list)
      else
         list = list(sort_order(list))
      end if
   end subroutine sort

end module emcon_supernode_search
