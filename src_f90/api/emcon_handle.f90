!> Handles: models that other languages hold by their address.
!>
!> A handle owns a stepper and the text of its last failure; nothing else keeps it, so that any
!> number of models live side by side, each in a thread of its own. 0 is no model. A handle that
!> was closed must not be used again: its owner forgets it.
module emcon_handle
   use, intrinsic :: iso_c_binding, only : c_f_pointer, c_int, c_int64_t, c_loc, c_null_ptr, c_ptr
   use emcon_errors, only : err_input, err_none, error_t
   use emcon_stepper, only : stepper_close, stepper_t
   implicit none
   private
   public :: model_t, handle_new, handle_free, handle_find, handle_fail, handle_pass

   type :: model_t
      type(stepper_t) :: stepper
      character(len=:), allocatable :: message   !! of the last failure
   end type model_t

contains

   !> A new model without contents.
   integer(c_int64_t) function handle_new()
      type(model_t), pointer :: model

      allocate(model)
      model%message = ""
      handle_new = transfer(c_loc(model), handle_new)
   end function handle_new

   !> Free a model; harmless for 0.
   subroutine handle_free(handle)
      integer(c_int64_t), intent(in) :: handle
      type(model_t), pointer :: model

      call handle_find(handle, model)
      if (.not. associated(model)) return
      call stepper_close(model%stepper)
      deallocate(model)
   end subroutine handle_free

   !> The model of a handle; null for 0.
   subroutine handle_find(handle, model)
      integer(c_int64_t), intent(in) :: handle
      type(model_t), pointer, intent(out) :: model
      type(c_ptr) :: address

      model => null()
      if (handle == 0) return
      address = transfer(handle, c_null_ptr)
      call c_f_pointer(address, model)
   end subroutine handle_find

   !> Keep the text of a failure and hand on its code.
   subroutine handle_fail(model, text, code, ierr)
      type(model_t), intent(inout) :: model
      character(len=*), intent(in) :: text
      integer, intent(in) :: code
      integer(c_int), intent(out) :: ierr

      model%message = text
      ierr = code
   end subroutine handle_fail

   !> The same for an error, if there is one; else success.
   subroutine handle_pass(model, error, ierr)
      type(model_t), intent(inout) :: model
      type(error_t), allocatable, intent(in) :: error
      integer(c_int), intent(out) :: ierr

      ierr = err_none
      if (allocated(error)) call handle_fail(model, error%message, error%code, ierr)
   end subroutine handle_pass

end module emcon_handle
