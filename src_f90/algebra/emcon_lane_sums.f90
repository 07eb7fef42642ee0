! build: streams
!> Sums of products over vectors by eight partial sums side by side, and the size of a vector beside
!> that of another one.
!>
!> The order of the sums is fixed: the bits do not depend on how many numbers a machine adds at
!> once.
module emcon_lane_sums
   use emcon_kinds, only : wp
   implicit none
   private
   public :: lane_dot, yardstick_t, yardstick_of, yardstick_size, relative_size

   integer, parameter :: n_sum = 8               !! partial sums
   !> What is larger than its yardstick by so many powers of two is not measured any more: its
   !> square may not be a number.
   integer, parameter :: far = int(0.3_wp*maxexponent(1.0_wp))

   !> What sizes of vectors are measured by.
   type :: yardstick_t
      private
      real(wp) :: per_unit = 1.0_wp              !! a power of two
      real(wp) :: square = 0.0_wp                !! sum of squares in these units
   end type yardstick_t

contains

   !> a.b
   pure real(wp) function lane_dot(a, b)
      real(wp), intent(in), contiguous :: a(:), b(:)   !! of one size
      real(wp) :: part(n_sum)
      integer :: i, k, n

      part = 0.0_wp
      n = size(a) - modulo(size(a), n_sum)
      do i = 0, n - n_sum, n_sum
         do k = 1, n_sum
            part(k) = part(k) + a(i + k)*b(i + k)
         end do
      end do
      do i = n + 1, size(a)
         part(i - n) = part(i - n) + a(i)*b(i)
      end do
      lane_dot = sum_of(part)
   end function lane_dot

   !> The sum of the partial sums.
   pure real(wp) function sum_of(part)
      real(wp), intent(in) :: part(n_sum)

      sum_of = sum(part(:n_sum/2) + part(n_sum/2 + 1:))
   end function sum_of

   !> The size of `v` as a yardstick.
   pure type(yardstick_t) function yardstick_of(v)
      real(wp), intent(in), contiguous :: v(:)         !! >= 0
      integer :: power

      yardstick_of%square = 0.0_wp
      if (any(v /= v)) return
      power = min(max(exponent(largest(v)) - 1, minexponent(v)), maxexponent(v) - 1)
      yardstick_of%per_unit = scale(1.0_wp, -power)
      if (largest(v) <= huge(v)) yardstick_of%square = sum_of_squares(v, yardstick_of%per_unit)
   end function yardstick_of

   !> The size itself, at most the largest number; 0 where it is not known.
   pure real(wp) function yardstick_size(yardstick)
      type(yardstick_t), intent(in) :: yardstick

      associate (per_unit => yardstick%per_unit)
         yardstick_size = min(sqrt(yardstick%square), huge(per_unit)*min(per_unit, 1.0_wp))/per_unit
      end associate
   end function yardstick_size

   !> |v| beside the yardstick's: 0 where v vanishes, huge where it is not finite or out of all
   !> proportion, or where there is nothing to compare it with.
   pure real(wp) function relative_size(v, yardstick)
      real(wp), intent(in), contiguous :: v(:)
      type(yardstick_t), intent(in) :: yardstick
      real(wp) :: square

      relative_size = huge(relative_size)
      if (any(v /= v)) return
      if (largest(v)*scale(yardstick%per_unit, -far) > 1.0_wp) return
      square = sum_of_squares(v, yardstick%per_unit)
      if (yardstick%square > 0.0_wp) relative_size = sqrt(square/yardstick%square)
      if (square <= 0.0_wp) relative_size = 0.0_wp
   end function relative_size

   !> The largest |v|.
   pure real(wp) function largest(v)
      real(wp), intent(in), contiguous :: v(:)
      real(wp) :: part(n_sum)
      integer :: i, k, n

      part = 0.0_wp
      n = size(v) - modulo(size(v), n_sum)
      do i = 0, n - n_sum, n_sum
         do k = 1, n_sum
            part(k) = max(part(k), abs(v(i + k)))
         end do
      end do
      largest = max(maxval(part), maxval(abs(v(n + 1:))))
   end function largest

   !> |factor v|^2
   pure real(wp) function sum_of_squares(v, factor)
      real(wp), intent(in), contiguous :: v(:)
      real(wp), intent(in) :: factor
      real(wp) :: part(n_sum)
      integer :: i, k, n

      part = 0.0_wp
      n = size(v) - modulo(size(v), n_sum)
      do i = 0, n - n_sum, n_sum
         do k = 1, n_sum
            part(k) = part(k) + (factor*v(i + k))*(factor*v(i + k))
         end do
      end do
      do i = n + 1, size(v)
         part(i - n) = part(i - n) + (factor*v(i))*(factor*v(i))
      end do
      sum_of_squares = sum_of(part)
   end function sum_of_squares

end module emcon_lane_sums
