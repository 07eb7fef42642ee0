!> Which constraints are independent, and for each an unknown that can be eliminated with it.
!>
!> Gaussian elimination of the constraint rows in their order, of the discrete gradients and of the
!> gradients at the end at once and with the same pivots. A row of which nothing but round-off is
!> left depends on rows before it. What comes out depends on the present gradients only, not on
!> earlier choices. Source: docs/theory.md, section 5.
module emcon_independent_rows
   use emcon_constraints, only : constraint_set_t
   use emcon_csr, only : csr_t
   use emcon_kinds, only : dp
   use emcon_numbering, only : numbering_t
   implicit none
   private
   public :: independent_rows_t, independent_rows_find

   !> What is left of a row is round-off below this multiple of the largest term that entered it.
   real(dp), parameter :: redundancy_tol = 512.0_dp*epsilon(1.0_dp)
   !> Unknowns of other nodes than the slave node count by this factor.
   real(dp), parameter :: other_node = 0.1_dp
   !> A later entry is taken only if it is larger by this factor: entries that are equal by the
   !> symmetry of a scene are not told apart by their round-off.
   real(dp), parameter :: clearly_larger = 1.1_dp
   !> The choice is poor if a pivot, relative to what is left of its row, counts less than this.
   real(dp), parameter :: poor_pivot = 0.01_dp

   type :: independent_rows_t
      integer :: n_redundant = 0
      integer, allocatable :: redundant(:)       !! (n) the first n_redundant: rows to be dropped
      integer, allocatable :: dependent(:)       !! (n) unknown to eliminate; 0: redundant
      logical :: is_poor = .false.               !! some row has no good pivot in both gradients
      ! Work space. The present row, over all unknowns, force row and gap row:
      real(dp), allocatable, private :: work(:, :)     !! (2, n_unknown), 0 outside of the row
      logical, allocatable, private :: is_listed(:)    !! (n_unknown)
      integer, allocatable, private :: list(:)         !! (n_unknown) its columns
      integer, private :: n_list = 0
      real(dp), private :: largest_term(2) = 0.0_dp    !! that entered the row
      ! The eliminated rows without their pivots:
      integer, allocatable, private :: pivot_row(:)    !! (n_unknown) row of the pivot; 0: none
      integer, allocatable, private :: row_start(:)    !! (n + 1)
      integer, allocatable, private :: column(:)
      real(dp), allocatable, private :: value(:, :)    !! (2, entries)
      real(dp), allocatable, private :: pivot(:, :)    !! (2, n)
   end type independent_rows_t

