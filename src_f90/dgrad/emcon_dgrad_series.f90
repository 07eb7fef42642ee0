!> Functions of one variable that keep their relative accuracy near zero.
!>
!> Fortran has no log1p and no expm1; these hold for every kind of `wp`.
module emcon_dgrad_series
   use emcon_kinds, only : wp
   implicit none
   private
   public :: atanh_excess, log1p_of, log1p_excess, exp_of, expm1_of, exp_excess, sinh_ratio
   public :: sinh_excess
   public :: cosh_excess, cosh_chord

   !> Below this the power series is used; 1/4 costs at most 14 terms in double precision.
   real(wp), parameter :: series_limit = 0.25_wp
   !> Below this coth x - 1/x by odd powers of x, as many as quadruple precision takes. With
   !> x coth x = 1 + sum a_n x^(2 n): (2 n + 1) a_n = [n = 1] - sum of a_i a_(n - i), 0 < i < n.
   real(wp), parameter :: coth_limit = 1.0_wp
   real(wp), parameter :: coth_series(36) = [ &
      3.33333333333333333333333333333333333e-1_wp, -2.22222222222222222222222222222222222e-2_wp, &
      2.11640211640211640211640211640211640e-3_wp, -2.11640211640211640211640211640211640e-4_wp, &
      2.13777991555769333547111324889102667e-5_wp, -2.16440428080639720851361063001274641e-6_wp, &
      2.19259478518737777997037256296515556e-7_wp, -2.22146087899796790760583685160923464e-8_wp, &
      2.25078465168089928542084279839637560e-9_wp, -2.28051512045921828658638112567162873e-10_wp, &
      2.31064325990026240965325466481291632e-11_wp, -2.34117068198248839592094445312427212e-12_wp, &
      2.37210174002336542950284820301158180e-13_wp, -2.40344153333077061790918875276835470e-14_wp, &
      2.43519540291833687311218225352645232e-15_wp, -2.46736880451720747058996032267756213e-16_wp, &
      2.49996727712208089798954278824165610e-17_wp, -2.53299643574063483151787015907095574e-18_wp, &
      2.56646197028262866112248769462595426e-19_wp, -2.60036964601372735885625685250534225e-20_wp, &
      2.63472530441538013417410807260829745e-21_wp, -2.66953486415739495345488831615228825e-22_wp, &
      2.70480432210903099042259283034509318e-23_wp, -2.74053975436995134482617571751325756e-24_wp, &
      2.77674731731644348411464069837640529e-25_wp, -2.81343324866187935418649618115667206e-26_wp, &
      2.85060386853129178748946579779104056e-27_wp, -2.88826558055017480583487737922187991e-28_wp, &
      2.92642487294767575486724335496866722e-29_wp, -2.96508831967436434999174002885573250e-30_wp, &
      3.00426258153476993912663913010851260e-31_wp, -3.04395440733488177270925477484422003e-32_wp, &
      3.08417063504480988747762173743200042e-33_wp, -3.12491819297680688273490904234837182e-34_wp, &
      3.16620410097885352941595693637011871e-35_wp, -3.20803547164401383743174928465003316e-36_wp]

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

   !> exp(a)
   elemental real(wp) function exp_of(a)
      real(wp), intent(in) :: a

      exp_of = exp(a)
   end function exp_of

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

   !> exp(a) - 1 - a, to relative accuracy.
   elemental real(wp) function exp_excess(a)
      real(wp), intent(in) :: a
      real(wp) :: term
      integer :: k

      if (abs(a) >= 1.0_wp) then
         exp_excess = (exp(a) - 1.0_wp) - a
         return
      end if
      term = 0.5_wp*a*a
      exp_excess = term
      do k = 3, 40
         term = term*a/real(k, wp)
         exp_excess = exp_excess + term
         if (abs(term) <= 0.01_wp*epsilon(a)*exp_excess) exit
      end do
   end function exp_excess

   !> sinh(x)/x - 1, to relative accuracy.
   elemental real(wp) function sinh_excess(x)
      real(wp), intent(in) :: x
      real(wp) :: square, term
      integer :: k

      if (abs(x) >= 1.0_wp) then
         sinh_excess = sinh(x)/x - 1.0_wp
         return
      end if
      square = x*x
      term = square/6.0_wp
      sinh_excess = term
      do k = 2, 40
         term = term*square/real(2*k*(2*k + 1), wp)
         sinh_excess = sinh_excess + term
         if (term <= 0.01_wp*epsilon(x)*sinh_excess) exit
      end do
   end function sinh_excess

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
      real(wp) :: power, last, difference, term
      integer :: i

      chord = 0.0_wp
      power = 1.0_wp
      last = 1.0_wp                              ! b^(2i - 2)
      difference = 1.0_wp                        ! of x^(2i - 1) between a and b
      do i = 1, size(coth_series)
         power = power*k*k
         term = coth_series(i)*(power - 1.0_wp)*difference
         chord = chord + term
         if (abs(term) <= 0.01_wp*epsilon(a)*abs(chord)) exit
         difference = a*(a*difference + last*b) + last*b*b
         last = last*b*b
      end do
   end function coth_chord

end module emcon_dgrad_series
