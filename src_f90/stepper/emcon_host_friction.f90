!> Friction in a step of a host: which contacts stick, and which slide where to.
!>
!> Nothing is kept from step to step. What acts begins as the expected motion has it; what solves a
!> step tells by the trial of Coulomb's law how each contact is to go on. The law is the same for
!> any stiffness of that trial: the host's tangent is not known here, so it is friction over the
!> slip that stops, and over an edge where there is none. Source: docs/theory.md, section 4.13.
module emcon_host_friction
   use emcon_active_set, only : active_set_t
   use emcon_constraint, only : condition_t, most_slips
   use emcon_constraints, only : constraint_index
   use emcon_contact_problem, only : contact_problem_t
   use emcon_coulomb_law, only : contact_open, contact_slides, coulomb_t, has_way, slip_status_t
   use emcon_friction, only : friction_close, friction_keep, friction_look_back, friction_turn, &
      friction_use, most_lagged, most_shift
   use emcon_gaps, only : gaps_follow_slips
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_system, only : system_t
   implicit none
   private
   public :: host_friction_begin, host_friction_turn, host_friction_turn_few, &
      host_friction_status, host_friction_lags, host_friction_look_back, host_friction_ways
   public :: host_friction_slides, host_friction_hold, host_friction_lay_out, host_friction_take

   !> Of contacts that would begin to slide those do whose friction is over what their push allows
   !> by more than this part of the worst.
   real(wp), parameter :: alike = 0.5_wp

