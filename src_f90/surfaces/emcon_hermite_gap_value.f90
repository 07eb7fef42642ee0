!> Gap of a slave node over a smoothed master surface, at the closest point, for one configuration.
!>
!> With the place s of the closest point, a root of F = (x_s - y).tau, the gap is
!> ((x_s - y) x tau)/|tau|. Its discrete gradient is exact also where s passes from one piece to the
!> next. F and the gap are sums of dot and cross products of position differences whose factors
!> depend on s alone: hence orthogonal to rigid motions.
!>
!> Across a corner of the surface there is a second curve, the edge behind it alone. Each curve
!> goes on straight beyond its end; the gap is the larger one at a convex corner, the smaller one at
!> a concave one. In statics that choice is rounded.
!> Source: docs/theory.md, eq. (14b). Sign: gap > 0 is open.
module emcon_hermite_gap_value
   use emcon_hermite, only : hermite_closest, hermite_curve, hermite_curve_t, hermite_point, &
      hermite_point_t, hermite_stencil_t, hermite_distance, joined_pieces, piece_after, piece_before
   use emcon_kinds, only : wp
   use emcon_rounded, only : rounded_negative
   use emcon_vectors_plane, only : cross
   implicit none
   private
   public :: hermite_begin, hermite_gap_value, hermite_roots, hermite_slip_value, hermite_lever
   public :: slave

   !> Local numbers of the slave node and of the first node of the chosen edge.
   integer, parameter :: slave = 1, first = 2

