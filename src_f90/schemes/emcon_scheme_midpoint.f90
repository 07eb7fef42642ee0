!> The mid-point rule: gradients at the middle of the step, which keep all momenta.
!> Source: docs/theory.md, section 1.
module emcon_scheme_midpoint
   use emcon_evaluation, only : instant_later, instant_t, evaluation_moving, evaluation_t
   use emcon_kinds, only : wp
   use emcon_scheme, only : scheme_t
   implicit none
   private
   public :: scheme_midpoint_t

   type, extends(scheme_t) :: scheme_midpoint_t
   contains
      procedure :: evaluation => midpoint_pose
   end type scheme_midpoint_t

contains

   !> r = M (2/h du - 2 v0)/h + forces at u0 + du/2; loads there, at mid-time.
   pure function midpoint_pose(self, start, h) result(evaluation)
      class(scheme_midpoint_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(evaluation_t) :: evaluation

      evaluation = evaluation_moving(h, lapse=0.5_wp*h, v_weight=2.0_wp)
      evaluation%at = 0.5_wp
      evaluation%is_gradient = .true.
      evaluation%load_instant = instant_later(start, 0.5_wp*h)
   end function midpoint_pose

end module emcon_scheme_midpoint
