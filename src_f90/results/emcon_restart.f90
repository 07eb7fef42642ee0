!> The restart file NAME.rst.h5: the arrays come back bit for bit.
!>
!> All that is stored carries checksums, and the file appears under its name only when it is whole.
module emcon_restart
   use emcon_errors, only : error_t, raise, err_file
   use emcon_files, only : file_close, file_open, file_remove, file_rename, file_sync, file_t
   use emcon_hdf5, only : hdf5_close, hdf5_create, hdf5_file_t, hdf5_make_group, hdf5_open
   use emcon_hdf5_data, only : hdf5_read_integers, hdf5_read_state, hdf5_read_texts, &
      hdf5_write_integers, hdf5_write_state, hdf5_write_texts
   use emcon_kinds, only : wp
   use emcon_restart_data, only : entry_add, entry_kind, entry_t, of_integers, of_reals, &
      restart_rewind, restart_t
   use emcon_sealed_file, only : seal_check, seal_put
   use emcon_text, only : string_t, to_text
   use emcon_version, only : precision_names, this_precision
   implicit none
   private
   public :: restart_t, restart_write, restart_read

   !> Groups by kind: integers, reals, texts. Their names are listed in `<group>_names`.
   character(len=*), parameter :: group(3) = [character(len=9) :: "/integers", "/reals", "/texts"]
   !> Version of the layout.
   character(len=*), parameter :: layout = "emcon restart 7"

contains

   !> Write all arrays to `path`, in one instant as seen by others.
   subroutine restart_write(self, path, error)
      type(restart_t), intent(in) :: self
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error
      type(hdf5_file_t) :: file
      type(file_t) :: written
      type(error_t), allocatable :: close_error

      call hdf5_create(file, path // ".tmp", .true., error)
      if (.not. allocated(error)) call write_entries(self, file, error)
      call hdf5_close(file, close_error)
      if (.not. allocated(error)) call move_alloc(close_error, error)
      if (.not. allocated(error)) call seal_put(path // ".tmp", "", error)
      if (.not. allocated(error)) call file_open(written, path // ".tmp", "r", error)
      if (.not. allocated(error)) call file_sync(written, error)
      call file_close(written, close_error)
      if (.not. allocated(error)) call file_rename(path // ".tmp", path, error)
      if (allocated(error)) call file_remove(path // ".tmp", close_error)
   end subroutine restart_write

   subroutine write_entries(self, file, error)
      type(restart_t), intent(in) :: self
      type(hdf5_file_t), intent(inout) :: file
      type(error_t), allocatable, intent(out) :: error
      type(string_t) :: name(self%n_entry), format(1)
      integer :: i, k, n

      call format_text(format(1)%text)
      call hdf5_write_texts(file, "/format", format, error)
      do k = 1, size(group)
         if (allocated(error)) return
         call hdf5_make_group(file, trim(group(k)), error)
         n = 0
         do i = 1, self%n_entry
            if (allocated(error)) return
            if (entry_kind(self%entry(i)) /= k) cycle
            n = n + 1
            name(n)%text = self%entry(i)%name
            call write_entry(self%entry(i), file, trim(group(k)) // "/" // name(n)%text, error)
         end do
         if (allocated(error)) return
         call hdf5_write_texts(file, trim(group(k)) // "_names", name(:n), error)
      end do
   end subroutine write_entries

   !> The layout, and the kind of the state: neither can be mixed.
   pure subroutine format_text(text)
      character(len=:), allocatable, intent(out) :: text

      text = layout // ", reals of " // to_text(storage_size(1.0_wp)) // " bits"
   end subroutine format_text

   subroutine write_entry(entry, file, path, error)
      type(entry_t), intent(in) :: entry
      type(hdf5_file_t), intent(inout) :: file
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error

      select case (entry_kind(entry))
      case (of_integers)
         call hdf5_write_integers(file, path, entry%whole, error)
      case (of_reals)
         call hdf5_write_state(file, path, entry%state, error)
      case default
         call hdf5_write_texts(file, path, entry%text, error)
      end select
   end subroutine write_entry

   !> Read all arrays from `path`.
   subroutine restart_read(self, path, error)
      type(restart_t), intent(out) :: self
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error
      type(hdf5_file_t) :: file
      type(string_t), allocatable :: found(:)
      character(len=:), allocatable :: needed, advice
      type(error_t), allocatable :: ignored

      call seal_check(path, "", error)
      if (.not. allocated(error)) call hdf5_open(file, path, .false., error)
      if (.not. allocated(error)) call hdf5_read_texts(file, "/format", found, error)
      if (.not. allocated(error)) then
         call format_text(needed)
         if (size(found) /= 1) then
            call raise(error, err_file, path // " is not a restart file")
         else if (found(1)%text /= needed) then
            advice = ""
            if (index(found(1)%text, layout) == 1) advice = ". This is " // &
               trim(precision_names(this_precision)) // " precision: go on with the build that " &
               // "wrote it, or run the deck again"
            call raise(error, err_file, path // " is a restart file of another build of the " &
               // "program: it says '" // found(1)%text // "', needed is '" // needed // "'" &
               // advice)
         end if
      end if
      if (.not. allocated(error)) call read_entries(self, file, error)
      call restart_rewind(self)
      call hdf5_close(file, ignored)
   end subroutine restart_read

   subroutine read_entries(self, file, error)
      type(restart_t), intent(inout) :: self
      type(hdf5_file_t), intent(in) :: file
      type(error_t), allocatable, intent(out) :: error
      type(string_t), allocatable :: name(:)
      character(len=:), allocatable :: path
      integer :: i, j, k

      do k = 1, size(group)
         call hdf5_read_texts(file, trim(group(k)) // "_names", name, error)
         if (allocated(error)) return
         do j = 1, size(name)
            call entry_add(self, name(j)%text, k, i)
            path = trim(group(k)) // "/" // name(j)%text
            select case (k)
            case (of_integers)
               call hdf5_read_integers(file, path, self%entry(i)%whole, error)
            case (of_reals)
               call hdf5_read_state(file, path, self%entry(i)%state, error)
            case default
               call hdf5_read_texts(file, path, self%entry(i)%text, error)
            end select
            if (allocated(error)) return
         end do
      end do
   end subroutine read_entries

end module emcon_restart
