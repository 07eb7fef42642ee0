!> *TIE: surfaces that stay together.
module emcon_deck_ties
   use emcon_couplings, only : tie_t
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, data_warning, &
      get_real, next_line
   use emcon_deck_dimension, only : n_space
   use emcon_deck_faces_of_nodes, only : faces_of_nodes
   use emcon_deck_labels, only : find_label
   use emcon_deck_options, only : choose_option
   use emcon_deck_reader, only : card_error, card_t, has_option, line_origin, n_lines, need_name, &
      option_count, option_name, option_real, option_word, reader_t
   use emcon_deck_sectors, only : is_cyclic, read_sectors
   use emcon_deck_surfaces, only : get_surfaces, need_facets
   use emcon_diagnostics, only : add_warning, quoted
   use emcon_interactions, only : pair_is_reverse_of, pressure_tied
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_name_index, only : name_index_find, name_index_pair, name_index_put, name_index_t
   use emcon_scene, only : scene_t, where_text
   use emcon_sort, only : unique_sorted
   use emcon_surface_nodes, only : surface_nodes
   use emcon_text, only : to_text
   use emcon_tie_maps, only : tie_map_t, tie_map_translate
   implicit none
   private
   public :: read_ties

   !> Surfaces that a data line names first.
   integer, parameter :: n_side = 2

