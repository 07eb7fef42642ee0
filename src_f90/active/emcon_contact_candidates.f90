!> The candidates of a step: which contacts take part, solved with those that act, and looked at.
!>
!> They are what acted at the start of the step and what closes in it; they only grow within a step,
!> but for those that lose their surface, which come back once at most. Source: docs/theory.md,
!> section 6.1.
module emcon_contact_candidates
   use emcon_active_set, only : active_set_note_stale, active_set_pass, active_set_select, &
      active_set_slides, active_set_t, active_set_update_gaps, step_done, step_too_far, touch_tol
   use emcon_constraint_rows, only : constraints_rows
   use emcon_constraints, only : constraint_index, constraint_set_t, constraints_evaluate
   use emcon_contact, only : contact_t
   use emcon_contact_conditions, only : begins_unseen, gap_noise, gap_to_hold, look_at_active, &
      look_at_open
   use emcon_coulomb_law, only : slip_status_t
   use emcon_errors, only : error_t
   use emcon_friction, only : friction_close, friction_keep, friction_waits, most_lagged, &
      most_shift
   use emcon_gaps, only : gaps_follow_slips
   use emcon_kept_factor, only : kept_factor_most_iterated, kept_factor_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_t
   use emcon_near_laws, only : near_laws_are_none, near_laws_update
   use emcon_newton, only : newton_solve, newton_t
   use emcon_numbering, only : numbering_holds
   use emcon_phases, only : phase_enter, phase_gaps, phase_leave
   use emcon_system, only : system_t
   implicit none
   private
   public :: candidates_select, candidates_solve, &
      candidates_look, candidates_leave_out, candidates_keep_forces, candidates_are_many, &
      candidates_are_too_many, candidates_need_factor

   !> Of more contacts than these trials tell the next set in dynamics too: their problem is dense.
   !> Of more than those there is no room for the problem of all of them.
   integer, parameter :: most_condensed = 200, most_together = 2000

