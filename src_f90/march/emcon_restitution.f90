!> Impacts that keep a part of their velocity: RESTITUTION below 1.
!>
!> A step that holds a gap reverses its rate. What of that is not kept is taken out by impulses
!> along normals, and along surfaces those by which friction is as the laws say for the impulses of
!> step and jump together; so are rates at which the shape of rigid bodies would change: momenta
!> stay, and the energy that goes is known.
!> Source: docs/theory.md, eqs. (22e) and (22f).
module emcon_restitution
   use emcon_constraint, only : condition_friction, condition_rate, most_slips
   use emcon_constraints, only : constraint_index
   use emcon_contact_law, only : contact_laws_rate_change
   use emcon_contact_problem, only : contact_problem_create
   use emcon_coulomb_law, only : coulomb_t
   use emcon_errors, only : error_t
   use emcon_friction, only : friction_find_bound
   use emcon_kinds, only : wp
   use emcon_march_types, only : march_t
   use emcon_mass_return, only : mass_is_at
   use emcon_rate_jump, only : rate_jump_t, velocity_update_change
   use emcon_text, only : note_add, notes_t
   use emcon_velocity_jumps, only : jumps_add, jumps_rub
   use emcon_velocity_update, only : velocity_update_hold
   implicit none
   private
   public :: restitution_take

   !> What is common to the impacts at the end of a step.
   type :: impacts_t
      real(wp) :: h                              !! of the step, > 0 [T]
      integer :: n_slip                          !! of each; 0: friction stays as it is
      real(wp), allocatable :: moved(:, :)       !! (n_dim, n_node) of velocities so far [L/T]
   end type impacts_t

