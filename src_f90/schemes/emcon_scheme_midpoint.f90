!> The mid-point rule: gradients at the middle of the step, which keep all momenta.
!> Source: docs/theory.md, section 1.
module emcon_scheme_midpoint
   use emcon_kinds, only : wp
   use emcon_pose, only : instant_later, instant_t, pose_moving, pose_t
   use emcon_scheme, only : scheme_t
   implicit none
   private
   public :: scheme_midpoint_t

   type, extends(scheme_t) :: scheme_midpoint_t
   contains
      procedure :: pose => midpoint_pose
   end type scheme_midpoint_t

contains

   !> r = M (2/h du - 2 v0)/h + forces at u0 + du/2; loads there, at mid-time.
   pure function midpoint_pose(self, start, h) result(pose)
      class(scheme_midpoint_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(pose_t) :: pose

      pose = pose_moving(h, lapse=0.5_wp*h, v_weight=2.0_wp)
      pose%place = 0.5_wp
      pose%is_gradient = .true.
      pose%load_instant = instant_later(start, 0.5_wp*h)
   end function midpoint_pose

end module emcon_scheme_midpoint
