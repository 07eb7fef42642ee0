!> What all readers of cards share: the cards with their parameters, the doubts, the messages.
module emcon_deck_reader
   use emcon_amplitudes, only : amplitude_t
   use emcon_deck_labels, only : label_map_t
   use emcon_deck_text, only : bare_name, option_length, option_place, option_t, option_value
   use emcon_diagnostics, only : add_error, add_warning, diagnostics_t, entries, quoted, suggestion
   use emcon_interactions, only : interaction_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : named_set_t
   use emcon_name_index, only : name_index_t
   use emcon_origin, only : origin_t
   use emcon_text, only : read_integer, read_real, squeezed, string_t, to_text
   implicit none
   private
   public :: reader_t, doubts_t, names_t, card_t, max_name
   public :: line_origin, source_line, card_error, card_warning, note_idle
   public :: n_cards, n_lines
   public :: has_option, option_name, option_count, option_number, option_real, option_angle
   public :: need_name, option_word, refuse_option

   integer, parameter :: max_name = 80             !! characters of a name
   real(wp), parameter :: above_zero = nearest(0.0_wp, 1.0_wp)

   !> One keyword with its parameters and the place of its data lines.
   type :: card_t
      character(len=:), allocatable :: name        !! upper case, without blanks; empty: unusable
      character(len=:), allocatable :: title       !! the name for messages, with its star
      type(origin_t) :: origin
      type(option_t), allocatable :: option(:)
      integer :: first = 1, last = 0               !! source lines of the data
      integer :: step = 0                          !! number of the step it stands in, 0: none
      integer :: first_item = 1, last_item = 0     !! nodes or elements that it defined
      logical :: is_unresolved = .false.           !! it has an unknown parameter, told already
      logical :: is_idle = .false.                 !! it changes nothing; it has no name
      logical :: is_parametric = .false.           !! it names parameters: may serve several scenes
   end type card_t

   !> Which unknown names may be consequences of errors that have been told already, and are not
   !> told again.
   type :: doubts_t
      logical :: nodes = .false.
      logical :: elements = .false.
      logical :: names = .false.
      logical :: positions = .false.                     !! some node is not where it should be
      logical :: shapes = .false.                        !! some element is not what it should be
      logical :: equations = .false.                     !! some equation is missing after an error
      logical :: rigid = .false.                         !! so is some rigid body
      logical :: prescribed = .false.                    !! so is some prescribed degree of freedom
   end type doubts_t

   !> Where things stand in their lists, by name.
   type :: names_t
      type(name_index_t) :: node_sets, element_sets, line_sets
      type(name_index_t) :: surfaces, materials, amplitudes, interactions, times
   end type names_t

   !> The state of a reading.
   type :: reader_t
      type(string_t), pointer :: line(:) => null()       !! view of the source
      integer, pointer :: file(:) => null(), number(:) => null()
      type(string_t), allocatable :: patched(:)          !! lines with parameters put in
      logical, allocatable :: is_unresolved(:)           !! lines with an unknown parameter
      type(card_t), allocatable :: card(:)
      type(diagnostics_t) :: log
      logical :: is_lenient = .false.
      integer :: n_dim = 0                               !! of the model
      logical :: is_flat = .true.                        !! and not one of solids of revolution
      type(doubts_t) :: doubt
      type(label_map_t) :: node_map
      type(label_map_t) :: element_map                   !! also of lines, these below 0
      integer, allocatable :: line_label(:)              !! (n_line) elements that are edges only
      integer, allocatable :: line_node(:, :)            !! (2, n_line), 0: it had errors
      type(named_set_t), allocatable :: line_set(:)      !! the lines of element sets that have some
      type(names_t) :: names
      type(string_t), allocatable :: interaction_name(:)
      type(interaction_t), allocatable :: interaction(:)
      type(amplitude_t), allocatable :: time_points(:)   !! only names and times
   end type reader_t

