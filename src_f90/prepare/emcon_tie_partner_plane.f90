!> Which master edge each point of the slave surface of a tie belongs to, in the reference
!> configuration.
!>
!> Slave points look along the averaged normals of mortar contact (docs/theory.md, section 4.5). A
!> slave edge is cut where master nodes project to it, so that each of its points has one partner.
module emcon_tie_partner_plane
   use emcon_box_tree, only : box_tree_find, box_tree_init, box_tree_t
   use emcon_chain_plane, only : chain_corners, chain_t
   use emcon_kinds, only : dp, wp
   use emcon_mortar_frame, only : frame_hit, frame_init, frame_project, frame_t, n_place, &
      pair_stencil_t
   use emcon_mortar_stencil, only : frame_faces, stencil_gather, stencil_master, stencil_slave
   use emcon_sort, only : find_sorted, sort_order
   implicit none
   private
   public :: tie_partners_t, tie_partners_find, tie_partners_frame, polygon, default_tolerance

   !> Both surfaces, and the segments of the slave edges.
   type :: tie_partners_t
      type(chain_t) :: slave, master
      real(wp) :: tolerance = -1.0_wp            !! of positions; < 0: by default [L]
      real(wp), private :: noise = 0.0_wp        !! of positions, by rounding [L]
      logical, allocatable :: is_corner(:)       !! (n_edge) of the slave, at the first node
      integer, allocatable :: start(:)           !! (n_edge + 1) segments of each slave edge
      integer, allocatable :: edge(:)            !! (n_segment) master edge
      real(wp), allocatable :: ends(:, :)        !! (2, n_segment) xi where it begins and ends
      logical, allocatable :: has_partner(:)     !! (n_node) slave node, within the tolerance
      real(wp), allocatable :: hole(:)           !! (n_edge) longest part without partner; 0 [L]
   end type tie_partners_t

   !> A master edge in front of the slave edge at hand.
   type :: front_t
      integer :: edge = 0
      real(wp) :: low = 0.0_wp, high = 0.0_wp    !! part of the slave edge that it covers, clipped
      real(wp) :: tolerance = 0.0_wp             !! at nodes and for holes [L]
      real(wp) :: reach = 0.0_wp                 !! between nodes [L]
      type(frame_t) :: frame
   end type front_t

   !> The default tolerance, per length of the longer of two edges that face each other.
   real(wp), parameter :: default_tolerance = 0.1_wp
   !> Between its nodes an edge may be farther off than at them, per length of the longer one: by
   !> the sagitta of an arc that turns by 60 degrees, tan(15 degrees)/2. Where it turns by more, a
   !> surface has corners.
   real(wp), parameter :: sagitta = 0.5_wp*(2.0_wp - sqrt(3.0_wp))
   !> Turns of the slave surface above this are corners [degrees], as in contact.
   real(wp), parameter :: corner_angle = 60.0_wp
   !> Coordinates in a deck are rounded: so many epsilons of them are no distance.
   real(wp), parameter :: rounding = 8.0_wp*epsilon(1.0_wp)
   !> A master edge as it is, not smoothed.
   type(pair_stencil_t), parameter :: polygon = pair_stencil_t()
   logical, parameter :: no_corner(0) = [logical ::]

