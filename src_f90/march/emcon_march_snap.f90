!> Static increments with STABILIZE: are they short enough for what snaps on its way?
!>
!> Works are taken with forces that change linearly over an increment. One that passes over a
!> state in between misses the energy that is set free there, and the way that it takes. One that
!> ends where the energy is no minimum has not gone on to where viscous motion leads: that leaves
!> such a place. Source: docs/theory.md, section 3.
module emcon_march_snap
   use emcon_active_set, only : step_done, step_rough
   use emcon_constraint_rows, only : constraints_rows
   use emcon_constraints, only : constraints_evaluate
   use emcon_correction, only : correction_try_minimum
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_march_types, only : march_t, part_t
   use emcon_scene, only : scene_t
   use emcon_system, only : system_respond
   use emcon_term, only : role_internal
   use emcon_term_registry, only : terms_stabilization
   implicit none
   private
   public :: snap_judge, snap_left

   !> The work of the elements and what they store more differ by so much of what they store.
   real(wp), parameter :: most_missed = 0.02_wp

contains

   !> Take the viscous forces from those of the elements at the end, and cut the increment where
   !> work and energy of these do not agree, or where it ends in no minimum: with viscous forces, as
   !> they are, there is one near the start of an increment that is short enough.
   subroutine snap_judge(self, scene, part, status, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(part_t), intent(in) :: part
      integer, intent(inout) :: status           !! `step_done`, or why a smaller one may do
      type(error_t), allocatable, intent(out) :: error
      logical :: is_minimum

      if (.not. scene%step(self%state%clock%i_step)%stabilization > 0.0_wp) return
      call judge(self, part, status)
      if (status /= step_done) return
      call find_minimum(self, is_minimum, error)
      if (.not. is_minimum) status = step_rough
   end subroutine snap_judge

   !> Is the end of the increment a minimum, where forces have an energy: without friction, and
   !> contact that holds gaps? Elsewhere it counts as one.
   subroutine find_minimum(self, is_minimum, error)
      type(march_t), intent(inout) :: self
      logical, intent(out) :: is_minimum
      type(error_t), allocatable, intent(out) :: error

      associate (set => self%active%set)
         is_minimum = set%n_condition > set%n .or. set%penalty%is_on &
            .or. any(set%item(:set%n)%has_friction)
         if (is_minimum) return
         call system_respond(self%system, self%motion, .true.)
         is_minimum = .not. self%system%is_symmetric
         if (is_minimum) return
         call constraints_evaluate(set, self%system, self%motion)
         if (set%n > 0) call constraints_rows(set, self%system%space%numbering)
         call correction_try_minimum(self%newton%correction, self%system, set, is_minimum, error)
      end associate
   end subroutine find_minimum

   !> Works and energies of a step that has them. Contact without friction takes none: where what
   !> acted at the start lets go, or others take over, it does as far as the increment is too long.
   !> Contact that gives way stores some, which comes back.
   subroutine judge(self, part, status)
      type(march_t), intent(inout) :: self
      type(part_t), intent(in) :: part
      integer, intent(inout) :: status           !! one of the `step_` codes
      real(wp) :: viscous(size(self%motion%x, 1), size(self%motion%x, 2)), work, missed, before, &
         after

      call terms_stabilization(self%system%term, work, viscous)
      associate (state => self%state, ending => self%end_state)
         ending%force = ending%force - viscous
         if (.not. part%may_cut) return
         before = sum(state%energy)
         after = sum(ending%energy)
         missed = abs(0.5_wp*sum((state%internal + ending%force)*ending%du) &
            - (after - before))
         if (any(abs(state%contact) > 0.0_wp) .and. .not. (self%active%friction%is_on &
            .or. self%active%set%penalty%is_on)) missed = max(missed, &
            -0.5_wp*sum((state%contact + self%newton%contact)*ending%du))
         if (.not. missed > most_missed*max(before, after) + epsilon(missed) &
            *sum(self%system%response%rounding*abs(ending%du))) return
         self%step_check%ratio = missed/max(before, after)
      end associate
      status = step_rough
   end subroutine judge

   !> The viscous force of STABILIZE by those of the elements, all nodes together.
   real(wp) function snap_left(self) result(left)
      type(march_t), intent(in) :: self
      real(wp) :: viscous(size(self%motion%x, 1), size(self%motion%x, 2)), work, largest

      call terms_stabilization(self%system%term, work, viscous)
      largest = norm2(self%system%response%part(role_internal)%magnitude) &
         + epsilon(largest)*norm2(self%system%response%rounding)
      left = 0.0_wp
      if (largest > 0.0_wp) left = norm2(viscous)/largest
   end function snap_left

end module emcon_march_snap
