!> The elimination tree of a symmetric pattern: which columns of its Cholesky factor wait for which,
!> and how many rows each has, without the rows themselves.
!>
!> Columns stand in postorder: those below one stand right before it, the branch with the longest
!> columns last. Sources: J. W. H. Liu, SIAM J. Matrix Anal. Appl. 11 (1990) 134-172; numbers of
!> rows: J. R. Gilbert, E. G. Ng, B. W. Peyton, SIAM J. Matrix Anal. Appl. 15 (1994) 1075-1091.
module emcon_elimination_tree
   use emcon_csr, only : csr_t
   use emcon_kinds, only : dp
   use emcon_sort, only : sort_order
   implicit none
   private
   public :: elimination_tree_t, tree_build

   type :: elimination_tree_t
      integer, allocatable :: order(:)           !! (n) unknown of each column, from 1
      integer, allocatable :: parent(:)          !! (n) > the column; 0: it is a root
      integer, allocatable :: n_row(:)           !! (n) rows of each column of the factor, >= 1
      real(dp) :: n_entry = 0.0_dp               !! of the factor
      real(dp) :: n_operation = 0.0_dp           !! of a factorisation
   end type elimination_tree_t

contains

   !> The tree of a pattern whose unknowns are eliminated in `order`, which is changed where that
   !> changes nothing but places.
   pure subroutine tree_build(self, pattern, order)
      type(elimination_tree_t), intent(out) :: self
      type(csr_t), intent(in) :: pattern         !! symmetric; its values are not read
      integer, intent(in) :: order(:)            !! (n) unknown of each column, from 1

      self%order = order
      call find_parents(self, pattern)
      allocate(self%n_row(size(order)), source=1)
      call stand_in_postorder(self)
      call count_rows(self, pattern)
      call stand_in_postorder(self)
      self%n_entry = sum(real(self%n_row, dp))
      self%n_operation = sum(real(self%n_row, dp)**2)
   end subroutine tree_build

   !> `parent`: the first row below the diagonal.
   pure subroutine find_parents(self, pattern)
      type(elimination_tree_t), intent(inout) :: self
      type(csr_t), intent(in) :: pattern
      integer, allocatable :: ancestor(:), place(:)
      integer :: i, j, k, next

      call places_of(self%order, place)
      allocate(self%parent(size(place)), ancestor(size(place)), source=0)
      do j = 1, size(place)
         do k = pattern%row_start(self%order(j)) + 1, pattern%row_start(self%order(j) + 1)
            i = place(pattern%column(k) + 1)
            do while (i > 0 .and. i < j)
               next = ancestor(i)                ! as far up as is known: ways get short
               ancestor(i) = j
               if (next == 0) self%parent(i) = j
               i = next
            end do
         end do
      end do
   end subroutine find_parents

   !> The place of each unknown in an order.
   pure subroutine places_of(order, place)
      integer, intent(in) :: order(:)
      integer, allocatable, intent(out) :: place(:)
      integer :: k

      allocate(place(size(order)))
      do k = 1, size(order)
         place(order(k)) = k
      end do
   end subroutine places_of

   !> Number the columns anew: each behind all below it, branches with longer columns later.
   pure subroutine stand_in_postorder(self)
      type(elimination_tree_t), intent(inout) :: self
      integer, dimension(0:size(self%order)) :: child, next, to
      integer :: by_length(size(self%order)), j, k, n

      child = 0
      next = 0
      by_length = sort_order(self%n_row)
      do k = size(by_length), 1, -1
         j = by_length(k)
         next(j) = child(self%parent(j))
         child(self%parent(j)) = j
      end do
      n = 0
      to = 0
      j = child(0)
      do while (j > 0)
         do while (child(j) > 0)
            j = child(j)
         end do
         n = n + 1
         to(j) = n
         do while (next(j) == 0 .and. self%parent(j) > 0)
            j = self%parent(j)
            n = n + 1
            to(j) = n
         end do
         j = next(j)
      end do
      call renumber(self, to)
   end subroutine stand_in_postorder

   !> Column j becomes column to(j).
   pure subroutine renumber(self, to)
      type(elimination_tree_t), intent(inout) :: self
      integer, intent(in) :: to(0:)              !! (0:n) 0 stays
      integer, dimension(size(self%order)) :: order, parent, n_row
      integer :: j

      do j = 1, size(self%order)
         order(to(j)) = self%order(j)
         parent(to(j)) = to(self%parent(j))
         n_row(to(j)) = self%n_row(j)
      end do
      self%order = order
      self%parent = parent
      self%n_row = n_row
   end subroutine renumber

   !> `n_row`, for columns in postorder. The row i of the factor has entries on the ways from the
   !> columns of its entries in the matrix up to i. Of these entries some are leaves of the tree
   !> that these ways make: one more for each leaf, one less where two ways meet, counts each
   !> column once.
   pure subroutine count_rows(self, pattern)
      type(elimination_tree_t), intent(inout) :: self
      type(csr_t), intent(in) :: pattern
      integer, dimension(size(self%order)) :: first, last_first, last_leaf, ancestor
      integer, allocatable :: place(:)
      integer :: i, j, k, meeting, n

      n = size(self%order)
      call places_of(self%order, place)
      call find_first(self%parent, first)
      self%n_row = merge(1, 0, first == [(j, j = 1, n)])
      last_first = 0
      last_leaf = 0
      ancestor = [(j, j = 1, n)]
      do j = 1, n
         associate (p => self%parent(j), u => self%order(j))
            if (p > 0) self%n_row(p) = self%n_row(p) - 1
            do k = pattern%row_start(u) + 1, pattern%row_start(u + 1)
               i = place(pattern%column(k) + 1)
               if (i <= j .or. first(j) <= last_first(i)) cycle
               self%n_row(j) = self%n_row(j) + 1
               last_first(i) = first(j)
               if (last_leaf(i) > 0) then
                  call find_meeting(ancestor, last_leaf(i), meeting)
                  self%n_row(meeting) = self%n_row(meeting) - 1
               end if
               last_leaf(i) = j
            end do
            if (p > 0) ancestor(j) = p
         end associate
      end do
      do j = 1, n
         associate (p => self%parent(j))
            if (p > 0) self%n_row(p) = self%n_row(p) + self%n_row(j)
         end associate
      end do
   end subroutine count_rows

   !> The first column below each, or itself.
   pure subroutine find_first(parent, first)
      integer, intent(in) :: parent(:)           !! (n)
      integer, intent(out) :: first(:)           !! (n)
      integer :: j

      first = [(j, j = 1, size(parent))]
      do j = 1, size(parent)
         if (parent(j) > 0) first(parent(j)) = min(first(parent(j)), first(j))
      end do
   end subroutine find_first

   !> The highest ancestor of `j` so far; those on the way are led there at once.
   pure subroutine find_meeting(ancestor, j, meeting)
      integer, intent(inout) :: ancestor(:)
      integer, intent(in) :: j
      integer, intent(out) :: meeting
      integer :: i, next

      meeting = j
      do while (ancestor(meeting) /= meeting)
         meeting = ancestor(meeting)
      end do
      i = j
      do while (i /= meeting)
         next = ancestor(i)
         ancestor(i) = meeting
         i = next
      end do
   end subroutine find_meeting

end module emcon_elimination_tree
