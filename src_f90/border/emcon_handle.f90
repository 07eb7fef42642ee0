!> Handles: models that other languages hold by their address.
!>
!> A handle owns a stepper, the answers to what was asked last, and the text of the last failure;
!> nothing else keeps it, so that any number of models live side by side, each in a thread of its
!> own. 0 is no model. A handle that was closed must not be used again: its owner forgets it.
module emcon_handle
   use, intrinsic :: iso_c_binding, only : c_char, c_double, c_f_pointer, c_int, c_int64_t, &
      c_loc, c_null_ptr, c_ptr
   use emcon_csr, only : csr_t
   use emcon_deck_source, only : passage_t
   use emcon_errors, only : err_input, err_none, error_t
   use emcon_stepper, only : stepper_build, stepper_close, stepper_read, stepper_read_text, &
      stepper_t
   use emcon_stepper_contact, only : contact_report_t
   use emcon_stepper_query, only : query_follow, query_free, query_t
   use emcon_text, only : string_t
   implicit none
   private
   public :: model_t, handle_new, handle_free, handle_find, handle_fail, handle_pass
   public :: handle_read, handle_read_text, handle_read_passages, handle_build
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

   !> A new model without contents.
   integer(c_int64_t) function handle_new()
      type(model_t), pointer :: model

      allocate(model)
      model%message = ""
      handle_new = transfer(c_loc(model), handle_new)
   end function handle_new

   !> Read a deck into a new model. `parameters`: NAME=VALUE, one per line. After a failure the
   !> message holds all that is wrong with the deck, one per line.
   subroutine handle_read(handle, path, parameters, is_lenient, ierr)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: path, parameters
      logical, intent(in) :: is_lenient
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call stepper_read(model%stepper, trim(path), lines_of(parameters), is_lenient, error)
      call handle_pass(model, error, ierr)
      if (allocated(error)) call add_diagnostics(model, error%message)
   end subroutine handle_read

   !> The same for the text of a deck; messages call it `name` and count its lines from 1.
   subroutine handle_read_text(handle, text, name, parameters, is_lenient, ierr)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: text, name, parameters
      logical, intent(in) :: is_lenient
      integer(c_int), intent(out) :: ierr

      call handle_read_passages(handle, text, [passage_t()], name, parameters, is_lenient, ierr)
   end subroutine handle_read_text

   !> The same for a text whose lines stand in several files. `names`: one file per line.
   subroutine handle_read_passages(handle, text, passage, names, parameters, is_lenient, ierr)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: text, names, parameters
      type(passage_t), intent(in) :: passage(:)
      logical, intent(in) :: is_lenient
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call stepper_read_text(model%stepper, text, passage, lines_of(names), &
         lines_of(parameters), is_lenient, error)
      call handle_pass(model, error, ierr)
      if (allocated(error)) call add_diagnostics(model, error%message)
   end subroutine handle_read_passages

   !> Append what else is wrong with the deck to the message.
   subroutine add_diagnostics(model, first)
      type(model_t), intent(inout) :: model
      character(len=*), intent(in) :: first          !! is there already
      integer :: i

      if (.not. allocated(model%stepper%diagnostic)) return
      associate (text => model%stepper%diagnostic)
         do i = 1, size(text)
            if (text(i)%text /= first) model%message = model%message // new_line("a") // &
               text(i)%text
         end do
      end associate
   end subroutine add_diagnostics

   !> Build the model of the deck that was read.
   subroutine handle_build(handle, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call stepper_build(model%stepper, error)
      call handle_pass(model, error, ierr)
   end subroutine handle_build

   !> The lines of a text.
   function lines_of(text) result(line)
      character(len=*), intent(in) :: text
      type(string_t), allocatable :: line(:)
      type(string_t) :: new(1)
      integer :: first, last

      allocate(line(0))
      first = 1
      do while (first <= len_trim(text))
         last = index(text(first:), new_line("a"))
         if (last == 0) last = len_trim(text) - first + 2
         new(1)%text = text(first:first + last - 2)
         line = [line, new]
         first = first + last
      end do
   end function lines_of

   !> Free a model; harmless for 0.
   subroutine handle_free(handle)
      integer(c_int64_t), intent(in) :: handle
      type(model_t), pointer :: model
      integer(c_int) :: ierr

      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call query_free(model%query)
      call stepper_close(model%stepper)
      deallocate(model)
   end subroutine handle_free

   !> The model of a handle, with no answers to what was asked of other unknowns; null, and an
   !> error code, for 0.
   subroutine handle_find(handle, model, ierr)
      integer(c_int64_t), intent(in) :: handle
      type(model_t), pointer, intent(out) :: model
      integer(c_int), intent(out) :: ierr
      type(c_ptr) :: address

      model => null()
      ierr = err_input
      if (handle == 0) return
      address = transfer(handle, c_null_ptr)
      call c_f_pointer(address, model)
      call query_follow(model%query, model%stepper)
      ierr = err_none
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
