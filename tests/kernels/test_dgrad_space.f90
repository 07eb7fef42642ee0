!> Leaves of the arithmetic in space: dot product, area, affine coordinates, height.
module test_dgrad_space
   use check, only : check_near, test_case_t
   use emcon_dgrad9, only : dg_affine, dg_area, dg_dot, dg_height, dg_plane, dg_t, difference, &
      difference_t
   use emcon_dgrad_nodes, only : nodes_add_first
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_dgrad_space

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Some 100 roundings of quantities of size 1.
   real(wp), parameter :: tol = 128.0_wp*eps
   integer, parameter :: n_leaf = 5
   character(len=12), parameter :: name(n_leaf) = [character(len=12) :: "dot product", "area", &
      "xi", "eta", "height"]
   !> A facet and a point over it: n = (0, 0, 1), |a x b| = 1.
   real(wp), parameter :: plain(3, 4) = reshape([0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, &
      0.0_wp, 1.0_wp, 0.0_wp, 0.25_wp, 0.5_wp, 0.75_wp], [3, 4])

contains

   subroutine collect_dgrad_space(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("closed forms", test_closed), &
         test_case_t("identity, also for tiny steps", test_identity), &
         test_case_t("momenta", test_momenta), &
         test_case_t("rigid motions", test_rigid), &
         test_case_t("gradients and second derivatives", test_derivatives)]
   end subroutine collect_dgrad_space

   !> Leaf `which` over nodes 1 (origin), 2 and 3 (tips of a and b) and 4 (tip of d).
   pure type(dg_t) function leaf(which, x0, dx)
      integer, intent(in) :: which
      real(wp), intent(in) :: x0(3, 4), dx(3, 4)
      type(difference_t) :: a, b, d
      type(dg_t) :: xi, eta

      a = difference(2, 1, x0, dx)
      b = difference(3, 1, x0, dx)
      d = difference(4, 1, x0, dx)
      call dg_affine(d, a, b, dg_plane(a, b), xi, eta)
      select case (which)
      case (1)
         leaf = dg_dot(d, difference(3, 2, x0, dx))
      case (2)
         leaf = dg_area(a, difference(3, 2, x0, dx))
      case (3)
         leaf = xi
      case (4)
         leaf = eta
      case default
         leaf = dg_height(d, a, b)
      end select
   end function leaf

   !> `plain` moved by up to `size` in any direction.
   subroutine draw(size, x)
      real(wp), intent(in) :: size
      real(wp), intent(out) :: x(3, 4)

      call draw_random(x)
      x = plain + size*(2.0_wp*x - 1.0_wp)
   end subroutine draw

   subroutine test_closed(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x(3, 4), turn(3, 3)
      real(wp), parameter :: exact(n_leaf) = [0.25_wp, 1.0_wp, 0.25_wp, 0.5_wp, 0.75_wp]
      type(dg_t) :: s
      integer :: k, which

      do k = 0, 20
         turn = turned(0.3_wp*real(k, wp), 0.7_wp*real(k, wp))
         x = matmul(turn, plain) + 0.1_wp*real(k, wp)
         do which = 1, n_leaf
            s = leaf(which, x, 0.0_wp*x)
            call check_near(error, [s%f0, s%f1, s%df], [exact(which), exact(which), 0.0_wp], tol, &
               1.0_wp, name(which))
         end do
      end do
   end subroutine test_closed

   !> About the third axis, then about the first one.
   pure function turned(first, second) result(turn)
      real(wp), intent(in) :: first, second
      real(wp) :: turn(3, 3)
      real(wp) :: one(3, 3)

      one = 0.0_wp
      one(3, 3) = 1.0_wp
      one(1, :2) = [cos(first), -sin(first)]
      one(2, :2) = [sin(first), cos(first)]
      turn = 0.0_wp
      turn(1, 1) = 1.0_wp
      turn(2, 2:) = [cos(second), -sin(second)]
      turn(3, 2:) = [sin(second), cos(second)]
      turn = matmul(turn, one)
   end function turned

   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x0(3, 4), dx(3, 4), size
      type(dg_t) :: s
      integer :: k, which

      do k = 1, 60
         call draw(0.3_wp, x0)
         call draw(0.3_wp, dx)
         size = 0.25_wp**mod(k, 20)
         dx = size*(dx - plain)
         do which = 1, n_leaf
            s = leaf(which, x0, dx)
            associate (way => reshape(dx(:, 2:) - spread(dx(:, 1), 2, 3), [9]))
               call check_near(error, dot_product(s%g, way), s%df, tol, &
                  sum(abs(s%g))*size, "identity of " // name(which))
            end associate
            call check_near(error, s%f0 + s%df, s%f1, tol, 4.0_wp, "values of " // name(which))
         end do
      end do
   end subroutine test_identity

   subroutine test_momenta(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x0(3, 4), dx(3, 4), g(3, 4), moment(3)
      type(dg_t) :: s
      integer :: i, k, which

      do k = 1, 40
         call draw(0.3_wp, x0)
         call draw(0.3_wp, dx)
         dx = dx - x0
         do which = 1, n_leaf
            s = leaf(which, x0, dx)
            g = 0.0_wp
            call nodes_add_first(1.0_wp, s%g, [1, 2, 3, 4], g)
            moment = 0.0_wp
            do i = 1, 4
               associate (x => x0(:, i) + 0.5_wp*dx(:, i))
                  moment = moment + [x(2)*g(3, i) - x(3)*g(2, i), x(3)*g(1, i) - x(1)*g(3, i), &
                     x(1)*g(2, i) - x(2)*g(1, i)]
               end associate
            end do
            call check_near(error, moment, [0.0_wp, 0.0_wp, 0.0_wp], tol, sum(abs(g)), &
               "moment of " // name(which))
         end do
      end do
   end subroutine test_momenta

   !> Moved as a rigid body, the leaves stay.
   subroutine test_rigid(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x0(3, 4), x1(3, 4)
      type(dg_t) :: s
      integer :: k, which

      do k = 1, 20
         call draw(0.3_wp, x0)
         x1 = matmul(turned(0.1_wp*real(k, wp), 0.05_wp*real(k, wp)), x0) + 0.2_wp
         do which = 1, n_leaf
            s = leaf(which, x0, x1 - x0)
            call check_near(error, [s%f1, s%df], [s%f0, 0.0_wp], tol, 4.0_wp, &
               name(which) // " of a body that turns")
         end do
      end do
   end subroutine test_rigid

   !> Against central differences over the end: their error is the square of the way times third
   !> derivatives, of size 100 here, beside round-off by the way.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: x0(3, 4), dx(3, 4), way(3, 4), step, bound
      type(dg_t) :: s, up, down
      integer :: i, j, k, which

      step = eps**(1.0_wp/3.0_wp)
      bound = 500.0_wp*step**2
      do k = 1, 20
         call draw(0.3_wp, x0)
         call draw(0.3_wp, dx)
         dx = dx - x0
         do which = 1, n_leaf
            s = leaf(which, x0, dx)
            do i = 1, 9
               way = 0.0_wp
               way(:, 2:) = step*reshape([(merge(1.0_wp, 0.0_wp, j == i), j = 1, 9)], [3, 3])
               up = leaf(which, x0, dx + way)
               down = leaf(which, x0, dx - way)
               call check_near(error, s%c(i), (up%f1 - down%f1)/(2.0_wp*step), bound, 1.0_wp, &
                  "gradient of " // name(which))
               call check_near(error, s%h(:, i), (up%g - down%g)/(2.0_wp*step), bound, 1.0_wp, &
                  "second derivative of " // name(which))
            end do
         end do
      end do
   end subroutine test_derivatives

end module test_dgrad_space
