!> All elements together: masses in closed form, assembly, bad geometry.
module test_solid
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_csr, only : csr_t
   use emcon_element, only : element_geometry_t
   use emcon_element_plane, only : element_motion_t, element_response_t
   use emcon_element_registry, only : find_element_row
   use emcon_host_law, only : host_response_t
   use emcon_errors, only : err_input, error_t
   use emcon_kinds, only : wp
   use emcon_law_registry, only : law_linear
   use emcon_materials, only : kinematics_linear
   use emcon_motion, only : motion_of, motion_t
   use emcon_evaluation, only : evaluation_at_end, evaluation_t
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_geometry, solid_init, solid_t
   use emcon_solid_respond, only : solid_element_respond
   use emcon_solid_term, only : solid_term_init, solid_term_t
   use emcon_space, only : space_t
   use emcon_system, only : system_begin_step, system_init, system_respond, system_t
   use emcon_term, only : response_begin, response_init, response_t, role_internal
   use emcon_stepper, only : stepper_t
   use emcon_text, only : to_text
   use kind_rows, only : law_code
   use one_element, only : read_one
   use small_scenes, only : add_block, add_step, block_t, make_block, poisson, shake, young
   implicit none
   private
   public :: collect_solid

   real(wp), parameter :: eps = epsilon(1.0_wp)
   real(wp), parameter :: tol = 16.0_wp*eps

