!> Newton's method: order of convergence with and without contact, damping, and how it fails.
module test_newton
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraints, only : constraint_set_t, constraints_rounding, constraints_select
   use emcon_correction, only : correction_free, correction_reset, correction_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : instant_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_evaluate, motion_init, motion_t
   use emcon_newton, only : newton_converged, newton_diverged, newton_find_idle, newton_init, &
      newton_refused, newton_singular, newton_solve, newton_t
   use emcon_scene, only : scene_t
   use emcon_scheme_energy_momentum, only : scheme_energy_momentum_t
   use emcon_solver_registry, only : solver_default
   use emcon_steps, only : load_point, load_t, method_null_space, method_saddle_point
   use emcon_system, only : system_begin_step, system_init, system_respond, system_t
   use emcon_term, only : role_external, role_inertia, role_internal
   use emcon_text, only : to_text
   use small_scenes, only : add_load, add_step, block_t, clamp, make_block, make_two_blocks, &
      poisson, prescribe, shake, young
   implicit none
   private
   public :: collect_newton

   !> All that one solution needs and gives.
   type :: trial_t
      type(system_t) :: system
      type(newton_t) :: newton
      type(constraint_set_t) :: set
      type(motion_t) :: motion
      integer :: status = 0
   end type trial_t

   !> Residuals below it are round-off, of the state or of the matrix; single precision has but one
   !> between it and 0.1 for sure.
   real(wp), parameter :: round_off = 1.0e4_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   integer, parameter :: least_seen = merge(3, 1, round_off < 1.0e-6_wp)

