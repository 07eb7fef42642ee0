! build: elements
!> What a triangle covers of a patch: moments of the common polygon, and how they change with the
!> corners.
!>
!> Places are given by coordinates y in which the patch of a node is the square 0 <= y1, y2 <= 1,
!> and that of a part of a slave facet the triangle 0 <= y1, y2, y1 + y2 <= 1; a patch has a weight
!> that is linear in them. Source: docs/theory.md, eqs. (45) and (49).
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
      real(wp) :: weight(3) = 1.0_wp             !! at y = (0, 0), (1, 0) and (0, 1)
   end type patch_area_t

contains

   !> The patch of a part of a slave facet.
   pure type(patch_area_t) function patch_triangle() result(area)
      area%n_side = 3
      area%side(:, :3) = triangle_sides
      area%centre = 1.0_wp/3.0_wp
   end function patch_triangle

   !> The weight of a patch at a place.
   pure real(wp) function weight_at(area, y) result(weight)
      type(patch_area_t), intent(in) :: area
      real(wp), intent(in) :: y(2)

      weight = area%weight(1) + (area%weight(2) - area%weight(1))*y(1) &
         + (area%weight(3) - area%weight(1))*y(2)
   end function weight_at

   !> Do they have no area in common, as one side of the patch shows?
   pure logical function patch_misses(area, corner)
      type(patch_area_t), intent(in) :: area
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle

      patch_misses = polygon_misses(area%side(:, :area%n_side), corner)
   end function patch_misses

   !> Moments of the common polygon with the functions 1 - y1 - y2, y1 and y2; exactly 0 where there
   !> is none. The sum of those without weight is what of the patch is covered.
   pure subroutine patch_moments(area, corner, moment, bare)
      type(patch_area_t), intent(in) :: area
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle, counter-clockwise
      real(wp), intent(out) :: moment(3)         !! with the weight
      real(wp), intent(out) :: bare(3)           !! without
      real(wp) :: polygon(2, most_corners), middle(2), part, mean, weight(3), spread_of(3)
      integer :: i, k, n

      moment = 0.0_wp
      bare = 0.0_wp
      if (patch_misses(area, corner)) return
      call polygon_clip(area%side(:, :area%n_side), corner, polygon, n)
      do k = 2, n - 1
         associate (a => polygon(:, k) - polygon(:, 1), b => polygon(:, k + 1) - polygon(:, 1))
            part = 0.5_wp*(a(1)*b(2) - a(2)*b(1))
         end associate
         middle = (polygon(:, 1) + polygon(:, k) + polygon(:, k + 1))/3.0_wp
         weight(1) = weight_at(area, polygon(:, 1))
         weight(2:) = [(weight_at(area, polygon(:, i)), i = k, k + 1)]
         mean = sum(weight)/3.0_wp
         spread_of(2:) = matmul(polygon(:, [1, k, k + 1]), weight - mean)/12.0_wp
         spread_of(1) = -sum(spread_of(2:))
         bare = bare + part*[1.0_wp - sum(middle), middle]
         moment = moment + part*(mean*[1.0_wp - sum(middle), middle] + spread_of)
      end do
   end subroutine patch_moments

   !> Moments of the common polygon with the products of these functions, without weights.
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

   !> How moments change with the corners: what each side sweeps of the patch.
   pure subroutine patch_moment_slopes(area, corner, slope, bare)
      type(patch_area_t), intent(in) :: area
      real(wp), intent(in) :: corner(2, 3)       !! of the triangle, counter-clockwise
      real(wp), intent(out) :: slope(3, 2, 3)    !! (moment, coordinate, corner) with the weight
      real(wp), intent(out) :: bare(3, 2, 3)     !! without
      real(wp) :: t, y(2), at(3), low, high
      integer :: i, k, next, pass

      slope = 0.0_wp
      bare = 0.0_wp
      do k = 1, 3
         next = 1 + mod(k, 3)
         associate (a => corner(:, k), along => corner(:, next) - corner(:, k))
            do pass = 1, 2
               call part_inside(area, a, along, merge(wider, -wider, pass == 1), low, high)
               if (.not. high > low) cycle
               do i = 1, 2
                  t = low + (high - low)*gauss(i)
                  y = a + t*along
                  ! Half for the pass, half for the point of Gauss.
                  at = (0.25_wp*(high - low))*[1.0_wp - sum(y), y]
                  call add(bare(:, :, k), (1.0_wp - t)*at, along)
                  call add(bare(:, :, next), t*at, along)
                  at = weight_at(area, y)*at
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
