!> Potentials of the position of nodes: wells, alone and on the elements of the library.
module test_node_potential
   use check, only : check_error, check_near, check_true, test_case_t
   use emcon_csr, only : csr_find
   use emcon_errors, only : err_input, error_t
   use emcon_host_force, only : force_response_t
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t
   use emcon_node_potential, only : node_potential_init, node_potential_t
   use emcon_scene, only : scene_t
   use emcon_stepper, only : stepper_advance, stepper_close, stepper_is_done, stepper_t
   use given_hosts, only : well_t
   use given_scenes, only : eps => given_eps, make_line, open_given, run_conserving
   use small_scenes, only : add_step, block_t, make_block, shake
   implicit none
   private
   public :: collect_node_potential

contains

   subroutine collect_node_potential(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("harmonic well", test_harmonic), &
         test_case_t("centre of gravity", test_kepler), &
         test_case_t("order in h", test_order), &
         test_case_t("a force on elements", test_with_elements), &
         test_case_t("forces and tangents of some nodes", test_respond), &
         test_case_t("wrong nodes, wrong functions", test_wrong)]
   end subroutine collect_node_potential

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
      call node_potential_init(potential, "WELL", [1], 2, 1, well, error)
      if (.not. allocated(error)) call open_given(stepper, scene, potential, 1.0_wp, error)
   end subroutine open_well

   subroutine test_harmonic(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper

      call open_well(stepper, .true., 0.5_wp, 0.1_wp, 1000, error)
      if (.not. allocated(error)) call run_conserving(stepper, 1.0_wp, error)
      if (.not. allocated(error)) call check_near(error, stepper%march%ledger%angular(1), 0.5_wp, &
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
         n = merge(20, 8, precision(off) >= 15)*2**k
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
      call node_potential_init(potential, "WELL", [(i, i = 1, 9)], 2, 9, well, error)
      if (.not. allocated(error)) call open_given(stepper, scene, potential, 0.0_wp, error)
      if (.not. allocated(error)) call run_conserving(stepper, stepper%march%ledger%total, error)
      if (allocated(error)) return
      call check_true(error, stepper%march%ledger%strain > 1.0e-3_wp, "strained")
      call check_true(error, stepper%march%ledger%potential > 1.0e-3_wp, "in the well")
      call stepper_close(stepper)
   end subroutine test_with_elements

   !> Nodes 4 and 2 of four: the force on each does the work of its own change of potential, its
   !> derivative is that by differences and stands in the rows of the node; others have none.
   subroutine test_respond(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: x(2, 4) = reshape([1.0_wp, 0.0_wp, 0.5_wp, 1.0_wp, 2.0_wp, 2.0_wp, &
         -1.0_wp, 0.75_wp], [2, 4]), step = epsilon(1.0_wp)**(1.0_wp/3.0_wp)
      integer, parameter :: node(2) = [4, 2]
      type(well_t) :: well
      type(node_potential_t) :: potential
      type(force_response_t) :: response, up, down
      real(wp) :: u0(2, 4), du(2, 4), near(2, 4), after, slope(2, 4), r(2)
      integer :: a, b, i, k, kind, slot

      do kind = 1, 2
         well = well_t(k=3.0_wp, is_harmonic=kind == 1)
         well%n_variable = 2
         call node_potential_init(potential, "WELL", node, 2, 4, well, error)
         if (allocated(error)) return
         call potential%place(x)
         call shake(u0, 0.1_wp)
         call shake(du, 0.3_wp)
         call respond(du, response)
         after = 0.0_wp
         do i = 1, 2
            r = [norm2(x(:, node(i)) + u0(:, node(i))), norm2(x(:, node(i)) + u0(:, node(i)) &
               + du(:, node(i)))]
            if (kind == 1) r = 1.5_wp*r**2
            if (kind == 2) r = -3.0_wp/r
            call check_near(error, sum(response%force(:, node(i))*du(:, node(i))), r(2) - r(1), &
               64.0_wp*eps, 3.0_wp, "work")
            after = after + r(2)
         end do
         call check_near(error, response%energy, after, 64.0_wp*eps, 3.0_wp, "energy")
         call check_near(error, response%magnitude, abs(response%force), 0.0_wp, 1.0_wp, "sizes")
         call check_near(error, response%force(:, [1, 3]), reshape(spread(0.0_wp, 1, 4), [2, 2]), &
            0.0_wp, 1.0_wp, "other nodes")
         do k = 1, 4
            do b = 1, 2
               near = du
               near(b, k) = du(b, k) + step
               call respond(near, up)
               near(b, k) = du(b, k) - step
               call respond(near, down)
               slope = (up%force - down%force)/(2.0_wp*step)
               do i = 1, 4
                  do a = 1, 2
                     slot = csr_find(potential%pattern, 2*(i - 1) + a, 2*(k - 1) + b)
                     call check_true(error, (slot > 0) .eqv. (i == k .and. any(node == k)), "place")
                     if (slot == 0) cycle
                     call check_near(error, real(response%tangent(slot), wp), slope(a, i), &
                        100.0_wp*step**2, 3.0_wp, "derivative")
                  end do
               end do
            end do
         end do
         if (allocated(error)) return
      end do

   contains

      subroutine respond(way, given)
         real(wp), intent(in), contiguous :: way(:, :)
         type(force_response_t), intent(out) :: given

         allocate(given%force(2, 4), given%magnitude(2, 4), source=0.0_wp)
         allocate(given%tangent(size(potential%pattern%column)), source=0.0_dp)
         call potential%respond(u0, way, .true., given)
      end subroutine respond

   end subroutine test_respond

   subroutine test_wrong(error)
      type(error_t), allocatable, intent(out) :: error
      type(well_t) :: well

      call refuse("is a function of 0 variables, not of the 2", [1])
      well%n_variable = 2
      well%weight = [1.0_wp]
      call refuse("needs 2 weights above 0", [1])
      well%weight = [1.0_wp, 0.0_wp]
      call refuse("needs 2 weights above 0", [1])
      deallocate(well%weight)
      call refuse("the potential WELL names node 4, which is not in 1..3", [1, 4])
      call refuse("names node 0, which is not in 1..3", [0])
      call refuse("names node 2 twice", [2, 3, 2])

   contains

      subroutine refuse(text, node)
         character(len=*), intent(in) :: text
         integer, intent(in) :: node(:)
         type(node_potential_t) :: potential
         type(error_t), allocatable :: raised

         call node_potential_init(potential, "WELL", node, 2, 3, well, raised)
         call check_error(error, raised, err_input, text, "potential")
      end subroutine refuse

   end subroutine test_wrong

end module test_node_potential
