!> Contact from outside: nodes of one surface against the faces of another in three dimensions.
!>
!> Each face is a fan of triangles. A gap is the height of a node over the plane of the
!> triangle that it is nearest to at the start of a step. By the arithmetic of discrete gradients
!> its forces do the work that they should; made of differences of positions they have no
!> resultant, and their moments vanish with the square of the step.
module nodes_on_faces
   use emcon_api, only : condition_t, contact_options_t, contact_pair_t, error_t, gap_state_t, &
      host_contact_t, scene_t, wp
   use emcon_dgrad11, only : dg_sqrt, dg_t, dg_variable, operator(*), operator(+), operator(-), &
      operator(/)
   use emcon_dgrad_nodes, only : nodes_add_first, nodes_add_second
   use emcon_facets, only : facets_init, facets_normal, facets_t
   implicit none
   private
   public :: nodes_on_faces_t

   type, extends(host_contact_t) :: nodes_on_faces_t
      type(facets_t) :: slave
      integer, allocatable :: corner(:, :)       !! (3, n) triangles of the master, outside in front
      integer, allocatable :: chosen(:)          !! (n_constraint) triangle in this step
   contains
      procedure :: set_up
      procedure :: configure
      procedure :: begin_points
      procedure :: measure_points
      procedure :: evaluate_points
      procedure :: area_points
   end type nodes_on_faces_t

