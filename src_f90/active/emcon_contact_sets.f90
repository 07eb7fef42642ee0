!> A step solved by sets of its candidates, one after the other, beginning with what acted before:
!> in most steps nothing else acts.
!>
!> What is found is checked: all that acts pushes, friction obeys its law, no candidate closes.
!> Where that fails the contacts are condensed by the kept factor, and their problem tells the next
!> set; in statics trials of single contacts do. Contacts that give way are solved by sets alone.
!> Source: docs/theory.md, section 6.1.
module emcon_contact_sets
   use emcon_active_set, only : active_set_complete, active_set_may_turn, active_set_mixes, &
      active_set_open_sets, active_set_repeats, active_set_slides, active_set_t, step_cycling, &
      step_done, step_loose, step_not_held
   use emcon_constraint_rows, only : constraints_rows
   use emcon_constraints, only : constraint_index, constraints_evaluate, constraints_gives_back
   use emcon_contact_candidates, only : candidates_are_many, &
      candidates_are_too_many, candidates_keep_forces, candidates_leave_out, candidates_look, &
      candidates_need_factor, candidates_select, candidates_solve
   use emcon_contact_conditions, only : noise_at
   use emcon_contact_problem, only : contact_effort_t, contact_problem_create, &
      contact_problem_status, contact_problem_t
   use emcon_contact_solution, only : contact_problem_solve
   use emcon_contact_support, only : contact_support_find_jam
   use emcon_coulomb_law, only : contact_open, slip_status_t
   use emcon_errors, only : error_t
   use emcon_friction, only : friction_holds, friction_missed, friction_stiffness, friction_turn, &
      friction_use
   use emcon_gaps, only : pair_search
   use emcon_kept_factor, only : kept_factor_condense, kept_factor_has_room
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_newton, only : newton_converged, newton_diverged, newton_early, &
      newton_pick_residual, newton_redundant, newton_t
   use emcon_penalty, only : most_augmentations, penalty_augment
   use emcon_scene, only : scene_t
   use emcon_system, only : system_t
   implicit none
   private
   public :: contact_sets_solve, contact_sets_solve_by_laws, contact_sets_hold, &
      contact_sets_begin_anew

   !> Sets that are tried by the null space in one step at most, and where trials tell them.
   integer, parameter :: most_tried = 6, most_by_trials = 20
   !> Sets of which some rows follow from others, and are left out: as these close again such sets
   !> may take turns for ever.
   integer, parameter :: most_redundant = 2
   !> With friction trials tell the next set where the problem of all has more rows.
   integer, parameter :: most_rows = 200
   !> By so much of the largest push friction may miss its law: what a solve leaves.
   real(wp), parameter :: least_missed = 1.0e4_wp*epsilon(1.0_wp)
   !> Contacts that jam slide alone if others use less than this part of what they do.
   real(wp), parameter :: alike = 0.5_wp
   !> Rounds with contacts that give way at most.
   integer, parameter :: most_rounds = 100

