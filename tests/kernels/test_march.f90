!> The march: patch test, grid and cuts, limits, driven motion and loads in the ledger.
module test_march
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_amplitudes, only : amplitude_t
   use emcon_errors, only : err_analysis, error_t
   use emcon_kinds, only : dp, wp
   use emcon_ledger, only : ledger_t
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_is_done, march_t
   use emcon_scene, only : scene_t
   use emcon_steps, only : load_gravity, load_t, newton_kept
   use emcon_text, only : to_text
   use small_scenes, only : add_load, add_step, block_t, clamp, make_block, prescribe, shake, young
   implicit none
   private
   public :: collect_march

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   real(wp), parameter :: tol = 450.0_wp*eps

contains

   subroutine collect_march(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("static patch", test_patch), &
         test_case_t("all degrees of freedom prescribed", test_all_prescribed), &
         test_case_t("cut and back on the grid", test_cut), &
         test_case_t("inversion is cut", test_inversion), &
         test_case_t("last increment ends at the duration", test_remainder), &
         test_case_t("automatic increments grow on the grid", test_growth), &
         test_case_t("automatic increments shrink after a cut", test_shrink), &
         test_case_t("increments used up", test_used_up), &
         test_case_t("smallest increment fails", test_failure), &
         test_case_t("inverted at the start", test_inverted_start), &
         test_case_t("free motion in statics", test_free_motion), &
         test_case_t("driven motion in the ledger", test_driven), &
         test_case_t("gravity in the ledger", test_gravity), &
         test_case_t("each factor that is kept is counted once", test_factors)]
   end subroutine collect_march

   subroutine begin(scene, march, error)
      type(scene_t), intent(in) :: scene
      type(march_t), intent(inout) :: march
      type(error_t), allocatable, intent(out) :: error

      call march_init(march, scene, error)
      if (allocated(error)) return
      call march_begin_step(march, scene, 1, error)
   end subroutine begin

   !> The edges of a distorted mesh go to a linear field: so does its inside, and the reactions are
   !> those of a uniform stress.
   subroutine test_patch(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(increment_t) :: increment
      real(wp), parameter :: grad(2, 2) = reshape([0.1_wp, -0.05_wp, 0.2_wp, -0.15_wp], [2, 2])
      real(wp) :: move(2, 16), u(2, 16)
      integer, parameter :: inside(4) = [6, 7, 10, 11]
      character(len=4), parameter :: name(2) = ["CPE3", "CPE4"]
      integer :: i, k

      do k = 1, 4
         call make_block(scene, name(1 + mod(k, 2)), [3, 3], block)
         call shake(move, 0.25_wp)
         scene%x(:, inside) = scene%x(:, inside) + move(:, inside)
         u = matmul(grad, scene%x)
         call add_step(scene, .true., 1.0_wp, 1)
         scene%step(1)%nlgeom = k > 2
         do i = 1, 16
            if (any(i == inside)) cycle
            call prescribe(scene%step(1), i, 1, u(1, i))
            call prescribe(scene%step(1), i, 2, u(2, i))
         end do
         call run_patch()
         if (allocated(error)) return
      end do

   contains

      subroutine run_patch()
         type(march_t) :: fresh

         call begin(scene, fresh, error)
         if (allocated(error)) return
         call march_increment(fresh, scene, increment, error)
         if (allocated(error)) return
         call check_near(error, fresh%state%u, u, tol, 1.0_wp, "displacements " // to_text(k))
         call check_near(error, sum(fresh%state%reaction, dim=2), [0.0_wp, 0.0_wp], tol, young, &
            "sum of the reactions " // to_text(k))
         call march_free(fresh)
      end subroutine run_patch

   end subroutine test_patch

   !> One element without unknowns: the reactions are its internal forces.
   subroutine test_all_prescribed(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(march_t) :: march
      type(increment_t) :: increment

      call make_block(scene, "CPE4", [1, 1], block)
      call add_step(scene, .true., 0.5_wp, 2)
      call clamp(scene%step(1), [1, 2])
      call prescribe(scene%step(1), 3, 1, 0.0_wp)
      call prescribe(scene%step(1), 4, 1, 0.0_wp)
      call prescribe(scene%step(1), 3, 2, 0.25_wp)
      call prescribe(scene%step(1), 4, 2, 0.25_wp)
      call begin(scene, march, error)
      if (allocated(error)) return
      do while (.not. march_is_done(march))
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
      end do
      call check_near(error, march%state%u(2, :), [0.0_wp, 0.0_wp, 0.25_wp, 0.25_wp], 0.0_wp, &
         1.0_wp, "displacements")
      call check_true(error, march%state%reaction(2, 3) > 0.1_wp*young, "pulled upwards")
      call check_near(error, march%state%reaction, march%state%internal, tol, young, "reactions")
      call march_free(march)
   end subroutine test_all_prescribed

   !> A spinning, stretched block; `h` and the iterations allowed are the caller's.
   subroutine make_spin(scene, h, n, maximum)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: h
      integer, intent(in) :: n, maximum
      type(block_t) :: block

      call make_block(scene, "CPE4", [2, 1], block)
      call add_step(scene, .false., h, n)
      scene%step(1)%solution%newton_maximum = maximum
      scene%v0(1, :) = -2.0_wp*scene%x(2, :) + 0.5_wp*scene%x(1, :)
      scene%v0(2, :) = 2.0_wp*scene%x(1, :)
   end subroutine make_spin

   !> Two iterations do not suffice for h, but for a part of it: all conserved, in parts as in whole
   !> increments, and every increment ends where it would have without a cut. To the digits of
   !> single precision they suffice for 0.1.
   subroutine test_cut(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      type(ledger_t) :: start
      integer :: k, n_cut
      real(wp), parameter :: h = merge(0.1_wp, 0.2_wp, eps < 1.0e-10_wp)

      call make_spin(scene, h, 10, 2)
      call begin(scene, march, error)
      if (allocated(error)) return
      start = march%ledger
      n_cut = 0
      do k = 1, 10
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         n_cut = n_cut + increment%n_cut
         call check_equal(error, increment%notes%n, increment%n_cut, "notes of cuts")
         call check_near(error, march%state%clock%time, real(k, wp)*h, 0.0_wp, 1.0_wp, "time")
         call check_near(error, increment%h, h, 2.0_wp*eps, 1.0_wp, "increment")
         call check_near(error, march%ledger%total, start%total, tol, start%total, "energy")
         call check_near(error, [march%ledger%momentum, march%ledger%angular], &
            [start%momentum, start%angular], tol, start%angular(1), "momenta")
      end do
      call check_true(error, n_cut > 0, "something was cut")
      call march_free(march)
   end subroutine test_cut

   !> The right half is thrown at the left one: the first guess of a large step goes through it.
   subroutine test_inversion(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(march_t) :: march
      type(increment_t) :: increment
      real(wp) :: total

      call make_block(scene, "CPE4", [2, 1], block)
      call add_step(scene, .false., 0.5_wp, 2)
      scene%v0(1, [3, 6]) = -8.0_wp
      call begin(scene, march, error)
      if (allocated(error)) return
      total = march%ledger%total
      call march_increment(march, scene, increment, error)
      if (allocated(error)) return
      call check_true(error, all(scene%x(1, [3, 6]) + march%state%u(1, [3, 6]) &
         > scene%x(1, [2, 5]) + march%state%u(1, [2, 5])), "the right half stays on the right")
      call check_near(error, march%ledger%total, total, tol, total, "energy")
      call check_near(error, march%state%clock%time, 0.5_wp, 0.0_wp, 1.0_wp, "time")
      call march_free(march)
   end subroutine test_inversion

   !> 0.35 by steps of 0.1, not as 0.1 + 0.1 + 0.1 + 0.1.
   subroutine test_remainder(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      integer :: n

      call make_spin(scene, 0.1_wp, 4, 20)
      scene%step(1)%time%duration = 0.35_wp
      call begin(scene, march, error)
      if (allocated(error)) return
      n = 0
      do while (.not. march_is_done(march))
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         n = n + 1
      end do
      call check_equal(error, n, 4, "increments")
      call check_near(error, march%state%clock%time, 0.35_wp, 0.0_wp, 1.0_wp, "time at the end")
      call check_near(error, increment%h, 0.05_wp, 8.0_wp*eps, 1.0_wp, "last increment")
      call march_free(march)
   end subroutine test_remainder

   !> Statics may take larger increments after easy ones; times stay multiples of h.
   subroutine test_growth(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(march_t) :: march
      type(increment_t) :: increment
      real(wp) :: largest
      integer :: n

      call make_block(scene, "CPE4", [1, 1], block)
      call add_step(scene, .true., 0.01_wp, 100)
      scene%step(1)%time%is_direct = .false.
      call clamp(scene%step(1), [1, 2])
      call prescribe(scene%step(1), 3, 1, 0.2_wp)
      scene%step(1)%time%h_max = 0.05_wp
      call begin(scene, march, error)
      if (allocated(error)) return
      n = 0
      largest = 0.0_wp
      do while (.not. march_is_done(march))
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         n = n + 1
         largest = max(largest, increment%h)
         call check_near(error, march%state%clock%time/0.01_wp, &
            anint(march%state%clock%time/0.01_wp), 8.0_wp*eps, 100.0_wp, "time over h")
      end do
      call check_true(error, n < 50, "increments grow: " // to_text(n))
      call check_near(error, largest, 0.04_wp, 64.0_wp*eps, 1.0_wp, "up to four, below the largest")
      call check_near(error, march%state%clock%time, 1.0_wp, 0.0_wp, 1.0_wp, "time at the end")
      call check_near(error, march%state%u(1, 3), 0.2_wp, 4.0_wp*eps, 1.0_wp, "driven node")
      call march_free(march)
   end subroutine test_growth

   !> Few iterations are allowed: what is too long is cut. Twice as long after five that were not,
   !> half as long after one that was.
   subroutine test_shrink(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(march_t) :: march
      type(increment_t) :: increment
      integer :: stride, n_easy, n_shrunk, done

      call make_block(scene, "CPE4", [1, 1], block)
      call add_step(scene, .true., 0.01_wp, 100)
      scene%step(1)%time%is_direct = .false.
      scene%step(1)%solution%newton_maximum = 3
      call clamp(scene%step(1), [1, 2])
      call prescribe(scene%step(1), 3, 1, 3.0_wp)
      call begin(scene, march, error)
      if (allocated(error)) return
      stride = 1
      n_easy = 0
      n_shrunk = 0
      done = 0
      do while (.not. march_is_done(march))
         stride = min(stride, 100 - done)
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         call check_near(error, increment%h, 0.01_wp*stride, 64.0_wp*eps, 1.0_wp, "after " &
            // to_text(done))
         if (allocated(error)) return
         done = done + stride
         n_easy = n_easy + 1
         if (increment%n_cut > 0) then
            n_easy = 0
            if (stride > 1) n_shrunk = n_shrunk + 1
            stride = max(1, stride/2)
         else if (n_easy == 5 .and. 2*stride <= march%grid%most_stride) then
            stride = 2*stride
            n_easy = 0
         end if
      end do
      call check_true(error, n_shrunk > 1, "some were too long")
      call march_free(march)
   end subroutine test_shrink

   subroutine test_used_up(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      integer :: k

      call make_spin(scene, 0.01_wp, 10, 20)
      scene%step(1)%time%max_increments = 3
      call begin(scene, march, error)
      if (allocated(error)) return
      do k = 1, 3
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
      end do
      call march_increment(march, scene, increment, raised)
      call check_error(error, raised, err_analysis, "INC", "a fourth increment of three")
      call march_free(march)
   end subroutine test_used_up

   !> One iteration never suffices: the analysis ends with a reason, its state is the last good one.
   subroutine test_failure(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment

      call make_spin(scene, 0.1_wp, 10, 1)
      scene%step(1)%time%h_min = 0.05_wp
      call begin(scene, march, error)
      if (allocated(error)) return
      call march_increment(march, scene, increment, raised)
      call check_error(error, raised, err_analysis, "does not converge", "failure")
      call check_near(error, march%state%u, scene%u0, 0.0_wp, 1.0_wp, "displacements")
      call check_near(error, march%state%v, scene%v0, 0.0_wp, 1.0_wp, "velocities")
      call march_free(march)
   end subroutine test_failure

   subroutine test_inverted_start(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(march_t) :: march

      call make_spin(scene, 0.1_wp, 10, 20)
      scene%u0(1, [3, 6]) = -1.5_wp
      scene%element%label = [5, 88]
      call begin(scene, march, raised)
      call check_error(error, raised, err_analysis, "element 88", "inverted at the start")
      call march_free(march)
   end subroutine test_inverted_start

   subroutine test_free_motion(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: block
      type(march_t) :: march

      call make_block(scene, "CPE4", [1, 1], block)
      call add_step(scene, .true., 1.0_wp, 1)
      call prescribe(scene%step(1), 1, 1, 0.0_wp)
      call prescribe(scene%step(1), 1, 2, 0.0_wp)
      call begin(scene, march, raised)
      call check_error(error, raised, err_analysis, "rotate", "one node held")
      call march_free(march)
   end subroutine test_free_motion

   !> A block shaken at its bottom: kinetic + strain - work of the supports stands.
   subroutine test_driven(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(march_t) :: march
      type(increment_t) :: increment
      real(wp) :: largest, drift
      integer :: i

      call make_block(scene, "CPE4", [2, 2], block)
      call add_step(scene, .false., 0.02_wp, 50)
      do i = 1, 3
         call prescribe(scene%step(1), i, 1, 0.3_wp)
         call prescribe(scene%step(1), i, 2, 0.0_wp)
      end do
      deallocate(scene%amplitude)
      allocate(scene%amplitude(1))
      scene%amplitude(1) = amplitude_t(name="A", time=[0.0_wp, 0.3_wp, 0.6_wp], &
         value=[0.0_wp, 1.0_wp, -0.5_wp])
      scene%step(1)%prescribed%amplitude = 1
      call begin(scene, march, error)
      if (allocated(error)) return
      largest = 0.0_wp
      drift = 0.0_wp
      do i = 1, 50
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         largest = max(largest, march%ledger%kinetic + march%ledger%strain)
         drift = max(drift, abs(march%ledger%total))
      end do
      call check_true(error, largest > 1.0_wp, "it is shaken")
      call check_near(error, drift, 0.0_wp, tol, largest, "total")
      call march_free(march)
   end subroutine test_driven

   !> A spinning block under gravity: momentum grows by the
   !> weight times the time, the total counts the work.
   subroutine test_gravity(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      type(ledger_t) :: start
      type(load_t) :: load
      integer :: k

      call make_spin(scene, 0.05_wp, 40, 20)
      load%kind = load_gravity
      load%value = 10.0_wp
      load%direction = [0.0_wp, -1.0_wp, 0.0_wp]
      do k = 1, 2
         load%target = k
         call add_load(scene%step(1), load)
      end do
      call begin(scene, march, error)
      if (allocated(error)) return
      start = march%ledger
      do k = 1, 40
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         call check_near(error, march%ledger%total, start%total, tol, &
            start%total + abs(march%ledger%external_work), "total")
         call check_near(error, march%ledger%momentum, &
            start%momentum + [0.0_wp, -20.0_wp*march%state%clock%time], tol, 40.0_wp, "momentum")
      end do
      call march_free(march)
   end subroutine test_gravity

   !> The state knows of which step the present factor is: a new one is one more factorisation.
   subroutine test_factors(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      integer :: i, last, n_factor

      call make_spin(scene, 0.02_wp, 120, 20)
      scene%step(1)%solution%newton = newton_kept
      call begin(scene, march, error)
      n_factor = 0
      last = -1
      do i = 1, 120
         if (allocated(error)) return
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         if (.not. march%state%base%is_set) cycle
         if (march%state%base%increment /= last) n_factor = n_factor + 1
         last = march%state%base%increment
      end do
      call check_true(error, n_factor > 2, "some")
      call check_equal(error, march%system%phases%n_factorisation, n_factor, "factorisations")
      call march_free(march)
   end subroutine test_factors

end module test_march
