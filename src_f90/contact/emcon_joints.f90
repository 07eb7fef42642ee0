!> Joints of a contact surface that runs over several pieces tied to each other.
!>
!> Where a part of the surface ends and another begins, at two nodes of which one is on the slave
!> side of a tie and the other on its master side, the surface goes on. The two nodes are one place
!> with one constraint: two would nearly depend on each other, as the one node follows the other.
!> Edges keep their own nodes: what acts on an edge acts on its element.
!> Source: docs/theory.md, section 4.
module emcon_joints
   use emcon_chain, only : chain_number, chain_t, surface_edges
   use emcon_couplings, only : tie_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: chain_join

   !> The nodes of a joint are nearer to each other than this fraction of the longer one of its
   !> edges, or than the position tolerance of the tie; never farther apart than `farthest` of it.
   real(wp), parameter :: near = 0.1_wp, farthest = 0.5_wp

contains

   !> Connect the parts of `self` at joints. A part that could go on in two ways is left open.
   pure subroutine chain_join(self, scene)
      type(chain_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, allocatable :: joint(:, :)

      if (size(scene%tie) == 0) return
      call find_joints(self, scene, joint)
      if (size(joint, 2) == 0) return
      call merge_nodes(self, joint)
      call chain_number(self)
   end subroutine chain_join

   !> The joints as indices into the nodes of `chain`: the one that stands for both, and its twin.
   pure subroutine find_joints(chain, scene, joint)
      type(chain_t), intent(in) :: chain
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: joint(:, :)       !! (2, n)
      integer, allocatable :: last(:), first(:)
      logical, allocatable :: meets(:, :), is_slave(:)
      integer :: i, j, k, n

      associate (node_edge => chain%node_edge, all => [(k, k = 1, size(chain%node))])
         last = pack(all, node_edge(1, :) > 0 .and. node_edge(2, :) == 0)
         first = pack(all, node_edge(2, :) > 0 .and. node_edge(1, :) == 0)
      end associate
      allocate(meets(size(last), size(first)), source=.false.)
      allocate(is_slave(size(chain%node)), source=.false.)
      do k = 1, size(scene%tie)
         call mark_tied(chain, scene, scene%tie(k), last, first, meets, is_slave)
      end do
      n = 0
      allocate(joint(2, size(last)))
      do i = 1, size(last)
         if (count(meets(i, :)) /= 1) cycle
         j = findloc(meets(i, :), .true., 1)
         if (count(meets(:, j)) /= 1) cycle
         n = n + 1
         joint(:, n) = [min(last(i), first(j)), max(last(i), first(j))]
         if (is_slave(joint(1, n)) .and. .not. is_slave(joint(2, n))) then
            joint(:, n) = joint([2, 1], n)
         end if
      end do
      joint = joint(:, :n)
   end subroutine find_joints

   !> Which of the nodes `last`, where parts of `chain` end, does `tie` connect to which of `first`,
   !> where parts begin? And which of them are on its slave side?
   pure subroutine mark_tied(chain, scene, tie, last, first, meets, is_slave)
      type(chain_t), intent(in) :: chain
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      integer, intent(in) :: last(:), first(:)   !! indices into the nodes of the chain
      logical, intent(inout) :: meets(:, :)      !! (size of last, size of first)
      logical, intent(inout) :: is_slave(:)      !! (n_node)
      logical :: ends(2, size(last)), begins(2, size(first))     ! on its slave, its master side
      integer :: i, j

      ends(1, :) = is_on(scene, scene%surface(tie%slave), chain%node(last))
      ends(2, :) = is_on(scene, scene%surface(tie%master), chain%node(last))
      begins(1, :) = is_on(scene, scene%surface(tie%slave), chain%node(first))
      begins(2, :) = is_on(scene, scene%surface(tie%master), chain%node(first))
      is_slave(last) = is_slave(last) .or. ends(1, :)
      is_slave(first) = is_slave(first) .or. begins(1, :)
      do j = 1, size(first)
         do i = 1, size(last)
            if (.not. any(ends(:, i) .and. begins([2, 1], j))) cycle
            meets(i, j) = meets(i, j) .or. is_near(chain, scene%x, tie%tolerance, last(i), first(j))
         end do
      end do
   end subroutine mark_tied

   !> Which of `node` are nodes of `surface`?
   pure function is_on(scene, surface, node)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, intent(in) :: node(:)             !! of the scene
      logical :: is_on(size(node))
      integer, allocatable :: edge(:, :)
      integer :: i, k

      is_on = .false.
      if (surface%is_nodal) then
         do k = 1, size(node)
            is_on(k) = any(surface%node == node(k))
         end do
         return
      end if
      call surface_edges(scene, surface, edge)
      do i = 1, size(edge, 2)
         do k = 1, size(node)
            is_on(k) = is_on(k) .or. any(edge(:, i) == node(k))
         end do
      end do
   end function is_on

   !> Is the end of a part at node `last` near the beginning of another at node `first`?
   pure logical function is_near(chain, x, tolerance, last, first)
      type(chain_t), intent(in) :: chain
      real(wp), intent(in) :: x(:, :)            !! (2, n_node of the scene)
      real(wp), intent(in) :: tolerance          !! of the tie; < 0: not given [L]
      integer, intent(in) :: last, first
      real(wp) :: way(2), edge, most

      associate (before => chain%node_edge(1, last), after => chain%node_edge(2, first))
         edge = max(chain%length(before), chain%length(after))
         most = near*edge
         if (tolerance >= 0.0_wp) most = min(tolerance, farthest*edge)
         way = x(:, chain%node(first)) - x(:, chain%node(last))
         is_near = before /= after .and. norm2(way) <= most
      end associate
   end function is_near

   !> Make one of the two nodes of each joint and link the edges there.
   pure subroutine merge_nodes(chain, joint)
      type(chain_t), intent(inout) :: chain
      integer, intent(in) :: joint(:, :)         !! (2, n) from `find_joints`
      logical :: stays(size(chain%node))
      integer :: number(size(chain%node)), k, e

      stays = .true.
      stays(joint(2, :)) = .false.
      do k = 1, size(joint, 2)
         associate (at => chain%node_edge(:, joint(1, k)))
            at = max(at, chain%node_edge(:, joint(2, k)))
            chain%next(at(1)) = at(2)
            chain%previous(at(2)) = at(1)
         end associate
         chain%twin(joint(1, k)) = chain%node(joint(2, k))
      end do
      number(1) = merge(1, 0, stays(1))
      do k = 2, size(number)
         number(k) = number(k - 1) + merge(1, 0, stays(k))
      end do
      number(joint(2, :)) = number(joint(1, :))
      do e = 1, chain%n_edge
         chain%end_node(:, e) = number(chain%end_node(:, e))
      end do
      chain%node_edge = chain%node_edge(:, pack([(k, k = 1, size(number))], stays))
      chain%twin = pack(chain%twin, stays)
      chain%node = pack(chain%node, stays)
   end subroutine merge_nodes

end module emcon_joints
