!> Linear elasticity: W = lam/2 (tr E)^2 + mu E:E. Under NLGEOM this is St. Venant-Kirchhoff.
module emcon_law_linear
   use emcon_dgrad3, only : dg_t, operator(*), operator(-), operator(+)
   use emcon_kinds, only : wp
   use emcon_law, only : law_t
   implicit none
   private
   public :: law_linear_t, lame_constants

   type, extends(law_t) :: law_linear_t
      real(wp) :: lam = 0.0_wp                   !! [M/(L T^2)]
      real(wp) :: mu = 0.0_wp
   contains
      procedure :: energy => linear_energy
   end type law_linear_t

contains

   !> Lame's constants from Young's modulus and Poisson's ratio.
   pure subroutine lame_constants(young, nu, lam, mu)
      real(wp), intent(in) :: young, nu          !! E > 0; nu in (-1, 0.5)
      real(wp), intent(out) :: lam, mu           !! [M/(L T^2)]

      lam = young*nu/((1.0_wp + nu)*(1.0_wp - 2.0_wp*nu))
      mu = 0.5_wp*young/(1.0_wp + nu)
   end subroutine lame_constants

   !> E:E = e1^2 - 2 e2.
   pure function linear_energy(self, e1, e2, e3) result(w)
      class(law_linear_t), intent(in) :: self
      type(dg_t), intent(in) :: e1, e2, e3
      type(dg_t) :: w

      w = (0.5_wp*self%lam + self%mu)*(e1*e1) - (2.0_wp*self%mu)*e2 + 0.0_wp*e3
   end function linear_energy

end module emcon_law_linear
