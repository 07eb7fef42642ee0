!> *SURFACE, and the faces that elements share.
module emcon_deck_surfaces
   use emcon_deck_adjacency, only : adjacency_init, adjacency_t, find_face, n_neighbours
   use emcon_deck_element_kinds, only : face_names, face_number
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, data_warning, &
      get_integer, get_name, is_blank, next_line
   use emcon_deck_labels, only : find_label
   use emcon_deck_named, only : get_elements, get_lines, get_nodes, refuse_name
   use emcon_deck_options, only : choose_option
   use emcon_deck_reader, only : card_error, card_t, card_warning, has_option, n_cards, need_name, &
      option_name, reader_t, refuse_option
   use emcon_deck_segments_plane, only : read_segments
   use emcon_deck_stl_space, only : read_stl
   use emcon_deck_walls_space, only : read_wall
   use emcon_diagnostics, only : label_list, quoted
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_of_extrusion, surface_of_faces, surface_of_lines, &
      surface_of_nodes, surface_of_plane, surface_of_revolution, surface_of_segments, &
      surface_of_sphere, surface_of_triangles, surface_t
   use emcon_name_index, only : name_index_find, name_index_put
   use emcon_options, only : option_default, option_words
   use emcon_scene, only : scene_t, where_text
   use emcon_text, only : string_t, to_text
   implicit none
   private
   public :: read_surfaces, get_surfaces, need_facets, surface_names

   !> Faces of a surface while it grows.
   type :: faces_t
      integer :: n = 0
      integer, allocatable :: element(:), face(:)
   end type faces_t

