!> Node and element sets: all cards that make or fill them.
module emcon_deck_sets
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, data_warning, &
      get_integer, get_name, is_label, next_line, refuse_lines
   use emcon_deck_labels, only : find_label, label_map_t, label_range
   use emcon_deck_named, only : refuse_name, set_names
   use emcon_deck_reader, only : card_error, card_t, has_option, need_name, option_name, reader_t
   use emcon_diagnostics, only : add_warning, quoted, suggestion
   use emcon_mesh, only : named_set_t
   use emcon_name_index, only : name_index_find, name_index_put, name_index_t
   use emcon_scene, only : scene_t
   use emcon_sort, only : unique_sorted
   use emcon_text, only : to_text
   implicit none
   private
   public :: read_sets

   !> A list that grows by doubling.
   type :: growing_t
      integer :: n = 0
      integer, allocatable :: item(:)
   end type growing_t

   !> The sets of one kind while they grow.
   type :: builder_t
      character(len=7) :: what = ""                !! "node" or "element"
      character(len=5) :: keyword = ""             !! "NSET" or "ELSET", also the parameter
      integer :: n = 0
      type(named_set_t), allocatable :: set(:)     !! names and origins
      type(growing_t), allocatable :: list(:)
      type(name_index_t) :: index_of               !! where in `set` a name is
   end type builder_t

