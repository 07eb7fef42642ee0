!> Slip of mortar contact in space with a wall over a step: that of the points of slave facets that
!> its distance is integrated at, in the mean with the weight of each of their vertices, which is
!> kept over the step. Source: docs/theory.md, section 14.3.
module emcon_mortar_wall_slip_space
   use emcon_constraint, only : condition_t, most_slips
   use emcon_frame_slip_space, only : slip_axis_t
   use emcon_frame_vertex_space, only : frame_size
   use emcon_kinds, only : wp
   use emcon_mortar_wall_faces_space, only : wall_faces_corners, wall_faces_t, wall_faces_weight
   use emcon_mortar_wall_gap_space, only : n_corner, n_point, point, weight_of
   use emcon_node_sums, only : node_sums_first, node_sums_second
   use emcon_wall_slip_space, only : n_wall_point, wall_axis, wall_slip, wall_slip_t
   implicit none
   private
   public :: wall_slides_t, mortar_wall_slip_choose, mortar_wall_slip_of, mortar_wall_slip_add

   integer, parameter :: n_dim = 3
   !> What the slip of a triangle depends on: its corners, then the origin and tips of the wall.
   integer, parameter :: n_sum = n_corner + n_wall_point - 1, n_var = n_dim*n_sum

   type :: wall_slides_t
      real(wp) :: place = 0.0_wp                 !! where friction acts, of `slip_axis_t`
      !> (n_triangle) twice the areas of those that face the wall, between those at the start and at
      !> the end of a motion; 0 for others [L^2]
      real(wp), allocatable :: area(:)
   end type wall_slides_t

   !> The part of a triangle in the slip of a condition, as `wall_slip_t` has it.
   type :: part_t
      real(wp) :: f(most_slips) = 0.0_wp
      real(wp) :: g(n_dim, n_sum, most_slips) = 0.0_wp, c(n_dim, n_sum, most_slips) = 0.0_wp
      real(wp) :: h(n_var, n_var, most_slips) = 0.0_wp
   end type part_t

