!> Do pieces of a mesh in space overlap where they are? Their outlines are triangles: facets split
!> about virtual centres, as contact sees them.
!>
!> Source: docs/theory.md, section 4.15.
module emcon_overlap_query_space
   use emcon_interactions, only : contact_options_t
   use emcon_kinds, only : wp
   use emcon_outline_space, only : outline_space_init
   use emcon_overlap_query, only : overlap_query_t, overlap_t, passing, passing_thin
   use emcon_overlap_space, only : overlap_space_find, overlap_space_own
   use emcon_overlap_walls_space, only : overlap_walls_find, overlap_walls_init, overlap_walls_t
   use emcon_passages_space, only : passage_t, passages_find, way_t
   use emcon_scene, only : scene_t
   use emcon_triangles_space, only : triangles_init, triangles_place, triangles_t
   implicit none
   private
   public :: overlap_query_space_t, overlap_query_space_init

   !> Looks at what goes through within a step, at most.
   integer, parameter :: most_looks = 64

   type, extends(overlap_query_t) :: overlap_query_space_t
      type(triangles_t), allocatable :: piece(:) !! (n_piece)
      type(overlap_walls_t), allocatable :: wall(:)
   contains
      procedure :: begin => overlap_query_begin
      procedure :: longest => overlap_query_longest
      procedure :: place => overlap_query_place
      procedure :: overlap => overlap_query_one_way
      procedure :: pass => overlap_query_pass
      procedure :: behind_walls => overlap_query_walls
   end type overlap_query_space_t

contains

   !> Set up for the outlines of `scene`.
   subroutine overlap_query_space_init(self, scene)
      type(overlap_query_space_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      integer :: p

      self%finds_passages = .true.
      call outline_space_init(self%outline, scene)
      allocate(self%piece(self%outline%n_piece))
      do p = 1, self%outline%n_piece
         associate (first => self%outline%start(p), last => self%outline%start(p + 1) - 1)
            call triangles_init(self%piece(p), scene%x, self%outline%facet(:, first:last), &
               self%outline%thickness(first:last))
         end associate
      end do
      call overlap_walls_init(self%wall, scene, self%outline, self%piece)
      self%has_walls = size(self%wall) > 0
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

   !> What of piece `p` is inside piece `q`, both placed; the same one: in itself.
   subroutine overlap_query_one_way(self, p, q, x, reach, overlap)
      class(overlap_query_space_t), intent(inout) :: self
      integer, intent(in) :: p, q                !! from 1
      real(wp), intent(in), contiguous :: x(:, :)  !! (3, n_node) [L]
      real(wp), intent(in) :: reach              !! length of the longest facet of both [L]
      type(overlap_t), intent(inout) :: overlap  !! the deepest so far

      associate (unused_x => x)
         if (p == q) then
            call overlap_space_own(self%piece(p), overlap)
         else
            call overlap_space_find(self%piece(p), self%piece(q), reach, self%is_passing, overlap)
         end if
      end associate
   end subroutine overlap_query_one_way

   !> What pieces `p` and `q` go through of each other: a look halfway through each passage that
   !> could be deeper than what was found, the longest ones first.
   subroutine overlap_query_pass(self, p, q, x, u0, du, overlap)
      class(overlap_query_space_t), intent(inout) :: self
      integer, intent(in) :: p, q                !! from 1
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (3, n_node) [L]
      type(overlap_t), intent(inout) :: overlap  !! the deepest so far
      type(passage_t), allocatable :: passage(:)
      real(wp) :: shortest, longest, share
      integer :: i, k

      if (p == q) return
      associate (a => self%piece(p), b => self%piece(q))
         shortest = min(minval(a%length), minval(b%length))
         longest = max(maxval(a%length), maxval(b%length))
         call find_passages(a, b, x, u0, du, passage)
         do k = 1, min(size(passage), most_looks)
            i = maxloc(passage%path, dim=1)
            ! Halfway through nothing is deeper than half of its path.
            if (.not. 0.5_wp*passage(i)%path > overlap%depth*shortest) return
            share = 0.5_wp*(passage(i)%from + passage(i)%to)
            call triangles_place(a, x, u0, du, share)
            call triangles_place(b, x, u0, du, share)
            call overlap_space_find(a, b, longest, .true., overlap)
            call overlap_space_find(b, a, longest, .true., overlap)
            where (abs(2.0_wp*share - passage%from - passage%to) <= 0.5_wp*(passage%to &
               - passage%from)) passage%path = 0.0_wp
         end do
      end associate
   end subroutine overlap_query_pass

   pure subroutine overlap_query_walls(self, x, u, overlap)
      class(overlap_query_space_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      type(overlap_t), intent(inout) :: overlap  !! the deepest so far

      call overlap_walls_find(self%wall, self%acts, x, u, overlap)
   end subroutine overlap_query_walls

   !> The passages of two pieces through each other that may be too deep.
   pure subroutine find_passages(a, b, x, u0, du, passage)
      type(triangles_t), intent(inout) :: a, b
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      type(passage_t), allocatable, intent(out) :: passage(:)
      type(way_t) :: way_a, way_b
      real(wp) :: least, drift(3)
      integer :: i

      call find_way(a, way_a)
      call find_way(b, way_b)
      ! What both have in common makes boxes long, and nothing meet.
      drift = sum(way_b%rate, dim=2)/real(size(way_b%rate, 2), wp)
      do i = 1, size(drift)
         way_a%rate(i, :) = way_a%rate(i, :) - drift(i)
         way_b%rate(i, :) = way_b%rate(i, :) - drift(i)
      end do
      least = 2.0_wp*min(passing*min(minval(a%length), minval(b%length)), &
         passing_thin*min(minval(a%thickness), minval(b%thickness)))
      allocate(passage(0))
      call passages_find(a, b, way_a, way_b, least, passage)
      call passages_find(b, a, way_b, way_a, least, passage)

   contains

      pure subroutine find_way(piece, way)
         type(triangles_t), intent(inout) :: piece
         type(way_t), intent(out) :: way

         call triangles_place(piece, x, u0, du, 0.0_wp)
         way%start = piece%at
         call triangles_place(piece, x, u0, du, 1.0_wp)
         way%rate = piece%at - way%start
      end subroutine find_way

   end subroutine find_passages

end module emcon_overlap_query_space
