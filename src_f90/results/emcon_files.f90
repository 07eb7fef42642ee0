!> Files with the guarantees that Fortran's own input and output does not give: one system call per
!> text, every failure reported (a full disk too), atomic replacement, locks.
module emcon_files
   use, intrinsic :: iso_c_binding, only : c_associated, c_char, c_int, c_int64_t, &
      c_intptr_t, c_null_char, c_null_ptr, c_ptr, c_size_t
   use emcon_errors, only : error_t, raise, err_file
   use emcon_posix, only : c_access, c_close, c_dup2, c_fclose, c_fileno, c_flock, &
      c_fopen, c_fsync, c_ftruncate, c_isatty, c_lseek, c_memfd_create, c_mkdir, c_read, &
      c_realpath, c_rename, c_signal, c_unlink, c_write, longest_path, &
      lock_exclusive, lock_no_wait, errno_exists, errno_missing, errno_again, signal_file_size
   use emcon_text_file, only : system_errno, system_reason
   implicit none
   private
   public :: file_t, file_open, file_lock, file_put, file_put_at_start, file_get, file_sync, &
      file_truncate, file_close
   public :: file_exists, file_rename, file_remove, file_copy, file_discard, make_directory
   public :: is_same_file, is_terminal, survive_file_size_limit

   !> An open file. Nothing is buffered: what `file_put` has taken, a kill cannot lose.
   !>
   !> Closed by `file_close`, not by a finaliser: with one, gfortran 12 leaves the components of an
   !> `intent(out)` argument as they were.
   type :: file_t
      private
      type(c_ptr) :: stream = c_null_ptr
      character(len=:), allocatable :: path
   end type file_t

   integer, parameter :: block_size = 1048576     !! of `file_copy` [byte]

