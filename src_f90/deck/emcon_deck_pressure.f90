!> *SURFACE BEHAVIOR: pressures by the overclosure, and the steps in which contact gives way by
!> them.
module emcon_deck_pressure
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, get_real, next_line, &
      refuse_lines
   use emcon_deck_reader, only : card_error, card_t, option_word, reader_t
   use emcon_diagnostics, only : add_error, add_warning, entries
   use emcon_interactions, only : contact_pair_t, formulation_nts, pressure_exponential, &
      pressure_hard, pressure_linear, pressure_t, pressure_tabular, pressure_tied
   use emcon_kinds, only : wp
   use emcon_steps, only : initiation_massless, initiation_velocity_update, method_null_space, &
      method_penalty, step_initiation, step_is_dynamic, step_t
   use emcon_text, only : string_t, to_text
   implicit none
   private
   public :: read_behavior, soften_steps

   !> Numbers of a line of EXPONENTIAL, of a table, and of LINEAR at most.
   integer, parameter :: n_of_exponential = 2, n_of_pair = 2, most_numbers = 3
   character(len=*), parameter :: behavior = "PRESSURE-OVERCLOSURE"

contains

   !> The pressure of a card and its lines.
   subroutine read_behavior(reader, card, pressure)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(pressure_t), intent(inout) :: pressure
      character(len=:), allocatable :: word
      integer :: n_before

      call option_word(reader, card, behavior, "HARD, LINEAR, EXPONENTIAL, TABULAR, TIED", word, &
         "SCALE FACTOR", "give the pressures as LINEAR or TABULAR")
      n_before = reader%log%n_errors
      pressure = pressure_t()
      select case (word)
      case ("HARD"); call refuse_lines(reader, card)
      case ("LINEAR"); call read_linear(reader, card, pressure)
      case ("EXPONENTIAL"); call read_exponential(reader, card, pressure)
      case ("TABULAR"); call read_table(reader, card, pressure)
      case ("TIED"); call read_tied(reader, card, pressure)
      end select
      if (reader%log%n_errors > n_before) pressure = pressure_t()
   end subroutine read_behavior

   !> `K, sigma_inf, c0`: the last one says up to where others let surfaces pull.
   subroutine read_linear(reader, card, pressure)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(pressure_t), intent(inout) :: pressure
      real(wp) :: clearance

      call read_numbers(reader, card, 1, "slope, tension, clearance", pressure%slope, &
         pressure%tension, clearance)
      pressure%kind = pressure_linear
   end subroutine read_linear

   !> `K`, by which others let surfaces give way that are tied.
   subroutine read_tied(reader, card, pressure)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(pressure_t), intent(inout) :: pressure
      real(wp) :: tension, clearance

      call read_numbers(reader, card, 0, "stiffness", pressure%slope, tension, clearance)
      pressure%kind = pressure_tied
   end subroutine read_tied

   !> `c0, p0`.
   subroutine read_exponential(reader, card, pressure)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(pressure_t), intent(inout) :: pressure

      call read_numbers(reader, card, n_of_exponential, "clearance, pressure at zero gap", &
         pressure%clearance, pressure%at_touch)
      pressure%kind = pressure_exponential
   end subroutine read_exponential

   !> The numbers of the one line of a card: the first `least` positive, others 0 or more, and 0 if
   !> they are missing.
   subroutine read_numbers(reader, card, least, what, first, second, third)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      integer, intent(in) :: least
      character(len=*), intent(in) :: what
      real(wp), intent(out) :: first, second
      real(wp), intent(out), optional :: third
      type(data_t) :: data
      type(string_t) :: words(most_numbers)
      real(wp) :: value(most_numbers)
      integer :: k, n

      words(:size(entries(what))) = entries(what)
      n = merge(size(value), size(value) - 1, present(third))
      value = 0.0_wp
      call data_open(data, card)
      if (next_line(reader, data)) then
         call check_count(reader, data, least, n, what)
         do k = 1, min(data%n, n)
            if (data%ok) call get_real(reader, data, k, words(k)%text, value(k))
            if (.not. data%ok) cycle
            if (k <= least .and. .not. value(k) > 0.0_wp) then
               call data_error(reader, data, "the " // words(k)%text // " " // to_text(value(k)) &
                  // " is not positive")
            else if (value(k) < 0.0_wp) then
               call data_error(reader, data, "the " // words(k)%text // " " // to_text(value(k)) &
                  // " is negative")
            end if
         end do
         if (next_line(reader, data)) call data_error(reader, data, "only one data line is read")
      else if (least > 0) then
         call card_error(reader, card, "a data line with " // what // " is missing")
      end if
      first = value(1)
      second = value(n_of_exponential)
      if (present(third)) third = value(most_numbers)
   end subroutine read_numbers

   !> `pressure, overclosure` from line to line: from pressure 0 on, both ascending.
   subroutine read_table(reader, card, pressure)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(pressure_t), intent(inout) :: pressure
      type(data_t) :: data
      real(wp) :: push, over

      allocate(pressure%pressure(0), pressure%overclosure(0))
      call data_open(data, card)
      do while (next_line(reader, data))
         call check_count(reader, data, n_of_pair, n_of_pair, "pressure, overclosure")
         if (data%ok) call get_real(reader, data, 1, "pressure", push)
         if (data%ok) call get_real(reader, data, n_of_pair, "overclosure", over)
         if (.not. data%ok) cycle
         associate (n => size(pressure%pressure), p => pressure%pressure, &
               o => pressure%overclosure)
            if (n == 0 .and. abs(push) > 0.0_wp) then
               call data_error(reader, data, "the pressure of the first line is " // &
                  to_text(push) // ": a table begins with pressure 0")
            else if (n > 0) then
               if (.not. (push >= p(n) .and. over > o(n))) call data_error(reader, data, &
                  "pressure " // to_text(push) // " at overclosure " // to_text(over) // &
                  " follows " // to_text(p(n)) // " at " // to_text(o(n)) // ": from line to " // &
                  "line overclosures have to rise, and pressures may not fall")
            end if
            if (n == 0 .and. over > 0.0_wp) then
               p = [0.0_wp]
               o = [0.0_wp]
            end if
         end associate
         pressure%pressure = [pressure%pressure, push]
         pressure%overclosure = [pressure%overclosure, over]
      end do
      pressure%kind = pressure_tabular
      if (size(pressure%pressure) < 2) then
         call card_error(reader, card, "a table has two lines at least: pressure, overclosure")
      else if (.not. maxval(pressure%pressure) > 0.0_wp) then
         call card_error(reader, card, "no pressure of the table is positive")
      end if
   end subroutine read_table

   !> Contact of surfaces with a pressure gives way, in all steps. Others would hold exactly beside
   !> it: they give way by a penalty, if the deck says so.
   subroutine soften_steps(reader, pair, step)
      type(reader_t), intent(inout) :: reader
      type(contact_pair_t), intent(inout) :: pair(:)
      type(step_t), intent(inout) :: step(:)
      integer :: i, k

      i = findloc(pair%interaction%pressure%kind /= pressure_hard, .true., 1)
      if (i == 0) return
      do k = 1, size(step)
         if (step(k)%contact%method == method_null_space .and. &
            step(k)%contact%penalty%origin%line == 0) then
            step(k)%contact%method = method_penalty
            call check_hard(reader, pair, i)
         else if (step(k)%contact%method /= method_penalty) then
            call refuse("*CONSTRAINT METHOD of step " // to_text(k) // ", which holds gaps; " // &
               "leave it out, or use TYPE=PENALTY")
         end if
         if (.not. step_is_dynamic(step(k))) cycle
         if (any(step_initiation(step(k)) == [initiation_massless, &
            initiation_velocity_update])) call refuse("*CONTACT INITIATION of step " // &
            to_text(k) // ": soft contact needs nodes with mass, and velocities that do not jump")
      end do
      if (any(pair%interaction%restitution < 1.0_wp .and. &
         pair%interaction%pressure%kind /= pressure_hard)) call refuse("RESTITUTION below 1: " // &
         "soft contact has no instant at which velocities jump; use *CONTACT DAMPING")
      call suit_tensions(reader, pair)

   contains

      subroutine refuse(what)
         character(len=*), intent(in) :: what

         call add_error(reader%log, pair(i)%origin, "*CONTACT PAIR: the PRESSURE-OVERCLOSURE of " &
            // "its surface interaction does not go with " // what)
      end subroutine refuse

   end subroutine soften_steps

   !> Pairs without a pressure beside those that have one.
   subroutine check_hard(reader, pair, i_soft)
      type(reader_t), intent(inout) :: reader
      type(contact_pair_t), intent(in) :: pair(:)
      integer, intent(in) :: i_soft
      integer :: i

      do i = 1, size(pair)
         if (pair(i)%interaction%pressure%kind /= pressure_hard .or. &
            pair(i)%origin%line == pair(i_soft)%origin%line) cycle
         call add_error(reader%log, pair(i)%origin, "*CONTACT PAIR: it is hard, but other " // &
            "pairs have a PRESSURE-OVERCLOSURE: give it one, too, or make it soft by " // &
            "*CONSTRAINT METHOD, TYPE=PENALTY in the step")
         return
      end do
   end subroutine check_hard

   !> A tension is of nodes on surfaces; what pulls is left out.
   subroutine suit_tensions(reader, pair)
      type(reader_t), intent(inout) :: reader
      type(contact_pair_t), intent(inout) :: pair(:)
      integer :: i

      do i = 1, size(pair)
         if (.not. pair(i)%interaction%pressure%tension > 0.0_wp) cycle
         if (pair(i)%formulation /= formulation_nts) then
            pair(i)%interaction%pressure%tension = 0.0_wp
         else if (i == findloc(pair%interaction%pressure%tension > 0.0_wp, .true., 1)) then
            call add_warning(reader%log, pair(i)%origin, "*CONTACT PAIR: LINEAR with a tension: " &
               // "pressures bend into their line as with CalculiX, but surfaces that are " // &
               "apart do not pull at each other")
         end if
      end do
   end subroutine suit_tensions

end module emcon_deck_pressure
