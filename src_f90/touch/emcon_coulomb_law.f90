!> Coulomb's law at one place of contact, and what it makes of a trial: vectors of one slip or two.
!>
!> Over a step it takes lam >= 0, g >= 0, lam g = 0 and |tau| <= mu lam, with tau = mu lam s/|s|
!> where it slides. A slip a that is led to shifts that: tau is mu lam times the gradient of the
!> distance of s from the segment from 0 to a, so that tau . s is never negative. With any stiffness
!> c > 0 it is the same as lam = max(0, n), and tau = p less its nearest point on the segment from 0
!> to c a, cut to the length mu lam; n = lam - c g and p = tau + c s are the trial. Where these lie
!> tells in which way the law holds. Source: docs/theory.md, eqs. (14f), (14g) and (14m).
module emcon_coulomb_law
   use emcon_constraint, only : contact_response_t, most_slips
   use emcon_contact_law, only : contact_law_t, contact_values_t, loss_friction
   use emcon_interactions, only : interaction_t, pressure_hard
   use emcon_kinds, only : wp
   implicit none
   private
   public :: coulomb_t, contact_trial_t, slip_status_t, coulomb_map, &
      coulomb_status, coulomb_violation
   public :: contact_open, contact_sticks, contact_slides, contact_free, contact_rests, &
      slip_rounding, has_way

   !> Slip is made of a dozen products of lengths of an edge: by so much of it slip is uncertain.
   real(wp), parameter :: slip_rounding = 16.0_wp*epsilon(1.0_wp)

   !> Slip has a way that forces can be found by above so many times what it is rounded to.
   real(wp), parameter :: has_way = 1.0e3_wp*slip_rounding

   !> Ways in which the law holds. It sticks at the slip that is led to, is free along the way to
   !> that, or rests where it was at the start.
   integer, parameter :: contact_open = 2, contact_sticks = 0, contact_slides = 1, &
      contact_free = 3, contact_rests = 4

   type :: slip_status_t
      integer :: kind = contact_sticks
      real(wp) :: direction(most_slips) = 0.0_wp     !! of slip, of length 1; 0: it does not slide
   end type slip_status_t

   !> Forces, gap and slips at one place. Entries past its slips are 0.
   type :: contact_trial_t
      real(wp) :: lam = 0.0_wp                       !! push [M L/T^2]
      real(wp) :: gap = 0.0_wp                       !! g, above the one to hold [L]
      real(wp) :: tau(most_slips) = 0.0_wp           !! friction, against slip [M L/T^2]
      real(wp) :: slip(most_slips) = 0.0_wp          !! s [L]
      real(wp) :: slip_target(most_slips) = 0.0_wp   !! a [L]
      real(wp) :: rounding = 0.0_wp                  !! of slip, >= 0 [L]
   end type contact_trial_t

   !> The law at one condition.
   type, extends(contact_law_t) :: coulomb_t
      real(wp) :: mu = 0.0_wp                        !! >= 0
      real(wp), allocatable :: mu_of_step(:)         !! (n_step) not allocated: one for all
      real(wp) :: restitution = 0.0_wp               !! along the surface, of what sticks, 0 to 1
      type(slip_status_t) :: status
      logical :: turns = .false.                     !! slip has two components: its way turns
      real(wp) :: slip_target(most_slips) = 0.0_wp   !! a [L]
      real(wp) :: slip_to_stop(most_slips) = 0.0_wp  !! the same, also below what slip is rounded to
   contains
      procedure :: take => coulomb_take
      procedure :: suit => coulomb_suit
      procedure :: respond => coulomb_respond
      procedure :: dissipated => coulomb_dissipated
      procedure :: acts_near => coulomb_acts_near
      procedure :: holds_slip
      procedure :: slip_held
      procedure :: leads_to
   end type coulomb_t

   !> What the trial p leaves over its nearest point on the segment from 0 to c a.
   type :: remainder_t
      real(wp) :: part = 1.0_wp                      !! where that lies, of the way to c a
      real(wp) :: length = 0.0_wp                    !! |c a|; 0: the segment is a point
      real(wp) :: along(most_slips) = 0.0_wp         !! a/|a|
      real(wp) :: over(most_slips) = 0.0_wp          !! p less the nearest point [M L/T^2]
   end type remainder_t

