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
   public :: nts_gap_value
   public :: edge_round_t, slave, first, last, flat, right_angle

   !> Local numbers of the nodes; the neighbours' further nodes follow as they are present.
   integer, parameter :: slave = 1, first = 2, last = 3
   !> Where |tan(theta/2)| is smaller, a concave corner is rounded as a convex one in part: a flat
   !> one leaves the gap exact, whichever way round-off or a load turns it. Of the gap that is less
   !> than what counts as a penetration.
   real(wp), parameter :: flat = 1.0e-3_wp
   !> Corners that turn by more than this (cosine) are not gone around: a right angle, with room for
   !> round-off.
   real(wp), parameter :: right_angle = -1.0e-6_wp

   !> What of an edge and its ends is round.
   type :: edge_round_t
      logical :: goes_around = .false.           !! convex corners are as far as they are
      !> Length of the edge times the curvature of the arc in which it goes on before its first
      !> node, of its own, and of that behind its last node; 0: none
      real(wp) :: bend(-1:1) = 0.0_wp
   end type edge_round_t

   include "../dgrad/emcon_dgrad0_plane.inc"

   !> The gap for one configuration, and the projection `xi` on the edge (0..1 inside).
   pure subroutine nts_gap_value(x, before, after, rounding, gap, xi, round)
      real(wp), intent(in) :: x(:, :)            !! (2, 3 to 5)
      integer, intent(in) :: before, after       !! as in `nts_gap`
      real(wp), intent(in) :: rounding(2, 2)     !! as in `nts_gap`
      real(wp), intent(out) :: gap               !! [L]
      real(wp), intent(out) :: xi                !! on the line of the edge, 0 to 1 within it
      type(edge_round_t), intent(in), optional :: round   !! none: nothing is
      type(difference_t) :: edge(-1:1), node(0:1)
      type(dg_t) :: value
      type(edge_round_t) :: curves

      if (present(round)) curves = round
      if (before > 0) edge(-1) = difference(first, before, x)
      edge(0) = difference(last, first, x)
      if (after > 0) edge(1) = difference(after, last, x)
      node = [difference(slave, first, x), difference(slave, last, x)]
      value = bent_gap(edge, node, [before, after] > 0, rounding, curves)
      gap = value%f
      value = dg_dot(node(0), edge(0))/dg_dot(edge(0), edge(0))
      xi = value%f
   end subroutine nts_gap_value

   include "emcon_nts_gap.inc"

end module emcon_nts_gap_value
