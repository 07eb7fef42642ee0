!> When surfaces that move along a given way touch for the first time, in the plane and in space.
module emcon_first_touch
   use emcon_first_touch_plane, only : touch_time_plane => touch_time
   use emcon_first_touch_space, only : touch_time_space => touch_time
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: touch_time

   integer, parameter :: n_space = 3

contains

   !> The first time at which a node of a contact pair that acts passes through the other surface
   !> from outside, or the layer in front of it; huge if that never happens.
   real(wp) function touch_time(scene, i_step, x, direction)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! of the deck
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n_node) where nodes are [L]
      real(wp), intent(in) :: direction(:, :)    !! (n_dim, n_node) how they move per time [L]

      if (scene%n_dim == n_space) then
         touch_time = touch_time_space(scene, i_step, x, direction)
      else
         touch_time = touch_time_plane(scene, i_step, x, direction)
      end if
   end function touch_time

end module emcon_first_touch
