!> Pressure on the edges of a plane body, and how its force turns with the edge.
!>
!> It acts on an edge from node a to node b, the body to its left. Source: docs/theory.md,
!> section 3.
module emcon_pressure_plane
   use emcon_kinds, only : dp, wp
   implicit none
   private
   public :: add_pressure, add_pressure_stiffness

contains

   !> Half of -p n |b - a| on either node, n outwards.
   pure subroutine add_pressure(edge, p, x, u, nlgeom, force)
      integer, intent(in) :: edge(:)                       !! (2) a, b
      real(wp), intent(in) :: p                            !! [M/T^2]: pressure times thickness
      real(wp), intent(in) :: x(:, :), u(:, :)             !! (2, n_node) [L]
      logical, intent(in) :: nlgeom                        !! it follows the displacements
      real(wp), intent(inout) :: force(:, :)               !! (2, n_node) [M L/T^2]
      real(wp) :: a(2), half(2)

      a = x(:, edge(2)) - x(:, edge(1))
      if (nlgeom) a = a + (u(:, edge(2)) - u(:, edge(1)))
      half = 0.5_wp*p*[-a(2), a(1)]
      force(:, edge(1)) = force(:, edge(1)) + half
      force(:, edge(2)) = force(:, edge(2)) + half
   end subroutine add_pressure

   !> The force is linear in the edge: f1 = p (a2 - b2)/2, f2 = p (b1 - a1)/2 on both nodes.
   pure subroutine add_pressure_stiffness(p, slot, value, side)
      real(wp), intent(in) :: p                            !! [M/T^2]: pressure times thickness
      integer, intent(in) :: slot(:, :)                    !! (4, 4) places of its entries
      real(dp), intent(inout) :: value(:), side(:)         !! slots > 0, slots < 0
      real(wp), parameter :: turn(2, 2) = reshape([0.0_wp, 1.0_wp, -1.0_wp, 0.0_wp], [2, 2])
      integer :: i, j, a, b, k
      real(wp) :: df

      do j = 1, 2
         do b = 1, 2
            do i = 1, 2
               do a = 1, 2
                  k = slot(a + 2*(i - 1), b + 2*(j - 1))
                  df = 0.5_wp*p*turn(a, b)*merge(1.0_wp, -1.0_wp, j == 2)
                  if (k > 0) value(k) = value(k) - real(df, dp)
                  if (k < 0) side(-k) = side(-k) - real(df, dp)
               end do
            end do
         end do
      end do
   end subroutine add_pressure_stiffness

end module emcon_pressure_plane
