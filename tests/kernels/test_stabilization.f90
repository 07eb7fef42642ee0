!> Viscous stress of *STATIC, STABILIZE: force and tangent are derivatives of its potential, it
!> takes the part of the strain energy that is asked for, and nothing of what does not strain.
module test_stabilization
   use check, only : check_near, check_true, test_case_t
   use emcon_csr, only : csr_t
   use emcon_element, only : element_geometry_t
   use emcon_element_registry, only : find_element_row
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_at_end
   use emcon_host_law, only : host_law_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_evaluate, motion_of, motion_t
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_geometry, solid_init, solid_t
   use emcon_space, only : space_t
   use emcon_stabilization, only : stabilization_term_init, stabilization_term_t
   use emcon_stepper, only : stepper_t
   use emcon_term, only : response_begin, response_init, response_t, role_internal
   use given_hosts, only : well_t
   use kind_rows, only : law_code
   use one_element, only : law_given, read_one
   use random_draws, only : draw_random
   use small_scenes, only : add_step, block_t, make_block
   implicit none
   private
   public :: collect_stabilization

   real(wp), parameter :: part = 0.02_wp, h = 0.1_wp, tol = 256.0_wp*epsilon(1.0_wp)
   character(len=6), parameter :: kinds(*) = [character(len=6) :: "CPE4", "CPE4I", "CPE4H", &
      "CPS3", &
      "CAX4", "C3D8", "C3D8I", "C3D4"]

   !> One element, and its motion.
   type :: sample_t
      type(scene_t) :: scene
      type(space_t) :: space
      type(csr_t) :: matrix
      type(stabilization_term_t) :: term
      type(solid_t) :: solid
      type(motion_t) :: motion
   end type sample_t

