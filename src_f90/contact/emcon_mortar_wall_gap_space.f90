!> The distance from a wall, integrated over a triangle of a slave facet with a weight: values,
!> discrete gradient and second derivatives over a step.
!>
!> Distances are those of points of the triangle from the shape itself. There is nothing to clip:
!> points of quadrature are enough. Source: docs/theory.md, section 14.2.
module emcon_mortar_wall_gap_space
   use emcon_dgrad_nodes, only : nodes_add_first, nodes_add_second
   use emcon_frame_vertex_space, only : frame_area, frame_area_t, frame_size
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   use emcon_wall, only : wall_t
   use emcon_wall_distance_space, only : wall_find, wall_spot_t
   use emcon_wall_gap_space, only : dg_t, wall_gap
   implicit none
   private
   public :: wall_triangle_t, wall_part_t, wall_triangle_look, wall_triangle_gap, &
      wall_triangle_heights, wall_triangle_rise

   integer, parameter :: n_dim = 3
   !> What a gap depends on: the corners of the triangle, then the origin of the wall and the tips
   !> of its vectors.
   integer, parameter, public :: n_corner = 3, n_part_point = 6
   integer, parameter :: n_var = n_dim*n_part_point

   !> Points of quadrature in a triangle, those of Strang and Fix: exact to degree 4. A weight times
   !> the distance from a plane is of degree 2, from a sphere of degree 3 nearly.
   integer, parameter, public :: n_point = 6
   real(wp), parameter :: root_10 = sqrt(10.0_wp)
   real(wp), parameter :: inner = sqrt(38.0_wp - 8.8_wp*root_10)
   real(wp), parameter :: near_side = (8.0_wp - root_10 + inner)/18.0_wp
   real(wp), parameter :: near_corner = (8.0_wp - root_10 - inner)/18.0_wp
   real(wp), parameter :: part = sqrt(213125.0_wp - 53320.0_wp*root_10)
   real(wp), parameter :: share_side = (620.0_wp + part)/3720.0_wp
   real(wp), parameter :: share_corner = (620.0_wp - part)/3720.0_wp
   real(wp), parameter, public :: point(n_corner, n_point) = reshape([ &
      1.0_wp - 2.0_wp*near_side, near_side, near_side, near_side, 1.0_wp - 2.0_wp*near_side, &
      near_side, near_side, near_side, 1.0_wp - 2.0_wp*near_side, &
      1.0_wp - 2.0_wp*near_corner, near_corner, near_corner, near_corner, &
      1.0_wp - 2.0_wp*near_corner, near_corner, near_corner, near_corner, &
      1.0_wp - 2.0_wp*near_corner], [n_corner, n_point])
   !> Of the area 1/2 that a triangle has in its frame.
   real(wp), parameter, public :: weight_of(n_point) = 0.5_wp*[share_side, share_side, share_side, &
      share_corner, share_corner, share_corner]

   !> What a triangle sees of a wall over a step, for all that is asked of it.
   type :: wall_triangle_t
      type(dg_t), allocatable :: gap(:)          !! (n_point) over the wall and the point
      type(frame_area_t) :: area
   end type wall_triangle_t

   !> An integral over a triangle.
   type :: wall_part_t
      real(wp) :: f0 = 0.0_wp, f1 = 0.0_wp       !! at both ends of the step [L^3]
      real(wp) :: df = 0.0_wp                    !! how it changes, to relative accuracy [L^3]
      real(wp) :: g(n_dim, n_part_point) = 0.0_wp   !! discrete gradient
      real(wp) :: c(n_dim, n_part_point) = 0.0_wp   !! gradient at the end
      real(wp) :: h(n_var, n_var) = 0.0_wp       !! derivative of g by them at the end, if asked for
   end type wall_part_t

