!> Candidate search against all-against-all, in ordinary and degenerate layouts.
module test_search
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_search, only : box_distance, candidates_t, search_candidates
   use emcon_text, only : to_text
   implicit none
   private
   public :: collect_search

contains

   subroutine collect_search(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("random points and edges", test_random), &
         test_case_t("all on a vertical line", test_vertical), &
         test_case_t("all in one point", test_point), &
         test_case_t("clusters far apart", test_clusters), &
         test_case_t("one edge that spans all", test_long_edge), &
         test_case_t("nothing to search", test_empty), &
         test_case_t("candidates grow linearly", test_linear), &
         test_case_t("distance of boxes", test_box_distance)]
   end subroutine collect_search

   !> The list holds every pair of a point and an edge box within `reach`, each once, no others.
   subroutine check_list(error, point, ends, reach, what)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in) :: point(:, :)
      real(wp), intent(in) :: ends(:, :, :)      !! (2, 2, n_edge)
      real(wp), intent(in) :: reach
      character(len=*), intent(in) :: what
      type(candidates_t) :: list
      real(wp) :: low(2, size(ends, 3)), high(2, size(ends, 3))
      logical :: is_listed(size(ends, 3)), is_near(size(ends, 3))
      integer :: i, e

      low = minval(ends, dim=2)
      high = maxval(ends, dim=2)
      call search_candidates(point, low, high, reach, list)
      call check_equal(error, size(list%start), size(point, 2) + 1, what // ", points")
      call check_equal(error, size(list%edge), list%start(size(point, 2) + 1) - 1, what // ", end")
      do i = 1, size(point, 2)
         do e = 1, size(ends, 3)
            is_near(e) = box_distance(point(:, i), point(:, i), low(:, e), high(:, e)) <= reach
         end do
         is_listed = .false.
         is_listed(list%edge(list%start(i):list%start(i + 1) - 1)) = .true.
         call check_true(error, all(is_listed .or. .not. is_near), &
            what // ": every near edge of point " // to_text(i) // " is on its list")
         call check_equal(error, list%start(i + 1) - list%start(i), count(is_near), &
            what // ": length of the list of point " // to_text(i))
         if (allocated(error)) return
      end do
   end subroutine check_list

   subroutine test_random(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: point(2, 60), ends(2, 2, 80), u(2)
      integer :: i

      do i = 1, 60
         call random_number(point)
         call random_number(ends)
         call random_number(u)
         ends(:, 2, :) = ends(:, 1, :) + 10.0_wp**(-3.0_wp*u(1))*(ends(:, 2, :) - 0.5_wp)
         point(1, :) = 3.0_wp*point(1, :) - 1.0_wp
         call check_list(error, point, ends, 10.0_wp**(-4.0_wp*u(2)), "case " // to_text(i))
      end do
   end subroutine test_random

   !> Every box has width zero; also the horizontal line and the diagonal.
   subroutine test_vertical(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: point(2, 50), ends(2, 2, 50)
      integer :: i

      do i = 1, 50
         point(:, i) = [1.0_wp, 0.37_wp*real(i, wp)]
         ends(:, 1, i) = [1.0_wp, 0.4_wp*real(i, wp)]
         ends(:, 2, i) = [1.0_wp, 0.4_wp*real(i + 1, wp)]
      end do
      call check_list(error, point, ends, 0.105_wp, "vertical")
      call check_list(error, cshift(point, 1, 1), cshift(ends, 1, 1), 0.105_wp, "horizontal")
      point(1, :) = point(2, :)
      ends(1, :, :) = ends(2, :, :)
      call check_list(error, point, ends, 1.0e-3_wp, "diagonal")
   end subroutine test_vertical

   subroutine test_point(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: point(2, 20), ends(2, 2, 20)

      point = 0.7_wp
      ends = 0.7_wp
      call check_list(error, point, ends, 1.0e-3_wp, "coincident points and edges")
      call check_list(error, point(:, :1), ends(:, :, :1), 1.0e-3_wp, "one point, one edge")
      ends = 0.7_wp + 1.0e-3_wp
      call check_list(error, point, ends, 0.5e-3_wp, "just out of reach")
      point = 1.0e8_wp
      ends = 1.0e8_wp
      call check_list(error, point, ends, 1.0e-12_wp, "reach below round-off")
   end subroutine test_point

   !> Cells far larger than the edges: the list has to stay exact.
   subroutine test_clusters(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: point(2, 40), ends(2, 2, 40)

      call random_number(point)
      call random_number(ends)
      point(1, 21:) = point(1, 21:) + 1.0e6_wp
      ends(1, :, 21:) = ends(1, :, 21:) + 1.0e6_wp
      call check_list(error, point, ends, 0.05_wp, "clusters")
      call check_list(error, point(:, :20), ends(:, :, 21:), 0.05_wp, "apart")
   end subroutine test_clusters

   subroutine test_long_edge(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: point(2, 60), ends(2, 2, 61)

      call random_number(point)
      call random_number(ends)
      ends(:, 2, :60) = ends(:, 1, :60) + 0.01_wp*ends(:, 2, :60)
      ends(:, 1, 61) = -5.0_wp
      ends(:, 2, 61) = 5.0_wp
      call check_list(error, point, ends, 0.02_wp, "long edge")
   end subroutine test_long_edge

   subroutine test_empty(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: point(2, 3), ends(2, 2, 3)

      call random_number(point)
      call random_number(ends)
      call check_list(error, point(:, :0), ends, 0.1_wp, "no points")
      call check_list(error, point, ends(:, :, :0), 0.1_wp, "no edges")
   end subroutine test_empty

   !> Two parallel lines of n nodes and n edges: 3 or 4 candidates a node, whatever n is.
   subroutine test_linear(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_largest = 64000
      real(wp), allocatable :: point(:, :), low(:, :), high(:, :)
      type(candidates_t) :: list
      integer :: n, i

      n = 1000
      do while (n <= n_largest)
         allocate(point(2, n), low(2, n), high(2, n))
         do i = 1, n
            point(:, i) = [real(i, wp), 0.1_wp]
            low(:, i) = [real(i, wp) - 0.5_wp, 0.0_wp]
            high(:, i) = [real(i, wp) + 0.5_wp, 0.0_wp]
         end do
         call search_candidates(point, low, high, 0.6_wp, list)
         call check_equal(error, size(list%edge), 3*n - 2, "candidates of " // to_text(n))
         deallocate(point, low, high)
         n = 8*n
      end do
   end subroutine test_linear

   subroutine test_box_distance(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: zero(2) = [0.0_wp, 0.0_wp], one(2) = [1.0_wp, 1.0_wp]

      call check_near(error, box_distance(zero, one, [3.0_wp, 0.0_wp], [4.0_wp, 1.0_wp]), &
         2.0_wp, 0.0_wp, 1.0_wp, "beside")
      call check_near(error, box_distance([3.0_wp, 7.0_wp], [4.0_wp, 8.0_wp], zero, one), &
         6.0_wp, 0.0_wp, 1.0_wp, "above")
      call check_near(error, box_distance(zero, one, 0.5_wp*one, 2.0_wp*one), 0.0_wp, 0.0_wp, &
         1.0_wp, "overlapping")
   end subroutine test_box_distance

end module test_search
