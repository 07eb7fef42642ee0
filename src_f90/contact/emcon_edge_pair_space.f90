!> Two straight edges that cross: how far apart they are along their common normal, over a step.
!>
!> With the edges as the two vectors of a frame this is the height of the second edge in it, and the
!> places of the crossing are the affine coordinates; slip is how these change. Source:
!> docs/theory.md, section 14, eq. (51), and section 14.3.
module emcon_edge_pair_space
   use emcon_frame_slip_space, only : frame_slip, frame_slip_t, slip_axis_t
   use emcon_frame_vertex_space, only : at_eta, at_height, at_xi, frame_of, frame_place, &
      frame_vertex, frame_vertex_t, n_frame_var
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   implicit none
   private
   public :: crossing_t, edge_crossing, edge_pair_gap, edge_pair_gap_t, edge_pair_slip, &
      edge_pair_slip_t

   integer, parameter, public :: n_edge_pair_node = 4
   integer, parameter :: n_dim = 3, n_coordinate = n_dim*n_edge_pair_node
   !> Nodes: ends of the slave edge, ends of the master edge. Vectors of the frame: the slave edge,
   !> the master edge, from the first end of the slave to the first end of the master.
   integer, parameter :: weight(n_edge_pair_node, 3) = reshape( &
      [-1, 1, 0, 0, 0, 0, -1, 1, -1, 0, 1, 0], [n_edge_pair_node, 3])

   !> Edges with a smaller sine are parallel: its square is lost in the round-off of what it is the
   !> difference of, and with it the places.
   real(wp), parameter :: parallel = sqrt(16.0_wp*epsilon(1.0_wp))

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

   !> Slip of the slave along the master.
   type :: edge_pair_slip_t
      real(wp) :: f(2) = 0.0_wp                  !! over the step [L]
      real(wp) :: g(n_dim, n_edge_pair_node, 2) = 0.0_wp   !! as of the gap
      real(wp) :: c(n_dim, n_edge_pair_node, 2) = 0.0_wp
      real(wp) :: h(n_coordinate, n_coordinate, 2) = 0.0_wp
   end type edge_pair_slip_t

contains

   !> The crossing of edges with the ends `at`; of parallel ones the sine alone is told.
   pure type(crossing_t) function edge_crossing(at) result(crossing)
      real(wp), intent(in) :: at(n_dim, n_edge_pair_node)    !! ends of the slave, of the master [L]
      real(wp) :: frame(n_dim, 3), normal(n_dim), place(n_dim)

      frame = matmul(at, real(weight, wp))
      normal = cross_product(frame(:, 1), frame(:, 2))
      crossing%sine = sqrt(dot_product(normal, normal)/max(dot_product(frame(:, 1), &
         frame(:, 1))*dot_product(frame(:, 2), frame(:, 2)), tiny(1.0_wp)))
      if (.not. crossing%sine > parallel) return
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
      real(wp) :: tip(n_dim, 4), motion(n_dim, 4), second(n_frame_var, n_frame_var, 3)

      tip = tips_of(at)
      motion = tips_of(way)
      call frame_vertex(frame_of(tip(:, :3), motion(:, :3), leaves_second), tip(:, 4), &
         motion(:, 4), vertex, second)
      gap%gap = side*vertex%f(at_height, :)
      gap%dgap = side*vertex%df(at_height)
      call first_to_nodes(side, vertex%g(:, at_height), gap%g)
      call first_to_nodes(side, vertex%c(:, at_height), gap%c)
      if (.not. leaves_second) call second_to_nodes(side, second(:, :, at_height), gap%h)
   end subroutine edge_pair_gap

   !> Slip over a step along two directions in the plane of both edges where friction acts, the
   !> first one along that of the slave: the master goes by as much the other way.
   pure subroutine edge_pair_slip(at, way, place, leaves_second, slip)
      real(wp), intent(in) :: at(n_dim, n_edge_pair_node)    !! where the ends start [L]
      real(wp), intent(in) :: way(n_dim, n_edge_pair_node)   !! how they move [L]
      real(wp), intent(in) :: place              !! where it acts: of `slip_axis_t`
      logical, intent(in) :: leaves_second       !! no second derivatives
      type(edge_pair_slip_t), intent(out) :: slip
      type(frame_slip_t) :: over
      integer :: k

      call frame_slip(tips_of(at), tips_of(way), slip_axis_t((at(:, 2) - at(:, 1)) &
         + place*(way(:, 2) - way(:, 1)), place), leaves_second, over)
      ! The slave's edge is the first vector of the frame.
      over%c(:3, :) = over%c(:3, :) + over%c_along
      over%h(:, :3, :) = over%h(:, :3, :) + over%h_along
      slip%f = -over%f
      do k = 1, size(over%f)
         call first_to_nodes(-1.0_wp, over%g(:, k), slip%g(:, :, k))
         call first_to_nodes(-1.0_wp, over%c(:, k), slip%c(:, :, k))
         if (.not. leaves_second) call second_to_nodes(-1.0_wp, over%h(:, :, k), slip%h(:, :, k))
      end do
   end subroutine edge_pair_slip

   !> Origin and tips of the vectors of the frame, from those of the nodes.
   pure function tips_of(at) result(tip)
      real(wp), intent(in) :: at(n_dim, n_edge_pair_node)
      real(wp) :: tip(n_dim, 4)

      tip(:, 1) = 0.0_wp
      tip(:, 2:) = matmul(at, real(weight, wp))
   end function tips_of

   !> `factor` times derivatives by the vectors of the frame as derivatives by the nodes.
   pure subroutine first_to_nodes(factor, part, of_node)
      real(wp), intent(in) :: factor
      real(wp), intent(in) :: part(:)            !! (9)
      real(wp), intent(out) :: of_node(n_dim, n_edge_pair_node)

      of_node = matmul(factor*reshape(part, [n_dim, 3]), transpose(real(weight, wp)))
   end subroutine first_to_nodes

   !> The same of second derivatives.
   pure subroutine second_to_nodes(factor, part, of_node)
      real(wp), intent(in) :: factor
      real(wp), intent(in) :: part(:, :)         !! (9, 9)
      real(wp), intent(out) :: of_node(n_coordinate, n_coordinate)
      integer :: i, j, k, l

      of_node = 0.0_wp
      associate (w => real(weight, wp))
         do j = 1, n_edge_pair_node
            do i = 1, n_edge_pair_node
               do l = 1, 3
                  do k = 1, 3
                     if (weight(i, k)*weight(j, l) == 0) cycle
                     associate (to => of_node(n_dim*(i - 1) + 1:n_dim*i, n_dim*(j - 1) + 1:n_dim*j))
                        to = to + factor*w(i, k)*w(j, l)*part(n_dim*(k - 1) + 1:n_dim*k, &
                           n_dim*(l - 1) + 1:n_dim*l)
                     end associate
                  end do
               end do
            end do
         end do
      end associate
   end subroutine second_to_nodes

end module emcon_edge_pair_space
