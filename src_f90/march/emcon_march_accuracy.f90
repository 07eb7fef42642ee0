!> The error of a solved step, from how the forces have changed since the step before.
!>
!> Source: docs/theory.md, eqs. (26a) to (26d).
module emcon_march_accuracy
   use emcon_active_set, only : step_rough, step_strikes
   use emcon_constraints, only : constraints_force
   use emcon_csr, only : csr_t
   use emcon_evaluation, only : evaluation_velocity
   use emcon_kinds, only : wp
   use emcon_march_types, only : march_t, part_t
   use emcon_numbering, only : gather_dependent
   use emcon_scene, only : scene_t
   use emcon_system, only : mass_times
   use emcon_term, only : role_inertia
   use emcon_term_registry, only : terms_mass
   implicit none
   private
   public :: accuracy_begin, accuracy_judge, accuracy_keep

contains

   !> Masses of the unknowns, for the step that the system is in. Rigid bodies are left out: what
   !> holds their shape is no force that the error shows in.
   subroutine accuracy_begin(self, scene)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(csr_t) :: between
      real(wp) :: mass(size(self%end_state%v, 1), size(self%end_state%v, 2))
      integer :: i, k

      call terms_mass(self%system%term, between)
      do i = 1, between%n_row
         mass(:, i) = 0.0_wp
         do k = between%row_start(i) + 1, between%row_start(i + 1)
            mass(:, i) = mass(:, i) + real(abs(between%value(k)), wp)
         end do
      end do
      do k = 1, size(scene%rigid)
         mass(:, scene%rigid(k)%node) = 0.0_wp
      end do
      associate (numbering => self%system%space%numbering)
         call gather_dependent(numbering, mass)
         where (numbering%unknown <= 0) mass = 0.0_wp
      end associate
      self%step_check%estimate%mass = mass
      if (.not. allocated(self%step_check%estimate%force)) then
         allocate(self%step_check%estimate%force, source=mass)
         allocate(self%step_check%estimate%push, source=mass)
      end if
   end subroutine accuracy_begin

   !> Compare the error of the solved step with the tolerance: `self%finding`.
   subroutine accuracy_judge(self, part, tolerance, status)
      type(march_t), intent(inout) :: self       !! solved, not committed
      type(part_t), intent(in) :: part
      real(wp), intent(in) :: tolerance          !! > 0
      integer, intent(inout) :: status           !! one of the `step_` codes
      real(wp) :: change(size(self%end_state%v, 1), size(self%end_state%v, 2))
      real(wp) :: motion, smooth, whole

      call find_forces(self)
      if (.not. self%state%control%h_before > 0.0_wp) return
      associate (control => self%state%control, step_check => self%step_check, &
            force => self%step_check%estimate%force, contact => self%step_check%estimate%push)
         motion = max(control%largest_kinetic, self%ledger%kinetic, kinetic_at_end(self))
         if (.not. motion > 0.0_wp) return
         call find_motion_change(self, part%h, change)
         smooth = sqrt(squared(self, force - control%force, part%h, change)/(2.0_wp*motion))
         whole = sqrt(squared(self, force - control%force + contact - control%contact, part%h, &
            change)/(2.0_wp*motion))
         step_check%ratio = smooth/tolerance
         if (step_check%ratio > 1.0_wp) then
            if (may_shrink(self, part)) status = step_rough
            return
         end if
         if (.not. step_check%changes_contact) return
         ! The motion turns in the time h sqrt(C/smooth).
         step_check%ratio = max(step_check%ratio, &
            whole*sqrt(smooth/self%scheme%error_constant())/tolerance)
         if (step_check%ratio > 1.0_wp .and. may_shrink(self, part)) status = step_strikes
      end associate
   end subroutine accuracy_judge

   !> Is there a size below that of the step that its error may ask for?
   pure logical function may_shrink(self, part)
      type(march_t), intent(in) :: self
      type(part_t), intent(in) :: part

      may_shrink = part%may_cut .and. exponent(part%h/self%grid%h_deck) - 1 > self%grid%least_power
   end function may_shrink

   !> Remember of the solved step what the next one is compared with.
   subroutine accuracy_keep(self, h)
      type(march_t), intent(inout) :: self       !! committed
      real(wp), intent(in) :: h                  !! > 0 [T]

      associate (control => self%state%control)
         control%force = self%step_check%estimate%force
         control%contact = self%step_check%estimate%push
         if (control%n_known > 0) control%rate = self%step_check%estimate%rate
         control%velocity = self%motion%du/h
         control%n_known = min(2, control%n_known + 1)
         control%span = 0.5_wp*(control%h_before + h)
         control%h_before = h
         control%largest_kinetic = max(control%largest_kinetic, self%ledger%kinetic, &
            kinetic_at_end(self))
      end associate
   end subroutine accuracy_keep

   !> Mean forces over the step, on the unknowns: of contact, and all others, which make inertia.
   subroutine find_forces(self)
      type(march_t), intent(inout) :: self       !! solved, not committed

      associate (set => self%active%set, numbering => self%system%space%numbering, &
            force => self%step_check%estimate%force, contact => self%step_check%estimate%push)
         call constraints_force(set, set%n_permanent + 1, contact)
         force = self%system%response%part(role_inertia)%force - contact
         call gather_dependent(numbering, force)
         call gather_dependent(numbering, contact)
      end associate
   end subroutine find_forces

   !> Kinetic energy at the end of the solved step, before velocities jump [M L^2/T^2].
   real(wp) function kinetic_at_end(self)
      type(march_t), intent(in) :: self
      real(wp), dimension(size(self%end_state%v, 1), size(self%end_state%v, 2)) :: v, momentum

      v = evaluation_velocity(self%motion%evaluation, self%motion%v0, self%motion%du &
         + self%motion%offset)
      call mass_times(self%system, v, momentum)
      kinetic_at_end = 0.5_wp*sum(v*momentum)
   end function kinetic_at_end

   !> The derivative of the acceleration by three mean velocities.
   subroutine find_motion_change(self, h, change)
      type(march_t), intent(inout) :: self       !! solved, not committed; `rate` is found
      real(wp), intent(in) :: h                  !! > 0 [T]
      real(wp), intent(out) :: change(:, :)      !! (n_dim, n_node), large if not known [L/T^3]
      real(wp) :: span

      change = huge(1.0_wp)
      associate (control => self%state%control)
         span = 0.5_wp*(control%h_before + h)
         self%step_check%estimate%rate = (self%motion%du/h - control%velocity)/span
         if (control%n_known > 1) change = 2.0_wp*(self%step_check%estimate%rate - control%rate) &
            /(span + control%span)
      end associate
   end subroutine find_motion_change

   !> The error by the velocity, m (C h^2 a')^2 in sum: of each freedom the smaller a' of two, by
   !> the forces and by the motion. Forces of what is stiff change too much, motions at an impact.
   pure real(wp) function squared(self, force, h, change)
      type(march_t), intent(in) :: self
      real(wp), intent(in) :: force(:, :)        !! (n_dim, n_node) change of the force [M L/T^2]
      real(wp), intent(in) :: h                  !! > 0 [T]
      real(wp), intent(in) :: change(:, :)       !! (n_dim, n_node) by the motion [L/T^3]
      real(wp) :: span, factor
      integer :: i, a

      span = 0.5_wp*(self%state%control%h_before + h)
      factor = self%scheme%error_constant()*h**2
      squared = 0.0_wp
      do i = 1, size(force, 2)
         do a = 1, size(force, 1)
            associate (m => self%step_check%estimate%mass(a, i))
               if (m > 0.0_wp) squared = squared &
                  + m*(factor*min(abs(force(a, i)/(m*span)), abs(change(a, i))))**2
            end associate
         end do
      end do
   end function squared

end module emcon_march_accuracy
