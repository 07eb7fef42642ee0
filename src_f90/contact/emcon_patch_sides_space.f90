! build: elements
!> Both sides of contact of nodes in space, as they are made once: frames that move with the nodes
!> of the slave, and triangles of the master with what is beyond their sides.
!>
!> Source: docs/theory.md, section 14.
module emcon_patch_sides_space
   use emcon_csr, only : csr_list_users
   use emcon_element_kind, only : max_face_nodes
   use emcon_facet_groups, only : facet_groups_init, facet_groups_t, find_turns, group_angle, &
      ridge_angle
   use emcon_facet_split, only : facet_split_centre, facet_split_init, &
      facet_split_middles, facet_split_t
   use emcon_facets, only : facets_length, facets_normal, facets_t
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   use emcon_sort, only : unique_sorted
   use emcon_touch_rule_space, only : touch_rule_space_t
   implicit none
   private
   public :: point_frames_t, point_frames_init, patch_triangles_t, patch_triangles_init, &
      patch_sides_t, sides_point, sides_place, sides_in_plane, sides_holds, &
      frame_normal, frame_sides, flip_signs

   !> A ring of no direction: its fourth moment is less than this part of that of distances.
   real(wp), parameter :: round = 1.0e-6_wp
   !> The tangent of the angle by which a frame may lean from its mean normal.
   real(wp), parameter :: upright = 0.1_wp
   !> A node is in a plane if it is no farther off than this, by the facets.
   real(wp), parameter :: in_plane = 1.0e-9_wp
   !> A surface goes through a plane of symmetry smoothly if the sine of its slope there is less.
   real(wp), parameter :: steep = 0.5_wp
   !> A node may be in two planes of symmetry, with as many images of what is around it.
   integer, parameter :: n_image = 4
   !> A mean normal shorter than this, by the area, is none.
   real(wp), parameter :: blunt = 1.0e-2_wp

   !> Frames of contact points: the nodes of a surface, then the virtual centres of its facets that
   !> have nodes between corners, as far as these are meant; or, of gaps that are integrated, the
   !> middles of the triangles of its split, with sides of these as a and b. The vectors a and b of
   !> a frame, and where its point is from the node it is counted from, are sums of weight times
   !> (x(ring) - x(base)); lengths of a and b are as in the reference.
   type :: point_frames_t
      integer :: n = 0                           !! frames of all points
      integer :: n_node = 0                      !! points 1..n_node are nodes
      logical :: of_triangles = .false.          !! patches are triangles of slave facets
      integer, allocatable :: middle(:)          !! (n_point - n_node) facets of the centres
      integer, allocatable :: base(:)            !! (n_point) node of the scene
      integer, allocatable :: start(:)           !! (n_point + 1) first frame of each point
      integer, allocatable :: point(:)           !! (n) that of each frame
      integer, allocatable :: ring_start(:)      !! (n + 1)
      integer, allocatable :: ring(:)            !! nodes of the scene
      integer, allocatable :: flip(:)            !! (size of `ring`) or mirror images of them
      real(wp), allocatable :: weight(:, :)      !! (3, size of `ring`) in a, in b, in the point
      real(wp), allocatable :: size(:)           !! (n_point) mean length of facets there [L]
      real(wp), allocatable :: area(:)           !! (n_point) in the reference [L^2]
   end type point_frames_t

   !> The triangles of a surface in space.
   type :: patch_triangles_t
      type(facet_split_t) :: split
      integer, allocatable :: beyond(:, :)       !! (3, n) triangle beyond each side; 0: none
      logical, allocatable :: is_ridge(:, :)     !! (3, n) the surface is sharp or ends at the side
      integer, allocatable :: around_start(:)    !! (n_point + 1) triangles at each point:
      integer, allocatable :: around(:)          !! around_start(i) to around_start(i + 1) - 1
      real(wp), allocatable :: size(:)           !! (n) length of the facet of each [L]
   end type patch_triangles_t

   type :: patch_sides_t
      type(facets_t) :: slave
      type(facets_t), allocatable :: master      !! gfortran 12 loses a second one of its kind
      type(point_frames_t) :: frames             !! of the slave
      type(patch_triangles_t) :: triangles             !! of the master
      type(touch_rule_space_t) :: rule           !! what may touch where both are one
      integer, allocatable :: mirror(:)          !! (n_facet of the master) axis along which it
                                                 !! rests in a plane of symmetry; 0: none
      logical, allocatable :: rests(:, :)        !! (3, n_point) where contact points do
      logical, allocatable :: node_rests(:, :)   !! (3, n_node of the scene) where nodes do
   end type patch_sides_t

