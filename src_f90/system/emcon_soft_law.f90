!> Contact that gives way: its multiplier is a function of the gap, not an unknown.
!>
!> A penalty of stiffness k stores k/2 min(d, 0)^2 at the gap d. Over a step its force is the
!> discrete gradient of that, so that what it takes is what it stores, or its value at the end. An
!> augmented Lagrangian pushes with a multiplier that is given, and k times what is left of the gap.
!> Source: docs/theory.md, eqs. (20a) to (20d).
module emcon_soft_law
   use emcon_kinds, only : wp
   implicit none
   private
   public :: soft_t, soft_follow, soft_penalty, soft_augmented, soft_energy

   !> One condition that gives way.
   type :: soft_t
      real(wp) :: stiffness = 0.0_wp             !! k [M/T^2]; 0: it does not give way
      real(wp) :: base = 0.0_wp                  !! multiplier where nothing is left [M L/T^2]
      real(wp) :: slope = 0.0_wp                 !! -d multiplier / d gap at the end, >= 0 [M/T^2]
      real(wp) :: left = 0.0_wp                  !! of the gap to the target, at the end [L]
      real(wp) :: lack = 0.0_wp                  !! what a multiplier on its way lacks [M L/T^2]
      real(wp) :: share = 1.0_wp                 !! that gaps are means over, of its area
      !> Where the step before has left it, <= 0, 0 if it did not push; > 0: where its gap is [L]
      real(wp) :: before = 1.0_wp
      real(wp) :: now = 0.0_wp                   !! where it is at the end [L]
   end type soft_t

contains

   !> Where a penalty begins over a step whose gap goes from `gap0` to `gap1`, by `dgap`, and where
   !> it ends: what is stored goes on from what the step before has left, whatever the gap at its
   !> start is found to be now. What begins closed stores nothing yet. Source: docs/theory.md,
   !> eq. (20f).
   pure subroutine soft_follow(self, gap0, gap1, dgap, start)
      type(soft_t), intent(inout) :: self
      real(wp), intent(in) :: gap0, gap1, dgap   !! counted from the target [L]
      real(wp), intent(out) :: start             !! in place of `gap0` [L]

      start = gap0
      self%now = gap1
      if (self%before > 0.0_wp) return
      if (.not. self%before < 0.0_wp .and. gap0 >= 0.0_wp) return
      start = self%before
      self%now = start + dgap
   end subroutine soft_follow

   !> Multiplier and slope of a penalty over a step whose gap goes from `gap0` to `gap1`, counted
   !> from the target: k times the mean of min(d, 0) times the part of the way that is closed.
   pure subroutine soft_penalty(self, gap0, gap1, lam)
      type(soft_t), intent(inout) :: self
      real(wp), intent(in) :: gap0, gap1         !! [L]
      real(wp), intent(out) :: lam               !! >= 0 [M L/T^2]
      real(wp) :: part

      if (gap0 <= 0.0_wp .and. gap1 <= 0.0_wp) then
         lam = -0.5_wp*self%stiffness*(gap0 + gap1)
         self%slope = 0.5_wp*self%stiffness
      else if (gap0 >= 0.0_wp .and. gap1 >= 0.0_wp) then
         lam = 0.0_wp
         self%slope = 0.0_wp
      else
         part = min(gap0, gap1)/(-abs(gap1 - gap0))
         lam = -0.5_wp*self%stiffness*min(gap0, gap1)*part
         if (gap0 < 0.0_wp) then
            self%slope = 0.5_wp*self%stiffness*part**2
         else
            self%slope = 0.5_wp*self%stiffness*part*(2.0_wp - part)
         end if
      end if
   end subroutine soft_penalty

   !> Multiplier of a push by the `base` and by what is left of the gap.
   pure subroutine soft_augmented(self, lam)
      type(soft_t), intent(inout) :: self
      real(wp), intent(out) :: lam               !! of either sign [M L/T^2]

      lam = self%base - self%stiffness*self%left
      self%slope = self%stiffness
   end subroutine soft_augmented

   !> What a penalty stores at a gap.
   pure real(wp) function soft_energy(self, gap) result(energy)
      type(soft_t), intent(in) :: self
      real(wp), intent(in) :: gap                !! counted from the target [L]

      energy = 0.5_wp*self%stiffness*min(gap, 0.0_wp)**2
   end function soft_energy

end module emcon_soft_law
