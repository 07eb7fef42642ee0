!> How far points are from a surface in space, and on which side of it they are.
!>
!> The surface is the triangles of its split facets. The nearest place of it is within a triangle,
!> on a side or in a vertex; there the sum of the unit normals around, in a vertex weighted by the
!> angles of the triangles, tells the side: also where the nearest triangle alone would not.
module emcon_signed_distance_space
   use emcon_box_tree, only : box_tree_guess, box_tree_init, box_tree_next, box_tree_t, leaf_size
   use emcon_facet_split, only : facet_split_init, facet_split_place, facet_split_t
   use emcon_facets, only : facets_t
   use emcon_kinds, only : dp, wp
   use emcon_rotation, only : cross_product
   use emcon_sort, only : sort_order
   implicit none
   private
   public :: signed_distance_t, signed_foot_t, signed_distance_init, signed_distance_find, &
      signed_distance_reaches, signed_distance_to

   integer, parameter :: n_dim = 3, n_side = 3

   !> Where the nearest place of a surface is, seen from a point.
   type :: signed_foot_t
      integer :: simplex = 0                     !! triangle; 0: the surface has none
      integer :: facet = 0                       !! that it is a part of
      real(wp) :: distance = huge(1.0_wp)        !! < 0: behind the surface [L]
      real(wp) :: way(n_dim) = 0.0_wp            !! outwards, from the foot to a point in front
      real(wp) :: past = 0.0_wp                  !! how far beyond a free side, along it [L]
   end type signed_foot_t

   type :: signed_distance_t
      type(facet_split_t) :: split
      type(box_tree_t), private :: tree
      real(wp), allocatable, private :: at(:, :)             !! (3, n_point) [L]
      real(wp), allocatable, private :: normal(:, :)         !! (3, n_simplex) unit
      real(wp), allocatable, private :: point_normal(:, :)   !! (3, n_point) sums
      real(wp), allocatable, private :: side_normal(:, :)    !! (3, sides) sums
      integer, allocatable, private :: side(:, :)            !! (3, n_simplex) number of each side
      logical, allocatable, private :: is_free_side(:), is_free_point(:)
      real(wp), private :: low(n_dim), high(n_dim)           !! of all [L]
   end type signed_distance_t

