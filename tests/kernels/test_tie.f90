!> Constraint rows of ties: closed forms, linear fields, curved surfaces, invariance.
module test_tie
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_couplings, only : tie_rows_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : multiplier_dual, multiplier_standard
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use small_scenes, only : scene_begin
   use tie_scenes, only : add_line, check_positions, check_rows, entry, even, make_disc, &
      make_straight, measure, multipliers, rotate, row_sum, tol, uneven
   implicit none
   private
   public :: collect_tie

   real(wp), parameter :: pi = acos(-1.0_wp)

contains

   subroutine collect_tie(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("matching meshes", test_matching), &
         test_case_t("one edge over two", test_closed_form), &
         test_case_t("linear fields at any ratio", test_linear), &
         test_case_t("sums over rows", test_sums), &
         test_case_t("slave entries", test_slave_entries), &
         test_case_t("order and neighbours of rows", test_order), &
         test_case_t("square in a square hole", test_square), &
         test_case_t("square with clearance", test_clearance), &
         test_case_t("nodes on common rays", test_rays), &
         test_case_t("disc in a hole", test_disc), &
         test_case_t("convergence on a curve", test_convergence), &
         test_case_t("rotated", test_rotated), &
         test_case_t("far away and in other units", test_units)]
   end subroutine collect_tie

   ! ---- straight surfaces ----------------------------------------------------------------------

   !> Nodes that stand opposite each other are tied one to one.
   subroutine test_matching(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      real(wp) :: place(13)
      integer :: k

      place = uneven(12, 0.0_wp, 3.0_wp)
      call make_straight(scene, place, place(13:1:-1))
      call rotate(scene, 0.3_wp)
      call measure(scene, multiplier_dual, rows, error)
      if (allocated(error)) return
      call check_equal(error, rows%start, [(2*k, k = 0, 13)], "two entries a row")
      if (allocated(error)) return
      do k = 1, 13
         ! The line of the slave has 13 nodes and 12 apexes before those of the master.
         call check_equal(error, rows%node(2*k - 1:2*k), [k, 39 - k], "nodes of a row")
         call check_near(error, rows%weight(2*k), -rows%weight(2*k - 1), 0.0_wp, 1.0_wp, &
            "weights of a row")
      end do
      call check_near(error, rows%weight(1::2), rows%size, tol, maxval(rows%size), "D = size")
   end subroutine test_matching

   !> A slave edge over 0..1, master edges over 0..c and c..1: with d = 1 - c and psi = 1 - xi the
   !> integrals are c/2 - c^2/6 for the node at 0 and d^2/6 for the one at 1; with psi = xi the same
   !> from the other end. The dual basis is twice the one less the other.
   subroutine test_closed_form(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      real(wp), parameter :: c = 0.3_wp, d = 1.0_wp - c
      real(wp) :: m(3, 2)                        !! master nodes at 0, c, 1
      integer :: j, k, i

      call make_straight(scene, [0.0_wp, 1.0_wp], [1.0_wp, c, 0.0_wp])
      do j = 1, 2
         m(:, 1) = [c/2.0_wp - c**2/6.0_wp, 0.0_wp, d**2/6.0_wp]
         m(:, 2) = [c**2/6.0_wp, 0.0_wp, d/2.0_wp - d**2/6.0_wp]
         m(2, :) = 0.5_wp - sum(m, 1)
         if (multipliers(j) == multiplier_dual) m = 2.0_wp*m - m(:, [2, 1])
         call measure(scene, multipliers(j), rows, error)
         if (allocated(error)) return
         do k = 1, 2
            do i = 1, 3
               call check_near(error, entry(rows, k, 7 - i), -m(i, k), tol, 1.0_wp, &
                  "master entry " // to_text(i) // " of row " // to_text(k))
            end do
         end do
         if (allocated(error)) return
      end do
   end subroutine test_closed_form

   !> Fields linear along the interface pass unchanged, whatever the meshes.
   subroutine test_linear(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      integer, parameter :: n(2, 8) = reshape([7, 7, 6, 9, 9, 6, 3, 30, 30, 3, 2, 200, 200, 2, &
         1, 1], [2, 8])
      integer :: i, j

      do i = 1, size(n, 2)
         call make_straight(scene, uneven(n(1, i), 0.0_wp, 2.0_wp), uneven(n(2, i), 2.0_wp, 0.0_wp))
         call rotate(scene, real(i, wp))
         do j = 1, 2
            call measure(scene, multipliers(j), rows, error)
            if (allocated(error)) return
            call check_rows(scene, rows, 2.0_wp, error)
            call check_positions(scene, rows, 2.0_wp, error)
            if (allocated(error)) return
         end do
      end do
   end subroutine test_linear

   !> Both bases add up to 1: so the entries of a master node add up to int N = half the length of
   !> its edges, where all of them are covered.
   subroutine test_sums(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      real(wp) :: master(9), total, half
      integer :: i, j, k

      master = uneven(8, 2.0_wp, 0.0_wp)
      call make_straight(scene, uneven(11, 0.0_wp, 2.0_wp), master)
      do j = 1, 2
         call measure(scene, multipliers(j), rows, error)
         if (allocated(error)) return
         do i = 1, size(master)
            total = 0.0_wp
            do k = 1, size(rows%slave)
               total = total + entry(rows, k, 23 + i)
            end do
            half = 0.5_wp*(master(max(1, i - 1)) - master(min(9, i + 1)))
            call check_near(error, total, -half, tol, 2.0_wp, "entries of a master node")
         end do
         if (allocated(error)) return
      end do
   end subroutine test_sums

   !> D: diagonal and equal to the size with the dual basis, l/3 and l/6 with the standard one.
   subroutine test_slave_entries(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      real(wp) :: place(6), l(0:6), expected
      integer :: k, i

      place = uneven(5, 0.0_wp, 2.0_wp)
      l = 0.0_wp
      l(1:5) = place(2:) - place(:5)
      call make_straight(scene, place, uneven(7, 2.0_wp, 0.0_wp))
      call measure(scene, multiplier_dual, rows, error)
      if (allocated(error)) return
      do k = 1, 6
         do i = 1, 6
            expected = merge(0.5_wp*(l(k - 1) + l(k)), 0.0_wp, i == k)
            call check_near(error, entry(rows, k, i), expected, merge(tol, 0.0_wp, i == k), &
               expected, "dual D")
         end do
      end do
      if (allocated(error)) return
      call measure(scene, multiplier_standard, rows, error)
      if (allocated(error)) return
      do k = 1, 6
         do i = 1, 6
            expected = 0.0_wp
            if (i == k) expected = (l(k - 1) + l(k))/3.0_wp
            if (abs(i - k) == 1) expected = l(min(i, k))/6.0_wp
            call check_near(error, entry(rows, k, i), expected, tol, rows%size(k), "standard D")
         end do
      end do
   end subroutine test_slave_entries

   !> Rows follow the chains, whatever the order of the faces; ends have no neighbour.
   subroutine test_order(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      integer :: k

      call make_straight(scene, even(4, 0.0_wp, 4.0_wp), even(3, 4.0_wp, 0.0_wp))
      ! Edges 3-4, 1-2, 4-5: parts 3-4-5 and 1-2.
      scene%surface(1)%element = [3, 1, 4]
      scene%surface(1)%face = [1, 1, 1]
      call measure(scene, multiplier_dual, rows, error)
      if (allocated(error)) return
      call check_equal(error, rows%slave, [3, 4, 5, 1, 2], "order of the rows")
      call check_equal(error, rows%neighbour(1, :), [0, 1, 2, 0, 4], "rows before")
      call check_equal(error, rows%neighbour(2, :), [2, 3, 0, 5, 0], "rows after")
      call check_rows(scene, rows, 3.0_wp, error)
      call check_positions(scene, rows, 4.0_wp, error)
      if (allocated(error)) return
      call make_disc(scene, 7, 9, 0.2_wp, .true.)
      call measure(scene, multiplier_dual, rows, error)
      if (allocated(error)) return
      call check_equal(error, rows%slave, [(k, k = 1, 7)], "order around a circle")
      call check_equal(error, rows%neighbour(1, :), [7, 1, 2, 3, 4, 5, 6], "before, closed")
      call check_equal(error, rows%neighbour(2, :), [2, 3, 4, 5, 6, 7, 1], "after, closed")
   end subroutine test_order

   ! ---- corners and curves ---------------------------------------------------------------------

   !> Corners on both sides: every edge is tied to its own side, so linear fields pass.
   subroutine test_square(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      integer :: i, j

      do i = 1, 2
         call scene_begin(scene)
         if (i == 1) call add_line(scene, "INNER", square(7, .false.), .true.)
         call add_line(scene, "OUTER", square(5, .true.), .true.)
         if (i == 2) call add_line(scene, "INNER", square(7, .false.), .true.)
         call rotate(scene, 0.7_wp)
         do j = 1, 2
            call measure(scene, multipliers(j), rows, error)
            if (allocated(error)) return
            call check_rows(scene, rows, 4.0_wp, error)
            call check_positions(scene, rows, 1.0_wp, error)
            if (allocated(error)) return
         end do
      end do
   end subroutine test_square

   !> A hole larger than the square by h on each side. Normals of the square meet the sides of the
   !> hole: with int psi = l/2 on each edge the rows leave h l/2 times its normal, exactly. Normals
   !> of the hole look past the square next to its corners, which belong to these points: the way is
   !> h sqrt(2) at most, and int |psi| is 5/3 of int psi at most.
   subroutine test_clearance(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      real(wp), parameter :: h = 0.00390625_wp
      integer, parameter :: n = 28
      integer :: i, j, k
      real(wp) :: hole(2, 20), inner(2, n), way(2), edges(2)

      inner = square(7, .false.)
      hole = square(5, .true.)
      hole = (1.0_wp + 2.0_wp*h)*hole - h
      do i = 1, 2
         call scene_begin(scene)
         if (i == 1) call add_line(scene, "INNER", inner, .true.)
         call add_line(scene, "OUTER", hole, .true.)
         if (i == 2) call add_line(scene, "INNER", inner, .true.)
         do j = 1, 2
            call measure(scene, multipliers(j), rows, error)
            if (allocated(error)) return
            call check_rows(scene, rows, merge(4.0_wp, 4.0_wp + 8.0_wp*h, i == 1), error)
            do k = 1, size(rows%slave)
               way = [row_sum(rows, k, scene%x(1, :)), row_sum(rows, k, scene%x(2, :))]
               call check_near(error, norm2(way), 0.0_wp, 5.0_wp/3.0_wp*sqrt(2.0_wp)*h, &
                  rows%size(k), "way over the clearance")
               if (i == 2) cycle
               edges = inner(:, mod(k, n) + 1) - inner(:, mod(k + n - 2, n) + 1)
               call check_near(error, way, -0.5_wp*h*[edges(2), -edges(1)], tol, 1.0_wp, &
                  "way to the sides of the hole")
            end do
            if (allocated(error)) return
         end do
      end do
   end subroutine test_clearance

   !> Polygons with the nodes of both on the same rays: averaged normals run along these, so nodes
   !> see nodes and, as the edges are parallel, D and M are diagonal.
   subroutine test_rays(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      integer, parameter :: n = 12
      integer :: i, k, opposite

      do i = 1, 2
         call make_disc(scene, n, n, 0.0_wp, i == 1)
         scene%x(:, 2*n + 1:) = 1.03125_wp*scene%x(:, 2*n + 1:)
         call measure(scene, multiplier_dual, rows, error)
         if (allocated(error)) return
         do k = 1, n
            ! Node k of the one stands opposite node n - k of the other.
            opposite = 2*n + merge(n, n - rows%slave(k), rows%slave(k) == n)
            call check_near(error, entry(rows, k, opposite), -rows%size(k), tol, rows%size(k), &
               "weight of the node on the same ray")
         end do
         if (allocated(error)) return
      end do
   end subroutine test_rays

   !> The unit square with n edges a side, counter-clockwise or, as a hole, clockwise.
   function square(n, is_hole) result(points)
      integer, intent(in) :: n
      logical, intent(in) :: is_hole
      real(wp) :: points(2, 4*n)
      real(wp) :: side(n + 1)
      integer :: k
      real(wp), parameter :: corner(2, 5) = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, &
         1.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp], [2, 5])

      do k = 1, 4
         side = uneven(n, 0.0_wp, 1.0_wp)
         points(1, (k - 1)*n + 1:k*n) = corner(1, k) + side(:n)*(corner(1, k + 1) - corner(1, k))
         points(2, (k - 1)*n + 1:k*n) = corner(2, k) + side(:n)*(corner(2, k + 1) - corner(2, k))
      end do
      if (is_hole) points = points(:, 4*n:1:-1)
   end function square

   !> Two polygons of one circle lie within their sagittas: D X_s - M X_m is the integral of psi
   !> times the way between them along nearly their normals; int |psi| is 5/3 of int psi at most.
   subroutine test_disc(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      integer, parameter :: n(2, 6) = reshape([12, 12, 12, 17, 8, 80, 80, 8, 400, 8, 8, 400], &
         [2, 6])
      real(wp) :: apart, length
      integer :: i, j, k, side

      do i = 1, size(n, 2)
         apart = sum(1.0_wp - cos(pi/real(n(:, i), wp)))
         do side = 1, 2
            call make_disc(scene, n(1, i), n(2, i), 0.37_wp, side == 1)
            length = 2.0_wp*real(n(side, i), wp)*sin(pi/real(n(side, i), wp))
            do j = 1, 2
               call measure(scene, multipliers(j), rows, error)
               if (allocated(error)) return
               call check_rows(scene, rows, length, error)
               do k = 1, size(rows%slave)
                  call check_near(error, hypot(row_sum(rows, k, scene%x(1, :)), &
                     row_sum(rows, k, scene%x(2, :))), 0.0_wp, 1.1_wp*5.0_wp/3.0_wp*apart, &
                     rows%size(k), "way between polygons")
               end do
               if (allocated(error)) return
            end do
         end do
      end do
   end subroutine test_disc

   !> The largest way that rows leave falls with the square of the edges.
   subroutine test_convergence(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows
      real(wp) :: largest(3)
      integer :: i, j, k, n

      do j = 1, 2
         do i = 1, 3
            n = 8*2**i
            call make_disc(scene, 2*n, 3*n, 0.0_wp, .true.)
            call measure(scene, multipliers(j), rows, error)
            if (allocated(error)) return
            largest(i) = 0.0_wp
            do k = 1, size(rows%slave)
               largest(i) = max(largest(i), hypot(row_sum(rows, k, scene%x(1, :)), &
                  row_sum(rows, k, scene%x(2, :)))/rows%size(k))
            end do
         end do
         call check_true(error, all(largest > 0.0_wp), "the polygons differ")
         if (allocated(error)) return
         call check_near(error, log(largest(2)/largest(3))/log(2.0_wp), 2.0_wp, 0.1_wp, 1.0_wp, &
            "order of the way")
         if (allocated(error)) return
      end do
   end subroutine test_convergence

   ! ---- invariance -----------------------------------------------------------------------------

   subroutine test_rotated(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(tie_rows_t) :: rows, turned
      integer :: j

      do j = 1, 2
         call make_disc(scene, 23, 17, 0.37_wp, .true.)
         call measure(scene, multipliers(j), rows, error)
         if (allocated(error)) return
         call rotate(scene, 1.1_wp)
         call measure(scene, multipliers(j), turned, error)
         if (allocated(error)) return
         call check_equal(error, turned%node, rows%node, "nodes of the turned rows")
         call check_near(error, turned%weight, rows%weight, tol, maxval(rows%size), &
            "weights of the turned rows")
         if (allocated(error)) return
      end do
   end subroutine test_rotated

   !> Positions that stay exact when moved by some 10^8 edges, or scaled by a power of two, give the
   !> same bits.
   subroutine test_units(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene, moved
      type(tie_rows_t) :: rows, other
      real(wp), parameter :: step = 2.0_wp**(-12)
      integer :: j

      call make_disc(scene, 23, 17, 0.37_wp, .true.)
      scene%x = step*real(nint(scene%x/step), wp)
      do j = 1, 2
         call measure(scene, multipliers(j), rows, error)
         if (allocated(error)) return
         moved = scene
         moved%x = 2.0_wp**(-20)*scene%x
         call measure(moved, multipliers(j), other, error)
         if (allocated(error)) return
         call check_equal(error, other%node, rows%node, "nodes in other units")
         call check_near(error, other%weight, 2.0_wp**(-20)*rows%weight, 0.0_wp, 1.0_wp, &
            "weights in other units")
         if (allocated(error)) return
         moved%x = scene%x + 2.0_wp**(digits(1.0_wp) - 26)
         call measure(moved, multipliers(j), other, error)
         if (allocated(error)) return
         call check_equal(error, other%node, rows%node, "nodes far away")
         call check_near(error, other%weight, rows%weight, 0.0_wp, 1.0_wp, "weights far away")
         if (allocated(error)) return
      end do
   end subroutine test_units

end module test_tie
