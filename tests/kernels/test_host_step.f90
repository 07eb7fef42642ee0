!> A step of a host by one call: against its own loop over sets of contacts, with friction,
!> damping, a map and ties; failures.
module test_host_step
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_csr, only : csr_from_values, csr_t
   use emcon_errors, only : err_analysis, err_input, error_t, raise
   use emcon_interactions, only : contact_damping_t, contact_options_t, formulation_mortar, &
      formulation_nts, formulation_segment, interaction_t, multiplier_dual
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_stepper_contact, only : query_law_forces, query_slips
   use emcon_stepper_host, only : stepper_add_pair, stepper_add_surface, stepper_add_tie
   use emcon_stepper_null_space, only : query_links
   use emcon_stepper_report, only : query_set_map
   use emcon_stepper_solve, only : host_solver_t, query_solve_step
   use sparse_samples, only : dense_of
   use truss_host, only : face_build, face_n, face_new, face_t, truss_add, truss_begin, &
      truss_energy, truss_momentum, truss_respond, truss_step, truss_t
   implicit none
   private
   public :: collect_host_step

   integer, parameter :: formulations(3) = [formulation_nts, formulation_segment, &
      formulation_mortar], n_step = 60
   real(wp), parameter :: h = 0.02_wp
   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> Of a few ten steps, each a few roundings of the force scale off.
   real(wp), parameter :: drift = 4096.0_wp*eps

   !> The equations of a truss by the freedoms of the nodes, or by the unknowns of a map.
   type, extends(host_solver_t) :: solver_t
      type(truss_t) :: truss
      type(csr_t), allocatable :: map
      logical :: fails = .false.
   contains
      procedure :: solve => solver_solve
   end type solver_t

