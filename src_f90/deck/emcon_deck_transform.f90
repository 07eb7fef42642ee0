!> *TRANSFORM: nodes whose degrees of freedom are along axes of their own.
module emcon_deck_transform
   use emcon_deck_dimension, only : n_plane, n_space
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, get_real, next_line
   use emcon_deck_named, only : hint_at_set, set_names
   use emcon_deck_reader, only : card_error, card_t, need_name, option_word, reader_t
   use emcon_diagnostics, only : label_list, quoted
   use emcon_kinds, only : wp
   use emcon_name_index, only : name_index_find
   use emcon_origin, only : origin_t
   use emcon_scene, only : scene_t, where_text
   use emcon_scene_motions, only : scene_is_flat
   use emcon_turned_axes, only : cylindrical_axes, rectangular_axes, turned_axes_t
   implicit none
   private
   public :: read_transforms

   !> Axes of two cards that differ by less are the same.
   real(wp), parameter :: same_axes = sqrt(epsilon(1.0_wp))

   !> What a card says.
   type :: system_t
      type(origin_t) :: origin
      logical :: is_cylindrical = .false.
      real(wp) :: a(n_space) = 0.0_wp, b(n_space) = 0.0_wp           !! points [L]
      real(wp) :: axes(n_space, n_space) = 0.0_wp                    !! at the point a
      integer, allocatable :: node(:)                                !! of its set
   end type system_t

   !> The axes while they grow.
   type :: list_t
      integer :: n = 0
      integer, allocatable :: mark(:)                                !! (n_node) place, 0: none
      type(turned_axes_t), allocatable :: item(:)
   end type list_t

contains

   !> All *TRANSFORM cards: the axes of their nodes.
   subroutine read_transforms(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      type(list_t) :: list
      type(system_t) :: system
      integer :: other(size(scene%node%label)), i, k

      associate (n_node => size(scene%node%label))
         allocate(list%mark(n_node), source=0)
         allocate(list%item(n_node))
      end associate
      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "TRANSFORM") cycle
         call read_system(reader, reader%card(i), scene, system)
         if (.not. allocated(system%node)) cycle
         other = 0
         do k = 1, size(system%node)
            call add_node(scene, system, system%node(k), list, other(k))
         end do
         call tell_others(reader, reader%card(i), scene, list, other)
      end do
      scene%node%turned = list%item(:list%n)
   end subroutine read_transforms

   !> Set and points of a card; without nodes if it is wrong.
   subroutine read_system(reader, card, scene, system)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(system_t), intent(out) :: system
      character(len=:), allocatable :: name, word, hint
      type(data_t) :: data
      integer :: i

      system%origin = card%origin
      call option_word(reader, card, "TYPE", "R, C", word, "S", "a sphere is best cut into parts " &
         // "with rectangular axes, TYPE=R, of their own")
      if (word == "") return
      system%is_cylindrical = word == "C"
      call data_open(data, card)
      if (.not. next_line(reader, data)) then
         call card_error(reader, card, "the line with the two points is missing: " &
            // "ax, ay, az, bx, by, bz")
         return
      end if
      call read_points(reader, data, scene, system)
      call need_name(reader, card, "NSET", name)
      if (name == "" .or. .not. data%ok) return
      if (next_line(reader, data)) call data_error(reader, data, "only one data line is read")
      i = name_index_find(reader%names%node_sets, name)
      if (i > 0) then
         system%node = scene%set%node(i)%item
      else if (.not. reader%doubt%names) then
         call hint_at_set(reader, "node set", name, set_names(scene%set%node), hint)
         call card_error(reader, card, "unknown node set " // quoted(name) // hint)
      end if
   end subroutine read_system

   !> The two points, and the axes that all nodes share.
   subroutine read_points(reader, data, scene, system)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      type(system_t), intent(inout) :: system
      real(wp) :: point(2*n_space)
      character(len=:), allocatable :: fault
      logical :: is_central
      integer :: k

      point = 0.0_wp
      call check_count(reader, data, 1, 2*n_space, "ax, ay, az, bx, by, bz")
      do k = 1, size(point)
         if (data%ok) call get_real(reader, data, k, "coordinate", point(k))
      end do
      if (.not. data%ok) return
      system%a = point(:n_space)
      system%b = point(n_space + 1:)
      fault = ""
      if (.not. system%is_cylindrical) then
         call rectangular_axes(system%a, system%b, system%axes, fault)
      else if (scene%n_dim == n_plane .and. .not. scene_is_flat(scene)) then
         fault = "x is the radius and y the axis already with elements CAX; leave *TRANSFORM out"
      else if (.not. norm2(system%b - system%a) > 0.0_wp) then
         fault = "the axis has no length: the two points are the same"
      else
         call cylindrical_axes(system%a, system%b, system%a, system%axes, is_central)
      end if
      if (fault == "" .and. scene%n_dim == n_plane .and. .not. abs(system%axes(n_space, n_space)) &
         >= 1.0_wp) fault = "the model is plane: the third axis has to be normal to it, as with " &
         // trim(merge("0, 0, 0, 0, 0, 1 ", "1, 1, 0, -1, 1, 0", system%is_cylindrical))
      if (fault /= "") call data_error(reader, data, fault)
   end subroutine read_points

   !> `node` gets the axes of a card.
   subroutine add_node(scene, system, node, list, other)
      type(scene_t), intent(in) :: scene
      type(system_t), intent(in) :: system
      integer, intent(in) :: node
      type(list_t), intent(inout) :: list
      integer, intent(out) :: other                  !! its place, if it has other axes; 0: no
      type(turned_axes_t) :: new
      real(wp) :: x(n_space)

      x = 0.0_wp
      x(:scene%n_dim) = scene%x(:, node)
      new%origin = system%origin
      new%node = node
      new%axes = system%axes
      other = 0
      if (system%is_cylindrical) call cylindrical_axes(system%a, system%b, x, new%axes, &
         new%is_central)
      if (list%mark(node) == 0) then
         list%n = list%n + 1
         list%item(list%n) = new
         list%mark(node) = list%n
      else if (any(abs(list%item(list%mark(node))%axes - new%axes) > same_axes)) then
         other = list%mark(node)
      end if
   end subroutine add_node

   !> Nodes that have other axes by an earlier card.
   subroutine tell_others(reader, card, scene, list, other)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(list_t), intent(in) :: list
      integer, intent(in) :: other(:)                !! their places in the list, 0: none

      if (.not. any(other > 0)) return
      associate (found => list%item(pack(other, other > 0)))
         call card_error(reader, card, "node " // label_list(scene%node%label(found%node)) // &
            " has other axes already, by the card at " // where_text(scene, found(1)%origin) // &
            "; take it out of one of the two sets")
      end associate
   end subroutine tell_others

end module emcon_deck_transform
