! build: elements
!> Which edges of two surfaces in space cross each other in a step.
!>
!> Each side of faces has a few places for crossings with edges of the other surface: sharp sides
!> for those with sharp edges, and with those along which a face bends outwards; sides that are not
!> sharp are guarded. Which edges are crossed is chosen once per step. Source: docs/theory.md,
!> section 14, after eq. (51).
module emcon_edge_choice_space
   use emcon_bodies, only : bodies_find_tied
   use emcon_csr, only : csr_list_users
   use emcon_edge_pair_space, only : crossing_t, edge_crossing, n_edge_pair_node
   use emcon_edge_sight_space, only : begins_beyond, is_outside, is_past_ends, length_of, &
      look_between, normal_of, unit
   use emcon_edge_stencil_space, only : edge_stencil_place, edge_stencil_t
   use emcon_interactions, only : contact_options_t, contact_pair_t
   use emcon_kinds, only : wp
   use emcon_near_list, only : near_list_find, near_list_init, near_list_t, near_list_update
   use emcon_outline_edges_space, only : outline_edges_add, outline_edges_nodes, &
      outline_edges_normals, outline_edges_t
   use emcon_position_memo, only : position_memo_holds, position_memo_t, position_memo_take
   use emcon_scene, only : scene_t
   use emcon_touch_rule_space, only : through
   implicit none
   private
   public :: edge_choice_t, edge_choice_follow_arcs, edge_choice_init, edge_choice_is_guard, &
      edge_choice_slave, edge_choice_update, least_sine

   !> Edges of the other surface that an edge may cross at once: a sharp one, and one that is
   !> guarded.
   integer, parameter :: n_class = 8, n_guard_class = 2
   !> The sine of the angle between edges below which they run along each other, and nodes hold: of
   !> sharp ones, and of others.
   real(wp), parameter :: least_sine = 1.0e-2_wp, guard_sine = 0.1_wp
   !> That of the angle between the faces at an edge below which it is as flat as none, and holds
   !> nothing; but it holds, up to where it is as hollow, what is in it already by a part of the
   !> length, and what comes down on it edge on: by so much clear of its own faces.
   real(wp), parameter :: least_turn = 1.0e-3_wp, hollow = 0.05_wp, inside = 1.0e-4_wp, &
      clear = 0.1_wp
   !> So deep, by the edge, two edges may be in each other.
   real(wp), parameter :: deepest = 0.3_wp
   !> The same, more than an end of one of them at which its body ends is off: there nodes hold.
   real(wp), parameter :: room_beside = 0.02_wp
   !> Heights that are larger by this than any that counts are so whatever rounding does.
   real(wp), parameter :: far = 1.001_wp

   type :: edge_choice_t
      logical :: is_self = .false.                    !! of a surface with itself
      integer :: first = 1                            !! surface whose edges cross sharp ones
      type(outline_edges_t) :: edges                  !! of both surfaces
      integer :: n_sharp = 0
      integer, allocatable :: slave(:)                !! the sharp ones, then those with guards
      integer, allocatable :: body(:)                 !! (n of the edges)
      integer, allocatable :: class(:)                !! (n of the edges) 1 to n_class
      !> (n of the edges) is one of a curved surface, if gaps follow arcs; else not allocated
      logical, allocatable :: is_curved(:)
      type(near_list_t) :: near
      type(position_memo_t) :: memo                   !! of the nodes as stencils were chosen:
      real(wp) :: reach = 0.0_wp                      !! among edges up to there [L]
      real(wp) :: offset = 0.0_wp                     !! gaps are counted from it on, >= 0 [L]
      logical :: gives_way = .false.                  !! overlaps store energy: they stay
      type(edge_stencil_t), allocatable :: stencil(:)    !! by slave
   end type edge_choice_t

