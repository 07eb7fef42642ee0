!> Mortar contact: gaps between a slave edge and the master edges that it faces, integrated over
!> the segments that they share, or at Gauss points of the slave edge.
!>
!> Which edges make pairs is chosen once per step. Source: docs/theory.md, sections 4.5 and 4.6;
!> paper eqs. (2) and (3).
module emcon_mortar
   use emcon_arcs_plane, only : arc_rise, arcs_find
   use emcon_chain_plane, only : chain_corners, chain_distance, chain_shorter
   use emcon_condition_nodes, only : nodes_append
   use emcon_contact, only : push_place
   use emcon_contact_law, only : contact_laws_reach
   use emcon_edge_moments, only : form_begin
   use emcon_errors, only : error_t
   use emcon_gauss, only : gauss_points
   use emcon_integrated_gap, only : integrated_gap_init, integrated_gap_sagittas, &
      integrated_gap_slips, integrated_gap_t
   use emcon_interactions, only : contact_options_t, contact_pair_t, integration_elements, &
      interaction_reach, multiplier_dual, normal_nodal, smoothing_hermite
   use emcon_kinds, only : wp
   use emcon_mortar_choice, only : pair_append, pair_comes_near, pair_cut_corners, pair_is_meant, &
      pairs_drop_far, pairs_seen
   use emcon_mortar_frame, only : frame_cover, frame_hit, frame_init, frame_lean, frame_point, &
      frame_t, moment_area, moment_area_xi, moment_cover, n_moment, n_place, pair_stencil_t, &
      place_after, place_before, local_master
   use emcon_mortar_pair2, only : segment_add2 => segment_add
   use emcon_mortar_pair2_first, only : segment_add2_first => segment_add
   use emcon_mortar_pair4, only : point_add, segment_add4 => segment_add
   use emcon_mortar_pair4_first, only : point_add_first => point_add, &
      segment_add4_first => segment_add
   use emcon_mortar_stencil, only : stencil_gather, stencil_master, stencil_slave
   use emcon_near_list, only : near_list_init, near_list_t, near_list_update
   use emcon_scene, only : scene_t
   use emcon_slip_point, only : slip_list_t, slip_point, slip_point_t
   implicit none
   private
   public :: mortar_t, mortar_init

   !> Gauss points unless the deck gives them: two are exact for straight edges. On smoothed edges a
   !> master node that passes a slave node leaves a jump of the gradient, by the error of the
   !> quadrature: in statics a few points more bring it below what Newton's method sees.
   integer, parameter :: segment_points = 2, element_points = 3, smooth_points = 4

   type, extends(integrated_gap_t) :: mortar_t
      type(contact_options_t) :: options
      type(near_list_t) :: near
      logical, allocatable :: slave_corner(:)         !! (n_edge) at the first node of each edge
      logical, allocatable :: master_corner(:)
      !> (n_edge) of the arcs of slave and master if gaps are measured between these [1/L]
      real(wp), allocatable :: slave_curvature(:), master_curvature(:)
      real(wp), allocatable :: point(:), weight(:)    !! quadrature on 0..1
      integer, allocatable :: start(:)                !! (n_edge + 1) pairs of each slave edge
      type(pair_stencil_t), allocatable :: pair(:)    !! (>= number of pairs)
      integer, allocatable :: seen(:, :, :)           !! (2, n_point, n_edge) which pair of the edge
                                                      !! is at a Gauss point, and which beside it
                                                      !! at a master node; 0: none
   contains
      procedure :: configure => mortar_configure
      procedure :: follow_arcs => mortar_follow_arcs
      procedure :: begin_points => mortar_begin_step
      procedure :: choose_slip => mortar_choose_slip
      procedure :: measure_edges => mortar_measure_edges
      procedure :: form_edge => mortar_form_edge
   end type mortar_t

