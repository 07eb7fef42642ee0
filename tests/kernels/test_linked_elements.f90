!> Elements of every kind with pressures on all their faces, whose freedoms hang on each other by
!> equations: the matrix of the system against differences of its forces.
module test_linked_elements
   use check, only : check_near, check_true, test_case_t
   use emcon_csr, only : csr_multiply
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_at_end, evaluation_t, instant_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_of, motion_t
   use emcon_numbering, only : add_to_dofs, pick_unknowns, spread_dependent
   use emcon_scene, only : scene_t
   use emcon_scheme_energy_momentum, only : scheme_energy_momentum_t
   use emcon_solid, only : solid_t
   use emcon_stepper, only : stepper_build, stepper_close, stepper_t
   use emcon_system, only : mass_times, system_renew, system_respond, system_tangent_times, system_t
   use emcon_term, only : role_external, role_inertia
   use emcon_term_registry, only : terms_solid
   use one_element, only : read_one
   use random_draws, only : draw_random
   use small_scenes, only : shake
   implicit none
   private
   public :: collect_linked_elements

   !> Forces are of this size.
   real(wp), parameter :: force_size = 100.0_wp
   real(wp), parameter :: rounding = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   character(len=6), parameter :: plane(12) = [character(len=6) :: "CPE3", "CPE4", "CPE4H", &
      "CPE4I", "CPE6", "CPE8", "CPE8R", "CPS3", "CPS4", "CPS4I", "CPS6", "CPS8"], &
      other(12) = [character(len=6) :: "CAX3", "CAX4", "CAX6", "CAX8", "CAX8R", "C3D4", "C3D8", &
      "C3D8H", "C3D8I", "C3D10", "C3D20", "C3D20R"]
   !> Freedoms of the first three nodes, which are on faces with pressure.
   character(len=*), parameter :: equations(5) = [character(len=40) :: "*EQUATION", "3", &
      "1, 1, 2., 2, 1, -1., 2, 2, 0.5", "2", "3, 2, 1., 1, 2, -0.75"]

