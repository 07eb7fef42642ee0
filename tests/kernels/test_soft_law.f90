!> Contact that gives way: what a push takes is what is stored, and its slope is its derivative.
module test_soft_law
   use check, only : check_near, check_true, test_case_t
   use emcon_constraint, only : contact_response_t
   use emcon_contact_law, only : contact_law_t, contact_place_t, contact_values_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_penalty_law, only : augmented_t, penalty_t
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
         test_case_t("what stores nothing pushes by what is left, and pulls", test_left), &
         test_case_t("on a part of an area, from what the step before has left", test_part), &
         test_case_t("an augmented Lagrangian is linear", test_augmented)]
   end subroutine collect_soft_law

   !> The answer to a gap that goes from `from` to `to`, which it is to be 0 at the end.
   type(contact_response_t) function response_of(law, from, to) result(response)
      class(contact_law_t), intent(inout) :: law
      real(wp), intent(in) :: from, to

      call law%respond(contact_values_t(gap0=from, gap1=to, dgap=to - from, left=to), response)
   end function response_of

   subroutine test_work(error)
      type(error_t), allocatable, intent(out) :: error
      type(penalty_t) :: law
      type(contact_response_t) :: response
      real(wp) :: before
      integer :: k

      law%stiffness = stiffness
      do k = 1, size(gaps, 2)
         associate (g => gaps(:, k))
            law%now = g(1)
            before = law%stored()
            response = response_of(law, g(1), g(2))
            call check_near(error, response%lam*(g(2) - g(1)), before - law%stored(), &
               8.0_wp*epsilon(1.0_wp), stiffness, "work")
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
      type(penalty_t) :: law
      type(contact_response_t) :: response
      real(wp) :: taken, start
      integer :: k

      law%stiffness = stiffness
      response = response_of(law, -0.5_wp, -0.25_wp)
      call check_near(error, [response%lam, law%now], [0.375_wp*stiffness, -0.25_wp], &
         epsilon(1.0_wp), stiffness, "nothing is known of a step before")
      taken = 0.0_wp
      law%before = 0.0_wp
      do k = 1, size(ends)
         associate (g => moved(:, k))
            call check_true(error, law%gives_back() .eqv. law%before < 0.0_wp, "it gives back")
            response = response_of(law, g(1), g(2))
            call check_near(error, law%now, ends(k), 4.0_wp*epsilon(1.0_wp), 1.0_wp, "end")
            start = law%now - (g(2) - g(1))
            taken = taken - response%lam*(law%now - start)
            call check_near(error, law%stored(), taken, 16.0_wp*epsilon(1.0_wp), stiffness, &
               "stored")
            law%before = law%closure()
         end associate
      end do
   end subroutine test_follow

   !> Central differences, exact but for their square and for rounding over it; the law has one
   !> slope but no second one where a gap is 0.
   subroutine test_slope(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: d = epsilon(1.0_wp)**(1.0_wp/3.0_wp)
      type(penalty_t) :: law
      type(contact_response_t) :: low, high, response
      integer :: k

      law%stiffness = stiffness
      do k = 1, 4
         associate (g => gaps(:, k))
            low = response_of(law, g(1), g(2) - d)
            high = response_of(law, g(1), g(2) + d)
            response = response_of(law, g(1), g(2))
            call check_near(error, (low%lam - high%lam)/(2.0_wp*d), response%stiffness(0, 0), &
               16.0_wp*d**2, stiffness, "slope")
         end associate
      end do
   end subroutine test_slope

   subroutine test_sign(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: starts(3) = [-1.0_wp, 0.5_wp, 2.0_wp]
      real(wp), parameter :: near = 1.0e-6_wp
      type(penalty_t) :: law
      type(contact_response_t) :: response, beside
      integer :: k

      law%stiffness = stiffness
      do k = 1, size(gaps, 2)
         response = response_of(law, gaps(1, k), gaps(2, k))
         associate (slope => response%stiffness(0, 0))
            call check_true(error, min(response%lam, slope) >= 0.0_wp, "pushes")
            call check_true(error, slope <= 0.5_wp*law%stiffest(), "no stiffer than where closed")
         end associate
      end do
      do k = 1, size(starts)
         response = response_of(law, starts(k), near)
         beside = response_of(law, starts(k), -near)
         call check_near(error, response%stiffness(0, 0), beside%stiffness(0, 0), 8.0_wp*near, &
            stiffness, "slopes")
      end do
   end subroutine test_sign

   !> Where multipliers belong to the end of a step.
   subroutine test_left(error)
      type(error_t), allocatable, intent(out) :: error
      type(penalty_t) :: law
      type(contact_response_t) :: response
      integer :: k

      law%stiffness = stiffness
      law%before = -0.5_wp
      do k = -1, 1
         call law%respond(contact_values_t(gap0=-0.5_wp, gap1=0.25_wp, dgap=0.75_wp, &
            left=0.125_wp*k, is_stored=.false.), response)
         call check_near(error, [response%lam, response%stiffness(0, 0), law%now], &
            [-0.125_wp*k*stiffness, stiffness, 0.25_wp], 0.0_wp, 1.0_wp, "push, slope and end")
      end do
   end subroutine test_left

   !> A part p of the area: what is stored is a function of p times the mean gap, which a step
   !> leaves to the next one whose part is another. A push-back is by the mean gap itself.
   subroutine test_part(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_place_t), parameter :: place = contact_place_t(area=7.0_wp, &
         stiffness=stiffness, share=0.25_wp, closure=-0.125_wp)
      real(wp), parameter :: left(2) = [0.125_wp, 0.5_wp]
      type(penalty_t) :: law
      type(augmented_t) :: augmented
      type(contact_response_t) :: response
      integer :: k

      do k = 1, size(left)
         call law%begin(place)
         call check_near(error, [law%stiffest(), law%before], [stiffness/16.0_wp, -0.5_wp], &
            0.0_wp, 1.0_wp, "stiffness and start")
         response = response_of(law, 0.0_wp, left(k))
         call check_near(error, law%closure(), 0.25_wp*min(0.0_wp, left(k) - 0.5_wp), 0.0_wp, &
            1.0_wp, "closure")
         call check_near(error, law%stored(), 0.5_wp*stiffness*law%closure()**2, 0.0_wp, 1.0_wp, &
            "stored")
      end do
      call augmented%begin(place)
      call check_near(error, [augmented%stiffest(), augmented%share, augmented%before, &
         augmented%base], [stiffness, 0.25_wp, -0.5_wp, 0.0_wp], 0.0_wp, 1.0_wp, "pushed back")
      call augmented%push_on(2.0_wp)
      response = response_of(augmented, 1.0_wp, 0.5_wp)
      call check_near(error, [response%lam, augmented%now], [2.0_wp - 0.5_wp*stiffness, 0.5_wp], &
         0.0_wp, 1.0_wp, "goes on from the multiplier")
   end subroutine test_part

   subroutine test_augmented(error)
      type(error_t), allocatable, intent(out) :: error
      type(augmented_t) :: law
      type(contact_response_t) :: response

      law%stiffness = stiffness
      law%base = 2.0_wp
      response = response_of(law, 1.0_wp, -0.5_wp)
      call check_near(error, response%lam, 3.5_wp, 4.0_wp*epsilon(1.0_wp), 1.0_wp, "push")
      call check_near(error, response%stiffness(0, 0), stiffness, epsilon(1.0_wp), 1.0_wp, "slope")
   end subroutine test_augmented

end module test_soft_law
