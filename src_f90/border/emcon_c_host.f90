!> The C interface: models of host codes that have solids of their own. What each function does is
!> said in emcon.h.
module emcon_c_host
   use, intrinsic :: iso_c_binding, only : c_associated, c_double, c_f_pointer, c_int, c_ptr
   use emcon_c, only : new_handle
   use emcon_c_border, only : check_count, check_given, f_text, n_nodes, put_field, put_matrix, &
      put_number, take_field, take_flags, take_numbers
   use emcon_c_types, only : contact_settings_c, pair_options_c
   use emcon_errors, only : err_input, err_none, error_t, raise
   use emcon_handle, only : at_d, at_m, find_built, find_read, handle_pass, model_t
   use emcon_interactions, only : contact_options_t
   use emcon_kinds, only : wp
   use emcon_stepper_host, only : stepper_add_pair, stepper_add_surface, stepper_add_tie, &
      stepper_hold, stepper_new, stepper_set_contact, stepper_tie_matrices
   use emcon_stepper_null_space, only : query_follow_links, query_gather_links
   implicit none
   private
   public :: emcon_new, emcon_add_surface, emcon_add_pair, emcon_add_tie, emcon_hold, &
      emcon_set_contact, emcon_get_tie_matrices, emcon_follow, emcon_gather

   !> Twice as many numbers can just be counted.
   integer(c_int), parameter :: most = 2_c_int**30 - 1_c_int

