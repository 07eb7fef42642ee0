!> Joints of a contact surface that runs over several pieces tied to each other.
!>
!> Where a part of the surface ends and another begins, at two nodes of which one is on the slave
!> side of a tie and the other on its master side, the surface goes on. The two nodes are one place
!> with one constraint: two would nearly depend on each other, as the one node follows the other.
!> Edges keep their own nodes: what acts on an edge acts on its element.
!> Source: docs/theory.md, section 4.
module emcon_seams_plane
   use emcon_chain_plane, only : chain_number, chain_t, next, previous
   use emcon_couplings, only : tie_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_sort, only : find_sorted
   use emcon_surface_nodes, only : surface_nodes
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
      integer, allocatable :: seam(:, :)

      if (size(scene%tie) == 0) return
      call find_seams(self, scene, seam)
      if (size(seam, 2) == 0) return
      call merge_nodes(self, seam)
      call chain_number(self)
   end subroutine chain_join

   !> The joints as indices into the nodes of `chain`: the one that stands for both, and its twin.
   pure subroutine find_seams(chain, scene, seam)
      type(chain_t), intent(in) :: chain
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: seam(:, :)        !! (2, n)
      integer :: partner(2, size(chain%node))    ! of an end, of a beginning; 0: none, -1: several
      logical :: is_slave(size(chain%node))
      integer :: i, k, n

      partner = 0
      is_slave = .false.
      do k = 1, size(scene%tie)
         call find_partners(chain, scene, scene%tie(k), partner, is_slave)
      end do
      n = 0
      allocate(seam(2, count(partner(1, :) > 0)))
      do i = 1, size(chain%node)
         if (partner(1, i) <= 0) cycle
         if (partner(2, partner(1, i)) <= 0) cycle
         n = n + 1
         seam(:, n) = [min(i, partner(1, i)), max(i, partner(1, i))]
         if (is_slave(seam(1, n)) .and. .not. is_slave(seam(2, n))) then
            seam(:, n) = seam([2, 1], n)
         end if
      end do
      seam = seam(:, :n)
   end subroutine find_seams

   !> To which nodes, where parts of `chain` begin, does `tie` connect nodes where parts end? And
   !> which of them are on its slave side?
   pure subroutine find_partners(chain, scene, tie, partner, is_slave)
      type(chain_t), intent(in) :: chain
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      integer, intent(inout) :: partner(:, :)    !! (2, n_node) of an end, of a beginning
      logical, intent(inout) :: is_slave(:)      !! (n_node)
      integer, allocatable :: slave(:), master(:)
      integer :: i, j

      call open_nodes(chain, scene, scene%surface(tie%slave), slave)
      is_slave(slave) = .true.
      call open_nodes(chain, scene, scene%surface(tie%master), master)
      do j = 1, size(master)
         do i = 1, size(slave)
            if (may_go_on(slave(i), master(j))) call note_partners(slave(i), master(j), partner)
            if (may_go_on(master(j), slave(i))) call note_partners(master(j), slave(i), partner)
         end do
      end do

   contains

      !> Can a part that ends at node `last` go on at node `first`?
      pure logical function may_go_on(last, first)
         integer, intent(in) :: last, first

         may_go_on = chain%node_edge(1, last) > 0 .and. chain%node_edge(2, first) > 0
         if (may_go_on) may_go_on = is_near(chain, scene%x, tie%tolerance, last, first)
      end function may_go_on

   end subroutine find_partners

   !> A part that ends at node `last` can go on at node `first`.
   pure subroutine note_partners(last, first, partner)
      integer, intent(in) :: last, first
      integer, intent(inout) :: partner(:, :)    !! (2, n_node) as of `find_partners`

      if (partner(1, last) == first .and. partner(2, first) == last) return
      partner(1, last) = merge(first, -1, partner(1, last) == 0)
      partner(2, first) = merge(last, -1, partner(2, first) == 0)
   end subroutine note_partners

   !> The nodes of `surface` at which parts of `chain` end or begin, as indices into its nodes.
   pure subroutine open_nodes(chain, scene, surface, node)
      type(chain_t), intent(in) :: chain
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, allocatable, intent(out) :: node(:)
      integer :: i, k, n

      call surface_nodes(scene, surface, node)
      n = 0
      do i = 1, size(node)
         k = find_sorted(chain%node, node(i))
         if (k == 0) cycle
         if (count(chain%node_edge(:, k) > 0) /= 1) cycle
         n = n + 1
         node(n) = k
      end do
      node = node(:n)
   end subroutine open_nodes

   !> Is the end of a part at node `last` near the beginning of another at node `first`?
   pure logical function is_near(chain, x, tolerance, last, first)
      type(chain_t), intent(in) :: chain
      real(wp), intent(in) :: x(:, :)            !! (2, n_node of the scene)
      real(wp), intent(in) :: tolerance          !! of the tie; < 0: not given [L]
      integer, intent(in) :: last, first
      real(wp) :: vector(2), edge, most

      associate (before => chain%node_edge(1, last), after => chain%node_edge(2, first))
         edge = max(chain%size(before), chain%size(after))
         most = near*edge
         if (tolerance >= 0.0_wp) most = min(tolerance, farthest*edge)
         vector = x(:, chain%node(first)) - x(:, chain%node(last))
         is_near = before /= after .and. norm2(vector) <= most
      end associate
   end function is_near

   !> Make one of the two nodes of each joint and link the edges there.
   pure subroutine merge_nodes(chain, seam)
      type(chain_t), intent(inout) :: chain
      integer, intent(in) :: seam(:, :)          !! (2, n) from `find_seams`
      logical :: stays(size(chain%node))
      integer :: number(size(chain%node)), k, e

      stays = .true.
      stays(seam(2, :)) = .false.
      do k = 1, size(seam, 2)
         associate (at => chain%node_edge(:, seam(1, k)))
            at = max(at, chain%node_edge(:, seam(2, k)))
            chain%neighbour(next, at(1)) = at(2)
            chain%neighbour(previous, at(2)) = at(1)
         end associate
         chain%duplicate(seam(1, k)) = chain%node(seam(2, k))
      end do
      number(1) = merge(1, 0, stays(1))
      do k = 2, size(number)
         number(k) = number(k - 1) + merge(1, 0, stays(k))
      end do
      number(seam(2, :)) = number(seam(1, :))
      do e = 1, chain%n_facet
         chain%corner(:, e) = number(chain%corner(:, e))
      end do
      chain%duplicate = pack(chain%duplicate, stays)
      chain%node = pack(chain%node, stays)
   end subroutine merge_nodes

end module emcon_seams_plane