contains

   subroutine collect_solid(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("mass of a rectangle and a triangle", test_closed_forms), &
         test_case_t("total mass and row sums of a distorted mesh", test_total), &
         test_case_t("forces and energies are the sums over the elements", test_sums), &
         test_case_t("translation by 1e8 costs nothing", test_translation), &
         test_case_t("which elements are too stiff in bending", test_stiff_bent), &
         test_case_t("laws of elements that are not of small strains", test_linear_laws), &
         test_case_t("modes inside let rectangles bend", test_bent), &
         test_case_t("what displacements round", test_rounding), &
         test_case_t("first inverted element is named", test_inverted), &
         test_case_t("tangents that are symmetric", test_symmetric), &
         test_case_t("clockwise element", test_clockwise), &
         test_case_t("element without area", test_no_area)]
   end subroutine collect_solid

   !> m/36 (4, 2, 1, 2) of a rectangle, m/12 (2, 1, 1) of a triangle.
   subroutine test_closed_forms(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(solid_t) :: solid
      real(wp), parameter :: mass = 3.0_wp*0.25_wp*6.0_wp, zero = 0.0_wp
      real(wp) :: expected(4, 4)
      integer :: i

      call make_block(scene, "CPE4", [1, 1], block)
      call add_block(scene, "CPE3", [1, 1], [5.0_wp, 1.0_wp], [1.0_wp, 1.0_wp], block)
      scene%x(1, :) = 2.0_wp*scene%x(1, :)
      scene%x(2, :) = 3.0_wp*scene%x(2, :)
      scene%material(1)%density = 3.0_wp
      scene%section(1)%thickness = 0.25_wp
      call solid_init(solid, scene, error)
      if (allocated(error)) return
      do i = 1, 4
         expected(:, i) = mass/36.0_wp*cshift([4.0_wp, 2.0_wp, 1.0_wp, 2.0_wp], 1 - i)
      end do
      call check_near(error, solid%mass%consistent(:, :, 1), expected, tol, mass, "rectangle")
      expected = zero
      expected(:3, :3) = 0.5_wp*mass/12.0_wp*reshape([2.0_wp, 1.0_wp, 1.0_wp, 1.0_wp, 2.0_wp, &
         1.0_wp, 1.0_wp, 1.0_wp, 2.0_wp], [3, 3])
      call check_near(error, solid%mass%consistent(:, :, 2), expected, tol, mass, "triangle")
      call check_near(error, solid%mass%of_volume(:, 1), spread(0.25_wp*mass, 1, 4), tol, mass, &
         "quarters of the rectangle")
      call check_near(error, solid%mass%of_volume(:, 3), mass/6.0_wp*[1.0_wp, 1.0_wp, 1.0_wp, &
         zero], tol, mass, "thirds of the triangle")
   end subroutine test_closed_forms

   !> Moved inner nodes leave the mass of the block; rows of the mass sum to int rho N.
   subroutine test_total(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(solid_t) :: solid
      real(wp) :: move(2, 16)
      integer :: e, k
      character(len=4), parameter :: name(2) = ["CPE3", "CPE4"]

      do k = 1, 2
         call make_block(scene, name(k), [3, 3], block)
         call shake(move, 0.25_wp)
         scene%x(:, [6, 7, 10, 11]) = scene%x(:, [6, 7, 10, 11]) + move(:, [6, 7, 10, 11])
         scene%material(1)%density = 0.5_wp
         scene%section(1)%thickness = 0.5_wp
         call solid_init(solid, scene, error)
         if (allocated(error)) return
         call check_near(error, sum(solid%mass%consistent), 2.25_wp, tol, 2.25_wp, name(k) &
            // ": total")
         do e = 1, solid%n_element
            call check_near(error, sum(solid%mass%consistent(:, :, e), dim=1), &
               solid%mass%of_volume(:, e), tol, 1.0_wp, name(k) // ": row sums")
         end do
      end do
   end subroutine test_total

   subroutine test_sums(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(solid_term_t) :: term
      type(response_t) :: response
      type(element_response_t) :: part
      type(element_motion_t) :: motion
      type(host_response_t) :: nothing
      real(wp), allocatable :: u0(:, :), du(:, :), force(:, :)
      integer :: e, n

      call make_block(scene, "CPE4", [2, 2], block)
      call add_block(scene, "CPE3", [2, 1], [5.0_wp, 1.0_wp], [2.0_wp, 1.0_wp], block)
      call make_term(scene, term, response, error)
      if (allocated(error)) return
      allocate(u0, du, force, source=scene%x)
      call shake(u0, 0.1_wp)
      call shake(du, 0.1_wp)
      call term%respond(motion_of(evaluation_t(), scene%x, u0, du), response)
      force = 0.0_wp
      associate (solid => term%solid)
         do e = 1, solid%n_element
            n = solid%trait%n_node(e)
            associate (node => solid%node(:n, e))
               motion%from(:, :4) = local(u0(:, node))
               motion%by(:, :4) = local(du(:, node))
               call solid_element_respond(solid, e, motion, nothing, .false., part)
               force(:, node) = force(:, node) + part%force(:, :n)
               call check_near(error, response%energy(e), part%energy, tol, young, "energy")
            end associate
         end do
      end associate
      call check_near(error, response%part(role_internal)%force, force, tol, young, "forces")
   end subroutine test_sums

   !> The elements of `scene` as a term, and room for its response.
   subroutine make_term(scene, term, response, error)
      type(scene_t), intent(in) :: scene
      type(solid_term_t), intent(out) :: term
      type(response_t), intent(out) :: response
      type(error_t), allocatable, intent(out) :: error

      call solid_term_init(term, scene, error)
      call response_init(response, 2, size(scene%x, 2), size(scene%element%kind))
   end subroutine make_term

   pure function local(field) result(four)
      real(wp), intent(in) :: field(:, :)
      real(wp) :: four(2, 4)

      four = 0.0_wp
      four(:, :size(field, 2)) = field
   end function local

   !> A body that has flown 1e8 of its elements: forces are round-off of its displacements, of the
   !> size that the response itself states, and the energy is of the order of its square.
   subroutine test_translation(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(solid_term_t) :: term
      type(response_t) :: response
      real(wp), allocatable :: u0(:, :), du(:, :), move(:, :)

      call make_block(scene, "CPE4", [2, 2], block)
      allocate(u0, du, move, source=scene%x)
      call shake(move, 0.25_wp)
      scene%x = scene%x + move
      call make_term(scene, term, response, error)
      if (allocated(error)) return
      u0 = 1.0e8_wp
      du = 0.0_wp
      du(1, :) = -3.0e7_wp
      call term%respond(motion_of(evaluation_t(), scene%x, u0, du), response)
      call check_near(error, response%energy, 0.0_wp*response%energy, (4.0e8_wp*eps)**2, young, &
         "energy")
      call check_near(error, abs(response%part(role_internal)%force)/response%rounding, &
         0.0_wp*u0, 4.0_wp*eps, 1.0_wp, &
         "forces over their round-off")
   end subroutine test_translation

   subroutine test_inverted(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(solid_term_t) :: term
      type(response_t) :: response
      real(wp), allocatable :: u0(:, :), du(:, :)

      call make_block(scene, "CPE4", [3, 1], block)
      call make_term(scene, term, response, error)
      if (allocated(error)) return
      allocate(u0, du, source=0.0_wp*scene%x)
      du(1, [4, 8]) = -1.5_wp                    ! the right side of element 3
      call term%respond(motion_of(evaluation_t(), scene%x, u0, du), response)
      call check_true(error, allocated(response%refusal), "refused")
      if (allocated(response%refusal)) call check_equal(error, response%refusal, &
         "element 3 is inverted", "refusal")
      call response_begin(response)
      call term%respond(motion_of(evaluation_t(), scene%x, u0, 0.5_wp*du), response)
      call check_true(error, .not. allocated(response%refusal), "half of it is not")
   end subroutine test_inverted

   subroutine test_clockwise(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: block
      type(solid_t) :: solid

      call make_block(scene, "CPE4", [2, 1], block)
      scene%element%node(:, 2) = scene%element%node([1, 4, 3, 2], 2)
      scene%element%label = [10, 77]
      call solid_init(solid, scene, raised)
      call check_error(error, raised, err_input, "element 77", "clockwise element")
   end subroutine test_clockwise

   subroutine test_no_area(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: block
      type(solid_t) :: solid

      call make_block(scene, "CPE3", [1, 1], block)
      scene%x(:, 3) = scene%x(:, 1)
      call solid_init(solid, scene, raised)
      call check_error(error, raised, err_input, "element 2", "element without area")
   end subroutine test_no_area

   !> At the end of a motion all are; in steps those of linear laws at small strains, and what has
   !> no elements but those of small kinematics.
   subroutine test_symmetric(error)
      type(error_t), allocatable, intent(out) :: error
      !> Of the two elements: is the law linear, is the section; symmetric with and without nlgeom
      logical, parameter :: has_linear_law(2, 4) = reshape([.true., .true., .true., .false., &
         .false., .true., .false., .false.], [2, 4]), is_small(2, 4) = reshape([.false., .false., &
         .false., .true., .false., .true., .true., .true.], [2, 4]), expected(2, 4) = reshape([ &
         .false., .true., .false., .true., .false., .false., .true., .true.], [2, 4])
      type(scene_t) :: scene
      type(block_t) :: block
      type(solid_term_t) :: term
      type(space_t) :: space
      type(csr_t) :: matrix
      type(motion_t) :: motion
      integer :: slot(128), i, k                 ! two elements of eight unknowns

      slot = 0
      do k = 1, size(expected, 2)
         call make_block(scene, "CPE4", [2, 1], block)
         scene%material = [scene%material, scene%material]
         scene%section = [scene%section, scene%section]
         scene%section%material = [1, 2]
         scene%element%section = [1, 2]
         do i = 1, 2
            if (has_linear_law(i, k)) scene%material(i)%law = law_code("linear")
            if (is_small(i, k)) scene%section(i)%kinematics = kinematics_linear
         end do
         call solid_term_init(term, scene, error)
         if (allocated(error)) return
         call add_step(scene, .true., 0.1_wp, 1)
         motion%x = scene%x
         do i = 1, 2
            scene%step(1)%nlgeom = i == 1
            call term%begin_step(scene, 1, space, matrix, slot)
            motion%evaluation = evaluation_t(is_gradient=.true.)
            call check_true(error, term%is_symmetric(motion), "at the end")
            motion%evaluation%is_gradient = .false.
            call check_true(error, term%is_symmetric(motion) .eqv. expected(i, k), "case " &
               // to_text(k) // ", nlgeom " // to_text(2 - i))
         end do
      end do
   end subroutine test_symmetric

   !> Of three materials the second is linear; elements of small strains are others' matter.
   subroutine test_linear_laws(error)
      type(error_t), allocatable, intent(out) :: error
      !> Material of each of three elements, of which the first has small strains
      integer, parameter :: material(3, 4) = reshape([1, 2, 2, 1, 2, 3, 3, 1, 2, 2, 3, 2], [3, 4])
      logical, parameter :: are_linear(4) = [.true., .false., .false., .false.]
      type(scene_t) :: scene
      type(block_t) :: block
      type(solid_term_t) :: term
      integer :: k

      do k = 1, 4
         call make_block(scene, "CPE4", [3, 1], block)
         scene%material = scene%material([1, 1, 1])
         scene%material(2)%law = law_linear
         scene%section = scene%section([1, 1, 1])
         scene%section(1)%kinematics = kinematics_linear
         scene%section%material = material(:, k)
         scene%element%section = [1, 2, 3]
         call solid_term_init(term, scene, error)
         if (allocated(error)) return
         call check_true(error, term%has_linear_laws .eqv. are_linear(k), "case " // to_text(k))
      end do
   end subroutine test_linear_laws

   !> Those with nodes at corners alone and no modes, unless they are rigid.
   subroutine test_stiff_bent(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: name(6) = [character(len=5) :: "CPE3", "CPE4", "CPE4I", &
         "CPE6", "CPE8", "C3D4"]
      logical, parameter :: is_stiff(6) = [.true., .true., .false., .false., .false., .true.]
      type(stepper_t) :: stepper
      type(scene_t) :: scene
      type(block_t) :: block
      type(solid_t) :: solid
      integer :: k

      do k = 1, size(name)
         call read_one(trim(name(k)), 3, "NONLINEAR", stepper, error)
         if (.not. allocated(error)) call solid_init(solid, stepper%scene, error)
         if (allocated(error)) return
         call check_true(error, all(solid%trait%is_stiff_bent .eqv. is_stiff(k)), trim(name(k)))
         stepper = stepper_t()
      end do
      call make_block(scene, "CPE4", [2, 1], block)
      deallocate(scene%rigid)
      allocate(scene%rigid(1))
      scene%rigid(1)%element = [2]
      call solid_init(solid, scene, error)
      if (allocated(error)) return
      call check_true(error, all(solid%trait%is_stiff_bent .eqv. [.true., .false.]), "a rigid one")
   end subroutine test_stiff_bent

   !> Of a triangle with the sides 1 at a right angle slopes of shape functions are 1, twice so at
   !> the corner; in a ring they are N/r around it, at three points. Those of corners are below 0
   !> where there are nodes between them.
   subroutine test_rounding(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: modulus = young*(1.0_wp - poisson)/((1.0_wp + poisson)*(1.0_wp &
         - 2.0_wp*poisson))
      type(scene_t) :: scene
      type(block_t) :: block
      type(solid_t) :: solid, quadratic
      type(stepper_t) :: stepper
      type(element_geometry_t) :: geometry
      real(wp) :: expected(3), around(3), own(6), sums(6)
      integer :: k, j

      do k = 1, 2
         call make_block(scene, "CPE3", [1, 1], block)
         scene%x(1, :) = scene%x(1, :) + 0.5_wp
         if (k == 2) scene%element%kind = find_element_row("CAX3")
         scene%is_axial = k == 2
         call solid_init(solid, scene, error)
         if (allocated(error)) return
         expected = 0.0_wp
         around = 0.0_wp
         call solid_geometry(solid, 1, geometry)
         do j = 1, geometry%n_gp
            if (k == 2) around = abs(geometry%circle(:, j))
            expected = expected + geometry%weight(j)*(4.0_wp + sum(around)) &
               *([1.0_wp, 2.0_wp, 1.0_wp] + around)
         end do
         ! By the law's half of its modulus, as over a step.
         call check_near(error, solid%stiffness(:3, 1), 0.5_wp*modulus*expected, tol, &
            modulus*expected(2), "stiffness by slopes")
      end do
      call read_one("CAX6", 3, "NONLINEAR", stepper, error)
      if (.not. allocated(error)) call solid_init(quadratic, stepper%scene, error)
      if (allocated(error)) return
      call solid_geometry(quadratic, 1, geometry)
      sums = 0.0_wp
      do j = 1, geometry%n_gp
         own = sum(abs(geometry%gradient(:, :, j)), 1) + abs(geometry%circle(:, j))
         sums = sums + geometry%weight(j)*sum(own)*own
      end do
      call check_true(error, any(geometry%circle < 0.0_wp), "below 0")
      call check_near(error, quadratic%stiffness(:6, 1), 0.5_wp*modulus*sums, tol, &
         modulus*maxval(sums), "with nodes between")
   end subroutine test_rounding

   !> Of a small curvature k, -k x y and k x**2/2 at nodes, a beam of CPE4I stores what one in plane
   !> strain does, E/(1 - nu**2) k**2/24 of its moment of inertia and length, side by side or alone.
   subroutine test_bent(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: curvature = 1.0e-5_wp, high = 0.75_wp
      type(scene_t) :: scene
      type(system_t) :: system
      type(block_t) :: block
      type(motion_t) :: motion
      real(wp), allocatable :: u(:, :)
      real(wp) :: stored
      integer :: n

      do n = 1, 9, 4
         call make_block(scene, "CPE4", [n, 1], block)
         scene%element%kind = find_element_row("CPE4I")
         scene%x(2, :) = high*(scene%x(2, :) - 0.5_wp)
         call add_step(scene, .true., 1.0_wp, 1)
         call system_init(system, scene, error)
         if (.not. allocated(error)) call system_begin_step(system, scene, 1, error)
         if (allocated(error)) return
         u = scene%x
         u(1, :) = -curvature*scene%x(1, :)*scene%x(2, :)
         u(2, :) = 0.5_wp*curvature*scene%x(1, :)**2
         motion = motion_of(evaluation_at_end, scene%x, 0.0_wp*u, u)
         call system_respond(system, motion, .false.)
         stored = young/(1.0_wp - poisson**2)*curvature**2/24.0_wp*high**3*n
         ! Turns of k n add strains of the size of their squares to those of k.
         call check_near(error, sum(system%response%energy), stored, 10.0_wp*n**2*curvature, &
            stored, to_text(n) // " elements")
      end do
   end subroutine test_bent

end module test_solid
