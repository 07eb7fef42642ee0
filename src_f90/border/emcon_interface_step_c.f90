!> Interfaces for host codes in C: calls of a step; what each function does is said in
!> emcon_interface.h.
module emcon_interface_step_c
   use, intrinsic :: iso_c_binding, only : c_associated, c_double, c_f_pointer, c_int, c_loc, &
      c_null_ptr, c_ptr
   use emcon_c_arrays, only : check_ascending, check_range, put_flags, take_field, &
      take_flags, take_integers, take_list
   use emcon_c_border, only : put_field, put_matrix, put_numbers, put_values, &
      show_matrix
   use emcon_c_types, only : csr_c
   use emcon_contact, only : gap_state_t
   use emcon_errors, only : error_t
   use emcon_interface_areas, only : interface_areas
   use emcon_interface_c, only : c_host
   use emcon_interface_handle, only : host_contacts, host_fit, host_keep, host_pass, &
      host_selected, host_t, host_unknowns
   use emcon_interface_null_space, only : interface_multipliers, interface_null_space, &
      interface_particular
   use emcon_interface_step, only : interface_begin_step, interface_choose, &
      interface_curvature, interface_drop, interface_evaluate, interface_gaps, &
      interface_second_times, interface_select, interface_update_active, step_done
   use emcon_kinds, only : wp
   implicit none
   private
   public :: emcon_interface_begin_step, emcon_interface_get_gaps, emcon_interface_select, &
      emcon_interface_choose, emcon_interface_evaluate, emcon_interface_get_curvature, &
      emcon_interface_second_times, emcon_interface_update_active, emcon_interface_get_areas, &
      emcon_interface_get_null_space, emcon_interface_drop, emcon_interface_multipliers, &
      emcon_interface_particular
   public :: gap_c

   type, bind(c) :: gap_c
      integer(c_int) :: is_near, is_over
      real(c_double) :: gap_start, gap_end, edge
   end type gap_c

   type, bind(c) :: constraints_c
      integer(c_int) :: n = 0
      type(c_ptr) :: contact = c_null_ptr, target = c_null_ptr, gap_start = c_null_ptr
      type(c_ptr) :: gap_end = c_null_ptr, gap_change = c_null_ptr, defect = c_null_ptr
      type(c_ptr) :: edge = c_null_ptr
      type(csr_c) :: g, c
   end type constraints_c

