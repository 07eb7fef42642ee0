!> Forces and mass from outside: a host's solid, chains of springs, and what can go wrong.
module test_host_force
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_couplings, only : equation_t
   use emcon_csr, only : csr_from_elements, csr_multiply, csr_t
   use emcon_errors, only : err_analysis, err_input, error_t
   use emcon_interactions, only : formulation_mortar, formulation_nts
   use emcon_evaluation, only : evaluation_t
   use emcon_kinds, only : wp
   use emcon_march, only : increment_t
   use emcon_motion, only : motion_of, motion_t
   use emcon_scene, only : scene_t
   use emcon_scheme_registry, only : scheme_row
   use emcon_stepper, only : stepper_advance, stepper_build, stepper_close, stepper_is_done, &
      stepper_t
   use emcon_stepper_free, only : stepper_set_state
   use emcon_stepper_user, only : stepper_give_force, stepper_give_mass
   use emcon_stepper_query, only : query_evaluate, query_free, query_residual, query_t
   use emcon_steps, only : initiation_velocity_update
   use emcon_system, only : mass_times, system_respond
   use emcon_term, only : response_init, response_t, role_internal
   use emcon_text, only : to_text
   use given_hosts, only : chain_host_init, chain_host_t
   use given_scenes, only : eps => given_eps, lump, make_line, open_both, open_given, run_conserving
   use linear_scenes, only : add_equation
   use random_draws, only : draw_random
   use small_scenes, only : add_step, block_t, make_block, prescribe, shake
   use stepper_scenes, only : drop_h, make_drop, make_tied_drop
   implicit none
   private
   public :: collect_host_force

