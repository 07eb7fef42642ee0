! build: holder
!> Steps of any size, and the state in and out: what scripts need beyond the grid of the deck.
!>
!> The state is read from `stepper%march%state`, energies and momenta from `stepper%march%ledger`.
module emcon_stepper_free
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_at_end
   use emcon_gaps, only : gaps_forget
   use emcon_kinds, only : wp
   use emcon_ledger, only : ledger_measure, ledger_t
   use emcon_march, only : increment_t, march_begin_step, march_free_increment, march_go_back, &
      march_resume, &
      march_set_time
   use emcon_march_guess, only : follow_links
   use emcon_march_past, only : march_past_forget
   use emcon_motion, only : at_rest, motion_of, motion_t
   use emcon_pair_record, only : pair_record_init
   use emcon_pair_sums, only : pair_sums_begin
   use emcon_rigid_rotation, only : rigid_rotation_init
   use emcon_state, only : state_t
   use emcon_step_control, only : control_forget
   use emcon_stepper, only : stepper_check_solids, stepper_t
   use emcon_stepper_check, only : check_field, check_list, check_number, check_size, &
      check_that, stepper_check_open
   use emcon_steps, only : step_is_dynamic
   use emcon_system, only : system_check_response, system_find_energy, system_respond
   use emcon_term, only : role_internal
   use emcon_text, only : to_text
   use emcon_verdict, only : verdict_move, verdict_t, verdict_update
   implicit none
   private
   public :: stepper_step, stepper_next_step, stepper_set_state
   public :: snapshot_t, stepper_snapshot, stepper_restore

   !> Smaller than this part of the time that has passed in the step of the deck, no step is made:
   !> time would not tell it from its start.
   real(wp), parameter :: least_step = 1.0e4_wp*epsilon(1.0_wp)

   !> A state to come back to: all that the next step depends on but the conditions of the step.
   type :: snapshot_t
      logical :: is_taken = .false.
      type(state_t) :: state
      type(ledger_t) :: ledger
      type(verdict_t) :: verdict
   end type snapshot_t

