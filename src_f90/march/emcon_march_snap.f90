!> Static increments with STABILIZE: are they short enough for what snaps on its way?
!>
!> Works are taken with forces that change linearly over an increment. One that passes over a
!> state in between misses the energy that is set free there, and the way that it takes.
module emcon_march_snap
   use emcon_active_set, only : step_done, step_rough
   use emcon_kinds, only : wp
   use emcon_march_types, only : march_t, part_t
   use emcon_scene, only : scene_t
   use emcon_term, only : role_internal
   use emcon_term_registry, only : terms_stabilization
   implicit none
   private
   public :: snap_judge, snap_left

   !> The work of the elements and what they store more differ by so much of what they store.
   real(wp), parameter :: most_missed = 0.02_wp

contains

   !> Take the viscous forces from those of the elements at the end, and cut the increment where
   !> work and energy of these do not agree.
   subroutine snap_judge(self, scene, part, status)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(part_t), intent(in) :: part
      integer, intent(inout) :: status           !! `step_done`, or why a smaller one may do

      if (scene%step(self%state%clock%i_step)%stabilization > 0.0_wp) call judge(self, part, status)
   end subroutine snap_judge

   !> The same in a step that has them.
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
