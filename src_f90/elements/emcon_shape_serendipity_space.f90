!> Hexahedron of 20 nodes: quadratic functions on a cube of side 2, one node in each side.
module emcon_shape_serendipity_space
   use emcon_kinds, only : wp
   use emcon_shape, only : shape_gauss_points, shape_t
   implicit none
   private
   public :: shape_serendipity_space_t

   type, extends(shape_t) :: shape_serendipity_space_t
      integer :: n_side = 3                      !! points along a side for stiffness, 2 or 3
   contains
      procedure :: places
      procedure :: values
      procedure :: rule
   end type shape_serendipity_space_t

   !> Corners, then the middles of the sides: of the lower face, of the upper one, between them.
   real(wp), parameter :: node(3, 20) = reshape(real([ &
      -1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1, -1, -1, 1, 1, -1, 1, 1, &
      1, 1, -1, 1, 1, 0, -1, -1, 1, 0, -1, 0, 1, -1, -1, 0, -1, 0, -1, 1, &
      1, 0, 1, 0, 1, 1, -1, 0, 1, -1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0], wp), [3, 20])

contains

   !> Corners, then the middles of the sides.
   pure subroutine places(self, place)
      class(shape_serendipity_space_t), intent(in) :: self
      real(wp), allocatable, intent(out) :: place(:, :)      !! (3, 20)

      place = node
   end subroutine places

   !> Quadratic along each side.
   pure subroutine values(self, point, value, slope)
      class(shape_serendipity_space_t), intent(in) :: self
      real(wp), intent(in) :: point(:)           !! (3) natural coordinates
      real(wp), intent(out) :: value(:)          !! (20)
      real(wp), intent(out) :: slope(:, :)       !! (3, 20)
      real(wp) :: one(3), round(3), x(3), other
      integer :: a, i

      do i = 1, 20
         x = node(:, i)*point
         one = 1.0_wp + x
         round = 1.0_wp - point*point
         if (i <= 8) then
            other = sum(x) - 2.0_wp
            value(i) = 0.125_wp*product(one)*other
            slope(:, i) = 0.125_wp*node(:, i)*[one(2)*one(3), one(1)*one(3), one(1)*one(2)] &
               *(other + one)
         else
            a = findloc(abs(node(:, i)) < 0.5_wp, .true., 1)   ! the side runs along this one
            one(a) = round(a)
            value(i) = 0.25_wp*product(one)
            slope(:, i) = 0.25_wp*node(:, i)*[one(2)*one(3), one(1)*one(3), one(1)*one(2)]
            slope(a, i) = -0.5_wp*point(a)*product(one, mask=[1, 2, 3] /= a)
         end if
      end do
   end subroutine values

   !> Gauss points: exact to degree 5 in each coordinate, with two along a side to degree 3.
   pure subroutine rule(self, is_mass, point, weight)
      class(shape_serendipity_space_t), intent(in) :: self
      logical, intent(in) :: is_mass             !! else for stiffness
      real(wp), allocatable, intent(out) :: point(:, :)      !! (3, n_gp)
      real(wp), allocatable, intent(out) :: weight(:)        !! (n_gp)

      call shape_gauss_points(3, merge(3, self%n_side, is_mass), point, weight)
   end subroutine rule

end module emcon_shape_serendipity_space
