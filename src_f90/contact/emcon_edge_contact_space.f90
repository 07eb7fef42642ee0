!> Contact of sharp edges in space: edges of two bodies that cross, with no node in front of a face.
!>
!> Each sharp edge has a few places for crossings, one for each class of edges of the other surface:
!> of sharp ones, and of those along which a face bends outwards. Which edge it crosses is chosen
!> once per step. Source: docs/theory.md, section 15, after eq. (51).
module emcon_edge_contact_space
   use emcon_bodies, only : bodies_find_tied
   use emcon_condition_nodes, only : condition_resize, condition_resize_slip, nodes_append
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t, gap_state_t, max_penetration_on_entry
   use emcon_contact_law_registry, only : contact_laws_of_surface
   use emcon_csr, only : csr_list_users
   use emcon_edge_pair_space, only : crossing_t, edge_crossing, edge_pair_gap, edge_pair_gap_t, &
      edge_pair_slip, edge_pair_slip_t, n_edge_pair_node
   use emcon_edge_sight_space, only : is_outside, is_past_ends, length_of, look_between, unit
   use emcon_element_kind, only : max_face_nodes
   use emcon_guards, only : crossing_bar
   use emcon_interactions, only : contact_damping_t, contact_options_t, contact_pair_t, &
      interaction_reach, interaction_t
   use emcon_kinds, only : wp
   use emcon_near_list, only : near_list_find, near_list_init, near_list_t, near_list_update
   use emcon_node_sums, only : node_sums_first, node_sums_second
   use emcon_outline_edges_space, only : outline_edges_add, outline_edges_nodes, &
      outline_edges_normals, outline_edges_place, outline_edges_t
   use emcon_position_memo, only : position_memo_holds, position_memo_t, position_memo_take
   use emcon_rotation, only : cross_product
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: edge_contact_t, edge_contact_init

   !> Edges of the other surface that an edge may cross at once: one of each class; of those that
   !> are guarded only, of each second one.
   integer, parameter :: n_class = 8, n_guard_class = 8
   !> The sine of the angle between edges below which they run along each other, and nodes hold: of
   !> sharp ones, and of others.
   real(wp), parameter :: least_sine = 1.0e-2_wp, guard_sine = 0.1_wp
   !> That of the angle between the faces at an edge below which it is as flat as none, and holds
   !> nothing; but it holds, up to where it is as hollow, what is in it already by a part of the
   !> length, and what comes down on it edge on: by so much clear of its own faces.
   real(wp), parameter :: least_turn = 1.0e-3_wp, hollow = 0.05_wp, inside = 1.0e-4_wp, &
      clear = 0.1_wp
   !> So far inside its ends, by its length, an edge begins to hold, as nodes hold there; so far
   !> past them it goes on to hold.
   real(wp), parameter :: begins_beyond = -1.0e-3_wp, ends_beyond = 0.05_wp
   !> So deep, by the edge, two edges may be in each other, and may be as a contact begins.
   real(wp), parameter :: deepest = 0.3_wp, deepest_start = 0.1_wp
   !> So deep, by the smaller face, two edges that are not sharp begin to hold each other.
   real(wp), parameter :: guard_depth = 0.8_wp*crossing_bar
   !> Heights that are larger by this than any that counts are so whatever rounding does.
   real(wp), parameter :: far = 1.001_wp

   !> Two nodes of a sharp edge, and those of one with a centre at its end.
   integer, parameter :: most_nodes = 2 + max_face_nodes
   integer, parameter :: n_part = 3*n_edge_pair_node

   !> The crossing of two edges in a step.
   type :: edge_stencil_t
      integer :: edge = 0                        !! sharp, or guarded
      integer :: master = 0                      !! that it crosses; 0: none
      real(wp) :: side = 0.0_wp                  !! 1 or -1: heights are gaps
   end type edge_stencil_t

   !> The nodes that the four ends of a stencil are made of.
   type :: edge_ends_t
      integer :: n = 0
      integer :: n_slave = 0                     !! nodes 1..n_slave are of the pair's slave
      integer :: node(most_nodes) = 0            !! (n) of the scene
      integer :: place(most_nodes) = 0           !! (n) the first end's, then the others' in `node`
      real(wp) :: weight(most_nodes, n_edge_pair_node) = 0.0_wp  !! (n - 1) of others, in ends
   end type edge_ends_t

   type, extends(contact_t) :: edge_contact_t
      logical :: is_self = .false.                    !! of a surface with itself
      integer :: first = 1                            !! surface whose edges cross sharp ones
      type(outline_edges_t) :: edges                  !! of both surfaces
      integer :: n_sharp = 0
      integer, allocatable :: slave(:)                !! the sharp ones, then those with guards
      integer, allocatable :: start(:)                !! (n slaves + 1) constraints before each
      integer, allocatable :: body(:)                 !! (n of the edges)
      integer, allocatable :: class(:)                !! (n of the edges) 1 to n_class
      !> (n of the edges) is one of a curved surface, if gaps follow arcs; else not allocated
      logical, allocatable :: is_curved(:)
      type(near_list_t) :: near
      type(position_memo_t) :: memo                   !! of the nodes as stencils were chosen:
      real(wp) :: chosen_reach = 0.0_wp               !! among edges up to there [L]
      type(edge_stencil_t), allocatable :: stencil(:)    !! (n_constraint), by slave edge and class
   contains
      procedure :: configure => edge_configure
      procedure :: follow_arcs => edge_follow_arcs
      procedure :: begin_points => edge_begin_step
      procedure :: measure_points => edge_measure
      procedure :: evaluate_points => edge_evaluate
      procedure :: slip_points => edge_slip
      procedure :: area_points => edge_area
      procedure :: lets_in => edge_lets_in
      procedure :: waits => edge_waits
   end type edge_contact_t

