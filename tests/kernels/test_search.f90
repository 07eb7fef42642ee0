!> Candidate search against all-against-all, in ordinary and degenerate layouts.
module test_search
   use, intrinsic :: ieee_arithmetic, only : ieee_positive_inf, ieee_quiet_nan, ieee_value
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_box_tree, only : box_tree_guess, box_tree_init, box_tree_next, box_tree_t, leaf_size
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_search, only : box_distance, candidates_t, search_candidates
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_search

contains

   subroutine collect_search(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("random points and edges", test_random), &
         test_case_t("random boxes of all sizes", test_boxes), &
         test_case_t("one box among many a thousandth of it", test_coarse_and_fine), &
         test_case_t("many equal boxes", test_equal_boxes), &
         test_case_t("boxes on a lattice", test_lattice), &
         test_case_t("scaled by powers of two", test_scaled), &
         test_case_t("boxes that are not finite", test_not_finite), &
         test_case_t("all on a vertical line", test_vertical), &
         test_case_t("all in one point", test_point), &
         test_case_t("clusters far apart", test_clusters), &
         test_case_t("one edge that spans all", test_long_edge), &
         test_case_t("nothing to search", test_empty), &
         test_case_t("candidates grow linearly", test_linear), &
         test_case_t("boxes straight to a point", test_straight), &
         test_case_t("distance of boxes", test_box_distance)]
   end subroutine collect_search

   !> A walk finds each box within a distance once, and the nearest one with a reach that falls; a
   !> guess is no farther than most.
   subroutine test_straight(error)
      type(error_t), allocatable, intent(out) :: error
      type(box_tree_t) :: tree
      integer, parameter :: n_box = 300
      real(wp) :: low(3, n_box), high(3, n_box), point(3), distance(n_box), reach
      integer :: found(leaf_size), n_seen(n_box), i, k, n
      integer, allocatable :: guess(:)

      call draw_random(low)
      call draw_random(high)
      high = low + 0.1_wp*high
      call box_tree_init(tree, low, high)
      do i = 1, 50
         call draw_random(point)
         point = 2.0_wp*point - 0.5_wp
         distance = sqrt(sum(max(0.0_wp, low - spread(point, 2, n_box), &
            spread(point, 2, n_box) - high)**2, 1))
         reach = 0.02_wp*i
         n_seen = 0
         k = 1
         do
            call box_tree_next(tree, point, reach, k, found, n)
            n_seen(found(:n)) = n_seen(found(:n)) + 1
            if (n == 0) exit
         end do
         call check_equal(error, n_seen, merge(1, 0, distance <= reach), "within reach")
         call box_tree_guess(tree, point, guess)
         call check_true(error, count(distance < minval(distance(guess))) < n_box/10, "guess")
         reach = minval(distance(guess))
         k = 1
         do while (k > 0)
            call box_tree_next(tree, point, reach, k, found, n)
            if (n > 0) reach = min(reach, minval(distance(found(:n))))
         end do
         call check_near(error, reach, minval(distance), 0.0_wp, 1.0_wp, "nearest")
      end do
      call box_tree_init(tree, low(:, :0), high(:, :0))
      call box_tree_guess(tree, point, guess)
      k = 1
      call box_tree_next(tree, point, reach, k, found, n)
      call check_equal(error, [size(guess), k, n], [0, 0, 0], "no boxes")
   end subroutine test_straight

   !> The list holds every pair of a point and an edge box within `reach`, each once, no others.
   subroutine check_list(error, point, ends, reach, what)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in) :: point(:, :)
      real(wp), intent(in) :: ends(:, :, :)      !! (2, 2, n_edge)
      real(wp), intent(in) :: reach
      character(len=*), intent(in) :: what

      call check_boxes(error, point, point, minval(ends, dim=2), maxval(ends, dim=2), reach, what)
   end subroutine check_list

   !> The same for items that are boxes; the lists ascend.
   subroutine check_boxes(error, item_low, item_high, low, high, reach, what)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in) :: item_low(:, :), item_high(:, :), low(:, :), high(:, :), reach
      character(len=*), intent(in) :: what
      type(candidates_t) :: list
      integer :: near(size(low, 2)), i, e, n

      call search_candidates(item_low, item_high, low, high, reach, list)
      call check_equal(error, size(list%start), size(item_low, 2) + 1, what // ", items")
      call check_equal(error, list%start(1), 1, what // ", begin")
      call check_equal(error, size(list%facet), list%start(size(item_low, 2) + 1) - 1, &
         what // ", end")
      if (allocated(error)) return
      do i = 1, size(item_low, 2)
         n = 0
         do e = 1, size(low, 2)
            if (box_distance(item_low(:, i), item_high(:, i), low(:, e), high(:, e)) > reach) cycle
            n = n + 1
            near(n) = e
         end do
         call check_equal(error, list%facet(list%start(i):list%start(i + 1) - 1), near(:n), &
            what // ", list of item " // to_text(i))
         if (allocated(error)) return
      end do
   end subroutine check_boxes

   !> Boxes with corners in the unit square and extents between 1 and 1e-3.
   subroutine random_boxes(low, high)
      real(wp), intent(out) :: low(:, :), high(:, :)
      real(wp) :: u(size(low, 2))
      integer :: a

      call draw_random(low)
      call draw_random(high)
      call draw_random(u)
      do a = 1, size(low, 1)
         high(a, :) = low(a, :) + 10.0_wp**(-3.0_wp*u)*high(a, :)
      end do
   end subroutine random_boxes

   !> Numbers of boxes around the sizes of leaves and powers of two, and several hundreds.
   subroutine test_boxes(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_box(14) = [1, 2, 3, 7, 8, 9, 15, 16, 17, 33, 64, 65, 300, 777]
      real(wp), allocatable :: item_low(:, :), item_high(:, :), low(:, :), high(:, :)
      integer :: k, n_dim, seed

      do n_dim = 2, 3
         do k = 1, size(n_box)
            allocate(item_low(n_dim, 50), item_high(n_dim, 50), low(n_dim, n_box(k)), &
               high(n_dim, n_box(k)))
            do seed = 1, 5
               call random_boxes(item_low, item_high)
               call random_boxes(low, high)
               call check_boxes(error, item_low, item_high, low, high, 0.5_wp**seed, &
                  to_text(n_box(k)) // " boxes, dimension " // to_text(n_dim))
               if (allocated(error)) return
            end do
            deallocate(item_low, item_high, low, high)
         end do
      end do
   end subroutine test_boxes

   subroutine test_coarse_and_fine(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 1001
      real(wp) :: low(2, n), high(2, n)
      integer :: i

      do i = 1, n - 1
         low(:, i) = 1.0e-3_wp*[real(i, wp), 0.0_wp]
         high(:, i) = low(:, i) + [1.0e-3_wp, 0.0_wp]
      end do
      low(:, n) = [0.0_wp, -1.0e-4_wp]
      high(:, n) = [1.0_wp, -1.0e-4_wp]
      call check_boxes(error, low, high, low, high, 0.5e-3_wp, "with the large one")
      call check_boxes(error, low(:, n:), high(:, n:), low(:, :n - 1), high(:, :n - 1), &
         0.5e-3_wp, "the large one with the others")
   end subroutine test_coarse_and_fine

   !> No axis separates them; lists too long for the short sort come back ascending.
   subroutine test_equal_boxes(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 1000
      real(wp) :: low(2, n), high(2, n), point(2, 3)

      low = 0.5_wp
      high = 0.75_wp
      point(:, 1) = [0.6_wp, 0.7_wp]
      point(:, 2) = [0.6_wp, 0.8_wp]
      point(:, 3) = [0.2_wp, 0.6_wp]
      call check_boxes(error, point, point, low, high, 0.1_wp, "boxes")
   end subroutine test_equal_boxes

   !> Many equal centres along each axis, boxes that just touch; in space a third axis is like the
   !> second one.
   subroutine test_lattice(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 20
      real(wp) :: low(2, n*n), high(2, n*n)
      integer :: i, like(3)

      do i = 1, n*n
         low(:, i) = [real(mod(7*i, n), wp), real(i/n, wp)]
         high(:, i) = low(:, i) + [real(mod(i, 2), wp), 1.0_wp]
      end do
      call check_boxes(error, low, high, low, high, 1.0_wp, "reach of one cell")
      call check_boxes(error, low, high, low, high, 0.5_wp, "reach of half a cell")
      like = [1, 2, 2]
      call check_boxes(error, low(like, :), high(like, :), low(like, :), high(like, :), 1.0_wp, &
         "in space")
      low(2, :) = 0.0_wp
      high(2, :) = 0.0_wp
      call check_boxes(error, low(like, :), high(like, :), low(like, :), high(like, :), 1.0_wp, &
         "on a line in space")
   end subroutine test_lattice

   !> The same lists whatever the unit of length is, as far as it is a power of two.
   subroutine test_scaled(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: low(2, 200), high(2, 200)
      type(candidates_t) :: list, scaled
      integer :: k

      call random_boxes(low, high)
      call search_candidates(low, high, low, high, 0.1_wp, list)
      do k = -100, 100, 25
         call search_candidates(scale(low, k), scale(high, k), scale(low, k), scale(high, k), &
            scale(0.1_wp, k), scaled)
         call check_equal(error, scaled%start, list%start, "starts, power " // to_text(k))
         call check_equal(error, scaled%facet, list%facet, "edges, power " // to_text(k))
      end do
   end subroutine test_scaled

   !> They are near nothing, and the others are found as without them.
   subroutine test_not_finite(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 60
      real(wp) :: low(2, n), high(2, n), bad_low(2, n), bad_high(2, n), bad
      type(candidates_t) :: list, expected
      integer :: k, i

      do k = 1, 3
         call random_boxes(low, high)
         bad = ieee_value(bad, ieee_quiet_nan)
         if (k == 2) bad = ieee_value(bad, ieee_positive_inf)
         bad_low = low
         bad_high = high
         do i = 1, n, 3                          ! what is bad here is out of the way there
            bad_high(1 + mod(i, 2), i) = bad
            if (k == 3) bad_low(:, i) = bad
            low(:, i) = 1.0e3_wp*real(i, wp)
            high(:, i) = low(:, i)
         end do
         call search_candidates(low(:, 2:n:3), high(:, 2:n:3), low, high, 0.1_wp, expected)
         call search_candidates(low(:, 2:n:3), high(:, 2:n:3), bad_low, bad_high, 0.1_wp, list)
         call check_true(error, size(list%facet) > 0, "there is something to find")
         call check_equal(error, list%start, expected%start, "starts, kind " // to_text(k))
         call check_equal(error, list%facet, expected%facet, "edges, kind " // to_text(k))
         call search_candidates(bad_low(:, 1:n:3), bad_high(:, 1:n:3), low, high, 0.1_wp, list)
         call check_equal(error, size(list%facet), 0, "near an item, kind " // to_text(k))
         call search_candidates(low, high, bad_low(:, 1:n:3), bad_high(:, 1:n:3), 0.1_wp, list)
         call check_equal(error, size(list%facet), 0, "nothing else, kind " // to_text(k))
      end do
   end subroutine test_not_finite

   subroutine test_random(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: point(2, 60), ends(2, 2, 80), u(2)
      integer :: i

      do i = 1, 60
         call draw_random(point)
         call draw_random(ends)
         call draw_random(u)
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

      call draw_random(point)
      call draw_random(ends)
      point(1, 21:) = point(1, 21:) + 1.0e6_wp
      ends(1, :, 21:) = ends(1, :, 21:) + 1.0e6_wp
      call check_list(error, point, ends, 0.05_wp, "clusters")
      call check_list(error, point(:, :20), ends(:, :, 21:), 0.05_wp, "apart")
   end subroutine test_clusters

   subroutine test_long_edge(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: point(2, 60), ends(2, 2, 61)

      call draw_random(point)
      call draw_random(ends)
      ends(:, 2, :60) = ends(:, 1, :60) + 0.01_wp*ends(:, 2, :60)
      ends(:, 1, 61) = -5.0_wp
      ends(:, 2, 61) = 5.0_wp
      call check_list(error, point, ends, 0.02_wp, "long edge")
   end subroutine test_long_edge

   subroutine test_empty(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: point(2, 3), ends(2, 2, 3)

      call draw_random(point)
      call draw_random(ends)
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
         call search_candidates(point, point, low, high, 0.6_wp, list)
         call check_equal(error, size(list%facet), 3*n - 2, "candidates of " // to_text(n))
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
