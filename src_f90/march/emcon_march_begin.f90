!> The beginning of a step of the deck: unknowns, scheme, solver and contact, and whether all that
!> moves is held.
module emcon_march_begin
   use emcon_active_set, only : active_set_overclosure, active_set_suit, active_set_t
   use emcon_correction, only : correction_reset, correction_take_modes
   use emcon_errors, only : err_analysis, err_input, error_t, raise
   use emcon_explicit, only : explicit_prepare
   use emcon_factor_base, only : factor_base_t
   use emcon_guards, only : touching_bar
   use emcon_contact_law, only : contact_laws_suit
   use emcon_contact_support, only : contact_support_begin, contact_support_t
   use emcon_near_laws, only : near_laws_begin_step
   use emcon_host, only : host_find_solver
   use emcon_host_scheme, only : host_scheme_find
   use emcon_friction, only : friction_suit
   use emcon_interactions, only : contact_options_t, pair_acts, pair_begins, pair_first_step, &
      pair_is_reverse_of
   use emcon_overlap_check, only : overlap_check_excuse, overlap_check_smooth, overlap_check_step, &
      overlap_t
   use emcon_kinds, only : wp
   use emcon_layer, only : layer_begin_step, layer_count, layer_share, layer_mark
   use emcon_ledger, only : ledger_measure, ledger_t
   use emcon_overlap_query, only : overlap_text
   use emcon_march_accuracy, only : accuracy_begin
   use emcon_march_grid, only : march_count_grid, march_grid_time, march_part_time
   use emcon_march_past, only : march_past_forget
   use emcon_march_types, only : march_t
   use emcon_mass_return, only : mass_match
   use emcon_mechanism_text, only : free_motion_text
   use emcon_motion, only : at_rest, motion_of, motion_t
   use emcon_newton, only : newton_init
   use emcon_numbering, only : spread_dependent
   use emcon_overclosure, only : overclosure_follow_arcs
   use emcon_evaluation, only : evaluation_at_end
   use emcon_quasi_static, only : quasi_static_begin, quasi_static_hold
   use emcon_rigid_modes, only : rigid_modes
   use emcon_scene, only : scene_t, where_text
   use emcon_scheme_registry, only : scheme_create, scheme_user
   use emcon_penalty, only : penalty_begin_step, penalty_free, penalty_start
   use emcon_solver_registry, only : solver_user
   use emcon_start_overlap, only : start_overlap_check
   use emcon_state, only : state_t
   use emcon_step_control, only : control_begin
   use emcon_steps, only : initiation_massless, initiation_persistent, method_null_space, &
      method_penalty, method_saddle_point, newton_kept, step_initiation, step_is_dynamic, step_t
   use emcon_system, only : system_begin_step, system_check_response, system_find_energy, &
      system_respond
   use emcon_term, only : role_internal
   use emcon_text, only : note_add, to_text
   use emcon_unresolved_rows, only : report_unresolved
   use emcon_velocity_mass, only : velocity_update_reset
   implicit none
   private
   public :: march_begin_step, march_resume, march_renumber

   !> So a warning of bodies begins that overlap from then on, since no pair brings them together.
   character(len=*), parameter, public :: overlap_at_start = "bodies overlap as a step begins"
   !> Fields in a deck are rounded by less than this part of their largest value.
   real(wp), parameter :: deck_rounding = 1.0e-6_wp
   !> An interference that is known less well than to this part is told.
   real(wp), parameter :: doubtful = 0.1_wp

