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
   public :: near_list_t, near_list_find, near_list_init, near_list_update, near_list_within

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
      real(wp), allocatable :: item_box(:, :, :)     !! (n_dim, n_item, 2) at the last update [L]
      real(wp), allocatable :: facet_box(:, :, :)    !! (n_dim, n_facet, 2) the same
      type(candidates_t) :: candidates
      integer :: n_list = 0                      !! lists made so far
      real(wp) :: reach = 0.0_wp                 !! of the list as it was made; 0: none [L]
      real(wp) :: nearest = 0.0_wp               !! of it: distance along the axes, or `reach` [L]
      real(wp) :: depth = 0.0_wp                 !! beyond the fractions above [L]
      real(wp) :: facet_size = 0.0_wp             !! width plus height in the mean, at first [L]
      real(wp) :: motion = 0.0_wp                !! the largest of a node in the step, so far [L]
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

      self%depth = depth
      self%item = item
      self%facet = facet
      self%node = unique_sorted([pack(item, item > 0), pack(facet, facet > 0)])
      self%u = u0(:, self%node)
      call place(self, x, u0)
      associate (box => self%facet_box)
         self%facet_size = sum(box(:, :, 2) - box(:, :, 1))/real(size(box, 2), wp)
      end associate
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
         step_motion = max(step_motion, sum(du(:, self%node(i))**2))
         moved = max(moved, sum((u0(:, self%node(i)) - self%u(:, i))**2))
      end do
      moved = sqrt(moved)
      step_motion = sqrt(step_motion)
      call place(self, x, u0)
      self%motion = max(step_motion, merge(self%motion, 0.0_wp, within > 0.0_wp))
      within = max(within, &
         max(near_per_facet*self%facet_size, near_per_motion*step_motion) + self%depth)
      if (.not. 2.0_wp*moved + (within - self%depth) < surely*(self%reach - self%depth)) then
         call search(self, u0, self%depth + max(list_per_facet*self%facet_size, &
            list_per_motion*step_motion, list_beyond*(within - self%depth)))
         moved = 0.0_wp
      end if
      nearest = self%nearest - 2.0_wp*moved
      if (nearest <= within .and. moved > 0.0_wp) call find_nearest(self, &
         self%reach - 2.0_wp*moved, within, nearest)
      self%clearance = 0.0_wp
      if (nearest > within) self%clearance = surely*(nearest - self%depth)
   end subroutine near_list_update

   !> Let items and facets be where they are at x + u.
   pure subroutine place(self, x, u)
      type(near_list_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]

      call search_boxes(x, u, self%item, self%item_box)
      call search_boxes(x, u, self%facet, self%facet_box)
   end subroutine place

   !> The least distance along the axes of what is listed, or `most`; of what is not above `least`
   !> no more than that it is so.
   pure subroutine find_nearest(self, most, least, nearest)
      type(near_list_t), intent(in) :: self
      real(wp), intent(in) :: most, least        !! [L]
      real(wp), intent(out) :: nearest           !! [L]
      real(wp), dimension(size(self%item_box, 1)) :: low, high
      integer :: i, k

      nearest = most
      associate (list => self%candidates)
         do i = 1, size(list%start) - 1
            low = self%item_box(:, i, 1)
            high = self%item_box(:, i, 2)
            do k = list%start(i), list%start(i + 1) - 1
               associate (box => self%facet_box(:, list%facet(k), :))
                  if (any(max(box(:, 1) - high, low - box(:, 2)) >= nearest)) cycle
                  nearest = min(nearest, box_distance(low, high, box(:, 1), box(:, 2)))
               end associate
               if (nearest <= least) return
            end do
         end do
      end associate
   end subroutine find_nearest

   !> Is facet `f` near item `i`, where the last update has seen them: on each axis within `within`?
   !> Only those of its list can be.
   pure logical function near_list_within(self, i, f, within) result(is_near)
      type(near_list_t), intent(in) :: self
      integer, intent(in) :: i                   !! item, 1..n_item
      integer, intent(in) :: f                   !! facet of the master
      real(wp), intent(in) :: within             !! [L]
      integer :: a

      is_near = .false.
      associate (item => self%item_box, facet => self%facet_box)
         do a = 1, size(item, 1)
            if (.not. max(facet(a, f, 1) - item(a, i, 2), item(a, i, 1) - facet(a, f, 2)) &
               <= within) return
         end do
      end associate
      is_near = .true.
   end function near_list_within

   !> What is near item `i` of its list, as `near_list_within` tells it.
   pure subroutine near_list_find(self, i, within, found, n)
      type(near_list_t), intent(in) :: self
      integer, intent(in) :: i                   !! item, 1..n_item
      real(wp), intent(in) :: within             !! [L]
      integer, intent(inout) :: found(:)         !! (n_facet) the first n: facets of the master
      integer, intent(out) :: n                  !! how many are near
      real(wp), dimension(size(self%item_box, 1)) :: low, high
      integer :: k

      low = self%item_box(:, i, 1)
      high = self%item_box(:, i, 2)
      n = 0
      associate (list => self%candidates)
         do k = list%start(i), list%start(i + 1) - 1
            associate (box => self%facet_box(:, list%facet(k), :))
               if (.not. all(max(box(:, 1) - high, low - box(:, 2)) <= within)) cycle
            end associate
            n = n + 1
            found(n) = list%facet(k)
         end do
      end associate
   end subroutine near_list_find

   !> List what lies within `reach`. Surfaces far apart get a reach as large as their distance and
   !> an empty list: then nothing is done until one has moved half of that.
   pure subroutine search(self, u0, reach)
      type(near_list_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: u0(:, :)   !! (n_dim, n_node) [L]
      real(wp), intent(in) :: reach              !! [L]
      real(wp) :: apart

      self%u = u0(:, self%node)
      self%n_list = 1 + mod(self%n_list, huge(self%n_list) - 1)
      associate (item => self%item_box, facet => self%facet_box)
         apart = box_distance(minval(item(:, :, 1), 2), maxval(item(:, :, 2), 2), &
            minval(facet(:, :, 1), 2), maxval(facet(:, :, 2), 2))
         self%reach = max(reach, surely*apart)
         call search_candidates(item(:, :, 1), item(:, :, 2), facet(:, :, 1), &
            facet(:, :, 2), self%reach, self%candidates)
      end associate
      call find_nearest(self, self%reach, -1.0_wp, self%nearest)
   end subroutine search

end module emcon_near_list
