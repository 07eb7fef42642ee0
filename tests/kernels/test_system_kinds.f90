!> The matrix of the system against differences of its forces, for sections of every kinematics,
!> with dependent freedoms, damping, follower loads and mean dilatation.
module test_system_kinds
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_csr, only : csr_multiply
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_at_end, evaluation_t, instant_t
   use emcon_kinds, only : dp, wp
   use emcon_materials, only : kinematics_corotated, kinematics_linear, kinematics_nonlinear
   use emcon_motion, only : motion_of, motion_t
   use emcon_numbering, only : add_to_dofs, pick_unknowns, spread_dependent
   use emcon_scene, only : scene_t
   use emcon_scheme_energy_momentum, only : scheme_energy_momentum_t
   use emcon_scheme_static, only : scheme_static_t
   use emcon_steps, only : load_pressure, load_t
   use emcon_system, only : system_begin_step, system_init, system_renew, system_respond, &
      system_t, system_tangent_times
   use emcon_term, only : role_internal
   use emcon_text, only : to_text
   use kind_rows, only : law_code
   use linear_scenes, only : add_equation, add_tie_by_hand
   use random_draws, only : draw_random
   use small_scenes, only : add_block, add_load, add_step, block_t, clamp, make_block, shake, young
   implicit none
   private
   public :: collect_system_kinds

