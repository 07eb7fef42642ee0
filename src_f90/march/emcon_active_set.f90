!> Which constraints act in a step: a primal-dual active set around Newton's method.
!>
!> A constraint is taken in when its gap would be negative at the end of the step, and let go when
!> its multiplier is. If a set comes back, the union of the sets in the cycle is taken and
!> constraints are only added from then on: at once for persistent contact, which makes no energy
!> if it is held too long; else only where the step cannot be cut any more. Of constraints that say
!> nearly the same one acts until the other is needed too. Where Newton's method does not converge,
!> what pulls is let go before the step is cut; in statics, where no set stands, the step is tried
!> with sharp convex corners before. Linear constraints that are not eliminated act always. Source:
!> docs/theory.md, section 6.
module emcon_active_set
   use emcon_constraints, only : constraint_place, constraint_set_t, constraints_select
   use emcon_contact, only : contact_t, deepest_arrival, gap_state_t
   use emcon_errors, only : error_t
   use emcon_holding, only : holding_complete, holding_find_free, holding_forget, holding_t
   use emcon_kinds, only : wp
   use emcon_motion, only : at_rest, motion_t
   use emcon_newton, only : newton_converged, newton_diverged, newton_redundant, newton_solve, &
      newton_t
   use emcon_scene, only : scene_t
   use emcon_state, only : state_t
   use emcon_system, only : system_t
   use emcon_timer, only : stopwatch_start, stopwatch_stop
   implicit none
   private
   public :: active_set_t, active_set_init, active_set_solve
   public :: active_set_overclosure, active_set_begin, active_set_select, active_set_advance, &
      active_set_drop
   public :: step_done, step_refused, step_diverged, step_singular, step_cycling, step_too_far, &
      step_stands_off, step_not_held, step_overlaps

   !> How a step ended; the first four are those of Newton's method, whose fifth does not end one.
   integer, parameter :: step_done = 0, step_refused = 1, step_diverged = 2, step_singular = 3, &
      step_cycling = 5, step_too_far = 6, step_stands_off = 7, step_not_held = 8, step_overlaps = 9

   !> Penetration and tension below these multiples of epsilon are round-off.
   real(wp), parameter :: gap_noise = 64.0_wp*epsilon(1.0_wp)
   real(wp), parameter :: force_noise = 1.0e3_wp*epsilon(1.0_wp)
   !> A gap closed by more than this fraction of an edge is a penetration.
   real(wp), parameter :: touch_tol = sqrt(epsilon(1.0_wp))
   !> Sets tried in one step at most.
   integer, parameter :: most_sets = 40
   !> A step is solved again so often at most because stencils were chosen for another motion.
   integer, parameter :: most_stale = 3

   type :: active_set_t
      logical :: holds_gap = .true.              !! persistent: hold the gap of the step's start
      logical :: masses_resist = .true.          !! pushing bodies apart makes energy
      logical :: puts_off = .false.              !! what follows from others nearly waits
      real(wp) :: gap_tolerance = 0.0_wp         !! largest new stand-off per edge; 0: any
      type(constraint_set_t) :: set
      logical, allocatable :: is_active(:)       !! (n_constraint)
      real(wp), allocatable :: lam(:)            !! (n_constraint) multipliers to start from
      !> (n_constraint) what acted at the end of the step before, with which multipliers
      logical, allocatable :: was_active(:)
      real(wp), allocatable :: lam0(:)
      logical, allocatable :: tried(:, :)        !! (n_constraint, most_sets)
      integer :: n_tried = 0
      integer :: n_newton = 0                    !! iterations over all sets of the last step
      logical :: is_stale = .false.              !! stencils were chosen for another motion
      integer :: n_stale = 0                     !! so often in this step
      logical :: only_adds = .false.             !! nothing is let go any more in this step
      logical :: may_cut = .true.                !! the step may be tried in smaller parts
      logical, allocatable :: comes_and_goes(:)  !! (n_constraint) in the last step's cycle of sets
      logical, allocatable :: is_dropped(:)      !! (n_constraint) they follow from others
      logical, allocatable :: is_put_off(:)      !! (n_constraint) nearly so: they waited once
      logical, allocatable :: is_let_go(:)       !! (n_constraint) they pulled where Newton failed
      real(wp), allocatable :: before(:, :)      !! (n_dim, n_node) first guess of the present set
      real(wp), allocatable :: first(:, :)      !! (n_dim, n_node) and of the first set of the step,
      real(wp), allocatable :: driven(:, :)      !! (n_dim, n_node) with the prescribed motion in it
      !> (n_constraint) gap at the start of a step that resolves overclosure where it is closed,
      !> else 0; and the parts of it that are left at the start and the end of the increment.
      real(wp), allocatable :: overclosure(:)
      real(wp) :: left(0:1) = 0.0_wp
      type(holding_t) :: holding                 !! bodies that contact alone holds, in statics
   end type active_set_t

