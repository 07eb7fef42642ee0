!> *MATERIAL with its cards, and *SOLID SECTION.
module emcon_deck_materials
   use emcon_deck_anisotropic, only : anisotropic_constants, anisotropic_names, is_anisotropic, &
      note_orientations, read_orientation, turn_constants
   use emcon_deck_damping, only : read_damping
   use emcon_deck_dimension, only : n_plane
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, data_warning, &
      get_real, is_blank, next_line
   use emcon_deck_named, only : hint_at_set, set_names
   use emcon_deck_options, only : choose_option
   use emcon_deck_reader, only : card_error, card_t, card_warning, has_option, n_cards, need_name, &
      option_count, option_name, option_word, reader_t
   use emcon_diagnostics, only : label_list, quoted, suggestion
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_t
   use emcon_law_registry, only : find_law_row, law_anisotropic, law_create, law_user, law_row, &
      law_row_t, n_constant, n_law_row
   use emcon_materials, only : kinematics_nonlinear, material_t, section_t
   use emcon_name_index, only : name_index_find, name_index_put
   use emcon_scene, only : scene_t, where_text
   use emcon_scene_motions, only : scene_is_flat
   use emcon_text, only : string_t, to_text
   implicit none
   private
   public :: read_materials, read_sections

   integer, parameter :: n_axis = 3
   integer, parameter :: per_line = 8             !! constants in a data line

