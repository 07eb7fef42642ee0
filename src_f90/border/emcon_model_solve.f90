!> A step of contact solved with a function of another language. Prototypes and what they are to
!> do: emcon.h.
module emcon_model_solve
   use, intrinsic :: iso_c_binding, only : c_associated, c_double, c_f_procpointer, c_funptr, &
      c_int, c_loc, c_null_funptr, c_null_ptr, c_ptr
   use emcon_c_border, only : put_matrix
   use emcon_c_types, only : csr_c, solve_function_c
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_analysis, err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_model, only : model_t
   use emcon_stepper_solve, only : host_solver_t, query_solve_step
   use emcon_text, only : to_text
   implicit none
   private
   public :: solve_callback_t, model_solve_step

   !> The equations of a host.
   type, extends(host_solver_t) :: solve_callback_t
      type(c_funptr) :: function = c_null_funptr
      type(c_ptr) :: user = c_null_ptr           !! handed to the function
   contains
      procedure :: solve => solve_callback_solve
   end type solve_callback_t

contains

   subroutine model_solve_step(model, u0, du, stop, h, active, lam, solve, user, error)
      type(model_t), intent(inout) :: model
      real(wp), intent(in), contiguous :: u0(:, :)           !! (n_dim, n_node)
      real(wp), intent(inout), contiguous :: du(:, :)        !! (n_dim, n_node)
      real(wp), intent(in), optional, contiguous :: stop(:, :)
      real(wp), intent(in) :: h                              !! 0: not known
      logical, intent(inout) :: active(:)                    !! (n_constraint)
      real(wp), allocatable, intent(out) :: lam(:)           !! (n_constraint)
      type(c_funptr), intent(in) :: solve                    !! emcon_solve_function of emcon.h
      type(c_ptr), intent(in) :: user                        !! handed to the function
      type(error_t), allocatable, intent(out) :: error
      type(solve_callback_t) :: solver

      if (.not. c_associated(solve)) then
         call raise(error, err_input, "the function is NULL")
         return
      end if
      solver = solve_callback_t(function=solve, user=user)
      if (abs(h) > 0.0_wp) then
         call query_solve_step(model%query, model%stepper, u0, du, active, lam, solver, &
            error, stop, h)
      else
         call query_solve_step(model%query, model%stepper, u0, du, active, lam, solver, error, stop)
      end if
   end subroutine model_solve_step

   subroutine solve_callback_solve(self, du, second, columns, error)
      class(solve_callback_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: du(:, :)
      type(csr_t), intent(in) :: second
      real(wp), intent(inout), contiguous :: columns(:, :)
      type(error_t), allocatable, intent(out) :: error
      procedure(solve_function_c), pointer :: function
      real(c_double), allocatable, target :: motion(:, :), b(:, :)
      type(csr_t), target :: matrix
      type(csr_c), target :: view
      integer(c_int) :: code

      allocate(motion, source=real(du, c_double))
      allocate(b, source=real(columns, c_double))
      matrix = second
      call put_matrix(matrix, c_loc(view))
      call c_f_procpointer(self%function, function)
      code = function(self%user, size(du, kind=c_int), c_loc(motion), c_loc(view), &
         size(b, 1, kind=c_int), size(b, 2, kind=c_int), c_loc(b))
      columns = real(b, wp)
      if (code /= 0) call raise(error, err_analysis, "the function that solves for the host " // &
         "returned " // to_text(int(code)))
   end subroutine solve_callback_solve

end module emcon_model_solve
