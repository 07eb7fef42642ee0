!> Clocks: CPU time of the process and wall time, both in seconds, and a stopwatch.
module emcon_timer
   use emcon_kinds, only : dp, int64
   implicit none
   private
   public :: cpu_seconds, wall_seconds
   public :: stopwatch_t, stopwatch_start, stopwatch_stop

   !> Sums up the CPU time between starts and stops.
   type :: stopwatch_t
      real(dp) :: seconds = 0.0_dp
      real(dp) :: since = 0.0_dp
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

      self%since = cpu_seconds()
   end subroutine stopwatch_start

   subroutine stopwatch_stop(self)
      type(stopwatch_t), intent(inout) :: self

      self%seconds = self%seconds + (cpu_seconds() - self%since)
   end subroutine stopwatch_stop

end module emcon_timer
