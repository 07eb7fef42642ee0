!> The shape of elements, as far as it can be seen from their corners.
module emcon_deck_geometry
   use emcon_deck_jacobian, only : is_integrable, refuse_shapes, warn_of_corners
   use emcon_deck_reader, only : reader_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: check_shapes

   !> A corner's cross product of edges, over the square of the longest edge, below which it has
   !> no area. Slender elements are far above; rounding of the coordinates of nodes on one line is
   !> below as long as these do not exceed 1e5 edges.
   real(wp), parameter :: least_corner = 1.0e-10_wp
   integer, parameter :: shape_good = 0, shape_flat = 1, shape_clockwise = 2, shape_folded = 3, &
      shape_corner = 4

contains

   !> Refuse elements without area, numbered clockwise, or folded; one message for each kind.
   subroutine check_shapes(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer, allocatable :: fault(:)
      integer :: i

      if (reader%doubt%positions) return
      allocate(fault(size(scene%element%label)))
      do i = 1, size(fault)
         fault(i) = element_shape(scene, i)
      end do
      call refuse_shapes(reader, scene, fault == shape_flat, " has no area; check its nodes and " &
         // "their order")
      call refuse_shapes(reader, scene, fault == shape_clockwise, " is inverted: its nodes run " &
         // "clockwise")
      call warn_of_corners(reader, scene, fault == shape_corner)
      call refuse_shapes(reader, scene, fault == shape_folded, " is folded: the angle at a " // &
         "corner is 180 degrees or more")
   end subroutine check_shapes

   !> Judge the cross products of the edges at the corners of a plane element.
   pure integer function element_shape(scene, element)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: element
      real(wp) :: x(2, size(scene%element%node, 1)), edge(2, size(scene%element%node, 1))
      real(wp) :: corner(size(scene%element%node, 1)), longest
      integer :: k, n, before

      element_shape = shape_good
      n = scene%element%kinds(scene%element%kind(element))%n_corner
      if (n == 0) return
      if (any(scene%element%node(:n, element) == 0)) return
      x(:, :n) = scene%x(:, scene%element%node(:n, element))
      ! Scaled by a power of two: coordinates may be as large or as small as numbers can be.
      x(:, :n) = scale(x(:, :n), -exponent(maxval(abs(x(:, :n)))))
      do k = 1, n
         edge(:, k) = x(:, merge(1, k + 1, k == n)) - x(:, k)
      end do
      longest = maxval(abs(edge(:, :n)))
      element_shape = shape_flat
      if (longest <= 0.0_wp) return
      edge(:, :n) = edge(:, :n)/longest
      do k = 1, n
         before = merge(n, k - 1, k == 1)
         corner(k) = edge(1, before)*edge(2, k) - edge(2, before)*edge(1, k)
      end do
      if (abs(sum(corner(:n))) <= least_corner) then
         element_shape = shape_flat
      else if (all(corner(:n) < 0.0_wp)) then
         element_shape = shape_clockwise
      else if (any(corner(:n) <= least_corner)) then
         element_shape = shape_folded
         associate (kind => scene%element%kinds(scene%element%kind(element)))
            if (.not. allocated(kind%shape)) return
            if (kind%n_face_node > 2) then       ! judged with the nodes of its sides
               element_shape = shape_good
            else if (is_integrable(kind%shape, x(:, :n))) then
               element_shape = shape_corner
            end if
         end associate
      else
         element_shape = shape_good
      end if
   end function element_shape

end module emcon_deck_geometry
