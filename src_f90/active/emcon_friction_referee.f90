!> Which contacts act, stick and slide where sets that are tried one after the other come back.
!>
!> The step is linearised where it is. In forces and gaps of its contacts alone it is the problem of
!> emcon_friction_solve_plane, which has a solution for any coefficient and is solved by trials of
!> all contacts at once or by Lemke's method; Newton's method goes on with its set. Source:
!> docs/theory.md, section 4.13, eq. (14i).
module emcon_friction_referee
   use emcon_active_set, only : active_set_select, active_set_t, step_cycling, step_done
   use emcon_constraint, only : condition_row_gradient, condition_t
   use emcon_constraints, only : constraints_evaluate
   use emcon_correction, only : correction_t
   use emcon_errors, only : error_t
   use emcon_flexibility, only : flexibility_free, flexibility_make, flexibility_move, &
      flexibility_row, flexibility_t
   use emcon_coulomb_law, only : contact_open, contact_trial_t, slip_status_t
   use emcon_friction_solve_plane, only : friction_problem_t, friction_solve
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_evaluate, motion_t
   use emcon_numbering, only : numbering_t, pick_unknowns
   use emcon_system, only : system_respond, system_t
   implicit none
   private
   public :: friction_referee

   !> Asked so often in a step at most, with so many contacts at most.
   integer, parameter :: most_asked = 3, most_contacts = 100

contains

   !> Go on with the contacts that obey the laws where the step is linearised, of those that were in
   !> some set of the cycle; where there are none to be found the step stays cycling.
   subroutine friction_referee(self, system, motion, correction, is_done, status, error)
      type(active_set_t), intent(inout) :: self  !! all of the cycle act
      type(system_t), intent(inout) :: system
      type(motion_t), intent(inout) :: motion    !! of the last set that was solved
      type(correction_t), intent(in) :: correction
      logical, intent(inout) :: is_done          !! else solve the step again with the next set
      integer, intent(inout) :: status           !! `step_cycling`: to be looked at
      type(error_t), allocatable, intent(out) :: error
      type(friction_problem_t) :: problem
      type(flexibility_t) :: flexibility
      logical :: is_solved

      if (status /= step_cycling .or. self%penalty%is_on .or. self%only_adds) return
      if (.not. self%friction%is_on .or. self%friction%n_asked == most_asked) return
      self%n_tried = 0
      call active_set_select(self, system, motion)
      associate (n => self%set%n - self%set%n_permanent)
         if (n == 0 .or. n > most_contacts) return
      end associate
      call motion_evaluate(motion)
      call system_respond(system, motion, .true.)
      if (allocated(system%response%refusal) .or. allocated(system%response%failure)) return
      call constraints_evaluate(self%set, system, motion, .true.)
      call flexibility_make(flexibility, system, self%set, correction, error)
      if (.not. (allocated(error) .or. flexibility%is_singular)) then
         call condense(self, system, flexibility, problem, error)
         if (.not. allocated(error)) then
            call follow(self, problem, is_solved)
            if (is_solved) status = step_done
            is_done = .not. is_solved
         end if
      end if
      call flexibility_free(flexibility)
   end subroutine friction_referee

   !> Gaps and slips over forces: [g; -s] = [d; -r] + W [lam; tau].
   subroutine condense(self, system, flexibility, problem, error)
      type(active_set_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(flexibility_t), intent(inout) :: flexibility
      type(friction_problem_t), intent(out) :: problem
      type(error_t), allocatable, intent(out) :: error
      real(wp), dimension(system%space%numbering%n_unknown) :: force, displacement
      integer :: i, n, first

      first = self%set%n_permanent + 1
      n = self%set%n - self%set%n_permanent
      allocate(problem%w(2*n, 2*n), source=0.0_wp)
      associate (item => self%set%item(first:), id => self%set%id(first:self%set%n), &
            numbering => system%space%numbering)
         problem%mu = self%friction%law(id)%mu*item(:n)%normal
         problem%slip_target = self%friction%law(id)%slip_target(1)
         call pick_unknowns(numbering, system%response%residual, force)
         call flexibility_move(flexibility, -force, displacement, error)
         if (allocated(error)) return
         problem%gap = self%set%defect(first:self%set%n) + rates(numbering, item(:n), 0, &
            displacement)
         problem%slip = -rates(numbering, item(:n), 1, displacement)
         where (item(:n)%has_friction) problem%slip = problem%slip + item(:n)%slip(1)
         do i = 1, n
            call flexibility_move(flexibility, flexibility_row(numbering, item(i), item(i)%g), &
               displacement, error)
            if (allocated(error)) return
            problem%w(:n, i) = rates(numbering, item(:n), 0, displacement)
            problem%w(n + 1:, i) = rates(numbering, item(:n), 1, displacement)
            ! Without friction there is no slip to solve for: any one by itself.
            problem%w(n + i, n + i) = problem%w(i, i)
            if (.not. item(i)%has_friction) cycle
            call flexibility_move(flexibility, flexibility_row(numbering, item(i), &
               -item(i)%t(:, :, 1)), displacement, error)
            if (allocated(error)) return
            problem%w(:n, n + i) = rates(numbering, item(:n), 0, displacement)
            problem%w(n + 1:, n + i) = rates(numbering, item(:n), 1, displacement)
         end do
      end associate
   end subroutine condense

   !> What gaps change by over a motion, to first order, or slips, with the other sign; 0 without
   !> friction.
   pure function rates(numbering, item, slip, displacement) result(rate)
      type(numbering_t), intent(in) :: numbering
      type(condition_t), intent(in) :: item(:)   !! (n)
      integer, intent(in) :: slip                !! 0: of gaps
      real(wp), intent(in) :: displacement(:)    !! (n_unknown) [L]
      real(wp) :: rate(size(item))               !! (n) [L]
      integer :: i

      rate = 0.0_wp
      do i = 1, size(item)
         if (slip == 0 .or. item(i)%has_friction) rate(i) = dot_product(flexibility_row( &
            numbering, item(i), condition_row_gradient(item(i), slip)), displacement)
      end do
   end function rates

   !> The set that the problem ends with, and its forces to start from.
   subroutine follow(self, problem, is_solved)
      type(active_set_t), intent(inout) :: self
      type(friction_problem_t), intent(in) :: problem
      logical, intent(out) :: is_solved
      type(contact_trial_t) :: at(size(problem%mu))
      type(slip_status_t) :: status(size(problem%mu))
      logical :: fell_back
      integer :: i

      associate (id => self%set%id(self%set%n_permanent + 1:self%set%n), friction => self%friction)
         status = friction%law(id)%status
         call friction_solve(problem, status, at, is_solved, fell_back)
         if (.not. is_solved) return
         friction%n_asked = friction%n_asked + 1
         self%is_active(id) = status%kind /= contact_open
         self%lam(id) = at%lam
         friction%tau(1, id) = at%tau(1)
         friction%is_idle(id) = .false.
         friction%is_needed(id) = .false.
         do i = 1, size(id)
            if (status(i)%kind /= contact_open) friction%law(id(i))%status = status(i)
         end do
      end associate
      self%comes_and_goes = .false.
   end subroutine follow

end module emcon_friction_referee
