!> The lines of a deck, before they are understood.
module emcon_deck_lines
   use emcon_text, only : string_t
   implicit none
   private
   public :: deck_source_t

   !> A deck as it was read. A restart file carries this.
   type :: deck_source_t
      type(string_t), allocatable :: line(:)
      integer, allocatable :: file(:)              !! (n_line) index into `file_name`
      integer, allocatable :: number(:)            !! (n_line) line number in that file
      type(string_t), allocatable :: file_name(:)  !! as typed; included ones as resolved
      integer :: n_own_file = huge(1)              !! those behind hold further steps of a run
      logical :: is_whole = .true.                 !! false: some included file could not be read
   end type deck_source_t

end module emcon_deck_lines
