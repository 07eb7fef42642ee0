!> Which edges of the master surface the nodes of node-to-segment contact look at, and what their
!> gaps are made of.
!>
!> Source: docs/theory.md, section 4.
module emcon_nts_choice
   use emcon_chain_plane, only : chain_init, chain_share, chain_shortest, chain_t, &
      chain_thickness, next, previous
   use emcon_circles_plane, only : circles_find, circles_t
   use emcon_common_normal_plane, only : is_pushed_aside
   use emcon_contact, only : contact_t
   use emcon_corner_tops_plane, only : corner_tops
   use emcon_errors, only : error_t
   use emcon_facing_plane, only : facing_allows
   use emcon_interactions, only : contact_pair_t, formulation_mortar, interaction_reach, &
      smoothing_hermite, smoothing_none
   use emcon_kinds, only : wp
   use emcon_near_list, only : near_list_init, near_list_t, near_list_update, near_list_within
   use emcon_nts_stencil, only : smooth_stencil, smooth_stencil_t
   use emcon_polygon_stencil_plane, only : corner_widths, edge_distance, edge_of_circle, &
      edge_of_sector, is_outside, polygon_stencil, polygon_stencil_t, stays_on_circle
   use emcon_rigid_bodies, only : rigid_far_node, rigid_numbers
   use emcon_scene, only : scene_t
   use emcon_seams_plane, only : chain_join
   use emcon_self_contact_plane, only : self_contact_is_apart
   use emcon_touch_rule_plane, only : touch_rule_allows, touch_rule_init, touch_rule_may, &
      touch_rule_sees, touch_rule_t
   use emcon_vectors_plane, only : between
   implicit none
   private
   public :: nts_choice_t
   public :: choice_init, update_candidates, choice_make, choice_take_nearer, choice_settle, &
      choice_covers, choice_pushes_aside

   !> Nodes of both surfaces that are nearer than this, per edge, are at one place; and shares that
   !> differ by less are alike.
   real(wp), parameter :: at_node = 1.0e-3_wp

   type, abstract, extends(contact_t) :: nts_choice_t
      type(chain_t) :: slave
      type(chain_t), allocatable :: master            !! gfortran 12 loses a second one of its kind
      logical :: is_self = .false.                    !! a surface in contact with itself
      logical :: both_sides = .false.                 !! this and another hold all nodes
      integer :: smoothing = smoothing_none
      logical :: every_face = .false.                 !! also one that does not bear on the node
      type(touch_rule_t) :: rule                      !! only of such a surface
      integer, allocatable :: chain_node(:)           !! (n_constraint) index into the slave's nodes
      integer, allocatable :: class(:)                !! (n_constraint) of bodies that it looks at
      real(wp), allocatable :: own_size(:)            !! (n_constraint) least slave edge there [L]
      type(near_list_t) :: near
      integer, allocatable :: near_item(:)            !! (n_constraint) its place in that list
      integer :: n_sifted = 0                         !! the list that was last sifted
      integer, allocatable :: edge(:)                 !! (n_constraint) master edge; 0: none near
      integer, allocatable :: other(:)                !! (n_constraint) the other one where the
                                                      !! node stands over two; 0: none
      type(polygon_stencil_t), allocatable :: polygon(:, :)   !! (2, n_constraint) over these
      integer, allocatable :: arm(:)                  !! (n_constraint) another node of the rigid
                                                      !! body of a node with a pad; 0: none
      type(circles_t), allocatable :: circles         !! of the master; none: it is no rigid one
      logical, allocatable :: is_corner(:)            !! (n_edge) the smoothed master has one at its
                                                      !! first node
      type(smooth_stencil_t), allocatable :: smooth(:)   !! (n_constraint) only if smoothed
   contains
      procedure :: narrow => choice_narrow
      procedure :: could_hold => choice_could_hold
   end type nts_choice_t

