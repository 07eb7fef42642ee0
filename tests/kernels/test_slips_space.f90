!> Slips in space over frames, walls and edges that cross: identities, momenta, rigid turns, closed
!> forms, derivatives.
module test_slips_space
   use check, only : check_near, test_case_t
   use emcon_dgrad_nodes, only : nodes_add_first, nodes_add_second
   use emcon_edge_pair_space, only : edge_pair_slip, edge_pair_slip_t
   use emcon_errors, only : error_t
   use emcon_frame_slip_space, only : frame_slip, frame_slip_t, slip_axis_t
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   use emcon_text, only : to_text
   use emcon_wall, only : wall_t
   use emcon_wall_slip_space, only : wall_slip, wall_slip_t
   use random_draws, only : draw_random
   use wall_shapes, only : make_wall, n_shape, turned
   implicit none
   private
   public :: collect_slips_space

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Some 100 roundings of quantities of size 1.
   real(wp), parameter :: tol = 128.0_wp*eps
   !> Frames and edges have no shapes; they are numbered before the walls.
   integer, parameter :: of_frame = -1, of_edges = 0
   !> Nodes of a frame, of edges: none of the fifth.
   integer, parameter :: n_node = 5
   !> A direction for frames and walls.
   real(wp), parameter :: along(3) = [0.3_wp, 0.9_wp, 0.2_wp]

   !> Slips by the coordinates of nodes.
   type :: slips_t
      real(wp) :: f(2) = 0.0_wp
      real(wp) :: g(3, n_node, 2) = 0.0_wp
      real(wp) :: c(3, n_node, 2) = 0.0_wp
      real(wp) :: h(3*n_node, 3*n_node, 2) = 0.0_wp
   end type slips_t

