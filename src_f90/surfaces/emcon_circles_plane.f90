!> Edges of rigid surfaces that are chords of one circle: contact sees the circle.
!>
!> At a node between two edges there is a circle through it and its neighbours. Where it is the same
!> at two nodes or more beside each other, all edges there are its chords. Source: docs/theory.md,
!> section 4.2.
module emcon_circles_plane
   use emcon_chain_plane, only : chain_t, next, previous
   use emcon_kinds, only : wp
   implicit none
   private
   public :: circles_t, circles_find, circle_whole, off_circles

   !> Turns from edge to edge up to this are those of a circle, sharper ones corners: a polygon of
   !> 60 edges is a circle (sine; with room for the rounding of coordinates).
   real(wp), parameter :: sharpest = 1.001_wp*sin(acos(-1.0_wp)/30.0_wp)
   !> So far, by what an edge is off its arc, nodes are off the circle; and, by half a turn, an edge
   !> is off the tangent where the circle goes over to it.
   real(wp), parameter :: off = 0.1_wp

   type :: circles_t
      integer :: n = 0
      integer, allocatable :: of(:)              !! (n_facet) number of its circle; 0: none
      real(wp), allocatable :: curvature(:)      !! (n_facet) > 0 where it bulges out of the body;
                                                 !! 0: no circle [1/L]
   end type circles_t

