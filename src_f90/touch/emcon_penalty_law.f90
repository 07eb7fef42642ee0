!> Laws of contact that gives way: the multiplier is a function of the gap, not an unknown.
!>
!> A penalty of stiffness k stores k/2 min(d, 0)^2 at the gap d. Over a step its force is the
!> discrete gradient of that, so that what it takes is what it stores, or its value at the end. An
!> augmented Lagrangian pushes with a multiplier that is given, and k times what is left of the gap.
!> Source: docs/theory.md, eqs. (20a) to (20f).
module emcon_penalty_law
   use emcon_constraint, only : contact_response_t
   use emcon_contact_law, only : contact_law_t, contact_place_t, contact_values_t
   use emcon_interactions, only : interaction_t
   use emcon_kinds, only : wp
   use emcon_steps, only : method_augmented_lagrange, method_penalty
   implicit none
   private
   public :: penalty_t, augmented_t

   !> A penalty at one condition.
   type, extends(contact_law_t) :: penalty_t
      real(wp) :: stiffness = 0.0_wp             !! k [M/T^2]
      real(wp) :: share = 1.0_wp                 !! that gaps are means over, of its area
      !> Where the step before has left it, <= 0, 0 if it did not push; > 0: where its gap is [L]
      real(wp) :: before = 1.0_wp
      real(wp) :: now = 0.0_wp                   !! where it is at the end [L]
   contains
      procedure :: take => penalty_take
      procedure :: begin => penalty_begin
      procedure :: respond => penalty_respond
      procedure :: push => penalty_push
      procedure :: push_over => penalty_push_over
      procedure :: rub => penalty_rub
      procedure :: stored
      procedure :: stiffest
      procedure :: closure
      procedure :: gives_back
   end type penalty_t

   type, extends(penalty_t) :: augmented_t
      real(wp) :: base = 0.0_wp                  !! multiplier where nothing is left [M L/T^2]
   contains
      procedure :: take => augmented_take
      procedure :: begin => augmented_begin
      procedure :: respond => augmented_respond
      procedure :: push_on
   end type augmented_t

