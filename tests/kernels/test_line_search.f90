!> How much of a correction is taken where the force turns on the way.
module test_line_search
   use check, only : check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_line_search, only : line_search_begin, line_search_t, line_search_take, &
      line_search_work
   use emcon_text, only : to_text
   implicit none
   private
   public :: collect_line_search

   !> Half width of the corner that is looked for, as part of the correction.
   real(wp), parameter :: width = 1.0e-4_wp

contains

   subroutine collect_line_search(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("what is short or ends well is taken whole", test_whole), &
         test_case_t("the tangent tells the work where the residual is round-off", test_work), &
         test_case_t("a corner on the way is met", test_corner), &
         test_case_t("a sharp corner ends the search between its sides", test_sharp)]
   end subroutine collect_line_search

   subroutine test_whole(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: work(2, 5) = reshape([-1.0_wp, 0.4_wp, -1.0_wp, -0.9_wp, -1.0_wp, &
         -7.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, 9.0_wp], [2, 5])
      type(line_search_t) :: line
      integer :: i

      do i = 1, 5
         call line_search_begin(line, work(1, i), work(2, i))
         call check_true(error, .not. line%is_on, "case " // to_text(i))
      end do
   end subroutine test_whole

   !> From rest it is that of the tangent, whatever the sign of what is left of the residual.
   subroutine test_work(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: least = 1.0e-2_wp
      real(wp), parameter :: start(6) = [-2.0_wp, -4.0_wp*least, 4.0_wp*least, -0.5_wp*least, &
         0.0_wp, 0.5_wp*least]
      integer :: i

      do i = 1, size(start)
         call check_near(error, line_search_work(start(i), 2.0_wp), merge(start(i), -2.0_wp, &
            i <= 3), 0.0_wp, 1.0_wp, "case " // to_text(i))
      end do
      call check_near(error, line_search_work(1.0e-20_wp, -1.0_wp), 1.0e-20_wp, 0.0_wp, 1.0_wp, &
         "where the tangent is not definite")
   end subroutine test_work

   !> The work rises from -1 to `last` within the corner, wherever it is.
   subroutine test_corner(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: last(4) = [0.6_wp, 1.0_wp, 10.0_wp, 1.0e3_wp]
      type(line_search_t) :: line
      real(wp) :: place, at, here
      integer :: i, k

      do k = 1, size(last)
         do i = 1, 19
            place = 0.05_wp*real(i, wp)
            call line_search_begin(line, -1.0_wp, last(k))
            at = 1.0_wp
            do while (line%is_on)
               at = at + line%step
               here = -1.0_wp + (last(k) + 1.0_wp)*max(0.0_wp, min(1.0_wp, &
                  0.5_wp + 0.5_wp*(at - place)/width))
               call line_search_take(line, here)
            end do
            call check_true(error, abs(here) <= 0.5_wp, "work at " // to_text(place) // ", up to " &
               // to_text(last(k)))
         end do
      end do
   end subroutine test_corner

   subroutine test_sharp(error)
      type(error_t), allocatable, intent(out) :: error
      type(line_search_t) :: line
      real(wp) :: at
      integer :: n

      call line_search_begin(line, -1.0_wp, 1.0_wp)
      at = 1.0_wp
      n = 0
      do while (line%is_on)
         n = n + 1
         at = at + line%step
         call line_search_take(line, merge(-1.0_wp, 1.0_wp, at < 0.3_wp))
      end do
      call check_true(error, n <= 24, "it ends")
      call check_near(error, at, 0.3_wp, 2.0_wp**(-24), 1.0_wp, "the place")
   end subroutine test_sharp

end module test_line_search
