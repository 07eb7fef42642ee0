!> Text that a terminal may be shown, whatever a deck holds.
module emcon_printable
   implicit none
   private
   public :: printable

contains

   !> `text` with a question mark in place of each byte of control characters: those of ASCII but
   !> the end of a line, and those that Unicode has from 128 to 159.
   pure function printable(text) result(shown)
      character(len=*), intent(in) :: text
      character(len=len(text)) :: shown
      integer, parameter :: first_printed = 32, delete = 127
      integer, parameter :: lead = 194, first_lead = 128, last_lead = 159   ! as UTF-8 has them
      integer :: i, code, before

      shown = text
      before = 0
      do i = 1, len(text)
         code = ichar(text(i:i))
         if ((code < first_printed .and. text(i:i) /= new_line("a")) .or. code == delete) then
            shown(i:i) = "?"
         else if (before == lead .and. code >= first_lead .and. code <= last_lead) then
            shown(i - 1:i) = "??"
         end if
         before = code
      end do
   end function printable

end module emcon_printable
