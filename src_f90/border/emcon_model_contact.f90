!> C functions for contact over a step of a host's own, in Fortran, where C says it otherwise than
!> the stepper. What each does is said in emcon.h.
module emcon_model_contact
   use, intrinsic :: iso_c_binding, only : c_double
   use emcon_c_types, only : contact_settings_c, gap_c, pair_options_c
   use emcon_contact, only : gap_state_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_damping_t, contact_options_t, interaction_t
   use emcon_kinds, only : wp
   use emcon_model, only : model_t
   use emcon_overlap_check, only : overlap_t
   use emcon_stepper_contact, only : query_gaps, query_overlap, query_select
   use emcon_stepper_host, only : stepper_add_pair, stepper_set_contact
   use emcon_stepper_problem, only : query_select_candidates
   use emcon_steps, only : initiation_persistent
   implicit none
   private
   public :: model_add_pair, model_set_contact, model_gaps, model_select, model_overlap
   public :: model_select_candidates

contains

   subroutine model_add_pair(model, slave, master, formulation, options, error)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: slave, master, formulation
      type(pair_options_c), intent(in), optional :: options
      type(error_t), allocatable, intent(out) :: error
      type(contact_options_t) :: choice
      type(interaction_t) :: interaction

      real(wp) :: adjust

      adjust = 0.0_wp
      if (present(options)) then
         choice = chosen(options)
         interaction%friction = real(options%friction, wp)
         interaction%damping = contact_damping_t(real(options%damping, wp), &
            real(options%damping_clearance, wp), real(options%damping_flat, wp), &
            real(options%tangent_fraction, wp))
         adjust = real(options%adjust, wp)
      end if
      call stepper_add_pair(model%stepper, slave, master, formulation, choice, error, interaction, &
         adjust)
   end subroutine model_add_pair

   !> The options of a pair; 0 is the default.
   pure type(contact_options_t) function chosen(wanted)
      type(pair_options_c), intent(in) :: wanted

      if (wanted%integration /= 0) chosen%integration = wanted%integration
      chosen%n_point = wanted%n_point
      if (wanted%multiplier /= 0) chosen%multiplier = wanted%multiplier
      if (wanted%normal /= 0) chosen%normal = wanted%normal
      if (wanted%smoothing /= 0) chosen%smoothing = wanted%smoothing
      if (is_set(wanted%normal_angle)) chosen%normal_angle = real(wanted%normal_angle, wp)
      if (is_set(wanted%smoothing_angle)) chosen%smoothing_angle = real(wanted%smoothing_angle, wp)
   end function chosen

   !> Is a number not 0? One that is none is set, and refused later.
   pure logical function is_set(value)
      real(c_double), intent(in) :: value

      is_set = .not. abs(value) <= 0.0_c_double
   end function is_set

   subroutine model_set_contact(model, settings, error)
      type(model_t), intent(inout) :: model
      type(contact_settings_c), intent(in) :: settings
      type(error_t), allocatable, intent(out) :: error
      integer :: initiation

      initiation = initiation_persistent
      if (settings%initiation /= 0) initiation = settings%initiation
      call stepper_set_contact(model%stepper, initiation, real(settings%gap_tolerance, wp), &
         settings%is_last_try == 0, settings%is_end /= 0, error)
   end subroutine model_set_contact

   subroutine model_gaps(model, u0, du, gap, error)
      type(model_t), intent(inout) :: model
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :) !! (n_dim, n_node)
      type(gap_c), allocatable, intent(out) :: gap(:)        !! (n_constraint)
      type(error_t), allocatable, intent(out) :: error
      type(gap_state_t), allocatable :: state(:)

      call query_gaps(model%query, model%stepper, u0, du, state, error)
      if (allocated(error)) return
      allocate(gap(size(state)))
      gap%is_near = merge(1, 0, state%is_near)
      gap%is_over = merge(1, 0, state%is_over)
      gap%gap0 = real(state%gap0, c_double)
      gap%gap1 = real(state%gap1, c_double)
      gap%size = real(state%size, c_double)
   end subroutine model_gaps

   subroutine model_select(model, u0, du, active, n, error)
      type(model_t), intent(inout) :: model
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :) !! (n_dim, n_node)
      logical, intent(in) :: active(:)                       !! (n_constraint)
      integer, intent(out) :: n
      type(error_t), allocatable, intent(out) :: error

      call query_select(model%query, model%stepper, u0, du, active, error)
      n = 0
      if (.not. allocated(error)) n = model%query%march%active%set%n_row
   end subroutine model_select

   subroutine model_select_candidates(model, u0, du, active, n, error)
      type(model_t), intent(inout) :: model
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :) !! (n_dim, n_node)
      logical, intent(in) :: active(:)                       !! (n_constraint)
      integer, intent(out) :: n
      type(error_t), allocatable, intent(out) :: error

      call query_select_candidates(model%query, model%stepper, u0, du, active, error)
      n = 0
      if (.not. allocated(error)) n = model%query%march%active%set%n_row
   end subroutine model_select_candidates

   subroutine model_overlap(model, u0, du, depth, node, error)
      type(model_t), intent(inout) :: model
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :) !! (n_dim, n_node)
      real(wp), intent(out) :: depth
      integer, intent(out) :: node
      type(error_t), allocatable, intent(out) :: error
      type(overlap_t) :: overlap

      call query_overlap(model%query, model%stepper, u0, du, overlap, error)
      depth = overlap%depth
      node = overlap%node
   end subroutine model_overlap

end module emcon_model_contact
