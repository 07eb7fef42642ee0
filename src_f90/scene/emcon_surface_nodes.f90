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

      allocate(all_nodes(0))
      if (allocated(surface%element)) call find_face_nodes(scene, surface, all_nodes)
      if (allocated(surface%edge)) all_nodes = [all_nodes, &
         pack(surface%edge, surface%edge > 0)]
      if (allocated(surface%node)) all_nodes = [all_nodes, surface%node]
      node = unique_sorted(pack(all_nodes, all_nodes > 0))
   end subroutine surface_nodes

   !> The nodes of the faces of a surface, those that faces share several times.
   pure subroutine find_face_nodes(scene, surface, node)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, allocatable, intent(out) :: node(:)
      integer :: i, n

      associate (kind => scene%element%kind(surface%element))
         allocate(node(sum(scene%element%kinds(kind)%n_face_node)))
      end associate
      n = 0
      do i = 1, size(surface%element)
         associate (e => surface%element(i), kind => scene%element%kinds(scene%element%kind( &
               surface%element(i))))
            node(n + 1:n + kind%n_face_node) = scene%element%node(kind%face(surface%face(i)), e)
            n = n + kind%n_face_node
         end associate
      end do
   end subroutine find_face_nodes

end module emcon_surface_nodes
