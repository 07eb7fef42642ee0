!> How long a surface and its edges are, and by how much it turns from one to the next.
module emcon_surface_shape_plane
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_surface_facets, only : surface_facets
   implicit none
   private
   public :: surface_shape_t, surface_shape

   !> Where a surface turns by more, it has a corner [degrees].
   real(wp), parameter :: corner = 60.0_wp

   !> Size and shape of a surface in the reference configuration; lengths times a power of two that
   !> is one for all surfaces of a scene.
   type :: surface_shape_t
      real(wp) :: length = 0.0_wp
      real(wp) :: mean = 0.0_wp                  !! edge
      real(wp) :: shortest = huge(1.0_wp)        !! edge
      real(wp) :: turn = 0.0_wp                  !! largest at a node that is no corner [degrees]
   end type surface_shape_t

contains

   !> The shape of `surface`.
   pure function surface_shape(scene, surface) result(shape)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      type(surface_shape_t) :: shape
      integer, allocatable :: edge(:, :), from(:)
      real(wp), allocatable :: along(:, :)
      integer :: i, n, power

      ! Coordinates may be as large or as small as numbers can be.
      power = -exponent(maxval(abs(scene%x)))
      call surface_facets(scene, surface, edge)
      allocate(along(2, size(edge, 2)), source=0.0_wp)
      allocate(from(size(scene%x, 2)), source=0)
      n = 0
      do i = 1, size(edge, 2)
         if (any(edge(:, i) == 0)) cycle
         along(:, i) = scale(scene%x(:, edge(2, i)), power) - scale(scene%x(:, edge(1, i)), power)
         from(edge(1, i)) = i
         associate (length => norm2(along(:, i)))
            if (.not. length > 0.0_wp) cycle
            n = n + 1
            shape%length = shape%length + length
            shape%shortest = min(shape%shortest, length)
         end associate
      end do
      if (n == 0) return
      shape%mean = shape%length/n
      do i = 1, size(edge, 2)
         if (any(edge(:, i) == 0)) cycle
         if (from(edge(2, i)) == 0) cycle
         associate (turn => turn_of(along(:, i), along(:, from(edge(2, i)))))
            if (turn <= corner) shape%turn = max(shape%turn, turn)
         end associate
      end do
   end function surface_shape

   !> The angle between two directions [degrees].
   pure real(wp) function turn_of(a, b)
      real(wp), intent(in) :: a(2), b(2)
      real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp

      turn_of = atan2(abs(a(1)*b(2) - a(2)*b(1)), dot_product(a, b))/degree
   end function turn_of

end module emcon_surface_shape_plane
