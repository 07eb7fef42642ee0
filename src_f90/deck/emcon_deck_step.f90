!> The steps: *STEP, its procedure, its settings, and all that holds in it.
!>
!> Settings (constraint method, contact initiation, mortar, smoothing, Newton, restart) stay until a
!> later step changes them.
module emcon_deck_step
   use emcon_amplitudes, only : amplitude_t
   use emcon_corners, only : corners_find
   use emcon_deck_conditions, only : conditions_carry, conditions_init, conditions_store, &
      conditions_t
   use emcon_deck_contact_damping, only : check_contact_damping
   use emcon_deck_contact_settings, only : check_massless, check_restitution, check_statics, &
      pairs_ask, read_controls, read_initiation, read_interference
   use emcon_deck_damping, only : check_damping
   use emcon_deck_element_loads, only : read_dload, read_dsload
   use emcon_deck_explicit, only : check_explicit_cards, choose_implicit, suit_explicit
   use emcon_deck_friction, only : check_friction
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, get_real, is_blank, &
      next_line
   use emcon_deck_initiation, only : choose_initiation
   use emcon_deck_increments, only : check_increments, read_events, read_tolerance
   use emcon_deck_loads, only : read_boundary, read_cload
   use emcon_deck_mortar, only : read_mortar, read_smoothing
   use emcon_deck_options, only : choose_option
   use emcon_deck_output, only : is_output, read_output, requests_init, requests_t
   use emcon_deck_turns, only : read_turns
   use emcon_deck_scheme, only : check_schemes, read_scheme
   use emcon_deck_pressure, only : soften_steps
   use emcon_deck_penalty, only : check_penalty, read_constraint_method
   use emcon_deck_reader, only : card_error, card_t, card_warning, has_option, n_cards, &
      option_count, option_name, option_number, option_real, option_word, reader_t, refuse_option
   use emcon_deck_turned, only : turn_conditions
   use emcon_diagnostics, only : add_error
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_options, only : option_default, option_words
   use emcon_origin, only : origin_t
   use emcon_scene, only : scene_t
   use emcon_scheme_registry, only : scheme_row
   use emcon_solver_registry, only : find_solver_row, is_foreign_solver, solver_user, &
      solver_names, solver_row, solver_row_t
   use emcon_steps, only : step_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: read_steps

   !> Increments of a step are counted in default integers, those that are cut too.
   real(wp), parameter :: most_increments = 0.5_wp*huge(1)
   character(len=*), parameter :: procedure_twice = "the step has a procedure already"
   !> Cards that set what their parameters name, and nothing else.
   character(len=*), parameter :: settings(*) = [character(len=17) :: "CONSTRAINTMETHOD", &
      "CONTACTINITIATION", "NEWTON", "TIMEINTEGRATION"]
   !> STABILIZE of *STATIC without a value, and at most.
   real(wp), parameter :: default_stabilization = 2.0e-4_wp, most_stabilization = 0.1_wp

