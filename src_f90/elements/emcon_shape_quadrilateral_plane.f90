!> Quadrilateral of four nodes: bilinear functions on [-1, 1] x [-1, 1], 2 x 2 points.
module emcon_shape_quadrilateral_plane
   use emcon_kinds, only : wp
   use emcon_shape, only : shape_t
   implicit none
   private
   public :: shape_quadrilateral_t

   type, extends(shape_t) :: shape_quadrilateral_t
   contains
      procedure :: places => quadrilateral_places
      procedure :: values => quadrilateral_values
      procedure :: rule => quadrilateral_rule
      procedure :: to_nodes => quadrilateral_to_nodes
   end type shape_quadrilateral_t

   real(wp), parameter :: corner(2, 4) = reshape([-1.0_wp, -1.0_wp, 1.0_wp, -1.0_wp, &
      1.0_wp, 1.0_wp, -1.0_wp, 1.0_wp], [2, 4])

contains

   pure subroutine quadrilateral_places(self, place)
      class(shape_quadrilateral_t), intent(in) :: self
      real(wp), allocatable, intent(out) :: place(:, :)      !! (2, 4)

      place = corner
   end subroutine quadrilateral_places

   pure subroutine quadrilateral_values(self, point, value, slope)
      class(shape_quadrilateral_t), intent(in) :: self
      real(wp), intent(in) :: point(:)           !! (2) natural coordinates
      real(wp), intent(out) :: value(:)          !! (4)
      real(wp), intent(out) :: slope(:, :)       !! (2, 4)
      integer :: i

      do i = 1, 4
         value(i) = 0.25_wp*(1.0_wp + corner(1, i)*point(1))*(1.0_wp + corner(2, i)*point(2))
         slope(1, i) = 0.25_wp*corner(1, i)*(1.0_wp + corner(2, i)*point(2))
         slope(2, i) = 0.25_wp*corner(2, i)*(1.0_wp + corner(1, i)*point(1))
      end do
   end subroutine quadrilateral_values

   !> Exact to degree 3 in each coordinate.
   pure subroutine quadrilateral_rule(self, is_mass, point, weight)
      class(shape_quadrilateral_t), intent(in) :: self
      logical, intent(in) :: is_mass             !! the same for both
      real(wp), allocatable, intent(out) :: point(:, :)      !! (2, 4)
      real(wp), allocatable, intent(out) :: weight(:)        !! (4)
      real(wp), parameter :: g = 1.0_wp/sqrt(3.0_wp)

      point = g*corner
      weight = spread(1.0_wp, 1, 4)
   end subroutine quadrilateral_rule

   !> The bilinear function through the values at the points.
   pure subroutine quadrilateral_to_nodes(self, weight)
      class(shape_quadrilateral_t), intent(in) :: self
      real(wp), allocatable, intent(out) :: weight(:, :)     !! (4, 4)
      real(wp) :: slope(2, 4)
      integer :: i

      allocate(weight(4, 4))
      do i = 1, 4
         call self%values(sqrt(3.0_wp)*corner(:, i), weight(:, i), slope)
      end do
   end subroutine quadrilateral_to_nodes

end module emcon_shape_quadrilateral_plane
