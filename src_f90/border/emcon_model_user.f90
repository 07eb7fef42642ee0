!> Functions of other languages as what a model can be given: laws, potentials, solids of a host.
!>
!> Prototypes and what they are to do: emcon.h. A function returns 0, 1 for a state that it has no
!> value for, or anything else for a failure.
module emcon_model_user
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_c_binding, only : c_associated, c_double, c_f_procpointer, c_funptr, &
      c_int, c_loc, c_null_funptr, c_null_ptr, c_ptr
   use emcon_c_types, only : force_function_c, point_function_c
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_host_force, only : force_response_t, host_force_t
   use emcon_kinds, only : dp, wp
   use emcon_point_function, only : point_failed, point_function_t, point_ok, point_outside
   use emcon_rotation, only : n_turn
   use emcon_stepper, only : stepper_t
   use emcon_stepper_user, only : stepper_give_force, stepper_give_law, stepper_give_potential
   implicit none
   private
   public :: point_callback_t, force_callback_t
   public :: model_give_law, model_give_potential, model_give_force

   !> An energy at points: a law, a potential.
   type, extends(point_function_t) :: point_callback_t
      type(c_funptr) :: function = c_null_funptr
      type(c_ptr) :: user = c_null_ptr           !! handed to the function
   contains
      procedure :: evaluate => point_callback_evaluate
   end type point_callback_t

   !> Forces between nodes with a sparse tangent: the solid of a host.
   type, extends(host_force_t) :: force_callback_t
      type(c_funptr) :: function = c_null_funptr
      type(c_ptr) :: user = c_null_ptr
   contains
      procedure :: respond => force_callback_respond
   end type force_callback_t

contains

   subroutine model_give_law(stepper, name, law, user, error)
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: name           !! of a *USER MATERIAL
      type(c_funptr), intent(in) :: law              !! emcon_point_function of emcon.h
      type(c_ptr), intent(in) :: user                !! handed to the function
      type(error_t), allocatable, intent(out) :: error

      call check(law, error)
      associate (n => stepper%scene%n_dim)
         if (.not. allocated(error)) call stepper_give_law(stepper, name, point_callback_t( &
            n_variable=n + n_turn(n), function=law, user=user), error)
      end associate
   end subroutine model_give_law

   subroutine model_give_potential(stepper, name, node, potential, user, error)
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: name           !! for messages
      integer, intent(in) :: node(:)                 !! 1..n_node, each once
      type(c_funptr), intent(in) :: potential        !! emcon_point_function of emcon.h
      type(c_ptr), intent(in) :: user                !! handed to the function
      type(error_t), allocatable, intent(out) :: error

      call check(potential, error)
      if (.not. allocated(error)) call stepper_give_potential(stepper, name, node, &
         point_callback_t(n_variable=stepper%scene%n_dim, function=potential, user=user), error)
   end subroutine model_give_potential

   subroutine model_give_force(stepper, name, pattern, force, user, error)
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: name           !! for messages
      type(csr_t), intent(in) :: pattern             !! (n_dim n_node, twice) of the tangent
      type(c_funptr), intent(in) :: force            !! emcon_force_function of emcon.h
      type(c_ptr), intent(in) :: user                !! handed to the function
      type(error_t), allocatable, intent(out) :: error
      type(force_callback_t) :: given

      call check(force, error)
      if (allocated(error)) return
      given%name = name
      given%pattern = pattern
      given%function = force
      given%user = user
      call stepper_give_force(stepper, given, error)
   end subroutine model_give_force

   !> There is a function to call.
   subroutine check(function, error)
      type(c_funptr), intent(in) :: function
      type(error_t), allocatable, intent(out) :: error

      if (.not. c_associated(function)) call raise(error, err_input, "the function is NULL")
   end subroutine check

   subroutine point_callback_evaluate(self, z, wants_hessian, value, gradient, hessian, status)
      class(point_callback_t), intent(in) :: self
      real(wp), intent(in), contiguous :: z(:, :)
      logical, intent(in) :: wants_hessian
      real(wp), intent(inout), contiguous :: value(:)
      real(wp), intent(inout), contiguous :: gradient(:, :)
      real(wp), intent(inout), contiguous :: hessian(:, :, :)
      integer, intent(out) :: status
      procedure(point_function_c), pointer :: function
      real(c_double), allocatable, target :: at(:, :), w(:), dw(:, :), ddw(:, :, :)
      type(c_ptr) :: second
      integer :: m, n

      m = size(z, 1)
      n = size(z, 2)
      allocate(at, source=real(z, c_double))
      allocate(w(n), source=ieee_value(0.0_c_double, ieee_quiet_nan))   ! to see that it was set
      allocate(dw(m, n), source=0.0_c_double)
      allocate(ddw(m, m, merge(n, 0, wants_hessian)), source=0.0_c_double)
      second = c_null_ptr
      if (wants_hessian) second = c_loc(ddw)
      call c_f_procpointer(self%function, function)
      status = status_of(function(self%user, int(n, c_int), int(m, c_int), c_loc(at), &
         merge(1_c_int, 0_c_int, wants_hessian), c_loc(w), c_loc(dw), second))
      value = real(w, wp)
      gradient = real(dw, wp)
      if (wants_hessian) hessian(:, :, :n) = real(ddw, wp)
   end subroutine point_callback_evaluate

   !> As `host_force_t` has it.
   subroutine force_callback_respond(self, u0, du, wants_tangent, response)
      class(force_callback_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)
      logical, intent(in) :: wants_tangent
      type(force_response_t), intent(inout) :: response
      procedure(force_function_c), pointer :: function
      real(c_double), allocatable, target :: start(:, :), motion(:, :), f(:, :), size_of(:, :), k(:)
      real(c_double), target :: last
      type(c_ptr) :: slope

      allocate(start, source=real(u0, c_double))
      allocate(motion, source=real(du, c_double))
      allocate(f, size_of, mold=start)
      f = 0.0_c_double
      size_of = 0.0_c_double
      last = ieee_value(0.0_c_double, ieee_quiet_nan)   ! to see that it was set
      allocate(k(merge(size(response%tangent), 0, wants_tangent)), source=0.0_c_double)
      slope = c_null_ptr
      if (wants_tangent) slope = c_loc(k)
      call c_f_procpointer(self%function, function)
      response%status = status_of(function(self%user, int(size(u0, 2), c_int), c_loc(start), &
         c_loc(motion), merge(1_c_int, 0_c_int, wants_tangent), c_loc(f), c_loc(size_of), &
         c_loc(last), slope))
      response%force = real(f, wp)
      response%magnitude = real(size_of, wp)
      response%energy = real(last, wp)
      if (wants_tangent) response%tangent = real(k, dp)
   end subroutine force_callback_respond

   pure integer function status_of(code)
      integer(c_int), intent(in) :: code

      status_of = point_failed
      if (code == 0) status_of = point_ok
      if (code == 1) status_of = point_outside
   end function status_of

end module emcon_model_user
