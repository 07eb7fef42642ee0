!> Explicit steps: which cards they have no use for, and what they set by themselves.
module emcon_deck_explicit
   use emcon_deck_reader, only : card_error, has_option, option_name, reader_t
   use emcon_diagnostics, only : add_error
   use emcon_interactions, only : contact_pair_t, pressure_exponential
   use emcon_kinds, only : wp
   use emcon_solver_registry, only : solver_default
   use emcon_steps, only : initiation_admissible, initiation_massless, method_null_space, &
      method_penalty, newton_kept, step_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: choose_implicit, check_explicit_cards, suit_explicit

contains

   !> The scheme of *TIME INTEGRATION, of steps of its card that are not explicit.
   subroutine choose_implicit(step)
      type(step_t), intent(inout) :: step

      if (step%scheme%card == step%choice%row%card .and. .not. step%scheme%is_explicit) then
         step%scheme = step%choice%row
      end if
   end subroutine choose_implicit

   !> Of a step that begins with card `i_first`, if it is explicit: refuse cards that would change
   !> nothing.
   subroutine check_explicit_cards(reader, i_first, step)
      type(reader_t), intent(inout) :: reader
      integer, intent(in) :: i_first             !! *STEP
      type(step_t), intent(in) :: step
      integer :: i

      if (.not. step%scheme%is_explicit) return
      if (step%time%event_fraction > 0.0_wp) call card_error(reader, reader%card(i_first), &
         "*EVENTS is not for explicit steps: end it by *EVENTS, OFF")
      do i = i_first + 1, size(reader%card)
         associate (card => reader%card(i))
            if (card%name == "STEP") exit
            select case (card%name)
            case ("CONSTRAINTMETHOD")
               if (step%contact%method /= method_penalty) call card_error(reader, card, "an " &
                  // "explicit step has no system to solve: leave the card to other steps, " // &
                  "but for TYPE=PENALTY")
            case ("NEWTON")
               call card_error(reader, card, "an explicit step has no system to solve: leave " // &
                  "the card to other steps")
            case ("CONTACTINITIATION")
               if (step%contact%initiation /= initiation_admissible .or. has_option(card, &
                  "GAPTOLERANCE")) call card_error(reader, card, "in an explicit step gaps " // &
                  "close to zero, never before: leave the card to other steps")
            case ("TIMEINTEGRATION")
               if (option_name(card, "SCHEME") /= "CENTRALDIFFERENCE") call card_error(reader, &
                  card, "*DYNAMIC, EXPLICIT is SCHEME=CENTRAL DIFFERENCE")
            case ("DYNAMIC")
               if (has_option(card, "SOLVER")) call card_error(reader, card, "SOLVER=" // &
                  option_name(card, "SOLVER") // ": an explicit step has no system to solve")
            end select
         end associate
      end do
   end subroutine check_explicit_cards

   !> Let explicit steps have the settings that serve them, whatever other steps have, and refuse
   !> surfaces without mass and rebounds.
   subroutine suit_explicit(reader, pair, step)
      type(reader_t), intent(inout) :: reader
      type(contact_pair_t), intent(in) :: pair(:)
      type(step_t), intent(inout) :: step(:)
      integer :: i, k

      do k = 1, size(step)
         if (.not. step(k)%scheme%is_explicit) cycle
         if (step(k)%contact%initiation == initiation_massless) then
            call add_error(reader%log, step(k)%origin, "step " // to_text(k) // " is explicit, " &
               // "but slave nodes are to be MASSLESS: what has no mass has no acceleration")
            cycle
         end if
         i = findloc(pair%interaction%restitution < 1.0_wp, .true., 1)
         if (i > 0) then
            call add_error(reader%log, pair(i)%origin, "*CONTACT PAIR: its surface interaction " &
               // "has RESTITUTION=" // to_text(pair(i)%interaction%restitution) &
               // ", but step " // &
               to_text(k) // " is explicit, and explicit steps have no law of impact")
            cycle
         end if
         i = findloc(pair%interaction%pressure%kind == pressure_exponential, .true., 1)
         if (i > 0) call add_error(reader%log, pair(i)%origin, "*CONTACT PAIR: the pressure of " &
            // "its surface interaction is EXPONENTIAL, which has no largest stiffness, but step " &
            // to_text(k) // " is explicit; use LINEAR or TABULAR")
         step(k)%contact%initiation = initiation_admissible
         if (step(k)%contact%method /= method_penalty) step(k)%contact%method = &
            method_null_space
         step(k)%solution%newton = newton_kept
         step(k)%solution%solver = solver_default
      end do
   end subroutine suit_explicit

end module emcon_deck_explicit
