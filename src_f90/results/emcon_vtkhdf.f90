!> The field file NAME.vtkhdf: a fixed mesh and fields over time, as VTK and ParaView read them.
!>
!> Layout: VTKHDF 2.0, UnstructuredGrid, transient, one part, the mesh stored once.
module emcon_vtkhdf
   use emcon_errors, only : error_t, raise, err_internal
   use emcon_hdf5, only : hdf5_file_t, hdf5_make_group
   use emcon_hdf5_data, only : hdf5_read_integers, hdf5_read_reals, hdf5_write_attribute, &
      hdf5_write_bytes, hdf5_write_integers, hdf5_write_reals
   use emcon_hdf5_series, only : hdf5_series_t, series_append, series_begin, series_chunk, &
      series_flush, series_form_t, series_truncate
   use emcon_kinds, only : dp, int64
   use emcon_published, only : publication_is_due, published_abandon, published_close, &
      published_create, published_publish, published_resume, published_t
   implicit none
   private
   public :: field_t, vtkhdf_t, vtkhdf_create, vtkhdf_resume, vtkhdf_begin_frame, vtkhdf_write
   public :: vtkhdf_put_run, vtkhdf_end_frame, vtkhdf_publish, vtkhdf_close

   !> What a field is called, and where it lives.
   type :: field_t
      character(len=64) :: name = ""
      integer :: n_component = 1         !! 2: a vector of the plane, stored with a third zero
      logical :: is_cell = .false.       !! one value per cell, else per point
      logical :: is_sparse = .false.     !! the same in most places: worth packing
   end type field_t

   !> A declared field and its data sets.
   type :: stored_field_t
      type(field_t) :: field
      integer :: n_item = 0                          !! points or cells
      integer :: n_written = 0                       !! frames that brought new values
      logical :: is_written = .false.                !! in the frame at hand
      type(hdf5_series_t) :: values                  !! all frames, one after the other
      type(hdf5_series_t) :: offset                  !! (n_frame) first row of a frame in `values`
   end type stored_field_t

   !> A field file being written.
   type :: vtkhdf_t
      integer :: n_frame = 0                         !! complete frames
      type(published_t), private :: store
      type(stored_field_t), allocatable, private :: stored(:)
      type(hdf5_series_t), private :: times          !! (n_frame)
      type(hdf5_series_t), private :: counter(5)     !! (n_frame), as `counter_name`
      real(dp), private :: time = 0.0_dp             !! of the frame at hand
      real(dp), allocatable, private :: vector(:, :) !! (3, n_item) workspace
   end type vtkhdf_t

   !> Data sets under `Steps` that say the same for each frame of a fixed mesh of one part.
   character(len=*), parameter :: counter_name(5) = [character(len=21) :: "PartOffsets", &
      "PointOffsets", "NumberOfParts", "CellOffsets", "ConnectivityIdOffsets"]
   real(dp), parameter :: counter_value(5) = [0.0_dp, 0.0_dp, 1.0_dp, 0.0_dp, 0.0_dp]
   integer, parameter :: counter_rank(5) = [0, 0, 0, 1, 1]
   integer, parameter :: one(1) = [1]
   character(len=*), parameter :: steps = "/VTKHDF/Steps"
   integer, parameter :: step_chunk = 64             !! frames stored together under `Steps`

