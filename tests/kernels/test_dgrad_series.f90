!> Functions of one variable near zero, against power series and quadruple precision.
module test_dgrad_series
   use check, only : check_near, check_true, test_case_t
   use emcon_dgrad_series, only : atanh_excess, cosh_chord, exp_excess, expm1_of, log1p_excess, &
      log1p_of, sinh_excess, sinh_ratio
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   use referee, only : qp
   implicit none
   private
   public :: collect_dgrad_series

   !> A few roundings, each amplified at most four times.
   real(wp), parameter :: tol = 16.0_wp*epsilon(1.0_wp)
   !> Below it the referee sums a power series: 1 - 1 costs it digits, too. Terms until the first
   !> one left out, 2^(-2 n_term), is below epsilon of any kind.
   real(qp), parameter :: small = 0.25_qp
   integer, parameter :: n_term = 60
   !> Arguments +-10^-k, k up to this, whose squares are still normal numbers.
   integer, parameter :: most_digits = int(0.5_wp*range(1.0_wp)) - 3
   integer, parameter :: n_argument = 1334 + 2*most_digits

contains

   subroutine collect_dgrad_series(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("ln(1 + a)", test_log1p), &
         test_case_t("a - ln(1 + a)", test_excess), &
         test_case_t("exp(a) - 1", test_expm1), &
         test_case_t("atanh(w)/w - 1", test_atanh), &
         test_case_t("sinh(x)/x", test_sinh), &
         test_case_t("exp(a) - 1 - a and sinh(x)/x - 1", test_excesses), &
         test_case_t("smallest and largest arguments", test_ends), &
         test_case_t("divided difference of cosh(k q)", test_cosh_chord)]
   end subroutine collect_dgrad_series

   !> In c = cosh q: cosh 2q = 2 c^2 - 1 and cosh 3q = 4 c^3 - 3 c, so that the difference is
   !> 2 (c0 + c1) or 4 (c0^2 + c0 c1 + c1^2) - 3, and its derivative by c1 2 or 4 (c0 + 2 c1).
   subroutine test_cosh_chord(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: c0, c1, slope, rate, third(2)
      integer :: i, j

      do i = 0, 60
         do j = 0, 60
            c0 = cosh(0.01_wp*real(i, wp))
            c1 = cosh(0.01_wp*real(j, wp))
            call cosh_chord(2.0_wp, c0 - 1.0_wp, c1 - 1.0_wp, slope, rate)
            call check_near(error, [slope, rate], [2.0_wp*(c0 + c1), 2.0_wp], tol, 8.0_wp, &
               "k = 2, " // to_text(c0) // " to " // to_text(c1))
            call cosh_chord(3.0_wp, c0 - 1.0_wp, c1 - 1.0_wp, slope, rate)
            third = [4.0_wp*(c0*c0 + c0*c1 + c1*c1) - 3.0_wp, 4.0_wp*(c0 + 2.0_wp*c1)]
            call check_near(error, [slope, rate], third, tol, 24.0_wp, &
               "k = 3, " // to_text(c0) // " to " // to_text(c1))
         end do
      end do
   end subroutine test_cosh_chord

   !> +-10^-k, and between -0.999 and 3 in small steps, so that no seam of a series is missed.
   pure function arguments() result(list)
      real(wp) :: list(n_argument)
      integer :: k

      list(:1334) = [(-0.999_wp + 0.003_wp*real(k, wp), k = 0, 1333)]
      list(1335:1334 + most_digits) = [(10.0_wp**(-k), k = 1, most_digits)]
      list(1335 + most_digits:) = -list(1335:1334 + most_digits)
   end function arguments

   !> The terms of ln(1 + a) from a^first on.
   pure real(qp) function log_series(a, first)
      real(qp), intent(in) :: a
      integer, intent(in) :: first
      integer :: k

      log_series = 0.0_qp
      do k = first + n_term, first, -1
         log_series = log_series - (-a)**k/real(k, qp)
      end do
   end function log_series

   subroutine test_log1p(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: a(n_argument)
      real(qp) :: expected
      integer :: k

      a = arguments()
      do k = 1, size(a)
         expected = log(1.0_qp + real(a(k), qp))
         if (abs(a(k)) < small) expected = log_series(real(a(k), qp), 1)
         call check_near(error, log1p_of(a(k)), real(expected, wp), tol, abs(real(expected, wp)), &
            "at " // to_text(a(k)))
      end do
   end subroutine test_log1p

   subroutine test_excess(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: a(n_argument)
      real(qp) :: expected
      integer :: k

      a = arguments()
      do k = 1, size(a)
         expected = real(a(k), qp) - log(1.0_qp + real(a(k), qp))
         if (abs(a(k)) < small) expected = -log_series(real(a(k), qp), 2)
         call check_near(error, log1p_excess(a(k)), real(expected, wp), tol, real(expected, wp), &
            "at " // to_text(a(k)))
      end do
   end subroutine test_excess

   subroutine test_expm1(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: a(n_argument)
      real(qp) :: expected, x
      integer :: k, i

      a = arguments()
      do k = 1, size(a)
         x = real(a(k), qp)
         expected = exp(x) - 1.0_qp
         if (abs(x) < small) then
            expected = 1.0_qp
            do i = n_term, 2, -1
               expected = 1.0_qp + expected*x/real(i, qp)
            end do
            expected = expected*x
         end if
         call check_near(error, expm1_of(a(k)), real(expected, wp), tol, abs(real(expected, wp)), &
            "at " // to_text(a(k)))
      end do
   end subroutine test_expm1

   !> Relative for the small arguments of small steps; beyond a quarter 1 has been subtracted.
   subroutine test_atanh(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: w(n_argument)
      real(wp) :: excess, rate, scale
      real(qp) :: expected, expected_rate, x
      integer :: k, i

      w = arguments()
      do k = 1, size(w)
         if (abs(w(k)) > 0.9_wp) cycle
         x = real(w(k), qp)
         if (abs(x) < 0.25_qp) then
            expected = 0.0_qp
            expected_rate = 0.0_qp
            do i = 30, 1, -1
               expected = expected + x**(2*i)/real(2*i + 1, qp)
               expected_rate = expected_rate + x**(2*i - 1)*real(2*i, qp)/real(2*i + 1, qp)
            end do
            scale = 0.0_wp
         else
            expected = atanh(x)/x - 1.0_qp
            expected_rate = (1.0_qp/(1.0_qp - x*x) - atanh(x)/x)/x
            scale = 1.0_wp
         end if
         call atanh_excess(w(k), excess, rate)
         call check_near(error, excess, real(expected, wp), tol, scale + real(expected, wp), &
            "excess at " // to_text(w(k)))
         call check_near(error, rate, real(expected_rate, wp), tol, &
            scale + abs(real(expected_rate, wp)), "rate at " // to_text(w(k)))
      end do
   end subroutine test_atanh

   subroutine test_sinh(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: list(n_argument)
      real(wp) :: ratio, rate
      real(qp) :: expected, expected_rate, x
      integer :: k, i

      list = arguments()
      do k = 1, size(list)
         x = real(list(k), qp)
         expected = 1.0_qp
         expected_rate = 0.0_qp
         do i = 24, 1, -1                        ! 3^48/49! is below epsilon of any kind
            expected = 1.0_qp + expected*x*x/real(2*i*(2*i + 1), qp)
         end do
         do i = 24, 1, -1
            expected_rate = expected_rate + real(2*i, qp)*x**(2*i - 1)/gamma(real(2*i + 2, qp))
         end do
         call sinh_ratio(list(k), ratio, rate)
         call check_near(error, ratio, real(expected, wp), tol, real(expected, wp), &
            "ratio at " // to_text(list(k)))
         call check_near(error, rate, real(expected_rate, wp), tol, &
            abs(real(expected_rate, wp)), "rate at " // to_text(list(k)))
      end do
   end subroutine test_sinh

   !> By power series all through: where 1 is subtracted they are larger than a sixth.
   subroutine test_excesses(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: list(n_argument)
      real(qp) :: expected, x
      integer :: k, i

      list = arguments()
      do k = 1, size(list)
         x = real(list(k), qp)
         expected = 1.0_qp
         do i = n_term, 3, -1
            expected = 1.0_qp + expected*x/real(i, qp)
         end do
         expected = 0.5_qp*x*x*expected
         call check_near(error, exp_excess(list(k)), real(expected, wp), tol, real(expected, wp), &
            "exp at " // to_text(list(k)))
         expected = 1.0_qp
         do i = 24, 2, -1
            expected = 1.0_qp + expected*x*x/real(2*i*(2*i + 1), qp)
         end do
         expected = expected*x*x/6.0_qp
         call check_near(error, sinh_excess(list(k)), real(expected, wp), tol, &
            real(expected, wp), "sinh at " // to_text(list(k)))
      end do
   end subroutine test_excesses

   !> Where squares underflow the first term is the function.
   subroutine test_ends(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: a = 1024.0_wp*tiny(1.0_wp)
      real(wp) :: value, rate

      call check_near(error, log1p_of(a), a, tol, a, "ln(1 + a)")
      call check_near(error, expm1_of(-a), -a, tol, a, "exp(a) - 1")
      call check_near(error, log1p_excess(a), 0.0_wp, tol, a, "a - ln(1 + a)")
      call atanh_excess(a, value, rate)
      call check_near(error, [value, rate], [0.0_wp, 2.0_wp*a/3.0_wp], 1.0_wp, a, "atanh")
      call sinh_ratio(a, value, rate)
      call check_near(error, [value, rate], [1.0_wp, a/3.0_wp], 0.0_wp, 1.0_wp + rate, "sinh")
      call atanh_excess(1.0_wp, value, rate)     ! rounded from a ratio above 1/epsilon
      call check_true(error, value > 1.0_wp .and. value < huge(value) .and. rate < huge(rate), &
         "atanh(w)/w is finite where w is rounded to 1")
      call atanh_excess(0.0_wp, value, rate)
      call check_true(error, .not. abs(value) + abs(rate) > 0.0_wp, "atanh(w)/w - 1 is 0 at 0")
   end subroutine test_ends

end module test_dgrad_series
