!> Which nodes and constants make up a pair of slave and master edge, and whether they face.
module emcon_mortar_stencil
   use emcon_chain_plane, only : chain_t, next, previous
   use emcon_kinds, only : wp
   use emcon_mortar_frame, only : frame_t, n_place, pair_stencil_t, place_after, place_before, &
      place_first, place_last, local_master
   implicit none
   private
   public :: stencil_slave, stencil_master, stencil_gather, frame_faces

   !> Edges face each other up to this cosine between their tangents; beyond, the gap along the
   !> normal of one is hardly a distance.
   real(wp), parameter :: least_facing = 0.25_wp

contains

   !> The slave side: edge `e` and, for averaged normals, the neighbours that are no corners away.
   pure subroutine stencil_slave(self, chain, e, is_averaged, is_corner)
      type(pair_stencil_t), intent(inout) :: self
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: e                   !! edge of `chain`
      logical, intent(in) :: is_averaged         !! averaged normals
      logical, intent(in) :: is_corner(:)        !! (n_edge) at the first node of each edge

      self%node(place_first) = chain%facet(1, e)
      self%node(place_last) = chain%facet(2, e)
      self%node(place_before) = 0
      self%node(place_after) = 0
      self%tangent(:, 1) = [place_last, place_first]
      self%tangent(:, 2) = [place_last, place_first]
      self%weight = 1.0_wp/chain%size(e)
      if (is_averaged) then
         if (.not. is_corner(e)) then
            self%node(place_before) = chain%facet(1, chain%neighbour(previous, e))
            self%tangent(2, 1) = place_before
            self%weight(1) = 1.0_wp/(chain%size(e) + chain%size(chain%neighbour(previous, e)))
         end if
         if (has_smooth_end(chain, e, is_corner)) then
            self%node(place_after) = chain%facet(2, chain%neighbour(next, e))
            self%tangent(1, 2) = place_after
            self%weight(2) = 1.0_wp/(chain%size(e) + chain%size(chain%neighbour(next, e)))
         end if
      end if
      self%has_field = any(self%node([place_before, place_after]) > 0)
   end subroutine stencil_slave

   !> No corner at the last node of edge `e`?
   pure logical function has_smooth_end(chain, e, is_corner)
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: e
      logical, intent(in) :: is_corner(:)

      has_smooth_end = .false.
      if (chain%neighbour(next, e) > 0) has_smooth_end = .not. is_corner(chain%neighbour(next, e))
   end function has_smooth_end

   !> The master side: edge `m`; with `is_smooth` or `is_wide` also its neighbours, up to corners of
   !> a smooth surface.
   pure subroutine stencil_master(self, chain, m, is_smooth, is_wide, is_corner)
      type(pair_stencil_t), intent(inout) :: self
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: m                   !! edge of `chain`
      logical, intent(in) :: is_smooth           !! cubic master
      logical, intent(in) :: is_wide             !! points look past the ends of the edge
      logical, intent(in) :: is_corner(:)        !! (n_edge) at the first node of each edge
      real(wp) :: length(3)

      self%edge = m
      self%node(local_master(:2)) = chain%facet(:, m)
      self%node(local_master(3:)) = 0
      self%is_smooth = is_smooth
      self%n_master = merge(4, 2, is_smooth .or. is_wide)
      if (self%n_master == 2) return
      length = [0.0_wp, chain%size(m), 0.0_wp]
      associate (before => chain%neighbour(previous, m), after => chain%neighbour(next, m))
         if (before > 0 .and. .not. (is_smooth .and. is_corner(m))) then
            self%node(local_master(3)) = chain%facet(1, before)
            length(1) = chain%size(before)
         end if
         if (after > 0 .and. (.not. is_smooth .or. has_smooth_end(chain, m, is_corner))) then
            self%node(local_master(4)) = chain%facet(2, after)
            length(3) = chain%size(after)
         end if
      end associate
      if (is_smooth) self%shape = hermite_shape(length)
   end subroutine stencil_master

   !> Coefficients (powers of eta) of the nodes first, last, before, after in a cubic master edge.
   !>
   !> The slopes at its ends are those of the parabola through three nodes; at a corner or an end of
   !> the surface, where there is no third node, that of the parabola with the other end's slope.
   pure function hermite_shape(length) result(shape)
      real(wp), intent(in) :: length(3)          !! of the edge before, it and the one after; 0
      real(wp) :: shape(0:3, 4)
      !> Hermite polynomials of values and slopes at eta = 0 and 1.
      real(wp), parameter :: value(0:3, 2) = reshape([1.0_wp, 0.0_wp, -3.0_wp, 2.0_wp, &
         0.0_wp, 0.0_wp, 3.0_wp, -2.0_wp], [4, 2])
      real(wp), parameter :: slope(0:3, 2) = reshape([0.0_wp, 1.0_wp, -2.0_wp, 1.0_wp, &
         0.0_wp, 0.0_wp, -1.0_wp, 1.0_wp], [4, 2])
      real(wp) :: end_slope(4, 2), near, far
      integer :: i, k

      end_slope = 0.0_wp
      do i = 1, 2
         associate (neighbour => length(2*i - 1), own => length(2))
            if (.not. neighbour > 0.0_wp) cycle
            far = own**2/(neighbour*(neighbour + own))
            near = neighbour/(neighbour + own)
            end_slope(2 + i, i) = merge(-far, far, i == 1)
            end_slope(:2, i) = [-near, near]
            end_slope(i, i) = end_slope(i, i) + merge(far, -far, i == 1)
         end associate
      end do
      do i = 1, 2
         if (length(2*i - 1) > 0.0_wp) cycle
         end_slope(:, i) = [-1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp]
         if (length(5 - 2*i) > 0.0_wp) end_slope(:, i) = 2.0_wp*end_slope(:, i) &
            - end_slope(:, 3 - i)
      end do
      shape = 0.0_wp
      shape(:, :2) = value
      do k = 1, 4
         shape(:, k) = shape(:, k) + matmul(slope, end_slope(k, :))
      end do
   end function hermite_shape

   !> Positions of the nodes at the start relative to the edge's first node, and their motion.
   pure subroutine stencil_gather(self, x, u0, du, local, dlocal)
      type(pair_stencil_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp), intent(out) :: local(:, :), dlocal(:, :)         !! (2, n_place)
      integer :: k, origin

      origin = self%node(place_first)
      local = 0.0_wp
      dlocal = 0.0_wp
      do k = 1, n_place
         associate (node => self%node(k))
            if (node == 0) cycle
            local(:, k) = (x(:, node) - x(:, origin)) + (u0(:, node) - u0(:, origin))
            dlocal(:, k) = du(:, node)
         end associate
      end do
   end subroutine stencil_gather

   !> Does the master edge from node `first` to node `last` of the frame run against the slave edge?
   pure logical function frame_faces(frame, first, last)
      type(frame_t), intent(in) :: frame
      integer, intent(in) :: first               !! 1 to n_master
      integer, intent(in) :: last                !! another one
      real(wp) :: along(2), above(2)

      along = frame%along(:, last) - frame%along(:, first)
      above = frame%above(:, last) - frame%above(:, first)
      frame_faces = all(along < -least_facing*sqrt(along**2 + above**2))
   end function frame_faces

end module emcon_mortar_stencil
