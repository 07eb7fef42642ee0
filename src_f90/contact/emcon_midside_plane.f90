!> Midside nodes of contact surfaces: the contact point that stands for each of them.
!>
!> Contact sees a side with a midside node as two straight edges. A uniform pressure on them loads
!> first node, middle and last node by 1/4, 1/2, 1/4; the side's own shape functions ask for 1/6,
!> 2/3, 1/6. So the middle of the two edges is not the midside node but a point that moves by
!> weights of all three nodes, and forces on it act on them by the same weights.
!> Source: docs/theory.md, eqs. (11i) and (11j).
module emcon_midside_plane
   use emcon_condition_nodes, only : condition_resize, condition_resize_slip
   use emcon_constraint, only : condition_t
   use emcon_couplings, only : tie_rows_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_sort, only : find_sorted, unique_sorted
   use emcon_surface_facets, only : facet_nodes, surface_facets
   implicit none
   private
   public :: midside_t, midside_init, midside_points, midside_distribute, midside_stretch
   public :: midside_places, midside_distribute_rows

   !> A side: its nodes, and what its midside node weighs them by.
   type :: side_t
      integer :: middle = 0
      integer :: end(2) = 0                      !! first and last node
      !> Reference position of the midside node from the middle of its chord: along the chord, and
      !> across it to the left, per length of the chord.
      real(wp) :: along = 0.0_wp, across = 0.0_wp
   end type side_t

   type :: midside_t
      integer :: n = 0                           !! sides
      type(side_t), allocatable :: side(:)       !! (n) by ascending middle
      integer, allocatable :: node(:)            !! of the surfaces and sides, ascending
   end type midside_t

