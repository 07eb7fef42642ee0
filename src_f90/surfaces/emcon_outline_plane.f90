!> The outlines of the pieces of a mesh, whatever surfaces the deck names, and which of them contact
!> pairs bring together.
!>
!> A piece is what hangs together by elements; its outline are the faces that one element alone has,
!> the body to the left. What a tie covers is no outline; where it ends, two pieces meet in one
!> place, as neighbours do. Surfaces of edges without elements stand for themselves.
module emcon_outline_plane
   use emcon_chain_plane, only : chain_init, chain_t
   use emcon_errors, only : error_t
   use emcon_seams_plane, only : chain_join
   use emcon_face_facets, only : face_facets, n_face_facet
   use emcon_kinds, only : dp, wp
   use emcon_mesh, only : surface_t
   use emcon_outline, only : outline_t, pieces_of_facets
   use emcon_scene, only : scene_t
   use emcon_sort, only : sort_order
   use emcon_surface_facets, only : profile_facets
   use emcon_tied_edges, only : tied_edges_find, tied_ends_find
   implicit none
   private
   public :: outline_init, outline_links_t

   !> How the edges of outlines hang together, from their first to their last node.
   type :: outline_links_t
      !> (2, n_edge) the ends by their places: nodes, but one number for both nodes of a joint
      integer, allocatable :: place(:, :)
      !> (2, n_edge) the edges before and after; 0: the outline ends there, or branches
      integer, allocatable :: link(:, :)
      integer, allocatable :: host(:)            !! (n_node) edge that a tied end stands on; 0: none
      logical, allocatable :: is_buried(:)       !! (n_node) under a tied piece
      logical, allocatable :: is_profile(:)      !! (n_edge) a part of a line or arc of a profile
   end type outline_links_t