contains

   !> Begin the file `path` with the mesh; frames follow.
   subroutine vtkhdf_create(self, path, points, cell_node, vtk_type, fields, error)
      type(vtkhdf_t), intent(out) :: self
      character(len=*), intent(in) :: path
      real(dp), intent(in) :: points(:, :)           !! (n_dim, n_node) reference positions [L]
      integer, intent(in) :: cell_node(:, :)         !! (most, n_cell), behind the last one 0
      integer, intent(in) :: vtk_type(:)             !! (n_cell) number of the file format
      type(field_t), intent(in) :: fields(:)
      type(error_t), allocatable, intent(out) :: error

      call published_create(self%store, path, error)
      if (.not. allocated(error)) call make_groups(self%store%file, error)
      if (.not. allocated(error)) call write_points(self%store%file, points, error)
      if (.not. allocated(error)) then
         call write_cells(self%store%file, cell_node, vtk_type, error)
      end if
      if (.not. allocated(error)) then
         call begin_series(self, fields, size(points, 2), size(vtk_type), error)
      end if
      if (allocated(error)) call published_abandon(self%store)
   end subroutine vtkhdf_create

   !> Go on with the published file `path` after its first `n_frame` frames; later ones are dropped.
   subroutine vtkhdf_resume(self, path, run, fields, n_frame, error)
      type(vtkhdf_t), intent(out) :: self
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: run            !! that the file is of
      type(field_t), intent(in) :: fields(:)         !! as the file was created with
      integer, intent(in) :: n_frame
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: n_point(:), n_cell(:)

      call published_resume(self%store, path, run, error)
      if (.not. allocated(error)) then
         call hdf5_read_integers(self%store%file, "/VTKHDF/NumberOfPoints", n_point, error)
      end if
      if (.not. allocated(error)) then
         call hdf5_read_integers(self%store%file, "/VTKHDF/NumberOfCells", n_cell, error)
      end if
      if (.not. allocated(error)) call begin_series(self, fields, n_point(1), n_cell(1), error)
      if (.not. allocated(error)) call drop_frames(self, n_frame, error)
      if (allocated(error)) call published_abandon(self%store)
   end subroutine vtkhdf_resume

   !> Name the run that the file is of.
   pure subroutine vtkhdf_put_run(self, run)
      type(vtkhdf_t), intent(inout) :: self
      character(len=*), intent(in) :: run

      self%store%run = run
   end subroutine vtkhdf_put_run

   !> Keep the first `n_frame` frames.
   subroutine drop_frames(self, n_frame, error)
      type(vtkhdf_t), intent(inout) :: self
      integer, intent(in) :: n_frame
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      call series_truncate(self%times, self%store%file, int(n_frame, int64), error)
      do i = 1, size(self%counter)
         if (allocated(error)) return
         call series_truncate(self%counter(i), self%store%file, int(n_frame, int64), error)
      end do
      do i = 1, size(self%stored)
         if (allocated(error)) return
         call drop_values(self%stored(i), self%store%file, n_frame, error)
      end do
      if (allocated(error)) return
      call hdf5_write_attribute(self%store%file, steps, "NSteps", n_frame, error)
      self%n_frame = n_frame
   end subroutine drop_frames

   subroutine drop_values(self, file, n_frame, error)
      type(stored_field_t), intent(inout) :: self
      type(hdf5_file_t), intent(inout) :: file
      integer, intent(in) :: n_frame
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: path
      real(dp), allocatable :: offset(:)

      call series_truncate(self%offset, file, int(n_frame, int64), error)
      if (.not. allocated(error)) then
         call offset_path(self%field, path)
         call hdf5_read_reals(file, path, offset, error)
      end if
      if (allocated(error)) return
      self%n_written = 0
      if (n_frame > 0) self%n_written = nint(offset(n_frame)/self%n_item) + 1
      call series_truncate(self%values, file, int(self%n_written, int64)*self%n_item, error)
   end subroutine drop_values

   subroutine make_groups(file, error)
      type(hdf5_file_t), intent(inout) :: file
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: group(6) = [character(len=30) :: "/VTKHDF", &
         "/VTKHDF/PointData", "/VTKHDF/CellData", "/VTKHDF/Steps", &
         "/VTKHDF/Steps/PointDataOffsets", "/VTKHDF/Steps/CellDataOffsets"]
      integer :: i

      do i = 1, size(group)
         call hdf5_make_group(file, trim(group(i)), error)
         if (allocated(error)) return
      end do
      call hdf5_write_attribute(file, "/VTKHDF", "Version", [integer :: 2, 0], error)
      if (.not. allocated(error)) then
         call hdf5_write_attribute(file, "/VTKHDF", "Type", "UnstructuredGrid", error)
      end if
      if (.not. allocated(error)) call hdf5_write_attribute(file, steps, "NSteps", 0, error)
   end subroutine make_groups

   subroutine write_points(file, points, error)
      type(hdf5_file_t), intent(inout) :: file
      real(dp), intent(in) :: points(:, :)
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: space_point(:, :)

      allocate(space_point(3, size(points, 2)), source=0.0_dp)
      space_point(:size(points, 1), :) = points
      call hdf5_write_reals(file, "/VTKHDF/Points", space_point, error)
      if (.not. allocated(error)) then
         call hdf5_write_integers(file, "/VTKHDF/NumberOfPoints", [size(points, 2)], error)
      end if
   end subroutine write_points

   subroutine write_cells(file, cell_node, vtk_type, error)
      type(hdf5_file_t), intent(inout) :: file
      integer, intent(in) :: cell_node(:, :), vtk_type(:)
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: connectivity(:), offset(:)
      integer :: i, n

      allocate(connectivity(size(cell_node)), offset(size(vtk_type) + 1), source=0)
      do i = 1, size(vtk_type)
         n = count(cell_node(:, i) > 0)
         offset(i + 1) = offset(i) + n
         connectivity(offset(i) + 1:offset(i + 1)) = cell_node(:n, i) - 1
      end do
      n = offset(size(offset))
      call hdf5_write_integers(file, "/VTKHDF/Connectivity", connectivity(:n), error)
      if (allocated(error)) return
      call hdf5_write_integers(file, "/VTKHDF/Offsets", offset, error)
      if (allocated(error)) return
      call hdf5_write_bytes(file, "/VTKHDF/Types", vtk_type, error)
      if (allocated(error)) return
      call hdf5_write_integers(file, "/VTKHDF/NumberOfCells", [size(vtk_type)], error)
      if (allocated(error)) return
      call hdf5_write_integers(file, "/VTKHDF/NumberOfConnectivityIds", [n], error)
   end subroutine write_cells

   !> Begin with all data sets that grow frame by frame.
   subroutine begin_series(self, fields, n_point, n_cell, error)
      type(vtkhdf_t), intent(inout) :: self
      type(field_t), intent(in) :: fields(:)
      integer, intent(in) :: n_point, n_cell
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      allocate(self%stored(size(fields)), self%vector(3, max(n_point, n_cell)))
      self%vector = 0.0_dp
      call series_begin(self%times, self%store%file, steps // "/Values", one(:0), &
         series_form_t(step_chunk), error)
      do i = 1, size(self%counter)
         if (allocated(error)) return
         call series_begin(self%counter(i), self%store%file, steps // "/" &
            // trim(counter_name(i)), one(:counter_rank(i)), &
            series_form_t(step_chunk, is_integer=.true.), error)
      end do
      do i = 1, size(fields)
         if (allocated(error)) return
         call begin_field(self%stored(i), self%store%file, fields(i), &
            merge(n_cell, n_point, fields(i)%is_cell), error)
      end do
   end subroutine begin_series

   subroutine begin_field(self, file, field, n_item, error)
      type(stored_field_t), intent(inout) :: self
      type(hdf5_file_t), intent(inout) :: file
      type(field_t), intent(in) :: field
      integer, intent(in) :: n_item                  !! points or cells
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: path
      integer :: row_shape(1)

      if (scan(field%name, "/.") > 0 .or. field%name == "") then
         call raise(error, err_internal, "vtkhdf: not a name for a field: " // trim(field%name))
         return
      end if
      self%field = field
      self%n_item = n_item
      row_shape = stored_components(field)
      call values_path(field, path)
      call series_begin(self%values, file, path, &
         row_shape(:merge(0, 1, field%n_component == 1)), &
         series_form_t(series_chunk(row_shape(1), n_item), is_packed=field%is_sparse), error)
      if (allocated(error)) return
      call offset_path(field, path)
      call series_begin(self%offset, file, path, one(:0), &
         series_form_t(step_chunk, is_integer=.true.), error)
   end subroutine begin_field

   pure integer function stored_components(field)
      type(field_t), intent(in) :: field

      stored_components = merge(3, field%n_component, field%n_component == 2)
   end function stored_components

   pure subroutine values_path(field, path)
      type(field_t), intent(in) :: field
      character(len=:), allocatable, intent(out) :: path

      path = "/VTKHDF/" // trim(merge("CellData ", "PointData", field%is_cell)) // "/" &
         // trim(field%name)
   end subroutine values_path

   pure subroutine offset_path(field, path)
      type(field_t), intent(in) :: field
      character(len=:), allocatable, intent(out) :: path

      path = steps // "/" // trim(merge("CellDataOffsets ", "PointDataOffsets", field%is_cell)) &
         // "/" // trim(field%name)
   end subroutine offset_path

   !> Begin the frame of `time`.
   subroutine vtkhdf_begin_frame(self, time)
      type(vtkhdf_t), intent(inout) :: self
      real(dp), intent(in) :: time                   !! [T]

      self%time = time
      self%stored%is_written = .false.
   end subroutine vtkhdf_begin_frame

   !> The values of the field `name` in the frame at hand. A field that is not written in a frame
   !> keeps the values it had.
   subroutine vtkhdf_write(self, name, values, error, is_cell)
      type(vtkhdf_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(dp), intent(in), contiguous :: values(:, :)   !! (n_component, n_item)
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in), optional :: is_cell       !! which one, where both have the name
      integer :: i, n

      do i = 1, size(self%stored)
         if (self%stored(i)%field%name /= name) cycle
         if (.not. present(is_cell)) exit
         if (self%stored(i)%field%is_cell .eqv. is_cell) exit
      end do
      if (i > size(self%stored)) then
         call raise(error, err_internal, "vtkhdf_write: no field was declared as " // name)
         return
      end if
      associate (stored => self%stored(i))
         n = stored%n_item
         if (any(shape(values) /= [stored%field%n_component, n]) .or. stored%is_written) then
            call raise(error, err_internal, "vtkhdf_write: wrong shape, or twice in a frame: " &
               // name)
            return
         end if
         if (stored%field%n_component == 2) then
            self%vector(:size(values, 1), :n) = values
            call series_append(stored%values, self%store%file, self%vector, n, error)
         else
            call series_append(stored%values, self%store%file, values, n, error)
         end if
         if (allocated(error)) return
         stored%is_written = .true.
         stored%n_written = stored%n_written + 1
      end associate
   end subroutine vtkhdf_write

   !> Complete the frame at hand.
   subroutine vtkhdf_end_frame(self, error)
      type(vtkhdf_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      do i = 1, size(self%stored)
         associate (stored => self%stored(i))
            if (stored%n_written == 0) then
               call raise(error, err_internal, "vtkhdf_end_frame: the first frame lacks " &
                  // trim(stored%field%name))
               return
            end if
            call series_append(stored%offset, self%store%file, &
               [real(stored%n_written - 1, dp)*stored%n_item], 1, error)
         end associate
         if (allocated(error)) return
      end do
      do i = 1, size(self%counter)
         call series_append(self%counter(i), self%store%file, counter_value(i:i), 1, error)
         if (allocated(error)) return
      end do
      call series_append(self%times, self%store%file, [self%time], 1, error)
      if (allocated(error)) return
      self%n_frame = self%n_frame + 1
      self%store%is_changed = .true.
   end subroutine vtkhdf_end_frame

   !> Move what was gathered of all frames to the file.
   subroutine write_waiting(self, error)
      type(vtkhdf_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      do i = 1, size(self%stored)
         call series_flush(self%stored(i)%values, self%store%file, error)
         if (allocated(error)) return
         call series_flush(self%stored(i)%offset, self%store%file, error)
         if (allocated(error)) return
      end do
      do i = 1, size(self%counter)
         call series_flush(self%counter(i), self%store%file, error)
         if (allocated(error)) return
      end do
      call series_flush(self%times, self%store%file, error)
      if (allocated(error)) return
      ! Readers go by this number: it counts a frame when all of it is there.
      call hdf5_write_attribute(self%store%file, steps, "NSteps", self%n_frame, error)
   end subroutine write_waiting

   !> Make the frames so far visible to readers, if it is time or `is_forced`; call it often.
   subroutine vtkhdf_publish(self, is_forced, error)
      type(vtkhdf_t), intent(inout) :: self
      logical, intent(in) :: is_forced
      type(error_t), allocatable, intent(out) :: error

      if (.not. publication_is_due(self%store, is_forced)) return
      call write_waiting(self, error)
      if (.not. allocated(error)) call published_publish(self%store, error)
   end subroutine vtkhdf_publish

   !> Complete the file; harmless if it is not open.
   subroutine vtkhdf_close(self, error)
      type(vtkhdf_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      if (self%store%file%id >= 0 .and. .not. self%store%file%has_failed) then
         call write_waiting(self, error)
      end if
      if (allocated(error)) then
         call published_abandon(self%store)
      else
         call published_close(self%store, error)
      end if
   end subroutine vtkhdf_close

end module emcon_vtkhdf
