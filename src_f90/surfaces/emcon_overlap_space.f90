!> How deep one outline in space is inside another: the deepest of the points that are inside, and
!> of the middles of inside parts of edges, by the nearest facet.
!>
!> Source: docs/theory.md, section 4.15.
module emcon_overlap_space
   use emcon_inside_space, only : inside_confirm, inside_find, inside_has, inside_nearest, &
      inside_nearest_own, inside_own, inside_t
   use emcon_kinds, only : wp
   use emcon_nearest_space, only : nearest_height, nearest_t
   use emcon_overlap_query, only : overlap_t, passing, passing_thin
   use emcon_triangles_space, only : cross_product, triangle_at, triangles_t
   implicit none
   private
   public :: overlap_space_find, overlap_space_own

   !> Less than this behind a facet, by its length, is on it.
   real(wp), parameter :: aligned = sqrt(epsilon(1.0_wp))

   !> A place that is inside.
   type :: place_t
      integer :: node = 0                        !! of the scene, it or the nearest on its facet:
      logical :: is_beside = .false.             !! it is not the node itself
      real(wp) :: at(3) = 0.0_wp                 !! [L]
      integer :: own(2) = 0                      !! points that it is, or between which it is
      type(nearest_t) :: nearest
      real(wp) :: ratio = 0.0_wp                 !! depth per length of the facet; 0: not deeper
   end type place_t

