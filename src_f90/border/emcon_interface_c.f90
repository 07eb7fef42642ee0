!> Interfaces for host codes in C: to build them; what each function does is said in
!> emcon_interface.h. Calls of a step: emcon_interface_step_c.
module emcon_interface_c
   use, intrinsic :: iso_c_binding, only : c_associated, c_double, c_f_pointer, c_int, c_int64_t, &
      c_loc, c_null_ptr, c_ptr
   use emcon_c_arrays, only : check_range, take_field, take_flags, take_integers
   use emcon_c_border, only : c_string, check_given, f_text, put_field, put_matrix, &
      put_numbers, put_values
   use emcon_errors, only : err_input, error_t
   use emcon_interactions, only : contact_options_t
   use emcon_interface, only : interface_add_pair, interface_add_surface, interface_add_tie, &
      interface_follow, interface_gather, interface_init, interface_links, interface_prepare, &
      interface_tie_matrices
   use emcon_interface_handle, only : host_at, host_fit, host_make, host_pass, &
      host_t
   use emcon_interface_settings, only : interface_set
   use emcon_interface_step, only : interface_slave_nodes
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   implicit none
   private
   public :: emcon_interface_new, emcon_interface_free, emcon_interface_message, &
      emcon_interface_notes, emcon_interface_add_surface, emcon_interface_add_pair, &
      emcon_interface_add_tie, emcon_interface_set, emcon_interface_prepare, &
      emcon_interface_get_sizes, emcon_interface_get_positions, emcon_interface_get_contacts, &
      emcon_interface_get_tie_matrices, emcon_interface_get_links, emcon_interface_follow, &
      emcon_interface_gather
   public :: c_host, options_c, settings_c, sizes_c

   !> Twice as many nodes can just be counted.
   integer(c_int), parameter :: most_edges = 2_c_int**30 - 1_c_int

   type, bind(c) :: options_c
      integer(c_int) :: integration, n_point, multiplier, normal, smoothing
      real(c_double) :: normal_angle, smoothing_angle
   end type options_c

   type, bind(c) :: settings_c
      integer(c_int) :: initiation
      real(c_double) :: gap_tolerance
      integer(c_int) :: is_last_try, is_end
   end type settings_c

   type, bind(c) :: sizes_c
      integer(c_int) :: n_node, n_surface, n_pair, n_tie, n_contact, n_unknown, n_selected
   end type sizes_c

