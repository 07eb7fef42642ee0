!> *GIVEN FORCES: nodes whose forces and mass come from the program that reads the deck.
module emcon_deck_user
   use emcon_deck_named, only : set_names
   use emcon_deck_reader, only : card_error, card_t, has_option, need_name, reader_t
   use emcon_diagnostics, only : quoted, suggestion
   use emcon_name_index, only : name_index_find
   use emcon_scene, only : scene_t
   use emcon_sort, only : unique_sorted
   implicit none
   private
   public :: read_given

contains

   !> All cards. Without NSET they name the nodes that belong to no element.
   subroutine read_given(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      integer, allocatable :: list(:)
      integer :: i

      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "GIVENFORCES") cycle
         if (.not. allocated(scene%host%node)) then
            allocate(scene%host%node(0))
            scene%host%origin = reader%card(i)%origin
         end if
         call find_nodes(reader, reader%card(i), scene, list)
         list = [scene%host%node, list]
         scene%host%node = unique_sorted(list)
      end do
   end subroutine read_given

   !> The nodes of NSET, or those of no element: also where NSET is wrong, so that no other message
   !> follows from that.
   subroutine find_nodes(reader, card, scene, list)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: list(:)
      character(len=:), allocatable :: name
      logical :: is_bare(0:size(scene%node%label))
      integer :: e, i, k

      if (has_option(card, "NSET")) then
         call need_name(reader, card, "NSET", name)
         k = name_index_find(reader%names%node_sets, name)
         if (k > 0) then
            list = scene%set%node(k)%item
            return
         end if
         if (name /= "" .and. .not. reader%doubt%names) call card_error(reader, card, &
            "unknown node set " // quoted(name) // suggestion(name, set_names(scene%set%node)))
      end if
      is_bare = .true.
      do e = 1, size(scene%element%label)
         do k = 1, scene%element%kinds(scene%element%kind(e))%n_node
            is_bare(scene%element%node(k, e)) = .false.
         end do
      end do
      list = pack([(i, i = 1, size(scene%node%label))], is_bare(1:))
      if (size(list) == 0 .and. .not. (has_option(card, "NSET") .or. reader%doubt%nodes &
         .or. reader%doubt%elements)) call card_error(reader, card, &
         "all nodes belong to elements; name those that are given forces by NSET=")
   end subroutine find_nodes

end module emcon_deck_user
