!> A contact surface in the plane as a chain of edges.
!>
!> Edges run as in their elements, the body to the left, so the outward normal of an edge from a
!> to b is (b - a) turned by -90 degrees. A surface may consist of several connected parts.
module emcon_chain
   use emcon_box_tree, only : box_tree_find, box_tree_init, box_tree_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t, where_text
   use emcon_sort, only : find_sorted, unique_sorted
   use emcon_surface_edges, only : faces_of_edges, surface_edges
   use emcon_text, only : to_text
   implicit none
   private
   public :: chain_t, chain_init, chain_number, chain_shorter, chain_shortest, chain_thickness, &
      chain_tributary, chain_distance, chain_is_seam, chain_touches, chain_corners, &
      chain_crossing, surface_edges

   type :: chain_t
      integer :: n_edge = 0
      integer, allocatable :: edge(:, :)         !! (2, n_edge) first and last node
      integer, allocatable :: previous(:)        !! (n_edge) edge before; 0: an end
      integer, allocatable :: next(:)            !! (n_edge) edge after
      real(wp), allocatable :: length(:)         !! (n_edge) in the reference configuration [L]
      integer, allocatable :: node(:)            !! (n_node) ascending; of a joint one node only
      integer, allocatable :: duplicate(:)       !! (n_node) the other node of a joint; 0: none
      integer, allocatable :: end_node(:, :)     !! (2, n_edge) the ends as indices into `node`
      integer, allocatable :: node_edge(:, :)    !! (2, n_node) edges that end and begin there or 0
      integer, allocatable :: part(:)            !! (n_edge) connected part the edge belongs to
      integer, allocatable :: place(:)           !! (n_edge) 1..n_edge along each part in turn
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
      integer :: i

      if (size(scene%x, 1) /= 2) then
         call raise(error, err_input, "surface " // surface%name // ": chains of edges are of " // &
            "the plane, and nodes have " // to_text(size(scene%x, 1)) // " coordinates")
         return
      end if
      call surface_edges(scene, surface, self%edge)
      self%n_edge = size(self%edge, 2)
      if (surface%is_nodal) then
         self%node = unique_sorted(surface%node)
      else
         self%node = unique_sorted(reshape(self%edge, [2*self%n_edge]))
      end if
      allocate(self%length(self%n_edge))
      do i = 1, self%n_edge
         associate (a => scene%x(:, self%edge(2, i)) - scene%x(:, self%edge(1, i)))
            self%length(i) = sqrt(dot_product(a, a))   ! not norm2: its bits depend on the units
         end associate
      end do
      call link_edges(self, scene, surface, error)
      if (allocated(error)) return
      call chain_number(self)
   end subroutine chain_init

   !> Length of the shortest edge at node `i` of the chain; of a node without edges huge.
   pure real(wp) function chain_shortest(self, i) result(shortest)
      type(chain_t), intent(in) :: self
      integer, intent(in) :: i                   !! index into `node`
      integer :: k

      shortest = huge(shortest)
      if (self%n_edge == 0) return
      do k = 1, 2
         associate (e => self%node_edge(k, i))
            if (e > 0) shortest = min(shortest, self%length(e))
         end associate
      end do
   end function chain_shortest

   !> Find the neighbours of each edge.
   subroutine link_edges(self, scene, surface, error)
      type(chain_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      type(error_t), allocatable, intent(out) :: error
      integer :: i, k, end_node

      allocate(self%previous(self%n_edge), source=0)
      allocate(self%next(self%n_edge), source=0)
      allocate(self%node_edge(2, size(self%node)), source=0)
      allocate(self%duplicate(size(self%node)), source=0)
      allocate(self%end_node(2, self%n_edge))
      do i = 1, self%n_edge
         k = find_sorted(self%node, self%edge(1, i))
         end_node = find_sorted(self%node, self%edge(2, i))
         self%end_node(:, i) = [k, end_node]
         if (self%node_edge(2, k) > 0 .or. self%node_edge(1, end_node) > 0) then
            if (self%node_edge(2, k) == 0) k = end_node
            call raise(error, err_input, where_text(scene, surface%origin) // ": surface " // &
               surface%name // " is not a chain: it branches at node " // &
               to_text(scene%node%label(self%node(k))))
            return
         end if
         self%node_edge(2, k) = i
         self%node_edge(1, end_node) = i
      end do
      do k = 1, size(self%node)
         if (any(self%node_edge(:, k) == 0)) cycle
         self%next(self%node_edge(1, k)) = self%node_edge(2, k)
         self%previous(self%node_edge(2, k)) = self%node_edge(1, k)
      end do
   end subroutine link_edges

   !> Number the parts, in the order of their lowest edges, and the places along them.
   pure subroutine chain_number(self)
      type(chain_t), intent(inout) :: self
      integer :: i, e, first, n_part, n
      integer :: start(self%n_edge + 1)
      logical :: is_closed(self%n_edge)

      if (allocated(self%part)) deallocate(self%part, self%place, self%start, self%is_closed)
      allocate(self%part(self%n_edge), source=0)
      allocate(self%place(self%n_edge), source=0)
      start(1) = 1
      n_part = 0
      n = 0
      do i = 1, self%n_edge
         if (self%part(i) > 0) cycle
         n_part = n_part + 1
         first = i
         e = self%previous(i)
         do while (e /= 0 .and. e /= i)
            first = e
            e = self%previous(e)
         end do
         is_closed(n_part) = e == i
         if (is_closed(n_part)) first = i
         e = first
         do
            n = n + 1
            self%part(e) = n_part
            self%place(e) = n
            e = self%next(e)
            if (e == 0 .or. e == first) exit
         end do
         start(n_part + 1) = n + 1
      end do
      allocate(self%start(n_part + 1), source=start(:n_part + 1))
      allocate(self%is_closed(n_part), source=is_closed(:n_part))
   end subroutine chain_number

   !> Steps along the chain from edge `a` to edge `b`, the shorter way around a closed part;
   !> huge(1) if they are in different parts.
   pure integer function chain_distance(self, a, b)
      type(chain_t), intent(in) :: self
      integer, intent(in) :: a, b                !! edges, 1 to n_edge

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
      integer, intent(in) :: a, b                !! edges, 1 to n_edge

      is_seam = .false.
      if (self%next(a) == b) is_seam = self%edge(2, a) /= self%edge(1, b)
      if (self%next(b) == a .and. .not. is_seam) is_seam = self%edge(2, b) /= self%edge(1, a)
   end function chain_is_seam

   !> Does edge `e` end or begin at `node`, or at a joint with it?
   pure logical function chain_touches(self, e, node) result(touches)
      type(chain_t), intent(in) :: self
      integer, intent(in) :: e                   !! edge, 1 to n_edge
      integer, intent(in) :: node                !! of the scene

      touches = any(self%node(self%end_node(:, e)) == node) &
         .or. any(self%duplicate(self%end_node(:, e)) == node)
   end function chain_touches

   !> Thickness of the section at each node of the chain of `surface`, 1 where there is none or no
   !> element. Between two sections that of the edge that begins at the node.
   pure subroutine chain_thickness(self, scene, surface, thickness)
      type(chain_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      real(wp), allocatable, intent(out) :: thickness(:)   !! (size of `node`) [L]
      integer, allocatable :: face(:)
      integer :: i, side

      allocate(thickness(size(self%node)), source=1.0_wp)
      if (allocated(surface%edge) .or. surface%is_nodal) return
      call faces_of_edges(scene, surface, face)
      do i = 1, size(self%node)
         do side = 1, 2
            associate (e => self%node_edge(side, i))
               if (e == 0) cycle
               thickness(i) = scene%section(scene%element%section( &
                  surface%element(face(e))))%thickness
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
            a = from_to(x, u, self%edge(1, e), self%edge(2, e))
            length(k) = length(k) + 0.5_wp*sqrt(dot_product(a, a))
         end do
      end do
   end subroutine chain_tributary

   !> At either end of edge `e` the shorter one of the two edges there, in the reference.
   pure function chain_shorter(self, e) result(length)
      type(chain_t), intent(in) :: self
      integer, intent(in) :: e                   !! edge, 1 to n_edge
      real(wp) :: length(2)
      integer :: side

      length = self%length(e)
      associate (beside => [self%previous(e), self%next(e)])
         do side = 1, 2
            if (beside(side) > 0) length(side) = min(length(side), self%length(beside(side)))
         end do
      end associate
   end function chain_shorter

   !> Where does the chain turn by more than `angle` in the reference configuration? A corner
   !> stands at the first node of its edge; an edge without a previous one has one too.
   pure subroutine chain_corners(self, x, angle, is_corner)
      type(chain_t), intent(in) :: self
      real(wp), intent(in) :: x(:, :)            !! (2, n_node of the scene)
      real(wp), intent(in) :: angle              !! [degrees], 0..180
      logical, intent(out) :: is_corner(:)       !! (n_edge)
      real(wp) :: a(2), b(2), turn
      integer :: i

      do i = 1, self%n_edge
         is_corner(i) = self%previous(i) == 0
         if (is_corner(i)) cycle
         associate (before => self%edge(:, self%previous(i)), here => self%edge(:, i))
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
      real(wp), allocatable :: low(:, :), high(:, :), length(:)
      integer, allocatable :: found(:)
      real(wp) :: ends(2, 2), reach
      integer :: i, k, n

      allocate(low(2, self%n_edge), high(2, self%n_edge), length(0:self%n_edge), found(0))
      length(0) = 0.0_wp
      do i = 1, self%n_edge
         ends = x(:, self%edge(:, i)) + u(:, self%edge(:, i))
         low(:, i) = minval(ends, dim=2)
         high(:, i) = maxval(ends, dim=2)
         length(i) = norm2(ends(:, 2) - ends(:, 1))
      end do
      call box_tree_init(tree, low, high)
      do first = 1, self%n_edge
         reach = touch_tol*max(length(first), length(self%previous(first)), &
            length(self%next(first)))
         n = 0
         call box_tree_find(tree, low(:, first), high(:, first), reach, found, n)
         do k = 1, n
            second = found(k)
            if (second <= first) cycle
            if (second == self%previous(first) .or. second == self%next(first)) cycle
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

      associate (p => self%edge(:, i), q => self%edge(:, j))
         a = from_to(x, u, p(1), p(2))
         b = from_to(x, u, q(1), q(2))
         length_a = norm2(a)
         length_b = norm2(b)
         is_crossing = .false.
         if (.not. min(length_a, length_b) > 0.0_wp) return
         side(1) = cross(a, from_to(x, u, p(1), q(1)))/length_a
         side(2) = cross(a, from_to(x, u, p(1), q(2)))/length_a
         side(3) = cross(b, from_to(x, u, q(1), p(1)))/length_b
         side(4) = cross(b, from_to(x, u, q(1), p(2)))/length_b
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
      if (self%next(e) == 0) return
      q = self%edge(2, e)
      e_arm(:, 1) = from_to(x, u, q, self%edge(1, e))
      e_arm(:, 2) = from_to(x, u, q, self%edge(2, self%next(e)))
      f_arm(:, 1) = from_to(x, u, q, self%edge(1, f))
      f_arm(:, 2) = from_to(x, u, q, self%edge(2, f))
      b = from_to(x, u, self%edge(1, f), self%edge(2, f))
      length = norm2(b)
      near = touch_tol*min(length, max(norm2(e_arm(:, 1)), norm2(e_arm(:, 2))))
      along = -dot_product(b, f_arm(:, 1))/length
      if (abs(cross(b, f_arm(:, 1)))/length > near) return
      if (along < -near .or. along > length + near) return
      if (along <= near) then
         if (self%previous(f) == 0) return
         f_arm(:, 1) = from_to(x, u, q, self%edge(1, self%previous(f)))
      end if
      if (along >= length - near) then
         if (self%next(f) == 0) return
         f_arm(:, 2) = from_to(x, u, q, self%edge(2, self%next(f)))
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

   !> The way from node `a` to node `b` at x + u, differences first.
   pure function from_to(x, u, a, b) result(way)
      real(wp), intent(in) :: x(:, :), u(:, :)
      integer, intent(in) :: a, b
      real(wp) :: way(2)

      way = (x(:, b) - x(:, a)) + (u(:, b) - u(:, a))
   end function from_to

   pure real(wp) function cross(a, b)
      real(wp), intent(in) :: a(2), b(2)

      cross = a(1)*b(2) - a(2)*b(1)
   end function cross

end module emcon_chain
