!> Triangle of six nodes: quadratic functions; three points, and six for the mass.
module emcon_shape_quadratic_triangle_plane
   use emcon_kinds, only : wp
   use emcon_shape, only : shape_t
   implicit none
   private
   public :: shape_quadratic_triangle_t

   type, extends(shape_t) :: shape_quadratic_triangle_t
   contains
      procedure :: places => quadratic_triangle_places
      procedure :: values => quadratic_triangle_values
      procedure :: rule => quadratic_triangle_rule
   end type shape_quadratic_triangle_t

contains

   !> Corners, then the middles of the sides 1-2, 2-3, 3-1.
   pure subroutine quadratic_triangle_places(self, place)
      class(shape_quadratic_triangle_t), intent(in) :: self
      real(wp), allocatable, intent(out) :: place(:, :)      !! (2, 6)

      place = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.5_wp, 0.0_wp, &
         0.5_wp, 0.5_wp, 0.0_wp, 0.5_wp], [2, 6])
   end subroutine quadratic_triangle_places

   !> l (2 l - 1) at corners and 4 l l' between them, by the coordinates l of areas.
   pure subroutine quadratic_triangle_values(self, point, value, slope)
      class(shape_quadratic_triangle_t), intent(in) :: self
      real(wp), intent(in) :: point(:)           !! (2) natural coordinates
      real(wp), intent(out) :: value(:)          !! (6)
      real(wp), intent(out) :: slope(:, :)       !! (2, 6)
      real(wp), parameter :: by(2, 3) = reshape([-1.0_wp, -1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, &
         1.0_wp], [2, 3])
      real(wp) :: l(3)
      integer :: i, j

      l = [1.0_wp - point(1) - point(2), point(1), point(2)]
      do i = 1, 3
         j = 1 + mod(i, 3)
         value(i) = l(i)*(2.0_wp*l(i) - 1.0_wp)
         slope(:, i) = (4.0_wp*l(i) - 1.0_wp)*by(:, i)
         value(3 + i) = 4.0_wp*l(i)*l(j)
         slope(:, 3 + i) = 4.0_wp*(l(i)*by(:, j) + l(j)*by(:, i))
      end do
   end subroutine quadratic_triangle_values

   !> Exact to degree 2, for the mass to degree 4: as many points as strains or products need.
   pure subroutine quadratic_triangle_rule(self, is_mass, point, weight)
      class(shape_quadratic_triangle_t), intent(in) :: self
      logical, intent(in) :: is_mass             !! else for stiffness
      real(wp), allocatable, intent(out) :: point(:, :)      !! (2, n_gp)
      real(wp), allocatable, intent(out) :: weight(:)        !! (n_gp)
      real(wp), parameter :: s = 1.0_wp/6.0_wp
      real(wp), parameter :: ten = sqrt(10.0_wp), spread_a = sqrt(38.0_wp - 44.0_wp*sqrt(0.4_wp))
      real(wp), parameter :: spread_w = sqrt(213125.0_wp - 53320.0_wp*ten)
      real(wp), parameter :: a = (8.0_wp - ten + spread_a)/18.0_wp
      real(wp), parameter :: b = (8.0_wp - ten - spread_a)/18.0_wp
      real(wp), parameter :: wa = (620.0_wp + spread_w)/7440.0_wp
      real(wp), parameter :: wb = (620.0_wp - spread_w)/7440.0_wp

      if (is_mass) then
         point = reshape([a, a, 1.0_wp - 2.0_wp*a, a, a, 1.0_wp - 2.0_wp*a, b, b, &
            1.0_wp - 2.0_wp*b, b, b, 1.0_wp - 2.0_wp*b], [2, 6])
         weight = [wa, wa, wa, wb, wb, wb]
      else
         point = reshape([s, s, 4*s, s, s, 4*s], [2, 3])
         weight = [s, s, s]
      end if
   end subroutine quadratic_triangle_rule

end module emcon_shape_quadratic_triangle_plane
