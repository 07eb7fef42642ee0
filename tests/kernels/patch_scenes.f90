!> A rough grid of triangles that patches look at, and what their gaps are asked.
module patch_scenes
   use emcon_dgrad_nodes, only : nodes_add_first
   use emcon_kinds, only : wp
   use emcon_patch_gap_space, only : patch_gap_t
   use emcon_patch_look_space, only : patch_t
   implicit none
   private
   public :: make_grid, turned, way_of, moment_of, size_of

   !> A grid of so many triangles' legs of length 1 along each side, and its vertices.
   integer, parameter, public :: n_side = 6, n_vertex = (n_side + 1)**2, n_point = 3 + n_vertex
   !> The surface is bent by up to this at vertices: kinks of up to .3.
   real(wp), parameter, public :: rough = 0.12_wp

contains

   !> A grid of triangles, each square halved, seen from below.
   subroutine make_grid(patch, length, x)
      type(patch_t), intent(out) :: patch
      real(wp), intent(in) :: length             !! of the patch
      real(wp), intent(out) :: x(3, n_point)     !! origin and frame in the middle, then the grid
      integer :: i, j, k

      patch%n_vertex = n_vertex
      patch%n_triangle = 2*n_side**2
      patch%length = length
      allocate(patch%triangle(3, patch%n_triangle), patch%chi(n_vertex))
      patch%chi = 1.0_wp
      x = 0.0_wp
      x(1, 2) = 1.0_wp
      x(2, 3) = 1.0_wp
      k = 0
      do j = 0, n_side
         do i = 0, n_side
            x(:2, 4 + i + (n_side + 1)*j) = real([i, j], wp) - 0.5_wp*real(n_side, wp)
            if (max(i, j) == n_side) cycle
            associate (at => 1 + i + (n_side + 1)*j)
               patch%triangle(:, k + 1) = [at, at + 1, at + n_side + 2]
               patch%triangle(:, k + 2) = [at, at + n_side + 2, at + n_side + 1]
            end associate
            k = k + 2
         end do
      end do
   end subroutine make_grid

   !> About the third axis, then about the first one.
   pure function turned(first, second) result(turn)
      real(wp), intent(in) :: first, second
      real(wp) :: turn(3, 3)
      real(wp) :: one(3, 3)

      one = 0.0_wp
      one(3, 3) = 1.0_wp
      one(1, :2) = [cos(first), -sin(first)]
      one(2, :2) = [sin(first), cos(first)]
      turn = 0.0_wp
      turn(1, 1) = 1.0_wp
      turn(2, 2:) = [cos(second), -sin(second)]
      turn(3, 2:) = [sin(second), cos(second)]
      turn = matmul(turn, one)
   end function turned

   !> The motion of the variables of a gap.
   pure function way_of(gap, dx) result(way)
      type(patch_gap_t), intent(in) :: gap
      real(wp), intent(in) :: dx(:, :)
      real(wp) :: way(6 + 3*gap%n_vertex)

      associate (node => [2, 3, 3 + gap%vertex(:gap%n_vertex)])
         way = reshape(dx(:, node) - spread(dx(:, 1), 2, size(node)), shape(way))
      end associate
   end function way_of

   !> The sum of the moments of a discrete gradient as forces, at the middle of the step.
   pure function moment_of(gap, x, dx) result(moment)
      type(patch_gap_t), intent(in) :: gap
      real(wp), intent(in) :: x(:, :), dx(:, :)
      real(wp) :: moment(3)
      real(wp) :: g(3, 3 + gap%n_vertex)
      integer :: i

      call spread_forces(gap, g)
      moment = 0.0_wp
      associate (node => [1, 2, 3, 3 + gap%vertex(:gap%n_vertex)])
         do i = 1, size(node)
            associate (at => x(:, node(i)) + 0.5_wp*dx(:, node(i)))
               moment = moment + cshift(at, 1)*cshift(g(:, i), -1) &
                  - cshift(at, -1)*cshift(g(:, i), 1)
            end associate
         end do
      end associate
   end function moment_of

   !> The sum of the sizes of these forces' components.
   pure real(wp) function size_of(gap)
      type(patch_gap_t), intent(in) :: gap
      real(wp) :: g(3, 3 + gap%n_vertex)

      call spread_forces(gap, g)
      size_of = sum(abs(g))
   end function size_of

   !> A discrete gradient by all points.
   pure subroutine spread_forces(gap, g)
      type(patch_gap_t), intent(in) :: gap
      real(wp), intent(out) :: g(:, :)
      integer :: i

      g = 0.0_wp
      call nodes_add_first(1.0_wp, gap%g, [(i, i = 1, size(g, 2))], g)
   end subroutine spread_forces

end module patch_scenes
