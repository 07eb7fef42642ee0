!> Numbers of the discrete-gradient arithmetic with their derivatives by all nodes.
module nodal_numbers
   use emcon_dgrad_nodes, only : nodes_add_first, nodes_add_second
   use emcon_kinds, only : wp
   implicit none
   private
   public :: nodal_t, by_nodes

   !> As dg_t, by all nodes.
   type :: nodal_t
      real(wp) :: f0 = 0.0_wp, f1 = 0.0_wp, df = 0.0_wp
      real(wp), allocatable :: g(:), c(:)        !! (2 n_node)
      real(wp), allocatable :: h(:, :)           !! (2 n_node, 2 n_node)
   end type nodal_t

contains

   !> From values at both ends, their difference, and derivatives by all nodes but the first.
   pure function by_nodes(n_node, f, g, c, h) result(number)
      integer, intent(in) :: n_node
      real(wp), intent(in) :: f(3)               !! f0, f1, df
      real(wp), intent(in) :: g(:), c(:), h(:, :)   !! (>= 2 n_node - 2)
      type(nodal_t) :: number
      real(wp) :: full(2, n_node)
      integer :: k, in_order(n_node)

      in_order = [(k, k = 1, n_node)]
      number%f0 = f(1)
      number%f1 = f(2)
      number%df = f(3)
      allocate(number%g(2*n_node), number%c(2*n_node), number%h(2*n_node, 2*n_node))
      full = 0.0_wp
      call nodes_add_first(1.0_wp, g, in_order, full)
      number%g = reshape(full, [2*n_node])
      full = 0.0_wp
      call nodes_add_first(1.0_wp, c, in_order, full)
      number%c = reshape(full, [2*n_node])
      number%h = 0.0_wp
      call nodes_add_second(1.0_wp, 2, h, in_order, number%h)
   end function by_nodes

end module nodal_numbers
