!> Scenes whose contact surfaces run over tied pieces, and the same scenes in one piece.
module cut_scenes
   use emcon_couplings, only : tie_t
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use small_scenes, only : add_block, add_surface, block_t, bottom, left, right, scene_begin, top
   implicit none
   private
   public :: add_tie, merge_surfaces, make_cut_blocks, make_cut_strip, same_node

contains

   !> Add a tie between two surfaces.
   subroutine add_tie(scene, slave, master)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: slave, master       !! numbers of surfaces
      type(tie_t) :: tie

      tie%name = "TIE"
      tie%slave = slave
      tie%master = master
      scene%tie = [scene%tie, tie]
   end subroutine add_tie

   !> Add the surface made of the faces of two others.
   subroutine merge_surfaces(scene, name, one, other)
      type(scene_t), intent(inout) :: scene
      character(len=*), intent(in) :: name
      integer, intent(in) :: one, other          !! numbers of surfaces
      type(surface_t) :: surface

      surface%name = name
      surface%element = [scene%surface(one)%element, scene%surface(other)%element]
      surface%face = [scene%surface(one)%face, scene%surface(other)%face]
      scene%surface = [scene%surface, surface]
   end subroutine merge_surfaces

   !> `make_two_blocks` with both blocks in two halves: the right half of the lower block is the
   !> master of its tie, of the upper block the left half.
   subroutine make_cut_blocks(scene, gap)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: gap
      type(block_t) :: lower(2), upper(2)
      type(contact_pair_t) :: pair

      call scene_begin(scene)
      call add_block(scene, "CPE4", [2, 1], [-2.0_wp, -1.0_wp], [2.0_wp, 1.0_wp], lower(1))
      call add_block(scene, "CPE4", [2, 1], [0.0_wp, -1.0_wp], [2.0_wp, 1.0_wp], lower(2))
      call add_block(scene, "CPE4", [1, 1], [-0.875_wp, gap], [1.0_wp, 1.0_wp], upper(1))
      call add_block(scene, "CPE4", [1, 1], [0.125_wp, gap], [1.0_wp, 1.0_wp], upper(2))
      call add_surface(scene, "LOWER_1", lower(1), [top])
      call add_surface(scene, "LOWER_2", lower(2), [top])
      call add_surface(scene, "UPPER_1", upper(1), [bottom])
      call add_surface(scene, "UPPER_2", upper(2), [bottom])
      call add_surface(scene, "LOWER_1_CUT", lower(1), [right])
      call add_surface(scene, "LOWER_2_CUT", lower(2), [left])
      call add_surface(scene, "UPPER_1_CUT", upper(1), [right])
      call add_surface(scene, "UPPER_2_CUT", upper(2), [left])
      call merge_surfaces(scene, "LOWER", 1, 2)
      call merge_surfaces(scene, "UPPER", 3, 4)
      call add_tie(scene, 5, 6)
      call add_tie(scene, 8, 7)
      pair%slave = 10
      pair%master = 9
      scene%pair = [pair]
   end subroutine make_cut_blocks

   !> A strip of `n` cells along x, of the size `extent`, in two tied pieces of which the first has
   !> `n_first` cells; in one piece with `n_first` = `n`. Its whole boundary, which begins at the
   !> origin, is in contact with itself.
   subroutine make_cut_strip(scene, n, n_first, extent)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: n, n_first
      real(wp), intent(in) :: extent(2)
      type(block_t) :: block(2)
      type(contact_pair_t) :: pair
      real(wp) :: cut

      call scene_begin(scene)
      cut = extent(1)*(real(n_first, wp)/real(n, wp))
      call add_block(scene, "CPE4", [n_first, 1], [0.0_wp, 0.0_wp], [cut, extent(2)], block(1))
      if (n_first == n) then
         call add_surface(scene, "ALL", block(1), [bottom, right, top, left])
      else
         call add_block(scene, "CPE4", [n - n_first, 1], [cut, 0.0_wp], [extent(1) - cut, &
            extent(2)], block(2))
         call add_surface(scene, "FIRST", block(1), [bottom, top, left])
         call add_surface(scene, "SECOND", block(2), [bottom, right, top])
         call merge_surfaces(scene, "ALL", 1, 2)
         call add_surface(scene, "FIRST_CUT", block(1), [right])
         call add_surface(scene, "SECOND_CUT", block(2), [left])
         call add_tie(scene, 5, 4)
      end if
      pair%slave = merge(1, 3, n_first == n)
      pair%master = pair%slave
      scene%pair = [pair]
   end subroutine make_cut_strip

   !> For each node of `cut` that of `whole` at the same place.
   function same_node(cut, whole) result(node)
      type(scene_t), intent(in) :: cut, whole
      integer :: node(size(cut%x, 2))
      integer :: i, k

      do i = 1, size(node)
         node(i) = minloc([(norm2(whole%x(:, k) - cut%x(:, i)), k = 1, size(whole%x, 2))], 1)
      end do
   end function same_node

end module cut_scenes
