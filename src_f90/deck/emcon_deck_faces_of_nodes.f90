!> The faces that a surface of nodes stands for: free ones with all their nodes in it.
module emcon_deck_faces_of_nodes
   use emcon_deck_adjacency, only : adjacency_init, adjacency_t, n_neighbours
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: faces_of_nodes

contains

   !> A surface of the same name. It has no faces where the nodes belong to none as a whole.
   pure function faces_of_nodes(scene, nodal) result(surface)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: nodal       !! of nodes
      type(surface_t) :: surface
      type(adjacency_t) :: adjacency
      logical :: is_in(0:size(scene%node%label))
      integer :: e, f

      is_in = .false.
      is_in(nodal%node) = .true.
      surface%name = nodal%name
      surface%origin = nodal%origin
      allocate(surface%element(0), surface%face(0), surface%node(0))
      call adjacency_init(adjacency, scene)
      do e = 1, size(scene%element%label)
         associate (kind => scene%element%kinds(scene%element%kind(e)))
            if (.not. any(is_in(scene%element%node(:kind%n_node, e)))) cycle
            do f = 1, kind%n_face
               if (.not. all(is_in(scene%element%node(kind%face(f), e)))) cycle
               if (n_neighbours(scene, adjacency, e, f) > 0) cycle
               surface%element = [surface%element, e]
               surface%face = [surface%face, f]
            end do
         end associate
      end do
   end function faces_of_nodes

end module emcon_deck_faces_of_nodes
