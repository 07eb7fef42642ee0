!> Time per contact kernel: one pair of edges with first derivatives, and with second ones too.
!>
!> Prints a table; asserts nothing. The time is the least of several runs over random pairs, all of
!> them covered in part. Orientation: a smoothed segment takes some 20 times as long as a node.
program bench_pair
   use, intrinsic :: iso_fortran_env, only : output_unit
   use emcon_chain_plane, only : chain_t
   use emcon_dgrad8, only : dg8_t => dg_t
   use emcon_dgrad8_first, only : dg8_first_t => dg_t
   use emcon_dgrad11, only : dg11_t => dg_t
   use emcon_dgrad11_first, only : dg11_first_t => dg_t
   use emcon_dgrad13, only : dg13_t => dg_t
   use emcon_dgrad13_first, only : dg13_first_t => dg_t
   use emcon_dgrad15, only : dg15_t => dg_t
   use emcon_dgrad15_first, only : dg15_first_t => dg_t
   use emcon_gauss, only : gauss_points
   use emcon_hermite, only : hermite_stencil_t
   use emcon_hermite_gap, only : hermite_gap
   use emcon_hermite_gap_first, only : hermite_gap_first => hermite_gap
   use emcon_hermite_gap_value, only : hermite_begin
   use emcon_kinds, only : dp, int64, wp
   use emcon_mortar_frame, only : n_moment, n_place, pair_stencil_t
   use emcon_mortar_pair2, only : segment_moments2 => segment_moments
   use emcon_mortar_pair2_first, only : segment_moments2_first => segment_moments
   use emcon_mortar_pair4, only : point_gap, segment_moments4 => segment_moments
   use emcon_mortar_pair4_first, only : point_gap_first => point_gap, &
      segment_moments4_first => segment_moments
   use emcon_mortar_stencil, only : stencil_master, stencil_slave
   use emcon_nts_gap, only : nts_gap
   use emcon_nts_gap_first, only : nts_gap_first => nts_gap
   implicit none
   real(wp), parameter :: sharp(2, 2) = 0.0_wp
   integer, parameter :: n_case = 200, n_run = 15, n_kind = 9
   character(len=40), parameter :: name(n_kind) = [character(len=40) :: "node over polygon edge", &
      "node over smoothed edge", "segment, edge normal", "segment, averaged normal", &
      "segment, edge normal, smoothed", "segment, averaged normal, smoothed", &
      "Gauss point, edge normal", "Gauss point, averaged normal", &
      "Gauss point, averaged normal, smoothed"]
   !> Slave edge, master edge, nodes beside either; slave node, edge, nodes before and after.
   real(wp), parameter :: pair_x(2, n_place) = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.9_wp, &
      -0.1_wp, -0.2_wp, -0.1_wp, -0.9_wp, 0.1_wp, 2.1_wp, 0.1_wp, 1.9_wp, -0.2_wp, -1.3_wp, &
      -0.2_wp], [2, n_place])
   real(wp), parameter :: node_x(2, 7) = reshape([0.4_wp, 0.1_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
      2.0_wp, -0.1_wp, -0.9_wp, -0.1_wp, 3.0_wp, -0.3_wp, -2.0_wp, -0.3_wp], [2, 7])
   real(wp) :: point(2), weight(2)
   integer :: kind

   call gauss_points(point, weight)
   write(output_unit, "(/, a)") "Contact kernels with first derivatives, and with second ones too"
   write(output_unit, "(a40, 2a12)") "kernel", "first [ns]", "both [ns]"
   do kind = 1, n_kind
      call bench(kind)
   end do

