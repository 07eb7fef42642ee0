!> The node-to-segment gap: closed forms, corners, identity, momenta, derivatives, rigid motions.
module test_nts_gap
   use check, only : check_near, check_true, test_case_t
   use emcon_dgrad8, only : dg_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_nts_gap, only : nts_gap_of => nts_gap
   use emcon_nts_gap_value, only : edge_round_t, nearly_flat => flat, nts_gap_value
   use emcon_text, only : to_text
   use nodal_numbers, only : by_nodes, nodal_t
   use random_draws, only : draw_random
   use referee, only : qp
   use small_scenes, only : shake
   implicit none
   private
   public :: collect_nts_gap

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Some 50 roundings of quantities of size 1.
   real(wp), parameter :: tol = 64.0_wp*eps
   !> Sharp corners, and corners rounded over these lengths: concave and convex, before the edge and
   !> after it.
   real(wp), parameter :: sharp(2, 2) = 0.0_wp, round(2, 2) = reshape([0.05_wp, 0.06_wp, &
      0.04_wp, 0.03_wp], [2, 2])
   !> Slave node, edge, node before it, node after it; the body is below the edge.
   real(wp), parameter :: flat(2, 5) = reshape([0.3_wp, 0.4_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
      2.1_wp, 0.0_wp, -0.9_wp, 0.0_wp], [2, 5])

