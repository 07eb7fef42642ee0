!> Data sets of an HDF5 file that grow row by row.
!>
!> Small rows are gathered in memory and go to the file as whole chunks, or with `series_flush`.
module emcon_hdf5_series
   use, intrinsic :: iso_c_binding, only : c_loc, c_ptr
   use emcon_errors, only : error_t, raise, err_file
   use emcon_hdf5, only : hdf5_fail, hdf5_file_t, hdf5_has
   use emcon_hdf5_data, only : hdf5_plan
   use emcon_kinds, only : dp, int64
   use emcon_text_file, only : clear_system_reason
   use hdf5, only : hid_t, hsize_t, h5screate_simple_f, h5sclose_f, h5sselect_hyperslab_f, &
      h5sget_simple_extent_ndims_f, h5sget_simple_extent_dims_f, h5dcreate_f, h5dopen_f, &
      h5dget_space_f, h5dset_extent_f, h5dwrite_f, h5pclose_f, H5S_SELECT_SET_F, &
      H5S_UNLIMITED_F, H5T_IEEE_F64LE, H5T_STD_I64LE, H5T_NATIVE_DOUBLE, h5kind_to_type, &
      H5_INTEGER_KIND
   implicit none
   private
   public :: hdf5_series_t, series_form_t, series_begin, series_append, series_flush, &
      series_truncate, series_chunk

   integer, parameter :: max_row_rank = 2
   !> Values of a chunk of small rows: 32 kilobytes.
   integer, parameter :: chunk_values = 4096

   !> How a growing data set is stored.
   type :: series_form_t
      integer :: chunk_rows = 1          !! rows that are stored together
      logical :: is_integer = .false.    !! 64-bit integers, else reals
      logical :: is_packed = .false.     !! compressed: worth it where most values are the same
   end type series_form_t

   !> A growing data set, kept open as long as its file. A row has the shape `row_shape`.
   type :: hdf5_series_t
      private
      integer(hid_t) :: id = -1_hid_t
      character(len=:), allocatable :: name
      logical :: is_integer = .false.
      integer :: row_rank = 0
      integer(hsize_t) :: row_shape(max_row_rank) = 1
      integer(int64), public :: n_row = 0            !! with those that wait
      integer :: n_wait = 0                          !! so many rows are gathered
      integer :: n_waiting = 0                       !! rows that are not yet in the file
      real(dp), allocatable :: waiting(:)            !! their values, and room
   end type hdf5_series_t