contains

   !> Are there so many candidates that trials find the next set of them sooner than their problem?
   !> That is dense: it takes more operations than a factor does where they are more than its root.
   !> What a factor takes is known while there is one: so a run that was resumed decides alike.
   pure logical function candidates_are_many(self, kept)
      type(active_set_t), intent(in) :: self
      type(kept_factor_t), intent(in) :: kept    !! of the step
      integer :: most

      most = most_condensed
      if (kept%is_made) most = max(most, int(min(kept%blocks%n_operation, &
         real(most_together, dp)**3)**(1.0_dp/3.0_dp)))
      candidates_are_many = are_beyond(self, most)
   end function candidates_are_many

   !> Does the problem of the candidates take a complete factor? By an incomplete one each of them
   !> takes a solution: all of these more operations than to factorise, unless they are few.
   pure logical function candidates_need_factor(self, kept)
      type(active_set_t), intent(in) :: self
      type(kept_factor_t), intent(in) :: kept    !! of the step

      candidates_need_factor = kept%is_made .and. kept%blocks%is_incomplete &
         .and. .not. candidates_are_many(self, kept)
      if (candidates_need_factor) candidates_need_factor = are_beyond(self, &
         kept_factor_most_iterated(kept))
   end function candidates_need_factor

   !> Are there too many candidates for a problem of all of them?
   pure logical function candidates_are_too_many(self)
      type(active_set_t), intent(in) :: self

      candidates_are_too_many = are_beyond(self, most_together)
   end function candidates_are_too_many

   !> In dynamics; where slip has a direction nothing but the problem finds it, of however many.
   pure logical function are_beyond(self, most)
      type(active_set_t), intent(in) :: self
      integer, intent(in) :: most

      are_beyond = self%rules%has_impacts .and. count(self%candidates%takes_part) > most .and. &
         .not. (self%friction%is_on .and. self%friction%n_slip > 1)
   end function are_beyond

   !> All candidates act for now, and hold their slips.
   subroutine candidates_select(self, system, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      integer :: left

      call phase_enter(system%phases, phase_gaps, left)
      if (self%friction%is_on) self%friction%law%status = slip_status_t()
      self%candidates%are_together = .true.
      self%is_active = self%candidates%takes_part
      call active_set_select(self, system, motion, self%candidates%is_measured)
      call exclude_bound(self, system, motion, .false.)
      call phase_leave(system%phases, left)
   end subroutine candidates_select

   !> Contacts in which nothing is free to move are no candidates: no force closes them. As
   !> sets are solved rows of nothing show as such: only others are looked at.
   subroutine exclude_bound(self, system, motion, tries_sets)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(in) :: tries_sets          !! else all candidates are solved for together
      logical :: may_be, has_changed
      integer :: k, pair, i

      may_be = .false.
      do k = self%set%n_permanent + 1, self%set%n
         may_be = may_be .or. may_be_bound(self, system, self%set%id(k), tries_sets)
      end do
      if (.not. may_be) return
      call constraints_evaluate(self%set, system, motion, .true.)
      call constraints_rows(self%set, system%space%numbering)
      has_changed = .false.
      do k = self%set%n_permanent + 1, self%set%n
         associate (id => self%set%id(k))
            if (.not. may_be_bound(self, system, id, tries_sets)) cycle
            call constraint_index(system, id, pair, i)
            if (.not. is_bound(self%set, k, system%contact(pair)%contact%least_free())) cycle
            call exclude(self, id)
            has_changed = .true.
         end associate
      end do
      if (has_changed) call active_set_select(self, system, motion, self%candidates%is_measured)
   end subroutine exclude_bound

   !> Is it to be found out whether contact `id` is one in which nothing is free to move? As sets
   !> are tried what acted so far is none.
   pure logical function may_be_bound(self, system, id, tries_sets) result(may_be)
      type(active_set_t), intent(in) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: id
      logical, intent(in) :: tries_sets
      integer :: pair, i

      call constraint_index(system, id, pair, i)
      associate (contact => system%contact(pair)%contact)
         may_be = numbering_holds(system%space%numbering, contact%node(i))
         if (tries_sets .and. may_be) may_be = contact%least_free() > 0.0_wp .and. .not. &
            (self%start%was_active(id) .or. self%candidates%acted(id))
      end associate
   end function may_be_bound

   !> Solve with what acts.
   subroutine candidates_solve(self, system, newton, motion, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `newton_` codes
      type(error_t), allocatable, intent(out) :: error
      integer :: k, left

      call phase_enter(system%phases, phase_gaps, left)
      self%candidates%are_together = .false.
      call active_set_select(self, system, motion, self%candidates%is_measured)
      call exclude_bound(self, system, motion, .true.)
      self%candidates%acts = .false.
      do k = 1, self%set%n
         self%candidates%acts(self%set%id(k)) = .true.
         self%candidates%takes_part(self%set%id(k)) = .true.
      end do
      self%candidates%acted(:) = self%candidates%acts
      call phase_leave(system%phases, left)
      ! Where friction turns too much for a factor that is kept, the problem of all follows.
      call newton_solve(newton, system, self%set, motion, status, error, &
         .not. (self%friction%follows .and. active_set_slides(self)))
      self%n_newton = self%n_newton + newton%convergence%n_iteration
   end subroutine candidates_solve

   !> Multipliers and friction of the set, by the numbers of its contacts.
   pure subroutine candidates_keep_forces(self)
      type(active_set_t), intent(inout) :: self
      integer :: k

      do k = 1, self%set%n
         self%lam(self%set%id(k)) = self%set%lam(k)
      end do
      call friction_keep(self%friction, self%set)
   end subroutine candidates_keep_forces

   !> What follows from others waits: rows of gaps do, and of what always holds for the whole step.
   !> `goes_on` if these are all.
   pure subroutine candidates_leave_out(self, redundant, goes_on)
      type(active_set_t), intent(inout) :: self
      integer, intent(in) :: redundant(:)        !! (any) rows of the set, from 1
      logical, intent(out) :: goes_on            !! all these are rows of gaps
      integer :: k, id

      goes_on = all(redundant <= self%set%n)
      do k = 1, size(redundant)
         if (redundant(k) > self%set%n) cycle
         id = self%set%id(redundant(k))
         if (redundant(k) <= self%set%n_permanent) then
            self%candidates%takes_part(id) = .false.
            self%is_left_out(id) = .true.
         end if
         if (is_bound(self%set, redundant(k), 0.0_wp)) call exclude(self, id)
         self%is_active(id) = .false.
      end do
   end subroutine candidates_leave_out

   !> Is nothing in row `k` of the set free to move, or no more than a part `least` of it?
   pure logical function is_bound(set, k, least)
      type(constraint_set_t), intent(in) :: set  !! evaluated, with its rows
      integer, intent(in) :: k                   !! 1 to n
      real(wp), intent(in) :: least              !! 0 to 1

      associate (own => set%item(k), first => set%force_rows%row_start(k) + 1, &
            last => set%force_rows%row_start(k + 1))
         is_bound = last < first
         if (least > 0.0_wp) is_bound = is_bound .or. norm2(set%force_rows%value(first:last)) &
            <= least*norm2(own%g(:, :own%n_node))
      end associate
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

   !> Measure all gaps for the motion. Who joins, who has lost its surface, who closes although it
   !> does not act, which stencils were chosen for another motion?
   subroutine candidates_look(self, system, motion, status, obeys)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      integer, intent(out) :: status             !! one of the `step_` codes
      logical, intent(in) :: obeys               !! what acts pushes, friction is as its law says
      integer :: pair, k, left

      call phase_enter(system%phases, phase_gaps, left)
      status = step_done
      self%candidates%have_changed = .false.
      self%candidates%one_closes = .false.
      self%candidates%is_measured = .true.
      self%candidates%is_blamed = .false.
      self%is_stale = .false.
      self%friction%lags = .false.
      k = self%set%n_permanent
      call active_set_pass(self, system, motion)
      do pair = 1, size(system%contact)
         associate (first => system%first_constraint(pair) + 1, &
               last => system%first_constraint(pair + 1))
            if (self%skip_until(pair)%passes .and. &
               .not. any(self%candidates%takes_part(first:last))) cycle
            call active_set_update_gaps(self, system, pair, motion, motion%du)
            if (.not. near_laws_are_none(self%near_laws, system%contact(pair)%contact)) then
               call near_laws_update(self%near_laws, system, pair, self%candidates%acts, &
               self%candidates%have_changed)
            end if
            call look_at_pair(self, system, pair, motion, k, status)
         end associate
      end do
      call phase_leave(system%phases, left)
      if (status /= step_done) return
      if (self%is_stale) then
         if (obeys) call active_set_note_stale(self, status)
         self%candidates%have_changed = .true.
      else if (self%friction%lags .and. .not. self%candidates%have_changed) then
         if (friction_waits(self%friction, obeys .and. .not. self%candidates%one_closes)) return
         self%friction%n_lagged = self%friction%n_lagged + 1
         self%candidates%have_changed = self%friction%n_lagged <= most_lagged
         if (self%candidates%have_changed) call gaps_follow_slips(system)
      end if
   end subroutine candidates_look

   !> The conditions of the contacts of one pair, and those on which the step cannot stand.
   subroutine look_at_pair(self, system, pair, motion, k, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      integer, intent(in) :: pair
      type(motion_t), intent(in) :: motion
      integer, intent(inout) :: k                !! places of the set that were looked at
      integer, intent(inout) :: status
      logical :: was_stale, had_changed
      integer :: i, id, own

      was_stale = self%is_stale
      had_changed = self%candidates%have_changed
      associate (contact => system%contact(pair)%contact)
         do i = 1, contact%n_constraint
            id = system%first_constraint(pair) + i
            own = step_done
            self%is_stale = .false.
            if (.not. self%candidates%takes_part(id)) then
               call join(self, system, pair, i, motion, had_changed, own)
            else if (self%candidates%acts(id) .or. contact%state(i)%is_leaving) then
               if (self%candidates%acts(id)) k = k + 1
               call look_at_acting(self, contact, i, id, k, motion, own)
            else if (has_closed(self, contact, i, id)) then
               self%candidates%one_closes = .true.
               self%candidates%acts(id) = .true.
            end if
            self%candidates%is_blamed(id) = own /= step_done .or. self%is_stale
            was_stale = was_stale .or. self%is_stale
            if (own /= step_done) status = own
         end do
      end associate
      self%is_stale = was_stale
   end subroutine look_at_pair

   !> The conditions of a contact that takes part, and acts or has lost its surface.
   subroutine look_at_acting(self, contact, i, id, k, motion, status)
      type(active_set_t), intent(inout) :: self
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i, id, k            !! in `contact`, over all pairs, in the set
      type(motion_t), intent(in) :: motion
      integer, intent(inout) :: status           !! a failure where the step cannot stand on it

      if (contact%state(i)%is_leaving) then
         self%candidates%takes_part(id) = .false.
         self%candidates%has_left(id) = .true.
         self%candidates%acts(id) = .false.
         self%is_active(id) = .false.
         self%candidates%have_changed = .true.
         return
      end if
      call look_at_active(self, contact, i, k, motion, status)
      if (.not. self%start%was_active(id)) then
         if (begins_unseen(self, contact, i, motion)) status = step_too_far
      end if
      associate (friction => self%friction)
         if (.not. friction%is_on) return
         if (friction%law(id)%mu > 0.0_wp) friction%lags = friction%lags .or. &
            contact%state(i)%slip_shift > most_shift
      end associate
   end subroutine look_at_acting

   !> Has the `i`-th constraint of `contact`, a candidate that does not act, closed? One that would
   !> hold the gap of its start may end below that, without a force, as long as it is not in. One
   !> that begins closed too far, which is never pushed out, has not if it opens.
   pure logical function has_closed(self, contact, i, id)
      type(active_set_t), intent(in) :: self
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i, id
      real(wp) :: held

      associate (gap => contact%state(i))
         held = min(gap_to_hold(self, gap, id), self%start%left(1)*self%start%overclosure(id) &
            + gap%closed)
         if (.not. self%rules%pushes_out .and. gap%gap0 < held - touch_tol*gap%size) then
            held = gap%gap0
         end if
         has_closed = gap%is_near .and. gap%is_over .and. gap%gap1 - held < -gap_noise*gap%size
      end associate
   end function has_closed

   !> Does the `i`-th constraint of a pair, which is no candidate, close? A guard waits: what the
   !> pairs take in may hold the bodies away from it. In sets of statics one guard bears what others
   !> would, so that they join one at a time.
   subroutine join(self, system, pair, i, motion, had_changed, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      integer, intent(in) :: pair, i
      type(motion_t), intent(in) :: motion
      logical, intent(in) :: had_changed         !! candidates, before this pair was looked at
      integer, intent(inout) :: status           !! a failure where it cannot
      logical :: closes

      associate (contact => system%contact(pair)%contact, id => system%first_constraint(pair) + i)
         if (contact%state(i)%is_leaving) return
         call look_at_open(self, contact, i, id, closes, status)
         if (.not. closes) return
         if (contact%waits(i) .and. merge(had_changed, self%candidates%have_changed, &
            self%rules%has_impacts .or. self%candidates%are_together)) return
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

end module emcon_contact_candidates
