!> *CONTACT DAMPING of surface interactions, and what it does not go with.
module emcon_deck_contact_damping
   use emcon_deck_fields, only : data_error, data_open, data_t, drop_zeros, get_real, next_line
   use emcon_deck_reader, only : card_error, card_t, option_number, option_word, reader_t
   use emcon_diagnostics, only : add_error, add_warning
   use emcon_interactions, only : contact_damping_t, contact_pair_t
   use emcon_kinds, only : wp
   use emcon_steps, only : initiation_massless, method_penalty, step_initiation, &
      step_is_dynamic, step_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: read_contact_damping, check_contact_damping

contains

   !> The coefficient, pressure by velocity, the clearance from which on there is none, and the part
   !> of that up to which it is constant.
   subroutine read_contact_damping(reader, card, damping)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(contact_damping_t), intent(inout) :: damping
      type(data_t) :: data
      character(len=:), allocatable :: word
      integer :: n, n_before

      n_before = reader%log%n_errors
      damping = contact_damping_t()
      call option_word(reader, card, "DEFINITION", "DAMPING COEFFICIENT", word, &
         "CRITICAL DAMPING FRACTION", "critical damping is a fraction of a contact " // &
         "stiffness, and exact contact has none")
      call option_number(reader, card, "TANGENT FRACTION", "a number of 0 or more: the " // &
         "coefficient along the surface by that normal to it", 0.0_wp, huge(1.0_wp), &
         damping%tangent)
      call data_open(data, card)
      n = 0
      do while (next_line(reader, data))
         n = n + 1
         if (n == 2) call data_error(reader, data, "only one data line is read")
         if (n > 1) cycle
         call get_real(reader, data, 1, "damping coefficient", damping%coefficient)
         if (data%n > 1 .and. data%ok) call get_real(reader, data, 2, "clearance", &
            damping%clearance)
         if (data%n > 2 .and. data%ok) call get_real(reader, data, 3, "fraction of the clearance", &
            damping%flat)
         call drop_zeros(data, 3)
         if (data%ok) call check_line(reader, data, damping)
      end do
      if (n == 0) call card_error(reader, card, "a data line with the coefficient is missing")
      if (reader%log%n_errors > n_before) damping = contact_damping_t()
   end subroutine read_contact_damping

   !> The numbers of a data line, which could be read.
   subroutine check_line(reader, data, damping)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(contact_damping_t), intent(in) :: damping

      if (damping%coefficient < 0.0_wp) call data_error(reader, data, "the damping coefficient " &
         // to_text(damping%coefficient) // " is negative")
      if (damping%clearance < 0.0_wp) call data_error(reader, data, "the clearance " // &
         to_text(damping%clearance) // " is negative")
      if (damping%flat < 0.0_wp .or. damping%flat > 1.0_wp) call data_error(reader, data, &
         "the fraction of the clearance " // to_text(damping%flat) // " is not a number from 0 " &
         // "to 1")
      if (data%n > 3) call data_error(reader, data, "a coefficient, a clearance and a fraction " &
         // "of it are read; leave out what stands behind them")
   end subroutine check_line

   !> Damping is of steps whose scheme has its forces along discrete gradients, and of surfaces with
   !> mass.
   subroutine check_contact_damping(reader, pair, step)
      type(reader_t), intent(inout) :: reader
      type(contact_pair_t), intent(in) :: pair(:)
      type(step_t), intent(in) :: step(:)
      integer :: i, k

      do i = 1, size(pair)
         if (.not. pair(i)%interaction%damping%coefficient > 0.0_wp .or. pair(i)%is_reverse) cycle
         do k = 1, size(step)
            if (step(k)%scheme%takes_damping) cycle
            call add_error(reader%log, pair(i)%origin, "*CONTACT PAIR: its surface interaction " &
               // "has *CONTACT DAMPING, which does not go with SCHEME=" // &
               trim(step(k)%scheme%word) // " of step " // to_text(k) // &
               "; use SCHEME=ENERGY MOMENTUM, MIDPOINT or ENERGY DECAYING")
            exit
         end do
         if (.not. any(step_is_dynamic(step))) then
            call warn(pair(i), "damps nothing: there is no dynamic step")
            cycle
         end if
         if (any(step_initiation(step) == initiation_massless)) call &
            warn(pair(i), "needs nodes with mass: both surfaces keep theirs, and gaps are " // &
            "held as by PERSISTENT")
         if (pair(i)%interaction%damping%clearance > 0.0_wp &
            .or. pair(i)%interaction%damping%tangent > 0.0_wp) cycle
         if (.not. any(step%contact%method == method_penalty)) call warn(pair(i), &
            "damps nothing: nodes in exact contact do not move along its normal; give a " // &
            "clearance or a TANGENT FRACTION")
      end do

   contains

      subroutine warn(of_pair, what)
         type(contact_pair_t), intent(in) :: of_pair
         character(len=*), intent(in) :: what

         call add_warning(reader%log, of_pair%origin, "*CONTACT PAIR: the *CONTACT DAMPING of " &
            // "its surface interaction " // what)
      end subroutine warn

   end subroutine check_contact_damping

end module emcon_deck_contact_damping
