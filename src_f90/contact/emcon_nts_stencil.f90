!> Which nodes the gap of a slave node over a smoothed master surface depends on, and where those of
!> any stencil are.
module emcon_nts_stencil
   use emcon_chain_plane, only : chain_t, chain_touches, next, previous
   use emcon_hermite, only : hermite_stencil_t
   use emcon_hermite_gap_value, only : hermite_begin
   use emcon_kinds, only : wp
   implicit none
   private
   public :: smooth_stencil_t, smooth_stencil, stencil_gather, stencil_length, most_nodes

   !> Nodes of a stencil at most: slave node and five edges.
   integer, parameter :: most_nodes = 7

   !> A smoothed surface near a slave node; chosen for a step. Slave node and edge come first.
   type :: smooth_stencil_t
      type(hermite_stencil_t) :: curve
      integer :: n = 0
      integer :: node(most_nodes) = 0
      real(wp) :: place(3) = 0.0_wp              !! where closest points are looked for
   end type smooth_stencil_t

contains

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

   !> Reference length of the stencil's edge: what gaps are measured against.
   pure real(wp) function stencil_length(x, node)
      real(wp), intent(in) :: x(:, :)            !! (2, n_node) [L]
      integer, intent(in) :: node(:)             !! slave, edge, others
      real(wp) :: a(2)

      a = x(:, node(3)) - x(:, node(2))
      stencil_length = sqrt(dot_product(a, a))
   end function stencil_length

end module emcon_nts_stencil
