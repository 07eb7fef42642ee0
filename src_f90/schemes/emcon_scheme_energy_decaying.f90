!> The energy-momentum scheme with a stress against strain increments that change from step to step:
!> high frequencies die out, energy never rises above that of the start, momenta are exact.
!>
!> After an idea of Armero & Romero (2001); docs/theory.md, eqs. (4e) to (4g).
module emcon_scheme_energy_decaying
   use emcon_evaluation, only : instant_later, instant_t, evaluation_moving, evaluation_t
   use emcon_kinds, only : wp
   use emcon_scheme, only : scheme_t
   implicit none
   private
   public :: scheme_energy_decaying_t

   type, extends(scheme_t) :: scheme_energy_decaying_t
   contains
      procedure :: evaluation => decaying_evaluation
      procedure :: keeps_energy => decaying_keeps_energy
      procedure :: carry => decaying_carry
   end type scheme_energy_decaying_t

contains

   !> That of the energy-momentum scheme. A step that is longer than the one before sees an
   !> increment that is too small, which takes energy all the same.
   pure function decaying_evaluation(self, start, h) result(evaluation)
      class(scheme_energy_decaying_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(evaluation_t) :: evaluation

      evaluation = evaluation_moving(h, lapse=0.5_wp*h, v_weight=2.0_wp)
      evaluation%load_instant = instant_later(start, 0.5_wp*h)
      evaluation%dissipation = self%row%setting%value
      if (start%h_before > 0.0_wp) evaluation%recalled = min(1.0_wp, h/start%h_before)
   end function decaying_evaluation

   !> With what the damping has taken.
   pure logical function decaying_keeps_energy(self) result(keeps_energy)
      class(scheme_energy_decaying_t), intent(in) :: self

      keeps_energy = .true.
   end function decaying_keeps_energy

   !> The way.
   pure subroutine decaying_carry(self, h, du, v0, v1, past)
      class(scheme_energy_decaying_t), intent(in) :: self
      real(wp), intent(in) :: h                              !! > 0 [T]
      real(wp), intent(in), contiguous :: du(:, :)           !! (n_dim, n_node) [L]
      real(wp), intent(in), contiguous :: v0(:, :), v1(:, :) !! (n_dim, n_node) [L/T]
      real(wp), intent(inout), contiguous :: past(:, :, :)   !! (n_dim, n_node, 1) [L]

      past(:, :, 1) = du
   end subroutine decaying_carry

end module emcon_scheme_energy_decaying
