!> Integrals over a pair of edges: values, identity, momenta, derivatives, closed forms.
module test_mortar_pair
   use check, only : check_near, check_true, test_case_t
   use emcon_chain_plane, only : chain_t
   use emcon_dgrad11, only : dg11_t => dg_t
   use emcon_dgrad15, only : dg15_t => dg_t
   use emcon_dgrad_nodes, only : nodes_add_first, nodes_add_second
   use emcon_errors, only : error_t
   use emcon_gauss, only : gauss_points
   use emcon_kinds, only : wp
   use emcon_mortar_frame, only : end_rounding, frame_hit, frame_cover, frame_init, &
      frame_point, frame_project, frame_t, moment_area, moment_area_xi, moment_cover, moment_gap, &
      moment_gap_xi, n_moment, n_place, pair_stencil_t
   use emcon_mortar_pair2, only : segment_moments2 => segment_moments
   use emcon_mortar_pair4, only : point_gap, segment_moments4 => segment_moments
   use emcon_mortar_stencil, only : frame_faces, stencil_master, stencil_slave
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   use small_scenes, only : shake
   implicit none
   private
   public :: collect_mortar_pair

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Some 500 roundings of quantities of the size that is named beside it.
   real(wp), parameter :: tol = 512.0_wp*eps
   !> Slave edge, master edge, nodes before and after the slave, before and after the master edge;
   !> the slave body is above, the master body below.
   real(wp), parameter :: flat(2, n_place) = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
      0.5_wp, 0.0_wp, -0.5_wp, 0.0_wp, -0.9_wp, 0.0_wp, 2.1_wp, 0.0_wp, &
      1.4_wp, 0.0_wp, -1.6_wp, 0.0_wp], [2, n_place])
   integer, parameter :: master_side(4) = [3, 4, 7, 8]
   !> Kinds of pairs. Segments of polygons: normal of the edge; averaged at both, the first, the
   !> last end. Segments of smoothed edges: normal of the edge; averaged; an end; corners. Gauss
   !> points: normal of the edge; averaged; end of the surface; smoothed.
   integer, parameter :: n_kind = 12, last_polygon = 4, last_segment = 8
   character(len=26), parameter :: name(n_kind) = [character(len=26) :: "edge normal", "averaged", &
      "averaged at the first", "averaged at the last", "smoothed, edge normal", &
      "smoothed, averaged", "smoothed, end", "smoothed, corners", "point, edge normal", &
      "point, averaged", "point, end", "point, smoothed"]
   real(wp), parameter :: fixed_xi = 0.3_wp

   !> A number of either arithmetic, by nodes.
   type :: number_t
      real(wp) :: f0 = 0.0_wp, f1 = 0.0_wp, df = 0.0_wp
      real(wp) :: g(2, n_place) = 0.0_wp, c(2, n_place) = 0.0_wp
      real(wp) :: h(2*n_place, 2*n_place) = 0.0_wp
      real(wp) :: of_root = 0.0_wp               !! largest component of the unknown of roots
   end type number_t

