!> Energies, momenta and masses of bodies, and how rigid bodies have turned, in closed form.
module test_ledger
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_ledger, only : body_masses, body_momenta, ledger_init, ledger_measure, &
      ledger_momenta, ledger_t
   use emcon_march, only : march_begin_step, march_free, march_init, march_t
   use emcon_motion, only : motion_init, motion_t
   use emcon_rigid_bodies, only : rigid_body_t
   use emcon_rigid_rotation, only : rigid_rotation_init, rigid_rotation_measure, &
      rigid_rotation_spin, rigid_rotation_t
   use emcon_scene, only : scene_t
   use small_scenes, only : add_step, block_t, make_two_blocks, shake
   implicit none
   private
   public :: collect_ledger

   real(wp), parameter :: tol = 256.0_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))

contains

   subroutine collect_ledger(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("energies and momenta of two bodies", test_bodies), &
         test_case_t("what rigid bodies have turned by", test_turned), &
         test_case_t("moments of their supports", test_moment)]
   end subroutine collect_ledger

   !> Blocks of mass 4 and 2 that move as a whole: with 3, 1 and with -1, 2; or turn.
   subroutine test_bodies(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: v(2, 2) = reshape([3.0_wp, 1.0_wp, -1.0_wp, 2.0_wp], [2, 2])
      real(wp), parameter :: mass(2) = [4.0_wp, 2.0_wp]
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(march_t) :: march
      type(ledger_t) :: ledger
      real(dp), allocatable :: masses(:)
      real(wp) :: momenta(3, 2), expected(3, 2), centre(2, 2)

      call make_two_blocks(scene, 0.1_wp, lower, upper)
      call add_step(scene, .false., 0.1_wp, 1)
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      associate (state => march%state, system => march%system)
         state%u(1, :) = 0.25_wp
         state%u(2, :) = -0.5_wp
         centre = reshape([0.25_wp, -1.0_wp, 0.375_wp, 0.1_wp], [2, 2])
         state%v(:, :10) = spread(v(:, 1), 2, 10)
         state%v(:, 11:) = spread(v(:, 2), 2, 6)
         state%energy = [0.5_wp, 1.0_wp, 0.0_wp, 0.25_wp, 0.0_wp, 2.0_wp]
         state%potential = 8.0_wp
         call ledger_init(ledger, 2)
         ledger%external_work = 16.0_wp
         ledger%contact_energy = 32.0_wp
         call ledger_measure(ledger, system, scene%x, state)
         expected(:2, :) = spread(mass, 1, 2)*v
         expected(3, :) = centre(1, :)*expected(2, :) - centre(2, :)*expected(1, :)
         call check_near(error, [ledger%kinetic, ledger%strain, ledger%potential], [0.5_wp &
            *sum(mass*sum(v**2, 1)), 3.75_wp, 8.0_wp], tol, 10.0_wp, "energies")
         call check_near(error, ledger%total, ledger%kinetic + 3.75_wp + 8.0_wp + 32.0_wp &
            - 16.0_wp, tol, 100.0_wp, "total")
         call check_near(error, [ledger%momentum, ledger%angular], sum(expected, 2), tol, 10.0_wp, &
            "momenta")
         call ledger_momenta(ledger, system, scene%x, state, momenta)
         call check_near(error, momenta, expected, tol, 10.0_wp, "of each body")
         call body_momenta(system, scene%x, state, momenta)
         call check_near(error, momenta, expected, tol, 10.0_wp, "the same")
         call body_masses(system, masses)
         call check_near(error, real(masses, wp), mass, tol, 4.0_wp, "masses")
         system%space%has_motion([1, 3]) = .false.
         call ledger_measure(ledger, system, scene%x, state)
         call check_near(error, [ledger%momentum, ledger%angular], [0.0_wp, sum(expected(2, :)), &
            0.0_wp], tol, 10.0_wp, "circles move along their axis alone")
         call body_momenta(system, scene%x, state, momenta)
         call check_near(error, momenta(2, :), expected(2, :), tol, 10.0_wp, "each of them")
         call check_near(error, momenta([1, 3], :), 0.0_wp*momenta([1, 3], :), 0.0_wp, 1.0_wp, &
            "nowhere else")
      end associate
      call march_free(march)
   end subroutine test_bodies

   pure function rotation(angle) result(r)
      real(wp), intent(in) :: angle
      real(wp) :: r(2, 2)

      r = reshape([cos(angle), sin(angle), -sin(angle), cos(angle)], [2, 2])
   end function rotation

   !> Two bodies of the frames 1, 2, 3 and 4, 5, 6, turned by less and more than a half turn.
   subroutine test_turned(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: angle(2) = [0.7_wp, -1.9_wp], more(2) = [-0.4_wp, -3.0_wp]
      type(rigid_body_t) :: rigid(2)
      type(rigid_rotation_t) :: turns
      type(motion_t) :: motion
      real(wp), dimension(2, 6) :: x, u, v
      integer :: b

      call make_bodies(x, rigid)
      do b = 1, 2
         u(:, rigid(b)%frame) = matmul(rotation(angle(b)), x(:, rigid(b)%frame)) &
            - x(:, rigid(b)%frame) + b
      end do
      call rigid_rotation_init(turns, rigid, x, u)
      call check_near(error, turns%angle, angle, tol, 4.0_wp, "at first")
      call check_near(error, turns%moment, [0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "no moments yet")
      call motion_init(motion, x)
      motion%u0 = u
      do b = 1, 2
         associate (frame => rigid(b)%frame)
            motion%du(:, frame) = matmul(rotation(angle(b) + more(b)) - rotation(angle(b)), &
               x(:, frame)) - 0.5_wp*b
            v(:, frame) = real(b, wp)
            v(1, frame) = v(1, frame) - more(b)*(x(2, frame) + u(2, frame))
            v(2, frame) = v(2, frame) + more(b)*(x(1, frame) + u(1, frame))
         end associate
      end do
      call rigid_rotation_measure(turns, rigid, motion, 0.0_wp*x)
      call check_near(error, turns%angle, angle + more, tol, 4.0_wp, "at the end")
      do b = 1, 2
         call check_near(error, rigid_rotation_spin(rigid(b), x, u, v), more(b), tol, 4.0_wp, &
            "spin")
      end do
      call rigid_rotation_init(turns, rigid, reshape([x, x(:, :3)], [3, 6]), &
         reshape([u, u(:, :3)], [3, 6]))
      call check_equal(error, size(turns%angle), 0, "none in space")
   end subroutine test_turned

   subroutine make_bodies(x, rigid)
      real(wp), intent(out) :: x(2, 6)
      type(rigid_body_t), intent(out) :: rigid(2)

      call shake(x, 1.0_wp)
      rigid(1)%frame = [2, 1, 3]
      rigid(2)%frame = [6, 4, 5]
   end subroutine make_bodies

   !> Of forces on the frame and on nodes that move as its arms do, where loads act in the step.
   subroutine test_moment(error)
      type(error_t), allocatable, intent(out) :: error
      type(rigid_body_t) :: rigid(2)
      type(rigid_rotation_t) :: turns
      type(motion_t) :: motion
      real(wp), dimension(2, 6) :: x, at, reaction
      real(wp) :: expected
      integer :: k

      call make_bodies(x, rigid)
      rigid(1)%arm = [4, 5]
      rigid(2)%frame = rigid(1)%frame
      call motion_init(motion, x)
      call shake(motion%u0, 0.5_wp)
      call shake(motion%du, 0.5_wp)
      call shake(reaction, 1.0_wp)
      motion%evaluation%load_place = 0.75_wp
      call rigid_rotation_init(turns, rigid, x, 0.0_wp*x)
      turns%moment = 7.0_wp
      call rigid_rotation_measure(turns, rigid, motion, reaction)
      at = x + motion%u0 + 0.75_wp*motion%du
      expected = 0.0_wp
      do k = 1, 2
         associate (arm => at(:, rigid(1)%frame(k + 1)) - at(:, rigid(1)%frame(1)), &
               force => reaction(:, rigid(1)%frame(k + 1)))
            expected = expected + arm(1)*force(2) - arm(2)*force(1)
         end associate
      end do
      call check_near(error, turns%moment(2), expected, tol, 4.0_wp, "on the frame")
      do k = 1, 2
         associate (arm => at(:, rigid(1)%frame(k + 1)) - at(:, rigid(1)%frame(1)), &
               force => reaction(:, rigid(1)%arm(k)))
            expected = expected + arm(1)*force(2) - arm(2)*force(1)
         end associate
      end do
      call check_near(error, turns%moment(1), expected, tol, 4.0_wp, "and on nodes of its arms")
      call check_true(error, abs(turns%moment(1) - turns%moment(2)) > tol, "both count")
   end subroutine test_moment

end module test_ledger
