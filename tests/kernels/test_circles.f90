!> Rigid circles: which edges are chords of one; gaps and ways over arcs in closed form, with their
!> identity, momenta and derivatives.
module test_circles
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_chain_plane, only : chain_t
   use emcon_circles_plane, only : circle_whole, circles_find, circles_t
   use emcon_constraint, only : condition_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_nts_constraint, only : polygon_constraint
   use emcon_nts_gap_value, only : edge_round_t, nts_gap_value
   use emcon_polygon_slip_plane, only : polygon_slip_over
   use emcon_polygon_stencil_plane, only : polygon_stencil_t
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   use small_scenes, only : shake
   implicit none
   private
   public :: collect_circles

   real(wp), parameter :: eps = epsilon(1.0_wp), tol = 256.0_wp*eps
   real(wp), parameter :: pi = acos(-1.0_wp)
   real(wp), parameter :: sharp(2, 2) = 0.0_wp

contains

   subroutine collect_circles(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("closed circles, of enough edges", test_closed), &
         test_case_t("arcs between lines", test_arcs), &
         test_case_t("what is no circle", test_no_circle), &
         test_case_t("the distance from an arc", test_distance), &
         test_case_t("lines that go on in arcs", test_lines), &
         test_case_t("identity, momenta, derivatives", test_derivatives), &
         test_case_t("ways along arcs, and discs that roll on them", test_ways)]
   end subroutine collect_circles

   !> Edges in a row, or closed, from node to node.
   pure subroutine make_chain(n, is_closed, chain)
      integer, intent(in) :: n
      logical, intent(in) :: is_closed
      type(chain_t), intent(out) :: chain
      integer :: k

      chain%n_facet = n
      allocate(chain%facet, source=reshape([(k, k + 1, k = 1, n)], [2, n]))
      allocate(chain%neighbour, source=reshape([(k - 1, modulo(k + 1, n + 1), k = 1, n)], [2, n]))
      if (.not. is_closed) return
      chain%facet(2, n) = 1
      chain%neighbour(1, 1) = n
      chain%neighbour(2, n) = 1
   end subroutine make_chain

   !> On a circle about `centre`, from angle to angle; the body is inside from lower to larger ones.
   pure function round(centre, radius, from, to, n) result(x)
      real(wp), intent(in) :: centre(2), radius, from, to
      integer, intent(in) :: n                   !! edges
      real(wp) :: x(2, n + 1), angle
      integer :: k

      do k = 0, n
         angle = from + (to - from)*real(k, wp)/real(n, wp)
         x(:, k + 1) = centre + radius*[cos(angle), sin(angle)]
      end do
   end function round

   !> Polygons of 60 edges are circles, of 59 not; clockwise ones are hollow. Each starts elsewhere.
   subroutine test_closed(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: edges(4) = [59, 60, 72, 720]
      real(wp), parameter :: centre(2) = [3.0_wp, -40.0_wp], radius = 7.0_wp
      type(chain_t) :: chain
      type(circles_t) :: circles
      real(wp), allocatable :: x(:, :)
      real(wp) :: found(2), far
      integer :: i, way
      logical :: is_whole

      do i = 1, size(edges)
         do way = -1, 1, 2
            associate (n => edges(i))
               call make_chain(n, .true., chain)
               x = round(centre, radius, real(i, wp), real(i, wp) + 2.0_wp*pi*way, n)
               call circles_find(circles, chain, x(:, :n), spread(4, 1, n))
               call check_equal(error, circles%of, spread(merge(1, 0, n > 59), 1, n), &
                  "numbers of " // to_text(n))
               if (n > 59) call check_near(error, circles%curvature, spread(real(way, wp)/radius, &
                  1, n), tol, 1.0_wp, "curvature")
               call circle_whole(circles, chain, x(:, :n), is_whole, found, far)
               call check_true(error, is_whole .eqv. (n > 59 .and. way > 0), "a disc")
               if (is_whole) call check_near(error, [found, far], [centre, radius], tol, 40.0_wp, &
                  "its centre")
            end associate
         end do
      end do
   end subroutine test_closed

   !> A line, an arc that bulges, a line, a hollow arc, a line; and the arc alone, with two ends.
   subroutine test_arcs(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 20
      type(chain_t) :: chain
      type(circles_t) :: circles
      real(wp) :: x(2, 2*n + 4)
      integer :: k

      x(:, 1) = [1.0_wp, -3.0_wp]
      x(:, 2:n + 2) = round([0.0_wp, 0.0_wp], 1.0_wp, 0.0_wp, 0.5_wp*pi, n)
      x(:, n + 3:2*n + 3) = round([-2.0_wp, 3.0_wp], 2.0_wp, -0.5_wp*pi, -pi, n)
      x(:, 2*n + 4) = [-4.0_wp, 5.0_wp]
      call make_chain(2*n + 3, .false., chain)
      call circles_find(circles, chain, x, spread(1, 1, size(x, 2)))
      call check_equal(error, circles%of, [0, (1, k = 1, n), 0, (2, k = 1, n), 0], "numbers")
      call check_near(error, circles%curvature, [0.0_wp, (1.0_wp, k = 1, n), 0.0_wp, &
         (-0.5_wp, k = 1, n), 0.0_wp], tol, 1.0_wp, "curvatures")
      call make_chain(n, .false., chain)
      call circles_find(circles, chain, x(:, 2:n + 2), spread(1, 1, n + 1))
      call check_equal(error, circles%of, spread(1, 1, n), "alone")
   end subroutine test_arcs

   !> Elastic nodes, of two bodies, one off the circle, a corner at its end, another radius.
   subroutine test_no_circle(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 20
      type(chain_t) :: chain
      type(circles_t) :: circles
      real(wp) :: x(2, n + 2), y(2, 2*n + 1)
      integer :: body(n + 2)

      x(:, :n + 1) = round([0.0_wp, 0.0_wp], 1.0_wp, 0.0_wp, 0.5_wp*pi, n)
      x(:, n + 2) = [-1.0_wp, 1.0_wp]
      call make_chain(n + 1, .false., chain)
      body = 1
      call look("on a tangent", 1)
      call look("of elastic nodes", 0, 0*body)
      body(n + 2) = 2
      call look("of two bodies", 0, cshift(body, n/2))
      x(:, n + 2) = [-1.0_wp, 0.99_wp]
      body = 1
      call look("with a corner", 0)
      x(:, n + 2) = [-1.0_wp, 1.0_wp]
      x(:, n/2) = 1.0005_wp*x(:, n/2)
      call look("a node off by half of what chords are off", 0)
      y(:, :n + 1) = round([0.0_wp, 0.0_wp], 1.0_wp, 0.0_wp, 0.5_wp*pi, n)
      y(:, n + 1:) = round([0.0_wp, -1.0_wp], 2.0_wp, 0.5_wp*pi, 0.7_wp*pi, n)
      call make_chain(2*n, .false., chain)
      call circles_find(circles, chain, y, spread(1, 1, 2*n + 1))
      call check_equal(error, count(circles%of > 0), 0, "arcs of two radii")

   contains

      subroutine look(what, n_circle, other)
         character(len=*), intent(in) :: what
         integer, intent(in) :: n_circle
         integer, intent(in), optional :: other(:)

         if (present(other)) then
            call circles_find(circles, chain, x, other)
         else
            call circles_find(circles, chain, x, body)
         end if
         call check_equal(error, maxval(circles%of), n_circle, what)
      end subroutine look

   end subroutine test_no_circle

   !> Of points all around, from any chord, in any position: |d| - R, or R - |d| within.
   subroutine test_distance(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x(2, 3), draw(4), away, radius, gap, xi, from, to
      integer :: i, way

      do i = 1, 200
         way = 2*mod(i, 2) - 1
         call draw_random(draw)
         radius = 0.5_wp + 10.0_wp*draw(1)
         away = radius*(0.2_wp + 2.0_wp*draw(2))
         from = 2.0_wp*pi*draw(3)
         to = from + way*(0.01_wp + 0.1_wp*draw(4))
         call shake(x(:, :1), 3.0_wp)
         x = spread(x(:, 1), 2, 3)
         x(:, 1) = x(:, 1) + away*[cos(7.0_wp*from), sin(7.0_wp*from)]
         x(:, 2) = x(:, 2) + radius*[cos(from), sin(from)]
         x(:, 3) = x(:, 3) + radius*[cos(to), sin(to)]
         call nts_gap_value(x, 0, 0, sharp, gap, xi, round=edge_round_t(.false., &
            [0.0_wp, 2.0_wp*sin(0.5_wp*(to - from)), 0.0_wp]))
         ! Roundings of the ends of a short chord turn it, and move the centre.
         call check_near(error, gap, way*(away - radius), tol, radius/abs(to - from), "distance")
      end do
   end subroutine test_distance

   !> In front of the line its distance, beyond either end that from the arc; in one piece.
   subroutine test_lines(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: length = 2.0_wp, radius = 3.0_wp
      real(wp) :: x(2, 3), bend(-1:1), gap, xi, expected
      integer :: i, way

      do i = 1, 200
         way = 2*mod(i, 2) - 1
         bend = way*length/radius*[1.0_wp, 0.0_wp, 1.0_wp]
         x = reshape([0.0_wp, 0.0_wp, length, 0.0_wp, 0.0_wp, 0.0_wp], [2, 3])
         call draw_random(x(:, 1))
         x(:, 1) = [-1.0_wp, -0.5_wp] + x(:, 1)*[4.0_wp, 1.0_wp]
         expected = x(2, 1)
         if (x(1, 1) < 0.0_wp) expected = from_arc(0.0_wp)
         if (x(1, 1) > length) expected = from_arc(length)
         call nts_gap_value(x, 0, 0, sharp, gap, xi, round=edge_round_t(.false., bend))
         call check_near(error, gap, expected, tol, radius, "at " // to_text(x(1, 1)))
      end do

   contains

      !> With its centre below or above `at`.
      pure real(wp) function from_arc(at)
         real(wp), intent(in) :: at

         from_arc = way*(norm2(x(:, 1) - [at, -way*radius]) - radius)
      end function from_arc

   end subroutine test_lines

   !> Gap and slip of a step over an arc and over lines that end in arcs, with and without an arm.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: small = eps**(1.0_wp/3.0_wp)
      real(wp), parameter :: bends(-1:1, 4) = reshape([0.0_wp, 0.4_wp, 0.0_wp, 0.0_wp, -0.3_wp, &
         0.0_wp, 0.5_wp, 0.0_wp, -0.2_wp, -0.3_wp, 0.0_wp, 0.6_wp], [3, 4])
      type(polygon_stencil_t) :: stencil(1)
      type(condition_t) :: item, other(2)
      real(wp), dimension(2, 4) :: x, du, moved, still
      real(wp) :: worst
      integer :: i, j, k, n

      stencil(1)%n = 3
      stencil(1)%node(:3) = [1, 2, 3]
      stencil(1)%radius = 0.5_wp
      still = 0.0_wp
      item%has_friction = .true.
      other%has_friction = .true.
      do i = 1, 40
         stencil(1)%round%bend = bends(:, 1 + mod(i, 4))
         stencil(1)%arm = merge(4, 0, i > 20)
         call shake(x, 0.1_wp)
         x = x + reshape([0.4_wp, 0.3_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.1_wp, 0.8_wp], [2, 4])
         if (mod(i, 8) > 3) x(1, 1) = x(1, 1) - 1.0_wp
         call shake(du, 0.2_wp)
         call polygon_constraint(stencil, x, still, du, 0.0_wp, item)
         n = item%n_node
         associate (at => item%node(:n))
            call sums("gap", item%g(:, :n), du(:, at), x(:, at) + 0.5_wp*du(:, at), item%dgap)
            call sums("slip", item%t(:, :n, 1), du(:, at), x(:, at) + 0.5_wp*du(:, at), &
               item%slip(1))
            call check_near(error, [item%gap1 - item%gap0, polygon_slip_over(stencil(1), 1.0_wp, &
               x, still, du)], [item%dgap, item%slip(1)], tol, 1.0_wp, "values")
         end associate
         worst = 0.0_wp
         do j = 1, 2*n
            associate (a => 1 + mod(j - 1, 2), node => item%node(1 + (j - 1)/2))
               do k = 1, 2
                  moved = du
                  moved(a, node) = du(a, node) + (real(k, wp) - 1.5_wp)*small
                  call polygon_constraint(stencil, x, still, moved, 0.0_wp, other(k))
               end do
            end associate
            worst = max(worst, missed(other%gap1, item%c(:, :n), j), &
               missed([other(1)%slip(1), other(2)%slip(1)], item%t1(:, :n, 1), j), &
               maxval(abs(reshape((other(2)%g(:, :n) - other(1)%g(:, :n))/small, [2*n]) &
               - item%h(:2*n, j))), maxval(abs(reshape((other(2)%t(:, :n, 1) &
               - other(1)%t(:, :n, 1))/small, [2*n]) - item%ht(:2*n, j, 1))))
         end do
         call check_true(error, worst < small, "differences: " // to_text(worst))
         if (allocated(error)) return
      end do

   contains

      !> What a direction does on the way, and that no rigid motion sees it.
      subroutine sums(what, g, du, middle, change)
         character(len=*), intent(in) :: what
         real(wp), intent(in) :: g(:, :), du(:, :), middle(:, :), change

         call check_near(error, [sum(g*du), sum(g(1, :)), sum(g(2, :)), &
            sum(g(2, :)*middle(1, :) - g(1, :)*middle(2, :))], [change, 0.0_wp, 0.0_wp, 0.0_wp], &
            tol, 4.0_wp, what)
      end subroutine sums

      !> By how much the slope of a difference is not that of column `j`.
      pure real(wp) function missed(value, slope, j)
         real(wp), intent(in) :: value(2), slope(:, :)
         integer, intent(in) :: j

         missed = abs((value(2) - value(1))/small - slope(1 + mod(j - 1, 2), 1 + (j - 1)/2))
      end function missed

   end subroutine test_derivatives

   !> A node that goes by an angle about the centre goes along the arc, twice the tangent of half of
   !> it; a disc that rolls on it does not slide, on either side.
   subroutine test_ways(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: radius = 3.0_wp, small = 0.7_wp, chord = 0.1_wp, angle = 0.4_wp
      type(polygon_stencil_t) :: stencil
      real(wp), dimension(2, 4) :: x, du, still
      real(wp) :: from, to, apart, spin
      integer :: i, way

      stencil%n = 3
      stencil%node(:3) = [1, 2, 3]
      still = 0.0_wp
      do i = 1, 20
         way = 2*mod(i, 2) - 1
         from = real(i, wp)
         to = from + angle
         apart = radius + way*small
         x(:, 1) = apart*[cos(from), sin(from)]
         x(:, 2) = radius*[cos(1.3_wp*from), sin(1.3_wp*from)]
         x(:, 3) = radius*[cos(1.3_wp*from + way*chord), sin(1.3_wp*from + way*chord)]
         x(:, 4) = x(:, 1) + [0.0_wp, 0.5_wp]
         stencil%round%bend(0) = way*2.0_wp*sin(0.5_wp*chord)
         du = 0.0_wp
         du(:, 1) = apart*[cos(to), sin(to)] - x(:, 1)
         stencil%arm = 0
         call check_near(error, polygon_slip_over(stencil, 1.0_wp, x, still, du), &
            way*2.0_wp*radius*tan(0.5_wp*angle), tol, radius/chord, "way")
         ! The angle from the arm to the normal grows by what rolls the same way back.
         spin = angle + way*2.0_wp*atan(radius/small*tan(0.5_wp*angle))
         du(:, 4) = du(:, 1) + 0.5_wp*[-sin(spin), cos(spin) - 1.0_wp]
         stencil%arm = 4
         stencil%radius = small
         call check_near(error, polygon_slip_over(stencil, 1.0_wp, x, still, du), 0.0_wp, tol, &
            radius/chord, "it rolls")
      end do
   end subroutine test_ways

end module test_circles
