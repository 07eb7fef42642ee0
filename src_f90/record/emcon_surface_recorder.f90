!> The field file NAME.surfaces.vtkhdf of runs with contact in space: the faces of contact surfaces
!> as cells, with what contact does to them, behind these the walls, in the frames of NAME.vtkhdf.
!>
!> A file of its own: as more cells of the mesh, faces would lie on those of elements and be drawn
!> through each other.
module emcon_surface_recorder
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use emcon_contact_faces, only : contact_faces_cells, contact_faces_find, contact_faces_t, &
      contact_faces_values, face_values_t
   use emcon_errors, only : error_t
   use emcon_files, only : file_exists, file_remove
   use emcon_kinds, only : dp
   use emcon_quantities, only : node_quantity
   use emcon_quantity_registry, only : at_contacts, quantity_row_of, quantity_row_t
   use emcon_stepper, only : stepper_t
   use emcon_text, only : string_t
   use emcon_vtkhdf, only : field_t, vtkhdf_begin_frame, vtkhdf_close, vtkhdf_create, &
      vtkhdf_end_frame, vtkhdf_publish, vtkhdf_put_run, vtkhdf_resume, vtkhdf_t, vtkhdf_write
   use emcon_wall_faces, only : wall_faces_find, wall_faces_move, wall_faces_t
   implicit none
   private
   public :: surface_recorder_t, surface_recorder_open, surface_recorder_resume, &
      surface_recorder_write, surface_recorder_publish, surface_recorder_close, surfaces_suffix

   character(len=*), parameter :: surfaces_suffix = ".surfaces.vtkhdf"
   !> Of a VTK file.
   integer, parameter :: quadrilateral = 9

   type :: surface_recorder_t
      logical :: is_on = .false.                 !! there is such a file
      type(vtkhdf_t) :: fields
      type(contact_faces_t) :: faces
      type(wall_faces_t) :: walls                !! behind the faces
   end type surface_recorder_t

