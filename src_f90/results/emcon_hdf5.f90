!> HDF5 files with errors as values: create, open, flush, close.
!>
!> Whole data sets and attributes: `emcon_hdf5_data`; growing data sets: `emcon_hdf5_series`. Every
!> failure names the file, what was being done and, where the system gave one, the reason; the
!> library's own report is silenced.
module emcon_hdf5
   use, intrinsic :: iso_c_binding, only : c_associated, c_bool, c_f_pointer, c_float, c_int, &
      c_int64_t, c_null_ptr, c_ptr
   use emcon_errors, only : error_t, raise, err_file
   use emcon_files, only : file_discard, file_exists
   use emcon_sealed_file, only : seal_size
   use emcon_text_file, only : clear_system_reason, system_reason
   use hdf5, only : hid_t, hsize_t, size_t, h5dont_atexit_f, h5open_f, h5eset_auto_f, h5fcreate_f, &
      h5fopen_f, h5fclose_f, h5fflush_f, h5gcreate_f, h5gclose_f, h5lexists_f, h5pcreate_f, &
      h5pclose_f, h5pset_fclose_degree_f, h5pset_cache_f, h5pset_libver_bounds_f, &
      h5pset_userblock_f, &
      H5F_ACC_TRUNC_F, H5F_ACC_RDWR_F, H5F_ACC_RDONLY_F, H5F_CLOSE_STRONG_F, &
      H5F_LIBVER_LATEST_F, H5F_SCOPE_GLOBAL_F, H5P_FILE_ACCESS_F, H5P_FILE_CREATE_F, &
      H5P_GROUP_CREATE_F, H5P_DEFAULT_F
   implicit none
   private
   public :: hdf5_file_t, hdf5_create, hdf5_open, hdf5_flush, hdf5_close, hdf5_fail
   public :: hdf5_make_group, hdf5_plan_object, hdf5_has

   !> An open HDF5 file. Closed by `hdf5_close`; no finaliser, for the reason given at `file_t`.
   type :: hdf5_file_t
      integer(hid_t) :: id = -1_hid_t
      character(len=:), allocatable :: path
      logical :: is_checked = .false.    !! checksums on all that is stored, no compression
      logical :: has_failed = .false.    !! something was not written: the file is worth nothing
   end type hdf5_file_t

   !> Bytes of chunk cache per open data set: rows of a few columns are gathered, whole frames pass.
   integer(size_t), parameter :: cache_size = 65536_size_t

   interface
      integer(c_int) function c_h5pset_obj_track_times(plist, is_tracked) &
         bind(c, name="H5Pset_obj_track_times")
         import :: c_bool, c_int, c_int64_t
         integer(c_int64_t), value :: plist
         logical(c_bool), value :: is_tracked
      end function c_h5pset_obj_track_times

      integer(c_int) function c_h5fget_vfd_handle(file, plist, handle) &
         bind(c, name="H5Fget_vfd_handle")
         import :: c_int, c_int64_t, c_ptr
         integer(c_int64_t), value :: file, plist
         type(c_ptr), intent(out) :: handle
      end function c_h5fget_vfd_handle
   end interface

