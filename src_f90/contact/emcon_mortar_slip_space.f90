!> Slip of mortar contact in space over a step: how slave facets go over what they cover, in the
!> mean with the weight of each of their vertices.
!>
!> It is made of the places of the master's vertices in the frames of slave triangles, with the
!> weights that the gap gives them, kept over the step: friction acts where the push does. Source:
!> docs/theory.md, section 15.3.
module emcon_mortar_slip_space
   use emcon_constraint, only : condition_t, most_slips
   use emcon_frame_slip_space, only : tangent_basis
   use emcon_frame_vertex_space, only : at_eta, at_xi, frame_vertex, frame_vertex_t
   use emcon_kinds, only : wp
   use emcon_mortar_faces_space, only : mortar_faces_t, mortar_faces_weight
   use emcon_node_sums, only : node_sums_first, node_sums_second
   use emcon_patch_look_space, only : patch_vertex_shares
   use emcon_patch_spread_space, only : patch_uses
   use emcon_patch_stencil_space, only : patch_stencil_gather, patch_stencil_t
   use emcon_rotation, only : cross_product
   implicit none
   private
   public :: mortar_slip_t, mortar_slip_choose, mortar_slip_shift, mortar_slip_of, &
      slip_sight_t, mortar_slip_sight, mortar_slip_add

   !> What the slip of a slave triangle is made of in a step.
   type :: mortar_slip_t
      real(wp) :: theta = 0.0_wp                 !! how dual the multipliers of its facet are
      integer, allocatable :: vertex(:)          !! of its stencil, those over which it slides
      integer, allocatable :: point(:)           !! (as `vertex`) of the master
      real(wp), allocatable :: share(:, :)       !! (3, as `vertex`) of each, for each corner [L^2]
   end type mortar_slip_t

   !> Where these vertices are in the frame of the triangle over a motion.
   type :: slip_sight_t
      real(wp) :: a(3) = 0.0_wp, b(3) = 0.0_wp   !! the frame as the motion begins [L]
      integer, allocatable :: vertex(:)          !! of its stencil
      type(frame_vertex_t), allocatable :: at(:)
   end type slip_sight_t

