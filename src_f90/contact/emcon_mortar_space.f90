! build: elements
!> Mortar contact in space: gaps between slave facets and what of the master they face, integrated
!> with one weight for each vertex of the slave facets.
!>
!> Each triangle of the slave facets has a stencil of its own, that of a patch as large as it is.
!> Source: docs/theory.md, section 14.2.
module emcon_mortar_space
   use emcon_bulges_space, only : bulges_find
   use emcon_condition_nodes, only : condition_resize_slip
   use emcon_constraint, only : condition_t
   use emcon_contact, only : gap_state_t, max_penetration_on_entry, push_place, slip_place
   use emcon_contact_law, only : contact_laws_rub
   use emcon_contact_law_registry, only : contact_laws_of_surface
   use emcon_errors, only : error_t
   use emcon_frame_slip_space, only : slip_axis_t
   use emcon_guards, only : touching_bar
   use emcon_interactions, only : contact_options_t, contact_pair_t, multiplier_dual
   use emcon_kinds, only : wp
   use emcon_mortar_faces_space, only : mortar_faces_choose, mortar_faces_init, mortar_faces_look, &
      mortar_faces_t
   use emcon_mortar_means_space, only : mortar_means_init, mortar_means_t
   use emcon_mortar_rise_space, only : mortar_rise, mortar_rise_doubt, &
      mortar_rise_largest, mortar_rise_t
   use emcon_mortar_slave_space, only : mortar_slave_side, mortar_slave_weight
   use emcon_mortar_slip_space, only : mortar_slip_add, mortar_slip_choose, mortar_slip_of, &
      mortar_slip_shift, mortar_slip_sight, mortar_slip_t
   use emcon_mortar_sum_space, only : mortar_add_facet, mortar_begin_sum, mortar_facet_sums, &
      mortar_sight, sight_t
   use emcon_patch_gap_space, only : patch_sums_t
   use emcon_patch_look_space, only : patch_basis, patch_basis_t
   use emcon_patch_near_space, only : room_beside
   use emcon_patch_places_space, only : patch_stencil_begin, patch_stencil_gather
   use emcon_position_memo, only : position_memo_holds, position_memo_t, position_memo_take
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: mortar_space_t, mortar_space_init

   !> A node is let go where less than this part of its surface is covered.
   real(wp), parameter :: least_cover = 0.02_wp
   !> Hard contact holds it where as much of that is over the master itself, not past its end.
   real(wp), parameter :: least_own = 1.0e-3_wp
   !> So far, per facet, a mean gap may be closed where contact begins.
   real(wp), parameter :: max_penetration_mean = 0.2_wp

   type, extends(mortar_means_t) :: mortar_space_t
      type(mortar_faces_t) :: faces
      type(position_memo_t) :: memo                   !! of the nodes as stencils were chosen:
      !> By this reach, so far beside triangles, and what may close from so far off [L]
      real(wp) :: chosen(3) = 0.0_wp
      type(mortar_rise_t), allocatable :: rise        !! of both sides; only if gaps follow arcs
      type(patch_basis_t), allocatable :: basis(:)    !! (n_triangle) as last measured,
      logical :: knows_start = .false.                !! from where stencils were chosen
      type(mortar_slip_t), allocatable :: slide(:)    !! (n_triangle) of the step; with friction
      type(mortar_slip_t), allocatable :: next_slide(:)    !! of the last motion that was looked at
      real(wp), allocatable :: along(:, :)            !! (3, n_constraint) sides of the slave that
                                                      !! it is counted along, as the step begins [L]
      !> (3, nodes that are looked at) the motions that both are of [L]
      real(wp), allocatable :: slide_du(:, :), next_du(:, :)
      !> (0:1, n_facet) how dual the multipliers of slave facets are at start and end
      real(wp), allocatable :: theta(:, :)
   contains
      procedure :: configure => mortar_configure
      procedure :: follow_arcs => mortar_follow_arcs
      procedure :: curve_doubt => mortar_curve_doubt
      procedure :: begin_points => mortar_begin_step
      procedure :: measure_points => mortar_measure
      procedure :: evaluate_points => mortar_evaluate
      procedure :: slip_points => mortar_slip
      procedure :: lets_in => mortar_lets_in
      procedure :: follow_slips => mortar_follow_slips
   end type mortar_space_t

