!> Interfaces for host codes as f2py wraps them: calls of a step, see emcon_flat_interface.
module emcon_flat_interface_step
   use, intrinsic :: iso_c_binding, only : c_double, c_int, c_int64_t, c_loc, c_null_ptr, c_ptr
   use emcon_errors, only : err_input, err_none
   use emcon_interface_handle, only : host_at, host_has_nodes, host_t
   use emcon_interface_step_c, only : emcon_interface_begin_step, emcon_interface_choose, &
      emcon_interface_drop, emcon_interface_evaluate, emcon_interface_get_areas, &
      emcon_interface_get_curvature, emcon_interface_get_gaps, emcon_interface_get_null_space, &
      emcon_interface_multipliers, emcon_interface_particular, emcon_interface_second_times, &
      emcon_interface_select, emcon_interface_update_active, gap_c
   implicit none
   private
   public :: begin_step, gaps, select_active, choose, evaluate, get_constraints, curvature
   public :: second_times, update_active, areas, null_space, get_redundant, drop, multipliers
   public :: particular

contains

   subroutine begin_step(handle, n_node, u0, du, n_contact, was_active, active, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(in), target :: u0(2, n_node), du(2, n_node)
      integer(c_int), intent(in) :: n_contact
      integer(c_int), intent(in), target :: was_active(n_contact)
      integer(c_int), intent(out), target :: active(n_contact)
      integer(c_int), intent(out) :: ierr
      !f2py threadsafe

      active = 0
      if (.not. host_has_nodes(handle, n_node, ierr)) return
      ierr = emcon_interface_begin_step(transfer(handle, c_null_ptr), c_loc(u0), c_loc(du), &
         n_contact, c_loc(was_active), c_loc(active))
   end subroutine begin_step

   !> `flag`: near, over; `gap`: at the start, at the end, length of an edge.
   subroutine gaps(handle, n_node, u0, du, n_contact, flag, gap, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(in), target :: u0(2, n_node), du(2, n_node)
      integer(c_int), intent(in) :: n_contact
      integer(c_int), intent(out) :: flag(n_contact, 2)
      real(c_double), intent(out) :: gap(n_contact, 3)
      integer(c_int), intent(out) :: ierr
      type(gap_c), target :: state(n_contact)
      !f2py threadsafe

      flag = 0
      gap = 0.0_c_double
      state = gap_c(0, 0, 0.0_c_double, 0.0_c_double, 0.0_c_double)
      if (.not. host_has_nodes(handle, n_node, ierr)) return
      ierr = emcon_interface_get_gaps(transfer(handle, c_null_ptr), c_loc(u0), c_loc(du), &
         n_contact, c_loc(state))
      flag(:, 1) = state%is_near
      flag(:, 2) = state%is_over
      gap(:, 1) = state%gap_start
      gap(:, 2) = state%gap_end
      gap(:, 3) = state%edge
   end subroutine gaps

   subroutine select_active(handle, n_node, u0, du, n_contact, active, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(in), target :: u0(2, n_node), du(2, n_node)
      integer(c_int), intent(in) :: n_contact
      integer(c_int), intent(in), target :: active(n_contact)
      integer(c_int), intent(out) :: ierr
      !f2py threadsafe

      if (.not. host_has_nodes(handle, n_node, ierr)) return
      ierr = emcon_interface_select(transfer(handle, c_null_ptr), c_loc(u0), c_loc(du), &
         n_contact, c_loc(active), c_null_ptr)
   end subroutine select_active

   subroutine choose(handle, n_node, u0, du, n, contact, n_target, target_gap, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(in), target :: u0(2, n_node), du(2, n_node)
      integer(c_int), intent(in) :: n, n_target     !! equal; f2py shares no size that is 0
      integer(c_int), intent(in), target :: contact(n)
      real(c_double), intent(in), target :: target_gap(n_target)
      integer(c_int), intent(out) :: ierr
      !f2py threadsafe

      if (.not. host_has_nodes(handle, n_node, ierr)) return
      ierr = emcon_interface_choose(transfer(handle, c_null_ptr), c_loc(u0), c_loc(du), &
         min(n, n_target), c_loc(contact), c_loc(target_gap))
   end subroutine choose

   !> `n` values for `get_constraints`, matrices for `get_matrix`.
   subroutine evaluate(handle, n_node, u0, du, n, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(in), target :: u0(2, n_node), du(2, n_node)
      integer(c_int), intent(out) :: n
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host
      !f2py threadsafe

      n = 0
      if (.not. host_has_nodes(handle, n_node, ierr)) return
      ierr = emcon_interface_evaluate(transfer(handle, c_null_ptr), c_loc(u0), c_loc(du), &
         c_null_ptr)
      call host_at(handle, host)
      if (ierr == err_none) n = host%values%n
   end subroutine evaluate

   !> Numbers of contacts; target, gaps at the start, at the end, change, defect, edge.
   subroutine get_constraints(handle, n, contact, values, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n
      integer(c_int), intent(out) :: contact(n)
      real(c_double), intent(out) :: values(n, 6)
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host

      contact = 0
      values = 0.0_c_double
      ierr = err_input
      call host_at(handle, host)
      if (.not. associated(host)) return
      if (.not. allocated(host%id)) return
      if (size(host%id) /= n) return
      ierr = err_none
      contact = host%id
      values = host%number
   end subroutine get_constraints

   subroutine curvature(handle, n, lam, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n
      real(c_double), intent(in), target :: lam(n)
      integer(c_int), intent(out) :: ierr
      !f2py threadsafe

      ierr = emcon_interface_get_curvature(transfer(handle, c_null_ptr), n, c_loc(lam), c_null_ptr)
   end subroutine curvature

   subroutine second_times(handle, n, lam, n_node, direction, product, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n
      real(c_double), intent(in), target :: lam(n)
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(in), target :: direction(2, n_node)
      real(c_double), intent(out), target :: product(2, n_node)
      integer(c_int), intent(out) :: ierr
      !f2py threadsafe

      product = 0.0_c_double
      if (.not. host_has_nodes(handle, n_node, ierr)) return
      ierr = emcon_interface_second_times(transfer(handle, c_null_ptr), n, c_loc(lam), &
         c_loc(direction), c_loc(product))
   end subroutine second_times

   !> `magnitude` is left out without `has_magnitude`; `active` is changed in place.
   subroutine update_active(handle, n_node, u0, du, n, lam, has_magnitude, magnitude, n_contact, &
      active, is_done, outcome, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(in), target :: u0(2, n_node), du(2, n_node)
      integer(c_int), intent(in) :: n
      real(c_double), intent(in), target :: lam(n)
      integer(c_int), intent(in) :: has_magnitude
      real(c_double), intent(in), target :: magnitude(2, n_node)
      integer(c_int), intent(in) :: n_contact
      integer(c_int), intent(inout), target :: active(n_contact)
      integer(c_int), intent(out), target :: is_done, outcome
      integer(c_int), intent(out) :: ierr
      type(c_ptr) :: sizes
      !f2py threadsafe

      is_done = 0
      outcome = 0
      sizes = c_null_ptr
      if (has_magnitude /= 0) sizes = c_loc(magnitude)
      if (.not. host_has_nodes(handle, n_node, ierr)) return
      ierr = emcon_interface_update_active(transfer(handle, c_null_ptr), c_loc(u0), c_loc(du), n, &
         c_loc(lam), sizes, n_contact, c_loc(active), c_loc(is_done), c_loc(outcome))
   end subroutine update_active

   subroutine areas(handle, n_node, u1, n_contact, area, length, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(in), target :: u1(2, n_node)
      integer(c_int), intent(in) :: n_contact
      real(c_double), intent(out), target :: area(n_contact)
      real(c_double), intent(out), target :: length(n_contact)
      integer(c_int), intent(out) :: ierr

      area = 0.0_c_double
      length = 0.0_c_double
      if (.not. host_has_nodes(handle, n_node, ierr)) return
      ierr = emcon_interface_get_areas(transfer(handle, c_null_ptr), c_loc(u1), n_contact, &
         c_loc(area), c_loc(length))
   end subroutine areas

   !> `n_redundant` places for `get_redundant`, or matrices for `get_matrix`.
   subroutine null_space(handle, n_redundant, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(out), target :: n_redundant
      integer(c_int), intent(out) :: ierr
      !f2py threadsafe

      n_redundant = 0
      ierr = emcon_interface_get_null_space(transfer(handle, c_null_ptr), c_null_ptr, c_null_ptr, &
         c_loc(n_redundant), c_null_ptr)
   end subroutine null_space

   subroutine get_redundant(handle, n, place, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n
      integer(c_int), intent(out) :: place(n)
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host

      place = 0
      ierr = err_input
      call host_at(handle, host)
      if (.not. associated(host)) return
      if (.not. allocated(host%redundant)) return
      if (size(host%redundant) /= n) return
      ierr = err_none
      place = host%redundant
   end subroutine get_redundant

   subroutine drop(handle, n, place, n_contact, active, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n
      integer(c_int), intent(in), target :: place(n)
      integer(c_int), intent(in) :: n_contact
      integer(c_int), intent(out), target :: active(n_contact)
      integer(c_int), intent(out) :: ierr

      active = 0
      ierr = emcon_interface_drop(transfer(handle, c_null_ptr), n, c_loc(place), n_contact, &
         c_loc(active))
   end subroutine drop

   subroutine multipliers(handle, n_unknown, residual, n, lam, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_unknown
      real(c_double), intent(in), target :: residual(n_unknown)
      integer(c_int), intent(in) :: n
      real(c_double), intent(out), target :: lam(n)
      integer(c_int), intent(out) :: ierr

      lam = 0.0_c_double
      ierr = emcon_interface_multipliers(transfer(handle, c_null_ptr), n_unknown, &
         c_loc(residual), n, c_loc(lam))
   end subroutine multipliers

   subroutine particular(handle, n, defect, n_unknown, dw, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n
      real(c_double), intent(in), target :: defect(n)
      integer(c_int), intent(in) :: n_unknown
      real(c_double), intent(out), target :: dw(n_unknown)
      integer(c_int), intent(out) :: ierr

      dw = 0.0_c_double
      ierr = emcon_interface_particular(transfer(handle, c_null_ptr), n, c_loc(defect), n_unknown, &
         c_loc(dw))
   end subroutine particular

end module emcon_flat_interface_step
