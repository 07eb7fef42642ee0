!> Coulomb's law at one place of contact, and what it makes of a trial. It knows no mechanics.
!>
!> Over a step it takes lam >= 0, g >= 0, lam g = 0 and |tau| <= mu lam, with tau = mu lam where
!> s > 0 and tau = -mu lam where s < 0. With any stiffness c > 0 that is lam = max(0, lam - c g) and
!> tau = clip(tau + c s, -mu lam, mu lam), whose right sides are the trial: where it lies tells in
!> which way the law holds. Source: docs/theory.md, eqs. (14f) and (14g).
module emcon_friction_law
   use emcon_kinds, only : wp
   implicit none
   private
   public :: touch_t, friction_trial, friction_violation
   public :: touch_open, touch_sticks

   !> Ways in which the law holds; where it slides the way is the sign of slip, -1 or 1.
   integer, parameter :: touch_open = 2, touch_sticks = 0

   !> Forces and ways at one place.
   type :: touch_t
      real(wp) :: lam = 0.0_wp                   !! push [M L/T^2]
      real(wp) :: tau = 0.0_wp                   !! friction, against slip [M L/T^2]
      real(wp) :: gap = 0.0_wp                   !! g, above the one to hold [L]
      real(wp) :: slip = 0.0_wp                  !! s [L]
   end type touch_t

contains

   !> The way in which the law is to hold next. What is undecided by less than `tie` stays as it is.
   pure integer function friction_trial(was, at, mu, stiffness, tie) result(next)
      integer, intent(in) :: was                 !! `touch_` or a sign: the way so far
      type(touch_t), intent(in) :: at
      real(wp), intent(in) :: mu                 !! >= 0
      real(wp), intent(in) :: stiffness          !! c > 0 [M/T^2]
      real(wp), intent(in) :: tie                !! >= 0 [M L/T^2]
      real(wp) :: push, drag, most
      integer :: way

      next = touch_open
      push = at%lam - stiffness*at%gap
      if (abs(push) <= tie) then
         if (was == touch_open) return
      else if (push <= 0.0_wp) then
         return
      end if
      drag = at%tau + stiffness*at%slip
      most = mu*max(0.0_wp, push)
      next = touch_sticks
      way = merge(1, -1, drag > 0.0_wp)
      if (abs(drag) > most) next = way
      if (abs(abs(drag) - most) <= tie .and. (was == touch_sticks .or. was == way)) next = was
   end function friction_trial

   !> How far the law is missed, as a force.
   pure real(wp) function friction_violation(at, mu, stiffness) result(missed)
      type(touch_t), intent(in) :: at
      real(wp), intent(in) :: mu, stiffness      !! as in `friction_trial`
      real(wp) :: most

      most = mu*max(0.0_wp, at%lam)
      missed = max(abs(at%lam - max(0.0_wp, at%lam - stiffness*at%gap)), &
         abs(at%tau - max(-most, min(most, at%tau + stiffness*at%slip))))
   end function friction_violation

end module emcon_friction_law
