!> Which pairs of edges are meant, and which of them a point looks at: flat edges, whose places and
!> heights are known.
module test_mortar_choice
   use check, only : check_equal, check_true, test_case_t
   use emcon_chain_plane, only : chain_t, next, previous
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_mortar_choice, only : pair_append, pair_cut_corners, pair_is_meant, pairs_drop_far, &
      pairs_seen
   use emcon_mortar_frame, only : frame_init, frame_t, local_master, pair_stencil_t
   use emcon_mortar_stencil, only : stencil_gather, stencil_master, stencil_slave
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_mortar_choice

   !> Nodes: 1 and 2 of the slave edge from 0 to 1, 3 before and 4 after it, from 5 on two of each
   !> master edge.
   integer, parameter :: first_master = 4

contains

   subroutine collect_mortar_choice(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("edges that overlap in front, at either end", test_meant), &
         test_case_t("not beyond where normals cross", test_focus), &
         test_case_t("neighbours that are faced", test_corners), &
         test_case_t("of two over the same part the nearer", test_drop), &
         test_case_t("edges that a point looks at", test_seen), &
         test_case_t("a list that grows", test_append)]
   end subroutine collect_mortar_choice

   !> The slave edge from 0 to 1 with the body above it, and master edges that run against it from
   !> `first` to `last`, `depth` below, there by `fall` deeper.
   subroutine place_edges(first, last, depth, x, slave, master, fall)
      real(wp), intent(in) :: first(:), last(:), depth(:)
      real(wp), allocatable, intent(out) :: x(:, :)
      type(chain_t), intent(out) :: slave, master
      real(wp), intent(in), optional :: fall(:)
      integer :: k, n

      n = size(first)
      allocate(x(2, first_master + 2*n), source=0.0_wp)
      x(1, :first_master) = [0.0_wp, 1.0_wp, -1.0_wp, 2.0_wp]
      x(1, first_master + 1::2) = first
      x(1, first_master + 2::2) = last
      x(2, first_master + 1::2) = -depth
      x(2, first_master + 2::2) = -depth
      if (present(fall)) x(2, first_master + 2::2) = -depth - fall
      slave%n_facet = 3
      allocate(slave%facet, source=reshape([3, 1, 1, 2, 2, 4], [2, 3]))
      allocate(slave%neighbour, source=reshape([0, 2, 1, 3, 2, 0], [2, 3]))
      slave%size = [1.0_wp, 1.0_wp, 1.0_wp]
      master%n_facet = n
      allocate(master%facet, source=reshape([(first_master + k, k = 1, 2*n)], [2, n]))
      allocate(master%neighbour(2, n), source=0)
      master%size = abs(last - first)
   end subroutine place_edges

   !> The pairs of the slave edge with all master edges.
   function pairs_of(slave, master, is_averaged) result(pair)
      type(chain_t), intent(in) :: slave, master
      logical, intent(in) :: is_averaged
      type(pair_stencil_t) :: pair(master%n_facet)
      logical :: is_corner(max(3, master%n_facet))
      integer :: k

      is_corner = .false.
      do k = 1, master%n_facet
         call stencil_slave(pair(k), slave, 2, is_averaged, is_corner)
         call stencil_master(pair(k), master, k, .false., .false., is_corner)
      end do
   end function pairs_of

   !> Frames of a pair at the start and after the motion `du`.
   function frames_of(pair, x, du) result(frame)
      type(pair_stencil_t), intent(in) :: pair
      real(wp), intent(in) :: x(:, :), du(:, :)
      type(frame_t) :: frame(0:1)
      real(wp) :: local(2, 8), dlocal(2, 8)

      call stencil_gather(pair, x, 0.0_wp*x, du, local, dlocal)
      call frame_init(frame(0), pair, local)
      call frame_init(frame(1), pair, local + dlocal)
   end function frames_of

   !> Edges at any places that move along and across: a quarter of the slave edge beside it counts,
   !> and where both overlap at the start the master is not deeper behind than it may be.
   subroutine test_meant(error)
      type(error_t), allocatable, intent(out) :: error
      type(chain_t) :: slave, master
      type(pair_stencil_t) :: pair(1)
      real(wp), allocatable :: x(:, :), du(:, :)
      real(wp) :: u(6), low(0:1), high(0:1)
      real(wp), parameter :: deepest = 0.2_wp
      integer :: i, n_meant
      logical :: expected, is_turned

      n_meant = 0
      do i = 1, 400
         call draw_random(u)
         low(0) = 5.0_wp*u(1) - 2.5_wp
         high(0) = low(0) + 0.1_wp + u(2)
         is_turned = u(5) > 0.9_wp
         call place_edges([merge(low(0), high(0), is_turned)], [merge(high(0), low(0), &
            is_turned)], [u(3) - 0.5_wp], x, slave, master)
         allocate(du, source=0.0_wp*x)
         du(1, first_master + 1:) = 2.0_wp*u(4) - 1.0_wp
         du(2, first_master + 1:) = u(6)
         low(1) = low(0) + du(1, first_master + 1)
         high(1) = high(0) + du(1, first_master + 1)
         expected = any(high > -0.25_wp .and. low < 1.25_wp) .and. .not. is_turned
         if (min(high(0), 1.0_wp) > max(low(0), 0.0_wp)) expected = expected .and. &
            u(3) - 0.5_wp > -deepest
         pair = pairs_of(slave, master, .false.)
         call check_true(error, pair_is_meant(pair(1), frames_of(pair(1), x, du), deepest) &
            .eqv. expected, "case " // to_text(i))
         if (expected) n_meant = n_meant + 1
         deallocate(du)
      end do
      call check_true(error, n_meant > 50 .and. n_meant < 350, "both, meant: " // to_text(n_meant))
   end subroutine test_meant

   !> Normals that meet at a depth of 1 below the middle: edges before that are meant, at both ends.
   subroutine test_focus(error)
      type(error_t), allocatable, intent(out) :: error
      type(chain_t) :: slave, master
      type(pair_stencil_t) :: pair(1)
      real(wp), allocatable :: x(:, :), du(:, :)
      real(wp), parameter :: depth(2) = [0.5_wp, 1.5_wp]
      integer :: i, k

      do i = 1, 2
         do k = 1, 2
            call place_edges([0.55_wp], [0.45_wp], [depth(i)], x, slave, master)
            x(2, 3:4) = -1.0_wp
            allocate(du, source=0.0_wp*x)
            du(2, first_master + 1:) = depth(i) - depth(k)
            pair = pairs_of(slave, master, .true.)
            call check_true(error, pair_is_meant(pair(1), frames_of(pair(1), x, du), 0.1_wp) &
               .eqv. max(i, k) == 1, "from " // to_text(i) // " to " // to_text(k))
            deallocate(du)
         end do
      end do
      ! And one that ends beside the point where they meet, seen from more than one place.
      do k = -1, 1, 2
         call place_edges([0.5_wp + max(0, k)], [0.5_wp + min(0, k)], [1.2_wp], x, slave, master)
         x(2, 3:4) = -1.0_wp
         allocate(du, source=0.0_wp*x)
         pair = pairs_of(slave, master, .true.)
         call check_true(error, .not. pair_is_meant(pair(1), frames_of(pair(1), x, du), 0.1_wp), &
            "beside " // to_text(k))
         deallocate(du)
      end do
   end subroutine test_focus

   !> Of the neighbours of a master edge those that turn away are left out.
   subroutine test_corners(error)
      type(error_t), allocatable, intent(out) :: error
      type(chain_t) :: slave, master
      type(pair_stencil_t) :: pair, cut
      type(frame_t) :: frame(0:1)
      real(wp), allocatable :: x(:, :)
      logical, parameter :: is_corner(3) = .false.
      integer :: i

      do i = 0, 3
         call place_edges([1.4_wp, 0.9_wp, 0.1_wp], [0.9_wp, 0.1_wp, -0.4_wp], [0.1_wp, 0.1_wp, &
            0.1_wp], x, slave, master)
         master%facet(:, 1) = [5, 7]
         master%facet(:, 3) = [8, 10]
         master%neighbour = reshape([0, 2, 1, 3, 2, 0], [2, 3])
         if (btest(i, 0)) x(:, 5) = [0.9_wp, -1.0_wp]
         if (btest(i, 1)) x(:, 10) = [0.1_wp, -1.0_wp]
         call stencil_slave(pair, slave, 2, .false., is_corner)
         call stencil_master(pair, master, 2, .false., .true., is_corner)
         frame = frames_of(pair, x, 0.0_wp*x)
         cut = pair
         call pair_cut_corners(cut, frame(0))
         call check_equal(error, cut%node(local_master), [7, 8, merge(0, 5, btest(i, 0)), &
            merge(0, 10, btest(i, 1))], "case " // to_text(i))
      end do
   end subroutine test_corners

   !> Up to five edges at random: no two of those kept overlap by more than a hundredth, and what
   !> goes overlaps a nearer one that is kept; before the first one nothing is looked at. Two that
   !> are joined are both kept. What counts is the height in the middle of what is covered.
   subroutine test_drop(error)
      type(error_t), allocatable, intent(out) :: error
      type(chain_t) :: slave, master
      type(pair_stencil_t), allocatable :: list(:)
      real(wp), allocatable :: x(:, :), low(:), high(:), depth(:), fall(:)
      logical, allocatable :: is_kept(:)
      logical :: is_beaten
      integer :: i, j, k, m, n, n_gone

      n_gone = 0
      do i = 1, 200
         m = 1 + mod(i, 5)
         allocate(low(m), high(m), depth(m), fall(m))
         call draw_random(low)
         call draw_random(high)
         call draw_random(depth)
         call draw_random(fall)
         low = 1.4_wp*low - 0.3_wp
         high = low + 0.05_wp + 0.6_wp*high
         depth = depth - 0.3_wp
         fall = 0.4_wp*(high - low)*(fall - 0.5_wp)
         call place_edges(high, low, depth, x, slave, master, fall)
         depth = depth + fall*(high - 0.5_wp*(max(0.0_wp, min(1.0_wp, low)) + max(0.0_wp, &
            min(1.0_wp, high))))/(high - low)
         list = [pair_stencil_t(), pairs_of(slave, master, .false.)]
         if (m > 1 .and. mod(i, 3) == 0) then
            master%neighbour(next, 1) = 2
            master%neighbour(previous, 2) = 1
         end if
         n = m + 1
         call pairs_drop_far(list, master, 2, n, x, 0.0_wp*x)
         allocate(is_kept(m))
         is_kept = [(any(list(2:n)%edge == k), k = 1, m)]
         call check_equal(error, count(is_kept), n - 1, "each once")
         call check_equal(error, list(1)%edge, 0, "before the first one")
         do k = 1, m
            is_beaten = .false.
            do j = 1, m
               if (j == k .or. .not. is_kept(j) .or. master%neighbour(next, min(j, k)) &
                  == max(j, k)) cycle
               associate (same => min(high(j), high(k), 1.0_wp) - max(low(j), low(k), 0.0_wp))
                  is_beaten = is_beaten .or. (same > 0.01_wp .and. abs(depth(j)) < abs(depth(k)))
               end associate
            end do
            call check_true(error, is_beaten .neqv. is_kept(k), "edge " // to_text(k) // &
               " of case " // to_text(i))
         end do
         n_gone = n_gone + count(.not. is_kept)
         deallocate(low, high, depth, fall, is_kept)
      end do
      call check_true(error, n_gone > 100, "gone: " // to_text(n_gone))
   end subroutine test_drop

   !> Edges from 1.4 to 0.5, from there to -0.5, and on to -1.6: whichever is told first.
   subroutine test_seen(error)
      type(error_t), allocatable, intent(out) :: error
      type(chain_t) :: slave, master
      type(pair_stencil_t) :: pair(3)
      real(wp), allocatable :: x(:, :)
      real(wp), parameter :: point(7) = [0.2_wp, 0.5_wp - 2.0e-4_wp, 0.5_wp - 5.0e-5_wp, 0.5_wp, &
         0.5_wp + 5.0e-5_wp, 0.5_wp + 2.0e-4_wp, 0.9_wp]
      integer, parameter :: one(7) = [2, 2, 2, 0, 1, 1, 1], beside(7) = [0, 0, 1, 0, 2, 0, 0]
      integer :: seen(2, size(point)), order(3, 3), i, k

      call place_edges([1.4_wp, 0.5_wp, -0.5_wp], [0.5_wp, -0.5_wp, -1.6_wp], [0.1_wp, 0.1_wp, &
         0.1_wp], x, slave, master)
      order = reshape([1, 2, 3, 2, 1, 3, 3, 2, 1], [3, 3])
      do i = 1, 3
         pair = pairs_of(slave, master, .false.)
         pair = pair(order(:, i))
         call pairs_seen(pair, master, point, x, 0.0_wp*x, 0.0_wp*x, seen)
         do k = 1, size(point)
            if (one(k) > 0) then
               call check_equal(error, seen(:, k), [findloc(order(:, i), one(k), 1), &
                  merge(findloc(order(:, i), beside(k), 1), 0, beside(k) > 0)], "point " &
                  // to_text(k) // " in order " // to_text(i))
            else
               call check_true(error, any(order(seen(1, k), i) == [1, 2]) .and. &
                  order(seen(1, k), i) + order(seen(2, k), i) == 3, "at the node, both")
            end if
         end do
         if (allocated(error)) return
      end do
      call look_at_end(slave, master, point, x, error)
      if (.not. allocated(error)) call look_at_joint(error)
      if (.not. allocated(error)) call look_at_node(error)
   end subroutine test_seen

   !> The last edge alone, which moves by 1: from there on it is seen up to 0.5.
   subroutine look_at_end(slave, master, point, x, error)
      type(chain_t), intent(in) :: slave, master
      real(wp), intent(in) :: point(:), x(:, :)
      type(error_t), allocatable, intent(inout) :: error
      type(pair_stencil_t) :: pair(3)
      real(wp) :: du(2, size(x, 2))
      integer :: seen(2, size(point)), k

      pair = pairs_of(slave, master, .false.)
      du = 0.0_wp
      du(1, first_master + 1:) = 1.0_wp
      call pairs_seen(pair(3:3), master, point, x, 0.0_wp*x, du, seen)
      do k = 1, size(point)
         call check_equal(error, seen(:, k), [merge(1, 0, point(k) <= 0.5_wp), 0], &
            "at the end, point " // to_text(k))
      end do
   end subroutine look_at_end

   !> Two edges that a joint 0.1 wide parts, and two that nothing joins; past
   !> their other ends they are not seen.
   subroutine look_at_joint(error)
      type(error_t), allocatable, intent(inout) :: error
      type(chain_t) :: slave, master
      type(pair_stencil_t) :: pair(2)
      real(wp), allocatable :: x(:, :)
      integer :: seen(2, 4), i

      do i = 0, 1
         call place_edges([1.1_wp, 0.5_wp], [0.6_wp, 0.2_wp], [0.1_wp, 0.1_wp], x, slave, master)
         if (i == 1) master%neighbour = reshape([0, 2, 1, 0], [2, 2])
         pair = pairs_of(slave, master, .false.)
         call pairs_seen(pair, master, [0.1_wp, 0.15_wp, 0.55_wp, 0.7_wp], x, 0.0_wp*x, 0.0_wp*x, &
            seen)
         call check_equal(error, seen(1, :), [0, 0, i, 1], "over a joint")
         call check_true(error, all(seen(2, :) == 0), "none beside")
      end do
   end subroutine look_at_joint

   !> A point that looks at the end of an edge as the step begins has no other one beside it, though
   !> one comes there in the step.
   subroutine look_at_node(error)
      type(error_t), allocatable, intent(inout) :: error
      type(chain_t) :: slave, master
      type(pair_stencil_t) :: pair(2)
      real(wp), allocatable :: x(:, :), du(:, :)
      integer :: seen(2, 1)

      call place_edges([1.0_wp, 0.25_wp], [0.5_wp, 0.0_wp], [0.1_wp, 0.1_wp], x, slave, master)
      allocate(du, source=0.0_wp*x)
      du(1, first_master + 3:) = 0.25_wp
      pair = pairs_of(slave, master, .false.)
      call pairs_seen(pair, master, [0.5_wp], x, 0.0_wp*x, du, seen)
      call check_equal(error, seen(:, 1), [1, 0], "one that comes later")
      du(1, first_master + 1:) = 0.25_wp
      call pairs_seen(pair, master, [0.25_wp], x, du, 0.0_wp*du, seen)
      call check_equal(error, seen(:, 1), [2, 0], "from where the step begins")
   end subroutine look_at_node

   subroutine test_append(error)
      type(error_t), allocatable, intent(out) :: error
      type(pair_stencil_t), allocatable :: list(:)
      integer :: k, n, m

      allocate(list(0))
      n = 0
      do k = 1, 100
         call pair_append(list, n, pair_stencil_t(edge=k))
         call check_equal(error, n, k, "number")
         if (allocated(error)) return
         call check_equal(error, list(:n)%edge, [(m, m = 1, k)], "all of them")
      end do
   end subroutine test_append

end module test_mortar_choice
