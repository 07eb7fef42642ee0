!> Lines of a deck as text: which are cards and which comments, keywords with their parameters, and
!> fields between commas. What they mean nobody knows here.
module emcon_deck_text
   use emcon_text, only : squeezed, string_t, stripped
   implicit none
   private
   public :: option_t, fields_t
   public :: is_card, is_comment, keyword_of, gather_keyword, split_keyword, bare_name
   public :: option_place, option_value, option_length
   public :: split_fields, is_blank, field

   character(len=*), parameter :: blanks = " " // achar(9) // achar(11) // achar(12)
   character(len=1), parameter :: end_of_text = achar(26)      !! how old systems end a text
   !> A keyword that goes on in the next line does so with none of these.
   character(len=*), parameter :: no_parameter = "*+-.0123456789,"
   !> Longer keywords are none.
   integer, parameter :: longest_keyword = 40

   !> One parameter of a card.
   type :: option_t
      character(len=:), allocatable :: name        !! upper case, without blanks
      character(len=:), allocatable :: typed       !! the name as it stands in the deck
      character(len=:), allocatable :: value       !! as typed
      logical :: has_value = .false.
   end type option_t

   !> A data line taken apart.
   type :: fields_t
      character(len=:), allocatable :: text
      integer :: n = 0                             !! fields; empty ones at the end do not count
      logical :: ends_in_comma = .false.
      integer, allocatable :: from(:), to(:)       !! (n) extent of each field, without blanks
   end type fields_t

