!> When one outline in space goes through another within a step, on straight ways: between which
!> instants points are behind facets, and edges beyond edges.
!>
!> A point and a triangle, or two edges, are in one plane where a volume vanishes: at roots of a
!> cubic. Source: docs/theory.md, section 4.15.
module emcon_passages_space
   use emcon_box_tree, only : box_tree_find, box_tree_init, box_tree_t
   use emcon_kinds, only : wp
   use emcon_triangles_space, only : cross_product, triangles_t
   implicit none
   private
   public :: way_t, passage_t, passages_find, cubic_roots

   !> So far beyond the sides of a triangle, by itself, a point meets it: it is not to pass between
   !> two neighbours. So far from its ends an edge meets others.
   real(wp), parameter :: beside = 1.0e-6_wp
   !> Roundings of a volume, of differences of positions.
   real(wp), parameter :: n_rounding = 64.0_wp
   !> Halvings of an interval of the step that holds a root.
   integer, parameter :: n_halving = 40
   integer, parameter :: most_events = 64

   !> Where the points of an outline are in a step: start + t rate, t from 0 to 1.
   type :: way_t
      real(wp), allocatable :: start(:, :)       !! (3, n_point) [L]
      real(wp), allocatable :: rate(:, :)        !! (3, n_point) [L]
   end type way_t

   !> Something is on the other side from one instant to another.
   type :: passage_t
      real(wp) :: from = 0.0_wp, to = 0.0_wp     !! shares of the step
      real(wp) :: path = 0.0_wp                  !! against what it passes, in between [L]
   end type passage_t

   !> Instants at which a point or an edge meets something.
   type :: events_t
      integer :: n = 0
      real(wp) :: time(most_events) = 0.0_wp
      real(wp) :: speed(most_events) = 0.0_wp    !! against what is met [L]
      logical :: goes_in(most_events) = .false.
   end type events_t

