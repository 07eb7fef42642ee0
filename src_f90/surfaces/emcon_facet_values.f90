!> What nodes of a surface have, told by its facets: forces are divided among the facets at a node.
module emcon_facet_values
   use emcon_facets, only : facets_normal, facets_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: facets_faced_area, facets_pressed_area, facets_pressures, facets_share

   !> Facets of more nodes have some in the middle of their sides.
   integer, parameter :: most_simple = 4

contains

   !> The area at a node that faces along `normal`: facets are shared by their nodes alike.
   pure real(wp) function facets_faced_area(self, i, normal, x, u) result(area)
      type(facets_t), intent(in) :: self         !! set up, in space
      integer, intent(in) :: i                   !! index into the nodes
      real(wp), intent(in) :: normal(:)          !! (3) unit vector
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (3, n_node of the scene) [L]
      integer :: k

      area = 0.0_wp
      do k = self%around_start(i), self%around_start(i + 1) - 1
         associate (f => self%around(k))
            area = area + max(0.0_wp, dot_product(normal, facets_normal(self, f, x, u))) &
               /real(count(self%facet(:, f) > 0), wp)
         end associate
      end do
   end function facets_faced_area

   !> The area at a node on which uniform pressure along `normal` presses. On a facet with nodes
   !> between its corners it presses on these alone (of eight nodes it pulls at the corners, which
   !> contact does not).
   pure real(wp) function facets_pressed_area(self, i, normal, x, u) result(area)
      type(facets_t), intent(in) :: self         !! set up, in space
      integer, intent(in) :: i                   !! index into the nodes
      real(wp), intent(in) :: normal(:)          !! (3) unit vector
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (3, n_node of the scene) [L]
      real(wp) :: part
      integer :: k, n

      area = 0.0_wp
      do k = self%around_start(i), self%around_start(i + 1) - 1
         associate (f => self%around(k))
            n = count(self%facet(:, f) > 0)
            part = 1.0_wp/real(n, wp)
            ! In turn around it, every other node is a corner, the first one is.
            if (n > most_simple) part = 2.0_wp*part*real(mod(findloc(nodes_of(self, f), i, 1) &
               - 1, 2), wp)
            area = area + part*max(0.0_wp, dot_product(normal, facets_normal(self, f, x, u)))
         end associate
      end do
   end function facets_pressed_area

   !> Pressures by forces on areas at nodes of a surface, of which a node may have several. Uniform
   !> pressure loads corners and nodes between them unlike: where there are such nodes, facet by
   !> facet and then the mean of the facets at a node; of several the first has it. Source:
   !> docs/theory.md, eq. (50).
   pure subroutine facets_pressures(self, node, force, area, pressure)
      type(facets_t), intent(in) :: self         !! set up, in space
      integer, intent(in) :: node(:)             !! (n) index of the node, ascending
      real(wp), intent(in) :: force(:)           !! (n) [M L/T^2]
      real(wp), intent(in) :: area(:)            !! (n) that uniform pressure acts on [L^2]
      real(wp), intent(out) :: pressure(:)       !! (n) 0 without area
      real(wp), dimension(size(self%node)) :: whole, mean, push_there, on_there
      logical :: is_of_quadratic(size(self%node))
      real(wp) :: push, on
      integer :: f, i

      pressure = 0.0_wp
      where (area > 0.0_wp) pressure = force/area
      if (size(self%facet, 1) <= most_simple) return
      push_there = 0.0_wp
      on_there = 0.0_wp
      do i = 1, size(node)
         push_there(node(i)) = push_there(node(i)) + force(i)
         on_there(node(i)) = max(on_there(node(i)), area(i))
      end do
      whole = 0.0_wp
      is_of_quadratic = .false.
      do f = 1, self%n_facet
         associate (own => nodes_of(self, f))
            whole(own) = whole(own) + self%size(f)
            if (size(own) > most_simple) is_of_quadratic(own) = .true.
         end associate
      end do
      mean = 0.0_wp
      do f = 1, self%n_facet
         associate (own => nodes_of(self, f), share => self%size(f)/whole(nodes_of(self, f)))
            push = sum(share*push_there(own))
            on = sum(share*on_there(own))
            if (on > 0.0_wp) mean(own) = mean(own) + share*(push/on)
         end associate
      end do
      do i = 1, size(node)
         if (.not. is_of_quadratic(node(i))) cycle
         if (any(node(max(1, i - 1):i - 1) == node(i))) cycle
         ! With several, those of other sides keep theirs.
         if (any(node(i + 1:min(i + 1, size(node))) == node(i)) .and. on_there(node(i)) > 0.0_wp) &
            cycle
         pressure(i) = mean(node(i))
      end do
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
