!> The profile of a wall: lines and arcs as they are, and what a wall can be made of.
module emcon_deck_wall_profile_plane
   use emcon_deck_reader, only : card_error, card_t, reader_t
   use emcon_deck_segment_lines_plane, only : rounding
   use emcon_kinds, only : wp
   use emcon_profile_fillet_plane, only : segment_t
   use emcon_profile_piece_plane, only : profile_piece_t
   use emcon_text, only : to_text
   use emcon_wall, only : wall_t, wall_turned
   implicit none
   private
   public :: profile_finish

   !> Pieces that turn towards the outside by less are smooth [rad]: data lines have few digits.
   real(wp), parameter :: smooth = 1.0e-3_wp

contains

   !> The pieces of a profile.
   pure function profile_pieces(segment) result(piece)
      type(segment_t), intent(in) :: segment(:)    !! (n > 1) the first one is where it begins
      type(profile_piece_t) :: piece(size(segment) - 1)
      integer :: i

      do i = 1, size(piece)
         piece(i)%from = segment(i)%to
         piece(i)%to = segment(i + 1)%to
         if (segment(i + 1)%is_arc) then
            call make_arc(segment(i + 1)%centre, piece(i))
         else
            piece(i)%length = norm2(piece(i)%to - piece(i)%from)
            piece(i)%along = (piece(i)%to - piece(i)%from)/piece(i)%length
            piece(i)%leaves = piece(i)%along
         end if
      end do
   end function profile_pieces

   !> The shorter arc. Its centre is as far from both ends as digits go, and stays on an axis.
   pure subroutine make_arc(centre, new)
      real(wp), intent(in) :: centre(2)            !! [L]
      type(profile_piece_t), intent(inout) :: new  !! its ends are there
      real(wp) :: angle, way(2), middle(2)

      angle = atan2((new%from(1) - centre(1))*(new%to(2) - centre(2)) - (new%from(2) - centre(2)) &
         *(new%to(1) - centre(1)), dot_product(new%from - centre, new%to - centre))
      middle = 0.5_wp*(new%from + new%to)
      way = new%to - new%from
      if (abs(centre(1)) > 0.0_wp .or. .not. abs(way(2)) > rounding*norm2(way)) then
         new%centre = centre - dot_product(centre - middle, way)/dot_product(way, way)*way
         if (.not. abs(centre(1)) > 0.0_wp) new%centre(1) = 0.0_wp
      else
         new%centre = [0.0_wp, middle(2) + middle(1)*way(1)/way(2)]
      end if
      new%radius = norm2(new%from - new%centre)
      new%bulge = -sign(1.0_wp, angle)
      new%length = abs(angle)*new%radius
      new%along = new%bulge*across(new%from - new%centre)/new%radius
      new%leaves = new%bulge*across(new%to - new%centre)/norm2(new%to - new%centre)
   end subroutine make_arc

   !> To the right of `a`.
   pure function across(a)
      real(wp), intent(in) :: a(2)
      real(wp) :: across(2)

      across = [a(2), -a(1)]
   end function across

   !> The profile into `wall`, of a kind; refused where a node would need two contacts at once, or
   !> where it is beyond its axis.
   subroutine profile_finish(segment, reader, card, wall)
      type(segment_t), intent(in) :: segment(:)    !! (n > 1) the first one is where it begins
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(wall_t), intent(inout) :: wall
      type(profile_piece_t), allocatable :: piece(:)
      logical :: is_on_axis(2)
      integer :: k, n

      allocate(piece, source=profile_pieces(segment))
      n = size(piece)
      wall%extent = norm2([(maxval([piece%from(k), piece%to(k)]) &
         - minval([piece%from(k), piece%to(k)]), k = 1, 2)])
      wall%is_ring = norm2(piece(n)%to - piece(1)%from) <= rounding*wall%extent
      is_on_axis = .false.
      if (wall%kind == wall_turned) then
         call check_axis(piece, reader, card, rounding*wall%extent)
         is_on_axis = abs([piece(1)%from(1), piece(n)%to(1)]) <= rounding*wall%extent
         if (any(is_on_axis)) wall%is_ring = .false.
         if (is_on_axis(1) .and. piece(1)%along(2) > smooth) call tell(piece(1)%from)
         if (is_on_axis(2) .and. piece(n)%leaves(2) > smooth) call tell(piece(n)%to)
      end if
      wall%is_open = .not. (wall%is_ring .or. is_on_axis)
      do k = 1, n
         if (k == n .and. .not. wall%is_ring) exit
         associate (one => piece(k)%leaves, next => piece(1 + mod(k, n))%along)
            if (one(1)*next(2) - one(2)*next(1) > smooth .or. dot_product(one, next) < smooth - &
               1.0_wp) call tell(piece(k)%to)
         end associate
      end do
      call move_alloc(piece, wall%piece)

   contains

      subroutine tell(at)
         real(wp), intent(in) :: at(2)

         call card_error(reader, card, "the profile has a concave corner at " // to_text(at(1)) // &
            ", " // to_text(at(2)) // ", where a node would have two contacts with one surface; " &
            // "put an arc (CIRCL, or FILLET RADIUS=) into it, or make two surfaces of it")
      end subroutine tell

   end subroutine profile_finish

   !> No part of a profile that is turned is on the other side of the axis.
   subroutine check_axis(piece, reader, card, noise)
      type(profile_piece_t), intent(in) :: piece(:)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      real(wp), intent(in) :: noise                !! [L]
      real(wp) :: least
      integer :: k

      do k = 1, size(piece)
         associate (p => piece(k))
            least = min(p%from(1), p%to(1))
            ! An arc may go farther than its ends.
            if (abs(p%bulge) > 0.0_wp .and. p%along(1) < 0.0_wp .and. p%leaves(1) > 0.0_wp) then
               least = min(least, p%centre(1) - p%radius)
            end if
            if (least < -noise) call card_error(reader, card, "the profile has radii below 0, " &
               // to_text(least) // " in its part number " // to_text(k))
         end associate
      end do
   end subroutine check_axis

end module emcon_deck_wall_profile_plane
