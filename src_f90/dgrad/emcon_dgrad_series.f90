!> Functions of one variable that keep their relative accuracy near zero.
!>
!> Fortran has no log1p and no expm1; these hold for every kind of `wp`.
module emcon_dgrad_series
   use emcon_kinds, only : wp
   implicit none
   private
   public :: atanh_excess, log1p_of, log1p_excess, expm1_of, sinh_ratio
   public :: cosh_excess, cosh_chord

   !> Below this the power series is used; 1/4 costs at most 14 terms in double precision.
   real(wp), parameter :: series_limit = 0.25_wp
   !> coth x - 1/x by odd powers of x: to 2e-13 below the limit, which is for second derivatives.
   real(wp), parameter :: coth_limit = 0.5_wp
   real(wp), parameter :: coth_series(8) = [1.0_wp/3.0_wp, -1.0_wp/45.0_wp, 2.0_wp/945.0_wp, &
      -1.0_wp/4725.0_wp, 2.0_wp/93555.0_wp, -1382.0_wp/638512875.0_wp, 4.0_wp/18243225.0_wp, &
      -3617.0_wp/162820783125.0_wp]

contains

   !> atanh(w)/w - 1 and its derivative by w, |w| < 1.
   pure subroutine atanh_excess(w, excess, rate)
      real(wp), intent(in) :: w
      real(wp), intent(out) :: excess, rate
      real(wp) :: square, power, inside
      integer :: k

      excess = 0.0_wp
      rate = 0.0_wp
      if (abs(w) >= series_limit) then
         inside = sign(min(abs(w), 1.0_wp - epsilon(w)), w)   ! w may be rounded to 1
         excess = atanh(inside)/inside - 1.0_wp
         rate = (inside**2/(1.0_wp - inside**2) - excess)/inside
         return
      end if
      square = w*w
      power = square
      do k = 1, 40
         excess = excess + power/real(2*k + 1, wp)
         rate = rate + power*real(2*k, wp)/real(2*k + 1, wp)
         if (power <= epsilon(w)*excess) exit
         power = power*square
      end do
      if (abs(w) > tiny(w)) rate = rate/w
   end subroutine atanh_excess

   !> ln(1 + a)
   elemental real(wp) function log1p_of(a)
      real(wp), intent(in) :: a

      if (abs(a) > 0.5_wp) then
         log1p_of = log(1.0_wp + a)
      else
         log1p_of = 2.0_wp*atanh(a/(2.0_wp + a))
      end if
   end function log1p_of

   !> a - ln(1 + a) = a^2/(2 + a) - 2 w (atanh(w)/w - 1), w = a/(2 + a).
   pure real(wp) function log1p_excess(a)
      real(wp), intent(in) :: a
      real(wp) :: w, excess, rate

      if (a > 1.0_wp .or. a < -0.5_wp) then
         log1p_excess = a - log(1.0_wp + a)
      else
         w = a/(2.0_wp + a)
         call atanh_excess(w, excess, rate)
         log1p_excess = a*w - 2.0_wp*w*excess
      end if
   end function log1p_excess

   !> exp(a) - 1
   elemental real(wp) function expm1_of(a)
      real(wp), intent(in) :: a
      real(wp) :: t

      if (abs(a) > 1.0_wp) then
         expm1_of = exp(a) - 1.0_wp
      else
         t = tanh(0.5_wp*a)
         expm1_of = 2.0_wp*t/(1.0_wp - t)
      end if
   end function expm1_of

   !> sinh(x)/x and its derivative by x.
   pure subroutine sinh_ratio(x, ratio, rate)
      real(wp), intent(in) :: x
      real(wp), intent(out) :: ratio, rate
      real(wp) :: square, term
      integer :: k

      if (abs(x) >= 1.0_wp) then
         ratio = sinh(x)/x
         rate = (cosh(x) - ratio)/x
         return
      end if
      square = x*x
      term = 1.0_wp
      ratio = 1.0_wp
      rate = 0.0_wp
      do k = 1, 40
         rate = rate + term*x*real(2*k, wp)/real(2*k*(2*k + 1), wp)
         term = term*square/real(2*k*(2*k + 1), wp)
         ratio = ratio + term
         if (term <= 0.01_wp*epsilon(x)*ratio) exit
      end do
   end subroutine sinh_ratio

   !> acosh(1 + s); what is below 0 by rounding is taken for 0.
   pure real(wp) function acosh1p(s)
      real(wp), intent(in) :: s                  !! >= 0

      acosh1p = log1p_of(s + sqrt(max(s, 0.0_wp)*(2.0_wp + s)))
      if (s <= 0.0_wp) acosh1p = 0.0_wp
   end function acosh1p

   !> cosh(k acosh(1 + s)) - 1, an analytic function of s also at 0.
   pure real(wp) function cosh_excess(k, s)
      real(wp), intent(in) :: k, s               !! s >= 0

      cosh_excess = 2.0_wp*sinh(0.5_wp*k*acosh1p(s))**2
   end function cosh_excess

   !> Divided difference L of `cosh_excess` from `s0` to `s1` and its derivative by s1. With
   !> q = acosh(1 + s), p = (q1 + q0)/2, m = (q1 - q0)/2 and R(x) = sinh(k x)/sinh(x),
   !> L = R(p) R(m), as cosh b - cosh a = 2 sinh((b + a)/2) sinh((b - a)/2).
   pure subroutine cosh_chord(k, s0, s1, slope, rate)
      real(wp), intent(in) :: k, s0, s1          !! s0, s1 >= 0
      real(wp), intent(out) :: slope, rate
      real(wp) :: q0, q1, p, m

      q0 = acosh1p(s0)
      q1 = acosh1p(s1)
      p = 0.5_wp*(q1 + q0)
      m = 0.5_wp*(q1 - q0)
      slope = sinh_quotient(k, p)*sinh_quotient(k, m)
      rate = 0.5_wp*slope*chord_growth(abs(k), p, m)
   end subroutine cosh_chord

   !> sinh(k x)/sinh(x)
   pure real(wp) function sinh_quotient(k, x)
      real(wp), intent(in) :: k, x
      real(wp) :: upper, lower, unused

      call sinh_ratio(k*x, upper, unused)
      call sinh_ratio(x, lower, unused)
      sinh_quotient = k*upper/lower
   end function sinh_quotient

   !> (r(p) + r(m))/sinh(p + m), r(x) = k coth(k x) - coth(x): by the power series of coth near 0,
   !> and where p + m is small by r(p) + r(m) = k sinh(k (p + m))/(sinh(k p) sinh(k m)) - ....
   pure real(wp) function chord_growth(k, p, m) result(growth)
      real(wp), intent(in) :: k, p, m            !! p >= |m|
      real(wp) :: ratio, unused

      if (max(1.0_wp, k)*p < coth_limit) then
         call sinh_ratio(p + m, ratio, unused)
         growth = coth_chord(k, p, -m)/ratio
      else if (p + m < 0.5_wp*p) then
         growth = k*sinh_quotient(k, p + m)/(sinh(k*p)*sinh(k*m)) - 1.0_wp/(sinh(p)*sinh(m))
      else
         growth = (coth_difference(k, p) + coth_difference(k, m))/sinh(p + m)
      end if
   end function chord_growth

   !> k coth(k x) - coth(x)
   pure real(wp) function coth_difference(k, x)
      real(wp), intent(in) :: k, x

      if (max(1.0_wp, k)*abs(x) < coth_limit) then
         coth_difference = x*coth_chord(k, x, 0.0_wp)
      else
         coth_difference = k/tanh(k*x) - 1.0_wp/tanh(x)
      end if
   end function coth_difference

   !> Divided difference of k coth(k x) - coth(x) between a and b, by the power series.
   pure real(wp) function coth_chord(k, a, b) result(chord)
      real(wp), intent(in) :: k, a, b
      real(wp) :: power, last, difference
      integer :: i

      chord = 0.0_wp
      power = 1.0_wp
      last = 1.0_wp                              ! b^(2i - 2)
      difference = 1.0_wp                        ! of x^(2i - 1) between a and b
      do i = 1, size(coth_series)
         power = power*k*k
         chord = chord + coth_series(i)*(power - 1.0_wp)*difference
         difference = a*(a*difference + last*b) + last*b*b
         last = last*b*b
      end do
   end function coth_chord

end module emcon_dgrad_series
