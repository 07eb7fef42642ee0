!> Frequencies of elements and chains, masses at nodes: closed forms.
module test_critical_step
   use check, only : check_near, check_true, test_case_t
   use emcon_critical_step, only : tridiagonal_largest
   use emcon_element_frequency, only : element_frequency
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_lumped_mass, only : lumped_mass
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_critical_step

   real(wp), parameter :: eps = epsilon(1.0_wp)

contains

   subroutine collect_critical_step(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("largest eigenvalue of a chain", test_chain), &
         test_case_t("largest eigenvalue by its vector", test_random_chain), &
         test_case_t("frequency of an element", test_frequency), &
         test_case_t("mass at nodes", test_lumped)]
   end subroutine collect_critical_step

   !> 2 + 2 cos(pi/(n + 1)), for any scale.
   subroutine test_chain(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: pi = acos(-1.0_wp), scale = 2.0_wp**40
      real(wp) :: diagonal(30), beside(29)
      integer :: n

      diagonal = 2.0_wp*scale
      beside = -scale
      do n = 1, size(diagonal)
         call check_near(error, tridiagonal_largest(diagonal(:n), beside(:n - 1)), &
            scale*(2.0_wp + 2.0_wp*cos(pi/real(n + 1, wp))), 16.0_wp*eps, scale, "largest")
      end do
   end subroutine test_chain

   !> With positive y and T y = z y, signs beside the diagonal aside, z is the largest one.
   subroutine test_random_chain(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: diagonal(20), beside(19), y(20), around(20), largest
      integer :: i, n

      do i = 1, 60
         n = 1 + mod(i, 20)
         call draw_random(y)
         call draw_random(beside)
         call draw_random(largest)
         y = 0.1_wp + y
         beside = 10.0_wp*(beside - 0.5_wp)
         largest = 10.0_wp*(largest - 0.5_wp)
         around = 0.0_wp
         around(:n - 1) = abs(beside(:n - 1))*y(2:n)
         around(2:n) = around(2:n) + abs(beside(:n - 1))*y(:n - 1)
         diagonal = largest - around/y
         call check_near(error, tridiagonal_largest(diagonal(:n), beside(:n - 1)), largest, &
            64.0_wp*eps, maxval(abs(diagonal(:n))) + 10.0_wp, "largest of " // to_text(n))
      end do
   end subroutine test_random_chain

   !> A rod between masses m1, m2: w^2 = k/m1 + k/m2, once; the bound is as sharp as m^(-1/64) is.
   subroutine test_frequency(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: k = 3.0_wp, mass(2) = [2.0_wp, 0.5_wp]
      real(wp) :: rod(2, 2), plane(4, 4), expected, square
      integer :: a

      rod = k*reshape([1.0_wp, -1.0_wp, -1.0_wp, 1.0_wp], [2, 2])
      expected = k/mass(1) + k/mass(2)
      call check_near(error, element_frequency(rod, mass), expected, 256.0_wp*eps, expected, "rod")
      plane = 0.0_wp
      do a = 1, 2
         plane(a::2, a::2) = rod
      end do
      square = element_frequency(plane, mass)
      call check_near(error, square, expected*2.0_wp**(1.0_wp/128.0_wp), 256.0_wp*eps, expected, &
         "twice the same frequency")
      call check_true(error, element_frequency(rod, [1.0_wp, 0.0_wp]) >= huge(1.0_wp), "no mass")
      call check_near(error, element_frequency(0.0_wp*rod, mass), 0.0_wp, 0.0_wp, 1.0_wp, "loose")
   end subroutine test_frequency

   !> Rows where they are positive, else the diagonal; the mass is kept.
   subroutine test_lumped(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: line(3, 3), share(3)

      line = reshape([4.0_wp, 2.0_wp, -1.0_wp, 2.0_wp, 16.0_wp, 2.0_wp, -1.0_wp, 2.0_wp, 4.0_wp], &
         [3, 3])/30.0_wp
      call lumped_mass(line, share)
      call check_near(error, share, [1.0_wp, 4.0_wp, 1.0_wp]/6.0_wp, 4.0_wp*eps, 1.0_wp, "rows")
      line(1, 3) = -0.2_wp
      line(3, 1) = -0.2_wp
      call lumped_mass(line, share)
      call check_near(error, share, sum(line)*[1.0_wp, 4.0_wp, 1.0_wp]/6.0_wp, 4.0_wp*eps, 1.0_wp, &
         "diagonal")
   end subroutine test_lumped

end module test_critical_step
