!> Gent's law, whose chains can be stretched up to a limit:
!> W = -mu/2 Jm ln(1 - (I1 - 3 - 2 ln J)/Jm) + lam/2 (ln J)^2, with tr C - 3 - 2 ln J < Jm.
!>
!> A law from outside: one file against the installed modules. Its row is a *USER MATERIAL with the
!> constants mu, lam and Jm.
module gent_law
   use emcon_api, only : wp
   use emcon_dgrad3, only : dg_excess, dg_log1p, dg_t, operator(*), operator(+), operator(-)
   use emcon_law, only : claim, law_t, volume_excess
   implicit none
   private
   public :: gent_law_t

   type, extends(law_t) :: gent_law_t
      real(wp) :: mu = 0.0_wp, lam = 0.0_wp      !! [M/(L T^2)]
      real(wp) :: limit = 0.0_wp                 !! Jm
   contains
      procedure :: take
      procedure :: energy
   end type gent_law_t

contains

   pure subroutine take(self, constant, fault)
      class(gent_law_t), intent(inout) :: self
      real(wp), intent(in) :: constant(:)        !! mu, lam, Jm
      character(len=:), allocatable, intent(out) :: fault

      fault = ""
      if (size(constant) /= 3) then
         fault = "Gent's law has three constants: mu, lam, Jm"
         return
      end if
      self%mu = constant(1)
      self%lam = constant(2)
      self%limit = constant(3)
      self%shear = self%mu
      call claim(self%mu > 0.0_wp, "mu", self%mu, "must be positive", fault)
      call claim(self%limit > 0.0_wp, "Jm", self%limit, "must be positive", fault)
   end subroutine take

   !> tr C - 3 - 2 ln J = 2 e1 - ln(1 + y) = y - ln(1 + y) - 4 e2 - 8 e3.
   pure function energy(self, e1, e2, e3) result(w)
      class(gent_law_t), intent(in) :: self
      type(dg_t), intent(in) :: e1, e2, e3
      type(dg_t) :: w, y, logarithm

      y = volume_excess(e1, e2, e3)
      logarithm = dg_log1p(y)
      w = (-0.5_wp*self%mu*self%limit)*dg_log1p((-1.0_wp/self%limit)*(dg_excess(y) &
         - 4.0_wp*e2 - 8.0_wp*e3)) + (0.125_wp*self%lam)*(logarithm*logarithm)
   end function energy

end module gent_law
