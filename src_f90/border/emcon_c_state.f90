!> The C interface: what a model holds. What each function does is said in emcon.h.
module emcon_c_state
   use, intrinsic :: iso_c_binding, only : c_associated, c_double, c_f_pointer, c_int, c_loc, c_ptr
   use emcon_c_border, only : c_string, check_count, check_given, f_text, put_field, put_number, &
      put_numbers, put_values
   use emcon_c_types, only : ledger_c, sizes_c
   use emcon_errors, only : err_input, err_none, error_t, raise
   use emcon_handle, only : find_built, find_read, handle_pass, model_t
   use emcon_kinds, only : wp
   use emcon_quantities, only : contact_quantity
   use emcon_stepper_query, only : query_momenta
   use emcon_text, only : to_upper
   use emcon_verdict_file, only : verdict_so_far
   implicit none
   private
   public :: emcon_get_sizes, emcon_get_time, emcon_get_ledger, emcon_get_verdict, &
      emcon_get_labels
   public :: emcon_get_positions, emcon_get_state, emcon_get_multipliers, emcon_get_contact
   public :: emcon_get_pairs, emcon_get_momenta, emcon_get_notes, emcon_find_nodes
   public :: emcon_get_pressures

contains

   integer(c_int) function emcon_get_sizes(handle, sizes) bind(c)
      type(c_ptr), value :: handle, sizes
      type(model_t), pointer :: model
      type(sizes_c), pointer :: to

      call find_read(handle, model, emcon_get_sizes)
      if (emcon_get_sizes /= err_none .or. .not. c_associated(sizes)) return
      call c_f_pointer(sizes, to)
      to = sizes_c()
      to%n_node = size(model%stepper%scene%x, 2)
      to%n_element = size(model%stepper%scene%element_label)
      to%n_step = size(model%stepper%scene%step)
      to%n_surface = size(model%stepper%scene%surface)
      to%n_tie = size(model%stepper%scene%tie)
      to%n_selected = model%query%march%active%set%n
      if (.not. allocated(model%stepper%march%scheme)) return
      associate (system => model%stepper%march%system)
         to%n_contact = system%n_constraint - system%first_constraint(1)
         to%n_pair = system%n_pair
         to%n_body = system%space%n_body
         to%n_unknown = system%space%numbering%n_unknown
         to%n_constraint = system%n_constraint
         to%i_step = model%stepper%march%state%i_step
         to%n_load = size(model%stepper%scene%step(to%i_step)%load)
      end associate
   end function emcon_get_sizes

   integer(c_int) function emcon_get_time(handle, time) bind(c)
      type(c_ptr), value :: handle, time
      type(model_t), pointer :: model

      call find_built(handle, model, emcon_get_time)
      if (emcon_get_time == err_none) call put_values([model%stepper%march%state%time], time)
   end function emcon_get_time

   integer(c_int) function emcon_get_ledger(handle, ledger) bind(c)
      type(c_ptr), value :: handle, ledger
      type(model_t), pointer :: model
      type(ledger_c), pointer :: to

      call find_built(handle, model, emcon_get_ledger)
      if (emcon_get_ledger /= err_none .or. .not. c_associated(ledger)) return
      call c_f_pointer(ledger, to)
      associate (from => model%stepper%march%ledger)
         to%kinetic = real(from%kinetic, c_double)
         to%strain = real(from%strain, c_double)
         to%potential = real(from%potential, c_double)
         to%external_work = real(from%external_work, c_double)
         to%contact_work = real(from%contact_work, c_double)
         to%total = real(from%total, c_double)
         to%px = real(from%momentum(1), c_double)
         to%py = real(from%momentum(2), c_double)
         to%lz = real(from%angular, c_double)
         to%stabilization = real(from%stabilization, c_double)
      end associate
   end function emcon_get_ledger

   integer(c_int) function emcon_get_verdict(handle, is_good, json) bind(c)
      type(c_ptr), value :: handle, is_good, json
      type(model_t), pointer :: model
      type(c_ptr), pointer :: place
      logical :: holds

      call find_built(handle, model, emcon_get_verdict)
      if (emcon_get_verdict /= err_none) return
      call verdict_so_far(model%stepper%verdict, model%stepper%march, model%verdict, holds)
      call put_number(merge(1, 0, holds), is_good)
      if (.not. c_associated(json)) return
      model%c_verdict = c_string(model%verdict)
      call c_f_pointer(json, place)
      place = c_loc(model%c_verdict)
   end function emcon_get_verdict

   integer(c_int) function emcon_get_notes(handle, text) bind(c)
      type(c_ptr), value :: handle, text
      type(model_t), pointer :: model
      type(c_ptr), pointer :: place
      character(len=:), allocatable :: lines
      integer :: i

      call find_built(handle, model, emcon_get_notes)
      if (emcon_get_notes /= err_none .or. .not. c_associated(text)) return
      lines = ""
      do i = 1, size(model%stepper%diagnostic)
         lines = lines // model%stepper%diagnostic(i)%text // new_line("a")
      end do
      do i = 1, model%stepper%notes%n
         lines = lines // model%stepper%notes%item(i)%text // new_line("a")
      end do
      model%c_notes = c_string(lines)
      call c_f_pointer(text, place)
      place = c_loc(model%c_notes)
   end function emcon_get_notes

   integer(c_int) function emcon_find_nodes(handle, name, n_node, is_in) bind(c)
      type(c_ptr), value :: handle, name, is_in
      integer(c_int), value :: n_node
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      integer, allocatable :: flag(:)
      integer :: k

      call find_read(handle, model, emcon_find_nodes)
      if (emcon_find_nodes /= err_none) return
      associate (scene => model%stepper%scene)
         call check_given("name", name, error)
         call check_count("n_node", n_node, size(scene%x, 2), error)
         if (.not. allocated(error)) then
            do k = 1, size(scene%node_set)
               if (scene%node_set(k)%name == to_upper(f_text(name))) exit
            end do
            if (k > size(scene%node_set)) then
               call raise(error, err_input, "there is no node set " // f_text(name))
            else
               allocate(flag(size(scene%x, 2)), source=0)
               flag(scene%node_set(k)%item) = 1
               call put_numbers(flag, is_in)
            end if
         end if
      end associate
      call handle_pass(model, error, emcon_find_nodes)
   end function emcon_find_nodes

   integer(c_int) function emcon_get_labels(handle, n_node, label) bind(c)
      type(c_ptr), value :: handle, label
      integer(c_int), value :: n_node
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call find_read(handle, model, emcon_get_labels)
      if (emcon_get_labels /= err_none) return
      call check_count("n_node", n_node, size(model%stepper%scene%x, 2), error)
      if (.not. allocated(error)) call put_numbers(model%stepper%scene%node_label, label)
      call handle_pass(model, error, emcon_get_labels)
   end function emcon_get_labels

   integer(c_int) function emcon_get_positions(handle, n_node, x) bind(c)
      type(c_ptr), value :: handle, x
      integer(c_int), value :: n_node
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call find_read(handle, model, emcon_get_positions)
      if (emcon_get_positions /= err_none) return
      call check_count("n_node", n_node, size(model%stepper%scene%x, 2), error)
      if (.not. allocated(error)) call put_field(model%stepper%scene%x, x)
      call handle_pass(model, error, emcon_get_positions)
   end function emcon_get_positions

   integer(c_int) function emcon_get_state(handle, n_node, u, v) bind(c)
      type(c_ptr), value :: handle, u, v
      integer(c_int), value :: n_node
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call find_built(handle, model, emcon_get_state)
      if (emcon_get_state /= err_none) return
      associate (state => model%stepper%march%state)
         call check_count("n_node", n_node, size(state%u, 2), error)
         if (.not. allocated(error)) call put_field(state%u, u)
         if (.not. allocated(error)) call put_field(state%v, v)
      end associate
      call handle_pass(model, error, emcon_get_state)
   end function emcon_get_state

   integer(c_int) function emcon_get_multipliers(handle, n_constraint, lam, is_active) bind(c)
      type(c_ptr), value :: handle, lam, is_active
      integer(c_int), value :: n_constraint
      type(model_t), pointer :: model
      type(error_t), allocatable :: error

      call find_built(handle, model, emcon_get_multipliers)
      if (emcon_get_multipliers /= err_none) return
      associate (state => model%stepper%march%state)
         call check_count("n_constraint", n_constraint, size(state%lam), error)
         if (.not. allocated(error)) call put_values(state%lam, lam)
         if (.not. allocated(error)) call put_numbers(merge(1, 0, state%is_active), is_active)
      end associate
      call handle_pass(model, error, emcon_get_multipliers)
   end function emcon_get_multipliers

   integer(c_int) function emcon_get_contact(handle, n_contact, lam, is_active, label, pair) bind(c)
      type(c_ptr), value :: handle, lam, is_active, label, pair
      integer(c_int), value :: n_contact
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      integer :: i, before
      integer, allocatable :: of_node(:), of_pair(:)

      call find_built(handle, model, emcon_get_contact)
      if (emcon_get_contact /= err_none) return
      associate (system => model%stepper%march%system, state => model%stepper%march%state)
         before = system%first_constraint(1)
         call check_count("n_contact", n_contact, system%n_constraint - before, error)
         call handle_pass(model, error, emcon_get_contact)
         if (allocated(error)) return
         call put_values(state%lam(before + 1:), lam)
         call put_numbers(merge(1, 0, state%is_active(before + 1:)), is_active)
         allocate(of_node(n_contact), of_pair(n_contact))
         do i = 1, size(system%contact)
            associate (first => system%first_constraint(i) - before + 1, &
                  last => system%first_constraint(i + 1) - before)
               of_node(first:last) = &
                  model%stepper%scene%node_label(system%contact(i)%contact%node)
               of_pair(first:last) = abs(system%contact(i)%of_pair) - 1
            end associate
         end do
         call put_numbers(of_node, label)
         call put_numbers(of_pair, pair)
      end associate
   end function emcon_get_contact

   integer(c_int) function emcon_get_pressures(handle, n_contact, pressure, gap) bind(c)
      type(c_ptr), value :: handle, pressure, gap
      integer(c_int), value :: n_contact
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      integer :: before

      call find_built(handle, model, emcon_get_pressures)
      if (emcon_get_pressures /= err_none) return
      associate (system => model%stepper%march%system)
         before = system%first_constraint(1)
         call check_count("n_contact", n_contact, system%n_constraint - before, error)
      end associate
      if (.not. allocated(error)) then
         call put_quantity("CSTR", pressure)
         call put_quantity("CDIS", gap)
      end if
      call handle_pass(model, error, emcon_get_pressures)

   contains

      subroutine put_quantity(name, to)
         character(len=*), intent(in) :: name
         type(c_ptr), intent(in) :: to
         real(wp), allocatable :: quantity(:, :)

         if (.not. c_associated(to)) return
         quantity = contact_quantity(model%stepper, name)
         call put_values(quantity(1, before + 1:), to)
      end subroutine put_quantity

   end function emcon_get_pressures

   integer(c_int) function emcon_get_pairs(handle, n_pair, total, n_active) bind(c)
      type(c_ptr), value :: handle, total, n_active
      integer(c_int), value :: n_pair
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      integer :: k

      call find_built(handle, model, emcon_get_pairs)
      if (emcon_get_pairs /= err_none) return
      associate (pair => model%stepper%march%state%pairs%total)
         call check_count("n_pair", n_pair, size(pair), error)
         if (.not. allocated(error)) then
            call put_values([(pair(k)%slave, pair(k)%master, pair(k)%length, k = 1, size(pair))], &
               total)
            call put_numbers(pair%n_active, n_active)
         end if
      end associate
      call handle_pass(model, error, emcon_get_pairs)
   end function emcon_get_pairs

   integer(c_int) function emcon_get_momenta(handle, n_body, momenta) bind(c)
      type(c_ptr), value :: handle, momenta
      integer(c_int), value :: n_body
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      real(wp), allocatable :: of_body(:, :)

      call find_built(handle, model, emcon_get_momenta)
      if (emcon_get_momenta /= err_none) return
      call check_count("n_body", n_body, model%stepper%march%system%space%n_body, error)
      if (.not. allocated(error)) call query_momenta(model%query, model%stepper, of_body, error)
      if (.not. allocated(error)) call put_field(of_body, momenta)
      call handle_pass(model, error, emcon_get_momenta)
   end function emcon_get_momenta

end module emcon_c_state
