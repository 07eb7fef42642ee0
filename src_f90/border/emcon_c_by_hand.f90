! build: holder
!> The C functions that are no calls of one procedure with a status. What each does is said in
!> emcon.h.
module emcon_c_by_hand
   use, intrinsic :: iso_c_binding, only : c_associated, c_char, c_double, c_f_pointer, &
      c_f_procpointer, c_funptr, c_int, c_loc, c_null_ptr, c_ptr
   use emcon_c_border, only : c_string, f_text, put_address, put_matrix, put_number
   use emcon_c_types, only : increment_c, log_c, progress_c
   use emcon_errors, only : err_analysis, err_input, err_interrupt, err_none, error_t, raise
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t
   use emcon_model, only : find_built, find_model, handle_fail, handle_pass, model_t
   use emcon_model_record, only : model_end_record, model_field
   use emcon_model_run, only : model_go
   use emcon_run_log, only : model_lines
   use emcon_stepper, only : stepper_close, stepper_fraction, stepper_is_done
   use emcon_stepper_free, only : snapshot_t
   use emcon_stepper_null_space, only : query_null_space
   use emcon_stepper_query, only : query_free
   use emcon_text, only : string_t
   use emcon_version, only : version
   implicit none
   private
   public :: emcon_version_c, emcon_close, emcon_message, emcon_is_done, emcon_run
   public :: emcon_free_snapshot, emcon_get_field, emcon_null_space_c

contains

   subroutine emcon_version_c(major, minor, patch) bind(c, name="emcon_version")
      type(c_ptr), value :: major, minor, patch
      character(len=len(version)) :: text
      integer :: number(3), i

      text = version
      do i = 1, len(text)
         if (text(i:i) == ".") text(i:i) = " "
      end do
      read (text, *) number
      call put_number(number(1), major)
      call put_number(number(2), minor)
      call put_number(number(3), patch)
   end subroutine emcon_version_c

   subroutine emcon_close(handle) bind(c)
      type(c_ptr), value :: handle
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      integer(c_int) :: ierr

      call find_model(handle, model, ierr)
      if (.not. associated(model)) return
      call model_end_record(model, error)        ! nobody is left who could be told
      call query_free(model%query)
      call stepper_close(model%stepper)
      deallocate(model)
   end subroutine emcon_close

   subroutine emcon_free_snapshot(kept) bind(c)
      type(c_ptr), value :: kept
      type(snapshot_t), pointer :: snapshot

      if (.not. c_associated(kept)) return
      call c_f_pointer(kept, snapshot)
      deallocate(snapshot)
   end subroutine emcon_free_snapshot

   integer(c_int) function emcon_get_field(handle, name, n_place, n_component, value) &
      result(status) bind(c)
      type(c_ptr), value :: handle, name, n_place, n_component, value
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(dp), allocatable :: found(:, :)

      call find_built(handle, model, status)
      if (status /= err_none) return
      call put_address(c_null_ptr, value)
      call put_number(0, n_place)
      call put_number(0, n_component)
      call model_field(model, f_text(name), found, error)
      if (.not. allocated(error)) then
         model%c_field = real(found, c_double)
         call put_number(size(found, 2), n_place)
         call put_number(size(found, 1), n_component)
         if (size(found) > 0) call put_address(c_loc(model%c_field), value)
      end if
      call handle_pass(model, error, status)
   end function emcon_get_field

   type(c_ptr) function emcon_message(handle) bind(c)
      type(c_ptr), value :: handle
      type(model_t), pointer :: model
      integer(c_int) :: ierr

      emcon_message = c_null_ptr
      call find_model(handle, model, ierr)
      if (ierr /= err_none) return
      model%c_message%c = c_string(model%message)
      emcon_message = c_loc(model%c_message%c)
   end function emcon_message

   integer(c_int) function emcon_is_done(handle) bind(c)
      type(c_ptr), value :: handle
      type(model_t), pointer :: model
      integer(c_int) :: ierr

      emcon_is_done = 1
      call find_built(handle, model, ierr)
      if (ierr == err_none) emcon_is_done = merge(1, 0, stepper_is_done(model%stepper))
   end function emcon_is_done

   integer(c_int) function emcon_run(handle, time, progress, log, user) result(status) bind(c)
      type(c_ptr), value :: handle
      real(c_double), value :: time
      type(c_funptr), value :: progress, log
      type(c_ptr), value :: user
      procedure(progress_c), pointer :: tell
      type(model_t), pointer :: model
      type(increment_t) :: made
      type(increment_c), target :: increment
      real(c_double) :: done
      type(error_t), allocatable :: error

      call find_built(handle, model, status)
      if (status /= err_none) return
      if (.not. abs(time) <= huge(time)) then
         call handle_fail(model, "the time to run to is not finite", err_input, status)
         return
      end if
      tell => null()
      if (c_associated(progress)) call c_f_procpointer(progress, tell)
      if (model%stepper%march%state%clock%increment &
         == 0) call log_lines(model_lines(model%stepper), 0)
      do while (.not. is_reached())
         call model_go(model, made, increment, error)
         if (allocated(made%notes%item)) call log_lines(made%notes%item, made%notes%n)
         call handle_pass(model, error, status)
         if (allocated(error)) return
         if (.not. associated(tell)) cycle
         done = real(stepper_fraction(model%stepper), c_double)
         if (tell(user, c_loc(increment), done) == 0) cycle
         call handle_fail(model, "stopped by the callback", err_interrupt, status)
         return
      end do

   contains

      !> Is the state at `time`, up to the rounding of the grid?
      logical function is_reached()

         is_reached = stepper_is_done(model%stepper)
         if (is_reached) return
         associate (state => model%stepper%march%state)
            is_reached = state%clock%time >= real(time, wp) &
               - 64.0_wp*epsilon(1.0_wp)*abs(state%clock%time)
         end associate
      end function is_reached

      subroutine log_lines(line, n)
         type(string_t), intent(in) :: line(:)
         integer, intent(in) :: n                !! the first ones; 0: all
         procedure(log_c), pointer :: write_line
         character(kind=c_char), allocatable, target :: text(:)
         integer :: i

         if (.not. c_associated(log)) return
         call c_f_procpointer(log, write_line)
         do i = 1, merge(n, size(line), n > 0)
            text = c_string(line(i)%text)
            call write_line(user, c_loc(text))
         end do
      end subroutine log_lines

   end function emcon_run

   integer(c_int) function emcon_null_space_c(handle, p, df, n_redundant, redundant) &
      result(status) bind(c, name="emcon_null_space")
      type(c_ptr), value :: handle, p, df, n_redundant, redundant
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      integer, allocatable :: place(:)

      call find_built(handle, model, status)
      if (status /= err_none) return
      call query_null_space(model%query, model%p, model%df, place, error)
      if (size(place) > 0 .and. .not. c_associated(n_redundant)) call raise(error, err_analysis, &
         "there is no null space: some of the constraints that act are redundant")
      call put_matrix(model%p, p)
      call put_matrix(model%df, df)
      call put_number(size(place), n_redundant)
      model%c_redundant = int(place - 1, c_int)
      call put_address(c_null_ptr, redundant)
      if (size(place) > 0) call put_address(c_loc(model%c_redundant), redundant)
      call handle_pass(model, error, status)
   end function emcon_null_space_c

end module emcon_c_by_hand
