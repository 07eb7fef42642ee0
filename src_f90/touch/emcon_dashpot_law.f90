!> Viscous damping between surfaces: a law of contact.
!>
!> The pressure is mu(g) times the rate at which the gap g changes, mu a given value up to a part of
!> a clearance, from there on falling linearly to 0 at the clearance. Over a step it is the mean of
!> mu over the way of the gap: the impulse is then a function of where the gap begins and ends, and
!> the work is never positive. Slip is pushed against by a part of that coefficient. Source:
!> docs/theory.md, eqs. (14n) to (14q).
module emcon_dashpot_law
   use emcon_constraint, only : contact_response_t
   use emcon_contact_law, only : contact_law_t, contact_place_t, contact_values_t
   use emcon_interactions, only : contact_damping_t, interaction_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: dashpot_t, dashpot_at, dashpot_mean, dashpot_mean_slope

   !> The law at one condition.
   type, extends(contact_law_t) :: dashpot_t
      type(contact_damping_t) :: coefficients
      real(wp) :: area = 0.0_wp                  !! A of its node [L^2]
      real(wp) :: gap = 0.0_wp                   !! mean gap as the step begins [L]
      logical :: is_closed = .false.             !! contact holds it: it slides by the whole mu
   contains
      procedure :: take => dashpot_take
      procedure :: begin => dashpot_begin
      procedure :: respond => dashpot_respond
      procedure :: dissipated => dashpot_dissipated
   end type dashpot_t

contains

   pure subroutine dashpot_take(self, surface, method, acts)
      class(dashpot_t), intent(inout) :: self
      type(interaction_t), intent(in) :: surface
      integer, intent(in) :: method              !! of the step, or 0
      logical, intent(out) :: acts               !! the deck asks for it

      self%coefficients = surface%damping
      self%reach = surface%damping%clearance
      self%has_friction = surface%damping%tangent > 0.0_wp
      acts = self%coefficients%coefficient > 0.0_wp
   end subroutine dashpot_take

   pure subroutine dashpot_begin(self, place)
      class(dashpot_t), intent(inout) :: self
      type(contact_place_t), intent(in) :: place

      self%area = place%share*place%area
      self%gap = place%gap
      self%is_closed = place%is_closed
   end subroutine dashpot_begin

   !> Push and drag of a condition, docs/theory.md, eqs. (14o) and (14p).
   pure subroutine dashpot_respond(self, at, response)
      class(dashpot_t), intent(inout) :: self
      type(contact_values_t), intent(in) :: at
      type(contact_response_t), intent(inout) :: response
      real(wp) :: by_mu, mean
      integer :: s

      associate (law => self%coefficients, gap => self%gap, dgap => at%dgap)
         by_mu = self%area*at%frequency
         mean = dashpot_mean(law, gap, dgap)
         response%lam = -by_mu*mean*dgap
         response%stiffness(0, 0) = by_mu*dashpot_at(law, gap + dgap)
         if (.not. law%tangent > 0.0_wp) return
         if (self%is_closed) mean = law%coefficient
         do s = 1, size(at%slip)
            response%stiffness(s, s) = law%tangent*by_mu*mean
            if (.not. self%is_closed) response%stiffness(s, 0) = law%tangent*by_mu &
               *dashpot_mean_slope(law, gap, dgap)*at%slip(s)
            response%tau(s) = response%stiffness(s, s)*at%slip(s)
         end do
      end associate
   end subroutine dashpot_respond

   !> What the forces take, >= 0.
   pure real(wp) function dashpot_dissipated(self, at, response) result(dissipated)
      class(dashpot_t), intent(in) :: self
      type(contact_values_t), intent(in) :: at
      type(contact_response_t), intent(in) :: response

      dissipated = -response%lam*at%dgap + dot_product(response%tau, at%slip)
   end function dashpot_dissipated

   !> mu at the gap `gap`.
   pure real(wp) function dashpot_at(law, gap) result(mu)
      type(contact_damping_t), intent(in) :: law
      real(wp), intent(in) :: gap                !! [L]

      if (gap <= law%flat*law%clearance) then
         mu = law%coefficient
      else if (gap < law%clearance) then
         mu = law%coefficient*((law%clearance - gap)/((1.0_wp - law%flat)*law%clearance))
      else
         mu = 0.0_wp
      end if
   end function dashpot_at

   !> The mean of mu over the way from `gap` by `way`, >= 0; its derivative by the end of the way,
   !> times the way, is mu there less it.
   pure real(wp) function dashpot_mean(law, gap, dgap) result(mean)
      type(contact_damping_t), intent(in) :: law
      real(wp), intent(in) :: gap, dgap          !! [L]
      real(wp) :: low, high, from, to

      low = min(gap, gap + dgap)
      high = max(gap, gap + dgap)
      if (.not. high > low) then
         mean = dashpot_at(law, gap)
         return
      end if
      call falling_part(law, low, high, from, to)
      mean = law%coefficient*((from - low)/(high - low)) &
         + 0.5_wp*(dashpot_at(law, from) + dashpot_at(law, to))*((to - from)/(high - low))
   end function dashpot_mean

   !> The derivative of the mean by the end of the way: that of mu, weighted by the part of the way.
   pure real(wp) function dashpot_mean_slope(law, gap, dgap) result(slope)
      type(contact_damping_t), intent(in) :: law
      real(wp), intent(in) :: gap, dgap          !! [L]
      real(wp) :: from, to, part_from, part_to

      slope = 0.0_wp
      if (.not. law%clearance > 0.0_wp) then
         if (passes(0.0_wp)) slope = -law%coefficient*(abs(gap)/dgap**2)
         return
      end if
      if (.not. law%flat < 1.0_wp) then
         if (passes(law%clearance)) slope = -law%coefficient*(abs(law%clearance - gap)/dgap**2)
         return
      end if
      if (.not. abs(dgap) > 0.0_wp) then
         if (gap > law%flat*law%clearance .and. gap < law%clearance) slope = &
            -0.5_wp*law%coefficient/((1.0_wp - law%flat)*law%clearance)
         return
      end if
      call falling_part(law, min(gap, gap + dgap), max(gap, gap + dgap), from, to)
      part_from = min(1.0_wp, max(0.0_wp, (from - gap)/dgap))
      part_to = min(1.0_wp, max(0.0_wp, (to - gap)/dgap))
      slope = -0.5_wp*abs(part_to - part_from)*(part_from + part_to)*law%coefficient &
         /((1.0_wp - law%flat)*law%clearance)

   contains

      !> Does the way lead over `place`, where mu falls at once?
      pure logical function passes(place)
         real(wp), intent(in) :: place

         passes = (gap < place .neqv. gap + dgap < place) .and. abs(dgap) > 0.0_wp
      end function passes

   end function dashpot_mean_slope

   !> The part of the way from `low` up to `high` on which mu falls, or is 0 from `to` on.
   pure subroutine falling_part(law, low, high, from, to)
      type(contact_damping_t), intent(in) :: law
      real(wp), intent(in) :: low, high          !! low < high [L]
      real(wp), intent(out) :: from, to          !! low <= from <= to <= high [L]

      from = min(high, max(low, law%flat*law%clearance))
      to = min(high, max(from, law%clearance))
   end subroutine falling_part

end module emcon_dashpot_law
