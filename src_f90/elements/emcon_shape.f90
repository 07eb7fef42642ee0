!> What the shape of an element is: functions of natural coordinates, one per node, and points to
!> integrate by.
!>
!> Source: docs/theory.md, section 2.
module emcon_shape
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   implicit none
   private
   public :: max_element_nodes, max_plane_nodes, shape_t, shape_table_t, shape_tabulate, shape_fault
   public :: shape_gauss_points

   !> Most nodes of an element, and of one in the plane: work space for one has room for these.
   integer, parameter :: max_element_nodes = 20, max_plane_nodes = 9

   type, abstract :: shape_t
   contains
      procedure(places_interface), deferred :: places
      procedure(values_interface), deferred :: values
      procedure(rule_interface), deferred :: rule
      procedure :: to_nodes => shape_to_nodes
   end type shape_t

   !> Shape functions at the points of one quadrature rule.
   type :: shape_table_t
      integer :: n_node = 0
      integer :: n_gp = 0
      real(wp), allocatable :: place(:, :)       !! (n_dim, n_node) natural coordinates
      real(wp), allocatable :: point(:, :)       !! (n_dim, n_gp) natural coordinates
      real(wp), allocatable :: weight(:)         !! (n_gp)
      real(wp), allocatable :: value(:, :)       !! (n_node, n_gp)
      real(wp), allocatable :: slope(:, :, :)    !! (n_dim, n_node, n_gp) by natural coordinates
   end type shape_table_t

   abstract interface
      !> Natural coordinates of the nodes, in the order of decks.
      pure subroutine places_interface(self, place)
         import :: shape_t, wp
         class(shape_t), intent(in) :: self
         real(wp), allocatable, intent(out) :: place(:, :)   !! (n_dim, n_node)
      end subroutine places_interface

      !> Values and natural derivatives of the shape functions at `point`.
      pure subroutine values_interface(self, point, value, slope)
         import :: shape_t, wp
         class(shape_t), intent(in) :: self
         real(wp), intent(in) :: point(:)                    !! (n_dim) natural coordinates
         real(wp), intent(out) :: value(:)                   !! (n_node)
         real(wp), intent(out) :: slope(:, :)                !! (n_dim, n_node)
      end subroutine values_interface

      !> Points and weights for mass, or else for stiffness and stress.
      pure subroutine rule_interface(self, is_mass, point, weight)
         import :: shape_t, wp
         class(shape_t), intent(in) :: self
         logical, intent(in) :: is_mass
         real(wp), allocatable, intent(out) :: point(:, :)   !! (n_dim, n_gp) natural coordinates
         real(wp), allocatable, intent(out) :: weight(:)     !! (n_gp) > 0
      end subroutine rule_interface
   end interface

