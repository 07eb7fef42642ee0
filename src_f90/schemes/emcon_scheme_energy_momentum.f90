!> The energy-momentum scheme, paper eq. (4): discrete gradients, mid-point inertia.
!> Source: docs/theory.md, eqs. (2) and (3).
module emcon_scheme_energy_momentum
   use emcon_evaluation, only : instant_later, instant_t, evaluation_moving, evaluation_t
   use emcon_kinds, only : wp
   use emcon_scheme, only : scheme_t
   implicit none
   private
   public :: scheme_energy_momentum_t

   type, extends(scheme_t) :: scheme_energy_momentum_t
   contains
      procedure :: evaluation => energy_momentum_pose
      procedure :: keeps_energy => energy_momentum_keeps_energy
      procedure :: error_constant => energy_momentum_error_constant
   end type scheme_energy_momentum_t

contains

   !> r = M (2/h du - 2 v0)/h + forces; loads at mid-time on the mid-configuration.
   pure function energy_momentum_pose(self, start, h) result(evaluation)
      class(scheme_energy_momentum_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(evaluation_t) :: evaluation

      evaluation = evaluation_moving(h, lapse=0.5_wp*h, v_weight=2.0_wp)
      evaluation%load_instant = instant_later(start, 0.5_wp*h)
   end function energy_momentum_pose

   pure logical function energy_momentum_keeps_energy(self) result(keeps_energy)
      class(scheme_energy_momentum_t), intent(in) :: self

      keeps_energy = .true.
   end function energy_momentum_keeps_energy

   !> Of u1 = u0 + h (v0 + v1)/2.
   pure real(wp) function energy_momentum_error_constant(self) result(constant)
      class(scheme_energy_momentum_t), intent(in) :: self

      constant = 1.0_wp/12.0_wp
   end function energy_momentum_error_constant

end module emcon_scheme_energy_momentum
