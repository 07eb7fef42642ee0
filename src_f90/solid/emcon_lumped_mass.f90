!> The mass of an element at its nodes.
!> Source: docs/theory.md, section 13.
module emcon_lumped_mass
   use emcon_kinds, only : wp
   implicit none
   private
   public :: lumped_mass

   !> Nodes of which the sum of a row is less than this part of an equal share have too little: of
   !> quadratic elements the corners, where it is even negative.
   real(wp), parameter :: least_share = 0.05_wp

contains

   !> The sums of the rows, which keep the centre of mass; where one is too small, the diagonal
   !> scaled to the mass of the element.
   pure subroutine lumped_mass(consistent, share)
      real(wp), intent(in) :: consistent(:, :)   !! (n, n) [M]
      real(wp), intent(out) :: share(:)          !! (n) [M]
      real(wp) :: total, trace
      integer :: i

      total = sum(consistent)
      share = sum(consistent, 2)
      if (all(real(size(share), wp)*share >= least_share*total)) return
      trace = 0.0_wp
      do i = 1, size(share)
         share(i) = consistent(i, i)
         trace = trace + consistent(i, i)
      end do
      if (trace > 0.0_wp) share = share*(total/trace)
   end subroutine lumped_mass

end module emcon_lumped_mass
