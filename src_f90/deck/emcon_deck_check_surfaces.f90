!> The surfaces of contact pairs and ties: chains of free faces.
module emcon_deck_check_surfaces
   use emcon_deck_adjacency, only : adjacency_init, adjacency_t, n_neighbours
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : add_error, label_list
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_sort, only : find_sorted, sort_order, unique_sorted
   use emcon_surface_facets, only : surface_facets
   use emcon_surface_nodes, only : surface_nodes
   implicit none
   private
   public :: check_surfaces, check_free, mark_nodes, find_common_edges

contains

   !> Every surface that is in contact or tied.
   subroutine check_surfaces(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(adjacency_t) :: adjacency
      logical :: in_contact(0:size(scene%surface)), is_tied(0:size(scene%surface))
      character(len=:), allocatable :: title
      integer :: i

      if (size(scene%pair) + size(scene%tie) == 0 .or. reader%doubt%shapes) return
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
         // label_list(pack(scene%element%label(surface%element), is_inside)) // "; name the " // &
         "outer ones alone, or no face: *SURFACE then takes the free faces of the elements")
   end subroutine check_free

   !> At each node one face may end and one may begin.
   subroutine check_chain(reader, scene, surface, title)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      character(len=*), intent(in) :: title
      integer, allocatable :: edge(:, :), ends(:), begins(:), branch(:)

      call surface_facets(scene, surface, edge)
      if (any(edge == 0)) return
      begins = edge(1, sort_order(edge(1, :)))
      ends = edge(2, sort_order(edge(2, :)))
      branch = unique_sorted([repeated(begins), repeated(ends)])
      if (size(branch) > 0) call add_error(reader%log, surface%origin, title &
         // " is no chain of faces: more than two of them meet at node " &
         // label_list(scene%node%label(branch)))
   end subroutine check_chain

   !> What stands in the ascending `list` more than once.
   pure function repeated(list)
      integer, intent(in) :: list(:)
      integer, allocatable :: repeated(:)

      repeated = pack(list(2:), list(2:) == list(:size(list) - 1))
   end function repeated

   !> Mark the nodes of surfaces; those that are unknown, and told, have the number 0.
   pure subroutine mark_nodes(scene, surface, is_in)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: surface(:)            !! their numbers
      logical, intent(inout) :: is_in(:)           !! (n_node)
      integer, allocatable :: node(:)
      integer :: i

      do i = 1, size(surface)
         if (surface(i) == 0) cycle
         call surface_nodes(scene, scene%surface(surface(i)), node)
         is_in(node) = .true.
      end do
   end subroutine mark_nodes

   !> Which of the edges of `surface` belong to the surface `other` too, of edges or of nodes?
   pure subroutine find_common_edges(scene, surface, other, is_common)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface, other
      logical, allocatable, intent(out) :: is_common(:)      !! (n_edge)
      integer, allocatable :: edge(:, :), list(:, :), first(:), node(:)
      integer :: i, k

      call surface_facets(scene, surface, edge)
      call surface_facets(scene, other, list)
      list = list(:, sort_order(list(1, :)))
      first = list(1, :)
      node = unique_sorted(other%node)
      allocate(is_common(size(edge, 2)), source=.false.)
      do i = 1, size(is_common)
         if (any(edge(:, i) == 0)) cycle
         k = find_sorted(first, edge(1, i))
         if (k > 0) is_common(i) = list(2, k) == edge(2, i)
         is_common(i) = is_common(i) .or. &
            (find_sorted(node, edge(1, i)) > 0 .and. find_sorted(node, edge(2, i)) > 0)
      end do
   end subroutine find_common_edges

end module emcon_deck_check_surfaces
