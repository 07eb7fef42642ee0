!> The walls of contact pairs as faces that results show.
module emcon_wall_faces
   use emcon_kinds, only : dp, wp
   use emcon_scene, only : scene_t
   use emcon_wall, only : wall_t
   use emcon_wall_shape_space, only : wall_shape_make, wall_shape_t
   implicit none
   private
   public :: wall_faces_t, wall_faces_find, wall_faces_move

   !> So far goes what has no end, of the diagonal of all elements.
   real(wp), parameter :: reach = 0.75_wp
   integer, parameter :: n_dim = 3, n_corner = 4

   type :: wall_faces_t
      integer, allocatable :: surface(:)         !! (n_wall) number in the scene
      type(wall_shape_t), allocatable :: shape(:)        !! (n_wall)
      integer, allocatable :: cell(:, :)         !! (4, n_cell) points of all walls, in turn
      integer, allocatable :: wall_of(:)         !! (n_cell)
      integer :: n_point = 0
   end type wall_faces_t

contains

   !> The faces of all walls that something meets.
   pure subroutine wall_faces_find(self, scene)
      type(wall_faces_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      real(wp) :: box(n_dim, 2)
      integer :: k, s, n

      self%surface = pack([(s, s = 1, size(scene%surface))], [(allocated(scene%surface(s)%wall) &
         .and. any(scene%pair%master == s), s = 1, size(scene%surface))])
      allocate(self%shape(size(self%surface)))
      if (size(self%surface) > 0) call find_box(scene, box)
      do k = 1, size(self%surface)
         associate (wall => scene%surface(self%surface(k))%wall)
            call wall_shape_make(self%shape(k), wall, along(wall, scene%x, 0.5_wp*sum(box, 2)), &
               reach*norm2(box(:, 2) - box(:, 1)))
         end associate
      end do
      n = sum([(size(self%shape(k)%cell, 2), k = 1, size(self%shape))])
      allocate(self%cell(n_corner, n), self%wall_of(n))
      n = 0
      do k = 1, size(self%shape)
         associate (cell => self%shape(k)%cell, m => size(self%shape(k)%cell, 2))
            self%cell(:, n + 1:n + m) = self%n_point + cell
            self%wall_of(n + 1:n + m) = k
            n = n + m
         end associate
         self%n_point = self%n_point + size(self%shape(k)%point, 2)
      end do
   end subroutine wall_faces_find

   !> What holds all elements.
   pure subroutine find_box(scene, box)
      type(scene_t), intent(in) :: scene
      real(wp), intent(out) :: box(n_dim, 2)     !! least and greatest coordinates [L]
      logical :: is_in(size(scene%x, 2))
      integer :: e, a

      is_in = .false.
      do e = 1, size(scene%element%node, 2)
         associate (node => scene%element%node(:, e))
            is_in(pack(node, node > 0)) = .true.
         end associate
      end do
      do a = 1, n_dim
         box(a, :) = [minval(scene%x(a, :), mask=is_in), maxval(scene%x(a, :), mask=is_in)]
      end do
   end subroutine find_box

   !> A point by the vectors of a wall.
   pure function along(wall, x, point) result(part)
      type(wall_t), intent(in) :: wall
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n_node) [L]
      real(wp), intent(in) :: point(n_dim)       !! [L]
      real(wp) :: part(n_dim)                    !! [L]
      integer :: a

      associate (origin => x(:, wall%node(1)))
         do a = 1, n_dim
            part(a) = dot_product(point - origin, x(:, wall%node(1 + a)) - origin)/wall%arm
         end do
      end associate
   end function along

   !> What all points of walls have of a field that is linear in space, as positions and
   !> displacements are, by that of the nodes of walls.
   pure function wall_faces_move(self, scene, at_node) result(at_point)
      type(wall_faces_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      real(dp), intent(in) :: at_node(:, :)      !! (n_dim, n_node)
      real(dp) :: at_point(n_dim, self%n_point)
      real(dp) :: tip(n_dim, n_dim)
      integer :: k, n

      n = 0
      do k = 1, size(self%shape)
         associate (wall => scene%surface(self%surface(k))%wall, point => self%shape(k)%point)
            associate (origin => at_node(:, wall%node(1)), m => size(point, 2))
               tip = (at_node(:, wall%node(2:)) - spread(origin, 2, n_dim))/real(wall%arm, dp)
               at_point(:, n + 1:n + m) = spread(origin, 2, m) + matmul(tip, real(point, dp))
               n = n + m
            end associate
         end associate
      end do
   end function wall_faces_move

end module emcon_wall_faces
