!> What all functions of the C interface share: texts, arrays and matrices on their way over the
!> border.
!>
!> One rule for all: an output that is NULL is left out; so is an input where the header says so,
!> and the Fortran side then has an array that is not allocated.
module emcon_c_border
   use, intrinsic :: iso_c_binding, only : c_associated, c_char, c_double, c_f_pointer, c_int, &
      c_loc, c_null_char, c_ptr, c_size_t
   use emcon_c_types, only : csr_c, increment_c
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_handle, only : model_t
   use emcon_kinds, only : wp
   use emcon_march, only : increment_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: check_count, check_given
   public :: n_nodes, n_constraints, take_field, take_values, take_flags, take_numbers
   public :: put_field, put_values, put_numbers, put_number
   public :: put_increment, as_increment, show_matrix, put_matrix, f_text, c_string

   interface
      pure integer(c_size_t) function c_strlen(text) bind(c, name="strlen")
         import :: c_ptr, c_size_t
         type(c_ptr), intent(in), value :: text
      end function c_strlen
   end interface

contains

   pure integer function n_nodes(model)
      type(model_t), intent(in) :: model

      n_nodes = size(model%stepper%scene%x, 2)
   end function n_nodes

   pure integer function n_constraints(model)
      type(model_t), intent(in) :: model

      n_constraints = model%stepper%march%system%n_constraint
   end function n_constraints

   !> An error unless the count called `name` is what the model has.
   subroutine check_count(name, n, expected, error)
      character(len=*), intent(in) :: name
      integer(c_int), intent(in) :: n
      integer, intent(in) :: expected
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error) .or. n == expected) return
      call raise(error, err_input, name // " is " // to_text(int(n)) // ", but the model has " // &
         to_text(expected))
   end subroutine check_count

   !> An error for an argument that must not be NULL.
   subroutine check_given(name, argument, error)
      character(len=*), intent(in) :: name
      type(c_ptr), intent(in) :: argument
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error) .or. c_associated(argument)) return
      call raise(error, err_input, name // " is NULL")
   end subroutine check_given

   !> A nodal field (2, n) from C; not allocated for NULL.
   subroutine take_field(from, n, expected, field, error)
      type(c_ptr), intent(in) :: from
      integer(c_int), intent(in) :: n
      integer, intent(in) :: expected                !! number of nodes
      real(wp), allocatable, intent(out) :: field(:, :)
      type(error_t), allocatable, intent(inout) :: error
      real(c_double), pointer :: array(:, :)

      if (.not. c_associated(from)) return
      call check_count("n_node", n, expected, error)
      if (allocated(error)) return
      call c_f_pointer(from, array, [2, expected])
      allocate(field(2, expected))
      field = real(array, wp)
   end subroutine take_field

   !> A list of reals from C; not allocated for NULL.
   subroutine take_values(name, from, n, expected, list, error)
      character(len=*), intent(in) :: name           !! of the count
      type(c_ptr), intent(in) :: from
      integer(c_int), intent(in) :: n
      integer, intent(in) :: expected
      real(wp), allocatable, intent(out) :: list(:)
      type(error_t), allocatable, intent(inout) :: error
      real(c_double), pointer :: array(:)

      if (.not. c_associated(from)) return
      call check_count(name, n, expected, error)
      if (allocated(error)) return
      call c_f_pointer(from, array, [expected])
      allocate(list(expected))
      list = real(array, wp)
   end subroutine take_values

   !> A list of truth values, 0 is false; not allocated for NULL.
   subroutine take_flags(name, from, n, expected, list, error)
      character(len=*), intent(in) :: name
      type(c_ptr), intent(in) :: from
      integer(c_int), intent(in) :: n
      integer, intent(in) :: expected
      logical, allocatable, intent(out) :: list(:)
      type(error_t), allocatable, intent(inout) :: error
      integer(c_int), pointer :: array(:)

      if (.not. c_associated(from)) return
      call check_count(name, n, expected, error)
      if (allocated(error)) return
      call c_f_pointer(from, array, [expected])
      allocate(list(expected))
      list = array /= 0
   end subroutine take_flags

   !> The `n` numbers called `name`, which count from 0 in C; the largest integer is none.
   subroutine take_numbers(name, from, n, list, error)
      character(len=*), intent(in) :: name
      type(c_ptr), intent(in) :: from
      integer(c_int), intent(in) :: n
      integer, allocatable, intent(out) :: list(:)
      type(error_t), allocatable, intent(inout) :: error
      integer(c_int), pointer :: array(:)

      allocate(list(0))
      if (n > 0) call check_given(name, from, error)
      if (n < 0 .and. .not. allocated(error)) call raise(error, err_input, "the size of " // name &
         // " is " // to_text(int(n)))
      if (allocated(error) .or. n == 0) return
      call c_f_pointer(from, array, [n])
      list = min(array, huge(array) - 1) + 1
   end subroutine take_numbers

   !> Copy a field to an array of C.
   subroutine put_field(field, to)
      real(wp), intent(in) :: field(:, :)
      type(c_ptr), intent(in) :: to
      real(c_double), pointer :: array(:, :)

      if (.not. c_associated(to)) return
      call c_f_pointer(to, array, shape(field))
      array = real(field, c_double)
   end subroutine put_field

   !> Copy a list of reals.
   subroutine put_values(list, to)
      real(wp), intent(in) :: list(:)
      type(c_ptr), intent(in) :: to
      real(c_double), pointer :: array(:)

      if (.not. c_associated(to)) return
      call c_f_pointer(to, array, shape(list))
      array = real(list, c_double)
   end subroutine put_values

   !> Copy a list of integers.
   subroutine put_numbers(list, to)
      integer, intent(in) :: list(:)
      type(c_ptr), intent(in) :: to
      integer(c_int), pointer :: array(:)

      if (.not. c_associated(to)) return
      call c_f_pointer(to, array, shape(list))
      array = list
   end subroutine put_numbers

   !> Copy one integer.
   subroutine put_number(number, to)
      integer, intent(in) :: number
      type(c_ptr), intent(in) :: to
      integer(c_int), pointer :: place

      if (.not. c_associated(to)) return
      call c_f_pointer(to, place)
      place = number
   end subroutine put_number

   !> Copy what was done.
   subroutine put_increment(model, made, to)
      type(model_t), intent(in) :: model
      type(increment_t), intent(in) :: made
      type(c_ptr), intent(in) :: to
      type(increment_c), pointer :: place

      if (.not. c_associated(to)) return
      call c_f_pointer(to, place)
      place = as_increment(model, made)
   end subroutine put_increment

   pure type(increment_c) function as_increment(model, made)
      type(model_t), intent(in) :: model
      type(increment_t), intent(in) :: made

      as_increment%h = real(made%h, c_double)
      as_increment%time = real(model%stepper%march%state%time, c_double)
      as_increment%n_newton = made%n_newton
      as_increment%n_cut = made%n_cut
      as_increment%n_active = made%n_active
      as_increment%penetration = real(made%overlap%depth, c_double)
   end function as_increment

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

end module emcon_c_border
