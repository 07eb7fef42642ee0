!> How much of a correction to take, from what the residual does along it.
!>
!> A correction c from the residual r0 leaves c.r = 0 at its end to first order, c.r0 < 0 being the
!> work at its start. One that begins at rest closes gaps alone: r0 is round-off there, and what it
!> works is c.K c with the tangent K. Where a node passes a kink of a surface on the way, the force
!> turns at once, and c.r is large and > 0 at the end: the state that is looked for is on the way,
!> where it vanishes. Source: docs/theory.md, section 8.
module emcon_line_search
   use emcon_kinds, only : wp
   implicit none
   private
   public :: line_search_t, line_search_work, line_search_begin, line_search_take

   !> Work below this part of that at the start is small.
   real(wp), parameter :: small = 0.5_wp
   !> Where the residual works less than this part of what the tangent does, gaps are closed.
   real(wp), parameter :: of_gaps = 1.0e-2_wp
   !> Places looked at: enough to meet a rounded corner, 1e-4 of an edge, in a way of many edges.
   integer, parameter :: most_places = 24

   type :: line_search_t
      logical :: is_on = .false.
      real(wp) :: step = 0.0_wp                  !! from the last place to the next one
      real(wp) :: start = 0.0_wp                 !! work at the start
      real(wp) :: at = 1.0_wp                    !! the next place: part of the correction
      real(wp) :: low = 0.0_wp, high = 1.0_wp    !! places with work below and above 0
      integer :: n_place = 0
   end type line_search_t

contains

   !> The work of a correction against which that at its end is held.
   pure real(wp) function line_search_work(at_start, by_tangent) result(work)
      real(wp), intent(in) :: at_start           !! c.r0 [F L]
      real(wp), intent(in) :: by_tangent         !! c.K c [F L]

      work = at_start
      if (abs(at_start) <= of_gaps*by_tangent) work = -by_tangent
   end function line_search_work

   !> Begin at the end of a correction, if it went too far.
   pure subroutine line_search_begin(self, at_start, at_end)
      type(line_search_t), intent(out) :: self
      real(wp), intent(in) :: at_start           !! as of `line_search_work` [F L]
      real(wp), intent(in) :: at_end             !! c.r there [F L]

      self%is_on = at_start < 0.0_wp .and. at_end > small*abs(at_start)
      if (.not. self%is_on) return
      self%start = at_start
      call choose(self)
   end subroutine line_search_begin

   !> Go on from the place chosen last, where the work is `work`; the search ends if it is small.
   pure subroutine line_search_take(self, work)
      type(line_search_t), intent(inout) :: self
      real(wp), intent(in) :: work               !! [F L]

      self%is_on = abs(work) > small*abs(self%start) .and. self%n_place < most_places
      if (.not. self%is_on) return
      if (work < 0.0_wp) then
         self%low = self%at
      else
         self%high = self%at
      end if
      call choose(self)
   end subroutine line_search_take

   !> The next place, in the middle: across a corner the work is a step, on which a secant is
   !> slower.
   pure subroutine choose(self)
      type(line_search_t), intent(inout) :: self
      real(wp) :: from

      from = self%at
      self%n_place = self%n_place + 1
      self%at = 0.5_wp*(self%low + self%high)
      self%step = self%at - from
   end subroutine choose

end module emcon_line_search
