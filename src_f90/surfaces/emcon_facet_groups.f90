!> Smooth groups of the facets around each node of a surface in space, and what bounds them: ridges,
!> where a body is sharp, and free sides.
!>
!> Facets that meet in a side are of one group at its ends if they turn there by no more than an
!> angle in the reference configuration. Points are numbered as `node` of the facets.
module emcon_facet_groups
   use emcon_facets, only : facets_normal, facets_t
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   use emcon_sort, only : find_sorted, unique_sorted
   implicit none
   private
   public :: facet_groups_t, ridges_t, facet_groups_init, ridges_find, find_turns, group_angle, &
      ridge_angle

   !> Up to this turn facets are smooth, and beyond it a side is a ridge [degrees].
   real(wp), parameter :: group_angle = 60.0_wp, ridge_angle = 20.0_wp
   !> What a turn has to exceed an angle by [degrees]: far above the rounding of coordinates.
   real(wp), parameter, public :: turn_tol = 1.0e-3_wp
   integer, parameter :: n_end = 2               !! of a side
   real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp

   type :: facet_groups_t
      integer :: n_group = 0
      !> (n_node + 1) groups of node i: node_start(i):node_start(i + 1) - 1, by their lowest facet
      integer, allocatable :: node_start(:)
      !> (n_group + 1) facets of group g: facet(start(g):start(g + 1) - 1), ascending
      integer, allocatable :: start(:)
      integer, allocatable :: facet(:)
      !> (n_group + 1) other nodes of these facets: ring(ring_start(g):ring_start(g + 1) - 1)
      integer, allocatable :: ring_start(:)
      integer, allocatable :: ring(:)            !! points, each once, ascending
   end type facet_groups_t

   !> Sides that are sharp outwards, each once, and those with nothing beyond.
   type :: ridges_t
      integer, allocatable :: point(:, :)        !! (2, n_ridge) from, to, as `facet` runs
      integer, allocatable :: facet(:, :)        !! (2, n_ridge) facet < the one beyond
      integer, allocatable :: free_point(:, :)   !! (2, n_free) from, to, as the facet runs
      integer, allocatable :: free_facet(:)      !! (n_free)
   end type ridges_t

