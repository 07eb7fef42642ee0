!> What the sizes of increments follow: TOLERANCE of *TIME INTEGRATION, and *EVENTS.
module emcon_deck_increments
   use emcon_deck_options, only : choose_option
   use emcon_deck_reader, only : card_error, card_t, has_option, option_real, reader_t
   use emcon_diagnostics, only : add_error
   use emcon_kinds, only : wp
   use emcon_options, only : option_default
   use emcon_steps, only : step_is_dynamic, step_t
   implicit none
   private
   public :: read_tolerance, read_events, check_increments

   !> Part of the increment of the deck in which an event lies.
   real(wp), parameter :: default_fraction = 1.0e-3_wp, least_fraction = 1.0e-6_wp

contains

   !> TOLERANCE of *TIME INTEGRATION, of this step and later ones; a card without it ends it.
   subroutine read_tolerance(reader, card, step)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(step_t), intent(inout) :: step

      step%time%tolerance = 0.0_wp
      step%time%tolerance_origin = card%origin
      call option_real(reader, card, "TOLERANCE", step%time%tolerance)
      if (step%time%tolerance >= 1.0_wp) call card_error(reader, card, &
         "TOLERANCE is relative and must be below 1")
   end subroutine read_tolerance

   !> *EVENTS, of this step and later ones.
   subroutine read_events(reader, card, step)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(step_t), intent(inout) :: step

      step%time%event_fraction = 0.0_wp
      if (has_option(card, "OFF")) then
         if (has_option(card, "TYPE") .or. has_option(card, "FRACTION")) call card_error(reader, &
            card, "OFF stands alone")
         return
      end if
      step%time%events = option_default("events")
      call choose_option(reader, card, "TYPE", "events", step%time%events)
      step%time%event_fraction = default_fraction
      call option_real(reader, card, "FRACTION", step%time%event_fraction)
      if (step%time%event_fraction < least_fraction &
         .or. step%time%event_fraction > 1.0_wp) call card_error( &
         reader, card, "FRACTION is a part of the increment, from 1e-6 to 1")
   end subroutine read_events

   !> Cards from `i_first` on, of one step, and what holds from earlier ones fit its procedure.
   subroutine check_increments(reader, i_first, step)
      type(reader_t), intent(inout) :: reader
      integer, intent(in) :: i_first             !! its first card
      type(step_t), intent(in) :: step           !! read
      integer :: i

      if (step%scheme%code /= 0 .and. .not. step_is_dynamic(step)) then
         do i = i_first, size(reader%card)
            if (reader%card(i)%step /= reader%card(i_first)%step) cycle
            call refuse_in_statics(reader, reader%card(i))
         end do
         return
      end if
      if (.not. step%time%tolerance > 0.0_wp) return
      if (step%time%is_direct .and. step_is_dynamic(step)) call add_error(reader%log, &
         step%time%tolerance_origin, &
         "TOLERANCE adapts increments, DIRECT of *DYNAMIC fixes them: " // &
         "leave out one of the two; *TIME INTEGRATION without TOLERANCE ends it")
   end subroutine check_increments

   !> An error where a card of a static step asks for what is of time.
   subroutine refuse_in_statics(reader, card)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card

      select case (card%name)
      case ("EVENTS")
         if (has_option(card, "OFF")) return
         call card_error(reader, card, "*EVENTS is for dynamic steps: in static ones the time " &
            // "is only a measure of the load")
      case ("TIMEINTEGRATION")
         if (.not. has_option(card, "TOLERANCE")) return
         call card_error(reader, card, "TOLERANCE is for dynamic steps: the size of static " // &
            "increments depends on how Newton's method converges")
      end select
   end subroutine refuse_in_statics

end module emcon_deck_increments