contains

   !> The interface of a C handle; null, and an error code, for NULL.
   subroutine c_host(face, host, ierr)
      type(c_ptr), intent(in) :: face
      type(host_t), pointer, intent(out) :: host
      integer(c_int), intent(out) :: ierr

      ierr = err_input
      call host_at(transfer(face, 0_c_int64_t), host)
   end subroutine c_host

   integer(c_int) function emcon_interface_new(n_node, x, place) result(ierr) bind(c)
      integer(c_int), value :: n_node
      type(c_ptr), value :: x, place
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      type(c_ptr), pointer :: face
      real(wp), allocatable :: position(:, :)

      ierr = err_input
      if (.not. c_associated(place)) return      ! nothing could be told of it, nor freed
      call c_f_pointer(place, face)
      face = transfer(host_make(), c_null_ptr)
      call c_host(face, host, ierr)
      call take_field("x", x, n_node, position, error)
      if (.not. allocated(error)) call interface_init(host%face, position, error, first=0)
      call host_pass(host, error, ierr)
   end function emcon_interface_new

   subroutine emcon_interface_free(face) bind(c)
      type(c_ptr), value :: face
      type(host_t), pointer :: host
      integer(c_int) :: ierr

      call c_host(face, host, ierr)
      if (associated(host)) deallocate(host)
   end subroutine emcon_interface_free

   type(c_ptr) function emcon_interface_message(face) result(text) bind(c)
      type(c_ptr), value :: face
      type(host_t), pointer :: host
      integer(c_int) :: ierr

      text = c_null_ptr
      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      host%text = c_string(host%message)
      text = c_loc(host%text)
   end function emcon_interface_message

   type(c_ptr) function emcon_interface_notes(face) result(text) bind(c)
      type(c_ptr), value :: face
      type(host_t), pointer :: host
      character(len=:), allocatable :: lines
      integer(c_int) :: ierr
      integer :: i

      text = c_null_ptr
      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      lines = ""
      do i = 1, host%face%notes%n
         lines = lines // host%face%notes%item(i)%text // new_line("a")
      end do
      host%text = c_string(lines)
      text = c_loc(host%text)
   end function emcon_interface_notes

   integer(c_int) function emcon_interface_add_surface(face, name, n_edge, edge, surface) &
      result(ierr) bind(c)
      type(c_ptr), value :: face, name
      integer(c_int), value :: n_edge
      type(c_ptr), value :: edge, surface
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      character(len=:), allocatable :: title
      integer, allocatable :: node(:)
      integer :: number

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      title = f_text(name)
      if (.not. c_associated(name) .and. allocated(host%face%scene%surface)) then
        title = to_text(size(host%face%scene%surface))
      end if
      call take_integers("edge", edge, 2_c_int*max(-1_c_int, min(n_edge, most_edges)), 1, node, &
         error)
      if (host%face%n_node > 0) call check_range("edge", node, host%face%n_node, error)
      if (.not. allocated(error)) call interface_add_surface(host%face, title, &
         reshape(node, [2, size(node)/2]), number, error)
      call host_pass(host, error, ierr)
      if (.not. allocated(error)) call put_numbers([number - 1], surface)
   end function emcon_interface_add_surface

   integer(c_int) function emcon_interface_add_pair(face, slave, master, formulation, options) &
      result(ierr) bind(c)
      type(c_ptr), value :: face
      integer(c_int), value :: slave, master, formulation
      type(c_ptr), value :: options
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      type(options_c), pointer :: wanted
      type(contact_options_t) :: choice

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      if (c_associated(options)) then
         call c_f_pointer(options, wanted)
         choice = chosen(wanted)
      end if
      call check_surfaces(host, slave, master, error)
      if (.not. allocated(error)) call interface_add_pair(host%face, slave + 1, master + 1, &
         formulation, choice, error)
      call host_pass(host, error, ierr)
   end function emcon_interface_add_pair

   !> The options of a pair; 0 is the default.
   pure type(contact_options_t) function chosen(wanted)
      type(options_c), intent(in) :: wanted

      if (wanted%integration /= 0) chosen%integration = wanted%integration
      chosen%n_point = wanted%n_point
      if (wanted%multiplier /= 0) chosen%multiplier = wanted%multiplier
      if (wanted%normal /= 0) chosen%normal = wanted%normal
      if (wanted%smoothing /= 0) chosen%smoothing = wanted%smoothing
      if (.not. abs(wanted%normal_angle) <= 0.0_c_double) then
        chosen%normal_angle = real(wanted%normal_angle, wp)
      end if
      if (.not. abs(wanted%smoothing_angle) <= 0.0_c_double) then
        chosen%smoothing_angle = real(wanted%smoothing_angle, wp)
      end if
   end function chosen

   !> Both surfaces exist.
   subroutine check_surfaces(host, slave, master, error)
      type(host_t), intent(in) :: host
      integer(c_int), intent(in) :: slave, master
      type(error_t), allocatable, intent(inout) :: error

      if (.not. allocated(host%face%scene%surface)) return
      associate (n => size(host%face%scene%surface))
         if (n == 0) return
         call check_range("slave", [min(slave, huge(slave) - 1) + 1], n, error)
         call check_range("master", [min(master, huge(master) - 1) + 1], n, error)
      end associate
   end subroutine check_surfaces

   integer(c_int) function emcon_interface_add_tie(face, slave, master, multiplier, tolerance) &
      result(ierr) bind(c)
      type(c_ptr), value :: face
      integer(c_int), value :: slave, master, multiplier
      real(c_double), value :: tolerance
      type(host_t), pointer :: host
      type(error_t), allocatable :: error

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call check_surfaces(host, slave, master, error)
      if (.not. allocated(error)) call interface_add_tie(host%face, slave + 1, master + 1, &
         multiplier, real(tolerance, wp), error)
      call host_pass(host, error, ierr)
   end function emcon_interface_add_tie

   integer(c_int) function emcon_interface_set(face, settings) result(ierr) bind(c)
      type(c_ptr), value :: face, settings
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      type(settings_c), pointer :: wanted

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call check_given("settings", settings, error)
      if (.not. allocated(error)) then
         call c_f_pointer(settings, wanted)
         call interface_set(host%face, merge(wanted%initiation, 1_c_int, &
            wanted%initiation /= 0), real(wanted%gap_tolerance, wp), &
            wanted%is_last_try == 0, wanted%is_end /= 0, error)
      end if
      call host_pass(host, error, ierr)
   end function emcon_interface_set

   integer(c_int) function emcon_interface_prepare(face, held) result(ierr) bind(c)
      type(c_ptr), value :: face, held
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      logical, allocatable :: flag(:)

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      if (c_associated(held)) then
         call take_flags("held", held, 2*host%face%n_node, flag, error)
      else
         allocate(flag(2*host%face%n_node), source=.false.)
      end if
      if (.not. allocated(error)) call interface_prepare(host%face, &
         reshape(flag, [2, host%face%n_node]), error)
      call host_pass(host, error, ierr)
   end function emcon_interface_prepare

   integer(c_int) function emcon_interface_get_sizes(face, sizes) result(ierr) bind(c)
      type(c_ptr), value :: face, sizes
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      type(sizes_c), pointer :: to

      if (c_associated(sizes)) then
         call c_f_pointer(sizes, to)
         to = sizes_c(0, 0, 0, 0, 0, 0, 0)
      end if
      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call host_pass(host, error, ierr)
      if (host%face%n_node == 0 .or. .not. c_associated(sizes)) return
      to = sizes_c(host%face%n_node, size(host%face%scene%surface), size(host%face%scene%pair), &
         size(host%face%scene%tie), host%face%n_constraint, host%face%n_unknown, &
         host%face%active%set%n)
   end function emcon_interface_get_sizes

   integer(c_int) function emcon_interface_get_positions(face, x, largest_move) result(ierr) bind(c)
      type(c_ptr), value :: face, x, largest_move
      type(host_t), pointer :: host
      type(error_t), allocatable :: error

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call host_pass(host, error, ierr)
      if (host%face%n_node > 0) call put_field(host%face%scene%x, x)
      call put_values([host%face%largest_move], largest_move)
   end function emcon_interface_get_positions

   integer(c_int) function emcon_interface_get_contacts(face, n_contact, node, pair) &
      result(ierr) bind(c)
      type(c_ptr), value :: face
      integer(c_int), value :: n_contact
      type(c_ptr), value :: node, pair
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      integer, allocatable :: slave(:)
      integer :: i

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call interface_slave_nodes(host%face, slave, error)
      if (.not. allocated(error)) call host_fit("n_contact", int(n_contact), size(slave), error)
      call host_pass(host, error, ierr)
      if (allocated(error)) return
      call put_numbers(slave - 1, node)
      call put_numbers([(count(host%face%system%first_constraint < i) - 1, i = 1, size(slave))], &
         pair)
   end function emcon_interface_get_contacts

   integer(c_int) function emcon_interface_get_tie_matrices(face, tie, d, m) result(ierr) bind(c)
      type(c_ptr), value :: face
      integer(c_int), value :: tie
      type(c_ptr), value :: d, m
      type(host_t), pointer :: host
      type(error_t), allocatable :: error

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      if (host%face%is_prepared) call check_range("tie", [min(tie, huge(tie) - 1) + 1], &
         size(host%face%scene%tie), error)
      if (.not. allocated(error)) call interface_tie_matrices(host%face, tie + 1, host%d, host%m, &
         error)
      call host_pass(host, error, ierr)
      if (allocated(error)) return
      call put_matrix(host%d, d)
      call put_matrix(host%m, m)
   end function emcon_interface_get_tie_matrices

   integer(c_int) function emcon_interface_get_links(face, t) result(ierr) bind(c)
      type(c_ptr), value :: face, t
      type(host_t), pointer :: host
      type(error_t), allocatable :: error

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call interface_links(host%face, host%links, error)
      call host_pass(host, error, ierr)
      if (.not. allocated(error)) call put_matrix(host%links, t)
   end function emcon_interface_get_links

   integer(c_int) function emcon_interface_follow(face, field) result(ierr) bind(c)
      type(c_ptr), value :: face, field
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      real(wp), allocatable :: values(:, :)

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call take_field("field", field, host%face%n_node, values, error)
      if (.not. allocated(error)) call interface_follow(host%face, values, error)
      call host_pass(host, error, ierr)
      if (.not. allocated(error)) call put_field(values, field)
   end function emcon_interface_follow

   integer(c_int) function emcon_interface_gather(face, field) result(ierr) bind(c)
      type(c_ptr), value :: face, field
      type(host_t), pointer :: host
      type(error_t), allocatable :: error
      real(wp), allocatable :: values(:, :)

      call c_host(face, host, ierr)
      if (.not. associated(host)) return
      call take_field("field", field, host%face%n_node, values, error)
      if (.not. allocated(error)) call interface_gather(host%face, values, error)
      call host_pass(host, error, ierr)
      if (.not. allocated(error)) call put_field(values, field)
   end function emcon_interface_gather

end module emcon_interface_c
