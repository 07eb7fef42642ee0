!> Increments whose size follows the error of the motion, and that end where contacts begin or end.
!>
!> A place in a step is counted in units of 2**-n_unit times the increment of the deck, so that
!> times have no rounding of their own and every increment leads back to the grid.
module emcon_march_control
   use emcon_active_set, only : step_diverged, step_passes_event, step_refused, step_rough, &
      step_singular, step_stands_off, step_strikes
   use emcon_errors, only : error_t
   use emcon_factor_policy, only : factor_policy_forget
   use emcon_kinds, only : int64, wp
   use emcon_march_accuracy, only : accuracy_keep
   use emcon_march_events, only : events_tell
   use emcon_march_grid, only : march_next_corner, march_part_time, march_size
   use emcon_march_parts, only : march_attempt, march_match, march_stop
   use emcon_march_types, only : increment_t, march_t, part_t, rollback_t
   use emcon_scene, only : scene_t
   use emcon_step_control, only : control_accept, control_refuse, why_contact, why_error, &
      why_event, why_newton, why_other, why_stand_off
   use emcon_text, only : note_add, to_text
   implicit none
   private
   public :: march_controlled

   !> Of an event that is foreseen the increment ends so many windows before.
   real(wp), parameter :: margin = 0.5_wp
   !> Smallest part of an increment that is tried where an event lies in it.
   integer, parameter :: least_share = 16

