!> *BOUNDARY and *CLOAD: the cards. What their entries mean: `emcon_deck_conditions`.
module emcon_deck_loads
   use emcon_deck_conditions, only : conditions_t, drop_loads, drop_prescribed, put_load, &
      put_prescribed
   use emcon_deck_dimension, only : freedoms_text, n_plane
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, data_warning, &
      get_integer, get_name, get_real, is_blank, next_line
   use emcon_deck_named, only : get_nodes
   use emcon_deck_reader, only : card_error, card_t, has_option, option_name, option_word, &
      reader_t
   use emcon_deck_rigid, only : mark_rigid
   use emcon_deck_tables, only : card_table_name, table_names
   use emcon_diagnostics, only : label_list, quoted, suggestion
   use emcon_kinds, only : wp
   use emcon_name_index, only : name_index_find
   use emcon_rotation, only : n_turn
   use emcon_scene, only : scene_t
   use emcon_steps, only : by_node, load_moment, load_point, load_t, prescribed_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: read_boundary, read_cload, card_amplitude, get_load, is_new

   !> Degrees of freedom are numbered up to this one: 3 is out of the plane, 4 to 6 are rotations.
   integer, parameter :: last_freedom = 6

   !> A support that is called by its name.
   type :: support_t
      character(len=8) :: name
      logical :: is_held(last_freedom)             !! displacements along x, y, z, and rotations
   end type support_t

   type(support_t), parameter :: supports(*) = [ &
      support_t("ENCASTRE", [1, 1, 1, 1, 1, 1] == 1), &
      support_t("PINNED", [1, 1, 1, 0, 0, 0] == 1), &
      support_t("XSYMM", [1, 0, 0, 0, 1, 1] == 1), &
      support_t("YSYMM", [0, 1, 0, 1, 0, 1] == 1), &
      support_t("ZSYMM", [0, 0, 1, 1, 1, 0] == 1), &
      support_t("XASYMM", [0, 1, 1, 1, 0, 0] == 1), &
      support_t("YASYMM", [1, 0, 1, 0, 1, 0] == 1), &
      support_t("ZASYMM", [1, 1, 0, 0, 0, 1] == 1)]