contains

   pure subroutine penalty_take(self, surface, method, acts)
      class(penalty_t), intent(inout) :: self
      type(interaction_t), intent(in) :: surface
      integer, intent(in) :: method              !! of the step, or 0
      logical, intent(out) :: acts               !! the deck asks for it

      acts = method == method_penalty
   end subroutine penalty_take

   pure subroutine augmented_take(self, surface, method, acts)
      class(augmented_t), intent(inout) :: self
      type(interaction_t), intent(in) :: surface
      integer, intent(in) :: method              !! of the step, or 0
      logical, intent(out) :: acts               !! the deck asks for it

      acts = method == method_augmented_lagrange
   end subroutine augmented_take

   pure subroutine penalty_begin(self, place)
      class(penalty_t), intent(inout) :: self
      type(contact_place_t), intent(in) :: place

      self%share = place%share
      self%stiffness = place%stiffness*place%share**2
      self%before = place%closure/place%share
   end subroutine penalty_begin

   !> What a penalty stores is a function of the integral of the gap. What is pushed back is a mean
   !> gap, which gives way to a force as much where a part of the edges is covered.
   pure subroutine augmented_begin(self, place)
      class(augmented_t), intent(inout) :: self
      type(contact_place_t), intent(in) :: place

      call self%penalty_t%begin(place)
      self%stiffness = place%stiffness
   end subroutine augmented_begin

   !> An augmented Lagrangian goes on from the multiplier that has come out.
   pure subroutine push_on(self, lam)
      class(augmented_t), intent(inout) :: self
      real(wp), intent(in) :: lam                !! [M L/T^2]

      self%base = lam
   end subroutine push_on

   !> What is stored goes on from what the step before has left, whatever the gap at its start is
   !> found to be now; what begins closed stores nothing yet. Source: docs/theory.md, eq. (20f).
   pure subroutine penalty_respond(self, at, response)
      class(penalty_t), intent(inout) :: self
      type(contact_values_t), intent(in) :: at
      type(contact_response_t), intent(inout) :: response
      real(wp) :: start

      start = at%gap0
      self%now = at%gap1
      if (.not. at%is_stored) then
         call self%push(at%left, response%lam, response%stiffness(0, 0))
         call self%rub(at, response)
         return
      end if
      if (self%before < 0.0_wp .or. (at%gap0 < 0.0_wp .and. .not. self%before > 0.0_wp)) then
         start = self%before
         self%now = start + at%dgap
      end if
      call self%push_over(start, self%now, response%lam, response%stiffness(0, 0))
      call self%rub(at, response)
   end subroutine penalty_respond

   !> Friction under the push that `response` has; none unless overridden.
   pure subroutine penalty_rub(self, at, response)
      class(penalty_t), intent(inout) :: self
      type(contact_values_t), intent(in) :: at
      type(contact_response_t), intent(inout) :: response
   end subroutine penalty_rub

   !> Push and stiffness where the gap is; where it is open a pull, that what pulls may be let go.
   pure subroutine penalty_push(self, gap, lam, stiffness)
      class(penalty_t), intent(in) :: self
      real(wp), intent(in) :: gap                !! [L]
      real(wp), intent(out) :: lam, stiffness    !! [M L/T^2], [M/T^2]

      lam = -self%stiffness*gap
      stiffness = self%stiffness
   end subroutine penalty_push

   !> k times the mean of min(d, 0) times the part of the way that is closed, and how that falls
   !> with the end of the way.
   pure subroutine penalty_push_over(self, from, to, lam, stiffness)
      class(penalty_t), intent(in) :: self
      real(wp), intent(in) :: from, to           !! of the gap [L]
      real(wp), intent(out) :: lam, stiffness    !! [M L/T^2], [M/T^2]
      real(wp) :: part

      lam = 0.0_wp
      stiffness = 0.0_wp
      if (from <= 0.0_wp .and. to <= 0.0_wp) then
         lam = -0.5_wp*self%stiffness*(from + to)
         stiffness = 0.5_wp*self%stiffness
      else if (.not. (from >= 0.0_wp .and. to >= 0.0_wp)) then
         part = min(from, to)/(-abs(to - from))
         lam = -0.5_wp*self%stiffness*min(from, to)*part
         if (from < 0.0_wp) then
            stiffness = 0.5_wp*self%stiffness*part**2
         else
            stiffness = 0.5_wp*self%stiffness*part*(2.0_wp - part)
         end if
      end if
   end subroutine penalty_push_over

   !> A push by the `base` and by what is left of the gap, of either sign.
   pure subroutine augmented_respond(self, at, response)
      class(augmented_t), intent(inout) :: self
      type(contact_values_t), intent(in) :: at
      type(contact_response_t), intent(inout) :: response

      self%now = at%gap1
      response%lam = self%base - self%stiffness*at%left
      response%stiffness(0, 0) = self%stiffness
   end subroutine augmented_respond

   !> What a penalty stores where the step ends.
   pure real(wp) function stored(self)
      class(penalty_t), intent(in) :: self

      stored = 0.5_wp*self%stiffness*min(self%now, 0.0_wp)**2
   end function stored

   pure real(wp) function stiffest(self)
      class(penalty_t), intent(in) :: self

      stiffest = self%stiffness
   end function stiffest

   !> How far it is closed, times the part of its area that is covered, as that may be another one
   !> in the next step.
   pure real(wp) function closure(self)
      class(penalty_t), intent(in) :: self

      closure = min(self%now, 0.0_wp)*self%share
   end function closure

   pure logical function gives_back(self)
      class(penalty_t), intent(in) :: self

      gives_back = self%before < 0.0_wp
   end function gives_back

end module emcon_penalty_law
