!> The air across which contact forces act: what the constraints hold open.
module emcon_stand_off
   use emcon_constraint, only : condition_t
   use emcon_constraints, only : constraint_index, constraint_set_t
   use emcon_contact, only : gap_ratio
   use emcon_kinds, only : wp
   use emcon_system, only : system_t
   implicit none
   private
   public :: stand_off_t, stand_off_add, stand_off_mean

   !> Forces below this fraction of the largest one of the step are round-off.
   real(wp), parameter :: least_force = sqrt(epsilon(1.0_wp))

   !> Gaps are fractions of the shorter edge of both sides, 0 where closed.
   type :: stand_off_t
      real(wp) :: largest = 0.0_wp
      real(wp) :: impulse = 0.0_wp               !! sum of force times duration [M L/T]
      real(wp) :: impulse_gap = 0.0_wp           !! the same, each times its gap [M L/T]
   end type stand_off_t

contains

   !> Add the contacts of `set` at the end of a step of duration `h`, with the gaps last measured.
   pure subroutine stand_off_add(self, system, set, h)
      type(stand_off_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in) :: h                  !! [T]
      real(wp) :: force, largest, gap
      integer :: k, pair, i

      largest = 0.0_wp
      do k = set%n_permanent + 1, set%n
         largest = max(largest, push_of(set%item(k), set%lam(k)))
      end do
      do k = set%n_permanent + 1, set%n
         force = push_of(set%item(k), set%lam(k))
         if (force <= least_force*largest) cycle
         call constraint_index(system, set%id(k), pair, i)
         associate (state => system%contact(pair)%contact%state(i))
            gap = gap_ratio(state, max(0.0_wp, state%gap1 - max(0.0_wp, state%closed)))
         end associate
         self%largest = max(self%largest, gap)
         self%impulse = self%impulse + force*h
         self%impulse_gap = self%impulse_gap + force*h*gap
      end do
   end subroutine stand_off_add

   !> The force on the slave nodes of a contact together [M L/T^2].
   pure real(wp) function push_of(item, lam)
      type(condition_t), intent(in) :: item
      real(wp), intent(in) :: lam                !! its multiplier
      real(wp) :: total
      integer :: d

      ! By squares: norm2 knows the units.
      total = 0.0_wp
      do d = 1, size(item%g, 1)
         total = total + sum(item%g(d, :item%n_slave))**2
      end do
      push_of = abs(lam)*sqrt(total)
   end function push_of

   !> Mean gap, weighted by the impulses that went across it.
   pure real(wp) function stand_off_mean(self)
      type(stand_off_t), intent(in) :: self

      stand_off_mean = 0.0_wp
      if (self%impulse > 0.0_wp) stand_off_mean = self%impulse_gap/self%impulse
   end function stand_off_mean

end module emcon_stand_off