contains

   !> Set up the surfaces and nodes of the pair `pair` of `scene`.
   subroutine choice_init(self, scene, pair, error, has_twins)
      class(nts_choice_t), intent(inout) :: self   !! new
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
      if (size(scene%rigid) > 0 .and. pair%formulation /= formulation_mortar &
         .and. .not. pair%slack > 0.0_wp) then
         allocate(self%circles)
         call circles_find(self%circles, self%master, scene%x, rigid_numbers(scene%rigid, &
            size(scene%x, 2)))
      end if
      self%is_self = pair%slave == pair%master
      if (self%is_self) call touch_rule_init(self%rule, self%slave, scene, pair%both_sides)
      associate (n => size(self%slave%node))
         self%chain_node = [(1 + mod(i, n), i = 0, n*self%rule%n_class - 1)]
         self%class = [(1 + i/n, i = 0, n*self%rule%n_class - 1)]
      end associate
      self%node = self%slave%node(self%chain_node)
      self%duplicate = self%slave%duplicate(self%chain_node)
      if (present(has_twins)) then
         if (has_twins) call add_twins(self)
      end if
      self%n_constraint = size(self%node)
      allocate(self%edge(self%n_constraint), self%other(self%n_constraint), source=0)
      allocate(self%polygon(2, self%n_constraint))
      self%offset = pair%interaction%offset
      self%arm = [(0, i = 1, self%n_constraint)]
      if (self%offset > 0.0_wp .and. self%slave%n_facet == 0) then
         self%arm = [(rigid_far_node(scene%rigid, self%node(i), scene%x), i = 1, self%n_constraint)]
      end if
      self%both_sides = pair%both_sides
      if (self%both_sides) self%area_factor = 0.5_wp
      self%own_size = [(chain_shortest(self%slave, self%chain_node(i)), i = 1, self%n_constraint)]
      call chain_thickness(self%slave, scene, self%thickness)
      self%thickness = self%thickness(self%chain_node)
      associate (n => self%n_constraint/self%rule%n_class)
         self%near_item = [(1 + mod(i, n), i = 0, self%n_constraint - 1)]
         call near_list_init(self%near, reshape(self%node(:n), [1, n]), self%master%facet, &
            scene%x, scene%u0, self%offset + interaction_reach(pair%interaction))
      end associate
   end subroutine choice_init

   !> Append the twins to the nodes.
   pure subroutine add_twins(self)
      class(nts_choice_t), intent(inout) :: self

      associate (duplicate => self%slave%duplicate)
         self%node = [self%node, pack(duplicate, duplicate > 0)]
         self%chain_node = [self%chain_node, pack(self%chain_node, duplicate > 0)]
         self%class = [self%class, pack(self%class, duplicate > 0)]
      end associate
      deallocate(self%duplicate)
      allocate(self%duplicate(size(self%node)), source=0)
   end subroutine add_twins

   !> Renew the candidates for a step from `u0` with the expected motion `du`.
   pure subroutine update_candidates(self, x, u0, du)
      class(nts_choice_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]

      call near_list_update(self%near, x, u0, du, self%reach)
      if (self%is_self .and. self%n_sifted /= self%near%n_list) call sift(self)
      call self%has_looked(self%near%clearance)
   end subroutine update_candidates

   !> Choose for constraint `i` the nearest of the edges that are near at the start of the step.
   pure subroutine choice_make(self, i, x, u0)
      class(nts_choice_t), intent(inout) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (2, n_node) [L]
      real(wp) :: best
      integer :: k

      self%edge(i) = 0
      best = huge(best)
      associate (near => self%near%candidates, item => self%near_item(i))
         do k = near%start(item), near%start(item + 1) - 1
            if (.not. near_list_within(self%near, item, near%facet(k), self%reach)) cycle
            call choice_take_nearer(self, i, near%facet(k), x, u0, best)
         end do
      end associate
      call choice_settle(self, i, x, u0)
   end subroutine choice_make

   !> Leave out of a new list of candidates what a surface never touches of itself.
   pure subroutine sift(self)
      class(nts_choice_t), intent(inout) :: self
      integer :: item, k, from, n

      n = 0
      associate (near => self%near%candidates)
         do item = 1, size(near%start) - 1
            from = near%start(item)
            near%start(item) = n + 1
            do k = from, near%start(item + 1) - 1
               if (.not. touch_rule_may(self%rule, self%slave, self%chain_node(item), &
                  near%facet(k))) cycle
               n = n + 1
               near%facet(n) = near%facet(k)
            end do
         end do
         near%start(size(near%start)) = n + 1
      end associate
      self%near%candidates%facet = self%near%candidates%facet(:n)
      if (n == 0) self%near%nearest = self%near%reach
      self%n_sifted = self%near%n_list
   end subroutine sift

   !> Take edge `e` for constraint `i` if it is nearer than `best`.
   pure subroutine choice_take_nearer(self, i, e, x, u, best)
      class(nts_choice_t), intent(inout) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      integer, intent(in) :: e                   !! master edge
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (2, n_node) [L]
      real(wp), intent(inout) :: best            !! distance of the nearest so far [L]
      real(wp) :: distance

      if (.not. touch_rule_sees(self%rule, self%class(i), e)) return
      distance = edge_distance(x, u, self%node(i), self%master%facet(:, e))
      if (.not. distance < best) return
      if (.not. bears(self, i, e, x, u)) return
      if (self%is_self) then
         if (.not. touch_rule_allows(self%rule, self%slave, self%chain_node(i), e, x, u)) return
      end if
      best = distance
      self%edge(i) = e
   end subroutine choice_take_nearer

   !> May edge `e` keep the node of constraint `i` out? A face that does not bear on the node counts
   !> only from outside: where corners meet, a node behind it is not to slide past the face that
   !> bears.
   pure logical function bears(self, i, e, x, u)
      class(nts_choice_t), intent(in) :: self
      integer, intent(in) :: i, e
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)

      bears = self%every_face .or. self%smoothing == smoothing_hermite
      if (.not. bears) bears = is_outside(x, u, self%node(i), self%master%facet(:, e))
      if (.not. bears) bears = facing_allows(self%slave, self%chain_node(i), &
         self%master%facet(:, e), x, u)
   end function bears

   !> Finish the choice for constraint `i`, with the stencils: a node beside its edge, over others
   !> of its own surface that it must not touch, has none.
   pure subroutine choice_settle(self, i, x, u0)
      class(nts_choice_t), intent(inout) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (2, n_node) [L]

      self%other(i) = 0
      if (self%edge(i) == 0) return
      if (self%is_self) then
         if (.not. choice_covers(self, i, self%edge(i), x, u0)) self%edge(i) = 0
      end if
      if (self%edge(i) == 0) return
      if (self%smoothing == smoothing_hermite) then
         call smooth_stencil(self%smooth(i), self%master, self%is_corner, self%node(i), &
            self%edge(i), x, u0)
         self%smooth(i)%curve%rounding = self%rounding*self%master%size(self%edge(i))
      else
         call take_sector(self, i, x, u0)
      end if
      call stencil_of(self, i, self%edge(i), x, u0, self%polygon(1, i))
      if (self%other(i) > 0) call stencil_of(self, i, self%other(i), x, u0, self%polygon(2, i))
   end subroutine choice_settle

   !> Of the two edges at a corner take the one on whose side of the bisector constraint `i` is, or
   !> both. What a surface must not touch of itself does not come in.
   pure subroutine take_sector(self, i, x, u0)
      class(nts_choice_t), intent(inout) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)
      integer :: edge, other, new

      edge = self%edge(i)
      call edge_of_sector(self%master, self%node(i), x, u0, edge, other)
      if (allocated(self%circles)) then
         if (maxval(self%circles%of([edge, max(1, other)])) > 0) other = 0
      end if
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

   !> Nodes over the polygon: slave node, edge, and what is there before and after that may keep the
   !> node out.
   pure subroutine stencil_of(self, i, edge, x, u0, stencil)
      class(nts_choice_t), intent(in) :: self
      integer, intent(in) :: i, edge             !! constraint, edge of the master
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)
      type(polygon_stencil_t), intent(out) :: stencil
      real(wp) :: top
      integer :: middle

      ! At rest a node may stand on a top for long.
      top = merge(2.0_wp, 1.0_wp, self%meets_statics)
      if (self%step%is_sharp) top = 0.0_wp
      middle = edge
      if (allocated(self%circles)) middle = edge_of_circle(self%master, self%circles, edge)
      call polygon_stencil(stencil, self%master, self%node(i), middle, x, u0, self%circles)
      stencil%rounding = corner_widths(self%master, middle, self%rounding*[1.0_wp, top])
      ! Guards watch the mesh.
      if (.not. (self%step%is_sharp .or. self%meets_statics .or. self%slack > 0.0_wp)) then
         call corner_tops(self%slave, self%chain_node(i), self%master, middle, x, u0, stencil)
      end if
      stencil%round%goes_around = self%offset > 0.0_wp
      stencil%arm = self%arm(i)
      stencil%radius = self%offset
      associate (n => stencil%n, before => stencil%before, after => stencil%after)
         if (after > 0) then
            if (.not. bears(self, i, self%master%neighbour(next, middle), x, u0)) then
               n = n - 1
               after = 0
            end if
         end if
         if (before > 0) then
            if (.not. bears(self, i, self%master%neighbour(previous, middle), x, u0)) then
               n = n - 1
               before = 0
               if (after > 0) then
                  stencil%node(4) = stencil%node(5)
                  after = 4
               end if
            end if
         end if
         stencil%goes_on = [before, after] > 0 .or. abs(stencil%round%bend([-1, 1])) > 0.0_wp
         if (abs(stencil%round%bend(0)) > 0.0_wp) then
            stencil%goes_on = self%master%neighbour(:, middle) > 0
         end if
      end associate
   end subroutine stencil_of

   !> Does the surface push the node of constraint `i`, as a state of rest, along what is no normal
   !> of both? Where nodes of both surfaces are held, another constraint is there for it.
   pure logical function choice_pushes_aside(self, i, x, u0, du) result(is_aside)
      class(nts_choice_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]

      is_aside = self%step%is_static .and. self%both_sides
      if (is_aside) is_aside = is_pushed_aside(self%slave, self%chain_node(i), &
         self%polygon(1, i), x, u0, du)
   end function choice_pushes_aside

   !> Where nodes of both surfaces stand on each other one push presses both: on what belongs to the
   !> node of the finer one, whichever of the two it is the constraint of.
   pure subroutine choice_narrow(self, x, u, area)
      class(nts_choice_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (2, n_node) [L]
      real(wp), intent(inout) :: area(:)         !! (n_constraint) of the slave surface [L^2]
      real(wp) :: part
      integer :: i, k

      if (.not. self%both_sides) return
      do i = 1, self%n_constraint
         if (.not. self%state(i)%is_near) cycle
         do k = 1, 2
            if (norm2(between(x, u, self%node(i), self%polygon(1, i)%node(1 + k))) &
               > at_node*self%state(i)%size) cycle
            part = chain_share(self%master, self%master%corner(k, self%edge(i))) &
               /chain_share(self%slave, self%chain_node(i))
            if (part < 1.0_wp - at_node) area(i) = part*area(i)
         end do
      end do
   end subroutine choice_narrow

   !> Each node of both surfaces may be held.
   pure logical function choice_could_hold(self, is_loose) result(could_hold)
      class(nts_choice_t), intent(in) :: self
      logical, intent(in) :: is_loose(:)         !! (n_constraint) it is not held, and goes in

      could_hold = self%both_sides .and. any(is_loose)
   end function choice_could_hold

   !> Is edge `middle` or one of its neighbours the nearest after the motion `du`, rather than the
   !> edges after next? A circle is one edge.
   pure logical function choice_covers(self, i, middle, x, u0, du)
      class(nts_choice_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      integer, intent(in) :: middle              !! of the master
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)        !! (2, n_node) [L]
      real(wp), intent(in), contiguous, optional :: du(:, :)       !! (2, n_node); none: 0 [L]
      real(wp) :: inside, outside
      integer :: e, k, side

      if (allocated(self%circles)) then
         choice_covers = stays_on_circle(self%master, self%circles, self%node(i), middle, x, u0, du)
         if (choice_covers) return
      end if
      inside = distance_of(middle)
      outside = huge(outside)
      do side = 1, 2
         e = middle
         do k = 1, 2
            e = merge(self%master%neighbour(previous, e), self%master%neighbour(next, e), side == 1)
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
      choice_covers = inside <= outside

   contains

      pure real(wp) function distance_of(e)
         integer, intent(in) :: e                !! edge of the master

         distance_of = edge_distance(x, u0, self%node(i), self%master%facet(:, e), du)
      end function distance_of

   end function choice_covers

end module emcon_nts_choice
