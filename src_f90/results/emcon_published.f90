!> An HDF5 result file that readers can open at any moment, even after the run was killed.
!>
!> The run writes to a working copy, NAME.part. From time to time this is completed, copied and the
!> copy renamed to NAME: NAME is always whole. The last publication renames the working copy. What
!> is published is sealed.
module emcon_published
   use emcon_errors, only : error_t, raise, err_file
   use emcon_files, only : file_close, file_copy, file_exists, file_open, file_remove, &
      file_rename, file_sync, file_t
   use emcon_hdf5, only : hdf5_close, hdf5_create, hdf5_file_t, hdf5_flush, hdf5_open
   use emcon_pace, only : pace_begin, pace_end, pace_is_due, pace_t
   use emcon_sealed_file, only : seal_check, seal_put
   implicit none
   private
   public :: published_t, published_create, published_resume, publication_is_due, published_publish
   public :: published_close, published_abandon

   !> A result file and its working copy.
   type :: published_t
      type(hdf5_file_t) :: file                      !! the working copy
      logical :: is_changed = .false.                !! since the last publication; set by the user
      character(len=:), allocatable :: run           !! the run that it is of; set by the user
      character(len=:), allocatable, private :: path
      type(pace_t), private :: pace                  !! of publications
   end type published_t

contains

   !> Begin the file `path`. What is there under this name stays until the first publication.
   subroutine published_create(self, path, error)
      type(published_t), intent(out) :: self
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: ignored

      self%path = path
      self%run = ""
      call remove_stale(self, error)
      if (allocated(error)) return
      call hdf5_create(self%file, path // ".part", .false., error)
      if (allocated(error)) call file_remove(path // ".part", ignored)
      self%is_changed = .true.
   end subroutine published_create

   !> Go on with the published file `path` of `run`.
   subroutine published_resume(self, path, run, error)
      type(published_t), intent(out) :: self
      character(len=*), intent(in) :: path, run
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: ignored

      self%path = path
      self%run = run
      if (.not. file_exists(path)) then
         call raise(error, err_file, path // " does not exist: the run cannot be continued there")
         return
      end if
      call seal_check(path, run, error)
      if (.not. allocated(error)) call remove_stale(self, error)
      if (.not. allocated(error)) call file_copy(path, path // ".part", error)
      if (.not. allocated(error)) call hdf5_open(self%file, path // ".part", .true., error)
      if (allocated(error)) call file_remove(path // ".part", ignored)
      self%is_changed = .true.
   end subroutine published_resume

   !> Remove what a killed run left.
   subroutine remove_stale(self, error)
      type(published_t), intent(in) :: self
      type(error_t), allocatable, intent(out) :: error

      call file_remove(self%path // ".tmp", error)
      if (.not. allocated(error)) call file_remove(self%path // ".part", error)
   end subroutine remove_stale

   !> Whether there is something to publish, and it is time or the user wants it now.
   logical function publication_is_due(self, is_forced)
      type(published_t), intent(in) :: self
      logical, intent(in) :: is_forced

      publication_is_due = self%is_changed .and. .not. self%file%has_failed
      if (publication_is_due .and. .not. is_forced) publication_is_due = pace_is_due(self%pace)
   end function publication_is_due

   !> Publish what was written.
   subroutine published_publish(self, error)
      type(published_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: ignored

      call pace_begin(self%pace)
      call hdf5_flush(self%file, error)
      if (.not. allocated(error)) call seal_put(self%path // ".part", self%run, error)
      if (.not. allocated(error)) then
         call file_copy(self%path // ".part", self%path // ".tmp", error)
         if (.not. allocated(error)) call file_rename(self%path // ".tmp", self%path, error)
         if (allocated(error)) call file_remove(self%path // ".tmp", ignored)
      end if
      if (allocated(error)) return
      self%is_changed = .false.
      call pace_end(self%pace)
   end subroutine published_publish

   !> Publish all and end; harmless if nothing is open. After a failure what was published stays.
   subroutine published_close(self, error)
      type(published_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: ignored
      type(file_t) :: part

      if (self%file%id < 0) return
      call hdf5_close(self%file, error)
      if (.not. allocated(error) .and. .not. self%file%has_failed) then
         call seal_put(self%path // ".part", self%run, error)
         if (.not. allocated(error)) call file_open(part, self%path // ".part", "r", error)
         if (.not. allocated(error)) call file_sync(part, error)
         call file_close(part, ignored)
         if (.not. allocated(error)) call file_rename(self%path // ".part", self%path, error)
      end if
      if (allocated(error) .or. self%file%has_failed) then
         call file_remove(self%path // ".part", ignored)
      end if
   end subroutine published_close

   !> End without another publication, after a failure of the user.
   subroutine published_abandon(self)
      type(published_t), intent(inout) :: self
      type(error_t), allocatable :: ignored

      self%file%has_failed = .true.
      call published_close(self, ignored)
   end subroutine published_abandon

end module emcon_published
