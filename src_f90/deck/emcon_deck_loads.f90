!> *BOUNDARY, *CLOAD and *DLOAD: the cards. What their entries mean: `emcon_deck_conditions`.
module emcon_deck_loads
   use emcon_deck_conditions, only : conditions_t, drop_loads, drop_prescribed, put_load, &
      put_prescribed
   use emcon_deck_element_kinds, only : face_names, face_number
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, data_warning, &
      get_integer, get_name, get_real, is_blank, next_line
   use emcon_deck_named, only : get_elements, get_nodes
   use emcon_deck_reader, only : card_error, card_t, has_option, option_name, reader_t, &
      refuse_option
   use emcon_deck_tables, only : find_table, table_names
   use emcon_diagnostics, only : label_list, quoted, suggestion
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_steps, only : load_gravity, load_point, load_pressure, load_t, prescribed_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: read_boundary, read_cload, read_dload

   !> Degrees of freedom are numbered up to this one: 3 is out of the plane, 4 to 6 are rotations.
   integer, parameter :: last_freedom = 6

   !> A support that is called by its name.
   type :: support_t
      character(len=8) :: name
      logical :: is_held(3)                        !! displacements along x, y, z
   end type support_t

   type(support_t), parameter :: supports(*) = [ &
      support_t("ENCASTRE", [.true., .true., .true.]), &
      support_t("PINNED", [.true., .true., .true.]), &
      support_t("XSYMM", [.true., .false., .false.]), &
      support_t("YSYMM", [.false., .true., .false.]), &
      support_t("ZSYMM", [.false., .false., .true.]), &
      support_t("XASYMM", [.false., .true., .true.]), &
      support_t("YASYMM", [.true., .false., .true.]), &
      support_t("ZASYMM", [.true., .true., .false.])]

contains

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

   !> *BOUNDARY: node or set, first dof, last dof, value; or node or set, name of a support.
   subroutine read_boundary(reader, card, scene, self)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(conditions_t), intent(inout) :: self
      type(data_t) :: data
      type(prescribed_t) :: new
      integer, allocatable :: item(:)
      logical, allocatable :: is_other(:)
      logical :: is_held(last_freedom), is_again
      integer :: dof, i

      if (is_new(reader, card)) call drop_prescribed(self)
      call check_boundary_options(reader, card)
      new%origin = card%origin
      new%amplitude = card_amplitude(reader, card, scene)
      new%is_frozen = has_option(card, "FIXED")
      call data_open(data, card)
      do while (next_line(reader, data))
         call read_boundary_line(reader, data, is_held, new%value)
         if (data%ok) call get_nodes(reader, data, 1, scene, item)
         if (data%ok) call check_value(reader, data, is_held(scene%n_dim + 1:), new)
         if (.not. data%ok) cycle
         allocate(is_other(size(item)), source=.false.)
         do i = 1, size(item)
            new%node = item(i)
            do dof = 1, scene%n_dim
               if (.not. is_held(dof)) cycle
               new%dof = dof
               call put_prescribed(self, new, is_again)
               is_other(i) = is_other(i) .or. is_again
            end do
         end do
         if (any(is_other)) call data_warning(reader, data, "node " // &
            label_list(pack(scene%node_label(item), is_other)) // " was prescribed otherwise " &
            // "before, in this step too; the last one holds")
         deallocate(is_other)
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

   !> Which degrees of freedom a line prescribes, and the value.
   subroutine read_boundary_line(reader, data, is_held, value)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      logical, intent(out) :: is_held(last_freedom)
      real(wp), intent(out) :: value
      integer :: first, last
      logical :: is_named

      value = 0.0_wp
      is_held = .false.
      call check_count(reader, data, 2, 4, "node or node set, first dof, last dof, value")
      if (.not. data%ok) return
      call read_support(reader, data, is_held, is_named)
      if (is_named) return
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
      else if (last > last_freedom) then
         call data_error(reader, data, "degree of freedom " // to_text(last) &
            // " does not exist; known: 1, 2")
      else
         is_held(first:last) = .true.
      end if
   end subroutine read_boundary_line

   !> The displacements that a support called by its name holds, if field 2 is a name.
   subroutine read_support(reader, data, is_held, is_named)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      logical, intent(inout) :: is_held(:)
      logical, intent(out) :: is_named
      character(len=:), allocatable :: name, known
      integer :: i

      is_named = .not. is_blank(data, 2)
      if (is_named) is_named = scan(data%text(data%from(2):data%from(2)), "+-.0123456789<") == 0
      if (.not. is_named) return
      call get_name(reader, data, 2, "degree of freedom or support", name)
      known = "1, 2"
      do i = 1, size(supports)
         if (supports(i)%name == name) then
            is_held(:3) = supports(i)%is_held
            call check_count(reader, data, 2, 2, "node or node set, " // name)
            return
         end if
         known = known // ", " // trim(supports(i)%name)
      end do
      if (data%ok) call data_error(reader, data, "unknown degree of freedom or support " &
         // quoted(name) // "; known: " // known)
   end subroutine read_support

   !> Out of the plane every displacement is 0; where FIXED holds a node, a value says nothing.
   subroutine check_value(reader, data, is_out, new)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      logical, intent(in) :: is_out(:)             !! degrees of freedom out of the plane
      type(prescribed_t), intent(in) :: new

      if (new%value == 0.0_wp) return
      if (any(is_out)) then
         call data_error(reader, data, "the model is plane: degrees of freedom 3 to 6 are 0, not " &
            // to_text(new%value))
      else if (new%is_frozen) then
         call data_warning(reader, data, "FIXED holds nodes where the step finds them: the value " &
            // to_text(new%value) // " has no effect")
      end if
   end subroutine check_value

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
         if (data%ok .and. new%place > merge(scene%n_dim, last_freedom, new%value /= 0.0_wp)) then
           call data_error(reader, data, "degree of freedom " // to_text(new%place) &
            // " does not exist; known: 1, 2")
         end if
         if (data%ok) call get_nodes(reader, data, 1, scene, item)
         if (.not. data%ok .or. new%place > scene%n_dim) cycle
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
         if (data%ok) call read_load_type(reader, data, maxval(scene%kind%n_face), new)
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

      has_not = scene%kind(scene%element_kind(item))%n_face < face
      if (any(has_not)) call data_error(reader, data, "element " &
         // label_list(pack(scene%element_label(item), has_not)) // " has no face " &
         // to_text(face))
   end subroutine check_faces

   !> Kind, place, value and direction of a load on elements, of up to `n_face` faces.
   subroutine read_load_type(reader, data, n_face, new)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: n_face
      type(load_t), intent(inout) :: new
      character(len=:), allocatable :: name
      real(wp) :: length
      integer :: k

      call get_name(reader, data, 2, "load type", name)
      new%value = 0.0_wp
      new%direction = 0.0_wp
      call get_real(reader, data, 3, "magnitude", new%value)
      if (.not. data%ok) return
      new%place = face_number(name, "P", n_face)
      if (new%place > 0) then
         new%kind = load_pressure
         call check_count(reader, data, 2, 3, "element or element set, load type, pressure")
         return
      end if
      select case (name)
      case ("GRAV")
         new%kind = load_gravity
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
            // "supported: " // face_names("P", n_face) // ", GRAV")
      case default
         call data_error(reader, data, "unknown load type " // quoted(name) &
            // "; known: " // face_names("P", n_face) // ", GRAV")
      end select
   end subroutine read_load_type

end module emcon_deck_loads
