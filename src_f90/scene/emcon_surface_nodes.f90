!> The nodes of a surface, whatever it is made of, in the plane and in space.
module emcon_surface_nodes
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_sort, only : unique_sorted
   implicit none
   private
   public :: surface_nodes

contains

   !> The nodes of `surface`, each once, ascending; elements that had errors leave theirs out.
   pure subroutine surface_nodes(scene, surface, node)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, allocatable, intent(out) :: node(:)
      integer, allocatable :: all_nodes(:)
      integer :: i, n

      if (surface%is_nodal) then
         all_nodes = surface%node
      else if (allocated(surface%edge)) then
         all_nodes = [surface%edge]
      else
         n = 0
         do i = 1, size(surface%element)
            n = n + scene%element%kinds(scene%element%kind(surface%element(i)))%n_face_node
         end do
         allocate(all_nodes(n))
         n = 0
         do i = 1, size(surface%element)
            associate (e => surface%element(i), kind => scene%element%kinds(scene%element%kind( &
                  surface%element(i))))
               all_nodes(n + 1:n + kind%n_face_node) = &
                  scene%element%node(kind%face(surface%face(i)), e)
               n = n + kind%n_face_node
            end associate
         end do
      end if
      node = unique_sorted(pack(all_nodes, all_nodes > 0))
   end subroutine surface_nodes

end module emcon_surface_nodes
