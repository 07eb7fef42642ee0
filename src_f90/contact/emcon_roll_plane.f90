!> Discs that roll: what the outside of the pad of a slave node slides by as its rigid body turns.
!>
!> The node goes along an edge by what emcon_slip_point has. The point of the disc at the edge goes
!> by the radius times the turn of the edge against the body less. Source: docs/theory.md, eq.
!> (14u).
module emcon_roll_plane
   use emcon_constraint, only : condition_t
   use emcon_dgrad8, only : dg8_t => dg_t
   use emcon_dgrad8_first, only : dg8_first_t => dg_t
   use emcon_dgrad_nodes, only : nodes_add_first, nodes_add_second
   use emcon_kinds, only : wp
   use emcon_nts_gap, only : nts_roll
   use emcon_nts_gap_first, only : nts_roll_first => nts_roll
   use emcon_nts_gap_value, only : first, last, slave
   use emcon_nts_stencil, only : polygon_stencil_t
   use emcon_vectors_plane, only : cross
   implicit none
   private
   public :: roll_over, roll_add

   !> Nodes: slave node, edge, and the other one of the body.
   integer, parameter :: n_node = 4

contains

   !> Weight times what is rolled by over a step.
   pure real(wp) function roll_over(stencil, weight, x, u0, du) result(roll)
      type(polygon_stencil_t), intent(in) :: stencil         !! with an arm
      real(wp), intent(in) :: weight             !! in the slip of a constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp), dimension(size(x, 1), n_node) :: local, dlocal
      real(wp), dimension(size(x, 1)) :: a, d, da, dd
      real(wp) :: dot, sine, cosine, across, along

      call gather(stencil, x, u0, du, local, dlocal)
      a = local(:, last) - local(:, first)
      d = local(:, n_node) - local(:, slave)
      da = dlocal(:, last) - dlocal(:, first)
      dd = dlocal(:, n_node) - dlocal(:, slave)
      associate (length => sqrt(dot_product(d, d)*dot_product(a, a)))
         cosine = dot_product(d, a)/length
         sine = cross(d, a)/length
      end associate
      ! d x a and d.a by how they change, without what cancels
      dot = dot_product(dd, a + da) + dot_product(d, da)
      across = cosine*(cross(dd, a + da) + cross(d, da)) - sine*dot
      along = cosine*dot_product(d + dd, a + da) + sine*cross(d + dd, a + da)
      roll = weight*stencil%radius*2.0_wp*across &
         /(sqrt(dot_product(d, d)*dot_product(a + da, a + da)) + along)
   end function roll_over

   !> Add weight times what is rolled by, with its derivatives, to the slip of a condition.
   pure subroutine roll_add(stencil, weight, x, u0, du, item)
      type(polygon_stencil_t), intent(in) :: stencil         !! with an arm
      real(wp), intent(in) :: weight             !! in the slip of a constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      type(condition_t), intent(inout) :: item   !! made for slip, with all nodes
      real(wp), dimension(size(x, 1), n_node) :: local, dlocal
      type(dg8_t) :: turn
      type(dg8_first_t) :: only_first
      integer :: node(n_node), to(n_node), k

      node = [stencil%node(:last), stencil%arm]
      to = [(findloc(item%node(:item%n_node), node(k), 1), k = 1, n_node)]
      call gather(stencil, x, u0, du, local, dlocal)
      associate (factor => weight*stencil%radius)
         if (item%leaves_second) then
            only_first = nts_roll_first(local, dlocal)
            item%slip(1) = item%slip(1) + factor*only_first%df
            call nodes_add_first(factor, only_first%g, to, item%t(:, :, 1))
            call nodes_add_first(factor, only_first%c, to, item%t1(:, :, 1))
            return
         end if
         turn = nts_roll(local, dlocal)
         item%slip(1) = item%slip(1) + factor*turn%df
         call nodes_add_first(factor, turn%g, to, item%t(:, :, 1))
         call nodes_add_first(factor, turn%c, to, item%t1(:, :, 1))
         call nodes_add_second(factor, size(x, 1), turn%h, to, item%ht(:, :, 1))
      end associate
   end subroutine roll_add

   !> Positions of slave node, edge and arm relative to the edge, and their motion.
   pure subroutine gather(stencil, x, u0, du, local, dlocal)
      type(polygon_stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp), intent(out) :: local(:, :), dlocal(:, :)     !! (2, 4) [L]
      integer :: node(n_node), k

      node = [stencil%node(:last), stencil%arm]
      do k = 1, n_node
         local(:, k) = (x(:, node(k)) - x(:, node(first))) + (u0(:, node(k)) - u0(:, node(first)))
         dlocal(:, k) = du(:, node(k))
      end do
   end subroutine gather

end module emcon_roll_plane
