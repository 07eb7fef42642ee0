!> What a name or a label in a deck stands for: nodes, elements, lines, sets of them; and what a
!> message says of a name that stands for nothing.
module emcon_deck_named
   use emcon_deck_fields, only : data_error, data_t, get_integer, get_name, is_label
   use emcon_deck_labels, only : find_label
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : quoted, suggestion
   use emcon_mesh, only : named_set_t
   use emcon_name_index, only : name_index_find
   use emcon_scene, only : scene_t
   use emcon_text, only : string_t, to_text
   implicit none
   private
   public :: set_names, hint_at_set, refuse_name, get_nodes, get_elements, get_lines

contains

   pure function set_names(set) result(list)
      type(named_set_t), intent(in) :: set(:)
      type(string_t) :: list(size(set))
      integer :: i

      do i = 1, size(set)
         list(i)%text = set(i)%name
      end do
   end function set_names

   !> What a message says of the unknown name of a set: it holds lines, or another is near to it.
   subroutine hint_at_set(reader, what, name, known, hint)
      type(reader_t), intent(in) :: reader
      character(len=*), intent(in) :: what         !! "node set" or "element set"
      character(len=*), intent(in) :: name
      type(string_t), intent(in) :: known(:)
      character(len=:), allocatable, intent(out) :: hint

      hint = suggestion(name, known)
      if (what /= "element set") return
      if (name_index_find(reader%names%line_sets, name) > 0) hint = &
         ": it holds lines, which have no stiffness; only *SURFACE and *NSET may name it"
   end subroutine hint_at_set

   subroutine refuse_name(reader, data, what, name, known)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      character(len=*), intent(in) :: what, name
      type(string_t), intent(in) :: known(:)
      character(len=:), allocatable :: hint

      if (reader%doubt%names) then
         data%ok = .false.
      else
         call hint_at_set(reader, what, name, known, hint)
         call data_error(reader, data, "unknown " // what // " " // quoted(name) // hint)
      end if
   end subroutine refuse_name

   !> The nodes that field `k` names by label or set; none, with `data%ok` false, if it is wrong.
   subroutine get_nodes(reader, data, k, scene, item)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: k
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: item(:)

      call get_items(reader, data, k, "node", scene%set%node, item)
   end subroutine get_nodes

   !> The elements that field `k` names by label or set.
   subroutine get_elements(reader, data, k, scene, item)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: k
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: item(:)

      call get_items(reader, data, k, "element", scene%set%element, item)
   end subroutine get_elements

   !> The lines that field `k` names by label or set; none if it names none.
   subroutine get_lines(reader, data, k, line)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: k
      integer, allocatable, intent(out) :: line(:)
      character(len=:), allocatable :: name
      integer :: i

      allocate(line(0))
      if (is_label(data, k)) then
         call get_integer(reader, data, k, "element label", i)
         i = find_label(reader%element_map, i)
         if (i < 0) line = [-i]
      else
         call get_name(reader, data, k, "element label or set", name)
         i = name_index_find(reader%names%line_sets, name)
         if (i > 0) line = reader%line_set(i)%item
      end if
   end subroutine get_lines

   subroutine get_items(reader, data, k, what, set, item)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: k
      character(len=*), intent(in) :: what         !! "node" or "element"
      type(named_set_t), intent(in) :: set(:)
      integer, allocatable, intent(out) :: item(:)
      character(len=:), allocatable :: name
      integer :: label, i
      logical :: is_doubted

      allocate(item(0))
      if (is_label(data, k)) then
         call get_integer(reader, data, k, what // " label", label)
         if (.not. data%ok) return
         if (what == "node") then
            i = find_label(reader%node_map, label)
            is_doubted = reader%doubt%nodes
         else
            i = find_label(reader%element_map, label)
            is_doubted = reader%doubt%elements
         end if
         if (i > 0) then
            item = [i]
         else if (i < 0) then
            call data_error(reader, data, "element " // to_text(label) // " is a line: it bounds " &
               // "surfaces and has no stiffness")
         else if (is_doubted) then
            data%ok = .false.
         else
            call data_error(reader, data, what // " " // to_text(label) // " does not exist")
         end if
      else
         call get_name(reader, data, k, what // " label or set", name)
         if (.not. data%ok) return
         if (what == "node") then
            i = name_index_find(reader%names%node_sets, name)
         else
            i = name_index_find(reader%names%element_sets, name)
         end if
         if (i > 0) then
            item = set(i)%item
         else
            call refuse_name(reader, data, what // " set", name, set_names(set))
         end if
      end if
   end subroutine get_items

end module emcon_deck_named
