!> Data lines of profiles: START, LINE and CIRCL.
module emcon_deck_segment_lines_plane
   use emcon_deck_fields, only : check_count, data_error, data_t, get_real, next_line
   use emcon_deck_reader, only : card_error, card_t, has_option, option_number, reader_t
   use emcon_diagnostics, only : quoted
   use emcon_kinds, only : wp
   use emcon_profile_fillet_plane, only : round_corners, segment_t
   use emcon_text, only : to_text, to_upper
   implicit none
   private
   public :: read_segment_lines, rounding

   !> Ends of an arc are as far from its centre as each other, and ends of a closed profile are one,
   !> to this part of that distance and of the extent.
   real(wp), parameter :: rounding = 1.0e-6_wp

contains

   !> The lines that are left of a card, their corners as round as it says.
   subroutine read_segment_lines(reader, card, data, segment, is_well)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(data_t), intent(inout) :: data                        !! at the line before START
      type(segment_t), allocatable, intent(out) :: segment(:)    !! two of them at least
      logical, intent(out) :: is_well                            !! else an error was told
      type(segment_t) :: new

      is_well = .true.
      allocate(segment(0))
      do while (next_line(reader, data))
         data%ok = .true.
         call get_segment(reader, data, segment, new)
         is_well = is_well .and. data%ok
         if (data%ok) segment = [segment, new]
      end do
      if (is_well .and. size(segment) < 2) then
         call card_error(reader, card, "a profile begins with START, x, y and goes on with LINE, " &
            // "x, y or CIRCL, x, y, xc, yc")
         is_well = .false.
      end if
      if (is_well) call make_round(reader, card, segment, is_well)
   end subroutine read_segment_lines

   !> FILLET RADIUS of a card.
   subroutine make_round(reader, card, segment, is_well)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(segment_t), allocatable, intent(inout) :: segment(:)
      logical, intent(out) :: is_well
      real(wp) :: radius, extent
      integer :: corner, n, k

      is_well = .true.
      if (.not. has_option(card, "FILLETRADIUS")) return
      radius = 0.0_wp
      n = reader%log%n_errors
      call option_number(reader, card, "FILLET RADIUS", "0 or a positive number", 0.0_wp, &
         huge(radius), radius)
      is_well = reader%log%n_errors == n
      if (.not. radius > 0.0_wp) return
      n = size(segment)
      extent = norm2([(maxval(segment%to(k)) - minval(segment%to(k)), k = 1, 2)])
      call round_corners(segment, radius, norm2(segment(n)%to - segment(1)%to) <= rounding*extent, &
         corner)
      is_well = corner == 0
      if (is_well) return
      associate (at => segment(corner)%to)
         call card_error(reader, card, "FILLET RADIUS=" // to_text(radius) // " has no room at " &
            // to_text(at(1)) // ", " // to_text(at(2)) // ", where a line or arc of the profile " &
            // "is too short for it; take a smaller one, or put arcs (CIRCL) into the corners")
      end associate
   end subroutine make_round

   !> What a line says, which goes on from the last segment.
   subroutine get_segment(reader, data, segment, new)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data          !! `ok` is false if the line is refused
      type(segment_t), intent(in) :: segment(:)    !! before it
      type(segment_t), intent(out) :: new
      real(wp) :: x(4)
      integer :: n

      n = size(segment)
      call get_words(reader, data, n == 0, new%is_arc, x)
      if (.not. data%ok) return
      new%to = x(1:2)
      new%centre = x(3:4)
      if (n == 0) return
      if (new%is_arc) then
         call check_arc(reader, data, segment(n)%to - new%centre, new%to - new%centre)
      else if (.not. norm2(new%to - segment(n)%to) > 0.0_wp) then
         call data_error(reader, data, "the line has no length")
      end if
   end subroutine get_segment

   !> The word of a line and its coordinates: the point that it goes to, then the centre of an arc.
   subroutine get_words(reader, data, is_first, is_arc, x)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data          !! `ok` is false if the line is refused
      logical, intent(in) :: is_first              !! nothing is there yet
      logical, intent(out) :: is_arc
      real(wp), intent(out) :: x(4)                !! [L]
      character(len=5) :: word
      integer :: k, n

      x = 0.0_wp
      word = to_upper(data%text(data%from(1):data%to(1)))
      if (data%to(1) - data%from(1) >= len(word)) word = ""
      is_arc = word == "CIRCL"
      n = merge(5, 3, is_arc)
      if (all(word /= ["START", "LINE ", "CIRCL"])) then
         call data_error(reader, data, "expected START, LINE or CIRCL, not " &
            // quoted(data%text(data%from(1):data%to(1))))
      else if ((word == "START") .neqv. is_first) then
         call data_error(reader, data, "a profile begins with START, and has it once")
      else if (is_arc) then
         call check_count(reader, data, n, n, "CIRCL, x, y, xc, yc")
      else
         call check_count(reader, data, n, n, trim(word) // ", x, y")
      end if
      do k = 2, n
         if (data%ok) call get_real(reader, data, k, "coordinate", x(k - 1))
      end do
   end subroutine get_words

   !> An arc has one radius, and spans less than half a turn: else `data%ok` is false.
   subroutine check_arc(reader, data, from, to)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      real(wp), intent(in) :: from(2), to(2)       !! its ends from its centre [L]
      real(wp) :: angle

      if (.not. norm2(from) > 0.0_wp .or. abs(norm2(to) - norm2(from)) > rounding*norm2(from)) then
         call data_error(reader, data, "the ends of the arc are " // to_text(norm2(from)) // &
            " and " // to_text(norm2(to)) // " from its centre; the two distances must be equal")
         return
      end if
      angle = atan2(from(1)*to(2) - from(2)*to(1), dot_product(from, to))
      if (abs(angle) <= rounding .or. abs(angle) >= acos(-1.0_wp) - rounding) call data_error( &
         reader, data, "the arc spans no angle, or half a turn or more; make it of two")
   end subroutine check_arc

end module emcon_deck_segment_lines_plane
