!> The C interface: loads and boundary values between steps. What each function does is said in
!> emcon.h.
module emcon_c_conditions
   use, intrinsic :: iso_c_binding, only : c_double, c_int, c_ptr
   use emcon_c_border, only : put_number
   use emcon_errors, only : err_none, error_t
   use emcon_handle, only : find_built, handle_pass, model_t
   use emcon_kinds, only : wp
   use emcon_stepper, only : stepper_t
   use emcon_stepper_conditions, only : stepper_add_prescribed, stepper_find_load, &
      stepper_remove_prescribed, stepper_set_load, stepper_set_prescribed
   implicit none
   private
   public :: emcon_find_load, emcon_set_load
   public :: emcon_set_prescribed, emcon_add_prescribed, emcon_prescribe, &
      emcon_remove_prescribed

contains

   integer(c_int) function emcon_find_load(handle, kind, label, place, load) bind(c)
      type(c_ptr), value :: handle, load
      integer(c_int), value :: kind, label, place
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      integer :: i

      call find_built(handle, model, emcon_find_load)
      if (emcon_find_load /= err_none) return
      call stepper_find_load(model%stepper, int(kind), int(label), int(place), i, error)
      call put_number(i - 1, load)
      call handle_pass(model, error, emcon_find_load)
   end function emcon_find_load

   integer(c_int) function emcon_set_load(handle, load, value) bind(c)
      type(c_ptr), value :: handle
      integer(c_int), value :: load
      real(c_double), value :: value
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call find_built(handle, model, emcon_set_load)
      if (emcon_set_load /= err_none) return
      call stepper_set_load(model%stepper, int(load) + 1, real(value, wp), error)
      call handle_pass(model, error, emcon_set_load)
   end function emcon_set_load

   integer(c_int) function emcon_set_prescribed(handle, label, dof, value) bind(c)
      type(c_ptr), value :: handle
      integer(c_int), value :: label, dof
      real(c_double), value :: value
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call find_built(handle, model, emcon_set_prescribed)
      if (emcon_set_prescribed /= err_none) return
      call stepper_set_prescribed(model%stepper, int(label), int(dof), real(value, wp), error)
      call handle_pass(model, error, emcon_set_prescribed)
   end function emcon_set_prescribed

   integer(c_int) function emcon_add_prescribed(handle, label, dof, value) bind(c)
      type(c_ptr), value :: handle
      integer(c_int), value :: label, dof
      real(c_double), value :: value
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call find_built(handle, model, emcon_add_prescribed)
      if (emcon_add_prescribed /= err_none) return
      call stepper_add_prescribed(model%stepper, int(label), int(dof), real(value, wp), error)
      call handle_pass(model, error, emcon_add_prescribed)
   end function emcon_add_prescribed

   integer(c_int) function emcon_prescribe(handle, label, dof, value) bind(c)
      type(c_ptr), value :: handle
      integer(c_int), value :: label, dof
      real(c_double), value :: value
      type(model_t), pointer :: model

      call find_built(handle, model, emcon_prescribe)
      if (emcon_prescribe /= err_none) return
      if (is_prescribed(model%stepper, int(label), int(dof))) then
         emcon_prescribe = emcon_set_prescribed(handle, label, dof, value)
      else
         emcon_prescribe = emcon_add_prescribed(handle, label, dof, value)
      end if
   end function emcon_prescribe

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

   integer(c_int) function emcon_remove_prescribed(handle, label, dof) bind(c)
      type(c_ptr), value :: handle
      integer(c_int), value :: label, dof
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call find_built(handle, model, emcon_remove_prescribed)
      if (emcon_remove_prescribed /= err_none) return
      call stepper_remove_prescribed(model%stepper, int(label), int(dof), error)
      call handle_pass(model, error, emcon_remove_prescribed)
   end function emcon_remove_prescribed

end module emcon_c_conditions
