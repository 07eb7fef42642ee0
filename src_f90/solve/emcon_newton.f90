! build: streams
!> Newton's method for one step with a given set of active constraints.
!>
!> Forces are measured against the sum of their contributions before these cancel, docs/theory.md,
!> eq. (25), so that no unit and no absolute size enters.
module emcon_newton
   use emcon_constraint, only : condition_rate
   use emcon_constraint_rows, only : constraints_rows
   use emcon_constraints, only : constraint_set_t, constraints_add_law_forces, &
      constraints_add_rounding, constraints_add_row_forces, constraints_evaluate, &
      constraints_force, constraints_rounding, constraints_take_hold
   use emcon_convergence, only : convergence_accuracy, convergence_begin, convergence_init, &
      convergence_judge, convergence_nears_end, convergence_t, most_rounding, next_done, &
      next_give_up, next_tangent, round_off
   use emcon_correction, only : correction_factorise, correction_is_lost, correction_lay_out, &
      correction_multipliers, correction_solve, correction_t, correction_ticks, correction_work
   use emcon_early_set, only : early_enough, predicts_new_set
   use emcon_errors, only : err_interrupt, error_t, raise
   use emcon_evaluation, only : evaluation_is_equilibrium
   use emcon_factor_policy, only : factor_policy_begin, factor_policy_break_off, &
      factor_policy_complete, factor_policy_correct, factor_policy_give_up, factor_policy_looks, &
      factor_policy_make, factor_policy_renew, factor_policy_t
   use emcon_kept_factor, only : kept_factor_has_room, kept_factor_serves
   use emcon_kinds, only : dp, int64, wp
   use emcon_lane_sums, only : relative_size, yardstick_of, yardstick_size, yardstick_t
   use emcon_line_search, only : line_search_begin, line_search_t, line_search_take, &
      line_search_work
   use emcon_motion, only : motion_evaluate, motion_t
   use emcon_numbering, only : add_to_dofs, pick_magnitudes, pick_unknowns
   use emcon_phases, only : phase_eliminate, phase_enter, phase_factorise, phase_gaps, &
      phase_leave, phase_move, phase_solve
   use emcon_system, only : system_respond, system_tangent_times, system_t
   use emcon_term, only : role_external, role_inertia
   use emcon_timer, only : cpu_seconds
   use emcon_vectors, only : vector_sum, vector_zero
   implicit none
   private
   public :: newton_t, newton_init, newton_solve, interrupt_interface
   public :: newton_find_idle, newton_check_interrupt, newton_pick_residual, newton_measure_forces
   public :: newton_converged, newton_refused, newton_diverged, newton_singular, newton_redundant, &
      newton_early

   !> How a solve ended. Refused: there are no forces at the displacements, see `refusal` of
   !> the response;
   !> redundant: some constraints depend on others, see `correction%redundant`.
   integer, parameter :: newton_converged = 0, newton_refused = 1, newton_diverged = 2, &
      newton_singular = 3, newton_redundant = 4
   !> Not at the end yet, and seen to need another set of constraints.
   integer, parameter :: newton_early = -1

   !> A correction larger than so many diagonals of the scene comes from a pivot of round-off: in
   !> statics, where nothing else moves a body as far.
   real(wp), parameter :: farthest = 1.0e4_wp
   !> A correction that inverts an element, or that a given force refuses, is halved so often at
   !> most.
   integer, parameter :: most_halvings = 6
   abstract interface
      !> Has the user asked to stop?
      logical function interrupt_interface()
      end function interrupt_interface
   end interface

   !> Work space and report of the solver.
   type :: newton_t
      type(convergence_t) :: convergence         !! how the last solve went
      integer :: n_solve = 0                     !! linear systems solved in the last solve
      real(wp), allocatable :: residual(:), scale(:)   !! (n_unknown)
      type(yardstick_t) :: forces                !! of the contributions to the residual
      type(yardstick_t) :: rounding              !! of what their own evaluation rounds
      real(wp), allocatable :: dq(:)             !! (n_unknown) the last correction
      real(wp), allocatable :: dlam(:)           !! (n) and that of the multipliers
      real(wp), allocatable :: direction(:)      !! (n_unknown) the correction to search along
      real(wp), allocatable :: contact(:, :)     !! (n_dim, n_node) forces of the set of constraints
      real(wp), allocatable :: left(:, :)        !! (n_dim, n_node) the residual with them
      !> (n_dim, n_node) prescribed motion that the first correction meets by its tangent; 0: none
      real(wp), allocatable :: driven(:, :)
      procedure(interrupt_interface), pointer, nopass :: is_interrupted => null()
      real(dp) :: deadline = huge(1.0_dp)        !! CPU time of the process at which it gives up [s]
      type(correction_t) :: correction           !! how linear systems are solved
      real(wp) :: work = 0.0_wp                  !! of the correction as it begins; 0: no search
      type(line_search_t) :: line
      type(factor_policy_t) :: factor_policy     !! of a factor over steps
      logical :: looks_early = .false.           !! in the next solve: may it end as `newton_early`?
      logical :: is_idle = .false.               !! no load: all forces are round-off
   end type newton_t

