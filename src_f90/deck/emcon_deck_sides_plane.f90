!> The sides of elements in the plane that have nodes between their corners.
module emcon_deck_sides_plane
   use emcon_deck_adjacency, only : adjacency_init, adjacency_t
   use emcon_deck_jacobian, only : is_integrable, refuse_shapes, warn_of_corners, &
      warn_of_shapes
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : add_error
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: check_sides

   !> A node between two corners beyond a quarter of its side folds the element there; at a quarter
   !> strains at the corner are infinite. Where it is further off the middle, that is told.
   real(wp), parameter :: quarter = 0.25_wp, off_middle = 0.15_wp
   !> Half a circle stands off its chord by that.
   real(wp), parameter :: half_circle = 0.5_wp
   !> Coordinates in decks are rounded.
   real(wp), parameter :: rounded = 1.0e-3_wp

contains

   !> Refuse nodes outside the middle half of their side, elements that their sides fold, and
   !> straight sides beside those with a node.
   subroutine check_sides(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      logical, dimension(size(scene%element%label)) :: is_bent, is_off, is_folded, is_corner
      real(wp) :: along, beside
      integer :: e

      if (.not. has_middles(scene)) return
      if (reader%doubt%positions) return
      is_folded = .false.
      is_bent = .false.
      is_off = .false.
      is_corner = .false.
      do e = 1, size(is_bent)
         if (scene%element%kinds(scene%element%kind(e))%n_face_node < 3) cycle
         if (scene%element%node(1, e) == 0) cycle
         call find_furthest(scene, e, along, beside)
         is_bent(e) = along > 0.5_wp - quarter + rounded
         if (.not. is_bent(e)) call look_for_folds(scene, e, is_folded(e), is_corner(e))
         is_off(e) = .not. (is_bent(e) .or. is_folded(e) .or. is_corner(e)) .and. &
            (along > off_middle .or. beside > half_circle)
      end do
      call refuse_shapes(reader, scene, is_bent, " has a node outside the middle half of its " &
         // "side, where the element folds; put it into the middle")
      call refuse_shapes(reader, scene, is_folded, " is folded by the nodes of its sides: its " &
         // "area is not positive everywhere")
      call warn_of_corners(reader, scene, is_corner)
      call warn_of_shapes(reader, scene, is_off, " has a node far off the middle of its side: " &
         // "strains are less exact, and infinite at a corner if it stands at a quarter")
      if (.not. (reader%doubt%elements .or. reader%doubt%shapes)) call check_neighbours(reader, &
         scene)
   end subroutine check_sides

   !> Has an element of the scene nodes between its corners?
   pure logical function has_middles(scene)
      type(scene_t), intent(in) :: scene
      integer :: e

      has_middles = .true.
      do e = 1, size(scene%element%kind)
         if (scene%element%kinds(scene%element%kind(e))%n_face_node > 2) return
      end do
      has_middles = .false.
   end function has_middles

   !> The largest distances of such nodes from the middles of their sides, by their lengths.
   pure subroutine find_furthest(scene, e, along, beside)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: e
      real(wp), intent(out) :: along             !! the side
      real(wp), intent(out) :: beside            !! in any direction
      real(wp) :: chord(2), arm(2), part
      integer, allocatable :: node(:)
      integer :: f

      along = 0.0_wp
      beside = 0.0_wp
      associate (kind => scene%element%kinds(scene%element%kind(e)))
         do f = 1, kind%n_face
            node = scene%element%node(kind%face(f), e)
            chord = scene%x(:, node(2)) - scene%x(:, node(1))
            arm = scene%x(:, node(3)) - scene%x(:, node(1))
            arm = arm/maxval(abs(chord))
            chord = chord/maxval(abs(chord))
            part = dot_product(arm, chord)/dot_product(chord, chord)
            along = max(along, abs(part - 0.5_wp))
            beside = max(beside, norm2(arm - 0.5_wp*chord)/norm2(chord))
         end do
      end associate
   end subroutine find_furthest

   !> Is the area of an element not positive at a point of the quadrature, or negative at a node?
   pure subroutine look_for_folds(scene, e, is_folded, is_corner)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: e
      logical, intent(out) :: is_folded, is_corner   !! at a point; at a node only
      real(wp), allocatable :: place(:, :)
      real(wp) :: x(2, scene%element%kinds(scene%element%kind(e))%n_node), value(size(x, 2))
      real(wp) :: slope(2, size(x, 2)), area(size(x, 2)), jacobian(2, 2)
      integer :: i

      associate (kind => scene%element%kinds(scene%element%kind(e)))
         x = scene%x(:, scene%element%node(:kind%n_node, e))
         x = x - spread(x(:, 1), 2, size(x, 2))
         x = x/maxval(abs(x))
         is_folded = .not. is_integrable(kind%shape, x)
         call kind%shape%places(place)
         do i = 1, size(place, 2)
            call kind%shape%values(place(:, i), value, slope)
            jacobian = matmul(x, transpose(slope))
            area(i) = jacobian(1, 1)*jacobian(2, 2) - jacobian(1, 2)*jacobian(2, 1)
         end do
         is_corner = .not. is_folded .and. minval(area) < -4.0_wp*rounded*maxval(area)
      end associate
   end subroutine look_for_folds

   !> A side without a node between its corners beside one that has one: they would come apart.
   subroutine check_neighbours(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(adjacency_t) :: adjacency
      integer, allocatable :: side(:)
      integer :: e, f, g, i, other

      call adjacency_init(adjacency, scene)
      do e = 1, size(scene%element%kind)
         associate (kind => scene%element%kinds(scene%element%kind(e)))
            if (kind%n_face_node /= 2) cycle
            do f = 1, kind%n_face
               side = scene%element%node(kind%face(f), e)
               if (any(side == 0)) exit            ! the element had errors
               do i = adjacency%first(side(1)), adjacency%first(side(1) + 1) - 1
                  other = adjacency%element(i)
                  g = bent_side(scene, other, side)
                  if (g == 0) cycle
                  call add_error(reader%log, scene%element%origin(e), "element " // &
                     to_text(scene%element%label(e)) // " has a straight side where " // &
                     "element " // to_text(scene%element%label(other)) // " has node " // &
                     to_text(scene%node%label(g)) // " between the corners: they come " // &
                     "apart there; take one order of elements, or nodes of their own and *TIE")
                  return
               end do
            end do
         end associate
      end do
   end subroutine check_neighbours

   !> The node between the corners `side` of element `e`, 0 if it has no such side.
   pure integer function bent_side(scene, e, side)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: e
      integer, intent(in) :: side(:)             !! (2)
      integer, allocatable :: own(:)
      integer :: f

      bent_side = 0
      associate (kind => scene%element%kinds(scene%element%kind(e)))
         if (kind%n_face_node < 3) return
         do f = 1, kind%n_face
            own = scene%element%node(kind%face(f), e)
            if (all(own(:2) == side) .or. all(own(2:1:-1) == side)) bent_side = own(3)
         end do
      end associate
   end function bent_side

end module emcon_deck_sides_plane
