!> Seals: a file tells in its first bytes how long the rest is, what it adds up to and, if it is of
!> several, of which run it is. So damage is found before a library reads it, which may never come
!> back from that, and files of other runs are not gone on with.
!>
!> The seal stands in the user block that HDF5 keeps for its users: readers pass over it.
module emcon_sealed_file
   use emcon_checksum, only : checksum_add, checksum_t, checksum_text
   use emcon_errors, only : err_file, error_t, raise
   use emcon_files, only : file_close, file_exists, file_get, file_open, file_put_at_start, file_t
   implicit none
   private
   public :: seal_put, seal_check, seal_size

   !> Bytes at the start of a file that belong to the seal: the least that HDF5 allows.
   integer, parameter :: seal_size = 512
   character(len=*), parameter :: line_end = achar(10), mark = "EMCON" // line_end
   integer, parameter :: block_size = 65536           !! read at a time, a multiple of 4 [byte]

contains

   !> Seal the file at `path`, whose first `seal_size` bytes are free.
   subroutine seal_put(path, run, error)
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: run                !! one line, the run it is of; may be empty
      type(error_t), allocatable, intent(out) :: error
      character(len=seal_size) :: found, seal
      type(file_t) :: file
      type(error_t), allocatable :: close_error

      call file_open(file, path, "r+", error)
      if (allocated(error)) return
      call read_seals(file, found, seal, error)
      call add_run(seal, run)
      if (.not. allocated(error)) call file_put_at_start(file, seal, error)
      call file_close(file, close_error)
      if (.not. allocated(error)) call move_alloc(close_error, error)
   end subroutine seal_put

   !> An error unless the file at `path` is as it was sealed, as one of `run`.
   subroutine seal_check(path, run, error)
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: run                !! as for `seal_put`
      type(error_t), allocatable, intent(out) :: error
      character(len=seal_size) :: found, seal
      type(file_t) :: file
      type(error_t), allocatable :: ignored

      if (.not. file_exists(path)) call raise(error, err_file, path // " does not exist")
      if (.not. allocated(error)) call file_open(file, path, "r", error)
      if (allocated(error)) return
      call read_seals(file, found, seal, error)
      call file_close(file, ignored)
      if (allocated(error)) return
      if (index(found, mark) /= 1) then
         call raise(error, err_file, path // " has no checksum: it was not written by this " // &
            "version " &
            // "of EMCON, or its beginning is damaged. Bring it back from a copy, or run the " &
            // "deck again")
      else if (index(found, trim(seal)) /= 1) then
         call raise(error, err_file, path // " is damaged, or was changed since the run wrote " &
            // "it: its checksum is wrong. Bring it back from a copy, or run the deck again")
      else
         call add_run(seal, run)
         if (found /= seal) call raise(error, err_file, path // " is of another run, of another " &
            // "deck or with other --set, or its beginning is damaged. Bring it back from a " &
            // "copy, or run the deck again")
      end if
   end subroutine seal_check

   !> Append the line that names the run.
   pure subroutine add_run(seal, run)
      character(len=seal_size), intent(inout) :: seal
      character(len=*), intent(in) :: run

      if (run /= "") seal(len_trim(seal) + 1:) = run // line_end
   end subroutine add_run

   !> The seal that stands in the file, and the one that fits the bytes behind it.
   subroutine read_seals(file, found, seal, error)
      type(file_t), intent(in) :: file
      character(len=seal_size), intent(out) :: found, seal
      type(error_t), allocatable, intent(out) :: error
      character(len=block_size), allocatable :: block
      character(len=40) :: digits
      type(checksum_t) :: sum
      integer :: n

      seal = ""
      allocate(block)
      call file_get(file, found, n, error)
      do
         if (allocated(error)) return
         call file_get(file, block, n, error)
         if (n == 0) exit
         call checksum_add(sum, block(:n))
      end do
      call checksum_text(sum, digits)
      seal = mark // trim(digits) // line_end
   end subroutine read_seals

end module emcon_sealed_file
