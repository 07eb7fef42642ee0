!> Conditions in space, with rows of a gap and of two slips: sticking, and sliding by Coulomb's law,
!> with a law from outside beside these, and without rows by that law alone. Values are quadratic in
!> places, so that gradients in the middle are discrete ones.
module test_condition_rows
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraint, only : condition_drag, condition_normal, condition_t, constraint_t, &
      contact_response_t
   use emcon_constraint_rows, only : constraints_add_curvature, constraints_merge_pattern, &
      constraints_rows
   use emcon_constraints, only : constraint_set_t, constraints_add_row_forces, &
      constraints_dissipated, constraints_evaluate, constraints_force, constraints_lam, &
      constraints_select, constraints_stick
   use emcon_contact_law, only : contact_law_t, contact_laws_add, contact_values_t, loss_damping
   use emcon_coulomb_law, only : contact_slides, coulomb_t, slip_status_t
   use emcon_csr, only : csr_from_entries, csr_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_of, motion_t
   use emcon_numbering, only : numbering_init, numbering_t
   use emcon_steps, only : prescribed_t
   use emcon_system, only : system_t
   use emcon_text, only : to_text
   use small_scenes, only : shake
   use sparse_samples, only : dense_of
   implicit none
   private
   public :: collect_condition_rows

   integer, parameter :: n_node = 6, n_local = 12, n_condition = 3
   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)
   real(wp), parameter :: small = epsilon(1.0_wp)**(1.0_wp/3.0_wp)

   !> Values a.q + q.B q/2 of four nodes each: 0 the gap, then slips.
   type, extends(constraint_t) :: curved_t
      real(wp) :: a(n_local, 0:2, n_condition) = 0.0_wp
      real(wp) :: b(n_local, n_local, 0:2, n_condition) = 0.0_wp
   contains
      procedure :: linearise
   end type curved_t

   !> A penalty that stores k/4 d^4 where it is closed at both ends of a step, and drag along the
   !> surface that differs by direction and falls with the gap.
   type, extends(contact_law_t) :: quartic_t
      real(wp) :: stiffness = 3.0_wp
      real(wp) :: drag(2, 2) = reshape([0.7_wp, 0.1_wp, -0.2_wp, 0.4_wp], [2, 2])
      real(wp) :: now = 0.0_wp
   contains
      procedure :: respond
      procedure :: stored
      procedure :: dissipated
   end type quartic_t

   !> One condition that sticks, one that slides, both with the law beside, one of the law alone.
   type :: trial_t
      type(system_t) :: system
      type(numbering_t) :: numbering
      type(constraint_set_t) :: set
      type(motion_t) :: motion
   end type trial_t

