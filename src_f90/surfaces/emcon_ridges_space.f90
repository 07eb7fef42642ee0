!> The sharp edges of the bodies behind a surface in space, as contact of edges needs them.
!>
!> A surface may end where its body goes on: whether an edge of it is sharp, and which faces meet in
!> it, is told by the outer faces of the elements. Source: docs/theory.md, section 15.
module emcon_ridges_space
   use emcon_errors, only : error_t
   use emcon_facet_groups, only : ridge_angle, ridges_find, ridges_t
   use emcon_facet_split, only : facet_split_centre
   use emcon_facets, only : facets_init, facets_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_outline_space, only : outline_faces_at
   use emcon_rotation, only : cross_product
   use emcon_scene, only : scene_t
   use emcon_sort, only : find_sorted
   use emcon_surface_nodes, only : surface_nodes
   implicit none
   private
   public :: sharp_edges_t, sharp_edges_init, sharp_edge_normals

   type :: sharp_edges_t
      integer, allocatable :: node(:, :)         !! (2, n) of the scene, as the first face runs
      !> (most nodes, 2, n) nodes of both faces at each edge, in turn; 0: no more
      integer, allocatable :: face(:, :, :)
   end type sharp_edges_t

contains

   !> The convex edges of the outline with both ends on `surface`, faces of which turn there by more
   !> than 20 degrees in the reference.
   subroutine sharp_edges_init(self, scene, surface)
      type(sharp_edges_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      type(facets_t) :: own
      type(facets_t), allocatable :: outer
      type(ridges_t) :: ridges
      type(error_t), allocatable :: error
      logical, allocatable :: is_kept(:)
      integer :: i

      call facets_init(own, scene, surface, error)
      if (.not. allocated(error)) call find_outer(scene, own, outer, error)
      ! A mesh that touches itself in an edge has no outline there but its surface.
      if (allocated(error) .or. .not. allocated(outer)) outer = own
      call ridges_find(ridges, outer, scene%x, ridge_angle)
      allocate(is_kept(size(ridges%point, 2)))
      do i = 1, size(is_kept)
         is_kept(i) = all([find_sorted(own%node, outer%node(ridges%point(1, i))), &
            find_sorted(own%node, outer%node(ridges%point(2, i)))] > 0)
      end do
      call leave_out_ties(scene, outer, ridges, is_kept)
      associate (kept => pack([(i, i = 1, size(is_kept))], is_kept))
         allocate(self%node(2, size(kept)), self%face(size(outer%facet, 1), 2, size(kept)))
         do i = 1, size(kept)
            self%node(:, i) = outer%node(ridges%point(:, kept(i)))
            self%face(:, :, i) = outer%facet(:, ridges%facet(:, kept(i)))
         end do
      end associate
   end subroutine sharp_edges_init

   !> An edge of a face that is tied is not one of the body, which goes on there.
   pure subroutine leave_out_ties(scene, outer, ridges, is_kept)
      type(scene_t), intent(in) :: scene
      type(facets_t), intent(in) :: outer
      type(ridges_t), intent(in) :: ridges
      logical, intent(inout) :: is_kept(:)       !! (n_ridge)
      logical :: is_tied(0:size(scene%x, 2))
      integer, allocatable :: node(:)
      integer :: i, k, side, t

      do t = 1, size(scene%tie)
         do side = 1, 2
            call surface_nodes(scene, scene%surface(merge(scene%tie(t)%slave, &
               scene%tie(t)%master, side == 1)), node)
            is_tied = .false.
            is_tied(0) = .true.
            is_tied(node) = .true.
            do i = 1, size(is_kept)
               do k = 1, 2
                  if (all(is_tied(outer%facet(:, ridges%facet(k, i))))) is_kept(i) = .false.
               end do
            end do
         end do
      end do
   end subroutine leave_out_ties

   !> The outer faces of elements around the nodes of a surface; not allocated where there are none.
   subroutine find_outer(scene, own, outer, error)
      type(scene_t), intent(in) :: scene
      type(facets_t), intent(in) :: own
      type(facets_t), allocatable, intent(out) :: outer
      type(error_t), allocatable, intent(out) :: error
      type(surface_t) :: faces

      call outline_faces_at(scene, own%node, faces%edge)
      if (size(faces%edge, 2) == 0) return
      allocate(outer)
      call facets_init(outer, scene, faces, error)
   end subroutine find_outer

   !> The outward normals of both faces at edge `i`, not of unit length, at x + u: each of the
   !> triangle of the edge and the virtual centre of its face.
   pure function sharp_edge_normals(self, i, x, u) result(normal)
      type(sharp_edges_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1 to n
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (3, n_node of the scene) [L]
      real(wp) :: normal(3, 2)                   !! [L^2]
      integer :: k

      associate (from => self%node(1, i), to => self%node(2, i))
         do k = 1, 2
            ! The second face runs along the edge the other way.
            normal(:, k) = real(3 - 2*k, wp)*cross_product(way(to), to_middle(k))
         end do
      end associate

   contains

      !> From the first node of the edge to another one, differences first.
      pure function way(node)
         integer, intent(in) :: node
         real(wp) :: way(3)

         associate (from => self%node(1, i))
            way = (x(:, node) - x(:, from)) + (u(:, node) - u(:, from))
         end associate
      end function way

      !> From there to the middle of face `k`.
      pure function to_middle(k) result(middle)
         integer, intent(in) :: k
         real(wp) :: middle(3)
         integer :: j, n

         n = count(self%face(:, k, i) > 0)
         associate (weight => facet_split_centre(n))
            middle = 0.0_wp
            do j = 1, n
               middle = middle + weight(j)*way(self%face(j, k, i))
            end do
         end associate
      end function to_middle

   end function sharp_edge_normals

end module emcon_ridges_space
