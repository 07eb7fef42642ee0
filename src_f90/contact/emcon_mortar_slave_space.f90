!> The slave's side of mortar contact in space: triangles of its facets, and the multipliers of
!> their vertices. Source: docs/theory.md, section 14.2.
module emcon_mortar_slave_space
   use emcon_facet_frames_space, only : facet_weights_init, facet_weights_t
   use emcon_facet_groups, only : facet_groups_init, facet_groups_t, group_angle
   use emcon_facet_split, only : facet_split_init, facet_split_t
   use emcon_facets, only : facets_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: mortar_slave_t, mortar_slave_init, mortar_slave_weight, mortar_slave_side

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

   !> A side of the slave at constraint `i`, at x + u: of its first facet, to the next vertex [L].
   pure function mortar_slave_side(self, own, i, x, u) result(side)
      class(mortar_slave_t), intent(in) :: self
      integer, intent(in) :: own(:)              !! nodes of the slave
      integer, intent(in) :: i                   !! 1..n
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp) :: side(3)
      integer :: ends(2)

      associate (f => self%split%facet(self%triangle(self%start(i))), &
            m => self%vertex(self%start(i)))
         ends = own(self%weights%node([m, 1 + mod(m, self%weights%n(f))], f))
      end associate
      side = (x(:, ends(2)) - x(:, ends(1))) + (u(:, ends(2)) - u(:, ends(1)))
   end function mortar_slave_side

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
