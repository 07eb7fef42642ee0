!> Which contacts with friction stick in a step and which slide where to.
!>
!> All of them change at once, by the trial of emcon_friction_law: what closes begins in the way
!> that its slip tells, and what slides may turn at once. Contacts that acted at the start or close
!> within the step are its candidates: they hold their gaps as one complementarity, and never cease
!> to be candidates within the step. Source: docs/theory.md, section 4.13.
module emcon_friction
   use emcon_constraint, only : condition_drag, condition_normal, condition_t, most_slips
   use emcon_constraints, only : constraint_index, constraint_set_t, constraints_stick
   use emcon_contact, only : contact_t
   use emcon_csr, only : csr_find
   use emcon_evaluation, only : evaluation_is_equilibrium, evaluation_displacement
   use emcon_friction_law, only : friction_trial, friction_violation, slip_rounding, touch_free, &
      touch_open, touch_rests, touch_sticks, touch_t
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_system, only : system_t
   implicit none
   private
   public :: friction_t, friction_init, friction_begin, friction_select, friction_idle, &
      friction_keep, friction_turn, friction_close, friction_work, friction_missed, &
      friction_slides, friction_holds

   !> So much of the friction of a contact may act on another node than its push, and a step is
   !> solved again so often at most for more.
   real(wp), parameter, public :: most_shift = 5.0e-3_wp
   integer, parameter, public :: most_lagged = 2
   !> Forces that differ by less than this part of the largest push are one.
   real(wp), parameter :: tied = 5.0e4_wp*epsilon(1.0_wp)

   type :: friction_t
      logical :: is_on = .false.                 !! some contact rubs; else nothing is allocated
      real(wp), allocatable :: mu(:)             !! (n_constraint)
      !> (n_constraint) of what acts: a way of emcon_friction_law
      integer, allocatable :: way(:)
      integer, allocatable :: way0(:)            !! (n_constraint) at the end of the step before
      real(wp), allocatable :: tau(:), tau0(:)   !! (n_constraint) friction, to start from
      real(wp), allocatable :: lead(:)           !! (n_constraint) a, from which slip counts [L]
      logical, allocatable :: is_idle(:)         !! (n_constraint) others hold its slip
      logical, allocatable :: is_needed(:)       !! (n_constraint) others hold its slip but nearly
      logical, allocatable :: has_turned(:)      !! (n_constraint) from one slide to the other
      logical, allocatable :: knows_limit(:)     !! (n_constraint) of mu: see emcon_friction_limit
      logical, allocatable :: knows_corners(:)   !! (n_contact) as emcon_interlock_plane tells
      integer, allocatable :: tried(:, :)        !! (n_constraint, sets) ways of the sets tried
      integer :: n_asked = 0                     !! times that the referee has set all of it
      logical :: lags = .false.                  !! it acts where slip was expected, not where it is
      integer :: n_lagged = 0                    !! so often the step was solved again for that
   end type friction_t

