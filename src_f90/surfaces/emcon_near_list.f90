!> Which master facets are near each slave node or facet: what is near depends on the step alone,
!> the list of what may be near is kept over steps as long as it is complete.
!>
!> Source: docs/theory.md, section 4.9.
module emcon_near_list
   use emcon_kinds, only : wp
   use emcon_search, only : box_distance, candidates_t, search_boxes, search_candidates
   use emcon_sort, only : unique_sorted
   implicit none
   private
   public :: near_list_t, near_list_init, near_list_update, near_list_within

   !> What is near lies within this fraction of the mean master facet, or within what two nodes can
   !> close by the largest motion in the step.
   real(wp), parameter :: near_per_facet = 0.5_wp, near_per_motion = 2.0_wp
   !> A list reaches so far, so that it serves for several steps.
   real(wp), parameter :: list_per_facet = 1.0_wp, list_per_motion = 8.0_wp, list_beyond = 2.0_wp
   !> Of a reach that round-off does not touch.
   real(wp), parameter :: surely = 0.99_wp

   type :: near_list_t
      integer, allocatable :: item(:, :)         !! (most nodes, n_item) of slave items; 0: none
      integer, allocatable :: facet(:, :)        !! (most nodes, n_facet) of the master; 0: none
      integer, allocatable :: node(:)            !! distinct nodes of both
      real(wp), allocatable :: u(:, :)           !! (n_dim, size of `node`) when the list was made
      type(candidates_t) :: candidates
      integer :: n_list = 0                      !! lists made so far
      real(wp) :: reach = 0.0_wp                 !! of the list as it was made; 0: none [L]
      real(wp) :: nearest = 0.0_wp               !! of it: distance along the axes, or `reach` [L]
      real(wp) :: depth = 0.0_wp                 !! beyond the fractions above [L]
      real(wp) :: facet_size = 0.0_wp             !! width plus height in the mean, at first [L]
      !> How far apart the surfaces are where nothing is near, beyond `depth`; else 0 [L].
      real(wp) :: clearance = 0.0_wp
   end type near_list_t