contains

   subroutine collect_system_kinds(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("tangents of all kinds of sections", test_kinds), &
         test_case_t("sections of all kinds side by side", test_mixed), &
         test_case_t("which matrices are symmetric", test_symmetric), &
         test_case_t("far from its place", test_far), &
         test_case_t("far bodies beside others", test_beside), &
         test_case_t("what has shrunk to a point has no frame", test_point)]
   end subroutine collect_system_kinds

   !> Two blocks of three cells, of quadrilaterals and of triangles; with links nodes of the second
   !> one hang on nodes of the first one by a tie, and one node on another by an equation.
   subroutine make_linked(scene, kind, has_links, is_static, beta)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: kind                !! of kinematics
      logical, intent(in) :: has_links, is_static
      real(wp), intent(in) :: beta
      type(block_t) :: block
      type(load_t) :: load

      call make_block(scene, "CPE4", [3, 1], block)
      call add_block(scene, "CPE3", [2, 1], [0.5_wp, 1.0_wp], [2.0_wp, 1.0_wp], block)
      scene%section(1)%kinematics = kind
      scene%material(1)%alpha = merge(0.0_wp, 3.0_wp, is_static)
      scene%material(1)%beta = beta
      call add_step(scene, is_static, 0.25_wp, 4)
      call clamp(scene%step(1), [1])
      load%kind = load_pressure
      load%target = 2
      load%place = 1
      load%value = 0.3_wp*young
      call add_load(scene%step(1), load)
      if (.not. has_links) return
      call add_tie_by_hand(scene, [9, 10, 11], reshape([5, 6, 6, 7, 7, 8], [2, 3]), &
         spread([0.5_wp, 0.5_wp], 2, 3), [0.5_wp, 1.0_wp, 0.5_wp])
      call add_equation(scene, [13, 12, 4], [1, 1, 2], [2.0_wp, -1.0_wp, 0.5_wp])
   end subroutine make_linked

   !> In statics, at large and at small strains, in dynamics with drag by mass, and with that by
   !> strains, whose derivative is complete where nothing moves.
   subroutine test_kinds(error)
      type(error_t), allocatable, intent(out) :: error
      type(scheme_energy_momentum_t) :: dynamic
      type(scheme_static_t) :: static
      type(scene_t) :: scene
      type(evaluation_t) :: evaluation
      integer :: kind, link, way

      do kind = kinematics_nonlinear, kinematics_corotated
         do link = 0, 1
            do way = 0, 3
               evaluation = dynamic%evaluation(instant_t(0.5_wp, 0.5_wp), 0.25_wp)
               if (way <= 1) evaluation = static%evaluation(instant_t(0.5_wp, 0.5_wp), 0.25_wp)
               call make_linked(scene, kind, link == 1, way <= 1, merge(0.02_wp, 0.0_wp, way == 3))
               scene%step(1)%nlgeom = way > 0
               call check_tangent(error, scene, evaluation, merge(0.0_wp, 0.1_wp, way == 3), &
                  "kinematics " // to_text(kind) // ", links " // to_text(link) // ", way " &
                  // to_text(way))
               if (allocated(error)) return
            end do
         end do
      end do
   end subroutine test_kinds

   !> Elements by turns of each kinematics, and of a material with damping or of one without.
   subroutine test_mixed(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: kinds(3) = [kinematics_nonlinear, kinematics_linear, &
         kinematics_corotated]
      type(scheme_energy_momentum_t) :: dynamic
      type(scheme_static_t) :: static
      type(scene_t) :: scene
      type(evaluation_t) :: evaluation
      integer :: turn, way, e

      do turn = 0, 2
         do way = 0, 2
            evaluation = dynamic%evaluation(instant_t(0.5_wp, 0.5_wp), 0.25_wp)
            if (way == 0) evaluation = static%evaluation(instant_t(0.5_wp, 0.5_wp), 0.25_wp)
            call make_linked(scene, kinematics_nonlinear, way < 2, way == 0, 0.0_wp)
            scene%section = scene%section(spread(1, 1, 3))
            scene%section%kinematics = kinds
            scene%material = scene%material([1, 1])
            scene%section(2)%material = 2
            if (way == 2) scene%material(2)%beta = 0.02_wp
            do e = 1, size(scene%element%section)
               scene%element%section(e) = 1 + mod(e + turn, 3)
            end do
            call check_tangent(error, scene, evaluation, merge(0.0_wp, 0.1_wp, way == 2), &
               "turn " // to_text(turn) // ", way " // to_text(way))
            if (allocated(error)) return
         end do
      end do
   end subroutine test_mixed

   !> Along random ways of all unknowns, against central differences of step eps^(1/3): error a
   !> multiple of eps^(2/3). Forces on dependent freedoms go to those that they hang on.
   subroutine check_tangent(error, scene, evaluation, motion_size, what)
      type(error_t), allocatable, intent(inout) :: error
      type(scene_t), intent(in) :: scene
      type(evaluation_t), intent(in) :: evaluation
      real(wp), intent(in) :: motion_size        !! [L]
      character(len=*), intent(in) :: what
      type(system_t) :: system
      type(scene_t) :: bare
      type(motion_t) :: motion
      real(wp), allocatable :: u0(:, :), v0(:, :), du(:, :), way(:, :), image(:, :)
      real(wp), allocatable :: x(:), up(:), down(:), product(:)
      real(wp), parameter :: rounding = real(epsilon(1.0_dp), wp)   ! of the matrix
      real(wp) :: step
      integer :: k, n

      call system_init(system, scene, error)
      if (.not. allocated(error)) call system_begin_step(system, scene, 1, error)
      if (allocated(error)) return
      n = system%space%numbering%n_unknown
      allocate(u0, v0, du, way, image, mold=scene%x)
      allocate(x(n), up(n), down(n), product(n))
      call shake(u0, 0.1_wp)
      call shake(v0, 1.0_wp)
      call shake(du, motion_size)
      if (any(system%space%linear%is_used)) then
         call spread_dependent(system%space%linked, u0)
         call spread_dependent(system%space%linked, v0)
         call spread_dependent(system%space%linked, du)
      end if
      step = epsilon(1.0_wp)**(1.0_wp/3.0_wp)
      do k = 1, 2
         call draw_random(x)
         x = x - 0.5_wp
         way = 0.0_wp
         call add_to_dofs(system%space%numbering, x, 1.0_wp, way)
         call system_respond(system, motion_of(evaluation, scene%x, u0, du, v0), .true.)
         call csr_multiply(system%matrix, x, product)
         call force(du + step*way, up)
         call force(du - step*way, down)
         call check_near(error, product, (up - down)/(2.0_wp*step), max(300.0_wp*step**2, &
            64.0_wp*rounding), 10.0_wp*young, what)
         call check_true(error, norm2(product) > 0.1_wp*young, "a stiffness")
      end do
      call check_sizes(error, system, what)
      ! What inertia is off by of the motion counts.
      motion = motion_of(evaluation, scene%x, u0, du)
      motion%offset = 0.5_wp*du
      call system_respond(system, motion, .true.)
      call check_sizes(error, system, what // ", offset")
      ! Products leave out what loads and damped materials have of the matrix.
      if (scene%material(1)%alpha > 0.0_wp) return
      bare = scene
      bare%step(1)%load = bare%step(1)%load(:0)
      call system_renew(system, bare)
      motion = motion_of(evaluation, scene%x, u0, du, v0)
      call system_respond(system, motion, .true.)
      call csr_multiply(system%matrix, x, product)
      call system_tangent_times(system, motion, way, image)
      call pick_unknowns(system%space%numbering, image, up)
      call check_near(error, up, product, 64.0_wp*max(epsilon(1.0_wp), rounding), 10.0_wp*young, &
         "product, " // what)

   contains

      subroutine force(du, on_unknowns)
         real(wp), intent(in) :: du(:, :)
         real(wp), intent(out) :: on_unknowns(:)

         call system_respond(system, motion_of(evaluation, scene%x, u0, du, v0), .false.)
         call pick_unknowns(system%space%numbering, system%response%residual, on_unknowns)
      end subroutine force

   end subroutine check_tangent

   !> Sizes of forces are sums of parts before these cancel: no less than the forces, and of the
   !> same order where displacements are of the size of strains.
   subroutine check_sizes(error, system, what)
      type(error_t), allocatable, intent(inout) :: error
      type(system_t), intent(in) :: system
      character(len=*), intent(in) :: what
      real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)
      integer :: k

      associate (response => system%response)
         do k = 1, size(response%part)
            associate (part => response%part(k))
               call check_true(error, all(part%magnitude >= abs(part%force)*(1.0_wp - tol)), &
                  "sizes of role " // to_text(k) // ", " // what)
               call check_true(error, sum(part%magnitude) <= 40.0_wp*sum(abs(part%force)), &
                  "of the same order, role " // to_text(k) // ", " // what)
            end associate
         end do
         call check_near(error, response%magnitude, response%part(1)%magnitude &
            + response%part(2)%magnitude + response%part(3)%magnitude, tol, 100.0_wp*young, &
            "all, " // what)
         call check_true(error, all(response%rounding >= 0.0_wp) .and. &
            sum(response%rounding) > 0.01_wp*young, "rounding of displacements, " // what)
      end associate
   end subroutine check_sizes

   !> Of quadratic energies and at the end of a step, unless a pressure follows. A block of one
   !> section, another one that is LINEAR or not; the laws and NLGEOM of both.
   subroutine test_symmetric(error)
      type(error_t), allocatable, intent(out) :: error
      type(scheme_energy_momentum_t) :: dynamic
      type(scene_t) :: scene
      type(system_t) :: system
      type(block_t) :: block
      type(load_t) :: load
      logical :: is_quadratic, nlgeom, follows, is_end
      integer :: case, kind
      real(wp), parameter :: u(2, 12) = 0.0_wp

      do case = 0, 31
         nlgeom = btest(case, 0)
         is_quadratic = btest(case, 1)
         follows = btest(case, 2)
         is_end = btest(case, 3)
         kind = merge(kinematics_linear, kinematics_nonlinear, btest(case, 4))
         call make_block(scene, "CPE4", [2, 1], block)
         call add_block(scene, "CPE4", [2, 1], [4.0_wp, 0.0_wp], [2.0_wp, 1.0_wp], block)
         scene%section = [scene%section, scene%section]
         scene%material = [scene%material, scene%material]
         scene%section%material = [1, 2]
         scene%element%section = [1, 1, 2, 2]
         scene%section(2)%kinematics = kind
         if (is_quadratic) then
            scene%material(1)%law = law_code("linear")
            scene%material(1)%constant = [young, 0.3_wp]
         end if
         call add_step(scene, .false., 0.25_wp, 4)
         scene%step(1)%nlgeom = nlgeom
         load%kind = load_pressure
         load%target = 1
         load%place = 1
         load%value = 1.0_wp
         if (follows) call add_load(scene%step(1), load)
         call system_init(system, scene, error)
         if (.not. allocated(error)) call system_begin_step(system, scene, 1, error)
         if (allocated(error)) return
         if (is_end) then
            call system_respond(system, motion_of(evaluation_at_end, scene%x, u, u), .true.)
         else
            call system_respond(system, motion_of(dynamic%evaluation(instant_t(), 0.25_wp), &
               scene%x, u, u), .true.)
         end if
         call check_true(error, system%is_symmetric .eqv. (.not. (follows .and. nlgeom) .and. &
            (is_end .or. (is_quadratic .and. .not. nlgeom .and. kind == kinematics_linear))), &
            "case " // to_text(case))
      end do
   end subroutine test_symmetric

   !> Far from its place a body has no forces but for what displacements are rounded by, and these
   !> are told, per unit of the rounding.
   subroutine test_far(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: way = 1.0_wp/sqrt(epsilon(1.0_wp))
      type(scheme_static_t) :: static
      type(scene_t) :: scene
      type(system_t) :: system
      type(evaluation_t) :: evaluation
      real(wp), allocatable :: u0(:, :), du(:, :)
      integer :: kind, link

      evaluation = static%evaluation(instant_t(0.5_wp, 0.5_wp), 0.25_wp)
      do kind = kinematics_nonlinear, kinematics_corotated
         do link = 0, 1
            call make_linked(scene, kind, .false., .true., 0.0_wp)
            call system_init(system, scene, error)
            if (.not. allocated(error)) call system_begin_step(system, scene, 1, error)
            if (allocated(error)) return
            allocate(u0, du, source=0.0_wp*scene%x)
            ! No number of few bits.
            u0(1, :) = way/3.0_wp
            if (link == 1) du(2, :) = way/7.0_wp
            call system_respond(system, motion_of(evaluation, scene%x, u0, du), .false.)
            associate (force => system%response%part(role_internal)%force, &
                  rounding => system%response%rounding)
               call check_true(error, all(abs(force) <= 4.0_wp*epsilon(1.0_wp)*rounding), &
                  "forces, kinematics " // to_text(kind))
               call check_true(error, all(rounding(:, :8) > 0.1_wp*young*way) .and. &
                  all(rounding < 100.0_wp*young*way), "rounding, kinematics " // to_text(kind))
            end associate
            deallocate(u0, du)
         end do
      end do
   end subroutine test_far

   !> Of two bodies one moves far: the rounding of the other is its own.
   subroutine test_beside(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: way = 1.0e4_wp
      type(scheme_static_t) :: static
      type(scene_t) :: scene
      type(system_t) :: system
      type(block_t) :: block
      real(wp) :: u(2, 12)
      integer :: kind, far, i

      do kind = kinematics_nonlinear, kinematics_corotated
         call make_block(scene, "CPE4", [2, 1], block)
         call add_block(scene, "CPE4", [2, 1], [4.0_wp, 0.0_wp], [2.0_wp, 1.0_wp], block)
         scene%section(1)%kinematics = kind
         call add_step(scene, .true., 0.25_wp, 4)
         call clamp(scene%step(1), [1, 7])
         call system_init(system, scene, error)
         if (.not. allocated(error)) call system_begin_step(system, scene, 1, error)
         if (allocated(error)) return
         call shake(u, 0.05_wp)
         do far = 0, 1
            u(:, 6*far + 1:6*far + 6) = u(:, 6*far + 1:6*far + 6) + way
            call system_respond(system, motion_of(static%evaluation(instant_t(0.5_wp, 0.5_wp), &
               0.25_wp), scene%x, u, 0.0_wp*u), .false.)
            u(:, 6*far + 1:6*far + 6) = u(:, 6*far + 1:6*far + 6) - way
            do i = 0, 1
               associate (rounding => system%response%rounding(:, 6*i + 1:6*i + 6))
                  call check_true(error, all(rounding > 0.1_wp*young*way .eqv. i == far), &
                     "kinematics " // to_text(kind) // ", body " // to_text(i + 1))
               end associate
            end do
         end do
      end do
   end subroutine test_beside

   !> The third of three elements, of which the second and third have frames.
   subroutine test_point(error)
      type(error_t), allocatable, intent(out) :: error
      type(scheme_static_t) :: static
      type(scene_t) :: scene
      type(system_t) :: system
      type(block_t) :: block
      type(evaluation_t) :: evaluation
      real(wp) :: u(2, 8)
      integer :: i

      call make_block(scene, "CPE4", [3, 1], block)
      scene%element%label = [5, 77, 88]
      scene%section = [scene%section, scene%section]
      scene%section(2)%kinematics = kinematics_corotated
      scene%element%section = [1, 2, 2]
      call add_step(scene, .true., 0.25_wp, 4)
      call clamp(scene%step(1), [1])
      call system_init(system, scene, error)
      if (.not. allocated(error)) call system_begin_step(system, scene, 1, error)
      if (allocated(error)) return
      evaluation = static%evaluation(instant_t(0.5_wp, 0.5_wp), 0.25_wp)
      u = 0.0_wp
      do i = 1, size(u, 2)
         if (any(i == [3, 4, 7, 8])) u(:, i) = [2.5_wp, 0.5_wp] - scene%x(:, i)
      end do
      call system_respond(system, motion_of(evaluation, scene%x, 0.0_wp*u, u), .false.)
      call check_true(error, allocated(system%response%refusal), "refused")
      if (.not. allocated(error)) call check_equal(error, system%response%refusal, &
         "element 88 is inverted", "which")
   end subroutine test_point

end module test_system_kinds
