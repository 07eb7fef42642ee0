!> Restitution below 1: of the rate of a gap that an impact has reversed a part is kept, whether it
!> opens or closes.
!> Source: docs/theory.md, eq. (22e).
module emcon_restitution_law
   use emcon_constraint, only : contact_response_t
   use emcon_contact_law, only : contact_law_t, contact_values_t
   use emcon_interactions, only : interaction_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: restitution_t

   type, extends(contact_law_t) :: restitution_t
      real(wp) :: part = 1.0_wp                  !! that is kept, 0 to 1
   contains
      procedure :: take
      procedure :: respond
      procedure :: rate_change
      procedure :: acts_near
   end type restitution_t

contains

   pure subroutine take(self, surface, method, acts)
      class(restitution_t), intent(inout) :: self
      type(interaction_t), intent(in) :: surface
      integer, intent(in) :: method              !! of the step, or 0
      logical, intent(out) :: acts               !! the deck asks for it

      self%part = surface%restitution
      acts = self%part < 1.0_wp
   end subroutine take

   !> It is asked at the end of a step.
   pure logical function acts_near(self)
      class(restitution_t), intent(in) :: self

      acts_near = .false.
   end function acts_near

   !> Over a step there is no force.
   pure subroutine respond(self, at, response)
      class(restitution_t), intent(inout) :: self
      type(contact_values_t), intent(in) :: at
      type(contact_response_t), intent(inout) :: response
   end subroutine respond

   pure real(wp) function rate_change(self, rate)
      class(restitution_t), intent(in) :: self
      real(wp), intent(in) :: rate               !! [L/T]

      rate_change = (self%part - 1.0_wp)*rate
   end function rate_change

end module emcon_restitution_law
