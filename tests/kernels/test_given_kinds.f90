!> Solvers, schemes and conditions that a program gives: one that does what ours do leads to the
!> same run, and one that nobody gives is told.
module test_given_kinds
   use check, only : check_error, check_near, check_true, test_case_t
   use emcon_constraint, only : condition_t, constraint_t
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_input, err_internal, error_t, raise
   use emcon_kinds, only : dp, wp
   use emcon_ledger, only : ledger_t
   use emcon_march, only : increment_t
   use emcon_motion, only : motion_t
   use emcon_scheme_energy_momentum, only : scheme_energy_momentum_t
   use emcon_solver_registry, only : solver_user
   use emcon_stepper, only : stepper_advance, stepper_build, stepper_close, stepper_t
   use emcon_stepper_user, only : stepper_give_constraint, stepper_give_mass, &
      stepper_give_scheme, stepper_give_solver
   use emcon_text, only : to_text
   use emcon_mumps, only : mumps_t
   use given_scenes, only : lump, make_line
   use one_element, only : read_one
   implicit none
   private
   public :: collect_given_kinds

   real(wp), parameter :: tol = 1.0e4_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   integer, parameter :: n_step = 4

   !> Two nodes stay as far from each other as they are at the start: (|r|^2 - L^2)/2.
   type, extends(constraint_t) :: rod_t
      integer :: node(2) = 0
      real(wp) :: length = 0.0_wp                !! L
   contains
      procedure :: take_positions
      procedure :: linearise
   end type rod_t

   !> One that solves nothing.
   type, extends(mumps_t) :: idle_solver_t
   contains
      procedure :: solve => idle_solve
   end type idle_solver_t

