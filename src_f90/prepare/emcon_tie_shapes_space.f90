!> Shape functions of facets at places in the triangles that they are split into.
!>
!> Facets of three and four nodes are linear in each triangle, the centre taken with its weights.
!> Those with nodes between their corners have the shape functions of their elements, at natural
!> coordinates that are linear in each triangle; of quadrilaterals that are no parallelograms at
!> those of the bilinear map of their corners: exact where sides are straight.
!> Source: docs/theory.md, section 10.10.
module emcon_tie_shapes_space
   use emcon_facet_split, only : facet_split_centre
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   implicit none
   private
   public :: tie_shapes, tie_skew, most_nodes

   !> Nodes of a facet, at most.
   integer, parameter :: most_nodes = 8
   !> Natural coordinates of nodes in turn around a facet, and of its centre.
   real(wp), parameter :: third = 1.0_wp/3.0_wp
   real(wp), parameter :: triangle(2, 7) = reshape([0.0_wp, 0.0_wp, 0.5_wp, 0.0_wp, 1.0_wp, &
      0.0_wp, 0.5_wp, 0.5_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.5_wp, third, third], [2, 7])
   real(wp), parameter :: square(2, 9) = reshape([-1.0_wp, -1.0_wp, 0.0_wp, -1.0_wp, 1.0_wp, &
      -1.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, -1.0_wp, 1.0_wp, -1.0_wp, 0.0_wp, &
      0.0_wp, 0.0_wp], [2, 9])

   !> A quadrilateral that is off a parallelogram by less, per length of its sides, is one.
   real(wp), parameter :: rounding = 64.0_wp*epsilon(1.0_wp)

contains

   !> How far a facet of eight nodes is from a parallelogram: its corners are at the values of
   !> b0 + b1 (x + skew(1) x y) + b2 (y + skew(2) x y) at x, y = -1, 1. Of others 0.
   pure function tie_skew(x) result(skew)
      real(wp), intent(in) :: x(:, :)            !! (3, nodes of the facet) [L]
      real(wp) :: skew(2)
      real(wp) :: along(3), across(3), twist(3), normal(3), square

      skew = 0.0_wp
      if (size(x, 2) /= most_nodes) return
      along = (x(:, 3) - x(:, 1)) + (x(:, 5) - x(:, 7))
      across = (x(:, 7) - x(:, 1)) + (x(:, 5) - x(:, 3))
      twist = (x(:, 1) - x(:, 3)) + (x(:, 5) - x(:, 7))
      normal = cross_product(along, across)
      square = dot_product(normal, normal)
      if (.not. square > 0.0_wp) return
      skew(1) = dot_product(cross_product(twist, across), normal)/square
      skew(2) = dot_product(cross_product(along, twist), normal)/square
      if (all(abs(skew) <= rounding)) skew = 0.0_wp
   end function tie_skew

   !> Values of the shape functions of a facet of `n` nodes at a place of triangle `k` of its split.
   pure function tie_shapes(n, k, share, skew) result(value)
      integer, intent(in) :: n                   !! 3, 4, 6 or 8
      integer, intent(in) :: k                   !! 1 to the number of triangles
      real(wp), intent(in) :: share(3)           !! barycentric coordinates of the place
      real(wp), intent(in) :: skew(2)            !! of the facet
      real(wp) :: value(n)
      integer :: next

      next = 1 + mod(k, n)
      select case (n)
      case (3)
         value = share
      case (6)
         value = quadratic(matmul(triangle(:, [k, next, n + 1]), share))
      case (8)
         value = serendipity(straightened(square(:, [k, next, n + 1]), share, skew))
      case default
         value = share(3)*facet_split_centre(n)
         value(k) = value(k) + share(1)
         value(next) = value(next) + share(2)
      end select
   end function tie_shapes

   !> The natural coordinates p at which the bilinear map of a quadrilateral has a place, given in
   !> a triangle between natural coordinates `corner`: p + skew p1 p2 is what it is there.
   pure function straightened(corner, share, skew) result(place)
      real(wp), intent(in) :: corner(2, 3), share(3), skew(2)
      real(wp) :: place(2)
      real(wp) :: half

      place = matmul(corner, share) + skew*dot_product(corner(1, :)*corner(2, :), share)
      half = 0.5_wp*(1.0_wp + skew(1)*place(2) + skew(2)*place(1))
      place = place - skew*(product(place)/(half + sqrt(max(0.0_wp, half**2 &
         - product(skew)*product(place)))))
   end function straightened

   !> Of a triangle with nodes between its corners.
   pure function quadratic(place) result(value)
      real(wp), intent(in) :: place(2)           !! natural coordinates
      real(wp) :: value(6)
      real(wp) :: share(3)

      share = [1.0_wp - sum(place), place]
      value(1::2) = share*(2.0_wp*share - 1.0_wp)
      value(2::2) = 4.0_wp*share*cshift(share, 1)
   end function quadratic

   !> Of a quadrilateral with nodes between its corners.
   pure function serendipity(place) result(value)
      real(wp), intent(in) :: place(2)           !! natural coordinates
      real(wp) :: value(8)
      integer :: m

      do m = 1, 8
         associate (x => place(1)*square(1, m), y => place(2)*square(2, m))
            if (mod(m, 2) == 1) then
               value(m) = 0.25_wp*(1.0_wp + x)*(1.0_wp + y)*(x + y - 1.0_wp)
            else if (abs(square(1, m)) > 0.5_wp) then
               value(m) = 0.5_wp*(1.0_wp + x)*(1.0_wp - place(2)**2)
            else
               value(m) = 0.5_wp*(1.0_wp + y)*(1.0_wp - place(1)**2)
            end if
         end associate
      end do
   end function serendipity

end module emcon_tie_shapes_space
