!> Stress of a plane deformation in the deformed configuration.
module emcon_push_forward_plane
   use emcon_kinds, only : wp
   implicit none
   private
   public :: push_forward

contains

   !> Cauchy stress F S F^T/det F.
   pure subroutine push_forward(f, s, s33, stress)
      real(wp), intent(in) :: f(2, 2)            !! deformation gradient, det F > 0
      !> Second Piola-Kirchhoff stress: 11, 22, 12; 33 [M/(L T^2)].
      real(wp), intent(in) :: s(3), s33
      real(wp), intent(out) :: stress(6)         !! xx, yy, zz, xy, yz, xz [M/(L T^2)]
      real(wp) :: a(2, 2), det

      det = f(1, 1)*f(2, 2) - f(1, 2)*f(2, 1)
      a(:, 1) = f(:, 1)*s(1) + f(:, 2)*s(3)
      a(:, 2) = f(:, 1)*s(3) + f(:, 2)*s(2)
      stress(1) = (a(1, 1)*f(1, 1) + a(1, 2)*f(1, 2))/det
      stress(2) = (a(2, 1)*f(2, 1) + a(2, 2)*f(2, 2))/det
      stress(3) = s33/det
      stress(4) = (a(1, 1)*f(2, 1) + a(1, 2)*f(2, 2))/det
      stress(5:) = 0.0_wp
   end subroutine push_forward

end module emcon_push_forward_plane
