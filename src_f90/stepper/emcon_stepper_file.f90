! build: holder
!> A stepper in a restart file: the deck, the state, and what its last increment has measured.
!>
!> What is exchanged is saved, or loaded; each array is named once, and keeps its bits.
module emcon_stepper_file
   use emcon_deck_further, only : further_append, further_t, further_until
   use emcon_deck_source, only : deck_source_t
   use emcon_diagnostics, only : diagnostics_t
   use emcon_element_kind, only : element_kind_t, find_element_kind
   use emcon_errors, only : err_input, error_t, raise
   use emcon_factor_base, only : factor_base_t
   use emcon_host, only : host_count, n_counted
   use emcon_kinds, only : wp
   use emcon_ledger, only : ledger_t
   use emcon_march, only : march_free, march_resume, march_t, march_watch
   use emcon_newton, only : interrupt_interface
   use emcon_pair_record, only : pair_components, pair_record_t
   use emcon_pair_sums, only : pair_sums_t
   use emcon_restart_data, only : restart_check, restart_exchange, restart_list, restart_offers, &
      restart_rewind, restart_size, restart_t
   use emcon_scene, only : scene_t
   use emcon_state, only : state_t
   use emcon_stepper, only : stepper_build, stepper_read_source, stepper_t
   use emcon_text, only : notes_t, to_text
   use emcon_verdict_file, only : verdict_exchange
   implicit none
   private
   public :: stepper_save, stepper_load

