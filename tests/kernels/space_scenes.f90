!> Scenes of solids in space for the tests: boxes of cells, made by hand.
module space_scenes
   use emcon_element_kind, only : find_element_kind
   use emcon_element_registry, only : element_kinds_create
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: space_begin, add_box, add_element, skin

   !> A cell as six tetrahedra about the diagonal from its first corner to the opposite one.
   integer, parameter :: tetrahedron(4, 6) = reshape([1, 2, 3, 7, 1, 3, 4, 7, 1, 4, 8, 7, &
      1, 8, 5, 7, 1, 5, 6, 7, 1, 6, 2, 7], [4, 6])

contains

   subroutine space_begin(scene)
      type(scene_t), intent(out) :: scene

      scene%n_dim = 3
      call element_kinds_create(3, scene%element%kinds)
      allocate(scene%x(3, 0), scene%element%kind(0), scene%element%node(8, 0))
      allocate(scene%surface(0), scene%deck%file(0))
   end subroutine space_begin

   !> Add a box of n_cell hexahedra, or of six times as many tetrahedra, from `low` on.
   subroutine add_box(scene, name, low, extent, n_cell)
      type(scene_t), intent(inout) :: scene
      character(len=*), intent(in) :: name       !! C3D4, C3D8
      real(wp), intent(in) :: low(3), extent(3)
      integer, intent(in) :: n_cell(3)
      integer :: before, i, j, k, t, corner(8)
      real(wp) :: x(3, (n_cell(1) + 1)*(n_cell(2) + 1)*(n_cell(3) + 1))

      before = size(scene%x, 2)
      do k = 0, n_cell(3)
         do j = 0, n_cell(2)
            do i = 0, n_cell(1)
               x(:, at(i, j, k) - before) = low + extent*real([i, j, k], wp)/real(n_cell, wp)
            end do
         end do
      end do
      do k = 1, n_cell(3)
         do j = 1, n_cell(2)
            do i = 1, n_cell(1)
               corner = [at(i - 1, j - 1, k - 1), at(i, j - 1, k - 1), at(i, j, k - 1), &
                  at(i - 1, j, k - 1), at(i - 1, j - 1, k), at(i, j - 1, k), at(i, j, k), &
                  at(i - 1, j, k)]
               if (name == "C3D8") call add_element(scene, name, corner)
               do t = 1, merge(size(tetrahedron, 2), 0, name == "C3D4")
                  call add_element(scene, name, corner(tetrahedron(:, t)))
               end do
            end do
         end do
      end do
      scene%x = reshape([scene%x, x], [3, before + size(x, 2)])
      scene%node%label = [(i, i = 1, size(scene%x, 2))]
      scene%element%label = [(i, i = 1, size(scene%element%kind))]

   contains

      pure integer function at(i, j, k)
         integer, intent(in) :: i, j, k

         at = before + 1 + i + (n_cell(1) + 1)*(j + (n_cell(2) + 1)*k)
      end function at

   end subroutine add_box

   subroutine add_element(scene, name, node)
      type(scene_t), intent(inout) :: scene
      character(len=*), intent(in) :: name
      integer, intent(in) :: node(:)
      integer :: column(size(scene%element%node, 1)), i

      column = 0
      column(:size(node)) = node
      scene%element%node = reshape([scene%element%node, column], &
         [size(column), size(scene%element%node, 2) + 1])
      i = find_element_kind(scene%element%kinds, name)
      scene%element%kind = [scene%element%kind, i]
   end subroutine add_element

   !> All faces that one element alone has, by comparing each with each.
   function skin(scene) result(surface)
      type(scene_t), intent(in) :: scene
      type(surface_t) :: surface
      integer :: e, f, other, g

      surface%name = "SKIN"
      allocate(surface%element(0), surface%face(0))
      do e = 1, size(scene%element%kind)
         faces: do f = 1, scene%element%kinds(scene%element%kind(e))%n_face
            do other = 1, size(scene%element%kind)
               if (other == e) cycle
               do g = 1, scene%element%kinds(scene%element%kind(other))%n_face
                  if (same(nodes_of(e, f), nodes_of(other, g))) cycle faces
               end do
            end do
            surface%element = [surface%element, e]
            surface%face = [surface%face, f]
         end do faces
      end do

   contains

      function nodes_of(e, f) result(node)
         integer, intent(in) :: e, f
         integer, allocatable :: node(:)

         associate (kind => scene%element%kinds(scene%element%kind(e)))
            node = scene%element%node(kind%face(f), e)
         end associate
      end function nodes_of

      pure logical function same(a, b)
         integer, intent(in) :: a(:), b(:)
         integer :: i

         same = size(a) == size(b)
         do i = 1, size(a)
            if (same) same = any(b == a(i))
         end do
      end function same

   end function skin

end module space_scenes
