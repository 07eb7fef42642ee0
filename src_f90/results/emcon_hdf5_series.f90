!> Data sets of an HDF5 file that grow row by row.
module emcon_hdf5_series
   use, intrinsic :: iso_c_binding, only : c_loc
   use emcon_errors, only : error_t, raise, err_file
   use emcon_hdf5, only : hdf5_fail, hdf5_file_t, hdf5_has
   use emcon_hdf5_data, only : hdf5_plan
   use emcon_kinds, only : dp, int64
   use emcon_text_file, only : clear_system_reason
   use hdf5, only : hid_t, hsize_t, h5screate_simple_f, h5sclose_f, h5sselect_hyperslab_f, &
      h5sget_simple_extent_ndims_f, h5sget_simple_extent_dims_f, h5dcreate_f, h5dopen_f, &
      h5dget_space_f, h5dset_extent_f, h5dwrite_f, h5pclose_f, H5S_SELECT_SET_F, &
      H5S_UNLIMITED_F, H5T_IEEE_F64LE, H5T_STD_I64LE, H5T_NATIVE_DOUBLE
   implicit none
   private
   public :: hdf5_series_t, series_begin, series_append, series_truncate

   integer, parameter :: max_row_rank = 2

   !> A growing data set, kept open as long as its file. A row has the shape `row_shape`.
   type :: hdf5_series_t
      private
      integer(hid_t) :: id = -1_hid_t
      character(len=:), allocatable :: name
      integer :: row_rank = 0
      integer(hsize_t) :: row_shape(max_row_rank) = 1
      integer(int64), public :: n_row = 0
   end type hdf5_series_t

contains

   !> Begin with the data set `name`: reals, or 64-bit integers if `is_integer`.
   !>
   !> In a file that is continued the data set may be there; then its rows stay.
   subroutine series_begin(self, file, name, row_shape, chunk_rows, is_integer, error)
      type(hdf5_series_t), intent(out) :: self
      type(hdf5_file_t), intent(inout) :: file
      character(len=*), intent(in) :: name
      integer, intent(in) :: row_shape(:)            !! none: a row is one value
      integer, intent(in) :: chunk_rows              !! rows that are stored together
      logical, intent(in) :: is_integer
      type(error_t), allocatable, intent(out) :: error

      self%name = name
      self%row_rank = size(row_shape)
      self%row_shape(:self%row_rank) = row_shape
      if (hdf5_has(file, name)) then
         call open_rows(self, file, error)
      else
         call create_rows(self, file, chunk_rows, is_integer, error)
      end if
   end subroutine series_begin

   subroutine create_rows(self, file, chunk_rows, is_integer, error)
      type(hdf5_series_t), intent(inout) :: self
      type(hdf5_file_t), intent(inout) :: file
      integer, intent(in) :: chunk_rows
      logical, intent(in) :: is_integer
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: plan, space
      integer(hsize_t), dimension(self%row_rank + 1) :: chunk, dims, max_dims
      integer :: n, e, ignored

      n = self%row_rank
      chunk = [self%row_shape(:n), int(chunk_rows, hsize_t)]
      dims = [self%row_shape(:n), 0_hsize_t]
      max_dims = [self%row_shape(:n), H5S_UNLIMITED_F]
      call hdf5_plan(file, chunk, plan)
      call h5screate_simple_f(n + 1, dims, space, e, max_dims)
      call clear_system_reason()
      if (is_integer) then
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

   !> Append `n_row` rows.
   subroutine series_append(self, file, values, n_row, error)
      type(hdf5_series_t), intent(inout) :: self
      type(hdf5_file_t), intent(inout) :: file
      integer, intent(in) :: n_row
      real(dp), intent(in), target :: values(product(self%row_shape)*n_row)   !! row after row
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
         call h5dwrite_f(self%id, H5T_NATIVE_DOUBLE, c_loc(values), e, memory_space, file_space)
         call h5sclose_f(memory_space, ignored)
         call h5sclose_f(file_space, ignored)
      end if
      if (e < 0) then
         call hdf5_fail(file, "write", self%name, error)
      else
         self%n_row = dims(n + 1)
      end if
   end subroutine series_append

   !> Keep the first `n_row` rows.
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
