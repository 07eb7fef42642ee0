!> What of a run goes into its files: fields, history and requested sets, at which increments.
!>
!> Turns states of the stepper into the plain arrays that results/ writes.
module emcon_recorder
   use emcon_errors, only : error_t
   use emcon_history, only : column_t, history_append, history_close, history_create, &
      history_publish, history_put_run, history_resume, history_set_append, history_set_define, &
      history_set_once, history_t
   use emcon_kinds, only : dp, wp
   use emcon_ledger, only : body_masses, ledger_momenta
   use emcon_march, only : increment_t
   use emcon_memory, only : memory_in_use
   use emcon_print_series, only : is_due, print_series_define, print_series_write, series_t
   use emcon_pair_columns, only : pair_columns, pair_values
   use emcon_quantities, only : quantity_fields, quantity_of_field
   use emcon_requests, only : output_contact_file
   use emcon_rotation, only : n_turn
   use emcon_run_mark, only : run_mark
   use emcon_scene, only : scene_t
   use emcon_stepper, only : stepper_t
   use emcon_surface_facets, only : profile_facets
   use emcon_surface_recorder, only : surface_recorder_close, surface_recorder_open, &
      surface_recorder_publish, surface_recorder_resume, surface_recorder_t, &
      surface_recorder_write
   use emcon_text, only : string_t
   use emcon_version, only : version
   use emcon_vtkhdf, only : field_t, vtkhdf_begin_frame, vtkhdf_close, vtkhdf_create, &
      vtkhdf_end_frame, vtkhdf_publish, vtkhdf_put_run, vtkhdf_resume, vtkhdf_t, vtkhdf_write
   implicit none
   private
   public :: recorder_t, recorder_open, recorder_resume, recorder_write, recorder_publish, &
      recorder_close, recorder_finish

   !> Frames of a deck that asks for no field output.
   integer, parameter :: default_frames = 100

   !> Columns of all runs, but momenta: these stand between.
   type(column_t), parameter :: energies(15) = [column_t("increment", .true.), column_t("time"), &
      column_t("h"), column_t("kinetic"), column_t("strain"), column_t("external_work"), &
      column_t("contact_work"), column_t("stabilization"), &
      column_t("restitution_loss"), column_t("scheme_loss"), column_t("damping_loss"), &
      column_t("friction_loss"), column_t("contact_damping_loss"), column_t("contact_energy"), &
      column_t("total")]
   type(column_t), parameter :: efforts(6) = [column_t("active", .true.), &
      column_t("newton", .true.), column_t("cuts", .true.), column_t("penetration"), &
      column_t("stand_off"), column_t("cpu")]
   character(len=*), parameter :: axes = "xyz"

   !> What is written if no step asks for fields: of solids, and behind them of contact.
   character(len=*), parameter :: default_fields(8) = [character(len=4) :: "U", "V", "RF", "S", &
      "ENER", "CDIS", "CSTR", "CF"]
   integer, parameter :: n_solid_fields = 5

   !> The body that an element is part of, in the order of /sets/BODIES from 1 on; 0: of none.
   type(field_t), parameter :: body_field = field_t("body", is_cell=.true., is_sparse=.true.)

   !> The cell of VTK files that a facet of a profile is, by dimension: a line, a triangle.
   integer, parameter :: cell_of_facet(2:3) = [3, 5]

   type :: recorder_t
      real(dp) :: memory = 0.0_dp                !! that opening the files took [byte]
      type(vtkhdf_t) :: fields
      type(surface_recorder_t) :: surfaces       !! fields on faces of contact in space
      type(history_t) :: history
      type(string_t), allocatable :: variable(:) !! those that are written
      type(field_t), allocatable :: field(:)     !! of all of them
      type(series_t), allocatable :: series(:)   !! of PRINT requests
      integer :: momentum_set = 0
      integer :: n_row = 0
      real(wp) :: last_time = -huge(1.0_wp)      !! of the last record
   end type recorder_t