contains

   !> Set up the edges of the pair `pair` of `scene`; without sharp ones there are no constraints.
   subroutine edge_contact_init(self, scene, pair)
      type(edge_contact_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(interaction_t) :: surface
      integer, allocatable :: node(:, :), body(:)
      integer :: i, k

      self%is_self = pair%slave == pair%master
      call outline_edges_add(self%edges, scene, scene%surface(pair%slave))
      if (.not. self%is_self) call outline_edges_add(self%edges, scene, scene%surface(pair%master))
      associate (edges => self%edges)
         self%slave = pack([(i, i = 1, edges%n)], edges%is_sharp)
         self%n_sharp = size(self%slave)
         self%first = merge(1, 2, count(edges%surface(self%slave) == 1) >= &
            count(edges%surface(self%slave) == 2))
         self%slave = [self%slave, pack([(i, i = 1, edges%n)], .not. (edges%is_sharp .or. &
            edges%is_spoke))]
         self%start = [(n_class*min(i, self%n_sharp) + n_guard_class*max(0, i - self%n_sharp), &
            i = 0, size(self%slave))]
         self%n_constraint = self%start(size(self%slave) + 1)
         self%node = [((edges%node(1, edges%ends(1, self%slave(i))), k = self%start(i) + 1, &
            self%start(i + 1)), i = 1, size(self%slave))]
         node = outline_edges_nodes(edges)
         call bodies_find_tied(scene, node, body, k)
         self%body = body(node(1, :))
         call find_classes(edges, self%class)
      end associate
      allocate(self%duplicate(self%n_constraint), source=0)
      allocate(self%state(self%n_constraint), self%stencil(self%n_constraint))
      allocate(self%sagitta(self%n_constraint), self%thickness(self%n_constraint), source=0.0_wp)
      self%may_leave = .true.
      self%offset = pair%interaction%offset
      self%max_penetration_at_start = deepest_start
      surface = pair%interaction
      surface%damping = contact_damping_t()
      call contact_laws_of_surface(surface, self%laws)
      if (self%n_constraint == 0) return
      do i = 1, size(self%slave)
         associate (ends => node(:2, self%slave(i)))
            self%thickness(self%start(i) + 1:self%start(i + 1)) = &
               norm2(scene%x(:, ends(2)) - scene%x(:, ends(1)))
         end associate
      end do
      call near_list_init(self%near, node(:2, self%slave(:self%n_sharp)), node, scene%x, scene%u0, &
         self%offset + interaction_reach(surface))
   end subroutine edge_contact_init

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

   !> No option of a step changes what a gap is made of.
   pure subroutine edge_configure(self, x, options)
      class(edge_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (3, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options
   end subroutine edge_configure

   !> Where gaps follow curved surfaces these have no edges: nodes hold them.
   pure subroutine edge_follow_arcs(self, x, options, is_wanted)
      class(edge_contact_t), intent(inout) :: self
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
   end subroutine edge_follow_arcs

   !> Choose the edge that each one crosses in the step, for each class. From the same start and up
   !> to the same reach the choice is the same.
   pure subroutine edge_begin_step(self, x, u0, du)
      class(edge_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp) :: normals(3, 2)
      integer :: i, k, n, near(self%edges%n)

      if (self%n_constraint == 0) then
         call self%has_looked(huge(1.0_wp))
         return
      end if
      call near_list_update(self%near, x, u0, du, self%reach)
      call self%has_looked(self%near%clearance)
      if (abs(self%chosen_reach - self%reach) <= 0.0_wp) then
         if (position_memo_holds(self%memo, self%near%node, x, u0)) return
      end if
      call position_memo_take(self%memo, self%near%node, x, u0)
      self%chosen_reach = self%reach
      self%stencil%master = 0
      do i = 1, self%n_sharp
         call near_list_find(self%near, i, self%reach, near, n)
         if (n > 0) normals = outline_edges_normals(self%edges, self%slave(i), x, u0)
         do k = 1, n
            if (may_cross(self, self%slave(i), near(k))) &
               call choose(self, i, near(k), normals, x, u0)
         end do
      end do
      call choose_guards(self, x, u0)
   end subroutine edge_begin_step

   !> Let edges that are not sharp, but bend outwards by enough, cross each other in the step. Few
   !> do, and they are looked for where both surfaces are.
   pure subroutine choose_guards(self, x, u0)
      class(edge_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      real(wp) :: low(3), high(3), normals(3, 2, self%edges%n)
      integer :: master(self%edges%n), i, k, n
      logical :: bends(self%edges%n)

      call find_shared_box(self, low, high)
      n = 0
      do i = 1, self%edges%n
         bends(i) = .not. self%edges%is_sharp(i) .and. all(self%near%facet_box(:, i, 1) <= high &
            .and. self%near%facet_box(:, i, 2) >= low)
         if (.not. bends(i)) cycle
         normals(:, :, i) = outline_edges_normals(self%edges, i, x, u0)
         bends(i) = turn_of(self, i, normals(:, :, i), x, u0) > -hollow
         if (.not. bends(i)) cycle
         n = n + 1
         master(n) = i
      end do
      do i = self%n_sharp + 1, size(self%slave)
         associate (own => self%slave(i))
            if (.not. bends(own)) cycle
            do k = 1, n
               if (are_apart(self%near%facet_box(:, own, :), self%near%facet_box(:, master(k), :), &
                  self%reach)) cycle
               if (may_cross(self, own, master(k))) &
                  call choose(self, i, master(k), normals(:, :, own), x, u0)
            end do
         end associate
      end do
   end subroutine choose_guards

   !> The sine of the turn at an edge, > 0 outwards.
   pure real(wp) function turn_of(self, i, normal, x, u0) result(turn)
      class(edge_contact_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1 to n of the edges
      real(wp), intent(in) :: normal(3, 2)       !! of its faces
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      real(wp) :: within

      associate (edges => self%edges)
         call look_between(normal(:, 1), normal, outline_edges_place(edges, edges%ends(2, i), &
            edges%node(1, edges%ends(1, i)), x, u0), within, turn)
      end associate
   end function turn_of

   !> Are two boxes farther than `reach` from each other along an axis?
   pure logical function are_apart(a, b, reach)
      real(wp), intent(in) :: a(3, 2), b(3, 2)   !! low and high corners [L]
      real(wp), intent(in) :: reach              !! [L]

      are_apart = any(max(b(:, 1) - a(:, 2), a(:, 1) - b(:, 2)) > reach)
   end function are_apart

   !> What the boxes around both surfaces, larger by the reach, have in common; of one surface all.
   pure subroutine find_shared_box(self, low, high)
      class(edge_contact_t), intent(in) :: self
      real(wp), intent(out) :: low(3), high(3)   !! [L]
      real(wp) :: box(3, 2, 2)
      integer :: a, s

      do s = 1, 2
         do a = 1, 3
            associate (is_own => self%edges%surface == s .or. self%is_self)
               box(a, 1, s) = minval(self%near%facet_box(a, :, 1), is_own) - self%reach
               box(a, 2, s) = maxval(self%near%facet_box(a, :, 2), is_own) + self%reach
            end associate
         end do
      end do
      low = maxval(box(:, 1, :), 2)
      high = minval(box(:, 2, :), 2)
   end subroutine find_shared_box

   !> Let edge number `i` cross edge `m` in the step, if they may meet in it and no other one
   !> of the class comes first.
   pure subroutine choose(self, i, m, of_slave, x, u0)
      class(edge_contact_t), intent(inout) :: self
      integer, intent(in) :: i, m
      real(wp), intent(in) :: of_slave(3, 2)     !! outward normals of the faces at the edge `i`
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      real(wp), dimension(3, n_edge_pair_node) :: at
      real(wp) :: normal(3), length(2), gap, within, turn, least
      type(crossing_t) :: crossing
      type(edge_stencil_t) :: new

      new = edge_stencil_t(self%slave(i), m, 1.0_wp)
      call gather(self, new, x, u0, at)
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
      if (crossing%sine < merge(least_sine, guard_sine, i <= self%n_sharp)) return
      if (any(max(-crossing%place, crossing%place - 1.0_wp)*length > self%reach)) return
      gap = new%side*crossing%height
      if (gap - self%offset < -deepest*minval(length) .or. gap > self%reach) return
      least = least_turn
      if (gap - self%offset < -inside*minval(length) .or. (within > clear .and. &
         self%edges%bends(m))) least = -hollow
      if (i > self%n_sharp) least = -hollow
      if (is_outside(within, turn, least)) return
      call look_between(-normal, outline_edges_normals(self%edges, m, x, u0), &
         at(:, 4) - at(:, 3), within, turn)
      if (is_outside(within, turn, least)) return
      associate (old => self%stencil(self%start(i) + 1 + mod(self%class(m) - 1, &
            self%start(i + 1) - self%start(i))))
         if (old%master > 0) then
            if (.not. comes_first(self, new, crossing, old, x, u0)) return
         end if
         old = new
      end associate
   end subroutine choose

   !> May edge `i` with places ever cross edge `m`? Of two edges with places one crosses the other.
   !> What is not sharp is of other bodies.
   pure logical function may_cross(self, i, m)
      class(edge_contact_t), intent(in) :: self
      integer, intent(in) :: i, m                !! 1 to n of the edges
      integer :: j, k

      may_cross = .false.
      if (allocated(self%is_curved)) then
         if (self%is_curved(i)) return
      end if
      associate (edges => self%edges)
         may_cross = merge(self%body(i) /= self%body(m) .or. edges%is_sharp(m), &
            edges%surface(i) /= edges%surface(m), self%is_self)
         if ((edges%is_sharp(i) .eqv. edges%is_sharp(m)) .and. .not. edges%is_spoke(m)) &
            may_cross = may_cross .and. merge(m > i, edges%surface(i) == self%first, self%is_self)
         do k = 1, 2
            do j = 1, 2
               if (.not. may_cross) return
               may_cross = .not. any(edges%node(:, edges%ends(j, m)) == edges%node(1, &
                  edges%ends(k, i)))
            end do
         end do
      end associate
   end function may_cross

   !> Is a crossing more within the ends of its edges than that of `old`, or as much and at a lower
   !> gap?
   pure logical function comes_first(self, new, crossing, old, x, u0)
      class(edge_contact_t), intent(in) :: self
      type(edge_stencil_t), intent(in) :: new, old
      type(crossing_t), intent(in) :: crossing   !! of the new one
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)
      real(wp) :: at(3, n_edge_pair_node)
      type(crossing_t) :: other

      call gather(self, old, x, u0, at)
      other = edge_crossing(at)
      associate (mine => beyond_ends(crossing), its => beyond_ends(other))
         comes_first = mine < its
         if (max(mine, its) <= 0.0_wp) comes_first = new%side*crossing%height &
            < old%side*other%height
      end associate
   end function comes_first

   !> How far past the ends of edges they cross, by their lengths; within them 0 or less.
   pure real(wp) function beyond_ends(crossing) result(beyond)
      type(crossing_t), intent(in) :: crossing

      beyond = maxval(max(-crossing%place, crossing%place - 1.0_wp)) - begins_beyond
   end function beyond_ends

   !> Where the ends of the edges of a stencil are, from the first one.
   pure subroutine gather(self, stencil, x, u, at)
      class(edge_contact_t), intent(in) :: self
      type(edge_stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp), intent(out) :: at(:, :)          !! (3, 4) [L]
      integer :: k

      associate (point => points_of(self, stencil))
         do k = 1, n_edge_pair_node
            at(:, k) = outline_edges_place(self%edges, point(k), self%edges%node(1, point(1)), x, u)
         end do
      end associate
   end subroutine gather

   !> The ends of the edges of a stencil.
   pure function points_of(self, stencil) result(point)
      class(edge_contact_t), intent(in) :: self
      type(edge_stencil_t), intent(in) :: stencil
      integer :: point(n_edge_pair_node)

      point(:2) = self%edges%ends(:, stencil%edge)
      point(3:) = self%edges%ends(:, stencil%master)
   end function points_of

   !> How the ends move in the step, from the first of them on.
   pure subroutine gather_motion(self, stencil, du, way)
      class(edge_contact_t), intent(in) :: self
      type(edge_stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: du(:, :)   !! (3, n_node) [L]
      real(wp), intent(out) :: way(:, :)         !! (3, 4) [L]
      real(wp) :: motion(3)
      integer :: j, k

      way = 0.0_wp
      associate (point => points_of(self, stencil), edges => self%edges)
         do k = 2, n_edge_pair_node
            do j = 1, size(edges%node, 1)
               if (edges%node(j, point(k)) == 0) exit
               motion = du(:, edges%node(j, point(k))) - du(:, edges%node(1, point(1)))
               way(:, k) = way(:, k) + edges%weight(j, point(k))*motion
            end do
         end do
      end associate
   end subroutine gather_motion

   !> The nodes that the ends of a stencil are made of. Those of the surface that the pair names as
   !> its slave come first.
   pure function ends_of(self, stencil) result(ends)
      class(edge_contact_t), intent(in) :: self
      type(edge_stencil_t), intent(in) :: stencil
      type(edge_ends_t) :: ends
      integer :: i, j, k, point(n_edge_pair_node), order(n_edge_pair_node)

      point = points_of(self, stencil)
      order = cshift([1, 2, 3, 4], merge(2, 0, self%edges%surface(stencil%edge) == 2))
      do k = 1, n_edge_pair_node
         call nodes_append(self%edges%node(:, point(order(k))), ends%node, ends%n)
         if (k == 2) ends%n_slave = ends%n
      end do
      associate (base => findloc(ends%node(:ends%n), self%edges%node(1, point(1)), 1))
         ends%place(:ends%n) = [base, (i, i = 1, base - 1), (i, i = base + 1, ends%n)]
      end associate
      do k = 1, n_edge_pair_node
         do i = 2, ends%n
            j = findloc(self%edges%node(:, point(k)), ends%node(ends%place(i)), 1)
            if (j > 0) ends%weight(i - 1, k) = self%edges%weight(j, point(k))
         end do
      end do
   end function ends_of

   pure subroutine edge_measure(self, x, u0, du)
      class(edge_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      integer :: k

      do k = 1, self%n_constraint
         self%state(k) = gap_state_t()
         if (self%stencil(k)%master > 0) call measure_crossing(self, k, x, u0, du)
      end do
   end subroutine edge_measure

   !> The gap of crossing `k` at both ends of the step, and whether edges cross within their ends.
   pure subroutine measure_crossing(self, k, x, u0, du)
      type(edge_contact_t), intent(inout) :: self
      integer, intent(in) :: k
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp), dimension(3, n_edge_pair_node) :: at, way
      type(crossing_t) :: from, to

      associate (state => self%state(k), stencil => self%stencil(k))
         call gather(self, stencil, x, u0, at)
         from = edge_crossing(at)
         state%size = length_of(at(:, 1), at(:, 2))
         state%other_size = length_of(at(:, 3), at(:, 4))
         call gather_motion(self, stencil, du, way)
         to = edge_crossing(at + way)
         state%is_near = .true.
         state%is_over = is_within(to, begins_beyond)
         if (self%edges%is_bare(stencil%master)) state%is_over = state%is_over .or. is_at_end(to)
         ! Past parallel ones the normal points the other way, and tells nothing.
         state%is_over = state%is_over .and. &
            dot_product(normal_of(at), normal_of(at + way)) > 0.0_wp
         state%is_leaving = .not. is_within(to, ends_beyond)
         state%is_arriving = .not. is_within(from, ends_beyond)
         state%gap0 = stencil%side*from%height - self%offset
         state%gap1 = stencil%side*to%height - self%offset
         if (.not. self%edges%is_sharp(stencil%edge)) state%closed = -guard_depth &
            *minval(self%edges%breadth([stencil%edge, stencil%master]))
         state%was_open = state%gap0 >= -max_penetration_on_entry*state%size
         state%is_covered = sqrt(maxval(sum(way**2, 1))) <= self%chosen_reach .and. &
            to%sine >= 0.5_wp*least_sine
      end associate
   end subroutine measure_crossing

   !> Normal to both edges, of any length.
   pure function normal_of(at) result(normal)
      real(wp), intent(in) :: at(3, n_edge_pair_node)        !! [L]
      real(wp) :: normal(3)

      normal = cross_product(at(:, 2) - at(:, 1), at(:, 4) - at(:, 3))
   end function normal_of

   !> Do edges cross within their ends, and `beyond` of their lengths past them?
   pure logical function is_within(crossing, beyond)
      type(crossing_t), intent(in) :: crossing
      real(wp), intent(in) :: beyond

      is_within = crossing%sine > 0.0_wp .and. all(crossing%place > -beyond .and. &
         crossing%place < 1.0_wp + beyond)
   end function is_within

   !> Does an edge cross the other one at its last end, or hardly beside it?
   pure logical function is_at_end(crossing)
      type(crossing_t), intent(in) :: crossing

      associate (place => crossing%place)
         is_at_end = crossing%sine > 0.0_wp .and. abs(place(2) - 1.0_wp) <= -begins_beyond .and. &
            place(1) > -begins_beyond .and. place(1) < 1.0_wp + begins_beyond
      end associate
   end function is_at_end

   pure subroutine edge_evaluate(self, wanted, x, u0, du, target, item)
      class(edge_contact_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)           !! (n) numbers of constraints, ascending
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: target(:)          !! (n) [L]
      type(condition_t), intent(inout) :: item(:)   !! (n)
      integer :: k

      do k = 1, size(wanted)
         call evaluate_crossing(self, self%stencil(wanted(k)), x, u0, du, target(k) + self%offset, &
            item(k))
      end do
   end subroutine edge_evaluate

   !> The condition of a crossing.
   pure subroutine evaluate_crossing(self, stencil, x, u0, du, hold, item)
      type(edge_contact_t), intent(in) :: self
      type(edge_stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp), intent(in) :: hold               !! gap [L]
      type(condition_t), intent(inout) :: item
      real(wp), dimension(3, n_edge_pair_node) :: at, way
      type(edge_pair_gap_t) :: gap
      type(edge_ends_t) :: ends

      call gather(self, stencil, x, u0, at)
      call gather_motion(self, stencil, du, way)
      call edge_pair_gap(at, way, stencil%side, item%leaves_second, gap)
      ends = ends_of(self, stencil)
      call condition_resize(item, ends%n, size(x, 1))
      item%node(:ends%n) = ends%node(:ends%n)
      item%n_slave = ends%n_slave
      item%size = length_of(at(:, 1), at(:, 2))
      item%gap0 = gap%gap(0) - hold
      item%gap1 = gap%gap(1) - hold
      item%dgap = gap%dgap
      associate (n => ends%n)
         associate (weight => ends%weight(:n - 1, :), place => ends%place(:n))
            item%g(:, :n) = 0.0_wp
            item%c(:, :n) = 0.0_wp
            call node_sums_first(reshape(gap%g, [n_part]), weight, 1.0_wp, place, item%g(:, :n))
            call node_sums_first(reshape(gap%c, [n_part]), weight, 1.0_wp, place, item%c(:, :n))
            if (.not. item%leaves_second) then
               item%h(:3*n, :3*n) = 0.0_wp
               call node_sums_second(gap%h, weight, 1.0_wp, place, item%h(:3*n, :3*n))
            end if
         end associate
      end associate
      if (item%has_friction) call add_slip(at, way, ends, item)
   end subroutine evaluate_crossing

   !> Slip of a crossing with its derivatives.
   pure subroutine add_slip(at, way, ends, item)
      real(wp), intent(in) :: at(:, :), way(:, :)   !! (3, 4) of the ends [L]
      type(edge_ends_t), intent(in) :: ends
      type(condition_t), intent(inout) :: item   !! with its nodes
      type(edge_pair_slip_t) :: slip
      integer :: s

      call edge_pair_slip(at, way, item%leaves_second, slip)
      call condition_resize_slip(item)
      item%slip(:size(slip%f)) = slip%f
      associate (n => ends%n)
         associate (weight => ends%weight(:n - 1, :), place => ends%place(:n))
            do s = 1, size(slip%f)
               item%t(:, :n, s) = 0.0_wp
               item%t1(:, :n, s) = 0.0_wp
               call node_sums_first(reshape(slip%g(:, :, s), [n_part]), weight, 1.0_wp, place, &
                  item%t(:, :n, s))
               call node_sums_first(reshape(slip%c(:, :, s), [n_part]), weight, 1.0_wp, place, &
                  item%t1(:, :n, s))
               if (item%leaves_second) cycle
               item%ht(:3*n, :3*n, s) = 0.0_wp
               call node_sums_second(slip%h(:, :, s), weight, 1.0_wp, place, &
                  item%ht(:3*n, :3*n, s))
            end do
         end associate
      end associate
   end subroutine add_slip

   !> As `contact_t` has it.
   pure function edge_slip(self, i, x, u0, du) result(slip)
      class(edge_contact_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp) :: slip(size(x, 1) - 1)           !! [L]
      real(wp), dimension(3, n_edge_pair_node) :: at, way
      type(edge_pair_slip_t) :: over

      slip = 0.0_wp
      if (self%stencil(i)%master == 0) return
      call gather(self, self%stencil(i), x, u0, at)
      call gather_motion(self, self%stencil(i), du, way)
      call edge_pair_slip(at, way, .true., over)
      slip = over%f
   end function edge_slip

   !> Edges touch in points: laws by pressure get a quarter of the square of the edge.
   pure subroutine edge_area(self, x, u, area, length)
      class(edge_contact_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp), intent(out) :: area(:)           !! (n_constraint) [L^2]
      real(wp), intent(out) :: length(:)         !! (n_constraint) [L]

      area = 0.25_wp*self%thickness**2
      length = self%thickness
   end subroutine edge_area

   !> As the nodes that they are held beside.
   pure real(wp) function edge_lets_in(self) result(lets_in)
      class(edge_contact_t), intent(in) :: self

      lets_in = crossing_bar
   end function edge_lets_in

   !> Those of edges that are not sharp, the last ones.
   pure logical function edge_waits(self, i) result(waits)
      class(edge_contact_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint

      waits = i > self%start(self%n_sharp + 1)
   end function edge_waits

end module emcon_edge_contact_space
