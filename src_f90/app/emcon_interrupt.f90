!> Signals: remember that somebody asked the run to stop, so that it leaves a restart file.
module emcon_interrupt
   use, intrinsic :: iso_c_binding, only : c_funloc, c_funptr, c_int, c_intptr_t, c_long
   use emcon_errors, only : err_interrupt
   implicit none
   private
   public :: interrupt_watch, is_interrupted

   !> Ctrl-C; a batch system; the terminal was closed; nobody reads standard output any more.
   integer(c_int), parameter :: sigint = 2, sigterm = 15, sighup = 1, sigpipe = 13
   integer(c_int), parameter :: watched(4) = [sigint, sigterm, sighup, sigpipe]
   integer(c_intptr_t), parameter :: sig_ign = 1
   integer(c_int), parameter :: clock_monotonic = 1
   !> Repetitions within this time are one request: `timeout` signals the process and its group.
   integer(c_long), parameter :: one_request = 100000000_c_long     ! [ns]

   type, bind(c) :: timespec_t
      integer(c_long) :: seconds = 0
      integer(c_long) :: nanoseconds = 0
   end type timespec_t

   ! What a signal handler can reach.
   logical, volatile :: has_been_asked = .false.
   logical, volatile :: has_been_told = .false.       !! by Ctrl-C or SIGTERM
   type(timespec_t), volatile :: time_told

   interface
      type(c_funptr) function c_signal(number, handler) bind(c, name="signal")
         import :: c_funptr, c_int
         integer(c_int), value :: number
         type(c_funptr), value :: handler
      end function c_signal

      integer(c_int) function c_clock_gettime(clock, time) bind(c, name="clock_gettime")
         import :: c_int, timespec_t
         integer(c_int), value :: clock
         type(timespec_t), intent(out) :: time
      end function c_clock_gettime

      !> Ends at once, without what `exit` still does; allowed in a signal handler.
      subroutine c_exit_now(code) bind(c, name="_exit")
         import :: c_int
         integer(c_int), value :: code
      end subroutine c_exit_now
   end interface

contains

   !> From now on these signals do not end the program, but for a second Ctrl-C or SIGTERM. Those
   !> that the caller lets be ignored (`nohup`, jobs in the background) stay so.
   subroutine interrupt_watch()
      type(c_funptr) :: previous
      integer :: i

      do i = 1, size(watched)
         previous = c_signal(watched(i), c_funloc(remember))
         if (transfer(previous, sig_ign) == sig_ign) previous = c_signal(watched(i), previous)
      end do
   end subroutine interrupt_watch

   subroutine remember(number) bind(c)
      integer(c_int), value :: number
      type(timespec_t) :: now
      integer(c_int) :: stat

      has_been_asked = .true.
      if (number /= sigint .and. number /= sigterm) return
      stat = c_clock_gettime(clock_monotonic, now)
      if (.not. has_been_told) then
         time_told = now
         has_been_told = .true.
      else if (now%seconds - time_told%seconds > 1 .or. 1000000000_c_long*(now%seconds &
         - time_told%seconds) + now%nanoseconds - time_told%nanoseconds > one_request) then
         call c_exit_now(int(err_interrupt, c_int))
      end if
   end subroutine remember

   !> Has somebody asked to stop?
   logical function is_interrupted()
      is_interrupted = has_been_asked
   end function is_interrupted

end module emcon_interrupt
