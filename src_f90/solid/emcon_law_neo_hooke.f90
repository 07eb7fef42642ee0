!> Neo-Hookean law with Abaqus' constants: W = C10 (J^(-2/3) I1 - 3) + (J - 1)^2/D1.
module emcon_law_neo_hooke
   use emcon_dgrad3, only : dg_t, dg_excess, dg_expm1, dg_log1p, dg_sqrt, operator(*), &
      operator(-), operator(+), operator(/)
   use emcon_kinds, only : wp
   use emcon_law, only : law_t, volume_excess
   implicit none
   private
   public :: law_neo_hooke_t

   type, extends(law_t) :: law_neo_hooke_t
      real(wp) :: c10 = 0.0_wp                   !! [M/(L T^2)]
      real(wp) :: d1 = 0.0_wp                    !! > 0 [L T^2/M]
   contains
      procedure :: energy => neo_hooke_energy
   end type law_neo_hooke_t

contains

   !> J^(-2/3) I1 = 3 exp(z), z = ln(1 + a) - ln(1 + y)/3 with a = I1/3 - 1, y = J^2 - 1. At small
   !> strains only second-order terms may be left: z = phi(y)/3 - phi(a) - 4/3 e2 - 8/3 e3 with
   !> phi(x) = x - ln(1 + x), docs/theory.md, eq. (8); at large ones it is these that would cancel.
   pure function neo_hooke_energy(self, e1, e2, e3) result(w)
      class(law_neo_hooke_t), intent(in) :: self
      type(dg_t), intent(in) :: e1, e2, e3
      type(dg_t) :: w, a, y, z, volume
      real(wp), parameter :: third = 1.0_wp/3.0_wp, small = 0.5_wp

      y = volume_excess(e1, e2, e3)
      a = (2.0_wp*third)*e1
      if (max(abs(a%f0), abs(a%f1), abs(y%f0), abs(y%f1)) < small) then
         z = third*dg_excess(y) - dg_excess(a) - (4.0_wp*third)*e2 - (8.0_wp*third)*e3
      else
         z = dg_log1p(a) - third*dg_log1p(y)
      end if
      volume = y/(dg_sqrt(y + 1.0_wp) + 1.0_wp)
      w = (3.0_wp*self%c10)*dg_expm1(z) + (1.0_wp/self%d1)*(volume*volume)
   end function neo_hooke_energy

end module emcon_law_neo_hooke
