!> Friction with a slope of stick: work, losses, closed forms, derivatives.
module test_elastic_slip
   use check, only : check_near, check_true, test_case_t
   use emcon_constraint, only : most_slips
   use emcon_elastic_slip, only : elastic_slip_at_end, elastic_slip_open, elastic_slip_over, &
      elastic_slip_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_elastic_slip

   real(wp), parameter :: eps = epsilon(1.0_wp), tol = 64.0_wp*eps

contains

   subroutine collect_elastic_slip(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("work is what is stored and lost", test_work), &
         test_case_t("back and forth in closed form", test_cycle), &
         test_case_t("derivatives", test_derivatives)]
   end subroutine collect_elastic_slip

   !> Steps of any size and direction under limits that change: in one direction and in two.
   subroutine test_work(error)
      type(error_t), allocatable, intent(out) :: error
      type(elastic_slip_t) :: spring
      real(wp) :: slip(most_slips), limit, before
      integer :: i

      do i = 1, 2000
         if (mod(i, 100) == 1) spring = elastic_slip_t()
         call draw_random(slip)
         slip = 4.0_wp*(slip - 0.5_wp)
         if (i > 1000) slip(2:) = 0.0_wp
         call draw_random(limit)
         before = 0.5_wp*sum(spring%stretch**2)
         call elastic_slip_over(spring, limit, slip)
         call check_near(error, dot_product(spring%drag, slip), 0.5_wp*sum(spring%stretch**2) &
            - before + spring%loss, tol, 4.0_wp, "work")
         call check_true(error, spring%loss >= 0.0_wp, "no gain")
         call check_true(error, norm2(spring%stretch) <= limit*(1.0_wp + tol), "limit")
         if (i > 1000) call check_true(error, norm2(spring%drag) <= limit*(1.0_wp + tol), &
            "the mean force, too, where it goes to and fro")
         if (mod(i, 10) > 0) cycle
         before = 0.5_wp*sum(spring%stretch**2)
         call elastic_slip_open(spring)
         call check_near(error, spring%loss - before, spring%loss - before, tol, 1.0_wp, "open")
         call check_true(error, .not. any(abs(spring%stretch) > 0.0_wp), "nothing is left")
      end do
   end subroutine test_work

   !> To the limit and beyond, back by less than twice that, and on to the other side.
   subroutine test_cycle(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: limit = 0.5_wp
      type(elastic_slip_t) :: spring
      real(wp) :: slip(most_slips)

      slip = 0.0_wp
      slip(1) = 2.0_wp
      call elastic_slip_over(spring, limit, slip)
      call check_near(error, [spring%stretch(1), spring%drag(1), spring%loss], &
         [0.5_wp, (0.125_wp + 0.75_wp)/2.0_wp, 0.75_wp], tol, 1.0_wp, "to the limit")
      slip(1) = -0.8_wp
      call elastic_slip_over(spring, limit, slip)
      call check_near(error, [spring%stretch(1), spring%drag(1), spring%loss], &
         [-0.3_wp, 0.1_wp, 0.0_wp], tol, 1.0_wp, "back")
      call elastic_slip_at_end(spring, limit, 2.0_wp*slip)
      call check_near(error, [spring%stretch(1), spring%drag(1)], [-0.5_wp, -0.5_wp], tol, 1.0_wp, &
         "at the other limit")
      call elastic_slip_over(spring, 0.5_wp*limit, 0.0_wp*slip)
      call check_near(error, [spring%stretch(1), spring%drag(1), spring%loss], [-0.25_wp, &
         -0.25_wp, 0.09375_wp], tol, 1.0_wp, "a limit that falls")
   end subroutine test_cycle

   !> By slip and limit, of both forms, stuck, sliding, and where the limit has fallen.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: step = eps**(1.0_wp/3.0_wp)
      type(elastic_slip_t) :: start, spring, up, down
      real(wp) :: slip(most_slips), limit, way(most_slips), worst
      integer :: i, k

      do i = 1, 400
         call draw_random(start%stretch)
         call draw_random(slip)
         call draw_random(limit)
         start%stretch = start%stretch - 0.5_wp
         slip = 0.2_wp + 2.0_wp*(slip - 0.4_wp)
         limit = 0.1_wp + 2.0_wp*limit
         if (abs(norm2(start%stretch) - limit) < 10.0_wp*step) cycle
         spring = after(start, limit, slip, i)
         if (abs(norm2(spring%stretch) - limit) < 10.0_wp*step .and. &
            norm2(min(norm2(start%stretch), limit)*start%stretch/norm2(start%stretch) + slip) &
            - limit < 10.0_wp*step) cycle
         worst = 0.0_wp
         do k = 1, most_slips
            way = 0.0_wp
            way(k) = step
            up = after(start, limit, slip + way, i)
            down = after(start, limit, slip - way, i)
            worst = max(worst, maxval(abs((up%drag - down%drag)/(2.0_wp*step) &
               - spring%by_slip(:, k))))
         end do
         up = after(start, limit + step, slip, i)
         down = after(start, limit - step, slip, i)
         worst = max(worst, maxval(abs((up%drag - down%drag)/(2.0_wp*step) - spring%by_limit)))
         ! Third derivatives are some 1/0.1^3.
         call check_true(error, worst < 1.0e4_wp*step**2, "case " // to_text(i) // ": " &
            // to_text(worst))
      end do
   end subroutine test_derivatives

   pure type(elastic_slip_t) function after(start, limit, slip, i)
      type(elastic_slip_t), intent(in) :: start
      real(wp), intent(in) :: limit, slip(:)
      integer, intent(in) :: i                   !! odd: over the step, even: at its end

      after = start
      if (mod(i, 2) == 1) call elastic_slip_over(after, limit, slip)
      if (mod(i, 2) == 0) call elastic_slip_at_end(after, limit, slip)
   end function after

end module test_elastic_slip
