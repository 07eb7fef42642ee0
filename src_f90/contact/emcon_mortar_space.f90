!> Mortar contact in space: gaps between slave facets and what of the master they face, integrated
!> with one weight for each vertex of the slave facets.
!>
!> Each triangle of the slave facets has a stencil of its own, that of a patch as large as it is.
!> Source: docs/theory.md, section 15.2.
module emcon_mortar_space
   use emcon_condition_nodes, only : nodes_append
   use emcon_condition_product, only : condition_add_cubed, condition_start
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t, gap_state_t, max_penetration_on_entry
   use emcon_contact_law_registry, only : contact_laws_of_surface
   use emcon_errors, only : error_t
   use emcon_facet_frames_space, only : facet_frames_init, facet_weights_init, facet_weights_t
   use emcon_facet_groups, only : facet_groups_init, facet_groups_t, group_angle
   use emcon_facet_split, only : facet_split_init, facet_split_t
   use emcon_facets, only : facets_init, facets_length
   use emcon_interactions, only : contact_options_t, contact_pair_t, interaction_reach, &
      multiplier_dual
   use emcon_kinds, only : wp
   use emcon_near_list, only : near_list_init, near_list_t, near_list_update, near_list_within
   use emcon_patch_gap_space, only : patch_gap_of, patch_gap_t, patch_open, &
      patch_open_cover, patch_open_t
   use emcon_patch_look_space, only : patch_basis, patch_basis_t, patch_t
   use emcon_patch_moments_space, only : patch_area_t
   use emcon_patch_sides_space, only : patch_sides_t, patch_triangles_init
   use emcon_patch_spread_space, only : patch_spread, patch_uses
   use emcon_patch_stencil_space, only : patch_stencil_choose, patch_stencil_gather, &
      patch_stencil_t
   use emcon_position_memo, only : position_memo_holds, position_memo_t, position_memo_take
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: mortar_space_t, mortar_space_init

   !> A node is let go where less than this part of its surface is covered.
   real(wp), parameter :: least_cover = 0.02_wp
   !> So far, per facet, a mean gap may be closed where contact begins.
   real(wp), parameter :: max_penetration_mean = 0.2_wp

   !> Covered but for round-off: the dual multipliers are as they are.
   real(wp), parameter :: whole_cover = 256.0_wp*epsilon(1.0_wp)

   !> What a triangle sees in a step, for all that is asked of it.
   type :: sight_t
      type(patch_open_t) :: open
      type(patch_gap_t) :: cover                      !! what of it is covered, of an area of 1/2
      logical :: is_full = .false.                   !! its facet is covered, but for round-off
      logical :: is_blended = .false.                 !! between the linear multipliers and the dual
   end type sight_t

   type, extends(contact_t) :: mortar_space_t
      type(patch_sides_t) :: sides
      type(facet_split_t) :: split                    !! of the slave
      type(facet_weights_t) :: weights
      type(near_list_t) :: near
      real(wp) :: beyond = 0.0_wp                     !! of its reach what is beside stencils [L]
      type(position_memo_t) :: memo                   !! of the nodes as stencils were chosen:
      real(wp) :: chosen_reach = 0.0_wp               !! among facets up to there [L]
      logical :: is_dual = .true.                     !! multiplier basis
      integer, allocatable :: start(:)                !! (n_constraint + 1) triangles of each:
      integer, allocatable :: triangle(:)             !! start(i) to start(i + 1) - 1
      integer, allocatable :: vertex(:)               !! the same: which vertex of its facet it is
      type(patch_stencil_t), allocatable :: stencil(:)   !! (n_triangle)
      type(patch_basis_t), allocatable :: basis(:)    !! (n_triangle) as last measured
      !> (0:1, n_facet) how dual the multipliers of slave facets are at start and end
      real(wp), allocatable :: theta(:, :)
      real(wp), allocatable :: whole(:)               !! (n_constraint) reference area [L^2]
      real(wp), allocatable :: scale(:)               !! (n_constraint) covered at the start [L^2]
      real(wp), allocatable :: cover(:)               !! (n_constraint) covered at the end [L^2]
   contains
      procedure :: configure => mortar_configure
      procedure :: begin_points => mortar_begin_step
      procedure :: measure_points => mortar_measure
      procedure :: evaluate_points => mortar_evaluate
      procedure :: area_points => mortar_area
      procedure :: own_area => mortar_own_area
      procedure :: share => mortar_share
      procedure :: mean_gap => mortar_mean_gap
   end type mortar_space_t

