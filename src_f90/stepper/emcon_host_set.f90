!> The active set of a host that solves the steps of its solids itself: one set after the other.
!>
!> What would penetrate is taken in, what pulls or has lost its surface is let go. If a set comes
!> back, the union of those since then is taken and nothing is let go any more: where gaps of the
!> start are held, which makes no energy, or where the host cannot cut the step; else it is to be
!> tried with another size. A set is told by what acts and by how that sticks or slides; if one
!> comes back, only that begins to slide which misses its law the most. Source: docs/theory.md,
!> section 6.1.
module emcon_host_set
   use emcon_active_set, only : active_set_note_stale, active_set_pass, active_set_t, &
      active_set_update_gaps, step_cycling, step_done, step_too_far, touch_tol
   use emcon_contact_conditions, only : begins_unseen, gap_to_hold, look_at_active, look_at_open, &
      noise_at
   use emcon_coulomb_law, only : slip_status_t
   use emcon_friction, only : friction_close
   use emcon_host_friction, only : host_friction_lags, host_friction_look_back, &
      host_friction_status, host_friction_turn, host_friction_turn_few, host_friction_ways
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_near_laws, only : near_laws_are_none, near_laws_update
   use emcon_system, only : system_t
   implicit none
   private
   public :: host_set_t, host_set_begin, host_set_choose, host_set_condense, host_set_try, &
      host_set_advance, host_set_drop, host_set_next

   !> Sets of one step at most.
   integer, parameter :: most_sets = 40

   type :: host_set_t
      logical, allocatable :: tried(:, :)        !! (n_constraint, most_sets)
      integer, allocatable :: way(:, :)          !! (n_constraint, most_sets) how these held
      integer :: n_tried = 0
      logical :: only_adds = .false.             !! nothing is let go any more
      logical :: turns_few = .false.             !! of what would slide only the worst does
      logical :: is_problem = .false.            !! its contacts are candidates, solved as one
   end type host_set_t