contains

   subroutine set_up(self, scene, pair, error)
      class(nodes_on_faces_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error
      type(facets_t) :: master
      integer :: i, k

      call facets_init(self%slave, scene, scene%surface(pair%slave), error)
      if (.not. allocated(error)) call facets_init(master, scene, scene%surface(pair%master), error)
      if (allocated(error)) return
      allocate(self%corner(3, 0))
      do i = 1, master%n_facet
         do k = 3, count(master%facet(:, i) > 0)
            self%corner = reshape([self%corner, master%facet([1, k - 1, k], i)], &
               [3, size(self%corner, 2) + 1])
         end do
      end do
      self%node = self%slave%node
      self%n_constraint = size(self%node)
      allocate(self%chosen(self%n_constraint), source=0)
      allocate(self%state(self%n_constraint))
   end subroutine set_up

   pure subroutine configure(self, x, options)
      class(nodes_on_faces_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)
      type(contact_options_t), intent(in) :: options

      associate (unused => self, nor_these => x, nor_those => options)
      end associate
   end subroutine configure

   !> The triangle that each node is nearest to, in front of it or behind.
   pure subroutine begin_points(self, x, u0, du)
      class(nodes_on_faces_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp) :: best, gap, outside, length
      integer :: i, t

      associate (unused => du)
      end associate
      do i = 1, self%n_constraint
         best = huge(best)
         do t = 1, size(self%corner, 2)
            call measure_one(x, u0, [self%node(i), self%corner(:, t)], gap, outside, length)
            if (abs(gap) + 10.0_wp*outside*length >= best) cycle
            best = abs(gap) + 10.0_wp*outside*length
            self%chosen(i) = t
         end do
      end do
      call self%has_looked(0.0_wp)
   end subroutine begin_points

   !> The gap of a node, the first of four, over a triangle.
   pure subroutine measure_one(x, u, node, gap, outside, length)
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      integer, intent(in) :: node(4)
      real(wp), intent(out) :: gap               !! [L]
      real(wp), intent(out) :: outside           !! so far past a side, in barycentric coordinates
      real(wp), intent(out) :: length            !! of the size of a side [L]
      real(wp), dimension(3) :: a, b, c, n, share
      real(wp) :: p(3, 4)

      p = x(:, node) + u(:, node)
      a = p(:, 3) - p(:, 2)
      c = p(:, 4) - p(:, 2)
      b = p(:, 1) - p(:, 2)
      n = cross(a, c)
      length = sqrt(norm2(n))
      gap = dot_product(b, n)/norm2(n)
      share(2) = dot_product(cross(b, c), n)/dot_product(n, n)
      share(3) = dot_product(cross(a, b), n)/dot_product(n, n)
      share(1) = 1.0_wp - share(2) - share(3)
      outside = max(0.0_wp, -minval(share))
   end subroutine measure_one

   pure function cross(a, b)
      real(wp), intent(in) :: a(3), b(3)
      real(wp) :: cross(3)

      cross = a([2, 3, 1])*b([3, 1, 2]) - a([3, 1, 2])*b([2, 3, 1])
   end function cross

   pure subroutine measure_points(self, x, u0, du)
      class(nodes_on_faces_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp) :: unused, nor_that
      integer :: i

      do i = 1, self%n_constraint
         associate (state => self%state(i), node => [self%node(i), self%corner(:, self%chosen(i))])
            state = gap_state_t(is_near=.true.)
            call measure_one(x, u0, node, state%gap0, unused, state%size)
            call measure_one(x, u0 + du, node, state%gap1, unused, nor_that)
            state%is_over = is_over(self%corner, self%node(i), x, u0 + du)
         end associate
      end do
   end subroutine measure_points

   !> Is a node over some triangle of the master? On its way it may leave the one that was chosen.
   pure logical function is_over(corner, node, x, u)
      integer, intent(in) :: corner(:, :)        !! (3, n_triangle)
      integer, intent(in) :: node
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp) :: gap, outside, length
      integer :: t

      is_over = .true.
      do t = 1, size(corner, 2)
         call measure_one(x, u, [node, corner(:, t)], gap, outside, length)
         if (outside < 1.0e-3_wp) return
      end do
      is_over = .false.
   end function is_over

   pure subroutine evaluate_points(self, wanted, x, u0, du, target, item)
      class(nodes_on_faces_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp), intent(in) :: target(:)
      type(condition_t), intent(inout) :: item(:)
      type(dg_t) :: gap, square
      integer :: k, node(4)

      do k = 1, size(wanted)
         node = [self%node(wanted(k)), self%corner(:, self%chosen(wanted(k)))]
         call gap_of(x(:, node) + u0(:, node), du(:, node), gap, square)
         if (allocated(item(k)%node)) then
            if (size(item(k)%node) < 4) deallocate(item(k)%node, item(k)%g, item(k)%c, item(k)%h)
         end if
         if (.not. allocated(item(k)%node)) allocate(item(k)%node(4), item(k)%g(3, 4), &
            item(k)%c(3, 4), item(k)%h(12, 12))
         item(k)%n_node = 4
         item(k)%n_slave = 1
         item(k)%node(:4) = node
         item(k)%size = sqrt(sqrt(square%f0))
         item(k)%gap0 = gap%f0 - target(k)
         item(k)%gap1 = gap%f1 - target(k)
         item(k)%dgap = gap%df
         item(k)%g = 0.0_wp
         item(k)%c = 0.0_wp
         item(k)%h = 0.0_wp
         call nodes_add_first(1.0_wp, gap%g(:9), [1, 2, 3, 4], item(k)%g)
         call nodes_add_first(1.0_wp, gap%c(:9), [1, 2, 3, 4], item(k)%c)
         call nodes_add_second(1.0_wp, 3, gap%h(:9, :9), [1, 2, 3, 4], item(k)%h)
      end do
   end subroutine evaluate_points

   !> The gap of the first of four nodes over the triangle of the others, and the square of twice
   !> its area; variables are differences to the first.
   pure subroutine gap_of(p, d, gap, square)
      real(wp), intent(in) :: p(3, 4)            !! positions at the start [L]
      real(wp), intent(in) :: d(3, 4)            !! displacements over the step [L]
      type(dg_t), intent(out) :: gap, square
      type(dg_t) :: v(3, 3), n(3)
      integer :: j, k

      do k = 1, 3
         do j = 1, 3
            v(j, k) = dg_variable(3*(k - 1) + j, p(j, k + 1) - p(j, 1), d(j, k + 1) - d(j, 1))
         end do
      end do
      do j = 1, 3
         associate (r => 1 + mod(j, 3), s => 1 + mod(j + 1, 3))
            n(j) = (v(r, 2) - v(r, 1))*(v(s, 3) - v(s, 1)) &
               - (v(s, 2) - v(s, 1))*(v(r, 3) - v(r, 1))
         end associate
      end do
      square = n(1)*n(1) + n(2)*n(2) + n(3)*n(3)
      gap = (-1.0_wp)*((v(1, 1)*n(1) + v(2, 1)*n(2) + v(3, 1)*n(3))/dg_sqrt(square))
   end subroutine gap_of

   !> An equal part of each slave face for each of its nodes.
   pure subroutine area_points(self, x, u, area, length)
      class(nodes_on_faces_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      real(wp), intent(out) :: area(:), length(:)
      integer :: f

      area = 0.0_wp
      do f = 1, self%slave%n_facet
         associate (node => pack(self%slave%corner(:, f), self%slave%corner(:, f) > 0))
            area(node) = area(node) + norm2(facets_normal(self%slave, f, x, u))/size(node)
         end associate
      end do
      length = area
   end subroutine area_points

end module nodes_on_faces
