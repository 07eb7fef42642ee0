!> Discrete-gradient arithmetic: identity, relative accuracy, limits, derivatives, momenta.
module test_dgrad
   use check, only : check_near, check_true, test_case_t
   use emcon_dgrad8, only : dg8_t => dg_t, dg_cross, dg_dot, difference
   use emcon_dgrad3, only : dg_abs, dg_clip, dg_constant, dg_excess, dg_expm1, dg_log1p, &
      dg_above_negative, &
      dg_negative_part, dg_root, dg_sqrt, dg_t, dg_variable, operator(*), operator(+), &
      operator(-), operator(/)
   use emcon_dgrad_nodes, only : nodes_add_first
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   use referee, only : increment_doubt, increment_of, qp, slope_doubt, slopes_of
   implicit none
   private
   public :: collect_dgrad

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Operations under test; the last one chains most of the others.
   integer, parameter :: n_operation = 17
   character(len=14), parameter :: name(n_operation) = [character(len=14) :: "a + b", "a + 1", &
      "-a", "a - b", "3 a", "a b", "a/b", "sqrt", "abs", "negative part", "rounded corner", &
      "log1p", "excess, expm1", "clip", "rounded clip", "from above", "composite"]

   !> Of the rounded corner, and of the rounded clip: some of the places drawn are in its bands.
   real(wp), parameter :: width = 1.0_wp, clip_width = 0.375_wp

