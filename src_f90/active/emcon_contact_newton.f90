!> Newton's method for a step in which contacts act, stick and slide as their laws say.
!>
!> All candidates are rows of the set, of their gaps and of their slips. Each iterate linearises
!> residual, gaps and slips, condenses these to the contacts, and solves what is left exactly: the
!> problem of emcon_contact_problem. Which contacts act is so found on the way, and once it stands
!> the method converges as Newton's does. The end is told by the laws, not by the set: where rows
!> follow from others motions stand while forces still trade. Source: docs/theory.md, eq. (14i).
module emcon_contact_newton
   use emcon_condensation, only : condensation_free
   use emcon_constraint, only : condition_rate, most_slips
   use emcon_constraint_rows, only : constraints_rows
   use emcon_constraints, only : constraint_set_t, constraints_evaluate, constraints_normals, &
      constraints_take_hold
   use emcon_contact_newton_condense, only : contact_newton_condense, &
      contact_newton_condense_kept, contact_newton_correct
   use emcon_contact_newton_type, only : by_kept_t, contact_newton_t, rest_t
   use emcon_contact_problem, only : contact_problem_create
   use emcon_contact_rest, only : contact_rest_defect, contact_rest_missed
   use emcon_convergence, only : convergence_begin, most_rounding, round_off
   use emcon_coulomb_law, only : slip_status_t
   use emcon_early_set, only : early_enough
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_is_equilibrium
   use emcon_factor_policy, only : factor_policy_may_provide
   use emcon_kept_factor, only : kept_factor_has_room
   use emcon_kinds, only : wp
   use emcon_lane_sums, only : relative_size
   use emcon_mixed_step, only : mixed_step_begin, mixed_step_shorten
   use emcon_motion, only : motion_evaluate, motion_t
   use emcon_newton, only : newton_check_interrupt, newton_converged, newton_diverged, &
      newton_early, newton_find_idle, newton_measure_forces, newton_pick_residual, newton_refused, &
      newton_t
   use emcon_numbering, only : add_to_dofs, pick_unknowns
   use emcon_phases, only : phase_enter, phase_gaps, phase_leave
   use emcon_system, only : system_respond, system_tangent_times, system_t
   implicit none
   private
   public :: contact_newton_t, contact_newton_solve, contact_newton_free, contact_newton_suits

   !> Iterates of a solve at most, by those that a set which stands is given; halvings of a
   !> correction that no forces are found after.
   integer, parameter :: more_iterates = 2, most_halvings = 6
   !> Parts of a correction that are tried, each half of the one before; the gain that is enough,
   !> and the size below which none is looked for.
   integer, parameter :: most_parts = 4
   real(wp), parameter :: enough = 0.9_wp, no_search = 1.0e-7_wp
   !> Corrections come from a factor that is kept, if one may be: in statics, where tangents change,
   !> of so many rows, as a tangent takes a solution for each.
   integer, parameter :: many = 100
   !> A balance of so many contacts begins with all of them.
   integer, parameter :: several = 8
   !> The tangent of an iterate does for the next one if that leaves less than this part; a factor
   !> that is kept does with new rows if less than that is left.
   real(wp), parameter :: enough_kept = 0.1_wp, enough_by_kept = 0.5_wp
   !> Once it is within the tolerance an iterate that leaves more than this part is the last.
   real(wp), parameter :: polish_gain = 0.3_wp

