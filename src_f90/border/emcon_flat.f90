!> The flat interface that f2py wraps: handles, plain arrays, a status last.
!>
!> Status 0 is success; otherwise a code of emcon_errors, with the text in `last_error` of the same
!> handle. Handle 0 is a closed model. Arrays are (2, n), on the Python side the transposed view of
!> (n, 2). Only deeds that take long let other Python threads run meanwhile.
module emcon_flat
   use, intrinsic :: iso_c_binding, only : c_double, c_int, c_int64_t
   use emcon_dgrad10, only : dg_t
   use emcon_errors, only : err_none, error_t
   use emcon_handle, only : handle_build, handle_find, handle_fits, handle_free, handle_new, &
      handle_read, model_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_response_plane, law_response_t, law_t
   use emcon_law_registry, only : law_create, law_rows, n_constant
   use emcon_nts_gap, only : nts_gap
   implicit none
   private
   public :: new_model, read_deck, build_model, close_model, last_error, model_size, get_positions
   public :: count_notes, get_note, count_laws, get_law_row, law_kernel, nts_kernel

contains

   !> Text of the last failure of a model, all messages of a deck one per line.
   subroutine last_error(handle, text)
      integer(c_int64_t), intent(in) :: handle
      character(len=8192), intent(out) :: text
      type(model_t), pointer :: model
      integer(c_int) :: ierr

      call handle_find(handle, model, ierr)
      text = "the model is closed"
      if (associated(model)) text = model%message
   end subroutine last_error

   !> A handle of a model without contents.
   subroutine new_model(handle)
      integer(c_int64_t), intent(out) :: handle

      handle = handle_new()
   end subroutine new_model

   !> Read a deck into a new model. `overrides`: NAME=VALUE, one per line.
   subroutine read_deck(handle, path, overrides, is_lenient, ierr)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: overrides
      integer(c_int), intent(in) :: is_lenient
      integer(c_int), intent(out) :: ierr
      !f2py threadsafe

      call handle_read(handle, path, overrides, is_lenient /= 0, ierr)
   end subroutine read_deck

   !> Build the model of the deck that was read, and begin its first step.
   subroutine build_model(handle, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(out) :: ierr
      !f2py threadsafe

      call handle_build(handle, ierr)
   end subroutine build_model

   !> Free a model; harmless for 0.
   subroutine close_model(handle)
      integer(c_int64_t), intent(in) :: handle

      call handle_free(handle)
   end subroutine close_model

   !> Nodes, elements, possible contact constraints, bodies, unknowns, steps, contact pairs.
   subroutine model_size(handle, n, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(out) :: n(7)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model

      n = 0
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      associate (system => model%stepper%march%system)
         n = [system%solid%n_node, system%solid%n_element, &
            system%n_constraint - system%linear%n, system%n_body, &
            system%numbering%n_unknown, size(model%stepper%scene%step), &
            system%n_pair]
      end associate
   end subroutine model_size

   !> Reference positions and labels of the nodes.
   subroutine get_positions(handle, n_node, x, label, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(out) :: x(2, n_node)
      integer(c_int), intent(out) :: label(n_node)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model

      x = 0.0_c_double
      label = 0
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      if (.not. handle_fits(model, n_node, model%stepper%march%system%solid%n_node, ierr)) return
      x = real(model%stepper%scene%x, c_double)
      label = model%stepper%scene%node_label
   end subroutine get_positions

   !> Remarks on the deck, and on what was done before the first step.
   subroutine count_notes(handle, n, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(out) :: n
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model

      n = 0
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      n = size(model%stepper%diagnostic) + model%stepper%notes%n
   end subroutine count_notes

   !> Remark `i`, from 1.
   subroutine get_note(handle, i, text, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: i
      character(len=1024), intent(out) :: text
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      integer :: n

      text = " "
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      n = size(model%stepper%diagnostic)
      if (i <= n) text = model%stepper%diagnostic(i)%text
      if (i > n) text = model%stepper%notes%item(i - n)%text
   end subroutine get_note

   !> Number of rows of the table of laws.
   subroutine count_laws(n)
      integer(c_int), intent(out) :: n

      n = size(law_rows)
   end subroutine count_laws

   !> Row `i` of the table of laws, from 1: its name, its keyword and parameter in decks, and the
   !> names of its constants, separated by blanks.
   subroutine get_law_row(i, code, name, keyword, variant, constants)
      integer(c_int), intent(in) :: i
      integer(c_int), intent(out) :: code
      character(len=32), intent(out) :: name, keyword, variant
      character(len=128), intent(out) :: constants
      integer :: k

      associate (row => law_rows(i))
         code = row%code
         name = row%name
         keyword = row%keyword
         variant = row%variant
         constants = ""
         do k = 1, n_constant(row)
            constants = trim(constants) // " " // row%constant(k)
         end do
         constants = adjustl(constants)
      end associate
   end subroutine get_law_row

   !> Response of a law, by its code in the table, to a strain that goes from `strain` to
   !> `strain + dstrain`; components 11, 22, 2*12.
   subroutine law_kernel(law, n, constants, strain, dstrain, energy, stress, tangent, ierr)
      integer(c_int), intent(in) :: law
      integer(c_int), intent(in) :: n            !! number of constants
      real(c_double), intent(in) :: constants(n)
      real(c_double), intent(in) :: strain(3), dstrain(3)
      real(c_double), intent(out) :: energy
      real(c_double), intent(out) :: stress(3)
      real(c_double), intent(out) :: tangent(3, 3)
      integer(c_int), intent(out) :: ierr
      class(law_t), allocatable :: object
      type(law_response_t) :: response
      type(error_t), allocatable :: error

      energy = 0.0_c_double
      stress = 0.0_c_double
      tangent = 0.0_c_double
      ierr = err_none
      call law_create(law, real(constants, wp), object, error)
      if (allocated(error)) ierr = error%code
      if (allocated(error)) return
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
         merge(5, 0, has_after /= 0), spread(spread(real(rounding, wp), 1, 2), 2, 2))
      gap = [real(number%f0, c_double), real(number%f1, c_double), real(number%df, c_double)]
      g = real(number%g, c_double)
      c = real(number%c, c_double)
      h = real(number%h, c_double)
   end subroutine nts_kernel

end module emcon_flat
