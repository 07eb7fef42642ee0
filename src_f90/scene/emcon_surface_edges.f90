!> The edges of a surface, whatever it is made of.
module emcon_surface_edges
   use emcon_face_edges_plane, only : face_edges, n_face_edge
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: surface_edges, faces_of_edges

contains

   !> The edges of `surface` by their first and last nodes; none for a nodal one. Nodes are 0 in an
   !> element that had errors.
   pure subroutine surface_edges(scene, surface, edge)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, allocatable, intent(out) :: edge(:, :)      !! (2, n_edge)
      integer :: i, n, k

      if (allocated(surface%edge)) then
         allocate(edge, source=surface%edge)
         return
      end if
      n = 0
      if (.not. surface%is_nodal) n = edges_before(scene, surface, size(surface%element) + 1)
      allocate(edge(2, n))
      if (n == 0) return
      n = 0
      do i = 1, size(surface%element)
         associate (e => surface%element(i), kind => scene%element%kinds(scene%element%kind( &
               surface%element(i))))
            associate (new => face_edges(kind, surface%face(i)))
               do k = 1, size(new, 2)
                  edge(:, n + k) = scene%element%node(new(:, k), e)
               end do
            end associate
            n = n + n_face_edge(kind)
         end associate
      end do
   end subroutine surface_edges

   !> Edges of a surface of faces before those of face `i`.
   pure integer function edges_before(scene, surface, i)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, intent(in) :: i                             !! 1 to n_face + 1
      integer :: k

      edges_before = 0
      do k = 1, i - 1
         edges_before = edges_before &
            + n_face_edge(scene%element%kinds(scene%element%kind(surface%element(k))))
      end do
   end function edges_before

   !> The face that each edge of a surface of faces is of.
   pure subroutine faces_of_edges(scene, surface, face)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, allocatable, intent(out) :: face(:)         !! (n_edge) 1 to n_face
      integer :: i, n

      allocate(face(edges_before(scene, surface, size(surface%element) + 1)))
      n = 0
      do i = 1, size(surface%element)
         associate (more => &
            n_face_edge(scene%element%kinds(scene%element%kind(surface%element(i)))))
            face(n + 1:n + more) = i
            n = n + more
         end associate
      end do
   end subroutine faces_of_edges

end module emcon_surface_edges
