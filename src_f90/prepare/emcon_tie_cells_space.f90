!> What a slave facet of a tie and the master have in common, triangle by triangle, and the
!> integrals of shape functions over it.
!>
!> Each triangle of the slave facet is a plane. Triangles of the master that face it are projected
!> along its normal and clipped by its sides; D and M are integrals over the same polygons, so that
!> the rows of a tie sum up to 0. Source: docs/theory.md, section 11.10.
module emcon_tie_cells_space
   use emcon_box_tree, only : box_tree_find
   use emcon_facet_split, only : facet_split_centre
   use emcon_facets, only : facets_length
   use emcon_kinds, only : wp
   use emcon_patch_moments_space, only : barycentric, most_corners, patch_clip, patch_misses
   use emcon_rotation, only : cross_product
   use emcon_tie_sides_space, only : tie_sides_reach, tie_sides_t, triangle_at
   implicit none
   private
   public :: tie_cells_t, tie_cells_find, most_nodes

   !> Nodes of a facet, at most.
   integer, parameter :: most_nodes = 8
   !> Triangles face each other whose normals are within 60 degrees of opposite: where a surface
   !> turns by more, it has an edge.
   real(wp), parameter :: facing = -0.5_wp

   !> The common polygons of one slave facet.
   type :: tie_cells_t
      integer :: n = 0                           !! master triangles that cover a part of it
      integer, allocatable :: triangle(:)        !! (at least n) their numbers
      real(wp), allocatable :: area(:)           !! (at least n) what is covered of each [L^2]
      !> (node of the facet, corner of the triangle, at least n) int N_i L_v [L^2]
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
      real(wp) :: corner(3, 3), normal(3), share(most_nodes, 3), before, reach
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
            share = shares_of_nodes(count(sides%slave%facets%corner(:, f) > 0), &
               s - split%start(f) + 1)
            self%whole = self%whole + 0.5_wp*norm2(normal)
            before = self%covered
            n = 0
            call box_tree_find(sides%tree, minval(corner, 2), maxval(corner, 2), reach, found, n)
            do i = 1, n
               call add_cell(self, sides, f, corner, normal, share, found(i))
            end do
            self%most = max(self%most, (self%covered - before)/(0.5_wp*norm2(normal)))
         end do
      end associate
   end subroutine tie_cells_find

   !> The weights of the nodes of a facet in the corners of triangle `k` of its split.
   pure function shares_of_nodes(n, k) result(share)
      integer, intent(in) :: n                   !! nodes of the facet
      integer, intent(in) :: k                   !! 1 to the number of its triangles
      real(wp) :: share(most_nodes, 3)

      share = 0.0_wp
      share(k, 1) = 1.0_wp
      share(1 + mod(k, n), 2) = 1.0_wp
      if (n == 3) then
         share(3, 3) = 1.0_wp
      else
         share(:n, 3) = facet_split_centre(n)
      end if
   end function shares_of_nodes

   !> Add what master triangle `t` covers of a slave triangle, if it faces that and is within reach.
   pure subroutine add_cell(self, sides, f, corner, normal, share, t)
      type(tie_cells_t), intent(inout) :: self
      type(tie_sides_t), intent(in) :: sides
      integer, intent(in) :: f                   !! the slave facet
      real(wp), intent(in) :: corner(3, 3)       !! of the slave triangle [L]
      real(wp), intent(in) :: normal(3)          !! twice as long as its area [L^2]
      real(wp), intent(in) :: share(most_nodes, 3)
      integer, intent(in) :: t                   !! the master triangle
      real(wp) :: other(3, 3), place(2, 3), height(3), polygon(2, most_corners), across(3), length
      integer :: n

      other = triangle_at(sides%master, t)
      across = cross_product(other(:, 2) - other(:, 1), other(:, 3) - other(:, 1))
      if (dot_product(across, normal) > facing*norm2(across)*norm2(normal)) return
      call project(corner, normal, other, place, height)
      if (patch_misses(place)) return
      call patch_clip(place, polygon, n)
      if (n < 3) return
      length = max(facets_length(sides%slave%facets, f), &
         facets_length(sides%master%facets, sides%master%split%facet(t)))
      if (abs(dot_product(height, barycentric(place, sum(polygon(:, :n), 2)/n))) &
         > tie_sides_reach(sides, length)) return
      call make_room(self)
      self%n = self%n + 1
      self%triangle(self%n) = t
      call integrate(self, place, polygon(:, :n), share, norm2(normal))
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

   !> Integrals over a polygon, by the middles of the sides of the triangles that it is made of: all
   !> integrands are quadratic.
   pure subroutine integrate(self, place, polygon, share, twice)
      type(tie_cells_t), intent(inout) :: self
      real(wp), intent(in) :: place(2, 3)        !! corners of the master triangle
      real(wp), intent(in) :: polygon(:, :)      !! (2, corners), clockwise: the master faces it
      real(wp), intent(in) :: share(most_nodes, 3)
      real(wp), intent(in) :: twice              !! the area of the slave triangle [L^2]
      real(wp) :: own(3, 3), both(3, 3), corner(2, 3), point(2), here(3), area, total
      integer :: k, i

      own = 0.0_wp
      both = 0.0_wp
      total = 0.0_wp
      do k = 2, size(polygon, 2) - 1
         corner = polygon(:, [1, k + 1, k])
         area = 0.5_wp*twice*((corner(1, 2) - corner(1, 1))*(corner(2, 3) - corner(2, 1)) &
            - (corner(2, 2) - corner(2, 1))*(corner(1, 3) - corner(1, 1)))
         total = total + area
         do i = 1, 3
            point = 0.5_wp*(corner(:, i) + corner(:, 1 + mod(i, 3)))
            here = [1.0_wp - sum(point), point]
            own = own + area/3.0_wp*spread(here, 2, 3)*spread(here, 1, 3)
            both = both + area/3.0_wp*spread(here, 2, 3)*spread(barycentric(place, point), 1, 3)
         end do
      end do
      self%covered = self%covered + total
      self%area(self%n) = total
      self%mass = self%mass + matmul(share, matmul(own, transpose(share)))
      self%cross(:, :, self%n) = matmul(share, both)
   end subroutine integrate

   !> Room for one more triangle.
   pure subroutine make_room(self)
      type(tie_cells_t), intent(inout) :: self
      type(tie_cells_t) :: old
      integer :: n

      if (.not. allocated(self%triangle)) then
         allocate(self%triangle(most_nodes), self%area(most_nodes))
         allocate(self%cross(most_nodes, 3, most_nodes))
      end if
      n = size(self%triangle)
      if (self%n < n) return
      old = self
      deallocate(self%triangle, self%area, self%cross)
      allocate(self%triangle(2*n), self%area(2*n), self%cross(most_nodes, 3, 2*n))
      self%triangle(:n) = old%triangle
      self%area(:n) = old%area
      self%cross(:, :, :n) = old%cross
   end subroutine make_room

end module emcon_tie_cells_space
