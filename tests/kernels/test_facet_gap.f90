!> Integrals of heights over a triangle of a slave facet, with weights: values, identities, momenta,
!> derivatives; silhouettes within the triangle, and sides on sides.
module test_facet_gap
   use check, only : check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_patch_gap_space, only : patch_gap, patch_gap_t, patch_open, patch_open_cover, &
      patch_open_t
   use emcon_patch_look_space, only : patch_basis, patch_basis_t, patch_t
   use emcon_patch_moments_space, only : patch_triangle
   use emcon_text, only : to_text
   use patch_scenes, only : make_grid, moment_of, n_point, n_side, n_vertex, rough, size_of, &
      turned, way_of
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_facet_gap

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Some 100 roundings of quantities of size 1.
   real(wp), parameter :: tol = 128.0_wp*eps
   !> The first dual weight of a triangle.
   real(wp), parameter :: dual(3) = [3.0_wp, -1.0_wp, -1.0_wp]
   real(wp), parameter :: zero(3) = 0.0_wp
   real(wp), parameter :: pi = acos(-1.0_wp)

contains

   subroutine collect_facet_gap(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("over a plane: integrals of products", test_plane), &
         test_case_t("a triangle half over the end sees half of it", test_cover), &
         test_case_t("identity for steps of any size", test_identity), &
         test_case_t("a target that heights are all at: no force but the weights'", test_target), &
         test_case_t("momenta", test_momenta), &
         test_case_t("derivatives against differences", test_derivatives), &
         test_case_t("the tangent does not grow where a silhouette is inside", test_silhouette), &
         test_case_t("the same triangles: no jump of the gradient", test_matching), &
         test_case_t("without second derivatives: the same bits", test_first)]
   end subroutine collect_facet_gap

   !> A triangle about the origin of the grid, some facets large.
   subroutine make_facet(patch, x)
      type(patch_t), intent(out) :: patch
      real(wp), intent(out) :: x(3, n_point)

      call make_grid(patch, 1.0_wp, x)
      patch%area = patch_triangle()
      x(:, 1) = [0.1_wp, 0.2_wp, 0.0_wp]
      x(:, 2) = x(:, 1) + [2.1_wp, 0.3_wp, 0.0_wp]
      x(:, 3) = x(:, 1) + [-0.4_wp, 1.8_wp, 0.0_wp]
   end subroutine make_facet

   !> A rough surface and a step: a slide, a turn, a change of shape.
   subroutine draw_step(slide, turn, wobble, patch, x, dx)
      real(wp), intent(in) :: slide, turn, wobble
      type(patch_t), intent(out) :: patch
      real(wp), intent(out) :: x(3, n_point), dx(3, n_point)
      real(wp) :: noise(3, n_point), end(3, n_point), draw(3)

      call make_facet(patch, x)
      call draw_random(noise)
      x = x + rough*(2.0_wp*noise - 1.0_wp)
      call draw_random(noise)
      call draw_random(draw)
      patch%weight = dual + draw
      end = x + wobble*(2.0_wp*noise - 1.0_wp)
      call draw_random(draw)
      end(:2, :3) = end(:2, :3) + spread(slide*[cos(6.0_wp*draw(1)), sin(6.0_wp*draw(1))], 2, 3)
      end = matmul(turned(turn*draw(2), turn*draw(3)), end) + turn
      dx = end - x
   end subroutine draw_step

   !> A slanted plane: a product of two functions that are linear, by closed form.
   subroutine test_plane(error)
      type(error_t), allocatable, intent(out) :: error
      type(patch_t) :: patch
      type(patch_gap_t) :: gap
      real(wp) :: x(3, n_point), area, height(3), corner(3)
      type(patch_basis_t) :: basis
      type(patch_open_t) :: open
      integer :: i

      call make_facet(patch, x)
      x(3, 4:) = 0.3_wp + 0.1_wp*x(1, 4:) - 0.2_wp*x(2, 4:)
      area = 0.5_wp*(2.1_wp*1.8_wp + 0.3_wp*0.4_wp)
      associate (a => x(:, 2) - x(:, 1), b => x(:, 3) - x(:, 1))
         do i = 1, 3
            corner = x(:, 1) - (a + b)/3.0_wp
            if (i == 2) corner = corner + a
            if (i == 3) corner = corner + b
            height(i) = 0.3_wp + 0.1_wp*corner(1) - 0.2_wp*corner(2)
         end do
      end associate
      patch%weight = dual
      call patch_gap(patch, x, 0.0_wp*x, 0.0_wp, .true., gap)
      call check_near(error, gap%f1, area/12.0_wp*(dot_product(dual, height) &
         + sum(dual)*sum(height)), tol, 1.0_wp, "the integral")
      patch%chi(1:patch%n_vertex:2) = 0.4_wp
      call patch_open(patch, x, 0.0_wp*x, .true., open)
      call patch_basis(patch, x, 0.0_wp*x, .false., basis)
      call check_near(error, 2.0_wp*basis%area*patch_open_cover(open), sum(basis%cover, 1), tol, &
         1.0_wp, "the cover")
      if (allocated(error)) return
      patch%chi = 1.0_wp
      call patch_basis(patch, x, 0.0_wp*x, .false., basis)
      call check_near(error, basis%height(:, 1), area/12.0_wp*(height + sum(height)), tol, 1.0_wp, &
         "of each weight")
      call check_near(error, basis%cover(:, 0), spread(area/3.0_wp, 1, 3), tol, 1.0_wp, &
         "what is covered")
   end subroutine test_plane

   !> The surface ends in a line through the middle of two sides.
   subroutine test_cover(error)
      type(error_t), allocatable, intent(out) :: error
      type(patch_t) :: patch
      real(wp) :: x(3, n_point)
      type(patch_basis_t) :: basis

      call make_facet(patch, x)
      patch%n_triangle = n_side**2
      x(:, 1) = [0.0_wp, -1.0_wp/3.0_wp, 0.0_wp]
      x(:, 2) = x(:, 1) + [2.0_wp, 0.0_wp, 0.0_wp]
      x(:, 3) = x(:, 1) + [1.0_wp, 2.0_wp, 0.0_wp]
      x(3, 4:) = 0.5_wp
      call patch_basis(patch, x, 0.0_wp*x, .false., basis)
      call check_near(error, basis%cover(:, 1), [7.0_wp, 7.0_wp, 4.0_wp]/12.0_wp, tol, &
         1.0_wp, "covered")
      call check_near(error, basis%height(:, 1), 0.5_wp*basis%cover(:, 1), tol, 1.0_wp, "integrals")
      x(2, :3) = x(2, :3) + 1.0_wp
      call patch_basis(patch, x, 0.0_wp*x, .false., basis)
      call check_near(error, [basis%height, basis%cover], spread(0.0_wp, 1, 12), &
         0.0_wp, 1.0_wp, "none of it")
   end subroutine test_cover

   subroutine test_identity(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: slide(5) = [0.8_wp, 1.0e-2_wp, 1.0e-5_wp, 1.0e-8_wp, 1.0e-12_wp]
      type(patch_t) :: patch
      type(patch_gap_t) :: gap
      real(wp) :: x(3, n_point), dx(3, n_point)
      integer :: i, k

      do i = 1, size(slide)
         do k = 1, 20
            call draw_step(slide(i), min(0.3_wp, slide(i)), 0.1_wp*slide(i), patch, x, dx)
            call patch_gap(patch, x, dx, 0.1_wp, .true., gap)
            call check_near(error, dot_product(gap%g, way_of(gap, dx)), gap%df, tol, &
               sum(abs(gap%g*way_of(gap, dx))), "identity, step " // to_text(slide(i), 2))
            call check_near(error, gap%f0 + gap%df, gap%f1, tol, 10.0_wp, "values")
         end do
      end do
   end subroutine test_identity

   !> Heights and target round, each of them: what is left of their difference closes nothing.
   subroutine test_target(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: slide(4) = [1.0e-2_wp, 1.0e-5_wp, 1.0e-8_wp, 1.0e-12_wp]
      real(wp), parameter :: target = 1.7_wp
      type(patch_t) :: patch
      type(patch_gap_t) :: gap, near
      real(wp) :: x(3, n_point), far(3, n_point), dx(3, n_point), draw(3), turn(3, 3)
      integer :: i, k

      do i = 1, size(slide)
         do k = 1, 20
            call make_facet(patch, x)
            call draw_random(draw)
            patch%weight = dual + draw
            dx = 0.0_wp
            dx(:2, 4:) = spread(slide(i)*[cos(6.0_wp*draw(1)), sin(6.0_wp*draw(1))], 2, n_vertex)
            far = x
            far(3, 4:) = target
            turn = turned(draw(2), draw(3))
            call patch_gap(patch, matmul(turn, x), matmul(turn, dx), 0.0_wp, .true., near)
            call patch_gap(patch, matmul(turn, far), matmul(turn, dx), target, .true., gap)
            call check_near(error, [gap%f0, gap%f1], [0.0_wp, 0.0_wp], tol, 10.0_wp, "values")
            call check_near(error, gap%g(7:), near%g(7:), tol, 10.0_wp, "forces of the master")
         end do
      end do
   end subroutine test_target

   subroutine test_momenta(error)
      type(error_t), allocatable, intent(out) :: error
      type(patch_t) :: patch
      type(patch_gap_t) :: gap
      real(wp) :: x(3, n_point), dx(3, n_point)
      integer :: k

      do k = 1, 40
         call draw_step(0.4_wp**mod(k, 20), 1.0_wp, 0.1_wp, patch, x, dx)
         call patch_gap(patch, x, dx, 0.1_wp, .true., gap)
         call check_near(error, moment_of(gap, x, dx), zero, tol, size_of(gap), "moment")
      end do
   end subroutine test_momenta

   !> Central differences err by the square of their way, beside round-off by the way.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      type(patch_t) :: patch
      type(patch_gap_t) :: gap, up, down
      real(wp), dimension(3, n_point) :: x, dx, way
      real(wp) :: step, bound
      integer :: k

      step = eps**(1.0_wp/3.0_wp)
      bound = 1.0e4_wp*step**2
      do k = 1, 20
         call draw_step(merge(0.3_wp, 0.02_wp, mod(k, 2) == 0), 0.3_wp, 0.05_wp, patch, x, dx)
         call draw_random(way)
         way = 2.0_wp*way - 1.0_wp
         call patch_gap(patch, x, dx, 0.1_wp, .false., gap)
         call patch_gap(patch, x, dx + step*way, 0.1_wp, .true., up)
         call patch_gap(patch, x, dx - step*way, 0.1_wp, .true., down)
         call check_near(error, dot_product(gap%c, way_of(gap, way)), &
            (up%f1 - down%f1)/(2.0_wp*step), bound, 10.0_wp, "gradient " // to_text(k))
         if (up%n_vertex /= gap%n_vertex .or. down%n_vertex /= gap%n_vertex) cycle
         call check_near(error, matmul(gap%h, way_of(gap, way)), (up%g - down%g)/(2.0_wp*step), &
            bound, 10.0_wp, "second derivative " // to_text(k))
      end do
   end subroutine test_derivatives

   !> The cap of a ball of few facets that face a triangle four times as wide: its height fades in
   !> their last ring.
   subroutine make_ball(patch, x)
      integer, parameter :: n_ring = 3, n_around = 8
      real(wp), parameter :: radius = 0.55_wp
      type(patch_t), intent(out) :: patch
      real(wp), allocatable, intent(out) :: x(:, :)
      real(wp) :: angle
      integer :: i, j, n

      patch%area = patch_triangle()
      patch%length = 1.0_wp
      allocate(x(3, 4 + n_ring*n_around), patch%triangle(3, n_around*(2*n_ring - 1)))
      x(:, 1) = [0.07_wp, -0.1_wp, 0.0_wp]
      x(:, 2) = x(:, 1) + [2.7_wp, 0.1_wp, 0.0_wp]
      x(:, 3) = x(:, 1) + [1.1_wp, 2.6_wp, 0.0_wp]
      x(:, 4) = [0.0_wp, 0.0_wp, radius]
      n = 0
      do i = 1, n_ring
         do j = 0, n_around - 1
            angle = 2.0_wp*pi*(j + 0.5_wp*mod(i, 2))/n_around
            x(:, 5 + (i - 1)*n_around + j) = radius*[sin(0.125_wp*pi*i)*[cos(angle), &
               sin(angle)], cos(0.125_wp*pi*i)]
            n = n + 1
            if (i == 1) then
               patch%triangle(:, n) = [1, ring(1, j), ring(1, j + 1)]
               cycle
            end if
            patch%triangle(:, n) = [ring(i - 1, j), ring(i, j + mod(i + 1, 2)), ring(i - 1, j + 1)]
            n = n + 1
            patch%triangle(:, n) = [ring(i - 1, j), ring(i, j - mod(i, 2)), &
               ring(i, j + mod(i + 1, 2))]
         end do
      end do
      patch%n_triangle = n
      patch%n_vertex = size(x, 2) - 3
      allocate(patch%chi(patch%n_vertex), source=1.0_wp)
      patch%chi(patch%n_vertex - n_around + 1:) = 0.0_wp
      x(3, 4:) = x(3, 4:) - 0.6_wp

   contains

      pure integer function ring(i, j)
         integer, intent(in) :: i, j

         ring = 2 + (i - 1)*n_around + modulo(j, n_around)
      end function ring

   end subroutine make_ball

   !> With chi of 1 everywhere entries of the tangent grow as 1/step, from .7 at .01 on.
   subroutine test_silhouette(error)
      type(error_t), allocatable, intent(out) :: error
      type(patch_t) :: patch
      type(patch_gap_t) :: gap
      real(wp), allocatable, dimension(:, :) :: x, dx
      real(wp) :: step
      integer :: i, k

      do i = 2, 12, 2
         step = 0.1_wp**i
         do k = 1, 10
            call make_ball(patch, x)
            if (allocated(dx)) deallocate(dx)
            allocate(dx, mold=x)
            call draw_random(dx)
            x = x + 0.05_wp*(dx - 0.5_wp)
            call draw_random(dx)
            dx = step*(dx - 0.5_wp)
            patch%weight = merge(1.0_wp, 0.0_wp, [0, 1, 2] == mod(k, 3))
            call patch_gap(patch, x, dx, 0.0_wp, .false., gap)
            call check_true(error, gap%n_vertex > 8, "it sees the ball")
            call check_true(error, maxval(abs(gap%h)) < 0.1_wp, "largest entry " // &
               to_text(maxval(abs(gap%h)), 3) // " in a step of " // to_text(step, 2))
            call check_near(error, dot_product(gap%g, way_of(gap, dx)), gap%df, tol, &
               sum(abs(gap%g*way_of(gap, dx))), "identity")
         end do
      end do
   end subroutine test_silhouette

   !> A triangle on one of the master's, moved in its plane by round-off and a little more.
   subroutine test_matching(error)
      type(error_t), allocatable, intent(out) :: error
      type(patch_t) :: patch
      type(patch_gap_t) :: gap, moved
      real(wp), dimension(3, n_point) :: x, dx
      real(wp) :: noise(2, 3), by
      integer :: i

      do i = 0, 4
         by = 8.0_wp*eps*1.0e3_wp**i
         call make_facet(patch, x)
         patch%weight = dual
         x(3, 4:) = [(rough*sin(real(i, wp)), i = 1, n_vertex)]
         associate (corner => x(:, 3 + patch%triangle(:, 2*n_side**2/2 + n_side)))
            x(:2, 1) = sum(corner(:2, :), 2)/3.0_wp
            x(:2, 2) = x(:2, 1) + corner(:2, 2) - corner(:2, 1)
            x(:2, 3) = x(:2, 1) + corner(:2, 3) - corner(:2, 1)
         end associate
         dx = 0.0_wp
         call patch_gap(patch, x, dx, 0.0_wp, .false., gap)
         call draw_random(noise)
         dx(:2, :3) = by*(2.0_wp*noise - 1.0_wp)
         call patch_gap(patch, x, dx, 0.0_wp, .false., moved)
         call check_near(error, moved%g(:6), gap%g(:6), 100.0_wp*(by + eps), 1.0_wp, "gradient")
         call check_true(error, maxval(abs(moved%h)) < 20.0_wp, "tangent " // &
            to_text(maxval(abs(moved%h)), 3))
      end do
   end subroutine test_matching

   subroutine test_first(error)
      type(error_t), allocatable, intent(out) :: error
      type(patch_t) :: patch
      type(patch_gap_t) :: gap, first
      real(wp), dimension(3, n_point) :: x, dx
      integer :: k

      do k = 1, 10
         call draw_step(0.1_wp, 0.1_wp, 0.1_wp, patch, x, dx)
         call patch_gap(patch, x, dx, 0.1_wp, .false., gap)
         call patch_gap(patch, x, dx, 0.1_wp, .true., first)
         call check_near(error, [first%f0, first%f1, first%df, first%g, first%c], &
            [gap%f0, gap%f1, gap%df, gap%g, gap%c], 0.0_wp, 1.0_wp, "bits")
      end do
   end subroutine test_first

end module test_facet_gap
