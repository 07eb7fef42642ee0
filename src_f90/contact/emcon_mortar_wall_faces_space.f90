!> Slave facets in front of a wall: what of them faces it, and the conditions of their vertices.
!> Source: docs/theory.md, section 14.2.
module emcon_mortar_wall_faces_space
   use emcon_condition_nodes, only : nodes_append
   use emcon_condition_product, only : condition_start
   use emcon_constraint, only : condition_t
   use emcon_element_kind, only : max_face_nodes
   use emcon_errors, only : error_t
   use emcon_facet_frames_space, only : facet_corner_shares
   use emcon_facets, only : facets_init, facets_t
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_mortar_slave_space, only : mortar_slave_init, mortar_slave_t, mortar_slave_weight
   use emcon_mortar_wall_gap_space, only : n_corner, n_part_point, wall_part_t, &
      wall_triangle_gap, wall_triangle_t
   use emcon_rotation, only : cross_product
   use emcon_scene, only : scene_t
   use emcon_wall, only : wall_t
   use emcon_wall_distance_space, only : wall_at, wall_find, wall_spot_t
   use emcon_wall_gap_space, only : wall_gap_nodes
   use emcon_wall_slip_space, only : n_wall_point, wall_axis_for, wall_own_normal
   implicit none
   private
   public :: wall_faces_t, wall_faces_init, wall_faces_choose, wall_faces_corners, &
      wall_faces_weight, wall_faces_sum

   !> A triangle faces a wall if the cosine of their normals is below this, as one of a master.
   real(wp), parameter :: facing = -0.25_wp

   type, extends(mortar_slave_t) :: wall_faces_t
      type(wall_t) :: wall
      type(facets_t) :: slave
      real(wp), allocatable :: corner(:, :, :)        !! (node of the facet, 3, n_triangle) weights
      logical, allocatable :: is_facing(:)            !! (n_triangle) the wall, in the step
      !> (n_constraint) vectors of the wall that slip is counted along: as a rule, and in this step
      integer, allocatable :: usual_axis(:), axis(:)
   end type wall_faces_t