contains

   !> All element sets and node sets, in the order of the deck.
   subroutine read_sets(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      type(builder_t) :: nodes, elements
      type(named_set_t), allocatable :: set(:)

      allocate(reader%line_set(0))
      elements%what = "element"
      elements%keyword = "ELSET"
      call build_sets(reader, elements, "ELEMENT", reader%element_map, reader%doubt%elements, scene)
      call finish(elements, set)
      call part_lines(set, scene%set%element, reader%line_set)
      call index_sets(scene%set%element, reader%names%element_sets)
      call index_sets(reader%line_set, reader%names%line_sets)
      nodes%what = "node"
      nodes%keyword = "NSET"
      call build_sets(reader, nodes, "NODE", reader%node_map, reader%doubt%nodes, scene)
      call finish(nodes, scene%set%node)
      call index_sets(scene%set%node, reader%names%node_sets)
   end subroutine read_sets

   pure subroutine index_sets(set, index_of)
      type(named_set_t), intent(in) :: set(:)
      type(name_index_t), intent(out) :: index_of
      integer :: i

      do i = 1, size(set)
         call name_index_put(index_of, set(i)%name, i)
      end do
   end subroutine index_sets

   !> Lines count below 0: sets of elements keep what is above. A set of lines only is none of
   !> elements.
   subroutine part_lines(set, element_set, line_set)
      type(named_set_t), intent(in) :: set(:)
      type(named_set_t), allocatable, intent(out) :: element_set(:), line_set(:)
      integer :: i, n(2)

      allocate(element_set(size(set)), line_set(size(set)))
      n = 0
      do i = 1, size(set)
         if (any(set(i)%item < 0)) then
            n(2) = n(2) + 1
            line_set(n(2)) = set(i)
            line_set(n(2))%item = -pack(set(i)%item, set(i)%item < 0)
         end if
         if (any(set(i)%item > 0) .or. size(set(i)%item) == 0) then
            n(1) = n(1) + 1
            element_set(n(1)) = set(i)
            element_set(n(1))%item = pack(set(i)%item, set(i)%item > 0)
         end if
      end do
      element_set = element_set(:n(1))
      line_set = line_set(:n(2))
   end subroutine part_lines

   subroutine build_sets(reader, builder, maker, map, is_doubted, scene)
      type(reader_t), intent(inout) :: reader
      type(builder_t), intent(inout) :: builder
      character(len=*), intent(in) :: maker        !! the keyword that defines the items
      type(label_map_t), intent(in) :: map
      logical, intent(in) :: is_doubted            !! labels may be missing after other errors
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable :: name
      integer :: i, k, i_set
      type(card_t) :: card

      allocate(builder%set(8), builder%list(8))
      do i = 1, size(reader%card)
         if (reader%card(i)%name == maker) then
            if (.not. has_option(reader%card(i), trim(builder%keyword))) cycle
         else if (reader%card(i)%name /= builder%keyword) then
            cycle
         end if
         card = reader%card(i)
         call need_name(reader, card, trim(builder%keyword), name)
         if (verify(name, "0123456789") == 0 .and. name /= "") then
            call card_error(reader, card, trim(builder%keyword) // "=" // name // " is a whole " &
               // "number, which elsewhere is the label of one " // trim(builder%what) // &
               "; begin names with a letter")
            reader%doubt%names = .true.
            cycle
         end if
         if (name == "") cycle
         call find_or_add(builder, name, card, i_set)
         if (card%name == maker) then
            do k = card%first_item, card%last_item
               call append(builder%list(i_set), k)
            end do
         else if (card%name == "NSET" .and. has_option(card, "ELSET")) then
            call append_nodes_of(reader, card, scene, builder%list(i_set))
         else if (has_option(card, "GENERATE")) then
            call read_generated(reader, card, builder, i_set, map)
         else
            call read_entries(reader, card, builder, i_set, map, is_doubted)
         end if
      end do
      call warn_of_empty(reader, builder)
   end subroutine build_sets

   !> A set that nothing is in; after an error something may be missing in it.
   subroutine warn_of_empty(reader, builder)
      type(reader_t), intent(inout) :: reader
      type(builder_t), intent(in) :: builder
      integer :: i

      if (reader%log%n_errors > 0) return
      do i = 1, builder%n
         if (builder%list(i)%n == 0) call add_warning(reader%log, builder%set(i)%origin, &
            trim(builder%what) // " set " // quoted(builder%set(i)%name) // " is empty")
      end do
   end subroutine warn_of_empty

   !> *NSET, ELSET=: the nodes of the elements and lines of a set.
   subroutine append_nodes_of(reader, card, scene, list)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(growing_t), intent(inout) :: list
      character(len=:), allocatable :: name
      integer :: i, k, i_set, i_lines

      call need_name(reader, card, "ELSET", name)
      if (has_option(card, "GENERATE")) call card_error(reader, card, &
         "ELSET and GENERATE exclude each other")
      call refuse_lines(reader, card, "with ELSET= ")
      i_set = name_index_find(reader%names%element_sets, name)
      if (i_set > 0) then
         associate (item => scene%set%element(i_set)%item)
            do i = 1, size(item)
               do k = 1, scene%element%kinds(scene%element%kind(item(i)))%n_node
                  if (scene%element%node(k, item(i)) > 0) then
                     call append(list, scene%element%node(k, item(i)))
                  end if
               end do
            end do
         end associate
      end if
      i_lines = name_index_find(reader%names%line_sets, name)
      if (i_lines > 0) then
         associate (item => reader%line_set(i_lines)%item)
            do i = 1, size(item)
               do k = 1, 2
                  if (reader%line_node(k, item(i)) > 0) call append(list, &
                     reader%line_node(k, item(i)))
               end do
            end do
         end associate
      end if
      if (i_set + i_lines > 0 .or. name == "" .or. reader%doubt%names) return
      call card_error(reader, card, "unknown element set " // quoted(name) &
         // suggestion(name, set_names(scene%set%element)))
   end subroutine append_nodes_of

   subroutine find_or_add(builder, name, card, i_set)
      type(builder_t), intent(inout) :: builder
      character(len=*), intent(in) :: name
      type(card_t), intent(in) :: card
      integer, intent(out) :: i_set
      type(named_set_t), allocatable :: set(:)
      type(growing_t), allocatable :: list(:)
      integer :: n

      i_set = name_index_find(builder%index_of, name)
      if (i_set > 0) return
      n = builder%n
      if (n == size(builder%set)) then
         allocate(set(2*n), list(2*n))
         do i_set = 1, n
            call move_alloc(builder%set(i_set)%name, set(i_set)%name)
            set(i_set)%origin = builder%set(i_set)%origin
            list(i_set)%n = builder%list(i_set)%n
            call move_alloc(builder%list(i_set)%item, list(i_set)%item)
         end do
         call move_alloc(set, builder%set)
         call move_alloc(list, builder%list)
      end if
      i_set = n + 1
      builder%n = i_set
      builder%set(i_set)%name = name
      call name_index_put(builder%index_of, name, i_set)
      builder%set(i_set)%origin = card%origin
      allocate(builder%list(i_set)%item(8))
   end subroutine find_or_add

   !> Repeated items are dropped before the list grows: sets of sets of the same items stay small.
   pure subroutine append(list, item)
      type(growing_t), intent(inout) :: list
      integer, intent(in) :: item
      integer, allocatable :: grown(:)

      if (list%n == size(list%item)) then
         if (.not. is_ascending(list)) then
            grown = unique_sorted(list%item)
            list%n = size(grown)
            list%item(:list%n) = grown
            deallocate(grown)
         end if
         if (2*list%n > size(list%item)) then
            allocate(grown(2*size(list%item)))
            grown(:list%n) = list%item(:list%n)
            call move_alloc(grown, list%item)
         end if
      end if
      list%n = list%n + 1
      list%item(list%n) = item
   end subroutine append

   pure logical function is_ascending(list)
      type(growing_t), intent(in) :: list

      is_ascending = all(list%item(2:list%n) > list%item(:list%n - 1))
   end function is_ascending

   !> Data lines of labels and names of sets defined before.
   subroutine read_entries(reader, card, builder, i_set, map, is_doubted)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(builder_t), intent(inout) :: builder
      integer, intent(in) :: i_set
      type(label_map_t), intent(in) :: map
      logical, intent(in) :: is_doubted
      type(data_t) :: data
      integer :: k, j, label, item, other
      character(len=:), allocatable :: name

      call data_open(data, card)
      do while (next_line(reader, data))
         do k = 1, data%n
            if (data%to(k) < data%from(k)) cycle
            data%ok = .true.
            if (is_label(data, k)) then
               call get_integer(reader, data, k, trim(builder%what) // " label", label)
               if (.not. data%ok) cycle
               item = find_label(map, label)
               if (item /= 0) then
                  call append(builder%list(i_set), item)
               else if (.not. is_doubted) then
                  call data_error(reader, data, trim(builder%what) // " " // to_text(label) &
                     // " does not exist")
               end if
            else
               call get_name(reader, data, k, "name", name)
               other = name_index_find(builder%index_of, name)
               if (other == i_set) then
                  if (data%ok) call data_error(reader, data, "the " // trim(builder%what) // &
                     " set " // quoted(name) // " names itself; take the name out")
               else if (other > 0) then
                  do j = 1, builder%list(other)%n
                     call append(builder%list(i_set), builder%list(other)%item(j))
                  end do
               else
                  call refuse_set(reader, data, builder, name)
               end if
            end if
         end do
      end do
   end subroutine read_entries

   !> A set that no card before defines; a card below may.
   subroutine refuse_set(reader, data, builder, name)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(builder_t), intent(in) :: builder
      character(len=*), intent(in) :: name
      integer :: i

      do i = 1, size(reader%card)
         associate (card => reader%card(i))
            if (option_name(card, trim(builder%keyword)) /= name .or. name == "") cycle
            if (all(card%name /= [character(len=7) :: builder%keyword, merge("NODE   ", &
               "ELEMENT", builder%keyword == "NSET")])) cycle
            call data_error(reader, data, trim(builder%what) // " set " // quoted(name) // &
               " is defined below, in line " // to_text(card%origin%line) // &
               "; put it before this card")
         end associate
         return
      end do
      call refuse_name(reader, data, trim(builder%what) // " set", name, &
         set_names(builder%set(:builder%n)))
   end subroutine refuse_set

   !> Data lines `first, last, step`.
   subroutine read_generated(reader, card, builder, i_set, map)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(builder_t), intent(inout) :: builder
      integer, intent(in) :: i_set
      type(label_map_t), intent(in) :: map
      type(data_t) :: data
      integer :: first, last, step, low, high, i, n_found, n_expected

      call data_open(data, card)
      do while (next_line(reader, data))
         call check_count(reader, data, 1, 3, "first, last, step")
         call get_integer(reader, data, 1, "first label", first)
         last = first
         step = 1
         if (data%n > 1) call get_integer(reader, data, 2, "last label", last)
         if (data%n > 2) call get_integer(reader, data, 3, "step", step)
         if (.not. data%ok) cycle
         if (last < first) then
            call data_error(reader, data, "the last label " // to_text(last) &
               // " is below the first, " // to_text(first))
            cycle
         end if
         n_expected = (last - first)/step + 1
         n_found = 0
         call label_range(map, first, last, low, high)
         do i = low, high
            if (mod(map%label(i) - first, step) /= 0) cycle
            call append(builder%list(i_set), map%index(i))
            n_found = n_found + 1
         end do
         if (n_found == n_expected .or. reader%doubt%nodes .or. reader%doubt%elements) cycle
         if (n_found == 0) then
            call data_error(reader, data, "no " // trim(builder%what) // " has any of these labels")
         else
            call data_warning(reader, data, to_text(n_expected - n_found) // " of the " &
               // to_text(n_expected) // " labels are no " // trim(builder%what))
         end if
      end do
   end subroutine read_generated

   subroutine finish(builder, set)
      type(builder_t), intent(inout) :: builder
      type(named_set_t), allocatable, intent(out) :: set(:)
      integer :: i

      set = builder%set(:builder%n)
      do i = 1, builder%n
         associate (list => builder%list(i))
            if (is_ascending(list)) then
               set(i)%item = list%item(:list%n)
            else
               set(i)%item = unique_sorted(list%item(:list%n))
            end if
         end associate
      end do
   end subroutine finish

end module emcon_deck_sets