contains

   subroutine collect_dgrad(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("identity on random data", test_identity), &
         test_case_t("identity across a change of sign", test_change_of_sign), &
         test_case_t("increments from 1 to the smallest", test_small_increments), &
         test_case_t("limit is the gradient", test_limit), &
         test_case_t("gradient at the end", test_gradient), &
         test_case_t("second derivatives", test_second_derivatives), &
         test_case_t("second derivatives across a change of sign", test_second_across), &
         test_case_t("clip across its bounds", test_clip), &
         test_case_t("clip with rounded corners across its bounds", test_rounded_clip), &
         test_case_t("negative part with a rounded corner", test_rounded_corner), &
         test_case_t("on which side of a sharp corner the round ones are", test_sides), &
         test_case_t("root of a polynomial", test_root), &
         test_case_t("second derivatives of a root", test_second_root), &
         test_case_t("constants and zeros", test_constants), &
         test_case_t("dot and cross product", test_bilinear), &
         test_case_t("momenta of dot and cross product", test_momenta)]
   end subroutine collect_dgrad

   !> Operation `which` in discrete-gradient arithmetic, from three variables.
   pure function operate(which, x0, dx) result(s)
      integer, intent(in) :: which
      real(wp), intent(in) :: x0(3), dx(3)
      type(dg_t) :: s, a, b, c

      a = dg_variable(1, x0(1), dx(1))
      b = dg_variable(2, x0(2), dx(2))
      c = dg_variable(3, x0(3), dx(3))
      select case (which)
      case (1)
         s = a + b
      case (2)
         s = a + 1.0_wp
      case (3)
         s = -a
      case (4)
         s = a - b
      case (5)
         s = 3.0_wp*a
      case (6)
         s = a*b
      case (7)
         s = a/b
      case (8)
         s = dg_sqrt(a)
      case (9)
         s = dg_abs(a)
      case (10)
         s = dg_negative_part(a, 0.0_wp)
      case (11)
         s = dg_negative_part(a, width)
      case (12)
         s = dg_log1p(a)
      case (13)
         s = dg_excess(a) + 0.5_wp*dg_expm1(b)
      case (14)
         s = dg_clip(a, 0.0_wp)
      case (15)
         s = dg_clip(a, clip_width)
      case (16)
         s = dg_above_negative(a, width)
      case default
         s = dg_log1p(a*b)*dg_sqrt(b + c)/(a + dg_expm1(c)) + dg_excess(c)
      end select
   end function operate

   !> The same in quadruple precision.
   pure function expect(which, x) result(f)
      integer, intent(in) :: which
      real(qp), intent(in) :: x(3)
      real(qp) :: f

      associate (a => x(1), b => x(2), c => x(3))
         select case (which)
         case (1)
            f = a + b
         case (2)
            f = a + 1.0_qp
         case (3)
            f = -a
         case (4)
            f = a - b
         case (5)
            f = 3.0_qp*a
         case (6)
            f = a*b
         case (7)
            f = a/b
         case (8)
            f = sqrt(a)
         case (9)
            f = abs(a)
         case (10)
            f = min(a, 0.0_qp)
         case (11)
            f = bent_negative(a)
         case (12)
            f = log(1.0_qp + a)
         case (13)
            f = a - log(1.0_qp + a) + 0.5_qp*(exp(b) - 1.0_qp)
         case (14)
            f = max(0.0_qp, min(1.0_qp, a))
         case (15)
            f = bent(a) + (1.0_qp - a) - bent(1.0_qp - a)
         case (16)
            f = from_above(a)
         case default
            f = log(1.0_qp + a*b)*sqrt(b + c)/(a + exp(c) - 1.0_qp) + c - log(1.0_qp + c)
         end select
      end associate

   contains

      !> max(a, 0), below the width of the rounded clip the cubic that touches it on both sides.
      pure real(qp) function bent(a)
         real(qp), intent(in) :: a

         bent = max(0.0_qp, a)
         if (bent < clip_width) bent = bent**2*(2.0_qp*clip_width - bent)/real(clip_width, qp)**2
      end function bent

   end function expect

   !> min(a, 0), in the band the quartic that joins it with slope and curvature: half of what an
   !> even function leaves of a.
   pure real(qp) function bent_negative(a)
      real(qp), intent(in) :: a

      bent_negative = min(a, 0.0_qp)
      associate (t => a/real(width, qp))
         if (abs(t) < 1.0_qp) bent_negative = 0.5_qp*(a - width*(3.0_qp + 6.0_qp*t**2 - t**4) &
            /8.0_qp)
      end associate
   end function bent_negative

   !> The same with an even function of the sixth degree that is 0 at a = 0.
   pure real(qp) function from_above(a)
      real(qp), intent(in) :: a

      from_above = min(a, 0.0_qp)
      associate (t => a/real(width, qp))
         if (abs(t) < 1.0_qp) from_above = 0.5_qp*(a - width*(15.0_qp*t**2 - 10.0_qp*t**4 &
            + 3.0_qp*t**6)/8.0_qp)
      end associate
   end function from_above

   !> Positive data of size 1, and an increment up to `largest` that keeps them so.
   subroutine draw(largest, x0, dx)
      real(wp), intent(in) :: largest
      real(wp), intent(out) :: x0(3), dx(3)

      call draw_random(x0)
      call draw_random(dx)
      x0 = 0.5_wp + x0
      dx = largest*(dx - 0.5_wp)
   end subroutine draw

   !> What rounding may change of a sum with the terms g_i dx_i; a chained operation has up to
   !> 20 roundings of a size that its values set. The rounded corner and the clips are
   !> differences in themselves.
   pure real(wp) function scale_of(which, s, dx)
      integer, intent(in) :: which
      type(dg_t), intent(in) :: s
      real(wp), intent(in) :: dx(3)

      scale_of = sum(abs(s%g*dx))
      if (any(which == [11, 14, 15, 16])) scale_of = abs(dx(1))
   end function scale_of

   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      type(dg_t) :: s
      real(wp) :: x0(3), dx(3), scale
      integer :: which, i

      do which = 1, n_operation
         do i = 1, 200
            call draw(0.9_wp, x0, dx)
            s = operate(which, x0, dx)
            scale = scale_of(which, s, dx)
            call check_near(error, dot_product(s%g, dx), s%df, 20.0_wp*eps, scale, &
               trim(name(which)) // ": g.dx = df")
            call check_near(error, s%df, increment_of(expect, which, x0, dx), 20.0_wp*eps, &
               scale + increment_doubt, trim(name(which)) // ": df = f1 - f0")
            call check_near(error, [s%f0, s%f1], real([expect(which, real(x0, qp)), &
               expect(which, real(x0, qp) + real(dx, qp))], wp), 20.0_wp*eps, &
               1.0_wp + abs(s%f0) + abs(s%f1), trim(name(which)) // ": values")
         end do
      end do
   end subroutine test_identity

   !> Absolute value, negative part and rounded corner of a product whose sign changes in the step.
   subroutine test_change_of_sign(error)
      type(error_t), allocatable, intent(out) :: error
      type(dg_t) :: a, s(3)
      real(wp) :: x0(3), dx(3), expected(3), scale
      real(qp) :: a0, a1
      integer :: i, k, n_crossed

      n_crossed = 0
      do i = 1, 500
         call draw_random(x0)
         call draw_random(dx)
         x0 = x0 - 0.5_wp
         dx = 2.0_wp*(dx - 0.5_wp)
         a = dg_variable(1, x0(1), dx(1))*dg_variable(2, x0(2), dx(2))
         if (a%f0*a%f1 < 0.0_wp) n_crossed = n_crossed + 1
         s = [dg_abs(a), dg_negative_part(a, 0.0_wp), dg_negative_part(a, width)]
         a0 = real(x0(1), qp)*real(x0(2), qp)
         a1 = (real(x0(1), qp) + real(dx(1), qp))*(real(x0(2), qp) + real(dx(2), qp))
         expected = real([abs(a1) - abs(a0), min(a1, 0.0_qp) - min(a0, 0.0_qp), &
            bent_negative(a1) - bent_negative(a0)], wp)
         scale = sum(abs(a%g*dx))
         do k = 1, 3
            call check_near(error, dot_product(s(k)%g, dx), expected(k), 16.0_wp*eps, &
               scale + increment_doubt, trim(name(8 + k)) // ": g.dx = f1 - f0")
            call check_near(error, s(k)%df, expected(k), 16.0_wp*eps, &
               scale + increment_doubt, trim(name(8 + k)) // ": df = f1 - f0")
         end do
      end do
      call check_true(error, n_crossed > 150, "the sign changes in many of the cases")
   end subroutine test_change_of_sign

   !> `df` stays relatively exact and g.dx equal to it down to the smallest numbers. All functions
   !> rise with each of their increments but those of case 4, 7, 16 and 17, where terms cancel.
   subroutine test_small_increments(error)
      type(error_t), allocatable, intent(out) :: error
      type(dg_t) :: s
      real(wp) :: x0(3), dx(3), expected
      integer :: which, k, last

      last = -minexponent(1.0_wp) - 12
      do which = 1, n_operation
         do k = 2, last, 6
            call draw(1.0_wp, x0, dx)
            dx = scale(abs(dx) + 0.1_wp, -k)
            s = operate(which, x0, dx)
            expected = increment_of(expect, which, x0, dx)
            call check_near(error, s%df, expected, 24.0_wp*eps, &
               scale_of(which, s, dx) + increment_doubt, trim(name(which)) &
               // ": df at increments of 2^-" // to_text(k))
            call check_near(error, dot_product(s%g, dx), s%df, 24.0_wp*eps, &
               scale_of(which, s, dx), &
               trim(name(which)) // ": g.dx at increments of 2^-" // to_text(k))
         end do
      end do
   end subroutine test_small_increments

   !> g -> c with the increment, linearly, and g = c where the increment is below round-off.
   subroutine test_limit(error)
      type(error_t), allocatable, intent(out) :: error
      type(dg_t) :: s, half
      real(wp) :: x0(3), dx(3), ratio
      integer :: which

      do which = 1, n_operation
         call draw(1.0_wp, x0, dx)
         dx = scale(abs(dx) + 0.1_wp, -8)
         s = operate(which, x0, dx)
         half = operate(which, x0, 0.5_wp*dx)
         if (maxval(abs(s%g - s%c)) > 1.0e3_wp*eps) then
            ratio = maxval(abs(s%g - s%c))/maxval(abs(half%g - half%c))
            call check_near(error, ratio, 2.0_wp, 0.05_wp, 1.0_wp, &
               trim(name(which)) // ": ratio of g - c for half the increment")
         end if
         s = operate(which, x0, scale(dx, 1 - digits(1.0_wp)*4))
         call check_near(error, s%g, s%c, 20.0_wp*eps, maxval(abs(s%c)), &
            trim(name(which)) // ": g = c in the limit")
         s = operate(which, x0, [0.0_wp, 0.0_wp, 0.0_wp])
         call check_near(error, s%g, s%c, 20.0_wp*eps, maxval(abs(s%c)), &
            trim(name(which)) // ": g = c without motion")
      end do
   end subroutine test_limit

   subroutine test_gradient(error)
      type(error_t), allocatable, intent(out) :: error
      type(dg_t) :: s
      real(wp) :: x0(3), dx(3)
      integer :: which, i

      do which = 1, n_operation
         do i = 1, 20
            call draw(0.9_wp, x0, dx)
            s = operate(which, x0, dx)
            call check_near(error, s%c, slopes_of(expect, which, x0 + dx), &
               40.0_wp*eps + slope_doubt, maxval(abs(s%c)) + 1.0_wp, &
               trim(name(which)) // ": gradient")
         end do
      end do
   end subroutine test_gradient

   !> Error of a central difference of step eps^(1/3): a few eps^(2/3).
   subroutine test_second_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x0(3), dx(3)
      integer :: which, k

      do which = 1, n_operation
         do k = 0, 40, 8
            call draw(0.9_wp, x0, dx)
            call check_second(error, which, x0, scale(dx, -k), trim(name(which)) &
               // " at increments of 2^-" // to_text(k))
         end do
      end do
   end subroutine test_second_derivatives

   subroutine check_second(error, which, x0, dx, what)
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in) :: which
      real(wp), intent(in) :: x0(3), dx(3)
      character(len=*), intent(in) :: what
      type(dg_t) :: s, up, down
      real(wp) :: step, way(3)
      integer :: j

      step = eps**(1.0_wp/3.0_wp)
      s = operate(which, x0, dx)
      do j = 1, 3
         way = 0.0_wp
         way(j) = step
         up = operate(which, x0, dx + way)
         down = operate(which, x0, dx - way)
         call check_near(error, s%h(:, j), (up%g - down%g)/(2.0_wp*step), 40.0_wp*step**2, &
            1.0_wp + maxval(abs(s%g)), what // ", column " // to_text(j))
      end do
   end subroutine check_second

   !> |a|, min(a, 0), sharp and rounded, where a changes its sign: the slope depends on a1.
   subroutine test_second_across(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: which

      do which = 9, 11
         call check_second(error, which, [0.4_wp, 1.0_wp, 1.0_wp], [-1.1_wp, 0.2_wp, 0.1_wp], &
            trim(name(which)) // " downwards")
         call check_second(error, which, [-0.7_wp, 1.0_wp, 1.0_wp], [1.2_wp, 0.2_wp, 0.1_wp], &
            trim(name(which)) // " upwards")
         call check_second(error, which, [-0.7_wp, 1.0_wp, 1.0_wp], [-0.2_wp, 0.2_wp, 0.1_wp], &
            trim(name(which)) // " below zero")
      end do
   end subroutine test_second_across

   !> Steps between all places before, on, between and beyond the bounds.
   subroutine test_clip(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: at(6) = [-0.7_wp, 0.0_wp, 0.3_wp, 0.8_wp, 1.0_wp, 1.9_wp]
      real(wp), parameter :: clipped(6) = [0.0_wp, 0.0_wp, 0.3_wp, 0.8_wp, 1.0_wp, 1.0_wp]
      type(dg_t) :: s
      real(wp) :: x0(3), dx(3), slope
      integer :: i, j

      do i = 1, 6
         do j = 1, 6
            x0 = [at(i), 1.0_wp, 1.0_wp]
            dx = [at(j) - at(i), 0.2_wp, 0.1_wp]
            s = dg_clip(dg_variable(1, x0(1), dx(1)), 0.0_wp)
            call check_near(error, [s%f0, s%f1], [clipped(i), clipped(j)], 2.0_wp*eps, 1.0_wp, &
               "values")
            call check_near(error, s%df, clipped(j) - clipped(i), 4.0_wp*eps, 2.0_wp, "df")
            call check_near(error, s%g(1)*dx(1), clipped(j) - clipped(i), 4.0_wp*eps, 2.0_wp, &
               "g.dx")
            slope = merge(1.0_wp, 0.0_wp, at(j) > 0.0_wp .and. at(j) < 1.0_wp)
            if (j == 2 .or. j == 5) cycle        ! no derivative
            call check_near(error, s%c(1), slope, 0.0_wp, 1.0_wp, "gradient")
            call check_second(error, 14, x0, dx, "clip, " // to_text(at(i)) // " to " &
               // to_text(at(j)))
         end do
      end do
   end subroutine test_clip

   !> Steps between all places before, in and beyond the bands of a clip with rounded corners; exact
   !> outside of them, with one tangent at their ends.
   subroutine test_rounded_clip(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: at(9) = [-0.7_wp, -0.3_wp, 0.1_wp, 0.3_wp, 0.45_wp, 0.7_wp, 0.9_wp, &
         1.25_wp, 1.9_wp]
      type(dg_t) :: s
      real(wp) :: x0(3), dx(3), expected
      integer :: i, j

      do i = 1, size(at)
         do j = 1, size(at)
            x0 = [at(i), 1.0_wp, 1.0_wp]
            dx = [at(j) - at(i), 0.2_wp, 0.1_wp]
            s = operate(15, x0, dx)
            expected = increment_of(expect, 15, x0, dx)
            call check_near(error, s%df, expected, 4.0_wp*eps, 1.0_wp, "df")
            call check_near(error, s%f1 - s%f0, expected, 4.0_wp*eps, 1.0_wp, "values")
            call check_near(error, s%g(1)*dx(1), expected, 4.0_wp*eps, 1.0_wp, "g.dx")
            call check_near(error, s%c, slopes_of(expect, 15, x0 + dx), &
               40.0_wp*eps + slope_doubt, 1.0_wp, "gradient")
            call check_second(error, 15, x0, dx, "rounded clip, " // to_text(at(i)) // " to " &
               // to_text(at(j)))
         end do
      end do
      s = dg_clip(dg_variable(1, 0.5_wp, 0.1_wp), clip_width)
      call check_near(error, [s%f0, s%df, s%c(1)], [0.5_wp, 0.1_wp, 1.0_wp], 2.0_wp*eps, 1.0_wp, &
         "exact between the bands")
      s = dg_clip(dg_variable(1, 0.0_wp, 1.0_wp), clip_width)
      call check_near(error, [s%f0, s%f1, s%c(1)], [0.0_wp, 1.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, &
         "exact at the bounds")
   end subroutine test_rounded_clip

   !> Steps between all places below, in and above the band; exact beyond, and with its mirror image
   !> it adds up to a.
   subroutine test_rounded_corner(error)
      type(error_t), allocatable, intent(out) :: error

      call check_corner(error, 11)
      call check_corner(error, 16)
   end subroutine test_rounded_corner

   subroutine check_corner(error, which)
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in) :: which
      real(wp), parameter :: at(7) = [-2.5_wp, -1.3_wp, -0.7_wp, 0.0_wp, 0.4_wp, 1.2_wp, 3.0_wp]
      type(dg_t) :: s, image
      real(wp) :: x0(3), dx(3), expected
      integer :: i, j

      do i = 1, size(at)
         do j = 1, size(at)
            x0 = [at(i), 1.0_wp, 1.0_wp]
            dx = [at(j) - at(i), 0.2_wp, 0.1_wp]
            s = operate(which, x0, dx)
            expected = increment_of(expect, which, x0, dx)
            call check_near(error, s%df, expected, 4.0_wp*eps, 4.0_wp, "df")
            call check_near(error, s%f1 - s%f0, expected, 4.0_wp*eps, 4.0_wp, "values")
            call check_near(error, s%c, slopes_of(expect, which, x0 + dx), &
               40.0_wp*eps + slope_doubt, 1.0_wp, "gradient")
            call check_second(error, which, x0, dx, trim(name(which)) // ", " // to_text(at(i)) &
               // " to " // to_text(at(j)))
            image = operate(which, [-x0(1), x0(2:)], [-dx(1), dx(2:)])
            call check_near(error, [s%f1 - image%f1, s%df - image%df, s%g(1) + image%g(1)], &
               [at(j), dx(1), 1.0_wp], 4.0_wp*eps, 4.0_wp, "a, from both parts")
            if (max(at(i), at(j)) < -width) then
              call check_near(error, [s%f1, s%df], [at(j), dx(1)], 0.0_wp, 1.0_wp, "exact below")
            end if
            if (min(at(i), at(j)) > width) then
              call check_near(error, [s%f1, s%df], [0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "exact above")
            end if
         end do
      end do
   end subroutine check_corner

   !> Of min(a, 0) the one is nowhere above and the other nowhere below, and at 0 equal.
   subroutine test_sides(error)
      type(error_t), allocatable, intent(out) :: error
      type(dg_t) :: below, above
      real(wp) :: at
      integer :: i

      do i = -120, 120
         at = 0.01_wp*width*real(i, wp)
         below = dg_negative_part(dg_variable(1, at, 0.0_wp), width)
         above = dg_above_negative(dg_variable(1, at, 0.0_wp), width)
         call check_true(error, below%f0 <= min(at, 0.0_wp), "below at " // to_text(at))
         call check_true(error, above%f0 >= min(at, 0.0_wp) - eps*width, "above at " &
            // to_text(at))
         if (i == 0) call check_near(error, above%f0, 0.0_wp, 0.0_wp, 1.0_wp, "at the corner")
      end do
   end subroutine test_sides

   !> F = x^3 + p a b x - (a^2 + b) with the variables a, b and x as number 3; p > 0 makes it rise.
   pure function cubic(x0, dx) result(f)
      real(wp), intent(in) :: x0(3), dx(3)
      type(dg_t) :: f, a, b, x

      a = dg_variable(1, x0(1), dx(1))
      b = dg_variable(2, x0(2), dx(2))
      x = dg_variable(3, x0(3), dx(3))
      f = x*x*x + 0.5_wp*(a*b*x) - (a*a + b)
   end function cubic

   !> Its root, in quadruple precision: Newton's method, which comes from above.
   pure real(qp) function cubic_root(a, b) result(x)
      real(qp), intent(in) :: a, b
      integer :: i

      x = 4.0_qp
      do i = 1, 40
         x = x - (x**3 + 0.5_qp*a*b*x - (a*a + b))/(3.0_qp*x**2 + 0.5_qp*a*b)
      end do
   end function cubic_root

   !> The root as a number, from the positions of a and b.
   pure function root_number(x0, dx) result(s)
      real(wp), intent(in) :: x0(2), dx(2)
      type(dg_t) :: s
      real(wp) :: root(2)

      root = real([cubic_root(real(x0(1), qp), real(x0(2), qp)), &
         cubic_root(real(x0(1), qp) + real(dx(1), qp), real(x0(2), qp) + real(dx(2), qp))], wp)
      s = dg_root(cubic([x0, root(1)], [dx, root(2) - root(1)]), 3, root(1), root(2))
   end function root_number

   !> Steps from 1 down to 2^-90, far below the round-off of the roots that are handed in: that
   !> enters by its product with the unit round-off.
   subroutine test_root(error)
      type(error_t), allocatable, intent(out) :: error
      type(dg_t) :: s
      real(wp) :: x0(3), dx(3), expected(2)
      real(qp) :: a, b, x
      integer :: i

      do i = 0, 90
         call draw(0.9_wp, x0, dx)
         dx = scale(dx, -i)
         s = root_number(x0(:2), dx(:2))
         a = real(x0(1), qp) + real(dx(1), qp)
         b = real(x0(2), qp) + real(dx(2), qp)
         x = cubic_root(a, b)
         call check_near(error, [s%f0, s%f1], real([cubic_root(real(x0(1), qp), &
            real(x0(2), qp)), x], wp), eps, 2.0_wp, "values")
         call check_near(error, dot_product(s%g, dx), s%df, 40.0_wp*eps, &
            sum(abs(s%g*dx)) + eps, "g.dx = df at 2^-" // to_text(i))
         call check_near(error, s%df, s%f1 - s%f0, 40.0_wp*eps, 1.0_wp, "df = f1 - f0")
         expected = real([2.0_qp*a - 0.5_qp*b*x, 1.0_qp - 0.5_qp*a*x]/(3.0_qp*x**2 + 0.5_qp*a*b), &
            wp)
         call check_near(error, s%c(:2), expected, 40.0_wp*eps, 2.0_wp, "gradient")
         call check_near(error, [s%g(3), s%c(3), s%h(3, :), s%h(:, 3)], spread(0.0_wp, 1, 8), &
            0.0_wp, 1.0_wp, "the unknown is no variable")
         if (i > digits(1.0_wp) + 4) call check_near(error, s%g, s%c, 40.0_wp*eps, 2.0_wp, &
            "g = c in the limit")
      end do
   end subroutine test_root

   !> Error of a central difference of step eps^(1/3): a few eps^(2/3).
   subroutine test_second_root(error)
      type(error_t), allocatable, intent(out) :: error
      type(dg_t) :: s, up, down
      real(wp) :: x0(3), dx(3), way(2), step
      integer :: i, j

      step = eps**(1.0_wp/3.0_wp)
      do i = 0, 40, 2
         call draw(0.9_wp, x0, dx)
         dx = scale(dx, -i)
         s = root_number(x0(:2), dx(:2))
         do j = 1, 2
            way = 0.0_wp
            way(j) = step
            up = root_number(x0(:2), dx(:2) + way)
            down = root_number(x0(:2), dx(:2) - way)
            call check_near(error, s%h(:, j), (up%g - down%g)/(2.0_wp*step), 40.0_wp*step**2, &
               1.0_wp + maxval(abs(s%g)), "column " // to_text(j))
         end do
      end do
   end subroutine test_second_root

   subroutine test_constants(error)
      type(error_t), allocatable, intent(out) :: error
      type(dg_t) :: s, a

      s = dg_constant(3.0_wp)
      call check_near(error, [s%f0, s%f1, s%df], [3.0_wp, 3.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, &
         "constant")
      a = dg_variable(1, 0.0_wp, 0.0_wp)
      s = dg_abs(a)
      call check_near(error, [s%f0, s%f1, s%df, s%g], spread(0.0_wp, 1, 6), 0.0_wp, 1.0_wp, &
         "|0|")
      s = dg_log1p(a) + dg_excess(a) + dg_expm1(a)
      call check_near(error, [s%df, s%g(1), s%c(1), s%h(1, 1)], [0.0_wp, 2.0_wp, 2.0_wp, 0.5_wp], &
         2.0_wp*eps, 1.0_wp, "log1p, excess and expm1 at zero")
      s = dg_abs(dg_variable(2, 1.0_wp, -1.0_wp))
      call check_near(error, [s%df, s%g(2)], [-1.0_wp, 1.0_wp], 0.0_wp, 1.0_wp, &
         "|a| that ends at zero")
   end subroutine test_constants

   !> Five random nodes that move by up to their distance, and by 2^-1000.
   subroutine test_bilinear(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x0(2, 5), dx(2, 5), g(2, 5), expected(2), a(2), da(2), b(2), db(2)
      type(dg8_t) :: s(2)
      ! Products of increments and of their round-off are normal numbers.
      integer, parameter :: smallest = -minexponent(1.0_wp) - digits(1.0_wp)
      integer :: i, k

      do i = 1, 100
         call draw_random(x0)
         call draw_random(dx)
         dx = scale(dx - 0.5_wp, -mod(i*10, smallest))
         s = [dg_dot(difference(4, 1, x0, dx), difference(5, 2, x0, dx)), &
            dg_cross(difference(4, 1, x0, dx), difference(5, 1, x0, dx))]
         a = x0(:, 4) - x0(:, 1)
         da = dx(:, 4) - dx(:, 1)
         b = x0(:, 5) - x0(:, 2)
         db = dx(:, 5) - dx(:, 2)
         expected(1) = dot_product(a, db) + dot_product(da, b) + dot_product(da, db)
         b = x0(:, 5) - x0(:, 1)
         db = dx(:, 5) - dx(:, 1)
         expected(2) = a(1)*db(2) - a(2)*db(1) + da(1)*b(2) - da(2)*b(1) + da(1)*db(2) - da(2)*db(1)
         do k = 1, 2
            g = 0.0_wp
            call nodes_add_first(1.0_wp, s(k)%g, [1, 2, 3, 4, 5], g)
            call check_near(error, s(k)%df, expected(k), 8.0_wp*eps, 8.0_wp*maxval(abs(dx)), &
               "increment")
            call check_near(error, sum(g*dx), s(k)%df, 8.0_wp*eps, sum(abs(g*dx)), "identity")
            call check_near(error, s(k)%f1 - s(k)%f0, s(k)%df, 8.0_wp*eps, 1.0_wp, "values")
         end do
      end do
   end subroutine test_bilinear

   !> sum g = 0 and sum x_mid x g = 0, for products with shared and with distinct nodes.
   subroutine test_momenta(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x0(2, 5), dx(2, 5), g(2, 5), mid(2, 5)
      type(dg8_t) :: s(4)
      integer :: i, k

      do i = 1, 100
         call draw_random(x0)
         call draw_random(dx)
         mid = x0 + 0.5_wp*dx
         s = [dg_dot(difference(4, 1, x0, dx), difference(5, 2, x0, dx)), &
            dg_dot(difference(3, 2, x0, dx), difference(3, 2, x0, dx)), &
            dg_cross(difference(4, 1, x0, dx), difference(5, 1, x0, dx)), &
            dg_cross(difference(4, 1, x0, dx), difference(3, 2, x0, dx))]
         do k = 1, 4
            g = 0.0_wp
            call nodes_add_first(1.0_wp, s(k)%g, [1, 2, 3, 4, 5], g)
            call check_near(error, sum(g, dim=2), [0.0_wp, 0.0_wp], 8.0_wp*eps, &
               sum(abs(g)), "linear momentum of product " // to_text(k))
            call check_near(error, sum(mid(1, :)*g(2, :) - mid(2, :)*g(1, :)), 0.0_wp, &
               8.0_wp*eps, sum(abs(mid))*maxval(abs(g)), "angular momentum of product " &
               // to_text(k))
         end do
      end do
   end subroutine test_momenta

end module test_dgrad
