!> The restart file NAME.rst.h5: named arrays that come back bit for bit.
!>
!> All that is stored carries checksums, and the file appears under its name only when it is whole.
module emcon_restart
   use emcon_errors, only : error_t, raise, err_file
   use emcon_files, only : file_close, file_open, file_remove, file_rename, file_sync, file_t
   use emcon_hdf5, only : hdf5_close, hdf5_create, hdf5_file_t, hdf5_make_group, hdf5_open
   use emcon_hdf5_data, only : hdf5_read_integers, hdf5_read_state, hdf5_read_texts, &
      hdf5_write_integers, hdf5_write_state, hdf5_write_texts
   use emcon_kinds, only : wp
   use emcon_sealed_file, only : seal_check, seal_put
   use emcon_text, only : string_t, to_text
   implicit none
   private
   public :: restart_t, restart_put, restart_get, restart_size, restart_write, restart_read

   !> A named array; one of the components is allocated.
   type :: entry_t
      character(len=:), allocatable :: name
      integer, allocatable :: whole(:)
      real(wp), allocatable :: state(:)
      type(string_t), allocatable :: text(:)
   end type entry_t

   !> Named arrays, to be written or as read.
   type :: restart_t
      private
      integer :: n_entry = 0
      type(entry_t), allocatable :: entry(:)
   end type restart_t

   !> Store an array under a name; what had the name before is replaced.
   interface restart_put
      module procedure put_integers, put_reals, put_table, put_texts
   end interface restart_put

   !> Fetch an array of known size; lists of texts come in their own size.
   interface restart_get
      module procedure get_integers, get_reals, get_table, get_texts
   end interface restart_get

   !> Groups by kind: integers, reals, texts. Their names are listed in `<group>_names`.
   character(len=*), parameter :: group(3) = [character(len=9) :: "/integers", "/reals", "/texts"]

