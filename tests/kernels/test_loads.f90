!> Loads and prescribed motion over time and configuration.
module test_loads
   use check, only : check_near, check_true, test_case_t
   use emcon_amplitudes, only : amplitude_corners, amplitude_t, find_amplitude_value
   use emcon_csr, only : csr_find
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_prescribed, only : prescribed_motion
   use emcon_moment_load_plane, only : add_moment, add_moment_stiffness
   use emcon_moment_load_space, only : push_frame, push_frame_stiffness
   use emcon_motion, only : motion_of
   use emcon_evaluation, only : instant_t, evaluation_t
   use emcon_pressure_plane, only : add_pressure
   use emcon_rotation, only : cross_product
   use emcon_scene, only : scene_t
   use emcon_stepper, only : stepper_build, stepper_close, stepper_t
   use emcon_steps, only : load_centrifugal, load_gravity, load_point, load_pressure, load_t, &
      prescribed_t
   use emcon_system, only : system_begin_step, system_init, system_loads, system_t
   use emcon_term, only : response_begin, role_external
   use emcon_text, only : to_text
   use one_element, only : read_one
   use small_scenes, only : add_load, add_step, add_surface, block_t, bottom, clamp, left, &
      make_block, right, shake, top
   implicit none
   private
   public :: collect_loads

   real(wp), parameter :: tol = 32.0_wp*epsilon(1.0_wp)
   real(wp), parameter :: tol_dp = 32.0_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))

