!> Shape functions of facets at places in the triangles that they are split into.
!>
!> Facets of three and four nodes are linear in each triangle, the centre taken with its weights.
!> Those with nodes between their corners have the shape functions of their elements, at natural
!> coordinates that are linear in each triangle: exact on straight triangles and parallelograms.
!> Source: docs/theory.md, section 11.10.
module emcon_tie_shapes_space
   use emcon_facet_split, only : facet_split_centre
   use emcon_kinds, only : wp
   implicit none
   private
   public :: tie_shapes, most_nodes

   !> Nodes of a facet, at most.
   integer, parameter :: most_nodes = 8
   !> Natural coordinates of nodes in turn around a facet, and of its centre.
   real(wp), parameter :: third = 1.0_wp/3.0_wp
   real(wp), parameter :: triangle(2, 7) = reshape([0.0_wp, 0.0_wp, 0.5_wp, 0.0_wp, 1.0_wp, &
      0.0_wp, 0.5_wp, 0.5_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.5_wp, third, third], [2, 7])
   real(wp), parameter :: square(2, 9) = reshape([-1.0_wp, -1.0_wp, 0.0_wp, -1.0_wp, 1.0_wp, &
      -1.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, -1.0_wp, 1.0_wp, -1.0_wp, 0.0_wp, &
      0.0_wp, 0.0_wp], [2, 9])

contains

   !> Values of the shape functions of a facet of `n` nodes at a place of triangle `k` of its split.
   pure function tie_shapes(n, k, share) result(value)
      integer, intent(in) :: n                   !! 3, 4, 6 or 8
      integer, intent(in) :: k                   !! 1 to the number of triangles
      real(wp), intent(in) :: share(3)           !! barycentric coordinates of the place
      real(wp) :: value(n)
      integer :: next

      next = 1 + mod(k, n)
      select case (n)
      case (3)
         value = share
      case (6)
         value = quadratic(matmul(triangle(:, [k, next, n + 1]), share))
      case (8)
         value = serendipity(matmul(square(:, [k, next, n + 1]), share))
      case default
         value = share(3)*facet_split_centre(n)
         value(k) = value(k) + share(1)
         value(next) = value(next) + share(2)
      end select
   end function tie_shapes

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