contains

   !> Number of cards called `name`.
   pure integer function n_cards(reader, name)
      type(reader_t), intent(in) :: reader
      character(len=*), intent(in) :: name
      integer :: i

      n_cards = count([(reader%card(i)%name == name, i = 1, size(reader%card))])
   end function n_cards

   !> Number of their data lines: no fewer than what they define.
   pure integer function n_lines(reader, name)
      type(reader_t), intent(in) :: reader
      character(len=*), intent(in) :: name
      integer :: i

      n_lines = 0
      do i = 1, size(reader%card)
         if (reader%card(i)%name == name) n_lines = n_lines + reader%card(i)%last &
            - reader%card(i)%first + 1
      end do
   end function n_lines

   pure type(origin_t) function line_origin(reader, i_line)
      type(reader_t), intent(in) :: reader
      integer, intent(in) :: i_line

      line_origin = origin_t(reader%file(i_line), reader%number(i_line))
   end function line_origin

   !> Text of a source line, with parameters put in.
   subroutine source_line(reader, i_line, text)
      type(reader_t), intent(in) :: reader
      integer, intent(in) :: i_line
      character(len=:), allocatable, intent(inout) :: text

      if (allocated(reader%patched)) then
         if (allocated(reader%patched(i_line)%text)) then
            text = reader%patched(i_line)%text
            return
         end if
      end if
      text = reader%line(i_line)%text
   end subroutine source_line

   subroutine card_error(reader, card, text)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: text

      if (.not. card%is_unresolved) then
         call add_error(reader%log, card%origin, card%title // ": " // text)
      end if
   end subroutine card_error

   !> Keep `name`, which changes nothing for this `reason`, for the log: each is named once.
   subroutine note_idle(reader, name, reason)
      type(reader_t), intent(inout) :: reader
      character(len=*), intent(in) :: name, reason
      character(len=:), allocatable :: line

      line = name // " (" // reason // ")"
      if (.not. allocated(reader%log%idle)) then
         reader%log%idle = line
      else if (index(", " // reader%log%idle, ", " // line) == 0) then
         reader%log%idle = reader%log%idle // ", " // line
      end if
   end subroutine note_idle

   subroutine card_warning(reader, card, text)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: text

      call add_warning(reader%log, card%origin, card%title // ": " // text)
   end subroutine card_warning

   pure logical function has_option(card, name)
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: name

      has_option = option_place(card%option, name) > 0
   end function has_option

   !> Value of a parameter as a name (upper case, no blanks, no quotes); empty if it is absent.
   pure function option_name(card, name) result(value)
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: name
      character(len=option_length(card%option, name)) :: value

      value = option_value(card%option, name)
   end function option_name

   !> The name that a card must give by `option`. Empty, with an error, if it does not.
   subroutine need_name(reader, card, option, name)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: option
      character(len=:), allocatable, intent(out) :: name
      character(len=:), allocatable :: fault

      name = option_name(card, option)
      fault = ""
      if (name == "") then
         reader%doubt%names = .true.
         if (.not. has_option(card, option)) call card_error(reader, card, option // "= is missing")
      else if (len(name) > max_name) then
         fault = " is longer than " // to_text(max_name) // " characters"
      else if (scan(name(1:1), "'""") > 0) then
         fault = " has a quote that is not closed"
      else if (index(name, ",") > 0 .and. any(card%name == [character(len=7) :: "NODE", "NSET", &
         "ELEMENT", "ELSET", "SURFACE"])) then
         fault = ": commas separate the values of data lines, where this name would stand"
      end if
      if (fault == "") return
      call card_error(reader, card, option // "=" // quoted(name) // fault)
      name = ""
      reader%doubt%names = .true.
   end subroutine need_name

   !> Value of a parameter that counts, from `least` to `most`; unchanged if it is absent or wrong.
   subroutine option_count(reader, card, name, least, value, most)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: name
      integer, intent(in) :: least
      integer, intent(inout) :: value
      integer, intent(in), optional :: most
      character(len=:), allocatable :: range_text
      integer :: i, number
      logical :: ok

      i = option_place(card%option, name)
      if (i == 0) return
      range_text = "of at least " // to_text(least)
      call read_integer(card%option(i)%value, number, ok)
      if (ok) ok = number >= least
      if (present(most)) then
         range_text = "from " // to_text(least) // " to " // to_text(most)
         if (ok) ok = number <= most
      end if
      if (ok) then
         value = number
      else
         call card_error(reader, card, name // "=" // quoted(card%option(i)%value) &
            // " is not a whole number " // range_text)
      end if
   end subroutine option_count

   !> Value of a parameter that is a number from `least` to `most`; unchanged if it is absent or
   !> wrong.
   subroutine option_number(reader, card, name, what, least, most, value)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: name         !! blanks are for the message
      character(len=*), intent(in) :: what         !! it is to be, for the message
      real(wp), intent(in) :: least, most
      real(wp), intent(inout) :: value
      real(wp) :: number
      integer :: i
      logical :: ok

      i = option_place(card%option, squeezed(name))
      if (i == 0) return
      call read_real(card%option(i)%value, number, ok)
      if (ok) ok = number >= least .and. number <= most
      if (ok) value = number
      if (.not. ok) call card_error(reader, card, name // "=" // quoted(card%option(i)%value) &
         // " is not " // what)
   end subroutine option_number

   !> The same of a positive number.
   subroutine option_real(reader, card, name, value)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: name         !! blanks are for the message
      real(wp), intent(inout) :: value

      call option_number(reader, card, name, "a positive number", above_zero, huge(value), value)
   end subroutine option_real

   !> The same of FEATURE ANGLE.
   subroutine option_angle(reader, card, value)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      real(wp), intent(inout) :: value             !! [degrees]

      call option_number(reader, card, "FEATURE ANGLE", "a number of degrees above 0 and below " &
         // "180", above_zero, nearest(180.0_wp, -1.0_wp), value)
   end subroutine option_angle

   !> The word of a parameter that is one of `known`, the first one if it is absent; empty if it is
   !> refused.
   subroutine option_word(reader, card, name, known, word, foreign, reason)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: known        !! "A, B", as it is told
      character(len=:), allocatable, intent(out) :: word   !! without blanks
      character(len=*), intent(in), optional :: foreign   !! words of other programs
      character(len=*), intent(in), optional :: reason     !! why these are refused

      word = option_name(card, name)
      if (word == "") then
         word = squeezed(known(:scan(known // ",", ",") - 1))
      else if (.not. is_in(known)) then
         if (present(foreign)) then
            if (is_in(foreign)) call refuse_option(reader, card, name, known, reason)
            if (is_in(foreign)) word = ""
         end if
         if (word /= "") call refuse_option(reader, card, name, known, "")
         word = ""
      end if

   contains

      pure logical function is_in(list)
         character(len=*), intent(in) :: list

         is_in = index("," // squeezed(list) // ",", "," // word // ",") > 0
      end function is_in

   end subroutine option_word

   !> An error: the value of a parameter is none of `known`; a `reason` says why.
   subroutine refuse_option(reader, card, name, known, reason)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: known        !! the accepted values, for the message
      character(len=*), intent(in) :: reason       !! empty: the value is not known at all
      integer :: i

      i = option_place(card%option, name)
      if (reason == "") then
         call card_error(reader, card, "unknown " // name // "=" // quoted(card%option(i)%value) &
            // "; known: " // known &
            // suggestion(bare_name(card%option(i)%value), entries(known)))
      else
         call card_error(reader, card, name // "=" // quoted(card%option(i)%value) &
            // " is known but not supported (" // reason // "); supported: " // known)
      end if
   end subroutine refuse_option

end module emcon_deck_reader
