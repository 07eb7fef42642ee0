!> Which surfaces of contact can lose their mass, as far as the scene alone tells.
!>
!> Source: docs/theory.md, section 6.4.
module emcon_massless_surfaces
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_steps, only : initiation_massless, initiation_persistent, step_initiation, &
      step_is_dynamic
   use emcon_surface_nodes, only : surface_nodes
   implicit none
   private
   public :: pair_sheds_mass, surface_keeps_mass

contains

   !> Are the slave nodes of `pair` to lose their mass in some step? Where they rub or are damped
   !> they keep it.
   pure logical function pair_sheds_mass(scene, pair)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair

      pair_sheds_mass = any(step_initiation(scene%step) == initiation_massless) .and. .not. &
         (pair%initiation == initiation_persistent .or. pair%interaction%friction > 0.0_wp .or. &
         pair%interaction%damping%coefficient > 0.0_wp)
   end function pair_sheds_mass

   !> Is each node of a surface of a rigid body, or prescribed in a dynamic step?
   pure logical function surface_keeps_mass(scene, surface)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: surface               !! its number
      integer, allocatable :: node(:)
      logical :: keeps(size(scene%node%label))
      integer :: i

      keeps = .false.
      do i = 1, size(scene%rigid)
         keeps(scene%rigid(i)%node) = .true.
      end do
      do i = 1, size(scene%step)
         if (step_is_dynamic(scene%step(i))) keeps(scene%step(i)%prescribed%node) = .true.
      end do
      call surface_nodes(scene, scene%surface(surface), node)
      surface_keeps_mass = all(keeps(node))
   end function surface_keeps_mass

end module emcon_massless_surfaces