contains

   !> Make a new file at `path`. Unless `is_checked`, any reader since HDF5 1.6 can read it.
   subroutine hdf5_create(self, path, is_checked, error)
      type(hdf5_file_t), intent(out) :: self
      character(len=*), intent(in) :: path
      logical, intent(in) :: is_checked
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: access, plan
      integer :: e, ignored

      self%path = path
      self%is_checked = is_checked
      call make_access(access)
      if (is_checked) then
         call h5pset_libver_bounds_f(access, H5F_LIBVER_LATEST_F, H5F_LIBVER_LATEST_F, e)
      end if
      call hdf5_plan_object(H5P_FILE_CREATE_F, plan)
      call h5pset_userblock_f(plan, int(seal_size, hsize_t), e)
      call clear_system_reason()
      call h5fcreate_f(path, H5F_ACC_TRUNC_F, self%id, e, plan, access)
      if (e < 0) then
         self%id = -1_hid_t
         call hdf5_fail(self, "create", "", error)
      end if
      call h5pclose_f(plan, ignored)
      call h5pclose_f(access, ignored)
   end subroutine hdf5_create

   !> Open the file at `path`, to read only unless `is_writable`.
   subroutine hdf5_open(self, path, is_writable, error)
      type(hdf5_file_t), intent(out) :: self
      character(len=*), intent(in) :: path
      logical, intent(in) :: is_writable
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: reason
      integer(hid_t) :: access
      integer :: e

      self%path = path
      if (.not. file_exists(path)) then
         call raise(error, err_file, path // " does not exist")
         return
      end if
      call make_access(access)
      call clear_system_reason()
      call h5fopen_f(path, merge(H5F_ACC_RDWR_F, H5F_ACC_RDONLY_F, is_writable), self%id, e, access)
      if (e < 0) then
         self%id = -1_hid_t
         call system_reason(reason)
         if (reason == "") then
            call raise(error, err_file, path // " is not an HDF5 file, or is damaged")
         else
            call hdf5_fail(self, "open", "", error)
         end if
      end if
      call h5pclose_f(access, e)
   end subroutine hdf5_open

   !> Start the library quietly, and say how files are opened.
   subroutine make_access(access)
      integer(hid_t), intent(out) :: access
      integer :: e

      ! At the end of the program the library would trip over a file that it could not close.
      call h5dont_atexit_f(e)
      call h5open_f(e)
      call h5eset_auto_f(0, e)
      call h5pcreate_f(H5P_FILE_ACCESS_F, access, e)
      call h5pset_fclose_degree_f(access, H5F_CLOSE_STRONG_F, e)
      call h5pset_cache_f(access, 0, 521_size_t, cache_size, 1.0_c_float, e)
   end subroutine make_access

   !> Hand all that was written to the system: the file is complete then.
   subroutine hdf5_flush(self, error)
      type(hdf5_file_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      integer :: e

      call clear_system_reason()
      call h5fflush_f(self%id, H5F_SCOPE_GLOBAL_F, e)
      if (e < 0) call hdf5_fail(self, "write", "", error)
   end subroutine hdf5_flush

   !> Close the file and all that is open in it; harmless if it is not open.
   !>
   !> A close that fails leaves the library in a state that crashes at the end of the program. So
   !> what can fail is tried before, and a file that could not be written ends in memory.
   subroutine hdf5_close(self, error)
      type(hdf5_file_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      type(c_ptr) :: handle
      integer(c_int), pointer :: fd
      integer :: e

      if (self%id < 0) return
      if (.not. self%has_failed) call hdf5_flush(self, error)
      if (self%has_failed) then
         handle = c_null_ptr
         e = c_h5fget_vfd_handle(self%id, H5P_DEFAULT_F, handle)
         if (e >= 0 .and. c_associated(handle)) then
            call c_f_pointer(handle, fd)
            call file_discard(fd)
         end if
      end if
      call h5fclose_f(self%id, e)
      self%id = -1_hid_t
      if (e < 0 .and. .not. self%has_failed) call hdf5_fail(self, "close", "", error)
   end subroutine hdf5_close

   !> Report that `action` failed on the data set `name` ("": the file), and mark the file.
   subroutine hdf5_fail(self, action, name, error)
      type(hdf5_file_t), intent(inout) :: self
      character(len=*), intent(in) :: action
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: text, reason

      self%has_failed = .true.
      text = "cannot " // action // " " // self%path
      if (name /= "") text = text // " (data set " // name // ")"
      call system_reason(reason)
      if (reason == "") reason = "refused by the HDF5 library"
      call raise(error, err_file, text // ": " // reason)
   end subroutine hdf5_fail

   !> A list of creation properties of this class, without the time of creation: that would make the
   !> files of two equal runs differ. Close the list after use.
   subroutine hdf5_plan_object(class, plan)
      integer(hid_t), intent(in) :: class
      integer(hid_t), intent(out) :: plan
      integer :: e

      call h5pcreate_f(class, plan, e)
      e = c_h5pset_obj_track_times(plan, .false._c_bool)
   end subroutine hdf5_plan_object

   !> Make the group `name`.
   subroutine hdf5_make_group(self, name, error)
      type(hdf5_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: group, plan
      integer :: e, ignored

      call hdf5_plan_object(H5P_GROUP_CREATE_F, plan)
      call clear_system_reason()
      call h5gcreate_f(self%id, name, group, e, gcpl_id=plan)
      if (e >= 0) call h5gclose_f(group, e)
      if (e < 0) call hdf5_fail(self, "write", name, error)
      call h5pclose_f(plan, ignored)
   end subroutine hdf5_make_group

   !> Whether the file holds `name`, whose group must be there.
   logical function hdf5_has(self, name)
      type(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer :: e

      call h5lexists_f(self%id, name, hdf5_has, e)
      hdf5_has = hdf5_has .and. e >= 0
   end function hdf5_has

end module emcon_hdf5
