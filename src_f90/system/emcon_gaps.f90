!> The gaps of all possible contacts, in the order of the constraints: measured for a motion, by
!> stencils that were chosen before, or by those of a search for it.
module emcon_gaps
   use emcon_contact, only : gap_state_t
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_phases, only : phase_enter, phase_gaps, phase_leave, phase_search
   use emcon_system, only : system_t
   implicit none
   private
   public :: gaps_measure, gaps_search, gaps_forget, gaps_follow_slips, pair_search, &
      pair_measure

contains

   !> Choose the stencils of one contact for `motion`.
   subroutine pair_search(system, pair, motion)
      type(system_t), intent(inout) :: system
      integer, intent(in) :: pair                !! number of the contact
      type(motion_t), intent(in) :: motion       !! from `u0` by `du`
      integer :: left

      call phase_enter(system%phases, phase_search, left)
      call system%contact(pair)%contact%begin_step(motion%x, motion%u0, motion%du)
      system%phases%n_searched = system%phases%n_searched + 1
      call phase_leave(system%phases, left)
   end subroutine pair_search

   !> Measure the gaps of one contact by its present stencils, for a motion from `u0` by `du`.
   subroutine pair_measure(system, pair, x, u0, du)
      type(system_t), intent(inout) :: system
      integer, intent(in) :: pair                !! number of the contact
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)      !! (n_dim, n_node) [L]
      integer :: left

      call phase_enter(system%phases, phase_gaps, left)
      call system%contact(pair)%contact%measure(x, u0, du)
      system%phases%n_measured = system%phases%n_measured + 1
      call phase_leave(system%phases, left)
   end subroutine pair_measure

   !> Choose stencils for `motion`, and measure by them whatever is near.
   subroutine gaps_search(system, motion, gap)
      type(system_t), intent(inout) :: system                     !! its contacts
      type(motion_t), intent(in) :: motion                        !! from `u0` by `du`
      type(gap_state_t), allocatable, intent(out) :: gap(:)       !! (n_constraint)
      integer :: i

      call gaps_forget(system)
      do i = 1, size(system%contact)
         associate (contact => system%contact(i)%contact)
            contact%step%is_watched = spread(.true., 1, contact%n_constraint)
         end associate
         call pair_search(system, i, motion)
      end do
      call gaps_measure(system, motion, gap)
   end subroutine gaps_search

   !> Measure by the present stencils. Other constraints than contacts have no gaps.
   subroutine gaps_measure(system, motion, gap)
      type(system_t), intent(inout) :: system                     !! its contacts
      type(motion_t), intent(in) :: motion                        !! from `u0` by `du`
      type(gap_state_t), allocatable, intent(out) :: gap(:)       !! (n_constraint)
      integer :: i

      allocate(gap(system%n_constraint))
      do i = 1, size(system%contact)
         call pair_measure(system, i, motion%x, motion%u0, motion%du)
         associate (contact => system%contact(i)%contact)
            gap(system%first_constraint(i) + 1:system%first_constraint(i + 1)) = contact%state
         end associate
      end do
   end subroutine gaps_measure

   !> A step begins: nothing is near yet.
   subroutine gaps_forget(system)
      type(system_t), intent(inout) :: system                     !! its contacts
      integer :: i

      do i = 1, size(system%contact)
         system%contact(i)%contact%reach = 0.0_wp
      end do
   end subroutine gaps_forget

   !> The step is to be solved again with friction where the motion that was searched for last has
   !> it.
   subroutine gaps_follow_slips(system)
      type(system_t), intent(inout) :: system                     !! its contacts
      integer :: i

      do i = 1, size(system%contact)
         call system%contact(i)%contact%follow_slips()
      end do
   end subroutine gaps_follow_slips

end module emcon_gaps
