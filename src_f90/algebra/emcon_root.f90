!> Roots of the quadratic that gives a quantity of motion the energy it has lost.
module emcon_root
   use emcon_kinds, only : wp
   implicit none
   private
   public :: smaller_root

contains

   !> The root s of smallest size of s b + s^2 a/2 = gain, without cancellation: docs/theory.md,
   !> eq. (22c).
   pure subroutine smaller_root(a, b, gain, s, has_root)
      real(wp), intent(in) :: a                  !! >= 0
      real(wp), intent(in) :: b
      real(wp), intent(in) :: gain
      real(wp), intent(out) :: s                 !! 0 if there is none
      logical, intent(out) :: has_root
      real(wp) :: square

      square = b*b + 2.0_wp*a*gain
      has_root = a > 0.0_wp .and. square >= 0.0_wp
      s = 0.0_wp
      if (has_root .and. abs(gain) > 0.0_wp) s = 2.0_wp*gain/(b + sign(sqrt(square), b))
   end subroutine smaller_root

end module emcon_root
