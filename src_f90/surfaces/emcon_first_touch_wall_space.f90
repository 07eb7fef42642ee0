!> When nodes that move along a given way touch a wall for the first time.
!>
!> A distance changes no faster than its ends move: by as much as that allows time may go on.
module emcon_first_touch_wall_space
   use emcon_kinds, only : wp
   use emcon_wall, only : wall_t
   use emcon_wall_distance_space, only : wall_at, wall_ends_here, wall_find, wall_spot_t
   implicit none
   private
   public :: wall_touch_time

   !> What is closer than this part of the shape has touched.
   real(wp), parameter :: close_by = 1.0e-9_wp
   !> After a way of so many extents of the shape and distances from it a node has passed by.
   real(wp), parameter :: longest_way = 64.0_wp
   integer, parameter :: most_looks = 1000

contains

   !> The first time at which a node comes to the wall from outside, or to the layer in front of it;
   !> huge if that never happens.
   pure real(wp) function wall_touch_time(wall, node, x, direction, offset) result(first)
      type(wall_t), intent(in) :: wall
      integer, intent(in) :: node(:)             !! of the scene
      real(wp), intent(in) :: x(:, :)            !! (3, n_node) where nodes are [L]
      real(wp), intent(in) :: direction(:, :)    !! (3, n_node) how they move per time [L]
      real(wp), intent(in) :: offset             !! thickness of the layer [L]
      integer :: i

      first = huge(first)
      do i = 1, size(node)
         first = min(first, node_time(wall, node(i), x, direction, offset))
      end do
   end function wall_touch_time

   pure real(wp) function node_time(wall, node, x, direction, offset) result(time)
      type(wall_t), intent(in) :: wall
      integer, intent(in) :: node
      real(wp), intent(in) :: x(:, :), direction(:, :), offset
      real(wp), dimension(3, 4) :: start, way
      real(wp) :: arm, turn, speed, gap, most
      type(wall_spot_t) :: spot
      integer :: k

      start = wall_at(wall, x, 0.0_wp*x)
      way = direction(:, wall%node)
      turn = maxval([(length(way(:, k) - way(:, 1)), k = 2, 4)])/wall%arm
      arm = length(x(:, node) - start(:, 1))
      most = longest_way*(wall%extent + arm)
      time = 0.0_wp
      do k = 1, most_looks
         spot = wall_find(wall, start + time*way, x(:, node) + time*direction(:, node))
         gap = spot%distance - offset
         if (gap <= close_by*wall%extent) then
            ! What is behind as it starts does not come from outside.
            if (k > 1 .and. .not. wall_ends_here(wall, spot)) return
            exit
         end if
         speed = length(direction(:, node) - way(:, 1)) + 2.0_wp*turn*(arm + gap)
         if (.not. speed > 0.0_wp) exit
         time = time + gap/speed
         if (time*speed > most) exit
      end do
      time = huge(time)
   end function node_time

   pure real(wp) function length(a)
      real(wp), intent(in) :: a(3)

      length = sqrt(dot_product(a, a))
   end function length

end module emcon_first_touch_wall_space
