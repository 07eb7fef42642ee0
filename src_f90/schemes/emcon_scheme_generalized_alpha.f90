!> The generalised-alpha method: weighted means of accelerations and of forces over the step, chosen
!> by the spectral radius of the highest frequencies, or with means of forces alone, by alpha.
!>
!> Source: Chung & Hulbert (1993), Hilber, Hughes & Taylor (1977); docs/theory.md, eqs. (4b), (4c).
module emcon_scheme_generalized_alpha
   use emcon_evaluation, only : instant_later, instant_t, evaluation_moving, evaluation_t
   use emcon_kinds, only : wp
   use emcon_scheme, only : scheme_t, setting_t
   implicit none
   private
   public :: scheme_generalized_alpha_t

   type, extends(scheme_t) :: scheme_generalized_alpha_t
   contains
      procedure :: evaluation => alpha_pose
      procedure :: carry => alpha_carry
   end type scheme_generalized_alpha_t

   !> The weights of the method.
   type :: weights_t
      real(wp) :: mass = 0.0_wp                  !! alpha_m, of the acceleration at the start
      real(wp) :: force = 0.0_wp                 !! alpha_f, of the forces at the start
      real(wp) :: gamma = 0.0_wp, beta = 0.0_wp
   end type weights_t

contains

   !> The weights for a spectral radius, or for alpha.
   elemental type(weights_t) function weights_of(setting) result(weights)
      type(setting_t), intent(in) :: setting

      associate (value => setting%value)
         if (setting%word == "SPECTRAL RADIUS") then
            weights%mass = (2.0_wp*value - 1.0_wp)/(value + 1.0_wp)
            weights%force = value/(value + 1.0_wp)
         else
            weights%force = -value
         end if
      end associate
      weights%gamma = 0.5_wp - weights%mass + weights%force
      weights%beta = 0.25_wp*(1.0_wp - weights%mass + weights%force)**2
   end function weights_of

   !> M ((1 - alpha_m) a1 + alpha_m a0) + (1 - alpha_f) forces at the end + alpha_f at the start,
   !> over 1 - alpha_f, with a1 of du by Newmark's formulas.
   pure function alpha_pose(self, start, h) result(evaluation)
      class(scheme_generalized_alpha_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(evaluation_t) :: evaluation
      type(weights_t) :: alpha

      alpha = weights_of(self%row%setting)
      evaluation = evaluation_moving(alpha%gamma*h*(1.0_wp - alpha%force)/(1.0_wp - alpha%mass), &
         lapse=alpha%beta*h/alpha%gamma, v_weight=alpha%gamma/alpha%beta)
      evaluation%is_gradient = .true.
      evaluation%load_place = 1.0_wp
      evaluation%load_instant = instant_later(start, h)
      evaluation%pushes_at_end = .true.
      evaluation%start_weight = alpha%force/(1.0_wp - alpha%force)
      evaluation%past_velocity(1) = h*(1.0_wp - 0.5_wp*alpha%gamma/alpha%beta)
      evaluation%past_change(1) = alpha%gamma*h*(alpha%mass/(1.0_wp - alpha%mass) &
         + (1.0_wp - 0.5_wp/alpha%beta))
   end function alpha_pose

   !> The acceleration at the end: v1 = v0 + h ((1 - gamma) a0 + gamma a1).
   pure subroutine alpha_carry(self, h, du, v0, v1, past)
      class(scheme_generalized_alpha_t), intent(in) :: self
      real(wp), intent(in) :: h                              !! > 0 [T]
      real(wp), intent(in), contiguous :: du(:, :)           !! (n_dim, n_node) [L]
      real(wp), intent(in), contiguous :: v0(:, :), v1(:, :) !! (n_dim, n_node) [L/T]
      real(wp), intent(inout), contiguous :: past(:, :, :)   !! (n_dim, n_node, 1) [L/T^2]
      type(weights_t) :: alpha

      alpha = weights_of(self%row%setting)
      past(:, :, 1) = ((v1 - v0)/h - (1.0_wp - alpha%gamma)*past(:, :, 1))/alpha%gamma
   end subroutine alpha_carry

end module emcon_scheme_generalized_alpha
