!> Forces and mass from outside: a host's solid, chains of springs, wells, and what can be wrong.
module test_given_force
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_csr, only : csr_from_elements, csr_t
   use emcon_errors, only : err_analysis, err_input, error_t
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t
   use emcon_node_potential, only : node_potential_init, node_potential_t
   use emcon_restart, only : restart_t
   use emcon_scene, only : equation_t, formulation_mortar, formulation_nts, scene_t
   use emcon_stepper, only : stepper_advance, stepper_build, stepper_close, stepper_is_done, &
      stepper_save, stepper_t
   use emcon_stepper_given, only : stepper_give_force, stepper_give_mass
   use emcon_stepper_free, only : stepper_set_state
   use emcon_stepper_query, only : query_evaluate, query_free, query_residual, query_t
   use emcon_surface_edges, only : surface_edges
   use emcon_system, only : system_init, system_t
   use emcon_text, only : to_text
   use given_hosts, only : chain_host_init, chain_host_t, solid_host_init, solid_host_t, well_t
   use small_scenes, only : add_step, block_t, make_block, prescribe, scene_begin
   use stepper_scenes, only : drop_h, make_drop, make_tied_drop
   implicit none
   private
   public :: collect_given_force

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))

contains

   subroutine collect_given_force(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a host's solid in contact, NTS", test_host_nts), &
         test_case_t("a host's solid in contact, MORTAR", test_host_mortar), &
         test_case_t("a host's solid that is tied", test_host_tied), &
         test_case_t("a host that tells no magnitudes", test_host_silent), &
         test_case_t("chain of springs in motion", test_chain), &
         test_case_t("chain of springs at rest", test_static_chain), &
         test_case_t("equations between given nodes", test_equation), &
         test_case_t("harmonic well", test_harmonic), &
         test_case_t("centre of gravity", test_kepler), &
         test_case_t("order in h", test_order), &
         test_case_t("a force on elements", test_with_elements), &
         test_case_t("out of range is cut", test_outside), &
         test_case_t("failures", test_failures), &
         test_case_t("wrong patterns", test_patterns), &
         test_case_t("wrong mass", test_mass), &
         test_case_t("wrong order of calls", test_order_of_calls), &
         test_case_t("queries have the forces", test_query)]
   end subroutine collect_given_force

   !> Take the elements away from `scene`; its surfaces become surfaces of edges.
   subroutine strip(scene)
      type(scene_t), intent(inout) :: scene
      integer, allocatable :: edge(:, :)
      integer :: i

      do i = 1, size(scene%surface)
         call surface_edges(scene, scene%surface(i), edge)
         scene%surface(i)%edge = edge
         scene%surface(i)%element = [integer ::]
         scene%surface(i)%face = [integer ::]
      end do
      scene%element_label = [integer ::]
      deallocate(scene%element_origin)
      allocate(scene%element_origin(0))
      scene%element_kind = [integer ::]
      scene%element_node = scene%element_node(:, :0)
      scene%element_section = [integer ::]
   end subroutine strip

   !> `scene` with elements, and the same with the elements as those of a host.
   subroutine open_both(scene, tells_magnitude, own, hosted, error)
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: tells_magnitude
      type(stepper_t), intent(inout) :: own, hosted
      type(error_t), allocatable, intent(out) :: error
      type(solid_host_t) :: host
      type(system_t) :: system

      own%scene = scene
      own%is_read = .true.
      call stepper_build(own, error)
      if (allocated(error)) return
      call solid_host_init(host, scene, error)
      if (.not. allocated(error)) call system_init(system, own%scene, error)
      if (allocated(error)) return
      host%tells_magnitude = tells_magnitude
      hosted%scene = scene
      call strip(hosted%scene)
      hosted%is_read = .true.
      call stepper_give_force(hosted, host, error)
      if (.not. allocated(error)) call stepper_give_mass(hosted, system%mass, error)
      if (.not. allocated(error)) call stepper_build(hosted, error)
   end subroutine open_both

   !> Both step alike. They solve the same equations, but add tangents in another order, so each
   !> step leaves another residual r. Newton's method polishes it below 4 eps of the inertia's
   !> contributions s M (b h v + 2 v) = 8 M v/h, s = b = 2/h; it moves the end of the step by no more
   !> than (s b M)^-1 r = 8 eps v h for every node, sqrt(n_node) of that in the worst node, and the
   !> velocity by 2/h of that. The impact passes velocities on, no more than doubled in a contact.
   subroutine compare(error, scene, tells_magnitude)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: tells_magnitude
      type(stepper_t) :: own, hosted
      type(increment_t) :: increment
      real(wp) :: total, scale
      integer :: k, n_contact

      call open_both(scene, tells_magnitude, own, hosted, error)
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
            call check_true(error, all(a%is_active .eqv. b%is_active), "same contacts")
         end associate
         if (allocated(error)) return
         call check_near(error, hosted%march%ledger%strain, 0.0_wp, 0.0_wp, 1.0_wp, "no strain")
         call check_near(error, hosted%march%ledger%potential, own%march%ledger%strain, &
            real(k, wp)*eps, scale**2, "energy of the host")
         call check_near(error, hosted%march%ledger%total, total, real(k, wp)*eps, &
            64.0_wp*hosted%march%ledger%kinetic, "total energy in step " // to_text(k))
         if (allocated(error)) return
      end do
      call check_true(error, n_contact > 1, "there was contact")
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

   subroutine test_host_silent(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene

      call make_drop(scene, 20)
      call compare(error, scene, .false.)
   end subroutine test_host_silent

   !> `n` nodes along x, one apart from the other, that only move along x; one step.
   subroutine make_line(scene, n, is_static, h, n_increment)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: n
      logical, intent(in) :: is_static
      real(wp), intent(in) :: h
      integer, intent(in) :: n_increment
      integer :: i

      call scene_begin(scene)
      deallocate(scene%x, scene%u0, scene%v0, scene%node_origin)
      allocate(scene%x(2, n), scene%u0(2, n), scene%v0(2, n), source=0.0_wp)
      allocate(scene%node_origin(n))
      scene%x(1, :) = [(real(i, wp), i = 1, n)]
      scene%node_label = [(10*i, i = 1, n)]
      call add_step(scene, is_static, h, n_increment)
   end subroutine make_line

   !> Masses of `mass` at `n` nodes.
   subroutine lump(mass, n, size_of)
      type(csr_t), intent(out) :: mass
      integer, intent(in) :: n
      real(wp), intent(in) :: size_of
      type(error_t), allocatable :: error
      integer, allocatable :: slot(:)
      integer :: i

      call csr_from_elements(mass, n, [(i, i = 1, n + 1)], [(i, i = 1, n)], slot, error)
      mass%value = real(size_of, dp)
   end subroutine lump

   subroutine open_given(stepper, scene, force, mass, error)
      use emcon_given_force, only : given_force_t
      type(stepper_t), intent(inout) :: stepper
      type(scene_t), intent(in) :: scene
      class(given_force_t), intent(in) :: force
      real(wp), intent(in) :: mass               !! of each node; 0: none
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: matrix

      stepper%scene = scene
      stepper%is_read = .true.
      call stepper_give_force(stepper, force, error)
      if (allocated(error)) return
      call lump(matrix, size(scene%x, 2), mass)
      if (mass > 0.0_wp) call stepper_give_mass(stepper, matrix, error)
      if (.not. allocated(error)) call stepper_build(stepper, error)
   end subroutine open_given

   !> Run to the end; the total energy stays but for `steps` times 32 eps of `scale`.
   subroutine run_conserving(stepper, scale, error)
      type(stepper_t), intent(inout) :: stepper
      real(wp), intent(in) :: scale
      type(error_t), allocatable, intent(out) :: error
      type(increment_t) :: increment
      real(wp) :: total
      integer :: k

      total = stepper%march%ledger%total
      k = 0
      do while (.not. stepper_is_done(stepper))
         k = k + 1
         call stepper_advance(stepper, increment, error)
         if (allocated(error)) return
         call check_near(error, stepper%march%ledger%total, total, 32.0_wp*real(k, wp)*eps, &
            scale, "total energy in step " // to_text(k))
         if (allocated(error)) return
      end do
   end subroutine run_conserving

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
      call check_near(error, stepper%march%ledger%momentum, [2.0_wp, 1.0_wp], 200.0_wp*32.0_wp*eps, &
         1.0_wp, "momentum")
      call check_near(error, stepper%march%state%u(2, 3), 10.0_wp, 200.0_wp*8.0_wp*eps, 10.0_wp, &
         "flies along y")
      call check_equal(error, stepper%march%system%n_body, 1, "bodies")
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
      call check_equal(error, stepper%march%system%n_body, 2, "bodies")
      call check_near(error, stepper%march%state%u(1, 3), stepper%march%state%u(1, 4), 0.0_wp, &
         1.0_wp, "tied ends")
      call check_true(error, abs(stepper%march%state%u(1, 1)) > 0.1_wp, "the first chain moves")
      call check_near(error, stepper%march%ledger%momentum(1), 1.0_wp, 3200.0_wp*eps, 1.0_wp, &
         "momentum")
      call stepper_close(stepper)
   end subroutine test_equation

   !> A mass point at (1, 0) with the velocity (0, v) in a well.
   subroutine open_well(stepper, is_harmonic, v, h, n, error)
      type(stepper_t), intent(inout) :: stepper
      logical, intent(in) :: is_harmonic
      real(wp), intent(in) :: v, h
      integer, intent(in) :: n
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(well_t) :: well
      type(node_potential_t) :: potential

      call make_line(scene, 1, .false., h, n)
      scene%v0(2, 1) = v
      well%n_variable = 2
      well%is_harmonic = is_harmonic
      call node_potential_init(potential, "WELL", [1], 1, well, error)
      if (.not. allocated(error)) call open_given(stepper, scene, potential, 1.0_wp, error)
   end subroutine open_well

   subroutine test_harmonic(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper

      call open_well(stepper, .true., 0.5_wp, 0.1_wp, 1000, error)
      if (.not. allocated(error)) call run_conserving(stepper, 1.0_wp, error)
      if (.not. allocated(error)) call check_near(error, stepper%march%ledger%angular, 0.5_wp, &
         32000.0_wp*eps, 1.0_wp, "angular momentum")
      call stepper_close(stepper)
   end subroutine test_harmonic

   subroutine test_kepler(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper

      call open_well(stepper, .false., 0.8_wp, 0.02_wp, 1000, error)
      ! Near the centre, at r = 0.47, the terms of the energy are 1/r.
      if (.not. allocated(error)) call run_conserving(stepper, 2.5_wp, error)
      call stepper_close(stepper)
   end subroutine test_kepler

   !> On the circle r = 1 at the speed 1: half a turn, the error is of order h^2.
   subroutine test_order(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: pi = acos(-1.0_wp)
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      real(wp) :: off(3), order
      integer :: k, n

      do k = 1, 3
         n = 20*2**k
         stepper = stepper_t()
         call open_well(stepper, .false., 1.0_wp, pi/real(n, wp), n, error)
         do while (.not. allocated(error))
            if (stepper_is_done(stepper)) exit
            call stepper_advance(stepper, increment, error)
         end do
         if (allocated(error)) return
         off(k) = norm2(stepper%march%state%u(:, 1) - [-2.0_wp, 0.0_wp])
         call stepper_close(stepper)
      end do
      do k = 1, 2
         order = log(off(k)/off(k + 1))/log(2.0_wp)
         call check_near(error, order, 2.0_wp, 0.1_wp, 1.0_wp, "order")
      end do
   end subroutine test_order

   !> A well on all nodes of an elastic block of the library.
   subroutine test_with_elements(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: block
      type(stepper_t) :: stepper
      type(well_t) :: well
      type(node_potential_t) :: potential
      integer :: i

      call make_block(scene, "CPE4", [2, 2], block)
      call add_step(scene, .false., 0.05_wp, 100)
      scene%v0(1, :) = 1.0_wp
      well%n_variable = 2
      call node_potential_init(potential, "WELL", [(i, i = 1, 9)], 9, well, error)
      if (.not. allocated(error)) call open_given(stepper, scene, potential, 0.0_wp, error)
      if (.not. allocated(error)) call run_conserving(stepper, stepper%march%ledger%total, error)
      if (allocated(error)) return
      call check_true(error, stepper%march%ledger%strain > 1.0e-3_wp, "strained")
      call check_true(error, stepper%march%ledger%potential > 1.0e-3_wp, "in the well")
      call stepper_close(stepper)
   end subroutine test_with_elements

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
         time = stepper%march%state%time
         call stepper_advance(stepper, increment, raised)
      end do
      call check_error(error, raised, merge(err_input, err_analysis, way == 1), text, "way " // &
         to_text(way))
      if (ends_at > 1) then
         call check_near(error, stepper%march%state%u, u, 0.0_wp, 1.0_wp, "the state stays")
         call check_near(error, stepper%march%state%time, time, 0.0_wp, 1.0_wp, "time stays")
      end if
      call stepper_close(stepper)
   end subroutine expect_failure

   subroutine test_patterns(error)
      type(error_t), allocatable, intent(out) :: error
      type(chain_host_t) :: chain, bad
      type(scene_t) :: scene

      call make_line(scene, 3, .false., 0.1_wp, 100)
      call chain_host_init(chain, [1, 2, 3], 4, error)
      if (allocated(error)) return
      call refuse(chain, "has 8 rows and 8 columns, not those of 2 freedoms for each of 3 nodes")
      call chain_host_init(chain, [1, 2, 3], 3, error)
      bad = chain
      bad%pattern%column(1) = 6
      call refuse(bad, "column 6 in row 1 is not in 0..5")
      bad = chain
      bad%pattern%column(1:2) = chain%pattern%column([2, 1])
      call refuse(bad, "column 0 in row 1")
      bad = chain
      bad%pattern%row_start(7) = 5
      call refuse(bad, "its row starts run from 0 to 5, not from 0 to 7")
      bad = chain
      bad%pattern%row_start(3) = 7
      call refuse(bad, "row 3 ends before it begins")
      bad = chain
      deallocate(bad%pattern%column)
      call refuse(bad, "has no rows")
      bad = chain
      bad%pattern%row_start = [0, 7]
      call refuse(bad, "has 2 row starts, not 7")

   contains

      subroutine refuse(host, text)
         type(chain_host_t), intent(in) :: host
         character(len=*), intent(in) :: text
         type(stepper_t) :: stepper
         type(error_t), allocatable :: raised

         stepper%scene = scene
         stepper%is_read = .true.
         call stepper_give_force(stepper, host, raised)
         call check_error(error, raised, err_input, text, "pattern")
         call check_true(error, .not. allocated(stepper%given%force), "nothing was given")
      end subroutine refuse

   end subroutine test_patterns

   subroutine test_mass(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(csr_t) :: mass, bad
      integer, allocatable :: slot(:)

      call make_line(scene, 2, .false., 0.1_wp, 100)
      call csr_from_elements(mass, 2, [1, 3], [1, 2], slot, error)
      if (allocated(error)) return
      mass%value = [2.0_dp, 1.0_dp, 1.0_dp, 2.0_dp]
      call refuse(mass, "")
      bad = mass
      bad%value(2) = 1.5_dp
      call refuse(bad, "between nodes 10 and 20 is not that of the other way round: 1.5, 1")
      bad = mass
      bad%value(4) = -2.0_dp
      call refuse(bad, "between nodes 10 and 20 is larger than")
      bad%value(2:3) = 0.0_dp
      call refuse(bad, "between nodes 20 and 20 is negative")
      bad%value(1) = real(ieee_value(1.0_wp, ieee_quiet_nan), dp)
      call refuse(bad, "is not finite")
      deallocate(bad%value)
      call refuse(bad, "has no values")
      call lump(bad, 3, 1.0_wp)
      call refuse(bad, "has 3 rows and 3 columns, not those of 2 nodes")

   contains

      subroutine refuse(matrix, text)
         type(csr_t), intent(in) :: matrix
         character(len=*), intent(in) :: text
         type(stepper_t) :: stepper
         type(error_t), allocatable :: raised

         stepper%scene = scene
         stepper%is_read = .true.
         call stepper_give_mass(stepper, matrix, raised)
         if (text == "") then
            call check_true(error, .not. allocated(raised), "a good mass")
         else
            call check_error(error, raised, err_input, text, "mass")
         end if
      end subroutine refuse

   end subroutine test_mass

   subroutine test_order_of_calls(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(stepper_t) :: empty, massless, stepper
      type(chain_host_t) :: chain
      type(csr_t) :: mass

      call make_line(scene, 2, .false., 0.1_wp, 100)
      call chain_host_init(chain, [1, 2], 2, error)
      if (allocated(error)) return
      call stepper_give_force(empty, chain, raised)
      call check_error(error, raised, err_input, "no deck was read", "before reading")
      empty%scene = scene
      empty%is_read = .true.
      call stepper_build(empty, raised)
      call check_error(error, raised, err_input, "no elements, and no forces", "nothing at all")
      empty%scene%given_node = [1, 2]
      call stepper_build(empty, raised)
      call check_error(error, raised, err_input, "no forces were given", "nothing given")
      call open_given(massless, scene, chain, 0.0_wp, raised)
      call check_error(error, raised, err_input, "node 10 has given forces but no mass", "no mass")
      scene%given_node = [1, 2]
      call open_given(stepper, scene, chain, 1.0_wp, error)
      if (allocated(error)) return
      call stepper_give_force(stepper, chain, raised)
      call check_error(error, raised, err_input, "before the model is built", "after building")
      call lump(mass, 2, 1.0_wp)
      call stepper_give_mass(stepper, mass, raised)
      call check_error(error, raised, err_input, "before the model is built", "after building")
      call stepper_close(stepper)
   end subroutine test_order_of_calls

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

end module test_given_force
