!> Flat interface, as emcon_flat: steps, and the state in and out.
module emcon_flat_state
   use, intrinsic :: iso_c_binding, only : c_double, c_f_pointer, c_int, c_int64_t, c_loc, &
      c_null_ptr, c_ptr
   use emcon_errors, only : err_input, error_t, raise
   use emcon_handle, only : handle_fail, handle_find, handle_fits, handle_pass, model_t
   use emcon_kinds, only : wp
   use emcon_march, only : increment_t
   use emcon_quantities, only : contact_quantity
   use emcon_restart, only : restart_read, restart_t, restart_write
   use emcon_stepper, only : stepper_advance, stepper_is_done, stepper_load, stepper_save
   use emcon_stepper_conditions, only : conditions_load, conditions_save
   use emcon_stepper_free, only : snapshot_t, stepper_check_open, stepper_next_step, &
      stepper_restore, stepper_set_state, stepper_snapshot, stepper_step
   use emcon_verdict_file, only : verdict_so_far
   implicit none
   private
   public :: advance, step, next_step, is_done, get_progress, get_field, set_state
   public :: get_contact, get_contact_values, get_pairs, get_ledger
   public :: ask_verdict, get_verdict
   public :: save_state, restore_state, free_state, write_restart, read_restart

contains

   !> One increment. `counts`: Newton iterations, cuts, active constraints; `values`: h, time,
   !> deepest penetration per edge.
   subroutine advance(handle, counts, values, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(out) :: counts(3)
      real(c_double), intent(out) :: values(3)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(increment_t) :: increment
      type(error_t), allocatable :: error
      !f2py threadsafe

      counts = 0
      values = 0.0_c_double
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      if (stepper_is_done(model%stepper)) then
         call handle_fail(model, "the analysis is at its end", err_input, ierr)
         return
      end if
      call stepper_advance(model%stepper, increment, error)
      call handle_pass(model, error, ierr)
      counts = [increment%n_newton, increment%n_cut, increment%n_active]
      values = [real(increment%h, c_double), real(model%stepper%march%state%time, c_double), &
         real(increment%overlap%depth, c_double)]
   end subroutine advance

   !> One step of the size `h`; the rest as `advance`.
   subroutine step(handle, h, counts, values, ierr)
      integer(c_int64_t), intent(in) :: handle
      real(c_double), intent(in) :: h
      integer(c_int), intent(out) :: counts(3)
      real(c_double), intent(out) :: values(3)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(increment_t) :: increment
      type(error_t), allocatable :: error
      !f2py threadsafe

      counts = 0
      values = 0.0_c_double
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call stepper_step(model%stepper, real(h, wp), increment, error)
      call handle_pass(model, error, ierr)
      counts = [increment%n_newton, increment%n_cut, increment%n_active]
      values = [real(increment%h, c_double), real(model%stepper%march%state%time, c_double), &
         real(increment%overlap%depth, c_double)]
   end subroutine step

   !> Begin the next step of the deck now.
   subroutine next_step(handle, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      !f2py threadsafe

      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call stepper_next_step(model%stepper, error)
      call handle_pass(model, error, ierr)
   end subroutine next_step

   !> 1 after the last increment of the last step.
   subroutine is_done(handle, done, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(out) :: done
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model

      done = 0
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      if (stepper_is_done(model%stepper)) done = 1
   end subroutine is_done

   !> Total time, its step of the deck from 1, increments made, and unknowns in this step.
   subroutine get_progress(handle, time, counts, ierr)
      integer(c_int64_t), intent(in) :: handle
      real(c_double), intent(out) :: time
      integer(c_int), intent(out) :: counts(3)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model

      time = 0.0_c_double
      counts = 0
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      associate (march => model%stepper%march)
         time = real(march%state%time, c_double)
         counts = [march%state%i_step, march%state%increment, march%system%numbering%n_unknown]
      end associate
   end subroutine get_progress

   !> A field of the state: 1 displacements, 2 velocities.
   subroutine get_field(handle, number, n_node, field, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: number
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(out) :: field(2, n_node)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model

      field = 0.0_c_double
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      if (.not. handle_fits(model, n_node, model%stepper%march%system%solid%n_node, ierr)) return
      if (number == 1) then
         field = real(model%stepper%march%state%u, c_double)
      else
         field = real(model%stepper%march%state%v, c_double)
      end if
   end subroutine get_field

   !> Put parts of the state in place of the present ones; on an error nothing changes. Arrays of
   !> size 0 are not given; nor is `time` where `has_time` is 0. `active`: 1 acts, 0 does not.
   subroutine set_state(handle, u, v, lam, active, time, has_time, n_u, n_v, n_lam, n_active, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_u, n_v         !! 0 or n_node
      integer(c_int), intent(in) :: n_lam, n_active  !! 0 or n_constraint
      real(c_double), intent(in) :: u(2, n_u)
      real(c_double), intent(in) :: v(2, n_v)
      real(c_double), intent(in) :: lam(n_lam)
      integer(c_int), intent(in) :: active(n_active)
      real(c_double), intent(in) :: time
      integer(c_int), intent(in) :: has_time
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: new_u(:, :), new_v(:, :), new_lam(:), new_time
      logical, allocatable :: new_active(:)
      integer :: before

      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      before = model%stepper%march%system%linear%n   ! ties and equations stand before contact
      if (n_u > 0) new_u = real(u, wp)
      if (n_v > 0) new_v = real(v, wp)
      if (n_lam > 0) new_lam = [model%stepper%march%state%lam(:before), real(lam, wp)]
      if (n_active > 0) new_active = [model%stepper%march%state%is_active(:before), active /= 0]
      if (has_time /= 0) new_time = real(time, wp)
      call stepper_set_state(model%stepper, error, new_u, new_v, new_lam, new_active, new_time)
      call handle_pass(model, error, ierr)
   end subroutine set_state

   !> Multipliers (contact forces), active flags and slave node labels of all possible constraints.
   subroutine get_contact(handle, n_constraint, lam, active, label, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_constraint
      real(c_double), intent(out) :: lam(n_constraint)
      integer(c_int), intent(out) :: active(n_constraint)
      integer(c_int), intent(out) :: label(n_constraint)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      integer :: i, first, last, before

      lam = 0.0_c_double
      active = 0
      label = 0
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      associate (system => model%stepper%march%system, &
            state => model%stepper%march%state, scene => model%stepper%scene)
         before = system%linear%n
         if (.not. handle_fits(model, n_constraint, system%n_constraint - before, ierr)) return
         lam = real(state%lam(before + 1:), c_double)
         active = merge(1, 0, state%is_active(before + 1:))
         do i = 1, size(system%contact)
            first = system%first_constraint(i) - before + 1
            last = system%first_constraint(i + 1) - before
            label(first:last) = scene%node_label(system%contact(i)%contact%node)
         end do
      end associate
   end subroutine get_contact

   !> Of all possible constraints: 1 contact pressures, 2 gaps, NaN where no surface is near.
   subroutine get_contact_values(handle, number, n_constraint, values, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: number
      integer(c_int), intent(in) :: n_constraint
      real(c_double), intent(out) :: values(n_constraint)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      real(c_double), allocatable :: quantity(:, :)
      integer :: before

      values = 0.0_c_double
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      before = model%stepper%march%system%linear%n   ! ties and equations stand before contact
      if (.not. handle_fits(model, n_constraint, model%stepper%march%system%n_constraint - before, &
         ierr)) return
      quantity = contact_quantity(model%stepper, merge("CSTR", "CDIS", number == 1))
      values = quantity(1, before + 1:)
   end subroutine get_contact_values

   !> Of each contact pair: fx, fy, moment about the origin on the slave side, the same on the
   !> master side, length in contact; and active constraints.
   subroutine get_pairs(handle, n_pair, total, active, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_pair
      real(c_double), intent(out) :: total(7, n_pair)
      integer(c_int), intent(out) :: active(n_pair)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      integer :: k

      total = 0.0_c_double
      active = 0
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      associate (pair => model%stepper%march%state%pairs%total)
         if (.not. handle_fits(model, n_pair, size(pair), ierr)) return
         do k = 1, n_pair
            total(1:3, k) = real(pair(k)%slave, c_double)
            total(4:6, k) = real(pair(k)%master, c_double)
            total(7, k) = real(pair(k)%length, c_double)
            active(k) = pair(k)%n_active
         end do
      end associate
   end subroutine get_pairs

   !> Kinetic and strain energy, that of given forces, work of external forces, of contact, of what
   !> stabilization bears, total, px, py, lz.
   subroutine get_ledger(handle, values, ierr)
      integer(c_int64_t), intent(in) :: handle
      real(c_double), intent(out) :: values(10)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model

      values = 0.0_c_double
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      associate (ledger => model%stepper%march%ledger)
         values(:7) = [real(ledger%kinetic, c_double), real(ledger%strain, c_double), &
            real(ledger%potential, c_double), real(ledger%external_work, c_double), &
            real(ledger%contact_work, c_double), real(ledger%stabilization, c_double), &
            real(ledger%total, c_double)]
         values(8:) = [real(ledger%momentum, c_double), real(ledger%angular, c_double)]
      end associate
   end subroutine get_ledger

   !> Pass the verdict on the increments so far; its text has `length` characters.
   subroutine ask_verdict(handle, length, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(out) :: length
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      logical :: is_good

      length = 0
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call verdict_so_far(model%stepper%verdict, model%stepper%march, model%verdict, is_good)
      length = len(model%verdict)
   end subroutine ask_verdict

   !> The verdict that was asked for, a line of JSON.
   subroutine get_verdict(handle, length, text, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: length
      character(len=length), intent(out) :: text
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model

      text = " "
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      if (allocated(model%verdict)) text = model%verdict
   end subroutine get_verdict

   !> Keep the present state: `snapshot` is a handle of its own, to be freed by `free_state`.
   subroutine save_state(handle, snapshot, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int64_t), intent(out) :: snapshot
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(snapshot_t), pointer :: kept
      type(error_t), allocatable :: error

      snapshot = 0
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call stepper_check_open(model%stepper, error)
      call handle_pass(model, error, ierr)
      if (allocated(error)) return
      allocate(kept)
      call stepper_snapshot(model%stepper, kept)
      snapshot = transfer(c_loc(kept), snapshot)
   end subroutine save_state

   !> Go back, or forward, to the state that was kept.
   subroutine restore_state(handle, snapshot, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int64_t), intent(in) :: snapshot
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(snapshot_t), pointer :: kept
      type(error_t), allocatable :: error
      !f2py threadsafe

      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call find_snapshot(snapshot, kept)
      if (associated(kept)) then
         call stepper_restore(model%stepper, kept, error)
      else
         call raise(error, err_input, "the state was freed")
      end if
      call handle_pass(model, error, ierr)
   end subroutine restore_state

   !> Free a kept state; harmless for 0.
   subroutine free_state(snapshot)
      integer(c_int64_t), intent(in) :: snapshot
      type(snapshot_t), pointer :: kept

      call find_snapshot(snapshot, kept)
      if (associated(kept)) deallocate(kept)
   end subroutine free_state

   !> The kept state of a handle; null for 0.
   subroutine find_snapshot(snapshot, kept)
      integer(c_int64_t), intent(in) :: snapshot
      type(snapshot_t), pointer, intent(out) :: kept
      type(c_ptr) :: address

      kept => null()
      if (snapshot == 0) return
      address = transfer(snapshot, c_null_ptr)
      call c_f_pointer(address, kept)
   end subroutine find_snapshot

   !> Write deck, state and conditions of the present step to a restart file.
   subroutine write_restart(handle, path, ierr)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: path
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(restart_t) :: restart
      type(error_t), allocatable :: error
      !f2py threadsafe

      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      if (.not. allocated(model%stepper%source%line)) then
         call handle_fail(model, "a restart file holds the deck, and this model has none", &
            err_input, ierr)
         return
      end if
      call stepper_save(model%stepper, restart)
      call conditions_save(model%stepper, restart)
      call restart_write(restart, trim(path), error)
      call handle_pass(model, error, ierr)
   end subroutine write_restart

   !> Build the model of a restart file, in the state that it holds, into a model without contents.
   subroutine read_restart(handle, path, ierr)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: path
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(restart_t) :: restart
      type(error_t), allocatable :: error
      !f2py threadsafe

      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call restart_read(restart, trim(path), error)
      if (.not. allocated(error)) call stepper_load(model%stepper, restart, error)
      if (.not. allocated(error)) call conditions_load(model%stepper, restart, error)
      call handle_pass(model, error, ierr)
   end subroutine read_restart

end module emcon_flat_state
