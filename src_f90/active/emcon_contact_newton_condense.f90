!> A step condensed to its contacts: their problem from the tangent of an iterate or from a factor
!> that is kept, the forces that obey the laws in it, and the correction that these make.
!>
!> Source: docs/theory.md, eq. (14i).
module emcon_contact_newton_condense
   use emcon_condensation, only : condensation_make, condensation_move, condensation_renew, &
      condensation_take
   use emcon_constraints, only : constraint_set_t, constraints_normals
   use emcon_contact_newton_type, only : contact_newton_t
   use emcon_contact_parts, only : contact_parts_solve
   use emcon_contact_problem, only : contact_effort_t, contact_problem_force, &
      contact_problem_status
   use emcon_contact_rest, only : contact_rest_gather
   use emcon_early_set, only : early_enough
   use emcon_errors, only : error_t
   use emcon_factor_policy, only : factor_policy_provide
   use emcon_friction, only : friction_stiffness
   use emcon_kept_factor, only : kept_factor_may_condense
   use emcon_kinds, only : wp
   use emcon_mixed_step, only : mixed_step_mix
   use emcon_motion, only : motion_t
   use emcon_newton, only : newton_converged, newton_diverged, newton_singular, newton_t
   use emcon_phases, only : phase_eliminate, phase_enter, phase_factorise, phase_leave
   use emcon_system, only : system_t
   implicit none
   private
   public :: contact_newton_condense, contact_newton_condense_kept, contact_newton_correct

   !> After so many iterates without half of the best size the curvature of contacts is left out of
   !> the tangent for as many, and so on in turn.
   integer, parameter :: stall_turn = 7
   !> After so many the laws are met as they are linearised, however far the forces are that do so.
   integer, parameter :: exact_turn = 3
   !> Parts of its W by which a row gives way where the condensed problem has no solution, in turn;
   !> by the last ones an iterate goes a part of the way only.
   real(wp), parameter :: softer(*) = [1.0e-7_wp, 1.0e-5_wp, 1.0e-3_wp, 1.0e-1_wp, 10.0_wp]

