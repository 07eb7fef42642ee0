!> What nodes of a surface have, told by its facets: forces are divided among the facets at a node.
module emcon_facet_values
   use emcon_facets, only : facets_normal, facets_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: facets_pressed_areas, facets_pressures, facets_share

   !> Facets of more nodes have some in the middle of their sides.
   integer, parameter :: most_simple = 4

contains

   !> Uniform pressure on a facet with nodes between its corners presses on these alone (of eight
   !> nodes it pulls at the corners, which contact does not): they have all of its area.
   pure subroutine facets_pressed_areas(self, x, u, area)
      type(facets_t), intent(in) :: self         !! set up, in space
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (3, n_node of the scene) [L]
      real(wp), intent(inout) :: area(:)         !! (n_node) equal parts of facets at x + u [L^2]
      real(wp) :: normal(size(x, 1)), part
      integer :: node(size(self%facet, 1)), f, n

      if (size(self%facet, 1) <= most_simple) return
      do f = 1, self%n_facet
         n = count(self%facet(:, f) > 0)
         if (n <= most_simple) cycle
         normal = facets_normal(self, f, x, u)
         part = length(normal)/real(n, wp)
         node(:n) = nodes_of(self, f)
         area(node(1:n:2)) = area(node(1:n:2)) - part
         area(node(2:n:2)) = area(node(2:n:2)) + part
      end do
      ! Of corners that only such facets have nothing but round-off is left.
      where (area < sqrt(epsilon(area))*maxval(area)) area = 0.0_wp
   end subroutine facets_pressed_areas

   !> Pressures at the nodes of a surface by their forces and areas. Uniform pressure loads corners
   !> and nodes between them unlike: where there are such nodes, facet by facet and then the mean of
   !> the facets at a node.
   pure subroutine facets_pressures(self, force, area, pressure)
      type(facets_t), intent(in) :: self         !! set up, in space
      real(wp), intent(in) :: force(:)           !! (n_node) [M L/T^2]
      real(wp), intent(in) :: area(:)            !! (n_node) that uniform pressure acts on [L^2]
      real(wp), intent(out) :: pressure(:)       !! (n_node) 0 without area
      real(wp), dimension(size(force)) :: whole, mean
      logical :: is_of_quadratic(size(force))
      real(wp) :: push, on
      integer :: f, n

      pressure = 0.0_wp
      where (area > 0.0_wp) pressure = force/area
      if (size(self%facet, 1) <= most_simple) return
      whole = 0.0_wp
      is_of_quadratic = .false.
      do f = 1, self%n_facet
         n = count(self%facet(:, f) > 0)
         associate (node => nodes_of(self, f))
            whole(node) = whole(node) + self%size(f)
            if (n > most_simple) is_of_quadratic(node) = .true.
         end associate
      end do
      mean = 0.0_wp
      do f = 1, self%n_facet
         n = count(self%facet(:, f) > 0)
         associate (node => nodes_of(self, f), share => self%size(f)/whole(nodes_of(self, f)))
            push = sum(share*force(node))
            on = sum(share*area(node))
            if (on > 0.0_wp) mean(node) = mean(node) + share*(push/on)
         end associate
      end do
      where (is_of_quadratic) pressure = mean
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
