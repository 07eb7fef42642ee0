!> The steps of a deck: scheme, conditions, and how they are solved.
module emcon_steps
   use emcon_interactions, only : contact_options_t
   use emcon_kinds, only : wp
   use emcon_origin, only : origin_t
   use emcon_requests, only : output_t
   use emcon_scheme, only : scheme_row_t
   use emcon_solver_registry, only : solver_default
   implicit none
   private
   public :: prescribed_t, turn_t, load_t, scheme_choice_t, penalty_setting_t
   public :: step_t, step_time_t, step_contact_t, step_solution_t
   public :: load_point, load_pressure, load_gravity, load_moment, load_centrifugal
   public :: by_node, by_element, by_surface
   public :: initiation_none, initiation_persistent, initiation_admissible, &
      initiation_velocity_update, initiation_massless, initiation_auto
   public :: method_null_space, method_saddle_point, method_penalty, method_augmented_lagrange
   public :: newton_kept, newton_full
   public :: events_pairs, events_nodes
   public :: most_stand_off
   public :: prescribed_find, prescribed_rests, step_is_dynamic, step_initiation, step_square

   integer, parameter :: load_point = 1, load_pressure = 2, load_gravity = 3, load_moment = 4, &
      load_centrifugal = 5
   integer, parameter :: by_node = 1, by_element = 2, by_surface = 3
   integer, parameter :: initiation_none = 0, initiation_persistent = 1, &
      initiation_admissible = 2, initiation_velocity_update = 3, initiation_massless = 4, &
      initiation_auto = 5
   integer, parameter :: method_null_space = 1, method_saddle_point = 2, method_penalty = 3, &
      method_augmented_lagrange = 4
   integer, parameter :: newton_kept = 1, newton_full = 2
   integer, parameter :: events_pairs = 1, events_nodes = 2
   !> Air across which contact forces may act, per edge: results with more are bad.
   real(wp), parameter :: most_stand_off = 0.5_wp

   !> One prescribed degree of freedom: u = `value` times the amplitude.
   !>
   !> Without amplitude: in a static step u runs linearly from what it is at the start of the step
   !> to `value` at its end; in a dynamic step it is `value` from the first increment on.
   type :: prescribed_t
      type(origin_t) :: origin
      integer :: node = 0
      integer :: dof = 0                             !! 1..n_dim
      real(wp) :: value = 0.0_wp                     !! [L]
      integer :: amplitude = 0                       !! index, 0: none
      logical :: is_frozen = .false.                 !! FIXED: stays where the step found it
      real(wp) :: before = 0.0_wp                    !! its value at the end of the step before
      integer :: turn = 0                            !! moves as this turn of the step says; 0: none
   end type prescribed_t

   !> The rotation of a rigid body that is prescribed.
   type :: turn_t
      integer :: rigid = 0                           !! index into `scene_t%rigid`
      !> (n_turn, or two) of the reference node, in radians; in space of a rotation vector
      type(prescribed_t), allocatable :: angle(:)
      integer :: axis = 0                            !! of space that it may turn about; 0: none
      !> That node is prescribed too, in all directions
      logical :: is_about = .true.
   end type turn_t

   !> One load. Without amplitude: `value`; in a static step a linear run from `value_start`.
   type :: load_t
      type(origin_t) :: origin
      integer :: kind = 0                            !! one of `load_`
      integer :: target = 0                          !! node (point, moment) or element
      integer :: place = 0                           !! dof (point, moment) or face (pressure)
      !> Force | pressure, > 0 inwards | acceleration | moment | square of the angular velocity
      real(wp) :: value = 0.0_wp
      real(wp) :: value_start = 0.0_wp               !! its value at the end of the step before
      real(wp) :: direction(3) = 0.0_wp              !! of gravity or an axis: unit vector
      real(wp) :: point(3) = 0.0_wp                  !! on that axis [L]
      integer :: amplitude = 0
      integer :: given = by_node                     !! by which card: one of `by_`
   end type load_t

   !> The scheme of steps of its card, of this step and later ones.
   type :: scheme_choice_t
      type(origin_t) :: origin
      type(scheme_row_t) :: row                      !! code 0: none was asked for
      character(len=:), allocatable :: name          !! in the deck
   end type scheme_choice_t

   !> Contact that gives way: *CONSTRAINT METHOD, TYPE=PENALTY or AUGMENTED LAGRANGE.
   type :: penalty_setting_t
      type(origin_t) :: origin
      real(wp) :: stiffness = 0.0_wp                 !! pressure by penetration [M/(L T)^2]; 0: by
      real(wp) :: factor = 1.0_wp                    !! this, times that of the elements
      real(wp) :: tolerance = 1.0e-8_wp              !! of gaps, by the edge: AUGMENTED LAGRANGE
   end type penalty_setting_t

   !> How a step is divided into increments.
   type :: step_time_t
      integer :: max_increments = 0                  !! INC; 0: not limited
      logical :: is_direct = .false.                 !! increments as given
      real(wp) :: h = 1.0_wp                         !! first, or fixed, increment [T]
      real(wp) :: duration = 1.0_wp                  !! [T]
      !> Times since its start at which amplitudes in use have corners, ascending [T]; not
      !> allocated: there are none
      real(wp), allocatable :: corner(:)
      real(wp) :: h_min = 0.0_wp                     !! 0: not given
      real(wp) :: h_max = 0.0_wp                     !! 0: not given
      real(wp) :: tolerance = 0.0_wp                 !! error of an increment, relative; 0: any
      type(origin_t) :: tolerance_origin
      real(wp) :: event_fraction = 0.0_wp            !! of h, in which events lie; 0: anywhere
      integer :: events = events_pairs               !! one of `events_`
   end type step_time_t

   !> How its equations are solved.
   type :: step_solution_t
      integer :: solver = solver_default             !! one of `solver_`
      character(len=:), allocatable :: solver_name   !! of `solver_user`, upper case, no blanks
      type(origin_t) :: solver_origin
      integer :: newton = newton_kept                !! one of `newton_`
      real(wp) :: newton_tolerance = 1.0e-10_wp      !! relative
      integer :: newton_maximum = 20
      logical :: polishes = .true.                   !! within it, corrections go on to round-off
   end type step_solution_t

   !> What holds for all contact in it.
   type :: step_contact_t
      integer :: method = method_null_space          !! one of `method_`
      type(penalty_setting_t) :: penalty
      integer :: initiation = initiation_persistent
      real(wp) :: gap_tolerance = most_stand_off     !! fraction of element size; 0: no limit
      type(contact_options_t) :: options
      logical :: resolves_overclosure = .false.      !! what is closed at the start opens to 0
      integer :: overclosure_amplitude = 0           !! part that is left over time; 0: linear to 0
   end type step_contact_t

   type :: step_t
      type(origin_t) :: origin
      type(scheme_row_t) :: scheme                   !! code 0: no procedure was read
      type(scheme_choice_t) :: choice                !! by *TIME INTEGRATION
      logical :: nlgeom = .false.                    !! displacements are large
      logical :: stabilizes = .false.                !! statics: what no load works on may be free
      !> Statics: part of its strain energy that viscous stress takes from the first increment
      real(wp) :: stabilization = 0.0_wp
      type(step_time_t) :: time
      type(step_solution_t) :: solution
      type(step_contact_t) :: contact
      integer :: restart_frequency = 0               !! 0: no restart file
      type(prescribed_t), allocatable :: prescribed(:)   !! all that hold in this step
      type(turn_t), allocatable :: turn(:)               !! of rigid bodies, in this step
      type(load_t), allocatable :: load(:)               !! all that act in this step
      type(output_t), allocatable :: output(:)           !! all that hold in this step
   end type step_t

