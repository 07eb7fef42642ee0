!> A moment on a rigid body of the plane, as a couple of forces on two nodes of its frame.
!>
!> F = M J d/|d|^2 on the second node and -F on the first, d from the first to the second. Source:
!> docs/theory.md, section 12.
module emcon_moment_load_plane
   use emcon_kinds, only : dp, wp
   use emcon_turn_plane, only : turned_left
   implicit none
   private
   public :: add_moment, add_moment_stiffness

contains

   !> The two forces.
   pure subroutine add_moment(node, moment, x, u, force)
      integer, intent(in) :: node(:)                       !! (2)
      real(wp), intent(in) :: moment                       !! > 0 turns left [M L^2/T^2]
      real(wp), intent(in) :: x(:, :), u(:, :)             !! (2, n_node) [L]
      real(wp), intent(inout) :: force(:, :)               !! (2, n_node) [M L/T^2]
      real(wp) :: arm(2), part(2)

      arm = x(:, node(2)) - x(:, node(1)) + (u(:, node(2)) - u(:, node(1)))
      part = moment*turned_left(arm)/sum(arm**2)
      force(:, node(1)) = force(:, node(1)) - part
      force(:, node(2)) = force(:, node(2)) + part
   end subroutine add_moment

   !> How they change with d: M (J - 2 J d d^T/|d|^2)/|d|^2.
   pure subroutine add_moment_stiffness(place, moment, slot, value, side)
      real(wp), intent(in) :: place(:, :)                  !! (2, 2) of the nodes [L]
      real(wp), intent(in) :: moment                       !! times the derivative of `place`
      integer, intent(in) :: slot(:, :)                    !! (4, 4) places of its entries
      real(dp), intent(inout) :: value(:), side(:)         !! slots > 0, slots < 0
      real(wp) :: arm(2), unit(2), column(2), df
      integer :: i, j, a, b, k

      arm = place(:, 2) - place(:, 1)
      do b = 1, 2
         unit = merge(1.0_wp, 0.0_wp, [1, 2] == b)
         column = moment*(turned_left(unit) &
            - (2.0_wp*arm(b)/sum(arm**2))*turned_left(arm))/sum(arm**2)
         do j = 1, 2
            do i = 1, 2
               do a = 1, 2
                  k = slot(a + 2*(i - 1), b + 2*(j - 1))
                  df = column(a)*merge(1.0_wp, -1.0_wp, i == j)
                  if (k > 0) value(k) = value(k) - real(df, dp)
                  if (k < 0) side(-k) = side(-k) - real(df, dp)
               end do
            end do
         end do
      end do
   end subroutine add_moment_stiffness

end module emcon_moment_load_plane
