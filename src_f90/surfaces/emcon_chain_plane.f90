!> A contact surface in the plane as a chain of edges.
!>
!> Edges run as in their elements, the body to the left, so the outward normal of an edge from a
!> to b is (b - a) turned by -90 degrees. A surface may consist of several connected parts.
module emcon_chain_plane
   use emcon_box_tree, only : box_tree_find, box_tree_init, box_tree_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_facets, only : facets_init, facets_join_nodes, facets_number, facets_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_search, only : search_boxes
   use emcon_text, only : to_text
   use emcon_vectors_plane, only : between, cross
   implicit none
   private
   public :: chain_t, chain_init, chain_number, chain_shorter, chain_shortest, chain_thickness, &
      chain_tributary, chain_share, chain_distance, chain_is_seam, chain_touches, chain_corners, &
      chain_crossing, previous, next

   !> The sides of an edge, for `neighbour`.
   integer, parameter :: previous = 1, next = 2

   !> Facets are edges from their first to their last node; beyond their sides are the edges before
   !> and after. Of a joint one node stands for both, and `corner` has it for either.
   type, extends(facets_t) :: chain_t
      integer, allocatable :: duplicate(:)       !! (n_node) the other node of a joint; 0: none
      integer, allocatable :: node_edge(:, :)    !! (2, n_node) edges that end and begin there or 0
      integer, allocatable :: place(:)           !! (n_facet) 1..n_facet along each part in turn
      integer, allocatable :: start(:)           !! (n_part + 1) place where each part begins
      logical, allocatable :: is_closed(:)       !! (n_part) a closed one begins at its lowest edge
   end type chain_t

   !> So far from each other, per length of the shorter edge, edges touch; and so far from parallel
   !> (sine), they run alongside. Far above the rounding of coordinates in a deck.
   real(wp), parameter :: touch_tol = 1.0e-3_wp
   !> What a turn has to exceed an angle by [degrees], for the same reason.
   real(wp), parameter :: turn_tol = 1.0e-3_wp
   real(wp), parameter :: pi = acos(-1.0_wp)

