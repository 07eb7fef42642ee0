!> *CLEARANCE: the gap of a contact pair before the first step.
module emcon_deck_clearance
   use emcon_deck_reader, only : card_error, card_t, has_option, need_name, option_number, reader_t
   use emcon_deck_surfaces, only : surface_names
   use emcon_diagnostics, only : quoted, suggestion
   use emcon_interactions, only : adjustment_moves, adjustment_t, formulation_user, pressure_tied
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_name_index, only : name_index_find
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: read_clearances

   !> Values that are none.
   real(wp), parameter :: largest = 1.0e30_wp

contains

   !> All cards; the pairs are read.
   subroutine read_clearances(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      integer :: i

      do i = 1, size(reader%card)
         if (reader%card(i)%name == "CLEARANCE") call read_clearance(reader, reader%card(i), scene)
      end do
   end subroutine read_clearances

   !> One card: the pair of its surfaces gets the gap of its value.
   subroutine read_clearance(reader, card, scene)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(inout) :: scene
      real(wp) :: value
      integer :: slave, master, k

      call find_surface("SLAVE", slave)
      call find_surface("MASTER", master)
      value = 0.0_wp
      if (has_option(card, "VALUE")) then
         call option_number(reader, card, "VALUE", "a length from -1e30 to 1e30: the gap of " &
            // "slave nodes; below 0 they overlap", -largest, largest, value)
      else
         call card_error(reader, card, "VALUE is missing: the gap of slave nodes")
      end if
      if (min(slave, master) == 0 .or. .not. has_option(card, "VALUE")) return
      k = findloc(scene%pair%slave == slave .and. scene%pair%master == master, .true., 1)
      if (k == 0) then
         if (.not. reader%doubt%names) call card_error(reader, card, "there is no *CONTACT PAIR " &
            // "with the slave surface " // quoted(scene%surface(slave)%name) // " and the " &
            // "master surface " // quoted(scene%surface(master)%name))
         return
      end if
      associate (pair => scene%pair(k))
         if (adjustment_moves(pair%adjust)) call card_error(reader, card, "the pair has ADJUST, " &
            // "or a clearance, already")
         if (pair%interaction%pressure%kind == pressure_tied) call card_error(reader, card, &
            "these surfaces are tied: *TIE, POSITION TOLERANCE says what ties reach")
         if (pair%formulation == formulation_user) call card_error(reader, card, "the contact of " &
            // "the pair is that of a program, which has to know of it")
         if (slave == master .or. has_nodes(scene%surface(slave))) call card_error(reader, card, &
            "the slave surface needs element faces, which face another surface; for a surface " // &
            "of nodes use ADJUST of *CONTACT PAIR")
         pair%adjust = adjustment_t(is_clearance=.true., clearance=value)
      end associate

   contains

      !> The surface that a parameter names; 0: none, which is told.
      subroutine find_surface(name, number)
         character(len=*), intent(in) :: name
         integer, intent(out) :: number
         character(len=:), allocatable :: text

         number = 0
         call need_name(reader, card, name, text)
         if (text == "") return
         number = name_index_find(reader%names%surfaces, text)
         if (number == 0 .and. .not. reader%doubt%names) call card_error(reader, card, &
            "unknown surface " // quoted(text) // suggestion(text, surface_names(scene%surface)))
      end subroutine find_surface

   end subroutine read_clearance

   !> Is a surface given by its nodes?
   pure logical function has_nodes(surface)
      type(surface_t), intent(in) :: surface

      has_nodes = allocated(surface%node)
      if (has_nodes) has_nodes = size(surface%node) > 0
   end function has_nodes

end module emcon_deck_clearance
