!> Pieces of JSON objects: members are appended to the text of one that has begun with a brace.
module emcon_json
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_kinds, only : wp
   use emcon_text, only : notes_t, to_text
   implicit none
   private
   public :: json_number, json_text, json_texts

   !> Digits that are written of a number.
   integer, parameter :: n_digit = 9

contains

   !> Append a number; null where it is none.
   pure subroutine json_number(line, name, value)
      character(len=:), allocatable, intent(inout) :: line
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: value

      call begin_member(line, name)
      if (ieee_is_finite(value)) then
         line = line // to_text(value, n_digit)
      else
         line = line // "null"
      end if
   end subroutine json_number

   !> Append a text.
   pure subroutine json_text(line, name, text)
      character(len=:), allocatable, intent(inout) :: line
      character(len=*), intent(in) :: name, text

      call begin_member(line, name)
      call add_quoted(line, text)
   end subroutine json_text

   !> Append a list of texts.
   pure subroutine json_texts(line, name, texts)
      character(len=:), allocatable, intent(inout) :: line
      character(len=*), intent(in) :: name
      type(notes_t), intent(in) :: texts
      integer :: i

      call begin_member(line, name)
      line = line // "["
      do i = 1, texts%n
         if (i > 1) line = line // ", "
         call add_quoted(line, texts%item(i)%text)
      end do
      line = line // "]"
   end subroutine json_texts

   pure subroutine begin_member(line, name)
      character(len=:), allocatable, intent(inout) :: line
      character(len=*), intent(in) :: name

      if (line(len(line):) /= "{") line = line // ", "
      line = line // '"' // name // '": '
   end subroutine begin_member

   !> Append `text` between quotes, with the escapes of JSON.
   pure subroutine add_quoted(line, text)
      character(len=:), allocatable, intent(inout) :: line
      character(len=*), intent(in) :: text
      integer :: i

      line = line // '"'
      do i = 1, len(text)
         if (text(i:i) == '"' .or. text(i:i) == achar(92)) line = line // achar(92)
         line = line // merge(" ", text(i:i), iachar(text(i:i)) < iachar(" "))
      end do
      line = line // '"'
   end subroutine add_quoted

end module emcon_json
