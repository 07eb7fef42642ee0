!> Gap of a slave node over a master edge and its neighbours, for one configuration.
!>
!> Edge a = x2 - x1, b = xs - x1, outward normal n: gap over the line of the edge
!> (b x a)/|a|. Where the node passes a corner to a neighbour the gap goes over to the neighbour's
!> line, so that the gap is one continuous function over three edges: no event when a node slides
!> over a master node, hence neither energy nor penetration is made there. In statics a node can
!> come to rest in a dent, at a master node, where the gradient jumps: there corners are rounded,
!> all to the outside, so that a closed gap is no penetration.
!> Source: docs/theory.md, eqs. (12) to (14). Sign: gap > 0 is open.
module emcon_nts_gap_value
   use emcon_kinds, only : wp
   use emcon_rounded, only : above_negative, rounded_negative, rounded_part
   implicit none
   private
   public :: nts_gap_value, has_arc
   public :: slave, first, last, flat

   !> Local numbers of the nodes; the neighbours' further nodes follow as they are present.
   integer, parameter :: slave = 1, first = 2, last = 3
   !> Where |tan(theta/2)| is smaller, a concave corner is rounded as a convex one in part: a flat
   !> one leaves the gap exact, whichever way round-off or a load turns it. Of the gap that is less
   !> than what counts as a penetration.
   real(wp), parameter :: flat = 1.0e-3_wp
   !> Corners that turn by more than this (cosine) are not gone around: a right angle, with room for
   !> round-off.
   real(wp), parameter :: right_angle = -1.0e-6_wp

contains

   !> The gap for one configuration, and the projection `xi` on the edge (0..1 inside).
   pure subroutine nts_gap_value(x, before, after, rounding, gap, xi, goes_around)
      real(wp), intent(in) :: x(:, :)            !! (2, 3 to 5)
      integer, intent(in) :: before, after       !! as in `nts_gap`
      real(wp), intent(in) :: rounding(2, 2)     !! as in `nts_gap`
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

   !> Is the node in front of one of the two edges, and their corner convex and blunt enough?
   pure logical function has_arc(b, p, q)
      real(wp), intent(in) :: b(:), p(:), q(:)   !! from the corner to the node; the edges

      has_arc = max(cross(b, p), cross(b, q)) > 0.0_wp .and. cross(p, q) > 0.0_wp .and. &
         dot_product(p, q)**2*sign(1.0_wp, dot_product(p, q)) &
         >= -right_angle**2*dot_product(p, p)*dot_product(q, q)
   end function has_arc

   !> Add to `gap` what the distance from the convex corner of edges `p` and `q` is above that from
   !> the line of the middle one, if the node is beyond its end: docs/theory.md, eq. (14d).
   pure subroutine around_value(b, p, q, line, is_beyond, gap, is_done)
      real(wp), intent(in) :: b(:), p(:), q(:), line
      logical, intent(in) :: is_beyond
      real(wp), intent(inout) :: gap
      logical, intent(out) :: is_done            !! .false.: left to the lines

      is_done = has_arc(b, p, q)
      if (.not. (is_done .and. is_beyond)) return
      gap = gap + sqrt(dot_product(b, b) - min(0.0_wp, dot_product(b, p))**2/dot_product(p, p) &
         - max(0.0_wp, dot_product(b, q))**2/dot_product(q, q)) - line
   end subroutine around_value

   !> kappa min(tau, 0), rounded as in `bent_part` of emcon_nts_gap.inc.
   pure real(wp) function bent_value(tau, rounding, kappa)
      real(wp), intent(in) :: tau, rounding(:), kappa
      real(wp) :: hollow

      hollow = rounded_part(kappa, flat)
      bent_value = (kappa - hollow)*over_top_value(tau, rounding) &
         + hollow*rounded_negative(tau, rounding(1))
   end function bent_value

   !> min(tau, 0), rounded as in `over_top` of emcon_nts_gap.inc.
   pure real(wp) function over_top_value(tau, rounding) result(part)
      real(wp), intent(in) :: tau, rounding(:)

      part = above_negative(tau, rounding(2))
      if (rounding(2) > rounding(1)) part = 2.0_wp*part - above_negative(tau, 0.5_wp*rounding(2))
   end function over_top_value

   pure real(wp) function cross(a, b)
      real(wp), intent(in) :: a(2), b(2)

      cross = a(1)*b(2) - a(2)*b(1)
   end function cross

end module emcon_nts_gap_value