contains

   !> Fix for a step what depends on its start: the kind of the corners, whether the edges across
   !> them take part, and where closest points are looked for.
   pure subroutine hermite_begin(stencil, x, s)
      type(hermite_stencil_t), intent(inout) :: stencil
      real(wp), intent(in) :: x(:, :)            !! (2, 3 to 7) slave, edge, further nodes; local
      real(wp), intent(out) :: s(3)              !! by the parts of a curve
      type(hermite_curve_t) :: curve, other
      type(hermite_point_t) :: p, q
      real(wp) :: edge(2, 5), b(2), root, corner
      integer :: side, e
      logical :: is_found

      call gather(stencil, x, edge, b)
      s(joined_pieces) = projection(b, edge(:, 3))
      s(piece_before) = projection(b + edge(:, 2), edge(:, 2)) - 1.0_wp
      s(piece_after) = projection(b - edge(:, 3), edge(:, 4)) + 1.0_wp
      curve = hermite_curve(stencil, joined_pieces)
      do side = 1, 2
         e = 2*side
         stencil%has_neighbour(side) = stencil%is_corner(2 + side) .and. &
            stencil%node(e) > 0 .and. stencil%node(e + 1) > 0
         if (.not. stencil%has_neighbour(side)) cycle
         corner = real(side - 1, wp)
         other = hermite_curve(stencil, 1 + side)
         p = hermite_point(curve, edge, corner)
         q = hermite_point(other, edge, corner)
         stencil%is_convex(side) = cross(p%tangent, q%tangent)*(2.0_wp*corner - 1.0_wp) >= 0.0_wp
         root = s(1 + side)
         call hermite_closest(other, edge, b, root, is_found)
         stencil%has_neighbour(side) = is_found
      end do
   end subroutine hermite_begin

   !> Place of `b` on the line along `a`, held within 0..1; 1/2 where there is no edge.
   pure real(wp) function projection(b, a)
      real(wp), intent(in) :: b(2), a(2)
      real(wp) :: square

      square = dot_product(a, a)
      projection = 0.5_wp
      if (square > 0.0_wp) projection = max(0.0_wp, min(1.0_wp, dot_product(b, a)/square))
   end function projection

   !> Edges of the chain as vectors, zero where there is none, and the slave node from node 3.
   pure subroutine gather(stencil, x, edge, b)
      type(hermite_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x(:, :)
      real(wp), intent(out) :: edge(2, 5), b(2)
      integer :: e

      edge = 0.0_wp
      do e = 1, 5
         if (minval(stencil%node(e:e + 1)) == 0) cycle
         edge(:, e) = x(:, stencil%node(e + 1)) - x(:, stencil%node(e))
      end do
      b = x(:, slave) - x(:, first)
   end subroutine gather

   !> The gap for one configuration. `s`, in: from `hermite_begin`, or the places at the start of
   !> the step, so that both ends are on one branch; out: the places. s(1) is the projection on the
   !> chosen edge (0..1 inside).
   pure subroutine hermite_gap_value(stencil, x, s, gap, is_found)
      type(hermite_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x(:, :)            !! (2, 3 to 7)
      real(wp), intent(inout) :: s(3)  !! on the joined pieces, the one before, the one after
      real(wp), intent(out) :: gap               !! [L]
      logical, intent(out) :: is_found           !! .false.: no unique closest point; gap undefined
      real(wp) :: edge(2, 5), b(2), other
      integer :: side

      call gather(stencil, x, edge, b)
      call curve_gap_value(hermite_curve(stencil, joined_pieces), edge, b, s(1), gap, is_found)
      do side = 1, 2
         if (.not. (stencil%has_neighbour(side) .and. is_found)) cycle
         call curve_gap_value(hermite_curve(stencil, 1 + side), edge, b, s(1 + side), other, &
            is_found)
         if (stencil%is_convex(side)) then
            gap = gap - rounded_negative(gap - other, stencil%rounding)
         else
            gap = other + rounded_negative(gap - other, stencil%rounding)
         end if
      end do
   end subroutine hermite_gap_value

   !> Gap over one curve.
   pure subroutine curve_gap_value(curve, edge, b, s, gap, is_found)
      type(hermite_curve_t), intent(in) :: curve
      real(wp), intent(in) :: edge(2, 5), b(2)
      real(wp), intent(inout) :: s
      real(wp), intent(out) :: gap
      logical, intent(out) :: is_found
      type(hermite_point_t) :: p

      gap = 0.0_wp
      call hermite_closest(curve, edge, b, s, is_found)
      if (.not. is_found) return
      p = hermite_point(curve, edge, s)
      gap = cross(b - p%y, p%tangent)/sqrt(dot_product(p%tangent, p%tangent))
   end subroutine curve_gap_value

   !> Places of the closest points at both ends of the step, on one branch.
   pure subroutine hermite_roots(stencil, curve, x0, dx, s, root, is_found)
      type(hermite_stencil_t), intent(in) :: stencil
      type(hermite_curve_t), intent(in) :: curve
      real(wp), intent(in) :: x0(:, :), dx(:, :)   !! (2, 3 to 7) as in `hermite_begin`, and motion
      real(wp), intent(in) :: s                  !! where on the curve they are looked for
      real(wp), intent(out) :: root(2)           !! at the start, at the end of the step
      logical, intent(out) :: is_found           !! .false.: no unique closest points
      real(wp) :: edge(2, 5), b(2), motion(2, 5), way(2)

      call gather(stencil, x0, edge, b)
      root = s
      call hermite_closest(curve, edge, b, root(1), is_found)
      if (.not. is_found) return
      call gather(stencil, dx, motion, way)
      root(2) = root(1)
      call hermite_closest(curve, edge + motion, b + way, root(2), is_found)
   end subroutine hermite_roots

   !> How far the closest point slides over a step: docs/theory.md, eq. (14k).
   pure subroutine hermite_slip_value(stencil, x0, dx, s, slip, is_found)
      type(hermite_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x0(:, :), dx(:, :)   !! (2, 3 to 7) as in `hermite_roots` [L]
      real(wp), intent(in) :: s                  !! where on the curve they are looked for
      real(wp), intent(out) :: slip              !! > 0 along the chain [L]
      logical, intent(out) :: is_found           !! .false.: no unique closest points
      type(hermite_curve_t) :: curve
      real(wp) :: root(0:1)

      slip = 0.0_wp
      curve = hermite_curve(stencil, joined_pieces)
      call hermite_roots(stencil, curve, x0, dx, s, root, is_found)
      if (.not. is_found) return
      slip = hermite_lever(stencil, curve, x0, root(0)) &
         *(hermite_distance(curve, root(1)) - hermite_distance(curve, root(0)))
   end subroutine hermite_slip_value

   !> How far the slave node moves along the curve while the closest point, at `s`, moves by one of
   !> the reference length: the stretch of the curve, less its curvature times a gap that is held.
   !> Friction on the node is then as large as the law has it, at whatever distance.
   pure real(wp) function hermite_lever(stencil, curve, x, s) result(lever)
      type(hermite_stencil_t), intent(in) :: stencil
      type(hermite_curve_t), intent(in) :: curve
      real(wp), intent(in) :: x(:, :)            !! (2, 3 to 7) as in `hermite_begin` [L]
      real(wp), intent(in) :: s                  !! place on the curve
      type(hermite_point_t) :: p
      real(wp) :: edge(2, 5), b(2), stretch

      call gather(stencil, x, edge, b)
      p = hermite_point(curve, edge, s)
      stretch = sqrt(dot_product(p%tangent, p%tangent))
      lever = stretch - dot_product(b - p%y, p%bend)/(p%length*stretch)
   end function hermite_lever

end module emcon_hermite_gap_value
