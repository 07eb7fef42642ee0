!> Node-to-segment contact: one constraint per slave node, gap over the nearest master edge.
!>
!> The master surface is a polygon, or smoothed. A surface may be in contact with itself.
!> Source: docs/theory.md, section 4.
module emcon_nts
   use emcon_arcs_plane, only : arc_height, arcs_find
   use emcon_chain_plane, only : chain_corners, chain_tributary
   use emcon_constraint, only : condition_t
   use emcon_contact, only : gap_state_t
   use emcon_contact_law_registry, only : contact_laws_of_surface
   use emcon_errors, only : error_t
   use emcon_guard_slack_plane, only : guard_slack_find
   use emcon_hermite_gap_value, only : hermite_gap_value, hermite_slip_value
   use emcon_interactions, only : contact_options_t, contact_pair_t, smoothing_hermite, &
      smoothing_none
   use emcon_kinds, only : wp
   use emcon_nts_choice, only : choice_covers, choice_init, update_candidates, choice_make, &
      choice_pushes_aside, choice_settle, choice_take_nearer, nts_choice_t
   use emcon_nts_constraint, only : polygon_constraint, smooth_constraint
   use emcon_nts_gap_value, only : nts_gap_value
   use emcon_nts_stencil, only : most_nodes, stencil_gather, stencil_length
   use emcon_polygon_slip_plane, only : polygon_slip_over
   use emcon_polygon_stencil_plane, only : polygon_slip
   use emcon_position_memo, only : position_memo_holds, position_memo_t, position_memo_take
   use emcon_scene, only : scene_t
   use emcon_slip_point, only : slip_list_t
   implicit none
   private
   public :: nts_t, nts_init, nts_nearest

   !> So far past the end of a surface, per edge, a node is still over it: a node that meets the end
   !> exactly (as on a plane of symmetry) must not be lost to round-off.
   real(wp), parameter :: end_tol = 1.0e-3_wp
   !> A node counts as outside at the start of a step down to this fraction of a master edge: by
   !> about as much gaps may change where edges are chosen anew, and no overlap is told of less.
   real(wp), parameter :: touch_tol = 1.0e-3_wp

   !> A gap over a polygon as a step begins.
   type :: start_gap_t
      type(gap_state_t) :: state                      !! without what the end of the step tells
      real(wp) :: xi = 0.0_wp                         !! projection on the edge
   end type start_gap_t

   type, extends(nts_choice_t) :: nts_t
      real(wp), allocatable :: own_slack(:)           !! (n_node of the slave) only of a guard
      type(position_memo_t) :: position_memo          !! of the nodes as stencils were chosen:
      real(wp) :: chosen_reach = 0.0_wp               !! among edges up to there [L],
      logical :: were_sharp = .false.                 !! with which corners,
      type(start_gap_t), allocatable :: start(:)      !! (n_constraint) and gaps if not smoothed
      real(wp), allocatable :: curvature(:)           !! (n_edge) of the arcs of the master if gaps
                                                      !! are measured to these [1/L]
      logical, allocatable :: is_lost(:)              !! (n_constraint) no unique closest point when
                                                      !! last evaluated, since the last measurement
   contains
      procedure :: begin_points => nts_begin_step
      procedure :: configure => nts_configure
      procedure :: follow_arcs => nts_follow_arcs
      procedure :: measure_points => nts_measure
      procedure :: evaluate_points => nts_evaluate
      procedure :: covers_points => nts_covers
      procedure :: area_points => nts_area
      procedure :: slip_points => nts_slip
      procedure :: stands_over
      procedure :: slips_by
   end type nts_t

