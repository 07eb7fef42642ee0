! build: elements
!> What a triangle covers of a patch: moments of the common polygon, and how they change with the
!> corners.
!>
!> Places are given by coordinates y in which the patch of a node is the square 0 <= y1, y2 <= 1,
!> and that of a part of a slave facet the triangle 0 <= y1, y2, y1 + y2 <= 1. A square has the
!> weight 1, a triangle the three that are linear, and 1 at one of its corners.
!> Source: docs/theory.md, eqs. (45) and (49).
module emcon_patch_moments_space
   use emcon_kinds, only : wp
   use emcon_polygon_clip_space, only : most_corners, polygon_clip, polygon_inside, &
      polygon_misses, square_sides, triangle_sides
   implicit none
   private
   public :: patch_area_t, patch_triangle, patch_moments, patch_products, &
      patch_moment_slopes, patch_misses

   !> A side of a triangle that lies on one of the patch is half in it, half not: the patch is taken
   !> this much wider and narrower.
   real(wp), parameter :: wider = 1.0e-10_wp
   !> Gauss points on 0..1, of weight 1/2: exact for cubics.
   real(wp), parameter :: gauss(2) = 0.5_wp + [-0.5_wp, 0.5_wp]/sqrt(3.0_wp)

   !> What a patch is, in its coordinates: that of a node, unless something else is said.
   type :: patch_area_t
      integer :: n_side = 4
      real(wp) :: side(3, 4) = square_sides      !! (3, >= n_side), as `polygon_clip` has them
      real(wp) :: centre = 0.5_wp                !! both of its coordinates
      integer :: n_weight = 1
   end type patch_area_t

contains

   !> The patch of a part of a slave facet.
   pure type(patch_area_t) function patch_triangle() result(area)
      area%n_side = 3
      area%side(:, :3) = triangle_sides
      area%centre = 1.0_wp/3.0_wp
      area%n_weight = 3
   end function patch_triangle

   !> Do they have no area in common, as one side of the patch shows?
   pure logical function patch_misses(area, corner)
      type(patch_area_t), intent(in) :: area
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle

      patch_misses = polygon_misses(area%side(:, :area%n_side), corner)
   end function patch_misses

   !> Moments of the common polygon with the functions 1 - y1 - y2, y1 and y2; exactly 0 where there
   !> is none. Their sum is what of the patch is covered.
   pure function patch_moments(area, corner) result(moment)
      type(patch_area_t), intent(in) :: area
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle, counter-clockwise
      real(wp) :: moment(3)
      real(wp) :: polygon(2, most_corners), middle(2), part
      integer :: k, n

      moment = 0.0_wp
      if (patch_misses(area, corner)) return
      call polygon_clip(area%side(:, :area%n_side), corner, polygon, n)
      do k = 2, n - 1
         associate (a => polygon(:, k) - polygon(:, 1), b => polygon(:, k + 1) - polygon(:, 1))
            part = 0.5_wp*(a(1)*b(2) - a(2)*b(1))
         end associate
         middle = (polygon(:, 1) + polygon(:, k) + polygon(:, k + 1))/3.0_wp
         moment = moment + part*[1.0_wp - sum(middle), middle]
      end do
   end function patch_moments

   !> Moments of the common polygon with the products of these functions.
   pure function patch_products(area, corner) result(product)
      type(patch_area_t), intent(in) :: area
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle, counter-clockwise
      real(wp) :: product(3, 3)
      real(wp) :: polygon(2, most_corners), value(3, most_corners), total(3), part
      integer :: i, j, k, n

      product = 0.0_wp
      if (patch_misses(area, corner)) return
      call polygon_clip(area%side(:, :area%n_side), corner, polygon, n)
      value(2:, :n) = polygon(:, :n)
      value(1, :n) = 1.0_wp - polygon(1, :n) - polygon(2, :n)
      do k = 2, n - 1
         associate (a => polygon(:, k) - polygon(:, 1), b => polygon(:, k + 1) - polygon(:, 1))
            part = (a(1)*b(2) - a(2)*b(1))/24.0_wp
         end associate
         total = value(:, 1) + value(:, k) + value(:, k + 1)
         do j = 1, 3
            do i = 1, 3
               product(i, j) = product(i, j) + part*(total(i)*total(j) + value(i, 1)*value(j, 1) &
                  + value(i, k)*value(j, k) + value(i, k + 1)*value(j, k + 1))
            end do
         end do
      end do
   end function patch_products

   !> How moments change with the corners, with each weight: what each side sweeps of the patch.
   pure subroutine patch_moment_slopes(area, corner, slope)
      type(patch_area_t), intent(in) :: area
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle, counter-clockwise
      !> (moment, coordinate, corner, weight)
      real(wp), intent(out) :: slope(3, 2, 3, area%n_weight)
      real(wp) :: t, y(2), at(3), low, high
      integer :: i, k, next, pass, w

      slope = 0.0_wp
      do k = 1, 3
         next = 1 + mod(k, 3)
         associate (a => corner(:, k), along => corner(:, next) - corner(:, k))
            do pass = 1, 2
               call part_inside(area, a, along, merge(wider, -wider, pass == 1), low, high)
               if (.not. high > low) cycle
               do i = 1, 2
                  t = low + (high - low)*gauss(i)
                  y = a + t*along
                  at = [1.0_wp - sum(y), y]
                  do w = 1, area%n_weight
                     ! Half for the pass, half for the point of Gauss.
                     associate (part => 0.25_wp*(high - low)*merge(1.0_wp, at(w), &
                           area%n_weight == 1))
                        call add(slope(:, :, k, w), (1.0_wp - t)*part*at, along)
                        call add(slope(:, :, next, w), t*part*at, along)
                     end associate
                  end do
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

   end subroutine patch_moment_slopes

   !> The part of a way, 0 to 1, that is in the patch made wider by `by`.
   pure subroutine part_inside(area, from, along, by, low, high)
      type(patch_area_t), intent(in) :: area
      real(wp), intent(in) :: from(2), along(2), by
      real(wp), intent(out) :: low, high
      real(wp) :: here, there, t
      integer :: k

      low = 0.0_wp
      high = 1.0_wp
      do k = 1, area%n_side
         here = polygon_inside(area%side(:, k), from) + by
         there = polygon_inside(area%side(:, k), from + along) + by
         if (max(here, there) <= 0.0_wp) high = low
         if ((here > 0.0_wp) .eqv. (there > 0.0_wp)) cycle
         t = here/(here - there)
         if (here > 0.0_wp) high = min(high, t)
         if (there > 0.0_wp) low = max(low, t)
      end do
   end subroutine part_inside

end module emcon_patch_moments_space
