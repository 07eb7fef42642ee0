!> Marches of every kind of increment and element on two blocks: what each of them keeps or takes.
module test_march_kinds
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraint, only : condition_rate
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_ledger, only : ledger_t
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_is_done, march_t
   use emcon_materials, only : kinematics_corotated, kinematics_linear
   use emcon_scene, only : scene_t
   use emcon_scheme_registry, only : scheme_row
   use emcon_state, only : state_t
   use emcon_steps, only : events_nodes, events_pairs, method_null_space, method_saddle_point
   use emcon_system, only : mass_times
   use emcon_text, only : to_text
   use small_scenes, only : add_step, block_t, clamp, make_block, make_two_blocks, prescribe, &
      shake, young
   implicit none
   private
   public :: collect_march_kinds

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> Round-off of some 40 steps, each of the order of epsilon times the energy.
   real(wp), parameter :: tol = 450.0_wp*eps
   real(wp), parameter :: h = 0.02_wp, gap_start = 0.0927_wp

contains

   subroutine collect_march_kinds(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("energy that the scheme and materials take", test_taken), &
         test_case_t("small strains, in frames that turn and in none", test_kinematics), &
         test_case_t("elements of small strains in statics", test_small_strains), &
         test_case_t("increments that follow the error", test_controlled), &
         test_case_t("increments that end where contacts begin", test_events), &
         test_case_t("explicit steps that hold contacts", test_explicit_contact)]
   end subroutine collect_march_kinds

   subroutine begin(scene, march, error)
      type(scene_t), intent(in) :: scene
      type(march_t), intent(inout) :: march
      type(error_t), allocatable, intent(out) :: error

      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
   end subroutine begin

   !> A free block of 2 x 1 elements that is stretched, turns and moves, for 20 increments.
   subroutine make_thrown(scene)
      type(scene_t), intent(out) :: scene
      type(block_t) :: block

      call make_block(scene, "CPE4", [2, 1], block)
      call add_step(scene, .false., h, 20)
      call shake(scene%v0, 0.5_wp)
      scene%v0(1, :) = scene%v0(1, :) + 1.0_wp - 2.0_wp*scene%x(2, :)
      scene%v0(2, :) = scene%v0(2, :) + 2.0_wp*scene%x(1, :)
      scene%u0(1, :) = 0.1_wp*scene%x(1, :)
   end subroutine make_thrown

   !> What is taken stays the same with the rest, and materials never give back; momenta stay but
   !> for damping by mass, which is alpha M du/h: they fall by (1 - alpha h/2)/(1 + alpha h/2).
   subroutine test_taken(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: alpha = 3.0_wp, beta = 0.01_wp
      type(scene_t) :: scene
      type(ledger_t) :: start, before
      type(increment_t) :: increment
      real(wp) :: fall
      integer :: kind, k

      do kind = 1, 4
         call make_thrown(scene)
         if (kind == 1) scene%step(1)%scheme = scheme_row("DYNAMIC", "ENERGYDECAYING")
         if (kind == 2 .or. kind == 4) scene%material(1)%beta = beta
         if (kind >= 3) scene%material(1)%alpha = alpha
         if (kind == 4) scene%section(1)%kinematics = kinematics_corotated
         fall = merge((1.0_wp - 0.5_wp*alpha*h)/(1.0_wp + 0.5_wp*alpha*h), 1.0_wp, kind >= 3)
         block
            type(march_t) :: march

            call begin(scene, march, error)
            if (allocated(error)) return
            start = march%ledger
            do k = 1, 20
               before = march%ledger
               call march_increment(march, scene, increment, error)
               if (allocated(error)) return
               associate (ledger => march%ledger)
                  call check_near(error, ledger%total + ledger%decay + ledger%damping, &
                     start%total, tol, start%total, "energy, kind " // to_text(kind))
                  call check_true(error, ledger%damping - before%damping >= -tol*start%total, &
                     "materials take")
                  call check_near(error, ledger%momentum, fall*before%momentum, tol, &
                     norm2(start%momentum), "momentum, kind " // to_text(kind))
                  if (kind < 3) call check_near(error, ledger%angular, start%angular, tol, &
                     abs(start%angular(1)), "angular momentum, kind " // to_text(kind))
               end associate
               if (allocated(error)) return
            end do
            associate (ledger => march%ledger)
               call check_true(error, (ledger%decay > 1.0e-4_wp*start%total) .eqv. kind == 1, &
                  "decay")
               call check_true(error, (ledger%damping > 1.0e-3_wp*start%total) .eqv. kind > 1, &
                  "damping")
            end associate
            call march_free(march)
         end block
         if (allocated(error)) return
      end do
   end subroutine test_taken

   !> Energy and momentum stay; the moment of it where frames turn. Without, small strains are those
   !> of the start, which a turn makes.
   subroutine test_kinematics(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(ledger_t) :: start
      type(increment_t) :: increment
      integer :: kind, k

      do kind = kinematics_linear, kinematics_corotated
         call make_thrown(scene)
         scene%section(1)%kinematics = kind
         block
            type(march_t) :: march

            call begin(scene, march, error)
            if (allocated(error)) return
            start = march%ledger
            do k = 1, 20
               call march_increment(march, scene, increment, error)
               if (allocated(error)) return
               associate (ledger => march%ledger)
                  call check_near(error, ledger%total, start%total, tol, start%total, &
                     "energy, kind " // to_text(kind))
                  call check_near(error, ledger%momentum, start%momentum, tol, &
                     norm2(start%momentum), "momentum, kind " // to_text(kind))
                  if (kind == kinematics_corotated) call check_near(error, ledger%angular, &
                     start%angular, tol, abs(start%angular(1)), "angular momentum")
               end associate
               if (allocated(error)) return
            end do
            if (kind == kinematics_linear) call check_true(error, abs(march%ledger%angular(1) &
               - start%angular(1)) > 0.01_wp*abs(start%angular(1)), "none turns")
            call march_free(march)
         end block
         if (allocated(error)) return
      end do
   end subroutine test_kinematics

   !> Forces of a stretch: twice as large for twice the stretch; in a frame that turns by 90 degrees
   !> they turn with it, and a turn alone makes none.
   subroutine test_small_strains(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: turn(2, 2) = reshape([0.0_wp, 1.0_wp, -1.0_wp, 0.0_wp], [2, 2])
      real(wp), parameter :: one(2, 2) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
      real(wp), parameter :: grad(2, 2) = reshape([0.01_wp, 0.002_wp, 0.003_wp, -0.004_wp], [2, 2])
      real(wp) :: once(2, 6), twice(2, 6), turned(2, 6)
      real(wp), dimension(2, 6) :: x

      call react(kinematics_linear, grad, once, x, error)
      if (.not. allocated(error)) call react(kinematics_linear, 2.0_wp*grad, twice, x, error)
      if (allocated(error)) return
      call check_near(error, twice, 2.0_wp*once, tol, young, "twice as large")
      call check_near(error, sum(sum(once*matmul(grad, x), 1)), 2.0_wp*energy_of(grad, x), tol, &
         young*norm2(grad)**2, "twice the energy of the strain")
      call react(kinematics_corotated, grad + transpose(grad), once, x, error)
      if (.not. allocated(error)) call react(kinematics_corotated, &
         matmul(turn, one + grad + transpose(grad)) - one, turned, x, error)
      if (allocated(error)) return
      call check_near(error, turned, matmul(turn, once), tol, young, "they turn")
      call react(kinematics_corotated, turn - one, turned, x, error)
      if (allocated(error)) return
      call check_near(error, turned, 0.0_wp*turned, tol, young, "a turn")

   contains

      !> Hooke's law in plane strain over the area of 2.
      pure real(wp) function energy_of(grad, x) result(energy)
         real(wp), intent(in) :: grad(2, 2), x(:, :)
         real(wp), parameter :: nu = 0.3_wp
         real(wp) :: strain(2, 2)

         strain = 0.5_wp*(grad + transpose(grad))
         energy = maxval(x(1, :))*maxval(x(2, :))*young/(1.0_wp + nu)*(0.5_wp*sum(strain**2) &
            + 0.5_wp*nu/(1.0_wp - 2.0_wp*nu)*(strain(1, 1) + strain(2, 2))**2)
      end function energy_of

      !> The reactions where all nodes move by `grad` x.
      subroutine react(kind, grad, reaction, x, error)
         integer, intent(in) :: kind
         real(wp), intent(in) :: grad(2, 2)
         real(wp), intent(out) :: reaction(2, 6), x(2, 6)
         type(error_t), allocatable, intent(out) :: error
         type(scene_t) :: scene
         type(march_t) :: march
         type(increment_t) :: increment
         type(block_t) :: block
         integer :: i, a
         real(wp) :: u(2, 6)

         call make_block(scene, "CPE4", [2, 1], block)
         scene%section(1)%kinematics = kind
         call add_step(scene, .true., 1.0_wp, 1)
         x = scene%x
         u = matmul(grad, x)
         do i = 1, 6
            do a = 1, 2
               call prescribe(scene%step(1), i, a, u(a, i))
            end do
         end do
         call begin(scene, march, error)
         if (.not. allocated(error)) call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         reaction = march%state%reaction
         call march_free(march)
      end subroutine react

   end subroutine test_small_strains

   !> The block falls on the clamped one.
   subroutine make_drop(scene, n)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: n                   !! increments of h
      type(block_t) :: lower, upper
      integer :: i

      call make_two_blocks(scene, gap_start, lower, upper)
      call add_step(scene, .false., h, n)
      call clamp(scene%step(1), [(i, i = 1, 10)])
      scene%v0(2, 11:) = -1.0_wp
   end subroutine make_drop

   !> Through an impact and after it: a smaller tolerance takes more increments and comes closer to
   !> what a hundredth of it gives; energy stays; the times of the increments fill the step.
   subroutine test_controlled(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: tolerance(3) = [0.1_wp, 0.01_wp, 0.0005_wp]
      type(scene_t) :: scene
      type(ledger_t) :: start
      type(increment_t) :: increment
      real(wp) :: u(2, 6, 3), done
      integer :: n(3), k, i

      do i = 1, 3
         call make_drop(scene, 20)
         scene%step(1)%time%is_direct = .false.
         scene%step(1)%time%tolerance = tolerance(i)
         block
            type(march_t) :: march

            call begin(scene, march, error)
            if (allocated(error)) return
            start = march%ledger
            done = 0.0_wp
            n(i) = 0
            do k = 1, 2000
               call march_increment(march, scene, increment, error)
               if (allocated(error)) return
               n(i) = n(i) + 1
               done = done + increment%done
               call check_near(error, march%state%clock%step_time, done, 64.0_wp*eps, 20.0_wp*h, &
                  "times")
               call check_near(error, march%ledger%total, start%total, tol, start%total, "energy")
               if (allocated(error)) return
               if (march_is_done(march)) exit
            end do
            call check_near(error, done, 20.0_wp*h, 64.0_wp*eps, done, "the whole step")
            u(:, :, i) = march%state%u(:, 11:)
            call march_free(march)
         end block
         if (allocated(error)) return
      end do
      call check_true(error, n(1) < n(2) .and. n(2) < n(3), "increments " // to_text(n(1)) // ", " &
         // to_text(n(2)) // ", " // to_text(n(3)))
      call check_true(error, norm2(u(:, :, 2) - u(:, :, 3)) < norm2(u(:, :, 1) - u(:, :, 3)), &
         "a smaller error")
   end subroutine test_controlled

   !> All nodes meet the floor at once, at gap/velocity: an increment that is no longer than the
   !> window holds that moment, by pairs and by nodes; the ones before reach up to it.
   subroutine test_events(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: part = 0.125_wp
      type(scene_t) :: scene
      type(increment_t) :: increment
      real(wp) :: before, meeting(2)
      integer :: events, k, n_event

      do events = min(events_pairs, events_nodes), max(events_pairs, events_nodes)
         call make_drop(scene, 8)
         scene%step(1)%time%event_fraction = part
         scene%step(1)%time%events = events
         block
            type(march_t) :: march

            call begin(scene, march, error)
            if (allocated(error)) return
            meeting = -1.0_wp
            n_event = 0
            do k = 1, 100
               before = march%state%clock%step_time
               call march_increment(march, scene, increment, error)
               if (allocated(error)) return
               if (n_event == 0 .and. march%state%control%n_event > 0) then
                  meeting = [before, march%state%clock%step_time]
                  n_event = march%state%control%n_event
                  call check_true(error, increment%notes%n >= 3, "they are told")
               end if
               if (march_is_done(march)) exit
            end do
            call check_equal(error, n_event, 3, "nodes that land")
            call check_true(error, meeting(1) < gap_start .and. &
               meeting(2) >= gap_start - tol .and. &
               meeting(2) - meeting(1) <= part*h*(1.0_wp + tol), &
               "from " // to_text(meeting(1)) // " to " // to_text(meeting(2)))
            call march_free(march)
         end block
         if (allocated(error)) return
      end do
   end subroutine test_events

   !> Central differences with exact contact: no node goes in, nothing pulls, the momentum changes
   !> by the pushes, and energy falls by what contact does. With a factor that is kept over steps,
   !> and with none.
   subroutine test_explicit_contact(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: method(2) = [method_null_space, method_saddle_point]
      integer :: i

      do i = 1, size(method)
         if (.not. allocated(error)) call run_explicit(method(i), error)
      end do
   end subroutine test_explicit_contact

   subroutine run_explicit(method, error)
      integer, intent(in) :: method
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: step = 0.25_wp*h
      type(scene_t) :: scene
      type(march_t) :: march
      type(ledger_t) :: start, before
      type(increment_t) :: increment
      type(state_t) :: state0
      real(wp) :: push
      integer :: k, n_contact

      call make_drop(scene, 80)
      scene%step(1)%time%h = step
      scene%step(1)%time%duration = 80.0_wp*step
      scene%step(1)%scheme = scheme_row("DYNAMIC", "CENTRALDIFFERENCE")
      scene%step(1)%contact%method = method
      call begin(scene, march, error)
      if (allocated(error)) return
      start = march%ledger
      n_contact = 0
      do k = 1, 80
         before = march%ledger
         state0 = march%state
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         call check_pushes(error, march, state0, step)
         associate (state => march%state, ledger => march%ledger)
            push = sum(state%contact(2, 11:))
            call check_true(error, minval(gap_start + state%u(2, 11:13)) >= -tol, "nothing goes in")
            call check_true(error, all(state%contact(2, 11:13) >= -tol*young), "nothing pulls")
            call check_near(error, ledger%momentum(2) - before%momentum(2), step*push, tol, &
               2.0_wp, "momentum")
            call check_true(error, ledger%contact_work - before%contact_work <= tol*start%total, &
               "contact makes no energy")
            call check_near(error, ledger%total - ledger%contact_work, start%total, 0.02_wp, &
               start%total, "energy, but for that of the scheme")
         end associate
         if (push > 0.0_wp) n_contact = n_contact + 1
         if (allocated(error)) return
      end do
      call check_true(error, march%newton%correction%kept%is_made .eqv. method &
         == method_null_space, "a factor")
      call check_true(error, n_contact > 10, "contact")
      call check_true(error, march%ledger%momentum(2) > 0.5_wp, "it bounces")
      call march_free(march)
   end subroutine run_explicit

   !> Two pushes, by the forces at the start and at the end of a step; that at the end stops what
   !> goes on into the other side, by contacts that do not pull.
   subroutine check_pushes(error, march, before, step)
      type(error_t), allocatable, intent(inout) :: error
      type(march_t), intent(in) :: march
      type(state_t), intent(in) :: before
      real(wp), intent(in) :: step               !! > 0 [T]
      real(wp), dimension(2, 16) :: change, inertia, force
      integer :: i, k

      associate (state => march%state, set => march%active%set, explicit => march%explicit)
         change = (state%v - before%v)/step
         call mass_times(march%system, change, inertia)
         force = state%contact + state%reaction - 0.5_wp*(before%internal + state%internal)
         call check_near(error, force, inertia, tol, young, "the mean of both")
         change = 2.0_wp*(state%v - march%motion%du/step)/step
         call mass_times(march%system, change, inertia)
         force = explicit%contact - state%internal
         call check_near(error, inertia(:, 11:), force(:, 11:), tol, young, "at the end")
         force = 0.0_wp
         call check_equal(error, size(explicit%mu), set%n, "multipliers")
         do k = 1, size(explicit%mu)
            call check_true(error, explicit%mu(k) >= 0.0_wp, "no pull")
            if (explicit%mu(k) > 0.0_wp) call check_near(error, condition_rate(set%item(k), &
               state%v), 0.0_wp, tol, 1.0_wp, "what is held")
            do i = 1, set%item(k)%n_node
               associate (to => force(:, set%item(k)%node(i)))
                  to = to + explicit%mu(k)*set%item(k)%c(:, i)
               end associate
            end do
         end do
         call check_near(error, explicit%contact, force, tol, young, "forces of contact")
         ! Gaps open upwards: multipliers are pushes.
         call check_near(error, sum(state%contacts%lam), sum(state%contact(2, 11:)), tol, young, &
            "multipliers that are told")
      end associate
   end subroutine check_pushes

end module test_march_kinds