contains

   !> Find the segments of all slave edges; `slave`, `master` and `tolerance` are given.
   pure subroutine tie_partners_find(self, x)
      type(tie_partners_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)    !! (2, n_node of the scene) [L]
      type(box_tree_t) :: tree
      type(front_t), allocatable :: front(:)
      real(wp), allocatable :: still(:, :)
      integer, allocatable :: found(:)
      real(wp) :: share, reach
      integer :: e, n_found, n_front, n

      associate (slave => self%slave, master => self%master)
         allocate(self%is_corner(slave%n_facet), self%start(slave%n_facet + 1), found(0), front(0))
         allocate(self%has_partner(size(slave%node)), source=.false.)
         allocate(self%hole(slave%n_facet), source=0.0_wp)
         allocate(self%edge(2*(slave%n_facet + master%n_facet)))
         allocate(self%ends(2, size(self%edge)))
         allocate(still(size(x, 1), size(x, 2)), source=0.0_wp)
         call chain_corners(slave, x, corner_angle, self%is_corner)
         self%noise = rounding*max(maxval(abs(x(:, slave%node))), &
            maxval(abs(x(:, master%node))))
         share = sagitta
         if (self%tolerance < 0.0_wp) share = sagitta + default_tolerance
         call master_tree(master, x, share, tree)
         n = 0
         do e = 1, slave%n_facet
            self%start(e) = n + 1
            reach = max(0.0_wp, self%tolerance) + share*slave%size(e) + self%noise
            n_found = 0
            associate (ends => x(:, slave%facet(:, e)))
               call box_tree_find(tree, minval(ends, 2), maxval(ends, 2), reach, found, n_found)
            end associate
            call face_edges(self, e, found(:n_found), x, still, front, n_front)
            call cut_edge(self, e, front(:n_front), n)
            if (n < self%start(e)) cycle
            call see_node(self, front(:n_front), slave%facet(1, e), self%start(e), 0.0_wp, x)
            call see_node(self, front(:n_front), slave%facet(2, e), n, 1.0_wp, x)
            self%edge(self%start(e):n) = front(self%edge(self%start(e):n))%edge
         end do
         self%start(e) = n + 1
      end associate
   end subroutine tie_partners_find

   !> The boxes of the master edges, blown up by a `share` of their lengths: with the same share of
   !> the slave edge that reaches as far as the longer of the two asks for.
   pure subroutine master_tree(master, x, share, tree)
      type(chain_t), intent(in) :: master
      real(wp), intent(in), contiguous :: x(:, :)
      real(wp), intent(in) :: share
      type(box_tree_t), intent(out) :: tree
      real(wp) :: low(2, master%n_facet), high(2, master%n_facet)
      integer :: m

      do m = 1, master%n_facet
         associate (ends => x(:, master%facet(:, m)))
            low(:, m) = minval(ends, 2) - share*master%size(m)
            high(:, m) = maxval(ends, 2) + share*master%size(m)
         end associate
      end do
      call box_tree_init(tree, low, high)
   end subroutine master_tree

   !> Slave edge `e` and master edge `m`, along the normals of the slave.
   pure subroutine tie_partners_frame(self, e, m, x, still, frame)
      type(tie_partners_t), intent(in) :: self
      integer, intent(in) :: e, m
      real(wp), intent(in), contiguous :: x(:, :)        !! (2, n_node of the scene) [L]
      real(wp), intent(in), contiguous :: still(:, :)    !! zeros, of the same shape
      type(frame_t), intent(out) :: frame
      type(pair_stencil_t) :: stencil
      real(wp) :: local(2, n_place), dlocal(2, n_place)

      call stencil_slave(stencil, self%slave, e, .true., self%is_corner)
      call stencil_master(stencil, self%master, m, .false., .false., no_corner)
      call stencil_gather(stencil, x, still, still, local, dlocal)
      call frame_init(frame, stencil, local)
   end subroutine tie_partners_frame

   !> Those of the master edges `found` that face slave edge `e` and cover a part of it, in the
   !> order in which their parts begin.
   pure subroutine face_edges(self, e, found, x, still, front, n)
      type(tie_partners_t), intent(in) :: self
      integer, intent(in) :: e, found(:)
      real(wp), intent(in), contiguous :: x(:, :), still(:, :)
      type(front_t), allocatable, intent(inout) :: front(:)    !! work space, made longer
      integer, intent(out) :: n
      real(wp) :: longer
      integer :: i

      if (size(front) < size(found)) then
         deallocate(front)
         allocate(front(2*size(found)))
      end if
      n = 0
      do i = 1, size(found)
         associate (this => front(n + 1), m => found(i))
            call tie_partners_frame(self, e, m, x, still, this%frame)
            if (.not. frame_faces(this%frame, 1, 2)) cycle
            this%low = max(0.0_wp, frame_project(this%frame, 2))
            this%high = min(1.0_wp, frame_project(this%frame, 1))
            if (.not. this%high > this%low) cycle
            this%edge = m
            longer = max(self%slave%size(e), self%master%size(m))
            this%tolerance = self%noise &
               + merge(default_tolerance*longer, self%tolerance, self%tolerance < 0.0_wp)
            this%reach = this%tolerance + sagitta*longer
         end associate
         n = n + 1
      end do
      if (n > 1) front(:n) = front(sort_order(real(front(:n)%low, dp)))
   end subroutine face_edges

   !> Cut slave edge `e` where the parts that `front` covers begin or end. Of several master edges
   !> in front of a segment the nearest counts.
   pure subroutine cut_edge(self, e, front, n_segment)
      type(tie_partners_t), intent(inout) :: self
      integer, intent(in) :: e
      type(front_t), intent(in) :: front(:)      !! ascending `low`
      integer, intent(inout) :: n_segment
      integer :: active(size(front)), n_active, n_begun, nearest, i
      real(wp) :: here, next, covered_to

      here = 0.0_wp
      covered_to = 0.0_wp
      n_active = 0
      n_begun = 0
      do while (here < 1.0_wp)
         next = 1.0_wp
         do while (n_begun < size(front))
            if (front(n_begun + 1)%low > here) then
               next = front(n_begun + 1)%low
               exit
            end if
            n_begun = n_begun + 1
            n_active = n_active + 1
            active(n_active) = n_begun
         end do
         do i = n_active, 1, -1
            if (front(active(i))%high > here) cycle
            active(i:n_active - 1) = active(i + 1:n_active)
            n_active = n_active - 1
         end do
         if (n_active > 0) next = min(next, minval(front(active(:n_active))%high))
         nearest = nearest_front(front, active(:n_active), 0.5_wp*(here + next))
         if (nearest > 0) then
            if (here > covered_to) call fill_hole(self, e, front, covered_to, here, nearest, &
               n_segment)
            call append(self, nearest, here, next, n_segment)
            covered_to = next
         end if
         here = next
      end do
      if (covered_to < 1.0_wp) call fill_hole(self, e, front, covered_to, 1.0_wp, 0, n_segment)
   end subroutine cut_edge

   !> The one of front(active) nearest to the slave point `xi`; 0 if none is within its reach.
   pure integer function nearest_front(front, active, xi)
      type(front_t), intent(in) :: front(:)
      integer, intent(in) :: active(:)
      real(wp), intent(in) :: xi
      real(wp) :: eta, gap, best
      integer :: i

      nearest_front = 0
      best = huge(best)
      do i = 1, size(active)
         associate (this => front(active(i)))
            call frame_hit(this%frame, polygon, xi, eta, gap)
            if (abs(gap) > this%reach .or. abs(gap) >= best) cycle
         end associate
         best = abs(gap)
         nearest_front = active(i)
      end do
   end function nearest_front

   !> A part of slave edge `e` that no master edge covers belongs to the ends of the master edges
   !> beside it: half to either, or all to the one there is.
   pure subroutine fill_hole(self, e, front, low, high, after, n_segment)
      type(tie_partners_t), intent(inout) :: self
      integer, intent(in) :: e
      type(front_t), intent(in) :: front(:)
      real(wp), intent(in) :: low, high          !! where the part begins and ends, xi
      integer, intent(in) :: after               !! the one that follows; 0: none
      integer, intent(inout) :: n_segment
      real(wp) :: length, tolerance
      integer :: before

      before = 0
      if (n_segment >= self%start(e)) before = self%edge(n_segment)
      length = (high - low)*self%slave%size(e)
      tolerance = 0.0_wp
      if (before > 0) tolerance = front(before)%tolerance
      if (after > 0) tolerance = max(tolerance, front(after)%tolerance)
      if (length > tolerance) self%hole(e) = max(self%hole(e), length)
      if (before > 0 .and. after > 0) then
         call append(self, before, low, 0.5_wp*(low + high), n_segment)
         call append(self, after, 0.5_wp*(low + high), high, n_segment)
      else if (before + after > 0) then
         call append(self, before + after, low, high, n_segment)
      end if
   end subroutine fill_hole

   pure subroutine append(self, partner, low, high, n)
      type(tie_partners_t), intent(inout) :: self
      integer, intent(in) :: partner
      real(wp), intent(in) :: low, high
      integer, intent(inout) :: n
      integer, allocatable :: longer_edge(:)
      real(wp), allocatable :: longer_ends(:, :)

      if (n == size(self%edge)) then
         allocate(longer_edge(2*n), longer_ends(2, 2*n))
         longer_edge(:n) = self%edge
         longer_ends(:, :n) = self%ends
         call move_alloc(longer_edge, self%edge)
         call move_alloc(longer_ends, self%ends)
      end if
      n = n + 1
      self%edge(n) = partner
      self%ends(:, n) = [low, high]
   end subroutine append

   !> Is slave node `node`, at `xi` of its edge, within the tolerance of what it sees there?
   pure subroutine see_node(self, front, node, segment, xi, x)
      type(tie_partners_t), intent(inout) :: self
      type(front_t), intent(in) :: front(:)
      integer, intent(in) :: node, segment
      real(wp), intent(in) :: xi                 !! 0 or 1
      real(wp), intent(in), contiguous :: x(:, :)
      real(wp) :: eta, gap, offset(2)
      integer :: k

      associate (this => front(self%edge(segment)))
         call frame_hit(this%frame, polygon, xi, eta, gap)
         eta = max(0.0_wp, min(1.0_wp, eta))
         associate (ends => self%master%facet(:, this%edge))
            offset = (x(:, ends(1)) - x(:, node)) + eta*(x(:, ends(2)) - x(:, ends(1)))
         end associate
         if (dot_product(offset, offset) > this%tolerance**2) return
      end associate
      k = find_sorted(self%slave%node, node)
      self%has_partner(k) = .true.
   end subroutine see_node

end module emcon_tie_partner_plane
