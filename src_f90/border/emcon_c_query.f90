!> The C interface: what the engine computes for a step. What each function does is said in emcon.h.
module emcon_c_query
   use, intrinsic :: iso_c_binding, only : c_associated, c_double, c_f_pointer, c_int, c_loc, c_ptr
   use emcon_c_border, only : check_count, check_given, find_built, put_field, put_matrix, &
      put_numbers, put_values, show_matrix, take_field, take_flags, take_values
   use emcon_c_types, only : constraint_report_c, csr_c
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_none, error_t
   use emcon_handle, only : at_df, at_links, at_mass, at_p, at_tangent, handle_pass, model_t
   use emcon_kinds, only : wp
   use emcon_stepper_constraints, only : query_check_factors, query_constraints, &
      query_curvature_times, query_links, query_multipliers, query_null_space
   use emcon_stepper_query, only : query_evaluate, query_guess, query_mass, query_residual, &
      query_tangent, query_unknowns
   implicit none
   private
   public :: emcon_guess, emcon_evaluate, emcon_residual, emcon_tangent, emcon_unknowns, emcon_mass
   public :: emcon_constraints_c, emcon_curvature_times, emcon_null_space_c, emcon_multipliers
   public :: emcon_links

contains

   integer(c_int) function emcon_unknowns(handle, n_node, unknown) bind(c)
      type(c_ptr), value :: handle, unknown
      integer(c_int), value :: n_node
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      integer, allocatable :: number(:, :)

      call find_built(handle, model, emcon_unknowns)
      if (emcon_unknowns /= err_none) return
      call check_count("n_node", n_node, n_nodes(model), error)
      if (.not. allocated(error)) call query_unknowns(model%stepper, number, error)
      if (.not. allocated(error)) call put_numbers([max(number, 0) - 1], unknown)
      call handle_pass(model, error, emcon_unknowns)
   end function emcon_unknowns

   pure integer function n_nodes(model)
      type(model_t), intent(in) :: model

      n_nodes = size(model%stepper%scene%x, 2)
   end function n_nodes

   integer(c_int) function emcon_mass(handle, matrix) bind(c)
      type(c_ptr), value :: handle, matrix
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call find_built(handle, model, emcon_mass)
      if (emcon_mass /= err_none) return
      call query_mass(model%stepper, model%matrix(at_mass), error)
      call put_matrix(model%matrix(at_mass), matrix)
      call handle_pass(model, error, emcon_mass)
   end function emcon_mass

   integer(c_int) function emcon_links(handle, matrix) bind(c)
      type(c_ptr), value :: handle, matrix
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call find_built(handle, model, emcon_links)
      if (emcon_links /= err_none) return
      call query_links(model%stepper, model%matrix(at_links), error)
      call put_matrix(model%matrix(at_links), matrix)
      call handle_pass(model, error, emcon_links)
   end function emcon_links

   integer(c_int) function emcon_guess(handle, h, n_node, u1) bind(c)
      type(c_ptr), value :: handle, u1
      real(c_double), value :: h
      integer(c_int), value :: n_node
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: guess(:, :)

      call find_built(handle, model, emcon_guess)
      if (emcon_guess /= err_none) return
      call check_count("n_node", n_node, n_nodes(model), error)
      if (.not. allocated(error)) then
         allocate(guess(2, n_nodes(model)))
         call query_guess(model%query, model%stepper, real(h, wp), guess, error)
      end if
      if (.not. allocated(error)) call put_field(guess, u1)
      call handle_pass(model, error, emcon_guess)
   end function emcon_guess

   integer(c_int) function emcon_evaluate(handle, h, n_node, u1, with_tangent, n_constraint, lam, &
      is_active) bind(c)
      type(c_ptr), value :: handle, u1, lam, is_active
      real(c_double), value :: h
      integer(c_int), value :: n_node, with_tangent, n_constraint
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: to(:, :), force(:)
      logical, allocatable :: acts(:)
      integer :: n

      call find_built(handle, model, emcon_evaluate)
      if (emcon_evaluate /= err_none) return
      n = model%stepper%march%system%n_constraint
      call check_given("u1", u1, error)
      call take_field(u1, n_node, n_nodes(model), to, error)
      call take_values("n_constraint", lam, n_constraint, n, force, error)
      call take_flags("n_constraint", is_active, n_constraint, n, acts, error)
      if (.not. allocated(error)) call query_evaluate(model%query, model%stepper, real(h, wp), to, &
         with_tangent /= 0, error, force, acts)
      call handle_pass(model, error, emcon_evaluate)
   end function emcon_evaluate

   integer(c_int) function emcon_residual(handle, with_contact, n_node, nodal, n_unknown, &
      unknown) bind(c)
      type(c_ptr), value :: handle, nodal, unknown
      integer(c_int), value :: with_contact, n_node, n_unknown
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: at_node(:, :), of_unknown(:)

      call find_built(handle, model, emcon_residual)
      if (emcon_residual /= err_none) return
      if (c_associated(nodal)) call check_count("n_node", n_node, n_nodes(model), error)
      if (c_associated(unknown)) call check_count("n_unknown", n_unknown, &
         model%stepper%march%system%space%numbering%n_unknown, error)
      if (.not. allocated(error)) call query_residual(model%query, with_contact /= 0, at_node, &
         of_unknown, error)
      if (.not. allocated(error)) call put_field(at_node, nodal)
      if (.not. allocated(error)) call put_values(of_unknown, unknown)
      call handle_pass(model, error, emcon_residual)
   end function emcon_residual

   integer(c_int) function emcon_tangent(handle, with_contact, matrix) bind(c)
      type(c_ptr), value :: handle, matrix
      integer(c_int), value :: with_contact
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call find_built(handle, model, emcon_tangent)
      if (emcon_tangent /= err_none) return
      call query_tangent(model%query, with_contact /= 0, model%matrix(at_tangent), error)
      call put_matrix(model%matrix(at_tangent), matrix)
      call handle_pass(model, error, emcon_tangent)
   end function emcon_tangent

   integer(c_int) function emcon_constraints_c(handle, n_node, u0, u1, keeps_gap, report) &
      bind(c, name="emcon_constraints")
      type(c_ptr), value :: handle, u0, u1, report
      integer(c_int), value :: n_node, keeps_gap
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      type(constraint_report_c), pointer :: to
      real(wp), allocatable :: from(:, :), until(:, :)

      call find_built(handle, model, emcon_constraints_c)
      if (emcon_constraints_c /= err_none) return
      call check_given("u0", u0, error)
      call check_given("u1", u1, error)
      call take_field(u0, n_node, n_nodes(model), from, error)
      call take_field(u1, n_node, n_nodes(model), until, error)
      if (.not. allocated(error)) call query_constraints(model%query, model%stepper, from, until, &
         keeps_gap /= 0, model%report, error)
      call handle_pass(model, error, emcon_constraints_c)
      if (.not. c_associated(report)) return
      call c_f_pointer(report, to)
      to = constraint_report_c()
      if (.not. allocated(error)) call show_report(model, to)
   end function emcon_constraints_c

   !> Let C see the report that the model holds, with numbers from 0.
   subroutine show_report(model, to)
      type(model_t), intent(inout), target :: model
      type(constraint_report_c), intent(inout) :: to

      associate (report => model%report)
         to%n = report%n
         call show_matrix(report%discrete_gradient, to%discrete_gradient)
         call show_matrix(report%end_gradient, to%end_gradient)
         if (report%n == 0) return
         model%c_place = reshape([report%id - 1, report%pair - 1, report%node - 1], [report%n, 3])
         model%c_gap = reshape([real(report%gap0, c_double), real(report%gap1, c_double), &
            real(report%dgap, c_double), real(report%size, c_double)], [report%n, 4])
      end associate
      to%id = c_loc(model%c_place(1, 1))
      to%pair = c_loc(model%c_place(1, 2))
      to%node = c_loc(model%c_place(1, 3))
      to%gap0 = c_loc(model%c_gap(1, 1))
      to%gap1 = c_loc(model%c_gap(1, 2))
      to%dgap = c_loc(model%c_gap(1, 3))
      to%size = c_loc(model%c_gap(1, 4))
   end subroutine show_report

   integer(c_int) function emcon_curvature_times(handle, n, factor, n_node, direction, product) &
      bind(c)
      type(c_ptr), value :: handle, factor, direction, product
      integer(c_int), value :: n, n_node
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: weight(:), along(:, :), sum_of(:, :)

      call find_built(handle, model, emcon_curvature_times)
      if (emcon_curvature_times /= err_none) return
      call check_given("factor", factor, error)
      call check_given("direction", direction, error)
      if (.not. allocated(error)) call query_check_factors(model%query, int(n), error)
      call take_values("n", factor, n, int(n), weight, error)
      call take_field(direction, n_node, n_nodes(model), along, error)
      if (.not. allocated(error)) then
         allocate(sum_of(2, n_nodes(model)))
         call query_curvature_times(model%query, weight, along, sum_of, error)
      end if
      if (.not. allocated(error)) call put_field(sum_of, product)
      call handle_pass(model, error, emcon_curvature_times)
   end function emcon_curvature_times

   integer(c_int) function emcon_null_space_c(handle, p, df) bind(c, name="emcon_null_space")
      type(c_ptr), value :: handle, p, df
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call find_built(handle, model, emcon_null_space_c)
      if (emcon_null_space_c /= err_none) return
      call query_null_space(model%query, model%matrix(at_p), model%matrix(at_df), error)
      call put_matrix(model%matrix(at_p), p)
      call put_matrix(model%matrix(at_df), df)
      call handle_pass(model, error, emcon_null_space_c)
   end function emcon_null_space_c

   integer(c_int) function emcon_multipliers(handle, n_constraint, lam) bind(c)
      type(c_ptr), value :: handle, lam
      integer(c_int), value :: n_constraint
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: force(:)

      call find_built(handle, model, emcon_multipliers)
      if (emcon_multipliers /= err_none) return
      call check_count("n_constraint", n_constraint, model%stepper%march%system%n_constraint, error)
      if (.not. allocated(error)) then
         allocate(force(n_constraint))
         call query_multipliers(model%query, force, error)
      end if
      if (.not. allocated(error)) call put_values(force, lam)
      call handle_pass(model, error, emcon_multipliers)
   end function emcon_multipliers

end module emcon_c_query