contains

   !> Set up for the constraints of `system`.
   subroutine active_set_init(self, system)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      if (allocated(self%is_active)) deallocate(self%is_active, self%lam, self%tried, &
         self%comes_and_goes, self%is_dropped, self%is_put_off, self%is_let_go, self%overclosure)
      allocate(self%overclosure(system%n_constraint), source=0.0_wp)
      allocate(self%is_active(system%n_constraint), source=.false.)
      allocate(self%comes_and_goes(system%n_constraint), source=.false.)
      allocate(self%is_dropped(system%n_constraint), source=.false.)
      allocate(self%is_put_off(system%n_constraint), source=.false.)
      allocate(self%is_let_go(system%n_constraint), source=.false.)
      allocate(self%lam(system%n_constraint), source=0.0_wp)
      allocate(self%tried(system%n_constraint, most_sets), source=.false.)
      call constraints_select(self%set, [integer ::])
   end subroutine active_set_init

   !> With `is_meant` the gaps at x + u that are closed are what the step resolves, else nothing.
   subroutine active_set_overclosure(self, system, x, u, is_meant)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)       !! (n_dim, n_node) [L]
      logical, intent(in) :: is_meant            !! the step resolves what is closed
      integer :: pair

      self%overclosure = 0.0_wp
      if (.not. is_meant) return
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact, &
               first => system%first_constraint(pair) + 1, &
               last => system%first_constraint(pair + 1))
            contact%reach = 0.0_wp
            call contact%begin_step(x, u, at_rest(u))
            call contact%measure(x, u, at_rest(u))
            where (contact%state%is_near .and. contact%state%is_over)
               self%overclosure(first:last) = min(0.0_wp, contact%state%gap0)
            end where
         end associate
      end do
   end subroutine active_set_overclosure

   !> Solve the step that has begun; `motion%du` is the first guess and the result.
   subroutine active_set_solve(self, system, scene, newton, motion, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      logical :: is_done, is_held

      self%first = motion%du
      self%driven = newton%driven
      do
         call stopwatch_start(system%contact_clock)
         if (self%holding%is_needed) call hold(self, system, scene, newton%driven, motion)
         call active_set_select(self, system, motion)
         call stopwatch_stop(system%contact_clock)
         status = step_not_held
         if (allocated(self%holding%text)) return
         self%before = motion%du
         call newton_solve(newton, system, self%set, motion, status, error)
         if (allocated(error)) return
         self%lam(self%set%id) = self%set%lam
         self%n_newton = self%n_newton + newton%n_iteration
         if (status == newton_redundant) then
            associate (redundant => newton%correction%redundant, is_near => &
                  newton%correction%is_near)
               call put_off(self, pack(redundant, is_near))
               call active_set_drop(self, pack(redundant, .not. is_near))
            end associate
            cycle
         end if
         if (status == newton_diverged) then
            call let_go_pulling(self, motion%du, is_done)
            if (is_done) call begin_sharp(self, system, newton, motion, is_done)
            if (is_done) return
            cycle
         end if
         newton%driven = 0.0_wp                         ! the prescribed motion is in `motion` now
         if (status /= newton_converged .or. size(system%contact) == 0) return
         call stopwatch_start(system%contact_clock)
         call active_set_advance(self, system, motion, is_done, status)
         if (is_done .and. status == step_done .and. self%holding%is_needed) then
            call holding_find_free(self%holding, system, scene, motion, self%is_active, is_held)
            if (.not. is_held) status = step_not_held
         end if
         call stopwatch_stop(system%contact_clock)
         if (status == step_cycling) call begin_sharp(self, system, newton, motion, is_done)
         if (is_done) return
      end do
   end subroutine active_set_solve

   !> Begin the step again with convex corners that are not rounded: in statics, where a node that
   !> is pushed over a corner finds no place to stand but on its round top. `is_done`: not possible.
   subroutine begin_sharp(self, system, newton, motion, is_done)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      logical, intent(out) :: is_done
      integer :: pair, n_newton

      is_done = self%masses_resist
      if (is_done) return
      is_done = .true.
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact)
            if (contact%may_sharpen .and. .not. contact%is_sharp) is_done = .false.
         end associate
      end do
      if (is_done) return
      n_newton = self%n_newton
      motion%du = self%first
      newton%driven = self%driven
      do pair = 1, size(system%contact)
         system%contact(pair)%contact%is_sharp = system%contact(pair)%contact%may_sharpen
      end do
      call begin_sets(self, system, motion)
      self%n_newton = n_newton
   end subroutine begin_sharp

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
      call holding_complete(self%holding, system, scene, motion, self%is_active)
      motion%du = motion%du + driven
      do pair = 1, size(system%contact)
         call system%contact(pair)%contact%begin_step(motion%x, motion%u0, motion%du)
      end do
   end subroutine hold

   !> Begin a step from `state` with the motion that is expected: stencils, and the first set.
   subroutine active_set_begin(self, system, motion, state)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      type(state_t), intent(in) :: state
      integer :: pair

      call stopwatch_start(system%contact_clock)
      self%was_active = state%is_active
      self%lam0 = state%lam
      do pair = 1, size(system%contact)
         system%contact(pair)%contact%is_sharp = .false.
      end do
      call begin_sets(self, system, motion)
      call stopwatch_stop(system%contact_clock)
   end subroutine active_set_begin

   !> Stencils and the first set, as the step began.
   subroutine begin_sets(self, system, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion

      call begin_contact(self, system, motion)
      call holding_forget(self%holding)
      self%lam = self%lam0
      self%n_newton = 0
      self%n_tried = 0
      self%n_stale = 0
      self%only_adds = .false.
      self%comes_and_goes = .false.
      self%is_dropped = .false.
      self%is_put_off = .false.
      self%is_let_go = .false.
   end subroutine begin_sets

   !> The next set from the motion and the multipliers that solve the step with the present one;
   !> `is_done` if that one stands, or if `status` tells of a failure.
   subroutine active_set_advance(self, system, motion, is_done, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(out) :: is_done            !! else solve the step again with the next set
      integer, intent(out) :: status                     !! one of the `step_` codes
      logical :: has_changed

      call update(self, system, motion, has_changed, status)
      if (self%is_stale .and. self%n_stale < most_stale) then
         self%n_stale = self%n_stale + 1
         self%n_tried = 0
         status = step_done
         is_done = .false.
         return
      end if
      if (self%is_stale .and. status == step_done) status = step_too_far
      is_done = status /= step_done .or. .not. has_changed
      if (is_done) return
      if (first_tried(self) > 0 .or. self%n_tried == most_sets) call end_cycle(self, status)
      is_done = status /= step_done
   end subroutine active_set_advance

   !> Choose stencils; start from the constraints that acted before and still can, also where the
   !> step is expected to end.
   subroutine begin_contact(self, system, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      integer :: pair

      self%is_active(:system%linear%n) = system%linear%is_used .and. .not. system%space%is_reduced
      self%is_active(system%linear%n + 1:system%first_constraint(1)) = .true.
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact, &
               first => system%first_constraint(pair) + 1, &
               last => system%first_constraint(pair + 1))
            call contact%begin_step(motion%x, motion%u0, motion%du)
            call contact%measure(motion%x, motion%u0, at_rest(motion%u0))
            self%is_active(first:last) = self%was_active(first:last) &
               .and. contact%state%is_near .and. contact%state%is_over
            if (.not. any(self%is_active(first:last))) cycle
            call contact%measure(motion%x, motion%u0, motion%du)
            self%is_active(first:last) = self%is_active(first:last) &
               .and. .not. contact%state%is_leaving
         end associate
      end do
   end subroutine begin_contact

   !> Hand the present set to the constraints, with the gaps to hold; multipliers carry over.
   subroutine active_set_select(self, system, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      integer :: k, pair, i

      call remember(self)
      if (self%set%n == 0 .and. .not. any(self%is_active)) return
      call constraints_select(self%set, pack([(k, k = 1, size(self%is_active))], self%is_active))
      do pair = 1, size(system%contact)
         call system%contact(pair)%contact%measure(motion%x, motion%u0, motion%du)
      end do
      do k = 1, self%set%n
         self%set%lam(k) = self%lam(self%set%id(k))
         call constraint_place(system, self%set%id(k), pair, i)
         self%set%is_kept(k) = self%set%id(k) <= system%linear%n
         if (pair == 0) cycle
         self%set%is_firm(k) = .not. self%puts_off .or. self%only_adds &
            .or. self%is_put_off(self%set%id(k))
         associate (gap => system%contact(pair)%contact%state(i))
            self%set%target(k) = self%left(1)*self%overclosure(self%set%id(k)) + gap%closed
            ! What is closed too far is never pushed out: that would make energy.
            self%set%is_kept(k) = self%holds_gap .or. (self%masses_resist .and. &
               gap%gap0 < self%set%target(k) - touch_tol*gap%size)
            if (self%set%is_kept(k)) self%set%target(k) = gap%gap0
         end associate
      end do
   end subroutine active_set_select

   !> The next set, from the gaps and multipliers of the converged one. Of the conditions gap >= 0,
   !> lam >= 0, lam gap = 0 the set fulfils the last: what acts is let go where lam < 0, what does
   !> not is taken in where gap < 0.
   subroutine update(self, system, motion, has_changed, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(out) :: has_changed
      integer, intent(out) :: status             !! one of the `step_` codes
      logical :: changes
      integer :: pair, i, id, k

      status = step_done
      has_changed = .false.
      self%is_stale = .false.
      k = count(self%is_active(:system%first_constraint(1)))
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact)
            ! The motion may be more than was expected.
            call contact%begin_step(motion%x, motion%u0, motion%du)
            call contact%measure(motion%x, motion%u0, motion%du)
            do i = 1, contact%n_constraint
               id = system%first_constraint(pair) + i
               if (self%is_active(id)) then
                  k = k + 1
                  call look_at_active(self, contact%state(i), k, self%was_active(id), status)
                  changes = is_let_go(self, system, contact, i, k)
                  if (changes .and. self%holding%is_needed) self%holding%has_pulled(id) = .true.
               else
                  call look_at_open(self, contact, i, id, changes, status)
                  ! What the pairs take in may hold the bodies away from their guards.
                  if (contact%slack > 0.0_wp .and. has_changed) changes = .false.
                  if (changes .and. begins_unseen(self, contact, i)) status = step_too_far
               end if
               if (changes) self%is_active(id) = .not. self%is_active(id)
               has_changed = has_changed .or. changes
            end do
         end associate
      end do
   end subroutine update

   !> Can the step stand on constraint `k` of the set, which acts? If its stencil has moved on, the
   !> step is solved again with that for the motion that came out.
   pure subroutine look_at_active(self, gap, k, was_active, status)
      type(active_set_t), intent(inout) :: self
      type(gap_state_t), intent(in) :: gap
      integer, intent(in) :: k
      logical, intent(in) :: was_active          !! in the step before
      integer, intent(inout) :: status
      real(wp) :: held

      if (.not. gap%is_covered) status = step_too_far
      ! A new contact may not be held at a larger distance than the deck allows.
      if (self%holds_gap .and. .not. was_active .and. self%gap_tolerance > 0.0_wp &
         .and. gap%gap0 > self%gap_tolerance*gap%size) status = step_stands_off
      held = merge(gap%gap0, self%set%target(k), self%set%is_kept(k))
      self%is_stale = self%is_stale .or. &
         (.not. gap%is_leaving .and. abs(gap%gap1 - held) > touch_tol*gap%size)
   end subroutine look_at_active

   !> Has constraint `k` of the set, the `i`-th of `contact`, lost its surface, or does it pull?
   pure logical function is_let_go(self, system, contact, i, k)
      type(active_set_t), intent(in) :: self
      type(system_t), intent(in) :: system
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i, k
      real(wp) :: noise

      noise = force_noise*sum(system%response%magnitude(:, contact%node(i)))
      if (.not. self%masses_resist) noise = noise + force_noise &
         *sum(system%response%rounding(:, contact%node(i)))
      is_let_go = contact%state(i)%is_leaving .or. &
         .not. (self%only_adds .or. self%set%lam(k) >= -noise)
   end function is_let_go

   !> Does the `i`-th constraint of `contact`, number `id`, which does not act, close? A contact
   !> that was left out and closes all the same does not follow from others: it had lost its
   !> surface.
   pure subroutine look_at_open(self, contact, i, id, closes, status)
      type(active_set_t), intent(in) :: self
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i, id
      logical, intent(out) :: closes
      integer, intent(inout) :: status
      real(wp) :: allowed(0:1)

      closes = .false.
      associate (gap => contact%state(i))
         if (.not. (gap%is_near .and. gap%is_over)) return
         allowed = self%left*self%overclosure(id) + gap%closed
         if (self%is_dropped(id)) then
            if (self%may_cut .and. gap%gap1 < min(gap%gap0, allowed(1)) - touch_tol*gap%size) &
               status = step_too_far
         else if (gap%is_arriving .and. self%masses_resist .and. .not. may_arrive(gap)) then
            return
         else if (gap%is_arriving .and. self%masses_resist .and. self%may_cut) then
            status = step_too_far
         else if (self%was_active(id) .or. .not. gap%gap0 - allowed(0) &
            < -contact%deepest_start*gap%size) then
            closes = .not. gap%gap1 - allowed(1) >= -gap_noise*gap%size
         end if
      end associate
   end subroutine look_at_open

   !> With nothing to hold at its start, a contact begins with the next step, or in a smaller one;
   !> in the smallest it begins at once, if it is deep.
   pure logical function may_arrive(gap)
      type(gap_state_t), intent(in) :: gap

      may_arrive = gap%was_open .and. .not. gap%gap1 >= -deepest_arrival*gap%size
   end function may_arrive

   !> Would the `i`-th constraint of `contact` begin to act with a stencil chosen for another
   !> motion?
   pure logical function begins_unseen(self, contact, i)
      type(active_set_t), intent(in) :: self
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i

      associate (gap => contact%state(i))
         begins_unseen = .not. gap%is_covered .or. &
            (self%masses_resist .and. gap%gap0 > contact%farthest_start)
      end associate
   end function begins_unseen

   !> Newton's method has not converged: let go of the contacts that pull in its last iterate, each
   !> once in a step, and start again with the multipliers and from where it started. `is_done` if
   !> there are none.
   pure subroutine let_go_pulling(self, du, is_done)
      type(active_set_t), intent(inout) :: self
      real(wp), intent(inout), contiguous :: du(:, :)
      logical, intent(out) :: is_done
      integer :: k

      is_done = .true.
      if (self%only_adds) return
      do k = self%set%n_held + 1, self%set%n
         associate (id => self%set%id(k))
            if (self%is_let_go(id) .or. .not. self%set%lam(k) < 0.0_wp) cycle
            self%is_let_go(id) = .true.
            self%is_active(id) = .false.
            is_done = .false.
         end associate
      end do
      if (is_done) return
      self%lam = self%lam0
      self%n_tried = 0
      du = self%before
   end subroutine let_go_pulling

   !> Constraints that follow from others nearly, at the places `near` of the set, wait: each comes
   !> back once its gap closes without it, and then goes before those others.
   pure subroutine put_off(self, near)
      type(active_set_t), intent(inout) :: self
      integer, intent(in) :: near(:)

      self%is_put_off(self%set%id(near)) = .true.
      self%is_active(self%set%id(near)) = .false.
      self%n_tried = 0
   end subroutine put_off

   !> Constraints that follow from earlier ones do not act in this step. They stand at the places
   !> `redundant` of the set; of constraints that depend on each other the last ones go.
   pure subroutine active_set_drop(self, redundant)
      type(active_set_t), intent(inout) :: self
      integer, intent(in) :: redundant(:)        !! (any) places in the set, from 1

      self%is_dropped(self%set%id(redundant)) = .true.
      self%is_active = self%is_active .and. .not. self%is_dropped
      self%n_tried = 0
   end subroutine active_set_drop

   subroutine remember(self)
      type(active_set_t), intent(inout) :: self

      self%n_tried = self%n_tried + 1
      self%tried(:, self%n_tried) = self%is_active
   end subroutine remember

   !> Number of the present set among those tried, 0 if it is new.
   pure integer function first_tried(self)
      type(active_set_t), intent(in) :: self

      do first_tried = 1, self%n_tried
         if (all(self%tried(:, first_tried) .eqv. self%is_active)) return
      end do
      first_tried = 0
   end function first_tried

   !> The sets since the first coming of the present one are a cycle: end it by their union, from
   !> which nothing is let go any more, or by a cut.
   pure subroutine end_cycle(self, status)
      type(active_set_t), intent(inout) :: self
      integer, intent(inout) :: status
      integer :: first

      first = max(1, first_tried(self))
      associate (cycle => self%tried(:, first:self%n_tried))
         self%comes_and_goes = any(cycle, dim=2) .and. .not. all(cycle, dim=2)
         self%is_active = any(cycle, dim=2)
      end associate
      if (self%only_adds .or. (self%may_cut .and. .not. self%holds_gap)) then
         status = step_cycling
      else
         self%only_adds = .true.
         self%n_tried = 0
      end if
   end subroutine end_cycle

end module emcon_active_set
