!> Text: numbers to and from words, upper case, nearest words.
!>
!> Functions have results of explicit length, found by a function beside them: gfortran keeps the
!> length of a deferred-length result in a static variable, which threads would share.
module emcon_text
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_kinds, only : int64, wp
   implicit none
   private
   public :: string_t, notes_t, note_add, notes_append
   public :: to_upper, squeezed, stripped, to_text, read_integer, read_real, nearest_word, joined

   !> A text of its own length, for lists of texts.
   type :: string_t
      character(len=:), allocatable :: text
   end type string_t

   !> Remarks that a lower layer returns to its caller, in order.
   type :: notes_t
      integer :: n = 0
      type(string_t), allocatable :: item(:)
   end type notes_t

   !> A decimal number taken apart: mantissa times 10**exponent.
   type :: decimal_t
      integer(int64) :: mantissa = 0_int64       !! the first 18 digits
      integer :: n_digit = 0                     !! digits from the first that is not 0
      integer :: exponent = 0                    !! of the last digit
      integer :: i_end = 0                       !! last character before the exponent
      integer :: i_exponent = 0                  !! first character of the exponent's number
   end type decimal_t

   !> Whole numbers below `largest_exact` and powers of ten up to `largest_power` (5**22 < 2**53)
   !> have no rounding error in `wp`.
   integer(int64), parameter :: largest_exact = 2_int64**min(digits(1.0_wp), 60)
   integer, parameter :: largest_power = min(22, int(0.43_wp*real(digits(1.0_wp), wp)))
   real(wp), parameter :: power_of_ten(0:22) = [1.0e0_wp, 1.0e1_wp, 1.0e2_wp, 1.0e3_wp, &
      1.0e4_wp, 1.0e5_wp, 1.0e6_wp, 1.0e7_wp, 1.0e8_wp, 1.0e9_wp, 1.0e10_wp, 1.0e11_wp, &
      1.0e12_wp, 1.0e13_wp, 1.0e14_wp, 1.0e15_wp, 1.0e16_wp, 1.0e17_wp, 1.0e18_wp, 1.0e19_wp, &
      1.0e20_wp, 1.0e21_wp, 1.0e22_wp]
   !> Exponents beyond are no numbers; far outside the range of any kind.
   integer, parameter :: largest_exponent = 1000000

   !> Shortest text of a number: integers as they are, reals with `digits` significant digits (6).
   interface to_text
      module procedure text_of_integer, text_of_real, text_of_digits
   end interface to_text
   integer, parameter :: default_digits = 6, real_width = 48

