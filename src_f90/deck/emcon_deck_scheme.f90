!> *TIME INTEGRATION: the scheme of dynamic steps, its number, and what it does not go with.
module emcon_deck_scheme
   use emcon_deck_options, only : check_option
   use emcon_deck_reader, only : card_error, card_t, has_option, option_name, reader_t
   use emcon_diagnostics, only : add_error, add_warning
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_scheme, only : scheme_row_t, setting_t
   use emcon_scheme_registry, only : n_setting_range, scheme_user_row, scheme_row, &
      setting_range, setting_range_t
   use emcon_steps, only : initiation_massless, initiation_velocity_update, step_is_dynamic, &
      step_t
   use emcon_text, only : read_real, squeezed, to_text
   implicit none
   private
   public :: read_scheme, check_schemes

contains

   !> *TIME INTEGRATION: the scheme of dynamic steps from this one on, or the name of one that a
   !> program gives.
   subroutine read_scheme(reader, card, step)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(step_t), intent(inout) :: step
      integer :: code

      step%choice%origin = card%origin
      step%choice%name = option_name(card, "SCHEME")
      step%choice%row = scheme_row("DYNAMIC", step%choice%name)
      if (step%choice%row%code == 0) then
         step%choice%row = scheme_user_row
      else
         code = step%choice%row%code
         call check_option(reader, card, "SCHEME", "scheme", code)
      end if
      call read_setting(reader, card, step%choice%row)
   end subroutine read_scheme

   !> The number of a scheme.
   subroutine read_setting(reader, card, row)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scheme_row_t), intent(inout) :: row
      character(len=:), allocatable :: text, given
      type(setting_range_t) :: range
      real(wp) :: value
      logical :: ok
      integer :: i

      given = ""
      do i = 1, n_setting_range()
         range = setting_range(i)
         if (.not. has_option(card, squeezed(range%word)) .or. range%word == given) cycle
         text = trim(range%word) // "=" // option_name(card, squeezed(range%word))
         if (range%code /= row%code) then
            call card_error(reader, card, text // " is not of SCHEME=" // &
               option_name(card, "SCHEME"))
            cycle
         end if
         if (given /= "") call card_error(reader, card, "either " // given // " or " // &
            trim(range%word) // " is to be given")
         given = trim(range%word)
         call read_real(option_name(card, squeezed(range%word)), value, ok)
         if (ok) ok = value >= range%least .and. value <= range%most
         if (ok) then
            row%setting = setting_t(range%word, value)
         else
            call card_error(reader, card, text // " is not a number from " // trim(range%range))
         end if
      end do
   end subroutine read_setting

   !> What changes velocities where a step ends, or takes mass away, is not for all schemes.
   subroutine check_schemes(reader, pair, step)
      type(reader_t), intent(inout) :: reader
      type(contact_pair_t), intent(in) :: pair(:)
      type(step_t), intent(in) :: step(:)
      integer :: k

      call warn_of_no_use(reader, step)
      do k = 1, size(step)
         associate (row => step(k)%scheme, initiation => step(k)%contact%initiation)
            if (initiation == initiation_massless .and. .not. row%takes_massless) call refuse( &
               "*CONTACT INITIATION, TYPE=MASSLESS, in step ", "nodes without mass")
            if (row%takes_jumps) cycle
            if (initiation == initiation_velocity_update) call refuse( &
               "*CONTACT INITIATION, TYPE=VELOCITY UPDATE, in step ", "velocities that jump")
            if (any(pair%interaction%restitution < 1.0_wp)) call refuse( &
               "RESTITUTION below 1, in step ", "velocities that jump")
         end associate
      end do

   contains

      subroutine refuse(what, makes)
         character(len=*), intent(in) :: what, makes

         call add_error(reader%log, step(k)%choice%origin, "SCHEME=" // &
            trim(step(k)%scheme%word) // " does not go with " // what // to_text(k) // &
            ", which makes " // makes // "; use SCHEME=ENERGY MOMENTUM")
      end subroutine refuse

   end subroutine check_schemes

   !> A card of static steps after which no dynamic one comes.
   subroutine warn_of_no_use(reader, step)
      type(reader_t), intent(inout) :: reader
      type(step_t), intent(in) :: step(:)
      integer :: k

      do k = 1, size(step)
         if (step(k)%choice%origin%line == 0 .or. any(step_is_dynamic(step(k:)))) cycle
         if (step(k)%choice%name == "") cycle     ! a TOLERANCE alone is refused in static steps
         if (any(step(:k - 1)%choice%origin%line == step(k)%choice%origin%line .and. &
            step(:k - 1)%choice%origin%file == step(k)%choice%origin%file)) cycle
         call add_warning(reader%log, step(k)%choice%origin, "*TIME INTEGRATION: it has no " &
            // "effect: no dynamic step follows")
      end do
   end subroutine warn_of_no_use

end module emcon_deck_scheme
