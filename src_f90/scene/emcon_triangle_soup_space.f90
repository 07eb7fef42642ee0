!> Triangles by their corners alone, made a surface: corners in one place become one point,
!> triangles without area are left out, and those that face the other way than their neighbours
!> are turned.
module emcon_triangle_soup_space
   use emcon_face_sides_space, only : face_fault, face_sides, last_of_side, side_t
   use emcon_kinds, only : dp, wp
   use emcon_rotation, only : cross_product
   use emcon_sort, only : sort_order, unique_sorted
   implicit none
   private
   public :: soup_t, soup_join, finding_t

   integer, parameter :: n_dim = 3, n_corner = 3
   !> Corners nearer than this part of the largest coordinate are one: files hold about seven
   !> digits.
   real(wp), parameter :: nearest_part = 1.0e-6_wp
   !> A direction in which corners of boxes and grids stand one behind the other.
   real(wp), parameter :: askew(n_dim) = [0.5377_wp, 0.6181_wp, 0.5735_wp]

   !> How often something is so, and the first triangle where it is.
   type :: finding_t
      integer :: n = 0
      integer :: first = 0                       !! 1 to n
   end type finding_t

   type :: soup_t
      real(wp), allocatable :: point(:, :)       !! (3, n_point) [L]
      integer, allocatable :: facet(:, :)        !! (3, n_facet) points, seen from outside
      type(finding_t) :: flat                    !! triangles that have no area
      type(finding_t) :: turned                  !! that were turned over
      type(finding_t) :: open                    !! sides of one triangle alone
      type(finding_t) :: branch                  !! sides where more than two meet
      logical :: is_inward = .false.             !! it is closed, and faces what it encloses
      type(finding_t) :: twisted                 !! sides about which no turning helps
   end type soup_t

