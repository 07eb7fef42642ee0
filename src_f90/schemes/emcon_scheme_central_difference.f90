!> Central differences: forces at the start of a step, a diagonal mass.
!> Source: docs/theory.md, section 13.
module emcon_scheme_central_difference
   use emcon_evaluation, only : instant_t, evaluation_moving, evaluation_t
   use emcon_kinds, only : wp
   use emcon_scheme, only : scheme_t
   implicit none
   private
   public :: scheme_central_difference_t

   type, extends(scheme_t) :: scheme_central_difference_t
   contains
      procedure :: evaluation => central_difference_pose
   end type scheme_central_difference_t

contains

   !> r = M (du/h - v0) 2/h + forces at the start: du/h is the velocity in the middle of the step.
   pure function central_difference_pose(self, start, h) result(evaluation)
      class(scheme_central_difference_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(evaluation_t) :: evaluation

      evaluation = evaluation_moving(h, lapse=h, v_weight=1.0_wp)
      evaluation%mass_scale = 2.0_wp/h
      evaluation%at = 0.0_wp
      evaluation%is_gradient = .true.
      evaluation%load_place = 0.0_wp
      evaluation%load_instant = start
   end function central_difference_pose

end module emcon_scheme_central_difference
