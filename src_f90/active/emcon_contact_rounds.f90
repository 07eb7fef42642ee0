!> A step as one problem of its contacts: first sets of them are tried (emcon_contact_sets); where
!> none stands emcon_contact_newton solves the step with all candidates. Source: docs/theory.md,
!> section 6.1.
module emcon_contact_rounds
   use emcon_active_set, only : active_set_may_turn, active_set_mixes, active_set_select, &
      active_set_slides, active_set_t, candidates_clear, step_cycling, step_done, step_not_held
   use emcon_constraint_rows, only : constraints_rows
   use emcon_constraints, only : constraints_evaluate
   use emcon_contact_candidates, only : candidates_are_many, &
      candidates_are_too_many, candidates_keep_forces, candidates_look, candidates_select
   use emcon_contact_conditions, only : gap_noise
   use emcon_contact_newton, only : contact_newton_free, contact_newton_solve, &
      contact_newton_suits, contact_newton_t
   use emcon_contact_sets, only : contact_sets_begin_anew, contact_sets_hold, contact_sets_solve, &
      contact_sets_solve_by_laws
   use emcon_contact_support, only : contact_support_forget
   use emcon_coulomb_law, only : contact_open, coulomb_t, slip_status_t
   use emcon_errors, only : error_t
   use emcon_factor_policy, only : factor_policy_complete
   use emcon_friction, only : friction_look_back
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_evaluate, motion_t
   use emcon_newton, only : newton_converged, newton_early, newton_measure_forces, &
      newton_redundant, newton_refused, newton_solve, newton_t
   use emcon_scene, only : scene_t
   use emcon_system, only : system_respond, system_stiffen, system_t
   implicit none
   private
   public :: contact_rounds_solve, contact_rounds_stand

   !> Rounds with all candidates at most.
   integer, parameter :: most_rounds = 100