contains

   subroutine collect_newton(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("quadratic convergence of a large step", test_order), &
         test_case_t("quadratic convergence in contact", test_order_in_contact), &
         test_case_t("round-off of what is stiff and moves far", test_floor), &
         test_case_t("nothing to solve for", test_no_unknowns), &
         test_case_t("a step from rest to rest", test_rest), &
         test_case_t("too few iterations", test_diverged), &
         test_case_t("singular system", test_singular), &
         test_case_t("inverted first guess", test_inverted), &
         test_case_t("corrections that invert are halved", test_damping), &
         test_case_t("what moves nothing but round-off", test_idle)]
   end subroutine collect_newton

   !> The first step of `scene`, a dynamic one of size `h` or, for h = 0, a static one.
   subroutine prepare(trial, scene, h, maximum, method, error)
      type(trial_t), intent(inout) :: trial
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: h
      integer, intent(in) :: maximum, method
      type(error_t), allocatable, intent(out) :: error
      type(scheme_energy_momentum_t) :: scheme
      integer :: none(0)

      call system_init(trial%system, scene, error)
      if (allocated(error)) return
      call system_begin_step(trial%system, scene, 1, error)
      if (allocated(error)) return
      call newton_init(trial%newton, trial%system%space%numbering%n_unknown, scene%x, &
         1.0e3_wp*epsilon(1.0_wp), maximum)
      call correction_reset(trial%newton%correction, method, solver_default)
      call constraints_select(trial%set, none)
      call motion_init(trial%motion, scene%x)
      trial%motion%evaluation%is_gradient = .not. h > 0.0_wp
      if (h > 0.0_wp) trial%motion%evaluation = scheme%evaluation(instant_t(), h)
      trial%motion%u0 = scene%u0
      trial%motion%v0 = scene%v0
   end subroutine prepare

   subroutine solve(trial, error)
      type(trial_t), intent(inout) :: trial
      type(error_t), allocatable, intent(out) :: error

      call newton_solve(trial%newton, trial%system, trial%set, trial%motion, &
         trial%status, error)
   end subroutine solve

   !> The largest r(k+1)/r(k)^2 of the relative residuals above round-off, from 0.1 on: bounded, and
   !> of size 1 for these blocks of unit cells, only if the convergence is quadratic.
   pure real(wp) function quadratic_constant(newton)
      type(newton_t), intent(in) :: newton
      integer :: k

      quadratic_constant = 0.0_wp
      do k = 2, newton%convergence%n_iteration + 1
         associate (r => newton%convergence%history(k - 1:k))
            if (r(1) > 0.1_wp .or. r(2) < round_off) cycle
            quadratic_constant = max(quadratic_constant, r(2)/r(1)**2)
         end associate
      end do
   end function quadratic_constant

   !> At least two steps count, and the constant is of size 1.
   subroutine check_quadratic(error, trial, what)
      type(error_t), allocatable, intent(inout) :: error
      type(trial_t), intent(in) :: trial
      character(len=*), intent(in) :: what
      real(wp) :: constant

      constant = quadratic_constant(trial%newton)
      call check_equal(error, trial%status, newton_converged, what // ": status")
      call check_true(error, (constant > 0.0_wp .or. least_seen < 2) .and. constant < 5.0_wp, &
         what // ": r1 < 5 r0^2, found " // to_text(constant))
      associate (r => trial%newton%convergence%history(:trial%newton%convergence%n_iteration + 1))
         call check_true(error, count(r < 0.1_wp .and. r > round_off) >= least_seen, &
            what // ": residuals between 0.1 and round-off")
      end associate
   end subroutine check_quadratic

   !> A spinning, stretching block from a poor guess: no motion at all.
   subroutine test_order(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(trial_t) :: trial

      call make_block(scene, "CPE4", [2, 1], block)
      call add_step(scene, .false., 0.2_wp, 1)
      call shake(scene%u0, 0.1_wp)
      scene%v0(1, :) = -2.0_wp*scene%x(2, :) + 0.5_wp*scene%x(1, :)
      scene%v0(2, :) = 2.0_wp*scene%x(1, :)
      call prepare(trial, scene, 0.2_wp, 20, method_null_space, error)
      if (allocated(error)) return
      call solve(trial, error)
      if (allocated(error)) return
      call check_quadratic(error, trial, "large step")
      call check_true(error, trial%newton%convergence%n_iteration <= 8, &
         "iterations: " // to_text(trial%newton%convergence%n_iteration))
      call correction_free(trial%newton%correction)
   end subroutine test_order

   !> With three active constraints on a bent surface, by either method.
   subroutine test_order_in_contact(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(trial_t) :: trial
      integer :: method

      do method = method_null_space, method_saddle_point
         call make_two_blocks(scene, 0.05_wp, lower, upper)
         call add_step(scene, .false., 0.1_wp, 1)
         call shake(scene%u0, 0.02_wp)
         scene%v0(1, 11:) = 1.0_wp
         scene%v0(2, 11:) = -2.0_wp
         call prepare(trial, scene, 0.1_wp, 20, method, error)
         if (allocated(error)) return
         call constraints_select(trial%set, [1, 2, 3])
         call trial%system%contact(1)%contact%begin_step(scene%x, trial%motion%u0, trial%motion%du)
         call solve(trial, error)
         if (allocated(error)) return
         call check_quadratic(error, trial, "method " // to_text(method))
         call check_near(error, trial%set%defect, [0.0_wp, 0.0_wp, 0.0_wp], &
            16.0_wp*epsilon(1.0_wp), 1.0_wp, "gaps")
         call correction_free(trial%newton%correction)
         if (allocated(error)) return
      end do
   end subroutine test_order_in_contact

   !> A soft block under one that is a million times stiffer, all moved by a long way: forces of the
   !> stiff one and gaps are rounded by it to more than Newton's tolerance, and that is the end.
   subroutine test_floor(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: ratio = 1.0e6_wp, press = 0.01_wp
      !> Forces of the stiff block are rounded by this part of those of the soft one.
      real(wp), parameter :: part = 1.0e-6_wp, far = part*press/(ratio*epsilon(1.0_wp))
      real(wp) :: lam(3), found(3)

      call press_block(0.0_wp, lam, error)
      if (.not. allocated(error)) call press_block(far, found, error)
      if (.not. allocated(error)) call check_near(error, found, lam, 4.0_wp*part + round_off, &
         maxval(lam), "contact forces")

   contains

      !> Press after a way of `way` along both axes.
      subroutine press_block(way, lam, error)
         real(wp), intent(in) :: way
         real(wp), intent(out) :: lam(3)
         type(error_t), allocatable, intent(out) :: error
         type(scene_t) :: scene
         type(block_t) :: lower, upper
         type(trial_t) :: trial
         integer :: i

         call make_two_blocks(scene, 0.0_wp, lower, upper)
         scene%material = [scene%material, scene%material]
         scene%material(2)%constant = [ratio*young, poisson]
         scene%section = [scene%section, scene%section]
         scene%section(2)%material = 2
         scene%element%section(upper%elements_before + 1:) = 2
         call add_step(scene, .true., 1.0_wp, 1)
         do i = 1, size(scene%x, 2)
            if (i > 5 .and. i < 14) cycle        ! between the lowest and the topmost ones
            call prescribe(scene%step(1), i, 1, way)
            call prescribe(scene%step(1), i, 2, merge(way, way - press, i <= 5))
         end do
         call prepare(trial, scene, 0.0_wp, 20, method_null_space, error)
         if (allocated(error)) return
         call constraints_select(trial%set, [1, 2, 3])
         trial%motion%du = way
         trial%motion%du(2, 14:) = way - press
         call trial%system%contact(1)%contact%begin_step(scene%x, trial%motion%u0, trial%motion%du)
         call solve(trial, error)
         if (allocated(error)) return
         call check_equal(error, trial%status, newton_converged, "status at " // to_text(way))
         lam = trial%set%lam
         ! A gap is made of the edge and of the way of either side; what is pressed leans a little.
         do i = 1, 3
            call check_near(error, constraints_rounding(trial%set, trial%motion, i), &
               trial%set%item(i)%size + 2.0_wp*way, 4.0_wp*press, 1.0_wp + way, "terms of a gap")
         end do
         call correction_free(trial%newton%correction)
      end subroutine press_block

   end subroutine test_floor

   subroutine test_no_unknowns(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(trial_t) :: trial

      call make_block(scene, "CPE3", [1, 1], block)
      call add_step(scene, .true., 1.0_wp, 1)
      call clamp(scene%step(1), [1, 2, 3, 4])
      call prepare(trial, scene, 0.0_wp, 20, method_null_space, error)
      if (allocated(error)) return
      trial%motion%du(1, 2) = 0.1_wp
      call solve(trial, error)
      if (allocated(error)) return
      call check_equal(error, trial%status, newton_converged, "status")
      call check_equal(error, trial%newton%n_solve, 0, "linear systems")
      call check_true(error, maxval(abs(trial%system%response%residual)) > 0.0_wp, "reactions")
      call correction_free(trial%newton%correction)
   end subroutine test_no_unknowns

   subroutine test_rest(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(trial_t) :: trial

      call make_block(scene, "CPE3", [2, 2], block)
      call add_step(scene, .false., 1.0_wp, 1)
      call prepare(trial, scene, 1.0_wp, 20, method_null_space, error)
      if (allocated(error)) return
      call solve(trial, error)
      if (allocated(error)) return
      call check_equal(error, [trial%status, trial%newton%n_solve], [newton_converged, 0], "solves")
      call correction_free(trial%newton%correction)
   end subroutine test_rest

   subroutine test_diverged(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(trial_t) :: trial

      call make_block(scene, "CPE4", [2, 1], block)
      call add_step(scene, .false., 0.2_wp, 1)
      scene%v0(1, :) = -2.0_wp*scene%x(2, :)
      scene%v0(2, :) = 2.0_wp*scene%x(1, :)
      call prepare(trial, scene, 0.2_wp, 2, method_null_space, error)
      if (allocated(error)) return
      call solve(trial, error)
      if (allocated(error)) return
      call check_equal(error, trial%status, newton_diverged, "status")
      call check_equal(error, trial%newton%convergence%n_iteration, 2, "iterations")
      call correction_free(trial%newton%correction)
   end subroutine test_diverged

   !> Statics of a free block under a load.
   subroutine test_singular(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(trial_t) :: trial
      type(load_t) :: load

      call make_block(scene, "CPE4", [1, 1], block)
      call add_step(scene, .true., 1.0_wp, 1)
      load%kind = load_point
      load%target = 3
      load%place = 1
      load%value = 1.0_wp
      call add_load(scene%step(1), load)
      call prepare(trial, scene, 0.0_wp, 20, method_null_space, error)
      if (allocated(error)) return
      trial%motion%evaluation%load_instant%step_time = 1.0_wp
      call solve(trial, error)
      if (allocated(error)) return
      call check_true(error, trial%status /= newton_converged, "no solution is claimed")
      call check_true(error, any(trial%status == [newton_singular, newton_diverged, &
         newton_refused]), "status")
      call correction_free(trial%newton%correction)
   end subroutine test_singular

   subroutine test_inverted(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(trial_t) :: trial

      call make_block(scene, "CPE4", [3, 1], block)
      call add_step(scene, .false., 0.1_wp, 1)
      call prepare(trial, scene, 0.1_wp, 20, method_null_space, error)
      if (allocated(error)) return
      trial%motion%du(1, [3, 7]) = 1.5_wp
      call solve(trial, error)
      if (allocated(error)) return
      call check_equal(error, trial%status, newton_refused, "status")
      if (allocated(trial%system%response%refusal)) call check_equal(error, &
         trial%system%response%refusal, "element 3 is inverted", "refusal")
      call correction_free(trial%newton%correction)
   end subroutine test_inverted

   !> Dead loads that by linear theory press the block to three times its height.
   subroutine test_damping(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(trial_t) :: trial
      type(load_t) :: load
      integer :: i

      call make_block(scene, "CPE4", [1, 1], block)
      call add_step(scene, .true., 1.0_wp, 1)
      call clamp(scene%step(1), [1, 2])
      load%kind = load_point
      load%place = 2
      load%value = -1.5_wp*young
      do i = 3, 4
         load%target = i
         call add_load(scene%step(1), load)
      end do
      call prepare(trial, scene, 0.0_wp, 60, method_null_space, error)
      if (allocated(error)) return
      trial%motion%evaluation%load_instant%step_time = 1.0_wp
      call solve(trial, error)
      if (allocated(error)) return
      call check_equal(error, trial%status, newton_converged, "status")
      call check_true(error, &
         all(trial%motion%du(2, 3:) < -0.5_wp .and. trial%motion%du(2, 3:) > -1.0_wp), &
         "pressed flat, not through")
      call check_near(error, trial%system%response%part(role_internal)%force(2, 3:), &
         [load%value, load%value], &
         1.0e4_wp*epsilon(1.0_wp), young, "internal forces balance the loads")
      call correction_free(trial%newton%correction)
   end subroutine test_damping

   !> Forces on what is prescribed, and inertia below round-off, leave a body idle.
   subroutine test_idle(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(trial_t) :: trial
      integer :: held, free

      call make_block(scene, "CPE4", [1, 1], block)
      call add_step(scene, .false., 0.1_wp, 1)
      held = 1
      free = 4
      call prescribe(scene%step(1), held, 1, 0.0_wp)
      call prescribe(scene%step(1), held, 2, 0.0_wp)
      call prepare(trial, scene, 0.1_wp, 20, method_null_space, error)
      if (allocated(error)) return
      trial%motion%du = 1.0_wp
      call motion_evaluate(trial%motion)
      call system_respond(trial%system, trial%motion, .true.)
      associate (rounding => epsilon(1.0_wp)*maxval(trial%system%response%rounding))
         call check_true(error, rounding > 0.0_wp, "forces are rounded")
         call check(role_external, held, 1.0_wp, .true., "a force on what is prescribed")
         call check(role_external, free, rounding, .false., "a force on an unknown")
         call check(role_inertia, held, 1.0_wp, .true., "inertia of what is prescribed")
         call check(role_inertia, free, rounding, .true., "inertia as small as round-off")
         call check(role_inertia, free, -16.0_wp*rounding, .false., "inertia above round-off")
      end associate
      call newton_find_idle(trial%newton, trial%system, .false.)
      call check_true(error, .not. trial%newton%is_idle, "a residual above round-off")
      call correction_free(trial%newton%correction)

   contains

      !> One component of one force, all others 0.
      subroutine check(role, node, value, is_idle, what)
         integer, intent(in) :: role, node
         real(wp), intent(in) :: value
         logical, intent(in) :: is_idle          !! expected
         character(len=*), intent(in) :: what

         associate (part => trial%system%response%part)
            part(role_external)%force = 0.0_wp
            part(role_inertia)%force = 0.0_wp
            part(role)%force(2, node) = value
         end associate
         call newton_find_idle(trial%newton, trial%system, .true.)
         call check_true(error, trial%newton%is_idle .eqv. is_idle, what)
      end subroutine check

   end subroutine test_idle

end module test_newton
