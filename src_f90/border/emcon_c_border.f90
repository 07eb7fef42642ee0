!> What the functions of the C interface share: counts, texts and matrices on their way over the
!> border.
module emcon_c_border
   use, intrinsic :: iso_c_binding, only : c_associated, c_char, c_double, c_f_pointer, c_int, &
      c_loc, c_null_char, c_ptr, c_size_t
   use emcon_c_types, only : constraint_report_c, csr_c
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : dp
   use emcon_model, only : model_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: check_count, check_free_count, check_given, from_1
   public :: f_text, c_string, put_text, put_number, put_address
   public :: take_matrix, put_matrix, put_report

   !> Four times as many numbers can just be counted.
   integer(c_int), parameter :: most = 2_c_int**29 - 1_c_int

   interface
      pure integer(c_size_t) function c_strlen(text) bind(c, name="strlen")
         import :: c_ptr, c_size_t
         type(c_ptr), intent(in), value :: text
      end function c_strlen
   end interface

contains

   !> An error unless the count called `name` is what the model has; for NULL it does not matter.
   subroutine check_count(name, n, expected, array, error)
      character(len=*), intent(in) :: name
      integer(c_int), intent(in) :: n, expected
      type(c_ptr), intent(in) :: array               !! that has so many entries
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error) .or. n == expected .or. .not. c_associated(array)) return
      call raise(error, err_input, name // " is " // to_text(int(n)) // ", but the model has " // &
         to_text(int(expected)))
   end subroutine check_count

   !> An error for a count that is none, where any other will do.
   subroutine check_free_count(name, n, error)
      character(len=*), intent(in) :: name
      integer(c_int), intent(in) :: n
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      if (n < 0) call raise(error, err_input, name // " is " // to_text(int(n)) // ", below 0")
      if (n > most) call raise(error, err_input, name // " is more than can be counted")
   end subroutine check_free_count

   !> An error for an argument that must not be NULL.
   subroutine check_given(name, argument, error)
      character(len=*), intent(in) :: name
      type(c_ptr), intent(in) :: argument
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error) .or. c_associated(argument)) return
      call raise(error, err_input, name // " is NULL")
   end subroutine check_given

   !> A number that counts from 0 in C; the largest is none.
   elemental integer function from_1(number)
      integer(c_int), intent(in) :: number

      from_1 = min(number, huge(number) - 1) + 1
   end function from_1

   !> The text of C up to its end; "" for NULL.
   function f_text(text) result(copy)
      type(c_ptr), intent(in) :: text
      character(len=text_length(text)) :: copy
      character(kind=c_char), pointer :: from(:)
      integer :: i

      if (len(copy) == 0) return
      call c_f_pointer(text, from, [len(copy)])
      do i = 1, len(copy)
         copy(i:i) = from(i)
      end do
   end function f_text

   pure integer function text_length(text)
      type(c_ptr), intent(in) :: text

      text_length = 0
      if (c_associated(text)) text_length = int(c_strlen(text))
   end function text_length

   !> The same the other way round.
   pure function c_string(text) result(copy)
      character(len=*), intent(in) :: text
      character(kind=c_char) :: copy(len(text) + 1)
      integer :: i

      do i = 1, len(text)
         copy(i) = text(i:i)
      end do
      copy(size(copy)) = c_null_char
   end function c_string

   !> Write a text into the room for `n` letters that C has.
   subroutine put_text(text, n, to, error)
      character(len=*), intent(in) :: text
      integer(c_int), intent(in) :: n
      type(c_ptr), intent(in) :: to
      type(error_t), allocatable, intent(inout) :: error
      character(kind=c_char), pointer :: letter(:)

      call check_given("the room for the text", to, error)
      if (n <= len(text) .and. .not. allocated(error)) call raise(error, err_input, &
         "the text has " // to_text(len(text)) // " letters, and there is room for " // &
         to_text(int(n) - 1))
      if (allocated(error)) return
      call c_f_pointer(to, letter, [len(text) + 1])
      letter = c_string(text)
   end subroutine put_text

   !> Copy one integer, if C wants it.
   subroutine put_number(number, to)
      integer, intent(in) :: number
      type(c_ptr), intent(in) :: to
      integer(c_int), pointer :: place

      if (.not. c_associated(to)) return
      call c_f_pointer(to, place)
      place = number
   end subroutine put_number

   !> Tell C where something is, if it wants to know.
   subroutine put_address(address, to)
      type(c_ptr), intent(in) :: address, to
      type(c_ptr), pointer :: place

      if (.not. c_associated(to)) return
      call c_f_pointer(to, place)
      place = address
   end subroutine put_address

   !> A copy of a matrix of C, without values where there are none. Its indices are checked by who
   !> is given it.
   subroutine take_matrix(name, from, matrix, error)
      character(len=*), intent(in) :: name
      type(c_ptr), intent(in) :: from
      type(csr_t), intent(out) :: matrix
      type(error_t), allocatable, intent(inout) :: error
      type(csr_c), pointer :: given
      integer(c_int), pointer :: start(:), column(:)
      real(c_double), pointer :: value(:)

      call check_given(name, from, error)
      if (allocated(error)) return
      call c_f_pointer(from, given)
      call check_given(name // "->row_start", given%row_start, error)
      call check_given(name // "->column", given%column, error)
      if (.not. allocated(error) .and. given%n_row < 1) call raise(error, err_input, &
         name // " has no rows")
      if (allocated(error)) return
      call c_f_pointer(given%row_start, start, [given%n_row + 1])
      if (start(given%n_row + 1) < 0) then
         call raise(error, err_input, name // ": the last row start is negative")
         return
      end if
      matrix%n_row = given%n_row
      matrix%n_col = given%n_column
      matrix%row_start = start
      call c_f_pointer(given%column, column, [start(given%n_row + 1)])
      matrix%column = column
      if (.not. c_associated(given%value)) return
      call c_f_pointer(given%value, value, shape(column))
      matrix%value = real(value, dp)
   end subroutine take_matrix

   !> Let C see a matrix in its place.
   subroutine show_matrix(matrix, to)
      type(csr_t), intent(in), target :: matrix      !! of a model, so that it stays there
      type(csr_c), intent(out) :: to

      to%n_row = matrix%n_row
      to%n_column = matrix%n_col
      if (allocated(matrix%row_start)) to%row_start = c_loc(matrix%row_start)
      if (allocated(matrix%column)) to%column = c_loc(matrix%column)
      if (allocated(matrix%value)) to%value = c_loc(matrix%value)
   end subroutine show_matrix

   !> The same for where C wants it, if it does.
   subroutine put_matrix(matrix, to)
      type(csr_t), intent(in), target :: matrix
      type(c_ptr), intent(in) :: to
      type(csr_c), pointer :: view

      if (.not. c_associated(to)) return
      call c_f_pointer(to, view)
      call show_matrix(matrix, view)
   end subroutine put_matrix

   !> Let C see the report that the model holds, with numbers from 0; an empty one after an error.
   subroutine put_report(model, error, place)
      type(model_t), intent(inout), target :: model
      type(error_t), allocatable, intent(in) :: error
      type(c_ptr), intent(in) :: place
      type(constraint_report_c), pointer :: to

      if (.not. c_associated(place)) return
      call c_f_pointer(place, to)
      to = constraint_report_c()
      if (allocated(error)) return
      associate (report => model%report)
         to%n = report%n
         call show_matrix(report%discrete_gradient, to%discrete_gradient)
         call show_matrix(report%end_gradient, to%end_gradient)
         if (report%n == 0) return
         model%c_place = reshape([report%id - 1, report%pair - 1, report%node - 1, report%slip], &
            [report%n, 4])
         model%c_gap = real(reshape([report%target, report%gap0, report%gap1, report%dgap, &
            report%defect, report%size], [report%n, 6]), c_double)
      end associate
      to%id = c_loc(model%c_place(1, 1))
      to%pair = c_loc(model%c_place(1, 2))
      to%node = c_loc(model%c_place(1, 3))
      to%slip = c_loc(model%c_place(1, 4))
      to%target = c_loc(model%c_gap(1, 1))
      to%gap0 = c_loc(model%c_gap(1, 2))
      to%gap1 = c_loc(model%c_gap(1, 3))
      to%dgap = c_loc(model%c_gap(1, 4))
      to%defect = c_loc(model%c_gap(1, 5))
      to%size = c_loc(model%c_gap(1, 6))
   end subroutine put_report

end module emcon_c_border
