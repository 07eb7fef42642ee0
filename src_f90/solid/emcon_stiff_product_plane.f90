! build: lanes
!> The product of emcon_stiff_product in the plane, written out: it is half of the time of linear
!> sections.
module emcon_stiff_product_plane
   use emcon_kinds, only : wp
   implicit none
   private
   public :: n_lane, n_plane, stiff_product_form

   !> Nodes side by side.
   integer, parameter :: n_lane = 8
   integer, parameter :: n_plane = 2

contains

   !> Forces of displacements, those of a node with all that it meets.
   pure subroutine stiff_product_form(first, column, block, displacement, force)
      integer, intent(in), contiguous :: first(:)          !! (n_group + 1) slots before each group
      integer, intent(in), contiguous :: column(:, :)      !! (n_lane, n_slot) rows of neighbours
      real(wp), intent(in), contiguous :: block(:, :, :, :)  !! (n_lane, 2, 2, n_slot) [M/T^2]
      real(wp), intent(in), contiguous :: displacement(:, :) !! (n_lane*n_group, 2) [L]
      real(wp), intent(inout), contiguous :: force(:, :)   !! (n_lane*n_group, 2) [M L/T^2]
      real(wp), dimension(n_lane) :: f1, f2, d1, d2
      integer :: g, i, k, l

      do g = 1, size(first) - 1
         i = n_lane*(g - 1)
         f1 = 0.0_wp
         f2 = 0.0_wp
         do k = first(g) + 1, first(g + 1)
            do l = 1, n_lane
               d1(l) = displacement(column(l, k), 1)
               d2(l) = displacement(column(l, k), 2)
            end do
            d1 = d1 - displacement(i + 1:i + n_lane, 1)
            d2 = d2 - displacement(i + 1:i + n_lane, 2)
            f1 = f1 + (block(:, 1, 1, k)*d1 + block(:, 1, 2, k)*d2)
            f2 = f2 + (block(:, 2, 1, k)*d1 + block(:, 2, 2, k)*d2)
         end do
         force(i + 1:i + n_lane, 1) = f1
         force(i + 1:i + n_lane, 2) = f2
      end do
   end subroutine stiff_product_form

end module emcon_stiff_product_plane
