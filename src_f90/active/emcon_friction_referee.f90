!> Which contacts act, stick and slide where sets that are tried one after the other come back.
!>
!> The step is linearised where it is. In forces and gaps of its contacts alone it is the problem of
!> emcon_contact_problem; Newton's method goes on with its set. Source: docs/theory.md, section
!> 4.13, eq. (14i).
module emcon_friction_referee
   use emcon_active_set, only : active_set_select, active_set_t, step_cycling, step_done
   use emcon_constraint, only : condition_row_gradient, condition_t
   use emcon_constraints, only : constraints_evaluate
   use emcon_correction, only : correction_t
   use emcon_errors, only : error_t
   use emcon_flexibility, only : flexibility_free, flexibility_make, flexibility_move, &
      flexibility_row, flexibility_t
   use emcon_contact_problem, only : contact_effort_t, contact_problem_create, &
      contact_problem_solve, contact_problem_status, contact_problem_t
   use emcon_coulomb_law, only : contact_open, slip_status_t
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
      type(contact_problem_t) :: problem
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

   !> Gaps and slips over forces: [g; -s] = free + W [lam; tau].
   subroutine condense(self, system, flexibility, problem, error)
      type(active_set_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(flexibility_t), intent(inout) :: flexibility
      type(contact_problem_t), intent(out) :: problem
      type(error_t), allocatable, intent(out) :: error
      real(wp), dimension(system%space%numbering%n_unknown) :: force, displacement
      integer :: i, k, n, m, first

      first = self%set%n_permanent + 1
      n = self%set%n - self%set%n_permanent
      m = size(system%space%numbering%unknown, 1)
      call contact_problem_create(problem, m - 1, n)
      associate (item => self%set%item(first:), law => self%friction%law(self%set%id(first:)), &
            numbering => system%space%numbering)
         call pick_unknowns(numbering, system%response%residual, force)
         call flexibility_move(flexibility, -force, displacement, error)
         if (allocated(error)) return
         problem%free = reshape(rates(numbering, item(:n), displacement), [m, n])
         problem%free(0, :) = problem%free(0, :) + self%set%defect(first:self%set%n)
         do i = 1, n
            do k = 0, m - 1
               ! Without friction there is no slip to solve for: any one by itself.
               if (k > 0 .and. .not. item(i)%has_friction) then
                  problem%w(m*(i - 1) + 1 + k, m*(i - 1) + 1 + k) = problem%w(m*(i - 1) + 1, &
                     m*(i - 1) + 1)
                  cycle
               end if
               call flexibility_move(flexibility, push_of(numbering, item(i), k), displacement, &
                  error)
               if (allocated(error)) return
               problem%w(:, m*(i - 1) + 1 + k) = rates(numbering, item(:n), displacement)
            end do
            if (.not. item(i)%has_friction) cycle
            problem%mu(i) = law(i)%mu*item(i)%normal
            problem%slip_target(:, i) = law(i)%slip_target(:m - 1)
            problem%free(1:, i) = problem%free(1:, i) - item(i)%slip(:m - 1)
         end do
      end associate
   end subroutine condense

   !> What a force of size 1 of one contact pushes the unknowns by: along its normal, or friction.
   pure function push_of(numbering, item, k) result(push)
      type(numbering_t), intent(in) :: numbering
      type(condition_t), intent(in) :: item
      integer, intent(in) :: k                   !! the slip that friction is against; 0: normal
      real(wp) :: push(numbering%n_unknown)

      if (k == 0) push = flexibility_row(numbering, item, item%g)
      if (k > 0) push = flexibility_row(numbering, item, -item%t(:, :, k))
   end function push_of

   !> What gaps, and slips the other way round, change by over a motion, to first order: contact by
   !> contact; slips 0 without friction.
   pure function rates(numbering, item, displacement) result(rate)
      type(numbering_t), intent(in) :: numbering
      type(condition_t), intent(in) :: item(:)   !! (n)
      real(wp), intent(in) :: displacement(:)    !! (n_unknown) [L]
      real(wp) :: rate(size(numbering%unknown, 1)*size(item))   !! [L]
      integer :: i, k, n_dim

      rate = 0.0_wp
      n_dim = size(numbering%unknown, 1)
      do i = 1, size(item)
         associate (at => n_dim*(i - 1) + 1)
            do k = 0, merge(n_dim - 1, 0, item(i)%has_friction)
               rate(at + k) = dot_product(flexibility_row(numbering, item(i), &
                  condition_row_gradient(item(i), k)), displacement)
            end do
         end associate
      end do
   end function rates

   !> The set that the problem ends with, and its forces to start from.
   subroutine follow(self, problem, is_solved)
      type(active_set_t), intent(inout) :: self
      type(contact_problem_t), intent(in) :: problem
      logical, intent(out) :: is_solved
      type(contact_effort_t) :: effort
      type(slip_status_t) :: status(size(problem%mu))
      real(wp) :: force(0:problem%n_slip, size(problem%mu))
      integer :: i

      associate (id => self%set%id(self%set%n_permanent + 1:self%set%n), friction => self%friction)
         force(0, :) = self%lam(id)
         force(1:, :) = friction%tau(:problem%n_slip, id)
         call contact_problem_solve(problem, force, effort, is_solved)
         if (.not. is_solved) return
         friction%n_asked = friction%n_asked + 1
         self%lam(id) = force(0, :)
         friction%tau(:problem%n_slip, id) = force(1:, :)
         friction%is_idle(id) = .false.
         friction%is_needed(id) = .false.
         status = contact_problem_status(problem, force)
         do i = 1, size(id)
            if (status(i)%kind /= contact_open) friction%law(id(i))%status = status(i)
         end do
         self%is_active(id) = status%kind /= contact_open
      end associate
      self%comes_and_goes = .false.
   end subroutine follow

end module emcon_friction_referee
