!> Contact of sharp edges in space: edges of two bodies that cross, with no node in front of a face.
!>
!> Each edge of one surface has a few places for crossings, one for each class of edges of the
!> other. Which edge it crosses is chosen once per step. Source: docs/theory.md, section 15, after
!> eq. (51).
module emcon_edge_contact_space
   use emcon_condition_nodes, only : condition_resize, condition_resize_slip
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t, gap_state_t, max_penetration_on_entry
   use emcon_contact_law_registry, only : contact_laws_of_surface
   use emcon_csr, only : csr_list_users
   use emcon_edge_pair_space, only : crossing_t, edge_crossing, edge_pair_gap, edge_pair_gap_t, &
      edge_pair_slip, edge_pair_slip_t, n_edge_pair_node
   use emcon_guards, only : crossing_bar
   use emcon_interactions, only : contact_damping_t, contact_options_t, contact_pair_t, &
      interaction_reach, interaction_t
   use emcon_kinds, only : wp
   use emcon_near_list, only : near_list_init, near_list_t, near_list_update, near_list_within
   use emcon_position_memo, only : position_memo_holds, position_memo_t, position_memo_take
   use emcon_ridges_space, only : sharp_edge_normals, sharp_edges_init, sharp_edges_t
   use emcon_rotation, only : cross_product
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: edge_contact_t, edge_contact_init

   !> Edges of the other surface that an edge may cross at once: one of each class.
   integer, parameter :: n_class = 4
   !> The sine of the angle between edges below which they run along each other, and nodes hold.
   real(wp), parameter :: least_sine = 1.0e-2_wp
   !> An edge holds what comes from between its faces, and from so much outside: the sine of that
   !> angle by the sine of that between the faces. Edges that lie on faces would be on the limit.
   real(wp), parameter :: beside = 0.25_wp
   !> So far inside its ends, by its length, an edge begins to hold, as nodes hold there; so far
   !> past them it goes on to hold.
   real(wp), parameter :: begins_beyond = -1.0e-3_wp, ends_beyond = 0.05_wp
   !> So deep, by the edge, two edges may be in each other, and may be as a contact begins.
   real(wp), parameter :: deepest = 0.3_wp, deepest_start = 0.1_wp

   !> The crossing of two edges in a step.
   type :: edge_stencil_t
      integer :: master = 0                      !! edge of the other surface; 0: none
      real(wp) :: side = 0.0_wp                  !! 1 or -1: heights are gaps
   end type edge_stencil_t

   type, extends(contact_t) :: edge_contact_t
      logical :: is_self = .false.                    !! of a surface with itself
      logical :: is_exchanged = .false.               !! the edges below are the pair's master's
      type(sharp_edges_t) :: slave
      type(sharp_edges_t), allocatable :: master      !! gfortran 12 loses a second one of its kind
      integer, allocatable :: class(:)                !! (n of the master) 1 to n_class
      type(near_list_t) :: near
      type(position_memo_t) :: memo                   !! of the nodes as stencils were chosen:
      real(wp) :: chosen_reach = 0.0_wp               !! among edges up to there [L]
      type(edge_stencil_t), allocatable :: stencil(:)    !! (n_constraint), by slave edge and class
   contains
      procedure :: configure => edge_configure
      procedure :: begin_points => edge_begin_step
      procedure :: measure_points => edge_measure
      procedure :: evaluate_points => edge_evaluate
      procedure :: slip_points => edge_slip
      procedure :: area_points => edge_area
      procedure :: lets_in => edge_lets_in
   end type edge_contact_t

