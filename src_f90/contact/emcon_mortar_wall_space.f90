!> Mortar contact in space with a wall: its distance, integrated over slave facets with one weight
!> for each vertex of them. Source: docs/theory.md, section 14.2.
module emcon_mortar_wall_space
   use emcon_bulges_space, only : bulges_doubt, bulges_find, bulges_largest, bulges_rise, bulges_t
   use emcon_condition_nodes, only : condition_resize_slip
   use emcon_constraint, only : condition_t
   use emcon_contact, only : gap_state_t, max_penetration_on_entry, push_place
   use emcon_contact_law, only : contact_laws_rub
   use emcon_contact_law_registry, only : contact_laws_of_surface
   use emcon_errors, only : error_t
   use emcon_facets, only : facets_length
   use emcon_frame_vertex_space, only : frame_size
   use emcon_guards, only : touching_bar
   use emcon_interactions, only : contact_options_t, contact_pair_t, interaction_reach, &
      multiplier_dual
   use emcon_kinds, only : wp
   use emcon_mortar_means_space, only : mortar_means_init, mortar_means_t
   use emcon_mortar_wall_faces_space, only : wall_faces_choose, wall_faces_corners, &
      wall_faces_init, wall_faces_sum, wall_faces_t, wall_faces_weight
   use emcon_mortar_wall_gap_space, only : n_corner, n_part_point, n_point, point, &
      wall_triangle_heights, wall_triangle_look, wall_triangle_rise, wall_triangle_t
   use emcon_mortar_wall_slip_space, only : mortar_wall_slip_add, mortar_wall_slip_choose, &
      mortar_wall_slip_of, wall_slides_t
   use emcon_scene, only : scene_t
   use emcon_wall_distance_space, only : wall_at, wall_ends_here, wall_find, wall_is_solid, &
      wall_spot_t
   implicit none
   private
   public :: mortar_wall_t, mortar_wall_init

   !> So far, per facet, a mean gap may be closed where contact begins; behind a shape without ends
   !> it is closed however deep it is.
   real(wp), parameter :: deepest_start = 0.2_wp
   !> Facets are near within this part of one, or within so many of the largest motion of a node in
   !> the step.
   real(wp), parameter :: near_per_facet = 0.5_wp, near_per_motion = 2.0_wp

   type, extends(mortar_means_t) :: mortar_wall_t
      type(wall_faces_t) :: faces
      type(bulges_t), allocatable :: bulges           !! of the slave; only if gaps follow arcs
      !> (corner, 0:1, n_triangle) integrals with the weights that are 1 at one corner
      real(wp), allocatable :: height(:, :, :), area_of(:, :, :)
      real(wp), allocatable :: size(:)                !! (n_constraint) mean facet there [L]
      !> What slip is made of in the step; with friction
      type(wall_slides_t), allocatable :: slide
      real(wp) :: depth = 0.0_wp                      !! that pads and laws reach [L]
   contains
      procedure :: configure => mortar_wall_configure
      procedure :: follow_arcs => mortar_wall_follow_arcs
      procedure :: curve_doubt => mortar_wall_curve_doubt
      procedure :: begin_points => mortar_wall_begin_step
      procedure :: measure_points => mortar_wall_measure
      procedure :: evaluate_points => mortar_wall_evaluate
      procedure :: slip_points => mortar_wall_slip
      procedure :: mean_size => mortar_wall_mean_size
      procedure :: lets_in => mortar_wall_lets_in
   end type mortar_wall_t

