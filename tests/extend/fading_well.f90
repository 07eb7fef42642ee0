!> A potential from outside: V = -depth exp(-r^2/(2 width^2)) of each of some nodes.
module fading_well
   use emcon_api, only : point_function_t, point_ok, wp
   implicit none
   private
   public :: fading_well_t

   type, extends(point_function_t) :: fading_well_t
      real(wp) :: depth = 1.0_wp                 !! [M L^2/T^2]
      real(wp) :: width = 1.0_wp                 !! [L]
   contains
      procedure :: evaluate
   end type fading_well_t

contains

   subroutine evaluate(self, z, wants_hessian, value, gradient, hessian, status)
      class(fading_well_t), intent(in) :: self
      real(wp), intent(in), contiguous :: z(:, :)
      logical, intent(in) :: wants_hessian
      real(wp), intent(inout), contiguous :: value(:), gradient(:, :), hessian(:, :, :)
      integer, intent(out) :: status
      integer :: i, k

      do k = 1, size(z, 2)
         value(k) = -self%depth*exp(-0.5_wp*sum(z(:, k)**2)/self%width**2)
         gradient(:, k) = -value(k)/self%width**2*z(:, k)
         if (.not. wants_hessian) cycle
         do i = 1, 2
            hessian(:, i, k) = -gradient(:, k)*z(i, k)/self%width**2
            hessian(i, i, k) = hessian(i, i, k) - value(k)/self%width**2
         end do
      end do
      status = point_ok
   end subroutine evaluate

end module fading_well
