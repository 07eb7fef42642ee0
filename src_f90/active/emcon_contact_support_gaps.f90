!> Gaps of contacts along motions of bodies: which close first, which are in the way.
module emcon_contact_support_gaps
   use emcon_constraint, only : condition_rate
   use emcon_constraints, only : constraint_index, constraint_set_t, constraints_evaluate, &
      constraints_select
   use emcon_gaps, only : pair_measure, pair_search
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_t
   use emcon_mechanisms, only : mechanisms_t, mechanism_field
   use emcon_system, only : system_t
   implicit none
   private
   public :: gaps_measure, gaps_evaluate, gaps_of_guards, gaps_that_can_act, gaps_that_leave, &
      gaps_next_to_close, gaps_next_guards, gaps_nearest, gaps_keep_closed
   public :: in_the_way

   !> Contacts that close at the same time, by this fraction of an edge, are taken in together.
   real(wp), parameter :: together = 1.0e-3_wp
   !> So far in, by its edge, a tip may be when what lies around it meets in the mean; deeper ones
   !> end a run.
   real(wp), parameter :: deepest_tip = 0.1_wp
   !> A contact that closes by less than this, per unit of a motion, is not in its way.
   real(wp), parameter :: in_the_way = sqrt(epsilon(1.0_wp))