contains

   subroutine collect_host_force(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a host's solid in contact, NTS", test_host_nts), &
         test_case_t("a host's solid in contact, MORTAR", test_host_mortar), &
         test_case_t("a host's solid that is tied", test_host_tied), &
         test_case_t("a host that tells no magnitudes", test_host_silent), &
         test_case_t("sizes of forces that a host does not tell", test_magnitude), &
         test_case_t("a matrix over what is linked", test_linked), &
         test_case_t("masses between nodes are lumped by their rows", test_lumped), &
         test_case_t("contact between elements and a host", test_host_mixed), &
         test_case_t("a host in contact, VELOCITY UPDATE", test_host_update), &
         test_case_t("chain of springs in motion", test_chain), &
         test_case_t("chain of springs at rest", test_static_chain), &
         test_case_t("equations between given nodes", test_equation), &
         test_case_t("out of range is cut", test_outside), &
         test_case_t("failures", test_failures), &
         test_case_t("queries have the forces", test_query)]
   end subroutine collect_host_force

   !> Both step alike. They solve the same equations, but add tangents in another order, so each
   !> step leaves another residual r. Newton's method polishes it below 4 eps of the inertia's
   !> contributions s M (b h v + 2 v) = 8 M v/h, s = b = 2/h; it moves the end of the step by no
   !> more than (s b M)^-1 r = 8 eps v h for every node, sqrt(n_node) of that in the worst node, and
   !> the velocity by 2/h of that. The impact passes velocities on, no more than doubled in a
   !> contact.
   subroutine compare(error, scene, tells_magnitude, is_kept)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: tells_magnitude
      logical, intent(in), optional :: is_kept(:)    !! elements that are not the host's
      type(stepper_t) :: own, hosted
      type(increment_t) :: increment
      logical, allocatable :: kept(:)
      real(wp) :: total, scale
      integer :: k, n_contact

      allocate(kept(size(scene%element%kind)), source=.false.)
      if (present(is_kept)) kept = is_kept
      call open_both(scene, kept, tells_magnitude, own, hosted, error)
      if (allocated(error)) return
      total = hosted%march%ledger%total
      scale = 64.0_wp*sqrt(real(size(scene%x, 2), wp))*maxval(abs(scene%v0))
      n_contact = 0
      k = 0
      do while (.not. stepper_is_done(own))
         k = k + 1
         call stepper_advance(own, increment, error)
         n_contact = n_contact + merge(1, 0, increment%n_active > 0)
         if (.not. allocated(error)) call stepper_advance(hosted, increment, error)
         if (allocated(error)) return
         associate (a => own%march%state, b => hosted%march%state)
            call check_near(error, b%v, a%v, real(k, wp)*eps, scale, "v in step " // to_text(k))
            call check_near(error, b%u, a%u, real(k**2, wp)*drop_h*eps, scale, &
               "u in step " // to_text(k))
            call check_true(error, all(a%contacts%is_active .eqv. b%contacts%is_active), &
               "same contacts")
         end associate
         if (allocated(error)) return
         call check_near(error, hosted%march%ledger%potential + hosted%march%ledger%strain, &
            own%march%ledger%strain, real(k, wp)*eps, scale**2, "energy of the host")
         call check_true(error, any(kept) .or. .not. hosted%march%ledger%strain > 0.0_wp, &
            "no strain")
         call check_near(error, hosted%march%ledger%total, total, real(k, wp)*eps, &
            64.0_wp*hosted%march%ledger%kinetic, "total energy in step " // to_text(k))
         if (allocated(error)) return
      end do
      call check_true(error, n_contact > 1, "there was contact")
      call check_true(error, hosted%march%ledger%potential > 0.0_wp, "the host is strained")
      call stepper_close(own)
      call stepper_close(hosted)
   end subroutine compare

   subroutine test_host_nts(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene

      call make_drop(scene, 20)
      scene%pair(1)%formulation = formulation_nts
      call compare(error, scene, .true.)
   end subroutine test_host_nts

   subroutine test_host_mortar(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene

      call make_drop(scene, 20)
      scene%pair(1)%formulation = formulation_mortar
      call compare(error, scene, .true.)
   end subroutine test_host_mortar

   subroutine test_host_tied(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene

      call make_tied_drop(scene, 12, .true.)
      call compare(error, scene, .true.)
   end subroutine test_host_tied

   !> At each freedom the largest force of those that depend on it: of its node and of all nodes of
   !> its elements.
   subroutine test_magnitude(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: own, hosted
      type(scene_t) :: scene
      type(block_t) :: block
      type(response_t) :: response
      type(motion_t) :: motion
      real(wp) :: u(2, 8), largest(2, 8)
      integer :: e

      call make_block(scene, "CPE4", [3, 1], block)
      call add_step(scene, .false., 0.1_wp, 1)
      call open_both(scene, [.false., .false., .false.], .false., own, hosted, error)
      if (allocated(error)) return
      call shake(u, 0.1_wp)
      motion = motion_of(evaluation_t(), scene%x, 0.0_wp*u, u)
      call response_init(response, 2, 8, 0)
      associate (term => hosted%march%system%term)
         call term(size(term))%term%respond(motion, response)
      end associate
      largest = 0.0_wp
      do e = 1, 3
         associate (node => scene%element%node(:, e), force => response%part(role_internal)%force)
            largest(:, node) = max(largest(:, node), maxval(abs(force(:, node))))
         end associate
      end do
      call check_near(error, response%part(role_internal)%magnitude, largest, 0.0_wp, 1.0_wp, &
         "sizes")
      call check_true(error, maxval(largest(:, [1, 5])) < maxval(largest), "of those nearby alone")
      call stepper_close(own)
      call stepper_close(hosted)
   end subroutine test_magnitude

   !> Two nodes of the host hang on others of it: the matrix is that of elements with the same
   !> links.
   subroutine test_linked(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: own, hosted
      type(scene_t) :: scene
      type(block_t) :: block
      type(motion_t) :: motion
      real(wp) :: du(2, 8)
      real(wp), allocatable :: x(:), product(:), expected(:)

      call make_block(scene, "CPE4", [3, 1], block)
      call add_step(scene, .false., 0.1_wp, 1)
      call add_equation(scene, [4, 8, 3], [1, 1, 2], [1.0_wp, -2.0_wp, 0.5_wp])
      call add_equation(scene, [1, 5], [2, 1], [1.0_wp, 3.0_wp])
      call open_both(scene, [.false., .false., .false.], .true., own, hosted, error)
      if (allocated(error)) return
      call shake(du, 0.1_wp)
      associate (a => own%march%system, b => hosted%march%system)
         motion = motion_of(evaluation_t(), scene%x, 0.0_wp*du, du)
         call system_respond(a, motion, .true.)
         call system_respond(b, motion, .true.)
         allocate(x(a%space%numbering%n_unknown))
         call draw_random(x)
         allocate(product, expected, mold=x)
         call csr_multiply(a%matrix, x, expected)
         call csr_multiply(b%matrix, x, product)
         call check_near(error, product, expected, 64.0_wp*eps, maxval(abs(expected)), "matrix")
         call check_equal(error, size(x), 14, "unknowns")
      end associate
      call stepper_close(own)
      call stepper_close(hosted)
   end subroutine test_linked

   !> Of 2 and 1 between three nodes in a row; explicit steps take the sums of the rows.
   subroutine test_lumped(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper
      type(scene_t) :: scene
      type(chain_host_t) :: chain
      type(csr_t) :: mass
      integer, allocatable :: slot(:)
      real(wp) :: field(2, 3), product(2, 3)

      call make_line(scene, 3, .false., 0.01_wp, 4)
      scene%step(1)%scheme = scheme_row("DYNAMIC", "CENTRALDIFFERENCE")
      call chain_host_init(chain, [1, 2, 3], 3, error)
      if (.not. allocated(error)) call csr_from_elements(mass, 3, [1, 3, 5], [1, 2, 2, 3], slot, &
         error)
      if (allocated(error)) return
      mass%value = [2.0_wp, 1.0_wp, 1.0_wp, 4.0_wp, 1.0_wp, 1.0_wp, 2.0_wp]
      stepper%scene = scene
      stepper%is_read = .true.
      call stepper_give_force(stepper, chain, error)
      if (.not. allocated(error)) call stepper_give_mass(stepper, mass, error)
      if (.not. allocated(error)) call stepper_build(stepper, error)
      if (allocated(error)) return
      call shake(field, 1.0_wp)
      call mass_times(stepper%march%system, field, product)
      call check_near(error, product, field*spread([3.0_wp, 6.0_wp, 3.0_wp], 1, 2), &
         16.0_wp*epsilon(1.0_wp), 6.0_wp, "lumped")
      call stepper_close(stepper)
   end subroutine test_lumped

   !> Contact between elements and nodes of the host, which is master, then slave.
   subroutine test_host_mixed(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      logical, parameter :: is_upper(6) = [.false., .false., .false., .false., .true., .true.]

      call make_drop(scene, 20)
      call compare(error, scene, .true., is_upper)
      if (.not. allocated(error)) call compare(error, scene, .true., .not. is_upper)
      scene%pair(1)%formulation = formulation_mortar
      if (.not. allocated(error)) call compare(error, scene, .true., is_upper)
      if (.not. allocated(error)) call compare(error, scene, .true., .not. is_upper)
   end subroutine test_host_mixed

   !> Energy that closing contacts have lost comes back by a jump of velocity, with the given mass.
   subroutine test_host_update(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene

      call make_drop(scene, 20)
      scene%step(1)%contact%initiation = initiation_velocity_update
      call compare(error, scene, .true.)
   end subroutine test_host_update

   subroutine test_host_silent(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene

      call make_drop(scene, 20)
      call compare(error, scene, .false.)
   end subroutine test_host_silent

   !> Non-linear springs, one end thrown off: energy, momentum, and no force along y.
   subroutine test_chain(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(stepper_t) :: stepper
      type(chain_host_t) :: chain

      call make_line(scene, 7, .false., 0.1_wp, 200)
      scene%v0(1, 7) = 1.0_wp
      scene%v0(2, 3) = 0.5_wp
      call chain_host_init(chain, [1, 2, 3, 4, 5, 6, 7], 7, error)
      chain%c = 5.0_wp
      if (.not. allocated(error)) call open_given(stepper, scene, chain, 2.0_wp, error)
      if (.not. allocated(error)) call run_conserving(stepper, 2.0_wp, error)
      if (allocated(error)) return
      call check_near(error, stepper%march%ledger%momentum, [2.0_wp, 1.0_wp], &
         200.0_wp*32.0_wp*eps, 1.0_wp, "momentum")
      call check_near(error, stepper%march%state%u(2, 3), 10.0_wp, 200.0_wp*8.0_wp*eps, 10.0_wp, &
         "flies along y")
      call check_equal(error, stepper%march%system%space%n_body, 1, "bodies")
      call stepper_close(stepper)
   end subroutine test_chain

   !> A chain pulled at its end without any load: all springs are equally long, whether or not the
   !> tangent is called symmetric and magnitudes are told.
   subroutine test_static_chain(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(stepper_t) :: stepper
      type(chain_host_t) :: chain
      type(increment_t) :: increment
      integer :: i, k

      call make_line(scene, 5, .true., 1.0_wp, 1)
      call prescribe(scene%step(1), 1, 1, 0.0_wp)
      call prescribe(scene%step(1), 5, 1, 8.0_wp)
      do k = 0, 3
         call chain_host_init(chain, [1, 2, 3, 4, 5], 5, error)
         if (allocated(error)) return
         chain%c = 3.0_wp
         chain%tells_magnitude = mod(k, 2) == 1
         chain%is_symmetric_at_end = k > 1
         stepper = stepper_t()
         call open_given(stepper, scene, chain, 0.0_wp, error)
         if (.not. allocated(error)) call stepper_advance(stepper, increment, error)
         if (allocated(error)) return
         call check_equal(error, increment%n_cut, 0, "cuts")
         call check_near(error, stepper%march%state%u(1, :), [(2.0_wp*real(i, wp), i = 0, 4)], &
            32.0_wp*eps, 8.0_wp, "displacements")
         ! 4 springs of k e^2/2 + c e^4/4 = 2 + 12, pulled by k e + c e^3 = 26.
         call check_near(error, stepper%march%ledger%potential, 56.0_wp, 64.0_wp*eps, 56.0_wp, &
            "energy")
         ! Their slope is k + 3 c e^2 = 37, times what both ends of a spring may be off.
         call check_near(error, stepper%march%state%reaction(1, [1, 5]), [-26.0_wp, 26.0_wp], &
            2.0_wp*32.0_wp*eps, 37.0_wp*8.0_wp, "reactions")
         call stepper_close(stepper)
         if (allocated(error)) return
      end do
   end subroutine test_static_chain

   !> Two chains whose ends an equation ties together.
   subroutine test_equation(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(stepper_t) :: stepper
      type(chain_host_t) :: one, other
      type(equation_t) :: equation
      type(csr_t) :: mass

      call make_line(scene, 6, .false., 0.1_wp, 100)
      scene%v0(1, 6) = 1.0_wp
      equation%node = [3, 4]
      equation%dof = [1, 1]
      equation%coefficient = [1.0_wp, -1.0_wp]
      scene%equation = [equation]
      call chain_host_init(one, [1, 2, 3], 6, error)
      if (.not. allocated(error)) call chain_host_init(other, [4, 5, 6], 6, error)
      if (allocated(error)) return
      other%c = 1.0_wp
      stepper%scene = scene
      stepper%is_read = .true.
      call lump(mass, 6, 1.0_wp)
      call stepper_give_force(stepper, one, error)
      if (.not. allocated(error)) call stepper_give_force(stepper, other, error)
      if (.not. allocated(error)) call stepper_give_mass(stepper, mass, error)
      if (.not. allocated(error)) call stepper_build(stepper, error)
      if (.not. allocated(error)) call run_conserving(stepper, 1.0_wp, error)
      if (allocated(error)) return
      call check_equal(error, stepper%march%system%space%n_body, 2, "bodies")
      call check_near(error, stepper%march%state%u(1, 3), stepper%march%state%u(1, 4), 0.0_wp, &
         1.0_wp, "tied ends")
      call check_true(error, abs(stepper%march%state%u(1, 1)) > 0.1_wp, "the first chain moves")
      call check_near(error, stepper%march%ledger%momentum(1), 1.0_wp, 3200.0_wp*eps, 1.0_wp, &
         "momentum")
      call stepper_close(stepper)
   end subroutine test_equation

   !> A chain that may not become too long: the step is cut until it gives up, in clear words.
   subroutine test_outside(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(stepper_t) :: stepper
      type(chain_host_t) :: chain
      type(increment_t) :: increment
      integer :: k

      call make_line(scene, 2, .false., 0.1_wp, 100)
      scene%v0(1, 2) = 1.0_wp
      call chain_host_init(chain, [1, 2], 2, error)
      if (allocated(error)) return
      chain%longest = 0.25_wp
      chain%k = 0.1_wp
      call open_given(stepper, scene, chain, 1.0_wp, error)
      if (allocated(error)) return
      do k = 1, 5
         call stepper_advance(stepper, increment, raised)
         if (allocated(raised)) exit
      end do
      call check_error(error, raised, err_analysis, "CHAIN is put out of its range", "too long")
      call check_true(error, increment%n_cut > 3, "it was cut")
      associate (u => stepper%march%state%u)
         call check_true(error, u(1, 2) - u(1, 1) < 0.25_wp .and. u(1, 2) - u(1, 1) > 0.2_wp, &
            "the state is that of the last part that succeeded")
         call stepper_set_state(stepper, raised, u=u*1.5_wp)
      end associate
      call check_error(error, raised, err_analysis, "out of its range by the displacements u", &
         "a state out of range")
      call stepper_close(stepper)
   end subroutine test_outside

   subroutine test_failures(error)
      type(error_t), allocatable, intent(out) :: error

      call expect_failure(error, 0, 1, "CHAIN failed: out of springs")
      call expect_failure(error, 1, 1, "returned the status 7, which is none")
      call expect_failure(error, 2, 1, "made infinite or NaN at node 10 by the displacements")
      call expect_failure(error, 0, 6, "CHAIN failed: out of springs")
      call expect_failure(error, 2, 6, "made infinite or NaN at node 10")
   end subroutine test_failures

   !> The chain goes wrong in call `ends_at`: in the first one nothing is built.
   subroutine expect_failure(error, way, ends_at, text)
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in) :: way, ends_at
      character(len=*), intent(in) :: text
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(stepper_t) :: stepper
      type(chain_host_t) :: chain
      type(increment_t) :: increment
      real(wp) :: u(2, 2), time
      integer :: k

      if (allocated(error)) return
      call make_line(scene, 2, .false., 0.1_wp, 100)
      scene%v0(1, 2) = 1.0_wp
      call chain_host_init(chain, [1, 2], 2, error)
      if (allocated(error)) return
      chain%ends_at = ends_at
      chain%gives_nan = way == 2
      if (way == 1) chain%status_then = 7
      call open_given(stepper, scene, chain, 1.0_wp, raised)
      do k = 1, 10
         if (allocated(raised)) exit
         u = stepper%march%state%u
         time = stepper%march%state%clock%time
         call stepper_advance(stepper, increment, raised)
      end do
      call check_error(error, raised, merge(err_input, err_analysis, way == 1), text, "way " // &
         to_text(way))
      if (ends_at > 1) then
         call check_near(error, stepper%march%state%u, u, 0.0_wp, 1.0_wp, "the state stays")
         call check_near(error, stepper%march%state%clock%time, time, 0.0_wp, 1.0_wp, "time stays")
      end if
      call stepper_close(stepper)
   end subroutine expect_failure

   !> The residual of a query is that of the step that the stepper makes.
   subroutine test_query(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(stepper_t) :: stepper
      type(query_t) :: query
      type(chain_host_t) :: chain
      type(increment_t) :: increment
      real(wp), allocatable :: nodal(:, :), unknown(:)
      real(wp) :: u1(2, 3)

      call make_line(scene, 3, .false., 0.1_wp, 2)
      scene%v0(1, 3) = 1.0_wp
      call chain_host_init(chain, [1, 2, 3], 3, error)
      if (.not. allocated(error)) call open_given(stepper, scene, chain, 1.0_wp, error)
      if (allocated(error)) return
      u1 = 0.0_wp
      u1(1, :) = [0.1_wp, 0.2_wp, 0.4_wp]
      call query_evaluate(query, stepper, 0.1_wp, u1, .true., error)
      if (.not. allocated(error)) call query_residual(query, .true., nodal, unknown, error)
      if (allocated(error)) return
      ! 2/h (du/h - v) and half of the spring forces at the end
      call check_near(error, nodal(1, :), [19.95_wp, 39.95_wp, 60.1_wp], 16.0_wp*eps, 80.0_wp, &
         "residual")
      call stepper_advance(stepper, increment, error)
      call query_free(query)
      call stepper_close(stepper)
   end subroutine test_query

end module test_host_force
