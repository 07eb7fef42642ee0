! build: elements
!> Contact of nodes in space with a wall: one constraint per node and per virtual centre of a facet
!> with nodes between corners, its gap the distance from the shape itself. Source: docs/theory.md,
!> section 14.1.
module emcon_wall_contact_space
   use emcon_condition_nodes, only : condition_resize, condition_resize_slip
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t, gap_state_t, max_penetration_on_entry, push_place
   use emcon_contact_law_registry, only : contact_laws_of_surface
   use emcon_dgrad_nodes, only : nodes_add_first, nodes_add_second
   use emcon_element_kind, only : max_face_nodes
   use emcon_errors, only : error_t
   use emcon_facet_groups, only : facet_groups_init, facet_groups_t, group_angle
   use emcon_facet_split, only : facet_split_centre, facet_split_middles
   use emcon_facet_values, only : facets_point_area, facets_pressures
   use emcon_facets, only : facets_length, facets_normal, facets_t
   use emcon_frame_slip_space, only : slip_axis_t
   use emcon_guards, only : corner_slack
   use emcon_interactions, only : contact_options_t, contact_pair_t, interaction_reach
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_slave_faces_space, only : slave_faces_init
   use emcon_wall, only : wall_t
   use emcon_wall_distance_space, only : wall_at, wall_ends_here, wall_find, wall_is_solid, &
      wall_spot_t
   use emcon_wall_gap_space, only : dg_t, wall_gap, wall_gap_nodes
   use emcon_wall_slip_space, only : n_wall_point, wall_axis, wall_axis_for, wall_own_normal, &
      wall_slip, wall_slip_t
   implicit none
   private
   public :: wall_contact_t, wall_contact_init

   !> So far, per facet, a gap may be closed as a step begins in which it begins to act; behind a
   !> shape without ends it is closed however deep it is.
   real(wp), parameter :: deepest_start = 0.1_wp
   !> Nodes are near within this part of a facet, or within so many of the largest motion of a node
   !> in the step.
   real(wp), parameter :: near_per_facet = 0.5_wp, near_per_motion = 2.0_wp
   !> A node faces a wall if it does so with this part of its area at least.
   real(wp), parameter :: least_faced = 0.25_wp

   type, extends(contact_t) :: wall_contact_t
      type(wall_t) :: wall
      type(facets_t) :: slave
      integer, allocatable :: middle(:)               !! facets of it whose centres are points
      integer, allocatable :: place(:)                !! (n_constraint) its nodes, then `middle`
      real(wp), allocatable :: size(:)                !! (n_constraint) mean facet there [L]
      real(wp) :: depth = 0.0_wp                      !! that pads and laws reach [L]
      real(wp), allocatable :: own_slack(:)           !! (n_constraint) of a guard beside mortar
      !> (n_constraint) vectors of the wall that slip is counted along: as a rule, and in this step
      integer, allocatable :: usual_along(:), along(:)
   contains
      procedure :: configure => wall_configure
      procedure :: begin_points => wall_begin_step
      procedure :: measure_points => wall_measure
      procedure :: evaluate_points => wall_evaluate
      procedure :: slip_points => wall_slip_over
      procedure :: area_points => wall_area
      procedure :: own_area => wall_own_area
      procedure :: mean_size => wall_mean_size
      procedure :: pressures => wall_pressures
   end type wall_contact_t