contains

   subroutine put_integers(self, name, values)
      type(restart_t), intent(inout) :: self
      character(len=*), intent(in) :: name           !! without slash
      integer, intent(in) :: values(:)
      integer :: i

      call add_entry(self, name, i)
      self%entry(i)%whole = values
   end subroutine put_integers

   subroutine put_reals(self, name, values)
      type(restart_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: values(:)
      integer :: i

      call add_entry(self, name, i)
      self%entry(i)%state = values
   end subroutine put_reals

   subroutine put_table(self, name, values)
      type(restart_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: values(:, :)

      call put_reals(self, name, reshape(values, [size(values)]))
   end subroutine put_table

   subroutine put_texts(self, name, texts)
      type(restart_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(string_t), intent(in) :: texts(:)
      integer :: i

      call add_entry(self, name, i)
      self%entry(i)%text = texts
   end subroutine put_texts

   !> An empty entry of this name, old or new.
   subroutine add_entry(self, name, i)
      type(restart_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(out) :: i
      type(entry_t), allocatable :: grown(:)

      i = find_entry(self, name)
      if (i > 0) then
         self%entry(i) = entry_t(name)
         return
      end if
      if (.not. allocated(self%entry)) allocate(self%entry(16))
      if (self%n_entry == size(self%entry)) then
         allocate(grown(2*self%n_entry))
         grown(:self%n_entry) = self%entry
         call move_alloc(grown, self%entry)
      end if
      self%n_entry = self%n_entry + 1
      i = self%n_entry
      self%entry(i)%name = name
   end subroutine add_entry

   pure integer function find_entry(self, name) result(i)
      type(restart_t), intent(in) :: self
      character(len=*), intent(in) :: name

      do i = self%n_entry, 1, -1
         if (self%entry(i)%name == name) exit
      end do
   end function find_entry

   !> Number of values of the array `name`; -1 if there is none.
   pure integer function restart_size(self, name)
      type(restart_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer :: i

      restart_size = -1
      i = find_entry(self, name)
      if (i == 0) return
      if (allocated(self%entry(i)%whole)) restart_size = size(self%entry(i)%whole)
      if (allocated(self%entry(i)%state)) restart_size = size(self%entry(i)%state)
      if (allocated(self%entry(i)%text)) restart_size = size(self%entry(i)%text)
   end function restart_size

   subroutine get_integers(self, name, values, error)
      type(restart_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, intent(out) :: values(:)
      type(error_t), allocatable, intent(out) :: error
      integer :: i
      logical :: fits

      i = find_entry(self, name)
      fits = i > 0
      if (fits) fits = allocated(self%entry(i)%whole)
      if (fits) fits = size(self%entry(i)%whole) == size(values)
      if (fits) then
         values = self%entry(i)%whole
      else
         values = 0
         call raise_misfit(self, name, size(values), error)
      end if
   end subroutine get_integers

   subroutine get_reals(self, name, values, error)
      type(restart_t), intent(in) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(out) :: values(:)
      type(error_t), allocatable, intent(out) :: error
      integer :: i
      logical :: fits

      i = find_entry(self, name)
      fits = i > 0
      if (fits) fits = allocated(self%entry(i)%state)
      if (fits) fits = size(self%entry(i)%state) == size(values)
      if (fits) then
         values = self%entry(i)%state
      else
         values = 0.0_wp
         call raise_misfit(self, name, size(values), error)
      end if
   end subroutine get_reals

   subroutine get_table(self, name, values, error)
      type(restart_t), intent(in) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(out) :: values(:, :)
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: column(:)

      allocate(column(size(values)))
      call get_reals(self, name, column, error)
      values = reshape(column, shape(values))
   end subroutine get_table

   subroutine get_texts(self, name, texts, error)
      type(restart_t), intent(in) :: self
      character(len=*), intent(in) :: name
      type(string_t), allocatable, intent(out) :: texts(:)
      type(error_t), allocatable, intent(out) :: error
      integer :: i
      logical :: fits

      i = find_entry(self, name)
      fits = i > 0
      if (fits) fits = allocated(self%entry(i)%text)
      if (fits) then
         texts = self%entry(i)%text
      else
         call raise_misfit(self, name, -1, error)
      end if
   end subroutine get_texts

   subroutine raise_misfit(self, name, n, error)
      type(restart_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: n                       !! values wanted, -1: any number
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: text

      text = "the restart data do not fit the scene: '" // name // "'"
      if (restart_size(self, name) < 0) then
         text = text // " is missing"
      else if (n >= 0 .and. restart_size(self, name) /= n) then
         text = text // " has " // to_text(restart_size(self, name)) // " values, not " &
            // to_text(n)
      else
         text = text // " is of another type"
      end if
      call raise(error, err_file, text)
   end subroutine raise_misfit

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

   !> Version of the layout, and the kind of the state: neither can be mixed.
   pure subroutine format_text(text)
      character(len=:), allocatable, intent(out) :: text

      text = "emcon restart 4, reals of " // to_text(storage_size(1.0_wp)) // " bits"
   end subroutine format_text

   !> Index into `group`.
   pure integer function entry_kind(entry)
      type(entry_t), intent(in) :: entry

      entry_kind = 3
      if (allocated(entry%whole)) entry_kind = 1
      if (allocated(entry%state)) entry_kind = 2
   end function entry_kind

   subroutine write_entry(entry, file, path, error)
      type(entry_t), intent(in) :: entry
      type(hdf5_file_t), intent(inout) :: file
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error

      select case (entry_kind(entry))
      case (1)
         call hdf5_write_integers(file, path, entry%whole, error)
      case (2)
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
      character(len=:), allocatable :: needed
      type(error_t), allocatable :: ignored

      call seal_check(path, "", error)
      if (.not. allocated(error)) call hdf5_open(file, path, .false., error)
      if (.not. allocated(error)) call hdf5_read_texts(file, "/format", found, error)
      if (.not. allocated(error)) then
         call format_text(needed)
         if (size(found) /= 1) then
            call raise(error, err_file, path // " is not a restart file")
         else if (found(1)%text /= needed) then
            call raise(error, err_file, path // " is a restart file of another build of the " &
               // "program: it says '" // found(1)%text // "', needed is '" // needed // "'")
         end if
      end if
      if (.not. allocated(error)) call read_entries(self, file, error)
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
            call add_entry(self, name(j)%text, i)
            path = trim(group(k)) // "/" // name(j)%text
            select case (k)
            case (1)
               call hdf5_read_integers(file, path, self%entry(i)%whole, error)
            case (2)
               call hdf5_read_state(file, path, self%entry(i)%state, error)
            case default
               call hdf5_read_texts(file, path, self%entry(i)%text, error)
            end select
            if (allocated(error)) return
         end do
      end do
   end subroutine read_entries

end module emcon_restart
