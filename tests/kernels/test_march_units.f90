!> Steps with contact in other units of length, time and mass: with powers of two every number is
!> the same but for these, to the last bit, in the same iterations.
module test_march_units
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : formulation_mortar, formulation_nts, formulation_segment, &
      smoothing_hermite
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_t
   use emcon_rigid_bodies, only : rigid_frame_choose
   use emcon_scene, only : scene_t
   use emcon_scheme_registry, only : scheme_row
   use emcon_steps, only : load_gravity, load_t, initiation_massless, initiation_persistent, &
      initiation_velocity_update, &
      method_augmented_lagrange, method_penalty
   use emcon_text, only : to_text
   use small_scenes, only : add_load, add_step, block_t, clamp, make_two_blocks, prescribe, young
   implicit none
   private
   public :: collect_march_units

   integer, parameter :: n_step = 24
   real(wp), parameter :: h = 0.02_wp
   !> Round-off over the steps, by stiffness over inertia in each.
   real(wp), parameter :: tol = 1.0e5_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> norm2 of quadruple precision knows the units: round-off there.
   real(wp), parameter :: same = merge(0.0_wp, tol, digits(1.0_wp) == digits(1.0_dp))
   !> What a unit is of others: length, time and mass.
   type :: units_t
      real(wp) :: length = 1.0_wp, time = 1.0_wp, mass = 1.0_wp
   end type units_t
   type(units_t), parameter :: other(2) = [units_t(2.0_wp**8, 2.0_wp**(-6), 2.0_wp**6), &
      units_t(2.0_wp**(-6), 2.0_wp**4, 2.0_wp**(-8))]
   !> What the scenes are.
   character(len=20), parameter :: name(20) = [character(len=20) :: "nodes that rub", &
      "mortar that rubs", "segments that rub", "both sides", "smoothed", "restitution", &
      "massless", "massless mortar", "penalty", "augmented", "damped", "velocities updated", &
      "sizes by the error", "ENERGYDECAYING", "TRAPEZOIDAL", "GENERALIZEDALPHA", "BDF2", &
      "CENTRALDIFFERENCE", "explicit penalty", "rigid"]
   !> Behind these statics, with and without viscous forces.
   integer, parameter :: n_scene = size(name) + 2

