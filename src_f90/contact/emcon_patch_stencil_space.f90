! build: elements
!> Which triangles of the master the patch of a slave node looks at in a step, and which nodes these
!> are made of.
!>
!> Source: docs/theory.md, section 14.
module emcon_patch_stencil_space
   use emcon_element_kind, only : max_face_nodes
   use emcon_kinds, only : wp
   use emcon_patch_look_space, only : patch_t
   use emcon_patch_moments_space, only : patch_triangle
   use emcon_patch_near_space, only : narrow_flange, patch_near_find, patch_near_goes_on, &
      patch_near_list, patch_near_nearest, patch_near_pass, patch_near_t, patch_scope_t, &
      room_behind
   use emcon_patch_sides_space, only : frame_normal, patch_sides_t, sides_holds, &
      sides_in_plane, sides_point
   use emcon_sort, only : unique_sorted
   implicit none
   private
   public :: patch_stencil_t, patch_stencil_choose

   !> Sides of the patch, by the shorter of the facets of both sides.
   real(wp), parameter :: patch_size = 0.07_wp
   !> Where a surface ends it goes on by strips of this part of a facet, by less where those of the
   !> slave are smaller, and fades on the last one.
   real(wp), parameter :: flange = 0.2_wp
   integer, parameter :: most_strips = 2
   !> A node is behind a triangle by no more than so many of its distances, and `room_behind`.
   real(wp), parameter :: distances = 2.0_wp

   !> The patch of one frame for a step, and its vertices as sums of nodes.
   type :: patch_stencil_t
      integer :: triangle = 0                    !! nearest of the master; 0: none near
      integer :: corner(3) = 0                   !! its vertices, as those of the patch run
      type(patch_t) :: patch
      real(wp) :: size = 0.0_wp                  !! length of its facet [L]
      real(wp) :: deepest = 0.0_wp               !! farther behind is another side of the body [L]
      integer :: n_strip = most_strips           !! where the surface ends:
      real(wp) :: strip = flange                 !! each so wide, by the facet
      integer :: of_point = 0                    !! contact point of the slave
      integer :: n_node = 0
      integer :: n_slave = 0                     !! nodes 1..n_slave are of the frame
      integer :: n_origin = 0                    !! of these that its point is a sum of; 0: is one
      real(wp) :: origin(max_face_nodes) = 0.0_wp   !! their weights in it
      !> (>= n_vertex) of the master, images with numbers beyond; < 0: of a flange; 0: in its middle
      integer, allocatable :: point(:)
      integer, allocatable :: node(:)            !! (>= n_node) the slave node, then others
      integer, allocatable :: flip(:)            !! (>= n_node) or mirror images of these
      integer :: planes = 0                      !! of symmetry that it is in, a bit for each axis
      !> (>= n_node, >= 2 + n_vertex) of nodes in the vectors of the frame and in vertices
      real(wp), allocatable :: weight(:, :)
      !> (>= 3 + n_vertex) entries before each of these columns; (any) what is not 0 there, side by
      !> side in memory, and its rows
      integer, allocatable :: start(:), row(:)
      real(wp), allocatable :: entry(:)
   end type patch_stencil_t

