!> Which master edges are near each slave node or edge: what is near depends on the step alone, the
!> list of what may be near is kept over steps as long as it is complete.
!>
!> Source: docs/theory.md, section 4.9.
module emcon_near_list
   use emcon_kinds, only : wp
   use emcon_search, only : box_distance, candidates_t, search_candidates
   use emcon_sort, only : unique_sorted
   implicit none
   private
   public :: near_list_t, near_list_init, near_list_update, near_list_within

   !> What is near lies within this fraction of the mean master edge, or within what two nodes can
   !> close by the largest motion in the step.
   real(wp), parameter :: near_per_edge = 0.5_wp, near_per_motion = 2.0_wp
   !> A list reaches so far, so that it serves for several steps.
   real(wp), parameter :: list_per_edge = 1.0_wp, list_per_motion = 8.0_wp, list_beyond = 2.0_wp
   !> Of a reach that round-off does not touch.
   real(wp), parameter :: surely = 0.99_wp

   type :: near_list_t
      integer, allocatable :: item(:, :)         !! (1 or 2, n_item) nodes of each slave item
      integer, allocatable :: edge(:, :)         !! (2, n_edge) master edges
      integer, allocatable :: node(:)            !! distinct nodes of both
      real(wp), allocatable :: u(:, :)           !! (2, size of `node`) when the list was made
      type(candidates_t) :: candidates
      integer :: n_list = 0                      !! lists made so far
      real(wp) :: reach = 0.0_wp                 !! of the list as it was made; 0: none [L]
      real(wp) :: nearest = 0.0_wp               !! of it: distance along the axes, or `reach` [L]
      real(wp) :: depth = 0.0_wp                 !! beyond the fractions above [L]
      real(wp) :: edge_size = 0.0_wp             !! width plus height in the mean, at first [L]
      !> How far apart the surfaces are where nothing is near, beyond `depth`; else 0 [L].
      real(wp) :: clearance = 0.0_wp
   end type near_list_t

contains

   pure subroutine near_list_init(self, item, edge, x, u0, depth)
      type(near_list_t), intent(out) :: self
      integer, intent(in) :: item(:, :)          !! (1 or 2, n_item) nodes of each slave item
      integer, intent(in) :: edge(:, :)          !! (2, n_edge) nodes of the master edges
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (2, n_node) at first [L]
      real(wp), intent(in) :: depth              !! [L]
      real(wp), allocatable :: box(:, :, :)

      self%depth = depth
      self%item = item
      self%edge = edge
      self%node = unique_sorted([reshape(item, [size(item)]), reshape(edge, [size(edge)])])
      self%u = u0(:, self%node)
      call boxes(x, u0, self%edge, box)
      self%edge_size = sum(box(:, :, 2) - box(:, :, 1))/real(size(box, 2), wp)
   end subroutine near_list_init

   !> Let the list be complete for a motion `du` from `u0`, and `within` no less than up to where an
   !> edge is near in it: that never falls within a step, so that what acts stays near.
   pure subroutine near_list_update(self, x, u0, du, within)
      type(near_list_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp), intent(inout) :: within          !! 0 as a step begins [L]
      real(wp) :: step_motion, way, nearest
      integer :: i

      step_motion = 0.0_wp
      way = 0.0_wp
      do i = 1, size(self%node)
         associate (v => du(:, self%node(i)), w => u0(:, self%node(i)) - self%u(:, i))
            step_motion = max(step_motion, v(1)**2 + v(2)**2)
            way = max(way, w(1)**2 + w(2)**2)
         end associate
      end do
      way = sqrt(way)
      step_motion = sqrt(step_motion)
      within = max(within, &
         max(near_per_edge*self%edge_size, near_per_motion*step_motion) + self%depth)
      if (.not. 2.0_wp*way + (within - self%depth) < surely*(self%reach - self%depth)) then
         call search(self, x, u0, self%depth + max(list_per_edge*self%edge_size, &
            list_per_motion*step_motion, list_beyond*(within - self%depth)))
         way = 0.0_wp
      end if
      nearest = self%nearest - 2.0_wp*way
      if (nearest <= within .and. way > 0.0_wp) call find_nearest(self, x, u0, &
         self%reach - 2.0_wp*way, within, nearest)
      self%clearance = 0.0_wp
      if (nearest > within) self%clearance = surely*(nearest - self%depth)
   end subroutine near_list_update

   !> The least distance along the axes of what is listed at x + u, or `most`; of what is not above
   !> `least` no more than that it is so.
   pure subroutine find_nearest(self, x, u, most, least, nearest)
      type(near_list_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (2, n_node) [L]
      real(wp), intent(in) :: most, least        !! [L]
      real(wp), intent(out) :: nearest           !! [L]
      real(wp), allocatable :: item(:, :, :), edge(:, :, :)
      integer :: i, k

      call boxes(x, u, self%item, item)
      call boxes(x, u, self%edge, edge)
      nearest = most
      associate (list => self%candidates)
         do i = 1, size(list%start) - 1
            do k = list%start(i), list%start(i + 1) - 1
               nearest = min(nearest, box_distance(item(:, i, 1), item(:, i, 2), &
                  edge(:, list%edge(k), 1), edge(:, list%edge(k), 2)))
               if (nearest <= least) return
            end do
         end do
      end associate
   end subroutine find_nearest

   !> Is edge `e` near item `i` at x + u: on each axis within `within`? Only edges of its list can
   !> be.
   pure logical function near_list_within(self, i, e, x, u, within) result(is_near)
      type(near_list_t), intent(in) :: self
      integer, intent(in) :: i                   !! item that is a node, 1..n_item
      integer, intent(in) :: e                   !! master edge
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (2, n_node) [L]
      real(wp), intent(in) :: within             !! [L]
      real(wp) :: at, a, b
      integer :: k

      is_near = .true.
      associate (node => self%item(1, i), first => self%edge(1, e), &
            last => self%edge(size(self%edge, 1), e))
         do k = 1, size(x, 1)
            at = x(k, node) + u(k, node)
            a = x(k, first) + u(k, first)
            b = x(k, last) + u(k, last)
            is_near = is_near .and. max(min(a, b) - at, at - max(a, b)) <= within
         end do
      end associate
   end function near_list_within

   !> List what lies within `reach`. Surfaces far apart get a reach as large as their distance and
   !> an empty list: then nothing is done until one has moved half of that.
   pure subroutine search(self, x, u0, reach)
      type(near_list_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)
      real(wp), intent(in) :: reach              !! [L]
      real(wp), allocatable :: item(:, :, :), edge(:, :, :)
      real(wp) :: apart

      self%u = u0(:, self%node)
      self%n_list = 1 + mod(self%n_list, huge(self%n_list) - 1)
      call boxes(x, u0, self%item, item)
      call boxes(x, u0, self%edge, edge)
      apart = box_distance(minval(item(:, :, 1), 2), maxval(item(:, :, 2), 2), &
         minval(edge(:, :, 1), 2), maxval(edge(:, :, 2), 2))
      self%reach = max(reach, surely*apart)
      call search_candidates(item(:, :, 1), item(:, :, 2), edge(:, :, 1), edge(:, :, 2), &
         self%reach, self%candidates)
      call find_nearest(self, x, u0, self%reach, -1.0_wp, self%nearest)
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
