!> The surfaces of contact pairs and ties: chains of free faces.
module emcon_deck_check_surfaces
   use emcon_deck_reader, only : reader_t
   use emcon_deck_surfaces, only : adjacency_init, adjacency_t, n_neighbours
   use emcon_diagnostics, only : add_error, label_list
   use emcon_element_kinds, only : element_kinds
   use emcon_scene, only : scene_t, surface_t
   implicit none
   private
   public :: check_surfaces, mark_nodes, face_nodes

contains

   !> Every surface that is in contact or tied.
   subroutine check_surfaces(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(adjacency_t) :: adjacency
      logical :: in_contact(0:size(scene%surface)), is_tied(0:size(scene%surface))
      character(len=:), allocatable :: title
      integer :: i

      if (size(scene%pair) + size(scene%tie) == 0 .or. reader%doubt_shapes) return
      call adjacency_init(adjacency, scene)
      in_contact = .false.
      do i = 1, size(scene%pair)
         in_contact(scene%pair(i)%slave) = .true.
         in_contact(scene%pair(i)%master) = .true.
      end do
      is_tied = .false.
      do i = 1, size(scene%tie)
         is_tied(scene%tie(i)%slave) = .true.
         is_tied(scene%tie(i)%master) = .true.
      end do
      do i = 1, size(scene%surface)
         if (.not. (in_contact(i) .or. is_tied(i))) cycle
         title = trim(merge("contact", "tied   ", in_contact(i))) // " surface " &
            // scene%surface(i)%name
         call check_free(reader, scene, adjacency, scene%surface(i), title)
         call check_chain(reader, scene, scene%surface(i), title)
      end do
   end subroutine check_surfaces

   !> A face between two elements cannot touch anything.
   subroutine check_free(reader, scene, adjacency, surface, title)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(adjacency_t), intent(in) :: adjacency
      type(surface_t), intent(in) :: surface
      character(len=*), intent(in) :: title
      logical :: is_inside(size(surface%element))
      integer :: i

      do i = 1, size(is_inside)
         is_inside(i) = n_neighbours(scene, adjacency, surface%element(i), surface%face(i)) > 0
      end do
      if (any(is_inside)) call add_error(reader%log, surface%origin, title &
         // " has faces inside the body, of element " &
         // label_list(pack(scene%element_label(surface%element), is_inside)))
   end subroutine check_free

   !> At each node one face may end and one may begin.
   subroutine check_chain(reader, scene, surface, title)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      character(len=*), intent(in) :: title
      integer, allocatable :: n_end(:, :)
      logical, allocatable :: is_branch(:)
      integer :: i, k, node(2)

      allocate(n_end(2, size(scene%node_label)), source=0)
      do i = 1, size(surface%element)
         node = face_nodes(scene, surface%element(i), surface%face(i))
         if (any(node == 0)) return
         do k = 1, 2
            n_end(k, node(k)) = n_end(k, node(k)) + 1
         end do
      end do
      is_branch = n_end(1, :) > 1 .or. n_end(2, :) > 1
      if (any(is_branch)) call add_error(reader%log, surface%origin, title &
         // " is no chain of faces: more than two of them meet at node " &
         // label_list(pack(scene%node_label, is_branch)))
   end subroutine check_chain

   !> Mark the nodes of a surface.
   pure subroutine mark_nodes(scene, surface, is_in)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      logical, intent(inout) :: is_in(:)           !! (n_node)
      integer :: i, node(2)

      is_in(surface%node) = .true.
      do i = 1, size(surface%element)
         node = face_nodes(scene, surface%element(i), surface%face(i))
         if (all(node > 0)) is_in(node) = .true.
      end do
   end subroutine mark_nodes

   !> First and last node of a face, along the boundary; 0 if the element had errors.
   pure function face_nodes(scene, element, face) result(node)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: element, face
      integer :: node(2)

      node = scene%element_node( &
         element_kinds(scene%element_kind(element))%face_node(:, face), element)
   end function face_nodes

end module emcon_deck_check_surfaces
