!> The C functions that read a model and step it, in Fortran. What each does is said in emcon.h.
module emcon_model_run
   use, intrinsic :: iso_c_binding, only : c_double
   use emcon_c_types, only : increment_c
   use emcon_deck_source, only : passage_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_march, only : increment_t
   use emcon_model, only : model_t
   use emcon_model_record, only : model_keep
   use emcon_restart, only : restart_read, restart_t, restart_write
   use emcon_stepper, only : stepper_advance, stepper_build, stepper_check_solids, &
      stepper_is_done, stepper_read, stepper_read_text
   use emcon_stepper_conditions, only : conditions_exchange
   use emcon_stepper_file, only : stepper_load, stepper_save
   use emcon_stepper_free, only : stepper_step
   use emcon_text, only : string_t
   implicit none
   private
   public :: model_read, model_read_text, model_read_passages, model_open
   public :: model_advance, model_go, model_step, model_save, model_load

contains

   subroutine model_read(model, deck, parameters, is_lenient, error)
      type(model_t), intent(inout) :: model
      character(len=*), intent(in) :: deck           !! its path
      character(len=*), intent(in) :: parameters     !! lines NAME=VALUE
      logical, intent(in) :: is_lenient
      type(error_t), allocatable, intent(out) :: error

      call stepper_read(model%stepper, trim(deck), lines_of(parameters), is_lenient, error)
      call tell_all(model, error)
   end subroutine model_read

   subroutine model_read_text(model, text, name, parameters, is_lenient, error)
      type(model_t), intent(inout) :: model
      character(len=*), intent(in) :: text, name, parameters
      logical, intent(in) :: is_lenient
      type(error_t), allocatable, intent(out) :: error

      call stepper_read_text(model%stepper, text, [passage_t()], lines_of(name), &
         lines_of(parameters), is_lenient, error)
      call tell_all(model, error)
   end subroutine model_read_text

   subroutine model_read_passages(model, text, passage, names, parameters, is_lenient, error)
      type(model_t), intent(inout) :: model
      character(len=*), intent(in) :: text, names, parameters
      integer, intent(in) :: passage(:, :)           !! (4, n_passage)
      logical, intent(in) :: is_lenient
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      if (size(passage, 2) == 0) then
         call raise(error, err_input, "n_passage is not above 0")
         return
      end if
      call stepper_read_text(model%stepper, text, [(passage_t(passage(1, k), passage(2, k), &
         passage(3, k), passage(4, k) /= 0), k = 1, size(passage, 2))], lines_of(names), &
         lines_of(parameters), is_lenient, error)
      call tell_all(model, error)
   end subroutine model_read_passages

   subroutine model_open(model, deck, parameters, is_lenient, error)
      type(model_t), intent(inout) :: model
      character(len=*), intent(in) :: deck, parameters
      logical, intent(in) :: is_lenient
      type(error_t), allocatable, intent(out) :: error

      call model_read(model, deck, parameters, is_lenient, error)
      if (.not. allocated(error)) call stepper_build(model%stepper, error)
   end subroutine model_open

   !> Let the message of a failure hold all that is wrong with the deck, one per line.
   subroutine tell_all(model, error)
      type(model_t), intent(in) :: model
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: first
      integer :: i

      if (.not. (allocated(error) .and. allocated(model%stepper%diagnostic))) return
      first = error%message
      associate (text => model%stepper%diagnostic)
         do i = 1, size(text)
            if (text(i)%text /= first) error%message = error%message // new_line("a") // &
               text(i)%text
         end do
      end associate
   end subroutine tell_all

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

   subroutine model_advance(model, increment, error)
      type(model_t), intent(inout) :: model
      type(increment_c), intent(out) :: increment
      type(error_t), allocatable, intent(out) :: error
      type(increment_t) :: made

      call model_go(model, made, increment, error)
   end subroutine model_advance

   !> One increment on the grid of the deck, as Fortran and as C has it.
   subroutine model_go(model, made, increment, error)
      type(model_t), intent(inout) :: model
      type(increment_t), intent(out) :: made
      type(increment_c), intent(out) :: increment
      type(error_t), allocatable, intent(out) :: error

      if (stepper_is_done(model%stepper)) then
         call raise(error, err_input, "the analysis is at its end")
      else
         call stepper_advance(model%stepper, made, error)
      end if
      increment = as_increment(model, made)
      call model_keep(model, made, error)
   end subroutine model_go

   subroutine model_step(model, h, increment, error)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: h
      type(increment_c), intent(out) :: increment
      type(error_t), allocatable, intent(out) :: error
      type(increment_t) :: made

      call stepper_step(model%stepper, h, made, error)
      increment = as_increment(model, made)
      call model_keep(model, made, error)
   end subroutine model_step

   pure type(increment_c) function as_increment(model, made)
      type(model_t), intent(in) :: model
      type(increment_t), intent(in) :: made

      as_increment%h = real(made%h, c_double)
      as_increment%time = real(model%stepper%march%state%clock%time, c_double)
      as_increment%n_newton = made%n_newton
      as_increment%n_cut = made%n_cut
      as_increment%n_active = made%n_active
      as_increment%penetration = real(max(made%overlap%depth, made%stray%depth), c_double)
   end function as_increment

   subroutine model_save(model, path, error)
      type(model_t), intent(inout) :: model
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error
      type(restart_t) :: restart

      call stepper_check_solids(model%stepper, error)
      if (allocated(error)) return
      call stepper_save(model%stepper, restart)
      call conditions_exchange(model%stepper, restart, error)
      if (.not. allocated(error)) call restart_write(restart, path, error)
   end subroutine model_save

   !> Build the model of a restart file, in the state that it holds.
   subroutine model_load(model, path, error)
      type(model_t), intent(inout) :: model
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error
      type(restart_t) :: restart

      call restart_read(restart, path, error)
      if (.not. allocated(error)) call stepper_load(model%stepper, restart, error)
      if (allocated(error)) return
      call conditions_exchange(model%stepper, restart, error)
      if (allocated(error)) model%stepper%is_read = .false.    ! there is nothing to work with
   end subroutine model_load

end module emcon_model_run
