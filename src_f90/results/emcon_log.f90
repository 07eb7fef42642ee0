!> The log NAME.log: each line is on its way to the disk when the call returns.
!>
!> The log also keeps two runs from the same output: open it first. Who has it open owns NAME.
module emcon_log
   use emcon_errors, only : error_t
   use emcon_files, only : file_close, file_lock, file_open, file_put, file_t, file_truncate
   use emcon_printable, only : printable
   use emcon_text, only : notes_t
   implicit none
   private
   public :: log_t, log_open, log_line, log_lines, log_close

   !> A log being written. Lines given to a log that is not open go nowhere.
   type :: log_t
      private
      logical :: is_open = .false.
      type(file_t) :: file
      type(error_t), allocatable :: failure          !! the first one; told by `log_close`
   end type log_t

contains

   !> Begin the log `path`, or go on with it if `is_resumed`; fails if another run has it open.
   subroutine log_open(self, path, is_resumed, error)
      type(log_t), intent(out) :: self
      character(len=*), intent(in) :: path
      logical, intent(in) :: is_resumed
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: ignored

      ! Emptied only when locked: the other run's lines are not ours.
      call file_open(self%file, path, "a", error)
      if (.not. allocated(error)) call file_lock(self%file, error)
      if (.not. allocated(error) .and. .not. is_resumed) call file_truncate(self%file, error)
      self%is_open = .not. allocated(error)
      if (allocated(error)) call file_close(self%file, ignored)
   end subroutine log_open

   !> Append a line.
   subroutine log_line(self, text)
      type(log_t), intent(inout) :: self
      character(len=*), intent(in) :: text

      if (.not. self%is_open .or. allocated(self%failure)) return
      call file_put(self%file, printable(text) // achar(10), self%failure)
   end subroutine log_line

   !> Append lines that begin with `start`.
   subroutine log_lines(self, start, notes)
      type(log_t), intent(inout) :: self
      character(len=*), intent(in) :: start
      type(notes_t), intent(in) :: notes
      integer :: i

      do i = 1, notes%n
         call log_line(self, start // notes%item(i)%text)
      end do
   end subroutine log_lines

   !> Close the log; `error` is the first failure since it was opened. Harmless if it is not open.
   subroutine log_close(self, error)
      type(log_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      self%is_open = .false.
      call file_close(self%file, error)
      if (allocated(self%failure)) call move_alloc(self%failure, error)
   end subroutine log_close

end module emcon_log
