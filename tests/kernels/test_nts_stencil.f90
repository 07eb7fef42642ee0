!> Stencils over polygons by plain geometry, at any scale and place, by positions or displacements.
module test_nts_stencil
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_chain_plane, only : chain_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_nts_stencil, only : stencil_length
   use emcon_polygon_stencil_plane, only : corner_widths, edge_distance, edge_of_sector, &
      is_outside, polygon_stencil, polygon_stencil_t
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   use small_scenes, only : shake
   implicit none
   private
   public :: collect_nts_stencil

   real(wp), parameter :: tol = 256.0_wp*epsilon(1.0_wp), pi = acos(-1.0_wp)
   !> From which on a turn is too sharp for a bisector; in front of an edge by less is not in front;
   !> on a bisector is what is nearer, by the shorter edge.
   real(wp), parameter :: sharpest = acos(-0.9_wp), touching = sqrt(epsilon(1.0_wp)), &
      on_bisector = 1.0e-4_wp
   real(wp), parameter :: scales(3) = [0.01_wp, 1.0_wp, 64.0_wp]

contains

   subroutine collect_nts_stencil(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("distance from an edge, and in front of it", test_distance), &
         test_case_t("corners that are too sharp", test_sharp), &
         test_case_t("the sector of a corner", test_sector)]
   end subroutine collect_nts_stencil

   pure function way(angle)
      real(wp), intent(in) :: angle
      real(wp) :: way(2)

      way = [cos(angle), sin(angle)]
   end function way

   !> Nodes at `place`, in part by displacements.
   subroutine place_nodes(place, x, u)
      real(wp), intent(in) :: place(:, :)
      real(wp), intent(out) :: x(:, :), u(:, :)

      call shake(u, maxval(abs(place)))
      x = place - u
   end subroutine place_nodes

   !> A node at (s, h) of an edge from 0 to 1: beside, over and beyond it, at any scale and angle.
   subroutine test_distance(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: s(5) = [-0.75_wp, 0.0_wp, 0.25_wp, 1.0_wp, 2.0_wp]
      real(wp), parameter :: h(4) = [-0.5_wp, 0.5_wp*touching, 2.0_wp*touching, 0.75_wp]
      real(wp) :: place(2, 3), x(2, 3), u(2, 3), angle
      integer :: i, j, k

      do k = 1, size(scales)
         do i = 1, size(s)
            do j = 1, size(h)
               call draw_random(angle)
               angle = 8.0_wp*angle
               place(:, 1) = [0.3_wp, -0.2_wp]*scales(k)
               place(:, 2) = place(:, 1) + scales(k)*way(angle)
               ! Outside is to the right.
               place(:, 3) = place(:, 1) + scales(k)*(s(i)*way(angle) + h(j)*way(angle - 0.5_wp*pi))
               call place_nodes(place, x, u)
               associate (beside => s(i) - min(1.0_wp, max(0.0_wp, s(i))))
                  call check_near(error, edge_distance(x, u, 3, [1, 2]), scales(k)*sqrt(beside**2 &
                     + h(j)**2), tol, scales(k), "distance")
               end associate
               call check_true(error, is_outside(x, u, 3, [1, 2]) .eqv. j > 2, "in front, place " &
                  // to_text(j))
               call check_near(error, stencil_length(place, [3, 1, 2]), scales(k), tol, scales(k), &
                  "length")
            end do
         end do
      end do
   end subroutine test_distance

   !> Three edges, the middle one of another length; they turn by just more or less than is sharp.
   subroutine test_sharp(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: doubt = 0.02_wp
      type(chain_t) :: chain
      type(polygon_stencil_t) :: stencil
      real(wp) :: place(2, 5), x(2, 5), u(2, 5), turn(2)
      integer :: i, k
      logical :: is_there(2)

      call make_chain(3, chain)
      do k = 1, size(scales)
         do i = 0, 15
            is_there = [btest(i, 0), btest(i, 1)]
            turn = merge(sharpest - doubt, sharpest + doubt, is_there)
            if (btest(i, 2)) turn(1) = -turn(1)
            if (btest(i, 3)) turn(2) = -turn(2)
            place(:, 2) = [0.3_wp, -0.2_wp]*scales(k)
            place(:, 3) = place(:, 2) + 0.5_wp*scales(k)*way(0.7_wp)
            place(:, 1) = place(:, 2) - 1.5_wp*scales(k)*way(0.7_wp - turn(1))
            place(:, 4) = place(:, 3) + 0.25_wp*scales(k)*way(0.7_wp + turn(2))
            place(:, 5) = place(:, 2) + scales(k)
            call place_nodes(place, x, u)
            chain%size = scales(k)*[1.5_wp, 0.5_wp, 0.25_wp]
            call polygon_stencil(stencil, chain, 5, 2, x, u)
            stencil%rounding = corner_widths(chain, 2, [0.5_wp, 2.0_wp])
            call check_equal(error, stencil%node(:stencil%n), [5, 2, 3, pack([1, 4], is_there)], &
               "nodes of case " // to_text(i))
            call check_equal(error, [stencil%before, stencil%after], [merge(4, 0, is_there(1)), &
               merge(stencil%n, 0, is_there(2))], "neighbours of case " // to_text(i))
            ! By the shorter edge at either corner.
            call check_near(error, [stencil%rounding], scales(k)*[0.25_wp, 1.0_wp, 0.125_wp, &
               0.5_wp], tol, scales(k), "rounding")
         end do
      end do
   end subroutine test_sharp

   !> Edges in a row, from node to node.
   pure subroutine make_chain(n, chain)
      integer, intent(in) :: n
      type(chain_t), intent(out) :: chain
      integer :: k

      chain%n_facet = n
      allocate(chain%facet, source=reshape([(k, k + 1, k = 1, n)], [2, n]))
      allocate(chain%neighbour, source=reshape([(k - 1, modulo(k + 1, n + 1), k = 1, n)], [2, n]))
      allocate(chain%size(n), source=1.0_wp)
   end subroutine make_chain

   !> Two edges whose arms from their corner are `phi` apart, and a node by the angle that it makes
   !> with each arm: it belongs to the nearer one, if it is past the end of the other; both have it
   !> on the bisector, from either edge. Corners that are too sharp have no sectors.
   subroutine test_sector(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: off(5) = [-2.0_wp, -0.5_wp, 0.0_wp, 0.5_wp, 2.0_wp]
      type(chain_t) :: chain
      real(wp) :: u(5), phi, node_angle, scale, length(2), arm(2), own
      integer :: case, k, edge, other, from, expected

      call make_chain(2, chain)
      do case = 1, 300
         call draw_random(u)
         scale = scales(1 + mod(case, size(scales)))
         length = scale*(0.25_wp + u(:2))
         phi = 2.0_wp*pi*(0.05_wp + 0.9_wp*u(3))
         arm = [0.4_wp, 0.4_wp + phi]
         do from = 1, 2
            ! Anywhere.
            node_angle = 8.0_wp*u(4)
            call look(scale*(0.1_wp + u(5))*way(node_angle))
            own = dot_product(way(node_angle), way(arm(from)))
            associate (past => dot_product(way(node_angle), way(arm(3 - from))) - own)
               if (abs(past)*(0.1_wp + u(5))*scale < 2.0_wp*on_bisector*minval(length)) cycle
               expected = merge(3 - from, from, cos(phi) < 0.9_wp .and. past > 0.0_wp .and. &
                  own <= 0.0_wp)
            end associate
            call check_equal(error, [edge, other], [expected, 0], "case " // to_text(case))
            ! By and off the bisector, outside of the corner, by so much of what is on it.
            do k = 1, size(off)
               call look(scale*u(5)*way(0.4_wp + 0.5_wp*phi + pi) + off(k)*on_bisector &
                  *minval(length)/(2.0_wp*abs(sin(0.5_wp*phi)))*sign(1.0_wp, sin(0.5_wp*phi)) &
                  *merge(1.0_wp, -1.0_wp, from == 1)*way(0.4_wp + 0.5_wp*phi + 0.5_wp*pi))
               expected = merge(3 - from, from, k == 5 .and. cos(phi) < 0.9_wp .and. is_past())
               call check_equal(error, [edge, other], [expected, merge(3 - from, 0, k > 1 .and. &
                  k < 5 .and. cos(phi) < 0.9_wp)], &
                  "bisector, case " // to_text(case) // ", place " // to_text(k))
            end do
            if (allocated(error)) return
         end do
      end do

   contains

      !> Edge 1 ends where edge 2 begins: the arm of edge 1 is the first one.
      subroutine look(to_node)
         real(wp), intent(in) :: to_node(2)
         real(wp) :: place(2, 4), x(2, 4), move(2, 4)

         place(:, 2) = [0.3_wp, -0.2_wp]*scale
         place(:, 1) = place(:, 2) + length(1)*way(arm(1))
         place(:, 3) = place(:, 2) + length(2)*way(arm(2))
         place(:, 4) = place(:, 2) + to_node
         call place_nodes(place, x, move)
         edge = from
         call edge_of_sector(chain, 4, x, move, edge, other)
      end subroutine look

      !> Is the outer bisector past the ends of both edges?
      logical function is_past()
         is_past = cos(pi - 0.5_wp*phi) <= -1.0e-3_wp
      end function is_past

   end subroutine test_sector

end module test_nts_stencil
