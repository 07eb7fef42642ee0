!> The flat interface, continued: a deck that Python composed in memory.
module emcon_flat_source
   use, intrinsic :: iso_c_binding, only : c_int, c_int64_t
   use emcon_deck_source, only : passage_t
   use emcon_handle, only : handle_read_passages
   implicit none
   private
   public :: read_text

contains

   !> Read the deck `text` into a new model.
   !>
   !> Column k of `place` says where its next lines stand: how many they are, the file (from 1, in
   !> the order of `names`), the line there, and 1 if the lines count on from it, else 0.
   !> `names` and `overrides` (NAME=VALUE) stand one per line.
   subroutine read_text(handle, text, n_place, place, names, overrides, is_lenient, ierr)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: text
      integer(c_int), intent(in) :: n_place
      integer(c_int), intent(in) :: place(4, n_place)
      character(len=*), intent(in) :: names, overrides
      integer(c_int), intent(in) :: is_lenient
      integer(c_int), intent(out) :: ierr
      type(passage_t), allocatable :: passage(:)
      integer :: k
      !f2py threadsafe

      allocate(passage(n_place))
      do k = 1, n_place
         passage(k) = passage_t(place(1, k), place(2, k), place(3, k), place(4, k) /= 0)
      end do
      call handle_read_passages(handle, text, passage, names, overrides, is_lenient /= 0, ierr)
   end subroutine read_text

end module emcon_flat_source
