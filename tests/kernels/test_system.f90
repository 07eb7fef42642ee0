!> The discrete system: residual, tangent and mass of a scene.
module test_system
   use check, only : check_near, test_case_t
   use emcon_csr, only : csr_multiply
   use emcon_errors, only : error_t
   use emcon_evaluation, only : instant_t, evaluation_moving, evaluation_t, evaluation_velocity
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_of, motion_t
   use emcon_numbering, only : add_to_dofs, pick_unknowns
   use emcon_scene, only : scene_t
   use emcon_scheme_energy_momentum, only : scheme_energy_momentum_t
   use emcon_scheme_static, only : scheme_static_t
   use emcon_steps, only : load_pressure, load_t
   use emcon_system, only : mass_times, system_begin_step, system_init, system_renew, &
      system_respond, system_t, system_tangent_times
   use emcon_term, only : role_external, role_inertia, role_internal
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   use small_scenes, only : add_block, add_load, add_step, block_t, clamp, make_block, shake, young
   use sparse_samples, only : dense_of
   implicit none
   private
   public :: collect_system

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   real(wp), parameter :: tol = 64.0_wp*eps

contains

   subroutine collect_system(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("tangent of a dynamic step", test_dynamic_tangent), &
         test_case_t("tangent of a static step", test_static_tangent), &
         test_case_t("tangent at a place within a step", test_tangent_within), &
         test_case_t("prescribed motion by the tangent", test_driven), &
         test_case_t("inertia is M times the change of velocity", test_inertia), &
         test_case_t("mass times a rigid motion", test_mass)]
   end subroutine collect_system

   !> Quadrilaterals and triangles, one corner clamped, pressure on a deformed side.
   subroutine make_system(scene, system, is_static, error)
      type(scene_t), intent(out) :: scene
      type(system_t), intent(out) :: system
      logical, intent(in) :: is_static
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: block
      type(load_t) :: load

      call make_block(scene, "CPE4", [2, 1], block)
      call add_block(scene, "CPE3", [1, 1], [4.0_wp, 0.0_wp], [1.0_wp, 1.0_wp], block)
      call add_step(scene, is_static, 0.25_wp, 4)
      call clamp(scene%step(1), [1])
      load%kind = load_pressure
      load%target = 2
      load%place = 3
      load%value = young
      call add_load(scene%step(1), load)
      call system_init(system, scene, error)
      if (allocated(error)) return
      call system_begin_step(system, scene, 1, error)
   end subroutine make_system

   subroutine test_dynamic_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      type(scheme_energy_momentum_t) :: scheme
      type(scene_t) :: scene
      type(system_t) :: system

      call make_system(scene, system, .false., error)
      if (allocated(error)) return
      call check_tangent(error, scene, system, scheme%evaluation(instant_t(0.5_wp, 0.5_wp), &
         0.25_wp))
   end subroutine test_dynamic_tangent

   subroutine test_static_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      type(scheme_static_t) :: scheme
      type(scene_t) :: scene
      type(system_t) :: system

      call make_system(scene, system, .true., error)
      if (allocated(error)) return
      call check_tangent(error, scene, system, scheme%evaluation(instant_t(0.5_wp, 0.5_wp), &
         0.25_wp))
   end subroutine test_static_tangent

   !> Gradients at a place, discrete gradients from the start to it, and loads at another.
   subroutine test_tangent_within(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(system_t) :: system
      type(evaluation_t) :: evaluation

      call make_system(scene, system, .false., error)
      if (allocated(error)) return
      evaluation = evaluation_moving(0.25_wp, lapse=0.2_wp, v_weight=1.5_wp)
      evaluation%at = 0.375_wp
      evaluation%load_place = 0.75_wp
      call check_tangent(error, scene, system, evaluation)
      evaluation%is_gradient = .true.
      call check_tangent(error, scene, system, evaluation)
   end subroutine test_tangent_within

   !> Against central differences of step eps^(1/3): error a multiple of eps^(2/3).
   subroutine check_tangent(error, scene, system, evaluation)
      type(error_t), allocatable, intent(inout) :: error
      type(scene_t), intent(in) :: scene
      type(system_t), intent(inout) :: system
      type(evaluation_t), intent(in) :: evaluation
      real(wp), allocatable :: u0(:, :), v0(:, :), du(:, :), up(:), down(:), way(:)
      real(wp), allocatable :: matrix(:, :)
      real(wp), parameter :: rounding = real(epsilon(1.0_dp), wp)   ! of the matrix
      real(wp) :: step
      integer :: j

      allocate(u0, v0, du, source=scene%x)
      allocate(up(system%space%numbering%n_unknown), down(system%space%numbering%n_unknown))
      allocate(way(system%space%numbering%n_unknown))
      allocate(matrix(size(way), size(way)))
      call shake(u0, 0.1_wp)
      call shake(v0, 1.0_wp)
      call shake(du, 0.1_wp)
      step = epsilon(1.0_wp)**(1.0_wp/3.0_wp)
      call system_respond(system, motion_of(evaluation, scene%x, u0, du, v0), .true.)
      matrix = real(dense_of(system%matrix), wp)
      do j = 1, size(way)
         way = 0.0_wp
         way(j) = step
         call add_to_dofs(system%space%numbering, way, 1.0_wp, du)
         call system_respond(system, motion_of(evaluation, scene%x, u0, du, v0), .false.)
         call pick_unknowns(system%space%numbering, system%response%residual, up)
         call add_to_dofs(system%space%numbering, way, -2.0_wp, du)
         call system_respond(system, motion_of(evaluation, scene%x, u0, du, v0), .false.)
         call pick_unknowns(system%space%numbering, system%response%residual, down)
         call add_to_dofs(system%space%numbering, way, 1.0_wp, du)
         call check_near(error, matrix(:, j), (up - down)/(2.0_wp*step), &
            max(300.0_wp*step**2, 64.0_wp*rounding), young, "column " // to_text(j))
      end do
   end subroutine check_tangent

   !> At the unknowns the product with the matrix, without the part of the loads: none here.
   subroutine test_driven(error)
      type(error_t), allocatable, intent(out) :: error
      type(scheme_energy_momentum_t) :: dynamic
      type(scheme_static_t) :: static
      type(scene_t) :: scene
      type(system_t) :: system
      type(evaluation_t) :: evaluation(2)
      type(motion_t) :: motion
      real(wp), allocatable :: u0(:, :), du(:, :), way(:, :), product(:, :), x(:), y(:), z(:)
      integer :: k

      call make_system(scene, system, .false., error)
      if (allocated(error)) return
      scene%step(1)%load = scene%step(1)%load(:0)
      call system_renew(system, scene)
      evaluation(1) = dynamic%evaluation(instant_t(), 0.25_wp)
      evaluation(2) = static%evaluation(instant_t(), 0.25_wp)
      allocate(u0, du, way, product, source=scene%x)
      allocate(x(system%space%numbering%n_unknown), y(system%space%numbering%n_unknown))
      allocate(z(system%space%numbering%n_unknown))
      do k = 1, 2
         call shake(u0, 0.1_wp)
         call shake(du, 0.1_wp)
         call draw_random(x)
         way = 0.0_wp
         call add_to_dofs(system%space%numbering, x, 1.0_wp, way)
         motion = motion_of(evaluation(k), scene%x, u0, du)
         call system_respond(system, motion, .true.)
         call csr_multiply(system%matrix, x, y)
         call system_tangent_times(system, motion, way, product)
         call pick_unknowns(system%space%numbering, product, z)
         call check_near(error, z, y, tol, 10.0_wp*young, "product by pose " // to_text(k))
      end do
   end subroutine test_driven

   !> M (v1 - v0)/h with v1 as the scheme gives it; the driven nodes' offset counts as motion.
   subroutine test_inertia(error)
      type(error_t), allocatable, intent(out) :: error
      type(scheme_energy_momentum_t) :: scheme
      type(scene_t) :: scene
      type(system_t) :: system
      real(wp), allocatable :: u0(:, :), v0(:, :), du(:, :), offset(:, :), change(:, :)
      real(wp), allocatable :: expected(:, :)
      type(motion_t) :: motion
      real(wp), parameter :: h = 0.3_wp

      call make_system(scene, system, .false., error)
      if (allocated(error)) return
      allocate(u0, v0, du, offset, change, expected, source=0.0_wp*scene%x)
      call shake(v0, 1.0_wp)
      call shake(du, 0.1_wp)
      call shake(offset, 0.1_wp)
      motion = motion_of(scheme%evaluation(instant_t(), h), scene%x, u0, du, v0)
      motion%offset = offset
      call system_respond(system, motion, .false.)
      change = (evaluation_velocity(motion%evaluation, v0, du + offset) - v0)/h
      call mass_times(system, change, expected)
      associate (part => system%response%part)
         call check_near(error, part(role_inertia)%force, expected, tol, 20.0_wp, "inertia")
         call check_near(error, system%response%residual, part(role_inertia)%force &
            + part(role_internal)%force - part(role_external)%force, tol, young, "residual")
      end associate
   end subroutine test_inertia

   !> Translation: total mass; turn: first and second moments, of a block of mass 2 and one of 1.
   subroutine test_mass(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(system_t) :: system
      real(wp), allocatable :: field(:, :), product(:, :)

      call make_system(scene, system, .false., error)
      if (allocated(error)) return
      allocate(field, product, source=scene%x)
      field(1, :) = 1.0_wp
      field(2, :) = scene%x(1, :)
      call mass_times(system, field, product)
      call check_near(error, sum(product, dim=2), [3.0_wp, 2.0_wp*1.0_wp + 4.5_wp], tol, 10.0_wp, &
         "mass and first moment")
      call check_near(error, sum(product(2, :)*scene%x(1, :)), &
         2.0_wp*(1.0_wp + 4.0_wp/12.0_wp) + (4.5_wp**2 + 1.0_wp/12.0_wp), tol, 30.0_wp, &
         "second moment")
   end subroutine test_mass

end module test_system
