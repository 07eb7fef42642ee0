!> What a triangle covers of a small one, the patch: moments of the common polygon, and how they
!> change with the corners.
!>
!> Places are given by coordinates y in which the patch is the square 0 <= y1, y2 <= 1. Moments are
!> those with 1 - y1 - y2, y1 and y2. What triangles cover of the triangle 0 <= y1, y2,
!> y1 + y2 <= 1 is clipped here as well.
!> Source: docs/theory.md, eqs. (45) and (49).
module emcon_patch_moments_space
   use emcon_kinds, only : wp
   implicit none
   private
   public :: patch_moments, patch_moment_slopes, patch_misses
   public :: triangle_clip, triangle_misses, most_corners, barycentric

   !> Corners of what four half planes leave of a triangle, at most.
   integer, parameter :: most_corners = 7
   !> Half planes that a triangle and a square are made of, as `inside` numbers them.
   integer, parameter :: of_triangle(3) = [1, 2, 3], of_square(4) = [1, 2, 4, 5]
   !> A side of a triangle that lies on one of the patch is half in it, half not: the patch is taken
   !> this much wider and narrower.
   real(wp), parameter :: wider = 1.0e-10_wp
   !> Gauss points on 0..1, of weight 1/2: exact for cubics.
   real(wp), parameter :: gauss(2) = 0.5_wp + [-0.5_wp, 0.5_wp]/sqrt(3.0_wp)

