!> The outlines of the pieces of a mesh, and which of them contact pairs bring together.
!>
!> A piece is what hangs together by elements; its outline are the facets that one element alone
!> has. Surfaces without elements stand for themselves.
module emcon_outline
   use emcon_kinds, only : wp
   use emcon_sort, only : find_sorted
   implicit none
   private
   public :: outline_t, pieces_t, outline_meets

   type :: pieces_t
      integer, allocatable :: piece(:)           !! ascending
   end type pieces_t

   type :: outline_t
      integer :: n_piece = 0                     !! 0: nothing can meet
      integer, allocatable :: body(:)            !! (n_piece) number of what ties hold together
      integer, allocatable :: start(:)           !! (n_piece + 1) first facet of each piece
      integer, allocatable :: facet(:, :)        !! (most nodes, n_facet) nodes, piece by piece
      !> (n_facet) shortest side of the element behind it, of one without an element its own [L]
      real(wp), allocatable :: thickness(:)
      type(pieces_t), allocatable :: on(:)       !! (n_surface) pieces that it is on
      integer, allocatable :: pair(:, :)         !! (2, n_pair) surfaces that meet
   end type outline_t

contains

   !> Does a contact pair bring pieces `p` and `q` together?
   pure logical function outline_meets(self, p, q) result(meets)
      type(outline_t), intent(in) :: self
      integer, intent(in) :: p, q                !! 1..n_piece
      integer :: k

      meets = .true.
      do k = 1, size(self%pair, 2)
         associate (slave => self%on(self%pair(1, k))%piece, &
               master => self%on(self%pair(2, k))%piece)
            if (find_sorted(slave, p) > 0 .and. find_sorted(master, q) > 0) return
            if (find_sorted(slave, q) > 0 .and. find_sorted(master, p) > 0) return
         end associate
      end do
      meets = .false.
   end function outline_meets

end module emcon_outline
