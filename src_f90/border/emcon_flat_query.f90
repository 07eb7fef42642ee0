!> Flat interface, as emcon_flat: what the engine computes for a step, asked for from outside.
!>
!> A matrix takes two calls: the first makes it, keeps it in the model and tells its sizes (rows,
!> columns, entries), `get_csr` copies it out.
module emcon_flat_query
   use, intrinsic :: iso_c_binding, only : c_double, c_int, c_int64_t
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_input, error_t
   use emcon_handle, only : at_df, at_links, at_mass, at_p, handle_fail, handle_find, &
      handle_fits, handle_pass, model_t
   use emcon_kinds, only : wp
   use emcon_stepper_constraints, only : query_constraints, query_curvature_times, query_links, &
      query_multipliers, query_null_space
   use emcon_stepper_query, only : query_evaluate, query_guess, query_mass, query_momenta, &
      query_residual, query_tangent, query_unknowns
   use emcon_text, only : to_text
   implicit none
   private
   public :: guess, evaluate, get_residual, get_unknown_residual, get_unknowns, get_momenta, &
      get_multipliers
   public :: make_matrix, make_null_space, get_csr
   public :: constraints, get_constraints, curvature_times

contains

   !> Where a step of size `h` would start its iteration.
   subroutine guess(handle, h, n_node, u1, ierr)
      integer(c_int64_t), intent(in) :: handle
      real(c_double), intent(in) :: h
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(out) :: u1(2, n_node)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: field(:, :)

      u1 = 0.0_c_double
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      allocate(field(2, n_node))
      call query_guess(model%query, model%stepper, real(h, wp), field, error)
      u1 = real(field, c_double)
      call handle_pass(model, error, ierr)
   end subroutine guess

   !> Evaluate the step of size `h` to `u1`. `lam`, `active` (0, 1): of size 0 those of the state.
   subroutine evaluate(handle, h, u1, lam, active, with_tangent, n_node, n_lam, n_active, ierr)
      integer(c_int64_t), intent(in) :: handle
      real(c_double), intent(in) :: h
      integer(c_int), intent(in) :: n_node, n_lam, n_active
      real(c_double), intent(in) :: u1(2, n_node)
      real(c_double), intent(in) :: lam(n_lam)
      integer(c_int), intent(in) :: active(n_active)
      integer(c_int), intent(in) :: with_tangent
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: new_lam(:)
      logical, allocatable :: new_active(:)
      integer :: before
      !f2py threadsafe

      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      before = model%stepper%march%system%linear%n   ! ties and equations stand before contact
      if (n_lam > 0) new_lam = [model%stepper%march%state%lam(:before), real(lam, wp)]
      if (n_active > 0) new_active = [model%stepper%march%state%is_active(:before), active /= 0]
      call query_evaluate(model%query, model%stepper, real(h, wp), real(u1, wp), &
         with_tangent /= 0, error, new_lam, new_active)
      call handle_pass(model, error, ierr)
   end subroutine evaluate

   !> Residual of the last evaluation at the nodes.
   subroutine get_residual(handle, with_contact, n_node, nodal, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: with_contact
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(out) :: nodal(2, n_node)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: at_node(:, :), on_unknown(:)

      nodal = 0.0_c_double
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call query_residual(model%query, with_contact /= 0, at_node, on_unknown, error)
      call handle_pass(model, error, ierr)
      if (allocated(error)) return
      if (.not. handle_fits(model, n_node, size(at_node, 2), ierr)) return
      nodal = real(at_node, c_double)
   end subroutine get_residual

   !> The same on the unknowns.
   subroutine get_unknown_residual(handle, with_contact, n_unknown, unknown, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: with_contact
      integer(c_int), intent(in) :: n_unknown
      real(c_double), intent(out) :: unknown(n_unknown)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: at_node(:, :), on_unknown(:)

      unknown = 0.0_c_double
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call query_residual(model%query, with_contact /= 0, at_node, on_unknown, error)
      call handle_pass(model, error, ierr)
      if (allocated(error)) return
      if (.not. handle_fits(model, n_unknown, size(on_unknown), ierr)) return
      unknown = real(on_unknown, c_double)
   end subroutine get_unknown_residual

   !> Unknown of each degree of freedom, from 1; 0: none.
   subroutine get_unknowns(handle, n_node, unknown, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_node
      integer(c_int), intent(out) :: unknown(2, n_node)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      integer, allocatable :: number(:, :)

      unknown = 0
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call query_unknowns(model%stepper, number, error)
      call handle_pass(model, error, ierr)
      if (allocated(error)) return
      if (handle_fits(model, n_node, size(number, 2), ierr)) unknown = number
   end subroutine get_unknowns

   !> px, py, lz of each body.
   subroutine get_momenta(handle, n_body, momenta, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_body
      real(c_double), intent(out) :: momenta(3, n_body)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: of_body(:, :)

      momenta = 0.0_c_double
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call query_momenta(model%query, model%stepper, of_body, error)
      call handle_pass(model, error, ierr)
      if (allocated(error)) return
      if (handle_fits(model, n_body, size(of_body, 2), ierr)) momenta = real(of_body, c_double)
   end subroutine get_momenta

   !> Contact forces that the residual of the last evaluation amounts to, by its null space.
   subroutine get_multipliers(handle, n_constraint, lam, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_constraint
      real(c_double), intent(out) :: lam(n_constraint)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: all_of(:)
      integer :: before

      lam = 0.0_c_double
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      associate (system => model%stepper%march%system)
         before = system%linear%n
         if (.not. handle_fits(model, n_constraint, system%n_constraint - before, ierr)) return
         allocate(all_of(system%n_constraint))
      end associate
      call query_multipliers(model%query, all_of, error)
      call handle_pass(model, error, ierr)
      lam = real(all_of(before + 1:), c_double)
   end subroutine get_multipliers

   !> Make the matrix of one of the places `at_`, which the model keeps: the mass between nodes, all
   !> displacements from the unknowns, or the tangent of the last evaluation.
   subroutine make_matrix(handle, place, with_contact, sizes, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: place
      integer(c_int), intent(in) :: with_contact     !! of the tangent
      integer(c_int), intent(out) :: sizes(3)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      sizes = 0
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      if (.not. has_place(model, place, size(model%matrix), ierr)) return
      associate (matrix => model%matrix(place))
         select case (place)
         case (at_mass)
            call query_mass(model%stepper, matrix, error)
         case (at_links)
            call query_links(model%stepper, matrix, error)
         case default
            call query_tangent(model%query, with_contact /= 0, matrix, error)
         end select
         call handle_pass(model, error, ierr)
         if (.not. allocated(error)) sizes = sizes_of(matrix)
      end associate
   end subroutine make_matrix

   !> Whether `place` is one of the first `n`; else an error.
   logical function has_place(model, place, n, ierr)
      type(model_t), intent(inout) :: model
      integer(c_int), intent(in) :: place
      integer, intent(in) :: n
      integer(c_int), intent(inout) :: ierr

      has_place = place >= 1 .and. place <= n
      if (.not. has_place) call handle_fail(model, "there is no matrix " // to_text(int(place)), &
         err_input, ierr)
   end function has_place

   !> P and DF of the last evaluation.
   subroutine make_null_space(handle, sizes, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(out) :: sizes(3, 2)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      !f2py threadsafe

      sizes = 0
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call query_null_space(model%query, model%matrix(at_p), model%matrix(at_df), error)
      call handle_pass(model, error, ierr)
      if (allocated(error)) return
      sizes(:, 1) = sizes_of(model%matrix(at_p))
      sizes(:, 2) = sizes_of(model%matrix(at_df))
   end subroutine make_null_space

   pure function sizes_of(matrix) result(sizes)
      type(csr_t), intent(in) :: matrix
      integer(c_int) :: sizes(3)

      sizes = [matrix%n_row, matrix%n_col, 0]
      if (allocated(matrix%value)) sizes(3) = size(matrix%value)
   end function sizes_of

   !> Copy out what was made last at one of the places `at_`; at the next two, the discrete
   !> gradients of the last report of constraints, and the gradients at the end.
   subroutine get_csr(handle, place, n_row, n_entry, row_start, column, value, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: place
      integer(c_int), intent(in) :: n_row, n_entry
      integer(c_int), intent(out) :: row_start(n_row + 1)
      integer(c_int), intent(out) :: column(n_entry)
      real(c_double), intent(out) :: value(n_entry)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model

      row_start = 0
      column = 0
      value = 0.0_c_double
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      if (.not. has_place(model, place, size(model%matrix) + 2, ierr)) return
      select case (place - size(model%matrix))
      case (1)
         call copy_csr(model, model%report%discrete_gradient, row_start, column, value, ierr)
      case (2)
         call copy_csr(model, model%report%end_gradient, row_start, column, value, ierr)
      case default
         call copy_csr(model, model%matrix(place), row_start, column, value, ierr)
      end select
   end subroutine get_csr

   subroutine copy_csr(model, matrix, row_start, column, value, ierr)
      type(model_t), intent(inout) :: model
      type(csr_t), intent(in) :: matrix
      integer(c_int), intent(inout) :: row_start(:), column(:)
      real(c_double), intent(inout) :: value(:)
      integer(c_int), intent(out) :: ierr

      if (.not. handle_fits(model, size(row_start), matrix%n_row + 1, ierr)) return
      if (.not. allocated(matrix%value)) return      ! there is none: it has no rows
      if (.not. handle_fits(model, size(value), size(matrix%value), ierr)) return
      row_start = matrix%row_start
      column = matrix%column
      value = real(matrix%value, c_double)
   end subroutine copy_csr

   !> Measure the contact constraints near from `u0` to `u1`; the model keeps the report. `sizes`:
   !> of the discrete gradients, and of the gradients at the end; a row a constraint.
   subroutine constraints(handle, u0, u1, keeps_gap, n_node, sizes, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(in) :: u0(2, n_node), u1(2, n_node)
      integer(c_int), intent(in) :: keeps_gap
      integer(c_int), intent(out) :: sizes(3, 2)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      !f2py threadsafe

      sizes = 0
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      call query_constraints(model%query, model%stepper, real(u0, wp), real(u1, wp), &
         keeps_gap /= 0, model%report, error)
      call handle_pass(model, error, ierr)
      if (allocated(error)) return
      sizes(:, 1) = sizes_of(model%report%discrete_gradient)
      sizes(:, 2) = sizes_of(model%report%end_gradient)
   end subroutine constraints

   !> Of each constraint of the last report: its number among all, pair, slave node, all from 0;
   !> gaps at the start and at the end, their difference, length of an edge.
   subroutine get_constraints(handle, n, place, values, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n
      integer(c_int), intent(out) :: place(n, 3)
      real(c_double), intent(out) :: values(n, 4)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model

      place = 0
      values = 0.0_c_double
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      associate (report => model%report)
         if (.not. handle_fits(model, n, report%n, ierr) .or. n == 0) return
         place(:, 1) = report%id - model%stepper%march%system%linear%n - 1
         place(:, 2) = report%pair - 1
         place(:, 3) = report%node - 1
         values(:, 1) = real(report%gap0, c_double)
         values(:, 2) = real(report%gap1, c_double)
         values(:, 3) = real(report%dgap, c_double)
         values(:, 4) = real(report%size, c_double)
      end associate
   end subroutine get_constraints

   !> Sum over the constraints of the last report of `factor` times the derivative of the discrete
   !> gradient by u1 times `direction`.
   subroutine curvature_times(handle, factor, direction, n, n_node, product, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n, n_node
      real(c_double), intent(in) :: factor(n)
      real(c_double), intent(in) :: direction(2, n_node)
      real(c_double), intent(out) :: product(2, n_node)
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: sums(:, :)

      product = 0.0_c_double
      call handle_find(handle, model, ierr)
      if (.not. associated(model)) return
      allocate(sums(2, n_node))
      call query_curvature_times(model%query, real(factor, wp), real(direction, wp), sums, error)
      product = real(sums, c_double)
      call handle_pass(model, error, ierr)
   end subroutine curvature_times

end module emcon_flat_query
