!> The conditions of single contacts, looked at for a motion: what acts can go on to act, what does
!> not act closes or does not. Source: docs/theory.md, section 6.1.
module emcon_contact_conditions
   use emcon_active_set, only : active_set_t, step_stands_off, step_too_far, touch_tol
   use emcon_contact, only : contact_t, gap_ratio, gap_state_t, max_penetration_on_entry
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_system, only : system_t
   implicit none
   private
   public :: look_at_active, look_at_open, begins_unseen, gap_to_hold, gap_noise, noise_at

   !> Penetration and tension below these multiples of epsilon are round-off.
   real(wp), parameter :: gap_noise = 64.0_wp*epsilon(1.0_wp)
   real(wp), parameter :: force_noise = 1.0e3_wp*epsilon(1.0_wp)

contains

   !> The gap that contact `id` would hold.
   pure real(wp) function gap_to_hold(self, gap, id)
      type(active_set_t), intent(in) :: self
      type(gap_state_t), intent(in) :: gap
      integer, intent(in) :: id                  !! number over all pairs

      gap_to_hold = self%start%left(1)*self%start%overclosure(id) + gap%closed
      if (self%rules%holds_gap .and. .not. self%rules%closes(id)) gap_to_hold = gap%gap0
   end function gap_to_hold

   !> Can the step stand on constraint `k` of the set, the `i`-th of `contact`, which acts? If its
   !> stencil has moved on, the step is solved again with that for the motion that came out.
   pure subroutine look_at_active(self, contact, i, k, motion, status)
      type(active_set_t), intent(inout) :: self
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i                   !! its number in `contact`
      integer, intent(in) :: k                   !! and in the set
      type(motion_t), intent(in) :: motion       !! that was last measured
      integer, intent(inout) :: status           !! one of the `step_` codes: left, or a failure
      real(wp) :: held
      logical :: is_new

      associate (gap => contact%state(i))
         if (.not. contact%covers(i, motion%x, motion%u0, motion%du)) status = step_too_far
         ! A new contact may not be held at a larger distance than the deck allows.
         is_new = self%set%is_kept(k) .and. .not. self%start%was_active(self%set%id(k)) &
            .and. self%rules%may_cut
         if (is_new .and. self%rules%gap_tolerance > 0.0_wp &
            .and. gap_ratio(gap, gap%gap0) > self%rules%gap_tolerance) status = step_stands_off
         held = merge(gap%gap0, self%set%target(k), self%set%is_kept(k))
         if (self%set%penalty%is_on) held = held + contact%mean_gap(i, self%set%penalty%left(k))
         self%is_stale = self%is_stale .or. &
            (.not. gap%is_leaving .and. abs(gap%gap1 - held) > touch_tol*gap%size)
      end associate
   end subroutine look_at_active

   !> A push at a slave node below which it is round-off.
   pure real(wp) function noise_at(self, system, node) result(noise)
      type(active_set_t), intent(in) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: node                !! of the scene

      noise = force_noise*sum(system%response%magnitude(:, node))
      if (.not. self%rules%has_impacts) noise = noise + force_noise &
         *sum(system%response%rounding(:, node))
   end function noise_at

   !> Does the `i`-th constraint of `contact`, number `id`, which does not act, close? What was left
   !> out as nothing in it is free to move does not.
   pure subroutine look_at_open(self, contact, i, id, closes, status)
      type(active_set_t), intent(in) :: self
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i, id               !! in `contact`, and over all pairs
      logical, intent(out) :: closes             !! it is to be taken in
      integer, intent(inout) :: status           !! one of the `step_` codes: left, or a failure
      real(wp) :: allowed(0:1)

      closes = .false.
      associate (gap => contact%state(i))
         if (self%is_left_out(id) .or. .not. (gap%is_near .and. gap%is_over)) return
         allowed = self%start%left*self%start%overclosure(id) + gap%closed
         if (gap%is_arriving .and. contact%step%is_penalty) then
            closes = gap%gap1 < allowed(1) &
               .and. gap%gap1 > -contact%max_penetration_at_start*gap%size
         else if (gap%is_arriving .and. self%rules%has_impacts .and. .not. may_arrive(gap)) then
            return
         else if (gap%is_arriving .and. self%rules%has_impacts .and. self%rules%may_cut) then
            status = step_too_far
         else if (self%start%was_active(id) .or. .not. gap%gap0 - min(allowed(0), 0.0_wp) &
            < -contact%max_penetration_at_start*gap%size) then
            closes = .not. gap%gap1 - allowed(1) >= -merge(0.0_wp, gap_noise, &
               contact%step%is_penalty)*gap%size
         end if
      end associate
   end subroutine look_at_open

   !> With nothing to hold at its start, a contact begins with the next step, or in a smaller one;
   !> in the smallest it begins at once, if it is deep.
   pure logical function may_arrive(gap)
      type(gap_state_t), intent(in) :: gap

      may_arrive = gap%was_open .and. .not. gap%gap1 >= -max_penetration_on_entry*gap%size
   end function may_arrive

   !> Would the `i`-th constraint of `contact` begin to act with a stencil chosen for another
   !> motion?
   pure logical function begins_unseen(self, contact, i, motion)
      type(active_set_t), intent(in) :: self
      class(contact_t), intent(in) :: contact
      integer, intent(in) :: i                   !! number in `contact`
      type(motion_t), intent(in) :: motion       !! that was last measured

      associate (gap => contact%state(i))
         begins_unseen = .not. contact%covers(i, motion%x, motion%u0, motion%du) .or. &
            (self%rules%has_impacts .and. gap%gap0 > contact%max_gap_on_entry)
      end associate
   end function begins_unseen

end module emcon_contact_conditions
