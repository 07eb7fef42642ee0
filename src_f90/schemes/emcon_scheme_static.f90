!> Equilibrium without inertia: forces and loads at the end of the increment. A body in equilibrium
!> is at rest.
module emcon_scheme_static
   use emcon_evaluation, only : instant_later, instant_t, evaluation_at_end, evaluation_t
   use emcon_kinds, only : wp
   use emcon_scheme, only : scheme_t
   implicit none
   private
   public :: scheme_static_t

   type, extends(scheme_t) :: scheme_static_t
   contains
      procedure :: evaluation => static_pose
   end type scheme_static_t

contains

   pure function static_pose(self, start, h) result(evaluation)
      class(scheme_static_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(evaluation_t) :: evaluation

      evaluation = evaluation_at_end
      evaluation%v_weight = 1.0_wp
      evaluation%lapse = h
      evaluation%load_instant = instant_later(start, h)
   end function static_pose

end module emcon_scheme_static
