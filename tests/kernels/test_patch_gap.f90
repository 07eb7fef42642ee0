!> Mean heights over a patch that slides over triangles: values, identities, momenta, derivatives.
module test_patch_gap
   use check, only : check_near, check_true, test_case_t
   use emcon_dgrad_nodes, only : nodes_add_first
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_patch_gap_space, only : patch_gap, patch_gap_t, patch_look, patch_look_t, patch_t
   use emcon_text, only : to_text
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_patch_gap

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Some 100 roundings of quantities of size 1.
   real(wp), parameter :: tol = 128.0_wp*eps
   !> A grid of so many triangles' legs of length 1 along each side, and its vertices.
   integer, parameter :: n_side = 6, n_vertex = (n_side + 1)**2, n_point = 3 + n_vertex
   !> The surface is bent by up to this at vertices: kinks of up to .3.
   real(wp), parameter :: rough = 0.12_wp
   real(wp), parameter :: patch_length = 0.1_wp

contains

   subroutine collect_patch_gap(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a flat surface is as high as it is", test_flat), &
         test_case_t("a patch half over the end sees half of it", test_cover), &
         test_case_t("identity for steps of any size", test_identity), &
         test_case_t("momenta", test_momenta), &
         test_case_t("derivatives against differences", test_derivatives), &
         test_case_t("the tangent does not grow as the step shrinks", test_tangent), &
         test_case_t("sides on sides: no jump of the gradient", test_aligned), &
         test_case_t("without second derivatives: the same bits", test_first)]
   end subroutine collect_patch_gap

   !> A grid of triangles, each square halved, seen from below.
   subroutine make_patch(patch, x)
      type(patch_t), intent(out) :: patch
      real(wp), intent(out) :: x(3, n_point)     !! origin and frame in the middle, then the grid
      integer :: i, j, k

      patch%n_vertex = n_vertex
      patch%n_triangle = 2*n_side**2
      patch%length = patch_length
      allocate(patch%triangle(3, patch%n_triangle), patch%chi(n_vertex))
      patch%chi = 1.0_wp
      x = 0.0_wp
      x(1, 2) = 1.0_wp
      x(2, 3) = 1.0_wp
      k = 0
      do j = 0, n_side
         do i = 0, n_side
            x(:2, 4 + i + (n_side + 1)*j) = real([i, j], wp) - 0.5_wp*real(n_side, wp)
            if (max(i, j) == n_side) cycle
            associate (at => 1 + i + (n_side + 1)*j)
               patch%triangle(:, k + 1) = [at, at + 1, at + n_side + 2]
               patch%triangle(:, k + 2) = [at, at + n_side + 2, at + n_side + 1]
            end associate
            k = k + 2
         end do
      end do
   end subroutine make_patch

   !> A rough surface, the patch `height` below it near the middle, and a step: a slide of `slide`
   !> in some direction, a turn by `turn`, and a change of shape of `wobble`. Each fourth time the
   !> patch begins at a vertex, else on a side.
   subroutine draw_step(number, slide, turn, wobble, patch, x, dx)
      integer, intent(in) :: number
      real(wp), intent(in) :: slide, turn, wobble
      type(patch_t), intent(out) :: patch
      real(wp), intent(out) :: x(3, n_point), dx(3, n_point)
      real(wp) :: noise(3, n_point), end(3, n_point), at(3), way(2), draw(3)

      call make_patch(patch, x)
      call draw_random(noise)
      x(:, 4:) = x(:, 4:) + rough*(2.0_wp*noise(:, 4:) - 1.0_wp)
      call draw_random(draw)
      if (mod(number, 4) == 0) draw(1) = 0.0_wp
      associate (a => x(:, 3 + (n_vertex + 1)/2), b => x(:, 4 + (n_vertex + 1)/2))
         at = a + draw(1)*(b - a)
      end associate
      x(:, :3) = x(:, :3) + spread(at, 2, 3) + 0.05_wp*(2.0_wp*noise(:, :3) - 1.0_wp)
      way = slide*[cos(6.0_wp*draw(2)), sin(6.0_wp*draw(2))]
      call draw_random(noise)
      end = x + wobble*(2.0_wp*noise - 1.0_wp)
      end(:2, :3) = end(:2, :3) + spread(way, 2, 3)
      call draw_random(draw)
      end = matmul(turned(turn*draw(1), turn*draw(2)), end) + turn
      dx = end - x
   end subroutine draw_step

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

   !> The mean height at rest, and what is covered.
   subroutine look_at(patch, x, height, cover)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: x(3, n_point)
      real(wp), intent(out) :: height, cover
      type(patch_look_t) :: look

      look = patch_look(patch, x, 0.0_wp*x)
      height = look%height(1)
      cover = look%cover(1)
   end subroutine look_at

   !> Wherever the patch is and however the grid is cut.
   subroutine test_flat(error)
      type(error_t), allocatable, intent(out) :: error
      type(patch_t) :: patch
      real(wp) :: x(3, n_point), draw(3), height, cover
      integer :: k

      do k = 1, 40
         call make_patch(patch, x)
         call draw_random(draw)
         if (mod(k, 4) == 0) draw(1) = 0.0_wp
         if (mod(k, 8) == 0) draw(2) = 0.0_wp
         x(:, :3) = x(:, :3) + spread(draw, 2, 3)
         call look_at(patch, x, height, cover)
         call check_near(error, [height, cover], [-draw(3), 1.0_wp], tol, 1.0_wp, to_text(k))
      end do
   end subroutine test_flat

   !> Up to the first vertices past the end the field fades.
   subroutine test_cover(error)
      type(error_t), allocatable, intent(out) :: error
      type(patch_t) :: patch
      real(wp) :: x(3, n_point), height, cover

      call make_patch(patch, x)
      patch%n_triangle = n_side**2
      x(:2, 1:3) = x(:2, 1:3) + 0.25_wp
      x(2, 1:3) = 0.0_wp
      x(2, 3) = 1.0_wp
      x(3, 4:) = 0.5_wp
      call look_at(patch, x, height, cover)
      call check_near(error, [cover, height], [0.5_wp, 0.25_wp], tol, 1.0_wp, "half of it")
      x(2, 1:3) = x(2, 1:3) + 1.0_wp
      call look_at(patch, x, height, cover)
      call check_near(error, [cover, height], [0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "none of it")
   end subroutine test_cover

   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: slide(5) = [0.8_wp, 1.0e-2_wp, 1.0e-5_wp, 1.0e-8_wp, 1.0e-12_wp]
      type(patch_t) :: patch
      type(patch_gap_t) :: gap
      real(wp) :: x(3, n_point), dx(3, n_point), cover, height
      integer :: i, k

      do i = 1, size(slide)
         do k = 1, 40
            call draw_step(k, slide(i), min(0.3_wp, slide(i)), 0.1_wp*slide(i), patch, x, dx)
            call patch_gap(patch, x, dx, 0.0_wp, .true., gap)
            call check_near(error, dot_product(gap%g, way_of(gap, dx)), gap%df, tol, &
               sum(abs(gap%g*way_of(gap, dx))), "identity, step " // to_text(slide(i), 2))
            call check_near(error, gap%f0 + gap%df, gap%f1, tol, 1.0_wp, "values")
            call look_at(patch, x, height, cover)
            call check_near(error, gap%f0, height, tol, 1.0_wp, "mean height")
         end do
      end do
   end subroutine test_identity

   !> The motion of the variables of a gap.
   pure function way_of(gap, dx) result(way)
      type(patch_gap_t), intent(in) :: gap
      real(wp), intent(in) :: dx(:, :)
      real(wp) :: way(6 + 3*gap%n_vertex)

      associate (node => [2, 3, 3 + gap%vertex(:gap%n_vertex)])
         way = reshape(dx(:, node) - spread(dx(:, 1), 2, size(node)), shape(way))
      end associate
   end function way_of

   subroutine test_momenta(error)
      type(error_t), allocatable, intent(out) :: error
      type(patch_t) :: patch
      type(patch_gap_t) :: gap
      real(wp) :: x(3, n_point), dx(3, n_point), moment(3)
      real(wp), allocatable :: g(:, :)
      integer :: i, k

      do k = 1, 60
         call draw_step(k, 0.4_wp**mod(k, 20), 1.0_wp, 0.1_wp, patch, x, dx)
         call patch_gap(patch, x, dx, 0.0_wp, .true., gap)
         associate (node => [1, 2, 3, 3 + gap%vertex(:gap%n_vertex)])
            if (allocated(g)) deallocate(g)
            allocate(g(3, size(node)), source=0.0_wp)
            call nodes_add_first(1.0_wp, gap%g, [(i, i = 1, size(node))], g)
            moment = 0.0_wp
            do i = 1, size(node)
               associate (at => x(:, node(i)) + 0.5_wp*dx(:, node(i)))
                  moment = moment + cshift(at, 1)*cshift(g(:, i), -1) &
                     - cshift(at, -1)*cshift(g(:, i), 1)
               end associate
            end do
         end associate
         call check_near(error, moment, [0.0_wp, 0.0_wp, 0.0_wp], tol, sum(abs(g)), "moment")
      end do
   end subroutine test_momenta

   !> Central differences err by the square of their way, times derivatives that grow with the
   !> kinks by the length of the patch, beside round-off by the way.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      type(patch_t) :: patch
      type(patch_gap_t) :: gap, up, down
      real(wp), dimension(3, n_point) :: x, dx, way
      real(wp) :: step, bound
      integer :: k

      step = eps**(1.0_wp/3.0_wp)
      bound = 1.0e4_wp*step**2
      do k = 1, 40
         call draw_step(k, merge(0.3_wp, 0.02_wp, mod(k, 2) == 0), 0.3_wp, 0.05_wp, patch, x, dx)
         call draw_random(way)
         way = 2.0_wp*way - 1.0_wp
         call patch_gap(patch, x, dx, 0.1_wp, .false., gap)
         call patch_gap(patch, x, dx + step*way, 0.1_wp, .true., up)
         call patch_gap(patch, x, dx - step*way, 0.1_wp, .true., down)
         call check_near(error, dot_product(gap%c, way_of(gap, way)), &
            (up%f1 - down%f1)/(2.0_wp*step), bound, 1.0_wp, "gradient " // to_text(k))
         if (up%n_vertex /= gap%n_vertex .or. down%n_vertex /= gap%n_vertex) cycle
         call check_near(error, matmul(gap%h, way_of(gap, way)), (up%g - down%g)/(2.0_wp*step), &
            bound, 1.0_wp, "second derivative " // to_text(k))
      end do
   end subroutine test_derivatives

   !> Kinks by the length of the patch bound it, whatever the step is.
   subroutine test_tangent(error)
      type(error_t), allocatable, intent(out) :: error
      type(patch_t) :: patch
      type(patch_gap_t) :: gap
      real(wp) :: x(3, n_point), dx(3, n_point), slide
      integer :: i, k

      do i = 0, 12, 2
         slide = 0.8_wp*0.1_wp**i
         do k = 1, 40
            call draw_step(k, slide, min(0.3_wp, slide), 0.1_wp*slide, patch, x, dx)
            call patch_gap(patch, x, dx, 0.0_wp, .false., gap)
            call check_true(error, maxval(abs(gap%h)) < 12.0_wp*rough/patch_length, &
               "largest entry " // to_text(maxval(abs(gap%h)), 3) // " in a step of " // &
               to_text(slide, 2))
         end do
      end do
   end subroutine test_tangent

   !> A patch whose sides lie on sides of triangles, or whose corner is a vertex, moved by round-off.
   subroutine test_aligned(error)
      type(error_t), allocatable, intent(out) :: error
      type(patch_t) :: patch
      type(patch_gap_t) :: gap(2)
      real(wp), dimension(3, n_point) :: x, dx
      real(wp) :: corner(2)
      integer :: k

      do k = 1, 4
         call make_patch(patch, x)
         x(3, 4:) = [(rough*sin(real(k, wp)), k = 1, n_vertex)]
         corner = patch_length/3.0_wp
         if (k > 2) corner(1) = 0.0_wp
         x(:2, :3) = x(:2, :3) + spread(corner, 2, 3)
         dx = 0.0_wp
         if (mod(k, 2) == 0) dx(1, :3) = 0.2_wp
         call patch_gap(patch, x, dx, 0.0_wp, .true., gap(1))
         dx(:2, :3) = dx(:2, :3) - 8.0_wp*eps
         call patch_gap(patch, x, dx, 0.0_wp, .true., gap(2))
         call check_near(error, gap(1)%g(:6), gap(2)%g(:6), 1.0e3_wp*eps/patch_length, 1.0_wp, &
            "gradient " // to_text(k))
      end do
   end subroutine test_aligned

   subroutine test_first(error)
      type(error_t), allocatable, intent(out) :: error
      type(patch_t) :: patch
      type(patch_gap_t) :: gap, first
      real(wp), dimension(3, n_point) :: x, dx
      integer :: k

      do k = 1, 10
         call draw_step(k, 0.1_wp, 0.1_wp, 0.1_wp, patch, x, dx)
         call patch_gap(patch, x, dx, 0.1_wp, .false., gap)
         call patch_gap(patch, x, dx, 0.1_wp, .true., first)
         call check_near(error, [first%f0, first%f1, first%df, first%g, first%c], &
            [gap%f0, gap%f1, gap%df, gap%g, gap%c], 0.0_wp, 1.0_wp, "bits")
      end do
   end subroutine test_first

end module test_patch_gap