contains

   subroutine collect_mortar_pair(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("parallel edges, half covered", test_parallel), &
         test_case_t("inclined edges", test_inclined), &
         test_case_t("fan of normals over a line", test_fan), &
         test_case_t("smoothed over a line", test_smooth_line), &
         test_case_t("cut master edge", test_refined), &
         test_case_t("values and identity", test_identity), &
         test_case_t("tiny steps", test_tiny), &
         test_case_t("momenta", test_momenta), &
         test_case_t("gradient and second derivatives", test_derivatives), &
         test_case_t("rigid motions", test_rigid), &
         test_case_t("nodes that stand opposite", test_opposite), &
         test_case_t("continuous as nodes pass", test_passing), &
         test_case_t("points at corners of the master surface", test_point_corner)]
   end subroutine collect_mortar_pair

   ! ---- what is tested -------------------------------------------------------------------------

   !> Stencil over nodes numbered as their places, with distances in `flat` as reference lengths.
   pure function stencil_of(kind) result(stencil)
      integer, intent(in) :: kind
      type(pair_stencil_t) :: stencil
      type(chain_t) :: slave, master
      logical :: is_corner(3)

      slave = chain_of([5, 1, 2, 6])
      master = chain_of([7, 3, 4, 8])
      is_corner = [.true., .false., .false.]
      if (kind == 3) is_corner(3) = .true.
      if (kind == 4 .or. kind == 8) is_corner(2) = .true.
      call stencil_slave(stencil, slave, 2, all(kind /= [1, 5, 9]), is_corner)
      is_corner = [.true., kind == 8, kind == 8]
      if (kind == 7) master%neighbour(1, 2) = 0
      if (kind == 7) is_corner(2) = .true.
      if (kind == 11) master%neighbour(2, 2) = 0
      call stencil_master(stencil, master, 2, (kind > last_polygon .and. kind <= last_segment) &
         .or. kind == 12, kind > last_segment, is_corner)
   end function stencil_of

   pure function chain_of(node) result(chain)
      integer, intent(in) :: node(4)
      type(chain_t) :: chain

      chain%n_facet = 3
      allocate(chain%facet, source=reshape(node([1, 2, 2, 3, 3, 4]), [2, 3]))
      allocate(chain%neighbour, source=reshape([0, 2, 1, 3, 2, 0], [2, 3]))
      allocate(chain%size, source=abs(flat(1, node(2:)) - flat(1, node(:3))))
   end function chain_of

   !> Moments of a segment, or gap at a point and length of the edge, in the arithmetic.
   pure subroutine evaluate(kind, stencil, x0, dx, number)
      integer, intent(in) :: kind
      type(pair_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x0(:, :), dx(:, :)
      type(number_t), allocatable, intent(out) :: number(:)
      type(dg11_t) :: few(n_moment)
      type(dg15_t) :: many(n_moment)
      real(wp) :: point(2), weight(2)
      logical :: is_covering
      integer :: i

      call gauss_points(point, weight)
      allocate(number(merge(n_moment, 2, kind <= last_segment)))
      is_covering = .true.
      if (kind <= last_polygon) then
         call segment_moments2(stencil, x0, dx, point, weight, few, is_covering)
      else if (kind <= last_segment) then
         call segment_moments4(stencil, x0, dx, point, weight, many, is_covering)
      else
         call point_gap(stencil, x0, dx, fixed_xi, many(1), many(2))
      end if
      if (.not. is_covering) return
      do i = 1, size(number)
         if (kind <= last_polygon) then
            call take(few(i)%f0, few(i)%f1, few(i)%df, few(i)%g, few(i)%c, few(i)%h, number(i))
         else
            call take(many(i)%f0, many(i)%f1, many(i)%df, many(i)%g, many(i)%c, many(i)%h, &
               number(i))
         end if
      end do
   end subroutine evaluate

   pure subroutine take(f0, f1, df, g, c, h, number)
      real(wp), intent(in) :: f0, f1, df, g(:), c(:), h(:, :)
      type(number_t), intent(inout) :: number
      integer, parameter :: in_order(n_place) = [1, 2, 3, 4, 5, 6, 7, 8]
      integer :: n

      n = size(g) + 1                             ! coordinates; one variable is the root
      number%f0 = f0
      number%f1 = f1
      number%df = df
      call nodes_add_first(1.0_wp, g, in_order(:n/2), number%g)
      call nodes_add_first(1.0_wp, c, in_order(:n/2), number%c)
      call nodes_add_second(1.0_wp, 2, h, in_order(:n/2), number%h)
      associate (root => size(g))
         number%of_root = maxval(abs([g(root), c(root), h(root, :), h(:, root)]))
      end associate
   end subroutine take

   !> The same of one configuration, as plain values.
   pure function values_of(kind, stencil, x) result(value)
      integer, intent(in) :: kind
      type(pair_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x(:, :)
      real(wp), allocatable :: value(:)
      type(frame_t) :: frame
      real(wp) :: eta, gap

      if (kind <= last_segment) then
         allocate(value(n_moment))
         value = moments(stencil, x, 2)
      else
         call frame_init(frame, stencil, x)
         call frame_point(frame, stencil, fixed_xi, eta, gap)
         allocate(value(2))
         value = [gap, frame%length]
      end if
   end function values_of

   pure function moments(stencil, x, n_point) result(value)
      type(pair_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: n_point
      real(wp) :: value(n_moment), point(n_point), weight(n_point), low, high, eta, gap
      type(frame_t) :: frame
      integer :: i

      call gauss_points(point, weight)
      call frame_init(frame, stencil, x)
      value = 0.0_wp
      call frame_cover(frame, low, high)
      if (.not. high > low) return
      do i = 1, n_point
         associate (xi => low + (high - low)*point(i))
            call frame_hit(frame, stencil, xi, eta, gap)
            value = value + weight(i)*(high - low)*[frame%length*[gap, gap*xi, 1.0_wp, xi], 1.0_wp]
         end associate
      end do
   end function moments

   !> Part of the slave edge that the master edge covers: > 0 only if it does.
   pure real(wp) function width_of(stencil, x)
      type(pair_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x(:, :)
      type(frame_t) :: frame

      call frame_init(frame, stencil, x)
      width_of = min(1.0_wp, frame_project(frame, 1)) - max(0.0_wp, frame_project(frame, 2))
   end function width_of

   !> Are the ends of the slave edge covered, and is anything of it? Of a point: on which side of
   !> the ends of the master edge does it lie?
   pure function ends_of(kind, stencil, x) result(is_within)
      integer, intent(in) :: kind
      type(pair_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x(:, :)
      logical :: is_within(3)
      type(frame_t) :: frame
      real(wp) :: eta, gap

      call frame_init(frame, stencil, x)
      if (kind <= last_segment) then
         is_within = [frame_project(frame, 1) > 1.0_wp, frame_project(frame, 2) < 0.0_wp, &
            width_of(stencil, x) > 0.0_wp]
      else
         call frame_point(frame, stencil, fixed_xi, eta, gap)
         is_within = [eta > 0.0_wp, eta < 1.0_wp, .true.]
      end if
   end function ends_of

   !> Does a segment end where its bounds are rounded, or beside it?
   pure logical function meets_bend(kind, stencil, x)
      integer, intent(in) :: kind
      type(pair_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x(:, :)
      type(frame_t) :: frame
      integer :: k

      meets_bend = .false.
      if (kind > last_segment) return
      call frame_init(frame, stencil, x)
      do k = 1, 2
         associate (xi => frame_project(frame, k))
            meets_bend = meets_bend .or. min(abs(xi), abs(1.0_wp - xi)) < 2.0_wp*end_rounding
         end associate
      end do
   end function meets_bend

   ! ---- cases ----------------------------------------------------------------------------------

   !> A pair with edges of ratio 1/`ratio` to `ratio`, slave and master bent, turned at random, and
   !> a step that shears and stretches by up to 0.4, turns by up to 0.7 and slides by more than the
   !> edges, all times `motion`. Only such steps in which the edges face each other at both ends.
   subroutine draw(kind, ratio, motion, stencil, x0, dx)
      integer, intent(in) :: kind
      real(wp), intent(in) :: ratio, motion
      type(pair_stencil_t), intent(out) :: stencil
      real(wp), intent(out) :: x0(2, n_place), dx(2, n_place)
      real(wp) :: u(6), map(2, 2), move(2, n_place), length, slide
      type(frame_t) :: frame(2)
      integer :: k

      stencil = stencil_of(kind)
      do
         call draw_random(u)
         length = ratio**(2.0_wp*u(1) - 1.0_wp)
         call shake(x0, 0.12_wp)
         x0(:, master_side) = length*(flat(:, master_side) + x0(:, master_side))
         x0(1, master_side) = x0(1, master_side) + 0.5_wp + (2.0_wp + 1.5_wp*length) &
            *(u(2) - 0.5_wp)
         x0(2, master_side) = x0(2, master_side) - 0.4_wp*(u(3) - 0.3_wp)
         x0(:, [1, 2, 5, 6]) = flat(:, [1, 2, 5, 6]) + x0(:, [1, 2, 5, 6])
         x0 = turned(6.0_wp*u(4), x0)
         call shake(map, 0.4_wp)
         call shake(dx, 0.05_wp*min(1.0_wp, length))
         slide = 2.0_wp*(u(5) - 0.5_wp)*(0.3_wp + length)
         move = spread(slide*[cos(6.0_wp*u(4)), sin(6.0_wp*u(4))], 2, n_place)
         move(:, [1, 2, 5, 6]) = 0.0_wp
         dx = dx + move + matmul(map, x0) + turned(1.4_wp*(u(6) - 0.5_wp), x0) - x0
         dx = motion*dx
         call frame_init(frame(1), stencil, x0)
         call frame_init(frame(2), stencil, x0 + dx)
         do k = 1, 2
            if (.not. is_facing(stencil, frame(k))) exit
         end do
         if (k > 2) exit
      end do
   end subroutine draw

   pure logical function is_facing(stencil, frame)
      type(pair_stencil_t), intent(in) :: stencil
      type(frame_t), intent(in) :: frame

      is_facing = frame_faces(frame, 1, 2) .and. minval(frame%edge_along) > 0.0_wp
      if (stencil%node(7) > 0) is_facing = is_facing .and. frame_faces(frame, 3, 1)
      if (stencil%node(8) > 0) is_facing = is_facing .and. frame_faces(frame, 2, 4)
   end function is_facing

   pure function turned(angle, x) result(y)
      real(wp), intent(in) :: angle, x(:, :)
      real(wp) :: y(2, size(x, 2))

      y(1, :) = cos(angle)*x(1, :) - sin(angle)*x(2, :)
      y(2, :) = sin(angle)*x(1, :) + cos(angle)*x(2, :)
   end function turned

   !> A slave edge from the origin along x, with normals downwards, over a master edge from `right`
   !> to `left`; neighbours straight on.
   pure function over(right, left) result(x)
      real(wp), intent(in) :: right(2), left(2)
      real(wp) :: x(2, n_place)

      x = flat
      x(:, 3) = right
      x(:, 4) = left
      x(:, 7) = 2.0_wp*right - left
      x(:, 8) = 2.0_wp*left - right
   end function over

   ! ---- closed forms ---------------------------------------------------------------------------

   !> Slave edge 3 long, 2 apart, the half with 1/2 < xi covered.
   subroutine test_parallel(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x(2, n_place), expected(n_moment)
      integer :: i, kind

      expected([moment_gap, moment_gap_xi, moment_area, moment_area_xi, moment_cover]) = [3.0_wp, &
         2.25_wp, 1.5_wp, 1.125_wp, 0.5_wp]
      x = 3.0_wp*over([1.5_wp, -2.0_wp/3.0_wp], [0.5_wp, -2.0_wp/3.0_wp])
      do kind = 1, last_segment
         do i = 0, 9
            call check_near(error, moments(stencil_of(kind), turned(0.7_wp*real(i, wp), x), 2), &
               expected, tol, 10.0_wp, "moments, " // trim(name(kind)))
         end do
      end do
   end subroutine test_parallel

   !> Normals along y over the line y = -(1 + x)/2 between x = 1/4 and 3/4 or beyond the end.
   subroutine test_inclined(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: low(3) = [0.25_wp, -0.5_wp, 0.25_wp], high(3) = [0.75_wp, 0.75_wp, &
         1.5_wp]
      real(wp) :: x(2, n_place), expected(n_moment), a, b
      integer :: i, kind

      do i = 1, 3
         a = max(0.0_wp, low(i))
         b = min(1.0_wp, high(i))
         expected(moment_gap) = 0.5_wp*(b - a) + 0.25_wp*(b**2 - a**2)
         expected(moment_gap_xi) = 0.25_wp*(b**2 - a**2) + (b**3 - a**3)/6.0_wp
         expected(moment_area) = b - a
         expected(moment_area_xi) = 0.5_wp*(b**2 - a**2)
         expected(moment_cover) = b - a
         x = over([high(i), -0.5_wp*(1.0_wp + high(i))], [low(i), -0.5_wp*(1.0_wp + low(i))])
         do kind = 1, last_segment
            call check_near(error, moments(stencil_of(kind), x, 2), expected, tol, 10.0_wp, &
               "moments, " // trim(name(kind)) // " " // to_text(i))
         end do
      end do
   end subroutine test_inclined

   !> Slave surface bent up at both ends by the same angle: t(xi) = (c, s (1 - 2 xi)), gap d |t|/c
   !> over a parallel line. Ten points are exact for a slope s/c of some 0.1.
   subroutine test_fan(error)
      type(error_t), allocatable, intent(out) :: error
      type(pair_stencil_t) :: stencil
      real(wp) :: x(2, n_place), value(n_moment), slope, total, rho, missed
      integer :: i

      stencil = stencil_of(2)
      do i = 1, 5
         x = over([3.0_wp, -0.5_wp], [-3.0_wp, -0.5_wp])
         x(:, 5) = [-0.9_wp, 0.1_wp*real(i, wp)*0.95_wp]
         x(:, 6) = [2.0_wp, 0.1_wp*real(i, wp)]
         slope = 0.1_wp*real(i, wp)/2.0_wp
         ! t1 is 1.9/1.9 long along x, t2 2/2.1: equal weights make the fan symmetric.
         stencil%weight = 1.0_wp/[1.9_wp, 2.0_wp]
         value = moments(stencil, x, 10)
         total = sqrt(1.0_wp + slope**2) + asinh(slope)/slope
         ! What Gauss's rule of n points misses of sqrt(1 + (slope x)^2), singular at i/slope, in
         ! the ellipse up to there: 64/15 max/((1 - rho^-2) rho^(2 n)).
         rho = 1.0_wp/slope + sqrt(1.0_wp/slope**2 + 1.0_wp)
         missed = 64.0_wp/15.0_wp*sqrt(2.0_wp)/((1.0_wp - rho**(-2))*rho**20)
         call check_near(error, value(moment_gap), 0.25_wp*total, tol + missed, 1.0_wp, "gap")
         call check_near(error, value(moment_gap_xi), 0.125_wp*total, tol + missed, 1.0_wp, &
            "gap, first")
      end do
   end subroutine test_fan

   !> Equally divided straight master surfaces: the cubic is the line, whatever the neighbours.
   subroutine test_smooth_line(error)
      type(error_t), allocatable, intent(out) :: error
      type(pair_stencil_t) :: stencil(2)
      real(wp) :: x(2, n_place)
      integer :: i, kind

      do kind = 5, last_segment
         stencil(1) = stencil_of(kind)
         stencil(2) = stencil(1)
         stencil(2)%is_smooth = .false.
         stencil(2)%n_master = 2
         do i = 0, 20
            x = over([1.3_wp - 0.05_wp*real(i, wp), -0.3_wp], [0.6_wp - 0.05_wp*real(i, wp), &
               0.1_wp])
            x(2, 5:6) = 0.2_wp
            call check_near(error, moments(stencil(1), x, 3), moments(stencil(2), x, 3), tol, &
               1.0_wp, "moments, " // trim(name(kind)))
         end do
      end do
   end subroutine test_smooth_line

   !> A straight master edge in pieces of different length gives what it gives as one.
   subroutine test_refined(error)
      type(error_t), allocatable, intent(out) :: error
      type(pair_stencil_t) :: stencil
      real(wp) :: x(2, n_place), y(2, n_place), total(n_moment), cut(0:6), right(2), left(2)
      real(wp) :: u(4)
      integer :: i, k, kind, n_point

      do i = 1, 100
         kind = merge(1, 2, mod(i, 2) == 0)
         n_point = merge(2, 10, kind == 1)       ! the fan of normals is no polynomial
         stencil = stencil_of(kind)
         call draw_random(u)
         right = [0.2_wp + 1.2_wp*u(1), -0.3_wp*u(2)]
         left = [-1.0_wp + 1.1_wp*u(3), -0.3_wp*u(4)]
         x = over(right, left)
         x(2, 5:6) = 0.1_wp
         call draw_random(cut)
         cut(0) = 0.0_wp
         do k = 1, 6
            cut(k) = cut(k - 1) + cut(k)
         end do
         cut = cut/cut(6)
         total = 0.0_wp
         do k = 1, 6
            y = x
            y(:, 3) = right + cut(k - 1)*(left - right)
            y(:, 4) = right + cut(k)*(left - right)
            total = total + moments(stencil, y, n_point)
         end do
         call check_near(error, total, moments(stencil, x, n_point), tol, 1.0_wp, "sum, " &
            // trim(name(kind)))
      end do
   end subroutine test_refined

   ! ---- steps ----------------------------------------------------------------------------------

   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      type(pair_stencil_t) :: stencil
      type(number_t), allocatable :: number(:)
      real(wp) :: x0(2, n_place), dx(2, n_place), width(2)
      real(wp), allocatable :: value0(:), value1(:)
      integer :: i, k, kind, n_opened, n_closed, n_passed

      do kind = 1, n_kind
         n_opened = 0
         n_closed = 0
         n_passed = 0
         do i = 1, 150
            call draw(kind, 10.0_wp, 1.0_wp, stencil, x0, dx)
            call evaluate(kind, stencil, x0, dx, number)
            value0 = values_of(kind, stencil, x0)
            value1 = values_of(kind, stencil, x0 + dx)
            width = [width_of(stencil, x0), width_of(stencil, x0 + dx)]
            if (width(1) < 0.0_wp .and. width(2) > 0.0_wp) n_opened = n_opened + 1
            if (width(1) > 0.0_wp .and. width(2) < 0.0_wp) n_closed = n_closed + 1
            if (passes(stencil, x0, dx)) n_passed = n_passed + 1
            do k = 1, size(number)
               associate (a => number(k), moved => sum(abs(number(k)%g*dx)))
                  call check_near(error, [a%f0, a%f1], [value0(k), value1(k)], tol, &
                     1.0_wp + moved, "values " // to_text(k) // ", " // trim(name(kind)))
                  call check_near(error, a%df, value1(k) - value0(k), tol, 1.0_wp + moved, &
                     "increment " // to_text(k) // ", " // trim(name(kind)))
                  call check_near(error, sum(a%g*dx), a%df, tol, moved, "identity " &
                     // to_text(k) // ", " // trim(name(kind)))
                  call check_near(error, a%of_root, 0.0_wp, 0.0_wp, 1.0_wp, "no variable")
               end associate
            end do
            if (allocated(error)) return
         end do
         if (kind > last_segment) cycle
         call check_true(error, min(n_opened, n_closed, n_passed) > 7, "steps that open, close, " &
            // "pass: " // to_text(n_opened) // " " // to_text(n_closed) // " " &
            // to_text(n_passed))
      end do
   end subroutine test_identity

   !> Does a master node pass a slave node in the step?
   pure logical function passes(stencil, x0, dx)
      type(pair_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x0(:, :), dx(:, :)
      type(frame_t) :: frame(2)
      real(wp) :: s(2)
      integer :: k

      call frame_init(frame(1), stencil, x0)
      call frame_init(frame(2), stencil, x0 + dx)
      passes = .false.
      do k = 1, 2
         s = [frame_project(frame(1), k), frame_project(frame(2), k)]
         passes = passes .or. product(s) < 0.0_wp .or. product(s - 1.0_wp) < 0.0_wp
      end do
   end function passes

   !> Down to the smallest motions, g.dx = df, and g is the gradient once dx is below round-off.
   subroutine test_tiny(error)
      type(error_t), allocatable, intent(out) :: error
      type(pair_stencil_t) :: stencil
      type(number_t), allocatable :: number(:)
      real(wp) :: x0(2, n_place), dx(2, n_place)
      integer :: kind, i, k, last

      last = -minexponent(1.0_wp) - 16
      do kind = 1, n_kind
         do i = 1, last, 6
            call draw(kind, 10.0_wp, scale(1.0_wp, -i), stencil, x0, dx)
            call evaluate(kind, stencil, x0, dx, number)
            do k = 1, size(number)
               associate (a => number(k))
                  call check_near(error, sum(a%g*dx), a%df, tol, sum(abs(a%g*dx)), &
                     "g.dx at 2^-" // to_text(i) // ", " // trim(name(kind)))
                  if (i < digits(1.0_wp) + 8) cycle
                  call check_near(error, a%g, a%c, tol, maxval(abs(a%c)), &
                     "g = c at 2^-" // to_text(i) // ", " // trim(name(kind)))
               end associate
            end do
         end do
      end do
   end subroutine test_tiny

   subroutine test_momenta(error)
      type(error_t), allocatable, intent(out) :: error
      type(pair_stencil_t) :: stencil
      type(number_t), allocatable :: number(:)
      real(wp) :: x0(2, n_place), dx(2, n_place), mid(2, n_place)
      integer :: i, k, kind

      do kind = 1, n_kind
         do i = 1, 100
            call draw(kind, 10.0_wp, 1.0_wp, stencil, x0, dx)
            mid = x0 + 0.5_wp*dx
            call evaluate(kind, stencil, x0, dx, number)
            do k = 1, size(number)
               associate (g => number(k)%g)
                  call check_near(error, sum(g, dim=2), [0.0_wp, 0.0_wp], tol, sum(abs(g)), &
                     "linear, " // trim(name(kind)))
                  call check_near(error, sum(mid(1, :)*g(2, :) - mid(2, :)*g(1, :)), 0.0_wp, tol, &
                     sum(abs(g))*maxval(abs(mid)), "angular, " // trim(name(kind)))
               end associate
            end do
         end do
      end do
   end subroutine test_momenta

   !> c against differences of the value, h against those of g, with steps of eps^(1/3): errors of
   !> eps^(2/3) times third derivatives, and of the round-off eps over the step. What varies as r^-n
   !> with the length r > 1/4 of an edge or field has a third derivative of (n + 1)(n + 2)/r^2, some
   !> hundreds, times the first. No differences across the ends of edges, where gradients or
   !> curvatures jump.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      type(pair_stencil_t) :: stencil
      type(number_t), allocatable :: number(:), up(:), down(:)
      real(wp) :: x0(2, n_place), dx(2, n_place), way(2, n_place), step, bound, size_h
      real(wp) :: c(2*n_place)
      integer :: i, j, k, kind, n_checked
      logical :: crosses

      bound = 4.0e2_wp*eps**(2.0_wp/3.0_wp)
      do kind = 1, n_kind
         n_checked = 0
         do i = 1, 24
            call draw(kind, 2.0_wp, merge(1.0_wp, 1.0e-6_wp, mod(i, 3) > 0), stencil, x0, dx)
            call evaluate(kind, stencil, x0, dx, number)
            ! Where bounds bend third derivatives grow by 1/width^2: what steps and round-off leave
            ! grows alike, by width^(-2/3).
            step = eps**(1.0_wp/3.0_wp)
            if (meets_bend(kind, stencil, x0) .or. meets_bend(kind, stencil, x0 + dx)) then
               step = step*end_rounding**(2.0_wp/3.0_wp)
            end if
            do j = 1, 2*n_place
               way = reshape([(merge(step, 0.0_wp, k == j), k = 1, 2*n_place)], [2, n_place])
               call evaluate(kind, stencil, x0, dx + way, up)
               call evaluate(kind, stencil, x0, dx - way, down)
               crosses = any(ends_of(kind, stencil, x0 + dx + way) &
                  .neqv. ends_of(kind, stencil, x0 + dx - way))
               do k = 1, size(number)
                  if (crosses) cycle
                  n_checked = n_checked + 1
                  size_h = maxval(abs(number(k)%h)) + maxval(abs(number(k)%g)) + 1.0_wp
                  c = reshape(number(k)%c, [2*n_place])
                  call check_near(error, c(j), (up(k)%f1 - down(k)%f1)/(2.0_wp*step), bound, &
                     size_h, "gradient " // to_text(k) // ", " // trim(name(kind)))
                  call check_near(error, number(k)%h(:, j), reshape((up(k)%g - down(k)%g) &
                     /(2.0_wp*step), [2*n_place]), bound, size_h, &
                     "column " // to_text(j) // " of " // to_text(k) // ", " // trim(name(kind)))
               end do
            end do
            if (allocated(error)) return
         end do
         call check_true(error, n_checked > 320*size(number), "most columns are compared: " &
            // to_text(n_checked))
      end do
   end subroutine test_derivatives

   !> A step that only turns and moves everything: no change.
   subroutine test_rigid(error)
      type(error_t), allocatable, intent(out) :: error
      type(pair_stencil_t) :: stencil
      type(number_t), allocatable :: number(:)
      real(wp) :: x0(2, n_place), dx(2, n_place)
      integer :: i, k, kind

      do kind = 1, n_kind
         do i = 1, 50
            call draw(kind, 10.0_wp, 0.1_wp, stencil, x0, dx)
            dx = turned(0.05_wp*real(i, wp), x0) + 2.0_wp - x0
            call evaluate(kind, stencil, x0, dx, number)
            do k = 1, size(number)
               call check_near(error, number(k)%df, 0.0_wp, tol, 2.0_wp*sum(abs(number(k)%g)) &
                  + 1.0_wp, "increment, " // trim(name(kind)))
               call check_near(error, number(k)%f1, number(k)%f0, tol, &
                  2.0_wp*sum(abs(number(k)%g)) + 1.0_wp, "values, " // trim(name(kind)))
            end do
         end do
      end do
   end subroutine test_rigid

   ! ---- events ---------------------------------------------------------------------------------

   !> Master nodes exactly opposite or on the slave nodes, at the start, at the end, or always: all
   !> is finite, the identity holds; without overlap there is nothing.
   subroutine test_opposite(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: right(5) = [0.0_wp, 1.0_wp, 1.0_wp, 2.0_wp, 1.0_wp], &
         left(5) = [-1.0_wp, 0.0_wp, 0.5_wp, 1.0_wp, -0.5_wp]
      real(wp), parameter :: way(4) = [0.0_wp, 0.25_wp, -0.25_wp, 1.0_wp]
      type(pair_stencil_t) :: stencil
      type(number_t), allocatable :: number(:)
      real(wp) :: x(2, n_place, 2), value(n_moment, 2), depth
      integer :: i, j, k, kind, time_level

      do kind = 1, last_segment
         stencil = stencil_of(kind)
         do i = 1, 5
            do j = 1, 4
               do time_level = 1, 2
                  depth = 0.25_wp*real(mod(i + j, 2), wp)
                  x(:, :, time_level) = over([right(i), -depth], [left(i), -depth])
                  x(:, :, 3 - time_level) = x(:, :, time_level)
                  x(1, master_side, 3 - time_level) = x(1, master_side, 3 - time_level) + way(j)
                  x(2, master_side, 3 - time_level) = x(2, master_side, 3 - time_level) + 0.125_wp
                  x(2, 5:6, :) = 0.125_wp
                  call evaluate(kind, stencil, x(:, :, 1), x(:, :, 2) - x(:, :, 1), number)
                  do k = 1, 2
                     value(:, k) = moments(stencil, x(:, :, k), 2)
                  end do
                  do k = 1, n_moment
                     call check_near(error, [number(k)%f0, number(k)%f1], value(k, :), tol, &
                        1.0_wp, "values, " // trim(name(kind)))
                     call check_near(error, sum(number(k)%g*(x(:, :, 2) - x(:, :, 1))), &
                        value(k, 2) - value(k, 1), tol, 1.0_wp, "identity, " // trim(name(kind)))
                     call check_near(error, number(k)%h, 0.0_wp*number(k)%h, 1.0_wp, &
                        1.0_wp/end_rounding, "finite, " // trim(name(kind)))
                  end do
               end do
            end do
         end do
      end do
   end subroutine test_opposite

   !> Two master edges with a bend between them, just before and just behind places where one of
   !> their nodes stands opposite a slave node: the sum changes as little as the place.
   subroutine test_passing(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: tiny_way = max(1.0e-9_wp, 16.0_wp*eps)
      type(pair_stencil_t) :: stencil
      real(wp) :: x(2, n_place), y(2, n_place), total(n_moment, 2), at
      integer :: i, kind, side, node, slave_end

      do kind = 1, last_polygon
         stencil = stencil_of(kind)
         do i = 1, 20
            do node = 0, 2
               do slave_end = 0, 1
                  do side = 1, 2
                     x = over([0.9_wp, -0.3_wp], [0.1_wp, -0.2_wp])
                     y = over([0.1_wp, -0.2_wp], [-0.7_wp, -0.01_wp*real(i, wp)])
                     x(2, 5:6) = 0.2_wp
                     y(2, 5:6) = 0.2_wp
                     select case (node)
                     case (0)
                        at = opposite(stencil, x, 1, slave_end)
                     case (1)
                        at = opposite(stencil, x, 2, slave_end)
                     case default
                        at = opposite(stencil, y, 2, slave_end)
                     end select
                     at = at + real(2*side - 3, wp)*tiny_way
                     x(1, master_side) = x(1, master_side) + at
                     y(1, master_side) = y(1, master_side) + at
                     total(:, side) = moments(stencil, x, 2) + moments(stencil, y, 2)
                  end do
                  call check_near(error, total(:, 2), total(:, 1), 10.0_wp*tiny_way, 1.0_wp, &
                     "sum, " // trim(name(kind)))
                  call check_true(error, any(abs(total(:, 2) - total(:, 1)) > 0.0_wp) &
                     .or. maxval(abs(total)) <= 0.0_wp, "both sides")
               end do
            end do
         end do
      end do
   end subroutine test_passing

   !> How far a master node goes along x until it stands opposite the slave end 0 or 1 at x = 0, 1.
   pure real(wp) function opposite(stencil, x, node, slave_end) result(way)
      type(pair_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: node                !! 1, 2: of the master edge
      integer, intent(in) :: slave_end
      type(frame_t) :: frame

      call frame_init(frame, stencil, x)
      associate (q => frame%edge_along(1 + slave_end))
         way = real(slave_end, wp) - frame%along(1 + slave_end, node)/q
      end associate
   end function opposite

   !> A slave point passes the corners of a convex and of a concave master polygon: the gap goes
   !> over continuously and is what the neighbouring edge as the middle one gives; behind the corner
   !> it is the gap over the neighbour's line.
   subroutine test_point_corner(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: tiny_way = max(1.0e-9_wp, 16.0_wp*eps)
      type(pair_stencil_t) :: stencil
      real(wp) :: x(2, n_place), y(2, n_place), at, value(2), other(2), expected, bend
      integer :: i, k, kind

      do kind = 9, 10
         stencil = stencil_of(kind)
         do i = 1, 200, 3
            bend = 0.02_wp*real(mod(i, 41) - 20, wp)
            x = over([0.4_wp, -0.3_wp], [-0.6_wp, -0.3_wp])
            x(2, [7, 8]) = x(2, [7, 8]) + bend
            x(1, master_side) = x(1, master_side) + 0.01_wp*real(i - 100, wp)
            x(2, 5:6) = 0.2_wp
            value = values_of(kind, stencil, x)
            y = x
            y(:, 7) = x(:, 3)
            y(:, 3) = x(:, 4)
            y(:, 4) = x(:, 8)
            y(:, 8) = 2.0_wp*x(:, 8) - x(:, 4)
            at = frame_place(stencil, y)
            if (at < 1.0_wp .and. frame_place(stencil, x) > 0.0_wp) then
               other = values_of(kind, stencil, y)
               call check_near(error, value, other, tol, 1.0_wp, "neighbour, " // trim(name(kind)))
            end if
            if (kind == 9) then
               ! The normal is along y: the height of the polygon at x = fixed_xi.
               expected = 0.3_wp - bend*max(0.0_wp, x(1, 4) - fixed_xi) &
                  - bend*max(0.0_wp, fixed_xi - x(1, 3))
               call check_near(error, value(1), expected, tol, 1.0_wp, "height")
            end if
            do k = 1, 2
               y = x
               y(1, master_side) = y(1, master_side) + fixed_xi - x(1, 2 + k)
               value = values_of(kind, stencil, y)
               y(1, master_side) = y(1, master_side) + tiny_way
               other = values_of(kind, stencil, y)
               call check_near(error, other, value, 10.0_wp*tiny_way, 1.0_wp, "passing")
            end do
         end do
      end do
   end subroutine test_point_corner

   !> Place on the master edge that the fixed point looks at.
   pure real(wp) function frame_place(stencil, x)
      type(pair_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x(:, :)
      type(frame_t) :: frame
      real(wp) :: gap

      call frame_init(frame, stencil, x)
      call frame_hit(frame, stencil, fixed_xi, frame_place, gap)
   end function frame_place

end module test_mortar_pair
