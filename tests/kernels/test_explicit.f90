!> Explicit steps: the critical step beside dense matrices, what closed penalties stiffen, and steps
!> of a block that penalties stop, whose pushes and momenta have closed forms.
module test_explicit
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_amplitudes, only : amplitude_t
   use emcon_condition_nodes, only : condition_resize
   use emcon_constraints, only : constraint_set_t, constraints_select
   use emcon_critical_step, only : critical_bound, critical_sharp
   use emcon_errors, only : err_analysis, err_input, error_t
   use emcon_explicit_penalty, only : explicit_penalty_limit, explicit_penalty_widen
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_eigen
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_t
   use emcon_node_potential, only : node_potential_init, node_potential_t
   use emcon_numbering, only : add_to_dofs, pick_unknowns
   use emcon_scene, only : scene_t
   use emcon_scheme_registry, only : scheme_row
   use emcon_penalty_law, only : penalty_t
   use emcon_stepper, only : stepper_advance, stepper_close, stepper_t
   use emcon_stepper_free, only : stepper_set_state
   use emcon_steps, only : load_point, load_pressure, load_t, method_penalty
   use emcon_system, only : mass_times, system_t, system_tangent_times
   use emcon_term_registry, only : terms_mass_values
   use given_hosts, only : well_t
   use given_scenes, only : make_line, open_given
   use linear_scenes, only : add_equation
   use small_scenes, only : add_load, add_step, block_t, clamp, make_block, make_two_blocks, shake
   use sparse_samples, only : dense_of
   implicit none
   private
   public :: collect_explicit

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   real(wp), parameter :: h = 0.01_wp, gap_start = 0.0327_wp
   !> Pressure by depth [M/(L T)^2].
   real(wp), parameter :: stiffness = 500.0_wp
   !> Nodes of the upper block's bottom and of the lower one's top, and the lengths that they have.
   integer, parameter :: slave(3) = [11, 12, 13], master(5) = [6, 7, 8, 9, 10]
   real(wp), parameter :: slave_length(3) = [0.5_wp, 1.0_wp, 0.5_wp]
   real(wp), parameter :: master_length(5) = [0.5_wp, 1.0_wp, 1.0_wp, 1.0_wp, 0.5_wp]

