!> The contact formulations: one case each.
submodule (emcon_contact_registry) emcon_contact_kinds
   use emcon_edge_contact_space, only : edge_contact_init, edge_contact_t
   use emcon_errors, only : err_input, raise
   use emcon_host_contact, only : host_contact_set_up
   use emcon_interactions, only : formulation_edges, formulation_mortar, &
      formulation_segment, formulation_user
   use emcon_midside_plane, only : midside_init
   use emcon_mortar, only : mortar_init, mortar_t
   use emcon_mortar_space, only : mortar_space_init, mortar_space_t
   use emcon_mortar_wall_space, only : mortar_wall_init, mortar_wall_t
   use emcon_nts, only : nts_init, nts_t
   use emcon_patch_contact_space, only : patch_contact_init, patch_contact_t
   use emcon_scene, only : where_text
   use emcon_segment, only : segment_init, segment_t
   use emcon_start_gaps_plane, only : start_gaps_plane_init, start_gaps_plane_t
   use emcon_start_gaps_space, only : start_gaps_space_init, start_gaps_space_t
   use emcon_start_gaps_wall_space, only : start_gaps_wall_init, start_gaps_wall_t
   use emcon_wall_contact_space, only : wall_contact_init, wall_contact_t
   implicit none

   integer, parameter :: n_space = 3

contains

   module procedure new_contact
      type(mortar_t), allocatable :: mortar
      type(mortar_space_t), allocatable :: mortar_space
      type(nts_t), allocatable :: nts
      type(segment_t), allocatable :: segment
      type(patch_contact_t), allocatable :: patch
      type(edge_contact_t), allocatable :: edges

      select case (pair%formulation)
      case (formulation_user)
         call new_given(scene, pair, contact, error, user)
         return
      case (formulation_edges)
         allocate(edges)
         call edge_contact_init(edges, scene, pair)
         call move_alloc(edges, contact)
         return
      end select
      if (allocated(scene%surface(pair%master)%wall)) then
         call new_on_wall(scene, pair, contact, error)
         return
      end if
      if (scene%n_dim == n_space .and. pair%formulation == formulation_mortar) then
         allocate(mortar_space)
         call mortar_space_init(mortar_space, scene, pair, error)
         call move_alloc(mortar_space, contact)
         return
      else if (scene%n_dim == n_space) then
         allocate(patch)
         call patch_contact_init(patch, scene, pair, error)
         call move_alloc(patch, contact)
         return
      end if
      select case (pair%formulation)
      case (formulation_mortar)
         allocate(mortar)
         call mortar_init(mortar, scene, pair, error)
         call move_alloc(mortar, contact)
      case (formulation_segment)
         allocate(segment)
         call segment_init(segment, scene, pair, error)
         call move_alloc(segment, contact)
      case default
         allocate(nts)
         call nts_init(nts, scene, pair, error)
         call move_alloc(nts, contact)
      end select
      if (allocated(error)) return
      call midside_init(contact%midside, scene, [pair%slave, pair%master])
   end procedure new_contact

   module procedure new_start_gaps
      type(start_gaps_plane_t), allocatable :: plane
      type(start_gaps_space_t), allocatable :: space
      type(start_gaps_wall_t), allocatable :: wall

      if (allocated(scene%surface(pair%master)%wall)) then
         allocate(wall)
         call start_gaps_wall_init(wall, scene, pair, error)
         call move_alloc(wall, gaps)
         return
      end if
      if (scene%n_dim == n_space) then
         allocate(space)
         call start_gaps_space_init(space, scene, pair, error)
         call move_alloc(space, gaps)
         return
      end if
      allocate(plane)
      call start_gaps_plane_init(plane, scene, pair, error, options)
      call move_alloc(plane, gaps)
   end procedure new_start_gaps

   !> The contact of a pair whose master is a wall.
   subroutine new_on_wall(scene, pair, contact, error)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      class(contact_t), allocatable, intent(out) :: contact
      type(error_t), allocatable, intent(out) :: error
      type(mortar_wall_t), allocatable :: mortar
      type(wall_contact_t), allocatable :: nodes

      if (pair%formulation == formulation_mortar) then
         allocate(mortar)
         call mortar_wall_init(mortar, scene, pair, error)
         call move_alloc(mortar, contact)
         return
      end if
      allocate(nodes)
      call wall_contact_init(nodes, scene, pair, error)
      call move_alloc(nodes, contact)
   end subroutine new_on_wall

   !> The contact that a program gives for a pair.
   subroutine new_given(scene, pair, contact, error, user)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      class(contact_t), allocatable, intent(out) :: contact
      type(error_t), allocatable, intent(out) :: error
      class(host_contact_t), intent(in), optional :: user
      class(host_contact_t), allocatable :: own
      character(len=:), allocatable :: fault

      if (.not. present(user)) then
         fault = "no program has given this contact, see docs/embedding.md"
      else
         allocate(own, source=user)
         call host_contact_set_up(own, scene, pair, error)
         if (allocated(error)) fault = error%message
         call move_alloc(own, contact)
      end if
      if (allocated(fault)) call raise(error, err_input, where_text(scene, pair%origin) // &
         ": error: *CONTACT PAIR, TYPE=USER of surfaces " // scene%surface(pair%slave)%name // &
         " and " // scene%surface(pair%master)%name // ": " // fault)
   end subroutine new_given

end submodule emcon_contact_kinds
