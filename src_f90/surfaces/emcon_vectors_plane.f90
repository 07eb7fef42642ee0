!> Vectors in the plane.
module emcon_vectors_plane
   use emcon_kinds, only : wp
   implicit none
   private
   public :: cross, between

contains

   !> a x b = a1 b2 - a2 b1; of a place and a force: the moment about the origin.
   pure real(wp) function cross(a, b)
      real(wp), intent(in) :: a(:), b(:)         !! (2)

      cross = a(1)*b(2) - a(2)*b(1)
   end function cross

   !> The way from node `i` to node `j` at x + u, differences first.
   pure function between(x, u, i, j) result(vector)
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (2, n_node) [L]
      integer, intent(in) :: i, j                !! 1..n_node
      real(wp) :: vector(2)                      !! [L]

      vector = (x(:, j) - x(:, i)) + (u(:, j) - u(:, i))
   end function between

end module emcon_vectors_plane