contains

   !> Index of the amplitude that a card names; 0 if it names none, or an unknown one.
   integer function card_amplitude(reader, card, scene)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable :: name

      call card_table_name(card, name)
      card_amplitude = 0
      if (name == "") return
      card_amplitude = name_index_find(reader%names%amplitudes, name)
      name = option_name(card, "AMPLITUDE")
      if (card_amplitude == 0 .and. .not. reader%doubt%names) call card_error(reader, card, &
         "unknown amplitude " // quoted(name) // suggestion(name, table_names(scene%amplitude)))
   end function card_amplitude

   !> Whether a card says OP=NEW.
   logical function is_new(reader, card)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=:), allocatable :: word

      call option_word(reader, card, "OP", "MOD, NEW", word)
      is_new = word == "NEW"
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
      integer, allocatable :: freedom(:)
      integer :: i, k

      if (is_new(reader, card)) call drop_prescribed(self)
      call check_boundary_options(reader, card)
      new%origin = card%origin
      new%amplitude = card_amplitude(reader, card, scene)
      if (has_option(card, "FIXED")) then
         new%is_frozen = .true.
         new%amplitude = 0
      end if
      call data_open(data, card)
      do while (next_line(reader, data))
         call read_boundary_line(reader, data, scene%n_dim, is_held, new%value)
         if (data%ok) call get_nodes(reader, data, 1, scene, item)
         if (data%ok) call check_rigid(reader, data, scene, is_held, item)
         if (data%ok) call check_value(reader, data, scene, is_held, item, new)
         reader%doubt%prescribed = reader%doubt%prescribed .or. .not. data%ok
         if (.not. data%ok) cycle
         allocate(is_other(size(item)), source=.false.)
         do i = 1, size(item)
            call find_entries(scene, item(i), is_held, new%node, freedom)
            do k = 1, size(freedom)
               call put(freedom(k))
            end do
         end do
         if (any(is_other)) call data_warning(reader, data, "node " // &
            label_list(pack(scene%node%label(item), is_other)) // " was prescribed otherwise " &
            // "before, in this step too; the last one holds")
         deallocate(is_other)
      end do

   contains

      subroutine put(freedom)
         integer, intent(in) :: freedom          !! of the node: rotations follow displacements

         new%dof = freedom
         call put_prescribed(self, new, is_again)
         is_other(i) = is_other(i) .or. is_again
      end subroutine put

   end subroutine read_boundary

   !> What a line prescribes by a node: its displacements, of reference nodes rotations too, and by
   !> the ROT NODE of a rigid body the rotations of that.
   pure subroutine find_entries(scene, item, is_held, node, freedom)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: item                  !! node of the line
      logical, intent(in) :: is_held(:)            !! (last_freedom)
      integer, intent(out) :: node                 !! that is prescribed
      integer, allocatable, intent(out) :: freedom(:)   !! of it: rotations follow displacements
      integer :: b, k

      b = findloc(scene%rigid%turning, item, 1)
      associate (n => scene%n_dim, n_turns => n_turn(scene%n_dim))
         if (b > 0) then
            node = scene%rigid(b)%reference
            freedom = n + pack([(k, k = 1, n_turns)], is_held(:n_turns))
         else
            node = item
            freedom = pack([(k, k = 1, n)], is_held(:n))
            if (any(scene%rigid%reference == item)) freedom = [freedom, n + &
               pack([(k, k = 1, n_turns)], is_held(last_freedom - n_turns + 1:))]
         end if
      end associate
   end subroutine find_entries

   !> Of a rigid body the reference node is prescribed, and none other.
   subroutine check_rigid(reader, data, scene, is_held, item)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: is_held(:)            !! (last_freedom)
      integer, intent(in) :: item(:)               !! nodes
      integer :: body(size(scene%node%label)), i

      if (.not. any(is_held(:scene%n_dim))) return
      call mark_rigid(scene, body)
      do i = 1, size(item)
         if (body(item(i)) == 0) cycle
         associate (rigid => scene%rigid(body(item(i))))
            if (rigid%reference == item(i)) cycle
            call data_error(reader, data, "node " // to_text(scene%node%label(item(i))) // &
               " belongs to rigid body " // rigid%name // ", which moves as its reference node " &
               // to_text(scene%node%label(rigid%reference)) // " does; prescribe that node")
            return
         end associate
      end do
   end subroutine check_rigid

   subroutine check_boundary_options(reader, card)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=:), allocatable :: word

      if (has_option(card, "FIXED") .and. card%step == 0) then
         call card_error(reader, card, "FIXED may stand only inside a step")
      else if (has_option(card, "FIXED") .and. has_option(card, "AMPLITUDE")) then
         call card_error(reader, card, "FIXED and AMPLITUDE exclude each other")
      end if
      call option_word(reader, card, "TYPE", "DISPLACEMENT", word, "VELOCITY, ACCELERATION", &
         "give the displacement over time by an amplitude")
   end subroutine check_boundary_options

   !> Which degrees of freedom a line prescribes, and the value.
   subroutine read_boundary_line(reader, data, n_dim, is_held, value)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: n_dim
      logical, intent(out) :: is_held(last_freedom)
      real(wp), intent(out) :: value
      integer :: first, last
      logical :: is_named

      value = 0.0_wp
      is_held = .false.
      call check_count(reader, data, 2, 4, "node or node set, first dof, last dof, value")
      if (.not. data%ok) return
      call read_support(reader, data, n_dim, is_held, is_named)
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
            // " does not exist; known: " // freedoms_text(n_dim))
      else
         is_held(first:last) = .true.
      end if
   end subroutine read_boundary_line

   !> The displacements that a support called by its name holds, if field 2 is a name.
   subroutine read_support(reader, data, n_dim, is_held, is_named)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: n_dim
      logical, intent(inout) :: is_held(:)
      logical, intent(out) :: is_named
      character(len=:), allocatable :: name, known
      integer :: i

      is_named = .not. is_blank(data, 2)
      if (is_named) is_named = scan(data%text(data%from(2):data%from(2)), "+-.0123456789<") == 0
      if (.not. is_named) return
      call get_name(reader, data, 2, "degree of freedom or support", name)
      known = freedoms_text(n_dim)
      do i = 1, size(supports)
         if (supports(i)%name == name) then
            is_held = supports(i)%is_held
            call check_count(reader, data, 2, 2, "node or node set, " // name)
            return
         end if
         known = known // ", " // trim(supports(i)%name)
      end do
      if (data%ok) call data_error(reader, data, "unknown degree of freedom or support " &
         // quoted(name) // "; known: " // known)
   end subroutine read_support

   !> Out of the plane every displacement is 0, and only reference nodes turn; where FIXED holds a
   !> node, a value says nothing.
   subroutine check_value(reader, data, scene, is_held, item, new)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: is_held(:)            !! (last_freedom)
      integer, intent(in) :: item(:)               !! nodes
      type(prescribed_t), intent(in) :: new
      integer :: i

      if (new%value == 0.0_wp) return
      if (any(is_held(scene%n_dim + 1:last_freedom - n_turn(scene%n_dim)))) then
         call data_error(reader, data, "the model is plane: degrees of freedom 3 to 5 are 0, not " &
            // to_text(new%value))
      else if (any(is_held(last_freedom - n_turn(scene%n_dim) + 1:)) .and. .not. &
         reader%doubt%rigid) then
         do i = 1, size(item)
            if (any(scene%rigid%reference == item(i))) cycle
            call data_error(reader, data, "node " // to_text(scene%node%label(item(i))) // &
               " cannot turn by " // to_text(new%value) // ": degree" // trim(merge( &
               " of freedom 6 is that  ", "s of freedom 4 to 6 are", scene%n_dim == n_plane)) // &
               " of the reference node of a *RIGID BODY")
            return
         end do
      end if
      if (data%ok .and. has_option(data%card, "FIXED")) then
         call data_warning(reader, data, "FIXED holds nodes where the step finds them: the value " &
            // to_text(new%value) // " has no effect")
      end if
   end subroutine check_value

   !> *CLOAD: node or set, dof, force or moment.
   subroutine read_cload(reader, card, scene, self)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(conditions_t), intent(inout) :: self
      type(data_t) :: data
      type(load_t) :: new
      integer, allocatable :: item(:)
      integer :: freedom, i

      if (is_new(reader, card)) call drop_loads(self, by_node)
      new%origin = card%origin
      new%amplitude = card_amplitude(reader, card, scene)
      call data_open(data, card)
      do while (next_line(reader, data))
         call check_count(reader, data, 2, 3, "node or node set, degree of freedom, force")
         if (.not. data%ok) cycle
         call get_integer(reader, data, 2, "degree of freedom", freedom)
         call get_load(reader, data, "force", new%value)
         if (data%ok) call get_nodes(reader, data, 1, scene, item)
         if (data%ok) call check_force(reader, data, scene, item, freedom, new%value)
         if (.not. data%ok) cycle
         do i = 1, size(item)
            call find_load(scene, item(i), freedom, new)
            if (new%target > 0) call put_load(self, new)
         end do
      end do
   end subroutine read_cload

   !> The value of a load, field 3 of a line: an empty field is 0, and so is one that is not there,
   !> which is told.
   subroutine get_load(reader, data, what, value)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      character(len=*), intent(in) :: what         !! it is, for messages
      real(wp), intent(out) :: value

      value = 0.0_wp
      call get_real(reader, data, 3, what, value)
      if (data%ok .and. is_blank(data, 3) .and. .not. data%ends_in_comma) call data_warning( &
         reader, data, "the " // what // " is missing: 0 is taken")
   end subroutine get_load

   !> What acts where a line says: a force on a node; a moment on the reference node of a rigid
   !> body, by its own rotations or as a force on the ROT NODE; or nothing.
   pure subroutine find_load(scene, node, freedom, load)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: node
      integer, intent(in) :: freedom               !! 1..last_freedom
      type(load_t), intent(inout) :: load          !! `target` 0: nothing
      integer :: b, turn

      b = findloc(scene%rigid%turning, node, 1)
      turn = freedom - (last_freedom - n_turn(scene%n_dim))
      if (b > 0) turn = freedom
      load%kind = merge(load_moment, load_point, b > 0 .or. turn > 0)
      load%place = merge(scene%n_dim + turn, freedom, load%kind == load_moment)
      load%target = node
      if (b > 0) load%target = scene%rigid(b)%reference
      if (b == 0 .and. turn > 0 .and. .not. any(scene%rigid%reference == node)) load%target = 0
      if (turn > n_turn(scene%n_dim) .or. (turn <= 0 .and. freedom > scene%n_dim)) load%target = 0
   end subroutine find_load

   !> Forces act along the axes of the model, moments on reference nodes of rigid bodies.
   subroutine check_force(reader, data, scene, item, freedom, value)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: item(:)               !! nodes
      integer, intent(in) :: freedom               !! as the line has it
      real(wp), intent(in) :: value                !! of the force or the moment
      integer :: i

      if (freedom > 0 .and. freedom <= merge(scene%n_dim, last_freedom, abs(value) > 0.0_wp)) return
      if (freedom > last_freedom .or. freedom <= last_freedom - n_turn(scene%n_dim)) then
         call data_error(reader, data, "degree of freedom " // to_text(freedom) &
            // " does not exist; known: " // freedoms_text(scene%n_dim))
         return
      end if
      do i = 1, size(item)
         if (reader%doubt%rigid .or. any(scene%rigid%reference == item(i))) cycle
         call data_error(reader, data, "no moment can act on node " &
            // to_text(scene%node%label(item(i))) // ": degree" // trim(merge( &
            " of freedom 6 is that  ", "s of freedom 4 to 6 are", scene%n_dim == n_plane)) // &
            " of the reference node of a *RIGID BODY")
         return
      end do
   end subroutine check_force

end module emcon_deck_loads
