!> The gap over a smoothed surface: closed forms, order, corners, identity, momenta, derivatives.
module test_hermite_gap
   use check, only : check_near, check_true, test_case_t
   use emcon_dgrad13, only : dg_t
   use emcon_errors, only : error_t
   use emcon_hermite, only : hermite_closest, hermite_curve, hermite_curve_t, hermite_point, &
      hermite_point_t, hermite_stencil_t, joined_pieces
   use emcon_hermite_gap, only : hermite_gap_of => hermite_gap, hermite_slip_of => hermite_slip
   use emcon_hermite_gap_value, only : hermite_begin, hermite_gap_value, hermite_slip_value
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   use nodal_numbers, only : by_nodes, nodal_t
   use random_draws, only : draw_random
   use small_scenes, only : shake
   implicit none
   private
   public :: collect_hermite_gap

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Some 500 roundings of quantities of size 1: three sums of up to 30 products each.
   real(wp), parameter :: tol = 512.0_wp*eps
   real(wp), parameter :: pi = acos(-1.0_wp)
   !> Sharp corners, and corners rounded over this length.
   real(wp), parameter :: rounding(2) = [0.0_wp, 0.05_wp]
   !> Slave node, edge, node before and after it, nodes before and after these; the body is below.
   real(wp), parameter :: flat(2, 7) = reshape([0.3_wp, 0.4_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
      2.1_wp, 0.0_wp, -0.9_wp, 0.0_wp, 3.0_wp, 0.0_wp, -2.0_wp, 0.0_wp], [2, 7])
   integer, parameter :: chain(6) = [6, 4, 2, 3, 5, 7]
   !> The same nodes from the next edge along the chain.
   integer, parameter :: next_local(7) = [1, 3, 5, 2, 7, 4, 6]
   !> Kinds of stencil: smooth; with corners at one, the other and both ends of the edge, and at the
   !> nodes behind; with ends.
   integer, parameter :: n_kind = 7

