!> After each step, is a body inside another, whatever the constraints say?
!>
!> All pieces of the mesh are looked at both ways, at the end of the step and, where they move by
!> much, on the straight way there. Those that no pair brings together may overlap if they do at
!> the start of a step of the deck, or if ties hold them together. While boxes are apart nothing is
!> done. Source: docs/theory.md, section 4.11.
module emcon_overlap_check
   use emcon_box_tree, only : box_tree_find, box_tree_init, box_tree_t
   use emcon_guards, only : touching_bar
   use emcon_interactions, only : contact_options_t, pair_acts
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_midside_plane, only : midside_init, midside_points, midside_stretch, midside_t
   use emcon_outline, only : outline_meets
   use emcon_overlap_query, only : overlap_names, overlap_query_t, overlap_t
   use emcon_overlap_query_registry, only : new_overlap_query
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: overlap_check_t, overlap_t, overlap_check_init, overlap_check_smooth, &
      overlap_check_excuse, overlap_check_own, overlap_check_step

   !> Between two looks pieces move against each other by less than this part of the thinnest
   !> element: one look at what goes through it is then at least half as deep.
   real(wp), parameter :: look_motion = 0.5_wp
   !> Boxes that are apart do not meet as long as both move by less than this part of the distance.
   real(wp), parameter :: half_way = 0.495_wp
   !> Looks at one step at most.
   integer, parameter :: most_looks = 64

   !> Two pieces, the first one not after the other.
   type :: meeting_t
      integer :: first = 0, second = 0
   end type meeting_t

   type :: overlap_check_t
      integer :: n_piece = 0                     !! 0: nothing can meet
      integer :: n_facet = 0                     !! of them
      class(overlap_query_t), allocatable :: query
      type(midside_t) :: midside                 !! of outlines, by contact points
      ! Where each piece is in a step:
      real(wp), allocatable :: low(:, :), high(:, :)     !! (n_dim, n_piece) box over the step [L]
      real(wp), allocatable :: least(:, :), most(:, :)   !! (n_dim, n_piece) motions of nodes [L]
      real(wp), allocatable :: thinnest(:)       !! (n_piece) element at the outline [L]
      real(wp), allocatable :: longest(:)        !! (n_piece) facet [L]
      integer, allocatable :: other(:)           !! (n_piece) work space
      type(meeting_t), allocatable :: excused(:) !! of pieces without a pair that may overlap
      type(overlap_t) :: stray                   !! the deepest of others without a pair
      !> As long as no node has moved farther since the start of the step that was last looked at,
      !> there is no overlap [L].
      real(wp) :: clearance = 0.0_wp
      real(wp) :: clear_until = 0.0_wp           !! the same, as a total by `motion_bound_t` [L]
      !> Overlap per edge with which a step began that resolves it
      real(wp) :: meant_overlap = 0.0_wp
   end type overlap_check_t