contains

   subroutine collect_given_kinds(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a solver", test_solver), &
         test_case_t("a scheme", test_scheme), &
         test_case_t("conditions", test_rods), &
         test_case_t("what nobody gives", test_missing)]
   end subroutine collect_given_kinds

   !> One element that flies and turns, not built yet.
   subroutine read_flight(stepper, scheme, error)
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: scheme
      type(error_t), allocatable, intent(out) :: error

      call read_one("CPE4", 3, "NONLINEAR", stepper, error, &
         of_step=["*TIME INTEGRATION, SCHEME=" // scheme])
      if (allocated(error)) return
      associate (scene => stepper%scene)
         scene%v0(1, :) = 0.5_wp - 2.0_wp*scene%x(2, :)
         scene%v0(2, :) = 2.0_wp*scene%x(1, :)
      end associate
   end subroutine read_flight

   !> `own` is built, `other` has been given something: both fly the same way.
   subroutine compare(own, other, error)
      type(stepper_t), intent(inout) :: own, other
      type(error_t), allocatable, intent(inout) :: error
      type(increment_t) :: increment
      integer :: k

      if (.not. allocated(error)) call stepper_build(own, error)
      if (.not. allocated(error)) call stepper_build(other, error)
      do k = 1, n_step
         if (.not. allocated(error)) call stepper_advance(own, increment, error)
         if (.not. allocated(error)) call stepper_advance(other, increment, error)
         if (allocated(error)) return
         call check_near(error, other%march%state%u, own%march%state%u, tol, 1.0_wp, "places")
         call check_near(error, other%march%state%v, own%march%state%v, tol, 1.0_wp, "velocities")
      end do
      call check_true(error, norm2(own%march%state%u) > 0.1_wp, "it moves")
   end subroutine compare

   subroutine idle_solve(self, rhs, x, error)
      class(idle_solver_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: rhs(:)
      real(wp), intent(out), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error

      x = 0.0_wp*rhs
      call raise(error, err_internal, "not the solver that was asked for, of " // to_text( &
         self%choice))
   end subroutine idle_solve

   subroutine test_solver(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: own, other
      type(mumps_t) :: solver
      type(idle_solver_t) :: idle

      call read_flight(own, "ENERGY MOMENTUM", error)
      if (.not. allocated(error)) call read_flight(other, "ENERGY MOMENTUM", error)
      if (allocated(error)) return
      other%scene%step(1)%solution%solver = solver_user
      other%scene%step(1)%solution%solver_name = "MINE"
      call stepper_give_solver(other, "other", idle, error)
      if (.not. allocated(error)) call stepper_give_solver(other, "mine", solver, error)
      if (.not. allocated(error)) call stepper_give_solver(other, "last", idle, error)
      call compare(own, other, error)
      call stepper_close(own)
      call stepper_close(other)
   end subroutine test_solver

   subroutine test_scheme(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: own, other

      call read_flight(own, "ENERGY MOMENTUM", error)
      if (.not. allocated(error)) call read_flight(other, "MINE", error)
      if (.not. allocated(error)) call stepper_give_scheme(other, "mine", &
         scheme_energy_momentum_t(), error)
      call compare(own, other, error)
      call stepper_close(own)
      call stepper_close(other)
   end subroutine test_scheme

   subroutine take_positions(self, x)
      class(rod_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)

      self%stands_on = self%node
      self%length = norm2(x(:, self%node(2)) - x(:, self%node(1)))
   end subroutine take_positions

   pure subroutine linearise(self, wanted, motion, target, item)
      class(rod_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: target(:)
      type(condition_t), intent(inout) :: item(:)
      real(wp) :: r0(2), dr(2)
      integer :: a, k

      r0 = between(motion%x + motion%u0)
      dr = between(motion%du)
      do k = 1, size(wanted)
         associate (to => item(k))
            if (.not. allocated(to%node)) allocate(to%node(2), to%g(2, 2), to%c(2, 2), to%h(4, 4))
            to%n_node = 2
            to%n_slave = 1
            to%node = self%node
            to%size = self%length
            to%gap0 = 0.5_wp*(sum(r0**2) - self%length**2)
            to%dgap = dot_product(r0 + 0.5_wp*dr, dr)
            to%gap1 = to%gap0 + to%dgap - target(k)
            to%g(:, 2) = r0 + 0.5_wp*dr
            to%g(:, 1) = -to%g(:, 2)
            to%c(:, 2) = r0 + dr
            to%c(:, 1) = -to%c(:, 2)
            to%h = 0.0_wp
            do a = 1, 4
               to%h(a, a) = 0.5_wp
               to%h(a, 1 + modulo(a + 1, 4)) = -0.5_wp
            end do
         end associate
      end do

   contains

      pure function between(field)
         real(wp), intent(in) :: field(:, :)
         real(wp) :: between(2)

         between = field(:, self%node(2)) - field(:, self%node(1))
      end function between

   end subroutine linearise

   !> Three points on a line, thrown: two rods between them, given one after the other, keep their
   !> lengths and all momenta.
   subroutine test_rods(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper
      type(increment_t) :: increment
      type(ledger_t) :: start
      type(csr_t) :: mass
      real(wp) :: place(2, 3)
      integer :: i, k

      call make_line(stepper%scene, 3, .false., 0.1_wp, 10)
      stepper%scene%v0 = reshape([0.0_wp, 1.0_wp, 0.0_wp, -0.5_wp, 0.25_wp, 2.0_wp], [2, 3])
      stepper%scene%v0(1, 3) = 0.0_wp
      stepper%is_read = .true.
      call lump(mass, 3, 2.0_wp)
      call stepper_give_mass(stepper, mass, error)
      do i = 1, 2
         if (.not. allocated(error)) call stepper_give_constraint(stepper, &
            rod_t(n_constraint=1, node=[i, i + 1]), error)
      end do
      if (.not. allocated(error)) call stepper_build(stepper, error)
      if (allocated(error)) return
      start = stepper%march%ledger
      do k = 1, 10
         call stepper_advance(stepper, increment, error)
         if (allocated(error)) return
         place = stepper%scene%x + stepper%march%state%u
         call check_near(error, norm2(place(:, 2:) - place(:, :2), 1), [1.0_wp, 1.0_wp], tol, &
            1.0_wp, "lengths")
         associate (ledger => stepper%march%ledger)
            call check_near(error, [ledger%total, ledger%momentum, ledger%angular], [start%total, &
               start%momentum, start%angular], tol, 10.0_wp, "energy and momenta")
         end associate
      end do
      call check_true(error, abs(place(2, 1) - place(2, 2)) > 0.1_wp, "they turn")
      call stepper_close(stepper)
   end subroutine test_rods

   subroutine test_missing(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: refused
      type(stepper_t) :: unsolved, unnamed
      type(mumps_t) :: solver

      call read_flight(unsolved, "ENERGY MOMENTUM", error)
      if (allocated(error)) return
      unsolved%scene%step(1)%solution%solver = solver_user
      unsolved%scene%step(1)%solution%solver_name = "MINE"
      call stepper_give_solver(unsolved, "other", solver, error)
      if (allocated(error)) return
      call stepper_build(unsolved, refused)
      call check_error(error, refused, err_input, "SOLVER=MINE: no program has given this solver", &
         "solver")
      call stepper_close(unsolved)
      call read_flight(unnamed, "MINE", error)
      if (allocated(error)) return
      call stepper_give_scheme(unnamed, "other", scheme_energy_momentum_t(), error)
      if (allocated(error)) return
      deallocate(refused)
      call stepper_build(unnamed, refused)
      call check_error(error, refused, err_input, "MINE", "scheme")
      call stepper_close(unnamed)
   end subroutine test_missing

end module test_given_kinds
