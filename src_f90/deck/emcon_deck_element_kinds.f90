!> The kinds of elements of a deck: those of the registry, and those of *USER ELEMENT, whose shape a
!> program gives.
module emcon_deck_element_kinds
   use emcon_deck_fields, only : data_error, data_open, data_t, get_integer, next_line
   use emcon_deck_reader, only : card_error, card_t, has_option, need_name, option_count, &
      option_name, reader_t
   use emcon_diagnostics, only : quoted
   use emcon_element_kind, only : element_kind_t, find_element_kind, user_element_row
   use emcon_element_registry, only : element_kinds_create
   use emcon_scene, only : scene_t
   use emcon_shape, only : max_plane_nodes
   use emcon_text, only : to_text
   implicit none
   private
   public :: read_element_kinds, is_user_type, has_user_card, face_number, face_names

   !> A number of Abaqus's: types of user elements are U1 to U9999.
   integer, parameter :: most_digits = 4

contains

   !> The kinds of the registry, then those of the *USER ELEMENT cards in their order.
   subroutine read_element_kinds(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      integer :: i

      call element_kinds_create(scene%n_dim, scene%element%kinds)
      do i = 1, size(reader%card)
         if (reader%card(i)%name == "USERELEMENT") call read_kind(reader, reader%card(i), &
            scene%n_dim, scene%element%kinds)
      end do
   end subroutine read_element_kinds

   !> *USER ELEMENT, TYPE=U<n>, NODES=, FACES=; data: the freedoms of each node.
   subroutine read_kind(reader, card, n_dim, kind)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      integer, intent(in) :: n_dim
      type(element_kind_t), allocatable, intent(inout) :: kind(:)
      character(len=:), allocatable :: name
      integer :: n_node, n_face, n_axis

      call need_name(reader, card, "TYPE", name)
      if (name == "") return
      if (.not. is_user_type(name)) then
         call card_error(reader, card, "TYPE=" // quoted(name) &
            // " is no type of a user element: U1 to U9999")
         return
      else if (find_element_kind(kind, name) > 0) then
         call card_error(reader, card, "element type " // name // " is defined twice")
         return
      end if
      n_node = 0
      n_face = 0
      n_axis = n_dim
      if (.not. has_option(card, "NODES")) call card_error(reader, card, "NODES= is missing")
      call option_count(reader, card, "NODES", 1, n_node, max_plane_nodes)
      call option_count(reader, card, "FACES", 0, n_face, max_plane_nodes)
      call option_count(reader, card, "COORDINATES", n_dim, n_axis, n_dim)
      call check_freedoms(reader, card, n_dim)
      if (n_node == 0) return
      if (n_face > n_node .or. n_face == 1 .or. n_face == 2) then
         call card_error(reader, card, "FACES=" // to_text(n_face) // ": an element of " &
            // to_text(n_node) // " nodes has none, or from 3 to " // to_text(n_node))
         return
      end if
      call append(kind, name, n_node, n_face)
   end subroutine read_kind

   subroutine append(kind, name, n_node, n_face)
      type(element_kind_t), allocatable, intent(inout) :: kind(:)
      character(len=*), intent(in) :: name
      integer, intent(in) :: n_node, n_face
      type(element_kind_t), allocatable :: longer(:)
      integer :: k

      allocate(longer(size(kind) + 1))
      do k = 1, size(kind)
         longer(k)%element_row_t = kind(k)%element_row_t
         call move_alloc(kind(k)%shape, longer(k)%shape)
      end do
      longer(k)%element_row_t = user_element_row(name, n_node, n_face)
      call move_alloc(longer, kind)
   end subroutine append

   !> All nodes have the freedoms 1 to `n_dim`: a data line may say so.
   subroutine check_freedoms(reader, card, n_dim)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      integer, intent(in) :: n_dim
      type(data_t) :: data
      integer :: freedom, k

      call data_open(data, card)
      do while (next_line(reader, data))
         do k = 1, n_dim
            freedom = 0
            if (k <= data%n) call get_integer(reader, data, k, "degree of freedom", freedom)
            if (.not. data%ok) exit
            if (freedom /= k .or. data%n > n_dim) then
               call data_error(reader, data, "each node has the degrees of freedom 1, 2; others " &
                  // "are not supported")
               exit
            end if
         end do
      end do
   end subroutine check_freedoms

   !> Is `name` (upper case) one that types of user elements have?
   pure logical function is_user_type(name)
      character(len=*), intent(in) :: name

      is_user_type = len_trim(name) > 1 .and. len_trim(name) <= 1 + most_digits
      if (is_user_type) is_user_type = name(1:1) == "U" .and. verify(trim(name(2:)), &
         "0123456789") == 0 .and. verify(trim(name(2:)), "0") > 0
   end function is_user_type

   !> Is there a card that defines the type `name`, right or wrong?
   pure logical function has_user_card(reader, name)
      type(reader_t), intent(in) :: reader
      character(len=*), intent(in) :: name
      integer :: i

      has_user_card = .false.
      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "USERELEMENT") cycle
         if (option_name(reader%card(i), "TYPE") == name) has_user_card = .true.
      end do
   end function has_user_card

   !> Number of the face that `letter` and a digit name, up to `n_face`; 0: there is none.
   pure integer function face_number(name, letter, n_face)
      character(len=*), intent(in) :: name, letter
      integer, intent(in) :: n_face              !! 0 to 9

      face_number = 0
      if (len(name) == 2) face_number = index("123456789", name(2:2))*index(letter, name(1:1))
      if (face_number > n_face) face_number = 0
   end function face_number

   !> "S1, S2, S3" of the letter S and three faces.
   pure function face_names(letter, n_face) result(names)
      character(len=*), intent(in) :: letter
      integer, intent(in) :: n_face              !! 1 to 9
      character(len=4*n_face - 2) :: names
      integer :: k

      names = ""
      do k = 1, n_face
         names(4*k - 3:) = letter // to_text(k) // ", "
      end do
   end function face_names

end module emcon_deck_element_kinds
