!> Candidate search: which items are near which facets, by a tree, near-linear in their number.
!>
!> Boxes around the facets are blown up by a reach. As long as no point has moved by more than half
!> of the reach, every item within the rest of the reach of a facet is on the list.
module emcon_search
   use emcon_box_tree, only : box_tree_find, box_tree_init, box_tree_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: candidates_t, search_boxes, search_candidates, box_distance

   type :: candidates_t
      integer, allocatable :: start(:)           !! (n_item + 1)
      integer, allocatable :: facet(:)           !! facets near item i: start(i) .. start(i+1) - 1
   end type candidates_t

   !> Room for candidates per item at first.
   integer, parameter :: facets_per_item = 8

contains

   !> List for each item the facets whose box, blown up by `reach`, meets its box, ascending: those
   !> with `box_distance` <= reach. Boxes that are not finite are near nothing.
   pure subroutine search_candidates(item_low, item_high, low, high, reach, candidates)
      real(wp), intent(in) :: item_low(:, :)     !! (n_dim, n_item) boxes of the items [L]
      real(wp), intent(in) :: item_high(:, :)    !! the same as `item_low` for a point
      real(wp), intent(in) :: low(:, :), high(:, :)   !! (n_dim, n_facet) their boxes [L]
      real(wp), intent(in) :: reach              !! > 0 [L]
      type(candidates_t), intent(out) :: candidates
      type(box_tree_t) :: tree
      integer :: i, n

      call box_tree_init(tree, low, high)
      allocate(candidates%start(size(item_low, 2) + 1), source=1)
      allocate(candidates%facet(facets_per_item*size(item_low, 2)))
      n = 0
      do i = 1, size(item_low, 2)
         call box_tree_find(tree, item_low(:, i), item_high(:, i), reach, candidates%facet, n)
         candidates%start(i + 1) = n + 1
      end do
      candidates%facet = candidates%facet(:n)
   end subroutine search_candidates

   !> Distance of two boxes along the axis where it is largest; 0 if they overlap.
   pure real(wp) function box_distance(low_a, high_a, low_b, high_b)
      real(wp), intent(in) :: low_a(:), high_a(:), low_b(:), high_b(:)   !! (n_dim) [L]

      box_distance = max(0.0_wp, maxval(low_a - high_b), maxval(low_b - high_a))
   end function box_distance

   !> Low and high corners (n_dim, n, 2) of the boxes around the nodes of each item at x + u, in the
   !> place of what was in `box`.
   pure subroutine search_boxes(x, u, item, box)
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      integer, intent(in) :: item(:, :)          !! (most nodes, n) 0: no more of it
      real(wp), allocatable, intent(inout) :: box(:, :, :)   !! [L]
      real(wp) :: at
      integer :: a, i, k

      if (allocated(box)) then
         if (any(shape(box) /= [size(x, 1), size(item, 2), 2])) deallocate(box)
      end if
      if (.not. allocated(box)) allocate(box(size(x, 1), size(item, 2), 2))
      do i = 1, size(item, 2)
         do k = 1, size(item, 1)
            associate (node => item(k, i))
               if (node == 0) exit
               do a = 1, size(x, 1)
                  at = x(a, node) + u(a, node)
                  if (k == 1) then
                     box(a, i, :) = at
                  else
                     box(a, i, 1) = min(box(a, i, 1), at)
                     box(a, i, 2) = max(box(a, i, 2), at)
                  end if
               end do
            end associate
         end do
      end do
   end subroutine search_boxes

end module emcon_search
