!> The C interface; what each function does is said in emcon.h.
module emcon_c
   use, intrinsic :: iso_c_binding, only : c_associated, c_char, c_double, c_f_pointer, &
      c_f_procpointer, c_funptr, c_int, c_int64_t, c_loc, c_null_char, c_null_ptr, c_ptr
   use emcon_errors, only : err_input, err_interrupt, err_none, error_t
   use emcon_handle, only : handle_build, handle_fail, handle_find, handle_fits, handle_free, &
      handle_new, handle_pass, handle_read, model_t
   use emcon_kinds, only : wp
   use emcon_march, only : increment_t
   use emcon_run_log, only : model_lines
   use emcon_stepper, only : stepper_advance, stepper_fraction, stepper_is_done
   use emcon_text, only : string_t
   use emcon_version, only : version
   implicit none
   private
   public :: emcon_version_c, emcon_open, emcon_close, emcon_message, emcon_get_sizes
   public :: emcon_advance, emcon_is_done, emcon_run, emcon_get_time, emcon_get_ledger
   public :: emcon_get_labels, emcon_get_positions, emcon_get_state, emcon_get_contact

   type, bind(c) :: sizes_c
      integer(c_int) :: n_node, n_element, n_contact, n_pair, n_body, n_unknown, n_step
   end type sizes_c

   type, bind(c) :: increment_c
      real(c_double) :: h, time
      integer(c_int) :: n_newton, n_cut, n_active
   end type increment_c

   type, bind(c) :: ledger_c
      real(c_double) :: kinetic, strain, external_work, contact_work, total, px, py, lz
   end type ledger_c

   abstract interface
      function progress_interface(user, increment, fraction) result(stop) bind(c)
         import :: c_double, c_int, c_ptr, increment_c
         implicit none
         type(c_ptr), value :: user
         type(increment_c), intent(in) :: increment
         real(c_double), value :: fraction
         integer(c_int) :: stop
      end function progress_interface

      subroutine log_interface(user, line) bind(c)
         import :: c_ptr
         implicit none
         type(c_ptr), value :: user, line
      end subroutine log_interface
   end interface