contains

   subroutine collect_loads(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("pressure follows the edge", test_pressure), &
         test_case_t("pressure without nlgeom stays", test_dead_pressure), &
         test_case_t("pressure all around: no force, no moment", test_closed), &
         test_case_t("pressure on an edge of any form", test_edge), &
         test_case_t("pressure on faces, near the origin and far from it", test_far), &
         test_case_t("pressure stiffness", test_stiffness), &
         test_case_t("gravity sums to the weight", test_gravity), &
         test_case_t("bodies that turn about an axis", test_centrifugal), &
         test_case_t("a moment is a couple", test_moment), &
         test_case_t("a moment in space", test_moment_space), &
         test_case_t("amplitudes in step and total time", test_amplitude), &
         test_case_t("smooth amplitudes", test_smooth), &
         test_case_t("ramp of a static step", test_ramp), &
         test_case_t("prescribed motion", test_motion)]
   end subroutine collect_loads

   !> A block of 2 x 2 cells under the loads; `system` is ready to respond.
   subroutine prepare(scene, is_static, nlgeom, load, system, error)
      type(scene_t), intent(inout) :: scene
      logical, intent(in) :: is_static, nlgeom
      type(load_t), intent(in) :: load(:)
      type(system_t), intent(out) :: system
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      call add_step(scene, is_static, 0.25_wp, 8)
      scene%step(1)%nlgeom = nlgeom
      do i = 1, size(load)
         call add_load(scene%step(1), load(i))
      end do
      call system_init(system, scene, error)
      if (allocated(error)) return
      call system_begin_step(system, scene, 1, error)
   end subroutine prepare

   function pressure_on(element, face, value) result(load)
      integer, intent(in) :: element, face
      real(wp), intent(in) :: value
      type(load_t) :: load

      load%kind = load_pressure
      load%target = element
      load%place = face
      load%value = value
   end function pressure_on

   !> Forces of the loads at `instant` and x + u.
   subroutine forces(system, scene, instant, u, force)
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(instant_t), intent(in) :: instant
      real(wp), intent(in), contiguous :: u(:, :)
      real(wp), intent(out), contiguous :: force(:, :)

      call system_loads(system, motion_of(evaluation_t(is_gradient=.true., load_place=1.0_wp, &
         load_instant=instant), scene%x, u, 0.0_wp*u), force)
   end subroutine forces

   !> Places and ways of a few digits: far from the origin forces are the same to the last bit,
   !> whose sum around a body is 0.
   subroutine test_far(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: load(7) = [character(len=8) :: "*DLOAD", "1, P1, 3", &
         "1, P2, 3", "1, P3, 3", "1, P4, 3", "1, P5, 3", "1, P6, 3"]
      type(stepper_t) :: stepper
      real(wp) :: force(3, 8, 2), u(3, 8)
      integer :: k, n

      call shake(u, 0.2_wp)
      u = scale(real(nint(scale(u, 8)), wp), -8)
      do n = 1, 6
         do k = 1, 2
            call read_one("C3D8", 2, "NONLINEAR", stepper, error, of_step=[load(1), load(n + 1:)])
            if (allocated(error)) return
            associate (x => stepper%scene%x)
               x = scale(real(nint(scale(x, 8)), wp), -8)
               if (k == 2) x = x + scale(1.0_wp, digits(1.0_wp) - 9)
            end associate
            call stepper_build(stepper, error)
            if (allocated(error)) return
            call forces(stepper%march%system, stepper%scene, instant_t(), u, force(:, :, k))
            call stepper_close(stepper)
            stepper = stepper_t()
         end do
         call check_near(error, reshape(force(:, :, 2), [24]), reshape(force(:, :, 1), [24]), &
            0.0_wp, 1.0_wp, "far, without " // to_text(n - 1) // " faces")
         call check_true(error, all(abs(sum(force(:, :, 1), 2)) < tol) .eqv. n == 1, "closed")
      end do
   end subroutine test_far

   !> -p n L t, half on either node, on the deformed edge.
   subroutine test_pressure(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      real(wp), parameter :: p = 3.0_wp, thickness = 0.5_wp
      real(wp) :: u(2, 9), force(2, 9), expected(2, 9), a(2), n(2), length

      call make_block(scene, "CPE4", [2, 2], block)
      scene%section(1)%thickness = thickness
      call prepare(scene, .false., .true., [pressure_on(4, 3, p)], system, error)
      if (allocated(error)) return
      call shake(u, 0.2_wp)
      call forces(system, scene, instant_t(), u, force)
      a = (scene%x(:, 8) + u(:, 8)) - (scene%x(:, 9) + u(:, 9))   ! top side, right to left
      length = sqrt(dot_product(a, a))
      n = [a(2), -a(1)]/length
      expected = 0.0_wp
      expected(:, 8) = -0.5_wp*p*thickness*length*n
      expected(:, 9) = expected(:, 8)
      call check_near(error, force, expected, tol, p, "force")
      call check_near(error, merge(1.0_wp, 0.0_wp, force(2, 8) < 0.0_wp), 1.0_wp, 0.0_wp, 1.0_wp, &
         "pressure on the top presses down")
   end subroutine test_pressure

   subroutine test_dead_pressure(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      real(wp) :: u(2, 9), force(2, 9)

      call make_block(scene, "CPE4", [2, 2], block)
      call prepare(scene, .false., .false., [pressure_on(4, 3, 3.0_wp)], system, error)
      if (allocated(error)) return
      call shake(u, 0.2_wp)
      call forces(system, scene, instant_t(), u, force)
      call check_near(error, force(:, 8) + force(:, 9), [0.0_wp, -3.0_wp], 0.0_wp, 1.0_wp, "force")
   end subroutine test_dead_pressure

   !> Of all sides of a deformed block, triangles or quadrilaterals.
   subroutine test_closed(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      type(load_t) :: load(8)
      real(wp) :: u(2, 9), force(2, 9), place(2, 9)
      character(len=4), parameter :: name(2) = ["CPE3", "CPE4"]
      integer :: i, k

      do k = 1, 2
         call make_block(scene, name(k), [2, 2], block)
         call add_surface(scene, "ALL", block, [bottom, right, top, left])
         do i = 1, 8
            load(i) = pressure_on(scene%surface(1)%element(i), scene%surface(1)%face(i), 7.0_wp)
         end do
         call prepare(scene, .false., .true., load, system, error)
         if (allocated(error)) return
         call shake(u, 0.3_wp)
         place = scene%x + u
         call forces(system, scene, instant_t(), u, force)
         call check_near(error, sum(force, dim=2), [0.0_wp, 0.0_wp], tol, 7.0_wp, &
            name(k) // ": force")
         call check_near(error, sum(place(1, :)*force(2, :) - place(2, :)*force(1, :)), 0.0_wp, &
            tol, 20.0_wp, name(k) // ": moment")
      end do
   end subroutine test_closed

   !> However an edge is bent between its ends a and b: the force is that of the chord, its moment
   !> about the origin p (b^2 - a^2)/2.
   subroutine test_edge(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: p = 0.7_wp
      integer, parameter :: edge(3) = [4, 1, 3]
      real(wp), dimension(2, 4) :: x, u, at, force
      logical :: follows
      integer :: k

      do k = 0, 3
         follows = btest(k, 1)
         call shake(x, 1.0_wp)
         call shake(u, 1.0_wp)
         at = x
         if (follows) at = x + u
         force = 0.0_wp
         call add_pressure(edge(:merge(2, 3, btest(k, 0))), p, x, u, follows, force)
         associate (chord => at(:, 1) - at(:, 4))
            call check_near(error, sum(force, 2), p*[-chord(2), chord(1)], tol, 1.0_wp, "force")
         end associate
         call check_near(error, sum(at(1, :)*force(2, :) - at(2, :)*force(1, :)), &
            0.5_wp*p*(sum(at(:, 1)**2) - sum(at(:, 4)**2)), tol, 1.0_wp, "moment")
         call check_near(error, force(:, 2), [0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "another node")
      end do
   end subroutine test_edge

   !> The force is linear in u, so a difference of any step is its derivative.
   subroutine test_stiffness(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      real(wp) :: u(2, 9), up(2, 9), down(2, 9), slope, actual
      integer :: i, j, k, slot

      call make_block(scene, "CPE4", [2, 2], block)
      call add_step(scene, .false., 1.0_wp, 1)
      call clamp(scene%step(1), [9])             ! one end of the loaded edge is held
      call add_load(scene%step(1), pressure_on(4, 3, 3.0_wp))
      call add_load(scene%step(1), pressure_on(3, 3, 3.0_wp))
      call system_init(system, scene, error)
      if (allocated(error)) return
      call system_begin_step(system, scene, 1, error)
      if (allocated(error)) return
      allocate(system%matrix%value(size(system%matrix%column)), source=0.0_dp)
      call shake(u, 0.2_wp)
      call response_begin(system%response)
      do k = 1, size(system%term)
         if (system%term(k)%term%role == role_external) call system%term(k)%term%respond( &
            motion_of(evaluation_t(), scene%x, u, 0.0_wp*u), system%response, system%matrix%value, &
            system%space%reduction%side%value)
      end do
      associate (dof => system%space%numbering%dof)
         do j = 1, size(dof)
            u(2 - mod(dof(j), 2), (dof(j) + 1)/2) = u(2 - mod(dof(j), 2), (dof(j) + 1)/2) + 1.0_wp
            call forces(system, scene, instant_t(), u, up)
            u(2 - mod(dof(j), 2), (dof(j) + 1)/2) = u(2 - mod(dof(j), 2), (dof(j) + 1)/2) - 1.0_wp
            call forces(system, scene, instant_t(), u, down)
            do i = 1, size(dof)
               slope = up(2 - mod(dof(i), 2), (dof(i) + 1)/2) &
                  - down(2 - mod(dof(i), 2), (dof(i) + 1)/2)
               slot = csr_find(system%matrix, i, j)
               actual = 0.0_wp
               if (slot > 0) actual = real(system%matrix%value(slot), wp)
               call check_near(error, actual, -0.5_wp*slope, tol_dp, 3.0_wp, "stiffness")
            end do
         end do
      end associate
   end subroutine test_stiffness

   subroutine test_gravity(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      type(load_t) :: load(8)
      real(wp) :: u(2, 9), force(2, 9)
      integer :: e

      call make_block(scene, "CPE3", [2, 2], block)
      call shake(u, 0.2_wp)
      scene%x(:, 5) = scene%x(:, 5) + u(:, 5)
      scene%material(1)%density = 0.25_wp
      scene%section(1)%thickness = 2.0_wp
      do e = 1, 8
         load(e)%kind = load_gravity
         load(e)%target = e
         load(e)%value = 10.0_wp
         load(e)%direction = [0.6_wp, -0.8_wp, 0.0_wp]
      end do
      call prepare(scene, .false., .true., load, system, error)
      if (allocated(error)) return
      call forces(system, scene, instant_t(), u, force)
      call check_near(error, sum(force, dim=2), 0.25_wp*2.0_wp*4.0_wp*10.0_wp*[0.6_wp, -0.8_wp], &
         tol, 20.0_wp, "weight of density 1/4, thickness 2, area 4")
   end subroutine test_gravity

   !> About an axis across the plane and one in it, of direction (0.6, 0.8): the resultant is that
   !> of the mass in its centre, and about the axis there is no moment.
   subroutine test_centrifugal(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: point(2) = [0.5_wp, -1.0_wp], square = 3.0_wp
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      type(load_t) :: load(8)
      real(wp) :: u(2, 9), force(2, 9), arm(2, 9), expected(2)
      integer :: e, k

      do k = 1, 2
         call make_block(scene, "CPE3", [2, 2], block)
         call shake(u, 0.2_wp)
         scene%x(:, 5) = scene%x(:, 5) + u(:, 5)
         scene%material(1)%density = 0.25_wp
         scene%section(1)%thickness = 2.0_wp
         do e = 1, 8
            load(e)%kind = load_centrifugal
            load(e)%target = e
            load(e)%value = square
            load(e)%point(:2) = point
            load(e)%direction = merge([0.0_wp, 0.0_wp, 1.0_wp], [0.6_wp, 0.8_wp, 0.0_wp], k == 1)
         end do
         call prepare(scene, .false., .true., load, system, error)
         if (allocated(error)) return
         call forces(system, scene, instant_t(), u, force)
         ! The centre of the square of area 4 is at (1, 1).
         expected = [1.0_wp, 1.0_wp] - point
         if (k == 2) expected = expected - dot_product([0.6_wp, 0.8_wp], expected) &
            *[0.6_wp, 0.8_wp]
         call check_near(error, sum(force, 2), 0.25_wp*2.0_wp*4.0_wp*square*expected, tol, &
            20.0_wp, "resultant")
         arm = scene%x - spread(point, 2, 9)
         if (k == 1) call check_near(error, sum(arm(1, :)*force(2, :) - arm(2, :)*force(1, :)), &
            0.0_wp, tol, 40.0_wp, "moment")
         if (k == 2) call check_near(error, matmul([0.6_wp, 0.8_wp], force), spread(0.0_wp, 1, 9), &
            tol, 20.0_wp, "nothing along the axis")
      end do
   end subroutine test_centrifugal

   !> Two forces across what is between their nodes; their derivative by differences, second order
   !> in a step of eps^(1/3).
   subroutine test_moment(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: step = epsilon(1.0_wp)**(1.0_wp/3.0_wp), moment = -1.5_wp
      integer, parameter :: node(2) = [3, 1]
      real(wp), dimension(2, 3) :: x, u, force, low, high
      real(dp) :: value(8), side(8)
      real(wp) :: arm(2), row(4)
      integer :: slot(4, 4), i, j, a, b

      call shake(x, 1.0_wp)
      x(:, 1) = x(:, 3) + [0.7_wp, 0.4_wp]
      call shake(u, 0.2_wp)
      force = 2.0_wp
      call add_moment(node, moment, x, u, force)
      force = force - 2.0_wp
      arm = x(:, 1) + u(:, 1) - x(:, 3) - u(:, 3)
      call check_near(error, sum(force, 2), [0.0_wp, 0.0_wp], tol, 2.0_wp, "no resultant")
      call check_near(error, arm(1)*force(2, 1) - arm(2)*force(1, 1), moment, tol, 2.0_wp, "moment")
      call check_near(error, dot_product(arm, force(:, 1)), 0.0_wp, tol, 2.0_wp, "across")
      call check_near(error, force(:, 2), [0.0_wp, 0.0_wp], tol, 1.0_wp, "no other node")
      ! Half of the entries are of the side.
      slot = reshape([(merge(i, -i, i <= 8), i = 1, 16)], [4, 4])
      where (slot < 0) slot = slot + 8
      value = 0.0_dp
      side = 0.0_dp
      call add_moment_stiffness(x(:, node) + u(:, node), moment, slot, value, side)
      do j = 1, 2
         do b = 1, 2
            low = 0.0_wp
            high = 0.0_wp
            u(b, node(j)) = u(b, node(j)) - step
            call add_moment(node, moment, x, u, low)
            u(b, node(j)) = u(b, node(j)) + 2.0_wp*step
            call add_moment(node, moment, x, u, high)
            u(b, node(j)) = u(b, node(j)) - step
            do i = 1, 2
               do a = 1, 2
                  associate (k => slot(a + 2*(i - 1), b + 2*(j - 1)))
                     if (k > 0) row(a + 2*(i - 1)) = real(value(k), wp)
                     if (k < 0) row(a + 2*(i - 1)) = real(side(-k), wp)
                  end associate
               end do
            end do
            call check_near(error, row, reshape(low(:, node) - high(:, node), [4])/(2.0_wp*step), &
               max(100.0_wp*step**2, tol_dp), 10.0_wp, "less than their derivative")
         end do
      end do
   end subroutine test_moment

   !> On four nodes anywhere: no resultant, the moment, the work M.w of a rigid spin; the derivative
   !> by differences.
   subroutine test_moment_space(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: step = epsilon(1.0_wp)**(1.0_wp/3.0_wp), &
         moment(3) = [-1.5_wp, 0.5_wp, 2.0_wp], spin(3) = [0.3_wp, -0.7_wp, 0.4_wp]
      integer, parameter :: node(4) = [3, 1, 5, 4]
      real(wp) :: force(3, 5), low(3, 5), high(3, 5), place(3, 4), total(3), work, row(12)
      real(dp) :: value(72), side(72)
      integer :: slot(12, 12), i, j, k

      call shake(place, 0.2_wp)
      place(:, 2:) = place(:, 2:) + reshape([1.0_wp, 0.2_wp, 0.0_wp, 0.1_wp, 0.8_wp, 0.3_wp, &
         -0.2_wp, 0.0_wp, 0.9_wp], [3, 3])
      force = 2.0_wp
      call push_frame(node, moment, place, force)
      force = force - 2.0_wp
      total = 0.0_wp
      work = 0.0_wp
      do i = 1, 4
         total = total + cross_product(place(:, i), force(:, node(i)))
         work = work + dot_product(cross_product(spin, place(:, i)), force(:, node(i)))
      end do
      call check_near(error, sum(force, 2), [0.0_wp, 0.0_wp, 0.0_wp], tol, 4.0_wp, "no resultant")
      call check_near(error, total, moment, tol, 4.0_wp, "moment")
      call check_near(error, work, dot_product(moment, spin), tol, 4.0_wp, "work")
      call check_near(error, force(:, 2), [0.0_wp, 0.0_wp, 0.0_wp], tol, 1.0_wp, "no other node")
      ! Half of the entries are of the side.
      slot = reshape([(merge(i, 72 - i, i <= 72), i = 1, 144)], [12, 12])
      value = 0.0_dp
      side = 0.0_dp
      call push_frame_stiffness(place, moment, slot, value, side)
      do k = 1, 12
         low = 0.0_wp
         high = 0.0_wp
         associate (at => place(1 + mod(k - 1, 3), 1 + (k - 1)/3))
            at = at - step
            call push_frame(node, moment, place, low)
            at = at + 2.0_wp*step
            call push_frame(node, moment, place, high)
            at = at - step
         end associate
         do j = 1, 12
            if (slot(j, k) > 0) row(j) = real(value(slot(j, k)), wp)
            if (slot(j, k) < 0) row(j) = real(side(-slot(j, k)), wp)
         end do
         call check_near(error, row, reshape(low(:, node) - high(:, node), [12])/(2.0_wp*step), &
            max(100.0_wp*step**2, tol_dp), 10.0_wp, "less than their derivative")
      end do
   end subroutine test_moment_space

   !> (1, 0), (2, 4), (3, 2): constant outside; one load sees step time, the other total time.
   subroutine test_amplitude(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      type(load_t) :: load(2)
      real(wp) :: u(2, 9), force(2, 9)
      real(wp), parameter :: time(7) = [0.5_wp, 1.0_wp, 1.25_wp, 2.0_wp, 2.5_wp, 3.0_wp, 9.0_wp], &
         factor(7) = [0.0_wp, 0.0_wp, 1.0_wp, 4.0_wp, 3.0_wp, 2.0_wp, 2.0_wp]
      integer :: k

      call make_block(scene, "CPE4", [2, 2], block)
      deallocate(scene%amplitude)
      allocate(scene%amplitude(2))
      do k = 1, 2
         scene%amplitude(k) = amplitude_t(name="A", time=[1.0_wp, 2.0_wp, 3.0_wp], &
            value=[0.0_wp, 4.0_wp, 2.0_wp], is_total_time=k == 2)
         load(k)%kind = load_point
         load(k)%target = 5
         load(k)%place = k
         load(k)%value = 10.0_wp
         load(k)%amplitude = k
      end do
      call prepare(scene, .true., .true., load, system, error)
      if (allocated(error)) return
      u = 0.0_wp
      do k = 1, 7
         call forces(system, scene, instant_t(time(k), time(8 - k)), u, force)
         call check_near(error, force(:, 5), 10.0_wp*[factor(k), factor(8 - k)], 0.0_wp, 1.0_wp, &
            "forces in x and y")
      end do
   end subroutine test_amplitude

   !> x**3 (10 - 15 x + 6 x**2) of each change, by hand at quarters and halves of two spans; the
   !> slope is 0 at all points, so that none is a corner.
   subroutine test_smooth(error)
      type(error_t), allocatable, intent(out) :: error
      type(amplitude_t) :: table
      real(wp), parameter :: time(7) = [0.5_wp, 1.0_wp, 1.25_wp, 2.0_wp, 4.0_wp, 6.0_wp, 9.0_wp], &
         factor(7) = [0.0_wp, 0.0_wp, 0.4140625_wp, 4.0_wp, 3.0_wp, 2.0_wp, 2.0_wp], &
         rate(7) = [0.0_wp, 0.0_wp, 4.21875_wp, 0.0_wp, -0.9375_wp, 0.0_wp, 0.0_wp]
      real(wp) :: value(7), slope(7)
      integer :: k

      table = amplitude_t(name="A", time=[1.0_wp, 2.0_wp, 6.0_wp], &
         value=[0.0_wp, 4.0_wp, 2.0_wp], is_smooth=.true.)
      do k = 1, 7
         call find_amplitude_value(table, time(k), value(k), slope(k))
      end do
      call check_near(error, value, factor, tol, 4.0_wp, "factors")
      call check_near(error, slope, rate, tol, 4.0_wp, "slopes")
      call check_true(error, .not. any(amplitude_corners(table)), "a smooth table has a corner")
   end subroutine test_smooth

   !> From the value of the step before, over the 2 units of time of the step, and no farther;
   !> dynamic: at once.
   subroutine test_ramp(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(system_t) :: system
      type(load_t) :: load
      real(wp) :: u(2, 9), force(2, 9)
      integer :: k

      load%kind = load_point
      load%target = 5
      load%place = 1
      load%value = 10.0_wp
      load%value_start = 2.0_wp
      u = 0.0_wp
      do k = 1, 2
         call make_block(scene, "CPE4", [2, 2], block)
         call prepare(scene, k == 1, .true., [load], system, error)
         if (allocated(error)) return
         call forces(system, scene, instant_t(0.5_wp, 77.5_wp), u, force)
         call check_near(error, force(1, 5), merge(4.0_wp, 10.0_wp, k == 1), 0.0_wp, 1.0_wp, &
            "at a quarter of the step")
         call forces(system, scene, instant_t(2.5_wp, 79.5_wp), u, force)
         call check_near(error, force(1, 5), 10.0_wp, 0.0_wp, 1.0_wp, "beyond its end")
      end do
   end subroutine test_ramp

   !> Ramp in a static step, at once in a dynamic one, along an amplitude with its slope, frozen.
   subroutine test_motion(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(prescribed_t) :: prescribed
      type(instant_t), parameter :: instant = instant_t(0.5_wp, 1.5_wp)
      real(wp) :: u, v
      real(wp), parameter :: start(1, 1) = 2.0_wp

      call make_block(scene, "CPE4", [2, 2], block)
      prescribed%node = 1
      prescribed%dof = 1
      call add_step(scene, .true., 0.5_wp, 4)
      call add_step(scene, .false., 0.5_wp, 4)
      prescribed%value = 4.0_wp
      call prescribed_motion(scene, scene%step(1), prescribed, instant, start, u, v)
      call check_near(error, [u, v], [2.5_wp, 0.0_wp], 0.0_wp, 1.0_wp, "static ramp from 2 to 4")
      call prescribed_motion(scene, scene%step(2), prescribed, instant, start, u, v)
      call check_near(error, [u, v], [4.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "dynamic: at once")
      deallocate(scene%amplitude)
      allocate(scene%amplitude(1))
      scene%amplitude(1) = amplitude_t(name="A", time=[1.0_wp, 2.0_wp], value=[0.0_wp, 8.0_wp], &
         is_total_time=.true.)
      prescribed%amplitude = 1
      call prescribed_motion(scene, scene%step(2), prescribed, instant, start, u, v)
      call check_near(error, [u, v], [16.0_wp, 32.0_wp], 0.0_wp, 1.0_wp, "along an amplitude")
      prescribed%is_frozen = .true.
      call prescribed_motion(scene, scene%step(2), prescribed, instant, start, u, v)
      call check_near(error, [u, v], [2.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "frozen")
   end subroutine test_motion

end module test_loads
