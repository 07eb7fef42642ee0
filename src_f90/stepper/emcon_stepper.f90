!> The stepper: open a deck, step, query, save, go on. All state is in the object; any number of
!> steppers live side by side.
module emcon_stepper
   use emcon_contact, only : gap_state_t
   use emcon_correction, only : correction_seconds
   use emcon_deck, only : deck_read
   use emcon_deck_source, only : deck_open, deck_open_text, deck_source_t, passage_t
   use emcon_diagnostics, only : diagnostics_t, diagnostics_texts
   use emcon_errors, only : err_input, err_interrupt, error_t, raise
   use emcon_host, only : host_count, host_count_conditions, host_t
   use emcon_host_check, only : host_check_scene
   use emcon_heap, only : heap_adapt
   use emcon_initial_contact, only : initial_contact_prepare
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : at_rest
   use emcon_ledger, only : ledger_measure, ledger_t
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_is_done, march_resume, march_t
   use emcon_restart, only : restart_get, restart_put, restart_size, restart_t
   use emcon_scene, only : scene_t
   use emcon_text, only : notes_append, notes_t, string_t, to_text
   use emcon_tie_moves, only : ties_move_nodes
   use emcon_ties, only : ties_prepare
   use emcon_verdict, only : verdict_start, verdict_t, verdict_update
   use emcon_verdict_file, only : verdict_load, verdict_save
   implicit none
   private
   public :: stepper_t, stepper_open, stepper_read, stepper_read_text, stepper_read_source, &
      stepper_build, stepper_advance, stepper_is_done
   public :: stepper_check_solids, stepper_close, stepper_fraction, stepper_save, stepper_load, &
      contact_gaps, stepper_contact_seconds

   type :: stepper_t
      type(scene_t) :: scene
      type(march_t) :: march
      type(host_t) :: given                     !! laws, forces and mass from outside
      type(deck_source_t) :: source              !! the deck as read, for restart files
      type(string_t), allocatable :: override(:) !! NAME=VALUE as given
      logical :: is_lenient = .false.
      logical :: is_read = .false.               !! `scene` is complete
      logical :: may_cut = .true.                !! a host can try a step again in smaller parts
      type(string_t), allocatable :: diagnostic(:)   !! errors and warnings of the deck
      type(notes_t) :: notes                     !! what was done before the first step
      type(verdict_t) :: verdict                 !! on the increments so far
   end type stepper_t

