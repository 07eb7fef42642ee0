!> The C interface: contact over a step of the caller's own, and the null space. What each function
!> does is said in emcon.h.
module emcon_c_contact
   use, intrinsic :: iso_c_binding, only : c_associated, c_double, c_f_pointer, c_int, c_loc, &
      c_null_ptr, c_ptr
   use emcon_c_border, only : check_count, check_given, n_constraints, n_nodes, put_field, &
      put_matrix, put_number, put_numbers, put_values, show_matrix, take_field, take_flags, &
      take_numbers, take_values
   use emcon_c_types, only : constraint_report_c, gap_c
   use emcon_contact, only : gap_state_t
   use emcon_errors, only : err_analysis, err_none, error_t, raise
   use emcon_handle, only : at_curvature, at_df, at_p, find_built, handle_pass, model_t
   use emcon_judge, only : overlap_t
   use emcon_kinds, only : wp
   use emcon_stepper_contact, only : query_areas, query_begin_contact, query_choose, &
      query_contact, query_drop, query_gaps, query_overlap, query_select, query_update_active
   use emcon_stepper_null_space, only : query_multipliers, query_null_space, query_particular
   use emcon_stepper_report, only : query_constraints, query_curvature, query_curvature_times
   implicit none
   private
   public :: emcon_constraints_c, emcon_begin_contact, emcon_get_gaps, emcon_select, emcon_choose, &
      emcon_evaluate_contact, emcon_curvature, emcon_curvature_times, emcon_update_active, &
      emcon_drop, emcon_get_areas, emcon_overlap, emcon_null_space_c, emcon_multipliers, &
      emcon_particular

