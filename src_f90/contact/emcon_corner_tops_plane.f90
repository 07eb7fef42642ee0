!> Round tops of the corners of a polygon that face a corner of the slave surface.
!>
!> Two vertices of round bodies that meet have many normals in common, and round-off must not
!> choose one: where they face each other the top of the corner is wide, by less than an edge dips
!> into its arc. Corners that are no vertices of a curve stay as they are, since bodies pass close
!> by them. Source: docs/theory.md, section 4.2, eq. (14s).
module emcon_corner_tops_plane
   use emcon_chain_plane, only : chain_shorter, chain_t
   use emcon_kinds, only : wp
   use emcon_polygon_stencil_plane, only : polygon_stencil_t
   implicit none
   private
   public :: corner_tops, top_width

   !> Half width of a top that all normals of the corner face, per edge.
   real(wp), parameter :: widest = 0.25_wp
   !> What turns by less in the reference configuration is flat [radians]: coordinates in a deck are
   !> rounded.
   real(wp), parameter :: flat = 1.0e-5_wp
   !> What turns by more is a corner, and no vertex of a curve [radians].
   real(wp), parameter :: corner_turn = acos(0.5_wp)

contains

   !> Widen the tops of the corners of `stencil` that face node `k` of the slave surface.
   pure subroutine corner_tops(slave, k, master, edge, x, u, stencil)
      type(chain_t), intent(in) :: slave, master
      integer, intent(in) :: k                   !! index into the nodes of `slave`
      integer, intent(in) :: edge                !! of `master`, that of the stencil
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (2, n_node of the scene) [L]
      type(polygon_stencil_t), intent(inout) :: stencil
      real(wp) :: width(2)

      width = 0.0_wp
      associate (node => stencil%node, before => stencil%before, after => stencil%after)
         if (before > 0) width(1) = top_width(slave, k, [node(before), node(2), node(3)], x, u)
         if (after > 0) width(2) = top_width(slave, k, [node(2), node(3), node(after)], x, u)
      end associate
      stencil%rounding(2, :) = max(stencil%rounding(2, :), width*chain_shorter(master, edge))
   end subroutine corner_tops

   !> Half width of the top of a convex master corner for node `k` of the chain, per edge: widest
   !> where all normals of the corner are opposite to one at the node, as at vertices that face each
   !> other; less by the part that is not; 0 where the node has other normals, or one only.
   pure real(wp) function top_width(chain, k, corner, x, u) result(width)
      type(chain_t), intent(in) :: chain         !! the slave's
      integer, intent(in) :: k                   !! index into the nodes of `chain`
      integer, intent(in) :: corner(3)           !! master nodes before, at and after the corner
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (2, n_node of the scene) [L]
      real(wp) :: master(2, 2), slave(2, 2), turn(2), lead
      integer :: side

      width = 0.0_wp
      if (any(chain%node_edge(:, k) == 0)) return
      do side = 1, 2
         master(:, side) = along(x, corner(side:side + 1))
         slave(:, side) = along(x, chain%facet(:, chain%node_edge(side, k)))
      end do
      turn = [angle(master(:, 1), master(:, 2)), angle(slave(:, 1), slave(:, 2))]
      if (minval(turn) <= flat .or. maxval(turn) > corner_turn) return
      do side = 1, 2
         master(:, side) = master(:, side) + along(u, corner(side:side + 1))
         slave(:, side) = -(slave(:, side) + along(u, chain%facet(:, chain%node_edge(side, k))))
      end do
      turn = [angle(master(:, 1), master(:, 2)), angle(slave(:, 1), slave(:, 2))]
      if (.not. minval(turn) > 0.0_wp) return
      lead = angle(master(:, 1), slave(:, 1))
      width = widest*max(0.0_wp, min(turn(1), lead + turn(2)) - max(0.0_wp, lead))/turn(1)
   end function top_width

   !> From the first to the second of `node`.
   pure function along(x, node)
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: node(2)
      real(wp) :: along(2)

      along = x(:, node(2)) - x(:, node(1))
   end function along

   !> The turn from `a` to `b`, -pi to pi.
   pure real(wp) function angle(a, b)
      real(wp), intent(in) :: a(2), b(2)

      angle = atan2(a(1)*b(2) - a(2)*b(1), dot_product(a, b))
   end function angle

end module emcon_corner_tops_plane
