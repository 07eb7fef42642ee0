!> Functions of one variable that keep their relative accuracy near zero.
!>
!> Fortran has no log1p and no expm1; these hold for every kind of `wp`.
module emcon_dgrad_series
   use emcon_kinds, only : wp
   implicit none
   private
   public :: atanh_excess, log1p_of, log1p_excess, expm1_of, sinh_ratio

   !> Below this the power series is used; 1/4 costs at most 14 terms in double precision.
   real(wp), parameter :: series_limit = 0.25_wp

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

end module emcon_dgrad_series
