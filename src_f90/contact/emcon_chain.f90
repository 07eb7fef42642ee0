!> A contact surface in the plane as a chain of edges.
!>
!> Edges run as in their elements, the body to the left, so the outward normal of an edge from a
!> to b is (b - a) turned by -90 degrees.
module emcon_chain
   use emcon_element_kinds, only : element_kinds
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t, surface_t, where_text
   use emcon_sort, only : find_sorted, unique_sorted
   use emcon_text, only : to_text
   implicit none
   private
   public :: chain_t, chain_init, chain_tributary

   type :: chain_t
      integer :: n_edge = 0
      integer, allocatable :: edge(:, :)         !! (2, n_edge) first and last node
      integer, allocatable :: previous(:)        !! (n_edge) edge before; 0: an end
      integer, allocatable :: next(:)            !! (n_edge) edge after
      integer, allocatable :: node(:)            !! ascending distinct nodes
   end type chain_t

contains

   !> The chain of the faces of `surface`; a nodal surface gives nodes without edges.
   subroutine chain_init(self, scene, surface, error)
      type(chain_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      type(error_t), allocatable, intent(out) :: error
      integer :: i, e, kind

      allocate(self%edge(2, 0))
      if (surface%is_nodal) then
         self%node = unique_sorted(surface%node)
      else
         self%n_edge = size(surface%element)
         deallocate(self%edge)
         allocate(self%edge(2, self%n_edge))
         do i = 1, self%n_edge
            e = surface%element(i)
            kind = scene%element_kind(e)
            self%edge(:, i) = &
               scene%element_node(element_kinds(kind)%face_node(:, surface%face(i)), e)
         end do
         self%node = unique_sorted(reshape(self%edge, [2*self%n_edge]))
      end if
      call link_edges(self, scene, surface, error)
   end subroutine chain_init

   !> Find the neighbours of each edge.
   subroutine link_edges(self, scene, surface, error)
      type(chain_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      type(error_t), allocatable, intent(out) :: error
      integer :: starts(size(self%node)), ends(size(self%node)), i, k, end_node

      allocate(self%previous(self%n_edge), source=0)
      allocate(self%next(self%n_edge), source=0)
      starts = 0
      ends = 0
      do i = 1, self%n_edge
         k = find_sorted(self%node, self%edge(1, i))
         end_node = find_sorted(self%node, self%edge(2, i))
         if (starts(k) > 0 .or. ends(end_node) > 0) then
            if (starts(k) == 0) k = end_node
            call raise(error, err_input, where_text(scene, surface%origin) // ": surface " // &
               surface%name // " is not a chain: it branches at node " // &
               to_text(scene%node_label(self%node(k))))
            return
         end if
         starts(k) = i
         ends(end_node) = i
      end do
      do i = 1, self%n_edge
         k = starts(find_sorted(self%node, self%edge(2, i)))
         if (k == 0) cycle
         self%next(i) = k
         self%previous(k) = i
      end do
   end subroutine link_edges

   !> Length that belongs to each node of the chain: half of the edges beside it, at x + u.
   pure subroutine chain_tributary(self, x, u, length)
      type(chain_t), intent(in) :: self
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (2, n_node of the scene)
      real(wp), intent(out) :: length(:)         !! (size of `node`)
      real(wp) :: a(2), half
      integer :: i, k, j

      length = 0.0_wp
      do i = 1, self%n_edge
         a = (x(:, self%edge(2, i)) - x(:, self%edge(1, i))) &
            + (u(:, self%edge(2, i)) - u(:, self%edge(1, i)))
         half = 0.5_wp*sqrt(dot_product(a, a))
         do j = 1, 2
            k = find_sorted(self%node, self%edge(j, i))
            length(k) = length(k) + half
         end do
      end do
   end subroutine chain_tributary

end module emcon_chain
