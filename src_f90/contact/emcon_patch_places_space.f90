! build: elements
!> Where the nodes of a patch are over a step, and how they move.
!>
!> Source: docs/theory.md, section 14.
module emcon_patch_places_space
   use emcon_bulges_space, only : bulges_rise, bulges_t
   use emcon_kinds, only : wp
   use emcon_nearest_space, only : nearest_t, nearest_update
   use emcon_patch_look_space, only : patch_begin
   use emcon_patch_sides_space, only : flip_signs, patch_sides_t, sides_place
   use emcon_patch_stencil_space, only : patch_stencil_t
   use emcon_rotation, only : cross_product
   implicit none
   private
   public :: patch_stencil_begin, patch_stencil_gather, patch_stencil_place, patch_stencil_height

contains

   !> Keep what the patch sees as a step begins from x + u0, if stencils were chosen there.
   pure subroutine patch_stencil_begin(self, x, u0, is_chosen)
      type(patch_stencil_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :)   !! (3, n_node) [L]
      logical, intent(in) :: is_chosen           !! they were; else nothing is kept
      real(wp) :: at(3, 3 + self%patch%n_vertex)

      if (self%triangle == 0) return
      if (is_chosen .and. .not. allocated(self%patch%start)) then
         allocate(self%patch%start)
         call patch_stencil_place(self, x, u0, at)
         call patch_begin(self%patch, at, self%patch%start)
      else if (allocated(self%patch%start) .and. .not. is_chosen) then
         deallocate(self%patch%start)
      end if
   end subroutine patch_stencil_begin

   !> Where the nodes of a stencil are, from its slave node on, and how they move: origin, both
   !> vectors of the frame, vertices.
   pure subroutine patch_stencil_gather(self, x, u0, du, at, way)
      type(patch_stencil_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(out) :: at(:, :), way(:, :)   !! (3, 3 + n_vertex) [L]
      real(wp) :: motion(3, self%n_node)
      integer :: i

      call patch_stencil_place(self, x, u0, at)
      do i = 2, self%n_node
         motion(:, i) = du(:, self%node(i)) - du(:, self%node(1))
      end do
      call combine(self, motion, way)
   end subroutine patch_stencil_gather

   !> Where they are.
   pure subroutine patch_stencil_place(self, x, u, at)
      type(patch_stencil_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp), intent(out) :: at(:, :)              !! (3, 3 + n_vertex) [L]
      real(wp) :: from(3, self%n_node)
      integer :: i

      associate (slave => self%node(1))
         do i = 2, self%n_node
            from(:, i) = (x(:, self%node(i)) - x(:, slave)) + (u(:, self%node(i)) - u(:, slave))
         end do
      end associate
      call combine(self, from, at)
   end subroutine patch_stencil_place

   !> Origin, vectors and vertices of what nodes have, mirrored where they are.
   pure subroutine combine(self, of_node, at)
      type(patch_stencil_t), intent(in) :: self
      real(wp), intent(inout) :: of_node(:, :)   !! (3, n_node) from the slave node on; not of that
      real(wp), intent(out) :: at(:, :)          !! (3, 3 + n_vertex)
      integer :: i, j, k

      do i = 2, self%n_node
         if (self%flip(i) /= 0) of_node(:, i) = flip_signs(self%flip(i))*of_node(:, i)
      end do
      at(:, 1) = 0.0_wp
      do j = 1, 2 + self%patch%n_vertex
         at(:, 1 + j) = 0.0_wp
         do k = self%start(j) + 1, self%start(j + 1)
            at(:, 1 + j) = at(:, 1 + j) + self%entry(k)*of_node(:, self%row(k))
         end do
      end do
   end subroutine combine

   !> How far the contact point of a stencil is from the curved surface that the nearest triangle
   !> stands for, > 0 in front of it.
   pure real(wp) function patch_stencil_height(self, sides, bulges, x, u) result(height)
      type(patch_stencil_t), intent(in) :: self  !! with a triangle
      type(patch_sides_t), intent(in) :: sides
      type(bulges_t), intent(in) :: bulges       !! of the master
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      real(wp) :: at(3, 3 + self%patch%n_vertex), corner(3, 3), origin(3)
      type(nearest_t) :: nearest
      integer :: k

      origin = 0.0_wp
      do k = 2, self%n_origin
         associate (i => self%node(k), slave => self%node(1))
            origin = origin + self%origin(k)*((x(:, i) - x(:, slave)) + (u(:, i) - u(:, slave)))
         end associate
      end do
      do k = 1, 3
         corner(:, k) = sides_place(sides, sides%triangles%split%corner(k, self%triangle), &
            self%node(1), x, u) - origin
      end do
      call nearest_update(nearest, self%triangle, [0.0_wp, 0.0_wp, 0.0_wp], corner)
      call patch_stencil_place(self, x, u, at)
      height = sign(sqrt(nearest%square), dot_product(matmul(corner, nearest%weight), &
         cross_product(at(:, 2), at(:, 3)))) &
         - bulges_rise(bulges, sides%triangles%split, self%triangle, nearest%weight)
   end function patch_stencil_height

end module emcon_patch_places_space