contains

   !> All *SURFACE cards.
   subroutine read_surfaces(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      type(adjacency_t) :: adjacency
      type(surface_t) :: surface
      integer :: i, n, i_same
      character(len=:), allocatable :: name

      n = n_cards(reader, "SURFACE")
      allocate(scene%surface(n))
      if (n == 0) return
      call adjacency_init(adjacency, scene)
      n = 0
      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "SURFACE") cycle
         call need_name(reader, reader%card(i), "NAME", name)
         if (name == "") cycle
         i_same = name_index_find(reader%names%surfaces, name)
         if (i_same > 0) then
            call card_error(reader, reader%card(i), "surface " // name &
               // " is defined twice; first at " // where_text(scene, scene%surface(i_same)%origin))
            cycle
         end if
         call read_surface(reader, reader%card(i), scene, adjacency, surface)
         surface%name = name
         surface%origin = reader%card(i)%origin
         n = n + 1
         scene%surface(n) = surface
         call name_index_put(reader%names%surfaces, name, n)
      end do
      scene%surface = scene%surface(:n)
   end subroutine read_surfaces

   subroutine read_surface(reader, card, scene, adjacency, surface)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(inout) :: scene
      type(adjacency_t), intent(in) :: adjacency
      type(surface_t), intent(out) :: surface
      character(len=:), allocatable :: known
      logical :: is_refused
      integer :: n_before, n_item, kind

      n_before = reader%log%n_errors
      allocate(surface%element(0), surface%face(0), surface%node(0))
      if (any(["CUTTINGSURFACE", "USER          "] == option_name(card, "TYPE"))) then
         call option_words("surface", known)
         call refuse_option(reader, card, "TYPE", known, "it is not in this version")
         return
      end if
      kind = option_default("surface")
      call choose_option(reader, card, "TYPE", "surface", kind, is_refused)
      if (is_refused) return
      if (has_option(card, "INPUT")) call card_error(reader, card, "INPUT= is of TYPE=STL; " // &
         "use *INCLUDE")
      if (has_option(card, "SCALE") .and. kind /= surface_of_triangles) call card_error(reader, &
         card, "SCALE= is of TYPE=STL")
      if (has_option(card, "FILLETRADIUS") .and. all(kind /= [surface_of_segments, &
         surface_of_revolution, surface_of_extrusion])) call card_error(reader, card, &
         "FILLET RADIUS= is of TYPE=SEGMENTS, REVOLUTION and CYLINDER")
      select case (kind)
      case (surface_of_faces)
         call read_faces(reader, card, scene, adjacency, surface)
      case (surface_of_nodes)
         surface%is_nodal = .true.
         call read_nodes(reader, card, scene, surface)
      case (surface_of_lines)
         call read_edges(reader, card, scene, surface)
      case (surface_of_segments)
         call read_segments(reader, card, scene, surface)
      case (surface_of_plane, surface_of_sphere, surface_of_revolution, surface_of_extrusion)
         call read_wall(reader, card, kind, scene, surface)
      case (surface_of_triangles)
         call read_stl(reader, card, scene, surface)
      end select
      n_item = size(surface%element) + size(surface%node)
      if (allocated(surface%edge)) n_item = size(surface%edge, 2)
      if (n_item == 0 .and. reader%log%n_errors == n_before .and. .not. reader%doubt%names &
         .and. .not. reader%doubt%elements) then
         select case (kind)
         case (surface_of_faces)
            call card_error(reader, card, "the surface has no face")
         case (surface_of_nodes)
            call card_error(reader, card, "the surface has no node")
         case default
            call card_error(reader, card, "the surface has no edge")
         end select
      end if
   end subroutine read_surface

   !> Edges between nodes: their first and last node, the body to the left; or lines.
   subroutine read_edges(reader, card, scene, surface)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(inout) :: surface
      type(data_t) :: data
      integer, allocatable :: edge(:, :), new(:, :)
      integer :: n

      allocate(edge(2, 16))
      n = 0
      call data_open(data, card)
      do while (next_line(reader, data))
         call check_count(reader, data, 1, 2, "first node, last node")
         if (data%ok) call get_edges(reader, data, scene, new)
         if (.not. data%ok) cycle
         if (n + size(new, 2) > size(edge, 2)) then
            edge = reshape([edge(:, :n), new], [2, 2*(n + size(new, 2))], pad=[0])
         else
            edge(:, n + 1:n + size(new, 2)) = new
         end if
         n = n + size(new, 2)
      end do
      surface%edge = edge(:, :n)
   end subroutine read_edges

   !> The edges of a data line: from node to node, or those of a line or of a set of lines.
   subroutine get_edges(reader, data, scene, edge)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: edge(:, :)
      integer, allocatable :: line(:)
      integer :: label(2), node(2), k

      if (is_blank(data, 2)) then
         call get_lines(reader, data, 1, line)
         if (data%ok .and. size(line) == 0) call data_error(reader, data, &
            "expected first node, last node, or a line or set of lines (T3D2), not " &
            // quoted(data%text(data%from(1):data%to(1))))
         edge = reader%line_node(:, line)
         data%ok = data%ok .and. all(edge > 0)
         return
      end if
      do k = 1, 2
         call get_integer(reader, data, k, "node label", label(k))
         if (.not. data%ok) return
         node(k) = find_label(reader%node_map, label(k))
         if (node(k) > 0) cycle
         if (.not. reader%doubt%nodes) call data_error(reader, data, "node " &
            // to_text(label(k)) // " does not exist")
         data%ok = .false.
         return
      end do
      edge = reshape(node, [2, 1])
      if (all(abs(scene%x(:, node(1)) - scene%x(:, node(2))) <= 0.0_wp) .and. &
         .not. reader%doubt%positions) call data_error(reader, data, "the edge from node " &
         // to_text(label(1)) // " to node " // to_text(label(2)) // " has no length")
   end subroutine get_edges

   !> Nodes of a surface in the order of the deck, each once.
   subroutine read_nodes(reader, card, scene, surface)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(inout) :: surface
      type(data_t) :: data
      integer, allocatable :: item(:), list(:)
      logical, allocatable :: is_in(:)
      logical :: is_area_told
      integer :: i, n

      is_area_told = .false.
      allocate(is_in(size(scene%node%label)), source=.false.)
      allocate(list(size(scene%node%label)))
      n = 0
      call data_open(data, card)
      do while (next_line(reader, data))
         call check_count(reader, data, 1, 2, "node or node set, area")
         if (data%n > 1 .and. .not. is_area_told) call data_warning(reader, data, "the " &
            // "second value, " // data%text(data%from(data%n):data%to(data%n)) // ", is an area " &
            // "and has no effect: a line has one node or set (told once)")
         is_area_told = is_area_told .or. data%n > 1
         if (data%ok) call get_nodes(reader, data, 1, scene, item)
         if (.not. data%ok) cycle
         do i = 1, size(item)
            if (is_in(item(i))) cycle
            is_in(item(i)) = .true.
            n = n + 1
            list(n) = item(i)
         end do
      end do
      surface%node = list(:n)
   end subroutine read_nodes

   subroutine read_faces(reader, card, scene, adjacency, surface)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(adjacency_t), intent(in) :: adjacency
      type(surface_t), intent(inout) :: surface
      type(data_t) :: data
      type(faces_t) :: faces
      integer, allocatable :: item(:), line(:)
      integer :: i, face, n_repeated

      allocate(faces%element(16), faces%face(16))
      call data_open(data, card)
      do while (next_line(reader, data))
         call check_count(reader, data, 1, 2, "element or element set, face")
         if (.not. data%ok) cycle
         call get_lines(reader, data, 1, line)
         if (size(line) > 0) then
            call append_edges_of(reader, data, scene, adjacency, line, faces)
            cycle
         end if
         if (data%ok) call get_elements(reader, data, 1, scene, item)
         if (.not. data%ok) cycle
         if (is_blank(data, 2)) then
            do i = 1, size(item)
               call append_free_faces(scene, adjacency, item(i), faces)
            end do
         else
            call get_face(reader, data, scene, item, face)
            if (.not. data%ok) cycle
            do i = 1, size(item)
               call append_face(faces, item(i), face)
            end do
         end if
      end do
      call drop_repeated(faces, n_repeated)
      if (n_repeated > 0) call card_warning(reader, card, to_text(n_repeated) &
         // " faces are named more than once; each is taken once")
      surface%element = faces%element(:faces%n)
      surface%face = faces%face(:faces%n)
   end subroutine read_faces

   !> The faces that lie on lines: each line is the edge of one element, which is to its left or
   !> right.
   subroutine append_edges_of(reader, data, scene, adjacency, line, faces)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      type(adjacency_t), intent(in) :: adjacency
      integer, intent(in) :: line(:)
      type(faces_t), intent(inout) :: faces
      integer :: n_element(size(line))             !! at each line; 1 where it had errors
      integer :: i, element, face

      if (.not. is_blank(data, 2)) then
         call data_error(reader, data, "a line has no faces; leave out " &
            // quoted(data%text(data%from(2):data%to(2))))
         return
      end if
      n_element = 1
      do i = 1, size(line)
         if (any(reader%line_node(:, line(i)) == 0)) cycle
         call find_face(scene, adjacency, reader%line_node(:, line(i)), n_element(i), element, face)
         if (n_element(i) == 1) call append_face(faces, element, face)
      end do
      if (reader%doubt%elements) return
      if (any(n_element == 0)) call data_error(reader, data, "line " &
         // label_list(pack(reader%line_label(line), n_element == 0)) &
         // " is no edge of an element")
      if (any(n_element > 1)) call data_error(reader, data, "line " &
         // label_list(pack(reader%line_label(line), n_element > 1)) &
         // " lies inside the body, between elements")
   end subroutine append_edges_of

   !> Read a face `S1`, `S2`, ... that all elements of `item` must have.
   subroutine get_face(reader, data, scene, item, face)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: item(:)
      integer, intent(out) :: face
      character(len=:), allocatable :: name
      logical :: has_not(size(item))

      call get_name(reader, data, 2, "face", name)
      face = face_number(name, "S", maxval(scene%element%kinds%n_face))
      if (face == 0) then
         call data_error(reader, data, "unknown face " // quoted(name) // "; known: " &
            // face_names("S", maxval(scene%element%kinds%n_face)))
         return
      end if
      has_not = scene%element%kinds(scene%element%kind(item))%n_face < face
      if (any(has_not)) call data_error(reader, data, "element " &
         // label_list(pack(scene%element%label(item), has_not)) // " has no face " // name)
   end subroutine get_face

   pure subroutine append_free_faces(scene, adjacency, element, faces)
      type(scene_t), intent(in) :: scene
      type(adjacency_t), intent(in) :: adjacency
      integer, intent(in) :: element
      type(faces_t), intent(inout) :: faces
      integer :: face

      if (scene%element%node(1, element) == 0) return
      do face = 1, scene%element%kinds(scene%element%kind(element))%n_face
         if (n_neighbours(scene, adjacency, element, face) == 0) then
            call append_face(faces, element, face)
         end if
      end do
   end subroutine append_free_faces

   pure subroutine append_face(faces, element, face)
      type(faces_t), intent(inout) :: faces
      integer, intent(in) :: element, face
      integer :: n

      n = faces%n
      if (n == size(faces%face)) then
         faces%element = [faces%element, faces%element]
         faces%face = [faces%face, faces%face]
      end if
      faces%n = n + 1
      faces%element(n + 1) = element
      faces%face(n + 1) = face
   end subroutine append_face

   !> Keep the first of equal faces.
   pure subroutine drop_repeated(faces, n_repeated)
      type(faces_t), intent(inout) :: faces
      integer, intent(out) :: n_repeated
      logical, allocatable :: is_in(:, :)
      integer :: i, n

      associate (face => faces%face(:faces%n), element => faces%element(:faces%n))
         allocate(is_in(maxval([0, face]), maxval([0, element])), source=.false.)
      end associate
      n = 0
      do i = 1, faces%n
         if (is_in(faces%face(i), faces%element(i))) cycle
         is_in(faces%face(i), faces%element(i)) = .true.
         n = n + 1
         faces%element(n) = faces%element(i)
         faces%face(n) = faces%face(i)
      end do
      n_repeated = faces%n - n
      faces%n = n
   end subroutine drop_repeated

   !> Data line: slave surface, master surface. One that is unknown becomes 0.
   subroutine get_surfaces(reader, data, scene, slave, master)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      integer, intent(out) :: slave, master        !! indices
      integer :: side, i_surface(2)
      character(len=:), allocatable :: name
      character(len=6), parameter :: role(2) = ["slave ", "master"]

      slave = 0
      master = 0
      call check_count(reader, data, 2, 2, "slave surface, master surface")
      if (.not. data%ok) return
      i_surface = 0
      do side = 1, 2
         data%ok = .true.
         call get_name(reader, data, side, trim(role(side)) // " surface", name)
         if (.not. data%ok) cycle
         i_surface(side) = name_index_find(reader%names%surfaces, name)
         if (i_surface(side) == 0) call refuse_name(reader, data, trim(role(side)) // &
            " surface", name, surface_names(scene%surface))
      end do
      slave = i_surface(1)
      master = i_surface(2)
      data%ok = slave > 0 .and. master > 0
   end subroutine get_surfaces

   !> Refuse a surface of nodes where edges are needed: `data%ok` is then false.
   subroutine need_facets(reader, data, surface, title, why)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(surface_t), intent(in) :: surface
      character(len=*), intent(in) :: title        !! of the surface, in the message
      character(len=*), intent(in) :: why          !! follows on "has TYPE=NODE"

      if (surface%is_nodal) call data_error(reader, data, "the " // title // " " // &
         quoted(surface%name) // " has TYPE=NODE" // why // "define it by element faces " // &
         "(*SURFACE, TYPE=ELEMENT)")
   end subroutine need_facets

   pure function surface_names(surface) result(list)
      type(surface_t), intent(in) :: surface(:)
      type(string_t) :: list(size(surface))
      integer :: i

      do i = 1, size(surface)
         list(i)%text = surface(i)%name
      end do
   end function surface_names

end module emcon_deck_surfaces
