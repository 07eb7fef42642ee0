!> Do pieces of a mesh in the plane overlap where they are? Nodes of either against the outline of
!> the other, and what lies of edges between their crossings with the other, also of a piece with
!> itself.
!>
!> A look places the outlines; what they look at is placed before. Source: docs/theory.md,
!> section 4.11.
module emcon_overlap_query_plane
   use emcon_box_tree, only : box_tree_find, box_tree_init, box_tree_t
   use emcon_interactions, only : contact_options_t
   use emcon_kinds, only : wp
   use emcon_outline_curves_plane, only : outline_curves_init, outline_curves_overlap, &
      outline_curves_t
   use emcon_outline_plane, only : outline_init, outline_links_t
   use emcon_overlap_plane, only : crossing_find, length_of, nearest_depth, nearest_t, &
      nearest_update
   use emcon_overlap_query, only : overlap_query_t, overlap_t, passing, passing_thin
   use emcon_scene, only : scene_t
   use emcon_vectors_plane, only : between
   implicit none
   private
   public :: overlap_query_plane_t, overlap_query_plane_init

   !> Less than this behind an edge, by its length, the middle of one that crosses nothing lies
   !> along it.
   real(wp), parameter :: aligned = sqrt(epsilon(1.0_wp))
   !> Crossings of one edge that are told apart.
   integer, parameter :: most_crossings = 8

   !> Where an edge crosses others, in order: at parts `share` of it, from 0 before the first to 1
   !> after the last.
   type :: crossings_t
      integer :: n = 0
      real(wp) :: share(0:most_crossings + 1) = 0.0_wp
      logical :: goes_in(most_crossings) = .false.
      integer :: edge(most_crossings) = 0        !! that is crossed
   end type crossings_t

   type, extends(overlap_query_t) :: overlap_query_plane_t
      type(outline_links_t) :: links             !! of the outline
      type(outline_curves_t) :: curves           !! that edges stand for
      real(wp), allocatable :: u(:, :)           !! (2, n_node) displacement at the look [L]
      real(wp), allocatable :: low(:, :), high(:, :)   !! (2, n_edge) boxes of edges there [L]
      integer, allocatable, private :: near(:), found(:), around(:)   !! work space: lists of edges
   contains
      procedure :: begin => overlap_query_begin
      procedure :: longest => overlap_query_longest
      procedure :: place => overlap_query_place
      procedure :: overlap => overlap_query_one_way
   end type overlap_query_plane_t

