!> Which triangles of the master the patch of a slave node looks at in a step, and which nodes these
!> are made of.
!>
!> Source: docs/theory.md, section 15.
module emcon_patch_stencil_space
   use emcon_bulges_space, only : bulges_rise, bulges_t
   use emcon_element_kind, only : max_face_nodes
   use emcon_kinds, only : wp
   use emcon_nearest_space, only : nearest_t, nearest_update
   use emcon_patch_gap_space, only : patch_t
   use emcon_patch_sides_space, only : patch_sides_t, sides_point
   use emcon_rotation, only : cross_product
   use emcon_sort, only : unique_sorted
   use emcon_touch_rule_space, only : touch_rule_space_is_through
   implicit none
   private
   public :: patch_stencil_t, patch_stencil_choose, patch_stencil_gather, patch_stencil_height

   !> A triangle faces a frame if the cosine of their normals is below this.
   real(wp), parameter :: facing = -0.25_wp
   !> Sides of the patch, by the shorter of the facets of both sides.
   real(wp), parameter :: patch_size = 0.07_wp
   !> Where a surface ends it goes on by strips of this part of a facet, by less where those of the
   !> slave are smaller, and fades on the last one.
   real(wp), parameter :: flange = 0.2_wp
   integer, parameter :: n_strip = 2
   !> A node is behind a triangle by no more than so many of its distances, and this by the facet.
   real(wp), parameter :: distances = 2.0_wp, room_behind = 0.2_wp
   !> Triangles at distances that differ by less than this, per facet, are as near.
   real(wp), parameter :: as_near = 1.0e-6_wp

   !> The patch of one frame for a step, and its vertices as sums of nodes.
   type :: patch_stencil_t
      integer :: triangle = 0                    !! nearest of the master; 0: none near
      type(patch_t) :: patch
      real(wp) :: size = 0.0_wp                  !! length of its facet [L]
      real(wp) :: deepest = 0.0_wp               !! farther behind is another side of the body [L]
      integer :: n_node = 0
      integer :: n_slave = 0                     !! nodes 1..n_slave are of the frame
      integer :: n_origin = 0                    !! of these that its point is a sum of; 0: is one
      real(wp) :: origin(max_face_nodes) = 0.0_wp   !! their weights in it
      integer, allocatable :: point(:)           !! (>= n_vertex) of the master; < 0: of a flange
      integer, allocatable :: node(:)            !! (>= n_node) the slave node, then others
      !> (>= n_node, >= 2 + n_vertex) of nodes in the vectors of the frame and in vertices
      real(wp), allocatable :: weight(:, :)
   end type patch_stencil_t

   !> Triangles that are near, seen from the slave node.
   type :: near_t
      integer :: n = 0
      integer, allocatable :: triangle(:)        !! (n)
      real(wp), allocatable :: corner(:, :, :)   !! (3, 3, n) from the slave node [L]
      real(wp), allocatable :: normal(:, :)      !! (3, n) outwards, of length 1
      real(wp), allocatable :: distance(:)       !! (n) [L]
      logical, allocatable :: is_listed(:)       !! (n) the patch looks at it
   end type near_t

