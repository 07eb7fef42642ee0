!> The elements at each node, and the faces that they share.
module emcon_deck_adjacency
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: adjacency_t, adjacency_init, n_neighbours, find_face

   !> The elements at each node: element(first(i):first(i + 1) - 1).
   type :: adjacency_t
      integer, allocatable :: first(:)
      integer, allocatable :: element(:)
   end type adjacency_t

contains

   !> Elements without nodes (they had errors) are left out.
   pure subroutine adjacency_init(self, scene)
      type(adjacency_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      integer, allocatable :: next(:)
      integer :: e, k, node, n_node

      n_node = size(scene%node%label)
      allocate(self%first(n_node + 1), source=0)
      do e = 1, size(scene%element%label)
         do k = 1, scene%element%kinds(scene%element%kind(e))%n_node
            node = scene%element%node(k, e)
            if (node > 0) self%first(node) = self%first(node) + 1
         end do
      end do
      k = 1
      do node = 1, n_node + 1
         e = self%first(node)
         self%first(node) = k
         k = k + e
      end do
      next = self%first
      allocate(self%element(k - 1))
      do e = 1, size(scene%element%label)
         do k = 1, scene%element%kinds(scene%element%kind(e))%n_node
            node = scene%element%node(k, e)
            if (node == 0) cycle
            self%element(next(node)) = e
            next(node) = next(node) + 1
         end do
      end do
   end subroutine adjacency_init

   !> Number of other elements with all nodes of this face.
   pure integer function n_neighbours(scene, adjacency, element, face)
      type(scene_t), intent(in) :: scene
      type(adjacency_t), intent(in) :: adjacency
      integer, intent(in) :: element, face
      integer :: i, k, other
      logical :: has_all
      integer, allocatable :: node(:)

      n_neighbours = 0
      associate (kind => scene%element%kinds(scene%element%kind(element)))
         node = scene%element%node(kind%face(face), element)
      end associate
      if (node(1) == 0) return
      do i = adjacency%first(node(1)), adjacency%first(node(1) + 1) - 1
         other = adjacency%element(i)
         if (other == element) cycle
         has_all = .true.
         do k = 2, size(node)
            has_all = has_all .and. any(scene%element%node(:, other) == node(k))
         end do
         if (has_all) n_neighbours = n_neighbours + 1
      end do
   end function n_neighbours

   !> The elements that have a face between two nodes: how many, and the last of them.
   pure subroutine find_face(scene, adjacency, node, n_element, element, face)
      type(scene_t), intent(in) :: scene
      type(adjacency_t), intent(in) :: adjacency
      integer, intent(in) :: node(2)
      integer, intent(out) :: n_element, element, face
      integer, allocatable :: own(:)
      integer :: i, k

      n_element = 0
      element = 0
      face = 0
      do i = adjacency%first(node(1)), adjacency%first(node(1) + 1) - 1
         associate (e => adjacency%element(i))
            do k = 1, scene%element%kinds(scene%element%kind(e))%n_face
               own = scene%element%node(scene%element%kinds(scene%element%kind(e))%face(k), e)
               if (any(own(:2) /= node) .and. any(own(2:1:-1) /= node)) cycle
               n_element = n_element + 1
               element = e
               face = k
            end do
         end associate
      end do
   end subroutine find_face

end module emcon_deck_adjacency
