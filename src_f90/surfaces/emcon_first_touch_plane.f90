!> When surfaces that move along a given way touch for the first time, however far apart they are.
module emcon_first_touch_plane
   use emcon_interactions, only : formulation_user, pair_acts
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_sort, only : unique_sorted
   use emcon_surface_facets, only : facet_nodes, surface_facets
   use emcon_vectors_plane, only : cross
   implicit none
   private
   public :: touch_time

   !> A node counts as over an edge so far past its ends, per edge: corners meet corners.
   real(wp), parameter :: end_tol = 1.0e-3_wp

contains

   !> The first time at which a node of a contact pair that acts passes through an edge of the
   !> other surface from outside, or the layer in front of it; huge if that never happens. Every
   !> node is looked at with every edge.
   real(wp) function touch_time(scene, i_step, x, direction)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! of the deck
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n_node) where nodes are [L]
      real(wp), intent(in) :: direction(:, :)    !! (n_dim, n_node) how they move per time [L]
      integer, allocatable :: slave(:, :), master(:, :), node(:)
      integer :: i

      touch_time = huge(touch_time)
      do i = 1, size(scene%pair)
         if (scene%pair(i)%formulation == formulation_user) cycle   ! it sees all gaps itself
         if (.not. pair_acts(scene%pair(i), i_step)) cycle
         associate (pair => scene%pair(i))
            call surface_facets(scene, scene%surface(pair%slave), slave)
            call surface_facets(scene, scene%surface(pair%master), master)
            call facet_nodes(scene%surface(pair%slave), slave, node)
         end associate
         touch_time = min(touch_time, nodes_time(node, master, scene%pair(i)%interaction%offset, &
            x, direction))
         node = unique_sorted(reshape(master, [size(master)]))
         touch_time = min(touch_time, nodes_time(node, slave, scene%pair(i)%interaction%offset, &
            x, direction))
      end do
   end function touch_time

   pure real(wp) function nodes_time(node, edge, offset, x, direction)
      integer, intent(in) :: node(:), edge(:, :)
      real(wp), intent(in) :: offset             !! thickness of the layer [L]
      real(wp), intent(in) :: x(:, :), direction(:, :)
      integer :: i, e

      nodes_time = huge(nodes_time)
      do e = 1, size(edge, 2)
         do i = 1, size(node)
            if (any(edge(:, e) == node(i))) cycle
            nodes_time = min(nodes_time, passing_time(lifted(x(:, [node(i), edge(:, e)]), offset), &
               direction(:, [node(i), edge(:, e)])))
         end do
      end do
   end function nodes_time

   !> A node, the first, and an edge, with the edge moved outwards.
   pure function lifted(x, offset)
      real(wp), intent(in) :: x(2, 3), offset
      real(wp) :: lifted(2, 3), e(2)

      e = x(:, 3) - x(:, 2)
      lifted = x
      lifted(:, 2:3) = x(:, 2:3) + spread(offset*[e(2), -e(1)]/sqrt(dot_product(e, e)), 2, 2)
   end function lifted

   !> When a node, the first, passes through the edge of the other two, whose outside is to the
   !> right: the double area a0 + a1 t + a2 t^2 falls through zero there, within the edge.
   pure real(wp) function passing_time(x, v)
      real(wp), intent(in) :: x(2, 3), v(2, 3)
      real(wp) :: e(2), de(2), d(2), dd(2), a0, a1, a2, t
      integer :: i

      passing_time = huge(passing_time)
      e = x(:, 3) - x(:, 2)
      de = v(:, 3) - v(:, 2)
      d = x(:, 1) - x(:, 2)
      dd = v(:, 1) - v(:, 2)
      a0 = cross(d, e)
      a1 = cross(dd, e) + cross(d, de)
      a2 = cross(dd, de)
      do i = 1, 2
         t = root(a0, a1, a2, i)
         if (.not. (t > 0.0_wp .and. t < huge(t))) cycle
         if (a1 + 2.0_wp*a2*t >= 0.0_wp) cycle
         associate (now => e + t*de)
            if (abs(dot_product(d + t*dd, now)/dot_product(now, now) - 0.5_wp) &
               <= 0.5_wp + end_tol) passing_time = min(passing_time, t)
         end associate
      end do
   end function passing_time

   !> Root `i` of a0 + a1 t + a2 t^2, huge where there is none.
   pure real(wp) function root(a0, a1, a2, i)
      real(wp), intent(in) :: a0, a1, a2
      integer, intent(in) :: i
      real(wp) :: q, top, bottom

      root = huge(root)
      q = a1**2 - 4.0_wp*a0*a2
      if (q < 0.0_wp) return
      q = -0.5_wp*(a1 + sign(sqrt(q), a1))
      top = merge(a0, q, i == 1)
      bottom = merge(q, a2, i == 1)
      if (abs(bottom)*sqrt(huge(root)) > abs(top)) root = top/bottom
   end function root

end module emcon_first_touch_plane
