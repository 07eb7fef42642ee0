!> The surfaces of contact pairs and ties: chains of free faces.
module emcon_deck_check_surfaces
   use emcon_deck_adjacency, only : adjacency_init, adjacency_t, n_neighbours
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : add_error, label_list
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_surface_edges, only : surface_edges
   implicit none
   private
   public :: check_surfaces, mark_nodes, find_common_edges

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
      integer, allocatable :: edge(:, :)
      integer :: i, k

      allocate(n_end(2, size(scene%node_label)), source=0)
      call surface_edges(scene, surface, edge)
      if (any(edge == 0)) return
      do i = 1, size(edge, 2)
         do k = 1, 2
            n_end(k, edge(k, i)) = n_end(k, edge(k, i)) + 1
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
      integer, allocatable :: edge(:, :)
      integer :: i

      is_in(surface%node) = .true.
      call surface_edges(scene, surface, edge)
      do i = 1, size(edge, 2)
         if (all(edge(:, i) > 0)) is_in(edge(:, i)) = .true.
      end do
   end subroutine mark_nodes

   !> Which of the edges of `surface` belong to the surface `other` too, of edges or of nodes?
   pure subroutine find_common_edges(scene, surface, other, is_common)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface, other
      logical, allocatable, intent(out) :: is_common(:)      !! (n_edge)
      integer, allocatable :: edge(:, :), list(:, :), last(:)
      logical, allocatable :: is_in(:)
      integer :: i

      call surface_edges(scene, surface, edge)
      call surface_edges(scene, other, list)
      allocate(last(0:size(scene%node_label)), source=0)
      do i = 1, size(list, 2)
         last(list(1, i)) = list(2, i)
      end do
      allocate(is_in(size(scene%node_label)), source=.false.)
      if (other%is_nodal) is_in(other%node) = .true.
      allocate(is_common(size(edge, 2)))
      do i = 1, size(is_common)
         is_common(i) = all(edge(:, i) > 0)
         if (is_common(i)) is_common(i) = last(edge(1, i)) == edge(2, i) .or. all(is_in(edge(:, i)))
      end do
   end subroutine find_common_edges

end module emcon_deck_check_surfaces
