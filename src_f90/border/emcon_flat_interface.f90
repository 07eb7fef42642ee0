!> Interfaces for host codes as f2py wraps them: to build them, and what they keep.
!>
!> A handle is the address of an interface, 0 for none. Numbers count from 0. Each routine stands
!> for the one of emcon_interface.h with that name. Calls of a step: emcon_flat_interface_step.
module emcon_flat_interface
   use, intrinsic :: iso_c_binding, only : c_double, c_int, c_int64_t, c_loc, c_null_char, &
      c_null_ptr, c_ptr
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_input, err_none
   use emcon_interface_c, only : emcon_interface_add_pair, emcon_interface_add_surface, &
      emcon_interface_add_tie, emcon_interface_follow, emcon_interface_free, &
      emcon_interface_gather, emcon_interface_get_contacts, emcon_interface_get_links, &
      emcon_interface_get_positions, emcon_interface_get_sizes, emcon_interface_get_tie_matrices, &
      emcon_interface_new, emcon_interface_prepare, emcon_interface_set, options_c, settings_c, &
      sizes_c
   use emcon_interface_handle, only : host_at, host_has_nodes, host_t
   implicit none
   private
   public :: new_interface, close_interface, message, notes, add_surface, add_pair, add_tie
   public :: set_options, prepare, sizes, positions, contacts, links, tie_matrices, follow, gather
   public :: matrix_size, get_matrix

   !> What `matrix_size` and `get_matrix` know.
   integer, parameter :: of_g = 1, of_c = 2, of_curvature = 3, of_p = 4, of_df = 5, of_links = 6, &
      of_d = 7, of_m = 8

