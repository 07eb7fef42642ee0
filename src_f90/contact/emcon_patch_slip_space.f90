! build: elements
!> Slip of a node in space over the triangles that its patch is over, in the mean by what it covers
!> of each as the step begins.
!>
!> Source: docs/theory.md, section 14.3.
module emcon_patch_slip_space
   use emcon_condition_nodes, only : condition_resize_slip
   use emcon_constraint, only : condition_t, most_slips
   use emcon_frame_slip_space, only : frame_slip, frame_slip_t, slip_axis_t
   use emcon_kinds, only : wp
   use emcon_node_sums, only : node_sums_across, node_sums_first, node_sums_second
   use emcon_patch_look_space, only : patch_shares
   use emcon_patch_places_space, only : patch_stencil_gather, patch_stencil_place
   use emcon_patch_stencil_space, only : patch_stencil_t
   implicit none
   private
   public :: patch_slip_begin, patch_slip_add, patch_slip_of

contains

   !> Find the shares of slip of a stencil for its step, once.
   pure subroutine patch_slip_begin(stencil, x, u0)
      type(patch_stencil_t), intent(inout) :: stencil    !! chosen for the step
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      real(wp) :: at(3, 3 + stencil%patch%n_vertex)

      if (allocated(stencil%patch%slip_share)) return
      call patch_stencil_place(stencil, x, u0, at)
      stencil%patch%slip_share = slip_shares(stencil, at)
   end subroutine patch_slip_begin

   !> How much of the slip is over each triangle of a patch: what it covers of that as the step
   !> begins; where nothing is covered, all over the nearest one, which comes last.
   pure function slip_shares(stencil, at) result(share)
      type(patch_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: at(:, :)           !! (3, 3 + n_vertex) of the stencil [L]
      real(wp) :: share(stencil%patch%n_triangle + 1)

      associate (n => stencil%patch%n_triangle)
         share(:n) = patch_shares(stencil%patch, at)
         share(n + 1) = merge(0.0_wp, 1.0_wp, any(share(:n) > 0.0_wp))
      end associate
   end function slip_shares

   !> The vertices of triangle `k` of these.
   pure function slip_corner(stencil, k) result(corner)
      type(patch_stencil_t), intent(in) :: stencil
      integer, intent(in) :: k
      integer :: corner(3)

      corner = stencil%corner
      if (k <= stencil%patch%n_triangle) corner = stencil%patch%triangle(:, k)
   end function slip_corner

   !> Slip over a triangle.
   pure subroutine slip_over(corner, at, way, at_part, leaves_second, slip)
      integer, intent(in) :: corner(3)
      real(wp), intent(in) :: at(:, :), way(:, :)   !! (3, 3 + n_vertex) of the stencil [L]
      real(wp), intent(in) :: at_part            !! of `slip_place`
      logical, intent(in) :: leaves_second
      type(frame_slip_t), intent(out) :: slip

      ! The point is where the stencil counts from. Its own frame tells directions, so that these
      ! turn with it, and not from triangle to triangle.
      associate (place => [3 + corner, 1])
         call frame_slip(at(:, place), way(:, place), slip_axis_t(at(:, 2) + at_part*way(:, 2), &
            at_part), leaves_second, slip)
      end associate
   end subroutine slip_over

   !> Add slip with its derivatives to a condition.
   pure subroutine patch_slip_add(stencil, row, at, way, at_part, item)
      type(patch_stencil_t), intent(in) :: stencil   !! with its shares of slip
      integer, intent(in) :: row(:)              !! nodes of the stencil in the condition, but 1
      real(wp), intent(in) :: at(:, :), way(:, :)   !! (3, 3 + n_vertex) of the stencil [L]
      real(wp), intent(in) :: at_part            !! of `slip_place`
      type(condition_t), intent(inout) :: item   !! with all of these nodes
      type(frame_slip_t) :: slip
      real(wp) :: weight(size(row), 3), along(size(row), 1), by(3)
      integer :: place(1 + size(row)), corner(3), i, k, n, s

      call condition_resize_slip(item)
      place(1) = 1
      do k = 1, size(stencil%patch%slip_share)
         if (.not. stencil%patch%slip_share(k) > 0.0_wp) cycle
         corner = slip_corner(stencil, k)
         call slip_over(corner, at, way, at_part, item%leaves_second, slip)
         ! Of nodes in both sides of the triangle, and in the way from its corner to the point.
         n = 0
         do i = 1, size(row)
            by = stencil%weight(row(i), 2 + corner)
            if (.not. (any(abs(by) > 0.0_wp) .or. &
               abs(at_part*stencil%weight(row(i), 1)) > 0.0_wp)) cycle
            n = n + 1
            place(1 + n) = 1 + i
            weight(n, :) = [by(2) - by(1), by(3) - by(1), -by(1)]
            along(n, 1) = stencil%weight(row(i), 1)
         end do
         associate (share => stencil%patch%slip_share(k), to => place(:1 + n))
            do s = 1, size(slip%f)
               item%slip(s) = item%slip(s) + share*slip%f(s)
               call node_sums_first(slip%g(:, s), weight(:n, :), share, to, item%t(:, :, s))
               call node_sums_first(slip%c(:, s), weight(:n, :), share, to, item%t1(:, :, s))
               if (at_part > 0.0_wp) call node_sums_first(slip%c_along(:, s), along(:n, :), &
                  share, to, item%t1(:, :, s))
               if (item%leaves_second) cycle
               call node_sums_second(slip%h(:, :, s), weight(:n, :), share, to, item%ht(:, :, s))
               if (at_part > 0.0_wp) call node_sums_across(slip%h_along(:, :, s), weight(:n, :), &
                  along(:n, 1), share, to, item%ht(:, :, s))
            end do
         end associate
      end do
   end subroutine patch_slip_add

   !> Slip alone [L].
   pure function patch_slip_of(stencil, x, u0, du, at_part) result(slip)
      type(patch_stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: at_part            !! of `slip_place`
      real(wp) :: slip(most_slips)
      real(wp), dimension(3, 3 + stencil%patch%n_vertex) :: at, way
      real(wp) :: share(stencil%patch%n_triangle + 1)
      type(frame_slip_t) :: over
      integer :: k

      slip = 0.0_wp
      if (stencil%triangle == 0) return
      call patch_stencil_gather(stencil, x, u0, du, at, way)
      if (allocated(stencil%patch%slip_share)) then
         share = stencil%patch%slip_share
      else
         share = slip_shares(stencil, at)
      end if
      do k = 1, size(share)
         if (.not. share(k) > 0.0_wp) cycle
         call slip_over(slip_corner(stencil, k), at, way, at_part, .true., over)
         slip = slip + share(k)*over%f
      end do
   end function patch_slip_of

end module emcon_patch_slip_space
