!> The next set of active constraints, from the gaps and multipliers of one that solves the step.
!> Source: docs/theory.md, section 6.
module emcon_active_set_update
   use emcon_active_set, only : active_set_update_gaps, active_set_pass, active_set_t, most_sets, &
      step_cycling, step_done, step_stands_off, step_too_far, touch_tol
   use emcon_constraints, only : constraint_index, constraints_gives_back
   use emcon_contact, only : contact_t, gap_ratio, gap_state_t, max_penetration_on_entry
   use emcon_near_laws, only : near_laws_are_none, near_laws_update
   use emcon_coulomb_law, only : slip_status_t
   use emcon_friction, only : friction_close, friction_holds, friction_is_same, friction_turn, &
      most_lagged, most_shift
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_scene, only : scene_t
   use emcon_system, only : system_t
   implicit none
   private
   public :: active_set_advance, active_set_leave, active_set_narrow
   public :: find_grips, look_at_active, look_at_open, begins_unseen, gap_to_hold, gap_noise, &
      noise_at, most_stale

   !> Penetration and tension below these multiples of epsilon are round-off.
   real(wp), parameter :: gap_noise = 64.0_wp*epsilon(1.0_wp)
   real(wp), parameter :: force_noise = 1.0e3_wp*epsilon(1.0_wp)
   !> A step is solved again so often at most because stencils were chosen for another motion.
   integer, parameter :: most_stale = 3
   !> Sets left before they were solved in one step at most.
   integer, parameter, public :: most_early = 10

   !> The one change of a set.
   type :: choice_t
      integer :: id = 0                          !! contact; 0: none yet
      logical :: pulls = .false.                 !! it is let go, else it is taken in
      real(wp) :: amount = 0.0_wp                !! < 0: force, or gap by the edge
   end type choice_t

