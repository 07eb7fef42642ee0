!> The functions near 0 of loops over points: against power series in quadruple precision.
module test_dgrad_near
   use, intrinsic :: ieee_arithmetic, only : ieee_is_nan
   use check, only : check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   use referee, only : qp
   implicit none
   private
   public :: collect_dgrad_near

   !> Two roundings at the end of a sum, and a few of terms that are at most 1/3 of it.
   real(wp), parameter :: tol = 4.0_wp*epsilon(1.0_wp)
   integer, parameter :: n = 401

contains

   subroutine collect_dgrad_near(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("atanh(w)/w - 1", test_atanh), &
         test_case_t("logarithms", test_logarithms), &
         test_case_t("exp(a) - 1 and sinh(x)/x", test_exponentials), &
         test_case_t("beyond the reach: not a number", test_reach)]
   end subroutine collect_dgrad_near

   !> From -reach to reach, 0 among them, and down to 1e-30 at every third place.
   pure real(wp) function argument(i, reach)
      integer, intent(in) :: i                   !! 1..n
      real(wp), intent(in) :: reach

      argument = reach*(real(2*i, wp) - real(n + 1, wp))/real(n - 1, wp)
      if (mod(i, 3) == 0) argument = argument*10.0_wp**(-mod(i, 31))
   end function argument

   subroutine test_atanh(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: w, excess, rate
      real(qp) :: expected(2)
      integer :: i, k

      do i = 1, n
         w = argument(i, 0.25_wp)
         expected = 0.0_qp
         do k = 60, 1, -1
            expected(1) = expected(1) + real(w, qp)**(2*k)/real(2*k + 1, qp)
            expected(2) = expected(2) + real(2*k, qp)*real(w, qp)**(2*k - 1)/real(2*k + 1, qp)
         end do
         call atanh_excess(w, excess, rate)
         call check_near(error, excess, real(expected(1), wp), tol, real(expected(1), wp), &
            "w = " // to_text(w))
         call check_near(error, rate, real(expected(2), wp), tol, abs(real(expected(2), wp)), &
            "slope at w = " // to_text(w))
      end do
   end subroutine test_atanh

   subroutine test_logarithms(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: a
      real(qp) :: expected
      integer :: i, k

      do i = 1, n
         a = argument(i, 0.4_wp)
         expected = 0.0_qp
         do k = 120, 2, -1
            expected = expected + (-real(a, qp))**k/real(k, qp)
         end do
         call check_near(error, log1p_excess(a), real(expected, wp), 2.0_wp*tol, &
            real(expected, wp), "a - ln(1 + a), a = " // to_text(a))
         call check_near(error, log1p_of(a), real(real(a, qp) - expected, wp), tol, abs(a), &
            "ln(1 + a), a = " // to_text(a))
      end do
   end subroutine test_logarithms

   subroutine test_exponentials(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: a, ratio, rate
      real(qp) :: expected(3), term
      integer :: i, k

      do i = 1, n
         a = argument(i, 0.5_wp)
         expected = 0.0_qp
         term = 1.0_qp
         do k = 1, 40
            term = term*real(a, qp)/real(k, qp)
            expected(1) = expected(1) + term
            if (mod(k, 2) == 1 .or. abs(a) <= 0.0_wp) cycle
            expected(2) = expected(2) + term/real(k + 1, qp)
            expected(3) = expected(3) + term*real(k, qp)/real(k + 1, qp)/real(a, qp)
         end do
         call sinh_ratio(a, ratio, rate)
         expected(1) = 1.0_qp                    ! small terms first
         do k = 40, 2, -1
            expected(1) = 1.0_qp + expected(1)*real(a, qp)/real(k, qp)
         end do
         expected(1) = expected(1)*real(a, qp)
         call check_near(error, expm1_of(a), real(expected(1), wp), tol, abs(a), "exp(a) - 1")
         call check_near(error, exp_of(a), real(1.0_qp + expected(1), wp), tol, 1.0_wp, "exp(a)")
         call check_near(error, ratio, real(1.0_qp + expected(2), wp), tol, 1.0_wp, "sinh(a)/a")
         call check_near(error, rate, real(expected(3), wp), tol, abs(a), "slope of sinh(a)/a")
      end do
   end subroutine test_exponentials

   subroutine test_reach(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: above = 1.0_wp + 2.0_wp*epsilon(1.0_wp)
      real(wp) :: value(2), sign_of, lost
      integer :: i

      do i = -1, 1, 2
         sign_of = real(i, wp)
         call atanh_excess(0.25_wp*sign_of*above, value(1), value(2))
         call check_true(error, all(ieee_is_nan(value)), "atanh")
         lost = value(1)
         call atanh_excess(0.25_wp*sign_of, value(1), value(2))
         call check_true(error, .not. any(ieee_is_nan(value)), "atanh within")
         call sinh_ratio(0.5_wp*sign_of*above, value(1), value(2))
         call check_true(error, all(ieee_is_nan(value)), "sinh")
         call check_true(error, ieee_is_nan(expm1_of(0.5_wp*sign_of*above)), "exp")
         call check_true(error, .not. ieee_is_nan(expm1_of(0.5_wp*sign_of)), "exp within")
         call check_true(error, ieee_is_nan(log1p_of(0.7_wp*sign_of)), "log")
         call check_true(error, ieee_is_nan(log1p_excess(0.7_wp*sign_of)), "excess of log")
         call check_true(error, ieee_is_nan(expm1_of(lost)), "what is none stays none")
         call check_true(error, ieee_is_nan(expm1_of(sign_of*huge(1.0_wp))), "largest number")
      end do
   end subroutine test_reach

   include "../../src_f90/dgrad/emcon_dgrad_near.inc"

end module test_dgrad_near