contains

   !> The displacements at the start of a step, and the motion in it.
   subroutine take_motion(host, u0, du, start, motion, error)
      type(host_t), intent(in) :: host
      type(c_ptr), intent(in) :: u0, du
      real(wp), allocatable, intent(out) :: start(:, :), motion(:, :)
      type(error_t), allocatable, intent(inout) :: error

      call take_field("u0", u0, host%face%n_node, start, error)
      call take_field("du", du, host%face%n_node, motion, error)
   end subroutine take_motion

   integer(c_int) function emcon_interface_begin_step(face, u0, du, n_contact, was_active, &
      active) result(ierr) bind(c)
      type(c_ptr), value :: face, u0, du
      integer(c_int), value :: n_contact
      type(c_ptr), value :: was_active, active
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      real(wp), allocatable :: start(:, :), motion(:, :)
      logical, allocatable :: flag(:), next(:)

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call take_motion(host, u0, du, start, motion, error)
      call take_flags("was_active", was_active, n_contact, flag, error, host_contacts(host))
      allocate(next, mold=flag)
      if (.not. allocated(error)) call interface_begin_step(host%face, start, motion, flag, next, &
         error)
      call host_pass(host, error, ierr)
      if (.not. allocated(error)) call put_flags(next, active)
   end function emcon_interface_begin_step

   integer(c_int) function emcon_interface_get_gaps(face, u0, du, n_contact, gap) &
      result(ierr) bind(c)
      type(c_ptr), value :: face, u0, du
      integer(c_int), value :: n_contact
      type(c_ptr), value :: gap
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      real(wp), allocatable :: start(:, :), motion(:, :)
      type(gap_state_t), allocatable :: state(:)
      type(gap_c), pointer :: to(:)

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call take_motion(host, u0, du, start, motion, error)
      call host_fit("n_contact", n_contact, host_contacts(host), error)
      if (.not. allocated(error)) then
         allocate(state(max(0, host_contacts(host))))
         call interface_gaps(host%face, start, motion, state, error)
      end if
      call host_pass(host, error, ierr)
      if (allocated(error) .or. .not. c_associated(gap)) return
      call c_f_pointer(gap, to, shape(state))
      to%is_near = merge(1_c_int, 0_c_int, state%is_near)
      to%is_over = merge(1_c_int, 0_c_int, state%is_over)
      to%gap_start = real(state%gap0, c_double)
      to%gap_end = real(state%gap1, c_double)
      to%edge = real(state%size, c_double)
   end function emcon_interface_get_gaps

   integer(c_int) function emcon_interface_select(face, u0, du, n_contact, active, n) &
      result(ierr) bind(c)
      type(c_ptr), value :: face, u0, du
      integer(c_int), value :: n_contact
      type(c_ptr), value :: active, n
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      real(wp), allocatable :: start(:, :), motion(:, :)
      logical, allocatable :: flag(:)

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call take_motion(host, u0, du, start, motion, error)
      call take_flags("active", active, n_contact, flag, error, host_contacts(host))
      if (.not. allocated(error)) call interface_select(host%face, start, motion, flag, error)
      call host_pass(host, error, ierr)
      if (.not. allocated(error)) call put_numbers([count(flag)], n)
   end function emcon_interface_select

   integer(c_int) function emcon_interface_choose(face, u0, du, n, contact, target) &
      result(ierr) bind(c)
      type(c_ptr), value :: face, u0, du
      integer(c_int), value :: n
      type(c_ptr), value :: contact, target
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      real(wp), allocatable :: start(:, :), motion(:, :), gap(:)
      integer, allocatable :: id(:)

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call take_motion(host, u0, du, start, motion, error)
      call take_integers("contact", contact, n, 1, id, error)
      if (host%face%is_prepared) call check_range("contact", id, host%face%n_constraint, error)
      call check_ascending("contact", id, error)
      call take_list("target", target, n, gap, error)
      if (.not. allocated(error)) call interface_choose(host%face, start, motion, id, gap, error)
      call host_pass(host, error, ierr)
   end function emcon_interface_choose

   integer(c_int) function emcon_interface_evaluate(face, u0, du, constraints) result(ierr) bind(c)
      type(c_ptr), value :: face, u0, du, constraints
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      real(wp), allocatable :: start(:, :), motion(:, :)
      type(constraints_c), pointer :: view

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call take_motion(host, u0, du, start, motion, error)
      if (.not. allocated(error)) call interface_evaluate(host%face, start, motion, host%values, &
         error)
      call host_pass(host, error, ierr)
      if (allocated(error)) return
      call host_keep(host)
      if (.not. c_associated(constraints)) return
      call c_f_pointer(constraints, view)
      call look(host, view)
   end function emcon_interface_evaluate

   !> Let C look at the values of the last evaluation.
   subroutine look(host, view)
      type(host_t), intent(in), target :: host
      type(constraints_c), intent(out) :: view

      view%n = host%values%n
      call show_matrix(host%values%g, view%g)
      call show_matrix(host%values%c, view%c)
      if (view%n == 0) return
      view%contact = c_loc(host%id)
      view%target = c_loc(host%number(1, 1))
      view%gap_start = c_loc(host%number(1, 2))
      view%gap_end = c_loc(host%number(1, 3))
      view%gap_change = c_loc(host%number(1, 4))
      view%defect = c_loc(host%number(1, 5))
      view%edge = c_loc(host%number(1, 6))
   end subroutine look

   integer(c_int) function emcon_interface_get_curvature(face, n, lam, matrix) result(ierr) bind(c)
      type(c_ptr), value :: face
      integer(c_int), value :: n
      type(c_ptr), value :: lam, matrix
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      real(wp), allocatable :: multiplier(:)

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call take_list("lam", lam, n, multiplier, error, host_selected(host))
      if (.not. allocated(error)) call interface_curvature(host%face, multiplier, host%curvature, &
         error)
      call host_pass(host, error, ierr)
      if (.not. allocated(error)) call put_matrix(host%curvature, matrix)
   end function emcon_interface_get_curvature

   integer(c_int) function emcon_interface_second_times(face, n, lam, direction, product) &
      result(ierr) bind(c)
      type(c_ptr), value :: face
      integer(c_int), value :: n
      type(c_ptr), value :: lam, direction, product
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      real(wp), allocatable :: multiplier(:), along(:, :), field(:, :)

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call take_list("lam", lam, n, multiplier, error, host_selected(host))
      call take_field("direction", direction, host%face%n_node, along, error)
      allocate(field, mold=along)
      if (.not. allocated(error)) call interface_second_times(host%face, multiplier, along, field, &
         error)
      call host_pass(host, error, ierr)
      if (.not. allocated(error)) call put_field(field, product)
   end function emcon_interface_second_times

   integer(c_int) function emcon_interface_update_active(face, u0, du, n, lam, magnitude, &
      n_contact, active, is_done, outcome) result(ierr) bind(c)
      type(c_ptr), value :: face, u0, du
      integer(c_int), value :: n
      type(c_ptr), value :: lam, magnitude
      integer(c_int), value :: n_contact
      type(c_ptr), value :: active, is_done, outcome
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      real(wp), allocatable :: start(:, :), motion(:, :), multiplier(:), sizes(:, :)
      logical, allocatable :: flag(:)
      logical :: stands
      integer :: status

      stands = .false.
      status = step_done
      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call take_motion(host, u0, du, start, motion, error)
      call take_list("lam", lam, n, multiplier, error, host_selected(host))
      call take_flags("active", active, n_contact, flag, error, host_contacts(host))
      if (c_associated(magnitude)) call take_field("magnitude", magnitude, host%face%n_node, &
         sizes, error)
      ! Without sizes the last argument counts as absent.
      if (.not. allocated(error)) call interface_update_active(host%face, start, motion, &
         multiplier, flag, stands, status, error, sizes)
      call host_pass(host, error, ierr)
      if (allocated(error)) return
      call put_flags(flag, active)
      call put_flags([stands], is_done)
      call put_numbers([status], outcome)
   end function emcon_interface_update_active

   integer(c_int) function emcon_interface_get_areas(face, u1, n_contact, area, length) &
      result(ierr) bind(c)
      type(c_ptr), value :: face, u1
      integer(c_int), value :: n_contact
      type(c_ptr), value :: area, length
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      real(wp), allocatable :: reached(:, :), areas(:), lengths(:)

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call take_field("u1", u1, host%face%n_node, reached, error)
      call host_fit("n_contact", n_contact, host_contacts(host), error)
      if (.not. allocated(error)) then
         allocate(areas(max(0, host_contacts(host))), lengths(max(0, host_contacts(host))))
         call interface_areas(host%face, reached, areas, lengths, error)
      end if
      call host_pass(host, error, ierr)
      if (allocated(error)) return
      call put_values(areas, area)
      call put_values(lengths, length)
   end function emcon_interface_get_areas

   integer(c_int) function emcon_interface_get_null_space(face, p, df, n_redundant, redundant) &
      result(ierr) bind(c)
      type(c_ptr), value :: face, p, df, n_redundant, redundant
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      integer, allocatable :: place(:)
      type(c_ptr), pointer :: to

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call interface_null_space(host%face, host%p, host%df, place, error)
      call host_pass(host, error, ierr)
      if (allocated(error)) return
      host%redundant = int(place - 1, c_int)
      call put_matrix(host%p, p)
      call put_matrix(host%df, df)
      call put_numbers([size(place)], n_redundant)
      if (.not. c_associated(redundant)) return
      call c_f_pointer(redundant, to)
      to = c_null_ptr
      if (size(place) > 0) to = c_loc(host%redundant)
   end function emcon_interface_get_null_space

   integer(c_int) function emcon_interface_drop(face, n_redundant, redundant, n_contact, active) &
      result(ierr) bind(c)
      type(c_ptr), value :: face
      integer(c_int), value :: n_redundant
      type(c_ptr), value :: redundant
      integer(c_int), value :: n_contact
      type(c_ptr), value :: active
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      integer, allocatable :: place(:)
      logical, allocatable :: left(:)

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call take_integers("redundant", redundant, n_redundant, 1, place, error)
      if (host%face%has_stencils) call check_range("redundant", place, host%face%active%set%n, &
         error)
      call host_fit("n_contact", n_contact, host_contacts(host), error)
      if (.not. allocated(error)) then
         allocate(left(max(0, host_contacts(host))))
         call interface_drop(host%face, place, left, error)
      end if
      call host_pass(host, error, ierr)
      if (.not. allocated(error)) call put_flags(left, active)
   end function emcon_interface_drop

   integer(c_int) function emcon_interface_multipliers(face, n_unknown, residual, n, lam) &
      result(ierr) bind(c)
      type(c_ptr), value :: face
      integer(c_int), value :: n_unknown
      type(c_ptr), value :: residual
      integer(c_int), value :: n
      type(c_ptr), value :: lam
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      real(wp), allocatable :: force(:), multiplier(:)

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call take_list("residual", residual, n_unknown, force, error, host_unknowns(host))
      call host_fit("n", n, host_selected(host), error)
      if (.not. allocated(error)) then
         allocate(multiplier(max(0, host_selected(host))))
         call interface_multipliers(host%face, force, multiplier, error)
      end if
      call host_pass(host, error, ierr)
      if (.not. allocated(error)) call put_values(multiplier, lam)
   end function emcon_interface_multipliers

   integer(c_int) function emcon_interface_particular(face, n, defect, n_unknown, dw) &
      result(ierr) bind(c)
      type(c_ptr), value :: face
      integer(c_int), value :: n
      type(c_ptr), value :: defect
      integer(c_int), value :: n_unknown
      type(c_ptr), value :: dw
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      real(wp), allocatable :: left(:), motion(:)

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call take_list("defect", defect, n, left, error, host_selected(host))
      call host_fit("n_unknown", n_unknown, host_unknowns(host), error)
      if (.not. allocated(error)) then
         allocate(motion(max(0, host_unknowns(host))))
         call interface_particular(host%face, left, motion, error)
      end if
      call host_pass(host, error, ierr)
      if (.not. allocated(error)) call put_values(motion, dw)
   end function emcon_interface_particular

end module emcon_interface_step_c
