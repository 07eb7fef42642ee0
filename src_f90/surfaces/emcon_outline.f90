!> The outlines of the pieces of a mesh, and which of them contact pairs bring together.
!>
!> A piece is what hangs together by elements; its outline are the facets that one element alone
!> has. Surfaces without elements stand for themselves.
module emcon_outline
   use emcon_bodies, only : bodies_find, bodies_find_tied
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_sort, only : find_sorted, sort_order, unique_sorted
   use emcon_surface_nodes, only : surface_nodes
   implicit none
   private
   public :: outline_t, pieces_t, outline_meets, pieces_of_facets

   type :: pieces_t
      integer, allocatable :: piece(:)           !! ascending
   end type pieces_t

   type :: outline_t
      integer :: n_piece = 0                     !! 0: nothing can meet
      integer, allocatable :: body(:)            !! (n_piece) number of what ties hold together
      integer, allocatable :: start(:)           !! (n_piece + 1) first facet of each piece
      integer, allocatable :: facet(:, :)        !! (most nodes, n_facet) nodes, piece by piece
      !> (n_facet) shortest side of the element behind it, of one without an element its own [L]
      real(wp), allocatable :: thickness(:)
      type(pieces_t), allocatable :: on(:)       !! (n_surface) pieces that it is on
      integer, allocatable :: pair(:, :)         !! (2, n_pair) surfaces that meet
   end type outline_t

contains

   !> Set up from the facets of all pieces, in any order.
   subroutine pieces_of_facets(self, scene, facet, thickness)
      type(outline_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: facet(:, :)         !! (most nodes, n) nodes; 0: no more
      real(wp), intent(in) :: thickness(:)       !! (n) of the elements behind them [L]
      integer, allocatable :: connected(:, :), piece(:), number(:), order(:), place(:)
      integer :: n_body, i, p

      call connect(scene, connected)
      call bodies_find(connected, size(scene%x, 2), piece, n_body)
      call find_meetings(self, scene, piece, facet, number)
      call find_bodies(self, scene, connected(:, size(scene%element%node, 2) + 1:), piece, number)
      ! From here on the piece of a facet is its place among those that meet; 0: none of them.
      allocate(place(size(facet, 2)))
      do i = 1, size(place)
         place(i) = find_sorted(number, piece(facet(1, i)))
      end do
      order = pack([(i, i = 1, size(place))], place > 0)
      order = order(sort_order(place(order)))
      self%facet = facet(:, order)
      self%thickness = thickness(order)
      allocate(self%start(self%n_piece + 1), source=0)
      self%start(1) = 1
      do i = 1, size(order)
         p = place(order(i))
         self%start(p + 1) = self%start(p + 1) + 1
      end do
      do p = 1, self%n_piece
         self%start(p + 1) = self%start(p + 1) + self%start(p)
      end do
   end subroutine pieces_of_facets

   !> Elements, and after them facets of surfaces without elements, by their nodes.
   pure subroutine connect(scene, connected)
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: connected(:, :)   !! (n, n_element + n_facet), 0: no node
      integer, allocatable :: own(:, :), spread(:, :)
      integer :: n, s

      connected = scene%element%node
      do s = 1, size(scene%surface)
         if (.not. allocated(scene%surface(s)%edge)) cycle
         own = scene%surface(s)%edge
         n = size(connected, 2)
         allocate(spread(max(size(connected, 1), size(own, 1)), n + size(own, 2)), source=0)
         spread(:size(connected, 1), :n) = connected
         spread(:size(own, 1), n + 1:) = own
         call move_alloc(spread, connected)
      end do
   end subroutine connect

   !> The pieces that have facets, unless there is a single one and no pair, and which surfaces
   !> meet.
   subroutine find_meetings(self, scene, piece, facet, number)
      type(outline_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: piece(:)            !! (n_node)
      integer, intent(in) :: facet(:, :)         !! (most nodes, n_facet)
      integer, allocatable, intent(out) :: number(:)   !! (n_piece) as in `piece`, ascending
      integer, allocatable :: node(:)
      integer :: s, i

      associate (pair => scene%pair)
         self%pair = reshape([pair%slave, pair%master], [2, size(pair)], order=[2, 1])
      end associate
      allocate(self%on(size(scene%surface)))
      do s = 1, size(scene%surface)
         allocate(self%on(s)%piece(0))
         if (.not. any(self%pair == s)) cycle
         call surface_nodes(scene, scene%surface(s), node)
         self%on(s)%piece = unique_sorted(piece(node))
      end do
      number = unique_sorted(piece(facet(1, :)))
      if (size(scene%pair) == 0 .and. size(number) < 2) number = [integer ::]
      self%n_piece = size(number)
      do s = 1, size(scene%surface)
         associate (on => self%on(s)%piece)
            on = [(find_sorted(number, on(i)), i = 1, size(on))]
         end associate
      end do
   end subroutine find_meetings

   !> The bodies of the pieces: what hangs together by ties, too.
   subroutine find_bodies(self, scene, lone, piece, number)
      type(outline_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: lone(:, :)          !! (n, n_facet) of surfaces; 0: no node
      integer, intent(in) :: piece(:)            !! (n_node)
      integer, intent(in) :: number(:)           !! (n_piece) as in `piece`, ascending
      integer, allocatable :: body(:)
      integer :: n_body, i, p

      allocate(self%body(self%n_piece), source=0)
      if (self%n_piece == 0) return
      call bodies_find_tied(scene, lone, body, n_body)
      do i = 1, size(piece)
         p = find_sorted(number, piece(i))
         if (p > 0) self%body(p) = body(i)
      end do
   end subroutine find_bodies

   !> Does a contact pair that acts bring pieces `p` and `q` together?
   pure logical function outline_meets(self, p, q, acts) result(meets)
      type(outline_t), intent(in) :: self
      integer, intent(in) :: p, q                !! 1..n_piece
      logical, intent(in) :: acts(:)             !! (n_pair)
      integer :: k

      meets = .true.
      do k = 1, size(self%pair, 2)
         if (.not. acts(k)) cycle
         associate (slave => self%on(self%pair(1, k))%piece, &
               master => self%on(self%pair(2, k))%piece)
            if (find_sorted(slave, p) > 0 .and. find_sorted(master, q) > 0) return
            if (find_sorted(slave, q) > 0 .and. find_sorted(master, p) > 0) return
         end associate
      end do
      meets = .false.
   end function outline_meets

end module emcon_outline