contains

   !> Set up the edges of the pair `pair` of `scene`.
   subroutine edge_choice_init(self, scene, pair, depth)
      type(edge_choice_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      real(wp), intent(in) :: depth              !! gaps may act from there on [L]
      integer, allocatable :: node(:, :), body(:)
      integer :: i, n

      self%is_self = pair%slave == pair%master
      self%offset = pair%interaction%offset
      call outline_edges_add(self%edges, scene, scene%surface(pair%slave))
      if (.not. self%is_self) call outline_edges_add(self%edges, scene, scene%surface(pair%master))
      associate (edges => self%edges)
         self%slave = pack([(i, i = 1, edges%n)], edges%is_sharp)
         self%n_sharp = size(self%slave)
         self%first = merge(1, 2, count(edges%surface(self%slave) == 1) >= &
            count(edges%surface(self%slave) == 2))
         self%slave = [self%slave, pack([(i, i = 1, edges%n)], .not. (edges%is_sharp .or. &
            edges%is_spoke))]
         allocate(self%stencil(places_before(self, size(self%slave) + 1)))
         node = outline_edges_nodes(edges)
         call bodies_find_tied(scene, node, body, n)
         self%body = body(node(1, :))
         call find_classes(edges, self%class)
      end associate
      if (size(self%slave) > 0) call near_list_init(self%near, node(:2, self%slave), node, &
         scene%x, scene%u0, depth)
   end subroutine edge_choice_init

   !> Sort edges into classes so that those with an end in common are of different ones, as far as
   !> there are enough.
   pure subroutine find_classes(edges, class)
      type(outline_edges_t), intent(in) :: edges
      integer, allocatable, intent(out) :: class(:)
      integer, allocatable :: start(:), at(:)
      integer :: i, j, k, used(n_class)

      allocate(class(edges%n), source=0)
      call csr_list_users(size(edges%node, 2), [(1 + 2*k, k = 0, edges%n)], &
         reshape(edges%ends, [2*edges%n]), start, at)
      do i = 1, size(class)
         used = 0
         do k = 1, 2
            do j = start(edges%ends(k, i)) + 1, start(edges%ends(k, i) + 1)
               if (class(at(j)) > 0) used(class(at(j))) = used(class(at(j))) + 1
            end do
         end do
         class(i) = minloc(cshift(used, mod(i, n_class)), dim=1)
         class(i) = 1 + mod(class(i) - 1 + mod(i, n_class), n_class)
      end do
   end subroutine find_classes

   !> Where gaps follow curved surfaces these have no edges: nodes hold them.
   pure subroutine edge_choice_follow_arcs(self, x, options, is_wanted)
      type(edge_choice_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (3, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options
      logical, intent(in) :: is_wanted           !! else between facets
      real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp
      real(wp) :: still(3, size(x, 2)), normal(3, 2)
      integer :: i

      self%memo%is_known = .false.
      if (allocated(self%is_curved)) deallocate(self%is_curved)
      if (.not. is_wanted) return
      allocate(self%is_curved(self%edges%n))
      still = 0.0_wp
      do i = 1, self%edges%n
         normal = outline_edges_normals(self%edges, i, x, still)
         self%is_curved(i) = dot_product(normal(:, 1), normal(:, 2)) &
            > cos(options%smoothing_angle*degree)
      end do
   end subroutine edge_choice_follow_arcs

   !> Choose the edges that each one crosses in the step. From the same start and up to the same
   !> reach the choice is the same.
   pure subroutine edge_choice_update(self, x, u0, du, reach)
      type(edge_choice_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(inout) :: reach           !! so far edges are near; 0: a step begins [L]
      real(wp) :: normals(3, 2)
      integer :: i, k, n, near(self%edges%n)

      call near_list_update(self%near, x, u0, du, reach)
      if (abs(self%reach - reach) <= 0.0_wp) then
         if (position_memo_holds(self%memo, self%near%node, x, u0)) return
      end if
      call position_memo_take(self%memo, self%near%node, x, u0)
      self%reach = reach
      self%stencil%master = 0
      do i = 1, size(self%slave)
         call find_partners(self, i, near, n)
         if (n > 0) normals = outline_edges_normals(self%edges, self%slave(i), x, u0)
         do k = 1, n
            call choose(self, i, near(k), normals, x, u0)
         end do
      end do
   end subroutine edge_choice_update

   !> The edges near slave `i` that it may ever cross.
   pure subroutine find_partners(self, i, partner, n)
      type(edge_choice_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1 to the number of slaves
      integer, intent(inout) :: partner(:)       !! (n) edges
      integer, intent(out) :: n
      integer :: k, n_near

      call near_list_find(self%near, i, self%reach, partner, n_near)
      n = 0
      do k = 1, n_near
         if (.not. may_cross(self, self%slave(i), partner(k))) cycle
         n = n + 1
         partner(n) = partner(k)
      end do
   end subroutine find_partners

   !> Let edge number `i` cross edge `m` in the step, if they may meet in it and no others come
   !> first.
   pure subroutine choose(self, i, m, of_slave, x, u0)
      type(edge_choice_t), intent(inout) :: self
      integer, intent(in) :: i, m
      real(wp), intent(in) :: of_slave(3, 2)     !! outward normals of the faces at the edge `i`
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      real(wp), dimension(3, n_edge_pair_node) :: at
      real(wp) :: normal(3), length(2), gap, within, turn, least
      type(crossing_t) :: crossing
      type(edge_stencil_t) :: new
      logical :: is_guard

      is_guard = i > self%n_sharp
      new = edge_stencil_t(self%slave(i), m)
      call edge_stencil_place(self%edges, new, x, u0, at)
      length(1) = length_of(at(:, 1), at(:, 2))
      length(2) = length_of(at(:, 3), at(:, 4))
      normal = unit(normal_of(at))
      if (abs(dot_product(normal, at(:, 3) - at(:, 1))) > far*max(self%reach, deepest &
         *minval(length) - self%offset)) return
      new%side = sign(1.0_wp, dot_product(normal, sum(of_slave, 2)))
      normal = new%side*normal
      ! The places take the most to find: what no place would count for goes before.
      call look_between(normal, of_slave, at(:, 2) - at(:, 1), within, turn)
      if (is_outside(within, turn, -hollow)) return
      if (is_past_ends(at, length, far*self%reach)) return
      crossing = edge_crossing(at)
      if (crossing%sine < merge(guard_sine, least_sine, is_guard)) return
      if (any(max(-crossing%place, crossing%place - 1.0_wp)*length > self%reach)) return
      gap = new%side*crossing%height
      if (gap - self%offset < -deepest*minval(length) .or. gap > self%reach) return
      if (-gap > way_out(self%edges, new, crossing, length) + room_beside*minval(length) .and. &
         .not. self%gives_way) return
      if (is_through(self, new, gap)) return
      least = least_turn
      if (gap - self%offset < -inside*minval(length) .or. (within > clear .and. &
         self%edges%bends(m))) least = -hollow
      if (is_guard) least = -hollow
      if (is_outside(within, turn, least)) return
      call look_between(-normal, outline_edges_normals(self%edges, m, x, u0), &
         at(:, 4) - at(:, 3), within, turn)
      if (is_outside(within, turn, least)) return
      new%height = gap
      new%beyond = beyond_ends(crossing)
      call put(self, i, new)
   end subroutine choose

   !> Is one edge on the far side of the other body, by the elements of both?
   pure logical function is_through(self, crossing, gap)
      type(edge_choice_t), intent(in) :: self
      type(edge_stencil_t), intent(in) :: crossing
      real(wp), intent(in) :: gap                !! [L]

      associate (both => [crossing%edge, crossing%master])
         is_through = .not. self%gives_way .and. -gap > through*sum(self%edges%depth(both)) &
            .and. self%body(both(1)) /= self%body(both(2))
      end associate
   end function is_through

   !> Give a crossing of slave `i` a place: that of the class of its edge, or a later one. Where it
   !> is taken, the crossing that comes first has it, and the other one goes on to the next: who has
   !> which place does not depend on the order in which they are found.
   pure subroutine put(self, i, crossing)
      type(edge_choice_t), intent(inout) :: self
      integer, intent(in) :: i                   !! 1 to the number of slaves
      type(edge_stencil_t), intent(in) :: crossing
      type(edge_stencil_t) :: new, old
      integer :: k, n, home, before

      before = places_before(self, i)
      n = merge(n_class, n_guard_class, i <= self%n_sharp)
      home = self%class(crossing%master) - 1
      new = crossing
      do k = home, home + n - 1
         associate (place => self%stencil(before + 1 + mod(k, n)))
            old = place
            if (old%master > 0) then
               if (.not. comes_first(new, old)) cycle
            end if
            place = new
            if (old%master == 0) return
            new = old
         end associate
      end do
   end subroutine put

   !> How many places the slaves before `i` have.
   pure integer function places_before(self, i) result(n)
      type(edge_choice_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1 to the number of slaves, and one more

      n = n_class*min(i - 1, self%n_sharp) + n_guard_class*max(0, i - 1 - self%n_sharp)
   end function places_before

   !> May edge `i` with places ever cross edge `m`? Of two edges with places one crosses the other.
   !> What is not sharp is of other bodies.
   pure logical function may_cross(self, i, m)
      type(edge_choice_t), intent(in) :: self
      integer, intent(in) :: i, m                !! 1 to n of the edges
      integer :: j, k

      may_cross = .false.
      if (allocated(self%is_curved)) then
         if (self%is_curved(i)) return
      end if
      associate (edges => self%edges)
         may_cross = merge(self%body(i) /= self%body(m) .or. edges%is_sharp(m), &
            edges%surface(i) /= edges%surface(m), self%is_self)
         if ((edges%is_sharp(i) .eqv. edges%is_sharp(m)) .and. .not. edges%is_spoke(m)) then
            may_cross = may_cross .and. merge(m > i, edges%surface(i) == self%first, self%is_self)
         end if
         do k = 1, 2
            do j = 1, 2
               if (.not. may_cross) return
               may_cross = .not. any(edges%node(:, edges%ends(j, m)) == edges%node(1, &
                  edges%ends(k, i)))
            end do
         end do
      end associate
   end function may_cross

   !> Is a crossing more within the ends of its edges than another one, or as much and at a lower
   !> gap?
   pure logical function comes_first(new, old)
      type(edge_stencil_t), intent(in) :: new, old

      if (abs(new%beyond - old%beyond) > 0.0_wp) then
         comes_first = new%beyond < old%beyond
      else if (abs(new%height - old%height) > 0.0_wp) then
         comes_first = new%height < old%height
      else
         comes_first = new%master < old%master
      end if
   end function comes_first

   !> How far past the ends of edges they cross, by their lengths; within them 0.
   pure real(wp) function beyond_ends(crossing) result(beyond)
      type(crossing_t), intent(in) :: crossing

      beyond = max(0.0_wp, maxval(max(-crossing%place, crossing%place - 1.0_wp)) - begins_beyond)
   end function beyond_ends

   !> How far from a crossing an end is at which a body ends, the nearest; past it 0, huge if there
   !> is none [L].
   pure real(wp) function way_out(edges, pair, crossing, length) result(way)
      type(outline_edges_t), intent(in) :: edges
      type(edge_stencil_t), intent(in) :: pair   !! that cross
      type(crossing_t), intent(in) :: crossing
      real(wp), intent(in) :: length(2)          !! of the edges [L]
      integer :: k, which(2)

      way = huge(way)
      which = [pair%edge, pair%master]
      do k = 1, 2
         if (edges%at_rim(1, which(k))) way = min(way, crossing%place(k)*length(k))
         if (edges%at_rim(2, which(k))) way = min(way, (1.0_wp - crossing%place(k))*length(k))
      end do
      way = max(0.0_wp, way)
   end function way_out

   !> The ends of the edge that place `i` is of.
   pure function edge_choice_slave(self, i) result(node)
      type(edge_choice_t), intent(in) :: self
      integer, intent(in) :: i                   !! of `stencil`
      integer :: node(2)                         !! of the scene

      integer :: k

      associate (n_sharp => self%n_sharp)
         k = 1 + (i - 1)/n_class
         if (k > n_sharp) k = 1 + n_sharp + (i - 1 - n_class*n_sharp)/n_guard_class
      end associate
      node = self%edges%node(1, self%edges%ends(:, self%slave(k)))
   end function edge_choice_slave

   !> Is place `i` that of an edge that is not sharp?
   pure logical function edge_choice_is_guard(self, i) result(is_guard)
      type(edge_choice_t), intent(in) :: self
      integer, intent(in) :: i                   !! of `stencil`

      is_guard = i > n_class*self%n_sharp
   end function edge_choice_is_guard

end module emcon_edge_choice_space
