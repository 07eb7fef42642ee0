!> Bodies: the parts of a mesh that hang together.
module emcon_bodies
   implicit none
   private
   public :: bodies_find

contains

   !> Number the connected parts in the order of their first node.
   pure subroutine bodies_find(element_node, n_node, body, n_body)
      integer, intent(in) :: element_node(:, :)          !! (nodes, n_element), 0: no node
      integer, intent(in) :: n_node
      integer, allocatable, intent(out) :: body(:)       !! (n_node), 0: no element
      integer, intent(out) :: n_body
      integer :: parent(n_node), e, i, root, other

      parent = 0
      do e = 1, size(element_node, 2)
         do i = 1, size(element_node, 1)
            if (element_node(i, e) > 0) parent(element_node(i, e)) = element_node(i, e)
         end do
      end do
      do e = 1, size(element_node, 2)
         root = find_root(parent, element_node(1, e))
         do i = 2, size(element_node, 1)
            if (element_node(i, e) == 0) cycle
            other = find_root(parent, element_node(i, e))
            parent(max(root, other)) = min(root, other)
            root = min(root, other)
         end do
      end do
      allocate(body(n_node), source=0)
      n_body = 0
      do i = 1, n_node
         if (parent(i) == 0) cycle
         root = find_root(parent, i)
         if (root == i) then
            n_body = n_body + 1
            body(i) = n_body
         else
            body(i) = body(root)
         end if
         parent(i) = root
      end do
   end subroutine bodies_find

   pure integer function find_root(parent, i)
      integer, intent(in) :: parent(:), i

      find_root = i
      do while (parent(find_root) /= find_root)
         find_root = parent(find_root)
      end do
   end function find_root

end module emcon_bodies
