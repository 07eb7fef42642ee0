!> Pressures by the deck's word as functions of the overclosure: laws of contact that gives way.
!>
!> A curve p(o) of *SURFACE BEHAVIOR stores W, the integral of p, per area; o = -g of the gap g.
!> From the gap on at which it begins to push it is a penalty with that potential: over a step its
!> force is the mean of p over the way. With *FRICTION slip stretches a spring, up to the
!> coefficient times the push. Source: docs/theory.md, eqs. (20f) and (20k) to (20n).
module emcon_pressure_law
   use emcon_constraint, only : contact_response_t, most_slips
   use emcon_contact_law, only : contact_place_t, contact_values_t, loss_friction
   use emcon_dgrad_series, only : sinh_ratio
   use emcon_elastic_slip, only : elastic_slip_at_end, elastic_slip_open, elastic_slip_over, &
      elastic_slip_t
   use emcon_interactions, only : interaction_t, pressure_exponential, pressure_hard, &
      pressure_linear, pressure_reach, pressure_t, pressure_tabular
   use emcon_kinds, only : wp
   use emcon_penalty_law, only : penalty_t
   implicit none
   private
   public :: pressure_law_t, pressure_at, pressure_mean, pressure_stored

   real(wp), parameter :: pi = acos(-1.0_wp)
   !> At zero gap an exponential has the pressure p0, at c0 so much of it.
   real(wp), parameter :: at_clearance = 0.01_wp
   !> Exponents above this are taken for it: a motion that Newton's method tries.
   real(wp), parameter :: steepest = 80.0_wp
   !> Of ways shorter than this part of what a smooth curve bends over the mean is by quadrature.
   real(wp), parameter :: short = 0.25_wp
   !> Gauss points on (-1, 1) and weights with the sum 1.
   real(wp), parameter :: place(5) = [-0.906179845938663992797626878299_wp, &
      -0.538469310105683091036314420700_wp, 0.0_wp, 0.538469310105683091036314420700_wp, &
      0.906179845938663992797626878299_wp]
   real(wp), parameter :: weight(5) = 0.5_wp*[0.236926885056189087514264040720_wp, &
      0.478628670499366468041291514836_wp, 0.568888888888888888888888888889_wp, &
      0.478628670499366468041291514836_wp, 0.236926885056189087514264040720_wp]

   type, extends(penalty_t) :: pressure_law_t
      type(pressure_t) :: curve
      real(wp) :: area = 0.0_wp                  !! of the condition [L^2]
      real(wp) :: mu = 0.0_wp                    !! of friction, 0: none
      real(wp) :: stick = 0.0_wp                 !! slope of that, shear by slip [M/(L^2 T^2)]
      type(elastic_slip_t) :: before_slip, spring   !! as a step begins, and after it
   contains
      procedure :: take => pressure_take
      procedure :: begin => pressure_begin
      procedure :: push => pressure_push
      procedure :: push_over => pressure_push_over
      procedure :: rub => pressure_rub
      procedure :: stored => pressure_law_stored
      procedure :: dissipated => pressure_dissipated
      procedure :: stretch => pressure_stretch
      procedure :: gained => pressure_gained
      procedure :: stiffest => pressure_stiffest
   end type pressure_law_t