contains

   subroutine new_interface(n_node, x, handle, ierr)
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(in), target :: x(2, n_node)
      integer(c_int64_t), intent(out) :: handle
      integer(c_int), intent(out) :: ierr
      type(c_ptr), target :: face

      ierr = emcon_interface_new(n_node, c_loc(x), c_loc(face))
      handle = transfer(face, handle)
   end subroutine new_interface

   subroutine close_interface(handle)
      integer(c_int64_t), intent(in) :: handle

      call emcon_interface_free(transfer(handle, c_null_ptr))
   end subroutine close_interface

   !> Text of the last failure.
   subroutine message(handle, text)
      integer(c_int64_t), intent(in) :: handle
      character(len=8192), intent(out) :: text
      type(host_t), pointer :: host

      text = "the interface is closed"
      call host_at(handle, host)
      if (associated(host)) text = host%message
   end subroutine message

   !> Remark `i` on the ties, from 0; there are `n`.
   subroutine notes(handle, i, n, text)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: i
      integer(c_int), intent(out) :: n
      character(len=8192), intent(out) :: text
      type(host_t), pointer :: host

      n = 0
      text = ""
      call host_at(handle, host)
      if (.not. associated(host)) return
      n = host%face%notes%n
      if (i >= 0 .and. i < n) text = host%face%notes%item(i + 1)%text
   end subroutine notes

   subroutine add_surface(handle, name, n_edge, edge, number, ierr)
      integer(c_int64_t), intent(in) :: handle
      character(len=*), intent(in) :: name
      integer(c_int), intent(in) :: n_edge
      integer(c_int), intent(in), target :: edge(2, n_edge)
      integer(c_int), intent(out), target :: number
      integer(c_int), intent(out) :: ierr
      character(len=len(name) + 1), target :: title

      number = 0
      title = name // c_null_char
      ierr = emcon_interface_add_surface(transfer(handle, c_null_ptr), c_loc(title), n_edge, &
         c_loc(edge), c_loc(number))
   end subroutine add_surface

   !> `choice`: integration, Gauss points, multiplier, normal, smoothing, 0 for the default;
   !> `angle`: of normals, of smoothing [degrees].
   subroutine add_pair(handle, slave, master, formulation, choice, angle, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: slave, master, formulation
      integer(c_int), intent(in) :: choice(5)
      real(c_double), intent(in) :: angle(2)
      integer(c_int), intent(out) :: ierr
      type(options_c), target :: options

      options = options_c(choice(1), choice(2), choice(3), choice(4), choice(5), angle(1), angle(2))
      ierr = emcon_interface_add_pair(transfer(handle, c_null_ptr), slave, master, formulation, &
         c_loc(options))
   end subroutine add_pair

   subroutine add_tie(handle, slave, master, multiplier, tolerance, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: slave, master, multiplier
      real(c_double), intent(in) :: tolerance
      integer(c_int), intent(out) :: ierr

      ierr = emcon_interface_add_tie(transfer(handle, c_null_ptr), slave, master, multiplier, &
         tolerance)
   end subroutine add_tie

   subroutine set_options(handle, initiation, gap_tolerance, is_last_try, is_end, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: initiation
      real(c_double), intent(in) :: gap_tolerance
      integer(c_int), intent(in) :: is_last_try, is_end
      integer(c_int), intent(out) :: ierr
      type(settings_c), target :: settings

      settings = settings_c(initiation, gap_tolerance, is_last_try, is_end)
      ierr = emcon_interface_set(transfer(handle, c_null_ptr), c_loc(settings))
   end subroutine set_options

   subroutine prepare(handle, n_node, held, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_node
      integer(c_int), intent(in), target :: held(2, n_node)
      integer(c_int), intent(out) :: ierr
      !f2py threadsafe

      if (.not. host_has_nodes(handle, n_node, ierr)) return
      ierr = emcon_interface_prepare(transfer(handle, c_null_ptr), c_loc(held))
   end subroutine prepare

   !> Nodes, surfaces, pairs, ties, possible contacts, unknowns, selected contacts.
   subroutine sizes(handle, n, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(out) :: n(7)
      integer(c_int), intent(out) :: ierr
      type(sizes_c), target :: counts

      ierr = emcon_interface_get_sizes(transfer(handle, c_null_ptr), c_loc(counts))
      n = [counts%n_node, counts%n_surface, counts%n_pair, counts%n_tie, counts%n_contact, &
         counts%n_unknown, counts%n_selected]
   end subroutine sizes

   subroutine positions(handle, n_node, x, largest_move, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(out), target :: x(2, n_node)
      real(c_double), intent(out), target :: largest_move
      integer(c_int), intent(out) :: ierr

      x = 0.0_c_double
      largest_move = 0.0_c_double
      if (.not. host_has_nodes(handle, n_node, ierr)) return
      ierr = emcon_interface_get_positions(transfer(handle, c_null_ptr), c_loc(x), &
         c_loc(largest_move))
   end subroutine positions

   subroutine contacts(handle, n_contact, node, pair, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_contact
      integer(c_int), intent(out), target :: node(n_contact)
      integer(c_int), intent(out), target :: pair(n_contact)
      integer(c_int), intent(out) :: ierr

      node = 0
      pair = 0
      ierr = emcon_interface_get_contacts(transfer(handle, c_null_ptr), n_contact, c_loc(node), &
         c_loc(pair))
   end subroutine contacts

   !> The matrix stays in the interface: `get_matrix`.
   subroutine links(handle, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(out) :: ierr

      ierr = emcon_interface_get_links(transfer(handle, c_null_ptr), c_null_ptr)
   end subroutine links

   !> The matrices stay in the interface: `get_matrix`.
   subroutine tie_matrices(handle, tie, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: tie
      integer(c_int), intent(out) :: ierr

      ierr = emcon_interface_get_tie_matrices(transfer(handle, c_null_ptr), tie, c_null_ptr, &
         c_null_ptr)
   end subroutine tie_matrices

   subroutine follow(handle, n_node, field, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(inout), target :: field(2, n_node)
      integer(c_int), intent(out) :: ierr

      if (.not. host_has_nodes(handle, n_node, ierr)) return
      ierr = emcon_interface_follow(transfer(handle, c_null_ptr), c_loc(field))
   end subroutine follow

   subroutine gather(handle, n_node, field, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: n_node
      real(c_double), intent(inout), target :: field(2, n_node)
      integer(c_int), intent(out) :: ierr

      if (.not. host_has_nodes(handle, n_node, ierr)) return
      ierr = emcon_interface_gather(transfer(handle, c_null_ptr), c_loc(field))
   end subroutine gather

   !> The matrix of number `which`, as asked for last; null if it was not.
   subroutine find_matrix(handle, which, matrix)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: which
      type(csr_t), pointer, intent(out) :: matrix
      type(host_t), pointer :: host

      matrix => null()
      call host_at(handle, host)
      if (.not. associated(host)) return
      select case (which)
      case (of_g)
         matrix => host%values%g
      case (of_c)
         matrix => host%values%c
      case (of_curvature)
         matrix => host%curvature
      case (of_p)
         matrix => host%p
      case (of_df)
         matrix => host%df
      case (of_links)
         matrix => host%links
      case (of_d)
         matrix => host%d
      case (of_m)
         matrix => host%m
      end select
      if (.not. associated(matrix)) return
      if (.not. allocated(matrix%row_start)) matrix => null()
   end subroutine find_matrix

   !> Rows, columns and entries of a matrix.
   subroutine matrix_size(handle, which, n, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: which
      integer(c_int), intent(out) :: n(3)
      integer(c_int), intent(out) :: ierr
      type(csr_t), pointer :: matrix

      n = 0
      ierr = err_input
      call find_matrix(handle, which, matrix)
      if (.not. associated(matrix)) return
      ierr = err_none
      n = [matrix%n_row, matrix%n_col, matrix%row_start(matrix%n_row + 1)]
   end subroutine matrix_size

   !> A copy of a matrix of these sizes.
   subroutine get_matrix(handle, which, n_row, n_entry, row_start, column, value, ierr)
      integer(c_int64_t), intent(in) :: handle
      integer(c_int), intent(in) :: which, n_row, n_entry
      integer(c_int), intent(out) :: row_start(n_row + 1)
      integer(c_int), intent(out) :: column(n_entry)
      real(c_double), intent(out) :: value(n_entry)
      integer(c_int), intent(out) :: ierr
      type(csr_t), pointer :: matrix

      row_start = 0
      column = 0
      value = 0.0_c_double
      ierr = err_input
      call find_matrix(handle, which, matrix)
      if (.not. associated(matrix)) return
      if (matrix%n_row /= n_row .or. matrix%row_start(matrix%n_row + 1) /= n_entry) return
      ierr = err_none
      row_start = matrix%row_start
      column = matrix%column(:n_entry)
      value = matrix%value(:n_entry)
   end subroutine get_matrix

end module emcon_flat_interface
