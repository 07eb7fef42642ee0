!> What follows from how residuals come down.
module test_convergence
   use check, only : check_equal, check_near, test_case_t
   use emcon_convergence, only : convergence_begin, convergence_init, convergence_judge, &
      convergence_t, next_done, next_give_up, next_old_tangent, next_tangent
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: collect_convergence

   integer, parameter :: maximum = 20

contains

   subroutine collect_convergence(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("forces that fall with their residual", test_falling), &
         test_case_t("defects that stay while forces fall", test_defects), &
         test_case_t("slow corrections by a kept factor", test_slow)]
   end subroutine collect_convergence

   !> Iterations until the end, with a residual that is most of forces that fall each time; and how
   !> much of a correction was taken at least.
   subroutine run(fall, defect, n, least)
      real(wp), intent(in) :: fall               !! of forces from one iteration to the next
      real(wp), intent(in) :: defect
      integer, intent(out) :: n
      real(wp), intent(out) :: least
      type(convergence_t) :: convergence
      real(wp) :: force
      integer :: next

      call convergence_init(convergence, 1.0e-10_wp, maximum)
      call convergence_begin(convergence)
      force = 1.0_wp
      least = 1.0_wp
      do n = 0, maximum
         call convergence_judge(convergence, 0.75_wp, defect, force, .false., next)
         least = min(least, convergence%damping)
         if (next /= next_tangent) exit
         convergence%n_iteration = convergence%n_iteration + 1
         force = force/fall
      end do
      if (next /= next_give_up) n = -1
   end subroutine run

   !> As many as there may be, and whole corrections; a stall where forces stay.
   subroutine test_falling(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: least
      integer :: n

      call run(exp(1.0_wp), 0.0_wp, n, least)
      call check_equal(error, n, maximum, "iterations as forces fall")
      call check_near(error, least, 1.0_wp, 0.0_wp, 1.0_wp, "part of corrections")
      call run(1.0_wp, 0.0_wp, n, least)
      call check_equal(error, n, 7, "iterations as forces stay")
   end subroutine test_falling

   !> Gaps are measured by edges, which do not change.
   subroutine test_defects(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: least
      integer :: n

      call run(exp(1.0_wp), 0.8_wp, n, least)
      call check_equal(error, n, 7, "iterations as gaps stay")
   end subroutine test_defects

   !> A kept factor is renewed once for its age; corrections that stay as slow go on to round-off.
   subroutine test_slow(error)
      type(error_t), allocatable, intent(out) :: error
      type(convergence_t) :: convergence
      real(wp), parameter :: left = 0.4_wp
      real(wp) :: size
      integer :: next, n_tangent

      call convergence_init(convergence, 1.0e-10_wp, maximum)
      call convergence_begin(convergence)
      convergence%is_kept = .true.
      size = 1.0e-2_wp
      n_tangent = 0
      do
         call convergence_judge(convergence, size, 0.0_wp, 1.0_wp, .false., next)
         if (next == next_tangent) n_tangent = n_tangent + 1
         if (next == next_old_tangent) size = left*size
         if (next == next_done .or. next == next_give_up) exit
      end do
      call check_equal(error, next, next_done, "the end")
      call check_equal(error, n_tangent, 1, "factors that were renewed")
   end subroutine test_slow

end module test_convergence