contains

   !> Append the remark `text`.
   pure subroutine note_add(notes, text)
      type(notes_t), intent(inout) :: notes
      character(len=*), intent(in) :: text
      type(string_t), allocatable :: grown(:)

      if (.not. allocated(notes%item)) allocate(notes%item(4))
      if (notes%n == size(notes%item)) then
         allocate(grown(2*notes%n))
         grown(:notes%n) = notes%item
         call move_alloc(grown, notes%item)
      end if
      notes%n = notes%n + 1
      notes%item(notes%n)%text = text
   end subroutine note_add

   !> Add all of `more`.
   pure subroutine notes_append(notes, more)
      type(notes_t), intent(inout) :: notes
      type(notes_t), intent(in) :: more
      integer :: i

      do i = 1, more%n
         call note_add(notes, more%item(i)%text)
      end do
   end subroutine notes_append

   !> `text` with the ASCII letters in upper case.
   pure function to_upper(text) result(upper)
      character(len=*), intent(in) :: text
      character(len=len(text)) :: upper
      integer :: i, code

      do i = 1, len(text)
         code = iachar(text(i:i))
         if (code >= iachar("a") .and. code <= iachar("z")) code = code - 32
         upper(i:i) = achar(code)
      end do
   end function to_upper

   !> `text` in upper case without any blank or tab.
   pure function squeezed(text) result(word)
      character(len=*), intent(in) :: text
      character(len=squeezed_length(text)) :: word
      integer :: i, n

      n = 0
      do i = 1, len(text)
         if (text(i:i) == " " .or. text(i:i) == achar(9)) cycle
         n = n + 1
         word(n:n) = to_upper(text(i:i))
      end do
   end function squeezed

   pure integer function squeezed_length(text) result(n)
      character(len=*), intent(in) :: text
      integer :: i

      n = 0
      do i = 1, len(text)
         if (text(i:i) /= " " .and. text(i:i) /= achar(9)) n = n + 1
      end do
   end function squeezed_length

   !> `text` without the characters of `blanks` around it.
   pure function stripped(text, blanks) result(core)
      character(len=*), intent(in) :: text, blanks
      character(len=verify(text, blanks, back=.true.) - max(verify(text, blanks), 1) + 1) :: core

      if (len(core) > 0) core = text(verify(text, blanks):)
   end function stripped

   pure function text_of_integer(value) result(text)
      integer, intent(in) :: value
      character(len=integer_length(value)) :: text

      write(text, "(i0)") value
   end function text_of_integer

   pure integer function integer_length(value) result(n)
      integer, intent(in) :: value
      character(len=16) :: buffer

      write(buffer, "(i0)") value
      n = len_trim(buffer)
   end function integer_length

   pure function text_of_real(value) result(text)
      real(wp), intent(in) :: value
      character(len=real_length(value, default_digits)) :: text

      text = real_word(value, default_digits)
   end function text_of_real

   pure function text_of_digits(value, digits) result(text)
      real(wp), intent(in) :: value
      integer, intent(in) :: digits
      character(len=real_length(value, digits)) :: text

      text = real_word(value, digits)
   end function text_of_digits

   pure integer function real_length(value, digits) result(n)
      real(wp), intent(in) :: value
      integer, intent(in) :: digits

      n = len_trim(real_word(value, digits))
   end function real_length

   !> `value` without zeros that say nothing, blanks behind.
   pure function real_word(value, digits) result(word)
      real(wp), intent(in) :: value
      integer, intent(in) :: digits
      character(len=real_width) :: word
      character(len=16) :: form
      integer :: i_exponent, last

      word = "0"
      if (value == 0.0_wp) return
      if (abs(value) >= 1.0e-3_wp .and. abs(value) < 10.0_wp**min(digits, 15)) then
         write(form, "('(f0.', i0, ')')") max(0, digits - 1 - floor(log10(abs(value))))
      else
         write(form, "('(es48.', i0, 'e4)')") digits - 1
      end if
      write(word, form) value
      word = adjustl(word)
      i_exponent = scan(word, "E")
      if (i_exponent > 0) then
         do while (len_trim(word) > i_exponent + 3 .and. word(i_exponent + 2:i_exponent + 2) == "0")
            word = word(:i_exponent + 1) // word(i_exponent + 3:)
         end do
      end if
      if (i_exponent == 0 .and. index(word, ".") > 0) then
         last = verify(trim(word), "0", back=.true.)
         if (word(last:last) == ".") last = last - 1
         word = word(:last)
      end if
      if (word(1:1) == ".") word = "0" // word(:real_width - 1)
      if (word(:2) == "-.") word = "-0" // word(2:real_width - 1)
   end function real_word

   !> Read a whole number of at most 2^31 - 1 in size; `ok` tells whether all of `word` was one.
   pure subroutine read_integer(word, value, ok)
      character(len=*), intent(in) :: word
      integer, intent(out) :: value
      logical, intent(out) :: ok
      integer(int64) :: wide
      integer :: i, digit, first

      value = 0
      wide = 0_int64
      first = 1
      if (len(word) > 0) then
         if (scan(word(1:1), "+-") == 1) first = 2
      end if
      ok = len(word) >= first .and. len(word) - first < 18
      if (.not. ok) return
      do i = first, len(word)
         digit = iachar(word(i:i)) - iachar("0")
         ok = digit >= 0 .and. digit <= 9
         if (.not. ok) return
         wide = 10_int64*wide + int(digit, int64)
      end do
      ok = wide <= int(huge(value), int64)
      if (.not. ok) return
      value = int(wide)
      if (word(1:1) == "-") value = -value
   end subroutine read_integer

   !> Read a finite real in any form that Fortran or C writes (`1.`, `.5`, `1e3`, `1D3`, `1.d+3`,
   !> also `1.0-100`, how Fortran writes an exponent of three digits).
   !>
   !> Short numbers, nearly all of a deck, are one product or quotient of exact numbers, hence
   !> correctly rounded; longer ones go through the run-time library. Values of
   !> 10**(range + 1) and above are refused before they can overflow; tiny ones become 0.
   pure subroutine read_real(word, value, ok)
      character(len=*), intent(in) :: word
      real(wp), intent(out) :: value
      logical, intent(out) :: ok
      type(decimal_t) :: number
      character(len=len(word) + 1) :: fixed
      integer :: stat, magnitude

      value = 0.0_wp
      call scan_decimal(word, number, ok)
      if (.not. ok .or. number%mantissa == 0_int64) return
      magnitude = number%n_digit + number%exponent
      ok = magnitude <= range(1.0_wp) + 1
      if (.not. ok .or. magnitude < -2*range(1.0_wp)) return
      if (number%n_digit <= 18 .and. number%mantissa < largest_exact &
         .and. abs(number%exponent) <= largest_power) then
         value = real(number%mantissa, wp)
         if (number%exponent < 0) then
            value = value/power_of_ten(-number%exponent)
         else
            value = value*power_of_ten(number%exponent)
         end if
         if (word(1:1) == "-") value = -value
      else
         fixed = word(:number%i_end)
         if (number%i_exponent <= len(word)) then
            fixed = word(:number%i_end) // "E" // word(number%i_exponent:)
         end if
         read(fixed, *, iostat=stat) value
         ok = stat == 0
         if (ok) ok = ieee_is_finite(value)
      end if
   end subroutine read_real

   !> Take a decimal number apart; `ok` tells whether all of `word` was one.
   pure subroutine scan_decimal(word, number, ok)
      character(len=*), intent(in) :: word
      type(decimal_t), intent(out) :: number
      logical, intent(out) :: ok
      integer :: i, digit, exponent
      logical :: has_point

      has_point = .false.
      ok = .false.
      i = 1
      if (len(word) > 0) then
         if (scan(word(1:1), "+-") == 1) i = 2
      end if
      do i = i, len(word)
         digit = iachar(word(i:i)) - iachar("0")
         if (digit >= 0 .and. digit <= 9) then
            ok = .true.
            if (number%n_digit > 0 .or. digit > 0) number%n_digit = number%n_digit + 1
            if (number%n_digit <= 18) number%mantissa = 10_int64*number%mantissa + int(digit, int64)
            if (has_point) number%exponent = number%exponent - 1
         else if (word(i:i) == "." .and. .not. has_point) then
            has_point = .true.
         else
            exit
         end if
      end do
      number%i_end = i - 1
      number%i_exponent = len(word) + 1
      if (.not. ok .or. i > len(word)) return
      number%i_exponent = i
      if (scan(word(i:i), "EeDdQq") == 1) number%i_exponent = i + 1
      ok = number%i_exponent > i .or. scan(word(i:i), "+-") == 1
      if (ok) call read_integer(word(number%i_exponent:), exponent, ok)
      if (ok) ok = abs(exponent) <= largest_exponent
      if (ok) number%exponent = number%exponent + exponent
   end subroutine scan_decimal

   !> The entry of `list` that takes the fewest edits to reach from `word`; empty if none is near.
   pure subroutine nearest_word(word, list, nearest)
      character(len=*), intent(in) :: word
      type(string_t), intent(in) :: list(:)
      character(len=:), allocatable, intent(out) :: nearest
      integer :: i, distance, best

      nearest = ""
      best = max(1, len(word)/3) + 1
      do i = 1, size(list)
         distance = edit_distance(word, list(i)%text)
         if (is_last_part(word, list(i)%text)) distance = 0
         if (distance < best) then
            best = distance
            nearest = list(i)%text
         end if
      end do
   end subroutine nearest_word

   !> Is `word` what follows a point in `name`, as in INSTANCE.NAME?
   pure logical function is_last_part(word, name)
      character(len=*), intent(in) :: word, name

      is_last_part = len(name) > len(word)
      if (is_last_part) is_last_part = name(len(name) - len(word):) == "." // word
   end function is_last_part

   !> Levenshtein distance of `a` and `b`.
   pure integer function edit_distance(a, b)
      character(len=*), intent(in) :: a, b
      integer :: row(0:len(b)), i, j, corner, above

      row = [(j, j = 0, len(b))]
      do i = 1, len(a)
         corner = row(0)
         row(0) = i
         do j = 1, len(b)
            above = row(j)
            row(j) = min(above + 1, row(j - 1) + 1, corner + merge(0, 1, a(i:i) == b(j:j)))
            corner = above
         end do
      end do
      edit_distance = row(len(b))
   end function edit_distance

   !> The texts of `list` with `separator` between them; after `most` of them "and N more".
   pure function joined(list, separator, most) result(text)
      type(string_t), intent(in) :: list(:)
      character(len=*), intent(in) :: separator
      integer, intent(in) :: most
      character(len=joined_length(list, separator, most)) :: text
      integer :: i, n

      n = 0
      do i = 1, min(size(list), most)
         if (i > 1) call append(text, n, separator)
         call append(text, n, list(i)%text)
      end do
      if (size(list) > most) call append(text, n, and_more(size(list) - most))
   end function joined

   !> Put `more` behind the first `n` characters of `text`.
   pure subroutine append(text, n, more)
      character(len=*), intent(inout) :: text
      integer, intent(inout) :: n
      character(len=*), intent(in) :: more

      text(n + 1:n + len(more)) = more
      n = n + len(more)
   end subroutine append

   pure integer function joined_length(list, separator, most) result(n)
      type(string_t), intent(in) :: list(:)
      character(len=*), intent(in) :: separator
      integer, intent(in) :: most
      integer :: i

      n = len(separator)*max(0, min(size(list), most) - 1)
      do i = 1, min(size(list), most)
         n = n + len(list(i)%text)
      end do
      if (size(list) > most) n = n + len(and_more(size(list) - most))
   end function joined_length

   pure function and_more(n) result(text)
      integer, intent(in) :: n
      character(len=10 + integer_length(n)) :: text

      text = " and " // text_of_integer(n) // " more"
   end function and_more

end module emcon_text
