!> Models that other languages hold by their address.
!>
!> A model owns a stepper, the answers to what was asked last, and the text of the last failure;
!> nothing else keeps it, so that any number of models live side by side, each in a thread of its
!> own. NULL is no model. A model that was closed must not be used again: its owner forgets it.
module emcon_handle
   use, intrinsic :: iso_c_binding, only : c_associated, c_char, c_double, c_f_pointer, c_int, c_ptr
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_input, err_none, error_t
   use emcon_stepper, only : stepper_t
   use emcon_stepper_query, only : query_follow, query_t
   use emcon_stepper_report, only : contact_report_t
   implicit none
   private
   public :: model_t, find_model, find_read, find_built, handle_fail, handle_pass
   public :: at_mass, at_tangent, at_links, at_p, at_df, at_curvature, at_d, at_m

   !> Places of the matrices that a model was asked for.
   integer, parameter :: at_mass = 1, at_tangent = 2, at_links = 3, at_p = 4, at_df = 5, &
      at_curvature = 6, at_d = 7, at_m = 8

   type :: model_t
      type(stepper_t) :: stepper
      type(query_t) :: query
      type(csr_t) :: matrix(8)                   !! asked for last, each kind in its place
      type(contact_report_t) :: report           !! of the constraints asked for last
      character(len=:), allocatable :: message   !! of the last failure
      character(kind=c_char), allocatable :: c_text(:)   !! the same as C was given it
      character(len=:), allocatable :: verdict   !! asked for last
      character(kind=c_char), allocatable :: c_verdict(:), c_notes(:)
      integer(c_int), allocatable :: c_place(:, :)       !! the numbers in `report`, from 0
      real(c_double), allocatable :: c_gap(:, :)         !! the gaps in it
      integer(c_int), allocatable :: c_redundant(:)      !! of the last null space, from 0
   end type model_t

contains

   !> The model of a handle, with no answers to what was asked of other unknowns; null, and an
   !> error code, for NULL.
   subroutine find_model(handle, model, ierr)
      type(c_ptr), intent(in) :: handle
      type(model_t), pointer, intent(out) :: model
      integer(c_int), intent(out) :: ierr

      model => null()
      ierr = err_input
      if (.not. c_associated(handle)) return
      call c_f_pointer(handle, model)
      call query_follow(model%query, model%stepper)
      ierr = err_none
   end subroutine find_model

   !> The same for a model whose scene is complete.
   subroutine find_read(handle, model, ierr)
      type(c_ptr), intent(in) :: handle
      type(model_t), pointer, intent(out) :: model
      integer(c_int), intent(out) :: ierr

      call find_model(handle, model, ierr)
      if (ierr /= err_none) return
      if (.not. model%stepper%is_read) call handle_fail(model, &
         "there is no scene: reading the deck or building its model failed", err_input, ierr)
   end subroutine find_read

   !> The same for a model that was built.
   subroutine find_built(handle, model, ierr)
      type(c_ptr), intent(in) :: handle
      type(model_t), pointer, intent(out) :: model
      integer(c_int), intent(out) :: ierr

      call find_read(handle, model, ierr)
      if (ierr /= err_none) return
      if (.not. allocated(model%stepper%march%scheme)) call handle_fail(model, &
         "the model is not built yet: call emcon_build", err_input, ierr)
   end subroutine find_built

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