contains

   subroutine collect_nts_gap(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("flat surface", test_flat), &
         test_case_t("corners: maximum if convex, minimum if concave", test_corner), &
         test_case_t("continuous across the bisector", test_continuity), &
         test_case_t("rounded corners", test_rounded), &
         test_case_t("a corner that is nearly flat", test_nearly_flat), &
         test_case_t("rounded corners are those of either edge", test_either_edge), &
         test_case_t("the top of a corner has no side", test_top), &
         test_case_t("identity and values", test_identity), &
         test_case_t("tiny steps", test_tiny), &
         test_case_t("momenta", test_momenta), &
         test_case_t("gradient and second derivatives", test_derivatives), &
         test_case_t("rigid motions leave the gap", test_rigid), &
         test_case_t("around convex corners", test_around)]
   end subroutine collect_nts_gap

   !> The gap over a step with its derivatives by all five nodes.
   pure type(nodal_t) function nts_gap(x0, dx, before, after, rounding, round)
      real(wp), intent(in) :: x0(:, :), dx(:, :), rounding(2, 2)
      integer, intent(in) :: before, after
      type(edge_round_t), intent(in), optional :: round
      type(dg_t) :: a

      a = nts_gap_of(x0, dx, before, after, rounding, round)
      nts_gap = by_nodes(5, [a%f0, a%f1, a%df], a%g, a%c, a%h)
   end function nts_gap

   !> Distance from a line, whichever neighbours there are, at any angle.
   subroutine test_flat(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x(2, 5), gap, xi, place
      integer :: i

      do i = 0, 30
         place = 0.2_wp*real(i - 10, wp)         ! from before the edge to beyond it
         x = flat
         x(:, 1) = [1.0_wp - place, 0.3_wp*real(mod(i, 3) - 1, wp)]
         x = turned(0.7_wp*real(i, wp), x)
         call nts_gap_value(x, 4, 5, sharp, gap, xi)
         call check_near(error, gap, 0.3_wp*real(mod(i, 3) - 1, wp), tol, 1.0_wp, "gap")
         call check_near(error, xi, place, tol, 4.0_wp, "projection")
         call nts_gap_value(x(:, :3), 0, 0, sharp, gap, xi)
         call check_near(error, gap, 0.3_wp*real(mod(i, 3) - 1, wp), tol, 1.0_wp, "lonely edge")
      end do
   end subroutine test_flat

   pure function turned(angle, x) result(y)
      real(wp), intent(in) :: angle, x(:, :)
      real(wp) :: y(2, size(x, 2))

      y(1, :) = cos(angle)*x(1, :) - sin(angle)*x(2, :)
      y(2, :) = sin(angle)*x(1, :) + cos(angle)*x(2, :)
   end function turned

   !> Gap over the line from `a` to `b`.
   pure real(wp) function line_gap(s, a, b)
      real(wp), intent(in) :: s(2), a(2), b(2)

      line_gap = ((b(2) - a(2))*(s(1) - a(1)) - (b(1) - a(1))*(s(2) - a(2))) &
         /sqrt(dot_product(b - a, b - a))
   end function line_gap

   !> Around a corner of up to 120 degrees, before and after the edge, inside and outside.
   subroutine test_corner(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x(2, 5), gap, xi, turn, own, other, expected, move(2, 1)
      integer :: i, n_crossed

      n_crossed = 0
      do i = 1, 400
         x = flat
         call draw_random(turn)
         turn = 4.2_wp*(turn - 0.5_wp)           ! > 0: convex
         x(:, 5:5) = turned(turn, reshape([-0.9_wp, 0.0_wp], [2, 1]))
         call shake(move, 0.4_wp)
         x(:, 1) = move(:, 1)
         own = line_gap(x(:, 1), x(:, 2), x(:, 3))
         other = line_gap(x(:, 1), x(:, 3), x(:, 5))
         expected = merge(max(own, other), min(own, other), turn > 0.0_wp)
         if (abs(expected - own) > tol) n_crossed = n_crossed + 1
         call nts_gap_value(x(:, [1, 2, 3, 5]), 0, 4, sharp, gap, xi)
         call check_near(error, gap, expected, tol, 1.0_wp, "corner after the edge")
         ! The same corner seen from the other edge: then it lies before that one.
         call nts_gap_value(x(:, [1, 3, 5, 2]), 4, 0, sharp, gap, xi)
         call check_near(error, gap, expected, tol, 1.0_wp, "corner before the edge")
      end do
      call check_true(error, n_crossed > 100, "many nodes are over the neighbour")
   end subroutine test_corner

   !> Just left and just right of the bisector of a corner.
   subroutine test_continuity(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x(2, 4), gap(2), xi, turn, way(2)
      real(wp), parameter :: side(2) = [-1.0_wp, 1.0_wp]
      integer :: i, k

      do i = -10, 10
         turn = 0.2_wp*real(i, wp)
         x = flat(:, :4)
         x(:, 4:4) = turned(turn, reshape([-0.9_wp, 0.0_wp], [2, 1]))
         way = [cos(0.5_wp*turn), sin(0.5_wp*turn)]
         do k = 1, 2
            x(:, 1) = 0.3_wp*[-way(2), way(1)] + side(k)*sqrt(eps)*way
            call nts_gap_value(x, 0, 4, sharp, gap(k), xi)
         end do
         call check_near(error, gap(1), gap(2), 4.0_wp*sqrt(eps), 1.0_wp, "both sides")
         x(:, 1) = x(:, 3)
         call nts_gap_value(x, 0, 4, sharp, gap(1), xi)
         call check_near(error, gap(1), 0.0_wp, tol, 1.0_wp, "at the corner")
      end do
   end subroutine test_continuity

   !> A rounded corner stays within half the rounding, times the bend, of the sharp one, outside of
   !> the body: a closed gap is no penetration, but by `inside` where the corner is nearly flat.
   subroutine test_rounded(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x(2, 5), dx(2, 5), exact, bent, xi, way(2), turn
      integer :: i, n_within
      !> The largest of m+(tau) - min(tau, 0), and of kappa - kappa+.
      real(wp), parameter :: inside = 0.13_wp*maxval(round)*4.0_wp/27.0_wp*nearly_flat

      n_within = 0
      do i = 1, 200
         call draw(x, dx)
         call nts_gap_value(x, 4, 5, sharp, exact, xi)
         call nts_gap_value(x, 4, 5, round, bent, xi)
         call check_near(error, bent, exact, 0.5_wp, 2.0_wp*maxval(round), "gap")
         call check_true(error, bent <= exact + inside, "outside")
         call draw_random(way)
         x(:, 1) = x(:, 2) + 0.1_wp*(way - 0.5_wp)
         call nts_gap_value(x, 4, 5, sharp, exact, xi)
         call nts_gap_value(x, 4, 5, round, bent, xi)
         if (bent < exact) n_within = n_within + 1
         call check_true(error, bent <= exact + inside, "outside, near the corner")
         x(:, 1) = x(:, 2)
         call nts_gap_value(x, 4, 5, round, bent, xi)
         turn = (x(1, 2) - x(1, 4))*(x(2, 3) - x(2, 2)) - (x(2, 2) - x(2, 4))*(x(1, 3) - x(1, 2))
         if (turn > 0.0_wp) call check_near(error, bent, 0.0_wp, tol, 1.0_wp, "convex corner")
         x = flat
         call draw_random(x(:, 1))
         call nts_gap_value(x, 4, 5, round, bent, xi)
         call check_near(error, bent, x(2, 1), tol, 1.0_wp, "nothing to round on a flat surface")
      end do
      call check_true(error, n_within > 100, "in the band")
   end subroutine test_rounded

   !> Over a master node the gap of a surface that round-off or a load has bent a little, either
   !> way, is that from the node but for the square of the bend, and what the node is pushed with
   !> goes to no other: the far ends of the edges have less of it than the bend.
   subroutine test_nearly_flat(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x(2, 5), dx(2, 5), turn
      type(nodal_t) :: a
      integer :: i

      dx = 0.0_wp
      do i = -14, 14
         turn = sign(10.0_wp**(-3 - abs(i)), real(i, wp))
         x = flat
         x(2, 4:5) = -[0.9_wp, 1.1_wp]*turn
         x(:, 1) = x(:, 3)
         a = nts_gap(x, dx, 4, 5, round)
         ! kappa+ < 2 kappa^2/flat, kappa = turn; m(0) = -3/16 of the width.
         call check_near(error, a%f1, 0.0_wp, tol + turn**2/nearly_flat*maxval(round), 1.0_wp, &
            "gap: " // to_text(turn))
         call check_near(error, a%g([3, 4, 7, 8, 9, 10]), spread(0.0_wp, 1, 6), &
            tol + 4.0_wp*abs(turn)/nearly_flat*maxval(round), 1.0_wp, "other nodes: " &
            // to_text(turn))
      end do
   end subroutine test_nearly_flat

   !> Over a corner the gap does not depend on which of its edges is the chosen one.
   subroutine test_either_edge(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x(2, 5), dx(2, 5), gap(2), xi
      integer :: i, n_within

      n_within = 0
      do i = 1, 200
         call draw(x, dx)
         x(:, 1) = x(:, 3) + round(1, 1)*(x(:, 1) - 0.5_wp)
         call nts_gap_value(x(:, [1, 2, 3, 5]), 0, 4, round(:, [2, 1]), gap(1), xi)
         if (xi > 1.0_wp) n_within = n_within + 1
         call nts_gap_value(x(:, [1, 3, 5, 2]), 4, 0, round, gap(2), xi)
         call check_near(error, gap(1), gap(2), tol, 1.0_wp, "gap")
      end do
      call check_true(error, n_within > 50 .and. n_within < 150, "on both sides")
   end subroutine test_either_edge

   !> Over a corner that faces a corner: gradients at mirrored places are mirror images. In the
   !> middle the normal is that between the edges, and t of the half width beside it the slope of
   !> what the corner adds is at least 1/2 - 15 t^3. Nowhere does it change faster than by 3 t.
   subroutine test_top(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: width = 0.25_wp, up = 0.05_wp, still(2, 4) = 0.0_wp
      real(wp), parameter :: step = 0.0075_wp    ! of t
      real(wp), parameter :: half(3) = [0.13_wp, 0.5_wp, 0.785_wp]
      type(nodal_t) :: one, other, before
      real(wp) :: x(2, 4), place, rounding(2, 2)
      integer :: i, k

      rounding(1, :) = 0.01_wp*width
      rounding(2, :) = width
      do k = 1, size(half)
         associate (c => cos(half(k)), s => sin(half(k)))
            x(:, 2:) = reshape([c, -s, 0.0_wp, 0.0_wp, -c, -s], [2, 3])
            do i = 0, 200
               place = 0.5_wp*width/c*step*real(i, wp)
               x(:, 1) = [place, up]
               one = nts_gap(x, still, 0, 4, rounding)
               x(:, 1) = [-place, up]
               other = nts_gap(x, still, 0, 4, rounding)
               call check_near(error, other%g(:2), [-one%g(1), one%g(2)], tol, 1.0_wp, "mirrored")
               if (i == 0) call check_near(error, one%g(:2), [0.0_wp, c], tol, &
                  1.0_wp, "middle")
               call check_true(error, abs(one%g(1)) <= 30.0_wp*s*(2.0_wp*c*place/width)**3 + tol, &
                  "flat in the middle: " // to_text(one%g(1)))
               if (i > 0) call check_true(error, abs(one%g(1) - before%g(1)) <= 6.0_wp*s*step &
                  + tol, "no jump: " // to_text(place))
               before = one
            end do
         end associate
      end do
   end subroutine test_top

   !> Chains of three edges and their motion of up to a third of an edge, slave node across both
   !> corners. Edges are in random places of the array.
   subroutine draw(x0, dx)
      real(wp), intent(out) :: x0(2, 5), dx(2, 5)
      real(wp) :: move(2, 5)

      call shake(move, 0.3_wp)
      call shake(dx, 0.35_wp)
      x0 = flat + move
      call draw_random(x0(:, 1))
      x0(:, 1) = [-0.5_wp, -0.5_wp] + [2.0_wp, 1.0_wp]*x0(:, 1)
   end subroutine draw

   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x0(2, 5), dx(2, 5), g(2, 5), gap(2), xi(2), width(2, 2)
      type(nodal_t) :: a
      integer :: i, n_crossed

      n_crossed = 0
      do i = 1, 500
         call draw(x0, dx)
         width = merge(round, sharp, mod(i, 2) == 0)
         a = nts_gap(x0, dx, 4, 5, width)
         g = reshape(a%g, [2, 5])
         call nts_gap_value(x0, 4, 5, width, gap(1), xi(1))
         call nts_gap_value(x0 + dx, 4, 5, width, gap(2), xi(2))
         if (any(abs(xi - 0.5_wp) > 0.7_wp)) n_crossed = n_crossed + 1
         call check_near(error, [a%f0, a%f1], gap, tol, 2.0_wp, "values")
         call check_near(error, a%df, gap(2) - gap(1), tol, 4.0_wp, "increment")
         call check_near(error, sum(g*dx), a%df, tol, sum(abs(g*dx)), "identity")
         a = nts_gap(x0(:, :3), dx(:, :3), 0, 0, sharp)
         g = reshape(a%g, [2, 5])
         call check_near(error, sum(g*dx), a%df, tol, sum(abs(g*dx)), "lonely edge")
         call check_near(error, g(:, 4:), 0.0_wp*g(:, 4:), 0.0_wp, 1.0_wp, "absent nodes")
      end do
      call check_true(error, n_crossed > 100, "corners are passed")
   end subroutine test_identity

   !> The gap in quadruple precision.
   pure real(qp) function exact_gap(x)
      real(qp), intent(in) :: x(2, 5)
      real(qp) :: own, before, after, bisector(2)

      own = exact_line(x(:, 1), x(:, 2), x(:, 3))
      before = exact_line(x(:, 1), x(:, 4), x(:, 2))
      after = exact_line(x(:, 1), x(:, 3), x(:, 5))
      exact_gap = own
      bisector = unit(x(:, 2) - x(:, 4)) + unit(x(:, 3) - x(:, 2))
      if (dot_product(bisector, x(:, 1) - x(:, 2)) < 0.0_qp) exact_gap = exact_gap + before - own
      bisector = unit(x(:, 3) - x(:, 2)) + unit(x(:, 5) - x(:, 3))
      if (dot_product(bisector, x(:, 1) - x(:, 3)) > 0.0_qp) exact_gap = exact_gap + after - own
   end function exact_gap

   pure function unit(a) result(e)
      real(qp), intent(in) :: a(2)
      real(qp) :: e(2)

      e = a/sqrt(dot_product(a, a))
   end function unit

   pure real(qp) function exact_line(s, a, b)
      real(qp), intent(in) :: s(2), a(2), b(2)
      real(qp) :: e(2)

      e = unit(b - a)
      exact_line = e(2)*(s(1) - a(1)) - e(1)*(s(2) - a(2))
   end function exact_line

   !> `df` relative to its terms: against quadruple precision as far as that reaches, and g.dx
   !> against it down to the smallest motions.
   subroutine test_tiny(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x0(2, 5), dx(2, 5), expected, g(2, 5)
      real(qp) :: q0(2, 5)
      type(nodal_t) :: a
      integer :: k

      do k = 0, -minexponent(1.0_wp) - 12, 4
         call draw(x0, dx)
         dx = scale(dx, -k)
         a = nts_gap(x0, dx, 4, 5, sharp)
         g = reshape(a%g, [2, 5])
         call check_near(error, sum(g*dx), a%df, tol, sum(abs(g*dx)), "g.dx at 2^-" // to_text(k))
         if (k > digits(1.0_qp) - digits(1.0_wp)) cycle
         q0 = real(x0, qp)
         expected = real(exact_gap(q0 + real(dx, qp)) - exact_gap(q0), wp)
         call check_near(error, a%df, expected, tol, 4.0_wp*sum(abs(dx)), &
            "df at 2^-" // to_text(k))
      end do
   end subroutine test_tiny

   subroutine test_momenta(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x0(2, 5), dx(2, 5), g(2, 5), mid(2, 5)
      type(nodal_t) :: a
      integer :: i

      do i = 1, 200
         call draw(x0, dx)
         mid = x0 + 0.5_wp*dx
         a = nts_gap(x0, dx, 4, 5, merge(round, sharp, mod(i, 2) == 0))
         g = reshape(a%g, [2, 5])
         call check_near(error, sum(g, dim=2), [0.0_wp, 0.0_wp], tol, sum(abs(g)), "linear")
         call check_near(error, sum(mid(1, :)*g(2, :) - mid(2, :)*g(1, :)), 0.0_wp, tol, &
            sum(abs(g))*maxval(abs(mid)), "angular")
      end do
   end subroutine test_momenta

   !> c against differences of the value, h against those of g. Steps of eps^(1/3), hence errors of
   !> eps^(2/3) times third derivatives, 12/width^2 at a rounded corner, by 6. Where a sharp
   !> bisector is crossed within the step of the difference, the gradient jumps; such a case has no
   !> difference to compare with.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x0(2, 5), dx(2, 5), way(2, 5), step, bound, gap(2), xi, width(2, 2)
      type(nodal_t) :: a, up, down
      integer :: i, k, n, j

      step = eps**(1.0_wp/3.0_wp)
      bound = 4.0_wp*(step/minval(round, round > 0.0_wp))**2
      do i = 1, 40
         call draw(x0, dx)
         width = merge(round, sharp, mod(i, 2) == 0)
         a = nts_gap(x0, dx, 4, 5, width)
         do k = 1, 5
            do n = 1, 2
               j = 2*k - 2 + n
               way = 0.0_wp
               way(n, k) = step
               up = nts_gap(x0, dx + way, 4, 5, width)
               down = nts_gap(x0, dx - way, 4, 5, width)
               if (maxval(abs(up%c - down%c)) > 1.0e3_wp*step) cycle
               call nts_gap_value(x0 + dx + way, 4, 5, width, gap(1), xi)
               call nts_gap_value(x0 + dx - way, 4, 5, width, gap(2), xi)
               call check_near(error, a%c(j), (gap(1) - gap(2))/(2.0_wp*step), &
                  bound, 1.0_wp, "gradient")
               call check_near(error, a%h(:, j), (up%g - down%g)/(2.0_wp*step), &
                  bound, 1.0_wp + maxval(abs(a%h)), "column " // to_text(j))
            end do
         end do
      end do
   end subroutine test_derivatives

   !> A step that only turns and moves everything: no change of the gap.
   subroutine test_rigid(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x0(2, 5), dx(2, 5)
      type(nodal_t) :: a
      integer :: i

      do i = 1, 100
         call draw(x0, dx)
         dx = turned(0.06_wp*real(i, wp), x0) + 5.0_wp - x0
         a = nts_gap(x0, dx, 4, 5, merge(round, sharp, mod(i, 2) == 0))
         call check_near(error, a%df, 0.0_wp, tol, 20.0_wp, "increment")
         call check_near(error, a%f1, a%f0, tol, 20.0_wp, "values")
      end do
   end subroutine test_rigid

   !> Around convex corners the gap is the distance; exact, with its derivatives, as elsewhere.
   subroutine test_around(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x0(2, 5), dx(2, 5), g(2, 5), mid(2, 5), move(2, 5), way(2, 5), gap(2), xi, step
      type(nodal_t) :: a, up, down
      integer :: i, k, j, n_beyond

      step = eps**(1.0_wp/3.0_wp)
      n_beyond = 0
      do i = 1, 200
         call shake(move, 0.05_wp)
         call shake(dx, 0.15_wp)
         x0 = flat + move
         x0(2, 4:5) = x0(2, 4:5) - [0.9_wp, 0.7_wp]
         call draw_random(x0(:, 1))
         x0(:, 1) = [-0.5_wp, 0.4_wp] + [2.0_wp, 0.3_wp]*x0(:, 1)
         a = nts_gap(x0, dx, 4, 5, round, edge_round_t(.true.))
         call nts_gap_value(x0, 4, 5, round, gap(1), xi, edge_round_t(.true.))
         if (abs(xi - 0.5_wp) > 0.6_wp) n_beyond = n_beyond + 1
         call nts_gap_value(x0 + dx, 4, 5, round, gap(2), xi, edge_round_t(.true.))
         call check_near(error, [a%f0, a%f1], gap, tol, 2.0_wp, "values")
         call check_near(error, gap, [distance(x0), distance(x0 + dx)], tol, 4.0_wp, "distances")
         g = reshape(a%g, [2, 5])
         mid = x0 + 0.5_wp*dx
         call check_near(error, sum(g*dx), gap(2) - gap(1), tol, 8.0_wp*sum(abs(g*dx)), "identity")
         call check_near(error, sum(g, dim=2), [0.0_wp, 0.0_wp], tol, sum(abs(g)), "linear")
         call check_near(error, sum(mid(1, :)*g(2, :) - mid(2, :)*g(1, :)), 0.0_wp, tol, &
            sum(abs(g))*maxval(abs(mid)), "angular")
         ! Differences over longer ways than these do not see rounded corners.
         if (10.0_wp*step > minval(round)) cycle
         do j = 1, 10
            k = (j + 1)/2
            way = 0.0_wp
            way(j - 2*k + 2, k) = step
            up = nts_gap(x0, dx + way, 4, 5, round, edge_round_t(.true.))
            down = nts_gap(x0, dx - way, 4, 5, round, edge_round_t(.true.))
            ! The curvature jumps where the corner begins to count.
            call check_near(error, a%c(j), (up%f1 - down%f1)/(2.0_wp*step), 16.0_wp*step, 1.0_wp, &
               "gradient")
            if (maxval(abs(up%c + down%c - 2.0_wp*a%c)) > 1.0e3_wp*step**2) cycle
            call check_near(error, a%h(:, j), (up%g - down%g)/(2.0_wp*step), 1.0e3_wp*step**2, &
               1.0_wp + maxval(abs(a%h)), "column " // to_text(j))
         end do
      end do
      call check_true(error, n_beyond > 30, "corners are gone around")
   end subroutine test_around

   !> Distance of the first node from the chain of the others.
   pure real(wp) function distance(x)
      real(wp), intent(in) :: x(2, 5)
      integer, parameter :: chain(4) = [4, 2, 3, 5]
      real(wp) :: a(2), b(2)
      integer :: i

      distance = huge(distance)
      do i = 1, 3
         a = x(:, chain(i + 1)) - x(:, chain(i))
         b = x(:, 1) - x(:, chain(i))
         b = b - max(0.0_wp, min(1.0_wp, dot_product(a, b)/dot_product(a, a)))*a
         distance = min(distance, norm2(b))
      end do
   end function distance

end module test_nts_gap
