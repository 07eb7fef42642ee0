!> EDGES= of *CONTACT PAIR: contact of sharp edges that cross, in three dimensions.
module emcon_deck_crossings
   use emcon_deck_dimension, only : n_space
   use emcon_deck_reader, only : card_error, card_t, has_option, option_word, reader_t
   use emcon_interactions, only : contact_pair_t, formulation_user, pressure_hard
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: read_crossings

contains

   !> EDGES= of a card: are sharp edges that cross in contact? Where none can be they must not be
   !> asked for.
   subroutine read_crossings(reader, card, scene, pair, holds_crossings)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair(:)    !! of the card, with their interactions
      logical, intent(out) :: holds_crossings
      character(len=:), allocatable :: word, why
      integer :: i

      call option_word(reader, card, "EDGES", "YES, NO", word)
      holds_crossings = word /= "NO"
      if (reader%n_dim /= n_space .and. has_option(card, "EDGES")) call card_error(reader, card, &
         "EDGES is for three dimensions: in the plane bodies meet in nodes and edges alone; take " &
         // "it out")
      if (reader%n_dim /= n_space .or. word /= "YES" .or. .not. has_option(card, "EDGES")) return
      do i = 1, size(pair)
         if (pair(i)%slave == 0 .or. pair(i)%master == 0) cycle
         call say_why_none_cross(scene, pair(i), why)
         if (why == "") cycle
         call card_error(reader, card, "EDGES=YES: " // why // "; take it out")
         return
      end do
   end subroutine read_crossings

   !> Why a pair has no edges that could be held; blank if it has.
   pure subroutine say_why_none_cross(scene, pair, why)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      character(len=:), allocatable, intent(out) :: why

      why = ""
      associate (master => scene%surface(pair%master))
         if (allocated(master%wall)) then
            why = "surface " // master%name // " is a wall, which has no edges"
         else if (pair%formulation == formulation_user) then
            why = "the program that gives TYPE=USER decides what it constrains"
         else if (pair%interaction%pressure%kind /= pressure_hard) then
            why = "a pressure by the overclosure acts on areas, and edges have none"
         end if
      end associate
   end subroutine say_why_none_cross

end module emcon_deck_crossings