contains

   !> Set up for the contacts of `system`; `n_set` sets at most are tried in a step.
   subroutine friction_init(self, system, n_set)
      type(friction_t), intent(out) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: n_set               !! > 0
      integer :: i, n

      do i = 1, size(system%contact)
         if (.not. allocated(system%contact(i)%contact)) cycle    ! of a layer, given with the step
         self%is_on = self%is_on .or. system%contact(i)%contact%friction > 0.0_wp
      end do
      n = merge(system%n_constraint, 0, self%is_on)
      allocate(self%mu(n), self%tau(n), self%tau0(n), self%lead(n), source=0.0_wp)
      allocate(self%way(n), self%way0(n), source=touch_sticks)
      allocate(self%is_idle(n), self%is_needed(n), self%has_turned(n), self%knows_limit(n), &
         source=.false.)
      allocate(self%knows_corners(size(system%contact)), source=.false.)
      allocate(self%tried(n, merge(n_set, 0, self%is_on)), source=0)
      if (.not. self%is_on) return
      do i = 1, size(system%contact)
         self%mu(system%first_constraint(i) + 1:system%first_constraint(i + 1)) &
            = system%contact(i)%contact%friction
      end do
   end subroutine friction_init

   !> The step begins, or begins again, with stencils chosen: ways and friction of the step before,
   !> and slips counted from those with which velocities along the surface end, or that part of them
   !> which a restitution does not give back.
   pure subroutine friction_begin(self, system, motion, was_active)
      type(friction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(in) :: was_active(:)       !! (n_constraint)

      if (.not. self%is_on) return
      self%way = self%way0
      self%tau = self%tau0
      self%is_idle = .false.
      self%is_needed = .false.
      self%has_turned = .false.
      self%n_asked = 0
      self%n_lagged = 0
      self%lead = 0.0_wp
      if (.not. evaluation_is_equilibrium(motion%evaluation)) call find_leads(self, system, &
         motion, was_active)
   end subroutine friction_begin

   !> The slips of what acted, as `friction_begin` has it.
   pure subroutine find_leads(self, system, motion, was_active)
      type(friction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(in) :: was_active(:)
      real(wp) :: du(size(motion%du, 1), size(motion%du, 2))
      integer :: i, pair

      du = evaluation_displacement(motion%evaluation, motion%v0, 0.0_wp)
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact, first => system%first_constraint(pair))
            if (.not. contact%friction > 0.0_wp) cycle
            do i = 1, contact%n_constraint
               if (was_active(first + i)) self%lead(first + i) = lead_of(contact, i, motion, du)
            end do
         end associate
      end do
   end subroutine find_leads

   !> The slip with which contact `i` of a pair ends its velocity along the surface, less what a
   !> restitution gives back; what slip is rounded to leads nowhere.
   pure real(wp) function lead_of(contact, i, motion, du) result(lead)
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: du(:, :)           !! (n_dim, n_node) the way to that end [L]

      lead = (1.0_wp - contact%rebound)*contact%slip(i, motion%x, motion%u0, du)
      if (abs(lead) <= slip_rounding*contact%state(i)%size) lead = 0.0_wp
   end function lead_of

   !> Tell the conditions of `set`, just selected, how they rub.
   pure subroutine friction_select(self, set, n_tried)
      type(friction_t), intent(inout) :: self
      type(constraint_set_t), intent(inout) :: set
      integer, intent(in) :: n_tried             !! number of the set among those tried
      logical :: sticks(set%n)
      integer :: k

      if (.not. self%is_on) return
      self%tried(:, n_tried) = self%way
      sticks = .false.
      do k = set%n_permanent + 1, set%n
         associate (item => set%item(k), id => set%id(k))
            item%rubs = self%mu(id) > 0.0_wp
            if (.not. item%rubs) cycle
            item%slip_target(1) = slip_held(self, id)
            item%response%mu_sigma(1) = self%mu(id)*friction_slides(self, id)
            sticks(k) = holds(self, id)
         end associate
      end do
      call constraints_stick(set, pack([(k, k = 1, set%n)], sticks), &
         reshape(pack(self%tau(set%id(:set%n)), sticks), [1, count(sticks)]), &
         pack(self%is_needed(set%id(:set%n)), sticks))
   end subroutine friction_select

   !> The direction in which contact `id` slides by the law: 0 where it does not.
   pure integer function friction_slides(self, id) result(way)
      type(friction_t), intent(in) :: self
      integer, intent(in) :: id                  !! from 1

      way = self%way(id)
      if (abs(way) /= 1) way = 0
   end function friction_slides

   !> The contacts that friction lets hold along the surface: those that rub and do not slide.
   pure function friction_holds(self) result(grips)
      type(friction_t), intent(in) :: self
      logical :: grips(size(self%mu))            !! (n_constraint)

      grips = self%mu > 0.0_wp .and. abs(self%way) /= 1
   end function friction_holds

   !> Does contact `id` hold its slip by itself?
   pure logical function holds(self, id)
      type(friction_t), intent(in) :: self
      integer, intent(in) :: id                  !! from 1

      holds = any(self%way(id) == [touch_sticks, touch_rests]) .and. .not. self%is_idle(id)
   end function holds

   !> The slip at which it would [L].
   pure real(wp) function slip_held(self, id)
      type(friction_t), intent(in) :: self
      integer, intent(in) :: id                  !! from 1

      slip_held = self%lead(id)
      if (self%way(id) == touch_rests) slip_held = 0.0_wp
   end function slip_held

   !> What sticks by the rows `row` of slips does so by what holds others.
   pure subroutine friction_idle(self, set, row)
      type(friction_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      integer, intent(in) :: row(:)              !! (any) of the set

      if (size(row) > 0) self%is_idle(set%id(set%condition(row))) = .true.
   end subroutine friction_idle

   !> Friction of what sticks, to start from with the next set.
   pure subroutine friction_keep(self, set)
      type(friction_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set

      if (set%n_row > set%n) self%tau(set%id(set%condition(set%n + 1:))) = set%lam(set%n + 1:)
   end subroutine friction_keep

   !> The way of contact `k` of the set, which acts and goes on to do so, from what solves the step.
   pure subroutine friction_turn(self, system, set, k, turns)
      type(friction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      integer, intent(in) :: k                   !! > set%n_held
      logical, intent(out) :: turns              !! it is another one than before
      type(touch_t) :: at
      real(wp) :: stiffness, tie
      integer :: next

      turns = .false.
      if (.not. set%item(k)%rubs) return
      stiffness = stiffness_at(system, set%item(k))
      tie = tied*largest_push(set)
      associate (id => set%id(k), item => set%item(k), lam => set%lam)
         at = touch_t(item%normal*lam(k), drag_of(item, lam(k)), 0.0_wp, item%slip(1), &
            self%lead(id), slip_rounding*item%size)
         ! Where slip is held the solution has no other, but for round-off.
         if (holds(self, id)) at%slip = slip_held(self, id)
         if (self%is_idle(id) .and. .not. self%is_needed(id)) then
            ! Others do not hold it: it does so itself before it may slide.
            turns = stiffness*(abs(at%slip - slip_held(self, id)) - at%rounding) > tie
            self%is_needed(id) = turns
            return
         end if
         next = friction_trial(self%way(id), at, self%mu(id), stiffness, tie)
         ! What pulls and is held closed all the same has no friction: it would make energy.
         if (next == touch_open) next = touch_free
         ! What turns twice would turn again and again: it sticks in between.
         if (next*self%way(id) == -1) then
            if (self%has_turned(id)) next = touch_sticks
            self%has_turned(id) = .true.
         end if
         turns = next /= self%way(id)
         self%way(id) = next
      end associate
   end subroutine friction_turn

   !> Contact `i` of a pair closes from the motion, by `gap` below the one that it will hold, and
   !> begins in the way that its slip tells.
   pure subroutine friction_close(self, system, pair, i, motion, gap, is_new)
      type(friction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: pair, i             !! number of the contact, and within it
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: gap                !! < 0 [L]
      logical, intent(in) :: is_new              !! it was no candidate
      type(touch_t) :: at

      associate (id => system%first_constraint(pair) + i, contact => system%contact(pair)%contact)
         if (.not. self%mu(id) > 0.0_wp) return
         if (is_new .and. .not. evaluation_is_equilibrium(motion%evaluation)) then
            self%lead(id) = lead_of(contact, i, motion, evaluation_displacement(motion%evaluation, &
               motion%v0, 0.0_wp))
         end if
         at%gap = min(gap, -tiny(gap))
         at%slip = contact%slip(i, motion%x, motion%u0, motion%du)
         at%lead = self%lead(id)
         self%way(id) = friction_trial(touch_open, at, self%mu(id), 1.0_wp, 0.0_wp)
         if (self%way(id) == touch_open) self%way(id) = touch_sticks
      end associate
   end subroutine friction_close

   !> The work that friction at condition `k` takes.
   pure real(wp) function friction_work(set, k) result(work)
      type(constraint_set_t), intent(in) :: set
      integer, intent(in) :: k                   !! from 1

      work = 0.0_wp
      if (set%item(k)%rubs) work = dot_product(condition_drag(set%item(k), set%lam(k)), &
         set%item(k)%slip)
   end function friction_work

   !> The friction of a condition in the plane, against its slip.
   pure real(wp) function drag_of(item, lam) result(tau)
      type(condition_t), intent(in) :: item
      real(wp), intent(in) :: lam                !! of its gap [M L/T^2]
      real(wp) :: drag(most_slips)

      drag = condition_drag(item, lam)
      tau = drag(1)
   end function drag_of

   !> How far the laws of contact and friction are missed at worst, and the largest push.
   pure subroutine friction_missed(self, system, set, missed, largest)
      type(friction_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set  !! of the step, solved
      real(wp), intent(out) :: missed, largest   !! 0 without friction [M L/T^2]
      type(touch_t) :: at
      real(wp) :: push
      integer :: k

      missed = 0.0_wp
      largest = 0.0_wp
      if (.not. self%is_on .or. set%n == set%n_permanent) return
      largest = largest_push(set)
      if (.not. largest > 0.0_wp) return
      do k = set%n_permanent + 1, set%n
         associate (item => set%item(k))
            if (.not. item%rubs) cycle
            push = set%lam(k)
            if (item%is_mean) push = condition_normal(item)*push
            at = touch_t(push, drag_of(item, set%lam(k)), set%defect(k), item%slip(1), &
               self%lead(set%id(k)), slip_rounding*item%size)
            missed = max(missed, friction_violation(at, self%mu(set%id(k)), &
               stiffness_at(system, item)))
         end associate
      end do
   end subroutine friction_missed

   !> The largest normal force of contacts.
   pure real(wp) function largest_push(set) result(largest)
      type(constraint_set_t), intent(in) :: set  !! some contact acts

      largest = maxval(abs(set%item(set%n_permanent + 1:set%n)%normal*set%lam(set%n_permanent &
         + 1:set%n)))
   end function largest_push

   !> The mean stiffness of the system at the slave node of a condition: of its unknowns, or those
   !> that it follows. Where it is held and has none, that at the next node of the condition.
   pure real(wp) function stiffness_at(system, item) result(stiffness)
      type(system_t), intent(in) :: system
      type(condition_t), intent(in) :: item
      integer :: a, k, t, n, place

      stiffness = 0.0_wp
      n = 0
      associate (numbering => system%space%numbering, n_dim => size(item%g, 1))
         do k = 1, item%n_node
            do a = n_dim*(item%node(k) - 1) + 1, n_dim*item%node(k)
               do t = numbering%start(a) + 1, numbering%start(a + 1)
                  if (numbering%column(t) == 0) cycle
                  place = csr_find(system%matrix, numbering%column(t), numbering%column(t))
                  if (place == 0 .or. .not. abs(numbering%weight(t)) > 0.5_wp) cycle
                  stiffness = stiffness + real(abs(system%matrix%value(place)), wp)
                  n = n + 1
               end do
            end do
            if (n > 0) exit
         end do
      end associate
      if (n > 0) stiffness = stiffness/n
   end function stiffness_at

end module emcon_friction