contains

   !> Set up for the pair `pair` of `scene`, whose master is a wall.
   subroutine wall_faces_init(self, scene, pair, error)
      type(wall_faces_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error
      integer :: t

      call facets_init(self%slave, scene, scene%surface(pair%slave), error)
      if (allocated(error)) return
      self%wall = scene%surface(pair%master)%wall
      call mortar_slave_init(self, self%slave, scene%x)
      associate (n_triangle => size(self%split%facet))
         allocate(self%is_facing(n_triangle), source=.false.)
         allocate(self%corner(max_face_nodes, n_corner, n_triangle))
         do t = 1, n_triangle
            call facet_corner_shares(self%slave, self%split, t, self%corner(:, :, t))
         end do
      end associate
      self%usual_axis = [(wall_axis_for(own_normal(self, t, scene%x, 0.0_wp*scene%x)), &
         t = 1, size(self%node))]
      self%axis = self%usual_axis
   end subroutine wall_faces_init

   !> The normal of the wall at the vertex of constraint `i` at x + u, in the vectors of the wall.
   pure function own_normal(self, i, x, u) result(normal)
      type(wall_faces_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp) :: normal(3)

      associate (at => wall_at(self%wall, x, u))
         normal = wall_own_normal(self%wall, at, x(:, self%node(i)) + u(:, self%node(i)))
      end associate
   end function own_normal

   !> Choose which triangles face the wall at x + u, and which of its vectors slips count along.
   pure subroutine wall_faces_choose(self, x, u)
      type(wall_faces_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp) :: corner(3, n_corner), normal(3)
      type(wall_spot_t) :: spot
      integer :: t

      do t = 1, size(self%is_facing)
         corner = wall_faces_corners(self, t, x) + wall_faces_corners(self, t, u)
         normal = cross_product(corner(:, 2) - corner(:, 1), corner(:, 3) - corner(:, 1))
         spot = wall_find(self%wall, wall_at(self%wall, x, u), sum(corner, 2)/3.0_wp)
         self%is_facing(t) = dot_product(normal, spot%normal) &
            < facing*sqrt(dot_product(normal, normal))
      end do
      do t = 1, size(self%node)
         self%axis(t) = wall_axis_for(own_normal(self, t, x, u), self%usual_axis(t))
      end do
   end subroutine wall_faces_choose

   !> The corners of triangle `t` in a field of positions, or how they move in one of motions.
   pure function wall_faces_corners(self, t, field) result(corner)
      type(wall_faces_t), intent(in) :: self
      integer, intent(in) :: t                   !! 1 to the number of triangles
      real(wp), intent(in) :: field(:, :)        !! (3, n_node of the scene) [L]
      real(wp) :: corner(3, n_corner)
      integer :: j, k, n

      associate (facet => self%slave%facet(:, self%split%facet(t)))
         n = count(facet > 0)
         corner = 0.0_wp
         do j = 1, n_corner
            do k = 1, n
               corner(:, j) = corner(:, j) + self%corner(k, j, t)*field(:, facet(k))
            end do
         end do
      end associate
   end function wall_faces_corners

   !> The multiplier of place `k` of the triangles of vertices, at the corners of its triangle: what
   !> faces a wall is covered wholly.
   pure function wall_faces_weight(self, k) result(weight)
      type(wall_faces_t), intent(in) :: self
      integer, intent(in) :: k                   !! as `start` has it
      real(wp) :: weight(n_corner)

      weight = mortar_slave_weight(self, k, merge(1.0_wp, 0.0_wp, self%is_dual))
   end function wall_faces_weight

   !> The condition of constraint `i`: the sum over its triangles, docs/theory.md, eq. (62).
   pure subroutine wall_faces_sum(self, i, sight, target, scale, item)
      type(wall_faces_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      type(wall_triangle_t), intent(in) :: sight(:)   !! (n_triangle)
      real(wp), intent(in) :: target             !! distance to hold [L]
      real(wp), intent(in) :: scale              !! > 0, what the value is divided by [L^2]
      type(condition_t), intent(inout) :: item
      type(wall_part_t) :: gap
      integer :: k

      call begin_condition(self, i, item)
      do k = self%start(i), self%start(i + 1) - 1
         associate (t => self%triangle(k))
            if (.not. self%is_facing(t)) cycle
            call wall_triangle_gap(sight(t), wall_faces_weight(self, k), target, &
               item%leaves_second, gap)
            call add_gap(self, t, gap, scale, item)
         end associate
      end do
   end subroutine wall_faces_sum

   !> The nodes of the condition of constraint `i`: its own first, then others of the slave, then
   !> those of the wall, all of these with friction; and no derivatives yet.
   pure subroutine begin_condition(self, i, item)
      type(wall_faces_t), intent(in) :: self
      integer, intent(in) :: i
      type(condition_t), intent(inout) :: item
      integer, allocatable :: list(:)
      integer :: k, n

      associate (triangle => self%triangle(self%start(i):self%start(i + 1) - 1))
         allocate(list(1 + max_face_nodes*size(triangle) + size(self%wall%node)))
         list(1) = self%node(i)
         n = 1
         do k = 1, size(triangle)
            if (self%is_facing(triangle(k))) call nodes_append(self%slave%facet(:, &
               self%split%facet(triangle(k))), list, n)
         end do
      end associate
      item%n_slave = n
      call nodes_append(self%wall%node(:merge(n_wall_point, wall_gap_nodes(self%wall), &
         item%has_friction) - 1), list, n)
      call condition_start(item, list(:n), self%slave%n_dim)
      item%is_mean = .true.
   end subroutine begin_condition

   !> Add the integral over triangle `t` by `scale` to a condition that has its nodes.
   pure subroutine add_gap(self, t, gap, scale, item)
      type(wall_faces_t), intent(in) :: self
      integer, intent(in) :: t
      type(wall_part_t), intent(in) :: gap
      real(wp), intent(in) :: scale              !! > 0 [L^2]
      type(condition_t), intent(inout) :: item
      !> Of nodes of the condition in corners and in those of the wall
      real(wp) :: weight(max_face_nodes + n_part_point - n_corner, n_part_point)
      integer :: place(size(weight, 1)), k, n

      item%gap0 = item%gap0 + gap%f0/scale
      item%gap1 = item%gap1 + gap%f1/scale
      item%dgap = item%dgap + gap%df/scale
      weight = 0.0_wp
      associate (facet => self%slave%facet(:, self%split%facet(t)))
         n = count(facet > 0)
         do k = 1, n
            place(k) = findloc(item%node(:item%n_node), facet(k), 1)
            weight(k, :n_corner) = self%corner(k, :, t)
         end do
      end associate
      do k = 1, min(item%n_node - item%n_slave, n_part_point - n_corner)
         n = n + 1
         place(n) = item%n_slave + k
         weight(n, n_corner + k) = 1.0_wp
      end do
      item%g(:, place(:n)) = item%g(:, place(:n)) + matmul(gap%g, transpose(weight(:n, :)))/scale
      item%c(:, place(:n)) = item%c(:, place(:n)) + matmul(gap%c, transpose(weight(:n, :)))/scale
      if (.not. item%leaves_second) call add_second(gap%h, weight(:n, :), 1.0_wp/scale, &
         place(:n), item%h)
   end subroutine add_gap

   !> Add `factor` times second derivatives by sums of nodes to those by nodes.
   pure subroutine add_second(part, weight, factor, place, of_node)
      real(wp), intent(in) :: part(:, :)         !! (3 sums, the same)
      real(wp), intent(in) :: weight(:, :)       !! (n, sums)
      real(wp), intent(in) :: factor
      integer, intent(in) :: place(:)            !! (n)
      real(wp), intent(inout) :: of_node(:, :)
      real(wp) :: half(size(part, 1), 3)
      integer :: j, k, l, m

      do l = 1, size(place)
         half = 0.0_wp
         do m = 1, size(weight, 2)
            half = half + factor*weight(l, m)*part(:, 3*m - 2:3*m)
         end do
         do k = 1, size(place)
            associate (to => of_node(3*place(k) - 2:3*place(k), 3*place(l) - 2:3*place(l)))
               do j = 1, size(weight, 2)
                  to = to + weight(k, j)*half(3*j - 2:3*j, :)
               end do
            end associate
         end do
      end do
   end subroutine add_second

end module emcon_mortar_wall_faces_space