contains

   !> Set up the pair `pair` of `scene`.
   subroutine mortar_init(self, scene, pair, error)
      type(mortar_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error

      call integrated_gap_init(self, scene, pair, error)
      if (allocated(error)) return
      call near_list_init(self%near, self%slave%facet, self%master%facet, scene%x, scene%u0, &
         maxval(self%slave%size) + (self%offset + interaction_reach(pair%interaction)))
      self%max_gap_on_entry = maxval(self%slave%size)
      allocate(self%start(self%slave%n_facet + 1), source=1)
      allocate(self%pair(0))
      call self%configure(scene%x, self%options)
   end subroutine mortar_init

   pure subroutine mortar_configure(self, x, options)
      class(mortar_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (2, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options
      integer :: n

      self%options = options
      self%is_dual = options%multiplier == multiplier_dual
      if (.not. allocated(self%slave_corner)) allocate(self%slave_corner(self%slave%n_facet), &
         self%master_corner(self%master%n_facet))
      call chain_corners(self%slave, x, options%normal_angle, self%slave_corner)
      call chain_corners(self%master, x, options%smoothing_angle, self%master_corner)
      n = segment_points
      if (options%smoothing == smoothing_hermite .and. self%meets_statics) n = smooth_points
      if (options%integration == integration_elements) n = element_points
      if (options%n_point > 0) n = options%n_point
      if (allocated(self%point)) deallocate(self%point, self%weight, self%seen)
      allocate(self%point(n), self%weight(n))
      call gauss_points(self%point, self%weight)
      allocate(self%seen(2, n, self%slave%n_facet), source=0)
   end subroutine mortar_configure

   !> A smoothed master has its own curve in place of arcs.
   pure subroutine mortar_follow_arcs(self, x, options, is_wanted)
      class(mortar_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (2, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options
      logical, intent(in) :: is_wanted           !! else between edges

      self%sagitta = 0.0_wp
      if (allocated(self%slave_curvature)) deallocate(self%slave_curvature, self%master_curvature)
      if (.not. is_wanted) return
      allocate(self%slave_curvature(self%slave%n_facet))
      allocate(self%master_curvature(self%master%n_facet), source=0.0_wp)
      call arcs_find(self%slave, x, options%normal_angle, self%slave_curvature)
      if (options%smoothing == smoothing_hermite) return
      call arcs_find(self%master, x, options%smoothing_angle, self%master_curvature)
   end subroutine mortar_follow_arcs

   !> Choose the pairs of edges for the step.
   pure subroutine mortar_begin_step(self, x, u0, du)
      class(mortar_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      integer :: e, n

      call near_list_update(self%near, x, u0, du, self%reach)
      call self%has_looked(self%near%clearance)
      n = 0
      do e = 1, self%slave%n_facet
         self%start(e) = n + 1
         call choose_pairs(self, e, x, u0, du, n)
         if (self%options%integration == integration_elements) call pairs_seen( &
            self%pair(self%start(e):n), self%master, self%point, x, u0, du, self%seen(:, :, e))
      end do
      self%start(e) = n + 1
      call integrated_gap_slips(self, x, u0, du)
      if (allocated(self%slave_curvature)) call choose_sagittas(self, x, u0, du)
   end subroutine mortar_begin_step

   !> How far the arcs of both surfaces rise over what gaps are measured between.
   pure subroutine choose_sagittas(self, x, u0, du)
      type(mortar_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      type(frame_t) :: frame
      real(wp), dimension(size(x, 1), n_place) :: local, dlocal
      integer :: e, k, i

      do e = 1, self%slave%n_facet
         associate (value => self%form(e)%value)
            value = 0.0_wp
            do k = self%start(e), self%start(e + 1) - 1
               call stencil_gather(self%pair(k), x, u0, du, local, dlocal)
               do i = 0, 1
                  call frame_init(frame, self%pair(k), local + i*dlocal)
                  value(:, i) = value(:, i) + moments_of(self, e, k, frame, .true.)
               end do
            end do
         end associate
      end do
      call integrated_gap_sagittas(self)
   end subroutine choose_sagittas

   !> Moments of pair `k` of slave edge `e` over the segment that it covers, or over the Gauss
   !> points that look at it: docs/theory.md, eq. (15).
   pure function moments_of(self, e, k, frame, of_arcs) result(moment)
      type(mortar_t), intent(in) :: self
      integer, intent(in) :: e, k
      type(frame_t), intent(in) :: frame
      logical, intent(in) :: of_arcs             !! with their rise in the place of the gap
      real(wp) :: moment(n_moment)
      real(wp) :: low, high, area, part, xi, eta, value
      logical :: is_segment
      integer :: i

      moment = 0.0_wp
      low = 0.0_wp
      high = 1.0_wp
      is_segment = self%options%integration /= integration_elements
      if (is_segment) call frame_cover(frame, low, high)
      if (.not. high > low) return
      area = (high - low)*frame%length
      do i = 1, size(self%point)
         part = self%weight(i)
         if (.not. is_segment) part = share(self, i, e, k)
         if (.not. part > 0.0_wp) cycle
         xi = low + (high - low)*self%point(i)
         call frame_point(frame, self%pair(k), xi, eta, value)
         if (of_arcs) value = rise_at(self, e, self%pair(k)%edge, frame, xi, eta)
         moment = moment + [part*area*value, part*area*value*xi, part*area, part*area*xi, part]
      end do
      if (is_segment) moment(moment_area:) = [area, area*0.5_wp*(low + high), high - low]
   end function moments_of

   !> How far the arcs of slave edge `e` and master edge `m` rise in the way between their places.
   pure real(wp) function rise_at(self, e, m, frame, xi, eta) result(rise)
      type(mortar_t), intent(in) :: self
      integer, intent(in) :: e, m
      type(frame_t), intent(in) :: frame
      real(wp), intent(in) :: xi, eta            !! 0 to 1 along the edges
      real(wp) :: lean, master_lean

      call frame_lean(frame, xi, lean, master_lean)
      rise = arc_rise(self%slave_curvature(e), self%slave%size(e), xi, lean) &
         + arc_rise(self%master_curvature(m), self%master%size(m), eta, master_lean)
   end function rise_at

   !> The points of quadrature of its gap with the weights that they have in it where forces act: at
   !> the end of the step as that is expected, or in the middle.
   pure subroutine mortar_choose_slip(self, i, x, u0, du, list)
      class(mortar_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      type(slip_list_t), intent(inout) :: list
      integer :: k, e, pass
      real(wp) :: at

      do pass = 1, 2
         at = 0.0_wp                             ! where nothing is covered there: at the start
         if (pass == 1) at = push_place(self%step)
         do k = 1, 2
            e = self%node_edge(k, i)
            if (e > 0) list%point = [list%point, edge_slips(self, e, 3 - k, x, u0, du, at)]
         end do
         if (size(list%point) > 0) return
      end do
      do k = 1, 2
         e = self%node_edge(k, i)
         if (e == 0 .or. size(list%point) > 0) cycle
         if (self%start(e + 1) == self%start(e)) cycle
         list%point = [slip_point(self%pair(self%start(e))%node(:local_master(1) + 1), &
            merge(1.0_wp, 0.0_wp, k == 1), 1.0_wp)]
      end do
   end subroutine mortar_choose_slip

   !> What slave edge `e` gives to the slip of its node `side`, 1 or 2: docs/theory.md, eq. (14j).
   pure function edge_slips(self, e, side, x, u0, du, at) result(point)
      type(mortar_t), intent(in) :: self
      integer, intent(in) :: e, side
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp), intent(in) :: at                 !! 0: as the step begins, 1: as it ends; between
      type(slip_point_t), allocatable :: point(:)
      type(slip_point_t) :: list(size(self%point)*(self%start(e + 1) - self%start(e)))
      real(wp) :: xi(size(list)), bound(0:1), part, theta
      integer :: k, i, n

      n = 0
      do k = self%start(e), self%start(e + 1) - 1
         bound = segment_of(self, k, x, u0, du, at)
         do i = 1, size(self%point)
            part = (bound(1) - bound(0))*self%weight(i)
            if (self%options%integration == integration_elements) part = share(self, i, e, k)
            if (.not. part > 0.0_wp) cycle
            n = n + 1
            xi(n) = bound(0) + (bound(1) - bound(0))*self%point(i)
            list(n) = slip_point(self%pair(k)%node(:local_master(1) + 1), xi(n), part)
         end do
      end do
      theta = merge(sum(list(:n)%weight)**2, 0.0_wp, self%is_dual)
      do i = 1, n
         part = merge(1.0_wp - xi(i), xi(i), side == 1) &
            + merge(1.0_wp, -1.0_wp, side == 1)*theta*(1.0_wp - 2.0_wp*xi(i))
         list(i)%weight = self%slave%size(e)*list(i)%weight*part
      end do
      point = list(:n)
   end function edge_slips

   !> Where the segment of pair `k` lies on its slave edge, between its ends at the start and at the
   !> end of the step; all of the edge for Gauss points of whole edges.
   pure function segment_of(self, k, x, u0, du, at) result(bound)
      class(mortar_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      real(wp), intent(in) :: at                 !! as in `edge_slips`
      real(wp) :: bound(0:1)                     !! 0 to 1; the same: it covers nothing
      type(frame_t) :: frame
      real(wp), dimension(size(x, 1), n_place) :: local, dlocal
      real(wp), dimension(0:1) :: first, last
      integer :: j

      bound = [0.0_wp, 1.0_wp]
      if (self%options%integration == integration_elements) return
      call stencil_gather(self%pair(k), x, u0, du, local, dlocal)
      first = 0.0_wp
      last = 0.0_wp
      do j = 0, 1
         if (.not. abs(at - real(1 - j, wp)) > 0.0_wp) cycle      ! of no weight
         call frame_init(frame, self%pair(k), local + j*dlocal)
         call frame_cover(frame, first(j), last(j))
      end do
      bound = [(1.0_wp - at)*first(0) + at*first(1), (1.0_wp - at)*last(0) + at*last(1)]
   end function segment_of

   !> The master edges that slave edge `e` faces within the step, appended to the `n` pairs so far.
   pure subroutine choose_pairs(self, e, x, u0, du, n)
      type(mortar_t), intent(inout) :: self
      integer, intent(in) :: e
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      integer, intent(inout) :: n
      type(pair_stencil_t) :: stencil
      type(frame_t) :: frame(0:1)
      real(wp) :: local(2, n_place), dlocal(2, n_place), corner(2, 4), motion(2, 4)
      integer :: k, m
      logical :: is_wide
      real(wp) :: reach

      reach = max(0.0_wp, contact_laws_reach(self%laws))
      associate (list => self%near%candidates, options => self%options)
         is_wide = options%integration == integration_elements
         if (list%start(e + 1) > list%start(e)) call stencil_slave(stencil, self%slave, e, &
            options%normal == normal_nodal, self%slave_corner)
         call place_edge(self%slave%facet(:, e), self%slave%facet(1, e), 0, corner, motion)
         do k = list%start(e), list%start(e + 1) - 1
            m = list%facet(k)
            if (self%is_self) then
               if (self%slave%place(m) < self%slave%place(e) &
                  .or. chain_distance(self%slave, e, m) < 2) cycle
            end if
            call place_edge(self%master%facet(:, m), self%slave%facet(1, e), &
               size(self%slave%facet, 1), corner, motion)
            if (.not. pair_comes_near(self%slave%size(e) + reach, corner, motion)) cycle
            call stencil_master(stencil, self%master, m, options%smoothing == smoothing_hermite, &
               is_wide, self%master_corner)
            if (is_wide) stencil%rounding = self%rounding*chain_shorter(self%master, m)
            call stencil_gather(stencil, x, u0, du, local, dlocal)
            call frame_init(frame(0), stencil, local)
            call frame_init(frame(1), stencil, local + dlocal)
            if (.not. pair_is_meant(stencil, frame, self%max_penetration_at_start)) cycle
            if (is_wide .and. .not. stencil%is_smooth) call pair_cut_corners(stencil, frame(0))
            call pair_append(self%pair, n, stencil)
         end do
      end associate
      call pairs_drop_far(self%pair, self%master, self%start(e), n, x, u0)

   contains

      !> The nodes of an edge, behind `n_before` others: where they start, relative to the node
      !> `origin`, and how they move.
      pure subroutine place_edge(node, origin, n_before, at, displacement)
         integer, intent(in) :: node(:)          !! of the edge
         integer, intent(in) :: origin, n_before
         real(wp), intent(inout) :: at(:, :), displacement(:, :) !! (n_dim, >= n_before + nodes) [L]
         integer :: i

         do i = 1, size(node)
            associate (j => n_before + i, a => node(i))
               at(:, j) = (x(:, a) - x(:, origin)) + (u0(:, a) - u0(:, origin))
               displacement(:, j) = du(:, a)
            end associate
         end do
      end subroutine place_edge

   end subroutine choose_pairs

   pure subroutine mortar_measure_edges(self, x, u0, du)
      class(mortar_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      type(frame_t) :: frame(0:1)
      real(wp), dimension(size(x, 1), n_place) :: local, dlocal
      real(wp) :: part(n_moment, 0:1), eta, gap
      integer :: e, k, i

      do e = 1, self%slave%n_facet
         self%form(e)%ahead = 0.0_wp
         associate (value => self%form(e)%value, ahead => self%form(e)%ahead, &
               other_size => self%form(e)%other_size)
            value = 0.0_wp
            other_size = huge(other_size)
            do k = self%start(e), self%start(e + 1) - 1
               call stencil_gather(self%pair(k), x, u0, du, local, dlocal)
               do i = 0, 1
                  call frame_init(frame(i), self%pair(k), local + i*dlocal)
                  part(:, i) = moments_of(self, e, k, frame(i), .false.)
               end do
               value = value + part
               if (any(part(moment_cover, :) > 0.0_wp)) other_size = min(other_size, &
                  self%master%size(self%pair(k)%edge))
               if (part(moment_cover, 0) > 0.0_wp .or. .not. part(moment_cover, 1) > 0.0_wp) cycle
               ! On the line of the master edge, in the middle of what it comes to cover.
               call frame_hit(frame(0), self%pair(k), &
                  part(moment_area_xi, 1)/part(moment_area, 1), eta, gap)
               ahead = min(ahead, gap - self%offset)
            end do
         end associate
      end do
   end subroutine mortar_measure_edges

   !> Weight of Gauss point `i` of edge `e` that belongs to pair `k`: all, half or none.
   pure real(wp) function share(self, i, e, k)
      type(mortar_t), intent(in) :: self
      integer, intent(in) :: i, e, k

      share = 0.0_wp
      associate (seen => self%seen(:, i, e))
         if (any(seen == k - self%start(e) + 1)) share = self%weight(i)/count(seen > 0)
      end associate
   end function share

   pure subroutine mortar_form_edge(self, e, x, u0, du)
      class(mortar_t), intent(inout) :: self
      integer, intent(in) :: e                   !! slave edge
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp) :: local(2, n_place), dlocal(2, n_place)
      integer :: k, i, variable(2, 2:n_place)

      call begin_form(self, e)
      do k = self%start(e), self%start(e + 1) - 1
         call stencil_gather(self%pair(k), x, u0, du, local, dlocal)
         associate (form => self%form(e), node => self%pair(k)%node)
            do i = 2, n_place
               variable(:, i) = 0
               if (node(i) > 0) variable(:, i) = 2*findloc(form%node(2:form%n_node), node(i), 1) &
                  - [1, 0]
            end do
         end associate
         if (self%options%integration == integration_elements) then
            call add_points(self, e, k, local, dlocal, pack(variable, .true.))
         else
            call add_segment(self, e, k, local, dlocal, pack(variable, .true.))
         end if
      end do
   end subroutine mortar_form_edge

   !> List the nodes of the pairs of slave edge `e`, slave nodes first.
   pure subroutine begin_form(self, e)
      type(mortar_t), intent(inout) :: self
      integer, intent(in) :: e
      integer :: list(n_place*(self%start(e + 1) - self%start(e)) + 2), n, n_slave, k

      list(:2) = self%slave%facet(:, e)
      n = 2
      do k = self%start(e), self%start(e + 1) - 1
         call nodes_append(self%pair(k)%node([place_before, place_after]), list, n)
      end do
      n_slave = n
      do k = self%start(e), self%start(e + 1) - 1
         call nodes_append(self%pair(k)%node(local_master), list, n)
      end do
      call form_begin(self%form(e), list(:n), n_slave, self%leaves_second)
   end subroutine begin_form

   !> Add the moments of the segment of pair `k` to those of slave edge `e`.
   pure subroutine add_segment(self, e, k, local, dlocal, variable)
      type(mortar_t), intent(inout) :: self
      integer, intent(in) :: e, k, variable(:)
      real(wp), intent(in) :: local(:, :), dlocal(:, :)

      associate (pair => self%pair(k), point => self%point, weight => self%weight, &
            moment => self%form(e)%moment, is_short => self%pair(k)%n_master == 2)
         if (is_short .and. self%leaves_second) then
            call segment_add2_first(pair, local, dlocal, point, weight, variable, moment)
         else if (is_short) then
            call segment_add2(pair, local, dlocal, point, weight, variable, moment)
         else if (self%leaves_second) then
            call segment_add4_first(pair, local, dlocal, point, weight, variable, moment)
         else
            call segment_add4(pair, local, dlocal, point, weight, variable, moment)
         end if
      end associate
   end subroutine add_segment

   !> Add the moments of the Gauss points of slave edge `e` that look at pair `k`.
   pure subroutine add_points(self, e, k, local, dlocal, variable)
      type(mortar_t), intent(inout) :: self
      integer, intent(in) :: e, k, variable(:)
      real(wp), intent(in) :: local(:, :), dlocal(:, :)
      real(wp) :: weight
      integer :: i

      do i = 1, size(self%point)
         weight = share(self, i, e, k)
         if (.not. weight > 0.0_wp) cycle
         associate (pair => self%pair(k), xi => self%point(i), moment => self%form(e)%moment)
            if (self%leaves_second) then
               call point_add_first(pair, local, dlocal, xi, weight, variable, moment)
            else
               call point_add(pair, local, dlocal, xi, weight, variable, moment)
            end if
         end associate
      end do
   end subroutine add_points

end module emcon_mortar
