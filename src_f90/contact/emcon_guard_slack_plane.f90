!> How far a guard lets the nodes of a surface into another one.
!>
!> A corner is held nearly at once: means of gaps, and nodes beside it, do not see it. Nodes of
!> smooth sides are left to these. Where polygons of one curve lie in each other their edges dip
!> into the arcs by what the curve is away from its chords: that is no overlap.
!> Source: docs/theory.md, section 4.11.
module emcon_guard_slack_plane
   use emcon_chain, only : chain_t
   use emcon_guards, only : corner_slack
   use emcon_kinds, only : wp
   implicit none
   private
   public :: guard_slack_t, guard_slack_init, guard_slack_depth

   !> A convex corner turns by more [rad], as those of `contact_options_t` do.
   real(wp), parameter :: corner_turn = acos(0.5_wp)
   !> A curve that turns by an angle over its chord is away from it by this part of angle and chord.
   real(wp), parameter :: sagitta = 0.125_wp

   type :: guard_slack_t
      real(wp), allocatable :: slack(:)          !! (n_node of the slave) by the shorter edge
      real(wp), allocatable :: own(:)            !! (n_node) sagitta of the slave there, by its edge
      real(wp), allocatable :: hollow(:)         !! (n_edge of the master) sagitta of what is hollow
   end type guard_slack_t

contains

   !> Set up for the nodes of `slave` over the edges of `master`.
   pure subroutine guard_slack_init(self, slave, master, x, slack)
      type(guard_slack_t), intent(out) :: self
      type(chain_t), intent(in) :: slave, master
      real(wp), intent(in) :: x(:, :)            !! (2, n_node of the scene) reference positions [L]
      real(wp), intent(in) :: slack              !! of nodes that are no corners, by the edge
      real(wp) :: turn
      integer :: k, e

      allocate(self%slack(size(slave%node)), source=slack)
      allocate(self%own(size(slave%node)), self%hollow(master%n_edge), source=0.0_wp)
      do k = 1, size(slave%node)
         turn = turn_at(slave, x, k)
         if (turn > corner_turn) then
            self%slack(k) = corner_slack
         else
            self%own(k) = sagitta*max(0.0_wp, turn)
         end if
      end do
      do e = 1, master%n_edge
         do k = 1, 2
            turn = -turn_at(master, x, master%end_node(k, e))
            if (turn < corner_turn) self%hollow(e) = max(self%hollow(e), sagitta*turn)
         end do
      end do
   end subroutine guard_slack_init

   !> The depth from which on the guard of node `k` over edge `e` acts.
   pure real(wp) function guard_slack_depth(self, k, e, own_length, length) result(depth)
      type(guard_slack_t), intent(in) :: self
      integer, intent(in) :: k                   !! index into the nodes of the slave
      integer, intent(in) :: e                   !! edge of the master
      real(wp), intent(in) :: own_length         !! of the shortest edge at the node [L]
      real(wp), intent(in) :: length             !! of the edge [L]

      depth = self%slack(k)*min(own_length, length)
      if (self%hollow(e) > 0.0_wp) depth = depth + self%own(k)*own_length + self%hollow(e)*length
   end function guard_slack_depth

   !> The turn of a chain at its node `k` in the reference configuration [rad], > 0 where the body
   !> is convex; a half turn at an end.
   pure real(wp) function turn_at(chain, x, k)
      type(chain_t), intent(in) :: chain
      real(wp), intent(in) :: x(:, :)            !! (2, n_node of the scene) [L]
      integer, intent(in) :: k                   !! index into the nodes of `chain`
      real(wp) :: a(2), b(2)

      turn_at = acos(-1.0_wp)
      if (any(chain%node_edge(:, k) == 0)) return
      associate (before => chain%edge(:, chain%node_edge(1, k)), &
            here => chain%edge(:, chain%node_edge(2, k)))
         a = x(:, before(2)) - x(:, before(1))
         b = x(:, here(2)) - x(:, here(1))
      end associate
      turn_at = atan2(a(1)*b(2) - a(2)*b(1), dot_product(a, b))
   end function turn_at

end module emcon_guard_slack_plane
