! build: elements
!> Contact of edges in space: edges of two bodies that cross, with no node in front of a face.
!>
!> Which edge a side of faces crosses is chosen once per step (`emcon_edge_choice_space`); here is
!> what a crossing gives. Source: docs/theory.md, section 14, after eq. (51).
module emcon_edge_contact_space
   use emcon_condition_nodes, only : condition_resize, condition_resize_slip
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t, gap_state_t, max_penetration_on_entry, slip_place
   use emcon_contact_law_registry, only : contact_laws_of_surface
   use emcon_edge_choice_space, only : edge_choice_follow_arcs, edge_choice_init, &
      edge_choice_is_guard, edge_choice_slave, edge_choice_t, edge_choice_update, least_sine
   use emcon_edge_pair_space, only : crossing_t, edge_crossing, edge_pair_gap, edge_pair_gap_t, &
      edge_pair_slip, edge_pair_slip_t, n_edge_pair_node
   use emcon_edge_sight_space, only : begins_beyond, is_at_end, is_within, length_of, normal_of
   use emcon_edge_stencil_space, only : edge_ends_t, edge_stencil_ends, edge_stencil_motion, &
      edge_stencil_place, edge_stencil_t
   use emcon_guards, only : crossing_bar, crossing_slack
   use emcon_interactions, only : contact_options_t, contact_pair_t, interaction_reach
   use emcon_kinds, only : wp
   use emcon_node_sums, only : node_sums_first, node_sums_second
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: edge_contact_t, edge_contact_init

   !> So far past its ends, by its length, an edge goes on to hold.
   real(wp), parameter :: ends_beyond = 0.05_wp
   !> So deep, by the edge, two edges may be in each other as a contact begins.
   real(wp), parameter :: deepest_start = 0.1_wp
   integer, parameter :: n_part = 3*n_edge_pair_node

   type, extends(contact_t) :: edge_contact_t
      type(edge_choice_t) :: choice              !! a constraint is one of its places
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

   !> Set up the edges of the pair `pair` of `scene`.
   subroutine edge_contact_init(self, scene, pair)
      type(edge_contact_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      integer :: k, ends(2)

      self%offset = pair%interaction%offset
      call edge_choice_init(self%choice, scene, pair, self%offset &
         + interaction_reach(pair%interaction))
      self%n_constraint = size(self%choice%stencil)
      allocate(self%node(self%n_constraint), self%duplicate(self%n_constraint), source=0)
      allocate(self%state(self%n_constraint))
      allocate(self%sagitta(self%n_constraint), self%thickness(self%n_constraint), source=0.0_wp)
      self%may_leave = .true.
      self%max_penetration_at_start = deepest_start
      call contact_laws_of_surface(pair%interaction, self%laws)
      do k = 1, self%n_constraint
         ends = edge_choice_slave(self%choice, k)
         self%node(k) = ends(1)
         self%thickness(k) = norm2(scene%x(:, ends(2)) - scene%x(:, ends(1)))
      end do
   end subroutine edge_contact_init

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

      call edge_choice_follow_arcs(self%choice, x, options, is_wanted)
   end subroutine edge_follow_arcs

   !> Choose the edges that cross in the step.
   pure subroutine edge_begin_step(self, x, u0, du)
      class(edge_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]

      if (self%n_constraint == 0) then
         call self%has_looked(huge(1.0_wp))
      else
         self%choice%gives_way = self%step%has_compliance
         call edge_choice_update(self%choice, x, u0, du, self%reach)
         call self%has_looked(self%choice%near%clearance)
      end if
   end subroutine edge_begin_step

   pure subroutine edge_measure(self, x, u0, du)
      class(edge_contact_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      integer :: k

      do k = 1, self%n_constraint
         self%state(k) = gap_state_t()
         if (self%choice%stencil(k)%master > 0) call measure_crossing(self, k, x, u0, du)
      end do
   end subroutine edge_measure

   !> The gap of crossing `k` at both ends of the step, and whether edges cross within their ends.
   pure subroutine measure_crossing(self, k, x, u0, du)
      type(edge_contact_t), intent(inout) :: self
      integer, intent(in) :: k
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp), dimension(3, n_edge_pair_node) :: at, way
      type(crossing_t) :: from, to

      associate (state => self%state(k), stencil => self%choice%stencil(k), &
            edges => self%choice%edges)
         call edge_stencil_place(edges, stencil, x, u0, at)
         from = edge_crossing(at)
         state%size = length_of(at(:, 1), at(:, 2))
         state%other_size = length_of(at(:, 3), at(:, 4))
         call edge_stencil_motion(edges, stencil, du, way)
         to = edge_crossing(at + way)
         state%is_near = .true.
         state%is_over = is_within(to, begins_beyond)
         if (edges%is_bare(stencil%master)) state%is_over = state%is_over .or. is_at_end(to)
         ! Past parallel ones the normal points the other way, and tells nothing.
         state%is_over = state%is_over .and. &
            dot_product(normal_of(at), normal_of(at + way)) > 0.0_wp
         state%is_leaving = .not. is_within(to, ends_beyond)
         state%is_arriving = .not. is_within(from, ends_beyond)
         state%gap0 = stencil%side*from%height - self%offset
         state%gap1 = stencil%side*to%height - self%offset
         if (edge_choice_is_guard(self%choice, k)) state%closed = -crossing_slack &
            *minval(edges%breadth([stencil%edge, stencil%master]))
         state%was_open = state%gap0 >= -max_penetration_on_entry*state%size
         state%is_covered = sqrt(maxval(sum(way**2, 1))) <= self%choice%reach .and. &
            to%sine >= 0.5_wp*least_sine
      end associate
   end subroutine measure_crossing

   pure subroutine edge_evaluate(self, wanted, x, u0, du, target, item)
      class(edge_contact_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)           !! (n) numbers of constraints, ascending
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: target(:)          !! (n) [L]
      type(condition_t), intent(inout) :: item(:)   !! (n)
      integer :: k

      do k = 1, size(wanted)
         call evaluate_crossing(self, self%choice%stencil(wanted(k)), x, u0, du, &
            target(k) + self%offset, item(k))
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

      call edge_stencil_place(self%choice%edges, stencil, x, u0, at)
      call edge_stencil_motion(self%choice%edges, stencil, du, way)
      call edge_pair_gap(at, way, stencil%side, item%leaves_second, gap)
      ends = edge_stencil_ends(self%choice%edges, stencil)
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
      if (item%has_friction) call add_slip(at, way, ends, slip_place(self%step), item)
   end subroutine evaluate_crossing

   !> Slip of a crossing with its derivatives.
   pure subroutine add_slip(at, way, ends, at_part, item)
      real(wp), intent(in) :: at(:, :), way(:, :)   !! (3, 4) of the ends [L]
      type(edge_ends_t), intent(in) :: ends
      real(wp), intent(in) :: at_part            !! of `slip_place`
      type(condition_t), intent(inout) :: item   !! with its nodes
      type(edge_pair_slip_t) :: slip
      integer :: s

      call edge_pair_slip(at, way, at_part, item%leaves_second, slip)
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
      if (self%choice%stencil(i)%master == 0) return
      call edge_stencil_place(self%choice%edges, self%choice%stencil(i), x, u0, at)
      call edge_stencil_motion(self%choice%edges, self%choice%stencil(i), du, way)
      call edge_pair_slip(at, way, slip_place(self%step), .true., over)
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

      waits = edge_choice_is_guard(self%choice, i)
   end function edge_waits

end module emcon_edge_contact_space
