!> What tells the files of one run from those of others: a checksum of all that the run is made of.
module emcon_run_mark
   use emcon_checksum, only : checksum_add, checksum_t, checksum_text
   use emcon_kinds, only : wp
   use emcon_text, only : string_t, to_text
   implicit none
   private
   public :: run_mark

   !> Digits that tell all numbers apart.
   integer, parameter :: digits_all = 2 + int(real(digits(1.0_wp), wp)*log10(2.0_wp))
   !> Behind each line, so that lines cannot run into each other.
   character(len=*), parameter :: line_end = achar(10)

contains

   !> One line for the deck, included files and all, and the parameters given beside it: equal for
   !> runs that differ in nothing.
   pure subroutine run_mark(deck, override, is_lenient, mark, until)
      type(string_t), intent(in) :: deck(:)          !! its lines
      type(string_t), intent(in) :: override(:)      !! NAME=VALUE as given
      logical, intent(in) :: is_lenient              !! unknown keywords were warnings
      real(wp), intent(in), optional :: until(:)     !! times asked for beside the deck
      character(len=:), allocatable, intent(out) :: mark
      type(checksum_t) :: sum
      type(string_t), allocatable :: line(:)
      character(len=40) :: text
      integer :: i

      call add_lines(sum, deck)
      call add_lines(sum, override)
      if (is_lenient) call checksum_add(sum, "lenient ")
      if (present(until)) then
         allocate(line(size(until)))
         do i = 1, size(until)
            line(i)%text = "until " // to_text(until(i), digits_all)
         end do
         call add_lines(sum, line)
      end if
      call checksum_text(sum, text)
      mark = "run " // trim(text)
   end subroutine run_mark

   !> Add `line` as one piece, filled up with blanks to words of the checksum.
   pure subroutine add_lines(sum, line)
      type(checksum_t), intent(inout) :: sum
      type(string_t), intent(in) :: line(:)
      character(len=:), allocatable :: text
      integer :: i, n

      n = 0
      do i = 1, size(line)
         n = n + len(line(i)%text) + len(line_end)
      end do
      allocate(character(len=4*(n/4 + 1)) :: text)
      text(:) = ""
      n = 0
      do i = 1, size(line)
         associate (here => line(i)%text // line_end)
            text(n + 1:n + len(here)) = here
            n = n + len(here)
         end associate
      end do
      call checksum_add(sum, text)
   end subroutine add_lines

end module emcon_run_mark
