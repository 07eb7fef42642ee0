!> *NODE and *ELEMENT.
module emcon_deck_mesh
   use emcon_deck_dimension, only : n_space, other_dimension, type_dimension
   use emcon_deck_element_kinds, only : has_user_card, is_user_type
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, data_warning, &
      drop_zeros, get_integer, get_real, is_blank, next_line
   use emcon_deck_keywords, only : gap_instead
   use emcon_deck_labels, only : find_label, label_map_init
   use emcon_deck_reader, only : card_error, card_t, card_warning, line_origin, n_cards, &
      n_lines, need_name, option_name, reader_t
   use emcon_diagnostics, only : add_error, label_list, quoted
   use emcon_element_kind, only : element_kind_t, element_row_t, find_element_kind
   use emcon_element_registry, only : element_row, n_element_row
   use emcon_kinds, only : wp
   use emcon_origin, only : origin_t
   use emcon_scene, only : scene_t, where_text
   use emcon_shape, only : max_element_nodes
   use emcon_text, only : to_text
   implicit none
   private
   public :: read_nodes, read_elements

   !> Element types of Abaqus and CalculiX that are not read.
   character(len=8), parameter :: foreign_types(*) = [character(len=8) :: &
      "CPE4RH", "CPE3H", "CPE6H", "CPE6M", "CPE8H", "CPE8RH", &
      "CAX4R", "CAX4I", "CAX4H", "CAX8H", "CAX8RH", &
      "C3D4H", "C3D6", "C3D10M", &
      "C3D15", "C3D20RH", "C3D10T", "F3D8", "S3", "S4", "S3R", "S4R", "S6", "S8", "S8R", &
      "M3D3", "M3D4", "M3D4R", "M3D6", "M3D8", "B21", "B22", "B31", "B31R", "B32", "B32R", &
      "T3D3", "R2D2", "R3D3", "R3D4", "MASS", "SPRINGA", "SPRING1", "SPRING2", &
      "SPRING", "DASHPTA", "DASHPOT", "DASHPOTA", "GAPUNI", "DCOUP3D", "CONN3D2"]

   !> Elements of one point, which hold their shape by forces that have no energy, and those that
   !> are taken in their place.
   character(len=5), parameter :: reduced_types(*) = ["CPE4R", "CPS4R", "C3D8R"], &
      taken_types(*) = ["CPE4I", "CPS4I", "C3D8I"]

   !> Elements of lines, as mesh generators write them.
   character(len=4), parameter :: line_types(*) = ["T2D2", "T3D2"]
   !> A line is no element of the scene: an edge between two nodes that surfaces may name.
   integer, parameter :: kind_line = -1

