!> Elements that threads share: the same bits as of one, forces, sizes and matrices.
module test_solid_threads
   use check, only : check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_t, instant_t
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_of, motion_t
   use emcon_scene, only : scene_t
   use emcon_scheme_energy_momentum, only : scheme_energy_momentum_t
   use emcon_system, only : system_begin_step, system_init, system_respond, system_t
   use emcon_term, only : role_internal
   use emcon_text, only : to_text
   use linear_scenes, only : add_equation
   use small_scenes, only : add_block, add_step, block_t, make_block, shake
   implicit none
   private
   public :: collect_solid_threads

contains

   subroutine collect_solid_threads(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("forces, sizes and matrix", test_bits), &
         test_case_t("the first inverted element is named", test_inverted)]
   end subroutine collect_solid_threads

   !> Packs of quadrilaterals and of triangles, some of whose freedoms hang on others.
   subroutine make_system(scene, system, error)
      type(scene_t), intent(out) :: scene
      type(system_t), intent(out) :: system
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: block

      call make_block(scene, "CPE4", [7, 5], block)
      call add_block(scene, "CPE3", [4, 3], [8.0_wp, 0.0_wp], [4.0_wp, 3.0_wp], block)
      call add_equation(scene, [1, 20, 60], [1, 1, 2], [2.0_wp, -1.0_wp, 0.5_wp])
      call add_equation(scene, [30, 31], [2, 2], [1.0_wp, -1.0_wp])
      call add_step(scene, .false., 0.25_wp, 4)
      call system_init(system, scene, error)
      if (.not. allocated(error)) call system_begin_step(system, scene, 1, error)
   end subroutine make_system

   subroutine test_bits(error)
      type(error_t), allocatable, intent(out) :: error
      type(scheme_energy_momentum_t) :: scheme
      type(scene_t) :: scene
      type(system_t) :: one, many
      type(motion_t) :: motion
      real(wp), allocatable :: u0(:, :), du(:, :)
      integer :: k

      call make_system(scene, one, error)
      if (.not. allocated(error)) call make_system(scene, many, error)
      if (allocated(error)) return
      allocate(u0, du, source=0.0_wp*scene%x)
      do k = 2, 6
         call shake(u0, 0.1_wp)
         call shake(du, 0.1_wp)
         motion = motion_of(scheme%evaluation(instant_t(), 0.25_wp), scene%x, u0, du)
         many%response%n_thread = k
         call system_respond(one, motion, .true.)
         call system_respond(many, motion, .true.)
         associate (a => one%response, b => many%response, what => to_text(k) // " threads: ")
            call check_near(error, b%part(role_internal)%force, a%part(role_internal)%force, &
               0.0_wp, 1.0_wp, what // "forces")
            call check_near(error, b%part(role_internal)%magnitude, &
               a%part(role_internal)%magnitude, 0.0_wp, 1.0_wp, what // "sizes")
            call check_near(error, b%rounding, a%rounding, 0.0_wp, 1.0_wp, what // "rounding")
            call check_near(error, b%energy, a%energy, 0.0_wp, 1.0_wp, what // "energies")
            call check_near(error, real(many%matrix%value, wp), real(one%matrix%value, wp), &
               0.0_wp, 1.0_wp, what // "matrix")
         end associate
         if (allocated(error)) return
      end do
   end subroutine test_bits

   !> Elements 9 and 30, of different shares, are turned inside out.
   subroutine test_inverted(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(system_t) :: system, alone
      type(evaluation_t) :: evaluation
      real(wp), allocatable :: du(:, :)
      integer :: k

      call make_system(scene, system, error)
      if (.not. allocated(error)) call make_system(scene, alone, error)
      if (allocated(error)) return
      allocate(du, source=0.0_wp*scene%x)
      du(1, scene%element%node(1, [9, 30])) = 3.0_wp
      call system_respond(alone, motion_of(evaluation, scene%x, 0.0_wp*du, du), .false.)
      do k = 1, 6
         system%response%n_thread = k
         call system_respond(system, motion_of(evaluation, scene%x, 0.0_wp*du, du), .false.)
         call check_true(error, allocated(system%response%refusal), "refused")
         if (allocated(error)) return
         call check_true(error, system%response%refusal == alone%response%refusal, to_text(k) &
            // ": " // system%response%refusal)
      end do
   end subroutine test_inverted

end module test_solid_threads
