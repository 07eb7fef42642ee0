!> The registry of contact formulations: one case per formulation.
module emcon_contact_registry
   use emcon_contact, only : contact_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_pair_t, formulation_mortar, formulation_segment
   use emcon_midside_plane, only : midside_init
   use emcon_mortar, only : mortar_init, mortar_t
   use emcon_nts, only : nts_init, nts_t
   use emcon_scene, only : scene_t
   use emcon_segment, only : segment_init, segment_t
   implicit none
   private
   public :: new_contact

contains

   !> The contact of the pair `pair` of `scene`.
   subroutine new_contact(scene, pair, contact, error)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      class(contact_t), allocatable, intent(out) :: contact
      type(error_t), allocatable, intent(out) :: error
      type(mortar_t), allocatable :: mortar
      type(nts_t), allocatable :: nts
      type(segment_t), allocatable :: segment

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
      call midside_init(contact%midside, scene, [pair%slave, pair%master])
   end subroutine new_contact

end module emcon_contact_registry