contains

   !> Choose the stencil of frame `frame` of the slave at x + u, where the facets `facet` of the
   !> master are near its node: the nearest triangle that faces this frame more than any other of
   !> the node, and what hangs together with that and faces the frame too.
   pure subroutine patch_stencil_choose(self, sides, frame, facet, x, u)
      type(patch_stencil_t), intent(inout) :: self
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: frame               !! 1 to the number of all frames
      integer, intent(in) :: facet(:)            !! ascending
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      type(near_t) :: near
      real(wp) :: normal(3)
      integer :: i, nearest

      self%triangle = 0
      if (size(facet) == 0) return
      i = sides%frames%point(frame)
      call look_around(sides, i, facet, x, u, near)
      nearest = nearest_to(sides, frame, near, x, u)
      if (nearest == 0) return
      normal = frame_normal(sides, i, frame, x, u)
      call list_triangles(sides, near, nearest, normal)
      self%deepest = room_behind*sides%triangles%size(near%triangle(nearest)) - distances &
         *near%distance(nearest)/dot_product(near%normal(:, nearest), normal)
      self%triangle = near%triangle(nearest)
      self%size = sides%triangles%size(self%triangle)
      self%patch%length = patch_size*min(self%size, sides%frames%size(i))
      call make_patch(self, sides, frame, near, normal, x, u)
   end subroutine patch_stencil_choose

   !> Where the triangles of facets are, from contact point `i` of the slave. Those that it is on
   !> the other side of face nothing.
   pure subroutine look_around(sides, i, facet, x, u, near)
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: i, facet(:)
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      type(near_t), intent(out) :: near
      type(nearest_t) :: nearest
      real(wp) :: origin(3)
      integer :: f, t

      origin = point_origin(sides, i, x, u)
      associate (start => sides%triangles%split%start)
         near%triangle = [((t, t = start(facet(f)), start(facet(f) + 1) - 1), f = 1, size(facet))]
      end associate
      near%n = size(near%triangle)
      allocate(near%corner(3, 3, near%n), near%normal(3, near%n), near%distance(near%n))
      allocate(near%is_listed(near%n), source=.false.)
      do t = 1, near%n
         do f = 1, 3
            near%corner(:, f, t) = place_of(sides, sides%triangles%split%corner(f, &
               near%triangle(t)), sides%frames%base(i), x, u) - origin
         end do
         associate (c => near%corner(:, :, t), n => near%normal(:, t))
            n = cross_product(c(:, 2) - c(:, 1), c(:, 3) - c(:, 1))
            call nearest_update(nearest, t, [0.0_wp, 0.0_wp, 0.0_wp], c)
            near%distance(t) = sqrt(nearest%square)
            if (dot_product(n, n) > 0.0_wp) n = n/sqrt(dot_product(n, n))
            if (touch_rule_space_is_through(sides%rule, i, sides%triangles%split%facet( &
               near%triangle(t)), n, -matmul(c, nearest%weight))) n = 0.0_wp
            nearest = nearest_t()
         end associate
      end do
   end subroutine look_around

   !> Contact point `i` of the slave, from its base.
   pure function point_origin(sides, i, x, u) result(origin)
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      real(wp) :: origin(3)
      integer :: k

      origin = 0.0_wp
      associate (frames => sides%frames, base => sides%frames%base(i))
         if (i <= size(sides%slave%node) .or. frames%start(i + 1) == frames%start(i)) return
         do k = frames%ring_start(frames%start(i)), frames%ring_start(frames%start(i) + 1) - 1
            associate (other => frames%ring(k))
               origin = origin + frames%weight(3, k)*((x(:, other) - x(:, base)) &
                  + (u(:, other) - u(:, base)))
            end associate
         end do
      end associate
   end function point_origin

   !> A point of the master, from `node`.
   pure function place_of(sides, point, node, x, u) result(place)
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: point, node
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      real(wp) :: place(3)
      integer :: k, n, part(max_face_nodes)
      real(wp) :: weight(max_face_nodes)

      call sides_point(sides, point, n, part, weight)
      place = 0.0_wp
      do k = 1, n
         place = place + weight(k)*((x(:, part(k)) - x(:, node)) + (u(:, part(k)) - u(:, node)))
      end do
   end function place_of

   !> The nearest triangle that faces a frame more than any other frame of its node; of those as
   !> near the one that faces it most. 0: there is none.
   pure integer function nearest_to(sides, frame, near, x, u) result(nearest)
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: frame
      type(near_t), intent(in) :: near
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      real(wp) :: best, least
      integer :: g, t

      nearest = 0
      best = 0.0_wp
      least = huge(least)
      associate (i => sides%frames%point(frame))
         associate (first => sides%frames%start(i), last => sides%frames%start(i + 1) - 1)
            associate (cosine => matmul(transpose(near%normal), reshape([(frame_normal(sides, i, &
                  g, x, u), g = first, last)], [3, last - first + 1])))
               do t = 1, near%n
                  if (minloc(cosine(t, :), 1) /= frame - first + 1) cycle
                  associate (own => cosine(t, frame - first + 1), &
                        room => as_near*sides%triangles%size(near%triangle(t)))
                     if (own >= facing) cycle
                     if (is_hidden(t, room_behind*min(sides%frames%size(i), &
                        sides%triangles%size(near%triangle(t))))) cycle
                     if (near%distance(t) > least + room) cycle
                     if (near%distance(t) > least - room .and. own >= best - as_near) cycle
                     least = near%distance(t)
                     best = own
                     nearest = t
                  end associate
               end do
            end associate
         end associate
      end associate

   contains

      !> Is the node behind a triangle, but nearer to another by more than `room`? Then that is in
      !> front of it.
      pure logical function is_hidden(t, room)
         integer, intent(in) :: t
         real(wp), intent(in) :: room            !! [L]

         is_hidden = dot_product(near%corner(:, 1, t), near%normal(:, t)) > 0.0_wp .and. &
            near%distance(t) > minval(near%distance) + room
      end function is_hidden

   end function nearest_to

   !> The normal of a frame, outwards.
   pure function frame_normal(sides, i, frame, x, u) result(normal)
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: i, frame
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      real(wp) :: normal(3)
      real(wp) :: a(3), b(3)

      call frame_vectors(sides, i, frame, x, u, a, b)
      normal = cross_product(a, b)
      normal = normal/max(sqrt(dot_product(normal, normal)), tiny(1.0_wp))
   end function frame_normal

   pure subroutine frame_vectors(sides, i, frame, x, u, a, b)
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: i, frame
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      real(wp), intent(out) :: a(3), b(3)
      real(wp) :: d(3)
      integer :: k

      a = 0.0_wp
      b = 0.0_wp
      associate (frames => sides%frames, node => sides%frames%base(i))
         do k = frames%ring_start(frame), frames%ring_start(frame + 1) - 1
            associate (other => frames%ring(k))
               d = (x(:, other) - x(:, node)) + (u(:, other) - u(:, node))
               a = a + frames%weight(1, k)*d
               b = b + frames%weight(2, k)*d
            end associate
         end do
      end associate
   end subroutine frame_vectors

   !> List what faces `normal` and hangs together with the nearest triangle.
   pure subroutine list_triangles(sides, near, nearest, normal)
      type(patch_sides_t), intent(in) :: sides
      type(near_t), intent(inout) :: near
      integer, intent(in) :: nearest
      real(wp), intent(in) :: normal(3)
      integer :: waiting(near%n), k, n, other

      near%is_listed(nearest) = .true.
      waiting(1) = nearest
      n = 1
      do while (n > 0)
         associate (t => near%triangle(waiting(n)))
            n = n - 1
            do k = 1, 3
               other = findloc(near%triangle, sides%triangles%beyond(k, t), 1)
               if (other == 0) cycle
               if (near%is_listed(other)) cycle
               if (dot_product(near%normal(:, other), normal) >= facing) cycle
               near%is_listed(other) = .true.
               n = n + 1
               waiting(n) = other
            end do
         end associate
      end do
   end subroutine list_triangles

   !> The vertices and triangles of the patch with their nodes.
   pure subroutine make_patch(self, sides, frame, near, normal, x, u)
      type(patch_stencil_t), intent(inout) :: self
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: frame
      type(near_t), intent(in) :: near
      real(wp), intent(in) :: normal(3)
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      logical :: ends(3, near%n)                 !! the list ends at the side of a triangle
      integer :: k, t

      ends = .false.
      do t = 1, near%n
         if (.not. near%is_listed(t)) cycle
         do k = 1, 3
            ends(k, t) = .not. goes_on(sides%triangles%beyond(k, near%triangle(t)))
         end do
      end do
      call begin_patch(self, sides, frame, count(near%is_listed), count(ends))
      do t = 1, near%n
         if (near%is_listed(t)) call add_triangle(self, sides, near%triangle(t))
      end do
      do t = 1, near%n
         do k = 1, 3
            if (.not. ends(k, t)) cycle
            associate (from => sides%triangles%split%corner(k, near%triangle(t)), &
                  to => sides%triangles%split%corner(1 + mod(k, 3), near%triangle(t)))
               if (sides%triangles%is_ridge(k, near%triangle(t))) then
                  call add_flange(self, sides, [from, to], normal, x, u)
               else
                  self%patch%chi(vertex_of(self, from)) = 0.0_wp
                  self%patch%chi(vertex_of(self, to)) = 0.0_wp
               end if
            end associate
         end do
      end do

   contains

      !> Is a triangle listed, or would it be if it were nearer?
      pure logical function goes_on(other)
         integer, intent(in) :: other            !! 0: none

         goes_on = other > 0
         if (goes_on) goes_on = is_facing(sides, &
            sides%frames%base(sides%frames%point(frame)), other, normal, x, u)
      end function goes_on

   end subroutine make_patch

   !> Does a triangle face what looks along `normal`?
   pure logical function is_facing(sides, node, triangle, normal, x, u)
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: node, triangle
      real(wp), intent(in) :: normal(3)
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      real(wp) :: corner(3, 3), own(3)
      integer :: k

      do k = 1, 3
         corner(:, k) = place_of(sides, sides%triangles%split%corner(k, triangle), node, x, u)
      end do
      own = cross_product(corner(:, 2) - corner(:, 1), corner(:, 3) - corner(:, 1))
      is_facing = dot_product(own, normal) < facing*sqrt(dot_product(own, own))
   end function is_facing

   !> Room for a patch of some triangles with flanges at some sides; its frame.
   pure subroutine begin_patch(self, sides, frame, n_triangle, n_end)
      type(patch_stencil_t), intent(inout) :: self
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: frame, n_triangle, n_end
      integer :: k

      self%patch%n_triangle = 0
      self%patch%n_vertex = 0
      associate (most => n_triangle + 2*n_strip*n_end, most_points => &
            3*n_triangle + 2*n_strip*n_end)
         call make_room(self%patch, self%point, most, most_points)
         if (allocated(self%weight)) then
            if (size(self%weight, 2) < 2 + most_points) deallocate(self%weight, self%node)
         end if
         if (.not. allocated(self%weight)) allocate(self%weight(max_face_nodes, 2 + most_points), &
            self%node(max_face_nodes))
      end associate
      self%weight = 0.0_wp
      self%n_node = 1
      self%node(1) = sides%frames%base(sides%frames%point(frame))
      associate (frames => sides%frames)
         do k = frames%ring_start(frame), frames%ring_start(frame + 1) - 1
            call add_weight(self, frames%ring(k), 1, frames%weight(1, k))
            call add_weight(self, frames%ring(k), 2, frames%weight(2, k))
         end do
         self%n_slave = self%n_node
         self%n_origin = 0
         if (sides%frames%point(frame) <= size(sides%slave%node)) return
         self%n_origin = self%n_slave
         do k = frames%ring_start(frame), frames%ring_start(frame + 1) - 1
            self%origin(findloc(self%node(:self%n_slave), frames%ring(k), 1)) = frames%weight(3, k)
         end do
      end associate
   end subroutine begin_patch

   !> Let a patch have room for so many triangles and vertices.
   pure subroutine make_room(patch, point, n_triangle, n_vertex)
      type(patch_t), intent(inout) :: patch
      integer, allocatable, intent(inout) :: point(:)
      integer, intent(in) :: n_triangle, n_vertex

      if (allocated(point)) then
         if (size(point) >= n_vertex .and. size(patch%triangle, 2) >= n_triangle) return
         deallocate(point, patch%triangle, patch%chi)
      end if
      allocate(point(n_vertex), patch%triangle(3, n_triangle), patch%chi(n_vertex))
   end subroutine make_room

   !> Let `column` of the weights depend on a node too.
   pure subroutine add_weight(self, node, column, weight)
      type(patch_stencil_t), intent(inout) :: self
      integer, intent(in) :: node, column
      real(wp), intent(in) :: weight
      real(wp), allocatable :: wider(:, :)
      integer, allocatable :: longer(:)
      integer :: k

      k = findloc(self%node(:self%n_node), node, 1)
      if (k == 1) return                         ! the origin itself
      if (k == 0) then
         if (self%n_node == size(self%node)) then
            allocate(wider(2*self%n_node, size(self%weight, 2)), source=0.0_wp)
            allocate(longer(2*self%n_node), source=0)
            wider(:self%n_node, :) = self%weight
            longer(:self%n_node) = self%node
            call move_alloc(wider, self%weight)
            call move_alloc(longer, self%node)
         end if
         self%n_node = self%n_node + 1
         k = self%n_node
         self%node(k) = node
      end if
      self%weight(k, column) = self%weight(k, column) + weight
   end subroutine add_weight

   !> Add `factor` times a point of the master to a vertex.
   pure subroutine add_point(self, sides, point, vertex, factor)
      type(patch_stencil_t), intent(inout) :: self
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: point, vertex
      real(wp), intent(in) :: factor
      integer :: k, n, node(max_face_nodes)
      real(wp) :: weight(max_face_nodes)

      call sides_point(sides, point, n, node, weight)
      do k = 1, n
         call add_weight(self, node(k), 2 + vertex, factor*weight(k))
      end do
   end subroutine add_point

   !> The number of a vertex by its point, < 0: that of a flange there; 0: none yet.
   pure integer function vertex_of(self, point)
      type(patch_stencil_t), intent(in) :: self
      integer, intent(in) :: point

      vertex_of = findloc(self%point(:self%patch%n_vertex), point, 1)
   end function vertex_of

   !> A new vertex with no place yet.
   pure subroutine begin_vertex(self, point, chi, vertex)
      type(patch_stencil_t), intent(inout) :: self
      integer, intent(in) :: point
      real(wp), intent(in) :: chi
      integer, intent(out) :: vertex

      vertex = self%patch%n_vertex + 1
      self%patch%n_vertex = vertex
      self%point(vertex) = point
      self%patch%chi(vertex) = chi
      self%weight(2:self%n_origin, 2 + vertex) = -self%origin(2:self%n_origin)
   end subroutine begin_vertex

   !> Add a triangle of the master, which runs the other way seen from the slave.
   pure subroutine add_triangle(self, sides, triangle)
      type(patch_stencil_t), intent(inout) :: self
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: triangle
      integer :: k, vertex(3)

      do k = 1, 3
         associate (point => sides%triangles%split%corner(k, triangle))
            vertex(k) = vertex_of(self, point)
            if (vertex(k) > 0) cycle
            call begin_vertex(self, point, 1.0_wp, vertex(k))
            call add_point(self, sides, point, vertex(k), 1.0_wp)
         end associate
      end do
      call append(self%patch, vertex([1, 3, 2]))
   end subroutine add_triangle

   pure subroutine append(patch, vertex)
      type(patch_t), intent(inout) :: patch
      integer, intent(in) :: vertex(3)

      patch%n_triangle = patch%n_triangle + 1
      patch%triangle(:, patch%n_triangle) = vertex
   end subroutine append

   !> Add two strips beyond a side of the master: on the first the field goes on, so that a patch at
   !> the end is covered, on the second it fades.
   pure subroutine add_flange(self, sides, side, normal, x, u)
      type(patch_stencil_t), intent(inout) :: self
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: side(2)             !! points, as the master runs
      real(wp), intent(in) :: normal(3)
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      integer :: from(0:n_strip), to(0:n_strip), k

      from(0) = vertex_of(self, side(1))
      to(0) = vertex_of(self, side(2))
      call add_outer(self, sides, side(1), normal, x, u, from(1:))
      call add_outer(self, sides, side(2), normal, x, u, to(1:))
      do k = 1, n_strip
         call append(self%patch, [to(k - 1), from(k), from(k - 1)])
         call append(self%patch, [to(k - 1), to(k), from(k)])
      end do
   end subroutine add_flange

   !> The vertices of flanges at a point, one for each strip: away from the points inside.
   pure subroutine add_outer(self, sides, point, normal, x, u, vertex)
      type(patch_stencil_t), intent(inout) :: self
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: point
      real(wp), intent(in) :: normal(3)
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      integer, intent(out) :: vertex(n_strip)
      integer, allocatable :: inner(:)
      real(wp) :: strip
      integer :: i, k

      k = vertex_of(self, -point)
      vertex = [(k + i - 1, i = 1, n_strip)]
      if (k > 0) return
      call find_inner(sides, self%node(1), point, normal, x, u, inner)
      ! Of a facet much larger than the patch strips are no wider than of a small one: where they
      ! fade, heights are those at their inner side, which a slanted frame sees far off the plane.
      strip = flange*self%patch%length/(patch_size*self%size)
      do i = 1, n_strip
         call begin_vertex(self, -point, merge(1.0_wp, 0.0_wp, i < n_strip), vertex(i))
         call add_point(self, sides, point, vertex(i), 1.0_wp + i*strip)
         do k = 1, size(inner)
            call add_point(self, sides, inner(k), vertex(i), -i*strip/real(size(inner), wp))
         end do
      end do
   end subroutine add_outer

   !> The neighbours of a point at the end of a list that are not at its end; where there are none
   !> those that are.
   pure subroutine find_inner(sides, node, point, normal, x, u, inner)
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: node, point
      real(wp), intent(in) :: normal(3)
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      integer, allocatable, intent(out) :: inner(:)
      integer, allocatable :: at_end(:)
      integer :: i, k, side, other

      allocate(inner(0), at_end(0))
      associate (triangles => sides%triangles)
         do i = triangles%around_start(point), triangles%around_start(point + 1) - 1
            associate (t => triangles%around(i))
               if (.not. is_facing(sides, node, t, normal, x, u)) cycle
               do side = 1, 3
                  k = 1 + mod(side, 3)
                  if (triangles%split%corner(side, t) == point) then
                     other = triangles%split%corner(k, t)
                  else if (triangles%split%corner(k, t) == point) then
                     other = triangles%split%corner(side, t)
                  else
                     cycle
                  end if
                  if (is_end(triangles%beyond(side, t))) then
                     at_end = [at_end, other]
                  else
                     inner = [inner, other]
                  end if
               end do
            end associate
         end do
      end associate
      at_end = unique_sorted(at_end)
      inner = unique_sorted(inner)
      if (size(inner) == 0) inner = at_end

   contains

      pure logical function is_end(beyond)
         integer, intent(in) :: beyond           !! 0: none

         is_end = beyond == 0
         if (.not. is_end) is_end = .not. is_facing(sides, node, beyond, normal, x, u)
      end function is_end

   end subroutine find_inner

   !> Where the nodes of a stencil are, from its slave node on, and how they move: origin, both
   !> vectors of the frame, vertices.
   pure subroutine patch_stencil_gather(self, x, u0, du, at, way)
      type(patch_stencil_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(out) :: at(:, :), way(:, :)   !! (3, 3 + n_vertex) [L]
      real(wp) :: from(3), motion(3)
      integer :: i, j

      at = 0.0_wp
      way = 0.0_wp
      associate (slave => self%node(1))
         do i = 2, self%n_node
            from = (x(:, self%node(i)) - x(:, slave)) + (u0(:, self%node(i)) - u0(:, slave))
            motion = du(:, self%node(i)) - du(:, slave)
            do j = 1, 2 + self%patch%n_vertex
               if (.not. abs(self%weight(i, j)) > 0.0_wp) cycle
               at(:, 1 + j) = at(:, 1 + j) + self%weight(i, j)*from
               way(:, 1 + j) = way(:, 1 + j) + self%weight(i, j)*motion
            end do
         end do
      end associate
   end subroutine patch_stencil_gather

   !> How far the slave node of a stencil is from the curved surface that the nearest triangle
   !> stands for, > 0 in front of it.
   pure real(wp) function patch_stencil_height(self, sides, bulges, x, u) result(height)
      type(patch_stencil_t), intent(in) :: self  !! with a triangle
      type(patch_sides_t), intent(in) :: sides
      type(bulges_t), intent(in) :: bulges       !! of the master
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp), dimension(3, 3 + self%patch%n_vertex) :: at, way
      real(wp) :: corner(3, 3)
      type(nearest_t) :: nearest
      integer :: k

      do k = 1, 3
         corner(:, k) = place_of(sides, sides%triangles%split%corner(k, self%triangle), &
            self%node(1), x, u)
      end do
      call nearest_update(nearest, self%triangle, [0.0_wp, 0.0_wp, 0.0_wp], corner)
      call patch_stencil_gather(self, x, u, 0.0_wp*u, at, way)
      height = sign(sqrt(nearest%square), dot_product(matmul(corner, nearest%weight), &
         cross_product(at(:, 2), at(:, 3)))) &
         - bulges_rise(bulges, sides%triangles%split, self%triangle, nearest%weight)
   end function patch_stencil_height

end module emcon_patch_stencil_space
