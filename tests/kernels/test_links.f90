!> Marches of scenes with linear constraints: energy, momenta, reactions, messages, units.
module test_links
   use check, only : check_error, check_near, check_true, test_case_t
   use emcon_amplitudes, only : amplitude_t
   use emcon_errors, only : err_input, error_t
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_t
   use emcon_scene, only : scene_t
   use emcon_steps, only : initiation_velocity_update, load_point, load_t, method_null_space, &
      method_saddle_point
   use emcon_text, only : notes_t, to_text
   use linear_scenes, only : add_equation, add_node, add_tie_by_hand
   use small_scenes, only : add_block, add_load, add_step, block_node, block_t, clamp, &
      make_block, make_two_blocks, prescribe, scene_begin, young
   implicit none
   private
   public :: collect_links

   integer, parameter :: methods(2) = [method_null_space, method_saddle_point]
   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> Of energies and solutions, as in the tests of the march.
   real(wp), parameter :: tol = 450.0_wp*eps

contains

   subroutine collect_links(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("energy and momenta of tied blocks", test_free), &
         test_case_t("driven motion that others follow", test_driven), &
         test_case_t("reaction of a reference node", test_reference), &
         test_case_t("a load on a reference node", test_loaded), &
         test_case_t("contact of dependent nodes", test_contact), &
         test_case_t("velocity update keeps the constraints", test_velocity_update), &
         test_case_t("contradictions", test_contradiction), &
         test_case_t("redundant constraints", test_redundant), &
         test_case_t("the start follows the constraints", test_start), &
         test_case_t("units and repetition: the same bits", test_bits)]
   end subroutine collect_links

   subroutine begin(scene, march, error)
      type(scene_t), intent(in) :: scene
      type(march_t), intent(inout) :: march
      type(error_t), allocatable, intent(out) :: error

      call march_init(march, scene, error)
      if (allocated(error)) return
      call march_begin_step(march, scene, 1, error)
   end subroutine begin

   !> Two blocks, one on the other, unlike meshes: each node of the upper block's bottom lies
   !> between two of the lower block's top.
   subroutine make_tied(scene, lower, upper)
      type(scene_t), intent(out) :: scene
      type(block_t), intent(out) :: lower, upper
      integer :: k, slave(4), master(2, 4), i
      real(wp) :: weight(2, 4)

      call scene_begin(scene)
      call add_block(scene, "CPE4", [2, 1], [0.0_wp, -1.0_wp], [3.0_wp, 1.0_wp], lower)
      call add_block(scene, "CPE4", [3, 1], [0.0_wp, 0.0_wp], [3.0_wp, 1.0_wp], upper)
      do k = 1, 4
         i = min(1, (k - 1)/2)
         slave(k) = block_node(upper, k - 1, 0)
         master(:, k) = [block_node(lower, i, 1), block_node(lower, i + 1, 1)]
         weight(2, k) = (scene%x(1, slave(k)) - 1.5_wp*i)/1.5_wp
         weight(1, k) = 1.0_wp - weight(2, k)
      end do
      call add_tie_by_hand(scene, slave, master, weight, [0.5_wp, 1.0_wp, 1.0_wp, 0.5_wp])
   end subroutine make_tied

   !> Largest sum that should vanish, over all used rows, of displacements and of velocities.
   pure subroutine measure_rows(march, in_u, in_v)
      type(march_t), intent(in) :: march
      real(wp), intent(out) :: in_u, in_v
      real(wp) :: total(2)
      integer :: k, s, node, a

      in_u = 0.0_wp
      in_v = 0.0_wp
      associate (linear => march%system%space%linear)
         do k = 1, linear%n
            if (.not. linear%is_used(k)) cycle
            total = 0.0_wp
            do s = linear%start(k) + 1, linear%start(k + 1)
               node = (linear%dof(s) + 1)/2
               a = 2 - mod(linear%dof(s), 2)
               total = total + linear%weight(s)*[march%state%u(a, node), march%state%v(a, node)]
            end do
            in_u = max(in_u, abs(total(1)))
            in_v = max(in_v, abs(total(2)))
         end do
      end associate
   end subroutine measure_rows

   !> The constraints hold. A velocity is a difference of displacements over the step's size.
   subroutine check_rows(error, march, h, what)
      type(error_t), allocatable, intent(inout) :: error
      type(march_t), intent(in) :: march
      real(wp), intent(in) :: h
      character(len=*), intent(in) :: what
      real(wp) :: in_u, in_v

      call measure_rows(march, in_u, in_v)
      call check_near(error, in_u, 0.0_wp, 64.0_wp*eps, 1.0_wp + maxval(abs(march%state%u)), &
         "displacements fulfil the rows, " // what)
      call check_near(error, in_v, 0.0_wp, tol, maxval(abs(march%state%v)) + 1.0_wp/h, &
         "velocities fulfil the rows, " // what)
   end subroutine check_rows

   !> Tied blocks that spin, fly and swing.
   subroutine test_free(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      integer :: m

      do m = 1, 2
         call make_tied(scene, lower, upper)
         call add_step(scene, .false., 0.05_wp, 40)
         scene%step(1)%contact%method = methods(m)
         scene%v0(1, :) = 1.0_wp - 2.0_wp*scene%x(2, :)
         scene%v0(2, :) = 2.0_wp*scene%x(1, :)*(1.0_wp + 0.25_wp*scene%x(2, :))
         call run_free()
         if (allocated(error)) return
      end do

   contains

      subroutine run_free()
         type(march_t) :: march
         type(increment_t) :: increment
         real(wp) :: total, momentum(3)
         integer :: k

         call begin(scene, march, error)
         if (allocated(error)) return
         total = march%ledger%total
         momentum = [march%ledger%momentum, march%ledger%angular]
         do k = 1, 40
            call march_increment(march, scene, increment, error)
            if (allocated(error)) return
            call check_near(error, march%ledger%total, total, tol, total, "energy")
            call check_near(error, [march%ledger%momentum, march%ledger%angular], momentum, tol, &
               maxval(abs(momentum)), "momenta")
            call check_rows(error, march, 0.05_wp, to_text(m))
            if (allocated(error)) return
         end do
         call check_true(error, march%ledger%strain > 1.0e-3_wp*total, "it swings")
         call march_free(march)
      end subroutine run_free

   end subroutine test_free

   !> The lower block's top left corner, a master node, and a bare node that half of the upper
   !> block's top follows, are shaken: kinetic + strain - work stands.
   subroutine test_driven(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      integer :: m, bare

      do m = 1, 2
         call make_tied(scene, lower, upper)
         call add_node(scene, [4.0_wp, 1.0_wp], bare)
         call add_equation(scene, [block_node(upper, 2, 1), bare], [1, 1], [1.0_wp, -1.0_wp])
         call add_equation(scene, [block_node(upper, 3, 1), bare, block_node(upper, 0, 1)], &
            [1, 1, 2], [1.0_wp, -0.5_wp, 0.25_wp])
         call add_step(scene, .false., 0.02_wp, 40)
         scene%step(1)%contact%method = methods(m)
         call prescribe(scene%step(1), block_node(lower, 0, 1), 1, 0.2_wp)
         call prescribe(scene%step(1), block_node(lower, 0, 1), 2, -0.1_wp)
         call prescribe(scene%step(1), bare, 1, 0.3_wp)
         deallocate(scene%amplitude)
         allocate(scene%amplitude(1))
         scene%amplitude(1) = amplitude_t(name="A", time=[0.0_wp, 0.3_wp, 0.6_wp], &
            value=[0.0_wp, 1.0_wp, -0.5_wp])
         scene%step(1)%prescribed%amplitude = 1
         call run_driven()
         if (allocated(error)) return
      end do

   contains

      subroutine run_driven()
         type(march_t) :: march
         type(increment_t) :: increment
         real(wp) :: largest, drift
         integer :: k

         call begin(scene, march, error)
         if (allocated(error)) return
         largest = 0.0_wp
         drift = 0.0_wp
         do k = 1, 40
            call march_increment(march, scene, increment, error)
            if (allocated(error)) return
            largest = max(largest, march%ledger%kinetic + march%ledger%strain)
            drift = max(drift, abs(march%ledger%total))
            call check_rows(error, march, 0.02_wp, to_text(m))
            if (allocated(error)) return
         end do
         call check_true(error, largest > 1.0_wp, "it is shaken")
         call check_near(error, drift, 0.0_wp, tol, largest, "total of method " // to_text(m))
         call march_free(march)
      end subroutine run_driven

   end subroutine test_driven

   !> A block whose right side is moved in x and y: `bare` > 0, by a reference node.
   subroutine make_pulled(is_static, with_bare, scene, side, bare)
      logical, intent(in) :: is_static, with_bare
      type(scene_t), intent(out) :: scene
      integer, intent(out) :: side(3), bare
      type(block_t) :: block
      integer :: k, a

      call make_block(scene, "CPE4", [2, 2], block)
      side = [(block_node(block, 2, k), k = 0, 2)]
      bare = 0
      if (with_bare) call add_node(scene, [5.0_wp, 5.0_wp], bare)
      call add_step(scene, is_static, 0.25_wp, 4)
      call clamp(scene%step(1), [(block_node(block, 0, k), k = 0, 2)])
      do a = 1, 2
         if (with_bare) call prescribe(scene%step(1), bare, a, 0.2_wp*a)
         do k = 1, 3
            if (with_bare) then
               call add_equation(scene, [side(k), bare], [a, a], [1.0_wp, -1.0_wp])
            else
               call prescribe(scene%step(1), side(k), a, 0.2_wp*a)
            end if
         end do
      end do
      deallocate(scene%amplitude)
      allocate(scene%amplitude(1))
      scene%amplitude(1) = amplitude_t(name="A", time=[0.0_wp, 1.0_wp], value=[0.0_wp, 1.0_wp])
      scene%step(1)%prescribed%amplitude = 1
   end subroutine make_pulled

   !> All four increments of `scene`.
   subroutine run_all(scene, march, error)
      type(scene_t), intent(in) :: scene
      type(march_t), intent(inout) :: march
      type(error_t), allocatable, intent(out) :: error
      type(increment_t) :: increment
      integer :: k

      call begin(scene, march, error)
      if (allocated(error)) return
      do k = 1, 4
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
      end do
   end subroutine run_all

   !> It is the sum of the reactions that the nodes would have, were they prescribed themselves; so
   !> is its work, and the motion is the same.
   subroutine test_reference(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene, direct
      integer :: side(3), bare, k, m, none

      do k = 1, 2
         call make_pulled(k == 1, .false., direct, side, none)
         do m = 1, 2
            call make_pulled(k == 1, .true., scene, side, bare)
            scene%step(1)%contact%method = methods(m)
            call compare()
            if (allocated(error)) return
         end do
      end do

   contains

      subroutine compare()
         type(march_t) :: by_node, by_side
         character(len=:), allocatable :: text

         text = ", " // to_text(k) // ", method " // to_text(m)
         call run_all(scene, by_node, error)
         if (.not. allocated(error)) call run_all(direct, by_side, error)
         if (allocated(error)) return
         call check_near(error, by_node%state%reaction(:, bare), &
            sum(by_side%state%reaction(:, side), dim=2), tol, young, "reaction" // text)
         call check_true(error, maxval(abs(by_node%state%reaction(:, bare))) > 0.1_wp*young, &
            "there is one")
         call check_near(error, by_node%state%reaction(:, side), reshape([0.0_wp, 0.0_wp, 0.0_wp, &
            0.0_wp, 0.0_wp, 0.0_wp], [2, 3]), 0.0_wp, 1.0_wp, "none at those that follow" // text)
         call check_near(error, by_node%state%u(:, :9), by_side%state%u, tol, 1.0_wp, "u" // text)
         call check_near(error, by_node%state%v(:, :9), by_side%state%v, tol, 4.0_wp, "v" // text)
         call check_near(error, by_node%ledger%external_work, by_side%ledger%external_work, tol, &
            young, "work" // text)
         call march_free(by_node)
         call march_free(by_side)
      end subroutine compare

   end subroutine test_reference

   !> The load that is the reaction of the driven node gives its displacement; its y is left out.
   subroutine test_loaded(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: driven
      type(load_t) :: load
      integer :: side(3), bare, m

      call make_pulled(.true., .true., scene, side, bare)
      scene%step(1)%prescribed(8)%value = 0.0_wp
      call run_all(scene, driven, error)
      if (allocated(error)) return
      load%kind = load_point
      load%target = bare
      load%place = 1
      load%value = driven%state%reaction(1, bare)
      call add_load(scene%step(1), load)
      scene%step(1)%prescribed = scene%step(1)%prescribed([1, 2, 3, 4, 5, 6, 8])
      do m = 1, 2
         scene%step(1)%contact%method = methods(m)
         call run_loaded()
         if (allocated(error)) return
      end do
      call march_free(driven)

   contains

      subroutine run_loaded()
         type(march_t) :: loaded

         call run_all(scene, loaded, error)
         if (allocated(error)) return
         call check_near(error, loaded%state%u(:, bare), [0.2_wp, 0.0_wp], tol, 1.0_wp, &
            "reference node, method " // to_text(m))
         call check_near(error, loaded%state%u, driven%state%u, tol, 1.0_wp, "displacements")
         call check_near(error, loaded%state%reaction(1, bare), 0.0_wp, 0.0_wp, 1.0_wp, &
            "no reaction where nothing is prescribed")
         call march_free(loaded)
      end subroutine run_loaded

   end subroutine test_loaded

   !> A block falls on another one; a slave node follows its neighbours, so does a master node.
   subroutine make_impact(scene, m)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: m
      type(block_t) :: lower, upper
      integer :: a

      call make_two_blocks(scene, 0.0625_wp, lower, upper)
      do a = 1, 2
         call add_equation(scene, [block_node(upper, 1, 0), block_node(upper, 0, 0), &
            block_node(upper, 2, 0)], [a, a, a], [2.0_wp, -1.0_wp, -1.0_wp])
         call add_equation(scene, [block_node(lower, 2, 1), block_node(lower, 1, 1), &
            block_node(lower, 3, 1)], [a, a, a], [2.0_wp, -1.0_wp, -1.0_wp])
      end do
      call add_step(scene, .false., 0.02_wp, 25)
      scene%step(1)%contact%method = methods(m)
      scene%v0(2, upper%nodes_before + 1:) = -1.0_wp
   end subroutine make_impact

   !> Energy and momenta in both methods, which agree.
   subroutine test_contact(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      real(wp), allocatable :: u(:, :)
      integer :: m

      do m = 1, 2
         call make_impact(scene, m)
         call run_impact()
         if (allocated(error)) return
      end do

   contains

      subroutine run_impact()
         type(march_t) :: march
         type(increment_t) :: increment
         real(wp) :: total, momentum(3), largest
         integer :: k

         call begin(scene, march, error)
         if (allocated(error)) return
         total = march%ledger%total
         momentum = [march%ledger%momentum, march%ledger%angular]
         largest = 0.0_wp
         do k = 1, 25
            call march_increment(march, scene, increment, error)
            if (allocated(error)) return
            largest = max(largest, maxval(march%state%contact))
            call check_near(error, march%ledger%total, total, tol, total, "energy")
            call check_near(error, [march%ledger%momentum, march%ledger%angular], momentum, tol, &
               maxval(abs(momentum)), "momenta")
            call check_rows(error, march, 0.02_wp, to_text(m))
            if (allocated(error)) return
         end do
         call check_true(error, largest > 1.0_wp, "there is contact")
         ! Two solutions of a motion that doubles differences every few increments.
         if (m == 2) call check_near(error, march%state%u, u, 100.0_wp*tol, 1.0_wp, "methods agree")
         u = march%state%u
         call march_free(march)
      end subroutine run_impact

   end subroutine test_contact

   subroutine test_velocity_update(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      integer :: m

      do m = 1, 2
         call make_impact(scene, m)
         scene%step(1)%contact%initiation = initiation_velocity_update
         call run_update()
         if (allocated(error)) return
      end do

   contains

      subroutine run_update()
         type(march_t) :: march
         type(increment_t) :: increment
         integer :: k, i
         logical :: has_jumped

         call begin(scene, march, error)
         if (allocated(error)) return
         has_jumped = .false.
         do k = 1, 15
            increment%notes = notes_t()
            call march_increment(march, scene, increment, error)
            if (allocated(error)) return
            do i = 1, increment%notes%n
               has_jumped = has_jumped .or. index(increment%notes%item(i)%text, "restores") > 0
            end do
            call check_rows(error, march, 0.02_wp, "increment " // to_text(k))
            if (allocated(error)) return
         end do
         call check_true(error, has_jumped, "the velocity was updated")
         call march_free(march)
      end subroutine run_update

   end subroutine test_velocity_update

   !> Both sides of a tie, or all terms of an equation, prescribed against each other.
   subroutine test_contradiction(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      integer :: side(3), bare, m

      do m = 1, 2
         call make_pulled(.true., .true., scene, side, bare)
         scene%step(1)%contact%method = methods(m)
         call prescribe(scene%step(1), side(2), 1, 0.2_wp)
         scene%step(1)%prescribed(9)%amplitude = 1
         call try()
         call check_true(error, .not. allocated(raised), "the same motion does not contradict")
         scene%step(1)%prescribed(9)%value = 0.2_wp*(1.0_wp + 1.0e-5_wp)
         call try()
         call check_error(error, raised, err_input, "*EQUATION 2 contradicts", "another value")
         call check_error(error, raised, err_input, "nodes 6, 10", "another value")
         scene%step(1)%prescribed(9)%value = 0.2_wp
         scene%step(1)%prescribed(9)%amplitude = 0
         call try()
         call check_error(error, raised, err_input, "*EQUATION 2 contradicts", "another amplitude")
         if (allocated(error)) return
      end do

   contains

      subroutine try()
         type(march_t) :: march

         call begin(scene, march, raised)
         call march_free(march)
      end subroutine try

   end subroutine test_contradiction

   !> An equation twice, times three: left out and named, once; nothing else changes.
   subroutine test_redundant(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      integer :: side(3), bare, m
      real(wp), allocatable :: u(:, :)

      do m = 1, 2
         call make_pulled(.true., .true., scene, side, bare)
         scene%step(1)%contact%method = methods(m)
         call run_redundant(.false.)
         if (allocated(error)) return
         call add_equation(scene, [bare, side(2)], [1, 1], [-3.0_wp, 3.0_wp])
         call add_equation(scene, [side(1), side(3)], [2, 2], [0.5_wp, -0.5_wp])
         call run_redundant(.true.)
         if (allocated(error)) return
      end do

   contains

      subroutine run_redundant(is_expected)
         logical, intent(in) :: is_expected
         type(march_t) :: march

         call run_all(scene, march, error)
         if (allocated(error)) return
         if (is_expected) then
            call check_true(error, march%system%notes%n == 1, "one note")
            if (allocated(error)) return
            call check_true(error, index(march%system%notes%item(1)%text, &
               "*EQUATION 7 follows from other constraints: left out (such equations: 2)") > 0, &
               "the first one is named: " // march%system%notes%item(1)%text)
            call check_near(error, march%state%u, u, tol, 1.0_wp, "displacements")
         else
            call check_true(error, march%system%notes%n == 0, "no note")
            u = march%state%u
         end if
         call march_free(march)
      end subroutine run_redundant

   end subroutine test_redundant

   !> Velocities of a deck that do not fit: those of dependent nodes follow, and a note tells.
   subroutine test_start(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(march_t) :: march
      integer :: pass

      call make_tied(scene, lower, upper)
      call add_step(scene, .false., 0.05_wp, 1)
      do pass = 1, 2
         ! What fits up to the rounding of a deck is taken as it is meant.
         scene%v0(1, :) = 1.0_wp
         scene%v0(1, block_node(upper, 1, 0)) = merge(1.5_wp, 1.0_wp + 1.0e-7_wp, pass == 1)
         call begin(scene, march, error)
         if (allocated(error)) return
         call check_near(error, march%state%v, spread([1.0_wp, 0.0_wp], 2, 14), 4.0_wp*eps, &
            1.0_wp, "velocities")
         call check_true(error, march%system%notes%n == merge(1, 0, pass == 1), "notes")
         if (allocated(error)) return
         if (pass == 1) call check_true(error, index(march%system%notes%item(1)%text, &
            "velocity at the start") > 0 .and. index(march%system%notes%item(1)%text, &
            "at node 8") > 0, "note: " // march%system%notes%item(1)%text)
         call march_free(march)
         deallocate(march%end_state%v)
         call reset(march)
      end do

   contains

      subroutine reset(march)
         type(march_t), intent(out) :: march

         march%grid%n_grid = 0
      end subroutine reset

   end subroutine test_start

   !> Lengths times 8, masses times 32: the same bits, and again without.
   subroutine test_bits(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      real(wp), allocatable :: u(:, :), v(:, :)
      integer :: m, k

      do m = 1, 2
         do k = 1, 3
            call make_impact(scene, m)
            if (k == 2) call change_units(scene)
            call run_bits(merge(8.0_wp, 1.0_wp, k == 2))
            if (allocated(error)) return
         end do
      end do

   contains

      subroutine change_units(scene)
         type(scene_t), intent(inout) :: scene

         scene%x = 8.0_wp*scene%x
         scene%v0 = 8.0_wp*scene%v0
         scene%section%thickness = 8.0_wp*scene%section%thickness
         scene%material(1)%constant(1) = scene%material(1)%constant(1)*32.0_wp/8.0_wp
         scene%material(1)%density = scene%material(1)%density*32.0_wp/8.0_wp**3
      end subroutine change_units

      subroutine run_bits(factor)
         real(wp), intent(in) :: factor
         type(march_t) :: march
         type(increment_t) :: increment
         integer :: i, n_closed

         call begin(scene, march, error)
         if (allocated(error)) return
         n_closed = 0
         do i = 1, 12
            call march_increment(march, scene, increment, error)
            if (allocated(error)) return
            n_closed = n_closed + increment%n_active
         end do
         if (k == 1) then
            u = march%state%u
            v = march%state%v
            call check_true(error, n_closed > 0, "there is contact")
         else
            call check_near(error, march%state%u, factor*u, 0.0_wp, 1.0_wp, "displacements")
            call check_near(error, march%state%v, factor*v, 0.0_wp, 1.0_wp, "velocities")
         end if
         call march_free(march)
      end subroutine run_bits

   end subroutine test_bits

end module test_links
