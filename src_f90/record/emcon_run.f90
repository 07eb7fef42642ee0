! build: holder
!> A batch run: deck in, files out, from the first increment or from a restart file.
module emcon_run
   use emcon_blas, only : blas_single_thread
   use emcon_build, only : build_differences, build_list
   use emcon_deck_further, only : further_t
   use emcon_deck_keyword_list, only : keyword_lines
   use emcon_errors, only : err_analysis, err_file, err_input, err_interrupt, error_t, raise
   use emcon_files, only : file_exists, file_remove, is_same_file, make_directory, &
      survive_file_size_limit
   use emcon_heap, only : heap_keep
   use emcon_kinds, only : dp, wp
   use emcon_log, only : log_close, log_line, log_lines, log_open, log_t
   use emcon_march, only : increment_t, march_watch
   use emcon_memory_report, only : memory_report
   use emcon_newton, only : interrupt_interface
   use emcon_progress, only : progress_end, progress_show, progress_start, progress_t
   use emcon_recorder, only : recorder_close, recorder_finish, recorder_open, recorder_publish, &
      recorder_resume, recorder_t, recorder_write
   use emcon_restart, only : restart_read, restart_t, restart_write
   use emcon_restart_data, only : restart_check, restart_exchange, restart_list, restart_offers
   use emcon_pace, only : pace_begin, pace_end, pace_is_due, pace_t
   use emcon_phases, only : n_phase, phase_eliminate, phase_gaps, phase_judge, phase_search, &
      phases_seconds, phases_start
   use emcon_probe, only : probe_cost
   use emcon_report_row, only : report_row_t, report_rows_t, rows_json
   use emcon_run_log, only : log_increment, log_start, model_lines
   use emcon_run_watch, only : run_watch_t
   use emcon_run_phases, only : part_march, part_output, part_read, run_parts_mark, run_parts_t, &
      run_phases_json, run_phases_lines
   use emcon_scene_report, only : scene_report
   use emcon_stepper, only : stepper_advance, stepper_close, stepper_fraction, &
      stepper_is_done, stepper_open, stepper_set_threads, stepper_t
   use emcon_stepper_file, only : stepper_load, stepper_save
   use emcon_surface_recorder, only : surfaces_suffix
   use emcon_text, only : note_add, notes_t, string_t, to_text
   use emcon_timer, only : wall_seconds
   use emcon_verdict, only : verdict_end, verdict_is_failure, verdict_is_good
   use emcon_verdict_file, only : verdict_write
   use emcon_verdict_lines, only : verdict_balance_lines, verdict_line
   implicit none
   private
   public :: run_options_t, run_report_t, interrupt_interface
   public :: run_prepare, run_deck, run_restart, run_check
   public :: keyword_lines                       ! what decks may say

   !> What the command line can say of a run.
   type :: run_options_t
      type(string_t), allocatable :: override(:) !! parameters, NAME=VALUE
      character(len=:), allocatable :: folder    !! of the results; empty: beside the deck
      integer :: n_thread = 0                    !! that work; 0: as OMP_NUM_THREADS says, or one
      logical :: is_lenient = .false.
      logical :: is_quiet = .false.
      logical :: is_strict = .false.             !! a bad verdict is an error
      logical :: is_json = .false.               !! what `check` tells is one JSON object
      type(further_t) :: further                 !! what a restart is to do beside its deck
   end type run_options_t

   !> What a run has to tell at its end.
   type :: run_report_t
      type(string_t), allocatable :: diagnostic(:)   !! of the deck
      character(len=:), allocatable :: base          !! of the result files
      type(string_t), allocatable :: closing(:)      !! lines of the closing balance
      type(notes_t) :: warnings                      !! of the run, in any case to be told
      logical :: is_bad = .false.                    !! the last line of `closing` says why
   end type run_report_t

   !> All that a run in progress holds.
   type :: run_t
      type(stepper_t) :: stepper
      type(recorder_t) :: recorder
      type(log_t) :: log
      type(progress_t) :: progress
      character(len=:), allocatable :: base
      real(dp) :: wall_start = 0.0_dp
      type(run_parts_t) :: parts                 !! of its time
      type(pace_t) :: pace                       !! of restart files that *RESTART asks for
      logical :: saves_end = .false.             !! one is to be written behind the results
   end type run_t

