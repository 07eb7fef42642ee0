!> Shape functions and quadrature against the polynomials that they have to reproduce.
module test_shape
   use check, only : check_equal, check_near, test_case_t
   use emcon_element_kind, only : element_kind_t
   use emcon_element_registry, only : element_kinds_create, find_element_row
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_shape, only : shape_fault, shape_t, shape_table_t, shape_tabulate
   use emcon_shape_quadrilateral_plane, only : shape_quadrilateral_t
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_shape

   real(wp), parameter :: tol = 8.0_wp*epsilon(1.0_wp)

   !> A quadrilateral that says no more than it has to, and has a fault.
   type, extends(shape_t) :: plain_t
      type(shape_quadrilateral_t) :: own
      integer :: fault = 0
   contains
      procedure :: places => plain_places
      procedure :: values => plain_values
      procedure :: rule => plain_rule
   end type plain_t
   integer, parameter :: fault_value = 1, fault_slope = 2, fault_weight = 3, fault_points = 4
contains

   subroutine collect_shape(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("partition of unity", test_unity), &
         test_case_t("linear functions are reproduced", test_linear), &
         test_case_t("one at its own node, zero at the others", test_nodes), &
         test_case_t("slopes", test_slopes), &
         test_case_t("quadrature of polynomials", test_quadrature), &
         test_case_t("values at the points", test_points), &
         test_case_t("from the points to the nodes", test_to_nodes), &
         test_case_t("a shape from outside that cannot be one", test_faults)]
   end subroutine collect_shape

   subroutine test_unity(error)
      type(error_t), allocatable, intent(out) :: error
      type(element_kind_t), allocatable :: kind(:)
      real(wp), allocatable :: value(:), slope(:, :)
      real(wp) :: point(2)
      integer :: i, k

      call element_kinds_create(2, kind)
      do k = 1, size(kind)
         call make_room(kind(k), value, slope)
         do i = 1, 20
            call draw_random(point)
            call kind(k)%shape%values(point, value, slope)
            call check_near(error, sum(value), 1.0_wp, tol, 1.0_wp, "sum of the values")
            call check_near(error, sum(slope, dim=2), [0.0_wp, 0.0_wp], tol, 1.0_wp, &
               "sum of the slopes")
         end do
      end do
   end subroutine test_unity

   subroutine make_room(kind, value, slope)
      type(element_kind_t), intent(in) :: kind
      real(wp), allocatable, intent(out) :: value(:), slope(:, :)

      allocate(value(kind%n_node), slope(2, kind%n_node))
   end subroutine make_room

   subroutine test_linear(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: identity(2, 2) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
      type(element_kind_t), allocatable :: kind(:)
      real(wp), allocatable :: value(:), slope(:, :), place(:, :)
      real(wp) :: point(2)
      integer :: i, k

      call element_kinds_create(2, kind)
      do k = 1, size(kind)
         call make_room(kind(k), value, slope)
         call kind(k)%shape%places(place)
         do i = 1, 20
            call draw_random(point)
            call kind(k)%shape%values(point, value, slope)
            call check_near(error, matmul(place, value), point, tol, 1.0_wp, "position")
            call check_near(error, matmul(place, transpose(slope)), identity, tol, 1.0_wp, &
               "its slopes")
         end do
      end do
   end subroutine test_linear

   subroutine test_nodes(error)
      type(error_t), allocatable, intent(out) :: error
      type(element_kind_t), allocatable :: kind(:)
      real(wp), allocatable :: value(:), slope(:, :), place(:, :), expected(:)
      integer :: i, k

      call element_kinds_create(2, kind)
      do k = 1, size(kind)
         call make_room(kind(k), value, slope)
         call kind(k)%shape%places(place)
         call check_equal(error, size(place, 2), kind(k)%n_node, "nodes")
         do i = 1, kind(k)%n_node
            if (allocated(expected)) deallocate(expected)
            allocate(expected(kind(k)%n_node), source=0.0_wp)
            expected(i) = 1.0_wp
            call kind(k)%shape%values(place(:, i), value, slope)
            call check_near(error, value, expected, 0.0_wp, 1.0_wp, &
               kind(k)%name // " at node " // to_text(i))
         end do
      end do
   end subroutine test_nodes

   !> Along a coordinate the functions are no more than quadratic: a central difference is exact.
   subroutine test_slopes(error)
      type(error_t), allocatable, intent(out) :: error
      type(element_kind_t), allocatable :: kind(:)
      real(wp), allocatable :: up(:), down(:), slope(:, :), other(:, :)
      real(wp) :: point(2), way(2)
      integer :: k, a

      call element_kinds_create(2, kind)
      do k = 1, size(kind)
         call make_room(kind(k), up, slope)
         call make_room(kind(k), down, other)
         call draw_random(point)
         call kind(k)%shape%values(point, up, slope)
         do a = 1, 2
            way = 0.0_wp
            way(a) = 0.5_wp
            call kind(k)%shape%values(point + way, up, other)
            call kind(k)%shape%values(point - way, down, other)
            call check_near(error, slope(a, :), up - down, tol, 1.0_wp, kind(k)%name)
         end do
      end do
   end subroutine test_slopes

   !> Triangle: 1 point to degree 1, 3 points to degree 2, 6 to 4; square: 2 x 2 points to x^3 y^3,
   !> 3 x 3 to x^5 y^5.
   subroutine test_quadrature(error)
      type(error_t), allocatable, intent(out) :: error

      call check_kind(error, "CPE3", 1, 2)
      call check_kind(error, "CPE4", 3, 3)
      call check_kind(error, "CPE6", 2, 4)
      call check_kind(error, "CPE8", 5, 5)
      call check_kind(error, "CPE8R", 3, 5)
   end subroutine test_quadrature

   subroutine check_kind(error, name, degree, mass_degree)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: name
      integer, intent(in) :: degree, mass_degree
      type(element_kind_t), allocatable :: kind(:)
      type(shape_table_t) :: table

      call element_kinds_create(2, kind)
      associate (shape => kind(find_element_row(name))%shape)
         call shape_tabulate(shape, .false., table)
         call check_rule(error, table, degree, name // ", stiffness")
         call shape_tabulate(shape, .true., table)
         call check_rule(error, table, mass_degree, name // ", mass")
      end associate
   end subroutine check_kind

   !> int x^p y^q: p! q!/(p + q + 2)! on the triangle, 4/((p + 1)(q + 1)) on the square, if even.
   subroutine check_rule(error, rule, degree, what)
      type(error_t), allocatable, intent(inout) :: error
      type(shape_table_t), intent(in) :: rule
      integer, intent(in) :: degree              !! of the product on the triangle, else of each
      character(len=*), intent(in) :: what
      real(wp) :: integral, expected
      integer :: p, q, k

      do p = 0, degree
         do q = 0, degree
            if (any(rule%n_node == [3, 6])) then
               if (p + q > degree) cycle
               expected = gamma(real(p + 1, wp))*gamma(real(q + 1, wp))/gamma(real(p + q + 3, wp))
            else
               expected = real((1 + (-1)**p)*(1 + (-1)**q), wp)/real((p + 1)*(q + 1), wp)
            end if
            integral = 0.0_wp
            do k = 1, rule%n_gp
               integral = integral + rule%weight(k)*rule%point(1, k)**p*rule%point(2, k)**q
            end do
            call check_near(error, integral, expected, tol, 1.0_wp, &
               what // ", x^" // to_text(p) // " y^" // to_text(q))
         end do
      end do
   end subroutine check_rule

   subroutine test_points(error)
      type(error_t), allocatable, intent(out) :: error
      type(element_kind_t), allocatable :: kind(:)
      type(shape_table_t) :: mass
      real(wp), allocatable :: value(:), slope(:, :)
      integer :: i, k

      call element_kinds_create(2, kind)
      do k = 1, size(kind)
         call make_room(kind(k), value, slope)
         call shape_tabulate(kind(k)%shape, .true., mass)
         call check_equal(error, mass%n_node, kind(k)%n_node, "nodes")
         do i = 1, mass%n_gp
            call kind(k)%shape%values(mass%point(:, i), value, slope)
            call check_near(error, mass%value(:, i), value, 0.0_wp, 1.0_wp, "values")
            call check_near(error, mass%slope(:, :, i), slope, 0.0_wp, 1.0_wp, "slopes")
         end do
      end do
   end subroutine test_points

   !> What is carried to the nodes of a kind is, of a linear function, that function; one point
   !> tells its mean.
   subroutine test_to_nodes(error)
      type(error_t), allocatable, intent(out) :: error
      type(element_kind_t), allocatable :: kind(:)
      type(shape_table_t) :: table
      type(plain_t) :: plain
      real(wp), allocatable :: weight(:, :), place(:, :)
      integer :: k

      call element_kinds_create(2, kind)
      do k = 1, size(kind)
         call kind(k)%shape%to_nodes(weight)
         call shape_tabulate(kind(k)%shape, .false., table)
         call kind(k)%shape%places(place)
         call check_near(error, sum(weight, 1), 1.0_wp + 0.0_wp*place(1, :), tol, 1.0_wp, "sums")
         if (table%n_gp > 1) call check_near(error, matmul(table%point, weight), place, tol, &
            1.0_wp, kind(k)%name)
      end do
      call plain%to_nodes(weight)
      call plain%own%places(place)
      call check_near(error, sum(weight, 1), 1.0_wp + 0.0_wp*place(1, :), tol, 1.0_wp, "fit: sums")
      call check_near(error, matmul(place/sqrt(3.0_wp), weight), place, tol, 1.0_wp, "fit")
   end subroutine test_to_nodes

   subroutine test_faults(error)
      type(error_t), allocatable, intent(out) :: error
      type(shape_quadrilateral_t) :: quad
      character(len=:), allocatable :: fault

      call shape_fault(plain_t(quad), 4, fault)
      call check_equal(error, fault, "", "none")
      call shape_fault(plain_t(quad), 5, fault)
      call check_equal(error, fault, "it has 4 nodes, not 5", "nodes")
      call shape_fault(plain_t(quad, fault_value), 4, fault)
      call check_equal(error, fault, "the sum of its shape functions is not 1", "values")
      call shape_fault(plain_t(quad, fault_slope), 4, fault)
      call check_equal(error, fault, "the sum of the slopes of its shape functions is not 0", &
         "slopes")
      call shape_fault(plain_t(quad, fault_weight), 4, fault)
      call check_equal(error, fault, "a weight of its quadrature is not positive", "weights")
      call shape_fault(plain_t(quad, fault_points), 4, fault)
      call check_equal(error, fault, &
         "a rule of its quadrature has no points, or not as many as weights", "points")
   end subroutine test_faults

   pure subroutine plain_places(self, place)
      class(plain_t), intent(in) :: self
      real(wp), allocatable, intent(out) :: place(:, :)

      call self%own%places(place)
   end subroutine plain_places

   pure subroutine plain_values(self, point, value, slope)
      class(plain_t), intent(in) :: self
      real(wp), intent(in) :: point(:)
      real(wp), intent(out) :: value(:), slope(:, :)

      call self%own%values(point, value, slope)
      if (self%fault == fault_value) value(1) = value(1) + sqrt(epsilon(1.0_wp))
      if (self%fault == fault_slope) slope(2, 1) = slope(2, 1) + sqrt(epsilon(1.0_wp))
   end subroutine plain_values

   pure subroutine plain_rule(self, is_mass, point, weight)
      class(plain_t), intent(in) :: self
      logical, intent(in) :: is_mass
      real(wp), allocatable, intent(out) :: point(:, :), weight(:)

      call self%own%rule(is_mass, point, weight)
      if (self%fault == fault_weight .and. is_mass) weight(1) = 0.0_wp
      if (self%fault == fault_points) point = point(:, :3)
   end subroutine plain_rule

end module test_shape