contains

   !> Begin step `i_step` of the deck from the present state.
   subroutine march_begin_step(self, scene, i_step, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! from 1
      type(error_t), allocatable, intent(out) :: error

      self%state%clock%i_step = i_step
      self%state%clock%n_grid = 0
      self%state%clock%n_part = 0
      call control_begin(self%state%control)
      self%state%clock%is_off_grid = .false.
      self%state%clock%grid_stride = 1
      self%state%clock%n_easy = 0
      self%state%clock%n_before = self%state%clock%increment
      self%state%clock%start_time = self%state%clock%time
      self%state%explicit%critical_h = 0.0_wp
      call march_past_forget(self%state)
      if (.not. step_is_dynamic(scene%step(i_step))) self%state%v = 0.0_wp
      call release_contact(self, scene)
      call system_begin_step(self%system, scene, i_step, error)
      if (.not. allocated(error)) call report_unresolved(scene, self%system, self%state%u, &
         self%system%notes, error)
      if (allocated(error)) return
      call follow_links(self, scene)
      self%state%u_start = self%state%u
      call check_held(self, scene, error)
      if (allocated(error)) return
      call prepare(self, scene, error)
      if (.not. allocated(error)) call begin_pairs(self, scene, error)
      if (.not. allocated(error)) call quasi_static_begin(self, scene)
   end subroutine march_begin_step

   !> Contact that does not act in the step lets go. What it has stored goes out of the system, as
   !> work of whoever takes it away.
   subroutine release_contact(self, scene)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      real(wp) :: energy
      integer :: k

      do k = 1, size(self%system%contact)
         if (pair_acts(scene%pair(abs(self%system%contact(k)%of_pair)), &
            self%state%clock%i_step)) cycle
         associate (first => self%system%first_constraint(k) + 1, &
               last => self%system%first_constraint(k + 1))
            call penalty_free(self%active%penalty, self%system, k, self%state%contacts, energy)
            call self%state%contacts%release(first, last)
         end associate
         self%ledger%contact_energy = self%ledger%contact_energy - energy
         self%ledger%external_work = self%ledger%external_work - energy
      end do
   end subroutine release_contact

   !> Contact that begins to act with the step: bodies may not be in each other unless the step
   !> resolves that, and what it stores is work of whoever brings it.
   subroutine begin_pairs(self, scene, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: energy

      associate (i_step => self%state%clock%i_step, state => self%state)
         if (.not. any(pair_begins(scene%pair, i_step))) return
         if (.not. scene%step(i_step)%contact%resolves_overclosure) call start_overlap_check( &
            self, scene, pair_begins(scene%pair, i_step), error)
         if (allocated(error)) return
         call penalty_start(self%active%penalty, self%system, motion_of(evaluation_at_end, &
            scene%x, state%u, at_rest(state%u)), pair_begins(scene%pair, i_step), &
            .not. scene%step(i_step)%contact%resolves_overclosure, state%contacts%closure, energy)
      end associate
      self%ledger%contact_energy = self%ledger%contact_energy + energy
      self%ledger%external_work = self%ledger%external_work + energy
   end subroutine begin_pairs

   !> In statics no body may be free to move, in dynamics none without mass.
   subroutine check_held(self, scene, error)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: text

      associate (step => scene%step(self%state%clock%i_step))
         if (step_is_dynamic(step)) then
            call quasi_static_hold(self, scene, error)
            return
         end if
         call free_motion_text(self%system, scene, step%prescribed, text, u=self%state%u)
         if (len(text) > 0) call raise(error, err_analysis, "the static problem is singular: " &
            // text // "; add *BOUNDARY conditions")
      end associate
   end subroutine check_held

   !> Let displacements and velocities of dependent freedoms follow those of the others.
   subroutine follow_links(self, scene)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene

      if (.not. any(self%system%space%linear%is_used)) return
      call follow(self%state%u, "displacement")
      call follow(self%state%v, "velocity")

   contains

      subroutine follow(field, name)
         real(wp), intent(inout), contiguous :: field(:, :)      !! (n_dim, n_node)
         character(len=*), intent(in) :: name
         real(wp) :: change(size(field, 2)), largest
         integer :: i

         largest = maxval(abs(field))
         self%motion%du = field
         call spread_dependent(self%system%space%linked, field)
         change = maxval(abs(field - self%motion%du), 1)
         i = maxloc(change, 1)
         if (change(i) > deck_rounding*largest) call note_add(self%system%notes, "the " // name // &
            " at the start does not fit the ties and equations: dependent nodes follow the " // &
            "others, largest change " // to_text(change(i)) // " at node " // &
            to_text(scene%node%label(i)))
      end subroutine follow

   end subroutine follow_links

   !> Set up for the step that the state is in.
   subroutine march_resume(self, scene, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      logical :: has_changed

      call mass_match(self, scene, has_changed, error)
      if (.not. allocated(error)) call system_begin_step(self%system, scene, &
         self%state%clock%i_step, error)
      if (.not. allocated(error)) call prepare(self, scene, error)
   end subroutine march_resume

   !> Number the unknowns anew, as the boundary conditions of the step that the state is in have
   !> changed. The state and the ledger stay.
   subroutine march_renumber(self, scene, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      type(state_t) :: before
      type(ledger_t) :: ledger_before

      before = self%state
      ledger_before = self%ledger
      call system_begin_step(self%system, scene, self%state%clock%i_step, error)
      if (.not. allocated(error)) call report_unresolved(scene, self%system, self%state%u, &
         self%system%notes, error)
      if (.not. allocated(error)) call check_held(self, scene, error)
      self%state%explicit%critical_h = 0.0_wp
      if (.not. allocated(error)) call prepare(self, scene, error)
      before%explicit%critical_h = self%state%explicit%critical_h
      before%explicit%critical_element = self%state%explicit%critical_element
      self%state = before
      self%state%base = factor_base_t()
      self%ledger = ledger_before
   end subroutine march_renumber

   !> Scheme, solver and contact for the step that the system is in.
   subroutine prepare(self, scene, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error

      associate (step => scene%step(self%state%clock%i_step), state => self%state)
         call choose_scheme(self, step)
         call check_tolerance(self, scene, error)
         if (allocated(error)) return
         call newton_init(self%newton, self%system%space%numbering%n_unknown, &
            scene%x, step%solution%newton_tolerance, step%solution%newton_maximum)
         self%newton%convergence%polishes = step%solution%polishes
         call choose_solver(self, step)
         if (.not. step_is_dynamic(step)) call correction_take_modes(self%newton%correction, &
            rigid_modes(self%system%space%numbering, scene%x))
         state%base = factor_base_t()
         ! In statics it saves tangents with contact: their factors have more entries.
         self%newton%factor_policy%is_wanted = step%solution%newton == newton_kept .and. &
            (step_is_dynamic(step) .or. self%system%n_constraint > 0)
         call begin_active(self%active, step)
         call suit_laws(self)
         if (.not. step_is_dynamic(step)) call contact_support_begin(self%active%support, &
            self%system, scene, state%u)
         call configure_contact(self, scene)
         call penalty_begin_step(self%active%penalty, self%system, scene, step, error)
         if (allocated(error)) return
         if (state%clock%i_step == 1 .and. .not. state%clock%time > 0.0_wp) call penalty_start( &
            self%active%penalty, self%system, motion_of(evaluation_at_end, scene%x, state%u, &
            at_rest(state%u)), pair_acts(scene%pair, 1), &
            .not. step%contact%resolves_overclosure, state%contacts%closure, &
            self%ledger%contact_energy)
         call near_laws_begin_step(self%active%near_laws, self%system, scene, step)
         call begin_overclosure(self, scene, step)
         if (state%clock%i_step == 1 .and. .not. (state%clock%time > 0.0_wp &
            .or. step%contact%resolves_overclosure)) then
            call start_overlap_check(self, scene, pair_acts(scene%pair, 1), error)
            if (allocated(error)) return
         end if
         call begin_massless(self, scene, step, error)
         if (allocated(error)) return
         call begin_times(self, scene, step)
      end associate
      self%system%lagged%is_on = .false.
      call measure_start(self, scene%x, error)
      if (.not. allocated(error) .and. self%explicit%is_on) call explicit_prepare(self, &
         scene, error)
      if (allocated(error)) return
      call ledger_measure(self%ledger, self%system, scene%x, self%state)
      self%revision = self%revision + 1
   end subroutine prepare

   !> Contacts by the options of the step, or of their pairs. What is closed as the analysis begins,
   !> if that is to be resolved, says whether their gaps are those of arcs.
   subroutine configure_contact(self, scene)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(contact_options_t) :: options
      real(wp) :: change, interference
      integer :: i, first

      do i = 1, size(self%system%contact)
         options = scene%step(self%state%clock%i_step)%contact%options
         if (i <= size(scene%pair)) then
            if (scene%pair(i)%has_options) options = scene%pair(i)%options
         end if
         associate (contact => self%system%contact(i)%contact, &
               pair => scene%pair(abs(self%system%contact(i)%of_pair)))
            contact%step%is_idle = .not. pair_acts(pair, self%state%clock%i_step)
            contact%clearance = 0.0_wp
            call contact%suit_steps(any(.not. step_is_dynamic(scene%step)))
            call contact%configure(scene%x, options)
            first = pair_first_step(pair)
            if (contact%step%is_idle .and. i <= size(scene%pair)) call tell_idle(self, scene, i)
            if (contact%step%is_idle) cycle
            if (.not. scene%step(first)%contact%resolves_overclosure) cycle
            call overclosure_follow_arcs(contact, scene%x, scene%u0, options, change, &
               interference)
         end associate
         if (i > size(scene%pair) .or. .not. change > 0.0_wp &
            .or. self%state%clock%i_step > first) cycle
         call tell_curves(self, scene, i, change, interference)
      end do
   end subroutine configure_contact

   !> Say that a pair does not act in the step.
   subroutine tell_idle(self, scene, i)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i                   !! 1 to the number of pairs

      associate (pair => scene%pair(i))
         if (any(pair_is_reverse_of(scene%pair(:i - 1), pair))) return
         call note_add(self%system%notes, "contact of surfaces " // &
            scene%surface(pair%slave)%name // " and " // scene%surface(pair%master)%name // &
            " does not act in this step")
      end associate
   end subroutine tell_idle

   !> Say that gaps of a pair follow arcs, and where that is not known well enough.
   subroutine tell_curves(self, scene, i, change, interference)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i                   !! 1 to the number of pairs
      real(wp), intent(in) :: change             !! of a gap [L]
      real(wp), intent(in) :: interference       !! between the arcs [L]
      real(wp) :: doubt

      associate (pair => scene%pair(i))
         associate (names => scene%surface(pair%slave)%name // " and " // &
               scene%surface(pair%master)%name)
            call note_add(self%system%notes, "surfaces " // names // ": gaps are " // &
               "measured between the curves through the nodes, for *CONTACT INTERFERENCE, not " // &
               "between straight edges: that changes them by up to " // to_text(change, 3) // &
               ", and the interference is " // to_text(interference, 3))
            doubt = self%system%contact(i)%contact%curve_doubt()
            if (doubt > doubtful*interference) call note_add(self%warnings, "surfaces " // names &
               // ": the interference of " // to_text(interference, 3) // " is small compared " // &
               "with the distance of faces from the curves, and may be wrong by " // &
               "" // to_text(doubt, 2) // &
               "; use smaller faces, or meshes whose nodes meet")
         end associate
      end associate
   end subroutine tell_curves

   !> What is closed at the start, and what of it the step is to resolve.
   subroutine begin_overclosure(self, scene, step)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(step_t), intent(in) :: step
      type(overlap_t) :: overlap

      call active_set_overclosure(self%active, self%system, scene%x, self%state%u_start, &
         step%contact%resolves_overclosure)
      self%overlap_check%meant_overlap = 0.0_wp
      call self%overlap_check%query%take_pairs(pair_acts(scene%pair, self%state%clock%i_step))
      call overlap_check_smooth(self%overlap_check, scene, step%contact%options)
      call overlap_check_excuse(self%overlap_check, scene%x, self%state%u_start, overlap)
      if (overlap%depth > touching_bar) call warn_of_overlap(self, scene, overlap)
      if (.not. step%contact%resolves_overclosure) return
      call overlap_check_step(self%overlap_check, scene%x, self%state%u_start, &
         at_rest(self%state%u), overlap)
      self%overlap_check%meant_overlap = overlap%depth
   end subroutine begin_overclosure

   !> Bodies that overlap as a step begins, and no pair brings together: they stay so.
   subroutine warn_of_overlap(self, scene, overlap)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(overlap_t), intent(in) :: overlap
      character(len=:), allocatable :: text, which

      call overlap_text(overlap, scene%node%label, self%system%space%body, text)
      which = "*CONTACT PAIR"
      if (self%overlap_check%query%has_idle()) which = which // " that acts"
      call note_add(self%warnings, overlap_at_start // ", by " // to_text(overlap%depth, 3) // &
         " of an edge, " // text // ": no " // which // " names the two, and their " // &
         "overlap is not checked from here on")
   end subroutine warn_of_overlap

   !> The grid of the step, who controls sizes on it, and the time where it is taken up.
   subroutine begin_times(self, scene, step)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(step_t), intent(in) :: step

      call march_count_grid(self, step)
      if (self%grid%is_controlled .and. step%time%tolerance > 0.0_wp) call accuracy_begin(self, &
         scene)
      associate (state => self%state)
         if (.not. state%clock%is_off_grid) state%clock%step_time &
            = march_grid_time(self, step, state%clock%n_grid)
         if (state%clock%n_part > 0) state%clock%step_time = march_part_time(self, step, &
            state%clock%n_grid*self%grid%n_unit + state%clock%n_part)
      end associate
   end subroutine begin_times

   !> Internal forces and energies at the displacements that the step starts from.
   subroutine measure_start(self, x, error)
      type(march_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)        !! (n_dim, n_node) [L]
      type(error_t), allocatable, intent(inout) :: error
      type(motion_t) :: place

      place = motion_of(evaluation_at_end, x, self%state%u, at_rest(self%state%u))
      call system_respond(self%system, place, .false.)
      call system_check_response(self%system, "at the start of the step", error)
      if (allocated(error)) return
      call system_find_energy(self%system, place)
      self%state%internal = self%system%response%part(role_internal)%force
      self%state%energy = self%system%response%energy
      self%state%potential = self%system%response%potential
   end subroutine measure_start

   !> How contact begins and ends in a step.
   subroutine begin_active(active, step)
      type(active_set_t), intent(inout) :: active
      type(step_t), intent(in) :: step

      active%rules%puts_off = .true.
      call active_set_suit(active, step)
      active%rules%holds_gap = any(step_initiation(step) == [initiation_persistent, &
         initiation_massless]) .and. step%contact%method /= method_penalty
      active%rules%closes = .false.
      active%support = contact_support_t()
   end subroutine begin_active

   !> Laws of contact as they are in the step.
   subroutine suit_laws(self)
      type(march_t), intent(inout) :: self
      integer :: k

      do k = 1, size(self%system%contact)
         call contact_laws_suit(self%system%contact(k)%contact%laws, self%state%clock%i_step)
      end do
      call friction_suit(self%active%friction, self%system)
   end subroutine suit_laws

   !> Set up the layer of massless nodes for a dynamic step, and tell how many there are.
   subroutine begin_massless(self, scene, step, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(step_t), intent(in) :: step
      type(error_t), allocatable, intent(out) :: error
      logical :: is_slave(size(scene%x, 2))
      character(len=:), allocatable :: moved, left
      real(wp) :: share
      integer :: i, n, body

      if (step_initiation(step) /= initiation_massless) return
      call warn_of_mass(self, scene)
      if (self%layer%is_on) then
         call layer_mark(self%layer, self%system, self%active%rules%closes)
         call layer_begin_step(self%layer, step, self%system, error)
      end if
      if (allocated(error)) return
      is_slave = .false.
      do i = 1, self%system%n_pair
         if (scene%pair(i)%initiation == initiation_persistent) cycle
         is_slave(self%system%contact(i)%contact%node) = .true.
      end do
      n = layer_count(self%layer, is_slave)
      moved = ""
      call layer_share(self%layer, self%system, share, body)
      if (body > 0) moved = "; " // to_text(100.0_wp*share, 2) // " % of the mass of body " // &
         to_text(body) // " moves into its interior, of other bodies less"
      left = ""
      if (count(is_slave) > n) left = "; " // to_text(count(is_slave) - n) // &
         " slave nodes keep theirs: they are prescribed, tied or given mass, or too few " // &
         "neighbours hold them"
      call note_add(self%system%notes, "contact surfaces without mass: " // to_text(n) // &
         " nodes" // moved // left)
   end subroutine begin_massless

   !> Tell of pairs whose surfaces were to be massless and are not; one side of two is enough.
   subroutine warn_of_mass(self, scene)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      logical :: sheds(self%system%n_pair)
      integer :: i

      if (allocated(scene%deck%keeps_mass)) return       ! nobody has asked for it
      do i = 1, self%system%n_pair
         sheds(i) = any(self%massless%may_be(self%system%contact(i)%contact%node))
      end do
      do i = 1, self%system%n_pair
         associate (pair => scene%pair(i))
            if (pair%initiation == initiation_persistent) cycle
            if (any(sheds .and. (scene%pair%slave == pair%slave .or. &
               scene%pair%slave == pair%master .and. scene%pair%master == pair%slave))) cycle
            call note_add(self%warnings, "the surface " // scene%surface(pair%slave)%name // &
               " of a contact pair keeps its mass in spite of TYPE=MASSLESS: it is prescribed, " &
               // "tied, rigid, given mass or forces, or held by too few other nodes")
         end associate
      end do
   end subroutine warn_of_mass

   !> What solves the systems of the step: a solver of EMCON, or one that was given.
   subroutine choose_solver(self, step)
      type(march_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      integer :: i, method

      method = merge(method_null_space, method_saddle_point, self%system%space%is_reduced)
      if (step%solution%solver /= solver_user) then
         call correction_reset(self%newton%correction, method, step%solution%solver)
         call velocity_update_reset(self%velocity_update, step%solution%solver)
      else
         i = host_find_solver(self%host%solver, step%solution%solver_name)
         call correction_reset(self%newton%correction, method, solver_user + i, &
            self%host%solver(i)%solver)
         call velocity_update_reset(self%velocity_update, solver_user + i, &
            self%host%solver(i)%solver)
      end if
   end subroutine choose_solver

   !> Increments can follow the error of a scheme that tells it.
   subroutine check_tolerance(self, scene, error)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error

      associate (step => scene%step(self%state%clock%i_step))
         if (.not. step_is_dynamic(step) .or. .not. step%time%tolerance > 0.0_wp) return
         if (self%scheme%error_constant() > 0.0_wp) return
         call raise(error, err_input, where_text(scene, step%time%tolerance_origin) &
            // ": error: TOLERANCE= needs a scheme with an estimate of its error; use " // &
            "SCHEME=ENERGY MOMENTUM")
      end associate
   end subroutine check_tolerance

   !> The scheme of a step: of its row, or one that was given.
   subroutine choose_scheme(self, step)
      type(march_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      integer :: k

      if (step%scheme%code == scheme_user) then
         k = host_scheme_find(self%host%scheme, step%choice%name)
         call scheme_create(step%scheme, self%scheme, self%host%scheme(k)%scheme)
      else
         call scheme_create(step%scheme, self%scheme)
      end if
      self%explicit%is_on = self%scheme%row%is_explicit
   end subroutine choose_scheme

end module emcon_march_begin
