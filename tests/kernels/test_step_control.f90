!> Sizes of increments that follow the error: what is asked for, when it is taken, what is counted.
module test_step_control
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_step_control, only : control_accept, control_begin, control_refuse, control_sizes, &
      most_power, step_control_t, why_contact, why_error, why_newton
   use emcon_text, only : notes_t, to_text
   implicit none
   private
   public :: collect_step_control

   real(wp), parameter :: tol = 16.0_wp*epsilon(1.0_wp)
   integer, parameter :: least = -5, largest = 3

contains

   subroutine collect_step_control(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("five of a size, then twice that", test_doubling), &
         test_case_t("the error asks for a size", test_asked), &
         test_case_t("smaller at once, larger after a while", test_choice), &
         test_case_t("what was refused is made shorter", test_refused), &
         test_case_t("slow solves halve", test_slow), &
         test_case_t("a step begins", test_begin), &
         test_case_t("sizes are counted", test_sizes)]
   end subroutine collect_step_control

   !> Without an error that is judged, up to the largest size.
   subroutine test_doubling(error)
      type(error_t), allocatable, intent(out) :: error
      type(step_control_t) :: control
      integer :: k, power(22)

      do k = 1, size(power)
         call control_accept(control, scale(1.0_wp, control%power), -1.0_wp, .false., least, &
            largest)
         power(k) = control%power
         if (k < 20) call check_near(error, control%asked, scale(1.0_wp, power(k)), 0.0_wp, &
            1.0_wp, "asked for")
      end do
      call check_equal(error, power, [0, 0, 0, 0, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3, &
         3, 3], "powers")
      call check_equal(error, control%n_same, 7, "of the largest size")
      call check_equal(error, [control%n_over, sum(control%n_less)], [0, 0], "nothing else")
      control = step_control_t(asked=0.8_wp)
      call control_accept(control, 1.0_wp, -1.0_wp, .false., least, largest)
      call check_near(error, control%asked, 1.0_wp, 0.0_wp, 1.0_wp, "no less than what succeeded")
   end subroutine test_doubling

   !> A controller with integral and proportional part; an error goes with the square of the size,
   !> and what is asked for changes by a factor of two at most.
   subroutine test_asked(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: size_of(4) = [1.0_wp, 1.0_wp, 0.5_wp, 1.0_wp]
      real(wp), parameter :: ratio(4) = [0.25_wp, 0.75_wp, 0.4_wp, 1.25_wp]
      type(step_control_t) :: control
      real(wp) :: asked, before, now
      integer :: k

      asked = 1.0_wp
      before = 0.0_wp
      do k = 1, size(ratio)
         call control_accept(control, size_of(k), ratio(k), .false., least, largest)
         now = ratio(k)*(asked/size_of(k))**2
         if (k == 1) before = now
         asked = asked*(0.5_wp/now)**0.15_wp*(before/now)**0.2_wp
         before = now
         call check_near(error, control%asked, asked, tol, 1.0_wp, "size " // to_text(k))
         call check_near(error, control%ratio, now, tol, 1.0_wp, "error " // to_text(k))
      end do
      call check_equal(error, control%n_over, 1, "errors over the tolerance")
      ! Of errors that are far off what is asked for halves or doubles.
      control = step_control_t(asked=0.8_wp, ratio=0.5_wp)
      call control_accept(control, 1.0_wp, 1.0e6_wp, .false., least, largest)
      call check_near(error, control%asked, 0.4_wp, tol, 1.0_wp, "half")
      control = step_control_t(asked=0.8_wp, ratio=0.5_wp)
      call control_accept(control, 1.0_wp, 0.0_wp, .false., least, largest)
      call check_near(error, control%asked, 1.6_wp, tol, 1.0_wp, "twice")
      call check_near(error, control%ratio, 0.64_wp*epsilon(1.0_wp), tol, epsilon(1.0_wp), &
         "an error of 0 counts as round-off")
   end subroutine test_asked

   !> Of power 0 with what is asked for, which errors of the size that is aimed at leave.
   subroutine test_choice(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: asked(8) = [0.76_wp, 0.74_wp, 0.3_wp, 0.01_wp, 0.01_wp, 1.99_wp, &
         2.0_wp, 2.0_wp]
      integer, parameter :: n_same(8) = [9, 0, 0, 0, 0, 9, 3, 4]
      integer, parameter :: lowest(8) = [-5, -5, -5, -7, 0, -5, -5, -5]
      integer, parameter :: power(8) = [0, -1, -2, -7, 0, 0, 0, 1]
      type(step_control_t) :: control
      integer :: k

      do k = 1, size(asked)
         control = step_control_t(asked=asked(k), ratio=0.5_wp, n_same=n_same(k))
         call control_accept(control, asked(k), 0.5_wp, .false., lowest(k), largest)
         call check_equal(error, control%power, power(k), "power " // to_text(k))
         call check_equal(error, control%n_same, merge(n_same(k) + 1, 0, power(k) == 0), &
            "increments of the size " // to_text(k))
         call check_near(error, control%asked, max(asked(k), scale(1.0_wp, lowest(k))), tol, &
            1.0_wp, "asked " // to_text(k))
      end do
      control = step_control_t(power=largest, asked=64.0_wp, ratio=0.5_wp, n_same=9)
      call control_accept(control, 64.0_wp, 0.5_wp, .false., least, largest)
      call check_near(error, control%asked, 16.0_wp, tol, 1.0_wp, "twice the size at most")
      call check_equal(error, [control%power, control%n_same], [largest, 10], "the largest stays")
   end subroutine test_choice

   !> By the square root of the error, between an eighth and a half of what was tried, which may
   !> have been less than the size.
   subroutine test_refused(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: tried(7) = [1.0_wp, 1.0_wp, 1.0_wp, 1.0_wp, 0.25_wp, 4.0_wp, 1.0_wp]
      real(wp), parameter :: ratio(7) = [0.0_wp, 1.2_wp, 8.0_wp, 1.0e3_wp, 0.0_wp, 0.0_wp, 1.0e3_wp]
      integer, parameter :: power(7) = [-1, -1, -2, -3, -3, -1, -2]
      type(step_control_t) :: control
      integer :: k

      do k = 1, size(tried)
         control = step_control_t(ratio=0.5_wp, n_same=3)
         call control_refuse(control, tried(k), ratio(k), why_contact, merge(-2, -9, k == 7))
         call check_equal(error, control%power, power(k), "power " // to_text(k))
         call check_near(error, [control%asked, control%ratio], [scale(1.0_wp, power(k)), 0.0_wp], &
            0.0_wp, 1.0_wp, "the error is forgotten")
         call check_equal(error, [control%n_same, sum(control%n_less), &
            control%n_less(why_contact)], [0, 1, 1], "counts")
      end do
      call control_refuse(control, 1.0_wp, 2.0_wp, why_error, -9)
      call control_refuse(control, 1.0_wp, 2.0_wp, why_error, -9)
      call check_equal(error, [control%n_less(why_error), control%power], [2, -4], "once more")
   end subroutine test_refused

   !> Down to an eighth of the increment of the deck.
   subroutine test_slow(error)
      type(error_t), allocatable, intent(out) :: error
      type(step_control_t) :: control
      integer :: k, power(5)

      do k = 1, size(power)
         call control_accept(control, scale(1.0_wp, control%power), 0.5_wp, .true., least, largest)
         power(k) = control%power
      end do
      call check_equal(error, power, [-1, -2, -3, -3, -3], "powers")
      call check_equal(error, [control%n_less(why_newton), sum(control%n_less)], [5, 5], "counts")
   end subroutine test_slow

   subroutine test_begin(error)
      type(error_t), allocatable, intent(out) :: error
      type(step_control_t) :: control

      control = step_control_t(power=-2, asked=0.25_wp, ratio=0.5_wp, n_same=3, h_before=0.1_wp, &
         n_known=2, n_event=4)
      call control_begin(control)
      call check_equal(error, [control%power, control%n_same, control%n_known, control%n_event], &
         [0, 0, 0, 4], "counts")
      call check_near(error, [control%asked, control%ratio, control%h_before], &
         [1.0_wp, 0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "sizes")
   end subroutine test_begin

   !> Sizes between two powers of two count as the smaller one, those out of range as the last.
   subroutine test_sizes(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: taken(7) = [1.0_wp, 0.25_wp, 0.3_wp, 2.0_wp, 1.99_wp, &
         2.0_wp**(most_power + 5), 8.0_wp]
      type(step_control_t) :: control
      type(notes_t) :: sizes
      integer :: k

      do k = 1, size(taken)
         call control_accept(control, taken(k), -1.0_wp, .false., least, largest)
      end do
      call check_equal(error, sum(control%n_size), size(taken), "increments")
      call check_equal(error, control%n_size([-2, 0, 1, 3, most_power]), [2, 2, 1, 1, 1], "sizes")
      control%n_size(most_power) = 0
      call control_sizes(control, sizes)
      call check_equal(error, sizes%n, 4, "lines")
      call check_true(error, sizes%n == 4, "lines")
      if (allocated(error)) return
      call check_equal(error, sizes%item(1)%text, "h/4: 2", "smallest")
      call check_equal(error, sizes%item(2)%text, "h: 2", "that of the deck")
      call check_equal(error, sizes%item(3)%text, "2h: 1", "twice that")
   end subroutine test_sizes

end module test_step_control