contains

   !> Set up the pair `pair` of `scene`, whose master is a wall.
   subroutine wall_contact_init(self, scene, pair, error)
      type(wall_contact_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error
      logical, allocatable :: is_meant(:)
      integer :: i, k

      call slave_faces_init(self%slave, scene, scene%surface(pair%slave), is_meant, error)
      if (allocated(error)) return
      self%wall = scene%surface(pair%master)%wall
      self%middle = facet_split_middles(self%slave, is_meant)
      associate (n => size(self%slave%node))
         self%place = [pack([(i, i = 1, n)], is_meant), (n + i, i = 1, size(self%middle))]
         self%node = [pack(self%slave%node, is_meant), self%slave%facet(2, self%middle)]
      end associate
      self%n_constraint = size(self%node)
      allocate(self%duplicate(self%n_constraint), source=0)
      allocate(self%state(self%n_constraint), self%size(self%n_constraint))
      allocate(self%sagitta(self%n_constraint), source=0.0_wp)
      do i = 1, self%n_constraint
         associate (around => facets_at(self, i))
            self%size(i) = sum([(facets_length(self%slave, around(k)), k = 1, size(around))]) &
               /real(size(around), wp)
         end associate
      end do
      call choose_usual(self, scene%x)
      self%thickness = self%size
      self%depth = pair%interaction%offset + interaction_reach(pair%interaction)
      self%may_leave = .not. wall_is_solid(self%wall)
      self%slack = pair%slack
      if (pair%of_pair > 0) call hold_corners(self, scene%x)
      self%offset = pair%interaction%offset
      self%max_penetration_at_start = merge(huge(1.0_wp), deepest_start, wall_is_solid(self%wall))
      call contact_laws_of_surface(pair%interaction, self%laws)
   end subroutine wall_contact_init

   !> Which vectors of the wall are the most along it, as the points lie in the reference.
   pure subroutine choose_usual(self, x)
      type(wall_contact_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :)            !! (3, n_node of the scene) reference [L]
      real(wp) :: u(size(x, 1), size(x, 2))
      integer :: i

      allocate(self%usual_along(self%n_constraint))
      u = 0.0_wp
      do i = 1, self%n_constraint
         associate (normal => own_normal(self, i, x, u))
            self%usual_along(i) = wall_axis_for(normal)
         end associate
      end do
      self%along = self%usual_along
   end subroutine choose_usual

   !> The normal of the wall that point `i` sees at x + u, in the vectors of the wall.
   pure function own_normal(self, i, x, u) result(normal)
      type(wall_contact_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp) :: normal(3)

      normal = wall_own_normal(self%wall, wall_at(self%wall, x, u), point_in(self, i, x) &
         + point_in(self, i, u))
   end function own_normal

   !> Corners of bodies are held nearly at once beside means of gaps, which do not see them.
   pure subroutine hold_corners(self, x)
      type(wall_contact_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :)            !! (3, n_node of the scene) reference [L]
      type(facet_groups_t) :: groups
      integer :: i

      call facet_groups_init(groups, self%slave, x, group_angle)
      allocate(self%own_slack(self%n_constraint), source=self%slack)
      do i = 1, self%n_constraint
         associate (place => self%place(i))
            if (place > size(self%slave%node)) cycle
            if (groups%node_start(place + 1) > groups%node_start(place) + 1) then
               self%own_slack(i) = corner_slack
            end if
         end associate
      end do
   end subroutine hold_corners

   !> The facets at point `i`.
   pure function facets_at(self, i) result(facet)
      type(wall_contact_t), intent(in) :: self
      integer, intent(in) :: i
      integer, allocatable :: facet(:)

      associate (slave => self%slave, place => self%place(i))
         if (place > size(slave%node)) then
            facet = [self%middle(place - size(slave%node))]
         else
            facet = slave%around(slave%around_start(place):slave%around_start(place + 1) - 1)
         end if
      end associate
   end function facets_at

   !> The nodes that point `i` is a sum of, and their weights in it.
   pure subroutine find_parts(self, i, n, node, weight)
      type(wall_contact_t), intent(in) :: self
      integer, intent(in) :: i
      integer, intent(out) :: n                  !! number of nodes
      integer, intent(out) :: node(:)            !! (max_face_nodes) of the scene
      real(wp), intent(out) :: weight(:)         !! (max_face_nodes) of sum 1

      n = 1
      node(1) = self%node(i)
      weight(1) = 1.0_wp
      if (self%place(i) <= size(self%slave%node)) return
      associate (f => self%middle(self%place(i) - size(self%slave%node)))
         n = count(self%slave%facet(:, f) > 0)
         node(:n) = self%slave%facet(:n, f)
         weight(:n) = facet_split_centre(n)
      end associate
   end subroutine find_parts

   !> Where point `i` is in a field of positions, or how it moves in one of motions.
   pure function point_in(self, i, field) result(point)
      type(wall_contact_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: field(:, :)        !! (3, n_node of the scene) [L]
      real(wp) :: point(3), weight(max_face_nodes)
      integer :: k, n, node(max_face_nodes)

      call find_parts(self, i, n, node, weight)
      point = 0.0_wp
      do k = 1, n
         point = point + weight(k)*field(:, node(k))
      end do
   end function point_in

   !> No option of a step changes what a gap is made of.
   pure subroutine wall_configure(self, x, options)
      class(wall_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (3, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options
   end subroutine wall_configure

   !> There is nothing to choose but what is near, which never falls within a step, and which vector
   !> of the wall slip is counted along: that stays the same over the step, and from step to step
   !> unless the wall turns its normal into it.
   pure subroutine wall_begin_step(self, x, u0, du)
      class(wall_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      integer :: i

      do i = 1, self%n_constraint
         self%along(i) = wall_axis_for(own_normal(self, i, x, u0), self%usual_along(i))
      end do
      self%reach = max(self%reach, self%depth + near_per_facet*maxval([0.0_wp, self%size]), &
         self%depth + near_per_motion*sqrt(maxval([0.0_wp, sum(du(:, self%node)**2, 1)])))
      ! A wall that turns may move by more than its nodes: what is far now may be near soon.
      call self%has_looked(0.0_wp)
   end subroutine wall_begin_step

   pure subroutine wall_measure(self, x, u0, du)
      class(wall_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp) :: start(3, 4), end(3, 4)
      integer :: i

      start = wall_at(self%wall, x, u0)
      end = start + du(:, self%wall%node)
      do i = 1, self%n_constraint
         associate (at => point_in(self, i, x) + point_in(self, i, u0))
            call measure_node(self, i, wall_find(self%wall, start, at), &
               wall_find(self%wall, end, at + point_in(self, i, du)))
         end associate
      end do
   end subroutine wall_measure

   !> The gap of constraint `i` by what it sees at both ends of the step.
   pure subroutine measure_node(self, i, from, to)
      type(wall_contact_t), intent(inout) :: self
      integer, intent(in) :: i
      type(wall_spot_t), intent(in) :: from, to
      logical :: is_over(0:1)

      is_over = .not. wall_ends_here(self%wall, [from, to])
      associate (state => self%state(i))
         state = gap_state_t()
         state%size = self%size(i)
         state%other_size = self%size(i)
         state%gap0 = from%distance - self%offset
         state%gap1 = to%distance - self%offset
         state%is_near = any(is_over) .and. min(state%gap0, state%gap1) <= self%reach
         ! What stores energy is followed as long as there is any to give back.
         state%is_over = is_over(1) .or. (self%step%is_penalty .and. is_over(0))
         state%is_leaving = .not. state%is_over
         state%is_arriving = .not. is_over(0)
         if (state%is_arriving) state%was_open = state%gap0 >= -max_penetration_on_entry*state%size
         if (self%slack > 0.0_wp) state%closed = -self%slack*state%size
         if (allocated(self%own_slack) .and. .not. self%step%has_compliance) then
            state%closed = -self%own_slack(i)*state%size
         end if
         ! Behind a shape that ends, the other side of it is farther away than this.
         if (.not. wall_is_solid(self%wall) .and. from%distance < -0.5_wp*self%wall%extent) then
            state = gap_state_t()
         end if
      end associate
   end subroutine measure_node

   pure subroutine wall_evaluate(self, wanted, x, u0, du, target, item)
      class(wall_contact_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)           !! (n) numbers of constraints, ascending
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: target(:)          !! (n) [L]
      type(condition_t), intent(inout) :: item(:)   !! (n)
      integer :: k

      do k = 1, size(wanted)
         call evaluate_node(self, wanted(k), x, u0, du, target(k) + self%offset, item(k))
      end do
   end subroutine wall_evaluate

   !> The condition of point `i`.
   pure subroutine evaluate_node(self, i, x, u0, du, target, item)
      type(wall_contact_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp), intent(in) :: target             !! distance to hold [L]
      type(condition_t), intent(inout) :: item
      type(dg_t) :: gap
      real(wp), dimension(3, n_wall_point) :: at, way
      integer :: n

      call gather(self, i, x, u0, du, at, way)
      gap = wall_gap(self%wall, at(:, :4), way(:, :4))
      n = wall_gap_nodes(self%wall)
      item%size = self%size(i)
      item%gap0 = gap%f0 - target
      item%gap1 = gap%f1 - target
      item%dgap = gap%df
      if (item%has_friction) then
         call spread_gap(self, i, gap, n, n_wall_point, item)
         call spread_slip(self, i, at, way, item)
      else
         call spread_gap(self, i, gap, n, n, item)
      end if
   end subroutine evaluate_node

   !> Where point `i`, the origin and the tips of the vectors of the wall are, and how they move.
   pure subroutine gather(self, i, x, u0, du, at, way)
      type(wall_contact_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp), intent(out) :: at(3, n_wall_point), way(3, n_wall_point)   !! [L]

      at(:, 1) = point_in(self, i, x) + point_in(self, i, u0)
      at(:, 2:) = x(:, self%wall%node) + u0(:, self%wall%node)
      way(:, 1) = point_in(self, i, du)
      way(:, 2:) = du(:, self%wall%node)
   end subroutine gather

   !> As `contact_t` has it.
   pure function wall_slip_over(self, i, x, u0, du) result(slip)
      class(wall_contact_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp) :: slip(size(x, 1) - 1)           !! [L]
      real(wp), dimension(3, n_wall_point) :: at, way
      type(wall_slip_t) :: over

      call gather(self, i, x, u0, du, at, way)
      call wall_slip(self%wall, at, way, axis_of(self, i), .true., over)
      slip = over%f
   end function wall_slip_over

   !> What its slip is counted along.
   pure type(slip_axis_t) function axis_of(self, i) result(axis)
      type(wall_contact_t), intent(in) :: self
      integer, intent(in) :: i

      axis = slip_axis_t(wall_axis(self%along(i)), push_place(self%step))
   end function axis_of

   !> Derivatives by the nodes of point `i` and of the wall, from those by the point and the wall.
   pure subroutine spread_gap(self, i, gap, n_of_gap, n, item)
      type(wall_contact_t), intent(in) :: self
      integer, intent(in) :: i
      type(dg_t), intent(in) :: gap
      integer, intent(in) :: n_of_gap            !! the point and nodes of the wall
      integer, intent(in) :: n                   !! the same of the condition
      type(condition_t), intent(inout) :: item
      integer, parameter :: n_dim = 3
      real(wp) :: g(n_dim, n_wall_point), c(n_dim, n_wall_point), &
         h(n_dim*n_wall_point, n_dim*n_wall_point)
      real(wp) :: weight(max_face_nodes)
      integer :: k, m, node(max_face_nodes)

      call find_parts(self, i, m, node, weight)
      call condition_resize(item, m + n - 1, n_dim)
      item%n_slave = m
      item%node(:m + n - 1) = [node(:m), self%wall%node(:n - 1)]
      g = 0.0_wp
      c = 0.0_wp
      associate (in_order => [(k, k = 1, n_of_gap)])
         call nodes_add_first(1.0_wp, gap%g, in_order, g)
         call nodes_add_first(1.0_wp, gap%c, in_order, c)
         if (.not. item%leaves_second) h = 0.0_wp
         if (.not. item%leaves_second) call nodes_add_second(1.0_wp, n_dim, gap%h, in_order, h)
      end associate
      associate (share => [weight(:m), (1.0_wp, k = 2, n)])
         call share_first(g, share, m, item%g(:, :m + n - 1))
         call share_first(c, share, m, item%c(:, :m + n - 1))
         if (.not. item%leaves_second) call share_second(h, share, m, item%h)
      end associate
   end subroutine spread_gap

   !> Slip of point `i` with its derivatives.
   pure subroutine spread_slip(self, i, at, way, item)
      type(wall_contact_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: at(:, :), way(:, :)   !! (3, n_wall_point) of `gather` [L]
      type(condition_t), intent(inout) :: item   !! with all nodes of the wall
      type(wall_slip_t) :: slip
      real(wp) :: weight(max_face_nodes)
      integer :: k, m, n, s, node(max_face_nodes)

      call wall_slip(self%wall, at, way, axis_of(self, i), item%leaves_second, slip)
      call find_parts(self, i, m, node, weight)
      call condition_resize_slip(item)
      n = item%n_node
      item%slip(:size(slip%f)) = slip%f
      associate (share => [weight(:m), (1.0_wp, k = 2, n_wall_point)])
         do s = 1, size(slip%f)
            call share_first(slip%g(:, :, s), share, m, item%t(:, :n, s))
            call share_first(slip%c(:, :, s), share, m, item%t1(:, :n, s))
            if (.not. item%leaves_second) call share_second(slip%h(:, :, s), share, m, &
               item%ht(:, :, s))
         end do
      end associate
   end subroutine spread_slip

   !> Derivatives by nodes from those by the point, a sum of the first `m` of them, and by the rest.
   pure subroutine share_first(part, share, m, of_node)
      real(wp), intent(in) :: part(:, :)         !! (3, >= 1 + n_node - m)
      real(wp), intent(in) :: share(:)           !! (n_node) of nodes in these
      integer, intent(in) :: m
      real(wp), intent(out) :: of_node(:, :)     !! (3, n_node)
      integer :: k

      do k = 1, size(share)
         of_node(:, k) = share(k)*part(:, max(1, 1 + k - m))
      end do
   end subroutine share_first

   !> The same of second derivatives.
   pure subroutine share_second(part, share, m, of_node)
      real(wp), intent(in) :: part(:, :)         !! (>= 3 (1 + n_node - m), the same)
      real(wp), intent(in) :: share(:)           !! (n_node)
      integer, intent(in) :: m
      real(wp), intent(inout) :: of_node(:, :)   !! (>= 3 n_node, the same)
      integer, parameter :: n_dim = 3
      integer :: k, l

      do l = 1, size(share)
         do k = 1, size(share)
            associate (i => n_dim*max(0, k - m), j => n_dim*max(0, l - m))
               of_node(n_dim*(k - 1) + 1:n_dim*k, n_dim*(l - 1) + 1:n_dim*l) = share(k)*share(l) &
                  *part(i + 1:i + n_dim, j + 1:j + n_dim)
            end associate
         end do
      end do
   end subroutine share_second

   !> As `contact_t` has it: what of the facets at its point faces the wall.
   pure subroutine wall_area(self, x, u, area, length)
      class(wall_contact_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp), intent(out) :: area(:)           !! (n_constraint) [L^2]
      real(wp), intent(out) :: length(:)         !! (n_constraint) by their size [L]
      integer :: i

      do i = 1, self%n_constraint
         area(i) = facets_point_area(self%slave, self%middle, self%place(i), &
            facing(self, i, x, u), x, u)
      end do
      length = area/self%size
   end subroutine wall_area

   !> Which way point `i` would press on the wall: against its normal there.
   pure function facing(self, i, x, u)
      type(wall_contact_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: x(:, :), u(:, :)
      real(wp) :: facing(3)
      type(wall_spot_t) :: spot

      spot = wall_find(self%wall, wall_at(self%wall, x, u), point_in(self, i, x) &
         + point_in(self, i, u))
      facing = -spot%normal
   end function facing

   !> In the reference, where a body may be turned away from the wall that it is to meet: there it
   !> is the largest area with which its node can face one.
   pure subroutine wall_own_area(self, x, area)
      class(wall_contact_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (3, n_node) reference positions [L]
      real(wp), intent(out) :: area(:)           !! (n_constraint) [L^2]
      real(wp) :: length(size(area)), u(size(x, 1), size(x, 2)), normal(3), largest
      integer :: i, k

      u = 0.0_wp
      call self%area_points(x, u, area, length)
      do i = 1, self%n_constraint
         largest = 0.0_wp
         associate (around => facets_at(self, i))
            do k = 1, size(around)
               normal = facets_normal(self%slave, around(k), x, u)
               normal = normal/sqrt(dot_product(normal, normal))
               largest = max(largest, facets_point_area(self%slave, self%middle, self%place(i), &
                  normal, x, u))
            end do
         end associate
         if (area(i) < least_faced*largest) area(i) = largest
      end do
   end subroutine wall_own_area

   pure real(wp) function wall_mean_size(self, x) result(length)
      class(wall_contact_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (3, n_node) reference positions [L]

      length = huge(length)
      if (self%n_constraint > 0) length = sum(self%size)/self%n_constraint
   end function wall_mean_size

   pure subroutine wall_pressures(self, force, area, pressure)
      class(wall_contact_t), intent(in) :: self
      real(wp), intent(in) :: force(:)           !! (n_constraint) [M L/T^2]
      real(wp), intent(in) :: area(:)            !! (n_constraint) [L^2]
      real(wp), intent(out) :: pressure(:)       !! (n_constraint) [M/(L T^2)]

      call facets_pressures(self%slave, self%middle, self%place, force, area, pressure)
   end subroutine wall_pressures

end module emcon_wall_contact_space
