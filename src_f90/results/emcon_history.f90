!> The history of a run: one row per increment, to NAME.csv for people and scripts and to NAME.h5.
!>
!> NAME.h5: `/history/<column>` (n_row); for each requested set and variable
!> `/sets/<SET>/<VARIABLE>` (n_time, n_item[, n_component]), `<VARIABLE>_time` (n_time) and
!> `<VARIABLE>_label` (n_item), and what else was put there; the deck and the version under `/run`.
module emcon_history
   use emcon_errors, only : error_t, raise, err_internal
   use emcon_files, only : file_close, file_open, file_put, file_remove, file_rename, file_t
   use emcon_hdf5, only : hdf5_has, hdf5_make_group
   use emcon_hdf5_data, only : hdf5_read_reals, hdf5_write_integers, hdf5_write_texts
   use emcon_hdf5_series, only : hdf5_series_t, series_append, series_begin, series_chunk, &
      series_flush, series_form_t, series_truncate
   use emcon_kinds, only : dp, int64
   use emcon_published, only : publication_is_due, published_abandon, published_close, &
      published_create, published_publish, published_resume, published_t
   use emcon_table_row, only : table_row_begin, table_row_line, table_row_t
   use emcon_text, only : string_t
   implicit none
   private
   public :: column_t, history_t, history_create, history_resume, history_append
   public :: history_set_define, history_set_append, history_set_once, history_set_put
   public :: history_put_run, history_publish, history_close

   !> One column of the history.
   type :: column_t
      character(len=32) :: name = ""
      logical :: is_integer = .false.
   end type column_t

   !> What one output request writes of one set.
   type :: set_series_t
      integer :: n_value = 0                         !! per time
      type(hdf5_series_t) :: time
      type(hdf5_series_t) :: values
   end type set_series_t

   !> A history being written.
   type :: history_t
      integer :: n_row = 0
      type(published_t), private :: store
      type(file_t), private :: csv
      type(column_t), allocatable, private :: column(:)
      type(table_row_t), private :: row              !! of NAME.csv
      type(hdf5_series_t), allocatable, private :: series(:)
      type(set_series_t), allocatable, private :: set(:)
      logical, private :: is_resumed = .false.
      real(dp), private :: time_resumed = 0.0_dp     !! of the last row that was kept [T]
   end type history_t

   !> Data that a set holds once: numbers or texts.
   interface history_set_put
      module procedure put_integers, put_texts
   end interface history_set_put

   integer, parameter :: chunk_rows = 256
   character(len=*), parameter :: line_end = achar(10)
   integer, parameter :: one_value(0) = [integer ::] !! shape of a row of one value