contains

   !> Join triangles. What branches or is twisted is no surface.
   pure subroutine soup_join(self, corner)
      type(soup_t), intent(out) :: self
      real(wp), intent(in) :: corner(:, :, :)    !! (3, corner, n) [L]
      integer, allocatable :: number(:), kept(:), beyond(:, :)
      logical, allocatable :: is_flat(:)
      logical :: is_folded
      integer :: f, n

      n = size(corner, 3)
      call weld(reshape(corner, [n_dim, n_corner*n]), self%point, number)
      self%facet = reshape(number, [n_corner, n])
      allocate(is_flat(n))
      do f = 1, n
         call face_fault(self%point(:, self%facet(:, f)), is_flat(f), is_folded)
         if (is_flat(f)) call add(self%flat, f)
      end do
      kept = pack([(f, f = 1, n)], .not. is_flat)
      self%facet = self%facet(:, kept)
      if (size(kept) == 0) return
      call drop_points(self)
      call find_neighbours(self, kept, beyond)
      if (self%branch%n > 0) return
      call turn(self, kept, beyond)
      self%is_inward = self%open%n == 0 .and. enclosed(self) < 0.0_wp
   end subroutine soup_join

   !> The volume that triangles enclose if they face outwards, times a number above 0.
   pure real(wp) function enclosed(self) result(volume)
      type(soup_t), intent(in) :: self
      real(wp) :: x(n_dim, n_corner)
      integer :: f, k

      associate (middle => sum(self%point, 2)/real(size(self%point, 2), wp), &
            power => -exponent(maxval(abs(self%point))))
         volume = 0.0_wp
         do f = 1, size(self%facet, 2)
            do k = 1, n_corner
               x(:, k) = scale(self%point(:, self%facet(k, f)) - middle, power)
            end do
            volume = volume + dot_product(x(:, 1), cross_product(x(:, 2), x(:, 3)))
         end do
      end associate
   end function enclosed

   !> One more that is so at triangle `f`; the lowest one is told.
   pure subroutine add(finding, f)
      type(finding_t), intent(inout) :: finding
      integer, intent(in) :: f

      if (finding%n == 0 .or. f < finding%first) finding%first = f
      finding%n = finding%n + 1
   end subroutine add

   !> Points for corners, the first one of those that are in one place.
   pure subroutine weld(corner, point, number)
      real(wp), intent(in) :: corner(:, :)       !! (3, n) [L]
      real(wp), allocatable, intent(out) :: point(:, :)      !! (3, n_point) [L]
      integer, allocatable, intent(out) :: number(:)         !! (n) of its point
      real(wp), allocatable :: along(:)
      integer, allocatable :: order(:), like(:)
      real(wp) :: reach
      integer :: i, k, n

      reach = nearest_part*maxval(abs(corner))
      along = matmul(askew, corner)
      order = sort_order(real(along, dp))
      allocate(like(size(order)))
      do i = 1, size(order)
         like(order(i)) = order(i)
         do k = i - 1, 1, -1
            ! Along a direction of length 1 nothing is farther than in space.
            if (along(order(i)) - along(order(k)) > reach) exit
            if (norm2(corner(:, order(k)) - corner(:, order(i))) > reach) cycle
            like(order(i)) = like(order(k))
            exit
         end do
      end do
      allocate(number(size(like)), source=0)
      allocate(point(n_dim, size(like)))
      n = 0
      do i = 1, size(like)
         if (number(like(i)) == 0) then
            n = n + 1
            point(:, n) = corner(:, like(i))
            number(like(i)) = n
         end if
         number(i) = number(like(i))
      end do
      point = point(:, :n)
   end subroutine weld

   !> Leave out points that no triangle has.
   pure subroutine drop_points(self)
      type(soup_t), intent(inout) :: self
      integer, allocatable :: used(:), number(:)
      integer :: f, i

      allocate(used, source=unique_sorted(reshape(self%facet, [size(self%facet)])))
      allocate(number(size(self%point, 2)), source=0)
      number(used) = [(i, i = 1, size(used))]
      self%point = self%point(:, used)
      do f = 1, size(self%facet, 2)
         self%facet(:, f) = number(self%facet(:, f))
      end do
   end subroutine drop_points

   !> What is beyond the sides of triangles, in any order; with a minus what faces the other way.
   pure subroutine find_neighbours(self, kept, beyond)
      type(soup_t), intent(inout) :: self
      integer, intent(in) :: kept(:)             !! (n_facet) its number among the given ones
      integer, allocatable, intent(out) :: beyond(:, :)      !! (3, n_facet) 0: no more
      type(side_t), allocatable :: side(:)
      integer :: first, last, way

      allocate(beyond(n_corner, size(kept)), source=0)
      call face_sides(self%facet, side)
      first = 1
      do while (first <= size(side))
         last = last_of_side(side, first)
         associate (f => side(first)%facet, g => side(last)%facet)
            select case (last - first)
            case (0)
               call add(self%open, kept(f))
            case (1)
               way = merge(-1, 1, side(first)%is_up .eqv. side(last)%is_up)
               call put(beyond(:, f), way*g)
               call put(beyond(:, g), way*f)
            case default
               call add(self%branch, kept(f))
            end select
         end associate
         first = last + 1
      end do
   end subroutine find_neighbours

   !> Into the first free place.
   pure subroutine put(list, value)
      integer, intent(inout) :: list(:)
      integer, intent(in) :: value

      list(findloc(list, 0, 1)) = value
   end subroutine put

   !> In what hangs together, turn those that face another way than most.
   pure subroutine turn(self, kept, beyond)
      type(soup_t), intent(inout) :: self
      integer, intent(in) :: kept(:)             !! (n_facet) its number among the given ones
      integer, intent(in) :: beyond(:, :)        !! (3, n_facet) as above
      integer, allocatable :: way(:), part(:)
      integer :: i, f, g, j, k, n, to

      allocate(way(size(kept)), part(size(kept)))
      way = 0                                    ! as the first of its part faces: 1; else -1
      do i = 1, size(way)
         if (way(i) /= 0) cycle
         way(i) = 1
         part(1) = i
         n = 1
         k = 0
         do while (k < n)
            k = k + 1
            f = part(k)
            do j = 1, n_corner
               g = abs(beyond(j, f))
               if (g == 0) cycle
               to = sign(1, beyond(j, f))*way(f)
               if (way(g) == 0) then
                  way(g) = to
                  n = n + 1
                  part(n) = g
               else if (way(g) /= to) then
                  call add(self%twisted, kept(max(f, g)))
               end if
            end do
         end do
         associate (all => part(:n))
            if (2*count(way(all) < 0) > n) way(all) = -way(all)
         end associate
      end do
      do f = 1, size(way)
         if (way(f) > 0) cycle
         call add(self%turned, kept(f))
         self%facet(2:, f) = self%facet([3, 2], f)
      end do
   end subroutine turn

end module emcon_triangle_soup_space
