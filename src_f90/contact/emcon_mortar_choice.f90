!> Which pairs of slave and master edges are meant in a step.
!>
!> Source: docs/theory.md, section 4.5, choice of pairs.
module emcon_mortar_choice
   use emcon_chain_plane, only : chain_is_seam, chain_t, next, previous
   use emcon_kinds, only : dp, wp
   use emcon_mortar_frame, only : frame_hit, frame_init, frame_project, frame_t, n_place, &
      pair_stencil_t, local_master
   use emcon_mortar_stencil, only : frame_faces, stencil_gather
   use emcon_sort, only : sort_order
   implicit none
   private
   public :: pair_append, pair_cut_corners, pair_comes_near, pair_is_meant, pairs_drop_far, &
      pairs_seen

   !> A pair is kept though its edges do not overlap if they miss each other by less than this
   !> fraction of the slave edge: they may come to overlap within the step.
   real(wp), parameter :: margin = 0.25_wp
   !> Of two master edges that cover the same part of a slave edge, more than this fraction of it,
   !> the nearer one is meant.
   real(wp), parameter :: same_part = 0.01_wp
   !> A point looks at a master node if it meets an edge there within this fraction of it: far above
   !> the round-off that a scene gathers.
   real(wp), parameter :: at_node = 1.0e-4_wp

