!> Whole data sets and attributes of HDF5 files. Shapes are in Fortran's order; a reader in C or
!> Python sees them reversed.
module emcon_hdf5_data
   use, intrinsic :: iso_c_binding, only : c_loc, c_null_char, c_ptr
   use, intrinsic :: iso_fortran_env, only : int8
   use emcon_errors, only : error_t, raise, err_file
   use emcon_hdf5, only : hdf5_fail, hdf5_file_t, hdf5_plan_object
   use emcon_kinds, only : dp, int64, wp
   use emcon_text, only : string_t
   use emcon_text_file, only : clear_system_reason
   use hdf5, only : hid_t, hsize_t, size_t, h5kind_to_type, &
      h5pclose_f, h5pset_chunk_f, h5pset_shuffle_f, h5pset_deflate_f, &
      h5pset_fletcher32_f, h5screate_simple_f, h5screate_f, h5sclose_f, &
      h5sget_simple_extent_npoints_f, h5dcreate_f, h5dopen_f, h5dclose_f, h5dwrite_f, h5dread_f, &
      h5dget_space_f, h5dget_type_f, h5oopen_f, h5oclose_f, h5acreate_f, h5aopen_f, h5awrite_f, &
      h5aclose_f, h5aexists_f, h5tcopy_f, h5tclose_f, h5tset_size_f, h5tget_size_f, &
      h5tset_strpad_f, h5tget_class_f, H5P_DATASET_CREATE_F, H5S_SCALAR_F, H5T_NATIVE_INTEGER, &
      H5T_NATIVE_DOUBLE, H5T_STD_I64LE, H5T_STD_U8LE, H5T_IEEE_F64LE, H5T_FORTRAN_S1, &
      H5T_STR_NULLPAD_F, H5T_STRING_F, H5_INTEGER_KIND, H5_REAL_KIND
   implicit none
   private
   public :: hdf5_plan, hdf5_write_attribute
   public :: hdf5_write_integers, hdf5_write_bytes, hdf5_write_reals, hdf5_write_state
   public :: hdf5_write_texts
   public :: hdf5_read_integers, hdf5_read_reals, hdf5_read_state, hdf5_read_texts

   !> An attribute: a text of fixed length, a list of integers, or one integer.
   interface hdf5_write_attribute
      module procedure write_attribute_text, write_attribute_list, write_attribute_integer
   end interface hdf5_write_attribute

   !> Largest number of values in one chunk of a data set written at once.
   integer(hsize_t), parameter :: max_chunk = 1048576_hsize_t
   !> Higher ones take twice the time, and what is worth packing is hardly smaller.
   integer, parameter :: deflate_level = 1
   !> Data sets written at once are packed from this size on.
   integer(hsize_t), parameter :: least_packed = 512_hsize_t

   !> How values lie in the file and in memory: numbers of HDF5.
   type :: layout_t
      integer(hid_t) :: space, file_type, memory_type
   end type layout_t

