!> Bodies: the parts of a mesh that hang together.
module emcon_bodies
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: bodies_find, bodies_find_tied

contains

   !> Number the parts that elements, edges or ties, whose rows are frozen, hold together, in the
   !> order of their first node.
   pure subroutine bodies_find_tied(scene, edge, body, n_body)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: edge(:, :)                  !! (2, n_edge) of a surface
      integer, allocatable, intent(out) :: body(:)       !! (n_node), 0: nothing hangs on it
      integer, intent(out) :: n_body
      integer, allocatable :: connected(:, :)
      integer :: k, n, s, t

      n = size(scene%element_node, 2) + size(edge, 2)
      do t = 1, size(scene%tie)
         if (allocated(scene%tie(t)%rows%slave)) n = n + size(scene%tie(t)%rows%node)
      end do
      allocate(connected(max(2, size(scene%element_node, 1)), n), source=0)
      n = size(scene%element_node, 2)
      connected(:size(scene%element_node, 1), :n) = scene%element_node
      connected(:2, n + 1:n + size(edge, 2)) = edge
      n = n + size(edge, 2)
      do t = 1, size(scene%tie)
         associate (rows => scene%tie(t)%rows)
            if (.not. allocated(rows%slave)) cycle
            do k = 1, size(rows%slave)
               do s = rows%start(k) + 1, rows%start(k + 1)
                  n = n + 1
                  connected(:2, n) = [rows%slave(k), rows%node(s)]
               end do
            end do
         end associate
      end do
      call bodies_find(connected(:, :n), size(scene%x, 2), body, n_body)
   end subroutine bodies_find_tied

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
