!> Data lines taken apart: fields between commas, read as labels, reals or names.
module emcon_deck_fields
   use emcon_deck_reader, only : card_t, line_origin, max_name, reader_t, source_line
   use emcon_deck_text, only : bare_name, fields_t, is_blank, split_fields
   use emcon_diagnostics, only : add_error, add_warning, quoted
   use emcon_kinds, only : wp
   use emcon_text, only : read_integer, read_real, to_text, to_upper
   implicit none
   private
   public :: drop_zeros, refuse_lines
   public :: data_t, data_open, next_line, data_error, data_warning
   public :: check_count, is_blank, is_label, get_integer, get_real, get_name

   !> A data line taken apart, and the way to the next. `ok` is false once a field was refused.
   type, extends(fields_t) :: data_t
      type(card_t) :: card
      integer :: i_line = 0
      logical :: ok = .true.
   end type data_t

contains

   !> An error in the current data line.
   subroutine data_error(reader, data, text)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      character(len=*), intent(in) :: text

      data%ok = .false.
      if (allocated(reader%is_unresolved)) then
         if (reader%is_unresolved(data%i_line)) return
      end if
      call add_error(reader%log, line_origin(reader, data%i_line), data%card%title // ": " // text)
   end subroutine data_error

   subroutine data_warning(reader, data, text)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(in) :: data
      character(len=*), intent(in) :: text

      call add_warning(reader%log, line_origin(reader, data%i_line), &
         data%card%title // ": " // text)
   end subroutine data_warning

   !> Go before the first data line of `card`.
   subroutine data_open(data, card)
      type(data_t), intent(out) :: data
      type(card_t), intent(in) :: card

      data%card = card
      data%i_line = card%first - 1
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

   !> Whether field `k` is a whole number, hence no name.
   pure logical function is_label(data, k)
      type(data_t), intent(in) :: data
      integer, intent(in) :: k

      is_label = .not. is_blank(data, k)
      if (is_label) is_label = verify(data%text(data%from(k):data%to(k)), "+-0123456789") == 0
   end function is_label

   !> Zeros behind the first `most` fields say nothing: they are not counted.
   subroutine drop_zeros(data, most)
      type(data_t), intent(inout) :: data
      integer, intent(in) :: most
      real(wp) :: number
      logical :: is_number

      do while (data%n > most)
         if (.not. is_blank(data, data%n)) then
            call read_real(data%text(data%from(data%n):data%to(data%n)), number, is_number)
            if (.not. is_number .or. abs(number) > 0.0_wp) return
         end if
         data%n = data%n - 1
      end do
   end subroutine drop_zeros

   !> Refuse the data lines of a card that has none, once; zeros say nothing.
   subroutine refuse_lines(reader, card, when)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in), optional :: when   !! it has none, with a blank behind
      type(data_t) :: data
      character(len=:), allocatable :: title

      title = ""
      if (present(when)) title = when
      call data_open(data, card)
      do while (next_line(reader, data))
         call drop_zeros(data, 0)
         if (data%n == 0) cycle
         call data_error(reader, data, title // "has no data lines, but " // quoted(data%text) &
            // " follows")
         return
      end do
   end subroutine refuse_lines

   !> Refuse a line with fewer than `least` or more than `most` fields; `what` names them.
   subroutine check_count(reader, data, least, most, what)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: least, most
      character(len=*), intent(in) :: what

      call drop_zeros(data, most)
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
      character(len=:), allocatable :: fault
      real(wp) :: number
      logical :: ok

      if (is_blank(data, k)) return
      associate (word => data%text(data%from(k):data%to(k)))
         call read_real(word, number, ok)
         if (ok) then
            value = number
         else
            call real_fault(word, fault)
            call data_error(reader, data, "the " // what // " " // quoted(word) // fault)
         end if
      end associate
   end subroutine get_real

   !> Why a word is not a real: " is not ...".
   pure subroutine real_fault(word, fault)
      character(len=*), intent(in) :: word
      character(len=:), allocatable, intent(out) :: fault
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
      if (verify(word, "+-.0123456789") == 0 .and. len(word) > range(1.0_wp)) then
         fault = " is too large"
      end if
      n = scan(word, "EeDd")
      if (n < 2 .or. n == len(word)) return
      call read_real(word(:n - 1), mantissa, ok)
      if (.not. ok) return
      if (verify(word(n + 1:), "+0123456789") == 0 .and. scan(word, "0123456789", back=.true.) &
         == len(word)) fault = " is too large"
   end subroutine real_fault

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

end module emcon_deck_fields