contains

   !> Set up for `n_unknown` unknowns; `correction` stays.
   subroutine newton_init(self, n_unknown, x, tolerance, maximum)
      type(newton_t), intent(inout) :: self
      integer, intent(in) :: n_unknown           !! >= 0
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n_node) a nodal field
      real(wp), intent(in) :: tolerance          !! > 0, of the relative residual
      integer, intent(in) :: maximum             !! iterations at most

      call convergence_init(self%convergence, tolerance, maximum)
      self%is_idle = .false.
      if (allocated(self%residual)) deallocate(self%residual, self%scale, self%dq, self%direction, &
         self%contact, self%left, self%driven)
      allocate(self%residual(n_unknown), self%scale(n_unknown), self%dq(n_unknown), &
         self%direction(n_unknown))
      allocate(self%contact, self%left, self%driven, mold=x)
      self%dq = 0.0_wp
      self%contact = 0.0_wp
      self%left = 0.0_wp
      self%driven = 0.0_wp
      call begin(self, 0)
   end subroutine newton_init

   !> Solve for `motion%du`, whose prescribed entries stand; on entry a first guess. The multipliers
   !> of `set` start from what they are. By a kept factor where that leads to the end, else by
   !> tangents, if it takes any.
   subroutine newton_solve(self, system, set, motion, status, error, takes_tangents)
      type(newton_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `newton_` codes
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in), optional :: takes_tangents    !! .true. if it is not given
      real(wp), allocatable :: lam(:)
      logical :: is_done, goes_on

      set%penalty%is_under_way = set%penalty%is_on .and. &
         .not. evaluation_is_equilibrium(motion%evaluation)
      if (set%n > 0) lam = set%lam
      is_done = .false.
      if (self%factor_policy%is_allowed &
         .and. size(self%residual) > 0) call solve_by_kept_factor(self, system, set, motion, &
         status, is_done, error)
      if (is_done .or. allocated(error)) return
      if (set%n > 0) set%lam = lam
      if (set%n_row > 0) then
         call factor_policy_complete(self%factor_policy, self%correction, goes_on)
         if (goes_on) call solve_by_kept_factor(self, system, set, motion, status, is_done, error)
         if (is_done .or. allocated(error)) return
         if (set%n > 0) set%lam = lam
      end if
      if (present(takes_tangents)) then
         status = newton_diverged
         if (.not. takes_tangents) return
      end if
      call solve_by_tangents(self, system, set, motion, status, error)
   end subroutine newton_solve

   !> The step by corrections of a factor that is kept; `is_done` unless it does not lead to an end.
   subroutine solve_by_kept_factor(self, system, set, motion, status, is_done, error)
      type(newton_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `newton_` codes
      logical, intent(out) :: is_done            !! else `motion%du` is the first guess again
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: norm, defect
      logical :: is_rounding, is_fit
      integer :: next

      call begin(self, set%n_row)
      self%convergence%is_kept = .true.
      call factor_policy_begin(self%factor_policy, size(self%residual) &
         + merge(set%n, 0, set%penalty%is_under_way), motion%du)
      is_done = .true.
      is_fit = .true.
      do
         call newton_check_interrupt(self, status, error)
         if (.not. allocated(error)) call evaluate_damped(self, system, set, motion, &
            .not. self%correction%kept%is_made, status, error)
         if (allocated(error)) return
         if (status /= newton_converged) then
            if (self%n_solve == 0) return        ! Newton's method finds no forces there either
            exit
         end if
         call measure(self, system, set, motion, norm, defect, is_rounding)
         if (self%correction%n_redundant > 0) status = newton_redundant
         if (status /= newton_converged) return
         call make_factor(self, system, set, motion, is_fit, error)
         if (allocated(error)) return
         if (.not. is_fit) exit
         call judge(self, norm, defect, is_rounding, next)
         if (next == next_done) return
         if (next == next_give_up) exit
         call look(self, system, set, motion, max(norm, defect), status)
         if (status == newton_early) then
            call factor_policy_break_off(self%factor_policy)
            return
         end if
         if (next == next_tangent) then
            call factor_policy_renew(self%factor_policy, self%correction)
            cycle
         end if
         call correct_by_kept_factor(self, system, set, motion%du, is_fit, error)
         if (allocated(error)) return
         if (.not. is_fit) exit
      end do
      is_done = .false.
      call factor_policy_give_up(self%factor_policy, self%correction, is_fit, motion%du)
   end subroutine solve_by_kept_factor

   !> Let there be a factor that knows the constraints.
   subroutine make_factor(self, system, set, motion, is_fit, error)
      type(newton_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: set
      type(motion_t), intent(in) :: motion
      logical, intent(out) :: is_fit             !! there is one
      type(error_t), allocatable, intent(out) :: error
      integer :: left

      if (.not. self%correction%kept%is_made) then
         system%phases%n_factorisation = system%phases%n_factorisation + 1
      end if
      call phase_enter(system%phases, phase_factorise, left)
      call factor_policy_make(self%factor_policy, self%correction, system, set, motion, is_fit, &
         error)
      if (is_fit .and. .not. set%penalty%is_on) is_fit = kept_factor_serves( &
         self%correction%kept, set, self%convergence%knows_sizes)
      call phase_leave(system%phases, left)
   end subroutine make_factor

   !> The next correction of `du` by the kept factor.
   subroutine correct_by_kept_factor(self, system, set, du, is_fit, error)
      type(newton_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(inout) :: set
      real(wp), intent(inout), contiguous :: du(:, :)
      logical, intent(out) :: is_fit             !! else `du` is as it was
      type(error_t), allocatable, intent(out) :: error
      integer :: left

      call phase_enter(system%phases, phase_solve, left)
      call factor_policy_correct(self%factor_policy, self%correction, set, self%residual, self%dq, &
         self%dlam, error)
      call phase_leave(system%phases, left)
      is_fit = .true.
      if (allocated(error)) return
      if (set%penalty%is_on) is_fit = kept_factor_serves(self%correction%kept, set, &
         self%convergence%knows_sizes)
      if (.not. is_fit) return
      system%phases%n_solve = system%phases%n_solve + 1
      self%n_solve = self%n_solve + 1
      call add_to_dofs(system%space%numbering, self%dq, 1.0_wp, du)
      if (set%penalty%is_under_way) set%lam = set%lam + self%dlam
   end subroutine correct_by_kept_factor

   !> The step by Newton's method.
   subroutine solve_by_tangents(self, system, set, motion, status, error)
      type(newton_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: norm, defect
      logical :: is_rounding, is_driven, goes_on, has_tangent
      integer :: next

      call begin(self, set%n_row)
      is_driven = any(abs(self%driven) > 0.0_wp) .and. size(self%residual) > 0
      if (is_driven) motion%du = motion%du - self%driven
      do
         call newton_check_interrupt(self, status, error)
         if (allocated(error)) return
         has_tangent = is_driven .or. .not. convergence_nears_end(self%convergence)
         call evaluate_damped(self, system, set, motion, has_tangent, status, error)
         if (.not. allocated(error) .and. status == newton_converged) call measure(self, system, &
            set, motion, norm, defect, is_rounding)
         if (self%correction%n_redundant > 0 .and. status == newton_converged) then
            status = newton_redundant
            if (is_driven) motion%du = motion%du + self%driven
         end if
         if (allocated(error) .or. status /= newton_converged) return
         if (is_driven) then
            call start_driven(self, system, set, motion, status, error)
            if (allocated(error) .or. status /= newton_converged) return
            is_driven = .false.
            cycle
         end if
         call search(self, system, set, motion, goes_on)
         if (goes_on) cycle
         call judge(self, norm, defect, is_rounding, next)
         if (next /= next_done .and. next /= next_give_up) call look(self, system, set, motion, &
            max(norm, defect), status)
         if (status == newton_early) return
         select case (next)
         case (next_done)
            return
         case (next_give_up)
            status = newton_diverged
            return
         case (next_tangent)
            if (.not. has_tangent) call evaluate_damped(self, system, set, motion, .true., status, &
               error)
            if (allocated(error)) return
            call factorise(self, system, set, status, error)
            if (allocated(error) .or. status /= newton_converged) return
         end select
         call correct(self, system, set, motion, error)
         if (allocated(error)) return
         if (correction_is_lost(self%correction) .or. &
            (evaluation_is_equilibrium(motion%evaluation) .and. is_too_far(self, motion%x))) then
            status = newton_singular
            return
         end if
      end do
   end subroutine solve_by_tangents

   !> What follows from the residual and the defect that were measured.
   pure subroutine judge(self, norm, defect, is_rounding, next)
      type(newton_t), intent(inout) :: self
      real(wp), intent(in) :: norm, defect
      logical, intent(in) :: is_rounding         !! nothing else is left
      integer, intent(out) :: next               !! what it is

      call convergence_judge(self%convergence, norm, defect, yardstick_size(self%forces), &
         is_rounding, next)
   end subroutine judge

   !> Once in a solve, where a few digits are right: does the step ask for another set? Where a
   !> correction takes iterations a look costs little beside it: there is one after each. A tangent
   !> leaves so little that gaps and slips which are nearly closed are left to the end.
   subroutine look(self, system, set, motion, size, status)
      type(newton_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: set
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: size               !! relative residual
      integer, intent(inout) :: status           !! `newton_early` if so
      logical :: changes
      real(wp) :: left

      ! Before any correction the multipliers are those of a guess: where that flies, round-off.
      if (.not. self%looks_early .or. size > early_enough .or. self%n_solve == 0) return
      self%looks_early = self%convergence%is_kept .and. self%correction%kept%blocks%is_incomplete
      left = huge(left)
      if (self%convergence%is_kept) left = maxval(abs(self%dq))
      call predicts_new_set(system, set, motion, left, changes)
      if (changes) status = newton_early
   end subroutine look

   !> In statics, go back on the last correction if contact forces turned on the way.
   subroutine search(self, system, set, motion, goes_on)
      type(newton_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(inout) :: motion
      logical, intent(out) :: goes_on            !! there is another place to look at

      goes_on = .false.
      if (.not. evaluation_is_equilibrium(motion%evaluation) .or. set%n == set%n_permanent) return
      if (self%line%is_on) then
         call line_search_take(self%line, dot_product(self%direction, self%residual))
      else
         call line_search_begin(self%line, self%work, dot_product(self%dq, self%residual))
         if (self%line%is_on) self%direction = self%dq
         self%work = 0.0_wp
      end if
      goes_on = self%line%is_on
      if (.not. goes_on) return
      self%dq = self%line%step*self%direction
      call add_to_dofs(system%space%numbering, self%dq, 1.0_wp, motion%du)
      set%lam = set%lam + self%line%step*self%dlam
   end subroutine search

   !> An error if the user has asked to stop: an increment may take thousands of iterations.
   subroutine newton_check_interrupt(self, status, error)
      type(newton_t), intent(in) :: self
      integer, intent(out) :: status             !! diverged
      type(error_t), allocatable, intent(out) :: error

      status = newton_diverged
      if (self%deadline < huge(self%deadline)) then
         if (cpu_seconds() > self%deadline) call raise(error, err_interrupt, &
            "given up after the time that an increment may take")
      end if
      if (allocated(error) .or. .not. associated(self%is_interrupted)) return
      if (self%is_interrupted()) call raise(error, err_interrupt, "interrupted in an increment")
   end subroutine newton_check_interrupt

   !> Has the last correction moved something out of all proportion?
   pure logical function is_too_far(self, x)
      type(newton_t), intent(in) :: self
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n_node) [L]

      is_too_far = .false.
      if (size(self%dq) > 0) is_too_far = maxval(abs(self%dq)) &
         > farthest*norm2(maxval(x, 2) - minval(x, 2))
   end function is_too_far

   !> Clear the record of the last solve.
   pure subroutine begin(self, n_constraint)
      type(newton_t), intent(inout) :: self
      integer, intent(in) :: n_constraint

      if (allocated(self%dlam)) then
         if (size(self%dlam) /= n_constraint) deallocate(self%dlam)
      end if
      if (.not. allocated(self%dlam)) allocate(self%dlam(n_constraint), source=0.0_wp)
      call convergence_begin(self%convergence)
      self%n_solve = 0
      self%work = 0.0_wp
      self%line%is_on = .false.
   end subroutine begin

   !> Factorise for the present tangent.
   subroutine factorise(self, system, set, status, error)
      type(newton_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: set
      integer, intent(out) :: status
      type(error_t), allocatable, intent(out) :: error
      logical :: is_singular
      integer(int64) :: before
      integer :: left

      call phase_enter(system%phases, phase_factorise, left)
      before = correction_ticks(self%correction)
      call correction_factorise(self%correction, system, set, is_singular, error)
      call phase_move(system%phases, phase_factorise, phase_eliminate, &
         correction_ticks(self%correction) - before)
      call phase_leave(system%phases, left)
      system%phases%n_factorisation = system%phases%n_factorisation + 1
      self%convergence%n_iteration = self%convergence%n_iteration + 1
      status = merge(newton_singular, newton_converged, is_singular)
   end subroutine factorise

   !> Correct the motion and the multipliers for the present residual.
   subroutine correct(self, system, set, motion, error)
      type(newton_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(inout) :: motion
      type(error_t), allocatable, intent(out) :: error
      integer :: left

      call phase_enter(system%phases, phase_solve, left)
      call correction_solve(self%correction, set, self%residual, self%dq, self%dlam, error, &
         convergence_accuracy(self%convergence))
      call phase_leave(system%phases, left)
      if (allocated(error)) return
      system%phases%n_solve = system%phases%n_solve + 1
      self%n_solve = self%n_solve + 1
      if (set%n > set%n_linear .and. .not. self%convergence%is_polish) then
         if (evaluation_is_equilibrium(motion%evaluation)) self%work = self%convergence%damping &
            *line_search_work(dot_product(self%dq, self%residual), &
            correction_work(self%correction, self%dq))
         self%dq = self%convergence%damping*self%dq
         self%dlam = self%convergence%damping*self%dlam
      end if
      call add_to_dofs(system%space%numbering, self%dq, 1.0_wp, motion%du)
      set%lam = set%lam + self%dlam
   end subroutine correct

   !> First correction: what the prescribed motion does by the tangent at its start. Elements at
   !> driven nodes would be squeezed if these moved alone.
   subroutine start_driven(self, system, set, motion, status, error)
      type(newton_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      call system_tangent_times(system, motion, self%driven, self%contact)
      call pick_unknowns(system%space%numbering, self%contact, self%scale)
      self%residual = self%residual + self%scale
      do k = 1, set%n_row
         set%defect(k) = set%defect(k) + condition_rate(set%item(set%condition(k)), self%driven, &
            set%slip(k))
      end do
      call factorise(self, system, set, status, error)
      if (allocated(error) .or. status /= newton_converged) return
      call correct(self, system, set, motion, error)
      self%work = 0.0_wp
      motion%du = motion%du + self%driven
   end subroutine start_driven

   !> Forces and constraints; the last correction is halved as long as there are none.
   subroutine evaluate_damped(self, system, set, motion, with_tangent, status, error)
      type(newton_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(inout) :: motion
      logical, intent(in) :: with_tangent        !! else the matrix is left as it is
      integer, intent(out) :: status
      type(error_t), allocatable, intent(out) :: error
      logical :: leaves_second
      integer :: i, left

      status = newton_refused
      do i = 0, most_halvings
         call motion_evaluate(motion)
         call system_respond(system, motion, with_tangent, .not. self%convergence%knows_sizes)
         if (allocated(system%response%failure)) allocate(error, source=system%response%failure)
         if (allocated(error)) return
         if (.not. allocated(system%response%refusal)) exit
         if (i == most_halvings .or. self%n_solve == 0) return
         self%dq = 0.5_wp*self%dq
         self%work = 0.5_wp*self%work
         self%line%is_on = .false.
         call add_to_dofs(system%space%numbering, self%dq, -1.0_wp, motion%du)
      end do
      status = newton_converged
      call phase_enter(system%phases, phase_gaps, left)
      if (set%n_condition > 0) then
         leaves_second = .not. with_tangent
         if (self%convergence%is_kept) leaves_second &
            = .not. (factor_policy_looks(self%factor_policy) &
            .and. kept_factor_has_room(self%correction%kept, set%n_row, size(system%matrix%column)))
         call constraints_evaluate(set, system, motion, leaves_second)
         call constraints_rows(set, system%space%numbering)
      end if
      call phase_leave(system%phases, phase_eliminate)
      call correction_lay_out(self%correction, system, set, self%n_solve > 0 &
         .and. self%convergence%is_kept .and. self%correction%kept%blocks%is_incomplete)
      call phase_leave(system%phases, left)
   end subroutine evaluate_damped

   !> Residual with contact forces, its size relative to its contributions, and the largest gap
   !> defect relative to the edge.
   subroutine measure(self, system, set, motion, norm, defect, is_rounding)
      type(newton_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(inout) :: set
      type(motion_t), intent(in) :: motion       !! they are of
      real(wp), intent(out) :: norm, defect
      logical, intent(out) :: is_rounding        !! nothing but round-off is left
      integer :: k, left

      call newton_pick_residual(self, system, set)
      call phase_enter(system%phases, phase_eliminate, left)
      if (self%correction%uses_null_space .or. self%convergence%is_kept) then
         call correction_multipliers(self%correction, system, set, self%residual)
      end if
      call constraints_take_hold(set)
      call phase_leave(system%phases, left)
      call newton_measure_forces(self, system, set, motion)
      norm = relative_size(self%residual, self%forces)
      is_rounding = relative_size(self%residual, self%rounding) <= round_off
      defect = 0.0_wp
      do k = 1, set%n_row
         defect = max(defect, abs(set%defect(k))/set%item(set%condition(k))%size)
         if (is_rounding) is_rounding = abs(set%defect(k)) &
            <= round_off*constraints_rounding(set, motion, k)
      end do
      if (set%penalty%is_under_way) call measure_lack(self, system, set, norm, is_rounding)
      ! A body that moves as a rigid one has no forces to compare its round-off with.
      call newton_find_idle(self, system, is_rounding)
      if (.not. self%is_idle) is_rounding = is_rounding .and. norm <= most_rounding
   end subroutine measure

   !> The residual with the forces of the set as they are, and what it is to be measured by where
   !> the sizes of forces are known.
   subroutine newton_measure_forces(self, system, set, motion)
      type(newton_t), intent(inout) :: self
      type(system_t), intent(inout) :: system    !! it has responded
      type(constraint_set_t), intent(in) :: set  !! evaluated
      type(motion_t), intent(in) :: motion       !! they are of

      if (system%response%with_sizes) then
         call constraints_force(set, 1, self%contact, system%response%magnitude)
         call constraints_add_rounding(set, motion, system%response%rounding)
         call take_sizes(self, system)
      else
         call constraints_force(set, 1, self%contact)
      end if
      if (set%n_condition > 0) then
         call vector_sum(size(self%left), system%response%residual, -1.0_wp, self%contact, &
            self%left)
         call pick_unknowns(system%space%numbering, self%left, self%residual)
      end if
   end subroutine newton_measure_forces

   !> The residual without the forces of rows, which those of laws beside them are a part of.
   subroutine newton_pick_residual(self, system, set)
      type(newton_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      logical :: are_some                        ! forces of laws

      call vector_zero(size(self%contact), self%contact)
      call constraints_add_law_forces(set, self%contact, are_some)
      if (.not. are_some) then
         call pick_unknowns(system%space%numbering, system%response%residual, self%residual)
         return
      end if
      call vector_sum(size(self%left), system%response%residual, -1.0_wp, self%contact, self%left)
      call pick_unknowns(system%space%numbering, self%left, self%residual)
   end subroutine newton_pick_residual

   !> What multipliers under way lack is measured as the residual is: where nothing else acts yet
   !> by its own forces.
   subroutine measure_lack(self, system, set, norm, is_rounding)
      type(newton_t), intent(inout) :: self
      type(system_t), intent(inout) :: system    !! it has responded
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(inout) :: norm
      logical, intent(inout) :: is_rounding

      call vector_zero(size(self%left), self%left)
      if (system%response%with_sizes) then
         call constraints_add_row_forces(set, set%penalty%lack, self%left, &
            system%response%magnitude)
         call take_sizes(self, system)
      else
         call constraints_add_row_forces(set, set%penalty%lack, self%left)
      end if
      call pick_unknowns(system%space%numbering, self%left, self%scale)
      norm = max(norm, relative_size(self%scale, self%forces))
      is_rounding = is_rounding .and. relative_size(self%scale, self%rounding) <= round_off
   end subroutine measure_lack

   !> What the residual is to be measured by.
   subroutine take_sizes(self, system)
      type(newton_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      call pick_magnitudes(system%space%numbering, system%response%magnitude, self%scale)
      self%forces = yardstick_of(self%scale)
      call pick_magnitudes(system%space%numbering, system%response%rounding, self%scale)
      self%rounding = yardstick_of(self%scale)
   end subroutine take_sizes

   !> Does nothing but round-off move? No force but those of elements and contact acts on an
   !> unknown, and inertia is no more there than round-off of these.
   subroutine newton_find_idle(self, system, is_rounding)
      type(newton_t), intent(inout) :: self
      type(system_t), intent(in) :: system       !! it has responded
      logical, intent(in) :: is_rounding         !! nothing else is left of the residual

      self%is_idle = is_rounding
      if (.not. is_rounding) return
      associate (part => system%response%part, numbering => system%space%numbering)
         call pick_unknowns(numbering, part(role_external)%force, self%scale)
         self%is_idle = .not. any(abs(self%scale) > 0.0_wp)
         call pick_unknowns(numbering, part(role_inertia)%force, self%scale)
         self%is_idle = self%is_idle .and. .not. any(abs(self%scale) &
            > round_off*maxval(system%response%rounding))
      end associate
   end subroutine newton_find_idle

end module emcon_newton
