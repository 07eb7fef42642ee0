!> *SURFACE, TYPE=SEGMENTS: a profile of lines and arcs, as edges between nodes of its own.
!>
!> Going on from the start, the body is to the right. Nodes behind those of the deck get the labels
!> that follow the largest one; a *RIGID BODY takes them.
module emcon_deck_segments_plane
   use emcon_deck_fields, only : data_error, data_open, data_t, next_line
   use emcon_deck_own_nodes, only : add_own_nodes
   use emcon_deck_reader, only : card_error, card_t, reader_t
   use emcon_deck_segment_lines_plane, only : check_arc, get_segment, rounding
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_origin, only : origin_t
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: read_segments

   !> Edges of an arc span this angle at most: they lie within 4e-5 of its radius.
   real(wp), parameter :: finest = acos(-1.0_wp)/180.0_wp

contains

   !> The profile of a card, and its nodes behind those of `scene`.
   subroutine read_segments(reader, card, scene, surface)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(inout) :: scene
      type(surface_t), intent(inout) :: surface
      type(data_t) :: data
      real(wp), allocatable :: place(:, :)
      logical :: is_well

      surface%is_profile = .true.
      allocate(place(2, 0), surface%edge(2, 0))
      is_well = .true.
      call data_open(data, card)
      do while (next_line(reader, data))
         call read_segment(reader, data, place)
         is_well = is_well .and. data%ok
      end do
      if (is_well .and. size(place, 2) < 2) call card_error(reader, card, &
         "a profile begins with START, x, y and goes on with LINE, x, y or CIRCL, x, y, xc, yc")
      if (is_well .and. size(place, 2) >= 2) call add_nodes(scene, card%origin, place, surface)
      reader%doubt%names = reader%doubt%names .or. .not. is_well
   end subroutine read_segments

   !> The points of a data line behind those of `place`.
   subroutine read_segment(reader, data, place)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      real(wp), allocatable, intent(inout) :: place(:, :)
      real(wp) :: x(4)
      logical :: is_arc

      call get_segment(reader, data, size(place, 2) == 0, is_arc, x)
      if (.not. data%ok) return
      if (is_arc) then
         call add_arc(reader, data, x(1:2), x(3:4), place)
         return
      end if
      if (size(place, 2) > 0) then
         if (all(abs(place(:, size(place, 2)) - x(1:2)) <= 0.0_wp)) call data_error(reader, data, &
            "the line has no length")
      end if
      place = reshape([place, x(1:2)], [2, size(place, 2) + 1])
   end subroutine read_segment

   !> The shorter arc about `centre` from the last point to `end`.
   subroutine add_arc(reader, data, end, centre, place)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      real(wp), intent(in) :: end(2), centre(2)
      real(wp), allocatable, intent(inout) :: place(:, :)
      real(wp) :: from(2), to(2), angle, part
      real(wp), allocatable :: point(:, :)
      integer :: k, n

      from = place(:, size(place, 2)) - centre
      to = end - centre
      call check_arc(reader, data, from, to, angle)
      if (.not. data%ok) return
      n = ceiling(abs(angle)/finest)
      allocate(point(2, n))
      do k = 1, n - 1
         part = angle*real(k, wp)/real(n, wp)
         point(:, k) = centre + [cos(part)*from(1) - sin(part)*from(2), &
            sin(part)*from(1) + cos(part)*from(2)]
      end do
      point(:, n) = end
      place = reshape([place, point], [2, size(place, 2) + n])
   end subroutine add_arc

   !> Nodes at the points, and the edges between them, backwards: the body is to their left.
   subroutine add_nodes(scene, origin, place, surface)
      type(scene_t), intent(inout) :: scene
      type(origin_t), intent(in) :: origin
      real(wp), intent(in) :: place(:, :)
      type(surface_t), intent(inout) :: surface
      integer, allocatable :: node(:), inner(:)
      integer :: i, n

      n = size(place, 2)
      if (norm2(place(:, n) - place(:, 1)) <= rounding*norm2(maxval(place, 2) &
         - minval(place, 2))) n = n - 1
      call add_own_nodes(scene, origin, place(:, :n), node)
      if (n < size(place, 2)) node = [node, node(1)]
      surface%edge = reshape([(node(i + 1), node(i), i = 1, size(node) - 1)], &
         [2, size(node) - 1])
      if (.not. is_straight(place)) return
      call add_own_nodes(scene, origin, reshape(inner_place(place), [2, 1]), inner)
      surface%inner_node = inner(1)
   end subroutine add_nodes

   !> Do all points lie on one line? Then they do not tell how the body is turned.
   pure logical function is_straight(place)
      real(wp), intent(in) :: place(:, :)        !! (2, n) n > 1
      real(wp) :: chord(2), arm(2)
      integer :: i

      chord = place(:, size(place, 2)) - place(:, 1)
      is_straight = .false.
      do i = 2, size(place, 2) - 1
         arm = place(:, i) - place(:, 1)
         if (abs(chord(1)*arm(2) - chord(2)*arm(1)) > rounding*dot_product(chord, chord)) return
      end do
      is_straight = .true.
   end function is_straight

   !> In the body, as far from a straight profile as half of its length.
   pure function inner_place(place)
      real(wp), intent(in) :: place(:, :)        !! (2, n) n > 1
      real(wp) :: inner_place(2), half(2)

      half = 0.5_wp*(place(:, size(place, 2)) - place(:, 1))
      inner_place = place(:, 1) + half + [half(2), -half(1)]
   end function inner_place

end module emcon_deck_segments_plane
