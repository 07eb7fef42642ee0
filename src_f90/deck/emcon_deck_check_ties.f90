!> The ties, as far as they can be judged by their meshes alone.
module emcon_deck_check_ties
   use emcon_couplings, only : tie_t
   use emcon_deck_check_sides, only : advise_tie
   use emcon_deck_check_surfaces, only : find_common_edges
   use emcon_deck_dimension, only : n_space
   use emcon_deck_reader, only : n_cards, reader_t
   use emcon_diagnostics, only : add_error, add_warning, label_list
   use emcon_kinds, only : wp
   use emcon_name_index, only : name_index_find, name_index_pair, name_index_put, name_index_t
   use emcon_scene, only : scene_t, where_text
   use emcon_sort, only : find_sorted, unique_sorted
   use emcon_surface_facets, only : surface_facets
   use emcon_surface_nodes, only : surface_nodes
   use emcon_tie_maps, only : tie_map_is_given, tie_map_place, tie_map_t
   implicit none
   private
   public :: check_ties

   !> Decks round places: on an axis is what is nearer to it, per extent of the model.
   real(wp), parameter :: near = 1.0e-6_wp

contains

   !> The two surfaces of a tie have no common nodes and are not in contact with each other; no
   !> face is slave in two ties.
   subroutine check_ties(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(name_index_t) :: tied
      integer :: i

      if (size(scene%tie) == 0 .or. reader%doubt%shapes) return
      do i = 1, size(scene%tie)
         if (scene%tie(i)%slave == 0) cycle
         call check_common_nodes(reader, scene, scene%tie(i))
         call check_common_faces(reader, scene, i, tied)
         if (reader%n_dim == n_space .and. reader%log%n_errors == 0) then
            call check_order(reader, scene, scene%tie(i))
         end if
      end do
      if (size(scene%pair) > 0) call check_contact(reader, scene)
   end subroutine check_ties

   !> Warn of a slave that should be the master.
   subroutine check_order(reader, scene, tie)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      character(len=:), allocatable :: advice

      call advise_tie(scene, tie%slave, tie%master, advice)
      if (advice /= "") call add_warning(reader%log, tie%origin, "*TIE: slave surface " // &
         scene%surface(tie%slave)%name // advice)
   end subroutine check_order

   !> Only what is not connected by its nodes can be tied.
   subroutine check_common_nodes(reader, scene, tie)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      integer, allocatable :: slave(:), master(:)
      logical, allocatable :: is_common(:)
      integer :: i

      call surface_nodes(scene, scene%surface(tie%slave), slave)
      call surface_nodes(scene, scene%surface(tie%master), master)
      is_common = [(find_sorted(master, slave(i)) > 0, i = 1, size(slave))]
      ! A sector whose card was not read is not known to have an axis.
      if (n_cards(reader, "CYCLICSYMMETRYMODEL") > 0 .and. reader%log%n_errors > 0) return
      if (tie_map_is_given(tie%map)) is_common = is_common .and. .not. &
         [(is_on_axis(scene, tie%map, slave(i)), i = 1, size(slave))]
      if (any(is_common)) call add_error(reader%log, tie%origin, title(scene, tie) &
         // " share node " // label_list(scene%node%label(pack(slave, is_common))) &
         // "; what is tied must not be connected already: take its faces off the surfaces")
   end subroutine check_common_nodes

   !> Does a map leave a node where it is?
   pure logical function is_on_axis(scene, map, node)
      type(scene_t), intent(in) :: scene
      type(tie_map_t), intent(in) :: map
      integer, intent(in) :: node

      is_on_axis = norm2(tie_map_place(map, scene%x(:, node)) - scene%x(:, node)) &
         <= near*maxval(maxval(scene%x, 2) - minval(scene%x, 2))
   end function is_on_axis

   !> A face that follows two masters is over-constrained.
   subroutine check_common_faces(reader, scene, i_tie, tied)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_tie
      type(name_index_t), intent(inout) :: tied  !! the last tie with the edge as slave
      integer, allocatable :: earlier(:), edge(:, :)
      character(len=:), allocatable :: text
      integer :: i

      associate (slave => scene%surface(scene%tie(i_tie)%slave))
         call surface_facets(scene, slave, edge)
         allocate(earlier(size(edge, 2)), source=0)
         do i = 1, size(earlier)
            if (all(edge(:, i) > 0)) earlier(i) = &
               name_index_find(tied, name_index_pair(edge(1, i), edge(2, i)))
         end do
         do i = 1, size(earlier)
            call name_index_put(tied, name_index_pair(edge(1, i), edge(2, i)), i_tie)
         end do
         if (all(earlier == 0)) return
         if (allocated(slave%edge)) then
            text = ": edges from node " // label_list(scene%node%label(pack(edge(1, :), &
               earlier > 0)))
         else
            text = ": faces of element " // label_list(scene%element%label(pack(slave%element, &
               earlier > 0)))
         end if
         call add_error(reader%log, scene%tie(i_tie)%origin, title(scene, scene%tie(i_tie)) &
            // text // " are slave in tie " // scene%tie(maxval(earlier))%name &
            // " too, at " // where_text(scene, scene%tie(maxval(earlier))%origin) &
            // "; they can follow one master only: one *SURFACE may hold the faces of both masters")
      end associate
   end subroutine check_common_faces

   !> What is tied cannot touch.
   subroutine check_contact(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(name_index_t) :: pair_of
      integer, allocatable :: start(:), surface(:), pair(:)
      integer :: i, k

      do i = 1, size(scene%pair)
         associate (pair => scene%pair(i))
            if (pair%slave == 0 .or. pair%master == 0) cycle
            if (scene%surface(pair%slave)%is_exterior) cycle     ! without what the tie covers
            call name_index_put(pair_of, name_index_pair(pair%slave, pair%master), i)
         end associate
      end do
      call contact_surfaces(scene, start, surface)
      do i = 1, size(scene%tie)
         associate (tie => scene%tie(i))
            if (tie%slave == 0) cycle
            call pairs_of_tie(scene, tie, start, surface, pair_of, pair)
            do k = 1, size(pair)
               call add_error(reader%log, tie%origin, title(scene, tie) // " are also in " &
                  // "contact by *CONTACT PAIR at " // where_text(scene, &
                  scene%pair(pair(k))%origin) // "; take the tied faces off the contact " &
                  // "surfaces, or the tie away")
            end do
         end associate
      end do
   end subroutine check_contact

   !> The surfaces of contact pairs that each node is on.
   pure subroutine contact_surfaces(scene, start, surface)
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: start(:)      !! (n_node + 1) before those of each node
      integer, allocatable, intent(out) :: surface(:)
      integer, allocatable :: used(:), node(:)
      integer :: n(0:size(scene%node%label)), i, pass

      allocate(used, source=unique_sorted([scene%pair%slave, scene%pair%master]))
      n = 0
      do pass = 1, 2
         do i = 1, size(used)
            if (used(i) == 0) cycle
            call surface_nodes(scene, scene%surface(used(i)), node)
            if (pass == 2) surface(n(node - 1) + 1) = used(i)
            if (pass == 1) n(node) = n(node) + 1
            if (pass == 2) n(node - 1) = n(node - 1) + 1
         end do
         if (pass == 2) exit
         allocate(start(size(n)))
         start(1) = 0
         do i = 1, size(n) - 1
            start(i + 1) = start(i) + n(i)
         end do
         allocate(surface(start(size(start))))
         n = start
      end do
   end subroutine contact_surfaces

   !> The contact pairs, ascending, that have faces of both sides of `tie` on their two sides.
   pure subroutine pairs_of_tie(scene, tie, start, surface, pair_of, pair)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      integer, intent(in) :: start(:), surface(:)        !! from `contact_surfaces`
      type(name_index_t), intent(in) :: pair_of          !! pairs by slave and master
      integer, allocatable, intent(out) :: pair(:)
      integer, allocatable :: of_slave(:), of_master(:), found(:)
      integer :: i, k

      call surfaces_with_faces(scene, tie%slave, start, surface, of_slave)
      call surfaces_with_faces(scene, tie%master, start, surface, of_master)
      found = [((name_index_find(pair_of, name_index_pair(of_slave(i), of_master(k))), &
         name_index_find(pair_of, name_index_pair(of_master(k), of_slave(i))), &
         i = 1, size(of_slave)), k = 1, size(of_master))]
      pair = unique_sorted(pack(found, found > 0))
   end subroutine pairs_of_tie

   !> The surfaces in contact that some face of surface `tied` belongs to.
   pure subroutine surfaces_with_faces(scene, tied, start, surface, found)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: tied
      integer, intent(in) :: start(:), surface(:)        !! from `contact_surfaces`
      integer, allocatable, intent(out) :: found(:)
      integer, allocatable :: node(:)
      integer :: i

      call surface_nodes(scene, scene%surface(tied), node)
      found = unique_sorted([(surface(start(node(i)) + 1:start(node(i) + 1)), i = 1, size(node))])
      found = pack(found, [(have_common_face(scene, tied, found(i)), i = 1, size(found))])
   end subroutine surfaces_with_faces

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