contains

   !> A step begins.
   pure subroutine host_set_begin(self, n)
      type(host_set_t), intent(out) :: self
      integer, intent(in) :: n                   !! constraints

      allocate(self%tried(n, most_sets), source=.false.)
      allocate(self%way(n, most_sets), source=0)
   end subroutine host_set_begin

   !> The set that the host is to solve with.
   pure function host_set_next(active) result(acts)
      type(active_set_t), intent(in) :: active
      logical :: acts(size(active%is_active))    !! (n_constraint)

      acts = active%is_active
   end function host_set_next

   !> The host solves with a set of its choice.
   pure subroutine host_set_choose(self, active, acts)
      type(host_set_t), intent(inout) :: self
      type(active_set_t), intent(inout) :: active
      logical, intent(in) :: acts(:)             !! (n_constraint)

      active%is_active = acts
      self%is_problem = .false.
      call host_set_try(self, active)
   end subroutine host_set_choose

   !> What was chosen are candidates: which of them act is told by their multipliers.
   pure subroutine host_set_condense(self)
      type(host_set_t), intent(inout) :: self

      self%is_problem = .true.
   end subroutine host_set_condense

   !> The host solves with what acts.
   pure subroutine host_set_try(self, active)
      type(host_set_t), intent(inout) :: self
      type(active_set_t), intent(in) :: active

      self%n_tried = min(self%n_tried + 1, most_sets)
      self%tried(:, self%n_tried) = active%is_active
      self%way(:, self%n_tried) = host_friction_ways(active, host_set_next(active))
   end subroutine host_set_try

   !> The next set from the motion and the multipliers that solve the step with the present one;
   !> `is_done` if that one stands, or if `status` tells of a failure.
   subroutine host_set_advance(self, active, system, motion, is_done, status)
      type(host_set_t), intent(inout) :: self
      type(active_set_t), intent(inout) :: active
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(out) :: is_done            !! else solve the step again with the next set
      integer, intent(out) :: status             !! one of the `step_` codes
      logical :: before(size(active%is_active)), turns, grows
      type(slip_status_t), allocatable :: held(:)

      before = active%is_active
      call host_friction_status(active, held)
      call update(self, active, system, motion, grows, status)
      turns = .false.
      if (.not. self%is_problem) then
         call host_friction_turn(active, host_set_next(active), system, turns)
         if (self%turns_few) call host_friction_turn_few(active, held)
      end if
      is_done = status /= step_done
      if (active%is_stale) then
         call active_set_note_stale(active, status)
         is_done = status /= step_done
         self%n_tried = 0
         return
      end if
      if (is_done) return
      if (all(before .eqv. active%is_active) .and. .not. turns) then
         ! What has come near is damped from now on: the same set again.
         if (grows) return
         call host_friction_lags(active, before, system, turns)
         if (.not. turns) call host_friction_look_back(active, before, system, motion, turns)
         is_done = .not. turns
         if (is_done .and. self%is_problem) call let_go(active)
         return
      end if
      if (self%is_problem .and. self%n_tried < most_sets) return
      if (.not. (comes_again(self, active) .or. self%n_tried == most_sets)) return
      if (size(held) > 0 .and. .not. self%turns_few) then
         self%turns_few = .true.
         self%n_tried = 0
         call host_friction_turn_few(active, held)
      else
         call end_cycle(self, active, status)
         is_done = status /= step_done
      end if
   end subroutine host_set_advance

   !> Of the conditions gap >= 0, lam >= 0, lam gap = 0 the set fulfils the last: what acts is let
   !> go where lam < 0, what does not is taken in where gap < 0.
   subroutine update(self, active, system, motion, grows, status)
      type(host_set_t), intent(in) :: self
      type(active_set_t), intent(inout) :: active
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(out) :: grows              !! laws beside the rows act on more
      integer, intent(out) :: status             !! one of the `step_` codes
      logical :: has_changed, changes, pushes(size(active%is_active))
      integer :: pair, i, id, k

      status = step_done
      grows = .false.
      call find_pushes(self, active, pushes)
      active%is_stale = .false.
      has_changed = .false.
      k = count(active%is_active(:system%first_constraint(1)))
      call active_set_pass(active, system, motion)
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact, &
               first => system%first_constraint(pair))
            if (active%skip_until(pair)%passes .and. &
               .not. any(active%is_active(first + 1:system%first_constraint(pair + 1)))) cycle
            call active_set_update_gaps(active, system, pair, motion, motion%du)
            if (.not. near_laws_are_none(active%near_laws, contact)) call near_laws_update( &
               active%near_laws, system, pair, pushes, grows)
            do i = 1, contact%n_constraint
               id = first + i
               if (active%is_active(id)) then
                  k = k + 1
                  changes = contact%state(i)%is_leaving
                  if (.not. (self%is_problem .and. .not. active%set%lam(k) > 0.0_wp)) then
                     call look_at_active(active, contact, i, k, motion, status)
                  end if
                  if (.not. self%is_problem) changes = changes .or. .not. (self%only_adds .or. &
                     active%set%lam(k) >= -noise_at(active, system, contact%node(i)))
               else
                  call look_at_left_out(active, system, pair, i, status)
                  call look_at_open(active, contact, i, id, changes, status)
                  ! What the pairs take in may hold the bodies away from their guards.
                  changes = changes .and. .not. (contact%waits(i) .and. has_changed)
                  if (changes .and. begins_unseen(active, contact, i, motion)) status = step_too_far
                  if (changes .and. active%friction%is_on) call friction_close(active%friction, &
                     system, pair, i, motion, contact%state(i)%gap1 - gap_to_hold(active, &
                     contact%state(i), id), .not. active%is_candidate(id))
                  active%is_candidate(id) = active%is_candidate(id) .or. changes
               end if
               has_changed = has_changed .or. changes
               active%is_active(id) = active%is_active(id) .neqv. changes
            end do
         end associate
      end do
   end subroutine update

   !> What acts; of candidates those that push.
   pure subroutine find_pushes(self, active, pushes)
      type(host_set_t), intent(in) :: self
      type(active_set_t), intent(in) :: active
      logical, intent(out) :: pushes(:)          !! (n_constraint)
      integer :: k

      pushes = active%is_active
      if (.not. self%is_problem) return
      do k = active%set%n_permanent + 1, active%set%n
         pushes(active%set%id(k)) = active%set%lam(k) > 0.0_wp
      end do
   end subroutine find_pushes

   !> A contact that was dropped and closes all the same does not follow from others: it had lost
   !> its surface.
   pure subroutine look_at_left_out(active, system, pair, i, status)
      type(active_set_t), intent(in) :: active
      type(system_t), intent(in) :: system
      integer, intent(in) :: pair, i
      integer, intent(inout) :: status           !! becomes `step_too_far` if so

      associate (gap => system%contact(pair)%contact%state(i), &
            id => system%first_constraint(pair) + i)
         if (.not. (active%is_left_out(id) .and. active%rules%may_cut)) return
         if (.not. (gap%is_near .and. gap%is_over)) return
         if (gap%gap1 < min(gap%gap0, active%start%left(1)*active%start%overclosure(id) &
            + gap%closed) - touch_tol*gap%size) status = step_too_far
      end associate
   end subroutine look_at_left_out

   !> The step is solved with all candidates: those that do not push do not act.
   pure subroutine let_go(active)
      type(active_set_t), intent(inout) :: active
      integer :: k

      do k = active%set%n_permanent + 1, active%set%n
         active%is_active(active%set%id(k)) = active%set%lam(k) > 0.0_wp
      end do
   end subroutine let_go

   !> Was the next set tried before?
   pure logical function comes_again(self, active)
      type(host_set_t), intent(in) :: self
      type(active_set_t), intent(in) :: active
      integer :: k

      comes_again = .false.
      do k = 1, self%n_tried
         comes_again = comes_again .or. is_that(self, k, active)
      end do
   end function comes_again

   !> Is what acts, and how, that of try `k`?
   pure logical function is_that(self, k, active)
      type(host_set_t), intent(in) :: self
      integer, intent(in) :: k                   !! 1..n_tried
      type(active_set_t), intent(in) :: active

      is_that = all(self%tried(:, k) .eqv. active%is_active) .and. &
         all(self%way(:, k) == host_friction_ways(active, host_set_next(active)))
   end function is_that

   !> Go on with the union of the sets since the first coming of the present one, if that may be.
   pure subroutine end_cycle(self, active, status)
      type(host_set_t), intent(inout) :: self
      type(active_set_t), intent(inout) :: active
      integer, intent(inout) :: status           !! `step_cycling` if not
      integer :: k, first

      if (self%only_adds .or. (active%rules%may_cut .and. .not. active%rules%holds_gap)) then
         status = step_cycling
         return
      end if
      first = 1
      do k = self%n_tried, 1, -1
         if (is_that(self, k, active)) first = k
      end do
      active%is_active = any(self%tried(:, first:self%n_tried), dim=2)
      self%only_adds = .true.
      self%n_tried = 0
   end subroutine end_cycle

   !> Constraints at the places `redundant` of the set follow from others, and do not act in this
   !> step.
   pure subroutine host_set_drop(self, active, redundant)
      type(host_set_t), intent(inout) :: self
      type(active_set_t), intent(inout) :: active
      integer, intent(in) :: redundant(:)        !! (any) from 1

      active%is_left_out(active%set%id(redundant)) = .true.
      active%is_active = active%is_active .and. .not. active%is_left_out
      self%n_tried = 0
   end subroutine host_set_drop

end module emcon_host_set
