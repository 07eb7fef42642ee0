!> Results of a model that is stepped by calls: fields to be had at once, and the files of a run.
module emcon_model_record
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : dp
   use emcon_march, only : increment_t
   use emcon_model, only : model_t
   use emcon_quantities, only : quantity_of_field, quantity_variables
   use emcon_recorder, only : recorder_close, recorder_finish, recorder_open, recorder_publish, &
      recorder_write
   use emcon_text, only : nearest_word, string_t, to_upper
   use emcon_timer, only : wall_seconds
   use emcon_verdict, only : verdict_end, verdict_t
   use emcon_verdict_file, only : verdict_write
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
      if (len(near) == 0) near = "U, V, RF, S, E, ENER, CDIS, CSTR, CF, CSHEAR or CSLIP"
      call raise(error, err_input, "there is no variable '" // name // "'; did you mean " // &
         near // "?")
   end subroutine model_field

   !> Begin the files of a run with the present state.
   subroutine model_record(model, base, error)
      type(model_t), intent(inout) :: model
      character(len=*), intent(in) :: base       !! of their names
      type(error_t), allocatable, intent(out) :: error
      type(increment_t) :: nothing

      if (allocated(model%recorder)) then
         call raise(error, err_input, "the run is recorded already, into " // model%base // &
            ".*: end that first")
      else if (size(model%stepper%scene%step) == 0) then
         call raise(error, err_input, "a model of a host has no run that could be recorded")
      end if
      if (allocated(error)) return
      model%base = base
      model%wall_start = wall_seconds()
      allocate(model%recorder)
      call recorder_open(model%recorder, model%stepper, base, error)
      if (allocated(error)) then
         deallocate(model%recorder)
      else
         call model_keep(model, nothing, error)
      end if
   end subroutine model_record

   !> Record the present state after `increment`, if that is asked for. A failure ends the record.
   subroutine model_keep(model, increment, error)
      type(model_t), intent(inout) :: model
      type(increment_t), intent(in) :: increment
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: second
      real(dp) :: cpu

      if (allocated(error) .or. .not. allocated(model%recorder)) return
      call cpu_time(cpu)
      call recorder_write(model%recorder, model%stepper, increment, cpu, error)
      if (.not. allocated(error)) call recorder_publish(model%recorder, .false., error)
      if (.not. allocated(error)) return
      call recorder_close(model%recorder, second)
      deallocate(model%recorder)
   end subroutine model_keep

   !> Complete the files, and write the verdict on what led to this state.
   subroutine model_end_record(model, error)
      type(model_t), intent(inout) :: model
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: second
      type(verdict_t) :: verdict

      if (.not. allocated(model%recorder)) return
      call recorder_finish(model%recorder, wall_seconds() - model%wall_start, 0.0_dp, 0.0_dp, error)
      call recorder_close(model%recorder, second)
      deallocate(model%recorder)
      if (.not. allocated(error)) call move_alloc(second, error)
      if (allocated(error)) return
      verdict = model%stepper%verdict
      call verdict_end(verdict)
      call verdict_write(verdict, model%stepper%march, model%base // ".json", &
         '"recorded": true', error)
   end subroutine model_end_record

end module emcon_model_record
