!> The few C functions of POSIX that files need. Interfaces only; used through `emcon_files`.
!>
!> No function with a variable argument list is bound (`open`, `fcntl`): Fortran cannot call those
!> by the rules. Hence `fopen` and `fileno`.
module emcon_posix
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_int64_t, c_intptr_t, c_ptr, c_size_t
   implicit none
   private
   public :: c_access, c_close, c_dup2, c_errno, c_fclose, c_fileno, c_flock, c_fopen, c_fsync
   public :: c_ftruncate, c_isatty, c_lseek, c_memfd_create, c_mkdir, c_read, c_realpath
   public :: c_rename, c_signal, c_strerror, c_strlen, c_unlink, c_write
   public :: lock_exclusive, lock_no_wait
   public :: longest_path
   public :: errno_exists, errno_missing, errno_again, signal_file_size

   !> `LOCK_EX` and `LOCK_NB` of `flock`.
   integer(c_int), parameter :: lock_exclusive = 2, lock_no_wait = 4
   !> `PATH_MAX` of Linux, with the zero at the end.
   integer, parameter :: longest_path = 4096
   !> `EEXIST`, `ENOENT`, `EAGAIN` (what `flock` gives when the lock is held), `SIGXFSZ` on Linux.
   integer(c_int), parameter :: errno_exists = 17, errno_missing = 2, errno_again = 11
   integer(c_int), parameter :: signal_file_size = 25

   interface
      integer(c_int) function c_access(path, mode) bind(c, name="access")
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
      end function c_access

      integer(c_int) function c_close(fd) bind(c, name="close")
         import :: c_int
         integer(c_int), value :: fd
      end function c_close

      integer(c_int) function c_dup2(old, new) bind(c, name="dup2")
         import :: c_int
         integer(c_int), value :: old, new
      end function c_dup2

      !> Address of `errno` of this thread (glibc and musl).
      type(c_ptr) function c_errno() bind(c, name="__errno_location")
         import :: c_ptr
      end function c_errno

      integer(c_int) function c_fclose(stream) bind(c, name="fclose")
         import :: c_int, c_ptr
         type(c_ptr), value :: stream
      end function c_fclose

      integer(c_int) function c_fileno(stream) bind(c, name="fileno")
         import :: c_int, c_ptr
         type(c_ptr), value :: stream
      end function c_fileno

      integer(c_int) function c_flock(fd, operation) bind(c, name="flock")
         import :: c_int
         integer(c_int), value :: fd, operation
      end function c_flock

      type(c_ptr) function c_fopen(path, mode) bind(c, name="fopen")
         import :: c_char, c_ptr
         character(kind=c_char), intent(in) :: path(*), mode(*)
      end function c_fopen

      integer(c_int) function c_fsync(fd) bind(c, name="fsync")
         import :: c_int
         integer(c_int), value :: fd
      end function c_fsync

      integer(c_int) function c_ftruncate(fd, length) bind(c, name="ftruncate")
         import :: c_int, c_int64_t
         integer(c_int), value :: fd
         integer(c_int64_t), value :: length
      end function c_ftruncate

      integer(c_int) function c_isatty(fd) bind(c, name="isatty")
         import :: c_int
         integer(c_int), value :: fd
      end function c_isatty

      integer(c_int64_t) function c_lseek(fd, offset, whence) bind(c, name="lseek")
         import :: c_int, c_int64_t
         integer(c_int), value :: fd
         integer(c_int64_t), value :: offset
         integer(c_int), value :: whence
      end function c_lseek

      !> An unnamed file in memory (Linux).
      integer(c_int) function c_memfd_create(name, flags) bind(c, name="memfd_create")
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int), value :: flags
      end function c_memfd_create

      integer(c_int) function c_mkdir(path, mode) bind(c, name="mkdir")
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
      end function c_mkdir

      integer(c_intptr_t) function c_read(fd, buffer, n) bind(c, name="read")
         import :: c_char, c_int, c_intptr_t, c_size_t
         integer(c_int), value :: fd
         character(kind=c_char), intent(inout) :: buffer(*)
         integer(c_size_t), value :: n
      end function c_read

      type(c_ptr) function c_realpath(path, resolved) bind(c, name="realpath")
         import :: c_char, c_ptr
         character(kind=c_char), intent(in) :: path(*)
         character(kind=c_char), intent(out) :: resolved(*)   !! longest_path
      end function c_realpath

      integer(c_int) function c_rename(from, to) bind(c, name="rename")
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: from(*), to(*)
      end function c_rename

      integer(c_intptr_t) function c_signal(number, handler) bind(c, name="signal")
         import :: c_int, c_intptr_t
         integer(c_int), value :: number
         integer(c_intptr_t), value :: handler
      end function c_signal

      type(c_ptr) function c_strerror(number) bind(c, name="strerror")
         import :: c_int, c_ptr
         integer(c_int), value :: number
      end function c_strerror

      integer(c_size_t) function c_strlen(text) bind(c, name="strlen")
         import :: c_ptr, c_size_t
         type(c_ptr), value :: text
      end function c_strlen

      integer(c_int) function c_unlink(path) bind(c, name="unlink")
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
      end function c_unlink

      integer(c_intptr_t) function c_write(fd, buffer, n) bind(c, name="write")
         import :: c_char, c_int, c_intptr_t, c_size_t
         integer(c_int), value :: fd
         character(kind=c_char), intent(in) :: buffer(*)
         integer(c_size_t), value :: n
      end function c_write
   end interface

end module emcon_posix
