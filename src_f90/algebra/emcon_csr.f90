!> Sparse matrices by rows (CSR), their patterns, and their products with vectors.
!>
!> The index values are 0-based, as UMFPACK reads them; the arrays themselves start at 1. Row i
!> holds the slots k = row_start(i) + 1, ..., row_start(i + 1), slot k stands in
!> column `column(k) + 1`. Columns ascend in each row and none occurs twice.
module emcon_csr
   use emcon_errors, only : err_analysis, err_internal, error_t, raise
   use emcon_kinds, only : dp, int64, wp
   use emcon_sort, only : find_sorted
   use emcon_text, only : to_text
   implicit none
   private
   public :: csr_t, csr_from_elements, csr_from_entries, csr_from_values, csr_sort_columns
   public :: csr_list_users, csr_find, csr_is_same, csr_is_symmetric, csr_copy_pattern
   public :: csr_copy_filled
   public :: csr_multiply, csr_multiply_transposed, csr_pick_rows, csr_append, csr_transpose

   type :: csr_t
      integer :: n_row = 0
      integer :: n_col = 0
      integer, allocatable :: row_start(:)     !! (n_row + 1) from 0 to the number of slots
      integer, allocatable :: column(:)        !! (n_slot) 0-based
      real(dp), allocatable :: value(:)        !! (n_slot)
   end type csr_t

