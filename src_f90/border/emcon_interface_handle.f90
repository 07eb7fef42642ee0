!> Interfaces that a host in another language, or in an older one, holds by a handle.
!>
!> A handle is three default integers that the host owns: the address of the interface in two of
!> them, and a word made of these, by which an array that is no handle is told. C and Python hold
!> the address alone, 0 for none. Nothing else keeps the interface, so that any number live side by
!> side, each in a thread of its own.
module emcon_interface_handle
   use, intrinsic :: iso_c_binding, only : c_char, c_double, c_f_pointer, c_int, c_int64_t, &
      c_loc, c_null_ptr, c_ptr
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_input, err_none, error_t, raise
   use emcon_interface, only : interface_t
   use emcon_interface_stage, only : check_evaluated
   use emcon_interface_step, only : constraint_values_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: host_t, host_new, host_find, host_free, host_pass, host_fit, host_put, host_index
   public :: host_make, host_at, host_keep, host_contacts, host_selected, host_unknowns
   public :: handle_size, no_handle

   integer, parameter :: handle_size = 3
   character(len=*), parameter :: no_handle = "this is no handle of an interface: it was " // &
      "never made, or freed"
   !> Bits that zeros and small numbers do not have.
   integer(c_int), parameter :: mark = 1146438477_c_int

   type :: host_t
      type(interface_t) :: face
      type(constraint_values_t) :: values        !! of the last evaluation
      character(len=:), allocatable :: message   !! of the last failure
      !> What was asked for last, which C looks at in place.
      type(csr_t) :: links, d, m, curvature, p, df
      integer(c_int), allocatable :: id(:), redundant(:)   !! counted from 0
      real(c_double), allocatable :: number(:, :)          !! (n, 6) `values` but its matrices
      character(kind=c_char), allocatable :: text(:)
   end type host_t

