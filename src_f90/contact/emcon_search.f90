!> Candidate search: which nodes are near which edges, by a grid, near-linear in their number.
!>
!> Boxes around the edges are blown up by a reach. As long as no point has moved by more than half
!> of the reach, every node within the rest of the reach of an edge is on the list.
module emcon_search
   use emcon_kinds, only : wp
   implicit none
   private
   public :: candidates_t, search_candidates, box_distance

   type :: candidates_t
      integer, allocatable :: start(:)           !! (n_point + 1)
      integer, allocatable :: edge(:)            !! edges near point i: start(i) .. start(i+1) - 1
   end type candidates_t

   !> Grid cells per edge, at most.
   integer, parameter :: cells_per_edge = 4

   type :: grid_t
      real(wp) :: low(2) = 0.0_wp
      real(wp) :: top(2) = 0.0_wp
      real(wp) :: cell(2) = 0.0_wp
      integer :: n(2) = 1
      integer, allocatable :: start(:)           !! (n_cell + 1)
      integer, allocatable :: edge(:)
   end type grid_t

contains

   !> List for each of the points the edges whose box, blown up by `reach`, holds it.
   pure subroutine search_candidates(point, low, high, reach, candidates)
      real(wp), intent(in) :: point(:, :)        !! (2, n_point)
      real(wp), intent(in) :: low(:, :), high(:, :)   !! (2, n_edge) boxes of the edges
      real(wp), intent(in) :: reach              !! > 0 [L]
      type(candidates_t), intent(out) :: candidates
      type(grid_t) :: grid
      integer :: pass, i, k, e, cell, n, n_point

      n_point = size(point, 2)
      allocate(candidates%start(n_point + 1), source=1)
      allocate(candidates%edge(0))
      if (n_point == 0 .or. size(low, 2) == 0) return
      call grid_init(grid, point, low, high, reach)
      if (size(grid%edge) == 0) return
      do pass = 1, 2
         n = 0
         do i = 1, n_point
            cell = grid_cell(grid, point(:, i))
            if (cell > 0) then
               do k = grid%start(cell), grid%start(cell + 1) - 1
                  e = grid%edge(k)
                  if (any(point(:, i) < low(:, e) - reach)) cycle
                  if (any(point(:, i) > high(:, e) + reach)) cycle
                  n = n + 1
                  if (pass == 2) candidates%edge(n) = e
               end do
            end if
            candidates%start(i + 1) = n + 1
         end do
         if (pass == 1) then
            deallocate(candidates%edge)
            allocate(candidates%edge(n))
         end if
      end do
   end subroutine search_candidates

   !> Sort the edges into the cells over that part of the plane where points and edges meet.
   pure subroutine grid_init(grid, point, low, high, reach)
      type(grid_t), intent(out) :: grid
      real(wp), intent(in) :: point(:, :), low(:, :), high(:, :), reach
      real(wp) :: size_mean(2)
      integer :: n_edge, a, e, pass, i, j, first(2), last(2), cell
      integer, allocatable :: n_in(:)

      n_edge = size(low, 2)
      allocate(grid%edge(0))
      do a = 1, 2
         grid%low(a) = max(minval(point(a, :)), minval(low(a, :)) - reach)
         grid%top(a) = min(maxval(point(a, :)), maxval(high(a, :)) + reach)
         size_mean(a) = sum(high(a, :) - low(a, :))/real(n_edge, wp) + 2.0_wp*reach
      end do
      if (any(grid%top < grid%low)) return
      grid%n = max(1, int(min((grid%top - grid%low)/size_mean, real(cells_per_edge*n_edge, wp))))
      do while (real(grid%n(1), wp)*real(grid%n(2), wp) > real(cells_per_edge*n_edge, wp))
         grid%n = (grid%n + 1)/2
      end do
      grid%cell = (grid%top - grid%low)/real(grid%n, wp)
      allocate(grid%start(grid%n(1)*grid%n(2) + 1), n_in(grid%n(1)*grid%n(2)))
      do pass = 1, 2
         n_in = 0
         do e = 1, n_edge
            if (any(high(:, e) + reach < grid%low) .or. any(low(:, e) - reach > grid%top)) cycle
            first = place(low(:, e) - reach)
            last = place(high(:, e) + reach)
            do j = first(2), last(2)
               do i = first(1), last(1)
                  cell = i + grid%n(1)*(j - 1)
                  if (pass == 2) grid%edge(grid%start(cell) + n_in(cell)) = e
                  n_in(cell) = n_in(cell) + 1
               end do
            end do
         end do
         if (pass == 1) then
            grid%start(1) = 1
            do i = 1, size(n_in)
               grid%start(i + 1) = grid%start(i) + n_in(i)
            end do
            deallocate(grid%edge)
            allocate(grid%edge(grid%start(size(n_in) + 1) - 1))
         end if
      end do

   contains

      pure function place(x) result(index)
         real(wp), intent(in) :: x(2)
         integer :: index(2)

         index = grid_place(grid, x)
      end function place

   end subroutine grid_init

   !> Cell indices of `x`, moved into the grid if it lies outside.
   pure function grid_place(grid, x) result(index)
      type(grid_t), intent(in) :: grid
      real(wp), intent(in) :: x(2)
      integer :: index(2), a

      index = 1
      do a = 1, 2
         if (grid%cell(a) > 0.0_wp) then
            index(a) = 1 + int(max(0.0_wp, min((x(a) - grid%low(a))/grid%cell(a), &
               real(grid%n(a) - 1, wp))))
         end if
      end do
   end function grid_place

   !> Number of the cell that holds `x`, 0 if it lies outside of the grid.
   pure integer function grid_cell(grid, x)
      type(grid_t), intent(in) :: grid
      real(wp), intent(in) :: x(2)
      integer :: index(2)

      grid_cell = 0
      if (any(x < grid%low) .or. any(x > grid%top)) return
      index = grid_place(grid, x)
      grid_cell = index(1) + grid%n(1)*(index(2) - 1)
   end function grid_cell

   !> Distance of two boxes along the axis where it is largest; 0 if they overlap.
   pure real(wp) function box_distance(low_a, high_a, low_b, high_b)
      real(wp), intent(in) :: low_a(2), high_a(2), low_b(2), high_b(2)

      box_distance = max(0.0_wp, maxval(low_a - high_b), maxval(low_b - high_a))
   end function box_distance

end module emcon_search
