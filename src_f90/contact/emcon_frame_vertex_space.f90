! build: elements
!> Where a point is in a frame of two vectors: its affine coordinates and its height, over a step.
!>
!> Source: docs/theory.md, section 2 and eq. (43).
module emcon_frame_vertex_space
   use emcon_dgrad9, only : dg_affine, dg_area, dg_height, dg_plane, dg_t, difference, difference_t
   use emcon_dgrad9_first, only : affine_first => dg_affine, dg_first_t => dg_t, &
      difference_first => difference, difference_first_t => difference_t, &
      height_first => dg_height, plane_first => dg_plane
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   implicit none
   private
   public :: frame_t, frame_of, frame_vertex_t, frame_vertex, frame_affine, frame_place, &
      frame_places, frame_area_t, frame_area, frame_size

   !> Local numbers: coordinates along both vectors of the frame, height over their plane.
   integer, parameter, public :: at_xi = 1, at_eta = 2, at_height = 3
   !> Variables: both vectors of the frame and where the point is, from the origin of the frame.
   integer, parameter, public :: n_frame_var = 9

   !> A frame over a step.
   type :: frame_t
      logical :: leaves_second = .true.          !! no second derivatives
      real(wp) :: x(3) = 0.0_wp, dx(3) = 0.0_wp  !! where its origin starts, how it moves [L]
      type(difference_t), private :: a, b        !! its vectors,
      type(difference_first_t), private :: a_first, b_first
      type(dg_first_t), private :: plane_first(4)      !! and what all points over it share
      type(dg_t), allocatable, private :: plane(:)     !! (4) the same with second derivatives
   end type frame_t

   type :: frame_vertex_t
      real(wp) :: f(3, 0:1) = 0.0_wp             !! at both ends of the step
      real(wp) :: df(3) = 0.0_wp                 !! how they change, to relative accuracy
      real(wp) :: g(n_frame_var, 3) = 0.0_wp     !! discrete gradients
      real(wp) :: c(n_frame_var, 3) = 0.0_wp     !! gradients at the end
   end type frame_vertex_t

   !> The area that both vectors of a frame span.
   type :: frame_area_t
      real(wp) :: f(0:1) = 0.0_wp                !! at both ends of the step [L^2]
      real(wp) :: df = 0.0_wp                    !! how it changes, to relative accuracy [L^2]
      real(wp) :: g(6) = 0.0_wp                  !! discrete gradient by both vectors
      real(wp) :: c(6) = 0.0_wp                  !! gradient at the end
      real(wp) :: h(6, 6) = 0.0_wp               !! derivative of g by them at the end, if asked for
   end type frame_area_t

