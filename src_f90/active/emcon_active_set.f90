!> The constraints that act in a step: how the set begins, and what it hands to the constraints.
!> Which they are in the end: emcon_contact_rounds.
module emcon_active_set
   use emcon_constraints, only : constraint_index, constraint_set_t, constraints_select
   use emcon_contact, only : gap_state_t
   use emcon_contact_support, only : contact_support_complete, contact_support_forget, &
      contact_support_t
   use emcon_near_laws, only : near_laws_are_none, near_laws_select, near_laws_t, near_laws_update
   use emcon_evaluation, only : evaluation_is_equilibrium
   use emcon_friction, only : friction_begin, friction_holds, friction_init, friction_select, &
      friction_t
   use emcon_gaps, only : gaps_forget, pair_measure, pair_search
   use emcon_kinds, only : wp
   use emcon_motion, only : at_rest, motion_t
   use emcon_motion_bound, only : largest_motion, motion_bound_t, motion_bound_add
   use emcon_overlap_query, only : overlap_names, overlap_t
   use emcon_phases, only : phase_enter, phase_gaps, phase_leave
   use emcon_penalty, only : penalty_forget, penalty_owes, penalty_select, penalty_state_t
   use emcon_scene, only : scene_t
   use emcon_state, only : contact_state_t, state_t
   use emcon_steps, only : most_stand_off, step_is_dynamic, step_t
   use emcon_system, only : system_t
   implicit none
   private
   public :: active_set_t, active_set_init, active_set_suit, active_set_overclosure, &
      active_set_begin, active_set_restart, active_set_select, active_set_update_gaps
   public :: active_set_pass, active_set_note_stale, active_set_brought, active_set_complete
   public :: active_set_may_turn, active_set_mixes, active_set_open_sets, active_set_repeats, &
      active_set_take, active_set_is_empty, &
      active_set_slides, active_set_could_hold, active_set_goes_on, active_set_mark
   public :: candidates_t, candidates_clear, touch_tol
   public :: step_done, step_refused, step_diverged, step_singular, step_cycling, step_too_far, &
      step_stands_off, step_not_held, step_overlaps, step_unbalanced, step_rough, step_strikes, &
      step_passes_event, step_loose

   !> How a step ended; the first four are those of Newton's method, whose fifth does not end one.
   integer, parameter :: step_done = 0, step_refused = 1, step_diverged = 2, step_singular = 3, &
      step_cycling = 5, step_too_far = 6, step_stands_off = 7, step_not_held = 8, &
      step_overlaps = 9, step_unbalanced = 10, step_rough = 11, step_strikes = 12, &
      step_passes_event = 13, step_loose = 14

   !> A gap closed by more than this fraction of an edge is a penetration.
   real(wp), parameter :: touch_tol = sqrt(epsilon(1.0_wp))

   !> A step is solved again so often at most because stencils were chosen for another motion.
   integer, parameter :: most_stale = 3

   !> Until when a contact whose surfaces are far apart need not be looked at.
   type :: skip_until_t
      real(wp) :: at = 0.0_wp                    !! `travel%total` as the step looked at began [L]
      real(wp) :: apart = 0.0_wp                 !! how far the surfaces were from each other [L]
      real(wp) :: reach = 0.0_wp                 !! and how near something would have counted [L]
      integer :: n_look = 0                      !! of the contact; another one: look again
      logical :: passes = .false.                !! nothing comes near: see `active_set_pass`
   end type skip_until_t

   !> Who takes part in a step.
   type :: candidates_t
      logical, allocatable :: takes_part(:)      !! (n_constraint)
      logical, allocatable :: acts(:)            !! (n_constraint) of these, in the next set,
      logical, allocatable :: acted(:)           !! (n_constraint) in that of the last solve,
      logical, allocatable :: began(:)           !! (n_constraint) and in the first one
      logical, allocatable :: has_left(:)        !! (n_constraint) it lost its surface,
      logical, allocatable :: is_back(:)         !! (n_constraint) and has come back
      integer, allocatable :: n_change(:)        !! (n_constraint) tries in which it begins to
                                                 !! act, no longer acts or slides another way
      logical, allocatable :: is_blamed(:)       !! (n_constraint) the step cannot stand on it
      logical :: is_measured = .false.           !! gaps are known for the motion that there is
      logical :: have_changed = .false.          !! solve the step again
      logical :: is_settled = .false.            !! the step is solved, or cannot be
      logical :: one_closes = .false.            !! that does not act
      logical :: is_new_set = .false.            !! others act than in the set before
      logical :: are_together = .false.          !! all are solved for at once, not a set of them
   end type candidates_t

   !> What the step of the deck asks of contact.
   type :: contact_rules_t
      logical :: holds_gap = .true.              !! persistent: hold the gap of the step's start,
      logical, allocatable :: closes(:)          !! (n_constraint) but here: its node has no mass
      logical :: has_impacts = .true.            !! what closes arrives with a velocity
      logical :: pushes_out = .false.            !! also what is closed too far, which makes energy
      logical :: puts_off = .false.              !! what follows from others nearly waits
      logical :: may_cut = .true.                !! the step may be tried in smaller parts
      real(wp) :: largest_move = huge(1.0_wp)    !! of a correction in statics [L]
      real(wp) :: gap_tolerance = 0.0_wp         !! largest new stand-off per edge; 0: any
   end type contact_rules_t

   !> How contact was at the end of the step before.
   type :: contact_start_t
      logical, allocatable :: was_active(:)      !! (n_constraint) what acted
      real(wp), allocatable :: lam0(:)           !! (n_constraint) with which multipliers
      !> (n_constraint) gap at the start of a step that resolves overclosure where it is closed,
      !> else 0; and the parts of it that are left at the start and the end of the increment.
      real(wp), allocatable :: overclosure(:)
      real(wp) :: left(0:1) = 0.0_wp
   end type contact_start_t

   !> Motions that sets of a step begin with.
   type :: contact_guess_t
      real(wp), allocatable :: first(:, :)       !! (n_dim, n_node) first guess of the step,
      real(wp), allocatable :: driven(:, :)      !! (n_dim, n_node) the prescribed motion in it,
      real(wp), allocatable :: before(:, :)      !! (n_dim, n_node) and that of the present set
   end type contact_guess_t

   type :: active_set_t
      type(contact_rules_t) :: rules
      type(contact_start_t) :: start
      type(contact_guess_t) :: guess
      type(constraint_set_t) :: set
      logical, allocatable :: is_active(:)       !! (n_constraint)
      real(wp), allocatable :: lam(:)            !! (n_constraint) multipliers to start from
      integer :: n_newton = 0                    !! iterations in the last step
      logical :: is_stale = .false.              !! stencils were chosen for another motion
      integer :: n_stale = 0                     !! so often in this step
      logical, allocatable :: is_candidate(:)    !! (n_constraint) acted at the start of the step,
                                                 !! or has closed in it
      type(candidates_t) :: candidates           !! of emcon_contact_rounds
      logical, allocatable :: is_left_out(:)     !! (n_constraint) cannot act in this step
      type(friction_t) :: friction               !! what sticks, what slides
      type(penalty_state_t) :: penalty           !! how stiff contacts are that give way
      type(near_laws_t) :: near_laws             !! what laws act on that is near
      type(contact_support_t) :: support         !! bodies that contact alone holds, in statics
      type(motion_bound_t) :: motion_bound       !! of all nodes, over the steps
      type(skip_until_t), allocatable :: skip_until(:) !! (n_contact)
   end type active_set_t

