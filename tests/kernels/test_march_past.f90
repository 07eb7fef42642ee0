!> What a scheme looks back on: made where it is missing, handed to the next motion, kept and
!> forgotten.
module test_march_past
   use check, only : check_near, check_true, test_case_t
   use emcon_amplitudes, only : amplitude_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : instant_t
   use emcon_kinds, only : dp, wp
   use emcon_march, only : march_begin_step, march_free, march_init, march_t
   use emcon_march_past, only : march_past_begin, march_past_forget, march_past_keep, &
      march_past_take
   use emcon_rigid_bodies, only : rigid_frame_choose
   use emcon_scene, only : scene_t
   use emcon_scheme_registry, only : scheme_row
   use emcon_steps, only : load_point, load_t
   use emcon_system, only : mass_times
   use emcon_term, only : role_external
   use small_scenes, only : add_load, add_step, block_t, make_block, shake
   implicit none
   private
   public :: collect_march_past

   real(wp), parameter :: tol = 1.0e3_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   real(wp), parameter :: h = 0.25_wp, pull = 6.0_wp
   integer, parameter :: n_node = 6

contains

   subroutine collect_march_past(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("loads and accelerations at the start", test_begin), &
         test_case_t("accelerations of a rigid body that spins", test_spin), &
         test_case_t("what the next motion gets", test_take), &
         test_case_t("kept and forgotten", test_keep)]
   end subroutine collect_march_past

   !> A free block that is pulled by a force that grows to `pull` at the time 1.
   subroutine open(scene, march, scheme, error)
      type(scene_t), intent(out) :: scene
      type(march_t), intent(inout) :: march
      character(len=*), intent(in) :: scheme
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: block
      type(load_t) :: load

      call make_block(scene, "CPE4", [2, 1], block)
      call add_step(scene, .false., h, 4)
      scene%step(1)%scheme = scheme_row("DYNAMIC", scheme)
      deallocate(scene%amplitude)
      allocate(scene%amplitude(1))
      scene%amplitude(1) = amplitude_t(name="A", time=[0.0_wp, 1.0_wp], value=[0.0_wp, 1.0_wp])
      load%kind = load_point
      load%target = 5
      load%place = 2
      load%value = pull
      load%amplitude = 1
      call add_load(scene%step(1), load)
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
   end subroutine open

   !> M a = loads of that time + contact - forces of elements; what is there already is left alone,
   !> and schemes that do not look back have none.
   subroutine test_begin(error)
      type(error_t), allocatable, intent(out) :: error
      type(instant_t), parameter :: at = instant_t(0.5_wp, 0.5_wp)
      type(scene_t) :: scene
      type(march_t) :: march, other
      real(wp), dimension(2, n_node) :: load, product

      call open(scene, march, "GENERALIZEDALPHA", error)
      if (allocated(error)) return
      call shake(march%state%contact, 3.0_wp)
      call shake(march%state%internal, 3.0_wp)
      call march_past_begin(march, scene, at, error)
      if (allocated(error)) return
      load = 0.0_wp
      load(2, 5) = 0.5_wp*pull
      associate (state => march%state, history => march%state%history)
         call check_true(error, history%has_past, "a past")
         if (allocated(error)) return
         call check_near(error, history%load, load, tol, pull, "loads")
         call mass_times(march%system, history%past(:, :, 1), product)
         call check_near(error, product, load + state%contact - state%internal, tol, 10.0_wp, &
            "accelerations")
         history%load = 7.0_wp
         call march_past_begin(march, scene, at, error)
         if (allocated(error)) return
         call check_near(error, history%load, 0.0_wp*load + 7.0_wp, 0.0_wp, 1.0_wp, "not twice")
      end associate
      call march_free(march)
      call open(scene, other, "ENERGYMOMENTUM", error)
      if (allocated(error)) return
      call march_past_begin(other, scene, at, error)
      if (.not. allocated(error)) call check_true(error, .not. other%state%history%has_past, "none")
      call march_free(other)
   end subroutine test_begin

   !> Towards its centre, by the square of its spin.
   subroutine test_spin(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: spin = 3.0_wp
      type(scene_t) :: scene
      type(block_t) :: block
      type(march_t) :: march
      real(wp) :: arm(2, n_node)
      integer :: i

      call make_block(scene, "CPE4", [2, 1], block)
      arm = scene%x - spread([1.0_wp, 0.5_wp], 2, n_node)
      scene%v0(1, :) = -spin*arm(2, :)
      scene%v0(2, :) = spin*arm(1, :)
      deallocate(scene%rigid)
      allocate(scene%rigid(1))
      associate (body => scene%rigid(1))
         body%name = "ALL"
         body%reference = 1
         body%element = [1, 2]
         body%node = [(i, i = 1, n_node)]
         call rigid_frame_choose(scene%x, body%node, body%reference, body%frame)
      end associate
      call add_step(scene, .false., h, 4)
      scene%step(1)%scheme = scheme_row("DYNAMIC", "GENERALIZEDALPHA")
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (.not. allocated(error)) call march_past_begin(march, scene, instant_t(), error)
      if (allocated(error)) return
      call check_near(error, march%state%history%past(:, :, 1), -spin**2*arm, tol, 10.0_wp, &
         "accelerations")
      call march_free(march)
   end subroutine test_spin

   !> Weights times what there is, and nothing that was there for a step before.
   subroutine test_take(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march

      call open(scene, march, "BDF2", error)
      if (.not. allocated(error)) call march_past_begin(march, scene, instant_t(), error)
      if (allocated(error)) return
      associate (state => march%state, motion => march%motion, past => march%state%history%past)
         call shake(state%internal, 3.0_wp)
         call shake(state%contact, 3.0_wp)
         call shake(state%history%load, 3.0_wp)
         call shake(past(:, :, 1), 1.0_wp)
         call shake(past(:, :, 2), 1.0_wp)
         motion%du = 0.0_wp*scene%x
         motion%evaluation%past_velocity(:2) = [0.5_wp, -2.0_wp]
         motion%evaluation%past_change(:2) = [3.0_wp, 0.25_wp]
         motion%evaluation%start_weight = 0.75_wp
         motion%evaluation%recalled = 0.5_wp
         call march_past_take(march)
         call check_near(error, motion%carried, 0.75_wp*(state%internal - state%history%load &
            - state%contact), tol, 1.0_wp, "forces at the start")
         call check_near(error, motion%v_past, 0.5_wp*past(:, :, 1) - 2.0_wp*past(:, :, 2), tol, &
            1.0_wp, "velocities")
         call check_near(error, motion%dv_past, 3.0_wp*past(:, :, 1) + 0.25_wp*past(:, :, 2), tol, &
            1.0_wp, "their changes")
         call check_near(error, motion%du_before, past(:, :, 1), 0.0_wp, 1.0_wp, "the way before")
         motion%evaluation%start_weight = 0.0_wp
         motion%evaluation%recalled = 0.0_wp
         call march_past_take(march)
         call check_true(error, .not. (allocated(motion%carried) .or. &
            allocated(motion%du_before)) .and. allocated(motion%v_past), "without weights")
         call march_past_forget(state)
         call march_past_take(march)
         call check_true(error, .not. allocated(motion%v_past) .and. .not. &
            allocated(motion%dv_past), "nothing is known")
      end associate
      call march_free(march)
   end subroutine test_take

   !> The loads of a step and its size, once there is a past.
   subroutine test_keep(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      real(wp), dimension(2, n_node) :: load

      call open(scene, march, "TRAPEZOIDAL", error)
      if (allocated(error)) return
      call shake(load, 2.0_wp)
      associate (history => march%state%history)
         march%system%response%part(role_external)%force = load
         call march_past_forget(march%state)
         call march_past_keep(march, 0.125_wp)
         call check_near(error, history%h_before, 0.0_wp, 0.0_wp, 1.0_wp, "nothing to go on from")
         call march_past_begin(march, scene, instant_t(), error)
         if (allocated(error)) return
         march%system%response%part(role_external)%force = load
         call march_past_keep(march, 0.125_wp)
         call check_near(error, history%load, load, 0.0_wp, 1.0_wp, "loads")
         call check_near(error, history%h_before, 0.125_wp, 0.0_wp, 1.0_wp, "size")
         call march_past_forget(march%state)
         call check_near(error, history%h_before, 0.0_wp, 0.0_wp, 1.0_wp, "forgotten")
         call check_true(error, .not. history%has_past, "as if it began")
      end associate
      call march_free(march)
   end subroutine test_keep

end module test_march_past
