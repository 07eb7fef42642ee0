!> What contact points of a surface have, told by its facets: forces are divided among the facets at
!> a node.
!>
!> Points are the nodes, then the virtual centres of facets with nodes between corners.
module emcon_facet_values
   use emcon_facets, only : facets_normal, facets_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: facets_point_area, facets_pressures, facets_share

   !> Facets of more nodes have some in the middle of their sides.
   integer, parameter :: most_simple = 4
   !> What of a uniform pressure on such a facet is on each of its corners. It may be anything that
   !> leaves pushes for the other points; with little a facet whose corners bear nothing is whole.
   real(wp), parameter :: at_vertex = 0.01_wp

contains

   !> The area at a point that faces along `normal`: as uniform pressure loads the points.
   pure real(wp) function facets_point_area(self, middle, i, normal, x, u) result(area)
      type(facets_t), intent(in) :: self         !! set up, in space
      integer, intent(in) :: middle(:)           !! facets with nodes between corners, ascending
      integer, intent(in) :: i                   !! point: a node, or behind them of `middle`
      real(wp), intent(in) :: normal(:)          !! (3) unit vector
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (3, n_node of the scene) [L]
      integer :: k

      if (i > size(self%node)) then
         area = faced(middle(i - size(self%node)))
         return
      end if
      area = 0.0_wp
      do k = self%around_start(i), self%around_start(i + 1) - 1
         area = area + faced(self%around(k))
      end do

   contains

      !> What of facet `f` is the point's.
      pure real(wp) function faced(f)
         integer, intent(in) :: f
         integer :: place

         place = 0
         if (i <= size(self%node)) place = findloc(nodes_of(self, f), i, 1)
         faced = part_of(count(self%facet(:, f) > 0), place)*max(0.0_wp, dot_product(normal, &
            facets_normal(self, f, x, u)))
      end function faced

   end function facets_point_area

   !> The part of a point in a facet of `n` nodes: the node at `place` in turn around it, those at
   !> odd places vertices; 0: its virtual centre. Its nodes get the loads of its element: the
   !> weights of the centre are -1/3 and 2/3 with six nodes, -1/2 and 3/4 with eight.
   pure real(wp) function part_of(n, place) result(part)
      integer, intent(in) :: n, place
      real(wp) :: centre

      if (n <= most_simple) then
         part = 1.0_wp/real(n, wp)
         return
      end if
      centre = merge(3.0_wp*at_vertex, 1.0_wp/6.0_wp + 2.0_wp*at_vertex, n == 6)
      if (place == 0) then
         part = centre
      else if (btest(place, 0)) then
         part = at_vertex
      else
         part = (1.0_wp - centre)/real(n/2, wp) - at_vertex
      end if
   end function part_of

   !> Pressures by forces on areas at points of a surface, of which a point may have several. On a
   !> facet with nodes between corners forces may be divided in more than one way: there facet by
   !> facet, and then the mean of the facets at a node; of several the first has it. Source:
   !> docs/theory.md, eq. (50).
   pure subroutine facets_pressures(self, middle, point, force, area, pressure)
      type(facets_t), intent(in) :: self         !! set up, in space
      integer, intent(in) :: middle(:)           !! facets with nodes between corners, ascending
      integer, intent(in) :: point(:)            !! (n) index of the point, ascending
      real(wp), intent(in) :: force(:)           !! (n) [M L/T^2]
      real(wp), intent(in) :: area(:)            !! (n) that uniform pressure acts on [L^2]
      real(wp), intent(out) :: pressure(:)       !! (n) 0 without area
      real(wp), dimension(size(self%node) + size(middle)) :: whole, mean, push, on
      logical :: is_of_quadratic(size(mean))
      integer :: centre(self%n_facet), f, i

      pressure = 0.0_wp
      where (area > 0.0_wp) pressure = force/area
      if (size(middle) == 0) return
      push = 0.0_wp
      on = 0.0_wp
      do i = 1, size(point)
         push(point(i)) = push(point(i)) + force(i)
         on(point(i)) = max(on(point(i)), area(i))
      end do
      whole = 0.0_wp
      do f = 1, self%n_facet
         whole(nodes_of(self, f)) = whole(nodes_of(self, f)) + self%size(f)
      end do
      is_of_quadratic = .false.
      mean = 0.0_wp
      centre = 0
      centre(middle) = [(size(self%node) + i, i = 1, size(middle))]
      do f = 1, self%n_facet
         associate (own => nodes_of(self, f), share => self%size(f)/whole(nodes_of(self, f)))
            if (centre(f) == 0) then
               call add_mean(own, share, mean)
            else
               is_of_quadratic([own, centre(f)]) = .true.
               call add_mean([own, centre(f)], [share, 1.0_wp], mean)
            end if
         end associate
      end do
      do i = 1, size(point)
         if (.not. is_of_quadratic(point(i))) cycle
         if (any(point(max(1, i - 1):i - 1) == point(i))) cycle
         ! With several, those of other sides keep theirs.
         if (.not. (any(point(i + 1:min(i + 1, size(point))) == point(i)) &
            .and. on(point(i)) > 0.0_wp)) pressure(i) = mean(point(i))
      end do

   contains

      !> Let the points of a facet have their shares of its mean pressure.
      pure subroutine add_mean(own, share, mean)
         integer, intent(in) :: own(:)
         real(wp), intent(in) :: share(:)
         real(wp), intent(inout) :: mean(:)

         if (sum(share*on(own)) > 0.0_wp) mean(own) = mean(own) &
            + share*(sum(share*push(own))/sum(share*on(own)))
      end subroutine add_mean

   end subroutine facets_pressures

   !> The nodes of facet `f`, in turn.
   pure function nodes_of(self, f) result(node)
      type(facets_t), intent(in) :: self
      integer, intent(in) :: f                   !! 1 to n_facet
      integer :: node(count(self%facet(:, f) > 0))

      node = self%corner(:size(node), f)
   end function nodes_of

   !> How the forces at nodes are divided among the facets there: by how much of its area each turns
   !> towards the force, so that of those that meet in a sharp edge the one that is pushed gets it.
   pure subroutine facets_share(facet, normal, force, share)
      integer, intent(in) :: facet(:, :)         !! (most, n_facet) nodes; 0: no more
      real(wp), intent(in) :: normal(:, :)       !! (n_dim, n_facet) as long as the areas [L^2]
      real(wp), intent(in) :: force(:, :)        !! (n_dim, n_node) [M L/T^2]
      real(wp), intent(out) :: share(:, :)       !! (most, n_facet) of the nodes; of sum 1 at each
      real(wp) :: mean(size(force, 1), size(force, 2))
      real(wp), dimension(size(force, 2)) :: whole, area
      integer :: f, k

      mean = 0.0_wp
      area = 0.0_wp
      do f = 1, size(facet, 2)
         do k = 1, count(facet(:, f) > 0)
            associate (node => facet(k, f))
               mean(:, node) = mean(:, node) + normal(:, f)
               area(node) = area(node) + length(normal(:, f))
            end associate
         end do
      end do
      share = 0.0_wp
      whole = 0.0_wp
      do f = 1, size(facet, 2)
         do k = 1, count(facet(:, f) > 0)
            associate (node => facet(k, f))
               share(k, f) = max(0.0_wp, dot_product(normal(:, f), force(:, node)) &
                  *sign(1.0_wp, dot_product(mean(:, node), force(:, node))))
               whole(node) = whole(node) + share(k, f)
            end associate
         end do
      end do
      do f = 1, size(facet, 2)
         do k = 1, count(facet(:, f) > 0)
            associate (node => facet(k, f))
               if (whole(node) > 0.0_wp) then
                  share(k, f) = share(k, f)/whole(node)
               else if (area(node) > 0.0_wp) then
                  share(k, f) = length(normal(:, f))/area(node)
               end if
            end associate
         end do
      end do
   end subroutine facets_share

   pure real(wp) function length(a)
      real(wp), intent(in) :: a(:)

      length = sqrt(dot_product(a, a))
   end function length

end module emcon_facet_values
