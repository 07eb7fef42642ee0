!> The march through time: increments on a grid, cut where a step fails, back on the grid exactly.
!>
!> Times are counted in integers: grid increments of h, and dyadic fractions of one when it is cut.
module emcon_march
   use emcon_active_set, only : active_set_init
   use emcon_correction, only : correction_free, correction_let_threads
   use emcon_errors, only : err_analysis, err_input, err_interrupt, error_t, raise
   use emcon_factor_policy, only : factor_policy_forget
   use emcon_host, only : host_copy_solvers, host_t
   use emcon_host_scheme, only : host_scheme_find
   use emcon_kinds, only : wp
   use emcon_layer, only : layer_free, layer_init
   use emcon_ledger, only : ledger_init, ledger_measure, ledger_t
   use emcon_march_begin, only : march_begin_step, march_renumber, march_resume
   use emcon_march_control, only : march_controlled
   use emcon_march_grid, only : easy_increments, march_grid_time, march_is_done, &
      march_next_corner, march_set_time, march_span
   use emcon_march_parts, only : march_in_parts
   use emcon_march_types, only : increment_t, march_t, watcher_t
   use emcon_motion, only : at_rest, motion_init
   use emcon_newton, only : interrupt_interface
   use emcon_options, only : option_words
   use emcon_overlap_check, only : overlap_check_init
   use emcon_pair_record, only : pair_record_init
   use emcon_pair_sums, only : pair_sums_init
   use emcon_rigid_rotation, only : rigid_rotation_init
   use emcon_scene, only : scene_t, where_text
   use emcon_scheme_registry, only : scheme_user
   use emcon_state, only : state_t
   use emcon_step_control, only : control_forget
   use emcon_system, only : system_init, system_springs
   use emcon_term_registry, only : terms_massless
   use emcon_text, only : to_text
   use emcon_velocity_mass, only : velocity_update_free
   implicit none
   private
   public :: march_t, increment_t, march_init, march_begin_step, march_increment, march_is_done, &
      march_resume, march_renumber, march_go_back, march_free, march_free_increment, &
      march_set_threads, march_set_time, march_watch

