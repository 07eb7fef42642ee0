!> Contact constraints made of the gaps of one slave node, with their derivatives: without the
!> second ones where nobody asks for these.
!>
!> Source: docs/theory.md, sections 4.2 and 4.3.
module emcon_nts_constraint
   use emcon_condition_nodes, only : condition_resize, condition_resize_slip, nodes_append
   use emcon_constraint, only : condition_t
   use emcon_dgrad8, only : dg8_t => dg_t
   use emcon_dgrad8_first, only : dg8_first_t => dg_t
   use emcon_dgrad13, only : dg13_t => dg_t
   use emcon_dgrad13_first, only : dg13_first_t => dg_t
   use emcon_dgrad_nodes, only : nodes_add_first, nodes_add_second
   use emcon_dgrad_wide, only : change_t
   use emcon_hermite_gap, only : hermite_gap, hermite_slip
   use emcon_hermite_gap_first, only : hermite_gap_first => hermite_gap, &
      hermite_slip_first => hermite_slip
   use emcon_kinds, only : wp
   use emcon_nts_gap, only : nts_gap
   use emcon_nts_gap_first, only : nts_gap_first => nts_gap
   use emcon_nts_gap_value, only : slave
   use emcon_nts_stencil, only : most_nodes, smooth_stencil_t, stencil_gather, stencil_length
   use emcon_polygon_slip_plane, only : polygon_slip_add
   use emcon_polygon_stencil_plane, only : polygon_stencil_t
   implicit none
   private
   public :: polygon_constraint, smooth_constraint

   integer, parameter :: in_order(most_nodes) = [1, 2, 3, 4, 5, 6, 7]

