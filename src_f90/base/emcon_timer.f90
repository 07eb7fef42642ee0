!> Clocks: CPU time of the process and wall time, both in seconds.
module emcon_timer
   use emcon_kinds, only : dp, int64
   implicit none
   private
   public :: cpu_seconds, wall_seconds

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

end module emcon_timer
