!> Round corners of profiles: closed forms, and what any must be.
module test_profile_fillet
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_profile_fillet_plane, only : round_corners, segment_t
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_profile_fillet

   !> Of an intersection of curves at an angle above .2.
   real(wp), parameter :: tol = 1.0e4_wp*epsilon(1.0_wp)

contains

   subroutine collect_profile_fillet(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("the corner of two lines", test_lines), &
         test_case_t("a square becomes a circle", test_square), &
         test_case_t("a line and a circle, by Pythagoras", test_dome), &
         test_case_t("drawn ones are smooth, of that radius, and lie on their sides", test_drawn)]
   end subroutine collect_profile_fillet

   subroutine test_lines(error)
      type(error_t), allocatable, intent(out) :: error
      type(segment_t), allocatable :: s(:)
      integer :: corner

      s = [at(-2.0_wp, 0.0_wp), at(0.0_wp, 0.0_wp), at(0.0_wp, 2.0_wp)]
      call round_corners(s, 0.5_wp, .false., corner)
      call check_equal(error, [corner, size(s), merge(1, 0, s%is_arc)], [0, 4, 0, 0, 1, 0], "kinds")
      if (.not. allocated(error)) call check_near(error, [s(2)%to, s(3)%to, s(3)%centre], &
         [-0.5_wp, 0.0_wp, 0.0_wp, 0.5_wp, -0.5_wp, 0.5_wp], tol, 1.0_wp, "places")
      if (allocated(error)) return
      s = [at(-2.0_wp, 0.0_wp), at(0.0_wp, 0.0_wp), at(0.0_wp, 2.0_wp)]
      call round_corners(s, 2.5_wp, .false., corner)
      call check_true(error, corner > 0 .and. size(s) == 3, "no room")
   end subroutine test_lines

   !> Of half its width nothing is left of the sides.
   subroutine test_square(error)
      type(error_t), allocatable, intent(out) :: error
      type(segment_t), allocatable :: s(:)
      integer :: corner, i

      s = [at(-1.0_wp, -1.0_wp), at(1.0_wp, -1.0_wp), at(1.0_wp, 1.0_wp), at(-1.0_wp, 1.0_wp), &
         at(-1.0_wp, -1.0_wp)]
      call round_corners(s, 1.0_wp, .true., corner)
      call check_equal(error, [corner, size(s)], [0, 5], "four arcs")
      if (.not. allocated(error)) call check_near(error, [s(1)%to, (s(i)%centre, i = 2, 5)], &
         [0.0_wp, -1.0_wp, (0.0_wp, i = 1, 8)], tol, 1.0_wp, "about the middle")
   end subroutine test_square

   !> A half circle of radius 2 on a floor, the body outside: the centre of the fillet is at the
   !> height r, and 2 + r from the other one.
   subroutine test_dome(error)
      type(error_t), allocatable, intent(out) :: error
      type(segment_t), allocatable :: s(:)
      real(wp), parameter :: r = 0.5_wp
      real(wp) :: x
      integer :: corner

      s = [at(4.0_wp, 0.0_wp), at(2.0_wp, 0.0_wp), segment_t(.true., [0.0_wp, 2.0_wp], [0.0_wp, &
         0.0_wp])]
      call round_corners(s, r, .false., corner)
      call check_equal(error, [corner, size(s)], [0, 4], "kinds")
      if (allocated(error)) return
      x = sqrt((2.0_wp + r)**2 - r**2)
      call check_near(error, [s(2)%to, s(3)%centre, s(3)%to], [x, 0.0_wp, x, r, &
         2.0_wp*x/(2.0_wp + r), 2.0_wp*r/(2.0_wp + r)], tol, 1.0_wp, "places")
   end subroutine test_dome

   subroutine test_drawn(error)
      type(error_t), allocatable, intent(out) :: error
      type(segment_t), allocatable :: s(:), drawn(:)
      integer :: case, corner, n_round

      n_round = 0
      do case = 1, 200
         call draw(drawn)
         s = drawn
         call round_corners(s, 0.1_wp, .false., corner)
         if (corner > 0) cycle
         n_round = n_round + 1
         call check_round(error, drawn, s, to_text(case))
         if (allocated(error)) return
      end do
      call check_true(error, n_round > 50, to_text(n_round) // " are round")
   end subroutine test_drawn

   !> Three sides, lines and arcs, of a length of about 1.
   subroutine draw(s)
      type(segment_t), allocatable, intent(out) :: s(:)
      real(wp) :: u(4), way(2)
      integer :: i

      allocate(s(4))
      do i = 2, 4
         call draw_random(u)
         way = [1.0_wp, 0.0_wp]
         if (i == 3) way = [2.0_wp*u(1) - 1.0_wp, 1.5_wp*u(2) - 0.75_wp]
         way = way/norm2(way)
         s(i)%to = s(i - 1)%to + way
         s(i)%is_arc = u(3) > 0.5_wp
         s(i)%centre = s(i - 1)%to + 0.5_wp*way + (2.0_wp*u(4) - 1.0_wp)*[-way(2), way(1)]
      end do
   end subroutine draw

   !> Each joint is smooth, new arcs have the radius, and old sides lie on those that were drawn.
   subroutine check_round(error, drawn, s, name)
      type(error_t), allocatable, intent(out) :: error
      type(segment_t), intent(in) :: drawn(:), s(:)
      character(len=*), intent(in) :: name
      logical :: is_new
      integer :: i, k

      k = 1
      do i = 2, size(s)
         is_new = k == size(drawn)
         if (.not. is_new) is_new = s(i)%is_arc .and. (.not. drawn(k + 1)%is_arc .or. any(abs( &
            s(i)%centre - drawn(k + 1)%centre) > 0.0_wp))
         if (is_new) then
            call check_near(error, [norm2(s(i)%to - s(i)%centre), norm2(s(i - 1)%to &
               - s(i)%centre)], [0.1_wp, 0.1_wp], tol, 1.0_wp, name // ": radius")
         else
            k = k + 1
            call check_near(error, off_side(drawn(k - 1)%to, drawn(k), s(i)%to), 0.0_wp, tol, &
               1.0_wp, name // ": on its side")
         end if
         if (allocated(error)) return
         if (i == size(s)) exit
         call check_near(error, heading(s(i - 1)%to, s(i), s(i)%to), heading(s(i)%to, s(i + 1), &
            s(i)%to), tol, 1.0_wp, name // ": smooth")
         if (allocated(error)) return
      end do
      call check_equal(error, k, size(drawn), name // ": sides")
   end subroutine check_round

   !> How far a point is from the line or circle of a segment.
   pure real(wp) function off_side(from, s, point)
      real(wp), intent(in) :: from(2), point(2)
      type(segment_t), intent(in) :: s

      if (s%is_arc) then
         off_side = norm2(point - s%centre) - norm2(from - s%centre)
      else
         off_side = ((s%to(1) - from(1))*(point(2) - from(2)) - (s%to(2) - from(2))*(point(1) &
            - from(1)))/norm2(s%to - from)
      end if
   end function off_side

   !> The direction of a segment at one of its points.
   pure function heading(from, s, point)
      real(wp), intent(in) :: from(2), point(2)
      type(segment_t), intent(in) :: s
      real(wp) :: heading(2)

      heading = (s%to - from)/norm2(s%to - from)
      if (.not. s%is_arc) return
      associate (a => from - s%centre, b => s%to - s%centre, p => point - s%centre)
         heading = sign(1.0_wp, a(1)*b(2) - a(2)*b(1))*[-p(2), p(1)]/norm2(p)
      end associate
   end function heading

   pure type(segment_t) function at(x, y)
      real(wp), intent(in) :: x, y

      at = segment_t(.false., [x, y])
   end function at

end module test_profile_fillet