contains

   !> The surface of `facets` at x + u.
   pure subroutine signed_distance_init(self, facets, x, u)
      type(signed_distance_t), intent(out) :: self
      type(facets_t), intent(in) :: facets       !! in space
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node of the scene) [L]
      real(wp), allocatable :: low(:, :), high(:, :)
      integer :: k

      call facet_split_init(self%split, facets)
      allocate(self%at(n_dim, self%split%n_point))
      call facet_split_place(self%split, facets, x, u, self%at)
      associate (triangle => self%split%corner, n => size(self%split%facet))
         allocate(low(n_dim, n), high(n_dim, n), self%normal(n_dim, n))
         do k = 1, n
            low(:, k) = minval(self%at(:, triangle(:, k)), 2)
            high(:, k) = maxval(self%at(:, triangle(:, k)), 2)
            associate (a => self%at(:, triangle(1, k)))
               self%normal(:, k) = unit(cross_product(self%at(:, triangle(n_side - 1, k)) - a, &
                  self%at(:, triangle(n_side, k)) - a))
            end associate
         end do
         self%low = minval(low, n_dim - 1)
         self%high = maxval(high, n_dim - 1)
         call box_tree_init(self%tree, low, high)
         call number_sides(triangle, self%side)
      end associate
      call sum_normals(self)
   end subroutine signed_distance_init

   !> Number the sides of triangles: side j goes from vertex j to the next one.
   pure subroutine number_sides(triangle, side)
      integer, intent(in) :: triangle(:, :)      !! (3, n)
      integer, allocatable, intent(out) :: side(:, :)        !! (3, n)
      real(dp) :: key(size(triangle))
      integer :: order(size(triangle)), number(size(triangle)), i, n

      associate (next => cshift(triangle, 1, 1))
         key = reshape(real(min(triangle, next), dp)*real(maxval([0, triangle]) + 1, dp) + &
            real(max(triangle, next), dp), [size(key)])
      end associate
      order = sort_order(key)
      n = 0
      do i = 1, size(order)
         if (i == 1) then
            n = 1
         else if (key(order(i)) > key(order(i - 1))) then
            n = n + 1
         end if
         number(order(i)) = n
      end do
      side = reshape(number, shape(triangle))
   end subroutine number_sides

   !> The normals of sides and points, and which of these have no surface beyond.
   pure subroutine sum_normals(self)
      type(signed_distance_t), intent(inout) :: self
      integer, allocatable :: n_use(:)
      integer :: k, j

      allocate(n_use(maxval([0, self%side])), source=0)
      allocate(self%side_normal(n_dim, size(n_use)), source=0.0_wp)
      allocate(self%point_normal(n_dim, self%split%n_point), source=0.0_wp)
      allocate(self%is_free_point(self%split%n_point), source=.false.)
      do k = 1, size(self%normal, n_dim - 1)
         do j = 1, n_side
            associate (side => self%side(j, k), here => vertex_of(self, k, j))
               n_use(side) = n_use(side) + 1
               self%side_normal(:, side) = self%side_normal(:, side) + self%normal(:, k)
               self%point_normal(:, here) = self%point_normal(:, here) + angle(self, k, j) &
                  *self%normal(:, k)
            end associate
         end do
      end do
      self%is_free_side = n_use == 1
      do k = 1, size(self%normal, n_dim - 1)
         do j = 1, n_side
            if (self%is_free_side(self%side(j, k))) self%is_free_point([vertex_of(self, k, j), &
               vertex_of(self, k, j + 1)]) = .true.
         end do
      end do
   end subroutine sum_normals

   !> Point at vertex `j` of triangle `k`; behind the last one the first follows.
   pure integer function vertex_of(self, k, j)
      type(signed_distance_t), intent(in) :: self
      integer, intent(in) :: k, j

      vertex_of = self%split%corner(1 + mod(j - 1, n_side), k)
   end function vertex_of

   !> The angle of triangle `k` at its vertex `j`.
   pure real(wp) function angle(self, k, j)
      type(signed_distance_t), intent(in) :: self
      integer, intent(in) :: k, j
      real(wp), dimension(n_dim) :: a, b, c

      associate (here => self%at(:, vertex_of(self, k, j)))
         a = self%at(:, vertex_of(self, k, j + 1)) - here
         b = self%at(:, vertex_of(self, k, j + n_side - 1)) - here
      end associate
      c = cross_product(a, b)
      angle = atan2(length(c), dot_product(a, b))
   end function angle

   !> The nearest place of the surface, searched among all, or among those nearer than `within`.
   pure subroutine signed_distance_find(self, point, foot, within)
      type(signed_distance_t), intent(in) :: self
      real(wp), intent(in) :: point(:)           !! (3) [L]
      type(signed_foot_t), intent(out) :: foot
      real(wp), intent(in), optional :: within   !! > 0 [L]
      integer, allocatable :: guess(:)
      integer :: found(leaf_size), i, k, n

      if (present(within)) foot%distance = within
      call box_tree_guess(self%tree, point, guess)
      do i = 1, size(guess)
         call take_nearer(self, guess(i), point, foot)
      end do
      k = 1
      do while (k > 0 .and. size(guess) > 0)
         call box_tree_next(self%tree, point, abs(foot%distance), k, found, n)
         do i = 1, n
            call take_nearer(self, found(i), point, foot)
         end do
      end do
   end subroutine signed_distance_find

   !> Is a point in the box around the whole surface?
   pure logical function signed_distance_reaches(self, point) result(reaches)
      type(signed_distance_t), intent(in) :: self
      real(wp), intent(in) :: point(:)           !! (3) [L]

      reaches = all(point >= self%low .and. point <= self%high)
   end function signed_distance_reaches

   !> The nearest place of triangle `k` alone.
   pure subroutine signed_distance_to(self, k, point, foot)
      type(signed_distance_t), intent(in) :: self
      integer, intent(in) :: k                   !! 1 to n_simplex of the split
      real(wp), intent(in) :: point(:)           !! (3) [L]
      type(signed_foot_t), intent(out) :: foot

      call take_nearer(self, k, point, foot)
   end subroutine signed_distance_to

   !> Make triangle `k` the nearest one if it is nearer than that of `foot`.
   pure subroutine take_nearer(self, k, point, foot)
      type(signed_distance_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: point(:)
      type(signed_foot_t), intent(inout) :: foot
      real(wp) :: way(n_dim), least
      integer :: best, j, end
      logical :: is_within

      is_within = .true.
      do j = 1, n_side
         is_within = is_within .and. dot_product(self%normal(:, k), cross_product( &
            self%at(:, vertex_of(self, k, j + 1)) - self%at(:, vertex_of(self, k, j)), &
            point - self%at(:, vertex_of(self, k, j)))) > 0.0_wp
      end do
      if (is_within) then
         associate (d => dot_product(self%normal(:, k), point - self%at(:, vertex_of(self, k, 1))))
            if (.not. abs(d) < abs(foot%distance)) return
            foot = signed_foot_t(k, self%split%facet(k), d, self%normal(:, k), 0.0_wp)
         end associate
         return
      end if
      least = abs(foot%distance)
      best = 0
      do j = 1, n_side
         call find_way(self, k, j, point, way, end)
         if (.not. length(way) < least) cycle
         best = j
         least = length(way)
      end do
      if (best > 0) call settle(self, k, best, point, foot)
   end subroutine take_nearer

   !> The foot on side `j` of triangle `k`, or at an end of it.
   pure subroutine settle(self, k, j, point, foot)
      type(signed_distance_t), intent(in) :: self
      integer, intent(in) :: k, j
      real(wp), intent(in) :: point(:)
      type(signed_foot_t), intent(out) :: foot
      real(wp) :: way(n_dim), outwards(n_dim), up
      logical :: is_free
      integer :: end

      call find_way(self, k, j, point, way, end)
      if (end > 0) then
         outwards = self%point_normal(:, vertex_of(self, k, end))
         is_free = self%is_free_point(vertex_of(self, k, end))
      else
         outwards = self%side_normal(:, self%side(j, k))
         is_free = self%is_free_side(self%side(j, k))
      end if
      foot%simplex = k
      foot%facet = self%split%facet(k)
      foot%distance = sign(length(way), dot_product(way, outwards))
      if (abs(foot%distance) > 0.0_wp) then
         foot%way = way/foot%distance
      else
         foot%way = unit(outwards)
      end if
      if (.not. is_free) return
      up = dot_product(way, self%normal(:, k))
      foot%past = length(way - up*self%normal(:, k))
   end subroutine settle

   !> The way to a point from the nearest place on side `j` of triangle `k`, and which of its
   !> vertices that is; 0: none.
   pure subroutine find_way(self, k, j, point, way, end)
      type(signed_distance_t), intent(in) :: self
      integer, intent(in) :: k, j
      real(wp), intent(in) :: point(:)
      real(wp), intent(out) :: way(:)
      integer, intent(out) :: end
      real(wp) :: along(n_dim), t

      associate (from => self%at(:, vertex_of(self, k, j)), &
            to => self%at(:, vertex_of(self, k, j + 1)))
         along = to - from
         t = dot_product(point - from, along)
         end = 0
         if (t <= 0.0_wp) then
            way = point - from
            end = j
         else if (t >= dot_product(along, along)) then
            way = point - to
            end = j + 1
         else
            way = (point - from) - (t/dot_product(along, along))*along
         end if
      end associate
   end subroutine find_way

   !> Not norm2: bits depend on the units.
   pure real(wp) function length(a)
      real(wp), intent(in) :: a(:)

      length = sqrt(dot_product(a, a))
   end function length

   !> a/|a|; 0 where there is no length.
   pure function unit(a)
      real(wp), intent(in) :: a(:)
      real(wp) :: unit(size(a))

      unit = a
      if (length(a) > 0.0_wp) unit = a/length(a)
   end function unit

end module emcon_signed_distance_space
