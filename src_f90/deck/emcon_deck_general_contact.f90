!> *CONTACT, *CONTACT INCLUSIONS and *CONTACT PROPERTY ASSIGNMENT: all with all.
!>
!> What is included becomes pairs: a surface with itself, on one body or on many, or with another
!> one; both sides are held, unless gaps are integrated. Pairs have the properties assigned to them.
!> All exterior is one surface, of every free face, in contact with every analytical surface, too;
!> faces that ties cover go out of it when the ties are known (`emcon_ties`).
module emcon_deck_general_contact
   use emcon_deck_adjacency, only : adjacency_init, adjacency_t, n_neighbours
   use emcon_deck_contact, only : read_formulation
   use emcon_deck_dimension, only : n_space
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, get_name, is_blank, &
      next_line
   use emcon_deck_named, only : refuse_name
   use emcon_deck_reader, only : card_error, card_t, has_option, reader_t
   use emcon_deck_surfaces, only : need_facets, surface_names
   use emcon_diagnostics, only : quoted, suggestion
   use emcon_interactions, only : contact_pair_t, formulation_mortar, formulation_nts, pressure_hard
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_name_index, only : name_index_find, name_index_put
   use emcon_scene, only : scene_t, where_text
   use emcon_surface_nodes, only : surface_nodes
   implicit none
   private
   public :: read_general_contact

   character(len=*), parameter :: exterior_name = "ALL_EXTERIOR"
   !> Fields of a line: a surface, the other one.
   integer, parameter :: side_of_other = 2

