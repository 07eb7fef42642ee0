!> What all readers of cards share: the cards, their data lines taken apart, and the messages.
module emcon_deck_reader
   use emcon_deck_labels, only : label_map_t
   use emcon_diagnostics, only : add_error, add_warning, diagnostics_t, quoted, suggestion
   use emcon_kinds, only : wp
   use emcon_scene, only : amplitude_t, origin_t
   use emcon_text, only : read_integer, read_real, squeezed, string_t, to_text, to_upper
   implicit none
   private
   public :: reader_t, card_t, option_t, data_t
   public :: line_origin, source_line, split_fields, data_open, next_line
   public :: card_error, card_warning, data_error, data_warning
   public :: has_option, option_name, option_count, option_real, need_name, refuse_option
   public :: get_integer, get_real, get_name, is_blank, check_count, is_label, max_name

   integer, parameter :: max_name = 80             !! characters of a name

   !> One parameter of a card.
   type :: option_t
      character(len=:), allocatable :: name        !! upper case, without blanks
      character(len=:), allocatable :: value       !! as typed
      logical :: has_value = .false.
   end type option_t

   !> One keyword with its parameters and the place of its data lines.
   type :: card_t
      character(len=:), allocatable :: name        !! upper case, without blanks; empty: unusable
      character(len=:), allocatable :: title       !! the name for messages, with its star
      type(origin_t) :: origin
      type(option_t), allocatable :: option(:)
      integer :: first = 1, last = 0               !! source lines of the data
      integer :: step = 0                          !! number of the step it stands in, 0: none
      integer :: first_item = 1, last_item = 0     !! nodes or elements that it defined
   end type card_t

   !> The state of a reading. The doubts tell which unknown names may be consequences of errors
   !> that have been told already, and are not told again.
   type :: reader_t
      type(string_t), pointer :: line(:) => null()       !! view of the source
      integer, pointer :: file(:) => null(), number(:) => null()
      type(string_t), allocatable :: patched(:)          !! lines with parameters put in
      type(card_t), allocatable :: card(:)
      type(diagnostics_t) :: log
      logical :: is_lenient = .false.
      logical :: doubt_nodes = .false., doubt_elements = .false., doubt_names = .false.
      logical :: doubt_positions = .false.               !! some node is not where it should be
      type(label_map_t) :: node_map, element_map
      type(string_t), allocatable :: interaction(:)      !! names of surface interactions
      type(amplitude_t), allocatable :: time_points(:)   !! only names and times
   end type reader_t

   !> A data line taken apart, and the way to the next. `ok` is false once a field was refused.
   type :: data_t
      type(card_t) :: card
      integer :: i_line = 0
      integer :: n = 0                             !! fields; empty ones at the end do not count
      logical :: ends_in_comma = .false.
      logical :: ok = .true.
      character(len=:), allocatable :: text
      integer, allocatable :: from(:), to(:)       !! (n) extent of each field, without blanks
   end type data_t

