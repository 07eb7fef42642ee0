!> The registry of contact formulations: one case per formulation.
module emcon_contact_registry
   use emcon_contact, only : contact_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_host_contact, only : host_contact_set_up, host_contact_t
   use emcon_interactions, only : contact_pair_t, formulation_given, formulation_mortar, &
      formulation_segment
   use emcon_midside_plane, only : midside_init
   use emcon_mortar, only : mortar_init, mortar_t
   use emcon_nts, only : nts_init, nts_t
   use emcon_scene, only : scene_t, where_text
   use emcon_segment, only : segment_init, segment_t
   implicit none
   private
   public :: new_contact

contains

   !> The contact of the pair `pair` of `scene`, of those that a program gives a copy of `user`.
   subroutine new_contact(scene, pair, contact, error, user)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      class(contact_t), allocatable, intent(out) :: contact
      type(error_t), allocatable, intent(out) :: error
      class(host_contact_t), intent(in), optional :: user
      type(mortar_t), allocatable :: mortar
      type(nts_t), allocatable :: nts
      type(segment_t), allocatable :: segment

      select case (pair%formulation)
      case (formulation_given)
         call new_given(scene, pair, contact, error, user)
         return
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
   end subroutine new_contact

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

end module emcon_contact_registry