contains

   integer(c_int) function emcon_new(n_node, x, handle) bind(c)
      integer(c_int), value :: n_node
      type(c_ptr), value :: x, handle
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: position(:, :)

      emcon_new = err_input
      call new_handle(handle, model)
      if (.not. associated(model)) return
      call check_given("x", x, error)
      call check_above_0("n_node", n_node, error)
      call take_field(x, n_node, int(n_node), position, error)
      if (.not. allocated(error)) call stepper_new(model%stepper, position, error)
      call handle_pass(model, error, emcon_new)
   end function emcon_new

   subroutine check_above_0(name, n, error)
      character(len=*), intent(in) :: name
      integer(c_int), intent(in) :: n
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      if (n < 1) call raise(error, err_input, name // " is not above 0")
      if (n > most) call raise(error, err_input, name // " is more than can be counted")
   end subroutine check_above_0

   integer(c_int) function emcon_add_surface(handle, name, n_edge, edge, surface) bind(c)
      type(c_ptr), value :: handle, name
      integer(c_int), value :: n_edge
      type(c_ptr), value :: edge, surface
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      integer, allocatable :: node(:)
      integer :: number

      call find_read(handle, model, emcon_add_surface)
      if (emcon_add_surface /= err_none) return
      call check_given("edge", edge, error)
      call check_above_0("n_edge", n_edge, error)
      if (.not. allocated(error)) then
         call take_numbers("edge", edge, 2*n_edge, node, error)
         if (.not. allocated(error)) call stepper_add_surface(model%stepper, f_text(name), &
            reshape(node, [2, int(n_edge)]), number, error)
         if (.not. allocated(error)) call put_number(number - 1, surface)
      end if
      call handle_pass(model, error, emcon_add_surface)
   end function emcon_add_surface

   integer(c_int) function emcon_add_pair(handle, slave, master, formulation, options) bind(c)
      type(c_ptr), value :: handle
      integer(c_int), value :: slave, master, formulation
      type(c_ptr), value :: options
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      type(pair_options_c), pointer :: wanted
      type(contact_options_t) :: choice

      call find_read(handle, model, emcon_add_pair)
      if (emcon_add_pair /= err_none) return
      if (c_associated(options)) then
         call c_f_pointer(options, wanted)
         choice = chosen(wanted)
      end if
      call stepper_add_pair(model%stepper, from_1(slave), from_1(master), int(formulation), &
         choice, error)
      call handle_pass(model, error, emcon_add_pair)
   end function emcon_add_pair

   !> A number that counts from 0 in C; the largest is none.
   pure integer function from_1(number)
      integer(c_int), intent(in) :: number

      from_1 = min(number, huge(number) - 1) + 1
   end function from_1

   !> The options of a pair; 0 is the default.
   pure type(contact_options_t) function chosen(wanted)
      type(pair_options_c), intent(in) :: wanted

      if (wanted%integration /= 0) chosen%integration = wanted%integration
      chosen%n_point = wanted%n_point
      if (wanted%multiplier /= 0) chosen%multiplier = wanted%multiplier
      if (wanted%normal /= 0) chosen%normal = wanted%normal
      if (wanted%smoothing /= 0) chosen%smoothing = wanted%smoothing
      chosen%normal_angle = angle(wanted%normal_angle, chosen%normal_angle)
      chosen%smoothing_angle = angle(wanted%smoothing_angle, chosen%smoothing_angle)

   contains

      pure real(wp) function angle(value, default)
         real(c_double), intent(in) :: value
         real(wp), intent(in) :: default

         angle = default
         if (.not. abs(value) <= 0.0_c_double) angle = real(value, wp)
      end function angle

   end function chosen

   integer(c_int) function emcon_add_tie(handle, slave, master, multiplier, tolerance) bind(c)
      type(c_ptr), value :: handle
      integer(c_int), value :: slave, master, multiplier
      real(c_double), value :: tolerance
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call find_read(handle, model, emcon_add_tie)
      if (emcon_add_tie /= err_none) return
      call stepper_add_tie(model%stepper, from_1(slave), from_1(master), int(multiplier), &
         real(tolerance, wp), error)
      call handle_pass(model, error, emcon_add_tie)
   end function emcon_add_tie

   integer(c_int) function emcon_hold(handle, n_node, held) bind(c)
      type(c_ptr), value :: handle
      integer(c_int), value :: n_node
      type(c_ptr), value :: held
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      logical, allocatable :: flag(:)

      call find_read(handle, model, emcon_hold)
      if (emcon_hold /= err_none) return
      call check_given("held", held, error)
      call check_count("n_node", n_node, n_nodes(model), error)
      call take_flags("n_node", held, 2*n_nodes(model), 2*n_nodes(model), flag, error)
      if (.not. allocated(error)) call stepper_hold(model%stepper, &
         reshape(flag, [2, n_nodes(model)]), error)
      call handle_pass(model, error, emcon_hold)
   end function emcon_hold

   integer(c_int) function emcon_set_contact(handle, settings) bind(c)
      type(c_ptr), value :: handle, settings
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      type(contact_settings_c), pointer :: wanted

      call find_read(handle, model, emcon_set_contact)
      if (emcon_set_contact /= err_none) return
      call check_given("settings", settings, error)
      if (.not. allocated(error)) then
         call c_f_pointer(settings, wanted)
         call stepper_set_contact(model%stepper, merge(wanted%initiation, 1_c_int, &
            wanted%initiation /= 0), real(wanted%gap_tolerance, wp), &
            wanted%is_last_try == 0, wanted%is_end /= 0, error)
      end if
      call handle_pass(model, error, emcon_set_contact)
   end function emcon_set_contact

   integer(c_int) function emcon_get_tie_matrices(handle, tie, d, m) bind(c)
      type(c_ptr), value :: handle
      integer(c_int), value :: tie
      type(c_ptr), value :: d, m
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call find_built(handle, model, emcon_get_tie_matrices)
      if (emcon_get_tie_matrices /= err_none) return
      call stepper_tie_matrices(model%stepper, from_1(tie), model%matrix(at_d), &
         model%matrix(at_m), error)
      call put_matrix(model%matrix(at_d), d)
      call put_matrix(model%matrix(at_m), m)
      call handle_pass(model, error, emcon_get_tie_matrices)
   end function emcon_get_tie_matrices

   integer(c_int) function emcon_follow(handle, n_node, field) bind(c)
      type(c_ptr), value :: handle
      integer(c_int), value :: n_node
      type(c_ptr), value :: field

      call change(handle, n_node, field, .true., emcon_follow)
   end function emcon_follow

   integer(c_int) function emcon_gather(handle, n_node, field) bind(c)
      type(c_ptr), value :: handle
      integer(c_int), value :: n_node
      type(c_ptr), value :: field

      call change(handle, n_node, field, .false., emcon_gather)
   end function emcon_gather

   !> Let dependent freedoms follow the others, or give them what is on the dependent ones.
   subroutine change(handle, n_node, field, follows, ierr)
      type(c_ptr), intent(in) :: handle, field
      integer(c_int), intent(in) :: n_node
      logical, intent(in) :: follows
      integer(c_int), intent(out) :: ierr
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: values(:, :)

      call find_built(handle, model, ierr)
      if (ierr /= err_none) return
      call check_given("field", field, error)
      call take_field(field, n_node, n_nodes(model), values, error)
      if (.not. allocated(error)) then
         if (follows) call query_follow_links(model%stepper, values, error)
         if (.not. follows) call query_gather_links(model%stepper, values, error)
      end if
      if (.not. allocated(error)) call put_field(values, field)
      call handle_pass(model, error, ierr)
   end subroutine change

end module emcon_c_host
