!> How far a point in space is from a wall, and which way.
module emcon_wall_distance_space
   use emcon_kinds, only : wp
   use emcon_profile_plane, only : profile_find, profile_place_t, profile_slope
   use emcon_wall, only : wall_drawn, wall_flat, wall_round, wall_t, wall_turned
   implicit none
   private
   public :: wall_spot_t, wall_at, wall_find, wall_bend, wall_is_solid, wall_ends_here

   !> Past an end by more than this part of the shape, there is nothing: ends meet rims.
   real(wp), parameter :: end_tol = 1.0e-9_wp

   !> What a point sees of a wall.
   type :: wall_spot_t
      real(wp) :: distance = 0.0_wp              !! > 0 out of the body [L]
      real(wp) :: past = 0.0_wp                  !! so far past an end of its profile [L]
      real(wp) :: normal(3) = 0.0_wp             !! out of the body
   end type wall_spot_t

contains

   !> Where the origin and the tips of the vectors of a wall are at x + u.
   pure function wall_at(wall, x, u) result(at)
      type(wall_t), intent(in) :: wall
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (3, n_node of the scene) [L]
      real(wp) :: at(3, 4)                       !! [L]

      at = x(:, wall%node) + u(:, wall%node)
   end function wall_at

   !> What `point` sees of a wall that is `at` its place.
   pure type(wall_spot_t) function wall_find(wall, at, point) result(spot)
      type(wall_t), intent(in) :: wall
      real(wp), intent(in) :: at(3, 4)           !! origin and tips [L]
      real(wp), intent(in) :: point(3)           !! [L]
      type(profile_place_t) :: place
      real(wp), dimension(3) :: arm, one, other
      real(wp) :: first, second, slope(2)

      arm = point - at(:, 1)
      one = (at(:, 2) - at(:, 1))/wall%arm
      select case (wall%kind)
      case (wall_flat)
         spot = wall_spot_t(dot_product(arm, one), 0.0_wp, one)
         return
      case (wall_round)
         spot%distance = wall%bulge*(length(arm) - wall%radius)
         spot%normal = one
         if (length(arm) > 0.0_wp) spot%normal = wall%bulge/length(arm)*arm
         return
      case (wall_turned)
         second = dot_product(arm, one)
         other = arm - second*one
         first = length(other)
         if (first > 0.0_wp) other = other/first
      case (wall_drawn)
         first = dot_product(arm, one)
         other = (at(:, 3) - at(:, 1))/wall%arm
         second = dot_product(arm, other)
      end select
      place = profile_find(wall, [first, second])
      spot%distance = place%distance
      spot%past = place%past
      slope = profile_slope(wall%piece(place%piece), [first, second])
      if (wall%kind == wall_turned) slope = slope(2:1:-1)
      spot%normal = slope(1)*one + slope(2)*other
   end function wall_find

   !> How the normal turns as the point moves: 0 in front of planes [1/L].
   pure function wall_bend(wall, at, point) result(bend)
      type(wall_t), intent(in) :: wall
      real(wp), intent(in) :: at(3, 4)           !! origin and tips [L]
      real(wp), intent(in) :: point(3)           !! [L]
      real(wp) :: bend(3, 3)
      type(profile_place_t) :: place
      real(wp), dimension(3) :: arm, one, other, along
      real(wp) :: first, second, slope(2)

      bend = 0.0_wp
      if (wall%kind == wall_flat) return
      arm = point - at(:, 1)
      if (wall%kind == wall_round) then
         if (.not. length(arm) > 0.0_wp) return
         associate (normal => arm/length(arm))
            bend = wall%bulge/length(arm)*(unit_matrix() - outer(normal))
         end associate
         return
      end if
      one = (at(:, 2) - at(:, 1))/wall%arm
      other = (at(:, 3) - at(:, 1))/wall%arm
      first = dot_product(arm, one)
      second = dot_product(arm, other)
      if (wall%kind == wall_turned) then
         second = first
         other = arm - second*one
         first = length(other)
         if (.not. first > 0.0_wp) return
         other = other/first
      end if
      place = profile_find(wall, [first, second])
      associate (piece => wall%piece(place%piece), p => [first, second])
         slope = profile_slope(piece, p)
         along = -slope(2)*one + slope(1)*other
         if (wall%kind == wall_turned) along = -slope(2)*other + slope(1)*one
         if (abs(piece%bulge) > 0.0_wp) bend = piece%bulge/norm2(p - piece%centre)*outer(along)
      end associate
      if (wall%kind == wall_turned) bend = bend + slope(1)/first*(unit_matrix() - outer(one) &
         - outer(other))
   end function wall_bend

   pure function outer(a)
      real(wp), intent(in) :: a(3)
      real(wp) :: outer(3, 3)

      outer = spread(a, 2, 3)*spread(a, 1, 3)
   end function outer

   pure function unit_matrix() result(unit)
      real(wp) :: unit(3, 3)
      integer :: i

      unit = 0.0_wp
      do i = 1, 3
         unit(i, i) = 1.0_wp
      end do
   end function unit_matrix

   !> Is all that is behind a wall in its body?
   elemental logical function wall_is_solid(wall)
      type(wall_t), intent(in) :: wall

      wall_is_solid = .not. any(wall%is_open)
   end function wall_is_solid

   !> Is there nothing of the wall over a point?
   elemental logical function wall_ends_here(wall, spot)
      type(wall_t), intent(in) :: wall
      type(wall_spot_t), intent(in) :: spot

      wall_ends_here = spot%past > end_tol*wall%extent
   end function wall_ends_here

   pure real(wp) function length(a)
      real(wp), intent(in) :: a(3)

      length = sqrt(dot_product(a, a))
   end function length

end module emcon_wall_distance_space
