!> Neo-Hookean law with Abaqus' constants: W = C10 (J^(-2/3) I1 - 3) + (J - 1)^2/D1.
module emcon_law_neo_hooke
   use emcon_dgrad3, only : dg_expm1, dg_t, operator(*), operator(-), operator(+)
   use emcon_kinds, only : wp
   use emcon_law, only : claim, isochoric_excess, law_t, volume_energy, volume_excess
   implicit none
   private
   public :: law_neo_hooke_t

   type, extends(law_t) :: law_neo_hooke_t
      real(wp) :: c10 = 0.0_wp                   !! [M/(L T^2)]
      real(wp) :: d1 = 0.0_wp                    !! > 0 [L T^2/M]
   contains
      procedure :: take => neo_hooke_take
      procedure :: energy => neo_hooke_energy
   end type law_neo_hooke_t

contains

   pure subroutine neo_hooke_take(self, constant, fault)
      class(law_neo_hooke_t), intent(inout) :: self
      real(wp), intent(in) :: constant(:)        !! C10, D1
      character(len=:), allocatable, intent(out) :: fault   !! what is wrong; empty: nothing

      self%c10 = constant(1)
      self%d1 = constant(size(constant))
      self%shear = 2.0_wp*self%c10
      call claim(self%c10 > 0.0_wp, "C10", self%c10, "must be positive", fault)
      call claim(self%d1 >= 0.0_wp, "D1", self%d1, "must not be negative", fault)
   end subroutine neo_hooke_take

   !> J^(-2/3) I1 = 3 exp(z); docs/theory.md, eq. (8).
   pure function neo_hooke_energy(self, e1, e2, e3) result(w)
      class(law_neo_hooke_t), intent(in) :: self
      type(dg_t), intent(in) :: e1, e2, e3
      type(dg_t) :: w, y, z
      real(wp), parameter :: third = 1.0_wp/3.0_wp

      y = volume_excess(e1, e2, e3)
      z = isochoric_excess(third, (2.0_wp*third)*e1, y, -((4.0_wp*third)*e2) - (8.0_wp*third)*e3)
      w = (3.0_wp*self%c10)*dg_expm1(z) + volume_energy([self%d1], y)
   end function neo_hooke_energy

end module emcon_law_neo_hooke
