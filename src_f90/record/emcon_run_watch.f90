!> What a run says while an increment takes long: every few seconds how far its parts have come.
module emcon_run_watch
   use emcon_kinds, only : dp, wp
   use emcon_log, only : log_line, log_t
   use emcon_march_types, only : watcher_t
   use emcon_progress, only : plain_interval, progress_say, progress_t
   use emcon_text, only : to_text
   use emcon_timer, only : wall_seconds
   implicit none
   private
   public :: run_watch_t

   type, extends(watcher_t) :: run_watch_t
      type(progress_t), pointer :: progress => null()
      type(log_t), pointer :: log => null()
      integer :: increment = 0                   !! that was told of last
      real(dp) :: time_told = 0.0_dp             !! or begun, wall clock [s]
   contains
      procedure :: tell => run_watch_tell
   end type run_watch_t

contains

   subroutine run_watch_tell(self, increment, time, n_part, h_least)
      class(run_watch_t), intent(inout) :: self
      integer, intent(in) :: increment
      real(wp), intent(in) :: time               !! [T]
      integer, intent(in) :: n_part              !! tried so far
      real(wp), intent(in) :: h_least            !! [T]
      character(len=:), allocatable :: text
      real(dp) :: now

      now = wall_seconds()
      if (increment /= self%increment) self%time_told = now
      self%increment = increment
      if (now - self%time_told < plain_interval) return
      self%time_told = now
      text = "increment " // to_text(increment) // " at time " // to_text(time, 9) // ": " // &
         to_text(n_part) // " parts so far, the smallest h = " // to_text(h_least)
      call progress_say(self%progress, text)
      call log_line(self%log, text)
   end subroutine run_watch_tell

end module emcon_run_watch
