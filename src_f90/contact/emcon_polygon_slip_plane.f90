!> What a slave node slides by over its stencil: along an edge or a circle, and, as the centre of a
!> disc that its rigid body turns, by what the outside of its pad rolls.
!>
!> Source: docs/theory.md, eqs. (14e), (14u) and (14x).
module emcon_polygon_slip_plane
   use emcon_constraint, only : condition_t
   use emcon_dgrad8, only : dg8_t => dg_t
   use emcon_dgrad8_first, only : dg8_first_t => dg_t
   use emcon_dgrad_nodes, only : nodes_add_first, nodes_add_second
   use emcon_kinds, only : wp
   use emcon_nts_gap, only : nts_arc_slip, nts_roll
   use emcon_nts_gap_first, only : nts_arc_slip_first => nts_arc_slip, nts_roll_first => nts_roll
   use emcon_nts_gap_value, only : last
   use emcon_nts_stencil, only : stencil_gather
   use emcon_polygon_stencil_plane, only : polygon_slip, polygon_stencil_t
   use emcon_slip_point, only : slip_add, slip_over
   implicit none
   private
   public :: polygon_slip_over, polygon_slip_add

   !> Nodes: slave node, edge, and the other one of the body.
   integer, parameter :: n_node = 4

contains

   !> Weight times what is slid by over a step.
   pure real(wp) function polygon_slip_over(stencil, weight, x, u0, du) result(slip)
      type(polygon_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: weight             !! in the slip of a constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp), dimension(size(x, 1), n_node) :: local, dlocal
      type(dg8_first_t) :: part

      call gather(stencil, x, u0, du, local, dlocal)
      associate (bend => stencil%round%bend(0))
         if (abs(bend) > 0.0_wp) then
            part = nts_arc_slip_first(local(:, :last), dlocal(:, :last), bend)
            slip = weight*part%df
         else
            slip = slip_over(polygon_slip(stencil, weight), x, u0, du)
         end if
         if (stencil%arm == 0) return
         part = nts_roll_first(local, dlocal, bend)
         slip = slip + weight*stencil%radius*part%df
      end associate
   end function polygon_slip_over

   !> Add weight times what is slid by, with its derivatives, to a condition.
   pure subroutine polygon_slip_add(stencil, weight, x, u0, du, item)
      type(polygon_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: weight             !! in the slip of a constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      type(condition_t), intent(inout) :: item   !! made for slip, with all nodes
      real(wp), dimension(size(x, 1), n_node) :: local, dlocal

      call gather(stencil, x, u0, du, local, dlocal)
      associate (bend => stencil%round%bend(0))
         if (abs(bend) > 0.0_wp) then
            if (item%leaves_second) then
               call add_first(stencil, last, weight, nts_arc_slip_first(local(:, :last), &
                  dlocal(:, :last), bend), item)
            else
               call add_all(stencil, last, weight, nts_arc_slip(local(:, :last), dlocal(:, :last), &
                  bend), item)
            end if
         else
            call slip_add(polygon_slip(stencil, weight), x, u0, du, item)
         end if
         if (stencil%arm == 0) return
         if (item%leaves_second) then
            call add_first(stencil, n_node, weight*stencil%radius, nts_roll_first(local, dlocal, &
               bend), item)
         else
            call add_all(stencil, n_node, weight*stencil%radius, nts_roll(local, dlocal, bend), &
               item)
         end if
      end associate
   end subroutine polygon_slip_add

   !> Add `factor` times a number over the first `n` nodes to the slip, without second derivatives.
   pure subroutine add_first(stencil, n, factor, part, item)
      type(polygon_stencil_t), intent(in) :: stencil
      integer, intent(in) :: n
      real(wp), intent(in) :: factor
      type(dg8_first_t), intent(in) :: part
      type(condition_t), intent(inout) :: item
      integer :: to(n)

      to = places(stencil, n, item)
      item%slip(1) = item%slip(1) + factor*part%df
      call nodes_add_first(factor, part%g, to, item%t(:, :, 1))
      call nodes_add_first(factor, part%c, to, item%t1(:, :, 1))
   end subroutine add_first

   !> The same with second derivatives.
   pure subroutine add_all(stencil, n, factor, part, item)
      type(polygon_stencil_t), intent(in) :: stencil
      integer, intent(in) :: n
      real(wp), intent(in) :: factor
      type(dg8_t), intent(in) :: part
      type(condition_t), intent(inout) :: item
      integer :: to(n)

      to = places(stencil, n, item)
      item%slip(1) = item%slip(1) + factor*part%df
      call nodes_add_first(factor, part%g, to, item%t(:, :, 1))
      call nodes_add_first(factor, part%c, to, item%t1(:, :, 1))
      call nodes_add_second(factor, size(item%t, 1), part%h, to, item%ht(:, :, 1))
   end subroutine add_all

   !> Where slave node, edge and arm are among the nodes of a condition.
   pure function places(stencil, n, item) result(to)
      type(polygon_stencil_t), intent(in) :: stencil
      integer, intent(in) :: n                   !! 3, or 4 with the arm
      type(condition_t), intent(in) :: item
      integer :: to(n)
      integer :: node(n_node), k

      node = [stencil%node(:last), stencil%arm]
      to = [(findloc(item%node(:item%n_node), node(k), 1), k = 1, n)]
   end function places

   !> Positions of slave node, edge and arm relative to the edge, and their motion.
   pure subroutine gather(stencil, x, u0, du, local, dlocal)
      type(polygon_stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp), intent(out) :: local(:, :), dlocal(:, :)     !! (2, 4) [L]
      integer :: n

      n = merge(n_node, last, stencil%arm > 0)
      call stencil_gather(x, u0, du, n, [stencil%node(:last), stencil%arm], local, dlocal)
   end subroutine gather

end module emcon_polygon_slip_plane