contains

   pure subroutine near_list_init(self, item, facet, x, u0, depth)
      type(near_list_t), intent(out) :: self
      integer, intent(in) :: item(:, :)          !! (most nodes, n_item) 0: none, not the first
      integer, intent(in) :: facet(:, :)         !! (most nodes, n_facet) 0: none, not the first
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (n_dim, n_node) at first [L]
      real(wp), intent(in) :: depth              !! [L]
      real(wp), allocatable :: box(:, :, :)

      self%depth = depth
      self%item = item
      self%facet = facet
      self%node = unique_sorted([pack(item, item > 0), pack(facet, facet > 0)])
      self%u = u0(:, self%node)
      call search_boxes(x, u0, self%facet, box)
      self%facet_size = sum(box(:, :, 2) - box(:, :, 1))/real(size(box, 2), wp)
   end subroutine near_list_init

   !> Let the list be complete for a motion `du` from `u0`, and `within` no less than up to where a
   !> facet is near in it: that never falls within a step, so that what acts stays near.
   pure subroutine near_list_update(self, x, u0, du, within)
      type(near_list_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      real(wp), intent(inout) :: within          !! 0 as a step begins [L]
      real(wp) :: step_motion, moved, nearest
      integer :: i

      step_motion = 0.0_wp
      moved = 0.0_wp
      do i = 1, size(self%node)
         associate (v => du(:, self%node(i)), w => u0(:, self%node(i)) - self%u(:, i))
            step_motion = max(step_motion, sum(v**2))
            moved = max(moved, sum(w**2))
         end associate
      end do
      moved = sqrt(moved)
      step_motion = sqrt(step_motion)
      within = max(within, &
         max(near_per_facet*self%facet_size, near_per_motion*step_motion) + self%depth)
      if (.not. 2.0_wp*moved + (within - self%depth) < surely*(self%reach - self%depth)) then
         call search(self, x, u0, self%depth + max(list_per_facet*self%facet_size, &
            list_per_motion*step_motion, list_beyond*(within - self%depth)))
         moved = 0.0_wp
      end if
      nearest = self%nearest - 2.0_wp*moved
      if (nearest <= within .and. moved > 0.0_wp) call find_nearest(self, x, u0, &
         self%reach - 2.0_wp*moved, within, nearest)
      self%clearance = 0.0_wp
      if (nearest > within) self%clearance = surely*(nearest - self%depth)
   end subroutine near_list_update

   !> The least distance along the axes of what is listed at x + u, or `most`; of what is not above
   !> `least` no more than that it is so.
   pure subroutine find_nearest(self, x, u, most, least, nearest)
      type(near_list_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      real(wp), intent(in) :: most, least        !! [L]
      real(wp), intent(out) :: nearest           !! [L]
      real(wp), allocatable :: item(:, :, :), facet(:, :, :)
      integer :: i, k

      call search_boxes(x, u, self%item, item)
      call search_boxes(x, u, self%facet, facet)
      nearest = most
      associate (list => self%candidates)
         do i = 1, size(list%start) - 1
            do k = list%start(i), list%start(i + 1) - 1
               nearest = min(nearest, box_distance(item(:, i, 1), item(:, i, 2), &
                  facet(:, list%facet(k), 1), facet(:, list%facet(k), 2)))
               if (nearest <= least) return
            end do
         end do
      end associate
   end subroutine find_nearest

   !> Is facet `f` near item `i` at x + u: on each axis within `within`? Only those of its list can
   !> be.
   pure logical function near_list_within(self, i, f, x, u, within) result(is_near)
      type(near_list_t), intent(in) :: self
      integer, intent(in) :: i                   !! item, 1..n_item
      integer, intent(in) :: f                   !! facet of the master
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      real(wp), intent(in) :: within             !! [L]
      real(wp) :: low, high, other_low, other_high
      integer :: a

      is_near = .true.
      do a = 1, size(x, 1)
         call find_range(self%item(:, i), a, x, u, low, high)
         call find_range(self%facet(:, f), a, x, u, other_low, other_high)
         is_near = is_near .and. max(other_low - high, low - other_high) <= within
      end do
   end function near_list_within

   !> The lowest and the highest coordinate of some nodes along an axis at x + u.
   pure subroutine find_range(nodes, axis, x, u, low, high)
      integer, intent(in) :: nodes(:)            !! of the scene; 0: no more
      integer, intent(in) :: axis
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      real(wp), intent(out) :: low, high         !! [L]
      integer :: k

      low = x(axis, nodes(1)) + u(axis, nodes(1))
      high = low
      do k = 2, size(nodes)
         if (nodes(k) == 0) exit
         associate (here => x(axis, nodes(k)) + u(axis, nodes(k)))
            low = min(low, here)
            high = max(high, here)
         end associate
      end do
   end subroutine find_range

   !> List what lies within `reach`. Surfaces far apart get a reach as large as their distance and
   !> an empty list: then nothing is done until one has moved half of that.
   pure subroutine search(self, x, u0, reach)
      type(near_list_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)
      real(wp), intent(in) :: reach              !! [L]
      real(wp), allocatable :: item(:, :, :), facet(:, :, :)
      real(wp) :: apart

      self%u = u0(:, self%node)
      self%n_list = 1 + mod(self%n_list, huge(self%n_list) - 1)
      call search_boxes(x, u0, self%item, item)
      call search_boxes(x, u0, self%facet, facet)
      apart = box_distance(minval(item(:, :, 1), 2), maxval(item(:, :, 2), 2), &
         minval(facet(:, :, 1), 2), maxval(facet(:, :, 2), 2))
      self%reach = max(reach, surely*apart)
      call search_candidates(item(:, :, 1), item(:, :, 2), facet(:, :, 1), &
         facet(:, :, 2), self%reach, self%candidates)
      call find_nearest(self, x, u0, self%reach, -1.0_wp, self%nearest)
   end subroutine search

end module emcon_near_list
