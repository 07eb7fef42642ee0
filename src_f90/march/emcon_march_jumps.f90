!> Velocities that jump at the end of a step: impacts, and what has no mass, call for it.
!>
!> The impulses are those of contacts; what is held takes its share of them, which is a reaction.
module emcon_march_jumps
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_has_inertia
   use emcon_kinds, only : wp
   use emcon_layer, only : layer_take_velocities
   use emcon_march_types, only : march_t
   use emcon_numbering, only : gather_dependent
   use emcon_phases, only : phase_enter, phase_leave, phase_restitution
   use emcon_quasi_static, only : quasi_static_move
   use emcon_restitution, only : restitution_take
   use emcon_scene, only : scene_t
   use emcon_steps, only : initiation_velocity_update, step_initiation
   use emcon_system, only : mass_times
   use emcon_text, only : note_add, notes_t, to_text
   use emcon_velocity_jumps, only : jumps_add, jumps_begin, jumps_join, jumps_scale, jumps_sum
   use emcon_velocity_update, only : push_t, push_weights, velocity_update_apply, &
      velocity_update_push
   implicit none
   private
   public :: march_jump

contains

   !> The velocities that impacts and what has no mass call for, and the reactions to that.
   subroutine march_jump(self, scene, h, notes, error)
      type(march_t), intent(inout) :: self       !! velocities and reactions of the step are known
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(notes_t), intent(inout) :: notes      !! for the log
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: part                           ! of the push of what has no mass
      logical :: has_inertia
      integer :: left, n_contact

      call phase_enter(self%system%phases, phase_restitution, left)
      call jumps_begin(self%end_state%jump)
      has_inertia = evaluation_has_inertia(self%motion%evaluation)
      self%end_state%v_before = self%end_state%v
      if (step_initiation(scene%step(self%state%clock%i_step)) == initiation_velocity_update) then
         call restore_energy(self, notes, error)
      end if
      if (has_inertia .and. .not. allocated(error)) call restitution_take(self, h, &
         notes, error)
      n_contact = size(self%end_state%jump)
      part = 0.0_wp
      if (has_inertia) call quasi_static_move(self, h)
      if (has_inertia .and. self%layer%is_on .and. .not. allocated(error)) call end_massless(self, &
         h, part, notes, error)
      if (n_contact > 0 .or. abs(part) > 0.0_wp) call add_reactions(self, h, n_contact, part)
      call phase_leave(self%system%phases, left)
   end subroutine march_jump

   !> What holds prescribed freedoms takes what is left of the impulses there, and the momentum of
   !> the mass that they share with others.
   subroutine add_reactions(self, h, n_contact, part)
      type(march_t), intent(inout) :: self
      real(wp), intent(in) :: h                  !! > 0 [T]
      integer, intent(in) :: n_contact           !! so many jumps are impulses on what has mass
      real(wp), intent(in) :: part               !! of the push of what has no mass [T]
      real(wp), dimension(size(self%state%v, 1), size(self%state%v, 2)) :: impulse, held

      associate (numbering => self%system%space%numbering, now => self%end_state)
         call mass_times(self%system, now%v - now%v_before, held)
         call jumps_sum(now%jump(:n_contact), impulse)
         held = held - impulse
         if (abs(part) > 0.0_wp) held = held - part*self%layer%push
         call gather_dependent(numbering, held)
         self%state%reaction = self%state%reaction + merge(0.0_wp, held/h, numbering%unknown > 0)
      end associate
   end subroutine add_reactions

   !> Give back by a jump of the velocities what closing contacts have taken.
   subroutine restore_energy(self, notes, error)
      type(march_t), intent(inout) :: self
      type(notes_t), intent(inout) :: notes      !! for the log
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: restored
      logical :: has_root

      call velocity_update_apply(self%velocity_update, self%system, self%active%set, &
         self%end_state%v, restored, has_root, error)
      if (allocated(error)) return
      self%ledger%contact_work = self%ledger%contact_work + restored
      if (restored > 0.0_wp) then
         call note_add(notes, "velocity update restores an energy of " // to_text(restored))
         call jumps_add(self%end_state%jump, self%active%set, &
            self%velocity_update%part*push_weights(self%active%set))
      end if
      if (.not. has_root) call note_add(notes, &
         "velocity update: no jump of velocities restores the energy lost in this step")
   end subroutine restore_energy

   !> What has no mass moves as its displacement says. Where it was balanced anew, what that and
   !> closing contacts have taken is given back by a jump of the velocities.
   subroutine end_massless(self, h, part, notes, error)
      type(march_t), intent(inout) :: self
      real(wp), intent(in) :: h                  !! > 0 [T]
      real(wp), intent(inout) :: part            !! of its push that jumps [T]; as it was: none
      type(notes_t), intent(inout) :: notes      !! for the log
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: lost
      logical :: has_root
      integer :: k

      associate (layer => self%layer, set => self%active%set)
         call layer_take_velocities(layer, h, self%end_state%du, self%end_state%v)
         if (.not. layer%is_settled) return
         lost = 0.0_wp
         do k = set%n_permanent + 1, set%n
            lost = lost - set%lam(k)*set%item(k)%dgap
         end do
         self%ledger%external_work = self%ledger%external_work + layer%work
         self%ledger%friction = self%ledger%friction + layer%rubbed
         call velocity_update_push(self%velocity_update, self%system, set, &
            push_t(layer%push, lost + layer%released), self%end_state%v, has_root, error)
         if (allocated(error)) return
         if (has_root) then
            self%ledger%contact_work = self%ledger%contact_work + lost
            part = self%velocity_update%part
            call jumps_scale(layer%jump, part)
            call jumps_join(self%end_state%jump, layer%jump)
         else
            call note_add(notes, "the energy " // to_text(lost + layer%released) // &
               " that contacts took as they opened or closed is not restored: no jump of " // &
               "velocities does")
         end if
      end associate
   end subroutine end_massless

end module emcon_march_jumps
