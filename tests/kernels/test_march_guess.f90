!> The first guess of a step: free nodes go on, prescribed ones go where they are told to, dependent
!> ones follow; and the velocities that a motion ends with.
module test_march_guess
   use check, only : check_near, check_true, test_case_t
   use emcon_amplitudes, only : amplitude_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : instant_t
   use emcon_kinds, only : wp
   use emcon_march, only : march_begin_step, march_free, march_init, march_t
   use emcon_march_guess, only : end_velocities, march_guess
   use emcon_scene, only : scene_t
   use linear_scenes, only : add_tie_by_hand
   use small_scenes, only : add_step, block_t, make_block, prescribe, shake
   implicit none
   private
   public :: collect_march_guess

   real(wp), parameter :: tol = 16.0_wp*epsilon(1.0_wp)
   real(wp), parameter :: h = 0.25_wp, t0 = 0.5_wp

contains

   subroutine collect_march_guess(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("dynamics", test_dynamics), &
         test_case_t("statics", test_statics)]
   end subroutine collect_march_guess

   !> Four by one cells: node 1 goes by 2 t in x and stays in y; node 10 is the mean of 4 and 5.
   subroutine begin(scene, is_static, march, error)
      type(scene_t), intent(out) :: scene
      logical, intent(in) :: is_static
      type(march_t), intent(inout) :: march
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: block

      call make_block(scene, "CPE4", [4, 1], block)
      call shake(scene%v0, 1.0_wp)
      call shake(scene%u0, 0.01_wp)
      call add_tie_by_hand(scene, [10], reshape([4, 5], [2, 1]), reshape([0.5_wp, 0.5_wp], &
         [2, 1]), [1.0_wp])
      scene%amplitude = [amplitude_t(name="RAMP", time=[0.0_wp, 4.0_wp], value=[0.0_wp, 8.0_wp])]
      call add_step(scene, is_static, h, 4)
      call prescribe(scene%step(1), 1, 1, 1.0_wp)
      call prescribe(scene%step(1), 1, 2, 0.0_wp)
      call prescribe(scene%step(1), 2, 2, 0.0_wp)
      if (is_static) call prescribe(scene%step(1), 4, 1, 0.25_wp)
      scene%step(1)%prescribed(1)%amplitude = 1
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
   end subroutine begin

   subroutine test_dynamics(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      real(wp), dimension(2, 10) :: expected, v
      integer :: rest

      call begin(scene, .false., march, error)
      if (allocated(error)) return
      do rest = 0, 1
         call march_guess(march, scene, instant_t(step_time=t0, total_time=t0), h, rest == 1)
         associate (motion => march%motion, state => march%state)
            call check_near(error, motion%u0, state%u, 0.0_wp, 1.0_wp, "from the state")
            call check_near(error, motion%v0, state%v, 0.0_wp, 1.0_wp, "and its velocities")
            expected = 0.0_wp
            if (rest == 0) expected = h*state%v
            expected(:, 1) = [2.0_wp*(t0 + h), 0.0_wp] - state%u(:, 1)
            expected(2, 2) = -state%u(2, 2)
            expected(:, 10) = 0.5_wp*(expected(:, 4) + expected(:, 5))
            call check_near(error, motion%du, expected, tol, 1.0_wp, "motion")
            ! h (v0 + v1)/2 is what a prescribed motion would be by its velocities.
            v = 0.0_wp
            v(:, 1) = 0.5_wp*h*(state%v(:, 1) + [2.0_wp, 0.0_wp]) - expected(:, 1)
            v(2, 2) = 0.5_wp*h*state%v(2, 2) - expected(2, 2)
            call check_near(error, motion%offset, v, tol, 1.0_wp, "offset")
            call check_near(error, march%newton%driven, 0.0_wp*v, 0.0_wp, 1.0_wp, "nothing driven")
            call check_near(error, march%end_state%v(:, 1), [2.0_wp, 0.0_wp], tol, 1.0_wp, &
               "velocity that is prescribed")
            motion%du(:, 3:) = motion%du(:, 3:) + 0.125_wp
            v = 7.0_wp
            call end_velocities(march%system, motion, v)
            expected = 2.0_wp*motion%du/h - state%v
            expected(:, 1) = 7.0_wp
            expected(2, 2) = 7.0_wp
            expected(:, 10) = 0.5_wp*(expected(:, 4) + expected(:, 5))
            call check_near(error, v, expected, 4.0_wp*tol, 10.0_wp, "velocities at the end")
         end associate
      end do
      call march_free(march)
   end subroutine test_dynamics

   subroutine test_statics(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      real(wp) :: expected(2, 10)

      call begin(scene, .true., march, error)
      if (allocated(error)) return
      call march_guess(march, scene, instant_t(step_time=t0, total_time=t0), h, .false.)
      ! Without an amplitude it runs over the step, of a duration of 1, from where it starts.
      expected = 0.0_wp
      expected(1, 1) = 2.0_wp*(t0 + h) - march%state%u(1, 1)
      expected(2, :2) = -(t0 + h)*march%state%u(2, :2)
      expected(1, 4) = (t0 + h)*(0.25_wp - march%state%u(1, 4))
      expected(1, 10) = 0.5_wp*expected(1, 4)
      call check_near(error, march%motion%du, expected, tol, 1.0_wp, "motion")
      call check_near(error, march%newton%driven, expected, tol, 1.0_wp, "all of it is driven")
      call check_near(error, march%motion%offset, 0.0_wp*expected, 0.0_wp, 1.0_wp, "no offset")
      call check_true(error, abs(expected(2, 2)) > 0.0_wp, "it moves")
      call march_free(march)
   end subroutine test_statics

end module test_march_guess
