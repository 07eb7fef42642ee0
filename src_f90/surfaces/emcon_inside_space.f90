!> What of one outline in space is inside another: points by what their edges cross, and middles of
!> the parts of edges between crossings.
!>
!> An edge that crosses a facet has one end on either side of it; from there the side is handed on
!> along edges that cross nothing. What crosses nothing at all is inside if a ray from it goes out.
!> The outline that is asked is moved by very little, so that edges which lie in facets of like
!> meshes, and points on them, are on one side as neighbours are.
!> Source: docs/theory.md, section 4.15.
module emcon_inside_space
   use emcon_box_tree, only : box_tree_find, box_tree_init, box_tree_t, box_tree_next, leaf_size
   use emcon_kinds, only : wp
   use emcon_nearest_space, only : crossing_find, nearest_t, nearest_update
   use emcon_triangles_space, only : cross_product, triangle_at, triangles_t
   implicit none
   private
   public :: inside_t, middle_t, inside_find, inside_own, inside_has, inside_confirm, &
      inside_nearest, inside_nearest_own

   !> Where a point is; `is_asked` while what hangs on it is gathered.
   integer, parameter :: is_unknown = 0, is_out = 1, is_in = 2, is_asked = 3
   !> So far, by the longest facet, the outline is moved, in a direction that no mesh has.
   real(wp), parameter :: moved_by = sqrt(epsilon(1.0_wp))
   real(wp), parameter :: moved_along(3) = [0.5477_wp, 0.3089_wp, 0.7776_wp]
   !> Crossings of one edge that are told apart.
   integer, parameter :: most_crossings = 64

   !> The middle of a part of an edge that is inside.
   type :: middle_t
      integer :: edge = 0
      real(wp) :: share = 0.0_wp                 !! of the edge before it
      integer :: near = 0                        !! triangle that an end of it is on; 0: none
   end type middle_t

   !> A look at outline a inside outline b.
   type :: inside_t
      integer, allocatable :: state(:)           !! (n_point of a) `is_in`, or not
      integer, allocatable :: point(:)           !! that are inside, each after its `before`
      integer, allocatable :: before(:)          !! (n_point of a) the point beside it; 0: none
      integer, allocatable :: near(:)            !! (n_point of a) a triangle of b near it; 0: none
      logical :: is_own = .false.                !! a is b: what it crosses of itself
      integer :: n_middle = 0
      type(middle_t), allocatable :: middle(:)
      ! Private to this module:
      logical, allocatable :: is_cut(:)          !! (n_edge of a)
      integer, allocatable :: queue(:)           !! (n_point of a)
      integer, allocatable :: facet(:)           !! (n) of b that a may reach
      real(wp), allocatable :: normal(:, :)      !! (3, n_triangle of b) of these [L^2]
      type(box_tree_t) :: tree                   !! of these facets
      type(box_tree_t) :: whole                  !! of all facets of b
      logical :: has_whole = .false.
      real(wp) :: reach = 0.0_wp                 !! `tree` has what is so near [L]
      real(wp) :: shift(3) = 0.0_wp              !! by which a is moved [L]
      real(wp) :: pad = 0.0_wp                   !! more than that [L]
      real(wp) :: low(3) = 0.0_wp, high(3) = 0.0_wp    !! box of b, with the pad [L]
   end type inside_t

   !> Where an edge crosses facets, in order.
   type :: crossings_t
      integer :: n = 0
      real(wp) :: share(most_crossings) = 0.0_wp       !! of the edge before it
      logical :: goes_in(most_crossings) = .false.
      integer :: triangle(most_crossings) = 0
   end type crossings_t

