!> When surfaces in space that move along a given way touch for the first time, however far apart
!> they are.
!>
!> A node passes through a triangle where the volume between them, cubic in time, falls through 0.
!> Looked at are spans of time that grow, until a node has met a triangle or all have passed by.
module emcon_first_touch_space
   use emcon_box_tree, only : box_tree_find, box_tree_init, box_tree_t
   use emcon_errors, only : error_t
   use emcon_facet_split, only : facet_split_init, facet_split_place, facet_split_t
   use emcon_facets, only : facets_init, facets_t
   use emcon_first_touch_wall_space, only : wall_touch_time
   use emcon_interactions, only : formulation_user, pair_acts
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   use emcon_scene, only : scene_t
   use emcon_surface_nodes, only : surface_nodes
   implicit none
   private
   public :: touch_time

   !> A node counts as over a triangle so far past its sides, per triangle: rims meet rims.
   real(wp), parameter :: end_tol = 1.0e-3_wp
   !> How much a span of time is longer than the one before.
   real(wp), parameter :: growth = 4.0_wp
   !> After ways as long as so many extents of the two surfaces they have passed by each other.
   real(wp), parameter :: longest_way = 64.0_wp
   integer, parameter :: n_dim = 3, n_vertex = 3

   !> One of two surfaces: the points of its split facets.
   type :: side_t
      type(facets_t) :: facets
      type(facet_split_t) :: split
      real(wp), allocatable :: at(:, :)          !! (3, n_point) [L]
      real(wp), allocatable :: way(:, :)         !! (3, n_point) per time [L]
   end type side_t