contains

   !> Build the system of `scene`, and of what it is given, and put it into its initial state.
   subroutine march_init(self, scene, error, host)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      type(host_t), intent(in), optional :: host

      call check_schemes(self, scene, error)
      if (.not. allocated(error)) call system_init(self%system, scene, error, host)
      if (allocated(error)) return
      allocate(self%massless%may_be(size(scene%x, 2)), &
         self%massless%without_density(size(scene%x, 2)))
      call terms_massless(self%system%term, self%massless%may_be, self%massless%without_density)
      call layer_init(self%layer, scene, self%massless%may_be, self%system, error, host)
      if (allocated(error)) return
      call host_copy_solvers(host, self%host%solver)
      call motion_init(self%motion, scene%x)
      allocate(self%end_state%v, source=at_rest(scene%x))
      associate (state => self%state)
         allocate(state%u, source=scene%u0)
         allocate(state%v, source=scene%v0)
         allocate(state%u_start, state%contact, state%reaction, state%internal, &
            source=self%end_state%v)
         allocate(state%contacts%has_mass(size(scene%x, 2)), source=.false.)
         call state%contacts%begin(self%system%n_constraint)
         allocate(state%energy(size(scene%element%kind)), source=0.0_wp)
      end associate
      call pair_record_init(self%state%pairs, self%system)
      call rigid_rotation_init(self%state%turns, scene%rigid, scene%x, self%state%u)
      call pair_sums_init(self%state%sums, self%system, scene%pair)
      call active_set_init(self%active, self%system)
      associate (contacts => self%state%contacts, friction => self%active%friction)
         if (friction%is_on .or. any(system_springs(self%system))) then
            associate (n_slip => size(scene%x, 1) - 1, n => self%system%n_constraint)
               allocate(contacts%slip_path(n), contacts%slid(n_slip + 1, n), source=0.0_wp)
               allocate(contacts%slides_along(n_slip, n), contacts%drag(n_slip, n), &
                  contacts%slip(n_slip, n), source=0.0_wp)
               allocate(self%state%friction, source=self%state%contact)
            end associate
         else
            allocate(contacts%slip_path(0), contacts%slid(0, 0), self%state%friction(0, 0))
            allocate(contacts%slides_along, contacts%drag, contacts%slip, &
               source=0.0_wp*friction%tau)
         end if
      end associate
      call ledger_init(self%ledger, scene%n_dim)
      call overlap_check_init(self%overlap_check, scene)
   end subroutine march_init

   !> Each scheme that the deck calls by name was given.
   subroutine check_schemes(self, scene, error)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: known
      integer :: i

      do i = 1, size(scene%step)
         associate (choice => scene%step(i)%choice)
            if (scene%step(i)%scheme%code /= scheme_user) cycle
            if (host_scheme_find(self%host%scheme, choice%name) > 0) cycle
            call option_words("scheme", known)
            call raise(error, err_input, where_text(scene, choice%origin) // ": error: SCHEME=" // &
               choice%name // ": no program has given this scheme, see docs/embedding.md; EMCON " &
               // "has " // known)
            return
         end associate
      end do
   end subroutine check_schemes

   !> Free what the solvers hold; the rest goes with the object.
   subroutine march_free(self)
      type(march_t), intent(inout) :: self

      call correction_free(self%newton%correction)
      call velocity_update_free(self%velocity_update)
      call layer_free(self%layer)
   end subroutine march_free

   !> From now on `is_interrupted` is asked before each iteration of Newton's method, and `watcher`,
   !> which has to stay where it is, is told of each part of an increment.
   subroutine march_watch(self, is_interrupted, watcher)
      type(march_t), intent(inout) :: self
      procedure(interrupt_interface) :: is_interrupted   !! has the user asked to stop?
      class(watcher_t), target, optional, intent(inout) :: watcher   !! is told of parts

      nullify(self%watcher)
      if (present(watcher)) self%watcher => watcher
      self%newton%is_interrupted => is_interrupted
   end subroutine march_watch

   !> Advance by one increment; on failure the state is that of the last part that succeeded, after
   !> an interrupt that before the increment.
   subroutine march_increment(self, scene, increment, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(increment_t), intent(out) :: increment
      type(error_t), allocatable, intent(out) :: error
      integer :: stride

      associate (state => self%state, step => scene%step(self%state%clock%i_step))
         if (step%time%max_increments > 0 .and. &
            state%clock%increment - state%clock%n_before >= step%time%max_increments) then
            call raise(error, err_analysis, "the " // to_text(step%time%max_increments) // &
               " increments of *STEP, INC= are used up at time " // to_text(state%clock%time) &
               // " of " // to_text(state%clock%start_time + step%time%duration) // &
               "; raise INC=, or let increments be longer")
            return
         end if
         if (state%clock%is_off_grid) then
            call raise(error, err_input, "time " // to_text(state%clock%time, 9) &
               // " lies between " // "two increments of the deck; continue to time " &
               // to_text(state%clock%start_time + march_grid_time(self, step, state%clock%n_grid &
               + 1), 9) // " by a step whose size you give")
            return
         end if
         stride = min(state%clock%grid_stride, march_next_corner(self, state%clock%n_grid) &
            - state%clock%n_grid)
         if (self%grid%is_controlled) then
            call march_controlled(self, scene, increment, error)
         else
            call cross_grid(self, scene, state%clock%n_grid + stride, increment, error)
         end if
         if (allocated(error)) then
            call end_failed(self, scene, increment, error)
            return
         end if
         if (.not. self%grid%is_controlled) then
            state%clock%n_grid = state%clock%n_grid + stride
            state%clock%step_time = march_grid_time(self, step, state%clock%n_grid)
         end if
         state%clock%increment = state%clock%increment + 1
         state%clock%time = state%clock%start_time + state%clock%step_time
         increment%n_active = n_acting(self)
         if (increment%n_cut > 0) then
            state%clock%n_easy = 0
            state%clock%grid_stride = max(1, state%clock%grid_stride/2)
         else
            state%clock%n_easy = state%clock%n_easy + 1
            if (state%clock%n_easy >= easy_increments &
               .and. 2*state%clock%grid_stride <= self%grid%most_stride) then
               state%clock%grid_stride = 2*state%clock%grid_stride
               state%clock%n_easy = 0
            end if
         end if
      end associate
      call ledger_measure(self%ledger, self%system, scene%x, self%state)
   end subroutine march_increment

   !> An increment has failed, or was interrupted.
   subroutine end_failed(self, scene, increment, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(increment_t), intent(in) :: increment
      type(error_t), intent(in) :: error

      call factor_policy_forget(self%newton%factor_policy, self%newton%correction)
      if (error%code == err_interrupt) then
         if (allocated(self%before)) then
            self%state = self%before%state
            self%ledger = self%before%ledger
         end if
         return
      end if
      if (increment%done > 0.0_wp) call march_set_time(self, scene, self%state%clock%step_time &
         + increment%done)
      call ledger_measure(self%ledger, self%system, scene%x, self%state)
   end subroutine end_failed

   !> Let `n` threads work on the model: the bits are the same for any number.
   pure subroutine march_set_threads(self, n)
      type(march_t), intent(inout) :: self       !! set up
      integer, intent(in) :: n                   !! > 0

      self%system%response%n_thread = n
      call correction_let_threads(self%newton%correction, n)
   end subroutine march_set_threads

   !> Put a state of before in place of the present one; the kept factor is made again as it was.
   subroutine march_go_back(self, state, ledger)
      type(march_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(ledger_t), intent(in) :: ledger

      self%state = state
      self%ledger = ledger
      call factor_policy_forget(self%newton%factor_policy, self%newton%correction)
   end subroutine march_go_back

   !> Go to grid point `n_end` in one step, or in dyadic parts of one.
   subroutine cross_grid(self, scene, n_end, increment, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: n_end
      type(increment_t), intent(inout) :: increment
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: t0

      associate (step => scene%step(self%state%clock%i_step))
         t0 = march_grid_time(self, step, self%state%clock%n_grid)
         increment%h = march_span(self, step, self%state%clock%n_grid, n_end)
      end associate
      if (allocated(self%before)) deallocate(self%before)
      call march_in_parts(self, scene, t0, increment, error)
   end subroutine cross_grid

   !> One increment of any size `h` > 0 [T], off the grid of the deck, in parts where it fails. It
   !> may go beyond the end of the step: loads, boundary conditions and options are those of the
   !> step, and amplitudes and linear runs keep their last value. On an error nothing has changed.
   subroutine march_free_increment(self, scene, h, increment, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: h                  !! > 0 [T]
      type(increment_t), intent(out) :: increment
      type(error_t), allocatable, intent(out) :: error
      type(state_t) :: before
      type(ledger_t) :: ledger_before

      before = self%state
      ledger_before = self%ledger
      increment%h = h
      call control_forget(self%state%control)
      call march_in_parts(self, scene, self%state%clock%step_time, increment, error)
      if (allocated(error)) then
         call march_go_back(self, before, ledger_before)
         return
      end if
      self%state%clock%increment = self%state%clock%increment + 1
      call march_set_time(self, scene, before%clock%step_time + h)
      increment%n_active = n_acting(self)
      call ledger_measure(self%ledger, self%system, scene%x, self%state)
   end subroutine march_free_increment

   !> How many contacts act at the end of an increment.
   pure integer function n_acting(self)
      type(march_t), intent(in) :: self

      n_acting = self%state%contacts%n_acting(self%system%first_constraint(1) + 1, &
         self%system%n_constraint)
   end function n_acting

end module emcon_march
