!> Assembly straight into the matrix of the unknowns, T^T N T, with dependent freedoms eliminated.
!>
!> Elements among independent freedoms add to the matrix as ever. What an element gives to the row
!> or column of a dependent freedom goes to a small matrix on the side, which is brought in once per
!> assembly. Freedoms are numbered here: unknowns, then dependent ones. Source: docs/theory.md,
!> section 10.
module emcon_reduction
   use emcon_csr, only : csr_find, csr_sort_columns, csr_t, csr_transpose
   use emcon_kinds, only : dp, int64
   use emcon_numbering, only : numbering_matrix, numbering_t
   implicit none
   private
   public :: reduction_t, reduction_init, reduction_slot, reduction_add, reduction_fold, &
      freedom_numbers

   type :: reduction_t
      integer :: n_unknown = 0
      integer :: n_dependent = 0
      type(csr_t) :: side                        !! rows and columns of dependent freedoms
      type(csr_t) :: terms                       !! (n_dependent x n_unknown) T
      type(csr_t) :: user                        !! (n_unknown x n_dependent) T^T
      type(csr_t) :: image                       !! (n_dependent x n_unknown) rows of N T
      integer, allocatable :: touched(:)         !! rows of the matrix that get something
      integer, allocatable, private :: place(:)  !! (n_unknown) slots of the present row
   end type reduction_t

   !> Terms of the product per entry of the unreduced matrix, at most: eliminating long rows costs
   !> more than multipliers do.
   integer(int64), parameter :: most_terms = 64
   !> And entries of the reduced matrix per entry of the unreduced one.
   integer, parameter :: most_fill = 4

