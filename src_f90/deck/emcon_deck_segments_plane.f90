!> *SURFACE, TYPE=SEGMENTS: a profile of lines and arcs, as edges between nodes of its own.
!>
!> Going on from the start, the body is to the right. Nodes behind those of the deck get the labels
!> that follow the largest one; a *RIGID BODY takes them.
module emcon_deck_segments_plane
   use emcon_deck_fields, only : data_open, data_t
   use emcon_deck_own_nodes, only : add_own_nodes
   use emcon_deck_reader, only : card_t, reader_t
   use emcon_deck_segment_lines_plane, only : read_segment_lines, rounding
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_origin, only : origin_t
   use emcon_profile_fillet_plane, only : segment_t
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
      type(segment_t), allocatable :: segment(:)
      real(wp), allocatable :: place(:, :)
      logical :: is_well
      integer :: i

      surface%is_profile = .true.
      allocate(surface%edge(2, 0))
      call data_open(data, card)
      call read_segment_lines(reader, card, data, segment, is_well)
      reader%doubt%names = reader%doubt%names .or. .not. is_well
      if (.not. is_well) return
      place = reshape(segment(1)%to, [2, 1])
      do i = 2, size(segment)
         if (segment(i)%is_arc) then
            call add_arc(segment(i)%to, segment(i)%centre, place)
         else
            place = reshape([place, segment(i)%to], [2, size(place, 2) + 1])
         end if
      end do
      call add_nodes(scene, card%origin, place, surface)
   end subroutine read_segments

   !> The shorter arc about `centre` from the last point to `end`.
   pure subroutine add_arc(end, centre, place)
      real(wp), intent(in) :: end(2), centre(2)
      real(wp), allocatable, intent(inout) :: place(:, :)
      real(wp) :: from(2), to(2), angle, part
      real(wp), allocatable :: point(:, :)
      integer :: k, n

      from = place(:, size(place, 2)) - centre
      to = end - centre
      angle = atan2(from(1)*to(2) - from(2)*to(1), dot_product(from, to))
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
