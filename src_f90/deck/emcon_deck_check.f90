!> What the scene must fulfil as a whole, and can be seen without mechanics.
module emcon_deck_check
   use emcon_deck_check_massless, only : mark_inertia
   use emcon_deck_check_surfaces, only : mark_nodes
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : add_error, add_warning, label_list
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_steps, only : load_centrifugal, load_gravity, load_point, step_is_dynamic
   use emcon_surface_facets, only : profile_facets
   implicit none
   private
   public :: check_materials, check_nodes

contains

   !> Every element has a section, every section a law, and a density where it is needed.
   subroutine check_materials(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      logical, allocatable :: is_used(:), is_bare(:), has_weight(:), has_inertia(:), resists(:), &
         moves(:)
      integer :: i, k, material
      logical :: needs_mass

      if (reader%doubt%names .or. reader%doubt%elements .or. reader%doubt%rigid) return
      is_bare = scene%element%section == 0
      if (any(is_bare)) then
         i = findloc(is_bare, .true., 1)
         call add_error(reader%log, scene%element%origin(i), "no *SOLID SECTION is " &
            // "given for element " // label_list(pack(scene%element%label, is_bare)))
      end if
      allocate(is_used(size(scene%material)), has_weight(size(scene%material)), source=.false.)
      do i = 1, size(scene%section)
         associate (section => scene%section(i))
            if (section%material == 0) cycle
            is_used(section%material) = .true.
         end associate
      end do
      call mark_inertia(scene, has_inertia)
      call mark_rigid_materials(scene, resists, moves)
      needs_mass = .false.
      do i = 1, size(scene%step)
         needs_mass = needs_mass .or. step_is_dynamic(scene%step(i))
         do k = 1, size(scene%step(i)%load)
            if (all(scene%step(i)%load(k)%kind /= [load_gravity, load_centrifugal])) cycle
            material = scene%element%section(scene%step(i)%load(k)%target)
            if (material > 0) material = scene%section(material)%material
            if (material > 0) has_weight(material) = .true.
         end do
      end do
      do i = 1, size(scene%material)
         if (.not. is_used(i)) cycle
         associate (given => scene%material(i))
            if (given%law == 0 .and. resists(i)) call add_error(reader%log, given%origin, &
               "material " // given%name // " has no law: *ELASTIC, *HYPERELASTIC or *USER " &
               // "MATERIAL is missing")
            if (given%density > 0.0_wp .or. given%density < 0.0_wp) cycle
            if (needs_mass .and. moves(i) .and. has_inertia(i)) then
               call add_error(reader%log, given%origin, "material " // given%name &
                  // " has no density: a dynamic step needs *DENSITY above 0")
            else if (has_weight(i)) then
               call add_error(reader%log, given%origin, "material " // given%name &
                  // " has no density: gravity and CENTRIF need *DENSITY above 0")
            end if
         end associate
      end do
   end subroutine check_materials

   !> Which materials need a law and which a mass: those of rigid bodies alone need none, and no
   !> mass where these are prescribed in every dynamic step.
   pure subroutine mark_rigid_materials(scene, resists, moves)
      type(scene_t), intent(in) :: scene
      logical, allocatable, intent(out) :: resists(:), moves(:)      !! (n_material)
      logical, dimension(size(scene%element%label)) :: is_rigid, is_driven
      integer :: material(size(scene%element%label)), b, i

      is_rigid = .false.
      is_driven = .false.
      do b = 1, size(scene%rigid)
         is_rigid(scene%rigid(b)%element) = .true.
         is_driven(scene%rigid(b)%element) = .true.
         do i = 1, size(scene%step)
            associate (step => scene%step(i))
               if (step_is_dynamic(step) .and. .not. any(step%turn%is_about .and. &
                  step%turn%rigid == b)) is_driven(scene%rigid(b)%element) = .false.
            end associate
         end do
      end do
      material = 0
      do i = 1, size(material)
         if (scene%element%section(i) > 0) material(i) = &
            scene%section(scene%element%section(i))%material
      end do
      allocate(resists(size(scene%material)), moves(size(scene%material)))
      do i = 1, size(resists)
         resists(i) = any(.not. is_rigid .and. material == i) .or. all(material /= i)
         moves(i) = any(.not. is_driven .and. material == i) .or. all(material /= i)
      end do
   end subroutine mark_rigid_materials

   !> Nodes without element have no mass and no stiffness: a warning, an error if a force acts on
   !> them. In the degrees of freedom that stand in an equation they are part of the model, and so
   !> are nodes of *GIVEN FORCES.
   subroutine check_nodes(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      logical, allocatable :: is_bare(:), is_idle(:), is_loaded(:), is_coupled(:, :)
      integer, allocatable :: profile(:, :)
      integer :: i, k

      if (reader%doubt%nodes .or. reader%doubt%elements .or. reader%doubt%positions &
         .or. reader%doubt%equations .or. reader%doubt%rigid) return
      if (any(scene%element%node(1, :) == 0)) return
      allocate(is_bare(size(scene%node%label)), source=.true.)
      do i = 1, size(scene%element%label)
         do k = 1, scene%element%kinds(scene%element%kind(i))%n_node
            is_bare(scene%element%node(k, i)) = .false.
         end do
      end do
      if (allocated(scene%host%node)) is_bare(scene%host%node) = .false.
      do i = 1, size(scene%rigid)
         is_bare(scene%rigid(i)%node) = .false.
         if (allocated(scene%rigid(i)%arm)) is_bare(scene%rigid(i)%arm) = .false.
      end do
      is_bare(pack(scene%rigid%turning, scene%rigid%turning > 0)) = .false.
      call profile_facets(scene, profile)
      is_bare([profile]) = .false.
      is_bare(pack(scene%surface%inner_node, scene%surface%inner_node > 0)) = .false.
      do i = 1, size(scene%surface)
         if (allocated(scene%surface(i)%wall)) is_bare(scene%surface(i)%node) = .false.
      end do
      if (.not. any(is_bare) .or. all(is_bare)) return
      call mark_coupled(scene, 0, is_coupled)
      is_idle = is_bare .and. .not. any(is_coupled, 1)
      if (any(is_idle)) call add_warning(reader%log, scene%node%origin(findloc(is_idle, .true., &
         1)), "node " // label_list(pack(scene%node%label, is_idle)) &
         // " belongs to no element; it is left out")
      call mark_loaded(scene, is_loaded)
      call tell_bare(is_loaded .and. is_idle, "but *CLOAD acts on it")
      call tell_bare(is_loaded .and. is_bare .and. .not. is_idle, &
         "but *CLOAD acts on it in a direction that is in no *EQUATION")
      is_loaded = .false.
      call mark_nodes(scene, scene%pair%slave, is_loaded)
      call tell_bare(is_loaded .and. is_bare, "but is a slave node of *CONTACT PAIR")
      is_bare = is_bare .and. .not. is_loaded
      call mark_nodes(scene, [scene%pair%master, scene%tie%slave, scene%tie%master], is_loaded)
      call tell_bare(is_loaded .and. is_bare, &
         "but is a node of a surface in *CONTACT PAIR or *TIE")

   contains

      subroutine tell_bare(is_wrong, text)
         logical, intent(in) :: is_wrong(:)
         character(len=*), intent(in) :: text

         if (any(is_wrong)) call add_error(reader%log, scene%node%origin(findloc(is_wrong, &
            .true., 1)), "node " // label_list(pack(scene%node%label, is_wrong)) // " belongs to " &
            // "no element, " // text)
      end subroutine tell_bare

   end subroutine check_nodes

   !> The nodes on which a force acts in a direction that is not coupled in its step.
   pure subroutine mark_loaded(scene, is_loaded)
      type(scene_t), intent(in) :: scene
      logical, allocatable, intent(out) :: is_loaded(:)          !! (n_node)
      logical, allocatable :: is_coupled(:, :)
      integer :: i, k

      allocate(is_loaded(size(scene%node%label)), source=.false.)
      do i = 1, size(scene%step)
         if (.not. any(scene%step(i)%load%kind == load_point)) cycle
         call mark_coupled(scene, i, is_coupled)
         associate (load => scene%step(i)%load)
            do k = 1, size(load)
               if (load(k)%kind /= load_point .or. .not. abs(load(k)%value) > 0.0_wp) cycle
               if (.not. is_coupled(load(k)%place, load(k)%target)) then
                  is_loaded(load(k)%target) = .true.
               end if
            end do
         end associate
      end do
   end subroutine mark_loaded

   !> The degrees of freedom that stand in equations of a step, or move a rigid body.
   pure subroutine mark_coupled(scene, i_step, is_coupled)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step                              !! 0: equations of all steps
      logical, allocatable, intent(out) :: is_coupled(:, :)      !! (n_dim, n_node)
      integer :: i, k

      allocate(is_coupled(scene%n_dim, size(scene%node%label)), source=.false.)
      do i = 1, size(scene%equation)
         associate (equation => scene%equation(i))
            if (equation%last_step < i_step) cycle
            do k = 1, size(equation%node)
               is_coupled(equation%dof(k), equation%node(k)) = .true.
            end do
         end associate
      end do
      is_coupled(:, scene%rigid%reference) = .true.
      is_coupled(:, pack(scene%tie%map%reference, scene%tie%map%reference > 0)) = .true.
   end subroutine mark_coupled

end module emcon_deck_check
