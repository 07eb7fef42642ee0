!> Coulomb's law at one place of contact, and what it makes of a trial. It knows no mechanics.
!>
!> Over a step it takes lam >= 0, g >= 0, lam g = 0 and |tau| <= mu lam, with tau = mu lam where
!> s > 0 and tau = -mu lam where s < 0. With any stiffness c > 0 that is lam = max(0, lam - c g) and
!> tau = clip(tau + c s, -mu lam, mu lam), whose right sides are the trial: where it lies tells in
!> which way the law holds. A slip a that is led to shifts the law: it sticks at a if tau pushes
!> against that slip, at none if it pushes the other way, and is free in between, tau = 0, so that
!> tau s is never negative. Source: docs/theory.md, eqs. (14f), (14g) and (14m).
module emcon_friction_law
   use emcon_kinds, only : wp
   implicit none
   private
   public :: touch_t, friction_trial, friction_violation
   public :: touch_open, touch_sticks, touch_free, touch_rests, slip_rounding

   !> Slip is made of a dozen products of lengths of an edge: by so much of it slip is uncertain.
   real(wp), parameter :: slip_rounding = 16.0_wp*epsilon(1.0_wp)

   !> Ways in which the law holds; where it slides the way is the sign of slip, -1 or 1. It sticks
   !> at the slip that is led to; it is free before that, or rests where it was at the start.
   integer, parameter :: touch_open = 2, touch_sticks = 0, touch_free = 3, touch_rests = 4

   !> Forces and ways at one place.
   type :: touch_t
      real(wp) :: lam = 0.0_wp                   !! push [M L/T^2]
      real(wp) :: tau = 0.0_wp                   !! friction, against slip [M L/T^2]
      real(wp) :: gap = 0.0_wp                   !! g, above the one to hold [L]
      real(wp) :: slip = 0.0_wp                  !! s [L]
      real(wp) :: lead = 0.0_wp                  !! a [L]
      real(wp) :: rounding = 0.0_wp              !! of slip, >= 0 [L]
   end type touch_t

contains

   !> The way in which the law is to hold next. What is undecided by less than `tie`, or than slip
   !> is rounded to, stays as it is: in short steps c makes much of that.
   pure integer function friction_trial(was, at, mu, stiffness, tie) result(next)
      integer, intent(in) :: was                 !! `touch_` or a sign: the way so far
      type(touch_t), intent(in) :: at
      real(wp), intent(in) :: mu                 !! >= 0
      real(wp), intent(in) :: stiffness          !! c > 0 [M/T^2]
      real(wp), intent(in) :: tie                !! >= 0 [M L/T^2]
      real(wp) :: push, drag, most, unsure
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
      unsure = tie + stiffness*at%rounding
      if (abs(at%lead) > 0.0_wp) then
         next = lead_trial(was, drag, most, stiffness*at%lead, unsure)
         return
      end if
      next = touch_sticks
      way = merge(1, -1, drag > 0.0_wp)
      if (abs(drag) > most) next = way
      if (was == touch_sticks .and. abs(abs(drag) - most) <= unsure) next = was
      if (abs(was) == 1 .and. abs(drag - was*most) <= unsure) next = was
   end function friction_trial

   !> The same of what is led to a slip: five ways in a row, from slide to slide. What does not hold
   !> its slip holds it first, on the way to others: bodies that stop as a whole are softer than c.
   pure integer function lead_trial(was, drag, most, lead, tie) result(next)
      integer, intent(in) :: was
      real(wp), intent(in) :: drag               !! tau + c s [M L/T^2]
      real(wp), intent(in) :: most               !! mu lam, >= 0 [M L/T^2]
      real(wp), intent(in) :: lead               !! c a, not 0 [M L/T^2]
      real(wp), intent(in) :: tie
      real(wp) :: along, bound(4)
      integer :: way(5), side, k, place

      side = merge(1, -1, lead > 0.0_wp)
      along = side*drag
      bound = [-most, 0.0_wp, abs(lead), abs(lead) + most]
      way = [-side, touch_rests, touch_free, touch_sticks, side]
      place = 1 + count(along > bound)
      if (was == side) place = max(place, 4)
      if (was == touch_free) place = max(2, min(place, 4))
      if (was == -side) place = min(place, 2)
      next = way(place)
      do k = 1, 4
         if (abs(along - bound(k)) <= tie .and. any(was == way(k:k + 1))) next = was
      end do
   end function lead_trial

   !> How far the law is missed, as a force, by more than slip is rounded to.
   pure real(wp) function friction_violation(at, mu, stiffness) result(missed)
      type(touch_t), intent(in) :: at
      real(wp), intent(in) :: mu, stiffness      !! as in `friction_trial`
      real(wp) :: most, along, drag

      most = mu*max(0.0_wp, at%lam)
      along = sign(1.0_wp, at%lead)*(at%tau + stiffness*at%slip)
      drag = max(0.0_wp, min(most, along - stiffness*abs(at%lead))) &
         + min(0.0_wp, max(-most, along))
      missed = max(abs(at%lam - max(0.0_wp, at%lam - stiffness*at%gap)), &
         abs(at%tau - sign(1.0_wp, at%lead)*drag) - stiffness*at%rounding)
   end function friction_violation

end module emcon_friction_law
