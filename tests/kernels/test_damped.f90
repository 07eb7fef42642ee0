!> Forces of what is damped: what they take, that no rigid motion sees them, and their derivatives.
module test_damped
   use check, only : check_near, check_true, test_case_t
   use emcon_constraint, only : condition_stiffness
   use emcon_constraint_rows, only : constraint_dof
   use emcon_constraints, only : constraint_set_t, constraints_dissipated, constraints_evaluate, &
      constraints_force, constraints_select
   use emcon_contact_law, only : contact_laws_add, loss_damping
   use emcon_dashpot_law, only : dashpot_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_t
   use emcon_interactions, only : contact_damping_t, formulation_mortar, formulation_nts, &
      formulation_segment
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_of
   use emcon_scene, only : scene_t
   use emcon_system, only : system_begin_step, system_init, system_t
   use emcon_text, only : to_text
   use small_scenes, only : add_step, block_t, make_two_blocks, shake
   implicit none
   private
   public :: collect_damped

   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)
   !> All gaps of the tests lie where the coefficient falls.
   type(contact_damping_t), parameter :: law = contact_damping_t(2.0_wp, 0.25_wp, 0.1_wp, 0.7_wp)
   integer, parameter :: formulations(3) = [formulation_nts, formulation_segment, &
      formulation_mortar]

   !> A block over another one, and what is damped between them.
   type :: trial_t
      type(scene_t) :: scene
      type(system_t) :: system
      type(constraint_set_t) :: set
      real(wp), allocatable :: u0(:, :), du(:, :)
   end type trial_t