contains

   !> Two fields: displacements at the start of a step and the motion in it, or those at its end.
   subroutine take_fields(model, n_node, u0, u1, name, from, by, error)
      type(model_t), intent(in) :: model
      integer(c_int), intent(in) :: n_node
      type(c_ptr), intent(in) :: u0, u1
      character(len=*), intent(in) :: name           !! of the second
      real(wp), allocatable, intent(out) :: from(:, :), by(:, :)
      type(error_t), allocatable, intent(inout) :: error

      call check_given("u0", u0, error)
      call check_given(name, u1, error)
      call take_field(u0, n_node, n_nodes(model), from, error)
      call take_field(u1, n_node, n_nodes(model), by, error)
   end subroutine take_fields

   !> Flags of all constraints.
   subroutine take_active(model, n_constraint, name, flags, list, error)
      type(model_t), intent(in) :: model
      integer(c_int), intent(in) :: n_constraint
      character(len=*), intent(in) :: name
      type(c_ptr), intent(in) :: flags
      logical, allocatable, intent(out) :: list(:)
      type(error_t), allocatable, intent(inout) :: error

      if (n_constraints(model) > 0) call check_given(name, flags, error)
      call take_flags("n_constraint", flags, n_constraint, n_constraints(model), list, error)
      if (.not. allocated(list)) allocate(list(0))
   end subroutine take_active

   !> A number for each of the constraints that were evaluated last.
   subroutine take_of_set(model, n, name, from, list, error)
      type(model_t), intent(in) :: model
      integer(c_int), intent(in) :: n
      character(len=*), intent(in) :: name
      type(c_ptr), intent(in) :: from
      real(wp), allocatable, intent(out) :: list(:)
      type(error_t), allocatable, intent(inout) :: error

      if (n > 0) call check_given(name, from, error)
      if (model%query%has_set) call check_count("n", n, model%query%march%active%set%n, error)
      call take_values("n", from, n, max(0, int(n)), list, error)
      if (.not. allocated(list)) allocate(list(0))
   end subroutine take_of_set

   integer(c_int) function emcon_constraints_c(handle, n_node, u0, u1, keeps_gap, report) &
      bind(c, name="emcon_constraints")
      type(c_ptr), value :: handle, u0, u1, report
      integer(c_int), value :: n_node, keeps_gap
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: from(:, :), until(:, :)

      call find_built(handle, model, emcon_constraints_c)
      if (emcon_constraints_c /= err_none) return
      call take_fields(model, n_node, u0, u1, "u1", from, until, error)
      if (.not. allocated(error)) call query_constraints(model%query, model%stepper, from, until, &
         keeps_gap /= 0, model%report, error)
      call put_report(model, error, report)
      call handle_pass(model, error, emcon_constraints_c)
   end function emcon_constraints_c

   integer(c_int) function emcon_evaluate_contact(handle, n_node, u0, du, report) bind(c)
      type(c_ptr), value :: handle, u0, du, report
      integer(c_int), value :: n_node
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: from(:, :), by(:, :)

      call find_built(handle, model, emcon_evaluate_contact)
      if (emcon_evaluate_contact /= err_none) return
      call take_fields(model, n_node, u0, du, "du", from, by, error)
      if (.not. allocated(error)) call query_contact(model%query, model%stepper, from, by, &
         model%report, error)
      call put_report(model, error, report)
      call handle_pass(model, error, emcon_evaluate_contact)
   end function emcon_evaluate_contact

   !> Let C see the report that the model holds, with numbers from 0; an empty one after an error.
   subroutine put_report(model, error, place)
      type(model_t), intent(inout), target :: model
      type(error_t), allocatable, intent(in) :: error
      type(c_ptr), intent(in) :: place
      type(constraint_report_c), pointer :: to

      if (.not. c_associated(place)) return
      call c_f_pointer(place, to)
      to = constraint_report_c()
      if (allocated(error)) return
      associate (report => model%report)
         to%n = report%n
         call show_matrix(report%discrete_gradient, to%discrete_gradient)
         call show_matrix(report%end_gradient, to%end_gradient)
         if (report%n == 0) return
         model%c_place = reshape([report%id - 1, report%pair - 1, report%node - 1], [report%n, 3])
         model%c_gap = real(reshape([report%target, report%gap0, report%gap1, report%dgap, &
            report%defect, report%size], [report%n, 6]), c_double)
      end associate
      to%id = c_loc(model%c_place(1, 1))
      to%pair = c_loc(model%c_place(1, 2))
      to%node = c_loc(model%c_place(1, 3))
      to%target = c_loc(model%c_gap(1, 1))
      to%gap0 = c_loc(model%c_gap(1, 2))
      to%gap1 = c_loc(model%c_gap(1, 3))
      to%dgap = c_loc(model%c_gap(1, 4))
      to%defect = c_loc(model%c_gap(1, 5))
      to%size = c_loc(model%c_gap(1, 6))
   end subroutine put_report

   integer(c_int) function emcon_begin_contact(handle, n_node, u0, du, n_constraint, was_active, &
      active) bind(c)
      type(c_ptr), value :: handle, u0, du, was_active, active
      integer(c_int), value :: n_node, n_constraint
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: from(:, :), by(:, :)
      logical, allocatable :: was(:), acts(:)

      call find_built(handle, model, emcon_begin_contact)
      if (emcon_begin_contact /= err_none) return
      call take_fields(model, n_node, u0, du, "du", from, by, error)
      call take_active(model, n_constraint, "was_active", was_active, was, error)
      if (.not. allocated(error)) call query_begin_contact(model%query, model%stepper, from, by, &
         was, acts, error)
      if (.not. allocated(error)) call put_numbers(merge(1, 0, acts), active)
      call handle_pass(model, error, emcon_begin_contact)
   end function emcon_begin_contact

   integer(c_int) function emcon_get_gaps(handle, n_node, u0, du, n_constraint, gap) bind(c)
      type(c_ptr), value :: handle, u0, du, gap
      integer(c_int), value :: n_node, n_constraint
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: from(:, :), by(:, :)
      type(gap_state_t), allocatable :: state(:)
      type(gap_c), pointer :: to(:)

      call find_built(handle, model, emcon_get_gaps)
      if (emcon_get_gaps /= err_none) return
      call take_fields(model, n_node, u0, du, "du", from, by, error)
      call check_count("n_constraint", n_constraint, n_constraints(model), error)
      if (.not. allocated(error)) call query_gaps(model%query, model%stepper, from, by, state, &
         error)
      call handle_pass(model, error, emcon_get_gaps)
      if (allocated(error) .or. .not. c_associated(gap)) return
      call c_f_pointer(gap, to, shape(state))
      to%is_near = merge(1_c_int, 0_c_int, state%is_near)
      to%is_over = merge(1_c_int, 0_c_int, state%is_over)
      to%gap0 = real(state%gap0, c_double)
      to%gap1 = real(state%gap1, c_double)
      to%size = real(state%size, c_double)
   end function emcon_get_gaps

   integer(c_int) function emcon_select(handle, n_node, u0, du, n_constraint, active, n) bind(c)
      type(c_ptr), value :: handle, u0, du, active, n
      integer(c_int), value :: n_node, n_constraint
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: from(:, :), by(:, :)
      logical, allocatable :: acts(:)

      call find_built(handle, model, emcon_select)
      if (emcon_select /= err_none) return
      call take_fields(model, n_node, u0, du, "du", from, by, error)
      call take_active(model, n_constraint, "active", active, acts, error)
      if (.not. allocated(error)) call query_select(model%query, model%stepper, from, by, acts, &
         error)
      if (.not. allocated(error)) call put_number(count(acts), n)
      call handle_pass(model, error, emcon_select)
   end function emcon_select

   integer(c_int) function emcon_choose(handle, n_node, u0, du, n, id, target) bind(c)
      type(c_ptr), value :: handle, u0, du, id, target
      integer(c_int), value :: n_node, n
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: from(:, :), by(:, :), gap(:)
      integer, allocatable :: number(:)

      call find_built(handle, model, emcon_choose)
      if (emcon_choose /= err_none) return
      call take_fields(model, n_node, u0, du, "du", from, by, error)
      call take_numbers("id", id, n, number, error)
      if (n > 0) call check_given("target", target, error)
      call take_values("n", target, n, max(0, int(n)), gap, error)
      if (.not. allocated(gap)) allocate(gap(0))
      if (.not. allocated(error)) call query_choose(model%query, model%stepper, from, by, number, &
         gap, error)
      call handle_pass(model, error, emcon_choose)
   end function emcon_choose

   integer(c_int) function emcon_curvature(handle, n, factor, matrix) bind(c)
      type(c_ptr), value :: handle, factor, matrix
      integer(c_int), value :: n
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: weight(:)

      call find_built(handle, model, emcon_curvature)
      if (emcon_curvature /= err_none) return
      call take_of_set(model, n, "factor", factor, weight, error)
      if (.not. allocated(error)) call query_curvature(model%query, weight, &
         model%matrix(at_curvature), error)
      if (.not. allocated(error)) call put_matrix(model%matrix(at_curvature), matrix)
      call handle_pass(model, error, emcon_curvature)
   end function emcon_curvature

   integer(c_int) function emcon_curvature_times(handle, n, factor, n_node, direction, product) &
      bind(c)
      type(c_ptr), value :: handle, factor, direction, product
      integer(c_int), value :: n, n_node
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: weight(:), along(:, :), sum_of(:, :)

      call find_built(handle, model, emcon_curvature_times)
      if (emcon_curvature_times /= err_none) return
      call take_of_set(model, n, "factor", factor, weight, error)
      call check_given("direction", direction, error)
      call take_field(direction, n_node, n_nodes(model), along, error)
      if (.not. allocated(error)) call query_curvature_times(model%query, model%stepper, weight, &
         along, sum_of, error)
      if (.not. allocated(error)) call put_field(sum_of, product)
      call handle_pass(model, error, emcon_curvature_times)
   end function emcon_curvature_times

   integer(c_int) function emcon_update_active(handle, n_node, u0, du, n, lam, magnitude, &
      n_constraint, active, is_done, outcome) bind(c)
      type(c_ptr), value :: handle, u0, du, lam, magnitude, active, is_done, outcome
      integer(c_int), value :: n_node, n, n_constraint
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: from(:, :), by(:, :), force(:), sizes(:, :)
      logical, allocatable :: acts(:)
      logical :: stands
      integer :: status

      call find_built(handle, model, emcon_update_active)
      if (emcon_update_active /= err_none) return
      call take_fields(model, n_node, u0, du, "du", from, by, error)
      call take_of_set(model, n, "lam", lam, force, error)
      call take_field(magnitude, n_node, n_nodes(model), sizes, error)
      call take_active(model, n_constraint, "active", active, acts, error)
      ! Without sizes the last argument counts as absent.
      if (.not. allocated(error)) call query_update_active(model%query, model%stepper, from, by, &
         force, acts, stands, status, error, sizes)
      call handle_pass(model, error, emcon_update_active)
      if (allocated(error)) return
      call put_numbers(merge(1, 0, acts), active)
      call put_number(merge(1, 0, stands), is_done)
      call put_number(status, outcome)
   end function emcon_update_active

   integer(c_int) function emcon_drop(handle, n_redundant, redundant, n_constraint, active) bind(c)
      type(c_ptr), value :: handle, redundant, active
      integer(c_int), value :: n_redundant, n_constraint
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      integer, allocatable :: place(:)
      logical, allocatable :: left(:)

      call find_built(handle, model, emcon_drop)
      if (emcon_drop /= err_none) return
      call take_numbers("redundant", redundant, n_redundant, place, error)
      call check_count("n_constraint", n_constraint, n_constraints(model), error)
      if (.not. allocated(error)) call query_drop(model%query, place, left, error)
      if (.not. allocated(error)) call put_numbers(merge(1, 0, left), active)
      call handle_pass(model, error, emcon_drop)
   end function emcon_drop

   integer(c_int) function emcon_get_areas(handle, n_node, u1, n_constraint, area, length) bind(c)
      type(c_ptr), value :: handle, u1, area, length
      integer(c_int), value :: n_node, n_constraint
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: reached(:, :), areas(:), lengths(:)

      call find_built(handle, model, emcon_get_areas)
      if (emcon_get_areas /= err_none) return
      call check_given("u1", u1, error)
      call take_field(u1, n_node, n_nodes(model), reached, error)
      call check_count("n_constraint", n_constraint, n_constraints(model), error)
      if (.not. allocated(error)) call query_areas(model%query, model%stepper, reached, areas, &
         lengths, error)
      if (.not. allocated(error)) call put_values(areas, area)
      if (.not. allocated(error)) call put_values(lengths, length)
      call handle_pass(model, error, emcon_get_areas)
   end function emcon_get_areas

   integer(c_int) function emcon_overlap(handle, n_node, u0, du, depth, node) bind(c)
      type(c_ptr), value :: handle, u0, du, depth, node
      integer(c_int), value :: n_node
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: from(:, :), by(:, :)
      type(overlap_t) :: overlap

      call find_built(handle, model, emcon_overlap)
      if (emcon_overlap /= err_none) return
      call take_fields(model, n_node, u0, du, "du", from, by, error)
      if (.not. allocated(error)) call query_overlap(model%query, model%stepper, from, by, &
         overlap, error)
      if (.not. allocated(error)) call put_values([overlap%depth], depth)
      if (.not. allocated(error)) call put_number(overlap%node - 1, node)
      call handle_pass(model, error, emcon_overlap)
   end function emcon_overlap

   integer(c_int) function emcon_null_space_c(handle, p, df, n_redundant, redundant) &
      bind(c, name="emcon_null_space")
      type(c_ptr), value :: handle, p, df, n_redundant, redundant
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      integer, allocatable :: place(:)
      type(c_ptr), pointer :: to

      call find_built(handle, model, emcon_null_space_c)
      if (emcon_null_space_c /= err_none) return
      call query_null_space(model%query, model%matrix(at_p), model%matrix(at_df), place, error)
      if (size(place) > 0 .and. .not. c_associated(n_redundant)) call raise(error, err_analysis, &
         "there is no null space: some of the constraints that act follow from others")
      call put_matrix(model%matrix(at_p), p)
      call put_matrix(model%matrix(at_df), df)
      call put_number(size(place), n_redundant)
      model%c_redundant = int(place - 1, c_int)
      if (c_associated(redundant)) then
         call c_f_pointer(redundant, to)
         to = c_null_ptr
         if (size(place) > 0) to = c_loc(model%c_redundant)
      end if
      call handle_pass(model, error, emcon_null_space_c)
   end function emcon_null_space_c

   integer(c_int) function emcon_multipliers(handle, n_node, residual, n_constraint, lam) bind(c)
      type(c_ptr), value :: handle, residual, lam
      integer(c_int), value :: n_node, n_constraint
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: nodal(:, :), force(:)

      call find_built(handle, model, emcon_multipliers)
      if (emcon_multipliers /= err_none) return
      call take_field(residual, n_node, n_nodes(model), nodal, error)
      call check_count("n_constraint", n_constraint, n_constraints(model), error)
      ! Without a residual the last argument counts as absent.
      if (.not. allocated(error)) call query_multipliers(model%query, model%stepper, force, error, &
         nodal)
      if (.not. allocated(error)) call put_values(force, lam)
      call handle_pass(model, error, emcon_multipliers)
   end function emcon_multipliers

   integer(c_int) function emcon_particular(handle, n, defect, n_node, du) bind(c)
      type(c_ptr), value :: handle, defect, du
      integer(c_int), value :: n, n_node
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: left(:), motion(:, :)

      call find_built(handle, model, emcon_particular)
      if (emcon_particular /= err_none) return
      call take_of_set(model, n, "defect", defect, left, error)
      call check_count("n_node", n_node, n_nodes(model), error)
      if (.not. allocated(error)) call query_particular(model%query, model%stepper, left, motion, &
         error)
      if (.not. allocated(error)) call put_field(motion, du)
      call handle_pass(model, error, emcon_particular)
   end function emcon_particular

end module emcon_c_contact
