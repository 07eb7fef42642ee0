!> Anderson's mixing: as many moves as a linear problem has directions, scaling, standing still.
module test_mixing
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_mixing, only : mixing_begin, mixing_move, mixing_t
   implicit none
   private
   public :: collect_mixing

   integer, parameter :: n = 40

contains

   subroutine collect_mixing(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a linear problem of four directions", test_linear), &
         test_case_t("it gains on plain moves", test_gain), &
         test_case_t("powers of two keep the bits", test_powers_of_two), &
         test_case_t("moves that change nothing", test_standstill)]
   end subroutine collect_mixing

   !> f = b - A x with four different eigenvalues: the fifth move ends at the solution, as least
   !> squares over four changes make f vanish.
   subroutine test_linear(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: size_of_f(8)

      call iterate([0.5_wp, 0.8_wp, 1.2_wp, 1.5_wp], 1.0_wp, size_of_f)
      call check_true(error, size_of_f(5) > 1.0e-6_wp, "not before")
      call check_near(error, size_of_f(6), 0.0_wp, 1.0e4_wp*epsilon(1.0_wp), 1.0_wp, "|f|")
   end subroutine test_linear

   !> Ten eigenvalues from 0.4 to 1.6: plain moves gain 0.6 each.
   subroutine test_gain(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: size_of_f(12)
      integer :: i

      call iterate([(0.4_wp + 1.2_wp*real(i, wp)/9.0_wp, i = 0, 9)], 1.0_wp, size_of_f)
      call check_true(error, size_of_f(12) < 1.0e-2_wp*0.6_wp**11*size_of_f(1), "a hundredth")
   end subroutine test_gain

   !> Unknowns in other units: the same moves.
   subroutine test_powers_of_two(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: once(12), scaled(12)

      call iterate([0.4_wp, 0.7_wp, 0.9_wp, 1.1_wp, 1.3_wp, 1.4_wp, 1.6_wp], 1.0_wp, once)
      call iterate([0.4_wp, 0.7_wp, 0.9_wp, 1.1_wp, 1.3_wp, 1.4_wp, 1.6_wp], 2.0_wp**(-37), scaled)
      call check_true(error, all(abs(scaled*2.0_wp**37 - once) <= 0.0_wp), "all bits")
   end subroutine test_powers_of_two

   !> The same f again and again says nothing: moves are f.
   subroutine test_standstill(error)
      type(error_t), allocatable, intent(out) :: error
      type(mixing_t) :: mixing
      real(wp) :: f(n), move(n)
      integer :: i

      f = 1.0_wp
      call mixing_begin(mixing, n)
      do i = 1, 7
         call mixing_move(mixing, f, move)
         call check_equal(error, count(abs(move - f) > 0.0_wp), 0, "moves that are not f")
      end do
   end subroutine test_standstill

   !> Sizes of f = scale*b - diag(value) x along an iteration from 0; the values repeat.
   subroutine iterate(value, scale, size_of_f)
      real(wp), intent(in) :: value(:), scale
      real(wp), intent(out) :: size_of_f(:)
      type(mixing_t) :: mixing
      real(wp) :: x(n), f(n), move(n)
      integer :: i, k

      x = 0.0_wp
      call mixing_begin(mixing, n)
      do k = 1, size(size_of_f)
         do i = 1, n
            f(i) = scale/real(i, wp) - value(1 + mod(i, size(value)))*x(i)
         end do
         size_of_f(k) = maxval(abs(f))
         call mixing_move(mixing, f, move)
         x = x + move
      end do
   end subroutine iterate

end module test_mixing
