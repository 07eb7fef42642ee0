!> The pieces of a profile: lines and arcs in its plane.
module emcon_profile_piece_plane
   use emcon_kinds, only : wp
   implicit none
   private
   public :: profile_piece_t

   !> A line or an arc of less than half a turn. The body is to the right of it.
   type :: profile_piece_t
      real(wp) :: from(2) = 0.0_wp               !! where it starts [L]
      real(wp) :: to(2) = 0.0_wp                 !! where it ends [L]
      real(wp) :: along(2) = 0.0_wp              !! its direction where it starts, of length 1
      real(wp) :: leaves(2) = 0.0_wp             !! its direction where it ends, of length 1
      real(wp) :: length = 0.0_wp                !! [L]
      !> 0: a line; 1: an arc that bulges out of the body; -1: into it
      real(wp) :: bulge = 0.0_wp
      real(wp) :: centre(2) = 0.0_wp             !! of an arc [L]
      real(wp) :: radius = 0.0_wp                !! of an arc [L]
   end type profile_piece_t

end module emcon_profile_piece_plane
