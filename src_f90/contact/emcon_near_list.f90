!> Which master edges each slave node or edge may touch: kept over steps as long as that is safe.
!>
!> Source: docs/theory.md, eq. (15j).
module emcon_near_list
   use emcon_kinds, only : wp
   use emcon_search, only : box_distance, candidates_t, search_candidates
   use emcon_sort, only : unique_sorted
   implicit none
   private
   public :: near_list_t, near_list_init, near_list_update

   !> Reach of the candidate search as a fraction of the mean master edge, at least; and as a
   !> multiple of the largest motion expected in one step, at least.
   real(wp), parameter :: reach_per_edge = 0.5_wp, reach_per_motion = 8.0_wp

   !> Of a reach that round-off does not touch.
   real(wp), parameter :: surely = 0.99_wp

   type :: near_list_t
      integer, allocatable :: item(:, :)         !! (1 or 2, n_item) nodes of each slave item
      integer, allocatable :: edge(:, :)         !! (2, n_edge) master edges
      integer, allocatable :: node(:)            !! distinct nodes of both
      real(wp), allocatable :: u(:, :)           !! (2, size of `node`) when the list was made
      type(candidates_t) :: candidates
      integer :: n_list = 0                      !! lists made so far
      !> Up to this distance the list is complete, whenever it was made [L].
      real(wp) :: depth = 0.0_wp
      !> As long as no node has moved farther since the last update, the list is empty and stays so
      !> [L].
      real(wp) :: clearance = 0.0_wp
      real(wp) :: edge_reach = 0.0_wp            !! least reach of the last search, by the edges [L]
   end type near_list_t

contains

   pure subroutine near_list_init(self, item, edge, u0, depth)
      type(near_list_t), intent(out) :: self
      integer, intent(in) :: item(:, :)          !! (1 or 2, n_item) nodes of each slave item
      integer, intent(in) :: edge(:, :)          !! (2, n_edge) nodes of the master edges
      real(wp), intent(in) :: u0(:, :)           !! (2, n_node)
      real(wp), intent(in) :: depth              !! [L]

      self%depth = depth
      self%item = item
      self%edge = edge
      self%node = unique_sorted([reshape(item, [size(item)]), reshape(edge, [size(edge)])])
      self%u = u0(:, self%node)
   end subroutine near_list_init

   !> Make the list anew if something may have come near: `reach` is the reach of the last search,
   !> 0 to search in any case.
   pure subroutine near_list_update(self, x, u0, du, reach)
      type(near_list_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp), intent(inout) :: reach           !! [L]
      real(wp) :: step_motion, way
      integer :: i

      step_motion = 0.0_wp
      way = 0.0_wp
      do i = 1, size(self%node)
         associate (v => du(:, self%node(i)), w => u0(:, self%node(i)) - self%u(:, i))
            step_motion = max(step_motion, v(1)**2 + v(2)**2)
            way = max(way, w(1)**2 + w(2)**2)
         end associate
      end do
      step_motion = sqrt(step_motion)
      way = sqrt(way)
      if (.not. 2.0_wp*(way + step_motion) + self%depth < reach) then
         call search(self, x, u0, step_motion, reach)
         way = 0.0_wp
      end if
      self%clearance = 0.0_wp
      if (size(self%candidates%edge) == 0) self%clearance = max(0.0_wp, &
         0.5_wp*(surely*reach - self%depth) - way)
   end subroutine near_list_update

   !> Surfaces far apart get a reach as large as their distance and an empty list: then nothing is
   !> done until one has moved half of that.
   pure subroutine search(self, x, u0, step_motion, reach)
      type(near_list_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)
      real(wp), intent(in) :: step_motion
      real(wp), intent(out) :: reach
      real(wp), allocatable :: item(:, :, :), edge(:, :, :)
      real(wp) :: apart

      self%u = u0(:, self%node)
      self%n_list = 1 + mod(self%n_list, huge(self%n_list) - 1)
      call boxes(x, u0, self%item, item)
      call boxes(x, u0, self%edge, edge)
      apart = box_distance(minval(item(:, :, 1), 2), maxval(item(:, :, 2), 2), &
         minval(edge(:, :, 1), 2), maxval(edge(:, :, 2), 2))
      self%edge_reach = reach_per_edge*sum(edge(:, :, 2) - edge(:, :, 1))/real(size(edge, 2), wp)
      reach = max(self%edge_reach, reach_per_motion*step_motion, 0.99_wp*apart) + self%depth
      call search_candidates(item(:, :, 1), item(:, :, 2), edge(:, :, 1), edge(:, :, 2), reach, &
         self%candidates)
   end subroutine search

   !> Low and high corners (2, n, 2) of the boxes around the nodes of each item.
   pure subroutine boxes(x, u, item, box)
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      integer, intent(in) :: item(:, :)
      real(wp), allocatable, intent(out) :: box(:, :, :)
      real(wp) :: at(2)
      integer :: i, k

      allocate(box(2, size(item, 2), 2))
      do i = 1, size(item, 2)
         at = x(:, item(1, i)) + u(:, item(1, i))
         box(:, i, 1) = at
         box(:, i, 2) = at
         do k = 2, size(item, 1)
            at = x(:, item(k, i)) + u(:, item(k, i))
            box(:, i, 1) = min(box(:, i, 1), at)
            box(:, i, 2) = max(box(:, i, 2), at)
         end do
      end do
   end subroutine boxes

end module emcon_near_list