contains

   !> Set up the pair `pair` of `scene`.
   subroutine mortar_space_init(self, scene, pair, error)
      type(mortar_space_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error

      call mortar_faces_init(self%faces, scene, pair, error)
      if (allocated(error)) return
      self%node = self%faces%node
      self%n_constraint = size(self%node)
      call make_room(self)
      self%may_leave = .true.
      self%offset = pair%interaction%offset
      self%max_penetration_at_start = max_penetration_mean
      call contact_laws_of_surface(pair%interaction, self%laws)
      if (.not. contact_laws_rub(self%laws)) return
      allocate(self%slide(size(self%faces%split%facet)))
      allocate(self%next_slide(size(self%faces%split%facet)))
      allocate(self%along(3, self%n_constraint), source=0.0_wp)
   end subroutine mortar_space_init

   !> Room for what a step knows, and sizes in the reference.
   pure subroutine make_room(self)
      type(mortar_space_t), intent(inout) :: self
      real(wp) :: whole(self%n_constraint)
      integer :: i, k

      allocate(self%basis(size(self%faces%split%facet)), self%state(self%n_constraint))
      allocate(self%theta(0:1, self%faces%sides%slave%n_facet), source=0.0_wp)
      whole = 0.0_wp
      associate (frames => self%faces%sides%frames)
         do i = 1, self%n_constraint
            do k = self%faces%start(i), self%faces%start(i + 1) - 1
               associate (t => self%faces%triangle(k))
                  whole(i) = whole(i) + frames%area(t) &
                     *sum(self%faces%weights%linear(:, self%faces%vertex(k), t))/3.0_wp
                  self%state(i)%size = self%state(i)%size + frames%size(t) &
                     /real(self%faces%start(i + 1) - self%faces%start(i), wp)
               end associate
            end do
         end do
      end associate
      call mortar_means_init(self, whole)
   end subroutine make_room

   pure subroutine mortar_configure(self, x, options)
      class(mortar_space_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (3, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options

      self%memo%is_known = .false.
      self%faces%is_dual = options%multiplier == multiplier_dual
   end subroutine mortar_configure

   !> Measure gaps between the curved surfaces that both sides stand for, or between facets.
   pure subroutine mortar_follow_arcs(self, x, options, is_wanted)
      class(mortar_space_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (3, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options
      logical, intent(in) :: is_wanted           !! else between facets

      self%memo%is_known = .false.
      self%sagitta = 0.0_wp
      if (allocated(self%rise)) deallocate(self%rise)
      if (.not. is_wanted) return
      allocate(self%rise)
      associate (faces => self%faces, sides => self%faces%sides)
         call bulges_find(self%rise%slave, sides%slave, faces%split, x, options%smoothing_angle)
         call bulges_find(self%rise%master, sides%master, sides%triangles%split, x, &
            options%smoothing_angle)
      end associate
   end subroutine mortar_follow_arcs

   pure real(wp) function mortar_curve_doubt(self) result(doubt)
      class(mortar_space_t), intent(in) :: self

      doubt = 0.0_wp
      if (allocated(self%rise)) doubt = mortar_rise_doubt(self%rise, self%faces)
   end function mortar_curve_doubt

   !> Choose for each triangle what it may see in the step, and the multipliers.
   pure subroutine mortar_begin_step(self, x, u0, du)
      class(mortar_space_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      logical :: begins, is_new
      integer :: i

      begins = .not. self%reach > 0.0_wp
      call mortar_faces_look(self%faces, x, u0, du, self%reach)
      call self%has_looked(self%faces%near%clearance)
      call choose_stencils(self, x, u0, is_new)
      if (.not. allocated(self%slide)) return
      call choose_next_slips(self, x, u0, du)
      if (begins .or. .not. allocated(self%slide_du)) then
         call self%follow_slips()
      else if (is_new) then
         call choose_slips_again(self, x, u0)
      end if
      do i = 1, self%n_constraint
         self%along(:, i) = mortar_slave_side(self%faces, self%faces%sides%slave%node, i, x, u0)
         self%state(i)%slip_shift = mortar_slip_shift(self%next_slide, self%slide, self%faces, i)
      end do
   end subroutine mortar_begin_step

   !> From the same start and up to the same reach the choice is the same.
   pure subroutine choose_stencils(self, x, u0, is_new)
      type(mortar_space_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      logical, intent(out) :: is_new             !! they may be others than before

      is_new = .false.
      if (is_chosen(self)) then
         if (position_memo_holds(self%memo, self%faces%near%node, x, u0)) return
      end if
      is_new = .true.
      call position_memo_take(self%memo, self%faces%near%node, x, u0)
      self%knows_start = .false.
      self%chosen = [self%reach, self%faces%beside, self%faces%close]
      self%faces%gives_way = self%step%has_compliance
      call mortar_faces_choose(self%faces, x, u0, self%reach, self%step%is_watched)
      if (allocated(self%rise)) call find_sagittas(self, x, u0)
   end subroutine choose_stencils

   !> Are the stencils those of such a step?
   pure logical function is_chosen(self)
      type(mortar_space_t), intent(in) :: self

      is_chosen = all(abs(self%chosen - [self%reach, self%faces%beside, self%faces%close]) &
         <= 0.0_wp)
      if (allocated(self%step%is_watched)) is_chosen = is_chosen .and. &
         all(self%faces%may_close .or. .not. self%step%is_watched)
   end function is_chosen

   !> What slips would be made of where forces act by this motion. It is taken over as a step begins
   !> and by `follow_slips`, so that what is solved does not depend on motions tried on the way.
   pure subroutine choose_next_slips(self, x, u0, du)
      type(mortar_space_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]

      self%next_du = du(:, self%faces%near%node)
      call mortar_slip_choose(self%next_slide, self%faces, x, u0, du, push_place(self%step))
   end subroutine choose_next_slips

   !> The same slips by new stencils.
   pure subroutine choose_slips_again(self, x, u0)
      type(mortar_space_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      real(wp) :: du(size(u0, 1), size(u0, 2))

      du = 0.0_wp
      du(:, self%faces%near%node) = self%slide_du
      call mortar_slip_choose(self%slide, self%faces, x, u0, du, push_place(self%step))
   end subroutine choose_slips_again

   !> Slips are made of what the last motion goes over.
   pure subroutine mortar_follow_slips(self)
      class(mortar_space_t), intent(inout) :: self

      if (.not. allocated(self%slide)) return
      self%slide = self%next_slide
      self%slide_du = self%next_du
   end subroutine mortar_follow_slips

   !> How far both surfaces rise over what gaps are measured between.
   pure subroutine find_sagittas(self, x, u0)
      type(mortar_space_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      real(wp), dimension(3, size(self%faces%stencil)) :: rise, cover
      real(wp) :: weight(3), total, area
      integer :: i, k, t

      do t = 1, size(self%faces%stencil)
         call mortar_rise(self%rise, self%faces, t, x, u0, rise(:, t), cover(:, t))
      end do
      call find_bases(self, x, u0, 0.0_wp*u0)
      do i = 1, self%n_constraint
         total = 0.0_wp
         area = 0.0_wp
         do k = self%faces%start(i), self%faces%start(i + 1) - 1
            t = self%faces%triangle(k)
            weight = mortar_slave_weight(self%faces, k, self%theta(0, self%faces%split%facet(t)))
            total = total + dot_product(weight, rise(:, t))
            area = area + dot_product(weight, cover(:, t))
         end do
         self%sagitta(i) = 0.0_wp
         if (area >= least_cover*self%whole(i)) self%sagitta(i) = total/area
      end do
   end subroutine find_sagittas

   !> What triangle `t` sees.
   pure subroutine look(self, t, x, u0, du, knows_start)
      class(mortar_space_t), intent(inout) :: self
      integer, intent(in) :: t
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      logical, intent(in) :: knows_start         !! it has looked from the same start
      real(wp), dimension(3, 3 + self%faces%stencil(t)%patch%n_vertex) :: at, way

      if (self%faces%stencil(t)%triangle == 0) then
         self%basis(t) = patch_basis_t()
         return
      end if
      call patch_stencil_gather(self%faces%stencil(t), x, u0, du, at, way)
      call patch_basis(self%faces%stencil(t)%patch, at, way, knows_start, self%basis(t))
   end subroutine look

   !> Mean gaps at both ends of the step; 0 where nothing is covered.
   pure subroutine mortar_measure(self, x, u0, du)
      class(mortar_space_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      integer :: i

      call find_bases(self, x, u0, du)
      do i = 1, self%n_constraint
         call measure_vertex(self, i)
      end do
   end subroutine mortar_measure

   !> What triangles see at both ends of the step, and the multipliers of their facets.
   pure subroutine find_bases(self, x, u0, du)
      type(mortar_space_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      integer :: f, t
      logical :: is_start                        ! where stencils were chosen

      is_start = position_memo_holds(self%memo, self%faces%near%node, x, u0)
      do t = 1, size(self%faces%stencil)
         call patch_stencil_begin(self%faces%stencil(t), x, u0, is_start)
         call look(self, t, x, u0, du, self%knows_start .and. is_start)
      end do
      self%knows_start = is_start
      do f = 1, self%faces%sides%slave%n_facet
         self%theta(:, f) = 0.0_wp
         if (self%faces%is_dual) self%theta(:, f) = covered(self%basis(self%faces%split%start(f): &
            self%faces%split%start(f + 1) - 1))**3
      end do
   end subroutine find_bases

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

      if (.not. self%faces%may_close(i)) then
         self%state(i) = gap_state_t(size=self%state(i)%size)
         self%cover(i) = 0.0_wp
         self%scale(i) = least_cover*self%whole(i)
         return
      end if
      gap = 0.0_wp
      area = 0.0_wp
      ahead = huge(ahead)
      size_of = huge(size_of)
      deepest = 0.0_wp
      way = 0.0_wp
      do k = self%faces%start(i), self%faces%start(i + 1) - 1
         associate (basis => self%basis(self%faces%triangle(k)), stencil => self%faces%stencil( &
               self%faces%triangle(k)))
            if (stencil%triangle == 0) cycle
            do end = 0, 1
               weight = mortar_slave_weight(self%faces, k, self%theta(end, &
                  self%faces%split%facet(self%faces%triangle(k))))
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
         state = gap_state_t(size=state%size, other_size=size_of, slip_shift=state%slip_shift)
         state%is_near = maxval(area) > 0.0_wp
         state%is_covered = way <= self%chosen(2)
         state%is_over = area(1) >= least .or. (self%step%is_penalty .and. area(0) >= least)
         state%is_leaving = .not. state%is_over
         state%is_arriving = area(0) < least
         if (area(0) > 0.0_wp) state%gap0 = gap(0)/area(0) - self%offset &
            - self%sagitta(i)
         if (area(1) >= least) state%gap1 = gap(1)/area(1) - self%offset &
            - self%sagitta(i)
         if (state%is_arriving) state%was_open = &
            ahead - self%offset >= -max_penetration_on_entry*state%size
         if (.not. self%step%has_compliance) call leave_beside(self, i, &
            -merge(state%gap0, ahead - self%offset, area(0) > 0.0_wp), state)
         if (state%gap0 < -deepest - self%offset) state = gap_state_t(size=state%size)
      end associate
   end subroutine measure_vertex

   !> What part of constraint `i` is over the master itself, not past its end, at the start and at
   !> the end. By the shares of its vertex as they are on facets that are not covered: none is
   !> negative.
   pure function over_master(self, i) result(part)
      type(mortar_space_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp) :: part(0:1)
      integer :: k

      part = 0.0_wp
      do k = self%faces%start(i), self%faces%start(i + 1) - 1
         part = part + matmul(mortar_slave_weight(self%faces, k, 0.0_wp), &
            self%basis(self%faces%triangle(k))%own)
      end do
      part = part/self%whole(i)
   end function over_master

   !> Hard contact: what does not come over the master itself is not over it, and what begins deep
   !> behind it, and farther than it reaches in beyond its end, is beside it: the way out is there.
   pure subroutine leave_beside(self, i, depth, state)
      type(mortar_space_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in) :: depth              !! behind the master at the start [L]
      type(gap_state_t), intent(inout) :: state
      real(wp) :: part(0:1)

      part = over_master(self, i)
      state%is_over = state%is_over .and. maxval(part) >= least_own
      if (depth > room_beside*min(state%size, state%other_size) .and. depth &
         > part(0)*state%size) state = gap_state_t(size=state%size)
   end subroutine leave_beside

   pure subroutine mortar_evaluate(self, wanted, x, u0, du, target, item)
      class(mortar_space_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)           !! (n) numbers of constraints, ascending
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: target(:)          !! (n) [L]
      type(condition_t), intent(inout) :: item(:)   !! (n)
      type(sight_t), allocatable :: sight(:)     !! of the triangles that are asked
      integer :: slot(size(self%faces%stencil))  !! where each is in it; 0: nowhere
      integer, allocatable :: facet(:)
      integer :: place(self%n_constraint)        !! of each among `wanted`; 0: nowhere
      integer :: f, k, t
      logical :: is_chosen                       ! from here

      is_chosen = position_memo_holds(self%memo, self%faces%near%node, x, u0)
      place = 0
      place(wanted) = [(k, k = 1, size(wanted))]
      call find_asked(self%faces, wanted, facet, slot)
      allocate(sight(maxval([0, slot])))
      do f = 1, size(facet)
         associate (first => self%faces%split%start(facet(f)), &
               last => self%faces%split%start(facet(f) + 1) - 1)
            do t = first, last
               call patch_stencil_begin(self%faces%stencil(t), x, u0, is_chosen)
            end do
            call mortar_sight(self%faces, first, x, u0, du, all(item%leaves_second), &
               sight(slot(first):slot(last)))
            if (.not. any(item%has_friction)) cycle
            do t = first, last
               call mortar_slip_sight(self%slide(t), self%faces%stencil(t), x, u0, du, &
                  sight(slot(t))%slip)
            end do
         end associate
      end do
      do k = 1, size(wanted)
         call mortar_begin_sum(self%faces, wanted(k), slot, sight, item(k))
      end do
      do f = 1, size(facet)
         associate (first => slot(self%faces%split%start(facet(f))), &
               last => slot(self%faces%split%start(facet(f) + 1) - 1))
            call add_facet(self, facet(f), sight(first:last), place, target, item)
         end associate
      end do
      do k = 1, size(wanted)
         item(k)%size = self%state(wanted(k))%size
         if (.not. item(k)%has_friction) cycle
         call condition_resize_slip(item(k))
         call mortar_slip_add(self%slide, self%faces, wanted(k), slot, sight%slip, &
            axis_of(self, wanted(k)), item(k))
      end do
   end subroutine mortar_evaluate

   !> What slip of constraint `i` is counted along. It stays over the step, so that iterates that
   !> turn faces far do not turn friction.
   pure type(slip_axis_t) function axis_of(self, i) result(axis)
      type(mortar_space_t), intent(in) :: self
      integer, intent(in) :: i

      axis = slip_axis_t(self%along(:, i), slip_place(self%step))
   end function axis_of

   !> Add a facet to the conditions of its vertices.
   pure subroutine add_facet(self, f, sight, place, target, item)
      class(mortar_space_t), intent(in) :: self
      integer, intent(in) :: f
      type(sight_t), intent(in) :: sight(:)      !! of its triangles
      integer, intent(in) :: place(:)            !! (n_constraint) in the following; 0: none
      real(wp), intent(in) :: target(:)          !! (n) [L]
      type(condition_t), intent(inout) :: item(:)   !! (n)
      type(patch_sums_t) :: sums(size(sight))
      integer :: i, m

      call mortar_facet_sums(self%faces, self%faces%split%start(f), sight, &
         all(item%leaves_second), sums)
      do m = 1, self%faces%weights%n(f)
         i = self%faces%owner(m, f)
         if (i == 0) cycle
         if (place(i) > 0) call mortar_add_facet(self%faces, self%faces%entry(m, f), sight, sums, &
            target(place(i)) + self%offset + self%sagitta(i), self%scale(i), item(place(i)))
      end do
   end subroutine add_facet

   !> The facets of constraints, and numbers for their triangles.
   pure subroutine find_asked(faces, wanted, facet, slot)
      type(mortar_faces_t), intent(in) :: faces
      integer, intent(in) :: wanted(:)           !! 1..n_constraint
      integer, allocatable, intent(out) :: facet(:)
      integer, intent(out) :: slot(:)            !! (n_triangle) 1 to their number; 0: none
      logical :: is_asked(faces%sides%slave%n_facet)
      integer :: f, k, n, t

      is_asked = .false.
      do k = 1, size(wanted)
         is_asked(faces%split%facet(faces%triangle(faces%start(wanted(k)): &
            faces%start(wanted(k) + 1) - 1))) = .true.
      end do
      facet = pack([(f, f = 1, size(is_asked))], is_asked)
      slot = 0
      n = 0
      do k = 1, size(facet)
         do t = faces%split%start(facet(k)), faces%split%start(facet(k) + 1) - 1
            n = n + 1
            slot(t) = n
         end do
      end do
   end subroutine find_asked

   !> As `contact_t` has it.
   pure function mortar_slip(self, i, x, u0, du) result(slip)
      class(mortar_space_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp) :: slip(size(x, 1) - 1)           !! [L]

      slip = 0.0_wp
      if (allocated(self%slide)) slip = mortar_slip_of(self%slide, self%faces, i, x, u0, du, &
         axis_of(self, i))
   end function mortar_slip

   !> Beside what a mean lets in, the chords of curved surfaces cross by their rises.
   pure real(wp) function mortar_lets_in(self) result(lets_in)
      class(mortar_space_t), intent(in) :: self

      lets_in = touching_bar
      if (allocated(self%rise)) lets_in = lets_in + mortar_rise_largest(self%rise, self%faces)
   end function mortar_lets_in

end module emcon_mortar_space
