!> Segment contact: gaps of the slave nodes, interpolated on each slave edge and integrated with the
!> multiplier basis.
!>
!> It stands between node to segment, whose gaps it takes, and mortar, whose constraints it makes.
!> Source: docs/theory.md, eq. (15i); paper, section 2 ("several extensions").
module emcon_segment
   use emcon_condition_nodes, only : nodes_append
   use emcon_constraint, only : condition_t
   use emcon_dgrad8, only : dg_dot, dg_sqrt, dg_t, difference
   use emcon_dgrad_wide, only : change_t, wide_add, wide_add_part, wide_add_product, wide_clear
   use emcon_edge_moments, only : form_begin
   use emcon_errors, only : error_t
   use emcon_integrated_gap, only : integrated_gap_init, integrated_gap_slips, integrated_gap_t
   use emcon_interactions, only : contact_options_t, contact_pair_t, multiplier_dual
   use emcon_kinds, only : wp
   use emcon_mortar_frame, only : moment_area, moment_area_xi, moment_cover, moment_gap, &
      moment_gap_xi, n_moment
   use emcon_nts, only : nts_init, nts_t
   use emcon_scene, only : scene_t
   use emcon_slip_point, only : slip_list_t
   implicit none
   private
   public :: segment_t, segment_init

   !> What is left of weights that cancel.
   real(wp), parameter :: noise = 16.0_wp*epsilon(1.0_wp)

   type, extends(integrated_gap_t) :: segment_t
      type(nts_t) :: nts                              !! gaps of the nodes
      integer, allocatable :: end_node(:, :)          !! (2, n_edge) nodes as numbers in `nts`
      type(condition_t) :: nodal(2)                  !! of one edge
   contains
      procedure :: configure => segment_configure
      procedure :: follow_arcs => segment_follow_arcs
      procedure :: begin_points => segment_begin_step
      procedure :: covers_points => segment_covers
      procedure :: choose_slip => segment_choose_slip
      procedure :: measure_edges => segment_measure_edges
      procedure :: form_edge => segment_form_edge
   end type segment_t