contains

   !> The nodes of a point of the master and their weights: a node is itself, a centre is made
   !> of the nodes of its facet.
   pure subroutine sides_point(self, point, n, node, weight)
      type(patch_sides_t), intent(in) :: self
      integer, intent(in) :: point               !! of the split
      integer, intent(out) :: n                  !! number of nodes
      integer, intent(out) :: node(:)            !! (>= nodes of a facet) of the scene
      real(wp), intent(out) :: weight(:)         !! the same; of sum 1
      integer :: f

      associate (split => self%triangles%split, master => self%master)
         if (point <= split%n_node) then
            n = 1
            node(1) = master%node(point)
            weight(1) = 1.0_wp
            return
         end if
         f = split%of_centre(point - split%n_node)
         n = count(master%facet(:, f) > 0)
         node(:n) = master%facet(:n, f)
         weight(:n) = facet_split_centre(n)
      end associate
   end subroutine sides_point

   !> A point of the master, from `node`.
   pure function sides_place(self, point, node, x, u) result(place)
      type(patch_sides_t), intent(in) :: self
      integer, intent(in) :: point               !! of the split
      integer, intent(in) :: node                !! of the scene
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp) :: place(3)
      integer :: k, n, part(max_face_nodes)
      real(wp) :: weight(max_face_nodes)

      call sides_point(self, point, n, part, weight)
      place = 0.0_wp
      do k = 1, n
         place = place + weight(k)*((x(:, part(k)) - x(:, node)) + (u(:, part(k)) - u(:, node)))
      end do
   end function sides_place

   !> Is a point of the master in the plane of symmetry normal to axis `a` that contact point `i` of
   !> the slave rests in?
   pure logical function sides_in_plane(self, point, a, i, x) result(is_in)
      type(patch_sides_t), intent(in) :: self
      integer, intent(in) :: point               !! of the split
      integer, intent(in) :: a                   !! axis
      integer, intent(in) :: i                   !! contact point
      real(wp), intent(in) :: x(:, :)            !! (3, n_node) [L]
      integer :: k, n, node(max_face_nodes)
      real(wp) :: weight(max_face_nodes)

      is_in = self%rests(a, i)
      if (.not. is_in) return
      call sides_point(self, point, n, node, weight)
      is_in = all([(sides_holds(self, node(k), a, i, x), k = 1, n)])
   end function sides_in_plane

   !> Does a node rest in the plane normal to axis `a` that contact point `i` of the slave is in?
   pure logical function sides_holds(self, node, a, i, x) result(holds)
      type(patch_sides_t), intent(in) :: self
      integer, intent(in) :: node                !! of the scene
      integer, intent(in) :: a                   !! axis
      integer, intent(in) :: i                   !! contact point
      real(wp), intent(in) :: x(:, :)            !! (3, n_node) [L]

      holds = self%node_rests(a, node) .and. abs(x(a, node) - x(a, self%frames%base(i))) &
         <= in_plane*self%frames%size(i)
   end function sides_holds

   !> The frames at all contact points of a surface: at a node of each smooth group of its facets
   !> there, and of all of them where there are several; at a centre of its facet. Facets in a plane
   !> of symmetry make no corner with others.
   pure subroutine point_frames_init(self, facets, x, is_meant, is_mirror, rests)
      type(point_frames_t), intent(out) :: self
      type(facets_t), intent(in) :: facets       !! in space
      real(wp), intent(in) :: x(:, :)            !! (3, n_node of the scene) reference [L]
      logical, intent(in) :: is_meant(:)         !! (n_node) it needs frames
      logical, intent(in) :: is_mirror(:)        !! (n_facet) in a plane of symmetry
      logical, intent(in) :: rests(:, :)         !! (3, n_node of the scene) always
      type(facet_groups_t) :: groups
      integer :: g, i

      call facet_groups_init(groups, facets, x, group_angle)
      self%n_node = size(facets%node)
      self%middle = facet_split_middles(facets, is_meant)
      self%base = [facets%node, facets%facet(2, self%middle)]
      associate (n => size(self%base), n_frame => groups%n_group + size(self%base), &
            n_ring => n_image*2*size(groups%ring) + size(facets%facet, 1)*size(self%middle))
         allocate(self%start(n + 1), self%ring_start(n_frame + 1), source=1)
         allocate(self%size(n), self%area(n), self%weight(3, n_ring), source=0.0_wp)
         allocate(self%ring(n_ring), self%flip(n_ring), source=0)
      end associate
      do i = 1, size(self%base)
         self%start(i + 1) = self%start(i)
         if (i <= size(facets%node)) then
            if (is_meant(i)) call add_node(self, facets, groups, x, is_mirror, rests, i)
         else
            call add_centre(self, facets, x, i, self%middle(i - size(facets%node)))
         end if
      end do
      self%n = self%start(size(self%start)) - 1
      self%point = [((i, g = self%start(i), self%start(i + 1) - 1), i = 1, size(self%base))]
   end subroutine point_frames_init

   !> The frames of node `i`.
   pure subroutine add_node(self, facets, groups, x, is_mirror, rests, i)
      type(point_frames_t), intent(inout) :: self
      type(facets_t), intent(in) :: facets
      type(facet_groups_t), intent(in) :: groups
      real(wp), intent(in) :: x(:, :)
      logical, intent(in) :: is_mirror(:), rests(:, :)
      integer, intent(in) :: i
      integer, allocatable :: corner(:), ring(:)
      integer :: g, n

      n = 0
      allocate(corner(0), ring(0))
      do g = groups%node_start(i), groups%node_start(i + 1) - 1
         associate (own => groups%facet(groups%start(g):groups%start(g + 1) - 1), &
               around => groups%ring(groups%ring_start(g):groups%ring_start(g + 1) - 1))
            call add_frame(self, facets, x, i, own, around, rests)
            if (all(is_mirror(own))) cycle
            n = n + 1
            corner = [corner, own]
            ring = [ring, around]
         end associate
      end do
      if (n > 1) call add_frame(self, facets, x, i, corner, unique_sorted(ring), rests)
      associate (around => facets%around(facets%around_start(i):facets%around_start(i + 1) - 1))
         if (size(around) == 0) return
         self%size(i) = sum([(facets_length(facets, around(g)), g = 1, size(around))]) &
            /real(size(around), wp)
         self%area(i) = sum([(facets%size(around(g))/real(count(facets%corner(:, around(g)) > 0), &
            wp), g = 1, size(around))])
      end associate
   end subroutine add_node

   !> The frame of the centre of facet `f`, point `i`.
   pure subroutine add_centre(self, facets, x, i, f)
      type(point_frames_t), intent(inout) :: self
      type(facets_t), intent(in) :: facets
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: i, f

      self%size(i) = facets_length(facets, f)
      self%area(i) = facets%size(f)/real(count(facets%corner(:, f) > 0), wp)
      call add_frame(self, facets, x, i, [f], pack(facets%corner(:, f), &
         facets%corner(:, f) > 0))
   end subroutine add_centre

   !> Add the frame of the facets `facet` at point `i`, if they have a mean normal: docs/theory.md,
   !> eq. (44). At a node in planes of symmetry mirror images of the facets are around it, too.
   pure subroutine add_frame(self, facets, x, i, facet, ring, rests)
      type(point_frames_t), intent(inout) :: self
      type(facets_t), intent(in) :: facets
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: i                   !! a node or a centre
      integer, intent(in) :: facet(:), ring(:)   !! facets, and nodes of them as indices
      logical, intent(in), optional :: rests(:, :)           !! (3, n_node of the scene); of a node
      real(wp) :: normal(3), area, from(3, n_image*size(ring)), weight(3, n_image*size(ring))
      integer :: planes, k, m, n, node(n_image*size(ring)), flip(n_image*size(ring))

      normal = mean_normal(facets, facet, x, 0)
      area = sum(facets%size(facet))
      planes = 0
      if (present(rests)) planes = mirror_planes(x, rests, self%base(i), facets%node(ring), normal)
      if (planes > 0) normal = mean_normal(facets, facet, x, planes)
      if (.not. sqrt(dot_product(normal, normal)) > blunt*area) return
      normal = normal/sqrt(dot_product(normal, normal))
      call find_images(x, facets%node(ring), self%base(i), planes, m, node, flip)
      do k = 1, m
         from(:, k) = flip_signs(flip(k))*(x(:, node(k)) - x(:, self%base(i)))
      end do
      weight = 0.0_wp
      if (i > size(facets%node)) then
         weight(3, :m) = facet_split_centre(m)
         from(:, :m) = from(:, :m) - spread(matmul(from(:, :m), weight(3, :m)), 2, m)
      end if
      weight(:2, :m) = frame_weights(from(:, :m), normal)
      ! Places are counted from the base, the frame is about its point.
      do k = 1, 2
         weight(k, :m) = weight(k, :m) - sum(weight(k, :m))*weight(3, :m)
      end do
      n = self%ring_start(self%start(i + 1))
      self%ring(n:n + m - 1) = node(:m)
      self%flip(n:n + m - 1) = flip(:m)
      self%weight(:, n:n + m - 1) = weight(:, :m)
      self%start(i + 1) = self%start(i + 1) + 1
      self%ring_start(self%start(i + 1)) = n + m
   end subroutine add_frame

   !> The sum of the normals of facets, and of their images in planes of symmetry.
   pure function mean_normal(facets, facet, x, planes) result(normal)
      type(facets_t), intent(in) :: facets
      integer, intent(in) :: facet(:)
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: planes
      real(wp) :: normal(3), still(3, size(x, 2))
      integer :: k

      still = 0.0_wp
      normal = 0.0_wp
      do k = 1, size(facet)
         normal = normal + facets_normal(facets, facet(k), x, still)
      end do
      where ([(btest(planes, k), k = 0, 2)]) normal = 0.0_wp
   end function mean_normal

   !> The planes of symmetry that a node is in, a bit for each axis along which it rests: a side of
   !> the facets at it is in them, all of these are on one side, and go through the plane smoothly.
   pure integer function mirror_planes(x, rests, node, ring, normal) result(planes)
      real(wp), intent(in) :: x(:, :)
      logical, intent(in) :: rests(:, :)
      integer, intent(in) :: node, ring(:)       !! of the scene
      real(wp), intent(in) :: normal(3)          !! of the facets, of any length
      real(wp) :: along(size(ring)), room
      integer :: a

      planes = 0
      if (all(rests(:, node))) return
      do a = 1, 3
         if (.not. rests(a, node)) cycle
         along = x(a, ring) - x(a, node)
         room = in_plane*maxval(abs(along))
         if (.not. any(rests(a, ring) .and. abs(along) <= room)) cycle
         if (.not. (all(along >= -room) .or. all(along <= room))) cycle
         if (abs(normal(a)) < steep*sqrt(dot_product(normal, normal))) planes = ibset(planes, a - 1)
      end do
   end function mirror_planes

   !> The nodes around another one, and their images in the planes that it is in.
   pure subroutine find_images(x, ring, node, planes, n, image, flip)
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: ring(:), node       !! of the scene
      integer, intent(in) :: planes
      integer, intent(out) :: n, image(:), flip(:)
      integer :: code, k, a

      n = 0
      do code = 0, 2**3 - 1
         if (iand(code, planes) /= code) cycle
         do k = 1, size(ring)
            associate (way => x(:, ring(k)) - x(:, node))
               if (any([(btest(code, a - 1) .and. abs(way(a)) <= in_plane*maxval(abs(way)), &
                  a = 1, 3)])) cycle
               n = n + 1
               image(n) = ring(k)
               flip(n) = code
            end associate
         end do
      end do
   end subroutine find_images

   !> What the components of a vector are multiplied by in mirrors, a bit for each axis.
   pure function flip_signs(flip) result(signs)
      integer, intent(in) :: flip                !! 0 to 7
      real(wp) :: signs(3)
      integer :: a

      signs = [(merge(-1.0_wp, 1.0_wp, btest(flip, a)), a = 0, 2)]
   end function flip_signs

   !> The weights of points around another one in its frame. Where that leans, as points of a sharp
   !> ring are lower on one side, they are those that give the directions themselves.
   pure function frame_weights(from, normal) result(weight)
      real(wp), intent(in) :: from(:, :)         !! (3, n) where they are from it [L]
      real(wp), intent(in) :: normal(3)          !! of unit length
      real(wp) :: weight(2, size(from, 2))       !! [1/L]
      real(wp) :: first(3), second(3), flat(2, size(from, 2)), square(2, 2), inverse(2, 2), &
         lean(2), rest(size(from, 2))
      integer :: k

      first = from(:, 1) - dot_product(from(:, 1), normal)*normal
      first = first/sqrt(dot_product(first, first))
      second = cross_product(normal, first)
      do k = 1, size(from, 2)
         flat(:, k) = [dot_product(first, from(:, k)), dot_product(second, from(:, k))]
      end do
      flat = matmul(ring_axes(flat), flat)
      square = matmul(flat, transpose(flat))
      inverse = reshape([square(2, 2), -square(2, 1), -square(1, 2), square(1, 1)], [2, 2]) &
         /(square(1, 1)*square(2, 2) - square(1, 2)*square(2, 1))
      weight = matmul(inverse, flat)
      rest = matmul(normal, from)
      lean = matmul(weight, rest)
      if (dot_product(lean, lean) <= upright**2) return
      rest = rest - matmul(lean, flat)
      if (.not. dot_product(rest, rest) > upright**2*sum(flat**2)) return
      do k = 1, 2
         weight(k, :) = weight(k, :) - lean(k)*rest/dot_product(rest, rest)
      end do
   end function frame_weights

   !> The turn to axes that a ring of points has by its shape, whatever its numbers are: those of
   !> its fourth moment, which fix the square patch. Mirrored rings have mirrored patches.
   pure function ring_axes(flat) result(turn)
      real(wp), intent(in) :: flat(:, :)         !! (2, n) [L]
      real(wp) :: turn(2, 2)
      complex(wp) :: moment, axis

      associate (place => cmplx(flat(1, :), flat(2, :), wp))
         moment = sum(place**4)
         axis = 1.0_wp
         if (abs(moment) > round*sum(abs(place)**4)) then
            axis = exp(cmplx(0.0_wp, 0.25_wp*atan2(aimag(moment), real(moment)), wp))
         end if
      end associate
      turn = reshape([real(axis), -aimag(axis), aimag(axis), real(axis)], [2, 2])
   end function ring_axes

   !> The unit normal of frame `k`, at x + u.
   pure function frame_normal(self, k, node, x, u) result(normal)
      type(point_frames_t), intent(in) :: self
      integer, intent(in) :: k                   !! 1 to n
      integer, intent(in) :: node                !! of the scene, its base
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (3, n_node of the scene) [L]
      real(wp) :: normal(3), side(3, 2)

      side = frame_sides(self, k, node, x, u)
      normal = cross_product(side(:, 1), side(:, 2))
      normal = normal/max(sqrt(dot_product(normal, normal)), tiny(normal))
   end function frame_normal

   !> The vectors of frame `k` at x + u.
   pure function frame_sides(self, k, node, x, u) result(side)
      type(point_frames_t), intent(in) :: self
      integer, intent(in) :: k                   !! 1 to n
      integer, intent(in) :: node                !! of the scene, its base
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (3, n_node of the scene) [L]
      real(wp) :: side(3, 2)                     !! a and b [L]
      real(wp) :: way(3)
      integer :: i

      side = 0.0_wp
      do i = self%ring_start(k), self%ring_start(k + 1) - 1
         way = (x(:, self%ring(i)) - x(:, node)) + (u(:, self%ring(i)) - u(:, node))
         if (self%flip(i) > 0) way = flip_signs(self%flip(i))*way
         side(:, 1) = side(:, 1) + self%weight(1, i)*way
         side(:, 2) = side(:, 2) + self%weight(2, i)*way
      end do
   end function frame_sides

   !> The triangles of a surface.
   pure subroutine patch_triangles_init(self, facets, x)
      type(patch_triangles_t), intent(out) :: self
      type(facets_t), intent(in) :: facets       !! in space
      real(wp), intent(in) :: x(:, :)            !! (3, n_node of the scene) reference [L]
      integer :: t

      call facet_split_init(self%split, facets)
      call find_beyond(self, facets, x)
      associate (split => self%split, n => size(self%split%facet))
         self%size = [(facets_length(facets, split%facet(t)), t = 1, n)]
         call csr_list_users(split%n_point, [(1 + 3*t, t = 0, n)], reshape(split%corner, [3*n]), &
            self%around_start, self%around)
      end associate
      self%around_start = self%around_start + 1
   end subroutine patch_triangles_init

   !> What is beyond each side of the triangles. The first side of one with a centre is a side of
   !> its facet, beyond the others are the triangles after and before it.
   pure subroutine find_beyond(self, facets, x)
      type(patch_triangles_t), intent(inout) :: self
      type(facets_t), intent(in) :: facets
      real(wp), intent(in) :: x(:, :)
      real(wp), allocatable :: turns(:, :)
      integer :: f, k, t

      call find_turns(facets, x, turns)
      allocate(self%beyond(3, size(self%split%facet)), source=0)
      allocate(self%is_ridge(3, size(self%split%facet)), source=.false.)
      do t = 1, size(self%split%facet)
         f = self%split%facet(t)
         associate (first => self%split%start(f), m => &
               self%split%start(f + 1) - self%split%start(f))
            if (m == 1) then
               self%beyond(:, t) = [(across(f, k), k = 1, 3)]
               self%is_ridge(:, t) = abs(turns(:3, f)) > ridge_angle
            else
               k = t - first + 1
               self%beyond(:, t) = [across(f, k), first + mod(k, m), first + mod(k - 2 + m, m)]
               self%is_ridge(1, t) = abs(turns(k, f)) > ridge_angle
            end if
         end associate
      end do

   contains

      !> The triangle beyond side `k` of facet `f`.
      pure integer function across(f, k)
         integer, intent(in) :: f, k
         integer :: g, j, m

         across = 0
         g = facets%neighbour(k, f)
         if (g == 0) return
         m = count(facets%corner(:, g) > 0)
         do j = 1, m
            if (facets%corner(j, g) /= facets%corner(1 + mod(k, &
               count(facets%corner(:, f) > 0)), f)) cycle
            if (facets%corner(1 + mod(j, m), g) /= facets%corner(k, f)) cycle
            across = self%split%start(g) + merge(0, j - 1, m == 3)
         end do
      end function across

   end subroutine find_beyond

end module emcon_patch_sides_space
