!> A corotated element over one step: identity, momenta, tangent, rigid motions.
module test_corotated
   use check, only : check_near, check_true, test_case_t
   use emcon_corotated_pack_plane, only : corotated_pack_fill, corotated_pack_gather, &
      corotated_pack_motion_t, corotated_pack_respond, corotated_pack_t
   use emcon_corotated_plane, only : corotated_energy, corotated_image, corotated_motion_t, &
      corotated_move, corotated_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_at_end, evaluation_t
   use emcon_kinds, only : dp, wp
   use emcon_materials, only : kinematics_corotated
   use emcon_motion, only : motion_of, motion_t
   use emcon_scene, only : scene_t
   use emcon_system, only : system_begin_step, system_init, system_respond, system_t, &
      system_tangent_times
   use kind_rows, only : law_code
   use small_scenes, only : add_step, block_t, make_block, shake
   implicit none
   private
   public :: collect_corotated

   integer, parameter :: n = 4
   !> Sums over four nodes, each term of some dozen roundings.
   real(wp), parameter :: tol = 256.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_corotated(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("identity and momenta", test_identity), &
         test_case_t("tangent", test_tangent), &
         test_case_t("rigid motions cost nothing", test_rigid), &
         test_case_t("where the tangent is symmetric", test_symmetric), &
         test_case_t("no tangent where an element is a point", test_point)]
   end subroutine collect_corotated

   !> A quadrilateral with a stiffness that has no force in rigid motions of small angles: springs
   !> between all its nodes. Mean gradients are those of its outline.
   pure subroutine sample(element)
      type(corotated_t), intent(out) :: element
      real(wp) :: along(2*n), way(2), area
      integer :: i, j, before, after

      element%n_node = n
      allocate(element%stiffness(2*n, 2*n), source=0.0_wp)
      element%x(:, :n) = reshape([0.0_wp, 0.0_wp, 1.1_wp, 0.1_wp, 1.3_wp, 0.9_wp, -0.1_wp, &
         1.0_wp], [2, n])
      area = 0.0_wp
      do i = 1, n
         before = modulo(i - 2, n) + 1
         after = modulo(i, n) + 1
         area = area + 0.5_wp*(element%x(1, i)*element%x(2, after) &
            - element%x(1, after)*element%x(2, i))
         way = 0.5_wp*(element%x(:, after) - element%x(:, before))
         element%slope(:, i) = [way(2), -way(1)]
         do j = i + 1, n
            along = 0.0_wp
            way = element%x(:, j) - element%x(:, i)
            along(2*i - 1:2*i) = -way/norm2(way)
            along(2*j - 1:2*j) = way/norm2(way)
            element%stiffness = element%stiffness + &
               real(i + j, wp)*spread(along, 2, 2*n)*spread(along, 1, 2*n)
         end do
      end do
      element%slope = element%slope/area
   end subroutine sample

   !> The discrete gradient of its energy: that of the last of three elements side by side, of which
   !> the others are at rest.
   subroutine force_of(element, from, by, force)
      type(corotated_t), intent(in) :: element
      real(wp), intent(in) :: from(2, n), by(2, n)
      real(wp), intent(out) :: force(2, n)
      type(corotated_pack_t) :: pack
      type(corotated_pack_motion_t) :: motion
      real(wp) :: all_from(2, 3*n), all_by(2, 3*n)
      integer :: i

      call corotated_pack_fill(pack, [1, 2, 3], reshape([(i, i = 1, 3*n)], [n, 3]), &
         [element, element, element])
      all_from = 0.0_wp
      all_by = 0.0_wp
      all_from(:, 2*n + 1:) = from
      all_by(:, 2*n + 1:) = by
      call corotated_pack_gather(pack, all_from, all_by, motion)
      call corotated_pack_respond(pack, motion)
      force = motion%force(3, :, :n)
   end subroutine force_of

   !> Displacements of a deformation of a fifth and a turn.
   pure function field(seed, angle) result(u)
      real(wp), intent(in) :: seed, angle
      real(wp) :: u(2, n)
      type(corotated_t) :: element
      integer :: i

      call sample(element)
      do i = 1, n
         u(:, i) = turn(element%x(:, i) + 0.2_wp*[sin(seed*i), cos(3.0_wp*seed*i)], angle) &
            - element%x(:, i)
      end do
   end function field

   pure function turn(x, angle)
      real(wp), intent(in) :: x(2), angle
      real(wp) :: turn(2)

      turn = cos(angle)*x + sin(angle)*[-x(2), x(1)]
   end function turn

   !> f.du is the change of energy; f has no resultant, and no moment on the mean positions.
   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      type(corotated_t) :: element
      real(wp) :: from(2, n), by(2, n), force(2, n), mean(2, n), scale, before, after
      integer :: k

      call sample(element)
      do k = 1, 5
         from = field(0.7_wp*k, 0.9_wp*k)
         by = field(1.1_wp*k + 0.3_wp, 0.9_wp*k + 0.7_wp) - from
         before = corotated_energy(element, from - spread(from(:, 1), 2, n))
         after = corotated_energy(element, from + by - spread(from(:, 1) + by(:, 1), 2, n))
         call force_of(element, from, by, force)
         scale = sum(abs(force*by)) + after + before
         call check_near(error, sum(force*by), after - before, tol, scale, "energy")
         if (allocated(error)) return
         call check_near(error, sum(force, 2), [0.0_wp, 0.0_wp], tol, sum(abs(force)), "resultant")
         if (allocated(error)) return
         mean = element%x(:, :n) + from + 0.5_wp*by
         call check_near(error, sum(mean(1, :)*force(2, :) - mean(2, :)*force(1, :)), 0.0_wp, tol, &
            4.0_wp*sum(abs(force)), "moment")
         if (allocated(error)) return
      end do
   end subroutine test_identity

   !> Against central differences, whose error is of third order.
   subroutine test_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: h = epsilon(1.0_wp)**(1.0_wp/3.0_wp)
      type(corotated_t) :: element
      type(corotated_motion_t) :: motion
      real(wp), dimension(2, n) :: from, by, way, image, ahead, behind
      integer :: k

      call sample(element)
      do k = 1, 4
         from = field(0.5_wp*k, 0.8_wp*k)
         by = field(1.3_wp*k + 0.3_wp, 0.8_wp*k + 0.6_wp) - from
         way = field(2.1_wp*k, 0.3_wp)
         call corotated_move(element, from, by, motion)
         call corotated_image(element, motion, way, image)
         call force_of(element, from, by + h*way, ahead)
         call force_of(element, from, by - h*way, behind)
         call check_near(error, reshape(image, [2*n]), reshape(0.5_wp*(ahead - behind)/h, [2*n]), &
            100.0_wp*h*h, maxval(abs(image)), "tangent")
         if (allocated(error)) return
      end do
   end subroutine test_tangent

   subroutine test_rigid(error)
      type(error_t), allocatable, intent(out) :: error
      type(corotated_t) :: element
      real(wp) :: u(2, n), force(2, n)
      integer :: i, k

      call sample(element)
      do k = 1, 12
         do i = 1, n
            u(:, i) = turn(element%x(:, i), 0.5_wp*k) - element%x(:, i)
         end do
         call force_of(element, 0.0_wp*u, u, force)
         call check_near(error, reshape(force, [2*n]), spread(0.0_wp, 1, 2*n), tol, &
            maxval(element%stiffness), "force")
         if (allocated(error)) return
      end do
   end subroutine test_rigid

   !> As the second derivative of an energy, at the end of a step; not that of a discrete gradient,
   !> where elements turn.
   subroutine test_symmetric(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      type(motion_t) :: motion
      real(wp) :: u0(2, 6), du(2, 6)
      real(wp), allocatable :: full(:, :)
      integer :: k, i

      call make_block(scene, "CPE4", [2, 1], block)
      scene%section(1)%kinematics = kinematics_corotated
      scene%material(1)%law = law_code("linear")
      call add_step(scene, .false., 0.1_wp, 1)
      call system_init(system, scene, error)
      if (.not. allocated(error)) call system_begin_step(system, scene, 1, error)
      if (allocated(error)) return
      call shake(u0, 0.1_wp)
      call shake(du, 0.1_wp)
      do k = 1, 2
         if (k == 1) motion = motion_of(evaluation_at_end, scene%x, u0, du)
         if (k == 2) motion = motion_of(evaluation_t(), scene%x, u0, du)
         call system_respond(system, motion, .true.)
         associate (a => system%matrix)
            if (allocated(full)) deallocate(full)
            allocate(full(a%n_row, a%n_row), source=0.0_wp)
            do i = 1, a%n_row
               full(i, a%column(a%row_start(i) + 1:a%row_start(i + 1)) + 1) &
                  = real(a%value(a%row_start(i) + 1:a%row_start(i + 1)), wp)
            end do
         end associate
         call check_true(error, system%is_symmetric .eqv. k == 1, "as it is told")
         call check_true(error, maxval(abs(full - transpose(full))) <= 256.0_wp*max( &
            epsilon(1.0_wp), real(epsilon(1.0_dp), wp))*maxval(abs(full)) &
            .eqv. k == 1, "as it is")
      end do
   end subroutine test_symmetric

   !> At the end of a step; half of the way there is one.
   subroutine test_point(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      type(motion_t) :: motion
      real(wp), dimension(2, 4) :: way, product
      integer :: k

      call make_block(scene, "CPE4", [1, 1], block)
      scene%section(1)%kinematics = kinematics_corotated
      scene%material(1)%law = law_code("linear")
      call add_step(scene, .false., 0.1_wp, 1)
      call system_init(system, scene, error)
      if (.not. allocated(error)) call system_begin_step(system, scene, 1, error)
      if (allocated(error)) return
      call shake(way, 1.0_wp)
      do k = 1, 2
         motion = motion_of(evaluation_t(), scene%x, 0.0_wp*scene%x, -0.5_wp*k*scene%x)
         call system_tangent_times(system, motion, way, product)
         call check_true(error, any(abs(product) > 0.0_wp) .eqv. k == 1, "part of the way")
      end do
   end subroutine test_point

end module test_corotated
