!> The registry of contact formulations: what others see of it. Which kinds there are is known to
!> `emcon_contact_kinds` alone.
module emcon_contact_registry
   use emcon_contact, only : contact_t
   use emcon_errors, only : error_t
   use emcon_host_contact, only : host_contact_t
   use emcon_interactions, only : contact_pair_t
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: new_contact

   interface
      !> The contact of the pair `pair` of `scene`, of those that a program gives a copy of `user`.
      module subroutine new_contact(scene, pair, contact, error, user)
         type(scene_t), intent(in) :: scene
         type(contact_pair_t), intent(in) :: pair
         class(contact_t), allocatable, intent(out) :: contact
         type(error_t), allocatable, intent(out) :: error
         class(host_contact_t), intent(in), optional :: user
      end subroutine new_contact
   end interface

end module emcon_contact_registry
