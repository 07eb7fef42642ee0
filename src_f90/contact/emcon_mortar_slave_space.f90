!> The slave's side of mortar contact in space: triangles of its facets, and the multipliers of
!> their vertices. Source: docs/theory.md, section 14.2.
module emcon_mortar_slave_space
   use emcon_facet_frames_space, only : facet_weights_init, facet_weights_t
   use emcon_facet_groups, only : facet_groups_init, facet_groups_t, group_angle
   use emcon_facet_split, only : facet_split_init, facet_split_t
   use emcon_facets, only : facets_t
   use emcon_frame_slip_space, only : tangent_basis
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   implicit none
   private
   public :: mortar_slave_t, mortar_slave_init, mortar_slave_weight, mortar_slave_direction

   type :: mortar_slave_t
      type(facet_split_t) :: split
      type(facet_weights_t) :: weights
      logical :: is_dual = .true.                     !! multiplier basis
      integer, allocatable :: node(:)                 !! (n) of each constraint
      integer, allocatable :: start(:)                !! (n + 1) triangles of each:
      integer, allocatable :: triangle(:)             !! start(i) to start(i + 1) - 1
      integer, allocatable :: vertex(:)               !! the same: which vertex of its facet it is
      integer, allocatable :: owner(:, :)             !! (vertex, facet) its constraint; 0: none,
      integer, allocatable :: entry(:, :)             !! and where that has the facet's triangles
      !> (2, n) a direction along the surface at each, in the sides of its first facet at its vertex
      real(wp), allocatable :: along(:, :)
   end type mortar_slave_t

contains

   !> Set up for the facets of a slave.
   subroutine mortar_slave_init(self, facets, x)
      class(mortar_slave_t), intent(inout) :: self
      type(facets_t), intent(in) :: facets       !! in space
      real(wp), intent(in) :: x(:, :)            !! (3, n_node of the scene) reference [L]

      call facet_split_init(self%split, facets)
      call facet_weights_init(self%weights, facets, self%split, x)
      call list_vertices(self, facets, x)
      call list_owners(self)
      call find_directions(self, facets%node, x)
   end subroutine mortar_slave_init

   !> One for each smooth group of slave facets at a vertex.
   pure subroutine list_vertices(self, slave, x)
      class(mortar_slave_t), intent(inout) :: self
      type(facets_t), intent(in) :: slave        !! in space
      real(wp), intent(in) :: x(:, :)            !! (3, n_node) reference positions [L]
      type(facet_groups_t) :: groups
      integer :: f, g, i, k, m, t

      call facet_groups_init(groups, slave, x, group_angle)
      allocate(self%node(0), self%triangle(0), self%vertex(0))
      self%start = [1]
      do i = 1, size(slave%node)
         do g = groups%node_start(i), groups%node_start(i + 1) - 1
            do k = groups%start(g), groups%start(g + 1) - 1
               f = groups%facet(k)
               m = findloc(self%weights%node(:self%weights%n(f), f), i, 1)
               if (m == 0) exit                  ! between vertices
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
   end subroutine list_vertices

   !> The constraints of each facet.
   pure subroutine list_owners(self)
      class(mortar_slave_t), intent(inout) :: self
      integer :: f, i, k

      allocate(self%owner, self%entry, mold=self%weights%node)
      self%owner = 0
      self%entry = 0
      do i = 1, size(self%node)
         do k = self%start(i), self%start(i + 1) - 1
            f = self%split%facet(self%triangle(k))
            if (self%triangle(k) /= self%split%start(f)) cycle
            self%owner(self%vertex(k), f) = i
            self%entry(self%vertex(k), f) = k
         end do
      end do
   end subroutine list_owners

   !> A direction at each vertex: the first axis in the reference, as near as it can be along the
   !> surface; where that is normal, another one.
   pure subroutine find_directions(self, own, x)
      class(mortar_slave_t), intent(inout) :: self
      integer, intent(in) :: own(:)              !! nodes of the slave
      real(wp), intent(in) :: x(:, :)            !! (3, n_node) reference positions [L]
      real(wp) :: side(3, 2), basis(3, 2), square(2, 2), part(2)
      integer :: i

      allocate(self%along(2, size(self%node)), source=0.0_wp)
      do i = 1, size(self%node)
         call find_sides(self, own, i, x, 0.0_wp*x, side)
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
   pure subroutine find_sides(self, own, i, x, u, side)
      class(mortar_slave_t), intent(in) :: self
      integer, intent(in) :: own(:)              !! nodes of the slave
      integer, intent(in) :: i
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp), intent(out) :: side(3, 2)        !! to the next vertex and to the one before [L]
      integer :: j, to(2)

      associate (f => self%split%facet(self%triangle(self%start(i))), &
            m => self%vertex(self%start(i)))
         associate (n => self%weights%n(f))
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
   pure function mortar_slave_direction(self, own, i, x, u) result(along)
      class(mortar_slave_t), intent(in) :: self
      integer, intent(in) :: own(:)              !! nodes of the slave
      integer, intent(in) :: i                   !! 1..n
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp) :: along(3)
      real(wp) :: side(3, 2)

      call find_sides(self, own, i, x, u, side)
      along = matmul(side, self%along(:, i))
   end function mortar_slave_direction

   !> The multiplier of place `k` of `triangle` at the corners of that: the dual one if theta is 1,
   !> the linear one if it is 0.
   pure function mortar_slave_weight(self, k, theta) result(weight)
      class(mortar_slave_t), intent(in) :: self
      integer, intent(in) :: k                   !! as `start` has it
      real(wp), intent(in) :: theta              !! 0 to 1
      real(wp) :: weight(3)

      associate (t => self%triangle(k), m => self%vertex(k))
         weight = self%weights%linear(:, m, t) + theta*self%weights%skew(:, m, t)
      end associate
   end function mortar_slave_weight

end module emcon_mortar_slave_space
