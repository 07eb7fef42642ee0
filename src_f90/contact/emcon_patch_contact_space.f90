! build: elements
!> Contact of nodes in space: one constraint per frame of a slave node, the gap of a small patch
!> around it. A node of a smooth surface has one frame, one of a corner has several.
!>
!> The patch moves with the slave's surface, and its gap is the mean over what it covers of the
!> master: smooth while the node slides over sides and corners. Source: docs/theory.md, section 14.
module emcon_patch_contact_space
   use emcon_bulges_space, only : bulges_doubt, bulges_find, bulges_largest, bulges_t
   use emcon_condition_nodes, only : condition_fold, condition_resize
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t, gap_state_t, max_penetration_on_entry, slip_place
   use emcon_contact_law_registry, only : contact_laws_of_surface
   use emcon_errors, only : err_input, error_t, raise
   use emcon_facet_split, only : facet_split_init, facet_split_t
   use emcon_facet_values, only : facets_point_area, facets_pressures
   use emcon_facets, only : facets_init
   use emcon_guards, only : corner_slack, crossing_bar, overlap_bar
   use emcon_interactions, only : contact_options_t, contact_pair_t, formulation_mortar, &
      interaction_reach, pair_has_order
   use emcon_kinds, only : wp
   use emcon_mirror_faces_space, only : always_rests, mirror_axes
   use emcon_near_list, only : near_list_init, near_list_t, near_list_update, near_list_within
   use emcon_patch_gap_space, only : patch_gap, patch_gap_t
   use emcon_patch_look_space, only : patch_look, patch_look_t
   use emcon_patch_meeting_space, only : least_cover, patch_meets
   use emcon_patch_near_space, only : patch_scope_t
   use emcon_patch_places_space, only : patch_stencil_begin, patch_stencil_gather, &
      patch_stencil_height, patch_stencil_place
   use emcon_patch_sides_space, only : frame_normal, point_frames_init, patch_sides_t, &
      patch_triangles_init
   use emcon_patch_slip_space, only : patch_slip_add, patch_slip_begin, patch_slip_of
   use emcon_patch_spread_space, only : patch_spread, patch_spread_list, patch_spread_t, &
      patch_uses
   use emcon_patch_stencil_space, only : patch_stencil_choose, patch_stencil_t
   use emcon_position_memo, only : position_memo_holds, position_memo_t, position_memo_take
   use emcon_scene, only : scene_t, where_text
   use emcon_slave_faces_space, only : slave_faces_init
   use emcon_touch_rule_space, only : touch_rule_space_init, touch_rule_space_may, &
      touch_rule_space_measure, touch_rule_space_sees
   implicit none
   private
   public :: patch_contact_t, patch_contact_init

   !> Less is round-off.
   real(wp), parameter :: no_cover = 1.0e3_wp*epsilon(1.0_wp)
   !> So far, per facet, a gap may be closed as a step begins in which it begins to act: corners are
   !> rounded by less, and bodies are thicker.
   real(wp), parameter :: deepest_start = 0.1_wp

   type, extends(contact_t) :: patch_contact_t
      type(patch_sides_t) :: sides
      logical :: holds_all = .false.                  !! all nodes, with one that is its reverse
      type(near_list_t) :: near
      type(position_memo_t) :: memo                   !! of the nodes as stencils were chosen:
      real(wp) :: chosen_reach = 0.0_wp               !! among facets up to there [L]
      integer :: n_sifted = 0                         !! the list that `sift` has gone through
      integer, allocatable :: frame(:)                !! (n_constraint)
      integer, allocatable :: class(:)                !! (n_constraint) of bodies it looks at
      type(patch_stencil_t), allocatable :: stencil(:)   !! (n_constraint)
      type(bulges_t), allocatable :: bulges           !! of the master; only if gaps follow arcs
      real(wp), allocatable :: own_rise(:)            !! then of the slave (n_point) [L]
      real(wp), allocatable :: own_slack(:)           !! (n_constraint) of a guard beside mortar
      real(wp), allocatable :: scale(:)               !! (n_constraint) covered at the start
      real(wp), allocatable :: cover(:)               !! (n_constraint) covered at the end
   contains
      procedure :: configure => patch_configure
      procedure :: follow_arcs => patch_follow_arcs
      procedure :: curve_doubt => patch_curve_doubt
      procedure :: begin_points => patch_begin_step
      procedure :: measure_points => patch_measure
      procedure :: evaluate_points => patch_evaluate
      procedure :: slip_points => patch_slip
      procedure :: area_points => patch_area
      procedure :: pressures => patch_pressures
      procedure :: share => patch_share
      procedure :: mean_gap => patch_mean_gap
      procedure :: could_hold => patch_could_hold
      procedure :: lets_in => patch_lets_in
   end type patch_contact_t

