!> *BOUNDARY, *CLOAD and *DLOAD, and how they carry over from step to step.
!>
!> One rule for all: what is given again for the same place (node and degree of freedom; element
!> and face; gravity of an element) replaces what was given before, in an earlier step, card or
!> line; two loads on one place do not add up. OP=NEW drops what earlier steps gave.
!>
!> What carries over keeps its value. An amplitude over step time has ended with its step: its
!> last value stays. A load dropped in a static step runs to zero over that step.
module emcon_deck_loads
   use emcon_deck_reader, only : card_error, card_t, check_count, data_error, data_open, data_t, &
      data_warning, get_integer, get_name, get_real, has_option, is_blank, next_line, option_name, &
      reader_t, refuse_option
   use emcon_deck_sets, only : get_elements, get_nodes
   use emcon_deck_tables, only : find_table, table_names
   use emcon_diagnostics, only : label_list, quoted, suggestion
   use emcon_element_kinds, only : element_kinds
   use emcon_kinds, only : wp
   use emcon_scene, only : amplitude_t, find_amplitude_value, load_gravity, load_point, &
      load_pressure, load_t, prescribed_t, procedure_static, scene_t, step_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: conditions_t, conditions_init, conditions_carry, conditions_store
   public :: read_boundary, read_cload, read_dload

   !> What holds in the step that is being read. A slot is the index of the entry at a place, 0:
   !> none. Gravity has the slot of face 0.
   type :: conditions_t
      integer :: step = 0                          !! number of the step, 0: before the first
      integer :: n_prescribed = 0, n_load = 0
      type(prescribed_t), allocatable :: prescribed(:)
      type(load_t), allocatable :: load(:)
      integer, allocatable :: prescribed_step(:), load_step(:)         !! the step that gave it
      logical, allocatable :: prescribed_dropped(:), load_dropped(:)
      integer, allocatable :: prescribed_slot(:, :)                    !! (n_dim, n_node)
      integer, allocatable :: point_slot(:, :)                         !! (n_dim, n_node)
      integer, allocatable :: element_slot(:, :)                       !! (0:n_face, n_element)
      logical :: is_third_told = .false.
   end type conditions_t