contains

   !> Do the boxes of both edges come within `depth` of each other on the way from `x0` to
   !> x0 + `dx`, along both axes at once? What the list of candidates holds beyond that depends on
   !> its age.
   pure logical function pair_comes_near(depth, x0, dx)
      real(wp), intent(in) :: depth                      !! [L]
      real(wp), intent(in) :: x0(:, :), dx(:, :)         !! (2, 4) slave edge, master edge [L]
      real(wp) :: d(4, 0:1), first, last
      integer :: i

      d(:, 0) = box_distances(x0) - depth
      d(:, 1) = box_distances(x0 + dx) - depth
      first = 0.0_wp
      last = 1.0_wp
      pair_comes_near = .false.
      do i = 1, 4
         if (max(d(i, 0), d(i, 1)) <= 0.0_wp) cycle
         if (min(d(i, 0), d(i, 1)) > 0.0_wp) return
         associate (zero => d(i, 0)/(d(i, 0) - d(i, 1)))
            if (d(i, 0) > 0.0_wp) then
               first = max(first, zero)
            else
               last = min(last, zero)
            end if
         end associate
      end do
      pair_comes_near = first <= last
   end function pair_comes_near

   !> By how much the box of the master edge lies above and below that of the slave edge, by axis.
   pure function box_distances(x) result(d)
      real(wp), intent(in) :: x(:, :)            !! (2, 4) as in `pair_comes_near` [L]
      real(wp) :: d(4)

      d(:2) = min(x(:, 3), x(:, 4)) - max(x(:, 1), x(:, 2))
      d(3:) = min(x(:, 1), x(:, 2)) - max(x(:, 3), x(:, 4))
   end function box_distances

   !> Do the edges face each other and overlap, or nearly so, the master not behind the slave?
   pure logical function pair_is_meant(stencil, frame, deepest)
      type(pair_stencil_t), intent(in) :: stencil
      type(frame_t), intent(in) :: frame(0:1)    !! at the start and at the expected end
      real(wp), intent(in) :: deepest            !! so far, per slave edge, it may be behind
      real(wp) :: low(0:1), high(0:1), eta, gap
      integer :: k

      pair_is_meant = .false.
      do k = 0, 1
         if (.not. (frame_faces(frame(k), 1, 2) .and. minval(frame(k)%edge_along) > 0.0_wp)) return
         if (.not. is_before_focus(frame(k))) return
         low(k) = frame_project(frame(k), 2)
         high(k) = frame_project(frame(k), 1)
      end do
      if (.not. any(high > -margin .and. low < 1.0_wp + margin)) return
      pair_is_meant = .true.
      low = max(0.0_wp, low)
      high = min(1.0_wp, high)
      if (.not. high(0) > low(0)) return
      call frame_hit(frame(0), stencil, 0.5_wp*(low(0) + high(0)), eta, gap)
      pair_is_meant = gap > -deepest*frame(0)%length
   end function pair_is_meant

   !> Do both master nodes project from one place only: does (15f) fall over the whole slave edge?
   !> Beyond the point where its normals cross it does not, and rounding would choose a root. Where
   !> both stand beside all of the edge neither projects to it.
   pure logical function is_before_focus(frame)
      type(frame_t), intent(in) :: frame
      real(wp) :: bend                           ! of F

      associate (q => frame%edge_along)
         bend = maxval(q) - minval(q)
         associate (at_first => frame%along(1, :2), at_last => frame%along(2, :2) - q(2))
            is_before_focus = all(at_last - at_first < -bend) .or. all(min(abs(at_first), &
               abs(at_last)) > 0.25_wp*bend .and. at_first*at_last > 0.0_wp)
         end associate
      end associate
   end function is_before_focus

   !> Leave out neighbours of the master edge that the slave edge does not face.
   pure subroutine pair_cut_corners(stencil, frame)
      type(pair_stencil_t), intent(inout) :: stencil
      type(frame_t), intent(in) :: frame

      if (.not. frame_faces(frame, 3, 1)) stencil%node(local_master(3)) = 0
      if (.not. frame_faces(frame, 2, 4)) stencil%node(local_master(4)) = 0
   end subroutine pair_cut_corners

   pure subroutine pair_append(list, n, stencil)
      type(pair_stencil_t), allocatable, intent(inout) :: list(:)   !! (>= n) grows
      integer, intent(inout) :: n                !! number in `list`, >= 0
      type(pair_stencil_t), intent(in) :: stencil
      type(pair_stencil_t), allocatable :: longer(:)

      if (n == size(list)) then
         allocate(longer(2*n + 16))
         longer(:n) = list
         call move_alloc(longer, list)
      end if
      n = n + 1
      list(n) = stencil
   end subroutine pair_append

   !> Of the pairs of one slave edge, from number `first` to `n`, keep the nearer one of two that
   !> cover the same part of it; not of two that overlap a little at a joint of the master.
   pure subroutine pairs_drop_far(list, master, first, n, x, u0)
      type(pair_stencil_t), intent(inout) :: list(:)   !! (>= n)
      type(chain_t), intent(in) :: master
      integer, intent(in) :: first               !! >= 1
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (2, n_node) [L]
      integer, intent(inout) :: n                !! out: what is kept
      real(wp), dimension(n - first + 1) :: low, high, height
      integer :: order(n - first + 1), i, j
      logical :: is_kept(n - first + 1)
      type(frame_t) :: frame
      real(wp) :: local(2, n_place), dlocal(2, n_place), eta

      if (size(low) < 2) return
      do i = 1, size(low)
         associate (stencil => list(first + i - 1))
            call stencil_gather(stencil, x, u0, u0, local, dlocal)
            call frame_init(frame, stencil, local)
            low(i) = max(0.0_wp, min(1.0_wp, frame_project(frame, 2)))
            high(i) = max(0.0_wp, min(1.0_wp, frame_project(frame, 1)))
            call frame_hit(frame, stencil, 0.5_wp*(low(i) + high(i)), eta, height(i))
         end associate
      end do
      order = sort_order(real(abs(height), dp))
      is_kept = .false.
      do i = 1, size(low)
         associate (this => order(i))
            is_kept(this) = .true.
            do j = 1, size(low)
               if (j == this .or. .not. is_kept(j)) cycle
               if (min(high(j), high(this)) - max(low(j), low(this)) <= same_part) cycle
               if (chain_is_seam(master, list(first + j - 1)%edge, &
                  list(first + this - 1)%edge)) cycle
               is_kept(this) = .false.
            end do
         end associate
      end do
      n = first - 1
      do j = 1, size(low)
         if (.not. is_kept(j)) cycle
         n = n + 1
         list(n) = list(first + j - 1)
      end do
   end subroutine pairs_drop_far

   !> The pair, of those of one slave edge, that each point of a slave edge looks at, at the
   !> start of the step or else at its expected end; 0: none. A point that looks between the nodes
   !> of a joint of the master sees one of the edges there, one that looks at a master node the
   !> edges on both sides of it: which of them comes first must not matter.
   pure subroutine pairs_seen(pair, master, point, x, u0, du, seen)
      type(pair_stencil_t), intent(in) :: pair(:)   !! (>= 0) of the edge
      type(chain_t), intent(in) :: master
      real(wp), intent(in) :: point(:)           !! (n_point) on 0..1
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      integer, intent(out) :: seen(:, :)         !! (2, n_point) index, and the one beside it or 0
      type(frame_t) :: frame
      real(wp) :: local(2, n_place), dlocal(2, n_place), beyond(2)
      integer :: pass, k
      logical :: is_open(size(point))

      seen = 0
      do pass = 0, 3                             ! start and end, then both up to joints
         is_open = seen(1, :) == 0
         if (.not. any(is_open)) exit
         beyond = 0.0_wp
         do k = 1, size(pair)
            if (pass > 1) then
               beyond = seam_width(master, pair(k)%edge, x, u0)
               if (.not. any(beyond > 0.0_wp)) cycle
            end if
            call stencil_gather(pair(k), x, u0, du, local, dlocal)
            call frame_init(frame, pair(k), local + mod(pass, 2)*dlocal)
            call see_pair(frame, pair(k), k, beyond, point, is_open, seen)
         end do
         where (seen(1, :) == 0) seen(2, :) = 0
      end do
      seen = max(0, seen)
   end subroutine pairs_seen

   !> Enter number `k` for the open points that look at the edge of `stencil`, up to `beyond` past
   !> its ends: first, or beside another one if they look at one of its nodes.
   pure subroutine see_pair(frame, stencil, k, beyond, point, is_open, seen)
      type(frame_t), intent(in) :: frame
      type(pair_stencil_t), intent(in) :: stencil
      integer, intent(in) :: k
      real(wp), intent(in) :: beyond(2), point(:)
      logical, intent(in) :: is_open(:)
      integer, intent(inout) :: seen(:, :)       !! (2, n_point); second -1: there is none
      real(wp) :: eta, gap
      logical :: is_at_node
      integer :: i

      do i = 1, size(point)
         if (.not. is_open(i)) cycle
         call frame_hit(frame, stencil, point(i), eta, gap)
         is_at_node = min(abs(eta), abs(1.0_wp - eta)) <= at_node
         if (seen(1, i) == 0 .and. eta >= -beyond(1) .and. eta <= 1.0_wp + beyond(2)) then
            seen(1, i) = k
            if (.not. is_at_node) seen(2, i) = -1
         else if (is_at_node .and. seen(2, i) == 0) then
            seen(2, i) = k
         end if
      end do
   end subroutine see_pair

   !> Distance of the nodes of a joint at either end of edge `e`, relative to its length; 0 where
   !> there is none.
   pure function seam_width(master, e, x, u0) result(width)
      type(chain_t), intent(in) :: master
      integer, intent(in) :: e
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)
      real(wp) :: width(2)
      integer :: side, beside(size(width))

      width = 0.0_wp
      beside = [master%neighbour(previous, e), master%neighbour(next, e)]
      do side = 1, 2
         if (beside(side) == 0) cycle
         associate (a => master%facet(side, e), b => master%facet(3 - side, beside(side)))
            if (a /= b) width(side) = norm2((x(:, b) - x(:, a)) + (u0(:, b) - u0(:, a))) &
               /master%size(e)
         end associate
      end do
   end function seam_width

end module emcon_mortar_choice