contains

   !> Set up the pair `pair` of `scene`.
   subroutine patch_contact_init(self, scene, pair, error)
      type(patch_contact_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error
      integer :: i
      logical, allocatable :: is_meant(:)

      associate (sides => self%sides)
         call slave_faces_init(sides%slave, scene, scene%surface(pair%slave), is_meant, error)
         if (allocated(error)) return
         sides%node_rests = always_rests(scene)
         call point_frames_init(sides%frames, sides%slave, scene%x, is_meant, &
            mirror_axes(sides%slave, scene) > 0, sides%node_rests)
         if (sides%frames%n == 0) then
            call raise(error, err_input, where_text(scene, scene%surface(pair%slave)%origin) &
               // ": surface " // scene%surface(pair%slave)%name // " has no face with a " // &
               "normal to measure gaps along")
            return
         end if
         allocate(sides%master)
         call facets_init(sides%master, scene, scene%surface(pair%master), error)
         if (allocated(error)) return
         call patch_triangles_init(sides%triangles, sides%master, scene%x)
         sides%mirror = mirror_axes(sides%master, scene)
         sides%rests = rests_of_points(sides, sides%node_rests)
         if (pair%slave == pair%master) call touch_rule_space_init(sides%rule, sides%slave, &
            sides%frames%middle, scene)
         call touch_rule_space_measure(sides%rule, sides%slave, sides%master, &
            sides%frames%middle, scene)
         associate (n => sides%frames%n, m => sides%rule%n_class)
            self%frame = [(1 + (i - 1)/m, i = 1, n*m)]
            self%class = [(1 + mod(i - 1, m), i = 1, n*m)]
         end associate
         self%node = sides%frames%base(sides%frames%point(self%frame))
         self%n_constraint = size(self%node)
         allocate(self%duplicate(self%n_constraint), source=0)
         allocate(self%state(self%n_constraint), self%stencil(self%n_constraint))
         allocate(self%scale(self%n_constraint), source=1.0_wp)
         allocate(self%cover(self%n_constraint), self%sagitta(self%n_constraint), source=0.0_wp)
         self%thickness = sqrt(sides%frames%area(sides%frames%point(self%frame)))
         call near_list_init(self%near, point_items(sides), sides%master%facet, scene%x, scene%u0, &
            pair%interaction%offset + interaction_reach(pair%interaction))
         self%state%other_size = sides%frames%size(sides%frames%point(self%frame))
      end associate
      self%holds_all = .not. pair_has_order(pair)
      if (self%holds_all) self%area_factor = 0.5_wp
      self%may_leave = .true.
      self%slack = pair%slack
      if (pair%of_pair > 0 .and. pair%slack > 0.0_wp) then
         if (scene%pair(pair%of_pair)%formulation == formulation_mortar) call hold_corners(self)
      end if
      self%offset = pair%interaction%offset
      self%max_penetration_at_start = deepest_start
      call contact_laws_of_surface(pair%interaction, self%laws)
   end subroutine patch_contact_init

   !> Where contact points rest, as all nodes do that they are made of.
   pure function rests_of_points(sides, rests) result(of_point)
      type(patch_sides_t), intent(in) :: sides
      logical, intent(in) :: rests(:, :)         !! (3, n_node of the scene)
      logical, allocatable :: of_point(:, :)
      integer, allocatable :: item(:, :)
      integer :: i

      allocate(item, source=point_items(sides))
      allocate(of_point(size(rests, 1), size(item, 2)))
      do i = 1, size(item, 2)
         of_point(:, i) = all(rests(:, pack(item(:, i), item(:, i) > 0)), 2)
      end do
   end function rests_of_points

   !> Corners of bodies are held nearly at once beside means of gaps, which do not see them. Along a
   !> rim they do: rows of both there would say nearly the same, and fight.
   pure subroutine hold_corners(self)
      type(patch_contact_t), intent(inout) :: self
      integer :: i

      allocate(self%own_slack(self%n_constraint), source=self%slack)
      associate (frames => self%sides%frames)
         do i = 1, self%n_constraint
            associate (point => frames%point(self%frame(i)))
               if (frames%start(point + 1) > frames%start(point) + 1) self%own_slack(i) = &
                  corner_slack
            end associate
         end do
      end associate
   end subroutine hold_corners

   !> The nodes that contact points are made of.
   pure function point_items(sides) result(item)
      type(patch_sides_t), intent(in) :: sides
      integer, allocatable :: item(:, :)
      integer :: k, n

      n = size(sides%slave%node)
      associate (middle => sides%frames%middle)
         allocate(item(merge(size(sides%slave%facet, 1), 1, size(middle) > 0), n + size(middle)), &
            source=0)
         item(1, :n) = sides%slave%node
         do k = 1, size(middle)
            item(:, n + k) = sides%slave%facet(:, middle(k))
         end do
      end associate
   end function point_items

   !> No option of a step changes what a gap is made of.
   pure subroutine patch_configure(self, x, options)
      class(patch_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (3, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options
   end subroutine patch_configure

   !> Measure gaps of nodes to the curved surface that the master stands for, not of patches to its
   !> facets, or these.
   pure subroutine patch_follow_arcs(self, x, options, is_wanted)
      class(patch_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (3, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options
      logical, intent(in) :: is_wanted           !! else between facets
      type(facet_split_t) :: split
      type(bulges_t) :: own

      self%memo%is_known = .false.
      self%sagitta = 0.0_wp
      if (allocated(self%bulges)) deallocate(self%bulges, self%own_rise)
      if (.not. is_wanted) return
      allocate(self%bulges)
      call bulges_find(self%bulges, self%sides%master, self%sides%triangles%split, x, &
         options%smoothing_angle)
      associate (frames => self%sides%frames)
         allocate(self%own_rise(frames%n_node + size(frames%middle)), source=0.0_wp)
         if (size(frames%middle) == 0) return
         call facet_split_init(split, self%sides%slave)
         call bulges_find(own, self%sides%slave, split, x, options%smoothing_angle)
         self%own_rise(frames%n_node + 1:) = own%point(split%centre(frames%middle))
      end associate
   end subroutine patch_follow_arcs

   pure real(wp) function patch_curve_doubt(self) result(doubt)
      class(patch_contact_t), intent(in) :: self

      doubt = 0.0_wp
      if (allocated(self%bulges)) then
         doubt = bulges_doubt(self%bulges, self%sides%triangles%split)
      end if
   end function patch_curve_doubt

   !> How much less than its patch has it the contact point of constraint `i` is in front of the
   !> curved surface of the master, as a point of that of the slave.
   pure real(wp) function sagitta_under(self, i, x, u0) result(sagitta)
      class(patch_contact_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      real(wp), dimension(3, 3 + self%stencil(i)%patch%n_vertex) :: at, way
      type(patch_look_t) :: look

      sagitta = 0.0_wp
      if (self%stencil(i)%triangle == 0) return
      call patch_stencil_place(self%stencil(i), x, u0, at)
      way = 0.0_wp
      look = patch_look(self%stencil(i)%patch, at, way)
      if (look%cover(0) > no_cover) sagitta = look%height(0)/look%cover(0) &
         - (patch_stencil_height(self%stencil(i), self%sides, self%bulges, x, u0) &
         - self%own_rise(self%sides%frames%point(self%frame(i))))
   end function sagitta_under

   !> Choose for each frame what its patch may see in the step. From the same start and up to
   !> the same reach the choice is the same.
   pure subroutine patch_begin_step(self, x, u0, du)
      class(patch_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      type(patch_scope_t) :: scope
      integer :: i, k

      call near_list_update(self%near, x, u0, du, self%reach)
      if (self%sides%rule%is_self .and. self%n_sifted /= self%near%n_list) call sift(self)
      call self%has_looked(self%near%clearance)
      if (abs(self%chosen_reach - self%reach) <= 0.0_wp) then
         if (position_memo_holds(self%memo, self%near%node, x, u0)) return
      end if
      call position_memo_take(self%memo, self%near%node, x, u0)
      self%chosen_reach = self%reach
      scope%gives_way = self%step%has_compliance
      associate (list => self%near%candidates)
         do i = 1, self%n_constraint
            associate (item => self%sides%frames%point(self%frame(i)))
               associate (of => list%facet(list%start(item):list%start(item + 1) - 1))
                  scope%facet = pack(of, [(touch_rule_space_sees(self%sides%rule, self%class(i), &
                     of(k)) .and. near_list_within(self%near, item, of(k), self%reach), &
                     k = 1, size(of))])
               end associate
            end associate
            call patch_stencil_choose(self%stencil(i), self%sides, self%frame(i), scope, x, u0)
            associate (patch => self%stencil(i)%patch)
               if (allocated(patch%slip_share)) deallocate(patch%slip_share)
            end associate
            if (allocated(self%bulges)) self%sagitta(i) = sagitta_under(self, i, x, u0)
         end do
      end associate
   end subroutine patch_begin_step

   !> Leave out of a new list of candidates what a surface never touches of itself.
   pure subroutine sift(self)
      type(patch_contact_t), intent(inout) :: self
      integer :: item, k, from, n

      n = 0
      associate (list => self%near%candidates, sides => self%sides)
         do item = 1, size(list%start) - 1
            from = list%start(item)
            list%start(item) = n + 1
            do k = from, list%start(item + 1) - 1
               if (.not. touch_rule_space_may(sides%rule, sides%slave, item, list%facet(k))) cycle
               n = n + 1
               list%facet(n) = list%facet(k)
            end do
         end do
         list%start(size(list%start)) = n + 1
      end associate
      self%near%candidates%facet = self%near%candidates%facet(:n)
      if (n == 0) self%near%nearest = self%near%reach
      self%n_sifted = self%near%n_list
   end subroutine sift

   pure subroutine patch_measure(self, x, u0, du)
      class(patch_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      integer :: i
      logical :: is_chosen                       ! from here

      is_chosen = position_memo_holds(self%memo, self%near%node, x, u0)
      do i = 1, self%n_constraint
         call patch_stencil_begin(self%stencil(i), x, u0, is_chosen)
         call measure_frame(self, i, x, u0, du)
      end do
   end subroutine patch_measure

   !> The gap of frame `i` at both ends of the step, and what of its patch is covered.
   pure subroutine measure_frame(self, i, x, u0, du)
      type(patch_contact_t), intent(inout) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp), dimension(3, 3 + self%stencil(i)%patch%n_vertex) :: at, way
      type(patch_look_t) :: look
      real(wp) :: least

      associate (state => self%state(i), stencil => self%stencil(i), cover => look%cover)
         state = gap_state_t()
         if (stencil%triangle == 0) return
         call patch_stencil_gather(stencil, x, u0, du, at, way)
         look = patch_look(stencil%patch, at, way)
         ! What stores energy is followed as long as there is any to give back.
         least = least_cover
         self%scale(i) = max(cover(0), least)
         if (self%step%is_penalty) least = no_cover
         state%size = stencil%size
         state%other_size = self%sides%frames%size(self%sides%frames%point(self%frame(i)))
         state%is_near = maxval(cover) > no_cover
         state%is_over = cover(1) >= least .or. (self%step%is_penalty .and. cover(0) >= least)
         state%is_leaving = .not. state%is_over
         if (state%is_over .and. .not. self%step%has_compliance) state%is_over = &
            patch_meets(stencil, self%sides%frames, self%frame(i), at, x, u0) .or. &
            patch_meets(stencil, self%sides%frames, self%frame(i), at + way, x, u0, du)
         state%is_arriving = cover(0) < least
         state%is_covered = look%way <= self%chosen_reach
         state%gap1 = self%step%engages             ! what is not covered asks for nothing
         if (cover(0) > no_cover) state%gap0 = look%height(0)/cover(0) - self%offset &
            - self%sagitta(i)
         ! What is under a fading strip already comes from beside the surface.
         if (state%is_arriving) state%was_open = min(look%ahead - self%offset, state%gap0) &
            >= -max_penetration_on_entry*state%size
         if (cover(1) >= least) state%gap1 = look%height(1)/cover(1) - self%offset &
            - self%sagitta(i)
         if (allocated(self%own_slack)) then
            state%closed = -merge(self%slack, self%own_slack(i), self%step%has_compliance) &
               *room_at(self, i)
         else if (self%slack > 0.0_wp) then
            state%closed = -self%slack*room_at(self, i)
         end if
         self%cover(i) = cover(1)
         if (state%gap0 < -stencil%deepest - self%offset) state = gap_state_t()
      end associate
   end subroutine measure_frame

   !> What a guard's slack at frame `i` is a part of: the smaller of both facets, or twice the
   !> thinner of both bodies there, so that nothing goes through a thin one [L].
   pure real(wp) function room_at(self, i) result(room)
      type(patch_contact_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint, with a triangle in front of it

      associate (sides => self%sides, point => self%sides%frames%point(self%frame(i)), &
            facet => self%sides%triangles%split%facet(self%stencil(i)%triangle))
         room = min(self%stencil(i)%size, sides%frames%size(point), &
            2.0_wp*sides%rule%depth(facet), 2.0_wp*sides%rule%own_depth(point))
      end associate
   end function room_at

   pure subroutine patch_evaluate(self, wanted, x, u0, du, target, item)
      class(patch_contact_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)           !! (n) numbers of constraints, ascending
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: target(:)          !! (n) [L]
      type(condition_t), intent(inout) :: item(:)   !! (n)
      logical :: is_chosen                       ! from here
      integer :: k

      is_chosen = position_memo_holds(self%memo, self%near%node, x, u0)
      do k = 1, size(wanted)
         call patch_stencil_begin(self%stencil(wanted(k)), x, u0, is_chosen)
         if (item(k)%has_friction) call patch_slip_begin(self%stencil(wanted(k)), &
            x, u0)
         call evaluate_frame(self, wanted(k), x, u0, du, target(k) + self%offset &
            + self%sagitta(wanted(k)), item(k))
      end do
   end subroutine patch_evaluate

   !> The condition of frame `i`.
   pure subroutine evaluate_frame(self, i, x, u0, du, target, item)
      type(patch_contact_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp), intent(in) :: target             !! height to hold [L]
      type(condition_t), intent(inout) :: item
      real(wp), dimension(3, 3 + self%stencil(i)%patch%n_vertex) :: at, way
      type(patch_gap_t) :: gap
      type(patch_spread_t) :: spread
      logical :: is_used(self%stencil(i)%n_node)
      integer :: used(self%stencil(i)%n_node), k

      associate (stencil => self%stencil(i))
         call patch_stencil_gather(stencil, x, u0, du, at, way)
         call patch_gap(stencil%patch, at, way, target, item%leaves_second, gap)
         is_used = patch_uses(stencil, gap%vertex)
         if (item%has_friction) call use_corners(stencil, is_used)
         call condition_resize(item, count(is_used), size(x, 1))
         call list_used(is_used, used)
         associate (n => item%n_node, n_var => size(x, 1)*item%n_node)
            item%node(:n) = stencil%node(used(:n))
            item%n_slave = stencil%n_slave
            item%size = stencil%size
            item%is_mean = .true.
            item%gap0 = 0.0_wp
            item%gap1 = 0.0_wp
            item%dgap = 0.0_wp
            item%g(:, :n) = 0.0_wp
            item%c(:, :n) = 0.0_wp
            if (.not. item%leaves_second) item%h(:n_var, :n_var) = 0.0_wp
            call patch_spread_list(stencil, gap%vertex, is_used, spread)
            call patch_spread(gap, spread, self%scale(i), [(k, k = 1, n)], item)
            if (item%has_friction) call patch_slip_add(stencil, used(2:n), at, way, &
               slip_place(self%step), item)
            if (any(stencil%flip(:stencil%n_node) > 0)) call condition_fold(item, &
               stencil%flip(used(:n)))
         end associate
      end associate
   end subroutine evaluate_frame

   !> The nodes at the corners of the nearest triangle, over which slip is counted, are used too.
   pure subroutine use_corners(stencil, is_used)
      type(patch_stencil_t), intent(in) :: stencil
      logical, intent(inout) :: is_used(:)       !! (n_node)
      integer :: c, k

      do c = 1, size(stencil%corner)
         do k = 1, size(is_used)
            is_used(k) = is_used(k) .or. abs(stencil%weight(k, 2 + stencil%corner(c))) > 0.0_wp
         end do
      end do
   end subroutine use_corners

   !> Which places are used.
   pure subroutine list_used(is_used, used)
      logical, intent(in) :: is_used(:)          !! (n)
      integer, intent(out) :: used(:)            !! (n) those, then 0
      integer :: k, n

      used = 0
      n = 0
      do k = 1, size(is_used)
         if (.not. is_used(k)) cycle
         n = n + 1
         used(n) = k
      end do
   end subroutine list_used

   !> As `contact_t` has it.
   pure function patch_slip(self, i, x, u0, du) result(slip)
      class(patch_contact_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp) :: slip(size(x, 1) - 1)           !! [L]

      slip = patch_slip_of(self%stencil(i), x, u0, du, slip_place(self%step))
   end function patch_slip

   !> As `contact_t` has it: what of the facets at its point faces along each frame. At the corner
   !> of a body each face is that of its own frame alone.
   pure subroutine patch_area(self, x, u, area, length)
      class(patch_contact_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp), intent(out) :: area(:)           !! (n_constraint) [L^2]
      real(wp), intent(out) :: length(:)         !! (n_constraint) by their thickness [L]
      integer :: i

      associate (frames => self%sides%frames)
         do i = 1, self%n_constraint
            area(i) = facets_point_area(self%sides%slave, frames%middle, &
               frames%point(self%frame(i)), frame_normal(frames, self%frame(i), self%node(i), x, &
               u), x, u)
         end do
      end associate
      length = area/self%thickness
   end subroutine patch_area

   pure subroutine patch_pressures(self, force, area, pressure)
      class(patch_contact_t), intent(in) :: self
      real(wp), intent(in) :: force(:)           !! (n_constraint) [M L/T^2]
      real(wp), intent(in) :: area(:)            !! (n_constraint) [L^2]
      real(wp), intent(out) :: pressure(:)       !! (n_constraint) [M/(L T^2)]

      call facets_pressures(self%sides%slave, self%sides%frames%middle, &
         self%sides%frames%point(self%frame), force, area, pressure)
   end subroutine patch_pressures

   !> Integrals of gaps are functions of the positions alone; their means know what was covered.
   pure real(wp) function patch_share(self, i) result(share)
      class(patch_contact_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint

      share = self%scale(i)
   end function patch_share

   pure real(wp) function patch_mean_gap(self, i, gap) result(mean_gap)
      class(patch_contact_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in) :: gap                !! integral by what was covered at the start [L]

      mean_gap = 0.0_wp
      if (self%cover(i) > no_cover) mean_gap = gap*self%scale(i)/self%cover(i)
   end function patch_mean_gap

   !> Each node of both surfaces may be held.
   pure logical function patch_could_hold(self, is_loose) result(could_hold)
      class(patch_contact_t), intent(in) :: self
      logical, intent(in) :: is_loose(:)         !! (n_constraint) it is not held, and goes in

      could_hold = self%holds_all .and. any(is_loose)
   end function patch_could_hold

   !> Nodes are held, edges cross between them, and so do chords of one curved surface.
   pure real(wp) function patch_lets_in(self) result(lets_in)
      class(patch_contact_t), intent(in) :: self

      lets_in = merge(overlap_bar, crossing_bar, self%slack > 0.0_wp .or. .not. self%holds_all)
      if (.not. allocated(self%bulges)) return
      associate (triangles => self%sides%triangles)
         lets_in = lets_in + bulges_largest(self%bulges, triangles%split, triangles%size)
      end associate
   end function patch_lets_in

end module emcon_patch_contact_space
