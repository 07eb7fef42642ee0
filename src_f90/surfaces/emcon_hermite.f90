!> Smooth curve through up to four nodes of a surface: cubic Hermite pieces over its edges.
!>
!> Chain of nodes 1 to 6 with the edges E_e = x_{e+1} - x_e and their reference lengths l_e; edge 3
!> is the chosen one, edges 2 and 4 may be joined to it. Piece e, with eta from 0 to 1:
!>
!>    y = x_e + H01 E_e + l_e (H10 tau_e + H11 tau_{e+1}).
!>
!> Place s on the curve: s = eta + e - 3. Within one step the curve is linear in the positions: its
!> coefficients depend on s and on reference lengths only.
!>
!> Tangents (derivatives by the reference length). Between two joined edges, that of the parabola
!> through the three nodes: exact to second order on unequal edges too, where (E_{e-1} + E_e)/
!> (l_{e-1} + l_e) has an error of the first. At a corner or an end, that with which the piece is
!> itself a parabola, 2 E/l - tau of the other end: of the same order. The chord, or an end without
!> curvature, errs by the first order there, and bends the surface at a plane of symmetry.
!> Source: docs/theory.md, eq. (14a) and section 4.3.
module emcon_hermite
   use emcon_dgrad1, only : dg_constant, dg_negative_part, dg_t, dg_variable, operator(*), &
      operator(+), operator(-)
   use emcon_kinds, only : wp
   implicit none
   private
   public :: hermite_curve_t, hermite_point_t, hermite_stencil_t, hermite_weights_t
   public :: hermite_closest, hermite_curve, hermite_point, hermite_weights
   public :: hermite_distance
   public :: joined_pieces, piece_before, piece_after, at_end

   !> Which part of the chain a curve is made of: the chosen edge and what is joined to it, or the
   !> edge before or after it alone.
   integer, parameter :: joined_pieces = 1, piece_before = 2, piece_after = 3
   integer, parameter :: edges_of(2, 2:3) = reshape([2, 2, 4, 4], [2, 2])

   !> The closest point is lost where the distance comes nearer than this to the radius of
   !> curvature, relative to the latter: there two places are equally close.
   real(wp), parameter :: focal_limit = 0.1_wp
   !> Smallest length of a tangent, squared, relative to the reference length.
   real(wp), parameter :: smallest_square = 1.0e-6_wp
   !> The pieces change over within this part of an edge around a node. As their sum is one smooth
   !> curve, that moves it by the square of it, below round-off.
   real(wp), parameter :: at_end = sqrt(epsilon(1.0_wp))
   !> Step of the search for a bracket of the closest point, in s.
   real(wp), parameter :: search_step = 0.5_wp

   !> A stretch of surface around the edge nearest to a slave node; fixed during a step.
   type :: hermite_stencil_t
      integer :: node(6) = 0                     !! local numbers in the order of the chain; 0: none
      real(wp) :: length(5) = 1.0_wp             !! reference lengths of the edges between them
      logical :: is_corner(6) = .false.          !! not smooth there; read at nodes 2 to 5
      logical :: has_neighbour(2) = .false.      !! the edge across a corner at node 3, 4 takes part
      logical :: is_convex(2) = .false.          !! of those corners
      real(wp) :: rounding = 0.0_wp              !! length over which corners are rounded [L]
   end type hermite_stencil_t

   !> Pieces `first` to `last`, smoothly joined; beyond them the curve goes on straight.
   type :: hermite_curve_t
      integer :: first = 3
      integer :: last = 3
      real(wp) :: length(5) = 1.0_wp
      real(wp) :: tangent(5, 6) = 0.0_wp         !! tau_k = sum over i of tangent(i, k) E_i
   end type hermite_curve_t

   !> The curve at one place, in one configuration.
   type :: hermite_point_t
      real(wp) :: y(2) = 0.0_wp                  !! relative to node 3
      real(wp) :: tangent(2) = 0.0_wp            !! derivative of y by the reference length
      real(wp) :: bend(2) = 0.0_wp               !! derivative of `tangent` by s
      real(wp) :: length = 1.0_wp                !! dy/ds = length*tangent
   end type hermite_point_t

   !> The curve between two places as numbers of the discrete-gradient arithmetic over s:
   !> y = x_base + sum y(i) E_i and the tangent sum t(i) E_i, i = 1 to `n`, over the edges edge(i).
   type :: hermite_weights_t
      integer :: base = 3
      integer :: n = 0
      integer :: edge(5) = 0
      type(dg_t) :: y(5)
      type(dg_t) :: t(5)
   end type hermite_weights_t