contains

   pure logical function is_card(line)
      character(len=*), intent(in) :: line
      integer :: first

      first = verify(line, blanks)
      is_card = first > 0
      if (is_card) is_card = line(first:first) == "*"
      if (is_card .and. first < len(line)) is_card = line(first + 1:first + 1) /= "*"
   end function is_card

   pure logical function is_comment(line)
      character(len=*), intent(in) :: line
      integer :: first

      first = verify(line, blanks // end_of_text)
      is_comment = first == 0
      if (first > 0 .and. first < len(line)) is_comment = line(first:first + 1) == "**"
   end function is_comment

   !> The keyword of a line, upper case, without blanks and star; empty: it has none.
   pure function keyword_of(line) result(name)
      character(len=*), intent(in) :: line
      character(len=longest_keyword) :: name

      name = ""
      if (is_card(line)) name = squeezed(line(index(line, "*") + 1:index(line // ",", ",") - 1))
   end function keyword_of

   !> The keyword line `i` with the lines it goes on in after a comma at its end; `i` becomes the
   !> last of them. A comma before another keyword or before a number is only a comma too many.
   pure subroutine gather_keyword(line, i, text)
      type(string_t), intent(in) :: line(:)
      integer, intent(inout) :: i
      character(len=:), allocatable, intent(out) :: text
      integer :: next, first

      text = stripped(line(i)%text, blanks)
      do while (text(len(text):) == ",")
         next = i + 1
         do while (next <= size(line))
            if (.not. is_comment(line(next)%text)) exit
            next = next + 1
         end do
         if (next > size(line)) exit
         first = verify(line(next)%text, blanks)
         if (scan(line(next)%text(first:first), no_parameter) == 1) exit
         text = text // stripped(line(next)%text, blanks)
         i = next
      end do
   end subroutine gather_keyword

   !> Take `*TITLE, NAME=VALUE, NAME` apart.
   pure subroutine split_keyword(text, title, name, option)
      character(len=*), intent(in) :: text
      character(len=:), allocatable, intent(out) :: title      !! as typed, with its star
      character(len=:), allocatable, intent(out) :: name       !! upper case, no blanks and star
      type(option_t), allocatable, intent(out) :: option(:)
      integer :: i_comma

      i_comma = index(text // ",", ",")
      title = stripped(text(:i_comma - 1), blanks)
      name = squeezed(text(2:i_comma - 1))
      call split_options(text(i_comma:), option)
   end subroutine split_keyword

   !> Take `,NAME=VALUE,NAME` apart.
   pure subroutine split_options(text, option)
      character(len=*), intent(in) :: text
      type(option_t), allocatable, intent(out) :: option(:)
      integer :: i, n, first, i_equal
      character(len=1) :: quote
      character(len=:), allocatable :: part

      allocate(option(count([(text(i:i) == ",", i = 1, len(text))])))
      n = 0
      first = 2
      quote = " "
      do i = 2, len(text) + 1
         if (i <= len(text)) then
            if (quote /= " ") then
               if (text(i:i) == quote) quote = " "
               cycle
            else if (scan(text(i:i), "'""") == 1 .and. index(text(i + 1:), text(i:i)) > 0) then
               quote = text(i:i)
               cycle
            end if
            if (text(i:i) /= ",") cycle
         end if
         part = stripped(text(first:i - 1), blanks)
         first = i + 1
         if (part == "") cycle
         n = n + 1
         i_equal = index(part, "=")
         option(n)%has_value = i_equal > 0
         if (i_equal == 0) i_equal = len(part) + 1
         option(n)%typed = stripped(part(:i_equal - 1), blanks)
         option(n)%name = squeezed(option(n)%typed)
         option(n)%value = stripped(part(i_equal + 1:), blanks)
      end do
      option = option(:n)
   end subroutine split_options

   !> Where a parameter stands among those of a card; 0: nowhere.
   pure integer function option_place(option, name) result(i)
      type(option_t), intent(in) :: option(:)
      character(len=*), intent(in) :: name

      do i = size(option), 1, -1
         if (option(i)%name == name) return
      end do
   end function option_place

   !> Value of a parameter as a name; empty if it is absent.
   pure function option_value(option, name) result(value)
      type(option_t), intent(in) :: option(:)
      character(len=*), intent(in) :: name
      character(len=option_length(option, name)) :: value
      integer :: i

      i = option_place(option, name)
      if (i > 0) value = bare_name(option(i)%value)
   end function option_value

   pure integer function option_length(option, name)
      type(option_t), intent(in) :: option(:)
      character(len=*), intent(in) :: name
      integer :: i

      option_length = 0
      i = option_place(option, name)
      if (i > 0) option_length = bare_length(option(i)%value)
   end function option_length

   !> A name as it is looked for: upper case, without blanks and quotes around it.
   pure function bare_name(text) result(name)
      character(len=*), intent(in) :: text
      character(len=bare_length(text)) :: name
      character(len=len(text)) :: word

      word = squeezed(text)
      name = word
      if (len(name) < len_trim(word)) name = word(2:)
   end function bare_name

   !> Quotes around a name do not count.
   pure integer function bare_length(text) result(n)
      character(len=*), intent(in) :: text
      character(len=len(text)) :: word

      word = squeezed(text)
      n = len_trim(word)
      if (n > 1) then
         if (scan(word(1:1), "'""") == 1 .and. word(1:1) == word(n:n)) n = n - 2
      end if
   end function bare_length

   !> Extents of the fields of `self%text`, or of `text`, between commas.
   pure subroutine split_fields(self, text)
      class(fields_t), intent(inout) :: self
      character(len=*), intent(in), optional :: text
      integer :: first, last, comma

      if (present(text)) self%text = text
      if (.not. allocated(self%from)) allocate(self%from(16), self%to(16))
      self%n = 0
      first = 1
      self%ends_in_comma = .false.
      do while (first <= len(self%text))
         do comma = first, len(self%text)
            if (self%text(comma:comma) == ",") exit
         end do
         last = comma - 1
         self%ends_in_comma = comma <= len(self%text)
         do while (first <= last)
            if (.not. is_space(self%text(first:first))) exit
            first = first + 1
         end do
         do while (last >= first)
            if (.not. is_space(self%text(last:last))) exit
            last = last - 1
         end do
         ! What follows the last comma may be blanks only.
         if (comma > len(self%text) .and. last < first) self%ends_in_comma = self%n > 0
         self%n = self%n + 1
         if (self%n > size(self%from)) then
            self%from = [self%from, self%from]
            self%to = [self%to, self%to]
         end if
         self%from(self%n) = first
         self%to(self%n) = last
         first = comma + 1
      end do
      do while (self%n > 0)
         if (self%to(self%n) >= self%from(self%n)) exit
         self%n = self%n - 1
      end do
   end subroutine split_fields

   pure logical function is_space(character_)
      character(len=1), intent(in) :: character_

      is_space = character_ == " " .or. (iachar(character_) >= 9 .and. iachar(character_) <= 13)
   end function is_space

   pure logical function is_blank(self, k)
      class(fields_t), intent(in) :: self
      integer, intent(in) :: k

      is_blank = k > self%n
      if (.not. is_blank) is_blank = self%to(k) < self%from(k)
   end function is_blank

   !> Field `k`, without blanks around it; empty: there is none.
   pure function field(self, k) result(word)
      class(fields_t), intent(in) :: self
      integer, intent(in) :: k
      character(len=field_length(self, k)) :: word

      if (len(word) > 0) word = self%text(self%from(k):self%to(k))
   end function field

   pure integer function field_length(self, k)
      class(fields_t), intent(in) :: self
      integer, intent(in) :: k

      field_length = 0
      if (.not. is_blank(self, k)) field_length = self%to(k) - self%from(k) + 1
   end function field_length

end module emcon_deck_text