contains

   !> The next set from the motion and the multipliers that solve the step with the present one;
   !> `is_done` if that one stands, or if `status` tells of a failure.
   subroutine active_set_advance(self, system, motion, is_done, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(out) :: is_done            !! else solve the step again with the next set
      integer, intent(out) :: status                     !! one of the `step_` codes
      logical :: has_changed, has_more

      call update(self, system, motion, has_changed, status, has_more)
      if (self%is_stale .and. self%n_stale < most_stale) then
         self%n_stale = self%n_stale + 1
         self%n_tried = 0
         status = step_done
         is_done = .false.
         return
      end if
      if (self%is_stale .and. status == step_done) status = step_too_far
      ! Another set has other slips for others to hold.
      has_changed = has_changed .or. has_more
      if (has_changed .and. self%friction%is_on .and. status == step_done) then
         self%friction%is_idle = .false.
      end if
      is_done = status /= step_done .or. .not. has_changed
      if (is_done .and. status == step_done .and. self%friction%lags &
         .and. self%friction%n_lagged < most_lagged) then
         self%friction%n_lagged = self%friction%n_lagged + 1
         self%n_tried = 0
         is_done = .false.
         return
      end if
      if (self%support%is_needed) call find_grips(self, system)
      if (is_done) return
      ! What is damped only grows within a step: the same contacts beside more of it are no cycle.
      if (has_more) self%n_tried = 0
      if (first_tried(self) > 0 .or. self%n_tried == most_sets) call end_cycle(self, system, status)
      is_done = status /= step_done
   end subroutine active_set_advance

   !> The next set, where the present one was seen to change before the step was solved with it. It
   !> was not tried to the end, so that no cycle is told from it; where what follows is no set to
   !> go on with, the present one stays, and is solved to the end.
   subroutine active_set_leave(self, system, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical :: before(size(self%is_active)), has_changed, has_more
      type(slip_status_t) :: slips(size(self%friction%law))
      integer :: status

      before = self%is_active
      slips = self%friction%law%status
      call update(self, system, motion, has_changed, status, has_more)
      self%n_tried = self%n_tried - 1
      self%n_early = self%n_early + 1
      if (status == step_done .and. (has_changed .or. has_more)) then
         ! Another set has other slips for others to hold.
         if (self%friction%is_on) self%friction%is_idle = .false.
         return
      end if
      self%is_active = before
      self%friction%law%status = slips
      self%n_early = most_early
   end subroutine active_set_leave

   !> Of contacts that have closed between the same two rigid bodies some follow from others, at the
   !> places `redundant` of the set: a large step takes in more than can act. Their order, which
   !> knows no symmetry, does not tell which do: the deepest stay, and the set goes on from these,
   !> one by one. `has_narrowed`: some were not as deep.
   subroutine active_set_narrow(self, system, scene, redundant, has_narrowed)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: redundant(:)        !! (any) places in the set, from 1
      logical, intent(out) :: has_narrowed       !! less is active
      real(wp) :: depth(self%set%n)              ! of contacts that have closed, by the edge
      integer, dimension(self%set%n) :: low, high   ! bodies; 0: not rigid, or it acted before
      integer :: body(size(scene%node%label)), i, k, pair
      logical :: is_like(self%set%n)

      has_narrowed = .false.
      depth = 0.0_wp
      if (.not. self%has_rigid .or. self%one_by_one) return
      body = 0
      do i = 1, size(scene%rigid)
         body(scene%rigid(i)%node) = i
      end do
      low = 0
      high = 0
      do k = self%set%n_permanent + 1, self%set%n
         if (self%was_active(self%set%id(k))) cycle
         call constraint_index(system, self%set%id(k), pair, i)
         depth(k) = depth_of(self, system%contact(pair)%contact%state(i), self%set%id(k))
         associate (item => self%set%item(k))
            low(k) = minval(body(item%node(:item%n_node)))
            high(k) = maxval(body(item%node(:item%n_node)))
         end associate
      end do
      do i = 1, size(redundant)
         if (low(redundant(i)) == 0) cycle
         is_like = low == low(redundant(i)) .and. high == high(redundant(i))
         is_like = is_like .and. depth > minval(depth, is_like) + touch_tol
         has_narrowed = has_narrowed .or. any(is_like)
         self%is_active(pack(self%set%id(:self%set%n), is_like)) = .false.
      end do
      if (.not. has_narrowed) return
      self%one_by_one = .true.
      self%n_tried = 0
   end subroutine active_set_narrow

   !> The next set, from the gaps and multipliers of the converged one. Of the conditions gap >= 0,
   !> lam >= 0, lam gap = 0 the set fulfils the last: what acts is let go where lam < 0, what does
   !> not is taken in where gap < 0.
   subroutine update(self, system, motion, has_changed, status, has_more)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(out) :: has_changed
      integer, intent(out) :: status             !! one of the `step_` codes
      logical, intent(out) :: has_more           !! of what is damped
      logical :: changes, turns
      type(choice_t) :: choice
      integer :: pair, i, id, k

      status = step_done
      has_changed = .false.
      has_more = .false.
      self%is_stale = .false.
      self%friction%lags = .false.
      k = count(self%is_active(:system%first_constraint(1)))
      call active_set_pass(self, system, motion)
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact)
            ! The motion may be more than was expected.
            if (self%skip_until(pair)%passes .and. .not. any(self%is_active( &
               system%first_constraint(pair) + 1:system%first_constraint(pair + 1)))) cycle
            call active_set_update_gaps(self, system, pair, motion, motion%du)
            if (.not. near_laws_are_none(self%near_laws, contact)) call near_laws_update( &
               self%near_laws, system, pair, self%is_active, has_more)
            do i = 1, contact%n_constraint
               id = system%first_constraint(pair) + i
               if (self%is_active(id)) then
                  k = k + 1
                  call look_at_active(self, contact, i, k, motion, status)
                  changes = is_let_go(self, system, contact, i, k)
                  if (changes .and. self%support%is_needed) self%support%has_pulled(id) = .true.
                  if (self%friction%is_on .and. .not. changes) then
                     call friction_turn(self%friction, system, self%set, k, turns)
                     has_changed = has_changed .or. turns
                     if (has_friction(self, id)) self%friction%lags = self%friction%lags &
                        .or. contact%state(i)%slip_shift > most_shift
                  end if
               else
                  call look_at_open(self, contact, i, id, changes, status)
                  ! What the pairs take in may hold the bodies away from their guards.
                  if (contact%slack > 0.0_wp .and. has_changed) changes = .false.
                  if (changes .and. begins_unseen(self, contact, i, motion)) status = step_too_far
                  if (changes .and. self%friction%is_on) call friction_close(self%friction, &
                     system, pair, i, motion, contact%state(i)%gap1 - gap_to_hold(self, &
                     contact%state(i), id), .not. self%is_candidate(id))
                  self%is_candidate(id) = self%is_candidate(id) .or. changes
               end if
               has_changed = has_changed .or. changes
               if (changes .and. self%one_by_one .and. .not. contact%state(i)%is_leaving) then
                  call weigh(self, contact%state(i), id, k, choice)
               else if (changes) then
                  self%is_active(id) = .not. self%is_active(id)
               end if
            end do
         end associate
      end do
      if (choice%id > 0) self%is_active(choice%id) = .not. self%is_active(choice%id)
   end subroutine update

   !> The gap that contact `id` would hold.
   pure real(wp) function gap_to_hold(self, gap, id)
      type(active_set_t), intent(in) :: self
      type(gap_state_t), intent(in) :: gap
      integer, intent(in) :: id                  !! number over all pairs

      gap_to_hold = self%left(1)*self%overclosure(id) + gap%closed
      if (self%holds_gap .and. .not. self%closes(id)) gap_to_hold = gap%gap0
   end function gap_to_hold

   !> Is it contact `id` that is to change alone? What pulls most goes first, then what is deepest
   !> comes.
   pure subroutine weigh(self, gap, id, k, choice)
      type(active_set_t), intent(in) :: self
      type(gap_state_t), intent(in) :: gap
      integer, intent(in) :: id
      integer, intent(in) :: k                   !! its place in the set, if it acts
      type(choice_t), intent(inout) :: choice
      logical :: pulls
      real(wp) :: amount

      pulls = self%is_active(id)
      if (pulls) then
         amount = self%set%lam(k)
      else
         amount = depth_of(self, gap, id)
      end if
      if (choice%id > 0) then
         if (choice%pulls .and. .not. pulls) return
         if ((choice%pulls .eqv. pulls) .and. .not. amount < choice%amount) return
      end if
      choice = choice_t(id, pulls, amount)
   end subroutine weigh

   !> How far contact `id` is open at the end of the step, by the edge: < 0 if it closes.
   pure real(wp) function depth_of(self, gap, id) result(depth)
      type(active_set_t), intent(in) :: self
      type(gap_state_t), intent(in) :: gap
      integer, intent(in) :: id

      depth = (gap%gap1 - self%left(1)*self%overclosure(id) - gap%closed)/gap%size
   end function depth_of

   !> Can the step stand on constraint `k` of the set, the `i`-th of `contact`, which acts? If its
   !> stencil has moved on, the step is solved again with that for the motion that came out.
   pure subroutine look_at_active(self, contact, i, k, motion, status)
      type(active_set_t), intent(inout) :: self
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i                   !! its number in `contact`
      integer, intent(in) :: k                   !! and in the set
      type(motion_t), intent(in) :: motion       !! that was last measured
      integer, intent(inout) :: status           !! one of the `step_` codes: left, or a failure
      real(wp) :: held
      logical :: is_new

      associate (gap => contact%state(i))
         if (.not. contact%covers(i, motion%x, motion%u0, motion%du)) status = step_too_far
         ! A new contact may not be held at a larger distance than the deck allows.
         is_new = self%set%is_kept(k) .and. .not. self%was_active(self%set%id(k))
         if (is_new .and. self%gap_tolerance > 0.0_wp &
            .and. gap_ratio(gap, gap%gap0) > self%gap_tolerance) status = step_stands_off
         held = merge(gap%gap0, self%set%target(k), self%set%is_kept(k))
         if (self%set%penalty%is_on) held = held + contact%mean_gap(i, self%set%penalty%left(k))
         self%is_stale = self%is_stale .or. &
            (.not. gap%is_leaving .and. abs(gap%gap1 - held) > touch_tol*gap%size)
      end associate
   end subroutine look_at_active

   !> Has constraint `k` of the set, the `i`-th of `contact`, lost its surface, or does it pull?
   pure logical function is_let_go(self, system, contact, i, k)
      type(active_set_t), intent(in) :: self
      type(system_t), intent(in) :: system
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i, k

      is_let_go = .false.
      if (constraints_gives_back(self%set, k)) return
      is_let_go = contact%state(i)%is_leaving .or. &
         .not. (self%only_adds .or. self%set%lam(k) >= -noise_at(self, system, contact%node(i)))
   end function is_let_go

   !> A push at a slave node below which it is round-off.
   pure real(wp) function noise_at(self, system, node) result(noise)
      type(active_set_t), intent(in) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: node                !! of the scene

      noise = force_noise*sum(system%response%magnitude(:, node))
      if (.not. self%has_impacts) noise = noise + force_noise &
         *sum(system%response%rounding(:, node))
   end function noise_at

   !> Contacts that hold along the surface as well, where the step is solved: without a push
   !> friction holds nothing.
   pure subroutine find_grips(self, system)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer :: k, pair, i

      if (.not. self%friction%is_on) return
      self%support%grips = friction_holds(self%friction)
      do k = self%set%n_permanent + 1, self%set%n
         associate (id => self%set%id(k))
            call constraint_index(system, id, pair, i)
            self%support%grips(id) = self%support%grips(id) .and. self%set%lam(k) > &
               noise_at(self, system, system%contact(pair)%contact%node(i))
         end associate
      end do
   end subroutine find_grips

   !> Does the `i`-th constraint of `contact`, number `id`, which does not act, close? A contact
   !> that was left out and closes all the same does not follow from others: it had lost its
   !> surface.
   pure subroutine look_at_open(self, contact, i, id, closes, status)
      type(active_set_t), intent(in) :: self
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i, id               !! in `contact`, and over all pairs
      logical, intent(out) :: closes             !! it is to be taken in
      integer, intent(inout) :: status           !! one of the `step_` codes: left, or a failure
      real(wp) :: allowed(0:1)

      closes = .false.
      associate (gap => contact%state(i))
         if (.not. (gap%is_near .and. gap%is_over)) return
         allowed = self%left*self%overclosure(id) + gap%closed
         if (self%is_dropped(id)) then
            if (self%may_cut .and. gap%gap1 < min(gap%gap0, allowed(1)) - touch_tol*gap%size) then
               status = step_too_far
            end if
         else if (gap%is_arriving .and. contact%step%is_penalty) then
            closes = gap%gap1 < allowed(1) &
               .and. gap%gap1 > -contact%max_penetration_at_start*gap%size
         else if (gap%is_arriving .and. self%has_impacts .and. .not. may_arrive(gap)) then
            return
         else if (gap%is_arriving .and. self%has_impacts .and. self%may_cut) then
            status = step_too_far
         else if (self%was_active(id) .or. .not. gap%gap0 - allowed(0) &
            < -contact%max_penetration_at_start*gap%size) then
            closes = .not. gap%gap1 - allowed(1) >= -merge(0.0_wp, gap_noise, &
               contact%step%is_penalty)*gap%size
            if (self%holds_gap .and. self%is_candidate(id) .and. (self%has_cycled &
               .or. has_friction(self, id))) closes = gap%gap1 - gap%gap0 < -gap_noise*gap%size
         end if
      end associate
   end subroutine look_at_open

   !> Does friction act on contact `id`?
   pure logical function has_friction(self, id)
      type(active_set_t), intent(in) :: self
      integer, intent(in) :: id

      has_friction = self%friction%is_on
      if (has_friction) has_friction = self%friction%law(id)%mu > 0.0_wp
   end function has_friction

   !> With nothing to hold at its start, a contact begins with the next step, or in a smaller one;
   !> in the smallest it begins at once, if it is deep.
   pure logical function may_arrive(gap)
      type(gap_state_t), intent(in) :: gap

      may_arrive = gap%was_open .and. .not. gap%gap1 >= -max_penetration_on_entry*gap%size
   end function may_arrive

   !> Would the `i`-th constraint of `contact` begin to act with a stencil chosen for another
   !> motion?
   pure logical function begins_unseen(self, contact, i, motion)
      type(active_set_t), intent(in) :: self
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i                   !! number in `contact`
      type(motion_t), intent(in) :: motion       !! that was last measured

      associate (gap => contact%state(i))
         begins_unseen = .not. contact%covers(i, motion%x, motion%u0, motion%du) .or. &
            (self%has_impacts .and. gap%gap0 > contact%max_gap_on_entry)
      end associate
   end function begins_unseen

   !> Number of the present set among those tried, 0 if it is new.
   pure integer function first_tried(self)
      type(active_set_t), intent(in) :: self

      do first_tried = 1, self%n_tried
         if (.not. all(self%tried(:, first_tried) .eqv. self%is_active)) cycle
         if (friction_is_same(self%friction, first_tried, self%is_active)) return
      end do
      first_tried = 0
   end function first_tried

   !> The sets since the first coming of the present one are a cycle: end it by a cut; or, where
   !> gaps of the start are held, by closing candidates below those from now on, and if one comes
   !> back then too by the union, from which nothing is let go any more. A guard beside a contact
   !> that says nearly the same would pull in the union: there a cut comes first.
   pure subroutine end_cycle(self, system, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(inout) :: status
      integer :: first

      first = max(1, first_tried(self))
      associate (cycle => self%tried(:, first:self%n_tried))
         self%comes_and_goes = any(cycle, dim=2) .and. .not. all(cycle, dim=2)
         self%is_active = any(cycle, dim=2)
      end associate
      if (self%only_adds .or. (self%may_cut .and. (any(self%closes) &
         .or. .not. self%holds_gap .or. self%friction%is_on))) then
         status = step_cycling
      else if (keeps_gaps(self) .and. .not. (self%has_cycled .or. self%friction%is_on)) then
         self%has_cycled = .true.
         self%comes_and_goes = .false.
         self%n_tried = 0
      else if (self%may_cut .and. any(self%comes_and_goes( &
         system%first_constraint(system%n_pair + 1) + 1:))) then
         status = step_cycling
      else
         self%only_adds = .true.
         self%n_tried = 0
      end if
   end subroutine end_cycle

   !> Do all contacts hold the gap of the step's start?
   pure logical function keeps_gaps(self)
      type(active_set_t), intent(in) :: self

      keeps_gaps = self%holds_gap .and. .not. any(self%closes) .and. &
         (.not. self%penalty%is_on .or. self%penalty%augments)
   end function keeps_gaps

end module emcon_active_set_update
