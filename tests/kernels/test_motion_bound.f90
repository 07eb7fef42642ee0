!> What spares a look at surfaces: how far nodes have gone, where they stood, which boxes are near,
!> which edges face a node.
module test_motion_bound
   use, intrinsic :: ieee_arithmetic, only : ieee_positive_inf, ieee_value
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_box_tree, only : box_tree_find, box_tree_init, box_tree_t
   use emcon_chain_plane, only : chain_t
   use emcon_errors, only : error_t
   use emcon_facing_plane, only : facing_allows
   use emcon_kinds, only : wp
   use emcon_motion_bound, only : largest_motion, motion_bound_add, motion_bound_t
   use emcon_overlap_plane, only : crossing_find, nearest_depth, nearest_t, nearest_update
   use emcon_position_memo, only : position_memo_holds, position_memo_t, position_memo_take
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   use small_scenes, only : shake
   implicit none
   private
   public :: collect_motion_bound

   real(wp), parameter :: tol = 16.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_motion_bound(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("an odometer of all nodes", test_bound), &
         test_case_t("where nodes stood", test_memo), &
         test_case_t("boxes that are near, by all of them", test_boxes), &
         test_case_t("edges that face a node", test_facing), &
         test_case_t("the nearest place of an outline", test_nearest), &
         test_case_t("edges that cross", test_crossing)]
   end subroutine collect_motion_bound

   subroutine test_bound(error)
      type(error_t), allocatable, intent(out) :: error
      type(motion_bound_t) :: bound
      real(wp) :: u(2, 3)

      u = 0.0_wp
      u(:, 2) = [3.0_wp, -4.0_wp]
      call check_near(error, largest_motion(u), 5.0_wp, tol, 5.0_wp, "largest")
      call motion_bound_add(bound, u)
      call check_near(error, bound%total, 0.0_wp, 0.0_wp, 1.0_wp, "it begins there")
      u(:, 1) = [0.0_wp, 1.0_wp]
      u(:, 2) = [0.0_wp, 0.0_wp]
      call motion_bound_add(bound, u)
      call check_near(error, bound%total, 5.0_wp, tol, 5.0_wp, "to")
      u(:, 1) = [-1.0_wp, 1.0_wp]
      call motion_bound_add(bound, u)
      call check_near(error, bound%total, 6.0_wp, tol, 6.0_wp, "and fro")
      call motion_bound_add(bound, u)
      call check_near(error, bound%total, 6.0_wp, tol, 6.0_wp, "at rest")
   end subroutine test_bound

   subroutine test_memo(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: node(2) = [4, 2]
      type(position_memo_t) :: memo
      real(wp) :: x(2, 5), u(2, 5)
      integer :: i, a

      call shake(x, 1.0_wp)
      call shake(u, 1.0_wp)
      call check_true(error, .not. position_memo_holds(memo, node, x, u), "nothing is known")
      call position_memo_take(memo, node, x + 1.0_wp, u + 1.0_wp)
      call position_memo_take(memo, node, x, u)
      do i = 1, 5
         do a = 1, 2
            call check_true(error, position_memo_holds(memo, node, x, u), "as they stood")
            u(a, i) = nearest(u(a, i), 1.0_wp)
            call check_true(error, position_memo_holds(memo, node, x, u) .eqv. all(node /= i), &
               "moved")
            u(a, i) = nearest(u(a, i), -1.0_wp)
            x(a, i) = nearest(x(a, i), -1.0_wp)
            call check_true(error, position_memo_holds(memo, node, x, u) .eqv. all(node /= i), &
               "placed elsewhere")
            x(a, i) = nearest(x(a, i), 1.0_wp)
         end do
      end do
   end subroutine test_memo

   !> Boxes by chance in plane and space, some of them not finite; some lie at one place.
   subroutine test_boxes(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_box(6) = [0, 1, 8, 9, 40, 150]
      integer :: k, n_dim

      do k = 1, size(n_box)
         do n_dim = 2, 3
            call check_boxes(error, n_dim, n_box(k))
         end do
      end do
   end subroutine test_boxes

   subroutine check_boxes(error, n_dim, n)
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in) :: n_dim, n
      type(box_tree_t) :: tree
      real(wp) :: low(n_dim, n), high(n_dim, n), extent(n_dim, n), reach
      integer, allocatable :: found(:), near(:)
      integer :: i, k, n_found

      call draw_random(low)
      call draw_random(extent)
      if (n > 20) low(:, 3:14) = spread(low(:, 2), 2, 12)
      high = low + 0.2_wp*extent
      if (n > 5) high(1, 5) = ieee_value(1.0_wp, ieee_positive_inf)
      call box_tree_init(tree, low, high)
      allocate(found(1), source=-1)
      do i = 1, n
         reach = 0.05_wp*mod(i, 4)
         near = pack([(k, k = 1, n)], [(distance(k) <= reach .and. k /= 5 .and. i /= 5, k = 1, n)])
         if (n == 1) near = [1]
         n_found = 1
         call box_tree_find(tree, low(:, i), high(:, i), reach, found, n_found)
         call check_equal(error, found(:n_found), [-1, near], "near box " // to_text(i))
      end do

   contains

      pure real(wp) function distance(k)
         integer, intent(in) :: k

         distance = maxval(max(low(:, k) - high(:, i), low(:, i) - high(:, k)))
      end function distance

   end subroutine check_boxes

   !> The lower right corner of a square, whose edges run along x and up; at an end of the chain any
   !> edge does, by the direction opposite to the edge's. With and without displacements.
   subroutine test_facing(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: pi = acos(-1.0_wp)
      !> Directions of the normal that the corner may rest on [degrees]: 60 beyond both normals.
      real(wp), parameter :: degrees(8) = [-149.0_wp, -151.0_wp, -45.0_wp, 59.0_wp, 61.0_wp, &
         100.0_wp, 179.0_wp, -90.0_wp]
      logical, parameter :: allows(8) = [.true., .false., .true., .true., .false., .false., &
         .false., .true.]
      type(chain_t) :: chain
      real(wp) :: x(2, 5), u(2, 5)
      integer :: k

      chain%facet = reshape([1, 2, 2, 3], [2, 2])
      chain%node_edge = reshape([0, 1, 1, 2, 2, 0], [2, 3])
      call shake(u, 0.5_wp)
      do k = 1, size(degrees)
         x(:, :3) = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, 1.0_wp], [2, 3])
         ! Its outward normal is opposite to that direction; the edge is that turned by 90 degrees.
         associate (angle => (degrees(k) + 180.0_wp + 90.0_wp)*pi/180.0_wp)
            x(:, 4) = [3.0_wp, 2.0_wp]
            x(:, 5) = x(:, 4) + 2.0_wp*[cos(angle), sin(angle)]
         end associate
         x = x - u
         call check_true(error, facing_allows(chain, 2, [4, 5], x, u) .eqv. allows(k), &
            "direction " // to_text(k))
         call check_true(error, facing_allows(chain, 1, [4, 5], x, u) .and. &
            facing_allows(chain, 3, [4, 5], x, u), "at an end")
      end do
      ! At a spike along x normals are more than twice 60 degrees apart: what is between both does.
      x(:, :3) = reshape([-3.0_wp, -0.25_wp, 0.0_wp, 0.0_wp, -3.0_wp, 0.25_wp], [2, 3])
      x(:, 4) = 0.0_wp
      do k = -3, 3
         associate (angle => (30.0_wp*k - 1.0_wp)*pi/180.0_wp)
            x(:, 5) = [sin(angle), -cos(angle)]
         end associate
         call check_true(error, facing_allows(chain, 2, [4, 5], x, 0.0_wp*u), "spike " &
            // to_text(k))
         x(2, 5) = -x(2, 5)
         call check_true(error, facing_allows(chain, 2, [4, 5], x, 0.0_wp*u) .eqv. abs(k) > 1, &
            "from behind " // to_text(k))
      end do
   end subroutine test_facing

   !> Points about a square at all of its edges and corners: the distance, < 0 outside.
   subroutine test_nearest(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: corner(2, 0:4) = reshape([0.0_wp, 0.0_wp, 2.0_wp, 0.0_wp, 2.0_wp, &
         2.0_wp, 0.0_wp, 2.0_wp, 0.0_wp, 0.0_wp], [2, 5])
      type(nearest_t) :: found
      real(wp) :: point(2), outside(2), expected
      integer :: k, e, other

      do k = 1, 60
         call draw_random(point)
         point = 4.0_wp*point - 1.0_wp
         if (k == 1) point = [3.0_wp, 3.0_wp]
         found = nearest_t()
         call nearest_update(found, 9, point, [0.0_wp, 0.0_wp])
         call check_equal(error, found%edge, 0, "an edge without length")
         do e = 1, 4
            call nearest_update(found, e, point - corner(:, e - 1), corner(:, e) - corner(:, e - 1))
         end do
         outside = max(0.0_wp, -point, point - 2.0_wp)
         expected = -norm2(outside)
         if (all(outside <= 0.0_wp)) expected = minval([point, 2.0_wp - point])
         other = found%edge
         if (found%side == 1) other = 1 + mod(found%edge + 2, 4)
         if (found%side == 2) other = 1 + mod(found%edge, 4)
         call check_near(error, nearest_depth(found, corner(:, other) - corner(:, other - 1)), &
            expected, tol, 4.0_wp, "depth")
         call check_near(error, norm2(corner(:, found%edge - 1) + found%share*found%along &
            + found%to_point - point), 0.0_wp, tol, 4.0_wp, "its place")
         call check_near(error, [found%square, norm2(found%to_point)**2], spread(expected**2, 1, &
            2), tol, 16.0_wp, "its distance")
         call check_true(error, found%side > 0 .eqv. all(outside > 0.0_wp), "at a corner")
      end do
   end subroutine test_nearest

   !> Lines at random against the solution of two equations.
   subroutine test_crossing(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: ends(2, 4), a(2), b(2), share, expected(2), det
      integer :: k, n
      logical :: crosses, enters

      n = 0
      do k = 1, 80
         call draw_random(ends)
         a = ends(:, 2) - ends(:, 1)
         b = ends(:, 4) - ends(:, 3)
         call crossing_find(a, ends(:, 3:) - spread(ends(:, 1), 2, 2), crosses, share, enters)
         ! ends 1 + s a = ends 3 + t b
         det = a(1)*b(2) - a(2)*b(1)
         associate (c => ends(:, 3) - ends(:, 1))
            expected = [c(1)*b(2) - c(2)*b(1), c(1)*a(2) - c(2)*a(1)]/det
         end associate
         call check_true(error, crosses .eqv. all(expected > 0.0_wp .and. expected < 1.0_wp), &
            "crosses")
         if (.not. crosses) cycle
         n = n + 1
         call check_near(error, share, expected(1), tol, 1.0_wp/abs(det), "where")
         call check_true(error, enters .eqv. det < 0.0_wp, "behind it")
      end do
      call check_true(error, n > 10, "some do")
   end subroutine test_crossing

end module test_motion_bound