contains

   !> Set up the pair `pair` of `scene`.
   subroutine nts_init(self, scene, pair, error, has_twins)
      type(nts_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in), optional :: has_twins !! both nodes of a joint have a gap: as parts of
                                                 !! other constraints

      call choice_init(self, scene, pair, error, has_twins)
      if (allocated(error)) return
      allocate(self%state(self%n_constraint), self%start(self%n_constraint))
      allocate(self%sagitta(self%n_constraint), source=0.0_wp)
      self%max_penetration_at_start = touch_tol
      self%slack = pair%slack
      if (pair%slack > 0.0_wp) call guard_slack_find(self%slave, scene%x, pair%slack, &
         self%own_slack)
      call contact_laws_of_surface(pair%interaction, self%laws)
   end subroutine nts_init

   pure subroutine nts_configure(self, x, options)
      class(nts_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (2, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options

      self%position_memo%is_known = .false.
      self%smoothing = options%smoothing
      if (self%slack > 0.0_wp) self%smoothing = smoothing_none       ! guards watch the mesh
      self%may_sharpen = self%smoothing /= smoothing_hermite
      if (self%may_sharpen) return
      if (.not. allocated(self%smooth)) then
         allocate(self%is_corner(self%master%n_facet), self%smooth(self%n_constraint))
         allocate(self%is_lost(self%n_constraint), source=.false.)
      end if
      call chain_corners(self%master, x, options%smoothing_angle, self%is_corner)
   end subroutine nts_configure

   !> A smoothed master has its own curve in place of arcs.
   pure subroutine nts_follow_arcs(self, x, options, is_wanted)
      class(nts_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (2, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options
      logical, intent(in) :: is_wanted           !! else between edges

      self%position_memo%is_known = .false.
      self%sagitta = 0.0_wp
      if (allocated(self%curvature)) deallocate(self%curvature)
      if (.not. is_wanted .or. self%smoothing == smoothing_hermite) return
      allocate(self%curvature(self%master%n_facet))
      call arcs_find(self%master, x, options%smoothing_angle, self%curvature)
   end subroutine nts_follow_arcs

   !> Choose for each slave node the nearest master edge at the start of the step. From the same
   !> start and up to the same reach the choice is the same.
   pure subroutine nts_begin_step(self, x, u0, du)
      class(nts_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      integer :: i

      call update_candidates(self, x, u0, du)
      if (abs(self%chosen_reach - self%reach) <= 0.0_wp .and. &
         (self%were_sharp .eqv. self%step%is_sharp)) then
         if (position_memo_holds(self%position_memo, self%near%node, x, u0)) return
      end if
      call position_memo_take(self%position_memo, self%near%node, x, u0)
      self%chosen_reach = self%reach
      self%were_sharp = self%step%is_sharp
      do i = 1, self%n_constraint
         call choice_make(self, i, x, u0)
         if (allocated(self%curvature)) self%sagitta(i) = sagitta_under(self, i, x, u0)
         if (self%smoothing /= smoothing_hermite) self%start(i) = polygon_start(self, i, x, u0)
      end do
   end subroutine nts_begin_step

   !> How much higher the arc of the master is than its edge where node `i` stands.
   pure real(wp) function sagitta_under(self, i, x, u0) result(sagitta)
      type(nts_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)
      real(wp), dimension(size(x, 1), 3) :: local, dlocal
      real(wp) :: gap, xi

      sagitta = 0.0_wp
      if (self%edge(i) == 0) return
      if (any(abs(self%polygon(1, i)%round%bend) > 0.0_wp)) return
      associate (length => self%master%size(self%edge(i)))
         call stencil_gather(x, u0, u0, 3, self%polygon(1, i)%node, local, dlocal)
         call nts_gap_value(local, 0, 0, self%polygon(1, i)%rounding, gap, xi)
         sagitta = arc_height(self%curvature(self%edge(i)), length, (xi - 0.5_wp)*length, gap)
      end associate
   end function sagitta_under

   pure subroutine nts_measure(self, x, u0, du)
      class(nts_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      logical :: is_at_rest
      integer :: i

      if (.not. position_memo_holds(self%position_memo, self%near%node, x, u0)) then
         self%position_memo%is_known = .false.
         do i = 1, self%n_constraint
            if (self%smoothing /= smoothing_hermite) self%start(i) = polygon_start(self, i, x, u0)
         end do
      end if
      is_at_rest = nothing_moves(self%near%node, du) .and. self%smoothing /= smoothing_hermite
      do i = 1, self%n_constraint
         if (is_at_rest) then
            self%state(i) = state_at_rest(self, i)
         else
            self%state(i) = gap_state(self, i, x, u0, du)
         end if
      end do
      if (self%smoothing /= smoothing_hermite) return
      self%state%is_covered = self%state%is_covered .and. .not. self%is_lost
      self%is_lost = .false.
   end subroutine nts_measure

   !> Do the nodes `node` stay where they are?
   pure logical function nothing_moves(node, du)
      integer, intent(in) :: node(:)             !! of the scene
      real(wp), intent(in), contiguous :: du(:, :)   !! (n_dim, n_node) [L]
      integer :: k

      nothing_moves = .false.
      do k = 1, size(node)
         if (any(abs(du(:, node(k))) > 0.0_wp)) return
      end do
      nothing_moves = .true.
   end function nothing_moves

   !> The gap over a polygon in a step without motion: it ends as it began.
   pure function state_at_rest(self, i) result(state)
      type(nts_t), intent(in) :: self
      integer, intent(in) :: i
      type(gap_state_t) :: state

      if (self%edge(i) == 0) return
      state = self%start(i)%state
      state%gap1 = state%gap0
      state%is_over = is_over(state, self%start(i)%xi, self%start(i)%xi, &
         self%polygon(1, i)%goes_on)
   end function state_at_rest

   !> What a gap over a polygon is as a step begins.
   pure function polygon_start(self, i, x, u0) result(start)
      type(nts_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)
      type(start_gap_t) :: start
      real(wp) :: local(2, 5), dlocal(2, 5)

      if (self%edge(i) == 0) return
      associate (stencil => self%polygon(1, i), state => start%state)
         call stencil_gather(x, u0, u0, stencil%n, stencil%node, local, dlocal)
         call nts_gap_value(local(:, :stencil%n), stencil%before, stencil%after, &
            stencil%rounding, state%gap0, start%xi, stencil%round)
         state%gap0 = state%gap0 - self%offset - self%sagitta(i)
         state%size = stencil_length(x, stencil%node)
         state%other_size = self%own_size(i)
         if (allocated(self%own_slack)) state%closed = -min(state%size, self%own_size(i)) &
            *merge(self%slack, self%own_slack(self%chain_node(i)), self%step%has_compliance)
         state%is_near = .true.
      end associate
   end function polygon_start

   !> Where the smoothed surface has no unique closest point its polygon gives the gap, and the
   !> stencil does not hold: a step in which the node is to act is cut.
   pure function gap_state(self, i, x, u0, du) result(state)
      type(nts_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      type(gap_state_t) :: state
      logical :: is_found

      if (self%edge(i) == 0) return
      if (self%smoothing == smoothing_hermite) then
         call smooth_state(self, i, x, u0, du, state, is_found)
         if (is_found) return
      end if
      if (self%smoothing == smoothing_hermite) then
         state = polygon_state(self, i, polygon_start(self, i, x, u0), x, u0, du)
         state%is_covered = .false.
      else
         state = polygon_state(self, i, self%start(i), x, u0, du)
      end if
   end function gap_state

   pure function polygon_state(self, i, start, x, u0, du) result(state)
      type(nts_t), intent(in) :: self
      integer, intent(in) :: i
      type(start_gap_t), intent(in) :: start
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      type(gap_state_t) :: state
      real(wp) :: xi1

      state = start%state
      call polygon_end(self, i, x, u0, du, state%gap1, xi1)
      state%is_over = is_over(state, start%xi, xi1, self%polygon(1, i)%goes_on)
      if (state%gap1 > end_tol*state%size) return
      state%is_leaving = choice_pushes_aside(self, i, x, u0, du)
      state%is_over = state%is_over .and. .not. state%is_leaving
   end function polygon_state

   !> Gap of constraint `i` over its polygon after the motion `du`, and the projection on its edge.
   pure subroutine polygon_end(self, i, x, u0, du, gap, xi)
      type(nts_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp), intent(out) :: gap, xi
      real(wp) :: local(2, 5), dlocal(2, 5)
      integer :: k

      associate (stencil => self%polygon(1, i), n => self%polygon(1, i)%n)
         call stencil_gather(x, u0, du, n, stencil%node, local, dlocal)
         do k = 1, n
            local(:, k) = local(:, k) + (dlocal(:, k) - dlocal(:, 2))
         end do
         call nts_gap_value(local(:, :n), stencil%before, stencil%after, stencil%rounding, gap, &
            xi, stencil%round)
         gap = gap - self%offset - self%sagitta(i)
      end associate
   end subroutine polygon_end

   !> Over polygons only those are asked for that act or begin to: the edges around are looked at
   !> here, not for each gap that is measured.
   pure logical function nts_covers(self, i, x, u0, du) result(covers)
      class(nts_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      real(wp) :: gap, xi

      covers = self%state(i)%is_covered
      if (self%edge(i) == 0 .or. self%smoothing == smoothing_hermite) return
      call polygon_end(self, i, x, u0, du, gap, xi)
      if (xi < 0.0_wp .or. xi > 1.0_wp) covers = choice_covers(self, i, self%edge(i), x, u0, du)
      if (self%other(i) > 0 .and. covers) covers = choice_covers(self, i, self%other(i), x, u0, du)
   end function nts_covers

   pure subroutine smooth_state(self, i, x, u0, du, state, is_found)
      type(nts_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      type(gap_state_t), intent(out) :: state
      logical, intent(out) :: is_found
      real(wp) :: local(2, most_nodes), dlocal(2, most_nodes), place(3), xi0
      integer :: k

      associate (n => self%smooth(i)%n, node => self%smooth(i)%node, &
            curve => self%smooth(i)%curve, xi1 => place(1))
         call stencil_gather(x, u0, du, n, node, local, dlocal)
         place = self%smooth(i)%place
         call hermite_gap_value(curve, local(:, :n), place, state%gap0, is_found)
         if (.not. is_found) return
         xi0 = place(1)
         do k = 1, n
            local(:, k) = local(:, k) + (dlocal(:, k) - dlocal(:, 2))
         end do
         call hermite_gap_value(curve, local(:, :n), place, state%gap1, is_found)
         if (.not. is_found) return
         state%gap0 = state%gap0 - self%offset
         state%gap1 = state%gap1 - self%offset
         state%size = stencil_length(x, node)
         state%other_size = self%own_size(i)
         state%is_near = .true.
         state%is_over = is_over(state, xi0, xi1, curve%node([2, 5]) > 0 .and. &
            (curve%has_neighbour .or. .not. curve%is_corner([3, 4])))
         ! The curve goes on over one edge on either side, unless a corner or an end is there.
         state%is_covered = (xi1 >= -1.0_wp .or. curve%node(1) == 0 .or. curve%is_corner(3)) .and. &
            (xi1 <= 2.0_wp .or. curve%node(6) == 0 .or. curve%is_corner(4))
         if (state%is_covered .and. (xi1 < 0.0_wp .or. xi1 > 1.0_wp)) then
            state%is_covered = choice_covers(self, i, self%edge(i), x, u0, du)
         end if
      end associate
   end subroutine smooth_state

   !> Is a node over the surface, from `xi0` to `xi1` along its edge, where the gap closes, or else
   !> at the start?
   pure logical function is_over(state, xi0, xi1, goes_on)
      type(gap_state_t), intent(in) :: state
      real(wp), intent(in) :: xi0, xi1
      logical, intent(in) :: goes_on(2)          !! does the surface go on before, after the edge?
      real(wp) :: xi

      xi = xi0
      if (state%gap1 < 0.0_wp .and. state%gap0 > 0.0_wp) then
         xi = xi0 + (state%gap0/(state%gap0 - state%gap1))*(xi1 - xi0)
      end if
      is_over = (goes_on(1) .or. xi >= -end_tol) .and. (goes_on(2) .or. xi <= 1.0_wp + end_tol)
   end function is_over

   pure subroutine nts_evaluate(self, wanted, x, u0, du, target, item)
      class(nts_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)           !! (n) numbers of constraints, ascending
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp), intent(in) :: target(:)          !! (n) [L]
      type(condition_t), intent(inout) :: item(:)   !! (n)
      integer :: k
      logical :: is_found

      do k = 1, size(wanted)
         if (self%smoothing == smoothing_hermite) then
            call smooth_constraint(self%smooth(wanted(k)), x, u0, du, target(k) + self%offset, &
               item(k), is_found)
            self%is_lost(wanted(k)) = .not. is_found
            if (is_found) cycle
         end if
         ! One polygon, or two over a corner.
         associate (n => merge(2, 1, self%other(wanted(k)) > 0))
            call polygon_constraint(self%polygon(:n, wanted(k)), x, u0, du, &
               target(k) + self%offset + self%sagitta(wanted(k)), item(k))
         end associate
      end do
   end subroutine nts_evaluate

   !> As `contact_t` has it: by the places on the line of the edge at both ends of the step, or on
   !> the smoothed surface, if that has a closest point at both.
   pure function nts_slip(self, i, x, u0, du) result(slip)
      class(nts_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp) :: slip(size(x, 1) - 1)           !! (1) [L]
      real(wp), dimension(size(x, 1), most_nodes) :: local, dlocal
      integer :: k, n
      logical :: is_found

      slip = 0.0_wp
      if (self%edge(i) == 0) return
      if (self%smoothing == smoothing_hermite) then
         associate (smooth => self%smooth(i))
            n = smooth%n
            call stencil_gather(x, u0, du, n, smooth%node, local, dlocal)
            call hermite_slip_value(smooth%curve, local(:, :n), dlocal(:, :n), smooth%place(1), &
               slip(1), is_found)
         end associate
         if (is_found) return
      end if
      n = 1
      if (self%other(i) > 0) n = size(self%polygon, 1)
      do k = 1, n
         slip = slip + polygon_slip_over(self%polygon(k, i), 1.0_wp/n, x, u0, du)
      end do
   end function nts_slip

   !> Is the node of constraint `i` over the polygon as the step begins?
   pure logical function stands_over(self, i)
      class(nts_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      type(gap_state_t) :: state

      state = state_at_rest(self, i)
      stands_over = state%is_near .and. state%is_over
   end function stands_over

   !> Append what constraint `i` slides by, if it is near the surface.
   pure subroutine slips_by(self, i, list)
      class(nts_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      type(slip_list_t), intent(inout) :: list
      integer :: k, n

      if (self%edge(i) == 0) return
      n = 1
      if (self%other(i) > 0) n = size(self%polygon, 1)
      do k = 1, n
         list%point = [list%point, polygon_slip(self%polygon(k, i), 1.0_wp/n)]
      end do
   end subroutine slips_by

   pure subroutine nts_area(self, x, u, area, length)
      class(nts_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (2, n_node) [L]
      real(wp), intent(out) :: area(:)           !! (n_constraint) [L^2]
      real(wp), intent(out) :: length(:)         !! (n_constraint) [L]
      real(wp) :: at_node(size(self%slave%node))

      at_node = 0.0_wp
      if (self%slave%n_facet > 0) call chain_tributary(self%slave, x, u, at_node)
      length = at_node(self%chain_node)
      area = length*self%thickness
   end subroutine nts_area

   !> Gap at x + u of slave node `i` over the nearest master edge, searched among all edges.
   !> For checks before the first step only. `is_over`: not past an end of the surface.
   pure subroutine nts_nearest(self, i, x, u, still, gap, is_over)
      type(nts_t), intent(inout) :: self
      integer, intent(in) :: i                   !! slave node, index into `node`
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (2, n_node) [L]
      real(wp), intent(in), contiguous :: still(:, :)        !! (2, n_node) zeros [L]
      real(wp), intent(out) :: gap               !! [L]
      logical, intent(out) :: is_over            !! .false. also if there is no edge
      real(wp) :: best
      type(gap_state_t) :: state
      integer :: e

      best = huge(best)
      self%edge(i) = 0
      do e = 1, self%master%n_facet
         call choice_take_nearer(self, i, e, x, u, best)
      end do
      call choice_settle(self, i, x, u)
      self%position_memo%is_known = .false.
      self%start(i) = polygon_start(self, i, x, u)
      state = gap_state(self, i, x, u, still)
      gap = state%gap0
      is_over = state%is_over
   end subroutine nts_nearest

end module emcon_nts
