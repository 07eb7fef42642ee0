!> Which edges a slave node may touch where a surface may be in contact with itself.
!>
!> Of two edges that meet, the one that comes first along the surface is the slave, or both are.
!> Source: docs/theory.md, section 4.
module emcon_self_contact_plane
   use emcon_chain_plane, only : chain_distance, chain_t
   use emcon_kinds, only : wp
   use emcon_vectors_plane, only : between, cross
   implicit none
   private
   public :: self_contact_is_meant, self_contact_may_touch, self_contact_is_apart, chain_faces

   !> Edges face each other if their normals have a cosine below minus this; one lies above the
   !> other if the way to it and the normal have a cosine above this.
   real(wp), parameter :: least_facing = 0.05_wp
   !> Within this distance, per slave edge, they may touch or overlap; a node farther behind an edge
   !> is on the other side of a strip.
   real(wp), parameter :: deepest = 0.2_wp

contains

   !> Is edge `e` no neighbour of node `k` of the chain, and does it come later along the surface
   !> unless `both_sides` are held?
   pure logical function self_contact_is_meant(chain, k, e, both_sides) result(is_meant)
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: k                   !! index into the nodes of `chain`
      integer, intent(in) :: e                   !! edge of `chain`
      logical, intent(in) :: both_sides          !! each holds the other
      integer :: first, side

      is_meant = self_contact_is_apart(chain, k, e)
      if (.not. is_meant .or. both_sides) return
      first = huge(first)
      do side = 1, 2
         associate (own => chain%node_edge(side, k))
            if (own > 0) first = min(first, chain%place(own))
         end associate
      end do
      is_meant = chain%place(e) > first
   end function self_contact_is_meant

   !> May node `k` of the chain touch edge `e`, which is meant, at x + u? That must face the node;
   !> unless they touch, each must lie above the other.
   pure logical function self_contact_may_touch(chain, k, e, x, u) result(may_touch)
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: k                   !! index into the nodes of `chain`
      integer, intent(in) :: e                   !! edge of `chain`
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (n_dim, n_node of the scene)
      real(wp) :: a(2), b(2), mean(2), length, distance
      integer :: n, side

      mean = mean_along(chain, k, x, u)
      a = between(x, u, chain%facet(1, e), chain%facet(2, e))
      may_touch = faces(mean, a)
      if (.not. may_touch) return
      length = 0.0_wp
      n = 0
      do side = 1, 2
         associate (own => chain%node_edge(side, k))
            if (own == 0) cycle
            length = length + norm2(between(x, u, chain%facet(1, own), chain%facet(2, own)))
            n = n + 1
         end associate
      end do
      b = between(x, u, chain%facet(1, e), chain%node(k))
      b = b - max(0.0_wp, min(1.0_wp, dot_product(b, a)/dot_product(a, a)))*a
      distance = norm2(b)
      if (distance*real(n, wp) <= deepest*length) return
      may_touch = cross(b, a) > least_facing*distance*norm2(a) &
         .and. cross(mean, b) > least_facing*distance*norm2(mean)
   end function self_contact_may_touch

   !> Are the edges at node `k` of the chain neither edge `e` nor neighbours of it?
   pure logical function self_contact_is_apart(chain, k, e) result(is_apart)
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: k                   !! index into the nodes of `chain`
      integer, intent(in) :: e                   !! edge of `chain`
      integer :: side

      is_apart = .true.
      do side = 1, 2
         associate (own => chain%node_edge(side, k))
            if (own > 0) is_apart = is_apart .and. chain_distance(chain, own, e) > 1
         end associate
      end do
   end function self_contact_is_apart

   !> Does the edge between the two of `edge`, of any surface, face the chain at its node `k`?
   pure logical function chain_faces(chain, k, edge, x, u)
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: k                   !! index into the nodes of `chain`
      integer, intent(in) :: edge(2)             !! nodes of the scene
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (2, n_node of the scene) [L]

      chain_faces = faces(mean_along(chain, k, x, u), between(x, u, edge(1), edge(2)))
   end function chain_faces

   !> Does an edge along `a` face a node whose edges go along `mean`?
   pure logical function faces(mean, a)
      real(wp), intent(in) :: mean(:), a(:)      !! (n_dim)

      faces = dot_product(mean, a) < -least_facing*norm2(mean)*norm2(a)
   end function faces

   !> Sum of the unit tangents of the edges at node `k`.
   pure function mean_along(chain, k, x, u) result(mean)
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: k
      real(wp), intent(in) :: x(:, :), u(:, :)
      real(wp) :: mean(2), a(2)
      integer :: side

      mean = 0.0_wp
      do side = 1, 2
         associate (own => chain%node_edge(side, k))
            if (own == 0) cycle
            a = between(x, u, chain%facet(1, own), chain%facet(2, own))
            mean = mean + a/norm2(a)
         end associate
      end do
   end function mean_along

end module emcon_self_contact_plane
