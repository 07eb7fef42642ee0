!> What the scene must fulfil as a whole, and can be seen without mechanics.
module emcon_deck_check
   use emcon_deck_reader, only : reader_t
   use emcon_deck_surfaces, only : adjacency_init, adjacency_t, n_neighbours
   use emcon_diagnostics, only : add_error, add_warning, label_list
   use emcon_element_kinds, only : element_kinds
   use emcon_kinds, only : wp
   use emcon_scene, only : contact_pair_t, load_gravity, load_point, procedure_dynamic, scene_t, &
      surface_t
   implicit none
   private
   public :: check_materials, check_nodes, check_pairs

contains

   !> Every element has a section, every section a law, and a density where it is needed.
   subroutine check_materials(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      logical, allocatable :: is_used(:), is_bare(:), has_weight(:)
      integer :: i, k, material
      logical :: is_dynamic

      if (reader%doubt_names .or. reader%doubt_elements) return
      is_bare = scene%element_section == 0
      if (any(is_bare)) then
         i = first_true(is_bare)
         call add_error(reader%log, scene%element_origin(i), "element " &
            // label_list(pack(scene%element_label, is_bare)) &
            // " has no section; give one by *SOLID SECTION")
      end if
      allocate(is_used(size(scene%material)), has_weight(size(scene%material)), source=.false.)
      do i = 1, size(scene%section)
         if (scene%section(i)%material > 0) is_used(scene%section(i)%material) = .true.
      end do
      is_dynamic = .false.
      do i = 1, size(scene%step)
         is_dynamic = is_dynamic .or. scene%step(i)%procedure == procedure_dynamic
         do k = 1, size(scene%step(i)%load)
            if (scene%step(i)%load(k)%kind /= load_gravity) cycle
            material = scene%element_section(scene%step(i)%load(k)%target)
            if (material > 0) material = scene%section(material)%material
            if (material > 0) has_weight(material) = .true.
         end do
      end do
      do i = 1, size(scene%material)
         if (.not. is_used(i)) cycle
         associate (given => scene%material(i))
            if (given%law == 0) call add_error(reader%log, given%origin, "material " &
               // given%name // " has no law: *ELASTIC or *HYPERELASTIC is missing")
            if (given%density > 0.0_wp .or. given%density < 0.0_wp) cycle
            if (is_dynamic) then
               call add_error(reader%log, given%origin, "material " // given%name &
                  // " has no density: a dynamic step needs *DENSITY above 0")
            else if (has_weight(i)) then
               call add_error(reader%log, given%origin, "material " // given%name &
                  // " has no density: gravity needs *DENSITY above 0")
            end if
         end associate
      end do
   end subroutine check_materials

   pure integer function first_true(list)
      logical, intent(in) :: list(:)

      do first_true = 1, size(list)
         if (list(first_true)) return
      end do
   end function first_true

   !> Nodes without element have no mass and no stiffness: a warning, an error if a force acts on
   !> them.
   subroutine check_nodes(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      logical, allocatable :: is_bare(:), is_loaded(:)
      integer :: i, k

      if (reader%doubt_nodes .or. reader%doubt_elements .or. reader%doubt_positions) return
      if (any(scene%element_node(1, :) == 0)) return
      allocate(is_bare(size(scene%node_label)), source=.true.)
      do i = 1, size(scene%element_label)
         do k = 1, element_kinds(scene%element_kind(i))%n_node
            is_bare(scene%element_node(k, i)) = .false.
         end do
      end do
      if (.not. any(is_bare) .or. all(is_bare)) return
      call add_warning(reader%log, scene%node_origin(first_true(is_bare)), "node " &
         // label_list(pack(scene%node_label, is_bare)) // " belongs to no element; it is left out")
      allocate(is_loaded(size(is_bare)), source=.false.)
      do i = 1, size(scene%step)
         associate (load => scene%step(i)%load)
            do k = 1, size(load)
               if (load(k)%kind == load_point .and. abs(load(k)%value) > 0.0_wp) then
                  is_loaded(load(k)%target) = .true.
               end if
            end do
         end associate
      end do
      is_loaded = is_loaded .and. is_bare
      if (any(is_loaded)) call add_error(reader%log, scene%node_origin(first_true(is_loaded)), &
         "node " // label_list(pack(scene%node_label, is_loaded)) &
         // " belongs to no element, but *CLOAD acts on it")
      is_loaded = .false.
      do i = 1, size(scene%pair)
         if (scene%pair(i)%slave > 0) call mark_nodes(scene, scene%surface(scene%pair(i)%slave), &
            is_loaded)
      end do
      is_loaded = is_loaded .and. is_bare
      if (any(is_loaded)) call add_error(reader%log, scene%node_origin(first_true(is_loaded)), &
         "node " // label_list(pack(scene%node_label, is_loaded)) &
         // " belongs to no element, but is a slave node of *CONTACT PAIR")
   end subroutine check_nodes

   !> Mark the nodes of a surface.
   pure subroutine mark_nodes(scene, surface, is_in)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      logical, intent(inout) :: is_in(:)           !! (n_node)
      integer :: i, node(2)

      is_in(surface%node) = .true.
      do i = 1, size(surface%element)
         node = face_nodes(scene, surface%element(i), surface%face(i))
         if (all(node > 0)) is_in(node) = .true.
      end do
   end subroutine mark_nodes

   !> First and last node of a face, along the boundary; 0 if the element had errors.
   pure function face_nodes(scene, element, face) result(node)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: element, face
      integer :: node(2)

      node = scene%element_node( &
         element_kinds(scene%element_kind(element))%face_node(:, face), element)
   end function face_nodes

   !> The surfaces of contact pairs: chains of free faces, without common nodes, free to move.
   subroutine check_pairs(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(adjacency_t) :: adjacency
      logical, allocatable :: is_checked(:)
      integer :: i, side, surface

      if (size(scene%pair) == 0 .or. reader%doubt_shapes) return
      call adjacency_init(adjacency, scene)
      allocate(is_checked(size(scene%surface)), source=.false.)
      do i = 1, size(scene%pair)
         do side = 1, 2
            surface = merge(scene%pair(i)%slave, scene%pair(i)%master, side == 1)
            if (surface == 0) cycle
            if (is_checked(surface)) cycle
            is_checked(surface) = .true.
            call check_free(reader, scene, adjacency, scene%surface(surface))
            call check_chain(reader, scene, scene%surface(surface))
         end do
         if (scene%pair(i)%slave == 0 .or. scene%pair(i)%master == 0) cycle
         call check_slave_nodes(reader, scene, scene%pair(i))
      end do
   end subroutine check_pairs

   !> A face between two elements cannot touch anything.
   subroutine check_free(reader, scene, adjacency, surface)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(adjacency_t), intent(in) :: adjacency
      type(surface_t), intent(in) :: surface
      logical :: is_inside(size(surface%element))
      integer :: i

      do i = 1, size(is_inside)
         is_inside(i) = n_neighbours(scene, adjacency, surface%element(i), surface%face(i)) > 0
      end do
      if (any(is_inside)) call add_error(reader%log, surface%origin, "contact surface " &
         // surface%name // " has faces inside the body, of element " &
         // label_list(scene%element_label(pack(surface%element, is_inside))))
   end subroutine check_free

   !> At each node one face may end and one may begin.
   subroutine check_chain(reader, scene, surface)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, allocatable :: n_end(:, :)
      logical, allocatable :: is_branch(:)
      integer :: i, k, node(2)

      allocate(n_end(2, size(scene%node_label)), source=0)
      do i = 1, size(surface%element)
         node = face_nodes(scene, surface%element(i), surface%face(i))
         if (any(node == 0)) return
         do k = 1, 2
            n_end(k, node(k)) = n_end(k, node(k)) + 1
         end do
      end do
      is_branch = n_end(1, :) > 1 .or. n_end(2, :) > 1
      if (any(is_branch)) call add_error(reader%log, surface%origin, "contact surface " &
         // surface%name // " is no chain of faces: more than two of them meet at node " &
         // label_list(pack(scene%node_label, is_branch)))
   end subroutine check_chain

   !> Slave nodes must not be master nodes, and must be able to follow the master.
   subroutine check_slave_nodes(reader, scene, pair)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      logical, allocatable :: is_slave(:), is_master(:), is_held(:), is_guided(:)
      integer, allocatable :: n_prescribed(:)
      integer :: i, k

      allocate(is_slave(size(scene%node_label)), is_master(size(scene%node_label)), &
         is_held(size(scene%node_label)), is_guided(size(scene%node_label)), source=.false.)
      call mark_nodes(scene, scene%surface(pair%slave), is_slave)
      call mark_nodes(scene, scene%surface(pair%master), is_master)
      if (any(is_slave .and. is_master)) then
         call add_error(reader%log, pair%origin, "*CONTACT PAIR: slave surface " &
            // scene%surface(pair%slave)%name // " and master surface " &
            // scene%surface(pair%master)%name // " share node " &
            // label_list(pack(scene%node_label, is_slave .and. is_master)))
      end if
      allocate(n_prescribed(size(scene%node_label)))
      do i = 1, size(scene%step)
         n_prescribed = 0
         associate (prescribed => scene%step(i)%prescribed)
            do k = 1, size(prescribed)
               n_prescribed(prescribed(k)%node) = n_prescribed(prescribed(k)%node) + 1
            end do
         end associate
         is_held = is_held .or. (is_slave .and. n_prescribed == scene%n_dim)
         is_guided = is_guided .or. (is_slave .and. n_prescribed > 0)
      end do
      if (any(is_held)) call add_error(reader%log, pair%origin, "*CONTACT PAIR: slave node " &
         // label_list(pack(scene%node_label, is_held)) // " of surface " &
         // scene%surface(pair%slave)%name // " is over-constrained: all its degrees of freedom " &
         // "are prescribed, it cannot follow the master; take it off the surface")
      is_guided = is_guided .and. .not. is_held
      if (any(is_guided)) call add_warning(reader%log, pair%origin, "*CONTACT PAIR: slave node " &
         // label_list(pack(scene%node_label, is_guided)) // " of surface " &
         // scene%surface(pair%slave)%name // " is prescribed in one direction: contact moves it " &
         // "in the other one only, and is singular where the master faces along the first")
   end subroutine check_slave_nodes

end module emcon_deck_check
