!> The theta method: (v1 - v0)/h M + F(u0 + theta du) = 0, du = h (theta v1 + (1 - theta) v0).
!> theta = 1/2 is the mid-point rule, theta = 1 the backward Euler method.
!>
!> A scheme from outside: one file against the installed modules. Its row is a *TIME INTEGRATION,
!> SCHEME= with the name by which it is given.
module theta_scheme
   use emcon_api, only : instant_later, instant_t, pose_moving, pose_t, scheme_t, wp
   implicit none
   private
   public :: theta_scheme_t

   type, extends(scheme_t) :: theta_scheme_t
      real(wp) :: theta = 0.5_wp                 !! 0 < . <= 1
      logical :: pushes_at_end = .false.         !! contact pushes along gradients there
   contains
      procedure :: pose
   end type theta_scheme_t

contains

   pure function pose(self, start, h)
      class(theta_scheme_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(pose_t) :: pose

      pose = pose_moving(h, lapse=self%theta*h, v_weight=1.0_wp/self%theta)
      pose%place = self%theta
      pose%is_gradient = .true.
      pose%load_place = self%theta
      pose%pushes_at_end = self%pushes_at_end
      pose%load_instant = instant_later(start, self%theta*h)
   end function pose

end module theta_scheme
