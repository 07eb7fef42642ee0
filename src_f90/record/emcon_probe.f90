!> What a run will cost, by its first increments: a quarter of a second of them, or three, but no
!> more than a second of work.
module emcon_probe
   use, intrinsic :: iso_c_binding, only : c_int
   use emcon_bent_bodies, only : bent_body_find, bent_body_t
   use emcon_errors, only : err_interrupt, error_t
   use emcon_files, only : file_remove
   use emcon_kinds, only : dp, int64, wp
   use emcon_march, only : increment_t
   use emcon_march_grid, only : march_count_increments
   use emcon_memory, only : memory_most
   use emcon_memory_report, only : megabyte, memory_report
   use emcon_recorder, only : recorder_close, recorder_open, recorder_t, recorder_write
   use emcon_report_row, only : report_row_t, report_rows_t, row_begin, row_put, rows_add
   use emcon_stepper, only : stepper_advance, stepper_is_done, stepper_t
   use emcon_surface_recorder, only : surfaces_suffix
   use emcon_text, only : to_text
   use emcon_timer, only : cpu_seconds
   implicit none
   private
   public :: probe_cost

   !> So long the probe goes on, and until so many increments are made, but no longer than `most`.
   real(dp), parameter :: least_seconds = 0.25_dp, most_seconds = 1.0_dp
   integer, parameter :: least_increments = 3
   !> With more entries of the matrix one correction alone may take longer than the probe.
   integer, parameter :: most_entries = 3000000

   !> What the probe has come to.
   type :: probe_t
      integer :: n = 0                           !! increments
      integer :: n_newton = 0
      logical :: is_late = .false.               !! an increment was given up after `most_seconds`
      real(dp) :: begun = 0.0_dp                 !! CPU time before the first one [s]
      real(dp) :: first = 0.0_dp, last = 0.0_dp  !! of the first and of the last one [s]
      real(dp) :: spent = 0.0_dp                 !! of all [s]
      real(dp) :: ended = 0.0_dp                 !! of closing the files [s]
      real(dp) :: files = 0.0_dp                 !! memory that the files take [byte]
   end type probe_t

   interface
      !> Of POSIX; the number of this process.
      integer(c_int) function c_getpid() bind(c, name="getpid")
         import :: c_int
      end function c_getpid
   end interface

