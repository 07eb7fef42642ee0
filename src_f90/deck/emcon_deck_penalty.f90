!> *CONSTRAINT METHOD: how contact is held, and how stiff it is where it gives way.
module emcon_deck_penalty
   use emcon_deck_options, only : choose_option
   use emcon_deck_reader, only : card_error, card_t, has_option, option_name, option_real, reader_t
   use emcon_diagnostics, only : add_error
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_options, only : option_default
   use emcon_steps, only : initiation_massless, initiation_velocity_update, &
      method_augmented_lagrange, method_penalty, penalty_setting_t, step_is_dynamic, step_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: read_constraint_method, check_penalty

contains

   !> The method of this step and later ones; each card says all of it anew.
   subroutine read_constraint_method(reader, card, step)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(step_t), intent(inout) :: step

      if (option_name(card, "TYPE") == "") step%contact%method = option_default("method")
      call choose_option(reader, card, "TYPE", "method", step%contact%method)
      step%contact%penalty = penalty_setting_t(card%origin)
      call option_real(reader, card, "STIFFNESS", step%contact%penalty%stiffness)
      call option_real(reader, card, "FACTOR", step%contact%penalty%factor)
      call option_real(reader, card, "TOLERANCE", step%contact%penalty%tolerance)
      if (has_option(card, "STIFFNESS") .and. has_option(card, "FACTOR")) call card_error(reader, &
         card, "either STIFFNESS or FACTOR is to be given")
      if ((has_option(card, "STIFFNESS") .or. has_option(card, "FACTOR")) .and. .not. &
         any(step%contact%method == [method_penalty, method_augmented_lagrange])) then
         call card_error(reader, card, "STIFFNESS and FACTOR are of TYPE=PENALTY and " // &
            "AUGMENTED LAGRANGE: with the other types contact is hard")
      end if
      if (.not. has_option(card, "TOLERANCE")) return
      if (step%contact%method /= method_augmented_lagrange) then
         call card_error(reader, card, "TOLERANCE is of TYPE=AUGMENTED LAGRANGE")
      else if (step%contact%penalty%tolerance >= 1.0_wp) then
         call card_error(reader, card, "TOLERANCE is relative to an edge and must be below 1")
      end if
   end subroutine read_constraint_method

   !> What gives way stores energy and takes its time: it has no velocities that jump, and no
   !> surfaces without mass.
   subroutine check_penalty(reader, pair, step)
      type(reader_t), intent(inout) :: reader
      type(contact_pair_t), intent(in) :: pair(:)
      type(step_t), intent(in) :: step(:)
      integer :: k

      do k = 1, size(step)
         associate (method => step(k)%contact%method, initiation => step(k)%contact%initiation)
            if (.not. step_is_dynamic(step(k))) cycle
            if (.not. any(method == [method_penalty, method_augmented_lagrange])) cycle
            if (step(k)%contact%penalty%origin%line == 0) cycle    ! by pressures of surfaces
            if (initiation == initiation_massless) call refuse( &
               "*CONTACT INITIATION, TYPE=MASSLESS: surfaces without mass hold their gaps exactly")
            if (initiation == initiation_velocity_update) call refuse("*CONTACT INITIATION, " // &
               "TYPE=VELOCITY UPDATE: the energy that a penalty stores would count as lost in " // &
               "impacts")
            if (method /= method_penalty) cycle
            if (any(pair%interaction%restitution < 1.0_wp)) call refuse( &
               "RESTITUTION below 1: a penalty has " // "no instant at which velocities jump")
         end associate
      end do

   contains

      subroutine refuse(what)
         character(len=*), intent(in) :: what

         call add_error(reader%log, step(k)%contact%penalty%origin, &
            "*CONSTRAINT METHOD of step " // &
            to_text(k) // " does not go with " // what // "; use TYPE=NULL SPACE")
      end subroutine refuse

   end subroutine check_penalty

end module emcon_deck_penalty
