!> The program: reads the command line, calls the library, prints, and sets the exit code.
program emcon
   use, intrinsic :: iso_c_binding, only : c_f_pointer, c_int, c_intptr_t, c_size_t
   use, intrinsic :: iso_fortran_env, only : error_unit
   use emcon_command_line, only : command_read, command_t, usage
   use emcon_errors, only : err_analysis, err_file, err_input, err_none, error_t
   use emcon_interrupt, only : interrupt_watch, is_interrupted
   use emcon_posix, only : c_errno, c_write
   use emcon_printable, only : printable
   use emcon_run, only : keyword_lines, run_check, run_deck, run_prepare, run_report_t, run_restart
   use emcon_text, only : string_t
   use emcon_version, only : precision_names, this_precision, version
   implicit none

   interface
      !> Ends without the remarks on floating-point flags that `stop` makes.
      subroutine c_exit(code) bind(c, name="exit")
         import :: c_int
         integer(c_int), value :: code
      end subroutine c_exit

      integer(c_int) function emcon_has_room() bind(c)
         import :: c_int
      end function emcon_has_room
   end interface

   integer :: code, ignored
   logical :: has_failed = .false.               ! nothing more can be printed,
   logical :: is_lost = .false.                  ! though somebody would read it

   call execute(code)
   if (is_lost .and. code == err_none) code = err_file
   flush(error_unit, iostat=ignored)
   call c_exit(int(code, c_int))

contains

   !> All the work, so that its memory is freed before the program ends.
   subroutine execute(code)
      integer, intent(out) :: code
      type(command_t) :: command
      logical :: has_room
      type(run_report_t) :: report
      type(error_t), allocatable :: error
      integer :: i

      code = err_none
      call command_read(command)
      if (len(command%fault) > 0) then
         write(error_unit, "(a)", iostat=ignored) "emcon: " // printable(command%fault) // &
            " (see emcon --help)"
         code = err_input
         return
      end if
      has_room = .true.
      if (all(command%verb /= ["help    ", "version ", "keywords"])) has_room = &
         emcon_has_room() == 1
      if (.not. has_room) then
         write(error_unit, "(a)", iostat=ignored) "emcon: the limit of address space (ulimit -v) " &
            // "leaves less than 130 MB, which OpenBLAS takes when it is called: raise it"
         code = err_analysis
         return
      end if
      call run_prepare()
      select case (command%verb)
      case ("help")
         associate (text => usage())
            do i = 1, size(text)
               call print_line(trim(text(i)))
            end do
         end associate
         return
      case ("version")
         call print_line("emcon " // version // ", " // trim(precision_names(this_precision)) &
            // " precision")
         return
      case ("keywords")
         call print_keywords(command%path, code)
         return
      case ("check")
         call run_check(command%path, command%options, report, error)
      case ("restart")
         call interrupt_watch()
         call run_restart(command%path, command%options, is_interrupted, report, error)
      case default
         call interrupt_watch()
         call run_deck(command%path, command%options, is_interrupted, report, error)
      end select
      call tell(report, error, command%options%is_quiet, code)
   end subroutine execute

   !> Print what the names of keywords begin with `beginning`, which may have its asterisk.
   subroutine print_keywords(beginning, code)
      character(len=*), intent(in) :: beginning
      integer, intent(inout) :: code             !! that of the program
      type(string_t), allocatable :: line(:)
      integer :: i

      call keyword_lines(beginning(verify(beginning // " ", "*"):), line)
      do i = 1, size(line)
         call print_line(line(i)%text)
      end do
      if (size(line) > 0) return
      code = err_input
      write(error_unit, "(a)", iostat=ignored) "emcon: no keyword begins with " // &
         printable(beginning)
   end subroutine print_keywords

   !> Print a line on standard output. What cannot be printed, as on a full disk, is an error; a
   !> reader that has gone, as `head` does, is none.
   subroutine print_line(text)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: line
      integer(c_int), pointer :: errno
      integer(c_intptr_t) :: n
      integer(c_size_t) :: first
      integer(c_int), parameter :: standard_output = 1
      integer(c_int), parameter :: errno_pipe = 32, errno_closed = 9   ! of Linux

      if (has_failed) return
      line = printable(text) // new_line("a")
      first = 1
      do while (first <= len(line, c_size_t))
         n = c_write(standard_output, line(first:), len(line, c_size_t) - first + 1)
         if (n < 0) exit
         first = first + n
      end do
      has_failed = n < 0
      if (.not. has_failed) return
      call c_f_pointer(c_errno(), errno)
      if (errno == errno_pipe .or. errno == errno_closed) return
      write(error_unit, "(a)", iostat=ignored) "emcon: cannot write to standard output: is " // &
         "the disk full?"
      is_lost = .true.
   end subroutine print_line

   !> Print what there is to tell, unless nobody reads it; `code` is the exit code.
   subroutine tell(report, error, is_quiet, code)
      type(run_report_t), intent(in) :: report
      type(error_t), intent(in), allocatable :: error
      logical, intent(in) :: is_quiet
      integer, intent(out) :: code
      integer :: i
      logical :: is_told

      code = err_none
      is_told = .false.
      if (allocated(report%diagnostic)) then
         do i = 1, size(report%diagnostic)
            write(error_unit, "(a)", iostat=ignored) printable(report%diagnostic(i)%text)
            if (allocated(error)) is_told = is_told .or. error%message == report%diagnostic(i)%text
         end do
      end if
      do i = 1, report%warnings%n
         write(error_unit, "(a)", iostat=ignored) "emcon: warning: " // &
            printable(report%warnings%item(i)%text)
      end do
      if (allocated(report%closing) .and. .not. is_quiet) then
         do i = 1, size(report%closing)
            call print_line(report%closing(i)%text)
         end do
      else if (report%is_bad .and. .not. allocated(error)) then
         write(error_unit, "(a)", iostat=ignored) "emcon: " // &
            printable(report%closing(size(report%closing))%text)
      end if
      if (.not. allocated(error)) return
      code = error%code
      if (is_told) return
      ! What begins with file and line is left as it is, for editors that jump there.
      is_told = index(error%message, ": error: ") > 0
      write(error_unit, "(a)", iostat=ignored) repeat("emcon: ", merge(0, 1, is_told)) // &
         printable(error%message)
   end subroutine tell

end program emcon
