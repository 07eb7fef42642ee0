!> Stress that is told of elements that stretch and turn as a whole: that of their forces, by the
!> virial of a hexahedron, for every kind of element, law and kinematics.
module test_stress
   use check, only : check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_at_end
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_of, motion_t
   use emcon_solid, only : solid_t
   use emcon_stepper, only : stepper_build, stepper_close, stepper_t
   use emcon_stress, only : element_means, nodal_stress, von_mises
   use emcon_system, only : system_find_energy, system_respond, system_tangent_times
   use emcon_term, only : role_internal
   use emcon_term_registry, only : terms_solid
   use emcon_text, only : to_text
   use one_element, only : n_law, read_one
   use small_scenes, only : shake
   implicit none
   private
   public :: collect_stress

   !> Solves of elements with modes inside, and stresses of the size 100.
   real(wp), parameter :: tol = 1.0e4_wp*epsilon(1.0_wp), stress_size = 100.0_wp
   !> In the plane: strain, stress; rings; in space.
   character(len=6), parameter :: plane(7) = [character(len=6) :: "CPE3", "CPE4", "CPE4H", &
      "CPE4I", "CPE6", "CPE8", "CPE8R"], thin(5) = [character(len=6) :: "CPS3", "CPS4", "CPS4I", &
      "CPS6", "CPS8"], ring(5) = [character(len=6) :: "CAX3", "CAX4", "CAX6", "CAX8", "CAX8R"], &
      space(6) = [character(len=6) :: "C3D4", "C3D8H", "C3D8I", "C3D10", "C3D20", "C3D20R"]
   real(wp), parameter :: one(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
      0.0_wp, 0.0_wp, 1.0_wp], [3, 3])

