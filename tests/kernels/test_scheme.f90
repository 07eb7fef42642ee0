!> Time stepping schemes: conservation, second order, reversibility.
module test_scheme
   use check, only : check_error, check_near, check_true, test_case_t
   use emcon_errors, only : err_input, error_t
   use emcon_evaluation, only : instant_t, evaluation_is_equilibrium, evaluation_moving, &
      evaluation_t, evaluation_velocity, evaluation_displacement
   use emcon_host_scheme, only : host_scheme_check, host_scheme_row
   use emcon_kinds, only : dp, wp
   use emcon_ledger, only : body_momenta, ledger_t
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_t
   use emcon_scene, only : scene_t
   use emcon_scheme, only : scheme_row_t, scheme_t
   use emcon_scheme_energy_momentum, only : scheme_energy_momentum_t
   use emcon_scheme_registry, only : scheme_create, scheme_energy_momentum, scheme_row, &
      n_scheme_row
   use emcon_scheme_static, only : scheme_static_t
   use emcon_text, only : squeezed, to_text
   use small_scenes, only : add_step, block_t, make_block
   implicit none
   private
   public :: collect_scheme

   !> A scheme that a program gives: the same pose in all steps.
   type, extends(scheme_t) :: given_t
      type(evaluation_t) :: own
   contains
      procedure :: evaluation => given_pose
   end type given_t

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))

