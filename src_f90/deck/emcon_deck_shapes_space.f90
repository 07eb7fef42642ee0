!> The shape of elements of three dimensions, before anything is computed with them.
module emcon_deck_shapes_space
   use emcon_deck_jacobian, only : is_integrable, refuse_shapes, warn_of_corners, &
      warn_of_shapes
   use emcon_deck_reader, only : reader_t
   use emcon_element_kind, only : element_kind_t
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: check_shapes_space

   integer, parameter :: n_dim = 3
   !> A determinant of the Jacobian below this part of the cube of the largest edge is none.
   real(wp), parameter :: least_volume = 1.0e-10_wp
   !> A node beyond a quarter of its edge folds the element at the corner; far off the middle or
   !> beside the straight edge strains are less exact.
   real(wp), parameter :: quarter = 0.25_wp, off_middle = 0.15_wp
   !> Half a circle stands off its chord by that.
   real(wp), parameter :: half_circle = 0.5_wp
   !> Coordinates in decks are rounded.
   real(wp), parameter :: rounded = 1.0e-3_wp
   integer, parameter :: is_flat = 1, is_mirrored = 2, is_folded = 3, is_off = 4, is_doubtful = 5, &
      is_corner = 6

contains

   !> Refuse elements that are flat, mirrored or folded, and nodes off the middle of their edges;
   !> one message for each fault.
   subroutine check_shapes_space(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer :: fault(size(scene%element%label)), e

      if (reader%doubt%positions) return
      do e = 1, size(fault)
         fault(e) = fault_of(scene, e)
      end do
      call refuse_shapes(reader, scene, fault == is_flat, " has no volume; check its nodes and " &
         // "their order")
      call refuse_shapes(reader, scene, fault == is_mirrored, " is inverted: its nodes run as in " &
         // "a mirror, the first face has to run counter-clockwise seen from the other nodes")
      call refuse_shapes(reader, scene, fault == is_folded, " is folded: its volume is not " &
         // "positive everywhere")
      call warn_of_corners(reader, scene, fault == is_corner)
      call refuse_shapes(reader, scene, fault == is_off, " has a node outside the middle half of " &
         // "its edge, where the element folds; put it into the middle")
      call warn_of_shapes(reader, scene, fault == is_doubtful, " has a node far off the middle " &
         // "of its edge: strains are less exact, and infinite at a corner if it stands at a " &
         // "quarter")
   end subroutine check_shapes_space

   !> What is wrong with element `e`; 0: nothing.
   pure integer function fault_of(scene, e) result(fault)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: e                   !! 1..n_element
      real(wp) :: x(n_dim, size(scene%element%node, 1)), det(size(scene%element%node, 1))
      real(wp) :: along, beside
      integer :: i, n

      fault = 0
      associate (kind => scene%element%kinds(scene%element%kind(e)))
         n = kind%n_node
         if (.not. allocated(kind%shape)) return
         if (any(scene%element%node(:n, e) == 0)) return
         x(:, :n) = scene%x(:, scene%element%node(:n, e))
         ! Scaled by a power of two: coordinates may be as large or as small as numbers can be.
         x(:, :n) = scale(x(:, :n), -exponent(maxval(abs(x(:, :n)))))
         do i = n, 1, -1
            x(:, i) = x(:, i) - x(:, 1)
         end do
         if (.not. any(abs(x(:, :n)) > 0.0_wp)) then
            fault = is_flat
            return
         end if
         x(:, :n) = x(:, :n)/maxval(abs(x(:, :n)))
         if (n > kind%n_corner) then
            call find_furthest(kind, x(:, :n), along, beside)
            if (along > quarter + rounded) fault = is_off
            if (fault == 0) fault = merge(is_doubtful, 0, along > off_middle &
               .or. beside > half_circle)
         end if
         call find_determinants(kind, x(:, :n), det(:n))
         if (all(det(:n) < -least_volume)) then
            fault = is_mirrored
         else if (abs(sum(det(:n))) <= real(n, wp)*least_volume) then
            fault = is_flat
         else if (any(det(:n) <= least_volume) .and. fault /= is_off) then
            fault = merge(is_corner, is_folded, is_integrable(kind%shape, x(:, :n)))
         end if
      end associate
   end function fault_of

   !> Determinants of the Jacobian at the nodes.
   pure subroutine find_determinants(kind, x, det)
      class(element_kind_t), intent(in) :: kind
      real(wp), intent(in) :: x(:, :)            !! (3, n_node)
      real(wp), intent(out) :: det(:)            !! (n_node)
      real(wp), allocatable :: place(:, :)
      real(wp) :: value(size(x, 2)), slope(n_dim, size(x, 2)), j(n_dim, n_dim)
      integer :: i

      call kind%shape%places(place)
      do i = 1, size(det)
         call kind%shape%values(place(:, i), value, slope)
         j = matmul(x, transpose(slope))
         det(i) = dot_product(j(:, n_dim), cross_product(j(:, 1), j(:, n_dim - 1)))
      end do
   end subroutine find_determinants

   !> The largest distances of nodes from the middles of their edges, by the edge.
   pure subroutine find_furthest(kind, x, along, beside)
      class(element_kind_t), intent(in) :: kind
      real(wp), intent(in) :: x(:, :)            !! (3, n_node)
      real(wp), intent(out) :: along             !! the edge
      real(wp), intent(out) :: beside            !! in any direction
      real(wp), allocatable :: place(:, :)
      real(wp) :: length, off(n_dim)
      integer :: i, k, m

      call kind%shape%places(place)
      along = 0.0_wp
      beside = 0.0_wp
      do m = kind%n_corner + 1, kind%n_node
         do i = 1, kind%n_corner
            do k = 1, i - 1                      ! the edge that it is in the middle of
               if (any(abs(place(:, i) + place(:, k) - 2.0_wp*place(:, m)) > off_middle)) cycle
               length = norm2(x(:, i) - x(:, k))
               if (.not. length > 0.0_wp) cycle
               off = (x(:, m) - 0.5_wp*(x(:, i) + x(:, k)))/length
               along = max(along, abs(dot_product(off, x(:, i) - x(:, k)))/length)
               beside = max(beside, norm2(off))
            end do
         end do
      end do
   end subroutine find_furthest

end module emcon_deck_shapes_space
