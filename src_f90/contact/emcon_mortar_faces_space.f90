!> Slave facets of mortar contact in space: their triangles, the multipliers of their vertices, and
!> what of the master each triangle may see. Source: docs/theory.md, section 15.2.
module emcon_mortar_faces_space
   use emcon_errors, only : error_t
   use emcon_facet_frames_space, only : facet_frames_init, facet_weights_init, facet_weights_t
   use emcon_facet_groups, only : facet_groups_init, facet_groups_t, group_angle
   use emcon_facet_split, only : facet_split_init, facet_split_t
   use emcon_facets, only : facets_init, facets_length
   use emcon_frame_slip_space, only : tangent_basis
   use emcon_interactions, only : contact_pair_t, interaction_reach
   use emcon_kinds, only : wp
   use emcon_near_list, only : near_list_init, near_list_t, near_list_within
   use emcon_patch_sides_space, only : patch_sides_t, patch_triangles_init
   use emcon_patch_stencil_space, only : patch_stencil_choose, patch_stencil_t
   use emcon_rotation, only : cross_product
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: mortar_faces_t, mortar_faces_init, mortar_faces_choose, mortar_faces_weight, &
      mortar_faces_direction

   type :: mortar_faces_t
      type(patch_sides_t) :: sides
      type(facet_split_t) :: split                    !! of the slave
      type(facet_weights_t) :: weights
      type(near_list_t) :: near
      real(wp) :: beyond = 0.0_wp                     !! of its reach what is beside stencils [L]
      logical :: is_dual = .true.                     !! multiplier basis
      integer, allocatable :: node(:)                 !! (n) of each constraint
      integer, allocatable :: start(:)                !! (n + 1) triangles of each:
      integer, allocatable :: triangle(:)             !! start(i) to start(i + 1) - 1
      integer, allocatable :: vertex(:)               !! the same: which vertex of its facet it is
      !> (2, n) a direction along the surface at each, in the sides of its first facet at its vertex
      real(wp), allocatable :: along(:, :)
      type(patch_stencil_t), allocatable :: stencil(:)   !! (n_triangle)
   end type mortar_faces_t

