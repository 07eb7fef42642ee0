!> Solvers and schemes that a program gives: one that does what ours do leads to the same
!> run, and one that nobody gives is told.
module test_given_kinds
   use check, only : check_error, check_near, check_true, test_case_t
   use emcon_errors, only : err_input, error_t
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t
   use emcon_scheme_energy_momentum, only : scheme_energy_momentum_t
   use emcon_solver_registry, only : solver_user
   use emcon_stepper, only : stepper_advance, stepper_build, stepper_close, stepper_t
   use emcon_stepper_user, only : stepper_give_scheme, stepper_give_solver
   use emcon_umfpack, only : umfpack_t
   use one_element, only : read_one
   implicit none
   private
   public :: collect_given_kinds

   real(wp), parameter :: tol = 1.0e4_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   integer, parameter :: n_step = 4

contains

   subroutine collect_given_kinds(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a solver", test_solver), &
         test_case_t("a scheme", test_scheme), &
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

   subroutine test_solver(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: own, other
      type(umfpack_t) :: solver

      call read_flight(own, "ENERGY MOMENTUM", error)
      if (.not. allocated(error)) call read_flight(other, "ENERGY MOMENTUM", error)
      if (allocated(error)) return
      other%scene%step(1)%solution%solver = solver_user
      other%scene%step(1)%solution%solver_name = "MINE"
      call stepper_give_solver(other, "other", solver, error)
      if (.not. allocated(error)) call stepper_give_solver(other, "mine", solver, error)
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

   subroutine test_missing(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: refused
      type(stepper_t) :: unsolved, unnamed
      type(umfpack_t) :: solver

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
