!> Are nodes of a mesh behind walls that pairs bring them together with?
!>
!> All nodes of the outlines of the slave's pieces are looked at, at the end of a step. Between them
!> faces may be deeper behind a wall that bulges, by what they are off its curve, and less behind
!> one that is hollow.
module emcon_overlap_walls_space
   use emcon_kinds, only : wp
   use emcon_outline, only : outline_t
   use emcon_overlap_query, only : overlap_t
   use emcon_scene, only : scene_t
   use emcon_sort, only : unique_sorted
   use emcon_triangles_space, only : triangles_t
   use emcon_wall, only : wall_t
   use emcon_wall_distance_space, only : wall_at, wall_ends_here, wall_find, wall_is_solid, &
      wall_spot_t
   implicit none
   private
   public :: overlap_walls_t, overlap_walls_init, overlap_walls_find

   !> A wall and what may not be behind it.
   type :: overlap_walls_t
      type(wall_t) :: wall
      integer :: of_pair = 0                     !! of the scene
      integer, allocatable :: node(:)            !! of the scene, ascending
      real(wp), allocatable :: length(:)         !! (n_node) of the facets at each, the longest [L]
   end type overlap_walls_t

contains

   !> The walls that are masters of pairs, each with the pieces of its slave.
   subroutine overlap_walls_init(self, scene, outline, piece)
      type(overlap_walls_t), allocatable, intent(out) :: self(:)   !! one for each such pair
      type(scene_t), intent(in) :: scene
      type(outline_t), intent(in) :: outline
      type(triangles_t), intent(in) :: piece(:)  !! (n_piece) of the outline
      logical :: is_wall(size(scene%pair))
      integer :: i, k

      is_wall = [(allocated(scene%surface(scene%pair(i)%master)%wall), i = 1, size(scene%pair))]
      associate (of => pack([(i, i = 1, size(is_wall))], is_wall))
         allocate(self(size(of)))
         do k = 1, size(of)
            associate (pair => scene%pair(of(k)))
               self(k)%of_pair = of(k)
               self(k)%wall = scene%surface(pair%master)%wall
               call find_nodes(outline, piece, outline%on(pair%slave)%piece, self(k))
            end associate
         end do
      end associate
   end subroutine overlap_walls_init

   !> The nodes of pieces, and how large their facets are there.
   subroutine find_nodes(outline, piece, of, self)
      type(outline_t), intent(in) :: outline
      type(triangles_t), intent(in) :: piece(:)
      integer, intent(in) :: of(:)               !! of the pieces; 0: one without facets
      type(overlap_walls_t), intent(inout) :: self
      real(wp) :: longest(0:maxval([0, outline%facet]))
      integer :: f, k

      longest = 0.0_wp
      do k = 1, size(of)
         if (of(k) == 0) cycle
         associate (first => outline%start(of(k)), last => outline%start(of(k) + 1) - 1)
            do f = first, last
               associate (node => outline%facet(:, f))
                  longest(node) = max(longest(node), piece(of(k))%length(f - first + 1))
               end associate
            end do
         end associate
      end do
      longest(0) = 0.0_wp
      self%node = unique_sorted(pack([(k, k = 0, ubound(longest, 1))], longest > 0.0_wp))
      self%length = longest(self%node)
   end subroutine find_nodes

   !> The deepest node at x + u, if it is deeper than what was found.
   pure subroutine overlap_walls_find(self, acts, x, u, overlap)
      type(overlap_walls_t), intent(in) :: self(:)           !! set up
      logical, intent(in) :: acts(:)             !! (n_pair) others are not looked at
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node) [L]
      type(overlap_t), intent(inout) :: overlap  !! the deepest so far
      type(wall_spot_t) :: spot
      integer :: i, k

      do k = 1, size(self)
         if (.not. acts(self(k)%of_pair)) cycle
         associate (wall => self(k)%wall, at => wall_at(self(k)%wall, x, u))
            do i = 1, size(self(k)%node)
               associate (node => self(k)%node(i), length => self(k)%length(i))
                  spot = wall_find(wall, at, x(:, node) + u(:, node))
                  if (.not. -spot%distance > overlap%depth*length) cycle
                  if (wall_ends_here(wall, spot)) cycle
                  if (.not. wall_is_solid(wall) .and. spot%distance < -0.5_wp*wall%extent) cycle
                  overlap%depth = -spot%distance/length
                  overlap%length = length
                  overlap%thickness = huge(length)
                  overlap%node = node
                  overlap%is_beside = .false.
                  overlap%facet = 0
                  overlap%facet(1) = wall%node(1)
               end associate
            end do
         end associate
      end do
   end subroutine overlap_walls_find

end module emcon_overlap_walls_space
