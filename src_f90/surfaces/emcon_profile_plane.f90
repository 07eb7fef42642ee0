!> Where a point is beside a profile of lines and arcs in its plane: how far from it, and from which
!> of its pieces.
!>
!> In front, a piece has what lies between the normals at its ends; pieces that meet in a corner
!> have what is nearer to them. Source: docs/theory.md, section 14.1.
module emcon_profile_plane
   use emcon_kinds, only : wp
   use emcon_profile_piece_plane, only : profile_piece_t
   use emcon_wall, only : wall_t
   implicit none
   private
   public :: profile_place_t, profile_find, profile_value, profile_slope

   type :: profile_place_t
      integer :: piece = 0                       !! that is nearest
      real(wp) :: distance = 0.0_wp              !! > 0 out of the body [L]
      real(wp) :: past = 0.0_wp                  !! so far past an end with nothing beyond [L]
   end type profile_place_t

contains

   !> Where point `p` is.
   pure type(profile_place_t) function profile_find(wall, p) result(place)
      type(wall_t), intent(in) :: wall           !! with a profile
      real(wp), intent(in) :: p(2)               !! [L]
      real(wp) :: value, past(2), beyond, least, nearest
      integer :: k

      least = huge(least)
      nearest = huge(nearest)
      do k = 1, size(wall%piece)
         call find_past(wall%piece(k), p, past)
         beyond = max(0.0_wp, past(1), past(2))
         value = profile_value(wall%piece(k), p)
         if (beyond > least) cycle
         if (.not. beyond < least .and. abs(value) >= nearest) cycle
         least = beyond
         nearest = abs(value)
         place%piece = k
         place%distance = value
         place%past = 0.0_wp
         if (k == 1 .and. wall%is_open(1)) place%past = max(place%past, past(1))
         if (k == size(wall%piece) .and. wall%is_open(2)) place%past = max(place%past, past(2))
      end do
   end function profile_find

   !> How far a point is past the normal at the start of a piece, and at its end; < 0: between them.
   pure subroutine find_past(piece, p, past)
      type(profile_piece_t), intent(in) :: piece
      real(wp), intent(in) :: p(2)
      real(wp), intent(out) :: past(2)           !! [L]
      real(wp), parameter :: turn = 2.0_wp*acos(-1.0_wp)
      real(wp) :: angle, sweep

      if (.not. abs(piece%bulge) > 0.0_wp) then
         past(1) = -dot_product(piece%along, p - piece%from)
         past(2) = -past(1) - piece%length
         return
      end if
      associate (arm => p - piece%centre, first => piece%from - piece%centre)
         angle = atan2(piece%radius*dot_product(piece%along, arm), dot_product(first, arm))
      end associate
      sweep = piece%length/piece%radius
      ! Beside an arc, the end that is nearer.
      if (angle < 0.0_wp .and. angle + turn - sweep < -angle) angle = angle + turn
      if (angle > sweep .and. turn - angle < angle - sweep) angle = angle - turn
      past = piece%radius*[-angle, angle - sweep]
   end subroutine find_past

   !> The distance of `p` from the line or circle that a piece is a part of, > 0 out of the body.
   pure real(wp) function profile_value(piece, p) result(value)
      type(profile_piece_t), intent(in) :: piece
      real(wp), intent(in) :: p(2)               !! [L]

      if (abs(piece%bulge) > 0.0_wp) then
         value = piece%bulge*(length(p - piece%centre) - piece%radius)
      else
         value = dot_product(left_of(piece%along), p - piece%from)
      end if
   end function profile_value

   !> The slope of `profile_value`: away from the body.
   pure function profile_slope(piece, p) result(slope)
      type(profile_piece_t), intent(in) :: piece
      real(wp), intent(in) :: p(2)               !! [L]
      real(wp) :: slope(2)

      slope = left_of(piece%along)
      if (.not. abs(piece%bulge) > 0.0_wp) return
      associate (arm => p - piece%centre)
         if (length(arm) > 0.0_wp) slope = piece%bulge/length(arm)*arm
      end associate
   end function profile_slope

   pure function left_of(along)
      real(wp), intent(in) :: along(2)
      real(wp) :: left_of(2)

      left_of = [-along(2), along(1)]
   end function left_of

   pure real(wp) function length(a)
      real(wp), intent(in) :: a(2)

      length = sqrt(dot_product(a, a))
   end function length

end module emcon_profile_plane
