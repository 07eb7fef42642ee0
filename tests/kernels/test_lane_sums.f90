!> Sums by eight partial sums, and sizes of vectors beside others, at the ends of the range.
module test_lane_sums
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_lane_sums, only : lane_dot, relative_size, yardstick_of, yardstick_size
   implicit none
   private
   public :: collect_lane_sums

contains

   subroutine collect_lane_sums(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("products of all lengths", test_lengths), &
         test_case_t("sizes do not depend on the unit", test_units), &
         test_case_t("nothing, and what is no number", test_odd)]
   end subroutine collect_lane_sums

   !> Whole numbers: exact, whatever the order.
   subroutine test_lengths(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: a(35), b(35)
      integer :: i, n

      a = [(real(i, wp), i = 1, 35)]
      b = [(real(3*modulo(i, 7) - 8, wp), i = 1, 35)]
      do n = 0, size(a)
         call check_equal(error, nint(lane_dot(a(:n), b(:n))), &
            sum([(i*(3*modulo(i, 7) - 8), i = 1, n)]), "a.b")
      end do
   end subroutine test_lengths

   !> Powers of two over the whole range keep the bits.
   subroutine test_units(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: v(19), yard(19), expected, unit
      integer :: i, k

      v = [(0.1_wp*i - 0.7_wp, i = 1, 19)]
      yard = [(1.0_wp + 0.3_wp*i, i = 1, 19)]
      expected = norm2(v)/norm2(yard)
      call check_near(error, relative_size(v, yardstick_of(yard)), expected, &
         32.0_wp*epsilon(1.0_wp), 1.0_wp, "size")
      expected = relative_size(v, yardstick_of(yard))
      do k = minexponent(1.0_wp) + 8, maxexponent(1.0_wp) - 8, 50
         unit = scale(1.0_wp, k)
         call check_near(error, relative_size(unit*v, yardstick_of(unit*yard)), expected, 0.0_wp, &
            1.0_wp, "in other units")
         call check_near(error, yardstick_size(yardstick_of(unit*yard))/unit, norm2(yard), &
            32.0_wp*epsilon(1.0_wp), 1.0_wp, "the size itself")
      end do
   end subroutine test_units

   subroutine test_odd(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: none(9) = 0.0_wp
      real(wp) :: v(9), big(9)

      v = none
      v(4) = 1.0_wp
      big = huge(1.0_wp)
      call check_near(error, relative_size(none, yardstick_of(none)), 0.0_wp, 0.0_wp, 1.0_wp, &
         "nothing beside nothing")
      call check_true(error, relative_size(v, yardstick_of(none)) >= huge(1.0_wp), &
         "something beside nothing")
      call check_near(error, relative_size(big, yardstick_of(big)), 1.0_wp, &
         16.0_wp*epsilon(1.0_wp), 1.0_wp, "the largest numbers")
      call check_true(error, relative_size(big, yardstick_of(v)) >= huge(1.0_wp), "beyond")
      call check_true(error, yardstick_size(yardstick_of(big)) >= huge(1.0_wp), "the largest size")
      call check_near(error, yardstick_size(yardstick_of(none)), 0.0_wp, 0.0_wp, 1.0_wp, "no size")
      v(7) = ieee_value(v(7), ieee_quiet_nan)
      call check_true(error, relative_size(v, yardstick_of(big)) >= huge(1.0_wp), "no number")
   end subroutine test_odd

end module test_lane_sums
