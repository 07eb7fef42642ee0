!> Closed surfaces in space by their nodes and facets: spheres of triangles, boxes of quadrilaterals
!> or triangles.
module space_shapes
   use emcon_kinds, only : wp
   implicit none
   private
   public :: shape_surface_t, make_sphere, make_box, make_box_of_triangles, turn_surface

   type :: shape_surface_t
      real(wp), allocatable :: x(:, :)           !! (3, n_node)
      integer, allocatable :: facet(:, :)        !! (nodes, n_facet) counter-clockwise from outside
   end type shape_surface_t

contains

   !> A sphere about the origin: an icosahedron whose faces are split in four `n` times.
   subroutine make_sphere(self, n, radius)
      type(shape_surface_t), intent(out) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: radius
      integer, parameter :: face(60) = [ &
         1, 12, 6, 1, 6, 2, 1, 2, 8, 1, 8, 11, 1, 11, 12, 2, 6, 10, 6, 12, 5, &
         12, 11, 3, 11, 8, 7, 8, 2, 9, 4, 10, 5, 4, 5, 3, 4, 3, 7, 4, 7, 9, &
         4, 9, 10, 5, 10, 6, 3, 5, 12, 7, 3, 11, 9, 7, 8, 10, 9, 2]
      integer, allocatable :: finer(:, :)
      real(wp) :: a, b
      integer :: i, k, middle(3), m

      a = 1.0_wp
      b = 0.5_wp*(1.0_wp + sqrt(5.0_wp))
      allocate(self%x(3, 12))
      self%x = reshape([-a, b, 0.0_wp, a, b, 0.0_wp, -a, -b, 0.0_wp, a, -b, 0.0_wp, 0.0_wp, -a, b, &
         0.0_wp, a, b, 0.0_wp, -a, -b, 0.0_wp, a, -b, b, 0.0_wp, -a, b, 0.0_wp, a, -b, 0.0_wp, -a, &
         -b, 0.0_wp, a], [3, 12])
      self%facet = reshape(face, [3, 20])
      do k = 1, n
         allocate(finer(3, 4*size(self%facet, 2)))
         call refine()
         call move_alloc(finer, self%facet)
      end do
      do i = 1, size(self%x, 2)
         self%x(:, i) = radius*self%x(:, i)/norm2(self%x(:, i))
      end do

   contains

      !> Nodes in the middle of edges, found by a table of the edges of each lower node.
      subroutine refine()
         integer :: first(size(self%x, 2)), next(3*size(self%facet, 2)), upper(size(next)), e, j, &
            p, q
         real(wp), allocatable :: x(:, :)

         first = 0
         m = size(self%x, 2)
         allocate(x(3, m + size(next)))
         x(:, :m) = self%x
         do i = 1, size(self%facet, 2)
            do j = 1, 3
               p = min(self%facet(j, i), self%facet(1 + mod(j, 3), i))
               q = max(self%facet(j, i), self%facet(1 + mod(j, 3), i))
               e = first(p)
               do while (e > 0)
                  if (upper(e) == q) exit
                  e = next(e)
               end do
               if (e == 0) then
                  m = m + 1
                  e = m - size(self%x, 2)
                  x(:, m) = x(:, p)/norm2(x(:, p)) + x(:, q)/norm2(x(:, q))
                  upper(e) = q
                  next(e) = first(p)
                  first(p) = e
               end if
               middle(j) = e + size(self%x, 2)
            end do
            associate (f => self%facet(:, i))
               finer(:, 4*i - 3) = [f(1), middle(1), middle(3)]
               finer(:, 4*i - 2) = [f(2), middle(2), middle(1)]
               finer(:, 4*i - 1) = [f(3), middle(3), middle(2)]
               finer(:, 4*i) = middle
            end associate
         end do
         self%x = x(:, :m)
      end subroutine refine

   end subroutine make_sphere

   !> A box of n(1) x n(2) x n(3) cells from `low` to `high`.
   subroutine make_box(self, n, low, high)
      type(shape_surface_t), intent(out) :: self
      integer, intent(in) :: n(3)
      real(wp), intent(in) :: low(3), high(3)
      integer :: number(0:n(1), 0:n(2), 0:n(3)), i, j, k, m, axis, b, c, end, at(3, 4)

      number = 0
      m = 0
      allocate(self%x(3, 2*product(n + 1)), self%facet(4, 2*(n(1)*n(2) + n(2)*n(3) + n(3)*n(1))))
      k = 0
      do axis = 1, 3
         b = 1 + mod(axis, 3)
         c = 1 + mod(b, 3)
         do end = 0, 1
            do i = 0, n(b) - 1
               do j = 0, n(c) - 1
                  at(axis, :) = end*n(axis)
                  at(b, :) = [i, i + 1, i + 1, i]
                  at(c, :) = [j, j, j + 1, j + 1]
                  if (end == 0) at = at(:, 4:1:-1)
                  k = k + 1
                  self%facet(:, k) = [node(at(:, 1)), node(at(:, 2)), node(at(:, 3)), node(at(:, &
                     4))]
               end do
            end do
         end do
      end do
      self%x = self%x(:, :m)

   contains

      integer function node(place)
         integer, intent(in) :: place(3)

         if (number(place(1), place(2), place(3)) == 0) then
            m = m + 1
            number(place(1), place(2), place(3)) = m
            self%x(:, m) = low + real(place, wp)/real(n, wp)*(high - low)
         end if
         node = number(place(1), place(2), place(3))
      end function node

   end subroutine make_box

   !> The same of triangles, by one diagonal of each quadrilateral.
   subroutine make_box_of_triangles(self, n, low, high, is_mirrored)
      type(shape_surface_t), intent(out) :: self
      integer, intent(in) :: n(3)
      real(wp), intent(in) :: low(3), high(3)
      logical, intent(in) :: is_mirrored         !! take the other diagonal
      type(shape_surface_t) :: box
      integer :: i

      call make_box(box, n, low, high)
      self%x = box%x
      allocate(self%facet(3, 2*size(box%facet, 2)))
      do i = 1, size(box%facet, 2)
         associate (f => cshift(box%facet(:, i), merge(1, 0, is_mirrored)))
            self%facet(:, 2*i - 1) = f([1, 2, 3])
            self%facet(:, 2*i) = f([1, 3, 4])
         end associate
      end do
   end subroutine make_box_of_triangles

   !> Turn the surface about the origin by a rotation that no axis has, and move it.
   subroutine turn_surface(self, move)
      type(shape_surface_t), intent(inout) :: self
      real(wp), intent(in) :: move(3)
      real(wp), parameter :: c1 = cos(0.7_wp), s1 = sin(0.7_wp), c2 = cos(1.1_wp), s2 = sin(1.1_wp)
      real(wp) :: turn(3, 3)
      integer :: i

      turn = matmul(reshape([c1, s1, 0.0_wp, -s1, c1, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3]), &
         reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, c2, s2, 0.0_wp, -s2, c2], [3, 3]))
      do i = 1, size(self%x, 2)
         self%x(:, i) = matmul(turn, self%x(:, i)) + move
      end do
   end subroutine turn_surface

end module space_shapes
