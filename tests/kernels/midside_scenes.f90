!> Elements with midside nodes whose sides face each other, for the tests.
module midside_scenes
   use emcon_element_registry, only : find_element_row
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use random_draws, only : draw_random
   use small_scenes, only : add_block, block_node, block_t, scene_begin
   implicit none
   private
   public :: make_rows, make_curved_rows

contains

   !> Two rows of CPE8, two cells below and one on top of them; surfaces 1 and 2 are the sides that
   !> face each other. Nodes in the middle of cells belong to no element.
   subroutine make_rows(scene)
      type(scene_t), intent(out) :: scene
      type(block_t) :: lower, upper

      call scene_begin(scene)
      call add_block(scene, "CPE4", [4, 2], [0.0_wp, -1.0_wp], [2.0_wp, 1.0_wp], lower)
      call add_block(scene, "CPE4", [2, 2], [0.25_wp, 0.0_wp], [1.5_wp, 1.0_wp], upper)
      scene%element%node = reshape([cell(lower, 0), cell(lower, 2), cell(upper, 0)], [8, 3])
      scene%element%kind = spread(find_element_row("CPE8"), 1, 3)
      scene%element%section = [1, 1, 1]
      scene%element%label = [1, 2, 3]
      deallocate(scene%element%origin)
      allocate(scene%element%origin(3))
      if (allocated(scene%surface)) deallocate(scene%surface)
      allocate(scene%surface(2))
      call set_faces(scene%surface(1), "LOWER", [2, 1], 3)
      call set_faces(scene%surface(2), "UPPER", [3], 1)

   contains

      !> The nodes of the CPE8 that begins in column `i` of the grid.
      pure function cell(block, i) result(node)
         type(block_t), intent(in) :: block
         integer, intent(in) :: i
         integer, parameter :: at(2, 8) = reshape( &
            [0, 0, 2, 0, 2, 2, 0, 2, 1, 0, 2, 1, 1, 2, 0, 1], [2, 8])
         integer :: node(8), k

         do k = 1, size(node)
            node(k) = block_node(block, i + at(1, k), at(2, k))
         end do
      end function cell

      pure subroutine set_faces(surface, name, element, face)
         type(surface_t), intent(out) :: surface
         character(len=*), intent(in) :: name
         integer, intent(in) :: element(:), face

         surface%name = name
         allocate(surface%element, source=element)
         allocate(surface%face, source=spread(face, 1, size(element)))
      end subroutine set_faces

   end subroutine make_rows

   !> The same with all nodes off their places, so that sides are curved.
   subroutine make_curved_rows(scene)
      type(scene_t), intent(out) :: scene
      real(wp), allocatable :: off(:, :)

      call make_rows(scene)
      allocate(off, mold=scene%x)
      call draw_random(off)
      scene%x = scene%x + 0.05_wp*(off - 0.5_wp)
   end subroutine make_curved_rows

end module midside_scenes