contains

   subroutine collect_host_step(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("the steps of a loop over sets", test_loop), &
         test_case_t("friction and damping take energy", test_losses), &
         test_case_t("unknowns of a map, ties", test_map), &
         test_case_t("failures", test_failures)]
   end subroutine collect_host_step

   subroutine solver_solve(self, du, second, columns, error)
      class(solver_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: du(:, :)
      type(csr_t), intent(in) :: second
      real(wp), intent(inout), contiguous :: columns(:, :)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: residual(size(du, 1), size(du, 2)), magnitude(size(du, 1), size(du, 2))
      real(wp) :: tangent(size(du), size(du))
      real(wp), allocatable :: r(:), k(:, :), a(:, :)
      real(dp), allocatable :: solved(:, :)
      logical :: is_singular

      call truss_respond(self%truss, h, du, residual, tangent, magnitude)
      r = reshape(residual, [size(du)])
      k = tangent
      if (allocated(self%map)) then
         a = real(dense_of(self%map), wp)
         r = matmul(r, a)
         k = matmul(transpose(a), matmul(tangent, a))
      end if
      k = k - real(dense_of(second), wp)
      associate (last => columns(:, size(columns, 2)))
         last = last + r
      end associate
      allocate(solved(size(r), size(columns, 2)))
      call dense_solve(real(k, dp), real(columns, dp), solved, is_singular)
      columns = real(solved, wp)
      if (self%fails .or. is_singular) call raise(error, err_analysis, "the host gives up")
   end subroutine solver_solve

   !> Two trusses that fly at each other, both free.
   subroutine make(formulation, interaction, solver, face, error)
      integer, intent(in) :: formulation
      type(interaction_t), intent(in) :: interaction
      type(solver_t), intent(out) :: solver
      type(face_t), intent(out) :: face
      type(error_t), allocatable, intent(out) :: error
      integer :: master, slave

      call lay_out(solver, face, master, slave, error)
      if (.not. allocated(error)) call stepper_add_pair(face%stepper, slave, master, formulation, &
         contact_options_t(), error, interaction)
      if (.not. allocated(error)) call build(solver, face, error)
   end subroutine make

   subroutine lay_out(solver, face, master, slave, error)
      type(solver_t), intent(inout) :: solver
      type(face_t), intent(inout) :: face
      integer, intent(out) :: master, slave
      type(error_t), allocatable, intent(out) :: error

      call truss_begin(solver%truss)
      solver%truss%stiffness = 50.0_wp
      call truss_add(solver%truss, 4, [-2.0_wp, -1.0_wp], [4.0_wp, 1.0_wp], [0.0_wp, 0.25_wp])
      call truss_add(solver%truss, 2, [-0.875_wp, 0.125_wp], [2.0_wp, 1.0_wp], [0.25_wp, -1.0_wp])
      call face_new(face, solver%truss%x, error)
      if (.not. allocated(error)) call stepper_add_surface(face%stepper, "LOWER", &
         reshape([10, 9, 9, 8, 8, 7, 7, 6], [2, 4]), master, error)
      if (.not. allocated(error)) call stepper_add_surface(face%stepper, "UPPER", &
         reshape([11, 12, 12, 13], [2, 2]), slave, error)
   end subroutine lay_out

   subroutine build(solver, face, error)
      type(solver_t), intent(inout) :: solver
      type(face_t), intent(inout) :: face
      type(error_t), allocatable, intent(out) :: error

      call face_build(face, spread(solver%truss%mass < 0.0_wp, 1, 2), error)
      if (.not. allocated(error)) allocate(solver%truss%is_active(face_n(face)), source=.false.)
   end subroutine build

   !> One step; what friction and damping take in it.
   subroutine advance(solver, face, lost, error, has_stop)
      type(solver_t), intent(inout) :: solver
      type(face_t), intent(inout) :: face
      real(wp), intent(inout) :: lost            !! grows [M L^2/T^2]
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in) :: has_stop
      real(wp), allocatable :: du(:, :), stop(:, :), lam(:)
      real(wp), allocatable :: slip(:, :), friction(:, :), force(:, :)
      real(wp) :: damped
      integer, allocatable :: way(:)
      logical, allocatable :: active(:)

      associate (truss => solver%truss)
         allocate(du, source=h*truss%v)
         if (has_stop) stop = 0.5_wp*du
         active = truss%is_active
         call query_solve_step(face%query, face%stepper, truss%u, du, active, lam, solver, &
            error, stop, h)
         if (.not. allocated(error)) call query_slips(face%query, face%stepper, way, slip, &
            friction, error)
         if (.not. allocated(error)) call query_law_forces(face%query, face%stepper, force, &
            damped, error)
         if (allocated(error)) return
         lost = lost + sum(slip*friction) + damped
         truss%is_active = active
         truss%n_contact = count(lam > 0.0_wp)
         truss%u = truss%u + du
         truss%v = (2.0_wp/h)*du - truss%v
      end associate
   end subroutine advance

   !> The same bodies by the null space of one set of contacts after the other.
   subroutine test_loop(error)
      type(error_t), allocatable, intent(out) :: error
      type(solver_t) :: solver
      type(truss_t) :: other
      type(face_t) :: face, face_there
      real(wp) :: lost
      integer :: i, k, n_touch

      lost = 0.0_wp
      do i = 1, size(formulations)
         call make(formulations(i), interaction_t(), solver, face, error)
         if (allocated(error)) return
         other = solver%truss
         call make(formulations(i), interaction_t(), solver, face_there, error)
         n_touch = 0
         do k = 1, n_step
            call advance(solver, face, lost, error, .false.)
            if (allocated(error)) return
            call truss_step(other, face_there, h, error)
            if (allocated(error)) return
            call check_near(error, reshape(solver%truss%u, [size(other%u)]), &
               reshape(other%u, [size(other%u)]), drift, 1.0_wp, "displacements")
            call check_equal(error, solver%truss%n_contact, other%n_contact, "contacts")
            if (other%n_contact > 0) n_touch = n_touch + 1
         end do
         call check_true(error, n_touch > 0 .and. n_touch < n_step, "they touch and part")
      end do
   end subroutine test_loop

   subroutine test_losses(error)
      type(error_t), allocatable, intent(out) :: error
      type(solver_t) :: solver
      type(face_t) :: face
      type(interaction_t) :: interaction
      real(wp) :: energy, momentum(3), lost
      integer :: i, k, what

      do what = 1, 3
         interaction = interaction_t()
         if (what /= 2) interaction%friction = 0.4_wp
         if (what /= 1) interaction%damping = contact_damping_t(2.0_wp, 0.1_wp, 0.5_wp, 0.3_wp)
         do i = 1, size(formulations)
            call make(formulations(i), interaction, solver, face, error)
            if (allocated(error)) return
            energy = truss_energy(solver%truss)
            momentum = truss_momentum(solver%truss)
            lost = 0.0_wp
            do k = 1, n_step
               call advance(solver, face, lost, error, .true.)
               if (allocated(error)) return
               call check_near(error, truss_energy(solver%truss) + lost, energy, drift, energy, &
                  "energy")
               call check_near(error, truss_momentum(solver%truss), momentum, drift, energy, &
                  "momenta")
            end do
            call check_true(error, lost > 0.01_wp*energy, "they have rubbed")
         end do
      end do
   end subroutine test_losses

   !> Unknowns in another order and of another size: the same steps. Of tied bodies those of the
   !> links.
   subroutine test_map(error)
      type(error_t), allocatable, intent(out) :: error
      type(solver_t) :: solver, mapped
      type(face_t) :: face, face_there
      type(interaction_t) :: interaction
      real(wp) :: lost, lost_there, energy
      real(wp), allocatable :: w(:)
      integer :: k, n, slave, master

      interaction%friction = 0.4_wp
      call make(formulation_mortar, interaction, solver, face, error)
      if (allocated(error)) return
      call make(formulation_mortar, interaction, mapped, face_there, error)
      n = size(mapped%truss%x)
      allocate(mapped%map)
      call csr_from_values(mapped%map, n, n, [(k, k = 1, n)], [(n + 1 - k, k = 1, n)], &
         [(2.0_wp + 0.1_wp*real(k, wp), k = 1, n)])
      call query_set_map(face_there%query, face_there%stepper, mapped%map, error)
      if (allocated(error)) return
      lost = 0.0_wp
      lost_there = 0.0_wp
      do k = 1, n_step
         call advance(solver, face, lost, error, .true.)
         if (.not. allocated(error)) call advance(mapped, face_there, lost_there, error, .true.)
         if (allocated(error)) return
         call check_near(error, reshape(solver%truss%u, [n]), reshape(mapped%truss%u, [n]), drift, &
            1.0_wp, "displacements")
      end do
      call check_near(error, lost, lost_there, drift, 1.0_wp, "what friction takes")

      call lay_out(solver, face, master, slave, error)
      if (.not. allocated(error)) call stepper_add_tie(face%stepper, slave, master, &
         multiplier_dual, 1.0_wp, error)
      if (.not. allocated(error)) call build(solver, face, error)
      allocate(solver%map)
      if (.not. allocated(error)) call query_links(face%stepper, solver%map, error)
      if (.not. allocated(error)) call query_set_map(face%query, face%stepper, solver%map, error)
      if (allocated(error)) return
      associate (truss => solver%truss)
         truss%x = face%stepper%scene%x
         w = [(real(mod(7*k, 5) - 2, wp), k = 1, solver%map%n_col)]
         truss%v = reshape(matmul(real(dense_of(solver%map), wp), w), shape(truss%x))
         energy = truss_energy(truss)
         do k = 1, n_step
            call advance(solver, face, lost, error, .false.)
            if (allocated(error)) return
            call check_near(error, truss_energy(truss), energy, drift, energy, "tied bodies")
         end do
         call check_true(error, maxval(abs(truss%u)) > 0.1_wp, "they have moved")
      end associate
   end subroutine test_map

   !> What is given stays as it was.
   subroutine test_failures(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: refused
      type(solver_t) :: solver
      type(face_t) :: face
      type(interaction_t) :: interaction
      real(wp), allocatable :: du(:, :), lam(:)
      logical, allocatable :: active(:)
      integer :: slave, master

      interaction%damping = contact_damping_t(2.0_wp, 0.1_wp, 0.5_wp, 0.3_wp)
      call make(formulation_nts, interaction, solver, face, error)
      if (allocated(error)) return
      du = h*solver%truss%v
      active = solver%truss%is_active
      call query_solve_step(face%query, face%stepper, solver%truss%u, du, active, lam, solver, &
         refused)
      call check_error(error, refused, err_input, "the size of the step is to be told", "damping")
      solver%fails = .true.
      call query_solve_step(face%query, face%stepper, solver%truss%u, du, active, lam, solver, &
         refused, h=h)
      call check_error(error, refused, err_analysis, "the host gives up", "the solver")
      call check_true(error, all(abs(du - h*solver%truss%v) <= 0.0_wp) .and. .not. any(active), &
         "what was given")
      call query_solve_step(face%query, face%stepper, solver%truss%u, du(:, 2:), active, lam, &
         solver, refused, h=h)
      call check_error(error, refused, err_input, "du is to have 2 components at each of 16", "du")

      call lay_out(solver, face, master, slave, error)
      if (.not. allocated(error)) call stepper_add_tie(face%stepper, slave, master, &
         multiplier_dual, 1.0_wp, error)
      if (.not. allocated(error)) call build(solver, face, error)
      if (allocated(error)) return
      active = solver%truss%is_active
      call query_solve_step(face%query, face%stepper, solver%truss%u, du, active, lam, solver, &
         refused)
      call check_error(error, refused, err_input, "surfaces are tied: set the map", "ties")
   end subroutine test_failures

end module test_host_step
