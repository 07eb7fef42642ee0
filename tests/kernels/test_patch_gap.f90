!> Mean heights over a patch that slides over triangles: values, identities, momenta, derivatives.
module test_patch_gap
   use check, only : check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_patch_gap_space, only : patch_gap, patch_gap_t
   use emcon_patch_look_space, only : patch_look, patch_look_t, patch_t
   use emcon_text, only : to_text
   use patch_scenes, only : make_grid, moment_of, n_point, n_side, n_vertex, rough, size_of, &
      turned, way_of
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_patch_gap

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Some 100 roundings of quantities of size 1.
   real(wp), parameter :: tol = 128.0_wp*eps
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

   !> A rough surface, the patch `height` below it near the middle, and a step: a slide of `slide`
   !> in some direction, a turn by `turn`, and a change of shape of `wobble`. Each fourth time the
   !> patch begins at a vertex, else on a side.
   subroutine draw_step(number, slide, turn, wobble, patch, x, dx)
      integer, intent(in) :: number
      real(wp), intent(in) :: slide, turn, wobble
      type(patch_t), intent(out) :: patch
      real(wp), intent(out) :: x(3, n_point), dx(3, n_point)
      real(wp) :: noise(3, n_point), end(3, n_point), at(3), way(2), draw(3)

      call make_grid(patch, patch_length, x)
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
         call make_grid(patch, patch_length, x)
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

      call make_grid(patch, patch_length, x)
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

   subroutine test_momenta(error)
      type(error_t), allocatable, intent(out) :: error
      type(patch_t) :: patch
      type(patch_gap_t) :: gap
      real(wp) :: x(3, n_point), dx(3, n_point)
      integer :: k

      do k = 1, 60
         call draw_step(k, 0.4_wp**mod(k, 20), 1.0_wp, 0.1_wp, patch, x, dx)
         call patch_gap(patch, x, dx, 0.0_wp, .true., gap)
         call check_near(error, moment_of(gap, x, dx), [0.0_wp, 0.0_wp, 0.0_wp], tol, &
            size_of(gap), "moment")
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

   !> A patch whose sides lie on sides of triangles, or whose corner is a vertex, moved by
   !> round-off.
   subroutine test_aligned(error)
      type(error_t), allocatable, intent(out) :: error
      type(patch_t) :: patch
      type(patch_gap_t) :: gap(2)
      real(wp), dimension(3, n_point) :: x, dx
      real(wp) :: corner(2)
      integer :: k

      do k = 1, 4
         call make_grid(patch, patch_length, x)
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
