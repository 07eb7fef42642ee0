!> Node-to-segment contact: one constraint per slave node, gap over the nearest master edge.
!>
!> The master surface is a polygon, or smoothed. A surface may be in contact with itself.
!> Source: docs/theory.md, section 4.
module emcon_nts
   use emcon_chain, only : chain_corners, chain_init, chain_shortest, chain_t, chain_thickness, &
      chain_tributary
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t, gap_state_t
   use emcon_errors, only : error_t
   use emcon_facing, only : facing_allows
   use emcon_hermite_gap_value, only : hermite_gap_value
   use emcon_interactions, only : contact_options_t, contact_pair_t, smoothing_hermite, &
      smoothing_none
   use emcon_joints, only : chain_join
   use emcon_kinds, only : wp
   use emcon_near_list, only : near_list_init, near_list_t, near_list_update
   use emcon_nts_constraint, only : polygon_constraint, smooth_constraint
   use emcon_nts_gap_value, only : nts_gap_value
   use emcon_nts_stencil, only : edge_distance, edge_of_sector, is_outside, most_nodes, &
      polygon_stencil, polygon_stencil_t, smooth_stencil, smooth_stencil_t, stencil_gather, &
      stencil_length
   use emcon_scene, only : scene_t
   use emcon_self_contact, only : self_contact_is_apart
   use emcon_stance, only : stance_holds, stance_t, stance_take
   use emcon_touch_rule, only : touch_rule_allows, touch_rule_init, touch_rule_may, &
      touch_rule_sees, touch_rule_t
   implicit none
   private
   public :: nts_t, nts_init, nts_nearest

   !> So far past the end of a surface, per edge, a node is still over it: a node that meets the end
   !> exactly (as on a plane of symmetry) must not be lost to round-off.
   real(wp), parameter :: end_tol = 1.0e-3_wp
   !> A node counts as outside at the start of a step down to this fraction of a master edge.
   real(wp), parameter :: touch_tol = sqrt(epsilon(1.0_wp))

   !> A gap over a polygon as a step begins.
   type :: start_t
      type(gap_state_t) :: state                      !! without what the end of the step tells
      real(wp) :: xi = 0.0_wp                         !! projection on the edge
   end type start_t

   type, extends(contact_t) :: nts_t
      type(chain_t) :: slave
      type(chain_t), allocatable :: master            !! gfortran 12 loses a second one of its kind
      logical :: is_self = .false.                    !! a surface in contact with itself
      integer :: smoothing = smoothing_none
      logical :: every_face = .false.                 !! also one that does not bear on the node
      type(touch_rule_t) :: rule                      !! only of such a surface
      integer, allocatable :: chain_node(:)           !! (n_constraint) index into the slave's nodes
      integer, allocatable :: class(:)                !! (n_constraint) of bodies that it looks at
      integer, allocatable :: edge(:)                 !! (n_constraint) master edge; 0: none near
      real(wp), allocatable :: own_size(:)            !! (n_constraint) least slave edge there [L]
      integer, allocatable :: other(:)                !! (n_constraint) the other one at a corner
                                                      !! that the node stands over; 0: none
      type(polygon_stencil_t), allocatable :: polygon(:, :)   !! (2, n_constraint) over these
      type(near_list_t) :: near
      integer, allocatable :: near_item(:)            !! (n_constraint) its place in that list
      integer :: n_sifted = 0                         !! the list that was last sifted
      logical, allocatable :: is_corner(:)            !! (n_edge) the smoothed master has one at its
                                                      !! first node
      type(smooth_stencil_t), allocatable :: smooth(:)   !! (n_constraint) only if smoothed
      type(stance_t) :: stance                        !! of the nodes as stencils were chosen:
      integer :: n_list = 0                           !! by which list of candidates,
      logical :: were_sharp = .false.                 !! with which corners,
      type(start_t), allocatable :: start(:)          !! (n_constraint) and gaps if not smoothed
      logical, allocatable :: is_lost(:)              !! (n_constraint) no unique closest point when
                                                      !! last evaluated, since the last measurement
   contains
      procedure :: begin_step => nts_begin_step
      procedure :: configure => nts_configure
      procedure :: measure => nts_measure
      procedure :: evaluate => nts_evaluate
      procedure :: covers => nts_covers
      procedure :: area => nts_area
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
      integer :: i

      call chain_init(self%slave, scene, scene%surface(pair%slave), error)
      if (allocated(error)) return
      allocate(self%master)
      call chain_init(self%master, scene, scene%surface(pair%master), error)
      if (allocated(error)) return
      call chain_join(self%slave, scene)
      call chain_join(self%master, scene)
      self%is_self = pair%slave == pair%master
      if (self%is_self) call touch_rule_init(self%rule, self%slave, scene, &
         pair%both_sides)
      associate (n => size(self%slave%node))
         self%chain_node = [(1 + mod(i, n), i = 0, n*self%rule%n_class - 1)]
         self%class = [(1 + i/n, i = 0, n*self%rule%n_class - 1)]
      end associate
      self%node = self%slave%node(self%chain_node)
      self%twin = self%slave%twin(self%chain_node)
      if (present(has_twins)) then
         if (has_twins) call add_twins(self)
      end if
      self%n_constraint = size(self%node)
      allocate(self%edge(self%n_constraint), self%other(self%n_constraint), source=0)
      allocate(self%state(self%n_constraint), self%polygon(2, self%n_constraint))
      allocate(self%start(self%n_constraint))
      self%deepest_start = touch_tol
      self%slack = pair%slack
      self%offset = pair%offset
      self%restitution = pair%restitution
      self%both_sides = pair%both_sides
      self%own_size = [(chain_shortest(self%slave, self%chain_node(i)), i = 1, self%n_constraint)]
      call chain_thickness(self%slave, scene, scene%surface(pair%slave), self%thickness)
      self%thickness = self%thickness(self%chain_node)
      associate (n => self%n_constraint/self%rule%n_class)
         self%near_item = [(1 + mod(i, n), i = 0, self%n_constraint - 1)]
         call near_list_init(self%near, reshape(self%node(:n), [1, n]), self%master%edge, &
            scene%u0, self%offset)
      end associate
   end subroutine nts_init

   !> Append the twins to the nodes.
   pure subroutine add_twins(self)
      type(nts_t), intent(inout) :: self

      associate (twin => self%slave%twin)
         self%node = [self%node, pack(twin, twin > 0)]
         self%chain_node = [self%chain_node, pack(self%chain_node, twin > 0)]
         self%class = [self%class, pack(self%class, twin > 0)]
      end associate
      deallocate(self%twin)
      allocate(self%twin(size(self%node)), source=0)
   end subroutine add_twins

   pure subroutine nts_configure(self, x, options)
      class(nts_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (2, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options

      self%stance%is_known = .false.
      self%smoothing = options%smoothing
      if (self%slack > 0.0_wp) self%smoothing = smoothing_none       ! guards watch the mesh
      self%may_sharpen = self%smoothing /= smoothing_hermite
      if (self%may_sharpen) return
      if (.not. allocated(self%smooth)) then
         allocate(self%is_corner(self%master%n_edge), self%smooth(self%n_constraint))
         allocate(self%is_lost(self%n_constraint), source=.false.)
      end if
      call chain_corners(self%master, x, options%smoothing_angle, self%is_corner)
   end subroutine nts_configure

   !> Choose for each slave node the nearest master edge at the start of the step. From the same
   !> start and the same candidates the choice is the same.
   pure subroutine nts_begin_step(self, x, u0, du)
      class(nts_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      integer :: i, k
      real(wp) :: best

      call near_list_update(self%near, x, u0, du, self%reach)
      if (self%is_self .and. self%n_sifted /= self%near%n_list) call sift(self)
      call self%has_looked(self%near%clearance)
      if (self%n_list == self%near%n_list .and. (self%were_sharp .eqv. self%is_sharp)) then
         if (stance_holds(self%stance, self%near%node, x, u0)) return
      end if
      call stance_take(self%stance, self%near%node, x, u0)
      self%n_list = self%near%n_list
      self%were_sharp = self%is_sharp
      do i = 1, self%n_constraint
         self%edge(i) = 0
         best = huge(best)
         associate (near => self%near%candidates, item => self%near_item(i))
            do k = near%start(item), near%start(item + 1) - 1
               call choose_nearer(self, i, near%edge(k), x, u0, best)
            end do
         end associate
         call settle(self, i, x, u0)
         if (self%smoothing /= smoothing_hermite) self%start(i) = polygon_start(self, i, x, u0)
      end do
   end subroutine nts_begin_step

   !> Leave out of a new list of candidates what a surface never touches of itself.
   pure subroutine sift(self)
      type(nts_t), intent(inout) :: self
      integer :: item, k, from, n

      n = 0
      associate (near => self%near%candidates)
         do item = 1, size(near%start) - 1
            from = near%start(item)
            near%start(item) = n + 1
            do k = from, near%start(item + 1) - 1
               if (.not. touch_rule_may(self%rule, self%slave, self%chain_node(item), &
                  near%edge(k))) cycle
               n = n + 1
               near%edge(n) = near%edge(k)
            end do
         end do
         near%start(size(near%start)) = n + 1
      end associate
      self%near%candidates%edge = self%near%candidates%edge(:n)
      self%n_sifted = self%near%n_list
   end subroutine sift

   !> Take edge `e` for constraint `i` if it is nearer than `best`.
   pure subroutine choose_nearer(self, i, e, x, u, best)
      type(nts_t), intent(inout) :: self
      integer, intent(in) :: i, e
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      real(wp), intent(inout) :: best
      real(wp) :: distance

      if (.not. touch_rule_sees(self%rule, self%class(i), e)) return
      distance = edge_distance(x, u, self%node(i), self%master%edge(:, e))
      if (.not. distance < best) return
      if (.not. bears(self, i, e, x, u)) return
      if (self%is_self) then
         if (.not. touch_rule_allows(self%rule, self%slave, self%chain_node(i), e, x, u)) return
      end if
      best = distance
      self%edge(i) = e
   end subroutine choose_nearer

   !> May edge `e` keep the node of constraint `i` out? A face that does not bear on the node counts
   !> only from outside: where corners meet, a node behind it is not to slide past the face that
   !> bears.
   pure logical function bears(self, i, e, x, u)
      type(nts_t), intent(in) :: self
      integer, intent(in) :: i, e
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)

      bears = self%every_face .or. self%smoothing == smoothing_hermite
      if (.not. bears) bears = is_outside(x, u, self%node(i), self%master%edge(:, e))
      if (.not. bears) bears = facing_allows(self%slave, self%chain_node(i), &
         self%master%edge(:, e), x, u)
   end function bears

   !> Finish the choice for constraint `i`, with the stencils: a node beside its edge, over others
   !> of its own surface that it must not touch, has none.
   pure subroutine settle(self, i, x, u0)
      type(nts_t), intent(inout) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)

      self%other(i) = 0
      if (self%edge(i) == 0) return
      if (self%is_self) then
         if (.not. is_covered(self, i, self%edge(i), x, u0)) self%edge(i) = 0
      end if
      if (self%edge(i) == 0) return
      if (self%smoothing == smoothing_hermite) then
         call smooth_stencil(self%smooth(i), self%master, self%is_corner, self%node(i), &
            self%edge(i), x, u0)
         self%smooth(i)%curve%rounding = self%rounding*self%master%length(self%edge(i))
      else
         call take_sector(self, i, x, u0)
      end if
      call stencil_of(self, i, self%edge(i), x, u0, self%polygon(1, i))
      if (self%other(i) > 0) call stencil_of(self, i, self%other(i), x, u0, self%polygon(2, i))
   end subroutine settle

   !> Of the two edges at a corner take the one on whose side of the bisector constraint `i` is, or
   !> both. What a surface must not touch of itself does not come in.
   pure subroutine take_sector(self, i, x, u0)
      type(nts_t), intent(inout) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)
      integer :: edge, other, new

      edge = self%edge(i)
      call edge_of_sector(self%master, self%node(i), x, u0, edge, other)
      new = max(other, merge(edge, 0, edge /= self%edge(i)))
      if (new == 0) return
      if (.not. touch_rule_sees(self%rule, self%class(i), new)) return
      if (.not. bears(self, i, new, x, u0)) return
      if (self%is_self) then
         if (.not. touch_rule_allows(self%rule, self%slave, self%chain_node(i), new, x, u0)) return
      end if
      self%edge(i) = edge
      self%other(i) = other
   end subroutine take_sector

   pure subroutine nts_measure(self, x, u0, du)
      class(nts_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      logical :: is_at_rest
      integer :: i

      if (.not. stance_holds(self%stance, self%near%node, x, u0)) then
         self%stance%is_known = .false.
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

      nothing_moves = .true.
      do k = 1, size(node)
         nothing_moves = .not. any(abs(du(:, node(k))) > 0.0_wp)
         if (.not. nothing_moves) return
      end do
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
         [self%polygon(1, i)%before > 0, self%polygon(1, i)%after > 0])
   end function state_at_rest

   !> What a gap over a polygon is as a step begins.
   pure function polygon_start(self, i, x, u0) result(start)
      type(nts_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)
      type(start_t) :: start
      real(wp) :: local(2, 5), dlocal(2, 5)

      if (self%edge(i) == 0) return
      associate (stencil => self%polygon(1, i), state => start%state)
         call stencil_gather(x, u0, u0, stencil%n, stencil%node, local, dlocal)
         call nts_gap_value(local(:, :stencil%n), stencil%before, stencil%after, &
            stencil%rounding, state%gap0, start%xi, stencil%goes_around)
         state%gap0 = state%gap0 - self%offset
         state%size = stencil_length(x, stencil%node)
         state%closed = -self%slack*min(state%size, self%own_size(i))
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
      type(start_t), intent(in) :: start
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      type(gap_state_t) :: state
      real(wp) :: xi1

      state = start%state
      call polygon_end(self, i, x, u0, du, state%gap1, xi1)
      associate (stencil => self%polygon(1, i))
         state%is_over = is_over(state, start%xi, xi1, [stencil%before > 0, stencil%after > 0])
      end associate
      state%is_covered = .true.
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
            xi, stencil%goes_around)
         gap = gap - self%offset
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
      if (xi < 0.0_wp .or. xi > 1.0_wp) covers = is_covered(self, i, self%edge(i), x, u0, du)
      if (self%other(i) > 0 .and. covers) covers = is_covered(self, i, self%other(i), x, u0, du)
   end function nts_covers

   !> Nodes over the polygon: slave node, edge, and what is there before and after that may keep the
   !> node out.
   pure subroutine stencil_of(self, i, edge, x, u0, stencil)
      type(nts_t), intent(in) :: self
      integer, intent(in) :: i, edge
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)
      type(polygon_stencil_t), intent(out) :: stencil

      call polygon_stencil(stencil, self%master, self%node(i), edge, &
         self%rounding*[1.0_wp, merge(0.0_wp, 1.0_wp, self%is_sharp)], x, u0)
      stencil%goes_around = self%offset > 0.0_wp
      associate (n => stencil%n, before => stencil%before, after => stencil%after)
         if (after > 0) then
            if (.not. bears(self, i, self%master%next(edge), x, u0)) then
               n = n - 1
               after = 0
            end if
         end if
         if (before == 0) return
         if (bears(self, i, self%master%previous(edge), x, u0)) return
         n = n - 1
         before = 0
         if (after == 0) return
         stencil%node(4) = stencil%node(5)
         after = 4
      end associate
   end subroutine stencil_of

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
         state%is_near = .true.
         state%is_over = is_over(state, xi0, xi1, curve%node([2, 5]) > 0 .and. &
            (curve%has_neighbour .or. .not. curve%is_corner([3, 4])))
         ! The curve goes on over one edge on either side, unless a corner or an end is there.
         state%is_covered = (xi1 >= -1.0_wp .or. curve%node(1) == 0 .or. curve%is_corner(3)) .and. &
            (xi1 <= 2.0_wp .or. curve%node(6) == 0 .or. curve%is_corner(4))
         if (state%is_covered .and. (xi1 < 0.0_wp .or. xi1 > 1.0_wp)) then
            state%is_covered = is_covered(self, i, self%edge(i), x, u0, du)
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

   !> Is `edge` or one of its neighbours the nearest after the motion `du`, rather than the edges
   !> after next?
   pure logical function is_covered(self, i, edge, x, u0, du)
      type(nts_t), intent(in) :: self
      integer, intent(in) :: i, edge
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)
      real(wp), intent(in), contiguous, optional :: du(:, :)
      real(wp) :: inside, outside
      integer :: e, k, side

      inside = distance_of(edge)
      outside = huge(outside)
      do side = 1, 2
         e = edge
         do k = 1, 2
            e = merge(self%master%previous(e), self%master%next(e), side == 1)
            if (e == 0) exit
            if (k == 1) inside = min(inside, distance_of(e))
            if (k == 1) cycle
            if (.not. bears(self, i, e, x, u0)) exit
            if (self%is_self) then
               if (.not. self_contact_is_apart(self%slave, self%chain_node(i), e)) exit
            end if
            outside = min(outside, distance_of(e))
         end do
      end do
      is_covered = inside <= outside

   contains

      !> Distance of the slave node from edge `e`.
      pure real(wp) function distance_of(e)
         integer, intent(in) :: e
         real(wp) :: u(2, 3), local(2, 3)

         if (.not. present(du)) then
            distance_of = edge_distance(x, u0, self%node(i), self%master%edge(:, e))
            return
         end if
         associate (node => [self%node(i), self%master%edge(:, e)])
            local = x(:, node)
            u = u0(:, node) + du(:, node)
         end associate
         distance_of = edge_distance(local, u, 1, [2, 3])
      end function distance_of

   end function is_covered

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
               target(k) + self%offset, item(k))
         end associate
      end do
   end subroutine nts_evaluate

   pure subroutine nts_area(self, x, u, area, length)
      class(nts_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (2, n_node) [L]
      real(wp), intent(out) :: area(:)           !! (n_constraint) [L^2]
      real(wp), intent(out) :: length(:)         !! (n_constraint) [L]
      real(wp) :: at_node(size(self%slave%node))

      at_node = 0.0_wp
      if (self%slave%n_edge > 0) call chain_tributary(self%slave, x, u, at_node)
      length = at_node(self%chain_node)
      area = length*self%thickness
   end subroutine nts_area

   !> Gap at x + u of slave node `i` over the nearest master edge, searched among all edges.
   !> For checks before the first step only. `is_over`: not past an end of the surface.
   pure subroutine nts_nearest(self, i, x, u, gap, is_over)
      type(nts_t), intent(inout) :: self
      integer, intent(in) :: i                   !! slave node, index into `node`
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (2, n_node) [L]
      real(wp), intent(out) :: gap               !! [L]
      logical, intent(out) :: is_over            !! .false. also if there is no edge
      real(wp) :: best
      real(wp) :: zero(size(x, 1), size(x, 2))
      type(gap_state_t) :: state
      integer :: e

      best = huge(best)
      self%edge(i) = 0
      do e = 1, self%master%n_edge
         call choose_nearer(self, i, e, x, u, best)
      end do
      call settle(self, i, x, u)
      self%stance%is_known = .false.
      self%start(i) = polygon_start(self, i, x, u)
      zero = 0.0_wp
      state = gap_state(self, i, x, u, zero)
      gap = state%gap0
      is_over = state%is_over
   end subroutine nts_nearest

end module emcon_nts