contains

   subroutine collect_stress(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("all elements and laws, large strains", test_large), &
         test_case_t("small strains, and in frames that turn", test_small), &
         test_case_t("far from where it began", test_far), &
         test_case_t("where motions end tells what is inverted, not their way", test_ends), &
         test_case_t("von Mises", test_von_mises)]
   end subroutine collect_stress

   !> Where the nodes are moved to by `grad` x, but for a ring's first direction.
   pure function moved(grad, x) result(u)
      real(wp), intent(in) :: grad(3, 3), x(:, :)
      real(wp) :: u(size(x, 1), size(x, 2))

      u = matmul(grad(:size(x, 1), :size(x, 1)), x)
   end function moved

   !> Sum of force times place over the volume: Cauchy stress, or without `is_large` that of small
   !> strains.
   subroutine virial(stepper, grad, is_large, stress)
      type(stepper_t), intent(inout), target :: stepper
      real(wp), intent(in) :: grad(3, 3)
      logical, intent(in) :: is_large
      real(wp), intent(out) :: stress(3, 3)
      type(solid_t), pointer :: solid
      real(wp), dimension(6, 1) :: mean, strain
      real(wp) :: volume(1), change
      real(wp), allocatable :: u(:, :), place(:, :)

      solid => terms_solid(stepper%march%system%term)
      associate (x => stepper%scene%x, system => stepper%march%system)
         u = moved(grad, x)
         call system_respond(system, motion_of(evaluation_at_end, x, u, 0.0_wp*u), .false.)
         call element_means(solid, u, 1.0_wp, mean, strain, volume)
         place = x
         if (is_large) place = x + u
         change = 1.0_wp
         if (is_large) change = determinant(one + grad)
         stress = matmul(system%response%part(role_internal)%force, transpose(place)) &
            /(volume(1)*change)
      end associate
   end subroutine virial

   pure real(wp) function determinant(f)
      real(wp), intent(in) :: f(3, 3)

      determinant = f(1, 1)*(f(2, 2)*f(3, 3) - f(2, 3)*f(3, 2)) - f(1, 2)*(f(2, 1)*f(3, 3) &
         - f(2, 3)*f(3, 1)) + f(1, 3)*(f(2, 1)*f(3, 2) - f(2, 2)*f(3, 1))
   end function determinant

   !> (xx, yy, zz, xy, yz, xz)
   pure function in_list(stress) result(list)
      real(wp), intent(in) :: stress(3, 3)
      real(wp) :: list(6)

      list = [stress(1, 1), stress(2, 2), stress(3, 3), stress(1, 2), stress(2, 3), stress(1, 3)]
   end function in_list

   !> At all nodes, and as means of the element, with its strain and volume.
   subroutine check_stress(error, stepper, grad, expected, what)
      type(error_t), allocatable, intent(inout) :: error
      type(stepper_t), intent(inout), target :: stepper
      real(wp), intent(in) :: grad(3, 3), expected(3, 3)
      character(len=*), intent(in) :: what
      type(solid_t), pointer :: solid
      real(wp), allocatable :: u(:, :), stress(:, :)
      real(wp) :: mean(6, 1), strain(3*size(stepper%scene%x, 1) - 3, 1), volume(1)
      integer :: i

      solid => terms_solid(stepper%march%system%term)
      u = moved(grad, stepper%scene%x)
      allocate(stress(6, size(u, 2)))
      call nodal_stress(solid, u, 1.0_wp, stress)
      do i = 1, size(u, 2)
         call check_near(error, stress(:, i), in_list(expected), tol, stress_size, what // ", node")
      end do
      call element_means(solid, u, 1.0_wp, mean, strain, volume)
      call check_near(error, mean(:, 1), in_list(expected), tol, stress_size, what // ", mean")
      if (what(:3) /= "CAX" .and. index(what, "COROTATED") == 0) call check_strain(error, grad, &
         index(what, "LINEAR") == 0, strain(:, 1), what)
      call check_sizes(error, stepper, u, what)
      call check_derivatives(error, stepper, u, what)
   end subroutine check_stress

   !> E11, E22 and 2 E12, in space E11 to E33 and twice the shears; of large strains Green's.
   subroutine check_strain(error, grad, is_large, strain, what)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in) :: grad(3, 3), strain(:)
      logical, intent(in) :: is_large
      character(len=*), intent(in) :: what
      real(wp) :: green(3, 3), expected(6)

      green = grad + transpose(grad)
      if (is_large) green = green + matmul(transpose(grad), grad)
      expected = in_list(green)
      expected(:3) = 0.5_wp*expected(:3)
      if (size(strain) == 3) expected(3) = green(1, 2)
      call check_near(error, strain, expected(:size(strain)), tol, 1.0_wp, what // ", strain")
   end subroutine check_strain

   !> The energy changes by the forces and these by the tangent, along a random way: differences of
   !> second order in a step of eps^(1/3).
   subroutine check_derivatives(error, stepper, u, what)
      type(error_t), allocatable, intent(inout) :: error
      type(stepper_t), intent(inout) :: stepper
      real(wp), intent(in), contiguous :: u(:, :)
      character(len=*), intent(in) :: what
      real(wp), parameter :: step = epsilon(1.0_wp)**(1.0_wp/3.0_wp)
      real(wp), dimension(size(u, 1), size(u, 2)) :: way, product, force
      real(wp), dimension(size(u, 1), size(u, 2), -1:1) :: forces
      real(wp) :: energy(-1:1)
      integer :: i

      call shake(way, 1.0_wp)
      associate (system => stepper%march%system)
         do i = -1, 1
            call system_respond(system, motion_at(i*step), .false.)
            forces(:, :, i) = system%response%part(role_internal)%force
            call system_find_energy(system, motion_at(i*step))
            energy(i) = sum(system%response%energy)
         end do
         call system_respond(system, motion_at(0.0_wp), .true.)
         call system_tangent_times(system, motion_at(0.0_wp), way, product)
      end associate
      force = forces(:, :, 0)
      call check_near(error, (energy(1) - energy(-1))/(2.0_wp*step), sum(force*way), &
         1.0e3_wp*step**2, stress_size + maxval(abs(force)), what // ", energy")
      call check_near(error, (forces(:, :, 1) - forces(:, :, -1))/(2.0_wp*step), product, &
         1.0e3_wp*step**2, stress_size + maxval(abs(product)), what // ", tangent")

   contains

      type(motion_t) function motion_at(share) result(motion)
         real(wp), intent(in) :: share

         motion = motion_of(evaluation_at_end, stepper%scene%x, u, share*way)
      end function motion_at

   end subroutine check_derivatives

   !> Sizes of forces are sums of their parts before these cancel; what displacements are rounded by
   !> makes forces of that size by the stiffness of the element.
   subroutine check_sizes(error, stepper, u, what)
      type(error_t), allocatable, intent(inout) :: error
      type(stepper_t), intent(inout) :: stepper
      real(wp), intent(in), contiguous :: u(:, :)
      character(len=*), intent(in) :: what

      associate (system => stepper%march%system, response => stepper%march%system%response)
         call system_respond(system, motion_of(evaluation_at_end, stepper%scene%x, u, 0.0_wp*u), &
            .false.)
         associate (part => response%part(role_internal))
            call check_true(error, all(part%magnitude >= abs(part%force)*(1.0_wp - tol)), &
               what // ", sizes")
            call check_true(error, sum(part%magnitude) <= 40.0_wp*sum(abs(part%force)), &
               what // ", of the same order")
         end associate
         call check_true(error, all(response%rounding > 0.0_wp) .and. &
            all(response%rounding < 1.0e3_wp*stress_size), what // ", rounding")
      end associate
   end subroutine check_sizes

   !> A model of one element that nothing holds.
   subroutine open_one(kind, law, kinematics, stepper, error)
      character(len=*), intent(in) :: kind, kinematics
      integer, intent(in) :: law
      type(stepper_t), intent(inout) :: stepper
      type(error_t), allocatable, intent(out) :: error

      call read_one(kind, law, kinematics, stepper, error)
      if (.not. allocated(error)) call stepper_build(stepper, error)
   end subroutine open_one

   ! ---- tests ----------------------------------------------------------------------------------

   subroutine test_large(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: reference
      integer :: law, k
      real(wp), parameter :: grad(3, 3) = reshape([0.2_wp, 0.15_wp, -0.1_wp, -0.25_wp, -0.1_wp, &
         0.05_wp, 0.12_wp, -0.08_wp, 0.1_wp], [3, 3])
      real(wp), dimension(3, 3) :: flat, round, free

      flat = 0.0_wp
      flat(:2, :2) = grad(:2, :2)
      ! A ring stays one: the radius grows by a factor.
      round = 0.0_wp
      round(:2, 1) = grad(:2, 1)
      round(2, 2) = grad(2, 2)
      round(3, 3) = grad(1, 1)
      do law = 1, n_law
         call open_one("C3D8", law, "NONLINEAR", reference, error)
         do k = 1, size(space)
            if (.not. allocated(error)) call compare(space(k), grad, grad)
         end do
         do k = 1, size(plane)
            if (.not. allocated(error)) call compare(plane(k), flat, flat)
         end do
         do k = 1, size(ring)
            if (.not. allocated(error)) call compare(ring(k), round, round)
         end do
         if (allocated(error)) return
         ! Ogden's law is not known in plane stress.
         if (law < n_law) then
            free = free_across(flat)
            do k = 1, size(thin)
               if (.not. allocated(error)) call compare(thin(k), flat, free)
            end do
         end if
         call stepper_close(reference)
         block
            type(stepper_t) :: next

            reference = next
         end block
      end do

   contains

      subroutine compare(kind, own, whole)
         character(len=*), intent(in) :: kind
         real(wp), intent(in) :: own(3, 3), whole(3, 3)
         type(stepper_t) :: stepper
         real(wp) :: expected(3, 3)

         call virial(reference, whole, .true., expected)
         call open_one(kind, law, "NONLINEAR", stepper, error)
         if (allocated(error)) return
         call check_stress(error, stepper, own, expected, trim(kind) // ", law " // to_text(law))
         call stepper_close(stepper)
      end subroutine compare

      !> The stretch across at which no stress is there, by halving.
      function free_across(flat) result(whole)
         real(wp), intent(in) :: flat(3, 3)
         real(wp) :: whole(3, 3), low, high, stress(3, 3)
         integer :: i

         whole = flat
         low = -0.5_wp
         high = 0.5_wp
         do i = 1, digits(low) + 2
            whole(3, 3) = 0.5_wp*(low + high)
            call virial(reference, whole, .true., stress)
            if (stress(3, 3) > 0.0_wp) high = whole(3, 3)
            if (.not. stress(3, 3) > 0.0_wp) low = whole(3, 3)
         end do
      end function free_across

   end subroutine test_large

   !> Small strains of a gradient of any size, and the same strain in a frame that has turned.
   subroutine test_small(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: strain(3, 3) = reshape([0.2_wp, 0.05_wp, 0.0_wp, 0.05_wp, -0.1_wp, &
         0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], [3, 3])
      real(wp), parameter :: turn(3, 3) = reshape([0.6_wp, 0.8_wp, 0.0_wp, -0.8_wp, 0.6_wp, &
         0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
      type(stepper_t) :: reference
      real(wp) :: stress(3, 3)
      integer :: k

      call open_one("C3D8", 2, "LINEAR", reference, error)
      if (allocated(error)) return
      call virial(reference, strain, .false., stress)
      do k = 1, size(plane)
         if (.not. allocated(error)) call compare("LINEAR", strain, stress)
         if (.not. allocated(error)) call compare("COROTATED", matmul(turn, one + strain) - one, &
            matmul(turn, matmul(stress, transpose(turn))))
      end do
      call stepper_close(reference)

   contains

      subroutine compare(kinematics, grad, expected)
         character(len=*), intent(in) :: kinematics
         real(wp), intent(in) :: grad(3, 3), expected(3, 3)
         type(stepper_t) :: stepper

         call open_one(plane(k), 2, kinematics, stepper, error)
         if (allocated(error)) return
         call check_stress(error, stepper, grad, expected, trim(plane(k)) // ", " // kinematics)
         call stepper_close(stepper)
      end subroutine compare

   end subroutine test_small

   !> Displacements of half of the digits and a way that takes the other half: elements in frames
   !> and those of space see what is between their nodes, of which no digit is lost.
   subroutine test_far(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: way = 2.0_wp**nint(0.5_wp*digits(1.0_wp)), least = 16.0_wp/way
      integer :: k

      do k = 1, size(plane)
         if (.not. allocated(error)) call look_at(plane(k), "COROTATED")
      end do
      do k = 1, size(space)
         if (.not. allocated(error)) call look_at(space(k), "NONLINEAR")
      end do

   contains

      subroutine look_at(kind, kinematics)
         character(len=*), intent(in) :: kind, kinematics
         type(stepper_t), target :: stepper
         type(solid_t), pointer :: solid
         real(wp), allocatable :: u(:, :)
         real(wp) :: near(6, 1), far(6, 1), volume(1)
         real(wp), allocatable :: strain(:, :)

         call open_one(kind, 2, kinematics, stepper, error)
         if (allocated(error)) return
         allocate(u, source=stepper%scene%x)
         allocate(strain(3*size(u, 1) - 3, 1))
         call shake(u, 0.05_wp)
         u = least*anint(u/least)
         solid => terms_solid(stepper%march%system%term)
         call element_means(solid, u, 1.0_wp, near, strain, volume)
         call element_means(solid, u + way, 1.0_wp, far, strain, volume)
         call check_near(error, far, near, 64.0_wp*epsilon(1.0_wp), stress_size, trim(kind))
         call check_true(error, maxval(abs(near)) > 1.0e-3_wp*stress_size, "stress")
         call stepper_close(stepper)
      end subroutine look_at

   end subroutine test_far

   !> Random motions, many of them too large, made in one step and found as they are.
   subroutine test_ends(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      do k = 1, size(plane)
         if (.not. allocated(error)) call look_at(plane(k))
      end do
      do k = 1, size(thin)
         if (.not. allocated(error)) call look_at(thin(k))
      end do
      do k = 1, size(ring)
         if (.not. allocated(error)) call look_at(ring(k))
      end do
      do k = 1, size(space)
         if (.not. allocated(error)) call look_at(space(k))
      end do

   contains

      subroutine look_at(kind)
         character(len=*), intent(in) :: kind
         type(stepper_t) :: stepper
         real(wp), allocatable :: u(:, :), still(:, :)
         real(wp) :: energy
         logical :: is_inverted
         integer :: i, n_inverted

         call open_one(kind, 2, "NONLINEAR", stepper, error)
         if (allocated(error)) return
         n_inverted = 0
         allocate(u, still, source=0.0_wp*stepper%scene%x)
         associate (system => stepper%march%system, x => stepper%scene%x, &
               response => stepper%march%system%response)
            do i = 1, 30
               call shake(u, 0.05_wp*i)
               call system_respond(system, motion_of(evaluation_at_end, x, still, u), .false.)
               is_inverted = allocated(response%refusal)
               if (is_inverted) n_inverted = n_inverted + 1
               energy = sum(response%energy)
               call system_respond(system, motion_of(evaluation_at_end, x, u, still), .false.)
               call check_true(error, is_inverted .eqv. allocated(response%refusal), &
                  trim(kind) // ", motion " // to_text(i))
               if (is_inverted .or. allocated(error)) cycle
               call check_near(error, energy, sum(response%energy), tol, stress_size + energy, &
                  trim(kind) // ", energy of motion " // to_text(i))
            end do
         end associate
         call check_true(error, n_inverted > 1 .and. n_inverted < 30, trim(kind) // ": of 30 " &
            // to_text(n_inverted))
         call stepper_close(stepper)
      end subroutine look_at

   end subroutine test_ends

   !> Of one shear, one pull, and of a pressure that adds nothing.
   subroutine test_von_mises(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: k
      real(wp) :: s(6)

      do k = 1, 3
         s = -7.0_wp*[1.0_wp, 1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
         call check_near(error, von_mises(s), 0.0_wp, 0.0_wp, 1.0_wp, "pressure")
         s(k) = s(k) + 2.0_wp
         call check_near(error, von_mises(s), 2.0_wp, tol, 1.0_wp, "pull")
         s(k) = s(k) - 2.0_wp
         s(3 + k) = -2.0_wp
         call check_near(error, von_mises(s), 2.0_wp*sqrt(3.0_wp), tol, 1.0_wp, "shear")
      end do
   end subroutine test_von_mises

end module test_stress
