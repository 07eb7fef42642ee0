!> What is wrong with a deck: errors and warnings with file and line, collected, then told sorted.
module emcon_diagnostics
   use emcon_kinds, only : dp
   use emcon_origin, only : origin_t
   use emcon_printable, only : printable
   use emcon_sort, only : sort_order
   use emcon_text, only : joined, nearest_word, string_t, to_text
   implicit none
   private
   public :: diagnostics_t, add_error, add_warning, diagnostics_texts
   public :: quoted, suggestion, label_list, entries

   !> So many errors (and as many warnings) are told; the others are counted.
   integer, parameter :: max_told = 50
   !> So many labels of a list are named; the others are counted.
   integer, parameter :: max_labels = 10
   !> Longer words are cut in messages.
   integer, parameter :: max_word = 60

   type :: diagnostic_t
      type(origin_t) :: origin               !! file 0: not from a deck; line 0: the whole file
      logical :: is_error = .true.
      character(len=:), allocatable :: text
   end type diagnostic_t

   type :: diagnostics_t
      integer :: n_errors = 0
      integer :: n_warnings = 0
      character(len=:), allocatable :: idle              !! what is taken and changes nothing, why
      type(string_t), allocatable :: file_name(:)        !! as the user typed them
      type(diagnostic_t), allocatable, private :: item(:)
   end type diagnostics_t