contains

   !> The groups at all nodes of a surface; a node without facets has none.
   pure subroutine facet_groups_init(self, facets, x, angle)
      type(facet_groups_t), intent(out) :: self
      type(facets_t), intent(in) :: facets       !! in space
      real(wp), intent(in) :: x(:, :)            !! (3, n_node of the scene) reference [L]
      real(wp), intent(in) :: angle              !! [degrees], 0 to 180
      real(wp), allocatable :: turn(:, :)
      logical, allocatable :: is_smooth(:, :)
      integer, allocatable :: of_group(:), ring(:)
      integer :: i, k, n, n_group, n_around

      call find_turns(facets, x, turn)
      is_smooth = abs(turn) <= angle + turn_tol
      n_around = size(facets%around)
      allocate(self%node_start(size(facets%node) + 1), self%facet(n_around))
      allocate(self%start(n_around + 1), self%ring_start(n_around + 1))
      allocate(self%ring(n_around*(size(facets%facet, 1) - 1)))
      self%node_start(1) = 1
      self%start(1) = 1
      self%ring_start(1) = 1
      do i = 1, size(facets%node)
         associate (around => facets%around(facets%around_start(i):facets%around_start(i + 1) - 1))
            call join_facets(facets, i, around, is_smooth, of_group, n_group)
            do k = 1, n_group
               self%n_group = self%n_group + 1
               associate (own => pack(around, of_group == k), first => self%start(self%n_group))
                  self%facet(first:first + size(own) - 1) = own
                  self%start(self%n_group + 1) = first + size(own)
                  call find_ring(facets, i, own, ring)
               end associate
               n = self%ring_start(self%n_group)
               self%ring(n:n + size(ring) - 1) = ring
               self%ring_start(self%n_group + 1) = n + size(ring)
            end do
         end associate
         self%node_start(i + 1) = self%n_group + 1
      end do
      self%start = self%start(:self%n_group + 1)
      self%ring_start = self%ring_start(:self%n_group + 1)
      self%ring = self%ring(:self%ring_start(self%n_group + 1) - 1)
   end subroutine facet_groups_init

   !> Number the smooth groups of the facets around node `i`.
   pure subroutine join_facets(facets, i, around, is_smooth, of_group, n_group)
      type(facets_t), intent(in) :: facets
      integer, intent(in) :: i, around(:)
      logical, intent(in) :: is_smooth(:, :)     !! of sides
      integer, allocatable, intent(out) :: of_group(:)
      integer, intent(out) :: n_group
      integer :: waiting(size(around)), first, k, n, other

      allocate(of_group(size(around)), source=0)
      n_group = 0
      do first = 1, size(around)
         if (of_group(first) > 0) cycle
         n_group = n_group + 1
         of_group(first) = n_group
         n = 1
         waiting(1) = first
         do while (n > 0)
            associate (f => around(waiting(n)))
               n = n - 1
               do k = 1, count(facets%facet(:, f) > 0)
                  if (.not. is_smooth(k, f)) cycle
                  if (all(side_of(facets, f, k) /= i)) cycle
                  other = find_sorted(around, facets%neighbour(k, f))
                  if (of_group(other) > 0) cycle
                  of_group(other) = n_group
                  n = n + 1
                  waiting(n) = other
               end do
            end associate
         end do
      end do
   end subroutine join_facets

   !> The other nodes of facets at node `i`.
   pure subroutine find_ring(facets, i, facet, ring)
      type(facets_t), intent(in) :: facets
      integer, intent(in) :: i, facet(:)
      integer, allocatable, intent(out) :: ring(:)
      integer :: k

      ring = pack([(point_of(facets, facet(k)), k = 1, size(facet))], .true.)
      ring = unique_sorted(pack(ring, ring > 0 .and. ring /= i))
   end subroutine find_ring

   !> All points of facet `f`, 0 behind the last one.
   pure function point_of(facets, f) result(point)
      type(facets_t), intent(in) :: facets
      integer, intent(in) :: f
      integer :: point(size(facets%facet, 1))

      point = facets%corner(:, f)
   end function point_of

   !> The points at the ends of side `k` of facet `f`, as it runs.
   pure function side_of(facets, f, k) result(side)
      type(facets_t), intent(in) :: facets
      integer, intent(in) :: f, k
      integer :: side(n_end)

      associate (point => point_of(facets, f))
         side = point([k, 1 + mod(k, count(point > 0))])
      end associate
   end function side_of

   !> The ridges of a surface: sides beyond which it turns by more than `angle`, the body inside.
   pure subroutine ridges_find(self, facets, x, angle)
      type(ridges_t), intent(out) :: self
      type(facets_t), intent(in) :: facets       !! in space
      real(wp), intent(in) :: x(:, :)            !! (3, n_node of the scene) reference [L]
      real(wp), intent(in) :: angle              !! [degrees], 0 to 180
      real(wp), allocatable :: turn(:, :)
      integer :: f, k, n_ridge, n_free, pass

      call find_turns(facets, x, turn)
      do pass = 1, 2
         n_ridge = 0
         n_free = 0
         do f = 1, facets%n_facet
            do k = 1, count(facets%facet(:, f) > 0)
               associate (beyond => facets%neighbour(k, f))
                  if (beyond == 0) then
                     n_free = n_free + 1
                     if (pass == 1) cycle
                     self%free_point(:, n_free) = side_of(facets, f, k)
                     self%free_facet(n_free) = f
                  else if (f < beyond .and. turn(k, f) > angle + turn_tol) then
                     n_ridge = n_ridge + 1
                     if (pass == 1) cycle
                     self%point(:, n_ridge) = side_of(facets, f, k)
                     self%facet(:, n_ridge) = [f, beyond]
                  end if
               end associate
            end do
         end do
         if (pass == 1) allocate(self%point(n_end, n_ridge), self%facet(n_end, n_ridge), &
            self%free_point(n_end, n_free), self%free_facet(n_free))
      end do
   end subroutine ridges_find

   !> How far the surface turns beyond each side [degrees], > 0 where it is convex; huge where
   !> nothing is beyond.
   pure subroutine find_turns(facets, x, turn)
      type(facets_t), intent(in) :: facets
      real(wp), intent(in) :: x(:, :)            !! (3, n_node of the scene) reference [L]
      real(wp), allocatable, intent(out) :: turn(:, :)     !! (most nodes, n_facet)
      real(wp), allocatable :: normal(:, :), still(:, :)
      real(wp), dimension(3) :: sine, way
      integer :: f, k

      allocate(turn(size(facets%facet, 1), facets%n_facet), source=huge(1.0_wp))
      allocate(normal(3, facets%n_facet))
      allocate(still, mold=x)
      still = 0.0_wp
      do f = 1, facets%n_facet
         normal(:, f) = facets_normal(facets, f, x, still)
      end do
      do f = 1, facets%n_facet
         do k = 1, count(facets%facet(:, f) > 0)
            associate (beyond => facets%neighbour(k, f))
               if (beyond == 0) cycle
               associate (a => normal(:, f), b => normal(:, beyond), side => side_of(facets, f, k))
                  sine = cross_product(a, b)
                  way = x(:, facets%node(side(n_end))) - x(:, facets%node(side(1)))
                  turn(k, f) = sign(atan2(sqrt(dot_product(sine, sine)), dot_product(a, b)), &
                     dot_product(sine, way))/degree
               end associate
            end associate
         end do
      end do
   end subroutine find_turns

end module emcon_facet_groups
