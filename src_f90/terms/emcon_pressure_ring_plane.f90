!> Pressure on the edges of a solid of revolution about the axis of y, and how its force turns with
!> the edge: on the whole circle.
!>
!> It acts on an edge from node a to node b, the body to its left, straight or through a node m
!> between them. Source: docs/theory.md, eq. (11f).
module emcon_pressure_ring_plane
   use emcon_kinds, only : dp, wp
   use emcon_turn_plane, only : turned_left
   implicit none
   private
   public :: press_ring, press_ring_stiffness, ring_area

   !> Points along an edge and their weights, exact to degree 5: an edge of three nodes has that.
   real(wp), parameter :: point(3) = [-sqrt(0.6_wp), 0.0_wp, sqrt(0.6_wp)]
   real(wp), parameter :: weight(3) = [5.0_wp, 8.0_wp, 5.0_wp]/9.0_wp
   real(wp), parameter :: two_pi = 8.0_wp*atan(1.0_wp)

contains

   !> int p N 2 pi r times the edge turned to the left.
   pure subroutine press_ring(edge, p, x, u, follows, force)
      integer, intent(in) :: edge(:)                       !! (2 or 3) a, b, m
      real(wp), intent(in) :: p                            !! [M/(L T^2)]
      real(wp), intent(in) :: x(:, :), u(:, :)             !! (2, n_node) [L]
      logical, intent(in) :: follows                       !! it follows the displacements
      real(wp), intent(inout) :: force(:, :)               !! (2, n_node) [M L/T^2]
      real(wp), dimension(size(edge)) :: value, slope
      real(wp) :: place(2, size(edge)), push(2)
      integer :: i, k

      call take_places(edge, x, u, follows, place)
      do k = 1, size(point)
         call edge_functions(point(k), value, slope)
         push = (p*two_pi*weight(k)*dot_product(place(1, :), value)) &
            *turned_left(matmul(place, slope))
         do i = 1, size(edge)
            force(:, edge(i)) = force(:, edge(i)) + value(i)*push
         end do
      end do
   end subroutine press_ring

   !> What the force changes by as the nodes move.
   pure subroutine press_ring_stiffness(edge, p, x, u, slot, value, side)
      integer, intent(in) :: edge(:)                       !! (2 or 3) a, b, m
      real(wp), intent(in) :: p                            !! [M/(L T^2)]
      real(wp), intent(in) :: x(:, :), u(:, :)             !! (2, n_node) [L]
      integer, intent(in) :: slot(:, :)                    !! (4, 4) or (6, 6) places of its entries
      real(dp), intent(inout) :: value(:), side(:)         !! slots > 0, slots < 0
      real(wp), dimension(size(edge)) :: shape, slope
      real(wp) :: place(2, size(edge)), along(2), change(2), radius, unit(2)
      integer :: a, b, i, j, k, to

      call take_places(edge, x, u, .true., place)
      do k = 1, size(point)
         call edge_functions(point(k), shape, slope)
         radius = dot_product(place(1, :), shape)
         along = turned_left(matmul(place, slope))
         do j = 1, size(edge)
            do b = 1, 2
               unit = 0.0_wp
               unit(b) = slope(j)
               change = radius*turned_left(unit)
               if (b == 1) change = change + shape(j)*along
               do i = 1, size(edge)
                  do a = 1, 2
                     to = slot(a + 2*(i - 1), b + 2*(j - 1))
                     associate (df => real(p*two_pi*weight(k)*shape(i)*change(a), dp))
                        if (to > 0) value(to) = value(to) - df
                        if (to < 0) side(-to) = side(-to) - df
                     end associate
                  end do
               end do
            end do
         end do
      end do
   end subroutine press_ring_stiffness

   !> The length of an edge, or the area that it sweeps around the axis, and its integrals of the
   !> place: of a circle its centre.
   pure subroutine ring_area(place, is_ring, size_of)
      real(wp), intent(in) :: place(:, :)                  !! (2, 2 or 3) of a, b, m [L]
      logical, intent(in) :: is_ring                       !! it goes around the axis
      real(wp), intent(out) :: size_of(:)                  !! (1 + 2) [L], [L^2]; of a ring times L
      real(wp), dimension(size(place, 2)) :: value, slope
      real(wp) :: at(2), length
      integer :: k

      size_of = 0.0_wp
      do k = 1, size(point)
         call edge_functions(point(k), value, slope)
         at = matmul(place, value)
         length = weight(k)*norm2(matmul(place, slope))
         if (is_ring) then
            length = length*two_pi*at(1)
            at(1) = 0.0_wp
         end if
         size_of = size_of + length*[1.0_wp, at]
      end do
   end subroutine ring_area

   pure subroutine take_places(edge, x, u, follows, place)
      integer, intent(in) :: edge(:)
      real(wp), intent(in) :: x(:, :), u(:, :)
      logical, intent(in) :: follows
      real(wp), intent(out) :: place(:, :)                 !! (2, size of edge) [L]

      place = x(:, edge)
      if (follows) place = place + u(:, edge)
   end subroutine take_places

   !> Shape functions of the edge -1..1 and their slopes.
   pure subroutine edge_functions(s, value, slope)
      real(wp), intent(in) :: s
      real(wp), intent(out) :: value(:), slope(:)          !! (2 or 3) of a, b, m

      value(:2) = 0.5_wp*[1.0_wp - s, 1.0_wp + s]
      slope(:2) = [-0.5_wp, 0.5_wp]
      if (size(value) == 2) return
      value(3) = (1.0_wp - s)*(1.0_wp + s)
      slope(3) = -2.0_wp*s
      value(:2) = value(:2) - 0.5_wp*value(3)
      slope(:2) = slope(:2) - 0.5_wp*slope(3)
   end subroutine edge_functions

end module emcon_pressure_ring_plane
