!> Rotations in space by rotation vectors: along the axis, as long as the angle.
module emcon_turn_space
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   implicit none
   private
   public :: turn_arm_space

   !> Below this square of an angle its functions are series.
   real(wp), parameter :: small = 0.1_wp
   !> Of these series: the last one is below the rounding of quadruple precision.
   integer, parameter :: n_terms = 14
   integer, parameter :: n_dim = 3

contains

   !> How the end of `arm` moves as it turns by `angle`, and its velocity where that has a rate.
   !> 1 - cos is computed as 2 sin^2 of half the angle.
   pure subroutine turn_arm_space(arm, angle, rate, w, v)
      real(wp), intent(in) :: arm(n_dim)         !! [L]
      real(wp), intent(in) :: angle(n_dim)       !! rotation vector, radians
      real(wp), intent(in) :: rate(n_dim)        !! of that [1/T]
      real(wp), intent(out) :: w(n_dim)          !! [L]
      real(wp), intent(out) :: v(n_dim)          !! [L/T]
      real(wp) :: square, sine, cosine, cubic, across(n_dim), spin(n_dim)

      square = dot_product(angle, angle)
      call functions_of(square, sine, cosine, cubic)
      across = cross_product(angle, arm)
      w = sine*across + cosine*cross_product(angle, across)
      across = cross_product(angle, rate)
      spin = rate + cosine*across + cubic*cross_product(angle, across)
      v = cross_product(spin, arm + w)
   end subroutine turn_arm_space

   !> sin a/a, (1 - cos a)/a^2 and (a - sin a)/a^3 by the square of a.
   pure subroutine functions_of(square, sine, cosine, cubic)
      real(wp), intent(in) :: square
      real(wp), intent(out) :: sine, cosine, cubic
      integer :: k
      real(wp) :: a

      if (square > small) then
         a = sqrt(square)
         sine = sin(a)/a
         cosine = 0.5_wp*(sin(0.5_wp*a)/(0.5_wp*a))**2
         cubic = (1.0_wp - sine)/square
         return
      end if
      sine = 1.0_wp
      cosine = 1.0_wp
      cubic = 1.0_wp
      do k = n_terms, 1, -1
         sine = 1.0_wp - square/(2*k*(2*k + 1))*sine
         cosine = 1.0_wp - square/((2*k + 1)*(2*k + 2))*cosine
         cubic = 1.0_wp - square/((2*k + 2)*(2*k + 3))*cubic
      end do
      cosine = cosine/2.0_wp
      cubic = cubic/6.0_wp
   end subroutine functions_of

end module emcon_turn_space
