!> The polygon that the gap of a slave node over a master edge is made of: the edge, those beside
!> it, and circles in place of chords.
module emcon_polygon_stencil_plane
   use emcon_chain_plane, only : chain_shorter, chain_t, next, previous
   use emcon_circles_plane, only : circles_t
   use emcon_kinds, only : wp
   use emcon_nts_gap_value, only : edge_round_t, first, last, slave
   use emcon_slip_point, only : slip_point, slip_point_t
   use emcon_vectors_plane, only : between
   implicit none
   private
   public :: polygon_stencil_t, polygon_stencil, edge_of_circle, edge_of_sector, corner_widths, &
      polygon_slip, edge_distance, is_outside, stays_on_circle

   !> In front of an edge by less than this fraction of it is not in front.
   real(wp), parameter :: touch_tol = sqrt(epsilon(1.0_wp))
   !> Corners sharper than this (cosine of the turn) end the polygon: the bisector degenerates.
   real(wp), parameter :: sharpest_cosine = -0.9_wp

   !> A slave node stands on the bisector of a corner if it is nearer to it than this fraction of
   !> the edges there: far above the round-off that a scene gathers.
   real(wp), parameter :: on_bisector = 1.0e-4_wp

   !> A polygon near a slave node; chosen for a step. Slave node and edge come first.
   type :: polygon_stencil_t
      integer :: n = 0
      integer :: node(5) = 0
      integer :: before = 0, after = 0           !! local numbers of the neighbours' nodes; 0: none
      integer :: arm = 0                         !! another node of a rigid body of which the slave
                                                 !! node is one; 0: nothing rolls
      real(wp) :: radius = 0.0_wp                !! of the disc that rolls [L]
      real(wp) :: rounding(2, 2) = 0.0_wp        !! (concave, convex; before and after) half widths
                                                 !! of the corners [L]
      type(edge_round_t) :: round
      logical :: goes_on(2) = .false.            !! before and after the edge the surface does
   end type polygon_stencil_t

