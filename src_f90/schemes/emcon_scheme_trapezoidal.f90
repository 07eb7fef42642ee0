!> The trapezoidal rule, Newmark's with beta 1/4 and gamma 1/2: the mean of the forces at both ends.
!> Source: docs/theory.md, eq. (4a).
module emcon_scheme_trapezoidal
   use emcon_kinds, only : wp
   use emcon_pose, only : instant_later, instant_t, pose_moving, pose_t
   use emcon_scheme, only : scheme_t
   implicit none
   private
   public :: scheme_trapezoidal_t

   type, extends(scheme_t) :: scheme_trapezoidal_t
   contains
      procedure :: pose => trapezoidal_pose
   end type scheme_trapezoidal_t

contains

   !> r = 2 M (2/h du - 2 v0)/h + forces at the end + forces at the start.
   pure function trapezoidal_pose(self, start, h) result(pose)
      class(scheme_trapezoidal_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(pose_t) :: pose

      pose = pose_moving(0.5_wp*h, lapse=0.5_wp*h, v_weight=2.0_wp)
      pose%is_gradient = .true.
      pose%load_place = 1.0_wp
      pose%load_instant = instant_later(start, h)
      pose%pushes_at_end = .true.
      pose%start_weight = 1.0_wp
   end function trapezoidal_pose

end module emcon_scheme_trapezoidal