contains

   subroutine collect_slips_space(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("identity for steps of any size", test_identity), &
         test_case_t("momenta", test_momenta), &
         test_case_t("rigid turns are no slip", test_rigid), &
         test_case_t("turned scenes slip by as much", test_turned), &
         test_case_t("along a plane it is the way there", test_plane), &
         test_case_t("around a ball it is the chord of the way", test_ball), &
         test_case_t("derivatives against differences", test_derivatives), &
         test_case_t("friction does not depend on directions", test_directions), &
         test_case_t("a step that ends where it starts, against differences", test_at_one_place)]
   end subroutine collect_slips_space

   !> The nodes of kind `kind`, and a step of size `size` in which they turn and move apart.
   subroutine draw_step(kind, size, wall, x, dx)
      integer, intent(in) :: kind                !! a shape of a wall, or one of the above
      real(wp), intent(in) :: size
      type(wall_t), intent(out) :: wall
      real(wp), intent(out) :: x(3, n_node), dx(3, n_node)
      real(wp) :: noise(3, n_node), draw(3)
      integer :: i

      call draw_random(noise)
      x = 0.3_wp*(2.0_wp*noise - 1.0_wp)
      call draw_random(draw)
      call draw_random(noise)
      select case (kind)
      case (of_frame)                            ! origin, tips, point
         x(1, 2) = x(1, 2) + 1.0_wp
         x(2, 3) = x(2, 3) + 1.0_wp
         noise = x + size*noise
      case (of_edges)
         x(1, 2) = x(1, 2) + 1.0_wp
         x(2, 4) = x(2, 4) + 1.0_wp
         noise = x + size*noise
      case default                               ! node, origin, tips: walls are rigid
         call make_wall(kind, wall)
         x(:, 2:) = 0.0_wp
         do i = 1, 3
            x(i, 2 + i) = wall%arm
         end do
         x(:, 1) = x(:, 1) + [0.2_wp, 0.7_wp, -0.6_wp]
         noise(:, 1) = x(:, 1) + 0.3_wp*size*noise(:, 1)
         noise(:, 2:) = x(:, 2:)
      end select
      x = matmul(turned(6.0_wp*draw), x)
      dx = matmul(turned(6.0_wp*draw), noise)
      dx = matmul(turned(size*draw(3:1:-1)), dx) + size*draw(1) - x
   end subroutine draw_step

   !> In the vectors of the middle of the step, unless told.
   pure subroutine find(kind, wall, x, dx, slips, place)
      integer, intent(in) :: kind
      type(wall_t), intent(in) :: wall
      real(wp), intent(in) :: x(3, n_node), dx(3, n_node)
      type(slips_t), intent(out) :: slips
      real(wp), intent(in), optional :: place
      type(frame_slip_t) :: frame
      type(edge_pair_slip_t) :: edges
      type(wall_slip_t) :: one
      type(slip_axis_t) :: axis
      integer :: k

      axis = slip_axis_t(along, 0.5_wp)
      if (present(place)) axis%place = place
      select case (kind)
      case (of_frame)
         call frame_slip(x(:, :4), dx(:, :4), axis, .false., frame)
         slips%f = frame%f
         do k = 1, 2
            call nodes_add_first(1.0_wp, frame%g(:, k), [1, 2, 3, 4], slips%g(:, :, k))
            call nodes_add_first(1.0_wp, frame%c(:, k), [1, 2, 3, 4], slips%c(:, :, k))
            call nodes_add_second(1.0_wp, 3, frame%h(:, :, k), [1, 2, 3, 4], slips%h(:, :, k))
         end do
      case (of_edges)
         call edge_pair_slip(x(:, :4), dx(:, :4), axis%place, .false., edges)
         slips%f = edges%f
         slips%g(:, :4, :) = edges%g
         slips%c(:, :4, :) = edges%c
         slips%h(:12, :12, :) = edges%h
      case default
         call wall_slip(wall, x, dx, axis, .false., one)
         slips = slips_t(one%f, one%g, one%c, one%h)
      end select
   end subroutine find

   !> The forces do the work of friction on slip.
   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      type(wall_t) :: wall
      type(slips_t) :: slips
      real(wp) :: x(3, n_node), dx(3, n_node)
      integer :: kind, e, s

      do kind = of_frame, n_shape
         do e = 0, 12, 3
            call draw_step(kind, 0.3_wp*0.1_wp**e, wall, x, dx)
            call find(kind, wall, x, dx, slips)
            do s = 1, 2
               call check_near(error, sum(slips%g(:, :, s)*dx), slips%f(s), tol, maxval(abs(dx)), &
                  to_text(kind) // ", step " // to_text(e))
            end do
         end do
      end do
   end subroutine test_identity

   !> No resultant, and no moment about where nodes are in the middle of the step.
   subroutine test_momenta(error)
      type(error_t), allocatable, intent(out) :: error
      type(wall_t) :: wall
      type(slips_t) :: slips
      real(wp) :: x(3, n_node), dx(3, n_node), moment(3), mean(3)
      integer :: kind, j, k, s

      do kind = of_frame, n_shape
         do k = 0, 19
            call draw_step(kind, 0.6_wp**k, wall, x, dx)
            call find(kind, wall, x, dx, slips)
            do s = 1, 2
               moment = 0.0_wp
               do j = 1, n_node
                  mean = x(:, j) + 0.5_wp*dx(:, j)
                  moment = moment + cshift(mean, 1)*cshift(slips%g(:, j, s), -1) &
                     - cshift(mean, -1)*cshift(slips%g(:, j, s), 1)
               end do
               call check_near(error, [sum(slips%g(:, :, s), 2), moment], [0.0_wp, 0.0_wp, &
                  0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], tol, 1.0_wp + maxval(abs(slips%g)), &
                  to_text(kind) // ", step " // to_text(k))
            end do
         end do
      end do
   end subroutine test_momenta

   subroutine test_rigid(error)
      type(error_t), allocatable, intent(out) :: error
      type(wall_t) :: wall
      type(slips_t) :: slips
      real(wp) :: x(3, n_node), dx(3, n_node), draw(3)
      integer :: kind

      do kind = of_frame, n_shape
         call draw_step(kind, 0.3_wp, wall, x, dx)
         call draw_random(draw)
         dx = matmul(turned(3.0_wp*draw), x) + draw(1) - x
         call find(kind, wall, x, dx, slips)
         call check_near(error, slips%f, [0.0_wp, 0.0_wp], tol, 1.0_wp, to_text(kind))
      end do
   end subroutine test_rigid

   !> The length of slip is that of the same scene turned; walls and edges turn their directions.
   subroutine test_turned(error)
      type(error_t), allocatable, intent(out) :: error
      type(wall_t) :: wall
      type(slips_t) :: slips, other
      real(wp) :: x(3, n_node), dx(3, n_node), draw(3)
      integer :: kind

      do kind = of_frame, n_shape
         call draw_step(kind, 0.3_wp, wall, x, dx)
         call draw_random(draw)
         call find(kind, wall, x, dx, slips)
         associate (turn => turned(6.0_wp*draw))
            call find(kind, wall, matmul(turn, x) + draw(2), matmul(turn, dx), other)
         end associate
         call check_near(error, norm2(other%f), norm2(slips%f), tol, 1.0_wp, to_text(kind))
         if (kind /= of_frame) call check_near(error, other%f, slips%f, tol, 1.0_wp, to_text(kind))
      end do
   end subroutine test_turned

   !> A point over a frame that stays, an edge on another, and a node on the flat wall go the way
   !> that they move in the plane; edges let the other one go as much the other way.
   subroutine test_plane(error)
      type(error_t), allocatable, intent(out) :: error
      type(wall_t) :: wall
      type(slips_t) :: slips
      real(wp) :: x(3, n_node), dx(3, n_node), draw(3)
      integer :: kind

      do kind = of_frame, 1
         call draw_step(kind, 0.3_wp, wall, x, dx)
         call draw_random(draw)
         x(:, :4) = reshape([0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.4_wp, 1.1_wp, &
            0.0_wp, 0.3_wp, 0.2_wp, 0.1_wp], [3, 4])
         if (kind == of_edges) x(:, 3:4) = reshape([0.4_wp, -0.3_wp, 0.0_wp, 0.5_wp, 0.6_wp, &
            0.0_wp], [3, 2])
         if (kind == 1) x = reshape([0.1_wp, 0.2_wp, 0.3_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
            wall%arm, 0.0_wp, 0.0_wp, 0.0_wp, wall%arm, 0.0_wp, 0.0_wp, 0.0_wp, wall%arm], &
            [3, n_node])
         dx = 0.0_wp
         select case (kind)
         case (of_frame)
            dx(:, 4) = draw
            call find(kind, wall, x, dx, slips)
            call check_near(error, norm2(slips%f), norm2(draw(:2)), tol, 1.0_wp, "frame")
            associate (first => along(:2)/norm2(along(:2)))
               call check_near(error, slips%f, [dot_product(first, draw(:2)), &
                  first(1)*draw(2) - first(2)*draw(1)], tol, 1.0_wp, "its directions")
            end associate
         case (of_edges)
            dx(:, :2) = spread(draw, 2, 2)
            call find(kind, wall, x, dx, slips)
            call check_near(error, slips%f, draw(:2), tol, 1.0_wp, "slave edge")
            dx = 0.0_wp
            dx(:, 3:4) = spread(draw, 2, 2)
            call find(kind, wall, x, dx, slips)
            call check_near(error, slips%f, -draw(:2), tol, 1.0_wp, "master edge")
         case default                            ! normal to the first vector
            dx(:, 1) = draw
            call find(kind, wall, x, dx, slips)
            associate (first => along(2:)/norm2(along(2:)))
               call check_near(error, slips%f, [dot_product(first, draw(2:)), &
                  first(1)*draw(3) - first(2)*draw(2)], tol, 1.0_wp, "wall")
            end associate
         end select
      end do
   end subroutine test_plane

   !> From the start, along a meridian, by some angle.
   subroutine test_ball(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: angle = 0.4_wp, from = 0.3_wp
      type(wall_t) :: wall
      type(slips_t) :: slips
      real(wp) :: x(3, n_node), dx(3, n_node)
      integer :: i

      do i = 2, 3
         call make_wall(i, wall)
         x = 0.0_wp
         x(1, 3) = wall%arm
         x(2, 4) = wall%arm
         x(3, 5) = wall%arm
         x(:, 1) = [cos(from), sin(from), 0.0_wp]
         dx = 0.0_wp
         dx(:, 1) = [cos(from + angle), sin(from + angle), 0.0_wp] - x(:, 1)
         call find(i, wall, x, dx, slips)
         call check_near(error, norm2(slips%f), 2.0_wp*sin(0.5_wp*angle), tol, 1.0_wp, to_text(i))
      end do
   end subroutine test_ball

   !> Central differences, which err by the square of their way beside round-off by it. Where
   !> friction acts at the end, gradients are at one place, and of a step that ends there.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      type(wall_t) :: wall
      type(slips_t) :: slips, up, down
      real(wp), dimension(3, n_node) :: x, dx, way
      real(wp) :: step, bound, place
      integer :: kind, k, s

      step = eps**(1.0_wp/3.0_wp)
      bound = 1.0e3_wp*step**2
      do kind = of_frame, n_shape
         do k = 1, 10
            place = merge(0.5_wp, 1.0_wp, k <= 5)
            call draw_step(kind, 0.2_wp, wall, x, dx)
            call draw_random(way)
            call find(kind, wall, x, dx, slips, place)
            call find(kind, wall, x, dx + step*way, up, place)
            call find(kind, wall, x, dx - step*way, down, place)
            do s = 1, 2
               call check_near(error, sum(slips%c(:, :, s)*way), (up%f(s) - down%f(s)) &
                  /(2.0_wp*step), bound, 1.0_wp, "gradient " // to_text(kind))
               if (k > 5) cycle
               call check_near(error, matmul(slips%h(:, :, s), reshape(way, [size(way)])), &
                  reshape((up%g(:, :, s) - down%g(:, :, s))/(2.0_wp*step), [size(way)]), &
                  bound, 1.0_wp, "second derivative " // to_text(kind))
            end do
         end do
      end do
   end subroutine test_derivatives

   !> Slips times their gradients are friction along slip, whatever directions both are counted in.
   subroutine test_directions(error)
      type(error_t), allocatable, intent(out) :: error
      type(wall_t) :: wall
      type(frame_slip_t) :: slip, other
      real(wp) :: x(3, n_node), dx(3, n_node), draw(3), place
      integer :: k

      do k = 1, 20
         place = merge(0.5_wp, 1.0_wp, k <= 10)
         call draw_step(of_frame, 0.3_wp, wall, x, dx)
         call draw_random(draw)
         call frame_slip(x(:, :4), dx(:, :4), slip_axis_t(along, place), .true., slip)
         call frame_slip(x(:, :4), dx(:, :4), slip_axis_t(draw, place), .true., other)
         call check_near(error, matmul(other%g, other%f), matmul(slip%g, slip%f), tol, &
            norm2(slip%f), to_text(k))
         call check_near(error, norm2(other%f), norm2(slip%f), tol, norm2(slip%f), to_text(k))
      end do
   end subroutine test_directions

   !> Directions and lengths of a frame are those where it is, and move with it and with `along`.
   subroutine test_at_one_place(error)
      type(error_t), allocatable, intent(out) :: error
      type(wall_t) :: wall
      type(frame_slip_t) :: slip, up, down
      real(wp), dimension(3, n_node) :: x, way
      real(wp) :: step, bound, turn(3), least(3)
      integer :: k, s

      step = eps**(1.0_wp/3.0_wp)
      bound = 1.0e3_wp*step**2
      do k = 1, 20
         call draw_step(of_frame, 0.0_wp, wall, x, way)
         call draw_random(way)
         call draw_random(turn)
         way(:, 1) = 0.0_wp                      ! the origin stays
         ! Half of them along what is nearly normal, where another axis is taken.
         call draw_random(least)
         associate (normal => cross_product(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1)))
            least = merge(along, normal + 0.05_wp*least, mod(k, 2) == 0)
         end associate
         call frame_slip(x(:, :4), 0.0_wp*x(:, :4), slip_axis_t(least, 1.0_wp), .false., slip)
         call frame_slip(x(:, :4) + step*way(:, :4), 0.0_wp*x(:, :4), slip_axis_t(least &
            + step*turn, 1.0_wp), .true., up)
         call frame_slip(x(:, :4) - step*way(:, :4), 0.0_wp*x(:, :4), slip_axis_t(least &
            - step*turn, 1.0_wp), .true., down)
         do s = 1, 2
            call check_near(error, 2.0_wp*(matmul(slip%h(:, :, s), reshape(way(:, 2:4), [9])) &
               + matmul(slip%h_along(:, :, s), turn)), (up%g(:, s) - down%g(:, s)) &
               /(2.0_wp*step), bound, 1.0_wp, "second derivative " // to_text(k))
         end do
      end do
   end subroutine test_at_one_place

end module test_slips_space
