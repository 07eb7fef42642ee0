!> Contact that gives way to a pressure k d^2 at the depth d, from outside: it stores k A/3 d^3.
!>
!> Over a step the multiplier is the discrete gradient of that, so that no energy is made, and what
!> belongs to the end in statics.
module cubic_contact
   use emcon_api, only : contact_law_t, contact_place_t, contact_response_t, contact_values_t, wp
   implicit none
   private
   public :: cubic_contact_t

   type, extends(contact_law_t) :: cubic_contact_t
      real(wp) :: by_area = 0.0_wp               !! k [M/(L^3 T^2)]
      type(contact_place_t) :: place
      real(wp) :: now = 0.0_wp                   !! gap at the end, by the whole area [L]
   contains
      procedure :: begin
      procedure :: respond
      procedure :: stored
      procedure :: closure
      procedure :: gives_back
   end type cubic_contact_t

contains

   pure subroutine begin(self, place)
      class(cubic_contact_t), intent(inout) :: self
      type(contact_place_t), intent(in) :: place

      self%place = place
   end subroutine begin

   pure subroutine respond(self, at, response)
      class(cubic_contact_t), intent(inout) :: self
      type(contact_values_t), intent(in) :: at
      type(contact_response_t), intent(inout) :: response
      real(wp) :: start, way, y0, y1

      associate (k => self%by_area*self%place%area, share => self%place%share)
         start = share*at%gap0
         way = share*at%dgap
         ! What is stored goes on from where the step before has left it.
         if (self%gives_back() .or. (start < 0.0_wp .and. self%place%closure <= 0.0_wp)) start = &
            self%place%closure
         self%now = start + way
         if (.not. at%is_stored) self%now = share*at%left
         y0 = min(start, 0.0_wp)
         y1 = min(self%now, 0.0_wp)
         if (.not. at%is_stored) then
            response%lam = k*share*y1**2
            response%stiffness(0, 0) = -2.0_wp*k*share**2*y1
         else if (y0 < 0.0_wp .and. y1 < 0.0_wp) then
            response%lam = k*share*(y0**2 + y0*y1 + y1**2)/3.0_wp
            response%stiffness(0, 0) = -k*share**2*(y0 + 2.0_wp*y1)/3.0_wp
         else if (min(y0, y1) < 0.0_wp) then
            response%lam = k*share*(y1**3 - y0**3)/(3.0_wp*way)
            response%stiffness(0, 0) = (share*response%lam - k*share**2*y1**2)/way
         end if
      end associate
   end subroutine respond

   pure real(wp) function stored(self)
      class(cubic_contact_t), intent(in) :: self

      stored = -self%by_area*self%place%area/3.0_wp*min(self%now, 0.0_wp)**3
   end function stored

   pure real(wp) function closure(self)
      class(cubic_contact_t), intent(in) :: self

      closure = min(self%now, 0.0_wp)
   end function closure

   pure logical function gives_back(self)
      class(cubic_contact_t), intent(in) :: self

      gives_back = self%place%closure < 0.0_wp
   end function gives_back

end module cubic_contact
