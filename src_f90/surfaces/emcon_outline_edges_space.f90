!> The edges of the outlines behind surfaces in space, as contact of edges needs them: sides of
!> faces, and those of the triangles that faces are split into, along which a face bends.
!>
!> A surface may end where its body goes on: whether an edge of it is sharp, and which triangles
!> meet in it, is told by the outer faces of the elements. Source: docs/theory.md, section 14.
module emcon_outline_edges_space
   use emcon_csr, only : csr_list_users
   use emcon_element_kind, only : max_face_nodes
   use emcon_errors, only : error_t
   use emcon_facet_groups, only : find_turns, ridge_angle, turn_tol
   use emcon_facet_split, only : facet_split_centre, facet_split_init, facet_split_t
   use emcon_facets, only : facets_init, facets_length, facets_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_mirror_faces_space, only : always_rests, mirror_axes
   use emcon_outline_space, only : outline_faces_at
   use emcon_rigid_bodies, only : rigid_numbers
   use emcon_rotation, only : cross_product
   use emcon_scene, only : scene_t
   use emcon_sort, only : find_sorted
   use emcon_surface_nodes, only : surface_nodes
   use emcon_touch_rule_space, only : touch_rule_space_depths
   implicit none
   private
   public :: outline_edges_t, outline_edges_add, outline_edges_place, outline_edges_normals, &
      outline_edges_nodes

   integer, parameter :: most_corners = 4
   !> Edges go on along each other if the cosine between them is more.
   real(wp), parameter :: along_edge = 0.8_wp

   !> Edges of one or two surfaces. Points are nodes and virtual centres of faces.
   type :: outline_edges_t
      integer :: n = 0
      integer :: n_surface = 0
      integer, allocatable :: node(:, :)         !! (max_face_nodes, n_point) of the scene; 0: none
      real(wp), allocatable :: weight(:, :)      !! the same, of sum 1: what a point is made of
      integer, allocatable :: ends(:, :)         !! (2, n) points, as the first triangle runs
      integer, allocatable :: beside(:, :)       !! (2, n) third points of both triangles
      logical, allocatable :: is_sharp(:)        !! (n) outwards, in the reference
      logical, allocatable :: is_spoke(:)        !! (n) to a virtual centre; else a side of faces
      logical, allocatable :: is_bare(:)         !! (n) contact of nodes does not hold the last end
      logical, allocatable :: at_rim(:, :)       !! (2, n) a sharp edge runs across that end
      logical, allocatable :: bends(:)           !! (n) the angle between its triangles may change
      real(wp), allocatable :: breadth(:)        !! (n) of the smaller face there, reference [L]
      real(wp), allocatable :: depth(:)          !! (n) of the thinner element behind these [L]
      integer, allocatable :: surface(:)         !! (n) 1, 2
   end type outline_edges_t

