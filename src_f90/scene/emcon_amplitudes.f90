!> Factors over time.
module emcon_amplitudes
   use emcon_kinds, only : wp
   use emcon_origin, only : origin_t
   implicit none
   private
   public :: amplitude_t, find_amplitude_value

   !> Factor over time: linear between the points, constant outside.
   type :: amplitude_t
      character(len=:), allocatable :: name
      type(origin_t) :: origin
      logical :: is_total_time = .false.             !! else time since the start of the step
      real(wp), allocatable :: time(:)               !! ascending [T]
      real(wp), allocatable :: value(:)
   end type amplitude_t

contains

   !> Value and slope of an amplitude at `time`; at a kink the slope to the left.
   pure subroutine find_amplitude_value(amplitude, time, value, slope)
      type(amplitude_t), intent(in) :: amplitude
      real(wp), intent(in) :: time
      real(wp), intent(out) :: value                 !! factor
      real(wp), intent(out) :: slope                 !! [1/T]
      integer :: i, n

      n = size(amplitude%time)
      slope = 0.0_wp
      if (time <= amplitude%time(1)) then
         value = amplitude%value(1)
      else if (time > amplitude%time(n)) then
         value = amplitude%value(n)
      else
         i = count(amplitude%time < time)
         slope = (amplitude%value(i + 1) - amplitude%value(i)) &
            /(amplitude%time(i + 1) - amplitude%time(i))
         value = amplitude%value(i) + slope*(time - amplitude%time(i))
      end if
   end subroutine find_amplitude_value

end module emcon_amplitudes
