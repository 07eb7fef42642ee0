!> The C interface: what a model is given between reading and building. What each function does is
!> said in emcon.h.
module emcon_c_given
   use, intrinsic :: iso_c_binding, only : c_double, c_f_pointer, c_funptr, c_int, c_ptr
   use emcon_c_border, only : check_given, f_text
   use emcon_c_types, only : csr_c
   use emcon_callbacks, only : give_force_callback, give_law_callback, give_potential_callback
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_input, err_none, error_t, raise
   use emcon_handle, only : find_read, handle_pass, model_t
   use emcon_kinds, only : dp
   use emcon_stepper_given, only : stepper_give_mass
   implicit none
   private
   public :: emcon_give_law, emcon_give_potential, emcon_give_force, emcon_give_mass

contains

   integer(c_int) function emcon_give_law(handle, name, function, user) bind(c)
      type(c_ptr), value :: handle, name
      type(c_funptr), value :: function
      type(c_ptr), value :: user
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call find_read(handle, model, emcon_give_law)
      if (emcon_give_law /= err_none) return
      call check_given("name", name, error)
      if (.not. allocated(error)) call give_law_callback(model%stepper, f_text(name), function, &
         error, user)
      call handle_pass(model, error, emcon_give_law)
   end function emcon_give_law

   integer(c_int) function emcon_give_potential(handle, name, n, node, function, user) bind(c)
      type(c_ptr), value :: handle, name
      integer(c_int), value :: n
      type(c_ptr), value :: node
      type(c_funptr), value :: function
      type(c_ptr), value :: user
      type(model_t), pointer :: model
      integer(c_int), pointer :: number(:)
      type(error_t), allocatable :: error

      call find_read(handle, model, emcon_give_potential)
      if (emcon_give_potential /= err_none) return
      call check_given("node", node, error)
      if (.not. allocated(error) .and. n < 1) call raise(error, err_input, "n is not above 0")
      if (.not. allocated(error)) then
         call c_f_pointer(node, number, [n])
         call give_potential_callback(model%stepper, f_text(name), number + 1, function, error, &
            user)
      end if
      call handle_pass(model, error, emcon_give_potential)
   end function emcon_give_potential

   integer(c_int) function emcon_give_force(handle, name, pattern, function, user) bind(c)
      type(c_ptr), value :: handle, name
      type(c_ptr), value :: pattern
      type(c_funptr), value :: function
      type(c_ptr), value :: user
      type(model_t), pointer :: model
      type(csr_t) :: matrix
      type(error_t), allocatable :: error

      call find_read(handle, model, emcon_give_force)
      if (emcon_give_force /= err_none) return
      call take_matrix("pattern", pattern, .false., matrix, error)
      if (.not. allocated(error)) call give_force_callback(model%stepper, f_text(name), matrix, &
         function, error, user)
      call handle_pass(model, error, emcon_give_force)
   end function emcon_give_force

   integer(c_int) function emcon_give_mass(handle, mass) bind(c)
      type(c_ptr), value :: handle, mass
      type(model_t), pointer :: model
      type(csr_t) :: matrix
      type(error_t), allocatable :: error

      call find_read(handle, model, emcon_give_mass)
      if (emcon_give_mass /= err_none) return
      call take_matrix("mass", mass, .true., matrix, error)
      if (.not. allocated(error)) call stepper_give_mass(model%stepper, matrix, error)
      call handle_pass(model, error, emcon_give_mass)
   end function emcon_give_mass

   !> A copy of a matrix of C. Its indices are checked where it is given.
   subroutine take_matrix(name, from, has_values, matrix, error)
      character(len=*), intent(in) :: name
      type(c_ptr), intent(in) :: from
      logical, intent(in) :: has_values
      type(csr_t), intent(out) :: matrix
      type(error_t), allocatable, intent(out) :: error
      type(csr_c), pointer :: given
      integer(c_int), pointer :: start(:), column(:)
      real(c_double), pointer :: value(:)
      integer :: n

      call check_given(name, from, error)
      if (allocated(error)) return
      call c_f_pointer(from, given)
      call check_given(name // "->row_start", given%row_start, error)
      call check_given(name // "->column", given%column, error)
      if (has_values) call check_given(name // "->value", given%value, error)
      if (.not. allocated(error) .and. given%n_row < 1) call raise(error, err_input, &
         name // " has no rows")
      if (allocated(error)) return
      call c_f_pointer(given%row_start, start, [given%n_row + 1])
      n = start(given%n_row + 1)
      if (n < 0) then
         call raise(error, err_input, name // ": the last row start is negative")
         return
      end if
      call c_f_pointer(given%column, column, [n])
      matrix%n_row = given%n_row
      matrix%n_col = given%n_column
      matrix%row_start = start
      matrix%column = column
      allocate(matrix%value(n), source=0.0_dp)
      if (.not. has_values) return
      call c_f_pointer(given%value, value, [n])
      matrix%value = real(value, dp)
   end subroutine take_matrix

end module emcon_c_given