contains

   subroutine collect_stabilization(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("derivatives of the potential", test_derivatives), &
         test_case_t("small motions, with large rotations and without", test_small), &
         test_case_t("tangent times a field; entries of a condensed one", test_times), &
         test_case_t("laws that are given, as elastic ones of their modulus", test_given), &
         test_case_t("the part of the strain energy that is asked for", test_part), &
         test_case_t("two kinds of elements of one law", test_mixed), &
         test_case_t("drag takes as much of what has grown in time", test_drag), &
         test_case_t("a turn takes nothing", test_turn)]
   end subroutine collect_stabilization

   subroutine begin(kind, size_of_motion, sample, error, constant, user)
      character(len=*), intent(in) :: kind
      real(wp), intent(in) :: size_of_motion
      type(sample_t), intent(out) :: sample
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: constant(:)    !! of an elastic law
      type(host_law_t), intent(in), optional :: user(:)
      type(stepper_t) :: stepper
      real(wp), allocatable :: u0(:, :), du(:, :)
      integer :: i

      call read_one(trim(kind), merge(law_given, 1, present(user)), "NONLINEAR", stepper, error)
      if (allocated(error)) return
      if (present(constant)) stepper%scene%material(1)%constant = constant
      call solid_init(sample%solid, stepper%scene, error, user)
      if (allocated(error)) return
      allocate(u0, du, mold=stepper%scene%x)
      call draw_random(u0)
      call draw_random(du)
      stepper%scene%step(1)%stabilization = part
      stepper%scene%step(1)%time%h = h
      call stabilization_term_init(sample%term, sample%solid)
      sample%scene = stepper%scene
      call sample%term%begin_step(sample%scene, 1, sample%space, sample%matrix, [(i, i = 1, &
         size(du)**2)])
      sample%motion = motion_of(evaluation_at_end, stepper%scene%x, size_of_motion*(u0 - 0.5_wp), &
         size_of_motion*(du - 0.5_wp))
      sample%motion%evaluation%lapse = h
   end subroutine begin

   subroutine find(sample, du, work, force, tangent)
      type(sample_t), intent(inout) :: sample
      real(wp), intent(in) :: du(:, :)
      real(wp), intent(out) :: work
      real(wp), intent(out) :: force(:)          !! (size(du))
      real(dp), intent(out) :: tangent(:)        !! (size(du)**2) by columns
      type(response_t) :: response
      real(dp) :: none(1)

      call response_init(response, size(du, 1), size(du, 2), 1)
      call response_begin(response)
      sample%motion%du = du
      call motion_evaluate(sample%motion)
      tangent = 0.0_dp
      call sample%term%respond(sample%motion, response, tangent, none)
      work = sample%term%work
      force = reshape(response%part(role_internal)%force, [size(force)])
   end subroutine find

   !> By central differences, whose error falls as the square of their size.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      real(wp), parameter :: small = epsilon(1.0_wp)**0.333_wp
      real(wp), allocatable :: du(:, :), force(:), low(:), high(:), slope(:), by(:, :)
      real(wp) :: work, less, more
      real(dp), allocatable :: tangent(:), other(:)
      integer :: i, j, k

      do k = 1, size(kinds)
         call begin(kinds(k), 0.2_wp, sample, error)
         if (allocated(error)) return
         du = sample%motion%du
         allocate(force(size(du)), low(size(du)), high(size(du)), slope(size(du)), &
            by(size(du), size(du)), tangent(size(du)**2), other(size(du)**2))
         call find(sample, du, work, force, tangent)
         call check_true(error, work > 0.0_wp, trim(kinds(k)) // ": takes something")
         do j = 1, size(du)
            associate (a => 1 + mod(j - 1, size(du, 1)), node => 1 + (j - 1)/size(du, 1))
               du(a, node) = du(a, node) + small
               call find(sample, du, more, high, other)
               du(a, node) = du(a, node) - 2.0_wp*small
               call find(sample, du, less, low, other)
               du(a, node) = du(a, node) + small
            end associate
            slope(j) = 0.5_wp*(more - less)/(2.0_wp*small)
            by(:, j) = (high - low)/(2.0_wp*small)
         end do
         call check_near(error, slope, force, 100.0_wp*small**2, maxval(abs(force)), &
            trim(kinds(k)) // ": force")
         do i = 1, size(du)
            call check_near(error, by(:, i), real(tangent(size(du)*(i - 1) + 1:size(du)*i), wp), &
               100.0_wp*small**2, real(maxval(abs(tangent)), wp), trim(kinds(k)) // ": tangent")
         end do
         deallocate(force, low, high, slope, by, tangent, other)
         if (allocated(error)) return
      end do
   end subroutine test_derivatives

   !> Where nothing has moved both are the same, in rings too.
   subroutine test_small(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      real(wp), allocatable :: force(:)
      real(wp) :: work
      real(dp), allocatable :: tangent(:, :)
      integer :: i, j, k

      do k = 1, size(kinds)
         call begin(kinds(k), 0.0_wp, sample, error)
         if (allocated(error)) return
         associate (n => size(sample%motion%du))
            allocate(force(n), tangent(n**2, 2))
            do j = 1, 2
               sample%scene%step(1)%nlgeom = j == 1
               call sample%term%begin_step(sample%scene, 1, sample%space, sample%matrix, [(i, &
                  i = 1, n**2)])
               call find(sample, sample%motion%du, work, force, tangent(:, j))
            end do
         end associate
         call check_near(error, real(tangent(:, 1), wp), real(tangent(:, 2), wp), &
            256.0_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp)), &
            real(maxval(abs(tangent)), wp), trim(kinds(k)) // ": tangent")
         call check_true(error, maxval(abs(tangent)) > 0.0_dp, "there is one")
         deallocate(force, tangent)
         if (allocated(error)) return
      end do
   end subroutine test_small

   !> The tangent that the matrix is given, and nothing where there is no time; entries of the slots
   !> below 0 go to the side.
   subroutine test_times(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(response_t) :: response
      real(wp), allocatable :: force(:), way(:, :), product(:, :), by_matrix(:)
      real(dp), allocatable :: tangent(:), value(:), side(:)
      real(wp) :: work
      integer :: k, i

      do k = 1, size(kinds)
         call begin(kinds(k), 0.2_wp, sample, error)
         if (allocated(error)) return
         allocate(way, product, mold=sample%motion%x)
         associate (n => size(way))
            allocate(force(n), tangent(n**2), value(n**2), side(n**2))
            call find(sample, sample%motion%du, work, force, tangent)
            call draw_random(way)
            by_matrix = matmul(reshape(real(tangent, wp), [n, n]), reshape(way, [n]))
            product = 1.0_wp
            call sample%term%tangent_times(sample%motion, way, product)
            call check_near(error, reshape(product, [n]), 1.0_wp + by_matrix, tol, &
               real(maxval(abs(tangent)), wp), trim(kinds(k)) // ": times")
            sample%motion%evaluation%lapse = 0.0_wp
            call sample%term%tangent_times(sample%motion, way, product)
            call check_near(error, reshape(product, [n]), 1.0_wp + by_matrix, tol, &
               real(maxval(abs(tangent)), wp), trim(kinds(k)) // ": no time")
            sample%motion%evaluation%lapse = h
            call sample%term%begin_step(sample%scene, 1, sample%space, sample%matrix, &
               [(merge(-i, 0, mod(i, 3) > 0), i = 1, n**2)])
            call response_init(response, size(way, 1), size(way, 2), 1)
            value = 0.0_dp
            side = 0.0_dp
            call sample%term%respond(sample%motion, response, value, side)
            where ([(mod(i, 3) == 0, i = 1, n**2)]) tangent = 0.0_dp
            call check_near(error, real([value, side], wp), real([0.0_dp*value, tangent], wp), &
               tol, real(maxval(abs(tangent)), wp), trim(kinds(k)) // ": to the side")
            associate (total => response%part(role_internal))
               call check_near(error, total%magnitude, abs(total%force), tol, maxval(abs(force)), &
                  trim(kinds(k)) // ": sizes")
            end associate
         end associate
         deallocate(force, way, product, tangent, value, side)
         if (allocated(error)) return
      end do
   end subroutine test_times

   !> W = k |E|^2/2 resists as an elastic law of lambda + 2 mu = k, lambda = mu.
   subroutine test_given(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: k = 30.0_wp, young = 2.5_wp*k/3.0_wp
      type(sample_t) :: own, given
      real(wp), allocatable :: force(:), other(:)
      real(dp), allocatable :: tangent(:)
      type(host_law_t) :: law(1)
      type(well_t) :: well
      real(wp) :: work(2)
      integer :: i

      do i = 1, 2
         well%k = k
         well%n_variable = merge(3, 6, i == 1)
         law(1)%material = "M"
         if (allocated(law(1)%energy)) deallocate(law(1)%energy)
         allocate(law(1)%energy, source=well)
         call begin(trim(merge("CPE4", "C3D8", i == 1)), 0.2_wp, own, error, &
            constant=[young, 0.25_wp])
         if (.not. allocated(error)) call begin(trim(merge("CPE4", "C3D8", i == 1)), 0.2_wp, &
            given, error, user=law)
         if (allocated(error)) return
         given%motion = own%motion
         allocate(force(size(own%motion%du)), other(size(own%motion%du)), &
            tangent(size(own%motion%du)**2))
         call find(own, own%motion%du, work(1), force, tangent)
         call find(given, own%motion%du, work(2), other, tangent)
         call check_near(error, work(2), work(1), tol, work(1), "work")
         call check_near(error, other, force, tol, maxval(abs(force)), "forces")
         deallocate(force, other, tangent)
         if (allocated(error)) return
      end do
   end subroutine test_given

   !> Of a small uniform strain from rest, E = 100, nu = 0.3, over the first increment: along x
   !> alone, of a ring along its circles as well.
   subroutine test_part(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      real(wp), parameter :: strain = 1.0e-3_wp, modulus = 100.0_wp*0.7_wp/(1.3_wp*0.4_wp)
      real(wp), allocatable :: force(:), du(:, :)
      real(dp), allocatable :: tangent(:)
      type(element_geometry_t) :: geometry
      real(wp) :: work
      integer :: k

      do k = 1, size(kinds)
         if (any(kinds(k) == ["CPE4H", "CPS3 "])) cycle
         call begin(kinds(k), 0.0_wp, sample, error)
         if (allocated(error)) return
         du = 0.0_wp*sample%motion%x
         du(1, :) = strain*sample%motion%x(1, :)
         allocate(force(size(du)), tangent(size(du)**2))
         call find(sample, du, work, force, tangent)
         call solid_geometry(sample%solid, 1, geometry)
         call check_near(error, work, 0.5_wp*part*modulus*strain**2*merge(2.0_wp/0.7_wp, 1.0_wp, &
            kinds(k) == "CAX4")*sum(geometry%weight), 2.0_wp*strain, work, &
            trim(kinds(k)) // ": work")
         deallocate(force, tangent)
         if (allocated(error)) return
      end do
   end subroutine test_part

   !> Two elements of one law, of which one has its pressure in the mean: each by its own moduli.
   subroutine test_mixed(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=5), parameter :: left(3) = ["CPE4 ", "CPE4H", "CPE4 "], &
         right(3) = ["CPE4 ", "CPE4H", "CPE4H"]
      type(sample_t) :: sample
      type(block_t) :: block
      type(response_t) :: response
      real(wp) :: work(3)
      integer :: i, k

      do k = 1, 3
         associate (scene => sample%scene)
            call make_block(scene, "CPE4", [2, 1], block)
            scene%material(1)%law = law_code("neo hooke")
            scene%material(1)%constant = [20.0_wp, 0.05_wp]
            scene%element%kind = [find_element_row(trim(left(k))), find_element_row(trim(right(k)))]
            call add_step(scene, .true., h, 1)
            scene%step(1)%stabilization = part
            call solid_init(sample%solid, scene, error)
            if (allocated(error)) return
            call stabilization_term_init(sample%term, sample%solid)
            call sample%term%begin_step(scene, 1, sample%space, sample%matrix, [(i, i = 1, 128)])
            sample%motion = motion_of(evaluation_at_end, scene%x, 0.0_wp*scene%x, &
               1.0e-3_wp*scene%x)
         end associate
         sample%motion%evaluation%lapse = h
         call response_init(response, 2, 6, 1)
         call response_begin(response)
         call sample%term%respond(sample%motion, response)
         work(k) = sample%term%work
      end do
      call check_near(error, work(3), 0.5_wp*(work(1) + work(2)), 0.01_wp, work(3), "half of each")
      call check_true(error, abs(work(2) - work(1)) > 0.1_wp*work(1), "of which one takes more")
   end subroutine test_mixed

   !> After ten increments of a small uniform strain, over the eleventh: twice as much, of the
   !> stress
   !> and of the drag, where nothing moves but by the strain.
   subroutine test_drag(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      real(wp), parameter :: strain = 1.0e-4_wp
      real(wp), allocatable :: force(:), du(:, :)
      real(dp), allocatable :: tangent(:)
      real(wp) :: work, alone
      integer :: k

      do k = 1, size(kinds)
         call begin(kinds(k), 0.0_wp, sample, error)
         if (allocated(error)) return
         du = 0.0_wp*sample%motion%x
         du(2, :) = strain*sample%motion%x(2, :)
         allocate(force(size(du)), tangent(size(du)**2))
         call find(sample, du, alone, force, tangent)
         sample%motion%u0 = 10.0_wp*du
         call find(sample, du, work, force, tangent)
         call check_near(error, work, 2.0_wp*alone, 60.0_wp*strain, alone, trim(kinds(k)))
         sample%motion%u0(1, :) = sample%motion%u0(1, :) + 1.0_wp
         if (kinds(k) /= "CAX4") then
            call find(sample, du, work, force, tangent)
            call check_true(error, work < 1.01_wp*alone, trim(kinds(k)) // ": carried along")
         end if
         deallocate(force, tangent)
         if (allocated(error)) return
      end do
   end subroutine test_drag

   !> From rest by a large angle.
   subroutine test_turn(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: c = cos(0.8_wp), s = sin(0.8_wp)
      type(sample_t) :: sample
      real(wp), allocatable :: force(:), du(:, :), place(:, :)
      real(dp), allocatable :: tangent(:)
      real(wp) :: work
      integer :: k

      do k = 1, size(kinds)
         if (kinds(k) == "CAX4") cycle
         call begin(kinds(k), 0.0_wp, sample, error)
         if (allocated(error)) return
         place = sample%motion%x + sample%motion%u0
         du = 0.0_wp*place
         du(1, :) = (c - 1.0_wp)*place(1, :) - s*place(2, :) + 3.0_wp
         du(2, :) = s*place(1, :) + (c - 1.0_wp)*place(2, :)
         allocate(force(size(du)), tangent(size(du)**2))
         call find(sample, du, work, force, tangent)
         call check_near(error, force, 0.0_wp*force, tol, real(maxval(abs(tangent)), wp), &
            trim(kinds(k)) // ": force")
         deallocate(force, tangent)
         if (allocated(error)) return
      end do
   end subroutine test_turn

end module test_stabilization