contains

   !> One step of the size `h` under the conditions of the present step of the deck, cut into parts
   !> where it fails. It may end anywhere, also after the end of the deck's step: amplitudes and
   !> linear runs keep their last value there. `stepper_advance` goes on from points of the deck's
   !> grid only; a step that ends at one to within the rounding of time ends at it exactly. On an
   !> error the state is that before the call.
   subroutine stepper_step(self, h, increment, error)
      type(stepper_t), intent(inout) :: self
      real(wp), intent(in) :: h                      !! > 0 [T]
      type(increment_t), intent(out) :: increment
      type(error_t), allocatable, intent(out) :: error

      call stepper_check_open(self, error)
      call stepper_check_solids(self, error)
      call check_that(ieee_is_finite(h), "a step needs a size h > 0 that is finite", error)
      if (allocated(error)) return
      call check_that(h > least_step*self%march%state%clock%step_time, &
         "a step needs a size h > 0 " // "that time " // to_text(self%march%state%clock%time) &
         // " can tell, not " // to_text(h), error)
      if (allocated(error)) return
      call march_free_increment(self%march, self%scene, h, increment, error)
      if (.not. allocated(error)) call verdict_update(self%verdict, self%scene, self%march, &
         increment)
   end subroutine stepper_step

   !> Begin the next step of the deck at the present time, wherever that is.
   subroutine stepper_next_step(self, error)
      type(stepper_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error   !! the present step goes on
      type(snapshot_t) :: before

      call stepper_check_open(self, error)
      associate (i_step => self%march%state%clock%i_step)
         if (.not. allocated(error)) call check_that(i_step < size(self%scene%step), &
            "step " // to_text(i_step) // " is the last one of the deck", error)
      end associate
      if (allocated(error)) return
      call stepper_snapshot(self, before)
      call march_begin_step(self%march, self%scene, self%march%state%clock%i_step + 1, error)
      if (allocated(error)) call put_back(self, before)
   end subroutine stepper_next_step

   !> Go back to `before`, after a step of the deck did not begin.
   subroutine put_back(self, before)
      type(stepper_t), intent(inout) :: self
      type(snapshot_t), intent(in) :: before
      type(error_t), allocatable :: ignored

      self%march%state = before%state
      call march_resume(self%march, self%scene, ignored)
      call march_go_back(self%march, before%state, before%ledger)
   end subroutine put_back

   !> Put the given parts of the state in place of the present ones; on an error nothing changes.
   !> Dependent nodes of ties and equations follow the others. Energies and momenta are measured
   !> anew, the works stand. With `u` the forces of the last step are forgotten: contact forces,
   !> reactions and what the pairs transmit are zero until the next step.
   subroutine stepper_set_state(self, error, u, v, lam, is_active, time)
      type(stepper_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: u(:, :)      !! (2, n_node) [L]
      real(wp), intent(in), optional :: v(:, :)      !! (2, n_node) [L/T]; 0 in statics
      !> (n_constraint) contact forces, 0 where a constraint does not act [M L/T^2]
      real(wp), intent(in), optional :: lam(:)
      logical, intent(in), optional :: is_active(:)  !! (n_constraint) what acted in the last step
      real(wp), intent(in), optional :: time         !! total, not before the step's start [T]
      type(state_t) :: next
      type(ledger_t) :: before

      call stepper_check_open(self, error)
      if (allocated(error)) return
      next = self%march%state
      before = self%march%ledger
      if (present(u)) call take_field(self, u, "u", next%u, error)
      if (present(v)) call take_field(self, v, "v", next%v, error)
      call take_contact(next, lam, is_active, error)
      call check_motion(self, next%v, error, time)
      if (present(u)) call measure_rest(self, next, error)
      if (allocated(error)) return
      if (present(u)) next%contacts%closure = 1.0_wp
      if (present(u)) next%contacts%stretch = 0.0_wp
      next%base%is_set = .false.
      call control_forget(next%control)
      call march_go_back(self%march, next, self%march%ledger)
      call gaps_forget(self%march%system)
      if (present(time)) call march_set_time(self%march, self%scene, &
         time - self%march%state%clock%start_time)
      call ledger_measure(self%march%ledger, self%march%system, self%scene%x, self%march%state)
      call verdict_move(self%verdict, before, self%march%ledger)
   end subroutine stepper_set_state

   !> Take over a nodal field called `name`.
   subroutine take_field(self, given, name, field, error)
      type(stepper_t), intent(in) :: self
      real(wp), intent(in) :: given(:, :)
      character(len=*), intent(in) :: name
      real(wp), intent(inout), contiguous :: field(:, :)     !! (n_dim, n_node)
      type(error_t), allocatable, intent(inout) :: error

      call check_field(name, given, self%scene, error)
      if (allocated(error)) return
      field = given
      call follow_links(self%march%system, field)
   end subroutine take_field

   !> Take over which constraints act, and their multipliers.
   subroutine take_contact(next, lam, is_active, error)
      type(state_t), intent(inout) :: next
      real(wp), intent(in), optional :: lam(:)
      logical, intent(in), optional :: is_active(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: i

      if (present(is_active)) then
         call check_size("the active set", size(is_active), size(next%contacts%lam), error)
         if (allocated(error)) return
         next%contacts%is_active = is_active
         where (.not. is_active) next%contacts%lam = 0.0_wp
      end if
      if (.not. present(lam)) return
      call check_list("lam", lam, size(next%contacts%lam), error)
      if (allocated(error)) return
      i = next%contacts%stray(lam)
      call check_that(i == 0, "lam is not 0 at constraint " // to_text(i) // &
         ", which does not act", error)
      next%contacts%lam = lam
   end subroutine take_contact

   !> Velocities and time have to fit the present step of the deck.
   subroutine check_motion(self, v, error, time)
      type(stepper_t), intent(in) :: self
      real(wp), intent(in) :: v(:, :)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in), optional :: time

      if (allocated(error)) return
      associate (state => self%march%state, step => self%scene%step(self%march%state%clock%i_step))
         call check_that(step_is_dynamic(step) .or. .not. any(abs(v) > 0.0_wp), "step " // &
            to_text(state%clock%i_step) // " of the deck is static: there are no velocities", error)
         if (.not. present(time)) return
         call check_number("the time", time, error)
         if (allocated(error)) return
         call check_that(time >= state%clock%start_time, "time " // to_text(time) &
            // " is before the " // "start of step " // to_text(state%clock%i_step) &
            // " of the deck, " // to_text(state%clock%start_time), error)
      end associate
   end subroutine check_motion

   !> Internal forces and strain energy at the displacement of `next`, which no step has led to.
   subroutine measure_rest(self, next, error)
      type(stepper_t), intent(inout) :: self
      type(state_t), intent(inout) :: next
      type(error_t), allocatable, intent(inout) :: error
      type(motion_t) :: place

      if (allocated(error)) return
      associate (system => self%march%system)
         place = motion_of(evaluation_at_end, self%scene%x, next%u, at_rest(next%u))
         call system_respond(system, place, .false.)
         call system_check_response(system, "u", error)
         if (allocated(error)) return
         next%internal = system%response%part(role_internal)%force
         call system_find_energy(system, place)
         next%energy = system%response%energy
         next%potential = system%response%potential
         next%contact = 0.0_wp
         next%friction = 0.0_wp
         call march_past_forget(next)
         next%reaction = 0.0_wp
         call rigid_rotation_init(next%turns, self%scene%rigid, self%scene%x, next%u)
         call pair_record_init(next%pairs, system)
         call pair_sums_begin(next%sums%sum)
      end associate
   end subroutine measure_rest

   !> Keep the present state in `snapshot`.
   subroutine stepper_snapshot(self, snapshot)
      type(stepper_t), intent(in) :: self
      type(snapshot_t), intent(out) :: snapshot

      snapshot%is_taken = allocated(self%march%scheme)
      snapshot%state = self%march%state
      snapshot%ledger = self%march%ledger
      snapshot%verdict = self%verdict
   end subroutine stepper_snapshot

   !> Go back, or forward, to the state in `snapshot`: what follows has the same bits. The step of
   !> the deck is the one of the snapshot, with the loads and boundary values that it has now.
   subroutine stepper_restore(self, snapshot, error)
      type(stepper_t), intent(inout) :: self
      type(snapshot_t), intent(in) :: snapshot
      type(error_t), allocatable, intent(out) :: error   !! the present state stays
      type(snapshot_t) :: before

      call stepper_check_open(self, error)
      if (.not. allocated(error)) call check_that(fits(self%march%state, snapshot), &
         "this state was not taken from this model", error)
      if (allocated(error)) return
      call stepper_snapshot(self, before)
      self%march%state = snapshot%state
      if (snapshot%state%clock%i_step /= before%state%clock%i_step) then
         call march_resume(self%march, self%scene, error)
         if (allocated(error)) then
            call put_back(self, before)
            return
         end if
         self%march%state = snapshot%state
      end if
      call march_go_back(self%march, snapshot%state, snapshot%ledger)
      self%verdict = snapshot%verdict
      call gaps_forget(self%march%system)
   end subroutine stepper_restore

   !> Is the snapshot of a model of the same size as that of `state`?
   pure logical function fits(state, snapshot)
      type(state_t), intent(in) :: state
      type(snapshot_t), intent(in) :: snapshot

      fits = snapshot%is_taken
      if (fits) fits = size(snapshot%state%u) == size(state%u) &
         .and. size(snapshot%state%contacts%lam) == size(state%contacts%lam) &
         .and. size(snapshot%state%energy) == size(state%energy)
   end function fits

end module emcon_stepper_free
