!> How many threads work on a model.
module emcon_threads
   use emcon_errors, only : err_input, error_t, raise
   use emcon_text, only : to_text
   implicit none
   private
   public :: threads_default, threads_check

   !> More of them is a mistake.
   integer, parameter :: most_threads = 1024

contains

   !> Those that OMP_NUM_THREADS asks for, the first of its list; one if it is not set, or nonsense.
   integer function threads_default()
      character(len=16) :: text
      integer :: n, status

      threads_default = 1
      call get_environment_variable("OMP_NUM_THREADS", text, status=status)
      if (status /= 0) return
      if (scan(text, ",") > 0) text = text(:scan(text, ",") - 1)
      if (verify(trim(adjustl(text)), "0123456789") > 0) return
      read(text, *, iostat=status) n
      if (status == 0 .and. n > 0) threads_default = min(n, most_threads)
   end function threads_default

   !> An error if there cannot be `n` threads.
   subroutine threads_check(n, error)
      integer, intent(in) :: n
      type(error_t), allocatable, intent(out) :: error

      if (n < 1 .or. n > most_threads) call raise(error, err_input, to_text(n) // " threads: it " &
         // "takes 1 to " // to_text(most_threads))
   end subroutine threads_check

end module emcon_threads
