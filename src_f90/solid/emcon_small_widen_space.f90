!> Small rotations and strains of an element in three dimensions.
module emcon_small_widen_space
   use emcon_element, only : element_geometry_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: small_widen

contains

   !> The largest squares of rotation and strain of the quadrature points, if they are larger.
   pure subroutine small_widen(geometry, u, rotation, strain)
      type(element_geometry_t), intent(in) :: geometry
      real(wp), intent(in), contiguous :: u(:, :)        !! (3, n_node or more) displacements [L]
      real(wp), intent(inout) :: rotation, strain        !! squares of the largest so far
      real(wp) :: h(3, 3)                                ! of displacements: (component, by X)
      integer :: a, i, k

      do k = 1, geometry%n_gp
         h = 0.0_wp
         do i = 1, geometry%n_node
            do a = 1, 3
               h(:, a) = h(:, a) + u(:, i)*geometry%gradient(a, i, k)
            end do
         end do
         rotation = max(rotation, 0.125_wp*sum((h - transpose(h))**2))
         strain = max(strain, 0.25_wp*sum((h + transpose(h))**2))
      end do
   end subroutine small_widen

end module emcon_small_widen_space
