!> What a slave facet of a tie and the master have in common, triangle by triangle, and the
!> integrals of shape functions over it.
!>
!> Each triangle of the slave facet is a plane. Triangles of the master that face it are projected
!> along its normal and clipped by its sides; D and M are integrals over the same polygons, so that
!> the rows of a tie sum up to 0. Source: docs/theory.md, section 10.10.
module emcon_tie_cells_space
   use emcon_box_tree, only : box_tree_find
   use emcon_facets, only : facets_length
   use emcon_gauss, only : gauss_points
   use emcon_kinds, only : wp
   use emcon_polygon_clip_space, only : barycentric, most_corners, polygon_clip, polygon_misses, &
      triangle_sides
   use emcon_rotation, only : cross_product
   use emcon_tie_shapes_space, only : most_nodes, tie_shapes
   use emcon_tie_sides_space, only : tie_sides_reach, tie_sides_t, triangle_at
   implicit none
   private
   public :: tie_cells_t, tie_cells_find

   !> Gauss points along each of two ways through a triangle, exact for products of shape functions:
   !> of degree 2 in all; of degree 6 where a facet has nodes between its corners. Where one is no
   !> parallelogram they are no polynomials: what is left falls as the 16th power of the skew.
   integer, parameter :: n_linear = 2, n_quadratic = 4, n_skew = 8
   !> Nodes of facets that have none between their corners, at most.
   integer, parameter :: most_linear = 4
   !> Triangles face each other whose normals are within 60 degrees of opposite: where a surface
   !> turns by more, it has an edge.
   real(wp), parameter :: facing = -0.5_wp

   !> The common polygons of one slave facet.
   type :: tie_cells_t
      integer :: n = 0                           !! master triangles that cover a part of it
      integer, allocatable :: triangle(:)        !! (at least n) their numbers
      real(wp), allocatable :: area(:)           !! (at least n) what is covered of each [L^2]
      !> (node of the facet, node of the master's, at least n) int N_i N_j [L^2]
      real(wp), allocatable :: cross(:, :, :)
      real(wp) :: mass(most_nodes, most_nodes) = 0.0_wp      !! int N_i N_j [L^2]
      real(wp) :: whole = 0.0_wp                 !! area of the facet's triangles [L^2]
      real(wp) :: covered = 0.0_wp               !! of that [L^2]
      real(wp) :: most = 0.0_wp                  !! largest part of a triangle: > 1 in two layers
   end type tie_cells_t

contains

   !> The common polygons of slave facet `f`.
   pure subroutine tie_cells_find(self, sides, f)
      type(tie_cells_t), intent(inout) :: self   !! its arrays are used again
      type(tie_sides_t), intent(in) :: sides
      integer, intent(in) :: f                   !! 1 to n_facet of the slave
      real(wp) :: corner(3, 3), normal(3), before, reach
      integer, allocatable :: found(:)
      integer :: s, i, n

      self%n = 0
      self%mass = 0.0_wp
      self%whole = 0.0_wp
      self%covered = 0.0_wp
      self%most = 0.0_wp
      allocate(found(0))
      reach = tie_sides_reach(sides, facets_length(sides%slave%facets, f))
      associate (split => sides%slave%split)
         do s = split%start(f), split%start(f + 1) - 1
            corner = triangle_at(sides%slave, s)
            normal = cross_product(corner(:, 2) - corner(:, 1), corner(:, 3) - corner(:, 1))
            if (.not. dot_product(normal, normal) > 0.0_wp) cycle
            self%whole = self%whole + 0.5_wp*norm2(normal)
            before = self%covered
            n = 0
            call box_tree_find(sides%tree, minval(corner, 2), maxval(corner, 2), reach, found, n)
            do i = 1, n
               call add_cell(self, sides, s, corner, normal, found(i))
            end do
            self%most = max(self%most, (self%covered - before)/(0.5_wp*norm2(normal)))
         end do
      end associate
   end subroutine tie_cells_find

   !> Add what master triangle `t` covers of a slave triangle, if it faces that and is within reach.
   pure subroutine add_cell(self, sides, s, corner, normal, t)
      type(tie_cells_t), intent(inout) :: self
      type(tie_sides_t), intent(in) :: sides
      integer, intent(in) :: s                   !! the slave triangle
      real(wp), intent(in) :: corner(3, 3)       !! of it [L]
      real(wp), intent(in) :: normal(3)          !! twice as long as its area [L^2]
      integer, intent(in) :: t                   !! the master triangle
      real(wp) :: other(3, 3), place(2, 3), height(3), polygon(2, most_corners), across(3), length
      integer :: n

      other = triangle_at(sides%master, t)
      across = cross_product(other(:, 2) - other(:, 1), other(:, 3) - other(:, 1))
      if (dot_product(across, normal) > facing*norm2(across)*norm2(normal)) return
      call project(corner, normal, other, place, height)
      if (polygon_misses(triangle_sides, place)) return
      call polygon_clip(triangle_sides, place, polygon, n)
      if (n < 3) return
      length = max(facets_length(sides%slave%facets, sides%slave%split%facet(s)), &
         facets_length(sides%master%facets, sides%master%split%facet(t)))
      if (abs(dot_product(height, barycentric(place, sum(polygon(:, :n), 2)/n))) &
         > tie_sides_reach(sides, length)) return
      call make_room(self)
      self%n = self%n + 1
      self%triangle(self%n) = t
      call integrate(self, sides, s, place, polygon(:, :n), norm2(normal))
      self%area(self%n) = self%area(self%n)*(norm2(across)*norm2(normal) &
         /abs(dot_product(across, normal)))
   end subroutine add_cell

   !> Places of the corners of a master triangle in the coordinates of a slave one, in which that is
   !> the patch, and their heights over it; counter-clockwise there.
   pure subroutine project(corner, normal, other, place, height)
      real(wp), intent(in) :: corner(3, 3), normal(3), other(3, 3)
      real(wp), intent(out) :: place(2, 3)
      real(wp), intent(out) :: height(3)         !! [L]
      real(wp) :: offset(3), square
      integer :: v

      square = dot_product(normal, normal)
      do v = 1, 3
         offset = other(:, v) - corner(:, 1)
         place(1, v) = dot_product(cross_product(offset, corner(:, 3) - corner(:, 1)), normal) &
            /square
         place(2, v) = dot_product(cross_product(corner(:, 2) - corner(:, 1), offset), normal) &
            /square
         height(v) = dot_product(offset, normal)/sqrt(square)
      end do
   end subroutine project

   !> Integrals over the polygon that slave triangle `s` and the last master triangle share.
   pure subroutine integrate(self, sides, s, place, polygon, twice)
      type(tie_cells_t), intent(inout) :: self
      type(tie_sides_t), intent(in) :: sides
      integer, intent(in) :: s
      real(wp), intent(in) :: place(2, 3)        !! corners of the master triangle
      real(wp), intent(in) :: polygon(:, :)      !! (2, corners), clockwise: the master faces it
      real(wp), intent(in) :: twice              !! the area of the slave triangle [L^2]
      real(wp) :: at(n_skew), weight(n_skew), point(2), part, total
      real(wp) :: own(most_nodes), other(most_nodes)
      integer :: k, i, j, n, m, n_point

      n = count(sides%slave%facets%corner(:, sides%slave%split%facet(s)) > 0)
      associate (t => self%triangle(self%n), split => sides%master%split, &
            f => sides%slave%split%facet(s), g => sides%master%split%facet(self%triangle(self%n)))
         m = count(sides%master%facets%corner(:, split%facet(t)) > 0)
         n_point = merge(n_linear, n_quadratic, max(n, m) <= most_linear)
         if (any(abs(sides%slave%skew(:, f)) > 0.0_wp) .or. &
            any(abs(sides%master%skew(:, g)) > 0.0_wp)) n_point = n_skew
         call gauss_points(at(:n_point), weight(:n_point))
         total = 0.0_wp
         self%cross(:, :, self%n) = 0.0_wp
         do k = 2, size(polygon, 2) - 1
            associate (a => polygon(:, k + 1) - polygon(:, 1), b => polygon(:, k) &
                  - polygon(:, k + 1))
               do j = 1, n_point
                  do i = 1, n_point
                     point = polygon(:, 1) + at(i)*(a + at(j)*b)
                     part = at(i)*weight(i)*weight(j)*twice*(a(1)*b(2) - a(2)*b(1))
                     own(:n) = tie_shapes(n, s - sides%slave%split%start(f) + 1, &
                        [1.0_wp - sum(point), point], sides%slave%skew(:, f))
                     other(:m) = tie_shapes(m, t - split%start(g) + 1, &
                        barycentric(place, point), sides%master%skew(:, g))
                     total = total + part
                     self%mass(:n, :n) = self%mass(:n, :n) + part*outer(own(:n), own(:n))
                     self%cross(:n, :m, self%n) = self%cross(:n, :m, self%n) &
                        + part*outer(own(:n), other(:m))
                  end do
               end do
            end associate
         end do
      end associate
      self%covered = self%covered + total
      self%area(self%n) = total
   end subroutine integrate

   pure function outer(a, b)
      real(wp), intent(in) :: a(:), b(:)
      real(wp) :: outer(size(a), size(b))

      outer = spread(a, 2, size(b))*spread(b, 1, size(a))
   end function outer

   !> Room for one more triangle.
   pure subroutine make_room(self)
      type(tie_cells_t), intent(inout) :: self
      type(tie_cells_t) :: old
      integer :: n

      if (.not. allocated(self%triangle)) then
         allocate(self%triangle(most_nodes), self%area(most_nodes))
         allocate(self%cross(most_nodes, most_nodes, most_nodes))
      end if
      n = size(self%triangle)
      if (self%n < n) return
      old = self
      deallocate(self%triangle, self%area, self%cross)
      allocate(self%triangle(2*n), self%area(2*n), self%cross(most_nodes, most_nodes, 2*n))
      self%triangle(:n) = old%triangle
      self%area(:n) = old%area
      self%cross(:, :, :n) = old%cross
   end subroutine make_room

end module emcon_tie_cells_space
