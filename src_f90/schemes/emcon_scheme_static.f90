!> Equilibrium without inertia: forces and loads at the end of the increment. A body in equilibrium
!> is at rest.
module emcon_scheme_static
   use emcon_kinds, only : wp
   use emcon_pose, only : instant_later, instant_t, pose_at_end, pose_t
   use emcon_scheme, only : scheme_t
   implicit none
   private
   public :: scheme_static_t

   type, extends(scheme_t) :: scheme_static_t
   contains
      procedure :: pose => static_pose
   end type scheme_static_t

contains

   pure function static_pose(self, start, h) result(pose)
      class(scheme_static_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(pose_t) :: pose

      pose = pose_at_end
      pose%v_weight = 1.0_wp
      pose%load_instant = instant_later(start, h)
   end function static_pose

end module emcon_scheme_static