contains

   !> How a data set with chunks of shape `chunk` is stored. Close the list after use.
   subroutine hdf5_plan(self, chunk, is_packed, plan)
      type(hdf5_file_t), intent(in) :: self
      integer(hsize_t), intent(in) :: chunk(:)       !! in Fortran's order; none: in one piece
      logical, intent(in) :: is_packed
      integer(hid_t), intent(out) :: plan
      integer :: e

      call hdf5_plan_object(H5P_DATASET_CREATE_F, plan)
      if (size(chunk) == 0) return
      call h5pset_chunk_f(plan, size(chunk), chunk, e)
      if (self%is_checked) then
         call h5pset_fletcher32_f(plan, e)
      else if (is_packed) then
         call h5pset_shuffle_f(plan, e)
         call h5pset_deflate_f(plan, deflate_level, e)
      end if
   end subroutine hdf5_plan

   !> Stored with 64 bits. They are widened here: the library does so in a buffer of a megabyte that
   !> it clears for each data set.
   subroutine hdf5_write_integers(self, name, values, error)
      type(hdf5_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: values(:)
      type(error_t), allocatable, intent(out) :: error
      integer(int64), allocatable, target :: wide(:)

      allocate(wide, source=int(values, int64))
      call write_block(self, name, [size(values, kind=hsize_t)], H5T_STD_I64LE, &
         h5kind_to_type(int64, H5_INTEGER_KIND), c_loc(wide), error)
   end subroutine hdf5_write_integers

   !> Integers of 0..127, stored as bytes.
   subroutine hdf5_write_bytes(self, name, values, error)
      type(hdf5_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: values(:)
      type(error_t), allocatable, intent(out) :: error
      integer(int8), allocatable, target :: byte(:)

      allocate(byte, source=int(values, int8))
      call write_block(self, name, [size(values, kind=hsize_t)], H5T_STD_U8LE, H5T_STD_U8LE, &
         c_loc(byte), error)
   end subroutine hdf5_write_bytes

   subroutine hdf5_write_reals(self, name, values, error)
      type(hdf5_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(dp), intent(in), contiguous, target :: values(:, :)
      type(error_t), allocatable, intent(out) :: error

      call write_block(self, name, shape(values, kind=hsize_t), &
         H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, c_loc(values), error)
   end subroutine hdf5_write_reals

   !> Reals of the kind of the state, stored bit for bit.
   subroutine hdf5_write_state(self, name, values, error)
      type(hdf5_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in), contiguous, target :: values(:)
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: kind_type

      kind_type = h5kind_to_type(wp, H5_REAL_KIND)
      call write_block(self, name, [size(values, kind=hsize_t)], kind_type, kind_type, &
         c_loc(values), error)
   end subroutine hdf5_write_state

   !> Texts, stored in the length of the longest.
   subroutine hdf5_write_texts(self, name, texts, error)
      type(hdf5_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(string_t), intent(in) :: texts(:)
      type(error_t), allocatable, intent(out) :: error
      character(len=1), allocatable, target :: letter(:, :)
      integer(hid_t) :: text_type
      integer :: i, j, n, e

      n = 1
      do i = 1, size(texts)
         n = max(n, len(texts(i)%text))
      end do
      allocate(letter(n, size(texts)), source=c_null_char)
      do i = 1, size(texts)
         do j = 1, len(texts(i)%text)
            letter(j, i) = texts(i)%text(j:j)
         end do
      end do
      call make_text_type(n, text_type)
      call write_block(self, name, [size(texts, kind=hsize_t)], text_type, text_type, &
         c_loc(letter), error)
      call h5tclose_f(text_type, e)
   end subroutine hdf5_write_texts

   !> Texts of `n` bytes, filled up with zeros so that blanks at the end stay.
   subroutine make_text_type(n, text_type)
      integer, intent(in) :: n
      integer(hid_t), intent(out) :: text_type
      integer :: e

      call h5tcopy_f(H5T_FORTRAN_S1, text_type, e)
      call h5tset_size_f(text_type, int(n, size_t), e)
      call h5tset_strpad_f(text_type, H5T_STR_NULLPAD_F, e)
   end subroutine make_text_type

   !> Write the data set `name` at once from the memory at `address`.
   subroutine write_block(self, name, dims, file_type, memory_type, address, error)
      type(hdf5_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(hsize_t), intent(in) :: dims(:)        !! in Fortran's order
      integer(hid_t), intent(in) :: file_type, memory_type
      type(c_ptr), intent(in) :: address
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: plan, space, dset
      integer(hsize_t) :: chunk(size(dims))
      logical :: is_packed
      integer :: e, ignored

      chunk = dims
      chunk(size(dims)) = min(dims(size(dims)), max(1_hsize_t, max_chunk/max(dims(1), 1_hsize_t)))
      if (size(dims) == 1) chunk = min(dims, max_chunk)
      is_packed = file_type /= H5T_IEEE_F64LE .and. product(dims) >= least_packed
      if (product(dims) > 0 .and. (is_packed .or. self%is_checked)) then
         call hdf5_plan(self, chunk, is_packed, plan)
      else
         call hdf5_plan(self, chunk(:0), is_packed, plan)
      end if
      call h5screate_simple_f(size(dims), dims, space, e)
      call clear_system_reason()
      call h5dcreate_f(self%id, name, file_type, space, dset, e, dcpl_id=plan)
      if (e >= 0) then
         if (product(dims) > 0) call h5dwrite_f(dset, memory_type, address, e)
         if (e < 0) call hdf5_fail(self, "write", name, error)
         call h5dclose_f(dset, e)
      end if
      if (e < 0 .and. .not. allocated(error)) call hdf5_fail(self, "write", name, error)
      call h5sclose_f(space, ignored)
      call h5pclose_f(plan, ignored)
   end subroutine write_block

   subroutine write_attribute_text(self, object, name, text, error)
      type(hdf5_file_t), intent(inout) :: self
      character(len=*), intent(in) :: object         !! group or data set
      character(len=*), intent(in) :: name
      character(len=*), intent(in), target :: text
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: text_type, space
      integer :: e

      call make_text_type(len(text), text_type)
      call h5screate_f(H5S_SCALAR_F, space, e)
      call write_attribute(self, object, name, layout_t(space, text_type, text_type), &
         c_loc(text), error)
      call h5sclose_f(space, e)
      call h5tclose_f(text_type, e)
   end subroutine write_attribute_text

   subroutine write_attribute_list(self, object, name, values, error)
      type(hdf5_file_t), intent(inout) :: self
      character(len=*), intent(in) :: object
      character(len=*), intent(in) :: name
      integer, intent(in), contiguous, target :: values(:)
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: space
      integer :: e

      call h5screate_simple_f(1, [size(values, kind=hsize_t)], space, e)
      call write_attribute(self, object, name, layout_t(space, H5T_STD_I64LE, &
         H5T_NATIVE_INTEGER), c_loc(values), error)
      call h5sclose_f(space, e)
   end subroutine write_attribute_list

   subroutine write_attribute_integer(self, object, name, value, error)
      type(hdf5_file_t), intent(inout) :: self
      character(len=*), intent(in) :: object
      character(len=*), intent(in) :: name
      integer, intent(in), target :: value
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: space
      integer :: e

      call h5screate_f(H5S_SCALAR_F, space, e)
      call write_attribute(self, object, name, layout_t(space, H5T_STD_I64LE, &
         H5T_NATIVE_INTEGER), c_loc(value), error)
      call h5sclose_f(space, e)
   end subroutine write_attribute_integer

   !> Write the attribute `name` of `object`, anew or over its old value.
   subroutine write_attribute(self, object, name, layout, address, error)
      type(hdf5_file_t), intent(inout) :: self
      character(len=*), intent(in) :: object
      character(len=*), intent(in) :: name
      type(layout_t), intent(in) :: layout
      type(c_ptr), intent(in) :: address
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: owner, attribute
      logical :: is_there
      integer :: e, ignored

      call clear_system_reason()
      call h5oopen_f(self%id, object, owner, e)
      if (e >= 0) call h5aexists_f(owner, name, is_there, e)
      if (e >= 0) then
         if (is_there) then
            call h5aopen_f(owner, name, attribute, e)
         else
            call h5acreate_f(owner, name, layout%file_type, layout%space, attribute, e)
         end if
         if (e >= 0) then
            call h5awrite_f(attribute, layout%memory_type, address, e)
            call h5aclose_f(attribute, ignored)
         end if
         call h5oclose_f(owner, ignored)
      end if
      if (e < 0) call hdf5_fail(self, "write", object, error)
   end subroutine write_attribute

   subroutine hdf5_read_integers(self, name, values, error)
      type(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, allocatable, intent(out), target :: values(:)
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: dset
      integer :: n, stat

      call open_block(self, name, dset, n, error)
      if (allocated(error)) return
      allocate(values(n), stat=stat)
      if (stat == 0) stat = read_block(dset, H5T_NATIVE_INTEGER, n, c_loc(values))
      call close_block(self, name, dset, stat, error)
   end subroutine hdf5_read_integers

   !> Real or integer values of any shape, in the order in which Fortran stores them.
   subroutine hdf5_read_reals(self, name, values, error)
      type(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      real(dp), allocatable, intent(out), target :: values(:)
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: dset
      integer :: n, stat

      call open_block(self, name, dset, n, error)
      if (allocated(error)) return
      allocate(values(n), stat=stat)
      if (stat == 0) stat = read_block(dset, H5T_NATIVE_DOUBLE, n, c_loc(values))
      call close_block(self, name, dset, stat, error)
   end subroutine hdf5_read_reals

   subroutine hdf5_read_state(self, name, values, error)
      type(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(out), target :: values(:)
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: dset
      integer :: n, stat

      call open_block(self, name, dset, n, error)
      if (allocated(error)) return
      allocate(values(n), stat=stat)
      if (stat == 0) then
         stat = read_block(dset, h5kind_to_type(wp, H5_REAL_KIND), n, c_loc(values))
      end if
      call close_block(self, name, dset, stat, error)
   end subroutine hdf5_read_state

   subroutine hdf5_read_texts(self, name, texts, error)
      type(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      type(string_t), allocatable, intent(out) :: texts(:)
      type(error_t), allocatable, intent(out) :: error
      character(len=1), allocatable, target :: letter(:, :)
      integer(hid_t) :: dset, text_type
      integer(size_t) :: length
      integer :: i, j, n, class, stat, ignored

      call open_block(self, name, dset, n, error)
      if (allocated(error)) return
      length = 0
      call h5dget_type_f(dset, text_type, stat)
      if (stat >= 0) call h5tget_class_f(text_type, class, stat)
      if (stat >= 0) stat = merge(0, -1, class == H5T_STRING_F)
      if (stat >= 0) call h5tget_size_f(text_type, length, stat)
      if (stat >= 0) allocate(letter(length, n), stat=stat)
      if (stat == 0) allocate(texts(n), stat=stat)
      if (stat == 0) stat = read_block(dset, text_type, n, c_loc(letter))
      if (stat == 0) then
         do i = 1, n
            allocate(character(len=count(letter(:, i) /= c_null_char)) :: texts(i)%text)
            do j = 1, len(texts(i)%text)
               texts(i)%text(j:j) = letter(j, i)
            end do
         end do
      end if
      call h5tclose_f(text_type, ignored)
      call close_block(self, name, dset, stat, error)
   end subroutine hdf5_read_texts

   !> Open the data set `name` and count its values.
   subroutine open_block(self, name, dset, n, error)
      type(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(hid_t), intent(out) :: dset
      integer, intent(out) :: n
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: space
      integer(hsize_t) :: n_wide
      integer :: e, ignored

      n = 0
      call h5dopen_f(self%id, name, dset, e)
      if (e < 0) then
         call raise(error, err_file, self%path // " holds no data set " // name &
            // ": it is damaged, or not a file of this program")
         return
      end if
      call h5dget_space_f(dset, space, e)
      n_wide = -1
      if (e >= 0) call h5sget_simple_extent_npoints_f(space, n_wide, e)
      if (e >= 0) call h5sclose_f(space, ignored)
      if (n_wide >= 0 .and. n_wide <= huge(n)) then
         n = int(n_wide)
      else
         call close_block(self, name, dset, -1, error)
      end if
   end subroutine open_block

   integer function read_block(dset, memory_type, n, address) result(stat)
      integer(hid_t), intent(in) :: dset, memory_type
      integer, intent(in) :: n
      type(c_ptr), intent(in) :: address
      type(c_ptr) :: buffer

      stat = 0
      buffer = address
      if (n > 0) call h5dread_f(dset, memory_type, buffer, stat)
   end function read_block

   !> Close the data set `name`; `stat` other than zero becomes an error.
   subroutine close_block(self, name, dset, stat, error)
      type(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(hid_t), intent(in) :: dset
      integer, intent(in) :: stat
      type(error_t), allocatable, intent(out) :: error
      integer :: ignored

      call h5dclose_f(dset, ignored)
      if (stat == 0) return
      call raise(error, err_file, "cannot read the data set " // name // " of " // self%path &
         // ": the file is damaged, or not a file of this program")
   end subroutine close_block

end module emcon_hdf5_data
