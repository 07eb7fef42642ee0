!> A run that is made by calls, written down: results, log and verdict as of a run of the program.
module emcon_record
   use emcon_errors, only : error_t
   use emcon_files, only : file_remove
   use emcon_kinds, only : dp
   use emcon_log, only : log_close, log_line, log_lines, log_open, log_t
   use emcon_march, only : increment_t
   use emcon_recorder, only : recorder_close, recorder_finish, recorder_open, recorder_publish, &
      recorder_t, recorder_write
   use emcon_run_log, only : log_increment, log_start
   use emcon_stepper, only : stepper_t
   use emcon_text, only : notes_t, string_t, to_text
   use emcon_timer, only : wall_seconds
   use emcon_verdict, only : verdict_end, verdict_t
   use emcon_verdict_file, only : verdict_write
   use emcon_verdict_lines, only : verdict_balance_lines
   implicit none
   private
   public :: record_t, record_begin, record_increment, record_failure, record_end, record_drop

   type :: record_t
      character(len=:), allocatable :: base      !! of the names of the files
      type(recorder_t) :: recorder
      type(log_t) :: log
      real(dp) :: wall_start = 0.0_dp            !! [s]
   end type record_t

contains

   !> Begin the files `base`.vtkhdf, .h5, .csv and .log with the present state.
   subroutine record_begin(self, stepper, base, error)
      type(record_t), intent(out) :: self
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: base
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: ignored
      type(increment_t) :: nothing
      type(string_t), allocatable :: diagnostic(:)

      self%base = base
      self%wall_start = wall_seconds()
      call log_open(self%log, base // ".log", .false., error)
      if (.not. allocated(error)) call recorder_open(self%recorder, stepper, base, error)
      ! The verdict on an earlier run does not belong to the results that begin here.
      if (.not. allocated(error)) call file_remove(base // ".json", error)
      if (allocated(error)) then
         call log_close(self%log, ignored)
         return
      end if
      allocate(diagnostic(0))
      if (allocated(stepper%diagnostic)) diagnostic = stepper%diagnostic
      associate (source => stepper%source)
         call log_start(self%log, stepper, diagnostic, source%file_name(source%file(1))%text)
      end associate
      associate (state => stepper%march%state)
         if (state%clock%increment > 0) call log_line(self%log, "recorded from increment " // &
            to_text(state%clock%increment) // " on, time " // to_text(state%clock%time, 9))
      end associate
      call write_down(self, stepper, nothing, error)
   end subroutine record_begin

   !> Record the present state after `increment`. A failure ends the record.
   subroutine record_increment(self, stepper, increment, error)
      type(record_t), intent(inout) :: self
      type(stepper_t), intent(inout) :: stepper
      type(increment_t), intent(in) :: increment
      type(error_t), allocatable, intent(out) :: error

      call log_increment(self%log, stepper, increment)
      call write_down(self, stepper, increment, error)
   end subroutine record_increment

   !> A row, and what else is due. A failure ends the record.
   subroutine write_down(self, stepper, increment, error)
      type(record_t), intent(inout) :: self
      type(stepper_t), intent(inout) :: stepper
      type(increment_t), intent(in) :: increment
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: cpu

      call cpu_time(cpu)
      call recorder_write(self%recorder, stepper, increment, cpu, error)
      if (.not. allocated(error)) call recorder_publish(self%recorder, .false., error)
      if (.not. allocated(error)) return
      call log_line(self%log, error%message)
      call record_drop(self)
   end subroutine write_down

   !> Tell the log why an increment was not made.
   subroutine record_failure(self, text)
      type(record_t), intent(inout) :: self
      character(len=*), intent(in) :: text

      call log_line(self%log, text)
   end subroutine record_failure

   !> Complete the files, with the verdict on what led to this state.
   subroutine record_end(self, stepper, error)
      type(record_t), intent(inout) :: self
      type(stepper_t), intent(inout) :: stepper
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: second
      type(verdict_t) :: verdict
      type(notes_t) :: lines

      call recorder_finish(self%recorder, wall_seconds() - self%wall_start, 0.0_dp, 0.0_dp, error)
      call recorder_close(self%recorder, second)
      if (.not. allocated(error)) call move_alloc(second, error)
      verdict = stepper%verdict
      call verdict_end(verdict)
      call verdict_balance_lines(verdict, stepper%scene, stepper%march, lines)
      if (allocated(error)) call log_line(self%log, error%message)
      call log_lines(self%log, "warning: ", verdict%warnings)
      call log_lines(self%log, "", lines)
      if (.not. allocated(error)) call verdict_write(verdict, stepper%march, &
         self%base // ".json", '"recorded": true', error)
      call log_close(self%log, second)
      if (.not. allocated(error)) call move_alloc(second, error)
   end subroutine record_end

   !> Close the files as they are.
   subroutine record_drop(self)
      type(record_t), intent(inout) :: self
      type(error_t), allocatable :: ignored

      call recorder_close(self%recorder, ignored)
      call log_close(self%log, ignored)
   end subroutine record_drop

end module emcon_record
