!> The trapezoidal rule, Newmark's with beta 1/4 and gamma 1/2: the mean of the forces at both ends.
!> Source: docs/theory.md, eq. (4a).
module emcon_scheme_trapezoidal
   use emcon_evaluation, only : instant_later, instant_t, evaluation_moving, evaluation_t
   use emcon_kinds, only : wp
   use emcon_scheme, only : scheme_t
   implicit none
   private
   public :: scheme_trapezoidal_t

   type, extends(scheme_t) :: scheme_trapezoidal_t
   contains
      procedure :: evaluation => trapezoidal_pose
   end type scheme_trapezoidal_t

contains

   !> r = 2 M (2/h du - 2 v0)/h + forces at the end + forces at the start.
   pure function trapezoidal_pose(self, start, h) result(evaluation)
      class(scheme_trapezoidal_t), intent(in) :: self
      type(instant_t), intent(in) :: start
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(evaluation_t) :: evaluation

      evaluation = evaluation_moving(0.5_wp*h, lapse=0.5_wp*h, v_weight=2.0_wp)
      evaluation%is_gradient = .true.
      evaluation%load_place = 1.0_wp
      evaluation%load_instant = instant_later(start, h)
      evaluation%pushes_at_end = .true.
      evaluation%start_weight = 1.0_wp
   end function trapezoidal_pose

end module emcon_scheme_trapezoidal
