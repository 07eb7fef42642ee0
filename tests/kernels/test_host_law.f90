!> Materials whose strain energy a program gives, against laws of ours that are the same.
module test_host_law
   use, intrinsic :: ieee_arithmetic, only : ieee_is_nan
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_deck_source, only : deck_source_t
   use emcon_dgrad_series, only : log1p_excess, log1p_of
   use emcon_diagnostics, only : diagnostics_t
   use emcon_element_kind, only : find_element_kind
   use emcon_errors, only : err_analysis, err_input, error_t
   use emcon_host, only : host_add_law, host_t
   use emcon_kinds, only : dp, wp
   use emcon_law, only : lame_constants
   use emcon_law_linear, only : law_linear_t
   use emcon_law_registry, only : law_user, law_linear
   use emcon_march, only : increment_t
   use emcon_motion, only : motion_of, motion_t
   use emcon_point_function, only : point_failed, point_function_t, point_ok, point_outside
   use emcon_evaluation, only : evaluation_at_end, evaluation_t
   use emcon_restart_data, only : restart_t
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_t
   use emcon_term, only : fastest_t, response_init, response_t, role_internal
   use emcon_term_registry, only : terms_mass_rows, terms_solid
   use emcon_stepper, only : stepper_advance, stepper_build, stepper_close, stepper_read_source, &
      stepper_t
   use emcon_stepper_file, only : stepper_load, stepper_save
   use emcon_stepper_user, only : stepper_give_law
   use emcon_stepper_query, only : query_evaluate, query_free, query_t
   use emcon_stress, only : element_means, nodal_stress
   use emcon_text, only : string_t, to_text
   use kind_rows, only : law_code
   use one_element, only : law_given, read_one
   use small_scenes, only : add_block, add_step, block_t, clamp, make_block, make_two_blocks, &
      poisson, prescribe, shake, young
   implicit none
   private
   public :: collect_host_law

   !> The solvers compute in double precision, whatever the state is.
   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))

   !> St. Venant-Kirchhoff or coupled neo-Hooke, which can be told to fail.
   type, extends(point_function_t) :: elastic_t
      integer :: law = law_linear
      real(wp) :: lam = 0.0_wp, mu = 0.0_wp
      real(wp) :: limit = huge(1.0_wp)           !! of strains; beyond it there is only
      integer :: beyond = point_ok
   contains
      procedure :: evaluate => elastic_evaluate
   end type elastic_t