contains

   subroutine collect_march_units(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a block that is thrown on another one", test_thrown), &
         test_case_t("one that is pushed along another one in statics", test_pushed), &
         test_case_t("as a mirror shows them, to round-off", test_mirrored)]
   end subroutine collect_march_units

   subroutine test_thrown(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      do k = 1, size(name)
         call compare(k, trim(name(k)), error)
         if (allocated(error)) return
      end do
   end subroutine test_thrown

   subroutine test_pushed(error)
      type(error_t), allocatable, intent(out) :: error

      integer :: k

      do k = size(name) + 1, n_scene
         call compare(k, "statics " // to_text(k), error)
         if (allocated(error)) return
      end do
   end subroutine test_pushed

   !> To the left as to the right.
   subroutine test_mirrored(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene, mirrored
      integer :: k, i

      do k = 1, n_scene
         call make(scene, k, units_t())
         mirrored = scene
         mirrored%x(1, :) = -scene%x(1, :)
         mirrored%step(1)%load%direction(1) = -scene%step(1)%load%direction(1)
         mirrored%v0(1, :) = -scene%v0(1, :)
         mirrored%element%node = scene%element%node([2, 1, 4, 3], :)
         associate (held => mirrored%step(1)%prescribed)
            do i = 1, size(held)
               if (held(i)%dof == 1) held(i)%value = -held(i)%value
            end do
         end associate
         block
            type(march_t) :: march, again
            type(increment_t) :: increment, as_well

            call march_init(march, scene, error)
            if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
            if (.not. allocated(error)) call march_init(again, mirrored, error)
            if (.not. allocated(error)) call march_begin_step(again, mirrored, 1, error)
            do i = 1, n_step
               if (.not. allocated(error)) call march_increment(march, scene, increment, error)
               if (.not. allocated(error)) call march_increment(again, mirrored, as_well, error)
               if (allocated(error)) return
               call check_equal(error, as_well%n_active, increment%n_active, "what acts, scene " &
                  // to_text(k))
               associate (one => march%state, two => again%state)
                  call check_near(error, [-two%u(1, :), two%u(2, :)], [one%u(1, :), one%u(2, :)], &
                     tol, 1.0_wp, "displacements, scene " // to_text(k))
                  call check_near(error, [-two%contact(1, :), two%contact(2, :)], &
                     [one%contact(1, :), one%contact(2, :)], tol, young, "contact, scene " &
                     // to_text(k))
               end associate
               if (allocated(error)) return
            end do
            call march_free(march)
            call march_free(again)
         end block
      end do
   end subroutine test_mirrored

   !> Scene `k` in units `unit`: lengths over lengths of that, and so on.
   subroutine make(scene, k, unit)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: k
      type(units_t), intent(in) :: unit
      type(block_t) :: lower, upper
      type(load_t) :: weight
      logical :: is_static
      integer :: i

      is_static = k > size(name)
      call make_two_blocks(scene, merge(0.0_wp, 0.07_wp, is_static), lower, upper)
      scene%x = unit%length*scene%x
      associate (step_length => unit%length, pair => scene%pair(1))
         pair%interaction%friction = merge(0.2_wp, 0.0_wp, is_static .or. any(k == [1, 2, 3, 6, &
            11, 20]))
         if (any(k == [2, 8])) pair%formulation = formulation_mortar
         if (k == 3) pair%formulation = formulation_segment
         if (k == 6) pair%interaction%restitution = 0.5_wp
         if (k == 6) pair%interaction%rebound = 0.5_wp
         if (k == 11) then
            pair%interaction%damping%coefficient = unit%mass/(unit%length**2*unit%time)
            pair%interaction%damping%clearance = 0.1_wp*step_length
         end if
         pair%both_sides = k == 4
      end associate
      call add_step(scene, is_static, h*unit%time, n_step)
      associate (step => scene%step(1))
         step%contact%initiation = merge(initiation_massless, initiation_persistent, any(k &
            == [7, 8]))
         if (k >= 14 .and. k <= 18) step%scheme = scheme_row("DYNAMIC", trim(name(k)))
         if (k == 19) step%scheme = scheme_row("DYNAMIC", "CENTRALDIFFERENCE")
         if (k == n_scene) step%stabilization = 0.01_wp
         if (k == 12) step%contact%initiation = initiation_velocity_update
         if (k == 5) step%contact%options%smoothing = smoothing_hermite
         if (any(k == [9, 19])) step%contact%method = method_penalty
         if (k == 10) step%contact%method = method_augmented_lagrange
         step%time%is_direct = k /= 13
         if (k == 13) step%time%tolerance = 1.0e-3_wp
         if (k == 13) step%time%event_fraction = 0.01_wp
         call clamp(step, [(i, i = 1, 5)])
         do i = 14, 16
            if (is_static) call prescribe(step, i, 2, -0.05_wp*unit%length)
            if (is_static) call prescribe(step, i, 1, 0.06_wp*unit%length)
         end do
      end associate
      weight%kind = load_gravity
      weight%direction(:2) = [0.6_wp, -0.8_wp]
      weight%value = unit%length/unit%time**2
      do i = 1, size(scene%element%kind)
         weight%target = i
         call add_load(scene%step(1), weight)
      end do
      if (k == 20) call make_rigid(scene, upper, unit%length)
      if (.not. is_static) scene%v0(1, 11:) = 0.3_wp*unit%length/unit%time
      if (.not. is_static) scene%v0(2, 11:) = -unit%length/unit%time
      scene%section%thickness = unit%length*scene%section%thickness
      scene%material%density = unit%mass/unit%length**3*scene%material%density
      scene%material(1)%constant(1) = unit%mass/(unit%length*unit%time**2)*young
   end subroutine make

   !> Let the upper block be rigid.
   subroutine make_rigid(scene, upper, length)
      type(scene_t), intent(inout) :: scene
      type(block_t), intent(in) :: upper
      real(wp), intent(in) :: length             !! of the unit
      integer :: i

      deallocate(scene%rigid)
      allocate(scene%rigid(1))
      associate (body => scene%rigid(1))
         body%name = "UPPER"
         body%reference = 11
         body%element = upper%elements_before + [1, 2]
         body%node = [(i, i = 11, 16)]
         ! Of a rectangle two corners are as good: in one unit, that rounding chooses the same.
         call rigid_frame_choose(scene%x/length, body%node, body%reference, body%frame)
      end associate
   end subroutine make_rigid

   subroutine compare(k, what, error)
      integer, intent(in) :: k
      character(len=*), intent(in) :: what
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene, scaled
      integer :: j

      call make(scene, k, units_t())
      do j = 1, size(other)
         call make(scaled, k, other(j))
         block
            type(march_t) :: march, again
            type(increment_t) :: increment, as_well
            integer :: i, n_active

            call march_init(march, scene, error)
            if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
            if (.not. allocated(error)) call march_init(again, scaled, error)
            if (.not. allocated(error)) call march_begin_step(again, scaled, 1, error)
            n_active = 0
            do i = 1, n_step
               if (.not. allocated(error)) call march_increment(march, scene, increment, error)
               if (.not. allocated(error)) call march_increment(again, scaled, as_well, error)
               if (allocated(error)) return
               n_active = max(n_active, increment%n_active)
               call check_equal(error, [as_well%n_newton, as_well%n_active, as_well%n_cut], &
                  [increment%n_newton, increment%n_active, increment%n_cut], what // ": counts")
               call check_state(error, march, again, other(j), what // ", increment " // to_text(i))
               call check_books(error, march, what)
               call check_told(error, increment, as_well, other(j), what)
               if (allocated(error)) return
            end do
            call check_true(error, n_active > 1, what // ": contact")
            call march_free(march)
            call march_free(again)
         end block
      end do
   end subroutine compare

   subroutine check_state(error, march, again, unit, what)
      type(error_t), allocatable, intent(inout) :: error
      type(march_t), intent(in) :: march, again
      type(units_t), intent(in) :: unit
      character(len=*), intent(in) :: what

      associate (one => march%state, two => again%state, &
            force => unit%mass*unit%length/unit%time**2, &
            speed => unit%length/unit%time)
         call check_near(error, two%u/unit%length, one%u, same, 1.0_wp, what // ": displacements")
         call check_near(error, two%v/speed, one%v, same, 1.0_wp, what // ": velocities")
         call check_near(error, two%contact/force, one%contact, same, 1.0_wp, what // ": contact")
         call check_near(error, two%reaction/force, one%reaction, same, 1.0_wp, what &
            // ": reactions")
         call check_near(error, two%clock%time/unit%time, one%clock%time, same, 1.0_wp, what &
            // ": time")
      end associate
      associate (one => march%ledger, two => again%ledger, energy => unit%mass*unit%length**2 &
            /unit%time**2)
         call check_near(error, [two%kinetic, two%total, two%external_work, two%contact_work, &
            two%friction, two%restitution, two%contact_damping, two%contact_energy]/energy, &
            [one%kinetic, one%total, one%external_work, one%contact_work, one%friction, &
            one%restitution, one%contact_damping, one%contact_energy], same, 1.0_wp, what &
            // ": ledger")
         call check_near(error, [two%momentum/unit%length, two%angular/unit%length**2]*unit%time &
            /unit%mass, [one%momentum, one%angular], same, 1.0_wp, what // ": momenta")
      end associate
   end subroutine check_state

   !> What pairs take is what the ledger has of them.
   subroutine check_books(error, march, what)
      type(error_t), allocatable, intent(inout) :: error
      type(march_t), intent(in) :: march
      character(len=*), intent(in) :: what

      associate (sums => march%state%sums%sum, ledger => march%ledger)
         call check_near(error, sum(sums%friction), ledger%friction, tol, ledger%friction, what &
            // ": friction of pairs")
         call check_near(error, sum(sums%damping), ledger%contact_damping, tol, &
            ledger%contact_damping, what // ": damping of pairs")
      end associate
   end subroutine check_books

   subroutine check_told(error, one, two, unit, what)
      type(error_t), allocatable, intent(inout) :: error
      type(increment_t), intent(in) :: one, two
      type(units_t), intent(in) :: unit
      character(len=*), intent(in) :: what

      associate (force => unit%mass*unit%length/unit%time**2)
         call check_near(error, [two%give, two%overlap%depth, two%overlap%of_facets, &
            two%stand_off%largest, two%unconverged], [one%give, one%overlap%depth, &
            one%overlap%of_facets, one%stand_off%largest, one%unconverged], same, 1.0_wp, what &
            // ": ratios")
         call check_near(error, [two%law_missed, two%largest_push, two%nodal_pull%pull, &
            two%nodal_pull%force, two%stand_off%impulse/unit%time]/force, [one%law_missed, &
            one%largest_push, one%nodal_pull%pull, one%nodal_pull%force, one%stand_off%impulse], &
            same, 1.0_wp, what // ": forces told")
         ! norm2 knows the units.
         call check_near(error, two%work_scale/(force*unit%length), one%work_scale, &
            8.0_wp*epsilon(1.0_wp), one%work_scale, what // ": what works are made of")
         call check_near(error, two%residual, one%residual, same, 1.0_wp, what // ": residuals")
      end associate
   end subroutine check_told

end module test_march_units
