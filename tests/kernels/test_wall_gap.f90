!> Distances of nodes from walls over a step: values, identities, momenta, derivatives.
module test_wall_gap
   use check, only : check_near, check_true, test_case_t
   use emcon_dgrad_nodes, only : nodes_add_first
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   use emcon_wall, only : wall_drawn, wall_flat, wall_round, wall_t, wall_turned
   use emcon_wall_distance_space, only : wall_find, wall_spot_t
   use emcon_wall_gap_space, only : dg_t, wall_gap
   use emcon_wall_shape_space, only : wall_shape_make, wall_shape_t
   use random_draws, only : draw_random
   use wall_shapes, only : make_wall, n_shape, turned, unit
   implicit none
   private
   public :: collect_wall_gap

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Some 100 roundings of quantities of size 1.
   real(wp), parameter :: tol = 128.0_wp*eps

contains

   subroutine collect_wall_gap(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("values are those of the shapes", test_values), &
         test_case_t("identity for steps of any size", test_identity), &
         test_case_t("momenta", test_momenta), &
         test_case_t("no moment about an axis of revolution", test_axis), &
         test_case_t("derivatives against differences", test_derivatives), &
         test_case_t("a node on the axis", test_on_axis), &
         test_case_t("faces that show it lie on it, and face out", test_faces)]
   end subroutine collect_wall_gap

   !> A node near shape `number`, which is turned somehow, and a step of size `size`.
   subroutine draw_step(number, size, wall, x, dx)
      integer, intent(in) :: number
      real(wp), intent(in) :: size
      type(wall_t), intent(out) :: wall
      real(wp), intent(out) :: x(3, 4), dx(3, 4)
      real(wp) :: draw(3), noise(3, 4), at(2), turn(3, 3), end(3, 4)

      call make_wall(number, wall)
      call draw_random(draw)
      select case (number)
      case (1)
         at = [2.0_wp*draw(1) - 1.0_wp, 0.1_wp*(draw(2) - 0.5_wp)]
      case (2, 3)
         at = (1.0_wp + 0.1_wp*(draw(2) - 0.5_wp))*[sin(3.0_wp*draw(1)), cos(3.0_wp*draw(1))]
      case default
         associate (p => wall%piece(1 + mod(int(1000.0_wp*draw(3)), size_of(wall))))
            at = p%from + draw(1)*(p%to - p%from) + 0.02_wp*draw(2)
         end associate
      end select
      x = 0.0_wp
      x(1, 3) = unit
      x(2, 4) = unit
      associate (angle => 6.0_wp*draw(3))
         select case (wall%kind)
         case (wall_flat)
            x(:, 1) = [at(2), at(1), draw(3)]
         case (wall_drawn)
            x(:, 1) = [at(1), at(2), draw(3)]
         case default
            x(:, 1) = [at(2), at(1)*cos(angle), at(1)*sin(angle)]
         end select
      end associate
      call draw_random(draw)
      turn = turned(draw)
      x = matmul(turn, x) + 0.5_wp
      call draw_random(noise)
      ! The wall moves as a rigid body, the node as it likes.
      end = matmul(turned(size*draw), x) + size*draw(1)
      end(:, 1) = end(:, 1) + 0.3_wp*size*(2.0_wp*noise(:, 1) - 1.0_wp)
      dx = end - x
   end subroutine draw_step

   pure integer function size_of(wall)
      type(wall_t), intent(in) :: wall

      size_of = size(wall%piece)
   end function size_of

   !> The distance of the first node, by itself.
   pure real(wp) function distance(wall, x)
      type(wall_t), intent(in) :: wall
      real(wp), intent(in) :: x(3, 4)
      type(wall_spot_t) :: spot

      spot = wall_find(wall, x(:, [2, 3, 4, 4]), x(:, 1))
      distance = spot%distance
   end function distance

   !> Of the shapes that have a formula, in their own axes.
   subroutine test_values(error)
      type(error_t), allocatable, intent(out) :: error
      type(wall_t) :: wall
      real(wp) :: x(3, 4), draw(3)
      type(dg_t) :: gap
      integer :: k

      do k = 1, 50
         call draw_random(draw)
         x = 0.0_wp
         x(1, 3) = unit
         x(2, 4) = unit
         x(:, 1) = 2.0_wp*draw - 1.0_wp
         call make_wall(1, wall)
         gap = wall_gap(wall, x, 0.0_wp*x)
         call check_near(error, [gap%f0, distance(wall, x)], [x(1, 1), x(1, 1)], tol, 1.0_wp, &
            "plane")
         call make_wall(3, wall)
         gap = wall_gap(wall, x, 0.0_wp*x)
         associate (expected => 1.0_wp - norm2(x(:, 1)))
            call check_near(error, [gap%f0, distance(wall, x)], [expected, expected], tol, 1.0_wp, &
               "bowl")
         end associate
         call make_wall(5, wall)
         x(1, 1) = -0.5_wp
         gap = wall_gap(wall, x, 0.0_wp*x)
         associate (expected => 0.8_wp - norm2(x(2:, 1)))
            call check_near(error, [gap%f0, distance(wall, x)], [expected, expected], tol, 1.0_wp, &
               "tube")
         end associate
         call make_wall(7, wall)
         x(2, 1) = -abs(x(2, 1))
         gap = wall_gap(wall, x, 0.0_wp*x)
         associate (expected => 1.0_wp - norm2(x(:2, 1)))
            call check_near(error, [gap%f0, distance(wall, x)], [expected, expected], tol, 1.0_wp, &
               "groove")
         end associate
      end do
   end subroutine test_values

   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      type(wall_t) :: wall
      real(wp) :: x(3, 4), dx(3, 4), full(3, 4)
      type(dg_t) :: gap
      integer :: i, k, e

      do i = 1, n_shape
         do e = 0, 8
            do k = 1, 40
               call draw_step(i, 10.0_wp**(-e), wall, x, dx)
               gap = wall_gap(wall, x, dx)
               full = 0.0_wp
               call nodes_add_first(1.0_wp, gap%g, [1, 2, 3, 4], full)
               call check_near(error, sum(full*dx), distance(wall, x + dx) - distance(wall, x), &
                  tol, 1.0_wp, "shape " // to_text(i) // ", step " // to_text(e))
               call check_near(error, gap%df, sum(full*dx), tol, maxval(abs(dx)), "change of " // &
                  to_text(i) // ", step " // to_text(e))
            end do
         end do
      end do
   end subroutine test_identity

   !> No moment about where nodes are in the middle of the step.
   subroutine test_momenta(error)
      type(error_t), allocatable, intent(out) :: error
      type(wall_t) :: wall
      real(wp) :: x(3, 4), dx(3, 4), full(3, 4), mean(3, 4), moment(3)
      type(dg_t) :: gap
      integer :: i, j, k, e

      do i = 1, n_shape
         do e = 0, 8
            do k = 1, 40
               call draw_step(i, 10.0_wp**(-e), wall, x, dx)
               gap = wall_gap(wall, x, dx)
               full = 0.0_wp
               call nodes_add_first(1.0_wp, gap%g, [1, 2, 3, 4], full)
               mean = x + 0.5_wp*dx
               moment = 0.0_wp
               do j = 1, 4
                  moment = moment + cshift(mean(:, j), 1)*cshift(full(:, j), -1) &
                     - cshift(mean(:, j), -1)*cshift(full(:, j), 1)
               end do
               call check_near(error, [sum(full, 2), moment], [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
                  0.0_wp, 0.0_wp], tol, 1.0_wp, "shape " // to_text(i) // ", step " // to_text(e))
            end do
         end do
      end do
   end subroutine test_momenta

   !> The force on the tip of the axis has none about the axis.
   subroutine test_axis(error)
      type(error_t), allocatable, intent(out) :: error
      type(wall_t) :: wall
      real(wp) :: x(3, 4), dx(3, 4), full(3, 4), axis(3), moment(3)
      type(dg_t) :: gap
      integer :: i, k

      do i = 4, 5
         do k = 1, 40
            call draw_step(i, 0.3_wp, wall, x, dx)
            gap = wall_gap(wall, x, dx)
            full = 0.0_wp
            call nodes_add_first(1.0_wp, gap%g, [1, 2, 3, 4], full)
            axis = x(:, 3) - x(:, 2) + 0.5_wp*(dx(:, 3) - dx(:, 2))
            moment = cshift(axis, 1)*cshift(full(:, 3), -1) - cshift(axis, -1)*cshift(full(:, 3), 1)
            call check_near(error, dot_product(moment, axis), 0.0_wp, tol, 1.0_wp, to_text(i))
         end do
      end do
   end subroutine test_axis

   !> The gradient at the end and the second derivatives, by central differences: where the way
   !> passes a joint these are themselves wrong next to it, and such draws are left out.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: small = 1.0e-5_wp, fine = 1.0e-7_wp
      type(wall_t) :: wall
      real(wp) :: x(3, 4), dx(3, 4), there(3, 4), back(3, 4), slope(9), change(9, 9)
      type(dg_t) :: gap, one, other
      integer :: i, j, k, a, n, m

      m = 0
      do i = 1, n_shape
         do k = 1, 40
            call draw_step(i, 0.2_wp, wall, x, dx)
            gap = wall_gap(wall, x, dx)
            do j = 2, 4
               do a = 1, 3
                  n = 3*(j - 2) + a
                  there = dx
                  back = dx
                  there(a, j) = dx(a, j) + small
                  back(a, j) = dx(a, j) - small
                  one = wall_gap(wall, x, there)
                  other = wall_gap(wall, x, back)
                  slope(n) = (one%f1 - other%f1)/(2.0_wp*small)
                  change(:, n) = (one%g - other%g)/(2.0_wp*small)
               end do
            end do
            ! One in a thousand ends within `small` of a joint.
            if (any(abs(slope - gap%c) > fine) .or. any(abs(change - gap%h) > 10.0_wp*fine)) then
               m = m + 1
            end if
         end do
      end do
      call check_true(error, m <= 2, to_text(m) // " of " // to_text(40*n_shape) // " are wrong")
   end subroutine test_derivatives

   !> A round top: on its axis all is finite, the normal is the axis, and derivatives are right.
   subroutine test_on_axis(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: small = 1.0e-5_wp, fine = 1.0e-8_wp
      type(wall_t) :: wall
      real(wp), dimension(3, 4) :: x, dx, full
      type(dg_t) :: gap, one, other
      integer :: a

      call make_wall(4, wall)
      x = 0.0_wp
      x(1, 3) = unit
      x(2, 4) = unit
      x(1, 1) = 1.25_wp
      dx = 0.0_wp
      gap = wall_gap(wall, x, dx)
      full = 0.0_wp
      call nodes_add_first(1.0_wp, gap%g, [1, 2, 3, 4], full)
      call check_near(error, [gap%f0, full(:, 1)], [0.25_wp, 1.0_wp, 0.0_wp, 0.0_wp], tol, 1.0_wp, &
         "the node")
      do a = 1, 3
         dx(a, 2) = small
         one = wall_gap(wall, x, dx)
         dx(a, 2) = -small
         other = wall_gap(wall, x, dx)
         dx(a, 2) = 0.0_wp
         call check_near(error, (one%g - other%g)/(2.0_wp*small), gap%h(:, a), fine, 1.0_wp, &
            "second derivatives by component " // to_text(a))
      end do
   end subroutine test_on_axis

   !> Corners of faces, and which way these face.
   subroutine test_faces(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: middle(3) = [0.2_wp, -0.1_wp, 0.3_wp], reach = 2.0_wp
      type(wall_t) :: wall
      type(wall_shape_t) :: shape
      type(wall_spot_t) :: spot
      real(wp) :: at(3, 4), one(3), other(3), normal(3)
      integer :: number, k

      at = 0.0_wp
      do k = 1, 3
         at(k, 1 + k) = unit
      end do
      do number = 1, n_shape
         call make_wall(number, wall)
         call wall_shape_make(shape, wall, middle, reach)
         do k = 1, size(shape%point, 2)
            spot = wall_find(wall, at, shape%point(:, k))
            call check_near(error, spot%distance, 0.0_wp, tol, 1.0_wp, "on shape " &
               // to_text(number))
         end do
         do k = 1, size(shape%cell, 2)
            associate (x => shape%point(:, shape%cell(:, k)))
               one = x(:, 3) - x(:, 1)
               other = x(:, 4) - x(:, 2)
               normal = [one(2)*other(3) - one(3)*other(2), one(3)*other(1) - one(1)*other(3), &
                  one(1)*other(2) - one(2)*other(1)]
               spot = wall_find(wall, at, 0.25_wp*sum(x, 2))
               call check_true(error, dot_product(normal, spot%normal) > 0.9_wp*norm2(normal), &
                  "faces out, shape " // to_text(number))
            end associate
         end do
      end do
   end subroutine test_faces

end module test_wall_gap
