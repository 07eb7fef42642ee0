!> Tetrahedron of four nodes: linear functions; one point, and four for the mass.
module emcon_shape_tetrahedron_space
   use emcon_kinds, only : wp
   use emcon_shape, only : shape_t
   implicit none
   private
   public :: shape_tetrahedron_t

   type, extends(shape_t) :: shape_tetrahedron_t
   contains
      procedure :: places
      procedure :: values
      procedure :: rule
   end type shape_tetrahedron_t

contains

   !> Corners.
   pure subroutine places(self, place)
      class(shape_tetrahedron_t), intent(in) :: self
      real(wp), allocatable, intent(out) :: place(:, :)      !! (3, 4)

      place = reshape([0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
         0.0_wp, 0.0_wp, 1.0_wp], [3, 4])
   end subroutine places

   !> The coordinates of volumes.
   pure subroutine values(self, point, value, slope)
      class(shape_tetrahedron_t), intent(in) :: self
      real(wp), intent(in) :: point(:)           !! (3) natural coordinates
      real(wp), intent(out) :: value(:)          !! (4)
      real(wp), intent(out) :: slope(:, :)       !! (3, 4)
      integer :: i

      value(1) = 1.0_wp - sum(point)
      value(2:) = point
      slope = 0.0_wp
      slope(:, 1) = -1.0_wp
      do i = 1, 3
         slope(i, 1 + i) = 1.0_wp
      end do
   end subroutine values

   !> Exact to degree 1, for the mass to degree 2.
   pure subroutine rule(self, is_mass, point, weight)
      class(shape_tetrahedron_t), intent(in) :: self
      logical, intent(in) :: is_mass             !! else for stiffness
      real(wp), allocatable, intent(out) :: point(:, :)      !! (3, n_gp)
      real(wp), allocatable, intent(out) :: weight(:)        !! (n_gp)
      real(wp), parameter :: a = (5.0_wp - sqrt(5.0_wp))/20.0_wp, b = 1.0_wp - 3.0_wp*a

      if (is_mass) then
         point = reshape([a, a, a, b, a, a, a, b, a, a, a, b], [3, 4])
         weight = spread(1.0_wp/24.0_wp, 1, 4)
      else
         point = reshape([0.25_wp, 0.25_wp, 0.25_wp], [3, 1])
         weight = [1.0_wp/6.0_wp]
      end if
   end subroutine rule

end module emcon_shape_tetrahedron_space
