!> Mooney and Rivlin's law with Abaqus' constants:
!> W = C10 (J^(-2/3) I1 - 3) + C01 (J^(-4/3) I2 - 3) + (J - 1)^2/D1.
module emcon_law_mooney_rivlin
   use emcon_dgrad3, only : dg_expm1, dg_t, operator(*), operator(-), operator(+)
   use emcon_kinds, only : wp
   use emcon_law, only : claim, isochoric_excess, law_t, volume_energy, volume_excess
   implicit none
   private
   public :: law_mooney_rivlin_t

   type, extends(law_t) :: law_mooney_rivlin_t
      real(wp) :: c10 = 0.0_wp                   !! [M/(L T^2)]
      real(wp) :: c01 = 0.0_wp
      real(wp) :: d1 = 0.0_wp                    !! > 0 [L T^2/M]
   contains
      procedure :: take => mooney_rivlin_take
      procedure :: energy => mooney_rivlin_energy
   end type law_mooney_rivlin_t

contains

   pure subroutine mooney_rivlin_take(self, constant, fault)
      class(law_mooney_rivlin_t), intent(inout) :: self
      real(wp), intent(in) :: constant(:)        !! C10, C01, D1
      character(len=:), allocatable, intent(out) :: fault   !! what is wrong; empty: nothing

      self%c10 = constant(1)
      self%c01 = constant(2)
      self%d1 = constant(3)
      self%shear = 2.0_wp*(self%c10 + self%c01)
      call claim(self%shear > 0.0_wp, "C10 + C01", self%c10 + self%c01, &
         "must be positive", fault)
      call claim(self%d1 >= 0.0_wp, "D1", self%d1, "must not be negative", fault)
   end subroutine mooney_rivlin_take

   !> J^(-2/3) I1 = 3 exp(z1) and J^(-4/3) I2 = 3 exp(z2), with I2/3 - 1 = 4/3 (e1 + e2);
   !> docs/theory.md, eq. (8).
   pure function mooney_rivlin_energy(self, e1, e2, e3) result(w)
      class(law_mooney_rivlin_t), intent(in) :: self
      type(dg_t), intent(in) :: e1, e2, e3
      type(dg_t) :: w, y, z1, z2
      real(wp), parameter :: third = 1.0_wp/3.0_wp

      y = volume_excess(e1, e2, e3)
      z1 = isochoric_excess(third, (2.0_wp*third)*e1, y, -((4.0_wp*third)*e2) - (8.0_wp*third)*e3)
      z2 = isochoric_excess(2.0_wp*third, (4.0_wp*third)*(e1 + e2), y, &
         -((4.0_wp*third)*e2) - (16.0_wp*third)*e3)
      w = (3.0_wp*self%c10)*dg_expm1(z1) + (3.0_wp*self%c01)*dg_expm1(z2) &
         + volume_energy([self%d1], y)
   end function mooney_rivlin_energy

end module emcon_law_mooney_rivlin
