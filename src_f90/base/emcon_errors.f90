!> Errors as values. An allocated `error_t` means failure; the caller returns or handles it.
module emcon_errors
   implicit none
   private
   public :: error_t, raise
   public :: err_none, err_input, err_analysis, err_file, err_internal, err_interrupt

   !> Codes equal the exit codes of the program (docs/deck.md).
   integer, parameter :: err_none = 0, err_input = 2, err_analysis = 3, err_file = 4
   !> A broken invariant: a bug of ours, whatever the input.
   integer, parameter :: err_internal = 5
   integer, parameter :: err_interrupt = 130

   !> What went wrong: the code, and a text that says what, where, the value, and what to do.
   type :: error_t
      integer :: code = err_none
      character(len=:), allocatable :: message
   end type error_t

contains

   !> Make `error` an error of class `code` with the text `message`.
   pure subroutine raise(error, code, message)
      type(error_t), allocatable, intent(out) :: error
      integer, intent(in) :: code                !! one of the `err_` codes
      character(len=*), intent(in) :: message

      allocate(error)
      error%code = code
      error%message = message
   end subroutine raise

end module emcon_errors