contains

   !> Set up for the outlines of `scene`.
   subroutine overlap_query_plane_init(self, scene)
      type(overlap_query_plane_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      integer :: n

      call outline_init(self%outline, self%links, scene)
      n = size(self%outline%facet, 2)
      allocate(self%near(n), self%found(n), self%around(n))
      allocate(self%low(2, n), self%high(2, n), source=0.0_wp)
      allocate(self%u(2, size(scene%x, 2)), source=0.0_wp)
   end subroutine overlap_query_plane_init

   subroutine overlap_query_begin(self, scene, options)
      class(overlap_query_plane_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(contact_options_t), intent(in) :: options

      call outline_curves_init(self%curves, self%outline, self%links, scene, options)
   end subroutine overlap_query_begin

   !> The longest edge of piece `p` at x + u.
   pure real(wp) function overlap_query_longest(self, p, x, u) result(longest)
      class(overlap_query_plane_t), intent(in) :: self
      integer, intent(in) :: p                   !! from 1
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)     !! (2, n_node) [L]
      real(wp) :: vector(2)
      integer :: e

      longest = 0.0_wp
      do e = self%outline%start(p), self%outline%start(p + 1) - 1
         vector = between(x, u, self%outline%facet(1, e), self%outline%facet(2, e))
         longest = max(longest, dot_product(vector, vector))
      end do
      longest = sqrt(longest)
   end function overlap_query_longest

   !> Place piece `p`: displacements of its nodes, boxes of its edges.
   pure subroutine overlap_query_place(self, p, x, u0, du, share)
      class(overlap_query_plane_t), intent(inout) :: self
      integer, intent(in) :: p                   !! from 1
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp), intent(in) :: share              !! of the step that lies behind, 0 to 1
      real(wp) :: a(2), b(2)
      integer :: e

      do e = self%outline%start(p), self%outline%start(p + 1) - 1
         associate (i => self%outline%facet(1, e), j => self%outline%facet(2, e))
            self%u(:, i) = u0(:, i) + share*du(:, i)
            self%u(:, j) = u0(:, j) + share*du(:, j)
            a = x(:, i) + self%u(:, i)
            b = x(:, j) + self%u(:, j)
         end associate
         self%low(:, e) = min(a, b)
         self%high(:, e) = max(a, b)
      end do
   end subroutine overlap_query_place

   !> Nodes and parts of edges of piece `p` in piece `q`, both placed; the same one: in itself.
   subroutine overlap_query_one_way(self, p, q, x, reach, overlap)
      class(overlap_query_plane_t), intent(inout) :: self
      integer, intent(in) :: p, q                !! from 1
      real(wp), intent(in), contiguous :: x(:, :)  !! (2, n_node) [L]
      real(wp), intent(in) :: reach              !! length of the longest edge of both [L]
      type(overlap_t), intent(inout) :: overlap  !! the deepest so far
      type(box_tree_t) :: tree
      real(wp) :: low(2, 2), high(2, 2)
      integer :: e, n_near, n_found

      call box_of(self, p, low(:, 1), high(:, 1))
      call box_of(self, q, low(:, 2), high(:, 2))
      n_near = 0
      do e = self%outline%start(q), self%outline%start(q + 1) - 1
         if (any(self%low(:, e) > high(:, 1) + reach) &
            .or. any(self%high(:, e) < low(:, 1) - reach)) cycle
         n_near = n_near + 1
         self%near(n_near) = e
      end do
      if (n_near == 0) return
      call box_tree_init(tree, self%low(:, self%near(:n_near)), self%high(:, self%near(:n_near)))
      do e = self%outline%start(p), self%outline%start(p + 1) - 1
         if (any(self%low(:, e) > high(:, 2)) .or. any(self%high(:, e) < low(:, 2))) cycle
         n_found = 0
         call box_tree_find(tree, self%low(:, e), self%high(:, e), merge(0.0_wp, reach, p == q), &
            self%found, n_found)
         if (n_found == 0) cycle
         if (p /= q) then
            call try_node(self, x, e, 1, self%near(self%found(:n_found)), reach, overlap)
            if (self%links%link(2, e) == 0) call try_node(self, x, e, 2, &
               self%near(self%found(:n_found)), reach, overlap)
         end if
         call try_edge(self, x, e, self%near(self%found(:n_found)), p == q, reach, overlap)
      end do
   end subroutine overlap_query_one_way

   !> The box of piece `p` at the present look.
   pure subroutine box_of(self, p, low, high)
      class(overlap_query_plane_t), intent(in) :: self
      integer, intent(in) :: p
      real(wp), intent(out) :: low(2), high(2)

      associate (first => self%outline%start(p), last => self%outline%start(p + 1) - 1)
         low = minval(self%low(:, first:last), dim=2)
         high = maxval(self%high(:, first:last), dim=2)
      end associate
   end subroutine box_of

   !> Is the node at an end of edge `e` behind the outline of which `other` are the edges within
   !> `reach`?
   pure subroutine try_node(self, x, e, side, other, reach, overlap)
      class(overlap_query_plane_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :)
      integer, intent(in) :: e, side             !! 1: first node, 2: last one
      integer, intent(in) :: other(:)
      real(wp), intent(in) :: reach              !! [L]
      type(overlap_t), intent(inout) :: overlap
      type(nearest_t) :: nearest
      integer :: k

      associate (edge => self%outline%facet, node => self%outline%facet(side, e))
         if (any(self%links%place(:, other) == self%links%place(side, e))) return
         if (self%links%is_buried(node) .or. any(other == self%links%host(node))) return
         do k = 1, size(other)
            call nearest_update(nearest, other(k), between(x, self%u, edge(1, other(k)), node), &
               between(x, self%u, edge(1, other(k)), edge(2, other(k))))
         end do
         if (nearest%square <= reach**2) call take_deeper(self, x, nearest, e, &
            real(side - 1, wp), overlap)
      end associate
   end subroutine try_node

   !> Is a part of edge `e`, between its crossings with `other`, inside? Looked at is its middle,
   !> and of a piece in itself the node where it ends: the nearest edge is looked for along the
   !> outline from the crossings, past what lies behind the piece's own surface. Neighbours do not
   !> cross.
   pure subroutine try_edge(self, x, e, other, is_own, reach, overlap)
      class(overlap_query_plane_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)
      integer, intent(in) :: e
      integer, intent(in) :: other(:)
      logical, intent(in) :: is_own              !! edges of the same piece
      real(wp), intent(in) :: reach              !! [L]
      type(overlap_t), intent(inout) :: overlap
      type(crossings_t) :: crossings
      integer :: k, n_around

      call find_crossings(self, x, e, other, crossings)
      if (crossings%n == 0 .and. .not. is_own) call try_middle(self, x, e, other, reach, overlap)
      if (crossings%n == 0) return
      if (is_own) call find_around(self, e, crossings%edge(:crossings%n), reach, n_around)
      do k = 0, crossings%n
         if (.not. is_inside(k)) cycle
         associate (middle => 0.5_wp*(crossings%share(k) + crossings%share(k + 1)))
            if (.not. is_own) then
               call try_place(self, x, e, middle, other, overlap)
               cycle
            end if
            associate (around => self%around(:n_around))
               call try_place(self, x, e, middle, around, overlap)
               if (k == 0) call try_place(self, x, e, 0.0_wp, around, overlap)
               if (k == crossings%n) call try_place(self, x, e, 1.0_wp, around, overlap)
            end associate
         end associate
      end do

   contains

      !> Is the part after crossing `k` inside?
      pure logical function is_inside(k)
         integer, intent(in) :: k

         is_inside = .false.
         if (k > 0) is_inside = crossings%goes_in(k)
         if (k < crossings%n) is_inside = is_inside .or. .not. crossings%goes_in(k + 1)
      end function is_inside

   end subroutine try_edge

   !> An edge that crosses nothing lies in the other piece all the same where its ends stand exactly
   !> on the sides of that; and so may what is behind it.
   pure subroutine try_middle(self, x, e, other, reach, overlap)
      class(overlap_query_plane_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :)
      integer, intent(in) :: e
      integer, intent(in) :: other(:)
      real(wp), intent(in) :: reach              !! [L]
      type(overlap_t), intent(inout) :: overlap
      type(overlap_t) :: found
      integer :: side

      do side = 1, 2
         if (.not. stands_on(self, x, self%outline%facet(side, e), other)) return
      end do
      found = overlap
      call try_place(self, x, e, 0.5_wp, other, found, reach)
      if (found%depth > max(aligned, overlap%depth)) overlap = found
      if (.not. self%links%is_profile(e)) call try_behind(self, x, e, other, reach, overlap)
   end subroutine try_middle

   !> Is half of its element behind the middle of edge `e` inside, which lies on an edge that looks
   !> as it does? Where pieces touch, edges look at each other.
   pure subroutine try_behind(self, x, e, other, reach, overlap)
      class(overlap_query_plane_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :)
      integer, intent(in) :: e
      integer, intent(in) :: other(:)
      real(wp), intent(in) :: reach              !! [L]
      type(overlap_t), intent(inout) :: overlap
      type(nearest_t) :: middle, behind
      real(wp) :: along(2), inwards(2), to_middle(2)
      integer :: k

      associate (a => self%outline%facet(:, e))
         along = between(x, self%u, a(1), a(2))
         if (.not. length_of(along) > 0.0_wp) return
         inwards = (0.5_wp*self%outline%thickness(e)/length_of(along))*[-along(2), along(1)]
         do k = 1, size(other)
            if (are_neighbours(self, e, other(k))) cycle
            associate (b => self%outline%facet(:, other(k)))
               to_middle = between(x, self%u, b(1), a(1)) + 0.5_wp*along
               call nearest_update(middle, other(k), to_middle, between(x, self%u, b(1), b(2)))
               call nearest_update(behind, other(k), to_middle + inwards, &
                  between(x, self%u, b(1), b(2)))
            end associate
         end do
      end associate
      if (.not. dot_product(middle%along, along) > 0.0_wp .or. behind%square > reach**2) return
      call take_deeper(self, x, behind, e, 0.5_wp, overlap)
   end subroutine try_behind

   !> Is a node on one of these edges, to round-off?
   pure logical function stands_on(self, x, node, other) result(stands)
      class(overlap_query_plane_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :)
      integer, intent(in) :: node
      integer, intent(in) :: other(:)
      type(nearest_t) :: nearest
      integer :: k

      do k = 1, size(other)
         associate (b => self%outline%facet(:, other(k)))
            call nearest_update(nearest, other(k), between(x, self%u, b(1), node), &
               between(x, self%u, b(1), b(2)))
         end associate
      end do
      stands = nearest%edge > 0
      if (stands) stands = nearest%square <= (aligned*length_of(nearest%along))**2
   end function stands_on

   !> The edges `crossed`, and those along the outline on either side of them within `reach` of edge
   !> `e`: `self%around`.
   pure subroutine find_around(self, e, crossed, reach, n)
      class(overlap_query_plane_t), intent(inout) :: self
      integer, intent(in) :: e, crossed(:)
      real(wp), intent(in) :: reach              !! [L]
      integer, intent(out) :: n
      integer :: f, k, side

      n = 0
      do k = 1, size(crossed)
         do side = 1, 2
            f = crossed(k)
            if (side == 2) f = self%links%link(side, f)
            do while (f > 0)
               if (any(self%around(:n) == f) .or. are_neighbours(self, e, f)) exit
               if (any(self%low(:, f) > self%high(:, e) + reach) &
                  .or. any(self%high(:, f) < self%low(:, e) - reach)) exit
               n = n + 1
               self%around(n) = f
               f = self%links%link(side, f)
            end do
         end do
      end do
   end subroutine find_around

   !> Where edge `e` crosses `other` edges.
   pure subroutine find_crossings(self, x, e, other, crossings)
      class(overlap_query_plane_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :)
      integer, intent(in) :: e
      integer, intent(in) :: other(:)
      type(crossings_t), intent(out) :: crossings
      real(wp) :: new
      logical :: crosses, enters
      integer :: k, i

      do k = 1, size(other)
         if (are_neighbours(self, e, other(k))) cycle
         associate (a => self%outline%facet(:, e), b => self%outline%facet(:, other(k)))
            call crossing_find(between(x, self%u, a(1), a(2)), reshape([ &
               between(x, self%u, a(1), b(1)), between(x, self%u, a(1), b(2))], [2, 2]), &
               crosses, new, enters)
         end associate
         if (.not. crosses .or. crossings%n == most_crossings) cycle
         associate (n => crossings%n, share => crossings%share, goes_in => crossings%goes_in, &
               edge => crossings%edge)
            i = count(share(1:n) <= new)
            share(i + 2:n + 1) = share(i + 1:n)
            goes_in(i + 2:n + 1) = goes_in(i + 1:n)
            edge(i + 2:n + 1) = edge(i + 1:n)
            share(i + 1) = new
            goes_in(i + 1) = enters
            edge(i + 1) = other(k)
            n = n + 1
         end associate
      end do
      crossings%share(crossings%n + 1) = 1.0_wp
   end subroutine find_crossings

   !> Do edges `e` and `f` meet in a node, at a joint, or where a tied piece ends on one of them?
   pure logical function are_neighbours(self, e, f)
      class(overlap_query_plane_t), intent(in) :: self
      integer, intent(in) :: e, f

      associate (a => self%links%place(:, e), b => self%links%place(:, f))
         are_neighbours = any(a == b(1)) .or. any(a == b(2))
      end associate
      associate (edge => self%outline%facet, host => self%links%host)
         are_neighbours = are_neighbours .or. any(host(edge(:, e)) == f) &
            .or. any(host(edge(:, f)) == e)
      end associate
   end function are_neighbours

   !> How deep is the place `share` along edge `e` in `other` edges, that are not its neighbours?
   pure subroutine try_place(self, x, e, share, other, overlap, reach)
      class(overlap_query_plane_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :)
      integer, intent(in) :: e
      real(wp), intent(in) :: share
      integer, intent(in) :: other(:)
      type(overlap_t), intent(inout) :: overlap
      real(wp), intent(in), optional :: reach    !! nothing farther from an edge counts [L]
      type(nearest_t) :: nearest
      integer :: k

      associate (a => self%outline%facet(:, e))
         do k = 1, size(other)
            if (are_neighbours(self, e, other(k))) cycle
            associate (b => self%outline%facet(:, other(k)))
               call nearest_update(nearest, other(k), between(x, self%u, b(1), a(1)) &
                  + share*between(x, self%u, a(1), a(2)), between(x, self%u, b(1), b(2)))
            end associate
         end do
         if (present(reach)) then
            if (nearest%square > reach**2) return
         end if
      end associate
      call take_deeper(self, x, nearest, e, share, overlap)
   end subroutine try_place

   !> Keep what is behind the edge `nearest` if it is the deepest so far. At the end of an outline
   !> that is open there is no behind. What edges overlap by because they stand for curves is taken
   !> off. An edge of a profile is a small part of a line or an arc, without an element behind it:
   !> it counts as no shorter and no thinner than the edge that is in it is long.
   pure subroutine take_deeper(self, x, nearest, e, share, overlap)
      class(overlap_query_plane_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :)
      type(nearest_t), intent(in) :: nearest
      integer, intent(in) :: e                   !! the edge that is judged
      real(wp), intent(in) :: share              !! place along it, 0 to 1
      type(overlap_t), intent(inout) :: overlap
      real(wp) :: depth, length, thickness, taken_off, next_along(2)
      integer :: next

      if (nearest%edge == 0) return
      associate (edge => self%outline%facet)
         next_along = nearest%along
         if (nearest%side > 0) then
            next = self%links%link(nearest%side, nearest%edge)
            if (next == 0) return
            next_along = between(x, self%u, edge(1, next), edge(2, next))
         end if
         depth = nearest_depth(nearest, next_along)
         length = length_of(nearest%along)
         thickness = self%outline%thickness(nearest%edge)
         if (self%links%is_profile(nearest%edge)) then
            length = max(length, length_of(between(x, self%u, edge(1, e), edge(2, e))))
            thickness = length
         end if
         if (.not. depth > overlap%depth*length) return
         taken_off = outline_curves_overlap(self%curves, e, nearest%edge, &
            [share, nearest%share], x, self%u)
         if (taken_off > 0.0_wp) overlap%of_facets = max(overlap%of_facets, depth/length)
         depth = depth - taken_off
         if (.not. depth > overlap%depth*length) return
         if (self%is_passing .and. depth < min(passing*length, passing_thin*thickness)) return
         overlap%depth = depth/length
         overlap%node = edge(merge(1, 2, share < 0.5_wp), e)
         overlap%is_beside = share > 0.0_wp .and. share < 1.0_wp
         overlap%length = length
         overlap%thickness = thickness
         overlap%facet(:size(edge, 1)) = edge(:, nearest%edge)
      end associate
   end subroutine take_deeper

end module emcon_overlap_query_plane
