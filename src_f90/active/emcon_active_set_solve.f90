!> A step with contact, of any scheme: the problem of emcon_contact_rounds, and what statics need
!> around it.
!>
!> Bodies that contact alone holds are brought to it before, and looked at after. Where no solution
!> is found the step is tried with sharp convex corners before it is cut. Source: docs/theory.md,
!> section 6.2.
module emcon_active_set_solve
   use emcon_active_set, only : active_set_restart, active_set_t, step_cycling, step_diverged, &
      step_done, step_not_held
   use emcon_constraints, only : constraint_index
   use emcon_contact_conditions, only : noise_at
   use emcon_contact_rounds, only : contact_rounds_solve
   use emcon_contact_support, only : contact_support_find_free
   use emcon_coulomb_law, only : contact_slides
   use emcon_errors, only : error_t
   use emcon_friction, only : friction_holds
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_newton, only : newton_t
   use emcon_scene, only : scene_t
   use emcon_system, only : system_t
   implicit none
   private
   public :: active_set_solve

contains

   !> Solve the step that has begun; `motion%du` is the first guess and the result.
   subroutine active_set_solve(self, system, scene, newton, motion, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      logical :: is_done

      self%guess%first = motion%du
      self%guess%driven = newton%driven
      is_done = .false.
      do while (.not. is_done)
         call contact_rounds_solve(self, system, scene, newton, motion, status, error)
         if (allocated(error) .or. allocated(self%support%text)) return
         if (status == step_done) then
            call look_for_free(self, system, scene, motion, status)
            return
         end if
         call begin_sharp(self, system, newton, motion, is_done)
      end do
      if (self%support%is_needed .and. any(status == [step_diverged, step_cycling])) then
         call look_for_slide(self, system, scene, motion, status)
      end if
   end subroutine active_set_solve

   !> No state of equilibrium was found: does a load move something along contacts that slide?
   subroutine look_for_slide(self, system, scene, motion, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(motion_t), intent(in) :: motion
      integer, intent(inout) :: status           !! becomes `step_not_held` if so
      logical :: is_held

      if (.not. self%friction%is_on) return
      call find_grips(self, system)
      call contact_support_find_free(self%support, system, scene, motion, &
         self%candidates%acts, is_held)
      if (is_held .or. .not. self%support%is_pushed) then
         if (allocated(self%support%text)) deallocate(self%support%text)
      else
         status = step_not_held
      end if
   end subroutine look_for_slide

   !> Begin the step again.
   subroutine begin_again(self, system, newton, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      integer :: n_newton

      n_newton = self%n_newton
      motion%du = self%guess%first
      newton%driven = self%guess%driven
      call active_set_restart(self, system, motion)
      self%n_newton = n_newton
   end subroutine begin_again

   !> Is a body free to move with the set that solves the step?
   subroutine look_for_free(self, system, scene, motion, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(motion_t), intent(in) :: motion
      integer, intent(inout) :: status           !! `step_not_held` if so
      logical :: is_held

      if (status /= step_done .or. .not. self%support%is_needed) return
      call find_grips(self, system)
      call find_ways(self)
      call contact_support_find_free(self%support, system, scene, motion, &
         self%candidates%acts, is_held)
      self%support%way = 0.0_wp
      if (.not. is_held) status = step_not_held
   end subroutine look_for_free

   !> Contacts that hold along the surface as well, where the step is solved: without a push
   !> friction holds nothing.
   pure subroutine find_grips(self, system)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer :: k, pair, i

      if (.not. self%friction%is_on) return
      self%support%grips = friction_holds(self%friction)
      do k = self%set%n_permanent + 1, self%set%n
         associate (id => self%set%id(k))
            call constraint_index(system, id, pair, i)
            self%support%grips(id) = self%support%grips(id) .and. self%set%lam(k) > &
               noise_at(self, system, system%contact(pair)%contact%node(i))
         end associate
      end do
   end subroutine find_grips

   !> What slides, and is pushed, holds across its way.
   pure subroutine find_ways(self)
      type(active_set_t), intent(inout) :: self
      integer :: k

      if (.not. self%friction%looks_back) return
      do k = self%set%n_permanent + 1, self%set%n
         associate (law => self%friction%law(self%set%id(k)), id => self%set%id(k))
            if (law%status%kind /= contact_slides .or. .not. self%set%lam(k) > 0.0_wp) cycle
            self%support%grips(id) = .true.
            self%support%way(:, id) = law%status%direction(:self%friction%n_slip)
         end associate
      end do
   end subroutine find_ways

   !> Begin the step again with convex corners that are not rounded: in statics, where a node that
   !> is pushed over a corner finds no place to stand but on its round top. `is_done`: not possible.
   subroutine begin_sharp(self, system, newton, motion, is_done)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      logical, intent(out) :: is_done
      integer :: pair

      is_done = self%rules%has_impacts
      if (is_done) return
      is_done = .true.
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact)
            if (contact%may_sharpen .and. .not. contact%step%is_sharp) is_done = .false.
         end associate
      end do
      if (is_done) return
      do pair = 1, size(system%contact)
         system%contact(pair)%contact%step%is_sharp = system%contact(pair)%contact%may_sharpen
      end do
      call begin_again(self, system, newton, motion)
   end subroutine begin_sharp

end module emcon_active_set_solve