contains

   !> What `step` of the deck asks of contact, but for the gaps that it holds.
   pure subroutine active_set_suit(self, step)
      type(active_set_t), intent(inout) :: self
      type(step_t), intent(in) :: step

      self%rules%has_impacts = step_is_dynamic(step)
      self%rules%pushes_out = .not. self%rules%has_impacts
      self%rules%gap_tolerance = step%contact%gap_tolerance
   end subroutine active_set_suit

   !> Set up for the constraints of `system`.
   subroutine active_set_init(self, system)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      if (allocated(self%is_active)) deallocate(self%is_active, self%lam, self%is_left_out, &
         self%start%overclosure, self%rules%closes, self%skip_until, self%is_candidate)
      allocate(self%rules%closes(system%n_constraint), source=.false.)
      allocate(self%skip_until(size(system%contact)))
      allocate(self%start%overclosure(system%n_constraint), source=0.0_wp)
      allocate(self%is_active(system%n_constraint), source=.false.)
      allocate(self%is_candidate(system%n_constraint), source=.false.)
      allocate(self%is_left_out(system%n_constraint), source=.false.)
      self%candidates = candidates_t()
      associate (own => self%candidates, n => system%n_constraint)
         allocate(own%takes_part(n), own%acts(n), own%acted(n), own%began(n), own%has_left(n), &
            own%is_back(n), own%is_blamed(n), source=.false.)
         allocate(own%n_change(n), source=0)
      end associate
      allocate(self%lam(system%n_constraint), source=0.0_wp)
      call constraints_select(self%set, [integer ::])
      call friction_init(self%friction, system)
   end subroutine active_set_init

   !> None takes part yet.
   pure subroutine candidates_clear(self)
      type(candidates_t), intent(inout) :: self

      self%takes_part = .false.
      self%acts = .false.
      self%acted = .false.
      self%has_left = .false.
      self%is_back = .false.
      self%is_blamed = .false.
      self%n_change = 0
      self%is_measured = .false.
      self%have_changed = .false.
      self%is_settled = .false.
      self%one_closes = .false.
      self%is_new_set = .false.
   end subroutine candidates_clear

   !> With `is_meant` the gaps at x + u that are closed are what the step resolves, else nothing.
   subroutine active_set_overclosure(self, system, x, u, is_meant)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)       !! (n_dim, n_node) [L]
      logical, intent(in) :: is_meant            !! the step resolves what is closed
      integer :: pair

      self%start%overclosure = 0.0_wp
      self%rules%largest_move = huge(1.0_wp)
      do pair = 1, size(system%contact)
         self%rules%largest_move = min(self%rules%largest_move, &
            system%contact(pair)%contact%mean_size(x))
      end do
      if (.not. is_meant) return
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact, &
               first => system%first_constraint(pair) + 1, &
               last => system%first_constraint(pair + 1))
            contact%reach = 0.0_wp
            call contact%begin_step(x, u, at_rest(u))
            call contact%measure(x, u, at_rest(u))
            where (contact%state%is_near .and. contact%state%is_over)
               self%start%overclosure(first:last) = min(0.0_wp, contact%state%gap0)
            end where
         end associate
      end do
      if (allocated(self%support%overclosure)) self%support%overclosure = self%start%overclosure
   end subroutine active_set_overclosure

   !> Begin a step from `state` with the motion that is expected: stencils, and the first set.
   subroutine active_set_begin(self, system, motion, state)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      type(state_t), intent(in) :: state
      integer :: pair, left

      call phase_enter(system%phases, phase_gaps, left)
      call motion_bound_add(self%motion_bound, motion%u0)
      self%start%was_active = state%contacts%is_active
      self%start%lam0 = state%contacts%lam
      self%penalty%closure = state%contacts%closure
      self%penalty%stretch = state%contacts%stretch
      if (self%friction%is_on) then
         self%friction%direction0 = state%contacts%slides_along
         self%friction%tau0 = state%contacts%drag
      end if
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact, &
               first => system%first_constraint(pair) + 1, &
               last => system%first_constraint(pair + 1))
            contact%step%is_watched = self%start%was_active(first:last)
            contact%step%is_sharp = .false.
            contact%step%is_static = evaluation_is_equilibrium(motion%evaluation)
            contact%step%pushes_at_end = contact%step%is_static .or. motion%evaluation%pushes_at_end
         end associate
      end do
      call active_set_restart(self, system, motion)
      call phase_leave(system%phases, left)
   end subroutine active_set_begin

   !> Stencils and the first set, as the step began.
   subroutine active_set_restart(self, system, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion

      if (size(system%contact) > 0) call gaps_forget(system)
      call begin_contact(self, system, motion)
      call friction_begin(self%friction, system, motion, self%start%was_active)
      call contact_support_forget(self%support)
      self%lam = self%start%lam0
      self%n_newton = 0
      self%n_stale = 0
      call penalty_forget(self%penalty)
      if (self%near_laws%is_on) self%near_laws%is_near = .false.
      self%is_candidate = self%start%was_active .or. self%is_active
      self%is_left_out = .false.
   end subroutine active_set_restart

   !> Choose the stencils of a contact for `motion`, and measure it over `du` if that is given.
   subroutine active_set_update_gaps(self, system, pair, motion, du)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      integer, intent(in) :: pair                !! number of the contact
      type(motion_t), intent(in) :: motion
      real(wp), intent(in), contiguous, optional :: du(:, :)   !! (n_dim, n_node) [L]

      call pair_search(system, pair, motion)
      if (present(du)) call pair_measure(system, pair, motion%x, motion%u0, du)
      associate (contact => system%contact(pair)%contact)
         self%skip_until(pair) = skip_until_t(self%motion_bound%total, contact%clearance, &
            contact%reach, contact%n_look)
      end associate
   end subroutine active_set_update_gaps

   !> Find the contacts whose surfaces `motion` cannot bring near: they are as last measured.
   pure subroutine active_set_pass(self, system, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(motion_t), intent(in) :: motion
      real(wp) :: closed
      integer :: pair

      if (size(self%skip_until) == 0) return
      closed = 2.0_wp*largest_motion(motion%du)
      do pair = 1, size(self%skip_until)
         associate (skip_until => self%skip_until(pair))
            skip_until%passes = is_empty(self, system, pair) .and. 2.0_wp*(self%motion_bound%total &
               - skip_until%at) + max(closed, skip_until%reach) < skip_until%apart
         end associate
      end do
   end subroutine active_set_pass

   !> Has nothing of this contact been near at the last look at it?
   pure logical function is_empty(self, system, pair)
      type(active_set_t), intent(in) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: pair

      associate (contact => system%contact(pair)%contact)
         is_empty = contact%clearance > 0.0_wp &
            .and. contact%n_look == self%skip_until(pair)%n_look
      end associate
   end function is_empty

   !> Choose stencils; start from the constraints that acted before and still can, also where the
   !> step is expected to end, and from those that push as it begins. What gives way and stores
   !> something acts past an end of its surface too: there it gives back.
   subroutine begin_contact(self, system, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical :: reaches                         ! in front of its surface
      integer :: pair

      self%is_active(:system%first_constraint(1)) = system%acts
      call active_set_pass(self, system, motion)
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact, &
               first => system%first_constraint(pair) + 1, &
               last => system%first_constraint(pair + 1))
            self%is_active(first:last) = .false.
            if (self%skip_until(pair)%passes .or. self%penalty%is_at_ends) cycle
            reaches = contact%step%engages > 0.0_wp
            if (.not. (reaches .or. any(self%start%was_active(first:last)))) then
               call active_set_update_gaps(self, system, pair, motion)
               cycle
            end if
            call active_set_update_gaps(self, system, pair, motion, at_rest(motion%u0))
            self%is_active(first:last) = self%start%was_active(first:last) &
               .or. (reaches .and. contact%state%gap0 < contact%step%engages)
            self%is_active(first:last) = self%is_active(first:last) &
               .and. contact%state%is_near .and. ((contact%state%is_over &
               .and. stands_at(contact%state, self%rules%gap_tolerance)) &
               .or. penalty_owes(self%penalty, first, last))
            if (.not. (contact%may_leave .and. any(self%is_active(first:last)))) cycle
            call pair_measure(system, pair, motion%x, motion%u0, motion%du)
            self%is_active(first:last) = self%is_active(first:last) &
               .and. .not. contact%state%is_leaving
         end associate
      end do
   end subroutine begin_contact

   !> Is the surface that is near now the one that it has touched? Not if it is farther off than any
   !> contact begins.
   elemental logical function stands_at(gap, tolerance)
      type(gap_state_t), intent(in) :: gap
      real(wp), intent(in) :: tolerance          !! largest new stand-off per edge; 0: any

      stands_at = .not. tolerance > 0.0_wp
      if (.not. stands_at) stands_at = gap%gap0 - max(0.0_wp, gap%closed) &
         <= max(tolerance, most_stand_off)*min(gap%size, gap%other_size)
   end function stands_at

   !> Hand the present set to the constraints, with the gaps to hold; multipliers carry over.
   subroutine active_set_select(self, system, motion, is_measured)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(in), optional :: is_measured   !! as the gaps were when last looked at
      logical :: is_known, is_kept
      integer :: k, pair, i

      if (self%set%n_condition == 0 .and. .not. self%near_laws%is_on) then
         if (.not. any(self%is_active)) return
      end if
      is_known = .false.
      if (present(is_measured)) is_known = is_measured
      if (.not. is_known) call measure_all(self, system, motion)
      if (self%near_laws%is_on) then
         call find_near(self, system)
         ! What may open in the solve itself has one law all through the step.
         self%near_laws%is_held = self%is_candidate
         call constraints_select(self%set, places_of(self%is_active), &
            places_of(self%near_laws%is_near .and. .not. self%is_active))
         call near_laws_select(self%near_laws, system, self%set)
      else
         call constraints_select(self%set, places_of(self%is_active))
      end if
      do k = 1, self%set%n
         self%set%lam(k) = self%lam(self%set%id(k))
         call constraint_index(system, self%set%id(k), pair, i)
         self%set%is_kept(k) = self%set%id(k) <= system%space%linear%n
         if (pair == 0) cycle
         self%set%is_firm(k) = .not. self%rules%puts_off
         call find_target(self, system%contact(pair)%contact%state(i), self%set%id(k), &
            self%set%target(k), self%set%is_kept(k))
      end do
      do k = self%set%n + 1, self%set%n_condition
         if (.not. self%is_candidate(self%set%id(k))) cycle
         call constraint_index(system, self%set%id(k), pair, i)
         call find_target(self, system%contact(pair)%contact%state(i), self%set%id(k), &
            self%set%target(k), is_kept)
      end do
      self%set%n_permanent = count(self%set%id(:self%set%n) <= system%first_constraint(1))
      call friction_select(self%friction, self%set)
      call penalty_select(self%penalty, system, self%set, self%rules%has_impacts .and. &
         .not. motion%evaluation%pushes_at_end)
   end subroutine active_set_select

   !> The mean gap that contact `id` holds where it acts; `is_kept` if that is the gap of the start.
   pure subroutine find_target(self, gap, id, target, is_kept)
      type(active_set_t), intent(in) :: self
      type(gap_state_t), intent(in) :: gap
      integer, intent(in) :: id                  !! number over all pairs
      real(wp), intent(out) :: target            !! [L]
      logical, intent(out) :: is_kept

      target = self%start%left(1)*self%start%overclosure(id) + gap%closed
      ! What is closed too far is never pushed out: that would make energy.
      is_kept = (self%rules%holds_gap .and. .not. self%rules%closes(id)) .or. &
         (.not. self%rules%pushes_out .and. gap%gap0 < target - touch_tol*gap%size)
      if (self%penalty%is_on .and. .not. self%penalty%augments) is_kept = .false.
      if (is_kept) target = gap%gap0
   end subroutine find_target

   !> What acts at first is that of `contacts` which has a surface near.
   pure subroutine active_set_take(self, system, contacts, is_near)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(contact_state_t), intent(in) :: contacts
      logical, intent(in) :: is_near(:)          !! (n_constraint)

      self%is_active = contacts%is_active .and. is_near
      self%is_active(:system%first_constraint(1)) = system%acts
      self%lam = contacts%lam
      self%penalty%closure = contacts%closure
      self%penalty%stretch = contacts%stretch
      self%is_candidate = self%is_active
   end subroutine active_set_take

   !> The sets of a step begin with what acts now.
   pure subroutine active_set_open_sets(self)
      type(active_set_t), intent(inout) :: self

      self%candidates%began(:) = self%is_active
      self%candidates%is_new_set = .true.
   end subroutine active_set_open_sets

   !> Is the next set that of the last solve?
   pure logical function active_set_repeats(self) result(repeats)
      type(active_set_t), intent(in) :: self

      repeats = all(self%is_active .eqv. self%candidates%acted)
   end function active_set_repeats

   !> Nothing acts, not even what always does.
   pure logical function active_set_is_empty(self) result(is_empty_set)
      type(active_set_t), intent(in) :: self

      is_empty_set = .not. any(self%is_active)
   end function active_set_is_empty

   !> Close what holds the bodies that nothing else does, where statics need that.
   subroutine active_set_complete(self, system, scene, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(motion_t), intent(inout) :: motion    !! free of what is prescribed

      if (self%friction%is_on) self%support%grips = friction_holds(self%friction)
      call contact_support_complete(self%support, system, scene, motion, self%is_active)
   end subroutine active_set_complete

   !> Does some contact that acts slide?
   pure logical function active_set_slides(self) result(slides)
      type(active_set_t), intent(in) :: self

      slides = self%friction%is_on
      if (slides) slides = any(self%is_active .and. self%friction%law%mu > 0.0_wp &
         .and. .not. friction_holds(self%friction))
   end function active_set_slides

   !> Do sets find out where to what rubs slides in a step? In space they do, in dynamics, but not
   !> beside rows that always hold: those of rigid bodies depend on each other.
   pure logical function active_set_may_turn(self, system) result(may_turn)
      type(active_set_t), intent(in) :: self
      type(system_t), intent(in) :: system

      may_turn = self%friction%is_on .and. self%friction%n_slip > 1 .and. self%rules%has_impacts &
         .and. .not. any(system%acts)
   end function active_set_may_turn

   !> Do some contacts that act slide, and others not?
   pure logical function active_set_mixes(self) result(mixes)
      type(active_set_t), intent(in) :: self

      mixes = active_set_slides(self)
      if (mixes) mixes = any(self%is_active .and. friction_holds(self%friction))
   end function active_set_mixes

   !> Could contacts hold the nodes of `overlap` that does not?
   pure logical function active_set_could_hold(self, system, overlap) result(could_hold)
      type(active_set_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(overlap_t), intent(in) :: overlap
      integer :: pair

      could_hold = .false.
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact, &
               first => system%first_constraint(pair) + 1)
            could_hold = could_hold .or. contact%could_hold( &
               .not. self%is_active(first:first + contact%n_constraint - 1) &
               .and. overlap_names(overlap, contact%node))
         end associate
      end do
   end function active_set_could_hold

   !> Mark the slave nodes of what acts, or did in `contacts`.
   pure subroutine active_set_mark(self, system, contacts, is_marked)
      type(active_set_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(contact_state_t), intent(in) :: contacts
      logical, intent(inout) :: is_marked(:)     !! (n_node)
      integer :: id, pair, i

      do id = system%first_constraint(1) + 1, system%n_constraint
         if (.not. (self%is_active(id) .or. contacts%is_active(id))) cycle
         call constraint_index(system, id, pair, i)
         is_marked(system%contact(pair)%contact%node(i)) = .true.
      end do
   end subroutine active_set_mark

   !> The largest gap over which contact that acts was brought to hold a body; 0: none.
   pure real(wp) function active_set_brought(self) result(brought)
      type(active_set_t), intent(in) :: self     !! of statics that contact is to hold

      brought = max(0.0_wp, maxval(self%support%brought, mask=self%is_active))
   end function active_set_brought

   !> Stencils were chosen for another motion, and the step is solved again: `status` is
   !> `step_too_far` where that was so too often.
   pure subroutine active_set_note_stale(self, status)
      type(active_set_t), intent(inout) :: self
      integer, intent(out) :: status             !! one of the `step_` codes

      self%n_stale = self%n_stale + 1
      status = merge(step_too_far, step_done, self%n_stale > most_stale)
   end subroutine active_set_note_stale

   !> Has each solution of the increment asked for other stencils than it was found with?
   pure logical function active_set_goes_on(self) result(goes_on)
      type(active_set_t), intent(in) :: self

      goes_on = self%n_stale > most_stale
   end function active_set_goes_on

   !> Where a list is true.
   pure function places_of(is_meant) result(place)
      logical, intent(in) :: is_meant(:)
      integer, allocatable :: place(:)
      integer :: k

      place = pack([(k, k = 1, size(is_meant))], is_meant)
   end function places_of

   !> What is near enough for laws that act there, by the gaps as they were measured.
   subroutine find_near(self, system)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      logical :: grows
      integer :: k

      grows = .false.
      do k = 1, size(system%contact)
         if (near_laws_are_none(self%near_laws, system%contact(k)%contact)) cycle
         if (.not. is_empty(self, system, k)) call near_laws_update(self%near_laws, system, k, &
            self%is_active, grows)
      end do
   end subroutine find_near

   !> Measure the gaps of all contacts that something is near.
   subroutine measure_all(self, system, motion)
      type(active_set_t), intent(in) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      integer :: pair

      do pair = 1, size(system%contact)
         if (is_empty(self, system, pair)) cycle
         call pair_measure(system, pair, motion%x, motion%u0, motion%du)
      end do
   end subroutine measure_all

end module emcon_active_set
