!> The registry of contact formulations, and of what measures gaps before the first step: what
!> others see of it. Which kinds there are is known to `emcon_contact_kinds` alone.
module emcon_contact_registry
   use emcon_contact, only : contact_t
   use emcon_errors, only : error_t
   use emcon_host_contact, only : host_contact_t
   use emcon_interactions, only : contact_options_t, contact_pair_t
   use emcon_scene, only : scene_t
   use emcon_start_gaps, only : start_gaps_t
   implicit none
   private
   public :: new_contact, new_start_gaps

   interface
      !> The contact of the pair `pair` of `scene`, of those that a program gives a copy of `user`.
      module subroutine new_contact(scene, pair, contact, error, user)
         type(scene_t), intent(in) :: scene
         type(contact_pair_t), intent(in) :: pair
         class(contact_t), allocatable, intent(out) :: contact
         type(error_t), allocatable, intent(out) :: error
         class(host_contact_t), intent(in), optional :: user
      end subroutine new_contact

      !> The gaps of the pair `pair` of `scene` before the first step, whose master is smoothed if
      !> `options` say so.
      module subroutine new_start_gaps(scene, pair, gaps, error, options)
         type(scene_t), intent(in) :: scene
         type(contact_pair_t), intent(in) :: pair
         class(start_gaps_t), allocatable, intent(out) :: gaps
         type(error_t), allocatable, intent(out) :: error
         type(contact_options_t), intent(in), optional :: options
      end subroutine new_start_gaps
   end interface

end module emcon_contact_registry
