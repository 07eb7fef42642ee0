!> Which constraints act in a step: a primal-dual active set around Newton's method.
!>
!> A constraint is taken in when its gap would be negative at the end of the step, and let go when
!> its multiplier is. If a set comes back, the union of the sets in the cycle is taken and
!> constraints are only added from then on: at once for persistent contact, which makes no energy
!> if it is held too long; else only where the step cannot be cut any more. Of constraints that say
!> nearly the same one acts until the other is needed too. Where Newton's method does not converge,
!> what pulls is let go before the step is cut; in statics, where no set stands, the step is tried
!> with sharp convex corners before. Linear constraints that are not eliminated act always. Source:
!> docs/theory.md, section 6.
module emcon_active_set_solve
   use emcon_active_set, only : active_set_drop, active_set_let_go, active_set_put_off, &
      active_set_restart, active_set_select, active_set_t, step_cycling, step_diverged, step_done, &
      step_loose, step_not_held, step_singular, step_too_far
   use emcon_active_set_update, only : active_set_advance, active_set_leave, active_set_narrow, &
      find_grips, most_early
   use emcon_contact_rounds, only : contact_rounds_solve
   use emcon_contact_support, only : contact_support_complete, contact_support_find_free
   use emcon_errors, only : error_t
   use emcon_friction, only : friction_holds, friction_idle, friction_keep
   use emcon_friction_referee, only : friction_referee
   use emcon_gaps, only : pair_search
   use emcon_kinds, only : wp
   use emcon_motion, only : motion_t
   use emcon_newton, only : newton_converged, newton_diverged, newton_early, newton_redundant, &
      newton_solve, newton_t
   use emcon_phases, only : phase_enter, phase_gaps, phase_leave
   use emcon_scene, only : scene_t
   use emcon_penalty, only : most_augmentations, penalty_augment, penalty_pulls
   use emcon_system, only : system_stiffen, system_t
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
      integer :: failed, pair

      self%first = motion%du
      self%driven = newton%driven
      if (self%is_one_problem) then
         call solve_as_one(self, system, scene, newton, motion, status, error)
      else
         call solve_set_by_set(self, system, scene, newton, motion, status, error)
         if (allocated(error) .or. .not. self%falls_back .or. self%has_impacts) return
         if (.not. any(status == [step_diverged, step_singular, step_cycling, step_too_far])) return
         failed = status
         do pair = 1, size(system%contact)
            system%contact(pair)%contact%step%is_sharp = .false.
         end do
         call begin_again(self, system, newton, motion)
         self%is_one_problem = .true.
         call solve_as_one(self, system, scene, newton, motion, status, error)
         self%is_one_problem = .false.
         if (status /= step_done) status = failed        ! which tells more of what is the matter
      end if
   end subroutine active_set_solve

   !> Begin the step again.
   subroutine begin_again(self, system, newton, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      integer :: n_newton

      n_newton = self%n_newton
      motion%du = self%first
      newton%driven = self%driven
      call active_set_restart(self, system, motion)
      self%n_newton = n_newton
   end subroutine begin_again

   !> One set after the other, until one stands.
   subroutine solve_set_by_set(self, system, scene, newton, motion, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      logical :: is_done, is_measured
      integer :: left

      is_measured = .false.
      do
         call phase_enter(system%phases, phase_gaps, left)
         if (self%support%is_needed) call hold(self, system, scene, newton%driven, motion)
         call active_set_select(self, system, motion, is_measured .and. .not. &
            self%support%is_needed)
         is_measured = .false.
         call phase_leave(system%phases, left)
         status = step_not_held
         if (allocated(self%support%text)) return
         self%before = motion%du
         newton%looks_early = (self%has_impacts .or. self%friction%is_on) .and. .not. &
            (self%only_adds .or. self%support%is_needed) .and. self%n_early < most_early
         call solve(self, system, newton, motion, status, error)
         if (allocated(error)) return
         call keep_multipliers(self)
         call friction_keep(self%friction, self%set)
         if (status == newton_redundant) then
            call leave_out(self, system, scene, newton%correction%redundant, &
               newton%correction%is_near)
            cycle
         end if
         if (status == newton_diverged) then
            call active_set_let_go(self, motion%du, is_done)
            if (is_done) call begin_sharp(self, system, newton, motion, is_done)
            if (is_done) return
            cycle
         end if
         newton%driven = 0.0_wp                         ! the prescribed motion is in `motion` now
         if (status == newton_early) then
            call active_set_leave(self, system, motion)
            is_measured = .true.
            cycle
         end if
         if (status /= newton_converged .or. size(system%contact) == 0 &
            .or. self%penalty%is_at_ends) return
         call phase_enter(system%phases, phase_gaps, left)
         call active_set_advance(self, system, motion, is_done, status)
         is_measured = status /= step_cycling
         call friction_referee(self, system, motion, newton%correction, is_done, status, error)
         if (allocated(error)) return
         if (is_done) call look_for_free(self, system, scene, motion, status)
         call phase_leave(system%phases, left)
         if (status == step_cycling) call begin_sharp(self, system, newton, motion, is_done)
         if (is_done) return
      end do
   end subroutine solve_set_by_set

   !> The step as one problem of its contacts; where that fails with sharp corners, if possible.
   subroutine solve_as_one(self, system, scene, newton, motion, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `step_` codes
      type(error_t), allocatable, intent(out) :: error
      logical :: is_done

      is_done = .false.
      do while (.not. is_done)
         if (self%support%is_needed) then
            call hold(self, system, scene, newton%driven, motion)
            status = step_not_held
            if (allocated(self%support%text)) return
            call system_stiffen(system, self%support%hangs)
         end if
         call contact_rounds_solve(self, system, newton, motion, status, error)
         if (allocated(error)) return
         if (status == step_done) then
            if (self%support%is_needed) call find_grips(self, system)
            call look_for_free(self, system, scene, motion, status)
            return
         end if
         call begin_sharp(self, system, newton, motion, is_done)
      end do
   end subroutine solve_as_one

   !> Is a body free to move with the set that solves the step?
   subroutine look_for_free(self, system, scene, motion, status)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(motion_t), intent(in) :: motion
      integer, intent(inout) :: status           !! `step_not_held` if so
      logical :: is_held

      if (status /= step_done .or. .not. self%support%is_needed) return
      call contact_support_find_free(self%support, system, scene, motion, self%is_active, is_held)
      if (.not. is_held) status = step_not_held
   end subroutine look_for_free

   !> Keep the multipliers of the set by the numbers of its constraints, without copies.
   pure subroutine keep_multipliers(self)
      type(active_set_t), intent(inout) :: self
      integer :: k

      do k = 1, self%set%n
         self%lam(self%set%id(k)) = self%set%lam(k)
      end do
   end subroutine keep_multipliers

   !> Leave out constraints that follow from others, or of what sticks its slip.
   subroutine leave_out(self, system, scene, redundant, is_near)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: redundant(:)        !! (any) rows of the set, from 1
      logical, intent(in) :: is_near(:)          !! (as many) they nearly do
      logical :: is_gap(size(redundant)), is_done

      is_gap = redundant <= self%set%n
      call friction_idle(self%friction, self%set, pack(redundant, .not. is_gap))
      self%n_tried = self%n_tried - 1
      if (.not. any(is_gap)) return
      call active_set_narrow(self, system, scene, pack(redundant, is_gap), is_done)
      if (is_done) return
      call active_set_put_off(self, pack(redundant, is_gap .and. is_near))
      call active_set_drop(self, pack(redundant, is_gap .and. .not. is_near))
   end subroutine leave_out

   !> Solve with the present set. Contacts that give way and are pushed back are solved again with
   !> the multipliers that came out, until nothing is left of their gaps, or until one pulls.
   subroutine solve(self, system, newton, motion, status, error)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      integer, intent(out) :: status             !! one of the `newton_` codes
      type(error_t), allocatable, intent(out) :: error
      logical :: is_done, may_leave
      integer :: i

      may_leave = newton%looks_early
      do i = 1, most_augmentations
         call newton_solve(newton, system, self%set, motion, status, error)
         if (allocated(error)) return
         self%n_newton = self%n_newton + newton%convergence%n_iteration
         if (status /= newton_converged) return
         newton%driven = 0.0_wp                         ! the prescribed motion is in `motion` now
         call penalty_augment(self%penalty, self%set, is_done)
         if (is_done) return
         if (may_leave .and. penalty_pulls(self%penalty, self%set)) then
            status = newton_early
            return
         end if
      end do
      status = step_loose
   end subroutine solve

   !> Begin the step again with convex corners that are not rounded: in statics, where a node that
   !> is pushed over a corner finds no place to stand but on its round top. `is_done`: not possible.
   subroutine begin_sharp(self, system, newton, motion, is_done)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(motion_t), intent(inout) :: motion
      logical, intent(out) :: is_done
      integer :: pair

      is_done = self%has_impacts
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

   !> Take in what holds the bodies that would be free with the present set. The prescribed motion
   !> `driven`, which the first correction of Newton's method meets, is left out on the way.
   subroutine hold(self, system, scene, driven, motion)
      type(active_set_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      real(wp), intent(in), contiguous :: driven(:, :)               !! (n_dim, n_node)
      type(motion_t), intent(inout) :: motion
      integer :: pair

      motion%du = motion%du - driven
      if (self%friction%is_on) self%support%grips = friction_holds(self%friction)
      call contact_support_complete(self%support, system, scene, motion, self%is_active)
      motion%du = motion%du + driven
      ! What follows from others holds no more than these, and would be dropped again for ever.
      self%is_active = self%is_active .and. .not. self%is_dropped
      do pair = 1, size(system%contact)
         call pair_search(system, pair, motion)
      end do
   end subroutine hold

end module emcon_active_set_solve