contains

   subroutine conditions_init(self, scene)
      type(conditions_t), intent(out) :: self
      type(scene_t), intent(in) :: scene

      allocate(self%prescribed(16), self%prescribed_step(16), self%prescribed_dropped(16))
      allocate(self%load(16), self%load_step(16), self%load_dropped(16))
      allocate(self%prescribed_slot(scene%n_dim, size(scene%node_label)), source=0)
      allocate(self%point_slot(scene%n_dim, size(scene%node_label)), source=0)
      allocate(self%element_slot(0:maxval(element_kinds%n_face), size(scene%element_label)), &
         source=0)
   end subroutine conditions_init

   !> Go to the next step: drop what was dropped, keep the last values of `last`.
   subroutine conditions_carry(self, amplitude, last, time)
      type(conditions_t), intent(inout) :: self
      type(amplitude_t), intent(in) :: amplitude(:)
      type(step_t), intent(in) :: last             !! the step that ends
      real(wp), intent(in) :: time                 !! total time at its start [T]
      real(wp) :: value_end
      integer :: i, n

      self%step = self%step + 1
      self%prescribed_slot = 0
      n = 0
      do i = 1, self%n_prescribed
         if (self%prescribed_dropped(i)) cycle
         n = n + 1
         self%prescribed(n) = self%prescribed(i)
         self%prescribed_step(n) = self%prescribed_step(i)
         self%prescribed_dropped(n) = .false.
         associate (entry_n => self%prescribed(n))
            self%prescribed_slot(entry_n%dof, entry_n%node) = n
            call end_amplitude(amplitude, last%duration, time, entry_n%amplitude, entry_n%value, &
               value_end)
         end associate
      end do
      self%n_prescribed = n
      self%point_slot = 0
      self%element_slot = 0
      n = 0
      do i = 1, self%n_load
         if (self%load_dropped(i)) cycle
         n = n + 1
         self%load(n) = self%load(i)
         self%load_step(n) = self%load_step(i)
         self%load_dropped(n) = .false.
         associate (load => self%load(n))
            call set_load_slot(self, load, n)
            call end_amplitude(amplitude, last%duration, time, load%amplitude, load%value, &
               load%value_start)
         end associate
      end do
      self%n_load = n
   end subroutine conditions_carry

   !> The value at the end of a step. An amplitude over step time is over: that value stays.
   pure subroutine end_amplitude(amplitude, duration, time, i_amplitude, value, value_end)
      type(amplitude_t), intent(in) :: amplitude(:)
      real(wp), intent(in) :: duration, time       !! of the step, and at its start [T]
      integer, intent(inout) :: i_amplitude
      real(wp), intent(inout) :: value
      real(wp), intent(out) :: value_end
      real(wp) :: factor, slope

      value_end = value
      if (i_amplitude == 0) return
      associate (table => amplitude(i_amplitude))
         call find_amplitude_value(table, merge(time + duration, duration, table%is_total_time), &
            factor, slope)
         value_end = value*factor
         if (table%is_total_time) return
      end associate
      value = value_end
      i_amplitude = 0
   end subroutine end_amplitude

   pure integer function load_slot(self, load)
      type(conditions_t), intent(in) :: self
      type(load_t), intent(in) :: load

      if (load%kind == load_point) then
         load_slot = self%point_slot(load%place, load%target)
      else
         load_slot = self%element_slot(load%place, load%target)
      end if
   end function load_slot

   pure subroutine set_load_slot(self, load, i)
      type(conditions_t), intent(inout) :: self
      type(load_t), intent(in) :: load
      integer, intent(in) :: i

      if (load%kind == load_point) then
         self%point_slot(load%place, load%target) = i
      else
         self%element_slot(load%place, load%target) = i
      end if
   end subroutine set_load_slot

   !> All that holds in the step that was read.
   subroutine conditions_store(self, step)
      type(conditions_t), intent(in) :: self
      type(step_t), intent(inout) :: step
      logical :: holds(self%n_load)

      step%prescribed = pack(self%prescribed(:self%n_prescribed), &
         .not. self%prescribed_dropped(:self%n_prescribed))
      holds = .not. self%load_dropped(:self%n_load)
      if (step%procedure == procedure_static) then
         holds = holds .or. self%load(:self%n_load)%value_start /= 0.0_wp
      end if
      step%load = pack(self%load(:self%n_load), holds)
   end subroutine conditions_store

   !> Index of the amplitude that a card names; 0 if it names none, or an unknown one.
   integer function card_amplitude(reader, card, scene)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable :: name

      name = option_name(card, "AMPLITUDE")
      card_amplitude = 0
      if (name == "") return
      card_amplitude = find_table(scene%amplitude, name)
      if (card_amplitude == 0 .and. .not. reader%doubt_names) call card_error(reader, card, &
         "unknown amplitude " // quoted(name) // suggestion(name, table_names(scene%amplitude)))
   end function card_amplitude

   !> Whether a card says OP=NEW.
   logical function is_new(reader, card)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card

      is_new = option_name(card, "OP") == "NEW"
      select case (option_name(card, "OP"))
      case ("", "NEW", "MOD")
         continue
      case default
         call refuse_option(reader, card, "OP", "MOD, NEW", "")
      end select
   end function is_new

   !> *BOUNDARY: node or set, first dof, last dof, value.
   subroutine read_boundary(reader, card, scene, self)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(conditions_t), intent(inout) :: self
      type(data_t) :: data
      type(prescribed_t) :: new
      integer, allocatable :: item(:)
      integer :: first, last, dof, i

      if (is_new(reader, card)) then
         do i = 1, self%n_prescribed
            if (self%prescribed_step(i) < self%step) self%prescribed_dropped(i) = .true.
         end do
      end if
      call check_boundary_options(reader, card)
      new%origin = card%origin
      new%amplitude = card_amplitude(reader, card, scene)
      new%is_frozen = has_option(card, "FIXED")
      call data_open(data, card)
      do while (next_line(reader, data))
         call read_boundary_line(reader, data, first, last, new%value)
         if (data%ok) call get_nodes(reader, data, 1, scene, item)
         if (.not. data%ok) cycle
         if (card%step == 0 .and. new%value /= 0.0_wp) then
            call data_error(reader, data, "before the first step only 0 can be prescribed, not " &
               // to_text(new%value) // "; move it into a step")
            cycle
         end if
         call tell_third(reader, data, last, new%value, self)
         if (.not. data%ok) cycle
         do i = 1, size(item)
            new%node = item(i)
            do dof = first, min(last, scene%n_dim)
               new%dof = dof
               call put_prescribed(self, new)
            end do
         end do
      end do
   end subroutine read_boundary

   subroutine check_boundary_options(reader, card)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card

      if (has_option(card, "FIXED") .and. card%step == 0) then
         call card_error(reader, card, "FIXED may stand only inside a step")
      else if (has_option(card, "FIXED") .and. has_option(card, "AMPLITUDE")) then
         call card_error(reader, card, "FIXED and AMPLITUDE exclude each other")
      end if
      select case (option_name(card, "TYPE"))
      case ("", "DISPLACEMENT")
         continue
      case ("VELOCITY", "ACCELERATION")
         call refuse_option(reader, card, "TYPE", "DISPLACEMENT", &
            "give the displacement over time by an amplitude")
      case default
         call refuse_option(reader, card, "TYPE", "DISPLACEMENT", "")
      end select
   end subroutine check_boundary_options

   subroutine read_boundary_line(reader, data, first, last, value)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(out) :: first, last
      real(wp), intent(out) :: value

      value = 0.0_wp
      call check_count(reader, data, 2, 4, "node or node set, first dof, last dof, value")
      if (.not. data%ok) return
      call get_integer(reader, data, 2, "degree of freedom", first)
      last = first
      if (data%ok .and. .not. is_blank(data, 3)) then
         call get_integer(reader, data, 3, "last degree of freedom", last)
      end if
      call get_real(reader, data, 4, "value", value)
      if (.not. data%ok) return
      if (last < first) then
         call data_error(reader, data, "the last degree of freedom, " // to_text(last) &
            // ", is below the first, " // to_text(first))
      else if (last > 3) then
         call data_error(reader, data, "degree of freedom " // to_text(last) &
            // " does not exist; known: 1, 2")
      end if
   end subroutine read_boundary_line

   !> The third displacement is zero in plane strain: that it is to be is said once.
   subroutine tell_third(reader, data, last, value, self)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: last
      real(wp), intent(in) :: value
      type(conditions_t), intent(inout) :: self

      if (last < 3) return
      if (value /= 0.0_wp) then
         call data_error(reader, data, "the model is plane: degree of freedom 3 does not exist")
      else if (.not. self%is_third_told) then
         call data_warning(reader, data, "the model is plane: degree of freedom 3 is left out " &
            // "(told once)")
         self%is_third_told = .true.
      end if
   end subroutine tell_third

   subroutine put_prescribed(self, new)
      type(conditions_t), intent(inout) :: self
      type(prescribed_t), intent(in) :: new
      type(prescribed_t), allocatable :: grown(:)
      integer :: i, n

      i = self%prescribed_slot(new%dof, new%node)
      if (i == 0) then
         n = self%n_prescribed
         if (n == size(self%prescribed)) then
            allocate(grown(2*n))
            grown(:n) = self%prescribed
            call move_alloc(grown, self%prescribed)
            call grow_marks(self%prescribed_step, self%prescribed_dropped)
         end if
         i = n + 1
         self%n_prescribed = i
         self%prescribed_slot(new%dof, new%node) = i
      end if
      self%prescribed(i) = new
      self%prescribed_step(i) = self%step
      self%prescribed_dropped(i) = .false.
   end subroutine put_prescribed

   subroutine put_load(self, new)
      type(conditions_t), intent(inout) :: self
      type(load_t), intent(in) :: new
      type(load_t), allocatable :: grown(:)
      integer :: i, n
      real(wp) :: value_start

      i = load_slot(self, new)
      value_start = 0.0_wp
      if (i == 0) then
         n = self%n_load
         if (n == size(self%load)) then
            allocate(grown(2*n))
            grown(:n) = self%load
            call move_alloc(grown, self%load)
            call grow_marks(self%load_step, self%load_dropped)
         end if
         i = n + 1
         self%n_load = i
         call set_load_slot(self, new, i)
      else if (all(self%load(i)%direction == new%direction)) then
         value_start = self%load(i)%value_start
      end if
      self%load(i) = new
      self%load(i)%value_start = value_start
      self%load_step(i) = self%step
      self%load_dropped(i) = .false.
   end subroutine put_load

   subroutine grow_marks(step, dropped)
      integer, allocatable, intent(inout) :: step(:)
      logical, allocatable, intent(inout) :: dropped(:)
      integer, allocatable :: grown_step(:)
      logical, allocatable :: grown_dropped(:)
      integer :: n

      n = size(step)
      allocate(grown_step(2*n), grown_dropped(2*n))
      grown_step(:n) = step
      grown_dropped(:n) = dropped
      call move_alloc(grown_step, step)
      call move_alloc(grown_dropped, dropped)
   end subroutine grow_marks

   !> Drop the loads of earlier steps: point loads, or those on elements.
   subroutine drop_loads(self, on_nodes)
      type(conditions_t), intent(inout) :: self
      logical, intent(in) :: on_nodes
      integer :: i

      do i = 1, self%n_load
         if ((self%load(i)%kind == load_point) .neqv. on_nodes) cycle
         if (self%load_step(i) == self%step) cycle
         self%load_dropped(i) = .true.
         self%load(i)%value = 0.0_wp
         self%load(i)%amplitude = 0
      end do
   end subroutine drop_loads

   !> *CLOAD: node or set, dof, force.
   subroutine read_cload(reader, card, scene, self)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(conditions_t), intent(inout) :: self
      type(data_t) :: data
      type(load_t) :: new
      integer, allocatable :: item(:)
      integer :: i

      if (is_new(reader, card)) call drop_loads(self, on_nodes=.true.)
      new%origin = card%origin
      new%kind = load_point
      new%amplitude = card_amplitude(reader, card, scene)
      call data_open(data, card)
      do while (next_line(reader, data))
         call check_count(reader, data, 2, 3, "node or node set, degree of freedom, force")
         if (.not. data%ok) cycle
         call get_integer(reader, data, 2, "degree of freedom", new%place)
         new%value = 0.0_wp
         call get_real(reader, data, 3, "force", new%value)
         if (data%ok .and. new%place > scene%n_dim) call data_error(reader, data, &
            "degree of freedom " // to_text(new%place) // " does not exist; known: 1, 2")
         if (data%ok) call get_nodes(reader, data, 1, scene, item)
         if (.not. data%ok) cycle
         do i = 1, size(item)
            new%target = item(i)
            call put_load(self, new)
         end do
      end do
   end subroutine read_cload

   !> *DLOAD: element or set, P1..P4, pressure; or element or set, GRAV, acceleration, direction.
   subroutine read_dload(reader, card, scene, self)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(conditions_t), intent(inout) :: self
      type(data_t) :: data
      type(load_t) :: new
      integer, allocatable :: item(:)
      integer :: i

      if (is_new(reader, card)) call drop_loads(self, on_nodes=.false.)
      new%origin = card%origin
      new%amplitude = card_amplitude(reader, card, scene)
      call data_open(data, card)
      do while (next_line(reader, data))
         call check_count(reader, data, 2, 6, "element or element set, load type, magnitude")
         if (data%ok) call read_load_type(reader, data, new)
         if (data%ok) call get_elements(reader, data, 1, scene, item)
         if (data%ok) call check_faces(reader, data, scene, item, new%place)
         if (.not. data%ok) cycle
         do i = 1, size(item)
            new%target = item(i)
            call put_load(self, new)
         end do
      end do
   end subroutine read_dload

   subroutine check_faces(reader, data, scene, item, face)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: item(:)
      integer, intent(in) :: face
      logical :: has_not(size(item))

      has_not = element_kinds(scene%element_kind(item))%n_face < face
      if (any(has_not)) call data_error(reader, data, "element " &
         // label_list(pack(scene%element_label(item), has_not)) // " has no face " // to_text(face))
   end subroutine check_faces

   !> Kind, place, value and direction of a load on elements.
   subroutine read_load_type(reader, data, new)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(load_t), intent(inout) :: new
      character(len=:), allocatable :: name
      real(wp) :: length
      integer :: k

      call get_name(reader, data, 2, "load type", name)
      new%value = 0.0_wp
      new%direction = 0.0_wp
      call get_real(reader, data, 3, "magnitude", new%value)
      if (.not. data%ok) return
      select case (name)
      case ("P1", "P2", "P3", "P4")
         new%kind = load_pressure
         new%place = index("1234", name(2:2))
         call check_count(reader, data, 2, 3, "element or element set, load type, pressure")
      case ("GRAV")
         new%kind = load_gravity
         new%place = 0
         do k = 1, 3
            call get_real(reader, data, 3 + k, "direction", new%direction(k))
         end do
         length = norm2(new%direction)
         if (.not. data%ok) then
            return
         else if (new%direction(3) /= 0.0_wp) then
            call data_error(reader, data, "the model is plane: gravity has no third component")
         else if (length <= 0.0_wp) then
            call data_error(reader, data, "gravity needs a direction: set, GRAV, g, nx, ny")
         else
            new%direction = new%direction/length
         end if
      case ("CENTRIF", "CORIO", "BX", "BY", "BZ", "P1NU", "P2NU", "P3NU", "P4NU", "HP1", "NEWTON")
         call data_error(reader, data, "load type " // name // " is known but not supported; " &
            // "supported: P1, P2, P3, P4, GRAV")
      case default
         call data_error(reader, data, "unknown load type " // quoted(name) &
            // "; known: P1, P2, P3, P4, GRAV")
      end select
   end subroutine read_load_type

end module emcon_deck_loads