contains

   !> Let `stepper` make increments, and tell what all of them will take. It is of no use after.
   subroutine probe_cost(stepper, rows)
      type(stepper_t), intent(inout) :: stepper  !! before its first increment
      type(report_rows_t), intent(inout) :: rows
      type(error_t), allocatable :: error
      type(recorder_t) :: recorder
      type(probe_t) :: probe
      type(report_row_t) :: row
      character(len=:), allocatable :: base
      logical :: has_files

      call row_begin(row, "cost", "cost:")
      if (n_entry(stepper) > most_entries) then
         call row_put(row, "not_predicted", n_entry(stepper), " not predicted: with # entries of " &
            // "the matrix trying an increment takes long; run a few of them")
         call rows_add(rows, row)
         call add_memory(stepper, probe, rows)
         return
      end if
      call scratch_base(base)
      call open_files(recorder, stepper, base, has_files)
      probe%files = recorder%memory
      call go(stepper, recorder, has_files, probe, error)
      call remove_files(recorder, base, has_files, probe%ended)
      if (probe%n > 0 .and. .not. allocated(error)) call advise_bending(stepper, rows)
      if (probe%is_late .and. probe%n == 0) then
         call row_put(row, "not_predicted", real(most_seconds, wp), " not predicted: the first " &
            // "increment takes more than # s of CPU time; run a few of them")
      else if (allocated(error)) then
         call row_put(row, "failure", error%message, " increment " // to_text(probe%n + 1) // &
            " of the probe fails: #")
      else if (probe%n > 0) then
         call put_figures(stepper, row, probe)
         if (.not. has_files) call row_put(row, "remark", "result files not included, as " // &
            "none can be written to try", "; #")
      end if
      call rows_add(rows, row)
      call add_memory(stepper, probe, rows)
   end subroutine probe_cost

   !> What takes how much memory, as far as the probe has come.
   subroutine add_memory(stepper, probe, rows)
      type(stepper_t), intent(in) :: stepper
      type(probe_t), intent(in) :: probe
      type(report_rows_t), intent(inout) :: rows
      type(report_row_t) :: row

      call memory_report(stepper, probe%files, row)
      if (row%text /= "") call rows_add(rows, row)
   end subroutine add_memory

   !> A body that the probe has bent, of elements that are too stiff for it.
   subroutine advise_bending(stepper, rows)
      type(stepper_t), intent(in) :: stepper
      type(report_rows_t), intent(inout) :: rows
      type(bent_body_t) :: found
      type(report_row_t) :: row

      call bent_body_find(stepper%march, stepper%scene, stepper%verdict%energy%largest, found)
      if (found%body == 0) return
      call row_begin(row, "advice", "body")
      call row_put(row, "body", found%body, " #")
      call row_put(row, "bending_percent", found%percent, " is bent and made of linear elements, " &
         // "too stiff by about # %; " // found%advice)
      call rows_add(rows, row)
   end subroutine advise_bending

   !> Make increments, and record them as a run would, until there are enough.
   subroutine go(stepper, recorder, has_files, probe, error)
      type(stepper_t), intent(inout) :: stepper
      type(recorder_t), intent(inout) :: recorder
      logical, intent(in) :: has_files
      type(probe_t), intent(inout) :: probe
      type(error_t), allocatable, intent(out) :: error
      type(increment_t) :: increment

      probe%begun = cpu_seconds()
      stepper%march%newton%deadline = probe%begun + most_seconds
      do while (.not. stepper_is_done(stepper) .and. probe%spent < most_seconds)
         if (probe%spent >= least_seconds .and. probe%n >= least_increments) exit
         call stepper_advance(stepper, increment, error)
         if (allocated(error)) probe%is_late = error%code == err_interrupt
         if (probe%is_late) then
            if (probe%n > 0) deallocate(error)       ! those before tell it
            exit
         end if
         if (has_files .and. .not. allocated(error)) call recorder_write(recorder, stepper, &
            increment, cpu_seconds(), error)
         if (allocated(error)) exit
         probe%last = cpu_seconds() - probe%begun - probe%spent
         probe%spent = probe%spent + probe%last
         probe%n = probe%n + 1
         probe%n_newton = probe%n_newton + increment%n_newton
         if (probe%n == 1) probe%first = probe%spent
      end do
   end subroutine go

   !> A name for files that nobody else uses, where temporary ones belong.
   subroutine scratch_base(base)
      character(len=:), allocatable, intent(out) :: base
      character(len=256) :: folder

      call get_environment_variable("TMPDIR", folder)
      if (len_trim(folder) == 0) folder = "/tmp"
      base = trim(folder) // "/emcon_probe_" // to_text(int(c_getpid()))
   end subroutine scratch_base

   !> Begin the files of a run, and record its start.
   subroutine open_files(recorder, stepper, base, is_open)
      type(recorder_t), intent(inout) :: recorder
      type(stepper_t), intent(inout) :: stepper
      character(len=*), intent(in) :: base
      logical, intent(out) :: is_open
      type(error_t), allocatable :: error
      type(increment_t) :: nothing

      call recorder_open(recorder, stepper, base, error)
      if (.not. allocated(error)) call recorder_write(recorder, stepper, nothing, 0.0_dp, error)
      is_open = .not. allocated(error)
   end subroutine open_files

   subroutine remove_files(recorder, base, is_open, seconds)
      type(recorder_t), intent(inout) :: recorder
      character(len=*), intent(in) :: base
      logical, intent(in) :: is_open
      real(dp), intent(out) :: seconds           !! of closing them
      type(error_t), allocatable :: ignored

      seconds = cpu_seconds()
      if (is_open) call recorder_close(recorder, ignored)
      seconds = cpu_seconds() - seconds
      call file_remove(base // ".vtkhdf", ignored)
      call file_remove(base // surfaces_suffix, ignored)
      call file_remove(base // ".h5", ignored)
      call file_remove(base // ".csv", ignored)
   end subroutine remove_files

   !> The first increment counts once, the others stand for the rest; the last one by half, as it is
   !> long ones that end a probe.
   subroutine put_figures(stepper, row, probe)
      type(stepper_t), intent(in) :: stepper
      type(report_row_t), intent(inout) :: row
      type(probe_t), intent(in) :: probe
      integer(int64) :: n_factor
      real(wp) :: megabytes
      real(dp) :: seconds

      seconds = probe%spent
      if (probe%n > 1 .and. .not. stepper_is_done(stepper)) seconds = probe%first &
         + real(count_all(stepper) - 1, dp)*(probe%spent - probe%first - 0.5_dp*probe%last) &
         /(real(probe%n, dp) - 1.5_dp)
      seconds = probe%begun + seconds + probe%ended
      call row_put(row, "cpu_seconds", real(seconds, wp), " expected # s of CPU time")
      call row_put(row, "increments", count_all(stepper), " for # increments")
      call row_put(row, "newton", real(probe%n_newton, wp)/real(probe%n, wp), ", # iterations each")
      megabytes = real(memory_most()/megabyte, wp)
      if (megabytes > 0.0_wp) call row_put(row, "memory_megabytes", megabytes, &
         ", # MB of memory")
      associate (factors => stepper%march%newton%correction%factors)
         n_factor = max(factors%general%n_factor, factors%definite%n_factor)
      end associate
      associate (kept => stepper%march%newton%correction%kept%blocks, &
            solver => stepper%march%newton%correction%factors%definite)
         if (kept%is_incomplete) then
            call put_iterations(row, real(kept%n_entry, wp), real(kept%n_operation, wp))
         else if (solver%is_incomplete) then
            call put_iterations(row, real(n_factor, wp), real(solver%n_operation, wp))
         else if (n_factor > 0) then
            call row_put(row, "factor_entries", real(n_factor, wp), ", # entries of the factor")
         end if
      end associate
      call row_put(row, "probe_increments", probe%n, "; by the first # increments")
   end subroutine put_figures

   !> Solved by iterations, and what factors would take.
   subroutine put_iterations(row, n_entry, n_operation)
      type(report_row_t), intent(inout) :: row
      real(wp), intent(in) :: n_entry, n_operation       !! of complete factors

      call row_put(row, "spared_entries", n_entry, ", by iterations: a factor would have # entries")
      call row_put(row, "spared_operations", n_operation, " and take # operations")
   end subroutine put_iterations

   !> Entries of the matrix of the first step; 0: there is none.
   pure integer function n_entry(stepper)
      type(stepper_t), intent(in) :: stepper

      n_entry = 0
      associate (matrix => stepper%march%system%matrix)
         if (allocated(matrix%row_start)) n_entry = matrix%row_start(matrix%n_row + 1)
      end associate
   end function n_entry

   !> Increments of all steps, if none is cut.
   integer function count_all(stepper) result(n)
      type(stepper_t), intent(in) :: stepper
      integer :: k

      n = 0
      do k = 1, size(stepper%scene%step)
         n = n + march_count_increments(stepper%scene%step(k))
      end do
   end function count_all

end module emcon_probe
