!> The ties, as far as they can be judged by their meshes alone.
module emcon_deck_check_ties
   use emcon_deck_check_surfaces, only : face_nodes, mark_nodes
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : add_error, label_list
   use emcon_element_kinds, only : element_kinds
   use emcon_scene, only : scene_t, surface_t, tie_t, where_text
   implicit none
   private
   public :: check_ties

contains

   !> The two surfaces of a tie have no common nodes and are not in contact with each other; no
   !> face is slave in two ties.
   subroutine check_ties(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer, allocatable :: owner(:, :)          !! (face, element) the tie in which it is slave
      integer :: i

      if (size(scene%tie) == 0 .or. reader%doubt_shapes) return
      allocate(owner(maxval(element_kinds%n_face), size(scene%element_label)), source=0)
      do i = 1, size(scene%tie)
         if (scene%tie(i)%slave == 0) cycle
         call check_common_nodes(reader, scene, scene%tie(i))
         call check_common_faces(reader, scene, i, owner)
      end do
      if (size(scene%pair) == 0) return
      do i = 1, size(scene%tie)
         if (scene%tie(i)%slave > 0) call check_contact(reader, scene, scene%tie(i))
      end do
   end subroutine check_ties

   !> Only what is not connected by its nodes can be tied.
   subroutine check_common_nodes(reader, scene, tie)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      logical, allocatable :: is_slave(:), is_master(:)

      allocate(is_slave(size(scene%node_label)), is_master(size(scene%node_label)), &
         source=.false.)
      call mark_nodes(scene, scene%surface(tie%slave), is_slave)
      call mark_nodes(scene, scene%surface(tie%master), is_master)
      if (any(is_slave .and. is_master)) call add_error(reader%log, tie%origin, title(scene, tie) &
         // " share node " // label_list(pack(scene%node_label, is_slave .and. is_master)) &
         // "; what is tied must not be connected already: take its faces off the surfaces")
   end subroutine check_common_nodes

   !> A face that follows two masters is over-constrained.
   subroutine check_common_faces(reader, scene, i_tie, owner)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_tie
      integer, intent(inout) :: owner(:, :)
      integer, allocatable :: earlier(:)
      integer :: i

      associate (slave => scene%surface(scene%tie(i_tie)%slave))
         allocate(earlier(size(slave%element)), source=0)
         do i = 1, size(slave%element)
            earlier(i) = owner(slave%face(i), slave%element(i))
            owner(slave%face(i), slave%element(i)) = i_tie
         end do
         if (all(earlier == 0)) return
         call add_error(reader%log, scene%tie(i_tie)%origin, title(scene, scene%tie(i_tie)) &
            // ": faces of element " // label_list(scene%element_label(pack(slave%element, &
            earlier > 0))) // " are slave in tie " // scene%tie(maxval(earlier))%name &
            // " too, at " // where_text(scene, scene%tie(maxval(earlier))%origin) &
            // "; they can follow one master only: one *SURFACE may hold the faces of both masters")
      end associate
   end subroutine check_common_faces

   !> What is tied cannot touch.
   subroutine check_contact(reader, scene, tie)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      integer :: i

      do i = 1, size(scene%pair)
         associate (pair => scene%pair(i))
            if (pair%slave == 0 .or. pair%master == 0) cycle
            if (.not. (meets(pair%slave, pair%master) .or. meets(pair%master, pair%slave))) cycle
            call add_error(reader%log, tie%origin, title(scene, tie) // " are also in contact by " &
               // "*CONTACT PAIR at " // where_text(scene, pair%origin) &
               // "; take the tied faces off the contact surfaces, or the tie away")
         end associate
      end do

   contains

      pure logical function meets(first, second)
         integer, intent(in) :: first, second

         meets = have_common_face(scene, tie%slave, first)
         if (meets) meets = have_common_face(scene, tie%master, second)
      end function meets

   end subroutine check_contact

   !> Whether some face of surface `tied` belongs to the surface `other` of faces or of nodes.
   pure logical function have_common_face(scene, tied, other)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: tied, other
      logical :: is_in(size(scene%node_label))
      integer :: i, node(2)

      have_common_face = tied == other
      if (have_common_face) return
      is_in = .false.
      call mark_nodes(scene, scene%surface(other), is_in)
      associate (surface => scene%surface(tied))
         do i = 1, size(surface%element)
            node = face_nodes(scene, surface%element(i), surface%face(i))
            if (any(node == 0)) cycle
            if (.not. all(is_in(node))) cycle
            have_common_face = has_face(scene%surface(other), surface%element(i), surface%face(i))
            if (have_common_face) return
         end do
      end associate
   end function have_common_face

   !> Whether `surface`, which has all nodes of a face, has the face: one of nodes does.
   pure logical function has_face(surface, element, face)
      type(surface_t), intent(in) :: surface
      integer, intent(in) :: element, face

      has_face = surface%is_nodal .or. any(surface%element == element .and. surface%face == face)
   end function has_face

   !> "*TIE: slave surface S and master surface M of tie NAME"
   pure function title(scene, tie) result(text)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      character(len=:), allocatable :: text

      text = "*TIE: slave surface " // scene%surface(tie%slave)%name // " and master surface " &
         // scene%surface(tie%master)%name // " of tie " // tie%name
   end function title

end module emcon_deck_check_ties
