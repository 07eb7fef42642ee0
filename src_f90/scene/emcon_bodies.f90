!> Bodies: the parts of a mesh that hang together.
module emcon_bodies
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: bodies_find, bodies_find_lists, bodies_find_tied

contains

   !> Number the parts that elements, facets or ties, whose rows are frozen, hold together, in the
   !> order of their first node.
   pure subroutine bodies_find_tied(scene, facet, body, n_body)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: facet(:, :)                 !! (most nodes, n_facet) of a surface
      integer, allocatable, intent(out) :: body(:)       !! (n_node), 0: nothing hangs on it
      integer, intent(out) :: n_body
      integer, allocatable :: connected(:, :)
      integer :: k, n, s, t

      n = size(scene%element%node, 2) + size(facet, 2)
      do t = 1, size(scene%tie)
         if (allocated(scene%tie(t)%rows%slave)) n = n + size(scene%tie(t)%rows%node)
      end do
      allocate(connected(max(2, size(facet, 1), size(scene%element%node, 1)), n), source=0)
      n = size(scene%element%node, 2)
      connected(:size(scene%element%node, 1), :n) = scene%element%node
      connected(:size(facet, 1), n + 1:n + size(facet, 2)) = facet
      n = n + size(facet, 2)
      do t = 1, size(scene%tie)
         associate (rows => scene%tie(t)%rows)
            if (.not. allocated(rows%slave)) cycle
            do k = 1, size(rows%slave)
               do s = rows%start(k) + 1, rows%start(k + 1)
                  if (rows%node(s) == scene%tie(t)%map%reference) cycle
                  n = n + 1
                  connected(:2, n) = [rows%slave(k), rows%node(s)]
               end do
            end do
         end associate
      end do
      call bodies_find(connected(:, :n), size(scene%x, 2), body, n_body)
   end subroutine bodies_find_tied

   !> Number the parts that elements hold together, in the order of their first node.
   pure subroutine bodies_find(element_node, n_node, body, n_body)
      integer, intent(in) :: element_node(:, :)          !! (nodes, n_element), 0: no node
      integer, intent(in) :: n_node
      integer, allocatable, intent(out) :: body(:)       !! (n_node), 0: no element
      integer, intent(out) :: n_body
      integer :: e

      associate (n => size(element_node, 1))
         call bodies_find_lists([(1 + n*e, e = 0, size(element_node, 2))], &
            reshape(element_node, [size(element_node)]), n_node, body, n_body)
      end associate
   end subroutine bodies_find

   !> The same for lists of nodes, each of which hangs together.
   pure subroutine bodies_find_lists(start, node, n_node, body, n_body)
      integer, intent(in) :: start(:)                    !! (lists + 1) into `node`; last: size + 1
      integer, intent(in) :: node(:)                     !! 0: no node
      integer, intent(in) :: n_node
      integer, allocatable, intent(out) :: body(:)       !! (n_node), 0: in no list
      integer, intent(out) :: n_body
      integer :: parent(n_node), k, i, root, other

      parent = 0
      do i = 1, size(node)
         if (node(i) > 0) parent(node(i)) = node(i)
      end do
      do k = 1, size(start) - 1
         root = 0
         do i = start(k), start(k + 1) - 1
            if (node(i) == 0) cycle
            other = find_root(parent, node(i))
            if (root == 0) root = other
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
   end subroutine bodies_find_lists

   pure integer function find_root(parent, i)
      integer, intent(in) :: parent(:), i

      find_root = i
      do while (parent(find_root) /= find_root)
         find_root = parent(find_root)
      end do
   end function find_root

end module emcon_bodies