contains

   !> What a triangle sees over a step.
   pure subroutine wall_triangle_look(wall, x, dx, leaves_second, triangle)
      type(wall_t), intent(in) :: wall
      !> Corners, origin and tips of the wall: where they start, how they move [L]
      real(wp), intent(in) :: x(n_dim, n_part_point), dx(n_dim, n_part_point)
      logical, intent(in) :: leaves_second       !! no second derivatives are asked for
      type(wall_triangle_t), intent(out) :: triangle
      real(wp), dimension(n_dim, 4) :: at, way
      integer :: q

      allocate(triangle%gap(n_point))
      at(:, 2:) = x(:, n_corner + 1:)
      way(:, 2:) = dx(:, n_corner + 1:)
      do q = 1, n_point
         at(:, 1) = matmul(x(:, :n_corner), point(:, q))
         way(:, 1) = matmul(dx(:, :n_corner), point(:, q))
         triangle%gap(q) = wall_gap(wall, at, way)
      end do
      call frame_area(x(:, :n_corner), dx(:, :n_corner), leaves_second, triangle%area)
   end subroutine wall_triangle_look

   !> The integral of weight times (distance - target).
   pure subroutine wall_triangle_gap(triangle, weight, target, leaves_second, gap)
      type(wall_triangle_t), intent(in) :: triangle
      real(wp), intent(in) :: weight(n_corner)   !! at the corners
      real(wp), intent(in) :: target             !! distance to hold [L]
      logical, intent(in) :: leaves_second       !! no second derivatives
      type(wall_part_t), intent(out) :: gap
      real(wp), dimension(n_dim, 4) :: g, c
      real(wp), allocatable :: h(:, :)
      integer :: q

      if (.not. leaves_second) allocate(h(n_dim*4, n_dim*4))
      do q = 1, n_point
         associate (own => triangle%gap(q), factor => weight_of(q)*dot_product(weight, point(:, q)))
            gap%f0 = gap%f0 + factor*(own%f0 - target)
            gap%f1 = gap%f1 + factor*(own%f1 - target)
            gap%df = gap%df + factor*own%df
            g = 0.0_wp
            c = 0.0_wp
            call nodes_add_first(factor, own%g, [1, 2, 3, 4], g)
            call nodes_add_first(factor, own%c, [1, 2, 3, 4], c)
            call share_first(g, point(:, q), gap%g)
            call share_first(c, point(:, q), gap%c)
            if (leaves_second) cycle
            h = 0.0_wp
            call nodes_add_second(factor, n_dim, own%h, [1, 2, 3, 4], h)
            call share_second(h, point(:, q), gap%h)
         end associate
      end do
      call times_area(triangle%area, leaves_second, gap)
   end subroutine wall_triangle_gap

   !> Add derivatives by a point, which is a sum of corners, and by the wall.
   pure subroutine share_first(of_point, share, by)
      real(wp), intent(in) :: of_point(:, :)     !! (3, 4)
      real(wp), intent(in) :: share(:)           !! of the corners
      real(wp), intent(inout) :: by(:, :)        !! (3, n_part_point)
      integer :: j

      do j = 1, n_corner
         by(:, j) = by(:, j) + share(j)*of_point(:, 1)
      end do
      by(:, n_corner + 1:) = by(:, n_corner + 1:) + of_point(:, 2:)
   end subroutine share_first

   !> The same of second derivatives.
   pure subroutine share_second(of_point, share, by)
      real(wp), intent(in) :: of_point(:, :)     !! (12, 12)
      real(wp), intent(in) :: share(:)
      real(wp), intent(inout) :: by(:, :)        !! (n_var, n_var)
      real(wp) :: full_share(n_part_point)
      integer :: i, j, k, l

      full_share = 1.0_wp
      full_share(:n_corner) = share
      do l = 1, n_part_point
         j = n_dim*max(0, l - n_corner)
         do k = 1, n_part_point
            i = n_dim*max(0, k - n_corner)
            associate (block => by(n_dim*(k - 1) + 1:n_dim*k, n_dim*(l - 1) + 1:n_dim*l))
               block = block + full_share(k)*full_share(l)*of_point(i + 1:i + n_dim, j + 1:j &
                  + n_dim)
            end associate
         end do
      end do
   end subroutine share_second

   !> Times the area of the frame, by the rule of products.
   pure subroutine times_area(area, leaves_second, gap)
      type(frame_area_t), intent(in) :: area
      logical, intent(in) :: leaves_second
      type(wall_part_t), intent(inout) :: gap
      real(wp), dimension(n_dim, n_part_point) :: g, c
      real(wp) :: mean, mean_area
      integer, parameter :: corner(n_corner) = [1, 2, 3]

      g = 0.0_wp
      c = 0.0_wp
      call nodes_add_first(1.0_wp, area%g, corner, g)
      call nodes_add_first(1.0_wp, area%c, corner, c)
      mean = 0.5_wp*(gap%f0 + gap%f1)
      mean_area = 0.5_wp*(area%f(0) + area%f(1))
      if (.not. leaves_second) then
         gap%h = mean_area*gap%h + 0.5_wp*outer(gap%g, c) + 0.5_wp*outer(g, gap%c)
         call nodes_add_second(mean, n_dim, area%h, corner, gap%h)
      end if
      gap%g = mean_area*gap%g + mean*g
      gap%c = area%f(1)*gap%c + gap%f1*c
      gap%df = mean_area*gap%df + mean*area%df
      gap%f0 = area%f(0)*gap%f0
      gap%f1 = area%f(1)*gap%f1
   end subroutine times_area

   pure function outer(a, b)
      real(wp), intent(in) :: a(:, :), b(:, :)   !! (3, n_part_point)
      real(wp) :: outer(n_var, n_var)

      outer = spread(reshape(a, [n_var]), 2, n_var)*spread(reshape(b, [n_var]), 1, n_var)
   end function outer

   !> The integrals of the distance and of 1 at one configuration, with each of the weights that are
   !> 1 at one corner and 0 at the others.
   pure subroutine wall_triangle_heights(wall, at, corner, height, cover)
      type(wall_t), intent(in) :: wall
      real(wp), intent(in) :: at(n_dim, 4)       !! its origin and tips [L]
      real(wp), intent(in) :: corner(n_dim, n_corner)   !! [L]
      real(wp), intent(out) :: height(n_corner)  !! [L^3]
      real(wp), intent(out) :: cover(n_corner)   !! [L^2]
      type(wall_spot_t) :: spot
      integer :: q

      height = 0.0_wp
      do q = 1, n_point
         spot = wall_find(wall, at, matmul(corner, point(:, q)))
         height = height + weight_of(q)*spot%distance*point(:, q)
      end do
      associate (size_of => frame_size(corner))
         height = size_of*height
         cover = size_of/6.0_wp
      end associate
   end subroutine wall_triangle_heights

   !> By how much the distance of a triangle exceeds that of the curved surface that it stands for:
   !> integrals as those of the distance.
   pure function wall_triangle_rise(wall, at, corner, rise) result(excess)
      type(wall_t), intent(in) :: wall
      real(wp), intent(in) :: at(n_dim, 4)       !! its origin and tips [L]
      real(wp), intent(in) :: corner(n_dim, n_corner)   !! [L]
      real(wp), intent(in) :: rise(n_point)      !! of the surface over the points of quadrature [L]
      real(wp) :: excess(n_corner)               !! [L^3]
      type(wall_spot_t) :: here, there
      real(wp) :: normal(n_dim)
      integer :: q

      excess = 0.0_wp
      associate (size_of => frame_size(corner))
         if (.not. size_of > 0.0_wp) return
         normal = cross_product(corner(:, 2) - corner(:, 1), corner(:, 3) - corner(:, 1))/size_of
         do q = 1, n_point
            associate (place => matmul(corner, point(:, q)))
               here = wall_find(wall, at, place)
               there = wall_find(wall, at, place + rise(q)*normal)
            end associate
            excess = excess + size_of*weight_of(q)*(here%distance - there%distance)*point(:, q)
         end do
      end associate
   end function wall_triangle_rise

end module emcon_mortar_wall_gap_space
