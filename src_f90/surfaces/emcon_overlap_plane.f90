!> Is something behind an outline? Plain distances and crossings of edges, from positions alone.
!>
!> Edges run with the body to the left. Nothing here knows of gaps, stencils or constraints.
module emcon_overlap_plane
   use emcon_kinds, only : wp
   implicit none
   private
   public :: nearest_t, nearest_update, nearest_depth, crossing_find, length_of

   !> The nearest place of an outline to a point so far.
   type :: nearest_t
      integer :: edge = 0                        !! 0: none yet
      integer :: side = 0                        !! 0: inside, 1, 2: at its first, last node
      real(wp) :: square = huge(1.0_wp)          !! square of the distance [L^2]
      real(wp) :: to_point(2) = 0.0_wp           !! from the place to the point [L]
      real(wp) :: along(2) = 0.0_wp              !! from the first to the last node of the edge [L]
      real(wp) :: share = 0.0_wp                 !! of the edge before the place
   end type nearest_t

contains

   !> Is edge number `edge`, which runs by `along` from a node from which the point lies at
   !> `to_point`, nearer than the nearest one so far?
   pure subroutine nearest_update(self, edge, to_point, along)
      type(nearest_t), intent(inout) :: self
      integer, intent(in) :: edge                !! its number
      real(wp), intent(in) :: to_point(2), along(2)      !! [L]
      real(wp) :: share, offset(2), square
      integer :: side

      square = dot_product(along, along)
      if (.not. square > 0.0_wp) return
      share = dot_product(to_point, along)/square
      side = 0
      if (share <= 0.0_wp) then
         side = 1
         offset = to_point
      else if (share >= 1.0_wp) then
         side = 2
         offset = to_point - along
      else
         offset = to_point - share*along
      end if
      square = dot_product(offset, offset)
      if (.not. square < self%square) return
      self = nearest_t(edge, side, square, offset, along, max(0.0_wp, min(1.0_wp, share)))
   end subroutine nearest_update

   !> How deep the point is behind the nearest place, < 0 in front of it. At a node `along_next`
   !> is the way along the other edge there: the sum of both unit normals tells the sides apart.
   pure real(wp) function nearest_depth(self, along_next) result(depth)
      type(nearest_t), intent(in) :: self
      real(wp), intent(in) :: along_next(2)      !! [L] not used inside an edge
      real(wp) :: along(2), left

      along = self%along/length_of(self%along)
      left = along(1)*self%to_point(2) - along(2)*self%to_point(1)
      depth = left
      if (self%side == 0) return
      along = along + along_next/length_of(along_next)
      left = along(1)*self%to_point(2) - along(2)*self%to_point(1)
      depth = sign(sqrt(self%square), left)
   end function nearest_depth

   !> Do two edges cross, where along `a`, and does it go behind the other there? Ways from the
   !> first node of `a`: to its last node, and to the first and the last node of `b`.
   pure subroutine crossing_find(a, to_b, crosses, share, enters)
      real(wp), intent(in) :: a(2), to_b(2, 2)   !! [L]
      logical, intent(out) :: crosses            !! is there a common point inside both?
      real(wp), intent(out) :: share             !! of `a` before the crossing
      logical, intent(out) :: enters             !! `a` goes behind the line of `b`
      real(wp) :: b(2), side(4)

      b = to_b(:, 2) - to_b(:, 1)
      side = [cross(a, to_b(:, 1)), cross(a, to_b(:, 2)), cross(b, -to_b(:, 1)), &
         cross(b, a - to_b(:, 1))]
      crosses = is_between(side(1), side(2)) .and. is_between(side(3), side(4))
      share = 0.0_wp
      if (crosses) share = side(3)/(side(3) - side(4))
      enters = side(4) > 0.0_wp
   end subroutine crossing_find

   !> Is 0 between `a` and `b`? Signs are compared: a product of small numbers would vanish.
   pure logical function is_between(a, b)
      real(wp), intent(in) :: a, b

      is_between = (a > 0.0_wp .and. b < 0.0_wp) .or. (a < 0.0_wp .and. b > 0.0_wp)
   end function is_between

   !> Not norm2: its bits depend on the units.
   pure real(wp) function length_of(a)
      real(wp), intent(in) :: a(2)               !! any unit

      length_of = sqrt(dot_product(a, a))
   end function length_of

   pure real(wp) function cross(a, b)
      real(wp), intent(in) :: a(2), b(2)

      cross = a(1)*b(2) - a(2)*b(1)
   end function cross

end module emcon_overlap_plane
