!> Discrete gradients made for functions that are given at points.
module test_point_function
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_dgrad_series, only : expm1_of, log1p_excess
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_point_function, only : point_failed, point_function_t, point_gradient, point_ok, &
      point_outside, point_response_t
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_point_function

   real(wp), parameter :: eps = epsilon(1.0_wp)

   !> Kinds of functions of three variables; `mixed` is a quartic, an exponential and a logarithm,
   !> `rough` the logarithm, s - ln(1 + s), with values that carry a round-off of eps.
   integer, parameter :: quadratic = 1, quartic = 2, logarithm = 3, mixed = 4, rough = 5
   integer, parameter :: n_smooth = 4

   type, extends(point_function_t) :: sample_t
      integer :: kind = quadratic
      real(wp) :: fault_below = -huge(1.0_wp)    !! a first variable below it gives `fault`
      integer :: fault = point_ok
      logical :: gives_nan = .false.             !! instead of a status
      logical :: spoils_hessian = .false.
   contains
      procedure :: evaluate => sample_evaluate
   end type sample_t

contains

   subroutine collect_point_function(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("g.dz = W1 - W0 for steps of all sizes", test_directionality), &
         test_case_t("start and end may change places", test_symmetry), &
         test_case_t("tangent against differences", test_tangent), &
         test_case_t("no step: gradient and half the second derivative", test_rest), &
         test_case_t("sixth order to the mean of the gradient", test_order), &
         test_case_t("round-off in the values stays out of small steps", test_rough), &
         test_case_t("no jump where the correction begins", test_seam), &
         test_case_t("metric turns with the axes", test_metric), &
         test_case_t("quadratic functions: mean of the gradients", test_quadratic), &
         test_case_t("what cannot be evaluated is told", test_status), &
         test_case_t("room for more and for fewer points", test_room)]
   end subroutine collect_point_function

   subroutine sample_evaluate(self, z, wants_hessian, value, gradient, hessian, status)
      class(sample_t), intent(in) :: self
      real(wp), intent(in), contiguous :: z(:, :)
      logical, intent(in) :: wants_hessian
      real(wp), intent(inout), contiguous :: value(:)
      real(wp), intent(inout), contiguous :: gradient(:, :)
      real(wp), intent(inout), contiguous :: hessian(:, :, :)
      integer, intent(out) :: status
      real(wp) :: f, df(3), ddf(3, 3)
      integer :: i

      status = point_ok
      if (any(z(1, :) < self%fault_below)) status = self%fault
      do i = 1, size(z, 2)
         call sample_point(self%kind, z(:, i), f, df, ddf)
         value(i) = f
         gradient(:, i) = df
         if (wants_hessian) hessian(:, :, i) = ddf
      end do
      if (self%gives_nan) where (z(1, :) < self%fault_below) value = ieee_value(f, ieee_quiet_nan)
      if (wants_hessian .and. self%spoils_hessian) hessian = ieee_value(f, ieee_quiet_nan)
   end subroutine sample_evaluate

   !> Value and derivatives of one of the functions at a point.
   pure subroutine sample_point(kind, z, f, df, ddf)
      integer, intent(in) :: kind
      real(wp), intent(in) :: z(3)
      real(wp), intent(out) :: f, df(3), ddf(3, 3)
      real(wp), parameter :: way(3) = [1.0_wp, 0.5_wp, -0.25_wp]
      real(wp), parameter :: k(3, 3) = reshape([4.0_wp, 1.0_wp, 0.5_wp, 1.0_wp, 3.0_wp, -0.5_wp, &
         0.5_wp, -0.5_wp, 2.0_wp], [3, 3])
      real(wp) :: s, square
      integer :: i

      s = dot_product(way, z)
      f = 0.0_wp
      df = 0.0_wp
      ddf = 0.0_wp
      select case (kind)
      case (quadratic)
         f = 0.5_wp*dot_product(z, matmul(k, z))
         df = matmul(k, z)
         ddf = k
      case (quartic, mixed)
         square = dot_product(z, z)
         f = 0.25_wp*square**2
         df = square*z
         do i = 1, 3
            ddf(:, i) = 2.0_wp*z*z(i)
            ddf(i, i) = ddf(i, i) + square
         end do
      end select
      select case (kind)
      case (logarithm, mixed)
         f = f + log1p_excess(s)
      case (rough)
         f = (1.0_wp + s) - 1.0_wp - log(1.0_wp + s)
      end select
      if (kind >= logarithm) then
         df = df + way*(s/(1.0_wp + s))
         do i = 1, 3
            ddf(:, i) = ddf(:, i) + way*(way(i)/(1.0_wp + s)**2)
         end do
      end if
      if (kind == mixed) then
         f = f + expm1_of(z(2))
         df(2) = df(2) + exp(z(2))
         ddf(2, 2) = ddf(2, 2) + exp(z(2))
      end if
   end subroutine sample_point

   pure function sample_of(kind) result(sample)
      integer, intent(in) :: kind
      type(sample_t) :: sample

      sample%kind = kind
      sample%n_variable = 3
   end function sample_of

   !> The discrete gradient of one step, and the size of the terms of its defect.
   subroutine one_step(sample, z0, dz, g, tangent, defect, terms, error)
      type(sample_t), intent(in) :: sample
      real(wp), intent(in) :: z0(3), dz(3)
      real(wp), intent(out) :: g(3), tangent(3, 3), defect, terms
      type(error_t), allocatable, intent(out) :: error
      type(point_response_t) :: response
      real(wp) :: f0, f1, df(3), ddf(3, 3)
      integer :: status

      call point_gradient(sample, reshape(z0, [3, 1]), reshape(dz, [3, 1]), .true., response, &
         status)
      call check_equal(error, status, point_ok, "status")
      g = response%gradient(:, 1)
      tangent = response%tangent(:, :, 1)
      call sample_point(sample%kind, z0, f0, df, ddf)
      call sample_point(sample%kind, z0 + dz, f1, df, ddf)
      call check_near(error, response%energy(1), f1, 0.0_wp, 1.0_wp, "energy")
      defect = dot_product(g, dz) - (f1 - f0)
      terms = abs(f0) + abs(f1) + dot_product(abs(g), abs(z0) + abs(z0 + dz))
   end subroutine one_step

   !> Start and direction of the steps of the tests; |way| = 1, and 1 + s stays above 0.2.
   subroutine steps_from(i, z0, way)
      integer, intent(in) :: i
      real(wp), intent(out) :: z0(3), way(3)

      call draw_random(z0)
      call draw_random(way)
      z0 = 0.5_wp*(z0 - 0.5_wp)
      if (mod(i, 5) == 0) z0 = 0.0_wp
      way = way - 0.5_wp
      way = way/norm2(way)
   end subroutine steps_from

   !> To the noise that may be left out, 8 eps, and as much for the products here.
   subroutine test_directionality(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: tol = 16.0_wp*eps
      real(wp) :: z0(3), way(3), g(3), tangent(3, 3), defect, terms
      integer :: i, k, kind

      do kind = 1, n_smooth
         do i = 1, 20
            call steps_from(i, z0, way)
            do k = 0, 60
               call one_step(sample_of(kind), z0, (0.4_wp*0.5_wp**k)*way, g, tangent, defect, &
                  terms, error)
               if (allocated(error)) return
               call check_near(error, defect, 0.0_wp, tol, terms, "defect of function " // &
                  to_text(kind) // ", step 0.4/2^" // to_text(k))
            end do
         end do
      end do
   end subroutine test_directionality

   !> Both ways: the same up to round-off, which the correction divides by the step.
   subroutine test_symmetry(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: z0(3), way(3), g(3), back(3), tangent(3, 3), defect, terms, length
      integer :: i, k, kind

      do kind = 1, n_smooth
         do i = 1, 20
            call steps_from(i, z0, way)
            do k = 0, 10
               length = 0.4_wp*0.25_wp**k
               call one_step(sample_of(kind), z0, length*way, g, tangent, defect, terms, error)
               if (allocated(error)) return
               call one_step(sample_of(kind), z0 + length*way, -length*way, back, tangent, defect, &
                  terms, error)
               if (allocated(error)) return
               call check_near(error, back, g, 32.0_wp*eps, maxval(abs(g)) + maxval(abs(tangent)) &
                  + terms/length, "function " // to_text(kind))
            end do
         end do
      end do
   end subroutine test_symmetry

   !> Central differences at two distances: an error of d^4 and of the noise over d, balanced by
   !> d = eps^(1/5). The factor is for fifth derivatives, at most 4!/0.2^5 of the logarithm's.
   subroutine test_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: balance = eps**0.2_wp, tol = 24.0_wp*5.0_wp**5*balance**4
      real(wp) :: z0(3), way(3), d, length, g(3), tangent(3, 3), other(3, 3), defect, terms
      real(wp) :: up(3), down(3), slope(3, 2)
      integer :: i, j, k, kind, fine

      do kind = 1, n_smooth
         do i = 1, 10
            call steps_from(i, z0, way)
            do k = 0, 4
               length = 0.4_wp*0.0625_wp**k
               call one_step(sample_of(kind), z0, length*way, g, tangent, defect, terms, error)
               if (allocated(error)) return
               do j = 1, 3
                  do fine = 1, 2
                     d = 0.1_wp*balance/real(fine, wp)
                     call one_step(sample_of(kind), z0, length*way + d*unit(j), up, other, defect, &
                        terms, error)
                     if (allocated(error)) return
                     call one_step(sample_of(kind), z0, length*way - d*unit(j), down, other, &
                        defect, terms, error)
                     if (allocated(error)) return
                     slope(:, fine) = (up - down)/(2.0_wp*d)
                  end do
                  call check_near(error, tangent(:, j), (4.0_wp*slope(:, 2) - slope(:, 1))/3.0_wp, &
                     tol, 1.0_wp, "column " // to_text(j) // " of function " // to_text(kind))
               end do
            end do
         end do
      end do
   end subroutine test_tangent

   pure function unit(j) result(e)
      integer, intent(in) :: j
      real(wp) :: e(3)

      e = 0.0_wp
      e(j) = 1.0_wp
   end function unit

   !> To the last bit, alone and beside points that move.
   subroutine test_rest(error)
      type(error_t), allocatable, intent(out) :: error
      type(point_response_t) :: response
      real(wp) :: z0(3, 2), dz(3, 2), f, df(3), ddf(3, 3)
      integer :: kind, status, moving

      z0 = reshape([0.1_wp, -0.2_wp, 0.3_wp, 0.05_wp, 0.1_wp, -0.07_wp], [3, 2])
      do kind = 1, n_smooth
         do moving = 0, 1
            dz = 0.0_wp
            dz(1, 2) = 0.1_wp*real(moving, wp)
            call point_gradient(sample_of(kind), z0, dz, .true., response, status)
            call check_equal(error, status, point_ok, "status")
            call sample_point(kind, z0(:, 1), f, df, ddf)
            call check_near(error, response%gradient(:, 1), df, 0.0_wp, 1.0_wp, "gradient")
            call check_near(error, response%tangent(:, :, 1), 0.5_wp*ddf, 0.0_wp, 1.0_wp, "tangent")
            call check_near(error, response%energy(1), f, 0.0_wp, 1.0_wp, "energy")
         end do
      end do
   end subroutine test_rest

   !> The rule of three points leaves a term of sixth order in the mean of the gradient; half the
   !> step, a factor of 64 less.
   subroutine test_order(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: apart = sqrt(0.15_wp)
      real(wp) :: z0(3), way(3), g(3), mean(3), tangent(3, 3), defect, terms, far(2), dz(3)
      real(wp) :: f, df(3, 3), ddf(3, 3)
      integer :: i, k, part, n

      n = 64
      do i = 1, 10
         call steps_from(i, z0, way)
         do k = 1, 2
            dz = 0.3_wp*0.5_wp**k*way
            call one_step(sample_of(mixed), z0, dz, g, tangent, defect, terms, error)
            if (allocated(error)) return
            mean = 0.0_wp
            do part = 1, n
               associate (middle => real(part, wp) - 0.5_wp)
                  call sample_point(mixed, z0 + ((middle - apart)/n)*dz, f, df(:, 1), ddf)
                  call sample_point(mixed, z0 + (middle/n)*dz, f, df(:, 2), ddf)
                  call sample_point(mixed, z0 + ((middle + apart)/n)*dz, f, df(:, 3), ddf)
               end associate
               mean = mean + matmul(df, [5.0_wp, 8.0_wp, 5.0_wp]/18.0_wp)/n
            end do
            far(k) = norm2(g - mean)
         end do
         call check_true(error, far(2)*2.0_wp**5.5_wp < far(1) + 2.0_wp**5.5_wp*32.0_wp*eps &
            *norm2(g), "order: errors " // to_text(far(1)) // ", " // to_text(far(2)))
      end do
   end subroutine test_order

   !> Steps from rest, where the values have an error of eps but are of the size of the squared
   !> step. Where the correction is left out g is good to round-off; where it begins, at steps
   !> of about (8 eps 1120)^(1/3), it divides the error by the step.
   subroutine test_rough(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: way(3), g(3), smooth(3), tangent(3, 3), defect, terms, length
      integer :: k

      way = [1.0_wp, 0.0_wp, 0.0_wp]
      do k = 1, 40
         length = 0.5_wp**k
         call one_step(sample_of(logarithm), 0.0_wp*way, length*way, smooth, tangent, defect, &
            terms, error)
         if (allocated(error)) return
         call one_step(sample_of(rough), 0.0_wp*way, length*way, g, tangent, defect, terms, error)
         if (allocated(error)) return
         call check_near(error, g, smooth, merge(32.0_wp*eps, eps**(1.0_wp/3.0_wp), &
            length < eps**(1.0_wp/3.0_wp)), norm2(smooth), "step 1/2^" // to_text(k))
      end do
   end subroutine test_rough

   !> Steps that grow by little: g follows its tangent, whether corrected or not.
   subroutine test_seam(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: growth = 1.0e-4_wp
      real(wp) :: z0(3), way(3), g(3), next(3), tangent(3, 3), other(3, 3), defect, terms, length
      integer :: i, k, kind

      do kind = 1, n_smooth
         do i = 1, 5
            call steps_from(i, z0, way)
            do k = 0, 80
               length = 0.4_wp*2.0_wp**(-0.25_wp*real(k, wp))
               call one_step(sample_of(kind), z0, (length*(1.0_wp + growth))*way, next, other, &
                  defect, terms, error)
               if (allocated(error)) return
               call one_step(sample_of(kind), z0, length*way, g, tangent, defect, terms, error)
               if (allocated(error)) return
               call check_near(error, next, g + (growth*length)*matmul(tangent, way), 1.0_wp, &
                  2.0_wp*5.0_wp**3*(growth*length)**2 + 32.0_wp*eps*terms/length, &
                  "function " // to_text(kind))
            end do
         end do
      end do
   end subroutine test_seam

   !> Twice the second variable in place of it, with a quarter of its weight: the same function.
   subroutine test_metric(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(point_response_t) :: plain, heavy
      real(wp) :: z0(3, 1), dz(3, 1)
      integer :: status

      z0(:, 1) = [0.1_wp, -0.3_wp, 0.2_wp]
      dz(:, 1) = [1.2_wp, 1.8_wp, -0.6_wp]               ! so long that the rule misses much
      sample = sample_of(mixed)
      call point_gradient(sample, z0, dz, .true., plain, status)
      sample%weight = [2.0_wp, 2.0_wp, 2.0_wp]           ! only the directions count
      call point_gradient(sample, z0, dz, .true., heavy, status)
      call check_near(error, heavy%gradient(:, 1), plain%gradient(:, 1), 16.0_wp*eps, 1.0_wp, &
         "a metric twice as large")
      sample%weight = [1.0_wp, 64.0_wp, 1.0_wp]
      call point_gradient(sample, z0, dz, .true., heavy, status)
      call check_near(error, dot_product(heavy%gradient(:, 1) - plain%gradient(:, 1), dz(:, 1)), &
         0.0_wp, 32.0_wp*eps, 1.0_wp, "another metric, the same difference")
      associate (change => heavy%gradient(:, 1) - plain%gradient(:, 1))
         call check_true(error, abs(change(2)) > 1.0e3_wp*eps, &
            "the metric has an effect")
         call check_near(error, change(1)*dz(3, 1), change(3)*dz(1, 1), 32.0_wp*eps, 1.0_wp, &
            "along A dz")
      end associate
   end subroutine test_metric

   subroutine test_quadratic(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: z0(3), way(3), g(3), tangent(3, 3), defect, terms, f, df(3, 2), ddf(3, 3)
      integer :: i

      do i = 1, 20
         call steps_from(i, z0, way)
         call one_step(sample_of(quadratic), z0, way, g, tangent, defect, terms, error)
         if (allocated(error)) return
         call sample_point(quadratic, z0, f, df(:, 1), ddf)
         call sample_point(quadratic, z0 + way, f, df(:, 2), ddf)
         call check_near(error, g, 0.5_wp*(df(:, 1) + df(:, 2)), 8.0_wp*eps, 8.0_wp, "gradient")
         call check_near(error, tangent, 0.5_wp*ddf, 0.0_wp, 1.0_wp, "tangent")
      end do
   end subroutine test_quadratic

   subroutine test_status(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample

      sample = sample_of(mixed)
      sample%fault_below = 0.0_wp
      sample%fault = point_outside
      call check_equal(error, status_at(sample, 0.1_wp, 0.1_wp), point_ok, "inside")
      call check_equal(error, status_at(sample, 0.1_wp, -0.2_wp), point_outside, "outside")
      call check_equal(error, status_at(sample, -0.1_wp, 0.0_wp), point_outside, "outside at rest")
      sample%fault = point_failed
      call check_equal(error, status_at(sample, 0.1_wp, -0.2_wp), point_failed, "failed at the end")
      sample%fault = point_ok
      sample%gives_nan = .true.
      call check_equal(error, status_at(sample, 0.1_wp, -0.2_wp), point_outside, "not a number")
      call check_equal(error, status_at(sample, -0.1_wp, 0.0_wp), point_outside, "no number")
      sample = sample_of(mixed)
      sample%spoils_hessian = .true.
      call check_equal(error, status_at(sample, 0.1_wp, 0.1_wp), point_outside, "hessian")
      call check_equal(error, status_at(sample, 0.1_wp, 0.0_wp), point_outside, "the same, at rest")
   end subroutine test_status

   !> How the response of `sample` ends at two points, of which one moves from `start` by `step`.
   integer function status_at(sample, start, step)
      type(sample_t), intent(in) :: sample
      real(wp), intent(in) :: start, step
      type(point_response_t) :: response
      real(wp) :: z0(3, 2), dz(3, 2)

      z0 = 0.1_wp
      dz = 0.0_wp
      z0(1, 2) = start
      dz(1, 2) = step
      call point_gradient(sample, z0, dz, .true., response, status_at)
   end function status_at

   !> The work space of many points serves for few, and the other way round.
   subroutine test_room(error)
      type(error_t), allocatable, intent(out) :: error
      type(point_response_t) :: response
      real(wp) :: z0(3, 7), dz(3, 7), expected(3, 7)
      integer :: status, n

      call draw_random(z0)
      call draw_random(dz)
      dz = 0.3_wp*dz
      call point_gradient(sample_of(mixed), z0(:, :0), dz(:, :0), .true., response, status)
      call check_equal(error, status, point_ok, "no points")
      call point_gradient(sample_of(mixed), z0, dz, .true., response, status)
      expected = response%gradient(:, :7)
      do n = 1, 7
         call point_gradient(sample_of(mixed), z0(:, :n), dz(:, :n), .false., response, status)
         call check_near(error, response%gradient(:, n), expected(:, n), 0.0_wp, 1.0_wp, &
            to_text(n) // " points")
      end do
   end subroutine test_room

end module test_point_function
