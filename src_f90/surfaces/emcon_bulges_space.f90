!> How far the curved surface that facets stand for rises over them: its nodes are on it, what lies
!> between them is not.
!>
!> At each node a surface of second order is put through the nodes around it. Along a side of a
!> triangle the surface rises by the mean of the curvatures at its ends. Source: docs/theory.md,
!> section 14.
module emcon_bulges_space
   use emcon_facet_groups, only : facet_groups_init, facet_groups_t
   use emcon_facet_split, only : facet_split_centre, facet_split_t
   use emcon_facets, only : facets_normal, facets_t
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   use emcon_sort, only : unique_sorted
   implicit none
   private
   public :: bulges_t, bulges_find, bulges_largest, bulges_doubt, bulges_rise

   !> Slopes and curvatures of a surface of second order through a node, and the square of heights,
   !> with which spheres and cylinders are exact.
   integer, parameter :: n_form = 6
   !> What the nodes around do not tell of it is taken as 0: they tell less than this part.
   real(wp), parameter :: unknown = sqrt(epsilon(1.0_wp))
   !> Facets within 60 degrees of the normal are of one surface with it.
   real(wp), parameter :: alike = 0.5_wp
   !> Tubes of unlike meshes, four to sixteen faces around a quarter, had the pressure of an
   !> interference that was wrong by up to this part of the rises.
   real(wp), parameter :: doubtful = 0.01_wp

   type :: bulges_t
      !> (3, n_triangle) rise over side k of a triangle, by the product of the weights of its ends,
      !> > 0 outwards [L]
      real(wp), allocatable :: side(:, :)
      real(wp), allocatable :: point(:)          !! (n_point) rise over it; 0 at nodes [L]
   end type bulges_t

