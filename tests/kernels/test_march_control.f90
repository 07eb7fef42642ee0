!> Increments that follow the error: what they add up to, how they are counted, where they end.
module test_march_control
   use, intrinsic :: iso_fortran_env, only : int64
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_amplitudes, only : amplitude_t
   use emcon_errors, only : err_analysis, error_t
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t, march_begin_step, march_free, march_free_increment, &
      march_increment, march_init, march_is_done, march_resume, march_t
   use emcon_rigid_bodies, only : rigid_frame_choose
   use emcon_scene, only : scene_t
   use emcon_step_control, only : why_error, why_event, why_newton
   use emcon_stepper, only : stepper_advance, stepper_close, stepper_t
   use emcon_steps, only : initiation_persistent, load_gravity, load_point, load_t, newton_kept
   use emcon_system, only : mass_times
   use emcon_text, only : to_text
   use given_hosts, only : chain_host_init, chain_host_t
   use given_scenes, only : make_line, open_given
   use linear_scenes, only : add_equation
   use small_scenes, only : add_block, add_load, add_step, add_surface, block_t, bottom, clamp, &
      left, make_block, make_two_blocks, prescribe, right, top
   implicit none
   private
   public :: collect_march_control

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   real(wp), parameter :: h = 0.125_wp
   integer, parameter :: n = 8

