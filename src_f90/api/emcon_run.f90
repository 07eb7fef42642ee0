!> A batch run: deck in, files out, from the first increment or from a restart file.
module emcon_run
   use emcon_blas, only : blas_keep_memory, blas_single_thread
   use emcon_element_kinds, only : element_kinds
   use emcon_errors, only : err_file, err_input, err_interrupt, error_t, raise
   use emcon_files, only : file_exists, make_directory, survive_file_size_limit
   use emcon_kinds, only : dp, wp
   use emcon_log, only : log_close, log_line, log_open, log_t
   use emcon_march, only : increment_t
   use emcon_progress, only : progress_end, progress_show, progress_start, progress_t
   use emcon_recorder, only : recorder_close, recorder_finish, recorder_open, recorder_publish, &
      recorder_resume, recorder_t, recorder_write
   use emcon_restart, only : restart_get, restart_put, restart_read, restart_t, restart_write
   use emcon_stepper, only : stepper_advance, stepper_close, stepper_fraction, stepper_is_done, &
      stepper_load, stepper_open, stepper_save, stepper_t
   use emcon_text, only : string_t, to_text
   use emcon_timer, only : cpu_seconds, wall_seconds
   use emcon_version, only : version
   implicit none
   private
   public :: run_options_t, run_report_t, interrupt_interface
   public :: run_prepare, run_deck, run_restart, run_check

   !> What the command line can say of a run.
   type :: run_options_t
      type(string_t), allocatable :: override(:) !! parameters, NAME=VALUE
      character(len=:), allocatable :: folder    !! of the results; empty: beside the deck
      logical :: is_lenient = .false.
      logical :: is_quiet = .false.
   end type run_options_t

   !> What a run has to tell at its end.
   type :: run_report_t
      type(string_t), allocatable :: diagnostic(:)   !! of the deck
      character(len=:), allocatable :: base          !! of the result files
      type(string_t), allocatable :: closing(:)      !! lines of the closing balance
   end type run_report_t

   abstract interface
      !> Has the user asked to stop?
      logical function interrupt_interface()
      end function interrupt_interface
   end interface

   !> Error of the energy balance, relative to the largest energy, that the verdict accepts.
   real(wp), parameter :: ten_digits = 1.0e-10_wp
   !> Residuals told per increment, at most.
   integer, parameter :: most_residuals = 15

   !> All that a run in progress holds.
   type :: run_t
      type(stepper_t) :: stepper
      type(recorder_t) :: recorder
      type(log_t) :: log
      type(progress_t) :: progress
      character(len=:), allocatable :: base
      real(dp) :: wall_start = 0.0_dp
      real(wp) :: total0 = 0.0_wp
      real(wp) :: largest_drift = 0.0_wp         !! of total - contact work
      real(wp) :: largest_energy = 0.0_wp
      real(wp) :: deepest = 0.0_wp
      integer :: n_newton = 0
      integer :: n_cut = 0
   end type run_t

