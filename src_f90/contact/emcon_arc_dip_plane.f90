!> How far the edges of a surface are from the arcs that they stand for.
module emcon_arc_dip_plane
   use emcon_kinds, only : wp
   implicit none
   private
   public :: arc_dip

contains

   !> The largest height of the arc over an edge of a surface, l phi/8 for an edge of length l where
   !> the surface turns by phi; corners, where it turns by more than `corner`, left out.
   pure real(wp) function arc_dip(x, edge, corner)
      real(wp), intent(in), contiguous :: x(:, :)  !! (2, n_node) [L]
      integer, intent(in) :: edge(:, :)            !! (2, n_edge) first and last node
      real(wp), intent(in) :: corner               !! [degrees]
      real(wp) :: one(2), other(2), angle
      integer :: i, j

      arc_dip = 0.0_wp
      do i = 1, size(edge, 2)
         j = findloc(edge(1, :), edge(2, i), dim=1)
         if (j == 0) cycle
         one = x(:, edge(2, i)) - x(:, edge(1, i))
         other = x(:, edge(2, j)) - x(:, edge(1, j))
         angle = abs(atan2(one(1)*other(2) - one(2)*other(1), dot_product(one, other)))
         if (angle < corner*acos(-1.0_wp)/180.0_wp) arc_dip = max(arc_dip, &
            angle*max(norm2(one), norm2(other))/8.0_wp)
      end do
   end function arc_dip

end module emcon_arc_dip_plane
