!> Elements so far from the origin that rounding of coordinates leaves few digits of distances.
module emcon_far_nodes
   use emcon_kinds, only : wp
   use emcon_version, only : this_precision
   implicit none
   private
   public :: far_element_find

   !> Distances within an element keep so many digits, in single, double and quadruple precision.
   integer, parameter :: fewest(3) = [3, 8, 16]

contains

   !> The first of the elements that keep fewest digits, if those are too few.
   pure subroutine far_element_find(x, u, node, element, digits)
      real(wp), intent(in), contiguous :: x(:, :)    !! (n_dim, n_node) reference positions [L]
      real(wp), intent(in), contiguous :: u(:, :)    !! (n_dim, n_node) displacements [L]
      integer, intent(in), contiguous :: node(:, :)  !! (n, n_element) of elements, then 0
      integer, intent(out) :: element            !! 0: none
      integer, intent(out) :: digits             !! that are left in it, >= 0; 0: no element
      real(wp) :: ratio, most
      integer :: e, n

      element = 0
      digits = 0
      most = 10.0_wp**(-fewest(this_precision))
      do e = 1, size(node, 2)
         n = count(node(:, e) > 0)
         ratio = epsilon(1.0_wp)*farthest(x, u, node(:n, e))/shortest(x, node(:n, e))
         if (.not. ratio > most) cycle
         most = ratio
         element = e
         digits = max(0, floor(-log10(ratio)))
      end do
   end subroutine far_element_find

   !> The largest coordinate of some nodes [L].
   pure real(wp) function farthest(x, u, node)
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      integer, intent(in) :: node(:)
      integer :: i

      farthest = 0.0_wp
      do i = 1, size(node)
         farthest = max(farthest, maxval(abs(x(:, node(i)) + u(:, node(i)))))
      end do
   end function farthest

   !> The smallest distance of two of some nodes [L].
   pure real(wp) function shortest(x, node)
      real(wp), intent(in), contiguous :: x(:, :)    !! (n_dim, n_node) [L]
      integer, intent(in) :: node(:)
      integer :: i, j

      shortest = huge(1.0_wp)
      do i = 2, size(node)
         do j = 1, i - 1
            shortest = min(shortest, norm2(x(:, node(i)) - x(:, node(j))))
         end do
      end do
   end function shortest

end module emcon_far_nodes
