!> Data lines of profiles: START, LINE and CIRCL.
module emcon_deck_segment_lines_plane
   use emcon_deck_fields, only : check_count, data_error, data_t, get_real
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : quoted
   use emcon_kinds, only : wp
   use emcon_text, only : to_text, to_upper
   implicit none
   private
   public :: get_segment, check_arc, rounding

   !> Ends of an arc are as far from its centre as each other, and ends of a closed profile are one,
   !> to this part of that distance and of the extent.
   real(wp), parameter :: rounding = 1.0e-6_wp

contains

   !> The word of a line and its coordinates: the point that it goes to, then the centre of an arc.
   subroutine get_segment(reader, data, is_first, is_arc, x)
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
   end subroutine get_segment

   !> An arc has one radius, and spans less than half a turn: else `data%ok` is false.
   subroutine check_arc(reader, data, from, to, angle)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      real(wp), intent(in) :: from(2), to(2)       !! its ends from its centre [L]
      real(wp), intent(out) :: angle               !! > 0: to the left; the shorter way [rad]

      angle = 0.0_wp
      if (.not. norm2(from) > 0.0_wp .or. abs(norm2(to) - norm2(from)) > rounding*norm2(from)) then
         call data_error(reader, data, "the ends of the arc are " // to_text(norm2(from)) // &
            " and " // to_text(norm2(to)) // " from its centre, they have to be as far from it")
         return
      end if
      angle = atan2(from(1)*to(2) - from(2)*to(1), dot_product(from, to))
      if (abs(angle) <= rounding .or. abs(angle) >= acos(-1.0_wp) - rounding) call data_error( &
         reader, data, "the arc spans no angle, or half a turn or more; make it of two")
   end subroutine check_arc

end module emcon_deck_segment_lines_plane
