!> Which contacts with friction stick in a step and which slide where to.
!>
!> What closes begins in the way that its slip tells, by the trial of emcon_coulomb_law; how it goes
!> on is found in emcon_contact_newton. Source: docs/theory.md, section 4.13.
module emcon_friction
   use emcon_constraint, only : condition_friction, condition_normal, condition_t, most_slips
   use emcon_constraints, only : constraint_index, constraint_set_t, constraints_stick
   use emcon_contact, only : contact_t
   use emcon_contact_law, only : contact_laws_add
   use emcon_convergence, only : round_off
   use emcon_coulomb_law, only : contact_open, contact_slides, contact_sticks, contact_trial_t, &
      coulomb_status, coulomb_t, coulomb_violation, slip_rounding, slip_status_t
   use emcon_csr, only : csr_find
   use emcon_evaluation, only : evaluation_contact_conserves, evaluation_displacement, &
      evaluation_is_equilibrium
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_numbering, only : numbering_fixes
   use emcon_system, only : system_t
   use emcon_velocity_jumps, only : velocity_jump_t
   implicit none
   private
   public :: friction_t, friction_init, friction_begin, friction_select, friction_keep, &
      friction_close, friction_turn, friction_use, friction_missed, friction_exceeded, &
      friction_find_bound, friction_holds, friction_look_back, friction_stiffness, friction_suit, &
      friction_waits

   !> So much of the friction of a contact may act on another node than its push, and a step is
   !> solved again so often at most for more.
   real(wp), parameter, public :: most_shift = 5.0e-3_wp
   integer, parameter, public :: most_lagged = 2

   !> Displacements of this part of an edge tell whether a contact slides by them: by that part of
   !> them. What is driven slides by more than its rounding, by the edge.
   real(wp), parameter :: still = 1.0e-3_wp, rounding = 64.0_wp*epsilon(1.0_wp)

   type :: friction_t
      logical :: is_on = .false. !! some contact has friction; else nothing is allocated
      logical :: looks_back = .false.            !! and slip has two components: a step that is
                                                 !! solved tells what stops or turns back
      logical :: follows = .false.               !! sets are tried, whose friction turns with slip
      logical :: stops = .false.                 !! the jump of velocities at its end is to stop it
      integer :: n_slip = 1                      !! n_dim - 1
      !> (n_constraint) Coulomb's law of each, with mu = 0 where there is none: how what acts holds
      type(coulomb_t), allocatable :: law(:)
      real(wp), allocatable :: mu(:)             !! (n_constraint) of these, where slip is possible
      !> (n_slip, n_constraint) friction to start from, and at the end of the step before
      real(wp), allocatable :: tau(:, :), tau0(:, :)
      !> (n_slip, n_constraint) of slip, where it slid then, of length 1; else 0
      real(wp), allocatable :: direction0(:, :)
      logical, allocatable :: knows_limit(:)     !! (n_constraint) of mu: see emcon_friction_limit
      logical, allocatable :: knows_corners(:)   !! (n_contact) as emcon_interlock_plane tells
      logical :: lags = .false.                  !! it acts where slip was expected, not where it is
      integer :: n_lagged = 0                    !! so often the step was solved again for that
   end type friction_t

