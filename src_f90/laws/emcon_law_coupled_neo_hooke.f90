!> Coupled neo-Hookean law: W = mu/2 (tr C - 3) - mu ln J + lam/2 (ln J)^2.
module emcon_law_coupled_neo_hooke
   use emcon_dgrad3, only : dg_t, dg_excess, dg_log1p, operator(*), operator(-), operator(+)
   use emcon_kinds, only : wp
   use emcon_law, only : law_t, take_elastic, volume_excess
   implicit none
   private
   public :: law_coupled_neo_hooke_t

   type, extends(law_t) :: law_coupled_neo_hooke_t
      real(wp) :: lam = 0.0_wp                   !! [M/(L T^2)]
      real(wp) :: mu = 0.0_wp
   contains
      procedure :: take => coupled_neo_hooke_take
      procedure :: energy => coupled_neo_hooke_energy
   end type law_coupled_neo_hooke_t

contains

   pure subroutine coupled_neo_hooke_take(self, constant, fault)
      class(law_coupled_neo_hooke_t), intent(inout) :: self
      real(wp), intent(in) :: constant(:)        !! E, nu
      character(len=:), allocatable, intent(out) :: fault   !! what is wrong; empty: nothing

      call take_elastic(constant, self%lam, self%mu, fault)
      self%shear = self%mu
   end subroutine coupled_neo_hooke_take

   !> With y = J^2 - 1 = 2 e1 + 4 e2 + 8 e3, so that no first-order terms are left to cancel:
   !> W = mu/2 (y - ln(1+y)) - 2 mu e2 - 4 mu e3 + lam/8 ln^2(1+y).
   pure function coupled_neo_hooke_energy(self, e1, e2, e3) result(w)
      class(law_coupled_neo_hooke_t), intent(in) :: self
      type(dg_t), intent(in) :: e1, e2, e3
      type(dg_t) :: w, y, logarithm

      y = volume_excess(e1, e2, e3)
      logarithm = dg_log1p(y)
      w = (0.5_wp*self%mu)*dg_excess(y) - (2.0_wp*self%mu)*e2 - (4.0_wp*self%mu)*e3 &
         + (0.125_wp*self%lam)*(logarithm*logarithm)
   end function coupled_neo_hooke_energy

end module emcon_law_coupled_neo_hooke
