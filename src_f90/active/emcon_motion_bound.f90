!> How far nodes have moved since some time, at most: an odometer for all of them together.
!>
!> What is so far apart that the odometer cannot have closed it is not looked at.
module emcon_motion_bound
   use emcon_kinds, only : wp
   implicit none
   private
   public :: motion_bound_t, motion_bound_add, largest_motion

   type :: motion_bound_t
      real(wp) :: total = 0.0_wp                 !! no node has gone farther, since the start [L]
      real(wp), allocatable, private :: u(:, :)  !! (n_dim, n_node) where they were last seen [L]
   end type motion_bound_t

contains

   !> The nodes have gone to `u`, wherever that is.
   pure subroutine motion_bound_add(self, u)
      type(motion_bound_t), intent(inout) :: self
      real(wp), intent(in) :: u(:, :)            !! (n_dim, n_node) [L]
      real(wp) :: largest
      integer :: i

      if (.not. allocated(self%u)) allocate(self%u, source=u)
      largest = 0.0_wp
      do i = 1, size(u, 2)
         largest = max(largest, sum((u(:, i) - self%u(:, i))**2))
         self%u(:, i) = u(:, i)
      end do
      self%total = self%total + sqrt(largest)
   end subroutine motion_bound_add

   !> Largest of the motions `du` of all nodes [L].
   pure real(wp) function largest_motion(du)
      real(wp), intent(in) :: du(:, :)           !! (n_dim, n_node) [L]
      integer :: i

      largest_motion = 0.0_wp
      do i = 1, size(du, 2)
         largest_motion = max(largest_motion, sum(du(:, i)**2))
      end do
      largest_motion = sqrt(largest_motion)
   end function largest_motion

end module emcon_motion_bound
