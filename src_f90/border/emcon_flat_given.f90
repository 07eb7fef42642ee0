!> Laws, potentials, forces and mass that Python gives to a model between reading and building:
!> functions by the address of a C function (emcon_callbacks), matrices by rows from 0.
module emcon_flat_given
   use, intrinsic :: iso_c_binding, only : c_double, c_funptr, c_int, c_int64_t, c_null_funptr
   use emcon_callbacks, only : give_force_callback, give_law_callback, give_potential_callback
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_input, error_t
   use emcon_handle, only : handle_fail, handle_find, handle_fits, handle_pass, model_t
   use emcon_kinds, only : dp
   use emcon_stepper_given, only : stepper_give_mass
   use emcon_text, only : to_upper
   implicit none
   private
   public :: count_nodes, find_nodes, give_law, give_potential, give_force, give_mass

contains

   !> Nodes of the scene that was read.
   subroutine count_nodes(handle, n, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(out) :: n
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model

      n = 0
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      n = size(model%stepper%scene%x, 2)
   end subroutine count_nodes

   !> Labels of all `n` nodes, and whether each is in the node set `name`.
   subroutine find_nodes(handle, name, n, label, is_in, ierr)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: name
      integer(c_int), intent(in) :: n
      integer(c_int), intent(out) :: label(n), is_in(n)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      integer :: k

      label = 0
      is_in = 0
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      if (.not. handle_fits(model, n, size(model%stepper%scene%x, 2), ierr)) return
      associate (scene => model%stepper%scene)
         label = scene%node_label
         do k = 1, size(scene%node_set)
            if (scene%node_set(k)%name /= to_upper(name)) cycle
            is_in(scene%node_set(k)%item) = 1
            return
         end do
      end associate
      if (len_trim(name) > 0) call handle_fail(model, "there is no node set " // name, &
         err_input, ierr)
   end subroutine find_nodes

   !> The strain energy of the *USER MATERIAL `name`.
   subroutine give_law(handle, name, address, ierr)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: name
      integer(c_int64_t), intent(in) :: address
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call give_law_callback(model%stepper, name, transfer(address, c_null_funptr), error)
      call handle_pass(model, error, ierr)
   end subroutine give_law

   !> A potential on each of `n` nodes, counted from 0.
   subroutine give_potential(handle, name, n, node, address, ierr)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: name
      integer(c_int), intent(in) :: n
      integer(c_int), intent(in) :: node(n)
      integer(c_int64_t), intent(in) :: address
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call give_potential_callback(model%stepper, name, node + 1, &
         transfer(address, c_null_funptr), error)
      call handle_pass(model, error, ierr)
   end subroutine give_potential

   !> Forces over the freedoms of all nodes, with the pattern of their tangent.
   subroutine give_force(handle, name, n_row, n_entry, row_start, column, address, ierr)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: name
      integer(c_int), intent(in) :: n_row, n_entry
      integer(c_int), intent(in) :: row_start(n_row + 1), column(n_entry)
      integer(c_int64_t), intent(in) :: address
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(csr_t) :: pattern
      type(error_t), allocatable :: error

      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call fill(pattern, n_row, row_start, column)
      call give_force_callback(model%stepper, name, pattern, transfer(address, c_null_funptr), &
         error)
      call handle_pass(model, error, ierr)
   end subroutine give_force

   !> The mass between nodes.
   subroutine give_mass(handle, n_row, n_entry, row_start, column, value, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_row, n_entry
      integer(c_int), intent(in) :: row_start(n_row + 1), column(n_entry)
      real(c_double), intent(in) :: value(n_entry)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(csr_t) :: mass
      type(error_t), allocatable :: error

      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call fill(mass, n_row, row_start, column)
      mass%value = real(value, dp)
      call stepper_give_mass(model%stepper, mass, error)
      call handle_pass(model, error, ierr)
   end subroutine give_mass

   pure subroutine fill(matrix, n_row, row_start, column)
      type(csr_t), intent(out) :: matrix
      integer, intent(in) :: n_row
      integer(c_int), intent(in) :: row_start(:), column(:)

      matrix%n_row = n_row
      matrix%n_col = n_row
      matrix%row_start = row_start
      matrix%column = column
      allocate(matrix%value(size(column)), source=0.0_dp)
   end subroutine fill

end module emcon_flat_given
