!> Which facets a contact point may touch: where a surface in space is in contact with itself, and
!> what is on the far side of thin bodies.
!>
!> Points are its nodes, then the middles of some facets. The surface may run over many bodies. As a
!> point may touch several of them at once, it has a constraint for each class of bodies. Of its own
!> body it never touches the facets around it, nor those beside them, nor another closed surface,
!> nor what it is behind with the body in between.
!> Source: docs/theory.md, section 14.
module emcon_touch_rule_space
   use emcon_bodies, only : bodies_find_tied
   use emcon_facets, only : facets_normal, facets_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: touch_rule_space_t, touch_rule_space_init, touch_rule_space_sees, &
      touch_rule_space_may, touch_rule_space_meet, touch_rule_space_is_through, &
      touch_rule_space_is_beyond, touch_rule_space_depth, touch_rule_space_depths, &
      touch_rule_space_measure

   !> Classes of bodies at most, and with them constraints of a frame.
   integer, parameter :: most_classes = 4
   !> Behind a facet by more than this part of the element there, a node of the body is on the other
   !> side of it: under it, where the way there and the normal have a cosine below this. The same
   !> holds of another body, by more than this part of the elements of both.
   real(wp), parameter, public :: through = 0.5_wp
   real(wp), parameter :: under = -0.5_wp

   type :: touch_rule_space_t
      logical :: is_self = .false.               !! else any node may touch any facet
      integer :: n_class = 1
      integer, allocatable :: body(:)            !! (n_facet)
      integer, allocatable :: middle(:)          !! facets whose middles are points
      integer, allocatable :: body_of_point(:)   !! (n_node of the facets + size of `middle`)
      !> Of points in the middle of facets: which facet each is on; not allocated: of none
      integer, allocatable :: facet_of_point(:)
      real(wp), allocatable :: depth(:)          !! (n_facet) of the element behind it [L]
      real(wp), allocatable :: own_depth(:)      !! (n_point) the same of points, the least [L]
      logical, allocatable :: is_closed(:)       !! (n_facet) its connected part has no rim
   end type touch_rule_space_t

