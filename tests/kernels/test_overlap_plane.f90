!> Distances and crossings of edges against other ways to find them, and looks at open outlines.
module test_overlap_plane
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_options_t, contact_pair_t
   use emcon_kinds, only : wp
   use emcon_overlap_plane, only : crossing_find, nearest_depth, nearest_t, nearest_update
   use emcon_overlap_query, only : overlap_t
   use emcon_overlap_query_plane, only : overlap_query_plane_init, overlap_query_plane_t
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   use small_scenes, only : add_block, add_surface, block_t, bottom, left, right, scene_begin, top
   implicit none
   private
   public :: collect_overlap_plane

   !> Some dozen roundings of quantities of size 1.
   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)
   !> The body to the left: an L, whose corner 4 is hollow.
   real(wp), parameter :: outline(2, 6) = reshape([0.0_wp, 0.0_wp, 2.0_wp, 0.0_wp, 2.0_wp, 1.0_wp, &
      1.0_wp, 1.0_wp, 1.0_wp, 2.0_wp, 0.0_wp, 2.0_wp], [2, 6])

contains

   subroutine collect_overlap_plane(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("the nearest place of a line of edges", test_nearest), &
         test_case_t("in front of an outline and behind it", test_depth), &
         test_case_t("where edges cross", test_crossing), &
         test_case_t("lines that end", test_open), &
         test_case_t("ends on sides, the middle inside", test_middle), &
         test_case_t("an edge across teeth, of another body or of its own", test_teeth)]
   end subroutine collect_overlap_plane

   !> Over an open line of five edges, one of which has no length: in either order the place is the
   !> nearest of all, and tells on which part of its edge it is.
   subroutine test_nearest(error)
      type(error_t), allocatable, intent(out) :: error
      type(nearest_t) :: found
      real(wp) :: node(2, 6), b(2), square(5), share(5)
      integer :: i, k, order, best, n_side(0:2)

      n_side = 0
      do i = 1, 200
         call draw_random(node(1, :))
         call draw_random(node(2, :))
         call draw_random(b)
         b = 3.0_wp*b - 1.0_wp
         node(:, 4) = node(:, 3)
         do k = 1, 5
            associate (from => b - node(:, k), along => node(:, k + 1) - node(:, k))
               share(k) = 0.0_wp
               if (k /= 3) share(k) = max(0.0_wp, min(1.0_wp, sum(from*along)/sum(along**2)))
               square(k) = sum((from - share(k)*along)**2)
            end associate
         end do
         do order = 1, -1, -2
            found = nearest_t()
            do k = merge(1, 5, order > 0), merge(5, 1, order > 0), order
               call nearest_update(found, k, b - node(:, k), node(:, k + 1) - node(:, k))
            end do
            best = found%edge
            call check_true(error, best > 0 .and. best /= 3, "an edge with a length")
            if (allocated(error)) return
            call check_near(error, [found%square, square(best)], spread(minval(square), 1, 2), &
               tol, &
               9.0_wp, "square of the distance")
            call check_near(error, found%share, share(best), tol, 1.0_wp, "share of the edge")
            call check_near(error, node(:, best) + share(best)*found%along + found%to_point, b, &
               tol, &
               3.0_wp, "from the place to the point")
            call check_equal(error, found%side, merge(1, merge(2, 0, share(best) >= 1.0_wp), &
               share(best) <= 0.0_wp), "its end")
            n_side(found%side) = n_side(found%side) + 1
         end do
      end do
      call check_true(error, all(n_side > 20), "places inside and at both ends")
   end subroutine test_nearest

   !> Anywhere about an L: how deep, by its distance from the outline and by where it lies.
   subroutine test_depth(error)
      type(error_t), allocatable, intent(out) :: error
      type(nearest_t) :: found
      real(wp) :: b(2), along(2, 6), depth
      integer :: i, k, next, n_node(6)
      logical :: is_in

      along = cshift(outline, 1, 2) - outline
      n_node = 0
      do i = 1, 2000
         call draw_random(b)
         b = 4.0_wp*b - 1.0_wp
         found = nearest_t()
         do k = 1, 6
            call nearest_update(found, k, b - outline(:, k), along(:, k))
         end do
         next = modulo(found%edge - 1 + merge(-1, 1, found%side == 1), 6) + 1
         depth = nearest_depth(found, along(:, next))
         is_in = all(b > 0.0_wp) .and. all(b < 2.0_wp) .and. any(b < 1.0_wp)
         call check_near(error, depth, merge(1, -1, is_in)*sqrt(found%square), tol, 4.0_wp, &
            "depth at " // to_text(b(1)) // ", " // to_text(b(2)))
         if (found%side == 1) n_node(found%edge) = n_node(found%edge) + 1
         if (found%side == 2) n_node(modulo(found%edge, 6) + 1) = n_node(modulo(found%edge, 6) &
            + 1) &
            + 1
      end do
      call check_true(error, all(n_node > 5), "at all corners")
   end subroutine test_depth

   !> By the two parts at which lines meet, whatever the unit of length is.
   subroutine test_crossing(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: power(2) = [0, nint(0.3_wp*minexponent(1.0_wp))]
      real(wp) :: a(2), to_b(2, 2), b(2), across, of_a, of_b, share
      integer :: i, k, n
      logical :: crosses, enters

      n = 0
      do i = 1, 400
         call draw_random(a)
         call draw_random(to_b(:, 1))
         call draw_random(to_b(:, 2))
         a = 2.0_wp*a - 1.0_wp
         to_b = 2.0_wp*to_b - 1.0_wp
         b = to_b(:, 2) - to_b(:, 1)
         across = a(1)*b(2) - a(2)*b(1)
         ! Where lines are nearly parallel these parts have few digits.
         if (abs(across) < 0.01_wp) cycle
         of_a = (to_b(1, 1)*b(2) - to_b(2, 1)*b(1))/across
         of_b = (to_b(1, 1)*a(2) - to_b(2, 1)*a(1))/across
         do k = 1, 2
            call crossing_find(scale(a, power(k)), scale(to_b, power(k)), crosses, share, enters)
            call check_true(error, crosses .eqv. min(of_a, 1.0_wp - of_a, of_b, 1.0_wp - of_b) &
               > 0.0_wp, "do they cross")
            call check_near(error, share, merge(of_a, 0.0_wp, crosses), 100.0_wp*tol, 1.0_wp, &
               "where")
            if (crosses) call check_true(error, enters .eqv. across < 0.0_wp, "which way")
            if (crosses) n = n + 1
         end do
      end do
      call check_true(error, n > 80, "some cross")
   end subroutine test_crossing

   !> A block on [0, 4] x [0, 1] and a line of two edges, x = 1 to 3, whose body is above; its
   !> nodes are the last three.
   subroutine make_line(scene, height)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: height             !! of the line
      type(block_t) :: block

      call scene_begin(scene)
      call add_block(scene, "CPE4", [4, 1], [0.0_wp, 0.0_wp], [4.0_wp, 1.0_wp], block)
      scene%x = reshape([scene%x, [1.0_wp, height, 2.0_wp, height, 3.0_wp, height]], [2, 13])
      scene%u0 = 0.0_wp*scene%x
      call add_surface(scene, "BLOCK", block, [top])
      call add_surface(scene, "LINE", block, [bottom])
      deallocate(scene%surface(2)%element, scene%surface(2)%face)
      allocate(scene%surface(2)%element(0), scene%surface(2)%face(0))
      scene%surface(2)%edge = reshape([11, 12, 12, 13], [2, 2])
      scene%pair = [contact_pair_t(slave=1, master=2)]
   end subroutine make_line

   !> What of piece `p` is in piece `q` where all have gone by `share` of `du`, after a look before.
   subroutine look(scene, du, share, p, q, overlap)
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: du(:, :), share
      integer, intent(in) :: p, q
      type(overlap_t), intent(out) :: overlap
      type(overlap_query_plane_t) :: query
      type(contact_options_t) :: options
      integer :: i

      call overlap_query_plane_init(query, scene)
      call query%begin(scene, options)
      do i = 1, query%outline%n_piece
         call query%place(i, scene%x, scene%u0, du, 0.0_wp)
         call query%place(i, scene%x, scene%u0, du, share)
      end do
      associate (u => scene%u0 + share*du)
         call query%overlap(p, q, scene%x, max(query%longest(p, scene%x, u), &
            query%longest(q, scene%x, u)), overlap)
      end associate
   end subroutine look

   !> Each of the nodes of the line, its ends too, is an eighth deep in the block where it alone has
   !> gone there. A node of the block is behind the line where it is above it, not past its ends.
   subroutine test_open(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(overlap_t) :: overlap
      real(wp), allocatable :: du(:, :)
      integer :: k

      call make_line(scene, 1.5_wp)
      allocate(du, mold=scene%x)
      do k = 11, 13
         du = 0.0_wp
         du(2, k) = -1.25_wp
         call look(scene, du, 0.5_wp, 2, 1, overlap)
         call check_equal(error, overlap%node, k, "node " // to_text(k))
         call check_near(error, [overlap%depth, overlap%length], [0.125_wp, 1.0_wp], tol, 1.0_wp, &
            "how deep, of which edge")
         call look(scene, du, 0.25_wp, 2, 1, overlap)
         call check_equal(error, overlap%node, 0, "before it is there")
      end do
      ! The block's nodes at x = 1 and 3 are past the ends of the line, above it or not.
      call make_line(scene, 0.5_wp)
      scene%x(1, [11, 13]) = [1.25_wp, 2.75_wp]
      scene%x(2, [7, 8, 9]) = [0.75_wp, 0.25_wp, 0.75_wp]
      du = 0.0_wp
      do k = 1, 2
         call look(scene, du, 1.0_wp, 1, 2, overlap)
         call check_equal(error, overlap%node, merge(0, 8, k == 1), "behind the line")
         scene%x(2, [7, 8, 9]) = [0.25_wp, 0.75_wp, 0.25_wp]
      end do
      call check_near(error, overlap%depth*overlap%length, 0.25_wp, tol, 1.0_wp, "by so much")
   end subroutine test_open

   !> A block stands on the outer two of three nodes of another, whose inner one is in its lower
   !> edge: so is the middle of that edge behind the sides below, where that is more than it lies
   !> along them by.
   subroutine test_middle(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: rise(3) = [0.125_wp, 0.25_wp*sqrt(epsilon(1.0_wp)), 0.0_wp]
      type(scene_t) :: scene
      type(block_t) :: block
      type(overlap_t) :: overlap
      integer :: k

      do k = 1, size(rise)
         call scene_begin(scene)
         call add_block(scene, "CPE4", [2, 1], [0.0_wp, 0.0_wp], [2.0_wp, 1.0_wp], block)
         call add_surface(scene, "LOWER", block, [top])
         call add_block(scene, "CPE4", [1, 1], [0.0_wp, 1.0_wp], [2.0_wp, 1.0_wp], block)
         call add_surface(scene, "UPPER", block, [bottom])
         scene%pair = [contact_pair_t(slave=2, master=1)]
         scene%x(2, 5) = 1.0_wp + rise(k)
         call look(scene, 0.0_wp*scene%x, 1.0_wp, 2, 1, overlap)
         call check_near(error, overlap%depth*(1.0_wp + rise(k)**2), merge(rise(k), 0.0_wp, &
            k == 1), tol, 1.0_wp, "rise " // to_text(k))
      end do
   end subroutine test_middle

   !> A long edge at the height 0.9 cuts three teeth that stand on 1/2, of which one reaches up to
   !> 1.4 and the others to 1.2: deepest is its middle within the highest, by the side of that.
   subroutine test_teeth(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: at = 0.9_wp, low = 0.5_wp, high = 1.4_wp
      type(scene_t) :: scene
      type(block_t) :: block
      type(overlap_t) :: overlap
      real(wp) :: teeth(2, 7)
      integer :: i, k, highest

      do k = 1, 2
         do highest = 1, 3
            teeth = reshape([(real(i, wp), merge(low, 1.2_wp, mod(i, 2) == 0), i = 0, 6)], [2, 7])
            teeth(2, 2*highest) = high
            call scene_begin(scene)
            if (k == 1) then
               call add_block(scene, "CPE4", [6, 1], [0.0_wp, -1.0_wp], [6.0_wp, 1.0_wp], block)
               scene%x(:, 8:) = teeth
               call add_surface(scene, "TEETH", block, [top])
               call add_block(scene, "CPE4", [1, 1], [-0.5_wp, at], [7.0_wp, 1.5_wp], block)
               call add_surface(scene, "BAR", block, [bottom])
               scene%pair = [contact_pair_t(slave=2, master=1)]
            else
               ! A strip that is bent back above itself, the long edge its last one.
               call add_block(scene, "CPE4", [9, 1], [0.0_wp, -1.0_wp], [9.0_wp, 1.0_wp], block)
               scene%x(:, 11:) = reshape([teeth, 7.0_wp, 0.25_wp, 7.0_wp, at, -0.5_wp, at], [2, 10])
               scene%x(:, 8:10) = reshape([8.0_wp, -1.0_wp, 8.0_wp, 2.4_wp, -0.5_wp, 2.4_wp], [2, &
                  3])
               call add_surface(scene, "SKIN", block, [bottom, right, top, left])
               scene%pair = [contact_pair_t(slave=1, master=1)]
            end if
            call look(scene, 0.0_wp*scene%x, 1.0_wp, 3 - k, 1, overlap)
            associate (height => high - low)
               call check_near(error, overlap%depth, (high - at)/(height**2 + 1.0_wp), tol, &
                  1.0_wp, "how deep in tooth " // to_text(highest))
            end associate
            call check_true(error, any(overlap%facet == merge(7, 10, k == 1) + 2*highest), &
               "in the highest")
            call check_true(error, any(overlap%node == merge([15, 16], [19, 20], k == 1)), &
               "the long edge")
         end do
      end do
   end subroutine test_teeth

end module test_overlap_plane