contains

   !> All *TIE cards: one tie for each data line.
   subroutine read_ties(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      type(tie_t), allocatable :: tie(:)
      type(tie_t) :: common
      type(name_index_t) :: card_of, tie_of
      integer :: i, n

      allocate(tie(n_lines(reader, "TIE")))
      n = 0
      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "TIE") cycle
         call read_tie_options(reader, reader%card(i), scene, common)
         call check_name(reader, i, scene, card_of)
         call read_tie_lines(reader, reader%card(i), scene, common, tie_of, tie, n)
      end do
      scene%tie = tie(:n)
      call read_sectors(reader, scene)
      call tie_pairs(reader, scene)
   end subroutine read_ties

   !> Contact pairs whose surfaces are tied are ties, without the stiffness that others give them.
   subroutine tie_pairs(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      logical :: is_tied(size(scene%pair))
      type(tie_t) :: tie
      integer :: i

      is_tied = scene%pair%interaction%pressure%kind == pressure_tied
      do i = 1, size(is_tied)
         if (.not. is_tied(i)) cycle
         associate (pair => scene%pair(i))
            if (min(pair%slave, pair%master) == 0) cycle       ! unknown, and told
            if (any(pair_is_reverse_of(scene%pair(:i - 1), pair))) cycle
            call add_warning(reader%log, pair%origin, "*CONTACT PAIR: its surfaces are tied, as " &
               // "by *TIE: exactly, without a stiffness of contact")
            tie%origin = pair%origin
            tie%name = scene%surface(pair%slave)%name
            tie%slave = pair%slave
            tie%master = pair%master
            scene%tie = [scene%tie, tie]
         end associate
      end do
      scene%pair = pack(scene%pair, .not. is_tied)
   end subroutine tie_pairs

   !> What a card says of all its ties.
   subroutine read_tie_options(reader, card, scene, tie)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(out) :: tie
      character(len=:), allocatable :: word

      call need_name(reader, card, "NAME", tie%name)
      call option_real(reader, card, "POSITION TOLERANCE", tie%tolerance)
      call choose_option(reader, card, "MULTIPLIER", "tie multiplier", tie%multiplier)
      call option_word(reader, card, "ADJUST", "YES, NO", word)
      tie%is_adjusted = word /= "NO"
      if (.not. tie%is_adjusted .and. (has_option(card, "TRANSLATION") .or. is_cyclic(card))) then
         call card_error(reader, card, "ADJUST=NO is for surfaces that meet as they are: with " // &
         "TRANSLATION and CYCLIC SYMMETRY slave nodes are moved")
      end if
      call option_word(reader, card, "TYPE", "SURFACE TO SURFACE", word, "NODE TO SURFACE", &
         "ties are integrated over faces, so that a uniform stress passes through")
      call option_word(reader, card, "CYCLIC SYMMETRY", "YES, NO", word)
      if (has_option(card, "TRANSLATION") .and. is_cyclic(card)) call card_error(reader, card, &
         "TRANSLATION and CYCLIC SYMMETRY exclude each other")
      call find_reference(reader, card, scene, tie)
   end subroutine read_tie_options

   !> The node by whose displacement a translation grows.
   subroutine find_reference(reader, card, scene, tie)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(inout) :: tie
      integer :: label

      if (.not. has_option(card, "REFNODE")) return
      if (.not. has_option(card, "TRANSLATION")) then
         call card_error(reader, card, "REF NODE needs TRANSLATION: the node moves the translation")
         return
      end if
      label = 0
      call option_count(reader, card, "REFNODE", 1, label)
      if (label == 0) return
      tie%map%reference = find_label(reader%node_map, label)
      if (tie%map%reference == 0) then
         call card_error(reader, card, "REF NODE=" // to_text(label) // ": there is no such node")
      else if (any(scene%element%node == tie%map%reference)) then
         call card_error(reader, card, "REF NODE=" // to_text(label) // " is a node of an " // &
            "element; its displacement is to be that of the translation alone: give a node of " // &
            "its own")
      end if
   end subroutine find_reference

   !> The card `i` must not have the name of an earlier one.
   subroutine check_name(reader, i, scene, card_of)
      type(reader_t), intent(inout) :: reader
      integer, intent(in) :: i
      type(scene_t), intent(in) :: scene
      type(name_index_t), intent(inout) :: card_of   !! the first card with a name
      character(len=:), allocatable :: name
      integer :: k

      name = option_name(reader%card(i), "NAME")
      if (name == "") return
      k = name_index_find(card_of, name)
      if (k == 0) then
         call name_index_put(card_of, name, i)
      else
         call card_error(reader, reader%card(i), "tie " // name // " is defined twice; first at " &
            // where_text(scene, reader%card(k)%origin))
      end if
   end subroutine check_name

   !> Data lines: slave surface, master surface. Ties that are refused have no surfaces.
   subroutine read_tie_lines(reader, card, scene, common, tie_of, tie, n)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(inout) :: scene
      type(tie_t), intent(in) :: common
      type(name_index_t), intent(inout) :: tie_of    !! ties by their surfaces, the lower one first
      type(tie_t), intent(inout) :: tie(:)
      integer, intent(inout) :: n
      type(data_t) :: data
      integer :: n_before

      n_before = n
      call data_open(data, card)
      do while (next_line(reader, data))
         n = n + 1
         tie(n) = common
         tie(n)%origin = line_origin(reader, data%i_line)
         if (has_option(card, "TRANSLATION")) call read_translation(reader, data, tie(n)%map)
         if (data%ok) call get_surfaces(reader, data, scene, tie(n)%slave, tie(n)%master)
         if (tie(n)%slave > 0 .and. tie(n)%master > 0) then
            call find_faces(reader, data, scene, tie(n))
            call check_sides(reader, data, scene, tie(n))
            if (data%ok) call check_repeated(reader, data, scene, tie(:n), tie_of)
         end if
         if (data%ok) cycle
         tie(n)%slave = 0
         tie(n)%master = 0
      end do
      if (n == n_before) call card_error(reader, card, "no surfaces are given; expected slave " &
         // "surface, master surface")
   end subroutine read_tie_lines

   !> Behind the surfaces: from where the slave is to where it is on the master.
   subroutine read_translation(reader, data, map)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(tie_map_t), intent(inout) :: map
      real(wp) :: translation(reader%n_dim)
      integer :: a

      call check_count(reader, data, n_side + reader%n_dim, n_side + reader%n_dim, "slave " // &
         "surface, master surface and the components of the translation from the one to the other")
      if (.not. data%ok) return
      translation = 0.0_wp
      do a = 1, reader%n_dim
         call get_real(reader, data, n_side + a, "component of the translation", translation(a))
      end do
      if (data%ok .and. .not. norm2(translation) > 0.0_wp) call data_error(reader, data, &
         "the translation is 0; without TRANSLATION surfaces are tied where they are")
      if (data%ok) call tie_map_translate(map, translation)
      data%n = n_side
   end subroutine read_translation

   !> A master of nodes in space is the faces that these make up, if there are any; so is a slave
   !> of nodes beside it, if its faces have all of them.
   subroutine find_faces(reader, data, scene, tie)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(in) :: data
      type(scene_t), intent(inout) :: scene
      type(tie_t), intent(inout) :: tie

      if (reader%n_dim /= n_space .or. tie%slave == tie%master) return
      if (.not. has_nodes(scene%surface(tie%master))) return
      call take_faces(reader, data, scene, .false., tie%master)
      if (has_nodes(scene%surface(tie%slave)) .and. .not. has_nodes(scene%surface(tie%master))) then
         call take_faces(reader, data, scene, .true., tie%slave)
      end if
   end subroutine find_faces

   !> The surface that the nodes of surface `i` make up in its place, if there is one.
   subroutine take_faces(reader, data, scene, needs_all, i)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(in) :: data
      type(scene_t), intent(inout) :: scene
      logical, intent(in) :: needs_all           !! every node is to be on a face
      integer, intent(inout) :: i
      type(surface_t) :: surface
      integer, allocatable :: node(:)

      surface = faces_of_nodes(scene, scene%surface(i))
      if (size(surface%element) == 0) return
      call surface_nodes(scene, surface, node)
      if (needs_all .and. size(node) < size(unique_sorted(scene%surface(i)%node))) return
      scene%surface = [scene%surface, surface]
      i = size(scene%surface)
      call data_warning(reader, data, "surface " // quoted(surface%name) // " has TYPE=NODE: " // &
         "it is taken as the " // to_text(size(surface%element)) // " free faces whose nodes " // &
         "are all in it")
   end subroutine take_faces

   !> The sides of a tie are two surfaces of element faces; in space the slave may be one of nodes.
   subroutine check_sides(reader, data, scene, tie)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      integer :: side, i
      character(len=6), parameter :: role(2) = ["slave ", "master"]

      if (tie%slave == tie%master) then
         call data_error(reader, data, "surface " // quoted(scene%surface(tie%slave)%name) &
            // " is tied to itself; a tie joins two surfaces")
         return
      end if
      do side = 1, 2
         i = merge(tie%slave, tie%master, side == 1)
         if (side == 1 .and. reader%n_dim == n_space .and. has_nodes(scene%surface(i))) then
            call data_warning(reader, data, "slave surface " // quoted(scene%surface(i)%name) // &
               " has TYPE=NODE: its nodes are tied one by one, and a uniform stress does not " // &
               "pass exactly; with element faces it would")
            cycle
         end if
         call need_facets(reader, data, scene%surface(i), trim(role(side)) // " surface", &
            ", but ties are integrated over faces; ")
      end do
   end subroutine check_sides

   !> Is a surface one of nodes?
   pure logical function has_nodes(surface)
      type(surface_t), intent(in) :: surface

      has_nodes = allocated(surface%node)
      if (has_nodes) has_nodes = size(surface%node) > 0
   end function has_nodes

   !> The last of `tie` must not be there already, in either order.
   subroutine check_repeated(reader, data, scene, tie, tie_of)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie(:)
      type(name_index_t), intent(inout) :: tie_of
      integer :: i

      associate (slave => tie(size(tie))%slave, master => tie(size(tie))%master)
         associate (name => name_index_pair(min(slave, master), max(slave, master)))
            i = name_index_find(tie_of, name)
            if (i == 0) then
               call name_index_put(tie_of, name, size(tie))
            else
               call data_error(reader, data, "surfaces " // quoted(scene%surface(slave)%name) &
                  // " and " // quoted(scene%surface(master)%name) // " are tied twice; first " &
                  // "at " // where_text(scene, tie(i)%origin))
            end if
         end associate
      end associate
   end subroutine check_repeated

end module emcon_deck_ties
