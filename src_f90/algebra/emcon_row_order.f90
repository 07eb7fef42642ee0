!> An order of sparse rows in which elimination fills them little.
!>
!> Rows that share columns are walked through breadth first from an end, which makes a band of them
!> (as Cuthill and McKee do). Some rows in the middle of the band keep its halves apart: they come
!> last, and each half is ordered likewise (nested dissection). A row then takes up what rows
!> between two such cuts hold, not all that came before it. Source: docs/theory.md, section 5.
module emcon_row_order
   use emcon_csr, only : csr_copy_filled, csr_t, csr_transpose
   implicit none
   private
   public :: row_order_nested

   !> So few rows are left in their order.
   integer, parameter :: few_rows = 16

   !> Rows as they are walked through, component after component.
   type :: walk_t
      integer, allocatable :: row(:)             !! (n_row) in this order
      logical, allocatable :: has_row(:)         !! (n_row)
      logical, allocatable :: has_column(:)      !! (n_col)
   end type walk_t

contains

   !> The rows in the order in which to eliminate them.
   pure subroutine row_order_nested(rows, order)
      type(csr_t), intent(in) :: rows            !! only the pattern counts
      integer, intent(out) :: order(:)           !! (n_row)
      type(walk_t) :: walk
      type(csr_t) :: filled, users
      integer, allocatable :: from(:), reach(:)
      integer :: before, to, i, k

      call csr_copy_filled(rows, filled)
      call csr_transpose(filled, users, from)
      allocate(walk%row(rows%n_row), source=0)
      allocate(walk%has_row(rows%n_row), walk%has_column(rows%n_col), source=.false.)
      to = 0
      do k = 1, rows%n_row
         if (walk%has_row(k)) cycle
         before = to
         call walk_from(walk, rows, users, k, before, to)
         ! What is reached last lies at an end, what is reached last from there at another.
         do i = 1, 2
            call forget(walk, rows, before, to)
            call walk_from(walk, rows, users, (walk%row(to)), before, to)
         end do
      end do
      call find_reach(walk, rows, users, reach)
      to = 0
      call cut(walk, reach, 1, rows%n_row, order, to)
   end subroutine row_order_nested

   !> List the rows that can be reached from the row `seed`, the nearest first, behind `before`.
   pure subroutine walk_from(self, rows, users, seed, before, to)
      type(walk_t), intent(inout) :: self
      type(csr_t), intent(in) :: rows, users
      integer, intent(in) :: seed, before
      integer, intent(out) :: to                 !! place of the last one
      integer :: i, j, l, s, t

      to = before + 1
      self%row(to) = seed
      self%has_row(seed) = .true.
      i = before
      do while (i < to)
         i = i + 1
         do s = rows%row_start(self%row(i)) + 1, rows%row_start(self%row(i) + 1)
            j = rows%column(s) + 1
            if (self%has_column(j)) cycle
            self%has_column(j) = .true.
            do t = users%row_start(j) + 1, users%row_start(j + 1)
               l = users%column(t) + 1
               if (self%has_row(l)) cycle
               self%has_row(l) = .true.
               to = to + 1
               self%row(to) = l
            end do
         end do
      end do
   end subroutine walk_from

   !> Nobody was at the rows behind `before` up to `to`.
   pure subroutine forget(self, rows, before, to)
      type(walk_t), intent(inout) :: self
      type(csr_t), intent(in) :: rows
      integer, intent(in) :: before, to
      integer :: i

      do i = before + 1, to
         associate (k => self%row(i))
            self%has_row(k) = .false.
            self%has_column(rows%column(rows%row_start(k) + 1:rows%row_start(k + 1)) + 1) = .false.
         end associate
      end do
   end subroutine forget

   !> For each place of the walk the last one whose row shares a column with a row up to there.
   pure subroutine find_reach(walk, rows, users, reach)
      type(walk_t), intent(in) :: walk
      type(csr_t), intent(in) :: rows, users
      integer, allocatable, intent(out) :: reach(:)   !! (n_row)
      integer :: last(rows%n_col), place(rows%n_row), i, j, s

      place(walk%row) = [(i, i = 1, rows%n_row)]
      do j = 1, rows%n_col
         last(j) = maxval([0, place(users%column(users%row_start(j) + 1:users%row_start(j + 1)) &
            + 1)])
      end do
      allocate(reach(rows%n_row))
      do i = 1, rows%n_row
         reach(i) = i
         if (i > 1) reach(i) = max(i, reach(i - 1))
         do s = rows%row_start(walk%row(i)) + 1, rows%row_start(walk%row(i) + 1)
            reach(i) = max(reach(i), last(rows%column(s) + 1))
         end do
      end do
   end subroutine find_reach

   !> Append the places `first` to `last`: both halves, then what keeps them apart.
   pure recursive subroutine cut(walk, reach, first, last, order, to)
      type(walk_t), intent(in) :: walk
      integer, intent(in) :: reach(:), first, last
      integer, intent(inout) :: order(:)
      integer, intent(inout) :: to               !! rows in `order` so far
      integer :: middle, after

      middle = first + (last - first)/2
      after = last
      if (last - first >= few_rows) after = min(last, reach(middle))
      if (after < last) then
         call cut(walk, reach, first, middle, order, to)
         call cut(walk, reach, after + 1, last, order, to)
      else
         middle = first - 1
      end if
      order(to + 1:to + after - middle) = walk%row(middle + 1:after)
      to = to + after - middle
   end subroutine cut

end module emcon_row_order
