!> The deck reader: text deck in, scene out, every complaint with file and line.
!>
!> `deck_open` reads files, `deck_read` understands what they say from memory only, so that a
!> restart file can carry the deck it belongs to.
module emcon_deck
   use emcon_deck_cards, only : check_parts, read_cards
   use emcon_deck_axial_plane, only : check_axial
   use emcon_deck_centrifugal, only : check_centrifugal
   use emcon_deck_check, only : check_materials, check_nodes
   use emcon_deck_check_contact, only : check_pairs, choose_slaves
   use emcon_deck_check_linear, only : check_linear
   use emcon_deck_check_massless, only : check_massless_sections
   use emcon_deck_check_rigid, only : check_rigid
   use emcon_deck_check_surfaces, only : check_surfaces
   use emcon_deck_check_ties, only : check_ties
   use emcon_deck_clearance, only : read_clearances
   use emcon_deck_contact, only : read_interactions, read_pairs
   use emcon_deck_contact_space, only : check_contact_space
   use emcon_deck_dimension, only : check_dimension, find_dimension, is_axial_deck, n_plane, &
      refuse_plane_cards
   use emcon_deck_equations, only : read_equations
   use emcon_deck_fields, only : data_open, data_t, next_line, refuse_lines
   use emcon_deck_general_contact, only : read_general_contact
   use emcon_deck_geometry, only : check_shapes
   use emcon_deck_element_kinds, only : read_element_kinds
   use emcon_deck_user, only : read_given
   use emcon_deck_initial, only : read_initial_conditions
   use emcon_deck_keywords, only : find_keyword, keywords
   use emcon_deck_materials, only : read_materials, read_sections
   use emcon_deck_mesh, only : read_elements, read_nodes
   use emcon_deck_model_change, only : read_model_changes
   use emcon_deck_parts, only : parts_are_used, parts_flatten
   use emcon_deck_reader, only : reader_t
   use emcon_deck_rigid, only : read_rigid_bodies
   use emcon_deck_sets, only : read_sets
   use emcon_deck_source, only : deck_open, deck_source_t
   use emcon_deck_shapes_space, only : check_shapes_space
   use emcon_deck_sides_plane, only : check_sides
   use emcon_deck_step, only : read_steps
   use emcon_deck_surfaces, only : read_surfaces
   use emcon_deck_tables, only : read_amplitudes, read_time_points
   use emcon_deck_ties, only : read_ties
   use emcon_deck_transform, only : read_transforms
   use emcon_diagnostics, only : diagnostics_t, diagnostics_texts
   use emcon_edge_pairs_space, only : edge_pairs_find
   use emcon_guards, only : guards_find
   use emcon_interactions, only : contact_pair_t
   use emcon_scene, only : scene_t
   use emcon_scene_motions, only : scene_is_flat
   use emcon_text, only : string_t
   implicit none
   private
   public :: deck_source_t, deck_open, deck_read
   public :: diagnostics_t, diagnostics_texts