contains

   !> Set up the edges of the pair `pair` of `scene`; without sharp edges on both sides there are no
   !> constraints. They are those of the side with more edges, so that each crosses few.
   subroutine edge_contact_init(self, scene, pair)
      type(edge_contact_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(sharp_edges_t), allocatable :: first, second
      type(interaction_t) :: surface
      integer :: i, k

      allocate(first, second)
      call sharp_edges_init(first, scene, scene%surface(pair%slave))
      call sharp_edges_init(second, scene, scene%surface(pair%master))
      self%n_constraint = n_class*max(size(first%node, 2), size(second%node, 2))
      if (min(size(first%node, 2), size(second%node, 2)) == 0) self%n_constraint = 0
      self%is_self = pair%slave == pair%master
      self%is_exchanged = size(second%node, 2) > size(first%node, 2)
      if (self%is_exchanged) then
         self%slave = second
         call move_alloc(first, self%master)
      else
         self%slave = first
         call move_alloc(second, self%master)
      end if
      self%node = [((self%slave%node(1, i), k = 1, n_class), i = 1, self%n_constraint/n_class)]
      allocate(self%duplicate(self%n_constraint), source=0)
      allocate(self%state(self%n_constraint), self%stencil(self%n_constraint))
      allocate(self%sagitta(self%n_constraint), self%thickness(self%n_constraint), source=0.0_wp)
      do i = 1, self%n_constraint
         self%thickness(i) = norm2(scene%x(:, self%slave%node(2, 1 + (i - 1)/n_class)) &
            - scene%x(:, self%node(i)))
      end do
      self%may_leave = .true.
      self%offset = pair%interaction%offset
      self%max_penetration_at_start = deepest_start
      surface = pair%interaction
      surface%damping = contact_damping_t()
      call contact_laws_of_surface(surface, self%laws)
      if (self%n_constraint == 0) return
      call find_classes(self%master, size(scene%x, 2), self%class)
      call near_list_init(self%near, self%slave%node, self%master%node, scene%x, scene%u0, &
         self%offset + interaction_reach(surface))
   end subroutine edge_contact_init

   !> Sort edges into classes so that those with a node in common are of different ones, as far as
   !> there are enough.
   pure subroutine find_classes(edges, n_node, class)
      type(sharp_edges_t), intent(in) :: edges
      integer, intent(in) :: n_node              !! of the scene
      integer, allocatable, intent(out) :: class(:)
      integer, allocatable :: start(:), at(:)
      integer :: i, j, k, used(n_class)

      allocate(class(size(edges%node, 2)), source=0)
      associate (n => size(edges%node, 2))
         call csr_list_users(n_node, [(1 + 2*k, k = 0, n)], reshape(edges%node, [2*n]), start, at)
      end associate
      do i = 1, size(class)
         used = 0
         do k = 1, 2
            do j = start(edges%node(k, i)) + 1, start(edges%node(k, i) + 1)
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

   !> Choose the edge that each one crosses in the step, for each class. From the same start and up
   !> to the same reach the choice is the same.
   pure subroutine edge_begin_step(self, x, u0, du)
      class(edge_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      integer :: i, k

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
      associate (list => self%near%candidates)
         do i = 1, size(self%slave%node, 2)
            do k = list%start(i), list%start(i + 1) - 1
               if (near_list_within(self%near, i, list%facet(k), x, u0, self%reach)) &
                  call choose(self, i, list%facet(k), x, u0)
            end do
         end do
      end associate
   end subroutine edge_begin_step

   !> Let slave edge `i` cross master edge `m` in the step, if they may meet in it and no other one
   !> of the class is nearer.
   pure subroutine choose(self, i, m, x, u0)
      class(edge_contact_t), intent(inout) :: self
      integer, intent(in) :: i, m
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      real(wp), dimension(3, n_edge_pair_node) :: at, still
      real(wp) :: normal(3), of_slave(3, 2), of_master(3, 2), length(2)
      type(crossing_t) :: crossing
      type(edge_stencil_t) :: new

      if (self%is_self .and. m <= i) return
      if (any(self%slave%node(1, i) == self%master%node(:, m)) .or. &
         any(self%slave%node(2, i) == self%master%node(:, m))) return
      new = edge_stencil_t(m, 1.0_wp)
      still = 0.0_wp
      call gather(self, i, new, x, u0, still, at)
      crossing = edge_crossing(at)
      if (crossing%sine < least_sine) return
      length = [length_of(at(:, :2)), length_of(at(:, 3:))]
      if (any(max(-crossing%place, crossing%place - 1.0_wp)*length > self%reach)) return
      normal = unit(cross_product(at(:, 2) - at(:, 1), at(:, 4) - at(:, 3)))
      of_slave = sharp_edge_normals(self%slave, i, x, u0)
      of_slave = reshape([unit(of_slave(:, 1)), unit(of_slave(:, 2))], shape(of_slave))
      of_master = sharp_edge_normals(self%master, m, x, u0)
      of_master = reshape([unit(of_master(:, 1)), unit(of_master(:, 2))], shape(of_master))
      new%side = sign(1.0_wp, dot_product(normal, sum(of_slave, 2)))
      normal = new%side*normal
      if (.not. (is_between(normal, of_slave) .and. is_between(-normal, of_master))) return
      associate (gap => new%side*crossing%height, old => self%stencil(n_class*(i - 1) &
            + self%class(m)))
         if (gap - self%offset < -deepest*minval(length) .or. gap > self%reach) return
         if (old%master > 0) then
            if (.not. is_nearer(self, i, gap, old, x, u0)) return
         end if
         old = new
      end associate
   end subroutine choose

   !> Is a gap nearer to 0 than that with `old`?
   pure logical function is_nearer(self, i, gap, old, x, u0)
      class(edge_contact_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: gap                !! [L]
      type(edge_stencil_t), intent(in) :: old
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)
      real(wp), dimension(3, n_edge_pair_node) :: at, still
      type(crossing_t) :: crossing

      still = 0.0_wp
      call gather(self, i, old, x, u0, still, at)
      crossing = edge_crossing(at)
      is_nearer = abs(gap) < abs(crossing%height)
   end function is_nearer

   !> Is a direction normal to an edge between the outward normals of its faces, or hardly outside?
   pure logical function is_between(direction, normal)
      real(wp), intent(in) :: direction(3)       !! of unit length
      real(wp), intent(in) :: normal(3, 2)       !! of unit length
      real(wp) :: cosine, least

      cosine = dot_product(normal(:, 1), normal(:, 2))
      least = -beside*(1.0_wp - cosine**2)
      is_between = dot_product(direction, normal(:, 1) - cosine*normal(:, 2)) > least .and. &
         dot_product(direction, normal(:, 2) - cosine*normal(:, 1)) > least .and. &
         dot_product(direction, sum(normal, 2)) > 0.0_wp
   end function is_between

   pure function unit(vector)
      real(wp), intent(in) :: vector(3)
      real(wp) :: unit(3)

      unit = vector/max(sqrt(dot_product(vector, vector)), tiny(vector))
   end function unit

   pure real(wp) function length_of(ends) result(length)
      real(wp), intent(in) :: ends(3, 2)

      length = sqrt(dot_product(ends(:, 2) - ends(:, 1), ends(:, 2) - ends(:, 1)))
   end function length_of

   !> Where the ends of slave edge `i` and of the master edge it crosses are from the first of them.
   pure subroutine gather(self, i, stencil, x, u, way, at)
      class(edge_contact_t), intent(in) :: self
      integer, intent(in) :: i
      type(edge_stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: way(:, :)          !! (3, 4) that they move then [L]
      real(wp), intent(out) :: at(:, :)          !! (3, 4) [L]
      integer :: k

      associate (node => nodes_of(self, i, stencil))
         do k = 1, n_edge_pair_node
            at(:, k) = (x(:, node(k)) - x(:, node(1))) + (u(:, node(k)) - u(:, node(1))) + way(:, k)
         end do
      end associate
   end subroutine gather

   pure function nodes_of(self, i, stencil) result(node)
      class(edge_contact_t), intent(in) :: self
      integer, intent(in) :: i
      type(edge_stencil_t), intent(in) :: stencil
      integer :: node(n_edge_pair_node)

      node = [self%slave%node(:, i), self%master%node(:, stencil%master)]
   end function nodes_of

   !> How the ends move in the step, from the first of them on.
   pure subroutine gather_motion(self, i, stencil, du, way)
      class(edge_contact_t), intent(in) :: self
      integer, intent(in) :: i
      type(edge_stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: du(:, :)
      real(wp), intent(out) :: way(:, :)         !! (3, 4) [L]
      integer :: k

      associate (node => nodes_of(self, i, stencil))
         do k = 1, n_edge_pair_node
            way(:, k) = du(:, node(k)) - du(:, node(1))
         end do
      end associate
   end subroutine gather_motion

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
      real(wp), dimension(3, n_edge_pair_node) :: at, way, still
      type(crossing_t) :: from, to

      associate (state => self%state(k), stencil => self%stencil(k), i => 1 + (k - 1)/n_class)
         still = 0.0_wp
         call gather(self, i, stencil, x, u0, still, at)
         from = edge_crossing(at)
         state%size = length_of(at(:, :2))
         state%other_size = length_of(at(:, 3:))
         call gather_motion(self, i, stencil, du, way)
         call gather(self, i, stencil, x, u0, way, at)
         to = edge_crossing(at)
         state%is_near = .true.
         state%is_over = is_within(to, begins_beyond)
         state%is_leaving = .not. is_within(to, ends_beyond)
         state%is_arriving = .not. is_within(from, ends_beyond)
         state%gap0 = stencil%side*from%height - self%offset
         state%gap1 = stencil%side*to%height - self%offset
         state%was_open = state%gap0 >= -max_penetration_on_entry*state%size
         state%is_covered = sqrt(maxval(sum(way**2, 1))) <= self%chosen_reach .and. &
            to%sine >= 0.5_wp*least_sine
      end associate
   end subroutine measure_crossing

   !> Do edges cross within their ends, and `beyond` of their lengths past them?
   pure logical function is_within(crossing, beyond)
      type(crossing_t), intent(in) :: crossing
      real(wp), intent(in) :: beyond

      is_within = crossing%sine > 0.0_wp .and. all(crossing%place > -beyond .and. &
         crossing%place < 1.0_wp + beyond)
   end function is_within

   pure subroutine edge_evaluate(self, wanted, x, u0, du, target, item)
      class(edge_contact_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)           !! (n) numbers of constraints, ascending
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: target(:)          !! (n) [L]
      type(condition_t), intent(inout) :: item(:)   !! (n)
      real(wp), dimension(3, n_edge_pair_node) :: at, way, still
      type(edge_pair_gap_t) :: gap
      integer :: k, order(n_edge_pair_node), place(3*n_edge_pair_node)

      still = 0.0_wp
      ! The side that the pair names as the slave comes first.
      order = cshift([1, 2, 3, 4], merge(2, 0, self%is_exchanged))
      place = cshift([(k, k = 1, size(place))], merge(6, 0, self%is_exchanged))
      do k = 1, size(wanted)
         associate (i => 1 + (wanted(k) - 1)/n_class, stencil => self%stencil(wanted(k)), &
               hold => target(k) + self%offset)
            call gather(self, i, stencil, x, u0, still, at)
            call gather_motion(self, i, stencil, du, way)
            call edge_pair_gap(at, way, stencil%side, item(k)%leaves_second, gap)
            call condition_resize(item(k), n_edge_pair_node, size(x, 1))
            associate (node => nodes_of(self, i, stencil))
               item(k)%node(:n_edge_pair_node) = node(order)
            end associate
            item(k)%n_slave = 2
            item(k)%size = length_of(at(:, :2))
            item(k)%gap0 = gap%gap(0) - hold
            item(k)%gap1 = gap%gap(1) - hold
            item(k)%dgap = gap%dgap
            item(k)%g(:, :n_edge_pair_node) = gap%g(:, order)
            item(k)%c(:, :n_edge_pair_node) = gap%c(:, order)
            if (.not. item(k)%leaves_second) item(k)%h(:size(place), :size(place)) = &
               gap%h(place, place)
            if (item(k)%has_friction) call add_slip(at, way, order, place, item(k))
         end associate
      end do
   end subroutine edge_evaluate

   !> Slip of a crossing with its derivatives.
   pure subroutine add_slip(at, way, order, place, item)
      real(wp), intent(in) :: at(:, :), way(:, :)   !! (3, 4) of the ends [L]
      integer, intent(in) :: order(:), place(:)  !! of nodes and coordinates in the condition
      type(condition_t), intent(inout) :: item   !! with its nodes
      type(edge_pair_slip_t) :: slip
      integer :: s

      call edge_pair_slip(at, way, item%leaves_second, slip)
      call condition_resize_slip(item)
      item%slip(:size(slip%f)) = slip%f
      do s = 1, size(slip%f)
         item%t(:, :n_edge_pair_node, s) = slip%g(:, order, s)
         item%t1(:, :n_edge_pair_node, s) = slip%c(:, order, s)
         if (.not. item%leaves_second) item%ht(:size(place), :size(place), s) = slip%h(place, &
            place, s)
      end do
   end subroutine add_slip

   !> As `contact_t` has it.
   pure function edge_slip(self, i, x, u0, du) result(slip)
      class(edge_contact_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp) :: slip(size(x, 1) - 1)           !! [L]
      real(wp), dimension(3, n_edge_pair_node) :: at, way, still
      type(edge_pair_slip_t) :: over

      slip = 0.0_wp
      still = 0.0_wp
      associate (edge => 1 + (i - 1)/n_class, stencil => self%stencil(i))
         if (stencil%master == 0) return
         call gather(self, edge, stencil, x, u0, still, at)
         call gather_motion(self, edge, stencil, du, way)
      end associate
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

end module emcon_edge_contact_space
