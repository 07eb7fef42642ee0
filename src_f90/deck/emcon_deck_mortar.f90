!> *MORTAR and *SURFACE SMOOTHING: how the contact of a step is computed.
!>
!> What a card does not name stays as it was; only POINTS belongs to the INTEGRATION it was given
!> with. An option that no pair of the model heeds gives a warning.
module emcon_deck_mortar
   use emcon_deck_dimension, only : n_space
   use emcon_deck_options, only : choose_option
   use emcon_deck_reader, only : card_t, card_warning, has_option, option_angle, &
      option_count, option_name, reader_t
   use emcon_interactions, only : contact_options_t, contact_pair_t, formulation_mortar, &
      formulation_segment, integration_elements, normal_edge, smoothing_none
   implicit none
   private
   public :: read_mortar, read_smoothing

   integer, parameter :: most_points = 10          !! of the Gauss rules

contains

   !> *MORTAR: what is integrated, and how.
   subroutine read_mortar(reader, card, pair, options)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(contact_pair_t), intent(in) :: pair(:)
      type(contact_options_t), intent(inout) :: options

      call read_integration(reader, card, options)
      call choose_option(reader, card, "MULTIPLIER", "multiplier", options%multiplier)
      call choose_option(reader, card, "NORMAL", "normal", options%normal)
      call option_angle(reader, card, options%normal_angle)
      if (.not. in_doubt(reader, pair)) call warn_of_mortar(reader, card, pair, options)
   end subroutine read_mortar

   !> INTEGRATION, and POINTS: of each slave edge, or of each segment, where one is too few.
   subroutine read_integration(reader, card, options)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(contact_options_t), intent(inout) :: options
      integer :: least
      logical :: is_refused

      call choose_option(reader, card, "INTEGRATION", "integration", options%integration, &
         is_refused)
      if (option_name(card, "INTEGRATION") /= "" .and. .not. is_refused) options%n_point = 0
      least = merge(1, 2, is_refused .or. options%integration == integration_elements)
      call option_count(reader, card, "POINTS", least, options%n_point, most_points)
   end subroutine read_integration

   !> Whether the formulation of some pair is unknown after an error.
   pure logical function in_doubt(reader, pair)
      type(reader_t), intent(in) :: reader
      type(contact_pair_t), intent(in) :: pair(:)

      in_doubt = reader%doubt%names .or. any(pair%formulation == 0)
   end function in_doubt

   subroutine warn_of_mortar(reader, card, pair, options)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(contact_pair_t), intent(in) :: pair(:)
      type(contact_options_t), intent(in) :: options
      character(len=:), allocatable :: idle
      logical :: has_mortar

      ! A card of parameters may serve formulations that another run chooses.
      if (card%is_parametric) return
      has_mortar = any(pair%formulation == formulation_mortar)
      if (.not. has_mortar .and. all(pair%formulation /= formulation_segment)) then
         call card_warning(reader, card, &
            "it has no effect: no *CONTACT PAIR has TYPE=MORTAR or SEGMENT")
         return
      end if
      idle = ""
      if (.not. has_mortar) then
         call add_idle("INTEGRATION", "INTEGRATION")
         call add_idle("POINTS", "POINTS")
         call add_idle("NORMAL", "NORMAL")
         call add_idle("FEATUREANGLE", "FEATURE ANGLE")
         if (idle /= "") call card_warning(reader, card, &
            idle // ": without effect on pairs of TYPE=SEGMENT; no *CONTACT PAIR has TYPE=MORTAR")
      else if (reader%n_dim == n_space) then
         call add_idle("POINTS", "POINTS")
         call add_idle("NORMAL", "NORMAL")
         call add_idle("FEATUREANGLE", "FEATURE ANGLE")
         if (idle /= "") call card_warning(reader, card, idle // ": without effect in three " // &
            "dimensions, where integrals are exact, along the normals of the slave's faces")
      else if (options%normal == normal_edge) then
         call add_idle("FEATUREANGLE", "FEATURE ANGLE")
         if (idle /= "") call card_warning(reader, card, idle // ": without effect on NORMAL=EDGE")
      end if

   contains

      subroutine add_idle(option, title)
         character(len=*), intent(in) :: option, title

         if (.not. has_option(card, option)) return
         if (idle /= "") idle = idle // ", "
         idle = idle // title
      end subroutine add_idle

   end subroutine warn_of_mortar

   !> *SURFACE SMOOTHING: the shape of the master surfaces.
   subroutine read_smoothing(reader, card, pair, options)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(contact_pair_t), intent(in) :: pair(:)
      type(contact_options_t), intent(inout) :: options
      character(len=:), allocatable :: kind
      logical :: is_refused

      kind = option_name(card, "TYPE")
      call option_angle(reader, card, options%smoothing_angle)
      call choose_option(reader, card, "TYPE", "smoothing", options%smoothing, is_refused)
      if (is_refused) return
      if (in_doubt(reader, pair)) return
      if (size(pair) == 0) then
         call card_warning(reader, card, "it has no effect: there is no *CONTACT PAIR")
      else if (options%smoothing == smoothing_none .and. (kind == "" &
         .or. has_option(card, "FEATUREANGLE"))) then
         call card_warning(reader, card, "surfaces are not smoothed; give TYPE=HERMITE")
      end if
   end subroutine read_smoothing

end module emcon_deck_mortar
