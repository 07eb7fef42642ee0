!> Gaussian elimination of sparse rows in their order: which of them are independent, and which
!> unknown each can give.
!>
!> Two rows of one pattern are eliminated at once and with the same pivots, for constraints that
!> have a gradient for the forces and another one for the motion; rows of which there is only one
!> come twice. A row of which nothing but round-off is left depends on rows before it, one of which
!> little is left nearly so: neither is kept. Columns past `n_free` never give a pivot.
!> Source: docs/theory.md, section 5.
module emcon_row_elimination
   use emcon_kinds, only : dp, hp, wp
   implicit none
   private
   public :: row_elimination_t, elimination_begin, elimination_add, elimination_left
   public :: elimination_entries, elimination_resolve, n_kind
   public :: row_kept, row_redundant, row_poor, row_near

   !> Rows eliminated at once: those of forces, those of the motion.
   integer, parameter :: n_kind = 2

   !> What became of a row. Poor: no unknown is fit to be a pivot of both; near: it says nearly what
   !> rows before it say.
   integer, parameter :: row_kept = 1, row_redundant = 2, row_poor = 3, row_near = 4

   !> What is left of a row is round-off below this multiple of the largest term that entered it.
   real(hp), parameter :: redundancy_tol = 512.0_hp &
      *max(real(epsilon(1.0_dp), hp), real(epsilon(1.0_wp), hp))
   !> Unknowns that are not a row's own count by this factor.
   real(hp), parameter :: other = 0.1_hp
   !> A later entry is taken only if it is larger by this factor: entries that are equal by the
   !> symmetry of a scene are not told apart by their round-off.
   real(hp), parameter :: clearly_larger = 1.1_hp
   !> A pivot is poor if, relative to what is left of its row, it counts less than this.
   real(hp), parameter :: poor_pivot = 0.01_hp

   type :: row_elimination_t
      integer :: n_free = 0                      !! columns that may give a pivot
      !> A row of which less than this part of the largest term is left is `row_near`.
      real(hp) :: nearness = 0.0_hp
      integer :: n_row = 0                       !! rows added so far
      integer, allocatable :: pivot(:)           !! (rows) column of the pivot; 0: redundant
      ! The present row, over all columns, both of its kinds:
      real(hp), allocatable, private :: work(:, :)     !! (n_kind, n_col), 0 outside of the row
      logical, allocatable, private :: is_listed(:)    !! (n_col)
      integer, allocatable, private :: list(:)         !! (n_col) its columns
      integer, private :: n_list = 0
      !> (rows) earlier rows whose pivots it has, the first one on top: each is before those that
      !> stand at twice its place and behind that
      integer, allocatable, private :: heap(:)
      integer, private :: n_heap = 0
      real(hp), private :: largest_term(n_kind) = 0.0_hp   !! that entered the row
      ! The eliminated rows without their pivots:
      integer, allocatable, private :: pivot_row(:)    !! (n_col) row of the pivot; 0: none
      integer, allocatable, private :: row_start(:)    !! (rows + 1)
      integer, allocatable, private :: column(:)
      real(hp), allocatable, private :: value(:, :)    !! (n_kind, entries)
      real(hp), allocatable, private :: pivot_value(:, :)   !! (n_kind, rows)
   end type row_elimination_t

   !> Pivots as sums over other columns, one sum behind the other as they are found.
   type :: sums_t
      integer :: n = 0                           !! terms so far
      integer, allocatable :: first(:), last(:)  !! (rows) terms of each sum
      integer, allocatable :: column(:)          !! (>= n)
      real(hp), allocatable :: weight(:)         !! (>= n)
   end type sums_t