contains

   !> Gaps of a motion, of the stencils that it calls for.
   subroutine gaps_measure(system, motion)
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      integer :: pair

      do pair = 1, size(system%contact)
         call pair_search(system, pair, motion)
         call pair_measure(system, pair, motion%x, motion%u0, motion%du)
      end do
   end subroutine gaps_measure

   !> The contacts that `is_meant` marks, over a motion that is placed; of those that `grips` marks
   !> also their slips.
   subroutine gaps_evaluate(system, motion, is_meant, set, grips)
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      logical, intent(in) :: is_meant(:)         !! (n_constraint)
      type(constraint_set_t), intent(out) :: set
      logical, intent(in), optional :: grips(:)  !! (n_constraint)
      integer :: k, pair, i, id

      call constraints_select(set, pack([(k, k = 1, size(is_meant))], &
         is_meant .and. [(k > system%first_constraint(1), k = 1, size(is_meant))]))
      do k = 1, set%n
         id = set%id(k)
         call constraint_index(system, id, pair, i)
         associate (gap => system%contact(pair)%contact%state(i))
            set%target(k) = gap%gap1 - gap%closed
         end associate
         if (present(grips)) set%item(k)%has_friction = grips(id)
      end do
      call constraints_evaluate(set, system, motion)
   end subroutine gaps_evaluate

   !> Contacts that can act at the end of the motion that was measured.
   pure function gaps_that_can_act(system, overclosure) result(is_meant)
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: overclosure(:)     !! (n_constraint) that the step resolves, <= 0 [L]
      logical :: is_meant(system%n_constraint)
      integer :: pair

      is_meant = .false.
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact, &
               first => system%first_constraint(pair) + 1, &
               last => system%first_constraint(pair + 1))
            is_meant(first:last) = contact%state%is_near .and. contact%state%is_over &
               .and. .not. contact%state%is_leaving
            is_meant(first:last) = is_meant(first:last) .and. contact%state%gap1 &
               > min(contact%state%closed, 0.0_wp) + overclosure(first:last) &
               - contact%max_penetration_at_start*contact%state%size
         end associate
      end do
   end function gaps_that_can_act

   !> Contacts that are guards.
   pure function gaps_of_guards(system) result(is_guard)
      type(system_t), intent(in) :: system
      logical :: is_guard(system%n_constraint)
      integer :: i, pair

      is_guard = .false.
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact)
            is_guard(system%first_constraint(pair) + 1:system%first_constraint(pair + 1)) = &
               [(contact%waits(i), i = 1, contact%n_constraint)]
         end associate
      end do
   end function gaps_of_guards

   !> Contacts that have lost their surface at the end of the motion that was measured.
   pure function gaps_that_leave(system) result(is_leaving)
      type(system_t), intent(in) :: system
      logical :: is_leaving(system%n_constraint)
      integer :: pair

      is_leaving = .false.
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact)
            is_leaving(system%first_constraint(pair) + 1:system%first_constraint(pair + 1)) = &
               contact%state%is_leaving
         end associate
      end do
   end function gaps_that_leave

   !> Of the contacts `set` those that close first on a way, and when; huge if none does.
   pure subroutine gaps_next_to_close(set, direction, time, is_next)
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in) :: direction(:, :)    !! (n_dim, n_node) per time
      real(wp), intent(out) :: time              !! >= 0, in the unit of `direction`
      logical, intent(out) :: is_next(:)         !! (n_constraint)
      real(wp) :: rate(set%n), gap(set%n)
      integer :: k

      time = huge(time)
      is_next = .false.
      do k = 1, set%n
         associate (item => set%item(k))
            rate(k) = -condition_rate(item, direction)
            gap(k) = max(0.0_wp, set%target(k))
            if (rate(k) <= in_the_way*sum(abs(item%c(:, :item%n_node)))) rate(k) = 0.0_wp
            if (rate(k) > 0.0_wp) time = min(time, gap(k)/rate(k))
         end associate
      end do
      do k = 1, set%n
         if (rate(k) > 0.0_wp) is_next(set%id(k)) = &
            gap(k) - time*rate(k) <= together*set%item(k)%size
      end do
   end subroutine gaps_next_to_close

   !> Guards that close on a way before the contacts that are next, in place of these, if a tip
   !> would go too deep until then; within an edge of their nodes: what slides along a surface they
   !> do not hold.
   pure subroutine gaps_next_guards(set, direction, time, is_next)
      type(constraint_set_t), intent(in) :: set  !! guards
      real(wp), intent(in) :: direction(:, :)    !! (n_dim, n_node) per time
      real(wp), intent(inout) :: time            !! as `gaps_next_to_close` has it, of the others
      logical, intent(inout) :: is_next(:)       !! (n_constraint)
      real(wp) :: first, far
      logical :: is_first(size(is_next))
      integer :: k

      call gaps_next_to_close(set, direction, first, is_first)
      if (.not. any(is_first)) return
      far = maxval(abs(direction))
      do k = 1, set%n
         associate (size_of => set%item(k)%size)
            if (first*far > size_of .or. time - first <= deepest_tip*(size_of/far)) then
               is_first(set%id(k)) = .false.
            end if
         end associate
      end do
      if (.not. any(is_first)) return
      time = first
      is_next = is_first
   end subroutine gaps_next_guards

   !> Of the contacts `set` those with the smallest gap that prevent a motion that is left.
   pure subroutine gaps_nearest(set, bodies, member, z, is_next)
      type(constraint_set_t), intent(in) :: set
      type(mechanisms_t), intent(in) :: bodies
      integer, intent(in) :: member(:)           !! bodies of an assembly
      real(dp), intent(in) :: z(:, :)            !! (n_motion*members, n) motions left of it
      logical, intent(out) :: is_next(:)         !! (n_constraint)
      real(wp) :: direction(size(bodies%x, 1), size(bodies%of_node)), rate(set%n), smallest
      integer :: j, k

      rate = 0.0_wp
      do j = 1, size(z, 2)
         call mechanism_field(bodies, member, z(:, j), direction)
         do k = 1, set%n
            associate (item => set%item(k))
               rate(k) = max(rate(k), abs(condition_rate(item, direction)) &
                  /sum(abs(item%c(:, :item%n_node))))
            end associate
         end do
      end do
      is_next = .false.
      if (.not. any(rate > in_the_way)) return
      smallest = minval(set%target, mask=rate > in_the_way)
      do k = 1, set%n
         is_next(set%id(k)) = rate(k) > in_the_way .and. &
            set%target(k) - smallest <= together*set%item(k)%size
      end do
   end subroutine gaps_nearest

   !> Of the contacts `set` that `is_meant` marks keep those whose gaps are closed.
   pure subroutine gaps_keep_closed(set, is_meant)
      type(constraint_set_t), intent(in) :: set
      logical, intent(inout) :: is_meant(:)      !! (n_constraint)
      integer :: k

      do k = 1, set%n
         if (set%target(k) > together*set%item(k)%size) is_meant(set%id(k)) = .false.
      end do
   end subroutine gaps_keep_closed

end module emcon_contact_support_gaps
