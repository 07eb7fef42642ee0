!> Yeoh's law with Abaqus' constants:
!> W = sum over i = 1..3 of C_i0 (J^(-2/3) I1 - 3)^i + (J - 1)^(2 i)/D_i.
module emcon_law_yeoh
   use emcon_dgrad3, only : dg_expm1, dg_t, operator(*), operator(-), operator(+)
   use emcon_kinds, only : wp
   use emcon_law, only : claim, isochoric_excess, law_t, volume_energy, volume_excess
   implicit none
   private
   public :: law_yeoh_t

   type, extends(law_t) :: law_yeoh_t
      real(wp) :: c(3) = 0.0_wp                  !! C10, C20, C30 [M/(L T^2)]
      real(wp) :: d(3) = 0.0_wp                  !! [L T^2/M]; the first > 0
   contains
      procedure :: take => yeoh_take
      procedure :: energy => yeoh_energy
   end type law_yeoh_t

contains

   pure subroutine yeoh_take(self, constant, fault)
      class(law_yeoh_t), intent(inout) :: self
      real(wp), intent(in) :: constant(:)        !! C10, C20, C30, D1, D2, D3
      character(len=:), allocatable, intent(out) :: fault   !! what is wrong; empty: nothing

      self%c = constant(:3)
      self%d = constant(4:)
      self%shear = 2.0_wp*self%c(1)
      call claim(self%c(1) > 0.0_wp, "C10", self%c(1), "must be positive", fault)
      call claim(self%d(1) >= 0.0_wp, "D1", self%d(1), "must not be negative", fault)
   end subroutine yeoh_take

   !> J^(-2/3) I1 = 3 exp(z); docs/theory.md, eq. (8).
   pure function yeoh_energy(self, e1, e2, e3) result(w)
      class(law_yeoh_t), intent(in) :: self
      type(dg_t), intent(in) :: e1, e2, e3
      type(dg_t) :: w, y, excess, power
      integer :: i
      real(wp), parameter :: third = 1.0_wp/3.0_wp

      y = volume_excess(e1, e2, e3)
      excess = 3.0_wp*dg_expm1(isochoric_excess(third, (2.0_wp*third)*e1, y, &
         -((4.0_wp*third)*e2) - (8.0_wp*third)*e3))
      w = volume_energy(self%d, y)
      power = excess
      do i = 1, size(self%c)
         if (i > 1) power = power*excess
         w = w + self%c(i)*power
      end do
   end function yeoh_energy

end module emcon_law_yeoh
