!> The C interface: reading, building, and the run of the deck. What each function does is said in
!> emcon.h.
module emcon_c
   use, intrinsic :: iso_c_binding, only : c_associated, c_char, c_double, c_f_pointer, &
      c_f_procpointer, c_funptr, c_int, c_loc, c_null_ptr, c_ptr
   use emcon_c_border, only : as_increment, c_string, check_given, f_text, put_increment, &
      put_number
   use emcon_c_types, only : log_interface, progress_interface
   use emcon_deck_source, only : passage_t
   use emcon_errors, only : err_input, err_interrupt, err_none, error_t, raise
   use emcon_handle, only : find_built, find_model, find_read, handle_fail, handle_pass, model_t
   use emcon_kinds, only : wp
   use emcon_march, only : increment_t
   use emcon_run_log, only : model_lines
   use emcon_stepper, only : stepper_advance, stepper_build, stepper_close, stepper_fraction, &
      stepper_is_done, stepper_read, stepper_read_text
   use emcon_stepper_query, only : query_free
   use emcon_text, only : string_t
   use emcon_version, only : version
   implicit none
   private
   public :: emcon_version_c, emcon_read, emcon_read_text, emcon_read_passages, emcon_build
   public :: emcon_open, emcon_close
   public :: emcon_message, emcon_advance, emcon_is_done, emcon_run, new_handle

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

   !> Put a new model into a place of C; null if there is no such place.
   subroutine new_handle(place, model)
      type(c_ptr), intent(in) :: place
      type(model_t), pointer, intent(out) :: model
      type(c_ptr), pointer :: handle

      model => null()
      if (.not. c_associated(place)) return
      call c_f_pointer(place, handle)
      allocate(model)
      model%message = ""
      handle = c_loc(model)
   end subroutine new_handle

   integer(c_int) function emcon_read(deck, parameters, is_lenient, handle) bind(c)
      type(c_ptr), value :: deck, parameters, handle
      integer(c_int), value :: is_lenient
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      emcon_read = err_input
      call new_handle(handle, model)
      if (.not. associated(model)) return
      call check_given("deck", deck, error)
      if (.not. allocated(error)) call stepper_read(model%stepper, trim(f_text(deck)), &
         lines_of(f_text(parameters)), is_lenient /= 0, error)
      call pass_read(model, error, emcon_read)
   end function emcon_read

   integer(c_int) function emcon_read_text(text, name, parameters, is_lenient, handle) bind(c)
      type(c_ptr), value :: text, name, parameters, handle
      integer(c_int), value :: is_lenient
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      emcon_read_text = err_input
      call new_handle(handle, model)
      if (.not. associated(model)) return
      call check_given("text", text, error)
      call check_given("name", name, error)
      if (.not. allocated(error)) call stepper_read_text(model%stepper, f_text(text), &
         [passage_t()], lines_of(f_text(name)), lines_of(f_text(parameters)), is_lenient /= 0, &
         error)
      call pass_read(model, error, emcon_read_text)
   end function emcon_read_text

   integer(c_int) function emcon_read_passages(text, n_passage, passage, names, parameters, &
      is_lenient, handle) bind(c)
      type(c_ptr), value :: text, passage, names, parameters, handle
      integer(c_int), value :: n_passage, is_lenient
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      integer(c_int), pointer :: at(:, :)
      integer :: k

      emcon_read_passages = err_input
      call new_handle(handle, model)
      if (.not. associated(model)) return
      call check_given("text", text, error)
      call check_given("passage", passage, error)
      call check_given("names", names, error)
      if (.not. allocated(error) .and. n_passage < 1) call raise(error, err_input, &
         "n_passage is not above 0")
      if (.not. allocated(error)) then
         call c_f_pointer(passage, at, [4, int(n_passage)])
         call stepper_read_text(model%stepper, f_text(text), [(passage_t(at(1, k), at(2, k), &
            at(3, k), at(4, k) /= 0), k = 1, n_passage)], lines_of(f_text(names)), &
            lines_of(f_text(parameters)), is_lenient /= 0, error)
      end if
      call pass_read(model, error, emcon_read_passages)
   end function emcon_read_passages

   !> After a failure the message holds all that is wrong with the deck, one per line.
   subroutine pass_read(model, error, ierr)
      type(model_t), intent(inout) :: model
      type(error_t), allocatable, intent(in) :: error
      integer(c_int), intent(out) :: ierr
      integer :: i

      call handle_pass(model, error, ierr)
      if (.not. (allocated(error) .and. allocated(model%stepper%diagnostic))) return
      associate (text => model%stepper%diagnostic)
         do i = 1, size(text)
            if (text(i)%text /= error%message) model%message = model%message // new_line("a") // &
               text(i)%text
         end do
      end associate
   end subroutine pass_read

   !> The lines of a text.
   function lines_of(text) result(line)
      character(len=*), intent(in) :: text
      type(string_t), allocatable :: line(:)
      type(string_t) :: new(1)
      integer :: first, last

      allocate(line(0))
      first = 1
      do while (first <= len_trim(text))
         last = index(text(first:), new_line("a"))
         if (last == 0) last = len_trim(text) - first + 2
         new(1)%text = text(first:first + last - 2)
         line = [line, new]
         first = first + last
      end do
   end function lines_of

   integer(c_int) function emcon_build(handle) bind(c)
      type(c_ptr), value :: handle
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call find_read(handle, model, emcon_build)
      if (emcon_build /= err_none) return
      call stepper_build(model%stepper, error)
      call handle_pass(model, error, emcon_build)
   end function emcon_build

   integer(c_int) function emcon_open(deck, parameters, is_lenient, handle) bind(c)
      type(c_ptr), value :: deck, parameters, handle
      integer(c_int), value :: is_lenient
      type(c_ptr), pointer :: made

      emcon_open = emcon_read(deck, parameters, is_lenient, handle)
      if (emcon_open /= err_none) return
      call c_f_pointer(handle, made)
      emcon_open = emcon_build(made)
   end function emcon_open

   subroutine emcon_close(handle) bind(c)
      type(c_ptr), value :: handle
      type(model_t), pointer :: model
      integer(c_int) :: ierr

      call find_model(handle, model, ierr)
      if (.not. associated(model)) return
      call query_free(model%query)
      call stepper_close(model%stepper)
      deallocate(model)
   end subroutine emcon_close

   type(c_ptr) function emcon_message(handle) bind(c)
      type(c_ptr), value :: handle
      type(model_t), pointer :: model
      integer(c_int) :: ierr

      emcon_message = c_null_ptr
      call find_model(handle, model, ierr)
      if (ierr /= err_none) return
      model%c_text = c_string(model%message)
      emcon_message = c_loc(model%c_text)
   end function emcon_message

   integer(c_int) function emcon_advance(handle, increment) bind(c)
      type(c_ptr), value :: handle, increment
      type(model_t), pointer :: model
      type(increment_t) :: made

      call find_built(handle, model, emcon_advance)
      if (emcon_advance /= err_none) return
      call advance(model, made, emcon_advance)
      call put_increment(model, made, increment)
   end function emcon_advance

   subroutine advance(model, made, ierr)
      type(model_t), intent(inout) :: model
      type(increment_t), intent(out) :: made
      integer(c_int), intent(out) :: ierr
      type(error_t), allocatable :: error

      if (stepper_is_done(model%stepper)) then
         call handle_fail(model, "the analysis is at its end", err_input, ierr)
         return
      end if
      call stepper_advance(model%stepper, made, error)
      call handle_pass(model, error, ierr)
   end subroutine advance

   integer(c_int) function emcon_is_done(handle) bind(c)
      type(c_ptr), value :: handle
      type(model_t), pointer :: model
      integer(c_int) :: ierr

      emcon_is_done = 1
      call find_built(handle, model, ierr)
      if (ierr == err_none) emcon_is_done = merge(1, 0, stepper_is_done(model%stepper))
   end function emcon_is_done

   integer(c_int) function emcon_run(handle, time, progress, log, user) bind(c)
      type(c_ptr), value :: handle
      real(c_double), value :: time
      type(c_funptr), value :: progress, log
      type(c_ptr), value :: user
      procedure(progress_interface), pointer :: tell
      type(model_t), pointer :: model
      type(increment_t) :: made
      integer(c_int) :: answer

      call find_built(handle, model, emcon_run)
      if (emcon_run /= err_none) return
      if (.not. abs(time) <= huge(time)) then
         call handle_fail(model, "the time to run to is not finite", err_input, emcon_run)
         return
      end if
      tell => null()
      if (c_associated(progress)) call c_f_procpointer(progress, tell)
      if (model%stepper%march%state%increment == 0) call log_lines(model_lines(model%stepper), 0)
      do while (.not. is_reached())
         call advance(model, made, emcon_run)
         if (allocated(made%notes%item)) call log_lines(made%notes%item, made%notes%n)
         if (emcon_run /= err_none) return
         if (.not. associated(tell)) cycle
         answer = tell(user, as_increment(model, made), &
            real(stepper_fraction(model%stepper), c_double))
         if (answer == 0) cycle
         call handle_fail(model, "stopped by the callback", err_interrupt, emcon_run)
         return
      end do

   contains

      !> Is the state at `time`, up to the rounding of the grid?
      logical function is_reached()

         is_reached = stepper_is_done(model%stepper)
         if (is_reached) return
         associate (state => model%stepper%march%state)
            is_reached = state%time >= real(time, wp) - 64.0_wp*epsilon(1.0_wp)*abs(state%time)
         end associate
      end function is_reached

      subroutine log_lines(line, n)
         type(string_t), intent(in) :: line(:)
         integer, intent(in) :: n                !! the first ones; 0: all
         procedure(log_interface), pointer :: write_line
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

end module emcon_c
