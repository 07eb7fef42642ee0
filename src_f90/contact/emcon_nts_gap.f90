!> Gap of a slave node over a master edge and its neighbours.
!>
!> Edge a = x2 - x1, b = xs - x1, outward normal n: gap over the line of the edge
!> (b x a)/|a|. Where the node passes a corner to a neighbour the gap goes over to the neighbour's
!> line, so that the gap is one continuous function over three edges: no event when a node slides
!> over a master node, hence neither energy nor penetration is made there. In statics a node can
!> come to rest in a dent, at a master node, where the gradient jumps: there corners are rounded,
!> all to the outside, so that a closed gap is no penetration.
!> Source: docs/theory.md, eqs. (12) to (14). Sign: gap > 0 is open.
module emcon_nts_gap
   use emcon_dgrad10, only : dg_above_negative, dg_cross, dg_dot, dg_negative_part, dg_sqrt, &
      dg_t, difference, difference_t, operator(*), operator(+), operator(-), operator(/)
   use emcon_kinds, only : wp
   use emcon_rounded, only : above_negative, rounded_negative
   implicit none
   private
   public :: nts_gap, nts_gap_value

   !> Local numbers of the nodes; the neighbours' further nodes follow as they are present.
   integer, parameter :: slave = 1, first = 2, last = 3
   !> Where |tan(theta/2)| is smaller, a corner is in between convex and concave. Times the width of
   !> a rounded corner that is round-off of the gap.
   real(wp), parameter :: flat = 1.0e-9_wp
   !> Corners that turn by more than this (cosine) are not gone around: a right angle, with room for
   !> round-off.
   real(wp), parameter :: right_angle = -1.0e-6_wp