contains

   subroutine add_error(self, origin, text)
      type(diagnostics_t), intent(inout) :: self
      type(origin_t), intent(in) :: origin
      character(len=*), intent(in) :: text

      call add(self, origin, .true., text)
      self%n_errors = self%n_errors + 1
   end subroutine add_error

   subroutine add_warning(self, origin, text)
      type(diagnostics_t), intent(inout) :: self
      type(origin_t), intent(in) :: origin
      character(len=*), intent(in) :: text

      call add(self, origin, .false., text)
      self%n_warnings = self%n_warnings + 1
   end subroutine add_warning

   subroutine add(self, origin, is_error, text)
      type(diagnostics_t), intent(inout) :: self
      type(origin_t), intent(in) :: origin
      logical, intent(in) :: is_error
      character(len=*), intent(in) :: text
      type(diagnostic_t), allocatable :: grown(:)
      integer :: n

      n = self%n_errors + self%n_warnings
      if (.not. allocated(self%item)) allocate(self%item(16))
      if (n == size(self%item)) then
         allocate(grown(2*n))
         grown(:n) = self%item
         call move_alloc(grown, self%item)
      end if
      self%item(n + 1)%origin = origin
      self%item(n + 1)%is_error = is_error
      self%item(n + 1)%text = trim(text)
   end subroutine add

   pure logical function is_same(a, b)
      type(diagnostic_t), intent(in) :: a, b

      is_same = a%origin%file == b%origin%file .and. a%origin%line == b%origin%line &
         .and. (a%is_error .eqv. b%is_error) .and. a%text == b%text
   end function is_same

   !> All messages, one line each, in the order of files and lines: `file:line: error: ...`.
   function diagnostics_texts(self) result(text)
      type(diagnostics_t), intent(in) :: self
      type(string_t), allocatable :: text(:)
      integer, allocatable :: order(:)
      real(dp), allocatable :: key(:)
      integer :: i, n, n_text, told(2), k

      n = self%n_errors + self%n_warnings
      allocate(key(n))
      do i = 1, n
         key(i) = real(self%item(i)%origin%file, dp)*2.0_dp**32 + real(self%item(i)%origin%line, dp)
      end do
      order = sort_order(key)
      allocate(text(min(n, 2*max_told + 2)))
      told = 0
      n_text = 0
      do i = 1, n
         if (i > 1) then                         ! a line that is read for each instance of a part
            if (is_same(self%item(order(i - 1)), self%item(order(i)))) cycle
         end if
         k = merge(1, 2, self%item(order(i))%is_error)
         told(k) = told(k) + 1
         if (told(k) > max_told) cycle
         n_text = n_text + 1
         call line_text(self, self%item(order(i)), text(n_text)%text)
      end do
      if (told(1) > max_told) then
         n_text = n_text + 1
         text(n_text)%text = "and " // to_text(told(1) - max_told) // " more errors"
      end if
      if (told(2) > max_told) then
         n_text = n_text + 1
         text(n_text)%text = "and " // to_text(told(2) - max_told) // " more warnings"
      end if
      text = text(:n_text)
   end function diagnostics_texts

   pure subroutine line_text(self, item, text)
      type(diagnostics_t), intent(in) :: self
      type(diagnostic_t), intent(in) :: item
      character(len=:), allocatable, intent(out) :: text

      text = ""
      if (item%origin%file > 0) then
         text = self%file_name(item%origin%file)%text // ":"
         if (item%origin%line > 0) text = text // to_text(item%origin%line) // ":"
         text = text // " "
      end if
      if (item%is_error) then
         text = text // "error: " // item%text
      else
         text = text // "warning: " // item%text
      end if
      text = printable(text)
   end subroutine line_text

   !> `word` in quotes, for a message: cut if long, without what would upset a terminal.
   pure function quoted(word) result(text)
      character(len=*), intent(in) :: word
      character(len=quoted_length(word)) :: text
      integer :: n

      text = adjustl(word)
      if (len_trim(adjustl(word)) > max_word) then
         n = max_word
         do while (n > 0 .and. is_inside(text(n + 1:n + 1)))
            n = n - 1
         end do
         text(n + 1:) = repeat(".", max_word + 3 - n)
      end if
      text = printable(text)
      text = "'" // text(:len(text) - 2) // "'"
   end function quoted

   !> Is a byte inside a character of UTF-8, behind its first one?
   pure logical function is_inside(byte)
      character, intent(in) :: byte
      integer, parameter :: first = 128, last = 191

      is_inside = ichar(byte) >= first .and. ichar(byte) <= last
   end function is_inside

   pure integer function quoted_length(word) result(n)
      character(len=*), intent(in) :: word

      n = len_trim(adjustl(word))
      if (n > max_word) n = max_word + 3
      n = n + 2
   end function quoted_length

   !> "; did you mean X?" if an entry of `known` is near to `word` (both upper case), else nothing.
   pure function suggestion(word, known) result(text)
      character(len=*), intent(in) :: word
      type(string_t), intent(in) :: known(:)
      character(len=suggestion_length(word, known)) :: text
      character(len=:), allocatable :: near

      if (len(text) == 0) return
      call nearest_word(word, known, near)
      text = "; did you mean " // near // "?"
   end function suggestion

   pure integer function suggestion_length(word, known) result(n)
      character(len=*), intent(in) :: word
      type(string_t), intent(in) :: known(:)
      character(len=:), allocatable :: near

      n = 0
      if (len(word) > max_word) return
      call nearest_word(word, known, near)
      if (near /= "") n = len("; did you mean ?") + len(near)
   end function suggestion_length

   !> The entries of "A, B,C", without empty ones.
   pure function entries(list) result(part)
      character(len=*), intent(in) :: list
      type(string_t), allocatable :: part(:)
      integer :: first, last, n

      allocate(part(len(list)))
      n = 0
      first = 1
      do while (first <= len(list))
         last = first + scan(list(first:) // ",", ",") - 2
         if (list(first:last) /= "") then
            n = n + 1
            part(n)%text = trim(adjustl(list(first:last)))
         end if
         first = last + 2
      end do
      part = part(:n)
   end function entries

   !> "5, 7, 12 and 4 more"
   pure function label_list(label) result(text)
      integer, intent(in) :: label(:)
      character(len=label_length(label)) :: text

      text = joined(label_words(label), ", ", max_labels)
   end function label_list

   pure integer function label_length(label)
      integer, intent(in) :: label(:)

      label_length = len(joined(label_words(label), ", ", max_labels))
   end function label_length

   pure function label_words(label) result(word)
      integer, intent(in) :: label(:)
      type(string_t) :: word(size(label))
      integer :: i

      do i = 1, min(size(label), max_labels)
         word(i)%text = to_text(label(i))
      end do
   end function label_words

end module emcon_diagnostics
