!> *SURFACE INTERACTION with the cards of it, and *CONTACT PAIR.
module emcon_deck_contact
   use emcon_deck_contact_damping, only : read_contact_damping
   use emcon_deck_contact_settings, only : read_pair_initiation
   use emcon_deck_change_friction, only : read_friction_changes
   use emcon_deck_crossings, only : read_crossings
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, get_real, &
      next_line
   use emcon_deck_friction, only : read_friction
   use emcon_deck_named, only : set_names
   use emcon_deck_options, only : check_option
   use emcon_deck_pressure, only : read_behavior
   use emcon_deck_reader, only : card_error, card_t, has_option, line_origin, n_lines, need_name, &
      note_idle, option_name, option_number, option_word, reader_t, refuse_option, &
      card_warning
   use emcon_deck_surfaces, only : get_surfaces, need_facets
   use emcon_diagnostics, only : add_error, quoted, suggestion
   use emcon_interactions, only : adjustment_t, contact_damping_t, contact_pair_t, &
      formulation_user, formulation_mortar, formulation_nts, formulation_segment, pressure_hard, &
      pressure_slope, pressure_t, pressure_tied
   use emcon_kinds, only : wp
   use emcon_name_index, only : name_index_find, name_index_pair, name_index_put, name_index_t
   use emcon_options, only : option_code, option_default, option_words
   use emcon_origin, only : origin_t
   use emcon_scene, only : scene_t, where_text
   use emcon_text, only : read_real, to_text
   implicit none
   private
   public :: read_interactions, read_pairs, read_formulation