contains

   subroutine collect_condition_rows(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("rows are directions of forces, and what defects change by", test_rows), &
         test_case_t("forces fall by what the tangent gets", test_tangent), &
         test_case_t("forces take the work of their rows", test_work)]
   end subroutine collect_condition_rows

   pure subroutine linearise(self, wanted, motion, target, item)
      class(curved_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: target(:)
      type(condition_t), intent(inout) :: item(:)
      real(wp), dimension(n_local) :: q0, q1, at_mid, at_end
      integer :: k, i, s

      do k = 1, size(wanted)
         if (.not. allocated(item(k)%g)) allocate(item(k)%g(3, 4), item(k)%c(3, 4), &
            item(k)%h(n_local, n_local), item(k)%t(3, 4, 2), item(k)%t1(3, 4, 2), &
            item(k)%ht(n_local, n_local, 2))
         associate (to => item(k), a => self%a(:, :, wanted(k)), b => self%b(:, :, :, wanted(k)))
            to%n_node = 4
            to%n_slave = 2
            to%size = 1.0_wp
            to%node = [(wanted(k) + i, i = 0, 3)]
            q0 = reshape(motion%x(:, to%node) + motion%u0(:, to%node), [n_local])
            q1 = q0 + reshape(motion%du(:, to%node), [n_local])
            do s = 0, 2
               at_mid = a(:, s + 1) + matmul(b(:, :, s + 1), 0.5_wp*(q0 + q1))
               at_end = a(:, s + 1) + matmul(b(:, :, s + 1), q1)
               if (s == 0) then
                  to%gap0 = dot_product(a(:, 1) + matmul(b(:, :, 1), 0.5_wp*q0), q0) - target(k)
                  to%dgap = dot_product(at_mid, q1 - q0)
                  to%gap1 = to%gap0 + to%dgap
                  to%g = reshape(at_mid, [3, 4])
                  to%c = reshape(at_end, [3, 4])
                  to%h = 0.5_wp*b(:, :, 1)
               else
                  to%slip(s) = dot_product(at_mid, q1 - q0)
                  to%t(:, :, s) = reshape(at_mid, [3, 4])
                  to%t1(:, :, s) = reshape(at_end, [3, 4])
                  to%ht(:, :, s) = 0.5_wp*b(:, :, s + 1)
               end if
            end do
            if (to%is_mean) to%normal = condition_normal(to)
         end associate
      end do
   end subroutine linearise

   pure subroutine respond(self, at, response)
      class(quartic_t), intent(inout) :: self
      type(contact_values_t), intent(in) :: at
      type(contact_response_t), intent(inout) :: response

      self%now = at%gap1
      associate (k => 0.25_wp*self%stiffness, g0 => at%gap0, g1 => at%gap1)
         response%lam = -k*(g0 + g1)*(g0**2 + g1**2)
         response%stiffness(0, 0) = k*(g0**2 + 2.0_wp*g0*g1 + 3.0_wp*g1**2)
      end associate
      response%stiffness(1:, 1:) = at%frequency*(1.0_wp - at%gap1)*self%drag
      response%stiffness(1:, 0) = -at%frequency*matmul(self%drag, at%slip)
      response%tau = matmul(response%stiffness(1:, 1:), at%slip)
   end subroutine respond

   pure real(wp) function stored(self)
      class(quartic_t), intent(in) :: self

      stored = 0.25_wp*self%stiffness*self%now**4
   end function stored

   pure real(wp) function dissipated(self, at, response)
      class(quartic_t), intent(in) :: self
      type(contact_values_t), intent(in) :: at
      type(contact_response_t), intent(in) :: response

      dissipated = dot_product(response%tau, at%slip)
   end function dissipated

   subroutine begin(trial)
      type(trial_t), intent(out) :: trial
      type(curved_t) :: curved
      type(prescribed_t) :: none(0)
      type(coulomb_t) :: coulomb
      real(wp), dimension(3, n_node) :: x, u0, du
      integer :: k, s

      do k = 1, n_condition
         call shake(curved%a(:, :, k), 1.0_wp)
         do s = 0, 2
            call shake(curved%b(:, :, s, k), 0.3_wp)
            curved%b(:, :, s, k) = curved%b(:, :, s, k) + transpose(curved%b(:, :, s, k))
         end do
      end do
      curved%n_constraint = n_condition
      associate (system => trial%system, set => trial%set)
         allocate(system%permanent(1), system%contact(0))
         allocate(system%permanent(1)%constraint, source=curved)
         system%n_constraint = n_condition
         system%first_constraint = [n_condition]
         call numbering_init(trial%numbering, spread(spread(.true., 1, 3), 2, n_node), none)
         call constraints_select(set, [1, 2], by_law=[3])
         set%item%has_friction = .true.
         set%item(2)%is_mean = .true.
         coulomb%mu = 0.25_wp
         coulomb%status = slip_status_t(contact_slides, [0.6_wp, -0.8_wp])
         call contact_laws_add(set%law(2), coulomb)
         do k = 1, 3
            call contact_laws_add(set%law(k), quartic_t())
         end do
         set%target(3) = 8.0_wp                  ! it is closed
         call constraints_stick(set, [1], reshape([-0.4_wp, 0.9_wp], [2, 1]))
         set%lam(:2) = [1.3_wp, 0.8_wp]
      end associate
      call shake(x, 1.0_wp)
      call shake(u0, 0.1_wp)
      call shake(du, 0.1_wp)
      trial%motion = motion_of(evaluation_t(mass_scale=10.0_wp), x, u0, du)
      call constraints_evaluate(trial%set, trial%system, trial%motion)
      call constraints_rows(trial%set, trial%numbering)
   end subroutine begin

   !> The set over a motion that ends with freedom `dof` elsewhere by `way`.
   subroutine move(trial, dof, way, set)
      type(trial_t), intent(inout) :: trial
      integer, intent(in) :: dof
      real(wp), intent(in) :: way
      type(constraint_set_t), intent(out) :: set
      type(motion_t) :: motion

      set = trial%set
      motion = trial%motion
      associate (du => motion%du(1 + mod(dof - 1, 3), 1 + (dof - 1)/3))
         du = du + way
      end associate
      call constraints_evaluate(set, trial%system, motion)
   end subroutine move

   subroutine test_rows(error)
      type(error_t), allocatable, intent(out) :: error
      type(trial_t) :: trial
      type(constraint_set_t) :: plus, minus
      real(wp) :: force(3, n_node), slope(4)
      real(wp), allocatable :: rows(:, :)
      integer :: i

      call begin(trial)
      call check_equal(error, trial%set%condition, [1, 2, 1, 1], "conditions of rows")
      call check_equal(error, trial%set%slip, [0, 0, 1, 2], "their slips")
      force = 0.0_wp
      call constraints_add_row_forces(trial%set, trial%set%lam(:2), force)
      rows = real(dense_of(trial%set%force_rows), wp)
      call check_near(error, matmul(trial%set%lam, rows(:, [trial%numbering%unknown])), &
         [force], 16.0_wp*real(epsilon(1.0_dp), wp), 10.0_wp, "forces")
      rows = real(dense_of(trial%set%gap_rows), wp)
      do i = 1, size(force)
         call move(trial, i, small, plus)
         call move(trial, i, -small, minus)
         slope = (plus%defect - minus%defect)/(2.0_wp*small)
         call check_near(error, slope, rows(:, trial%numbering%unknown(1 + mod(i - 1, 3), &
            1 + (i - 1)/3)), 16.0_wp*small**2, 10.0_wp, "defects by freedom " // to_text(i))
      end do
   end subroutine test_rows

   !> Central differences, exact but for their square and for rounding over it.
   subroutine test_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      type(trial_t) :: trial
      type(constraint_set_t) :: plus, minus
      type(csr_t) :: base, merged
      integer, allocatable :: slot(:)
      real(wp), dimension(3, n_node) :: more, less
      real(wp), allocatable :: tangent(:, :)
      real(wp) :: worst
      integer :: i

      call begin(trial)
      associate (n => trial%numbering%n_unknown)
         call csr_from_entries(base, n, n, [(i, i = 1, n)], [(i, i = 1, n)], slot)
      end associate
      call constraints_merge_pattern(trial%set, base, merged, slot)
      call constraints_add_curvature(trial%set, trial%numbering, merged)
      tangent = real(dense_of(merged), wp)
      tangent = tangent([trial%numbering%unknown], [trial%numbering%unknown])
      worst = 0.0_wp
      do i = 1, size(more)
         call move(trial, i, small, plus)
         call move(trial, i, -small, minus)
         call constraints_force(plus, 1, more)
         call constraints_force(minus, 1, less)
         worst = max(worst, maxval(abs([less - more]/(2.0_wp*small) - tangent(:, i))))
      end do
      call check_true(error, worst < 100.0_wp*max(small**2, real(epsilon(1.0_dp), wp)) &
         *maxval(abs(tangent)), "differences: " // to_text(worst/maxval(abs(tangent))))
   end subroutine test_tangent

   subroutine test_work(error)
      type(error_t), allocatable, intent(out) :: error
      type(trial_t) :: trial
      real(wp) :: force(3, n_node), work, before
      integer :: k

      call begin(trial)
      associate (set => trial%set)
         call constraints_force(set, 1, force)
         work = 0.0_wp
         do k = 1, 2
            work = work + (constraints_lam(set, k) + set%item(k)%response%lam)*set%item(k)%dgap &
               - dot_product(condition_drag(set%item(k), constraints_lam(set, k)), set%item(k)%slip)
         end do
         call check_true(error, set%item(3)%gap0 < 0.0_wp .and. set%item(3)%gap1 < 0.0_wp, "closed")
         before = 0.25_wp*3.0_wp*set%item(3)%gap0**4
         work = work + before - set%law(3)%beside(1)%law%stored() &
            - constraints_dissipated(set, 3, loss_damping)
         call check_near(error, sum(force*trial%motion%du), work, tol, before, "work")
      end associate
   end subroutine test_work

end module test_condition_rows
