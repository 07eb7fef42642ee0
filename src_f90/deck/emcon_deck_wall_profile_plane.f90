!> The profile of a wall: lines and arcs as they are, and what a wall can be made of.
module emcon_deck_wall_profile_plane
   use emcon_deck_fields, only : data_error, data_t
   use emcon_deck_reader, only : card_error, card_t, reader_t
   use emcon_deck_segment_lines_plane, only : check_arc, get_segment, rounding
   use emcon_kinds, only : wp
   use emcon_profile_piece_plane, only : profile_piece_t
   use emcon_text, only : to_text
   use emcon_wall, only : wall_t, wall_turned
   implicit none
   private
   public :: profile_builder_t, profile_add, profile_finish

   !> Pieces that turn towards the outside by less are smooth [rad]: data lines have few digits.
   real(wp), parameter :: smooth = 1.0e-3_wp

   !> A profile while it grows.
   type :: profile_builder_t
      logical :: has_start = .false.
      real(wp) :: last(2) = 0.0_wp                 !! where it ends so far [L]
      type(profile_piece_t), allocatable :: piece(:)
   end type profile_builder_t

contains

   !> Add what a data line says; `data%ok` is false if it is refused.
   subroutine profile_add(self, reader, data)
      type(profile_builder_t), intent(inout) :: self
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(profile_piece_t) :: new
      real(wp) :: x(4)
      logical :: is_arc

      if (.not. allocated(self%piece)) allocate(self%piece(0))
      call get_segment(reader, data, .not. self%has_start, is_arc, x)
      if (.not. data%ok) return
      if (self%has_start) then
         new%from = self%last
         new%to = x(1:2)
         if (is_arc) then
            call make_arc(reader, data, x(3:4), new)
         else
            call make_line(reader, data, new)
         end if
         if (.not. data%ok) return
         self%piece = [self%piece, new]
      end if
      self%has_start = .true.
      self%last = x(1:2)
   end subroutine profile_add

   subroutine make_line(reader, data, new)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(profile_piece_t), intent(inout) :: new

      new%length = norm2(new%to - new%from)
      if (.not. new%length > 0.0_wp) then
         call data_error(reader, data, "the line has no length")
         return
      end if
      new%along = (new%to - new%from)/new%length
      new%leaves = new%along
   end subroutine make_line

   !> The shorter arc. Its centre is as far from both ends as digits go, and stays on an axis.
   subroutine make_arc(reader, data, centre, new)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      real(wp), intent(in) :: centre(2)
      type(profile_piece_t), intent(inout) :: new
      real(wp) :: angle, way(2), middle(2)

      call check_arc(reader, data, new%from - centre, new%to - centre, angle)
      if (.not. data%ok) return
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
   subroutine profile_finish(self, reader, card, wall)
      type(profile_builder_t), intent(inout) :: self
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(wall_t), intent(inout) :: wall
      logical :: is_on_axis(2)
      integer :: k, n

      n = size(self%piece)
      wall%extent = norm2([(maxval([self%piece%from(k), self%piece%to(k)]) &
         - minval([self%piece%from(k), self%piece%to(k)]), k = 1, 2)])
      wall%is_ring = norm2(self%piece(n)%to - self%piece(1)%from) <= rounding*wall%extent
      is_on_axis = .false.
      if (wall%kind == wall_turned) then
         call check_axis(self%piece, reader, card, rounding*wall%extent)
         is_on_axis = abs([self%piece(1)%from(1), self%piece(n)%to(1)]) <= rounding*wall%extent
         if (any(is_on_axis)) wall%is_ring = .false.
         if (is_on_axis(1) .and. self%piece(1)%along(2) > smooth) call tell(self%piece(1)%from)
         if (is_on_axis(2) .and. self%piece(n)%leaves(2) > smooth) call tell(self%piece(n)%to)
      end if
      wall%is_open = .not. (wall%is_ring .or. is_on_axis)
      do k = 1, n
         if (k == n .and. .not. wall%is_ring) exit
         associate (one => self%piece(k)%leaves, next => self%piece(1 + mod(k, n))%along)
            if (one(1)*next(2) - one(2)*next(1) > smooth .or. dot_product(one, next) < smooth - &
               1.0_wp) call tell(self%piece(k)%to)
         end associate
      end do
      call move_alloc(self%piece, wall%piece)

   contains

      subroutine tell(at)
         real(wp), intent(in) :: at(2)

         call card_error(reader, card, "the profile has a hollow corner at " // to_text(at(1)) // &
            ", " // to_text(at(2)) // ", where a node would have two contacts with one surface; " &
            // "put an arc (CIRCL) into it, or make two surfaces of it")
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
            if (abs(p%bulge) > 0.0_wp .and. p%along(1) < 0.0_wp .and. p%leaves(1) > 0.0_wp) &
               least = min(least, p%centre(1) - p%radius)
            if (least < -noise) call card_error(reader, card, "the profile has radii below 0, " &
               // to_text(least) // " in its part number " // to_text(k))
         end associate
      end do
   end subroutine check_axis

end module emcon_deck_wall_profile_plane
