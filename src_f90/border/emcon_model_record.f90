!> Results of a model that is stepped by calls: fields to be had at once, and the files of a run.
module emcon_model_record
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : dp
   use emcon_march, only : increment_t
   use emcon_model, only : model_t
   use emcon_quantities, only : quantity_of_field, quantity_variables
   use emcon_record, only : record_begin, record_end, record_failure, record_increment
   use emcon_text, only : nearest_word, string_t, to_upper
   implicit none
   private
   public :: model_field, model_record, model_end_record, model_keep

contains

   !> The values of a variable of decks, (component, node or element).
   subroutine model_field(model, name, value, error)
      type(model_t), intent(inout) :: model
      character(len=*), intent(in) :: name
      real(dp), allocatable, intent(out) :: value(:, :)
      type(error_t), allocatable, intent(out) :: error
      type(string_t), allocatable :: known(:)
      character(len=:), allocatable :: near, upper
      integer :: k

      allocate(value(0, 0))
      upper = to_upper(name)
      allocate(known, source=quantity_variables())
      do k = 1, size(known)
         if (known(k)%text == upper) exit
      end do
      if (k <= size(known)) then
         value = quantity_of_field(model%stepper, upper)
         return
      end if
      call nearest_word(upper, known, near)
      if (len(near) == 0) then
         do k = 1, size(known)
            if (k > 1 .and. k < size(known)) near = near // ", "
            if (k == size(known)) near = near // " or "
            near = near // known(k)%text
         end do
      end if
      call raise(error, err_input, "there is no variable '" // name // "'; did you mean " // &
         near // "?")
   end subroutine model_field

   !> Begin the files of a run with the present state.
   subroutine model_record(model, base, error)
      type(model_t), intent(inout) :: model
      character(len=*), intent(in) :: base       !! of their names
      type(error_t), allocatable, intent(out) :: error

      if (allocated(model%record)) then
         call raise(error, err_input, "the run is recorded already, into " // &
            model%record%base // ".*: end that first")
      else if (size(model%stepper%scene%step) == 0) then
         call raise(error, err_input, "a model of a host has no run that could be recorded")
      end if
      if (allocated(error)) return
      allocate(model%record)
      call record_begin(model%record, model%stepper, base, error)
      if (allocated(error)) deallocate(model%record)
   end subroutine model_record

   !> Record the present state after `increment`, or why there was none, if that is asked for. A
   !> failure to write ends the record.
   subroutine model_keep(model, increment, error)
      type(model_t), intent(inout) :: model
      type(increment_t), intent(in) :: increment
      type(error_t), allocatable, intent(inout) :: error

      if (.not. allocated(model%record)) return
      if (allocated(error)) then
         call record_failure(model%record, error%message)
         return
      end if
      call record_increment(model%record, model%stepper, increment, error)
      if (allocated(error)) deallocate(model%record)
   end subroutine model_keep

   !> Complete the files, and write the verdict on what led to this state.
   subroutine model_end_record(model, error)
      type(model_t), intent(inout) :: model
      type(error_t), allocatable, intent(out) :: error

      if (.not. allocated(model%record)) return
      call record_end(model%record, model%stepper, error)
      deallocate(model%record)
   end subroutine model_end_record

end module emcon_model_record
