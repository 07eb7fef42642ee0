!> Quadrilateral of eight nodes: quadratic functions without x^2 y^2 on [-1, 1] x [-1, 1].
module emcon_shape_serendipity_plane
   use emcon_kinds, only : wp
   use emcon_shape, only : shape_gauss_points, shape_t
   implicit none
   private
   public :: shape_serendipity_t

   type, extends(shape_t) :: shape_serendipity_t
      integer :: n_side = 3                      !! points along a side for stiffness, 2 or 3
   contains
      procedure :: places => serendipity_places
      procedure :: values => serendipity_values
      procedure :: rule => serendipity_rule
      procedure :: to_nodes => serendipity_to_nodes
   end type shape_serendipity_t

   !> Corners, then the middles of the sides 1-2, 2-3, 3-4, 4-1.
   real(wp), parameter :: node(2, 8) = reshape([-1.0_wp, -1.0_wp, 1.0_wp, -1.0_wp, &
      1.0_wp, 1.0_wp, -1.0_wp, 1.0_wp, 0.0_wp, -1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, &
      -1.0_wp, 0.0_wp], [2, 8])

contains

   pure subroutine serendipity_places(self, place)
      class(shape_serendipity_t), intent(in) :: self
      real(wp), allocatable, intent(out) :: place(:, :)      !! (2, 8)

      place = node
   end subroutine serendipity_places

   pure subroutine serendipity_values(self, point, value, slope)
      class(shape_serendipity_t), intent(in) :: self
      real(wp), intent(in) :: point(:)           !! (2) natural coordinates
      real(wp), intent(out) :: value(:)          !! (8)
      real(wp), intent(out) :: slope(:, :)       !! (2, 8)
      real(wp) :: one(2), x(2)
      integer :: along, i

      do i = 1, 4
         x = node(:, i)*point
         one = 1.0_wp + x
         value(i) = 0.25_wp*one(1)*one(2)*(x(1) + x(2) - 1.0_wp)
         slope(1, i) = 0.25_wp*node(1, i)*one(2)*(2.0_wp*x(1) + x(2))
         slope(2, i) = 0.25_wp*node(2, i)*one(1)*(2.0_wp*x(2) + x(1))
      end do
      do i = 5, 8
         along = merge(1, 2, mod(i, 2) == 1)     ! the side runs along this coordinate
         associate (x => point(along), y => point(3 - along), side => node(3 - along, i))
            value(i) = 0.5_wp*(1.0_wp - x)*(1.0_wp + x)*(1.0_wp + side*y)
            slope(along, i) = -x*(1.0_wp + side*y)
            slope(3 - along, i) = 0.5_wp*side*(1.0_wp - x)*(1.0_wp + x)
         end associate
      end do
   end subroutine serendipity_values

   !> Gauss points: exact to degree 5 in each coordinate, with two along a side to degree 3.
   pure subroutine serendipity_rule(self, is_mass, point, weight)
      class(shape_serendipity_t), intent(in) :: self
      logical, intent(in) :: is_mass             !! three along a side
      real(wp), allocatable, intent(out) :: point(:, :)      !! (2, n_gp)
      real(wp), allocatable, intent(out) :: weight(:)        !! (n_gp)

      call shape_gauss_points(2, merge(3, self%n_side, is_mass), point, weight)
   end subroutine serendipity_rule

   !> The bilinear function that fits the values at the points best: 1, x, y and x y are orthogonal
   !> there.
   pure subroutine serendipity_to_nodes(self, weight)
      class(shape_serendipity_t), intent(in) :: self
      real(wp), allocatable, intent(out) :: weight(:, :)     !! (n_gp, 8)
      real(wp), allocatable :: point(:, :), w(:)
      real(wp) :: square
      integer :: i

      call self%rule(.false., point, w)
      square = dot_product(w, point(1, :)**2)/sum(w)
      allocate(weight(size(w), 8))
      do i = 1, 8
         weight(:, i) = w/sum(w)*(1.0_wp + node(1, i)*point(1, :)/square) &
            *(1.0_wp + node(2, i)*point(2, :)/square)
      end do
   end subroutine serendipity_to_nodes

end module emcon_shape_serendipity_plane