contains

   !> Settings of the whole process, for a program of its own: one thread in BLAS (small matrices),
   !> freed memory is kept, and a file size limit is an error like a full disk.
   subroutine run_prepare()
      logical :: is_single

      call blas_single_thread(is_single)
      call blas_keep_memory()
      call survive_file_size_limit()
   end subroutine run_prepare

   !> Read and check the deck at `path`, without a run.
   subroutine run_check(path, options, report, error)
      character(len=*), intent(in) :: path
      type(run_options_t), intent(in) :: options
      type(run_report_t), intent(out) :: report
      type(error_t), allocatable, intent(out) :: error
      type(run_t), allocatable :: run

      allocate(run)
      call stepper_open(run%stepper, path, options%override, options%is_lenient, error)
      call move_diagnostics(run, report)
      if (allocated(error)) return
      report%closing = model_lines(run%stepper)
   end subroutine run_check

   !> Run the deck at `path`. What was written stays, whatever the error.
   subroutine run_deck(path, options, is_interrupted, report, error)
      character(len=*), intent(in) :: path
      type(run_options_t), intent(in) :: options
      procedure(interrupt_interface) :: is_interrupted
      type(run_report_t), intent(out) :: report
      type(error_t), allocatable, intent(out) :: error
      type(run_t), allocatable :: run
      type(increment_t) :: nothing

      allocate(run)
      run%wall_start = wall_seconds()
      call stepper_open(run%stepper, path, options%override, options%is_lenient, error)
      call move_diagnostics(run, report)
      if (allocated(error)) return
      run%base = result_base(path, options)
      report%base = run%base
      if (is_result(path, run%base)) then
         call raise(error, err_input, path // ": the results would overwrite the deck; choose " // &
            "another folder with --output, or name the deck NAME.inp")
         return
      end if
      if (len(options%folder) > 0) call make_directory(options%folder, error)
      if (allocated(error)) return
      call log_open(run%log, run%base // ".log", .false., error)
      if (allocated(error)) return
      call recorder_open(run%recorder, run%stepper, run%base, error)
      if (.not. allocated(error)) then
         call log_start(run, report, path)
         call recorder_write(run%recorder, run%stepper, nothing, cpu_seconds(), error)
      end if
      call march_on(run, options, is_interrupted, report, error)
   end subroutine run_deck

   !> Go on from the restart file `path`.
   subroutine run_restart(path, options, is_interrupted, report, error)
      character(len=*), intent(in) :: path
      type(run_options_t), intent(in) :: options
      procedure(interrupt_interface) :: is_interrupted
      type(run_report_t), intent(out) :: report
      type(error_t), allocatable, intent(out) :: error
      type(run_t), allocatable :: run
      type(restart_t) :: restart
      integer :: counts(2), i

      allocate(run)
      run%wall_start = wall_seconds()
      i = index(path, ".rst.h5", back=.true.)
      if (i < 2 .or. i /= len(path) - 6) then
         call raise(error, err_input, path // ": a restart file is called NAME.rst.h5")
         return
      end if
      run%base = path(:i - 1)
      report%base = run%base
      if (.not. file_exists(path)) then
         call raise(error, err_input, path // ": there is no such file")
         return
      end if
      call log_open(run%log, run%base // ".log", .true., error)
      if (allocated(error)) return
      call restart_read(restart, path, error)
      if (.not. allocated(error)) call restart_get(restart, "counts", counts, error)
      if (.not. allocated(error)) call stepper_load(run%stepper, restart, error)
      if (.not. allocated(error)) call load_balance(run, restart, error)
      if (allocated(error)) then
         if (error%code /= err_file) error%code = err_input
         return
      end if
      call move_diagnostics(run, report)
      call recorder_resume(run%recorder, run%stepper, run%base, counts(1), counts(2), error)
      if (allocated(error)) return
      call log_line(run%log, "resumed after increment " // &
         to_text(run%stepper%march%state%increment) // ", time " // &
         to_text(run%stepper%march%state%time, 9))
      call march_on(run, options, is_interrupted, report, error)
   end subroutine run_restart

   subroutine move_diagnostics(run, report)
      type(run_t), intent(inout) :: run
      type(run_report_t), intent(inout) :: report

      allocate(report%closing(0))
      if (allocated(run%stepper%diagnostic)) then
         call move_alloc(run%stepper%diagnostic, report%diagnostic)
      else
         allocate(report%diagnostic(0))
      end if
   end subroutine move_diagnostics

   !> Is `path` the name of one of the results of `base`?
   pure logical function is_result(path, base)
      character(len=*), intent(in) :: path, base
      character(len=7), parameter :: suffix(5) = [character(len=7) :: ".csv", ".h5", ".log", &
         ".vtkhdf", ".rst.h5"]
      integer :: i

      is_result = .false.
      do i = 1, size(suffix)
         is_result = is_result .or. path == base // trim(suffix(i))
      end do
   end function is_result

   !> Path of the results without extension: the deck's own, or its name in the folder asked for.
   function result_base(path, options) result(base)
      character(len=*), intent(in) :: path
      type(run_options_t), intent(in) :: options
      character(len=:), allocatable :: base
      integer :: slash, point

      slash = index(path, "/", back=.true.)
      point = index(path, ".", back=.true.)
      base = path
      if (point > slash + 1) base = path(:point - 1)
      if (len(options%folder) > 0) base = options%folder // "/" // base(slash + 1:)
   end function result_base

   !> The increments, from the present state to the end.
   subroutine march_on(run, options, is_interrupted, report, error)
      type(run_t), intent(inout) :: run
      type(run_options_t), intent(in) :: options
      procedure(interrupt_interface) :: is_interrupted
      type(run_report_t), intent(inout) :: report
      type(error_t), allocatable, intent(inout) :: error
      type(increment_t) :: increment
      logical :: has_stopped

      has_stopped = .false.
      if (run%stepper%march%state%increment == 0) run%total0 = run%stepper%march%ledger%total
      call progress_start(run%progress, real(stepper_fraction(run%stepper), dp), options%is_quiet)
      do while (.not. allocated(error) .and. .not. stepper_is_done(run%stepper))
         has_stopped = is_interrupted()
         if (has_stopped) exit
         call stepper_advance(run%stepper, increment, error)
         call log_increment(run, increment)
         if (allocated(error)) exit
         call recorder_write(run%recorder, run%stepper, increment, cpu_seconds(), error)
         if (.not. allocated(error)) call save_if_due(run, error)
         if (.not. allocated(error)) call recorder_publish(run%recorder, .false., error)
         associate (state => run%stepper%march%state)
            call progress_show(run%progress, real(stepper_fraction(run%stepper), dp), &
               real(state%time, dp), real(increment%h, dp), increment%n_newton, increment%n_active)
         end associate
      end do
      call progress_end(run%progress)
      if (has_stopped) then
         call save(run, error)
         if (.not. allocated(error)) call raise(error, err_interrupt, &
            "interrupted after increment " // to_text(run%stepper%march%state%increment) // &
            "; go on with: emcon restart " // run%base // ".rst.h5")
      end if
      call finish(run, report, error)
   end subroutine march_on

   !> Close the files, whatever happened; the first error stands.
   subroutine finish(run, report, error)
      type(run_t), intent(inout) :: run
      type(run_report_t), intent(inout) :: report
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: second
      integer :: i

      if (.not. allocated(error)) then
         call recorder_finish(run%recorder, wall_seconds() - run%wall_start, error)
      end if
      call recorder_close(run%recorder, second)
      if (.not. allocated(error)) call move_alloc(second, error)
      if (allocated(error)) call log_line(run%log, error%message)
      report%closing = closing_lines(run)
      do i = 1, size(report%closing)
         call log_line(run%log, report%closing(i)%text)
      end do
      call stepper_close(run%stepper)
      call log_close(run%log, second)
      if (.not. allocated(error)) call move_alloc(second, error)
   end subroutine finish

   !> Write the restart file where *RESTART asks for it.
   subroutine save_if_due(run, error)
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(out) :: error

      associate (state => run%stepper%march%state, &
            frequency => run%stepper%scene%step(run%stepper%march%state%i_step)%restart_frequency)
         if (frequency == 0) return
         if (mod(state%n_grid, frequency) == 0 .or. stepper_is_done(run%stepper)) then
            call save(run, error)
         end if
      end associate
   end subroutine save_if_due

   !> Publish the results and write the restart file, in this order: it may not be ahead of them.
   subroutine save(run, error)
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(out) :: error
      type(restart_t) :: restart

      call recorder_publish(run%recorder, .true., error)
      if (allocated(error)) return
      call stepper_save(run%stepper, restart)
      call restart_put(restart, "counts", [run%recorder%n_row, run%recorder%fields%n_frame])
      call restart_put(restart, "balance", [run%total0, run%largest_drift, run%largest_energy, &
         run%deepest])
      call restart_put(restart, "effort", [run%n_newton, run%n_cut])
      call restart_write(restart, run%base // ".rst.h5", error)
   end subroutine save

   subroutine load_balance(run, restart, error)
      type(run_t), intent(inout) :: run
      type(restart_t), intent(in) :: restart
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: balance(4)
      integer :: effort(2)

      call restart_get(restart, "balance", balance, error)
      if (.not. allocated(error)) call restart_get(restart, "effort", effort, error)
      if (allocated(error)) return
      run%total0 = balance(1)
      run%largest_drift = balance(2)
      run%largest_energy = balance(3)
      run%deepest = balance(4)
      run%n_newton = effort(1)
      run%n_cut = effort(2)
   end subroutine load_balance

   !> Head of the log: program, deck, model, remarks.
   subroutine log_start(run, report, path)
      type(run_t), intent(inout) :: run
      type(run_report_t), intent(in) :: report
      character(len=*), intent(in) :: path
      type(string_t), allocatable :: line(:)
      integer :: i

      call log_line(run%log, "EMCON " // version // ", deck " // path)
      do i = 1, size(run%stepper%override)
         call log_line(run%log, "with " // run%stepper%override(i)%text)
      end do
      do i = 1, size(report%diagnostic)
         call log_line(run%log, report%diagnostic(i)%text)
      end do
      allocate(line, source=model_lines(run%stepper))
      do i = 1, size(line)
         call log_line(run%log, line(i)%text)
      end do
      call log_line(run%log, "")
      call log_line(run%log, " increment          time             h newton cuts active" // &
         "          kinetic           strain            total  residuals of the last solve")
   end subroutine log_start

   !> What is modelled, in a few lines.
   function model_lines(stepper) result(line)
      type(stepper_t), intent(in) :: stepper
      type(string_t), allocatable :: line(:)
      integer :: k

      allocate(line(0))
      associate (scene => stepper%scene, system => stepper%march%system)
         if (len_trim(scene%heading) > 0) call add(trim(scene%heading))
         call add(to_text(size(scene%x, 2)) // " nodes, " // &
            to_text(system%numbering%n_unknown) // " unknowns in step 1, " // &
            to_text(system%n_body) // " bodies")
         do k = 1, size(element_kinds)
            if (any(scene%element_kind == k)) call add(to_text(count(scene%element_kind == k)) // &
               " elements " // trim(element_kinds(k)%name))
         end do
         do k = 1, size(scene%pair)
            call add("contact: " // scene%surface(scene%pair(k)%slave)%name // " (slave, " // &
               to_text(system%contact(k)%contact%n_constraint) // " nodes) on " // &
               scene%surface(scene%pair(k)%master)%name)
         end do
         do k = 1, size(scene%step)
            call add("step " // to_text(k) // ": duration " // to_text(scene%step(k)%duration) // &
               ", h = " // to_text(scene%step(k)%h) // &
               merge(", NLGEOM", "        ", scene%step(k)%nlgeom))
         end do
      end associate
      do k = 1, stepper%notes%n
         call add(stepper%notes%item(k)%text)
      end do

   contains

      subroutine add(text)
         character(len=*), intent(in) :: text
         type(string_t) :: new(1)

         new(1)%text = trim(text)
         line = [line, new]
      end subroutine add

   end function model_lines

   !> One line per increment and its remarks, and the running balance.
   subroutine log_increment(run, increment)
      type(run_t), intent(inout) :: run
      type(increment_t), intent(in) :: increment
      character(len=320) :: line
      integer :: i, n

      do i = 1, increment%notes%n
         call log_line(run%log, "   " // increment%notes%item(i)%text)
      end do
      run%n_newton = run%n_newton + increment%n_newton
      run%n_cut = run%n_cut + increment%n_cut
      run%deepest = min(run%deepest, increment%deepest)
      associate (state => run%stepper%march%state, ledger => run%stepper%march%ledger)
         run%largest_energy = max(run%largest_energy, abs(run%total0), &
            ledger%kinetic + ledger%strain)
         run%largest_drift = max(run%largest_drift, &
            abs(ledger%total - ledger%contact_work - run%total0))
         write(line, "(i10, 2es14.6, i7, i5, i7, 3es17.9)") state%increment, state%time, &
            increment%h, increment%n_newton, increment%n_cut, increment%n_active, &
            ledger%kinetic, ledger%strain, ledger%total
      end associate
      if (allocated(increment%residual)) then
         n = min(size(increment%residual), most_residuals)
         write(line(len_trim(line) + 1:), "(*(es9.1))") increment%residual(:n)
      end if
      call log_line(run%log, trim(line))
   end subroutine log_increment

   !> The closing balance and the verdict.
   function closing_lines(run) result(line)
      type(run_t), intent(in) :: run
      type(string_t), allocatable :: line(:)
      real(wp) :: scale

      allocate(line(0))
      if (run%stepper%march%state%increment == 0) return
      associate (state => run%stepper%march%state, ledger => run%stepper%march%ledger)
         scale = max(run%largest_energy, tiny(scale))
         call add("increments " // to_text(state%increment) // ", time " // &
            to_text(state%time, 9) // ", Newton iterations " // to_text(run%n_newton) // &
            ", cuts " // to_text(run%n_cut))
         call add("energy: kinetic " // to_text(ledger%kinetic, 9) // ", strain " // &
            to_text(ledger%strain, 9) // ", external work " // to_text(ledger%external_work, 9) // &
            ", contact work " // to_text(ledger%contact_work, 9))
         call add("total at start " // to_text(run%total0, 12) // ", at end " // &
            to_text(ledger%total, 12))
         call add("largest error of the energy balance " // to_text(run%largest_drift/scale, 3) // &
            " of the largest energy, deepest penetration " // to_text(-run%deepest, 3) // &
            " of an element")
         if (.not. run%stepper%march%scheme%has_inertia) return
         if (run%largest_drift <= ten_digits*scale) then
            call add("verdict: the energy balance closes to ten digits or better")
         else
            call add("verdict: the energy balance does NOT close to ten digits")
         end if
      end associate

   contains

      subroutine add(text)
         character(len=*), intent(in) :: text
         type(string_t) :: new(1)

         new(1)%text = text
         line = [line, new]
      end subroutine add

   end function closing_lines

end module emcon_run
