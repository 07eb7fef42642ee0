!> A whole text file in one piece, and the system's words for what went wrong.
!>
!> By C functions, as Fortran opens no file twice at a time: two threads may read the same one.
module emcon_text_file
   use, intrinsic :: iso_c_binding, only : c_associated, c_char, c_f_pointer, c_int, c_intptr_t, &
      c_null_char, c_ptr, c_size_t
   use emcon_kinds, only : int64
   use emcon_posix, only : c_errno, c_fclose, c_fileno, c_fopen, c_read, c_strerror, c_strlen
   implicit none
   private
   public :: text_file_read, clear_system_reason, system_errno, system_reason

   integer(c_int), parameter :: errno_directory = 21        !! `EISDIR` of Linux

contains

   !> The bytes of the file at `path`, or the reason why there are none.
   subroutine text_file_read(path, text, fault)
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: text
      character(len=:), allocatable, intent(out) :: fault      !! empty: none
      integer(int64) :: n_byte
      logical :: exists

      fault = ""
      text = ""
      inquire(file=path, exist=exists, size=n_byte)
      if (len_trim(path) == 0) then
         fault = "no file is named"
      else if (.not. exists) then
         fault = "no such file"
         inquire(file=path // ".inp", exist=exists)
         if (exists) fault = fault // "; did you mean " // path // ".inp?"
      else if (n_byte > int(huge(1), int64)) then
         fault = "the file is larger than 2 GB; split it by *INCLUDE"
      else if (n_byte <= 0) then
         ! It may be a pipe: opening it would wait for ever.
         fault = "the file is empty (or not a regular file)"
      else
         call read_bytes(path, int(n_byte), text, fault)
      end if
   end subroutine text_file_read

   subroutine read_bytes(path, n_byte, text, fault)
      character(len=*), intent(in) :: path
      integer, intent(in) :: n_byte
      character(len=:), allocatable, intent(out) :: text
      character(len=:), allocatable, intent(inout) :: fault
      type(c_ptr) :: stream
      integer(c_intptr_t) :: n
      integer(c_int) :: ignored
      integer :: n_done

      allocate(character(len=n_byte) :: text)
      n_done = 0
      ! "e": child processes of a host program must not inherit the file.
      stream = c_fopen(path // c_null_char, "re" // c_null_char)
      if (.not. c_associated(stream)) then
         call describe(fault)
         return
      end if
      do while (n_done < n_byte)
         n = c_read(c_fileno(stream), text(n_done + 1:), int(n_byte - n_done, c_size_t))
         if (n < 0) call describe(fault)
         if (n == 0) fault = "cannot be read: the file ended while it was read"
         if (n <= 0) exit
         n_done = n_done + int(n)
      end do
      ignored = c_fclose(stream)
   end subroutine read_bytes

   !> Why the last call failed.
   subroutine describe(fault)
      character(len=:), allocatable, intent(out) :: fault

      if (system_errno() == errno_directory) then
         fault = "is a directory, not a deck"
      else
         call system_reason(fault)
         fault = "cannot be read: " // fault
      end if
   end subroutine describe

   !> Forget the last failure of the system, so that `system_reason` tells of a later one.
   subroutine clear_system_reason()
      integer(c_int), pointer :: errno

      call c_f_pointer(c_errno(), errno)
      errno = 0
   end subroutine clear_system_reason

   !> The system's words for its last failure, for instance "No space left on device"; or "".
   subroutine system_reason(text)
      character(len=:), allocatable, intent(out) :: text
      character(kind=c_char), pointer :: letter(:)
      type(c_ptr) :: words
      integer :: i
      integer(c_int) :: number

      number = system_errno()
      text = ""
      if (number == 0) return
      words = c_strerror(number)
      call c_f_pointer(words, letter, [c_strlen(words)])
      do i = 1, size(letter)
         text = text // letter(i)
      end do
   end subroutine system_reason

   integer(c_int) function system_errno()
      integer(c_int), pointer :: errno

      call c_f_pointer(c_errno(), errno)
      system_errno = errno
   end function system_errno

end module emcon_text_file
