!> *MODEL CHANGE: contact pairs that begin or cease to act with a step.
module emcon_deck_model_change
   use emcon_deck_fields, only : data_error, data_open, data_t, data_warning, next_line
   use emcon_deck_reader, only : card_error, card_t, has_option, option_name, option_word, reader_t
   use emcon_deck_surfaces, only : get_surfaces
   use emcon_diagnostics, only : quoted
   use emcon_interactions, only : contact_pair_t, pair_acts, pair_has_order, &
      pair_is_reverse_of, pressure_tied
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: read_model_changes

contains

   !> The changes of all steps, in the order of the deck. One holds from the start of its step on,
   !> until the next one of the same pair.
   subroutine read_model_changes(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene      !! its pairs are read
      integer :: i

      do i = 1, size(reader%card)
         if (reader%card(i)%name == "MODELCHANGE") call read_change(reader, reader%card(i), scene)
      end do
   end subroutine read_model_changes

   !> One card: its pairs, and whether they act from its step on.
   subroutine read_change(reader, card, scene)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(inout) :: scene
      type(data_t) :: data
      character(len=:), allocatable :: word
      integer :: slave, master, n

      ! What other programs prepare a later change with is not needed: every pair may change.
      if (has_option(card, "ACTIVATE") .and. .not. (has_option(card, "ADD") .or. &
         has_option(card, "REMOVE"))) return
      if (option_name(card, "TYPE") == "") then
         call card_error(reader, card, "TYPE is missing: TYPE=CONTACT PAIR, for elements stay " // &
            "for the whole run")
         return
      end if
      call option_word(reader, card, "TYPE", "CONTACT PAIR", word, "ELEMENT", "elements stay for " &
         // "the whole run; run the model with and without them, and begin with the " // &
         "displacements of the first run by *INITIAL CONDITIONS, TYPE=DISPLACEMENT")
      if (word /= "CONTACTPAIR" .and. word /= "CONTACT PAIR") return
      if (has_option(card, "ADD") .eqv. has_option(card, "REMOVE")) then
         call card_error(reader, card, "either ADD or REMOVE is to be given")
         return
      end if
      n = 0
      call data_open(data, card)
      do while (next_line(reader, data))
         n = n + 1
         call get_surfaces(reader, data, scene, slave, master)
         if (data%ok) call change(reader, data, card, slave, master, scene)
      end do
      if (n == 0) call card_error(reader, card, "no pair of surfaces is given")
   end subroutine read_change

   !> Let the pair of a data line act, or not, from the step of its card on.
   subroutine change(reader, data, card, slave, master, scene)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(card_t), intent(in) :: card
      integer, intent(in) :: slave, master       !! surfaces
      type(scene_t), intent(inout) :: scene
      logical :: acts
      integer :: k, n_step

      acts = has_option(card, "ADD")
      n_step = maxval(reader%card%step)
      k = findloc(scene%pair%slave == slave .and. scene%pair%master == master, .true., 1)
      if (k == 0) then
         call tell_missing(reader, data, slave, master, scene)
         return
      end if
      if (scene%pair(k)%interaction%pressure%kind == pressure_tied) then
         call data_error(reader, data, "these surfaces are tied, and ties stay for the whole run")
         return
      end if
      if (card%step > 1 .or. allocated(scene%pair(k)%acts_in_step)) then
         if (pair_acts(scene%pair(k), card%step) .eqv. acts) call data_warning(reader, data, &
            "the pair " // trim(merge("acts already        ", "does not act already", acts)))
      end if
      call set(scene%pair(k))
      if (pair_has_order(scene%pair(k))) return
      k = findloc(pair_is_reverse_of(scene%pair, scene%pair(k)), .true., 1)
      if (k > 0) call set(scene%pair(k))

   contains

      subroutine set(pair)
         type(contact_pair_t), intent(inout) :: pair

         if (.not. allocated(pair%acts_in_step)) allocate(pair%acts_in_step(n_step), source=.true.)
         pair%acts_in_step(card%step:) = acts
      end subroutine set

   end subroutine change

   !> The error of a pair that is none.
   subroutine tell_missing(reader, data, slave, master, scene)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: slave, master       !! surfaces
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable :: text

      if (reader%doubt%names) return
      text = "there is no *CONTACT PAIR with the slave surface " // &
         quoted(scene%surface(slave)%name) // " and the master surface " // &
         quoted(scene%surface(master)%name)
      if (any(scene%pair%slave == master .and. scene%pair%master == slave)) text = text // &
         "; it has them the other way round"
      call data_error(reader, data, text)
   end subroutine tell_missing

end module emcon_deck_model_change