contains

   !> Set up for the contact pairs of `scene`.
   subroutine overlap_check_init(self, scene)
      type(overlap_check_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(surface_t) :: outline

      call new_overlap_query(scene, self%query)
      call self%query%take_pairs(pair_acts(scene%pair, 1))
      associate (mesh => self%query%outline)
         self%n_piece = mesh%n_piece
         self%n_facet = size(mesh%facet, 2)
         outline%edge = mesh%facet
      end associate
      call midside_init(self%midside, scene, [integer ::], outline)
      associate (n => self%n_piece)
         allocate(self%low(scene%n_dim, n), self%high(scene%n_dim, n), &
            self%least(scene%n_dim, n), self%most(scene%n_dim, n))
         allocate(self%thinnest(n), self%longest(n), self%other(n), self%excused(0))
      end associate
      call overlap_check_smooth(self, scene, contact_options_t())
   end subroutine overlap_check_init

   !> Begin a step of `scene` with the options `options` of contact: what facets stand for.
   subroutine overlap_check_smooth(self, scene, options)
      type(overlap_check_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(contact_options_t), intent(in) :: options

      call self%query%begin(scene, options)
   end subroutine overlap_check_smooth

   !> What overlaps at `u`, and no pair brings together, is left as it is from then on.
   subroutine overlap_check_excuse(self, x, u, overlap)
      type(overlap_check_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      type(overlap_t), intent(out) :: overlap    !! the deepest of these

      if (self%midside%n == 0) then
         call excuse_points(self, x, u, overlap)
      else
         call excuse_points(self, x, midside_points(self%midside, u), overlap)
      end if
   end subroutine overlap_check_excuse

   !> The same, by the displacements of contact points.
   subroutine excuse_points(self, x, u, deepest)
      type(overlap_check_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      type(overlap_t), intent(out) :: deepest
      type(overlap_t) :: overlap
      type(meeting_t), allocatable :: meant(:)
      real(wp) :: rest(size(u, 1), size(u, 2))
      type(box_tree_t) :: tree
      integer :: p, i, n

      allocate(meant(0))
      rest = 0.0_wp
      call place(self, x, u, rest, tree)
      do p = 1, self%n_piece
         call find_later(self, tree, p, n)
         do i = 1, n
            if (self%query%outline%body(p) == self%query%outline%body(self%other(i))) cycle
            if (outline_meets(self%query%outline, p, self%other(i), self%query%acts)) cycle
            overlap = overlap_t()
            call overlap_check_pieces(self, p, self%other(i), x, u, rest, overlap)
            ! Bodies that touch are in each other by round-off, and are not meant to go on.
            if (overlap%depth > touching_bar) meant = [meant, meeting_t(p, self%other(i))]
            if (overlap%depth > deepest%depth) deepest = overlap
         end do
      end do
      self%excused = meant
   end subroutine excuse_points

   !> Where the bodies of the overlap `found` have gone through themselves, which no pair prevents.
   subroutine overlap_check_own(self, x, u, found, own)
      type(overlap_check_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      type(overlap_t), intent(in) :: found       !! of bodies
      type(overlap_t), intent(out) :: own        !! the deepest of one of them in itself

      if (self%midside%n == 0) then
         call own_points(self, x, u, found, own)
      else
         call own_points(self, x, midside_points(self%midside, u), found, own)
      end if
   end subroutine overlap_check_own

   !> The same, by the displacements of contact points.
   subroutine own_points(self, x, u, found, own)
      type(overlap_check_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      type(overlap_t), intent(in) :: found
      type(overlap_t), intent(out) :: own
      real(wp) :: rest(size(u, 1), size(u, 2))
      logical :: is_named(self%n_piece)
      integer :: p, f

      rest = 0.0_wp
      associate (mesh => self%query%outline)
         is_named = .false.
         do p = 1, self%n_piece
            do f = mesh%start(p), mesh%start(p + 1) - 1
               is_named(p) = is_named(p) .or. any(mesh%facet(:, f) > 0 &
                  .and. overlap_names(found, mesh%facet(:, f)))
            end do
         end do
         self%query%is_passing = .false.
         do p = 1, self%n_piece
            if (.not. any(is_named .and. mesh%body == mesh%body(p))) cycle
            if (.not. is_excused(self, p, p)) cycle
            call self%query%place(p, x, u, rest, 1.0_wp)
            call self%query%overlap(p, p, x, self%query%longest(p, x, u), own)
         end do
      end associate
   end subroutine own_points

   !> The deepest overlap in the step from `u0` by `du`.
   subroutine overlap_check_step(self, x, u0, du, overlap)
      type(overlap_check_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)      !! (n_dim, n_node) [L]
      type(overlap_t), intent(out) :: overlap

      if (self%midside%n == 0) then
         call check_points(self, x, u0, du, overlap)
      else
         call check_points(self, x, midside_points(self%midside, u0), &
            midside_points(self%midside, du), overlap)
         self%clearance = self%clearance/midside_stretch(self%midside)
      end if
   end subroutine overlap_check_step

   !> The same, by the displacements of contact points.
   subroutine check_points(self, x, u0, du, overlap)
      type(overlap_check_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)      !! (n_dim, n_node) [L]
      type(overlap_t), intent(out) :: overlap
      type(box_tree_t) :: tree
      integer :: p, i, n
      logical :: is_apart

      self%stray = overlap_t()
      self%clearance = 0.0_wp
      if (self%query%has_walls) call self%query%behind_walls(x, u0 + du, overlap)
      if (self%n_piece == 0) return
      is_apart = .not. self%query%has_walls
      call place(self, x, u0, du, tree)
      do p = 1, self%n_piece
         call find_later(self, tree, p, n)
         do i = 1, n
            if (is_excused(self, p, self%other(i))) cycle
            if (outline_meets(self%query%outline, p, self%other(i), self%query%acts)) then
               call overlap_check_pieces(self, p, self%other(i), x, u0, du, overlap)
            else
               call overlap_check_pieces(self, p, self%other(i), x, u0, du, self%stray)
            end if
            is_apart = .false.
         end do
      end do
      if (is_apart) self%clearance = half_way*least_distance(self)
   end subroutine check_points

   !> Measure all pieces over the step, and put their boxes into a tree.
   pure subroutine place(self, x, u0, du, tree)
      type(overlap_check_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      type(box_tree_t), intent(out) :: tree
      integer :: p

      do p = 1, self%n_piece
         call measure(self, p, x, u0, du)
      end do
      call box_tree_init(tree, self%low, self%high)
   end subroutine place

   !> The pieces from `p` on whose boxes meet that of `p`: the first `n` of `self%other`.
   pure subroutine find_later(self, tree, p, n)
      type(overlap_check_t), intent(inout) :: self
      type(box_tree_t), intent(in) :: tree
      integer, intent(in) :: p
      integer, intent(out) :: n
      integer :: n_found, i

      n_found = 0
      call box_tree_find(tree, self%low(:, p), self%high(:, p), 0.0_wp, self%other, n_found)
      n = 0
      do i = 1, n_found
         if (self%other(i) < p) cycle
         n = n + 1
         self%other(n) = self%other(i)
      end do
   end subroutine find_later

   !> May `p` and `q` overlap, without a pair: as at first, or as parts of one body?
   pure logical function is_excused(self, p, q)
      type(overlap_check_t), intent(in) :: self
      integer, intent(in) :: p, q                !! p <= q

      associate (body => self%query%outline%body)
         is_excused = body(p) == body(q) .or. &
            any(self%excused%first == p .and. self%excused%second == q)
      end associate
      if (is_excused) is_excused = .not. outline_meets(self%query%outline, p, q, self%query%acts)
   end function is_excused

   !> Smallest distance of the boxes of two pieces that are looked at, by the axis where it is
   !> largest.
   pure real(wp) function least_distance(self)
      type(overlap_check_t), intent(in) :: self
      integer :: p, q

      least_distance = huge(least_distance)
      do p = 1, self%n_piece
         do q = p + 1, self%n_piece
            if (is_excused(self, p, q)) cycle
            least_distance = min(least_distance, maxval(max(self%low(:, p) - self%high(:, q), &
               self%low(:, q) - self%high(:, p))))
         end do
      end do
   end function least_distance

   !> Look at two pieces, or one and itself, as often as the step needs.
   subroutine overlap_check_pieces(self, p, q, x, u0, du, overlap)
      type(overlap_check_t), intent(inout) :: self
      integer, intent(in) :: p, q
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      type(overlap_t), intent(inout) :: overlap
      real(wp) :: reach, share
      integer :: k, n

      reach = max(self%longest(p), self%longest(q))
      n = count_looks(self, p, q)
      if (n > 1 .and. self%query%finds_passages) then
         call self%query%pass(p, q, x, u0, du, overlap)
         n = 1
      end if
      do k = 1, n
         share = real(k, wp)/real(n, wp)
         self%query%is_passing = k < n
         call self%query%place(p, x, u0, du, share)
         if (q /= p) call self%query%place(q, x, u0, du, share)
         call self%query%overlap(p, q, x, reach, overlap)
         if (q /= p) call self%query%overlap(q, p, x, reach, overlap)
      end do
   end subroutine overlap_check_pieces

   !> Box, motion and facets of piece `p` over the step.
   pure subroutine measure(self, p, x, u0, du)
      type(overlap_check_t), intent(inout) :: self
      integer, intent(in) :: p
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp) :: here(size(x, 1))
      integer :: f, k

      self%low(:, p) = huge(1.0_wp)
      self%high(:, p) = -huge(1.0_wp)
      self%least(:, p) = huge(1.0_wp)
      self%most(:, p) = -huge(1.0_wp)
      associate (facet => self%query%outline%facet, first => self%query%outline%start(p), &
            last => self%query%outline%start(p + 1) - 1)
         do f = first, last
            do k = 1, size(facet, 1)
               if (facet(k, f) == 0) exit
               associate (move => du(:, facet(k, f)))
                  here = x(:, facet(k, f)) + u0(:, facet(k, f))
                  self%low(:, p) = min(self%low(:, p), here, here + move)
                  self%high(:, p) = max(self%high(:, p), here, here + move)
                  self%least(:, p) = min(self%least(:, p), move)
                  self%most(:, p) = max(self%most(:, p), move)
               end associate
            end do
         end do
         self%thinnest(p) = minval(self%query%outline%thickness(first:last))
      end associate
      self%longest(p) = self%query%longest(p, x, u0)
   end subroutine measure

   !> Looks at the step for two pieces, so that they move by little in between.
   pure integer function count_looks(self, p, q) result(n)
      type(overlap_check_t), intent(in) :: self
      integer, intent(in) :: p, q
      real(wp) :: extent(size(self%most, 1)), motion

      n = 1
      extent = max(self%most(:, p) - self%least(:, q), self%most(:, q) - self%least(:, p))
      motion = sqrt(dot_product(extent, extent))
      associate (least => look_motion*min(self%thinnest(p), self%thinnest(q)))
         if (motion > least) n = ceiling(min(real(most_looks, wp), motion/least))
      end associate
   end function count_looks

end module emcon_overlap_check
