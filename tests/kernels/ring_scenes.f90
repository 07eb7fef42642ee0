!> Quarters of rings in each other, for the tests: chords of circles whose nodes do not meet.
module ring_scenes
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use small_scenes, only : add_block, add_surface, block_t, bottom, scene_begin, top
   implicit none
   private
   public :: make_rings

   real(wp), parameter :: quarter = acos(0.0_wp)

contains

   !> A hub, radii 1 to 2 + `more`, in a sleeve, radii 2 to 3, of `n` elements around: nodes meet
   !> nodes, or their numbers differ, and edges of the sleeve are not as long as each other. The hub
   !> is the slave, or the master.
   subroutine make_rings(scene, n, more, is_reversed)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: n(2)                !! of the hub, of the sleeve
      real(wp), intent(in) :: more               !! [L]
      logical, intent(in) :: is_reversed
      type(block_t) :: hub, sleeve
      real(wp) :: turn, radius
      integer :: i

      call scene_begin(scene)
      call add_block(scene, "CPE4", [n(1), 1], [0.0_wp, 1.0_wp], [1.0_wp, 1.0_wp + more], hub)
      call add_block(scene, "CPE4", [n(2), 1], [0.0_wp, 2.0_wp], [1.0_wp, 1.0_wp], sleeve)
      do i = 1, size(scene%x, 2)
         turn = quarter*scene%x(1, i)
         radius = scene%x(2, i)
         if (i > sleeve%nodes_before .and. n(1) /= n(2)) turn = turn &
            + 0.3_wp*sin(2.0_wp*turn)/real(n(2), wp)
         scene%x(:, i) = radius*[sin(turn), cos(turn)]
      end do
      call add_surface(scene, "HUB", hub, [top])
      call add_surface(scene, "SLEEVE", sleeve, [bottom])
      scene%pair = [contact_pair_t(slave=merge(2, 1, is_reversed), &
         master=merge(1, 2, is_reversed))]
   end subroutine make_rings

end module ring_scenes
