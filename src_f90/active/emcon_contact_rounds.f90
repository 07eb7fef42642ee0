!> A step as one problem of its contacts: which of them take part, and how it is solved.
!>
!> Candidates are what acted at the start of the step and what closes in it; they only grow within a
!> step, but for those that lose their surface, which come back once at most. First sets of them are
!> tried by the null space, beginning with what acted before: in most steps nothing else acts. What
!> is found is checked: all that acts pushes, friction obeys its law, no candidate closes. Where
!> that fails the contacts are condensed by the kept factor, and their problem tells the next set.
!> Where there is no such factor, or no set stands, emcon_contact_newton solves the step with all
!> candidates. Source: docs/theory.md, section 6.
module emcon_contact_rounds
   use emcon_active_set, only : active_set_pass, active_set_select, active_set_t, &
      active_set_update_gaps, candidates_clear, step_cycling, step_done, &
      step_loose, step_not_held, step_too_far
   use emcon_contact_conditions, only : begins_unseen, gap_noise, gap_to_hold, look_at_active, &
      look_at_open, noise_at
   use emcon_constraint_rows, only : constraints_rows
   use emcon_constraints, only : constraint_index, constraint_set_t, constraints_evaluate, &
      constraints_gives_back
   use emcon_contact, only : contact_t
   use emcon_contact_newton, only : contact_newton_solve
   use emcon_contact_problem, only : contact_effort_t, contact_problem_create, &
      contact_problem_solve, contact_problem_status, contact_problem_t
   use emcon_contact_support, only : contact_support_complete, contact_support_forget
   use emcon_coulomb_law, only : contact_open, coulomb_t, slip_status_t
   use emcon_errors, only : error_t
   use emcon_friction, only : friction_close, friction_holds, friction_keep, friction_missed, friction_turn, &
      most_lagged, most_shift
   use emcon_gaps, only : pair_search
   use emcon_kept_factor, only : kept_factor_condense, kept_factor_has_room
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_evaluate, motion_t
   use emcon_motion_bound, only : largest_motion
   use emcon_near_laws, only : near_laws_are_none, near_laws_update
   use emcon_newton, only : newton_converged, newton_diverged, newton_early, newton_measure_forces, &
      newton_pick_residual, newton_redundant, newton_refused, newton_solve, newton_t
   use emcon_numbering, only : numbering_holds
   use emcon_penalty, only : most_augmentations, penalty_augment
   use emcon_phases, only : phase_enter, phase_gaps, phase_leave
   use emcon_scene, only : scene_t
   use emcon_system, only : system_respond, system_stiffen, system_t
   implicit none
   private
   public :: contact_rounds_solve, contact_rounds_stand

   !> Sets that are tried by the null space in one step at most, and in statics.
   integer, parameter :: most_tried = 6, most_in_statics = 20
   !> And rounds with all candidates.
   integer, parameter :: most_rounds = 100
   !> A step is solved again so often at most because stencils were chosen for another motion.
   integer, parameter :: most_stale = 3
   !> By so much of the largest push friction may miss its law: what a solve leaves.
   real(wp), parameter :: least_missed = 1.0e4_wp*epsilon(1.0_wp)

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

      call candidates_clear(self%candidates)
      if (self%penalty%is_on) then
         if (self%support%is_needed) call hold(self, system, scene, newton%driven, motion)
         status = step_not_held
         if (allocated(self%support%text)) return
         call solve_by_laws(self, system, newton, motion, status, error)
         return
      end if
      self%candidates%began(:) = self%is_active
      call solve_by_sets(self, system, scene, newton, motion, status, error)
      if (self%candidates%is_settled .or. allocated(error)) return
      if (size(system%contact) == 0 .or. (status == newton_refused .and. &
         .not. any(self%candidates%takes_part))) return
      if (self%support%is_needed .or. (.not. self%has_impacts .and. &
         largest_motion(motion%du - self%first) > self%largest_move)) then
         motion%du = self%first
         newton%driven = self%driven
         self%is_active = self%candidates%began
         if (self%support%is_needed) then
            call contact_support_forget(self%support)
            call hold(self, system, scene, newton%driven, motion)
            call system_stiffen(system, self%support%hangs)
         end if
         call begin_again(self, system, motion)
      end if
      call solve_with_all(self, system, newton, motion, status, error)
   end subroutine contact_rounds_solve

   !> From `motion`, the first guess, with what acted then.
   subroutine begin_again(self, system, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion

      call candidates_clear(self%candidates)
      self%lam = self%lam0
      if (self%friction%is_on) self%friction%tau = self%friction%tau0
      call active_set_select(self, system, motion)
      self%candidates%takes_part(self%set%id(:self%set%n)) = .true.
   end subroutine begin_again

   !> Take in what holds the bodies that would be free with the present set. The prescribed motion
   !> `driven`, which the first correction of Newton's method meets, is left out on the way.
   subroutine hold(self, system, scene, driven, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      real(wp), intent(in), contiguous :: driven(:, :)               !! (n_dim, n_node)
      type(motion_t), intent(inout) :: motion
      integer :: pair

      motion%du = motion%du - driven
      if (self%friction%is_on) self%support%grips = friction_holds(self%friction)
      call contact_support_complete(self%support, system, scene, motion, self%is_active)
      motion%du = motion%du + driven
      do pair = 1, size(system%contact)
         call pair_search(system, pair, motion)
      end do
   end subroutine hold

   !> Is the motion that was found without contacts a solution of the step?
   subroutine contact_rounds_stand(self, system, motion, is_solved, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(out) :: is_solved          !! also where `status` is a failure
      integer, intent(out) :: status             !! one of the `step_` codes

      call candidates_clear(self%candidates)
      call look(self, system, motion, status)
      is_solved = status /= step_done .or. .not. self%candidates%have_changed
   end subroutine contact_rounds_stand

   !> Try sets of candidates by the null space; that settles it unless none stands: then `motion`
   !> has come nearer, or is the first guess.
   subroutine solve_by_sets(self, system, scene, newton, motion, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      logical :: goes_on, is_early, is_driven, obeys
      integer :: i

      is_driven = .true.
      self%candidates%is_new_set = .true.
      do i = 1, merge(most_tried, most_in_statics, self%has_impacts)
         if (self%support%is_needed) call hold(self, system, scene, newton%driven, motion)
         status = step_not_held
         self%candidates%is_settled = allocated(self%support%text)
         if (self%candidates%is_settled) return
         self%before = motion%du
         newton%looks_early = self%candidates%is_new_set .and. .not. self%support%is_needed
         call solve_set(self, system, newton, motion, status, error)
         if (allocated(error)) return
         if (status == newton_redundant) then
            call leave_out(self, newton%correction%redundant, goes_on)
            if (goes_on) cycle
            return
         else if (.not. any(status == [newton_converged, newton_early])) then
            self%candidates%is_measured = .false.
            goes_on = status == newton_diverged .and. .not. self%has_impacts
            if (goes_on) call let_go_alone(self, goes_on)
            if (goes_on) then
               motion%du = self%before
               if (is_driven) newton%driven = self%driven
               cycle
            end if
            motion%du = self%first
            newton%driven = self%driven
            return
         end if
         is_early = status == newton_early
         newton%driven = 0.0_wp                  ! the prescribed motion is in `motion` now
         is_driven = .false.
         call keep_forces(self)
         obeys = .not. is_early
         if (obeys) obeys = obeys_laws(self, system)
         call look(self, system, motion, status)
         self%candidates%is_settled = obeys .and. (status /= step_done .or. &
            .not. (self%candidates%have_changed .or. self%candidates%one_closes))
         if (self%candidates%is_settled .or. status /= step_done) return
         call choose(self, system, newton, motion, goes_on, error)
         if (allocated(error) .or. .not. goes_on) return
         ! The same set again: where it was left before its end, or has other stencils.
         if (.not. (self%candidates%is_new_set .or. is_early .or. self%is_stale)) return
      end do
   end subroutine solve_by_sets

   !> Multipliers and friction of the set, by the numbers of its contacts.
   pure subroutine keep_forces(self)
      type(active_set_t), intent(inout) :: self
      integer :: k

      do k = 1, self%set%n
         self%lam(self%set%id(k)) = self%set%lam(k)
      end do
      call friction_keep(self%friction, self%set)
   end subroutine keep_forces

   !> Newton's method has not converged: what pulls in its last iterate goes. `goes_on` if some does.
   pure subroutine let_go_alone(self, goes_on)
      type(active_set_t), intent(inout) :: self
      logical, intent(out) :: goes_on
      integer :: k

      goes_on = .false.
      do k = self%set%n_permanent + 1, self%set%n
         if (.not. self%set%lam(k) < 0.0_wp) cycle
         self%is_active(self%set%id(k)) = .false.
         goes_on = .true.
      end do
   end subroutine let_go_alone

   !> Solve with contacts that give way: those act that push, until the step stands on them. With an
   !> augmented Lagrangian also until nothing is left of their gaps.
   subroutine solve_by_laws(self, system, newton, motion, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      logical :: is_left, is_done, goes_on
      integer :: i

      newton%looks_early = .false.
      do i = 1, most_rounds
         call solve_set(self, system, newton, motion, status, error)
         if (allocated(error)) return
         if (status == newton_redundant) then
            call leave_out(self, newton%correction%redundant, goes_on)
            if (goes_on) cycle
         end if
         if (status /= newton_converged .or. self%penalty%is_at_ends) return
         newton%driven = 0.0_wp                  ! the prescribed motion is in `motion` now
         call penalty_augment(self%penalty, self%set, is_done)
         is_left = .not. is_done
         call keep_forces(self)
         call look(self, system, motion, status)
         if (status /= step_done) return
         call let_go(self, system)
         self%is_active = self%candidates%acts
         is_left = is_left .or. any(self%candidates%acted .neqv. self%candidates%acts)
         if (.not. (is_left .or. self%candidates%have_changed)) return
         if (self%penalty%n_augmentation > most_augmentations) exit
      end do
      status = merge(step_loose, step_cycling, self%penalty%n_augmentation > most_augmentations)
   end subroutine solve_by_laws

   !> What pulls acts no more, unless it gives back what it stores.
   subroutine let_go(self, system)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer :: k, pair, i

      do k = self%set%n_permanent + 1, self%set%n
         associate (id => self%set%id(k))
            call constraint_index(system, id, pair, i)
            self%candidates%acts(id) = self%set%lam(k) >= -noise_at(self, system, &
               system%contact(pair)%contact%node(i)) .or. constraints_gives_back(self%set, k)
         end associate
      end do
   end subroutine let_go

   !> Solve with what acts.
   subroutine solve_set(self, system, newton, motion, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `newton_` codes
      type(error_t), allocatable, intent(out) :: error
      integer :: k, left

      call phase_enter(system%phases, phase_gaps, left)
      call active_set_select(self, system, motion, self%candidates%is_measured)
      self%candidates%acts = .false.
      do k = 1, self%set%n
         self%candidates%acts(self%set%id(k)) = .true.
         self%candidates%takes_part(self%set%id(k)) = .true.
      end do
      self%candidates%acted(:) = self%candidates%acts
      call phase_leave(system%phases, left)
      call newton_solve(newton, system, self%set, motion, status, error)
      self%n_newton = self%n_newton + newton%convergence%n_iteration
   end subroutine solve_set

   !> What follows from others waits: rows of gaps do, and of what always holds for the whole step.
   !> `goes_on` if these are all.
   pure subroutine leave_out(self, redundant, goes_on)
      type(active_set_t), intent(inout) :: self
      integer, intent(in) :: redundant(:)        !! (any) rows of the set, from 1
      logical, intent(out) :: goes_on
      integer :: k, id

      goes_on = all(redundant <= self%set%n)
      do k = 1, size(redundant)
         if (redundant(k) > self%set%n) cycle
         id = self%set%id(redundant(k))
         if (redundant(k) <= self%set%n_permanent) self%candidates%takes_part(id) = .false.
         if (is_bound(self%set, redundant(k))) call exclude(self, id)
         self%is_active(id) = .false.
      end do
   end subroutine leave_out

   !> Is nothing in row `k` of the set free to move?
   pure logical function is_bound(set, k)
      type(constraint_set_t), intent(in) :: set
      integer, intent(in) :: k

      is_bound = set%force_rows%row_start(k) == set%force_rows%row_start(k + 1)
   end function is_bound

   !> Contact `id` cannot act in this step.
   pure subroutine exclude(self, id)
      type(active_set_t), intent(inout) :: self
      integer, intent(in) :: id

      self%is_left_out(id) = .true.
      self%is_active(id) = .false.
      self%candidates%takes_part(id) = .false.
      self%candidates%acts(id) = .false.
   end subroutine exclude

   !> The next set: that which obeys the laws where the step is linearised, if a kept factor tells it
   !> without friction; in statics what pushes, in the way that its trial has, and what closes.
   subroutine choose(self, system, newton, motion, goes_on, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      logical, intent(out) :: goes_on            !! there is such a set
      type(error_t), allocatable, intent(out) :: error
      logical :: turns

      turns = .false.
      goes_on = newton%factor_policy%is_allowed .and. newton%correction%kept%is_made &
         .and. .not. self%friction%is_on
      if (goes_on) then
         call choose_by_problem(self, system, newton, motion, goes_on, error)
         if (allocated(error) .or. .not. goes_on) return
      else
         goes_on = .not. self%has_impacts
         if (.not. goes_on) return
         call choose_by_trials(self, system, turns)
      end if
      self%is_active = self%candidates%acts
      self%candidates%is_new_set = turns .or. any(self%candidates%acted .neqv. self%candidates%acts)
   end subroutine choose

   !> What pulls goes; what is friction turns as its trial has it.
   subroutine choose_by_trials(self, system, turns)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      logical, intent(out) :: turns
      integer :: k, pair, i

      turns = .false.
      do k = self%set%n_permanent + 1, self%set%n
         associate (id => self%set%id(k))
            call constraint_index(system, id, pair, i)
            self%candidates%acts(id) = self%candidates%acts(id) .and. self%set%lam(k) >= &
               -noise_at(self, system, system%contact(pair)%contact%node(i))
            if (self%support%is_needed .and. .not. self%candidates%acts(id)) &
               self%support%has_pulled(id) = .true.
            if (self%candidates%acts(id) .and. self%friction%is_on) call friction_turn(self%friction, &
               system, self%set, k, turns)
         end associate
      end do
   end subroutine choose_by_trials

   !> The contacts condensed by the kept factor, and the laws solved there.
   subroutine choose_by_problem(self, system, newton, motion, is_solved, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      logical, intent(out) :: is_solved
      type(error_t), allocatable, intent(out) :: error
      type(contact_problem_t) :: problem
      type(contact_effort_t) :: effort
      type(slip_status_t), allocatable :: status(:)
      real(wp), allocatable :: force(:, :)

      call select_all(self, system, motion)
      associate (set => self%set)
         is_solved = set%n_permanent == 0 .and. set%n > 0 .and. set%n_condition == set%n .and. &
            kept_factor_has_room(newton%correction%kept, set%n, size(system%matrix%column))
         if (.not. is_solved) return
         call constraints_evaluate(set, system, motion, .true.)
         call constraints_rows(set, system%space%numbering)
         call newton_pick_residual(newton, system, set)
         call contact_problem_create(problem, 0, set%n)
         allocate(force(0:0, set%n))
         call kept_factor_condense(newton%correction%kept, set, newton%residual, problem%w, &
            problem%free(0, :), error)
         if (allocated(error)) return
         force(0, :) = set%lam(:set%n)
         call contact_problem_solve(problem, force, effort, is_solved)
         if (.not. is_solved) return
         self%lam(set%id) = force(0, :)
         status = contact_problem_status(problem, force)
         self%candidates%acts(set%id) = status%kind /= contact_open
      end associate
   end subroutine choose_by_problem

   !> Do all contacts of the set push, and is friction as its law says?
   pure logical function obeys_laws(self, system)
      type(active_set_t), intent(in) :: self
      type(system_t), intent(in) :: system
      real(wp) :: missed, largest
      integer :: k, pair, i

      obeys_laws = .true.
      do k = self%set%n_permanent + 1, self%set%n
         call constraint_index(system, self%set%id(k), pair, i)
         obeys_laws = obeys_laws .and. self%set%lam(k) >= -noise_at(self, system, &
            system%contact(pair)%contact%node(i))
      end do
      call friction_missed(self%friction, system, self%set, missed, largest)
      obeys_laws = obeys_laws .and. missed <= least_missed*largest
   end function obeys_laws

   !> Solve with all candidates until none joins them.
   subroutine solve_with_all(self, system, newton, motion, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      type(coulomb_t), allocatable :: law(:)     ! (contacts of the set)
      integer :: i

      newton%looks_early = .false.
      newton%convergence%largest_move = huge(1.0_wp)
      if (.not. self%has_impacts) newton%convergence%largest_move = self%largest_move
      do i = 1, most_rounds
         call select_all(self, system, motion)
         associate (set => self%set)
            if (allocated(law)) deallocate(law)
            allocate(law(set%n - set%n_permanent))
            if (self%friction%is_on) law = self%friction%law(set%id(set%n_permanent + 1:set%n))
            if (size(law) == 0 .and. self%has_impacts) then
               call newton_solve(newton, system, set, motion, status, error)
            else
               call contact_newton_solve(newton, system, set, law, motion, status, error)
            end if
         end associate
         self%n_newton = self%n_newton + newton%convergence%n_iteration
         if (allocated(error)) return
         if (status == newton_early) then
            newton%driven = 0.0_wp
            call keep(self, law)
            call look(self, system, motion, status)
            if (status /= step_done) return
            cycle
         end if
         call keep(self, law)
         if (status /= newton_converged) return
         newton%driven = 0.0_wp                  ! the prescribed motion is in `motion` now
         ! Before stencils are chosen anew: the step was solved with these.
         call finish(self, system, newton, motion, error)
         if (allocated(error)) return
         call look(self, system, motion, status)
         if (status /= step_done .or. .not. self%candidates%have_changed) return
      end do
      status = step_cycling
   end subroutine solve_with_all

   !> All candidates act for now, and hold their slips.
   subroutine select_all(self, system, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      integer :: left

      call phase_enter(system%phases, phase_gaps, left)
      if (self%friction%is_on) self%friction%law%status = slip_status_t()
      self%is_active = self%candidates%takes_part
      call active_set_select(self, system, motion, self%candidates%is_measured)
      call exclude_bound(self, system, motion)
      call phase_leave(system%phases, left)
   end subroutine select_all

   !> Contacts in which nothing is free to move are no candidates: no force closes them.
   subroutine exclude_bound(self, system, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical :: may_be(self%set%n)
      integer :: k, pair, i

      may_be = .false.
      do k = self%set%n_permanent + 1, self%set%n
         call constraint_index(system, self%set%id(k), pair, i)
         may_be(k) = numbering_holds(system%space%numbering, system%contact(pair)%contact%node(i))
      end do
      if (.not. any(may_be)) return
      call constraints_evaluate(self%set, system, motion, .true.)
      call constraints_rows(self%set, system%space%numbering)
      do k = self%set%n_permanent + 1, self%set%n
         may_be(k) = may_be(k) .and. is_bound(self%set, k)
         if (may_be(k)) call exclude(self, self%set%id(k))
      end do
      if (any(may_be)) call active_set_select(self, system, motion, self%candidates%is_measured)
   end subroutine exclude_bound

   !> Multipliers and ways of the candidates: what is not open acts.
   subroutine keep(self, law)
      type(active_set_t), intent(inout) :: self
      type(coulomb_t), intent(in) :: law(:)      !! (contacts of the set)
      integer :: k

      associate (set => self%set, friction => self%friction)
         call keep_forces(self)
         self%candidates%acts = self%candidates%takes_part
         do k = 1, size(law)
            associate (id => set%id(set%n_permanent + k))
               self%candidates%acts(id) = law(k)%status%kind /= contact_open
               ! What touches holds a body that nothing pushes.
               associate (place => set%n_permanent + k)
                  if (self%support%is_needed) self%candidates%acts(id) = self%candidates%acts(id) .or. &
                     abs(set%defect(place)) <= gap_noise*set%item(place)%size
               end associate
               if (friction%is_on .and. self%candidates%acts(id)) friction%law(id)%status = law(k)%status
            end associate
         end do
      end associate
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

   !> Measure all gaps for the motion. Who joins, who has lost its surface, who closes although it
   !> does not act, which stencils were chosen for another motion?
   subroutine look(self, system, motion, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      integer, intent(out) :: status             !! one of the `step_` codes
      integer :: pair, k, left

      call phase_enter(system%phases, phase_gaps, left)
      status = step_done
      self%candidates%have_changed = .false.
      self%candidates%one_closes = .false.
      self%candidates%is_measured = .true.
      self%is_stale = .false.
      self%friction%lags = .false.
      k = self%set%n_permanent
      call active_set_pass(self, system, motion)
      do pair = 1, size(system%contact)
         associate (first => system%first_constraint(pair) + 1, &
               last => system%first_constraint(pair + 1))
            if (self%skip_until(pair)%passes .and. .not. any(self%candidates%takes_part(first:last))) &
               cycle
            call active_set_update_gaps(self, system, pair, motion, motion%du)
            if (.not. near_laws_are_none(self%near_laws, system%contact(pair)%contact)) &
               call near_laws_update(self%near_laws, system, pair, self%candidates%acts, &
               self%candidates%have_changed)
            call look_at_pair(self, system, pair, motion, k, status)
         end associate
      end do
      call phase_leave(system%phases, left)
      if (status /= step_done) return
      if (self%is_stale) then
         self%n_stale = self%n_stale + 1
         if (self%n_stale > most_stale) status = step_too_far
         self%candidates%have_changed = .true.
      else if (self%friction%lags .and. .not. self%candidates%have_changed) then
         self%friction%n_lagged = self%friction%n_lagged + 1
         self%candidates%have_changed = self%friction%n_lagged <= most_lagged
      end if
   end subroutine look

   !> The conditions of one contact.
   subroutine look_at_pair(self, system, pair, motion, k, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      integer, intent(in) :: pair
      type(motion_t), intent(in) :: motion
      integer, intent(inout) :: k                !! places of the set that were looked at
      integer, intent(inout) :: status
      logical :: acts
      integer :: i, id

      associate (contact => system%contact(pair)%contact, friction => self%friction)
         do i = 1, contact%n_constraint
            id = system%first_constraint(pair) + i
            if (.not. self%candidates%takes_part(id)) then
               call join(self, system, pair, i, motion, status)
               cycle
            end if
            acts = self%candidates%acts(id)
            if (acts) k = k + 1
            if (contact%state(i)%is_leaving) then
               self%candidates%takes_part(id) = .false.
               self%candidates%has_left(id) = .true.
               self%candidates%acts(id) = .false.
               self%is_active(id) = .false.
               self%candidates%have_changed = .true.
            else if (acts) then
               call look_at_active(self, contact, i, k, motion, status)
               if (.not. self%was_active(id)) then
                  if (begins_unseen(self, contact, i, motion)) status = step_too_far
               end if
               if (.not. friction%is_on) cycle
               if (friction%law(id)%mu > 0.0_wp) friction%lags = friction%lags .or. &
                  contact%state(i)%slip_shift > most_shift
            else if (has_closed(self, contact, i, id)) then
               self%candidates%one_closes = .true.
               self%candidates%acts(id) = .true.
            end if
         end do
      end associate
   end subroutine look_at_pair

   !> Has the `i`-th constraint of `contact`, a candidate that does not act, closed below its gap?
   pure logical function has_closed(self, contact, i, id)
      type(active_set_t), intent(in) :: self
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i, id

      associate (gap => contact%state(i))
         has_closed = gap%is_near .and. gap%is_over .and. &
            gap%gap1 - gap_to_hold(self, gap, id) < -gap_noise*gap%size
      end associate
   end function has_closed

   !> Does the `i`-th constraint of a pair, which is no candidate, close?
   subroutine join(self, system, pair, i, motion, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      integer, intent(in) :: pair, i
      type(motion_t), intent(in) :: motion
      integer, intent(inout) :: status           !! a failure where it cannot
      logical :: closes

      associate (contact => system%contact(pair)%contact, id => system%first_constraint(pair) + i)
         if (contact%state(i)%is_leaving) return
         call look_at_open(self, contact, i, id, closes, status)
         ! What the pairs take in may hold the bodies away from their guards.
         if (.not. closes .or. (contact%slack > 0.0_wp .and. self%candidates%have_changed)) return
         if (self%candidates%has_left(id) .and. self%candidates%is_back(id)) status = step_too_far
         self%candidates%is_back(id) = self%candidates%has_left(id)
         if (self%friction%is_on) call friction_close(self%friction, system, pair, i, motion, &
            contact%state(i)%gap1 - gap_to_hold(self, contact%state(i), id), &
            .not. self%is_candidate(id))
         self%candidates%takes_part(id) = .true.
         self%candidates%acts(id) = .true.
         self%candidates%have_changed = .true.
         self%is_candidate(id) = .true.
      end associate
   end subroutine join

end module emcon_contact_rounds