contains

   !> The circles of a surface: closed, or between its ends and edges along their tangent.
   pure subroutine circles_find(self, chain, x, body)
      type(circles_t), intent(out) :: self
      type(chain_t), intent(in) :: chain
      real(wp), intent(in) :: x(:, :)            !! (2, n_node of the scene) [L]
      integer, intent(in) :: body(:)             !! (n_node) rigid body of each; 0: none
      real(wp) :: bend(chain%n_facet)            !! curvature at the first node of each edge
      logical :: goes_on(chain%n_facet)          !! the same circle at both of its nodes
      integer :: e, k, n

      allocate(self%of(chain%n_facet), source=0)
      allocate(self%curvature(chain%n_facet), source=0.0_wp)
      do e = 1, chain%n_facet
         bend(e) = bend_at(chain, x, body, e)
      end do
      do e = 1, chain%n_facet
         k = chain%neighbour(next, e)
         goes_on(e) = .false.
         if (k > 0) goes_on(e) = bend(e)*bend(k) > 0.0_wp .and. &
            abs(bend(e) - bend(k)) <= off*abs(bend(e))
      end do
      do e = 1, chain%n_facet
         if (self%of(e) > 0 .or. .not. goes_on(e)) cycle
         call take_run(self, chain, x, goes_on, e)
      end do
      do n = 1, self%n
         if (ends_well(self, chain, x, n, previous) .and. ends_well(self, chain, x, n, next)) cycle
         where (self%of == n) self%curvature = 0.0_wp
      end do
      where (.not. abs(self%curvature) > 0.0_wp) self%of = 0
   end subroutine circles_find

   !> Curvature of the circle through the ends of edge `e` and of the edge before; 0 at corners, at
   !> ends and where no rigid body has both edges.
   pure real(wp) function bend_at(chain, x, body, e) result(bend)
      type(chain_t), intent(in) :: chain
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: body(:), e
      real(wp) :: a(2), b(2), turn
      integer :: before

      bend = 0.0_wp
      before = chain%neighbour(previous, e)
      if (before == 0) return
      associate (node => [chain%facet(:, before), chain%facet(2, e)])
         if (any(body(node) == 0) .or. any(body(node) /= body(node(1)))) return
      end associate
      a = chord(chain, x, before)
      b = chord(chain, x, e)
      if (.not. dot_product(a, b) > 0.0_wp) return
      turn = (a(1)*b(2) - a(2)*b(1))/sqrt(dot_product(a, a)*dot_product(b, b))
      if (abs(turn) > sharpest) return
      bend = 2.0_wp*turn/sqrt(dot_product(a + b, a + b))
   end function bend_at

   !> Number the edges around `e` that are chords of one circle, if they are.
   pure subroutine take_run(self, chain, x, goes_on, e)
      type(circles_t), intent(inout) :: self
      type(chain_t), intent(in) :: chain
      real(wp), intent(in) :: x(:, :)
      logical, intent(in) :: goes_on(:)
      integer, intent(in) :: e
      integer :: run(chain%n_facet), first, k, n
      real(wp) :: centre(2), radius, curvature
      logical :: is_closed

      first = e
      do
         first = chain%neighbour(previous, first)
         if (first == e .or. .not. goes_on(first)) exit
      end do
      is_closed = first == e
      run(1) = first
      n = 1
      do
         k = chain%neighbour(next, run(n))
         if (k == first) exit
         n = n + 1
         run(n) = k
         if (.not. goes_on(k)) exit
      end do
      call circle_through(chain, x, run(:n), is_closed, centre, radius, curvature)
      if (.not. is_on(chain, x, run(:n), centre, radius)) return
      self%n = self%n + 1
      self%of(run(:n)) = self%n
      self%curvature(run(:n)) = curvature
   end subroutine take_run

   !> The circle through nodes far from each other of the edges `run`.
   pure subroutine circle_through(chain, x, run, is_closed, centre, radius, curvature)
      type(chain_t), intent(in) :: chain
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: run(:)              !! edges, one after the other
      logical, intent(in) :: is_closed
      real(wp), intent(out) :: centre(2)         !! [L]
      real(wp), intent(out) :: radius, curvature !! [L], [1/L] with its sign
      real(wp) :: a(2), b(2), area
      integer :: at(3)

      associate (n => size(run))
         at = [chain%facet(1, run(1)), chain%facet(1, run(1 + n/2)), chain%facet(2, run(n))]
         if (is_closed) at(2:) = chain%facet(1, run([1 + n/3, 1 + (2*n)/3]))
      end associate
      a = x(:, at(2)) - x(:, at(1))
      b = x(:, at(3)) - x(:, at(1))
      area = 2.0_wp*(a(1)*b(2) - a(2)*b(1))
      centre = [b(2)*dot_product(a, a) - a(2)*dot_product(b, b), &
         a(1)*dot_product(b, b) - b(1)*dot_product(a, a)]/area
      radius = norm2(centre)
      centre = x(:, at(1)) + centre
      curvature = sign(1.0_wp/radius, area)
   end subroutine circle_through

   !> Are the nodes of the edges `run` on a circle?
   pure logical function is_on(chain, x, run, centre, radius)
      type(chain_t), intent(in) :: chain
      real(wp), intent(in) :: x(:, :), centre(2), radius
      integer, intent(in) :: run(:)
      real(wp) :: a(2)
      integer :: k

      is_on = .false.
      do k = 1, size(run)
         a = chord(chain, x, run(k))
         if (.not. all(abs([norm2(x(:, chain%facet(1, run(k))) - centre), &
            norm2(x(:, chain%facet(2, run(k))) - centre)] - radius) &
            <= off*off_circle(1.0_wp/radius, norm2(a)))) return
      end do
      is_on = .true.
   end function is_on

   !> Does a circle go on beyond its edges on a side along its tangent, or not at all?
   pure logical function ends_well(self, chain, x, n, side)
      type(circles_t), intent(in) :: self
      type(chain_t), intent(in) :: chain
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: n                   !! its number
      integer, intent(in) :: side                !! `previous` or `next`
      real(wp) :: a(2), b(2), half, turn
      integer :: e, beyond

      ends_well = .true.
      do e = 1, chain%n_facet
         if (self%of(e) /= n) cycle
         beyond = chain%neighbour(side, e)
         if (beyond == 0) return
         if (self%of(beyond) == n) cycle
         a = chord(chain, x, e)
         b = chord(chain, x, beyond)
         half = asin(0.5_wp*self%curvature(e)*norm2(a))
         turn = atan2(a(1)*b(2) - a(2)*b(1), dot_product(a, b))
         if (side == previous) turn = -turn
         ends_well = self%of(beyond) == 0 .and. abs(turn - half) <= off*abs(half)
         return
      end do
   end function ends_well

   !> Edge `e` from its first to its last node.
   pure function chord(chain, x, e)
      type(chain_t), intent(in) :: chain
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: e
      real(wp) :: chord(2)

      chord = x(:, chain%facet(2, e)) - x(:, chain%facet(1, e))
   end function chord

   !> How far edges are off their circles in the middle; 0 where there is none [L].
   elemental real(wp) function off_circle(curvature, length)
      real(wp), intent(in) :: curvature          !! [1/L]
      real(wp), intent(in) :: length             !! of the edge [L]

      off_circle = 0.125_wp*abs(curvature)*length**2
   end function off_circle

   !> The same of some edges.
   pure function off_circles(self, chain, edge) result(way)
      type(circles_t), intent(in) :: self
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: edge(:)             !! of the chain; 0: none
      real(wp) :: way(size(edge))                !! [L]

      way = 0.0_wp
      where (edge > 0) way = off_circle(self%curvature(max(1, edge)), chain%size(max(1, edge)))
   end function off_circles

   !> Is a whole surface one circle that bulges out? Its centre and radius.
   pure subroutine circle_whole(self, chain, x, is_whole, centre, radius)
      type(circles_t), intent(in) :: self
      type(chain_t), intent(in) :: chain
      real(wp), intent(in) :: x(:, :)            !! (2, n_node of the scene) [L]
      logical, intent(out) :: is_whole           !! else centre and radius are not set
      real(wp), intent(out) :: centre(2), radius !! [L]
      real(wp) :: curvature
      integer :: run(chain%n_facet), k

      is_whole = chain%n_facet > 0
      if (is_whole) is_whole = self%n == 1 .and. all(self%of == 1) &
         .and. all(chain%neighbour > 0) .and. self%curvature(1) > 0.0_wp
      if (.not. is_whole) return
      run(1) = 1
      do k = 2, size(run)
         run(k) = chain%neighbour(next, run(k - 1))
      end do
      call circle_through(chain, x, run, .true., centre, radius, curvature)
   end subroutine circle_whole

end module emcon_circles_plane
