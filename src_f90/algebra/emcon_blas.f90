!> The library below UMFPACK, MUMPS and LAPACK: its threads, and its floating-point exceptions.
module emcon_blas
   use, intrinsic :: ieee_exceptions, only : ieee_all, ieee_get_status, ieee_set_halting_mode, &
      ieee_set_status, ieee_status_type
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_null_char
   implicit none
   private
   public :: blas_single_thread, blas_is_shareable, blas_name, blas_enter, blas_leave
   public :: blas_enter_alone, blas_leave_alone
   public :: ieee_status_type

   interface
      integer(c_int) function emcon_blas_set_threads(n) bind(c)
         import :: c_int
         integer(c_int), value :: n
      end function emcon_blas_set_threads

      integer(c_int) function emcon_blas_get_threads() bind(c)
         import :: c_int
      end function emcon_blas_get_threads

      subroutine emcon_blas_name(n, name) bind(c)
         import :: c_char, c_int
         integer(c_int), value :: n
         character(kind=c_char), intent(out) :: name(*)
      end subroutine emcon_blas_name
   end interface

contains

   !> Keep BLAS to one thread: fronts here are small, and threads would compete with ours.
   !>
   !> `done` is false if the library has no such switch (it is then a plain, serial BLAS).
   subroutine blas_single_thread(done)
      logical, intent(out) :: done

      done = emcon_blas_set_threads(1_c_int) == 1_c_int
   end subroutine blas_single_thread

   !> What the library says of itself, the kernels that it chose for this processor among it; "" if
   !> it says nothing.
   subroutine blas_name(name)
      character(len=:), allocatable, intent(out) :: name
      character(kind=c_char, len=256) :: buffer

      call emcon_blas_name(len(buffer), buffer)
      name = buffer(:index(buffer, c_null_char) - 1)
   end subroutine blas_name

   !> May threads call the library at a time? An OpenBLAS without threads and without locks hands
   !> the same work space to both.
   logical function blas_is_shareable()
      character(len=:), allocatable :: name

      call blas_name(name)
      blas_is_shareable = index(name, "SINGLE_THREADED") == 0 .or. index(name, "USE_LOCKING") > 0
   end function blas_is_shareable

   !> Before a call: no halting. Vector kernels of OpenBLAS raise exceptions in unused lanes, which
   !> under `-ffpe-trap` would end the program although all results are right.
   subroutine blas_enter(status)
      type(ieee_status_type), intent(out) :: status     !! to be given to `blas_leave`

      call ieee_get_status(status)
      call ieee_set_halting_mode(ieee_all, .false.)
   end subroutine blas_enter

   !> After a call: flags and halting as they were.
   subroutine blas_leave(status)
      type(ieee_status_type), intent(in) :: status

      call ieee_set_status(status)
   end subroutine blas_leave

   !> `blas_enter` for calls whose bits are to be the same however many threads a host has given the
   !> library: they have one.
   subroutine blas_enter_alone(status, n_thread)
      type(ieee_status_type), intent(out) :: status     !! both to be given to `blas_leave_alone`
      integer, intent(out) :: n_thread           !! that the library has
      logical :: done

      n_thread = int(emcon_blas_get_threads())
      if (n_thread > 1) call blas_single_thread(done)
      call blas_enter(status)
   end subroutine blas_enter_alone

   !> After these calls: threads, flags and halting as they were.
   subroutine blas_leave_alone(status, n_thread)
      type(ieee_status_type), intent(in) :: status
      integer, intent(in) :: n_thread            !! that the library had, >= 1
      integer(c_int) :: done

      call blas_leave(status)
      if (n_thread > 1) done = emcon_blas_set_threads(int(n_thread, c_int))
   end subroutine blas_leave_alone

end module emcon_blas