contains

   !> The gap over a step, in discrete-gradient arithmetic: docs/theory.md, eq. (13).
   pure function nts_gap(x0, dx, before, after, rounding, goes_around) result(gap)
      real(wp), intent(in) :: x0(:, :)           !! (2, 3 to 5) slave, edge, further nodes; local
      real(wp), intent(in) :: dx(:, :)           !! their motion
      integer, intent(in) :: before              !! local number of the node before the edge, or 0
      integer, intent(in) :: after               !! of the node after it, or 0
      real(wp), intent(in) :: rounding(2, 2)     !! (concave and convex; corner before and after)
                                                 !! half widths of the rounded corners [L]
      logical, intent(in), optional :: goes_around   !! convex corners are as far as they are
      type(dg_t) :: gap
      type(difference_t) :: a, b, c
      type(dg_t) :: length, line
      logical :: is_round, is_done

      is_round = .false.
      if (present(goes_around)) is_round = goes_around
      a = difference(last, first, x0, dx)
      b = difference(slave, first, x0, dx)
      length = dg_sqrt(dg_dot(a, a))
      line = dg_cross(b, a)/length
      gap = line
      if (before > 0) then
         c = difference(first, before, x0, dx)
         is_done = .false.
         if (is_round) call around(b, c, a, line, [dot_product(b%v0, a%v0), &
            dot_product(b%v1, a%v1)] < 0.0_wp, gap, is_done)
         if (.not. is_done) gap = gap + corner_before(a, b, length, c, rounding(:, 1))
      end if
      if (after > 0) then
         b = difference(slave, last, x0, dx)
         c = difference(after, last, x0, dx)
         is_done = .false.
         if (is_round) call around(b, a, c, line, [dot_product(b%v0, a%v0), &
            dot_product(b%v1, a%v1)] > 0.0_wp, gap, is_done)
         if (.not. is_done) gap = gap + corner_after(a, length, b, c, rounding(:, 2))
      end if
   end function nts_gap

   !> Add to `gap` what the distance from the convex corner of edges `p` and `q` is above that from
   !> the line of the middle one, if the node is beyond its end: docs/theory.md, eq. (14d).
   pure subroutine around(b, p, q, line, is_beyond, gap, is_done)
      type(difference_t), intent(in) :: b        !! from the corner to the node
      type(difference_t), intent(in) :: p, q
      type(dg_t), intent(in) :: line
      logical, intent(in) :: is_beyond(:)        !! at the start, at the end of the step
      type(dg_t), intent(inout) :: gap
      logical, intent(out) :: is_done            !! .false.: left to the lines
      type(dg_t) :: length, along, past

      is_done = has_arc(b%v0, p%v0, q%v0) .and. has_arc(b%v1, p%v1, q%v1)
      if (.not. (is_done .and. any(is_beyond))) return
      length = dg_sqrt(dg_dot(p, p))
      along = dg_negative_part(dg_dot(b, p)/length, 0.0_wp)
      length = dg_sqrt(dg_dot(q, q))
      past = dg_negative_part((-1.0_wp)*(dg_dot(b, q)/length), 0.0_wp)
      gap = gap + dg_sqrt(dg_dot(b, b) - along*along - past*past) - line
   end subroutine around

   !> Is the node in front of one of the two edges, and their corner convex and blunt enough?
   pure logical function has_arc(b, p, q)
      real(wp), intent(in) :: b(:), p(:), q(:)   !! from the corner to the node; the edges

      has_arc = max(cross(b, p), cross(b, q)) > 0.0_wp .and. cross(p, q) > 0.0_wp .and. &
         dot_product(p, q)**2*sign(1.0_wp, dot_product(p, q)) &
         >= -right_angle**2*dot_product(p, p)*dot_product(q, q)
   end function has_arc

   !> As in `around`, for one configuration.
   pure subroutine around_value(b, p, q, line, is_beyond, gap, is_done)
      real(wp), intent(in) :: b(:), p(:), q(:), line
      logical, intent(in) :: is_beyond
      real(wp), intent(inout) :: gap
      logical, intent(out) :: is_done

      is_done = has_arc(b, p, q)
      if (.not. (is_done .and. is_beyond)) return
      gap = gap + sqrt(dot_product(b, b) - min(0.0_wp, dot_product(b, p))**2/dot_product(p, p) &
         - max(0.0_wp, dot_product(b, q))**2/dot_product(q, q)) - line
   end subroutine around_value

   !> kappa min(tau, 0): what the line of the edge before adds on its side of the bisector.
   pure function corner_before(a, b, length, edge, rounding) result(part)
      type(difference_t), intent(in) :: a, b, edge
      type(dg_t), intent(in) :: length
      real(wp), intent(in) :: rounding(2)
      type(dg_t) :: part, other

      other = dg_sqrt(dg_dot(edge, edge))
      part = dg_dot(b, edge)/other + dg_dot(b, a)/length
      part = bent_part(part, rounding, edge, a, other*length)
   end function corner_before

   !> -kappa max(tau, 0), with `b` from the last node of the edge to the slave node.
   pure function corner_after(a, length, b, edge, rounding) result(part)
      type(difference_t), intent(in) :: a, b, edge
      type(dg_t), intent(in) :: length
      real(wp), intent(in) :: rounding(2)
      type(dg_t) :: part, other

      other = dg_sqrt(dg_dot(edge, edge))
      part = (-1.0_wp)*(dg_dot(b, a)/length + dg_dot(b, edge)/other)
      part = bent_part(part, rounding, a, edge, length*other)
   end function corner_after

   !> kappa min(tau, 0), 0 in front of the rounded corner. kappa = -tan(theta/2), theta the turn
   !> from edge `a` to edge `b` (> 0: convex corner). Rounded so that it is nowhere above the sharp
   !> one, on either side of kappa = 0 with one tangent: docs/theory.md, eqs. (14) and (14c).
   pure function bent_part(tau, rounding, a, b, length_product) result(part)
      type(dg_t), intent(in) :: tau
      real(wp), intent(in) :: rounding(2)        !! half widths, concave and convex [L]
      type(difference_t), intent(in) :: a, b
      type(dg_t), intent(in) :: length_product   !! |a| |b|
      type(dg_t) :: part, kappa, convex

      if (min(tau%f0, tau%f1) >= maxval(rounding)) return
      kappa = (-1.0_wp)*(dg_cross(a, b)/(length_product + dg_dot(a, b)))
      if (min(kappa%f0, kappa%f1) >= flat) then
         part = kappa*dg_negative_part(tau, rounding(1))
      else if (max(kappa%f0, kappa%f1) <= -flat) then
         part = kappa*dg_above_negative(tau, rounding(2))
      else
         convex = dg_negative_part(kappa, flat)
         part = convex*dg_above_negative(tau, rounding(2)) &
            + (kappa - convex)*dg_negative_part(tau, rounding(1))
      end if
   end function bent_part

   !> The same gap for one configuration, and the projection `xi` on the edge (0..1 inside).
   pure subroutine nts_gap_value(x, before, after, rounding, gap, xi, goes_around)
      real(wp), intent(in) :: x(:, :)            !! (2, 3 to 5)
      integer, intent(in) :: before, after       !! as in `nts_gap`
      real(wp), intent(in) :: rounding(2, 2)  !! as in `nts_gap`
      real(wp), intent(out) :: gap               !! [L]
      real(wp), intent(out) :: xi                !! on the line of the edge, 0 to 1 within it
      logical, intent(in), optional :: goes_around   !! as in `nts_gap`
      real(wp) :: a(2), b(2), edge(2), length, other, tau, line
      logical :: is_round, is_done

      is_round = .false.
      if (present(goes_around)) is_round = goes_around
      a = x(:, last) - x(:, first)
      b = x(:, slave) - x(:, first)
      length = sqrt(dot_product(a, a))
      line = cross(b, a)/length
      gap = line
      xi = dot_product(b, a)/dot_product(a, a)
      if (before > 0) then
         edge = x(:, first) - x(:, before)
         other = sqrt(dot_product(edge, edge))
         tau = dot_product(b, edge)/other + dot_product(b, a)/length
         is_done = .false.
         if (is_round) call around_value(b, edge, a, line, dot_product(b, a) < 0.0_wp, gap, is_done)
         if (.not. is_done) gap = gap + bent_value(tau, rounding(:, 1), -cross(edge, a) &
            /(length*other + dot_product(edge, a)))
      end if
      if (after > 0) then
         edge = x(:, after) - x(:, last)
         b = x(:, slave) - x(:, last)
         other = sqrt(dot_product(edge, edge))
         tau = dot_product(b, a)/length + dot_product(b, edge)/other
         is_done = .false.
         if (is_round) call around_value(b, a, edge, line, dot_product(b, a) > 0.0_wp, gap, is_done)
         if (.not. is_done) gap = gap + bent_value(-tau, rounding(:, 2), -cross(a, edge) &
            /(length*other + dot_product(a, edge)))
      end if
   end subroutine nts_gap_value

   !> kappa min(tau, 0), rounded as in `bent_part`.
   pure real(wp) function bent_value(tau, rounding, kappa)
      real(wp), intent(in) :: tau, rounding(2), kappa
      real(wp) :: convex

      convex = rounded_negative(kappa, flat)
      bent_value = convex*above_negative(tau, rounding(2)) &
         + (kappa - convex)*rounded_negative(tau, rounding(1))
   end function bent_value

   pure real(wp) function cross(a, b)
      real(wp), intent(in) :: a(2), b(2)

      cross = a(1)*b(2) - a(2)*b(1)
   end function cross

end module emcon_nts_gap