contains

   !> |a x b| at one configuration [L^2].
   pure real(wp) function frame_size(x) result(area)
      real(wp), intent(in) :: x(3, 3)            !! the origin and the tips of both vectors [L]
      real(wp) :: normal(3)

      associate (a => x(:, 2) - x(:, 1), b => x(:, 3) - x(:, 1))
         normal = cross_product(a, b)
      end associate
      area = sqrt(dot_product(normal, normal))
   end function frame_size

   !> The same over a step.
   pure subroutine frame_area(x, dx, leaves_second, area)
      real(wp), intent(in) :: x(3, 3), dx(3, 3)  !! where they start, how they move [L]
      logical, intent(in) :: leaves_second       !! no second derivatives
      type(frame_area_t), intent(out) :: area
      type(dg_t) :: s

      s = dg_area(difference(2, 1, x, dx), difference(3, 1, x, dx))
      area%f = [s%f0, s%f1]
      area%df = s%df
      area%g = s%g(:6)
      area%c = s%c(:6)
      if (.not. leaves_second) area%h = s%h(:6, :6)
   end subroutine frame_area

   !> The place at one configuration: (xi, eta, height). The height is an L, the coordinates are
   !> shares of `a` and `b`.
   pure function frame_place(a, b, d) result(place)
      real(wp), intent(in) :: a(3), b(3)         !! the frame [L]
      real(wp), intent(in) :: d(3)               !! the point, from its origin [L]
      real(wp) :: place(3)
      real(wp) :: places(3, 1)

      call frame_places(a, b, reshape(d, [3, 1]), places)
      place = places(:, 1)
   end function frame_place

   !> The places of points.
   pure subroutine frame_places(a, b, d, place)
      real(wp), intent(in) :: a(3), b(3)         !! the frame [L]
      real(wp), intent(in) :: d(:, :)            !! (3, n) the points, from its origin [L]
      real(wp), intent(out) :: place(:, :)       !! (3, n)
      real(wp) :: aa, ab, bb, da, db, square, length, normal(3)
      integer :: j

      aa = dot_product(a, a)
      ab = dot_product(a, b)
      bb = dot_product(b, b)
      square = aa*bb - ab*ab
      normal = cross_product(a, b)
      length = sqrt(dot_product(normal, normal))
      do j = 1, size(d, 2)
         da = dot_product(d(:, j), a)
         db = dot_product(d(:, j), b)
         place(:2, j) = [bb*da - ab*db, aa*db - ab*da]/square
         place(3, j) = dot_product(d(:, j), normal)/length
      end do
   end subroutine frame_places

   !> The frame of an origin and the tips of both vectors.
   pure function frame_of(x, dx, leaves_second) result(frame)
      real(wp), intent(in) :: x(3, 3), dx(3, 3)  !! where they start, how they move [L]
      logical, intent(in) :: leaves_second       !! no second derivatives
      type(frame_t) :: frame

      frame%leaves_second = leaves_second
      frame%x = x(:, 1)
      frame%dx = dx(:, 1)
      if (leaves_second) then
         frame%a_first = difference_first(2, 1, x, dx)
         frame%b_first = difference_first(3, 1, x, dx)
         frame%plane_first = plane_first(frame%a_first, frame%b_first)
      else
         frame%a = difference(2, 1, x, dx)
         frame%b = difference(3, 1, x, dx)
         frame%plane = dg_plane(frame%a, frame%b)
      end if
   end function frame_of

   !> The place of a point over a step.
   pure subroutine frame_vertex(frame, x, dx, vertex, second)
      type(frame_t), intent(in) :: frame
      real(wp), intent(in) :: x(3), dx(3)        !! where it starts, how it moves [L]
      type(frame_vertex_t), intent(out) :: vertex
      !> (i, j, which) derivative of g(i, which) by variable j at the end; only of a frame with such
      real(wp), intent(inout) :: second(:, :, :)

      call frame_affine(frame, x, dx, vertex, second)
      if (frame%leaves_second) then
         call take_first(at_height, height_first(way_first(frame, x, dx), frame%a_first, &
            frame%b_first), vertex)
      else
         call take(at_height, dg_height(way(frame, x, dx), frame%a, frame%b), vertex, second)
      end if
   end subroutine frame_vertex

   !> Its affine coordinates alone.
   pure subroutine frame_affine(frame, x, dx, vertex, second)
      type(frame_t), intent(in) :: frame
      real(wp), intent(in) :: x(3), dx(3)        !! where it starts, how it moves [L]
      type(frame_vertex_t), intent(out) :: vertex    !! with no height
      real(wp), intent(inout) :: second(:, :, :) !! as `frame_vertex`
      type(dg_t) :: xi, eta
      type(dg_first_t) :: xi_first, eta_first

      if (frame%leaves_second) then
         call affine_first(way_first(frame, x, dx), frame%a_first, frame%b_first, &
            frame%plane_first, xi_first, eta_first)
         call take_first(at_xi, xi_first, vertex)
         call take_first(at_eta, eta_first, vertex)
      else
         call dg_affine(way(frame, x, dx), frame%a, frame%b, frame%plane, xi, eta)
         call take(at_xi, xi, vertex, second)
         call take(at_eta, eta, vertex, second)
      end if
   end subroutine frame_affine

   !> The way to a point from the origin of the frame.
   pure type(difference_t) function way(frame, x, dx)
      type(frame_t), intent(in) :: frame
      real(wp), intent(in) :: x(3), dx(3)

      way = difference_t(4, 1, x - frame%x, (x - frame%x) + (dx - frame%dx), dx - frame%dx)
   end function way

   !> The same without second derivatives.
   pure type(difference_first_t) function way_first(frame, x, dx)
      type(frame_t), intent(in) :: frame
      real(wp), intent(in) :: x(3), dx(3)

      way_first = difference_first_t(4, 1, x - frame%x, (x - frame%x) + (dx - frame%dx), &
         dx - frame%dx)
   end function way_first

   !> Take a number as one of the place.
   pure subroutine take(i, s, vertex, second)
      integer, intent(in) :: i                   !! which: `at_xi`, `at_eta`, `at_height`
      type(dg_t), intent(in) :: s
      type(frame_vertex_t), intent(inout) :: vertex
      real(wp), intent(inout) :: second(:, :, :)

      vertex%f(i, :) = [s%f0, s%f1]
      vertex%df(i) = s%df
      vertex%g(:, i) = s%g
      vertex%c(:, i) = s%c
      second(:, :, i) = s%h
   end subroutine take

   !> The same without second derivatives.
   pure subroutine take_first(i, s, vertex)
      integer, intent(in) :: i
      type(dg_first_t), intent(in) :: s
      type(frame_vertex_t), intent(inout) :: vertex

      vertex%f(i, :) = [s%f0, s%f1]
      vertex%df(i) = s%df
      vertex%g(:, i) = s%g
      vertex%c(:, i) = s%c
   end subroutine take_first

end module emcon_frame_vertex_space
