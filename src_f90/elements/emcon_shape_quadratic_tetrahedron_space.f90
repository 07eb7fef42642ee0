!> Tetrahedron of ten nodes: quadratic functions; four points, and 64 for the mass.
module emcon_shape_quadratic_tetrahedron_space
   use emcon_kinds, only : wp
   use emcon_shape, only : shape_t
   implicit none
   private
   public :: shape_quadratic_tetrahedron_t

   type, extends(shape_t) :: shape_quadratic_tetrahedron_t
   contains
      procedure :: places
      procedure :: values
      procedure :: rule
   end type shape_quadratic_tetrahedron_t

   !> Ends of the sides that nodes 5 to 10 lie in.
   integer, parameter :: ends(2, 6) = reshape([1, 2, 2, 3, 3, 1, 1, 4, 2, 4, 3, 4], [2, 6])

contains

   !> Corners, then the middles of the sides.
   pure subroutine places(self, place)
      class(shape_quadratic_tetrahedron_t), intent(in) :: self
      real(wp), allocatable, intent(out) :: place(:, :)      !! (3, 10)
      integer :: i

      allocate(place(3, 10), source=0.0_wp)
      do i = 1, 3
         place(i, 1 + i) = 1.0_wp
      end do
      do i = 1, 6
         place(:, 4 + i) = 0.5_wp*(place(:, ends(1, i)) + place(:, ends(2, i)))
      end do
   end subroutine places

   !> l (2 l - 1) at corners and 4 l l' between them, by the coordinates l of volumes.
   pure subroutine values(self, point, value, slope)
      class(shape_quadratic_tetrahedron_t), intent(in) :: self
      real(wp), intent(in) :: point(:)           !! (3) natural coordinates
      real(wp), intent(out) :: value(:)          !! (10)
      real(wp), intent(out) :: slope(:, :)       !! (3, 10)
      real(wp) :: l(4), by(3, 4)
      integer :: i

      l(1) = 1.0_wp - sum(point)
      l(2:) = point
      by = 0.0_wp
      by(:, 1) = -1.0_wp
      do i = 1, 3
         by(i, 1 + i) = 1.0_wp
      end do
      do i = 1, 4
         value(i) = l(i)*(2.0_wp*l(i) - 1.0_wp)
         slope(:, i) = (4.0_wp*l(i) - 1.0_wp)*by(:, i)
      end do
      do i = 1, 6
         associate (a => ends(1, i), b => ends(2, i))
            value(4 + i) = 4.0_wp*l(a)*l(b)
            slope(:, 4 + i) = 4.0_wp*(l(a)*by(:, b) + l(b)*by(:, a))
         end associate
      end do
   end subroutine values

   !> Exact to degree 2; for the mass to degree 5, by the points of a cube whose faces are drawn
   !> together.
   pure subroutine rule(self, is_mass, point, weight)
      class(shape_quadratic_tetrahedron_t), intent(in) :: self
      logical, intent(in) :: is_mass             !! else for stiffness
      real(wp), allocatable, intent(out) :: point(:, :)      !! (3, n_gp)
      real(wp), allocatable, intent(out) :: weight(:)        !! (n_gp)
      real(wp), parameter :: a = (5.0_wp - sqrt(5.0_wp))/20.0_wp, b = 1.0_wp - 3.0_wp*a
      real(wp), parameter :: far = sqrt((3.0_wp + 2.0_wp*sqrt(1.2_wp))/7.0_wp)
      real(wp), parameter :: near = sqrt((3.0_wp - 2.0_wp*sqrt(1.2_wp))/7.0_wp)
      real(wp), parameter :: x(4) = 0.5_wp*[1.0_wp - far, 1.0_wp - near, 1.0_wp + near, &
         1.0_wp + far]
      real(wp), parameter :: little = (18.0_wp - sqrt(30.0_wp))/72.0_wp, much = 0.5_wp - little
      real(wp), parameter :: w(4) = [little, much, much, little]
      integer :: i, j, k, n

      if (is_mass) then
         allocate(point(3, 64), weight(64))
         n = 0
         do k = 1, 4
            do j = 1, 4
               do i = 1, 4
                  n = n + 1
                  point(:, n) = [x(i)*(1.0_wp - x(j))*(1.0_wp - x(k)), x(j)*(1.0_wp - x(k)), x(k)]
                  weight(n) = w(i)*w(j)*w(k)*(1.0_wp - x(j))*(1.0_wp - x(k))**2
               end do
            end do
         end do
      else
         point = reshape([a, a, a, b, a, a, a, b, a, a, a, b], [3, 4])
         weight = spread(1.0_wp/24.0_wp, 1, 4)
      end if
   end subroutine rule

end module emcon_shape_quadratic_tetrahedron_space
