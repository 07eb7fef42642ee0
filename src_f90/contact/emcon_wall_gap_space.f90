! build: elements
!> How far a node is from a wall over a step: value, discrete gradient, second derivatives.
!>
!> All of it is made of dot products of the way from the origin of the wall and of its vectors,
!> which are linear in positions: forces have no resultant and no moment.
!> Source: docs/theory.md, section 14.1.
module emcon_wall_gap_space
   use emcon_dgrad9, only : dg_dot, dg_sqrt, dg_t, difference, difference_t, &
      operator(+), operator(-), operator(*)
   use emcon_kinds, only : wp
   use emcon_profile_step_plane, only : profile_step, profile_step_t
   use emcon_rotation, only : cross_product
   use emcon_wall, only : wall_drawn, wall_flat, wall_round, wall_t, wall_turned
   implicit none
   private
   public :: dg_t, wall_gap, wall_gap_nodes

   !> A distance from the axis below this part of the shape is none.
   real(wp), parameter :: no_distance = 4.0_wp*epsilon(1.0_wp)

contains

   !> So many of the nodes that `wall_gap` is told have a part in it.
   elemental integer function wall_gap_nodes(wall) result(n)
      type(wall_t), intent(in) :: wall

      n = 3
      if (wall%kind == wall_round) n = 2
      if (wall%kind == wall_drawn) n = 4
   end function wall_gap_nodes

   !> The distance, a number over the nodes but the first one.
   pure type(dg_t) function wall_gap(wall, x, dx) result(gap)
      type(wall_t), intent(in) :: wall
      !> The node, the origin of the wall, the tips of its first and second vectors: where they
      !> start, how they move [L]
      real(wp), intent(in) :: x(3, 4), dx(3, 4)
      type(difference_t) :: arm, one
      type(dg_t) :: square

      arm = difference(1, 2, x, dx)
      one = difference(3, 2, x, dx)
      select case (wall%kind)
      case (wall_flat)
         gap = (1.0_wp/wall%arm)*dg_dot(arm, one)
      case (wall_round)
         square = dg_dot(arm, arm)
         gap = wall%bulge*dg_sqrt(square)
         gap%f0 = gap%f0 - wall%bulge*wall%radius
         gap%f1 = gap%f1 - wall%bulge*wall%radius
      case (wall_turned)
         gap = turned_gap(wall, arm, one)
      case (wall_drawn)
         gap = drawn_gap(wall, (1.0_wp/wall%arm)*dg_dot(arm, one), &
            (1.0_wp/wall%arm)*dg_dot(arm, difference(4, 2, x, dx)))
      end select
   end function wall_gap

   pure type(dg_t) function drawn_gap(wall, first, second) result(gap)
      type(wall_t), intent(in) :: wall
      type(dg_t), intent(in) :: first, second    !! coordinates in the plane of the profile
      type(profile_step_t) :: step

      call profile_step(wall, [first%f0, second%f0], [first%df, second%df], step)
      gap = of_two(first, second, step)
   end function drawn_gap

   !> By the square of the distance from the axis, which is smooth at it, and the place along it: so
   !> forces have no moment about the axis.
   pure type(dg_t) function turned_gap(wall, arm, axis) result(gap)
      type(wall_t), intent(in) :: wall
      type(difference_t), intent(in) :: arm, axis
      type(dg_t) :: square, along
      type(profile_step_t) :: step
      real(wp), dimension(3) :: off0, off1
      real(wp) :: radius(0:1)

      along = (1.0_wp/wall%arm)*dg_dot(arm, axis)
      square = (1.0_wp/wall%arm**2)*(dg_dot(arm, arm)*dg_dot(axis, axis)) - along*along
      ! The same without differences of large numbers.
      off0 = cross_product(arm%v0, axis%v0)/wall%arm
      off1 = cross_product(arm%v1, axis%v1)/wall%arm
      square%f0 = dot_product(off0, off0)
      square%f1 = dot_product(off1, off1)
      square%df = dot_product(off0 + off1, (cross_product(arm%dv, axis%v0 + axis%v1) &
         + cross_product(arm%v0 + arm%v1, axis%dv))/(2.0_wp*wall%arm))
      radius = sqrt([square%f0, square%f1])
      associate (total => max(sum(radius), no_distance*wall%extent))
         call profile_step(wall, [radius(0), along%f0], [square%df/total, along%df], step)
         call to_square(wall, radius, total, [along%f0, along%f1], step)
      end associate
      gap = of_two(square, along, step)
   end function turned_gap

   !> Derivatives by the square of the distance from the axis in place of those by the distance.
   pure subroutine to_square(wall, radius, total, along, step)
      type(wall_t), intent(in) :: wall
      real(wp), intent(in) :: radius(0:), total  !! at both ends, and their sum, not 0 [L]
      real(wp), intent(in) :: along(0:)          !! at both ends [L]
      type(profile_step_t), intent(inout) :: step
      real(wp) :: last, rate, distance(0:1)
      logical :: is_round

      is_round = step%piece > 0
      if (is_round) is_round = abs(wall%piece(step%piece)%bulge) > 0.0_wp &
         .and. .not. abs(wall%piece(step%piece)%centre(1)) > 0.0_wp
      if (is_round) then                         ! a part of a sphere about the axis
         associate (piece => wall%piece(step%piece))
            distance = sqrt(radius**2 + (along - piece%centre(2))**2)
            step%g(1) = piece%bulge/sum(distance)
            step%c(1) = 0.5_wp*piece%bulge/distance(1)
            rate = -step%g(1)/(sum(distance)*distance(1))
            step%h(1, 1) = 0.5_wp*rate
            step%h(1, 2) = rate*(along(1) - piece%centre(2))
            step%h(2, 1) = 0.5_wp*rate*(sum(along) - 2.0_wp*piece%centre(2))
         end associate
         return
      end if
      last = max(radius(1), no_distance*wall%extent)
      step%h(1, 1) = (step%h(1, 1) - step%g(1)/total)/(2.0_wp*last*total)
      step%h(1, 2) = step%h(1, 2)/total
      step%h(2, 1) = step%h(2, 1)/(2.0_wp*last)
      step%g(1) = step%g(1)/total
      step%c(1) = step%c(1)/(2.0_wp*last)
   end subroutine to_square

   !> A function of two numbers by its derivatives.
   pure type(dg_t) function of_two(a, b, step) result(s)
      type(dg_t), intent(in) :: a, b
      type(profile_step_t), intent(in) :: step
      integer :: j

      s = step%g(1)*a + step%g(2)*b
      s%f0 = step%f0
      s%f1 = step%f1
      s%c = step%c(1)*a%c + step%c(2)*b%c
      do j = 1, size(s%h, 2)
         s%h(:, j) = s%h(:, j) + (step%h(1, 1)*a%c(j) + step%h(1, 2)*b%c(j))*a%g &
            + (step%h(2, 1)*a%c(j) + step%h(2, 2)*b%c(j))*b%g
      end do
   end function of_two

end module emcon_wall_gap_space