contains

   !> Begin with the data set `name`.
   !>
   !> In a file that is continued the data set may be there; then its rows stay.
   subroutine series_begin(self, file, name, row_shape, form, error)
      type(hdf5_series_t), intent(out) :: self
      type(hdf5_file_t), intent(inout) :: file
      character(len=*), intent(in) :: name
      integer, intent(in) :: row_shape(:)            !! none: a row is one value
      type(series_form_t), intent(in) :: form
      type(error_t), allocatable, intent(out) :: error

      self%name = name
      self%is_integer = form%is_integer
      self%row_rank = size(row_shape)
      self%row_shape(:self%row_rank) = row_shape
      self%n_wait = int(min(int(form%chunk_rows, hsize_t), &
         chunk_values/product(self%row_shape)))
      if (hdf5_has(file, name)) then
         call open_rows(self, file, error)
      else
         call create_rows(self, file, form, error)
      end if
   end subroutine series_begin

   !> Rows of `n_value` values that make up a chunk, a multiple of `n_step` and about 32 kilobytes.
   pure integer function series_chunk(n_value, n_step)
      integer, intent(in) :: n_value             !! of a row
      integer, intent(in) :: n_step              !! rows that come at once

      series_chunk = n_step*max(1, chunk_values/max(1, n_value*n_step))
   end function series_chunk

   subroutine create_rows(self, file, form, error)
      type(hdf5_series_t), intent(inout) :: self
      type(hdf5_file_t), intent(inout) :: file
      type(series_form_t), intent(in) :: form
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: plan, space
      integer(hsize_t), dimension(self%row_rank + 1) :: chunk, dims, max_dims
      integer :: n, e, ignored

      n = self%row_rank
      chunk = [self%row_shape(:n), int(form%chunk_rows, hsize_t)]
      dims = [self%row_shape(:n), 0_hsize_t]
      max_dims = [self%row_shape(:n), H5S_UNLIMITED_F]
      call hdf5_plan(file, chunk, form%is_packed, plan)
      call h5screate_simple_f(n + 1, dims, space, e, max_dims)
      call clear_system_reason()
      if (self%is_integer) then
         call h5dcreate_f(file%id, self%name, H5T_STD_I64LE, space, self%id, e, dcpl_id=plan)
      else
         call h5dcreate_f(file%id, self%name, H5T_IEEE_F64LE, space, self%id, e, dcpl_id=plan)
      end if
      if (e < 0) call hdf5_fail(file, "write", self%name, error)
      call h5sclose_f(space, ignored)
      call h5pclose_f(plan, ignored)
   end subroutine create_rows

   subroutine open_rows(self, file, error)
      type(hdf5_series_t), intent(inout) :: self
      type(hdf5_file_t), intent(in) :: file
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: space
      integer(hsize_t), dimension(self%row_rank + 1) :: dims, max_dims
      logical :: has_shape
      integer :: n, rank, e, ignored

      n = self%row_rank
      has_shape = .false.
      call h5dopen_f(file%id, self%name, self%id, e)
      if (e >= 0) call h5dget_space_f(self%id, space, e)
      if (e >= 0) then
         call h5sget_simple_extent_ndims_f(space, rank, e)
         if (e >= 0 .and. rank == n + 1) then
            call h5sget_simple_extent_dims_f(space, dims, max_dims, e)
            has_shape = e >= 0 .and. all(dims(:n) == self%row_shape(:n))
         end if
         call h5sclose_f(space, ignored)
      end if
      if (has_shape) then
         self%n_row = dims(n + 1)
      else
         call raise(error, err_file, file%path // " cannot be continued: its data set " &
            // self%name // " has another shape than this scene gives")
      end if
   end subroutine open_rows

   !> Append `n_row` rows; they are in the file after `series_flush`.
   subroutine series_append(self, file, values, n_row, error)
      type(hdf5_series_t), intent(inout) :: self
      type(hdf5_file_t), intent(inout) :: file
      integer, intent(in) :: n_row
      !> Row after row; whole numbers where the file has integers.
      real(dp), intent(in) :: values(product(self%row_shape)*n_row)
      type(error_t), allocatable, intent(out) :: error
      integer :: n_value

      if (self%n_waiting + n_row > self%n_wait) call series_flush(self, file, error)
      if (allocated(error)) return
      n_value = int(product(self%row_shape))
      if (n_row >= self%n_wait) then
         call write_rows(self, file, values, n_row, error)
         if (allocated(error)) return
      else
         if (.not. allocated(self%waiting)) allocate(self%waiting(self%n_wait*n_value))
         self%waiting(self%n_waiting*n_value + 1:(self%n_waiting + n_row)*n_value) = values
         self%n_waiting = self%n_waiting + n_row
      end if
      self%n_row = self%n_row + n_row
   end subroutine series_append

   !> Move what was gathered to the file.
   subroutine series_flush(self, file, error)
      type(hdf5_series_t), intent(inout) :: self
      type(hdf5_file_t), intent(inout) :: file
      type(error_t), allocatable, intent(out) :: error
      integer :: n

      n = self%n_waiting
      if (n == 0) return
      self%n_row = self%n_row - n
      self%n_waiting = 0
      call write_rows(self, file, self%waiting(:n*int(product(self%row_shape))), n, error)
      self%n_row = self%n_row + n
   end subroutine series_flush

   !> Write rows behind those in the file. What is an integer there is handed over as one: the
   !> library converts in a buffer that it clears for each call.
   subroutine write_rows(self, file, values, n_row, error)
      type(hdf5_series_t), intent(in) :: self
      type(hdf5_file_t), intent(inout) :: file
      real(dp), intent(in), contiguous, target :: values(:)
      integer, intent(in) :: n_row
      type(error_t), allocatable, intent(out) :: error
      integer(int64), allocatable, target :: whole(:)

      if (self%is_integer) then
         allocate(whole, source=nint(values, int64))
         call write_block(self, file, h5kind_to_type(int64, H5_INTEGER_KIND), c_loc(whole), n_row, &
            error)
      else
         call write_block(self, file, H5T_NATIVE_DOUBLE, c_loc(values), n_row, error)
      end if
   end subroutine write_rows

   subroutine write_block(self, file, memory_type, address, n_row, error)
      type(hdf5_series_t), intent(in) :: self
      type(hdf5_file_t), intent(inout) :: file
      integer(hid_t), intent(in) :: memory_type
      type(c_ptr), intent(in) :: address
      integer, intent(in) :: n_row
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: file_space, memory_space
      integer(hsize_t), dimension(self%row_rank + 1) :: dims, start, block
      integer :: n, e, ignored

      n = self%row_rank
      block = [self%row_shape(:n), int(n_row, hsize_t)]
      start = 0
      start(n + 1) = self%n_row
      dims = start + block
      call clear_system_reason()
      call h5dset_extent_f(self%id, dims, e)
      if (e >= 0) call h5dget_space_f(self%id, file_space, e)
      if (e >= 0) then
         call h5screate_simple_f(n + 1, block, memory_space, e)
         call h5sselect_hyperslab_f(file_space, H5S_SELECT_SET_F, start, block, e)
         call h5dwrite_f(self%id, memory_type, address, e, memory_space, file_space)
         call h5sclose_f(memory_space, ignored)
         call h5sclose_f(file_space, ignored)
      end if
      if (e < 0) call hdf5_fail(file, "write", self%name, error)
   end subroutine write_block

   !> Keep the first `n_row` rows of those in the file; none wait.
   subroutine series_truncate(self, file, n_row, error)
      type(hdf5_series_t), intent(inout) :: self
      type(hdf5_file_t), intent(inout) :: file
      integer(int64), intent(in) :: n_row
      type(error_t), allocatable, intent(out) :: error
      integer :: e

      if (n_row > self%n_row) then
         call raise(error, err_file, file%path // " cannot be continued: its data set " &
            // self%name // " ends before the state to continue from")
         return
      end if
      call clear_system_reason()
      call h5dset_extent_f(self%id, [self%row_shape(:self%row_rank), int(n_row, hsize_t)], e)
      if (e < 0) call hdf5_fail(file, "write", self%name, error)
      self%n_row = n_row
   end subroutine series_truncate

end module emcon_hdf5_series
