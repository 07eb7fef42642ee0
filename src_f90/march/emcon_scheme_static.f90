!> Equilibrium without inertia: forces and loads at the end of the increment.
module emcon_scheme_static
   use emcon_kinds, only : wp
   use emcon_motion, only : instant_t, pose_t
   use emcon_scheme, only : scheme_t
   implicit none
   private
   public :: scheme_static_t

   type, extends(scheme_t) :: scheme_static_t
   contains
      procedure :: pose => static_pose
      procedure :: velocity => static_velocity
   end type scheme_static_t

contains

   pure function static_pose(self, start, h) result(pose)
      class(scheme_static_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(pose_t) :: pose

      pose%is_end = .true.
      pose%load_instant = instant_t(start%step_time + h, start%total_time + h)
   end function static_pose

   !> A body in equilibrium is at rest.
   elemental function static_velocity(self, h, v0, du) result(v1)
      class(scheme_static_t), intent(in) :: self
      real(wp), intent(in) :: h, v0, du          !! [T], [L/T], [L]
      real(wp) :: v1

      v1 = 0.0_wp
   end function static_velocity

end module emcon_scheme_static
