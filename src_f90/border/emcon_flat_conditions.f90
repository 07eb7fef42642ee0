!> Flat interface, as emcon_flat: loads and boundary values of the present step of the deck.
module emcon_flat_conditions
   use, intrinsic :: iso_c_binding, only : c_double, c_int, c_int64_t
   use emcon_errors, only : error_t
   use emcon_handle, only : handle_find, handle_pass, model_t
   use emcon_kinds, only : wp
   use emcon_stepper, only : stepper_t
   use emcon_stepper_conditions, only : stepper_add_prescribed, stepper_find_load, &
      stepper_remove_prescribed, stepper_set_load, stepper_set_prescribed
   use emcon_stepper_free, only : stepper_check_open
   implicit none
   private
   public :: set_loads, prescribe, release

contains

   !> Give loads of one kind (1 point, 2 pressure, 3 gravity) new values. `label`: of nodes or
   !> elements, `place`: degrees of freedom or faces. On an error nothing changes.
   subroutine set_loads(handle, kind, label, place, value, n, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: kind
      integer(c_int), intent(in) :: n
      integer(c_int), intent(in) :: label(n), place(n)
      real(c_double), intent(in) :: value(n)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      integer :: i, load(n)

      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      do i = 1, n
         call stepper_find_load(model%stepper, int(kind), int(label(i)), int(place(i)), load(i), &
            error)
         if (allocated(error)) exit
      end do
      do i = 1, n
         if (allocated(error)) exit
         call stepper_set_load(model%stepper, load(i), real(value(i), wp), error)
      end do
      call handle_pass(model, error, ierr)
   end subroutine set_loads

   !> Prescribe the displacement of degree of freedom `dof` of node `label`, free before or not.
   subroutine prescribe(handle, label, dof, value, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: label, dof
      real(c_double), intent(in) :: value
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      !f2py threadsafe

      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call stepper_check_open(model%stepper, error)
      if (.not. allocated(error)) then
         if (is_prescribed(model%stepper, int(label), int(dof))) then
            call stepper_set_prescribed(model%stepper, int(label), int(dof), real(value, wp), error)
         else
            call stepper_add_prescribed(model%stepper, int(label), int(dof), real(value, wp), error)
         end if
      end if
      call handle_pass(model, error, ierr)
   end subroutine prescribe

   !> Is there a condition on this degree of freedom in the present step?
   pure logical function is_prescribed(stepper, label, dof)
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: label, dof
      integer :: node

      node = findloc(stepper%scene%node_label, label, 1)
      associate (list => stepper%scene%step(stepper%march%state%i_step)%prescribed)
         is_prescribed = any(list%node == node .and. list%dof == dof)
      end associate
   end function is_prescribed

   !> Set a prescribed degree of freedom free.
   subroutine release(handle, label, dof, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: label, dof
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      !f2py threadsafe

      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call stepper_remove_prescribed(model%stepper, int(label), int(dof), error)
      call handle_pass(model, error, ierr)
   end subroutine release

end module emcon_flat_conditions
