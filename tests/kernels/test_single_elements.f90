!> Elements that respond one by one: sums and tangents of several kinds side by side in space, what
!> is written of them, and the fastest.
module test_single_elements
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_critical_step, only : critical_bound
   use emcon_csr, only : csr_multiply
   use emcon_element, only : element_geometry_t
   use emcon_element_kind, only : find_element_kind
   use emcon_element_registry, only : element_kinds_create
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_at_end, evaluation_t, instant_t
   use emcon_kinds, only : dp, wp
   use emcon_law_space, only : law_response_space, space_response_t
   use emcon_materials, only : kinematics_linear
   use emcon_motion, only : motion_of, motion_t
   use emcon_numbering, only : add_to_dofs, pick_unknowns
   use emcon_scene, only : scene_t
   use emcon_scheme_energy_momentum, only : scheme_energy_momentum_t
   use emcon_small_widen_space, only : small_widen
   use emcon_solid, only : solid_geometry, solid_init, solid_t
   use emcon_stress, only : element_energies, element_means, nodal_stress, von_mises
   use emcon_system, only : system_begin_step, system_init, system_respond, system_t, &
      system_tangent_times
   use emcon_term, only : role_internal
   use emcon_text, only : to_text
   use kind_rows, only : law_code
   use random_draws, only : draw_random
   use small_scenes, only : add_step, prescribe, scene_begin, shake, young
   implicit none
   private
   public :: collect_single_elements

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> Sums over up to 8 points and nodes of some elements, each term of some dozen roundings.
   real(wp), parameter :: tol = 1024.0_wp*eps
   real(wp), parameter :: density = 3.0_wp
   integer, parameter :: n_element = 5, most_nodes = 10
   character(len=6), parameter :: name(n_element) = [character(len=6) :: "C3D8", "C3D8H", "C3D8I", &
      "C3D4", "C3D10"]
   !> Where each begins: they have sides in common.
   real(wp), parameter :: low(3, n_element) = reshape([0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
      0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, 0.0_wp, 1.0_wp], &
      [3, n_element])

