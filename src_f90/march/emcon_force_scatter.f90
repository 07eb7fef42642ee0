!> Do contact forces jump from increment to increment? Nodes with mass that are held exactly bounce
!> off and come back: the energy is right, the force of each increment is not.
!>
!> The scatter is what the force of an increment is off the mean of its neighbours by, root mean
!> square by that of the force. Forces that fall and rise again every few increments are a comb.
module emcon_force_scatter
   use emcon_kinds, only : wp
   use emcon_pair_sums, only : pair_sum_t
   implicit none
   private
   public :: force_scatter_t, scatter_follow, scatter_of, scatter_is_comb

   !> A comb has a larger scatter,
   real(wp), parameter :: most_scatter = 0.5_wp
   !> falls and rises again so often, and at least once in so many increments.
   integer, parameter :: fewest_dips = 5, longest_tooth = 4

   !> Forces of one pair in dynamic increments that follow each other.
   type :: force_scatter_t
      real(wp) :: last = 0.0_wp, before = 0.0_wp !! of the last two increments [M L/T^2]
      !> Root of the sum of squares of forces, and of what they are off their neighbours by.
      real(wp) :: force = 0.0_wp, off = 0.0_wp   !! [M L/T^2]
      integer :: n_force = 0                     !! increments with a force
      integer :: n_dip = 0                       !! times that it fell and rose again
      integer :: n_open = 0                      !! increments without force up to now
      logical :: is_falling = .false.
   end type force_scatter_t

contains

   !> Follow a pair over an increment.
   elemental subroutine scatter_follow(self, sum, is_dynamic)
      type(force_scatter_t), intent(inout) :: self
      type(pair_sum_t), intent(in) :: sum        !! what it has transmitted in the increment
      logical, intent(in) :: is_dynamic          !! else it does not count
      real(wp) :: force

      if (.not. is_dynamic .or. .not. sum%span > 0.0_wp) then
         self%last = 0.0_wp
         self%before = 0.0_wp
         self%is_falling = .false.
         return
      end if
      force = sum%weight/sum%span
      self%off = hypot(self%off, self%last - 0.5_wp*(self%before + force))
      self%force = hypot(self%force, force)
      if (force > self%last) then
         if (self%is_falling .and. self%n_open < longest_tooth) self%n_dip = self%n_dip + 1
         self%is_falling = .false.
      else if (force < self%last) then
         self%is_falling = .true.
      end if
      if (force > 0.0_wp) then
         self%n_force = self%n_force + 1
         self%n_open = 0
      else
         self%n_open = self%n_open + 1
      end if
      self%before = self%last
      self%last = force
   end subroutine scatter_follow

   !> The scatter so far, 0 for a smooth force.
   elemental real(wp) function scatter_of(self)
      type(force_scatter_t), intent(in) :: self

      scatter_of = 0.0_wp
      if (self%force > 0.0_wp) scatter_of = self%off/self%force
   end function scatter_of

   !> Is the force a comb?
   elemental logical function scatter_is_comb(self)
      type(force_scatter_t), intent(in) :: self

      scatter_is_comb = scatter_of(self) > most_scatter .and. self%n_dip >= fewest_dips .and. &
         longest_tooth*self%n_dip >= self%n_force
   end function scatter_is_comb

end module emcon_force_scatter
