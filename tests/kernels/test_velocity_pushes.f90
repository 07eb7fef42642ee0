!> Jumps of the velocities at the end of a step: rates of gaps that change, energies that forces
!> give, accelerations. Kinetic energies and momenta are found by the mass.
module test_velocity_pushes
   use check, only : check_near, check_true, test_case_t
   use emcon_contact_problem, only : contact_problem_create
   use emcon_constraint, only : condition_rate
   use emcon_constraints, only : constraint_set_t, constraints_evaluate, constraints_select
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_of
   use emcon_scene, only : scene_t
   use emcon_system, only : mass_times, system_begin_step, system_init, system_t
   use emcon_text, only : to_text
   use emcon_rate_jump, only : rate_jump_t, velocity_update_change
   use emcon_velocity_mass, only : velocity_update_free, velocity_update_reset, velocity_update_t
   use emcon_velocity_update, only : push_t, velocity_update_accelerate, &
      velocity_update_hold, velocity_update_push
   use small_scenes, only : add_step, block_t, clamp, make_two_blocks, shake
   implicit none
   private
   public :: collect_velocity_pushes

   real(wp), parameter :: tol = 1.0e3_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))

contains

   subroutine collect_velocity_pushes(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("rates of gaps change as asked for", test_change), &
         test_case_t("beside one that rubs and sticks", test_stick), &
         test_case_t("and stops, while pushes stay", test_stop), &
         test_case_t("no jump that would give energy", test_gain), &
         test_case_t("no energy but what solves leave", test_uncertain), &
         test_case_t("a force gives or takes an energy", test_push), &
         test_case_t("rates of what always holds are taken out", test_hold), &
         test_case_t("nothing is taken out of what cannot be held", test_not_held), &
         test_case_t("forces accelerate what is free", test_accelerate), &
         test_case_t("and what conditions bend", test_bend)]
   end subroutine collect_velocity_pushes

   !> Two blocks in touch at three nodes, free or the lower one clamped at its bottom.
   subroutine begin(system, set, v, x, is_clamped, error)
      type(system_t), intent(out) :: system
      type(constraint_set_t), intent(out) :: set
      real(wp), allocatable, intent(out) :: v(:, :), x(:, :)
      logical, intent(in) :: is_clamped
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      integer :: i

      call make_two_blocks(scene, 0.0_wp, lower, upper)
      call add_step(scene, .false., 0.1_wp, 1)
      if (is_clamped) call clamp(scene%step(1), [(i, i = 1, 5)])
      call system_init(system, scene, error)
      if (.not. allocated(error)) call system_begin_step(system, scene, 1, error)
      if (allocated(error)) return
      x = scene%x
      allocate(v, source=0.0_wp*x)
      call system%contact(1)%contact%begin_step(x, v, v)
      call constraints_select(set, [1, 2, 3])
      call constraints_evaluate(set, system, motion_of(evaluation_t(), x, v, v))
      call shake(v, 0.1_wp)
      if (is_clamped) v(:, :5) = 0.0_wp
      v(2, 11:) = v(2, 11:) + 1.0_wp
   end subroutine begin

   real(wp) function energy_of(system, v) result(energy)
      type(system_t), intent(in) :: system
      real(wp), intent(in), contiguous :: v(:, :)
      real(wp) :: p(2, size(v, 2))

      call mass_times(system, v, p)
      energy = 0.5_wp*sum(v*p)
   end function energy_of

   !> px, py and the moment about the origin.
   function momenta_of(system, v, x) result(momenta)
      type(system_t), intent(in) :: system
      real(wp), intent(in), contiguous :: v(:, :), x(:, :)
      real(wp) :: momenta(3), p(2, size(v, 2))

      call mass_times(system, v, p)
      momenta = [sum(p, 2), sum(x(1, :)*p(2, :) - x(2, :)*p(1, :))]
   end function momenta_of

   !> Rates of the gaps, whose gradients are those of the first nodes of conditions and of others.
   pure function rates_of(set, v) result(rate)
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in) :: v(:, :)
      real(wp) :: rate(3)
      integer :: k

      do k = 1, 3
         associate (item => set%item(k))
            rate(k) = sum(item%c(:, :item%n_node)*v(:, item%node(:item%n_node)))
         end associate
      end do
   end function rates_of

   subroutine test_change(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      do k = 1, 2
         call look_at_change(k == 2, error)
         if (allocated(error)) return
      end do
   end subroutine test_change

   subroutine look_at_change(is_clamped, error)
      logical, intent(in) :: is_clamped
      type(error_t), allocatable, intent(out) :: error
      type(system_t) :: system
      type(constraint_set_t) :: set
      type(velocity_update_t) :: update
      type(rate_jump_t) :: jump
      real(wp) :: rate(3), change(3)
      real(wp), allocatable :: v(:, :), v0(:, :), x(:, :)

      call begin(system, set, v, x, is_clamped, error)
      if (allocated(error)) return
      v0 = v
      rate = rates_of(set, v)
      change = -[0.5_wp, 0.0_wp, 0.25_wp]*rate
      call ask(jump, [1, 3], rate, change)
      call velocity_update_change(update, system, set, jump, v, error)
      if (allocated(error)) return
      call check_true(error, jump%is_done .and. minval(rate([1, 3])) > 0.0_wp, "bodies part")
      associate (now => rates_of(set, v))
         call check_near(error, now([1, 3]), rate([1, 3]) + change([1, 3]), tol, 1.0_wp, "rates")
      end associate
      call check_near(error, [jump%gained, -jump%lost], spread(energy_of(system, v) &
         - energy_of(system, v0), 1, 2), tol, 1.0_wp, "energy")
      if (is_clamped) then
         call check_near(error, v(:, :5), v0(:, :5), 0.0_wp, 1.0_wp, "what is held")
      else
         call check_near(error, momenta_of(system, v, x), momenta_of(system, v0, x), tol, 1.0_wp, &
            "momenta")
      end if
      call velocity_update_free(update)
   end subroutine look_at_change

   !> Conditions `row` whose rates change by `change`, while impulses of 8 push them together.
   subroutine ask(jump, row, rate, change)
      type(rate_jump_t), intent(out) :: jump
      integer, intent(in) :: row(:)
      real(wp), intent(in) :: rate(3), change(3)

      jump%row = row
      call contact_problem_create(jump%problem, 0, size(row))
      allocate(jump%rate(0:0, size(row)), jump%taken(size(row)), source=0.0_wp)
      jump%rate(0, :) = rate(row)
      jump%problem%free(0, :) = -change(row)
      jump%problem%base(0, :) = 8.0_wp
   end subroutine ask

   !> Contact 2 sticks, far within its cone: what it has slid by is taken out along the surface, as
   !> asked; contacts 1 and 3 without friction push along normals alone.
   subroutine test_stick(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: slide = 0.125_wp
      type(system_t) :: system
      type(constraint_set_t) :: set
      type(velocity_update_t) :: update
      type(rate_jump_t) :: jump
      real(wp) :: rate(3), slip
      real(wp), allocatable :: v(:, :), v0(:, :), x(:, :)

      call begin(system, set, v, x, .false., error)
      if (allocated(error)) return
      set%item(2)%has_friction = .true.
      call constraints_evaluate(set, system, motion_of(evaluation_t(), x, 0.0_wp*v, 0.0_wp*v))
      v0 = v
      rate = rates_of(set, v)
      slip = condition_rate(set%item(2), v, 1)
      jump%row = [1, 2, 3]
      call contact_problem_create(jump%problem, 1, 3)
      allocate(jump%rate(0:1, 3), jump%taken(3), source=0.0_wp)
      jump%rate(0, :) = rate
      jump%rate(1, 2) = slip
      jump%problem%free(0, :) = 0.5_wp*rate
      jump%problem%free(1, 2) = slide
      jump%problem%base(0, :) = 8.0_wp
      jump%problem%mu(2) = 10.0_wp
      call velocity_update_change(update, system, set, jump, v, error)
      if (allocated(error)) return
      call check_true(error, jump%is_done, "it is taken")
      associate (now => rates_of(set, v))
         call check_near(error, now, 0.5_wp*rate, tol, 1.0_wp, "rates")
      end associate
      call check_near(error, condition_rate(set%item(2), v, 1), slip - slide, tol, 1.0_wp, "slips")
      call check_near(error, jump%impulse(1, [1, 3]), [0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, &
         "without friction")
      ! What sticks does no work.
      call check_near(error, jump%rubbed, [0.0_wp, 0.0_wp, 0.0_wp], tol, 1.0_wp, "friction")
      call check_true(error, abs(jump%impulse(1, 2)) > 1.0e-3_wp, "an impulse")
      call check_near(error, jump%gained, energy_of(system, v) - energy_of(system, v0), tol, &
         1.0_wp, "energy")
      call check_near(error, momenta_of(system, v, x), momenta_of(system, v0, x), tol, 1.0_wp, &
         "momenta")
      call velocity_update_free(update)
   end subroutine test_stick

   !> Contact 2 is stopped along the surface by friction alone; what pushes at the others, and pulls
   !> at one by round-off, stays, and friction takes all the energy that goes.
   subroutine test_stop(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: pull = -0.5_wp**20
      type(system_t) :: system
      type(constraint_set_t) :: set
      type(velocity_update_t) :: update
      type(rate_jump_t) :: jump
      real(wp) :: slip
      real(wp), allocatable :: v(:, :), v0(:, :), x(:, :)

      call begin(system, set, v, x, .false., error)
      if (allocated(error)) return
      set%item(2)%has_friction = .true.
      call constraints_evaluate(set, system, motion_of(evaluation_t(), x, 0.0_wp*v, 0.0_wp*v))
      v0 = v
      slip = condition_rate(set%item(2), v, 1)
      jump%row = [1, 2, 3]
      call contact_problem_create(jump%problem, 1, 3)
      allocate(jump%rate(0:1, 3), jump%taken(3), source=0.0_wp)
      allocate(jump%stopping)
      allocate(jump%stopping%stays(0:1, 3), source=.true.)
      jump%stopping%stays(1, 2) = .false.
      jump%stopping%slides = spread(.false., 1, 3)
      allocate(jump%stopping%rate(1, 3), jump%mean(1, 3), source=0.0_wp)
      jump%rate(1, 2) = slip
      jump%problem%free(1, 2) = slip
      jump%problem%base(0, :) = [8.0_wp, 8.0_wp, pull]
      jump%problem%mu(2) = 10.0_wp
      call velocity_update_change(update, system, set, jump, v, error)
      if (allocated(error)) return
      call check_true(error, jump%is_done .and. abs(slip) > 1.0e-3_wp, "it is taken")
      call check_near(error, condition_rate(set%item(2), v, 1), 0.0_wp, tol, 1.0_wp, "a stop")
      call check_near(error, pack(jump%impulse, jump%stopping%stays), spread(0.0_wp, 1, 5), &
         0.0_wp, 1.0_wp, &
         "pushes stay")
      call check_near(error, [jump%gained, -sum(jump%rubbed)], spread(energy_of(system, v) &
         - energy_of(system, v0), 1, 2), tol, 1.0_wp, "energy")
      call check_near(error, momenta_of(system, v, x), momenta_of(system, v0, x), tol, 1.0_wp, &
         "momenta")
      call velocity_update_free(update)
   end subroutine test_stop

   subroutine test_gain(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t) :: system
      type(constraint_set_t) :: set
      type(velocity_update_t) :: update
      type(rate_jump_t) :: jump
      real(wp) :: rate(3)
      real(wp), allocatable :: v(:, :), v0(:, :), x(:, :)

      call begin(system, set, v, x, .false., error)
      if (allocated(error)) return
      v0 = v
      rate = rates_of(set, v)
      call ask(jump, [1, 2, 3], rate, 0.5_wp*rate)
      call velocity_update_change(update, system, set, jump, v, error)
      if (allocated(error)) return
      call check_true(error, .not. jump%is_done .and. jump%lost < 0.0_wp, "it would give energy")
      call check_near(error, v, v0, 0.0_wp, 1.0_wp, "velocities")
      call velocity_update_free(update)
   end subroutine test_gain

   !> What is lost by a jump may be below 0 by the part of impulses times rates to which their
   !> problem is solved, and by no more. Friction that took so much in the step puts it there.
   subroutine test_uncertain(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: part(0:2) = [0.0_wp, 0.8_wp, 1.25_wp]
      type(system_t) :: system
      type(constraint_set_t) :: set
      type(velocity_update_t) :: update
      type(rate_jump_t) :: jump
      real(wp) :: rate(3), push, bar, lost
      real(wp), allocatable :: v(:, :), v0(:, :), x(:, :)
      integer :: k, i

      call begin(system, set, v, x, .false., error)
      if (allocated(error)) return
      v0 = v
      rate = rates_of(set, v)
      do i = 1, 2
         push = merge(8.0_wp, 0.0_wp, i == 1)
         do k = 0, 2
            v = v0
            call ask(jump, [1, 2, 3], rate, merge(-0.5_wp, 0.25_wp, i == 1)*rate)
            jump%problem%base(0, :) = push
            if (k > 0) jump%taken(1) = -(lost + part(k)*bar)
            call velocity_update_change(update, system, set, jump, v, error)
            if (allocated(error)) return
            if (k == 0) then
               lost = jump%lost
               ! Pushes above 0 open gaps faster, and give energy.
               call check_true(error, lost > 0.0_wp .eqv. i == 1, "it costs energy")
               bar = 1.0e4_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp)) &
                  *(push + maxval(abs(jump%impulse))) &
                  *(sum(abs(rate)) + 2.0_wp*sum(abs(jump%problem%free)))
            else
               call check_true(error, jump%is_done .eqv. k == 1, "part " // to_text(part(k)))
               call check_near(error, jump%lost/bar, -part(k), 0.1_wp, 1.0_wp, "what is lost")
            end if
         end do
      end do
      call velocity_update_free(update)
   end subroutine test_uncertain

   !> By the smaller of two jumps; more than there is along the force cannot be taken.
   subroutine test_push(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: gain(4) = [0.25_wp, -0.01_wp, -100.0_wp, 0.5_wp]
      integer :: k

      do k = 1, 4
         call look_at_push(gain(k), k < 4, merge(-1.0_wp, 1.0_wp, k == 2), error)
         if (allocated(error)) return
      end do
   end subroutine test_push

   subroutine look_at_push(gain, is_free, sense, error)
      real(wp), intent(in) :: gain, sense
      logical, intent(in) :: is_free
      type(error_t), allocatable, intent(out) :: error
      type(system_t) :: system
      type(constraint_set_t) :: set
      type(velocity_update_t) :: update
      real(wp), allocatable :: v(:, :), v0(:, :), x(:, :), force(:, :)
      real(wp) :: change(2), along(2, 16), p(2, 16)
      logical :: has_root

      call begin(system, set, v, x, .not. is_free, error)
      if (allocated(error)) return
      v0 = v
      allocate(force, source=0.0_wp*v)
      force(2, 14:) = sense
      force(2, 6:10) = -0.6_wp*sense
      call velocity_update_push(update, system, set, push_t(force, gain), v, has_root, error)
      if (allocated(error)) return
      call check_true(error, has_root .eqv. gain > -1.0_wp, "root")
      change = [energy_of(system, v) - energy_of(system, v0), merge(gain, 0.0_wp, has_root)]
      call check_near(error, change(1), change(2), tol, 1.0_wp, "energy by " // to_text(gain))
      along = v - v0
      if (.not. has_root) then
         call check_near(error, along, 0.0_wp*along, 0.0_wp, 1.0_wp, "no jump")
      else if (is_free) then
         call mass_times(system, along, p)
         call check_near(error, p, update%part*force, tol, 1.0_wp, "along the force")
         ! The other root of s b + s^2 a/2 = gain is -b/(a/2) less this one.
         call check_true(error, abs(update%part) <= abs(update%part + sum(v0*force) &
            /(0.5_wp*sum(along*force)/update%part)), "the smaller one")
      end if
      call velocity_update_free(update)
   end subroutine look_at_push

   !> Of three conditions the last two are such as rigid bodies have: their rates are 0 behind it,
   !> by impulses along them. What is lost is the energy of the jump, what is gained that of all:
   !> less so by what is driven.
   subroutine test_hold(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t) :: system
      type(constraint_set_t) :: set
      type(velocity_update_t) :: update
      real(wp), allocatable :: v(:, :), v0(:, :), x(:, :)
      real(wp) :: rate(3), p(2, 16), lost, gained, mean
      integer :: k

      do k = 1, 2
         call begin(system, set, v, x, k == 2, error)
         if (allocated(error)) return
         if (k == 2) v(1, :5) = 0.25_wp
         v0 = v
         set%n_linear = 1
         set%n_permanent = 3
         call velocity_update_hold(update, system, set, v, lost, gained, error)
         if (allocated(error)) return
         rate = rates_of(set, v)
         call check_near(error, rate(2:), [0.0_wp, 0.0_wp], tol, 1.0_wp, "rates")
         call check_true(error, abs(rate(1)) > 0.1_wp, "the linear one is another's")
         call mass_times(system, v - v0, p)
         call check_near(error, p(:, set%item(1)%node(1)), [0.0_wp, 0.0_wp], tol, 1.0_wp, &
            "impulses along them")
         call check_near(error, [lost, gained], [energy_of(system, v - v0), energy_of(system, v) &
            - energy_of(system, v0)], tol, 1.0_wp, "energies")
         mean = 0.5_wp*sum(p(:, :5)*(v(:, :5) + v0(:, :5)))
         call check_near(error, gained + lost, 2.0_wp*mean, tol, 1.0_wp, "what is driven")
         call check_true(error, lost > 0.01_wp, "some is lost")
         if (k == 1) call check_near(error, momenta_of(system, v, x), momenta_of(system, v0, x), &
            tol, 1.0_wp, "momenta")
         if (k == 2) call check_near(error, v(:, :5), v0(:, :5), 0.0_wp, 1.0_wp, "held")
         call velocity_update_reset(update, update%choice)
      end do
      update%is_ready = .true.
      call velocity_update_free(update)
      call check_true(error, .not. update%is_ready, "nothing is left")
   end subroutine test_hold

   !> Linear conditions hold anyway, and one that is there twice cannot be solved for.
   subroutine test_not_held(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t) :: system
      type(constraint_set_t) :: set
      type(velocity_update_t) :: update
      type(rate_jump_t) :: jump
      real(wp), allocatable :: v(:, :), v0(:, :), x(:, :)
      real(wp) :: lost, gained, rate(3)
      integer :: k

      call begin(system, set, v, x, .false., error)
      if (allocated(error)) return
      v0 = v
      set%item(3) = set%item(2)
      set%n_permanent = 3
      do k = 1, 2
         set%n_linear = merge(3, 1, k == 1)
         call velocity_update_hold(update, system, set, v, lost, gained, error)
         if (allocated(error)) return
         call check_near(error, [lost, gained], [0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "no energy")
         call check_near(error, v, v0, 0.0_wp, 1.0_wp, "no jump")
      end do
      rate = rates_of(set, v)
      call ask(jump, [1, 2, 3], rate, -0.5_wp*rate)
      call velocity_update_change(update, system, set, jump, v, error)
      if (allocated(error)) return
      call check_true(error, jump%is_idle .and. .not. jump%is_done, "nor of contacts")
      call check_near(error, v, v0, 0.0_wp, 1.0_wp, "velocities")
      call velocity_update_free(update)
   end subroutine test_not_held

   !> M a is the force where nothing is held.
   subroutine test_accelerate(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t) :: system
      type(constraint_set_t) :: set
      type(velocity_update_t) :: update
      real(wp), allocatable :: v(:, :), x(:, :), force(:, :), a(:, :)
      real(wp) :: p(2, 16)

      call begin(system, set, v, x, .true., error)
      if (allocated(error)) return
      allocate(force, a, mold=v)
      call shake(force, 1.0_wp)
      call constraints_select(set, [integer ::])
      call velocity_update_accelerate(update, system, set, force, v, a, error)
      if (allocated(error)) return
      call mass_times(system, a, p)
      call check_near(error, p(:, 6:), force(:, 6:), tol, 1.0_wp, "forces")
      call check_near(error, a(:, :5), 0.0_wp*a(:, :5), 0.0_wp, 1.0_wp, "what is held")
      call velocity_update_free(update)
   end subroutine test_accelerate

   !> Conditions whose rates are 0 along v keep them so: c a + v H v = 0, for those that are not
   !> linear, and M a is the force but along these.
   subroutine test_bend(error)
      type(error_t), allocatable, intent(out) :: error
      type(system_t) :: system
      type(constraint_set_t) :: set
      type(velocity_update_t) :: update
      real(wp), allocatable :: v(:, :), x(:, :), force(:, :), a(:, :)
      real(wp) :: p(2, 16), rate(3), along(16), bend
      integer :: k, n

      call begin(system, set, v, x, .true., error)
      if (allocated(error)) return
      allocate(force, a, mold=v)
      call shake(force, 1.0_wp)
      set%n_linear = 1
      set%n_permanent = 3
      do k = 1, 3
         call shake(set%item(k)%h, 1.0_wp)
      end do
      call velocity_update_accelerate(update, system, set, force, v, a, error)
      if (allocated(error)) return
      rate = rates_of(set, a)
      do k = 2, 3
         associate (item => set%item(k))
            n = 2*item%n_node
            along(:n) = reshape(v(:, item%node(:item%n_node)), [n])
            bend = dot_product(along(:n), matmul(item%h(:n, :n), along(:n)))
            call check_near(error, rate(k), -bend, tol, 1.0_wp, "rates stay")
            call check_true(error, abs(bend) > 0.01_wp, "they bend")
         end associate
      end do
      call mass_times(system, a, p)
      associate (node => set%item(1)%node(1))
         call check_near(error, p(:, node), force(:, node), tol, 1.0_wp, "the force")
      end associate
      call check_true(error, norm2(p(:, 6:) - force(:, 6:)) > 0.1_wp, "and what holds")
      call velocity_update_free(update)
   end subroutine test_bend

end module test_velocity_pushes
