! build: elements
!> What a convex polygon of the plane covers of a triangle: their common polygon, with no tolerance.
!>
!> The convex polygon is the set of places y at which all of its sides, s(1) + s(2) y1 + s(3) y2,
!> are 0 or more. Source: Sutherland and Hodgman (1974).
module emcon_polygon_clip_space
   use emcon_kinds, only : wp
   implicit none
   private
   public :: polygon_clip, polygon_misses, polygon_beside, polygon_inside, barycentric
   public :: triangle_sides, square_sides, most_corners

   !> The triangle 0 <= y1, y2, y1 + y2 <= 1, and the square 0 <= y1, y2 <= 1.
   real(wp), parameter :: triangle_sides(3, 3) = reshape([0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
      1.0_wp, 1.0_wp, -1.0_wp, -1.0_wp], [3, 3])
   real(wp), parameter :: square_sides(3, 4) = reshape([0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
      1.0_wp, 1.0_wp, -1.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, -1.0_wp], [3, 4])
   !> Corners of what the sides of the square leave of a triangle, at most.
   integer, parameter :: most_corners = 7

contains

   !> How far inside a side a place is.
   pure real(wp) function polygon_inside(side, y) result(inside)
      real(wp), intent(in) :: side(3)            !! s of the side
      real(wp), intent(in) :: y(2)               !! the place

      inside = side(1) + (side(2)*y(1) + side(3)*y(2))
   end function polygon_inside

   !> Have they no area in common, as one of the sides shows?
   pure logical function polygon_misses(sides, corner) result(misses)
      real(wp), intent(in) :: sides(:, :)        !! (3, n_side)
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle
      integer :: k

      misses = .true.
      do k = 1, size(sides, 2)
         if (polygon_inside(sides(:, k), corner(:, 1)) > 0.0_wp) cycle
         if (polygon_inside(sides(:, k), corner(:, 2)) > 0.0_wp) cycle
         if (polygon_inside(sides(:, k), corner(:, 3)) > 0.0_wp) cycle
         return
      end do
      misses = .false.
   end function polygon_misses

   !> How far outside of one of the sides the triangle is, at most; 0: of none.
   pure real(wp) function polygon_beside(sides, corner) result(beside)
      real(wp), intent(in) :: sides(:, :)        !! (3, n_side)
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle
      integer :: i, k

      beside = 0.0_wp
      do k = 1, size(sides, 2)
         beside = max(beside, -maxval([(polygon_inside(sides(:, k), corner(:, i)), i = 1, 3)]))
      end do
   end function polygon_beside

   !> The common polygon, in turn as the corners of the triangle.
   pure subroutine polygon_clip(sides, corner, polygon, n)
      real(wp), intent(in) :: sides(:, :)        !! (3, n_side), n_side <= 4
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle
      real(wp), intent(out) :: polygon(2, most_corners)      !! places
      integer, intent(out) :: n                  !! corners that it has; fewer than 3: no area
      integer :: k

      polygon(:, :3) = corner
      n = 3
      do k = 1, size(sides, 2)
         call cut(sides(:, k), polygon, n)
      end do
   end subroutine polygon_clip

   !> Cut off of a polygon what is outside of a side.
   pure subroutine cut(side, polygon, n)
      real(wp), intent(in) :: side(3)
      real(wp), intent(inout) :: polygon(2, most_corners)
      integer, intent(inout) :: n                !! corners that it has
      real(wp) :: old(2, most_corners), here, there
      integer :: i, n_old

      old = polygon
      n_old = n
      n = 0
      do i = 1, n_old
         associate (a => old(:, i), b => old(:, 1 + mod(i, n_old)))
            here = polygon_inside(side, a)
            there = polygon_inside(side, b)
            if (here >= 0.0_wp) then
               n = n + 1
               polygon(:, n) = a
            end if
            if ((here >= 0.0_wp) .eqv. (there >= 0.0_wp)) cycle
            n = n + 1
            polygon(:, n) = a + (here/(here - there))*(b - a)
         end associate
      end do
   end subroutine cut

   !> The barycentric coordinates of place `y` in a triangle, also outside of it.
   pure function barycentric(corner, y) result(share)
      real(wp), intent(in) :: corner(2, 3)       !! not on one line
      real(wp), intent(in) :: y(2)               !! in the same coordinates
      real(wp) :: share(3)
      real(wp) :: d(2, 3)
      integer :: k

      do k = 1, 3
         d(:, k) = corner(:, k) - y
      end do
      share = [turn(d(:, 2), d(:, 3)), turn(d(:, 3), d(:, 1)), turn(d(:, 1), d(:, 2))] &
         /turn(corner(:, 2) - corner(:, 1), corner(:, 3) - corner(:, 1))

   contains

      pure real(wp) function turn(a, b)
         real(wp), intent(in) :: a(2), b(2)

         turn = a(1)*b(2) - a(2)*b(1)
      end function turn

   end function barycentric

end module emcon_polygon_clip_space
