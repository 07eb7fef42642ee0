!> Which surfaces of contact can lose their mass, as far as the scene alone tells.
!>
!> Source: docs/theory.md, section 6.4.
module emcon_massless_surfaces
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_steps, only : initiation_massless, initiation_persistent, prescribed_rests, &
      step_initiation, step_is_dynamic
   use emcon_surface_nodes, only : surface_nodes
   implicit none
   private
   public :: most_moved, pair_keeps_mass, pair_sheds_mass, surface_keeps_mass, nodes_that_keep_mass

   !> Where the program chooses, surfaces lose their mass if no body has more of its own at them:
   !> rebounds would be off by percents. Source: docs/trade.md, section "First contact".
   real(wp), parameter :: most_moved = 0.2_wp

contains

   !> Do both surfaces of a pair keep their mass? With damping what has none would jump to where it
   !> rests; rebounds along the surface, and along the normal beside friction, are impulses.
   pure logical function pair_keeps_mass(pair)
      type(contact_pair_t), intent(in) :: pair

      associate (law => pair%interaction)
         pair_keeps_mass = law%damping%coefficient > 0.0_wp .or. (law%friction > 0.0_wp .and. &
            (law%rebound > 0.0_wp .or. law%restitution < 1.0_wp))
      end associate
   end function pair_keeps_mass

   !> Are the slave nodes of `pair` to lose their mass in some step?
   pure logical function pair_sheds_mass(scene, pair)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair

      pair_sheds_mass = any(step_initiation(scene%step) == initiation_massless) .and. .not. &
         (pair%initiation == initiation_persistent .or. pair_keeps_mass(pair))
   end function pair_sheds_mass

   !> Do all nodes of a surface keep their mass?
   pure logical function surface_keeps_mass(scene, surface)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: surface               !! its number
      integer, allocatable :: node(:)
      logical :: keeps(size(scene%node%label))

      call surface_nodes(scene, scene%surface(surface), node)
      keeps = nodes_that_keep_mass(scene)
      surface_keeps_mass = all(keeps(node))
   end function surface_keeps_mass

   !> Nodes of rigid bodies, those that are driven in some direction in a dynamic step, and those
   !> that rest there in all. What rests in some direction, as on a line of symmetry, moves in the
   !> others as free nodes do.
   pure function nodes_that_keep_mass(scene) result(keeps)
      type(scene_t), intent(in) :: scene
      logical :: keeps(size(scene%node%label))   !! (n_node)
      integer :: n_rest(size(scene%node%label)), i, k

      keeps = .false.
      do i = 1, size(scene%rigid)
         keeps(scene%rigid(i)%node) = .true.
      end do
      do i = 1, size(scene%step)
         if (.not. step_is_dynamic(scene%step(i))) cycle
         n_rest = 0
         do k = 1, size(scene%step(i)%prescribed)
            associate (prescribed => scene%step(i)%prescribed(k))
               n_rest(prescribed%node) = n_rest(prescribed%node) + 1
               if (.not. prescribed_rests(prescribed)) keeps(prescribed%node) = .true.
            end associate
         end do
         keeps = keeps .or. n_rest == scene%n_dim
      end do
   end function nodes_that_keep_mass

end module emcon_massless_surfaces
