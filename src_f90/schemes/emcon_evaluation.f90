!> Where in a step forces are evaluated, and how inertia enters: all that a scheme decides.
!>
!> Source: docs/theory.md, section 1.
module emcon_evaluation
   use emcon_kinds, only : wp
   implicit none
   private
   public :: instant_t, evaluation_t, evaluation_at_end, most_past
   public :: evaluation_moving, evaluation_velocity, evaluation_displacement, &
      evaluation_has_inertia, evaluation_is_equilibrium, evaluation_is_at_start, &
      evaluation_contact_place, evaluation_contact_conserves, evaluation_conserves, instant_later

   !> Fields that a scheme keeps of the steps before, at most.
   integer, parameter :: most_past = 2

   !> A moment of a step, as amplitudes see it.
   type :: instant_t
      real(wp) :: step_time = 0.0_wp             !! since the start of the step [T]
      real(wp) :: total_time = 0.0_wp            !! since the start of the analysis [T]
      real(wp) :: h_before = 0.0_wp              !! of the step that ends here; 0: none [T]
   end type instant_t

   !> Inertia is s M (b du - w v0): b du - w v0 is the change of velocity, computed with the same b
   !> as the velocity itself. Two factors for du and v0 would round apart, a bias in each step.
   !> Fields of the steps before add to both.
   !> Forces are discrete gradients from the start of the step to a place in it, or gradients there,
   !> to which those at the start may be added.
   type :: evaluation_t
      real(wp) :: mass_scale = 0.0_wp            !! s [1/T]; 0: no inertia
      real(wp) :: rate = 0.0_wp                  !! b [1/T]
      real(wp) :: lapse = 0.0_wp                 !! 1/b, as the scheme rounds it; statics: h [T]
      real(wp) :: v_weight = 0.0_wp              !! w
      real(wp) :: at = 1.0_wp                    !! part of the way from start to end: 0 < . <= 1
      logical :: is_gradient = .false.           !! at `place`, else discrete from the start to it
      real(wp) :: load_place = 0.5_wp            !! part of the way at which loads act: 0..1
      type(instant_t) :: load_instant            !! when loads are taken
      !> Contact pushes along gradients at the end, else along discrete ones over all of the step.
      logical :: pushes_at_end = .false.
      real(wp) :: start_weight = 0.0_wp          !! of all forces at the start; those at `place`: 1
      real(wp) :: dissipation = 0.0_wp           !! chi, of docs/theory.md, eq. (4e); 0: none
      real(wp) :: recalled = 0.0_wp              !! part of the last strain increments: 0..1
      real(wp) :: past_velocity(most_past) = 0.0_wp  !! weights of the past in the velocity
      real(wp) :: past_change(most_past) = 0.0_wp    !! and in b du - w v0
   end type evaluation_t

   !> Gradients at the end of the step, where there is no inertia.
   type(evaluation_t), parameter :: evaluation_at_end = evaluation_t(is_gradient=.true., &
      load_place=1.0_wp)

contains

   !> Inertia M (v1 - v0)/h with v1 - v0 = du/lapse - v_weight v0.
   pure type(evaluation_t) function evaluation_moving(h, lapse, v_weight) result(evaluation)
      real(wp), intent(in) :: h                  !! > 0, size of the step [T]
      real(wp), intent(in) :: lapse              !! > 0 [T]
      real(wp), intent(in) :: v_weight           !! (1)

      evaluation%mass_scale = 1.0_wp/h
      evaluation%rate = 1.0_wp/lapse
      evaluation%lapse = lapse
      evaluation%v_weight = v_weight
   end function evaluation_moving

   !> Velocity at the end of a step from `v0` that moved by `du`: v1 = b du + (1 - w) v0, and what
   !> the past adds.
   elemental real(wp) function evaluation_velocity(evaluation, v0, du) result(v1)
      type(evaluation_t), intent(in) :: evaluation
      real(wp), intent(in) :: v0                 !! at the start [L/T]
      real(wp), intent(in) :: du                 !! [L]

      v1 = evaluation%rate*du + (1.0_wp - evaluation%v_weight)*v0
   end function evaluation_velocity

   !> The way over a step from `v0` that ends with `v1`: the inverse of `evaluation_velocity`.
   elemental real(wp) function evaluation_displacement(evaluation, v0, v1) result(du)
      type(evaluation_t), intent(in) :: evaluation
      real(wp), intent(in) :: v0                 !! at the start [L/T]
      real(wp), intent(in) :: v1                 !! at the end [L/T]

      du = evaluation%lapse*((evaluation%v_weight - 1.0_wp)*v0 + v1)
   end function evaluation_displacement

   elemental logical function evaluation_has_inertia(evaluation) result(has_inertia)
      type(evaluation_t), intent(in) :: evaluation

      has_inertia = evaluation%mass_scale > 0.0_wp
   end function evaluation_has_inertia

   !> Are forces to balance without inertia, as gradients of their energies?
   elemental logical function evaluation_is_equilibrium(evaluation) result(is_equilibrium)
      type(evaluation_t), intent(in) :: evaluation

      is_equilibrium = evaluation%is_gradient .and. .not. evaluation_has_inertia(evaluation)
   end function evaluation_is_equilibrium

   !> The part of the step after which contact forces act: in the mean at its middle, or its end.
   elemental real(wp) function evaluation_contact_place(evaluation) result(place)
      type(evaluation_t), intent(in) :: evaluation

      place = merge(0.5_wp, 1.0_wp, evaluation_has_inertia(evaluation) &
         .and. .not. evaluation%pushes_at_end)
   end function evaluation_contact_place

   !> Are forces along gradients where the step starts?
   elemental logical function evaluation_is_at_start(evaluation) result(is_at_start)
      type(evaluation_t), intent(in) :: evaluation

      is_at_start = evaluation%is_gradient .and. .not. evaluation%at > 0.0_wp
   end function evaluation_is_at_start

   !> Do contact forces act along discrete gradients over the step alone?
   elemental logical function evaluation_contact_conserves(evaluation) result(conserves)
      type(evaluation_t), intent(in) :: evaluation

      conserves = .not. (evaluation%pushes_at_end .or. evaluation%start_weight > 0.0_wp)
   end function evaluation_contact_conserves

   !> And all other forces, without dissipation?
   elemental logical function evaluation_conserves(evaluation) result(conserves)
      type(evaluation_t), intent(in) :: evaluation

      conserves = evaluation_contact_conserves(evaluation) .and. &
         .not. (evaluation%is_gradient .or. evaluation%dissipation > 0.0_wp)
   end function evaluation_conserves

   elemental type(instant_t) function instant_later(instant, h) result(later)
      type(instant_t), intent(in) :: instant
      real(wp), intent(in) :: h                  !! [T]

      later = instant_t(instant%step_time + h, instant%total_time + h)
   end function instant_later

end module emcon_evaluation