contains

   !> All steps, after the model has been read.
   subroutine read_steps(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      type(conditions_t) :: conditions
      type(requests_t) :: requests
      type(step_t) :: last
      integer :: i, k, n_step
      real(wp) :: time

      n_step = 0
      call conditions_init(conditions, scene)
      call requests_init(requests)
      do i = 1, size(reader%card)
         n_step = max(n_step, reader%card(i)%step)
         if (reader%card(i)%step == 0 .and. reader%card(i)%name == "BOUNDARY") then
            call read_boundary(reader, reader%card(i), scene, conditions)
         end if
      end do
      allocate(scene%step(n_step))
      last%contact%initiation = option_default("initiation")
      scene%deck%only_checks = n_cards(reader, "NOANALYSIS") > 0
      time = 0.0_wp
      do i = 1, size(reader%card)
         if (reader%card(i)%step == 0 .and. reader%card(i)%name == "RESTART") call read_restart( &
            reader, reader%card(i), last)
      end do
      i = 1
      do k = 1, n_step
         do while (reader%card(i)%step < k)
            i = i + 1
         end do
         call inherit(last, scene%step(k))
         scene%step(k)%origin = reader%card(i)%origin
         call read_settings(reader, i, scene%pair, scene%amplitude, scene%step(k))
         call conditions_carry(conditions, scene%amplitude, last, time)
         if (k > 1) time = time + last%time%duration
         call read_conditions(reader, i, scene, conditions, requests)
         call conditions_store(conditions, scene%n_dim, scene%step(k))
         scene%step(k)%output = requests%output
         last = scene%step(k)
      end do
      call read_turns(reader, scene)
      call turn_conditions(reader, scene)
      call choose_initiation(reader, scene)
      call pairs_ask(reader, scene%pair, scene%step)
      call soften_steps(reader, scene%pair, scene%step)
      call suit_explicit(reader, scene%pair, scene%step)
      call check_massless(reader, scene%step)
      call check_schemes(reader, scene%pair, scene%step)
      call check_restitution(reader, scene%pair, scene%step)
      call check_penalty(reader, scene%pair, scene%step)
      call check_damping(reader, scene)
      call check_friction(reader, scene)
      call check_contact_damping(reader, scene%pair, scene%step)
      call corners_find(scene)
      if (n_step == 0 .and. .not. reader%doubt%names) then
         call add_error(reader%log, origin_t(1, 0), "the deck has no *STEP: nothing is to be done")
      end if
   end subroutine read_steps

   !> What stays set from one step to the next.
   subroutine inherit(last, step)
      type(step_t), intent(in) :: last
      type(step_t), intent(out) :: step

      step%nlgeom = last%nlgeom
      step%contact%method = last%contact%method
      step%contact%penalty = last%contact%penalty
      step%contact%initiation = last%contact%initiation
      step%contact%gap_tolerance = last%contact%gap_tolerance
      step%contact%options = last%contact%options
      step%stabilizes = last%stabilizes
      step%solution%newton = last%solution%newton
      step%solution%newton_tolerance = last%solution%newton_tolerance
      step%solution%newton_maximum = last%solution%newton_maximum
      step%solution%polishes = last%solution%polishes
      step%restart_frequency = last%restart_frequency
      step%choice = last%choice
      step%time%tolerance = last%time%tolerance
      step%time%tolerance_origin = last%time%tolerance_origin
      step%time%event_fraction = last%time%event_fraction
      step%time%events = last%time%events
   end subroutine inherit

   !> Procedure and settings of the step whose first card is `i_first`.
   subroutine read_settings(reader, i_first, pair, amplitude, step)
      type(reader_t), intent(inout) :: reader
      integer, intent(in) :: i_first
      type(contact_pair_t), intent(in) :: pair(:)
      type(amplitude_t), intent(in) :: amplitude(:)
      type(step_t), intent(inout) :: step
      integer :: i

      do i = i_first, size(reader%card)
         if (reader%card(i)%step /= reader%card(i_first)%step) then
            if (reader%card(i)%step > 0) exit
            cycle
         end if
         associate (card => reader%card(i))
            if (size(card%option) == 0 .and. any(settings == card%name)) call card_warning(reader, &
               card, "without a parameter it has no effect")
            select case (card%name)
            case ("STATIC", "DYNAMIC")
               call read_procedure(reader, card, step)
            case ("NOANALYSIS")
               if (step%scheme%code /= 0) call card_error(reader, card, procedure_twice)
               step%scheme = scheme_row("STATIC", "")
            case ("CONSTRAINTMETHOD")
               call read_constraint_method(reader, card, step)
            case ("CONTACTINITIATION")
               call read_initiation(reader, card, step)
            case ("CONTACTINTERFERENCE")
               call read_interference(reader, card, pair, amplitude, step)
            case ("CONTACTCONTROLS")
               call read_controls(reader, card, pair, step)
            case ("MORTAR")
               call read_mortar(reader, card, pair, step%contact%options)
            case ("SURFACESMOOTHING")
               call read_smoothing(reader, card, pair, step%contact%options)
            case ("NEWTON")
               call read_newton(reader, card, step)
            case ("TIMEINTEGRATION")
               call read_scheme(reader, card, step)
               call read_tolerance(reader, card, step)
            case ("EVENTS")
               call read_events(reader, card, step)
            case ("RESTART")
               call read_restart(reader, card, step)
            end select
         end associate
      end do
      call choose_implicit(step)
      call read_step_card(reader, reader%card(i_first), step)
      call check_statics(reader, i_first, amplitude, step)
      call check_explicit_cards(reader, i_first, step)
      call check_increments(reader, i_first, step)
      if (step%scheme%code /= 0 .or. reader%doubt%names) return
      if (.not. has_refused(reader, i_first)) call card_error(reader, reader%card(i_first), &
         "the step has no procedure: *STATIC or *DYNAMIC")
   end subroutine read_settings

   !> Whether a card after `i_first`, before the next step, was refused: it may be the procedure.
   pure logical function has_refused(reader, i_first)
      type(reader_t), intent(in) :: reader
      integer, intent(in) :: i_first
      integer :: i

      has_refused = .false.
      do i = i_first + 1, size(reader%card)
         if (reader%card(i)%name == "STEP") return
         has_refused = has_refused .or. (reader%card(i)%name == "" &
            .and. .not. reader%card(i)%is_idle)
      end do
   end function has_refused

   subroutine read_step_card(reader, card, step)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(step_t), intent(inout) :: step
      character(len=:), allocatable :: word

      call option_count(reader, card, "INC", 1, step%time%max_increments)
      if (has_option(card, "NLGEOM")) then
         call option_word(reader, card, "NLGEOM", "YES, NO", word)
         if (word == "NO" .and. step%nlgeom) call card_warning(reader, card, &
            "NLGEOM=NO has no effect: an earlier step has set NLGEOM, and it stays")
         step%nlgeom = step%nlgeom .or. word == "YES"
      end if
      select case (option_name(card, "AMPLITUDE"))
      case ("")
         continue
      case ("RAMP")
         if (.not. step%scheme%loads_ramp .and. step%scheme%code /= 0) call refuse_option(reader, &
            card, "AMPLITUDE", "STEP in a dynamic step", "give the loads an amplitude")
      case ("STEP")
         if (step%scheme%loads_ramp) call refuse_option(reader, card, "AMPLITUDE", &
            "RAMP in a static step", "give the loads an amplitude")
      case default
         call refuse_option(reader, card, "AMPLITUDE", "RAMP, STEP", "")
      end select
   end subroutine read_step_card

   !> *STATIC or *DYNAMIC: increment, duration, least and largest increment.
   subroutine read_procedure(reader, card, step)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(step_t), intent(inout) :: step
      type(data_t) :: data
      real(wp) :: value(4)
      integer :: k
      character(len=17), parameter :: what(4) = [character(len=17) :: "increment", "duration", &
         "least increment", "largest increment"]

      if (step%scheme%code /= 0) then
         call card_error(reader, card, procedure_twice)
         return
      end if
      step%scheme = scheme_row(card%name, "")
      if (is_explicit(reader, card)) step%scheme = scheme_row(card%name, "CENTRALDIFFERENCE")
      step%time%is_direct = has_option(card, "DIRECT")
      call read_application(reader, card)
      call read_solver(reader, card, step)
      call read_stabilize(reader, card, step)
      value = [1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp]
      call data_open(data, card)
      if (.not. next_line(reader, data)) return
      call check_count(reader, data, 0, 4, "increment, duration, least and largest increment")
      do k = 1, 4
         call get_real(reader, data, k, trim(what(k)), value(k))
      end do
      if (is_blank(data, 1)) value(1) = value(2)
      if (data%ok) call check_times(reader, data, value)
      if (data%ok) then
         step%time%h = value(1)
         step%time%duration = value(2)
         step%time%h_min = value(3)
         step%time%h_max = value(4)
      end if
      if (next_line(reader, data)) call data_error(reader, data, "only one data line is read")
   end subroutine read_procedure

   !> EXPLICIT, alone or as CalculiX numbers it: 0 nothing, 1 a fluid, 2 the structure, 3 both.
   logical function is_explicit(reader, card)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      integer, parameter :: most = 3             !! numbers of CalculiX: 2 and 3 are the structure
      integer :: kind

      is_explicit = has_option(card, "EXPLICIT")
      if (.not. is_explicit .or. option_name(card, "EXPLICIT") == "") return
      kind = 0
      call option_count(reader, card, "EXPLICIT", 0, kind, most)
      is_explicit = kind >= most - 1
   end function is_explicit

   !> APPLICATION= of Abaqus: how much a step damps by itself, which here it does not.
   subroutine read_application(reader, card)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=:), allocatable :: word

      call option_word(reader, card, "APPLICATION", "TRANSIENT FIDELITY, MODERATE DISSIPATION", &
         word, "QUASI-STATIC", "use *STATIC for bodies that are held or press on each other, " &
         // "or leave it out and damp by *DAMPING where they fall")
      if (word == "MODERATEDISSIPATION") call card_warning(reader, card, "APPLICATION=MODERATE " &
         // "DISSIPATION has no effect: energy is kept; *DAMPING takes it")
   end subroutine read_application

   !> SOLVER=: one that is here, or one that a program has to give; a name from another program asks
   !> for nothing else.
   subroutine read_solver(reader, card, step)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(step_t), intent(inout) :: step
      character(len=:), allocatable :: known
      type(solver_row_t) :: row
      integer :: i

      if (.not. has_option(card, "SOLVER")) return
      i = find_solver_row(option_name(card, "SOLVER"))
      if (i > 0) row = solver_row(i)
      if (i == 0 .and. is_foreign_solver(option_name(card, "SOLVER"))) then
         call solver_names(known)
         call card_warning(reader, card, "SOLVER=" // option_name(card, "SOLVER") // &
            " has no effect: solvers here are " // known)
      else if (i == 0) then
         step%solution%solver = solver_user
         step%solution%solver_name = option_name(card, "SOLVER")
         step%solution%solver_origin = card%origin
      else if (.not. row%is_built) then
         call card_error(reader, card, "SOLVER=" // option_name(card, "SOLVER") // &
            ": this program was built without it; leave SOLVER out")
      else
         step%solution%solver = row%code
      end if
   end subroutine read_solver

   !> STABILIZE of *STATIC: viscous stress, by the part of the strain energy that it takes from the
   !> first increment; 0: none.
   subroutine read_stabilize(reader, card, step)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(step_t), intent(inout) :: step

      if (.not. has_option(card, "STABILIZE")) return
      step%stabilization = default_stabilization
      if (option_name(card, "STABILIZE") == "") return
      call option_number(reader, card, "STABILIZE", "a part of the strain energy, from 0 to 0.1", &
         0.0_wp, most_stabilization, step%stabilization)
   end subroutine read_stabilize

   subroutine check_times(reader, data, value)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      real(wp), intent(in) :: value(4)             !! h, duration, h_min, h_max

      associate (h => value(1), duration => value(2), least => value(3), most => value(4))
         if (h <= 0.0_wp) then
            call data_error(reader, data, "the increment " // to_text(h) // " is not positive")
         else if (duration <= 0.0_wp) then
            call data_error(reader, data, "the duration " // to_text(duration) &
               // " is not positive")
         else if (duration < h) then
            call data_error(reader, data, "the duration " // to_text(duration) &
               // " is less than the increment " // to_text(h))
         else if (duration > most_increments*h) then
            call data_error(reader, data, "the duration " // to_text(duration) // " is more than " &
               // to_text(most_increments) // " increments of " // to_text(h) &
               // ", which cannot be counted: give a larger first increment")
         else if (least < 0.0_wp .or. least > h) then
            call data_error(reader, data, "the least increment " // to_text(least) &
               // " must lie between 0 and the increment " // to_text(h))
         else if (most < 0.0_wp .or. (most > 0.0_wp .and. most < h)) then
            call data_error(reader, data, "the largest increment " // to_text(most) &
               // " is less than the increment " // to_text(h))
         end if
      end associate
   end subroutine check_times

   subroutine read_newton(reader, card, step)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(step_t), intent(inout) :: step
      character(len=:), allocatable :: known, word

      select case (option_name(card, "TYPE"))
      case ("")
         step%solution%newton = option_default("newton")
      case ("MODIFIED", "INEXACT")
         call option_words("newton", known)
         call refuse_option(reader, card, "TYPE", known, "not in this version")
      case default
         call choose_option(reader, card, "TYPE", "newton", step%solution%newton)
      end select
      call option_real(reader, card, "TOLERANCE", step%solution%newton_tolerance)
      if (step%solution%newton_tolerance >= 1.0_wp) then
         call card_error(reader, card, "TOLERANCE is relative and must be below 1")
      end if
      call option_count(reader, card, "MAXIMUM", 1, step%solution%newton_maximum)
      call option_word(reader, card, "POLISH", "YES, NO", word)
      step%solution%polishes = word /= "NO"
   end subroutine read_newton

   subroutine read_restart(reader, card, step)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(step_t), intent(inout) :: step

      if (.not. has_option(card, "WRITE")) then
         if (.not. has_option(card, "READ")) call card_error(reader, card, "WRITE is missing")
         return
      end if
      step%restart_frequency = 1
      call option_count(reader, card, "FREQUENCY", 0, step%restart_frequency)
   end subroutine read_restart

   !> Boundaries, loads and output requests of the step whose first card is `i_first`.
   subroutine read_conditions(reader, i_first, scene, conditions, requests)
      type(reader_t), intent(inout) :: reader
      integer, intent(in) :: i_first
      type(scene_t), intent(in) :: scene
      type(conditions_t), intent(inout) :: conditions
      type(requests_t), intent(inout) :: requests
      type(card_t) :: card
      integer :: i

      do i = i_first, size(reader%card)
         if (reader%card(i)%step > reader%card(i_first)%step) exit
         if (reader%card(i)%step < reader%card(i_first)%step) cycle
         card = reader%card(i)
         select case (card%name)
         case ("BOUNDARY")
            call read_boundary(reader, card, scene, conditions)
         case ("CLOAD")
            call read_cload(reader, card, scene, conditions)
         case ("DLOAD")
            call read_dload(reader, card, scene, conditions)
         case ("DSLOAD")
            call read_dsload(reader, card, scene, conditions)
         case default
            if (is_output(card)) call read_output(reader, card, scene, requests)
         end select
      end do
   end subroutine read_conditions

end module emcon_deck_step
