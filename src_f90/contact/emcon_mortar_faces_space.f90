!> Slave facets of mortar contact in space: their triangles, the multipliers of their vertices, and
!> what of the master each triangle may see. Source: docs/theory.md, section 14.2.
module emcon_mortar_faces_space
   use emcon_errors, only : error_t
   use emcon_facet_frames_space, only : facet_frames_init
   use emcon_element_kind, only : max_face_nodes
   use emcon_facets, only : facets_init, facets_length
   use emcon_interactions, only : contact_pair_t, interaction_reach
   use emcon_kinds, only : wp
   use emcon_mortar_itself_space, only : mortar_itself_facet, mortar_itself_init, &
      mortar_itself_meets, mortar_itself_t
   use emcon_mortar_slave_space, only : mortar_slave_init, mortar_slave_t
   use emcon_near_list, only : near_list_init, near_list_t, near_list_update, near_list_within
   use emcon_patch_near_space, only : narrow_flange, patch_outline, patch_outline_misses, &
      patch_outline_t, patch_scope_t
   use emcon_patch_sides_space, only : patch_sides_t, patch_triangles_init
   use emcon_patch_stencil_space, only : patch_stencil_choose, patch_stencil_t
   use emcon_scene, only : scene_t
   use emcon_sort, only : find_sorted, unique_sorted
   use emcon_touch_rule_space, only : touch_rule_space_depths, touch_rule_space_init
   implicit none
   private
   public :: mortar_faces_t, mortar_faces_init, mortar_faces_look, mortar_faces_choose

   !> A triangle may see in a step what is beside it by no more than this fraction of the mean facet
   !> of the master, or than what goes along it by the motion of both sides and by its own turning.
   real(wp), parameter :: beside_per_facet = 0.05_wp, beside_per_motion = 4.0_wp

   !> A vertex may close in a step if a facet of it is no farther off than this fraction of the mean
   !> facet of the master, or than what two nodes can close by the largest motion in the step.
   real(wp), parameter :: close_per_facet = 0.05_wp, close_per_motion = 2.0_wp

   type, extends(mortar_slave_t) :: mortar_faces_t
      type(patch_sides_t) :: sides
      type(mortar_itself_t) :: itself                 !! in contact with itself
      type(near_list_t) :: near
      real(wp) :: beside = 0.0_wp                     !! so far beside triangles, as above [L]
      real(wp) :: close = 0.0_wp                      !! so far off a facet may close, as above [L]
      logical, allocatable :: may_close(:)            !! (n) in the step, or are watched: only
                                                      !! these are measured
      logical :: gives_way = .false.                  !! bodies may be deep in each other
      integer :: n_sifted = 0                         !! the list that `sift` has gone through
      type(patch_stencil_t), allocatable :: stencil(:)   !! (n_triangle)
   end type mortar_faces_t