contains

   !> A handle of a new interface, and the interface.
   subroutine host_new(handle, host)
      integer(c_int), intent(out) :: handle(handle_size)
      type(host_t), pointer, intent(out) :: host
      integer(c_int64_t) :: address

      address = host_make()
      call host_at(address, host)
      handle(:2) = transfer(address, handle(:2))
      handle(3) = word_of(handle)
   end subroutine host_new

   !> The address of a new interface, which `host_at` makes a pointer of, to be deallocated.
   integer(c_int64_t) function host_make()
      type(host_t), pointer :: host

      allocate(host)
      host%message = ""
      host_make = transfer(c_loc(host), host_make)
   end function host_make

   !> The interface at an address; null for 0.
   subroutine host_at(address, host)
      integer(c_int64_t), intent(in) :: address
      type(host_t), pointer, intent(out) :: host

      host => null()
      if (address /= 0) call c_f_pointer(transfer(address, c_null_ptr), host)
   end subroutine host_at

   pure integer(c_int) function word_of(handle)
      integer(c_int), intent(in) :: handle(handle_size)

      word_of = ieor(ieor(handle(1), mark), ishftc(handle(2), 7))
   end function word_of

   !> The interface of a handle; null, and an error code, if it is none.
   subroutine host_find(handle, host, ierr)
      integer(c_int), intent(in) :: handle(handle_size)
      type(host_t), pointer, intent(out) :: host
      integer(c_int), intent(out) :: ierr

      host => null()
      ierr = err_input
      if (handle(3) /= word_of(handle) .or. all(handle(:2) == 0)) return
      call host_at(transfer(handle(:2), 0_c_int64_t), host)
      ierr = err_none
   end subroutine host_find

   !> Free the interface of a handle, which is none any more. Harmless for what is none.
   subroutine host_free(handle)
      integer(c_int), intent(inout) :: handle(handle_size)
      type(host_t), pointer :: host
      integer(c_int) :: ierr

      call host_find(handle, host, ierr)
      handle = 0
      if (associated(host)) deallocate(host)
   end subroutine host_free

   !> Keep the text of a failure and hand on its code; else success.
   subroutine host_pass(host, error, ierr)
      type(host_t), intent(inout) :: host
      type(error_t), allocatable, intent(in) :: error
      integer(c_int), intent(out) :: ierr

      ierr = err_none
      if (.not. allocated(error)) return
      host%message = error%message
      ierr = error%code
   end subroutine host_pass

   !> Keep the values of the last evaluation as C and Python read them.
   subroutine host_keep(host)
      type(host_t), intent(inout) :: host

      host%id = int(host%values%id - 1, c_int)
      if (allocated(host%number)) deallocate(host%number)
      allocate(host%number(host%values%n, 6))
      associate (values => host%values, number => host%number)
         number(:, 1) = real(values%target, c_double)
         number(:, 2) = real(values%gap0, c_double)
         number(:, 3) = real(values%gap1, c_double)
         number(:, 4) = real(values%dgap, c_double)
         number(:, 5) = real(values%defect, c_double)
         number(:, 6) = real(values%size, c_double)
      end associate
   end subroutine host_keep

   !> How many possible contacts there are; -1 if that is not known yet.
   pure integer function host_contacts(host) result(n)
      type(host_t), intent(in) :: host

      n = merge(host%face%n_constraint, -1, host%face%is_prepared)
   end function host_contacts

   !> How many of them are selected and evaluated.
   pure integer function host_selected(host) result(n)
      type(host_t), intent(in) :: host
      type(error_t), allocatable :: error

      call check_evaluated(host%face, "", error)
      n = merge(-1, host%face%active%set%n, allocated(error))
   end function host_selected

   !> How many unknowns the links have.
   pure integer function host_unknowns(host) result(n)
      type(host_t), intent(in) :: host

      n = merge(host%face%n_unknown, -1, host%face%is_prepared)
   end function host_unknowns

   !> An error if the host's array has not the extent that is needed.
   subroutine host_fit(name, actual, needed, error)
      character(len=*), intent(in) :: name       !! of the argument
      integer, intent(in) :: actual
      integer, intent(in) :: needed              !! < 0: any
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error) .or. actual == needed .or. needed < 0) return
      call raise(error, err_input, name // " is " // to_text(actual) // ", not " // to_text(needed))
   end subroutine host_fit

   !> A matrix in the host's arrays, rows and columns from 1: row i has the entries row(i) to
   !> row(i + 1) - 1. If there is too little room, `n_entry` tells how much is needed.
   subroutine host_put(matrix, row, column, value, n_entry, error)
      type(csr_t), intent(in) :: matrix
      integer(c_int), intent(out) :: row(:)      !! (n_row + 1)
      integer(c_int), intent(out) :: column(:)   !! (room)
      real(c_double), intent(out) :: value(:)    !! (room)
      integer(c_int), intent(out) :: n_entry
      type(error_t), allocatable, intent(inout) :: error

      row = 1
      call host_index(matrix, row, column, n_entry, error)
      if (allocated(error)) return
      value(:n_entry) = real(matrix%value(:n_entry), c_double)
   end subroutine host_put

   !> The same without values.
   subroutine host_index(matrix, row, column, n_entry, error)
      type(csr_t), intent(in) :: matrix
      integer(c_int), intent(inout) :: row(:)
      integer(c_int), intent(out) :: column(:)
      integer(c_int), intent(out) :: n_entry
      type(error_t), allocatable, intent(inout) :: error

      n_entry = 0
      if (allocated(error)) return
      n_entry = matrix%row_start(matrix%n_row + 1)
      if (size(row) < matrix%n_row + 1) then
         call raise(error, err_input, "there is room for " // to_text(size(row) - 1) // &
            " rows; the matrix has " // to_text(matrix%n_row))
      else if (size(column) < n_entry) then
         call raise(error, err_input, "there is room for " // to_text(size(column)) // &
            " entries; the matrix has " // to_text(n_entry))
      end if
      if (allocated(error)) return
      row(:matrix%n_row + 1) = matrix%row_start + 1
      row(matrix%n_row + 2:) = row(matrix%n_row + 1)
      column(:n_entry) = matrix%column(:n_entry) + 1
   end subroutine host_index

end module emcon_interface_handle
