!> How large a surface of faces is, and its faces in the mean.
module emcon_surface_shape_space
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_rotation, only : cross_product
   use emcon_scene, only : scene_t
   use emcon_surface_facets, only : surface_facets
   implicit none
   private
   public :: surface_size

contains

   !> The area of `surface` in the reference configuration and the length of a mean face, the root
   !> of its area; times powers of a length that is one for all surfaces of a scene.
   pure subroutine surface_size(scene, surface, area, length)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      real(wp), intent(out) :: area, length      !! 0 where it has no faces
      integer, allocatable :: facet(:, :)
      integer :: f, k, power
      real(wp), dimension(size(scene%x, 1)) :: a, b, normal

      ! Coordinates may be as large or as small as numbers can be.
      power = -exponent(maxval(abs(scene%x)))
      area = 0.0_wp
      length = 0.0_wp
      call surface_facets(scene, surface, facet)
      if (size(facet, 2) == 0) return
      if (any(facet(1, :) == 0)) return
      do f = 1, size(facet, 2)
         associate (node => pack(facet(:, f), facet(:, f) > 0))
            normal = 0.0_wp
            a = 0.0_wp
            do k = 2, size(node)
               b = scale(scene%x(:, node(k)), power) - scale(scene%x(:, node(1)), power)
               normal = normal + 0.5_wp*cross_product(a, b)
               a = b
            end do
            area = area + norm2(normal)
         end associate
      end do
      length = sqrt(area/real(size(facet, 2), wp))
   end subroutine surface_size

end module emcon_surface_shape_space