contains

   pure integer function coupled_neo_hooke() result(code)
      code = law_code("coupled neo hooke")
   end function coupled_neo_hooke

   subroutine collect_host_law(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("forces and tangents of our own laws", test_forces), &
         test_case_t("and of small strains", test_small), &
         test_case_t("tangent against differences", test_tangent), &
         test_case_t("far from where it began", test_far), &
         test_case_t("two blocks meet, one of a given law", test_drop), &
         test_case_t("second order to our own law, energy to round-off", test_spin), &
         test_case_t("static stretch, and stress", test_static), &
         test_case_t("stress beside another material, and where there is none", test_mixed), &
         test_case_t("a query has the given law too", test_query), &
         test_case_t("outside: the step is cut", test_outside), &
         test_case_t("failed: an error, the state stands", test_failed), &
         test_case_t("bad laws at rest", test_bad_rest), &
         test_case_t("a type of law that takes the constants of the deck", test_taken), &
         test_case_t("where the stress normal to the plane is asked for", test_normal), &
         test_case_t("where modes ask for moduli", test_modes), &
         test_case_t("laws are kept as others come", test_kept), &
         test_case_t("wrong order of calls, wrong names", test_bad_calls), &
         test_case_t("restart file of a deck with a given law", test_restart)]
   end subroutine collect_host_law

   !> With y = det C - 1 and phi(y) = y - ln(1 + y), as in emcon_coupled_neo_hooke().
   subroutine elastic_evaluate(self, z, wants_hessian, value, gradient, hessian, status)
      class(elastic_t), intent(in) :: self
      real(wp), intent(in), contiguous :: z(:, :)
      logical, intent(in) :: wants_hessian
      real(wp), intent(inout), contiguous :: value(:)
      real(wp), intent(inout), contiguous :: gradient(:, :)
      real(wp), intent(inout), contiguous :: hessian(:, :, :)
      integer, intent(out) :: status
      real(wp), parameter :: de1(3) = [1.0_wp, 1.0_wp, 0.0_wp]
      real(wp) :: e1, e2, de2(3), dde2(3, 3), y, dy(3), w_y, w_yy
      integer :: i, j

      status = point_ok
      if (any(abs(z) > self%limit)) status = self%beyond
      if (status /= point_ok) return
      dde2 = 0.0_wp
      dde2(1, 2) = 1.0_wp
      dde2(2, 1) = 1.0_wp
      dde2(3, 3) = -0.5_wp
      do i = 1, size(z, 2)
         e1 = z(1, i) + z(2, i)
         e2 = z(1, i)*z(2, i) - 0.25_wp*z(3, i)**2
         de2 = [z(2, i), z(1, i), -0.5_wp*z(3, i)]
         y = e1
         dy = de1
         w_y = (self%lam + 2.0_wp*self%mu)*e1
         w_yy = self%lam + 2.0_wp*self%mu
         value(i) = 0.5_wp*w_y*e1 - 2.0_wp*self%mu*e2
         if (self%law == coupled_neo_hooke()) then
            y = 2.0_wp*e1 + 4.0_wp*e2
            if (.not. y > -1.0_wp) status = point_outside
            if (status /= point_ok) return
            dy = 2.0_wp*de1 + 4.0_wp*de2
            w_y = (0.5_wp*self%mu*y + 0.25_wp*self%lam*log1p_of(y))/(1.0_wp + y)
            w_yy = (0.5_wp*self%mu + 0.25_wp*self%lam*(1.0_wp - log1p_of(y)))/(1.0_wp + y)**2
            value(i) = 0.5_wp*self%mu*log1p_excess(y) - 2.0_wp*self%mu*e2 &
               + 0.125_wp*self%lam*log1p_of(y)**2
         end if
         gradient(:, i) = w_y*dy - 2.0_wp*self%mu*de2
         if (.not. wants_hessian) cycle
         do j = 1, 3
            hessian(:, j, i) = w_yy*dy(j)*dy - 2.0_wp*self%mu*dde2(:, j)
            if (self%law == coupled_neo_hooke()) hessian(:, j, i) = hessian(:, j, i) &
               + 4.0_wp*w_y*dde2(:, j)
         end do
      end do
   end subroutine elastic_evaluate

   pure function elastic_of(law) result(elastic)
      integer, intent(in) :: law
      type(elastic_t) :: elastic

      elastic%n_variable = 3
      elastic%law = law
      call lame_constants(young, poisson, elastic%lam, elastic%mu)
   end function elastic_of

   !> Build the model of `scene`: with `elastic` its first material is given so, else of that law.
   subroutine open_with(stepper, scene, law, is_given, error)
      type(stepper_t), intent(inout) :: stepper
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: law
      logical, intent(in) :: is_given
      type(error_t), allocatable, intent(out) :: error

      stepper%scene = scene
      stepper%scene%material(1)%law = merge(law_user, law, is_given)
      stepper%is_read = .true.
      if (is_given) call stepper_give_law(stepper, "Rubber", elastic_of(law), error)
      if (.not. allocated(error)) call stepper_build(stepper, error)
   end subroutine open_with

   !> Two steppers of the same scene, the first with the given law.
   subroutine open_both(given, own, scene, law, error)
      type(stepper_t), intent(inout) :: given, own
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: law
      type(error_t), allocatable, intent(out) :: error

      call open_with(given, scene, law, .true., error)
      if (.not. allocated(error)) call open_with(own, scene, law, .false., error)
   end subroutine open_both

   !> What the elements of a stepper respond, alone.
   subroutine solid_answers(stepper, motion, response)
      type(stepper_t), intent(inout), target :: stepper
      type(motion_t), intent(in) :: motion
      type(response_t), intent(out) :: response
      integer :: k

      associate (system => stepper%march%system, scene => stepper%scene)
         call response_init(response, 2, size(scene%x, 2), size(scene%element%kind))
         do k = 1, size(system%term)
            if (system%term(k)%term%role == role_internal) call system%term(k)%term%respond( &
               motion, response)
         end do
      end associate
   end subroutine solid_answers

   !> Without NLGEOM strains are linear in displacements, however large these are.
   subroutine test_small(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: given, own
      type(scene_t) :: scene
      type(block_t) :: block
      type(response_t) :: one, two
      type(motion_t) :: motion
      real(wp) :: u(2, 6), du(2, 6)

      call make_block(scene, "CPE4", [2, 1], block)
      call add_step(scene, .false., 0.1_wp, 1)
      scene%step(1)%nlgeom = .false.
      call open_both(given, own, scene, law_linear, error)
      if (allocated(error)) return
      call shake(u, 0.25_wp)
      call shake(du, 0.25_wp)
      motion = motion_of(evaluation_t(), scene%x, u, du)
      call solid_answers(given, motion, one)
      call solid_answers(own, motion, two)
      associate (force => one%part(role_internal)%force, expected => two%part(role_internal)%force)
         call check_near(error, force, expected, 64.0_wp*eps, young, "forces")
         call check_near(error, sum(one%energy), sum(two%energy), 64.0_wp*eps, young, "energy")
      end associate
      call stepper_close(given)
      call stepper_close(own)
   end subroutine test_small

   !> Their tangent times `way`.
   subroutine solid_times(stepper, motion, way, product)
      type(stepper_t), intent(inout) :: stepper
      type(motion_t), intent(in) :: motion
      real(wp), intent(in), contiguous :: way(:, :)
      real(wp), intent(out), contiguous :: product(:, :)
      integer :: k

      product = 0.0_wp
      associate (term => stepper%march%system%term)
         do k = 1, size(term)
            if (term(k)%term%role == role_internal) call term(k)%term%tangent_times(motion, way, &
               product)
         end do
      end associate
   end subroutine solid_times

   !> The fastest of them.
   type(fastest_t) function fastest_of(stepper, motion) result(fastest)
      type(stepper_t), intent(inout) :: stepper
      type(motion_t), intent(in) :: motion
      logical :: is_bounded
      integer :: k

      fastest = fastest_t()
      associate (term => stepper%march%system%term)
         do k = 1, size(term)
            if (term(k)%term%role == role_internal) call term(k)%term%find_fastest(motion, &
               fastest, is_bounded)
         end do
      end associate
   end function fastest_of

   !> Of a quadratic energy the discrete gradients are the same, of the other the gradients are.
   subroutine test_forces(error)
      type(error_t), allocatable, intent(out) :: error

      call compare_forces("CPE3", law_linear, error)
      if (.not. allocated(error)) call compare_forces("CPE4", law_linear, error)
      if (.not. allocated(error)) call compare_forces("CPE3", coupled_neo_hooke(), error)
      if (.not. allocated(error)) call compare_forces("CPE4", coupled_neo_hooke(), error)
   end subroutine test_forces

   subroutine compare_forces(name, law, error)
      character(len=*), intent(in) :: name
      integer, intent(in) :: law
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(stepper_t) :: given, own
      type(response_t) :: one, other
      type(fastest_t) :: fast(2)
      real(wp) :: u0(2, 16), du(2, 16), way(2, 16), product(2, 16), expected(2, 16)

      call make_block(scene, name, [3, 3], block)
      call add_step(scene, .true., 1.0_wp, 1)
      call clamp(scene%step(1), [1, 2])
      call open_both(given, own, scene, law, error)
      if (allocated(error)) return
      call shake(u0, 0.1_wp)
      call shake(du, 0.1_wp)
      call shake(way, 1.0_wp)
      if (law /= law_linear) du = 0.0_wp
      call solid_answers(given, motion_of(evaluation_t(), scene%x, u0, du), one)
      call solid_answers(own, motion_of(evaluation_t(), scene%x, u0, du), other)
      call check_near(error, one%part(role_internal)%force, other%part(role_internal)%force, &
         64.0_wp*eps, young, "force")
      call check_near(error, one%energy, other%energy, 64.0_wp*eps, young, "energy")
      call check_near(error, one%rounding, other%rounding, 16.0_wp*eps, young, "rounding")
      call solid_times(given, motion_of(evaluation_t(), scene%x, u0, du), way, product)
      call solid_times(own, motion_of(evaluation_t(), scene%x, u0, du), way, expected)
      call check_near(error, product, expected, 256.0_wp*eps, young, "tangent")
      fast(1) = fastest_of(given, motion_of(evaluation_at_end, scene%x, u0, du))
      fast(2) = fastest_of(own, motion_of(evaluation_at_end, scene%x, u0, du))
      call check_true(error, fast(2)%element > 0, "some element is the fastest")
      call check_equal(error, fast(1)%element, fast(2)%element, "fastest")
      call check_near(error, fast(1)%square, fast(2)%square, 1.0e3_wp*eps, fast(2)%square, &
         "its frequency")
      call stepper_close(given)
      call stepper_close(own)
   end subroutine compare_forces

   !> Of a step that is corrected; differences of second order, at their best distance.
   subroutine test_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: d = 0.1_wp*epsilon(1.0_wp)**(1.0_wp/3.0_wp)
      type(scene_t) :: scene
      type(block_t) :: block
      type(stepper_t) :: given
      type(response_t) :: up, down
      real(wp) :: u0(2, 9), du(2, 9), way(2, 9), product(2, 9)

      call make_block(scene, "CPE4", [2, 2], block)
      call add_step(scene, .true., 1.0_wp, 1)
      call clamp(scene%step(1), [1, 2])
      call open_with(given, scene, coupled_neo_hooke(), .true., error)
      if (allocated(error)) return
      call shake(u0, 0.1_wp)
      call shake(du, 0.2_wp)
      call shake(way, 1.0_wp)
      call solid_times(given, motion_of(evaluation_t(), scene%x, u0, du), way, product)
      call solid_answers(given, motion_of(evaluation_t(), scene%x, u0, du + d*way), up)
      call solid_answers(given, motion_of(evaluation_t(), scene%x, u0, du - d*way), down)
      call check_true(error, .not. allocated(up%refusal), "a response")
      ! third derivatives of the law are a hundred times its modulus at such strains
      associate (up_force => up%part(role_internal)%force, &
            down_force => down%part(role_internal)%force)
         call check_near(error, product, (up_force - down_force)/(2.0_wp*d), 1.0e4_wp*d**2, &
            young, "tangent")
      end associate
      call solid_answers(given, motion_of(evaluation_t(), scene%x, u0, du), up)
      call solid_answers(given, motion_of(evaluation_t(), scene%x, u0, 0.0_wp*du), down)
      associate (part => up%part(role_internal))
         call check_near(error, sum(part%force*du), sum(up%energy) - sum(down%energy), &
            256.0_wp*eps, sum(part%magnitude*abs(du)) + sum(up%energy), "work of the step")
      end associate
      call stepper_close(given)
   end subroutine test_tangent

   !> The upper block is of the given law, the lower one not; in both models it is the same law.
   subroutine test_drop(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 20
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(stepper_t) :: given, own
      type(increment_t) :: increment
      real(wp) :: total, largest
      integer :: k, n_contact, i

      call make_two_blocks(scene, 0.0927_wp, lower, upper)
      scene%material = [scene%material, scene%material]
      scene%material(2)%name = "STEEL"
      scene%material(2)%law = law_linear
      scene%section = [scene%section, scene%section]
      scene%section(2)%material = 2
      scene%element%section(:4) = 2
      call add_step(scene, .false., 0.02_wp, n)
      call clamp(scene%step(1), [(i, i = 1, 5)])
      scene%v0(1, 11:) = 0.3_wp
      scene%v0(2, 11:) = -1.0_wp
      call open_both(given, own, scene, law_linear, error)
      if (allocated(error)) return
      total = given%march%ledger%total
      n_contact = 0
      do k = 1, n
         call stepper_advance(given, increment, error)
         if (.not. allocated(error)) call stepper_advance(own, increment, error)
         if (allocated(error)) return
         n_contact = n_contact + merge(1, 0, increment%n_active > 0)
         largest = given%march%ledger%kinetic + given%march%ledger%strain
         call check_near(error, given%march%ledger%total, total, 1.0e3_wp*eps, largest, "total")
         ! round-off of each step, that a soft block carries on
         call check_near(error, given%march%state%u, own%march%state%u, 1.0e6_wp*eps, 1.0_wp, &
            "displacements of step " // to_text(k))
         if (allocated(error)) return
      end do
      call check_true(error, n_contact > 1, "there was contact")
      call stepper_close(given)
      call stepper_close(own)
   end subroutine test_drop

   !> A stretched block that spins: the two discrete gradients differ by the second order in h.
   subroutine test_spin(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: coarse, fine

      call spin_distance(20, coarse, error)
      if (.not. allocated(error)) call spin_distance(40, fine, error)
      if (allocated(error)) return
      call check_true(error, coarse > 1.0e-6_wp, "the two differ, by " // to_text(coarse))
      call check_true(error, fine < coarse/3.5_wp, "second order: " // to_text(coarse) // ", " // &
         to_text(fine))
   end subroutine test_spin

   !> How far the solutions are apart after `n` steps.
   subroutine spin_distance(n, distance, error)
      integer, intent(in) :: n
      real(wp), intent(out) :: distance
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(stepper_t) :: given, own
      type(increment_t) :: increment
      real(wp) :: total
      integer :: k

      distance = 0.0_wp
      call make_block(scene, "CPE4", [2, 1], block)
      scene%u0(1, :) = 0.2_wp*scene%x(1, :)
      scene%v0(1, :) = -2.0_wp*scene%x(2, :)
      scene%v0(2, :) = 2.0_wp*(scene%x(1, :) - 1.0_wp)
      call add_step(scene, .false., 0.4_wp/real(n, wp), n)
      call open_both(given, own, scene, coupled_neo_hooke(), error)
      if (allocated(error)) return
      total = given%march%ledger%total
      do k = 1, n
         call stepper_advance(given, increment, error)
         if (.not. allocated(error)) call stepper_advance(own, increment, error)
         if (allocated(error)) return
         call check_near(error, given%march%ledger%total, total, 1.0e3_wp*eps, total, "total")
         call check_near(error, given%march%ledger%angular(1), own%march%ledger%angular(1), &
            1.0e3_wp*eps, 10.0_wp, "angular momentum")
         if (allocated(error)) return
      end do
      distance = norm2(given%march%state%u - own%march%state%u)
      call stepper_close(given)
      call stepper_close(own)
   end subroutine spin_distance

   !> Statics take gradients at the end: the same solution. The given law says nothing of zz.
   subroutine test_static(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(stepper_t), target :: given, own
      type(increment_t) :: increment
      type(solid_t), pointer :: solid
      real(wp) :: stress(6, 9), expected(6, 9)
      integer :: k

      call make_block(scene, "CPE4", [2, 2], block)
      scene%x(:, 5) = [1.15_wp, 0.9_wp]
      call add_step(scene, .true., 0.5_wp, 2)
      call clamp(scene%step(1), [1, 4, 7])
      do k = 3, 9, 3
         call prescribe(scene%step(1), k, 1, 0.4_wp)
         call prescribe(scene%step(1), k, 2, 0.1_wp)
      end do
      call open_both(given, own, scene, coupled_neo_hooke(), error)
      do k = 1, 2
         if (.not. allocated(error)) call stepper_advance(given, increment, error)
         if (.not. allocated(error)) call stepper_advance(own, increment, error)
      end do
      if (allocated(error)) return
      call check_near(error, given%march%state%u, own%march%state%u, 1.0e3_wp*eps, 1.0_wp, "u")
      call check_near(error, given%march%state%reaction, own%march%state%reaction, 1.0e3_wp*eps, &
         young, "reactions")
      solid => terms_solid(given%march%system%term)
      call nodal_stress(solid, given%march%state%u, 1.0_wp, stress)
      solid => terms_solid(own%march%system%term)
      call nodal_stress(solid, own%march%state%u, 1.0_wp, expected)
      call check_true(error, all(abs(expected(3, :)) > 1.0_wp), "there is a stress zz")
      expected(3, :) = 0.0_wp
      call check_near(error, stress, expected, 1.0e3_wp*eps, young, "stress")
      call stepper_close(given)
      call stepper_close(own)
   end subroutine test_static

   !> The march that a query builds for itself answers as the model does.
   subroutine test_query(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(stepper_t) :: given
      type(query_t) :: query
      real(wp) :: u1(2, 9)

      call make_block(scene, "CPE4", [2, 2], block)
      call add_step(scene, .false., 0.1_wp, 2)
      call open_with(given, scene, law_linear, .true., error)
      if (allocated(error)) return
      call shake(u1, 0.1_wp)
      call query_evaluate(query, given, 0.1_wp, u1, .true., error)
      if (allocated(error)) return
      call solid_answers(given, motion_of(evaluation_t(), scene%x, given%march%state%u, u1), &
         given%march%system%response)
      call check_near(error, query%march%system%response%part(role_internal)%force, &
         given%march%system%response%part(role_internal)%force, 64.0_wp*eps, young, "force")
      call query_free(query)
      call stepper_close(given)
   end subroutine test_query

   !> A pull to 0.4 with a law that ends at `limit`, or fails there.
   subroutine open_pull(stepper, limit, beyond, error)
      type(stepper_t), intent(inout) :: stepper
      real(wp), intent(in) :: limit
      integer, intent(in) :: beyond
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(elastic_t) :: elastic

      call make_block(scene, "CPE4", [1, 1], block)
      scene%material(1)%law = law_user
      call add_step(scene, .true., 0.25_wp, 4)
      call clamp(scene%step(1), [1, 3])
      call prescribe(scene%step(1), 2, 1, 0.4_wp)
      call prescribe(scene%step(1), 4, 1, 0.4_wp)
      elastic = elastic_of(law_linear)
      elastic%limit = limit
      elastic%beyond = beyond
      stepper%scene = scene
      stepper%is_read = .true.
      call stepper_give_law(stepper, "RUBBER", elastic, error)
      if (.not. allocated(error)) call stepper_build(stepper, error)
   end subroutine open_pull

   !> E11 is 0.345 at the displacement 0.3 and 0.48 at 0.4.
   subroutine test_outside(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: refused
      type(stepper_t), target :: stepper
      type(increment_t) :: increment
      type(solid_t), pointer :: solid
      real(wp) :: stress(6, 4)

      call open_pull(stepper, 0.38_wp, point_outside, error)
      do while (.not. allocated(error) .and. stepper%march%state%clock%n_grid < 3)
         call stepper_advance(stepper, increment, error)
      end do
      if (allocated(error)) return
      call stepper_advance(stepper, increment, refused)
      call check_error(error, refused, err_analysis, &
         "the law given for material RUBBER has no finite value at a strain that occurs", "outside")
      call check_true(error, increment%n_cut > 1, "it was cut")
      call check_true(error, stepper%march%state%u(1, 2) > 0.3_wp, "parts of it succeeded")
      call check_true(error, stepper%march%state%u(1, 2) < sqrt(1.0_wp + 2.0_wp*0.38_wp) - 1.0_wp, &
         "what succeeded is inside")
      solid => terms_solid(stepper%march%system%term)
      call nodal_stress(solid, stepper%march%state%u, 1.0_wp, stress)
      call check_true(error, .not. any(ieee_is_nan(stress)), "stress inside")
      call nodal_stress(solid, 2.0_wp*stepper%march%state%u, 1.0_wp, stress)
      call check_true(error, all(ieee_is_nan(stress(1, :))), "no stress outside")
      call stepper_close(stepper)
   end subroutine test_outside

   subroutine test_failed(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: refused
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      real(wp) :: u(2, 4)

      call open_pull(stepper, 0.25_wp, point_failed, error)
      do while (.not. allocated(error) .and. stepper%march%state%clock%n_grid < 2)
         call stepper_advance(stepper, increment, error)
      end do
      if (allocated(error)) return
      u = stepper%march%state%u
      call stepper_advance(stepper, increment, refused)
      call check_error(error, refused, err_analysis, &
         "the law given for material RUBBER has failed", "failed")
      call check_equal(error, increment%n_cut, 0, "cuts")
      call check_equal(error, stepper%march%state%clock%n_grid, 2, "grid point")
      call check_near(error, stepper%march%state%u, u, 0.0_wp, 1.0_wp, "displacements")
      call stepper_close(stepper)
   end subroutine test_failed

   !> A way that takes half of the digits, gone or to go: strains keep the other half.
   subroutine test_far(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: way = 2.0_wp**nint(0.5_wp*digits(1.0_wp)), least = 16.0_wp/way
      type(scene_t) :: scene
      type(block_t) :: block
      type(stepper_t) :: given
      type(response_t) :: near, far
      real(wp), dimension(2, 6) :: u0, du, direction, expected, product
      integer :: k

      call make_block(scene, "CPE4", [2, 1], block)
      call add_step(scene, .false., 0.1_wp, 1)
      call open_with(given, scene, coupled_neo_hooke(), .true., error)
      if (allocated(error)) return
      call shake(u0, 0.1_wp)
      call shake(du, 0.1_wp)
      call shake(direction, 1.0_wp)
      u0 = least*anint(u0/least)
      du = least*anint(du/least)
      do k = 0, 2
         if (k == 1) u0 = u0 + way
         if (k == 2) du = du + way
         call solid_answers(given, motion_of(evaluation_t(), scene%x, u0, du), far)
         call solid_times(given, motion_of(evaluation_t(), scene%x, u0, du), direction, product)
         if (k == 0) near = far
         if (k == 0) expected = product
         call check_near(error, far%part(role_internal)%force, near%part(role_internal)%force, &
            1.0e3_wp*eps, young, "forces")
         call check_near(error, product, expected, 1.0e3_wp*eps, 10.0_wp*young, "tangent")
      end do
      call stepper_close(given)
   end subroutine test_far

   !> The second of two elements has the given law: its stress is as by our own law, less that
   !> across the plane. Beyond what the law answers for there is none, but in the first element.
   subroutine test_mixed(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(stepper_t), target :: given, own, short
      type(solid_t), pointer :: solid
      type(elastic_t) :: law
      real(wp), dimension(6, 2) :: stress, expected
      real(wp) :: strain(3, 2), volume(2), u(2, 6)

      call make_block(scene, "CPE4", [2, 1], block)
      scene%material = [scene%material, scene%material]
      scene%material(2)%name = "Other"
      scene%section = [scene%section, scene%section]
      scene%section(1)%material = 2
      scene%section(2)%material = 1
      scene%element%section = [1, 2]
      call add_step(scene, .false., 0.1_wp, 1)
      call open_both(given, own, scene, coupled_neo_hooke(), error)
      if (allocated(error)) return
      call shake(u, 0.2_wp)
      solid => terms_solid(own%march%system%term)
      call element_means(solid, u, 1.0_wp, expected, strain, volume)
      solid => terms_solid(given%march%system%term)
      call element_means(solid, u, 1.0_wp, stress, strain, volume)
      expected(3, 2) = 0.0_wp
      call check_near(error, stress, expected, 1.0e3_wp*eps, young, "stress")
      law = elastic_of(coupled_neo_hooke())
      law%limit = 1.0e-3_wp
      law%beyond = point_outside
      short%scene = scene
      short%scene%material(1)%law = law_user
      short%is_read = .true.
      call stepper_give_law(short, "Rubber", law, error)
      if (.not. allocated(error)) call stepper_build(short, error)
      if (allocated(error)) return
      solid => terms_solid(short%march%system%term)
      call element_means(solid, u, 1.0_wp, stress, strain, volume)
      call check_true(error, all(ieee_is_nan(stress([1, 2, 4], 2))), "beyond the law")
      call check_near(error, stress(:, 1), expected(:, 1), 1.0e3_wp*eps, young, "beside it")
      call stepper_close(given)
      call stepper_close(own)
      call stepper_close(short)
   end subroutine test_mixed

   subroutine test_bad_rest(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: refused
      type(stepper_t) :: outside, failed

      call open_pull(outside, -1.0_wp, point_outside, refused)
      call check_error(error, refused, err_input, "no finite value at zero strain", "outside")
      call open_pull(failed, -1.0_wp, point_failed, refused)
      call check_error(error, refused, err_analysis, "has failed at zero strain", "failed")
   end subroutine test_bad_rest

   !> Our law of St. Venant and Kirchhoff given from outside: its forces, its masses, and what it
   !> says of constants that are wrong.
   subroutine test_taken(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: refused
      type(stepper_t) :: given, own, wrong
      type(scene_t) :: scene
      type(block_t) :: block
      type(response_t) :: one, other
      real(wp) :: u0(2, 6), du(2, 6)

      call make_block(scene, "CPE4", [2, 1], block)
      scene%material(1)%density = 3.0_wp
      call add_step(scene, .false., 0.1_wp, 1)
      given%scene = scene
      given%scene%material(1)%law = law_user
      given%scene%material(1)%constant = [young, poisson]
      wrong%scene = given%scene
      given%is_read = .true.
      call stepper_give_law(given, "rubber", law_linear_t(), error)
      if (.not. allocated(error)) call stepper_build(given, error)
      if (.not. allocated(error)) call open_with(own, scene, law_linear, .false., error)
      if (allocated(error)) return
      call shake(u0, 0.1_wp)
      call shake(du, 0.1_wp)
      call solid_answers(given, motion_of(evaluation_t(), scene%x, u0, du), one)
      call solid_answers(own, motion_of(evaluation_t(), scene%x, u0, du), other)
      call check_near(error, one%part(role_internal)%force, other%part(role_internal)%force, &
         64.0_wp*eps, young, "force")
      call check_near(error, given%march%ledger%kinetic, own%march%ledger%kinetic, 0.0_wp, 1.0_wp, &
         "energy")
      call check_near(error, sum(terms_mass_of(given)), 6.0_wp, 64.0_wp*eps, 6.0_wp, "mass")
      wrong%scene%material(1)%constant = [young, 0.75_wp]
      wrong%is_read = .true.
      call stepper_give_law(wrong, "rubber", law_linear_t(), error)
      if (allocated(error)) return
      call stepper_build(wrong, refused)
      call check_error(error, refused, err_input, ": error: material RUBBER: ", "constants")
      call stepper_close(given)
      call stepper_close(own)
      call stepper_close(wrong)
   end subroutine test_taken

   !> Mass at the nodes.
   function terms_mass_of(stepper) result(mass)
      type(stepper_t), intent(in) :: stepper
      real(wp) :: mass(size(stepper%scene%x, 2))

      call terms_mass_rows(stepper%march%system%term, mass)
   end function terms_mass_of

   !> The given law is that of the second of three materials.
   subroutine test_modes(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: refused
      type(scene_t) :: scene
      type(block_t) :: block
      type(stepper_t) :: stepper

      call make_block(scene, "CPE4", [1, 1], block)
      scene%element%kind = find_element_kind(scene%element%kinds, "CPE4I")
      scene%material = [scene%material, scene%material, scene%material]
      scene%material(1)%name = "STEEL"
      scene%material(3)%name = "WOOD"
      scene%material(2)%law = law_user
      scene%section(1)%material = 2
      call add_step(scene, .false., 0.1_wp, 1)
      stepper%scene = scene
      stepper%is_read = .true.
      call stepper_give_law(stepper, "Rubber", elastic_of(law_linear), error)
      if (allocated(error)) return
      call stepper_build(stepper, refused)
      call check_error(error, refused, err_input, "element 1 has incompatible modes, for " // &
         "which the law given for material RUBBER tells no moduli; take CPE4 or CPE8", "modes")
      call stepper_close(stepper)
   end subroutine test_modes

   !> An energy of the strains of the plane says nothing of it: refused in plane stress.
   subroutine test_normal(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=4), parameter :: kind(2) = ["CPE4", "CPS4"]
      type(error_t), allocatable :: refused
      type(elastic_t) :: law
      integer :: k

      do k = 1, 2
         block
            type(stepper_t) :: stepper

            call read_one(kind(k), law_given, "NONLINEAR", stepper, error)
            if (allocated(error)) return
            law = elastic_of(law_linear)
            call stepper_give_law(stepper, "M", law, error)
            if (allocated(error)) return
            if (allocated(refused)) deallocate(refused)
            call stepper_build(stepper, refused)
            if (k == 1) call check_true(error, .not. allocated(refused), "plane strain")
            if (k > 1) call check_error(error, refused, err_input, "element 1 is of type " &
               // "CPS4, plane stress, in which the law of material M is not known", kind(k))
            call stepper_close(stepper)
         end block
      end do
   end subroutine test_normal

   !> Energies and laws by turns, each by its name.
   subroutine test_kept(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: name(4) = ["A", "B", "C", "D"]
      type(host_t) :: host
      type(law_linear_t) :: law
      integer :: i

      do i = 1, 4
         if (mod(i, 2) == 1) call host_add_law(host, name(i), energy=elastic_of(law_linear))
         if (mod(i, 2) == 0) call host_add_law(host, name(i), law=law)
      end do
      call check_equal(error, size(host%law), 4, "laws")
      do i = 1, 4
         call check_equal(error, host%law(i)%material, name(i), "name")
         call check_true(error, (allocated(host%law(i)%energy) .eqv. mod(i, 2) == 1) .and. &
            (allocated(host%law(i)%law) .eqv. mod(i, 2) == 0), "what was given " // to_text(i))
      end do
   end subroutine test_kept

   subroutine test_bad_calls(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: refused
      type(scene_t) :: scene
      type(block_t) :: block
      type(stepper_t) :: stepper, flat, built
      type(elastic_t) :: elastic

      elastic = elastic_of(law_linear)
      call stepper_give_law(stepper, "RUBBER", elastic, refused)
      call check_error(error, refused, err_input, "there is no scene", "nothing read")
      call make_block(scene, "CPE4", [1, 1], block)
      call add_step(scene, .true., 1.0_wp, 1)
      call clamp(scene%step(1), [1, 2])
      stepper%scene = scene
      stepper%is_read = .true.
      call stepper_give_law(stepper, "RUBBER", elastic, refused)
      call check_error(error, refused, err_input, "has a law of its own", "not a user material")
      stepper%scene%material(1)%law = law_user
      call stepper_give_law(stepper, "STEEL", elastic, refused)
      call check_error(error, refused, err_input, "there is no material STEEL", "unknown")
      call stepper_build(stepper, refused)
      call check_error(error, refused, err_input, "material RUBBER is a *USER MATERIAL", &
         "none given")
      call stepper_close(stepper)
      elastic%n_variable = 2
      call make_block(flat%scene, "CPE4", [1, 1], block)
      call add_step(flat%scene, .true., 1.0_wp, 1)
      flat%scene%material(1)%law = law_user
      flat%is_read = .true.
      call stepper_give_law(flat, "RUBBER", elastic, refused)
      call check_true(error, .not. allocated(refused), "given")
      call stepper_give_law(flat, "rubber", elastic, refused)
      call check_error(error, refused, err_input, "is given already", "given twice")
      call stepper_build(flat, refused)
      call check_error(error, refused, err_input, "has 2 variables", "variables")
      call stepper_close(flat)
      if (allocated(error)) return
      call open_with(built, scene, law_linear, .true., error)
      if (allocated(error)) return
      call stepper_give_law(built, "RUBBER", elastic, refused)
      call check_error(error, refused, err_input, "before the model is built", "too late")
      call stepper_close(built)
   end subroutine test_bad_calls

   !> The file holds the deck; the law has to be given again, after a deck is read.
   subroutine test_restart(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: refused
      type(stepper_t) :: first, bare, second
      type(restart_t) :: restart
      type(increment_t) :: increment
      integer :: k

      call read_sample(first, error)
      if (.not. allocated(error)) call stepper_give_law(first, "RUBBER", elastic_of(law_linear), &
         error)
      if (.not. allocated(error)) call stepper_build(first, error)
      if (.not. allocated(error)) call stepper_advance(first, increment, error)
      if (allocated(error)) return
      call check_near(error, first%scene%material(1)%constant, [1.0_wp, 2.0_wp, 3.0_wp], 0.0_wp, &
         1.0_wp, "constants")
      call stepper_save(first, restart)
      call stepper_load(bare, restart, refused)
      call check_error(error, refused, err_input, "sample.inp:8: error: material RUBBER is a " // &
         "*USER MATERIAL", "without the law")
      if (allocated(error)) return
      call read_sample(second, error)
      if (.not. allocated(error)) call stepper_give_law(second, "RUBBER", elastic_of(law_linear), &
         error)
      if (.not. allocated(error)) call stepper_load(second, restart, error)
      do k = 1, 3
         if (.not. allocated(error)) call stepper_advance(first, increment, error)
         if (.not. allocated(error)) call stepper_advance(second, increment, error)
      end do
      if (allocated(error)) return
      call check_near(error, second%march%state%u, first%march%state%u, 0.0_wp, 1.0_wp, "u")
      call stepper_close(first)
      call stepper_close(bare)
      call stepper_close(second)
   end subroutine test_restart

   subroutine read_sample(stepper, error)
      type(stepper_t), intent(inout) :: stepper
      type(error_t), allocatable, intent(out) :: error
      type(diagnostics_t) :: diagnostics
      character(len=40), parameter :: line(*) = [character(len=40) :: "*NODE, NSET=ALL", &
         "1, 0., 0.", "2, 1., 0.", "3, 1., 1.", "4, 0., 1.", "*ELEMENT, TYPE=CPE4, ELSET=B", &
         "1, 1, 2, 3, 4", "*MATERIAL, NAME=RUBBER", "*USER MATERIAL, CONSTANTS=3", "1., 2.", "3.", &
         "*DENSITY", "1.", "*SOLID SECTION, ELSET=B, MATERIAL=RUBBER", &
         "*INITIAL CONDITIONS, TYPE=VELOCITY", "3, 1, 1.", "*STEP, NLGEOM", "*DYNAMIC, DIRECT", &
         "0.1, 1.", "*END STEP"]
      integer :: i

      allocate(stepper%source%line(size(line)), stepper%source%file_name(1), stepper%override(0))
      stepper%source%file_name(1)%text = "sample.inp"
      do i = 1, size(line)
         stepper%source%line(i)%text = trim(line(i))
      end do
      allocate(stepper%source%file(size(line)), source=1)
      stepper%source%number = [(i, i = 1, size(line))]
      diagnostics%file_name = stepper%source%file_name
      call stepper_read_source(stepper, diagnostics, error)
   end subroutine read_sample

end module test_host_law
