!> What a time stepping scheme is: where it evaluates forces, how inertia enters, and what
!> velocity follows. The residual frame, Newton's method and the step loop serve all schemes.
module emcon_scheme
   use emcon_kinds, only : wp
   use emcon_motion, only : instant_t, pose_t
   implicit none
   private
   public :: scheme_t

   type, abstract :: scheme_t
      logical :: has_inertia = .true.
   contains
      procedure(pose_interface), deferred :: pose
      procedure(velocity_interface), deferred :: velocity
   end type scheme_t

   abstract interface

      !> Evaluation of a step of size `h` from `start`.
      pure function pose_interface(self, start, h) result(pose)
         import :: instant_t, pose_t, scheme_t, wp
         class(scheme_t), intent(in) :: self
         type(instant_t), intent(in) :: start
         real(wp), intent(in) :: h               !! [T]
         type(pose_t) :: pose
      end function pose_interface

      !> Velocity at the end of a step that moved by `du`.
      elemental function velocity_interface(self, h, v0, du) result(v1)
         import :: scheme_t, wp
         class(scheme_t), intent(in) :: self
         real(wp), intent(in) :: h               !! > 0 [T]
         real(wp), intent(in) :: v0              !! at the start [L/T]
         real(wp), intent(in) :: du              !! [L]
         real(wp) :: v1
      end function velocity_interface

   end interface

end module emcon_scheme