contains

   !> Add the edges of the outline with both ends on `surface`, but those at faces that are tied or
   !> in a plane of symmetry, behind which the body goes on. Sharp are those at which faces turn by
   !> more than 20 degrees in the reference, the body inside.
   subroutine outline_edges_add(self, scene, surface)
      type(outline_edges_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      type(facets_t) :: own
      type(facets_t), allocatable :: outer
      type(facet_split_t) :: split
      type(error_t), allocatable :: error
      logical, allocatable :: goes_on(:)
      integer :: n

      call facets_init(own, scene, surface, error)
      if (.not. allocated(error)) call find_outer(scene, own, outer, error)
      ! A mesh that touches itself in an edge has no outline there but its surface.
      if (allocated(error) .or. .not. allocated(outer)) then
         outer = own
         outer%depth = touch_rule_space_depths(own, scene)
      end if
      call facet_split_init(split, outer)
      call find_tied(scene, outer, goes_on)
      goes_on = goes_on .or. mirror_axes(outer, scene) > 0
      if (self%n_surface == 0) allocate(self%node(max_face_nodes, 0), self%weight( &
         max_face_nodes, 0), self%ends(2, 0), self%beside(2, 0), self%is_sharp(0), &
         self%is_spoke(0), self%is_bare(0), &
         self%breadth(0), self%depth(0), self%surface(0))
      self%n_surface = self%n_surface + 1
      n = size(self%node, 2)
      call add_points(self, outer, split)
      call add_sides(self, scene, own, outer, split, goes_on, n)
      call add_spokes(self, own, outer, split, goes_on, n)
      self%n = size(self%is_sharp)
      call find_bending(self, scene)
      call find_rims(self, scene%x)
   end subroutine outline_edges_add

   !> At which ends of edges sharp ones run across: the body ends there.
   pure subroutine find_rims(self, x)
      type(outline_edges_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (3, n_node of the scene) reference [L]
      real(wp) :: along(3, self%n)
      integer, allocatable :: start(:), at(:)
      integer :: i, j, k

      along = ways(self, x)
      call csr_list_users(size(self%node, 2), [(1 + 2*k, k = 0, self%n)], &
         reshape(self%ends, [2*self%n]), start, at)
      if (allocated(self%at_rim)) deallocate(self%at_rim)
      allocate(self%at_rim(2, self%n), source=.false.)
      do i = 1, self%n
         do k = 1, 2
            do j = start(self%ends(k, i)) + 1, start(self%ends(k, i) + 1)
               self%at_rim(k, i) = self%at_rim(k, i) .or. (self%is_sharp(at(j)) .and. &
                  abs(dot_product(along(:, i), along(:, at(j)))) < along_edge)
            end do
         end do
      end do
   end subroutine find_rims

   !> Along each edge, of length 1.
   pure function ways(self, x) result(along)
      type(outline_edges_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :)   !! (3, n_node of the scene) reference [L]
      real(wp) :: along(3, self%n), still(3, size(x, 2))
      integer :: i

      still = 0.0_wp
      do i = 1, self%n
         along(:, i) = outline_edges_place(self, self%ends(2, i), self%node(1, self%ends(1, i)), &
            x, still)
         along(:, i) = along(:, i)/max(sqrt(dot_product(along(:, i), along(:, i))), tiny(along))
      end do
   end function ways

   !> Which edges bend: those with all nodes in one rigid body, or held, do not.
   pure subroutine find_bending(self, scene)
      type(outline_edges_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer :: rigid(size(scene%x, 2)), i
      integer, allocatable :: node(:)

      rigid = rigid_numbers(scene%rigid, size(rigid))
      where (all(always_rests(scene), 1)) rigid = -1
      if (allocated(self%bends)) deallocate(self%bends)
      allocate(self%bends(self%n))
      do i = 1, self%n
         associate (all_of_them => self%node(:, [self%ends(:, i), self%beside(:, i)]))
            node = pack(all_of_them, all_of_them > 0)
         end associate
         self%bends(i) = rigid(node(1)) == 0 .or. any(rigid(node) /= rigid(node(1)))
      end do
   end subroutine find_bending

   !> The outer faces of elements around the nodes of a surface; not allocated where there are none.
   subroutine find_outer(scene, own, outer, error)
      type(scene_t), intent(in) :: scene
      type(facets_t), intent(in) :: own
      type(facets_t), allocatable, intent(out) :: outer
      type(error_t), allocatable, intent(out) :: error
      type(surface_t) :: faces
      real(wp), allocatable :: depth(:)

      call outline_faces_at(scene, own%node, faces%edge, depth)
      if (size(faces%edge, 2) == 0) return
      allocate(outer)
      call facets_init(outer, scene, faces, error)
      if (.not. allocated(error)) outer%depth = depth
   end subroutine find_outer

   !> Which faces are tied.
   pure subroutine find_tied(scene, outer, is_tied)
      type(scene_t), intent(in) :: scene
      type(facets_t), intent(in) :: outer
      logical, allocatable, intent(out) :: is_tied(:)        !! (n_facet)
      logical :: is_meant(0:size(scene%x, 2))
      integer, allocatable :: node(:)
      integer :: f, side, t

      allocate(is_tied(outer%n_facet), source=.false.)
      do t = 1, size(scene%tie)
         do side = 1, 2
            call surface_nodes(scene, scene%surface(merge(scene%tie(t)%slave, &
               scene%tie(t)%master, side == 1)), node)
            is_meant = .false.
            is_meant(0) = .true.
            is_meant(node) = .true.
            do f = 1, outer%n_facet
               is_tied(f) = is_tied(f) .or. all(is_meant(outer%facet(:, f)))
            end do
         end do
      end do
   end subroutine find_tied

   !> The points of a split.
   pure subroutine add_points(self, outer, split)
      type(outline_edges_t), intent(inout) :: self
      type(facets_t), intent(in) :: outer
      type(facet_split_t), intent(in) :: split
      integer :: node(max_face_nodes, split%n_point), i, n
      real(wp) :: weight(max_face_nodes, split%n_point)

      node = 0
      weight = 0.0_wp
      do i = 1, split%n_point
         if (i <= split%n_node) then
            node(1, i) = outer%node(i)
            weight(1, i) = 1.0_wp
         else
            associate (own => outer%facet(:, split%of_centre(i - split%n_node)))
               n = count(own > 0)
               node(:n, i) = own(:n)
               weight(:n, i) = facet_split_centre(n)
            end associate
         end if
      end do
      n = size(self%node, 2) + split%n_point
      self%node = reshape([self%node, node], [max_face_nodes, n])
      self%weight = reshape([self%weight, weight], [max_face_nodes, n])
   end subroutine add_points

   !> The sides of faces, of each two that meet in one once.
   pure subroutine add_sides(self, scene, own, outer, split, goes_on, n_before)
      type(outline_edges_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(facets_t), intent(in) :: own, outer
      type(facet_split_t), intent(in) :: split
      logical, intent(in) :: goes_on(:)          !! (n_facet) the body does, behind a face
      integer, intent(in) :: n_before            !! points of other surfaces
      real(wp), allocatable :: turn(:, :)
      integer :: ends(2, size(outer%corner)), beside(2, size(outer%corner)), f, j, k, m, n
      logical :: is_sharp(size(outer%corner))
      real(wp), dimension(size(outer%corner)) :: breadth, depth

      call find_turns(outer, scene%x, turn)
      n = 0
      do f = 1, outer%n_facet
         m = count(outer%corner(:, f) > 0)
         do k = 1, m
            associate (beyond => outer%neighbour(k, f), &
                  side => outer%corner([k, 1 + mod(k, m)], f))
               if (beyond <= f .or. goes_on(f)) cycle
               if (goes_on(beyond)) cycle
               if (any([(find_sorted(own%node, outer%node(side(j))), j = 1, 2)] == 0)) cycle
               n = n + 1
               ends(:, n) = n_before + side
               beside(:, n) = n_before + [apex(f, side), apex(beyond, side)]
               is_sharp(n) = turn(k, f) > ridge_angle + turn_tol
               breadth(n) = min(facets_length(outer, f), facets_length(outer, beyond))
               depth(n) = minval(outer%depth([f, beyond]))
            end associate
         end do
      end do
      call append(self, ends(:, :n), beside(:, :n), is_sharp(:n), breadth(:n), depth(:n))

   contains

      !> The point of the triangle of face `f` at a side that is not at its ends.
      pure integer function apex(f, side)
         integer, intent(in) :: f, side(2)
         integer :: i

         apex = split%centre(f)
         if (apex > 0) return
         do i = 1, 3
            if (all(outer%corner(i, f) /= side)) apex = outer%corner(i, f)
         end do
      end function apex

   end subroutine add_sides

   !> The sides of the triangles of faces that go to virtual centres.
   pure subroutine add_spokes(self, own, outer, split, goes_on, n_before)
      type(outline_edges_t), intent(inout) :: self
      type(facets_t), intent(in) :: own, outer
      type(facet_split_t), intent(in) :: split
      logical, intent(in) :: goes_on(:)          !! (n_facet) the body does, behind a face
      integer, intent(in) :: n_before            !! points of other surfaces
      integer :: ends(2, size(outer%corner)), beside(2, size(outer%corner)), f, k, m, n
      real(wp), dimension(size(outer%corner)) :: breadth, depth

      n = 0
      do f = 1, outer%n_facet
         if (split%centre(f) == 0 .or. goes_on(f)) cycle
         m = count(outer%corner(:, f) > 0)
         associate (corner => outer%corner(:m, f))
            if (any([(find_sorted(own%node, outer%facet(k, f)), k = 1, m)] == 0)) cycle
            do k = 1, m
               ends(:, n + k) = n_before + [corner(k), split%centre(f)]
               beside(:, n + k) = n_before + corner([1 + mod(k + m - 2, m), 1 + mod(k, m)])
            end do
            breadth(n + 1:n + m) = facets_length(outer, f)
            depth(n + 1:n + m) = outer%depth(f)
            n = n + m
         end associate
      end do
      call append(self, ends(:, :n), beside(:, :n), spread(.false., 1, n), breadth(:n), &
         depth(:n))
   end subroutine add_spokes

   !> Append edges of the newest surface.
   pure subroutine append(self, ends, beside, is_sharp, breadth, depth)
      type(outline_edges_t), intent(inout) :: self
      integer, intent(in) :: ends(:, :), beside(:, :)
      logical, intent(in) :: is_sharp(:)
      real(wp), intent(in) :: breadth(:), depth(:)   !! [L]
      integer :: i, n

      n = size(self%is_sharp) + size(is_sharp)
      self%ends = reshape([self%ends, ends], [2, n])
      self%beside = reshape([self%beside, beside], [2, n])
      self%is_sharp = [self%is_sharp, is_sharp]
      self%is_spoke = [self%is_spoke, (count(self%node(:, ends(2, i)) > 0) > 1, i = 1, &
         size(is_sharp))]
      self%is_bare = [self%is_bare, (is_centre(self%node(:, ends(2, i))), i = 1, size(is_sharp))]
      self%breadth = [self%breadth, breadth]
      self%depth = [self%depth, depth]
      self%surface = [self%surface, spread(self%n_surface, 1, size(is_sharp))]
   end subroutine append

   !> Is a point the centre of a face with no node between corners? Others are contact points.
   pure logical function is_centre(node)
      integer, intent(in) :: node(:)             !! that it is made of; 0: no more

      is_centre = count(node > 0) > 1 .and. count(node > 0) <= most_corners
   end function is_centre

   !> The nodes that the ends of edges are made of, those of each once.
   pure function outline_edges_nodes(self) result(node)
      type(outline_edges_t), intent(in) :: self
      integer, allocatable :: node(:, :)         !! (any, n) of the scene; 0: no more
      integer :: i

      ! The first end of an edge is a node; where the second is a centre it is made of that, too.
      allocate(node(max(2, maxval([(count(self%node(:, self%ends(2, i)) > 0), i = 1, self%n)])), &
         self%n), source=0)
      do i = 1, self%n
         associate (second => self%node(:, self%ends(2, i)))
            if (second(2) > 0) then
               node(:, i) = second(:size(node, 1))
            else
               node(:2, i) = [self%node(1, self%ends(1, i)), second(1)]
            end if
         end associate
      end do
   end function outline_edges_nodes

   !> A point, from `base`.
   pure function outline_edges_place(self, point, base, x, u) result(place)
      type(outline_edges_t), intent(in) :: self
      integer, intent(in) :: point               !! 1 to n_point
      integer, intent(in) :: base                !! node of the scene
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node of the scene) [L]
      real(wp) :: place(3)
      integer :: k

      place = 0.0_wp
      do k = 1, max_face_nodes
         associate (node => self%node(k, point))
            if (node == 0) return
            place = place + self%weight(k, point)*((x(:, node) - x(:, base)) &
               + (u(:, node) - u(:, base)))
         end associate
      end do
   end function outline_edges_place

   !> The outward normals of both triangles at edge `i`, of unit length, at x + u.
   pure function outline_edges_normals(self, i, x, u) result(normal)
      type(outline_edges_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1 to n
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node of the scene) [L]
      real(wp) :: normal(3, 2)
      integer :: k

      associate (base => self%node(1, self%ends(1, i)))
         associate (along => outline_edges_place(self, self%ends(2, i), base, x, u))
            do k = 1, 2
               ! The second triangle runs along the edge the other way.
               normal(:, k) = real(3 - 2*k, wp)*cross_product(along, outline_edges_place(self, &
                  self%beside(k, i), base, x, u))
               normal(:, k) = normal(:, k)/max(sqrt(dot_product(normal(:, k), normal(:, k))), &
                  tiny(normal))
            end do
         end associate
      end associate
   end function outline_edges_normals

end module emcon_outline_edges_space
