! build: holder
!> Models that other languages hold by their address.
!>
!> A model owns a stepper, the answers to what was asked last, and the text of the last failure;
!> nothing else keeps it, so that any number of models live side by side, each in a thread of its
!> own. NULL is no model. A model that was closed must not be used again: its owner forgets it.
module emcon_model
   use, intrinsic :: iso_c_binding, only : c_associated, c_char, c_double, c_f_pointer, c_int, &
      c_loc, c_ptr
   use emcon_c_types, only : sizes_c
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_input, err_none, error_t
   use emcon_record, only : record_t
   use emcon_rotation, only : n_turn
   use emcon_stepper, only : stepper_t
   use emcon_stepper_query, only : query_follow, query_t
   use emcon_stepper_report, only : contact_report_t
   implicit none
   private
   public :: model_t, new_handle, find_model, find_read, find_built, handle_fail, handle_pass
   public :: code_of, model_sizes

   !> A text as C has it.
   type :: c_text_t
      character(kind=c_char), allocatable :: c(:)
   end type c_text_t

   type :: model_t
      type(stepper_t) :: stepper
      type(query_t) :: query
      character(len=:), allocatable :: message           !! of the last failure
      type(c_text_t) :: c_message                        !! the same as C was given it
      type(contact_report_t) :: report                   !! of the constraints asked for last
      integer(c_int), allocatable :: c_place(:, :)       !! the numbers in `report`, from 0
      real(c_double), allocatable :: c_gap(:, :)         !! the gaps in it
      integer(c_int), allocatable :: c_redundant(:)      !! of the last null space, from 0
      type(csr_t) :: p, df                               !! of the last null space
      type(csr_t) :: matrix(7)                           !! asked for last, each kind in its place
      type(c_text_t) :: text(4)                          !! likewise
      real(c_double), allocatable :: c_field(:, :)       !! asked for last
      type(record_t), allocatable :: record              !! of a run that is written down
   end type model_t

contains

   !> Put a new model into a place of C; null, and an error code, if there is no such place.
   subroutine new_handle(place, model, ierr)
      type(c_ptr), intent(in) :: place
      type(model_t), pointer, intent(out) :: model
      integer(c_int), intent(out) :: ierr
      type(c_ptr), pointer :: handle

      model => null()
      ierr = err_input
      if (.not. c_associated(place)) return
      call c_f_pointer(place, handle)
      allocate(model)
      model%message = ""
      handle = c_loc(model)
      ierr = err_none
   end subroutine new_handle

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

      ierr = code_of(error)
      if (allocated(error)) model%message = error%message
   end subroutine handle_pass

   !> What C is told of an error.
   pure integer(c_int) function code_of(error)
      type(error_t), allocatable, intent(in) :: error

      code_of = err_none
      if (allocated(error)) code_of = error%code
   end function code_of

   !> How much there is of what; before the model is built 0 of what building makes.
   pure subroutine model_sizes(model, sizes)
      type(model_t), intent(in) :: model
      type(sizes_c), intent(out) :: sizes

      associate (scene => model%stepper%scene)
         sizes%n_node = size(scene%x, 2)
         sizes%n_element = size(scene%element%label)
         sizes%n_step = size(scene%step)
         sizes%n_surface = size(scene%surface)
         sizes%n_tie = size(scene%tie)
         sizes%n_dim = scene%n_dim
         sizes%n_slip = scene%n_dim - 1
         sizes%n_momentum = scene%n_dim + n_turn(scene%n_dim)
         sizes%n_pair_total = 2*sizes%n_momentum + 1
      end associate
      sizes%n_selected = model%query%march%active%set%n_row
      if (.not. allocated(model%stepper%march%scheme)) return
      associate (system => model%stepper%march%system)
         sizes%n_contact = system%n_constraint - system%first_constraint(1)
         sizes%n_pair = system%n_pair
         sizes%n_body = system%space%n_body
         sizes%n_unknown = system%space%numbering%n_unknown
         sizes%n_constraint = system%n_constraint
         sizes%i_step = model%stepper%march%state%clock%i_step
         sizes%n_load = size(model%stepper%scene%step(sizes%i_step)%load)
      end associate
   end subroutine model_sizes

end module emcon_model
