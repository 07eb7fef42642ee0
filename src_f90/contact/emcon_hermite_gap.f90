!> Gap of a slave node over a smoothed master surface, at the closest point.
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
module emcon_hermite_gap
   use emcon_dgrad1, only : weight_t => dg_t, dg_constant, operator(*), operator(-)
   use emcon_dgrad15, only : dg_negative_part, dg_root, dg_sqrt, dg_t, difference, difference_t, &
      operator(+), operator(-), operator(/)
   use emcon_hermite, only : hermite_closest, hermite_curve, hermite_curve_t, hermite_point, &
      hermite_point_t, hermite_stencil_t, hermite_weights, hermite_weights_t, joined_pieces, &
      piece_after, piece_before
   use emcon_kinds, only : wp
   use emcon_rounded, only : rounded_negative
   implicit none
   private
   public :: hermite_begin, hermite_gap, hermite_gap_value

   !> Local numbers of the slave node and of the chosen edge; the number of the unknown place.
   integer, parameter :: slave = 1, first = 2, last = 3, place = 15
   !> The matrices of the dot and of the cross product.
   real(wp), parameter :: dot(2, 2) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
   real(wp), parameter :: turn(2, 2) = reshape([0.0_wp, -1.0_wp, 1.0_wp, 0.0_wp], [2, 2])
   !> Smallest mean slope of F, relative to that on a straight curve.
   real(wp), parameter :: smallest_slope = 1.0e-3_wp

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

   !> The gap over a step, in discrete-gradient arithmetic; the variable number 15 does not occur.
   pure subroutine hermite_gap(stencil, x0, dx, s, gap, is_found)
      type(hermite_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x0(:, :)           !! (2, 3 to 7) slave, edge, further nodes; local
      real(wp), intent(in) :: dx(:, :)           !! their motion
      real(wp), intent(in) :: s(3)               !! from `hermite_begin`
      type(dg_t), intent(out) :: gap
      logical, intent(out) :: is_found           !! .false.: no unique closest point; gap undefined
      type(dg_t) :: other
      integer :: side, k

      call curve_gap(stencil, joined_pieces, x0, dx, s(1), gap, is_found)
      do side = 1, 2
         if (.not. (stencil%has_neighbour(side) .and. is_found)) cycle
         call curve_gap(stencil, 1 + side, x0, dx, s(1 + side), other, is_found)
         if (stencil%is_convex(side)) then
            gap = gap - dg_negative_part(gap - other, stencil%rounding)
         else
            gap = other + dg_negative_part(gap - other, stencil%rounding)
         end if
      end do
      gap%df = 0.0_wp
      do k = 1, size(x0, 2)
         gap%df = gap%df + dot_product(gap%g(2*k - 1:2*k), dx(:, k))
      end do
   end subroutine hermite_gap

   !> Gap over one curve.
   pure subroutine curve_gap(stencil, part, x0, dx, s, gap, is_found)
      type(hermite_stencil_t), intent(in) :: stencil
      integer, intent(in) :: part
      real(wp), intent(in) :: x0(:, :), dx(:, :), s
      type(dg_t), intent(out) :: gap
      logical, intent(out) :: is_found
      type(hermite_curve_t) :: curve
      type(hermite_weights_t) :: w
      type(difference_t) :: d(6)
      type(weight_t) :: alpha(6), beta(6)
      type(dg_t) :: f, square
      real(wp) :: root(2)
      integer :: n, k

      curve = hermite_curve(stencil, part)
      call roots(stencil, curve, x0, dx, s, root, is_found)
      if (.not. is_found) return
      w = hermite_weights(curve, root(1), root(2))
      n = 1 + w%n
      d(1) = difference(slave, stencil%node(w%base), x0, dx)
      alpha(1) = dg_constant(1.0_wp)
      do k = 2, n
         d(k) = difference(stencil%node(w%edge(k - 1) + 1), stencil%node(w%edge(k - 1)), x0, dx)
         alpha(k) = -w%y(k - 1)
         beta(k) = w%t(k - 1)
      end do
      f = bilinear(d(:n), alpha(:n), beta(:n), dot)
      square = bilinear(d(2:n), beta(2:n), beta(2:n), dot)
      is_found = -f%g(place) > smallest_slope*curve%length(3)*min(square%f0, square%f1)
      if (.not. is_found) return
      gap = bilinear(d(:n), alpha(:n), beta(:n), turn)/dg_sqrt(square)
      gap = put(gap, dg_root(f, place, root(1), root(2)))
   end subroutine curve_gap

   !> Places of the closest points at both ends of the step, on one branch.
   pure subroutine roots(stencil, curve, x0, dx, s, root, is_found)
      type(hermite_stencil_t), intent(in) :: stencil
      type(hermite_curve_t), intent(in) :: curve
      real(wp), intent(in) :: x0(:, :), dx(:, :), s
      real(wp), intent(out) :: root(2)
      logical, intent(out) :: is_found
      real(wp) :: edge(2, 5), b(2), motion(2, 5), way(2)

      call gather(stencil, x0, edge, b)
      root = s
      call hermite_closest(curve, edge, b, root(1), is_found)
      if (.not. is_found) return
      call gather(stencil, dx, motion, way)
      root(2) = root(1)
      call hermite_closest(curve, edge + motion, b + way, root(2), is_found)
   end subroutine roots

   !> Sum over i and j of alpha_i beta_j d_i.(q d_j), with factors that depend on the place: what
   !> sums of `dg_dot` and `dg_cross` times numbers would give, without a matrix for each term.
   pure function bilinear(d, alpha, beta, q) result(f)
      type(difference_t), intent(in) :: d(:)
      type(weight_t), intent(in) :: alpha(:), beta(:)
      real(wp), intent(in) :: q(2, 2)
      type(dg_t) :: f
      type(weight_t) :: w
      real(wp), dimension(2, size(d)) :: right0, right1, left0, left1   ! q d, and d in front of q
      real(wp), dimension(2, size(d)) :: g, c, g_place, place_c
      real(wp) :: mean(size(d), size(d)), v0, v1
      integer :: i, j

      do j = 1, size(d)
         right0(:, j) = q(:, 1)*d(j)%v0(1) + q(:, 2)*d(j)%v0(2)
         right1(:, j) = q(:, 1)*d(j)%v1(1) + q(:, 2)*d(j)%v1(2)
         left0(:, j) = d(j)%v0(1)*q(1, :) + d(j)%v0(2)*q(2, :)
         left1(:, j) = d(j)%v1(1)*q(1, :) + d(j)%v1(2)*q(2, :)
      end do
      g = 0.0_wp
      c = 0.0_wp
      g_place = 0.0_wp
      place_c = 0.0_wp
      do j = 1, size(d)
         do i = 1, size(d)
            w = alpha(i)*beta(j)
            v0 = dot_product(d(i)%v0, right0(:, j))
            v1 = dot_product(d(i)%v1, right1(:, j))
            mean(i, j) = 0.5_wp*(w%f0 + w%f1)
            f%f0 = f%f0 + w%f0*v0
            f%f1 = f%f1 + w%f1*v1
            f%g(place) = f%g(place) + 0.5_wp*(v0 + v1)*w%g(1)
            f%c(place) = f%c(place) + v1*w%c(1)
            f%h(place, place) = f%h(place, place) + 0.5_wp*(v0 + v1)*w%h(1, 1)
            g(:, i) = g(:, i) + (0.5_wp*mean(i, j))*(right0(:, j) + right1(:, j))
            g(:, j) = g(:, j) + (0.5_wp*mean(i, j))*(left0(:, i) + left1(:, i))
            c(:, i) = c(:, i) + w%f1*right1(:, j)
            c(:, j) = c(:, j) + w%f1*left1(:, i)
            g_place(:, i) = g_place(:, i) + (0.25_wp*w%c(1))*(right0(:, j) + right1(:, j))
            g_place(:, j) = g_place(:, j) + (0.25_wp*w%c(1))*(left0(:, i) + left1(:, i))
            place_c(:, i) = place_c(:, i) + (0.5_wp*w%g(1))*right1(:, j)
            place_c(:, j) = place_c(:, j) + (0.5_wp*w%g(1))*left1(:, i)
         end do
      end do
      do j = 1, size(d)
         call add_at(f%g, d(j), g(:, j))
         call add_at(f%c, d(j), c(:, j))
         call add_at(f%h(:, place), d(j), g_place(:, j))
         call add_at(f%h(place, :), d(j), place_c(:, j))
      end do
      do j = 1, size(d)
         do i = 1, size(d)
            call add_block(f%h, d(i), d(j), mean(i, j)*q + mean(j, i)*transpose(q))
         end do
      end do
   end function bilinear

   pure subroutine add_at(g, a, v)
      real(wp), intent(inout) :: g(:)
      type(difference_t), intent(in) :: a
      real(wp), intent(in) :: v(2)

      g(2*a%tip - 1:2*a%tip) = g(2*a%tip - 1:2*a%tip) + v
      g(2*a%tail - 1:2*a%tail) = g(2*a%tail - 1:2*a%tail) - v
   end subroutine add_at

   !> Half of `q` at (tip, tip) and (tail, tail), minus half at the crossed places.
   pure subroutine add_block(h, a, b, q)
      real(wp), intent(inout) :: h(:, :)
      type(difference_t), intent(in) :: a, b
      real(wp), intent(in) :: q(2, 2)
      integer :: i, j, rows(2), cols(2)

      rows = 2*[a%tip, a%tail]
      cols = 2*[b%tip, b%tail]
      do j = 1, 2
         do i = 1, 2
            h(rows(i) - 1:rows(i), cols(j) - 1:cols(j)) = &
               h(rows(i) - 1:rows(i), cols(j) - 1:cols(j)) + merge(0.5_wp, -0.5_wp, i == j)*q
         end do
      end do
   end subroutine add_block

   !> `f` with the number `root` of the other variables in the place of its last variable. `df` is
   !> left out.
   pure function put(f, root) result(s)
      type(dg_t), intent(in) :: f, root
      type(dg_t) :: s
      integer :: j

      s%f0 = f%f0
      s%f1 = f%f1
      do j = 1, place - 1
         s%g(j) = f%g(j) + f%g(place)*root%g(j)
         s%c(j) = f%c(j) + f%c(place)*root%c(j)
         s%h(:place - 1, j) = f%h(:place - 1, j) + f%h(:place - 1, place)*root%c(j) &
            + (f%h(place, j) + f%h(place, place)*root%c(j))*root%g(:place - 1) &
            + f%g(place)*root%h(:place - 1, j)
      end do
   end function put

   pure real(wp) function cross(a, b)
      real(wp), intent(in) :: a(2), b(2)

      cross = a(1)*b(2) - a(2)*b(1)
   end function cross

end module emcon_hermite_gap
