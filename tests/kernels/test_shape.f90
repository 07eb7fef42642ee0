!> Shape functions and quadrature against the polynomials that they have to reproduce.
module test_shape
   use check, only : check_equal, check_near, test_case_t
   use emcon_element_kinds, only : element_kinds, find_element_kind, max_element_nodes
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_shape, only : shape_create, shape_t, shape_values
   use emcon_text, only : to_text
   implicit none
   private
   public :: collect_shape

   real(wp), parameter :: tol = 8.0_wp*epsilon(1.0_wp)
   !> Natural coordinates of the nodes.
   real(wp), parameter :: triangle(2, 3) = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, &
      1.0_wp], [2, 3])
   real(wp), parameter :: square(2, 4) = reshape([-1.0_wp, -1.0_wp, 1.0_wp, -1.0_wp, 1.0_wp, &
      1.0_wp, -1.0_wp, 1.0_wp], [2, 4])

contains

   subroutine collect_shape(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("partition of unity", test_unity), &
         test_case_t("linear functions are reproduced", test_linear), &
         test_case_t("one at its own node, zero at the others", test_nodes), &
         test_case_t("slopes", test_slopes), &
         test_case_t("quadrature of polynomials", test_quadrature), &
         test_case_t("values at the points", test_points)]
   end subroutine collect_shape

   pure function nodes_of(kind) result(x)
      integer, intent(in) :: kind
      real(wp) :: x(2, max_element_nodes)

      x = 0.0_wp
      if (element_kinds(kind)%name == "CPE3") x(:, :3) = triangle
      if (element_kinds(kind)%name == "CPE4") x(:, :4) = square
   end function nodes_of

   subroutine test_unity(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: point(2), value(max_element_nodes), slope(2, max_element_nodes)
      integer :: kind, i

      do kind = 1, size(element_kinds)
         do i = 1, 20
            call random_number(point)
            call shape_values(kind, point, value, slope)
            call check_near(error, sum(value), 1.0_wp, tol, 1.0_wp, "sum of the values")
            call check_near(error, sum(slope, dim=2), [0.0_wp, 0.0_wp], tol, 1.0_wp, &
               "sum of the slopes")
         end do
      end do
   end subroutine test_unity

   subroutine test_linear(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: point(2), value(max_element_nodes), slope(2, max_element_nodes)
      real(wp), parameter :: identity(2, 2) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
      integer :: kind, i

      do kind = 1, size(element_kinds)
         do i = 1, 20
            call random_number(point)
            call shape_values(kind, point, value, slope)
            call check_near(error, matmul(nodes_of(kind), value), point, tol, 1.0_wp, "position")
            call check_near(error, matmul(nodes_of(kind), transpose(slope)), identity, tol, &
               1.0_wp, "its slopes")
         end do
      end do
   end subroutine test_linear

   subroutine test_nodes(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x(2, max_element_nodes), expected(max_element_nodes)
      real(wp) :: value(max_element_nodes), slope(2, max_element_nodes)
      integer :: kind, i

      do kind = 1, size(element_kinds)
         x = nodes_of(kind)
         do i = 1, element_kinds(kind)%n_node
            expected = 0.0_wp
            expected(i) = 1.0_wp
            call shape_values(kind, x(:, i), value, slope)
            call check_near(error, value, expected, 0.0_wp, 1.0_wp, &
               element_kinds(kind)%name // " at node " // to_text(i))
         end do
      end do
   end subroutine test_nodes

   !> Along a coordinate the functions are linear: a central difference is exact.
   subroutine test_slopes(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: point(2), way(2), up(max_element_nodes), down(max_element_nodes)
      real(wp) :: slope(2, max_element_nodes), other(2, max_element_nodes)
      integer :: kind, a

      do kind = 1, size(element_kinds)
         call random_number(point)
         call shape_values(kind, point, up, slope)
         do a = 1, 2
            way = 0.0_wp
            way(a) = 0.5_wp
            call shape_values(kind, point + way, up, other)
            call shape_values(kind, point - way, down, other)
            call check_near(error, slope(a, :), up - down, tol, 1.0_wp, element_kinds(kind)%name)
         end do
      end do
   end subroutine test_slopes

   !> Triangle: 1 point to degree 1, 3 points to degree 2; square: 2 x 2 points to x^3 y^3.
   subroutine test_quadrature(error)
      type(error_t), allocatable, intent(out) :: error
      type(shape_t) :: stiffness, mass

      call shape_create(find_element_kind("CPE3"), stiffness, mass)
      call check_rule(error, stiffness, 1, "CPE3, stiffness")
      call check_rule(error, mass, 2, "CPE3, mass")
      call shape_create(find_element_kind("CPE4"), stiffness, mass)
      call check_rule(error, stiffness, 3, "CPE4, stiffness")
      call check_rule(error, mass, 3, "CPE4, mass")
   end subroutine test_quadrature

   !> int x^p y^q: p! q!/(p + q + 2)! on the triangle, 4/((p + 1)(q + 1)) on the square, if even.
   subroutine check_rule(error, rule, degree, what)
      type(error_t), allocatable, intent(inout) :: error
      type(shape_t), intent(in) :: rule
      integer, intent(in) :: degree              !! of the product on the triangle, else of each
      character(len=*), intent(in) :: what
      real(wp) :: integral, expected
      integer :: p, q, k

      do p = 0, degree
         do q = 0, degree
            if (rule%n_node == 3) then
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
      type(shape_t) :: stiffness, mass
      real(wp) :: value(max_element_nodes), slope(2, max_element_nodes)
      integer :: kind, k

      do kind = 1, size(element_kinds)
         call shape_create(kind, stiffness, mass)
         call check_equal(error, stiffness%n_node, element_kinds(kind)%n_node, "nodes")
         do k = 1, mass%n_gp
            call shape_values(kind, mass%point(:, k), value, slope)
            call check_near(error, mass%value(:, k), value, 0.0_wp, 1.0_wp, "values")
            call check_near(error, mass%slope(:, :, k), slope, 0.0_wp, 1.0_wp, "slopes")
         end do
      end do
   end subroutine test_points

end module test_shape