contains

   !> A step has begun: what acts slides where the expected motion slides, else it sticks.
   subroutine host_friction_begin(active, acts, system, motion)
      type(active_set_t), intent(inout) :: active
      logical, intent(in) :: acts(:)             !! (n_constraint)
      type(system_t), intent(in) :: system
      type(motion_t), intent(in) :: motion
      real(wp) :: slip(most_slips)
      integer :: id, pair, i

      associate (friction => active%friction)
         if (.not. friction%is_on) return
         friction%follows = friction%n_slip > 1
         do id = system%first_constraint(1) + 1, system%n_constraint
            if (.not. (acts(id) .and. friction%law(id)%mu > 0.0_wp)) cycle
            call constraint_index(system, id, pair, i)
            associate (contact => system%contact(pair)%contact)
               slip = 0.0_wp
               slip(:friction%n_slip) = contact%slip(i, motion%x, motion%u0, motion%du)
               if (norm2(slip - friction%law(id)%slip_target) > has_way*contact%state(i)%size) then
                  call friction_close(friction, system, pair, i, motion, 0.0_wp, .false.)
               end if
            end associate
         end do
      end associate
   end subroutine host_friction_begin

   !> The step is solved: how the contacts of the set that go on to act hold next.
   subroutine host_friction_turn(active, acts, system, turns)
      type(active_set_t), intent(inout) :: active
      logical, intent(in) :: acts(:)             !! (n_constraint) in the next set
      type(system_t), intent(in) :: system
      logical, intent(out) :: turns              !! some hold in another way than before
      integer :: k

      turns = .false.
      if (.not. active%friction%is_on) return
      call friction_keep(active%friction, active%set)
      do k = active%set%n_permanent + 1, active%set%n
         associate (id => active%set%id(k))
            if (acts(id)) call friction_turn(active%friction, system, active%set, k, &
               turns, stiffness_of(active%friction%law(id), active%set%item(k), active%set%lam(k)))
         end associate
      end do
   end subroutine host_friction_turn

   !> Does constraint `id` slide, as it holds now?
   pure logical function host_friction_slides(active, id) result(slides)
      type(active_set_t), intent(in) :: active
      integer, intent(in) :: id                  !! 1..n_constraint

      slides = active%friction%is_on
      if (slides) slides = active%friction%law(id)%mu > 0.0_wp .and. &
         active%friction%law(id)%status%kind == contact_slides
   end function host_friction_slides

   !> All candidates are to have rows of their slips, whichever way they go.
   pure subroutine host_friction_hold(active)
      type(active_set_t), intent(inout) :: active

      active%friction%follows = .false.
      if (active%friction%is_on) active%friction%law%status = slip_status_t()
   end subroutine host_friction_hold

   !> Coefficients and slips of a problem of the contacts of the set.
   pure subroutine host_friction_lay_out(active, problem)
      type(active_set_t), intent(in) :: active
      type(contact_problem_t), intent(inout) :: problem
      integer :: k

      if (problem%n_slip == 0) return
      do k = active%set%n_permanent + 1, active%set%n
         associate (item => active%set%item(k), law => active%friction%law(active%set%id(k)))
            if (.not. item%has_friction) cycle
            problem%mu(k) = law%mu*item%normal
            problem%slip_target(:, k) = law%slip_target(:problem%n_slip)
            problem%free(1:, k) = problem%free(1:, k) - problem%slip_target(:, k)
         end associate
      end do
   end subroutine host_friction_lay_out

   !> How the contacts of the set hold by the solution of their problem.
   pure subroutine host_friction_take(active, status)
      type(active_set_t), intent(inout) :: active
      type(slip_status_t), intent(in) :: status(:)         !! (n)
      integer :: k

      if (.not. active%friction%is_on) return
      do k = active%set%n_permanent + 1, active%set%n
         active%friction%law(active%set%id(k))%status = status(k)
         if (status(k)%kind == contact_open) active%friction%law(active%set%id(k))%status = &
            slip_status_t()
      end do
   end subroutine host_friction_take

   !> How all contacts hold; none without friction.
   pure subroutine host_friction_status(active, status)
      type(active_set_t), intent(in) :: active
      type(slip_status_t), allocatable, intent(out) :: status(:)     !! (n_constraint or 0)

      if (active%friction%is_on) then
         status = active%friction%law%status
      else
         allocate(status(0))
      end if
   end subroutine host_friction_status

   !> Contacts of the set that was solved have begun to slide: only the worst go on to do so.
   pure subroutine host_friction_turn_few(active, before)
      type(active_set_t), intent(inout) :: active
      type(slip_status_t), intent(in) :: before(:)         !! (n_constraint) how they held there
      real(wp) :: used(active%set%n), tau(most_slips)
      integer :: k

      used = 0.0_wp
      do k = active%set%n_permanent + 1, active%set%n
         associate (law => active%friction%law(active%set%id(k)), &
               was => before(active%set%id(k)))
            if (law%status%kind /= contact_slides .or. was%kind == contact_slides) cycle
            call friction_use(active%friction, active%set, k, tau(:active%friction%n_slip), used(k))
         end associate
      end do
      do k = active%set%n_permanent + 1, active%set%n
         if (used(k) > 0.0_wp .and. used(k) < alike*maxval(used)) then
            active%friction%law(active%set%id(k))%status = before(active%set%id(k))
         end if
      end do
   end subroutine host_friction_turn_few

   !> Of the trial: a contradiction at one end of the way that is led to leads to between both.
   pure real(wp) function stiffness_of(law, item, lam) result(stiffness)
      type(coulomb_t), intent(in) :: law
      type(condition_t), intent(in) :: item
      real(wp), intent(in) :: lam                !! multiplier of its gap [M L/T^2]
      real(wp) :: length

      length = norm2(law%slip_target)
      if (.not. length > 0.0_wp) length = item%size
      stiffness = max(law%mu*item%normal*lam/length, tiny(lam))
   end function stiffness_of

   !> The set stands: does friction act where slip was expected, not where it is? Then the step is
   !> to be solved again with the points that were found for it.
   subroutine host_friction_lags(active, acts, system, lags)
      type(active_set_t), intent(inout) :: active
      logical, intent(in) :: acts(:)             !! (n_constraint)
      type(system_t), intent(inout) :: system    !! measured for the solution
      logical, intent(out) :: lags
      integer :: id, pair, i

      lags = .false.
      associate (friction => active%friction)
         if (.not. friction%is_on) return
         do id = system%first_constraint(1) + 1, system%n_constraint
            if (.not. (acts(id) .and. friction%law(id)%mu > 0.0_wp)) cycle
            call constraint_index(system, id, pair, i)
            lags = lags .or. system%contact(pair)%contact%state(i)%slip_shift > most_shift
         end do
         lags = lags .and. friction%n_lagged < most_lagged
         if (lags) friction%n_lagged = friction%n_lagged + 1
         if (lags) call gaps_follow_slips(system)
      end associate
   end subroutine host_friction_lags

   !> The set stands: where slip has a direction, does friction stop or turn something back? Then
   !> the step is to be solved again.
   subroutine host_friction_look_back(active, acts, system, motion, leads)
      type(active_set_t), intent(inout) :: active
      logical, intent(in) :: acts(:)             !! (n_constraint)
      type(system_t), intent(in) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(out) :: leads
      logical :: turns

      leads = .false.
      if (.not. (active%friction%is_on .and. active%friction%n_slip > 1)) return
      call friction_look_back(active%friction, system, active%set, motion, .false., leads)
      if (leads) call host_friction_turn(active, acts, system, turns)
   end subroutine host_friction_look_back

   !> A number for the way in which each contact holds: equal ones are the same, as far as a search
   !> that comes back is to be found out.
   pure function host_friction_ways(active, acts) result(way)
      type(active_set_t), intent(in) :: active
      logical, intent(in) :: acts(:)             !! (n_constraint)
      integer :: way(size(acts))                 !! (n_constraint)
      integer :: id, s

      way = 0
      if (.not. active%friction%is_on) return
      do id = 1, size(way)
         if (.not. acts(id)) cycle
         associate (status => active%friction%law(id)%status)
            way(id) = status%kind
            if (status%kind /= contact_slides) cycle
            do s = 1, active%friction%n_slip
               if (status%direction(s) < 0.0_wp) way(id) = way(id) + 8*2**s
            end do
         end associate
      end do
   end function host_friction_ways

end module emcon_host_friction