contains

   !> Nothing eliminated yet; room for `n_row` rows over `n_col` columns, kept where it fits.
   subroutine elimination_begin(self, n_row, n_col, n_free)
      type(row_elimination_t), intent(inout) :: self
      integer, intent(in) :: n_row, n_col
      integer, intent(in) :: n_free              !! the first ones may give pivots
      integer :: k

      if (allocated(self%list)) then
         call clear(self)
         if (size(self%list) /= n_col) deallocate(self%work, self%is_listed, self%list, &
            self%pivot_row, self%column, self%value)
      end if
      if (.not. allocated(self%list)) then
         allocate(self%work(n_kind, n_col), source=0.0_hp)
         allocate(self%is_listed(n_col), source=.false.)
         allocate(self%list(n_col), self%pivot_row(n_col), source=0)
         allocate(self%column(0), self%value(n_kind, 0))
      end if
      if (allocated(self%pivot)) then
         do k = 1, self%n_row
            if (self%pivot(k) > 0 .and. self%pivot(k) <= n_col) self%pivot_row(self%pivot(k)) = 0
         end do
         if (size(self%pivot) /= n_row) deallocate(self%pivot, self%row_start, &
            self%pivot_value, self%heap)
      end if
      if (.not. allocated(self%pivot)) allocate(self%pivot(n_row), self%row_start(n_row + 1), &
         self%pivot_value(n_kind, n_row), self%heap(n_row))
      self%n_free = n_free
      self%n_row = 0
      self%pivot = 0
      self%row_start = 0
   end subroutine elimination_begin

   !> Eliminate the earlier rows from a new one and choose its pivot. A row without a fit pivot is
   !> not kept.
   subroutine elimination_add(self, column, first, second, own, fate, made_of)
      type(row_elimination_t), intent(inout) :: self
      integer, intent(in) :: column(:)                  !! (entries) from 1
      real(hp), intent(in) :: first(:), second(:)       !! (entries) both kinds of the row
      integer, intent(in) :: own(:)                     !! columns to take with preference
      integer, intent(out) :: fate                      !! one of `row_`
      real(hp), intent(in), optional :: made_of(n_kind) !! largest terms that the entries sum up
      real(hp) :: left(n_kind), largest(n_kind)
      integer :: k

      k = self%n_row + 1
      self%n_row = k
      call clear(self)
      call scatter(self, column, first, second)
      call reduce(self)
      left = largest_left(self)
      self%row_start(k + 1) = self%row_start(k)
      largest = self%largest_term
      if (present(made_of)) largest = max(largest, made_of)
      if (any(left <= redundancy_tol*largest)) then
         fate = row_redundant
         return
      end if
      if (any(left <= self%nearness*self%largest_term)) then
         fate = row_near
         return
      end if
      call choose(self, k, own, left, fate)
      if (fate == row_kept) call keep(self, k)
   end subroutine elimination_add

   !> Entries of the rows that are kept, without their pivots.
   pure integer function elimination_entries(self)
      type(row_elimination_t), intent(in) :: self

      elimination_entries = self%row_start(self%n_row + 1)
   end function elimination_entries

   !> What the last row, a redundant one, holds past the columns `n_free` but for round-off.
   pure subroutine elimination_left(self, column, value)
      type(row_elimination_t), intent(in) :: self
      integer, allocatable, intent(out) :: column(:)
      real(hp), allocatable, intent(out) :: value(:)

      column = pack(self%list(:self%n_list), self%list(:self%n_list) > self%n_free)
      column = pack(column, abs(self%work(2, column)) > redundancy_tol*self%largest_term(2))
      value = self%work(2, column)
   end subroutine elimination_left

   !> Take the present row off the work space.
   pure subroutine clear(self)
      type(row_elimination_t), intent(inout) :: self

      self%work(:, self%list(:self%n_list)) = 0.0_hp
      self%is_listed(self%list(:self%n_list)) = .false.
      self%n_list = 0
      self%n_heap = 0
      self%largest_term = 0.0_hp
   end subroutine clear

   !> Spread out a row.
   pure subroutine scatter(self, column, first, second)
      type(row_elimination_t), intent(inout) :: self
      integer, intent(in) :: column(:)
      real(hp), intent(in) :: first(:), second(:)
      integer :: s, j

      do s = 1, size(column)
         j = column(s)
         call enlist(self, j)
         self%work(:, j) = self%work(:, j) + [first(s), second(s)]
         self%largest_term = max(self%largest_term, abs(self%work(:, j)))
      end do
   end subroutine scatter

   !> The present row has the column `j`: the row of which that is the pivot is to be eliminated.
   pure subroutine enlist(self, j)
      type(row_elimination_t), intent(inout) :: self
      integer, intent(in) :: j
      integer :: i

      if (self%is_listed(j)) return
      self%is_listed(j) = .true.
      self%n_list = self%n_list + 1
      self%list(self%n_list) = j
      if (self%pivot_row(j) == 0) return
      self%n_heap = self%n_heap + 1
      i = self%n_heap
      do while (i > 1)
         if (self%heap(i/2) < self%pivot_row(j)) exit
         self%heap(i) = self%heap(i/2)
         i = i/2
      end do
      self%heap(i) = self%pivot_row(j)
   end subroutine enlist

   !> Take the first of the rows that are to be eliminated.
   pure subroutine take_first(self, first)
      type(row_elimination_t), intent(inout) :: self   !! there is one
      integer, intent(out) :: first
      integer :: i, k

      associate (heap => self%heap, n => self%n_heap)
         first = heap(1)
         i = 1
         do
            k = 2*i
            if (k >= n) exit
            if (k + 1 < n .and. heap(k + 1) < heap(k)) k = k + 1
            if (heap(n) < heap(k)) exit
            heap(i) = heap(k)
            i = k
         end do
         heap(i) = heap(n)
         n = n - 1
      end associate
   end subroutine take_first

   !> Eliminate earlier rows from the present one, in their order: what one leaves is of later ones.
   pure subroutine reduce(self)
      type(row_elimination_t), intent(inout) :: self
      real(hp) :: factor(n_kind), term(n_kind)
      integer :: i, j, s

      do while (self%n_heap > 0)
         call take_first(self, i)
         j = self%pivot(i)
         factor = self%work(:, j)/self%pivot_value(:, i)
         self%work(:, j) = 0.0_hp
         do s = self%row_start(i) + 1, self%row_start(i + 1)
            call enlist(self, self%column(s))
            term = factor*self%value(:, s)
            self%work(:, self%column(s)) = self%work(:, self%column(s)) - term
            self%largest_term = max(self%largest_term, abs(term))
         end do
      end do
   end subroutine reduce

   !> Largest entries of the present row that may become a pivot.
   pure function largest_left(self) result(left)
      type(row_elimination_t), intent(in) :: self
      real(hp) :: left(n_kind)
      integer :: s

      left = 0.0_hp
      do s = 1, self%n_list
         if (self%list(s) <= self%n_free) left = max(left, abs(self%work(:, self%list(s))))
      end do
   end function largest_left

   !> The unknown with the largest entry: of the two rows the smaller one counts, each relative to
   !> the largest left in it.
   pure subroutine choose(self, k, own, left, fate)
      type(row_elimination_t), intent(inout) :: self
      integer, intent(in) :: k
      integer, intent(in) :: own(:)
      real(hp), intent(in) :: left(:)                   !! (n_kind) largest entries, > 0
      integer, intent(out) :: fate
      real(hp) :: weight, best
      integer :: s, j

      best = -1.0_hp
      do s = 1, self%n_list
         j = self%list(s)
         if (j > self%n_free) cycle
         weight = minval(abs(self%work(:, j))/left)
         if (all(own /= j)) weight = other*weight
         if (weight <= clearly_larger*best) cycle
         best = weight
         self%pivot(k) = j
      end do
      fate = row_kept
      if (best > poor_pivot) return
      fate = row_poor
      self%pivot(k) = 0
   end subroutine choose

   !> Store the present row, less its pivot and less round-off, for later rows.
   subroutine keep(self, k)
      type(row_elimination_t), intent(inout) :: self
      integer, intent(in) :: k
      integer :: s, j, n

      n = self%row_start(k)
      call make_room(self, n + self%n_list)
      self%pivot_value(:, k) = self%work(:, self%pivot(k))
      self%pivot_row(self%pivot(k)) = k
      do s = 1, self%n_list
         j = self%list(s)
         if (j == self%pivot(k)) cycle
         if (all(abs(self%work(:, j)) <= epsilon(1.0_hp)*self%largest_term)) cycle
         n = n + 1
         self%column(n) = j
         self%value(:, n) = self%work(:, j)
      end do
      self%row_start(k + 1) = n
   end subroutine keep

   !> At least `n` entries; what is there stays.
   subroutine make_room(self, n)
      type(row_elimination_t), intent(inout) :: self
      integer, intent(in) :: n
      integer, allocatable :: column(:)
      real(hp), allocatable :: value(:, :)
      integer :: n_old

      n_old = size(self%column)
      if (n <= n_old) return
      allocate(column(2*n), value(n_kind, 2*n))
      column(:n_old) = self%column
      value(:, :n_old) = self%value
      call move_alloc(column, self%column)
      call move_alloc(value, self%value)
   end subroutine make_room

   !> Each pivot as a sum over the columns that are no pivots: x(pivot(k)) = sum of weight(s)
   !> x(column(s)), s = start(k) + 1 to start(k + 1). From the rows of the second kind; rows that
   !> were not kept have no terms.
   subroutine elimination_resolve(self, start, column, weight)
      type(row_elimination_t), intent(inout) :: self
      integer, allocatable, intent(out) :: start(:)     !! (rows + 1) from 0
      integer, allocatable, intent(out) :: column(:)    !! ascending in each row
      real(hp), allocatable, intent(out) :: weight(:)
      type(sums_t) :: sums
      integer :: k, s

      call begin_sums(sums, self%n_row, size(self%column))
      ! Later rows first: what earlier rows need of them is there already.
      do k = self%n_row, 1, -1
         call clear(self)
         if (self%pivot(k) > 0) then
            do s = self%row_start(k) + 1, self%row_start(k + 1)
               call substitute(self, sums, self%column(s), &
                  -self%value(2, s)/self%pivot_value(2, k))
            end do
         end if
         call append_sum(self, sums, k)
      end do
      call clear(self)
      call ascending_sums(sums, start, column, weight)
   end subroutine elimination_resolve

   !> Add `factor` times column `j` to the present row, or times the sum that `j` is.
   pure subroutine substitute(self, sums, j, factor)
      type(row_elimination_t), intent(inout) :: self
      type(sums_t), intent(in) :: sums
      integer, intent(in) :: j
      real(hp), intent(in) :: factor
      integer :: t, i

      i = self%pivot_row(j)
      if (i == 0) then
         call enlist(self, j)
         self%work(2, j) = self%work(2, j) + factor
         return
      end if
      do t = sums%first(i), sums%last(i)
         call enlist(self, sums%column(t))
         self%work(2, sums%column(t)) = self%work(2, sums%column(t)) + factor*sums%weight(t)
      end do
   end subroutine substitute

   pure subroutine begin_sums(sums, n_row, n_term)
      type(sums_t), intent(out) :: sums
      integer, intent(in) :: n_row, n_term       !! n_term: room to begin with

      allocate(sums%first(n_row), sums%last(n_row), source=0)
      allocate(sums%column(n_term), sums%weight(n_term))
   end subroutine begin_sums

   !> The present row is sum `k`, its columns ascending; what cancelled is left out.
   pure subroutine append_sum(self, sums, k)
      type(row_elimination_t), intent(in) :: self
      type(sums_t), intent(inout) :: sums
      integer, intent(in) :: k
      integer :: t, place
      real(hp) :: largest

      sums%first(k) = sums%n + 1
      if (sums%n + self%n_list > size(sums%column)) call enlarge(sums, 2*(sums%n + self%n_list))
      largest = maxval([0.0_hp, abs(self%work(2, self%list(:self%n_list)))])
      do t = 1, self%n_list
         associate (j => self%list(t), column => sums%column, weight => sums%weight)
            if (abs(self%work(2, j)) <= 4.0_hp*epsilon(1.0_hp)*largest) cycle
            sums%n = sums%n + 1
            place = sums%n
            do while (place > sums%first(k))
               if (column(place - 1) < j) exit
               column(place) = column(place - 1)
               weight(place) = weight(place - 1)
               place = place - 1
            end do
            column(place) = j
            weight(place) = self%work(2, j)
         end associate
      end do
      sums%last(k) = sums%n
   end subroutine append_sum

   pure subroutine enlarge(sums, n)
      type(sums_t), intent(inout) :: sums
      integer, intent(in) :: n
      integer, allocatable :: column(:)
      real(hp), allocatable :: weight(:)

      allocate(column(n), weight(n))
      column(:size(sums%column)) = sums%column
      weight(:size(sums%weight)) = sums%weight
      call move_alloc(column, sums%column)
      call move_alloc(weight, sums%weight)
   end subroutine enlarge

   !> The sums in the order of their rows.
   pure subroutine ascending_sums(sums, start, column, weight)
      type(sums_t), intent(in) :: sums
      integer, allocatable, intent(out) :: start(:), column(:)
      real(hp), allocatable, intent(out) :: weight(:)
      integer :: i

      allocate(start(size(sums%first) + 1), source=0)
      allocate(column(sums%n), weight(sums%n))
      do i = 1, size(sums%first)
         associate (from => sums%first(i), last => sums%last(i), to => start(i + 1))
            to = start(i) + last - from + 1
            column(start(i) + 1:to) = sums%column(from:last)
            weight(start(i) + 1:to) = sums%weight(from:last)
         end associate
      end do
   end subroutine ascending_sums

end module emcon_row_elimination
