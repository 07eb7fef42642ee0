!> Nodes that stand behind those of a deck, with the labels that follow the largest one.
module emcon_deck_own_nodes
   use emcon_kinds, only : wp
   use emcon_origin, only : origin_t
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: add_own_nodes

contains

   !> Nodes at `place` behind all others.
   subroutine add_own_nodes(scene, origin, place, node)
      type(scene_t), intent(inout) :: scene
      type(origin_t), intent(in) :: origin
      real(wp), intent(in) :: place(:, :)          !! (n_dim, n) [L]
      integer, allocatable, intent(out) :: node(:) !! (n)
      integer :: i, n, n_before, last

      n = size(place, 2)
      n_before = size(scene%node%label)
      last = maxval([0, scene%node%label])
      allocate(node, source=[(n_before + i, i = 1, n)])
      scene%x = reshape([scene%x, place], [size(place, 1), n_before + n])
      scene%node%label = [scene%node%label, [(last + i, i = 1, n)]]
      scene%node%origin = [scene%node%origin, [(origin, i = 1, n)]]
   end subroutine add_own_nodes

end module emcon_deck_own_nodes
