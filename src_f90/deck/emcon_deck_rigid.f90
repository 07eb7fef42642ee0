!> *RIGID BODY: elements and nodes that keep their shape, and their reference nodes.
module emcon_deck_rigid
   use emcon_deck_dimension, only : n_plane
   use emcon_deck_labels, only : find_label
   use emcon_deck_named, only : hint_at_set, set_names
   use emcon_deck_reader, only : card_error, card_t, has_option, need_name, option_name, reader_t
   use emcon_deck_surfaces, only : surface_names
   use emcon_diagnostics, only : label_list, quoted, suggestion
   use emcon_name_index, only : name_index_find
   use emcon_origin, only : origin_t
   use emcon_rigid_bodies, only : rigid_body_t, rigid_frame_choose
   use emcon_scene, only : scene_t
   use emcon_sort, only : unique_sorted
   use emcon_text, only : read_integer, to_text
   implicit none
   private
   public :: read_rigid_bodies, mark_rigid

contains

   !> All cards; a body that is refused is left out.
   subroutine read_rigid_bodies(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      type(rigid_body_t), allocatable :: all(:)
      type(rigid_body_t) :: new
      integer :: i, n, n_before

      allocate(scene%rigid(0))
      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "RIGIDBODY") cycle
         n_before = reader%log%n_errors
         call read_card(reader, reader%card(i), scene, new)
         reader%doubt%rigid = reader%doubt%rigid .or. reader%log%n_errors > n_before
         if (reader%log%n_errors > n_before .or. .not. allocated(new%frame)) cycle
         n = size(scene%rigid)
         allocate(all(n + 1))
         all(:n) = scene%rigid
         all(n + 1) = new
         call move_alloc(all, scene%rigid)
      end do
   end subroutine read_rigid_bodies

   !> One body; without frame if it is wrong.
   subroutine read_card(reader, card, scene, new)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(rigid_body_t), intent(out) :: new
      integer, allocatable :: node(:)

      new%origin = card%origin
      if (has_option(card, "ELSET") .or. .not. (has_option(card, "ANALYTICALSURFACE") .or. &
         has_option(card, "NSET"))) then
         call find_elements(reader, card, scene, new)
      else
         allocate(new%element(0))
      end if
      call find_profile(reader, card, scene, new, node)
      call find_nodes(reader, card, scene, new, node)
      call find_node(reader, card, scene, "REFNODE", new%reference)
      if (has_option(card, "ROTNODE")) call find_turning(reader, card, scene, new)
      if (.not. (allocated(new%element) .and. allocated(node)) .or. new%reference == 0) return
      if (reader%doubt%elements .or. reader%doubt%positions) return
      associate (of_element => scene%element%node(:, new%element))
         new%node = unique_sorted([pack(of_element, of_element > 0), node, new%reference])
      end associate
      call check_alone(reader, card, scene, new)
      ! A profile or set that was refused has no nodes.
      if (size(new%node) == 1 .and. reader%log%n_errors > 0) then
         reader%doubt%rigid = .true.
         return
      end if
      call rigid_frame_choose(scene%x, new%node, new%reference, new%frame)
      if (.not. allocated(new%frame)) call card_error(reader, card, "the nodes of " &
         // new%name // " and the reference node " // to_text(scene%node%label(new%reference)) &
         // " lie " // trim(merge("on one line ", "in one plane", scene%n_dim == n_plane)) &
         // ", from which no rotation can be computed; put the reference node beside it")
   end subroutine read_card

   !> The nodes that NSET names join `node`, the elements that have no others the body.
   subroutine find_nodes(reader, card, scene, new, node)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(rigid_body_t), intent(inout) :: new
      integer, allocatable, intent(inout) :: node(:)   !! not allocated: something is wrong
      character(len=:), allocatable :: name
      logical :: is_in(size(scene%node%label))
      integer :: i, e

      if (.not. has_option(card, "NSET")) return
      call need_name(reader, card, "NSET", name)
      i = 0
      if (name /= "") i = name_index_find(reader%names%node_sets, name)
      if (i == 0) then
         if (allocated(node)) deallocate(node)
         if (name /= "" .and. .not. reader%doubt%names) call card_error(reader, card, &
            "unknown node set " // quoted(name) // suggestion(name, set_names(scene%set%node)))
         return
      end if
      if (.not. allocated(new%name)) new%name = name
      if (.not. (allocated(node) .and. allocated(new%element))) return
      associate (item => scene%set%node(i)%item)
         is_in = .false.
         is_in(item) = .true.
         node = [node, item]
      end associate
      new%element = unique_sorted([new%element, pack([(e, e = 1, size(scene%element%label))], &
         [(all(is_in(pack(scene%element%node(:, e), scene%element%node(:, e) > 0))) .and. &
         scene%element%node(1, e) > 0, e = 1, size(scene%element%label))])])
   end subroutine find_nodes

   !> ROT NODE: in space its displacements stand for the rotations, as CalculiX has it.
   subroutine find_turning(reader, card, scene, new)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(rigid_body_t), intent(inout) :: new

      if (scene%n_dim == n_plane) then
         call card_error(reader, card, "ROT NODE= is for three dimensions; here degree of " &
            // "freedom 6 of the reference node is the rotation")
         return
      end if
      call find_node(reader, card, scene, "ROTNODE", new%turning)
      if (new%turning == 0 .or. reader%doubt%elements) return
      if (new%turning == new%reference .or. any(scene%element%node == new%turning) .or. &
         any(scene%rigid%turning == new%turning)) call card_error(reader, card, "ROT NODE " // &
         to_text(scene%node%label(new%turning)) // " is used otherwise; its displacements are " &
         // "rotations of this body alone: give a node that is in no element and in no other body")
   end subroutine find_turning

   subroutine find_elements(reader, card, scene, new)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(rigid_body_t), intent(inout) :: new
      character(len=:), allocatable :: hint
      integer :: i

      call need_name(reader, card, "ELSET", new%name)
      if (new%name == "") return
      i = name_index_find(reader%names%element_sets, new%name)
      if (i == 0) then
         call hint_at_set(reader, "element set", new%name, set_names(scene%set%element), hint)
         if (.not. reader%doubt%names) call card_error(reader, card, "unknown element set " // &
            quoted(new%name) // hint)
      else if (size(scene%set%element(i)%item) == 0) then
         call card_error(reader, card, "element set " // new%name // " is empty")
      else
         new%element = scene%set%element(i)%item
      end if
   end subroutine find_elements

   !> The nodes of the profile that ANALYTICAL SURFACE names; not allocated: it is wrong.
   subroutine find_profile(reader, card, scene, new, node)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(rigid_body_t), intent(inout) :: new
      integer, allocatable, intent(out) :: node(:)
      character(len=:), allocatable :: name
      integer :: i

      if (.not. has_option(card, "ANALYTICALSURFACE")) then
         allocate(node(0))
         return
      end if
      call need_name(reader, card, "ANALYTICALSURFACE", name)
      if (name == "") return
      if (.not. allocated(new%name)) new%name = name
      i = name_index_find(reader%names%surfaces, name)
      if (i == 0) then
         if (.not. reader%doubt%names) call card_error(reader, card, "unknown surface " // &
            quoted(name) // suggestion(name, surface_names(scene%surface)))
      else if (.not. scene%surface(i)%is_profile) then
         call card_error(reader, card, "surface " // name // " is not of TYPE=" // &
            trim(merge("SEGMENTS                                  ", &
            "PLANE, SPHERE, REVOLUTION, CYLINDER or STL", scene%n_dim == n_plane)) // &
            "; a surface of elements becomes rigid with these, by ELSET=")
      else if (size(scene%surface(i)%node) > 0) then
         node = scene%surface(i)%node
      else if (allocated(scene%surface(i)%edge)) then
         node = reshape(scene%surface(i)%edge, [size(scene%surface(i)%edge)])
         if (scene%surface(i)%inner_node > 0) node = [node, scene%surface(i)%inner_node]
      end if
   end subroutine find_profile

   !> The node that REF NODE or ROT NODE names by its label, or by a set that holds it alone.
   subroutine find_node(reader, card, scene, option, node)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      character(len=*), intent(in) :: option
      integer, intent(out) :: node               !! 0: there is none
      character(len=:), allocatable :: name, title
      integer :: label, i
      logical :: is_number

      node = 0
      name = option_name(card, option)
      title = option(:3) // " NODE"
      if (name == "") call card_error(reader, card, title // "= is missing: a node that is " // &
         "prescribed, loaded and started in place of the body")
      if (name == "") return
      call read_integer(name, label, is_number)
      if (is_number) then
         node = find_label(reader%node_map, label)
         if (node == 0 .and. .not. reader%doubt%nodes) call card_error(reader, card, &
            title // ": node " // name // " does not exist")
      else
         i = name_index_find(reader%names%node_sets, name)
         if (i == 0) then
            if (.not. reader%doubt%names) call card_error(reader, card, "unknown node set " // &
               quoted(name) // suggestion(name, set_names(scene%set%node)))
         else if (size(scene%set%node(i)%item) /= 1) then
            call card_error(reader, card, title // " is one node, but node set " // name &
               // " has " // to_text(size(scene%set%node(i)%item)))
         else
            node = scene%set%node(i)%item(1)
         end if
      end if
   end subroutine find_node

   !> No node is of two rigid bodies.
   subroutine check_alone(reader, card, scene, new)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(rigid_body_t), intent(in) :: new
      logical :: is_in(size(scene%node%label)), is_there(size(scene%node%label))
      integer :: b

      is_in = .false.
      is_in(new%node) = .true.
      do b = 1, size(scene%rigid)
         associate (other => scene%rigid(b))
            if (other%reference == new%reference) then
               call card_error(reader, card, "the reference node " // to_text(scene%node%label( &
                  new%reference)) // " is that of rigid body " // other%name // " already")
               cycle
            end if
            is_there = .false.
            is_there(other%node) = .true.
            if (any(is_in .and. is_there)) call card_error(reader, card, "node " // &
               label_list(pack(scene%node%label, is_in .and. is_there)) // &
               " belongs to rigid body " // other%name // " already; make both one body, or " // &
               "give each its own nodes")
         end associate
      end do
   end subroutine check_alone

   !> The rigid body of each node.
   pure subroutine mark_rigid(scene, body)
      type(scene_t), intent(in) :: scene
      integer, intent(out) :: body(:)            !! (n_node) 0: none
      integer :: b

      body = 0
      do b = 1, size(scene%rigid)
         body(scene%rigid(b)%node) = b
      end do
   end subroutine mark_rigid

end module emcon_deck_rigid