contains

   !> The first time at which a node of a contact pair that acts passes through a facet of the
   !> other surface from outside, or the layer in front of it; huge if that never happens.
   real(wp) function touch_time(scene, i_step, x, direction)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! of the deck
      real(wp), intent(in) :: x(:, :)            !! (3, n_node) where nodes are [L]
      real(wp), intent(in) :: direction(:, :)    !! (3, n_node) how they move per time [L]
      type(side_t) :: slave, master
      integer, allocatable :: node(:)
      integer :: i

      touch_time = huge(touch_time)
      do i = 1, size(scene%pair)
         if (scene%pair(i)%formulation == formulation_user) cycle   ! it sees all gaps itself
         if (.not. pair_acts(scene%pair(i), i_step)) cycle
         associate (offset => scene%pair(i)%interaction%offset, &
               other => scene%surface(scene%pair(i)%master))
            if (allocated(other%wall)) then
               call surface_nodes(scene, scene%surface(scene%pair(i)%slave), node)
               touch_time = min(touch_time, wall_touch_time(other%wall, node, x, direction, offset))
               cycle
            end if
            call find_side(scene, scene%pair(i)%slave, x, direction, slave)
            call find_side(scene, scene%pair(i)%master, x, direction, master)
            call look_at(slave, master, offset, touch_time)
            call look_at(master, slave, offset, touch_time)
         end associate
      end do
   end function touch_time

   !> Where the points of surface `number` are, and how they move.
   subroutine find_side(scene, number, x, direction, side)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: number
      real(wp), intent(in) :: x(:, :), direction(:, :)
      type(side_t), intent(out) :: side
      type(error_t), allocatable :: error
      real(wp) :: still(size(x, 1), size(x, 2))

      call facets_init(side%facets, scene, scene%surface(number), error)   ! it was, and is the same
      call facet_split_init(side%split, side%facets)
      allocate(side%at(n_dim, side%split%n_point), side%way(n_dim, side%split%n_point))
      still = 0.0_wp
      call facet_split_place(side%split, side%facets, x, still, side%at)
      call facet_split_place(side%split, side%facets, direction, still, side%way)
   end subroutine find_side

   !> The first time before `first` at which a node of `one` passes through a triangle of `other`.
   subroutine look_at(one, other, offset, first)
      type(side_t), intent(in) :: one, other
      real(wp), intent(in) :: offset             !! thickness of the layer [L]
      real(wp), intent(inout) :: first
      type(box_tree_t) :: tree
      integer, allocatable :: found(:)
      real(wp) :: span, extent, fastest, low(n_dim, size(other%split%facet)), &
         high(n_dim, size(other%split%facet))
      integer :: i, k, n

      if (size(low, n_dim - 1) == 0) return
      fastest = sqrt(max(maxval(sum(one%way**2, 1)), maxval(sum(other%way**2, 1))))
      if (.not. fastest > 0.0_wp) return
      extent = maxval(max(maxval(one%at, n_dim - 1), maxval(other%at, n_dim - 1)) &
         - min(minval(one%at, n_dim - 1), minval(other%at, n_dim - 1)))
      span = extent/(longest_way*fastest)
      allocate(found(0))
      do
         do k = 1, size(low, n_dim - 1)
            associate (vertex => other%split%corner(:, k))
               call find_box(other%at(:, vertex), other%way(:, vertex), span, low(:, k), high(:, k))
            end associate
         end do
         call box_tree_init(tree, low, high)
         do i = 1, one%split%n_node
            call look_from(i)
         end do
         if (first <= span .or. span*fastest > longest_way*extent) exit
         span = growth*span
      end do

   contains

      !> Node `i` and what is in its way within `span`.
      subroutine look_from(i)
         integer, intent(in) :: i
         real(wp), dimension(n_dim) :: bottom, top

         call find_box(one%at(:, i:i), one%way(:, i:i), span, bottom, top)
         n = 0
         call box_tree_find(tree, bottom, top, offset, found, n)
         do k = 1, n
            associate (vertex => other%split%corner(:, found(k)))
               if (any(other%facets%facet(:, other%split%facet(found(k))) &
                  == one%facets%node(i))) then
                  cycle
               end if
               call pass(one%at(:, i), one%way(:, i), lifted(other%at(:, vertex), offset), &
                  other%way(:, vertex), min(first, span), first)
            end associate
         end do
      end subroutine look_from

   end subroutine look_at

   !> The box of points on their way.
   pure subroutine find_box(at, way, span, low, high)
      real(wp), intent(in) :: at(:, :), way(:, :), span
      real(wp), intent(out) :: low(:), high(:)

      low = min(minval(at, n_dim - 1), minval(at + span*way, n_dim - 1))
      high = max(maxval(at, n_dim - 1), maxval(at + span*way, n_dim - 1))
   end subroutine find_box

   !> A triangle moved outwards.
   pure function lifted(at, offset)
      real(wp), intent(in) :: at(:, :), offset
      real(wp) :: lifted(n_dim, n_vertex), normal(n_dim)

      normal = cross_product(at(:, n_vertex - 1) - at(:, 1), at(:, n_vertex) - at(:, 1))
      lifted = at + spread(offset*normal/sqrt(dot_product(normal, normal)), n_dim - 1, n_vertex)
   end function lifted

   !> Make `first` the time up to `last` at which a point passes through a triangle from outside:
   !> the volume v(0) + v(1) t + v(2) t^2 + v(3) t^3 falls through zero there, within the triangle.
   pure subroutine pass(point, point_way, at, way, last, first)
      real(wp), intent(in) :: point(:), point_way(:), at(:, :), way(:, :), last
      real(wp), intent(inout) :: first
      real(wp), dimension(n_dim) :: d, dd, a, da, b, db, n0, n1, n2
      real(wp) :: v(0:n_dim), time(0:n_dim), middle, low, high
      integer :: i, m

      d = point - at(:, 1)
      dd = point_way - way(:, 1)
      a = at(:, n_vertex - 1) - at(:, 1)
      da = way(:, n_vertex - 1) - way(:, 1)
      b = at(:, n_vertex) - at(:, 1)
      db = way(:, n_vertex) - way(:, 1)
      n0 = cross_product(a, b)
      n1 = cross_product(da, b) + cross_product(a, db)
      n2 = cross_product(da, db)
      v = [dot_product(d, n0), dot_product(dd, n0) + dot_product(d, n1), &
         dot_product(dd, n1) + dot_product(d, n2), dot_product(dd, n2)]
      time = turning_times(v, last)
      do i = 1, n_dim
         low = time(i - 1)
         high = time(i)
         if (.not. (volume(low) > 0.0_wp .and. volume(high) <= 0.0_wp)) cycle
         do m = 1, digits(low)
            middle = low + 0.5_wp*(high - low)
            if (volume(middle) > 0.0_wp) then
               low = middle
            else
               high = middle
            end if
         end do
         if (.not. is_within(d + high*dd, a + high*da, b + high*db)) cycle
         first = min(first, high)
         return
      end do

   contains

      pure real(wp) function volume(t)
         real(wp), intent(in) :: t

         volume = v(0) + t*(v(1) + t*(v(n_dim - 1) + t*v(n_dim)))
      end function volume

   end subroutine pass

   !> 0, the times before `last` at which a cubic turns, `last`: it rises or falls in between.
   pure function turning_times(v, last) result(time)
      real(wp), intent(in) :: v(0:), last
      real(wp) :: time(0:n_dim), a, b, c, q

      time = last
      time(0) = 0.0_wp
      a = 3.0_wp*v(n_dim)
      b = 2.0_wp*v(n_dim - 1)
      c = v(1)
      q = b**2 - 4.0_wp*a*c
      if (q < 0.0_wp) return
      q = -0.5_wp*(b + sign(sqrt(q), b))
      if (abs(q)*last > abs(c)) time(1) = min(last, max(0.0_wp, c/q))
      if (abs(a)*last > abs(q)) time(n_dim - 1) = min(last, max(0.0_wp, q/a))
      if (time(1) > time(n_dim - 1)) time(1:n_dim - 1) = time(n_dim - 1:1:-1)
   end function turning_times

   !> Is the foot of `d` within the triangle of sides `a`, `b` from one corner?
   pure logical function is_within(d, a, b)
      real(wp), intent(in) :: d(:), a(:), b(:)
      real(wp) :: normal(n_dim), along_a, along_b

      normal = cross_product(a, b)
      along_a = dot_product(normal, cross_product(d, b))/dot_product(normal, normal)
      along_b = dot_product(normal, cross_product(a, d))/dot_product(normal, normal)
      is_within = min(along_a, along_b, 1.0_wp - along_a - along_b) >= -end_tol
   end function is_within

end module emcon_first_touch_space