contains

   !> The curve over a part of the stencil: `joined_pieces`, `piece_before` or `piece_after`.
   pure function hermite_curve(stencil, part) result(curve)
      type(hermite_stencil_t), intent(in) :: stencil
      integer, intent(in) :: part                !! of the chain, as above
      type(hermite_curve_t) :: curve
      integer :: k, other
      logical :: is_joined(6)

      is_joined = .false.
      do k = 2, 5
         is_joined(k) = stencil%node(k - 1) > 0 .and. stencil%node(k + 1) > 0 .and. &
            .not. stencil%is_corner(k)
      end do
      if (part == joined_pieces) then
         curve%first = merge(2, 3, is_joined(3))
         curve%last = merge(4, 3, is_joined(4))
      else
         curve%first = edges_of(1, part)
         curve%last = edges_of(2, part)
      end if
      curve%length = stencil%length
      do k = curve%first, curve%last + 1
         if (is_joined(k)) curve%tangent(k - 1:k, k) = parabola(stencil%length(k - 1:k))
      end do
      do k = curve%first, curve%last + 1, curve%last + 1 - curve%first
         if (is_joined(k)) cycle
         other = merge(k + 1, k - 1, k == curve%first)
         associate (e => min(k, other), t => curve%tangent)
            if (is_joined(other)) then
               t(:, k) = -t(:, other)
               t(e, k) = t(e, k) + 2.0_wp/curve%length(e)
            else
               t(e, k) = 1.0_wp/curve%length(e)
            end if
         end associate
      end do
   end function hermite_curve

   !> Factors of two edges of lengths `l` in the slope of the parabola at their common node:
   !> docs/theory.md, eq. (14a).
   pure function parabola(l) result(factor)
      real(wp), intent(in) :: l(2)
      real(wp) :: factor(2)

      factor = [l(2)/l(1), l(1)/l(2)]/(l(1) + l(2))
   end function parabola

   !> The curve at `s`, from the edges as vectors.
   pure function hermite_point(curve, edge, s) result(p)
      type(hermite_curve_t), intent(in) :: curve
      real(wp), intent(in) :: edge(2, 5)         !! not read where the curve does not need them
      real(wp), intent(in) :: s                  !! place on the curve
      type(hermite_point_t) :: p
      real(wp) :: start(2), finish(2), eta, z, chord(2)
      integer :: e

      e = piece_of(curve, 3 + floor(held(s)))
      eta = s - real(e - 3, wp)
      z = max(0.0_wp, min(1.0_wp, eta))
      start = tangent_at(curve, edge, e)
      finish = tangent_at(curve, edge, e + 1)
      p%length = curve%length(e)
      chord = edge(:, e)/p%length
      p%tangent = 6.0_wp*z*(1.0_wp - z)*chord + (1.0_wp - z)*(1.0_wp - 3.0_wp*z)*start &
         + z*(3.0_wp*z - 2.0_wp)*finish
      p%y = z*z*(3.0_wp - 2.0_wp*z)*edge(:, e) + p%length*(z*(1.0_wp - z)**2*start &
         - z*z*(1.0_wp - z)*finish + (eta - z)*p%tangent)
      if (e == 2) p%y = p%y - edge(:, 2)
      if (e == 4) p%y = p%y + edge(:, 3)
      if (abs(eta - z) > 0.0_wp) return
      p%bend = 6.0_wp*(1.0_wp - 2.0_wp*z)*chord + (6.0_wp*z - 4.0_wp)*start &
         + (6.0_wp*z - 2.0_wp)*finish
   end function hermite_point

   !> tau_k as a vector.
   pure function tangent_at(curve, edge, k) result(tau)
      type(hermite_curve_t), intent(in) :: curve
      real(wp), intent(in) :: edge(2, 5)
      integer, intent(in) :: k
      real(wp) :: tau(2)
      integer :: i

      tau = 0.0_wp
      do i = 1, 5
         if (abs(curve%tangent(i, k)) > 0.0_wp) tau = tau + curve%tangent(i, k)*edge(:, i)
      end do
   end function tangent_at

   !> Place of the closest point: the root of F = (b - y).tau to which one comes from `s` by going
   !> down with the distance, docs/theory.md, eq. (14b). There is always one, as F falls along
   !> either straight end.
   pure subroutine hermite_closest(curve, edge, b, s, is_found)
      type(hermite_curve_t), intent(in) :: curve
      real(wp), intent(in) :: edge(2, 5)         !! as in `hermite_point` [L]
      real(wp), intent(in) :: b(2)               !! position relative to node 3
      real(wp), intent(inout) :: s               !! in: where to start; out: the root
      logical, intent(out) :: is_found           !! .false.: too near to the centre of curvature
      real(wp) :: low, high, f, slope, straight, next, tol
      integer :: i
      logical :: is_last

      call bracket(curve, edge, b, s, low, high)
      tol = 2.0_wp*epsilon(s)*(1.0_wp + max(abs(low), abs(high)))
      s = max(low, min(high, s))
      do i = 1, 4*digits(1.0_wp)
         call defect(curve, edge, b, s, f, slope, straight)
         if (f > 0.0_wp) then
            low = s
         else
            high = s
         end if
         next = 0.5_wp*(low + high)
         is_last = slope < 0.0_wp .and. abs(f) <= -tol*slope
         if (is_last .or. (slope < 0.0_wp .and. s*slope - f < low*slope .and. &
            s*slope - f > high*slope)) next = s - f/slope
         is_last = is_last .or. high - low <= tol
         s = next
         if (is_last) exit
      end do
      ! So that all pieces agree on which side of their ends it is.
      s = (s + 2.0_wp) - 2.0_wp
      call defect(curve, edge, b, s, f, slope, straight)
      is_found = straight > smallest_square*curve%length(3) .and. slope < -focal_limit*straight
   end subroutine hermite_closest

   !> F, its derivative by s, and what the latter is, with the other sign, on a straight curve.
   pure subroutine defect(curve, edge, b, s, f, slope, straight)
      type(hermite_curve_t), intent(in) :: curve
      real(wp), intent(in) :: edge(2, 5), b(2), s
      real(wp), intent(out) :: f, slope, straight
      type(hermite_point_t) :: p

      p = hermite_point(curve, edge, s)
      f = dot_product(b - p%y, p%tangent)
      straight = p%length*dot_product(p%tangent, p%tangent)
      slope = dot_product(b - p%y, p%bend) - straight
   end subroutine defect

   !> Places `low` and `high` around `s`, or beside it, with F(low) >= 0 >= F(high).
   pure subroutine bracket(curve, edge, b, s, low, high)
      type(hermite_curve_t), intent(in) :: curve
      real(wp), intent(in) :: edge(2, 5), b(2), s
      real(wp), intent(out) :: low, high
      real(wp) :: f, slope, straight, direction, range(2), here, next
      integer :: i

      call defect(curve, edge, b, s, f, slope, straight)
      direction = sign(1.0_wp, f)
      range = real([curve%first - 3, curve%last - 2], wp)      ! the curve is straight beyond it
      if (direction < 0.0_wp) range = -range([2, 1])
      here = direction*s
      next = here
      do i = 1, 2 + ceiling((range(2) - range(1))/search_step)
         if (here >= range(2)) then
            next = here + 2.0_wp*abs(f)/max(straight, smallest_square*curve%length(3))
            exit
         end if
         next = max(range(1), min(here + search_step, range(2)))
         call defect(curve, edge, b, direction*next, f, slope, straight)
         if (direction*f <= 0.0_wp) exit
         here = next
      end do
      low = min(direction*here, direction*next)
      high = max(direction*here, direction*next)
   end subroutine bracket

   !> The curve from `s0` to `s1`, exact also where that goes through several pieces; pieces outside
   !> do not appear. A place at the end of a piece is in both: where s comes to rest at a node,
   !> rounding must not choose one of them.
   pure function hermite_weights(curve, s0, s1) result(w)
      type(hermite_curve_t), intent(in) :: curve
      real(wp), intent(in) :: s0, s1             !! places on the curve at start and end
      type(hermite_weights_t) :: w
      type(dg_t) :: s
      integer :: e, i, e_last

      s = dg_variable(1, s0, s1 - s0)
      w%base = piece_of(curve, 2 + ceiling(held(min(s0, s1) - at_end)))
      e_last = piece_of(curve, 3 + floor(held(max(s0, s1) + at_end)))
      do i = 1, 5
         if (.not. any(abs(curve%tangent(i, w%base:e_last + 1)) > 0.0_wp)) cycle
         w%n = w%n + 1
         w%edge(w%n) = i
         w%t(w%n) = dg_constant(curve%tangent(i, w%base))
      end do
      do e = w%base, e_last
         call add_piece(curve, e, s + real(3 - e, wp), w)
      end do
      if (min(s0, s1) <= real(curve%first - 3, wp) + at_end) then
         call add_straight(curve, w%base, dg_negative_part(s + real(3 - w%base, wp), at_end), w)
      end if
      if (max(s0, s1) >= real(curve%last - 2, wp) - at_end) then
         call add_straight(curve, e_last + 1, &
            -dg_negative_part(-(s + real(2 - e_last, wp)), at_end), w)
      end if
   end function hermite_weights

   !> `s` within the range of numbers of pieces.
   pure real(wp) function held(s)
      real(wp), intent(in) :: s

      held = max(-2.0_wp, min(3.0_wp, s))
   end function held

   !> Reference length from node 3 to the place `s`, < 0 before it; over `joined_pieces`.
   pure real(wp) function hermite_distance(curve, s) result(distance)
      type(hermite_curve_t), intent(in) :: curve
      real(wp), intent(in) :: s                  !! place on the curve

      associate (l => curve%length)
         distance = l(3)*s + (l(curve%first) - l(3))*min(s, 0.0_wp) &
            - (l(curve%last) - l(3))*min(1.0_wp - s, 0.0_wp)
      end associate
   end function hermite_distance

   pure integer function piece_of(curve, e)
      type(hermite_curve_t), intent(in) :: curve
      integer, intent(in) :: e

      piece_of = max(curve%first, min(curve%last, e))
   end function piece_of

   !> Add what y and tau gain from the start of piece `e` to `eta` held within 0..1.
   pure subroutine add_piece(curve, e, eta, w)
      type(hermite_curve_t), intent(in) :: curve
      integer, intent(in) :: e
      type(dg_t), intent(in) :: eta
      type(hermite_weights_t), intent(inout) :: w
      type(dg_t) :: z, square, cube, chord
      real(wp) :: a, b, l
      integer :: i

      z = (dg_negative_part(eta + (-1.0_wp), at_end) - dg_negative_part(eta, at_end)) + 1.0_wp
      square = z*z
      cube = square*z
      chord = z - square
      l = curve%length(e)
      do i = 1, w%n
         a = curve%tangent(w%edge(i), e)
         b = curve%tangent(w%edge(i), e + 1)
         w%y(i) = w%y(i) + (l*a)*z - (l*(2.0_wp*a + b))*square + (l*(a + b))*cube
         w%t(i) = w%t(i) - (4.0_wp*a + 2.0_wp*b)*z + (3.0_wp*(a + b))*square
         if (w%edge(i) /= e) cycle
         w%y(i) = w%y(i) + 3.0_wp*square - 2.0_wp*cube
         w%t(i) = w%t(i) + (6.0_wp/l)*chord
      end do
   end subroutine add_piece

   !> Add the straight end at node `k`, followed over `way` times the length of its piece.
   pure subroutine add_straight(curve, k, distance, w)
      type(hermite_curve_t), intent(in) :: curve
      integer, intent(in) :: k
      type(dg_t), intent(in) :: distance
      type(hermite_weights_t), intent(inout) :: w
      integer :: i, e

      e = merge(k, k - 1, k == curve%first)
      do i = 1, w%n
         w%y(i) = w%y(i) + (curve%length(e)*curve%tangent(w%edge(i), k))*distance
      end do
   end subroutine add_straight

end module emcon_hermite