contains

   !> Take out of the velocities at the end of the step what its impacts do not keep.
   subroutine restitution_take(self, h, notes, error)
      type(march_t), intent(inout) :: self
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(notes_t), intent(inout) :: notes      !! for the log
      type(error_t), allocatable, intent(out) :: error

      if (self%active%set%n == self%active%set%n_permanent .or. .not. is_asked(self)) return
      call take(self, h, notes, error)
   end subroutine restitution_take

   !> The same where contacts act and some law asks, or something stops.
   subroutine take(self, h, notes, error)
      type(march_t), intent(inout) :: self
      real(wp), intent(in) :: h
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: v(size(self%end_state%v, 1), size(self%end_state%v, 2)), lost, gained
      type(impacts_t) :: impacts
      type(rate_jump_t) :: jump
      integer :: turn
      logical :: is_done

      v = self%end_state%v
      call velocity_update_hold(self%velocity_update, self%system, self%active%set, &
         self%end_state%v, lost, gained, error)
      if (allocated(error)) return
      call book(self, lost, gained)
      impacts = impacts_t(h, self%active%friction%n_slip*merge(1, 0, self%active%friction%is_on), &
         self%end_state%v - v)
      call change_pushes(self, impacts, is_done, notes, error)
      if (allocated(error) .or. is_done .or. .not. self%active%friction%stops) return
      ! Pushes change so that no gap does; where that would make energy they stay.
      do turn = 1, 2
         call find_impacts(self, impacts, jump)
         call find_stops(self, h, turn == 2, jump)
         call velocity_update_change(self%velocity_update, self%system, self%active%set, jump, &
            self%end_state%v, error)
         if (allocated(error) .or. jump%is_done .or. jump%is_idle) exit
      end do
      if (.not. allocated(error) .and. jump%is_done) call book_jump(self, jump)
   end subroutine take

   !> Where laws change rates of gaps, by impulses along gaps and surfaces together.
   subroutine change_pushes(self, impacts, is_done, notes, error)
      type(march_t), intent(inout) :: self
      type(impacts_t), intent(in) :: impacts
      logical, intent(out) :: is_done            !! and friction stops what slides
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(out) :: error
      type(rate_jump_t) :: jump

      is_done = .false.
      call find_impacts(self, impacts, jump)
      if (.not. any(abs(jump%problem%free(0, :)) > 0.0_wp)) return
      call velocity_update_change(self%velocity_update, self%system, self%active%set, jump, &
         self%end_state%v, error)
      if (allocated(error)) return
      is_done = jump%is_done .or. jump%is_idle
      if (.not. is_done .and. impacts%n_slip > 0) then
         ! Newton's restitution and Coulomb's law make energy together. What keeps no rates makes
         ! none, nor does the step, which keeps all, nor what lies between these.
         call find_impacts(self, impacts, jump)
         call take_plastic(self, jump)
         call velocity_update_change(self%velocity_update, self%system, self%active%set, jump, &
            self%end_state%v, error)
         if (allocated(error)) return
      end if
      is_done = jump%is_done .or. jump%is_idle
      if (jump%is_done) then
         call book_jump(self, jump)
      else if (.not. jump%is_idle) then
         call note_add(notes, "contacts that close in this step rebound fully, whatever their " &
            // "RESTITUTION says: with it they would gain energy")
      end if
   end subroutine change_pushes

   !> The jump with which no contact keeps its rate, of which a part is taken: as much as a contact
   !> does not keep, by that which keeps most of those that move each other. Impulses are then
   !> between those of the step and of that jump; Coulomb's cone is convex, as kinetic energy is.
   pure subroutine take_plastic(self, jump)
      type(march_t), intent(in) :: self
      type(rate_jump_t), intent(inout) :: jump   !! as `find_impacts` leaves it
      real(wp) :: kept                           ! of a rate along the surface
      integer :: k, i, pair

      associate (set => self%active%set, problem => jump%problem)
         allocate(jump%part(size(jump%row)))
         do k = 1, size(jump%row)
            call constraint_index(self%system, set%id(jump%row(k)), pair, i)
            jump%part(k) = -contact_laws_rate_change(self%system%contact(pair)%contact%laws, 1.0_wp)
            problem%free(0, k) = jump%rate(0, k)
            if (.not. set%item(jump%row(k))%has_friction) cycle
            kept = self%active%friction%law(set%id(jump%row(k)))%restitution
            if (stops(self, jump, k) .and. jump%by_rate(k)) then
               problem%free(1:, k) = jump%rate(1:, k)
            else if (stops(self, jump, k)) then
               problem%slip_target(:, k) = jump%rate(1:, k) - jump%mean(:, k)
            else if (kept < 1.0_wp) then
               problem%slip_target(:, k) = problem%slip_target(:, k)/(1.0_wp - kept)
            end if
         end do
      end associate
   end subroutine take_plastic

   !> Energies of a jump that was taken, beside that of friction.
   pure subroutine book(self, lost, gained)
      type(march_t), intent(inout) :: self
      real(wp), intent(in) :: lost               !! >= 0 up to round-off [M L^2/T^2]
      real(wp), intent(in) :: gained             !! of kinetic energy [M L^2/T^2]

      associate (ledger => self%ledger)
         ledger%external_work = ledger%external_work + (gained + lost)
         ledger%contact_work = ledger%contact_work - lost
         ledger%restitution = ledger%restitution + max(0.0_wp, lost)
      end associate
   end subroutine book

   !> A jump that was taken.
   pure subroutine book_jump(self, jump)
      type(march_t), intent(inout) :: self
      type(rate_jump_t), intent(in) :: jump

      call book(self, jump%lost, jump%gained + sum(jump%rubbed))
      call book_impulses(self, jump)
   end subroutine book_jump

   !> The impulses of a jump that was taken, and what friction takes by them.
   pure subroutine book_impulses(self, jump)
      type(march_t), intent(inout) :: self
      type(rate_jump_t), intent(in) :: jump
      real(wp) :: impulse(0:jump%problem%n_slip, self%active%set%n), rubbed(self%active%set%n)

      self%ledger%friction = self%ledger%friction + sum(jump%rubbed)
      impulse = 0.0_wp
      rubbed = 0.0_wp
      impulse(:, jump%row) = jump%impulse
      rubbed(jump%row) = jump%rubbed
      call jumps_add(self%end_state%jump, self%active%set, impulse(0, :))
      call jumps_rub(self%end_state%jump, self%active%set, impulse(1:, :), rubbed)
   end subroutine book_impulses

   !> Has some pair a law that changes rates, or stops something?
   pure logical function is_asked(self)
      type(march_t), intent(in) :: self
      integer :: k

      is_asked = self%active%friction%stops
      do k = 1, size(self%system%contact)
         associate (laws => self%system%contact(k)%contact%laws)
            is_asked = is_asked .or. abs(contact_laws_rate_change(laws, 1.0_wp)) > 0.0_wp
         end associate
      end do
   end function is_asked

   !> The contacts that an impact has to do with, what they have done in the step, and what laws
   !> make of them: a gap keeps a part of its rate, or opens faster where nothing is left to push.
   pure subroutine find_impacts(self, impacts, jump)
      type(march_t), intent(in) :: self
      type(impacts_t), intent(in) :: impacts
      type(rate_jump_t), intent(out) :: jump
      logical :: is_bound(size(self%end_state%v, 2))
      integer :: k, id, i, pair

      associate (set => self%active%set)
         jump%row = pack([(k, k = 1, set%n)], has_impact(self))
         call contact_problem_create(jump%problem, impacts%n_slip, size(jump%row))
         allocate(jump%rate(0:impacts%n_slip, size(jump%row)), jump%taken(size(jump%row)), &
            jump%mean(impacts%n_slip, size(jump%row)), source=0.0_wp)
         allocate(jump%by_rate(size(jump%row)), source=.false.)
         if (impacts%n_slip > 1) call friction_find_bound(self%system, set, is_bound)
         do k = 1, size(jump%row)
            id = set%id(jump%row(k))
            associate (item => set%item(jump%row(k)))
               if (impacts%n_slip > 1) jump%by_rate(k) = all(is_bound(item%node(:item%n_node)))
            end associate
            call constraint_index(self%system, id, pair, i)
            jump%rate(0, k) = condition_rate(set%item(jump%row(k)), self%end_state%v)
            jump%problem%free(0, k) = -contact_laws_rate_change( &
               self%system%contact(pair)%contact%laws, jump%rate(0, k))
            jump%problem%base(0, k) = impacts%h*set%lam(jump%row(k)) &
               + sum(pack(self%end_state%jump%lam, self%end_state%jump%id == id))
            if (impacts%n_slip > 0 .and. set%item(jump%row(k))%has_friction) call find_rubbing( &
               self, impacts, jump, k)
         end do
      end associate
   end subroutine find_impacts

   !> The same along the surface, for place `k` of the jump. Slips are by half of the size of the
   !> step: twice their mean rates, so that what changes a rate at the end changes them by as much.
   !> In space what stops or sticks on rigid bodies does so by its rate at the end, as in a stop
   !> without impact: slips of a rigid body over a step disagree by the square of its turn, rates do
   !> not. That of elastic bodies is led there, so that friction takes energy at each node.
   pure subroutine find_rubbing(self, impacts, jump, k)
      type(march_t), intent(in) :: self
      type(impacts_t), intent(in) :: impacts
      type(rate_jump_t), intent(inout) :: jump
      integer, intent(in) :: k
      real(wp) :: tau(most_slips)
      integer :: s

      associate (item => self%active%set%item(jump%row(k)), problem => jump%problem, &
            law => self%active%friction%law(self%active%set%id(jump%row(k))))
         tau = condition_friction(item, self%active%set%lam(jump%row(k)))
         jump%taken(k) = dot_product(tau, item%slip)
         problem%mu(k) = law%mu*item%normal
         do s = 1, problem%n_slip
            jump%rate(s, k) = condition_rate(item, self%end_state%v, s)
            problem%base(s, k) = impacts%h*tau(s)
            problem%free(s, k) = condition_rate(item, impacts%moved, s) &
               - 2.0_wp/impacts%h*item%slip(s)
            problem%slip_target(s, k) = 2.0_wp/impacts%h*law%slip_to_stop(s)
         end do
         jump%mean(:, k) = problem%free(1:, k)
         if (.not. stops(self, jump, k)) return
         if (jump%by_rate(k)) then
            problem%free(1:, k) = (1.0_wp - law%restitution)*jump%rate(1:, k)
            problem%slip_target(:, k) = 0.0_wp
         else
            problem%slip_target(:, k) = (1.0_wp - law%restitution)*jump%rate(1:, k) &
               - problem%free(1:, k)
         end if
      end associate
   end subroutine find_rubbing

   !> Does the contact at place `k` stop or stick, in space?
   pure logical function stops(self, jump, k)
      type(march_t), intent(in) :: self
      type(rate_jump_t), intent(in) :: jump
      integer, intent(in) :: k                   !! it has friction

      stops = jump%problem%n_slip > 1
      if (stops) stops = may_stop(self%active%friction%law(self%active%set%id(jump%row(k))))
   end function stops

   !> Did it stick in the step, or would that turn it back?
   pure logical function may_stop(law)
      type(coulomb_t), intent(in) :: law

      may_stop = law%holds_slip() .or. any(abs(law%slip_to_stop) > 0.0_wp)
   end function may_stop

   !> Friction stops what the step would turn back, by what pushes allow: its impulses take all of
   !> the rate along the surface, or are opposite to what is left of that. Pushes change so that
   !> rates of gaps stay, and with them the friction of all that slides on; or all of these stay.
   pure subroutine find_stops(self, h, pushes_stay, jump)
      type(march_t), intent(in) :: self
      real(wp), intent(in) :: h                  !! of the step, > 0 [T]
      logical, intent(in) :: pushes_stay         !! else they change
      type(rate_jump_t), intent(inout) :: jump
      integer :: k

      associate (problem => jump%problem, n => size(jump%row))
         problem%free(0, :) = 0.0_wp
         allocate(jump%stopping)
         allocate(jump%stopping%stays(0:problem%n_slip, n), source=pushes_stay)
         allocate(jump%stopping%slides(n), source=.false.)
         jump%stopping%rate = jump%rate(1:, :)
         do k = 1, n
            if (self%active%set%item(jump%row(k))%has_friction) call find_stop(self, h, jump, k)
         end do
      end associate
   end subroutine find_stops

   !> The same for place `k` of the jump.
   pure subroutine find_stop(self, h, jump, k)
      type(march_t), intent(in) :: self
      real(wp), intent(in) :: h
      type(rate_jump_t), intent(inout) :: jump
      integer, intent(in) :: k
      logical :: is_led

      associate (problem => jump%problem, stopping => jump%stopping, &
            law => self%active%friction%law(self%active%set%id(jump%row(k))))
         ! What is led to its stop in the step has it.
         is_led = any(abs(law%slip_target) > 0.0_wp)
         problem%slip_target(:, k) = 2.0_wp/h*law%slip_target(:problem%n_slip)
         stopping%rate(:, k) = (1.0_wp - law%restitution)*jump%rate(1:, k)
         if (.not. is_led .and. may_stop(law)) then
            stopping%stays(1:, k) = .false.
            problem%free(1:, k) = stopping%rate(:, k)
         else if (stopping%stays(0, k)) then
            ! What slides on is at its limit, which round-off must not pass.
            problem%free(1:, k) = 0.0_wp
            problem%slip_target(:, k) = 0.0_wp
            problem%mu(k) = 2.0_wp*problem%mu(k)
         else
            stopping%slides(k) = .not. is_led
         end if
      end associate
   end subroutine find_stop

   !> Which conditions of the set are contacts of what has mass?
   pure function has_impact(self)
      type(march_t), intent(in) :: self
      logical :: has_impact(self%active%set%n)
      integer :: k

      has_impact = .false.
      associate (set => self%active%set)
         do k = set%n_permanent + 1, set%n
            associate (node => set%item(k)%node(:set%item(k)%n_node))
               has_impact(k) = all(mass_is_at(self, node))
            end associate
         end do
      end associate
   end function has_impact

end module emcon_restitution
