!> Ctrl-C: remember that the user asked to stop.
module emcon_interrupt
   use, intrinsic :: iso_c_binding, only : c_funloc, c_funptr, c_int
   implicit none
   private
   public :: interrupt_watch, is_interrupted

   integer(c_int), parameter :: sigint = 2, sigterm = 15

   !> The one thing a signal handler can reach.
   logical, volatile :: has_been_asked = .false.

   interface
      function c_signal(number, handler) result(previous) bind(c, name="signal")
         import :: c_funptr, c_int
         integer(c_int), value :: number
         type(c_funptr), value :: handler
         type(c_funptr) :: previous
      end function c_signal
   end interface

contains

   !> From now on an interrupt does not end the program.
   subroutine interrupt_watch()
      type(c_funptr) :: previous

      previous = c_signal(sigint, c_funloc(remember))
      previous = c_signal(sigterm, c_funloc(remember))
   end subroutine interrupt_watch

   subroutine remember(number) bind(c)
      integer(c_int), value :: number

      has_been_asked = number > 0
   end subroutine remember

   !> Has the user asked to stop?
   logical function is_interrupted()
      is_interrupted = has_been_asked
   end function is_interrupted

end module emcon_interrupt
