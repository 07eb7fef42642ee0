!> The moment of a force in the plane.
module emcon_moment_plane
   use emcon_kinds, only : wp
   implicit none
   private
   public :: moment_of

contains

   !> The moment about the origin of what acts at `place`; of a momentum: the angular momentum.
   pure real(wp) function moment_of(place, force) result(moment)
      real(wp), intent(in) :: place(:)           !! (2) [L]
      real(wp), intent(in) :: force(:)           !! (2) [M L/T^2], or momentum [M L/T]

      moment = place(1)*force(2) - place(2)*force(1)
   end function moment_of

end module emcon_moment_plane
