!> Which direction a node and a corner of the other surface can push each other in.
!>
!> Two vertices touch along a normal that both have. Where the node is within a flat side, the top
!> of a corner of the other body has many normals that the side has not: by these no body is held.
!> The corner itself, as a node over that side, pushes along what both have.
!> Source: docs/theory.md, section 4.2, eq. (14t).
module emcon_common_normal_plane
   use emcon_chain_plane, only : chain_t
   use emcon_dgrad8_first, only : dg_t
   use emcon_kinds, only : wp
   use emcon_nts_gap_first, only : nts_gap
   use emcon_nts_gap_value, only : last, slave
   use emcon_nts_stencil, only : stencil_gather
   use emcon_polygon_stencil_plane, only : polygon_stencil_t
   use emcon_turn_plane, only : turned_by
   implicit none
   private
   public :: is_pushed_aside

   !> So near to a vertex, per edge, a node stands at it: the margin of the ends of surfaces.
   real(wp), parameter :: at_vertex = 1.0e-3_wp
   !> What turns by less is flat [radians]: coordinates in a deck are rounded.
   real(wp), parameter :: flat = 1.0e-5_wp
   real(wp), parameter :: half_turn = acos(-1.0_wp)

contains

   !> Does node `k` of the slave surface stand at a convex corner of `stencil` that turns by more
   !> than the surface at the node, and that would push it along what is no normal of this surface,
   !> though the corner has nearer ones?
   pure logical function is_pushed_aside(chain, k, stencil, x, u0, du) result(is_aside)
      type(chain_t), intent(in) :: chain         !! the slave's
      integer, intent(in) :: k                   !! index into the nodes of `chain`
      type(polygon_stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp) :: local(2, 5), dlocal(2, 5)
      integer :: i

      is_aside = .false.
      if (all(chain%node_edge(:, k) == 0)) return
      associate (n => stencil%n, before => stencil%before, after => stencil%after)
         call stencil_gather(x, u0, du, n, stencil%node, local, dlocal)
         do i = 1, n
            local(:, i) = local(:, i) + (dlocal(:, i) - dlocal(:, 2))
         end do
         if (before > 0) is_aside = at_corner([before, 2, last])
         if (after > 0 .and. .not. is_aside) is_aside = at_corner([2, last, after])
      end associate

   contains

      !> The same of the corner of three nodes of the stencil.
      pure logical function at_corner(corner) result(is_aside)
         integer, intent(in) :: corner(3)
         real(wp), dimension(2) :: before, after, to_node, along, unit
         real(wp) :: turn, common(2), pushed, length(2)

         is_aside = .false.
         associate (node => stencil%node(corner))
            turn = turned_by(x(:, node(2)) - x(:, node(1)), x(:, node(3)) - x(:, node(2)))
         end associate
         if (turn <= flat) return
         before = local(:, corner(2)) - local(:, corner(1))
         after = local(:, corner(3)) - local(:, corner(2))
         to_node = local(:, slave) - local(:, corner(2))
         length = [norm2(before), norm2(after)]
         unit = 0.5_wp*(before/length(1) + after/length(2))
         if (abs(dot_product(to_node, unit)) > at_vertex*minval(length)) return
         if (.not. turn_of_slave(chain, k, x, u0, du) < turned_by(before, after) - flat) return
         common = common_normals(chain, k, before, after, x, u0, du)
         along = tangent(stencil, local)
         pushed = turned_by(before, along)
         is_aside = pushed < common(1) - flat .or. pushed > common(2) + flat
      end function at_corner

   end function is_pushed_aside

   !> The turn of the slave surface at its node `k`; at an end, where nothing is known, none.
   pure real(wp) function turn_of_slave(chain, k, x, u0, du) result(turn)
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: k
      real(wp), intent(in) :: x(:, :), u0(:, :), du(:, :)

      turn = 0.0_wp
      if (any(chain%node_edge(:, k) == 0)) return
      turn = turned_by(edge_of(chain, k, 1, x, u0, du), edge_of(chain, k, 2, x, u0, du))
   end function turn_of_slave

   !> From where to where the normals of a corner are opposite to those of the slave surface at its
   !> node `k`, as turns from the edge before the corner; if none is, the nearest. A hollow node has
   !> those between its edges, an end what a convex body may have there.
   pure function common_normals(chain, k, before, after, x, u0, du) result(common)
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: k
      real(wp), intent(in) :: before(:), after(:)   !! (2) edges of the corner [L]
      real(wp), intent(in) :: x(:, :), u0(:, :), du(:, :)
      real(wp) :: common(2), of_slave(2)

      associate (edge => chain%node_edge(:, k))
         if (edge(1) > 0) of_slave(1) = turned_by(before, -edge_of(chain, k, 1, x, u0, du))
         if (edge(2) > 0) of_slave(2) = turned_by(before, -edge_of(chain, k, 2, x, u0, du))
         if (edge(1) == 0) of_slave(1) = of_slave(2) - half_turn
         if (edge(2) == 0) of_slave(2) = of_slave(1) + half_turn
      end associate
      common = min(max([minval(of_slave), maxval(of_slave)], 0.0_wp), turned_by(before, after))
   end function common_normals

   !> The slave edge that ends (`side` 1) or begins (2) at node `k`, at the end of the motion.
   pure function edge_of(chain, k, side, x, u0, du) result(edge)
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: k, side
      real(wp), intent(in) :: x(:, :), u0(:, :), du(:, :)
      real(wp) :: edge(2)

      associate (node => chain%facet(:, chain%node_edge(side, k)))
         edge = (x(:, node(2)) - x(:, node(1))) + (u0(:, node(2)) - u0(:, node(1))) &
            + (du(:, node(2)) - du(:, node(1)))
      end associate
   end function edge_of

   !> Along the surface where it pushes the slave node: the gradient of the gap, turned.
   pure function tangent(stencil, local)
      type(polygon_stencil_t), intent(in) :: stencil
      real(wp), intent(in) :: local(:, :)        !! (2, >= n) where its nodes are [L]
      real(wp) :: tangent(2), still(2, stencil%n)
      type(dg_t) :: gap

      still = 0.0_wp
      gap = nts_gap(local(:, :stencil%n), still, stencil%before, stencil%after, stencil%rounding, &
         stencil%round)
      ! The slave node is the first: its gradient is what the others leave.
      associate (m => 2*(stencil%n - 1))
         tangent = [sum(gap%c(2:m:2)), -sum(gap%c(1:m:2))]
      end associate
   end function tangent

end module emcon_common_normal_plane