contains

   !> Set up the pair `pair` of `scene`.
   subroutine mortar_space_init(self, scene, pair, error)
      type(mortar_space_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error
      integer :: f

      associate (sides => self%sides)
         call facets_init(sides%slave, scene, scene%surface(pair%slave), error)
         if (allocated(error)) return
         allocate(sides%master)
         call facets_init(sides%master, scene, scene%surface(pair%master), error)
         if (allocated(error)) return
         call facet_split_init(self%split, sides%slave)
         call facet_frames_init(sides%frames, sides%slave, self%split)
         call facet_weights_init(self%weights, sides%slave, self%split, scene%x)
         call patch_triangles_init(sides%triangles, sides%master, scene%x)
         allocate(sides%mirror(sides%master%n_facet), source=0)
         ! Lists end beside what a triangle sees: all that meets with that is listed.
         self%beyond = maxval([0.0_wp, (facets_length(sides%master, f), &
            f = 1, sides%master%n_facet)])
         call near_list_init(self%near, sides%slave%facet, sides%master%facet, scene%x, scene%u0, &
            self%beyond + pair%interaction%offset + interaction_reach(pair%interaction))
      end associate
      call list_vertices(self, scene%x)
      call make_room(self)
      self%may_leave = .true.
      self%offset = pair%interaction%offset
      self%max_penetration_at_start = max_penetration_mean
      call contact_laws_of_surface(pair%interaction, self%laws)
   end subroutine mortar_space_init

   !> The constraints: one for each smooth group of slave facets at a vertex.
   pure subroutine list_vertices(self, x)
      type(mortar_space_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :)            !! (3, n_node) reference positions [L]
      type(facet_groups_t) :: groups
      integer :: f, g, i, k, m, t

      associate (slave => self%sides%slave)
         call facet_groups_init(groups, slave, x, group_angle)
         allocate(self%node(0), self%triangle(0), self%vertex(0))
         self%start = [1]
         do i = 1, size(slave%node)
            do g = groups%node_start(i), groups%node_start(i + 1) - 1
               do k = groups%start(g), groups%start(g + 1) - 1
                  f = groups%facet(k)
                  m = findloc(self%weights%node(:self%weights%n(f), f), i, 1)
                  if (m == 0) exit               ! between vertices
                  associate (part => [(t, t = self%split%start(f), self%split%start(f + 1) - 1)])
                     self%triangle = [self%triangle, part]
                     self%vertex = [self%vertex, spread(m, 1, size(part))]
                  end associate
               end do
               if (size(self%triangle) < self%start(size(self%start))) cycle
               self%node = [self%node, slave%node(i)]
               self%start = [self%start, size(self%triangle) + 1]
            end do
         end do
      end associate
      self%n_constraint = size(self%node)
   end subroutine list_vertices

   !> Room for what a step knows, and sizes in the reference.
   pure subroutine make_room(self)
      type(mortar_space_t), intent(inout) :: self
      integer :: i, k

      associate (n => self%n_constraint, n_triangle => size(self%split%facet))
         allocate(self%stencil(n_triangle), self%basis(n_triangle), self%state(n))
         allocate(self%duplicate(n), source=0)
         allocate(self%theta(0:1, self%sides%slave%n_facet), self%whole(n), self%cover(n), &
            self%sagitta(n), source=0.0_wp)
      end associate
      associate (frames => self%sides%frames)
         do i = 1, self%n_constraint
            do k = self%start(i), self%start(i + 1) - 1
               associate (t => self%triangle(k))
                  self%whole(i) = self%whole(i) + frames%area(t) &
                     *sum(self%weights%linear(:, self%vertex(k), t))/3.0_wp
                  self%state(i)%size = self%state(i)%size + frames%size(t) &
                     /real(self%start(i + 1) - self%start(i), wp)
               end associate
            end do
         end do
      end associate
      self%scale = self%whole
      self%thickness = sqrt(self%whole)
   end subroutine make_room

   pure subroutine mortar_configure(self, x, options)
      class(mortar_space_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (3, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options

      self%is_dual = options%multiplier == multiplier_dual
   end subroutine mortar_configure

   !> Choose for each triangle what it may see in the step, and the multipliers.
   pure subroutine mortar_begin_step(self, x, u0, du)
      class(mortar_space_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      integer :: f

      call near_list_update(self%near, x, u0, du, self%reach)
      call self%has_looked(self%near%clearance)
      if (abs(self%chosen_reach - self%reach) <= 0.0_wp) then
         if (position_memo_holds(self%memo, self%near%node, x, u0)) return
      end if
      call position_memo_take(self%memo, self%near%node, x, u0)
      self%chosen_reach = self%reach
      do f = 1, self%sides%slave%n_facet
         call choose_stencils(self, f, x, u0)
      end do
   end subroutine mortar_begin_step

   !> The stencils of the triangles of slave facet `f`; none of them where nothing comes near.
   pure subroutine choose_stencils(self, f, x, u0)
      type(mortar_space_t), intent(inout) :: self
      integer, intent(in) :: f
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      integer :: k, t

      self%stencil(self%split%start(f):self%split%start(f + 1) - 1)%triangle = 0
      associate (list => self%near%candidates)
         associate (of => list%facet(list%start(f):list%start(f + 1) - 1))
            associate (is_near => [(near_list_within(self%near, f, of(k), x, u0, self%reach), &
                  k = 1, size(of))], is_beside => [(.not. near_list_within(self%near, f, of(k), &
                  x, u0, self%reach - self%beyond), k = 1, size(of))])
               if (all(is_beside)) return
               do t = self%split%start(f), self%split%start(f + 1) - 1
                  call patch_stencil_choose(self%stencil(t), self%sides, t, pack(of, is_near), x, &
                     u0, pack(is_beside, is_near))
               end do
            end associate
         end associate
      end associate
   end subroutine choose_stencils

   !> What triangle `t` sees.
   pure subroutine look(self, t, x, u0, du, basis)
      class(mortar_space_t), intent(in) :: self
      integer, intent(in) :: t
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      type(patch_basis_t), intent(out) :: basis
      real(wp), dimension(3, 3 + self%stencil(t)%patch%n_vertex) :: at, way

      if (self%stencil(t)%triangle == 0) return
      call patch_stencil_gather(self%stencil(t), x, u0, du, at, way)
      basis = patch_basis(self%stencil(t)%patch, at, way)
   end subroutine look

   !> Mean gaps at both ends of the step; 0 where nothing is covered.
   pure subroutine mortar_measure(self, x, u0, du)
      class(mortar_space_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      integer :: f, i, t

      do t = 1, size(self%stencil)
         call look(self, t, x, u0, du, self%basis(t))
      end do
      do f = 1, self%sides%slave%n_facet
         self%theta(:, f) = 0.0_wp
         if (self%is_dual) self%theta(:, f) = covered(self%basis(self%split%start(f): &
            self%split%start(f + 1) - 1))**3
      end do
      do i = 1, self%n_constraint
         call measure_vertex(self, i)
      end do
   end subroutine mortar_measure

   !> What of a slave facet is covered at both ends of the step, each of its triangles a part of it
   !> as large as the others: 0 to 1.
   pure function covered(basis) result(part)
      type(patch_basis_t), intent(in) :: basis(:)     !! of its triangles
      real(wp) :: part(0:1)
      integer :: k

      part = 0.0_wp
      do k = 1, size(basis)
         if (all(basis(k)%area > 0.0_wp)) part = part + sum(basis(k)%cover, 1)/basis(k)%area
      end do
      part = part/real(size(basis), wp)
   end function covered

   !> The gap of constraint `i`, from what its triangles see.
   pure subroutine measure_vertex(self, i)
      type(mortar_space_t), intent(inout) :: self
      integer, intent(in) :: i
      real(wp) :: gap(0:1), area(0:1), least, ahead, size_of, way, deepest, weight(3)
      integer :: end, k

      gap = 0.0_wp
      area = 0.0_wp
      ahead = huge(ahead)
      size_of = huge(size_of)
      deepest = 0.0_wp
      way = 0.0_wp
      do k = self%start(i), self%start(i + 1) - 1
         associate (basis => self%basis(self%triangle(k)), stencil => self%stencil( &
               self%triangle(k)))
            if (stencil%triangle == 0) cycle
            do end = 0, 1
               weight = weight_of(self, k, self%theta(end, self%split%facet(self%triangle(k))))
               gap(end) = gap(end) + dot_product(weight, basis%height(:, end))
               area(end) = area(end) + dot_product(weight, basis%cover(:, end))
            end do
            ahead = min(ahead, basis%ahead)
            way = max(way, basis%way)
            size_of = min(size_of, stencil%size)
            deepest = max(deepest, stencil%deepest)
         end associate
      end do
      associate (state => self%state(i))
         ! What stores energy is followed as long as there is any to give back.
         least = least_cover*self%whole(i)
         self%scale(i) = max(area(0), least)
         if (self%step%is_penalty) least = tiny(least)
         self%cover(i) = max(area(1), 0.0_wp)
         state = gap_state_t(size=state%size, other_size=size_of)
         state%is_near = maxval(area) > 0.0_wp
         state%is_covered = way <= self%chosen_reach - self%beyond
         state%is_over = area(1) >= least .or. (self%step%is_penalty .and. area(0) >= least)
         state%is_leaving = .not. state%is_over
         state%is_arriving = area(0) < least
         if (area(0) > 0.0_wp) state%gap0 = gap(0)/area(0) - self%offset
         if (area(1) >= least) state%gap1 = gap(1)/area(1) - self%offset
         if (state%is_arriving) state%was_open = &
            ahead - self%offset >= -max_penetration_on_entry*state%size
         if (state%gap0 < -deepest - self%offset) state = gap_state_t(size=state%size)
      end associate
   end subroutine measure_vertex

   !> The multiplier of place `k` of `triangle` at the corners of that: the dual one if theta is 1,
   !> the linear one if it is 0.
   pure function weight_of(self, k, theta) result(weight)
      class(mortar_space_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: theta
      real(wp) :: weight(3)

      associate (t => self%triangle(k), m => self%vertex(k))
         weight = self%weights%linear(:, m, t) + theta*self%weights%skew(:, m, t)
      end associate
   end function weight_of

   pure subroutine mortar_evaluate(self, wanted, x, u0, du, target, item)
      class(mortar_space_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)           !! (n) numbers of constraints, ascending
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: target(:)          !! (n) [L]
      type(condition_t), intent(inout) :: item(:)   !! (n)
      type(sight_t) :: sight(size(self%stencil))
      logical :: is_asked(self%sides%slave%n_facet)
      integer :: f, k

      is_asked = .false.
      do k = 1, size(wanted)
         is_asked(self%split%facet(self%triangle(self%start(wanted(k)): &
            self%start(wanted(k) + 1) - 1))) = .true.
      end do
      do f = 1, size(is_asked)
         if (.not. is_asked(f)) cycle
         associate (first => self%split%start(f), last => self%split%start(f + 1) - 1)
            call look_closely(self, first, x, u0, du, all(item%leaves_second), sight(first:last))
         end associate
      end do
      do k = 1, size(wanted)
         call evaluate_vertex(self, wanted(k), sight, target(k) + self%offset, item(k))
      end do
   end subroutine mortar_evaluate

   !> What the triangles of a facet see, from `first` on.
   pure subroutine look_closely(self, first, x, u0, du, leaves_second, sight)
      type(mortar_space_t), intent(in) :: self
      integer, intent(in) :: first
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      logical, intent(in) :: leaves_second
      type(sight_t), intent(inout) :: sight(:)   !! (triangles of the facet)
      real(wp), allocatable :: at(:, :), way(:, :)
      real(wp) :: part(0:1)
      integer :: k

      part = 0.0_wp
      do k = 1, size(sight)
         associate (stencil => self%stencil(first + k - 1))
            if (stencil%triangle == 0) cycle
            if (allocated(at)) deallocate(at, way)
            allocate(at(3, 3 + stencil%patch%n_vertex), way(3, 3 + stencil%patch%n_vertex))
            call patch_stencil_gather(stencil, x, u0, du, at, way)
            call patch_open(stencil%patch, at, way, leaves_second, sight(k)%open)
            part = part + 2.0_wp*patch_open_cover(sight(k)%open)/real(size(sight), wp)
         end associate
      end do
      if (.not. self%is_dual) return
      sight%is_full = all(abs(part - 1.0_wp) <= whole_cover)
      sight%is_blended = any(part > 0.0_wp) .and. .not. sight%is_full
      do k = 1, size(sight)
         if (sight(k)%open%n_vertex == 0 .or. .not. sight(k)%is_blended) cycle
         associate (patch => self%stencil(first + k - 1)%patch)
            call gap_of(patch, sight(k)%open, [1.0_wp, 1.0_wp, 1.0_wp], .true., 0.0_wp, &
               leaves_second, sight(k)%cover)
         end associate
      end do
   end subroutine look_closely

   !> The gap of a triangle with a weight, or what of it is covered.
   pure subroutine gap_of(patch, open, weight, of_cover, target, leaves_second, gap)
      type(patch_t), intent(in) :: patch
      type(patch_open_t), intent(in) :: open
      real(wp), intent(in) :: weight(3)
      logical, intent(in) :: of_cover
      real(wp), intent(in) :: target             !! [L]
      logical, intent(in) :: leaves_second
      type(patch_gap_t), intent(out) :: gap
      type(patch_area_t) :: area

      area = patch%area
      area%weight = weight
      call patch_gap_of(open, area, of_cover, .not. of_cover, target, leaves_second, gap)
   end subroutine gap_of

   !> The condition of constraint `i`: the sum over its facets, docs/theory.md, eq. (62).
   pure subroutine evaluate_vertex(self, i, sight, target, item)
      type(mortar_space_t), intent(in) :: self
      integer, intent(in) :: i
      type(sight_t), intent(in) :: sight(:)      !! (n_triangle)
      real(wp), intent(in) :: target             !! height to hold [L]
      type(condition_t), intent(inout) :: item
      type(condition_t) :: cover, skew
      type(patch_gap_t) :: gap
      integer :: f, k, n

      call begin_condition(self, i, sight, item)
      cover%leaves_second = item%leaves_second
      skew%leaves_second = item%leaves_second
      do k = self%start(i), self%start(i + 1) - 1
         associate (t => self%triangle(k), scale => self%scale(i))
            f = self%split%facet(t)
            n = self%split%start(f + 1) - self%split%start(f)
            if (sight(t)%is_blended .and. t == self%split%start(f)) then
               call condition_start(skew, item%node(:item%n_node), size(item%g, 1))
               call condition_start(cover, item%node(:item%n_node), size(item%g, 1))
            end if
            if (sight(t)%open%n_vertex > 0) then
               associate (open => sight(t)%open, patch => self%stencil(t)%patch)
                  call gap_of(patch, open, weight_of(self, k, merge(1.0_wp, 0.0_wp, &
                     sight(t)%is_full)), .false., target, item%leaves_second, gap)
                  call add_gap(self%stencil(t), gap, scale, item)
                  if (sight(t)%is_blended) then
                     call gap_of(patch, open, self%weights%skew(:, self%vertex(k), t), .false., &
                        target, item%leaves_second, gap)
                     call add_gap(self%stencil(t), gap, scale, skew)
                     call add_gap(self%stencil(t), sight(t)%cover, 0.5_wp*real(n, wp), cover)
                  end if
               end associate
            end if
            if (sight(t)%is_blended .and. t == self%split%start(f) + n - 1) &
               call condition_add_cubed(item, cover, skew)
         end associate
      end do
   end subroutine evaluate_vertex

   !> Add a gap of a triangle by `scale` to a condition that has its nodes.
   pure subroutine add_gap(stencil, gap, scale, item)
      type(patch_stencil_t), intent(in) :: stencil
      type(patch_gap_t), intent(in) :: gap
      real(wp), intent(in) :: scale
      type(condition_t), intent(inout) :: item
      integer :: j

      associate (is_used => patch_uses(stencil, gap%vertex))
         associate (node => pack(stencil%node(:stencil%n_node), is_used))
            call patch_spread(stencil, gap, is_used, scale, [(findloc( &
               item%node(:item%n_node), node(j), 1), j = 1, size(node))], item)
         end associate
      end associate
   end subroutine add_gap

   !> The nodes of the condition of constraint `i`, its own first, then others of the slave, and no
   !> derivatives yet.
   pure subroutine begin_condition(self, i, sight, item)
      type(mortar_space_t), intent(in) :: self
      integer, intent(in) :: i
      type(sight_t), intent(in) :: sight(:)      !! (n_triangle)
      type(condition_t), intent(inout) :: item
      integer, allocatable :: list(:)
      integer :: k, m, n, pass

      associate (triangle => self%triangle(self%start(i):self%start(i + 1) - 1))
         allocate(list(1 + sum(self%stencil(triangle)%n_node)))
         list(1) = self%node(i)
         n = 1
         do pass = 1, 2
            do k = 1, size(triangle)
               associate (stencil => self%stencil(triangle(k)), open => sight(triangle(k))%open)
                  if (open%n_vertex == 0) cycle
                  associate (is_slave => [(m <= stencil%n_slave, m = 1, stencil%n_node)], &
                        is_used => patch_uses(stencil, open%vertex(:open%n_vertex)))
                     call nodes_append(pack(stencil%node(:stencil%n_node), is_used .and. &
                        (is_slave .eqv. pass == 1)), list, n)
                  end associate
               end associate
            end do
            if (pass == 1) item%n_slave = n
         end do
      end associate
      call condition_start(item, list(:n), self%sides%slave%n_dim)
      item%size = self%state(i)%size
      item%is_mean = .true.
   end subroutine begin_condition

   !> The multipliers are forces by the scale of their constraints.
   pure subroutine mortar_area(self, x, u, area, length)
      class(mortar_space_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp), intent(out) :: area(:)           !! (n_constraint) [L^2]
      real(wp), intent(out) :: length(:)         !! (n_constraint) by the thickness [L]

      area = self%scale
      length = self%cover/self%thickness
   end subroutine mortar_area

   pure subroutine mortar_own_area(self, x, area)
      class(mortar_space_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :)    !! (3, n_node) [L]
      real(wp), intent(out) :: area(:)           !! (n_constraint) [L^2]

      area = self%whole
   end subroutine mortar_own_area

   !> Integrals of gaps are functions of the positions alone; their means know what was covered.
   pure real(wp) function mortar_share(self, i) result(share)
      class(mortar_space_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint

      share = self%scale(i)/self%whole(i)
   end function mortar_share

   pure real(wp) function mortar_mean_gap(self, i, gap) result(mean_gap)
      class(mortar_space_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in) :: gap                !! integral by what was covered at the start [L]

      mean_gap = 0.0_wp
      if (self%cover(i) > 0.0_wp) mean_gap = gap*self%scale(i)/self%cover(i)
   end function mortar_mean_gap

end module emcon_mortar_space