contains

   !> What slip over a motion is made of.
   pure type(wall_slides_t) function mortar_wall_slip_choose(faces, x, u0, du, place) result(self)
      type(wall_faces_t), intent(in) :: faces    !! with what of them faces the wall
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: place              !! of `wall_slides_t`
      real(wp) :: corner(n_dim, n_corner)
      integer :: t

      self%place = place
      allocate(self%area(size(faces%is_facing)), source=0.0_wp)
      do t = 1, size(self%area)
         if (.not. faces%is_facing(t)) cycle
         corner = wall_faces_corners(faces, t, x) + wall_faces_corners(faces, t, u0)
         self%area(t) = (1.0_wp - place)*frame_size(corner) + place*frame_size(corner &
            + wall_faces_corners(faces, t, du))
      end do
   end function mortar_wall_slip_choose

   !> The weight of each point of place `k` of the triangles of vertices [L^2].
   pure function moments_of(faces, area, k) result(moment)
      type(wall_faces_t), intent(in) :: faces
      real(wp), intent(in) :: area(:)            !! (n_triangle) [L^2]
      integer, intent(in) :: k
      real(wp) :: moment(n_point), weight(n_corner)

      weight = wall_faces_weight(faces, k)
      moment = area(faces%triangle(k))*weight_of*matmul(weight, point)
   end function moments_of

   !> All weights of constraint `i` [L^2].
   pure real(wp) function total_of(faces, area, i) result(total)
      type(wall_faces_t), intent(in) :: faces
      real(wp), intent(in) :: area(:)
      integer, intent(in) :: i                   !! 1..n_constraint
      integer :: k

      total = 0.0_wp
      do k = faces%start(i), faces%start(i + 1) - 1
         total = total + sum(moments_of(faces, area, k))
      end do
   end function total_of

   !> Where the corners of triangle `t` and the wall are, and how they move.
   pure subroutine gather(faces, t, x, u0, du, at, way)
      type(wall_faces_t), intent(in) :: faces
      integer, intent(in) :: t
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp), intent(out) :: at(n_dim, n_sum), way(n_dim, n_sum)   !! [L]

      at(:, :n_corner) = wall_faces_corners(faces, t, x) + wall_faces_corners(faces, t, u0)
      at(:, n_corner + 1:) = x(:, faces%wall%node) + u0(:, faces%wall%node)
      way(:, :n_corner) = wall_faces_corners(faces, t, du)
      way(:, n_corner + 1:) = du(:, faces%wall%node)
   end subroutine gather

   !> Weights times slips of the points of a triangle.
   pure subroutine find_part(faces, moment, at, way, axis, leaves_second, part)
      type(wall_faces_t), intent(in) :: faces
      real(wp), intent(in) :: moment(:)          !! (n_point) of `moments_of`, by the total
      real(wp), intent(in) :: at(:, :), way(:, :)   !! (3, n_sum) of `gather` [L]
      type(slip_axis_t), intent(in) :: axis
      logical, intent(in) :: leaves_second       !! no second derivatives
      type(part_t), intent(out) :: part
      real(wp) :: share(n_wall_point, n_sum)     !! of corners and the wall in a point and it
      type(wall_slip_t) :: slip
      integer :: q, s

      do q = 1, n_point
         share = shares_of(q)
         call wall_slip(faces%wall, matmul(at, transpose(share)), matmul(way, transpose(share)), &
            axis, leaves_second, slip)
         part%f = part%f + moment(q)*slip%f
         do s = 1, most_slips
            part%g(:, :, s) = part%g(:, :, s) + moment(q)*matmul(slip%g(:, :, s), share)
            part%c(:, :, s) = part%c(:, :, s) + moment(q)*matmul(slip%c(:, :, s), share)
            if (.not. leaves_second) call add_second(slip%h(:, :, s), share, moment(q), &
               part%h(:, :, s))
         end do
      end do
   end subroutine find_part

   !> What of corners and wall is in point `q` and in the wall.
   pure function shares_of(q) result(share)
      integer, intent(in) :: q
      real(wp) :: share(n_wall_point, n_sum)
      integer :: k

      share = 0.0_wp
      share(1, :n_corner) = point(:, q)
      do k = 2, n_wall_point
         share(k, n_corner + k - 1) = 1.0_wp
      end do
   end function shares_of

   !> Add second derivatives by a point and the wall to those by corners and the wall.
   pure subroutine add_second(of_point, share, factor, of_sum)
      real(wp), intent(in) :: of_point(:, :)     !! components of n_wall_point, twice
      real(wp), intent(in) :: share(:, :)        !! (n_wall_point, n_sum)
      real(wp), intent(in) :: factor
      real(wp), intent(inout) :: of_sum(:, :)    !! (n_var, n_var)
      integer :: i, j, k, l

      do l = 1, n_sum
         j = merge(1, l - n_corner + 1, l <= n_corner)
         do k = 1, n_sum
            i = merge(1, k - n_corner + 1, k <= n_corner)
            associate (to => of_sum(n_dim*(k - 1) + 1:n_dim*k, n_dim*(l - 1) + 1:n_dim*l))
               to = to + factor*share(i, k)*share(j, l)*of_point(n_dim*(i - 1) + 1:n_dim*i, &
                  n_dim*(j - 1) + 1:n_dim*j)
            end associate
         end do
      end do
   end subroutine add_second

   !> The slip of constraint `i` [L].
   pure function mortar_wall_slip_of(self, faces, i, x, u0, du) result(slip)
      type(wall_slides_t), intent(in) :: self
      type(wall_faces_t), intent(in) :: faces
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp) :: slip(most_slips)
      real(wp) :: at(n_dim, n_sum), way(n_dim, n_sum), total
      type(part_t) :: part
      integer :: k

      slip = 0.0_wp
      total = total_of(faces, self%area, i)
      if (.not. total > 0.0_wp) return
      do k = faces%start(i), faces%start(i + 1) - 1
         associate (t => faces%triangle(k))
            if (.not. self%area(t) > 0.0_wp) cycle
            call gather(faces, t, x, u0, du, at, way)
            call find_part(faces, moments_of(faces, self%area, k)/total, at, way, &
               slip_axis_t(wall_axis(faces%axis(i)), self%place), .true., part)
            slip = slip + part%f
         end associate
      end do
   end function mortar_wall_slip_of

   !> Add the slip of constraint `i` and its derivatives to its condition, which has all nodes of
   !> it and of the wall, and room for slip.
   pure subroutine mortar_wall_slip_add(self, faces, i, x, u0, du, item)
      type(wall_slides_t), intent(in) :: self
      type(wall_faces_t), intent(in) :: faces
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      type(condition_t), intent(inout) :: item
      real(wp) :: at(n_dim, n_sum), way(n_dim, n_sum), total
      type(part_t) :: part
      integer :: k

      total = total_of(faces, self%area, i)
      if (.not. total > 0.0_wp) return
      do k = faces%start(i), faces%start(i + 1) - 1
         associate (t => faces%triangle(k))
            if (.not. self%area(t) > 0.0_wp) cycle
            call gather(faces, t, x, u0, du, at, way)
            call find_part(faces, moments_of(faces, self%area, k)/total, at, way, &
               slip_axis_t(wall_axis(faces%axis(i)), self%place), item%leaves_second, part)
            call spread_part(faces, t, part, item)
         end associate
      end do
   end subroutine mortar_wall_slip_add

   !> Add what triangle `t` has by its corners and by the wall to derivatives by nodes.
   pure subroutine spread_part(faces, t, part, item)
      type(wall_faces_t), intent(in) :: faces
      integer, intent(in) :: t
      type(part_t), intent(in) :: part
      type(condition_t), intent(inout) :: item
      real(wp) :: weight(size(faces%corner, 1) + n_sum - n_corner, n_sum)
      integer :: place(size(weight, 1)), k, n, s

      weight = 0.0_wp
      associate (facet => faces%slave%facet(:, faces%split%facet(t)))
         n = count(facet > 0)
         do k = 1, n
            place(k) = findloc(item%node(:item%n_node), facet(k), 1)
            weight(k, :n_corner) = faces%corner(k, :, t)
         end do
      end associate
      do k = 1, n_sum - n_corner
         place(n + k) = item%n_slave + k
         weight(n + k, n_corner + k) = 1.0_wp
      end do
      n = n + n_sum - n_corner
      ! Derivatives have the sum 0: that by the first node says nothing more.
      do s = 1, most_slips
         item%slip(s) = item%slip(s) + part%f(s)
         call node_sums_first(reshape(part%g(:, :, s), [n_var]), weight(2:n, :), 1.0_wp, &
            place(:n), item%t(:, :, s))
         call node_sums_first(reshape(part%c(:, :, s), [n_var]), weight(2:n, :), 1.0_wp, &
            place(:n), item%t1(:, :, s))
         if (.not. item%leaves_second) call node_sums_second(part%h(:, :, s), weight(2:n, :), &
            1.0_wp, place(:n), item%ht(:, :, s))
      end do
   end subroutine spread_part

end module emcon_mortar_wall_slip_space