contains

   !> The chain of the faces of `surface`; a nodal surface gives nodes without edges.
   subroutine chain_init(self, scene, surface, error)
      type(chain_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      type(error_t), allocatable, intent(out) :: error

      if (size(scene%x, 1) /= 2) then
         call raise(error, err_input, "surface " // surface%name // ": chains of edges are of " // &
            "the plane, and nodes have " // to_text(size(scene%x, 1)) // " coordinates")
         return
      end if
      call facets_init(self%facets_t, scene, surface, error)
      if (allocated(error)) return
      allocate(self%duplicate(size(self%node)), source=0)
      call chain_number(self)
   end subroutine chain_init

   !> Length of the shortest edge at node `i` of the chain; of a node without edges huge.
   pure real(wp) function chain_shortest(self, i) result(shortest)
      type(chain_t), intent(in) :: self
      integer, intent(in) :: i                   !! index into `node`
      integer :: k

      shortest = huge(shortest)
      if (self%n_facet == 0) return
      do k = 1, 2
         associate (e => self%node_edge(k, i))
            if (e > 0) shortest = min(shortest, self%size(e))
         end associate
      end do
   end function chain_shortest

   !> Number the parts, in the order of their lowest edges, and the places along them; the edges at
   !> each node. After the edges at joints have become neighbours once more.
   pure subroutine chain_number(self)
      type(chain_t), intent(inout) :: self
      integer :: i, e, first, p, n

      call facets_join_nodes(self)
      call facets_number(self)
      if (allocated(self%place)) deallocate(self%node_edge, self%place, self%start, self%is_closed)
      allocate(self%node_edge(2, size(self%node)), source=0)
      allocate(self%place(self%n_facet), source=0)
      do e = 1, self%n_facet
         self%node_edge(2, self%corner(1, e)) = e
         self%node_edge(1, self%corner(2, e)) = e
      end do
      associate (n_part => maxval([0, self%part]))
         allocate(self%start(n_part + 1), source=1)
         allocate(self%is_closed(n_part), source=.false.)
      end associate
      p = 0
      n = 0
      do i = 1, self%n_facet
         if (self%part(i) <= p) cycle
         p = p + 1
         first = i
         e = self%neighbour(previous, i)
         do while (e /= 0 .and. e /= i)
            first = e
            e = self%neighbour(previous, e)
         end do
         self%is_closed(p) = e == i
         if (self%is_closed(p)) first = i
         e = first
         do
            n = n + 1
            self%place(e) = n
            e = self%neighbour(next, e)
            if (e == 0 .or. e == first) exit
         end do
         self%start(p + 1) = n + 1
      end do
   end subroutine chain_number

   !> Steps along the chain from edge `a` to edge `b`, the shorter way around a closed part;
   !> huge(1) if they are in different parts.
   pure integer function chain_distance(self, a, b)
      type(chain_t), intent(in) :: self
      integer, intent(in) :: a, b                !! edges, 1 to n_facet

      chain_distance = huge(1)
      associate (p => self%part(a))
         if (self%part(b) /= p) return
         chain_distance = abs(self%place(a) - self%place(b))
         if (self%is_closed(p)) then
            chain_distance = min(chain_distance, &
               self%start(p + 1) - self%start(p) - chain_distance)
         end if
      end associate
   end function chain_distance

   !> Do edges `a` and `b` follow each other over a joint, whose nodes may be a little apart?
   pure logical function chain_is_seam(self, a, b) result(is_seam)
      type(chain_t), intent(in) :: self
      integer, intent(in) :: a, b                !! edges, 1 to n_facet

      is_seam = .false.
      if (self%neighbour(next, a) == b) is_seam = self%facet(2, a) /= self%facet(1, b)
      if (self%neighbour(next, b) == a .and. .not. is_seam) is_seam &
         = self%facet(2, b) /= self%facet(1, a)
   end function chain_is_seam

   !> Does edge `e` end or begin at `node`, or at a joint with it?
   pure logical function chain_touches(self, e, node) result(touches)
      type(chain_t), intent(in) :: self
      integer, intent(in) :: e                   !! edge, 1 to n_facet
      integer, intent(in) :: node                !! of the scene

      touches = any(self%node(self%corner(:, e)) == node) &
         .or. any(self%duplicate(self%corner(:, e)) == node)
   end function chain_touches

   !> Thickness of the section at each node of the chain, 1 where there is none or no element.
   !> Between two sections that of the edge that begins at the node.
   pure subroutine chain_thickness(self, scene, thickness)
      type(chain_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      real(wp), allocatable, intent(out) :: thickness(:)   !! (size of `node`) [L]
      integer :: i, side

      allocate(thickness(size(self%node)), source=1.0_wp)
      do i = 1, size(self%node)
         do side = 1, 2
            associate (e => self%node_edge(side, i))
               if (e == 0) cycle
               if (self%element(e) == 0) cycle
               thickness(i) = scene%section(scene%element%section(self%element(e)))%thickness
            end associate
         end do
      end do
   end subroutine chain_thickness

   !> Length that belongs to each node of the chain: half of the edges beside it, at x + u.
   pure subroutine chain_tributary(self, x, u, length)
      type(chain_t), intent(in) :: self
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (2, n_node of the scene)
      real(wp), intent(out) :: length(:)         !! (size of `node`)
      real(wp) :: a(2)
      integer :: k, j, e

      do k = 1, size(self%node)
         length(k) = 0.0_wp
         do j = 1, 2
            e = self%node_edge(j, k)
            if (e == 0) cycle
            a = between(x, u, self%facet(1, e), self%facet(2, e))
            length(k) = length(k) + 0.5_wp*sqrt(dot_product(a, a))
         end do
      end do
   end subroutine chain_tributary

   !> The same of node `k` in the reference.
   pure real(wp) function chain_share(self, k) result(length)
      type(chain_t), intent(in) :: self
      integer, intent(in) :: k                   !! index into `node`
      integer :: j

      length = 0.0_wp
      do j = 1, 2
         if (self%node_edge(j, k) > 0) length = length + 0.5_wp*self%size(self%node_edge(j, k))
      end do
   end function chain_share

   !> At either end of edge `e` the shorter one of the two edges there, in the reference.
   pure function chain_shorter(self, e) result(length)
      type(chain_t), intent(in) :: self
      integer, intent(in) :: e                   !! edge, 1 to n_facet
      real(wp) :: length(2)
      integer :: side

      length = self%size(e)
      associate (beside => self%neighbour(:, e))
         do side = 1, 2
            if (beside(side) > 0) length(side) = min(length(side), self%size(beside(side)))
         end do
      end associate
   end function chain_shorter

   !> Where does the chain turn by more than `angle` in the reference configuration? A corner
   !> stands at the first node of its edge; an edge without a previous one has one too.
   pure subroutine chain_corners(self, x, angle, is_corner)
      type(chain_t), intent(in) :: self
      real(wp), intent(in) :: x(:, :)            !! (2, n_node of the scene)
      real(wp), intent(in) :: angle              !! [degrees], 0..180
      logical, intent(out) :: is_corner(:)       !! (n_facet)
      real(wp) :: a(2), b(2), turn
      integer :: i

      do i = 1, self%n_facet
         is_corner(i) = self%neighbour(previous, i) == 0
         if (is_corner(i)) cycle
         associate (before => self%facet(:, self%neighbour(previous, i)), here => self%facet(:, i))
            a = x(:, before(2)) - x(:, before(1))
            b = x(:, here(2)) - x(:, here(1))
         end associate
         turn = (180.0_wp/pi)*atan2(abs(cross(a, b)), dot_product(a, b))
         is_corner(i) = turn > angle + turn_tol
      end do
   end subroutine chain_corners

   !> The first two edges, not neighbours, in which the chain crosses itself at x + u; 0, 0 if it
   !> does nowhere. Where it only touches itself or runs alongside, it does not cross.
   pure subroutine chain_crossing(self, x, u, first, second)
      type(chain_t), intent(in) :: self
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (2, n_node of the scene)
      integer, intent(out) :: first, second      !! first < second
      type(box_tree_t) :: tree
      real(wp), allocatable :: box(:, :, :)
      real(wp) :: length(0:self%n_facet), reach
      integer, allocatable :: found(:)
      integer :: i, k, n

      call search_boxes(x, u, self%facet, box)
      allocate(found(0))
      length(0) = 0.0_wp
      do i = 1, self%n_facet
         associate (vector => (x(:, self%facet(2, i)) + u(:, self%facet(2, i))) &
               - (x(:, self%facet(1, i)) + u(:, self%facet(1, i))))
            length(i) = norm2(vector)
         end associate
      end do
      call box_tree_init(tree, box(:, :, 1), box(:, :, 2))
      do first = 1, self%n_facet
         reach = touch_tol*max(length(first), length(self%neighbour(previous, first)), &
            length(self%neighbour(next, first)))
         n = 0
         call box_tree_find(tree, box(:, first, 1), box(:, first, 2), reach, found, n)
         do k = 1, n
            second = found(k)
            if (second <= first) cycle
            if (any(self%neighbour(:, first) == second)) cycle
            if (is_crossing(self, x, u, first, second)) return
         end do
      end do
      first = 0
      second = 0
   end subroutine chain_crossing

   !> Do edges `i` and `j` cross each other between their ends, or the chain at the end of one?
   pure logical function is_crossing(self, x, u, i, j)
      type(chain_t), intent(in) :: self
      real(wp), intent(in) :: x(:, :), u(:, :)
      integer, intent(in) :: i, j
      real(wp) :: a(2), b(2), length_a, length_b, side(4)

      associate (p => self%facet(:, i), q => self%facet(:, j))
         a = between(x, u, p(1), p(2))
         b = between(x, u, q(1), q(2))
         length_a = norm2(a)
         length_b = norm2(b)
         is_crossing = .false.
         if (.not. min(length_a, length_b) > 0.0_wp) return
         side(1) = cross(a, between(x, u, p(1), q(1)))/length_a
         side(2) = cross(a, between(x, u, p(1), q(2)))/length_a
         side(3) = cross(b, between(x, u, q(1), p(1)))/length_b
         side(4) = cross(b, between(x, u, q(1), p(2)))/length_b
      end associate
      is_crossing = all(abs(side) > touch_tol*min(length_a, length_b)) &
         .and. ((side(1) > 0.0_wp) .neqv. (side(2) > 0.0_wp)) &
         .and. ((side(3) > 0.0_wp) .neqv. (side(4) > 0.0_wp))
      if (.not. is_crossing) is_crossing = passes_at_node(self, x, u, i, j)
      if (.not. is_crossing) is_crossing = passes_at_node(self, x, u, j, i)
   end function is_crossing

   !> Does the last node of edge `e` lie on edge `f`, and does the chain pass from one side of `f`
   !> to the other there? If that is at an end of `f`, the edge beyond it bounds the sides.
   pure logical function passes_at_node(self, x, u, e, f)
      type(chain_t), intent(in) :: self
      real(wp), intent(in) :: x(:, :), u(:, :)
      integer, intent(in) :: e, f
      real(wp) :: e_arm(2, 2), f_arm(2, 2), b(2), length, along, near
      integer :: q

      passes_at_node = .false.
      if (self%neighbour(next, e) == 0) return
      q = self%facet(2, e)
      e_arm(:, 1) = between(x, u, q, self%facet(1, e))
      e_arm(:, 2) = between(x, u, q, self%facet(2, self%neighbour(next, e)))
      f_arm(:, 1) = between(x, u, q, self%facet(1, f))
      f_arm(:, 2) = between(x, u, q, self%facet(2, f))
      b = between(x, u, self%facet(1, f), self%facet(2, f))
      length = norm2(b)
      near = touch_tol*min(length, max(norm2(e_arm(:, 1)), norm2(e_arm(:, 2))))
      along = -dot_product(b, f_arm(:, 1))/length
      if (abs(cross(b, f_arm(:, 1)))/length > near) return
      if (along < -near .or. along > length + near) return
      if (along <= near) then
         if (self%neighbour(previous, f) == 0) return
         f_arm(:, 1) = between(x, u, q, self%facet(1, self%neighbour(previous, f)))
      end if
      if (along >= length - near) then
         if (self%neighbour(next, f) == 0) return
         f_arm(:, 2) = between(x, u, q, self%facet(2, self%neighbour(next, f)))
      end if
      passes_at_node = is_between(f_arm(:, 1), e_arm) .neqv. is_between(f_arm(:, 2), e_arm)
      if (runs_along(e_arm(:, 1), f_arm) .or. runs_along(e_arm(:, 2), f_arm)) then
         passes_at_node = .false.
      end if
   end function passes_at_node

   !> Is the direction `a` met on the way counter-clockwise from the first of `arm` to the second?
   pure logical function is_between(a, arm)
      real(wp), intent(in) :: a(2), arm(2, 2)

      is_between = ahead(arm(:, 1), a) < ahead(arm(:, 1), arm(:, 2))
   end function is_between

   !> Angle counter-clockwise from `a` to `b`, in 0..2 pi.
   pure real(wp) function ahead(a, b)
      real(wp), intent(in) :: a(2), b(2)

      ahead = atan2(cross(a, b), dot_product(a, b))
      if (ahead < 0.0_wp) ahead = ahead + 2.0_wp*pi
   end function ahead

   !> Has `a` the direction of one of `arm`, or no length?
   pure logical function runs_along(a, arm)
      real(wp), intent(in) :: a(2), arm(2, 2)
      integer :: k

      runs_along = .false.
      do k = 1, 2
         if (dot_product(a, arm(:, k)) < 0.0_wp) cycle
         if (abs(cross(a, arm(:, k))) <= touch_tol*norm2(a)*norm2(arm(:, k))) runs_along = .true.
      end do
   end function runs_along

end module emcon_chain_plane