contains

   !> Open `path`: "r" to read, "r+" to change it, "w" to write anew, "a" to append (made if
   !> missing).
   subroutine file_open(self, path, mode, error)
      type(file_t), intent(out) :: self
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: mode
      type(error_t), allocatable, intent(out) :: error

      self%path = path
      ! "e": child processes of a host program must not inherit the file, and with it the lock.
      self%stream = c_fopen(path // c_null_char, mode // "e" // c_null_char)
      if (.not. c_associated(self%stream)) call raise_system(error, "open", path)
   end subroutine file_open

   !> Take the exclusive lock on the file; fails at once if another open file holds it.
   !>
   !> The system drops the lock with the last descriptor, hence also when the run is killed. On a
   !> file system without locks nothing is refused.
   subroutine file_lock(self, error)
      type(file_t), intent(in) :: self
      type(error_t), allocatable, intent(out) :: error

      if (c_flock(c_fileno(self%stream), lock_exclusive + lock_no_wait) == 0) return
      if (system_errno() /= errno_again) return
      call raise(error, err_file, self%path // ": another run writes to the same output. Wait " &
         // "until it ends, stop it, or choose another output directory")
   end subroutine file_lock

   !> Write `text` at the end of the file, by one system call if the system takes it whole.
   !>
   !> On failure the part that was taken is cut off again: lines stay whole.
   subroutine file_put(self, text, error)
      type(file_t), intent(in) :: self
      character(len=*), intent(in) :: text
      type(error_t), allocatable, intent(out) :: error
      integer(c_intptr_t) :: n_done, n
      integer(c_int) :: fd, ignored

      fd = c_fileno(self%stream)
      n_done = 0
      do while (n_done < len(text, c_intptr_t))
         n = c_write(fd, text(n_done + 1:), len(text, c_size_t) - n_done)
         if (n < 1) then
            call raise_system(error, "write", self%path)
            ignored = c_ftruncate(fd, c_lseek(fd, 0_c_int64_t, 1_c_int) - n_done)
            return
         end if
         n_done = n_done + n
      end do
   end subroutine file_put

   !> Write `text` over the first bytes of a file opened with "r+".
   subroutine file_put_at_start(self, text, error)
      type(file_t), intent(in) :: self
      character(len=*), intent(in) :: text
      type(error_t), allocatable, intent(out) :: error
      integer(c_int) :: fd

      fd = c_fileno(self%stream)
      if (c_lseek(fd, 0_c_int64_t, 0_c_int) == 0) then
         if (c_write(fd, text, len(text, c_size_t)) == len(text)) return
      end if
      call raise_system(error, "write", self%path)
   end subroutine file_put_at_start

   !> The next bytes of a file opened to read: `n` of them, fewer than asked for only at its end.
   subroutine file_get(self, text, n, error)
      type(file_t), intent(in) :: self
      character(len=*), intent(out) :: text          !! blank behind `n`
      integer, intent(out) :: n
      type(error_t), allocatable, intent(out) :: error
      integer(c_intptr_t) :: n_now

      n = 0
      do while (n < len(text))
         n_now = c_read(c_fileno(self%stream), text(n + 1:), int(len(text) - n, c_size_t))
         if (n_now < 0) call raise_system(error, "read", self%path)
         if (n_now < 1) exit
         n = n + int(n_now)
      end do
      text(n + 1:) = ""
   end subroutine file_get

   !> Wait until all that was written is on the disk.
   subroutine file_sync(self, error)
      type(file_t), intent(in) :: self
      type(error_t), allocatable, intent(out) :: error

      if (c_fsync(c_fileno(self%stream)) /= 0) call raise_system(error, "write", self%path)
   end subroutine file_sync

   !> Make the file empty.
   subroutine file_truncate(self, error)
      type(file_t), intent(in) :: self
      type(error_t), allocatable, intent(out) :: error

      if (c_ftruncate(c_fileno(self%stream), 0_c_int64_t) /= 0) then
         call raise_system(error, "empty", self%path)
      end if
   end subroutine file_truncate

   !> Close the file; harmless if it is not open.
   subroutine file_close(self, error)
      type(file_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      integer(c_int) :: stat

      if (.not. c_associated(self%stream)) return
      stat = c_fclose(self%stream)
      self%stream = c_null_ptr
      if (stat /= 0) call raise_system(error, "close", self%path)
   end subroutine file_close

   !> Whether there is a file or folder called `path`.
   logical function file_exists(path)
      character(len=*), intent(in) :: path

      file_exists = c_access(path // c_null_char, 0_c_int) == 0
   end function file_exists

   !> Do two paths lead to one file? Each may be spelled in several ways.
   logical function is_same_file(path, other)
      character(len=*), intent(in) :: path, other
      character(kind=c_char, len=longest_path) :: where, there

      is_same_file = path == other
      if (is_same_file) return
      where = ""
      there = ""
      if (.not. c_associated(c_realpath(path // c_null_char, where))) return
      if (.not. c_associated(c_realpath(other // c_null_char, there))) return
      is_same_file = where(:index(where, c_null_char)) == there(:index(there, c_null_char))
   end function is_same_file

   !> Give `from` the name `to`, in one instant; what was called `to` is gone then.
   subroutine file_rename(from, to, error)
      character(len=*), intent(in) :: from, to
      type(error_t), allocatable, intent(out) :: error

      if (c_rename(from // c_null_char, to // c_null_char) /= 0) then
         call raise_system(error, "replace", to)
      end if
   end subroutine file_rename

   !> Remove `path` if it is there.
   subroutine file_remove(path, error)
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error

      if (c_unlink(path // c_null_char) == 0) return
      if (system_errno() /= errno_missing) call raise_system(error, "remove", path)
   end subroutine file_remove

   !> Copy the contents of `from` to `to` and wait until they are on the disk.
   subroutine file_copy(from, to, error)
      character(len=*), intent(in) :: from, to
      type(error_t), allocatable, intent(out) :: error
      type(file_t) :: source, target
      character(len=block_size), allocatable :: block
      type(error_t), allocatable :: ignored
      integer(c_intptr_t) :: n

      call file_open(source, from, "r", error)
      if (.not. allocated(error)) call file_open(target, to, "w", error)
      if (.not. allocated(error)) then
         allocate(block)
         do
            n = c_read(c_fileno(source%stream), block, int(block_size, c_size_t))
            if (n < 0) call raise_system(error, "read", from)
            if (n < 1) exit
            call file_put(target, block(:n), error)
            if (allocated(error)) exit
         end do
      end if
      if (.not. allocated(error)) call file_sync(target, error)
      if (.not. allocated(error)) call file_close(target, error)
      call file_close(target, ignored)
      call file_close(source, ignored)
   end subroutine file_copy

   !> Point the descriptor `fd`, owned by a library, at a file in memory: the library can then close
   !> a file that could not be written without further failures.
   subroutine file_discard(fd)
      integer(c_int), intent(in) :: fd
      integer(c_int) :: sink, ignored
      integer(c_int), parameter :: close_on_exec = 1

      sink = c_memfd_create("discarded" // c_null_char, close_on_exec)
      if (sink < 0) return
      ignored = c_dup2(sink, fd)
      ignored = c_close(sink)
   end subroutine file_discard

   !> Make the folder `path` and those above it; it may be there already.
   subroutine make_directory(path, error)
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error
      integer :: i
      integer(c_int) :: stat
      integer(c_int), parameter :: all_rights = int(o"777", c_int)   ! less those of the umask

      stat = 0
      do i = 2, len(path) + 1
         if (i <= len(path)) then
            if (path(i:i) /= "/") cycle
         end if
         stat = c_mkdir(path(:i - 1) // c_null_char, all_rights)
         if (stat /= 0) then
            if (system_errno() == errno_exists) stat = 0
         end if
      end do
      if (stat /= 0) then
         call raise_system(error, "make the folder", path)
      else if (.not. file_exists(path // "/.")) then
         call raise(error, err_file, "cannot make the folder " // path // ": a file has that name")
      end if
   end subroutine make_directory

   !> Whether standard output is a terminal.
   logical function is_terminal()
      is_terminal = c_isatty(1_c_int) == 1
   end function is_terminal

   !> Let a write beyond the size limit of the process fail like one on a full disk, not kill it.
   subroutine survive_file_size_limit()
      integer(c_intptr_t) :: old
      integer(c_intptr_t), parameter :: ignore = 1       ! SIG_IGN

      old = c_signal(signal_file_size, ignore)
   end subroutine survive_file_size_limit

   subroutine raise_system(error, action, path)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in) :: action, path
      character(len=:), allocatable :: reason

      call system_reason(reason)
      call raise(error, err_file, "cannot " // action // " " // path // ": " // reason)
   end subroutine raise_system

end module emcon_files
