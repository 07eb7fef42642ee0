!> The flat interface that f2py wraps: integer handles, plain arrays, a status last.
!>
!> Status 0 is success; otherwise a code of emcon_errors, with the text in `last_error`. Arrays are
!> (2, n), on the Python side the transposed view of (n, 2).
module emcon_flat
   use, intrinsic :: iso_c_binding, only : c_double, c_int
   use emcon_dgrad10, only : dg_t
   use emcon_errors, only : err_input, err_none, error_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_response_plane, law_response_t, law_t
   use emcon_law_registry, only : law_create
   use emcon_march, only : increment_t
   use emcon_nts_gap, only : nts_gap
   use emcon_scene, only : material_t
   use emcon_stepper, only : stepper_advance, stepper_close, stepper_is_done, stepper_open, &
      stepper_t
   use emcon_text, only : string_t
   implicit none
   private
   public :: open_deck, close_model, last_error, model_size, advance, is_done
   public :: get_positions, get_state, get_contact, get_pairs, get_ledger, law_kernel, nts_kernel

   integer, parameter :: most_models = 256

   type :: slot_t
      type(stepper_t), allocatable :: stepper
   end type slot_t

   !> The open models; the handle is the place in this table.
   type(slot_t) :: slot(most_models)
   character(len=:), allocatable :: message

