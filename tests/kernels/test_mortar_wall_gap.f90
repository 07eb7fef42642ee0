!> Distances from walls over triangles: values, identities, momenta, derivatives.
module test_mortar_wall_gap
   use check, only : check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_mortar_wall_gap_space, only : n_corner, n_part_point, wall_part_t, &
      wall_triangle_gap, wall_triangle_heights, wall_triangle_look, wall_triangle_t
   use emcon_text, only : to_text
   use emcon_wall, only : wall_flat, wall_t, wall_turned
   use random_draws, only : draw_random
   use wall_shapes, only : make_wall, n_shape, turned, unit
   implicit none
   private
   public :: collect_mortar_wall_gap

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Some 100 roundings of quantities of size 1.
   real(wp), parameter :: tol = 128.0_wp*eps
   real(wp), parameter :: size_of = 0.3_wp, target = 0.01_wp

contains

   subroutine collect_mortar_wall_gap(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("values over a plane and over a ball", test_values), &
         test_case_t("identity for steps of any size", test_identity), &
         test_case_t("momenta", test_momenta), &
         test_case_t("derivatives against differences", test_derivatives)]
   end subroutine collect_mortar_wall_gap

   !> A triangle in front of shape `number`, which is turned somehow, a step of size `size` in which
   !> both move and the triangle changes its shape, and a weight.
   subroutine draw_step(number, size, wall, x, dx, weight)
      integer, intent(in) :: number
      real(wp), intent(in) :: size
      type(wall_t), intent(out) :: wall
      real(wp), intent(out) :: x(3, n_part_point), dx(3, n_part_point), weight(n_corner)
      real(wp) :: draw(3), noise(3, n_part_point), turn(3, 3), end(3, n_part_point)

      call make_wall(number, wall)
      call draw_random(draw)
      call draw_random(noise)
      call draw_random(weight)
      x = 0.0_wp
      x(1, n_corner + 2) = unit
      x(2, n_corner + 3) = unit
      x(:, :n_corner) = size_of*noise(:, :n_corner) + spread(0.3_wp + 0.4_wp*draw, 2, n_corner)
      if (wall%kind == wall_flat .or. wall%kind == wall_turned) x(1, :n_corner) = &
         x(1, :n_corner) - 0.3_wp
      call draw_random(draw)
      turn = turned(draw)
      x = matmul(turn, x) + 0.5_wp
      call draw_random(noise)
      ! The wall moves as a rigid body, the triangle as it likes.
      end = matmul(turned(size*draw), x) + size*draw(1)
      end(:, :n_corner) = end(:, :n_corner) + 0.3_wp*size*(2.0_wp*noise(:, :n_corner) - 1.0_wp)
      dx = end - x
   end subroutine draw_step

   subroutine find_gap(wall, x, dx, weight, gap)
      type(wall_t), intent(in) :: wall
      real(wp), intent(in) :: x(3, n_part_point), dx(3, n_part_point), weight(n_corner)
      type(wall_part_t), intent(out) :: gap
      type(wall_triangle_t) :: triangle

      call wall_triangle_look(wall, x, dx, .false., triangle)
      call wall_triangle_gap(triangle, weight, target, .false., gap)
   end subroutine find_gap

   !> The integral at one configuration.
   real(wp) function value(wall, x, weight)
      type(wall_t), intent(in) :: wall
      real(wp), intent(in) :: x(3, n_part_point), weight(n_corner)
      real(wp), dimension(n_corner) :: height, cover

      call wall_triangle_heights(wall, x(:, n_corner + [1, 2, 3, 3]), x(:, :n_corner), height, &
         cover)
      value = dot_product(weight, height - target*cover)
   end function value

   !> Over a plane the closed form; over a ball what many small parts of the triangle give.
   subroutine test_values(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n = 8
      type(wall_t) :: wall
      real(wp) :: x(3, n_part_point), dx(3, n_part_point), weight(n_corner), part(3, &
         n_part_point), &
         share(n_corner, n_corner), distance(n_corner), normal(3), total
      integer :: i, j, k, way

      do k = 1, 20
         call draw_step(1, 0.1_wp, wall, x, dx, weight)
         distance = matmul(x(:, n_corner + 2) - x(:, n_corner + 1), x(:, :n_corner) &
            - spread(x(:, n_corner + 1), 2, n_corner)) - target
         associate (a => x(:, 2) - x(:, 1), b => x(:, 3) - x(:, 1))
            normal = cshift(a, 1)*cshift(b, -1) - cshift(a, -1)*cshift(b, 1)
         end associate
         call check_near(error, value(wall, x, weight), norm2(normal)/24.0_wp*(dot_product(weight, &
            distance) + sum(weight)*sum(distance)), tol, 1.0_wp, "plane")
         call draw_step(2, 0.1_wp, wall, x, dx, weight)
         total = 0.0_wp
         part = x
         do i = 0, n - 1
            do j = 0, n - 1 - i
               do way = 0, merge(1, 0, i + j < n - 1)
                  share(2, :) = [i, i + 1, i]/real(n, wp)
                  share(3, :) = [j, j, j + 1]/real(n, wp)
                  if (way == 1) share(2, :) = [i + 1, i, i + 1]/real(n, wp)
                  if (way == 1) share(3, :) = [j + 1, j + 1, j]/real(n, wp)
                  share(1, :) = 1.0_wp - share(2, :) - share(3, :)
                  part(:, :n_corner) = matmul(x(:, :n_corner), share)
                  total = total + value(wall, part, matmul(weight, share))
               end do
            end do
         end do
         call check_near(error, value(wall, x, weight), total, 1.0e-6_wp, norm2(normal), "ball")
      end do
   end subroutine test_values

   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      type(wall_t) :: wall
      real(wp) :: x(3, n_part_point), dx(3, n_part_point), weight(n_corner)
      type(wall_part_t) :: gap
      integer :: i, k, e

      do i = 1, n_shape
         do e = 0, 8, 2
            do k = 1, 20
               call draw_step(i, 10.0_wp**(-e), wall, x, dx, weight)
               call find_gap(wall, x, dx, weight, gap)
               call check_near(error, [gap%f0, gap%f1, sum(gap%g*dx)], [value(wall, x, weight), &
                  value(wall, x + dx, weight), gap%f1 - gap%f0], tol, 1.0_wp, "shape " &
                  // to_text(i) // ", step " // to_text(e))
               call check_near(error, gap%df, sum(gap%g*dx), tol, maxval(abs(dx)), "change of " // &
                  to_text(i) // ", step " // to_text(e))
            end do
         end do
      end do
   end subroutine test_identity

   !> No resultant, and no moment about where points are in the middle of the step.
   subroutine test_momenta(error)
      type(error_t), allocatable, intent(out) :: error
      type(wall_t) :: wall
      real(wp) :: x(3, n_part_point), dx(3, n_part_point), weight(n_corner), mean(3), moment(3)
      type(wall_part_t) :: gap
      integer :: i, j, k, e

      do i = 1, n_shape
         do e = 0, 8, 2
            do k = 1, 20
               call draw_step(i, 10.0_wp**(-e), wall, x, dx, weight)
               call find_gap(wall, x, dx, weight, gap)
               moment = 0.0_wp
               do j = 1, n_part_point
                  mean = x(:, j) + 0.5_wp*dx(:, j)
                  moment = moment + cshift(mean, 1)*cshift(gap%g(:, j), -1) &
                     - cshift(mean, -1)*cshift(gap%g(:, j), 1)
               end do
               call check_near(error, [sum(gap%g, 2), moment], [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
                  0.0_wp, 0.0_wp], tol, 1.0_wp, "shape " // to_text(i) // ", step " // to_text(e))
            end do
         end do
      end do
   end subroutine test_momenta

   !> The gradient at the end and the second derivatives, by central differences. Steps whose way
   !> passes a joint of a profile next to a point of quadrature are left out.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: small = 1.0e-5_wp, fine = 1.0e-7_wp
      integer, parameter :: n_draw = 20
      type(wall_t) :: wall
      real(wp), dimension(3, n_part_point) :: x, dx, there, back
      real(wp) :: weight(n_corner), slope(3*n_part_point), change(3*n_part_point, 3*n_part_point)
      type(wall_part_t) :: gap, one, other
      integer :: i, j, k, a, n, m

      m = 0
      do i = 1, n_shape
         do k = 1, n_draw
            call draw_step(i, 0.2_wp, wall, x, dx, weight)
            call find_gap(wall, x, dx, weight, gap)
            do j = 1, n_part_point
               do a = 1, 3
                  n = 3*(j - 1) + a
                  there = dx
                  back = dx
                  there(a, j) = dx(a, j) + small
                  back(a, j) = dx(a, j) - small
                  call find_gap(wall, x, there, weight, one)
                  call find_gap(wall, x, back, weight, other)
                  slope(n) = (one%f1 - other%f1)/(2.0_wp*small)
                  change(:, n) = reshape(one%g - other%g, [3*n_part_point])/(2.0_wp*small)
               end do
            end do
            if (any(abs(slope - reshape(gap%c, [3*n_part_point])) > fine) .or. &
               any(abs(change - gap%h) > 10.0_wp*fine)) m = m + 1
         end do
      end do
      call check_true(error, m <= 2, to_text(m) // " of " // to_text(n_draw*n_shape) &
         // " are wrong")
   end subroutine test_derivatives

end module test_mortar_wall_gap
