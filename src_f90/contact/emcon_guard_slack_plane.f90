!> How far a guard lets the nodes of a surface into another one.
!>
!> A corner is held nearly at once: means of gaps, and nodes beside it, do not see it. Nodes of
!> smooth sides are left to these. Where contact gives way corners go in as all other nodes do.
!> Source: docs/theory.md, section 4.11.
module emcon_guard_slack_plane
   use emcon_chain_plane, only : chain_t
   use emcon_guards, only : corner_slack
   use emcon_kinds, only : wp
   implicit none
   private
   public :: guard_slack_find

   !> A convex corner turns by more [rad], as those of `contact_options_t` do.
   real(wp), parameter :: corner_turn = acos(0.5_wp)

contains

   !> So far each node of `chain` may go in, by the shorter one of its edge and the one it meets.
   pure subroutine guard_slack_find(chain, x, smooth, slack)
      type(chain_t), intent(in) :: chain
      real(wp), intent(in) :: x(:, :)            !! (2, n_node of the scene) reference positions [L]
      real(wp), intent(in) :: smooth             !! of nodes that are no corners, by the edge
      real(wp), allocatable, intent(out) :: slack(:)   !! (n_node of the chain)
      integer :: k

      allocate(slack(size(chain%node)), source=smooth)
      do k = 1, size(slack)
         if (turn_at(chain, x, k) > corner_turn) slack(k) = corner_slack
      end do
   end subroutine guard_slack_find

   !> The turn of a chain at its node `k` in the reference configuration [rad], > 0 where the body
   !> is convex; a half turn at an end.
   pure real(wp) function turn_at(chain, x, k)
      type(chain_t), intent(in) :: chain
      real(wp), intent(in) :: x(:, :)            !! (2, n_node of the scene) [L]
      integer, intent(in) :: k                   !! index into the nodes of `chain`
      real(wp) :: a(2), b(2)

      turn_at = acos(-1.0_wp)
      if (any(chain%node_edge(:, k) == 0)) return
      associate (before => chain%facet(:, chain%node_edge(1, k)), &
            here => chain%facet(:, chain%node_edge(2, k)))
         a = x(:, before(2)) - x(:, before(1))
         b = x(:, here(2)) - x(:, here(1))
      end associate
      turn_at = atan2(a(1)*b(2) - a(2)*b(1), dot_product(a, b))
   end function turn_at

end module emcon_guard_slack_plane