contains

   subroutine collect_hermite_gap(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("flat surface", test_flat), &
         test_case_t("circle: error of order 4", test_circle), &
         test_case_t("circle: ends and unequal edges", test_unequal), &
         test_case_t("closest point", test_closest), &
         test_case_t("of several the one that a way downhill comes to", test_downhill), &
         test_case_t("corners: maximum if convex, minimum if concave", test_corner), &
         test_case_t("rounded corners", test_rounded), &
         test_case_t("lost near the centre of curvature", test_focal), &
         test_case_t("beyond a corner, at the centre of curvature", test_corner_focal), &
         test_case_t("smooth across a master node", test_smooth), &
         test_case_t("neighbouring edges agree", test_neighbours), &
         test_case_t("identity and values", test_identity), &
         test_case_t("tiny steps", test_tiny), &
         test_case_t("momenta", test_momenta), &
         test_case_t("gradient and second derivatives", test_derivatives), &
         test_case_t("rigid motions leave the gap", test_rigid), &
         test_case_t("slip along a line is its length", test_slip_of_line), &
         test_case_t("slip: work, value, rigid motions", test_slip), &
         test_case_t("slip: gradient and second derivatives", test_slip_derivatives)]
   end subroutine collect_hermite_gap

   !> The gap over a step with its derivatives by all seven nodes, not by the place.
   pure subroutine hermite_gap(stencil, x0, dx, s, gap, is_found)
      type(hermite_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x0(:, :), dx(:, :), s(3)
      type(nodal_t), intent(out) :: gap
      logical, intent(out) :: is_found
      type(dg_t) :: a
      integer :: n

      call hermite_gap_of(stencil, x0, dx, s, a, is_found)
      n = size(a%g)
      if (maxval(abs([a%g(n), a%c(n), a%h(:, n), a%h(n, :)])) > 0.0_wp) is_found = .false.
      gap = by_nodes((n + 1)/2, [a%f0, a%f1, a%df], a%g, a%c, a%h)
   end subroutine hermite_gap

   !> The slip likewise; `df` is huge if the place is one of its variables.
   pure subroutine hermite_slip(stencil, x0, dx, s, slip)
      type(hermite_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x0(:, :), dx(:, :), s
      type(nodal_t), intent(out) :: slip
      type(dg_t) :: a
      integer :: n

      call hermite_slip_of(stencil, x0, dx, s, a)
      n = size(a%g)
      slip = by_nodes((n + 1)/2, [a%f0, a%f1, a%df], a%g, a%c, a%h)
      if (maxval(abs([a%g(n), a%c(n)])) > 0.0_wp) slip%df = huge(slip%df)
   end subroutine hermite_slip

   !> Stencil over the nodes of `flat`, with its distances as reference lengths.
   pure function stencil_of(kind) result(stencil)
      integer, intent(in) :: kind                !! 1 to n_kind
      type(hermite_stencil_t) :: stencil

      stencil%node = chain
      stencil%length = flat(1, chain(:5)) - flat(1, chain(2:))
      select case (kind)
      case (2)
         stencil%is_corner(3) = .true.
      case (3)
         stencil%is_corner([4, 5]) = .true.
      case (4)
         stencil%is_corner([3, 4]) = .true.
         stencil%node([1, 6]) = 0
      case (5)
         stencil%node([1, 2]) = 0
      case (6)
         stencil%node(5:6) = 0
         stencil%is_corner(2) = .true.
      case (7)
         stencil%node([1, 2, 5, 6]) = 0
      case default
      end select
   end function stencil_of

   !> The smooth stencil whose chosen edge is the next one; its nodes are those of `next_local`.
   pure function next_stencil() result(stencil)
      type(hermite_stencil_t) :: stencil

      stencil = stencil_of(1)
      stencil%node(6) = 0
      stencil%length = [stencil%length(2:), 1.0_wp]
   end function next_stencil

   !> The gap of one configuration alone.
   subroutine lone_gap(stencil, x, gap, place, error)
      type(hermite_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x(:, :)
      real(wp), intent(out) :: gap, place
      type(error_t), allocatable, intent(inout) :: error
      type(hermite_stencil_t) :: fixed
      real(wp) :: s(3)
      logical :: is_found

      fixed = stencil
      call hermite_begin(fixed, x, s)
      call hermite_gap_value(fixed, x, s, gap, is_found)
      place = s(1)
      call check_true(error, is_found, "closest point found")
   end subroutine lone_gap

   pure function turned(angle, x) result(y)
      real(wp), intent(in) :: angle, x(:, :)
      real(wp) :: y(2, size(x, 2))

      y(1, :) = cos(angle)*x(1, :) - sin(angle)*x(2, :)
      y(2, :) = sin(angle)*x(1, :) + cos(angle)*x(2, :)
   end function turned

   !> Distance from a line, whatever corners and ends there are, at any angle, with edges that are
   !> stretched unevenly, by less than the factor of 3 at which an end would turn back.
   subroutine test_flat(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x(2, 7), gap, place, height
      integer :: i, kind

      do kind = 1, n_kind
         do i = 0, 30
            height = 0.3_wp*real(mod(i, 3) - 1, wp)
            x = flat
            x(1, 3) = 0.01_wp*real(i, wp)
            x(:, 1) = [0.2_wp*real(i - 12, wp), height]
            x = turned(0.7_wp*real(i, wp), x)
            call lone_gap(stencil_of(kind), x, gap, place, error)
            call check_near(error, gap, height, tol, 1.0_wp, "gap, kind " // to_text(kind))
         end do
      end do
   end subroutine test_flat

   !> Nodes on a circle of radius 1, body inside, at the angles `angle`; slave node outside at
   !> `at`, by 0.1.
   pure function on_circle(angle, at) result(x)
      real(wp), intent(in) :: angle(6), at
      real(wp) :: x(2, 7)

      x(:, chain) = reshape([cos(angle(1)), sin(angle(1)), cos(angle(2)), sin(angle(2)), &
         cos(angle(3)), sin(angle(3)), cos(angle(4)), sin(angle(4)), cos(angle(5)), &
         sin(angle(5)), cos(angle(6)), sin(angle(6))], [2, 6])
      x(:, 1) = 1.1_wp*[cos(at), sin(at)]
   end function on_circle

   !> Equal edges of angle t: the nodal tangents have the right direction and the length cos(t/2).
   !> In leading order, the cubic through exact tangents is t^4 eta^2 (1 - eta)^2/24 inside the
   !> circle, and the missing length takes it inwards by another t^4 eta^2 (1 - eta)^2/3.
   subroutine test_circle(error)
      type(error_t), allocatable, intent(out) :: error
      type(hermite_stencil_t) :: stencil
      real(wp) :: gap, place, t, eta
      integer :: i, k, n

      n = 12
      do k = 1, 4
         t = 2.0_wp*pi/real(n, wp)
         stencil%node = chain
         stencil%length = 2.0_wp*sin(0.5_wp*t)
         do i = 1, 9
            eta = 0.1_wp*real(i, wp)
            call lone_gap(stencil, on_circle(t*[(real(n, wp), n=1, 6)], t*(3.0_wp + eta)), gap, &
               place, error)
            ! Half a relative error of order t^2; it is 0.2 t^2 by the next terms of the series.
            call check_near(error, gap - 0.1_wp, 0.375_wp*t**4*(eta*(1.0_wp - eta))**2, &
               0.5_wp*t**2, 0.375_wp*t**4/16.0_wp + 32.0_wp*eps/t**2, "n = " // to_text(n))
         end do
         n = 2*nint(2.0_wp*pi/t)
      end do
   end subroutine test_circle

   !> Edges of 2 : 3 in turn, within the surface, beside a corner and beside an end. With chords as
   !> lengths the parabola's tangent is that of the circle; the factor is 2^4 for half the edges.
   subroutine test_unequal(error)
      type(error_t), allocatable, intent(out) :: error
      type(hermite_stencil_t) :: stencil
      real(wp) :: gap, place, t, angle(6), worst(2)
      integer :: i, k, kind

      do kind = 1, 3
         t = 0.2_wp
         do k = 1, 2
            angle = t*[-2.5_wp, -1.5_wp, 0.0_wp, 1.0_wp, 2.5_wp, 3.5_wp]
            stencil = hermite_stencil_t(node=chain)
            stencil%length = 2.0_wp*sin(0.5_wp*(angle(2:) - angle(:5)))
            stencil%is_corner(3) = kind == 2
            if (kind == 3) stencil%node(5:6) = 0
            worst(k) = 0.0_wp
            do i = 1, 9
               call lone_gap(stencil, on_circle(angle, 0.1_wp*real(i, wp)*t), gap, place, error)
               worst(k) = max(worst(k), abs(gap - 0.1_wp))
            end do
            t = 0.5_wp*t
         end do
         call check_near(error, log(worst(1)/worst(2))/log(2.0_wp), 4.0_wp, 0.1_wp, 1.0_wp, &
            "order, kind " // to_text(kind))
      end do
   end subroutine test_unequal

   !> No point of the curve is closer, and the curve's tangent is its derivative.
   subroutine test_closest(error)
      type(error_t), allocatable, intent(out) :: error
      type(hermite_stencil_t) :: stencil
      type(hermite_point_t) :: p, up, down
      real(wp) :: x(2, 7), dx(2, 7), gap, place, edge(2, 5), s, step, nearest
      integer :: i, k

      step = eps**(1.0_wp/3.0_wp)
      stencil = stencil_of(1)
      do i = 1, 100
         call draw(x, dx)
         call lone_gap(stencil, x, gap, place, error)
         edge = x(:, chain(2:)) - x(:, chain(:5))
         nearest = huge(1.0_wp)
         do k = -15, 25
            s = 0.1_wp*real(k, wp) + 0.05_wp
            p = hermite_point(hermite_curve(stencil, joined_pieces), edge, s)
            nearest = min(nearest, norm2(x(:, 1) - x(:, 2) - p%y))
            up = hermite_point(hermite_curve(stencil, joined_pieces), edge, s + step)
            down = hermite_point(hermite_curve(stencil, joined_pieces), edge, s - step)
            call check_near(error, p%length*p%tangent, (up%y - down%y)/(2.0_wp*step), &
               100.0_wp*step**2, 1.0_wp, "tangent")
            call check_near(error, p%bend, (up%tangent - down%tangent)/(2.0_wp*step), &
               100.0_wp*step**2, 1.0_wp, "its derivative")
         end do
         call check_true(error, abs(gap) <= nearest + tol, "no closer point")
      end do
   end subroutine test_closest

   !> A wave of one crest every two edges: from wherever one starts, the first place where a walk in
   !> small steps towards the point comes no nearer.
   subroutine test_downhill(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: small = 1.0_wp/256.0_wp
      type(hermite_curve_t) :: curve
      real(wp) :: u(3), nodes(2, 6), edge(2, 5), b(2), s, walked
      integer :: i, j, k, n_place(-2:3)
      logical :: is_found

      curve = hermite_curve(stencil_of(1), joined_pieces)
      do k = 1, 6
         nodes(:, k) = [3.0_wp - real(k, wp), merge(0.4_wp, -0.4_wp, mod(k, 2) == 0)]
      end do
      edge = nodes(:, 2:) - nodes(:, :5)
      n_place = 0
      do i = 1, 200
         call draw_random(u)
         b = [-0.5_wp, 0.8_wp] - nodes(:, 3) + [u(1) - 0.5_wp, u(2)]
         s = 4.0_wp*u(3) - 1.5_wp
         walked = s
         k = nint(sign(1.0_wp, towards(s)))
         do while (k*towards(walked) > 0.0_wp .and. abs(walked) < 8.0_wp)
            walked = walked + k*small
         end do
         ! Two places within half an edge are not told apart.
         if (any([(k*towards(walked + j*k*small) > 0.0_wp, j = 0, 128)])) cycle
         call hermite_closest(curve, edge, b, s, is_found)
         call check_true(error, abs(walked - 0.5_wp*k*small - s) <= 0.5_wp*small + tol, "place " &
            // to_text(s) // ", walked to " // to_text(walked))
         if (abs(s) < 2.0_wp) n_place(nint(s)) = n_place(nint(s)) + 1
      end do
      call check_true(error, count(n_place > 10) > 1, "several places")

   contains

      !> > 0: places further on are nearer.
      pure real(wp) function towards(s)
         real(wp), intent(in) :: s
         type(hermite_point_t) :: p

         p = hermite_point(curve, edge, s)
         towards = dot_product(b - p%y, p%tangent)
      end function towards

   end subroutine test_downhill

   !> Gap over the line from `a` to `b`.
   pure real(wp) function line_gap(s, a, b)
      real(wp), intent(in) :: s(2), a(2), b(2)

      line_gap = ((b(2) - a(2))*(s(1) - a(1)) - (b(1) - a(1))*(s(2) - a(2))) &
         /sqrt(dot_product(b - a, b - a))
   end function line_gap

   !> Behind the corner after the edge a parabola of radius 1/2 whose vertex is at (-1/2, -1/4): at
   !> its centre the surface behind the corner is left out, below that it counts.
   subroutine test_corner_focal(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: height(2) = [0.25_wp, 0.0_wp]
      type(hermite_stencil_t) :: stencil
      real(wp) :: x(2, 7), s(3), gap
      logical :: is_found
      integer :: k

      stencil%node = chain
      stencil%length = 1.0_wp
      stencil%is_corner([3, 4]) = .true.
      x(:, chain) = reshape([3.0_wp, 0.0_wp, 2.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
         -1.0_wp, 0.0_wp, -2.0_wp, 2.0_wp], [2, 6])
      do k = 1, size(height)
         x(:, 1) = [-0.5_wp, height(k)]
         call hermite_begin(stencil, x, s)
         call check_true(error, stencil%has_neighbour(1) .and. (stencil%has_neighbour(2) .eqv. &
            k > 1), "what counts " // to_text(k))
         call hermite_gap_value(stencil, x, s, gap, is_found)
         call check_true(error, is_found, "found " // to_text(k))
         ! The edge goes on as a line; the vertex of the parabola is 1/4 below.
         call check_near(error, gap, 0.25_wp, tol, 1.0_wp, "gap " // to_text(k))
      end do
   end subroutine test_corner_focal

   !> Straight on both sides of a corner of up to 120 degrees, seen from either edge.
   subroutine test_corner(error)
      type(error_t), allocatable, intent(out) :: error
      type(hermite_stencil_t) :: stencil(2)
      real(wp) :: x(2, 7), gap, place, turn, own, other, expected, move(2, 1)
      integer :: i, n_crossed

      n_crossed = 0
      stencil = [stencil_of(1), next_stencil()]
      stencil(1)%is_corner(4) = .true.
      stencil(2)%is_corner(3) = .true.
      do i = 1, 400
         x = flat
         call draw_random(turn)
         turn = 4.2_wp*(turn - 0.5_wp)           ! > 0: convex
         x(:, [5, 7]) = turned(turn, flat(:, [5, 7]))
         call shake(move, 0.4_wp)
         x(:, 1) = move(:, 1)
         own = line_gap(x(:, 1), x(:, 2), x(:, 3))
         other = line_gap(x(:, 1), x(:, 3), x(:, 5))
         expected = merge(max(own, other), min(own, other), turn > 0.0_wp)
         if (abs(expected - own) > tol) n_crossed = n_crossed + 1
         call lone_gap(stencil(1), x, gap, place, error)
         call check_near(error, gap, expected, tol, 1.0_wp, "corner after the edge")
         call lone_gap(stencil(2), x(:, next_local), gap, place, error)
         call check_near(error, gap, expected, tol, 1.0_wp, "corner before the edge")
      end do
      call check_true(error, n_crossed > 100, "many nodes are over the neighbour")
   end subroutine test_corner

   !> A rounded corner stays within half the rounding of the sharp one, on its solid side.
   subroutine test_rounded(error)
      type(error_t), allocatable, intent(out) :: error
      type(hermite_stencil_t) :: stencil
      real(wp) :: x(2, 7), dx(2, 7), sharp, round, place
      integer :: i

      do i = 1, 200
         call draw(x, dx)
         stencil = stencil_of(2 + mod(i, 2))
         call lone_gap(stencil, x, sharp, place, error)
         stencil%rounding = rounding(2)
         call lone_gap(stencil, x, round, place, error)
         call check_near(error, round, sharp, 0.5_wp + tol, rounding(2), "gap")
      end do
   end subroutine test_rounded

   !> Inside a hole of radius 1: found near the surface, lost at the centre and beyond it; and found
   !> at any distance from a surface that is convex.
   subroutine test_focal(error)
      type(error_t), allocatable, intent(out) :: error
      type(hermite_stencil_t) :: stencil
      real(wp) :: x(2, 7), s(3), gap, t, radius
      integer :: i
      logical :: is_found

      t = 0.2_wp
      stencil%node = chain
      stencil%length = 2.0_wp*sin(0.5_wp*t)
      do i = 0, 24
         radius = 0.1_wp*real(i, wp) - 1.45_wp   ! < 0: beyond the centre
         x = on_circle(-t*[-2.5_wp, -1.5_wp, -0.5_wp, 0.5_wp, 1.5_wp, 2.5_wp], 0.0_wp)
         x(:, 1) = [radius, 0.0_wp]
         call hermite_begin(stencil, x, s)
         call hermite_gap_value(stencil, x, s, gap, is_found)
         ! Beyond the centre, one of the straight ends may be what is closest.
         is_found = is_found .and. abs(s(1) - 0.5_wp) <= 1.5_wp
         call check_true(error, is_found .eqv. radius > 0.1_wp, "concave, radius " &
            // to_text(radius))
         if (is_found) call check_near(error, gap, 1.0_wp - radius, t**4, 1.0_wp, "gap")
         x = on_circle(t*[-2.5_wp, -1.5_wp, -0.5_wp, 0.5_wp, 1.5_wp, 2.5_wp], 0.0_wp)
         x(:, 1) = [1.0_wp + 10.0_wp**(i - 6), 0.0_wp]
         call hermite_begin(stencil, x, s)
         call hermite_gap_value(stencil, x, s, gap, is_found)
         call check_true(error, is_found, "convex, distance " // to_text(10.0_wp**(i - 6)))
      end do
   end subroutine test_focal

   !> Gap and gradient where the projection passes either node of the edge.
   subroutine test_smooth(error)
      type(error_t), allocatable, intent(out) :: error
      type(hermite_stencil_t) :: stencil
      type(hermite_point_t) :: p
      type(nodal_t) :: gap(2)
      real(wp) :: x(2, 7), dx(2, 7), edge(2, 5), s(3), normal(2), step
      integer :: i, side
      logical :: is_found

      step = sqrt(eps)
      stencil = stencil_of(1)
      do i = 1, 40
         call draw(x, dx)
         edge = x(:, chain(2:)) - x(:, chain(:5))
         p = hermite_point(hermite_curve(stencil, joined_pieces), edge, real(mod(i, 2), wp))
         normal = [p%tangent(2), -p%tangent(1)]
         dx = 0.0_wp
         do side = 1, 2
            x(:, 1) = x(:, 2) + p%y + 0.2_wp*normal + real(2*side - 3, wp)*step*p%tangent
            call hermite_begin(stencil, x, s)
            call hermite_gap(stencil, x, dx, s, gap(side), is_found)
         end do
         call check_near(error, gap(2)%f1, gap(1)%f1, tol, 1.0_wp, "gap")
         call check_near(error, gap(2)%c, gap(1)%c, 100.0_wp*step, 1.0_wp, "gradient")
         call check_near(error, gap(2)%c(1:2), normal/norm2(normal), 100.0_wp*step, 1.0_wp, &
            "normal")
      end do
   end subroutine test_smooth

   !> The same node over the same piece, whichever of two edges is called the chosen one.
   subroutine test_neighbours(error)
      type(error_t), allocatable, intent(out) :: error
      type(hermite_stencil_t) :: other
      real(wp) :: x(2, 7), dx(2, 7), gap(2), place(2)
      integer :: i

      other = next_stencil()
      do i = 1, 100
         call draw(x, dx)
         call lone_gap(stencil_of(1), x, gap(1), place(1), error)
         if (place(1) < 0.0_wp .or. place(1) > 2.0_wp) cycle
         call lone_gap(other, x(:, next_local), gap(2), place(2), error)
         call check_near(error, gap(2), gap(1), tol, 1.0_wp, "gap")
         call check_near(error, place(2), place(1) - 1.0_wp, tol, 4.0_wp, "place")
      end do
   end subroutine test_neighbours

   !> Chains of five edges and their motion of up to a fifth of an edge, slave node across both
   !> ends of the middle edge.
   subroutine draw(x0, dx)
      real(wp), intent(out) :: x0(2, 7), dx(2, 7)
      real(wp) :: move(2, 7)

      call shake(move, 0.15_wp)
      call shake(dx, 0.2_wp)
      x0 = flat + move
      call draw_random(x0(:, 1))
      x0(:, 1) = [-1.0_wp, -0.2_wp] + [3.0_wp, 0.4_wp]*x0(:, 1)
      dx(1, 1) = 4.0_wp*dx(1, 1)
   end subroutine draw

   !> A random case: stencil fixed at the start of the step.
   subroutine draw_case(i, stencil, x0, dx, s)
      integer, intent(in) :: i
      type(hermite_stencil_t), intent(out) :: stencil
      real(wp), intent(out) :: x0(2, 7), dx(2, 7), s(3)

      call draw(x0, dx)
      stencil = stencil_of(1 + mod(i, n_kind))
      stencil%rounding = rounding(1 + mod(i/n_kind, 2))
      call hermite_begin(stencil, x0, s)
   end subroutine draw_case

   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      type(hermite_stencil_t) :: stencil
      real(wp) :: x0(2, 7), dx(2, 7), s(3), g(2, 7), gap(2), places(3, 2)
      type(nodal_t) :: a
      integer :: i, k, n_passed
      logical :: is_found, is_there(2)

      n_passed = 0
      do i = 1, 1000
         call draw_case(i, stencil, x0, dx, s)
         call hermite_gap(stencil, x0, dx, s, a, is_found)
         places(:, 1) = s
         call hermite_gap_value(stencil, x0, places(:, 1), gap(1), is_there(1))
         places(:, 2) = places(:, 1)
         call hermite_gap_value(stencil, x0 + dx, places(:, 2), gap(2), is_there(2))
         call check_true(error, is_found .and. all(is_there), "found, and the place is no variable")
         if (floor(places(1, 1)) /= floor(places(1, 2))) n_passed = n_passed + 1
         g = reshape(a%g, [2, 7])
         call check_near(error, [a%f0, a%f1], gap, tol, 2.0_wp, "values")
         call check_near(error, a%df, gap(2) - gap(1), tol, 4.0_wp, "increment")
         call check_near(error, sum(g*dx), a%df, tol, sum(abs(g*dx)), "identity")
         do k = 2, 7
            if (any(stencil%node == k)) cycle
            call check_near(error, g(:, k), [0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "absent nodes")
         end do
      end do
      call check_true(error, n_passed > 300, "changes of piece")
   end subroutine test_identity

   !> Down to the smallest motions, g.dx = df, and g is the gradient as soon as dx is below
   !> round-off.
   subroutine test_tiny(error)
      type(error_t), allocatable, intent(out) :: error
      type(hermite_stencil_t) :: stencil
      real(wp) :: x0(2, 7), dx(2, 7), s(3)
      type(nodal_t) :: a
      integer :: i, k
      logical :: is_found

      do k = 0, -minexponent(1.0_wp) - 12, 4
         i = k/4
         call draw_case(i, stencil, x0, dx, s)
         dx = scale(dx, -k)
         call hermite_gap(stencil, x0, dx, s, a, is_found)
         call check_near(error, dot_product(a%g, reshape(dx, [14])), a%df, tol, &
            maxval(abs(dx)), "g.dx at 2^-" // to_text(k))
         if (k < digits(1.0_wp)) cycle
         call check_near(error, a%g, a%c, tol, maxval(abs(a%c)), "g = c at 2^-" // to_text(k))
      end do
   end subroutine test_tiny

   subroutine test_momenta(error)
      type(error_t), allocatable, intent(out) :: error
      type(hermite_stencil_t) :: stencil
      real(wp) :: x0(2, 7), dx(2, 7), s(3), g(2, 7), mid(2, 7)
      type(nodal_t) :: a
      integer :: i
      logical :: is_found

      do i = 1, 500
         call draw_case(i, stencil, x0, dx, s)
         mid = x0 + 0.5_wp*dx
         call hermite_gap(stencil, x0, dx, s, a, is_found)
         g = reshape(a%g, [2, 7])
         call check_near(error, sum(g, dim=2), [0.0_wp, 0.0_wp], tol, sum(abs(g)), "linear")
         call check_near(error, sum(mid(1, :)*g(2, :) - mid(2, :)*g(1, :)), 0.0_wp, tol, &
            sum(abs(g))*maxval(abs(mid)), "angular")
      end do
   end subroutine test_momenta

   !> c against differences of the value, h against those of g. Steps of eps^(1/3), hence errors of
   !> eps^(2/3) times third derivatives, up to 10/rounding^2 at a rounded corner. Where the step of
   !> the difference changes the gradient itself (the sharp choice at a corner), there is no
   !> difference to compare with.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      type(hermite_stencil_t) :: stencil
      real(wp) :: x0(2, 7), dx(2, 7), s(3), way(2, 7), step, bound
      type(nodal_t) :: a, up, down
      integer :: i, j, k
      logical :: is_found

      step = eps**(1.0_wp/3.0_wp)
      bound = 10.0_wp*(step/rounding(2))**2
      do i = 1, 20*n_kind
         call draw_case(i, stencil, x0, dx, s)
         call hermite_gap(stencil, x0, dx, s, a, is_found)
         do j = 1, 14
            way = reshape([(merge(step, 0.0_wp, k == j), k=1, 14)], [2, 7])
            call hermite_gap(stencil, x0, dx + way, s, up, is_found)
            call hermite_gap(stencil, x0, dx - way, s, down, is_found)
            if (maxval(abs(up%c - down%c)) > 1.0e3_wp*step) cycle
            call check_near(error, a%c(j), (up%f1 - down%f1)/(2.0_wp*step), bound, &
               1.0_wp, "gradient")
            call check_near(error, a%h(:, j), (up%g - down%g)/(2.0_wp*step), &
               bound, maxval(abs(a%h)), "column " // to_text(j))
         end do
      end do
   end subroutine test_derivatives

   !> A step that only turns and moves everything: no change of the gap.
   subroutine test_rigid(error)
      type(error_t), allocatable, intent(out) :: error
      type(hermite_stencil_t) :: stencil
      real(wp) :: x0(2, 7), dx(2, 7), s(3)
      type(nodal_t) :: a
      integer :: i
      logical :: is_found

      do i = 1, 200
         call draw_case(i, stencil, x0, dx, s)
         dx = turned(0.03_wp*real(i, wp), x0) + 5.0_wp - x0
         call hermite_gap(stencil, x0, dx, s, a, is_found)
         call check_near(error, a%df, 0.0_wp, tol, 20.0_wp, "increment")
         call check_near(error, a%f1, a%f0, tol, 20.0_wp, "values")
      end do
   end subroutine test_rigid

   !> Over nodes between edges of different lengths, all stretched alike, and at any angle. The
   !> chain goes to the left.
   subroutine test_slip_of_line(error)
      type(error_t), allocatable, intent(out) :: error
      type(hermite_stencil_t) :: stencil
      real(wp) :: x0(2, 7), dx(2, 7), s(3)
      type(nodal_t) :: slip
      integer :: i

      stencil = stencil_of(1)
      do i = 1, 20
         x0 = 1.3_wp*flat
         x0(1, 1) = -0.2_wp + 0.08_wp*real(i, wp)
         dx = 0.0_wp
         dx(1, 1) = merge(-1.0_wp, 1.0_wp, i > 10)
         x0 = turned(0.3_wp*real(i, wp), x0)
         call hermite_begin(stencil, x0, s)
         call hermite_slip(stencil, x0, turned(0.3_wp*real(i, wp), dx), s(1), slip)
         call check_near(error, slip%df, -dx(1, 1), tol, 1.0_wp, "length")
      end do
   end subroutine test_slip_of_line

   subroutine test_slip(error)
      type(error_t), allocatable, intent(out) :: error
      type(hermite_stencil_t) :: stencil
      real(wp) :: x0(2, 7), dx(2, 7), s(3), g(2, 7), mid(2, 7), value
      type(nodal_t) :: slip
      integer :: i, n_passed
      logical :: is_found

      n_passed = 0
      do i = 1, 500
         call draw_case(i, stencil, x0, dx, s)
         call hermite_slip(stencil, x0, dx, s(1), slip)
         call hermite_slip_value(stencil, x0, dx, s(1), value, is_found)
         call check_true(error, is_found, "found")
         g = reshape(slip%g, [2, 7])
         mid = x0 + 0.5_wp*dx
         call check_near(error, [sum(g*dx), slip%df], [value, value], tol, maxval(abs(g)), &
            "T.D, and its value")
         call check_near(error, sum(g, dim=2), [0.0_wp, 0.0_wp], tol, sum(abs(g)), "linear")
         call check_near(error, sum(mid(1, :)*g(2, :) - mid(2, :)*g(1, :)), 0.0_wp, tol, &
            sum(abs(g))*maxval(abs(mid)), "angular")
         if (abs(value) > 0.5_wp) n_passed = n_passed + 1
         dx = turned(0.03_wp*real(i, wp), x0) + 5.0_wp - x0
         call hermite_slip_value(stencil, x0, dx, s(1), value, is_found)
         call check_near(error, value, 0.0_wp, tol, 20.0_wp, "all move")
      end do
      call check_true(error, n_passed > 50, "long ways")
   end subroutine test_slip

   !> As of the gap, but that the rate of slip changes where lengths of edges do, within `step`.
   subroutine test_slip_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      type(hermite_stencil_t) :: stencil
      real(wp) :: x0(2, 7), dx(2, 7), s(3), way(2, 7), step
      type(nodal_t) :: slip, up, down
      integer :: i, j, k

      step = eps**(1.0_wp/3.0_wp)
      do i = 1, 20*n_kind
         call draw_case(i, stencil, x0, dx, s)
         call hermite_slip(stencil, x0, dx, s(1), slip)
         do j = 1, 14
            way = reshape([(merge(step, 0.0_wp, k == j), k=1, 14)], [2, 7])
            call hermite_slip(stencil, x0, dx + way, s(1), up)
            call hermite_slip(stencil, x0, dx - way, s(1), down)
            if (maxval(abs(up%c - down%c)) > 1.0e3_wp*step) cycle
            call check_near(error, slip%c(j), (up%df - down%df)/(2.0_wp*step), 10.0_wp*step, &
               maxval(abs(slip%c)), "gradient")
            call check_near(error, slip%h(:, j), (up%g - down%g)/(2.0_wp*step), &
               10.0_wp*step, maxval(abs(slip%h)), "column " // to_text(j))
         end do
      end do
   end subroutine test_slip_derivatives

end module test_hermite_gap