contains

   !> Square pattern in which all unknowns of an element meet, and where each element entry goes.
   !>
   !> The element matrices follow each other in `slot`, each column by column, so that assembly is
   !> `if (slot(k) > 0) value(slot(k)) = value(slot(k)) + ke(k)` with k counting on.
   subroutine csr_from_elements(self, n, list_start, dof, slot, error)
      type(csr_t), intent(out) :: self                  !! values are zero
      integer, intent(in) :: n                          !! number of unknowns
      integer, intent(in), contiguous :: list_start(:)  !! (n_element + 1) starts in `dof`, from 1
      integer, intent(in), contiguous :: dof(:)         !! unknowns 1..n; <= 0: no unknown
      integer, allocatable, intent(out) :: slot(:)      !! (sum of squares of the list lengths)
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: user_start(:), user(:), pair_start(:)
      integer(int64) :: n_pair
      integer :: e, n_element

      n_element = size(list_start) - 1
      allocate(pair_start(n_element + 1))
      n_pair = 0
      do e = 1, n_element
         pair_start(e) = int(min(n_pair, int(huge(1), int64)))
         n_pair = n_pair + int(list_start(e + 1) - list_start(e), int64)**2
      end do
      if (n_pair > huge(1)) then
         call raise(error, err_analysis, "the element matrices have more than 2^31 - 1 entries")
      else if (any(dof > n)) then
         call raise(error, err_internal, "csr_from_elements: unknown " // to_text(maxval(dof)) &
            // " of " // to_text(n))
      end if
      if (allocated(error)) return
      call csr_list_users(n, list_start, dof, user_start, user)
      call element_pattern(self, n, list_start, dof, user_start, user, error)
      if (allocated(error)) return
      call csr_sort_columns(self)
      allocate(self%value(size(self%column)), source=0.0_dp)
      allocate(slot(n_pair), source=0)
      call map_elements(self, list_start, dof, user_start, user, pair_start, slot)
   end subroutine csr_from_elements

   !> For each unknown i the elements that have it: user(user_start(i) + 1 : user_start(i + 1)).
   pure subroutine csr_list_users(n, list_start, dof, user_start, user)
      integer, intent(in) :: n                          !! number of unknowns
      integer, intent(in), contiguous :: list_start(:)  !! (n_element + 1) starts in `dof`, from 1
      integer, intent(in), contiguous :: dof(:)         !! unknowns 1..n; <= 0: no unknown
      integer, allocatable, intent(out) :: user_start(:)   !! (n + 1) from 0
      integer, allocatable, intent(out) :: user(:)      !! elements from 1, ascending for each
      integer, allocatable :: last(:)
      integer :: e, i, k

      allocate(user_start(n + 1), source=0)
      do k = 1, size(dof)
         if (dof(k) > 0) user_start(dof(k) + 1) = user_start(dof(k) + 1) + 1
      end do
      do i = 2, n + 1
         user_start(i) = user_start(i) + user_start(i - 1)
      end do
      allocate(user(user_start(n + 1)))
      allocate(last(n + 1), source=user_start)
      do e = 1, size(list_start) - 1
         do k = list_start(e), list_start(e + 1) - 1
            i = dof(k)
            if (i <= 0) cycle
            last(i) = last(i) + 1
            user(last(i)) = e
         end do
      end do
   end subroutine csr_list_users

   !> Rows of the pattern, columns not yet sorted: once to count, once to fill.
   subroutine element_pattern(self, n, list_start, dof, user_start, user, error)
      type(csr_t), intent(inout) :: self
      integer, intent(in) :: n
      integer, intent(in), contiguous :: list_start(:), dof(:), user_start(:), user(:)
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: seen(:)
      integer(int64) :: n_slot
      integer :: i, k, l, pass

      self%n_row = n
      self%n_col = n
      allocate(self%row_start(n + 1), source=0)
      allocate(seen(n))
      do pass = 1, 2
         seen = 0
         n_slot = 0
         do i = 1, n
            do k = user_start(i) + 1, user_start(i + 1)
               do l = list_start(user(k)), list_start(user(k) + 1) - 1
                  if (dof(l) <= 0) cycle
                  if (seen(dof(l)) == i) cycle
                  seen(dof(l)) = i
                  n_slot = n_slot + 1
                  if (pass == 2) self%column(n_slot) = dof(l) - 1
               end do
            end do
            if (n_slot > huge(1)) then
               call raise(error, err_analysis, "the matrix has more than 2^31 - 1 entries")
               return
            end if
            self%row_start(i + 1) = int(n_slot)
         end do
         if (pass == 1) allocate(self%column(n_slot))
      end do
   end subroutine element_pattern

   !> The slot of every entry of every element matrix.
   pure subroutine map_elements(self, list_start, dof, user_start, user, pair_start, slot)
      type(csr_t), intent(in) :: self
      integer, intent(in), contiguous :: list_start(:), dof(:), user_start(:), user(:)
      integer, intent(in), contiguous :: pair_start(:)  !! (n_element) entries before the element
      integer, intent(inout), contiguous :: slot(:)
      integer, allocatable :: place(:)
      integer :: a, b, e, i, k, n_list, first

      allocate(place(self%n_col))
      do i = 1, self%n_row
         do k = self%row_start(i) + 1, self%row_start(i + 1)
            place(self%column(k) + 1) = k
         end do
         do k = user_start(i) + 1, user_start(i + 1)
            e = user(k)
            first = list_start(e)
            n_list = list_start(e + 1) - first
            do a = 1, n_list
               if (dof(first + a - 1) /= i) cycle
               do b = 1, n_list
                  if (dof(first + b - 1) <= 0) cycle
                  slot(pair_start(e) + a + (b - 1)*n_list) = place(dof(first + b - 1))
               end do
            end do
         end do
      end do
   end subroutine map_elements

   !> Pattern of the entries (row(k), column(k)), and the slot of each; equal entries share one.
   subroutine csr_from_entries(self, n_row, n_col, row, column, slot)
      type(csr_t), intent(out) :: self                  !! values are zero
      integer, intent(in) :: n_row, n_col
      integer, intent(in), contiguous :: row(:), column(:)  !! from 1; <= 0: no such entry
      integer, allocatable, intent(out) :: slot(:)      !! (size of row) 0: no such entry
      integer, allocatable :: start(:), entry(:), seen(:)
      integer :: i, j, k, n_slot

      allocate(slot(size(row)), source=0)
      slot = merge(row, 0, column > 0)
      call csr_list_users(n_row, [(k, k = 1, size(row) + 1)], slot, start, entry)
      self%n_row = n_row
      self%n_col = n_col
      allocate(self%row_start(n_row + 1), source=0)
      allocate(self%column(size(entry)))
      allocate(seen(n_col), source=0)
      n_slot = 0
      do i = 1, n_row
         do k = start(i) + 1, start(i + 1)
            j = column(entry(k))
            if (seen(j) == i) cycle
            seen(j) = i
            n_slot = n_slot + 1
            self%column(n_slot) = j - 1
         end do
         self%row_start(i + 1) = n_slot
      end do
      self%column = self%column(:n_slot)
      call csr_sort_columns(self)
      allocate(self%value(n_slot), source=0.0_dp)
      do k = 1, size(row)
         if (slot(k) > 0) slot(k) = csr_find(self, row(k), column(k))
      end do
   end subroutine csr_from_entries

   !> The matrix of these entries; equal ones add up.
   subroutine csr_from_values(self, n_row, n_col, row, column, value)
      type(csr_t), intent(out) :: self
      integer, intent(in) :: n_row, n_col
      integer, intent(in), contiguous :: row(:), column(:)  !! from 1; <= 0: no such entry
      real(wp), intent(in) :: value(:)
      integer, allocatable :: slot(:)
      integer :: k

      call csr_from_entries(self, n_row, n_col, row, column, slot)
      do k = 1, size(slot)
         if (slot(k) > 0) self%value(slot(k)) = self%value(slot(k)) + real(value(k), dp)
      end do
   end subroutine csr_from_values

   !> Bring the columns of each row into ascending order. For new patterns: values are not moved.
   pure subroutine csr_sort_columns(self)
      type(csr_t), intent(inout) :: self
      type(csr_t) :: transposed

      ! Two transpositions by counting sort the columns in time proportional to the slots.
      transposed%n_row = self%n_col
      transposed%n_col = self%n_row
      call transpose_pattern(self, transposed%row_start, transposed%column)
      call transpose_pattern(transposed, self%row_start, self%column)
   end subroutine csr_sort_columns

   !> Pattern of the transpose, its rows sorted; `from(k)` is the slot that slot k comes from.
   pure subroutine transpose_pattern(self, start, row, from)
      type(csr_t), intent(in) :: self
      integer, allocatable, intent(out) :: start(:)             !! (n_col + 1)
      integer, allocatable, intent(out) :: row(:)               !! 0-based
      integer, allocatable, intent(out), optional :: from(:)
      integer, allocatable :: last(:)
      integer :: i, j, k

      allocate(start(self%n_col + 1), source=0)
      allocate(row(size(self%column)))
      if (present(from)) allocate(from(size(self%column)))
      do k = 1, size(self%column)
         start(self%column(k) + 2) = start(self%column(k) + 2) + 1
      end do
      do j = 2, self%n_col + 1
         start(j) = start(j) + start(j - 1)
      end do
      last = start
      do i = 1, self%n_row
         do k = self%row_start(i) + 1, self%row_start(i + 1)
            j = self%column(k) + 1
            last(j) = last(j) + 1
            row(last(j)) = i - 1
            if (present(from)) from(last(j)) = k
         end do
      end do
   end subroutine transpose_pattern

   !> The transpose; later, with the same pattern, `transposed%value = self%value(from)`.
   pure subroutine csr_transpose(self, transposed, from)
      type(csr_t), intent(in) :: self
      type(csr_t), intent(out) :: transposed
      integer, allocatable, intent(out) :: from(:)      !! (n_slot)

      transposed%n_row = self%n_col
      transposed%n_col = self%n_row
      call transpose_pattern(self, transposed%row_start, transposed%column, from)
      if (allocated(self%value)) transposed%value = self%value(from)
   end subroutine csr_transpose

   !> Some rows, in their order there.
   pure subroutine csr_pick_rows(self, row, picked)
      type(csr_t), intent(in) :: self
      integer, intent(in) :: row(:)              !! (any) of its rows
      type(csr_t), intent(out) :: picked         !! (size(row) x n_col)
      integer :: i

      picked%n_row = size(row)
      picked%n_col = self%n_col
      allocate(picked%row_start(size(row) + 1), source=0)
      do i = 1, size(row)
         picked%row_start(i + 1) = picked%row_start(i) + self%row_start(row(i) + 1) &
            - self%row_start(row(i))
      end do
      associate (n => picked%row_start(size(row) + 1))
         allocate(picked%column(n), picked%value(n))
      end associate
      do i = 1, size(row)
         associate (first => picked%row_start(i) + 1, last => picked%row_start(i + 1), &
               from => self%row_start(row(i)) + 1, to => self%row_start(row(i) + 1))
            picked%column(first:last) = self%column(from:to)
            picked%value(first:last) = self%value(from:to)
         end associate
      end do
   end subroutine csr_pick_rows

   !> The first `n` rows of another behind the first `n` of its own.
   pure subroutine csr_append(self, other, n)
      type(csr_t), intent(inout) :: self
      type(csr_t), intent(in) :: other           !! of as many columns
      integer, intent(in) :: n                   !! >= 0

      associate (own => self%row_start(n + 1), more => other%row_start(n + 1))
         self%column = [self%column(:own), other%column(:more)]
         self%value = [self%value(:own), other%value(:more)]
         self%row_start = [self%row_start(:n + 1), own + other%row_start(2:n + 1)]
      end associate
      self%n_row = 2*n
   end subroutine csr_append

   !> Slot of the entry (i, j), both from 1; 0 if the pattern has no such entry.
   pure integer function csr_find(self, i, j)
      type(csr_t), intent(in) :: self
      integer, intent(in) :: i, j

      csr_find = find_sorted(self%column(self%row_start(i) + 1:self%row_start(i + 1)), j - 1)
      if (csr_find > 0) csr_find = csr_find + self%row_start(i)
   end function csr_find

   !> `copy` has the pattern of `self`, and values of zero.
   pure subroutine csr_copy_pattern(self, copy)
      type(csr_t), intent(in) :: self
      type(csr_t), intent(out) :: copy

      copy%n_row = self%n_row
      copy%n_col = self%n_col
      copy%row_start = self%row_start
      copy%column = self%column
      allocate(copy%value(size(self%column)), source=0.0_dp)
   end subroutine csr_copy_pattern

   !> The matrix without the room that is left behind its last row.
   pure subroutine csr_copy_filled(self, copy)
      type(csr_t), intent(in) :: self
      type(csr_t), intent(out) :: copy
      integer :: n

      n = self%row_start(self%n_row + 1)
      copy%n_row = self%n_row
      copy%n_col = self%n_col
      allocate(copy%row_start, source=self%row_start)
      allocate(copy%column, source=self%column(:n))
      allocate(copy%value, source=self%value(:n))
   end subroutine csr_copy_filled

   !> Both matrices have the same pattern.
   pure logical function csr_is_same(a, b)
      type(csr_t), intent(in) :: a, b

      csr_is_same = a%n_row == b%n_row .and. a%n_col == b%n_col
      if (csr_is_same) csr_is_same = allocated(a%column) .and. allocated(b%column)
      if (csr_is_same) csr_is_same = size(a%column) == size(b%column)
      if (csr_is_same) csr_is_same = all(a%row_start == b%row_start)
      if (csr_is_same) csr_is_same = all(a%column == b%column)
   end function csr_is_same

   !> Has each entry of a square pattern one across the diagonal, which has no gaps?
   pure logical function csr_is_symmetric(self)
      type(csr_t), intent(in) :: self
      integer :: i, j, k, next(self%n_row)

      csr_is_symmetric = .false.
      do i = 1, self%n_row
         next(i) = csr_find(self, i, i) + 1
         if (next(i) == 1) return
         do k = self%row_start(i) + 1, next(i) - 2
            j = self%column(k) + 1
            if (next(j) > self%row_start(j + 1)) return
            if (self%column(next(j)) + 1 /= i) return
            next(j) = next(j) + 1
         end do
      end do
      csr_is_symmetric = all(next == self%row_start(2:) + 1)
   end function csr_is_symmetric

   !> y = A x
   pure subroutine csr_multiply(self, x, y)
      type(csr_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:)          !! (n_col)
      real(wp), intent(out), contiguous :: y(:)         !! (n_row)
      real(wp) :: total
      integer :: i, k

      do i = 1, self%n_row
         total = 0.0_wp
         do k = self%row_start(i) + 1, self%row_start(i + 1)
            total = total + real(self%value(k), wp)*x(self%column(k) + 1)
         end do
         y(i) = total
      end do
   end subroutine csr_multiply

   !> y = A^T x
   pure subroutine csr_multiply_transposed(self, x, y)
      type(csr_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:)          !! (n_row)
      real(wp), intent(out), contiguous :: y(:)         !! (n_col)
      integer :: i, j, k

      y = 0.0_wp
      do i = 1, self%n_row
         do k = self%row_start(i) + 1, self%row_start(i + 1)
            j = self%column(k) + 1
            y(j) = y(j) + real(self%value(k), wp)*x(i)
         end do
      end do
   end subroutine csr_multiply_transposed

end module emcon_csr