contains

   !> Begin the files `base`.vtkhdf, .h5 and .csv, and `base`.surfaces.vtkhdf of contact in space.
   subroutine recorder_open(self, stepper, base, error)
      type(recorder_t), intent(out) :: self
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: base
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: run
      type(column_t), allocatable :: column(:)
      integer, allocatable :: cell_node(:, :), vtk_type(:)
      real(dp), allocatable :: mass(:)
      integer :: k

      self%memory = memory_in_use()
      call run_mark(stepper%source%line, stepper%override, stepper%is_lenient, run, &
         stepper%until)
      call choose_fields(self, stepper%scene)
      call find_cells(stepper%scene, cell_node, vtk_type)
      call vtkhdf_create(self%fields, base // ".vtkhdf", real(stepper%scene%x, dp), cell_node, &
         vtk_type, self%field, error)
      if (allocated(error)) return
      call vtkhdf_put_run(self%fields, run)
      call surface_recorder_open(self%surfaces, stepper, self%variable, base, run, error)
      if (allocated(error)) return
      call list_columns(stepper, column)
      call history_create(self%history, base, column, error)
      if (allocated(error)) return
      call history_put_run(self%history, run, stepper%source%line, version, error)
      if (allocated(error)) return
      call define_sets(self, stepper, error)
      call body_masses(stepper%march%system, mass)
      call history_set_once(self%history, "BODIES", "MASS", [(k, k = 1, size(mass))], mass, error)
      self%memory = memory_in_use() - self%memory
   end subroutine recorder_open

   !> The columns of all runs, and those of each pair of surfaces.
   subroutine list_columns(stepper, column)
      type(stepper_t), intent(in) :: stepper
      type(column_t), allocatable, intent(out) :: column(:)
      type(column_t), allocatable :: of_pairs(:)
      integer :: a

      call pair_columns(stepper, of_pairs)
      associate (n_dim => stepper%scene%n_dim)
         allocate(column, source=[energies, [(column_t("p" // axes(a:a)), a = 1, n_dim)], &
            [(column_t("l" // axes(a:a)), a = len(axes) + 1 - n_turn(n_dim), len(axes))], &
            efforts, of_pairs])
      end associate
   end subroutine list_columns

   !> The elements as cells of the field file, and behind them the facets of profiles.
   pure subroutine find_cells(scene, node, vtk_type)
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: node(:, :)    !! (most, n_cell), behind the last one 0
      integer, allocatable, intent(out) :: vtk_type(:)   !! (n_cell)
      integer, allocatable :: line(:, :)
      integer :: e, n_element

      call profile_facets(scene, line)
      n_element = size(scene%element%node, 2)
      allocate(node(max(size(line, 1), size(scene%element%node, 1)), n_element + size(line, 2)), &
         source=0)
      allocate(vtk_type(size(node, 2)), source=cell_of_facet(scene%n_dim))
      do e = 1, n_element
         associate (kind => scene%element%kinds(scene%element%kind(e)))
            node(:kind%n_vtk, e) = scene%element%node(:kind%n_vtk, e)
            vtk_type(e) = kind%vtk_type
         end associate
      end do
      node(:size(line, 1), n_element + 1:) = line
   end subroutine find_cells

   !> Go on with the files of `base` after `n_row` rows and `n_frame` frames.
   subroutine recorder_resume(self, stepper, base, n_row, n_frame, error)
      type(recorder_t), intent(out) :: self
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: base
      integer, intent(in) :: n_row, n_frame
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: run
      type(column_t), allocatable :: column(:)

      call run_mark(stepper%source%line, stepper%override, stepper%is_lenient, run, &
         stepper%until)
      call choose_fields(self, stepper%scene)
      call vtkhdf_resume(self%fields, base // ".vtkhdf", run, self%field, n_frame, error)
      if (allocated(error)) return
      call surface_recorder_resume(self%surfaces, stepper, self%variable, base, run, n_frame, error)
      if (allocated(error)) return
      call list_columns(stepper, column)
      call history_resume(self%history, base, run, column, n_row, error)
      if (allocated(error)) return
      self%n_row = n_row
      self%last_time = stepper%march%state%clock%time
      call define_sets(self, stepper, error)
   end subroutine recorder_resume

   !> The fields that some step asks for; all of them if none asks for any.
   subroutine choose_fields(self, scene)
      type(recorder_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer :: i, j, k

      allocate(self%variable(0), self%field(0))
      do i = 1, size(scene%step)
         do j = 1, size(scene%step(i)%output)
            associate (output => scene%step(i)%output(j))
               if (output%kind > output_contact_file) cycle
               do k = 1, size(output%variable)
                  call add(output%variable(k)%text)
               end do
            end associate
         end do
      end do
      if (size(self%variable) == 0) then
         do i = 1, merge(size(default_fields), n_solid_fields, size(scene%pair) > 0)
            call add(trim(default_fields(i)))
         end do
      end if
      self%field = [self%field, body_field]

   contains

      subroutine add(name)
         character(len=*), intent(in) :: name
         type(string_t) :: new
         type(field_t), allocatable :: fields(:)

         new%text = name
         allocate(fields, source=quantity_fields(name, scene%n_dim))
         if (any(self%field%name == fields(1)%name)) return
         self%variable = [self%variable, new]
         self%field = [self%field, fields]
      end subroutine add

   end subroutine choose_fields

   !> Declare what PRINT requests name, and the bodies.
   subroutine define_sets(self, stepper, error)
      type(recorder_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      call print_series_define(self%series, self%history, stepper, error)
      if (.not. allocated(error)) call history_set_define(self%history, "BODIES", "MOMENTUM", &
         [(k, k = 1, stepper%march%system%space%n_body)], n_momentum(stepper%scene), &
         self%momentum_set, error)
   end subroutine define_sets

   !> Momenta of a body: along each axis, and of each rotation.
   pure integer function n_momentum(scene)
      type(scene_t), intent(in) :: scene

      n_momentum = scene%n_dim + n_turn(scene%n_dim)
   end function n_momentum

   !> Record the present state after `increment`.
   subroutine recorder_write(self, stepper, increment, cpu, error)
      type(recorder_t), intent(inout) :: self
      type(stepper_t), intent(inout) :: stepper
      type(increment_t), intent(in) :: increment
      real(dp), intent(in) :: cpu                !! seconds of CPU time so far
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: momenta(n_momentum(stepper%scene), stepper%march%system%space%n_body)

      associate (state => stepper%march%state, ledger => stepper%march%ledger)
         call history_append(self%history, [real(dp) :: real(state%clock%increment, dp), &
            real(state%clock%time, dp), real(increment%h, dp), real(ledger%kinetic, dp), &
            real(ledger%strain, dp), real(ledger%external_work, dp), &
            real(ledger%contact_work, dp), real(ledger%stabilization, dp), &
            real(ledger%restitution, dp), real(ledger%decay, dp), real(ledger%damping, dp), &
            real(ledger%friction, dp), real(ledger%contact_damping, dp), &
            real(ledger%contact_energy, dp), real(ledger%total, dp), &
            real(ledger%momentum, dp), &
            real(ledger%angular, dp), &
            real(increment%n_active, dp), real(increment%n_newton, dp), &
            real(increment%n_cut, dp), &
            real(max(increment%overlap%depth, increment%stray%depth), dp), &
            real(increment%stand_off%largest, dp), cpu, pair_values(stepper)], error)
         if (allocated(error)) return
         self%n_row = self%n_row + 1
         call ledger_momenta(ledger, stepper%march%system, stepper%scene%x, state, momenta)
         call history_set_append(self%history, self%momentum_set, real(state%clock%time, dp), &
            real(momenta, dp), error)
      end associate
      if (allocated(error)) return
      call print_series_write(self%series, self%history, stepper, self%last_time, error)
      if (allocated(error)) return
      call write_fields(self, stepper, error)
      self%last_time = stepper%march%state%clock%time
   end subroutine recorder_write

   !> Append a frame if a FILE request is due.
   subroutine write_fields(self, stepper, error)
      type(recorder_t), intent(inout) :: self
      type(stepper_t), intent(inout) :: stepper
      type(error_t), allocatable, intent(out) :: error
      logical :: due, has_request
      integer :: i

      due = self%fields%n_frame == 0
      has_request = .false.
      associate (step => stepper%scene%step(stepper%march%state%clock%i_step))
         do i = 1, size(step%output)
            if (step%output(i)%kind > output_contact_file) cycle
            has_request = .true.
            due = due .or. is_due(stepper, step%output(i), self%last_time)
         end do
      end associate
      if (.not. has_request) then
         due = due .or. default_frame(stepper, stepper%march%state%clock%time) &
            > default_frame(stepper, self%last_time)
      end if
      if (.not. due) return
      call vtkhdf_begin_frame(self%fields, real(stepper%march%state%clock%time, dp))
      if (self%fields%n_frame == 0) then
         ! Bodies stay what they are, and so does a field that is not written again.
         call vtkhdf_write(self%fields, trim(body_field%name), cell_bodies(stepper), error)
         if (allocated(error)) return
      end if
      do i = 1, size(self%variable)
         call write_variable(self, stepper, self%variable(i)%text, error)
         if (allocated(error)) return
      end do
      call vtkhdf_end_frame(self%fields, error)
      if (.not. allocated(error)) call surface_recorder_write(self%surfaces, stepper, error)
   end subroutine write_fields

   !> The body of each element and of each line of a profile, as `body_field`.
   pure function cell_bodies(stepper) result(body)
      type(stepper_t), intent(in) :: stepper
      real(dp), allocatable :: body(:, :)        !! (1, n_cell)
      integer, allocatable :: line(:, :)

      call profile_facets(stepper%scene, line)
      associate (first => [stepper%scene%element%node(1, :), line(1, :)])
         allocate(body(1, size(first)))
         body(1, :) = real(stepper%march%system%space%body(first), dp)
      end associate
   end function cell_bodies

   !> Number of the frame that `time` falls into, of those that every step gets by default.
   pure integer function default_frame(stepper, time)
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: time
      real(wp) :: part

      associate (state => stepper%march%state)
         default_frame = 0
         if (time <= state%clock%start_time) return
         part = (time - state%clock%start_time)/stepper%scene%step(state%clock%i_step)%time%duration
         default_frame = floor(real(default_frames, wp)*part + sqrt(epsilon(1.0_wp)))
      end associate
   end function default_frame

   !> The fields that belong to one variable, e.g. stress and von Mises stress to S; what elements
   !> have is 0 on lines of profiles.
   subroutine write_variable(self, stepper, variable, error)
      type(recorder_t), intent(inout) :: self
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: variable
      type(error_t), allocatable, intent(out) :: error
      type(field_t), allocatable :: fields(:)
      real(dp), allocatable :: values(:, :), spread(:, :)
      integer, allocatable :: line(:, :)
      integer :: i, first

      call profile_facets(stepper%scene, line)
      allocate(fields, source=quantity_fields(variable, stepper%scene%n_dim))
      allocate(values, source=quantity_of_field(stepper, variable))
      first = 1
      do i = 1, size(fields)
         associate (n => fields(i)%n_component, n_line => merge(size(line, 2), 0, &
            fields(i)%is_cell))
            if (allocated(spread)) deallocate(spread)
            allocate(spread(n, size(values, 2) + n_line), source=0.0_dp)
            spread(:, :size(values, 2)) = values(first:first + n - 1, :)
         end associate
         call vtkhdf_write(self%fields, trim(fields(i)%name), spread, error)
         if (allocated(error)) return
         first = first + fields(i)%n_component
      end do
   end subroutine write_variable

   !> Make visible what is written, if it is time or forced.
   subroutine recorder_publish(self, is_forced, error)
      type(recorder_t), intent(inout) :: self
      logical, intent(in) :: is_forced
      type(error_t), allocatable, intent(out) :: error

      call vtkhdf_publish(self%fields, is_forced, error)
      if (.not. allocated(error)) call surface_recorder_publish(self%surfaces, is_forced, error)
      if (.not. allocated(error)) call history_publish(self%history, is_forced, error)
   end subroutine recorder_publish

   !> Note the wall time of the run, and the CPU times that contact and the judge took.
   subroutine recorder_finish(self, wall, contact, judge, error)
      type(recorder_t), intent(inout) :: self
      real(dp), intent(in) :: wall, contact, judge   !! [s]
      type(error_t), allocatable, intent(out) :: error

      call history_set_once(self%history, "RUN", "WALL_SECONDS", [0], [wall], error)
      call history_set_once(self%history, "RUN", "CONTACT_CPU_SECONDS", [0], [contact], error)
      call history_set_once(self%history, "RUN", "JUDGE_CPU_SECONDS", [0], [judge], error)
   end subroutine recorder_finish

   !> Complete and close all files; the first failure is told.
   subroutine recorder_close(self, error)
      type(recorder_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: second

      call vtkhdf_close(self%fields, error)
      call surface_recorder_close(self%surfaces, second)
      if (.not. allocated(error)) call move_alloc(second, error)
      call history_close(self%history, second)
      if (.not. allocated(error)) call move_alloc(second, error)
   end subroutine recorder_close

end module emcon_recorder