contains

   !> Everything below *CONTACT.
   subroutine read_general_contact(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      integer :: i, i_contact, n

      i_contact = 0
      n = 0
      do i = 1, size(reader%card)
         associate (card => reader%card(i))
            select case (card%name)
            case ("CONTACT")
               if (i_contact == 0) i_contact = i
            case ("CONTACTINCLUSIONS", "CONTACTPROPERTYASSIGNMENT")
               if (i_contact == 0) call card_error(reader, card, "there is no *CONTACT before")
               if (card%name == "CONTACTINCLUSIONS") then
                  n = n + 1
                  call read_inclusions(reader, card, scene)
               end if
            end select
         end associate
      end do
      do i = 1, size(reader%card)
         if (reader%card(i)%name == "CONTACTPROPERTYASSIGNMENT") then
            call read_properties(reader, reader%card(i), scene)
         end if
      end do
      if (i_contact > 0 .and. n == 0) call card_error(reader, reader%card(i_contact), "nothing " &
         // "is included; say what by *CONTACT INCLUSIONS, ALL EXTERIOR or by its data lines")
   end subroutine read_general_contact

   !> ALL EXTERIOR, or one line for each surface with itself or with another one. A blank name means
   !> all exterior.
   subroutine read_inclusions(reader, card, scene)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(inout) :: scene
      type(data_t) :: data
      integer :: formulation, side, surface(2), n
      logical :: is_ok

      call read_type(reader, card, formulation)
      if (has_option(card, "ALLEXTERIOR")) call include_exterior(reader, card, formulation, scene)
      n = 0
      call data_open(data, card)
      do while (next_line(reader, data))
         n = n + 1
         if (has_option(card, "ALLEXTERIOR")) then
            call data_error(reader, data, "ALL EXTERIOR includes every surface already")
            return
         end if
         call check_count(reader, data, 0, 2, "surface, surface")
         is_ok = data%ok
         if (is_blank(data, 1) .and. is_blank(data, 2) .and. is_ok) then
            call include_exterior(reader, card, formulation, scene)
            cycle
         end if
         do side = 1, 2
            call get_surface(reader, data, scene, side, surface(side))
            if (surface(side) == 0 .and. side == 2 .and. is_blank(data, 2)) surface(2) = surface(1)
            is_ok = is_ok .and. surface(side) > 0
         end do
         if (is_ok) call include_pair(reader, data, scene, surface, formulation)
      end do
      if (n == 0 .and. .not. has_option(card, "ALLEXTERIOR")) call card_error(reader, card, &
         "no surface is given; name them, or use ALL EXTERIOR")
   end subroutine read_inclusions

   !> TYPE of a card: nodes, or integrated gaps in space.
   subroutine read_type(reader, card, formulation)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      integer, intent(out) :: formulation          !! one of `formulation_`

      call read_formulation(reader, card, formulation)
      if (any(formulation == [formulation_nts, 0])) return
      if (formulation == formulation_mortar .and. reader%n_dim == n_space) return
      if (formulation == formulation_mortar) then
         call card_error(reader, card, "here TYPE=MORTAR is for three dimensions; list " &
            // "pairs by *CONTACT PAIR")
      else
         call card_error(reader, card, "here TYPE is NODE TO SURFACE or MORTAR; list other " &
            // "pairs by *CONTACT PAIR")
      end if
   end subroutine read_type

   !> Number of the surface of faces or edges in field `side`; 0: blank or wrong.
   subroutine get_surface(reader, data, scene, side, surface)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: side
      integer, intent(out) :: surface
      character(len=:), allocatable :: name

      surface = 0
      if (side == 2 .and. is_blank(data, side)) return
      data%ok = .true.
      call get_name(reader, data, side, "surface", name)
      if (.not. data%ok) return
      surface = name_index_find(reader%names%surfaces, name)
      if (surface == 0) then
         call refuse_name(reader, data, "surface", name, surface_names(scene%surface))
      else
         call need_facets(reader, data, scene%surface(surface), "surface", &
            ", but its edges are needed too; ")
         if (.not. data%ok) surface = 0
      end if
   end subroutine get_surface

   !> Contact between two surfaces, or of one with itself; each once.
   subroutine include_pair(reader, data, scene, surface, formulation)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: surface(2), formulation
      integer :: i

      do i = 1, size(scene%pair)
         associate (pair => scene%pair(i))
            if (.not. (all([pair%slave, pair%master] == surface) .or. &
               all([pair%master, pair%slave] == surface))) cycle
            call data_error(reader, data, "contact between " // scene%surface(surface(1))%name &
               // " and " // scene%surface(surface(2))%name // " is given twice; first at " &
               // where_text(scene, pair%origin))
            return
         end associate
      end do
      call append_pairs(scene, data%card, surface, formulation)
   end subroutine include_pair

   !> Two surfaces, or one, with itself: by nodes those of both sides are held; with a shape, which
   !> has no nodes, those of the other one.
   subroutine append_pairs(scene, card, surface, formulation)
      type(scene_t), intent(inout) :: scene
      type(card_t), intent(in) :: card
      integer, intent(in) :: surface(:), formulation
      type(contact_pair_t) :: pair

      pair%origin = card%origin
      pair%slave = surface(1)
      pair%master = surface(size(surface))
      if (allocated(scene%surface(pair%slave)%wall)) then
         pair%slave = surface(size(surface))
         pair%master = surface(1)
      end if
      pair%formulation = formulation
      associate (by_nodes => formulation == formulation_nts, &
            has_shape => allocated(scene%surface(pair%master)%wall))
         pair%both_sides = by_nodes .and. .not. has_shape
         pair%may_choose = .not. (by_nodes .or. has_shape)
         pair%is_guarded = .not. by_nodes
         scene%pair = [scene%pair, pair]
         if (.not. by_nodes .or. has_shape .or. pair%slave == pair%master) return
      end associate
      pair%slave = scene%pair(size(scene%pair))%master
      pair%master = scene%pair(size(scene%pair))%slave
      pair%is_reverse = .true.
      scene%pair = [scene%pair, pair]
   end subroutine append_pairs

   !> Every free face, in contact with every other and with the analytical surfaces.
   subroutine include_exterior(reader, card, formulation, scene)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      integer, intent(in) :: formulation
      type(scene_t), intent(inout) :: scene
      type(surface_t) :: surface
      integer :: all, i

      if (reader%doubt%elements .or. reader%doubt%names) return
      if (size(scene%pair) > 0) then
         call card_error(reader, card, "ALL EXTERIOR includes every surface, but there is " &
            // "contact already at " // where_text(scene, scene%pair(1)%origin) // "; take it out")
         return
      end if
      call find_exterior(scene, surface)
      surface%name = exterior_name
      surface%origin = card%origin
      if (size(surface%element) == 0) then
         call card_error(reader, card, "there is no free face")
         return
      end if
      call add_surface(reader, card, surface, scene)
      all = size(scene%surface)
      call append_pairs(scene, card, [all], formulation)
      do i = 1, all
         if (scene%surface(i)%is_profile .or. allocated(scene%surface(i)%wall)) then
            call append_pairs(scene, card, [all, i], formulation)
         end if
      end do
   end subroutine include_exterior

   !> Add a surface that no card defines.
   subroutine add_surface(reader, card, surface, scene)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(surface_t), intent(in) :: surface
      type(scene_t), intent(inout) :: scene

      if (name_index_find(reader%names%surfaces, surface%name) > 0) call card_error(reader, card, &
         "ALL EXTERIOR defines a surface " // surface%name // "; give yours another name")
      scene%surface = [scene%surface, surface]
      call name_index_put(reader%names%surfaces, surface%name, size(scene%surface))
   end subroutine add_surface

   !> The free faces of all elements but those of rigid bodies with an analytical surface: that is
   !> what others meet.
   subroutine find_exterior(scene, surface)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(out) :: surface
      type(adjacency_t) :: adjacency
      logical, allocatable :: is_in(:, :)        ! (face, element)
      integer, allocatable :: node(:)
      integer :: body, e, f, i

      call adjacency_init(adjacency, scene)
      allocate(is_in(maxval(scene%element%kinds%n_face), size(scene%element%label)), source=.false.)
      do e = 1, size(is_in, 2)
         if (scene%element%node(1, e) == 0) cycle
         do f = 1, scene%element%kinds(scene%element%kind(e))%n_face
            is_in(f, e) = n_neighbours(scene, adjacency, e, f) == 0
         end do
      end do
      do i = 1, size(scene%surface)
         if (.not. scene%surface(i)%is_profile) cycle
         call surface_nodes(scene, scene%surface(i), node)
         if (size(node) == 0) cycle
         do body = 1, size(scene%rigid)
            if (any(scene%rigid(body)%node == node(1))) then
               is_in(:, scene%rigid(body)%element) = .false.
            end if
         end do
      end do
      associate (all => [(i, i = 0, size(is_in) - 1)], n => size(is_in, 1))
         surface%element = 1 + pack(all, reshape(is_in, [size(is_in)]))/n
         surface%face = 1 + mod(pack(all, reshape(is_in, [size(is_in)])), n)
      end associate
      allocate(surface%node(0))
      surface%is_exterior = .true.
   end subroutine find_exterior

   !> *CONTACT PROPERTY ASSIGNMENT: surface, surface, interaction; a later line counts more.
   !>
   !> Without the first name it means all surfaces, without the second the first one and itself.
   !> Pads and pressures are of pairs only: one surface in contact with itself cannot have them.
   subroutine read_properties(reader, card, scene)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(inout) :: scene
      type(data_t) :: data
      character(len=:), allocatable :: name
      integer :: i, one, other

      call data_open(data, card)
      do while (next_line(reader, data))
         call check_count(reader, data, 3, 3, "surface, surface, surface interaction")
         if (.not. data%ok) cycle
         call get_side(reader, data, scene, 1, one)
         other = one
         if (.not. is_blank(data, side_of_other)) call get_side(reader, data, scene, &
            side_of_other, other)
         call get_name(reader, data, 3, "surface interaction", name)
         if (.not. data%ok) cycle
         i = name_index_find(reader%names%interactions, name)
         if (i == 0) then
            call refuse_name(reader, data, "surface interaction", name, reader%interaction_name)
         else if (min(one, other) >= 0 .and. .not. (reader%doubt%elements .or. &
            reader%doubt%names)) then
            call assign(reader, data, scene, one, other, i)
         end if
      end do
   end subroutine read_properties

   !> A surface that a line of properties is about.
   subroutine get_side(reader, data, scene, side, surface)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: side                   !! field of the line
      integer, intent(out) :: surface               !! 0: all; below 0: unknown, and told
      character(len=:), allocatable :: name

      surface = 0
      if (is_blank(data, side)) return
      call get_name(reader, data, side, "surface", name)
      if (.not. data%ok .or. reader%doubt%names .or. name == "GLOBAL") return
      surface = name_index_find(reader%names%surfaces, name)
      if (surface > 0) return
      surface = -1
      call data_error(reader, data, "unknown surface " // quoted(name) // &
         suggestion(name, surface_names(scene%surface)))
      data%ok = .true.
   end subroutine get_side

   !> Interaction `i` for all pairs that a line is about.
   subroutine assign(reader, data, scene, one, other, i)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: one, other             !! surfaces, 0: all
      integer, intent(in) :: i
      logical, allocatable :: is_meant(:)           ! each pair

      associate (slave => scene%pair%slave, master => scene%pair%master)
         allocate(is_meant, source=(is_of(one, slave) .and. is_of(other, master)) &
            .or. (is_of(other, slave) .and. is_of(one, master)))
      end associate
      associate (given => reader%interaction(i))
         call refuse(given%pressure%kind /= pressure_hard, "a PRESSURE-OVERCLOSURE that is not " &
            // "HARD, which general contact does not have")
         call refuse(given%offset > 0.0_wp, "a PAD THICKNESS, which general contact does not have")
         call refuse(.not. any(is_meant) .and. (given%friction > 0.0_wp .or. given%restitution < &
            1.0_wp .or. given%damping%coefficient > 0.0_wp), "properties for surfaces that no " &
            // "line of *CONTACT INCLUSIONS names")
         where (is_meant)
            scene%pair%interaction = given
         end where
      end associate

   contains

      elemental logical function is_of(wanted, given)
         integer, intent(in) :: wanted, given

         is_of = wanted == 0 .or. wanted == given
      end function is_of

      subroutine refuse(has, what)
         logical, intent(in) :: has
         character(len=*), intent(in) :: what

         if (has) call data_error(reader, data, "the surface interaction " // &
            quoted(reader%interaction_name(i)%text) // " has " // what // ": list the surfaces " &
            // "that need it by *CONTACT PAIR")
      end subroutine refuse

   end subroutine assign

end module emcon_deck_general_contact
