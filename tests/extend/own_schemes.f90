!> Schemes that EMCON has, written again as a program would give them: together they set all that a
!> `evaluation_t` has. Each has to do what its original does, to the last bit.
module own_schemes
   use emcon_api, only : instant_later, instant_t, evaluation_moving, evaluation_t, scheme_t, wp
   implicit none
   private
   public :: own_scheme_t, own_scheme

   !> -alpha of the method of Hilber, Hughes and Taylor.
   real(wp), parameter :: lag = 0.05_wp

   type, extends(scheme_t) :: own_scheme_t
      character(len=16) :: kind = ""             !! the original, as decks call it
   contains
      procedure :: evaluation
      procedure :: carry
      procedure :: keeps_energy
   end type own_scheme_t

contains

   !> The copy of a scheme, and what it keeps of the steps before.
   pure type(own_scheme_t) function own_scheme(kind) result(scheme)
      character(len=*), intent(in) :: kind

      scheme%kind = kind
      select case (kind)
      case ("BDF2")
         scheme%row%n_past = 2
      case ("GENERALIZEDALPHA")
         scheme%row%n_past = 1
         scheme%row%is_accelerated = .true.
      case ("ENERGYDECAYING")
         scheme%row%n_past = 1
      end select
   end function own_scheme

   pure function evaluation(self, start, h)
      class(own_scheme_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(evaluation_t) :: evaluation

      select case (self%kind)
      case ("TRAPEZOIDAL")
         evaluation = evaluation_moving(0.5_wp*h, lapse=0.5_wp*h, v_weight=2.0_wp)
         evaluation%start_weight = 1.0_wp
         call push_at_end(evaluation, start, h)
      case ("GENERALIZEDALPHA")
         associate (gamma => 0.5_wp + lag, beta => 0.25_wp*(1.0_wp + lag)**2)
            evaluation = evaluation_moving(gamma*h*(1.0_wp - lag), lapse=beta*h/gamma, &
               v_weight=gamma/beta)
            evaluation%start_weight = lag/(1.0_wp - lag)
            evaluation%past_velocity(1) = h*(1.0_wp - 0.5_wp*gamma/beta)
            evaluation%past_change(1) = gamma*h*(1.0_wp - 0.5_wp/beta)
         end associate
         call push_at_end(evaluation, start, h)
      case ("BDF2")
         evaluation = of_differences(start, h)
      case default
         evaluation = evaluation_moving(h, lapse=0.5_wp*h, v_weight=2.0_wp)
         evaluation%load_instant = instant_later(start, 0.5_wp*h)
         if (self%kind == "MIDPOINT") then
            evaluation%at = 0.5_wp
            evaluation%is_gradient = .true.
         else if (self%kind == "ENERGYDECAYING") then
            evaluation%dissipation = 0.125_wp
            if (start%h_before > 0.0_wp) evaluation%recalled = min(1.0_wp, h/start%h_before)
         end if
      end select
   end function evaluation

   !> Forces, loads and contact are those at the end.
   pure subroutine push_at_end(evaluation, start, h)
      type(evaluation_t), intent(inout) :: evaluation
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]

      evaluation%is_gradient = .true.
      evaluation%load_place = 1.0_wp
      evaluation%load_instant = instant_later(start, h)
      evaluation%pushes_at_end = .true.
   end subroutine push_at_end

   !> Backward differences, of which the first step is the mid-point rule.
   pure function of_differences(start, h) result(evaluation)
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(evaluation_t) :: evaluation
      real(wp) :: ratio, k, l

      if (start%h_before > 0.0_wp) then
         ratio = h/start%h_before
         k = (1.0_wp + 2.0_wp*ratio)/(1.0_wp + ratio)
         l = ratio**2/(1.0_wp + ratio)
         evaluation = evaluation_moving(h/k, lapse=h/k, v_weight=1.0_wp)
         evaluation%past_velocity(1) = -l/h
         evaluation%past_change = -[l/h, l/k]
         call push_at_end(evaluation, start, h)
      else
         evaluation = evaluation_moving(h, lapse=0.5_wp*h, v_weight=2.0_wp)
         evaluation%at = 0.5_wp
         evaluation%is_gradient = .true.
         evaluation%load_instant = instant_later(start, 0.5_wp*h)
      end if
   end function of_differences

   pure subroutine carry(self, h, du, v0, v1, past)
      class(own_scheme_t), intent(in) :: self
      real(wp), intent(in) :: h
      real(wp), intent(in), contiguous :: du(:, :)
      real(wp), intent(in), contiguous :: v0(:, :), v1(:, :)
      real(wp), intent(inout), contiguous :: past(:, :, :)

      select case (self%kind)
      case ("BDF2")
         past(:, :, 1) = du
         past(:, :, 2) = v1 - v0
      case ("GENERALIZEDALPHA")
         associate (gamma => 0.5_wp + lag)
            past(:, :, 1) = ((v1 - v0)/h - (1.0_wp - gamma)*past(:, :, 1))/gamma
         end associate
      case ("ENERGYDECAYING")
         past(:, :, 1) = du
      end select
   end subroutine carry

   pure logical function keeps_energy(self)
      class(own_scheme_t), intent(in) :: self

      keeps_energy = self%kind == "ENERGYMOMENTUM" .or. self%kind == "ENERGYDECAYING"
   end function keeps_energy

end module own_schemes
