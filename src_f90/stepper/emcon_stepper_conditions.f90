!> Boundary conditions changed between steps, and conditions in restart files.
!>
!> Changes hold for the present step of the deck, as `emcon_stepper_loads` has it.
module emcon_stepper_conditions
   use emcon_errors, only : error_t
   use emcon_factor_base, only : factor_base_t
   use emcon_kinds, only : wp
   use emcon_prescribed, only : prescribed_motion, ramp_turn
   use emcon_march, only : march_renumber
   use emcon_evaluation, only : instant_t
   use emcon_restart_data, only : restart_check, restart_exchange, restart_offers, restart_size, &
      restart_t
   use emcon_stepper, only : stepper_t
   use emcon_stepper_check, only : check_number, check_that, stepper_check_open
   use emcon_stepper_loads, only : loads_exchange
   use emcon_steps, only : load_t, prescribed_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: stepper_set_prescribed, stepper_add_prescribed, stepper_prescribe, &
      stepper_remove_prescribed
   public :: conditions_exchange

contains

   !> Give the boundary condition on degree of freedom `dof` of node `label` the value `value`.
   !> One that is FIXED runs to it from where it is.
   subroutine stepper_set_prescribed(self, label, dof, value, error)
      type(stepper_t), intent(inout) :: self
      integer, intent(in) :: label                   !! of the node, as in the deck
      integer, intent(in) :: dof                     !! 1, 2
      real(wp), intent(in) :: value                  !! [L]
      type(error_t), allocatable, intent(out) :: error
      type(instant_t) :: now
      real(wp) :: u, v
      integer :: node, k

      call find_prescribed(self, label, dof, node, k, error)
      call check_freedom(label, dof, "is not prescribed", k > 0, error)
      call check_number("the value", value, error)
      if (allocated(error)) return
      associate (item => self%scene%step(self%march%state%clock%i_step)%prescribed(k))
         if (item%turn > 0) call check_deformable(self, label, node, error)
      end associate
      if (allocated(error)) return
      associate (state => self%march%state, step => self%scene%step(self%march%state%clock%i_step))
         now = instant_t(state%clock%step_time, state%clock%time)
         call prescribed_motion(self%scene, step, step%prescribed(k), now, &
            state%u_start, u, v)
         if (step%prescribed(k)%amplitude == 0) call ramp_turn(step, state%clock%step_time, u, &
            value, state%u_start(dof, node))
         step%prescribed(k)%value = value
         step%prescribed(k)%is_frozen = .false.
      end associate
   end subroutine stepper_set_prescribed

   !> Prescribe the displacement of a degree of freedom that was free. The unknowns are numbered
   !> anew, the state stays.
   subroutine stepper_add_prescribed(self, label, dof, value, error)
      type(stepper_t), intent(inout) :: self
      integer, intent(in) :: label                   !! of the node, as in the deck
      integer, intent(in) :: dof                     !! 1, 2
      real(wp), intent(in) :: value                  !! [L]
      type(error_t), allocatable, intent(out) :: error
      type(prescribed_t) :: added
      type(prescribed_t), allocatable :: list(:)
      real(wp) :: u_start
      integer :: node, k

      call find_prescribed(self, label, dof, node, k, error)
      call check_freedom(label, dof, "is prescribed already", k == 0, error)
      call check_deformable(self, label, node, error)
      call check_number("the value", value, error)
      if (allocated(error)) return
      added%node = node
      added%dof = dof
      added%value = value
      u_start = self%march%state%u_start(dof, node)
      associate (state => self%march%state, step => self%scene%step(self%march%state%clock%i_step))
         call ramp_turn(step, state%clock%step_time, state%u(dof, node), value, &
            state%u_start(dof, node))
         list = [step%prescribed, added]
      end associate
      call renumber(self, list, error)
      if (allocated(error)) self%march%state%u_start(dof, node) = u_start
   end subroutine stepper_add_prescribed

   !> Give a boundary condition a value, or prescribe what was free.
   subroutine stepper_prescribe(self, label, dof, value, error)
      type(stepper_t), intent(inout) :: self
      integer, intent(in) :: label                   !! of the node, as in the deck
      integer, intent(in) :: dof                     !! 1, 2
      real(wp), intent(in) :: value                  !! [L]
      type(error_t), allocatable, intent(out) :: error
      integer :: node, k

      call find_prescribed(self, label, dof, node, k, error)
      if (allocated(error)) return
      if (k > 0) call stepper_set_prescribed(self, label, dof, value, error)
      if (k == 0) call stepper_add_prescribed(self, label, dof, value, error)
   end subroutine stepper_prescribe

   !> Set a prescribed degree of freedom free. The unknowns are numbered anew, the state stays.
   subroutine stepper_remove_prescribed(self, label, dof, error)
      type(stepper_t), intent(inout) :: self
      integer, intent(in) :: label                   !! of the node, as in the deck
      integer, intent(in) :: dof                     !! 1, 2
      type(error_t), allocatable, intent(out) :: error
      type(prescribed_t), allocatable :: list(:)
      integer :: node, k, i

      call find_prescribed(self, label, dof, node, k, error)
      call check_freedom(label, dof, "is not prescribed", k > 0, error)
      call check_deformable(self, label, node, error)
      if (allocated(error)) return
      associate (all_of => self%scene%step(self%march%state%clock%i_step)%prescribed)
         list = pack(all_of, [(i /= k, i = 1, size(all_of))])
      end associate
      call renumber(self, list, error)
      if (.not. allocated(error)) self%march%state%reaction(dof, node) = 0.0_wp
   end subroutine stepper_remove_prescribed

   !> Let `list` be the boundary conditions of the present step; on an error nothing changes.
   subroutine renumber(self, list, error)
      type(stepper_t), intent(inout) :: self
      type(prescribed_t), allocatable, intent(inout) :: list(:)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: ignored
      type(prescribed_t), allocatable :: before(:)

      associate (step => self%scene%step(self%march%state%clock%i_step))
         call move_alloc(step%prescribed, before)
         call move_alloc(list, step%prescribed)
         call march_renumber(self%march, self%scene, error)
         if (.not. allocated(error)) return
         deallocate(step%prescribed)
         call move_alloc(before, step%prescribed)
      end associate
      call march_renumber(self%march, self%scene, ignored)
   end subroutine renumber

   !> Put the conditions of the present step, and where in it the state is, into `restart`, after
   !> `stepper_save`; or take them over, after `stepper_load`. A restart file of the program, which
   !> changes no conditions, has none.
   subroutine conditions_exchange(self, restart, error)
      type(stepper_t), intent(inout) :: self
      type(restart_t), intent(inout) :: restart
      type(error_t), allocatable, intent(out) :: error
      type(prescribed_t), allocatable :: list(:)
      type(load_t), allocatable :: load(:), before(:)
      type(factor_base_t) :: base

      if (.not. restart_offers(restart, "step_time", .true.)) return
      call stepper_check_open(self, error)
      if (allocated(error)) return
      associate (state => self%march%state, step => self%scene%step(self%march%state%clock%i_step))
         if (restart%is_reading) then
            allocate(list(max(0, restart_size(restart, "prescribed_value"))))
         else
            allocate(list, source=step%prescribed)
         end if
         call restart_exchange(restart, "step_time", state%clock%step_time)
         call restart_exchange(restart, "is_off_grid", state%clock%is_off_grid)
         call loads_exchange(restart, self%scene, state%clock%i_step, load, error)
         if (allocated(error)) return
      end associate
      call restart_exchange(restart, "prescribed_place", list%node)
      call restart_exchange(restart, "prescribed_place", list%dof)
      call restart_exchange(restart, "prescribed_place", list%amplitude)
      call restart_exchange(restart, "prescribed_place", list%is_frozen)
      call restart_exchange(restart, "prescribed_place", list%turn)
      call restart_exchange(restart, "prescribed_value", list%value)
      call restart_check(restart, error)
      if (.not. restart%is_reading .or. allocated(error)) return
      base = self%march%state%base
      associate (step => self%scene%step(self%march%state%clock%i_step))
         call move_alloc(step%load, before)
         call move_alloc(load, step%load)
         call renumber(self, list, error)
         if (allocated(error)) call move_alloc(before, step%load)
      end associate
      self%march%state%base = base
   end subroutine conditions_exchange

   !> The node of label `label`, and the condition on its degree of freedom `dof`; 0: it is free.
   subroutine find_prescribed(self, label, dof, node, k, error)
      type(stepper_t), intent(in) :: self
      integer, intent(in) :: label, dof
      integer, intent(out) :: node, k
      type(error_t), allocatable, intent(out) :: error

      k = 0
      node = 0
      call stepper_check_open(self, error)
      if (.not. allocated(error)) node = findloc(self%scene%node%label, label, 1)
      call check_that(node > 0, "there is no node " // to_text(label), error)
      call check_that(dof >= 1 .and. dof <= self%scene%n_dim, "a node has the degrees of " // &
         "freedom 1 to " // to_text(self%scene%n_dim) // ", not " // to_text(dof), error)
      if (allocated(error)) return
      associate (list => self%scene%step(self%march%state%clock%i_step)%prescribed)
         k = findloc(list%node == node .and. list%dof == dof, .true., 1)
      end associate
   end subroutine find_prescribed

   !> An input error that says what a degree of freedom is, unless `holds`.
   !> What is prescribed of a rigid body stays as the deck has it.
   pure subroutine check_deformable(self, label, node, error)
      type(stepper_t), intent(in) :: self
      integer, intent(in) :: label, node
      type(error_t), allocatable, intent(inout) :: error
      integer :: b

      if (allocated(error)) return
      do b = 1, size(self%scene%rigid)
         call check_that(.not. any(self%scene%rigid(b)%node == node), "node " // to_text(label) &
            // " belongs to rigid body " // self%scene%rigid(b)%name // ": what is prescribed of " &
            // "it stays as the deck has it", error)
      end do
   end subroutine check_deformable

   pure subroutine check_freedom(label, dof, what, holds, error)
      integer, intent(in) :: label, dof
      character(len=*), intent(in) :: what
      logical, intent(in) :: holds
      type(error_t), allocatable, intent(inout) :: error

      call check_that(holds, "degree of freedom " // to_text(dof) // " of node " &
         // to_text(label) // " " // what, error)
   end subroutine check_freedom

end module emcon_stepper_conditions