contains

   !> What of `a` is inside `b`.
   subroutine overlap_space_find(a, b, reach, is_passing, overlap)
      type(triangles_t), intent(in) :: a, b      !! placed
      real(wp), intent(in) :: reach              !! length of the longest facet of both [L]
      logical, intent(in) :: is_passing          !! it is on the way, not at the end of a step
      type(overlap_t), intent(inout) :: overlap  !! the deepest so far
      type(inside_t) :: inside

      call inside_find(inside, a, b, reach)
      call take_deepest(inside, a, b, is_passing, overlap)
   end subroutine overlap_space_find

   !> What of `a` is inside itself.
   subroutine overlap_space_own(a, overlap)
      type(triangles_t), intent(in) :: a         !! placed
      type(overlap_t), intent(inout) :: overlap  !! the deepest so far
      type(inside_t) :: inside

      call inside_own(inside, a, maxval(a%length))
      call take_deepest(inside, a, a, .false., overlap)
   end subroutine overlap_space_own

   !> The deepest of all places that a look has found.
   subroutine take_deepest(inside, a, b, is_passing, overlap)
      type(inside_t), intent(inout) :: inside
      type(triangles_t), intent(in) :: a, b
      logical, intent(in) :: is_passing
      type(overlap_t), intent(inout) :: overlap
      type(place_t), allocatable :: place(:)
      integer :: i, k

      call find_places(inside, a, b, overlap%depth, place)
      do i = 1, size(place)
         k = maxloc(place%ratio, dim=1)
         if (.not. place(k)%ratio > overlap%depth) return
         ! Rounding may have led astray along edges: what is deep is asked again.
         if (b%is_closed .and. place(k)%ratio > aligned) then
            if (.not. inside_confirm(inside, b, place(k)%at + before(inside, a, place(k)))) then
               place(k)%ratio = 0.0_wp
               cycle
            end if
         end if
         if (is_passing .and. passes_by(b, place(k)%nearest)) then
            place(k)%ratio = 0.0_wp
            cycle
         end if
         call take(b, place(k), overlap)
         return
      end do
   end subroutine take_deepest

   !> To a place that is asked in front of an outline, of one on it: what is inside there is inside
   !> of another part. On another outline places are asked themselves.
   pure function before(inside, a, place) result(step)
      type(inside_t), intent(in) :: inside
      type(triangles_t), intent(in) :: a
      type(place_t), intent(in) :: place
      real(wp) :: step(3)                        !! [L]
      integer :: k, t

      step = 0.0_wp
      if (.not. inside%is_own) return
      do t = 1, size(a%split%facet)
         if (all([(any(a%split%corner(:, t) == place%own(k)), k = 1, 2)])) then
            associate (normal => normal_of(a, t))
               step = step + normal/max(sqrt(dot_product(normal, normal)), tiny(1.0_wp))
            end associate
         end if
      end do
      step = step*(inside%pad/max(sqrt(dot_product(step, step)), tiny(1.0_wp)))
   end function before

   !> All places that are inside by more than `least`, per length of the facet.
   subroutine find_places(inside, a, b, least, place)
      type(inside_t), intent(inout) :: inside
      type(triangles_t), intent(in) :: a, b
      real(wp), intent(in) :: least
      type(place_t), allocatable, intent(out) :: place(:)
      type(place_t), allocatable :: spare(:)
      integer :: i, n, near

      n = size(inside%point) + inside%n_middle
      if (n > 0) n = n + a%facets%n_facet
      allocate(spare(n))
      n = 0
      do i = 1, size(inside%point)
         associate (point => inside%point(i), before => inside%before)
            near = inside%near(point)
            if (near == 0 .and. before(point) > 0) near = inside%near(before(point))
            call judge(place_t(node_of(a, point), point > a%split%n_node, a%at(:, point)), &
               [point, point], near)
            inside%near(point) = near
         end associate
      end do
      do i = 1, inside%n_middle
         associate (middle => inside%middle(i))
            associate (p => a%edge(1, middle%edge), q => a%edge(2, middle%edge))
               near = middle%near
               if (near == 0) near = inside%near(p)
               call judge(place_t(node_of(a, merge(p, q, middle%share < 0.5_wp)), .true., &
                  a%at(:, p) + middle%share*(a%at(:, q) - a%at(:, p))), [p, q], near)
            end associate
         end associate
      end do
      do i = 1, merge(a%facets%n_facet, 0, size(spare) > 0)
         if (.not. may_hide(inside, a, b, i)) cycle
         near = 0
         call judge(place_t(a%facets%facet(1, i), .true., behind_facet(a, i)), [0, 0], near)
      end do
      place = spare(:n)

   contains

      subroutine judge(point, own, near)
         type(place_t), intent(in) :: point
         integer, intent(in) :: own(2)
         integer, intent(inout) :: near          !! in: about the nearest triangle; out: it is
         type(place_t) :: new

         new = place_t(point%node, point%is_beside, point%at, own)
         if (inside%is_own) then
            call inside_nearest_own(inside, b, new%at, own, near, new%nearest)
         else
            call inside_nearest(inside, b, new%at, near, new%nearest)
         end if
         near = new%nearest%triangle
         new%ratio = depth_of(b, inside%pad, new%at, new%nearest)/b%length(b%split%facet(near))
         if (.not. new%ratio > least) return
         n = n + 1
         spare(n) = new
      end subroutine judge

   end subroutine find_places

   !> May what is behind facet `f` be inside: does a point of it count as inside, and do the
   !> triangles nearest to all of these look as it does? Points on the other outline may count where
   !> bodies touch, and faces look at each other, and where bodies share a place, and do not.
   pure logical function may_hide(inside, a, b, f) result(may)
      type(inside_t), intent(in) :: inside
      type(triangles_t), intent(in) :: a, b
      integer, intent(in) :: f
      integer :: t

      may = .false.
      if (inside%is_own .or. .not. b%is_closed) return
      do t = a%split%start(f), a%split%start(f + 1) - 1
         associate (point => a%split%corner(1, t))
            if (.not. inside_has(inside, point)) cycle
            may = inside%near(point) > 0
            if (may) may = dot_product(normal_of(a, t), normal_of(b, inside%near(point))) > 0.0_wp
            if (.not. may) return
         end associate
      end do
   end function may_hide

   !> Outwards, of twice the area of triangle `t` [L^2].
   pure function normal_of(a, t) result(normal)
      type(triangles_t), intent(in) :: a
      integer, intent(in) :: t
      real(wp) :: normal(3)

      associate (c => triangle_at(a, t))
         normal = cross_product(c(:, 2) - c(:, 1), c(:, 3) - c(:, 1))
      end associate
   end function normal_of

   !> Half of its thickness behind the middle of facet `f`.
   pure function behind_facet(a, f) result(at)
      type(triangles_t), intent(in) :: a
      integer, intent(in) :: f
      real(wp) :: at(3)
      real(wp) :: normal(3)
      integer :: t

      at = 0.0_wp
      normal = 0.0_wp
      associate (first => a%split%start(f), last => a%split%start(f + 1) - 1)
         do t = first, last
            at = at + sum(triangle_at(a, t), 2)/(3*(last - first + 1))
            normal = normal + normal_of(a, t)
         end do
      end associate
      at = at - (0.5_wp*a%thickness(f)/max(sqrt(dot_product(normal, normal)), tiny(1.0_wp)))*normal
   end function behind_facet

   !> How deep a point that counts as inside is: it was moved by very little, and may stand in front
   !> of the nearest facet, or beside it. At the rim of an outline that is not closed there is no
   !> behind.
   pure real(wp) function depth_of(b, pad, point, nearest) result(depth)
      type(triangles_t), intent(in) :: b
      real(wp), intent(in) :: pad                !! more than it was moved by [L]
      real(wp), intent(in) :: point(3)           !! [L]
      type(nearest_t), intent(in) :: nearest

      depth = sqrt(nearest%square)
      associate (weight => nearest%weight)
         if (all(weight > 0.0_wp)) then
            if (nearest_height(point, triangle_at(b, nearest%triangle)) >= 0.0_wp) depth = 0.0_wp
         else if (depth <= pad) then
            depth = 0.0_wp
         else if (.not. b%is_closed) then
            if (all(b%is_rim(b%split%corner(:, nearest%triangle)) .or. weight <= 0.0_wp)) then
               depth = 0.0_wp
            end if
         end if
      end associate
   end function depth_of

   !> The node that a point is, or the first of the facet whose centre it is.
   pure integer function node_of(a, point) result(node)
      type(triangles_t), intent(in) :: a
      integer, intent(in) :: point

      if (point <= a%split%n_node) then
         node = a%facets%node(point)
      else
         node = a%facets%facet(1, a%split%of_centre(point - a%split%n_node))
      end if
   end function node_of

   !> Is what is behind a facet of `b`, on the way, the straight way past a corner?
   pure logical function passes_by(b, nearest)
      type(triangles_t), intent(in) :: b
      type(nearest_t), intent(in) :: nearest

      associate (f => b%split%facet(nearest%triangle))
         passes_by = sqrt(nearest%square) < min(passing*b%length(f), passing_thin*b%thickness(f))
      end associate
   end function passes_by

   !> Keep the deepest place.
   pure subroutine take(b, place, overlap)
      type(triangles_t), intent(in) :: b
      type(place_t), intent(in) :: place
      type(overlap_t), intent(inout) :: overlap

      associate (f => b%split%facet(place%nearest%triangle))
         overlap%depth = place%ratio
         overlap%length = b%length(f)
         overlap%thickness = b%thickness(f)
         overlap%node = place%node
         overlap%is_beside = place%is_beside
         overlap%facet = 0
         associate (own => b%facets%facet(:, f))
            overlap%facet(:size(own)) = own
         end associate
      end associate
   end subroutine take

end module emcon_overlap_space
