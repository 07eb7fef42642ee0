!> Central differences: forces at the start of a step, a diagonal mass.
!> Source: docs/theory.md, section 14.
module emcon_scheme_central_difference
   use emcon_kinds, only : wp
   use emcon_pose, only : instant_t, pose_moving, pose_t
   use emcon_scheme, only : scheme_t
   implicit none
   private
   public :: scheme_central_difference_t

   type, extends(scheme_t) :: scheme_central_difference_t
   contains
      procedure :: pose => central_difference_pose
   end type scheme_central_difference_t

contains

   !> r = M (du/h - v0) 2/h + forces at the start: du/h is the velocity in the middle of the step.
   pure function central_difference_pose(self, start, h) result(pose)
      class(scheme_central_difference_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(pose_t) :: pose

      pose = pose_moving(h, lapse=h, v_weight=1.0_wp)
      pose%mass_scale = 2.0_wp/h
      pose%place = 0.0_wp
      pose%is_gradient = .true.
      pose%load_place = 0.0_wp
      pose%load_instant = start
   end function central_difference_pose

end module emcon_scheme_central_difference
