!> Rotations in the plane.
module emcon_turn_plane
   use emcon_kinds, only : wp
   implicit none
   private
   public :: turn_arm, turn_of, turned_by, turned_left

   !> A whole turn.
   real(wp), parameter :: turn_of = 8.0_wp*atan(1.0_wp)

contains

   !> The vector turned left by a right angle.
   pure function turned_left(arm) result(left)
      real(wp), intent(in) :: arm(:)             !! (2)
      real(wp) :: left(size(arm))

      left(1) = -arm(2)
      left(2) = arm(1)
   end function turned_left

   !> How the end of `arm` moves as it turns by `angle`, and its rate by the angle. 1 - cos is
   !> computed as 2 sin^2 of half the angle.
   pure subroutine turn_arm(arm, angle, w, rate)
      real(wp), intent(in) :: arm(:)             !! (2) [L]
      real(wp), intent(in) :: angle              !! radians
      real(wp), intent(out) :: w(:)              !! (2) [L]
      real(wp), intent(out) :: rate(:)           !! (2) [L]

      w = sin(angle)*turned_left(arm) - 2.0_wp*sin(0.5_wp*angle)**2*arm
      rate = turned_left(arm + w)
   end subroutine turn_arm

   !> The angle from one vector to another, in a half turn to either side.
   pure real(wp) function turned_by(from, to) result(angle)
      real(wp), intent(in) :: from(:), to(:)     !! (2)

      angle = atan2(dot_product(turned_left(from), to), dot_product(from, to))
   end function turned_by

end module emcon_turn_plane
