!> *MATERIAL with its cards, and *SOLID SECTION.
module emcon_deck_materials
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, data_warning, &
      get_real, is_blank, next_line
   use emcon_deck_laws, only : constant_fault, law_rows
   use emcon_deck_named, only : find_set, hint_at_set, set_names
   use emcon_deck_reader, only : card_error, card_t, card_warning, has_option, need_name, &
      option_count, option_name, reader_t, refuse_option
   use emcon_diagnostics, only : label_list, quoted, suggestion
   use emcon_kinds, only : wp
   use emcon_materials, only : law_given, law_neo_hooke, material_t
   use emcon_scene, only : scene_t, where_text
   use emcon_text, only : string_t, to_text
   implicit none
   private
   public :: read_materials, read_sections

contains

   !> All *MATERIAL cards; the cards of a material are those up to the next *MATERIAL.
   subroutine read_materials(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      integer :: i, n

      n = 0
      do i = 1, size(reader%card)
         if (reader%card(i)%name == "MATERIAL") n = n + 1
      end do
      allocate(scene%material(n))
      n = 0
      do i = 1, size(reader%card)
         associate (card => reader%card(i))
            select case (card%name)
            case ("MATERIAL")
               call start_material(reader, card, scene, n)
            case ("DENSITY", "ELASTIC", "HYPERELASTIC", "USERMATERIAL")
               if (n == 0) then
                  if (.not. reader%doubt_names) call card_error(reader, card, &
                     "there is no *MATERIAL before")
               else if (card%name == "DENSITY") then
                  call read_density(reader, card, scene%material(n))
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
      i_same = find_material(scene%material(:n), name)
      if (i_same > 0 .and. name /= "") then
         call card_error(reader, card, "material " // name // " is defined twice; first at " &
            // where_text(scene, scene%material(i_same)%origin))
      end if
      n = n + 1
      scene%material(n)%name = name
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
      real(wp) :: value(size(law_rows(1)%constant))
      integer :: i, i_row
      logical :: ok
      character(len=:), allocatable :: fault, variants

      i_row = 0
      variants = ""
      do i = 1, size(law_rows)
         if (law_rows(i)%keyword /= card%name) cycle
         ok = law_rows(i)%variant == ""
         if (.not. ok) ok = has_option(card, trim(law_rows(i)%variant))
         if (ok .and. i_row > 0) call card_error(reader, card, "more than one law is chosen")
         if (ok) i_row = i
         variants = variants // " " // trim(law_rows(i)%variant)
      end do
      ! A law is there, even if it is wrong: that none is given need not be told as well.
      material%law = law_rows(max(i_row, 1))%law
      if (i_row == 0) then
         if (size(card%option) == 0) call card_error(reader, card, "needs one of" // variants)
         return
      end if
      if (card%name == "ELASTIC") call check_isotropic(reader, card)
      associate (row => law_rows(i_row))
         call read_constants(reader, card, row%constant(:row%n_constant), value, ok)
         if (.not. ok) return
         do i = 1, row%n_constant
            call constant_fault(trim(row%constant(i)), value(i), fault)
            if (fault /= "") call card_error(reader, card, trim(row%constant(i)) // " = " &
               // to_text(value(i)) // " " // fault)
         end do
         if (row%law == law_neo_hooke) call replace_incompressible(reader, card, value)
         material%constant = value(:row%n_constant)
      end associate
   end subroutine read_law

   !> A law that a program gives: its constants, in any number of lines.
   subroutine read_given(reader, card, material)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(material_t), intent(inout) :: material
      type(data_t) :: data
      real(wp) :: value
      integer :: i, n_constant

      material%law = law_given
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

   subroutine check_isotropic(reader, card)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card

      select case (option_name(card, "TYPE"))
      case ("", "ISO", "ISOTROPIC")
         continue
      case ("ORTHO", "ANISO", "ENGINEERINGCONSTANTS", "ORTHOTROPIC", "ANISOTROPIC", "LAMINA")
         call refuse_option(reader, card, "TYPE", "ISO", "materials are isotropic")
      case default
         call refuse_option(reader, card, "TYPE", "ISO", "")
      end select
   end subroutine check_isotropic

   !> D1 = 0 means incompressible, which displacement elements cannot be. CalculiX takes
   !> D1 = 0.1/(2 C10), about nu = 0.475, and so do we.
   subroutine replace_incompressible(reader, card, value)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      real(wp), intent(inout) :: value(:)          !! C10, D1

      if (value(2) /= 0.0_wp .or. value(1) <= 0.0_wp) return
      if (value(1) < 1.0_wp/huge(1.0_wp)) return
      value(2) = 0.05_wp/value(1)
      call card_warning(reader, card, "D1 = 0 (incompressible) is replaced by 0.05/C10 = " &
         // to_text(value(2)) // ", about nu = 0.475, as CalculiX does")
   end subroutine replace_incompressible

   !> The one data line of constants; one more value, a temperature, has no effect.
   subroutine read_constants(reader, card, name, value, ok)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      character(len=*), intent(in) :: name(:)
      real(wp), intent(out) :: value(:)
      logical, intent(out) :: ok
      type(data_t) :: data
      character(len=:), allocatable :: list
      real(wp) :: temperature
      integer :: i, n

      n = size(name)
      value = 0.0_wp
      list = ""
      do i = 1, n
         list = list // trim(name(i)) // ", "
      end do
      list = list(:len(list) - 2)
      call data_open(data, card)
      ok = next_line(reader, data)
      if (.not. ok) then
         call card_error(reader, card, "the data line with " // list // " is missing")
         return
      end if
      call check_count(reader, data, 1, n + 1, list)
      do i = 1, n
         if (is_blank(data, i)) then
            ! Abaqus decks leave out a last constant that is 0.
            if (name(i) /= "D1") call data_error(reader, data, trim(name(i)) // " is missing")
         else
            call get_real(reader, data, i, trim(name(i)), value(i))
         end if
      end do
      temperature = 0.0_wp
      call get_real(reader, data, n + 1, "temperature", temperature)
      ok = data%ok
      if (ok .and. abs(temperature) > 0.0_wp) call data_warning(reader, data, &
         "the temperature has no effect")
      if (next_line(reader, data)) call data_error(reader, data, &
         "only one data line is read: constants do not depend on temperature")
   end subroutine read_constants

   !> All *SOLID SECTION cards.
   subroutine read_sections(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      integer :: i, n

      n = 0
      do i = 1, size(reader%card)
         if (reader%card(i)%name == "SOLIDSECTION") n = n + 1
      end do
      allocate(scene%section(n))
      n = 0
      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "SOLIDSECTION") cycle
         n = n + 1
         call read_section(reader, reader%card(i), scene, n)
      end do
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
         section%material = find_material(scene%material, name)
         if (section%material == 0 .and. name /= "" .and. .not. reader%doubt_names) then
            allocate(known(size(scene%material)))
            do i = 1, size(known)
               known(i)%text = scene%material(i)%name
            end do
            call card_error(reader, card, "unknown material " // quoted(name) &
               // suggestion(name, known))
         end if
         call data_open(data, card)
         if (next_line(reader, data)) then
            call get_real(reader, data, 1, "thickness", section%thickness)
            if (data%ok .and. section%thickness <= 0.0_wp) call data_error(reader, data, &
               "the thickness " // to_text(section%thickness) // " is not positive")
            call check_count(reader, data, 0, 1, "thickness")
            if (next_line(reader, data)) call data_error(reader, data, "only one data line is read")
         end if
      end associate
      i = find_set(scene%element_set, set_name)
      if (i > 0) then
         call assign_section(reader, card, scene, scene%element_set(i)%item, i_section)
      else if (set_name /= "" .and. .not. reader%doubt_names) then
         call hint_at_set(reader, "element set", set_name, set_names(scene%element_set), hint)
         call card_error(reader, card, "unknown element set " // quoted(set_name) // hint)
         reader%doubt_names = .true.
      end if
      if (i > 0 .and. find_set(reader%line_set, set_name) > 0) call card_error(reader, card, &
         "element set " // quoted(set_name) // " holds lines too, which have no stiffness; give " &
         // "the section a set without them")
   end subroutine read_section

   subroutine assign_section(reader, card, scene, item, i_section)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: item(:)
      integer, intent(in) :: i_section
      logical :: has_one(size(item))

      has_one = scene%element_section(item) > 0
      if (any(has_one)) call card_error(reader, card, "element " &
         // label_list(scene%element_label(pack(item, has_one))) // " has a section already")
      scene%element_section(item) = i_section
   end subroutine assign_section

   !> Index of the material called `name`, 0 if there is none.
   pure integer function find_material(material, name)
      type(material_t), intent(in) :: material(:)
      character(len=*), intent(in) :: name
      integer :: i

      find_material = 0
      do i = 1, size(material)
         if (material(i)%name == name) find_material = i
      end do
   end function find_material

end module emcon_deck_materials