contains

   subroutine bench(kind)
      integer, intent(in) :: kind
      real(wp) :: x0(2, n_place, n_case), dx(2, n_place, n_case), total
      type(pair_stencil_t) :: stencil
      real(dp) :: seconds(2)
      integer(int64) :: begin, end, rate
      integer :: run, i, way

      call random_number(x0)
      call random_number(dx)
      x0 = 0.1_wp*(x0 - 0.5_wp)
      dx = 0.1_wp*(dx - 0.5_wp)
      do i = 1, n_case
         if (kind <= 2) x0(:, :7, i) = x0(:, :7, i) + node_x
         if (kind > 2) x0(:, :, i) = x0(:, :, i) + pair_x
      end do
      if (kind > 2) stencil = stencil_of(kind)
      seconds = huge(seconds)
      total = 0.0_wp
      do run = 1, n_run
         do way = 1, 2
            call system_clock(begin, rate)
            do i = 1, n_case
               call evaluate(kind, way == 1, stencil, x0(:, :, i), dx(:, :, i), total)
            end do
            call system_clock(end)
            seconds(way) = min(seconds(way), real(end - begin, dp)/real(rate, dp))
         end do
      end do
      if (total > huge(total)) write(output_unit, "(a)") "not finite"
      write(output_unit, "(a40, 2f12.0)") name(kind), 1.0e9_dp*seconds/real(n_case, dp)
   end subroutine bench

   function stencil_of(kind) result(stencil)
      integer, intent(in) :: kind
      type(pair_stencil_t) :: stencil
      type(chain_t) :: slave, master
      logical, parameter :: is_corner(3) = [.true., .false., .false.]

      call make_chain([5, 1, 2, 6], slave)
      call make_chain([7, 3, 4, 8], master)
      call stencil_slave(stencil, slave, 2, all(kind /= [3, 5, 7]), is_corner)
      call stencil_master(stencil, master, 2, any(kind == [5, 6, 9]), kind > 6, is_corner)
   end function stencil_of

   subroutine make_chain(node, chain)
      integer, intent(in) :: node(4)
      type(chain_t), intent(out) :: chain

      allocate(chain%facet, source=reshape(node([1, 2, 2, 3, 3, 4]), [2, 3]))
      allocate(chain%neighbour, source=reshape([0, 2, 1, 3, 2, 0], [2, 3]))
      allocate(chain%size, source=abs(pair_x(1, node(2:)) - pair_x(1, node(:3))))
   end subroutine make_chain

   subroutine evaluate(kind, is_first, stencil, x0, dx, total)
      integer, intent(in) :: kind
      logical, intent(in) :: is_first            !! first derivatives only
      type(pair_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x0(:, :), dx(:, :)
      real(wp), intent(inout) :: total           !! so that nothing is left out as unused

      select case (kind)
      case (1)
         call evaluate_node(is_first, x0, dx, total)
      case (2)
         call evaluate_smooth_node(is_first, x0, dx, total)
      case (3:4)
         call evaluate_segment2(is_first, stencil, x0, dx, total)
      case (5:6)
         call evaluate_segment4(is_first, stencil, x0, dx, total)
      case default
         call evaluate_point(is_first, stencil, x0, dx, total)
      end select
   end subroutine evaluate

   subroutine evaluate_node(is_first, x0, dx, total)
      logical, intent(in) :: is_first
      real(wp), intent(in) :: x0(:, :), dx(:, :)
      real(wp), intent(inout) :: total
      type(dg8_t) :: gap
      type(dg8_first_t) :: first

      if (is_first) then
         first = nts_gap_first(x0(:, :5), dx(:, :5), 5, 4, sharp)
         total = total + first%g(1)
      else
         gap = nts_gap(x0(:, :5), dx(:, :5), 5, 4, sharp)
         total = total + gap%h(1, 1)
      end if
   end subroutine evaluate_node

   subroutine evaluate_smooth_node(is_first, x0, dx, total)
      logical, intent(in) :: is_first
      real(wp), intent(in) :: x0(:, :), dx(:, :)
      real(wp), intent(inout) :: total
      type(hermite_stencil_t) :: stencil
      type(dg13_t) :: gap
      type(dg13_first_t) :: first
      real(wp) :: start(3)
      logical :: is_there

      stencil%node = [6, 4, 2, 3, 5, 7]
      stencil%length = 1.0_wp
      call hermite_begin(stencil, x0(:, :7), start)
      if (is_first) call hermite_gap_first(stencil, x0(:, :7), dx(:, :7), start, first, is_there)
      if (.not. is_first) call hermite_gap(stencil, x0(:, :7), dx(:, :7), start, gap, is_there)
      if (.not. is_there) write(output_unit, "(a)") "no closest point"
      total = total + first%g(1) + gap%h(1, 1)
   end subroutine evaluate_smooth_node

   subroutine evaluate_segment2(is_first, stencil, x0, dx, total)
      logical, intent(in) :: is_first
      type(pair_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x0(:, :), dx(:, :)
      real(wp), intent(inout) :: total
      type(dg11_t) :: moment(n_moment)
      type(dg11_first_t) :: first(n_moment)
      logical :: is_there

      if (is_first) then
         call segment_moments2_first(stencil, x0, dx, point, weight, first, is_there)
      else
         call segment_moments2(stencil, x0, dx, point, weight, moment, is_there)
      end if
      if (.not. is_there) write(output_unit, "(a)") "no overlap"
      total = total + first(1)%g(1) + moment(1)%h(1, 1)
   end subroutine evaluate_segment2

   subroutine evaluate_segment4(is_first, stencil, x0, dx, total)
      logical, intent(in) :: is_first
      type(pair_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x0(:, :), dx(:, :)
      real(wp), intent(inout) :: total
      type(dg15_t) :: moment(n_moment)
      type(dg15_first_t) :: first(n_moment)
      logical :: is_there

      if (is_first) then
         call segment_moments4_first(stencil, x0, dx, point, weight, first, is_there)
      else
         call segment_moments4(stencil, x0, dx, point, weight, moment, is_there)
      end if
      if (.not. is_there) write(output_unit, "(a)") "no overlap"
      total = total + first(1)%g(1) + moment(1)%h(1, 1)
   end subroutine evaluate_segment4

   subroutine evaluate_point(is_first, stencil, x0, dx, total)
      logical, intent(in) :: is_first
      type(pair_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: x0(:, :), dx(:, :)
      real(wp), intent(inout) :: total
      type(dg15_t) :: gap, length
      type(dg15_first_t) :: first(2)

      if (is_first) then
         call point_gap_first(stencil, x0, dx, 0.5_wp, first(1), first(2))
         total = total + first(1)%g(1) + first(2)%g(1)
      else
         call point_gap(stencil, x0, dx, 0.5_wp, gap, length)
         total = total + gap%h(1, 1) + length%h(1, 1)
      end if
   end subroutine evaluate_point

end program bench_pair