contains

   subroutine collect_scheme(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("evaluation and velocity", test_pose), &
         test_case_t("rows say what schemes do", test_rows), &
         test_case_t("rows of given schemes follow from their poses", test_given_rows), &
         test_case_t("given schemes that are none", test_given_faults), &
         test_case_t("free flight conserves over 100 steps", test_free_flight), &
         test_case_t("second order", test_order), &
         test_case_t("reversible", test_reversible), &
         test_case_t("momenta of the bodies", test_bodies)]
   end subroutine collect_scheme

   subroutine test_pose(error)
      type(error_t), allocatable, intent(out) :: error
      type(scheme_energy_momentum_t) :: dynamic
      type(scheme_static_t) :: static
      type(evaluation_t) :: evaluation

      evaluation = dynamic%evaluation(instant_t(1.0_wp, 10.0_wp), 0.5_wp)
      call check_near(error, [evaluation%mass_scale*evaluation%rate, &
         evaluation%mass_scale*evaluation%v_weight, evaluation%load_instant%step_time, &
         evaluation%load_instant%total_time], [8.0_wp, 4.0_wp, 1.25_wp, 10.25_wp], 0.0_wp, 1.0_wp, &
         "mid-point")
      call check_true(error, .not. evaluation%is_gradient, "discrete gradients")
      call check_near(error, evaluation_velocity(evaluation, 3.0_wp, 2.0_wp), 5.0_wp, 0.0_wp, &
         1.0_wp, "mean velocity is du/h")
      evaluation = static%evaluation(instant_t(1.0_wp, 10.0_wp), 0.5_wp)
      call check_near(error, [evaluation%mass_scale, evaluation%load_instant%step_time, &
         evaluation%load_instant%total_time], [0.0_wp, 1.5_wp, 10.5_wp], 0.0_wp, 1.0_wp, "end")
      call check_true(error, evaluation%is_gradient, "gradients at the end")
      call check_near(error, evaluation_velocity(evaluation, 3.0_wp, 2.0_wp), 0.0_wp, 0.0_wp, &
         1.0_wp, "rest")
   end subroutine test_pose

   pure function given_pose(self, start, h) result(evaluation)
      class(given_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h
      type(evaluation_t) :: evaluation

      associate (unused => start, nor_this => h)
      end associate
      evaluation = self%own
   end function given_pose

   !> What a scheme does not go with follows from where it evaluates forces: for those of the table
   !> it is what their rows say.
   subroutine test_given_rows(error)
      type(error_t), allocatable, intent(out) :: error
      class(scheme_t), allocatable :: scheme
      type(scheme_row_t) :: row, given
      integer :: i

      do i = 1, n_scheme_row()
         row = scheme_row(i)
         if (row%is_explicit .or. .not. row%has_inertia) cycle
         call scheme_create(row, scheme)
         given = host_scheme_row("X", scheme)
         call check_true(error, (given%takes_jumps .eqv. row%takes_jumps) .and. &
            (given%takes_massless .eqv. row%takes_massless) .and. &
            (given%takes_damping .eqv. row%takes_damping), trim(row%word) // " goes with the same")
         call check_true(error, (given%dissipates .eqv. row%dissipates) .and. given%n_past == &
            row%n_past .and. given%has_inertia .and. given%looks_back, trim(row%word) // &
            " is the same")
         call host_scheme_check("X", scheme, error)
         if (allocated(error)) return
      end do
   end subroutine test_given_rows

   !> Weights and places that are none are refused by their names.
   subroutine test_given_faults(error)
      type(error_t), allocatable, intent(out) :: error
      type(given_t) :: given, bad

      given%own = evaluation_moving(1.0_wp, lapse=0.5_wp, v_weight=2.0_wp)
      call host_scheme_check("X", given, error)
      if (allocated(error)) return
      bad = given
      bad%own%at = 0.0_wp
      call expect(": at = ")
      bad%own%mass_scale = 0.0_wp
      call expect("mass_scale")
      bad%own%rate = -1.0_wp
      call expect("rate")
      bad%own%lapse = 1.0_wp
      call expect("lapse")
      bad%own%load_place = 1.5_wp
      call expect("load_place")
      bad%own%start_weight = -1.0_wp
      call expect("start_weight")
      bad%own%dissipation = 2.0_wp
      call expect("dissipation")
      bad%own%recalled = 2.0_wp
      call expect("recalled")
      bad%own%recalled = 0.5_wp
      call expect("needs row%n_past")
      bad%own%past_velocity(2) = 1.0_wp
      bad%row%n_past = 1
      call expect("past_velocity(2)")
      bad%own%past_change(1) = 1.0_wp
      call expect("past_change(1)")
      bad%row%n_past = 3
      call expect("row%n_past = 3")
      bad%row%is_accelerated = .true.
      call expect("row%is_accelerated")
      bad%row%is_explicit = .true.
      call expect("row%is_explicit")

   contains

      !> The bad one is refused; begin anew.
      subroutine expect(word)
         character(len=*), intent(in) :: word
         type(error_t), allocatable :: raised

         call host_scheme_check("X", bad, raised)
         call check_error(error, raised, err_input, word, word)
         bad = given
      end subroutine expect

   end subroutine test_given_faults

   !> Each row makes a scheme that is what the row says of it; ways and velocities are inverse.
   subroutine test_rows(error)
      type(error_t), allocatable, intent(out) :: error
      class(scheme_t), allocatable :: scheme
      type(scheme_row_t) :: row, listed
      type(evaluation_t) :: evaluation
      integer :: i

      do i = 1, n_scheme_row()
         listed = scheme_row(i)
         row = scheme_row(listed%card, squeezed(listed%word))
         call check_true(error, row%code == listed%code, "a card and a word make a row")
         call scheme_create(row, scheme)
         evaluation = scheme%evaluation(instant_t(), 0.5_wp)
         call check_true(error, scheme%row%code == row%code, "the row is kept")
         call check_true(error, evaluation%mass_scale > 0.0_wp .eqv. row%has_inertia, &
            "inertia")
         call check_true(error, evaluation_is_equilibrium(evaluation) .neqv. row%has_inertia, &
            "equilibrium")
         if (.not. row%has_inertia) cycle
         call check_near(error, evaluation_velocity(evaluation, 3.0_wp, &
            evaluation_displacement(evaluation, 3.0_wp, 7.0_wp)), 7.0_wp, 8.0_wp*eps, 1.0_wp, &
            "the velocity that a way ends with")
      end do
      row = scheme_row("DYNAMIC", "")
      call check_true(error, row%code == scheme_energy_momentum, "the default of *DYNAMIC")
      row = scheme_row("STATIC", "ENERGYMOMENTUM")
      call check_true(error, row%code == 0, "no such scheme of *STATIC")
   end subroutine test_rows

   !> One element that flies, spins and pulsates, with `n` steps of size `h`.
   subroutine make_flight(scene, h, n)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: h
      integer, intent(in) :: n
      type(block_t) :: block

      call make_block(scene, "CPE4", [1, 1], block)
      call add_step(scene, .false., h, n)
      scene%u0(:, 3) = [0.2_wp, 0.1_wp]
      scene%v0(1, :) = 1.0_wp - 2.0_wp*scene%x(2, :) + 0.5_wp*scene%x(1, :)
      scene%v0(2, :) = -0.5_wp + 2.0_wp*scene%x(1, :)
   end subroutine make_flight

   subroutine fly(scene, n, march, error)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: n
      type(march_t), intent(inout) :: march
      type(error_t), allocatable, intent(out) :: error
      type(increment_t) :: increment
      integer :: i

      do i = 1, n
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
      end do
   end subroutine fly

   !> px, py, lz and total at every 50th step, to 4.5 eps per step; ten times that at the largest h,
   !> some periods of the vibration and cut now and then: it flies so far that u itself is rounded.
   !> Over n steps of a way d these roundings are at most n d eps/4, a lever of the momentum; lz is
   !> held to that in single, where increments of equal size are rounded the same way each time.
   subroutine test_free_flight(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(ledger_t) :: start
      integer :: i, k
      integer, parameter :: n_step = 100
      real(wp), parameter :: h(4) = [0.001_wp, 0.02_wp, 0.1_wp, 0.5_wp]
      real(wp) :: tol, lever

      do k = 1, size(h)
         call make_flight(scene, h(k), n_step)
         tol = n_step*merge(45.0_wp, 4.5_wp, k == 4)*eps
         block
            type(march_t) :: march

            call march_init(march, scene, error)
            if (allocated(error)) return
            call march_begin_step(march, scene, 1, error)
            if (allocated(error)) return
            start = march%ledger
            lever = 0.25_wp*n_step*(n_step*h(k))*eps*sum(start%momentum**2)
            if (precision(eps) >= 15) lever = 0.0_wp
            do i = 1, n_step/50
               call fly(scene, 50, march, error)
               if (allocated(error)) return
               associate (now => march%ledger, what => "h = " // to_text(h(k)) // ": ")
                  call check_near(error, now%momentum, start%momentum, tol, &
                     abs(start%momentum(2)), what // "momentum")
                  call check_near(error, now%angular, start%angular, tol, &
                     max(abs(start%angular(1)), lever/tol), what // "angular momentum")
                  call check_near(error, now%total, start%total, tol, start%total, what // "total")
               end associate
               if (allocated(error)) return
            end do
            call check_near(error, 0.25_wp*sum(march%state%u(1, :) - scene%u0(1, :)), &
               start%momentum(1)*march%state%clock%time, tol, march%state%clock%time, &
               "centre of mass")
            call march_free(march)
         end block
         if (allocated(error)) return
      end do
   end subroutine test_free_flight

   !> Positions at t = 0.4 with h, h/2, h/4: differences fall by 4 each.
   subroutine test_order(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      real(wp) :: u(2, 4, 3), ratio
      integer :: k, n

      do k = 1, 3
         n = 100*2**(k - 1)
         call make_flight(scene, 0.4_wp/n, n)
         block
            type(march_t) :: march

            call march_init(march, scene, error)
            if (allocated(error)) return
            call march_begin_step(march, scene, 1, error)
            if (allocated(error)) return
            call fly(scene, n, march, error)
            if (allocated(error)) return
            u(:, :, k) = march%state%u
            call march_free(march)
         end block
      end do
      ratio = sqrt(sum((u(:, :, 1) - u(:, :, 2))**2)/sum((u(:, :, 2) - u(:, :, 3))**2))
      call check_near(error, log(ratio)/log(2.0_wp), 2.0_wp, 0.05_wp, 1.0_wp, "order")
   end subroutine test_order

   !> Forth with v, back with -v.
   subroutine test_reversible(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march

      call make_flight(scene, 0.05_wp, 100)
      call march_init(march, scene, error)
      if (allocated(error)) return
      call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      call fly(scene, 50, march, error)
      if (allocated(error)) return
      march%state%v = -march%state%v
      call fly(scene, 50, march, error)
      if (allocated(error)) return
      call check_near(error, march%state%u, scene%u0, 1.0e4_wp*eps, 1.0_wp, "displacements")
      call check_near(error, march%state%v, -scene%v0, 1.0e6_wp*eps, 1.0_wp, "velocities")
      call march_free(march)
   end subroutine test_reversible

   !> Of a block of mass 1 about the origin: closed forms of a translation with spin.
   subroutine test_bodies(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(march_t) :: march
      real(wp) :: momenta(3, 1)

      call make_block(scene, "CPE4", [1, 1], block)
      call add_step(scene, .false., 0.1_wp, 1)
      scene%x = scene%x - 0.5_wp
      scene%u0(1, :) = 3.0_wp
      scene%v0(1, :) = 2.0_wp - 6.0_wp*scene%x(2, :)
      scene%v0(2, :) = 5.0_wp + 6.0_wp*scene%x(1, :)
      call march_init(march, scene, error)
      if (allocated(error)) return
      call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      call body_momenta(march%system, scene%x, march%state, momenta)
      call check_near(error, momenta(:, 1), [2.0_wp, 5.0_wp, 15.0_wp + 6.0_wp/6.0_wp], &
         16.0_wp*eps, 10.0_wp, "px, py, lz")
      call check_near(error, [march%ledger%momentum, march%ledger%angular], momenta(:, 1), &
         16.0_wp*eps, 10.0_wp, "sum over the bodies")
      call check_near(error, march%ledger%kinetic, 0.5_wp*29.0_wp + 0.5_wp*36.0_wp/6.0_wp, &
         16.0_wp*eps, 10.0_wp, "kinetic energy")
   end subroutine test_bodies

end module test_scheme
