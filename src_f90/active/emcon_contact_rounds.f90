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
      active_set_update_gaps, step_cycling, step_done, &
      step_loose, step_too_far
   use emcon_active_set_update, only : begins_unseen, gap_noise, gap_to_hold, look_at_active, &
      look_at_open, most_stale, noise_at
   use emcon_constraint_rows, only : constraints_rows
   use emcon_constraints, only : constraint_index, constraints_evaluate, constraints_gives_back
   use emcon_contact, only : contact_t
   use emcon_contact_newton, only : contact_newton_solve
   use emcon_contact_problem, only : contact_effort_t, contact_problem_create, &
      contact_problem_solve, contact_problem_status, contact_problem_t
   use emcon_coulomb_law, only : contact_open, coulomb_t, slip_status_t
   use emcon_errors, only : error_t
   use emcon_friction, only : friction_close, friction_keep, friction_missed, most_lagged, &
      most_shift
   use emcon_kept_factor, only : kept_factor_condense, kept_factor_has_room
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_evaluate, motion_t
   use emcon_motion_bound, only : largest_motion
   use emcon_near_laws, only : near_laws_are_none, near_laws_update
   use emcon_newton, only : newton_converged, newton_early, newton_measure_forces, &
      newton_pick_residual, newton_redundant, newton_solve, newton_t
   use emcon_penalty, only : most_augmentations, penalty_augment
   use emcon_phases, only : phase_enter, phase_gaps, phase_leave
   use emcon_system, only : system_respond, system_t
   implicit none
   private
   public :: contact_rounds_solve

   !> Sets that are tried by the null space in one step at most.
   integer, parameter :: most_tried = 6
   !> And rounds with all candidates.
   integer, parameter :: most_rounds = 100
   !> Of these, so many are left before their end at most, as something closes on the way.
   integer, parameter :: most_early = 8
   !> By so much of the largest push friction may miss its law: what a solve leaves.
   real(wp), parameter :: least_missed = 1.0e4_wp*epsilon(1.0_wp)

   !> Who takes part.
   type :: candidates_t
      logical, allocatable :: takes_part(:)      !! (n_constraint)
      logical, allocatable :: acts(:)            !! (n_constraint) of these, in the present set
      logical, allocatable :: has_left(:)        !! (n_constraint) it lost its surface,
      logical, allocatable :: is_back(:)         !! (n_constraint) and has come back
      logical :: is_measured = .false.           !! gaps are known for the motion that there is
      logical :: have_changed = .false.          !! solve the step again
      logical :: is_settled = .false.            !! the step is solved, or cannot be
      logical :: one_closes = .false.            !! that does not act
      logical :: is_new_set = .false.            !! others act than in the set before
   end type candidates_t

