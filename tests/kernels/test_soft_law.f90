!> Contact that gives way: what a push takes is what is stored, and its slope is its derivative; the
!> corrections that know the slope are those of the stiffened matrix.
module test_soft_law
   use check, only : check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_soft_law, only : soft_augmented, soft_energy, soft_follow, soft_penalty, soft_t
   implicit none
   private
   public :: collect_soft_law

   !> Gaps at the start and the end: closed, open, on the way in and out, hardly so, and at 0.
   real(wp), parameter :: gaps(2, 9) = reshape([-0.5_wp, -0.25_wp, 0.5_wp, 0.25_wp, 0.5_wp, &
      -0.25_wp, -0.5_wp, 0.25_wp, 1.0_wp, -1.0e-9_wp, -1.0e-9_wp, 1.0_wp, 0.0_wp, 0.0_wp, &
      0.0_wp, -1.0_wp, -1.0_wp, 0.0_wp], [2, 9])
   real(wp), parameter :: stiffness = 3.0_wp

contains

   subroutine collect_soft_law(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("what a penalty takes is what it stores", test_work), &
         test_case_t("and goes on with it where gaps are found anew", test_follow), &
         test_case_t("its slope is its derivative", test_slope), &
         test_case_t("it never pulls, and has one slope at a gap of 0", test_sign), &
         test_case_t("an augmented Lagrangian is linear", test_augmented)]
   end subroutine collect_soft_law

   subroutine test_work(error)
      type(error_t), allocatable, intent(out) :: error
      type(soft_t) :: soft
      real(wp) :: lam
      integer :: k

      soft%stiffness = stiffness
      do k = 1, size(gaps, 2)
         associate (g => gaps(:, k))
            call soft_penalty(soft, g(1), g(2), lam)
            call check_near(error, lam*(g(2) - g(1)), soft_energy(soft, g(1)) &
               - soft_energy(soft, g(2)), 8.0_wp*epsilon(1.0_wp), stiffness, "work")
         end associate
      end do
   end subroutine test_work

   !> Steps each of which finds the gap elsewhere than the one before has left it: what was taken so
   !> far is what is stored, and no step begins with another push than the last one ended with.
   subroutine test_follow(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: moved(2, 6) = reshape([0.3_wp, -0.2_wp, -0.35_wp, -0.3_wp, 0.05_wp, &
         -0.1_wp, -0.4_wp, 0.2_wp, -0.1_wp, -0.15_wp, 0.5_wp, 0.4_wp], [2, 6])
      real(wp), parameter :: ends(6) = [-0.2_wp, -0.15_wp, -0.3_wp, 0.3_wp, -0.05_wp, -0.15_wp]
      type(soft_t) :: soft
      real(wp) :: lam, start, taken
      integer :: k

      soft%stiffness = stiffness
      call soft_follow(soft, -0.5_wp, -0.25_wp, 0.25_wp, start)
      call check_near(error, [start, soft%now], [-0.5_wp, -0.25_wp], epsilon(1.0_wp), 1.0_wp, &
         "nothing is known of a step before")
      taken = 0.0_wp
      soft%before = 0.0_wp
      do k = 1, size(ends)
         associate (g => moved(:, k))
            call soft_follow(soft, g(1), g(2), g(2) - g(1), start)
            call check_near(error, min(start, 0.0_wp), soft%before, epsilon(1.0_wp), 1.0_wp, &
               "start")
            call check_near(error, soft%now, ends(k), 4.0_wp*epsilon(1.0_wp), 1.0_wp, "end")
            call soft_penalty(soft, start, soft%now, lam)
            taken = taken - lam*(soft%now - start)
            call check_near(error, soft_energy(soft, soft%now), taken, 16.0_wp*epsilon(1.0_wp), &
               stiffness, "stored")
            soft%before = min(soft%now, 0.0_wp)
         end associate
      end do
   end subroutine test_follow

   !> Central differences, exact but for their square and for rounding over it; the law has one
   !> slope but no second one where a gap is 0.
   subroutine test_slope(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: d = epsilon(1.0_wp)**(1.0_wp/3.0_wp)
      type(soft_t) :: soft
      real(wp) :: lam(2), bound
      integer :: k

      soft%stiffness = stiffness
      do k = 1, 4
         associate (g => gaps(:, k))
            call soft_penalty(soft, g(1), g(2) - d, lam(1))
            call soft_penalty(soft, g(1), g(2) + d, lam(2))
            call soft_penalty(soft, g(1), g(2), bound)
            bound = 16.0_wp*d**2
            call check_near(error, (lam(1) - lam(2))/(2.0_wp*d), soft%slope, bound, stiffness, &
               "slope")
         end associate
      end do
   end subroutine test_slope

   subroutine test_sign(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: starts(3) = [-1.0_wp, 0.5_wp, 2.0_wp]
      real(wp), parameter :: near = 1.0e-6_wp
      type(soft_t) :: soft, beside
      real(wp) :: lam
      integer :: k

      soft%stiffness = stiffness
      beside%stiffness = stiffness
      do k = 1, size(gaps, 2)
         call soft_penalty(soft, gaps(1, k), gaps(2, k), lam)
         call check_true(error, lam >= 0.0_wp .and. soft%slope >= 0.0_wp, "pushes")
         call check_true(error, soft%slope <= 0.5_wp*stiffness, "no stiffer than where closed")
      end do
      do k = 1, size(starts)
         call soft_penalty(soft, starts(k), near, lam)
         call soft_penalty(beside, starts(k), -near, lam)
         call check_near(error, soft%slope, beside%slope, 8.0_wp*near, stiffness, "slopes")
      end do
   end subroutine test_sign

   subroutine test_augmented(error)
      type(error_t), allocatable, intent(out) :: error
      type(soft_t) :: soft
      real(wp) :: lam

      soft = soft_t(stiffness, 2.0_wp, 0.0_wp, -0.5_wp)
      call soft_augmented(soft, lam)
      call check_near(error, lam, 3.5_wp, 4.0_wp*epsilon(1.0_wp), 1.0_wp, "push")
      call check_near(error, soft%slope, stiffness, epsilon(1.0_wp), 1.0_wp, "slope")
   end subroutine test_augmented

end module test_soft_law