contains

   !> The scene that `source` describes. It is complete only if no error was added.
   !>
   !> The cards are read in passes, so that before the first step they may stand in any order:
   !> mesh, sets, surfaces, materials, tables, contact, ties, equations, then the steps one by one.
   subroutine deck_read(source, overrides, is_lenient, scene, diagnostics)
      type(deck_source_t), intent(in), target :: source
      type(string_t), intent(in) :: overrides(:)            !! NAME=VALUE for *PARAMETER
      logical, intent(in) :: is_lenient                     !! warn of unknown keywords and output
      type(scene_t), intent(out) :: scene
      type(diagnostics_t), intent(inout) :: diagnostics     !! those of `deck_open` stay
      type(reader_t) :: reader
      type(deck_source_t), target :: flat

      reader%line => source%line
      reader%file => source%file
      reader%number => source%number
      reader%log = diagnostics
      if (parts_are_used(source)) then
         call check_parts(reader)
         call parts_flatten(source, flat, scene%deck%labels, reader%log)
         reader%line => flat%line
         reader%file => flat%file
         reader%number => flat%number
      end if
      reader%log%file_name = source%file_name
      reader%is_lenient = is_lenient
      reader%doubt%names = .not. source%is_whole .or. reader%log%n_errors > diagnostics%n_errors
      reader%doubt%nodes = reader%doubt%names
      reader%doubt%elements = reader%doubt%names
      scene%deck%file = source%file_name
      scene%deck%n_own_file = source%n_own_file
      call read_cards(reader, overrides)
      scene%n_dim = find_dimension(reader)
      scene%is_axial = scene%n_dim == n_plane .and. is_axial_deck(reader)
      reader%n_dim = scene%n_dim
      reader%is_flat = scene_is_flat(scene)
      if (size(reader%card) > 0) call read_scene(reader, scene)
      if (allocated(reader%log%idle)) scene%deck%idle = reader%log%idle
      diagnostics = reader%log
   end subroutine deck_read

   subroutine read_scene(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      type(contact_pair_t), allocatable :: crossing(:)

      call check_data(reader)
      if (.not. scene_is_flat(scene)) call refuse_plane_cards(reader, scene%n_dim)
      call read_heading(reader, scene)
      call read_nodes(reader, scene)
      call read_element_kinds(reader, scene)
      call read_elements(reader, scene)
      call read_sets(reader, scene)
      call read_transforms(reader, scene)
      call read_given(reader, scene)
      call read_surfaces(reader, scene)
      call read_materials(reader, scene)
      call read_sections(reader, scene)
      call read_rigid_bodies(reader, scene)
      call read_amplitudes(reader, scene)
      call read_time_points(reader, scene)
      call read_initial_conditions(reader, scene)
      call read_interactions(reader)
      call read_pairs(reader, scene)
      call read_clearances(reader, scene)
      call read_model_changes(reader, scene)
      call read_ties(reader, scene)
      call read_general_contact(reader, scene)
      call read_equations(reader, scene)
      call read_steps(reader, scene)
      call check_geometry(reader, scene)
      call check_materials(reader, scene)
      call check_centrifugal(reader, scene)
      call check_nodes(reader, scene)
      call check_linear(reader, scene)
      call check_massless_sections(reader, scene)
      if (scene%n_dim == n_plane) then
         call check_surfaces(reader, scene)
      else
         call check_contact_space(reader, scene)
      end if
      call choose_slaves(reader, scene)
      call check_pairs(reader, scene)
      call check_ties(reader, scene)
      call check_rigid(reader, scene)
      call guards_find(scene%pair, scene%surface, scene%guard)
      if (scene%n_dim == n_plane) return
      call edge_pairs_find(scene%pair, scene%surface, crossing)
      scene%guard = [scene%guard, crossing]
   end subroutine read_scene

   !> The shapes of elements, and what of the scene is of the plane alone.
   subroutine check_geometry(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene

      if (scene%n_dim == n_plane) then
         call check_shapes(reader, scene)
         call check_sides(reader, scene)
         if (scene_is_flat(scene)) return
         call check_axial(reader, scene)
         call check_dimension(reader, scene)
      else
         call check_shapes_space(reader, scene)
         call check_dimension(reader, scene)
      end if
   end subroutine check_geometry

   !> Keywords without data lines are followed by none.
   subroutine check_data(reader)
      type(reader_t), intent(inout) :: reader
      integer :: i, k

      do i = 1, size(reader%card)
         k = find_keyword(reader%card(i)%name)
         if (k == 0) cycle
         if (.not. keywords(k)%has_data) call refuse_lines(reader, reader%card(i))
      end do
   end subroutine check_data

   !> The lines of *HEADING, with line ends between them.
   subroutine read_heading(reader, scene)
      type(reader_t), intent(in) :: reader
      type(scene_t), intent(inout) :: scene
      type(data_t) :: data
      integer :: i

      scene%deck%heading = ""
      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "HEADING") cycle
         call data_open(data, reader%card(i))
         do while (next_line(reader, data))
            if (scene%deck%heading /= "") scene%deck%heading = scene%deck%heading // new_line("a")
            scene%deck%heading = scene%deck%heading // trim(data%text)
         end do
      end do
   end subroutine read_heading

end module emcon_deck