contains

   !> Do they have no area in common, as one side of either shows?
   pure logical function patch_misses(corner)
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle

      patch_misses = any(maxval(corner, 2) <= 0.0_wp) .or. any(minval(corner, 2) >= 1.0_wp)
   end function patch_misses

   !> Moments of the common polygon, by the area of the patch; exactly 0 where there is none. Their
   !> sum is the part of the patch that is covered.
   pure function patch_moments(corner) result(moment)
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle, counter-clockwise
      real(wp) :: moment(3)
      real(wp) :: polygon(2, most_corners), centre(2), area
      integer :: k, n

      moment = 0.0_wp
      if (patch_misses(corner)) return
      call clip(of_square, corner, polygon, n)
      do k = 2, n - 1
         associate (a => polygon(:, k) - polygon(:, 1), b => polygon(:, k + 1) - polygon(:, 1))
            area = 0.5_wp*(a(1)*b(2) - a(2)*b(1))
         end associate
         centre = (polygon(:, 1) + polygon(:, k) + polygon(:, k + 1))/3.0_wp
         moment = moment + area*[1.0_wp - sum(centre), centre]
      end do
   end function patch_moments

   !> The common polygon of a triangle and that with the corners (0, 0), (1, 0), (0, 1), in turn as
   !> the corners of the triangle.
   pure subroutine triangle_clip(corner, polygon, n)
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle
      real(wp), intent(out) :: polygon(2, most_corners)      !! places
      integer, intent(out) :: n                  !! corners that it has; fewer than 3: no area

      call clip(of_triangle, corner, polygon, n)
   end subroutine triangle_clip

   !> Have they no area in common, as one side of either shows?
   pure logical function triangle_misses(corner)
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle

      triangle_misses = any(maxval(corner, 2) <= 0.0_wp) .or. minval(sum(corner, 1)) >= 1.0_wp
   end function triangle_misses

   !> What half planes leave of a triangle.
   pure subroutine clip(side, corner, polygon, n)
      integer, intent(in) :: side(:)             !! of `inside`
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle
      real(wp), intent(out) :: polygon(2, most_corners)      !! places
      integer, intent(out) :: n                  !! corners that it has; fewer than 3: no area
      integer :: k

      polygon(:, :3) = corner
      n = 3
      do k = 1, size(side)
         call cut(side(k), polygon, n)
      end do
   end subroutine clip

   !> How far inside the `k`th half plane a place is.
   pure real(wp) function inside(k, y)
      integer, intent(in) :: k
      real(wp), intent(in) :: y(2)

      select case (k)
      case (1, 2)
         inside = y(k)
      case (3)
         inside = 1.0_wp - (y(1) + y(2))
      case default
         inside = 1.0_wp - y(k - 3)
      end select
   end function inside

   !> Cut off of a polygon what is outside of the `k`th half plane.
   pure subroutine cut(k, polygon, n)
      integer, intent(in) :: k
      real(wp), intent(inout) :: polygon(2, most_corners)
      integer, intent(inout) :: n                !! corners that it has
      real(wp) :: old(2, most_corners), here, there
      integer :: i, n_old

      old = polygon
      n_old = n
      n = 0
      do i = 1, n_old
         associate (a => old(:, i), b => old(:, 1 + mod(i, n_old)))
            here = inside(k, a)
            there = inside(k, b)
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

   !> How moments change with the corners: what each side sweeps of the patch.
   pure function patch_moment_slopes(corner) result(slope)
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle, counter-clockwise
      real(wp) :: slope(3, 2, 3)                 !! (moment, coordinate, corner)
      real(wp) :: t, y(2), at(3), low, high
      integer :: i, k, next, pass

      slope = 0.0_wp
      do k = 1, 3
         next = 1 + mod(k, 3)
         associate (a => corner(:, k), along => corner(:, next) - corner(:, k))
            do pass = 1, 2
               call part_inside(a, along, merge(wider, -wider, pass == 1), low, high)
               if (.not. high > low) cycle
               do i = 1, 2
                  t = low + (high - low)*gauss(i)
                  y = a + t*along
                  ! Half for the pass, half for the point of Gauss.
                  at = (0.25_wp*(high - low))*[1.0_wp - sum(y), y]
                  call add(slope(:, :, k), (1.0_wp - t)*at, along)
                  call add(slope(:, :, next), t*at, along)
               end do
            end do
         end associate
      end do

   contains

      !> Add `weight` for motions along the outward normal of a side.
      pure subroutine add(part, weight, along)
         real(wp), intent(inout) :: part(3, 2)
         real(wp), intent(in) :: weight(3), along(2)

         part(:, 1) = part(:, 1) + weight*along(2)
         part(:, 2) = part(:, 2) - weight*along(1)
      end subroutine add

   end function patch_moment_slopes

   !> The part of a way, 0 to 1, that is in the patch made wider by `by`.
   pure subroutine part_inside(from, along, by, low, high)
      real(wp), intent(in) :: from(2), along(2), by
      real(wp), intent(out) :: low, high
      real(wp) :: here, there, t
      integer :: k

      low = 0.0_wp
      high = 1.0_wp
      do k = 1, size(of_square)
         here = inside(of_square(k), from) + by
         there = inside(of_square(k), from + along) + by
         if (max(here, there) <= 0.0_wp) high = low
         if ((here > 0.0_wp) .eqv. (there > 0.0_wp)) cycle
         t = here/(here - there)
         if (here > 0.0_wp) high = min(high, t)
         if (there > 0.0_wp) low = max(low, t)
      end do
   end subroutine part_inside

   !> The barycentric coordinates of place `y` in a triangle, also outside of it.
   pure function barycentric(corner, y) result(share)
      real(wp), intent(in) :: corner(2, 3)       !! not on one line
      real(wp), intent(in) :: y(2)               !! in the same coordinates
      real(wp) :: share(3)
      real(wp) :: d(2, 3)

      d = corner - spread(y, 2, 3)
      share = [turn(d(:, 2), d(:, 3)), turn(d(:, 3), d(:, 1)), turn(d(:, 1), d(:, 2))] &
         /turn(corner(:, 2) - corner(:, 1), corner(:, 3) - corner(:, 1))

   contains

      pure real(wp) function turn(a, b)
         real(wp), intent(in) :: a(2), b(2)

         turn = a(1)*b(2) - a(2)*b(1)
      end function turn

   end function barycentric

end module emcon_patch_moments_space