contains

   !> The polygon near a slave node over `edge`: the edge and what is there before and after. At a
   !> joint, here as in all stencils, the neighbour is taken to meet the edge at its own node.
   !> Circles take the places of their chords, if they are given.
   pure subroutine polygon_stencil(self, master, slave, edge, x, u0, circles)
      type(polygon_stencil_t), intent(out) :: self
      type(chain_t), intent(in) :: master
      integer, intent(in) :: slave               !! node of the scene
      integer, intent(in) :: edge                !! of `master`, the nearest
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (2, n_node) [L]
      type(circles_t), intent(in), optional :: circles        !! of `master`
      integer :: e

      self%node(1) = slave
      self%node(2:3) = master%facet(:, edge)
      self%n = 3
      if (present(circles)) then
         if (circles%of(edge) > 0) then
            self%round%bend(0) = circles%curvature(edge)*master%size(edge)
            return
         end if
         call take_circle(self, master, circles, edge, previous)
         call take_circle(self, master, circles, edge, next)
      end if
      e = master%neighbour(previous, edge)
      if (e > 0 .and. .not. abs(self%round%bend(-1)) > 0.0_wp) then
         if (is_blunt(x, u0, master%facet(1, e), self%node(2), self%node(3))) then
            self%n = self%n + 1
            self%before = self%n
            self%node(self%n) = master%facet(1, e)
         end if
      end if
      e = master%neighbour(next, edge)
      if (e > 0 .and. .not. abs(self%round%bend(1)) > 0.0_wp) then
         if (is_blunt(x, u0, self%node(2), self%node(3), master%facet(2, e))) then
            self%n = self%n + 1
            self%after = self%n
            self%node(self%n) = master%facet(2, e)
         end if
      end if
   end subroutine polygon_stencil

   !> Half widths of the rounded corners before and after an edge, by the shorter edge at each.
   pure function corner_widths(master, edge, rounding) result(width)
      type(chain_t), intent(in) :: master
      integer, intent(in) :: edge                !! of `master`
      real(wp), intent(in) :: rounding(2)        !! of concave and convex corners, per edge
      real(wp) :: width(2, 2)                    !! (concave, convex; before and after) [L]

      width = spread(rounding, 2, 2)*spread(chain_shorter(master, edge), 1, 2)
   end function corner_widths

   !> The edge whose line and circles give the gap over `edge`: itself, or where its circle ends the
   !> line in which it goes on.
   pure integer function edge_of_circle(master, circles, edge) result(line)
      type(chain_t), intent(in) :: master
      type(circles_t), intent(in) :: circles
      integer, intent(in) :: edge                !! of `master`
      integer :: side

      line = edge
      if (circles%of(edge) == 0) return
      do side = previous, next
         associate (e => master%neighbour(side, edge))
            if (e == 0) cycle
            if (circles%of(e) == 0) line = e
         end associate
      end do
   end function edge_of_circle

   !> Is the edge beyond a side of `edge` a chord of a circle? Then that takes its place.
   pure subroutine take_circle(self, master, circles, edge, side)
      type(polygon_stencil_t), intent(inout) :: self
      type(chain_t), intent(in) :: master
      type(circles_t), intent(in) :: circles
      integer, intent(in) :: edge                !! of `master`, of no circle
      integer, intent(in) :: side                !! `previous` or `next`

      associate (e => master%neighbour(side, edge))
         if (e == 0) return
         self%round%bend(2*side - 3) = circles%curvature(e)*master%size(edge)
      end associate
   end subroutine take_circle

   !> Of two edges that meet at the point nearest to a slave node the one on whose side of the
   !> bisector it stands, in place of `edge`; 0 or, if it stands on the bisector, the other one.
   pure subroutine edge_of_sector(master, slave, x, u, edge, other)
      type(chain_t), intent(in) :: master
      integer, intent(in) :: slave               !! node of the scene
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (2, n_node) [L]
      integer, intent(inout) :: edge             !! in: the nearest
      integer, intent(out) :: other              !! edge, or 0
      real(wp) :: own(2), arm(2), to_slave(2), length(2), past
      integer :: side, corner, beside(2)

      other = 0
      beside = [master%neighbour(previous, edge), master%neighbour(next, edge)]
      do side = 1, 2
         if (beside(side) == 0) cycle
         corner = master%facet(side, edge)
         own = between(x, u, corner, master%facet(3 - side, edge))
         arm = between(x, u, corner, master%facet(side, beside(side)))
         to_slave = between(x, u, corner, slave)
         length = [sqrt(dot_product(own, own)), sqrt(dot_product(arm, arm))]
         if (.not. dot_product(own, arm) < -sharpest_cosine*product(length)) cycle
         past = dot_product(to_slave, arm)/length(2) - dot_product(to_slave, own)/length(1)
         if (abs(past) <= on_bisector*minval(length)) then
            other = beside(side)
            return
         else if (past > 0.0_wp .and. .not. dot_product(to_slave, own) > 0.0_wp) then
            edge = beside(side)
            return
         end if
      end do
   end subroutine edge_of_sector

   !> Is the corner a-b-c blunt enough for a bisector?
   pure logical function is_blunt(x, u, a, b, c)
      real(wp), intent(in) :: x(:, :), u(:, :)
      integer, intent(in) :: a, b, c
      real(wp) :: d(2), e(2)

      d = between(x, u, a, b)
      e = between(x, u, b, c)
      is_blunt = dot_product(d, e) > sharpest_cosine*sqrt(dot_product(d, d)*dot_product(e, e))
   end function is_blunt

   !> What the slave node slides by, along the edge, with a weight.
   pure type(slip_point_t) function polygon_slip(self, weight)
      type(polygon_stencil_t), intent(in) :: self
      real(wp), intent(in) :: weight             !! in the slip of a constraint

      polygon_slip = slip_point(self%node([slave, slave, first, last]), 0.0_wp, weight)
   end function polygon_slip

   !> Distance of a node from an edge as a segment.
   pure real(wp) function edge_distance(x, u, node, edge, du)
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (2, n_node of the scene) [L]
      integer, intent(in) :: node                !! of the scene
      integer, intent(in) :: edge(2)             !! its nodes, of the scene
      real(wp), intent(in), optional :: du(:, :) !! (2, n_node) a motion after `u`; none: 0 [L]
      real(wp) :: a(2), b(2), moved(2, 3), xi

      moved = u(:, [node, edge])
      if (present(du)) moved = moved + du(:, [node, edge])
      a = (x(:, edge(2)) - x(:, edge(1))) + (moved(:, 3) - moved(:, 2))
      b = (x(:, node) - x(:, edge(1))) + (moved(:, 1) - moved(:, 2))
      xi = max(0.0_wp, min(1.0_wp, dot_product(b, a)/dot_product(a, a)))
      b = b - xi*a
      edge_distance = sqrt(dot_product(b, b))
   end function edge_distance

   !> Is a node in front of the line of an edge, by more than round-off?
   pure logical function is_outside(x, u, node, edge)
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (2, n_node of the scene) [L]
      integer, intent(in) :: node                !! of the scene
      integer, intent(in) :: edge(2)             !! its nodes, of the scene
      real(wp) :: a(2), b(2)

      a = (x(:, edge(2)) - x(:, edge(1))) + (u(:, edge(2)) - u(:, edge(1)))
      b = (x(:, node) - x(:, edge(1))) + (u(:, node) - u(:, edge(1)))
      is_outside = b(1)*a(2) - b(2)*a(1) > touch_tol*dot_product(a, a)
   end function is_outside

   !> Is a circle at edge `middle`, and a node that was nearest to that still over it? Looked for
   !> from edge to edge, to the nearest one.
   pure logical function stays_on_circle(master, circles, node, middle, x, u0, du)
      type(chain_t), intent(in) :: master
      type(circles_t), intent(in) :: circles     !! of `master`
      integer, intent(in) :: node                !! of the scene
      integer, intent(in) :: middle              !! edge of `master`
      real(wp), intent(in) :: x(:, :), u0(:, :)  !! (2, n_node of the scene) [L]
      real(wp), intent(in), optional :: du(:, :) !! (2, n_node of the scene) [L]
      real(wp) :: best, distance
      integer :: beside(2), circle, e, k, side

      stays_on_circle = .false.
      beside = master%neighbour(:, middle)
      circle = max(circles%of(middle), maxval(circles%of(max(1, beside)), beside > 0))
      if (circle <= 0) return
      best = edge_distance(x, u0, node, master%facet(:, middle), du)
      e = middle
      do side = previous, next
         do k = 1, master%n_facet
            if (master%neighbour(side, e) == 0) exit
            distance = edge_distance(x, u0, node, master%facet(:, master%neighbour(side, e)), du)
            if (.not. distance < best) exit
            best = distance
            e = master%neighbour(side, e)
         end do
         if (e /= middle) exit
      end do
      stays_on_circle = circles%of(e) == circle .or. e == middle
   end function stays_on_circle

end module emcon_polygon_stencil_plane
