! build: holder
!> The stepper: open a deck, step, query, save, go on. All state is in the object; any number of
!> steppers live side by side.
module emcon_stepper
   use emcon_blas, only : blas_is_shareable
   use emcon_deck, only : deck_read
   use emcon_deck_further, only : further_until
   use emcon_deck_user_scheme, only : take_user_schemes
   use emcon_deck_source, only : deck_open, deck_open_text, deck_source_t, passage_t
   use emcon_diagnostics, only : diagnostics_t, diagnostics_texts
   use emcon_discs_plane, only : discs_prepare
   use emcon_errors, only : err_input, err_interrupt, error_t, raise
   use emcon_host, only : host_t
   use emcon_host_check, only : host_check_scene
   use emcon_heap, only : heap_adapt
   use emcon_initial_contact, only : initial_contact_adjust, initial_contact_prepare
   use emcon_kinds, only : wp
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_is_done, march_set_threads, march_t
   use emcon_memory, only : memory_go_on, memory_scene, memory_t, memory_take
   use emcon_scene, only : scene_t
   use emcon_text, only : notes_append, notes_t, string_t, to_text
   use emcon_threads, only : threads_check, threads_default
   use emcon_tie_maps, only : tie_map_is_given
   use emcon_tie_moves, only : ties_move_nodes
   use emcon_ties, only : ties_prepare
   use emcon_verdict, only : verdict_start, verdict_t, verdict_update
   implicit none
   private
   public :: stepper_t, stepper_open, stepper_read, stepper_read_text, stepper_read_source, &
      stepper_build, stepper_advance, stepper_is_done
   public :: stepper_check_solids, stepper_close, stepper_fraction, stepper_set_threads

   type :: stepper_t
      type(scene_t) :: scene
      type(march_t) :: march
      type(host_t) :: host                      !! laws, forces and mass from outside
      type(deck_source_t) :: source              !! the deck as read, for restart files
      type(string_t), allocatable :: override(:) !! NAME=VALUE as given
      logical :: is_lenient = .false.
      real(wp), allocatable :: until(:)          !! total time at which steps end; 0: as they say
      logical :: is_read = .false.               !! `scene` is complete
      logical :: may_cut = .true.                !! a host can try a step again in smaller parts
      type(string_t), allocatable :: diagnostic(:)   !! errors and warnings of the deck
      type(notes_t) :: notes                     !! what was done before the first step
      type(verdict_t) :: verdict                 !! on the increments so far
      type(memory_t) :: memory                   !! of the deck and the scene
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

      call memory_go_on(self%memory)
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

      call memory_go_on(self%memory)
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
      call memory_take(self%memory, memory_scene)
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
      if (.not. (self%is_read .and. allocated(self%until))) return
      call further_until(self%scene, self%until, error)
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

      call take_user_schemes(self%march%host%scheme, self%scene, error)
      if (.not. (allocated(error) &
         .or. self%scene%host%is_whole)) call host_check_scene(self%host, self%scene, error)
      if (allocated(error)) return
      call discs_prepare(self%scene, self%notes)
      call ties_prepare(self%scene, self%notes, error)
      if (.not. allocated(error)) call prepare_contact(self, error)
      if (allocated(error)) return
      call march_init(self%march, self%scene, error, self%host)
      if (allocated(error)) return
      call march_set_threads(self%march, merge(threads_default(), 1, blas_is_shareable()))
      call march_begin_step(self%march, self%scene, 1, error)
      if (allocated(error)) return
      call notes_append(self%notes, self%march%system%notes)
      call verdict_start(self%verdict, self%march)
   end subroutine build

   !> Let `n` threads work on the model from here on; before, OMP_NUM_THREADS do, or one if that is
   !> not set. The bits are the same for any number.
   subroutine stepper_set_threads(self, n, error)
      type(stepper_t), intent(inout) :: self     !! built
      integer, intent(in) :: n
      type(error_t), allocatable, intent(out) :: error

      call threads_check(n, error)
      if (n > 1 .and. .not. (allocated(error) .or. blas_is_shareable())) call raise(error, &
         err_input, to_text(n) // " threads: the OpenBLAS in use is one that threads must not " // &
         "share; take that of libopenblas0-openmp or libopenblas0-pthread")
      if (.not. allocated(error)) call march_set_threads(self%march, n)
   end subroutine stepper_set_threads

   subroutine prepare_contact(self, error)
      type(stepper_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: before(:, :)

      if (self%scene%host%is_whole) then
         call initial_contact_adjust(self%scene, self%notes, error)
         return
      end if
      if (any(tie_map_is_given(self%scene%tie%map))) allocate(before, source=self%scene%x)
      call initial_contact_prepare(self%scene, self%notes, error, self%host)
      if (.not. allocated(error)) call ties_move_nodes(self%scene, self%notes, error, before)
   end subroutine prepare_contact

   !> Free what libraries hold for `self`; call it before the object goes, also after an error.
   subroutine stepper_close(self)
      type(stepper_t), intent(inout) :: self

      call march_free(self%march)
   end subroutine stepper_close

   !> True after the last increment of the last step.
   pure logical function stepper_is_done(self)
      type(stepper_t), intent(in) :: self

      stepper_is_done = self%march%state%clock%i_step >= size(self%scene%step) &
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
         call march_begin_step(self%march, self%scene, self%march%state%clock%i_step + 1, error)
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
      type(error_t), allocatable, intent(inout) :: error   !! of an earlier check: nothing is done

      if (self%scene%host%is_whole .and. .not. allocated(error)) call raise(error, err_input, &
         "the model has no solids and no deck: its host makes the steps")
   end subroutine stepper_check_solids

   !> Part of the analysis that is done, by time: 0..1.
   pure real(wp) function stepper_fraction(self)
      type(stepper_t), intent(in) :: self

      stepper_fraction = min(1.0_wp, self%march%state%clock%time/sum(self%scene%step%time%duration))
   end function stepper_fraction

end module emcon_stepper