contains

   !> All *MATERIAL cards; the cards of a material are those up to the next *MATERIAL.
   subroutine read_materials(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      integer :: i, n

      allocate(scene%material(n_cards(reader, "MATERIAL")))
      n = 0
      do i = 1, size(reader%card)
         associate (card => reader%card(i))
            select case (card%name)
            case ("MATERIAL")
               call start_material(reader, card, scene, n)
            case ("DENSITY", "DAMPING", "ELASTIC", "HYPERELASTIC", "USERMATERIAL")
               if (n == 0) then
                  if (.not. reader%doubt%names) call card_error(reader, card, &
                     "there is no *MATERIAL before")
               else if (card%name == "DENSITY") then
                  call read_density(reader, card, scene%material(n))
               else if (card%name == "DAMPING") then
                  call read_damping(reader, card, scene%material(n))
               else if (scene%material(n)%law /= 0) then
                  call card_error(reader, card, "material " // scene%material(n)%name &
                     // " has a law already")
               else if (card%name == "USERMATERIAL") then
                  call read_given(reader, card, scene%material(n))
               else
                  call read_law(reader, card, scene%material(n))
               end if
            end select
         end associate
      end do
      scene%material = scene%material(:n)
   end subroutine read_materials

   subroutine start_material(reader, card, scene, n)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(inout) :: scene
      integer, intent(inout) :: n
      character(len=:), allocatable :: name
      integer :: i_same

      call need_name(reader, card, "NAME", name)
      i_same = name_index_find(reader%names%materials, name)
      if (i_same > 0 .and. name /= "") then
         call card_error(reader, card, "material " // name // " is defined twice; first at " &
            // where_text(scene, scene%material(i_same)%origin))
      end if
      n = n + 1
      scene%material(n)%name = name
      call name_index_put(reader%names%materials, name, n)
      scene%material(n)%origin = card%origin
      allocate(scene%material(n)%constant(0))
   end subroutine start_material

   subroutine read_density(reader, card, material)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(material_t), intent(inout) :: material
      real(wp) :: value(1)
      logical :: ok

      call read_constants(reader, card, ["rho "], value, ok)
      if (.not. ok) return
      if (value(1) < 0.0_wp) then
         call card_error(reader, card, "the density " // to_text(value(1)) // " is negative")
      end if
      material%density = value(1)
   end subroutine read_density

   !> The law that a card and its parameters choose, with its constants.
   subroutine read_law(reader, card, material)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(material_t), intent(inout) :: material
      real(wp), allocatable :: value(:)
      type(error_t), allocatable :: error
      class(law_t), allocatable :: law
      character(len=:), allocatable :: word
      type(law_row_t) :: row
      integer :: i_row
      logical :: ok

      call choose_law(reader, card, material%law, i_row)
      if (is_anisotropic(card)) then
         call read_anisotropic(reader, card, material)
         return
      end if
      if (card%name == "ELASTIC") call option_word(reader, card, "TYPE", "ISO, ORTHO, ANISO, " // &
         "ENGINEERING CONSTANTS, ISOTROPIC, ORTHOTROPIC, ANISOTROPIC", word, "LAMINA", &
         "sheets of layers; use ENGINEERING CONSTANTS with solids")
      if (i_row == 0) return
      row = law_row(i_row)
      allocate(value(n_constant(row)))
      call read_constants(reader, card, row%constant(:size(value)), value, ok)
      if (.not. ok) return
      call law_create(row%code, value, law, error)
      if (allocated(error)) then
         call card_error(reader, card, error%message)
      else
         call replace_incompressible(reader, card, law, row%constant(:size(value)), value)
      end if
      material%constant = value
   end subroutine read_law

   !> Linear elasticity along axes of the material.
   subroutine read_anisotropic(reader, card, material)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(material_t), intent(inout) :: material
      real(wp) :: value(size(anisotropic_names(card)))
      type(error_t), allocatable :: error
      class(law_t), allocatable :: law
      logical :: ok

      material%law = law_anisotropic
      call read_constants(reader, card, anisotropic_names(card), value, ok)
      if (.not. ok) return
      if (any(anisotropic_names(card) == "E1") .and. any(value(:n_axis) <= 0.0_wp)) then
         call card_error(reader, card, "E1, E2, E3 must be positive")
         return
      end if
      material%constant = anisotropic_constants(anisotropic_names(card), value)
      call law_create(material%law, material%constant, law, error)
      if (allocated(error)) call card_error(reader, card, error%message)
   end subroutine read_anisotropic

   !> The material of a section with an ORIENTATION: a copy whose constants are along the axes of
   !> the model.
   subroutine turn_material(reader, card, scene, section)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(inout) :: scene
      type(section_t), intent(inout) :: section
      type(material_t) :: turned
      real(wp) :: axes(n_axis, n_axis)
      logical :: ok

      if (section%material == 0 .or. option_name(card, "ORIENTATION") == "") return
      if (scene%material(section%material)%law /= law_anisotropic) then
         call card_warning(reader, card, "parameter ORIENTATION has no effect (materials are " &
            // "isotropic, and directions are those of the axes of the model)")
         return
      end if
      call read_orientation(reader, card, axes, ok)
      turned = scene%material(section%material)
      if (.not. ok .or. size(turned%constant) == 0) return
      turned%constant = turn_constants(turned%constant, axes)
      scene%material = [scene%material, turned]
      section%material = size(scene%material)
   end subroutine turn_material

   !> Code and row of the law; row 0: refused. A law is there, even if it is wrong: that none is
   !> given need not be told as well.
   subroutine choose_law(reader, card, code, i_row)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      integer, intent(out) :: code, i_row
      character(len=:), allocatable :: variants
      type(law_row_t) :: row, chosen
      integer :: i, order, most
      logical :: ok

      i_row = 0
      chosen = law_row(1)
      most = 1
      variants = ""
      do i = n_law_row(), 1, -1
         row = law_row(i)
         if (row%keyword /= card%name .or. row%order > 1) cycle
         ok = row%variant == ""
         if (.not. ok) ok = has_option(card, trim(row%variant))
         if (ok .and. i_row > 0) call card_error(reader, card, "more than one law is chosen")
         if (ok) i_row = i
         if (ok) chosen = row
         variants = " " // trim(row%variant) // variants
      end do
      code = chosen%code
      if (i_row == 0) then
         if (size(card%option) == 0) call card_error(reader, card, "needs one of" // variants)
         return
      end if
      do i = 1, n_law_row()
         row = law_row(i)
         if (row%code == code) most = max(most, row%order)
      end do
      order = merge(0, 1, has_option(card, "N"))
      call option_count(reader, card, "N", 1, order, most)
      i_row = find_law_row(card%name, trim(chosen%variant), order)
   end subroutine choose_law

   !> A law that a program gives: its constants, in any number of lines.
   subroutine read_given(reader, card, material)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(material_t), intent(inout) :: material
      type(data_t) :: data
      real(wp) :: value
      integer :: i, n_constant

      material%law = law_user
      n_constant = merge(-1, 0, has_option(card, "CONSTANTS"))
      call option_count(reader, card, "CONSTANTS", 0, n_constant)
      call data_open(data, card)
      do while (next_line(reader, data))
         do i = 1, data%n
            value = 0.0_wp
            call get_real(reader, data, i, "constant", value)
            material%constant = [material%constant, value]
         end do
      end do
      if (n_constant < 0 .or. size(material%constant) == n_constant) return
      call card_error(reader, card, "CONSTANTS is " // to_text(n_constant) &
         // ", but the data lines hold " // to_text(size(material%constant)))
   end subroutine read_given

   !> D1 = 0 means incompressible, which displacement elements cannot be. CalculiX takes D1 = 0.1
   !> over the shear modulus at rest, about nu = 0.475, and so do we.
   subroutine replace_incompressible(reader, card, law, name, value)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      class(law_t), intent(in) :: law
      character(len=*), intent(in) :: name(:)      !! of the constants
      real(wp), intent(inout) :: value(:)
      integer :: i

      i = findloc(name, "D1", 1)
      if (i == 0 .or. law%shear < 1.0_wp/huge(1.0_wp)) return
      if (abs(value(i)) > 0.0_wp) return
      value(i) = 0.1_wp/law%shear
      call card_warning(reader, card, "D1 = 0 (incompressible) is replaced by 0.1/mu0 = " &
         // to_text(value(i)) // " with the shear modulus mu0, about nu = 0.475, as CalculiX does")
   end subroutine replace_incompressible

   !> The constants, eight a line; one more value, a temperature, has no effect.
   subroutine read_constants(reader, card, name, value, ok)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: name(:)
      real(wp), intent(out) :: value(:)
      logical, intent(out) :: ok
      type(data_t) :: data
      character(len=:), allocatable :: list
      real(wp) :: temperature
      integer :: first, last, n

      n = size(name)
      value = 0.0_wp
      call data_open(data, card)
      do first = 1, n, per_line
         last = min(first + per_line - 1, n)
         call name_list(name(first:last), list)
         ok = next_line(reader, data)
         if (.not. ok) then
            call card_error(reader, card, "the data line with " // list // " is missing")
            return
         end if
         call check_count(reader, data, 1, last - first + merge(2, 1, last == n), list)
         call read_line(reader, data, name(first:last), value(first:last))
         ok = data%ok
         if (.not. ok) return
      end do
      temperature = 0.0_wp
      call get_real(reader, data, last - (last - 1)/per_line*per_line + 1, "temperature", &
         temperature)
      ok = data%ok
      if (ok .and. abs(temperature) > 0.0_wp) call data_warning(reader, data, &
         "the temperature has no effect")
      if (next_line(reader, data)) call data_error(reader, data, &
         "only one data line is read: constants do not depend on temperature")
   end subroutine read_constants

   !> "A, B, C"
   pure subroutine name_list(name, list)
      character(len=*), intent(in) :: name(:)
      character(len=:), allocatable, intent(out) :: list
      integer :: i

      list = trim(name(1))
      do i = 2, size(name)
         list = list // ", " // trim(name(i))
      end do
   end subroutine name_list

   !> The constants of one line. Abaqus decks leave out last constants D that are 0.
   subroutine read_line(reader, data, name, value)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      character(len=*), intent(in) :: name(:)
      real(wp), intent(inout) :: value(:)
      integer :: i

      do i = 1, size(name)
         if (.not. is_blank(data, i)) then
            call get_real(reader, data, i, trim(name(i)), value(i))
         else if (name(i)(1:1) /= "D") then
            call data_error(reader, data, trim(name(i)) // " is missing")
         end if
      end do
   end subroutine read_line

   !> All *SOLID SECTION cards.
   subroutine read_sections(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      logical :: uses_axes
      integer :: i, n

      uses_axes = .false.
      allocate(scene%section(n_cards(reader, "SOLIDSECTION")))
      n = 0
      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "SOLIDSECTION") cycle
         n = n + 1
         call read_section(reader, reader%card(i), scene, n)
         if (scene%section(n)%material == 0) cycle
         uses_axes = uses_axes .or. (has_option(reader%card(i), "ORIENTATION") .and. &
            scene%material(scene%section(n)%material)%law == law_anisotropic)
      end do
      call note_orientations(reader, uses_axes)
   end subroutine read_sections

   subroutine read_section(reader, card, scene, i_section)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: i_section
      character(len=:), allocatable :: name, set_name, hint
      type(string_t), allocatable :: known(:)
      type(data_t) :: data
      integer :: i

      associate (section => scene%section(i_section))
         section%origin = card%origin
         call need_name(reader, card, "ELSET", set_name)
         section%set = set_name
         call need_name(reader, card, "MATERIAL", name)
         section%material = name_index_find(reader%names%materials, name)
         if (section%material == 0 .and. name /= "" .and. .not. reader%doubt%names) then
            allocate(known(size(scene%material)))
            do i = 1, size(known)
               known(i)%text = scene%material(i)%name
            end do
            call card_error(reader, card, "unknown material " // quoted(name) &
               // suggestion(name, known))
         end if
         call check_directions(reader, card, scene, section)
         call turn_material(reader, card, scene, section)
         call read_kinematics(reader, card, scene, section)
         section%is_massless = has_option(card, "MASSLESS")
         call data_open(data, card)
         if (next_line(reader, data)) then
            call get_real(reader, data, 1, "thickness", section%thickness)
            if (data%ok .and. section%thickness <= 0.0_wp) call data_error(reader, data, &
               "the thickness " // to_text(section%thickness) // " is not positive")
            call check_count(reader, data, 0, 1, "thickness")
            if (abs(section%thickness - 1.0_wp) > 0.0_wp .and. .not. scene_is_flat(scene)) then
               call data_warning(reader, data, "solids of " // trim(merge("revolution      ", &
                  "three dimensions", scene%n_dim == n_plane)) // " have no thickness: " &
                  // to_text(section%thickness) // " has no effect")
               section%thickness = 1.0_wp
            end if
            if (next_line(reader, data)) call data_error(reader, data, "only one data line is read")
         end if
      end associate
      i = name_index_find(reader%names%element_sets, set_name)
      if (i > 0) then
         call assign_section(reader, card, scene, scene%set%element(i)%item, i_section)
      else if (set_name /= "" .and. .not. reader%doubt%names) then
         call hint_at_set(reader, "element set", set_name, set_names(scene%set%element), hint)
         call card_error(reader, card, "unknown element set " // quoted(set_name) // hint)
         reader%doubt%names = .true.
      end if
      if (i > 0 .and. name_index_find(reader%names%line_sets, set_name) > 0) call card_error( &
         reader, card, &
         "element set " // quoted(set_name) // " holds lines too, which have no stiffness; give " &
         // "the section a set without them")
   end subroutine read_section

   !> Materials with directions are of three dimensions.
   subroutine check_directions(reader, card, scene, section)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(section_t), intent(in) :: section

      if (section%material == 0 .or. scene%n_dim /= n_plane) return
      associate (material => scene%material(section%material))
         if (material%law == law_anisotropic) call card_error(reader, card, "material " &
            // material%name // " has other constants along other directions (*ELASTIC, TYPE=), " &
            // "which is for elements C3D alone; use *ELASTIC with E and nu")
      end associate
   end subroutine check_directions

   !> How the elements deform. Small strains take the stiffness of a law at rest, which a law
   !> that a program gives does not tell before the deck is read.
   subroutine read_kinematics(reader, card, scene, section)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(section_t), intent(inout) :: section

      call choose_option(reader, card, "KINEMATICS", "kinematics", section%kinematics)
      if (section%kinematics == kinematics_nonlinear .or. section%material == 0) return
      associate (material => scene%material(section%material))
         if (material%law == law_user) call card_error(reader, card, "KINEMATICS=" &
            // option_name(card, "KINEMATICS") // ": material " // material%name // " is a *USER " &
            // "MATERIAL; it needs *ELASTIC or *HYPERELASTIC")
      end associate
   end subroutine read_kinematics

   subroutine assign_section(reader, card, scene, item, i_section)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: item(:)
      integer, intent(in) :: i_section
      logical :: has_one(size(item))

      has_one = scene%element%section(item) > 0
      if (any(has_one)) call card_error(reader, card, "element" &
         // trim(merge("s", " ", count(has_one) > 1)) // " " &
         // label_list(scene%element%label(pack(item, has_one))) &
         // trim(merge(" have", " has ", count(has_one) > 1)) // " a section already")
      scene%element%section(item) = i_section
   end subroutine assign_section

end module emcon_deck_materials