contains

   !> Settings of the whole process, for a program of its own: one thread in BLAS (small matrices),
   !> freed memory is kept, and a file size limit is an error like a full disk.
   subroutine run_prepare()
      logical :: is_single

      call blas_single_thread(is_single)
      call heap_keep()
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
      if (.not. (allocated(error) .or. options%is_quiet)) call report_model(run, options, report)
   end subroutine run_check

   !> What `emcon check` prints of a model.
   subroutine report_model(run, options, report)
      type(run_t), intent(inout) :: run
      type(run_options_t), intent(in) :: options
      type(run_report_t), intent(inout) :: report
      type(report_rows_t) :: rows
      type(notes_t) :: lines
      character(len=:), allocatable :: json
      integer :: k

      associate (line => model_lines(run%stepper))
         lines = notes_t(size(line), line)
      end associate
      call scene_report(run%stepper, rows)
      call probe_cost(run%stepper, rows)
      if (options%is_json) then
         lines = notes_t()
         call rows_json(rows, json)
         call note_add(lines, json)
      else
         do k = 1, rows%n
            call note_add(lines, rows%row(k)%text)
         end do
      end if
      report%closing = lines%item(:lines%n)
   end subroutine report_model

   !> Run the deck at `path`. What was written stays, whatever the error.
   subroutine run_deck(path, options, is_interrupted, report, error)
      character(len=*), intent(in) :: path
      type(run_options_t), intent(in) :: options
      procedure(interrupt_interface) :: is_interrupted
      type(run_report_t), intent(out) :: report
      type(error_t), allocatable, intent(out) :: error
      type(run_t), allocatable :: run

      allocate(run)
      run%wall_start = wall_seconds()
      call stepper_open(run%stepper, path, options%override, options%is_lenient, error)
      call move_diagnostics(run, report)
      if (allocated(error)) return
      if (run%stepper%scene%deck%only_checks) then
         call report_model(run, options, report)
         report%closing = [report%closing, string_t("*NO ANALYSIS: the deck was read and " &
            // "checked; nothing was computed")]
         return
      end if
      call run_parts_mark(run%parts, part_read)
      call result_base(path, options, run%base)
      report%base = run%base
      if (is_result(path, run%base)) call raise(error, err_input, path // ": the results would " &
         // "overwrite the deck; choose another folder with --output, or name the deck NAME.inp")
      if (len(options%folder) > 0 .and. .not. allocated(error)) call make_directory( &
         options%folder, error)
      if (.not. allocated(error)) call log_open(run%log, run%base // ".log", .false., error)
      if (allocated(error)) return
      call begin_results(run, path, report, error)
      call march_on(run, options, is_interrupted, report, error)
   end subroutine run_deck

   !> Files that begin with the present state, and the head of the log.
   subroutine begin_results(run, path, report, error)
      type(run_t), intent(inout) :: run
      character(len=*), intent(in) :: path       !! of what the run was read from
      type(run_report_t), intent(in) :: report
      type(error_t), allocatable, intent(out) :: error
      type(increment_t) :: nothing

      call recorder_open(run%recorder, run%stepper, run%base, error)
      ! The state of an earlier run does not belong to the results that begin here.
      if (.not. allocated(error)) call file_remove(run%base // ".rst.h5", error)
      if (.not. allocated(error)) call file_remove(run%base // ".json", error)
      if (allocated(error)) return
      call run_parts_mark(run%parts, part_output)
      call log_start(run%log, run%stepper, report%diagnostic, path)
      call run_parts_mark(run%parts, part_read)
      call recorder_write(run%recorder, run%stepper, nothing, run%parts%marked, error)
   end subroutine begin_results

   !> Go on from the restart file `path`: in the files of the run, or with `folder` in files of its
   !> own.
   subroutine run_restart(path, options, is_interrupted, report, error)
      character(len=*), intent(in) :: path
      type(run_options_t), intent(in) :: options
      procedure(interrupt_interface) :: is_interrupted
      type(run_report_t), intent(out) :: report
      type(error_t), allocatable, intent(out) :: error
      type(run_t), allocatable :: run
      type(string_t), allocatable :: build(:)
      type(notes_t) :: differences
      integer :: n_row, n_frame
      logical :: branches

      allocate(run)
      run%wall_start = wall_seconds()
      branches = len(options%folder) > 0
      call restart_base(path, options, run%base, error)
      if (allocated(error)) return
      report%base = run%base
      call load_run(run, path, options, n_row, n_frame, build, error)
      if (allocated(error)) return
      if (branches) call make_directory(options%folder, error)
      if (.not. allocated(error)) call log_open(run%log, run%base // ".log", .not. branches, error)
      if (allocated(error)) return
      call run_parts_mark(run%parts, part_read)
      call move_diagnostics(run, report)
      call build_differences(build, path // ": warning: ", differences)
      if (differences%n > 0) report%diagnostic = [report%diagnostic, &
         differences%item(:differences%n)]
      if (branches) then
         call begin_results(run, path, report, error)
      else
         call recorder_resume(run%recorder, run%stepper, run%base, n_row, n_frame, error)
      end if
      if (allocated(error)) return
      call log_lines(run%log, "", differences)
      call log_line(run%log, "resumed after increment " // &
         to_text(run%stepper%march%state%clock%increment) // ", time " // &
         to_text(run%stepper%march%state%clock%time, 9))
      call march_on(run, options, is_interrupted, report, error)
   end subroutine run_restart

   !> Path of the results without extension: that of the restart file, or its name in the folder
   !> asked for, which must be another one.
   subroutine restart_base(path, options, base, error)
      character(len=*), intent(in) :: path
      type(run_options_t), intent(in) :: options
      character(len=:), allocatable, intent(out) :: base
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      i = index(path, ".rst.h5", back=.true.)
      if (i < 2 .or. i /= len(path) - 6) then
         call raise(error, err_input, path // ": a restart file is called NAME.rst.h5")
      else if (.not. file_exists(path)) then
         call raise(error, err_input, path // ": there is no such file")
      end if
      if (allocated(error)) return
      call result_base(path(:i - 1) // ".inp", options, base)
      if (len(options%folder) > 0 .and. is_result(path, base)) call raise(error, err_input, &
         path // ": the results would overwrite those of the run; choose another folder with " // &
         "--output")
   end subroutine restart_base

   !> The model and the state in the restart file `path`, and what of its files belongs to it.
   subroutine load_run(run, path, options, n_row, n_frame, build, error)
      type(run_t), intent(inout) :: run
      character(len=*), intent(in) :: path
      type(run_options_t), intent(in) :: options
      integer, intent(out) :: n_row, n_frame
      type(string_t), allocatable, intent(out) :: build(:)
      type(error_t), allocatable, intent(out) :: error
      type(restart_t) :: restart

      n_row = 0
      n_frame = 0
      call restart_read(restart, path, error)
      if (.not. allocated(error)) then
         if (.not. restart_offers(restart, "counts", .false.)) call raise(error, err_input, path &
            // ": a stepper wrote this file, not a run; go on by Stepper.from_restart of Python " &
            // "or emcon_load of C")
      end if
      if (.not. allocated(error)) call stepper_load(run%stepper, restart, error, options%further)
      if (.not. allocated(error)) then
         call exchange_files(restart, n_row, n_frame, build)
         call restart_check(restart, error)
      end if
      if (.not. allocated(error)) return
      if (error%code /= err_file) error%code = err_input
   end subroutine load_run

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
   logical function is_result(path, base)
      character(len=*), intent(in) :: path, base
      character(len=*), parameter :: suffix(7) = [character(len=16) :: ".csv", ".h5", ".log", &
         ".json", ".vtkhdf", surfaces_suffix, ".rst.h5"]
      integer :: i

      is_result = .false.
      do i = 1, size(suffix)
         is_result = is_result .or. is_same_file(path, base // trim(suffix(i)))
      end do
   end function is_result

   !> Path of the results without extension: the deck's own, or its name in the folder asked for.
   subroutine result_base(path, options, base)
      character(len=*), intent(in) :: path
      type(run_options_t), intent(in) :: options
      character(len=:), allocatable, intent(out) :: base
      integer :: slash, point

      slash = index(path, "/", back=.true.)
      point = index(path, ".", back=.true.)
      base = path
      if (point > slash + 1) base = path(:point - 1)
      if (len(options%folder) > 0) base = options%folder // "/" // base(slash + 1:)
   end subroutine result_base

   !> The increments, from the present state to the end.
   subroutine march_on(run, options, is_interrupted, report, error)
      type(run_t), intent(inout), target :: run
      type(run_options_t), intent(in) :: options
      procedure(interrupt_interface) :: is_interrupted
      type(run_report_t), intent(inout) :: report
      type(error_t), allocatable, intent(inout) :: error
      type(increment_t) :: increment
      type(run_watch_t), target :: watch
      logical :: has_stopped

      has_stopped = .false.
      if (options%n_thread > 0 .and. .not. allocated(error)) call stepper_set_threads(run%stepper, &
         options%n_thread, error)
      watch%progress => run%progress
      watch%log => run%log
      call march_watch(run%stepper%march, is_interrupted, watch)
      call phases_start(run%stepper%march%system%phases)
      call progress_start(run%progress, real(stepper_fraction(run%stepper), dp), options%is_quiet)
      do while (.not. allocated(error) .and. .not. stepper_is_done(run%stepper))
         has_stopped = is_interrupted()
         if (has_stopped) exit
         call run_parts_mark(run%parts, part_output)
         call stepper_advance(run%stepper, increment, error)
         call run_parts_mark(run%parts, part_march)
         if (allocated(error)) has_stopped = error%code == err_interrupt
         if (has_stopped) exit
         call log_increment(run%log, run%stepper, increment)
         if (allocated(error)) exit
         call recorder_write(run%recorder, run%stepper, increment, run%parts%marked, error)
         run%saves_end = stepper_is_done(run%stepper) .and. saves(run)
         if (is_save_due(run) .and. .not. allocated(error)) call save(run, error)
         if (.not. allocated(error)) call recorder_publish(run%recorder, .false., error)
         associate (state => run%stepper%march%state)
            call progress_show(run%progress, real(stepper_fraction(run%stepper), dp), &
               real(state%clock%time, dp), real(increment%h, dp), increment%n_newton, &
               increment%n_active)
         end associate
      end do
      call progress_end(run%progress)
      if (has_stopped) then
         call save(run, error)
         if (.not. allocated(error)) call raise(error, err_interrupt, &
            "interrupted after increment " // to_text(run%stepper%march%state%clock%increment) // &
            "; go on with: emcon restart " // run%base // ".rst.h5")
      end if
      call finish(run, options%is_strict, report, error)
   end subroutine march_on

   !> Close the files and pass the verdict, whatever happened; the first error stands.
   subroutine finish(run, is_strict, report, error)
      type(run_t), intent(inout) :: run
      logical, intent(in) :: is_strict
      type(run_report_t), intent(inout) :: report
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: second
      type(notes_t) :: lines, table
      type(report_row_t) :: memory
      character(len=:), allocatable :: members
      real(dp) :: seconds(n_phase)


      call memory_report(run%stepper, run%recorder%memory, memory)
      if (.not. allocated(error)) then
         seconds = phases_seconds(run%stepper%march%system%phases, run%parts%seconds(part_march))
         call recorder_finish(run%recorder, wall_seconds() - run%wall_start, &
            sum(seconds([phase_search, phase_gaps, phase_eliminate])), seconds(phase_judge), error)
      end if
      call recorder_close(run%recorder, second)
      if (.not. allocated(error)) call move_alloc(second, error)
      if (run%saves_end .and. .not. allocated(error)) call save_state(run, error)
      if (allocated(error)) call log_line(run%log, error%message)
      call pass_verdict(run, is_strict, report, lines, error)
      call log_lines(run%log, "warning: ", report%warnings)
      call log_lines(run%log, "", lines)
      report%closing = lines%item(:lines%n)
      call run_parts_mark(run%parts, part_output)
      call run_phases_lines(run%parts, run%stepper%march%system%phases, table)
      call log_lines(run%log, "", table)
      if (memory%text /= "") call log_line(run%log, memory%text)
      call run_phases_json(run%parts, run%stepper%march%system%phases, members)
      members = members // ', "memory": ' // memory%json // "}"
      call verdict_write(run%stepper%verdict, run%stepper%march, run%base // ".json", members, &
         second)
      if (.not. allocated(error)) call move_alloc(second, error)
      call stepper_close(run%stepper)
      call log_close(run%log, second)
      if (.not. allocated(error)) call move_alloc(second, error)
   end subroutine finish

   !> Judge the run that has ended, by `error` if that is allocated; it may become an error here.
   subroutine pass_verdict(run, is_strict, report, lines, error)
      type(run_t), intent(inout) :: run
      logical, intent(in) :: is_strict
      type(run_report_t), intent(inout) :: report
      type(notes_t), intent(out) :: lines
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text, failure

      if (allocated(error)) failure = error%message
      associate (verdict => run%stepper%verdict)
         call verdict_end(verdict, failure)      ! not allocated: absent
         call verdict_balance_lines(verdict, run%stepper%scene, run%stepper%march, lines)
         report%warnings = verdict%warnings
         report%is_bad = .not. verdict_is_good(verdict)
         if (allocated(error) .or. .not. verdict_is_failure(verdict, is_strict)) return
         call verdict_line(verdict, text)
         call raise(error, err_analysis, text // "; the results are complete")
      end associate
   end subroutine pass_verdict

   !> Does *RESTART ask for restart files in this step?
   pure logical function saves(run)
      type(run_t), intent(in) :: run

      saves = run%stepper%scene%step(run%stepper%march%state%clock%i_step)%restart_frequency /= 0
   end function saves

   !> Does it after this increment, before the end of the run? Within a step the last one has to be
   !> old enough.
   logical function is_save_due(run)
      type(run_t), intent(in) :: run

      is_save_due = saves(run) .and. .not. run%saves_end
      if (.not. is_save_due) return
      associate (state => run%stepper%march%state, &
            step => run%stepper%scene%step(run%stepper%march%state%clock%i_step))
         is_save_due = mod(state%clock%increment - state%clock%n_before, &
            step%restart_frequency) == 0
         if (is_save_due .and. state%clock%n_grid < run%stepper%march%grid%n_grid) then
            is_save_due = pace_is_due(run%pace)
         end if
      end associate
   end function is_save_due

   !> Publish the results and write the restart file, in this order: it may not be ahead of them.
   subroutine save(run, error)
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(out) :: error

      call pace_begin(run%pace)
      call recorder_publish(run%recorder, .true., error)
      if (.not. allocated(error)) call save_state(run, error)
      call pace_end(run%pace)
   end subroutine save

   subroutine save_state(run, error)
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(out) :: error
      type(restart_t) :: restart
      type(string_t), allocatable :: build(:)

      call stepper_save(run%stepper, restart)
      call build_list(build)
      call exchange_files(restart, run%recorder%n_row, run%recorder%fields%n_frame, build)
      call restart_write(restart, run%base // ".rst.h5", error)
   end subroutine save_state

   !> What of the result files belongs to the state, and which program wrote them.
   subroutine exchange_files(restart, n_row, n_frame, build)
      type(restart_t), intent(inout) :: restart
      integer, intent(inout) :: n_row, n_frame
      type(string_t), allocatable, intent(inout) :: build(:)

      call restart_exchange(restart, "counts", n_row)
      call restart_exchange(restart, "counts", n_frame)
      call restart_list(restart, "build", build)
   end subroutine exchange_files

end module emcon_run