contains

   !> Append the passages of points and edges of `a` through `b`, of paths longer than `least`.
   pure subroutine passages_find(a, b, way_a, way_b, least, passage)
      type(triangles_t), intent(in) :: a, b
      type(way_t), intent(in) :: way_a, way_b    !! of their points
      real(wp), intent(in) :: least              !! [L]
      type(passage_t), allocatable, intent(inout) :: passage(:)        !! made longer
      type(box_tree_t) :: tree
      type(events_t) :: events
      real(wp) :: low(3, b%facets%n_facet), high(3, b%facets%n_facet), from(3), to(3)
      integer, allocatable :: found(:)
      logical :: is_seen(size(a%at, 2))
      integer :: f, e, k, n, i

      do f = 1, b%facets%n_facet
         call sweep(b, way_b, f, low(:, f), high(:, f))
      end do
      call box_tree_init(tree, low, high)
      is_seen = .false.
      allocate(found(64))
      do f = 1, a%facets%n_facet
         call sweep(a, way_a, f, from, to)
         n = 0
         call box_tree_find(tree, from, to, 0.0_wp, found, n)
         if (n == 0) cycle
         do k = a%split%start(f), a%split%start(f + 1) - 1
            do i = 1, 3
               associate (point => a%split%corner(i, k))
                  if (is_seen(point)) cycle
                  is_seen(point) = .true.
                  ! All facets that the point may meet: its way is in the box of this facet.
                  call point_events(b, way_a, way_b, point, found(:n), events)
                  call take(events, .true., least, passage)
               end associate
            end do
         end do
         do e = a%edge_start(f), a%edge_start(f + 1) - 1
            call edge_events(b, way_a, way_b, a%edge(:, e), found(:n), events)
            call take(events, .false., least, passage)
         end do
      end do
   end subroutine passages_find

   !> The box around the ways of all points of facet `f`.
   pure subroutine sweep(a, way, f, low, high)
      type(triangles_t), intent(in) :: a
      type(way_t), intent(in) :: way
      integer, intent(in) :: f
      real(wp), intent(out) :: low(3), high(3)
      integer :: i, k

      low = huge(1.0_wp)
      high = -huge(1.0_wp)
      do k = a%split%start(f), a%split%start(f + 1) - 1
         do i = 1, 3
            associate (start => way%start(:, a%split%corner(i, k)), &
                  rate => way%rate(:, a%split%corner(i, k)))
               low = min(low, start, start + rate)
               high = max(high, start, start + rate)
            end associate
         end do
      end do
   end subroutine sweep

   !> When `point` meets triangles of some facets of `b`.
   pure subroutine point_events(b, way_a, way_b, point, facet, events)
      type(triangles_t), intent(in) :: b
      type(way_t), intent(in) :: way_a, way_b
      integer, intent(in) :: point, facet(:)
      type(events_t), intent(inout) :: events
      real(wp) :: start(3, 3), rate(3, 3)
      integer :: f, t

      events%n = 0
      do f = 1, size(facet)
         do t = b%split%start(facet(f)), b%split%start(facet(f) + 1) - 1
            associate (corner => b%split%corner(:, t))
               start = differences(way_b%start(:, corner(1)), way_b%start(:, corner(2)), &
                  way_b%start(:, corner(3)), way_a%start(:, point))
               rate = differences(way_b%rate(:, corner(1)), way_b%rate(:, corner(2)), &
                  way_b%rate(:, corner(3)), way_a%rate(:, point))
            end associate
            call meet(start, rate, .true., events)
         end do
      end do
   end subroutine point_events

   !> When an edge of `a` meets edges that some facets of `b` bring.
   pure subroutine edge_events(b, way_a, way_b, edge, facet, events)
      type(triangles_t), intent(in) :: b
      type(way_t), intent(in) :: way_a, way_b
      integer, intent(in) :: edge(2), facet(:)
      type(events_t), intent(inout) :: events
      real(wp) :: start(3, 3), rate(3, 3)
      integer :: f, e

      events%n = 0
      do f = 1, size(facet)
         do e = b%edge_start(facet(f)), b%edge_start(facet(f) + 1) - 1
            associate (p => edge(1), q => edge(2), u => b%edge(1, e), v => b%edge(2, e))
               start(:, 1) = way_a%start(:, q) - way_a%start(:, p)
               start(:, 2) = way_b%start(:, v) - way_b%start(:, u)
               start(:, 3) = way_b%start(:, u) - way_a%start(:, p)
               rate(:, 1) = way_a%rate(:, q) - way_a%rate(:, p)
               rate(:, 2) = way_b%rate(:, v) - way_b%rate(:, u)
               rate(:, 3) = way_b%rate(:, u) - way_a%rate(:, p)
            end associate
            call meet(start, rate, .false., events)
         end do
      end do
   end subroutine edge_events

   !> From the first of four points to the others.
   pure function differences(a, b, c, p) result(list)
      real(wp), intent(in) :: a(3), b(3), c(3), p(3)
      real(wp) :: list(3, 3)

      list(:, 1) = b - a
      list(:, 2) = c - a
      list(:, 3) = p - a
   end function differences

   !> The instants at which three vectors are in one plane, and the point is in the triangle, or a
   !> point of one edge on the other.
   pure subroutine meet(start, rate, is_point, events)
      real(wp), intent(in) :: start(3, 3), rate(3, 3)
      logical, intent(in) :: is_point            !! of a point and a triangle; else of two edges
      type(events_t), intent(inout) :: events
      real(wp) :: c(0:3), root(3), at(3, 3), normal(3), share(2), square, scale
      logical :: falls(3)
      integer :: n, i

      scale = product(sqrt(sum(start**2, dim=1)) + sqrt(sum(rate**2, dim=1)))
      c(0) = volume(start, start, start)
      c(1) = volume(rate, start, start) + volume(start, rate, start) + volume(start, start, rate)
      c(2) = volume(start, rate, rate) + volume(rate, start, rate) + volume(rate, rate, start)
      c(3) = volume(rate, rate, rate)
      if (maxval(abs(c)) <= n_rounding*epsilon(1.0_wp)*scale) return
      call cubic_roots(c, root, falls, n)
      do i = 1, n
         if (events%n == most_events) return
         at = start + root(i)*rate
         normal = cross_product(at(:, 1), at(:, 2))
         square = dot_product(normal, normal)
         if (.not. square > 0.0_wp) cycle
         if (is_point) then
            share(1) = dot_product(cross_product(at(:, 3), at(:, 2)), normal)/square
            share(2) = dot_product(cross_product(at(:, 1), at(:, 3)), normal)/square
            if (sum(share) > 1.0_wp + beside .or. any(share < -beside)) cycle
         else                                    ! the ends of edges are points
            share(1) = dot_product(cross_product(at(:, 3), at(:, 2)), normal)/square
            share(2) = dot_product(cross_product(at(:, 3), at(:, 1)), normal)/square
            if (any(share > 1.0_wp - beside) .or. any(share < beside)) cycle
         end if
         at(:, 1) = share(1)*rate(:, 1) - rate(:, 3)
         at(:, 2) = share(2)*rate(:, 2)*merge(1.0_wp, -1.0_wp, is_point)
         call insert(events, root(i), sqrt(sum((at(:, 1) + at(:, 2))**2)), falls(i))
      end do

   contains

      pure real(wp) function volume(a, b, c)
         real(wp), intent(in) :: a(3, 3), b(3, 3), c(3, 3)

         volume = dot_product(cross_product(a(:, 1), b(:, 2)), c(:, 3))
      end function volume

   end subroutine meet

   !> The roots of c(0) + c(1) t + c(2) t^2 + c(3) t^3 from 0 to 1, and whether it falls there:
   !> between its turning points it has one at most.
   pure subroutine cubic_roots(c, root, falls, n)
      real(wp), intent(in) :: c(0:3)             !! any unit
      real(wp), intent(out) :: root(3)           !! the first `n`, ascending
      logical, intent(out) :: falls(3)           !! from > 0 to below it
      integer, intent(out) :: n                  !! 0 to 3
      real(wp) :: bound(4), turn(2), low, high, middle, discriminant, q
      integer :: i, k

      n = 0
      root = 0.0_wp
      falls = .false.
      bound = [c(0), c(0) + c(1)/3.0_wp, c(0) + (2.0_wp*c(1) + c(2))/3.0_wp, sum(c)]
      if (all(bound > 0.0_wp) .or. all(bound < 0.0_wp)) return
      turn = 1.0_wp
      discriminant = c(2)**2 - 3.0_wp*c(1)*c(3)
      if (discriminant > 0.0_wp) then            ! (-c2 -+ root)/(3 c3), without cancellation
         q = -(c(2) + sign(sqrt(discriminant), c(2)))
         turn(1) = in_step(c(1), q)
         turn(2) = in_step(q, 3.0_wp*c(3))
      end if
      bound = [0.0_wp, min(turn(1), turn(2)), max(turn(1), turn(2)), 1.0_wp]
      do i = 1, 3
         low = bound(i)
         high = bound(i + 1)
         if (.not. high > low) cycle
         if ((cubic(low) > 0.0_wp) .eqv. (cubic(high) > 0.0_wp)) cycle
         n = n + 1
         falls(n) = cubic(low) > 0.0_wp
         do k = 1, n_halving
            middle = 0.5_wp*(low + high)
            if ((cubic(middle) > 0.0_wp) .eqv. falls(n)) then
               low = middle
            else
               high = middle
            end if
         end do
         root(n) = 0.5_wp*(low + high)
      end do

   contains

      pure real(wp) function cubic(t)
         real(wp), intent(in) :: t

         cubic = c(0) + t*(c(1) + t*(c(2) + t*c(3)))
      end function cubic

      !> a/b if that is from 0 to 1, else 1.
      pure real(wp) function in_step(a, b)
         real(wp), intent(in) :: a, b

         in_step = 1.0_wp
         if (abs(a) < abs(b) .and. ((a > 0.0_wp) .eqv. (b > 0.0_wp))) in_step = a/b
      end function in_step

   end subroutine cubic_roots

   !> Take up an event, in order.
   pure subroutine insert(self, time, speed, goes_in)
      type(events_t), intent(inout) :: self
      real(wp), intent(in) :: time, speed
      logical, intent(in) :: goes_in
      integer :: i

      i = self%n
      do while (i > 0)
         if (self%time(i) <= time) exit
         self%time(i + 1) = self%time(i)
         self%speed(i + 1) = self%speed(i)
         self%goes_in(i + 1) = self%goes_in(i)
         i = i - 1
      end do
      self%time(i + 1) = time
      self%speed(i + 1) = speed
      self%goes_in(i + 1) = goes_in
      self%n = self%n + 1
   end subroutine insert

   !> Append the passages between events. A point is behind from where it goes in to where it goes
   !> out, or from the start if it goes out first; of edges all that is between two events counts.
   pure subroutine take(events, is_point, least, passage)
      type(events_t), intent(in) :: events
      logical, intent(in) :: is_point
      real(wp), intent(in) :: least
      type(passage_t), allocatable, intent(inout) :: passage(:)
      type(passage_t) :: new
      logical :: is_in
      integer :: i

      if (events%n == 0) return
      is_in = is_point .and. .not. events%goes_in(1)
      do i = 1, events%n
         new%to = events%time(i)
         new%path = (new%to - new%from)*events%speed(i)
         if (is_in .and. new%path > least) passage = [passage, new]
         is_in = events%goes_in(i) .or. .not. is_point
         new%from = new%to
      end do
   end subroutine take

end module emcon_passages_space