contains

   !> Set up the facets of `pair`.
   subroutine mortar_faces_init(self, scene, pair, error)
      type(mortar_faces_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error

      associate (sides => self%sides)
         call facets_init(sides%slave, scene, scene%surface(pair%slave), error)
         if (allocated(error)) return
         allocate(sides%master)
         call facets_init(sides%master, scene, scene%surface(pair%master), error)
         if (allocated(error)) return
         if (pair%slave == pair%master) then
            call touch_rule_space_init(sides%rule, sides%master, [integer ::], scene)
            call mortar_itself_init(self%itself, sides%slave, sides%rule, scene%x)
         end if
         call mortar_slave_init(self, sides%slave, scene%x)
         if (sides%rule%is_self) then
            sides%rule%facet_of_point = mortar_itself_facet(self%itself, self%split%facet)
            sides%rule%body_of_point = sides%rule%body(sides%rule%facet_of_point)
         end if
         sides%rule%depth = touch_rule_space_depths(sides%master, scene)
         sides%rule%own_depth = touch_rule_space_depths(sides%slave, scene)
         sides%rule%own_depth = sides%rule%own_depth(self%split%facet)
         call facet_frames_init(sides%frames, sides%slave, self%split)
         call patch_triangles_init(sides%triangles, sides%master, scene%x)
         allocate(sides%mirror(sides%master%n_facet), source=0)
         call near_list_init(self%near, sides%slave%facet, sides%master%facet, scene%x, scene%u0, &
            pair%interaction%offset + interaction_reach(pair%interaction))
      end associate
      allocate(self%stencil(size(self%split%facet)))
      self%may_close = spread(.false., 1, size(self%node))
   end subroutine mortar_faces_init

   !> Look for what facets of the master are near each of the slave.
   pure subroutine mortar_faces_look(self, x, u0, du, reach)
      type(mortar_faces_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(inout) :: reach           !! what is farther is not near; it only grows [L]

      call near_list_update(self%near, x, u0, du, reach)
      associate (near => self%near)
         self%beside = max(beside_per_facet*near%facet_size, beside_per_motion*near%motion)
         self%close = near%depth + max(close_per_facet*near%facet_size, &
            close_per_motion*near%motion)
      end associate
      if (self%sides%rule%is_self .and. self%n_sifted /= self%near%n_list) call sift(self)
   end subroutine mortar_faces_look

   !> Leave out of a new list of candidates what a surface never touches of itself.
   pure subroutine sift(self)
      type(mortar_faces_t), intent(inout) :: self
      integer :: f, k, from, n

      n = 0
      associate (list => self%near%candidates, sides => self%sides)
         do f = 1, size(list%start) - 1
            from = list%start(f)
            list%start(f) = n + 1
            do k = from, list%start(f + 1) - 1
               if (.not. mortar_itself_meets(self%itself, sides%rule, sides%master, f, &
                  list%facet(k))) cycle
               n = n + 1
               list%facet(n) = list%facet(k)
            end do
         end do
         list%start(size(list%start)) = n + 1
      end associate
      self%near%candidates%facet = self%near%candidates%facet(:n)
      if (n == 0) self%near%nearest = self%near%reach
      self%n_sifted = self%near%n_list
   end subroutine sift

   !> The stencils of all triangles for a step that begins at x + u0; none where no vertex of their
   !> facet may close.
   pure subroutine mortar_faces_choose(self, x, u0, reach, is_watched)
      type(mortar_faces_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: reach              !! what is farther is not seen [L]
      logical, intent(in), optional :: is_watched(:)   !! (n) measured if they are near; none
      logical :: is_wanted(self%sides%slave%n_facet)
      integer :: f, i

      is_wanted = [(comes_close(self, f), f = 1, size(is_wanted))]
      do i = 1, size(self%node)
         self%may_close(i) = any(is_wanted(facets_of(self, i)))
      end do
      if (present(is_watched)) self%may_close = self%may_close .or. is_watched
      do i = 1, size(self%node)
         if (self%may_close(i)) is_wanted(facets_of(self, i)) = .true.
      end do
      self%stencil%triangle = 0
      do f = 1, size(is_wanted)
         if (is_wanted(f)) call choose_facet(self, f, x, u0, reach)
      end do
   end subroutine mortar_faces_choose

   !> The slave facets of vertex `i`, each as often as it has triangles.
   pure function facets_of(self, i) result(f)
      type(mortar_faces_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n
      integer :: f(self%start(i + 1) - self%start(i))

      f = self%split%facet(self%triangle(self%start(i):self%start(i + 1) - 1))
   end function facets_of

   !> May slave facet `f` close in the step?
   pure logical function comes_close(self, f)
      type(mortar_faces_t), intent(in) :: self
      integer, intent(in) :: f                   !! 1..n_facet of the slave
      integer :: k

      comes_close = .false.
      associate (list => self%near%candidates)
         do k = list%start(f), list%start(f + 1) - 1
            comes_close = near_list_within(self%near, f, list%facet(k), self%close)
            if (comes_close) return
         end do
      end associate
   end function comes_close

   !> The stencils of the triangles of slave facet `f`.
   pure subroutine choose_facet(self, f, x, u0, reach)
      type(mortar_faces_t), intent(inout) :: self
      integer, intent(in) :: f                   !! 1..n_facet of the slave
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: reach              !! what is farther is not seen [L]
      integer, allocatable :: seen(:)
      type(patch_scope_t) :: scope
      integer :: k, t

      associate (list => self%near%candidates)
         associate (of => list%facet(list%start(f):list%start(f + 1) - 1))
            seen = pack(of, [(near_list_within(self%near, f, of(k), reach), k = 1, size(of))])
         end associate
      end associate
      scope%beside = self%beside
      scope%gives_way = self%gives_way
      do t = self%split%start(f), self%split%start(f + 1) - 1
         scope%facet = with_neighbours(self, f, ahead_of(self, t, seen, x, u0))
         scope%is_far = [(find_sorted(seen, scope%facet(k)) == 0, k = 1, size(scope%facet))]
         call patch_stencil_choose(self%stencil(t), self%sides, t, scope, x, u0)
      end do
   end subroutine choose_facet

   !> Facets of the master that are not beside triangle `t` of the slave.
   pure function ahead_of(self, t, facet, x, u0) result(ahead)
      type(mortar_faces_t), intent(in) :: self
      integer, intent(in) :: t                   !! 1..n_triangle
      integer, intent(in) :: facet(:)
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      integer, allocatable :: ahead(:)
      type(patch_outline_t) :: outline
      real(wp) :: corner(3, max_face_nodes)
      logical :: is_ahead(size(facet))
      integer :: i, k, n

      outline = patch_outline(self%sides, t, x, u0)
      associate (master => self%sides%master, base => self%sides%frames%base(t))
         do k = 1, size(facet)
            n = count(master%facet(:, facet(k)) > 0)
            do i = 1, n
               associate (node => master%facet(i, facet(k)))
                  corner(:, i) = (x(:, node) - x(:, base)) + (u0(:, node) - u0(:, base))
               end associate
            end do
            is_ahead(k) = .not. patch_outline_misses(outline, corner(:, :n), self%beside &
               + narrow_flange*facets_length(master, facet(k)))
         end do
      end associate
      ahead = pack(facet, is_ahead)
   end function ahead_of

   !> Facets of the master, and all that share a node with them and that slave facet `f` may meet:
   !> the field over the former ends where the surface does, not where the list does.
   pure function with_neighbours(self, f, seen) result(near)
      type(mortar_faces_t), intent(in) :: self
      integer, intent(in) :: f                   !! 1..n_facet of the slave
      integer, intent(in) :: seen(:)             !! facets
      integer, allocatable :: near(:)            !! ascending
      integer :: i, k, n, pass

      do pass = 1, 2
         n = 0
         do k = 1, size(seen)
            associate (master => self%sides%master, corner => self%sides%master%corner(:, seen(k)))
               do i = 1, count(corner > 0)
                  associate (first => master%around_start(corner(i)), &
                        last => master%around_start(corner(i) + 1) - 1)
                     if (pass == 2) near(n + 1:n + 1 + last - first) = master%around(first:last)
                     n = n + 1 + last - first
                  end associate
               end do
            end associate
         end do
         if (pass == 1) allocate(near(n))
      end do
      associate (master => self%sides%master)
         near = unique_sorted(near)
         if (self%sides%rule%is_self) near = pack(near, [(mortar_itself_meets(self%itself, &
            self%sides%rule, master, f, near(k)), k = 1, size(near))])
      end associate
   end function with_neighbours

end module emcon_mortar_faces_space