contains

   !> The surface interactions: names, pads, restitution, friction, damping and pressures.
   subroutine read_interactions(reader)
      type(reader_t), intent(inout) :: reader
      character(len=:), allocatable :: name
      integer :: i, n
      integer :: friction(size(reader%card)), behavior(size(reader%card))   ! of each interaction

      allocate(reader%interaction(size(reader%card)), reader%interaction_name(size(reader%card)))
      n = 0
      friction = 0
      behavior = 0
      do i = 1, size(reader%card)
         associate (card => reader%card(i))
            select case (card%name)
            case ("SURFACEINTERACTION")
               call need_name(reader, card, "NAME", name)
               n = n + 1
               reader%interaction_name(n)%text = name
               if (name /= "") call name_index_put(reader%names%interactions, name, n)
               call option_number(reader, card, "PAD THICKNESS", "a length from 0 to 1e30: it " &
                  // "keeps surfaces apart; overlap at the start is resolved by *CONTACT " // &
                  "INTERFERENCE", 0.0_wp, 1.0e30_wp, reader%interaction(n)%offset)
               call option_number(reader, card, "RESTITUTION", "a number from 0 to 1: the " &
                  // "velocity of separation over that of approach", 0.0_wp, 1.0_wp, &
                  reader%interaction(n)%restitution)
               call read_thickness(reader, card)
            case ("SURFACEBEHAVIOR", "FRICTION", "CONTACTDAMPING")
               if (card%step > 0) cycle             ! a change of friction
               if (n == 0 .and. .not. reader%doubt%names) call card_error(reader, card, &
                  "there is no *SURFACE INTERACTION before")
               if (card%name == "CONTACTDAMPING") then
                  call read_contact_damping(reader, card, reader%interaction(max(1, n))%damping)
                  if (n == 0) reader%interaction(1)%damping = contact_damping_t()
               else if (card%name == "FRICTION") then
                  if (friction(max(1, n)) > 0) call card_error(reader, card, &
                     "the surface interaction has *FRICTION already")
                  if (n > 0) friction(n) = i
                  call read_friction(reader, card, reader%interaction(max(1, n))%friction, &
                     reader%interaction(max(1, n))%stick)
                  call option_number(reader, card, "RESTITUTION", "a number from 0 to 1: the " // &
                     "fraction of its tangential velocity with which a sticking node rebounds", &
                     0.0_wp, 1.0_wp, reader%interaction(max(1, n))%rebound)
               else
                  if (behavior(max(1, n)) > 0) call card_error(reader, card, &
                     "the surface interaction has *SURFACE BEHAVIOR already")
                  if (n > 0) behavior(n) = i
                  call read_behavior(reader, card, reader%interaction(max(1, n))%pressure)
                  if (n == 0) reader%interaction(1)%pressure = pressure_t()
               end if
            end select
         end associate
      end do
      reader%interaction = reader%interaction(:n)
      reader%interaction_name = reader%interaction_name(:n)
      call suit_sticks(reader, friction(:n))
      call read_friction_changes(reader)
   end subroutine read_interactions

   !> Friction without a slope of stick on a pressure gets half of its slope, as CalculiX has it.
   subroutine suit_sticks(reader, friction)
      type(reader_t), intent(inout) :: reader
      integer, intent(in) :: friction(:)           !! the card of each interaction; 0: none
      integer :: i

      do i = 1, size(friction)
         if (friction(i) == 0) cycle
         associate (surface => reader%interaction(i), card => reader%card(friction(i)))
            if (any(surface%pressure%kind == [pressure_hard, pressure_tied]) .or. &
               surface%stick > 0.0_wp .or. .not. surface%friction > 0.0_wp) cycle
            surface%stick = 0.5_wp*pressure_slope(surface%pressure)
            call card_warning(reader, card, "no stick slope above 0 is given: half of the " &
               // "slope of the pressure is taken, " // to_text(surface%stick))
         end associate
      end do
   end subroutine suit_sticks

   !> The thickness of an interaction of the plane, which sections have here.
   subroutine read_thickness(reader, card)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(data_t) :: data
      real(wp) :: thickness

      thickness = 1.0_wp
      call data_open(data, card)
      if (.not. next_line(reader, data)) return
      call get_real(reader, data, 1, "thickness", thickness)
      if (data%ok .and. thickness <= 0.0_wp) call data_error(reader, data, "the thickness " &
         // to_text(thickness) // " is not positive")
      call check_count(reader, data, 0, 1, "thickness")
      if (data%n == 1) call note_idle(reader, "thickness of *SURFACE INTERACTION", &
         "that of the sections counts")
      if (next_line(reader, data)) call data_error(reader, data, "is the second data line")
   end subroutine read_thickness

   !> All *CONTACT PAIR cards.
   subroutine read_pairs(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      type(contact_pair_t), allocatable :: pair(:)
      type(origin_t), allocatable :: line(:)       !! of each pair
      type(data_t) :: data
      type(contact_pair_t) :: of_card
      type(name_index_t) :: given                  !! pairs so far, by slave and master
      integer :: i, n, n_before, most

      most = n_lines(reader, "CONTACTPAIR")
      allocate(pair(most), line(most))
      n = 0
      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "CONTACTPAIR") cycle
         n_before = n
         of_card = contact_pair_t(origin=reader%card(i)%origin)
         call read_formulation(reader, reader%card(i), of_card%formulation)
         call read_sides(reader, reader%card(i), of_card)
         call data_open(data, reader%card(i))
         do while (next_line(reader, data))
            n = n + 1
            line(n) = line_origin(reader, data%i_line)
            pair(n) = of_card
            call get_surfaces(reader, data, scene, pair(n)%slave, pair(n)%master)
            call set_sides(scene, pair(n))
            call check_nodal(reader, data, scene, pair(n))
            call check_repeated(reader, data, scene, pair(:n), line, given)
         end do
         call read_pair_options(reader, reader%card(i), scene, pair(n_before + 1:n))
      end do
      call add_reverses(reader, pair(:n), line(:n), given, scene)
   end subroutine read_pairs

   !> TYPE of a card; 0 if it is refused.
   subroutine read_formulation(reader, card, formulation)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      integer, intent(out) :: formulation
      character(len=:), allocatable :: known

      formulation = option_default("formulation")
      if (option_name(card, "TYPE") == "") return
      formulation = option_code("formulation", option_name(card, "TYPE"))
      if (formulation > 0) then
         call check_option(reader, card, "TYPE", "formulation", formulation)
         return
      end if
      call option_words("formulation", known)
      if (option_name(card, "TYPE") == "MASSLESS") then
         call refuse_option(reader, card, "TYPE", known, &
            "slave nodes without mass are asked for by *CONTACT INITIATION, TYPE=MASSLESS")
      else
         call refuse_option(reader, card, "TYPE", known // ", SURFACE TO SURFACE", "")
      end if
   end subroutine read_formulation

   !> SIDES of a card: are the nodes of both surfaces held, of the first, or is it left to the
   !> program? Integrated gaps of both would hold the same covered lengths twice.
   subroutine read_sides(reader, card, of_card)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(contact_pair_t), intent(inout) :: of_card
      character(len=:), allocatable :: word

      of_card%is_asked = has_option(card, "SIDES")
      call option_word(reader, card, "SIDES", "AUTO, ONE, BOTH", word)
      if (word == "AUTO") then
         of_card%may_choose = of_card%formulation /= formulation_user
      else if (word == "BOTH") then
         of_card%both_sides = of_card%formulation == formulation_nts
         if (any(of_card%formulation == [formulation_segment, formulation_mortar])) then
            call refuse_option(reader, card, "SIDES", "AUTO, ONE", "SEGMENT and MORTAR integrate " &
               // "the gap on one of the surfaces; use TYPE=NODE TO SURFACE")
         else if (of_card%formulation == formulation_user) then
            call refuse_option(reader, card, "SIDES", "AUTO, ONE", "the program that gives " // &
               "TYPE=USER decides what it constrains")
         end if
      end if
   end subroutine read_sides

   !> Where the program may choose: both sides node to surface, if the slave has edges and the
   !> master is no shape without nodes; one of them if gaps are integrated. ADJUST speaks of the
   !> slave, and so names it.
   pure subroutine set_sides(scene, pair)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(inout) :: pair

      if (.not. pair%may_choose .or. min(pair%slave, pair%master) == 0) return
      if (allocated(scene%surface(pair%master)%wall)) then
         pair%may_choose = .false.
         return
      end if
      if (pair%formulation == formulation_nts) then
         pair%both_sides = .not. scene%surface(pair%slave)%is_nodal
      end if
   end subroutine set_sides

   !> All pairs of the scene: behind each that holds both sides its reverse, unless lines of the
   !> deck say both. Then what they say together counts.
   subroutine add_reverses(reader, pair, line, given, scene)
      type(reader_t), intent(inout) :: reader
      type(contact_pair_t), intent(in) :: pair(:)
      type(origin_t), intent(in) :: line(:)
      type(name_index_t), intent(in) :: given      !! where in `pair` slave and master are
      type(scene_t), intent(inout) :: scene
      type(contact_pair_t), allocatable :: all(:)
      integer :: i, j, n

      allocate(all(2*size(pair)))
      n = 0
      do i = 1, size(pair)
         n = n + 1
         all(n) = pair(i)
         if (.not. pair(i)%both_sides .or. pair(i)%slave == pair(i)%master) cycle
         if (min(pair(i)%slave, pair(i)%master) == 0) cycle       ! unknown, and told
         j = name_index_find(given, name_index_pair(pair(i)%master, pair(i)%slave))
         if (j == 0) then
            n = n + 1
            all(n) = reversed(pair(i))
         else if (pair(i)%may_choose) then
            all(n)%both_sides = pair(j)%both_sides
         else
            call add_error(reader%log, line(j), "*CONTACT PAIR: the pair of slave surface " // &
               quoted(scene%surface(pair(j)%slave)%name) // " and master surface " // &
               quoted(scene%surface(pair(j)%master)%name) // " is given twice; SIDES=BOTH holds " &
               // "it at " // where_text(scene, line(i)))
         end if
      end do
      scene%pair = all(:n)
      scene%pair%is_guarded = scene%pair%is_guarded .and. .not. scene%pair%both_sides
   end subroutine add_reverses

   !> The other half of a pair with both sides.
   pure function reversed(pair) result(other)
      type(contact_pair_t), intent(in) :: pair
      type(contact_pair_t) :: other

      other = pair
      other%slave = pair%master
      other%master = pair%slave
      other%is_reverse = .true.
      if (.not. pair%may_choose) return
      other%adjust = adjustment_t()                  ! it speaks of the slave
   end function reversed

   !> A surface of nodes has no edges: it may only be the slave of another one, node to surface.
   !> A master that is refused becomes 0.
   subroutine check_nodal(reader, data, scene, pair)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(inout) :: pair

      if (pair%slave == 0 .or. pair%master == 0) return
      associate (slave => scene%surface(pair%slave), master => scene%surface(pair%master))
         if (pair%slave == pair%master) then
            call need_facets(reader, data, slave, "surface", &
               " and cannot be in contact with itself; ")
         else
            if (any(pair%formulation == [formulation_segment, formulation_mortar])) call &
               need_facets(reader, data, slave, "slave surface", ", but SEGMENT and MORTAR " // &
               "integrate over edges; use TYPE=NODE TO SURFACE, or ")
            if (pair%both_sides) call need_facets(reader, data, slave, "slave surface", &
               ", but under SIDES=BOTH its edges are needed too; ")
            call need_facets(reader, data, master, "master surface", &
               "; only the slave surface may, and only under NODE TO SURFACE; ")
            if (allocated(slave%wall)) call data_error(reader, data, "surface " // slave%name // &
               " is a wall, which has no nodes that could be slaves; " // trim(merge( &
               "one of the two must have nodes", "swap the two                  ", &
               allocated(master%wall))))
            if (allocated(master%wall) .and. pair%both_sides) call data_error(reader, data, &
               "surface " // master%name // " is a wall without nodes; leave out SIDES=BOTH")
         end if
      end associate
      if (.not. data%ok) pair%master = 0
   end subroutine check_nodal

   !> The last of `pair` must not be there already. Slave and master in turn is another pair.
   subroutine check_repeated(reader, data, scene, pair, line, given)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(inout) :: pair(:)
      type(origin_t), intent(in) :: line(:)
      type(name_index_t), intent(inout) :: given   !! where in `pair` slave and master are
      integer :: i, n

      n = size(pair)
      if (pair(n)%slave == 0 .or. pair(n)%master == 0) return
      i = name_index_find(given, name_index_pair(pair(n)%slave, pair(n)%master))
      if (i == 0) then
         call name_index_put(given, name_index_pair(pair(n)%slave, pair(n)%master), n)
         return
      end if
      call data_error(reader, data, "the pair of slave surface " &
         // quoted(scene%surface(pair(n)%slave)%name) // " and master surface " &
         // quoted(scene%surface(pair(n)%master)%name) // " is given twice; first at " &
         // where_text(scene, line(i)))
      pair(n)%master = 0
   end subroutine check_repeated

   !> What a card says of all its pairs.
   subroutine read_pair_options(reader, card, scene, pair)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(inout) :: pair(:)
      type(contact_pair_t) :: of_card
      integer :: i

      if (size(pair) == 0) call card_error(reader, card, "no pair of surfaces is given")
      call read_interaction(reader, card, pair, of_card)
      do i = 1, size(pair)
         pair(i)%interaction = of_card%interaction
         if (has_option(card, "TIED")) pair(i)%interaction%pressure%kind = pressure_tied
         call suit_pressure(pair(i))
      end do
      if (has_option(card, "ADJUST")) call read_adjust(reader, card, scene, of_card)
      call read_guard(reader, card, any(pair%both_sides), of_card)
      call read_crossings(reader, card, scene, pair, of_card%holds_crossings)
      call read_pair_initiation(reader, card, of_card%initiation)
      if (any(pair%formulation == formulation_user)) call suit_user(reader, card, of_card)
      do i = 1, size(pair)
         pair(i)%adjust = of_card%adjust
         ! Guards would push beside a pressure where that lets bodies in by more than their slack.
         pair(i)%is_guarded = of_card%is_guarded .and. (has_option(card, "GUARD") .or. &
            pair(i)%interaction%pressure%kind == pressure_hard)
         pair(i)%holds_crossings = of_card%holds_crossings
         if (pair(i)%master > 0) then
            if (allocated(scene%surface(pair(i)%master)%wall)) pair(i)%is_guarded = &
               pair(i)%is_guarded .and. pair(i)%formulation == formulation_mortar
         end if
         pair(i)%initiation = of_card%initiation
         if (pair(i)%interaction%pressure%kind == pressure_tied) call check_tied(reader, card, &
            scene, pair(i))
      end do
   end subroutine read_pair_options

   !> A pressure by the overclosure acts on the nodes of the slave that the deck names, whose area
   !> it is by, unless it asks for both sides.
   pure subroutine suit_pressure(pair)
      type(contact_pair_t), intent(inout) :: pair

      if (pair%interaction%pressure%kind == pressure_hard) return
      if (pair%may_choose) pair%both_sides = .false.
      pair%may_choose = .false.
   end subroutine suit_pressure

   !> What is tied has faces on two surfaces; else it has none from here on.
   subroutine check_tied(reader, card, scene, pair)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(inout) :: pair

      if (min(pair%slave, pair%master) == 0) return
      if (.not. (scene%surface(pair%slave)%is_nodal .or. pair%slave == pair%master)) return
      call card_error(reader, card, "its surfaces are tied, and ties join the element faces of " &
         // "two surfaces")
      pair%slave = 0
   end subroutine check_tied

   !> What contact of a program has, and what it does not know of.
   subroutine suit_user(reader, card, of_card)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(contact_pair_t), intent(inout) :: of_card

      if (has_option(card, "GUARD") .and. of_card%is_guarded) call refuse("GUARD=YES")
      of_card%is_guarded = .false.
      if (has_option(card, "ADJUST")) call refuse("ADJUST")
      if (of_card%interaction%offset > 0.0_wp) call refuse( &
         "PAD THICKNESS of its surface interaction")
      if (of_card%interaction%friction > 0.0_wp) call refuse("*FRICTION of its surface interaction")
      if (of_card%interaction%damping%coefficient > 0.0_wp) call refuse( &
         "*CONTACT DAMPING of its surface interaction")

   contains

      subroutine refuse(what)
         character(len=*), intent(in) :: what

         call card_error(reader, card, what // " does not work with TYPE=USER, contact of a " // &
            "program")
      end subroutine refuse

   end subroutine suit_user

   !> INTERACTION= of a card: the thickness of its pad, restitution, friction, damping.
   subroutine read_interaction(reader, card, pair, of_card)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(contact_pair_t), intent(in) :: pair(:)
      type(contact_pair_t), intent(inout) :: of_card
      character(len=:), allocatable :: name
      integer :: i

      call need_name(reader, card, "INTERACTION", name)
      i = name_index_find(reader%names%interactions, name)
      if (i > 0) of_card%interaction = reader%interaction(i)
      if (.not. (i > 0 .or. name == "" .or. reader%doubt%names)) call card_error( &
         reader, card, "unknown surface interaction " &
         // quoted(name) // suggestion(name, reader%interaction_name))
      if (.not. of_card%interaction%offset > 0.0_wp) return
      if (any(pair%slave == pair%master .and. pair%slave > 0)) call card_error(reader, card, &
         "the surface interaction " // quoted(name) // " has a PAD THICKNESS, which has no " // &
         "meaning for a surface in contact with itself: neighbours on it are nearer than that")
   end subroutine read_interaction

   !> GUARD= of a card: are nodes that the pairs do not hold kept from going in too far?
   subroutine read_guard(reader, card, both_sides, of_card)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      logical, intent(in) :: both_sides
      type(contact_pair_t), intent(inout) :: of_card
      character(len=:), allocatable :: word

      call option_word(reader, card, "GUARD", "YES, NO", word)
      of_card%is_guarded = word /= "NO"
      if (both_sides .and. has_option(card, "GUARD")) call card_error(reader, card, "GUARD has " &
         // "no meaning where the nodes of both surfaces are held; take it out, or say SIDES=ONE")
   end subroutine read_guard

   !> ADJUST= a distance or a node set.
   subroutine read_adjust(reader, card, scene, of_card)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(inout) :: of_card
      character(len=:), allocatable :: value
      real(wp) :: distance
      logical :: is_number

      value = option_name(card, "ADJUST")
      if (value == "") return
      call read_real(value, distance, is_number)
      if (is_number .and. distance < 0.0_wp) then
         call card_error(reader, card, "the distance ADJUST=" // value // " is negative")
      else if (is_number) then
         of_card%adjust%distance = distance
      else
         of_card%adjust%set = name_index_find(reader%names%node_sets, value)
         if (of_card%adjust%set == 0 .and. .not. reader%doubt%names) then
            call card_error(reader, card, "ADJUST=" // quoted(value) // " is neither a number " &
               // "nor a node set" // suggestion(value, set_names(scene%set%node)))
         end if
      end if
   end subroutine read_adjust

end module emcon_deck_contact
