!> *CHANGE FRICTION: coefficients of surface interactions that change between steps.
module emcon_deck_change_friction
   use emcon_deck_friction, only : read_friction
   use emcon_deck_reader, only : card_error, card_t, has_option, need_name, reader_t
   use emcon_diagnostics, only : quoted, suggestion
   use emcon_interactions, only : pressure_hard
   use emcon_kinds, only : wp
   use emcon_name_index, only : name_index_find
   implicit none
   private
   public :: read_friction_changes

contains

   !> The coefficients of all steps; those of the model are known. A change holds from the start of
   !> its step on, until the next one.
   subroutine read_friction_changes(reader)
      type(reader_t), intent(inout) :: reader
      real(wp) :: first(size(reader%interaction))
      integer :: i, changes

      first = reader%interaction%friction
      changes = 0
      do i = 1, size(reader%card)
         associate (card => reader%card(i))
            select case (card%name)
            case ("CHANGEFRICTION")
               if (changes > 0) call missing(reader, i)
               call find_interaction(reader, card, changes)
               if (changes == 0 .or. .not. has_option(card, "RESET")) cycle
               call change(reader, changes, card%step, first(changes))
               changes = 0
            case ("FRICTION")
               if (card%step > 0) call read_change(reader, card, changes)
               changes = 0
            case ("ENDSTEP")
               if (changes > 0) call missing(reader, i)
               changes = 0
            end select
         end associate
      end do
      do i = 1, size(reader%interaction)
         associate (surface => reader%interaction(i))
            if (allocated(surface%friction_of_step)) surface%friction = max(surface%friction, &
               maxval(surface%friction_of_step))
         end associate
      end do
   end subroutine read_friction_changes

   !> The error of a change without a coefficient before card `i`.
   subroutine missing(reader, i)
      type(reader_t), intent(inout) :: reader
      integer, intent(in) :: i

      call card_error(reader, reader%card(i), "*CHANGE FRICTION before has no *FRICTION with the " &
         // "coefficient below it, and no RESET")
   end subroutine missing

   !> The interaction that a card changes; 0: none, which is told.
   subroutine find_interaction(reader, card, changes)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      integer, intent(out) :: changes
      character(len=:), allocatable :: name

      changes = 0
      call need_name(reader, card, "INTERACTION", name)
      if (name == "") return
      changes = name_index_find(reader%names%interactions, name)
      if (changes == 0) then
         if (.not. reader%doubt%names) call card_error(reader, card, "unknown surface " &
            // "interaction " // quoted(name) // suggestion(name, reader%interaction_name))
         return
      end if
      if (reader%interaction(changes)%pressure%kind == pressure_hard) return
      call card_error(reader, card, "the surface interaction " // quoted(name) // " has a " &
         // "pressure by its overclosure: the energy stored in sticking contacts would be " // &
         "lost; its " &
         // "coefficient holds for the whole run")
      changes = 0
   end subroutine find_interaction

   !> A coefficient in a step, for interaction `changes`.
   subroutine read_change(reader, card, changes)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      integer, intent(in) :: changes                 !! 0: none, or an unknown one
      real(wp) :: coefficient, stick

      coefficient = 0.0_wp
      call read_friction(reader, card, coefficient, stick)
      if (has_option(card, "RESTITUTION")) call card_error(reader, card, "in a step the " &
         // "coefficient alone changes: RESTITUTION is for the model")
      if (changes > 0) then
         call change(reader, changes, card%step, coefficient)
      else if (.not. reader%doubt%names) then
         call card_error(reader, card, "in a step *FRICTION stands below *CHANGE FRICTION, " &
            // "which names its surface interaction")
      end if
   end subroutine read_change

   !> From a step on.
   subroutine change(reader, i, step, coefficient)
      type(reader_t), intent(inout) :: reader
      integer, intent(in) :: i, step
      real(wp), intent(in) :: coefficient

      associate (surface => reader%interaction(i))
         if (.not. allocated(surface%friction_of_step)) allocate(surface%friction_of_step( &
            maxval(reader%card%step)), source=surface%friction)
         surface%friction_of_step(step:) = coefficient
      end associate
   end subroutine change

end module emcon_deck_change_friction
