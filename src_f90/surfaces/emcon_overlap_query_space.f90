!> Do pieces of a mesh in space overlap where they are? Their outlines are triangles: facets split
!> about virtual centres, as contact sees them.
!>
!> Source: docs/theory.md, section 4.11.
module emcon_overlap_query_space
   use emcon_interactions, only : contact_options_t
   use emcon_kinds, only : wp
   use emcon_outline_space, only : outline_space_init
   use emcon_overlap_query, only : overlap_query_t, overlap_t
   use emcon_overlap_space, only : overlap_space_find
   use emcon_scene, only : scene_t
   use emcon_triangles_space, only : triangles_init, triangles_place, triangles_t
   implicit none
   private
   public :: overlap_query_space_t, overlap_query_space_init

   type, extends(overlap_query_t) :: overlap_query_space_t
      type(triangles_t), allocatable :: piece(:) !! (n_piece)
   contains
      procedure :: begin => overlap_query_begin
      procedure :: longest => overlap_query_longest
      procedure :: place => overlap_query_place
      procedure :: overlap => overlap_query_one_way
   end type overlap_query_space_t

contains

   !> Set up for the outlines of `scene`.
   subroutine overlap_query_space_init(self, scene)
      type(overlap_query_space_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      integer :: p

      call outline_space_init(self%outline, scene)
      allocate(self%piece(self%outline%n_piece))
      do p = 1, self%outline%n_piece
         associate (first => self%outline%start(p), last => self%outline%start(p + 1) - 1)
            call triangles_init(self%piece(p), scene%x, self%outline%facet(:, first:last), &
               self%outline%thickness(first:last))
         end associate
      end do
   end subroutine overlap_query_space_init

   !> Facets stand for themselves, whatever the options.
   subroutine overlap_query_begin(self, scene, options)
      class(overlap_query_space_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(contact_options_t), intent(in) :: options

      associate (unused_self => self, unused_scene => scene, unused_options => options)
      end associate
   end subroutine overlap_query_begin

   !> The longest facet of piece `p`, by the roots of areas in the reference.
   pure real(wp) function overlap_query_longest(self, p, x, u) result(longest)
      class(overlap_query_space_t), intent(in) :: self
      integer, intent(in) :: p                   !! from 1
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)     !! (3, n_node) [L]

      associate (unused_x => x, unused_u => u)
         longest = maxval(self%piece(p)%length)
      end associate
   end function overlap_query_longest

   !> Place piece `p`.
   pure subroutine overlap_query_place(self, p, x, u0, du, share)
      class(overlap_query_space_t), intent(inout) :: self
      integer, intent(in) :: p                   !! from 1
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      real(wp), intent(in) :: share              !! of the step that lies behind, 0 to 1

      call triangles_place(self%piece(p), x, u0, du, share)
   end subroutine overlap_query_place

   !> What of piece `p` is inside piece `q`, both placed.
   subroutine overlap_query_one_way(self, p, q, x, reach, overlap)
      class(overlap_query_space_t), intent(inout) :: self
      integer, intent(in) :: p, q                !! from 1
      real(wp), intent(in), contiguous :: x(:, :)  !! (3, n_node) [L]
      real(wp), intent(in) :: reach              !! length of the longest facet of both [L]
      type(overlap_t), intent(inout) :: overlap  !! the deepest so far

      associate (unused_x => x)
         if (p /= q) call overlap_space_find(self%piece(p), self%piece(q), reach, overlap)
      end associate
   end subroutine overlap_query_one_way

end module emcon_overlap_query_space