contains

   !> The sides of the elements of surfaces, at the present reference positions.
   pure subroutine midside_init(self, scene, which, outline)
      type(midside_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: which(:)            !! (any) surfaces of `scene`
      type(surface_t), intent(in), optional :: outline   !! one more, of nodes of `scene`
      type(side_t), allocatable :: list(:)       ! by the places of their midside nodes in `node`
      integer, allocatable :: node(:)
      integer :: i

      allocate(node(0))
      do i = 1, size(which)
         call take_nodes(scene, scene%surface(which(i)), node)
      end do
      if (present(outline)) call take_nodes(scene, outline, node)
      node = unique_sorted(node)
      allocate(list(size(node)))
      do i = 1, size(which)
         call take_sides(scene, scene%surface(which(i)), node, list)
      end do
      if (present(outline)) call take_sides(scene, outline, node, list)
      self%side = list(pack([(i, i = 1, size(list))], list%middle > 0))
      self%n = size(self%side)
      self%node = unique_sorted([node, self%side%end(1), self%side%end(2)])
   end subroutine midside_init

   !> Append the nodes of a surface.
   pure subroutine take_nodes(scene, surface, node)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, allocatable, intent(inout) :: node(:)
      integer, allocatable :: edge(:, :), more(:)

      call surface_facets(scene, surface, edge)
      call facet_nodes(surface, edge, more)
      node = [node, more]
   end subroutine take_nodes

   !> Take over the sides of `surface`, if it is none of faces those of all elements, whose midside
   !> nodes are among `node`.
   pure subroutine take_sides(scene, surface, node, list)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, intent(in) :: node(:)             !! ascending
      type(side_t), intent(inout) :: list(:)     !! (size of `node`)
      integer :: e, f
      logical :: has_faces

      if (size(node) == 0) return
      has_faces = allocated(surface%element)
      if (has_faces) has_faces = size(surface%element) > 0
      if (.not. has_faces) then
         do e = 1, size(scene%element%kind)
            do f = 1, scene%element%kinds(scene%element%kind(e))%n_face
               call take_side(scene, e, f, node, list)
            end do
         end do
      else
         do e = 1, size(surface%element)
            call take_side(scene, surface%element(e), surface%face(e), node, list)
         end do
      end if
   end subroutine take_sides

   !> Take over face `f` of element `e` if its midside node is among `node`.
   pure subroutine take_side(scene, e, f, node, list)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: e, f
      integer, intent(in) :: node(:)             !! ascending
      type(side_t), intent(inout) :: list(:)     !! (size of `node`)
      integer :: at(3), i

      associate (kind => scene%element%kinds(scene%element%kind(e)))
         if (any([kind%n_face_node, kind%n_dim + 1] /= size(at))) return
         at = scene%element%node(kind%face(f), e)
      end associate
      i = find_sorted(node, at(3))
      if (any(at == 0) .or. i == 0) return
      if (.not. any(abs(scene%x(:, at(2)) - scene%x(:, at(1))) > 0.0_wp)) return
      if (list(i)%middle == 0) list(i) = side_at(at, scene%x(:, at))
   end subroutine take_side

   !> The side of the nodes first, last, middle.
   pure type(side_t) function side_at(node, x) result(side)
      integer, intent(in) :: node(3)
      real(wp), intent(in) :: x(:, :)            !! (2, 3) their reference positions [L]
      real(wp) :: chord(2), off(2), square       ! > 0

      chord = x(:, 2) - x(:, 1)
      off = x(:, 3) - 0.5_wp*(x(:, 1) + x(:, 2))
      square = dot_product(chord, chord)
      side = side_t(node(3), node(:2))
      side%along = dot_product(off, chord)/square
      side%across = (chord(1)*off(2) - chord(2)*off(1))/square
   end function side_at

   !> The displacements of contact points: docs/theory.md, eq. (11i).
   pure function midside_points(self, u) result(point)
      type(midside_t), intent(in) :: self
      real(wp), intent(in) :: u(:, :)            !! (2, n_node) of nodes [L]
      !> (2, n_node) [L]; undefined at nodes that are not in the surfaces
      real(wp) :: point(size(u, 1), size(u, 2))
      real(wp) :: chord(2), bulge(2)
      integer :: k

      do k = 1, size(self%node)
         point(:, self%node(k)) = u(:, self%node(k))
      end do
      do k = 1, self%n
         associate (side => self%side(k), a => u(:, self%side(k)%end(1)), &
               b => u(:, self%side(k)%end(2)), m => u(:, self%side(k)%middle))
            chord = b - a
            bulge = (m - 0.5_wp*(a + b)) - side%along*chord - side%across*[-chord(2), chord(1)]
            point(:, side%middle) = m + bulge/3.0_wp
         end associate
      end do
   end function midside_points

   !> So many times as far as any node moves a contact point, at most.
   pure real(wp) function midside_stretch(self) result(stretch)
      type(midside_t), intent(in) :: self
      real(wp) :: tilt
      integer :: k

      stretch = 1.0_wp
      do k = 1, self%n
         tilt = hypot(self%side(k)%along, self%side(k)%across)
         stretch = max(stretch, (5.0_wp + 2.0_wp*tilt)/3.0_wp)
      end do
   end function midside_stretch

   !> Turn a condition on contact points into one on nodes: docs/theory.md, eq. (11j).
   pure subroutine midside_distribute(self, item)
      type(midside_t), intent(in) :: self
      type(condition_t), intent(inout) :: item   !! with its values and derivatives
      integer :: number(item%n_node), list(3*item%n_node), place(3, item%n_node)
      integer :: i, n, n_slave

      do i = 1, item%n_node
         number(i) = find_sorted(self%side%middle, item%node(i))
      end do
      if (all(number == 0)) return
      call place_nodes(self, item, number, list, place, n, n_slave)
      call distribute_all(self, number, list(:n), place, item)
      item%n_slave = n_slave
   end subroutine midside_distribute

   !> The nodes of the condition: those of the slave side, the ends of their sides, and the same of
   !> the master side; each once.
   pure subroutine place_nodes(self, item, number, list, place, n, n_slave)
      type(midside_t), intent(in) :: self
      type(condition_t), intent(in) :: item
      integer, intent(in) :: number(:)           !! (n_node of `item`) of the side in the middle of
                                                 !! which it is; 0: of none
      integer, intent(out) :: list(:)            !! (>= n) nodes
      integer, intent(out) :: place(:, :)        !! (3, n_node of `item`) in `list`: of each node,
                                                 !! and of the ends of its side if it has one
      integer, intent(out) :: n, n_slave
      integer :: i

      n = 0
      call append(self, item, number, 1, item%n_slave, list, n)
      n_slave = n
      call append(self, item, number, item%n_slave + 1, item%n_node, list, n)
      do i = 1, item%n_node
         place(1, i) = findloc(list(:n), item%node(i), 1)
         if (number(i) == 0) cycle
         associate (ends => self%side(number(i))%end)
            place(2, i) = findloc(list(:n), ends(1), 1)
            place(3, i) = findloc(list(:n), ends(2), 1)
         end associate
      end do
   end subroutine place_nodes

   !> Append nodes `first` to `last` of the condition, and behind them the ends of their sides.
   pure subroutine append(self, item, number, first, last, list, n)
      type(midside_t), intent(in) :: self
      type(condition_t), intent(in) :: item
      integer, intent(in) :: number(:)           !! (n_node of `item`) as of `place_nodes`
      integer, intent(in) :: first, last
      integer, intent(inout) :: list(:), n
      integer :: i, k

      list(n + 1:n + last - first + 1) = item%node(first:last)
      n = n + last - first + 1
      do i = first, last
         if (number(i) == 0) cycle
         do k = 1, 2
            associate (node => self%side(number(i))%end(k))
               if (any(list(:n) == node) .or. any(item%node(:item%n_node) == node)) cycle
               n = n + 1
               list(n) = node
            end associate
         end do
      end do
   end subroutine append

   !> All derivatives of the condition, on the nodes `list`.
   pure subroutine distribute_all(self, number, list, place, item)
      type(midside_t), intent(in) :: self
      integer, intent(in) :: number(:), list(:), place(:, :)   !! as of `place_nodes`
      type(condition_t), intent(inout) :: item
      real(wp), dimension(size(item%g, 1)*item%n_node, 2) :: first, slip_first
      real(wp), dimension(size(first, 1), size(first, 1)) :: second, slip_second
      real(wp) :: slip
      integer :: n, to

      n = item%n_node
      to = size(list)
      first = both(item%g, item%c)
      if (.not. item%leaves_second) second = item%h(:size(first, 1), :size(first, 1))
      if (item%has_friction) then
         slip = item%slip(1)
         slip_first = both(item%t(:, :, 1), item%t1(:, :, 1))
         if (.not. item%leaves_second) slip_second = item%ht(:size(first, 1), :size(first, 1), 1)
      end if
      call condition_resize(item, to)
      item%node(:to) = list
      call take(first, item%g, item%c)
      if (.not. item%leaves_second) call take_second(second, item%h)
      if (.not. item%has_friction) return
      call condition_resize_slip(item)
      item%slip(1) = slip
      call take(slip_first, item%t(:, :, 1), item%t1(:, :, 1))
      if (.not. item%leaves_second) call take_second(slip_second, item%ht(:, :, 1))

   contains

      !> Discrete gradient and gradient by the coordinates of the `n` nodes.
      pure function both(g, c) result(list)
         real(wp), intent(in) :: g(:, :), c(:, :)
         real(wp) :: list(size(first, 1), 2)

         list(:, 1) = reshape(g(:, :n), [size(list, 1)])
         list(:, 2) = reshape(c(:, :n), [size(list, 1)])
      end function both

      pure subroutine take(old, g, c)
         real(wp), intent(in) :: old(:, :)
         real(wp), intent(inout) :: g(:, :), c(:, :)
         real(wp) :: new(size(g, 1)*to, 2)

         call distribute(self, number, place, old, new)
         g(:, :to) = reshape(new(:, 1), [size(g, 1), to])
         c(:, :to) = reshape(new(:, 2), [size(c, 1), to])
      end subroutine take

      pure subroutine take_second(old, h)
         real(wp), intent(in) :: old(:, :)
         real(wp), intent(inout) :: h(:, :)
         real(wp) :: part(size(item%g, 1)*to, size(old, 2)), whole(size(part, 1), size(part, 1))

         call distribute(self, number, place, old, part)
         call distribute(self, number, place, transpose(part), whole)
         h(:size(whole, 1), :size(whole, 1)) = transpose(whole)
      end subroutine take_second

   end subroutine distribute_all

   !> Columns over the coordinates of contact points, as columns over those of nodes.
   pure subroutine distribute(self, number, place, old, new)
      type(midside_t), intent(in) :: self
      integer, intent(in) :: number(:), place(:, :)        !! as of `place_nodes`
      real(wp), intent(in) :: old(:, :)                    !! (2 n points, m)
      real(wp), intent(out) :: new(:, :)                   !! (2 n nodes, m)
      real(wp) :: f(2), turned(2)
      integer :: i, j

      new = 0.0_wp
      do j = 1, size(old, 2)
         do i = 1, size(number)
            f = old(2*i - 1:2*i, j)
            if (number(i) == 0) then
               call add(place(1, i), f, new(:, j))
               cycle
            end if
            associate (side => self%side(number(i)))
               turned = side%along*f + side%across*[f(2), -f(1)]
            end associate
            call add(place(1, i), 4.0_wp/3.0_wp*f, new(:, j))
            call add(place(2, i), (turned - 0.5_wp*f)/3.0_wp, new(:, j))
            call add(place(3, i), (-turned - 0.5_wp*f)/3.0_wp, new(:, j))
         end do
      end do
   end subroutine distribute

   !> Add what belongs to a node to a column over all.
   pure subroutine add(place, f, column)
      integer, intent(in) :: place               !! of the node
      real(wp), intent(in) :: f(2)
      real(wp), intent(inout) :: column(:)       !! (2 n nodes)

      column(2*place - 1:2*place) = column(2*place - 1:2*place) + f
   end subroutine add

   !> The same points of ties: by the weights -1/6, 4/3, -1/6 in the reference too, since rows of
   !> ties have one weight for all directions.
   pure subroutine midside_places(self, x)
      type(midside_t), intent(in) :: self
      real(wp), intent(inout) :: x(:, :)         !! (2, n_node) of nodes; of points [L]
      integer :: k

      do k = 1, self%n
         associate (side => self%side(k), a => x(:, self%side(k)%end(1)), &
               b => x(:, self%side(k)%end(2)))
            x(:, side%middle) = x(:, side%middle) + (x(:, side%middle) - 0.5_wp*(a + b))/3.0_wp
         end associate
      end do
   end subroutine midside_places

   !> Rows of a tie on these points become rows on nodes; the weight of the slave node is what the
   !> others leave, added up from the end.
   pure subroutine midside_distribute_rows(self, rows)
      type(midside_t), intent(in) :: self
      type(tie_rows_t), intent(inout) :: rows
      type(tie_rows_t) :: old
      integer :: number, k, s, i, n

      old = rows
      rows%node = spread(0, 1, 3*size(old%node))
      rows%weight = spread(0.0_wp, 1, size(rows%node))
      n = 0
      do k = 1, size(old%slave)
         do s = old%start(k) + 1, old%start(k + 1)
            number = find_sorted(self%side%middle, old%node(s))
            associate (w => old%weight(s))
               call add_entry(rows, k, old%node(s), merge(4.0_wp/3.0_wp*w, w, number > 0), n)
               if (number == 0) cycle
               do i = 1, 2
                  call add_entry(rows, k, self%side(number)%end(i), -w/6.0_wp, n)
               end do
            end associate
         end do
         rows%start(k + 1) = n
         associate (first => rows%start(k) + 1)
            rows%weight(first) = 0.0_wp
            do i = n, first + 1, -1
               rows%weight(first) = rows%weight(first) - rows%weight(i)
            end do
         end associate
      end do
      rows%node = rows%node(:n)
      rows%weight = rows%weight(:n)
   end subroutine midside_distribute_rows

   !> Add an entry to row `k`, the last one.
   pure subroutine add_entry(rows, k, node, weight, n)
      type(tie_rows_t), intent(inout) :: rows
      integer, intent(in) :: k
      integer, intent(in) :: node                !! of the scene
      real(wp), intent(in) :: weight             !! [L]
      integer, intent(inout) :: n                !! entries of all rows so far
      integer :: place

      place = rows%start(k) + findloc(rows%node(rows%start(k) + 1:n), node, 1)
      if (place == rows%start(k)) then
         n = n + 1
         place = n
         rows%node(n) = node
      end if
      rows%weight(place) = rows%weight(place) + weight
   end subroutine add_entry

end module emcon_midside_plane