contains

   !> Set up the pair `pair` of `scene`.
   subroutine segment_init(self, scene, pair, error)
      type(segment_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error
      integer :: e, k

      call integrated_gap_init(self, scene, pair, error)
      if (allocated(error)) return
      call nts_init(self%nts, scene, pair, error, has_twins=.true.)
      if (allocated(error)) return
      self%nts%offset = 0.0_wp                       ! it is taken off the means
      allocate(self%end_node(2, self%slave%n_facet))
      do e = 1, self%slave%n_facet
         do k = 1, 2
            self%end_node(k, e) = findloc(self%nts%node, self%slave%facet(k, e), 1)
         end do
      end do
   end subroutine segment_init

   pure subroutine segment_configure(self, x, options)
      class(segment_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (2, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options

      self%is_dual = options%multiplier == multiplier_dual
      call self%nts%configure(x, options)
      self%may_sharpen = self%nts%may_sharpen
   end subroutine segment_configure

   !> Slave nodes stand on their arcs: what rises is under the nodal gaps.
   pure subroutine segment_follow_arcs(self, x, options, is_wanted)
      class(segment_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (2, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options
      logical, intent(in) :: is_wanted           !! else between edges

      call self%nts%follow_arcs(x, options, is_wanted)
   end subroutine segment_follow_arcs

   pure subroutine segment_begin_step(self, x, u0, du)
      class(segment_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]

      self%nts%reach = self%reach
      self%nts%rounding = self%rounding
      self%nts%step%is_sharp = self%step%is_sharp
      self%nts%meets_statics = self%meets_statics
      call self%nts%begin_points(x, u0, du)
      call integrated_gap_slips(self, x, u0, du)
      self%reach = self%nts%reach
      call self%has_looked(self%nts%near%clearance)
   end subroutine segment_begin_step

   !> The mean of slips of its own node and of the other ends of its edges, as their gaps are in its
   !> own; where none is over the surface, of what is near.
   pure subroutine segment_choose_slip(self, i, x, u0, du, list)
      class(segment_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      type(slip_list_t), intent(inout) :: list
      !> Of both edges: its own node, two at a joint, and the other one, with their parts
      integer, dimension(size(self%node_edge, 1)) :: own, other
      real(wp), dimension(size(own)) :: own_part, other_part, part
      integer :: side, j

      own = 0
      other = 0
      own_part = 0.0_wp
      other_part = 0.0_wp
      do side = 1, size(own)
         associate (e => self%node_edge(3 - side, i))
            if (e == 0) cycle
            own(side) = self%end_node(side, e)
            other(side) = self%end_node(3 - side, e)
            part = self%slave%size(e)*gap_parts(weights([(self%nts%stands_over( &
               self%end_node(j, e)), j = 1, size(part))]), side, self%is_dual)
            own_part(side) = part(side)
            other_part(side) = part(3 - side)
         end associate
      end do
      if (own(1) == own(size(own))) then
         own_part(1) = sum(own_part)
         own(size(own)) = 0
      end if
      call take(self%nts, [own, other], [own_part, other_part], list)
   end subroutine segment_choose_slip

   !> The slips of nodes by their parts; if there are none of all that are near.
   pure subroutine take(nts, node, part, list)
      type(nts_t), intent(in) :: nts
      integer, intent(in) :: node(:)             !! numbers in `nts`; 0: none
      real(wp), intent(in) :: part(:)            !! (as many) >= 0 but for noise
      type(slip_list_t), intent(inout) :: list
      integer :: k, n
      logical :: is_any

      is_any = any(part > 0.0_wp)
      do k = 1, size(node)
         if (node(k) == 0 .or. (is_any .and. part(k) <= noise*maxval(part))) cycle
         n = size(list%point)
         call nts%slips_by(node(k), list)
         if (is_any) list%point(n + 1:)%weight = part(k)*list%point(n + 1:)%weight
      end do
   end subroutine take

   !> The weights of an edge's nodal gaps in the gap of its node `side`, as `form_share` has them.
   pure function gap_parts(w, side, is_dual) result(part)
      real(wp), intent(in) :: w(:, :)            !! (n_moment, 2) of `weights`
      integer, intent(in) :: side                !! 1, 2
      logical, intent(in) :: is_dual             !! multiplier basis
      real(wp) :: part(size(w, 2)), skew(size(w, 2))

      skew = w(moment_gap, :) - 2.0_wp*w(moment_gap_xi, :)
      part = w(moment_gap_xi, :)
      if (side == 1) part = part + skew
      if (is_dual) part = part + merge(1.0_wp, -1.0_wp, side == 1)*sum(w(moment_cover, :))**2*skew
   end function gap_parts

   !> The weights of an edge's nodal gaps in the moments, in units of its length: docs/theory.md,
   !> eq. (15i).
   pure function weights(is_over) result(w)
      logical, intent(in) :: is_over(2)          !! is the node over the master surface?
      real(wp) :: w(n_moment, 2)

      w = 0.0_wp
      if (all(is_over)) then
         w(moment_gap, :) = 0.5_wp
         w(moment_gap_xi, :) = [1.0_wp, 2.0_wp]/6.0_wp
         w(moment_cover, :) = 0.5_wp
      else
         ! What is left of the edge belongs to its node over the surface.
         w(moment_gap, :) = merge(0.5_wp, 0.0_wp, is_over)
         if (is_over(2)) w(moment_gap_xi, 2) = 0.5_wp
      end if
      w(moment_area, :) = w(moment_gap, :)
      w(moment_area_xi, :) = w(moment_gap_xi, :)
   end function weights

   pure logical function is_over(self, i)
      type(segment_t), intent(in) :: self
      integer, intent(in) :: i

      is_over = self%nts%state(i)%is_near .and. self%nts%state(i)%is_over
   end function is_over

   !> The stencils of all nodal gaps that a constraint is made of must hold at the end.
   pure logical function segment_covers(self, i, x, u0, du) result(covers)
      class(segment_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      integer :: k, j

      covers = self%state(i)%is_covered
      do k = 1, 2
         associate (e => self%node_edge(k, i))
            if (e == 0) cycle
            do j = 1, size(self%end_node, 1)
               if (covers) covers = self%nts%covers_points(self%end_node(j, e), x, u0, du)
            end do
         end associate
      end do
   end function segment_covers

   pure subroutine segment_measure_edges(self, x, u0, du)
      class(segment_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp) :: w(n_moment, 2), a(2), b(2), length(0:1)
      integer :: e, k

      call self%nts%measure_points(x, u0, du)
      do e = 1, self%slave%n_facet
         associate (value => self%form(e)%value, node => self%slave%facet(:, e), &
               i => self%end_node(:, e))
            value = 0.0_wp
            w = weights([is_over(self, i(1)), is_over(self, i(2))])
            self%form(e)%other_size = huge(1.0_wp)
            if (all(w <= 0.0_wp)) cycle
            a = (x(:, node(2)) - x(:, node(1))) + (u0(:, node(2)) - u0(:, node(1)))
            b = a + (du(:, node(2)) - du(:, node(1)))
            length = [sqrt(dot_product(a, a)), sqrt(dot_product(b, b))]
            do k = 1, 2
               if (is_over(self, i(k))) self%form(e)%other_size = &
                  min(self%form(e)%other_size, self%nts%state(i(k))%size)
               associate (gap => [self%nts%state(i(k))%gap0, self%nts%state(i(k))%gap1])
                  value(moment_gap, :) = value(moment_gap, :) + w(moment_gap, k)*length*gap
                  value(moment_gap_xi, :) = value(moment_gap_xi, :) + w(moment_gap_xi, k)*length*gap
               end associate
               value(moment_area, :) = value(moment_area, :) + w(moment_area, k)*length
               value(moment_area_xi, :) = value(moment_area_xi, :) + w(moment_area_xi, k)*length
               value(moment_cover, :) = value(moment_cover, :) + w(moment_cover, k)
            end do
         end associate
      end do
   end subroutine segment_measure_edges

   pure subroutine segment_form_edge(self, e, x, u0, du)
      class(segment_t), intent(inout) :: self
      integer, intent(in) :: e                   !! slave edge
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp) :: w(n_moment, 2)
      logical :: is_there(2)
      integer :: k

      is_there = [is_over(self, self%end_node(1, e)), is_over(self, self%end_node(2, e))]
      w = weights(is_there)
      do k = 1, 2
         self%nodal(k)%n_node = 0
         self%nodal(k)%leaves_second = self%leaves_second
         if (is_there(k)) call self%nts%evaluate_points([self%end_node(k, e)], x, u0, du, &
            [0.0_wp], self%nodal(k:k))
      end do
      call begin_form(self, e)
      associate (form => self%form(e), length => self%work(1), gap => self%work(2))
         call edge_length(self, e, x, u0, du)
         do k = 1, 2
            if (.not. is_there(k)) cycle
            call spread_gap(self, e, k)
            call wide_add_product(form%moment(moment_gap), w(moment_gap, k), length, gap)
            call wide_add_product(form%moment(moment_gap_xi), w(moment_gap_xi, k), length, gap)
            call wide_add(form%moment(moment_area), w(moment_area, k), length)
            call wide_add(form%moment(moment_area_xi), w(moment_area_xi, k), length)
            form%moment(moment_cover)%f0 = form%moment(moment_cover)%f0 + w(moment_cover, k)
            form%moment(moment_cover)%f1 = form%moment(moment_cover)%f1 + w(moment_cover, k)
         end do
      end associate
   end subroutine segment_form_edge

   !> List the nodes that the gaps of edge `e` depend on.
   pure subroutine begin_form(self, e)
      type(segment_t), intent(inout) :: self
      integer, intent(in) :: e
      integer :: list(2 + sum(self%nodal%n_node)), n, k

      list(:2) = self%slave%facet(:, e)
      n = 2
      do k = 1, 2
         call nodes_append(self%nodal(k)%node(2:self%nodal(k)%n_node), list, n)
      end do
      call form_begin(self%form(e), list(:n), 2, self%leaves_second)
   end subroutine begin_form

   !> Length of edge `e` into the first work space.
   pure subroutine edge_length(self, e, x, u0, du)
      type(segment_t), intent(inout) :: self
      integer, intent(in) :: e
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      type(dg_t) :: length
      real(wp) :: local(2, 2)

      associate (node => self%slave%facet(:, e))
         local(:, 1) = 0.0_wp
         local(:, 2) = (x(:, node(2)) - x(:, node(1))) + (u0(:, node(2)) - u0(:, node(1)))
         length = dg_sqrt(dg_dot(difference(2, 1, local, du(:, node)), &
            difference(2, 1, local, du(:, node))))
      end associate
      call wide_clear(self%work(1), 2*(self%form(e)%n_node - 1), self%leaves_second)
      call wide_add_part(self%work(1), 1.0_wp, &
         change_t(length%f0, length%f1, length%df), length%g, length%c, length%h, [1, 2])
   end subroutine edge_length

   !> Gap of the node `k` of edge `e` into the second work space.
   pure subroutine spread_gap(self, e, k)
      type(segment_t), intent(inout) :: self
      integer, intent(in) :: e, k
      integer :: i

      associate (form => self%form(e), gap => self%nodal(k))
         call wide_clear(self%work(2), 2*(form%n_node - 1), self%leaves_second)
         associate (place => [(findloc(form%node(2:form%n_node), gap%node(i), 1), &
               i = 1, gap%n_node)])
            call wide_add_part(self%work(2), 1.0_wp, change_t(gap%gap0, gap%gap1, gap%dgap), &
               reshape(gap%g(:, :gap%n_node), [2*gap%n_node]), &
               reshape(gap%c(:, :gap%n_node), [2*gap%n_node]), gap%h, &
               [(max(0, 2*place((i + 1)/2) - mod(i, 2)), i = 1, 2*gap%n_node)])
         end associate
      end associate
   end subroutine spread_gap

end module emcon_segment
