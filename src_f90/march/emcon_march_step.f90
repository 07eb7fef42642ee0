!> One step in time: first guess, solution, the judge's look at it, and what follows from it.
module emcon_march_step
   use emcon_active_set, only : active_set_begin, active_set_could_hold, active_set_may_turn, &
      step_diverged, &
      step_done, step_overlaps, step_refused, step_singular, step_unbalanced
   use emcon_active_set_solve, only : active_set_solve
   use emcon_amplitudes, only : find_amplitude_value
   use emcon_blocked_contact, only : blocked_contact_text
   use emcon_constraints, only : constraint_index
   use emcon_errors, only : err_analysis, error_t, raise
   use emcon_explicit, only : explicit_begin, explicit_end, explicit_fly
   use emcon_guards, only : guard_slack
   use emcon_overlap_check, only : overlap_check_step, overlap_t
   use emcon_factor_policy, only : factor_policy_forget, factor_policy_step
   use emcon_kept_factor, only : kept_factor_let_iterate, kept_factor_renew
   use emcon_kinds, only : wp
   use emcon_march_accuracy, only : accuracy_judge
   use emcon_march_commit, only : march_commit
   use emcon_march_events, only : events_judge, events_look
   use emcon_march_guess, only : march_guess
   use emcon_march_past, only : march_past_begin
   use emcon_march_snap, only : snap_judge
   use emcon_march_types, only : step_check_begin, increment_t, march_t, part_t
   use emcon_motion, only : at_rest, motion_of, motion_t
   use emcon_layer, only : layer_settle
   use emcon_phases, only : phase_enter, phase_factorise, phase_judge, phase_leave, &
      phase_restitution
   use emcon_evaluation, only : evaluation_at_end, evaluation_has_inertia, instant_later
   use emcon_scene, only : scene_t
   use emcon_state, only : state_t
   use emcon_steps, only : method_null_space
   use emcon_system, only : system_find_energy, system_loads, system_release_tangent, system_respond
   use emcon_term, only : role_internal
   use emcon_text, only : joined, note_add, string_t, to_text
   use emcon_motion_bound, only : largest_motion
   implicit none
   private
   public :: march_step, nodes_text

   !> New overlap beyond this, by the edge, cuts an increment, down to this level of its halvings.
   real(wp), parameter :: deepest_new = 1.2_wp*guard_slack
   integer, parameter :: judge_levels = 5
   !> Nodes named in a message.
   integer, parameter :: most_named = 10

