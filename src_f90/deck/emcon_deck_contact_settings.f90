!> Settings of contact in a step: how it begins, what overlaps at the start, what nothing holds.
module emcon_deck_contact_settings
   use emcon_amplitudes, only : amplitude_t, find_amplitude_value
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, get_name, next_line
   use emcon_deck_options, only : choose_option
   use emcon_deck_reader, only : card_error, card_t, card_warning, has_option, option_name, &
      option_real, option_word, reader_t, refuse_option
   use emcon_deck_tables, only : table_names
   use emcon_diagnostics, only : add_error, quoted, suggestion
   use emcon_interactions, only : contact_pair_t, pair_begins
   use emcon_kinds, only : wp
   use emcon_name_index, only : name_index_find
   use emcon_options, only : option_default
   use emcon_steps, only : initiation_admissible, initiation_auto, initiation_massless, &
      initiation_none, initiation_persistent, step_initiation, step_is_dynamic, step_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: read_initiation, read_pair_initiation, read_interference, read_controls, &
      check_statics, check_massless, check_restitution, pairs_ask

   !> Surfaces of a pair.
   integer, parameter :: n_surface = 2

contains

   !> *CONTACT INITIATION: what a contact does that begins.
   subroutine read_initiation(reader, card, step)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(step_t), intent(inout) :: step

      if (option_name(card, "TYPE") == "") step%contact%initiation = option_default("initiation")
      call choose_option(reader, card, "TYPE", "initiation", step%contact%initiation)
      call option_real(reader, card, "GAP TOLERANCE", step%contact%gap_tolerance)
      if (has_option(card, "GAPTOLERANCE") &
         .and. all(step%contact%initiation /= [initiation_auto, initiation_persistent])) then
         call card_warning(reader, card, &
            "GAP TOLERANCE has an effect with TYPE=AUTO and PERSISTENT only")
      end if
   end subroutine read_initiation

   !> INITIATION= of a *CONTACT PAIR: with or without mass on its slave nodes.
   subroutine read_pair_initiation(reader, card, initiation)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      integer, intent(inout) :: initiation       !! one of `initiation_`, as it is: as the step
      integer :: code

      code = initiation_persistent
      call choose_option(reader, card, "INITIATION", "initiation", code)
      if (any(code == [initiation_persistent, initiation_massless])) then
         if (has_option(card, "INITIATION")) initiation = code
      else
         call refuse_option(reader, card, "INITIATION", "PERSISTENT, MASSLESS", &
            "the others are of all pairs of a step: *CONTACT INITIATION")
      end if
   end subroutine read_pair_initiation

   !> Where pairs ask for slave nodes without mass, or with it, dynamic steps are MASSLESS, and the
   !> pairs that ask for nothing are what their steps are.
   subroutine pairs_ask(reader, pair, step)
      type(reader_t), intent(inout) :: reader
      type(contact_pair_t), intent(inout) :: pair(:)
      type(step_t), intent(inout) :: step(:)
      integer :: i, k

      i = findloc(pair%initiation /= 0, .true., 1)
      if (i == 0) return
      do k = 1, size(step)
         if (any(step_initiation(step(k)) == [initiation_none, initiation_persistent, &
            initiation_massless])) cycle
         call add_error(reader%log, pair(i)%origin, "*CONTACT PAIR, INITIATION=: it goes with " // &
            "*CONTACT INITIATION, TYPE=PERSISTENT or MASSLESS, not with that of step " // &
            to_text(k))
         return
      end do
      if (.not. any(pair%initiation == initiation_massless)) return
      k = findloc(step_is_dynamic(step), .true., 1)
      if (k == 0) return
      where (pair%initiation == 0) pair%initiation = step(k)%contact%initiation
      where (step_is_dynamic(step)) step%contact%initiation = initiation_massless
   end subroutine pairs_ask

   !> *CONTACT INTERFERENCE, SHRINK: for all pairs, in a step in which pairs begin to act.
   subroutine read_interference(reader, card, pair, amplitude, step)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(contact_pair_t), intent(in) :: pair(:)
      type(amplitude_t), intent(in) :: amplitude(:)
      type(step_t), intent(inout) :: step
      character(len=:), allocatable :: name

      if (.not. has_option(card, "SHRINK")) call card_error(reader, card, "SHRINK is missing: " &
         // "only the overclosure that is there at the start can be resolved")
      if (card%step > 1 .and. .not. any(pair_begins(pair, card%step))) call card_error(reader, &
         card, "it belongs into the first step, or into one in which *MODEL CHANGE, ADD takes " // &
         "pairs in: others begin without overclosure")
      if (size(pair) == 0 .and. .not. reader%doubt%names) call card_error(reader, card, &
         "there is no *CONTACT PAIR")
      step%contact%resolves_overclosure = .true.
      call check_interference_pairs(reader, card, pair)
      name = option_name(card, "AMPLITUDE")
      if (name == "") return
      step%contact%overclosure_amplitude = name_index_find(reader%names%amplitudes, name)
      if (step%contact%overclosure_amplitude == 0 &
         .and. .not. reader%doubt%names) call card_error(reader, &
         card, "unknown amplitude " // quoted(name) // suggestion(name, table_names(amplitude)))
   end subroutine read_interference

   !> Lines of *CONTACT INTERFERENCE: it holds for all pairs, and so they name none of them or all.
   subroutine check_interference_pairs(reader, card, pair)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(contact_pair_t), intent(in) :: pair(:)
      type(data_t) :: data
      character(len=:), allocatable :: name
      integer :: slave, master, n, n_errors
      logical :: is_named(size(pair))

      call option_word(reader, card, "TYPE", "CONTACT PAIR", name, "ELEMENT", &
         "contact is that of *CONTACT PAIR")
      is_named = .false.
      n_errors = reader%log%n_errors
      n = 0
      call data_open(data, card)
      do while (next_line(reader, data))
         call check_count(reader, data, n_surface, n_surface, "slave surface, master surface")
         n = n + 1
         if (data%ok) call get_name(reader, data, 1, "surface", name)
         if (data%ok) slave = name_index_find(reader%names%surfaces, name)
         if (data%ok) call get_name(reader, data, n_surface, "surface", name)
         if (data%ok) master = name_index_find(reader%names%surfaces, name)
         if (.not. data%ok .or. reader%doubt%names) cycle
         if (.not. any(names())) call data_error(reader, data, "there is no *CONTACT PAIR of " &
            // "these two surfaces")
         is_named = is_named .or. names()
      end do
      if (n > 0 .and. reader%log%n_errors == n_errors .and. .not. (all(is_named) .or. &
         reader%doubt%names)) call card_error(reader, &
         card, "it holds for all pairs: name every *CONTACT PAIR, or none")

   contains

      pure function names()
         logical :: names(size(pair))

         names = (pair%slave == slave .and. pair%master == master) .or. &
            (pair%slave == master .and. pair%master == slave)
      end function names

   end subroutine check_interference_pairs

   !> *CONTACT CONTROLS, STABILIZE or RESET: bodies that nothing holds and no load moves.
   subroutine read_controls(reader, card, pair, step)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(contact_pair_t), intent(in) :: pair(:)
      type(step_t), intent(inout) :: step

      if (option_name(card, "STABILIZE") /= "") call card_warning(reader, card, "the value of " &
         // "STABILIZE has no effect: the motion is the smallest one, whatever the stiffness")
      if ((has_option(card, "STABILIZE") .and. has_option(card, "RESET")) .or. &
         size(card%option) == 0) call card_error(reader, card, &
         "either STABILIZE or RESET is to be given")
      if (size(pair) == 0 .and. .not. reader%doubt%names) call card_error(reader, card, &
         "there is no *CONTACT PAIR")
      if (has_option(card, "STABILIZE") .or. has_option(card, "RESET")) then
         step%stabilizes = has_option(card, "STABILIZE")
      end if
   end subroutine read_controls

   !> Cards after `i_first` that the procedure of the step, or its duration, does not allow.
   subroutine check_statics(reader, i_first, amplitude, step)
      type(reader_t), intent(inout) :: reader
      integer, intent(in) :: i_first
      type(amplitude_t), intent(in) :: amplitude(:)
      type(step_t), intent(in) :: step
      integer :: i

      if (step%contact%overclosure_amplitude > 0) call check_left(reader, reader%card(i_first), &
         amplitude(step%contact%overclosure_amplitude), step%time%duration)
      if (.not. step_is_dynamic(step)) return
      if (step%contact%resolves_overclosure) call card_error(reader, reader%card(i_first), &
         "*CONTACT INTERFERENCE is for *STATIC steps: in dynamics pushing bodies apart would " &
         // "make energy")
      do i = i_first + 1, size(reader%card)
         if (reader%card(i)%name == "STEP") exit
         if (reader%card(i)%name /= "CONTACTCONTROLS") cycle
         if (has_option(reader%card(i), "STABILIZE")) call card_error(reader, reader%card(i), &
            "STABILIZE is for *STATIC steps: in dynamics inertia holds bodies")
      end do
   end subroutine check_statics

   !> Mass does not come and go: surfaces are massless in all dynamic steps or in none.
   subroutine check_massless(reader, step)
      type(reader_t), intent(inout) :: reader
      type(step_t), intent(in) :: step(:)
      integer :: first, k, with

      first = findloc(step_is_dynamic(step), .true., 1)
      do k = first + 1, merge(size(step), 0, first > 0)
         if (.not. step_is_dynamic(step(k))) cycle
         if ((step(k)%contact%initiation == initiation_massless) .eqv. &
            (step(first)%contact%initiation == initiation_massless)) cycle
         with = merge(k, first, step(k)%contact%initiation == initiation_massless)
         call add_error(reader%log, step(k)%origin, "step " // to_text(with) // " has *CONTACT " &
            // "INITIATION, TYPE=MASSLESS, step " // to_text(first + k - with) // " another one: " &
            // "surfaces are massless in all dynamic steps or in none")
         return
      end do
   end subroutine check_massless

   !> What loses energy by itself leaves no velocity that a restitution could speak of.
   subroutine check_restitution(reader, pair, step)
      type(reader_t), intent(inout) :: reader
      type(contact_pair_t), intent(in) :: pair(:)
      type(step_t), intent(in) :: step(:)
      integer :: i, k

      i = findloc(pair%interaction%restitution < 1.0_wp, .true., 1)
      if (i == 0) return
      k = findloc(step_initiation(step), initiation_admissible, 1)
      if (k > 0) call add_error(reader%log, pair(i)%origin, "*CONTACT PAIR: its surface " // &
         "interaction has RESTITUTION=" // to_text(pair(i)%interaction%restitution) &
         // ", but step " // &
         to_text(k) // " has *CONTACT INITIATION, TYPE=ADMISSIBLE, which loses energy by " // &
         "itself; use PERSISTENT")
   end subroutine check_restitution

   !> The part of overclosure that is left: all of it at the start of the step, none at its end.
   subroutine check_left(reader, card, amplitude, duration)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(amplitude_t), intent(in) :: amplitude
      real(wp), intent(in) :: duration           !! [T]
      real(wp) :: at_start, at_end, slope

      call find_amplitude_value(amplitude, 0.0_wp, at_start, slope)
      call find_amplitude_value(amplitude, duration, at_end, slope)
      if (abs(at_start - 1.0_wp) > 0.0_wp .or. abs(at_end) > 0.0_wp &
         .or. any(amplitude%value < 0.0_wp .or. amplitude%value > 1.0_wp)) call card_error(reader, &
         card, "*CONTACT INTERFERENCE: the amplitude " // amplitude%name // " is the part of " // &
         "overclosure that is left: from 1 at the start of the step to 0 at its end, never " // &
         "beyond; here from " // to_text(at_start) // " to " // to_text(at_end))
   end subroutine check_left

end module emcon_deck_contact_settings
