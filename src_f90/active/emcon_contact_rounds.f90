!> A step as one problem of its contacts: which of them take part, round by round.
!>
!> Candidates are what acted at the start of the step and what closes in it. With all of them the
!> step is solved by emcon_contact_newton; then gaps are measured for the motion that came out, and
!> what closes beside them joins. Candidates only grow within a step, but for those that lose their
!> surface, which do not come back; so rounds end. Source: docs/theory.md, section 6.
module emcon_contact_rounds
   use emcon_active_set, only : active_set_pass, active_set_select, active_set_t, &
      active_set_update_gaps, step_done, step_too_far
   use emcon_active_set_update, only : begins_unseen, gap_to_hold, look_at_active, look_at_open, &
      most_stale, noise_at
   use emcon_contact_newton, only : contact_newton_solve
   use emcon_constraint_rows, only : constraints_rows
   use emcon_constraints, only : constraint_index, constraints_evaluate
   use emcon_coulomb_law, only : contact_open, coulomb_t, slip_status_t
   use emcon_errors, only : error_t
   use emcon_friction, only : friction_close, friction_keep, friction_missed, most_lagged, &
      most_shift
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_evaluate, motion_t
   use emcon_near_laws, only : near_laws_are_none, near_laws_update
   use emcon_newton, only : newton_converged, newton_early, newton_measure_forces, newton_solve, newton_t
   use emcon_phases, only : phase_enter, phase_gaps, phase_leave
   use emcon_system, only : system_respond, system_t
   implicit none
   private
   public :: contact_rounds_solve

   !> By so much of the largest push friction may miss its law: what a solve leaves.
   real(wp), parameter :: least_missed = 1.0e4_wp*epsilon(1.0_wp)

   !> Who takes part.
   type :: candidates_t
      logical, allocatable :: takes_part(:)      !! (n_constraint)
      logical, allocatable :: has_left(:)        !! (n_constraint) it lost its surface
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
      type(coulomb_t), allocatable :: law(:)
      logical :: grows, is_measured
      integer :: left

      allocate(candidates%takes_part, source=self%is_active)
      allocate(candidates%has_left(size(self%is_active)), source=.false.)
      call predict(self, system, newton, motion, is_measured, status, error)
      if (allocated(error)) return
      if (is_measured) then
         call phase_enter(system%phases, phase_gaps, left)
         call look(self, system, motion, candidates, grows, status)
         call phase_leave(system%phases, left)
         if (status /= step_done .or. .not. grows) return
      end if
      do
         call phase_enter(system%phases, phase_gaps, left)
         call select_all(self, system, motion, candidates, is_measured)
         call phase_leave(system%phases, left)
         call solve(self, system, newton, motion, law, status, error)
         if (allocated(error) .or. status /= newton_converged) return
         newton%driven = 0.0_wp                  ! the prescribed motion is in `motion` now
         self%n_newton = self%n_newton + newton%convergence%n_iteration
         call keep(self, law)
         ! Before stencils are chosen anew: the step was solved with these.
         call finish(self, system, newton, motion, error)
         if (allocated(error)) return
         call phase_enter(system%phases, phase_gaps, left)
         call look(self, system, motion, candidates, grows, status)
         call phase_leave(system%phases, left)
         if (status /= step_done) return
         if (.not. grows) return
         is_measured = .true.
      end do
   end subroutine contact_rounds_solve

   !> Try what acted at the start of the step, in the ways of then, by the null space or as the deck
   !> asks: in most steps nothing else acts. Where the step ends so `is_solved`; else `motion` has
   !> come nearer, or is the first guess again.
   subroutine predict(self, system, newton, motion, is_solved, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      logical, intent(out) :: is_solved
      integer, intent(out) :: status             !! one of the `newton_` codes
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: first(size(motion%du, 1), size(motion%du, 2))
      integer :: left

      first = motion%du
      call phase_enter(system%phases, phase_gaps, left)
      call active_set_select(self, system, motion)
      call phase_leave(system%phases, left)
      newton%looks_early = .true.
      call newton_solve(newton, system, self%set, motion, status, error)
      newton%looks_early = .false.
      self%n_newton = self%n_newton + newton%convergence%n_iteration
      is_solved = .false.
      if (allocated(error)) return
      if (.not. any(status == [newton_converged, newton_early])) then
         motion%du = first
         return
      end if
      newton%driven = 0.0_wp                     ! the prescribed motion is in `motion` now
      self%lam(self%set%id(:self%set%n)) = self%set%lam(:self%set%n)
      call friction_keep(self%friction, self%set)
      if (status == newton_converged) is_solved = obeys_laws(self, system)
   end subroutine predict

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

   !> All candidates act for now, and hold their slips.
   subroutine select_all(self, system, motion, candidates, is_measured)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      type(candidates_t), intent(in) :: candidates
      logical, intent(in) :: is_measured         !! gaps are known for this motion

      self%is_active = candidates%takes_part
      if (self%friction%is_on) self%friction%law%status = slip_status_t()
      self%n_tried = 0
      call active_set_select(self, system, motion, is_measured)
   end subroutine select_all

   !> Solve with all candidates; `law` as it holds at each contact of the set.
   subroutine solve(self, system, newton, motion, law, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      type(coulomb_t), allocatable, intent(out) :: law(:)    !! (contacts of the set)
      integer, intent(out) :: status             !! one of the `newton_` codes
      type(error_t), allocatable, intent(out) :: error

      associate (set => self%set)
         allocate(law(set%n - set%n_permanent))
         if (self%friction%is_on) law = self%friction%law(set%id(set%n_permanent + 1:set%n))
         if (size(law) == 0) then
            call newton_solve(newton, system, set, motion, status, error)
         else
            call contact_newton_solve(newton, system, set, law, motion, status, error)
         end if
      end associate
   end subroutine solve

   !> Multipliers and ways of the candidates: what is not open acts.
   subroutine keep(self, law)
      type(active_set_t), intent(inout) :: self
      type(coulomb_t), intent(in) :: law(:)      !! (contacts of the set)
      integer :: k

      associate (set => self%set, friction => self%friction)
         self%lam(set%id(:set%n)) = set%lam(:set%n)
         do k = set%n + 1, set%n_row
            friction%tau(set%slip(k), set%id(set%condition(k))) = set%lam(k)
         end do
         do k = 1, size(law)
            associate (id => set%id(set%n_permanent + k))
               self%is_active(id) = law(k)%status%kind /= contact_open
               if (friction%is_on .and. self%is_active(id)) friction%law(id)%status = law(k)%status
            end associate
         end do
      end associate
   end subroutine keep

   !> Measure all gaps for the motion. Who joins, who has lost its surface, which stencils were
   !> chosen for another motion?
   subroutine look(self, system, motion, candidates, grows, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      type(candidates_t), intent(inout) :: candidates
      logical, intent(out) :: grows              !! solve the step again
      integer, intent(out) :: status             !! one of the `step_` codes
      integer :: pair, k

      status = step_done
      grows = .false.
      self%is_stale = .false.
      self%friction%lags = .false.
      k = self%set%n_permanent
      call active_set_pass(self, system, motion)
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact, &
               first => system%first_constraint(pair) + 1, &
               last => system%first_constraint(pair + 1))
            if (self%skip_until(pair)%passes .and. .not. any(candidates%takes_part(first:last))) &
               cycle
            call active_set_update_gaps(self, system, pair, motion, motion%du)
            if (.not. near_laws_are_none(self%near_laws, contact)) call near_laws_update( &
               self%near_laws, system, pair, self%is_active, grows)
            call look_at_pair(self, system, pair, motion, candidates, k, grows, status)
         end associate
      end do
      if (status /= step_done) return
      if (self%is_stale) then
         self%n_stale = self%n_stale + 1
         if (self%n_stale > most_stale) status = step_too_far
      else if (self%friction%lags .and. .not. grows) then
         self%friction%n_lagged = self%friction%n_lagged + 1
         grows = self%friction%n_lagged <= most_lagged
      end if
      grows = grows .or. self%is_stale
   end subroutine look

   !> The conditions of one contact.
   subroutine look_at_pair(self, system, pair, motion, candidates, k, grows, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      integer, intent(in) :: pair
      type(motion_t), intent(in) :: motion
      type(candidates_t), intent(inout) :: candidates
      integer, intent(inout) :: k                !! places of the set that were looked at
      logical, intent(inout) :: grows
      integer, intent(inout) :: status
      logical :: closes
      integer :: i, id

      associate (contact => system%contact(pair)%contact, part => candidates%takes_part, &
            has_left => candidates%has_left, friction => self%friction)
         do i = 1, contact%n_constraint
            id = system%first_constraint(pair) + i
            if (part(id)) then
               if (self%is_active(id)) k = k + 1
               if (contact%state(i)%is_leaving) then
                  part(id) = .false.
                  has_left(id) = .true.
                  grows = .true.
               else if (self%is_active(id)) then
                  call look_at_active(self, contact, i, k, motion, status)
                  if (.not. friction%is_on) cycle
                  if (friction%law(id)%mu > 0.0_wp) friction%lags = friction%lags .or. &
                     contact%state(i)%slip_shift > most_shift
               end if
            else if (.not. has_left(id)) then
               call look_at_open(self, contact, i, id, closes, status)
               ! What the pairs take in may hold the bodies away from their guards.
               if (.not. closes .or. (contact%slack > 0.0_wp .and. grows)) cycle
               if (begins_unseen(self, contact, i, motion)) status = step_too_far
               if (friction%is_on) call friction_close(friction, system, pair, i, motion, &
                  contact%state(i)%gap1 - gap_to_hold(self, contact%state(i), id), &
                  .not. self%is_candidate(id))
               part(id) = .true.
               self%is_candidate(id) = .true.
               grows = .true.
            end if
         end do
      end associate
   end subroutine look_at_pair

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
      call newton_measure_forces(newton, system, self%set)
      newton%correction%fell_back = .false.
   end subroutine finish

end module emcon_contact_rounds