contains

   subroutine collect_single_elements(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("forces and energies are the sums over the elements", test_sums), &
         test_case_t("blocks that threads share", test_threads), &
         test_case_t("tangent: differences, and products", test_tangent), &
         test_case_t("far from where it began", test_far), &
         test_case_t("small strains: those of KINEMATICS=LINEAR", test_linear), &
         test_case_t("stress and strain of a uniform field", test_stress), &
         test_case_t("the largest of small rotations and strains", test_widen), &
         test_case_t("kinetic energies of elements", test_energies), &
         test_case_t("von Mises stress", test_von_mises), &
         test_case_t("the fastest element", test_fastest)]
   end subroutine collect_single_elements

   !> The elements `which`, each of its own kind; nodes at the same place are one. In the first step
   !> three nodes are held.
   subroutine make_scene(which, scene)
      integer, intent(in) :: which(:)
      type(scene_t), intent(out) :: scene
      real(wp), allocatable :: place(:, :), x(:, :)
      integer :: a, e, i, k, kind, n

      call scene_begin(scene)
      call element_kinds_create(3, scene%element%kinds)
      scene%n_dim = 3
      scene%material(1)%law = law_code("neo hooke")
      scene%material(1)%constant = [0.2_wp*young, 1.0_wp/young]
      scene%material(1)%density = density
      allocate(x(3, most_nodes*n_element))
      deallocate(scene%element%node, scene%x, scene%u0, scene%v0, scene%node%origin, &
         scene%element%origin)
      allocate(scene%element%node(most_nodes, size(which)), source=0)
      n = 0
      do e = 1, size(which)
         kind = find_element_kind(scene%element%kinds, name(which(e)))
         call scene%element%kinds(kind)%shape%places(place)
         if (size(place, 2) == 8) place = 0.5_wp*(place + 1.0_wp)
         do i = 1, size(place, 2)
            place(:, i) = place(:, i) + low(:, which(e))
            do k = 1, n
               if (all(abs(x(:, k) - place(:, i)) < 0.1_wp)) exit
            end do
            if (k > n) n = k
            x(:, k) = place(:, i)
            scene%element%node(i, e) = k
         end do
         scene%element%kind = [scene%element%kind, kind]
      end do
      scene%x = x(:, :n)
      scene%u0 = 0.0_wp*scene%x
      scene%v0 = 0.0_wp*scene%x
      scene%node%label = [(i, i = 1, n)]
      scene%element%label = which
      scene%element%section = 0*which + 1
      allocate(scene%node%origin(n), scene%element%origin(size(which)))
      call add_step(scene, .false., 0.25_wp, 4)
      do i = 1, 3
         do a = 1, 3
            call prescribe(scene%step(1), i, a, 0.0_wp)
         end do
      end do
   end subroutine make_scene

   subroutine make_system(which, is_nonlinear, scene, system, error)
      integer, intent(in) :: which(:)
      logical, intent(in) :: is_nonlinear
      type(scene_t), intent(out) :: scene
      type(system_t), intent(out) :: system
      type(error_t), allocatable, intent(out) :: error

      call make_scene(which, scene)
      scene%step(1)%nlgeom = is_nonlinear
      call system_init(system, scene, error)
      if (.not. allocated(error)) call system_begin_step(system, scene, 1, error)
   end subroutine make_system

   !> Each element by itself, in the same motion.
   subroutine test_sums(error)
      type(error_t), allocatable, intent(out) :: error
      type(scheme_energy_momentum_t) :: scheme
      type(evaluation_t) :: evaluation
      type(scene_t) :: scene, single
      type(system_t) :: system, alone
      real(wp), allocatable :: u0(:, :), du(:, :), force(:, :)
      integer :: e, n

      call make_system([1, 2, 3, 4, 5], .true., scene, system, error)
      if (allocated(error)) return
      evaluation = scheme%evaluation(instant_t(), 0.25_wp)
      allocate(u0, du, force, source=0.0_wp*scene%x)
      call shake(u0, 0.05_wp)
      call shake(du, 0.05_wp)
      call system_respond(system, motion_of(evaluation, scene%x, u0, du), .false.)
      do e = 1, n_element
         call make_system([e], .true., single, alone, error)
         if (allocated(error)) return
         n = size(single%x, 2)
         associate (node => scene%element%node(:n, e))
            call system_respond(alone, motion_of(evaluation, single%x, u0(:, node), du(:, node)), &
               .false.)
            force(:, node) = force(:, node) + alone%response%part(role_internal)%force
         end associate
         call check_near(error, system%response%energy(e), alone%response%energy(1), tol, young, &
            name(e) // ": energy")
         call check_true(error, alone%response%energy(1) > 1.0e-3_wp*young, name(e) // ": strained")
         if (allocated(error)) return
      end do
      call check_near(error, system%response%part(role_internal)%force, force, tol, young, "forces")
   end subroutine test_sums

   !> Without NLGEOM the same, and nothing is taken from what other nodes move by: where one moves
   !> alone the sizes of what forces consist of are those of the forces, but at itself.
   subroutine test_linear(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: moved = 4
      type(scheme_energy_momentum_t) :: scheme
      type(scene_t) :: scene
      type(system_t) :: one, other
      type(motion_t) :: motion
      real(wp), allocatable :: u0(:, :), du(:, :)
      integer :: i, k

      call make_scene([1, 2, 3, 4, 5], scene)
      scene%material(1)%law = law_code("linear")
      scene%material(1)%constant = [young, 0.3_wp]
      scene%step(1)%nlgeom = .false.
      call system_init(one, scene, error)
      if (.not. allocated(error)) call system_begin_step(one, scene, 1, error)
      if (allocated(error)) return
      scene%step(1)%nlgeom = .true.
      scene%section(1)%kinematics = kinematics_linear
      call system_init(other, scene, error)
      if (.not. allocated(error)) call system_begin_step(other, scene, 1, error)
      if (allocated(error)) return
      allocate(u0, du, source=0.0_wp*scene%x)
      do k = 1, 2
         u0 = 0.0_wp
         du = 0.0_wp
         if (k == 1) then
            call shake(u0, 0.05_wp)
            call shake(du, 0.05_wp)
         else
            du(:, moved) = [0.01_wp, 0.02_wp, -0.03_wp]
         end if
         motion = motion_of(scheme%evaluation(instant_t(), 0.25_wp), scene%x, u0, du)
         one%response%with_sizes = .true.
         other%response%with_sizes = .true.
         call system_respond(one, motion, .false.)
         call system_respond(other, motion, .false.)
         associate (expected => one%response, found => other%response)
            call check_near(error, found%part(role_internal)%force, &
               expected%part(role_internal)%force, tol, young, "forces")
            call check_true(error, all(found%part(role_internal)%magnitude >= &
               abs(found%part(role_internal)%force)*(1.0_wp - tol)), "sizes")
         end associate
      end do
      associate (part => other%response%part(role_internal))
         do i = 1, size(scene%x, 2)
            if (i /= moved) call check_near(error, part%magnitude(:, i), abs(part%force(:, i)), &
               tol, young, "size at node " // to_text(i))
         end do
      end associate
   end subroutine test_linear

   !> Along one way of all unknowns; errors of a difference as in test_system.
   subroutine test_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      type(scheme_energy_momentum_t) :: scheme
      type(evaluation_t) :: evaluation
      type(scene_t) :: scene
      type(system_t) :: system
      type(motion_t) :: motion
      real(wp), allocatable :: u0(:, :), du(:, :), way(:, :), product(:, :)
      real(wp), allocatable, dimension(:) :: q, y, z, up, down
      real(wp) :: step
      integer :: k

      step = epsilon(1.0_wp)**(1.0_wp/3.0_wp)
      do k = 1, 2
         call make_system([1, 2, 3, 4, 5], k == 1, scene, system, error)
         if (allocated(error)) return
         evaluation = scheme%evaluation(instant_t(), 0.25_wp)
         u0 = 0.0_wp*scene%x
         du = u0
         way = u0
         product = u0
         call shake(u0, 0.05_wp)
         call shake(du, 0.05_wp)
         associate (numbering => system%space%numbering)
            q = spread(0.0_wp, 1, numbering%n_unknown)
            call draw_random(q)
            y = q
            z = q
            up = q
            down = q
            call add_to_dofs(numbering, q, 1.0_wp, way)
            motion = motion_of(evaluation, scene%x, u0, du)
            call system_respond(system, motion, .true.)
            call csr_multiply(system%matrix, q, y)
            call system_tangent_times(system, motion, way, product)
            call pick_unknowns(numbering, product, z)
            call check_near(error, z, y, tol, 10.0_wp*young, "product")
            call system_respond(system, motion_of(evaluation, scene%x, u0, du + step*way), .false.)
            call pick_unknowns(numbering, system%response%residual, up)
            call system_respond(system, motion_of(evaluation, scene%x, u0, du - step*way), .false.)
            call pick_unknowns(numbering, system%response%residual, down)
            call check_near(error, y, (up - down)/(2.0_wp*step), 3000.0_wp*step**2, young, &
               "differences")
         end associate
         if (allocated(error)) return
      end do
   end subroutine test_tangent

   !> A way that takes half of the digits of displacements, on it or done in the step: what is
   !> between nodes keeps the other half, and forces are the same.
   subroutine test_far(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: way = 2.0_wp**nint(0.5_wp*digits(1.0_wp)), least = 16.0_wp/way
      type(scheme_energy_momentum_t) :: scheme
      type(evaluation_t) :: evaluation
      type(scene_t) :: scene
      type(system_t) :: system
      real(wp), allocatable :: u0(:, :), du(:, :), force(:, :), energy(:)
      real(dp), allocatable :: value(:)
      integer :: k

      call make_system([1, 2, 3, 4, 5], .true., scene, system, error)
      if (allocated(error)) return
      evaluation = scheme%evaluation(instant_t(), 0.25_wp)
      allocate(u0, du, force, source=0.0_wp*scene%x)
      call shake(u0, 0.05_wp)
      call shake(du, 0.05_wp)
      u0 = least*anint(u0/least)
      du = least*anint(du/least)
      do k = 0, 2
         if (k == 1) u0 = u0 + way
         if (k == 2) du = du + way
         call system_respond(system, motion_of(evaluation, scene%x, u0, du), .true.)
         associate (part => system%response%part(role_internal))
            if (k == 0) then
               force = part%force
               energy = system%response%energy
               value = system%matrix%value
            end if
            call check_near(error, part%force, force, tol, young, "forces")
            call check_near(error, system%response%energy, energy, tol, young, "energies")
         end associate
         call check_near(error, real(system%matrix%value, wp), real(value, wp), tol, &
            10.0_wp*maxval(real(abs(value), wp)), "tangent")
      end do
   end subroutine test_far

   !> Everywhere E of the gradient and F S F^T/J, without NLGEOM their linear parts.
   subroutine test_stress(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: grad(3, 3) = reshape([0.1_wp, -0.2_wp, 0.05_wp, 0.3_wp, 0.15_wp, &
         0.1_wp, -0.1_wp, 0.05_wp, -0.08_wp], [3, 3])
      real(wp), parameter :: volume(n_element) = [1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp/6.0_wp, &
         1.0_wp/6.0_wp]
      integer, parameter :: row(6) = [1, 2, 3, 1, 2, 1], column(6) = [1, 2, 3, 2, 3, 3]
      type(scene_t) :: scene
      type(solid_t) :: solid
      type(space_response_t) :: state
      real(wp), dimension(6, n_element) :: stress, strain
      real(wp) :: found(n_element), f(3, 3), c(3, 3), s(3, 3), voigt(6), cauchy(6)
      real(wp), allocatable :: at_node(:, :)
      real(wp) :: square
      integer :: e, i, k

      call make_scene([1, 2, 3, 4, 5], scene)
      call solid_init(solid, scene, error)
      if (allocated(error)) return
      allocate(at_node(6, size(scene%x, 2)))
      do k = 1, 2
         square = real(2 - k, wp)
         c = grad + transpose(grad) + square*matmul(transpose(grad), grad)
         f = square*grad
         do i = 1, 3
            f(i, i) = 1.0_wp + f(i, i)
         end do
         voigt = [(c(row(i), column(i))*merge(0.5_wp, 1.0_wp, i <= 3), i = 1, 6)]
         call law_response_space(solid%law(1)%law, voigt, 0.0_wp*voigt, state)
         s = reshape([state%stress([1, 4, 6]), state%stress([4, 2, 5]), state%stress([6, 5, 3])], &
            [3, 3])
         s = matmul(f, matmul(s, transpose(f)))/(dot_product(f(:, 1), [f(2, 2)*f(3, 3) - f(3, 2) &
            *f(2, 3), f(3, 2)*f(1, 3) - f(1, 2)*f(3, 3), f(1, 2)*f(2, 3) - f(2, 2)*f(1, 3)]))
         cauchy = [(s(row(i), column(i)), i = 1, 6)]
         call element_means(solid, matmul(grad, scene%x), square, stress, strain, found)
         call nodal_stress(solid, matmul(grad, scene%x), square, at_node)
         call check_near(error, found, volume, tol, 1.0_wp, "volume")
         do e = 1, n_element
            call check_near(error, strain(:, e), voigt, tol, 1.0_wp, name(e) // ": strain")
            call check_near(error, stress(:, e), cauchy, tol, young, name(e) // ": stress")
         end do
         do i = 1, size(at_node, 2)
            call check_near(error, at_node(:, i), cauchy, tol, young, "stress at node " &
               // to_text(i))
         end do
         if (allocated(error)) return
      end do
   end subroutine test_stress

   !> A turn by 0.02 and a pull by 0.03, whose squares stay where another motion is smaller.
   subroutine test_widen(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: grad(3, 3) = reshape([0.03_wp, 0.02_wp, 0.0_wp, -0.02_wp, 0.0_wp, &
         0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], [3, 3])
      type(scene_t) :: scene
      type(solid_t) :: solid
      type(element_geometry_t) :: geometry
      real(wp) :: rotation, strain
      integer :: k

      call make_scene([4], scene)
      call solid_init(solid, scene, error)
      if (allocated(error)) return
      rotation = 0.0_wp
      strain = 0.0_wp
      call solid_geometry(solid, 1, geometry)
      do k = 1, 2
         call small_widen(geometry, matmul(grad, scene%x)/real(k, wp), rotation, strain)
         call check_near(error, [rotation, strain], [0.02_wp**2, 0.03_wp**2], tol, 0.001_wp, &
            "squares")
      end do
   end subroutine test_widen

   !> A translation of half of each mass, and nothing of rigid elements.
   subroutine test_energies(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(solid_t) :: solid
      real(wp), allocatable :: v(:, :)
      real(wp) :: energy(n_element)

      call make_scene([1, 2, 3, 4, 5], scene)
      call solid_init(solid, scene, error)
      if (allocated(error)) return
      v = spread([2.0_wp, -1.0_wp, 2.0_wp], 2, size(scene%x, 2))
      call element_energies(solid, v, energy)
      call check_near(error, energy, 4.5_wp*density*[1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp/6.0_wp, &
         1.0_wp/6.0_wp], tol, 10.0_wp*density, "half of m v^2")
   end subroutine test_energies

   !> Of a pull, of a shear of each kind, and of no pressure.
   subroutine test_von_mises(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: s(6)
      integer :: i

      do i = 1, 6
         s = 0.25_wp
         s(4:) = 0.0_wp
         s(i) = s(i) - 2.0_wp
         call check_near(error, von_mises(s), 2.0_wp*merge(1.0_wp, sqrt(3.0_wp), i <= 3), tol, &
            1.0_wp, "component " // to_text(i))
      end do
      call check_near(error, von_mises([-1.0_wp, 2.0_wp, 4.0_wp, 1.0_wp, -2.0_wp, 3.0_wp]), &
         sqrt(0.5_wp*(9.0_wp + 4.0_wp + 25.0_wp) + 3.0_wp*14.0_wp), tol, 1.0_wp, "all")
   end subroutine test_von_mises

   !> The critical step of the whole is bounded by the least of those of single elements.
   subroutine test_fastest(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(system_t) :: system
      real(wp), allocatable :: none(:)
      real(wp) :: h(0:n_element)
      integer :: e, element(0:n_element)
      logical :: is_bounded

      do e = 0, n_element
         if (e == 0) call make_system([2, 4, 1, 3], .true., scene, system, error)
         if (e > 0) call make_system([e], .true., scene, system, error)
         if (allocated(error)) return
         none = 0.0_wp*scene%x(1, :)
         call critical_bound(system, motion_of(evaluation_at_end, scene%x, 0.0_wp*scene%x, &
            0.0_wp*scene%x), none, h(e), element(e), is_bounded)
         call check_true(error, is_bounded, "elements alone")
         if (allocated(error)) return
      end do
      call check_near(error, h(0), minval(h(1:4)), tol, h(0), "the least")
      associate (which => [2, 4, 1, 3])
         call check_equal(error, which(element(0)), minloc(h(1:4), 1), "the fastest")
      end associate
      call check_turned(error)
   end subroutine test_fastest

   !> More elements than a block of threads has: the same bits.
   subroutine test_threads(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: many = 1100
      type(scene_t) :: scene
      type(system_t) :: system
      type(motion_t) :: motion
      real(wp), allocatable :: u(:, :), force(:, :), energy(:)
      integer :: i, k

      call make_system([(1 + mod(i, n_element), i = 1, many)], .true., scene, system, error)
      if (allocated(error)) return
      u = scene%x
      call shake(u, 0.05_wp)
      motion = motion_of(evaluation_at_end, scene%x, 0.0_wp*u, u)
      do k = 1, 3
         system%response%n_thread = k
         call system_respond(system, motion, .false.)
         associate (response => system%response)
            call check_true(error, .not. allocated(response%refusal), "there are forces")
            if (k == 1) then
               force = response%part(role_internal)%force
               energy = response%energy
            end if
            call check_near(error, response%part(role_internal)%force, force, 0.0_wp, 1.0_wp, &
               to_text(k) // " threads")
            call check_near(error, response%energy, energy, 0.0_wp, 1.0_wp, "energies")
         end associate
      end do
      call check_true(error, all(energy > 0.0_wp), "of all elements")
   end subroutine test_threads

   !> A cube that is turned about z is as fast as at rest, but not where small strains take the turn
   !> for a strain.
   subroutine check_turned(error)
      type(error_t), allocatable, intent(inout) :: error
      type(scene_t) :: scene
      type(system_t) :: system
      real(wp), allocatable :: none(:), u(:, :)
      real(wp) :: h(2, 2)
      integer :: i, k, e
      logical :: is_bounded

      do i = 1, 2
         call make_system([1], i == 1, scene, system, error)
         if (allocated(error)) return
         none = 0.0_wp*scene%x(1, :)
         do k = 1, 2
            u = 0.0_wp*scene%x
            if (k == 2) u(1, :) = -0.2_wp*scene%x(1, :) - 0.6_wp*scene%x(2, :)
            if (k == 2) u(2, :) = 0.6_wp*scene%x(1, :) - 0.2_wp*scene%x(2, :)
            call critical_bound(system, motion_of(evaluation_at_end, scene%x, u, 0.0_wp*u), none, &
               h(k, i), e, is_bounded)
         end do
      end do
      call check_near(error, h(:, 1), spread(h(1, 2), 1, 2), tol, h(1, 2), "turned as at rest")
      call check_true(error, abs(h(2, 2) - h(1, 2)) > 0.01_wp*h(1, 2), "a strain")
   end subroutine check_turned

end module test_single_elements