contains

   subroutine collect_explicit(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("critical step, by dense matrices", test_critical), &
         test_case_t("stiffness of closed pairs at nodes", test_limit), &
         test_case_t("contacts that stiffen more than any before", test_widen), &
         test_case_t("a block that penalties stop", test_drop), &
         test_case_t("closed contacts are met in a step", test_met), &
         test_case_t("the element that ends the run is named", test_squeezed), &
         test_case_t("the critical step is looked at now and then", test_looked_at), &
         test_case_t("central differences in a well, in closed form", test_well), &
         test_case_t("what is put elsewhere starts from there", test_put), &
         test_case_t("a pressure that follows its edge", test_pressure), &
         test_case_t("energy that grows a million times is told", test_growth), &
         test_case_t("nothing that vibrates", test_loose), &
         test_case_t("round a centre: what a potential stores is no growth", test_centre), &
         test_case_t("a force that begins at rest, on nodes that are linked", test_linked), &
         test_case_t("what has no mass is told", test_refused)]
   end subroutine collect_explicit

   !> The upper block falls on the lower one, which is clamped or free; central differences.
   subroutine begin(scene, is_clamped, march, error)
      type(scene_t), intent(out) :: scene
      logical, intent(in) :: is_clamped
      type(march_t), intent(inout) :: march
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: lower, upper
      integer :: i

      call make_two_blocks(scene, gap_start, lower, upper)
      call add_step(scene, .false., h, 40)
      scene%step(1)%scheme = scheme_row("DYNAMIC", "CENTRALDIFFERENCE")
      scene%step(1)%contact%method = method_penalty
      scene%step(1)%contact%penalty%stiffness = stiffness
      if (is_clamped) call clamp(scene%step(1), [(i, i = 1, 10)])
      scene%v0(2, 11:) = -1.0_wp
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
   end subroutine begin

   !> 2/sqrt of the largest eigenvalue of M^-1 (K + S + sum of k c c^T); the bound is below it, and
   !> is that of the fastest element and the stiffest node together.
   subroutine test_critical(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(constraint_set_t) :: closed
      real(wp) :: node_stiffness(16), limit, bound, sharp, alone
      integer :: k, element, other
      logical :: is_bounded

      call begin(scene, .true., march, error)
      if (allocated(error)) return
      node_stiffness = 0.0_wp
      call critical_bound(march%system, march%explicit%place, node_stiffness, alone, element, &
         is_bounded)
      node_stiffness([3, 12, 14]) = [1.0e6_wp, 300.0_wp, 150.0_wp]
      call make_closed(closed)
      do k = 1, 2
         if (k == 1) then
            call critical_sharp(march%system, march%explicit%place, node_stiffness, sharp, error)
         else
            call critical_sharp(march%system, march%explicit%place, node_stiffness, sharp, error, &
               closed)
         end if
         if (.not. allocated(error)) call by_dense(march%system, k == 2, limit, error)
         if (allocated(error)) return
         call check_near(error, sharp, limit, 1.0e-6_wp, limit, "the critical step")
         if (k == 1) call check_true(error, alone > sharp, "nodes stiffen")
      end do
      call critical_bound(march%system, march%explicit%place, node_stiffness, bound, other, &
         is_bounded)
      ! Of four elements of mass 1 around it in all: nodes 12 and 14 have 1/2 and 1/4.
      call check_near(error, 4.0_wp/bound**2, 4.0_wp/alone**2 + 600.0_wp, sqrt(eps), &
         4.0_wp/bound**2, "the bound")
      call check_true(error, is_bounded .and. element == other .and. element >= 1, "the element")
      call march_free(march)

   contains

      subroutine by_dense(system, has_closed, limit, error)
         type(system_t), intent(inout) :: system
         logical, intent(in) :: has_closed
         real(wp), intent(out) :: limit
         type(error_t), allocatable, intent(out) :: error
         real(dp), allocatable :: value(:), root(:, :), square(:)
         real(dp), dimension(system%space%numbering%n_unknown, &
            system%space%numbering%n_unknown) :: matrix, mass
         real(wp) :: way(2, 16), force(2, 16), q(system%space%numbering%n_unknown)
         integer :: i, j, n

         n = size(q)
         do i = 1, n
            q = 0.0_wp
            q(i) = 1.0_wp
            way = 0.0_wp
            call add_to_dofs(system%space%numbering, q, 1.0_wp, way)
            call system_tangent_times(system, march%explicit%place, way, force)
            force = force + spread(node_stiffness, 1, 2)*way
            if (has_closed) then
               do j = 1, closed%n
                  associate (item => closed%item(j))
                     force(:, item%node(:3)) = force(:, item%node(:3)) &
                        + closed%law(j)%row%stiffest()*sum(item%c(:, :3)*way(:, item%node(:3))) &
                        *item%c(:, :3)
                  end associate
               end do
            end if
            call pick_unknowns(system%space%numbering, force, q)
            matrix(:, i) = real(q, dp)
         end do
         call terms_mass_values(system%term, value)
         system%matrix%value = value
         mass = dense_of(system%matrix)
         call dense_eigen(mass, square, root, error)
         if (allocated(error)) return
         do i = 1, n
            root(:, i) = root(:, i)/sqrt(square(i))
         end do
         deallocate(square)
         matrix = matmul(transpose(root), matmul(matrix, root))
         deallocate(root)
         call dense_eigen(matrix, square, root, error)
         if (.not. allocated(error)) limit = 2.0_wp/sqrt(real(square(n), wp))
      end subroutine by_dense

   end subroutine test_critical

   !> Two conditions of random gradients over a node of the lower block, which is clamped, and two
   !> free ones.
   subroutine make_closed(closed)
      type(constraint_set_t), intent(inout) :: closed
      integer :: k

      call constraints_select(closed, [1, 2])
      do k = 1, 2
         call condition_resize(closed%item(k), 3)
         closed%item(k)%n_node = 3
         closed%item(k)%node(:3) = [7, 11, 11 + k]
         call shake(closed%item(k)%c, 1.0_wp)
         closed%item(k)%c = closed%item(k)%c + 2.0_wp
         allocate(closed%law(k)%row, source=penalty_t(stiffness=100.0_wp*real(k, wp)))
      end do
   end subroutine make_closed

   !> Slave nodes by their own length, master nodes by theirs; twice both where both surfaces move.
   subroutine test_limit(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: expected(16)
      integer :: k

      do k = 1, 2
         expected = 0.0_wp
         expected(slave) = stiffness*slave_length*real(k, wp)
         expected(master) = stiffness*master_length*real(k, wp)
         block
            type(scene_t) :: scene
            type(march_t) :: march

            call begin(scene, k == 1, march, error)
            if (allocated(error)) return
            call check_near(error, march%explicit%stiffness, expected, 16.0_wp*eps, stiffness, &
               "at nodes")
            call check_near(error, march%explicit%met, expected, 16.0_wp*eps, stiffness, &
               "the most so far")
            ! What slave nodes have is shared out by parts of the master surface.
            scene%x = 4.0_wp*scene%x
            call explicit_penalty_limit(march, scene)
            call check_near(error, march%explicit%stiffness, expected, 16.0_wp*eps, stiffness, &
               "of any size")
            call march_free(march)
         end block
         if (allocated(error)) return
      end do
   end subroutine test_limit

   !> A node is stiffened by k |c_i| times the sum of |c_j| over what moves. More than the most so
   !> far is told once, as a tenth more is then allowed.
   subroutine test_widen(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      real(wp) :: total(16), length(2)
      logical :: has_grown
      integer :: k

      call begin(scene, .true., march, error)
      if (allocated(error)) return
      associate (penalty => march%explicit%penalty(march%explicit%i_start), met => &
         march%explicit%met)
         call explicit_penalty_widen(march, has_grown)
         call check_true(error, .not. has_grown, "none is closed")
         call make_closed(penalty)
         total = 0.0_wp
         do k = 1, 2
            length = sqrt(sum(penalty%item(k)%c(:, 2:3)**2, 1))
            total(penalty%item(k)%node(2:3)) = total(penalty%item(k)%node(2:3)) &
               + penalty%law(k)%row%stiffest()*length*sum(length)
         end do
         met = total
         call explicit_penalty_widen(march, has_grown)
         call check_true(error, .not. has_grown, "as much as before")
         met(13) = 0.999_wp*total(13)
         met(12) = 2.0_wp*total(12)
         call explicit_penalty_widen(march, has_grown)
         call check_true(error, has_grown, "more than before")
         total = 1.1_wp*total
         total(12) = 2.0_wp/1.1_wp*total(12)
         call check_near(error, met, total, 16.0_wp*eps, maxval(total), "the most")
         met(13) = met(13)/1.11_wp
         march%active%penalty%is_at_ends = .false.
         call explicit_penalty_widen(march, has_grown)
         call check_true(error, .not. has_grown, "not of other steps")
      end associate
      call march_free(march)
   end subroutine test_widen

   !> Slave nodes are pushed by stiffness times length times depth where a step ends; the momentum
   !> changes by the mean of the pushes at both ends times h. What is stored comes back.
   subroutine test_drop(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      real(wp) :: before, momentum, push(3), scale, total, stored
      integer :: k, n_closed

      call begin(scene, .true., march, error)
      if (allocated(error)) return
      n_closed = 0
      before = 0.0_wp
      stored = 0.0_wp
      total = march%ledger%total
      scale = stiffness*gap_start
      do k = 1, 40
         momentum = march%ledger%momentum(2)
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         associate (state => march%state, ledger => march%ledger)
            push = stiffness*slave_length*max(0.0_wp, -gap_start - state%u(2, slave))
            call check_near(error, state%contact(2, slave), push, 64.0_wp*eps, scale, "pushes")
            call check_near(error, ledger%momentum(2) - momentum, 0.5_wp*h*(before + sum(push)), &
               64.0_wp*eps, abs(momentum) + 2.0_wp, "momentum")
            stored = max(stored, ledger%contact_energy)
            call check_near(error, ledger%contact_energy, 0.5_wp*sum(push**2 &
               /(stiffness*slave_length)), 256.0_wp*eps, total, "stored")
            call check_equal(error, increment%n_active, count(push > 0.0_wp), "closed contacts")
            if (allocated(error)) return
         end associate
         before = sum(push)
         if (before > 0.0_wp) n_closed = n_closed + 1
      end do
      call check_true(error, n_closed > 5 .and. .not. before > 0.0_wp, "it comes and goes")
      call check_true(error, stored > 0.01_wp*total, "penalties store")
      ! The step is a twentieth of the critical one: energy to its square, by what is stored.
      call check_near(error, march%ledger%total, total, 0.02_wp, total, "energy")
      call march_free(march)
   end subroutine test_drop

   !> As if no contact had been seen closed: the first ones lead to the critical step with them,
   !> above the bound for all that could close, below that of the blocks alone.
   subroutine test_met(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      real(wp) :: bound, alone
      integer :: k
      logical :: is_closed

      call begin(scene, .true., march, error)
      if (allocated(error)) return
      bound = march%state%explicit%critical_h
      march%explicit%met = 0.0_wp
      is_closed = .false.
      do k = 1, 10
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         ! What is closed at the end of an increment is so at the start of the next one.
         if (is_closed) exit
         call check_near(error, march%explicit%met, spread(0.0_wp, 1, 16), 0.0_wp, 1.0_wp, "none")
         is_closed = increment%n_active > 0
      end do
      call check_true(error, is_closed .and. all(march%explicit%met(slave) > 0.0_wp), "met")
      call critical_sharp(march%system, march%explicit%place, spread(0.0_wp, 1, 16), alone, error)
      if (allocated(error)) return
      call check_true(error, march%state%explicit%critical_h > bound .and. &
         march%state%explicit%critical_h < alone, "the critical step")
      call march_free(march)
   end subroutine test_met

   !> Two free blocks: at rest element 1 is the narrowest, but the upper block, of which element 5
   !> is narrower, is squeezed until the step is too long.
   subroutine test_squeezed(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: stopped
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      type(block_t) :: lower, upper
      integer :: k

      call make_two_blocks(scene, 5.0_wp, lower, upper)
      scene%pair = scene%pair(:0)
      call add_step(scene, .false., h, 100)
      scene%step(1)%scheme = scheme_row("DYNAMIC", "CENTRALDIFFERENCE")
      scene%x(1, [2, 7]) = scene%x(1, [2, 7]) - 0.1_wp
      scene%x(1, [11, 14]) = scene%x(1, [11, 14]) + 0.05_wp
      scene%v0(2, 11:13) = 3.0_wp
      scene%v0(2, 14:16) = -3.0_wp
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      ! Just below what the blocks at rest allow.
      scene%step(1)%time%h = 0.99_wp*march%state%explicit%critical_h
      call march_begin_step(march, scene, 1, error)
      do k = 1, 100
         if (allocated(error) .or. allocated(stopped)) exit
         call march_increment(march, scene, increment, stopped)
      end do
      if (allocated(error)) return
      call check_error(error, stopped, err_analysis, "(the fastest element is 5)", "squeezed")
      call march_free(march)
   end subroutine test_squeezed

   !> After 200 increments of the step: at rest the critical step of a free block is the one of its
   !> start. Of a step below the bound by elements nothing is found anew; one above is not taken.
   subroutine test_looked_at(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: stopped
      real(wp), parameter :: unknown = 100.0_wp
      type(scene_t) :: scene
      type(block_t) :: block
      type(march_t) :: march
      type(increment_t) :: increment
      real(wp) :: bound, sharp
      integer :: k, element
      logical :: is_bounded

      call make_block(scene, "CPE4", [2, 1], block)
      scene%x(1, [3, 6]) = scene%x(1, [3, 6]) - 0.25_wp
      call add_step(scene, .false., h, 400)
      scene%step(1)%scheme = scheme_row("DYNAMIC", "CENTRALDIFFERENCE")
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      call critical_bound(march%system, march%explicit%place, spread(0.0_wp, 1, 6), bound, &
         element, is_bounded)
      call check_near(error, march%state%explicit%critical_h, bound, 0.0_wp, 1.0_wp, "the bound")
      call critical_sharp(march%system, march%explicit%place, spread(0.0_wp, 1, 6), sharp, error)
      if (.not. allocated(error)) call check_true(error, sharp > 1.01_wp*bound, "a larger one")
      do k = 1, 4
         if (allocated(error)) return
         scene%step(1)%time%h = merge(0.5_wp*(bound + sharp), 0.9_wp*bound, k /= 2)
         march%state%clock%increment = 200
         march%state%clock%n_before = 0
         if (k == 3) march%state%clock%n_before = 200
         if (k == 4) march%state%clock%increment = 201
         march%state%explicit%critical_h = unknown
         march%state%explicit%critical_element = 0
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         associate (found => march%state%explicit)
            call check_near(error, found%critical_h, merge(sharp, unknown, k == 1), 1.0e-6_wp, &
               sharp, "the critical step")
            call check_equal(error, found%critical_element, merge(element, 0, k == 1), "of which")
         end associate
      end do
      scene%step(1)%time%h = 1.1_wp*sharp
      march%state%clock%increment = 200
      march%state%clock%n_before = 0
      call march_increment(march, scene, increment, stopped)
      call check_error(error, stopped, err_analysis, " is larger than the critical step ", "found")
      call check_equal(error, march%state%clock%increment, 200, "before the increment")
      call march_free(march)
   end subroutine test_looked_at

   !> A mass point at (1, 0) with the velocity (0, v) in a well about the origin.
   subroutine open_well(stepper, well, v, h, n, error)
      type(stepper_t), intent(inout) :: stepper
      type(well_t), intent(in) :: well
      real(wp), intent(in) :: v, h
      integer, intent(in) :: n                   !! steps
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(node_potential_t) :: potential

      call make_line(scene, 1, .false., h, n)
      scene%step(1)%scheme = scheme_row("DYNAMIC", "CENTRALDIFFERENCE")
      scene%v0(2, 1) = v
      call node_potential_init(potential, "WELL", [1], 2, 1, well, error)
      if (.not. allocated(error)) call open_given(stepper, scene, potential, 1.0_wp, error)
   end subroutine open_well

   !> x_n+1 - 2 x_n + x_n-1 = -h^2 k x_n: an oscillation of the phase phi in each step, with
   !> 2 cos phi = 2 - h^2 k. Velocities are differences over two steps.
   subroutine test_well(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: k = 2.0_wp, v = 0.5_wp, h = 0.3_wp
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      type(well_t) :: well
      real(wp) :: phi
      integer :: i

      well%k = k
      well%n_variable = 2
      phi = acos(1.0_wp - 0.5_wp*k*h**2)
      call open_well(stepper, well, v, h, 20, error)
      if (.not. allocated(error)) call check_near(error, &
         stepper%march%state%explicit%critical_h, 2.0_wp/sqrt(k), sqrt(eps), 1.0_wp, &
         "critical step")
      do i = 1, 20
         if (allocated(error)) return
         call stepper_advance(stepper, increment, error)
         if (allocated(error)) return
         call check_equal(error, increment%n_newton, 0, "nothing is solved")
         call check_near(error, increment%residual, [0.0_wp], 0.0_wp, 1.0_wp, "nothing is left")
         associate (state => stepper%march%state, ledger => stepper%march%ledger, &
               x => [cos(i*phi), v*h/sin(phi)*sin(i*phi)], &
               rate => [-sin(i*phi)*sin(phi)/h, v*cos(i*phi)])
            call check_near(error, state%u(:, 1), x - [1.0_wp, 0.0_wp], 256.0_wp*eps, 1.0_wp, &
               "places")
            call check_near(error, state%v(:, 1), rate, 256.0_wp*eps/h, 1.0_wp, "velocities")
            call check_near(error, [ledger%kinetic, ledger%potential], 0.5_wp*[sum(rate**2), &
               k*sum(x**2)], 512.0_wp*eps/h, 1.0_wp, "energies")
         end associate
      end do
      call stepper_close(stepper)
   end subroutine test_well

   !> After three increments at (2, 0), at rest: x = 2 cos(phi) of each increment from there on.
   subroutine test_put(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: k = 2.0_wp, h = 0.3_wp
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      type(well_t) :: well
      integer :: i

      well%k = k
      well%n_variable = 2
      call open_well(stepper, well, -0.5_wp, h, 20, error)
      do i = -2, 5
         if (i == 1 .and. .not. allocated(error)) call stepper_set_state(stepper, error, &
            u=reshape([1.0_wp, 0.0_wp], [2, 1]), v=reshape([0.0_wp, 0.0_wp], [2, 1]))
         if (.not. allocated(error)) call stepper_advance(stepper, increment, error)
         if (allocated(error)) return
         if (i > 0) call check_near(error, stepper%march%state%u(1, 1), 2.0_wp*cos(real(i, wp) &
            *acos(1.0_wp - 0.5_wp*k*h**2)) - 1.0_wp, 256.0_wp*eps, 1.0_wp, "places")
      end do
      call stepper_close(stepper)
   end subroutine test_put

   !> A pressure that follows the right edge of a block that spins: in each step the momentum
   !> changes by the mean of what it pushes with at the start and at the end.
   subroutine test_pressure(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: pressure = 3.0_wp
      type(scene_t) :: scene
      type(block_t) :: block
      type(march_t) :: march
      type(increment_t) :: increment
      type(load_t) :: load
      real(wp) :: push(2, 0:1), before(2)
      integer :: i

      call make_block(scene, "CPE4", [2, 1], block)
      call add_step(scene, .false., h, 20)
      scene%step(1)%scheme = scheme_row("DYNAMIC", "CENTRALDIFFERENCE")
      load%kind = load_pressure
      load%target = 2
      load%place = 2
      load%value = pressure
      call add_load(scene%step(1), load)
      scene%v0(1, :) = -2.0_wp*scene%x(2, :)
      scene%v0(2, :) = 2.0_wp*scene%x(1, :)
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      push(:, 1) = along_normal(scene%x)
      do i = 1, 20
         before = march%ledger%momentum
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         push(:, 0) = push(:, 1)
         push(:, 1) = along_normal(scene%x + march%state%u)
         call check_near(error, march%ledger%momentum - before, 0.5_wp*h*sum(push, 2), &
            256.0_wp*eps, 2.0_wp, "momentum")
      end do
      call check_true(error, abs(push(2, 1)) > 0.3_wp*pressure, "the edge has turned")
      call march_free(march)

   contains

      !> Into the edge from node 3 to node 6.
      pure function along_normal(place) result(force)
         real(wp), intent(in) :: place(2, 6)
         real(wp) :: force(2)

         force = pressure*[place(2, 3) - place(2, 6), place(1, 6) - place(1, 3)]
      end function along_normal

   end subroutine test_pressure

   !> At first there may be what there is; more than a million times what there may be ends the run.
   subroutine test_growth(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: growth(2) = [0.9e6_wp, 1.1e6_wp]
      type(error_t), allocatable :: stopped
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      type(well_t) :: well
      integer :: k

      well%k = 2.0_wp
      well%n_variable = 2
      call open_well(stepper, well, 0.5_wp, 0.03_wp, 20, error)
      if (.not. allocated(error)) call stepper_advance(stepper, increment, error)
      if (allocated(error)) return
      associate (state => stepper%march%state, ledger => stepper%march%ledger)
         call check_near(error, state%explicit%budget, ledger%kinetic + ledger%potential, &
            64.0_wp*eps, 1.0_wp, "as much as there is")
         do k = 1, 2
            state%explicit%budget = (ledger%kinetic + ledger%potential)/growth(k)
            call stepper_advance(stepper, increment, stopped)
            if (k == 1) call check_true(error, .not. allocated(stopped), "less than a million")
            if (k == 2) call check_error(error, stopped, err_analysis, &
               "grows without bound, its energy ", "more than a million")
            if (allocated(error)) return
         end do
      end associate
      call check_true(error, index(stopped%message, " is 1.10E+06 times what was put in; give a " &
         // "smaller increment") > 0, stopped%message)
      call stepper_close(stepper)
   end subroutine test_growth

   !> Without a force there is no critical step.
   subroutine test_loose(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper
      type(well_t) :: well
      real(wp) :: limit, bound
      integer :: element
      logical :: is_bounded

      well%k = 0.0_wp
      well%n_variable = 2
      call open_well(stepper, well, 0.5_wp, 0.3_wp, 20, error)
      if (allocated(error)) return
      limit = 7.0_wp
      call critical_sharp(stepper%march%system, stepper%march%explicit%place, [0.0_wp], limit, &
         error)
      if (allocated(error)) return
      bound = 7.0_wp
      call critical_bound(stepper%march%system, stepper%march%explicit%place, [0.0_wp], bound, &
         element, is_bounded)
      call check_near(error, [limit, bound, stepper%march%state%explicit%critical_h]/huge(limit), &
         spread(1.0_wp, 1, 3), 0.0_wp, 1.0_wp, "as large as can be")
      call check_true(error, element == 0 .and. .not. is_bounded, "what is given has no element")
      call stepper_close(stepper)
   end subroutine test_loose

   !> On a circle a potential -k/r has twice the kinetic energy, below 0; the momentum about the
   !> centre stays, as all forces point there.
   subroutine test_centre(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      type(well_t) :: well
      integer :: i

      well%is_harmonic = .false.
      well%n_variable = 2
      call open_well(stepper, well, 1.0_wp, 0.1_wp, 70, error)
      do i = 1, 70
         if (allocated(error)) return
         call stepper_advance(stepper, increment, error)
         if (allocated(error)) return
         call check_near(error, stepper%march%ledger%angular(1), 1.0_wp, 256.0_wp*eps, 1.0_wp, &
            "momentum about the centre")
         ! The error of the second order is a few times h^2 of it.
         call check_near(error, norm2(stepper%march%state%u(:, 1) + [1.0_wp, 0.0_wp]), 1.0_wp, &
            0.05_wp, 1.0_wp, "radius")
      end do
      call stepper_close(stepper)
   end subroutine test_centre

   !> Nothing moves in the first step, as the force is 0 at its start: at its end there is half of
   !> the impulse of the force there, shared by two nodes that move alike; the other half is of the
   !> next step.
   subroutine test_linked(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: tol = 1.0e3_wp*eps, pull = 8.0_wp
      type(scene_t) :: scene
      type(block_t) :: block
      type(march_t) :: march
      type(increment_t) :: increment
      type(load_t) :: load
      real(wp) :: impulse(2, 6)

      call make_block(scene, "CPE4", [2, 1], block)
      call add_equation(scene, [3, 6], [1, 1], [1.0_wp, -1.0_wp])
      call add_step(scene, .false., h, 4)
      scene%step(1)%scheme = scheme_row("DYNAMIC", "CENTRALDIFFERENCE")
      deallocate(scene%amplitude)
      allocate(scene%amplitude(1))
      scene%amplitude(1) = amplitude_t(name="A", time=[0.0_wp, 1.0_wp], value=[0.0_wp, 1.0_wp])
      load%kind = load_point
      load%target = 3
      load%place = 1
      load%value = pull
      load%amplitude = 1
      call add_load(scene%step(1), load)
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (.not. allocated(error)) call march_increment(march, scene, increment, error)
      if (allocated(error)) return
      call check_near(error, march%state%u, 0.0_wp*scene%x, 0.0_wp, 1.0_wp, "at rest")
      call mass_times(march%system, march%state%v, impulse)
      impulse(1, 3) = impulse(1, 3) + impulse(1, 6) - 0.5_wp*h*(h*pull)
      impulse(1, 6) = 0.0_wp
      call check_near(error, impulse, 0.0_wp*impulse, tol, h*h*pull, "impulse")
      call check_near(error, march%state%v(1, 3), march%state%v(1, 6), tol, h*h*pull, "alike")
      call check_true(error, march%state%v(1, 3) > 0.1_wp*h*h*pull, "to the right")
      call march_increment(march, scene, increment, error)
      if (allocated(error)) return
      call check_near(error, sum(march%ledger%momentum), 2.0_wp*h*(h*pull), tol, h*h*pull, &
         "two impulses, one of the middle and half of the end")
      call march_free(march)
   end subroutine test_linked

   !> A block of which the second element has no density: the nodes that are its alone.
   subroutine test_refused(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: refused
      type(scene_t) :: scene
      type(block_t) :: block
      type(march_t) :: march

      call make_block(scene, "CPE4", [2, 1], block)
      scene%material = [scene%material, scene%material]
      scene%material(2)%density = 0.0_wp
      scene%section = [scene%section, scene%section]
      scene%section(2)%material = 2
      scene%element%section = [1, 2]
      call add_step(scene, .false., h, 4)
      scene%step(1)%scheme = scheme_row("DYNAMIC", "CENTRALDIFFERENCE")
      call march_init(march, scene, error)
      if (allocated(error)) return
      call march_begin_step(march, scene, 1, refused)
      call check_error(error, refused, err_input, "node 3 has no mass: in an explicit step", &
         "no mass")
      call march_free(march)
   end subroutine test_refused

end module test_explicit