contains

   !> The shape functions at the points for mass, or else for stiffness and stress.
   pure subroutine shape_tabulate(shape, is_mass, table)
      class(shape_t), intent(in) :: shape
      logical, intent(in) :: is_mass
      type(shape_table_t), intent(out) :: table
      integer :: k

      call shape%places(table%place)
      call shape%rule(is_mass, table%point, table%weight)
      table%n_node = size(table%place, 2)
      table%n_gp = size(table%weight)
      allocate(table%value(table%n_node, table%n_gp), &
         table%slope(size(table%place, 1), table%n_node, table%n_gp))
      do k = 1, table%n_gp
         call shape%values(table%point(:, k), table%value(:, k), table%slope(:, :, k))
      end do
   end subroutine shape_tabulate

   !> weight(k, i): part of point k of the stiffness in the value at node i. Here, of the linear
   !> function that fits the values at the points best; the mean where points do not tell it.
   pure subroutine shape_to_nodes(self, weight)
      class(shape_t), intent(in) :: self
      real(wp), allocatable, intent(out) :: weight(:, :)     !! (n_gp, n_node)
      real(wp), parameter :: flat = sqrt(epsilon(1.0_wp))
      real(wp), allocatable :: place(:, :), point(:, :), w(:)
      real(wp) :: square, part
      integer :: a, b, i

      call self%places(place)
      call self%rule(.false., point, w)
      w = w/sum(w)
      weight = spread(w, 2, size(place, 2))
      do a = 1, size(place, 1)                   ! coordinates, orthogonal to 1 and to each other
         square = dot_product(w, point(a, :)**2)
         part = dot_product(w, point(a, :))
         point(a, :) = point(a, :) - part
         place(a, :) = place(a, :) - part
         do b = 1, a - 1
            part = dot_product(w, point(a, :)*point(b, :))
            point(a, :) = point(a, :) - part*point(b, :)
            place(a, :) = place(a, :) - part*place(b, :)
         end do
         part = dot_product(w, point(a, :)**2)
         if (.not. part > flat*square) then
            point(a, :) = 0.0_wp
            cycle
         end if
         point(a, :) = point(a, :)/sqrt(part)
         place(a, :) = place(a, :)/sqrt(part)
         do i = 1, size(place, 2)
            weight(:, i) = weight(:, i) + w*point(a, :)*place(a, i)
         end do
      end do
   end subroutine shape_to_nodes

   !> What is wrong with a shape for an element of `n_node` nodes.
   pure subroutine shape_fault(shape, n_node, fault)
      class(shape_t), intent(in) :: shape
      integer, intent(in) :: n_node
      character(len=:), allocatable, intent(out) :: fault    !! empty: nothing
      !> Sums over a few nodes, of polynomials that the giver evaluates as he likes.
      real(wp), parameter :: tol = 1024.0_wp*epsilon(1.0_wp)
      real(wp), allocatable :: place(:, :), point(:, :), weight(:)
      type(shape_table_t) :: table
      integer :: i, k

      fault = ""
      call shape%places(place)
      if (size(place, 2) /= n_node) then
         fault = "it has " // to_text(size(place, 2)) // " nodes, not " // to_text(n_node)
         return
      end if
      do i = 1, 2
         call shape%rule(i == 2, point, weight)
         if (size(weight) < 1 .or. size(point, 2) /= size(weight)) then
            fault = "a rule of its quadrature has no points, or not as many as weights"
         else if (.not. all(weight > 0.0_wp)) then
            fault = "a weight of its quadrature is not positive"
         end if
         if (fault /= "") return
         call shape_tabulate(shape, i == 2, table)
         do k = 1, table%n_gp
            if (.not. abs(sum(table%value(:, k)) - 1.0_wp) <= tol*sum(abs(table%value(:, k)))) then
              fault = "the sum of its shape functions is not 1"
            end if
            associate (slope => table%slope(:, :, k))
               if (.not. all(abs(sum(slope, 2)) <= tol*sum(abs(slope)))) then
                 fault = "the sum of the slopes of its shape functions is not 0"
               end if
            end associate
         end do
      end do
   end subroutine shape_fault

   !> Gauss points of -1..1 in each coordinate, the first one runs fastest: of three along a side
   !> exact to degree 5, of two to degree 3.
   pure subroutine shape_gauss_points(n_dim, n_side, point, weight)
      integer, intent(in) :: n_dim
      integer, intent(in) :: n_side              !! points along a side, 2 or 3
      real(wp), allocatable, intent(out) :: point(:, :)      !! (n_dim, n_side**n_dim)
      real(wp), allocatable, intent(out) :: weight(:)        !! (n_side**n_dim)
      real(wp), parameter :: near = 1.0_wp/sqrt(3.0_wp), wide = sqrt(0.6_wp)
      real(wp) :: x(n_side), w(n_side)
      integer :: at(n_dim), a, i

      if (n_side == 3) then
         x = [-wide, 0.0_wp, wide]
         w = [5.0_wp, 8.0_wp, 5.0_wp]/9.0_wp
      else
         x = [-near, near]
         w = 1.0_wp
      end if
      allocate(point(n_dim, n_side**n_dim), weight(n_side**n_dim))
      do i = 1, size(weight)
         at = 1 + [(modulo((i - 1)/n_side**a, n_side), a = 0, n_dim - 1)]
         point(:, i) = x(at)
         weight(i) = product(w(at))
      end do
   end subroutine shape_gauss_points

end module emcon_shape
