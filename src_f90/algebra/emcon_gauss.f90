!> Gauss-Legendre quadrature on 0..1.
module emcon_gauss
   use emcon_kinds, only : wp
   implicit none
   private
   public :: gauss_points

   !> Newton's method on a Legendre polynomial is through after far fewer iterations.
   integer, parameter :: most_iterations = 100

contains

   !> Points (ascending) and weights of the rule with `size(point)` points, exact for polynomials
   !> up to degree 2 n - 1.
   pure subroutine gauss_points(point, weight)
      real(wp), intent(out) :: point(:), weight(:)       !! (n)
      real(wp), parameter :: pi = acos(-1.0_wp)
      real(wp) :: x, value, slope, change
      integer :: i, k, n

      n = size(point)
      do i = 1, n
         x = -cos(pi*(real(i, wp) - 0.25_wp)/(real(n, wp) + 0.5_wp))
         do k = 1, most_iterations
            call legendre(n, x, value, slope)
            change = value/slope
            x = x - change
            if (abs(change) <= epsilon(x)) exit
         end do
         call legendre(n, x, value, slope)
         point(i) = 0.5_wp*(1.0_wp + x)
         weight(i) = 1.0_wp/((1.0_wp - x*x)*slope**2)
      end do
   end subroutine gauss_points

   !> Legendre polynomial of degree `n` at `x`, -1 < x < 1, and its slope.
   pure subroutine legendre(n, x, value, slope)
      integer, intent(in) :: n
      real(wp), intent(in) :: x
      real(wp), intent(out) :: value, slope
      real(wp) :: last, next
      integer :: k

      last = 1.0_wp
      value = x
      do k = 2, n
         next = (real(2*k - 1, wp)*x*value - real(k - 1, wp)*last)/real(k, wp)
         last = value
         value = next
      end do
      slope = real(n, wp)*(x*value - last)/(x*x - 1.0_wp)
   end subroutine legendre

end module emcon_gauss