contains

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

      call add_error(reader%log, card%origin, card%title // ": " // text)
   end subroutine card_error

   subroutine card_warning(reader, card, text)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: text

      call add_warning(reader%log, card%origin, card%title // ": " // text)
   end subroutine card_warning

   !> An error in the current data line.
   subroutine data_error(reader, data, text)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      character(len=*), intent(in) :: text

      data%ok = .false.
      call add_error(reader%log, line_origin(reader, data%i_line), data%card%title // ": " // text)
   end subroutine data_error

   subroutine data_warning(reader, data, text)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(in) :: data
      character(len=*), intent(in) :: text

      call add_warning(reader%log, line_origin(reader, data%i_line), &
         data%card%title // ": " // text)
   end subroutine data_warning

   ! --- parameters of a card ---

   pure integer function find_option(card, name)
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: name
      integer :: i

      find_option = 0
      do i = 1, size(card%option)
         if (card%option(i)%name == name) find_option = i
      end do
   end function find_option

   pure logical function has_option(card, name)
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: name

      has_option = find_option(card, name) > 0
   end function has_option

   !> Value of a parameter as a name (upper case, no blanks, no quotes); empty if it is absent.
   pure function option_name(card, name) result(value)
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: value
      integer :: i

      value = ""
      i = find_option(card, name)
      if (i > 0) value = bare_name(card%option(i)%value)
   end function option_name

   !> The name that a card must give by `option`. Empty, with an error, if it does not.
   subroutine need_name(reader, card, option, name)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: option
      character(len=:), allocatable, intent(out) :: name

      name = option_name(card, option)
      if (name == "") then
         reader%doubt_names = .true.
         call card_error(reader, card, option // "= is missing")
      else if (len(name) > max_name) then
         call card_error(reader, card, option // "=" // quoted(name) // " is longer than " &
            // to_text(max_name) // " characters")
         name = ""
         reader%doubt_names = .true.
      end if
   end subroutine need_name

   !> Value of a parameter that counts, at least `least`; unchanged if it is absent.
   subroutine option_count(reader, card, name, least, value)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: name
      integer, intent(in) :: least
      integer, intent(inout) :: value
      integer :: i, number
      logical :: ok

      i = find_option(card, name)
      if (i == 0) return
      call read_integer(card%option(i)%value, number, ok)
      if (ok) ok = number >= least
      if (ok) then
         value = number
      else
         call card_error(reader, card, name // "=" // quoted(card%option(i)%value) &
            // " is not a whole number of at least " // to_text(least))
      end if
   end subroutine option_count

   !> Value of a parameter that is a positive number; unchanged if it is absent.
   subroutine option_real(reader, card, name, value)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: value
      real(wp) :: number
      integer :: i
      logical :: ok

      i = find_option(card, name)
      if (i == 0) return
      call read_real(card%option(i)%value, number, ok)
      if (ok) ok = number > 0.0_wp
      if (ok) then
         value = number
      else
         call card_error(reader, card, name // "=" // quoted(card%option(i)%value) &
            // " is not a positive number")
      end if
   end subroutine option_real

   !> An error: the value of a parameter is none of `known`; a `reason` says why.
   subroutine refuse_option(reader, card, name, known, reason)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: known        !! the accepted values, for the message
      character(len=*), intent(in) :: reason       !! empty: the value is not known at all
      integer :: i

      i = find_option(card, name)
      if (reason == "") then
         call card_error(reader, card, "unknown " // name // "=" // quoted(card%option(i)%value) &
            // "; known: " // known)
      else
         call card_error(reader, card, name // "=" // quoted(card%option(i)%value) &
            // " is known but not supported (" // reason // "); supported: " // known)
      end if
   end subroutine refuse_option

   ! --- data lines ---

   !> Go before the first data line of `card`.
   subroutine data_open(data, card)
      type(data_t), intent(out) :: data
      type(card_t), intent(in) :: card

      data%card = card
      data%i_line = card%first - 1
      allocate(data%from(16), data%to(16))
   end subroutine data_open

   !> Take the next data line apart, comments and blank lines left out; false: there is none.
   logical function next_line(reader, data)
      type(reader_t), intent(in) :: reader
      type(data_t), intent(inout) :: data

      data%ok = .true.
      do while (data%i_line < data%card%last)
         data%i_line = data%i_line + 1
         call source_line(reader, data%i_line, data%text)
         call split_fields(data)
         next_line = data%n > 0 .or. data%ends_in_comma
         if (.not. next_line) cycle
         if (data%n == 0) return
         if (data%from(1) >= data%to(1)) return
         next_line = data%text(data%from(1):data%from(1) + 1) /= "**"
         if (next_line) return
      end do
      next_line = .false.
   end function next_line

   !> Extents of the fields of `data%text` between commas.
   subroutine split_fields(data)
      type(data_t), intent(inout) :: data
      integer :: first, last, comma

      data%n = 0
      first = 1
      data%ends_in_comma = .false.
      do while (first <= len(data%text))
         do comma = first, len(data%text)
            if (data%text(comma:comma) == ",") exit
         end do
         last = comma - 1
         data%ends_in_comma = comma <= len(data%text)
         do while (first <= last)
            if (.not. is_space(data%text(first:first))) exit
            first = first + 1
         end do
         do while (last >= first)
            if (.not. is_space(data%text(last:last))) exit
            last = last - 1
         end do
         ! What follows the last comma may be blanks only.
         if (comma > len(data%text) .and. last < first) data%ends_in_comma = data%n > 0
         data%n = data%n + 1
         if (data%n > size(data%from)) call grow_fields(data)
         data%from(data%n) = first
         data%to(data%n) = last
         first = comma + 1
      end do
      do while (data%n > 0)
         if (data%to(data%n) >= data%from(data%n)) exit
         data%n = data%n - 1
      end do
   end subroutine split_fields

   pure logical function is_space(character_)
      character(len=1), intent(in) :: character_

      is_space = character_ == " " .or. (iachar(character_) >= 9 .and. iachar(character_) <= 13)
   end function is_space

   subroutine grow_fields(data)
      type(data_t), intent(inout) :: data
      integer, allocatable :: grown(:)
      integer :: n

      n = size(data%from)
      allocate(grown(2*n))
      grown(:n) = data%from
      call move_alloc(grown, data%from)
      allocate(grown(2*n))
      grown(:n) = data%to
      call move_alloc(grown, data%to)
   end subroutine grow_fields

   pure logical function is_blank(data, k)
      type(data_t), intent(in) :: data
      integer, intent(in) :: k

      is_blank = k > data%n
      if (.not. is_blank) is_blank = data%to(k) < data%from(k)
   end function is_blank

   !> Whether field `k` is a whole number, hence no name.
   pure logical function is_label(data, k)
      type(data_t), intent(in) :: data
      integer, intent(in) :: k

      is_label = .not. is_blank(data, k)
      if (is_label) is_label = verify(data%text(data%from(k):data%to(k)), "+-0123456789") == 0
   end function is_label

   !> Refuse a line with fewer than `least` or more than `most` fields; `what` names them.
   subroutine check_count(reader, data, least, most, what)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: least, most
      character(len=*), intent(in) :: what

      if (data%n < least) then
         call data_error(reader, data, "expected " // what // ", found only " &
            // to_text(data%n) // merge(" value ", " values", data%n == 1))
      else if (data%n > most) then
         call data_error(reader, data, "expected " // what // ", found " // to_text(data%n) &
            // " values: " // quoted(data%text(data%from(most + 1):)) // " is too much")
      end if
   end subroutine check_count

   !> Read field `k` as a whole number of at least 1.
   subroutine get_integer(reader, data, k, what, value)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: k
      character(len=*), intent(in) :: what
      integer, intent(out) :: value
      logical :: ok

      value = 0
      if (is_blank(data, k)) then
         call data_error(reader, data, "the " // what // " is missing")
         return
      end if
      associate (word => data%text(data%from(k):data%to(k)))
         call read_integer(word, value, ok)
         if (.not. ok) then
            call data_error(reader, data, "the " // what // " " // quoted(word) &
               // " is not a whole number" // merge(" below 2147483648", "                 ", &
               verify(word, "+-0123456789") == 0))
         else if (value < 1) then
            call data_error(reader, data, "the " // what // " " // quoted(word) &
               // " is not positive")
         end if
      end associate
   end subroutine get_integer

   !> Read field `k` as a finite real; an empty field leaves `value` as it is.
   subroutine get_real(reader, data, k, what, value)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: k
      character(len=*), intent(in) :: what
      real(wp), intent(inout) :: value
      real(wp) :: number
      logical :: ok

      if (is_blank(data, k)) return
      associate (word => data%text(data%from(k):data%to(k)))
         call read_real(word, number, ok)
         if (ok) then
            value = number
         else
            call data_error(reader, data, "the " // what // " " // quoted(word) &
               // real_fault(word))
         end if
      end associate
   end subroutine get_real

   !> Why a word is not a real: " is not ...".
   pure function real_fault(word) result(fault)
      character(len=*), intent(in) :: word
      character(len=:), allocatable :: fault
      real(wp) :: mantissa
      integer :: n
      logical :: ok

      fault = " is not a number"
      n = scan(word, "+-")
      if (n /= 1) n = 0
      select case (to_upper(word(n + 1:)))
      case ("NAN", "INF", "INFINITY")
         fault = " is not a finite number"
         return
      end select
      if (verify(word, "+-.0123456789") == 0 .and. len(word) > range(1.0_wp)) fault = " is too large"
      n = scan(word, "EeDd")
      if (n < 2 .or. n == len(word)) return
      call read_real(word(:n - 1), mantissa, ok)
      if (.not. ok) return
      if (verify(word(n + 1:), "+0123456789") == 0 .and. scan(word, "0123456789", back=.true.) &
         == len(word)) fault = " is too large"
   end function real_fault

   !> Read field `k` as a name: upper case, no blanks, no quotes.
   subroutine get_name(reader, data, k, what, name)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: k
      character(len=*), intent(in) :: what
      character(len=:), allocatable, intent(out) :: name

      name = ""
      if (is_blank(data, k)) then
         call data_error(reader, data, "the " // what // " is missing")
         return
      end if
      name = bare_name(data%text(data%from(k):data%to(k)))
      if (len(name) > max_name) then
         call data_error(reader, data, "the name " // quoted(name) // " is longer than " &
            // to_text(max_name) // " characters")
      end if
   end subroutine get_name

   pure function bare_name(text) result(name)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: name
      integer :: n

      name = squeezed(text)
      n = len(name)
      if (n > 1) then
         if (scan(name(1:1), "'""") == 1 .and. name(1:1) == name(n:n)) name = name(2:n - 1)
      end if
   end function bare_name

end module emcon_deck_reader
