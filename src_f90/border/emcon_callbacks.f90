!> Functions of other languages as what a model can be given: laws, potentials, solids of a host.
!>
!> Prototypes and what they are to do: emcon.h. A function returns 0, 1 for a state that it has no
!> value for, or anything else for a failure.
module emcon_callbacks
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_c_binding, only : c_associated, c_double, c_f_procpointer, c_funptr, &
      c_int, c_loc, c_null_funptr, c_null_ptr, c_ptr
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_host_force, only : force_response_t, host_force_t
   use emcon_kinds, only : dp, wp
   use emcon_point_function, only : point_failed, point_function_t, point_ok, point_outside
   use emcon_stepper, only : stepper_t
   use emcon_stepper_given, only : stepper_give_force, stepper_give_law, stepper_give_potential
   implicit none
   private
   public :: point_callback_t, force_callback_t
   public :: give_law_callback, give_potential_callback, give_force_callback

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

   abstract interface
      function point_interface(user, n_point, n_variable, z, wants_hessian, value, gradient, &
         hessian) result(status) bind(c)
         import :: c_double, c_int, c_ptr
         implicit none
         type(c_ptr), value :: user
         integer(c_int), value :: n_point, n_variable
         type(c_ptr), value :: z
         integer(c_int), value :: wants_hessian
         type(c_ptr), value :: value, gradient, hessian
         integer(c_int) :: status
      end function point_interface

      function force_interface(user, n_node, u0, du, wants_tangent, force, magnitude, energy, &
         tangent) result(status) bind(c)
         import :: c_double, c_int, c_ptr
         implicit none
         type(c_ptr), value :: user
         integer(c_int), value :: n_node
         type(c_ptr), value :: u0, du
         integer(c_int), value :: wants_tangent
         type(c_ptr), value :: force, magnitude
         real(c_double), intent(inout) :: energy
         type(c_ptr), value :: tangent
         integer(c_int) :: status
      end function force_interface
   end interface

contains

   !> Give the strain energy of the *USER MATERIAL `name`; see `stepper_give_law`.
   subroutine give_law_callback(stepper, name, function, error, user)
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: name
      type(c_funptr), intent(in) :: function         !! emcon_point_function of emcon.h
      type(error_t), allocatable, intent(out) :: error
      type(c_ptr), intent(in), optional :: user      !! handed to the function
      type(point_callback_t) :: energy

      call check(function, error)
      if (allocated(error)) return
      energy%n_variable = 3
      energy%function = function
      if (present(user)) energy%user = user
      call stepper_give_law(stepper, name, energy, error)
   end subroutine give_law_callback

   !> Give a potential of the positions of some nodes.
   subroutine give_potential_callback(stepper, name, node, function, error, user)
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: name           !! for messages
      integer, intent(in) :: node(:)                 !! 1..n_node, each once
      type(c_funptr), intent(in) :: function         !! emcon_point_function of emcon.h
      type(error_t), allocatable, intent(out) :: error
      type(c_ptr), intent(in), optional :: user
      type(point_callback_t) :: energy

      call check(function, error)
      if (allocated(error)) return
      energy%n_variable = 2
      energy%function = function
      if (present(user)) energy%user = user
      call stepper_give_potential(stepper, name, node, energy, error)
   end subroutine give_potential_callback

   !> Give forces over all freedoms; see `stepper_give_force`.
   subroutine give_force_callback(stepper, name, pattern, function, error, user)
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: name           !! for messages
      type(csr_t), intent(in) :: pattern             !! (2 n_node x 2 n_node) of the tangent
      type(c_funptr), intent(in) :: function         !! emcon_force_function of emcon.h
      type(error_t), allocatable, intent(out) :: error
      type(c_ptr), intent(in), optional :: user
      type(force_callback_t) :: force

      call check(function, error)
      if (allocated(error)) return
      force%name = name
      force%pattern = pattern
      force%function = function
      if (present(user)) force%user = user
      call stepper_give_force(stepper, force, error)
   end subroutine give_force_callback

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
      procedure(point_interface), pointer :: function
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
      procedure(force_interface), pointer :: function
      real(c_double), allocatable, target :: start(:, :), motion(:, :), f(:, :), size_of(:, :), k(:)
      real(c_double) :: last
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
         c_loc(motion), merge(1_c_int, 0_c_int, wants_tangent), c_loc(f), c_loc(size_of), last, &
         slope))
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

end module emcon_callbacks
