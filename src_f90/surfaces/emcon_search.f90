!> Candidate search: which items are near which edges, by a tree, near-linear in their number.
!>
!> Boxes around the edges are blown up by a reach. As long as no point has moved by more than half
!> of the reach, every item within the rest of the reach of an edge is on the list.
module emcon_search
   use emcon_box_tree, only : box_tree_find, box_tree_init, box_tree_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: candidates_t, search_candidates, box_distance

   type :: candidates_t
      integer, allocatable :: start(:)           !! (n_item + 1)
      integer, allocatable :: edge(:)            !! edges near item i: start(i) .. start(i+1) - 1
   end type candidates_t

   !> Room for candidates per item at first.
   integer, parameter :: edges_per_item = 8

contains

   !> List for each item the edges whose box, blown up by `reach`, meets its box, ascending: those
   !> with `box_distance` <= reach. Boxes that are not finite are near nothing.
   pure subroutine search_candidates(item_low, item_high, low, high, reach, candidates)
      real(wp), intent(in) :: item_low(:, :)     !! (2, n_item) boxes of the items [L]
      real(wp), intent(in) :: item_high(:, :)    !! the same as `item_low` for a point
      real(wp), intent(in) :: low(:, :), high(:, :)   !! (2, n_edge) boxes of the edges [L]
      real(wp), intent(in) :: reach              !! > 0 [L]
      type(candidates_t), intent(out) :: candidates
      type(box_tree_t) :: tree
      integer :: i, n

      call box_tree_init(tree, low, high)
      allocate(candidates%start(size(item_low, 2) + 1), source=1)
      allocate(candidates%edge(edges_per_item*size(item_low, 2)))
      n = 0
      do i = 1, size(item_low, 2)
         call box_tree_find(tree, item_low(:, i), item_high(:, i), reach, candidates%edge, n)
         candidates%start(i + 1) = n + 1
      end do
      candidates%edge = candidates%edge(:n)
   end subroutine search_candidates

   !> Distance of two boxes along the axis where it is largest; 0 if they overlap.
   pure real(wp) function box_distance(low_a, high_a, low_b, high_b)
      real(wp), intent(in) :: low_a(2), high_a(2), low_b(2), high_b(2)   !! [L]

      box_distance = max(0.0_wp, maxval(low_a - high_b), maxval(low_b - high_a))
   end function box_distance

end module emcon_search
