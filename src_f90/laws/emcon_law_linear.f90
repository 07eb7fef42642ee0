!> Linear elasticity: W = lam/2 (tr E)^2 + mu E:E. Under NLGEOM this is St. Venant-Kirchhoff.
module emcon_law_linear
   use emcon_dgrad3, only : dg_t, operator(*), operator(-), operator(+)
   use emcon_kinds, only : wp
   use emcon_law, only : law_t, take_elastic
   implicit none
   private
   public :: law_linear_t

   type, extends(law_t) :: law_linear_t
      real(wp) :: lam = 0.0_wp                   !! [M/(L T^2)]
      real(wp) :: mu = 0.0_wp
   contains
      procedure :: take => linear_take
      procedure :: energy => linear_energy
   end type law_linear_t

contains

   pure subroutine linear_take(self, constant, fault)
      class(law_linear_t), intent(inout) :: self
      real(wp), intent(in) :: constant(:)        !! E, nu
      character(len=:), allocatable, intent(out) :: fault   !! what is wrong; empty: nothing

      call take_elastic(constant, self%lam, self%mu, fault)
      self%shear = self%mu
      self%has_volume = .false.
   end subroutine linear_take

   !> E:E = e1^2 - 2 e2.
   pure function linear_energy(self, e1, e2, e3) result(w)
      class(law_linear_t), intent(in) :: self
      type(dg_t), intent(in) :: e1, e2, e3
      type(dg_t) :: w

      w = (0.5_wp*self%lam + self%mu)*(e1*e1) - (2.0_wp*self%mu)*e2 + 0.0_wp*e3
   end function linear_energy

end module emcon_law_linear