contains

   pure subroutine coulomb_take(self, surface, method, acts)
      class(coulomb_t), intent(inout) :: self
      type(interaction_t), intent(in) :: surface
      integer, intent(in) :: method              !! of the step, or 0
      logical, intent(out) :: acts               !! the deck asks for it

      self%mu = surface%friction
      if (allocated(surface%friction_of_step)) self%mu_of_step = surface%friction_of_step
      self%restitution = surface%rebound
      self%has_friction = .true.
      self%loss = loss_friction
      acts = self%mu > 0.0_wp .and. surface%pressure%kind == pressure_hard
   end subroutine coulomb_take

   !> Its coefficient there.
   pure subroutine coulomb_suit(self, i_step)
      class(coulomb_t), intent(inout) :: self
      integer, intent(in) :: i_step              !! of the deck

      if (allocated(self%mu_of_step)) self%mu = self%mu_of_step(i_step)
   end subroutine coulomb_suit

   !> It is asked with the row of its condition.
   pure logical function coulomb_acts_near(self) result(acts_near)
      class(coulomb_t), intent(in) :: self

      acts_near = .false.
   end function coulomb_acts_near

   !> Where it slides friction is a part of the push, against the slip as it goes: what goes against
   !> the way that it had is about to stop, and keeps that. What sticks is for rows of slips.
   pure subroutine coulomb_respond(self, at, response)
      class(coulomb_t), intent(inout) :: self
      type(contact_values_t), intent(in) :: at
      type(contact_response_t), intent(inout) :: response

      type(remainder_t) :: rest
      real(wp) :: size, drag, direction(most_slips), across(most_slips, most_slips)
      integer :: s

      response%mu_sigma = self%mu*self%status%direction
      if (.not. self%turns .or. self%status%kind /= contact_slides) return
      rest = remainder_of(at%slip, self%slip_target)
      size = norm2(rest%over)
      if (size <= has_way*at%size .or. dot_product(rest%over, self%status%direction) <= 0.0_wp) then
         return
      end if
      direction = rest%over/size
      ! Below 0 where what is to be let go pulls.
      drag = sign(norm2(at%friction), dot_product(at%friction, self%status%direction))
      self%status%direction = direction
      response%mu_sigma = self%mu*direction
      across = across_of(rest)
      do s = 1, most_slips
         response%stiffness(1:, s) = drag/size*(across(:, s) &
            - dot_product(direction, across(:, s))*direction)
      end do
   end subroutine coulomb_respond

   pure real(wp) function coulomb_dissipated(self, at, response) result(dissipated)
      class(coulomb_t), intent(in) :: self
      type(contact_values_t), intent(in) :: at
      type(contact_response_t), intent(in) :: response

      dissipated = dot_product(at%friction, at%slip)
   end function coulomb_dissipated

   !> Are rows to hold the slips?
   pure logical function holds_slip(self)
      class(coulomb_t), intent(in) :: self

      holds_slip = any(self%status%kind == [contact_sticks, contact_rests])
   end function holds_slip

   !> The slip at which they would [L].
   pure function slip_held(self) result(slip)
      class(coulomb_t), intent(in) :: self
      real(wp) :: slip(most_slips)

      slip = self%slip_target
      if (self%status%kind == contact_rests) slip = 0.0_wp
   end function slip_held

   !> Count slip from `slip`, with which the velocity along the surface ends, less what a
   !> restitution gives back. What slip is rounded to leads nowhere.
   pure subroutine leads_to(self, slip, rounding)
      class(coulomb_t), intent(inout) :: self
      real(wp), intent(in) :: slip(:)                !! (n_dim - 1) [L]
      real(wp), intent(in) :: rounding               !! [L]

      self%slip_target = 0.0_wp
      self%slip_target(:size(slip)) = (1.0_wp - self%restitution)*slip
      self%slip_to_stop = self%slip_target
      if (norm2(self%slip_target) <= rounding) self%slip_target = 0.0_wp
   end subroutine leads_to

   !> How the law holds where it does.
   pure type(slip_status_t) function coulomb_status(at, mu, stiffness) result(status)
      type(contact_trial_t), intent(in) :: at
      real(wp), intent(in) :: mu                     !! >= 0
      real(wp), intent(in) :: stiffness              !! c > 0 [M/T^2]

      status = slip_status_t(contact_open)
      if (.not. at%lam - stiffness*at%gap > 0.0_wp) return
      status = status_of(remainder_of(at%tau + stiffness*at%slip, stiffness*at%slip_target), &
         mu*(at%lam - stiffness*at%gap))
   end function coulomb_status

   !> How the law holds where the trial leaves `rest`.
   pure type(slip_status_t) function status_of(rest, most) result(status)
      type(remainder_t), intent(in) :: rest
      real(wp), intent(in) :: most                   !! mu lam, >= 0 [M L/T^2]

      status%kind = contact_rests
      if (rest%part > 0.0_wp) status%kind = contact_free
      if (.not. rest%part < 1.0_wp) status%kind = contact_sticks
      if (norm2(rest%over) > most) status = slip_status_t(contact_slides, &
         rest%over/norm2(rest%over))
   end function status_of

   !> What a trial leaves over a segment from 0.
   pure type(remainder_t) function remainder_of(drag, tip) result(rest)
      real(wp), intent(in) :: drag(most_slips)       !! p [M L/T^2]
      real(wp), intent(in) :: tip(most_slips)        !! c a [M L/T^2]
      real(wp) :: along

      rest%length = norm2(tip)
      rest%over = drag
      if (.not. rest%length > 0.0_wp) return
      rest%along = tip/rest%length
      along = dot_product(drag, rest%along)
      if (along > rest%length) then
         rest%over = drag - tip
      else
         rest%part = max(0.0_wp, along/rest%length)
         if (along > 0.0_wp) rest%over = drag - along*rest%along
      end if
   end function remainder_of

   !> What is left grows by with the trial: the nearest point moves along inside the segment alone.
   pure function across_of(rest) result(across)
      type(remainder_t), intent(in) :: rest
      real(wp) :: across(most_slips, most_slips)
      integer :: s

      across = 0.0_wp
      do s = 1, most_slips
         across(s, s) = 1.0_wp
         if (rest%part > 0.0_wp .and. rest%part < 1.0_wp) across(:, s) = across(:, s) &
            - rest%along(s)*rest%along
      end do
   end function across_of

   !> The natural map, whose fixed points obey the law: the push (0) and the friction that a trial
   !> (n, p) stands for, and their derivatives (row, by) by that: with the gap they fall by c times
   !> those, with slips they grow. At kinks the derivative is that of one side.
   pure subroutine coulomb_map(at, mu, stiffness, force, slope)
      type(contact_trial_t), intent(in) :: at
      real(wp), intent(in) :: mu, stiffness          !! as in `coulomb_status`
      real(wp), intent(out) :: force(0:most_slips)   !! [M L/T^2]
      real(wp), intent(out) :: slope(0:most_slips, 0:most_slips)   !! (row, by)
      type(remainder_t) :: rest
      real(wp) :: most, size, direction(most_slips)
      integer :: s

      slope = 0.0_wp
      force = 0.0_wp
      force(0) = max(0.0_wp, at%lam - stiffness*at%gap)
      if (.not. force(0) > 0.0_wp) return
      slope(0, 0) = 1.0_wp
      rest = remainder_of(at%tau + stiffness*at%slip, stiffness*at%slip_target)
      most = mu*force(0)
      size = norm2(rest%over)
      force(1:) = rest%over
      slope(1:, 1:) = across_of(rest)
      if (size <= most) return
      direction = rest%over/size
      force(1:) = most*direction
      slope(1:, 0) = mu*direction
      do s = 1, most_slips
         slope(1:, s) = (most/size)*slope(1:, s) - (most/size)*dot_product(direction, &
            slope(1:, s))*direction
      end do
   end subroutine coulomb_map

   !> How far the law is missed, as a force, by more than slip is rounded to.
   pure real(wp) function coulomb_violation(at, mu, stiffness) result(missed)
      type(contact_trial_t), intent(in) :: at
      real(wp), intent(in) :: mu, stiffness          !! as in `coulomb_status`
      type(contact_trial_t) :: pushed
      real(wp) :: force(0:most_slips), slope(0:most_slips, 0:most_slips)

      ! Friction by the push that there is.
      pushed = at
      pushed%gap = 0.0_wp
      call coulomb_map(pushed, mu, stiffness, force, slope)
      missed = max(abs(at%lam - max(0.0_wp, at%lam - stiffness*at%gap)), &
         norm2(at%tau - force(1:)) - stiffness*at%rounding)
   end function coulomb_violation

end module emcon_coulomb_law