contains

   !> Solve the step that has begun; `motion%du` is the first guess and the result.
   subroutine contact_rounds_solve(self, system, scene, newton, motion, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      logical :: leads, goes_on

      call candidates_clear(self%candidates)
      if (self%penalty%is_on) then
         if (self%support%is_needed) call contact_sets_hold(self, system, scene, newton%driven, &
            motion)
         status = step_not_held
         if (allocated(self%support%text)) return
         call contact_sets_solve_by_laws(self, system, newton, motion, status, error)
         return
      end if
      if (turns(self, system) .or. (.not. self%support%is_needed .and. &
         contact_newton_suits(newton, motion, count(self%candidates%began)))) then
         call begin_again(self, system, motion)
         call solve_with_all(self, system, newton, motion, status, error)
         if (status == step_done .or. allocated(error)) return
         call contact_sets_begin_anew(self, newton, motion)
         call candidates_clear(self%candidates)
      end if
      self%friction%follows = active_set_may_turn(self, system)
      call contact_sets_solve(self, system, scene, newton, motion, status, error)
      if (allocated(error)) return
      if (.not. self%candidates%is_settled) then
         call factor_policy_complete(newton%factor_policy, newton%correction, goes_on)
         if (goes_on) then
            call contact_sets_begin_anew(self, newton, motion)
            self%is_active = self%candidates%began
            call begin_again(self, system, motion)
            call contact_sets_solve(self, system, scene, newton, motion, status, error)
            if (allocated(error)) return
         end if
      end if
      if (self%candidates%is_settled) then
         leads = .false.
         if (status == step_done .and. self%friction%looks_back) call friction_look_back( &
            self%friction, system, self%set, motion, .false., leads)
         if (.not. leads) return
      end if
      if (size(system%contact) == 0) return
      if (status == newton_refused .and. newton%n_solve == 0) return    ! nor are there forces below
      call solve_together(self, system, scene, newton, motion, status, error)
   end subroutine contact_rounds_solve

   !> No set stands: with all candidates, from where the sets have led to, or from the first guess
   !> on where they lead astray.
   subroutine solve_together(self, system, scene, newton, motion, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      !> In: why none stands, one of the `newton_` codes; out: one of the `step_` codes
      integer, intent(inout) :: status
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: slides    ! what friction at its limit leaves free
      logical, allocatable :: known(:)           ! candidates so far
      logical :: follows                         ! rows of the last set follow from others

      follows = status == newton_redundant
      status = step_cycling
      if (candidates_are_too_many(self)) return
      if (self%support%is_needed) then
         call move_alloc(self%support%text, slides)
         call hold_again(self, system, scene, newton, motion)
         status = step_not_held
         if (allocated(self%support%text)) return
         call begin_again(self, system, motion)
      else if (follows .or. candidates_are_many(self, newton%correction%kept)) then
         known = self%candidates%takes_part
         call contact_sets_begin_anew(self, newton, motion)
         self%is_active = self%candidates%began
         call begin_again(self, system, motion)
         if (follows) self%candidates%takes_part = known .and. .not. self%is_left_out
      end if
      if (self%friction%looks_back) then
         ! Sets share forces of rows that follow from others as it comes; friction turns by that.
         self%lam = self%start%lam0
         self%friction%tau = self%friction%tau0
      end if
      call solve_with_all(self, system, newton, motion, status, error)
      if (status == step_done .or. .not. allocated(slides) .or. allocated(error)) return
      status = step_not_held
      self%support%is_pushed = .true.
      call move_alloc(slides, self%support%text)
   end subroutine solve_together

   !> Does something slide whose way turns, as slip with two components does, and no set say where
   !> to? None does while some of it stops.
   pure logical function turns(self, system)
      type(active_set_t), intent(in) :: self
      type(system_t), intent(in) :: system

      turns = self%friction%looks_back .and. .not. self%support%is_needed
      if (turns) turns = active_set_mixes(self) .or. (active_set_slides(self) .and. &
         .not. active_set_may_turn(self, system))
   end function turns

   !> Hold what contact alone holds, from the first guess on; where slip has a direction with
   !> friction that holds all that touches.
   subroutine hold_again(self, system, scene, newton, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion

      call contact_sets_begin_anew(self, newton, motion)
      self%is_active = self%candidates%began
      if (self%friction%looks_back) self%friction%law%status = slip_status_t()
      call contact_support_forget(self%support)
      call contact_sets_hold(self, system, scene, newton%driven, motion)
      call system_stiffen(system, self%support%hangs, motion)
   end subroutine hold_again

   !> From `motion`, the first guess, with what acted then.
   subroutine begin_again(self, system, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion

      call candidates_clear(self%candidates)
      self%lam = self%start%lam0
      if (self%friction%is_on) self%friction%tau = self%friction%tau0
      call active_set_select(self, system, motion)
      self%candidates%takes_part(self%set%id(:self%set%n)) = &
         .not. self%is_left_out(self%set%id(:self%set%n))
   end subroutine begin_again

   !> Is the motion that was found without contacts a solution of the step?
   subroutine contact_rounds_stand(self, system, motion, is_solved, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(out) :: is_solved          !! also where `status` is a failure
      integer, intent(out) :: status             !! one of the `step_` codes

      call candidates_clear(self%candidates)
      call candidates_look(self, system, motion, status, .true.)
      is_solved = status /= step_done .or. .not. self%candidates%have_changed
   end subroutine contact_rounds_stand

   !> Solve with all candidates until none joins them.
   subroutine solve_with_all(self, system, newton, motion, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      type(contact_newton_t) :: solve

      call solve_in_rounds(self, solve, system, newton, motion, status, error)
      call contact_newton_free(solve)
   end subroutine solve_with_all

   subroutine solve_in_rounds(self, solve, system, newton, motion, status, error)
      type(active_set_t), intent(inout) :: self
      type(contact_newton_t), intent(inout) :: solve     !! keeps its tangent from round to round
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      logical :: leads, has_looked
      integer :: i

      self%friction%follows = .false.
      has_looked = .not. (self%friction%looks_back .and. self%rules%has_impacts)
      newton%looks_early = .false.
      newton%convergence%largest_move = huge(1.0_wp)
      if (.not. self%rules%has_impacts) newton%convergence%largest_move = self%rules%largest_move
      do i = 1, most_rounds
         call candidates_select(self, system, motion)
         associate (set => self%set)
            solve%holds = self%support%is_needed
            solve%early%is_allowed = .not. has_looked
            if (allocated(solve%law)) deallocate(solve%law)
            allocate(solve%law(set%n - set%n_permanent))
            if (self%friction%is_on) solve%law &
               = self%friction%law(set%id(set%n_permanent + 1:set%n))
            if (size(solve%law) == 0 .and. self%rules%has_impacts) then
               call newton_solve(newton, system, set, motion, status, error)
            else
               call contact_newton_solve(solve, newton, system, set, motion, status, error)
            end if
         end associate
         self%n_newton = self%n_newton + newton%convergence%n_iteration
         if (allocated(error)) return
         if (status == newton_early) then
            call look_early(self, solve, system, newton, motion, has_looked, status)
            if (status /= step_done) return
            cycle
         end if
         call keep(self, solve%law)
         if (status /= newton_converged) return
         newton%driven = 0.0_wp                  ! the prescribed motion is in `motion` now
         ! Before stencils are chosen anew: the step was solved with these.
         call finish(self, system, newton, motion, error)
         if (allocated(error)) return
         call candidates_look(self, system, motion, status, .true.)
         if (status /= step_done) return
         if (self%candidates%have_changed) cycle
         leads = .false.
         if (self%friction%looks_back) call friction_look_back(self%friction, system, self%set, &
            motion, .false., leads)
         if (.not. leads) return
      end do
      status = step_cycling
   end subroutine solve_in_rounds

   !> Look at candidates before the step is solved to the end. If they stand, what stops is led
   !> there now: the step need not be solved with what it is not led to. Where slip is measured by
   !> points that will be others it is not told yet how far that is.
   subroutine look_early(self, solve, system, newton, motion, has_looked, status)
      type(active_set_t), intent(inout) :: self
      type(contact_newton_t), intent(inout) :: solve     !! by other laws it begins anew
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(in) :: motion
      logical, intent(inout) :: has_looked       !! and nothing has changed
      integer, intent(out) :: status             !! one of the `step_` codes
      logical :: leads

      newton%driven = 0.0_wp
      call keep(self, solve%law)
      call candidates_look(self, system, motion, status, .false.)
      if (status /= step_done) return
      has_looked = has_looked .or. .not. self%candidates%have_changed
      if (.not. has_looked .or. .not. self%friction%looks_back .or. self%friction%lags) return
      call friction_look_back(self%friction, system, self%set, motion, .true., leads)
      solve%early%is_made = solve%early%is_made .and. .not. leads
   end subroutine look_early

   !> Multipliers and ways of the candidates: what is not open acts.
   subroutine keep(self, law)
      type(active_set_t), intent(inout) :: self
      type(coulomb_t), intent(in) :: law(:)      !! (contacts of the set)
      logical :: acts
      integer :: k

      associate (set => self%set, friction => self%friction)
         call candidates_keep_forces(self)
         self%candidates%acted(:) = self%candidates%acts
         ! Rows that always hold have no law below.
         self%candidates%acts = self%candidates%takes_part
         do k = 1, size(law)
            associate (id => set%id(set%n_permanent + k))
               acts = law(k)%status%kind /= contact_open
               ! What touches holds a body that nothing pushes.
               associate (place => set%n_permanent + k)
                  if (self%support%is_needed) acts = acts .or. &
                     abs(set%defect(place)) <= gap_noise*set%item(place)%size
               end associate
               if (friction%is_on .and. acts) friction%law(id)%status = law(k)%status
               self%candidates%acts(id) = acts
            end associate
         end do
      end associate
      where (self%candidates%acted .neqv. self%candidates%acts) &
         self%candidates%n_change = self%candidates%n_change + 1
      self%is_active = self%candidates%acts
   end subroutine keep

   !> Leave set, rows and forces as the laws hold at the end.
   subroutine finish(self, system, newton, motion, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      type(error_t), allocatable, intent(out) :: error

      call active_set_select(self, system, motion, .true.)
      call motion_evaluate(motion)
      call system_respond(system, motion, .false., .true.)
      if (allocated(system%response%failure)) allocate(error, source=system%response%failure)
      if (allocated(error)) return
      call constraints_evaluate(self%set, system, motion, .true.)
      if (self%set%n_condition > 0) call constraints_rows(self%set, system%space%numbering)
      call newton_measure_forces(newton, system, self%set, motion)
      newton%correction%fell_back = .false.
   end subroutine finish

end module emcon_contact_rounds
