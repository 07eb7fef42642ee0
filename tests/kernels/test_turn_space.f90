!> Rotations by rotation vectors: closed forms, lengths, rates, small and large angles.
module test_turn_space
   use check, only : check_near, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   use emcon_turn_space, only : turn_arm_space
   implicit none
   private
   public :: collect_turn_space

   real(wp), parameter :: eps = epsilon(1.0_wp), tol = 16.0_wp*eps
   real(wp), parameter :: arm(3) = [0.3_wp, -0.7_wp, 0.5_wp], still(3) = 0.0_wp

contains

   subroutine collect_turn_space(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("about an axis: cosine and sine", test_axis), &
         test_case_t("no angle, tiny ones, and where series end", test_small), &
         test_case_t("velocities are differences", test_rate)]
   end subroutine collect_turn_space

   !> About z by any angle, several turns included; lengths stay about any axis.
   subroutine test_axis(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: w(3), v(3), angle
      integer :: k

      do k = -20, 20
         angle = 0.47_wp*k
         call turn_arm_space(arm, [0.0_wp, 0.0_wp, angle], [0.0_wp, 0.0_wp, 2.0_wp], w, v)
         call check_near(error, arm + w, [cos(angle)*arm(1) - sin(angle)*arm(2), &
            sin(angle)*arm(1) + cos(angle)*arm(2), arm(3)], tol, 10.0_wp, "about z")
         call check_near(error, v, 2.0_wp*[-(arm(2) + w(2)), arm(1) + w(1), 0.0_wp], tol, 1.0_wp, &
            "spin about z")
         call turn_arm_space(arm, 0.1_wp*k*[1.0_wp, -2.0_wp, 0.5_wp], still, w, v)
         call check_near(error, norm2(arm + w), norm2(arm), tol, 1.0_wp, "length")
      end do
   end subroutine test_axis

   !> Small ones are turns by the first order; on either side of the end of series both agree.
   subroutine test_small(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: axis(3) = [2.0_wp, -1.0_wp, 2.0_wp]/3.0_wp, rate(3) = [1.0_wp, &
         2.0_wp, -1.0_wp]
      real(wp) :: w(3), v(3), other_w(3), other_v(3), angle

      call turn_arm_space(arm, still, rate, w, v)
      call check_near(error, w, still, 0.0_wp, 1.0_wp, "no angle")
      call check_near(error, v, cross_product(rate, arm), tol, 1.0_wp, "its rate")
      call turn_arm_space(arm, sqrt(eps)*axis, rate, w, v)
      call check_near(error, w, sqrt(eps)*cross_product(axis, arm), tol, 1.0_wp, "tiny")
      angle = sqrt(0.1_wp)
      call turn_arm_space(arm, (angle - 2.0_wp*eps)*axis, rate, w, v)
      call turn_arm_space(arm, (angle + 2.0_wp*eps)*axis, rate, other_w, other_v)
      call check_near(error, w, other_w, tol, 1.0_wp, "where series end")
      call check_near(error, v, other_v, 4.0_wp*tol, 1.0_wp, "rates there")
   end subroutine test_small

   subroutine test_rate(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: start(3) = [0.4_wp, -0.9_wp, 1.1_wp], rate(3) = [1.0_wp, 0.3_wp, &
         -0.7_wp]
      real(wp), parameter :: h = eps**(1.0_wp/3.0_wp)
      real(wp) :: before(3), after(3), w(3), v(3), none(3), size
      integer :: k

      do k = 0, 12
         size = 2.0_wp**(2 - k)
         call turn_arm_space(arm, size*start, rate, w, v)
         call turn_arm_space(arm, size*start - h*rate, still, before, none)
         call turn_arm_space(arm, size*start + h*rate, still, after, none)
         call check_near(error, v, (after - before)/(2.0_wp*h), 10.0_wp*h**2, 10.0_wp, "rate")
      end do
   end subroutine test_rate

end module test_turn_space
