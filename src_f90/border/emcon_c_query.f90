!> The C interface: what the engine computes for a step. What each function does is said in emcon.h.
module emcon_c_query
   use, intrinsic :: iso_c_binding, only : c_associated, c_double, c_int, c_ptr
   use emcon_c_border, only : check_count, check_given, n_constraints, n_nodes, put_field, &
      put_matrix, put_numbers, put_values, take_field, take_flags, take_values
   use emcon_errors, only : err_none, error_t
   use emcon_handle, only : at_links, at_mass, at_tangent, find_built, handle_pass, model_t
   use emcon_kinds, only : wp
   use emcon_stepper_null_space, only : query_links
   use emcon_stepper_query, only : query_evaluate, query_guess, query_mass, query_residual, &
      query_tangent, query_unknowns
   implicit none
   private
   public :: emcon_guess, emcon_evaluate, emcon_residual, emcon_tangent, emcon_unknowns, &
      emcon_mass, emcon_links

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

      call find_built(handle, model, emcon_evaluate)
      if (emcon_evaluate /= err_none) return
      call check_given("u1", u1, error)
      call take_field(u1, n_node, n_nodes(model), to, error)
      call take_values("n_constraint", lam, n_constraint, n_constraints(model), force, error)
      call take_flags("n_constraint", is_active, n_constraint, n_constraints(model), acts, error)
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

end module emcon_c_query
