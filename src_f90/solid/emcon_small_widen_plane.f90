!> Small rotations and strains of an element in the plane.
module emcon_small_widen_plane
   use emcon_element, only : element_geometry_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: small_widen

contains

   !> The largest squares of rotation and strain of the quadrature points, if they are larger.
   pure subroutine small_widen(geometry, u, rotation, strain)
      type(element_geometry_t), intent(in) :: geometry
      real(wp), intent(in), contiguous :: u(:, :)        !! (2, n_node or more) displacements [L]
      real(wp), intent(inout) :: rotation, strain        !! squares of the largest so far
      real(wp) :: h11, h12, h21, h22                     ! of displacements: (component, by X)
      integer :: i, k

      do k = 1, geometry%n_gp
         h11 = 0.0_wp
         h12 = 0.0_wp
         h21 = 0.0_wp
         h22 = 0.0_wp
         do i = 1, geometry%n_node
            h11 = h11 + u(1, i)*geometry%gradient(1, i, k)
            h12 = h12 + u(1, i)*geometry%gradient(2, i, k)
            h21 = h21 + u(2, i)*geometry%gradient(1, i, k)
            h22 = h22 + u(2, i)*geometry%gradient(2, i, k)
         end do
         rotation = max(rotation, 0.25_wp*(h21 - h12)**2)
         strain = max(strain, h11**2 + h22**2 + 0.5_wp*(h12 + h21)**2)
      end do
   end subroutine small_widen

end module emcon_small_widen_plane