contains

   !> Text of the last failure, all messages of a deck one per line.
   subroutine last_error(text)
      character(len=8192), intent(out) :: text

      text = ""
      if (allocated(message)) text = message
   end subroutine last_error

   !> Read a deck and build its model. `overrides`: NAME=VALUE, one per line.
   subroutine open_deck(path, overrides, is_lenient, handle, ierr)
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: overrides
      integer(c_int), intent(in) :: is_lenient
      integer(c_int), intent(out) :: handle
      integer(c_int), intent(out) :: ierr
      type(error_t), allocatable :: error
      integer :: i

      handle = 0
      do i = 1, most_models
         if (allocated(slot(i)%stepper)) cycle
         handle = i
         exit
      end do
      if (handle == 0) then
         call fail("more than 256 models are open; close some", err_input, ierr)
         return
      end if
      allocate(slot(handle)%stepper)
      call stepper_open(slot(handle)%stepper, trim(path), lines_of(overrides), is_lenient /= 0, &
         error)
      ierr = err_none
      if (.not. allocated(error)) return
      call fail(error%message, error%code, ierr)
      if (allocated(slot(handle)%stepper%diagnostic)) then
         associate (text => slot(handle)%stepper%diagnostic)
            do i = 1, size(text)
               if (text(i)%text /= error%message) message = message // new_line("a") // text(i)%text
            end do
         end associate
      end if
      call close_model(handle)
      handle = 0
   end subroutine open_deck

   !> The lines of a text.
   function lines_of(text) result(line)
      character(len=*), intent(in) :: text
      type(string_t), allocatable :: line(:)
      type(string_t) :: new(1)
      integer :: first, last

      allocate(line(0))
      first = 1
      do while (first <= len_trim(text))
         last = index(text(first:), new_line("a"))
         if (last == 0) last = len_trim(text) - first + 2
         new(1)%text = text(first:first + last - 2)
         line = [line, new]
         first = first + last
      end do
   end function lines_of

   subroutine fail(text, code, ierr)
      character(len=*), intent(in) :: text
      integer, intent(in) :: code
      integer(c_int), intent(out) :: ierr

      message = text
      ierr = code
   end subroutine fail

   !> Is there a model with this handle? If not, `ierr` says so.
   logical function is_open(handle, ierr)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(out) :: ierr

      is_open = handle >= 1 .and. handle <= most_models
      if (is_open) is_open = allocated(slot(handle)%stepper)
      ierr = err_none
      if (.not. is_open) call fail("the model is closed", err_input, ierr)
   end function is_open

   !> Free a model; harmless if it is closed.
   subroutine close_model(handle)
      integer(c_int), intent(in) :: handle
      ! Freed on return: gfortran 12 cannot deallocate in place.
      type(stepper_t), allocatable :: closed
      integer(c_int) :: ierr

      if (.not. is_open(handle, ierr)) return
      call move_alloc(slot(handle)%stepper, closed)
      call stepper_close(closed)
   end subroutine close_model

   !> Nodes, elements, possible contact constraints, bodies, unknowns, steps, contact pairs.
   subroutine model_size(handle, n, ierr)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(out) :: n(7)
      integer(c_int), intent(out) :: ierr

      n = 0
      if (.not. is_open(handle, ierr)) return
      associate (system => slot(handle)%stepper%march%system)
         n = [system%solid%n_node, system%solid%n_element, &
            system%n_constraint - system%linear%n, system%n_body, &
            system%numbering%n_unknown, size(slot(handle)%stepper%scene%step), &
            size(system%contact)]
      end associate
   end subroutine model_size

   !> One increment. `counts`: Newton iterations, cuts, active constraints; `times`: h, time.
   subroutine advance(handle, counts, times, ierr)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(out) :: counts(3)
      real(c_double), intent(out) :: times(2)
      integer(c_int), intent(out) :: ierr
      type(increment_t) :: increment
      type(error_t), allocatable :: error

      counts = 0
      times = 0.0_c_double
      if (.not. is_open(handle, ierr)) return
      if (stepper_is_done(slot(handle)%stepper)) then
         call fail("the analysis is at its end", err_input, ierr)
         return
      end if
      call stepper_advance(slot(handle)%stepper, increment, error)
      if (allocated(error)) call fail(error%message, error%code, ierr)
      counts = [increment%n_newton, increment%n_cut, increment%n_active]
      times = [real(increment%h, c_double), real(slot(handle)%stepper%march%state%time, c_double)]
   end subroutine advance

   !> 1 after the last increment of the last step.
   subroutine is_done(handle, done, ierr)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(out) :: done
      integer(c_int), intent(out) :: ierr

      done = 0
      if (.not. is_open(handle, ierr)) return
      if (stepper_is_done(slot(handle)%stepper)) done = 1
   end subroutine is_done

   !> Reference positions and labels of the nodes.
   subroutine get_positions(handle, n_node, x, label, ierr)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(out) :: x(2, n_node)
      integer(c_int), intent(out) :: label(n_node)
      integer(c_int), intent(out) :: ierr

      x = 0.0_c_double
      label = 0
      if (.not. fits(handle, n_node, ierr)) return
      x = real(slot(handle)%stepper%scene%x, c_double)
      label = slot(handle)%stepper%scene%node_label
   end subroutine get_positions

   !> Is the model open, and has it `n_node` nodes?
   logical function fits(handle, n_node, ierr)
      integer(c_int), intent(in) :: handle, n_node
      integer(c_int), intent(out) :: ierr

      fits = is_open(handle, ierr)
      if (.not. fits) return
      fits = n_node == slot(handle)%stepper%march%system%solid%n_node
      if (.not. fits) call fail("the arrays do not have the size of the model", err_input, ierr)
   end function fits

   !> Displacements and velocities.
   subroutine get_state(handle, n_node, u, v, ierr)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(out) :: u(2, n_node)
      real(c_double), intent(out) :: v(2, n_node)
      integer(c_int), intent(out) :: ierr

      u = 0.0_c_double
      v = 0.0_c_double
      if (.not. fits(handle, n_node, ierr)) return
      u = real(slot(handle)%stepper%march%state%u, c_double)
      v = real(slot(handle)%stepper%march%state%v, c_double)
   end subroutine get_state

   !> Multipliers (contact forces), active flags and slave node labels of all possible constraints.
   subroutine get_contact(handle, n_constraint, lam, active, label, ierr)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(in) :: n_constraint
      real(c_double), intent(out) :: lam(n_constraint)
      integer(c_int), intent(out) :: active(n_constraint)
      integer(c_int), intent(out) :: label(n_constraint)
      integer(c_int), intent(out) :: ierr
      integer :: i, first, last, before

      lam = 0.0_c_double
      active = 0
      label = 0
      if (.not. is_open(handle, ierr)) return
      associate (system => slot(handle)%stepper%march%system, &
            state => slot(handle)%stepper%march%state, scene => slot(handle)%stepper%scene)
         before = system%linear%n
         if (n_constraint /= system%n_constraint - before) then
            call fail("the arrays do not have the size of the model", err_input, ierr)
            return
         end if
         lam = real(state%lam(before + 1:), c_double)
         active = merge(1, 0, state%is_active(before + 1:))
         do i = 1, size(system%contact)
            first = system%first_constraint(i) - before + 1
            last = system%first_constraint(i + 1) - before
            label(first:last) = scene%node_label(system%contact(i)%contact%node)
         end do
      end associate
   end subroutine get_contact

   !> Of each contact pair: fx, fy, moment about the origin on the slave side, the same on the
   !> master side, length in contact; and active constraints.
   subroutine get_pairs(handle, n_pair, total, active, ierr)
      integer(c_int), intent(in) :: handle
      integer(c_int), intent(in) :: n_pair
      real(c_double), intent(out) :: total(7, n_pair)
      integer(c_int), intent(out) :: active(n_pair)
      integer(c_int), intent(out) :: ierr
      integer :: k

      total = 0.0_c_double
      active = 0
      if (.not. is_open(handle, ierr)) return
      associate (pair => slot(handle)%stepper%march%state%pairs%total)
         if (n_pair /= size(pair)) then
            call fail("the arrays do not have the size of the model", err_input, ierr)
            return
         end if
         do k = 1, n_pair
            total(1:3, k) = real(pair(k)%slave, c_double)
            total(4:6, k) = real(pair(k)%master, c_double)
            total(7, k) = real(pair(k)%length, c_double)
            active(k) = pair(k)%n_active
         end do
      end associate
   end subroutine get_pairs

   !> Kinetic and strain energy, external and contact work, total, px, py, lz.
   subroutine get_ledger(handle, values, ierr)
      integer(c_int), intent(in) :: handle
      real(c_double), intent(out) :: values(8)
      integer(c_int), intent(out) :: ierr

      values = 0.0_c_double
      if (.not. is_open(handle, ierr)) return
      associate (ledger => slot(handle)%stepper%march%ledger)
         values(:5) = [real(ledger%kinetic, c_double), real(ledger%strain, c_double), &
            real(ledger%external_work, c_double), real(ledger%contact_work, c_double), &
            real(ledger%total, c_double)]
         values(6:) = [real(ledger%momentum, c_double), real(ledger%angular, c_double)]
      end associate
   end subroutine get_ledger

   !> Response of a law (1 linear, 2 neo-Hooke, 3 coupled neo-Hooke) to a strain that goes from
   !> `strain` to `strain + dstrain`; components 11, 22, 2*12.
   subroutine law_kernel(law, constants, strain, dstrain, energy, stress, tangent, ierr)
      integer(c_int), intent(in) :: law
      real(c_double), intent(in) :: constants(2)
      real(c_double), intent(in) :: strain(3), dstrain(3)
      real(c_double), intent(out) :: energy
      real(c_double), intent(out) :: stress(3)
      real(c_double), intent(out) :: tangent(3, 3)
      integer(c_int), intent(out) :: ierr
      type(material_t) :: material
      class(law_t), allocatable :: object
      type(law_response_t) :: response
      type(error_t), allocatable :: error

      energy = 0.0_c_double
      stress = 0.0_c_double
      tangent = 0.0_c_double
      ierr = err_none
      material%name = "KERNEL"
      material%law = law
      material%constant = real(constants, wp)
      call law_create(material, object, error)
      if (allocated(error)) then
         call fail("there is no law of this number", err_input, ierr)
         return
      end if
      call law_response_plane(object, real(strain, wp), real(dstrain, wp), response)
      energy = real(response%energy, c_double)
      stress = real(response%stress, c_double)
      tangent = real(response%tangent, c_double)
   end subroutine law_kernel

   !> Gap of a slave node over an edge and its neighbours, with its derivatives. Columns of `x0` and
   !> `dx`: slave, edge, node before and after the edge (`has_before`, `has_after`: 0 or 1).
   subroutine nts_kernel(x0, dx, has_before, has_after, rounding, gap, g, c, h)
      real(c_double), intent(in) :: x0(2, 5), dx(2, 5)
      integer(c_int), intent(in) :: has_before, has_after
      real(c_double), intent(in) :: rounding     !! length over which corners are rounded
      real(c_double), intent(out) :: gap(3)      !! at the start, at the end, difference
      real(c_double), intent(out) :: g(10), c(10), h(10, 10)
      type(dg_t) :: number

      number = nts_gap(real(x0, wp), real(dx, wp), merge(4, 0, has_before /= 0), &
         merge(5, 0, has_after /= 0), real(rounding, wp))
      gap = [real(number%f0, c_double), real(number%f1, c_double), real(number%df, c_double)]
      g = real(number%g, c_double)
      c = real(number%c, c_double)
      h = real(number%h, c_double)
   end subroutine nts_kernel

end module emcon_flat