contains

   !> Choose the stencil of frame `frame` of the slave at x + u, where the facets of `scope` are
   !> near its node: the nearest triangle that faces this frame more than any other of the node, and
   !> what hangs together with that and faces the frame too.
   pure subroutine patch_stencil_choose(self, sides, frame, scope, x, u)
      type(patch_stencil_t), intent(inout) :: self
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: frame               !! 1 to the number of all frames
      type(patch_scope_t), intent(in) :: scope   !! what is near
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      type(patch_near_t) :: near
      real(wp) :: normal(3)
      logical :: is_past
      integer :: i, nearest

      self%triangle = 0
      if (allocated(self%patch%start)) deallocate(self%patch%start)
      if (size(scope%facet) == 0) return
      i = sides%frames%point(frame)
      call patch_near_find(near, sides, i, scope, x, u)
      normal = frame_normal(sides%frames, frame, sides%frames%base(i), x, u)
      do
         nearest = patch_near_nearest(near, sides, frame, x, u)
         if (nearest == 0) return
         call patch_near_list(near, sides, nearest, normal, x, u)
         call patch_near_pass(near, sides, nearest, x, u, is_past)
         if (.not. is_past) exit
      end do
      if (.not. any(near%is_listed .and. .not. near%is_beside)) return
      self%deepest = room_behind*sides%triangles%size(near%triangle(nearest)) - distances &
         *near%distance(nearest)/dot_product(near%normal(:, nearest), normal)
      self%triangle = near%triangle(nearest)
      self%size = sides%triangles%size(self%triangle)
      self%patch%length = patch_size*min(self%size, sides%frames%size(i))
      ! Of a facet much larger than the patch strips are no wider than of a small one: where they
      ! fade, heights are those at their inner side, which a slanted frame sees far off the plane.
      self%strip = flange*self%patch%length/(patch_size*self%size)
      if (sides%frames%of_triangles) then
         self%patch%length = 1.0_wp
         self%patch%area = patch_triangle()
         self%n_strip = 1
         self%strip = narrow_flange
      end if
      call make_patch(self, sides, frame, near, x, u)
   end subroutine patch_stencil_choose

   !> The vertices and triangles of the patch with their nodes.
   pure subroutine make_patch(self, sides, frame, near, x, u)
      type(patch_stencil_t), intent(inout) :: self
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: frame
      type(patch_near_t), intent(in) :: near
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      logical :: ends(3, near%n)                 !! the list ends at the side of a triangle
      logical :: is_seen(near%n)
      integer :: code, k, t

      is_seen = near%is_listed .and. .not. near%is_beside
      ends = .false.
      self%planes = 0
      do t = 1, near%n
         if (.not. near%is_listed(t)) cycle
         do k = 1, 3
            ends(k, t) = .not. goes_on(k, t)
            if (.not. ends(k, t)) cycle
            associate (planes => planes_of_side(sides, near%point, near%triangle(t), k, x))
               ends(k, t) = planes == 0
               self%planes = ior(self%planes, planes)
            end associate
         end do
      end do
      call begin_patch(self, sides, frame, count(is_seen), count(ends))
      do code = 0, self%planes
         if (iand(code, self%planes) /= code) cycle
         do t = 1, near%n
            if (is_seen(t)) call add_triangle(self, sides, near%triangle(t), code, x)
         end do
      end do
      self%patch%n_own = self%patch%n_triangle
      do k = 1, 3
         self%corner(k) = vertex_of(self, sides%triangles%split%corner(k, self%triangle))
      end do
      self%corner = self%corner([1, 3, 2])
      call end_list(self, sides, near, ends, is_seen, x, u)
      call list_weights(self)

   contains

      !> Is what is beyond a side listed, or would it be if it were nearer? A triangle of the slave
      !> sees what is beside the list.
      pure logical function goes_on(k, t)
         integer, intent(in) :: k, t             !! side of a triangle of the list

         if (.not. sides%frames%of_triangles) then
            goes_on = patch_near_goes_on(near, sides, sides%triangles%beyond(k, &
               near%triangle(t)), x, u)
         else if (near%beyond(k, t) == 0) then
            goes_on = .false.
         else
            goes_on = near%is_listed(near%beyond(k, t))
         end if
      end function goes_on

   end subroutine make_patch

   !> Where weights are not 0: few are. Those of a point that is a sum are listed for each vertex.
   pure subroutine list_weights(self)
      type(patch_stencil_t), intent(inout) :: self
      logical :: of(self%n_node - 1, 2 + self%patch%n_vertex)
      integer :: i, j, n

      of = abs(self%weight(2:self%n_node, :2 + self%patch%n_vertex)) > 0.0_wp
      of(:self%n_origin - 1, 3:) = .true.
      n = count(of)
      if (allocated(self%row)) then
         if (size(self%start) <= size(of, 2) .or. size(self%row) < n) deallocate(self%start, &
            self%row, self%entry)
      end if
      if (.not. allocated(self%row)) allocate(self%start(size(self%weight, 2) + 1), &
         self%row(2*n), self%entry(2*n))
      n = 0
      do j = 1, size(of, 2)
         self%start(j) = n
         do i = 1, size(of, 1)
            if (.not. of(i, j)) cycle
            n = n + 1
            self%row(n) = 1 + i
            self%entry(n) = self%weight(1 + i, j)
         end do
      end do
      self%start(size(of, 2) + 1) = n
   end subroutine list_weights

   !> Flanges where the list ends as the surface does, and is seen; else it fades there.
   pure subroutine end_list(self, sides, near, ends, is_seen, x, u)
      type(patch_stencil_t), intent(inout) :: self
      type(patch_sides_t), intent(in) :: sides
      type(patch_near_t), intent(in) :: near
      logical, intent(in) :: ends(:, :)          !! (3, n) at the side of a triangle
      logical, intent(in) :: is_seen(:)          !! (n)
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      integer :: code, k, side(2), t

      do code = 0, self%planes
         if (iand(code, self%planes) /= code) cycle
         do t = 1, near%n
            do k = 1, 3
               if (.not. ends(k, t)) cycle
               side = sides%triangles%split%corner([k, 1 + mod(k, 3)], near%triangle(t))
               if (.not. sides%triangles%is_ridge(k, near%triangle(t))) then
                  call fade(self, image_of(self, sides, side(1), code, x))
                  call fade(self, image_of(self, sides, side(2), code, x))
               else if (is_seen(t)) then
                  call add_flange(self, sides, near, side, code, x, u)
               end if
            end do
         end do
      end do
   end subroutine end_list

   !> The planes of symmetry that contact point `i` of the slave and side `k` of a triangle are in,
   !> a bit for each axis.
   pure integer function planes_of_side(sides, i, triangle, k, x) result(planes)
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: i, triangle, k
      real(wp), intent(in), contiguous :: x(:, :)
      integer :: a

      planes = 0
      if (sides%frames%of_triangles) return
      associate (corner => sides%triangles%split%corner([k, 1 + mod(k, 3)], triangle))
         do a = 1, 3
            if (sides_in_plane(sides, corner(1), a, i, x) .and. &
               sides_in_plane(sides, corner(2), a, i, x)) planes = ibset(planes, a - 1)
         end do
      end associate
   end function planes_of_side

   !> Which of the planes of a patch a point of the master is in, a bit for each axis.
   pure integer function planes_of_point(self, sides, point, x) result(planes)
      type(patch_stencil_t), intent(in) :: self
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: point
      real(wp), intent(in), contiguous :: x(:, :)
      integer :: a

      planes = 0
      if (self%planes == 0) return
      do a = 1, 3
         if (.not. btest(self%planes, a - 1)) cycle
         if (sides_in_plane(sides, point, a, self%of_point, x)) planes = ibset(planes, a - 1)
      end do
   end function planes_of_point

   !> The number of the image of a point of the master in some of the planes that a patch is in:
   !> itself if it is in these.
   pure integer function image_of(self, sides, point, code, x) result(image)
      type(patch_stencil_t), intent(in) :: self
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: point, code
      real(wp), intent(in), contiguous :: x(:, :)

      image = point
      if (code == 0) return
      image = point + iand(code, not(planes_of_point(self, sides, point, x))) &
         *sides%triangles%split%n_point
   end function image_of

   !> What is seen ends at a point.
   pure subroutine fade(self, point)
      type(patch_stencil_t), intent(inout) :: self
      integer, intent(in) :: point

      associate (vertex => vertex_of(self, point))
         if (vertex > 0) self%patch%chi(vertex) = 0.0_wp
      end associate
   end subroutine fade

   !> Room for a patch of some triangles with flanges at some sides; its frame.
   pure subroutine begin_patch(self, sides, frame, n_triangle, n_end)
      type(patch_stencil_t), intent(inout) :: self
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: frame, n_triangle, n_end
      integer :: k

      self%patch%n_triangle = 0
      self%patch%n_vertex = 0
      self%of_point = sides%frames%point(frame)
      associate (most => 2**popcnt(self%planes)*(n_triangle + 4*self%n_strip*n_end), &
            most_points => 2**popcnt(self%planes)*(3*n_triangle + 3*self%n_strip*n_end))
         call make_room(self%patch, self%point, most, most_points)
         if (allocated(self%weight)) then
            if (size(self%weight, 2) < 2 + most_points) deallocate(self%weight, self%node, &
               self%flip)
         end if
         if (.not. allocated(self%weight)) allocate(self%weight(max_face_nodes, 2 + most_points), &
            self%node(max_face_nodes), self%flip(max_face_nodes))
      end associate
      self%weight(:, :2) = 0.0_wp
      self%n_node = 1
      self%node(1) = sides%frames%base(sides%frames%point(frame))
      self%flip = 0
      associate (frames => sides%frames)
         do k = frames%ring_start(frame), frames%ring_start(frame + 1) - 1
            call add_weight(self, frames%ring(k), frames%flip(k), 1, frames%weight(1, k))
            call add_weight(self, frames%ring(k), frames%flip(k), 2, frames%weight(2, k))
         end do
         self%n_slave = self%n_node
         self%n_origin = 0
         if (sides%frames%point(frame) <= frames%n_node) return
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

   !> Let `column` of the weights depend on a node, or an image of it, too.
   pure subroutine add_weight(self, node, flip, column, weight)
      type(patch_stencil_t), intent(inout) :: self
      integer, intent(in) :: node, flip, column
      real(wp), intent(in) :: weight
      real(wp), allocatable :: wider(:, :)
      integer :: k

      if (node == self%node(1)) return           ! the origin itself
      k = findloc(self%node(:self%n_node) == node .and. self%flip(:self%n_node) == flip, .true., 1)
      if (k == 0) then
         if (self%n_node == size(self%node)) then
            allocate(wider(2*self%n_node, size(self%weight, 2)), source=0.0_wp)
            wider(:self%n_node, :) = self%weight
            call move_alloc(wider, self%weight)
            self%node = [self%node, 0*self%node]
            self%flip = [self%flip, 0*self%flip]
         end if
         self%n_node = self%n_node + 1
         k = self%n_node
         self%node(k) = node
         self%flip(k) = flip
      end if
      self%weight(k, column) = self%weight(k, column) + weight
   end subroutine add_weight

   !> Add `factor` times a point of the master, or an image of it, to a vertex.
   pure subroutine add_point(self, sides, point, code, vertex, factor, x)
      type(patch_stencil_t), intent(inout) :: self
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: point, code, vertex
      real(wp), intent(in) :: factor
      real(wp), intent(in), contiguous :: x(:, :)
      integer :: a, flip, k, n, node(max_face_nodes)
      real(wp) :: weight(max_face_nodes)

      call sides_point(sides, point, n, node, weight)
      do k = 1, n
         flip = code
         do a = 1, 3
            if (.not. btest(flip, a - 1)) cycle
            if (sides_holds(sides, node(k), a, self%of_point, x)) flip = ibclr(flip, a - 1)
         end do
         call add_weight(self, node(k), flip, 2 + vertex, factor*weight(k))
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
      self%weight(:, 2 + vertex) = 0.0_wp
      self%weight(2:self%n_origin, 2 + vertex) = -self%origin(2:self%n_origin)
   end subroutine begin_vertex

   !> Add a triangle of the master, which runs the other way seen from the slave, or an image of it.
   pure subroutine add_triangle(self, sides, triangle, code, x)
      type(patch_stencil_t), intent(inout) :: self
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: triangle, code
      real(wp), intent(in), contiguous :: x(:, :)
      integer :: k, vertex(3)

      do k = 1, 3
         associate (point => sides%triangles%split%corner(k, triangle))
            associate (image => image_of(self, sides, point, code, x))
               vertex(k) = vertex_of(self, image)
               if (vertex(k) > 0) cycle
               call begin_vertex(self, image, 1.0_wp, vertex(k))
               call add_point(self, sides, point, code, vertex(k), 1.0_wp, x)
            end associate
         end associate
      end do
      call append(self%patch, vertex(merge([1, 3, 2], [1, 2, 3], mod(popcnt(code), 2) == 0)))
   end subroutine add_triangle

   pure subroutine append(patch, vertex)
      type(patch_t), intent(inout) :: patch
      integer, intent(in) :: vertex(3)

      patch%n_triangle = patch%n_triangle + 1
      patch%triangle(:, patch%n_triangle) = vertex
   end subroutine append

   !> Add two strips beyond a side of the master: on the first the field goes on, so that a patch at
   !> the end is covered, on the second it fades.
   pure subroutine add_flange(self, sides, near, side, code, x, u)
      type(patch_stencil_t), intent(inout) :: self
      type(patch_sides_t), intent(in) :: sides
      type(patch_near_t), intent(in) :: near
      integer, intent(in) :: side(2)             !! points, as the master runs
      integer, intent(in) :: code                !! of it or an image of it
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      integer :: from(0:self%n_strip), to(0:self%n_strip), k

      from(0) = vertex_of(self, image_of(self, sides, side(1), code, x))
      to(0) = vertex_of(self, image_of(self, sides, side(2), code, x))
      call add_outer(self, sides, near, [side(1), code], x, u, from(1:))
      call add_outer(self, sides, near, [side(2), code], x, u, to(1:))
      do k = 1, self%n_strip
         associate (piece => [from(k - 1), to(k - 1), to(k), from(k)])
            call add_piece(self, piece(merge([1, 2, 3, 4], [4, 3, 2, 1], &
               mod(popcnt(code), 2) == 0)))
         end associate
      end do
   end subroutine add_flange

   !> Add the four triangles of a piece of a strip about its middle: in a mirror it looks the same.
   pure subroutine add_piece(self, corner)
      type(patch_stencil_t), intent(inout) :: self
      integer, intent(in) :: corner(4)           !! vertices in turn, as the master runs
      integer :: k, middle

      associate (chi => self%patch%chi(corner))
         call begin_vertex(self, 0, 0.25_wp*sum(chi), middle)
      end associate
      self%weight(:, 2 + middle) = 0.0_wp
      do k = 1, 4
         self%weight(:, 2 + middle) = self%weight(:, 2 + middle) &
            + 0.25_wp*self%weight(:, 2 + corner(k))
      end do
      do k = 1, 4
         call append(self%patch, [corner(k), corner(1 + mod(k, 4)), middle])
      end do
   end subroutine add_piece

   !> The vertices of flanges at a point, one for each strip: away from the points inside.
   pure subroutine add_outer(self, sides, near, of, x, u, vertex)
      type(patch_stencil_t), intent(inout) :: self
      type(patch_sides_t), intent(in) :: sides
      type(patch_near_t), intent(in) :: near
      integer, intent(in) :: of(2)               !! point, planes of an image of it
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      integer, intent(out) :: vertex(:)          !! (n_strip)
      integer, allocatable :: inner(:)
      integer :: i, image, k

      associate (point => of(1), code => of(2))
         image = image_of(self, sides, point, code, x)
         k = vertex_of(self, -image)
         vertex = [(k + i - 1, i = 1, self%n_strip)]
         if (k > 0) return
         call find_inner(sides, near, point, x, u, inner)
         do i = 1, self%n_strip
            call begin_vertex(self, -image, merge(1.0_wp, 0.0_wp, i < self%n_strip), vertex(i))
            call add_point(self, sides, point, code, vertex(i), 1.0_wp + i*self%strip, x)
            call add_inner(self, sides, inner, of, vertex(i), -i*self%strip, x)
         end do
      end associate
   end subroutine add_outer

   !> Add `factor` times the mean of points, and of their images where the point they are beside is
   !> in planes of symmetry, to a vertex.
   pure subroutine add_inner(self, sides, inner, of, vertex, factor, x)
      type(patch_stencil_t), intent(inout) :: self
      type(patch_sides_t), intent(in) :: sides
      integer, intent(in) :: inner(:)
      integer, intent(in) :: of(2)               !! the point, planes of an image of it
      integer, intent(in) :: vertex
      real(wp), intent(in) :: factor
      real(wp), intent(in), contiguous :: x(:, :)
      integer :: code, k, planes
      real(wp) :: images(size(inner))

      planes = planes_of_point(self, sides, of(1), x)
      images = [(2.0_wp**popcnt(iand(planes, not(planes_of_point(self, sides, inner(k), x)))), &
         k = 1, size(inner))]
      do code = 0, planes
         if (iand(code, planes) /= code) cycle
         do k = 1, size(inner)
            call add_point(self, sides, inner(k), ieor(of(2), code), vertex, factor*images(k) &
               /(sum(images)*2.0_wp**popcnt(planes)), x)
         end do
      end do
   end subroutine add_inner

   !> The neighbours of a point at the end of a list that are not at its end; where there are none
   !> those that are.
   pure subroutine find_inner(sides, near, point, x, u, inner)
      type(patch_sides_t), intent(in) :: sides
      type(patch_near_t), intent(in) :: near
      integer, intent(in) :: point
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      integer, allocatable, intent(out) :: inner(:)
      integer, allocatable :: at_end(:)
      integer :: i, k, side, other

      allocate(inner(0), at_end(0))
      associate (triangles => sides%triangles)
         do i = triangles%around_start(point), triangles%around_start(point + 1) - 1
            associate (t => triangles%around(i))
               if (.not. patch_near_goes_on(near, sides, t, x, u)) cycle
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

         is_end = .not. patch_near_goes_on(near, sides, beyond, x, u)
      end function is_end

   end subroutine find_inner

end module emcon_patch_stencil_space
