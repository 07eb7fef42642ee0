!> Whole runs of all schemes: a block that is stretched, spins, is driven at a node and pulled at
!> another, by the order of its motion and of its works.
module test_march_schemes
   use check, only : check_near, check_true, test_case_t
   use emcon_amplitudes, only : amplitude_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_is_done, march_t
   use emcon_materials, only : kinematics_linear
   use emcon_scene, only : scene_t
   use emcon_scheme_registry, only : scheme_row
   use emcon_steps, only : load_point, load_t
   use small_scenes, only : add_load, add_step, block_t, make_block, make_two_blocks, prescribe
   implicit none
   private
   public :: collect_march_schemes

   !> The last one of them has its mass at the nodes.
   character(len=17), parameter :: name(7) = [character(len=17) :: "ENERGYMOMENTUM", "MIDPOINT", &
      "TRAPEZOIDAL", "GENERALIZEDALPHA", "BDF2", "ENERGYDECAYING", "CENTRALDIFFERENCE"]
   real(wp), parameter :: duration = 0.25_wp

   !> How a run ends, and by how much its energies do not close.
   type :: outcome_t
      real(wp) :: u(2, 6) = 0.0_wp, v(2, 6) = 0.0_wp
      real(wp) :: error_of_balance = 0.0_wp
      real(wp) :: work = 0.0_wp
   end type outcome_t

contains

   subroutine collect_march_schemes(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("motion and works are of second order", test_order), &
         test_case_t("works of linear bodies that touch are exact", test_linear)]
   end subroutine collect_march_schemes

   subroutine run(scheme, n, outcome, error)
      character(len=*), intent(in) :: scheme
      integer, intent(in) :: n                   !! increments
      type(outcome_t), intent(out) :: outcome
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: velocity(2) = [0.5_wp, -0.25_wp]
      type(scene_t) :: scene
      type(block_t) :: block
      type(march_t) :: march
      type(increment_t) :: increment
      type(load_t) :: load
      real(wp) :: start
      integer :: a

      call make_block(scene, "CPE4", [2, 1], block)
      call add_step(scene, .false., duration/real(n, wp), n)
      scene%step(1)%scheme = scheme_row("DYNAMIC", trim(scheme))
      deallocate(scene%amplitude)
      allocate(scene%amplitude(1))
      scene%amplitude(1) = amplitude_t(name="A", time=[0.0_wp, 1.0_wp], value=[0.0_wp, 1.0_wp])
      do a = 1, 2
         call prescribe(scene%step(1), 1, a, velocity(a))
      end do
      scene%step(1)%prescribed%amplitude = 1
      load%kind = load_point
      load%target = 6
      load%place = 2
      load%value = 40.0_wp
      load%amplitude = 1
      call add_load(scene%step(1), load)
      scene%u0(1, :) = 0.1_wp*scene%x(1, :)
      scene%v0(1, :) = velocity(1) - 2.0_wp*scene%x(2, :)
      scene%v0(2, :) = velocity(2) + 2.0_wp*scene%x(1, :)
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      start = march%ledger%total
      do while (.not. march_is_done(march))
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
      end do
      outcome%u = march%state%u
      outcome%v = march%state%v
      outcome%error_of_balance = march%ledger%total - start
      outcome%work = march%ledger%external_work
      call march_free(march)
   end subroutine run

   !> Halved increments: differences are divided by four, or nearly. They lead where those of the
   !> first scheme do.
   subroutine test_order(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: least = 50
      type(outcome_t) :: first, outcome(3)
      real(wp), dimension(3) :: coarse, fine, apart
      integer :: i, k

      do k = 1, size(name)
         do i = 1, 3
            call run(name(k), least*2**(i - 1), outcome(i), error)
            if (allocated(error)) return
         end do
         coarse = distance(outcome(1), outcome(2))
         fine = distance(outcome(2), outcome(3))
         call check_true(error, all(fine < coarse/2.0_wp**1.8_wp), trim(name(k)) &
            // ": order of places, velocities, works")
         ! Of the others it has what the scheme takes.
         if (k <= 3) call check_true(error, abs(outcome(3)%error_of_balance) <= max(0.3_wp &
            *abs(outcome(2)%error_of_balance), 1.0e5_wp*max(epsilon(1.0_wp), &
            real(epsilon(1.0_dp), wp))), trim(name(k)) // ": balance of energies")
         if (allocated(error)) return
         if (k == 1) first = outcome(3)
         if (k == size(name)) exit
         apart = distance(first, outcome(3))
         call check_true(error, all(apart <= 2.0_wp*fine), trim(name(k)) // ": the same motion")
      end do

   contains

      !> Of places, velocities and works.
      pure function distance(a, b) result(d)
         type(outcome_t), intent(in) :: a, b
         real(wp) :: d(3)

         d = [norm2(a%u - b%u), norm2(a%v - b%v), abs(a%work - b%work)]
      end function distance

   end subroutine test_order

   !> Of forces that are linear in the displacement the mean over a step does the work: by the
   !> trapezoidal rule the energy changes by what loads, supports and contact have done.
   subroutine test_linear(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: h = 0.0125_wp
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(march_t) :: march
      type(increment_t) :: increment
      type(load_t) :: load
      real(wp) :: start, done
      integer :: k

      call make_two_blocks(scene, 0.03_wp, lower, upper)
      scene%section(1)%kinematics = kinematics_linear
      scene%v0(1, 11:) = 0.3_wp
      scene%v0(2, 11:) = -1.0_wp
      call add_step(scene, .false., h, 24)
      scene%step(1)%scheme = scheme_row("DYNAMIC", "TRAPEZOIDAL")
      scene%amplitude = [amplitude_t(name="A", time=[0.0_wp, 1.0_wp], value=[0.0_wp, 1.0_wp])]
      call prescribe(scene%step(1), 1, 1, 0.5_wp)
      call prescribe(scene%step(1), 1, 2, -0.25_wp)
      scene%step(1)%prescribed%amplitude = 1
      load%kind = load_point
      load%target = 15
      load%place = 2
      load%value = -10.0_wp
      load%amplitude = 1
      call add_load(scene%step(1), load)
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      start = march%ledger%total
      done = 0.0_wp
      do k = 1, 24
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         call check_near(error, march%ledger%total - march%ledger%contact_work, start, &
            1.0e5_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp)), 10.0_wp, "energy")
         done = max(done, abs(march%ledger%contact_work))
      end do
      call check_true(error, done > 1.0e-3_wp*start, "contact has done work")
      call march_free(march)
   end subroutine test_linear

end module test_march_schemes