contains

   !> Find what the triangles of a surface are below the one that was meshed.
   pure subroutine bulges_find(self, facets, split, x, angle)
      type(bulges_t), intent(out) :: self
      type(facets_t), intent(in) :: facets       !! in space
      type(facet_split_t), intent(in) :: split   !! of them
      real(wp), intent(in), contiguous :: x(:, :)   !! (3, n_node of the scene) reference [L]
      real(wp), intent(in) :: angle              !! sharper turns are corners [degrees]
      type(facet_groups_t) :: groups
      real(wp), allocatable :: curvature(:, :, :)
      integer :: f, g, i, k, m

      call facet_groups_init(groups, facets, x, angle)
      allocate(curvature(3, 3, groups%n_group))
      do i = 1, size(facets%node)
         do g = groups%node_start(i), groups%node_start(i + 1) - 1
            call fit(facets, groups, i, g, x, curvature(:, :, g))
         end do
      end do
      allocate(self%side(3, size(split%facet)), self%point(split%n_point), source=0.0_wp)
      do f = 1, facets%n_facet
         m = count(facets%corner(:, f) > 0)
         call rise_of_facet(self, split, f, x(:, facets%facet(:m, f)), curvature(:, :, &
            [(group_of(groups, facets%corner(k, f), f), k = 1, m)]))
      end do
   end subroutine bulges_find

   !> The rises over the triangles of facet `f`, whose nodes are at `x` with such curvatures.
   pure subroutine rise_of_facet(self, split, f, x, curvature)
      type(bulges_t), intent(inout) :: self
      type(facet_split_t), intent(in) :: split
      integer, intent(in) :: f
      real(wp), intent(in) :: x(:, :), curvature(:, :, :)    !! (3, m), (3, 3, m)
      real(wp) :: at(3, size(x, 2) + 1), bent(3, 3, size(x, 2) + 1), weight(size(x, 2))
      integer :: corner(3), k, m, t

      m = size(x, 2)
      at(:, :m) = x
      bent(:, :, :m) = curvature
      weight = facet_split_centre(m)
      at(:, m + 1) = matmul(x, weight)
      bent(:, :, m + 1) = sum(curvature, 3)/real(m, wp)
      if (split%centre(f) > 0) self%point(split%centre(f)) = arc_of(dot_product( &
         weight, [(along(bent(:, :, k), at(:, k) - at(:, m + 1)), k = 1, m)]), &
         sum((at(:, :m) - spread(at(:, m + 1), 2, m))**2)/real(m, wp))
      do t = split%start(f), split%start(f + 1) - 1
         k = t - split%start(f) + 1
         corner = [1, 2, 3]
         if (split%centre(f) > 0) corner = [k, 1 + mod(k, m), m + 1]
         do k = 1, 3
            associate (a => corner(k), b => corner(1 + mod(k, 3)))
               self%side(k, t) = 4.0_wp*arc_of(0.25_wp*along(0.5_wp*(bent(:, :, a) &
                  + bent(:, :, b)), at(:, b) - at(:, a)), 0.25_wp*sum((at(:, b) - at(:, a))**2))
            end associate
         end do
      end do

   contains

      !> Half of the second derivative along `way`: what a surface falls by over it.
      pure real(wp) function along(tensor, way)
         real(wp), intent(in) :: tensor(3, 3)    !! [1/L]
         real(wp), intent(in) :: way(3)          !! [L]

         along = 0.5_wp*dot_product(way, matmul(tensor, way))
      end function along

      !> How far an arc rises over the middle of its chord, where a parabola rises by `height`.
      pure real(wp) function arc_of(height, square)
         real(wp), intent(in) :: height          !! [L]
         real(wp), intent(in) :: square          !! of half of the chord [L^2]

         arc_of = height
         if (square > 0.0_wp) arc_of = 2.0_wp*height/(1.0_wp + sqrt(max(0.0_wp, 1.0_wp &
            - 4.0_wp*height**2/square)))
      end function arc_of

   end subroutine rise_of_facet

   !> The group of facet `f` at node `i`.
   pure integer function group_of(groups, i, f)
      type(facet_groups_t), intent(in) :: groups
      integer, intent(in) :: i, f

      do group_of = groups%node_start(i), groups%node_start(i + 1) - 1
         if (any(groups%facet(groups%start(group_of):groups%start(group_of + 1) - 1) == f)) return
      end do
   end function group_of

   !> The curvature of a surface at node `i`, of the facets of group `g`, as a form of ways along
   !> it: > 0 where it is convex [1/L].
   pure subroutine fit(facets, groups, i, g, x, curvature)
      type(facets_t), intent(in) :: facets
      type(facet_groups_t), intent(in) :: groups
      integer, intent(in) :: i, g
      real(wp), intent(in), contiguous :: x(:, :)
      real(wp), intent(out) :: curvature(3, 3)
      integer, allocatable :: around(:)
      real(wp) :: axis(3, 3), way(3), row(n_form), square(n_form, n_form), right(n_form), size_of
      integer :: k

      curvature = 0.0_wp
      call find_axes(facets, groups, g, i, x, axis)
      if (.not. any(abs(axis) > 0.0_wp)) return
      call find_around(facets, groups, i, g, x, axis(:, 3), around)
      size_of = 0.0_wp
      do k = 1, size(around)
         way = x(:, facets%node(around(k))) - x(:, facets%node(i))
         size_of = max(size_of, sqrt(dot_product(way, way)))
      end do
      square = 0.0_wp
      right = 0.0_wp
      do k = 1, size(around)
         way = matmul(x(:, facets%node(around(k))) - x(:, facets%node(i)), axis)/size_of
         ! The nearer, the more it counts. With the root the least solution is the same in all axes.
         row = [way(1), way(2), -0.5_wp*way(1)**2, -sqrt(0.5_wp)*way(1)*way(2), &
            -0.5_wp*way(2:)**2]/dot_product(way, way)
         square = square + spread(row, 2, n_form)*spread(row, 1, n_form)
         right = right + way(3)/dot_product(way, way)*row
      end do
      call solve(square, right)
      right(3:5) = right(3:5)/(size_of*sqrt(1.0_wp + right(1)**2 + right(2)**2))
      associate (p => axis(:, 1), q => axis(:, 2))
         curvature = right(3)*outer(p, p) + sqrt(0.5_wp)*right(4)*(outer(p, q) + outer(q, p)) &
            + right(5)*outer(q, q)
      end associate
   end subroutine fit

   pure function outer(a, b)
      real(wp), intent(in) :: a(3), b(3)
      real(wp) :: outer(3, 3)

      outer = spread(a, 2, 3)*spread(b, 1, 3)
   end function outer

   !> Two directions along the facets of a group, and the normal; 0 if there is none.
   pure subroutine find_axes(facets, groups, g, i, x, axis)
      type(facets_t), intent(in) :: facets
      type(facet_groups_t), intent(in) :: groups
      integer, intent(in) :: g, i
      real(wp), intent(in), contiguous :: x(:, :)
      real(wp), intent(out) :: axis(3, 3)
      real(wp) :: still(3, size(x, 2)), normal(3), first(3)
      integer :: k

      axis = 0.0_wp
      still = 0.0_wp
      normal = 0.0_wp
      do k = groups%start(g), groups%start(g + 1) - 1
         normal = normal + facets_normal(facets, groups%facet(k), x, still)
      end do
      if (.not. dot_product(normal, normal) > 0.0_wp) return
      normal = normal/sqrt(dot_product(normal, normal))
      first = x(:, facets%node(groups%ring(groups%ring_start(g)))) - x(:, facets%node(i))
      first = first - dot_product(first, normal)*normal
      if (.not. dot_product(first, first) > 0.0_wp) return
      first = first/sqrt(dot_product(first, first))
      axis = reshape([first, cross_product(normal, first), normal], shape(axis))
   end subroutine find_axes

   !> The nodes of a group around node `i`, and those around them that are of one surface with it.
   pure subroutine find_around(facets, groups, i, g, x, normal, around)
      type(facets_t), intent(in) :: facets
      type(facet_groups_t), intent(in) :: groups
      integer, intent(in) :: i, g
      real(wp), intent(in), contiguous :: x(:, :)
      real(wp), intent(in) :: normal(3)
      integer, allocatable, intent(out) :: around(:)
      real(wp) :: still(3, size(x, 2)), own(3)
      integer :: j, k

      still = 0.0_wp
      around = groups%ring(groups%ring_start(g):groups%ring_start(g + 1) - 1)
      do j = groups%ring_start(g), groups%ring_start(g + 1) - 1
         associate (first => facets%around_start(groups%ring(j)), &
               last => facets%around_start(groups%ring(j) + 1) - 1)
            do k = first, last
               own = facets_normal(facets, facets%around(k), x, still)
               if (.not. dot_product(own, normal) > alike*sqrt(dot_product(own, own))) cycle
               around = [around, pack(facets%corner(:, facets%around(k)), &
                  facets%corner(:, facets%around(k)) > 0)]
            end do
         end associate
      end do
      around = unique_sorted(pack(around, around /= i))
   end subroutine find_around

   !> Solve a symmetric system whose matrix may be singular: the least solution.
   pure subroutine solve(square, right)
      real(wp), intent(inout) :: square(:, :)    !! (n, n), none is negative; out: rubbish
      real(wp), intent(inout) :: right(:)        !! (n) out: the solution
      real(wp) :: ridge
      integer :: i, k

      ridge = unknown*maxval([(square(i, i), i = 1, size(right))])
      do i = 1, size(right)
         square(i, i) = square(i, i) + ridge
      end do
      do i = 1, size(right)
         do k = i + 1, size(right)
            associate (factor => square(k, i)/square(i, i))
               right(k) = right(k) - factor*right(i)
               square(k, i:) = square(k, i:) - factor*square(i, i:)
            end associate
         end do
      end do
      do i = size(right), 1, -1
         right(i) = (right(i) - dot_product(square(i, i + 1:), right(i + 1:)))/square(i, i)
      end do
   end subroutine solve

   !> The rise over a place of triangle `t`.
   pure real(wp) function bulges_rise(self, split, t, weight) result(rise)
      type(bulges_t), intent(in) :: self
      type(facet_split_t), intent(in) :: split
      integer, intent(in) :: t                   !! 1 to n_triangle
      real(wp), intent(in) :: weight(3)          !! of its corners, of sum 1

      rise = dot_product(weight, self%point(split%corner(:, t))) &
         + dot_product(weight*cshift(weight, 1), self%side(:, t))
   end function bulges_rise

   !> The largest rise over any triangle, in or out, by the length of its facet: at most that of its
   !> corners, and of all its sides in the middle.
   pure real(wp) function bulges_largest(self, split, length) result(largest)
      type(bulges_t), intent(in) :: self
      type(facet_split_t), intent(in) :: split
      real(wp), intent(in) :: length(:)          !! (n_triangle) of the facets that they are of [L]
      integer :: t

      largest = 0.0_wp
      do t = 1, size(length)
         largest = max(largest, (maxval(abs(self%point(split%corner(:, t)))) &
            + 0.25_wp*maxval(abs(self%side(:, t))))/length(t))
      end do
   end function bulges_largest

   !> How wrong rises may be [L].
   pure real(wp) function bulges_doubt(self, split) result(doubt)
      type(bulges_t), intent(in) :: self
      type(facet_split_t), intent(in) :: split
      integer :: t

      doubt = doubtful*bulges_largest(self, split, [(1.0_wp, t = 1, size(split%facet))])
   end function bulges_doubt

end module emcon_bulges_space