contains

   !> The rule for the facets of a surface in contact with itself, whose bodies fall into classes in
   !> turn.
   pure subroutine touch_rule_space_init(self, facets, middle, scene)
      type(touch_rule_space_t), intent(out) :: self
      type(facets_t), intent(in) :: facets       !! in space
      integer, intent(in) :: middle(:)           !! facets whose middles are points
      type(scene_t), intent(in) :: scene
      integer, allocatable :: body(:)
      logical, allocatable :: has_rim(:)
      integer :: f, n_body

      self%is_self = .true.
      call bodies_find_tied(scene, facets%facet, body, n_body)
      self%body = body(facets%facet(1, :))
      self%middle = middle
      self%body_of_point = body([facets%node, facets%facet(1, middle)])
      self%n_class = max(1, min(n_body, most_classes))
      allocate(has_rim(facets%n_facet), source=.false.)
      do f = 1, facets%n_facet
         if (any(facets%neighbour(:, f) == 0 .and. facets%facet(:, f) > 0)) then
            has_rim(facets%part(f)) = .true.
         end if
      end do
      self%is_closed = .not. has_rim(facets%part)
      self%depth = touch_rule_space_depths(facets, scene)
   end subroutine touch_rule_space_init

   !> Measure how thick elements are behind facets and points that are nodes, then middles.
   pure subroutine touch_rule_space_measure(self, slave, master, middle, scene)
      type(touch_rule_space_t), intent(inout) :: self
      type(facets_t), intent(in) :: slave, master    !! in space; of points and of facets
      integer, intent(in) :: middle(:)           !! facets of the slave whose middles are points
      type(scene_t), intent(in) :: scene
      real(wp) :: own(slave%n_facet)
      integer :: i

      self%depth = touch_rule_space_depths(master, scene)
      own = touch_rule_space_depths(slave, scene)
      associate (start => slave%around_start)
         self%own_depth = [(minval(own(slave%around(start(i):start(i + 1) - 1))), &
            i = 1, size(slave%node)), own(middle)]
      end associate
   end subroutine touch_rule_space_measure

   !> How far the elements behind facets reach behind them in the reference [L].
   pure function touch_rule_space_depths(facets, scene) result(depth)
      type(facets_t), intent(in) :: facets       !! in space
      type(scene_t), intent(in) :: scene
      real(wp) :: depth(facets%n_facet)
      real(wp) :: still(size(scene%x, 1), size(scene%x, 2))
      integer :: f

      still = 0.0_wp
      depth = [(depth_behind(facets, f, scene, still), f = 1, facets%n_facet)]
   end function touch_rule_space_depths

   !> How far the element behind facet `f` reaches behind it in the reference; where there is none,
   !> as far as the facet is long [L].
   pure real(wp) function depth_behind(facets, f, scene, still) result(depth)
      type(facets_t), intent(in) :: facets
      integer, intent(in) :: f                   !! 1 to n_facet
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: still(:, :)        !! (3, n_node) zeros
      real(wp) :: normal(3)
      integer :: k

      depth = sqrt(facets%size(f))
      if (facets%element(f) == 0) return
      normal = facets_normal(facets, f, scene%x, still)/facets%size(f)
      depth = 0.0_wp
      associate (node => scene%element%node(:, facets%element(f)), first => facets%facet(1, f))
         do k = 1, size(node)
            if (node(k) == 0) cycle
            depth = max(depth, -dot_product(normal, scene%x(:, node(k)) - scene%x(:, first)))
         end do
      end associate
   end function depth_behind

   !> Does a constraint of class `class` look at facet `f`?
   pure logical function touch_rule_space_sees(self, class, f) result(sees)
      type(touch_rule_space_t), intent(in) :: self
      integer, intent(in) :: class               !! 1 to n_class
      integer, intent(in) :: f                   !! 1 to n_facet

      sees = .true.
      if (self%n_class > 1) sees = 1 + mod(self%body(f) - 1, self%n_class) == class
   end function touch_rule_space_sees

   !> May point `i` ever touch facet `f`?
   pure logical function touch_rule_space_may(self, facets, i, f) result(may)
      type(touch_rule_space_t), intent(in) :: self
      type(facets_t), intent(in) :: facets       !! that the rule is for
      integer, intent(in) :: i                   !! a node, or behind these a middle
      integer, intent(in) :: f                   !! 1 to n_facet
      integer :: k

      may = .true.
      if (.not. self%is_self) return
      if (self%body_of_point(i) /= self%body(f)) return
      if (i > size(facets%node)) then
         may = may_facets_touch(self, facets, self%middle(i - size(facets%node)), f)
         return
      end if
      do k = facets%around_start(i), facets%around_start(i + 1) - 1
         may = may_facets_touch(self, facets, facets%around(k), f)
         if (.not. may) return
      end do
   end function touch_rule_space_may

   !> May a place on facet `own` ever touch facet `f`?
   pure logical function touch_rule_space_meet(self, facets, own, f) result(meet)
      type(touch_rule_space_t), intent(in) :: self
      type(facets_t), intent(in) :: facets       !! that the rule is for
      integer, intent(in) :: own, f              !! 1 to n_facet

      meet = .true.
      if (self%is_self .and. self%body(own) == self%body(f)) then
         meet = may_facets_touch(self, facets, own, f)
      end if
   end function touch_rule_space_meet

   !> May a point of facet `own` of a body touch facet `f` of it?
   pure logical function may_facets_touch(self, facets, own, f) result(may)
      type(touch_rule_space_t), intent(in) :: self
      type(facets_t), intent(in) :: facets
      integer, intent(in) :: own, f              !! 1 to n_facet

      may = .not. (facets%part(own) /= facets%part(f) .and. self%is_closed(own) .and. &
         self%is_closed(f))
      if (may) may = .not. shares_a_node(facets, own, f)
   end function may_facets_touch

   !> Have two facets a node in common?
   pure logical function shares_a_node(facets, f, g) result(shares)
      type(facets_t), intent(in) :: facets
      integer, intent(in) :: f, g
      integer :: k

      shares = .false.
      do k = 1, size(facets%facet, 1)
         if (facets%facet(k, f) == 0) return
         shares = any(facets%facet(:, g) == facets%facet(k, f))
         if (shares) return
      end do
   end function shares_a_node

   !> Is point `i` on the other side of its own body, seen from facet `f`, or of another one?
   pure logical function touch_rule_space_is_through(self, i, f, normal, way, gives_way) &
      result(is_through)
      type(touch_rule_space_t), intent(in) :: self
      integer, intent(in) :: i                   !! as in `touch_rule_space_may`
      integer, intent(in) :: f                   !! 1 to n_facet
      real(wp), intent(in) :: normal(3)          !! of it or a part of it, of length 1, outwards
      real(wp), intent(in) :: way(3)             !! from its nearest place to the node [L]
      logical, intent(in) :: gives_way           !! other bodies may be deep in this one
      real(wp) :: distance

      distance = sqrt(dot_product(way, way))
      is_through = distance > touch_rule_space_depth(self, i, f, gives_way) .and. &
         dot_product(way, normal) < under*distance
   end function touch_rule_space_is_through

   !> How far behind facet `f` point `i` is on the other side of a body [L].
   pure real(wp) function touch_rule_space_depth(self, i, f, gives_way) result(depth)
      type(touch_rule_space_t), intent(in) :: self
      integer, intent(in) :: i                   !! as in `touch_rule_space_may`
      integer, intent(in) :: f                   !! 1 to n_facet
      logical, intent(in) :: gives_way           !! other bodies may be deep in this one

      if (is_own(self, i, f)) then
         depth = through*self%depth(f)
      else if (gives_way .or. .not. allocated(self%own_depth)) then
         depth = huge(depth)
      else
         depth = through*(self%depth(f) + self%own_depth(i))
      end if
   end function touch_rule_space_depth

   !> Is facet `f` of the body that point `i` is of?
   pure logical function is_own(self, i, f)
      type(touch_rule_space_t), intent(in) :: self
      integer, intent(in) :: i, f

      is_own = self%is_self
      if (is_own) is_own = self%body_of_point(i) == self%body(f)
   end function is_own

   !> Is facet `f` on the other side of its own body, seen from point `i` in the middle of a facet?
   pure logical function touch_rule_space_is_beyond(self, i, f, normal, way) result(is_beyond)
      type(touch_rule_space_t), intent(in) :: self
      integer, intent(in) :: i                   !! point
      integer, intent(in) :: f                   !! 1 to n_facet
      real(wp), intent(in) :: normal(3)          !! of the facet of the point, of length 1, outwards
      real(wp), intent(in) :: way(3)             !! from the point to the nearest place of `f` [L]
      real(wp) :: distance

      is_beyond = .false.
      if (.not. self%is_self .or. .not. allocated(self%facet_of_point)) return
      if (self%body_of_point(i) /= self%body(f)) return
      distance = sqrt(dot_product(way, way))
      is_beyond = distance > through*self%depth(self%facet_of_point(i)) &
         .and. dot_product(way, normal) < under*distance
   end function touch_rule_space_is_beyond

end module emcon_touch_rule_space