contains

   !> Find the redundant constraints of `set` and the unknowns to eliminate, for its present rows.
   subroutine independent_rows_find(self, set, numbering)
      type(independent_rows_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      type(numbering_t), intent(in) :: numbering
      integer :: own(2, set%n), k

      do k = 1, set%n
         own(:, k) = numbering%unknown(:, set%item(k)%node(1))
      end do
      call eliminate(self, set%force_rows, set%gap_rows, own)
      ! Where no unknown serves both, only the forces tell what is redundant.
      if (.not. self%is_poor) return
      call eliminate(self, set%force_rows, set%force_rows, own)
      self%is_poor = .true.
   end subroutine independent_rows_find

   !> Eliminate all rows of `force` and `gap`, two matrices of one pattern, or those before the
   !> first without a good pivot.
   subroutine eliminate(self, force, gap, own)
      type(independent_rows_t), intent(inout) :: self
      type(csr_t), intent(in) :: force, gap
      integer, intent(in) :: own(:, :)               !! (2, n) unknowns of the slave nodes
      real(dp) :: left(2)
      integer :: k, first

      call reset(self, force)
      do k = 1, force%n_row
         call scatter(self, force, gap, k, first)
         call reduce(self, first, k - 1)
         left = largest_left(self)
         self%row_start(k + 1) = self%row_start(k)
         if (any(left <= redundancy_tol*self%largest_term)) then
            self%n_redundant = self%n_redundant + 1
            self%redundant(self%n_redundant) = k
         else
            call choose(self, k, own(:, k), left)
            if (.not. self%is_poor) call keep(self, k)
         end if
         self%work(:, self%list(:self%n_list)) = 0.0_dp
         self%is_listed(self%list(:self%n_list)) = .false.
         if (self%is_poor) exit
      end do
      do k = 1, force%n_row
         if (self%dependent(k) > 0) self%pivot_row(self%dependent(k)) = 0
      end do
   end subroutine eliminate

   !> Empty results; work space for matrices of this size, made anew where it has changed.
   subroutine reset(self, rows)
      type(independent_rows_t), intent(inout) :: self
      type(csr_t), intent(in) :: rows

      if (allocated(self%list)) then
         if (size(self%list) /= rows%n_col) deallocate(self%work, self%is_listed, self%list, &
            self%pivot_row, self%column, self%value)
      end if
      if (.not. allocated(self%list)) then
         allocate(self%work(2, rows%n_col), source=0.0_dp)
         allocate(self%is_listed(rows%n_col), source=.false.)
         allocate(self%list(rows%n_col), self%pivot_row(rows%n_col), source=0)
         allocate(self%column(0), self%value(2, 0))
      end if
      if (allocated(self%dependent)) then
         if (size(self%dependent) /= rows%n_row) deallocate(self%dependent, self%redundant, &
            self%row_start, self%pivot)
      end if
      if (.not. allocated(self%dependent)) allocate(self%dependent(rows%n_row), &
         self%redundant(rows%n_row), self%row_start(rows%n_row + 1), self%pivot(2, rows%n_row))
      self%n_redundant = 0
      self%redundant = 0
      self%dependent = 0
      self%row_start = 0
      self%is_poor = .false.
   end subroutine reset

   !> Spread out row `k`; `first` is the first row that has to be eliminated from it.
   pure subroutine scatter(self, force, gap, k, first)
      type(independent_rows_t), intent(inout) :: self
      type(csr_t), intent(in) :: force, gap
      integer, intent(in) :: k
      integer, intent(out) :: first                  !! k if there is none
      integer :: s, j

      first = k
      self%n_list = 0
      self%largest_term = 0.0_dp
      do s = force%row_start(k) + 1, force%row_start(k + 1)
         j = force%column(s) + 1
         call enlist(self, j)
         self%work(:, j) = [force%value(s), gap%value(s)]
         self%largest_term = max(self%largest_term, abs(self%work(:, j)))
         if (self%pivot_row(j) > 0) first = min(first, self%pivot_row(j))
      end do
   end subroutine scatter

   pure subroutine enlist(self, j)
      type(independent_rows_t), intent(inout) :: self
      integer, intent(in) :: j

      if (self%is_listed(j)) return
      self%is_listed(j) = .true.
      self%n_list = self%n_list + 1
      self%list(self%n_list) = j
   end subroutine enlist

   !> Eliminate the rows `first` to `last` from the present one.
   pure subroutine reduce(self, first, last)
      type(independent_rows_t), intent(inout) :: self
      integer, intent(in) :: first, last
      real(dp) :: factor(2), term(2)
      integer :: i, j, s

      do i = first, last
         j = self%dependent(i)
         if (j == 0) cycle
         if (.not. self%is_listed(j)) cycle
         factor = self%work(:, j)/self%pivot(:, i)
         self%work(:, j) = 0.0_dp
         do s = self%row_start(i) + 1, self%row_start(i + 1)
            call enlist(self, self%column(s))
            term = factor*self%value(:, s)
            self%work(:, self%column(s)) = self%work(:, self%column(s)) - term
            self%largest_term = max(self%largest_term, abs(term))
         end do
      end do
   end subroutine reduce

   !> Largest entries of the present row.
   pure function largest_left(self) result(left)
      type(independent_rows_t), intent(in) :: self
      real(dp) :: left(2)
      integer :: s

      left = 0.0_dp
      do s = 1, self%n_list
         left = max(left, abs(self%work(:, self%list(s))))
      end do
   end function largest_left

   !> The unknown with the largest entry: of the two rows the smaller one counts, each relative to
   !> the largest left in it.
   pure subroutine choose(self, k, own, left)
      type(independent_rows_t), intent(inout) :: self
      integer, intent(in) :: k
      integer, intent(in) :: own(:)                  !! (2) 0: prescribed
      real(dp), intent(in) :: left(:)                !! (2) largest entries, > 0
      real(dp) :: weight, best
      integer :: s, j

      best = -1.0_dp
      do s = 1, self%n_list
         j = self%list(s)
         weight = minval(abs(self%work(:, j))/left)
         if (all(own /= j)) weight = other_node*weight
         if (weight <= clearly_larger*best) cycle
         best = weight
         self%dependent(k) = j
      end do
      self%is_poor = best <= poor_pivot
   end subroutine choose

   !> Store the present row, less its pivot and less round-off, for later rows.
   subroutine keep(self, k)
      type(independent_rows_t), intent(inout) :: self
      integer, intent(in) :: k
      integer :: s, j, n

      n = self%row_start(k)
      call make_room(self, n + self%n_list)
      self%pivot(:, k) = self%work(:, self%dependent(k))
      self%pivot_row(self%dependent(k)) = k
      do s = 1, self%n_list
         j = self%list(s)
         if (j == self%dependent(k)) cycle
         if (all(abs(self%work(:, j)) <= epsilon(1.0_dp)*self%largest_term)) cycle
         n = n + 1
         self%column(n) = j
         self%value(:, n) = self%work(:, j)
      end do
      self%row_start(k + 1) = n
   end subroutine keep

   !> At least `n` entries; what is there stays.
   subroutine make_room(self, n)
      type(independent_rows_t), intent(inout) :: self
      integer, intent(in) :: n
      integer, allocatable :: column(:)
      real(dp), allocatable :: value(:, :)
      integer :: n_old

      n_old = size(self%column)
      if (n <= n_old) return
      allocate(column(2*n), value(2, 2*n))
      column(:n_old) = self%column
      value(:, :n_old) = self%value
      call move_alloc(column, self%column)
      call move_alloc(value, self%value)
   end subroutine make_room

end module emcon_independent_rows