contains

   subroutine collect_damped(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("forces take the work that is told", test_work), &
         test_case_t("without resultant and moment in the middle of a step", test_rigid), &
         test_case_t("what they fall by is their derivative", test_tangent), &
         test_case_t("bodies that move as one have none", test_together)]
   end subroutine collect_damped

   !> All contacts of a scene of formulation number `k`, in a random motion of the size `size`.
   subroutine begin(self, k, size, error)
      type(trial_t), intent(out) :: self
      integer, intent(in) :: k                   !! into `formulations`
      real(wp), intent(in) :: size
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: lower, upper
      integer, allocatable :: none(:)
      integer :: i

      allocate(none(0))
      call make_two_blocks(self%scene, 0.125_wp, lower, upper)
      self%scene%pair%formulation = formulations(k)
      self%scene%pair%interaction%damping = law
      call add_step(self%scene, .false., 0.1_wp, 1)
      call system_init(self%system, self%scene, error)
      if (.not. allocated(error)) call system_begin_step(self%system, self%scene, 1, error)
      if (allocated(error)) return
      allocate(self%u0, self%du, source=0.0_wp*self%scene%x)
      call shake(self%u0, 0.01_wp)
      call shake(self%du, size)
      associate (contact => self%system%contact(1)%contact)
         call contact%begin_step(self%scene%x, self%u0, self%du)
         call contact%measure(self%scene%x, self%u0, self%du)
         call constraints_select(self%set, none, [(i, i = 1, contact%n_constraint)])
         self%set%item%has_friction = .true.
         do i = 1, contact%n_constraint
            self%set%target(i) = contact%state(i)%gap0
            call contact_laws_add(self%set%law(i), dashpot_t( &
               coefficients=law, area=0.5_wp, gap=contact%state(i)%gap0))
         end do
      end associate
   end subroutine begin

   !> The forces on all nodes over the motion `du`.
   subroutine find_forces(self, du, force)
      type(trial_t), intent(inout) :: self
      real(wp), intent(in) :: du(:, :)
      real(wp), intent(out) :: force(:, :)

      call constraints_evaluate(self%set, self%system, motion_of(evaluation_t(mass_scale=10.0_wp), &
         self%scene%x, self%u0, du))
      call constraints_force(self%set, 1, force)
   end subroutine find_forces

   subroutine test_work(error)
      type(error_t), allocatable, intent(out) :: error
      type(trial_t) :: trial
      real(wp), allocatable :: force(:, :)
      real(wp) :: work
      integer :: i, k

      do k = 1, size(formulations)
         call begin(trial, k, 0.05_wp, error)
         if (allocated(error)) return
         force = trial%du
         call find_forces(trial, trial%du, force)
         work = 0.0_wp
         do i = 1, trial%set%n_condition
            call check_true(error, constraints_dissipated(trial%set, i, loss_damping) > 0.0_wp, &
               "it takes something")
            work = work + constraints_dissipated(trial%set, i, loss_damping)
         end do
         call check_near(error, -sum(force*trial%du), work, tol, 1.0_wp, "work")
      end do
   end subroutine test_work

   subroutine test_rigid(error)
      type(error_t), allocatable, intent(out) :: error
      type(trial_t) :: trial
      real(wp), allocatable :: force(:, :), mid(:, :)
      integer :: k

      do k = 1, size(formulations)
         call begin(trial, k, 0.05_wp, error)
         if (allocated(error)) return
         force = trial%du
         call find_forces(trial, trial%du, force)
         mid = trial%scene%x + trial%u0 + 0.5_wp*trial%du
         call check_true(error, maxval(abs(force)) > 0.01_wp, "there are forces")
         call check_near(error, [sum(force, 2), sum(mid(1, :)*force(2, :) &
            - mid(2, :)*force(1, :))], [0.0_wp, 0.0_wp, 0.0_wp], tol, 1.0_wp, &
            "resultant and moment")
      end do
   end subroutine test_rigid

   !> Central differences, exact but for their square and for rounding over it.
   subroutine test_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: small = epsilon(1.0_wp)**(1.0_wp/3.0_wp)
      type(trial_t) :: trial
      real(wp), allocatable :: stiffness(:, :), plus(:, :), minus(:, :), moved(:, :)
      real(wp) :: worst
      integer :: k, i, a

      do k = 1, size(formulations)
         call begin(trial, k, 0.05_wp, error)
         if (allocated(error)) return
         plus = trial%du
         minus = trial%du
         call find_forces(trial, trial%du, plus)
         call gather(trial%set, size(plus), stiffness)
         worst = 0.0_wp
         do i = 1, size(plus, 2)
            do a = 1, 2
               moved = trial%du
               moved(a, i) = trial%du(a, i) + small
               call find_forces(trial, moved, plus)
               moved(a, i) = trial%du(a, i) - small
               call find_forces(trial, moved, minus)
               worst = max(worst, maxval(abs(reshape((minus - plus)/(2.0_wp*small), [size(plus)]) &
                  - stiffness(:, 2*(i - 1) + a))))
            end do
         end do
         call check_true(error, worst < 100.0_wp*small**2*maxval(abs(stiffness)), &
            "differences: " // to_text(worst/maxval(abs(stiffness))))
      end do
   end subroutine test_tangent

   !> The stiffness of all conditions over the freedoms.
   subroutine gather(set, n_dof, stiffness)
      type(constraint_set_t), intent(in) :: set
      integer, intent(in) :: n_dof
      real(wp), allocatable, intent(out) :: stiffness(:, :)
      real(wp), allocatable :: part(:, :)
      integer :: i, j, k

      allocate(stiffness(n_dof, n_dof), source=0.0_wp)
      do k = 1, set%n_condition
         part = condition_stiffness(set%item(k), 0.0_wp)
         do j = 1, size(part, 2)
            do i = 1, size(part, 1)
               associate (to => stiffness(constraint_dof(set%item(k), i), &
                     constraint_dof(set%item(k), j)))
                  to = to + part(i, j)
               end associate
            end do
         end do
      end do
   end subroutine gather

   !> A turn of everything by a finite angle, beside a shift.
   subroutine test_together(error)
      type(error_t), allocatable, intent(out) :: error
      type(trial_t) :: trial
      real(wp), allocatable :: force(:, :), x(:, :)
      real(wp), parameter :: c = cos(0.3_wp), s = sin(0.3_wp)
      integer :: k

      do k = 1, size(formulations)
         call begin(trial, k, 0.05_wp, error)
         if (allocated(error)) return
         x = trial%scene%x + trial%u0
         trial%du(1, :) = c*x(1, :) - s*x(2, :) + 0.4_wp - x(1, :)
         trial%du(2, :) = s*x(1, :) + c*x(2, :) - 0.1_wp - x(2, :)
         force = trial%du
         call find_forces(trial, trial%du, force)
         call check_near(error, maxval(abs(force)), 0.0_wp, tol, 10.0_wp, "forces")
      end do
   end subroutine test_together

end module test_damped