contains

   !> Set up the facets of `pair`.
   subroutine mortar_faces_init(self, scene, pair, error)
      type(mortar_faces_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error
      integer :: f

      associate (sides => self%sides)
         call facets_init(sides%slave, scene, scene%surface(pair%slave), error)
         if (allocated(error)) return
         allocate(sides%master)
         call facets_init(sides%master, scene, scene%surface(pair%master), error)
         if (allocated(error)) return
         call facet_split_init(self%split, sides%slave)
         call facet_frames_init(sides%frames, sides%slave, self%split)
         call facet_weights_init(self%weights, sides%slave, self%split, scene%x)
         call patch_triangles_init(sides%triangles, sides%master, scene%x)
         allocate(sides%mirror(sides%master%n_facet), source=0)
         ! Lists end beside what a triangle sees: all that meets with that is listed.
         self%beyond = maxval([0.0_wp, (facets_length(sides%master, f), &
            f = 1, sides%master%n_facet)])
         call near_list_init(self%near, sides%slave%facet, sides%master%facet, scene%x, scene%u0, &
            self%beyond + pair%interaction%offset + interaction_reach(pair%interaction))
      end associate
      call list_vertices(self, scene%x)
      call find_directions(self, scene%x)
      allocate(self%stencil(size(self%split%facet)))
   end subroutine mortar_faces_init

   !> One for each smooth group of slave facets at a vertex.
   pure subroutine list_vertices(self, x)
      type(mortar_faces_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :)            !! (3, n_node) reference positions [L]
      type(facet_groups_t) :: groups
      integer :: f, g, i, k, m, t

      associate (slave => self%sides%slave)
         call facet_groups_init(groups, slave, x, group_angle)
         allocate(self%node(0), self%triangle(0), self%vertex(0))
         self%start = [1]
         do i = 1, size(slave%node)
            do g = groups%node_start(i), groups%node_start(i + 1) - 1
               do k = groups%start(g), groups%start(g + 1) - 1
                  f = groups%facet(k)
                  m = findloc(self%weights%node(:self%weights%n(f), f), i, 1)
                  if (m == 0) exit               ! between vertices
                  associate (part => [(t, t = self%split%start(f), self%split%start(f + 1) - 1)])
                     self%triangle = [self%triangle, part]
                     self%vertex = [self%vertex, spread(m, 1, size(part))]
                  end associate
               end do
               if (size(self%triangle) < self%start(size(self%start))) cycle
               self%node = [self%node, slave%node(i)]
               self%start = [self%start, size(self%triangle) + 1]
            end do
         end do
      end associate
   end subroutine list_vertices

   !> A direction at each vertex: the first axis in the reference, as near as it can be along the
   !> surface; where that is normal, another one.
   pure subroutine find_directions(self, x)
      type(mortar_faces_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :)            !! (3, n_node) reference positions [L]
      real(wp) :: side(3, 2), basis(3, 2), square(2, 2), part(2)
      integer :: i

      allocate(self%along(2, size(self%node)), source=0.0_wp)
      do i = 1, size(self%node)
         call find_sides(self, i, x, 0.0_wp*x, side)
         associate (normal => cross_product(side(:, 1), side(:, 2)))
            if (.not. norm2(normal) > 0.0_wp) cycle
            basis = tangent_basis(normal, [1.0_wp, 0.0_wp, 0.0_wp])
         end associate
         square = matmul(transpose(side), side)
         part = matmul(basis(:, 1), side)
         self%along(:, i) = [square(2, 2)*part(1) - square(1, 2)*part(2), &
            square(1, 1)*part(2) - square(1, 2)*part(1)]/(square(1, 1)*square(2, 2) &
            - square(1, 2)**2)
      end do
   end subroutine find_directions

   !> Both sides of the first facet of constraint `i` at its vertex.
   pure subroutine find_sides(self, i, x, u, side)
      type(mortar_faces_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp), intent(out) :: side(3, 2)        !! to the next vertex and to the one before [L]
      integer :: j, to(2)

      associate (f => self%split%facet(self%triangle(self%start(i))), &
            m => self%vertex(self%start(i)))
         associate (n => self%weights%n(f), own => self%sides%slave%node)
            to = own(self%weights%node([1 + mod(m, n), 1 + mod(m + n - 2, n)], f))
            associate (from => own(self%weights%node(m, f)))
               do j = 1, 2
                  side(:, j) = (x(:, to(j)) - x(:, from)) + (u(:, to(j)) - u(:, from))
               end do
            end associate
         end associate
      end associate
   end subroutine find_sides

   !> The direction along the surface at constraint `i` at x + u, of any length: it turns with that.
   pure function mortar_faces_direction(self, i, x, u) result(along)
      type(mortar_faces_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp) :: along(3)
      real(wp) :: side(3, 2)

      call find_sides(self, i, x, u, side)
      along = matmul(side, self%along(:, i))
   end function mortar_faces_direction

   !> The stencils of the triangles of slave facet `f`; none of them where nothing comes near.
   pure subroutine mortar_faces_choose(self, f, x, u0, reach)
      type(mortar_faces_t), intent(inout) :: self
      integer, intent(in) :: f                   !! 1..n_facet of the slave
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: reach              !! what is farther is not seen [L]
      integer :: k, t

      self%stencil(self%split%start(f):self%split%start(f + 1) - 1)%triangle = 0
      associate (list => self%near%candidates)
         associate (of => list%facet(list%start(f):list%start(f + 1) - 1))
            associate (is_near => [(near_list_within(self%near, f, of(k), reach), k = 1, &
                  size(of))], is_beside => [(.not. near_list_within(self%near, f, of(k), &
                  reach - self%beyond), k = 1, size(of))])
               if (all(is_beside)) return
               do t = self%split%start(f), self%split%start(f + 1) - 1
                  call patch_stencil_choose(self%stencil(t), self%sides, t, pack(of, is_near), x, &
                     u0, pack(is_beside, is_near))
               end do
            end associate
         end associate
      end associate
   end subroutine mortar_faces_choose

   !> The multiplier of place `k` of `triangle` at the corners of that: the dual one if theta is 1,
   !> the linear one if it is 0.
   pure function mortar_faces_weight(self, k, theta) result(weight)
      type(mortar_faces_t), intent(in) :: self
      integer, intent(in) :: k                   !! as `start` has it
      real(wp), intent(in) :: theta              !! 0 to 1
      real(wp) :: weight(3)

      associate (t => self%triangle(k), m => self%vertex(k))
         weight = self%weights%linear(:, m, t) + theta*self%weights%skew(:, m, t)
      end associate
   end function mortar_faces_weight

end module emcon_mortar_faces_space
