!> Slip of a point along a wall in space over a step: two numbers.
!>
!> The point in the vectors of the wall is three dot products; their changes along two directions
!> that touch the wall half way are slip. So rigid turns of wall and point together are none, and
!> its forces have no resultant and no moment. Source: docs/theory.md, section 14.3.
module emcon_wall_slip_space
   use emcon_dgrad9, only : dg_dot, dg_t, difference, operator(*)
   use emcon_dgrad9_first, only : first_dot => dg_dot, first_t => dg_t, &
      first_difference => difference, operator(*)
   use emcon_dgrad_nodes, only : nodes_add_first, nodes_add_second
   use emcon_frame_slip_space, only : tangent_axis, tangent_basis
   use emcon_kinds, only : wp
   use emcon_wall, only : wall_t
   use emcon_wall_distance_space, only : wall_bend, wall_find, wall_spot_t
   implicit none
   private
   public :: wall_slip_t, wall_slip, n_wall_point

   !> The point, and the origin and tips of vectors of the wall.
   integer, parameter :: n_wall_point = 5, n_dim = 3

   type :: wall_slip_t
      real(wp) :: f(2) = 0.0_wp                  !! slip over the step [L]
      real(wp) :: g(n_dim, n_wall_point, 2) = 0.0_wp   !! discrete gradients
      real(wp) :: c(n_dim, n_wall_point, 2) = 0.0_wp   !! gradients at the end
      !> (i, j, which) derivative of g(i, which) by coordinate j at the end, if it is asked for
      real(wp) :: h(n_dim*n_wall_point, n_dim*n_wall_point, 2)
   end type wall_slip_t

contains

   !> The first direction is as near to `along` as it can be.
   pure subroutine wall_slip(wall, x, dx, along, leaves_second, slip)
      type(wall_t), intent(in) :: wall
      !> Point, origin, tips: where they start, how they move [L]
      real(wp), intent(in) :: x(n_dim, n_wall_point), dx(n_dim, n_wall_point)
      real(wp), intent(in) :: along(n_dim)       !! in the vectors of the wall, of any length
      logical, intent(in) :: leaves_second       !! no second derivatives
      type(wall_slip_t), intent(out) :: slip
      type(dg_t) :: place(n_dim)
      type(first_t) :: first
      real(wp) :: basis(n_dim, 2), by_place(n_dim, n_dim, 2), part_g(n_dim, n_wall_point), &
         part_c(n_dim, n_wall_point)
      integer :: i, k

      do i = 1, n_dim
         associate (three => [1, 2, 2 + i, 2 + i])
            if (leaves_second) then
               first = (1.0_wp/wall%arm)*first_dot(first_difference(1, 2, x(:, three), &
                  dx(:, three)), first_difference(3, 2, x(:, three), dx(:, three)))
               place(i)%f0 = first%f0
               place(i)%df = first%df
               place(i)%g = first%g
               place(i)%c = first%c
            else
               place(i) = (1.0_wp/wall%arm)*dg_dot(difference(1, 2, x(:, three), dx(:, three)), &
                  difference(3, 2, x(:, three), dx(:, three)))
            end if
         end associate
      end do
      call find_basis(wall, place%f0 + 0.5_wp*place%df, along, basis, by_place)
      do i = 1, n_dim
         part_g = 0.0_wp
         part_c = 0.0_wp
         call nodes_add_first(1.0_wp, place(i)%g, points_of(i), part_g)
         call nodes_add_first(1.0_wp, place(i)%c, points_of(i), part_c)
         do k = 1, 2
            slip%f(k) = slip%f(k) + basis(i, k)*place(i)%df
            slip%g(:, :, k) = slip%g(:, :, k) + basis(i, k)*part_g
            ! The directions turn with the place at the end.
            slip%c(:, :, k) = slip%c(:, :, k) + (basis(i, k) + dot_product(place%df, &
               by_place(:, i, k)))*part_c
         end do
      end do
      if (.not. leaves_second) call add_second(place, basis, by_place, slip)
   end subroutine wall_slip

   !> The points that coordinate `i` is made of.
   pure function points_of(i) result(point)
      integer, intent(in) :: i
      integer :: point(3)

      point = [1, 2, 2 + i]
   end function points_of

   pure subroutine add_second(place, basis, by_place, slip)
      type(dg_t), intent(in) :: place(:)
      real(wp), intent(in) :: basis(:, :), by_place(:, :, :)   !! as `find_basis` has them
      type(wall_slip_t), intent(inout) :: slip
      real(wp), dimension(n_dim, n_wall_point) :: part, turn
      integer :: i, j, k

      slip%h = 0.0_wp
      do k = 1, 2
         do i = 1, n_dim
            call nodes_add_second(basis(i, k), n_dim, place(i)%h, points_of(i), slip%h(:, :, k))
            part = 0.0_wp
            turn = 0.0_wp
            call nodes_add_first(1.0_wp, place(i)%g, points_of(i), part)
            do j = 1, n_dim
               call nodes_add_first(by_place(i, j, k), place(j)%c, points_of(j), turn)
            end do
            slip%h(:, :, k) = slip%h(:, :, k) + spread(reshape(part, [size(part)]), 2, size(turn)) &
               *spread(reshape(turn, [size(turn)]), 1, size(part))
         end do
      end do
   end subroutine add_second

   !> Origin and tips of the wall in its vectors.
   pure function own_vectors(wall) result(own)
      type(wall_t), intent(in) :: wall
      real(wp) :: own(n_dim, n_wall_point - 1)   !! [L]
      integer :: i

      own = 0.0_wp
      do i = 1, n_dim
         own(i, 1 + i) = wall%arm
      end do
   end function own_vectors

   !> Directions that touch the wall half way, in its vectors, and how they turn with the place at
   !> the end.
   pure subroutine find_basis(wall, half_way, along, basis, by_place)
      type(wall_t), intent(in) :: wall
      real(wp), intent(in) :: half_way(n_dim)    !! in the vectors of the wall [L]
      real(wp), intent(in) :: along(n_dim)
      real(wp), intent(out) :: basis(n_dim, 2)
      real(wp), intent(out) :: by_place(n_dim, n_dim, 2)   !! (of, by coordinate, which) [1/L]
      real(wp) :: axis(n_dim), bend(n_dim, n_dim), lean
      type(wall_spot_t) :: middle
      integer :: i

      middle = wall_find(wall, own_vectors(wall), half_way)
      axis = tangent_axis(middle%normal, along)
      basis = tangent_basis(middle%normal, axis)
      bend = 0.5_wp*wall_bend(wall, own_vectors(wall), half_way)
      lean = dot_product(middle%normal, axis)/norm2(matmul(axis, basis))
      associate (turn => matmul(transpose(basis), bend))
         do i = 1, n_dim
            by_place(:, i, 1) = -turn(1, i)*middle%normal - lean*turn(2, i)*basis(:, 2)
            by_place(:, i, 2) = -turn(2, i)*middle%normal + lean*turn(2, i)*basis(:, 1)
         end do
      end associate
   end subroutine find_basis

end module emcon_wall_slip_space