contains

   subroutine emcon_version_c(major, minor, patch) bind(c, name="emcon_version")
      integer(c_int), intent(out) :: major, minor, patch
      character(len=len(version)) :: text
      integer :: number(3), i

      text = version
      do i = 1, len(text)
         if (text(i:i) == ".") text(i:i) = " "
      end do
      read (text, *) number
      major = number(1)
      minor = number(2)
      patch = number(3)
   end subroutine emcon_version_c

   !> The model of a C handle; null for NULL.
   subroutine find(handle, model)
      type(c_ptr), intent(in) :: handle
      type(model_t), pointer, intent(out) :: model

      call handle_find(transfer(handle, 0_c_int64_t), model)
   end subroutine find

   integer(c_int) function emcon_open(deck, parameters, is_lenient, handle) bind(c)
      type(c_ptr), value :: deck, parameters
      integer(c_int), value :: is_lenient
      type(c_ptr), intent(out) :: handle
      integer(c_int64_t) :: address

      address = handle_new()
      handle = transfer(address, c_null_ptr)
      call handle_read(address, f_text(deck), f_text(parameters), is_lenient /= 0, emcon_open)
      if (emcon_open == err_none) call handle_build(address, emcon_open)
   end function emcon_open

   subroutine emcon_close(handle) bind(c)
      type(c_ptr), value :: handle

      call handle_free(transfer(handle, 0_c_int64_t))
   end subroutine emcon_close

   type(c_ptr) function emcon_message(handle) bind(c)
      type(c_ptr), value :: handle
      type(model_t), pointer :: model

      emcon_message = c_null_ptr
      call find(handle, model)
      if (.not. associated(model)) return
      model%c_text = c_string(model%message)
      emcon_message = c_loc(model%c_text)
   end function emcon_message

   integer(c_int) function emcon_get_sizes(handle, sizes) bind(c)
      type(c_ptr), value :: handle
      type(sizes_c), intent(out) :: sizes
      type(model_t), pointer :: model

      sizes = sizes_c(0, 0, 0, 0, 0, 0, 0)
      emcon_get_sizes = err_input
      call find(handle, model)
      if (.not. associated(model)) return
      emcon_get_sizes = err_none
      associate (system => model%stepper%march%system)
         sizes%n_node = system%solid%n_node
         sizes%n_element = system%solid%n_element
         sizes%n_contact = system%n_constraint - system%linear%n
         sizes%n_pair = size(system%contact)
         sizes%n_body = system%n_body
         sizes%n_unknown = system%numbering%n_unknown
         sizes%n_step = size(model%stepper%scene%step)
      end associate
   end function emcon_get_sizes

   integer(c_int) function emcon_advance(handle, increment) bind(c)
      type(c_ptr), value :: handle, increment
      type(model_t), pointer :: model
      type(increment_c), pointer :: to
      type(increment_t) :: made

      emcon_advance = err_input
      call find(handle, model)
      if (.not. associated(model)) return
      call advance(model, made, emcon_advance)
      if (.not. c_associated(increment)) return
      call c_f_pointer(increment, to)
      to = as_c(model, made)
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

   pure type(increment_c) function as_c(model, made)
      type(model_t), intent(in) :: model
      type(increment_t), intent(in) :: made

      as_c%h = real(made%h, c_double)
      as_c%time = real(model%stepper%march%state%time, c_double)
      as_c%n_newton = made%n_newton
      as_c%n_cut = made%n_cut
      as_c%n_active = made%n_active
   end function as_c

   integer(c_int) function emcon_is_done(handle) bind(c)
      type(c_ptr), value :: handle
      type(model_t), pointer :: model

      emcon_is_done = 1
      call find(handle, model)
      if (.not. associated(model)) return
      emcon_is_done = merge(1, 0, stepper_is_done(model%stepper))
   end function emcon_is_done

   integer(c_int) function emcon_run(handle, time, progress, log, user) bind(c)
      type(c_ptr), value :: handle
      real(c_double), value :: time
      type(c_funptr), value :: progress, log
      type(c_ptr), value :: user
      procedure(progress_interface), pointer :: tell
      type(model_t), pointer :: model
      type(increment_t) :: made
      integer(c_int) :: stop

      emcon_run = err_input
      call find(handle, model)
      if (.not. associated(model)) return
      if (.not. abs(time) <= huge(time)) then
         call handle_fail(model, "the time to run to is not finite", err_input, emcon_run)
         return
      end if
      tell => null()
      if (c_associated(progress)) call c_f_procpointer(progress, tell)
      emcon_run = err_none
      if (model%stepper%march%state%increment == 0) call log_lines(model_lines(model%stepper), 0)
      do while (.not. is_reached())
         call advance(model, made, emcon_run)
         if (allocated(made%notes%item)) call log_lines(made%notes%item, made%notes%n)
         if (emcon_run /= err_none) return
         if (.not. associated(tell)) cycle
         stop = tell(user, as_c(model, made), real(stepper_fraction(model%stepper), c_double))
         if (stop == 0) cycle
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

   integer(c_int) function emcon_get_time(handle, time) bind(c)
      type(c_ptr), value :: handle
      real(c_double), intent(out) :: time
      type(model_t), pointer :: model

      time = 0.0_c_double
      emcon_get_time = err_input
      call find(handle, model)
      if (.not. associated(model)) return
      emcon_get_time = err_none
      time = real(model%stepper%march%state%time, c_double)
   end function emcon_get_time

   integer(c_int) function emcon_get_ledger(handle, to) bind(c)
      type(c_ptr), value :: handle
      type(ledger_c), intent(out) :: to
      type(model_t), pointer :: model

      emcon_get_ledger = err_input
      call find(handle, model)
      if (.not. associated(model)) return
      emcon_get_ledger = err_none
      associate (ledger => model%stepper%march%ledger)
         to%kinetic = real(ledger%kinetic, c_double)
         to%strain = real(ledger%strain, c_double)
         to%external_work = real(ledger%external_work, c_double)
         to%contact_work = real(ledger%contact_work, c_double)
         to%total = real(ledger%total, c_double)
         to%px = real(ledger%momentum(1), c_double)
         to%py = real(ledger%momentum(2), c_double)
         to%lz = real(ledger%angular, c_double)
      end associate
   end function emcon_get_ledger

   integer(c_int) function emcon_get_labels(handle, n_node, label) bind(c)
      type(c_ptr), value :: handle
      integer(c_int), value :: n_node
      type(c_ptr), value :: label
      type(model_t), pointer :: model

      emcon_get_labels = err_input
      call find(handle, model)
      if (.not. associated(model)) return
      if (.not. handle_fits(model, n_node, size(model%stepper%scene%x, 2), emcon_get_labels)) return
      call put_integers(model%stepper%scene%node_label, label)
   end function emcon_get_labels

   integer(c_int) function emcon_get_positions(handle, n_node, x) bind(c)
      type(c_ptr), value :: handle, x
      integer(c_int), value :: n_node
      type(model_t), pointer :: model

      emcon_get_positions = err_input
      call find(handle, model)
      if (.not. associated(model)) return
      if (.not. handle_fits(model, n_node, size(model%stepper%scene%x, 2), &
         emcon_get_positions)) return
      call put(model%stepper%scene%x, x)
   end function emcon_get_positions

   integer(c_int) function emcon_get_state(handle, n_node, u, v) bind(c)
      type(c_ptr), value :: handle, u, v
      integer(c_int), value :: n_node
      type(model_t), pointer :: model

      emcon_get_state = err_input
      call find(handle, model)
      if (.not. associated(model)) return
      if (.not. handle_fits(model, n_node, size(model%stepper%scene%x, 2), emcon_get_state)) return
      call put(model%stepper%march%state%u, u)
      call put(model%stepper%march%state%v, v)
   end function emcon_get_state

   !> Copy a field to an array of C, if there is one.
   subroutine put(field, to)
      real(wp), intent(in) :: field(:, :)
      type(c_ptr), intent(in) :: to
      real(c_double), pointer :: array(:, :)

      if (.not. c_associated(to)) return
      call c_f_pointer(to, array, shape(field))
      array = real(field, c_double)
   end subroutine put

   integer(c_int) function emcon_get_contact(handle, n_contact, lam, is_active, label, pair) bind(c)
      type(c_ptr), value :: handle, lam, is_active, label, pair
      integer(c_int), value :: n_contact
      type(model_t), pointer :: model
      integer :: i, before
      integer, allocatable :: of_node(:), of_pair(:)

      emcon_get_contact = err_input
      call find(handle, model)
      if (.not. associated(model)) return
      associate (system => model%stepper%march%system, state => model%stepper%march%state)
         before = system%linear%n
         if (.not. handle_fits(model, n_contact, system%n_constraint - before, &
         emcon_get_contact)) return
         call put(reshape(state%lam(before + 1:), [1, int(n_contact)]), lam)
         call put_integers(merge(1, 0, state%is_active(before + 1:)), is_active)
         allocate(of_node(n_contact), of_pair(n_contact))
         do i = 1, size(system%contact)
            associate (first => system%first_constraint(i) - before + 1, &
                  last => system%first_constraint(i + 1) - before)
               of_node(first:last) = &
                  model%stepper%scene%node_label(system%contact(i)%contact%node)
               of_pair(first:last) = i - 1
            end associate
         end do
         call put_integers(of_node, label)
         call put_integers(of_pair, pair)
      end associate
   end function emcon_get_contact

   subroutine put_integers(list, to)
      integer, intent(in) :: list(:)
      type(c_ptr), intent(in) :: to
      integer(c_int), pointer :: array(:)

      if (.not. c_associated(to)) return
      call c_f_pointer(to, array, shape(list))
      array = list
   end subroutine put_integers

   !> The text of C up to its end; "" for NULL.
   function f_text(text) result(copy)
      type(c_ptr), intent(in) :: text
      character(len=:), allocatable :: copy
      character(kind=c_char), pointer :: from(:)
      integer :: i, n

      copy = ""
      if (.not. c_associated(text)) return
      call c_f_pointer(text, from, [huge(1)])
      n = 0
      do while (from(n + 1) /= c_null_char)
         n = n + 1
      end do
      deallocate(copy)
      allocate(character(len=n) :: copy)
      do i = 1, n
         copy(i:i) = from(i)
      end do
   end function f_text

   !> The same the other way round.
   pure function c_string(text) result(copy)
      character(len=*), intent(in) :: text
      character(kind=c_char) :: copy(len(text) + 1)
      integer :: i

      do i = 1, len(text)
         copy(i) = text(i:i)
      end do
      copy(size(copy)) = c_null_char
   end function c_string

end module emcon_c
