!> Pressure on the edges of a plane body, and how its force turns with the edge.
!>
!> It acts on an edge from node a to node b, the body to its left, straight or through a node m
!> between them. Source: docs/theory.md, section 3.
module emcon_pressure_plane
   use emcon_kinds, only : dp, wp
   use emcon_turn_plane, only : turned_left
   implicit none
   private
   public :: add_pressure, add_pressure_stiffness

   !> int N_i dN_j of the edge a, b and of a, b, m: the force of node i is p J sum of these x_j.
   real(wp), parameter :: straight(2, 2) = 0.5_wp*reshape([-1.0_wp, -1.0_wp, 1.0_wp, 1.0_wp], &
      [2, 2])
   real(wp), parameter :: bent(3, 3) = reshape([-3.0_wp, 1.0_wp, -4.0_wp, -1.0_wp, 3.0_wp, &
      4.0_wp, 4.0_wp, -4.0_wp, 0.0_wp], [3, 3])/6.0_wp

contains

   !> Half of -p n |b - a| on either node of a straight edge, n outwards.
   pure subroutine add_pressure(edge, p, x, u, follows, force)
      integer, intent(in) :: edge(:)                       !! (2 or 3) a, b, m
      real(wp), intent(in) :: p                            !! [M/T^2]: pressure times thickness
      real(wp), intent(in) :: x(:, :), u(:, :)             !! (2, n_node) [L]
      logical, intent(in) :: follows                       !! it follows the displacements
      real(wp), intent(inout) :: force(:, :)               !! (2, n_node) [M L/T^2]
      real(wp) :: d(2, 2:size(edge)), half(2)
      integer :: i, j

      do j = 2, size(edge)
         d(:, j) = x(:, edge(j)) - x(:, edge(1))
         if (follows) d(:, j) = d(:, j) + (u(:, edge(j)) - u(:, edge(1)))
      end do
      if (size(edge) == size(straight, 1)) then
         half = 0.5_wp*p*turned_left(d(:, 2))
         force(:, edge(1)) = force(:, edge(1)) + half
         force(:, edge(2)) = force(:, edge(2)) + half
         return
      end if
      do i = 1, size(edge)
         force(:, edge(i)) = force(:, edge(i)) + p*turned_left(matmul(d, bent(i, 2:)))
      end do
   end subroutine add_pressure

   !> The force is linear in the places of the nodes.
   pure subroutine add_pressure_stiffness(p, slot, value, side)
      real(wp), intent(in) :: p                            !! [M/T^2]: pressure times thickness
      integer, intent(in) :: slot(:, :)                    !! (4, 4) or (6, 6) places of its entries
      real(dp), intent(inout) :: value(:), side(:)         !! slots > 0, slots < 0
      real(wp), parameter :: turn(2, 2) = reshape([0.0_wp, 1.0_wp, -1.0_wp, 0.0_wp], [2, 2])
      integer :: i, j, a, b, k, n
      real(wp) :: df

      n = size(slot, 1)/2
      do j = 1, n
         do b = 1, 2
            do i = 1, n
               do a = 1, 2
                  k = slot(a + 2*(i - 1), b + 2*(j - 1))
                  df = p*turn(a, b)*merge(straight(min(i, 2), min(j, 2)), bent(i, j), n == 2)
                  if (k > 0) value(k) = value(k) - real(df, dp)
                  if (k < 0) side(-k) = side(-k) - real(df, dp)
               end do
            end do
         end do
      end do
   end subroutine add_pressure_stiffness

end module emcon_pressure_plane
