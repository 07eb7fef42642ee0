!> The ties, as far as they can be judged by their meshes alone.
module emcon_deck_check_ties
   use emcon_couplings, only : tie_t
   use emcon_deck_check_surfaces, only : find_common_edges, mark_nodes
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : add_error, label_list
   use emcon_scene, only : scene_t, where_text
   use emcon_surface_edges, only : surface_edges
   implicit none
   private
   public :: check_ties

contains

   !> The two surfaces of a tie have no common nodes and are not in contact with each other; no
   !> face is slave in two ties.
   subroutine check_ties(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer :: i

      if (size(scene%tie) == 0 .or. reader%doubt_shapes) return
      do i = 1, size(scene%tie)
         if (scene%tie(i)%slave == 0) cycle
         call check_common_nodes(reader, scene, scene%tie(i))
         call check_common_faces(reader, scene, i)
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
   subroutine check_common_faces(reader, scene, i_tie)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_tie
      integer, allocatable :: earlier(:), edge(:, :)
      logical, allocatable :: is_common(:)
      character(len=:), allocatable :: text
      integer :: i

      associate (slave => scene%surface(scene%tie(i_tie)%slave))
         call surface_edges(scene, slave, edge)
         allocate(earlier(size(edge, 2)), source=0)
         do i = 1, i_tie - 1
            if (scene%tie(i)%slave == 0) cycle
            call find_common_edges(scene, slave, scene%surface(scene%tie(i)%slave), is_common)
            where (is_common) earlier = i
         end do
         if (all(earlier == 0)) return
         if (allocated(slave%edge)) then
            text = ": edges from node " // label_list(scene%node_label(pack(edge(1, :), &
               earlier > 0)))
         else
            text = ": faces of element " // label_list(scene%element_label(pack(slave%element, &
               earlier > 0)))
         end if
         call add_error(reader%log, scene%tie(i_tie)%origin, title(scene, scene%tie(i_tie)) &
            // text // " are slave in tie " // scene%tie(maxval(earlier))%name &
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
            if (scene%surface(pair%slave)%is_exterior) cycle     ! without what the tie covers
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
      logical, allocatable :: is_common(:)

      have_common_face = tied == other
      if (have_common_face) return
      call find_common_edges(scene, scene%surface(tied), scene%surface(other), is_common)
      have_common_face = any(is_common)
   end function have_common_face

   !> "*TIE: slave surface S and master surface M of tie NAME"
   pure function title(scene, tie) result(text)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      character(len=title_length(scene, tie)) :: text

      text = "*TIE: slave surface " // scene%surface(tie%slave)%name // " and master surface " &
         // scene%surface(tie%master)%name // " of tie " // tie%name
   end function title

   pure integer function title_length(scene, tie)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie

      title_length = len("*TIE: slave surface  and master surface  of tie ") + len(tie%name) &
         + len(scene%surface(tie%slave)%name) + len(scene%surface(tie%master)%name)
   end function title_length

end module emcon_deck_check_ties
