!> What goes through what within a step in space: instants beside closed forms.
module test_passages_space
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_passages_space, only : cubic_roots, passage_t, passages_find, way_t
   use emcon_text, only : to_text
   use emcon_triangles_space, only : triangles_init, triangles_place, triangles_t
   use space_shapes, only : make_box, make_box_of_triangles, make_sphere, shape_surface_t
   implicit none
   private
   public :: collect_passages_space

   !> Halvings leave 2^-40 of the step.
   real(wp), parameter :: tol = 1.0e-11_wp

contains

   subroutine collect_passages_space(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("roots of cubics", test_roots), &
         test_case_t("a ball through a plate", test_ball), &
         test_case_t("bars through each other, no node through a face", test_bars), &
         test_case_t("what lifts off or rests goes through nothing", test_nothing)]
   end subroutine collect_passages_space

   !> Cubics with known roots, of all sizes and degrees.
   subroutine test_roots(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: c(0:3), root(3), r(3), scale
      logical :: falls(3)
      integer :: n, k

      do k = 1, 100
         call random_number(r)
         scale = 10.0_wp**(k - 50)
         c = scale*[-product(r), r(1)*r(2) + r(2)*r(3) + r(3)*r(1), -sum(r), 1.0_wp]
         call cubic_roots(c, root, falls, n)
         call check_equal(error, n, 3, "three roots, " // to_text(k))
         call check_near(error, [minval(root), sum(root), maxval(root)], [minval(r), sum(r), &
            maxval(r)], 1.0e-6_wp, 1.0_wp, "roots")
         call check_true(error, .not. falls(1) .and. falls(2) .and. .not. falls(3), "signs")
         call cubic_roots(scale*[-r(1), 1.0_wp, 0.0_wp, 0.0_wp], root, falls, n)
         call check_equal(error, n, 1, "of a line")
         call check_near(error, root(1), r(1), tol, 1.0_wp, "root of a line")
         call cubic_roots(scale*[r(1)*r(2), -r(1) - r(2), 1.0_wp, 0.0_wp], root, falls, n)
         call check_equal(error, n, 2, "of a parabola")
         call check_near(error, root(1) + root(2), r(1) + r(2), tol, 1.0_wp, "of a parabola")
         call cubic_roots(scale*[2.0_wp + r(1), -1.0_wp, 0.0_wp, 0.5_wp], root, falls, n)
         call check_equal(error, n, 0, "none")
      end do
      call cubic_roots([0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], root, falls, n)
      call check_equal(error, n, 0, "of nothing")
   end subroutine test_roots

   subroutine take_up(surface, move, body, way)
      type(shape_surface_t), intent(in) :: surface
      real(wp), intent(in) :: move(3)
      type(triangles_t), intent(out) :: body
      type(way_t), intent(out) :: way
      real(wp) :: thickness(size(surface%facet, 2)), rest(3, size(surface%x, 2))

      thickness = 1.0_wp
      rest = 0.0_wp
      call triangles_init(body, surface%x, surface%facet, thickness)
      call triangles_place(body, surface%x, rest, rest, 0.0_wp)
      way%start = body%at
      way%rate = spread(move, 2, size(body%at, 2))
   end subroutine take_up

   !> All 162 nodes of a ball of 0.3 go through a plate of 0.05, each from where it meets the upper
   !> side to where it leaves the lower one.
   subroutine test_ball(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: from(3) = [0.01_wp, 0.02_wp, 0.5_wp], move(3) = [0.1_wp, 0.0_wp, &
         -1.1_wp]
      type(shape_surface_t) :: ball, plate
      type(triangles_t) :: a, b
      type(way_t) :: way_a, way_b
      type(passage_t), allocatable :: passage(:)
      integer :: i

      call make_sphere(ball, 2, 0.3_wp)
      do i = 1, size(ball%x, 2)
         ball%x(:, i) = ball%x(:, i) + from
      end do
      call make_box_of_triangles(plate, [8, 8, 1], [-1.0_wp, -1.0_wp, -0.05_wp], &
         [1.0_wp, 1.0_wp, 0.0_wp], .false.)
      call take_up(ball, move, a, way_a)
      call take_up(plate, [0.0_wp, 0.0_wp, 0.0_wp], b, way_b)
      allocate(passage(0))
      call passages_find(a, b, way_a, way_b, 0.04_wp, passage)
      call check_true(error, size(passage) >= 162, "passages: " // to_text(size(passage)))
      do i = 1, size(passage)
         if (abs(passage(i)%to - passage(i)%from - 0.05_wp/1.1_wp) > tol) cycle
         call check_near(error, passage(i)%path, 0.05_wp/1.1_wp*norm2(move), tol, 1.0_wp, "path")
      end do
      call check_true(error, count(abs(passage%to - passage%from - 0.05_wp/1.1_wp) <= tol) >= 162, &
         "each node")
   end subroutine test_ball

   !> The upper bar's lower edges meet the upper edges of the lower one at 0.25, and the lower edges
   !> at 0.5; its upper edges meet them later.
   subroutine test_bars(error)
      type(error_t), allocatable, intent(out) :: error
      type(shape_surface_t) :: lower, upper
      type(triangles_t) :: a, b
      type(way_t) :: way_a, way_b
      type(passage_t), allocatable :: passage(:)

      call make_box(lower, [1, 1, 1], [-1.0_wp, -0.1_wp, -0.25_wp], [1.0_wp, 0.1_wp, 0.0_wp])
      call make_box(upper, [1, 1, 1], [-0.1_wp, -1.0_wp, 0.25_wp], [0.1_wp, 1.0_wp, 0.35_wp])
      call take_up(upper, [0.0_wp, 0.0_wp, -1.0_wp], a, way_a)
      call take_up(lower, [0.0_wp, 0.0_wp, 0.0_wp], b, way_b)
      allocate(passage(0))
      call passages_find(a, b, way_a, way_b, 0.2_wp, passage)
      call check_true(error, size(passage) > 0, "passages")
      call check_true(error, all(abs(passage%path - 0.25_wp) <= tol), "paths")
      call check_near(error, minval(passage%from), 0.25_wp, tol, 1.0_wp, "first from")
      call check_near(error, maxval(passage%to), 0.6_wp, tol, 1.0_wp, "last to")
   end subroutine test_bars

   !> A box on a box, that lifts off, or moves with it.
   subroutine test_nothing(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: move(3, 2) = reshape([0.0_wp, 0.1_wp, 1.0_wp, 0.0_wp, 0.0_wp, &
         0.0_wp], [3, 2])
      type(shape_surface_t) :: lower, upper
      type(triangles_t) :: a, b
      type(way_t) :: way_a, way_b
      type(passage_t), allocatable :: passage(:)
      integer :: k

      call make_box(lower, [3, 3, 1], [0.0_wp, 0.0_wp, 0.0_wp], [1.0_wp, 1.0_wp, 1.0_wp])
      call make_box(upper, [2, 2, 1], [0.0_wp, 0.0_wp, 1.0_wp], [1.0_wp, 1.0_wp, 2.0_wp])
      allocate(passage(0))
      do k = 1, 2
         call take_up(upper, move(:, k), a, way_a)
         call take_up(lower, [0.0_wp, 0.0_wp, 0.0_wp], b, way_b)
         call passages_find(a, b, way_a, way_b, 1.0e-6_wp, passage)
         call passages_find(b, a, way_b, way_a, 1.0e-6_wp, passage)
         call check_equal(error, size(passage), 0, "move " // to_text(k))
      end do
   end subroutine test_nothing

end module test_passages_space
