!> Gauss-Legendre points: polynomials, symmetry, the first polynomial that is not exact.
module test_gauss
   use check, only : check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_gauss, only : gauss_points
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   implicit none
   private
   public :: collect_gauss

   !> A sum of ten terms below 1, each with a power of up to 20 of a rounded point.
   real(wp), parameter :: tol = 32.0_wp*epsilon(1.0_wp)
   integer, parameter :: most_points = 10

contains

   subroutine collect_gauss(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("powers up to degree 2 n", test_powers), &
         test_case_t("symmetric, ascending, inside", test_symmetry)]
   end subroutine collect_gauss

   !> Integrals of x^k over 0..1; that of x^(2 n) is short of 1/(2 n + 1) by
   !> (n!)^4/((2 n + 1) (2 n)!^2).
   subroutine test_powers(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: point(:), weight(:)
      real(wp) :: expected
      integer :: n, degree, k

      do n = 1, most_points
         allocate(point(n), weight(n))
         call gauss_points(point, weight)
         do degree = 0, 2*n
            expected = 1.0_wp/real(degree + 1, wp)
            if (degree == 2*n) expected = expected &
               *(1.0_wp - product([(real(k, wp)/real(n + k, wp), k = 1, n)])**2)
            call check_near(error, sum(weight*point**degree), expected, tol, 1.0_wp, &
               to_text(n) // " points, degree " // to_text(degree))
         end do
         deallocate(point, weight)
      end do
   end subroutine test_powers

   subroutine test_symmetry(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: point(:), weight(:)
      integer :: n

      do n = 1, most_points
         allocate(point(n), weight(n))
         call gauss_points(point, weight)
         call check_near(error, point + point(n:1:-1), spread(1.0_wp, 1, n), tol, 1.0_wp, "points")
         call check_near(error, weight, weight(n:1:-1), tol, 1.0_wp, "weights")
         call check_true(error, all(point(2:) > point(:n - 1)), "ascending")
         call check_true(error, minval(point) > 0.0_wp .and. maxval(point) < 1.0_wp, "inside")
         call check_true(error, minval(weight) > 0.0_wp, "positive weights")
         deallocate(point, weight)
      end do
   end subroutine test_symmetry

end module test_gauss