contains

   !> Solve the step that has begun; `motion%du` is the first guess and the result.
   subroutine contact_rounds_solve(self, system, newton, motion, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      type(candidates_t) :: candidates

      allocate(candidates%takes_part(system%n_constraint), candidates%acts(system%n_constraint), &
         candidates%has_left(system%n_constraint), candidates%is_back(system%n_constraint), &
         source=.false.)
      if (self%penalty%is_on) then
         call solve_by_laws(self, system, newton, motion, candidates, status, error)
         return
      else if (self%support%is_needed) then
         call active_set_select(self, system, motion)
         candidates%takes_part(self%set%id(:self%set%n)) = .true.
      else
         call solve_by_sets(self, system, newton, motion, candidates, status, error)
         if (candidates%is_settled .or. allocated(error) .or. size(system%contact) == 0) return
      end if
      call solve_with_all(self, system, newton, motion, candidates, status, error)
   end subroutine contact_rounds_solve

   !> Try sets of candidates by the null space; that settles it unless none stands: then `motion`
   !> has come nearer, or is the first guess.
   subroutine solve_by_sets(self, system, newton, motion, candidates, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      type(candidates_t), intent(inout) :: candidates
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      real(wp), dimension(size(motion%du, 1), size(motion%du, 2)) :: first, driven
      logical :: goes_on, is_early, obeys, goes_far
      integer :: i

      first = motion%du
      driven = newton%driven
      candidates%is_new_set = .true.
      do i = 1, most_tried
         newton%looks_early = candidates%is_new_set
         call solve_set(self, system, newton, motion, candidates, status, error)
         if (allocated(error)) return
         if (status == newton_redundant) then
            call leave_out(self, newton%correction%redundant, candidates, goes_on)
            if (goes_on) cycle
            return
         else if (.not. any(status == [newton_converged, newton_early])) then
            motion%du = first
            newton%driven = driven
            candidates%is_measured = .false.
            return
         end if
         goes_far = .not. self%has_impacts
         if (goes_far) goes_far = largest_motion(motion%du - first) > self%largest_move
         is_early = status == newton_early
         newton%driven = 0.0_wp                  ! the prescribed motion is in `motion` now
         self%lam(self%set%id(:self%set%n)) = self%set%lam(:self%set%n)
         call friction_keep(self%friction, self%set)
         obeys = .not. is_early
         if (obeys) obeys = obeys_laws(self, system)
         call look(self, system, motion, candidates, status)
         if (status == step_done) then
            candidates%is_settled = obeys .and. &
               .not. (candidates%have_changed .or. candidates%one_closes)
         else
            candidates%is_settled = obeys .and. .not. goes_far
         end if
         if (goes_far .and. .not. candidates%is_settled) then
            ! Who is near there, where contacts were passed, tells nothing.
            motion%du = first
            newton%driven = driven
            candidates%is_measured = .false.
            return
         end if
         if (candidates%is_settled .or. status /= step_done) return
         call choose(self, system, newton, motion, candidates, goes_on, error)
         if (allocated(error) .or. .not. goes_on) return
         ! The same set again: where it was left before its end, or has other stencils.
         if (.not. (candidates%is_new_set .or. is_early .or. self%is_stale)) return
      end do
   end subroutine solve_by_sets

   !> Solve with contacts that give way: those act that push, until the step stands on them. With an
   !> augmented Lagrangian also until nothing is left of their gaps.
   subroutine solve_by_laws(self, system, newton, motion, candidates, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      type(candidates_t), intent(inout) :: candidates
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      logical :: is_left, is_done, goes_on, before(size(candidates%acts))
      integer :: i

      newton%looks_early = .false.
      do i = 1, most_rounds
         call solve_set(self, system, newton, motion, candidates, status, error)
         if (allocated(error)) return
         if (status == newton_redundant) then
            call leave_out(self, newton%correction%redundant, candidates, goes_on)
            if (goes_on) cycle
         end if
         if (status /= newton_converged .or. self%penalty%is_at_ends) return
         newton%driven = 0.0_wp                  ! the prescribed motion is in `motion` now
         call penalty_augment(self%penalty, self%set, is_done)
         is_left = .not. is_done
         self%lam(self%set%id(:self%set%n)) = self%set%lam(:self%set%n)
         before = candidates%acts
         call look(self, system, motion, candidates, status)
         if (status /= step_done) return
         call let_go(self, system, candidates)
         self%is_active = candidates%acts
         is_left = is_left .or. any(before .neqv. candidates%acts)
         if (.not. (is_left .or. candidates%have_changed)) return
         if (self%penalty%n_augmentation > most_augmentations) exit
      end do
      status = merge(step_loose, step_cycling, self%penalty%n_augmentation > most_augmentations)
   end subroutine solve_by_laws

   !> What pulls acts no more, unless it gives back what it stores.
   subroutine let_go(self, system, candidates)
      type(active_set_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(candidates_t), intent(inout) :: candidates
      integer :: k, pair, i

      do k = self%set%n_permanent + 1, self%set%n
         associate (id => self%set%id(k))
            call constraint_index(system, id, pair, i)
            candidates%acts(id) = self%set%lam(k) >= -noise_at(self, system, &
               system%contact(pair)%contact%node(i)) .or. constraints_gives_back(self%set, k)
         end associate
      end do
   end subroutine let_go

   !> Solve with what acts.
   subroutine solve_set(self, system, newton, motion, candidates, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      type(candidates_t), intent(inout) :: candidates
      integer, intent(out) :: status             !! one of the `newton_` codes
      type(error_t), allocatable, intent(out) :: error
      integer :: left

      call phase_enter(system%phases, phase_gaps, left)
      self%n_tried = 0
      call active_set_select(self, system, motion, candidates%is_measured)
      candidates%acts = .false.
      candidates%acts(self%set%id(:self%set%n)) = .true.
      candidates%takes_part = candidates%takes_part .or. candidates%acts
      call phase_leave(system%phases, left)
      call newton_solve(newton, system, self%set, motion, status, error)
      self%n_newton = self%n_newton + newton%convergence%n_iteration
   end subroutine solve_set

   !> What follows from others waits: rows of gaps do, and of what always holds for the whole step.
   !> `goes_on` if these are all.
   pure subroutine leave_out(self, redundant, candidates, goes_on)
      type(active_set_t), intent(inout) :: self
      integer, intent(in) :: redundant(:)        !! (any) rows of the set, from 1
      type(candidates_t), intent(inout) :: candidates
      logical, intent(out) :: goes_on
      integer :: k, id

      goes_on = all(redundant <= self%set%n)
      do k = 1, size(redundant)
         if (redundant(k) > self%set%n) cycle
         id = self%set%id(redundant(k))
         if (redundant(k) <= self%set%n_permanent) candidates%takes_part(id) = .false.
         self%is_active(id) = .false.
      end do
   end subroutine leave_out

   !> The set that obeys the laws where the step is linearised by the kept factor.
   subroutine choose(self, system, newton, motion, candidates, goes_on, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      type(candidates_t), intent(inout) :: candidates
      logical, intent(out) :: goes_on            !! there is such a factor, and such a set
      type(error_t), allocatable, intent(out) :: error
      type(contact_problem_t) :: problem
      type(contact_effort_t) :: effort
      type(slip_status_t), allocatable :: status(:)
      real(wp), allocatable :: force(:, :)
      logical :: before(size(candidates%acts))

      before = candidates%acts
      candidates%is_new_set = .false.
      goes_on = newton%factor_policy%is_allowed .and. newton%correction%kept%is_made
      if (.not. goes_on) return
      call select_all(self, system, motion, candidates)
      associate (set => self%set)
         goes_on = set%n_permanent == 0 .and. set%n > 0 .and. set%n_condition == set%n .and. &
            kept_factor_has_room(newton%correction%kept, set%n, size(system%matrix%column))
         if (.not. goes_on) return
         call constraints_evaluate(set, system, motion, .true.)
         call constraints_rows(set, system%space%numbering)
         call newton_pick_residual(newton, system, set)
         call contact_problem_create(problem, 0, set%n)
         allocate(force(0:0, set%n))
         call kept_factor_condense(newton%correction%kept, set, newton%residual, problem%w, &
            problem%free(0, :), error)
         if (allocated(error)) return
         force(0, :) = set%lam(:set%n)
         call contact_problem_solve(problem, force, effort, goes_on)
         if (.not. goes_on) return
         self%lam(set%id) = force(0, :)
         status = contact_problem_status(problem, force)
         candidates%acts(set%id) = status%kind /= contact_open
      end associate
      self%is_active = candidates%acts
      candidates%is_new_set = any(before .neqv. candidates%acts)
   end subroutine choose

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
   subroutine solve_with_all(self, system, newton, motion, candidates, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      type(candidates_t), intent(inout) :: candidates
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      type(coulomb_t), allocatable :: law(:)     ! (contacts of the set)
      integer :: i, n_early, n_stale

      n_early = 0
      newton%convergence%largest_move = huge(1.0_wp)
      if (.not. self%has_impacts) newton%convergence%largest_move = self%largest_move
      do i = 1, most_rounds
         call select_all(self, system, motion, candidates)
         newton%looks_early = n_early < most_early
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
         if (status == newton_redundant) then
            ! They go for the step, and the user is told where that lets bodies into each other.
            associate (blocked => self%set%id(newton%correction%redundant))
               self%is_dropped(blocked) = .true.
               candidates%takes_part(blocked) = .false.
            end associate
            motion%du = self%first
            newton%driven = self%driven
            candidates%is_measured = .false.
            cycle
         end if
         if (status == newton_early) then
            newton%driven = 0.0_wp
            call keep(self, law, candidates)
            n_early = n_early + 1
            n_stale = self%n_stale
            call look(self, system, motion, candidates, status)
            ! On the way stencils are chosen as often as it takes.
            self%n_stale = n_stale
            if (status /= step_done) return
            cycle
         end if
         if (status /= newton_converged) return
         newton%driven = 0.0_wp                  ! the prescribed motion is in `motion` now
         call keep(self, law, candidates)
         ! Before stencils are chosen anew: the step was solved with these.
         call finish(self, system, newton, motion, error)
         if (allocated(error)) return
         call look(self, system, motion, candidates, status)
         if (status /= step_done .or. .not. candidates%have_changed) return
      end do
      status = step_cycling
   end subroutine solve_with_all

   !> All candidates act for now, and hold their slips.
   subroutine select_all(self, system, motion, candidates)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      type(candidates_t), intent(in) :: candidates
      integer :: left

      call phase_enter(system%phases, phase_gaps, left)
      self%is_active = candidates%takes_part
      if (self%friction%is_on) self%friction%law%status = slip_status_t()
      self%n_tried = 0
      call active_set_select(self, system, motion, candidates%is_measured)
      call phase_leave(system%phases, left)
   end subroutine select_all

   !> Multipliers and ways of the candidates: what is not open acts.
   subroutine keep(self, law, candidates)
      type(active_set_t), intent(inout) :: self
      type(coulomb_t), intent(in) :: law(:)      !! (contacts of the set)
      type(candidates_t), intent(inout) :: candidates
      integer :: k

      associate (set => self%set, friction => self%friction)
         self%lam(set%id(:set%n)) = set%lam(:set%n)
         call friction_keep(friction, set)
         candidates%acts = candidates%takes_part
         do k = 1, size(law)
            associate (id => set%id(set%n_permanent + k))
               candidates%acts(id) = law(k)%status%kind /= contact_open
               ! What touches holds a body that nothing pushes.
               associate (place => set%n_permanent + k)
                  if (self%support%is_needed) candidates%acts(id) = candidates%acts(id) .or. &
                     abs(set%defect(place)) <= gap_noise*set%item(place)%size
               end associate
               if (friction%is_on .and. candidates%acts(id)) friction%law(id)%status = law(k)%status
            end associate
         end do
      end associate
      self%is_active = candidates%acts
   end subroutine keep

   !> Leave set, rows and forces as the laws hold at the end.
   subroutine finish(self, system, newton, motion, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      type(error_t), allocatable, intent(out) :: error

      self%n_tried = 0
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
   subroutine look(self, system, motion, candidates, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      type(candidates_t), intent(inout) :: candidates
      integer, intent(out) :: status             !! one of the `step_` codes
      integer :: pair, k, left

      call phase_enter(system%phases, phase_gaps, left)
      status = step_done
      candidates%have_changed = .false.
      candidates%one_closes = .false.
      candidates%is_measured = .true.
      self%is_stale = .false.
      self%friction%lags = .false.
      k = self%set%n_permanent
      call active_set_pass(self, system, motion)
      do pair = 1, size(system%contact)
         associate (first => system%first_constraint(pair) + 1, &
               last => system%first_constraint(pair + 1))
            if (self%skip_until(pair)%passes .and. .not. any(candidates%takes_part(first:last))) &
               cycle
            call active_set_update_gaps(self, system, pair, motion, motion%du)
            if (.not. near_laws_are_none(self%near_laws, system%contact(pair)%contact)) &
               call near_laws_update(self%near_laws, system, pair, candidates%acts, &
               candidates%have_changed)
            call look_at_pair(self, system, pair, motion, candidates, k, status)
         end associate
      end do
      call phase_leave(system%phases, left)
      if (status /= step_done) return
      if (self%is_stale) then
         self%n_stale = self%n_stale + 1
         if (self%n_stale > most_stale) status = step_too_far
         candidates%have_changed = .true.
      else if (self%friction%lags .and. .not. candidates%have_changed) then
         self%friction%n_lagged = self%friction%n_lagged + 1
         candidates%have_changed = self%friction%n_lagged <= most_lagged
      end if
   end subroutine look

   !> The conditions of one contact.
   subroutine look_at_pair(self, system, pair, motion, candidates, k, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      integer, intent(in) :: pair
      type(motion_t), intent(in) :: motion
      type(candidates_t), intent(inout) :: candidates
      integer, intent(inout) :: k                !! places of the set that were looked at
      integer, intent(inout) :: status
      logical :: acts
      integer :: i, id

      associate (contact => system%contact(pair)%contact, friction => self%friction)
         do i = 1, contact%n_constraint
            id = system%first_constraint(pair) + i
            if (.not. candidates%takes_part(id)) then
               call join(self, system, pair, i, motion, candidates, status)
               cycle
            end if
            acts = candidates%acts(id)
            if (acts) k = k + 1
            if (contact%state(i)%is_leaving) then
               candidates%takes_part(id) = .false.
               candidates%has_left(id) = .true.
               candidates%acts(id) = .false.
               self%is_active(id) = .false.
               candidates%have_changed = .true.
            else if (acts) then
               call look_at_active(self, contact, i, k, motion, status)
               if (.not. self%was_active(id)) then
                  if (begins_unseen(self, contact, i, motion)) status = step_too_far
               end if
               if (.not. friction%is_on) cycle
               if (friction%law(id)%mu > 0.0_wp) friction%lags = friction%lags .or. &
                  contact%state(i)%slip_shift > most_shift
            else if (has_closed(self, contact, i, id)) then
               candidates%one_closes = .true.
               candidates%acts(id) = self%penalty%is_on
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
   subroutine join(self, system, pair, i, motion, candidates, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      integer, intent(in) :: pair, i
      type(motion_t), intent(in) :: motion
      type(candidates_t), intent(inout) :: candidates
      integer, intent(inout) :: status           !! a failure where it cannot
      logical :: closes

      associate (contact => system%contact(pair)%contact, id => system%first_constraint(pair) + i)
         if (contact%state(i)%is_leaving) return
         call look_at_open(self, contact, i, id, closes, status)
         ! What the pairs take in may hold the bodies away from their guards.
         if (.not. closes .or. (contact%slack > 0.0_wp .and. candidates%have_changed)) return
         if (candidates%has_left(id) .and. candidates%is_back(id)) status = step_too_far
         candidates%is_back(id) = candidates%has_left(id)
         if (self%friction%is_on) call friction_close(self%friction, system, pair, i, motion, &
            contact%state(i)%gap1 - gap_to_hold(self, contact%state(i), id), &
            .not. self%is_candidate(id))
         candidates%takes_part(id) = .true.
         candidates%acts(id) = self%penalty%is_on
         candidates%have_changed = .true.
         self%is_candidate(id) = .true.
      end associate
   end subroutine join

end module emcon_contact_rounds