contains

   !> All *NODE cards.
   subroutine read_nodes(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      integer, allocatable :: repeated(:)
      logical :: is_solid_told
      integer :: i, n, most

      most = n_lines(reader, "NODE")
      allocate(scene%node%label(most), scene%node%origin(most), scene%x(scene%n_dim, most))
      n = 0
      is_solid_told = .false.
      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "NODE") cycle
         reader%card(i)%first_item = n + 1
         call read_node_card(reader, reader%card(i), scene, n, is_solid_told)
         reader%card(i)%last_item = n
      end do
      scene%node%label = scene%node%label(:n)
      scene%node%origin = scene%node%origin(:n)
      scene%x = scene%x(:, :n)
      call label_map_init(reader%node_map, scene%node%label, repeated)
      reader%doubt%positions = reader%doubt%positions .or. size(repeated) > 0
      do i = 1, size(repeated)
         call tell_repeated(reader, scene, "node", scene%node%label(repeated(i)), &
            scene%node%origin(repeated(i)), scene%node%origin( &
            find_label(reader%node_map, scene%node%label(repeated(i)))))
      end do
      if (n == 0 .and. .not. reader%doubt%nodes) then
         call add_error(reader%log, origin_t(1, 0), "the deck has no node")
      end if
   end subroutine read_nodes

   subroutine read_node_card(reader, card, scene, n, is_solid_told)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(inout) :: scene
      integer, intent(inout) :: n                  !! nodes so far
      logical, intent(inout) :: is_solid_told      !! a third coordinate too many, or none, was told
      character(len=12), parameter :: axis(3) = ["coordinate x", "coordinate y", "coordinate z"]
      type(data_t) :: data
      real(wp) :: position(3)
      integer :: label, k

      call data_open(data, card)
      do while (next_line(reader, data))
         call get_integer(reader, data, 1, "node label", label)
         if (.not. data%ok) then
            reader%doubt%nodes = .true.
            cycle
         end if
         call check_count(reader, data, 1, 4, "label, x, y, z")
         position = 0.0_wp
         do k = 1, size(axis)
            call get_real(reader, data, k + 1, axis(k), position(k))
         end do
         if (data%ok .and. scene%n_dim == size(axis) .and. is_blank(data, 1 + scene%n_dim) &
            .and. .not. is_solid_told) then
            call data_warning(reader, data, "node " // to_text(label) // " has no z: 0 is taken, " &
               // "as for all nodes without one (told once)")
            is_solid_told = .true.
         end if
         reader%doubt%positions = reader%doubt%positions .or. .not. data%ok
         ! A node with a bad coordinate stays, so that what names it is not an error too.
         n = n + 1
         scene%node%label(n) = label
         scene%node%origin(n) = line_origin(reader, data%i_line)
         scene%x(:, n) = position(:scene%n_dim)
         if (any(abs(position(scene%n_dim + 1:)) > 0.0_wp) .and. .not. is_solid_told) then
            call data_warning(reader, data, "z of node " // to_text(label) &
               // " is not 0; the model is plane, z is left out (told once)")
            is_solid_told = .true.
         end if
      end do
   end subroutine read_node_card

   subroutine tell_repeated(reader, scene, what, label, again, first)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      character(len=*), intent(in) :: what
      integer, intent(in) :: label
      type(origin_t), intent(in) :: again, first

      call add_error(reader%log, again, what // " " // to_text(label) &
         // " is defined twice; first at " // where_text(scene, first))
   end subroutine tell_repeated

   !> All *ELEMENT cards: elements of the scene, and lines.
   subroutine read_elements(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      type(origin_t), allocatable :: line_origin_of(:)
      integer :: i, k, n, n_line, most

      most = n_lines(reader, "ELEMENT")
      allocate(scene%element%label(most), scene%element%origin(most), scene%element%kind(most), &
         scene%element%node(max_element_nodes, most))
      allocate(reader%line_label(most), reader%line_node(2, most), line_origin_of(most))
      n = 0
      n_line = 0
      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "ELEMENT") cycle
         call read_element_card(reader, i, scene, line_origin_of, n, n_line)
      end do
      scene%element%label = scene%element%label(:n)
      scene%element%origin = scene%element%origin(:n)
      scene%element%kind = scene%element%kind(:n)
      k = 2                                        ! room for an edge
      do i = 1, n
         k = max(k, scene%element%kinds(scene%element%kind(i))%n_node)
      end do
      scene%element%node = scene%element%node(:k, :n)
      allocate(scene%element%section(n), source=0)
      reader%line_label = reader%line_label(:n_line)
      reader%line_node = reader%line_node(:, :n_line)
      call map_elements(reader, scene, line_origin_of(:n_line))
      reader%doubt%shapes = reader%doubt%shapes .or. reader%doubt%elements
      if (n == 0 .and. .not. reader%doubt%elements .and. n_cards(reader, "GIVENFORCES") == 0) then
         call add_error(reader%log, origin_t(1, 0), "the deck has no element")
      end if
   end subroutine read_elements

   !> Labels of elements and lines: none may be there twice.
   subroutine map_elements(reader, scene, line_origin_of)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(origin_t), intent(in) :: line_origin_of(:)    !! (n_line)
      integer, allocatable :: label(:), repeated(:)
      type(origin_t), allocatable :: origin(:)
      integer :: i

      allocate(label, source=[scene%element%label, reader%line_label])
      allocate(origin, source=[scene%element%origin, line_origin_of])
      call label_map_init(reader%element_map, label, repeated)
      reader%doubt%shapes = size(repeated) > 0
      do i = 1, size(repeated)
         call tell_repeated(reader, scene, "element", label(repeated(i)), origin(repeated(i)), &
            origin(find_label(reader%element_map, label(repeated(i)))))
      end do
      associate (n => size(scene%element%label), index => reader%element_map%index)
         where (index > n) index = n - index
      end associate
   end subroutine map_elements

   !> One card; the items that it defines count from 1 for elements, below 0 for lines.
   subroutine read_element_card(reader, i_card, scene, line_origin_of, n, n_line)
      type(reader_t), intent(inout) :: reader
      integer, intent(in) :: i_card
      type(scene_t), intent(inout) :: scene
      type(origin_t), intent(inout) :: line_origin_of(:)
      integer, intent(inout) :: n, n_line          !! elements and lines so far
      type(data_t) :: data
      type(card_t) :: card
      integer :: kind, n_node, label, node(max_element_nodes), before(2)

      card = reader%card(i_card)
      call find_type(reader, i_card, scene, n, kind)
      if (kind == 0) return
      n_node = 2
      if (kind > 0) n_node = scene%element%kinds(kind)%n_node
      before = [n, n_line]
      call data_open(data, card)
      do while (next_line(reader, data))
         call get_integer(reader, data, 1, "element label", label)
         if (.not. data%ok) then
            reader%doubt%elements = .true.
            cycle
         end if
         call read_connectivity(reader, data, label, n_node, node)
         if (kind == kind_line) then
            n_line = n_line + 1
            reader%line_label(n_line) = label
            reader%line_node(:, n_line) = node(:2)
            line_origin_of(n_line) = line_origin(reader, data%i_line)
         else
            n = n + 1
            scene%element%label(n) = label
            scene%element%origin(n) = line_origin(reader, data%i_line)
            scene%element%kind(n) = kind
            scene%element%node(:, n) = node
         end if
      end do
      reader%card(i_card)%first_item = merge(-n_line, before(1) + 1, kind == kind_line)
      reader%card(i_card)%last_item = merge(-before(2) - 1, n, kind == kind_line)
   end subroutine read_element_card

   !> What the type of a card stands for: an element kind, or lines; 0 if it is refused. Each type
   !> is told once.
   subroutine find_type(reader, i_card, scene, n, kind)
      type(reader_t), intent(inout) :: reader
      integer, intent(in) :: i_card
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: n                     !! elements so far
      integer, intent(out) :: kind
      character(len=:), allocatable :: type_name
      integer :: i
      logical :: is_first

      kind = 0
      associate (card => reader%card(i_card), kinds => scene%element%kinds)
         call need_name(reader, card, "TYPE", type_name)
         if (type_name /= "") kind = find_element_kind(kinds, type_name)
         if (kind > 0) return
         is_first = .true.
         do i = 1, i_card - 1
            if (reader%card(i)%name == "ELEMENT") is_first = is_first .and. &
               option_name(reader%card(i), "TYPE") /= type_name
         end do
         if (type_dimension(type_name) == other_dimension(scene%n_dim)) then
            if (is_first) call tell_mixed(reader, card, scene, n, type_name)
            reader%doubt%elements = .true.
            reader%doubt%names = .true.
            return
         end if
         i = findloc(reduced_types == type_name, .true., 1)
         if (i > 0) then
            kind = find_element_kind(kinds, taken_types(i))
            if (is_first) call card_warning(reader, card, "elements of type " // type_name &
               // " are taken as " // taken_types(i) // ", which need no artificial stiffness " &
               // "and keep the energy (told once)")
            return
         end if
         if (any(line_types == type_name) .and. scene%n_dim /= n_space) then
            kind = kind_line
            if (is_first) call card_warning(reader, card, "elements of type " // type_name &
               // " are lines that surfaces may name; they have no stiffness (told once)")
            return
         end if
         if (has_user_card(reader, type_name)) is_first = .false.
         if (type_name /= "" .and. is_first) call refuse_type(reader, card, kinds, type_name)
      end associate
      reader%doubt%elements = .true.
      reader%doubt%names = .true.
   end subroutine find_type

   !> An element of the plane in a scene of three dimensions, or one of these in the plane.
   subroutine tell_mixed(reader, card, scene, n, type_name)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: n                     !! elements so far
      character(len=*), intent(in) :: type_name
      character(len=:), allocatable :: first, own
      type(data_t) :: data
      integer :: label

      own = "elements"
      call data_open(data, card)
      if (next_line(reader, data)) then
         call get_integer(reader, data, 1, "element label", label)
         if (data%ok) own = "element " // to_text(label)
      end if
      first = "others"
      if (n > 0) first = "element " // to_text(scene%element%label(1)) // ", " &
         // trim(scene%element%kinds(scene%element%kind(1))%name) // ","
      call card_error(reader, card, "element type " // type_name // " of " // own // " beside " &
         // first // " of " // to_text(scene%n_dim) // " dimensions: a deck has elements of the " &
         // "plane or of space, not of both (told once). What Gmsh writes as faces of solids " &
         // "becomes surfaces by `emcon mesh FILE.msh OUT.inp`; or take these cards out")
   end subroutine tell_mixed

   subroutine refuse_type(reader, card, kinds, type_name)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(element_kind_t), intent(in) :: kinds(:)
      character(len=*), intent(in) :: type_name
      character(len=:), allocatable :: list, instead
      type(element_row_t) :: row
      integer :: i

      list = ""
      do i = 1, n_element_row()
         row = element_row(i)
         list = list // " " // trim(row%name)
      end do
      do i = 1, size(kinds)
         if (is_user_type(kinds(i)%name)) list = list // " " // trim(kinds(i)%name)
      end do
      if (is_user_type(type_name)) then
         call card_error(reader, card, "element type " // type_name // " is defined by no *USER " &
            // "ELEMENT")
      else if (any(foreign_types == type_name)) then
         call say_instead(type_name, instead)
         call card_error(reader, card, "element type " // type_name &
            // " is known but not supported by this version" // instead &
            // "; supported:" // list)
      else
         call card_error(reader, card, "unknown element type " // quoted(type_name) &
            // "; supported:" // list)
      end if
   end subroutine refuse_type

   !> What to do without elements that are no solids.
   pure subroutine say_instead(type_name, text)
      character(len=*), intent(in) :: type_name
      character(len=:), allocatable, intent(out) :: text   !! behind the message; empty: nothing

      text = ""
      if (scan(type_name(1:1), "SM") == 1) text = "; mesh the thickness with solid elements"
      if (type_name(1:1) == "B") text = "; mesh the cross section with solid elements"
      if (index(type_name, "SPRING") == 1) text = "; use a strip of soft solid elements"
      if (index(type_name, "DASHP") == 1) text = "; damp the material by *DAMPING"
      if (index(type_name, "GAP") == 1) text = "; " // gap_instead
      if (index(type_name, "MASS") == 1) text = "; give this mass to solid elements by *DENSITY"
      if (any(type_name == ["DCOUP3D", "CONN3D2"])) text = "; couple nodes by *EQUATION or " &
         // "*RIGID BODY"
      if (index(type_name, "R2D") + index(type_name, "R3D") > 0) text = "; use *RIGID BODY with " &
         // "solid elements"
   end subroutine say_instead

   !> The nodes of one element, 0 throughout if any is wrong. The list goes on in the next line
   !> after a comma at the end of a line.
   subroutine read_connectivity(reader, data, label, n_node, node)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: label, n_node
      integer, intent(out) :: node(max_element_nodes)
      integer :: node_label(max_element_nodes), n_read, k

      node = 0
      n_read = 0
      k = 2
      do while (n_read < n_node .and. data%ok)
         if (k > data%n) then
            if (n_read < n_node .and. data%ends_in_comma) then
               if (.not. next_line(reader, data)) exit
               k = 1
               cycle
            end if
            exit
         end if
         call get_integer(reader, data, k, "node label", node_label(n_read + 1))
         n_read = n_read + 1
         k = k + 1
      end do
      if (.not. data%ok) return
      call drop_zeros(data, k - 1)
      if (n_read < n_node) then
         call data_error(reader, data, "element " // to_text(label) // " needs " &
            // to_text(n_node) // " nodes, found " // to_text(n_read))
      else if (data%n >= k) then
         call data_error(reader, data, "element " // to_text(label) // " needs " &
            // to_text(n_node) // " nodes: " &
            // quoted(data%text(data%from(k):data%to(data%n))) // " is too much")
      end if
      if (.not. data%ok) return
      do k = 1, n_node
         node(k) = find_label(reader%node_map, node_label(k))
      end do
      call check_nodes(reader, data, label, node_label(:n_node), node(:n_node))
   end subroutine read_connectivity

   !> Refuse an element that names an unknown node, or a node twice: its nodes become 0.
   subroutine check_nodes(reader, data, element, label, node)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: element               !! its label
      integer, intent(in) :: label(:)
      integer, intent(inout) :: node(:)            !! index of each label, 0: unknown
      integer :: k

      if (any(node == 0)) then
         if (.not. reader%doubt%nodes) call data_error(reader, data, "element " &
            // to_text(element) // " names node " // label_list(pack(label, node == 0)) &
            // ", which does not exist")
         node = 0
         return
      end if
      do k = 2, size(node)
         if (all(node(:k - 1) /= node(k))) cycle
         call data_error(reader, data, "element " // to_text(element) // " names node " &
            // to_text(label(k)) // " twice; elements with collapsed sides are not computed: " &
            // "mesh with triangles or tetrahedra there")
         node = 0
         return
      end do
   end subroutine check_nodes

end module emcon_deck_mesh
