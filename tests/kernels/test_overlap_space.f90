!> How deep closed surfaces in space are in each other, beside closed forms.
module test_overlap_space
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_inside_space, only : inside_find, inside_t
   use emcon_kinds, only : wp
   use emcon_overlap_query, only : overlap_t
   use emcon_overlap_space, only : overlap_space_find, overlap_space_own
   use emcon_text, only : to_text
   use emcon_triangles_space, only : triangles_init, triangles_place, triangles_t
   use space_shapes, only : make_box, make_box_of_triangles, make_sphere, shape_surface_t, &
      turn_surface
   implicit none
   private
   public :: collect_overlap_space

   !> Some dozen roundings of quantities of size 1.
   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)

contains

   subroutine collect_overlap_space(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("spheres, by their closed form", test_spheres), &
         test_case_t("bars that cross, no node in either", test_bars), &
         test_case_t("boxes that touch exactly", test_touch), &
         test_case_t("like boxes, one into the other", test_like), &
         test_case_t("boxes in one place, and flush", test_flush), &
         test_case_t("one body all within another", test_within), &
         test_case_t("a body in the hole of another", test_hole), &
         test_case_t("a surface that is not closed", test_open), &
         test_case_t("a body in itself", test_own), &
         test_case_t("ends of a body that meet flush", test_own_flush), &
         test_case_t("in other units, bit by bit", test_units)]
   end subroutine collect_overlap_space

   subroutine take_up(triangles, surface)
      type(triangles_t), intent(out) :: triangles
      type(shape_surface_t), intent(in) :: surface
      real(wp) :: thickness(size(surface%facet, 2)), rest(3, size(surface%x, 2))

      thickness = 1.0_wp
      rest = 0.0_wp
      call triangles_init(triangles, surface%x, surface%facet, thickness)
      call triangles_place(triangles, surface%x, rest, rest, 0.0_wp)
   end subroutine take_up

   !> Depths of each in the other.
   subroutine look(first, second, depth, overlap)
      type(shape_surface_t), intent(in) :: first, second
      real(wp), intent(out) :: depth(2)
      type(overlap_t), intent(out), optional :: overlap
      type(triangles_t) :: a, b
      type(overlap_t) :: found(2)
      real(wp) :: reach

      call take_up(a, first)
      call take_up(b, second)
      reach = max(maxval(a%length), maxval(b%length))
      call overlap_space_find(a, b, reach, .false., found(1))
      call overlap_space_find(b, a, reach, .false., found(2))
      depth = found%depth*found%length
      if (present(overlap)) overlap = found(1)
   end subroutine look

   !> Two unit spheres in each other by 0.1, the second turned: depths come up to that as meshes get
   !> finer, from below, and nodes inside are those that the sphere counts, but for its sagitta.
   subroutine test_spheres(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: deep = 0.1_wp, least(2:4) = [0.08_wp, 0.085_wp, 0.085_wp]
      integer, parameter :: missed(2:4) = [4, 4, 8]
      type(shape_surface_t) :: one, other
      type(triangles_t) :: a, b
      type(inside_t) :: inside
      real(wp) :: depth(2)
      integer :: n, i, by_sphere

      do n = 2, 4
         call make_sphere(one, n, 1.0_wp)
         call make_sphere(other, n, 1.0_wp)
         call check_equal(error, size(one%x, 2), 2 + size(one%facet, 2)/2, "nodes of a sphere")
         call turn_surface(other, [0.0_wp, 0.0_wp, 2.0_wp - deep])
         call look(one, other, depth)
         call check_true(error, all(depth >= least(n) .and. depth <= deep), "depth " &
            // to_text(n) // ": " // to_text(depth(1), 4) // ", " // to_text(depth(2), 4))
         call take_up(a, one)
         call take_up(b, other)
         call inside_find(inside, a, b, maxval(b%length))
         by_sphere = count([(norm2(one%x(:, i) - [0.0_wp, 0.0_wp, 2.0_wp - deep]) < 1.0_wp, i = 1, &
            size(one%x, 2))])
         call check_true(error, size(inside%point) <= by_sphere &
            .and. size(inside%point) >= by_sphere - missed(n), "nodes inside " &
            // to_text(size(inside%point)) // " of " // to_text(by_sphere))
      end do
   end subroutine test_spheres

   !> The middles of the parts of edges that are inside tell how deep.
   subroutine test_bars(error)
      type(error_t), allocatable, intent(out) :: error
      type(shape_surface_t) :: one, other
      real(wp) :: depth(2)

      call make_box_of_triangles(one, [1, 1, 1], [-1.0_wp, -0.1_wp, 0.0_wp], &
         [1.0_wp, 0.1_wp, 1.0_wp], .false.)
      call make_box_of_triangles(other, [1, 1, 1], [-0.1_wp, -1.0_wp, -0.95_wp], &
         [0.1_wp, 1.0_wp, 0.05_wp], .true.)
      call look(one, other, depth)
      call check_near(error, depth, [0.05_wp, 0.05_wp], tol, 1.0_wp, "depth")
      call make_box(one, [2, 1, 1], [-1.0_wp, -0.1_wp, 0.0_wp], [1.0_wp, 0.1_wp, 1.0_wp])
      call make_box(other, [1, 2, 1], [-0.1_wp, -1.0_wp, -0.95_wp], [0.1_wp, 1.0_wp, 0.05_wp])
      call look(one, other, depth)
      call check_near(error, depth, [0.05_wp, 0.05_wp], tol, 1.0_wp, "depth of quadrilaterals")
   end subroutine test_bars

   !> On top of each other, meshes of all kinds, like and mirrored ones: no depth at all.
   subroutine test_touch(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: low(3) = [0.0_wp, 0.0_wp, 0.0_wp], high(3) = [1.0_wp, 1.0_wp, &
         1.0_wp], &
         up(3) = [0.0_wp, 0.0_wp, 1.0_wp]
      type(shape_surface_t) :: one, other
      real(wp) :: depth(2)
      integer :: n

      do n = 1, 4
         call make_box(one, [3, 3, 1], low, high)
         call make_box(other, [n, n, 1], low + up, high + up)
         call look(one, other, depth)
         call check_near(error, depth, [0.0_wp, 0.0_wp], tol, 1.0_wp, "quadrilaterals")
         call make_box(other, [2, n, 1], [-0.2_wp, -0.2_wp, 1.0_wp], [1.3_wp, 1.3_wp, 2.0_wp])
         call look(one, other, depth)
         call check_near(error, depth, [0.0_wp, 0.0_wp], tol, 1.0_wp, "a larger one")
         call make_box_of_triangles(one, [3, 3, 1], low, high, .false.)
         call make_box_of_triangles(other, [n, n, 1], low + up, high + up, .false.)
         call look(one, other, depth)
         call check_near(error, depth, [0.0_wp, 0.0_wp], tol, 1.0_wp, "triangles")
         call make_box_of_triangles(other, [n, n, 1], low + up, high + up, .true.)
         call look(one, other, depth)
         call check_near(error, depth, [0.0_wp, 0.0_wp], tol, 1.0_wp, "mirrored triangles")
         call turn_surface(one, up)
         call turn_surface(other, up)
         call look(one, other, depth)
         call check_near(error, depth, [0.0_wp, 0.0_wp], tol, 8.0_wp, "turned")
      end do
   end subroutine test_touch

   !> Sides in one plane, nodes over nodes and edges in edges.
   subroutine test_like(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: deep = 0.03_wp
      type(shape_surface_t) :: one, other
      real(wp) :: depth(2)
      integer :: n, k

      do n = 1, 4
         do k = 0, 2
            call make_box_of_triangles(one, [n, n, n], [0.0_wp, 0.0_wp, 0.0_wp], &
               [1.0_wp, 1.0_wp, 1.0_wp], .false.)
            call make_box_of_triangles(other, [n, n, n], [0.0_wp, 0.0_wp, 1.0_wp - deep], &
               [1.0_wp, 1.0_wp, 2.0_wp - deep], k == 1)
            if (k == 2) call make_box(one, [n, n, n], [0.0_wp, 0.0_wp, 0.0_wp], &
               [1.0_wp, 1.0_wp, 1.0_wp])
            if (k == 2) call make_box(other, [n, n, n], [0.0_wp, 0.0_wp, 1.0_wp - deep], &
               [1.0_wp, 1.0_wp, 2.0_wp - deep])
            call look(one, other, depth)
            call check_near(error, depth, [deep, deep], tol, 1.0_wp, "depth " // to_text(n))
            call turn_surface(one, [0.0_wp, 0.0_wp, 1.0_wp])
            call turn_surface(other, [0.0_wp, 0.0_wp, 1.0_wp])
            call look(one, other, depth)
            call check_near(error, depth, [deep, deep], tol, 8.0_wp, "turned " // to_text(n))
         end do
      end do
   end subroutine test_like

   !> Unit boxes of one and of eight hexahedra that have sides, or all of their nodes, in one place:
   !> the deepest point is no node, and half the thickness (here 1) of an element behind a face.
   subroutine test_flush(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: low(3) = [0.0_wp, 0.0_wp, 0.0_wp], high(3) = [1.0_wp, 1.0_wp, &
         1.0_wp], &
         shift(3, 4) = reshape([0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, -0.5_wp, &
         0.0_wp, -0.5_wp, -0.5_wp, 0.0_wp, 0.0_wp, -0.9_wp], [3, 4])
      real(wp), parameter :: deep(4) = [0.5_wp, 0.5_wp, 0.5_wp, 0.1_wp]
      type(shape_surface_t) :: one, other
      real(wp) :: depth(2)
      integer :: n, k

      do n = 1, 2
         do k = 1, size(deep)
            call make_box(one, [n, n, n], low, high)
            call make_box(other, [n, n, n], low + shift(:, k), high + shift(:, k))
            call look(one, other, depth)
            call check_true(error, minval(depth) >= deep(k)/2, "boxes of " // to_text(n) // &
               " elements a side, place " // to_text(k))
            call check_true(error, maxval(depth) <= (1.0_wp + tol)*deep(k), &
               "no deeper than they are")
         end do
      end do
   end subroutine test_flush

   !> Nothing crosses: a ray tells. The deepest node is in the middle.
   subroutine test_within(error)
      type(error_t), allocatable, intent(out) :: error
      type(shape_surface_t) :: one, other
      real(wp) :: depth(2)

      call make_sphere(one, 1, 0.1_wp)
      call make_box(other, [3, 2, 2], [-1.0_wp, -1.0_wp, -1.0_wp], [1.0_wp, 1.0_wp, 1.0_wp])
      call look(one, other, depth)
      call check_near(error, depth(1), 1.0_wp - 0.1_wp*0.5_wp, 0.06_wp, 1.0_wp, "small in large")
      call check_near(error, depth(2), 0.0_wp, 0.0_wp, 1.0_wp, "large in small")
   end subroutine test_within

   !> Boxes of walls around it are apart, whatever the boxes around all of it say.
   subroutine test_hole(error)
      type(error_t), allocatable, intent(out) :: error
      type(shape_surface_t) :: one, other, inner
      real(wp) :: depth(2)
      integer :: n

      call make_sphere(one, 1, 0.1_wp)
      call make_box(other, [3, 2, 2], [-1.0_wp, -1.0_wp, -1.0_wp], [1.0_wp, 1.0_wp, 1.0_wp])
      call make_box(inner, [1, 1, 1], [-0.5_wp, -0.5_wp, -0.5_wp], [0.5_wp, 0.5_wp, 0.5_wp])
      n = size(other%x, 2)
      other%x = reshape([other%x, inner%x], [3, n + size(inner%x, 2)])
      other%facet = reshape([other%facet, n + inner%facet(4:1:-1, :)], &
         [4, size(other%facet, 2) + size(inner%facet, 2)])
      call look(one, other, depth)
      call check_near(error, depth, [0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "in the hole")
      one%x(1, :) = one%x(1, :) + 0.45_wp
      call look(one, other, depth)
      call check_true(error, depth(1) > 0.04_wp .and. depth(1) <= 0.05_wp + tol, "in its wall: " &
         // to_text(depth(1), 17))
   end subroutine test_hole

   !> One facet alone: what crosses it counts, what passes beside it does not.
   subroutine test_open(error)
      type(error_t), allocatable, intent(out) :: error
      type(shape_surface_t) :: one, sheet
      type(overlap_t) :: overlap
      real(wp) :: depth(2)

      call make_box(one, [4, 4, 4], [-0.5_wp, -0.5_wp, -0.05_wp], [0.5_wp, 0.5_wp, 0.95_wp])
      allocate(sheet%x(3, 4), sheet%facet(4, 1))
      sheet%x = reshape([-1.0_wp, -1.0_wp, 0.0_wp, 1.0_wp, -1.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, &
         0.0_wp, &
         -1.0_wp, 1.0_wp, 0.0_wp], [3, 4])
      sheet%facet(:, 1) = [1, 2, 3, 4]
      call look(one, sheet, depth, overlap)
      call check_near(error, depth(1), 0.05_wp, tol, 1.0_wp, "in the sheet")
      call check_equal(error, overlap%facet(:4), [1, 2, 3, 4], "its facet")
      call check_near(error, overlap%length, 2.0_wp, tol, 1.0_wp, "its length")
      one%x(1, :) = one%x(1, :) + 1.6_wp
      call look(one, sheet, depth)
      call check_near(error, depth, [0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, "beside it")
   end subroutine test_open

   !> A bar bent to a ring whose ends have gone into each other by 0.05; before that, nothing.
   subroutine test_own(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: deep(3) = [-0.05_wp, 0.0_wp, 0.05_wp]
      type(shape_surface_t) :: bar
      type(triangles_t) :: a
      type(overlap_t) :: overlap
      real(wp) :: angle, radius
      integer :: i, k

      do k = 1, size(deep)
         call make_box(bar, [24, 2, 2], [0.0_wp, 2.0_wp, 0.0_wp], [1.0_wp, 3.0_wp, 1.0_wp])
         do i = 1, size(bar%x, 2)
            angle = (2.0_wp*acos(-1.0_wp) + deep(k)/2.5_wp)*bar%x(1, i)
            radius = bar%x(2, i)
            bar%x(:, i) = [radius*sin(angle), radius*cos(angle), bar%x(3, i) + 0.1_wp*bar%x(1, i)]
         end do
         call take_up(a, bar)
         overlap = overlap_t()
         call overlap_space_own(a, overlap)
         if (deep(k) <= 0.0_wp) then
            call check_true(error, overlap%depth <= tol, "apart or in touch: " &
               // to_text(overlap%depth, 3))
         else
            call check_true(error, overlap%depth*overlap%length > 0.02_wp .and. overlap%depth &
               *overlap%length < 0.07_wp, "deep: " // to_text(overlap%depth*overlap%length, 4))
         end if
      end do
   end subroutine test_own

   !> A bar bent to a ring whose ends, mirror images, are in each other by little: their sides nearly
   !> lie in one plane, and what is beyond the other end is not inside of it.
   subroutine test_own_flush(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: deep = 1.0e-6_wp
      type(shape_surface_t) :: bar
      type(triangles_t) :: a
      type(overlap_t) :: overlap
      real(wp) :: angle, worst
      integer :: i, k

      worst = 0.0_wp
      do k = 1, 20
         call make_box(bar, [24, 2, 2], [0.0_wp, 2.0_wp, 0.0_wp], [1.0_wp, 3.0_wp, 1.0_wp])
         do i = 1, size(bar%x, 2)
            angle = (2.0_wp*acos(-1.0_wp) + deep/2.5_wp)*bar%x(1, i)
            associate (rise => 0.1_wp*min(bar%x(1, i), 1.0_wp - bar%x(1, i))*[sin( &
                  5.0_wp*bar%x(2, i) + real(k, wp)), cos(7.0_wp*bar%x(3, i) + real(k, wp))])
               bar%x(:, i) = [(bar%x(2, i) + rise(1))*sin(angle), (bar%x(2, i) + rise(1)) &
                  *cos(angle), bar%x(3, i) + rise(2)]
            end associate
         end do
         call take_up(a, bar)
         overlap = overlap_t()
         call overlap_space_own(a, overlap)
         worst = max(worst, overlap%depth*overlap%length)
      end do
      call check_true(error, worst < 2.0_wp*deep, "as deep as they are: " // to_text(worst, 4))
   end subroutine test_own_flush

   !> Powers of two change nothing but the length.
   subroutine test_units(error)
      type(error_t), allocatable, intent(out) :: error
      type(shape_surface_t) :: one, other
      type(overlap_t) :: overlap, scaled
      real(wp) :: depth(2), small(2)

      call make_sphere(one, 2, 1.0_wp)
      call make_box(other, [3, 2, 2], [-0.5_wp, -0.5_wp, 0.0_wp], [0.5_wp, 0.5_wp, 1.0_wp])
      call turn_surface(other, [0.0_wp, 0.0_wp, 1.1_wp])
      call look(one, other, depth, overlap)
      call check_true(error, minval(depth) > 0.0_wp, "in each other")
      one%x = scale(one%x, -40)
      other%x = scale(other%x, -40)
      call look(one, other, small, scaled)
      call check_near(error, scale(small, 40), depth, 0.0_wp, 1.0_wp, "depth")
      call check_equal(error, scaled%facet, overlap%facet, "facet")
      call check_equal(error, scaled%node, overlap%node, "node")
   end subroutine test_units

end module test_overlap_space
