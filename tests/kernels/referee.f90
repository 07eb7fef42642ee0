!> Quadruple precision as the referee of working precision.
module referee
   use, intrinsic :: iso_fortran_env, only : qp => real128
   use emcon_kinds, only : wp
   implicit none
   private
   public :: qp, function_of_three, increment_of, slopes_of, increment_doubt, slope_doubt

   abstract interface
      !> One of several functions of three variables.
      pure function function_of_three(which, x) result(f)
         import :: qp
         integer, intent(in) :: which
         real(qp), intent(in) :: x(3)
         real(qp) :: f
      end function function_of_three
   end interface

   !> Below it the increment is taken from the slope: f(x + dx) - f(x) would cancel. The slope at
   !> the middle has an error of the order of its square, far below `epsilon` of `wp`.
   real(qp), parameter :: small = 1.0e-10_qp

   !> Where `wp` is the referee's own kind its rounding counts. That of an increment: a part of
   !> `epsilon` of the function itself, to be added to the scale. That of a slope: third derivatives
   !> up to 600 times `small`^2/6, to be added to a relative tolerance.
   logical, parameter :: is_own = precision(1.0_wp) == precision(1.0_qp)
   real(wp), parameter :: increment_doubt = merge(1.0_wp, 0.0_wp, is_own)
   real(wp), parameter :: slope_doubt = merge(real(100.0_qp*small**2, wp), 0.0_wp, is_own)

contains

   !> f(x0 + dx) - f(x0) to the relative accuracy of `wp`, however small `dx` is.
   pure function increment_of(f, which, x0, dx) result(df)
      procedure(function_of_three) :: f
      integer, intent(in) :: which
      real(wp), intent(in) :: x0(3), dx(3)
      real(wp) :: df
      real(qp) :: step, way(3), middle(3)

      step = real(maxval(abs(dx)), qp)
      if (step >= small .or. is_own) then
         df = real(f(which, real(x0, qp) + real(dx, qp)) - f(which, real(x0, qp)), wp)
      else
         way = real(dx, qp)/step
         middle = real(x0, qp) + 0.5_qp*real(dx, qp)
         df = real((f(which, middle + small*way) - f(which, middle - small*way))/(2.0_qp*small) &
            *step, wp)
      end if
   end function increment_of

   !> Gradient of f at x.
   pure function slopes_of(f, which, x) result(slope)
      procedure(function_of_three) :: f
      integer, intent(in) :: which
      real(wp), intent(in) :: x(3)
      real(wp) :: slope(3)
      real(qp) :: way(3)
      integer :: i

      do i = 1, 3
         way = 0.0_qp
         way(i) = small
         slope(i) = real((f(which, real(x, qp) + way) - f(which, real(x, qp) - way)) &
            /(2.0_qp*small), wp)
      end do
   end function slopes_of

end module referee