contains

   !> It acts in steps whose contact gives way, in place of the penalty.
   pure subroutine pressure_take(self, surface, method, acts)
      class(pressure_law_t), intent(inout) :: self
      type(interaction_t), intent(in) :: surface
      integer, intent(in) :: method              !! of the step, or 0
      logical, intent(out) :: acts               !! the deck asks for it

      self%curve = surface%pressure
      self%reach = pressure_reach(surface%pressure)
      self%mu = surface%friction
      self%stick = surface%stick
      self%has_friction = min(self%mu, self%stick) > 0.0_wp
      self%loss = loss_friction
      acts = method /= 0 .and. self%curve%kind /= pressure_hard
   end subroutine pressure_take

   pure subroutine pressure_begin(self, place)
      class(pressure_law_t), intent(inout) :: self
      type(contact_place_t), intent(in) :: place

      call self%penalty_t%begin(place)
      self%area = place%area
      self%now = min(self%before, 0.0_wp)
      self%before_slip%stretch = place%stretch/place%share
      self%spring = self%before_slip
   end subroutine pressure_begin

   !> Push and stiffness where the gap is; beyond the end of its reach a pull, that what pulls may
   !> be let go.
   pure subroutine pressure_push(self, gap, lam, stiffness)
      class(pressure_law_t), intent(in) :: self
      real(wp), intent(in) :: gap                !! from where it begins to push [L]
      real(wp), intent(out) :: lam, stiffness    !! [M L/T^2], [M/T^2]
      real(wp) :: pressure, slope

      associate (by_area => self%share*self%area)
         call pressure_at(self%curve, -min(self%share*gap, 0.0_wp) - self%reach, pressure, slope)
         lam = by_area*pressure
         stiffness = by_area*self%share*slope
         if (gap > 0.0_wp) lam = -stiffness*gap
      end associate
   end subroutine pressure_push

   !> The mean over a way of the gap, and how it falls with the end of that.
   pure subroutine pressure_push_over(self, from, to, lam, stiffness)
      class(pressure_law_t), intent(in) :: self
      real(wp), intent(in) :: from, to           !! as in `pressure_push` [L]
      real(wp), intent(out) :: lam, stiffness    !! [M L/T^2], [M/T^2]
      real(wp) :: mean, rate

      call pressure_mean(self%curve, -self%share*from - self%reach, -self%share*to - self%reach, &
         mean, rate)
      lam = self%share*self%area*mean
      stiffness = self%share**2*self%area*rate
   end subroutine pressure_push_over

   pure real(wp) function pressure_law_stored(self) result(stored)
      class(pressure_law_t), intent(in) :: self

      stored = self%area*pressure_stored(self%curve, -self%share*self%now - self%reach) &
         + 0.5_wp*spring_stiffness(self)*sum(self%spring%stretch**2)
   end function pressure_law_stored

   !> Drag of the spring, up to the coefficient times the push, and what of it is lost.
   pure subroutine pressure_rub(self, at, response)
      class(pressure_law_t), intent(inout) :: self
      type(contact_values_t), intent(in) :: at
      type(contact_response_t), intent(inout) :: response
      real(wp) :: limit

      if (.not. self%has_friction) return
      self%spring = self%before_slip
      associate (spring => self%spring, stiffness => spring_stiffness(self))
         limit = self%mu*max(0.0_wp, response%lam)/stiffness
         if (at%is_stored) then
            call elastic_slip_over(spring, limit, at%slip)
            if (.not. self%now < 0.0_wp) call elastic_slip_open(spring)
         else
            call elastic_slip_at_end(spring, limit, at%slip)
         end if
         response%tau = stiffness*spring%drag
         response%stiffness(1:, 1:) = stiffness*spring%by_slip
         if (limit > 0.0_wp) response%stiffness(1:, 0) = &
            -self%mu*spring%by_limit*response%stiffness(0, 0)
      end associate
   end subroutine pressure_rub

   !> Of the spring: what it stores is a function of the slip over the whole area, as of gaps
   !> [M/T^2].
   pure real(wp) function spring_stiffness(self)
      class(pressure_law_t), intent(in) :: self

      spring_stiffness = self%stick*self%area*self%share**2
   end function spring_stiffness

   pure real(wp) function pressure_dissipated(self, at, response) result(dissipated)
      class(pressure_law_t), intent(in) :: self
      type(contact_values_t), intent(in) :: at
      type(contact_response_t), intent(in) :: response

      dissipated = spring_stiffness(self)*self%spring%loss
   end function pressure_dissipated

   pure real(wp) function pressure_gained(self) result(gained)
      class(pressure_law_t), intent(in) :: self

      gained = 0.5_wp*spring_stiffness(self)*(sum(self%spring%stretch**2) &
         - sum(self%before_slip%stretch**2))
   end function pressure_gained

   pure function pressure_stretch(self) result(stretch)
      class(pressure_law_t), intent(in) :: self
      real(wp) :: stretch(most_slips)

      stretch = self%share*self%spring%stretch
   end function pressure_stretch

   pure real(wp) function pressure_stiffest(self) result(stiffest)
      class(pressure_law_t), intent(in) :: self
      real(wp) :: lam

      select case (self%curve%kind)
      case (pressure_tabular)
         associate (p => self%curve%pressure, o => self%curve%overclosure, &
               n => size(self%curve%pressure))
            stiffest = self%share**2*self%area*maxval((p(2:) - p(:n - 1))/(o(2:) - o(:n - 1)))
         end associate
      case (pressure_linear)
         stiffest = self%share**2*self%area*self%curve%slope
      case default
         call self%push(min(self%now, 0.0_wp), lam, stiffest)
      end select
   end function pressure_stiffest

   !> p and dp/do at an overclosure; from the start of the curve on, 0 before.
   pure subroutine pressure_at(curve, over, pressure, slope)
      type(pressure_t), intent(in) :: curve
      real(wp), intent(in) :: over               !! [L]
      real(wp), intent(out) :: pressure          !! [M/(L T^2)]
      real(wp), intent(out) :: slope             !! [M/(L^2 T^2)]
      real(wp) :: turn
      integer :: k

      pressure = 0.0_wp
      slope = 0.0_wp
      if (over < -pressure_reach(curve)) return
      select case (curve%kind)
      case (pressure_linear)
         slope = curve%slope
         if (curve%tension > 0.0_wp) then
            turn = over/bend_of(curve)
            slope = curve%slope*(0.5_wp + (atan(turn) + turn/(1.0_wp + turn**2))/pi)
            pressure = curve%slope*over*(0.5_wp + atan(turn)/pi)
         else
            pressure = curve%slope*over
         end if
      case (pressure_exponential)
         pressure = curve%at_touch*exp(min(steepness(curve)*over, steepest))
         slope = steepness(curve)*pressure
      case (pressure_tabular)
         k = segment_of(curve, over)
         slope = (curve%pressure(k + 1) - curve%pressure(k)) &
            /(curve%overclosure(k + 1) - curve%overclosure(k))
         pressure = curve%pressure(k) + slope*(over - curve%overclosure(k))
      end select
   end subroutine pressure_at

   !> W at an overclosure: the area below the curve up to there [M/T^2].
   pure real(wp) function pressure_stored(curve, over) result(stored)
      type(pressure_t), intent(in) :: curve
      real(wp), intent(in) :: over               !! [L]
      real(wp) :: mean, rate

      stored = 0.0_wp
      if (.not. over > -pressure_reach(curve)) return
      if (curve%kind == pressure_linear .and. curve%tension > 0.0_wp) then
         associate (bend => bend_of(curve))
            stored = curve%slope*(0.25_wp*over**2 + (0.5_wp/pi)*((over**2 + bend**2) &
               *atan(over/bend) - bend*over))
         end associate
      else
         call pressure_mean(curve, -pressure_reach(curve), over, mean, rate)
         stored = mean*(over + pressure_reach(curve))
      end if
   end function pressure_stored

   !> The mean of p over a way of the overclosure, of which a part may be before the start of the
   !> curve, and its derivative by the end of the way.
   pure subroutine pressure_mean(curve, from, to, mean, rate)
      type(pressure_t), intent(in) :: curve
      real(wp), intent(in) :: from, to           !! [L]
      real(wp), intent(out) :: mean              !! [M/(L T^2)]
      real(wp), intent(out) :: rate              !! [M/(L^2 T^2)]
      real(wp) :: start, part, pressure, slope

      start = -pressure_reach(curve)
      mean = 0.0_wp
      rate = 0.0_wp
      if (from < start .and. to < start) return
      if (from >= start .and. to >= start) then
         call mean_within(curve, from, to, mean, rate)
         return
      end if
      part = (max(from, to) - start)/abs(to - from)
      call mean_within(curve, start, max(from, to), mean, rate)
      mean = part*mean
      call pressure_at(curve, to, pressure, slope)
      rate = (pressure - mean)/(to - from)
   end subroutine pressure_mean

   !> The same of a way within the curve.
   pure subroutine mean_within(curve, from, to, mean, rate)
      type(pressure_t), intent(in) :: curve
      real(wp), intent(in) :: from, to
      real(wp), intent(out) :: mean, rate
      real(wp) :: ratio, change, pressure, slope

      select case (curve%kind)
      case (pressure_exponential)
         associate (half => 0.5_wp*steepness(curve)*(min(to, steepest/steepness(curve)) - from))
            call sinh_ratio(half, ratio, change)
            call pressure_at(curve, 0.5_wp*(from + min(to, steepest/steepness(curve))), pressure, &
               slope)
            mean = pressure*ratio
            rate = 0.5_wp*slope*(ratio + change)
         end associate
      case (pressure_tabular)
         call mean_of_segments(curve, from, to, mean, rate)
      case default
         if (.not. curve%tension > 0.0_wp) then
            mean = 0.5_wp*curve%slope*(from + to)
            rate = 0.5_wp*curve%slope
         else if (abs(to - from) > short*(bend_of(curve) + min(from, to))) then
            mean = (pressure_stored(curve, to) - pressure_stored(curve, from))/(to - from)
            call pressure_at(curve, to, pressure, slope)
            rate = (pressure - mean)/(to - from)
         else
            call mean_by_points(curve, from, to, mean, rate)
         end if
      end select
   end subroutine mean_within

   !> Of a way that is short, by quadrature.
   pure subroutine mean_by_points(curve, from, to, mean, rate)
      type(pressure_t), intent(in) :: curve
      real(wp), intent(in) :: from, to
      real(wp), intent(out) :: mean, rate
      real(wp) :: pressure, slope
      integer :: k

      mean = 0.0_wp
      rate = 0.0_wp
      do k = 1, size(place)
         call pressure_at(curve, 0.5_wp*((from + to) + place(k)*(to - from)), pressure, slope)
         mean = mean + weight(k)*pressure
         rate = rate + weight(k)*0.5_wp*(1.0_wp + place(k))*slope
      end do
   end subroutine mean_by_points

   !> Of a way over straight segments, each by its part of the way.
   pure subroutine mean_of_segments(curve, from, to, mean, rate)
      type(pressure_t), intent(in) :: curve
      real(wp), intent(in) :: from, to
      real(wp), intent(out) :: mean, rate
      real(wp) :: low, high, pressure, slope, begun, done
      integer :: k, first

      mean = 0.0_wp
      rate = 0.0_wp
      if (.not. abs(to - from) > 0.0_wp) then
         call pressure_at(curve, to, mean, slope)
         rate = 0.5_wp*slope
         return
      end if
      first = segment_of(curve, min(from, to))
      do k = first, segment_of(curve, max(from, to))
         low = min(from, to)
         if (k > first) low = curve%overclosure(k)
         high = max(from, to)
         if (k < size(curve%pressure) - 1) high = min(high, curve%overclosure(k + 1))
         call pressure_at(curve, 0.5_wp*(low + high), pressure, slope)
         mean = mean + pressure*((high - low)/abs(to - from))
         begun = (low - from)/(to - from)
         done = (high - from)/(to - from)
         rate = rate + 0.5_wp*slope*abs(done**2 - begun**2)
      end do
   end subroutine mean_of_segments

   !> The segment of a table that an overclosure is in; the last goes on.
   pure integer function segment_of(curve, over) result(k)
      type(pressure_t), intent(in) :: curve
      real(wp), intent(in) :: over

      do k = 1, size(curve%pressure) - 2
         if (over < curve%overclosure(k + 1)) return
      end do
   end function segment_of

   !> The overclosure over which a linear curve with a tension bends into its line.
   pure real(wp) function bend_of(curve)
      type(pressure_t), intent(in) :: curve

      bend_of = pi*curve%tension/curve%slope
   end function bend_of

   !> The exponent of an exponential by the overclosure.
   pure real(wp) function steepness(curve)
      type(pressure_t), intent(in) :: curve

      steepness = -log(at_clearance)/curve%clearance
   end function steepness

end module emcon_pressure_law
