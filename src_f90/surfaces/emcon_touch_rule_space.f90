!> Which facets a slave node may touch where a surface in space is in contact with itself.
!>
!> The surface may run over many bodies. As a node may touch several of them at once, it has a
!> constraint for each class of bodies. Of its own body it never touches the facets around it, nor
!> those beside them, nor another closed surface, nor what it is behind with the body in between.
!> Source: docs/theory.md, section 15.
module emcon_touch_rule_space
   use emcon_bodies, only : bodies_find_tied
   use emcon_facets, only : facets_normal, facets_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: touch_rule_space_t, touch_rule_space_init, touch_rule_space_sees, &
      touch_rule_space_may, touch_rule_space_is_through

   !> Classes of bodies at most, and with them constraints of a frame.
   integer, parameter :: most_classes = 4
   !> Behind a facet by more than this part of the element there, a node of the body is on the other
   !> side of it: under it, where the way there and the normal have a cosine below this.
   real(wp), parameter :: through = 0.5_wp, under = -0.5_wp

   type :: touch_rule_space_t
      logical :: is_self = .false.               !! else any node may touch any facet
      integer :: n_class = 1
      integer, allocatable :: body(:)            !! (n_facet)
      integer, allocatable :: body_of_node(:)    !! (n_node of the facets)
      real(wp), allocatable :: depth(:)          !! (n_facet) of the element behind it [L]
      logical, allocatable :: is_closed(:)       !! (n_facet) its connected part has no rim
   end type touch_rule_space_t

contains

   !> The rule for the facets of a surface in contact with itself, whose bodies fall into classes in
   !> turn.
   pure subroutine touch_rule_space_init(self, facets, scene)
      type(touch_rule_space_t), intent(out) :: self
      type(facets_t), intent(in) :: facets       !! in space
      type(scene_t), intent(in) :: scene
      integer, allocatable :: body(:)
      logical, allocatable :: has_rim(:)
      integer :: f, n_body

      self%is_self = .true.
      call bodies_find_tied(scene, facets%facet, body, n_body)
      self%body = body(facets%facet(1, :))
      self%body_of_node = body(facets%node)
      self%n_class = max(1, min(n_body, most_classes))
      allocate(has_rim(facets%n_facet), source=.false.)
      do f = 1, facets%n_facet
         if (any(facets%neighbour(:, f) == 0 .and. facets%facet(:, f) > 0)) &
            has_rim(facets%part(f)) = .true.
      end do
      self%is_closed = .not. has_rim(facets%part)
      self%depth = [(depth_behind(facets, f, scene), f = 1, facets%n_facet)]
   end subroutine touch_rule_space_init

   !> How far the element behind facet `f` reaches behind it in the reference; where there is none,
   !> as far as the facet is long [L].
   pure real(wp) function depth_behind(facets, f, scene) result(depth)
      type(facets_t), intent(in) :: facets
      integer, intent(in) :: f                   !! 1 to n_facet
      type(scene_t), intent(in) :: scene
      real(wp) :: normal(3), still(3, size(scene%x, 2))
      integer :: k

      depth = sqrt(facets%size(f))
      if (facets%element(f) == 0) return
      still = 0.0_wp
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

   !> May node `i` ever touch facet `f`?
   pure logical function touch_rule_space_may(self, facets, i, f) result(may)
      type(touch_rule_space_t), intent(in) :: self
      type(facets_t), intent(in) :: facets       !! that the rule is for
      integer, intent(in) :: i                   !! index into the nodes
      integer, intent(in) :: f                   !! 1 to n_facet
      integer :: k, own

      may = .true.
      if (.not. self%is_self) return
      if (self%body_of_node(i) /= self%body(f)) return
      do k = facets%around_start(i), facets%around_start(i + 1) - 1
         own = facets%around(k)
         may = .not. (facets%part(own) /= facets%part(f) .and. self%is_closed(own) .and. &
            self%is_closed(f))
         if (may) may = .not. shares_a_node(facets, own, f)
         if (.not. may) return
      end do
   end function touch_rule_space_may

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

   !> Is node `i` on the other side of its own body, seen from facet `f`?
   pure logical function touch_rule_space_is_through(self, i, f, normal, way) result(is_through)
      type(touch_rule_space_t), intent(in) :: self
      integer, intent(in) :: i                   !! index into the nodes of the facets
      integer, intent(in) :: f                   !! 1 to n_facet
      real(wp), intent(in) :: normal(3)          !! of it or a part of it, of length 1, outwards
      real(wp), intent(in) :: way(3)             !! from its nearest place to the node [L]
      real(wp) :: distance

      is_through = .false.
      if (.not. self%is_self) return
      if (self%body_of_node(i) /= self%body(f)) return
      distance = sqrt(dot_product(way, way))
      is_through = distance > through*self%depth(f) .and. dot_product(way, normal) < under*distance
   end function touch_rule_space_is_through

end module emcon_touch_rule_space