contains

   !> What slips of the triangles of the slave are made of over a motion, with the weights of gaps:
   !> the mean of those at its start and its end, or those at its end.
   pure subroutine mortar_slip_choose(self, faces, x, u0, du, is_at_end)
      type(mortar_slip_t), intent(inout) :: self(:)   !! (n_triangle)
      type(mortar_faces_t), intent(in) :: faces       !! with their stencils
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      logical, intent(in) :: is_at_end                !! forces act at the end of the motion alone
      real(wp) :: area, part
      integer :: f, t

      do f = 1, faces%sides%slave%n_facet
         associate (first => faces%split%start(f), last => faces%split%start(f + 1) - 1)
            part = 0.0_wp
            do t = first, last
               call choose_triangle(self(t), faces%stencil(t), x, u0, du, is_at_end, area)
               if (area > 0.0_wp) part = part + sum(self(t)%share)/area
            end do
            self(first:last)%theta = merge((part/real(last - first + 1, wp))**3, 0.0_wp, &
               faces%is_dual)
         end associate
      end do
   end subroutine mortar_slip_choose

   !> That of one triangle, and its area; none where nothing is near it.
   pure subroutine choose_triangle(self, stencil, x, u0, du, is_at_end, area)
      type(mortar_slip_t), intent(inout) :: self
      type(patch_stencil_t), intent(in) :: stencil
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      logical, intent(in) :: is_at_end
      real(wp), intent(out) :: area              !! [L^2]
      real(wp), dimension(3, 3 + stencil%patch%n_vertex) :: at, way
      real(wp) :: share(3, stencil%patch%n_vertex), normal(3)
      integer :: j

      area = 0.0_wp
      share = 0.0_wp
      if (stencil%triangle > 0) then
         call patch_stencil_gather(stencil, x, u0, du, at, way)
         share = patch_vertex_shares(stencil%patch, at + way)
         if (.not. is_at_end) share = 0.5_wp*(share + patch_vertex_shares(stencil%patch, at))
         at = at + merge(1.0_wp, 0.5_wp, is_at_end)*way
         normal = cross_product(at(:, 2) - at(:, 1), at(:, 3) - at(:, 1))
         area = 0.5_wp*norm2(normal)
      end if
      self%vertex = pack([(j, j = 1, size(share, 2))], any(abs(share) > 0.0_wp, 1))
      self%share = share(:, self%vertex)
      if (size(self%vertex) == 0) then
         self%point = self%vertex
      else
         self%point = stencil%point(self%vertex)
      end if
   end subroutine choose_triangle

   !> The part of the slip of constraint `i` at each vertex of the triangle of place `k`.
   pure function parts_of(self, faces, i, k) result(part)
      type(mortar_slip_t), intent(in) :: self(:)
      type(mortar_faces_t), intent(in) :: faces
      integer, intent(in) :: i, k
      real(wp) :: part(size(self(faces%triangle(k))%vertex))
      real(wp) :: total
      integer :: m

      total = 0.0_wp
      do m = faces%start(i), faces%start(i + 1) - 1
         associate (own => self(faces%triangle(m)))
            if (size(own%vertex) > 0) total = total + sum(matmul(mortar_faces_weight(faces, m, &
               own%theta), own%share))
         end associate
      end do
      part = 0.0_wp
      if (.not. total > 0.0_wp) return
      associate (own => self(faces%triangle(k)))
         part = matmul(mortar_faces_weight(faces, k, own%theta), own%share)/total
      end associate
   end function parts_of

   !> How much of the friction of constraint `i` is on other points of the master by one choice than
   !> by another: 0 to 1, and more where weights have both signs.
   pure real(wp) function mortar_slip_shift(self, before, faces, i) result(shift)
      type(mortar_slip_t), intent(in) :: self(:), before(:)
      type(mortar_faces_t), intent(in) :: faces
      integer, intent(in) :: i                   !! 1..n_constraint
      integer :: j, k

      shift = 0.0_wp
      do k = faces%start(i), faces%start(i + 1) - 1
         associate (t => faces%triangle(k), now => parts_of(self, faces, i, k), &
               old => parts_of(before, faces, i, k))
            ! What is new has a partner with nothing in the old choice, and what is gone one here.
            do j = 1, size(now)
               associate (place => self(t)%point == self(t)%point(j), &
                     was => before(t)%point == self(t)%point(j))
                  if (findloc(place, .true., 1) == j) shift = shift + 0.5_wp*abs(sum(now, place) &
                     - sum(old, was))
               end associate
            end do
            do j = 1, size(old)
               if (.not. any(self(t)%point == before(t)%point(j))) shift = shift &
                  + 0.5_wp*abs(old(j))
            end do
         end associate
      end do
   end function mortar_slip_shift

   !> Where the vertices of a triangle's slip are over a motion.
   pure subroutine mortar_slip_sight(self, at, way, leaves_second, sight)
      type(mortar_slip_t), intent(in) :: self
      real(wp), intent(in) :: at(:, :), way(:, :)   !! (3, 3 + n_vertex) of its stencil [L]
      logical, intent(in) :: leaves_second       !! no second derivatives
      type(slip_sight_t), intent(out) :: sight
      integer :: j

      sight%a = at(:, 2) - at(:, 1)
      sight%b = at(:, 3) - at(:, 1)
      sight%vertex = self%vertex
      allocate(sight%at(size(self%vertex)))
      do j = 1, size(self%vertex)
         associate (node => [1, 2, 3, 3 + self%vertex(j)])
            call frame_vertex(at(:, node), way(:, node), leaves_second, sight%at(j))
         end associate
      end do
   end subroutine mortar_slip_sight

   !> The direction along the slave's surface that turns with it at constraint `i`: towards the next
   !> vertex of its first facet.
   pure function first_direction(faces, i, x, u) result(along)
      type(mortar_faces_t), intent(in) :: faces
      integer, intent(in) :: i
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp) :: along(3), basis(3, 2), normal(3)
      integer :: f, k, n

      normal = 0.0_wp
      do k = faces%start(i), faces%start(i + 1) - 1
         associate (t => faces%triangle(k))
            f = faces%split%facet(t)
            n = faces%weights%n(f)
            if (t /= faces%split%start(f)) cycle
            normal = normal + cross_product(from_to(1, 1 + n/2), from_to(2, n))
         end associate
      end do
      f = faces%split%facet(faces%triangle(faces%start(i)))
      associate (m => faces%vertex(faces%start(i)))
         along = from_to(m, 1 + mod(m, faces%weights%n(f)))
      end associate
      if (.not. norm2(normal) > 0.0_wp) return
      basis = tangent_basis(normal, along)
      along = basis(:, 1)

   contains

      !> From one vertex of the facet to another.
      pure function from_to(j, l) result(vector)
         integer, intent(in) :: j, l
         real(wp) :: vector(3)

         associate (node => faces%sides%slave%node(faces%weights%node(:, f)))
            vector = (x(:, node(l)) - x(:, node(j))) + (u(:, node(l)) - u(:, node(j)))
         end associate
      end function from_to

   end function first_direction

   !> What the slips along two directions are by the coordinates in the frame of a triangle, with
   !> the sign of a motion of the slave.
   pure function by_frame(sight, along) result(by)
      type(slip_sight_t), intent(in) :: sight
      real(wp), intent(in) :: along(3)
      real(wp) :: by(at_xi:at_eta, most_slips)
      real(wp) :: basis(3, most_slips)

      basis = tangent_basis(cross_product(sight%a, sight%b), along)
      by(at_xi, :) = -matmul(sight%a, basis)
      by(at_eta, :) = -matmul(sight%b, basis)
   end function by_frame

   !> The slip of constraint `i` [L].
   pure function mortar_slip_of(self, faces, i, x, u0, du) result(slip)
      type(mortar_slip_t), intent(in) :: self(:)
      type(mortar_faces_t), intent(in) :: faces
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp) :: slip(most_slips)
      real(wp), allocatable :: at(:, :), way(:, :)
      real(wp) :: along(3), by(at_xi:at_eta, most_slips)
      type(slip_sight_t) :: sight
      integer :: j, k

      slip = 0.0_wp
      along = first_direction(faces, i, x, u0)
      do k = faces%start(i), faces%start(i + 1) - 1
         associate (t => faces%triangle(k), part => parts_of(self, faces, i, k))
            if (size(part) == 0) cycle
            associate (n => 3 + faces%stencil(t)%patch%n_vertex)
               if (allocated(at)) deallocate(at, way)
               allocate(at(3, n), way(3, n))
            end associate
            call patch_stencil_gather(faces%stencil(t), x, u0, du, at, way)
            call mortar_slip_sight(self(t), at, way, .true., sight)
            by = by_frame(sight, along)
            do j = 1, size(part)
               slip = slip + part(j)*matmul(sight%at(j)%df(:at_eta), by)
            end do
         end associate
      end do
   end function mortar_slip_of

   !> Add the slip of constraint `i` and its derivatives to its condition, which has all nodes of
   !> it, and room for slip.
   pure subroutine mortar_slip_add(self, faces, i, sight, x, u0, item)
      type(mortar_slip_t), intent(in) :: self(:)
      type(mortar_faces_t), intent(in) :: faces
      integer, intent(in) :: i                   !! 1..n_constraint
      type(slip_sight_t), intent(in) :: sight(:) !! (n_triangle)
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) where it begins [L]
      type(condition_t), intent(inout) :: item
      real(wp) :: along(3)
      integer :: k

      along = first_direction(faces, i, x, u0)
      do k = faces%start(i), faces%start(i + 1) - 1
         associate (t => faces%triangle(k))
            if (size(self(t)%vertex) == 0) cycle
            call add_triangle(faces%stencil(t), sight(t), parts_of(self, faces, i, k), &
               by_frame(sight(t), along), item)
         end associate
      end do
   end subroutine mortar_slip_add

   !> Add that of one triangle.
   pure subroutine add_triangle(stencil, sight, part, by, item)
      type(patch_stencil_t), intent(in) :: stencil
      type(slip_sight_t), intent(in) :: sight
      real(wp), intent(in) :: part(:)            !! (as its vertices)
      real(wp), intent(in) :: by(at_xi:, :)      !! of `by_frame`
      type(condition_t), intent(inout) :: item
      real(wp), dimension(6 + 3*size(part)) :: g, c
      real(wp) :: h(size(g), size(g))
      integer, allocatable :: place(:), row(:)
      integer :: j, s, own(9)

      row = pack([(j, j = 1, stencil%n_node)], patch_uses(stencil, sight%vertex))
      place = [(findloc(item%node(:item%n_node), stencil%node(row(j)), 1), j = 1, size(row))]
      associate (weight => stencil%weight(row(2:), [1, 2, 2 + sight%vertex]))
         do s = 1, size(by, 2)
            g = 0.0_wp
            c = 0.0_wp
            h = 0.0_wp
            do j = 1, size(part)
               own = [1, 2, 3, 4, 5, 6, 3*j + 4, 3*j + 5, 3*j + 6]
               associate (at => sight%at(j), factor => part(j)*by(:, s))
                  item%slip(s) = item%slip(s) + dot_product(factor, at%df(:at_eta))
                  g(own) = g(own) + matmul(at%g(:, :at_eta), factor)
                  c(own) = c(own) + matmul(at%c(:, :at_eta), factor)
                  if (.not. item%leaves_second) h(own, own) = h(own, own) &
                     + factor(1)*at%h(:, :, at_xi) + factor(2)*at%h(:, :, at_eta)
               end associate
            end do
            call node_sums_first(g, weight, 1.0_wp, place, item%t(:, :, s))
            call node_sums_first(c, weight, 1.0_wp, place, item%t1(:, :, s))
            if (.not. item%leaves_second) call node_sums_second(h, weight, 1.0_wp, place, &
               item%ht(:, :, s))
         end do
      end associate
   end subroutine add_triangle

end module emcon_mortar_slip_space