contains

   !> The number of each degree of freedom: unknowns, then dependent ones; 0: prescribed.
   pure function freedom_numbers(numbering) result(number)
      type(numbering_t), intent(in) :: numbering
      integer, allocatable :: number(:)
      integer :: k

      number = reshape(numbering%unknown, [size(numbering%unknown)])
      do k = 1, numbering%n_dependent
         number(numbering%dependent(k)) = numbering%n_unknown + k
      end do
   end function freedom_numbers

   !> Lay out the reduced matrix for the pattern `full` over unknowns and dependent freedoms, and
   !> turn places in `full` into such as `reduction_slot` gives. Nothing is done if it is too full.
   subroutine reduction_init(self, numbering, full, matrix, slot, is_too_full)
      type(reduction_t), intent(out) :: self
      type(numbering_t), intent(in) :: numbering
      type(csr_t), intent(inout) :: full                 !! becomes `matrix` if nothing depends
      type(csr_t), intent(out) :: matrix
      integer, intent(inout) :: slot(:)                  !! 0 stays 0
      logical, intent(out) :: is_too_full
      integer, allocatable :: place(:), from(:)
      integer :: i, k

      self%n_unknown = numbering%n_unknown
      self%n_dependent = numbering%n_dependent
      is_too_full = .false.
      if (self%n_dependent == 0) then
         call take(full, matrix)
         allocate(self%side%value(0), self%touched(0))
         return
      end if
      call numbering_matrix(numbering, numbering%dependent, self%terms)
      call csr_transpose(self%terms, self%user, from)
      call lay_out_image(self, full)
      is_too_full = would_be_too_full(self, full)
      if (is_too_full) return
      call lay_out_side(self, full)
      call lay_out_matrix(self, full, matrix)
      is_too_full = size(matrix%column) > most_fill*size(full%column)
      if (is_too_full) return
      allocate(place(size(full%column)))
      do i = 1, full%n_row
         do k = full%row_start(i) + 1, full%row_start(i + 1)
            place(k) = reduction_slot(self, matrix, i, full%column(k) + 1)
         end do
      end do
      do k = 1, size(slot)
         if (slot(k) > 0) slot(k) = place(slot(k))
      end do
   end subroutine reduction_init

   !> Where the entry of the freedoms `i`, `j` goes: k > 0, slot k of the matrix; k < 0, slot -k on
   !> the side; 0, one of them is prescribed or the pattern has no such entry.
   pure integer function reduction_slot(self, matrix, i, j)
      type(reduction_t), intent(in) :: self
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: i, j

      if (i == 0 .or. j == 0) then
         reduction_slot = 0
      else if (max(i, j) <= self%n_unknown) then
         reduction_slot = csr_find(matrix, i, j)
      else
         reduction_slot = -csr_find(self%side, i, j)
      end if
   end function reduction_slot

   subroutine take(from, to)
      type(csr_t), intent(inout) :: from
      type(csr_t), intent(inout) :: to

      to%n_row = from%n_row
      to%n_col = from%n_col
      call move_alloc(from%row_start, to%row_start)
      call move_alloc(from%column, to%column)
      call move_alloc(from%value, to%value)
   end subroutine take

   !> Pattern of the rows of N T that belong to dependent freedoms.
   pure subroutine lay_out_image(self, full)
      type(reduction_t), intent(inout) :: self
      type(csr_t), intent(in) :: full
      integer, allocatable :: seen(:)
      integer :: k, n, pass

      allocate(seen(self%n_unknown), self%place(self%n_unknown), source=0)
      self%image%n_row = self%n_dependent
      self%image%n_col = self%n_unknown
      allocate(self%image%row_start(self%n_dependent + 1), source=0)
      do pass = 1, 2
         seen = 0
         n = 0
         do k = 1, self%n_dependent
            call expand(self, full, self%n_unknown + k, k, seen, n, self%image%column)
            self%image%row_start(k + 1) = n
         end do
         if (pass == 1) allocate(self%image%column(n))
      end do
      call csr_sort_columns(self%image)
      allocate(self%image%value(n), source=0.0_dp)
   end subroutine lay_out_image

   !> Append the unknowns that row `i` of `full` reaches, each once: those that `seen` does not mark
   !> by `mark`. They are only counted as long as `column` is not allocated.
   pure subroutine expand(self, full, i, mark, seen, n, column)
      type(reduction_t), intent(in) :: self
      type(csr_t), intent(in) :: full
      integer, intent(in) :: i, mark
      integer, intent(inout) :: seen(:), n
      integer, allocatable, intent(inout) :: column(:)
      integer :: s, t, j

      do s = full%row_start(i) + 1, full%row_start(i + 1)
         j = full%column(s) + 1
         if (j <= self%n_unknown) then
            call append(j, mark, seen, n, column)
         else
            associate (terms => self%terms, k => j - self%n_unknown)
               do t = terms%row_start(k) + 1, terms%row_start(k + 1)
                  call append(terms%column(t) + 1, mark, seen, n, column)
               end do
            end associate
         end if
      end do
   end subroutine expand

   pure subroutine append(j, mark, seen, n, column)
      integer, intent(in) :: j, mark
      integer, intent(inout) :: seen(:), n
      integer, allocatable, intent(inout) :: column(:)

      if (seen(j) == mark) return
      seen(j) = mark
      n = n + 1
      if (allocated(column)) column(n) = j - 1
   end subroutine append

   !> Would the product take too long?
   pure logical function would_be_too_full(self, full)
      type(reduction_t), intent(in) :: self
      type(csr_t), intent(in) :: full
      integer(int64) :: n_term
      integer :: k

      n_term = 0
      do k = 1, self%n_dependent
         n_term = n_term + int(self%terms%row_start(k + 1) - self%terms%row_start(k), int64) &
            *int(self%image%row_start(k + 1) - self%image%row_start(k), int64)
      end do
      would_be_too_full = n_term > most_terms*int(size(full%column), int64)
   end function would_be_too_full

   !> The entries of `full` in rows or columns of dependent freedoms.
   pure subroutine lay_out_side(self, full)
      type(reduction_t), intent(inout) :: self
      type(csr_t), intent(in) :: full
      integer :: i, s, n, pass

      associate (side => self%side)
         side%n_row = full%n_row
         side%n_col = full%n_col
         allocate(side%row_start(full%n_row + 1), source=0)
         do pass = 1, 2
            n = 0
            do i = 1, full%n_row
               do s = full%row_start(i) + 1, full%row_start(i + 1)
                  if (max(i, full%column(s) + 1) <= self%n_unknown) cycle
                  n = n + 1
                  if (pass == 2) side%column(n) = full%column(s)
               end do
               side%row_start(i + 1) = n
            end do
            if (pass == 1) allocate(side%column(n))
         end do
         allocate(side%value(n), source=0.0_dp)
      end associate
   end subroutine lay_out_side

   !> Pattern of the reduced matrix, and its rows that get something from the side.
   pure subroutine lay_out_matrix(self, full, matrix)
      type(reduction_t), intent(inout) :: self
      type(csr_t), intent(in) :: full
      type(csr_t), intent(out) :: matrix
      integer, allocatable :: seen(:)
      logical, allocatable :: is_touched(:)
      integer :: i, s, t, n, pass

      allocate(seen(self%n_unknown), source=0)
      allocate(is_touched(self%n_unknown), source=.false.)
      matrix%n_row = self%n_unknown
      matrix%n_col = self%n_unknown
      allocate(matrix%row_start(self%n_unknown + 1), source=0)
      do pass = 1, 2
         seen = 0
         n = 0
         do i = 1, self%n_unknown
            call expand(self, full, i, i, seen, n, matrix%column)
            is_touched(i) = self%side%row_start(i + 1) > self%side%row_start(i) &
               .or. self%user%row_start(i + 1) > self%user%row_start(i)
            do s = self%user%row_start(i) + 1, self%user%row_start(i + 1)
               associate (image => self%image, k => self%user%column(s) + 1)
                  do t = image%row_start(k) + 1, image%row_start(k + 1)
                     call append(image%column(t) + 1, i, seen, n, matrix%column)
                  end do
               end associate
            end do
            matrix%row_start(i + 1) = n
         end do
         if (pass == 1) allocate(matrix%column(n))
      end do
      call csr_sort_columns(matrix)
      allocate(matrix%value(n), source=0.0_dp)
      self%touched = pack([(i, i = 1, self%n_unknown)], is_touched)
   end subroutine lay_out_matrix

   !> Bring what stands on the side into `value`, of entries that stay for a step.
   subroutine reduction_fold(self, matrix, value, side)
      type(reduction_t), intent(in) :: self
      type(csr_t), intent(in) :: matrix                  !! its pattern
      real(dp), intent(inout) :: value(:)                !! entries with slots > 0
      real(dp), intent(in) :: side(:)                    !! and those with slots < 0
      type(reduction_t) :: reduction
      type(csr_t) :: placed

      if (self%n_dependent == 0) return
      placed = matrix
      placed%value = value
      reduction = self
      reduction%side%value = side
      call reduction_add(reduction, placed)
      value = placed%value
   end subroutine reduction_fold

   !> Bring what stands on the side into the matrix: N_ud T + T^T (N T), and clear the side.
   pure subroutine reduction_add(self, matrix)
      type(reduction_t), intent(inout) :: self
      type(csr_t), intent(inout) :: matrix
      integer :: i, l, s, t

      if (self%n_dependent == 0) return
      call multiply_rows(self)
      do l = 1, size(self%touched)
         i = self%touched(l)
         do s = matrix%row_start(i) + 1, matrix%row_start(i + 1)
            self%place(matrix%column(s) + 1) = s
         end do
         associate (side => self%side, terms => self%terms, user => self%user, image => self%image)
            do s = side%row_start(i) + 1, side%row_start(i + 1)
               associate (k => side%column(s) + 1 - self%n_unknown)
                  do t = terms%row_start(k) + 1, terms%row_start(k + 1)
                     associate (to => matrix%value(self%place(terms%column(t) + 1)))
                        to = to + side%value(s)*terms%value(t)
                     end associate
                  end do
               end associate
            end do
            do s = user%row_start(i) + 1, user%row_start(i + 1)
               associate (k => user%column(s) + 1)
                  do t = image%row_start(k) + 1, image%row_start(k + 1)
                     associate (to => matrix%value(self%place(image%column(t) + 1)))
                        to = to + user%value(s)*image%value(t)
                     end associate
                  end do
               end associate
            end do
         end associate
      end do
      self%side%value = 0.0_dp
   end subroutine reduction_add

   !> The rows of N T that belong to dependent freedoms.
   pure subroutine multiply_rows(self)
      type(reduction_t), intent(inout) :: self
      integer :: k, j, s, t

      associate (side => self%side, terms => self%terms, image => self%image)
         image%value = 0.0_dp
         do k = 1, self%n_dependent
            do t = image%row_start(k) + 1, image%row_start(k + 1)
               self%place(image%column(t) + 1) = t
            end do
            do s = side%row_start(self%n_unknown + k) + 1, side%row_start(self%n_unknown + k + 1)
               j = side%column(s) + 1
               if (j <= self%n_unknown) then
                  image%value(self%place(j)) = image%value(self%place(j)) + side%value(s)
                  cycle
               end if
               j = j - self%n_unknown
               do t = terms%row_start(j) + 1, terms%row_start(j + 1)
                  associate (to => image%value(self%place(terms%column(t) + 1)))
                     to = to + side%value(s)*terms%value(t)
                  end associate
               end do
            end do
         end do
      end associate
   end subroutine multiply_rows

end module emcon_reduction
