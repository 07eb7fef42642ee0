!> Clocks: CPU time of the process and wall time, both in seconds, and a stopwatch.
module emcon_timer
   use emcon_kinds, only : dp, int64
   implicit none
   private
   public :: cpu_seconds, wall_seconds
   public :: stopwatch_t, stopwatch_start, stopwatch_stop

   !> Sums up the wall time between starts and stops, in ticks of the system's clock.
   type :: stopwatch_t
      integer(int64) :: ticks = 0
      integer(int64) :: since = 0
   end type stopwatch_t

contains

   !> CPU time of the process since its start [s].
   real(dp) function cpu_seconds()
      call cpu_time(cpu_seconds)
   end function cpu_seconds

   !> Wall time since an arbitrary start [s].
   real(dp) function wall_seconds()
      integer(int64) :: ticks, rate

      call system_clock(ticks, rate)
      wall_seconds = real(ticks, dp)/real(rate, dp)
   end function wall_seconds

   subroutine stopwatch_start(self)
      type(stopwatch_t), intent(inout) :: self

      call system_clock(self%since)
   end subroutine stopwatch_start

   subroutine stopwatch_stop(self)
      type(stopwatch_t), intent(inout) :: self
      integer(int64) :: now

      call system_clock(now)
      self%ticks = self%ticks + (now - self%since)
   end subroutine stopwatch_stop

end module emcon_timer
