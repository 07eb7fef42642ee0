!> The triangles that slave facets are split into: frames that move with them, and the multipliers
!> of the facets' vertices on them.
!>
!> Source: docs/theory.md, section 14.
module emcon_facet_frames_space
   use emcon_element_kind, only : max_face_nodes
   use emcon_facet_split, only : facet_split_centre, facet_split_t
   use emcon_facets, only : facets_length, facets_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_patch_sides_space, only : point_frames_t
   use emcon_rotation, only : cross_product
   implicit none
   private
   public :: facet_frames_init, facet_weights_t, facet_weights_init, facet_corner_shares

   !> Vertices of a facet at most; one with more nodes has others between them.
   integer, parameter, public :: most_vertices = 4

   !> The multipliers on each triangle.
   type :: facet_weights_t
      integer, allocatable :: n(:)               !! (n_facet) vertices
      !> (vertex, n_facet) the node of each, as an index into `node` of the facets
      integer, allocatable :: node(:, :)
      !> (3, vertex, n_triangle) of each vertex, at the corners of the triangle: linear, and how
      !> much more where the facet is covered: then they are dual to those
      real(wp), allocatable :: linear(:, :, :), skew(:, :, :)
   end type facet_weights_t

contains

   !> A frame in the middle of each triangle of the split of a surface, along two of its sides.
   pure subroutine facet_frames_init(self, facets, split)
      type(point_frames_t), intent(out) :: self
      type(facets_t), intent(in) :: facets       !! in space
      type(facet_split_t), intent(in) :: split   !! of them
      real(wp) :: share(max_face_nodes, 3)
      integer :: f, k, m, n, t

      n = size(split%facet)
      self%n = n
      self%of_triangles = .true.
      self%point = [(t, t = 1, n)]
      self%start = [(t, t = 1, n + 1)]
      allocate(self%middle(0), self%base(n), self%ring_start(n + 1), self%size(n), self%area(n))
      allocate(self%ring(max_face_nodes*n), self%flip(max_face_nodes*n), source=0)
      allocate(self%weight(3, max_face_nodes*n), source=0.0_wp)
      self%ring_start(1) = 1
      m = 0
      do t = 1, n
         f = split%facet(t)
         call facet_corner_shares(facets, split, t, share)
         self%base(t) = facets%node(split%corner(1, t))
         self%size(t) = facets_length(facets, f)
         self%area(t) = facets%size(f)/real(split%start(f + 1) - split%start(f), wp)
         do k = 1, count(facets%facet(:, f) > 0)
            if (facets%facet(k, f) == self%base(t)) cycle
            m = m + 1
            self%ring(m) = facets%facet(k, f)
            self%weight(:, m) = [share(k, 2), share(k, 3), sum(share(k, 2:))/3.0_wp]
         end do
         self%ring_start(t + 1) = m + 1
      end do
   end subroutine facet_frames_init

   !> The corners of triangle `t` as sums of the nodes of its facet.
   pure subroutine facet_corner_shares(facets, split, t, share)
      type(facets_t), intent(in) :: facets       !! in space
      type(facet_split_t), intent(in) :: split   !! of them
      integer, intent(in) :: t                   !! 1 to the number of triangles
      real(wp), intent(out) :: share(:, :)       !! (node of the facet, corner)
      integer :: j, n

      share = 0.0_wp
      associate (f => split%facet(t))
         n = count(facets%facet(:, f) > 0)
         do j = 1, 3
            if (split%corner(j, t) > split%n_node) then
               share(:n, j) = facet_split_centre(n)
            else
               share(findloc(facets%corner(:n, f), split%corner(j, t), 1), j) = 1.0_wp
            end if
         end do
      end associate
   end subroutine facet_corner_shares

   !> The multipliers of vertices. On facets with nodes between these they are those of the facet
   !> without.
   subroutine facet_weights_init(self, facets, split, x)
      type(facet_weights_t), intent(out) :: self
      type(facets_t), intent(in) :: facets       !! in space
      type(facet_split_t), intent(in) :: split   !! of them
      real(wp), intent(in) :: x(:, :)            !! (3, n_node of the scene) reference [L]
      integer :: f, k, n, step

      allocate(self%n(facets%n_facet), self%node(most_vertices, facets%n_facet), source=0)
      allocate(self%linear(3, most_vertices, size(split%facet)), &
         self%skew(3, most_vertices, size(split%facet)), source=0.0_wp)
      do f = 1, facets%n_facet
         n = count(facets%facet(:, f) > 0)
         step = merge(2, 1, n > most_vertices)
         self%n(f) = n/step
         self%node(:n/step, f) = facets%corner(1:n:step, f)
         do k = split%start(f), split%start(f + 1) - 1
            call find_linear(facets, split, k, self%linear(:, :n/step, k))
         end do
         call find_skew(facets, split, x, f, self)
      end do
   end subroutine facet_weights_init

   !> The linear multipliers at the corners of triangle `t`.
   pure subroutine find_linear(facets, split, t, value)
      type(facets_t), intent(in) :: facets
      type(facet_split_t), intent(in) :: split
      integer, intent(in) :: t
      real(wp), intent(out) :: value(:, :)       !! (3, vertex)
      integer :: j, m, n, place

      n = size(value, 2)
      value = 0.0_wp
      associate (f => split%facet(t))
         do j = 1, 3
            if (split%corner(j, t) > split%n_node) then
               value(j, :) = 1.0_wp/real(n, wp)
               cycle
            end if
            place = findloc(facets%corner(:, f), split%corner(j, t), 1)
            if (count(facets%facet(:, f) > 0) == n) then
               value(j, place) = 1.0_wp
            else
               m = (place + 1)/2
               value(j, m) = merge(1.0_wp, 0.5_wp, btest(place, 0))
               if (.not. btest(place, 0)) value(j, 1 + mod(m, n)) = 0.5_wp
            end if
         end do
      end associate
   end subroutine find_linear

   !> What makes the multipliers of facet `f` dual: diag(int N) (int N N')^-1 N - N.
   subroutine find_skew(facets, split, x, f, self)
      type(facets_t), intent(in) :: facets
      type(facet_split_t), intent(in) :: split
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: f
      type(facet_weights_t), intent(inout) :: self
      real(dp), dimension(self%n(f), self%n(f)) :: mass, whole, dual
      logical :: is_singular
      integer :: k, m, n

      n = self%n(f)
      mass = 0.0_dp
      do k = split%start(f), split%start(f + 1) - 1
         associate (value => self%linear(:, :n, k))
            mass = mass + real(triangle_area(facets, split, k, x)/12.0_wp*(matmul( &
               transpose(value), value) + outer(sum(value, 1), sum(value, 1))), dp)
         end associate
      end do
      whole = 0.0_dp
      do m = 1, n
         whole(m, m) = sum(mass(:, m))
      end do
      call dense_solve(mass, whole, dual, is_singular)
      if (is_singular) return                    ! without area nothing acts there
      do k = split%start(f), split%start(f + 1) - 1
         self%skew(:, :n, k) = matmul(self%linear(:, :n, k), real(dual, wp)) - self%linear(:, :n, k)
      end do
   end subroutine find_skew

   !> The area of triangle `t` in the reference [L^2].
   pure real(wp) function triangle_area(facets, split, t, x) result(area)
      type(facets_t), intent(in) :: facets
      type(facet_split_t), intent(in) :: split
      integer, intent(in) :: t
      real(wp), intent(in) :: x(:, :)
      real(wp) :: share(max_face_nodes, 3), corner(3, 3), normal(3)
      integer :: n

      call facet_corner_shares(facets, split, t, share)
      associate (f => split%facet(t))
         n = count(facets%facet(:, f) > 0)
         corner = matmul(x(:, facets%facet(:n, f)) - spread(x(:, facets%facet(1, f)), 2, n), &
            share(:n, :))
      end associate
      associate (a => corner(:, 2) - corner(:, 1), b => corner(:, 3) - corner(:, 1))
         normal = cross_product(a, b)
      end associate
      area = 0.5_wp*sqrt(dot_product(normal, normal))
   end function triangle_area

   pure function outer(a, b)
      real(wp), intent(in) :: a(:), b(:)
      real(wp) :: outer(size(a), size(b))

      outer = spread(a, 2, size(b))*spread(b, 1, size(a))
   end function outer

end module emcon_facet_frames_space
