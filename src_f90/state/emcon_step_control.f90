!> The size of increments that follow the error: what is asked for, and what has come of it.
!>
!> Sizes are powers of two times the increment of the deck. Source: docs/theory.md, section 8.
module emcon_step_control
   use emcon_kinds, only : wp
   use emcon_text, only : note_add, notes_t, to_text
   implicit none
   private
   public :: step_control_t, control_begin, control_forget, control_accept, &
      control_refuse, control_sizes
   public :: why_error, why_contact, why_stand_off, why_newton, why_event, why_other, why_text, &
      n_why, most_power

   !> Why an increment was made smaller.
   integer, parameter :: why_error = 1, why_contact = 2, why_stand_off = 3, why_newton = 4, &
      why_event = 5, why_other = 6, n_why = 6
   character(len=12), parameter :: why_text(n_why) = [character(len=12) :: "error", "contact", &
      "stand_off", "newton", "event", "other"]

   !> Increments in a row of one size before the next one is doubled.
   integer, parameter :: easy_increments = 5
   !> Part of the tolerance that sizes are chosen for: the error grows from one to the next.
   real(wp), parameter :: aim = 0.5_wp
   !> Exponents of the controller, integral and proportional part: 0.3 and 0.4 over the order 2 of
   !> the error in the size.
   real(wp), parameter :: integral = 0.15_wp, proportional = 0.2_wp
   !> What is asked for changes by no more than this factor.
   real(wp), parameter :: most_change = 2.0_wp
   !> Below this part of a size it is halved.
   real(wp), parameter :: too_small = 0.75_wp
   !> Smallest and largest part of a size that is tried after an increment with too large an error.
   real(wp), parameter :: least_retry = 0.125_wp, most_retry = 0.5_wp
   !> Solves that converge slowly halve increments down to this power.
   integer, parameter :: slow_power = -3
   !> Sizes are from 2**-most_power to 2**most_power.
   integer, parameter :: most_power = 30

   type :: step_control_t
      integer :: power = 0                       !! the next size is 2**power
      real(wp) :: asked = 1.0_wp                 !! size that the error asks for
      real(wp) :: ratio = 0.0_wp                 !! error by tolerance of that size; 0: not known
      integer :: n_same = 0                      !! increments since the size has changed
      real(wp) :: h_before = 0.0_wp              !! size of the last increment; 0: none [T]
      real(wp) :: largest_kinetic = 0.0_wp       !! of all increments [M L^2/T^2]
      !> (n_dim, n_node) mean forces in it: of contact, and all others [M L/T^2]
      real(wp), allocatable :: contact(:, :), force(:, :)
      real(wp), allocatable :: velocity(:, :)    !! (n_dim, n_node) mean in it [L/T]
      real(wp), allocatable :: rate(:, :)        !! (n_dim, n_node) its change by `span` [L/T^2]
      real(wp) :: span = 0.0_wp                  !! mean size of the last two increments [T]
      integer :: n_known = 0                     !! increments since the start of the step, to two
      integer :: n_size(-most_power:most_power) = 0   !! increments of each size
      integer :: n_less(n_why) = 0               !! solves that were given up or slow, by reason
      integer :: n_event = 0                     !! events located
      integer :: n_over = 0                      !! increments with too large an error
   end type step_control_t

contains

   !> Begin a step of the deck with its own increment: loads and schemes are others.
   pure subroutine control_begin(self)
      type(step_control_t), intent(inout) :: self

      self%power = 0
      self%asked = 1.0_wp
      self%ratio = 0.0_wp
      self%n_same = 0
      call control_forget(self)
   end subroutine control_begin

   !> What was before is no measure of what comes: the state was changed, or moved on otherwise.
   pure subroutine control_forget(self)
      type(step_control_t), intent(inout) :: self

      self%h_before = 0.0_wp
      self%n_known = 0
   end subroutine control_forget

   !> An increment of `size` times that of the deck has succeeded: choose the next one.
   pure subroutine control_accept(self, size, ratio, is_slow, least, largest)
      type(step_control_t), intent(inout) :: self
      real(wp), intent(in) :: size               !! > 0
      real(wp), intent(in) :: ratio              !! of its error to the tolerance; < 0: not judged
      logical, intent(in) :: is_slow             !! Newton's method took long
      integer, intent(in) :: least, largest      !! power
      real(wp) :: now

      associate (k => self%n_size(max(-most_power, min(most_power, exponent(size) - 1))))
         k = k + 1
      end associate
      self%n_same = self%n_same + 1
      if (ratio > 1.0_wp) self%n_over = self%n_over + 1
      if (ratio >= 0.0_wp) then
         now = max(ratio, epsilon(1.0_wp))*(self%asked/size)**2
         if (.not. self%ratio > 0.0_wp) self%ratio = now
         self%asked = self%asked*max(1.0_wp/most_change, min(most_change, &
            (aim/now)**integral*(self%ratio/now)**proportional))
         self%ratio = now
      else
         self%asked = max(self%asked, scale(1.0_wp, self%power))
         if (self%n_same >= easy_increments) self%asked = scale(1.0_wp, self%power + 1)
      end if
      if (is_slow) then
         self%n_less(why_newton) = self%n_less(why_newton) + 1
         if (self%power > slow_power) self%asked = min(self%asked, scale(0.5_wp, self%power))
      end if
      self%asked = max(scale(1.0_wp, least), min(self%asked, scale(1.0_wp, self%power + 1)))
      call choose(self, least, largest)
   end subroutine control_accept

   !> The size that is nearest to what is asked for: smaller at once, larger after a while.
   pure subroutine choose(self, least, largest)
      type(step_control_t), intent(inout) :: self
      integer, intent(in) :: least, largest      !! power

      if (self%asked < too_small*scale(1.0_wp, self%power) .and. self%power > least) then
         self%power = max(least, exponent(self%asked) - 1)
         self%n_same = 0
      else if (self%asked >= scale(1.0_wp, self%power + 1) .and. self%n_same >= easy_increments &
            .and. self%power < largest) then
         self%power = self%power + 1
         self%n_same = 0
      end if
   end subroutine choose

   !> How many increments there were of each size: "h/4: 12", the smallest first.
   pure subroutine control_sizes(self, sizes)
      type(step_control_t), intent(in) :: self
      type(notes_t), intent(out) :: sizes
      character(len=:), allocatable :: text
      integer :: k

      do k = -most_power, most_power
         if (self%n_size(k) == 0) cycle
         text = "h"
         if (k < 0) text = "h/" // to_text(2**(-k))
         if (k > 0) text = to_text(2**k) // "h"
         call note_add(sizes, text // ": " // to_text(self%n_size(k)))
      end do
   end subroutine control_sizes

   !> An increment of `size` times that of the deck was given up: the next try has the power that
   !> is left.
   pure subroutine control_refuse(self, size, ratio, why, least)
      type(step_control_t), intent(inout) :: self
      real(wp), intent(in) :: size               !! > 0
      real(wp), intent(in) :: ratio              !! of its error to the tolerance, if > 1
      integer, intent(in) :: why                 !! one of `why_`
      integer, intent(in) :: least               !! smallest power
      real(wp) :: part

      self%n_less(why) = self%n_less(why) + 1
      part = most_retry
      if (ratio > 1.0_wp) part = max(least_retry, min(most_retry, sqrt(aim/ratio)))
      self%power = max(least, min(self%power - 1, exponent(part*size) - 1))
      self%asked = scale(1.0_wp, self%power)
      self%ratio = 0.0_wp
      self%n_same = 0
   end subroutine control_refuse

end module emcon_step_control