contains

   !> The contacts in their multipliers alone, and those that obey the laws there. Where none do the
   !> curvature of the rows is left out: without it W is that of a body which is pushed.
   subroutine contact_newton_condense(self, newton, system, set, status, error)
      type(contact_newton_t), intent(inout) :: self
      type(newton_t), intent(inout) :: newton
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(inout) :: set
      integer, intent(out) :: status             !! one of the `newton_` codes
      type(error_t), allocatable, intent(out) :: error
      logical :: is_solved, has_curvature
      integer :: left, turn

      do turn = 1, 2
         has_curvature = .not. btest(self%rest%n_stall/stall_turn, 0)
         call phase_enter(system%phases, phase_factorise, left)
         if (turn == 1 .and. self%keeps_tangent) then
            call condensation_renew(self%condensation, set, newton%residual, error)
            call phase_leave(system%phases, phase_eliminate)
         else
            call find_hold(self, system, set)
            call condensation_make(self%condensation, system, set, newton%correction, &
               newton%residual, has_curvature, error)
            call phase_leave(system%phases, phase_eliminate)
            system%phases%n_factorisation = system%phases%n_factorisation + 1
            newton%convergence%n_iteration = newton%convergence%n_iteration + 1
            self%has_tangent = .not. (allocated(error) .or. self%condensation%is_singular)
            self%is_condensed = self%has_tangent
         end if
         status = newton_singular
         if (allocated(error) .or. self%condensation%is_singular) return
         call solve_condensed(self, set, newton%n_solve > 0, is_solved)
         call phase_leave(system%phases, left)
         if (is_solved .or. .not. has_curvature) exit
         self%rest%n_stall = stall_turn
      end do
      status = merge(newton_converged, newton_diverged, is_solved)
      if (is_solved) self%status = contact_problem_status(self%problem, self%push)
   end subroutine contact_newton_condense

   !> The same by a factor that is kept.
   subroutine contact_newton_condense_kept(self, newton, system, set, motion, is_found, error)
      type(contact_newton_t), intent(inout) :: self
      type(newton_t), intent(inout) :: newton
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: set
      type(motion_t), intent(in) :: motion
      logical, intent(out) :: is_found           !! there is one, and it leads to forces
      type(error_t), allocatable, intent(out) :: error
      integer :: left

      call phase_enter(system%phases, phase_factorise, left)
      is_found = .true.
      associate (kept => newton%correction%kept)
         if (.not. kept%is_made) then
            call factor_policy_provide(newton%factor_policy, newton%correction, system, motion, &
               error)
            system%phases%n_factorisation = system%phases%n_factorisation + 1
         end if
         call phase_leave(system%phases, phase_eliminate)
         if (.not. allocated(error)) is_found = kept_factor_may_condense(kept, set%n_row)
         if (is_found .and. .not. allocated(error)) call condensation_take(self%condensation, &
            kept, set, newton%residual, .not. self%keeps_tangent, error)
      end associate
      is_found = is_found .and. .not. (allocated(error) .or. self%condensation%is_singular)
      self%is_condensed = is_found
      if (is_found) then
         newton%convergence%n_iteration = newton%convergence%n_iteration + 1
         if (.not. self%keeps_tangent) call find_hold(self, system, set)
         call solve_condensed(self, set, newton%n_solve > 0, is_found)
      end if
      if (is_found) self%status = contact_problem_status(self%problem, self%push)
      call phase_leave(system%phases, left)
   end subroutine contact_newton_condense_kept

   !> Forces that obey the laws as the step is condensed; softer where there are none. If slip has
   !> a direction and there was an iterate before they are first looked for near its forces, as long
   !> as that gains; then every other time far from those, where what follows from others leaves its
   !> limits.
   subroutine solve_condensed(self, set, is_near, is_solved)
      type(contact_newton_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      logical, intent(in) :: is_near             !! there was an iterate before
      logical, intent(out) :: is_solved
      type(contact_effort_t) :: effort
      integer :: level

      if (self%turns .and. is_near .and. .not. btest(self%rest%n_stall, 0)) then
         call lay_out(self, set)
         self%push = 0.0_wp
         call contact_parts_solve(self%problem, self%push, effort, is_solved, .true., self%slope, &
            .true.)
         if (is_solved) return
      end if
      do level = self%least_soft, size(softer)
         call lay_out(self, set)
         self%push = 0.0_wp
         if (level > 0) call soften(self, softer(level))
         call contact_parts_solve(self%problem, self%push, effort, is_solved, level > 0 .or. &
            self%rest%n_stall < exact_turn, self%slope)
         ! What was softened is laid out anew.
         if (level > 0) self%slope%stays = .false.
         if (is_solved) exit
      end do
      self%least_soft = min(level, 1)
   end subroutine solve_condensed

   !> In statics contacts may be all that holds a body: they are held as a tangent is factorised. A
   !> factor that is kept is without them.
   pure subroutine find_hold(self, system, set)
      type(contact_newton_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      integer :: k

      associate (problem => self%problem, first => set%n_permanent)
         do k = 1, size(problem%stiffness)
            problem%stiffness(k) = friction_stiffness(system, set%item(first + k))
         end do
         if (.not. self%holds .or. self%kept%is_on) return
         do k = first + 1, set%n_row
            self%condensation%hold(k) = problem%stiffness(set%condition(k) - first)
         end do
      end associate
   end subroutine find_hold

   !> The problem of the contacts as it was condensed. Without friction a contact has no slips to
   !> solve for: any one by itself. Where no slip is a row W is that of the last problem, with what
   !> was made of it, as long as the tangent is.
   subroutine lay_out(self, set)
      type(contact_newton_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      integer :: k, i, m, place(set%n_row - set%n_permanent)

      m = 1 + self%problem%n_slip
      self%slope%stays = self%slope%stays .and. self%keeps_tangent .and. m == 1
      associate (problem => self%problem, first => set%n_permanent, w => self%condensation%w)
         if (.not. self%slope%stays) problem%w = 0.0_wp
         problem%free = 0.0_wp
         call contact_rest_gather(set, set%lam, problem%base)
         call contact_rest_gather(set, self%condensation%hold, problem%hold)
         call contact_rest_gather(set, set%defect, problem%start)
         problem%start(1:, :) = problem%start(1:, :) - problem%slip_target
         place = m*(set%condition(first + 1:) - first - 1) + 1 + set%slip(first + 1:)
         do k = 1, size(w, 1)
            if (.not. self%slope%stays) problem%w(place, place(k)) = w(:, k)
            problem%free(set%slip(first + k), set%condition(first + k) - first) &
               = self%condensation%free(k)
         end do
         problem%free(1:, :) = problem%free(1:, :) - problem%slip_target
         do k = 1, size(self%status)
            associate (item => set%item(first + k), at => m*(k - 1) + 1)
               problem%mu(k) = self%law(k)%mu*item%normal
               do i = 1, merge(0, m - 1, item%has_friction)
                  problem%w(at + i, at + i) = problem%w(at, at)
                  problem%free(i, k) = 0.0_wp
                  problem%start(i, k) = 0.0_wp
               end do
            end associate
         end do
      end associate
   end subroutine lay_out

   !> Each row gives way by this part of its own W about the forces of the iterate before: what has
   !> no solution as it is linearised comes nearer by it, and where forces stand it changes nothing.
   pure subroutine soften(self, part)
      type(contact_newton_t), intent(inout) :: self
      real(wp), intent(in) :: part
      integer :: i, k, row

      do k = 1, size(self%status)
         do i = 0, self%problem%n_slip
            row = (1 + self%problem%n_slip)*(k - 1) + 1 + i
            self%problem%w(row, row) = self%problem%w(row, row) &
               + part*abs(self%problem%w(row, row))
         end do
      end do
   end subroutine soften

   !> The correction of the unknowns, and the multipliers after it.
   subroutine contact_newton_correct(self, newton, system, set, error)
      type(contact_newton_t), intent(inout) :: self
      type(newton_t), intent(inout) :: newton
      type(system_t), intent(inout) :: system
      type(constraint_set_t), intent(in) :: set
      type(error_t), allocatable, intent(out) :: error
      real(wp), dimension(0:self%problem%n_slip, size(self%status)) :: force
      real(wp) :: more(set%n_row - set%n_permanent), held(set%n_permanent)
      integer :: k

      self%step%old = set%lam
      self%step%normal = constraints_normals(set)
      force = contact_problem_force(self%problem, self%push)
      associate (first => set%n_permanent)
         do k = first + 1, set%n_row
            self%step%new(k) = force(set%slip(k), set%condition(k) - first)
            more(k - first) = self%push(set%slip(k), set%condition(k) - first)
         end do
         call condensation_move(self%condensation, newton%correction%kept, more, newton%dq, held, &
            error)
         if (allocated(error)) return
         self%step%new(:first) = self%step%old(:first) + held
      end associate
      call mix(self, newton)
      newton%n_solve = newton%n_solve + 1
      system%phases%n_solve = system%phases%n_solve + 1
   end subroutine contact_newton_correct

   !> Near the end what a factor that is kept leaves is mixed, where slip has a direction.
   subroutine mix(self, newton)
      type(contact_newton_t), intent(inout) :: self
      type(newton_t), intent(inout) :: newton
      integer :: k

      if (self%kept%is_on .and. self%rest%size <= early_enough) then
         call mixed_step_mix(self%step, maxval([(abs(self%problem%w(k, k)), k = 1, &
            size(self%problem%w, 1))]), newton%dq)
      else
         self%step%mixes = .false.
      end if
   end subroutine mix

end module emcon_contact_newton_condense
