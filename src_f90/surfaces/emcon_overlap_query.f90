!> Do pieces of a mesh overlap where they are? What is asked, whatever the dimension is.
!>
!> Pieces are placed, then looked at one way: what of one is inside the other. Source:
!> docs/theory.md, section 4.11.
module emcon_overlap_query
   use emcon_element_kind, only : max_face_nodes
   use emcon_interactions, only : contact_options_t
   use emcon_kinds, only : wp
   use emcon_outline, only : outline_t
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: overlap_t, overlap_names, overlap_query_t, overlap_text, &
      passing, passing_thin

   !> On the way, overlap below the smaller of these, by the facet and by the thickness of the
   !> element behind it, is the straight way past a corner.
   real(wp), parameter :: passing = 0.1_wp, passing_thin = 0.2_wp

   !> The deepest overlap that was found.
   type :: overlap_t
      real(wp) :: depth = 0.0_wp                 !! per length of the facet; 0: none
      real(wp) :: length = 0.0_wp                !! of the facet [L]
      real(wp) :: thickness = huge(1.0_wp)       !! of the element behind it; huge: of a wall [L]
      integer :: node = 0                        !! that is behind, or the nearest on its facet:
      logical :: is_beside = .false.             !! a point beside it is, of an edge or a face
      integer :: facet(max_face_nodes) = 0       !! nodes of the facet that it is behind; 0: no more
      !> The deepest one of facets as they are, where they stand for curves.
      real(wp) :: of_facets = 0.0_wp
   end type overlap_t

   type, abstract :: overlap_query_t
      type(outline_t) :: outline
      logical :: is_passing = .false.            !! it is on the way, not at the end of a step
      !> What goes through within a step is found by `pass`, not by looks at equal parts of it.
      logical :: finds_passages = .false.
      logical :: has_walls = .false.             !! surfaces without facets are looked at too
      logical, allocatable :: acts(:)            !! (n_pair) of the scene, in the present step
   contains
      procedure(begin_interface), deferred :: begin
      procedure(longest_interface), deferred :: longest
      procedure(place_interface), deferred :: place
      procedure(overlap_interface), deferred :: overlap
      procedure :: pass
      procedure :: behind_walls
      procedure :: take_pairs
      procedure :: has_idle
   end type overlap_query_t

   abstract interface
      !> Begin a step with the options `options` of contact: what facets stand for.
      subroutine begin_interface(self, scene, options)
         import :: contact_options_t, overlap_query_t, scene_t
         class(overlap_query_t), intent(inout) :: self
         type(scene_t), intent(in) :: scene
         type(contact_options_t), intent(in) :: options
      end subroutine begin_interface

      !> The longest facet of piece `p` at x + u [L].
      pure real(wp) function longest_interface(self, p, x, u)
         import :: overlap_query_t, wp
         class(overlap_query_t), intent(in) :: self
         integer, intent(in) :: p                !! 1..n_piece
         real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      end function longest_interface

      !> Place piece `p`.
      pure subroutine place_interface(self, p, x, u0, du, share)
         import :: overlap_query_t, wp
         class(overlap_query_t), intent(inout) :: self
         integer, intent(in) :: p                !! 1..n_piece
         real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
         real(wp), intent(in) :: share           !! of the step that lies behind, 0 to 1
      end subroutine place_interface

      !> What of piece `p` is inside piece `q`, both placed; the same one: in itself.
      subroutine overlap_interface(self, p, q, x, reach, overlap)
         import :: overlap_query_t, overlap_t, wp
         class(overlap_query_t), intent(inout) :: self
         integer, intent(in) :: p, q             !! 1..n_piece
         real(wp), intent(in), contiguous :: x(:, :)      !! (n_dim, n_node) [L]
         real(wp), intent(in) :: reach           !! length of the longest facet of both [L]
         type(overlap_t), intent(inout) :: overlap        !! the deepest so far
      end subroutine overlap_interface
   end interface

contains

   !> What pieces `p` and `q` go through of each other within a step: nothing, if parts of it are
   !> looked at.
   subroutine pass(self, p, q, x, u0, du, overlap)
      class(overlap_query_t), intent(inout) :: self
      integer, intent(in) :: p, q                !! 1..n_piece
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (n_dim, n_node) [L]
      type(overlap_t), intent(inout) :: overlap  !! the deepest so far

      associate (unused_self => self, unused_p => p, unused_q => q, unused_x => x, &
            unused_u0 => u0, unused_du => du, unused_overlap => overlap)
      end associate
   end subroutine pass

   !> What is behind walls at x + u: nothing, where there are none.
   pure subroutine behind_walls(self, x, u, overlap)
      class(overlap_query_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) [L]
      type(overlap_t), intent(inout) :: overlap  !! the deepest so far

      associate (unused_self => self, unused_x => x, unused_u => u, unused_overlap => overlap)
      end associate
   end subroutine behind_walls

   !> A step begins in which some pairs act.
   pure subroutine take_pairs(self, acts)
      class(overlap_query_t), intent(inout) :: self
      logical, intent(in) :: acts(:)             !! (n_pair) of the scene

      self%acts = acts
   end subroutine take_pairs

   !> Is there a pair that does not act?
   pure logical function has_idle(self)
      class(overlap_query_t), intent(in) :: self

      has_idle = .not. all(self%acts)
   end function has_idle

   !> Does the overlap stand on `node`?
   elemental logical function overlap_names(self, node)
      type(overlap_t), intent(in) :: self
      integer, intent(in) :: node                !! of the scene

      overlap_names = node == self%node .or. any(node == self%facet)
   end function overlap_names

   !> The bodies and nodes of an overlap, and how deep it is as a length. A host has no bodies.
   subroutine overlap_text(self, label, body, text)
      type(overlap_t), intent(in) :: self
      integer, intent(in) :: label(:), body(:)   !! (n_node) the user's numbers, bodies from 1
      character(len=:), allocatable, intent(out) :: text   !! one line
      logical :: has_bodies
      integer :: k

      has_bodies = any(body > 0)
      associate (facet => self%facet)
         text = "a point of an analytical surface"
         if (body(self%node) > 0 .or. .not. has_bodies) text = "node " // &
            to_text(label(self%node))
         if (body(self%node) > 0) text = text // " of body " // to_text(body(self%node))
         if (self%is_beside) text = "a point beside " // text
         text = text // " is " // to_text(self%depth*self%length, 3) // " behind "
         if ((body(facet(1)) == 0 .and. has_bodies) .or. count(facet > 0) == 1) then
            text = text // "an analytical surface"
            return
         end if
         if (facet(3) == 0) then
            text = text // "the edge from node " // to_text(label(facet(1))) // " to " // &
               to_text(label(facet(count(facet > 0))))
         else
            text = text // "the face of nodes " // to_text(label(facet(1)))
            do k = 2, count(facet > 0)
               text = text // ", " // to_text(label(facet(k)))
            end do
         end if
         if (has_bodies) text = text // " of body " // to_text(body(facet(1)))
      end associate
   end subroutine overlap_text

end module emcon_overlap_query
