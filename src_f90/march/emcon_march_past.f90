!> What a scheme knows of the steps before: forces at the start of a step, accelerations, the step
!> before. A step of the deck begins without.
!>
!> Source: docs/theory.md, eqs. (4a) to (4d).
module emcon_march_past
   use emcon_constraints, only : constraint_set_t, constraints_evaluate, constraints_select
   use emcon_errors, only : error_t
   use emcon_evaluation, only : instant_t, evaluation_at_end
   use emcon_kinds, only : wp
   use emcon_march_types, only : march_t
   use emcon_motion, only : at_rest, motion_of, motion_t
   use emcon_scene, only : scene_t
   use emcon_state, only : state_t
   use emcon_system, only : system_loads
   use emcon_term, only : role_external
   use emcon_velocity_update, only : velocity_update_accelerate
   implicit none
   private
   public :: march_past_begin, march_past_take, march_past_keep, march_past_forget

contains

   !> Nothing is known of the steps before `state`.
   pure subroutine march_past_forget(state)
      type(state_t), intent(inout) :: state

      state%history%has_past = .false.
      state%history%h_before = 0.0_wp
   end subroutine march_past_forget

   !> Let there be a past, where the scheme asks for one: loads, and what the balance at `start`
   !> accelerates.
   subroutine march_past_begin(self, scene, start, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(instant_t), intent(in) :: start       !! of the next step
      type(error_t), allocatable, intent(out) :: error
      type(motion_t) :: place

      associate (state => self%state, row => self%scheme%row)
         if (state%history%has_past .or. .not. row%looks_back) return
         if (allocated(state%history%past)) deallocate(state%history%past, state%history%load)
         allocate(state%history%past(size(scene%x, 1), size(scene%x, 2), row%n_past), source=0.0_wp)
         allocate(state%history%load, mold=scene%x)
         place = motion_of(evaluation_at_end, scene%x, state%u, at_rest(scene%x), state%v)
         place%evaluation%load_instant = start
         call system_loads(self%system, place, state%history%load)
         state%history%has_past = .true.
         if (row%is_accelerated) call accelerate(self, place, error)
      end associate
   end subroutine march_past_begin

   !> The acceleration by the forces of the state.
   subroutine accelerate(self, place, error)
      type(march_t), intent(inout) :: self
      type(motion_t), intent(in) :: place        !! of the state, placed
      type(error_t), allocatable, intent(out) :: error
      type(constraint_set_t) :: held
      integer :: k

      call constraints_select(held, pack([(k, k = 1, size(self%system%acts))], self%system%acts))
      call constraints_evaluate(held, self%system, place)
      associate (state => self%state)
         call velocity_update_accelerate(self%velocity_update, self%system, held, &
            state%history%load + state%contact - state%internal, state%v, &
            state%history%past(:, :, 1), error)
      end associate
   end subroutine accelerate

   !> What the past adds to the next step, for the `evaluation` of its motion.
   pure subroutine march_past_take(self)
      type(march_t), intent(inout) :: self
      integer :: k

      associate (motion => self%motion, state => self%state)
         if (allocated(motion%carried)) deallocate(motion%carried)
         if (allocated(motion%v_past)) deallocate(motion%v_past, motion%dv_past)
         if (allocated(motion%du_before)) deallocate(motion%du_before)
         if (.not. state%history%has_past) return
         if (motion%evaluation%recalled > 0.0_wp) motion%du_before = state%history%past(:, :, 1)
         if (motion%evaluation%start_weight > 0.0_wp) motion%carried &
            = motion%evaluation%start_weight *(state%internal - state%history%load - state%contact)
         if (size(state%history%past, 3) == 0) return
         motion%v_past = at_rest(motion%du)
         motion%dv_past = at_rest(motion%du)
         do k = 1, size(state%history%past, 3)
            motion%v_past = motion%v_past &
               + motion%evaluation%past_velocity(k)*state%history%past(:, :, k)
            motion%dv_past = motion%dv_past &
               + motion%evaluation%past_change(k)*state%history%past(:, :, k)
         end do
      end associate
   end subroutine march_past_take

   !> Keep of the step that was solved what the next ones look back on; velocities have not jumped
   !> yet.
   pure subroutine march_past_keep(self, h)
      type(march_t), intent(inout) :: self
      real(wp), intent(in) :: h                  !! of the step, > 0 [T]

      associate (state => self%state)
         if (.not. state%history%has_past) return
         if (size(state%history%past, 3) > 0) call self%scheme%carry(h, self%motion%du, &
            self%motion%v0, self%end_state%v, state%history%past)
         state%history%load = self%system%response%part(role_external)%force
         state%history%h_before = h
      end associate
   end subroutine march_past_keep

end module emcon_march_past