contains

   !> Begin the file, where the run has one. What an earlier run left goes.
   subroutine surface_recorder_open(self, stepper, variable, base, run, error)
      type(surface_recorder_t), intent(out) :: self
      type(stepper_t), intent(in) :: stepper
      type(string_t), intent(in) :: variable(:)  !! of the field file
      character(len=*), intent(in) :: base       !! of the names of files
      character(len=*), intent(in) :: run        !! that the file is of
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: cell_node(:, :), vtk_type(:)
      real(dp), allocatable :: x(:, :)

      call choose(self, stepper, variable)
      if (.not. self%is_on) then
         if (file_exists(base // surfaces_suffix)) call file_remove(base // surfaces_suffix, error)
         return
      end if
      call find_cells(self, cell_node, vtk_type)
      allocate(x, source=at_points(self, stepper, real(stepper%scene%x, dp)))
      call vtkhdf_create(self%fields, base // surfaces_suffix, x, cell_node, vtk_type, &
         fields_of(), error)
      if (.not. allocated(error)) call vtkhdf_put_run(self%fields, run)
   end subroutine surface_recorder_open

   !> Go on with the file after `n_frame` frames.
   subroutine surface_recorder_resume(self, stepper, variable, base, run, n_frame, error)
      type(surface_recorder_t), intent(out) :: self
      type(stepper_t), intent(in) :: stepper
      type(string_t), intent(in) :: variable(:)  !! of the field file
      character(len=*), intent(in) :: base       !! of the names of files
      character(len=*), intent(in) :: run        !! that the file is of
      integer, intent(in) :: n_frame             !! that stay
      type(error_t), allocatable, intent(out) :: error

      call choose(self, stepper, variable)
      if (self%is_on) call vtkhdf_resume(self%fields, base // surfaces_suffix, run, fields_of(), &
         n_frame, error)
   end subroutine surface_recorder_resume

   !> Is something of contact in space written, and on which faces? Walls always are.
   subroutine choose(self, stepper, variable)
      type(surface_recorder_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      type(string_t), intent(in) :: variable(:)
      type(quantity_row_t) :: row
      integer :: k

      if (stepper%scene%n_dim < 3 .or. size(stepper%scene%pair) == 0) return
      do k = 1, size(variable)
         row = quantity_row_of(variable(k)%text, at_contacts)
         self%is_on = self%is_on .or. row%place == at_contacts
      end do
      call wall_faces_find(self%walls, stepper%scene)
      self%is_on = self%is_on .or. self%walls%n_point > 0
      if (self%is_on) call contact_faces_find(self%faces, stepper%scene)
      if (self%is_on) self%is_on = size(self%faces%surface) + self%walls%n_point > 0
   end subroutine choose

   !> Faces of elements, then those of walls.
   pure subroutine find_cells(self, node, vtk_type)
      type(surface_recorder_t), intent(in) :: self
      integer, allocatable, intent(out) :: node(:, :)    !! (most, n_cell), behind the last one 0
      integer, allocatable, intent(out) :: vtk_type(:)   !! (n_cell)
      integer, allocatable :: of_faces(:, :)

      call contact_faces_cells(self%faces, of_faces, vtk_type)
      associate (n => size(of_faces, 2), walls => self%walls%cell)
         allocate(node(max(size(of_faces, 1), size(walls, 1)), n + size(walls, 2)), source=0)
         node(:size(of_faces, 1), :n) = of_faces
         node(:size(walls, 1), n + 1:) = size(self%faces%node) + walls
         vtk_type = [vtk_type, spread(quadrilateral, 1, size(walls, 2))]
      end associate
   end subroutine find_cells

   !> A field of nodes at the points of the file.
   pure function at_points(self, stepper, at_node) result(values)
      type(surface_recorder_t), intent(in) :: self
      type(stepper_t), intent(in) :: stepper
      real(dp), intent(in) :: at_node(:, :)      !! (n_dim, n_node)
      real(dp) :: values(size(at_node, 1), size(self%faces%node) + self%walls%n_point)

      values(:, :size(self%faces%node)) = at_node(:, self%faces%node)
      values(:, size(self%faces%node) + 1:) = wall_faces_move(self%walls, stepper%scene, at_node)
   end function at_points

   !> Of nodes, of faces.
   pure function fields_of() result(fields)
      type(field_t) :: fields(12)

      fields%name = [character(len=len(fields%name)) :: "displacement", "contact_pressure", &
         "contact_gap", "node", "surface", "body", "contact_pressure", "contact_gap", &
         "contact_status", "contact_force", "contact_shear", "contact_slip"]
      fields(5:)%is_cell = .true.
      fields(2:)%is_sparse = .true.
      fields([1, 10, 11, 12])%n_component = 3
   end function fields_of

   !> Append a frame of the present state.
   subroutine surface_recorder_write(self, stepper, error)
      type(surface_recorder_t), intent(inout) :: self
      type(stepper_t), intent(inout) :: stepper
      type(error_t), allocatable, intent(out) :: error
      type(face_values_t) :: values

      if (.not. self%is_on) return
      call contact_faces_values(self%faces, stepper, values)
      call vtkhdf_begin_frame(self%fields, real(stepper%march%state%clock%time, dp))
      if (self%fields%n_frame == 0) call write_once(self, stepper, error)
      if (.not. allocated(error)) call write_points(self, stepper, values, error)
      if (.not. allocated(error)) call write_faces(self, values, error)
      if (.not. allocated(error)) call vtkhdf_end_frame(self%fields, error)
   end subroutine surface_recorder_write

   !> What stays as it is, and is not written again: of points the node of the field file, from 0
   !> on, -1 of walls; of faces surface and body, from 1 on.
   subroutine write_once(self, stepper, error)
      type(surface_recorder_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      call vtkhdf_write(self%fields, "node", row([self%faces%node - 1, &
         spread(-1, 1, self%walls%n_point)]), error)
      if (allocated(error)) return
      associate (walls => self%walls%surface, body => stepper%march%system%space%body)
         call vtkhdf_write(self%fields, "surface", row([self%faces%surface, &
            walls(self%walls%wall_of)]), error)
         if (allocated(error)) return
         associate (of_wall => [(body(stepper%scene%surface(walls(k))%wall%node(1)), &
            k = 1, size(walls))])
            call vtkhdf_write(self%fields, "body", row([ &
               body(self%faces%node(self%faces%vertex(1, :))), of_wall(self%walls%wall_of)]), error)
         end associate
      end associate

   contains

      pure function row(number) result(values)
         integer, intent(in) :: number(:)
         real(dp) :: values(1, size(number))

         values(1, :) = real(number, dp)
      end function row

   end subroutine write_once

   subroutine write_points(self, stepper, values, error)
      type(surface_recorder_t), intent(inout) :: self
      type(stepper_t), intent(inout) :: stepper
      type(face_values_t), intent(in) :: values
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: u(:, :)

      allocate(u, source=node_quantity(stepper, "U"))
      call vtkhdf_write(self%fields, "displacement", at_points(self, stepper, u), error)
      if (allocated(error)) return
      associate (n => self%walls%n_point)
         call vtkhdf_write(self%fields, "contact_pressure", with_none(values%at_node, n), error, &
            .false.)
         if (allocated(error)) return
         call vtkhdf_write(self%fields, "contact_gap", with_none(values%gap_there, n), error, &
            .false.)
      end associate
   end subroutine write_points

   subroutine write_faces(self, values, error)
      type(surface_recorder_t), intent(inout) :: self
      type(face_values_t), intent(in) :: values
      type(error_t), allocatable, intent(out) :: error

      associate (n => size(self%walls%cell, 2))
         call vtkhdf_write(self%fields, "contact_pressure", with_none(values%pressure, n), error, &
            .true.)
         if (allocated(error)) return
         call vtkhdf_write(self%fields, "contact_gap", with_none(values%gap, n), error, .true.)
         if (allocated(error)) return
         call vtkhdf_write(self%fields, "contact_status", with_none(values%status, n), error)
         if (allocated(error)) return
         call vtkhdf_write(self%fields, "contact_force", with_none(values%force, n), error)
         if (allocated(error)) return
         call vtkhdf_write(self%fields, "contact_shear", with_none(values%shear, n), error)
         if (allocated(error)) return
         call vtkhdf_write(self%fields, "contact_slip", with_none(values%slip, n), error)
      end associate
   end subroutine write_faces

   !> Values, and NaN for `n` that have none behind them.
   pure function with_none(values, n)
      real(dp), intent(in) :: values(:, :)
      integer, intent(in) :: n
      real(dp) :: with_none(size(values, 1), size(values, 2) + n)

      with_none(:, :size(values, 2)) = values
      with_none(:, size(values, 2) + 1:) = ieee_value(1.0_dp, ieee_quiet_nan)
   end function with_none

   !> As `recorder_publish`.
   subroutine surface_recorder_publish(self, is_forced, error)
      type(surface_recorder_t), intent(inout) :: self
      logical, intent(in) :: is_forced           !! now, whenever it was last
      type(error_t), allocatable, intent(out) :: error

      if (self%is_on) call vtkhdf_publish(self%fields, is_forced, error)
   end subroutine surface_recorder_publish

   !> Complete and close the file; harmless where there is none.
   subroutine surface_recorder_close(self, error)
      type(surface_recorder_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      if (self%is_on) call vtkhdf_close(self%fields, error)
   end subroutine surface_recorder_close

end module emcon_surface_recorder
