!> Which nodes the gap of a slave node over a master edge depends on, and where they are.
module emcon_nts_stencil
   use emcon_chain_plane, only : chain_shorter, chain_t, chain_touches, next, previous
   use emcon_hermite, only : hermite_stencil_t
   use emcon_hermite_gap_value, only : hermite_begin
   use emcon_kinds, only : wp
   use emcon_nts_gap_value, only : first, last, slave
   use emcon_slip_point, only : slip_point, slip_point_t
   use emcon_vectors_plane, only : between
   implicit none
   private
   public :: polygon_stencil_t, polygon_stencil, smooth_stencil_t, smooth_stencil, edge_of_sector
   public :: polygon_slip, stencil_gather, stencil_length, edge_distance, is_outside
   public :: most_nodes

   !> Nodes of a stencil at most: slave node and five edges.
   integer, parameter :: most_nodes = 7
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
      logical :: goes_around = .false.           !! convex corners, as a circle does
      integer :: arm = 0                         !! another node of a rigid body of which the slave
                                                 !! node is one; 0: nothing rolls
      real(wp) :: radius = 0.0_wp                !! of the disc that rolls [L]
      real(wp) :: rounding(2, 2) = 0.0_wp        !! (concave, convex; before and after) half widths
                                                 !! of the corners [L]
   end type polygon_stencil_t

   !> A smoothed surface near a slave node; chosen for a step. Slave node and edge come first.
   type :: smooth_stencil_t
      type(hermite_stencil_t) :: curve
      integer :: n = 0
      integer :: node(most_nodes) = 0
      real(wp) :: place(3) = 0.0_wp              !! where closest points are looked for
   end type smooth_stencil_t

contains

   !> The polygon near a slave node over `edge`: the edge and what is there before and after. At a
   !> joint, here as in all stencils, the neighbour is taken to meet the edge at its own node.
   pure subroutine polygon_stencil(self, master, slave, edge, rounding, x, u0)
      type(polygon_stencil_t), intent(out) :: self
      type(chain_t), intent(in) :: master
      integer, intent(in) :: slave               !! node of the scene
      integer, intent(in) :: edge                !! of `master`, the nearest
      real(wp), intent(in) :: rounding(2)        !! of concave and convex corners, per edge
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (2, n_node) [L]
      integer :: e

      self%node(1) = slave
      self%node(2:3) = master%facet(:, edge)
      self%n = 3
      self%rounding = spread(rounding, 2, 2)*spread(chain_shorter(master, edge), 1, 2)
      e = master%neighbour(previous, edge)
      if (e > 0) then
         if (is_blunt(x, u0, master%facet(1, e), self%node(2), self%node(3))) then
            self%n = self%n + 1
            self%before = self%n
            self%node(self%n) = master%facet(1, e)
         end if
      end if
      e = master%neighbour(next, edge)
      if (e > 0) then
         if (is_blunt(x, u0, self%node(2), self%node(3), master%facet(2, e))) then
            self%n = self%n + 1
            self%after = self%n
            self%node(self%n) = master%facet(2, e)
         end if
      end if
   end subroutine polygon_stencil

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

   !> The smoothed surface around `edge`, over two edges on either side of it, for a step from
   !> `u0`. It ends where an edge of a surface in contact with itself begins at the slave node.
   !> Corners are not rounded: `curve%rounding` is left to the caller.
   pure subroutine smooth_stencil(self, master, is_corner, slave, edge, x, u0)
      type(smooth_stencil_t), intent(out) :: self
      type(chain_t), intent(in) :: master
      logical, intent(in) :: is_corner(:)        !! (n_edge) at the first node of each
      integer, intent(in) :: slave               !! node of the scene
      integer, intent(in) :: edge                !! of `master`, the nearest
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (2, n_node) [L]
      real(wp) :: local(2, most_nodes), dlocal(2, most_nodes)
      integer :: near(5), k, number

      near = 0
      near(3) = edge
      near(2) = beside(master%neighbour(previous, edge))
      near(4) = beside(master%neighbour(next, edge))
      if (near(2) > 0) near(1) = beside(master%neighbour(previous, near(2)))
      if (near(4) > 0) near(5) = beside(master%neighbour(next, near(4)))
      self%node(:3) = [slave, master%facet(:, edge)]
      self%n = 3
      self%curve%node(3:4) = [2, 3]
      do k = 1, 5
         if (near(k) == 0) cycle
         self%curve%length(k) = master%size(near(k))
         self%curve%is_corner(k) = is_corner(near(k))
         if (k < 3) call add_node(self, master%facet(1, near(k)), number)
         if (k < 3) self%curve%node(k) = number
         if (k > 3) call add_node(self, master%facet(2, near(k)), number)
         if (k > 3) self%curve%node(k + 1) = number
      end do
      call stencil_gather(x, u0, u0, self%n, self%node, local, dlocal)
      call hermite_begin(self%curve, local(:, :self%n), self%place)

   contains

      !> Edge `e`, or 0 if the slave node is its own.
      pure integer function beside(e)
         integer, intent(in) :: e

         beside = e
         if (e == 0) return
         if (chain_touches(master, e, slave)) beside = 0
      end function beside

   end subroutine smooth_stencil

   !> Number of `node` in the stencil; the nodes of a short closed surface come up twice.
   pure subroutine add_node(self, node, number)
      type(smooth_stencil_t), intent(inout) :: self
      integer, intent(in) :: node
      integer, intent(out) :: number

      do number = 1, self%n
         if (self%node(number) == node) return
      end do
      self%n = number
      self%node(number) = node
   end subroutine add_node

   !> Positions of the stencil's nodes at the start relative to its edge, and their motion.
   pure subroutine stencil_gather(x, u0, du, n, node, local, dlocal)
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      integer, intent(in) :: n                   !! number of nodes
      integer, intent(in) :: node(:)             !! (>= n) of the scene: slave, edge, others
      real(wp), intent(out) :: local(:, :), dlocal(:, :)   !! (2, >= n) [L]
      integer :: k

      do k = 1, n
         local(:, k) = (x(:, node(k)) - x(:, node(2))) + (u0(:, node(k)) - u0(:, node(2)))
         dlocal(:, k) = du(:, node(k))
      end do
   end subroutine stencil_gather

   !> What the slave node slides by, along the edge, with a weight.
   pure type(slip_point_t) function polygon_slip(self, weight)
      type(polygon_stencil_t), intent(in) :: self
      real(wp), intent(in) :: weight             !! in the slip of a constraint

      polygon_slip = slip_point(self%node([slave, slave, first, last]), 0.0_wp, weight)
   end function polygon_slip

   !> Reference length of the stencil's edge: what gaps are measured against.
   pure real(wp) function stencil_length(x, node)
      real(wp), intent(in) :: x(:, :)            !! (2, n_node) [L]
      integer, intent(in) :: node(:)             !! slave, edge, others
      real(wp) :: a(2)

      a = x(:, node(3)) - x(:, node(2))
      stencil_length = sqrt(dot_product(a, a))
   end function stencil_length

   !> Distance of a node from an edge as a segment.
   pure real(wp) function edge_distance(x, u, node, edge)
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (2, n_node of the scene) [L]
      integer, intent(in) :: node                !! of the scene
      integer, intent(in) :: edge(2)             !! its nodes, of the scene
      real(wp) :: a(2), b(2), xi

      a = (x(:, edge(2)) - x(:, edge(1))) + (u(:, edge(2)) - u(:, edge(1)))
      b = (x(:, node) - x(:, edge(1))) + (u(:, node) - u(:, edge(1)))
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

end module emcon_nts_stencil
