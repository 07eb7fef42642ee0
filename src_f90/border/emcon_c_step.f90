!> The C interface: steps of any size, states in, snapshots, and the file of a state. What each
!> function does is said in emcon.h.
module emcon_c_step
   use, intrinsic :: iso_c_binding, only : c_associated, c_double, c_f_pointer, c_int, c_loc, &
      c_null_ptr, c_ptr
   use emcon_c, only : new_handle
   use emcon_c_border, only : check_given, f_text, put_increment, take_field, take_flags, &
      take_values
   use emcon_errors, only : err_input, err_none, error_t
   use emcon_handle, only : find_built, find_read, handle_pass, model_t
   use emcon_kinds, only : wp
   use emcon_march, only : increment_t
   use emcon_restart, only : restart_read, restart_t, restart_write
   use emcon_stepper, only : stepper_check_solids, stepper_load, stepper_save
   use emcon_stepper_conditions, only : conditions_load, conditions_save
   use emcon_stepper_free, only : snapshot_t, stepper_next_step, stepper_restore, &
      stepper_set_state, stepper_snapshot, stepper_step
   implicit none
   private
   public :: emcon_step, emcon_next_step, emcon_set_state, emcon_save, emcon_load, emcon_resume
   public :: emcon_take_snapshot, emcon_restore_snapshot, emcon_free_snapshot

contains

   integer(c_int) function emcon_step(handle, h, increment) bind(c)
      type(c_ptr), value :: handle, increment
      real(c_double), value :: h
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      type(increment_t) :: made

      call find_built(handle, model, emcon_step)
      if (emcon_step /= err_none) return
      call stepper_step(model%stepper, real(h, wp), made, error)
      call put_increment(model, made, increment)
      call handle_pass(model, error, emcon_step)
   end function emcon_step

   integer(c_int) function emcon_next_step(handle) bind(c)
      type(c_ptr), value :: handle
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call find_built(handle, model, emcon_next_step)
      if (emcon_next_step /= err_none) return
      call stepper_next_step(model%stepper, error)
      call handle_pass(model, error, emcon_next_step)
   end function emcon_next_step

   integer(c_int) function emcon_set_state(handle, n_node, u, v, n_constraint, lam, is_active, &
      time) bind(c)
      type(c_ptr), value :: handle, u, v, lam, is_active, time
      integer(c_int), value :: n_node, n_constraint
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: new_u(:, :), new_v(:, :), new_lam(:), new_time
      logical, allocatable :: acts(:)
      real(c_double), pointer :: given_time

      call find_built(handle, model, emcon_set_state)
      if (emcon_set_state /= err_none) return
      associate (state => model%stepper%march%state)
         call take_field(u, n_node, size(state%u, 2), new_u, error)
         call take_field(v, n_node, size(state%u, 2), new_v, error)
         call take_values("n_constraint", lam, n_constraint, size(state%lam), new_lam, error)
         call take_flags("n_constraint", is_active, n_constraint, size(state%lam), acts, error)
      end associate
      if (c_associated(time)) then
         call c_f_pointer(time, given_time)
         allocate(new_time, source=real(given_time, wp))
      end if
      if (.not. allocated(error)) call stepper_set_state(model%stepper, error, new_u, new_v, &
         new_lam, acts, new_time)
      call handle_pass(model, error, emcon_set_state)
   end function emcon_set_state

   integer(c_int) function emcon_take_snapshot(handle, place) bind(c)
      type(c_ptr), value :: handle, place
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      type(snapshot_t), pointer :: snapshot
      type(c_ptr), pointer :: made

      if (c_associated(place)) then
         call c_f_pointer(place, made)
         made = c_null_ptr
      end if
      call find_built(handle, model, emcon_take_snapshot)
      if (emcon_take_snapshot /= err_none) return
      call check_given("snapshot", place, error)
      call handle_pass(model, error, emcon_take_snapshot)
      if (allocated(error)) return
      allocate(snapshot)
      call stepper_snapshot(model%stepper, snapshot)
      made = c_loc(snapshot)
   end function emcon_take_snapshot

   integer(c_int) function emcon_restore_snapshot(handle, kept) bind(c)
      type(c_ptr), value :: handle, kept
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      type(snapshot_t), pointer :: snapshot

      call find_built(handle, model, emcon_restore_snapshot)
      if (emcon_restore_snapshot /= err_none) return
      call check_given("snapshot", kept, error)
      if (.not. allocated(error)) then
         call c_f_pointer(kept, snapshot)
         call stepper_restore(model%stepper, snapshot, error)
      end if
      call handle_pass(model, error, emcon_restore_snapshot)
   end function emcon_restore_snapshot

   subroutine emcon_free_snapshot(kept) bind(c)
      type(c_ptr), value :: kept
      type(snapshot_t), pointer :: snapshot

      if (.not. c_associated(kept)) return
      call c_f_pointer(kept, snapshot)
      deallocate(snapshot)
   end subroutine emcon_free_snapshot

   integer(c_int) function emcon_save(handle, path) bind(c)
      type(c_ptr), value :: handle, path
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      type(restart_t) :: restart

      call find_built(handle, model, emcon_save)
      if (emcon_save /= err_none) return
      call check_given("path", path, error)
      if (.not. allocated(error)) call stepper_check_solids(model%stepper, error)
      if (.not. allocated(error)) then
         call stepper_save(model%stepper, restart)
         call conditions_save(model%stepper, restart)
         call restart_write(restart, f_text(path), error)
      end if
      call handle_pass(model, error, emcon_save)
   end function emcon_save

   integer(c_int) function emcon_load(path, handle) bind(c)
      type(c_ptr), value :: path, handle
      type(model_t), pointer :: model

      emcon_load = err_input
      call new_handle(handle, model)
      if (associated(model)) call load(model, path, emcon_load)
   end function emcon_load

   integer(c_int) function emcon_resume(handle, path) bind(c)
      type(c_ptr), value :: handle, path
      type(model_t), pointer :: model

      call find_read(handle, model, emcon_resume)
      if (emcon_resume == err_none) call load(model, path, emcon_resume)
   end function emcon_resume

   !> Build the model of a restart file, in the state that it holds.
   subroutine load(model, path, ierr)
      type(model_t), intent(inout) :: model
      type(c_ptr), intent(in) :: path
      integer(c_int), intent(out) :: ierr
      type(error_t), allocatable :: error
      type(restart_t) :: restart

      call check_given("path", path, error)
      if (.not. allocated(error)) call restart_read(restart, f_text(path), error)
      if (.not. allocated(error)) call stepper_load(model%stepper, restart, error)
      if (.not. allocated(error)) call conditions_load(model%stepper, restart, error)
      if (allocated(error)) model%stepper%is_read = .false.    ! there is nothing to work with
      call handle_pass(model, error, ierr)
   end subroutine load

end module emcon_c_step