contains

   !> Solve for `motion%du`; on entry a first guess, with the multipliers of `set`, which has rows
   !> of all slips. Laws are left as they hold at the end.
   subroutine contact_newton_solve(self, newton, system, set, motion, status, error)
      !> With laws, and `holds`; where it has solved the step with the same rows before it begins by
      !> that tangent
      type(contact_newton_t), intent(inout) :: self
      type(newton_t), intent(inout) :: newton
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `newton_` codes
      type(error_t), allocatable, intent(out) :: error
      logical :: is_static
      integer :: k

      call begin(self, newton, set)
      is_static = evaluation_is_equilibrium(motion%evaluation)
      if (.not. self%early%goes_on) self%kept%is_on = may_keep(self, newton, system, set, is_static)
      ! A belt that contact presses on a drum has no stiffness worth speaking of without contact,
      ! or less than none: its tangent has that of the rows.
      self%holds = self%holds .or. is_static
      call iterate(self, newton, system, set, motion, status, error)
      if (allocated(error)) return
      do k = 1, size(self%law)
         self%law(k)%status = self%status(k)
      end do
   end subroutine contact_newton_solve

   !> Is a balance without inertia of so many contacts that it is best begun with all of them? Their
   !> rows often follow from others there, and sets of them are tried in vain, each by a tangent if
   !> no factor is kept for them; the problem of all is solved by one.
   pure logical function contact_newton_suits(newton, motion, n_contact) result(suits)
      type(newton_t), intent(in) :: newton       !! begun
      type(motion_t), intent(in) :: motion
      integer, intent(in) :: n_contact           !! that act so far

      suits = evaluation_is_equilibrium(motion%evaluation) .and. n_contact >= several .and. &
         factor_policy_may_provide(newton%factor_policy) .and. .not. newton%factor_policy%is_allowed
   end function contact_newton_suits

   !> Free what solvers hold.
   subroutine contact_newton_free(self)
      type(contact_newton_t), intent(inout) :: self

      call condensation_free(self%condensation)
   end subroutine contact_newton_free

   !> Nothing is known yet but the multipliers to start from, and the tangent of a solve before: of
   !> use where slip has a direction and nothing is driven. Without rows of slips the problem has
   !> none.
   subroutine begin(self, newton, set)
      type(contact_newton_t), intent(inout) :: self
      type(newton_t), intent(inout) :: newton
      type(constraint_set_t), intent(in) :: set
      integer :: row(set%n_row), k, n_slip

      call convergence_begin(newton%convergence)
      row = names_of(set)
      self%early%goes_on = .false.
      if (self%early%is_made .and. allocated(self%row)) then
         if (size(row) == size(self%row)) self%early%goes_on = all(row == self%row)
      end if
      self%early%is_made = .false.
      if (self%early%goes_on) return
      newton%n_solve = 0
      n_slip = max(0, maxval(set%slip(:set%n_row)))
      self%turns = n_slip > 1 .and. any(self%law%mu > 0.0_wp)
      self%has_tangent = self%has_tangent .and. self%turns .and. .not. any(abs(newton%driven) &
         > 0.0_wp)
      if (self%has_tangent) self%has_tangent = size(row) == size(self%row)
      if (self%has_tangent) self%has_tangent = all(row == self%row)
      if (.not. self%has_tangent) call begin_anew(self, set, n_slip)
      self%row = row
      associate (law => self%law)
         do k = 1, size(law)
            self%problem%slip_target(:, k) = law(k)%slip_target(:n_slip)
         end do
         if (allocated(self%push)) deallocate(self%push, self%status)
         allocate(self%push(0:n_slip, size(law)), source=0.0_wp)
         allocate(self%status(size(law)))
      end associate
      self%rest = rest_t()
      self%step%mixes = .false.
      self%least_soft = 0
      self%is_rounding = .false.
      self%is_condensed = self%has_tangent
   end subroutine begin

   !> Numbers that tell the rows of sets apart.
   pure function names_of(set) result(row)
      type(constraint_set_t), intent(in) :: set
      integer :: row(set%n_row)
      integer :: k

      do k = 1, set%n_row
         row(k) = (1 + most_slips)*set%id(set%condition(k)) + set%slip(k)
      end do
   end function names_of

   !> With other rows.
   subroutine begin_anew(self, set, n_slip)
      type(contact_newton_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      integer, intent(in) :: n_slip              !! of each contact

      call contact_problem_create(self%problem, n_slip, size(self%law))
      self%problem%mu = self%law%mu
      if (allocated(self%condensation%hold)) deallocate(self%condensation%hold)
      allocate(self%condensation%hold(set%n_row), source=0.0_wp)
      call mixed_step_begin(self%step, set%n_row)
   end subroutine begin_anew

   subroutine iterate(self, newton, system, set, motion, status, error)
      type(contact_newton_t), intent(inout) :: self
      type(newton_t), intent(inout) :: newton
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `newton_` codes
      type(error_t), allocatable, intent(out) :: error
      integer :: i, most_iterates

      most_iterates = more_iterates*newton%convergence%maximum
      self%is_driven = any(abs(newton%driven) > 0.0_wp)
      if (self%is_driven) motion%du = motion%du - newton%driven
      do i = 0, most_iterates
         call newton_check_interrupt(newton, status, error)
         if (allocated(error)) return
         ! The correction to come from here may be the last one, or by the tangent that there is.
         self%is_searching = (i > 0 .and. (self%rest%size <= no_search .or. self%turns)) .or. &
            (self%kept%is_on .and. newton%correction%kept%is_made)
         if (i == 0) self%is_searching = self%is_searching .or. self%has_tangent
         call measure_damped(self, newton, system, set, motion, status, error)
         if (allocated(error) .or. status /= newton_converged) return
         if (i == 0 .and. self%kept%is_on) self%kept = by_kept_t(.true., motion%du, set%lam)
         if (i > 0 .and. is_done(self, newton)) return
         self%early%is_made = self%early%is_allowed .and. i > 0 &
            .and. self%rest%size <= early_enough
         if (self%early%is_made) status = newton_early
         if (self%early%is_made) return
         if (i == most_iterates .and. self%rest%size <= newton%convergence%tolerance) return
         status = newton_diverged
         if (i == most_iterates .or. .not. self%rest%size < huge(self%rest%size)) return
         call find_correction(self, newton, system, set, motion, status, error)
         if (allocated(error) .or. status /= newton_converged) return
         if (.not. self%is_driven .and. goes_far(newton)) then
            call take(self, newton, system, set, motion, newton%convergence%largest_move &
               /maxval(abs(newton%dq)))
            status = newton_early
            return
         end if
         if ((i > 0 .or. self%early%goes_on) .and. .not. self%is_driven &
            .and. self%rest%size > no_search) then
            call search(self, newton, system, set, motion, error)
         else
            call take(self, newton, system, set, motion, 1.0_wp)
         end if
         if (allocated(error)) return
         if (self%is_driven) motion%du = motion%du + newton%driven
         self%is_driven = .false.
      end do
   end subroutine iterate

   !> May corrections come from a factor that is kept? It knows nothing of contacts that alone hold
   !> a body.
   pure logical function may_keep(self, newton, system, set, is_static)
      type(contact_newton_t), intent(in) :: self         !! begun
      type(newton_t), intent(in) :: newton
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      logical, intent(in) :: is_static           !! nothing has inertia

      may_keep = (.not. is_static .or. set%n_row >= many) &
         .and. factor_policy_may_provide(newton%factor_policy) &
         .and. .not. (self%holds .or. self%has_tangent .or. any(abs(newton%driven) > 0.0_wp))
      if (may_keep) may_keep = kept_factor_has_room(newton%correction%kept, set%n_row, &
         size(system%matrix%column))
   end function may_keep

   !> The correction from here: by the last tangent, by a factor that is kept, or by a new tangent.
   subroutine find_correction(self, newton, system, set, motion, status, error)
      type(contact_newton_t), intent(inout) :: self
      type(newton_t), intent(inout) :: newton
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `newton_` codes
      type(error_t), allocatable, intent(out) :: error
      logical :: is_found

      self%keeps_tangent = does_keep_tangent(self, newton)
      is_found = self%kept%is_on .and. (self%keeps_tangent .or. &
         self%rest%size < enough_by_kept*self%rest%last)
      call count_stall(self)
      if (is_found) call contact_newton_condense_kept(self, newton, system, set, &
         motion, is_found, error)
      if (allocated(error)) return
      status = newton_converged
      if (.not. is_found) then
         if (self%kept%is_on) call give_up_kept(self, set, motion)
         call find_tangent(self, newton, system, set, motion, status, error)
         if (allocated(error) .or. status /= newton_converged) return
         if (self%is_driven) call add_driven(newton, system, set, motion)
         call contact_newton_condense(self, newton, system, set, status, error)
         if (allocated(error) .or. status /= newton_converged) return
      end if
      call contact_newton_correct(self, newton, system, set, error)
   end subroutine find_correction

   !> The factor that is kept does not lead to the end: tangents follow, from where it led to if
   !> forces are met to a few digits there, else from the first guess.
   subroutine give_up_kept(self, set, motion)
      type(contact_newton_t), intent(inout) :: self
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(inout) :: motion

      self%kept%is_on = .false.
      self%keeps_tangent = .false.
      self%rest%best = self%rest%size
      if (self%rest%size <= early_enough) return
      motion%du = self%kept%du
      set%lam = self%kept%lam
      self%status = slip_status_t()
      self%least_soft = 0
      self%rest = rest_t()
      self%step%is_taken = .false.
      self%is_condensed = .false.
   end subroutine give_up_kept

   !> Let there be a tangent, unless the last one is kept.
   subroutine find_tangent(self, newton, system, set, motion, status, error)
      type(contact_newton_t), intent(inout) :: self
      type(newton_t), intent(inout) :: newton
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `newton_` codes
      type(error_t), allocatable, intent(out) :: error

      status = newton_converged
      if (self%rest%has_second .or. self%keeps_tangent) return
      self%is_searching = .false.
      self%rest%is_measured = .false.
      call measure(self, newton, system, set, motion, status, error)
   end subroutine find_tangent

   !> Does the correction move something farther than contacts that are no candidates allow?
   pure logical function goes_far(newton)
      type(newton_t), intent(in) :: newton

      goes_far = .false.
      if (size(newton%dq) > 0) goes_far = maxval(abs(newton%dq)) > newton%convergence%largest_move
   end function goes_far

   !> Is the step solved?
   pure logical function is_done(self, newton)
      type(contact_newton_t), intent(in) :: self
      type(newton_t), intent(in) :: newton

      is_done = self%rest%size <= round_off
      if (is_done) return
      ! What a factor that is kept leaves falls by a part each time: it goes to round-off.
      is_done = self%is_rounding .or. (self%rest%size <= newton%convergence%tolerance &
         .and. .not. self%kept%is_on)
      if (newton%convergence%polishes) is_done = is_done .and. &
         self%rest%size > polish_gain*self%rest%last
   end function is_done

   !> How long ago was the last clear gain?
   subroutine count_stall(self)
      type(contact_newton_t), intent(inout) :: self

      self%rest%n_stall = self%rest%n_stall + 1
      if (self%rest%size < 0.5_wp*self%rest%best) self%rest%n_stall = 0
      self%rest%best = min(self%rest%best, self%rest%size)
      self%rest%last = self%rest%size
   end subroutine count_stall

   !> Residual and rows at the motion; the last correction is halved as long as there are none.
   subroutine measure_damped(self, newton, system, set, motion, status, error)
      type(contact_newton_t), intent(inout) :: self
      type(newton_t), intent(inout) :: newton
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      do i = 0, most_halvings
         status = newton_converged
         if (.not. (self%rest%is_measured .and. self%is_searching)) &
            call measure(self, newton, system, set, motion, status, error)
         self%rest%is_measured = .false.
         if (allocated(error) .or. status == newton_converged) exit
         if (newton%n_solve == 0) return
         newton%dq = 0.5_wp*newton%dq
         call add_to_dofs(system%space%numbering, newton%dq, -1.0_wp, motion%du)
      end do
      if (allocated(error)) return
      newton%convergence%last = self%rest%size
      associate (convergence => newton%convergence)
         convergence%n_history = min(convergence%n_history + 1, size(convergence%history))
         convergence%history(convergence%n_history) = self%rest%size
      end associate
   end subroutine measure_damped

   !> What is left at the motion: of forces over their sizes, of gaps and slips that are held over
   !> edges, of the law over the largest push.
   subroutine measure(self, newton, system, set, motion, status, error)
      type(contact_newton_t), intent(inout) :: self
      type(newton_t), intent(inout) :: newton
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! refused: there are no forces
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: defect, rounded, missed
      integer :: left

      status = newton_refused
      self%rest%size = huge(self%rest%size)
      call motion_evaluate(motion)
      call system_respond(system, motion, .not. self%is_searching, .true.)
      if (allocated(system%response%failure)) allocate(error, source=system%response%failure)
      if (allocated(error) .or. allocated(system%response%refusal)) return
      status = newton_converged
      call phase_enter(system%phases, phase_gaps, left)
      call constraints_take_hold(set)
      self%rest%has_second = .not. (self%is_searching .or. self%kept%is_on)
      call constraints_evaluate(set, system, motion, .not. self%rest%has_second)
      call follow_normals(self, set)
      call constraints_rows(set, system%space%numbering)
      call phase_leave(system%phases, left)
      call newton_pick_residual(newton, system, set)
      call newton_measure_forces(newton, system, set, motion)
      call contact_rest_defect(self%status, set, motion, defect, rounded)
      missed = 0.0_wp
      if (self%is_condensed) call contact_rest_missed(self%law, self%problem, set, &
         maxval(system%response%rounding), missed)
      self%rest%size = max(relative_size(newton%residual, newton%forces), defect, missed)
      self%is_rounding = relative_size(newton%residual, newton%rounding) <= round_off &
         .and. rounded <= round_off .and. missed <= newton%convergence%tolerance
      call newton_find_idle(newton, system, self%is_rounding)
      if (.not. newton%is_idle) self%is_rounding = self%is_rounding .and. &
         self%rest%size <= most_rounding
   end subroutine measure

   !> The first correction meets prescribed motion by the tangent at its start.
   subroutine add_driven(newton, system, set, motion)
      type(newton_t), intent(inout) :: newton
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(in) :: motion
      integer :: k

      call system_tangent_times(system, motion, newton%driven, newton%left)
      call pick_unknowns(system%space%numbering, newton%left, newton%scale)
      newton%residual = newton%residual + newton%scale
      do k = 1, set%n_row
         set%defect(k) = set%defect(k) + condition_rate(set%item(set%condition(k)), &
            newton%driven, set%slip(k))
      end do
   end subroutine add_driven

   !> Does the last tangent do for what is left? It does within the tolerance; and where slip has a
   !> direction, which needs a motion by each row, as long as it gains as much as there is to gain.
   pure logical function does_keep_tangent(self, newton) result(keeps)
      type(contact_newton_t), intent(in) :: self
      type(newton_t), intent(in) :: newton

      keeps = self%is_condensed .and. .not. self%condensation%is_singular
      if (self%step%mixes .and. self%kept%is_on) then
         ! Mixing sees what is wrong with it.
         keeps = keeps .and. self%rest%size < enough_by_kept*self%rest%last
         return
      end if
      if (keeps) keeps = ((self%turns .or. self%kept%is_on) .and. &
         self%rest%size < enough_kept*self%rest%last) .or. (.not. self%kept%is_on .and. &
         self%rest%size <= newton%convergence%tolerance)
   end function does_keep_tangent

   !> Of parts of the correction take the first that gains, or that which leaves least.
   subroutine search(self, newton, system, set, motion, error)
      type(contact_newton_t), intent(inout) :: self
      type(newton_t), intent(inout) :: newton
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(inout) :: motion
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: before, part, best_part, least, start(size(motion%du, 1), size(motion%du, 2))
      integer :: i, status

      before = self%rest%size
      self%is_searching = .true.
      start = motion%du
      least = huge(least)
      part = 1.0_wp
      best_part = 1.0_wp
      do i = 0, most_parts
         motion%du = start
         call take(self, newton, system, set, motion, part)
         call measure(self, newton, system, set, motion, status, error)
         if (allocated(error)) return
         self%rest%is_measured = status == newton_converged
         if (self%rest%size < least) then
            least = self%rest%size
            best_part = part
         end if
         if (self%rest%size < enough*before .or. i == most_parts) exit
         part = 0.5_wp*part
      end do
      if (abs(part - best_part) > 0.0_wp) then
         motion%du = start
         call take(self, newton, system, set, motion, best_part)
         self%rest%is_measured = .false.
      end if
      newton%dq = best_part*newton%dq
      call mixed_step_shorten(self%step, best_part)
   end subroutine search

   !> Go a part of the way to what the condensed step has as its solution.
   subroutine take(self, newton, system, set, motion, part)
      type(contact_newton_t), intent(inout) :: self
      type(newton_t), intent(in) :: newton
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(inout) :: motion
      real(wp), intent(in) :: part

      call add_to_dofs(system%space%numbering, newton%dq, part, motion%du)
      set%lam = self%step%old + part*(self%step%new - self%step%old)
      self%step%is_taken = .true.
   end subroutine take

   !> Friction is in proportion to the normal force where the motion has come to.
   subroutine follow_normals(self, set)
      type(contact_newton_t), intent(inout) :: self
      type(constraint_set_t), intent(inout) :: set   !! evaluated there

      if (.not. self%step%is_taken) return
      self%step%is_taken = .false.
      associate (now => constraints_normals(set))
         where (min(now, self%step%normal) > 0.0_wp) set%lam = set%lam*(now/self%step%normal)
      end associate
      call constraints_take_hold(set)
   end subroutine follow_normals

end module emcon_contact_newton