contains

   !> Begin the history `base`.csv, `base`.h5.
   subroutine history_create(self, base, columns, error)
      type(history_t), intent(out) :: self
      character(len=*), intent(in) :: base           !! output path without extension
      type(column_t), intent(in) :: columns(:)
      type(error_t), allocatable, intent(out) :: error

      call published_create(self%store, base // ".h5", error)
      if (.not. allocated(error)) call hdf5_make_group(self%store%file, "/history", error)
      if (.not. allocated(error)) call hdf5_make_group(self%store%file, "/sets", error)
      if (.not. allocated(error)) call begin_series(self, columns, error)
      if (.not. allocated(error)) call begin_csv(self, base, error)
      if (allocated(error)) call published_abandon(self%store)
   end subroutine history_create

   !> Go on after the first `n_row` rows; later ones are dropped.
   !>
   !> Sets are defined again by the caller; what they hold of later times is dropped then.
   subroutine history_resume(self, base, run, columns, n_row, error)
      type(history_t), intent(out) :: self
      character(len=*), intent(in) :: base
      character(len=*), intent(in) :: run            !! that the history is of
      type(column_t), intent(in) :: columns(:)       !! as the history was created with
      integer, intent(in) :: n_row
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      call published_resume(self%store, base // ".h5", run, error)
      if (.not. allocated(error)) call begin_series(self, columns, error)
      do i = 1, size(columns)
         if (allocated(error)) exit
         call series_truncate(self%series(i), self%store%file, int(n_row, int64), error)
      end do
      self%n_row = n_row
      self%is_resumed = .true.
      if (.not. allocated(error)) call begin_csv(self, base, error)
      if (allocated(error)) call published_abandon(self%store)
   end subroutine history_resume

   subroutine begin_series(self, columns, error)
      type(history_t), intent(inout) :: self
      type(column_t), intent(in) :: columns(:)
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      if (.not. any(columns%name == "time")) then
         call raise(error, err_internal, "history: no column is called time")
         return
      end if
      self%column = columns
      allocate(self%series(size(columns)), self%set(0))
      do i = 1, size(columns)
         call series_begin(self%series(i), self%store%file, column_path(columns(i)), one_value, &
            series_form_t(chunk_rows, is_integer=columns(i)%is_integer), error)
         if (allocated(error)) return
      end do
   end subroutine begin_series

   pure function column_path(column) result(path)
      type(column_t), intent(in) :: column
      character(len=len("/history/") + len_trim(column%name)) :: path

      path = "/history/" // trim(column%name)
   end function column_path

   !> Write NAME.csv anew: the header, and after a resumption the rows kept in NAME.h5.
   subroutine begin_csv(self, base, error)
      type(history_t), intent(inout) :: self
      character(len=*), intent(in) :: base
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: ignored
      real(dp), allocatable :: kept(:, :), values(:)
      character(len=:), allocatable :: header, line
      integer :: i

      header = trim(self%column(1)%name)
      do i = 2, size(self%column)
         header = header // "," // trim(self%column(i)%name)
      end do
      call table_row_begin(self%row, self%column%is_integer)
      allocate(kept(self%n_row, size(self%column)))
      do i = 1, size(self%column)
         if (.not. self%is_resumed) exit
         call hdf5_read_reals(self%store%file, column_path(self%column(i)), values, error)
         if (allocated(error)) return
         kept(:, i) = values
         if (self%column(i)%name == "time" .and. self%n_row > 0) then
            self%time_resumed = values(self%n_row)
         end if
      end do
      ! Renamed while open: what had the name before is replaced in one instant, by a whole file.
      call file_open(self%csv, base // ".csv.tmp", "w", error)
      if (.not. allocated(error)) call file_put(self%csv, header // line_end, error)
      do i = 1, self%n_row
         if (allocated(error)) exit
         call table_row_line(self%row, kept(i, :), line)
         call file_put(self%csv, line // line_end, error)
      end do
      if (.not. allocated(error)) call file_rename(base // ".csv.tmp", base // ".csv", error)
      if (.not. allocated(error)) return
      call file_close(self%csv, ignored)
      call file_remove(base // ".csv.tmp", ignored)
   end subroutine begin_csv

   !> Append a row; it is in NAME.csv when this returns.
   subroutine history_append(self, values, error)
      type(history_t), intent(inout) :: self
      real(dp), intent(in) :: values(:)              !! (n_column); whole numbers where integer
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: line
      integer :: i

      if (size(values) /= size(self%column)) then
         call raise(error, err_internal, "history_append: wrong number of values")
         return
      end if
      call table_row_line(self%row, values, line)
      call file_put(self%csv, line // line_end, error)
      if (allocated(error)) return
      do i = 1, size(self%series)
         call series_append(self%series(i), self%store%file, values(i:i), 1, error)
         if (allocated(error)) return
      end do
      self%n_row = self%n_row + 1
      self%store%is_changed = .true.
   end subroutine history_append

   !> Move the gathered rows to NAME.h5.
   subroutine write_waiting(self, error)
      type(history_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      do i = 1, size(self%series)
         call series_flush(self%series(i), self%store%file, error)
         if (allocated(error)) return
      end do
      do i = 1, size(self%set)
         call series_flush(self%set(i)%values, self%store%file, error)
         if (allocated(error)) return
         call series_flush(self%set(i)%time, self%store%file, error)
         if (allocated(error)) return
      end do
   end subroutine write_waiting

   !> Declare that `variable` of the set `set` will be written; `i_set` is what to append it by.
   subroutine history_set_define(self, set, variable, label, n_component, i_set, error)
      type(history_t), intent(inout) :: self
      character(len=*), intent(in) :: set
      character(len=*), intent(in) :: variable
      integer, intent(in), contiguous :: label(:)    !! (n_item) the user's numbers of its members
      integer, intent(in) :: n_component
      integer, intent(out) :: i_set
      type(error_t), allocatable, intent(out) :: error
      type(set_series_t), allocatable :: grown(:)
      type(set_series_t) :: new
      character(len=:), allocatable :: path
      integer, allocatable :: row_shape(:)

      path = "/sets/" // link_name(set) // "/" // link_name(variable)
      i_set = size(self%set) + 1
      call put_integers(self, set, link_name(variable) // "_label", label, error)
      if (allocated(error)) return
      new%n_value = n_component*size(label)
      row_shape = [n_component, size(label)]
      if (n_component == 1) row_shape = [size(label)]
      call series_begin(new%time, self%store%file, path // "_time", one_value, &
         series_form_t(chunk_rows), error)
      if (allocated(error)) return
      call series_begin(new%values, self%store%file, path, row_shape, &
         series_form_t(min(chunk_rows, series_chunk(new%n_value, 1))), error)
      if (allocated(error)) return
      if (self%is_resumed) call drop_later(self, new, path, error)
      if (allocated(error)) return
      allocate(grown(i_set))
      grown(:i_set - 1) = self%set
      grown(i_set) = new
      call move_alloc(grown, self%set)
   end subroutine history_set_define

   !> Keep `values` as `name` of the set `set`; what is there stays.
   subroutine put_integers(self, set, name, values, error)
      type(history_t), intent(inout) :: self
      character(len=*), intent(in) :: set, name
      integer, intent(in), contiguous :: values(:)
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: path

      call find_place(self, set, name, path, error)
      if (allocated(error)) return
      if (len(path) > 0) call hdf5_write_integers(self%store%file, path, values, error)
   end subroutine put_integers

   subroutine put_texts(self, set, name, values, error)
      type(history_t), intent(inout) :: self
      character(len=*), intent(in) :: set, name
      type(string_t), intent(in) :: values(:)
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: path

      call find_place(self, set, name, path, error)
      if (allocated(error)) return
      if (len(path) > 0) call hdf5_write_texts(self%store%file, path, values, error)
   end subroutine put_texts

   !> Path of a data set to be made in the group of `set`, which is made; empty if it is there.
   subroutine find_place(self, set, name, path, error)
      type(history_t), intent(inout) :: self
      character(len=*), intent(in) :: set, name
      character(len=:), allocatable, intent(out) :: path
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: group

      group = "/sets/" // link_name(set)
      path = group // "/" // link_name(name)
      if (.not. hdf5_has(self%store%file, group)) then
         call hdf5_make_group(self%store%file, group, error)
      else if (hdf5_has(self%store%file, path)) then
         path = ""
      end if
   end subroutine find_place

   !> Drop what a set of a resumed history holds of times after the resumption.
   subroutine drop_later(self, set, path, error)
      type(history_t), intent(inout) :: self
      type(set_series_t), intent(inout) :: set
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: time(:)
      integer(int64) :: n_kept

      call hdf5_read_reals(self%store%file, path // "_time", time, error)
      if (allocated(error)) return
      n_kept = count(time <= self%time_resumed, kind=int64)
      call series_truncate(set%time, self%store%file, n_kept, error)
      if (.not. allocated(error)) then
         call series_truncate(set%values, self%store%file, n_kept, error)
      end if
   end subroutine drop_later

   !> `name` as HDF5 can hold it: a slash would part it.
   pure function link_name(name) result(link)
      character(len=*), intent(in) :: name
      character(len=len(name)) :: link
      integer :: i

      link = name
      do i = 1, len(name)
         if (link(i:i) == "/") link(i:i) = "_"
      end do
      if (link == ".") link = "_"
   end function link_name

   !> Append the values of the set `i_set` at `time`.
   subroutine history_set_append(self, i_set, time, values, error)
      type(history_t), intent(inout) :: self
      integer, intent(in) :: i_set
      real(dp), intent(in) :: time                   !! [T]
      real(dp), intent(in), contiguous :: values(:, :)   !! (n_component, n_item)
      type(error_t), allocatable, intent(out) :: error

      associate (set => self%set(i_set))
         if (size(values) /= set%n_value) then
            call raise(error, err_internal, "history_set_append: wrong number of values")
            return
         end if
         call series_append(set%values, self%store%file, values, 1, error)
         if (.not. allocated(error)) then
            call series_append(set%time, self%store%file, [time], 1, error)
         end if
      end associate
      self%store%is_changed = .true.
   end subroutine history_set_append

   !> Put one value for each member of a set, of the run as a whole.
   subroutine history_set_once(self, set, variable, label, values, error)
      type(history_t), intent(inout) :: self
      character(len=*), intent(in) :: set, variable
      integer, intent(in), contiguous :: label(:)    !! (n_item) the user's numbers of its members
      real(dp), intent(in) :: values(:)              !! (n_item)
      type(error_t), allocatable, intent(inout) :: error   !! of an earlier failure: nothing is done
      integer :: i_set

      if (allocated(error)) return
      call history_set_define(self, set, variable, label, 1, i_set, error)
      if (.not. allocated(error)) call history_set_append(self, i_set, 0.0_dp, &
         reshape(values, [1, size(values)]), error)
   end subroutine history_set_once

   !> Keep with the results what made them: the text of the deck and the version of the program.
   subroutine history_put_run(self, run, deck, version, error)
      type(history_t), intent(inout) :: self
      character(len=*), intent(in) :: run            !! a line that names the run, for the seal
      type(string_t), intent(in) :: deck(:)          !! (n_line)
      character(len=*), intent(in) :: version
      type(error_t), allocatable, intent(out) :: error
      type(string_t) :: version_text(1)

      self%store%run = run
      version_text(1)%text = version
      call hdf5_make_group(self%store%file, "/run", error)
      if (.not. allocated(error)) then
         call hdf5_write_texts(self%store%file, "/run/deck", deck, error)
      end if
      if (.not. allocated(error)) then
         call hdf5_write_texts(self%store%file, "/run/version", version_text, error)
      end if
   end subroutine history_put_run

   !> Make all rows visible in NAME.h5, if it is time or `is_forced`; call it often.
   subroutine history_publish(self, is_forced, error)
      type(history_t), intent(inout) :: self
      logical, intent(in) :: is_forced
      type(error_t), allocatable, intent(out) :: error

      if (publication_is_due(self%store, is_forced)) then
         call write_waiting(self, error)
         if (.not. allocated(error)) call published_publish(self%store, error)
      end if
   end subroutine history_publish

   !> Complete both files; harmless if they are not open.
   subroutine history_close(self, error)
      type(history_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: csv_error

      if (self%store%file%id >= 0 .and. .not. self%store%file%has_failed) then
         call write_waiting(self, error)
      end if
      call file_close(self%csv, csv_error)
      if (allocated(error)) then
         call published_abandon(self%store)
      else
         call published_close(self%store, error)
      end if
      if (.not. allocated(error)) call move_alloc(csv_error, error)
   end subroutine history_close

end module emcon_history