contains

   !> Which points of `a`, and which middles of parts of its edges, are inside `b`?
   pure subroutine inside_find(self, a, b, reach)
      type(inside_t), intent(out) :: self
      type(triangles_t), intent(in) :: a, b      !! placed
      real(wp), intent(in) :: reach              !! length of the longest facet of both [L]

      self%shift = moved_by*reach*moved_along
      call begin(self, a, b, reach)
      if (any(maxval(a%high, dim=2) < self%low) .or. any(minval(a%low, dim=2) > self%high)) then
         self%state = is_out
         allocate(self%point(0))
         return
      end if
      call find_facets(self, a, b)
      if (size(self%facet) > 0) call cut_edges(self, a, b)
      call tell_points(self, a, b)
   end subroutine inside_find

   !> Which parts of edges of `a` are behind triangles that share no point with them, and which ends
   !> of these edges? What hangs on them is not asked: an outline that crosses itself has no inside.
   pure subroutine inside_own(self, a, reach)
      type(inside_t), intent(out) :: self
      type(triangles_t), intent(in) :: a         !! placed
      real(wp), intent(in) :: reach              !! length of its longest facet [L]
      integer :: i

      self%is_own = .true.
      call begin(self, a, a, reach)
      call find_facets(self, a, a)
      call cut_edges(self, a, a)
      self%point = pack([(i, i = 1, size(self%state))], self%state == is_in)
   end subroutine inside_own

   !> Nothing is known yet.
   pure subroutine begin(self, a, b, reach)
      type(inside_t), intent(inout) :: self
      type(triangles_t), intent(in) :: a, b
      real(wp), intent(in) :: reach

      allocate(self%middle(0))
      self%reach = reach
      self%pad = 2.0_wp*moved_by*reach
      self%low = minval(b%low, dim=2) - self%pad
      self%high = maxval(b%high, dim=2) + self%pad
      allocate(self%state(size(a%at, 2)), source=is_unknown)
      allocate(self%near(size(a%at, 2)), self%before(size(a%at, 2)), source=0)
      allocate(self%queue(size(a%at, 2)))
      allocate(self%is_cut(size(a%edge, 2)), source=.false.)
   end subroutine begin

   !> The facets of `b` within reach of the box of `a`, with their normals, in a tree.
   pure subroutine find_facets(self, a, b)
      type(inside_t), intent(inout) :: self
      type(triangles_t), intent(in) :: a, b
      real(wp) :: low(3), high(3), corner(3, 3)
      integer :: f, n, t

      low = minval(a%low, dim=2) - self%reach
      high = maxval(a%high, dim=2) + self%reach
      allocate(self%facet(b%facets%n_facet), self%normal(3, size(b%split%facet)))
      n = 0
      do f = 1, b%facets%n_facet
         if (any(b%low(:, f) > high) .or. any(b%high(:, f) < low)) cycle
         n = n + 1
         self%facet(n) = f
         do t = b%split%start(f), b%split%start(f + 1) - 1
            corner = triangle_at(b, t)
            self%normal(:, t) = cross_product(corner(:, 2) - corner(:, 1), &
               corner(:, 3) - corner(:, 1))
         end do
      end do
      self%facet = self%facet(:n)
      call box_tree_init(self%tree, b%low(:, self%facet), b%high(:, self%facet))
   end subroutine find_facets

   !> Cut all edges of `a` that cross facets of `b`: that tells on which sides their ends are.
   pure subroutine cut_edges(self, a, b)
      type(inside_t), intent(inout) :: self
      type(triangles_t), intent(in) :: a, b
      type(crossings_t) :: crossings
      integer, allocatable :: found(:)
      integer :: f, e, n

      allocate(found(64))
      do f = 1, a%facets%n_facet
         if (any(a%low(:, f) > self%high) .or. any(a%high(:, f) < self%low)) cycle
         n = 0
         call box_tree_find(self%tree, a%low(:, f), a%high(:, f), self%pad, found, n)
         if (n == 0) cycle
         do e = a%edge_start(f), a%edge_start(f + 1) - 1
            call find_crossings(self, a, b, e, found(:n), crossings)
            if (crossings%n > 0) call cut(self, a, e, crossings)
         end do
      end do
   end subroutine cut_edges

   !> Where edge `e` of `a` crosses triangles of some facets of `b`.
   pure subroutine find_crossings(self, a, b, e, found, crossings)
      type(inside_t), intent(in) :: self
      type(triangles_t), intent(in) :: a, b
      integer, intent(in) :: e
      integer, intent(in) :: found(:)            !! indices of `self%facet`
      type(crossings_t), intent(inout) :: crossings
      real(wp) :: p(3), q(3), low(3), high(3), height(2)
      integer :: i, t

      crossings%n = 0
      p = a%at(:, a%edge(1, e)) + self%shift
      q = a%at(:, a%edge(2, e)) + self%shift
      low = min(p, q)
      high = max(p, q)
      do i = 1, size(found)
         associate (f => self%facet(found(i)))
            if (any(b%low(:, f) > high) .or. any(b%high(:, f) < low)) cycle
            do t = b%split%start(f), b%split%start(f + 1) - 1
               associate (n => self%normal(:, t), at => b%at(:, b%split%corner(1, t)))
                  height(1) = dot_product(n, p - at)
                  height(2) = dot_product(n, q - at)
               end associate
               if ((height(1) > 0.0_wp) .eqv. (height(2) > 0.0_wp)) cycle
               if (self%is_own) then
                  if (have_common(a%edge(:, e), b%split%corner(:, t))) cycle
                  ! Both move alike, and what touches is on either side by rounding.
                  if (minval(abs(height)) <= self%pad*sqrt(sum(self%normal(:, t)**2))) cycle
               end if
               if (.not. crossing_find(p, q, triangle_at(b, t), b%split%corner(:, t))) cycle
               call insert(crossings, t, height)
            end do
         end associate
      end do
   end subroutine find_crossings

   !> Is a point in both lists?
   pure logical function have_common(list, other)
      integer, intent(in) :: list(:), other(:)
      integer :: i

      have_common = .false.
      do i = 1, size(list)
         have_common = have_common .or. any(other == list(i))
      end do
   end function have_common

   !> Take up a crossing with triangle `t`.
   pure subroutine insert(self, t, height)
      type(crossings_t), intent(inout) :: self
      integer, intent(in) :: t
      real(wp), intent(in) :: height(2)          !! of both ends in front of it
      real(wp) :: share
      integer :: i

      if (self%n == most_crossings) return
      share = height(1)/(height(1) - height(2))
      i = self%n
      do while (i > 0)
         if (self%share(i) <= share) exit
         self%share(i + 1) = self%share(i)
         self%goes_in(i + 1) = self%goes_in(i)
         self%triangle(i + 1) = self%triangle(i)
         i = i - 1
      end do
      self%share(i + 1) = share
      self%goes_in(i + 1) = height(1) > 0.0_wp
      self%triangle(i + 1) = t
      self%n = self%n + 1
   end subroutine insert

   !> Edge `e` is cut: its ends, and the middles of what of it is inside.
   pure subroutine cut(self, a, e, crossings)
      type(inside_t), intent(inout) :: self
      type(triangles_t), intent(in) :: a
      integer, intent(in) :: e
      type(crossings_t), intent(in) :: crossings
      integer :: k

      self%is_cut(e) = .true.
      associate (n => crossings%n, p => a%edge(1, e), q => a%edge(2, e))
         self%state(p) = merge(is_out, is_in, crossings%goes_in(1))
         self%near(p) = crossings%triangle(1)
         self%state(q) = merge(is_in, is_out, crossings%goes_in(n))
         self%near(q) = crossings%triangle(n)
         if (.not. crossings%goes_in(1)) call add(self, middle_t(e, &
            0.5_wp*crossings%share(1), crossings%triangle(1)))
         do k = 1, n - 1
            if (crossings%goes_in(k)) call add(self, middle_t(e, &
               0.5_wp*(crossings%share(k) + crossings%share(k + 1)), crossings%triangle(k)))
         end do
         if (crossings%goes_in(n)) call add(self, middle_t(e, &
            0.5_wp*(1.0_wp + crossings%share(n)), crossings%triangle(n)))
      end associate
   end subroutine cut

   pure subroutine add(self, middle)
      type(inside_t), intent(inout) :: self
      type(middle_t), intent(in) :: middle
      type(middle_t), allocatable :: longer(:)

      if (self%n_middle == size(self%middle)) then
         allocate(longer(2*self%n_middle + 8))
         longer(:self%n_middle) = self%middle
         call move_alloc(longer, self%middle)
      end if
      self%n_middle = self%n_middle + 1
      self%middle(self%n_middle) = middle
   end subroutine add

   !> Hand on what is known of points along edges that are not cut. An outline that is not closed
   !> has no inside beyond the ends of what it cuts.
   pure subroutine tell_points(self, a, b)
      type(inside_t), intent(inout) :: self
      type(triangles_t), intent(in) :: a, b
      integer :: i, n
      logical :: meets_out

      n = 0
      do i = 1, size(self%state)
         if (self%state(i) == is_in) then
            n = n + 1
            self%queue(n) = i
         else if (self%state(i) == is_unknown) then
            if (any(a%at(:, i) < self%low) .or. any(a%at(:, i) > self%high) &
               .or. .not. b%is_closed) self%state(i) = is_out
         end if
      end do
      if (b%is_closed) call hand_on(self, a, is_in, n, meets_out)
      self%point = self%queue(:n)
      if (.not. b%is_closed) return
      do i = 1, size(self%state)
         if (self%state(i) /= is_unknown) cycle
         self%state(i) = is_asked
         self%queue(1) = i
         n = 1
         call hand_on(self, a, is_asked, n, meets_out)
         if (.not. meets_out) meets_out = .not. inside_confirm(self, b, a%at(:, i))
         self%state(self%queue(:n)) = merge(is_out, is_in, meets_out)
         if (.not. meets_out) self%point = [self%point, self%queue(:n)]
      end do
      call add_whole_edges(self, a)
   end subroutine tell_points

   !> The middles of edges that are inside as a whole.
   pure subroutine add_whole_edges(self, a)
      type(inside_t), intent(inout) :: self
      type(triangles_t), intent(in) :: a
      integer :: i, k

      do i = 1, size(self%point)
         associate (point => self%point(i))
            do k = a%around_start(point) + 1, a%around_start(point + 1)
               associate (e => a%around(k))
                  if (a%edge(1, e) /= point .or. self%is_cut(e)) cycle
                  call add(self, middle_t(e, 0.5_wp))
               end associate
            end do
         end associate
      end do
   end subroutine add_whole_edges

   !> Does a point of `a` count as inside?
   elemental logical function inside_has(self, point) result(has)
      type(inside_t), intent(in) :: self
      integer, intent(in) :: point               !! of the split of a

      has = self%state(point) == is_in
   end function inside_has

   !> Give `state` to all points that hang on the first `n` of the queue, and put them into it.
   pure subroutine hand_on(self, a, state, n, meets_out)
      type(inside_t), intent(inout) :: self
      type(triangles_t), intent(in) :: a
      integer, intent(in) :: state
      integer, intent(inout) :: n
      logical, intent(out) :: meets_out          !! is one of them beside one that is outside?
      integer :: i, k, j

      meets_out = .false.
      i = 0
      do while (i < n)
         i = i + 1
         associate (point => self%queue(i))
            do k = a%around_start(point) + 1, a%around_start(point + 1)
               associate (e => a%around(k))
                  if (self%is_cut(e)) cycle
                  j = a%edge(1, e) + a%edge(2, e) - point
               end associate
               meets_out = meets_out .or. self%state(j) == is_out
               if (self%state(j) /= is_unknown) cycle
               self%state(j) = state
               self%before(j) = point
               n = n + 1
               self%queue(n) = j
            end do
         end associate
      end do
   end subroutine hand_on

   !> Does a ray from `point` leave `b` more often than it enters?
   pure logical function inside_confirm(self, b, point) result(is_inside)
      type(inside_t), intent(in) :: self
      type(triangles_t), intent(in) :: b         !! closed
      real(wp), intent(in) :: point(3)           !! [L]
      real(wp) :: p(3), q(3), corner(3, 3), height(2)
      integer :: f, t, axis, n

      p = point + self%shift
      axis = minloc(self%high - p, dim=1)
      q = p
      q(axis) = self%high(axis) + (self%high(axis) - self%low(axis))
      n = 0
      do f = 1, b%facets%n_facet
         if (any(b%low(:, f) > q) .or. any(b%high(:, f) < p)) cycle
         do t = b%split%start(f), b%split%start(f + 1) - 1
            corner = triangle_at(b, t)
            associate (normal => cross_product(corner(:, 2) - corner(:, 1), &
                  corner(:, 3) - corner(:, 1)))
               height(1) = dot_product(normal, p - corner(:, 1))
               height(2) = dot_product(normal, q - corner(:, 1))
            end associate
            if ((height(1) > 0.0_wp) .eqv. (height(2) > 0.0_wp)) cycle
            if (.not. crossing_find(p, q, corner, b%split%corner(:, t))) cycle
            n = n + merge(-1, 1, height(1) > 0.0_wp)
         end do
      end do
      is_inside = n > 0
   end function inside_confirm

   !> The place of `b` that is nearest to `point`.
   pure subroutine inside_nearest(self, b, point, near, nearest)
      type(inside_t), intent(inout) :: self
      type(triangles_t), intent(in) :: b
      real(wp), intent(in) :: point(3)           !! [L]
      integer, intent(in) :: near                !! a triangle that is near; 0: unknown
      type(nearest_t), intent(out) :: nearest

      if (near > 0) call nearest_update(nearest, near, point, triangle_at(b, near))
      call walk(self%tree, self%facet, b, point, nearest)
      if (nearest%square <= self%reach**2) return
      if (.not. self%has_whole) call box_tree_init(self%whole, b%low, b%high)
      self%has_whole = .true.
      call walk(self%whole, [integer ::], b, point, nearest)
   end subroutine inside_nearest

   !> The same of the outline that the point is on: no farther away than the triangle that is
   !> crossed, and hanging together with it there, past what is on the other side of the material.
   pure subroutine inside_nearest_own(self, b, point, own, near, nearest)
      type(inside_t), intent(in) :: self
      type(triangles_t), intent(in) :: b
      real(wp), intent(in) :: point(3)           !! [L]
      integer, intent(in) :: own(2)              !! ends of its edge: what has them does not count
      integer, intent(in) :: near                !! the triangle that is crossed
      type(nearest_t), intent(out) :: nearest
      integer, allocatable :: found(:)
      integer :: n, n_met, i, k, t

      call nearest_update(nearest, near, point, triangle_at(b, near))
      allocate(found(64))
      n = 0
      call box_tree_find(self%tree, point, point, sqrt(nearest%square), found, n)
      found(:n) = self%facet(found(:n))
      n_met = 0                                  ! of those found, put first
      k = findloc(found(:n), b%split%facet(near), dim=1)
      do while (k > 0)
         n_met = n_met + 1
         found([n_met, k]) = found([k, n_met])
         do t = b%split%start(found(n_met)), b%split%start(found(n_met) + 1) - 1
            call nearest_update(nearest, t, point, triangle_at(b, t))
         end do
         k = 0
         do i = n_met + 1, n
            if (have_common(own, b%facets%corner(:, found(i)))) cycle
            if (.not. meets_one_of(found(:n_met), found(i))) cycle
            k = i
            exit
         end do
      end do

   contains

      !> Has facet `f` a node in common with one of a list?
      pure logical function meets_one_of(list, f)
         integer, intent(in) :: list(:), f
         integer :: j

         meets_one_of = .false.
         associate (corner => b%facets%corner)
            do j = 1, size(list)
               meets_one_of = meets_one_of .or. have_common(pack(corner(:, f), corner(:, f) > 0), &
                  corner(:, list(j)))
            end do
         end associate
      end function meets_one_of

   end subroutine inside_nearest_own

   !> Look for a nearer place among the facets of a tree.
   pure subroutine walk(tree, facet, b, point, nearest)
      type(box_tree_t), intent(in) :: tree
      integer, intent(in) :: facet(:)            !! of the boxes; none: they are all facets
      type(triangles_t), intent(in) :: b
      real(wp), intent(in) :: point(3)
      type(nearest_t), intent(inout) :: nearest
      real(wp) :: reach
      integer :: found(leaf_size), k, n, i, f, t

      k = 1
      do while (k > 0)
         ! The root of a huge number is too much for quadruple ones.
         reach = huge(reach)
         if (nearest%square < huge(reach)) reach = sqrt(nearest%square)
         call box_tree_next(tree, point, reach, k, found, n)
         do i = 1, n
            f = found(i)
            if (size(facet) > 0) f = facet(f)
            do t = b%split%start(f), b%split%start(f + 1) - 1
               call nearest_update(nearest, t, point, triangle_at(b, t))
            end do
         end do
      end do
   end subroutine walk

end module emcon_inside_space