contains

   subroutine collect_linked_elements(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("of the plane, in every kinematics, damped", test_plane), &
         test_case_t("of revolution and in space, damped", test_other)]
   end subroutine collect_linked_elements

   subroutine test_plane(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      do k = 1, size(plane)
         if (.not. allocated(error)) call check_one(error, plane(k), "NONLINEAR", .false.)
         if (.not. allocated(error)) call check_one(error, plane(k), "COROTATED", .false.)
         if (.not. allocated(error)) call check_one(error, plane(k), "LINEAR", .false.)
         if (.not. allocated(error)) call check_one(error, plane(k), "NONLINEAR", .true.)
         if (.not. allocated(error)) call check_one(error, plane(k), "COROTATED", .true.)
         if (.not. allocated(error)) call check_one(error, plane(k), "LINEAR", .true.)
      end do
   end subroutine test_plane

   subroutine test_other(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      do k = 1, size(other)
         if (.not. allocated(error)) call check_one(error, other(k), "NONLINEAR", .false.)
         if (.not. allocated(error)) call check_one(error, other(k), "NONLINEAR", .true.)
         if (allocated(error) .or. other(k)(:3) == "CAX") cycle
         call check_one(error, other(k), "LINEAR", .false.)
         if (.not. allocated(error)) call check_one(error, other(k), "LINEAR", .true.)
      end do
   end subroutine test_other

   !> Within a step and at its end. The derivative of damping is complete where nothing moves.
   subroutine check_one(error, kind, kinematics, is_damped)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: kind, kinematics
      logical, intent(in) :: is_damped
      character(len=*), parameter :: damping(1) = [character(len=40) :: &
         "*DAMPING, ALPHA=3., BETA=0.02"]
      character(len=*), parameter :: pressure(7) = [character(len=40) :: "*DLOAD", "B, P1, 30.", &
         "B, P2, 20.", "B, P3, -40.", "B, P4, 25.", "B, P5, 35.", "B, P6, -30."]
      type(scheme_energy_momentum_t) :: scheme
      type(stepper_t) :: stepper
      character(len=:), allocatable :: what
      integer :: n_face

      n_face = 4
      if (any(kind(4:) == ["3", "6"]) .and. kind(:3) /= "C3D") n_face = 3
      if (any(kind(:4) == ["C3D8", "C3D2"])) n_face = 6
      what = trim(kind) // ", " // kinematics
      if (is_damped) then
         what = what // ", damped"
         call read_one(kind, merge(2, 1, kinematics == "NONLINEAR"), kinematics, stepper, error, &
            [damping, equations], pressure(:1 + n_face))
      else
         call read_one(kind, merge(1, 3, kinematics == "LINEAR"), kinematics, stepper, error, &
            equations, pressure(:1 + n_face))
      end if
      if (.not. allocated(error)) call stepper_build(stepper, error)
      if (allocated(error)) return
      call check_tangent(error, stepper%march%system, stepper%scene, &
         scheme%evaluation(instant_t(0.1_wp, 0.1_wp), 0.1_wp), is_damped, what)
      if (.not. is_damped) call check_tangent(error, stepper%march%system, stepper%scene, &
         evaluation_at_end, .false., what // ", at the end")
      call stepper_close(stepper)
   end subroutine check_one

   !> Along random ways of all unknowns, against central differences of a step of eps^(1/3), whose
   !> error is a multiple of its square; without loads and damping products are those of the matrix.
   subroutine check_tangent(error, system, scene, evaluation, is_damped, what)
      type(error_t), allocatable, intent(inout) :: error
      type(system_t), intent(inout), target :: system
      type(scene_t), intent(in) :: scene
      type(evaluation_t), intent(in) :: evaluation
      logical, intent(in) :: is_damped
      character(len=*), intent(in) :: what
      real(wp), parameter :: step = epsilon(1.0_wp)**(1.0_wp/3.0_wp)
      real(wp), dimension(size(scene%x, 1), size(scene%x, 2)) :: u0, v0, du, way, image
      real(wp), dimension(system%space%numbering%n_unknown, 2) :: x, product, up, down
      type(scene_t) :: bare
      integer :: k

      call shake(u0, 0.05_wp)
      call shake(v0, 1.0_wp)
      call shake(du, merge(0.0_wp, 0.05_wp, is_damped))
      call spread_dependent(system%space%linked, u0)
      call spread_dependent(system%space%linked, v0)
      call spread_dependent(system%space%linked, du)
      call draw_random(x)
      x = x - 0.5_wp
      way = 0.0_wp
      call check_sizes(error, system, motion_at(0.0_wp), what)
      call system_respond(system, motion_at(0.0_wp), .true.)
      do k = 1, 2
         way = 0.0_wp
         call add_to_dofs(system%space%numbering, x(:, k), 1.0_wp, way)
         call csr_multiply(system%matrix, x(:, k), product(:, k))
         call forces(step, up(:, k))
         call forces(-step, down(:, k))
      end do
      associate (size_of => force_size + maxval(abs(product)))
         call check_near(error, product, (up - down)/(2.0_wp*step), max(300.0_wp*step**2, &
            64.0_wp*rounding), size_of, what)
         call check_true(error, norm2(product) > 0.01_wp*force_size, what // ": stiff")
         if (is_damped) return
         bare = scene
         bare%step(1)%load = bare%step(1)%load(:0)
         call system_renew(system, bare)
         call system_respond(system, motion_at(0.0_wp), .true.)
         call csr_multiply(system%matrix, x(:, 2), product(:, 2))
         call system_tangent_times(system, motion_at(0.0_wp), way, image)
         call pick_unknowns(system%space%numbering, image, up(:, 2))
         call check_near(error, up(:, 2), product(:, 2), 256.0_wp*rounding, size_of, &
            what // ": product")
         call system_renew(system, scene)
      end associate

   contains

      type(motion_t) function motion_at(share) result(motion)
         real(wp), intent(in) :: share

         motion = motion_of(evaluation, scene%x, u0, du + share*way, v0)
      end function motion_at

      subroutine forces(share, on_unknowns)
         real(wp), intent(in) :: share
         real(wp), intent(out) :: on_unknowns(:)

         call system_respond(system, motion_at(share), .false.)
         call pick_unknowns(system%space%numbering, system%response%residual, on_unknowns)
      end subroutine forces

   end subroutine check_tangent

   !> Masses of nodes are sums of rows. What forces are made of: of inertia M times the sizes of
   !> both parts of the rate, of loads the forces; what displacements are rounded by is the largest
   !> one in the element, or what was computed for it, times a stiffness of the node.
   subroutine check_sizes(error, system, motion, what)
      type(error_t), allocatable, intent(inout) :: error
      type(system_t), intent(inout), target :: system
      type(motion_t), intent(in) :: motion
      character(len=*), intent(in) :: what
      real(wp), parameter :: tol = 256.0_wp*epsilon(1.0_wp)
      type(solid_t), pointer :: solid
      real(wp), dimension(size(motion%x, 1), size(motion%x, 2)) :: inertia, apart, rounding_of
      real(wp) :: largest
      integer :: i, j

      solid => terms_solid(system%term)
      call system_respond(system, motion, .false.)
      associate (response => system%response, evaluation => motion%evaluation)
         call mass_times(system, abs(evaluation%rate*motion%du) &
            + abs(evaluation%v_weight*motion%v0), inertia)
         call check_near(error, response%part(role_inertia)%magnitude, &
            evaluation%mass_scale*inertia, tol, force_size, what // ": sizes of inertia")
         call check_near(error, response%part(role_external)%magnitude, &
            abs(response%part(role_external)%force), tol, force_size, what // ": of loads")
         call check_near(error, solid%mass%of_volume(:size(apart, 2), 1), &
            sum(solid%mass%consistent(:size(apart, 2), :size(apart, 2), 1), 2), tol, 1.0_wp, &
            what // ": mass at nodes")
         do i = 1, size(apart, 2)
            largest = maxval(motion%computed)
            do j = 1, size(apart, 2)
               if (solid%trait%is_linear(1)) then
                  apart(:, j) = motion%from(:, j) - motion%from(:, i) + 0.5_wp*(motion%by(:, j) &
                     - motion%by(:, i))
               else
                  apart(:, j) = motion%from(:, j) + motion%by(:, j)
                  if (.not. solid%is_of_rings) apart(:, j) = apart(:, j) - motion%from(:, 1) &
                     - motion%by(:, 1)
               end if
               largest = max(largest, maxval(abs(apart(:, j))))
            end do
            rounding_of(:, i) = largest*solid%stiffness(i, 1)
         end do
         call check_near(error, response%rounding, rounding_of, tol, maxval(rounding_of), &
            what // ": rounding")
      end associate
   end subroutine check_sizes

end module test_linked_elements