contains

   !> Read the deck at `path` and build its model. On an input error `diagnostic` tells all.
   subroutine stepper_open(self, path, override, is_lenient, error)
      type(stepper_t), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(string_t), intent(in) :: override(:)  !! parameters, NAME=VALUE
      logical, intent(in) :: is_lenient          !! unknown keywords are warnings
      type(error_t), allocatable, intent(out) :: error

      call stepper_read(self, path, override, is_lenient, error)
      if (.not. allocated(error)) call stepper_build(self, error)
   end subroutine stepper_open

   !> Read the deck at `path`: the scene, not yet the model.
   subroutine stepper_read(self, path, override, is_lenient, error)
      type(stepper_t), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(string_t), intent(in) :: override(:)
      logical, intent(in) :: is_lenient
      type(error_t), allocatable, intent(out) :: error
      type(diagnostics_t) :: diagnostics

      call deck_open(path, self%source, diagnostics)
      call read_opened(self, override, is_lenient, diagnostics, error)
   end subroutine stepper_read

   !> Read a deck in memory, of which messages say that it stands in the files `file_name`.
   subroutine stepper_read_text(self, text, passage, file_name, override, is_lenient, error)
      type(stepper_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      type(passage_t), intent(in) :: passage(:)
      type(string_t), intent(in) :: file_name(:), override(:)
      logical, intent(in) :: is_lenient
      type(error_t), allocatable, intent(out) :: error
      type(diagnostics_t) :: diagnostics

      call deck_open_text(text, passage, file_name, self%source, diagnostics)
      call read_opened(self, override, is_lenient, diagnostics, error)
   end subroutine stepper_read_text

   !> The scene of the deck source that was just opened; `diagnostics` are of its opening.
   subroutine read_opened(self, override, is_lenient, diagnostics, error)
      type(stepper_t), intent(inout) :: self
      type(string_t), intent(in) :: override(:)
      logical, intent(in) :: is_lenient
      type(diagnostics_t), intent(inout) :: diagnostics
      type(error_t), allocatable, intent(out) :: error

      if (diagnostics%n_errors > 0 .and. size(self%source%line) == 0) then
         self%diagnostic = diagnostics_texts(diagnostics)
         call raise(error, err_input, self%diagnostic(1)%text)
         return
      end if
      self%override = override
      self%is_lenient = is_lenient
      call stepper_read_source(self, diagnostics, error)
   end subroutine read_opened

   !> The scene of the deck source that `self` holds.
   subroutine stepper_read_source(self, diagnostics, error)
      type(stepper_t), intent(inout) :: self
      type(diagnostics_t), intent(inout) :: diagnostics
      type(error_t), allocatable, intent(out) :: error

      call deck_read(self%source, self%override, self%is_lenient, self%scene, diagnostics)
      self%diagnostic = diagnostics_texts(diagnostics)
      self%is_read = diagnostics%n_errors == 0
      if (.not. self%is_read) call raise(error, err_input, self%diagnostic(1)%text)
   end subroutine stepper_read_source

   !> Build the model of the scene that was read, and begin its first step. After an error there is
   !> nothing left to build from.
   subroutine stepper_build(self, error)
      type(stepper_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      if (.not. self%is_read) then
         call raise(error, err_input, "there is no scene: no deck was read, or reading " // &
            "or building it failed")
      else if (allocated(self%march%scheme)) then
         call raise(error, err_input, "the model is built already")
      end if
      if (allocated(error)) return
      call heap_adapt()
      call build(self, error)
      if (.not. allocated(error)) return
      self%is_read = .false.                     ! ties and contact may have moved nodes
      if (allocated(self%march%scheme)) deallocate(self%march%scheme)
   end subroutine stepper_build

   subroutine build(self, error)
      type(stepper_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      if (.not. self%scene%is_hosted) call host_check_scene(self%given, self%scene, error)
      if (allocated(error)) return
      call ties_prepare(self%scene, self%notes, error)
      if (.not. (allocated(error) .or. self%scene%is_hosted)) call prepare_contact(self, error)
      if (allocated(error)) return
      call march_init(self%march, self%scene, error, self%given)
      if (allocated(error)) return
      call march_begin_step(self%march, self%scene, 1, error)
      if (allocated(error)) return
      call notes_append(self%notes, self%march%system%notes)
      call verdict_start(self%verdict, self%march)
   end subroutine build

   subroutine prepare_contact(self, error)
      type(stepper_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      call initial_contact_prepare(self%scene, self%notes, error)
      if (.not. allocated(error)) call ties_move_nodes(self%scene, self%notes, error)
   end subroutine prepare_contact

   !> Free what libraries hold for `self`; call it before the object goes, also after an error.
   subroutine stepper_close(self)
      type(stepper_t), intent(inout) :: self

      call march_free(self%march)
   end subroutine stepper_close

   !> True after the last increment of the last step.
   pure logical function stepper_is_done(self)
      type(stepper_t), intent(in) :: self

      stepper_is_done = self%march%state%i_step >= size(self%scene%step) &
         .and. march_is_done(self%march)
   end function stepper_is_done

   !> One increment; at the end of a step of the deck the next one begins first.
   subroutine stepper_advance(self, increment, error)
      type(stepper_t), intent(inout) :: self
      type(increment_t), intent(out) :: increment
      type(error_t), allocatable, intent(out) :: error

      call stepper_check_solids(self, error)
      if (stepper_is_done(self) .or. allocated(error)) return
      if (march_is_done(self%march)) then
         call march_begin_step(self%march, self%scene, self%march%state%i_step + 1, error)
         if (allocated(error)) return
         call march_increment(self%march, self%scene, increment, error)
         call notes_append(increment%notes, self%march%system%notes)
      else
         call march_increment(self%march, self%scene, increment, error)
      end if
      if (allocated(error)) then
         if (error%code == err_interrupt) return
      end if
      call verdict_update(self%verdict, self%scene, self%march, increment)
   end subroutine stepper_advance

   !> The model has solids, and steps of its own.
   pure subroutine stepper_check_solids(self, error)
      type(stepper_t), intent(in) :: self
      type(error_t), allocatable, intent(out) :: error

      if (self%scene%is_hosted) call raise(error, err_input, &
         "the model has no solids and no deck: its host makes the steps")
   end subroutine stepper_check_solids

   !> Part of the analysis that is done, by time: 0..1.
   pure real(wp) function stepper_fraction(self)
      type(stepper_t), intent(in) :: self

      stepper_fraction = min(1.0_wp, self%march%state%time/sum(self%scene%step%duration))
   end function stepper_fraction

   !> Gap of each possible constraint at the present state, > 0 open; `is_near` false: not measured.
   subroutine contact_gaps(self, gap, is_near)
      type(stepper_t), intent(inout) :: self
      real(wp), intent(out) :: gap(:)            !! (n_constraint)
      logical, intent(out) :: is_near(:)
      type(gap_state_t) :: state
      integer :: pair, i, id

      gap = 0.0_wp
      is_near = .false.
      associate (system => self%march%system, u => self%march%state%u)
         do pair = 1, size(system%contact)
            associate (contact => system%contact(pair)%contact)
               contact%reach = 0.0_wp      ! which gaps are measured must not depend on the past
               call contact%begin_step(self%scene%x, u, at_rest(u))
               call contact%measure(self%scene%x, u, at_rest(u))
               do i = 1, contact%n_constraint
                  id = system%first_constraint(pair) + i
                  state = contact%state(i)
                  is_near(id) = state%is_near .and. state%is_over
                  if (is_near(id)) gap(id) = state%gap0
               end do
            end associate
         end do
      end associate
   end subroutine contact_gaps

   !> CPU time of search, gaps, constraints and null space since the program began [s].
   pure real(dp) function stepper_contact_seconds(self)
      type(stepper_t), intent(in) :: self

      stepper_contact_seconds = self%march%system%contact_clock%seconds &
         + correction_seconds(self%march%newton%correction)
   end function stepper_contact_seconds

   !> Put all that the next increment depends on into `restart`.
   subroutine stepper_save(self, restart)
      type(stepper_t), intent(in) :: self
      type(restart_t), intent(inout) :: restart
      integer :: n(2)

      call restart_put(restart, "deck_line", self%source%line)
      call restart_put(restart, "deck_file", self%source%file)
      call restart_put(restart, "deck_number", self%source%number)
      call restart_put(restart, "deck_file_name", self%source%file_name)
      call restart_put(restart, "override", self%override)
      call restart_put(restart, "is_lenient", [merge(1, 0, self%is_lenient)])
      associate (state => self%march%state, ledger => self%march%ledger)
         call restart_put(restart, "progress", [state%i_step, state%n_grid, state%grid_stride, &
            state%n_easy, state%increment, state%n_before])
         call restart_put(restart, "time", [state%start_time, state%time])
         call restart_put(restart, "ledger", [ledger%kinetic, ledger%strain, ledger%potential, &
            ledger%external_work, ledger%contact_work, ledger%total, ledger%momentum, &
            ledger%angular, ledger%stabilization])
         call restart_put(restart, "energy", state%energy)
         call restart_put(restart, "potential", [state%potential])
         call restart_put(restart, "u", state%u)
         call restart_put(restart, "v", state%v)
         call restart_put(restart, "u_start", state%u_start)
         call restart_put(restart, "contact", state%contact)
         call restart_put(restart, "reaction", state%reaction)
         call restart_put(restart, "internal", state%internal)
         call restart_put(restart, "lam", state%lam)
         call restart_put(restart, "is_active", merge(1, 0, state%is_active))
      end associate
      call save_pairs(self, restart)
      call verdict_save(self%verdict, restart)
      n = host_count(self%given)
      if (any(n > 0)) call restart_put(restart, "given", n)
      n(1) = host_count_conditions(self%given)
      if (n(1) > 0) call restart_put(restart, "given_conditions", n(:1))
   end subroutine stepper_save

   subroutine save_pairs(self, restart)
      type(stepper_t), intent(in) :: self
      type(restart_t), intent(inout) :: restart
      integer :: k

      associate (pairs => self%march%state%pairs)
         call restart_put(restart, "pair_force", pairs%force)
         call restart_put(restart, "pair_area", pairs%area)
         call restart_put(restart, "pair_total", reshape([(pairs%total(k)%slave, &
            pairs%total(k)%master, pairs%total(k)%length, k = 1, size(pairs%total))], &
            [7, size(pairs%total)]))
         call restart_put(restart, "pair_active", pairs%total%n_active)
      end associate
   end subroutine save_pairs

   !> Build the model of a restart file and put it into the state that was saved. Forces and mass
   !> are not in the file: `self` has to have them, given for the same deck.
   subroutine stepper_load(self, restart, error)
      type(stepper_t), intent(inout) :: self
      type(restart_t), intent(in) :: restart
      type(error_t), allocatable, intent(out) :: error
      type(diagnostics_t) :: diagnostics
      integer :: flag(1), progress(6)
      integer, allocatable :: active(:)
      real(wp) :: time(2)

      call check_given(self, restart, error)
      if (.not. allocated(error)) call load_source(self, restart, error)
      if (allocated(error)) return
      call restart_get(restart, "is_lenient", flag, error)
      if (allocated(error)) return
      self%is_lenient = flag(1) == 1
      diagnostics%file_name = self%source%file_name
      call stepper_read_source(self, diagnostics, error)
      if (.not. allocated(error)) call stepper_build(self, error)
      if (allocated(error)) return
      call restart_get(restart, "progress", progress, error)
      if (.not. allocated(error)) call restart_get(restart, "time", time, error)
      if (.not. allocated(error)) call load_fields(self, restart, error)
      if (.not. allocated(error)) call load_pairs(self, restart, error)
      if (allocated(error)) return
      allocate(active(size(self%march%state%is_active)))
      call restart_get(restart, "is_active", active, error)
      if (allocated(error)) return
      associate (state => self%march%state)
         state%is_active = active == 1
         state%i_step = progress(1)
         state%n_grid = progress(2)
         state%grid_stride = progress(3)
         state%n_easy = progress(4)
         state%increment = progress(5)
         state%n_before = progress(6)
         state%start_time = time(1)
         state%time = time(2)
      end associate
      call march_resume(self%march, self%scene, error)
      if (.not. allocated(error)) call load_measured(self, restart, error)
      if (.not. allocated(error)) call verdict_load(self%verdict, restart, error)
   end subroutine stepper_load

   !> What the last increment has measured: measured anew it would differ by roundings.
   subroutine load_measured(self, restart, error)
      type(stepper_t), intent(inout) :: self
      type(restart_t), intent(in) :: restart
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: value(10), potential(1)

      associate (state => self%march%state)
         call restart_get(restart, "internal", state%internal, error)
         if (.not. allocated(error)) call restart_get(restart, "energy", state%energy, error)
      end associate
      if (.not. allocated(error)) call restart_get(restart, "potential", potential, error)
      if (.not. allocated(error)) call restart_get(restart, "ledger", value, error)
      if (allocated(error)) return
      self%march%state%potential = potential(1)
      self%march%ledger = ledger_t(kinetic=value(1), strain=value(2), potential=value(3), &
         external_work=value(4), contact_work=value(5), total=value(6), momentum=value(7:8), &
         angular=value(9), stabilization=value(10))
   end subroutine load_measured

   !> What the model of the file was given, `self` has been given too.
   subroutine check_given(self, restart, error)
      type(stepper_t), intent(in) :: self
      type(restart_t), intent(in) :: restart
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: stored, own
      integer :: n(3), present(3)

      n = 0
      if (restart_size(restart, "given") > 0) call restart_get(restart, "given", n(:2), error)
      if (allocated(error)) return
      if (restart_size(restart, "given_conditions") > 0) call restart_get(restart, &
         "given_conditions", n(3:), error)
      if (allocated(error)) return
      present = [host_count(self%given), host_count_conditions(self%given)]
      if (all(n == present)) return
      call count_text(n, stored)
      call count_text(present, own)
      call raise(error, err_input, "the restart file is of a model with " // stored // &
         ", not with " // own // ": they are not in the file, read the deck " // &
         "and give them again before the restart file is loaded")
   end subroutine check_given

   pure subroutine count_text(n, text)
      integer, intent(in) :: n(3)                !! forces, masses, conditions
      character(len=:), allocatable, intent(out) :: text

      text = to_text(n(1)) // " given forces and " // to_text(n(2)) // " masses"
      if (n(3) > 0) text = text // " and " // to_text(n(3)) // " given conditions"
   end subroutine count_text

   subroutine load_source(self, restart, error)
      type(stepper_t), intent(inout) :: self
      type(restart_t), intent(in) :: restart
      type(error_t), allocatable, intent(out) :: error

      self%source = deck_source_t()
      call restart_get(restart, "deck_line", self%source%line, error)
      if (.not. allocated(error)) call restart_get(restart, "deck_file_name", &
         self%source%file_name, error)
      if (.not. allocated(error)) call restart_get(restart, "override", self%override, error)
      if (allocated(error)) return
      allocate(self%source%file(max(0, restart_size(restart, "deck_file"))))
      allocate(self%source%number(max(0, restart_size(restart, "deck_number"))))
      call restart_get(restart, "deck_file", self%source%file, error)
      if (.not. allocated(error)) call restart_get(restart, "deck_number", self%source%number, &
         error)
   end subroutine load_source

   subroutine load_fields(self, restart, error)
      type(stepper_t), intent(inout) :: self
      type(restart_t), intent(in) :: restart
      type(error_t), allocatable, intent(out) :: error

      associate (state => self%march%state)
         call restart_get(restart, "u", state%u, error)
         if (.not. allocated(error)) call restart_get(restart, "v", state%v, error)
         if (.not. allocated(error)) call restart_get(restart, "u_start", state%u_start, error)
         if (.not. allocated(error)) call restart_get(restart, "contact", state%contact, error)
         if (.not. allocated(error)) call restart_get(restart, "reaction", state%reaction, error)
         if (.not. allocated(error)) call restart_get(restart, "lam", state%lam, error)
      end associate
   end subroutine load_fields

   subroutine load_pairs(self, restart, error)
      type(stepper_t), intent(inout) :: self
      type(restart_t), intent(in) :: restart
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: total(7, size(self%march%state%pairs%total))
      integer :: k

      associate (pairs => self%march%state%pairs)
         call restart_get(restart, "pair_force", pairs%force, error)
         if (.not. allocated(error)) call restart_get(restart, "pair_area", pairs%area, error)
         if (.not. allocated(error)) call restart_get(restart, "pair_total", total, error)
         if (.not. allocated(error)) call restart_get(restart, "pair_active", &
            pairs%total%n_active, error)
         if (allocated(error)) return
         do k = 1, size(pairs%total)
            pairs%total(k)%slave = total(1:3, k)
            pairs%total(k)%master = total(4:6, k)
            pairs%total(k)%length = total(7, k)
         end do
      end associate
   end subroutine load_pairs

end module emcon_stepper
