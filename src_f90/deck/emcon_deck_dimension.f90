!> How many dimensions a deck has: those of its elements. What is of the plane alone is refused
!> where there are three, and for solids of revolution.
module emcon_deck_dimension
   use emcon_deck_fields, only : data_open, data_t, next_line
   use emcon_deck_reader, only : card_error, card_t, option_name, reader_t
   use emcon_diagnostics, only : add_error
   use emcon_requests, only : output_t
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: n_plane, n_space, type_dimension, other_dimension, find_dimension, is_axial_deck
   public :: freedoms_text
   public :: refuse_plane_cards, check_dimension

   integer, parameter :: n_plane = 2, n_space = 3

   !> First letters of types of elements.
   integer, parameter :: n_letter = 3
   character(len=n_letter), parameter :: plane_types(*) = ["CPE", "CPS", "CAX"], &
      space_types(*) = ["C3D"]

   !> A card that is of the plane, and what it does.
   type :: plane_card_t
      character(len=14) :: name                    !! as `card_t` has it
      character(len=21) :: what
      character(len=3) :: verb = "is"
      logical :: is_of_space = .false.             !! may stand in three dimensions
   end type plane_card_t

   type(plane_card_t), parameter :: plane_cards(*) = [ &
      plane_card_t("CONTACTPAIR", "contact", is_of_space=.true.), &
      plane_card_t("CONTACT", "contact", is_of_space=.true.), &
      plane_card_t("TIE", "ties", "are", .true.), &
      plane_card_t("RIGIDBODY", "rigid bodies", "are", .true.), &
      plane_card_t("USERELEMENT", "elements of a program", "are"), &
      plane_card_t("USERMATERIAL", "laws of a program", "are", .true.), &
      plane_card_t("GIVENFORCES", "forces of a program", "are", .true.)]

   !> What a card or a value is refused for.
   character(len=*), parameter :: in_space = "in three dimensions", &
      on_rings = "with elements CAX"

contains

   !> Dimensions of the elements of a type, by its name in capitals; 0: the name does not tell.
   pure integer function type_dimension(name) result(n_dim)
      character(len=*), intent(in) :: name

      n_dim = 0
      if (len(name) < n_letter) return
      if (any(plane_types == name(:n_letter))) n_dim = n_plane
      if (any(space_types == name(:n_letter))) n_dim = n_space
   end function type_dimension

   !> The plane for space, space for the plane.
   pure integer function other_dimension(n_dim)
      integer, intent(in) :: n_dim

      other_dimension = n_plane + n_space - n_dim
   end function other_dimension

   !> Dimensions of the first element whose type tells; the plane if none does. Where nodes have a
   !> z, solids count before elements of the plane: these are then their faces, as generators write.
   integer function find_dimension(reader) result(n_dim)
      type(reader_t), intent(in) :: reader
      integer :: i, first, own

      first = 0
      n_dim = 0
      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "ELEMENT") cycle
         own = type_dimension(option_name(reader%card(i), "TYPE"))
         if (first == 0) first = own
         n_dim = max(n_dim, own)
      end do
      if (first == n_plane .and. n_dim == n_space) then
         if (.not. have_z(reader)) n_dim = n_plane
      end if
      if (n_dim == 0) n_dim = n_plane
   end function find_dimension

   !> Has the first node a third coordinate?
   logical function have_z(reader)
      type(reader_t), intent(in) :: reader
      type(data_t) :: data
      integer :: i

      have_z = .false.
      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "NODE") cycle
         call data_open(data, reader%card(i))
         if (.not. next_line(reader, data)) cycle
         have_z = data%n > n_space
         return
      end do
   end function have_z

   !> Does it have elements of solids of revolution?
   pure logical function is_axial_deck(reader) result(is_axial)
      type(reader_t), intent(in) :: reader
      character(len=:), allocatable :: name
      integer :: i

      is_axial = .false.
      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "ELEMENT") cycle
         name = option_name(reader%card(i), "TYPE")
         if (index(name, "CAX") == 1) is_axial = .true.
      end do
   end function is_axial_deck

   !> "1, 2": the displacements that a node has.
   pure function freedoms_text(n_dim) result(text)
      integer, intent(in) :: n_dim
      character(len=3*n_dim - 2) :: text

      text = "1, 2, 3"
   end function freedoms_text

   !> Refuse the cards that are of the plane, each kind once, and go on without them.
   subroutine refuse_plane_cards(reader, n_dim)
      type(reader_t), intent(inout) :: reader
      integer, intent(in) :: n_dim               !! of the deck
      type(card_t), allocatable :: kept(:)
      logical :: is_kept(size(reader%card)), is_told(size(plane_cards))
      integer :: i, k

      is_kept = .true.
      is_told = .false.
      do i = 1, size(is_kept)
         k = findloc(plane_cards%name == reader%card(i)%name .and. .not. &
            (plane_cards%is_of_space .and. n_dim == n_space), .true., 1)
         is_kept(i) = k == 0 .and. (n_dim == n_space .or. .not. &
            is_under_contact(reader%card(i)%name))
         if (k == 0) cycle
         if (.not. is_told(k)) call card_error(reader, reader%card(i), &
            trim(plane_cards(k)%what) // " " // trim(merge(in_space, on_rings // "  ", &
            n_dim == n_space)) // " " // trim(plane_cards(k)%verb) // " not in this version")
         is_told(k) = .true.
      end do
      if (all(is_kept)) return
      allocate(kept(count(is_kept)))
      k = 0
      do i = 1, size(is_kept)
         if (.not. is_kept(i)) cycle
         k = k + 1
         kept(k) = reader%card(i)
      end do
      call move_alloc(kept, reader%card)
      reader%doubt%names = .true.
      reader%doubt%rigid = .true.
   end subroutine refuse_plane_cards

   !> Is a card one of those that stand below *CONTACT?
   pure logical function is_under_contact(name)
      character(len=*), intent(in) :: name         !! as `card_t` has it

      is_under_contact = index(name, "CONTACTINCLUSIONS") > 0 .or. &
         index(name, "CONTACTPROPERTY") > 0
   end function is_under_contact

   !> Refuse output that is of the plane. Values of options are refused where they are read, by
   !> their rows.
   subroutine check_dimension(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer :: i, k

      if (size(scene%rigid) == 0) return
      do i = 1, size(scene%step)
         associate (step => scene%step(i))
            do k = 1, size(step%output)
               if (asks_for_turns(step%output(k))) call add_error(reader%log, step%origin, &
                  "UR, VR, RM: the rotation of rigid bodies " // in_space &
                  // " is not in this version")
            end do
         end associate
      end do
   end subroutine check_dimension

   !> Is the rotation of reference nodes to be written?
   pure logical function asks_for_turns(output)
      type(output_t), intent(in) :: output
      integer :: k

      asks_for_turns = .false.
      do k = 1, size(output%variable)
         asks_for_turns = asks_for_turns .or. any(["UR", "VR", "RM"] == output%variable(k)%text)
      end do
   end function asks_for_turns

end module emcon_deck_dimension
