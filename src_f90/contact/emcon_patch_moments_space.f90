!> What a triangle covers of the patch of a slave node: moments of the common polygon, and how they
!> change with the corners.
!>
!> Places are given by coordinates y in which the patch is the square 0 <= y1, y2 <= 1.
!> Source: docs/theory.md, eqs. (45) and (49).
module emcon_patch_moments_space
   use emcon_kinds, only : wp
   use emcon_polygon_clip_space, only : most_corners, polygon_clip, polygon_inside, &
      polygon_misses, square_sides
   implicit none
   private
   public :: patch_moments, patch_moment_slopes, patch_misses

   !> A side of a triangle that lies on one of the patch is half in it, half not: the patch is taken
   !> this much wider and narrower.
   real(wp), parameter :: wider = 1.0e-10_wp
   !> Gauss points on 0..1, of weight 1/2: exact for cubics.
   real(wp), parameter :: gauss(2) = 0.5_wp + [-0.5_wp, 0.5_wp]/sqrt(3.0_wp)

contains

   !> Do they have no area in common, as one side of the patch shows?
   pure logical function patch_misses(corner)
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle

      patch_misses = polygon_misses(square_sides, corner)
   end function patch_misses

   !> Moments of the common polygon with the functions 1 - y1 - y2, y1 and y2, by the area of the
   !> patch, 1; exactly 0 where there is none. Their sum is the part of the patch that is covered.
   pure function patch_moments(corner) result(moment)
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle, counter-clockwise
      real(wp) :: moment(3)
      real(wp) :: polygon(2, most_corners), middle(2), area
      integer :: k, n

      moment = 0.0_wp
      if (patch_misses(corner)) return
      call polygon_clip(square_sides, corner, polygon, n)
      do k = 2, n - 1
         associate (a => polygon(:, k) - polygon(:, 1), b => polygon(:, k + 1) - polygon(:, 1))
            area = 0.5_wp*(a(1)*b(2) - a(2)*b(1))
         end associate
         middle = (polygon(:, 1) + polygon(:, k) + polygon(:, k + 1))/3.0_wp
         moment = moment + area*[1.0_wp - sum(middle), middle]
      end do
   end function patch_moments

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
      do k = 1, size(square_sides, 2)
         here = polygon_inside(square_sides(:, k), from) + by
         there = polygon_inside(square_sides(:, k), from + along) + by
         if (max(here, there) <= 0.0_wp) high = low
         if ((here > 0.0_wp) .eqv. (there > 0.0_wp)) cycle
         t = here/(here - there)
         if (here > 0.0_wp) high = min(high, t)
         if (there > 0.0_wp) low = max(low, t)
      end do
   end subroutine part_inside

end module emcon_patch_moments_space
