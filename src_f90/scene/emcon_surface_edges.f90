!> The edges of a surface, whatever it is made of.
module emcon_surface_edges
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: surface_edges

contains

   !> The edges of `surface` by their first and last nodes; none for a nodal one. Nodes are 0 in an
   !> element that had errors.
   pure subroutine surface_edges(scene, surface, edge)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, allocatable, intent(out) :: edge(:, :)      !! (2, n_edge)
      integer :: i, n

      if (allocated(surface%edge)) then
         allocate(edge, source=surface%edge)
         return
      end if
      n = 0
      if (.not. surface%is_nodal) n = size(surface%element)
      allocate(edge(2, n))
      do i = 1, n
         associate (e => surface%element(i))
            edge(:, i) = scene%element_node( &
               scene%kind(scene%element_kind(e))%face_node(:, surface%face(i)), e)
         end associate
      end do
   end subroutine surface_edges

end module emcon_surface_edges
