!> Quadrilateral of nine nodes: biquadratic functions on [-1, 1] x [-1, 1], 3 x 3 points.
!>
!> An element from outside: one file against the installed modules. Its row is a *USER ELEMENT with
!> NODES=9, FACES=8: corners and midside nodes around the outline, counter-clockwise from a corner,
!> then the one in the middle.
module nine_node_shape
   use emcon_api, only : shape_t, wp
   implicit none
   private
   public :: nine_node_shape_t

   type, extends(shape_t) :: nine_node_shape_t
   contains
      procedure :: places
      procedure :: values
      procedure :: rule
   end type nine_node_shape_t

   integer, parameter :: node(2, 9) = reshape([-1, -1, 0, -1, 1, -1, 1, 0, 1, 1, 0, 1, -1, 1, &
      -1, 0, 0, 0], [2, 9])

contains

   pure subroutine places(self, place)
      class(nine_node_shape_t), intent(in) :: self
      real(wp), allocatable, intent(out) :: place(:, :)

      place = real(node, wp)
   end subroutine places

   pure subroutine values(self, point, value, slope)
      class(nine_node_shape_t), intent(in) :: self
      real(wp), intent(in) :: point(:)
      real(wp), intent(out) :: value(:), slope(:, :)
      real(wp) :: f(-1:1, 2), d(-1:1, 2)
      integer :: i

      do i = 1, 2
         f(:, i) = [0.5_wp*point(i)*(point(i) - 1.0_wp), 1.0_wp - point(i)**2, &
            0.5_wp*point(i)*(point(i) + 1.0_wp)]
         d(:, i) = [point(i) - 0.5_wp, -2.0_wp*point(i), point(i) + 0.5_wp]
      end do
      do i = 1, 9
         value(i) = f(node(1, i), 1)*f(node(2, i), 2)
         slope(:, i) = [d(node(1, i), 1)*f(node(2, i), 2), f(node(1, i), 1)*d(node(2, i), 2)]
      end do
   end subroutine values

   pure subroutine rule(self, is_mass, point, weight)
      class(nine_node_shape_t), intent(in) :: self
      logical, intent(in) :: is_mass
      real(wp), allocatable, intent(out) :: point(:, :), weight(:)
      real(wp), parameter :: outer = 5.0_wp/9.0_wp, inner = 8.0_wp/9.0_wp

      point = sqrt(0.6_wp)*real(node, wp)
      weight = merge(inner, outer, node(1, :) == 0)*merge(inner, outer, node(2, :) == 0)
   end subroutine rule

end module nine_node_shape
