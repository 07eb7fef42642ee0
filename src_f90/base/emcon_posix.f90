!> The few C functions of POSIX that files need. Interfaces only; used through `emcon_files`.
!>
!> No function with a variable argument list is bound (`open`, `fcntl`): Fortran cannot call those
!> by the rules. Hence `fopen` and `fileno`.
module emcon_posix
   use, intrinsic :: iso_c_binding, only : c_char, c_int, c_int64_t, c_intptr_t, c_ptr, c_size_t
   implicit none
   private
   public :: c_access, c_close, c_dup2, c_errno, c_fclose, c_fileno, c_flock, c_fopen, c_fsync
   public :: c_ftruncate, c_isatty, c_lseek, c_memfd_create, c_mkdir, c_read, c_rename, c_signal
   public :: c_strerror, c_strlen, c_unlink, c_write
   public :: lock_exclusive, lock_no_wait
   public :: errno_exists, errno_missing, errno_again, signal_file_size

   !> `LOCK_EX` and `LOCK_NB` of `flock`.
   integer(c_int), parameter :: lock_exclusive = 2, lock_no_wait = 4
   !> `EEXIST`, `ENOENT`, `EAGAIN` (what `flock` gives when the lock is held), `SIGXFSZ` on Linux.
   integer(c_int), parameter :: errno_exists = 17, errno_missing = 2, errno_again = 11
   integer(c_int), parameter :: signal_file_size = 25

   interface
      function c_access(path, mode) bind(c, name="access") result(stat)
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
         integer(c_int) :: stat
      end function c_access

      function c_close(fd) bind(c, name="close") result(stat)
         import :: c_int
         integer(c_int), value :: fd
         integer(c_int) :: stat
      end function c_close

      function c_dup2(old, new) bind(c, name="dup2") result(fd)
         import :: c_int
         integer(c_int), value :: old, new
         integer(c_int) :: fd
      end function c_dup2

      !> Address of `errno` of this thread (glibc and musl).
      function c_errno() bind(c, name="__errno_location") result(address)
         import :: c_ptr
         type(c_ptr) :: address
      end function c_errno

      function c_fclose(stream) bind(c, name="fclose") result(stat)
         import :: c_int, c_ptr
         type(c_ptr), value :: stream
         integer(c_int) :: stat
      end function c_fclose

      function c_fileno(stream) bind(c, name="fileno") result(fd)
         import :: c_int, c_ptr
         type(c_ptr), value :: stream
         integer(c_int) :: fd
      end function c_fileno

      function c_flock(fd, operation) bind(c, name="flock") result(stat)
         import :: c_int
         integer(c_int), value :: fd, operation
         integer(c_int) :: stat
      end function c_flock

      function c_fopen(path, mode) bind(c, name="fopen") result(stream)
         import :: c_char, c_ptr
         character(kind=c_char), intent(in) :: path(*), mode(*)
         type(c_ptr) :: stream
      end function c_fopen

      function c_fsync(fd) bind(c, name="fsync") result(stat)
         import :: c_int
         integer(c_int), value :: fd
         integer(c_int) :: stat
      end function c_fsync

      function c_ftruncate(fd, length) bind(c, name="ftruncate") result(stat)
         import :: c_int, c_int64_t
         integer(c_int), value :: fd
         integer(c_int64_t), value :: length
         integer(c_int) :: stat
      end function c_ftruncate

      function c_isatty(fd) bind(c, name="isatty") result(answer)
         import :: c_int
         integer(c_int), value :: fd
         integer(c_int) :: answer
      end function c_isatty

      function c_lseek(fd, offset, whence) bind(c, name="lseek") result(position)
         import :: c_int, c_int64_t
         integer(c_int), value :: fd
         integer(c_int64_t), value :: offset
         integer(c_int), value :: whence
         integer(c_int64_t) :: position
      end function c_lseek

      !> An unnamed file in memory (Linux).
      function c_memfd_create(name, flags) bind(c, name="memfd_create") result(fd)
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int), value :: flags
         integer(c_int) :: fd
      end function c_memfd_create

      function c_mkdir(path, mode) bind(c, name="mkdir") result(stat)
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: mode
         integer(c_int) :: stat
      end function c_mkdir

      function c_read(fd, buffer, n) bind(c, name="read") result(n_done)
         import :: c_char, c_int, c_intptr_t, c_size_t
         integer(c_int), value :: fd
         character(kind=c_char), intent(inout) :: buffer(*)
         integer(c_size_t), value :: n
         integer(c_intptr_t) :: n_done
      end function c_read

      function c_rename(from, to) bind(c, name="rename") result(stat)
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: from(*), to(*)
         integer(c_int) :: stat
      end function c_rename

      function c_signal(number, handler) bind(c, name="signal") result(old)
         import :: c_int, c_intptr_t
         integer(c_int), value :: number
         integer(c_intptr_t), value :: handler
         integer(c_intptr_t) :: old
      end function c_signal

      function c_strerror(number) bind(c, name="strerror") result(text)
         import :: c_int, c_ptr
         integer(c_int), value :: number
         type(c_ptr) :: text
      end function c_strerror

      function c_strlen(text) bind(c, name="strlen") result(n)
         import :: c_ptr, c_size_t
         type(c_ptr), value :: text
         integer(c_size_t) :: n
      end function c_strlen

      function c_unlink(path) bind(c, name="unlink") result(stat)
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int) :: stat
      end function c_unlink

      function c_write(fd, buffer, n) bind(c, name="write") result(n_done)
         import :: c_char, c_int, c_intptr_t, c_size_t
         integer(c_int), value :: fd
         character(kind=c_char), intent(in) :: buffer(*)
         integer(c_size_t), value :: n
         integer(c_intptr_t) :: n_done
      end function c_write
   end interface

end module emcon_posix
