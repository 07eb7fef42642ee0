!> *DAMPING of materials, and what it does not go with.
module emcon_deck_damping
   use emcon_deck_reader, only : card_error, card_t, has_option, option_name, reader_t
   use emcon_diagnostics, only : add_error
   use emcon_kinds, only : wp
   use emcon_law_registry, only : law_user
   use emcon_materials, only : material_t
   use emcon_scene, only : scene_t
   use emcon_steps, only : initiation_massless, step_initiation
   use emcon_text, only : read_real, to_text
   implicit none
   private
   public :: read_damping, check_damping

contains

   !> ALPHA=, by mass, and BETA=, by moduli; what is not given is 0.
   subroutine read_damping(reader, card, material)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(material_t), intent(inout) :: material

      material%damping_origin = card%origin
      material%alpha = 0.0_wp
      material%beta = 0.0_wp
      call read_number(reader, card, "ALPHA", material%alpha)
      call read_number(reader, card, "BETA", material%beta)
      if (.not. (has_option(card, "ALPHA") .or. has_option(card, "BETA"))) call card_error(reader, &
         card, "ALPHA or BETA is to be given")
   end subroutine read_damping

   !> A parameter of 0 or more; 0 where it is absent.
   subroutine read_number(reader, card, name, value)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: value
      real(wp) :: number
      logical :: ok

      if (.not. has_option(card, name)) return
      call read_real(option_name(card, name), number, ok)
      if (ok) ok = number >= 0.0_wp
      if (ok) then
         value = number
      else
         call card_error(reader, card, name // "=" // option_name(card, name) // &
            " is not a number of 0 or more")
      end if
   end subroutine read_number

   !> Damping is booked exactly by schemes that keep energy, of bodies with mass at their surfaces,
   !> and by moduli that are known.
   subroutine check_damping(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer :: i, k

      do i = 1, size(scene%material)
         associate (material => scene%material(i))
            if (.not. max(material%alpha, material%beta) > 0.0_wp) cycle
            if (material%beta > 0.0_wp .and. material%law == law_user) call refuse( &
               "BETA of material " // material%name // ": the moduli at rest of *USER MATERIAL " &
               // "are not known; use ALPHA")
            k = findloc(scene%step%scheme%takes_damping, .false., 1)
            if (k > 0) call refuse("step " // to_text(k) // " has SCHEME=" // &
               trim(scene%step(k)%scheme%word) // ", which does not go with damped materials; " // &
               "use SCHEME=ENERGY MOMENTUM, MIDPOINT or ENERGY DECAYING")
            k = findloc(step_initiation(scene%step), initiation_massless, 1)
            if (k > 0) call refuse("step " // to_text(k) // " has *CONTACT INITIATION, " // &
               "TYPE=MASSLESS: forces of damping are left out of the balance of nodes without " // &
               "mass; use PERSISTENT")
         end associate
      end do

   contains

      subroutine refuse(what)
         character(len=*), intent(in) :: what

         call add_error(reader%log, scene%material(i)%damping_origin, "*DAMPING: " // what)
      end subroutine refuse

   end subroutine check_damping

end module emcon_deck_damping