contains

   !> One step; if it succeeds the state and the works are moved on.
   subroutine march_step(self, scene, part, increment, status, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(part_t), intent(in) :: part
      type(increment_t), intent(inout) :: increment
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      type(increment_t) :: found                 ! of the step
      character(len=:), allocatable :: text
      integer :: left

      self%layer%needs_mass = .false.
      call step_check_begin(self%step_check)
      self%active%rules%may_cut = part%may_cut
      self%active%rules%gap_tolerance &
         = scene%step(self%state%clock%i_step)%contact%gap_tolerance
      self%active%start%left = [overclosure_left(scene, self%state, part%start%step_time), &
         overclosure_left(scene, self%state, part%start%step_time + part%h)]
      call solve(self, scene, part, increment, status, error)
      if (status /= step_done .or. allocated(error)) return
      self%layer%is_settled = .false.
      if (self%layer%is_on .and. evaluation_has_inertia(self%motion%evaluation)) then
         call phase_enter(self%system%phases, phase_restitution, left)
         call settle(self, scene, part, status, error)
         call phase_leave(self%system%phases, left)
      end if
      if (status /= step_done .or. allocated(error)) return
      self%end_state%du = self%motion%du
      if (self%layer%is_settled) self%end_state%du = self%end_state%du + self%layer%du
      call overlap_check(self, scene, part, increment%h, found, status)
      if (status == step_done .and. self%grid%judges_size) call judge_size(self, scene, part, &
         status)
      if (status == step_done) call find_ending(self, scene, part, status, error)
      if (status /= step_done .or. allocated(error)) return
      call keep_overlap(found, increment)
      if (any(self%active%is_left_out)) then
         call blocked_contact_text(self%system, scene, self%active%is_left_out, text)
         if (len(text) > 0) then
            call raise(error, err_analysis, "at time " // to_text(part%start%total_time &
               + part%h, 9) // " " // text)
            return
         end if
      end if
      call march_commit(self, scene, part%h, increment, error)
   end subroutine march_step

   !> The way over the step and the constraints that act in it, from the first guess on; from rest
   !> if there are no forces there.
   subroutine solve(self, scene, part, increment, status, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(part_t), intent(in) :: part
      type(increment_t), intent(inout) :: increment
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      logical :: is_done
      integer :: attempt

      status = step_refused
      if (self%explicit%is_on) call explicit_begin(self, scene, part, error)
      if (.not. allocated(error)) call march_past_begin(self, scene, part%start, error)
      if (.not. allocated(error)) call keep_factor(self, part, error)
      if (allocated(error)) return
      do attempt = 1, 2
         call march_guess(self, scene, part%start, part%h, is_at_rest=attempt == 2)
         call active_set_begin(self%active, self%system, self%motion, self%state)
         if (self%explicit%is_on) then
            call explicit_fly(self, part%h, is_done, status)
            if (is_done) return
         end if
         call active_set_solve(self%active, self%system, scene, self%newton, &
            self%motion, status, error)
         if (allocated(error)) return
         increment%n_newton = increment%n_newton + self%active%n_newton
         ! Where contacts are at play the guess may lie on the other side of one.
         is_done = .not. any(status == [step_refused, step_diverged, step_singular])
         if (.not. any(self%active%is_candidate)) is_done = status /= step_refused .or. &
            self%active%n_newton > 0
         if (is_done) exit
      end do
   end subroutine solve

   !> Is the step too long for the tolerance, or for an event that lies in it?
   subroutine judge_size(self, scene, part, status)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(part_t), intent(in) :: part
      integer, intent(inout) :: status           !! one of the `step_` codes
      real(wp) :: window

      associate (step => scene%step(self%state%clock%i_step))
         call events_look(self)
         window = real(self%grid%n_window, wp)/real(self%grid%n_unit, wp)*step%time%h
         if (window > 0.0_wp) call events_judge(self, step, part, window, status)
         if (step%time%tolerance > 0.0_wp .and. status == step_done) call accuracy_judge(self, &
            part, step%time%tolerance, status)
      end associate
   end subroutine judge_size

   !> Find out whether a factor may be kept in the step, and make the one that is kept again where
   !> it was lost, as in a run that was resumed.
   subroutine keep_factor(self, part, error)
      type(march_t), intent(inout) :: self
      type(part_t), intent(in) :: part
      type(error_t), allocatable, intent(out) :: error
      type(motion_t) :: motion
      logical :: is_lost
      integer :: left

      associate (factor_policy => self%newton%factor_policy, correction => self%newton%correction)
         ! Iterations have a matrix of their own; friction and condensed contacts read the tangent.
         if (self%system%n_constraint == 0 .and. correction%kept%is_made &
            .and. correction%kept%blocks%is_incomplete) call system_release_tangent(self%system)
         factor_policy%is_allowed = factor_policy%is_wanted &
            .and. .not. (self%active%near_laws%is_on .or. self%active%support%is_needed) &
            .and. (correction%method == method_null_space .or. self%system%n_constraint == 0)
         if (self%active%friction%is_on) factor_policy%is_allowed = factor_policy%is_allowed &
            .and. active_set_may_turn(self%active, self%system)
         ! What rubs or gives way is found by what each contact moves, which a factor tells; without
         ! mass iterations take as many steps as a factor costs.
         call kept_factor_let_iterate(correction%kept, factor_policy%is_wanted .and. &
            evaluation_has_inertia(self%scheme%evaluation(part%start, part%h)) .and. &
            (self%system%n_constraint == 0 .or. .not. (self%active%friction%is_on .or. &
            self%active%penalty%is_on .or. self%state%base%iterates_no_more)))
         call factor_policy_step(factor_policy, correction, self%state%base, part%start, part%h, &
            self%state%clock%increment, is_lost)
         if (.not. is_lost) return
         motion = motion_of(self%scheme%evaluation(factor_policy%base%start, &
            factor_policy%base%h), self%motion%x, factor_policy%base%u0, factor_policy%base%du)
         call system_respond(self%system, motion, .true.)
         if (.not. (allocated(self%system%response%refusal) .or. &
            allocated(self%system%response%failure))) then
            call phase_enter(self%system%phases, phase_factorise, left)
            call kept_factor_renew(correction%kept, self%system%matrix, error)
            call phase_leave(self%system%phases, left)
         end if
         if (.not. correction%kept%is_made) call factor_policy_forget(factor_policy, correction)
      end associate
   end subroutine keep_factor

   !> Balance what has no mass, where contacts have opened or closed.
   subroutine settle(self, scene, part, status, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(part_t), intent(in) :: part
      integer, intent(inout) :: status           !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      type(motion_t) :: end_state
      real(wp) :: load(size(scene%x, 1), size(scene%x, 2))

      end_state = motion_of(evaluation_at_end, scene%x, self%motion%u0, self%motion%du)
      end_state%evaluation%load_instant = instant_later(part%start, part%h)
      call system_loads(self%system, end_state, load)
      call layer_settle(self%layer, self%motion, self%active, load, status, error)
      if (status /= step_done) status = step_unbalanced
   end subroutine settle

   !> Look at the end of the solved step, where the scheme evaluates forces before it.
   subroutine find_ending(self, scene, part, status, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(part_t), intent(in) :: part
      integer, intent(inout) :: status           !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      type(motion_t) :: place
      logical :: is_elsewhere

      if (self%explicit%is_on) then
         call explicit_end(self, scene, part, is_elsewhere, error)
         if (is_elsewhere) status = step_refused
         return
      end if
      is_elsewhere = self%motion%evaluation%at < 1.0_wp .or. self%layer%is_settled
      associate (system => self%system, motion => self%motion, end_state => self%end_state)
         if (is_elsewhere) then
            place = motion_of(evaluation_at_end, motion%x, motion%u0, end_state%du)
            call system_respond(system, place, .false.)
            call system_find_energy(system, place)
         else
            call system_find_energy(system, motion)
         end if
         if (allocated(system%response%failure)) allocate(error, source=system%response%failure)
         if (allocated(system%response%refusal)) status = step_refused
         if (status /= step_done .or. allocated(error)) return
         end_state%force = system%response%part(role_internal)%force
         end_state%energy = system%response%energy
         end_state%potential = system%response%potential
         if (is_elsewhere) call system_respond(system, motion, .false.)
      end associate
      call snap_judge(self, scene, part, status, error)
   end subroutine find_ending

   !> The part of the overclosure at the start of the step that is left at `step_time`.
   pure real(wp) function overclosure_left(scene, state, step_time)
      type(scene_t), intent(in) :: scene
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: step_time          !! [T]
      real(wp) :: slope

      associate (step => scene%step(state%clock%i_step))
         overclosure_left = 1.0_wp - step_time/step%time%duration
         if (step%contact%overclosure_amplitude == 0) return
         associate (amplitude => scene%amplitude(step%contact%overclosure_amplitude))
            call find_amplitude_value(amplitude, step_time, overclosure_left, slope)
         end associate
      end associate
   end function overclosure_left

   !> Look at the overlap of bodies in the solved step: it may cut the step.
   subroutine overlap_check(self, scene, part, h, found, status)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(part_t), intent(in) :: part
      real(wp), intent(in) :: h                  !! of the increment, > 0 [T]
      type(increment_t), intent(inout) :: found  !! `overlap` and `stray` of the step are set
      integer, intent(inout) :: status
      integer :: left

      if (self%overlap_check%n_piece == 0) return
      call phase_enter(self%system%phases, phase_judge, left)
      associate (overlap => found%overlap)
         if (self%active%motion_bound%total &
            + largest_motion(self%end_state%du) >= self%overlap_check%clear_until) then
            call overlap_check_step(self%overlap_check, scene%x, self%state%u, self%end_state%du, &
               overlap)
            self%overlap_check%clear_until = self%active%motion_bound%total &
               + self%overlap_check%clearance
            found%stray = self%overlap_check%stray
         end if
         overlap%depth = max(0.0_wp, overlap%depth &
            - self%active%start%left(1)*self%overlap_check%meant_overlap)
         if (part%may_cut .and. part%h > scale(h, -judge_levels)) then
            if (goes_in(self, scene, overlap)) status = step_overlaps
         end if
      end associate
      call phase_leave(self%system%phases, left)
   end subroutine overlap_check

   !> Keep the deepest overlap of the steps of an increment.
   pure subroutine keep_overlap(found, increment)
      type(increment_t), intent(in) :: found     !! of the step that succeeded
      type(increment_t), intent(inout) :: increment
      real(wp) :: of_facets

      of_facets = max(found%overlap%of_facets, increment%overlap%of_facets)
      if (found%overlap%depth > increment%overlap%depth) increment%overlap = found%overlap
      increment%overlap%of_facets = of_facets
      if (found%stray%depth > increment%stray%depth) increment%stray = found%stray
   end subroutine keep_overlap

   !> Has the step brought bodies deeper into each other than guards allow, at nodes that contact of
   !> both sides could hold and does not? In a smaller step it sees them come.
   logical function goes_in(self, scene, overlap)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(overlap_t), intent(in) :: overlap
      type(overlap_t) :: before

      goes_in = .false.
      if (overlap%depth <= deepest_new .or. self%active%penalty%is_on) return
      if (.not. active_set_could_hold(self%active, self%system, overlap)) return
      call overlap_check_step(self%overlap_check, scene%x, self%state%u, at_rest(self%motion%du), &
         before)
      goes_in = overlap%depth > before%depth + 0.1_wp*deepest_new
   end function goes_in

   !> The slave nodes of the constraints that `is_meant` marks.
   subroutine nodes_text(self, scene, is_meant, text)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: is_meant(:)         !! (n_constraint)
      character(len=:), allocatable, intent(out) :: text   !! names nodes by their labels
      type(string_t) :: found(size(is_meant))
      integer :: id, n, pair, i

      n = 0
      do id = 1, size(is_meant)
         if (.not. is_meant(id)) cycle
         call constraint_index(self%system, id, pair, i)
         if (pair == 0) cycle
         n = n + 1
         found(n)%text = to_text(scene%node%label(self%system%contact(pair)%contact%node(i)))
      end do
      text = joined(found(:n), ", ", most_named)
   end subroutine nodes_text

end module emcon_march_step