contains

   !> Try sets of candidates by the null space; that settles it unless none stands: then `motion`
   !> has come nearer, or is the first guess.
   subroutine contact_sets_solve(self, system, scene, newton, motion, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      logical :: goes_on, has_failed, is_early, is_driven, obeys
      logical, allocatable :: gripped(:)
      integer :: i, n_left

      n_left = most_redundant
      is_driven = .true.
      has_failed = .false.
      call active_set_open_sets(self)
      do i = 1, most_by_trials
         if (i > most_tried .and. self%rules%has_impacts &
            .and. .not. needs_trials(self, newton)) return
         if (self%support%is_needed) call hold_on(self, system, scene, newton, motion, gripped)
         status = step_not_held
         self%candidates%is_settled = is_left_free(self, is_first=i == 1)
         if (allocated(self%support%text)) return
         if (has_failed .and. active_set_repeats(self)) then
            call contact_sets_begin_anew(self, newton, motion)
            return
         end if
         self%guess%before = motion%du
         newton%looks_early = self%candidates%is_new_set .and. .not. self%support%is_needed
         call candidates_solve(self, system, newton, motion, status, error)
         if (allocated(error)) return
         ! Rows that lose their rank on the way are those of a motion that goes astray.
         if (status == newton_redundant .and. (newton%convergence%n_iteration == 0 .or. &
            candidates_are_many(self, newton%correction%kept))) then
            call candidates_leave_out(self, newton%correction%redundant, goes_on)
            n_left = n_left - 1
            if (goes_on .and. n_left >= 0) cycle
            return
         else if (.not. any(status == [newton_converged, newton_early])) then
            has_failed = status == newton_diverged .and. .not. self%rules%has_impacts
            call take_back(self, newton, motion, is_driven, has_failed)
            if (has_failed) cycle
            return
         end if
         has_failed = .false.
         is_early = status == newton_early
         newton%driven = 0.0_wp                  ! the prescribed motion is in `motion` now
         is_driven = .false.
         call candidates_keep_forces(self)
         obeys = obeys_laws(self, system) .and. .not. is_early
         call candidates_look(self, system, motion, status, obeys)
         self%candidates%is_settled = obeys .and. (status /= step_done .or. &
            .not. (self%candidates%have_changed .or. self%candidates%one_closes))
         if (self%candidates%is_settled .or. status /= step_done) return
         call choose(self, system, newton, motion, goes_on, error)
         if (allocated(error) .or. .not. goes_on) return
         ! The same set again: where it was left before its end, or has other stencils.
         if (.not. (self%candidates%is_new_set .or. is_early .or. self%is_stale)) return
      end do
   end subroutine contact_sets_solve

   !> Of so many candidates, or by iterations, nothing but trials names sets.
   pure logical function needs_trials(self, newton)
      type(active_set_t), intent(in) :: self
      type(newton_t), intent(in) :: newton

      associate (kept => newton%correction%kept)
         needs_trials = candidates_are_too_many(self) .or. &
            (kept%blocks%is_incomplete .and. candidates_are_many(self, kept))
      end associate
   end function needs_trials

   !> Does something stay free that contact is to hold? What no load works on in a set that was
   !> tried on the way tells of that set alone, and so does what slides where slip has a direction:
   !> friction that is at its limit at all contacts, along different ways, may hold a body all the
   !> same.
   pure logical function is_left_free(self, is_first)
      type(active_set_t), intent(in) :: self
      logical, intent(in) :: is_first            !! no set was tried before

      is_left_free = allocated(self%support%text)
      if (is_left_free) is_left_free = (is_first .or. self%support%is_pushed) &
         .and. .not. (self%friction%looks_back .and. active_set_slides(self))
   end function is_left_free

   !> Take in what holds bodies, with friction that has gripped in the set before, if there was one.
   subroutine hold_on(self, system, scene, newton, motion, gripped)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(newton_t), intent(in) :: newton
      type(motion_t), intent(inout) :: motion
      logical, allocatable, intent(inout) :: gripped(:)  !! (n_constraint) out: in the next one

      if (allocated(gripped)) call keep_hold(self, system, scene, motion, gripped)
      call contact_sets_hold(self, system, scene, newton%driven, motion)
      if (self%friction%is_on) gripped = friction_holds(self%friction)
   end subroutine hold_on

   !> Contacts that jam, as they hold along the surface in turn, would all slide by their trials:
   !> where that leaves a body to its load only those do that miss their law the most.
   subroutine keep_hold(self, system, scene, motion, gripped)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(motion_t), intent(in) :: motion
      logical, intent(in) :: gripped(:)          !! (n_constraint) before their trials
      real(wp) :: used(self%set%n), friction(self%friction%n_slip, size(gripped))
      logical :: turned(self%set%n), jams
      integer :: k

      self%support%grips = friction_holds(self%friction)
      turned = .false.
      used = 0.0_wp
      friction = 0.0_wp
      do k = self%set%n_permanent + 1, self%set%n
         associate (id => self%set%id(k))
            turned(k) = self%candidates%acts(id) .and. gripped(id) &
               .and. .not. self%support%grips(id)
            if (turned(k)) call friction_use(self%friction, self%set, k, friction(:, id), used(k))
         end associate
      end do
      if (count(turned) < 2) return
      call contact_support_find_jam(self%support, system, scene, motion, self%candidates%acts, &
         friction, jams)
      if (.not. jams) return
      do k = self%set%n_permanent + 1, self%set%n
         if (turned(k) .and. used(k) < alike*maxval(used)) then
            self%friction%law(self%set%id(k))%status = slip_status_t()
         end if
      end do
   end subroutine keep_hold

   !> Newton's method has failed for a set: with `goes_on` what pulls in its last iterate goes, if
   !> some does, and the motion is that before; else no set stands.
   pure subroutine take_back(self, newton, motion, is_driven, goes_on)
      type(active_set_t), intent(inout) :: self
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      logical, intent(in) :: is_driven           !! the prescribed motion was not in it yet
      logical, intent(inout) :: goes_on          !! out: another set is to be tried

      self%candidates%is_measured = .false.
      if (goes_on) call let_go_alone(self, goes_on)
      if (goes_on) then
         motion%du = self%guess%before
         if (is_driven) newton%driven = self%guess%driven
      else
         call contact_sets_begin_anew(self, newton, motion)
      end if
   end subroutine take_back

   !> No set stands: from the first guess on.
   pure subroutine contact_sets_begin_anew(self, newton, motion)
      type(active_set_t), intent(in) :: self
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion    !! its increment

      motion%du = self%guess%first
      newton%driven = self%guess%driven
   end subroutine contact_sets_begin_anew

   !> Take in what holds the bodies that would be free with the present set. The prescribed motion
   !> `driven`, which the first correction of Newton's method meets, is left out on the way.
   subroutine contact_sets_hold(self, system, scene, driven, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      real(wp), intent(in), contiguous :: driven(:, :)               !! (n_dim, n_node)
      type(motion_t), intent(inout) :: motion
      integer :: pair

      motion%du = motion%du - driven
      call active_set_complete(self, system, scene, motion)
      motion%du = motion%du + driven
      do pair = 1, size(system%contact)
         call pair_search(system, pair, motion)
      end do
   end subroutine contact_sets_hold

   !> Newton's method has not converged: what pulls in its last iterate goes. `goes_on`: some does.
   pure subroutine let_go_alone(self, goes_on)
      type(active_set_t), intent(inout) :: self
      logical, intent(out) :: goes_on
      integer :: k

      goes_on = .false.
      do k = self%set%n_permanent + 1, self%set%n
         if (.not. self%set%lam(k) < 0.0_wp) cycle
         associate (id => self%set%id(k))
            self%is_active(id) = .false.
         end associate
         goes_on = .true.
      end do
   end subroutine let_go_alone

   !> The next set: that which obeys the laws where the step is linearised, if a kept factor tells
   !> it without friction; in statics, and of many, what pushes, in the way that its trial has, and
   !> what closes.
   subroutine choose(self, system, newton, motion, goes_on, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      logical, intent(out) :: goes_on            !! there is such a set
      type(error_t), allocatable, intent(out) :: error
      logical :: turns, are_many
      integer :: n_row

      turns = .false.
      goes_on = .not. candidates_need_factor(self, newton%correction%kept)
      if (.not. goes_on) return
      n_row = (1 + merge(self%friction%n_slip, 0, self%friction%is_on)) &
         *count(self%candidates%takes_part)
      are_many = candidates_are_many(self, newton%correction%kept)
      goes_on = newton%factor_policy%is_allowed .and. newton%correction%kept%is_made &
         .and. .not. (are_many .or. (self%friction%is_on .and. n_row > most_rows))
      if (goes_on) goes_on = kept_factor_has_room(newton%correction%kept, n_row, &
         size(system%matrix%column))
      if (goes_on) then
         call choose_by_problem(self, system, newton, motion, turns, goes_on, error)
         if (allocated(error) .or. .not. goes_on) return
         self%is_active = self%candidates%acts
         ! Where slip has a direction no set says where to while some of it stops.
         goes_on = .not. (self%friction%looks_back .and. active_set_mixes(self))
         if (.not. goes_on) return
      else
         goes_on = .not. self%rules%has_impacts .or. are_many .or. &
            active_set_may_turn(self, system)
         if (.not. goes_on) return
         call choose_by_trials(self, system, turns)
      end if
      self%is_active = self%candidates%acts
      call count_changes(self)
      self%candidates%is_new_set = turns .or. any(self%candidates%acted .neqv. self%candidates%acts)
   end subroutine choose

   !> One more try in which these contacts act again, or no more.
   pure subroutine count_changes(self)
      type(active_set_t), intent(inout) :: self

      where (self%candidates%acted .neqv. self%candidates%acts) &
         self%candidates%n_change = self%candidates%n_change + 1
   end subroutine count_changes

   !> What pulls goes; what is friction turns as its trial has it.
   subroutine choose_by_trials(self, system, turns)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      logical, intent(out) :: turns
      logical :: this_turns
      integer :: k, pair, i

      turns = .false.
      do k = self%set%n_permanent + 1, self%set%n
         associate (id => self%set%id(k))
            call constraint_index(system, id, pair, i)
            self%candidates%acts(id) = self%candidates%acts(id) .and. self%set%lam(k) >= &
               -noise_at(self, system, system%contact(pair)%contact%node(i))
            if (.not. (self%candidates%acts(id) .and. self%friction%is_on)) cycle
            this_turns = .false.
            call friction_turn(self%friction, system, self%set, k, this_turns)
            if (this_turns) self%candidates%n_change(id) = self%candidates%n_change(id) + 1
            turns = turns .or. this_turns
         end associate
      end do
   end subroutine choose_by_trials

   !> The contacts condensed by the kept factor, and the laws solved there.
   subroutine choose_by_problem(self, system, newton, motion, turns, is_solved, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      logical, intent(out) :: turns              !! friction holds in another way somewhere
      logical, intent(out) :: is_solved
      type(error_t), allocatable, intent(out) :: error
      type(contact_problem_t) :: problem
      type(contact_effort_t) :: effort
      type(slip_status_t), allocatable :: status(:), before(:)
      real(wp), allocatable :: force(:, :)

      turns = .false.
      if (self%friction%is_on) before = self%friction%law%status
      call candidates_select(self, system, motion)
      associate (set => self%set)
         is_solved = set%n_permanent == 0 .and. set%n > 0 .and. set%n_condition == set%n
         if (.not. is_solved) return
         call constraints_evaluate(set, system, motion, .true.)
         call constraints_rows(set, system%space%numbering)
         call newton_pick_residual(newton, system, set)
         call lay_out_problem(self, system, newton, problem, force, error)
         if (allocated(error)) return
         call contact_problem_solve(problem, force, effort, is_solved, .true.)
         if (.not. is_solved) return
         self%lam(set%id) = force(0, :)
         status = contact_problem_status(problem, force)
         self%candidates%acts(set%id) = status%kind /= contact_open
         if (.not. self%friction%is_on) return
         self%friction%tau(:, set%id) = force(1:, :)
         where (status%kind == contact_open) status = before(set%id)
         self%friction%law(set%id)%status = status
         turns = any(status%kind /= before(set%id)%kind)
      end associate
   end subroutine choose_by_problem

   !> The contacts of the set, evaluated, in their multipliers alone by the kept factor, and those
   !> that there are.
   subroutine lay_out_problem(self, system, newton, problem, force, error)
      type(active_set_t), intent(in) :: self     !! of candidates
      type(system_t), intent(in) :: system
      type(newton_t), intent(inout) :: newton
      type(contact_problem_t), intent(out) :: problem
      real(wp), allocatable, intent(out) :: force(:, :)  !! (0:n_slip, n) [M L/T^2]
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: w(self%set%n_row, self%set%n_row), free(self%set%n_row)
      integer :: place(self%set%n_row), k, m

      associate (set => self%set, friction => self%friction)
         m = 1 + merge(friction%n_slip, 0, friction%is_on)
         call contact_problem_create(problem, m - 1, set%n)
         allocate(force(0:m - 1, set%n), source=0.0_wp)
         call kept_factor_condense(newton%correction%kept, set, newton%residual, w, free, error)
         if (allocated(error)) return
         do k = 1, set%n
            problem%w(m*(k - 1) + 1:m*k, m*(k - 1) + 1:m*k) = unit_matrix(m)*w(k, k)
         end do
         place = m*(set%condition - 1) + 1 + set%slip
         problem%w(place, place) = w
         do k = 1, set%n_row
            associate (s => set%slip(k), i => set%condition(k))
               problem%free(s, i) = free(k)
               force(s, i) = set%lam(k)
            end associate
         end do
         if (.not. friction%is_on) return
         problem%mu = friction%law(set%id)%mu*set%item(:set%n)%normal
         do k = 1, set%n
            problem%stiffness(k) = friction_stiffness(system, set%item(k))
            if (.not. set%item(k)%has_friction) cycle
            problem%slip_target(:, k) = friction%law(set%id(k))%slip_target(:m - 1)
            problem%free(1:, k) = problem%free(1:, k) - problem%slip_target(:, k)
         end do
      end associate
   end subroutine lay_out_problem

   !> Of the size `m`.
   pure function unit_matrix(m) result(unit)
      integer, intent(in) :: m
      real(wp) :: unit(m, m)
      integer :: k

      unit = 0.0_wp
      do k = 1, m
         unit(k, k) = 1.0_wp
      end do
   end function unit_matrix

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

   !> Solve with contacts that give way: those act that push, until the step stands on them. With an
   !> augmented Lagrangian also until nothing is left of their gaps.
   subroutine contact_sets_solve_by_laws(self, system, newton, motion, status, error)
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
         call candidates_solve(self, system, newton, motion, status, error)
         if (allocated(error)) return
         if (status == newton_redundant) then
            call candidates_leave_out(self, newton%correction%redundant, goes_on)
            if (goes_on) cycle
         end if
         if (status /= newton_converged .or. self%penalty%is_at_ends) return
         newton%driven = 0.0_wp                  ! the prescribed motion is in `motion` now
         call penalty_augment(self%penalty, self%set, is_done)
         is_left = .not. is_done
         call candidates_keep_forces(self)
         call candidates_look(self, system, motion, status, .true.)
         if (status /= step_done) return
         call let_go(self, system)
         self%is_active = self%candidates%acts
         call count_changes(self)
         is_left = is_left .or. any(self%candidates%acted .neqv. self%candidates%acts)
         if (.not. (is_left .or. self%candidates%have_changed)) return
         if (self%penalty%n_augmentation > most_augmentations) exit
      end do
      status = merge(step_loose, step_cycling, self%penalty%n_augmentation > most_augmentations)
   end subroutine contact_sets_solve_by_laws

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

end module emcon_contact_sets