contains

   !> Set up for the contacts of `system`.
   subroutine friction_init(self, system)
      type(friction_t), intent(out) :: self
      type(system_t), intent(in) :: system
      type(coulomb_t) :: law(size(system%contact))
      integer :: i, n

      do i = 1, size(system%contact)
         if (.not. allocated(system%contact(i)%contact)) cycle    ! of a layer, given with the step
         law(i) = coulomb_of(system%contact(i)%contact)
         if (allocated(law(i)%mu_of_step)) deallocate(law(i)%mu_of_step)
      end do
      self%is_on = any(law%mu > 0.0_wp)
      n = merge(system%n_constraint, 0, self%is_on)
      self%n_slip = size(system%space%is_alive, 1) - 1
      self%looks_back = self%is_on .and. self%n_slip > 1
      allocate(self%law(n))
      allocate(self%tau(self%n_slip, n), self%tau0(self%n_slip, n), &
         self%direction0(self%n_slip, n), source=0.0_wp)
      allocate(self%knows_limit(n), source=.false.)
      allocate(self%knows_corners(size(system%contact)), source=.false.)
      if (.not. self%is_on) return
      do i = 1, size(system%contact)
         self%law(system%first_constraint(i) + 1:system%first_constraint(i + 1)) = law(i)
      end do
      self%mu = self%law%mu
   end subroutine friction_init

   !> A step of the deck begins: laws of contacts whose coefficients change have those of the step.
   pure subroutine friction_suit(self, system)
      type(friction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(coulomb_t) :: law
      integer :: i

      if (.not. self%is_on) return
      do i = 1, size(system%contact)
         law = coulomb_of(system%contact(i)%contact)
         if (.not. allocated(law%mu_of_step)) cycle
         associate (first => system%first_constraint(i) + 1, last => system%first_constraint(i + 1))
            self%mu(first:last) = law%mu
            self%knows_limit(first:last) = .false.
         end associate
      end do
   end subroutine friction_suit

   !> Coulomb's law of a contact; without friction that with mu = 0.
   pure type(coulomb_t) function coulomb_of(contact) result(coulomb)
      class(contact_t), intent(in) :: contact
      integer :: i

      if (.not. allocated(contact%laws%beside)) return
      do i = 1, size(contact%laws%beside)
         select type (law => contact%laws%beside(i)%law)
         type is (coulomb_t)
            coulomb = law
         end select
      end do
   end function coulomb_of

   !> The step begins, or begins again, with stencils chosen: ways and friction of the step before,
   !> and slips counted from those with which velocities along the surface end, or that part of them
   !> which a restitution does not give back.
   pure subroutine friction_begin(self, system, motion, was_active)
      type(friction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(in) :: was_active(:)       !! (n_constraint)
      integer :: i

      if (.not. self%is_on) return
      do i = 1, size(self%law)
         self%law(i)%status = slip_status_t()
         self%law(i)%slip_target = 0.0_wp
         self%law(i)%slip_to_stop = 0.0_wp
         if (.not. any(abs(self%direction0(:, i)) > 0.0_wp)) cycle
         self%law(i)%status%kind = contact_slides
         self%law(i)%status%direction(:self%n_slip) = self%direction0(:, i)
      end do
      self%tau = self%tau0
      self%n_lagged = 0
      self%stops = .false.
      self%law%mu = self%mu
      call leave_still(self, system, motion)
      if (.not. evaluation_is_equilibrium(motion%evaluation) .and. .not. self%n_slip > 1) then
         call find_targets(self, system, motion, was_active)
      end if
   end subroutine friction_begin

   !> The slips of what acted, as `friction_begin` has it.
   pure subroutine find_targets(self, system, motion, was_active)
      type(friction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(in) :: was_active(:)
      real(wp) :: du(size(motion%du, 1), size(motion%du, 2))
      integer :: i, id, pair

      du = evaluation_displacement(motion%evaluation, motion%v0, 0.0_wp)
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact)
            do i = 1, contact%n_constraint
               id = system%first_constraint(pair) + i
               if (.not. was_active(id)) cycle
               if (self%law(id)%mu > 0.0_wp) call self%law(id)%leads_to(contact%slip(i, motion%x, &
                  motion%u0, du), slip_rounding*contact%state(i)%size)
            end do
         end associate
      end do
   end subroutine find_targets

   !> Where slip has a direction, what acts is led to no slip before the step is solved: friction is
   !> to be against the slip of the whole step, not that of its end. Those that a solved step stops
   !> or turns back are, and it is to be solved again; but of nodes of rigid bodies, whose slips
   !> over a step disagree by the square of its turn, by the jump of velocities that ends the step.
   subroutine friction_look_back(self, system, set, motion, is_early, leads)
      type(friction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set  !! of the step, solved
      type(motion_t), intent(in) :: motion
      !> The step is not solved to the end yet: whether jumps stop anything is told later
      logical, intent(in) :: is_early
      logical, intent(out) :: leads              !! it is to be solved again
      real(wp) :: du(size(motion%du, 1), size(motion%du, 2)), to_stop(most_slips)
      logical :: is_bound(size(motion%du, 2)), takes_jumps, by_jump
      integer :: i, k, pair

      leads = .false.
      if (evaluation_is_equilibrium(motion%evaluation)) return
      takes_jumps = evaluation_contact_conserves(motion%evaluation)
      call friction_find_bound(system, set, is_bound)
      du = evaluation_displacement(motion%evaluation, motion%v0, 0.0_wp)
      do k = set%n_permanent + 1, set%n
         call constraint_index(system, set%id(k), pair, i)
         associate (contact => system%contact(pair)%contact, law => self%law(set%id(k)), &
               slip => set%item(k)%slip)
            if (.not. law%mu > 0.0_wp .or. any(abs(law%slip_to_stop) > 0.0_wp)) cycle
            by_jump = takes_jumps .and. all(is_bound(set%item(k)%node(:set%item(k)%n_node)))
            if (by_jump .and. is_early) cycle
            to_stop = 0.0_wp
            to_stop(:self%n_slip) = contact%slip(i, motion%x, motion%u0, du)
            ! Of what sticks slip is round-off.
            if (.not. law%holds_slip() .and. dot_product(slip - to_stop, slip) > 0.0_wp) cycle
            call law%leads_to(to_stop(:self%n_slip), slip_rounding*contact%state(i)%size)
            if (.not. any(abs(law%slip_target) > 0.0_wp)) cycle
            if (by_jump) law%slip_target = 0.0_wp
            self%stops = self%stops .or. by_jump
            leads = leads .or. .not. by_jump
         end associate
      end do
   end subroutine friction_look_back

   !> Nodes that permanent conditions bind, as those of rigid bodies do their frames, nodes that
   !> follow from these alone, and nodes that are held in all directions.
   pure subroutine friction_find_bound(system, set, is_bound)
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set  !! selected
      logical, intent(out) :: is_bound(:)        !! (n_node)
      logical :: binds(0:system%space%numbering%n_unknown)   ! (0: what is prescribed)
      integer :: i, k, n_dim

      associate (numbering => system%space%numbering)
         n_dim = size(numbering%unknown, 1)
         binds = .false.
         binds(0) = .true.
         do k = 1, set%n_permanent
            associate (node => set%item(k)%node(:set%item(k)%n_node))
               binds(pack(numbering%unknown(:, node), numbering%unknown(:, node) > 0)) = .true.
            end associate
         end do
         do i = 1, size(is_bound)
            is_bound(i) = all(binds(numbering%column(numbering%start(n_dim*(i - 1) + 1) + 1: &
               numbering%start(n_dim*i + 1))))
         end do
      end associate
   end subroutine friction_find_bound

   !> Contacts whose slave node is held in some direction, and which nothing that is free to move
   !> makes slide, as on a line of symmetry, do not rub: any friction would satisfy the law there,
   !> and none is what two halves leave each other. What is driven along a surface does.
   pure subroutine leave_still(self, system, motion)
      type(friction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(motion_t), intent(in) :: motion       !! the guess, with what is prescribed
      real(wp), dimension(size(motion%du, 1), size(motion%du, 2)) :: free, driven, own
      logical :: holds(size(motion%du, 1), size(motion%du, 2))
      integer :: pair, i, a

      do i = 1, size(holds, 2)
         holds(:, i) = [(numbering_fixes(system%space%numbering, a, i), a = 1, size(holds, 1))]
         ! Unlike ones: what moves all together slides nowhere.
         free(:, i) = merge(0.0_wp, still*(0.5_wp + modulo(0.618_wp*i, 1.0_wp)), holds(:, i))
      end do
      if (.not. any(holds)) return
      driven = merge(motion%du, 0.0_wp, holds)
      own = 0.0_wp
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact, &
               before => system%first_constraint(pair))
            do i = 1, contact%n_constraint
               associate (node => contact%node(i), size => contact%state(i)%size)
                  if (.not. (self%mu(before + i) > 0.0_wp .and. any(holds(:, node)))) cycle
                  own(:, node) = size
                  if (slides_by(contact, i, motion, own, still*still*size)) then
                     if (.not. (slides_by(contact, i, motion, size*free, still*still*size) &
                        .or. slides_by(contact, i, motion, driven, rounding*size))) then
                        self%law(before + i)%mu = 0.0_wp
                     end if
                  end if
                  own(:, node) = 0.0_wp
               end associate
            end do
         end associate
      end do
   end subroutine leave_still

   !> Does a displacement make the `i`-th constraint of `contact` slide?
   pure logical function slides_by(contact, i, motion, du, least) result(slides)
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i
      type(motion_t), intent(in) :: motion
      real(wp), intent(in), contiguous :: du(:, :)     !! (n_dim, n_node) [L]
      real(wp), intent(in) :: least              !! slip that counts [L]

      slides = norm2(contact%slip(i, motion%x, motion%u0, du)) > least
   end function slides_by

   !> Give the conditions of `set`, just selected, their laws, and what sticks rows of its slips.
   pure subroutine friction_select(self, set)
      type(friction_t), intent(inout) :: self
      type(constraint_set_t), intent(inout) :: set
      logical :: sticks(set%n)
      integer :: k

      if (.not. self%is_on) return
      sticks = .false.
      do k = set%n_permanent + 1, set%n
         associate (item => set%item(k), law => self%law(set%id(k)))
            if (.not. law%mu > 0.0_wp) cycle
            item%has_friction = .true.
            item%slip_target = law%slip_held()
            law%turns = self%follows
            call contact_laws_add(set%law(k), law)
            sticks(k) = law%holds_slip()
         end associate
      end do
      associate (stuck => pack([(k, k = 1, set%n)], sticks))
         call constraints_stick(set, stuck, self%tau(:, set%id(stuck)))
      end associate
   end subroutine friction_select

   !> The contacts that friction lets hold along the surface: those that rub and do not slide.
   pure function friction_holds(self) result(grips)
      type(friction_t), intent(in) :: self
      logical :: grips(size(self%law))           !! (n_constraint)

      grips = self%law%mu > 0.0_wp .and. self%law%status%kind /= contact_slides
   end function friction_holds

   !> Friction of what sticks, to start from with the next set, and the ways that slip has taken.
   pure subroutine friction_keep(self, set)
      type(friction_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      integer :: k

      do k = set%n + 1, set%n_row
         self%tau(set%slip(k), set%id(set%condition(k))) = set%lam(k)
      end do
      if (.not. self%looks_back) return
      do k = set%n_permanent + 1, set%n
         associate (law => self%law(set%id(k)), drag => set%item(k)%response%mu_sigma)
            if (law%status%kind == contact_slides .and. any(abs(drag) > 0.0_wp)) then
               law%status%direction = drag/norm2(drag)
            end if
         end associate
      end do
   end subroutine friction_keep

   !> Contact `i` of a pair closes from the motion, by `gap` below the one that it will hold, and
   !> begins in the way that its slip tells.
   pure subroutine friction_close(self, system, pair, i, motion, gap, is_new)
      type(friction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: pair, i             !! number of the contact, and within it
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: gap                !! < 0 [L]
      logical, intent(in) :: is_new              !! it was no candidate
      type(contact_trial_t) :: at

      associate (law => self%law(system%first_constraint(pair) + i), &
            contact => system%contact(pair)%contact)
         if (.not. law%mu > 0.0_wp) return
         if (is_new .and. .not. (evaluation_is_equilibrium(motion%evaluation) &
            .or. self%n_slip > 1)) then
            call law%leads_to(contact%slip(i, motion%x, motion%u0, evaluation_displacement( &
               motion%evaluation, motion%v0, 0.0_wp)), slip_rounding*contact%state(i)%size)
         end if
         at%gap = min(gap, -tiny(gap))
         at%slip(:self%n_slip) = contact%slip(i, motion%x, motion%u0, motion%du)
         at%slip_target = law%slip_target
         law%status = coulomb_status(at, law%mu, 1.0_wp)
         if (law%status%kind == contact_open) law%status%kind = contact_sticks
      end associate
   end subroutine friction_close

   !> The way of contact `k` of the set, which acts and goes on to do so, by the trial that what
   !> solves the step makes, with the mean stiffness of the system at its slave nodes unless one is
   !> given.
   pure subroutine friction_turn(self, system, set, k, turns, stiffness)
      type(friction_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      integer, intent(in) :: k                   !! > n_permanent
      logical, intent(inout) :: turns            !! becomes true if it is another one than before
      real(wp), intent(in), optional :: stiffness          !! > 0 [M/T^2]
      type(contact_trial_t) :: at
      type(slip_status_t) :: next
      real(wp) :: c

      associate (item => set%item(k), law => self%law(set%id(k)))
         if (.not. law%mu > 0.0_wp) return
         at = contact_trial_t(item%normal*set%lam(k), 0.0_wp, condition_friction(item, &
            set%lam(k)), item%slip, law%slip_target, slip_rounding*item%size)
         ! Where slip is held the solution has no other, but for round-off.
         if (law%holds_slip()) at%slip = law%slip_held()
         if (present(stiffness)) then
            c = stiffness
         else
            c = friction_stiffness(system, item)
         end if
         next = coulomb_status(at, law%mu, c)
         ! What nothing pushes goes on as it was.
         if (next%kind == contact_open) return
         turns = turns .or. next%kind /= law%status%kind .or. &
            dot_product(next%direction, law%status%direction) < 0.0_wp
         law%status = next
      end associate
   end subroutine friction_turn

   !> Is friction left where it was expected to act although it lags? Where slip has a direction it
   !> follows the motion of a set that stands alone: others depend on what was tried before.
   pure logical function friction_waits(self, stands) result(waits)
      type(friction_t), intent(in) :: self
      logical, intent(in) :: stands              !! the set, but for that

      waits = self%looks_back .and. .not. stands
   end function friction_waits

   !> Friction of a contact of a set, and how much it is over what its push allows.
   pure subroutine friction_use(self, set, k, tau, used)
      type(friction_t), intent(in) :: self
      type(constraint_set_t), intent(in) :: set
      integer, intent(in) :: k                   !! > n_permanent
      real(wp), intent(out) :: tau(:)            !! (n_slip) [M L/T^2]
      real(wp), intent(out) :: used              !! above 1: it slides
      real(wp) :: all(most_slips), most

      all = condition_friction(set%item(k), set%lam(k))
      tau = all(:size(tau))
      most = self%law(set%id(k))%mu*max(set%item(k)%normal*set%lam(k), 0.0_wp)
      used = norm2(tau)/max(most, epsilon(most)*norm2(tau), tiny(most))
   end subroutine friction_use

   !> How far the laws of contact and friction are missed at worst, and the largest push.
   pure subroutine friction_missed(self, system, set, missed, largest)
      type(friction_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set  !! of the step, solved
      real(wp), intent(out) :: missed, largest   !! 0 without friction [M L/T^2]
      type(contact_trial_t) :: at
      real(wp) :: push
      integer :: k

      missed = 0.0_wp
      largest = 0.0_wp
      if (.not. self%is_on .or. set%n == set%n_permanent) return
      largest = largest_push(set)
      if (.not. largest > 0.0_wp) return
      do k = set%n_permanent + 1, set%n
         associate (item => set%item(k), law => self%law(set%id(k)))
            if (.not. law%mu > 0.0_wp) cycle
            push = set%lam(k)
            if (item%is_mean) push = condition_normal(item)*push
            at = contact_trial_t(push, set%defect(k), condition_friction(item, set%lam(k)), &
               item%slip, law%slip_target, slip_rounding*item%size)
            missed = max(missed, coulomb_violation(at, law%mu, friction_stiffness(system, item)))
         end associate
      end do
      ! Where nothing is loaded all forces are round-off.
      if (missed <= round_off*maxval(system%response%rounding)) missed = 0.0_wp
   end subroutine friction_missed

   !> How far Coulomb's cone is missed where velocities jump at the end of a step: by means over the
   !> step and the jump, of friction over what pushes allow, or of what pulls [M L/T^2]. What gives
   !> back the energy of balances without mass is left out: it is no force of single contacts.
   pure real(wp) function friction_exceeded(self, set, h, jump) result(exceeded)
      type(friction_t), intent(in) :: self
      type(constraint_set_t), intent(in) :: set  !! of the step, solved
      real(wp), intent(in) :: h                  !! of the step, > 0 [T]
      type(velocity_jump_t), intent(in) :: jump(:)   !! (any)

      exceeded = 0.0_wp
      if (self%is_on .and. size(jump) > 0) exceeded = exceeded_by_jumps(self, set, h, jump)
   end function friction_exceeded

   !> The same of some jumps.
   pure real(wp) function exceeded_by_jumps(self, set, h, jump) result(exceeded)
      type(friction_t), intent(in) :: self
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in) :: h
      type(velocity_jump_t), intent(in) :: jump(:)
      real(wp) :: force(0:self%n_slip, set%n), push
      integer :: k, place(size(self%law))

      exceeded = 0.0_wp
      place = 0
      do k = set%n_permanent + 1, set%n
         associate (item => set%item(k), all => condition_friction(set%item(k), set%lam(k)))
            force(0, k) = set%lam(k)
            force(1:, k) = all(:self%n_slip)
            if (item%has_friction) place(set%id(k)) = k
         end associate
      end do
      do k = 1, size(jump)
         associate (own => place(jump(k)%id))
            if (own == 0 .or. jump(k)%is_condensed) cycle
            force(0, own) = force(0, own) + jump(k)%lam/h
            force(1:, own) = force(1:, own) + jump(k)%drag(:self%n_slip)/h
         end associate
      end do
      do k = set%n_permanent + 1, set%n
         if (.not. set%item(k)%has_friction) cycle
         push = set%item(k)%normal*force(0, k)
         exceeded = max(exceeded, -push, norm2(force(1:, k)) - self%law(set%id(k))%mu*max(0.0_wp, &
            push))
      end do
   end function exceeded_by_jumps

   !> The largest normal force of contacts.
   pure real(wp) function largest_push(set) result(largest)
      type(constraint_set_t), intent(in) :: set  !! some contact acts

      largest = maxval(abs(set%item(set%n_permanent + 1:set%n)%normal*set%lam(set%n_permanent &
         + 1:set%n)))
   end function largest_push

   !> The mean stiffness of the system at the slave nodes of a condition, each as the gap goes by
   !> it: of their unknowns, or those that they follow. Where they are held and have none, that at
   !> its other nodes. The order of the nodes, which the mesh gives, does not matter.
   pure real(wp) function friction_stiffness(system, item) result(stiffness)
      type(system_t), intent(in) :: system
      type(condition_t), intent(in) :: item

      stiffness = mean_stiffness(system, item, 1, item%n_slave)
      if (.not. stiffness > 0) stiffness = mean_stiffness(system, item, item%n_slave + 1, &
         item%n_node)
   end function friction_stiffness

   !> The mean of the diagonal entries at the unknowns of the nodes `first` to `last` of a
   !> condition, weighted by the squares of its gradient; 0 where they have none.
   pure real(wp) function mean_stiffness(system, item, first, last) result(mean)
      type(system_t), intent(in) :: system
      type(condition_t), intent(in) :: item      !! evaluated
      integer, intent(in) :: first, last
      real(wp) :: weight, total
      integer :: a, k, t, place

      mean = 0.0_wp
      total = 0.0_wp
      associate (numbering => system%space%numbering, n_dim => size(item%g, 1))
         do k = first, last
            weight = sum(item%g(:, k)**2)
            do a = n_dim*(item%node(k) - 1) + 1, n_dim*item%node(k)
               do t = numbering%start(a) + 1, numbering%start(a + 1)
                  if (numbering%column(t) == 0) cycle
                  place = csr_find(system%matrix, numbering%column(t), numbering%column(t))
                  if (place == 0 .or. .not. abs(numbering%weight(t)) > 0.5_wp) cycle
                  mean = mean + weight*real(abs(system%matrix%value(place)), wp)
                  total = total + weight
               end do
            end do
         end do
      end associate
      if (total > 0.0_wp) mean = mean/total
   end function mean_stiffness

end module emcon_friction