contains

   !> One increment; on an error the state is that before it.
   subroutine march_controlled(self, scene, increment, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(increment_t), intent(inout) :: increment
      type(error_t), allocatable, intent(out) :: error
      integer(int64) :: from, n

      if (allocated(self%before)) deallocate(self%before)
      self%grid%judges_size = .true.
      call march_match(self, scene, increment, error)
      if (allocated(error)) return
      associate (state => self%state)
         from = place_of(self)
         if (state%control%h_before > 0.0_wp &
            .or. .not. scene%step(state%clock%i_step)%time%tolerance > 0.0_wp) then
            n = next_units(self, scene, from)
            call go(self, scene, from, n, increment, error)
         else
            call start(self, scene, from, increment, n, error)
         end if
         if (allocated(error)) return
         from = from + n
         state%clock%n_grid = int(from/self%grid%n_unit)
         state%clock%n_part = int(mod(from, self%grid%n_unit))
         state%clock%step_time = march_part_time(self, scene%step(state%clock%i_step), from)
      end associate
   end subroutine march_controlled

   !> The first increment of a step: two halves, of which the second is compared with the first. If
   !> it is not as asked both are made again, shorter.
   subroutine start(self, scene, from, increment, n, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer(int64), intent(in) :: from         !! units since the start of the step
      type(increment_t), intent(inout) :: increment
      integer(int64), intent(out) :: n           !! units gone on by
      type(error_t), allocatable, intent(out) :: error
      integer(int64) :: first, second

      self%before = rollback_t(self%state, self%ledger)
      do
         n = next_units(self, scene, from)
         if (n == self%grid%n_least) then
            call go(self, scene, from, n, increment, error)
            return
         end if
         first = n/2
         call go(self, scene, from, first, increment, error)
         if (allocated(error)) return
         second = n - first
         call go(self, scene, from + first, second, increment, error, is_test=.true.)
         if (allocated(error)) return
         n = first + second
         if (second > 0) exit
         self%before%state%control%power = self%state%control%power
         self%before%state%control%n_less = self%state%control%n_less
         self%state = self%before%state
         self%ledger = self%before%ledger
         call factor_policy_forget(self%newton%factor_policy, self%newton%correction)
         increment%done = 0.0_wp
      end do
      increment%h = march_size(self, scene%step(self%state%clock%i_step), from, n)
   end subroutine start

   !> Go on by `n` units, or by fewer where that fails.
   subroutine go(self, scene, from, n, increment, error, is_test)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer(int64), intent(in) :: from         !! units since the start of the step
      integer(int64), intent(inout) :: n         !! units; out: gone on by, 0: the test failed
      type(increment_t), intent(inout) :: increment
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in), optional :: is_test   !! too large an error ends it
      type(part_t) :: part
      character(len=:), allocatable :: reason
      integer :: status

      associate (step => scene%step(self%state%clock%i_step))
         do
            part%h = march_size(self, step, from, n)
            part%start%step_time = march_part_time(self, step, from)
            part%start%total_time = self%state%clock%start_time + part%start%step_time
            part%start%h_before = self%state%history%h_before
            part%may_cut = n > self%grid%n_least
            increment%h = part%h
            call march_attempt(self, scene, part, increment, status, reason, error)
            if (allocated(error)) return
            if (status == 0) exit
            if (n <= self%grid%n_least .and. status /= step_passes_event) then
               call march_stop(self, scene, part, "with h = " // to_text(part%h) // &
                  ", the smallest allowed, " // reason, error)
               return
            end if
            call shorten(self, scene, from, status, n)
            part%level = part%level + 1
            if (present(is_test) .and. any(status == [step_rough, step_strikes])) then
               n = 0
               return
            end if
         end do
         call take_over(self, scene, part, n, increment)
      end associate
   end subroutine go

   !> What follows from a step that has succeeded.
   subroutine take_over(self, scene, part, n, increment)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(part_t), intent(in) :: part
      integer(int64), intent(in) :: n            !! units
      type(increment_t), intent(inout) :: increment
      logical :: is_slow

      increment%done = increment%done + part%h
      associate (step => scene%step(self%state%clock%i_step), control => self%state%control)
         if (step%time%event_fraction > 0.0_wp) call events_tell(self, scene, step, part, increment)
         is_slow = 2*self%newton%convergence%n_iteration > self%newton%convergence%maximum
         if (step%time%tolerance > 0.0_wp) then
            if (self%step_check%ratio > 1.0_wp) call note_add(increment%notes, "the error is " // &
               to_text(self%step_check%ratio, 3) // " times TOLERANCE with the smallest increment")
            call accuracy_keep(self, part%h)
         end if
         call control_accept(control, real(n, wp)/real(self%grid%n_unit, wp), &
            self%step_check%ratio, is_slow .and. step%time%tolerance > 0.0_wp, &
            self%grid%least_power, self%grid%largest_power)
      end associate
   end subroutine take_over

   !> Units that the next increment has: to the next multiple of the size that is asked for.
   integer(int64) function next_units(self, scene, from) result(n)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      integer(int64), intent(in) :: from         !! units since the start of the step
      integer(int64) :: size
      integer :: power

      power = self%state%control%power
      if (power > 0) then
         do while (power > 0)
            if (keeps_apart(self, scene, scale(scene%step(self%state%clock%i_step)%time%h, &
               power))) exit
            power = power - 1
         end do
      end if
      size = self%grid%n_unit
      if (power >= 0) size = size*2_int64**power
      if (power < 0) size = size/2_int64**(-power)
      n = size - mod(from, size)
      n = min(n, march_next_corner(self, int(from/self%grid%n_unit))*self%grid%n_unit - from)
   end function next_units

   !> Do boxes about the bodies stay apart for a time `h`? Only then may increments be longer than
   !> that of the deck: contact is not looked for on the way.
   logical function keeps_apart(self, scene, h)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: h                  !! > 0 [T]
      real(wp), dimension(size(scene%x, 1), self%system%space%n_body) :: low, high
      real(wp) :: reach(self%system%space%n_body), place(size(scene%x, 1))
      integer :: i, k

      keeps_apart = self%system%n_pair == 0
      if (keeps_apart .or. self%system%space%n_body < 2) return
      low = huge(1.0_wp)
      high = -huge(1.0_wp)
      reach = 0.0_wp
      do i = 1, size(scene%x, 2)
         associate (b => self%system%space%body(i))
            if (b == 0) cycle
            place = scene%x(:, i) + self%state%u(:, i)
            low(:, b) = min(low(:, b), place)
            high(:, b) = max(high(:, b), place)
            reach(b) = max(reach(b), h*sqrt(sum(self%state%v(:, i)**2)))
         end associate
      end do
      do k = 2, size(reach)
         do i = 1, k - 1
            if (all(low(:, k) - high(:, i) <= reach(i) + reach(k) .and. &
               low(:, i) - high(:, k) <= reach(i) + reach(k))) return
         end do
      end do
      keeps_apart = .true.
   end function keeps_apart

   !> Choose fewer units after a failure.
   subroutine shorten(self, scene, from, status, n)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer(int64), intent(in) :: from         !! units since the start of the step
      integer, intent(in) :: status              !! why it failed
      integer(int64), intent(inout) :: n         !! units that were tried; out: fewer
      integer(int64) :: before
      integer :: power

      before = n
      if (status == step_passes_event) then
         self%state%control%n_less(why_event) = self%state%control%n_less(why_event) + 1
         n = int(min(real(n, wp), max(0.0_wp, self%step_check%event_at*real(n, wp) &
            - margin*real(self%grid%n_window, wp))), int64)
         n = max(n, before/least_share, self%grid%n_window)
         return
      end if
      associate (control => self%state%control)
         power = control%power
         call control_refuse(control, real(n, wp)/real(self%grid%n_unit, wp), &
            self%step_check%ratio, why_of(status), self%grid%least_power)
         n = next_units(self, scene, from)
         ! Sizes that accuracy does not ask for are below the least power.
         if (n >= before) n = max(self%grid%n_least, before/2)
         ! What is no matter of accuracy is over with the increment.
         if (.not. scene%step(self%state%clock%i_step)%time%tolerance > 0.0_wp) control%power = &
            max(0, power - 1)
      end associate
   end subroutine shorten

   !> The reason of a failure, as it is counted.
   pure integer function why_of(status) result(why)
      integer, intent(in) :: status              !! one of the `step_` codes

      select case (status)
      case (step_rough)
         why = why_error
      case (step_strikes)
         why = why_contact
      case (step_stands_off)
         why = why_stand_off
      case (step_diverged, step_singular, step_refused)
         why = why_newton
      case default
         why = why_other
      end select
   end function why_of

   !> Units since the start of the step.
   pure integer(int64) function place_of(self)
      type(march_t), intent(in) :: self

      place_of = int(self%state%clock%n_grid, int64)*self%grid%n_unit &
         + int(self%state%clock%n_part, int64)
   end function place_of

end module emcon_march_control
