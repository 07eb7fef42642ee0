!> Which edges a node of a surface can touch, by direction.
!>
!> A node rests on an edge where the edge's normal is opposite to one between the normals of the two
!> edges at the node. At a corner that meets a corner this tells the faces that bear from those
!> that slide past each other. Source: docs/theory.md, section 4.2.
module emcon_facing_plane
   use emcon_chain_plane, only : chain_t
   use emcon_kinds, only : wp
   use emcon_vectors_plane, only : between, cross
   implicit none
   private
   public :: facing_allows

   !> Cosine of the angle by which an edge may be turned away, as bodies are coarse and turn within
   !> a step; far from that of two faces at a right angle.
   real(wp), parameter :: least_cosine = 0.5_wp

contains

   !> Does the edge from node `first` to node `last`, with the body to its left, face node `k` of
   !> the chain at x + u? At an end of the chain, where a face of the body is not known, any edge
   !> does.
   pure logical function facing_allows(chain, k, edge, x, u) result(allows)
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: k                   !! index into the nodes of `chain`
      integer, intent(in) :: edge(2)             !! nodes of the scene
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (2, n_node of the scene)
      real(wp) :: along(2), before(2), after(2)

      allows = .true.
      if (any(chain%node_edge(:, k) == 0)) return
      along = -direction(x, u, edge)
      before = direction(x, u, chain%facet(:, chain%node_edge(1, k)))
      after = direction(x, u, chain%facet(:, chain%node_edge(2, k)))
      allows = dot_product(along, before) >= least_cosine .or. &
         dot_product(along, after) >= least_cosine
      if (allows) return
      ! Between the two: at a corner of more than twice the angle.
      allows = cross(before, along) > 0.0_wp .and. cross(along, after) > 0.0_wp &
         .and. dot_product(along, before + after) > 0.0_wp
   end function facing_allows

   !> Unit vector from the first to the second of `node` at x + u.
   pure function direction(x, u, node)
      real(wp), intent(in) :: x(:, :), u(:, :)
      integer, intent(in) :: node(2)
      real(wp) :: direction(2)

      direction = between(x, u, node(1), node(2))
      direction = direction/norm2(direction)
   end function direction

end module emcon_facing_plane
