!> Two straight edges that cross: how far apart they are along their common normal, over a step.
!>
!> With the edges as the two vectors of a frame this is the height of the second edge in it, and the
!> places of the crossing are the affine coordinates. Source: docs/theory.md, section 15, eq. (51).
module emcon_edge_pair_space
   use emcon_frame_vertex_space, only : at_eta, at_height, at_xi, frame_place, frame_vertex, &
      frame_vertex_t
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   implicit none
   private
   public :: crossing_t, edge_crossing, edge_pair_gap, edge_pair_gap_t

   integer, parameter, public :: n_edge_pair_node = 4
   integer, parameter :: n_dim = 3, n_coordinate = n_dim*n_edge_pair_node
   !> Nodes: ends of the slave edge, ends of the master edge. Vectors of the frame: the slave edge,
   !> the master edge, from the first end of the slave to the first end of the master.
   integer, parameter :: weight(n_edge_pair_node, 3) = reshape( &
      [-1, 1, 0, 0, 0, 0, -1, 1, -1, 0, 1, 0], [n_edge_pair_node, 3])

   !> Where two edges cross at one instant.
   type :: crossing_t
      real(wp) :: place(2) = 0.0_wp              !! on the slave, on the master: 0 to 1 within it
      real(wp) :: height = 0.0_wp                !! of the master along a x b [L]
      real(wp) :: sine = 0.0_wp                  !! of the angle between them
   end type crossing_t

   type :: edge_pair_gap_t
      real(wp) :: gap(0:1) = 0.0_wp              !! at both ends of the step [L]
      real(wp) :: dgap = 0.0_wp                  !! how it changes, to relative accuracy [L]
      real(wp) :: g(n_dim, n_edge_pair_node) = 0.0_wp    !! discrete gradient
      real(wp) :: c(n_dim, n_edge_pair_node) = 0.0_wp    !! gradient at the end
      !> (i, j) derivative of g(i) by end coordinate j, node by node; 0 if not asked for [1/L]
      real(wp) :: h(n_coordinate, n_coordinate) = 0.0_wp
   end type edge_pair_gap_t

contains

   !> The crossing of edges with the ends `at`; of parallel ones the sine is 0, and no more is told.
   pure type(crossing_t) function edge_crossing(at) result(crossing)
      real(wp), intent(in) :: at(n_dim, n_edge_pair_node)    !! ends of the slave, of the master [L]
      real(wp) :: frame(n_dim, 3), normal(n_dim), place(n_dim)

      frame = matmul(at, real(weight, wp))
      normal = cross_product(frame(:, 1), frame(:, 2))
      crossing%sine = sqrt(dot_product(normal, normal)/max(dot_product(frame(:, 1), &
         frame(:, 1))*dot_product(frame(:, 2), frame(:, 2)), tiny(1.0_wp)))
      if (.not. crossing%sine > 0.0_wp) return
      place = frame_place(frame(:, 1), frame(:, 2), frame(:, 3))
      crossing%place = [place(at_xi), -place(at_eta)]
      crossing%height = place(at_height)
   end function edge_crossing

   !> The gap over a step: the height times `side`, 1 or -1.
   pure subroutine edge_pair_gap(at, way, side, leaves_second, gap)
      real(wp), intent(in) :: at(n_dim, n_edge_pair_node)    !! where the ends start [L]
      real(wp), intent(in) :: way(n_dim, n_edge_pair_node)   !! how they move [L]
      real(wp), intent(in) :: side               !! of the slave edge that the master is on
      logical, intent(in) :: leaves_second       !! no second derivatives
      type(edge_pair_gap_t), intent(out) :: gap
      type(frame_vertex_t) :: vertex
      real(wp), dimension(n_dim, n_edge_pair_node) :: tip, dtip
      integer :: i, j, k, l

      tip(:, 1) = 0.0_wp
      dtip(:, 1) = 0.0_wp
      tip(:, 2:) = matmul(at, real(weight, wp))
      dtip(:, 2:) = matmul(way, real(weight, wp))
      call frame_vertex(tip, dtip, leaves_second, vertex)
      gap%gap = side*vertex%f(at_height, :)
      gap%dgap = side*vertex%df(at_height)
      associate (own => side*reshape(vertex%g(:, at_height), [n_dim, 3]), &
            own_end => side*reshape(vertex%c(:, at_height), [n_dim, 3]), w => real(weight, wp))
         gap%g = matmul(own, transpose(w))
         gap%c = matmul(own_end, transpose(w))
         if (leaves_second) return
         do j = 1, n_edge_pair_node
            do i = 1, n_edge_pair_node
               do l = 1, 3
                  do k = 1, 3
                     if (weight(i, k)*weight(j, l) == 0) cycle
                     associate (to => gap%h(n_dim*(i - 1) + 1:n_dim*i, n_dim*(j - 1) + 1:n_dim*j))
                        to = to + side*w(i, k)*w(j, l)*vertex%h(n_dim*(k - 1) + 1:n_dim*k, &
                           n_dim*(l - 1) + 1:n_dim*l, at_height)
                     end associate
                  end do
               end do
            end do
         end do
      end associate
   end subroutine edge_pair_gap

end module emcon_edge_pair_space
