!> The nearest place of triangles to a point, and where an edge crosses a triangle: from positions
!> alone.
!>
!> Triangles run counter-clockwise from outside. Source: docs/theory.md, section 4.15.
module emcon_nearest_space
   use emcon_kinds, only : wp
   use emcon_triangles_space, only : cross_product
   implicit none
   private
   public :: nearest_t, nearest_update, nearest_height, crossing_find

   !> The nearest place to a point so far.
   type :: nearest_t
      integer :: triangle = 0                    !! 0: none yet
      real(wp) :: square = huge(1.0_wp)          !! square of the distance [L^2]
      real(wp) :: weight(3) = 0.0_wp             !! of the corners in the place
   end type nearest_t

contains

   !> Is triangle number `triangle` nearer to `point` than the nearest one so far?
   pure subroutine nearest_update(self, triangle, point, corner)
      type(nearest_t), intent(inout) :: self
      integer, intent(in) :: triangle            !! its number
      real(wp), intent(in) :: point(3)           !! [L]
      real(wp), intent(in) :: corner(3, 3)       !! (3, corner) [L]
      real(wp) :: weight(3), offset(3), square

      weight = nearest_weight(point - corner(:, 1), corner(:, 2) - corner(:, 1), &
         corner(:, 3) - corner(:, 1))
      offset = (point - corner(:, 1)) - (weight(2)*(corner(:, 2) - corner(:, 1)) &
         + weight(3)*(corner(:, 3) - corner(:, 1)))
      square = dot_product(offset, offset)
      if (square < self%square) self = nearest_t(triangle, square, weight)
   end subroutine nearest_update

   !> The weights of the corners in the place of a triangle that is nearest to a point: by the
   !> regions in which that is a corner, on a side, or inside.
   pure function nearest_weight(to_point, ab, ac) result(weight)
      real(wp), intent(in) :: to_point(3), ab(3), ac(3)      !! from the first corner [L]
      real(wp) :: weight(3)
      real(wp) :: a(2), b(2), c(2), sides(3), s

      a = [dot_product(ab, to_point), dot_product(ac, to_point)]
      b = [dot_product(ab, to_point - ab), dot_product(ac, to_point - ab)]
      c = [dot_product(ab, to_point - ac), dot_product(ac, to_point - ac)]
      sides = [b(1)*c(2) - c(1)*b(2), c(1)*a(2) - a(1)*c(2), a(1)*b(2) - b(1)*a(2)]
      if (all(a <= 0.0_wp)) then
         weight = [1.0_wp, 0.0_wp, 0.0_wp]
      else if (b(1) >= 0.0_wp .and. b(2) <= b(1)) then
         weight = [0.0_wp, 1.0_wp, 0.0_wp]
      else if (c(2) >= 0.0_wp .and. c(1) <= c(2)) then
         weight = [0.0_wp, 0.0_wp, 1.0_wp]
      else if (sides(3) <= 0.0_wp .and. a(1) >= 0.0_wp .and. b(1) <= 0.0_wp) then
         s = a(1)/(a(1) - b(1))
         weight = [1.0_wp - s, s, 0.0_wp]
      else if (sides(2) <= 0.0_wp .and. a(2) >= 0.0_wp .and. c(2) <= 0.0_wp) then
         s = a(2)/(a(2) - c(2))
         weight = [1.0_wp - s, 0.0_wp, s]
      else if (sides(1) <= 0.0_wp .and. b(2) >= b(1) .and. c(1) >= c(2)) then
         s = (b(2) - b(1))/((b(2) - b(1)) + (c(1) - c(2)))
         weight = [0.0_wp, 1.0_wp - s, s]
      else
         weight = sides/sum(sides)
      end if
   end function nearest_weight

   !> How far `point` is in front of the plane of a triangle, times twice its area.
   pure real(wp) function nearest_height(point, corner) result(height)
      real(wp), intent(in) :: point(3)           !! [L]
      real(wp), intent(in) :: corner(3, 3)       !! (3, corner) [L]

      height = dot_product(point - corner(:, 1), &
         cross_product(corner(:, 2) - corner(:, 1), corner(:, 3) - corner(:, 1)))
   end function nearest_height

   !> Does the edge from `p` to `q` cross a triangle, given that its ends are on both sides of the
   !> plane of that? The volumes with its three sides have one sign then. Each side is taken the
   !> same way from both triangles that have it: of two neighbours the edge crosses one.
   pure logical function crossing_find(p, q, corner, number) result(crosses)
      real(wp), intent(in) :: p(3), q(3)         !! [L]
      real(wp), intent(in) :: corner(3, 3)       !! (3, corner) [L]
      integer, intent(in) :: number(3)           !! of the corners
      real(wp) :: along(3)
      logical :: is_left

      along = q - p
      is_left = left_of(1, 2)
      crosses = .false.
      if (left_of(2, 3) .neqv. is_left) return
      crosses = left_of(3, 1) .eqv. is_left

   contains

      pure logical function left_of(i, j)
         integer, intent(in) :: i, j

         if (number(i) < number(j)) then
            left_of = volume(corner(:, i) - p, corner(:, j) - p) > 0.0_wp
         else
            left_of = .not. volume(corner(:, j) - p, corner(:, i) - p) > 0.0_wp
         end if
      end function left_of

      pure real(wp) function volume(a, b)
         real(wp), intent(in) :: a(3), b(3)

         volume = along(1)*(a(2)*b(3) - a(3)*b(2)) + along(2)*(a(3)*b(1) - a(1)*b(3)) &
            + along(3)*(a(1)*b(2) - a(2)*b(1))
      end function volume

   end function crossing_find

end module emcon_nearest_space