contains

   subroutine collect_march_control(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("sizes, times and counts of a stretched block that spins", test_counts), &
         test_case_t("the error of increments, by their forces", test_error), &
         test_case_t("first sizes that were too large leave nothing", test_retry), &
         test_case_t("nothing is known after a size of its own", test_own_size), &
         test_case_t("the error of what equations link", test_linked), &
         test_case_t("masses that errors are weighed by", test_masses), &
         test_case_t("an event is found by the velocities", test_event), &
         test_case_t("an event that comes before they say", test_early), &
         test_case_t("a second half that is cut", test_second), &
         test_case_t("cuts where the error does not count", test_cut), &
         test_case_t("solves that take long", test_slow), &
         test_case_t("long increments while bodies are apart", test_apart), &
         test_case_t("a body that may touch itself is never apart", test_self), &
         test_case_t("no smaller increment is allowed", test_least), &
         test_case_t("the smallest one fails", test_failure), &
         test_case_t("below all sizes that accuracy asks for", test_far_below)]
   end subroutine collect_march_control

   subroutine make_spin(scene, tolerance, maximum)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: tolerance
      integer, intent(in) :: maximum             !! iterations
      type(block_t) :: block

      call make_block(scene, "CPE4", [2, 1], block)
      call add_step(scene, .false., h, n)
      scene%step(1)%time%is_direct = .false.
      scene%step(1)%time%tolerance = tolerance
      scene%step(1)%solution%newton_maximum = maximum
      scene%v0(1, :) = -2.0_wp*scene%x(2, :) + 0.5_wp*scene%x(1, :)
      scene%v0(2, :) = 2.0_wp*scene%x(1, :)
   end subroutine make_spin

   subroutine begin(scene, march, error)
      type(scene_t), intent(in) :: scene
      type(march_t), intent(inout) :: march
      type(error_t), allocatable, intent(out) :: error

      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
   end subroutine begin

   !> Each increment is what time goes on by, all of it done, a power of two of that of the deck,
   !> the first one two of these; the energy stays, the momentum is what a force that grows with
   !> time has given, and each solve that was given up is counted. Nothing changes where the step is
   !> taken up again between increments.
   subroutine test_counts(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: tolerance(2) = [1.0_wp, 1.0e-4_wp], pull = 3.0_wp
      type(scene_t) :: scene
      type(load_t) :: load
      integer :: k

      do k = 1, 2
         call make_spin(scene, tolerance(k), 60)
         scene%amplitude = [amplitude_t(name="GROWTH", time=[0.0_wp, n*h], value=[0.0_wp, n*h])]
         load%kind = load_point
         load%target = 3
         load%place = 1
         load%value = pull
         load%amplitude = 1
         call add_load(scene%step(1), load)
         call run()
         if (allocated(error)) return
      end do

   contains

      subroutine run()
         type(march_t) :: march
         type(increment_t) :: increment
         real(wp) :: before, total, part, momentum(2)
         integer :: n_increment, n_cut, n_between

         call begin(scene, march, error)
         if (allocated(error)) return
         n_between = 0
         total = march%ledger%total
         momentum = march%ledger%momentum
         n_increment = 0
         n_cut = 0
         do while (.not. march_is_done(march))
            before = march%state%clock%time
            call march_increment(march, scene, increment, error)
            if (allocated(error)) return
            n_increment = n_increment + 1
            n_cut = n_cut + increment%n_cut
            call check_near(error, [increment%h, increment%done], spread(march%state%clock%time &
               - before, 1, 2), 16.0_wp*eps, 1.0_wp, "size")
            call check_near(error, march%state%clock%step_time, march%state%clock%time, &
               0.0_wp, 1.0_wp, "time of the step")
            part = increment%h/h
            if (n_increment == 1) part = 0.5_wp*part
            call check_near(error, fraction(part), 0.5_wp, 16.0_wp*eps, 1.0_wp, "power of two")
            call check_near(error, march%ledger%total, total, 1.0e3_wp*eps, total, "energy")
            if (mod(n_increment, 2) == 1 .and. .not. allocated(error)) call march_resume(march, &
               scene, error)
            if (allocated(error)) return
            call check_near(error, [march%state%clock%step_time, march%ledger%total], &
               [march%state%clock%time, total], 1.0e3_wp*eps, total, "taken up again")
            n_between = n_between + merge(1, 0, march%state%clock%n_part > 0)
            call check_near(error, march%ledger%momentum, momentum &
               + [0.5_wp*pull*march%state%clock%time**2, 0.0_wp], 1.0e3_wp*eps, 4.0_wp, "momentum")
         end do
         associate (control => march%state%control)
            call check_near(error, march%state%clock%time, n*h, 0.0_wp, 1.0_wp, "end")
            call check_equal(error, sum(control%n_size), n_increment + 1, "sizes, first twice")
            call check_equal(error, control%n_less(why_error), n_cut, "given up")
            call check_equal(error, sum(control%n_less), n_cut, "for nothing else")
            call check_equal(error, control%n_over, 0, "all as asked for")
            call check_true(error, n_cut > 0 .eqv. k == 2, "cuts: " // to_text(n_cut))
            call check_true(error, (n_increment > n) .eqv. k == 2, "of " // to_text(n_increment))
            call check_true(error, (n_between > 0) .eqv. k == 2, "between points of the grid")
         end associate
         call march_free(march)
      end subroutine run

   end subroutine test_counts

   !> A block thrown on another, both elastic: of each increment the error by its mean forces and
   !> velocities and those of the increments before, and what contact adds where it changes.
   subroutine test_error(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: constant = 1.0_wp/12.0_wp, tolerance = 10.0_wp
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(march_t) :: march
      type(increment_t) :: increment
      real(wp), dimension(2, 16) :: mass, v, u, force, push, mean, change, last_force, last_push, &
         last_mean, rate, last_rate
      real(wp) :: size, last_size, last_span, span, kinetic, smooth, whole, expected
      logical :: was_active(3)
      integer :: i, n_changed

      call make_two_blocks(scene, 0.05_wp, lower, upper)
      call add_step(scene, .false., 0.02_wp, 40)
      scene%step(1)%contact%initiation = initiation_persistent
      scene%step(1)%time%is_direct = .false.
      scene%step(1)%time%tolerance = tolerance
      call clamp(scene%step(1), [(i, i = 1, 5)])
      scene%v0(1, 11:) = 0.3_wp
      scene%v0(2, 11:) = -1.0_wp - 0.1_wp*scene%x(2, 11:)
      call begin(scene, march, error)
      if (allocated(error)) return
      v = 1.0_wp
      call mass_times(march%system, v, mass)
      mass(:, :5) = 0.0_wp
      kinetic = march%ledger%kinetic
      n_changed = 0
      last_rate = 0.0_wp
      last_span = 0.0_wp
      do i = 1, 14
         v = march%state%v
         u = march%state%u
         was_active = march%state%contacts%is_active(:3)
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         kinetic = max(kinetic, march%ledger%kinetic)
         size = increment%h
         mean = (march%state%u - u)/size
         push = march%state%contact
         change = (march%state%v - v)/size
         call mass_times(march%system, change, force)
         force = force - push
         if (i > 2) then
            span = 0.5_wp*(size + last_size)
            rate = (mean - last_mean)/span
            if (i > 3) then
               change = 2.0_wp*(rate - last_rate)/(span + last_span)
               smooth = error_of(force - last_force)
               whole = error_of(force - last_force + push - last_push)
               expected = smooth
               if (any(was_active .neqv. march%state%contacts%is_active(:3))) then
                  n_changed = n_changed + 1
                  expected = max(smooth, whole*sqrt(smooth/constant))
               end if
               call check_near(error, march%step_check%ratio, expected/tolerance, &
                  1.0e7_wp*eps, 1.0_wp, "error of increment " // to_text(i))
            end if
            last_rate = rate
            last_span = span
         end if
         last_size = size
         last_mean = mean
         last_force = force
         last_push = push
      end do
      call check_true(error, n_changed > 0, "contact begins")
      call march_free(march)

   contains

      real(wp) function error_of(change_of_force)
         real(wp), intent(in) :: change_of_force(:, :)

         error_of = constant*size**2*sqrt(sum(mass*min(abs(change_of_force &
            /(max(mass, tiny(1.0_wp))*span)), abs(change))**2, mass > 0.0_wp)/(2.0_wp*kinetic))
      end function error_of

   end subroutine test_error

   !> An increment of a size of its own says nothing of the error of those that follow.
   subroutine test_own_size(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment

      call make_spin(scene, 1.0e-3_wp, 60)
      call begin(scene, march, error)
      if (.not. allocated(error)) call march_increment(march, scene, increment, error)
      if (allocated(error)) return
      call check_true(error, march%state%control%h_before > 0.0_wp .and. &
         march%state%control%n_known > 0, "the error is known")
      call march_free_increment(march, scene, 0.3_wp*h, increment, error)
      if (allocated(error)) return
      call check_near(error, march%state%control%h_before, 0.0_wp, 0.0_wp, 1.0_wp, "size before")
      call check_equal(error, march%state%control%n_known, 0, "increments known")
      call check_true(error, .not. march%grid%judges_size, "no size was judged")
      call march_free(march)
   end subroutine test_own_size

   !> An increment of a size that was found by trying is, bit by bit, the same as one that is tried
   !> at once; of long ones the factor was made on the way.
   subroutine test_retry(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      do k = 1, 5, 4
         call look_at_retry(error, real(k, wp))
         if (allocated(error)) return
      end do
   end subroutine test_retry

   subroutine look_at_retry(error, times)
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in) :: times              !! of h, that the increments of the deck take
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment, at_once
      integer :: power

      call make_spin(scene, 1.0e-5_wp, 60)
      scene%step(1)%time%h = times*h
      scene%step(1)%time%duration = n*times*h
      scene%step(1)%solution%newton = newton_kept
      call begin(scene, march, error)
      if (.not. allocated(error)) call march_increment(march, scene, increment, error)
      if (allocated(error)) return
      call check_true(error, increment%n_cut > 0, "tried larger ones")
      power = nint(log(0.5_wp*increment%h/(times*h))/log(2.0_wp)) + 1
      block
         type(march_t) :: other

         call begin(scene, other, error)
         if (allocated(error)) return
         other%state%control%power = power
         call march_increment(other, scene, at_once, error)
         if (allocated(error)) return
         call check_equal(error, at_once%n_cut, 0, "at once")
         associate (now => march%state, then => other%state)
            call check_true(error, now%base%is_set, "a factor is kept")
            call check_near(error, [increment%h, increment%done, now%clock%time, now%base%h], &
               [at_once%h, at_once%done, then%clock%time, then%base%h], 0.0_wp, 1.0_wp, "sizes")
            call check_near(error, [now%u, now%v, now%internal], [then%u, then%v, then%internal], &
               0.0_wp, 1.0_wp, "state")
            call check_equal(error, [now%clock%increment, now%clock%n_grid, now%clock%n_part, &
               now%control%n_known, now%base%increment, now%base%n_least], [then%clock%increment, &
               then%clock%n_grid, then%clock%n_part, then%control%n_known, then%base%increment, &
               then%base%n_least], "counts")
         end associate
         call check_near(error, [march%ledger%total, march%ledger%kinetic], [other%ledger%total, &
            other%ledger%kinetic], 0.0_wp, 1.0_wp, "energies")
         call march_free(other)
      end block
      call march_free(march)
   end subroutine look_at_retry

   !> Two halves of a block whose nodes move alike have the errors of the block.
   subroutine test_linked(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: of_half(8) = [1, 2, 4, 5, 2, 3, 5, 6]
      type(scene_t) :: scene, halves
      type(block_t) :: block
      type(march_t) :: march, other
      type(increment_t) :: increment, as_well
      integer :: i, a

      call make_spin(scene, 1.0e-3_wp, 60)
      call make_block(halves, "CPE4", [1, 1], block)
      call add_block(halves, "CPE4", [1, 1], [1.0_wp, 0.0_wp], [1.0_wp, 1.0_wp], block)
      do a = 1, 2
         call add_equation(halves, [5, 2], [a, a], [1.0_wp, -1.0_wp])
         call add_equation(halves, [7, 4], [a, a], [1.0_wp, -1.0_wp])
      end do
      halves%step = scene%step
      halves%v0 = scene%v0(:, of_half)
      call begin(scene, march, error)
      if (.not. allocated(error)) call begin(halves, other, error)
      do i = 1, 8
         if (allocated(error)) return
         call march_increment(march, scene, increment, error)
         if (.not. allocated(error)) call march_increment(other, halves, as_well, error)
         if (allocated(error)) return
         call check_near(error, other%state%u, march%state%u(:, of_half), 1.0e4_wp*eps, 1.0_wp, &
            "displacements")
         call check_near(error, as_well%h, increment%h, 4.0_wp*eps, 1.0_wp, "sizes")
         call check_near(error, other%step_check%ratio, march%step_check%ratio, 1.0e7_wp*eps, &
            1.0_wp, "errors")
      end do
      call march_free(march)
      call march_free(other)
   end subroutine test_linked

   !> Sums of rows where nodes move freely; none of supports and of a rigid body.
   subroutine test_masses(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: row(12) = 0.25_wp*[1.0_wp, 2.0_wp, 1.0_wp, 1.0_wp, 2.0_wp, 1.0_wp, &
         0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
      type(scene_t) :: scene
      type(block_t) :: block
      type(march_t) :: march
      real(wp) :: expected(2, 12)
      integer :: i

      call make_block(scene, "CPE4", [2, 1], block)
      call add_block(scene, "CPE4", [2, 1], [4.0_wp, 0.0_wp], [2.0_wp, 1.0_wp], block)
      deallocate(scene%rigid)
      allocate(scene%rigid(1))
      associate (body => scene%rigid(1))
         body%name = "SECOND"
         body%reference = 7
         body%element = [3, 4]
         body%node = [(i, i = 7, 12)]
         call rigid_frame_choose(scene%x, body%node, body%reference, body%frame)
      end associate
      call add_step(scene, .false., h, n)
      scene%step(1)%time%is_direct = .false.
      scene%step(1)%time%tolerance = 1.0_wp
      call prescribe(scene%step(1), 1, 2, 0.0_wp)
      call begin(scene, march, error)
      if (allocated(error)) return
      expected = spread(row, 1, 2)
      expected(2, 1) = 0.0_wp
      call check_near(error, march%step_check%estimate%mass, expected, 64.0_wp*eps, 1.0_wp, "mass")
      call march_free(march)
   end subroutine test_masses

   !> A block falls flat on another one, after two and a half increments. The first try that passes
   !> that tells where it is: an increment ends just before. The next one is a window long; shares
   !> below a sixteenth are not tried at once.
   subroutine test_event(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: size = 0.02_wp, at = 0.05_wp, window = 0.01_wp
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(march_t) :: march
      type(increment_t) :: increment
      real(wp) :: before
      integer :: i, n_told

      call make_two_blocks(scene, at, lower, upper)
      call add_step(scene, .false., size, 10)
      scene%step(1)%contact%initiation = initiation_persistent
      scene%step(1)%time%is_direct = .false.
      scene%step(1)%time%event_fraction = window
      scene%v0(2, 11:) = -1.0_wp
      call begin(scene, march, error)
      if (allocated(error)) return
      n_told = 0
      do while (n_told == 0 .and. march%state%clock%time < 2.0_wp*at)
         before = march%state%clock%time
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         do i = 1, increment%notes%n
            if (index(increment%notes%item(i)%text, "event: contact begins in pair 1") == 1) then
               n_told = n_told + 1
            end if
         end do
         if (n_told > 0) exit
         call check_true(error, march%state%clock%time <= at, "none is passed")
      end do
      call check_equal(error, [n_told, march%state%control%n_event], [3, 3], "nodes that meet")
      call check_true(error, before <= at .and. march%state%clock%time >= at .and. &
         increment%h <= window*size, "when, within " // to_text(increment%h))
      call check_equal(error, [march%state%control%n_less(why_event), increment%n_cut], [3, 2], &
         "tries that passed it")
      call march_free(march)
   end subroutine test_event

   !> A block that falls ever faster: what velocities at the start say is too late, and halves of
   !> that are tried, however narrow the window.
   subroutine test_early(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: longest = 0.06_wp, at = 0.05_wp, window = 1.0e-3_wp, gravity = 100.0_wp
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(march_t) :: march
      type(increment_t) :: increment
      type(load_t) :: load
      integer :: i

      call make_two_blocks(scene, at, lower, upper)
      call add_step(scene, .false., longest, 10)
      call clamp(scene%step(1), [(i, i = 1, 10)])
      scene%step(1)%time%is_direct = .false.
      scene%step(1)%time%event_fraction = window
      scene%v0(2, 11:) = -1.0_wp
      load%kind = load_gravity
      load%value = gravity
      load%direction(:2) = [0.0_wp, -1.0_wp]
      do i = upper%elements_before + 1, size(scene%element%kind)
         load%target = i
         call add_load(scene%step(1), load)
      end do
      call begin(scene, march, error)
      if (.not. allocated(error)) call march_increment(march, scene, increment, error)
      if (allocated(error)) return
      ! After t + g t**2/2 = at they meet.
      associate (t => (sqrt(1.0_wp + 2.0_wp*gravity*at) - 1.0_wp)/gravity)
         call check_equal(error, increment%n_cut, 1 + ceiling(log(at/t)/log(2.0_wp)), "tries")
      end associate
      call check_near(error, march%state%clock%time, at*0.5_wp**(increment%n_cut - 1), &
         increment%n_cut*window*longest, 1.0_wp, "as far as nothing meets")
      call march_free(march)
   end subroutine test_early

   !> Where increments end at events alone one that is cut says nothing of the next ones: twice from
   !> the size of the deck, to a half of it and then to an eighth.
   subroutine test_cut(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: part(2) = [0.5_wp, 0.625_wp]
      integer, parameter :: n_cut(2) = [1, 2]
      type(scene_t) :: scene
      type(stepper_t) :: stepper
      type(chain_host_t) :: chain
      type(increment_t) :: increment
      integer :: k

      call make_line(scene, 2, .false., h, n)
      scene%step(1)%time%is_direct = .false.
      scene%step(1)%time%event_fraction = 0.01_wp
      scene%v0(1, 2) = 1.0_wp
      call chain_host_init(chain, [1, 2], 2, error)
      if (allocated(error)) return
      chain%k = 0.01_wp
      chain%longest = 0.7_wp*h
      call open_given(stepper, scene, chain, 1.0_wp, error)
      do k = 1, 2
         if (.not. allocated(error)) call stepper_advance(stepper, increment, error)
         if (allocated(error)) return
         associate (state => stepper%march%state)
            call check_near(error, state%clock%time, part(k)*h, 16.0_wp*eps, h, "time")
            call check_equal(error, [increment%n_cut, state%control%power], [n_cut(k), 0], &
               "cuts, and the size that comes")
         end associate
      end do
      call stepper_close(stepper)
   end subroutine test_cut

   !> A spring that may not be longer than a part of h, at the velocity 1: the first half of the
   !> first increment is shorter, the second one is cut until it is, to a sixteenth of the
   !> increment.
   subroutine test_second(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: longest = 0.7_wp*h
      type(scene_t) :: scene
      type(stepper_t) :: stepper
      type(chain_host_t) :: chain
      type(increment_t) :: increment

      call make_line(scene, 2, .false., h, n)
      scene%step(1)%time%is_direct = .false.
      scene%step(1)%time%tolerance = 1.0_wp
      scene%v0(1, 2) = 1.0_wp
      call chain_host_init(chain, [1, 2], 2, error)
      if (allocated(error)) return
      chain%k = 0.01_wp
      chain%longest = longest
      call open_given(stepper, scene, chain, 1.0_wp, error)
      if (.not. allocated(error)) call stepper_advance(stepper, increment, error)
      if (allocated(error)) return
      associate (state => stepper%march%state)
         call check_near(error, [increment%h, increment%done, state%clock%time, &
            state%clock%step_time], spread(0.625_wp*h, 1, 4), 16.0_wp*eps, h, "in all")
         call check_near(error, state%u(1, 2) - state%u(1, 1), 0.625_wp*h, h**2, h, "as far")
      end associate
      call stepper_close(stepper)
   end subroutine test_second

   !> More than half of the iterations allowed: the next increments are shorter if the error counts.
   subroutine test_slow(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      integer :: k

      do k = 1, 3
         call make_spin(scene, merge(0.0_wp, 1.0_wp, k == 3), merge(20, 5, k == 1))
         if (k == 3) scene%step(1)%time%event_fraction = 0.01_wp
         call run()
         if (allocated(error)) return
      end do

   contains

      subroutine run()
         type(march_t) :: march
         type(increment_t) :: increment
         integer :: i

         call begin(scene, march, error)
         if (allocated(error)) return
         do i = 1, 4
            call march_increment(march, scene, increment, error)
            if (allocated(error)) return
         end do
         call check_true(error, march%state%control%n_less(why_newton) > 0 .eqv. k == 2, &
            "slow ones " // to_text(march%state%control%n_less(why_newton)))
         call check_true(error, increment%h < h .eqv. k == 2, "size")
         call march_free(march)
      end subroutine run

   end subroutine test_slow

   !> Two blocks fly at each other, and past each other far away: no error, so that increments grow
   !> at each chance. They are longer than that of the deck while the bodies' boxes, moved by the
   !> speeds, stay apart: one above the other, or beside it.
   subroutine test_apart(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: speed(2) = [0.25_wp, 1.0_wp], gap = 8.0_wp
      integer, parameter :: n_long = 56
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      integer :: k

      do k = 1, 3
         call make_two_blocks(scene, gap, lower, upper)
         if (k == 2) scene%x(1, 11:) = scene%x(1, 11:) - 4.5_wp - 1.25_wp*n_long*h
         if (k == 3) scene%pair = scene%pair(:0)
         call add_step(scene, .false., h, n_long)
         scene%step(1)%time%is_direct = .false.
         scene%step(1)%time%tolerance = 1.0_wp
         scene%v0(2, :10) = speed(1)
         scene%v0(2, 11:) = -speed(2)
         call run()
         if (allocated(error)) return
      end do

   contains

      subroutine run()
         type(march_t) :: march
         type(increment_t) :: increment
         real(wp) :: left, size, part
         integer(int64) :: from
         integer :: n_held, n_long_ones, i_power

         call begin(scene, march, error)
         if (allocated(error)) return
         n_held = 0
         n_long_ones = 0
         do while (march%state%clock%time < merge(6.25_wp, n_long*h, k == 1))
            left = gap - sum(speed)*march%state%clock%time
            i_power = march%state%control%power
            do while (k == 1 .and. i_power > 0)
               if (left > sum(speed)*scale(h, i_power)) exit
               i_power = i_power - 1
            end do
            if (i_power < march%state%control%power) n_held = n_held + 1
            ! To the next multiple of the size, or the end of the step.
            from = nint(march%state%clock%time/h, int64)
            size = real(min(2_int64**i_power - mod(from, 2_int64**i_power), n_long - from), wp)
            part = march%state%control%h_before
            call march_increment(march, scene, increment, error)
            if (allocated(error)) return
            if (part > 0.0_wp) call check_near(error, increment%h/h, size, 16.0_wp*eps, 1.0_wp, &
               "size, way " // to_text(k))
            if (increment%h > 1.5_wp*h) n_long_ones = n_long_ones + 1
            if (allocated(error)) return
         end do
         call check_true(error, n_long_ones > 3 .and. (n_held > 0 .eqv. k == 1), "long ones " &
            // to_text(n_long_ones) // ", held back " // to_text(n_held))
         call march_free(march)
      end subroutine run

   end subroutine test_apart

   !> A block that flies has no error: its increments grow, unless its surface is paired with
   !> itself.
   subroutine test_self(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      integer :: k

      do k = 0, 1
         call make_block(scene, "CPE4", [2, 1], block)
         call add_surface(scene, "ALL", block, [bottom, right, top, left])
         if (k == 1) scene%pair = [contact_pair_t(slave=1, master=1)]
         call add_step(scene, .false., h, 4*n)
         scene%step(1)%time%is_direct = .false.
         scene%step(1)%time%tolerance = 1.0_wp
         scene%v0(1, :) = 1.0_wp
         call run()
         if (allocated(error)) return
      end do

   contains

      subroutine run()
         type(march_t) :: march
         type(increment_t) :: increment
         real(wp) :: longest
         integer :: i

         call begin(scene, march, error)
         if (allocated(error)) return
         longest = 0.0_wp
         do i = 1, n
            call march_increment(march, scene, increment, error)
            if (allocated(error)) return
            longest = max(longest, increment%h)
         end do
         call check_equal(error, march%system%space%n_body, 1, "bodies")
         call check_true(error, longest > 1.5_wp*h .eqv. k == 0, "the longest is " &
            // to_text(longest))
         call march_free(march)
      end subroutine run

   end subroutine test_self

   !> With the increment of the deck as the smallest each is taken as it is, and told.
   subroutine test_least(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      integer :: i

      call make_spin(scene, 1.0e-6_wp, 20)
      scene%step(1)%time%h_min = h
      call begin(scene, march, error)
      if (allocated(error)) return
      do i = 1, n
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         call check_near(error, [increment%h, march%state%clock%time], [h, i*h], 0.0_wp, 1.0_wp, &
            "increment " // to_text(i))
         call check_equal(error, increment%n_cut, 0, "cuts")
      end do
      call check_true(error, march_is_done(march), "all are done")
      call check_equal(error, march%state%control%n_size(0), n, "sizes")
      call check_true(error, march%state%control%n_over > n - 3, "with too large an error")
      call march_free(march)
   end subroutine test_least

   !> One iteration never suffices: every size is tried once, and the state is left as it was.
   subroutine test_failure(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment

      call make_spin(scene, 1.0e-2_wp, 1)
      scene%step(1)%time%h_min = 0.125_wp*h
      call begin(scene, march, error)
      if (allocated(error)) return
      call march_increment(march, scene, increment, raised)
      call check_error(error, raised, err_analysis, "with h = 0.015625, the smallest allowed, " &
         // "Newton's method does not converge", "failure")
      call check_near(error, march%state%u, scene%u0, 0.0_wp, 1.0_wp, "displacements")
      call check_near(error, march%state%v, scene%v0, 0.0_wp, 1.0_wp, "velocities")
      call check_near(error, [march%state%clock%time, march%state%clock%step_time], [0.0_wp, &
         0.0_wp], 0.0_wp, 1.0_wp, "time")
      call march_free(march)
   end subroutine test_failure

   !> A chain that no spring may stretch, and whose ends move apart: without a smallest increment of
   !> the deck they are halved down to the last level of the grid, each once.
   subroutine test_far_below(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(stepper_t) :: stepper
      type(chain_host_t) :: chain
      type(increment_t) :: increment

      call make_line(scene, 2, .false., h, n)
      scene%step(1)%time%is_direct = .false.
      scene%step(1)%time%tolerance = 1.0_wp
      scene%v0(1, 2) = 1.0_wp
      call chain_host_init(chain, [1, 2], 2, error)
      if (allocated(error)) return
      chain%longest = 0.0_wp
      call open_given(stepper, scene, chain, 1.0_wp, error)
      if (allocated(error)) return
      call stepper_advance(stepper, increment, raised)
      associate (n_level => stepper%march%grid%n_level)
         call check_error(error, raised, err_analysis, "with h = " // to_text(scale(h, -n_level)) &
            // ", the smallest allowed", "failure")
         ! The first increment is two, of the half each.
         call check_equal(error, increment%n_cut, n_level, "sizes")
      end associate
      call stepper_close(stepper)
   end subroutine test_far_below

end module test_march_control
