!> Walls: surfaces in space with a shape of their own, without faces and without edges.
!>
!> A wall moves with nodes of its own: its origin, and the tips of vectors that are normal to each
!> other. Profiles are read in the plane of two numbers: in one that is turned about the first
!> vector, the distance from that axis and the place along it; in one that is drawn along the third
!> vector, the places along the first and the second one.
module emcon_wall
   use emcon_kinds, only : wp
   use emcon_profile_piece_plane, only : profile_piece_t
   implicit none
   private
   public :: wall_t, wall_breadth

   !> A plane through the origin, its normal the first vector; a sphere about the origin; a profile
   !> that is turned about the first vector; one that is drawn along the third vector.
   integer, parameter, public :: wall_flat = 1, wall_round = 2, wall_turned = 3, wall_drawn = 4

   !> A profile starts and ends.
   integer, parameter :: n_end = 2

   type :: wall_t
      integer :: kind = 0                        !! one of the above
      integer :: node(4) = 0                     !! origin, and the tips of the vectors
      real(wp) :: arm = 0.0_wp                   !! length of the vectors [L]
      real(wp) :: extent = 0.0_wp                !! of the shape, or of the mesh [L]
      !> Of a sphere: its radius [L], and 1, or -1 where bodies are inside of it.
      real(wp) :: radius = 0.0_wp
      real(wp) :: bulge = 1.0_wp
      type(profile_piece_t), allocatable :: piece(:)   !! of a profile, in turn
      logical :: is_open(n_end) = .false.        !! nothing is beyond its start, its end
      logical :: is_ring = .false.               !! its end is its start
   end type wall_t

contains

   !> How wide a wall is at least that bodies are outside of, by its profile: the diameter of a
   !> sphere or of what is turned, the size of a profile that is drawn; huge of a plane and of a
   !> sphere that bodies are inside of [L].
   pure real(wp) function wall_breadth(self) result(breadth)
      type(wall_t), intent(in) :: self
      integer :: k

      breadth = huge(breadth)
      select case (self%kind)
      case (wall_round)
         if (self%bulge > 0.0_wp) breadth = 2.0_wp*self%radius
      case (wall_turned)
         breadth = 2.0_wp*maxval([(max(self%piece(k)%from(1), self%piece(k)%to(1)), &
            k = 1, size(self%piece))])
      case (wall_drawn)
         breadth = self%extent
      end select
   end function wall_breadth

end module emcon_wall
