!> The program: reads the command line, calls the library, prints, and sets the exit code.
program emcon
   use, intrinsic :: iso_c_binding, only : c_int
   use, intrinsic :: iso_fortran_env, only : error_unit, output_unit
   use emcon_command_line, only : command_read, command_t, usage
   use emcon_errors, only : err_input, err_none, error_t
   use emcon_interrupt, only : interrupt_watch, is_interrupted
   use emcon_run, only : run_check, run_deck, run_prepare, run_report_t, run_restart
   use emcon_version, only : precision_names, this_precision, version
   implicit none

   interface
      !> Ends without the remarks on floating-point flags that `stop` makes.
      subroutine c_exit(code) bind(c, name="exit")
         import :: c_int
         integer(c_int), value :: code
      end subroutine c_exit
   end interface

   integer :: code, ignored

   call execute(code)
   flush(output_unit, iostat=ignored)
   flush(error_unit, iostat=ignored)
   call c_exit(int(code, c_int))

contains

   !> All the work, so that its memory is freed before the program ends.
   subroutine execute(code)
      integer, intent(out) :: code
      type(command_t) :: command
      type(run_report_t) :: report
      type(error_t), allocatable :: error
      integer :: i

      code = err_none
      call run_prepare()
      call command_read(command)
      if (len(command%fault) > 0) then
         write(error_unit, "(a)") "emcon: " // command%fault // " (see emcon --help)"
         code = err_input
         return
      end if
      select case (command%verb)
      case ("help")
         associate (text => usage())
            write(output_unit, "(a)") (trim(text(i)), i = 1, size(text))
         end associate
         return
      case ("version")
         write(output_unit, "(a)") "emcon " // version // ", " // &
            trim(precision_names(this_precision)) // " precision"
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
            write(error_unit, "(a)", iostat=ignored) report%diagnostic(i)%text
            if (allocated(error)) is_told = is_told .or. error%message == report%diagnostic(i)%text
         end do
      end if
      do i = 1, report%warnings%n
         write(error_unit, "(a)", iostat=ignored) "emcon: warning: " // report%warnings%item(i)%text
      end do
      if (allocated(report%closing) .and. .not. is_quiet) then
         do i = 1, size(report%closing)
            write(output_unit, "(a)", iostat=ignored) report%closing(i)%text
         end do
      else if (report%is_bad .and. .not. allocated(error)) then
         write(error_unit, "(a)", iostat=ignored) "emcon: " // &
            report%closing(size(report%closing))%text
      end if
      if (.not. allocated(error)) return
      code = error%code
      if (.not. is_told) write(error_unit, "(a)", iostat=ignored) "emcon: " // error%message
   end subroutine tell

end program emcon
