!> Hexahedron of eight nodes: trilinear functions on a cube of side 2, 2 x 2 x 2 points.
module emcon_shape_hexahedron_space
   use emcon_kinds, only : wp
   use emcon_shape, only : shape_t
   implicit none
   private
   public :: shape_hexahedron_t

   type, extends(shape_t) :: shape_hexahedron_t
   contains
      procedure :: places
      procedure :: values
      procedure :: rule
   end type shape_hexahedron_t

   !> Corners.
   real(wp), parameter :: node(3, 8) = reshape(real([ &
      -1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1, -1, -1, 1, 1, -1, 1, 1, &
      1, 1, -1, 1, 1], wp), [3, 8])

contains

   !> Corners: the lower face, seen from above counter-clockwise, then the upper one.
   pure subroutine places(self, place)
      class(shape_hexahedron_t), intent(in) :: self
      real(wp), allocatable, intent(out) :: place(:, :)      !! (3, 8)

      place = node
   end subroutine places

   !> Products of three linear functions.
   pure subroutine values(self, point, value, slope)
      class(shape_hexahedron_t), intent(in) :: self
      real(wp), intent(in) :: point(:)           !! (3) natural coordinates
      real(wp), intent(out) :: value(:)          !! (8)
      real(wp), intent(out) :: slope(:, :)       !! (3, 8)
      real(wp) :: one(3)
      integer :: i

      do i = 1, 8
         one = 1.0_wp + node(:, i)*point
         value(i) = 0.125_wp*one(1)*one(2)*one(3)
         slope(:, i) = 0.125_wp*node(:, i)*[one(2)*one(3), one(1)*one(3), one(1)*one(2)]
      end do
   end subroutine values

   !> Exact to degree 3 in each coordinate, for both.
   pure subroutine rule(self, is_mass, point, weight)
      class(shape_hexahedron_t), intent(in) :: self
      logical, intent(in) :: is_mass             !! else for stiffness
      real(wp), allocatable, intent(out) :: point(:, :)      !! (3, n_gp)
      real(wp), allocatable, intent(out) :: weight(:)        !! (n_gp)
      real(wp), parameter :: g = 1.0_wp/sqrt(3.0_wp)

      point = g*node
      weight = spread(1.0_wp, 1, 8)
   end subroutine rule

end module emcon_shape_hexahedron_space