contains

   !> The mean of the gaps over polygons, one, or two that give the same gap: from both edges at a
   !> corner. The discrete gradient then does not depend on which of them comes first.
   pure subroutine polygon_constraint(stencil, x, u0, du, target, item)
      type(polygon_stencil_t), intent(in) :: stencil(:)   !! (1 or 2)
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node)
      real(wp), intent(in) :: target             !! gap to hold [L]
      type(condition_t), intent(inout) :: item
      integer :: n, i, list(sum(stencil%n) + 1)

      n = 0
      if (item%has_friction .and. stencil(1)%arm > 0) then
         call nodes_append([stencil(1)%node(slave), stencil(1)%arm], list, n)
      end if
      do i = 1, size(stencil)
         call nodes_append(stencil(i)%node(:stencil(i)%n), list, n)
      end do
      call begin_constraint(item, x, list(:n), stencil(1)%node)
      if (item%has_friction .and. stencil(1)%arm > 0) item%n_slave = 2
      item%gap0 = -target
      item%gap1 = -target
      item%dgap = 0.0_wp
      item%g(:, :n) = 0.0_wp
      item%c(:, :n) = 0.0_wp
      if (.not. item%leaves_second) item%h(:2*n, :2*n) = 0.0_wp
      if (item%has_friction) call condition_resize_slip(item)
      do i = 1, size(stencil)
         call add_polygon(stencil(i), 1.0_wp/size(stencil), x, u0, du, item)
         if (item%has_friction) call polygon_slip_add(stencil(i), 1.0_wp/size(stencil), x, u0, du, &
            item)
      end do
   end subroutine polygon_constraint

   !> Add `share` of the gap over a polygon to a constraint.
   pure subroutine add_polygon(stencil, share, x, u0, du, item)
      type(polygon_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: share
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      type(condition_t), intent(inout) :: item
      real(wp) :: local(2, 5), dlocal(2, 5)
      type(dg8_t) :: gap
      type(dg8_first_t) :: first

      associate (n => stencil%n, before => stencil%before, after => stencil%after, &
            rounding => stencil%rounding)
         call stencil_gather(x, u0, du, n, stencil%node, local, dlocal)
         if (item%leaves_second) then
            first = nts_gap_first(local(:, :n), dlocal(:, :n), before, after, rounding, &
               stencil%round)
            call add_gap(stencil, share, change_t(first%f0, first%f1, first%df), first%g, first%c, &
               first%h, item)
         else
            gap = nts_gap(local(:, :n), dlocal(:, :n), before, after, rounding, &
               stencil%round)
            call add_gap(stencil, share, change_t(gap%f0, gap%f1, gap%df), gap%g, gap%c, gap%h, &
               item)
         end if
      end associate
   end subroutine add_polygon

   !> Add `share` of a gap over the nodes of `stencil` to a constraint.
   pure subroutine add_gap(stencil, share, change, g, c, h, item)
      type(polygon_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: share
      type(change_t), intent(in) :: change
      real(wp), intent(in) :: g(:), c(:), h(:, :)   !! by the nodes but the first
      type(condition_t), intent(inout) :: item
      integer :: k, place(size(stencil%node))

      item%gap0 = item%gap0 + share*change%f0
      item%gap1 = item%gap1 + share*change%f1
      item%dgap = item%dgap + share*change%df
      associate (n => stencil%n)
         do k = 1, n
            place(k) = findloc(item%node(:item%n_node), stencil%node(k), 1)
         end do
         call nodes_add_first(share, g, place(:n), item%g)
         call nodes_add_first(share, c, place(:n), item%c)
         if (item%leaves_second) return
         call nodes_add_second(share, size(item%g, 1), h, place(:n), item%h)
      end associate
   end subroutine add_gap

   !> The gap over a smoothed surface; `is_found`: there is a unique closest point.
   pure subroutine smooth_constraint(smooth, x, u0, du, target, item, is_found)
      type(smooth_stencil_t), intent(in) :: smooth
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp), intent(in) :: target             !! gap to hold [L]
      type(condition_t), intent(inout) :: item
      logical, intent(out) :: is_found           !! else `item` is left as it is
      real(wp) :: local(2, most_nodes), dlocal(2, most_nodes)
      type(dg13_t) :: gap
      type(dg13_first_t) :: first

      associate (n => smooth%n, curve => smooth%curve, place => smooth%place)
         call stencil_gather(x, u0, du, n, smooth%node, local, dlocal)
         if (item%leaves_second) then
            call hermite_gap_first(curve, local(:, :n), dlocal(:, :n), place, first, is_found)
            if (.not. is_found) return
            call begin_constraint(item, x, smooth%node(:n), smooth%node)
            call take_gap(change_t(first%f0 - target, first%f1 - target, first%df), first%g, &
               first%c, item)
         else
            call hermite_gap(curve, local(:, :n), dlocal(:, :n), place, gap, is_found)
            if (.not. is_found) return
            call begin_constraint(item, x, smooth%node(:n), smooth%node)
            call take_gap(change_t(gap%f0 - target, gap%f1 - target, gap%df), gap%g, gap%c, item)
            item%h(:size(x, 1)*n, :size(x, 1)*n) = 0.0_wp
            call nodes_add_second(1.0_wp, size(x, 1), gap%h, in_order(:n), item%h)
         end if
         if (item%has_friction) call take_slip(smooth, local(:, :n), dlocal(:, :n), item)
      end associate
   end subroutine smooth_constraint

   !> Slip along a smoothed surface that has a closest point.
   pure subroutine take_slip(smooth, local, dlocal, item)
      type(smooth_stencil_t), intent(in) :: smooth
      real(wp), intent(in) :: local(:, :), dlocal(:, :)   !! (n_dim, n) of its nodes [L]
      type(condition_t), intent(inout) :: item            !! with these nodes
      type(dg13_t) :: slip
      type(dg13_first_t) :: first

      call condition_resize_slip(item)
      if (item%leaves_second) then
         call hermite_slip_first(smooth%curve, local, dlocal, smooth%place(1), first)
         item%slip(1) = first%df
         call take_directions(first%g, first%c, item)
      else
         call hermite_slip(smooth%curve, local, dlocal, smooth%place(1), slip)
         item%slip(1) = slip%df
         call take_directions(slip%g, slip%c, item)
         call nodes_add_second(1.0_wp, size(local, 1), slip%h, in_order(:size(local, 2)), &
            item%ht(:, :, 1))
      end if
   end subroutine take_slip

   !> The directions of slip as those of a condition.
   pure subroutine take_directions(g, c, item)
      real(wp), intent(in) :: g(:), c(:)         !! by the nodes but the first
      type(condition_t), intent(inout) :: item

      call take_first(g, item%t(:, :item%n_node, 1))
      call take_first(c, item%t1(:, :item%n_node, 1))
   end subroutine take_directions

   !> A gap and its first derivatives as those of a constraint.
   pure subroutine take_gap(change, g, c, item)
      type(change_t), intent(in) :: change
      real(wp), intent(in) :: g(:), c(:)         !! by the nodes but the first
      type(condition_t), intent(inout) :: item

      item%gap0 = change%f0
      item%gap1 = change%f1
      item%dgap = change%df
      call take_first(g, item%g(:, :item%n_node))
      call take_first(c, item%c(:, :item%n_node))
   end subroutine take_gap

   pure subroutine take_first(part, full)
      real(wp), intent(in) :: part(:)            !! by the nodes but the first
      real(wp), intent(out) :: full(:, :)        !! (n_dim, n_node)

      full = 0.0_wp
      call nodes_add_first(1.0_wp, part, in_order(:size(full, 2)), full)
   end subroutine take_first

   !> Nodes and size of a constraint over `node`: slave node, and others.
   pure subroutine begin_constraint(item, x, node, stencil)
      type(condition_t), intent(inout) :: item
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: node(:)
      integer, intent(in) :: stencil(:)          !! slave node, edge

      call condition_resize(item, size(node))
      item%n_slave = 1
      item%node(:size(node)) = node
      item%size = stencil_length(x, stencil)
   end subroutine begin_constraint

end module emcon_nts_constraint
