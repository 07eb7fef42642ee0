!> The theta method: (v1 - v0)/h M + F(u0 + theta du) = 0, du = h (theta v1 + (1 - theta) v0).
!> theta = 1/2 is the mid-point rule, theta = 1 the backward Euler method.
!>
!> A scheme from outside: one file against the installed modules. Its row is a *TIME INTEGRATION,
!> SCHEME= with the name by which it is given.
module theta_scheme
   use emcon_api, only : instant_later, instant_t, evaluation_moving, evaluation_t, scheme_t, wp
   implicit none
   private
   public :: theta_scheme_t

   type, extends(scheme_t) :: theta_scheme_t
      real(wp) :: theta = 0.5_wp                 !! 0 < . <= 1
      logical :: pushes_at_end = .false.         !! contact pushes along gradients there
   contains
      procedure :: evaluation
   end type theta_scheme_t

contains

   pure function evaluation(self, start, h)
      class(theta_scheme_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(evaluation_t) :: evaluation

      evaluation = evaluation_moving(h, lapse=self%theta*h, v_weight=1.0_wp/self%theta)
      evaluation%at = self%theta
      evaluation%is_gradient = .true.
      evaluation%load_place = self%theta
      evaluation%pushes_at_end = self%pushes_at_end
      evaluation%load_instant = instant_later(start, self%theta*h)
   end function evaluation

end module theta_scheme
