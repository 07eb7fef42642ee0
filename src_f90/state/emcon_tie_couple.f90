!> The couple that ties exert whose surfaces stay apart (`ADJUST=NO`), and what it does to the
!> angular momentum.
!>
!> Forces on a slave node and on the master nodes that it follows sum up to 0, but act across the
!> gap. Source: docs/theory.md, section 10.
module emcon_tie_couple
   use emcon_kinds, only : wp
   use emcon_numbering, only : gather_dependent, numbering_t
   use emcon_rotation, only : add_moments, n_turn
   implicit none
   private
   public :: tie_couple_t, tie_couple_of, tie_couple_add

   !> Part of the sum of all moments, without their signs, that is rounding only.
   real(wp), parameter :: rounding = 16.0_wp*epsilon(1.0_wp)

   type :: tie_couple_t
      real(wp) :: largest = 0.0_wp               !! couple [M L^2/T^2]
      !> (turns) change of the angular momentum by ties in dynamic steps [M L^2/T]
      real(wp), allocatable :: impulse(:)
      real(wp) :: angular = 0.0_wp               !! the largest angular momentum [M L^2/T]
   end type tie_couple_t

contains

   !> The couple of what dependent freedoms hand to those that they follow.
   pure function tie_couple_of(numbering, place, residual) result(couple)
      type(numbering_t), intent(in) :: numbering
      real(wp), intent(in) :: place(:, :)        !! (n_dim, n_node) where nodes are [L]
      real(wp), intent(in) :: residual(:, :)     !! (n_dim, n_node) what holds them [M L/T^2]
      real(wp) :: couple(n_turn(size(place, 1)))
      real(wp) :: gathered(size(place, 1), size(place, 2)), size_of_all
      integer :: i

      gathered = residual
      call gather_dependent(numbering, gathered)
      couple = 0.0_wp
      size_of_all = 0.0_wp
      do i = 1, size(place, 2)
         call add_moments(place(:, i), residual(:, i) - gathered(:, i), couple)
         size_of_all = size_of_all + norm2(place(:, i))*norm2(residual(:, i) - gathered(:, i))
      end do
      ! Surfaces that touch leave a rest of rounding.
      if (norm2(couple) <= rounding*size_of_all) couple = 0.0_wp
   end function tie_couple_of

   !> A step of duration `h` with the couple as its mean.
   pure subroutine tie_couple_add(self, couple, h, angular)
      type(tie_couple_t), intent(inout) :: self
      real(wp), intent(in) :: couple(:)          !! (turns) [M L^2/T^2]
      real(wp), intent(in) :: h                  !! 0 in statics [T]
      real(wp), intent(in) :: angular(:)         !! (turns) angular momentum at its start [M L^2/T]

      if (.not. allocated(self%impulse)) allocate(self%impulse(size(couple)), source=0.0_wp)
      self%largest = max(self%largest, norm2(couple))
      self%impulse = self%impulse + h*couple
      self%angular = max(self%angular, norm2(angular))
   end subroutine tie_couple_add

end module emcon_tie_couple
