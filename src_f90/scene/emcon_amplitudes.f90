!> Factors over time.
module emcon_amplitudes
   use emcon_kinds, only : wp
   use emcon_origin, only : origin_t
   implicit none
   private
   public :: amplitude_t, amplitude_corners, find_amplitude_value

   !> Slopes that differ by no more than this, by the larger one, are one but for the rounding of
   !> the table.
   real(wp), parameter :: slope_noise = sqrt(epsilon(1.0_wp))
   !> Times that are sums and products of increments are those of the table up to this part.
   real(wp), parameter :: time_noise = 16.0_wp*epsilon(1.0_wp)

   !> Factor over time: linear or smooth between the points, constant outside.
   type :: amplitude_t
      character(len=:), allocatable :: name
      type(origin_t) :: origin
      logical :: is_total_time = .false.             !! else time since the start of the step
      !> Between two points by a polynomial of degree 5 whose slope and curvature are 0 at both;
      !> else by a line.
      logical :: is_smooth = .false.
      real(wp), allocatable :: time(:)               !! ascending [T]
      real(wp), allocatable :: value(:)
   end type amplitude_t

contains

   !> Value and slope of an amplitude at `time`; at a kink the slope to the left, however the time
   !> is rounded.
   pure subroutine find_amplitude_value(amplitude, time, value, slope)
      type(amplitude_t), intent(in) :: amplitude
      real(wp), intent(in) :: time
      real(wp), intent(out) :: value                 !! factor
      real(wp), intent(out) :: slope                 !! [1/T]
      real(wp) :: left
      integer :: i, n

      n = size(amplitude%time)
      slope = 0.0_wp
      left = time - time_noise*abs(time)
      if (left <= amplitude%time(1)) then
         value = amplitude%value(1)
      else if (left > amplitude%time(n)) then
         value = amplitude%value(n)
      else
         i = count(amplitude%time < left)
         slope = (amplitude%value(i + 1) - amplitude%value(i)) &
            /(amplitude%time(i + 1) - amplitude%time(i))
         if (amplitude%is_smooth) then
            call ease(amplitude, i, time, value, slope)
         else
            value = amplitude%value(i) + slope*(time - amplitude%time(i))
         end if
      end if
   end subroutine find_amplitude_value

   !> Value and slope between the points `i` and i + 1 of a smooth amplitude: with x from 0 to 1
   !> between them the change is times x**3 (10 - 15 x + 6 x**2), the slope 30 x**2 (1 - x)**2.
   pure subroutine ease(amplitude, i, time, value, slope)
      type(amplitude_t), intent(in) :: amplitude
      integer, intent(in) :: i
      real(wp), intent(in) :: time                   !! between them [T]
      real(wp), intent(out) :: value                 !! factor
      real(wp), intent(out) :: slope                 !! [1/T]
      real(wp) :: change, span, x

      change = amplitude%value(i + 1) - amplitude%value(i)
      span = amplitude%time(i + 1) - amplitude%time(i)
      x = min(max((time - amplitude%time(i))/span, 0.0_wp), 1.0_wp)
      value = amplitude%value(i) + change*(x**3*(10.0_wp - x*(15.0_wp - 6.0_wp*x)))
      slope = 30.0_wp*(x*(1.0_wp - x))**2*(change/span)
   end subroutine ease

   !> At which points of its table does an amplitude change its slope?
   pure function amplitude_corners(amplitude) result(is_bend)
      type(amplitude_t), intent(in) :: amplitude
      logical :: is_bend(size(amplitude%time))
      real(wp) :: slope(0:size(amplitude%time))
      integer :: i, n

      is_bend = .false.
      if (amplitude%is_smooth) return
      n = size(amplitude%time)
      slope = 0.0_wp
      do i = 1, n - 1
         slope(i) = (amplitude%value(i + 1) - amplitude%value(i)) &
            /(amplitude%time(i + 1) - amplitude%time(i))
      end do
      is_bend = abs(slope(1:) - slope(:n - 1)) > slope_noise*max(abs(slope(1:)), &
         abs(slope(:n - 1)))
   end function amplitude_corners

end module emcon_amplitudes