contains

   !> Set up the pair `pair` of `scene`, whose master is a wall.
   subroutine mortar_wall_init(self, scene, pair, error)
      type(mortar_wall_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error

      call wall_faces_init(self%faces, scene, pair, error)
      if (allocated(error)) return
      self%node = self%faces%node
      self%n_constraint = size(self%node)
      call make_room(self)
      self%depth = pair%interaction%offset + interaction_reach(pair%interaction)
      self%may_leave = .true.
      self%offset = pair%interaction%offset
      self%max_penetration_at_start = merge(huge(1.0_wp), deepest_start, &
         wall_is_solid(self%faces%wall))
      call contact_laws_of_surface(pair%interaction, self%laws)
      if (contact_laws_rub(self%laws)) then
         allocate(self%slide)
         allocate(self%slide%area(size(self%faces%is_facing)), source=0.0_wp)
      end if
   end subroutine mortar_wall_init

   !> Room for what a step knows, and sizes in the reference.
   pure subroutine make_room(self)
      type(mortar_wall_t), intent(inout) :: self
      real(wp) :: whole(self%n_constraint)
      integer :: i, k

      allocate(self%state(self%n_constraint))
      allocate(self%size(self%n_constraint), source=0.0_wp)
      whole = 0.0_wp
      associate (split => self%faces%split, n_triangle => size(self%faces%split%facet))
         allocate(self%height(n_corner, 0:1, n_triangle), self%area_of(n_corner, 0:1, &
            n_triangle), source=0.0_wp)
         do i = 1, self%n_constraint
            do k = self%faces%start(i), self%faces%start(i + 1) - 1
               associate (f => split%facet(self%faces%triangle(k)))
                  whole(i) = whole(i) + self%faces%slave%size(f)/real(split%start(f + 1) &
                     - split%start(f), wp)*sum(self%faces%weights%linear(:, self%faces%vertex(k), &
                     self%faces%triangle(k)))/3.0_wp
                  self%size(i) = self%size(i) + facets_length(self%faces%slave, f) &
                     /real(self%faces%start(i + 1) - self%faces%start(i), wp)
               end associate
            end do
         end do
      end associate
      call mortar_means_init(self, whole)
   end subroutine make_room

   pure subroutine mortar_wall_configure(self, x, options)
      class(mortar_wall_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (3, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options

      self%faces%is_dual = options%multiplier == multiplier_dual
   end subroutine mortar_wall_configure

   !> Measure gaps of the curved surface that the slave stands for, or of its facets. A wall is
   !> curved itself.
   pure subroutine mortar_wall_follow_arcs(self, x, options, is_wanted)
      class(mortar_wall_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (3, n_node) reference positions [L]
      type(contact_options_t), intent(in) :: options
      logical, intent(in) :: is_wanted           !! else of facets

      self%sagitta = 0.0_wp
      if (allocated(self%bulges)) deallocate(self%bulges)
      if (.not. is_wanted) return
      allocate(self%bulges)
      call bulges_find(self%bulges, self%faces%slave, self%faces%split, x, options%smoothing_angle)
   end subroutine mortar_wall_follow_arcs

   pure real(wp) function mortar_wall_curve_doubt(self) result(doubt)
      class(mortar_wall_t), intent(in) :: self

      doubt = 0.0_wp
      if (allocated(self%bulges)) doubt = bulges_doubt(self%bulges, self%faces%split)
   end function mortar_wall_curve_doubt

   !> How much less the distance of the slave's surface is than that of its facets.
   pure subroutine find_sagittas(self, x, u0)
      type(mortar_wall_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      real(wp) :: corner(3, n_corner), excess(n_corner, size(self%faces%is_facing))
      real(wp) :: rise(n_point), total
      integer :: i, k, q, t

      do t = 1, size(self%faces%is_facing)
         if (.not. self%faces%is_facing(t)) cycle
         corner = wall_faces_corners(self%faces, t, x) + wall_faces_corners(self%faces, t, u0)
         rise = [(bulges_rise(self%bulges, self%faces%split, t, point(:, q)), q = 1, n_point)]
         excess(:, t) = wall_triangle_rise(self%faces%wall, wall_at(self%faces%wall, x, u0), &
            corner, rise)
         self%area_of(:, 0, t) = frame_size(corner)/6.0_wp
      end do
      do i = 1, self%n_constraint
         total = 0.0_wp
         self%cover(i) = 0.0_wp
         do k = self%faces%start(i), self%faces%start(i + 1) - 1
            associate (t => self%faces%triangle(k), weight => wall_faces_weight(self%faces, k))
               if (.not. self%faces%is_facing(t)) cycle
               total = total + dot_product(weight, excess(:, t))
               self%cover(i) = self%cover(i) + dot_product(weight, self%area_of(:, 0, t))
            end associate
         end do
         self%sagitta(i) = 0.0_wp
         if (self%cover(i) > 0.0_wp) self%sagitta(i) = total/self%cover(i)
      end do
   end subroutine find_sagittas

   !> Choose which triangles face the wall. Near is all that a step may bring there.
   pure subroutine mortar_wall_begin_step(self, x, u0, du)
      class(mortar_wall_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]

      self%reach = max(self%reach, self%depth + near_per_facet*maxval([0.0_wp, self%size]), &
         self%depth + near_per_motion*sqrt(maxval([0.0_wp, sum(du(:, self%node)**2, 1)])))
      ! A wall that turns may move by more than its nodes: what is far now may be near soon.
      call self%has_looked(0.0_wp)
      call wall_faces_choose(self%faces, x, u0)
      if (allocated(self%bulges)) call find_sagittas(self, x, u0)
      if (allocated(self%slide)) self%slide = mortar_wall_slip_choose(self%faces, x, u0, du, &
         push_place(self%step))
   end subroutine mortar_wall_begin_step

   !> Mean gaps at both ends of the step.
   pure subroutine mortar_wall_measure(self, x, u0, du)
      class(mortar_wall_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp) :: at(3, 4, 0:1), corner(3, n_corner)
      integer :: i, t

      at(:, :, 0) = wall_at(self%faces%wall, x, u0)
      at(:, :, 1) = at(:, :, 0) + du(:, self%faces%wall%node)
      do t = 1, size(self%faces%is_facing)
         if (.not. self%faces%is_facing(t)) cycle
         corner = wall_faces_corners(self%faces, t, x) + wall_faces_corners(self%faces, t, u0)
         call wall_triangle_heights(self%faces%wall, at(:, :, 0), corner, self%height(:, 0, t), &
            self%area_of(:, 0, t))
         corner = corner + wall_faces_corners(self%faces, t, du)
         call wall_triangle_heights(self%faces%wall, at(:, :, 1), corner, self%height(:, 1, t), &
            self%area_of(:, 1, t))
      end do
      do i = 1, self%n_constraint
         associate (place => x(:, self%node(i)) + u0(:, self%node(i)))
            call measure_vertex(self, i, wall_find(self%faces%wall, at(:, :, 0), place), &
               wall_find(self%faces%wall, at(:, :, 1), place + du(:, self%node(i))))
         end associate
      end do
   end subroutine mortar_wall_measure

   !> The gap of constraint `i`, by what its triangles see, and its vertex at both ends of the step:
   !> past an end of the wall it is let go.
   pure subroutine measure_vertex(self, i, from, to)
      type(mortar_wall_t), intent(inout) :: self
      integer, intent(in) :: i
      type(wall_spot_t), intent(in) :: from, to
      real(wp) :: gap(0:1), area(0:1)
      logical :: is_over(0:1)
      integer :: k

      gap = 0.0_wp
      area = 0.0_wp
      do k = self%faces%start(i), self%faces%start(i + 1) - 1
         associate (t => self%faces%triangle(k), weight => wall_faces_weight(self%faces, k))
            if (.not. self%faces%is_facing(t)) cycle
            gap = gap + matmul(weight, self%height(:, :, t))
            area = area + matmul(weight, self%area_of(:, :, t))
         end associate
      end do
      is_over = .not. wall_ends_here(self%faces%wall, [from, to])
      associate (state => self%state(i))
         state = gap_state_t(size=self%size(i), other_size=self%size(i))
         self%cover(i) = area(1)
         if (.not. all(area > 0.0_wp)) return
         self%scale(i) = area(0)
         state%gap0 = gap(0)/area(0) - self%offset - self%sagitta(i)
         state%gap1 = gap(1)/area(1) - self%offset - self%sagitta(i)
         state%is_near = any(is_over) .and. min(state%gap0, state%gap1) <= self%reach
         ! What stores energy is followed as long as there is any to give back.
         state%is_over = is_over(1) .or. (self%step%is_penalty .and. is_over(0))
         state%is_leaving = .not. state%is_over
         state%is_arriving = .not. is_over(0)
         if (state%is_arriving) state%was_open = state%gap0 >= -max_penetration_on_entry*state%size
         ! Behind a shape that ends, the other side of it is farther away than this.
         associate (wall => self%faces%wall)
            if (.not. wall_is_solid(wall) .and. from%distance < -0.5_wp*wall%extent) then
               state = gap_state_t(size=self%size(i))
            end if
         end associate
      end associate
   end subroutine measure_vertex

   pure subroutine mortar_wall_evaluate(self, wanted, x, u0, du, target, item)
      class(mortar_wall_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)           !! (n) numbers of constraints, ascending
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: target(:)          !! (n) [L]
      type(condition_t), intent(inout) :: item(:)   !! (n)
      type(wall_triangle_t) :: sight(size(self%faces%is_facing))
      real(wp), dimension(3, n_part_point) :: at, way
      integer :: i, k

      at(:, n_corner + 1:) = x(:, self%faces%wall%node(:3)) + u0(:, self%faces%wall%node(:3))
      way(:, n_corner + 1:) = du(:, self%faces%wall%node(:3))
      do k = 1, size(wanted)
         do i = self%faces%start(wanted(k)), self%faces%start(wanted(k) + 1) - 1
            associate (t => self%faces%triangle(i))
               if (.not. self%faces%is_facing(t) .or. allocated(sight(t)%gap)) cycle
               at(:, :n_corner) = wall_faces_corners(self%faces, t, x) &
                  + wall_faces_corners(self%faces, t, u0)
               way(:, :n_corner) = wall_faces_corners(self%faces, t, du)
               call wall_triangle_look(self%faces%wall, at, way, all(item%leaves_second), sight(t))
            end associate
         end do
         call wall_faces_sum(self%faces, wanted(k), sight, target(k) + self%offset &
            + self%sagitta(wanted(k)), self%scale(wanted(k)), item(k))
         item(k)%size = self%size(wanted(k))
         if (.not. item(k)%has_friction) cycle
         call condition_resize_slip(item(k))
         call mortar_wall_slip_add(self%slide, self%faces, wanted(k), x, u0, du, item(k))
      end do
   end subroutine mortar_wall_evaluate

   !> As `contact_t` has it.
   pure function mortar_wall_slip(self, i, x, u0, du) result(slip)
      class(mortar_wall_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp) :: slip(size(x, 1) - 1)           !! [L]

      slip = 0.0_wp
      if (allocated(self%slide)) slip = mortar_wall_slip_of(self%slide, self%faces, i, x, u0, &
         du)
   end function mortar_wall_slip

   pure real(wp) function mortar_wall_mean_size(self, x) result(length)
      class(mortar_wall_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (3, n_node) reference positions [L]

      length = huge(length)
      if (self%n_constraint > 0) length = sum(self%size)/self%n_constraint
   end function mortar_wall_mean_size

   !> Beside what a mean lets in, the chords of a curved surface cross a wall by their rises.
   pure real(wp) function mortar_wall_lets_in(self) result(lets_in)
      class(mortar_wall_t), intent(in) :: self
      integer :: t

      lets_in = touching_bar
      if (allocated(self%bulges)) lets_in = lets_in + bulges_largest(self%bulges, &
         self%faces%split, [(facets_length(self%faces%slave, self%faces%split%facet(t)), &
         t = 1, size(self%faces%is_facing))])
   end function mortar_wall_lets_in

end module emcon_mortar_wall_space
