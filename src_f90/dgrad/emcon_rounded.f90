!> min(a, 0), max(a, 0) and the bounds 0 and 1 with their corners rounded.
!>
!> max(a, 0) and the bounds: on the inner side, by cubics. 0 and 1 are exact outside, so is a from
!> the end of the band on; there is one tangent everywhere. min(a, 0): to both sides alike, by a
!> quartic, with one curvature everywhere; it is exact beyond the band, and added to its mirror
!> image, rounded max(a, 0), it is a. It is nowhere above min(a, 0). Of the same kind, but nowhere
!> below min(a, 0) and exact at 0, is `above_negative`, of the sixth degree; its slope is outside
!> 0..1 in parts of the band.
!> Source: docs/theory.md, section 2, rounded corners.
module emcon_rounded
   use emcon_kinds, only : wp
   implicit none
   private
   public :: rounded_part, rounded_part_slope, rounded_chord, rounded_clip, rounded_clip_slope
   public :: rounded_negative, rounded_negative_slope, above_negative, above_negative_slope
   public :: negative_chord

contains

   !> max(a, 0); with t = a/width, width (2 t^2 - t^3) where 0 < t < 1.
   elemental real(wp) function rounded_part(a, width)
      real(wp), intent(in) :: a, width

      rounded_part = max(0.0_wp, a)
      if (rounded_part < width) rounded_part = a*max(0.0_wp, (a/width)*(2.0_wp - a/width))
   end function rounded_part

   !> Slope of `rounded_part`, width > 0.
   elemental real(wp) function rounded_part_slope(a, width)
      real(wp), intent(in) :: a, width

      associate (t => max(0.0_wp, min(1.0_wp, a/width)))
         rounded_part_slope = t*(4.0_wp - 3.0_wp*t)
      end associate
   end function rounded_part_slope

   !> Divided difference of `rounded_part` from `a0` to `a1` and its derivative by a1, width > 0:
   !> the mean of the slope over the way, and that of the curvature times the part of the way.
   pure subroutine rounded_chord(a0, a1, width, slope, rate)
      real(wp), intent(in) :: a0, a1, width
      real(wp), intent(out) :: slope, rate
      real(wp) :: total, low, high, first, last, within

      total = abs(a1 - a0)
      if (.not. total > 0.0_wp) then
         slope = rounded_part_slope(a1, width)
         rate = 0.0_wp
         if (a1 > 0.0_wp .and. a1 < width) rate = 0.5_wp*curvature(a1)
         return
      end if
      low = min(a0, a1)
      high = max(a0, a1)
      first = max(low, 0.0_wp)
      last = min(high, width)
      within = max(0.0_wp, last - first)/total
      associate (s => first/width, t => last/width)
         slope = max(0.0_wp, high - max(low, width))/total &
            + within*(2.0_wp*(s + t) - (s*s + s*t + t*t))
      end associate
      associate (middle => 0.5_wp*(first + last))
         rate = within*(moment(first) + 4.0_wp*moment(middle) + moment(last))/6.0_wp
      end associate

   contains

      pure real(wp) function curvature(a)
         real(wp), intent(in) :: a

         curvature = (4.0_wp - 6.0_wp*(a/width))/width
      end function curvature

      pure real(wp) function moment(a)
         real(wp), intent(in) :: a

         moment = curvature(a)*(abs(a - a0)/total)
      end function moment

   end subroutine rounded_chord

   !> min(a, 0); with t = a/width, -width (1 - t)^3 (3 + t)/16 where |t| < 1.
   elemental real(wp) function rounded_negative(a, width)
      real(wp), intent(in) :: a, width

      rounded_negative = min(a, 0.0_wp)
      if (.not. abs(a) < width) return
      associate (t => a/width)
         rounded_negative = -width*(1.0_wp - t)**3*(3.0_wp + t)/16.0_wp
      end associate
   end function rounded_negative

   !> Slope of `rounded_negative`, width > 0.
   elemental real(wp) function rounded_negative_slope(a, width)
      real(wp), intent(in) :: a, width

      associate (t => max(-1.0_wp, min(1.0_wp, a/width)))
         rounded_negative_slope = 0.25_wp*(1.0_wp - t)**2*(2.0_wp + t)
      end associate
   end function rounded_negative_slope

   !> Divided difference of `rounded_negative`, or of `above_negative`, from `a0` to `a1` and its
   !> derivative by a1, as of `rounded_chord`; width > 0.
   pure subroutine negative_chord(is_above, a0, a1, width, slope, rate)
      logical, intent(in) :: is_above
      real(wp), intent(in) :: a0, a1, width
      real(wp), intent(out) :: slope, rate
      real(wp) :: total, low, high, first, last, span(2), within, reach, mean

      total = abs(a1 - a0)
      if (.not. total > 0.0_wp) then
         slope = merge(above_negative_slope(a1, width), rounded_negative_slope(a1, width), is_above)
         rate = 0.0_wp
         if (abs(a1) < width) rate = 0.5_wp*negative_curvature(is_above, a1, width)
         return
      end if
      low = min(a0, a1)
      high = max(a0, a1)
      first = max(low, -width)
      last = min(high, width)
      within = max(0.0_wp, last - first)/total
      associate (s => first/width, t => last/width)
         if (is_above) then
            mean = 0.5_wp - (s + t)*(15.0_wp - 10.0_wp*(s*s + t*t) + 3.0_wp*(s**4 + (s*t)**2 &
               + t**4))/16.0_wp
         else
            mean = 0.5_wp - (s + t)*(6.0_wp - (s*s + t*t))/16.0_wp
         end if
      end associate
      slope = max(0.0_wp, min(high, -width) - low)/total + within*mean
      if (is_above) then
         ! Gauss's rule of three points, by parts of the way, is exact for the fifth degree.
         span = abs(max(-width, min(width, [a0, a1])) - a0)/total
         reach = 0.5_wp*sqrt(0.6_wp)*(span(2) - span(1))
         associate (middle => 0.5_wp*(span(1) + span(2)))
            rate = within*(5.0_wp*moment(middle - reach) + 8.0_wp*moment(middle) &
               + 5.0_wp*moment(middle + reach))/18.0_wp
         end associate
      else
         rate = within*(moment_at(first) + 4.0_wp*moment_at(0.5_wp*(first + last)) &
            + moment_at(last))/6.0_wp
      end if

   contains

      !> `part`: of the way from a0 to a1.
      pure real(wp) function moment(part)
         real(wp), intent(in) :: part

         moment = negative_curvature(is_above, a0 + part*(a1 - a0), width)*part
      end function moment

      pure real(wp) function moment_at(a)
         real(wp), intent(in) :: a

         moment_at = negative_curvature(is_above, a, width)*(abs(a - a0)/total)
      end function moment_at

   end subroutine negative_chord

   !> The curvature of `rounded_negative`, or of `above_negative`, within the band; width > 0.
   pure real(wp) function negative_curvature(is_above, a, width) result(curvature)
      logical, intent(in) :: is_above
      real(wp), intent(in) :: a, width

      associate (square => (a/width)**2)
         if (is_above) then
            curvature = -1.875_wp*(1.0_wp - square)*(1.0_wp - 3.0_wp*square)/width
         else
            curvature = 0.75_wp*(square - 1.0_wp)/width
         end if
      end associate
   end function negative_curvature

   !> min(a, 0), rounded to above; with t = a/width, width t (1 - t)^3 (8 + 9 t + 3 t^2)/16 where
   !> |t| < 1.
   elemental real(wp) function above_negative(a, width)
      real(wp), intent(in) :: a, width

      above_negative = min(a, 0.0_wp)
      if (.not. abs(a) < width) return
      associate (t => a/width)
         above_negative = a*((1.0_wp - t)**3*(8.0_wp + t*(9.0_wp + 3.0_wp*t))/16.0_wp)
      end associate
   end function above_negative

   !> Slope of `above_negative`, width > 0.
   elemental real(wp) function above_negative_slope(a, width)
      real(wp), intent(in) :: a, width

      associate (t => max(-1.0_wp, min(1.0_wp, a/width)))
         above_negative_slope = 0.125_wp*(1.0_wp - t)**2 &
            *(4.0_wp - t*(7.0_wp + t*(18.0_wp + 9.0_wp*t)))
      end associate
   end function above_negative_slope

   !> `a` held within 0..1, both corners rounded; width < 1/2.
   elemental real(wp) function rounded_clip(a, width)
      real(wp), intent(in) :: a, width

      if (a < 0.5_wp) then
         rounded_clip = rounded_part(a, width)
      else
         rounded_clip = 1.0_wp - rounded_part(1.0_wp - a, width)
      end if
   end function rounded_clip

   !> Slope of `rounded_clip`, width > 0.
   elemental real(wp) function rounded_clip_slope(a, width)
      real(wp), intent(in) :: a, width

      rounded_clip_slope = rounded_part_slope(min(a, 1.0_wp - a), width)
   end function rounded_clip_slope

end module emcon_rounded