contains

   elemental logical function step_is_dynamic(step)
      type(step_t), intent(in) :: step

      step_is_dynamic = step%scheme%has_inertia
   end function step_is_dynamic

   !> The part that the squares of displacements have in its strains: theory (6).
   elemental real(wp) function step_square(step)
      type(step_t), intent(in) :: step

      step_square = merge(1.0_wp, 0.0_wp, step%nlgeom)
   end function step_square

   !> How contact begins in a step: one of `initiation_`, none in statics.
   elemental integer function step_initiation(step)
      type(step_t), intent(in) :: step

      step_initiation = merge(step%contact%initiation, initiation_none, step_is_dynamic(step))
   end function step_initiation

   !> Does a prescribed degree of freedom stay where the step finds it, if that is dynamic?
   elemental logical function prescribed_rests(prescribed)
      type(prescribed_t), intent(in) :: prescribed

      prescribed_rests = prescribed%is_frozen .or. (prescribed%amplitude == 0 .and. &
         .not. abs(prescribed%value - prescribed%before) > 0.0_wp)
      prescribed_rests = prescribed_rests .and. prescribed%turn == 0
   end function prescribed_rests

   !> Where a degree of freedom stands in the list; 0: it is not prescribed.
   pure integer function prescribed_find(list, node, dof) result(k)
      type(prescribed_t), intent(in) :: list(:)
      integer, intent(in) :: node                !! from 1
      integer, intent(in) :: dof                 !! 1..n_dim

      do k = 1, size(list)
         if (list(k)%node == node .and. list(k)%dof == dof) return
      end do
      k = 0
   end function prescribed_find

end module emcon_steps