contains

   subroutine outline_init(self, links, scene)
      type(outline_t), intent(out) :: self
      type(outline_links_t), intent(out) :: links
      type(scene_t), intent(in) :: scene
      integer, allocatable :: edge(:, :)
      real(wp), allocatable :: thickness(:)

      call find_free_edges(scene, edge, thickness)
      call pieces_of_facets(self, scene, edge, thickness)
      call link_edges(links, self%facet, size(scene%x, 2))
      call find_places(links, self%facet, scene)
      call tied_ends_find(scene, self%facet, links%host, links%is_buried)
      call find_profiles(links, self%facet, scene)
   end subroutine outline_init

   !> Nodes of profiles are of nothing else.
   pure subroutine find_profiles(self, edge, scene)
      type(outline_links_t), intent(inout) :: self
      integer, intent(in) :: edge(:, :)          !! (2, n_edge)
      type(scene_t), intent(in) :: scene
      logical :: is_of(size(scene%x, 2))
      integer, allocatable :: of_profiles(:, :)

      call profile_facets(scene, of_profiles)
      is_of = .false.
      is_of(of_profiles(1, :)) = .true.
      self%is_profile = is_of(edge(1, :))
   end subroutine find_profiles

   !> The edges that one element alone has, but those that a tie covers; in space there are none.
   subroutine find_free_edges(scene, edge, thickness)
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: edge(:, :)  !! (2, n)
      real(wp), allocatable, intent(out) :: thickness(:)   !! (n) of the elements behind [L]
      logical, allocatable :: is_tied(:)
      integer :: k

      if (scene%n_dim /= 2) then
         allocate(edge(2, 0), thickness(0))
         return
      end if
      call find_edges(scene, edge, thickness)
      call tied_edges_find(scene, edge, is_tied)
      edge = edge(:, pack([(k, k = 1, size(is_tied))], .not. is_tied))
      thickness = pack(thickness, .not. is_tied)
   end subroutine find_free_edges

   !> Faces that one element alone has, and edges of surfaces that no element has.
   subroutine find_edges(scene, edge, thickness)
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: edge(:, :)  !! (2, n)
      real(wp), allocatable, intent(out) :: thickness(:)   !! (n) [L]
      integer, allocatable :: order(:)
      real(dp), allocatable :: key(:)
      logical, allocatable :: is_free(:)
      integer :: e, f, k, n

      n = 0
      do e = 1, size(scene%element%kind)
         associate (kind => scene%element%kinds(scene%element%kind(e)))
            n = n + kind%n_face*n_face_facet(kind)
         end associate
      end do
      allocate(edge(2, n))
      n = 0
      allocate(thickness(size(edge, 2)))
      do e = 1, size(scene%element%kind)
         associate (kind => scene%element%kinds(scene%element%kind(e)))
            do f = 1, kind%n_face
               associate (new => face_facets(kind, f), before => n + (f - 1)*n_face_facet(kind))
                  do k = 1, size(new, 2)
                     edge(:, before + k) = scene%element%node(new(:, k), e)
                  end do
               end associate
            end do
            k = n + kind%n_face*n_face_facet(kind)
            thickness(n + 1:k) = minval(lengths(scene, edge(:, n + 1:k)))
            n = k
         end associate
      end do
      key = real(minval(edge, 1), dp)*real(size(scene%x, 2) + 1, dp) + real(maxval(edge, 1), dp)
      order = sort_order(key)
      allocate(is_free(n), source=.true.)
      do e = 2, n
         if (key(order(e)) > key(order(e - 1))) cycle
         is_free(order(e - 1:e)) = .false.
      end do
      edge = edge(:, pack([(e, e = 1, n)], is_free))
      thickness = pack(thickness, is_free)
      call add_lone_edges(scene, edge, thickness)
   end subroutine find_edges

   !> Append the edges of surfaces of edges that are no faces of elements.
   pure subroutine add_lone_edges(scene, edge, thickness)
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(inout) :: edge(:, :)      !! (2, n)
      real(wp), allocatable, intent(inout) :: thickness(:)   !! (n) [L]
      integer, allocatable :: lone(:, :)
      integer :: follower(size(scene%x, 2)), s, i

      follower = 0
      follower(edge(1, :)) = edge(2, :)
      do s = 1, size(scene%surface)
         if (.not. allocated(scene%surface(s)%edge)) cycle
         associate (all => scene%surface(s)%edge)
            lone = all(:, pack([(i, i = 1, size(all, 2))], follower(all(1, :)) /= all(2, :)))
         end associate
         follower(lone(1, :)) = lone(2, :)
         thickness = [thickness, lengths(scene, lone)]
         edge = reshape([edge, lone], [2, size(edge, 2) + size(lone, 2)])
      end do
   end subroutine add_lone_edges

   pure function lengths(scene, edge) result(length)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: edge(:, :)          !! (2, n)
      real(wp) :: length(size(edge, 2))

      length = sqrt(sum((scene%x(:, edge(2, :)) - scene%x(:, edge(1, :)))**2, dim=1))
   end function lengths

   !> Find the neighbours of each edge. Where two outlines meet in a node, neither goes on.
   pure subroutine link_edges(self, edge, n_node)
      type(outline_links_t), intent(inout) :: self
      integer, intent(in) :: edge(:, :)          !! (2, n_edge)
      integer, intent(in) :: n_node
      integer :: ends(n_node), begins(n_node), i

      ends = 0
      begins = 0
      do i = 1, size(edge, 2)
         associate (a => edge(1, i), b => edge(2, i))
            begins(a) = merge(i, -1, begins(a) == 0)
            ends(b) = merge(i, -1, ends(b) == 0)
         end associate
      end do
      allocate(self%link(2, size(edge, 2)))
      do i = 1, size(edge, 2)
         associate (a => edge(1, i), b => edge(2, i))
            self%link(1, i) = merge(max(0, ends(a)), 0, begins(a) > 0)
            self%link(2, i) = merge(max(0, begins(b)), 0, ends(b) > 0)
         end associate
      end do
   end subroutine link_edges

   !> The places of the ends: pieces tied to each other have joints where their outlines go on.
   subroutine find_places(self, edge, scene)
      type(outline_links_t), intent(inout) :: self
      integer, intent(in) :: edge(:, :)          !! (2, n_edge)
      type(scene_t), intent(in) :: scene
      type(surface_t) :: surface
      type(chain_t) :: chain
      type(error_t), allocatable :: error
      integer :: place(size(scene%x, 2)), begins(size(scene%x, 2)), ends(size(scene%x, 2)), i, k

      self%place = edge
      if (size(scene%tie) == 0) return
      if (any(scene%tie%slave == 0)) return            ! known by its rows alone
      begins = 0
      ends = 0
      do i = 1, size(edge, 2)
         begins(edge(1, i)) = begins(edge(1, i)) + 1
         ends(edge(2, i)) = ends(edge(2, i)) + 1
      end do
      associate (most => max(begins, ends))
         surface%name = ""
         surface%edge = edge(:, pack([(i, i = 1, size(edge, 2))], &
            most(edge(1, :)) == 1 .and. most(edge(2, :)) == 1))
      end associate
      call chain_init(chain, scene, surface, error)
      if (allocated(error)) return
      call chain_join(chain, scene)
      place = [(i, i = 1, size(place))]
      do k = 1, size(chain%node)
         if (chain%duplicate(k) > 0) place(chain%duplicate(k)) = chain%node(k)
      end do
      do i = 1, size(edge, 2)
         self%place(:, i) = place(edge(:, i))
      end do
   end subroutine find_places

end module emcon_outline_plane