contains

   !> Put all that the next increment depends on into `restart`.
   subroutine stepper_save(self, restart)
      type(stepper_t), intent(inout) :: self         !! as it was
      type(restart_t), intent(out) :: restart
      integer :: n(n_counted)

      call exchange_source(self, restart)
      call exchange_state(self, restart)
      n = host_count(self%host)
      call exchange_given(restart, n)
   end subroutine stepper_save

   !> Build the model of a restart file and put it into the state that was saved. Forces and mass
   !> are not in the file: `self` has to have them, given for the same deck. What is refused leaves
   !> `self` as it was.
   subroutine stepper_load(self, restart, error, further)
      type(stepper_t), intent(inout) :: self
      type(restart_t), intent(inout) :: restart      !! as it was
      type(error_t), allocatable, intent(out) :: error
      type(further_t), intent(in), optional :: further   !! what it is to do beside
      type(deck_source_t) :: source
      type(scene_t) :: scene
      type(notes_t) :: notes
      real(wp), allocatable :: until(:)
      logical :: is_read

      if (allocated(self%march%scheme)) call raise(error, err_input, "the model is built already")
      if (allocated(error)) return
      source = self%source
      scene = self%scene
      notes = self%notes
      is_read = self%is_read
      if (allocated(self%until)) until = self%until
      call load(self, restart, error, further)
      if (.not. allocated(error)) return
      call march_free(self%march)
      call forget_march(self%march)
      self%source = source
      self%scene = scene
      self%notes = notes
      self%is_read = is_read
      call move_alloc(until, self%until)
   end subroutine stepper_load

   !> As if nothing had been built; who is asked whether to stop remains.
   subroutine forget_march(march)
      type(march_t), intent(inout) :: march
      procedure(interrupt_interface), pointer :: is_interrupted

      is_interrupted => march%newton%is_interrupted
      call clear(march)
      if (associated(is_interrupted)) call march_watch(march, is_interrupted)

   contains

      subroutine clear(march)
         type(march_t), intent(out) :: march     !! as it is by default

         march%revision = 0
      end subroutine clear

   end subroutine forget_march

   subroutine load(self, restart, error, further)
      type(stepper_t), intent(inout) :: self
      type(restart_t), intent(inout) :: restart
      type(error_t), allocatable, intent(out) :: error
      type(further_t), intent(in), optional :: further
      type(diagnostics_t) :: diagnostics
      type(element_kind_t), allocatable :: given(:)

      call restart_rewind(restart)
      call check_given(self, restart, error)
      if (allocated(error)) return
      self%source = deck_source_t()
      call exchange_source(self, restart)
      call restart_check(restart, error)
      if (allocated(error)) return
      if (present(further)) then
         if (allocated(further%path)) call further_append(self%source, further%path, error)
         if (allocated(error)) return
      end if
      diagnostics%file_name = self%source%file_name
      if (self%is_read) given = self%scene%element%kinds
      call stepper_read_source(self, diagnostics, error)
      if (allocated(given) &
         .and. .not. allocated(error)) call keep_shapes(self%scene%element%kinds, given)
      if (present(further) .and. .not. allocated(error)) then
         if (further%until > 0.0_wp) call take_until(self, further%until, error)
      end if
      if (.not. allocated(error)) call stepper_build(self, error)
      if (allocated(error)) return
      call exchange_state(self, restart)
      call restart_check(restart, error)
      if (allocated(error) .and. present(further)) then
         if (allocated(further%path)) call raise(error, err_input, further%path // ": its steps " &
            // "change the unknowns of the model, as do conditions along axes of a *TRANSFORM, " &
            // "on rotations of a *RIGID BODY or on ends of a *TIE where the run had none: begin " &
            // "anew with all steps in the deck")
      end if
      if (present(further) .and. .not. allocated(error)) call check_until(self, further%until, &
         error)
      if (.not. allocated(error)) call march_resume(self%march, self%scene, error)
      if (allocated(error)) return
      ! What the last increment has measured, measured anew, differs by roundings.
      call restart_rewind(restart)
      call exchange_state(self, restart)
   end subroutine load

   !> A later end lies ahead.
   subroutine check_until(self, until, error)
      type(stepper_t), intent(in) :: self
      real(wp), intent(in) :: until              !! 0: none was asked for [T]
      type(error_t), allocatable, intent(out) :: error

      associate (time => self%march%state%clock%time)
         if (until > 0.0_wp .and. .not. until > time) call raise(error, err_input, "--until " // &
            to_text(until) // ": the run is at time " // to_text(time) // " already")
      end associate
   end subroutine check_until

   subroutine exchange_source(self, restart)
      type(stepper_t), intent(inout) :: self
      type(restart_t), intent(inout) :: restart

      call restart_list(restart, "deck_line", self%source%line)
      call restart_list(restart, "deck_file", self%source%file)
      call restart_list(restart, "deck_number", self%source%number)
      call restart_list(restart, "deck_file_name", self%source%file_name)
      call restart_list(restart, "override", self%override)
      call restart_exchange(restart, "is_lenient", self%is_lenient)
      if (restart_offers(restart, "until", allocated(self%until))) then
         if (.not. allocated(self%until)) allocate(self%until(restart_size(restart, "until")))
         call restart_exchange(restart, "until", self%until)
      end if
   end subroutine exchange_source

   !> Let the last step end when it is asked to, as what is given beside the deck.
   subroutine take_until(self, until, error)
      type(stepper_t), intent(inout) :: self     !! read
      real(wp), intent(in) :: until              !! > 0 [T]
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: all(:)

      allocate(all(size(self%scene%step)), source=0.0_wp)
      if (allocated(self%until)) all(:size(self%until)) = self%until
      all(size(all)) = until
      call move_alloc(all, self%until)
      call further_until(self%scene, self%until, error)
   end subroutine take_until

   subroutine exchange_state(self, restart)
      type(stepper_t), intent(inout) :: self
      type(restart_t), intent(inout) :: restart

      call exchange_progress(self%march%state, restart)
      call exchange_ledger(self%march%ledger, restart)
      associate (state => self%march%state)
         call restart_exchange(restart, "energy", state%energy)
         call restart_exchange(restart, "potential", state%potential)
         call restart_exchange(restart, "u", state%u)
         call restart_exchange(restart, "v", state%v)
         call restart_exchange(restart, "u_start", state%u_start)
         call restart_exchange(restart, "contact", state%contact)
         if (restart_offers(restart, "friction", any(abs(state%friction) > 0.0_wp))) then
            call restart_exchange(restart, "friction", state%friction)
         else
            state%friction = 0.0_wp
         end if
         call restart_exchange(restart, "reaction", state%reaction)
         call restart_exchange(restart, "internal", state%internal)
         if (restart_offers(restart, "turned", size(state%turns%angle) > 0)) then
            call restart_exchange(restart, "turned", state%turns%angle)
            call restart_exchange(restart, "moment", state%turns%moment)
         end if
         call restart_exchange(restart, "lam", state%contacts%lam)
         call restart_exchange(restart, "is_active", state%contacts%is_active)
         if (restart_offers(restart, "closure", any(abs(state%contacts%closure) > 0.0_wp))) then
            call restart_exchange(restart, "closure", state%contacts%closure)
         else
            state%contacts%closure = 0.0_wp
         end if
         if (restart_offers(restart, "stretch", any(abs(state%contacts%stretch) > 0.0_wp))) then
            call restart_exchange(restart, "stretch", state%contacts%stretch)
         else
            state%contacts%stretch = 0.0_wp
         end if
         if (restart_offers(restart, "drag", size(state%contacts%drag) > 0)) then
            call exchange_directions(state, restart)
            call restart_exchange(restart, "drag", state%contacts%drag)
            call restart_exchange(restart, "slip", state%contacts%slip)
            call restart_exchange(restart, "slip_path", state%contacts%slip_path)
            if (restart_offers(restart, "slid", .true.)) call restart_exchange(restart, "slid", &
               state%contacts%slid)
         end if
         call exchange_past(state, restart)
         if (restart_offers(restart, "has_mass", &
            any(state%contacts%has_mass))) call restart_exchange( restart, "has_mass", &
            state%contacts%has_mass)
         call exchange_bounds(state, restart)
      end associate
      call exchange_base(self%march%state%base, self%march%state%u, restart)
      call exchange_pairs(self%march%state%pairs, restart)
      call exchange_sums(self%march%state%sums, restart)
      call verdict_exchange(self%verdict, restart)
      call exchange_control(self%march%state, restart)
   end subroutine exchange_state

   !> Where contacts slide to. Files of 0.4 have the sign of the one slip of the plane.
   subroutine exchange_directions(state, restart)
      type(state_t), intent(inout) :: state
      type(restart_t), intent(inout) :: restart
      integer :: way(size(state%contacts%slides_along, 2))

      if (restart_offers(restart, "sliding", .false.)) then
         call restart_exchange(restart, "sliding", way)
         state%contacts%slides_along(1, :) = real(way, wp)
      else
         call restart_exchange(restart, "slides_along", state%contacts%slides_along)
      end if
   end subroutine exchange_directions

   !> What bounds explicit steps.
   subroutine exchange_bounds(state, restart)
      type(state_t), intent(inout) :: state
      type(restart_t), intent(inout) :: restart

      if (restart_offers(restart, "critical_h", state%explicit%critical_h > 0.0_wp)) then
         call restart_exchange(restart, "critical_h", state%explicit%critical_h)
         call restart_exchange(restart, "critical_element", state%explicit%critical_element)
         call restart_exchange(restart, "budget", state%explicit%budget)
      else
         state%explicit%critical_h = 0.0_wp
      end if
   end subroutine exchange_bounds

   !> What the scheme looks back on.
   subroutine exchange_past(state, restart)
      type(state_t), intent(inout) :: state
      type(restart_t), intent(inout) :: restart

      if (restart_offers(restart, "load", state%history%has_past)) then
         if (.not. allocated(state%history%load)) allocate(state%history%load, mold=state%u)
         call restart_exchange(restart, "load", state%history%load)
         call restart_exchange(restart, "h_before", state%history%h_before)
         if (.not. allocated(state%history%past)) allocate(state%history%past(size(state%u, 1), &
            size(state%u, 2), restart_size(restart, "past")/size(state%u)))
         call exchange_fields()
         state%history%has_past = .true.
      end if

   contains

      subroutine exchange_fields()
         real(wp) :: flat(size(state%history%past))

         flat = reshape(state%history%past, shape(flat))
         call restart_exchange(restart, "past", flat)
         state%history%past = reshape(flat, shape(state%history%past))
      end subroutine exchange_fields

   end subroutine exchange_past

   subroutine exchange_progress(state, restart)
      type(state_t), intent(inout) :: state
      type(restart_t), intent(inout) :: restart

      call restart_exchange(restart, "progress", state%clock%i_step)
      call restart_exchange(restart, "progress", state%clock%n_grid)
      call restart_exchange(restart, "progress", state%clock%grid_stride)
      call restart_exchange(restart, "progress", state%clock%n_easy)
      call restart_exchange(restart, "progress", state%clock%increment)
      call restart_exchange(restart, "progress", state%clock%n_before)
      call restart_exchange(restart, "time", state%clock%start_time)
      call restart_exchange(restart, "time", state%clock%time)
   end subroutine exchange_progress

   !> What the sizes of increments follow; only in files of runs in which they do.
   subroutine exchange_control(state, restart)
      type(state_t), intent(inout) :: state
      type(restart_t), intent(inout) :: restart

      associate (control => state%control)
         if (.not. restart_offers(restart, "control", any(control%n_size > 0))) return
         call restart_exchange(restart, "control", state%clock%n_part)
         call restart_exchange(restart, "control", control%power)
         call restart_exchange(restart, "control", control%n_same)
         call restart_exchange(restart, "control", control%n_size)
         call restart_exchange(restart, "control", control%n_less)
         call restart_exchange(restart, "control", control%n_event)
         call restart_exchange(restart, "control", control%n_over)
         call restart_exchange(restart, "control_size", control%asked)
         call restart_exchange(restart, "control_size", control%ratio)
         call restart_exchange(restart, "control_size", control%h_before)
         call restart_exchange(restart, "control_size", control%largest_kinetic)
         if (.not. restart_offers(restart, "control_force", allocated(control%force))) return
         if (.not. allocated(control%force)) then
            allocate(control%force, mold=state%u)
            allocate(control%contact, mold=state%u)
            allocate(control%velocity, mold=state%u)
         end if
         call restart_exchange(restart, "control_force", control%force)
         call restart_exchange(restart, "control_contact", control%contact)
         call restart_exchange(restart, "control_velocity", control%velocity)
         call restart_exchange(restart, "control_size", control%span)
         call restart_exchange(restart, "control", control%n_known)
         if (.not. restart_offers(restart, "control_change", control%n_known > 1)) return
         if (.not. allocated(control%rate)) allocate(control%rate, mold=state%u)
         call restart_exchange(restart, "control_change", control%rate)
      end associate
   end subroutine exchange_control

   !> Of which motion the kept factor was made; where the file has none it is made anew.
   subroutine exchange_base(base, u, restart)
      type(factor_base_t), intent(inout) :: base
      real(wp), intent(in) :: u(:, :)                !! (n_dim, n_node) for its shape
      type(restart_t), intent(inout) :: restart
      integer :: yes

      yes = 1
      base%iterates_no_more = restart_offers(restart, "factor_complete", base%iterates_no_more)
      if (base%iterates_no_more) call restart_exchange(restart, "factor_complete", yes)
      if (.not. restart_offers(restart, "factor_u0", base%is_set)) return
      if (.not. base%is_set) base = factor_base_t(is_set=.true., &
         iterates_no_more=base%iterates_no_more)
      if (.not. allocated(base%u0)) then
         allocate(base%u0, source=u)
         allocate(base%du, source=u)
      end if
      call restart_exchange(restart, "factor_made", base%increment)
      call restart_exchange(restart, "factor_least", base%n_least)
      call restart_exchange(restart, "factor_excess", base%n_excess)
      call restart_exchange(restart, "factor_time", base%start%step_time)
      call restart_exchange(restart, "factor_time", base%start%total_time)
      call restart_exchange(restart, "factor_time", base%start%h_before)
      call restart_exchange(restart, "factor_time", base%h)
      call restart_exchange(restart, "factor_u0", base%u0)
      call restart_exchange(restart, "factor_du", base%du)
   end subroutine exchange_base

   subroutine exchange_ledger(ledger, restart)
      type(ledger_t), intent(inout) :: ledger
      type(restart_t), intent(inout) :: restart

      call restart_exchange(restart, "ledger", ledger%kinetic)
      call restart_exchange(restart, "ledger", ledger%strain)
      call restart_exchange(restart, "ledger", ledger%potential)
      call restart_exchange(restart, "ledger", ledger%external_work)
      call restart_exchange(restart, "ledger", ledger%contact_work)
      call restart_exchange(restart, "ledger", ledger%total)
      call restart_exchange(restart, "ledger", ledger%momentum)
      call restart_exchange(restart, "ledger", ledger%angular)
      call restart_exchange(restart, "ledger", ledger%stabilization)
      if (restart_offers(restart, "restitution", is_written=ledger%restitution > 0.0_wp)) then
         call restart_exchange(restart, "restitution", ledger%restitution)
      else
         ledger%restitution = 0.0_wp
      end if
      if (restart_offers(restart, "tie_couple", allocated(ledger%tie_couple%impulse))) then
         if (.not. allocated(ledger%tie_couple%impulse)) allocate(ledger%tie_couple%impulse, &
            mold=ledger%angular)
         call restart_exchange(restart, "tie_couple", ledger%tie_couple%largest)
         call restart_exchange(restart, "tie_couple", ledger%tie_couple%angular)
         call restart_exchange(restart, "tie_couple", ledger%tie_couple%impulse)
      end if
      if (restart_offers(restart, "decay", is_written=abs(ledger%decay) > 0.0_wp)) then
         call restart_exchange(restart, "decay", ledger%decay)
      else
         ledger%decay = 0.0_wp
      end if
      if (restart_offers(restart, "damping", is_written=abs(ledger%damping) > 0.0_wp)) then
         call restart_exchange(restart, "damping", ledger%damping)
      else
         ledger%damping = 0.0_wp
      end if
      if (restart_offers(restart, "friction", is_written=abs(ledger%friction) > 0.0_wp)) then
         call restart_exchange(restart, "friction", ledger%friction)
      else
         ledger%friction = 0.0_wp
      end if
      if (restart_offers(restart, "contact_damping", &
         is_written=abs(ledger%contact_damping) > 0.0_wp)) then
         call restart_exchange(restart, "contact_damping", ledger%contact_damping)
      else
         ledger%contact_damping = 0.0_wp
      end if
      if (restart_offers(restart, "stored", is_written=ledger%contact_energy > 0.0_wp)) then
         call restart_exchange(restart, "stored", ledger%contact_energy)
      else
         ledger%contact_energy = 0.0_wp
      end if
   end subroutine exchange_ledger

   subroutine exchange_pairs(pairs, restart)
      type(pair_record_t), intent(inout) :: pairs
      type(restart_t), intent(inout) :: restart
      real(wp) :: none(0)
      integer :: k, n

      n = pair_components(pairs)
      call restart_exchange(restart, "pair_force", pairs%force)
      call restart_exchange(restart, "pair_area", pairs%area)
      if (restart_offers(restart, "pair_shear_area", any(abs(pairs%shear_area - pairs%area) &
         > 0.0_wp))) then
         call restart_exchange(restart, "pair_shear_area", pairs%shear_area)
      else
         pairs%shear_area = pairs%area
      end if
      call restart_exchange(restart, "pair_total", none)     ! also where there are no pairs
      do k = 1, size(pairs%total)
         call restart_exchange(restart, "pair_total", pairs%total(k)%slave(:n))
         call restart_exchange(restart, "pair_total", pairs%total(k)%master(:n))
         call restart_exchange(restart, "pair_total", pairs%total(k)%covered)
      end do
      call restart_exchange(restart, "pair_active", pairs%total%n_active)
      if (restart%is_reading .and. allocated(pairs%jump)) deallocate(pairs%jump, pairs%jump_lam, &
         pairs%jump_drag)
      if (.not. restart_offers(restart, "pair_jump", allocated(pairs%jump))) return
      if (restart%is_reading) allocate(pairs%jump_lam(size(pairs%area)), &
         pairs%jump_drag(size(pairs%force, 1) - 1, size(pairs%area)), &
         pairs%jump(size(pairs%force, 1), restart_size(restart, "pair_jump")/size(pairs%force, 1)))
      call restart_exchange(restart, "pair_jump", pairs%jump)
      call restart_exchange(restart, "pair_jump_lam", pairs%jump_lam)
      call restart_exchange(restart, "pair_jump_drag", pairs%jump_drag)
   end subroutine exchange_pairs

   !> Where the file has none they begin at 0.
   subroutine exchange_sums(sums, restart)
      type(pair_sums_t), intent(inout) :: sums
      type(restart_t), intent(inout) :: restart
      real(wp) :: none(0)
      integer :: k

      if (.not. restart_offers(restart, "pair_sum", is_written=.true.)) return
      call restart_exchange(restart, "pair_sum", none)       ! also where there are no pairs
      do k = 1, size(sums%sum)
         call restart_exchange(restart, "pair_sum", sums%sum(k)%impulse)
         call restart_exchange(restart, "pair_sum", sums%sum(k)%duration)
         call restart_exchange(restart, "pair_sum", sums%sum(k)%push)
         call restart_exchange(restart, "pair_sum", sums%sum(k)%span)
         call restart_exchange(restart, "pair_sum", sums%sum(k)%weight)
         call restart_exchange(restart, "pair_sum", sums%sum(k)%moment)
      end do
      if (restart_offers(restart, "pair_friction", any(sums%sum%friction > 0.0_wp))) then
         do k = 1, size(sums%sum)
            call restart_exchange(restart, "pair_friction", sums%sum(k)%friction)
         end do
      end if
      if (.not. restart_offers(restart, "pair_damping", any(sums%sum%damping > 0.0_wp))) return
      do k = 1, size(sums%sum)
         call restart_exchange(restart, "pair_damping", sums%sum(k)%damping)
      end do
   end subroutine exchange_sums

   !> How many of each kind a model was given; the file says what is not 0.
   subroutine exchange_given(restart, n)
      type(restart_t), intent(inout) :: restart
      integer, intent(inout) :: n(n_counted)     !! as of `host_count`

      if (restart_offers(restart, "given", any(n(:2) > 0))) call restart_exchange(restart, &
         "given", n(:2))
      if (restart_offers(restart, "given_conditions", n(3) > 0)) call restart_exchange(restart, &
         "given_conditions", n(3))
      if (restart_offers(restart, "given_contact_law", n(4) > 0)) call restart_exchange(restart, &
         "given_contact_law", n(4))
   end subroutine exchange_given

   !> What the model of the file was given, `self` has been given too.
   subroutine check_given(self, restart, error)
      type(stepper_t), intent(in) :: self
      type(restart_t), intent(inout) :: restart
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: stored, own
      integer :: n(n_counted)

      n = 0
      call exchange_given(restart, n)
      call restart_check(restart, error)
      if (allocated(error) .or. all(n == host_count(self%host))) return
      call count_text(n, stored)
      call count_text(host_count(self%host), own)
      call raise(error, err_input, "the restart file is of a model with " // stored // &
         ", not with " // own // ": they are not in the file, read the deck " // &
         "and give them again before the restart file is loaded")
   end subroutine check_given

   pure subroutine count_text(n, text)
      integer, intent(in) :: n(n_counted)        !! as of `host_count`
      character(len=:), allocatable, intent(out) :: text

      text = to_text(n(1)) // " given forces and " // to_text(n(2)) // " masses"
      if (n(3) > 0) text = text // " and " // to_text(n(3)) // " given conditions"
      if (n(4) > 0) text = text // " and a given law of contact"
   end subroutine count_text

   !> Shapes that were given for elements of the deck hold for the deck of the file as well.
   subroutine keep_shapes(kind, given)
      type(element_kind_t), intent(inout) :: kind(:)   !! of the deck of the file
      type(element_kind_t), intent(in) :: given(:)     !! of the deck that was read before
      integer :: i, k

      do i = 1, size(kind)
         k = find_element_kind(given, kind(i)%name)
         if (k == 0 .or. allocated(kind(i)%shape)) cycle
         if (allocated(given(k)%shape)) allocate(kind(i)%shape, source=given(k)%shape)
      end do
   end subroutine keep_shapes

end module emcon_stepper_file
