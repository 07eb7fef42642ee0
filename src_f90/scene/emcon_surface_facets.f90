!> The facets of a surface, whatever it is made of: edges in the plane, faces in space.
module emcon_surface_facets
   use emcon_face_facets, only : face_facets, n_face_facet, n_facet_node
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use emcon_sort, only : unique_sorted
   implicit none
   private
   public :: surface_facets, facet_nodes, faces_of_facets, profile_facets

contains

   !> The facets of `surface` by their nodes, as `face_facets` has them; none for a nodal one. Nodes
   !> are 0 in an element that had errors, and behind the last one of a facet.
   pure subroutine surface_facets(scene, surface, facet)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, allocatable, intent(out) :: facet(:, :)     !! (most nodes, n_facet)
      integer :: i, n, k

      if (allocated(surface%edge)) then
         allocate(facet, source=surface%edge)
         return
      end if
      if (.not. allocated(surface%element)) then
         allocate(facet(scene%n_dim, 0))
         return
      end if
      associate (kind => scene%element%kind(surface%element))
         allocate(facet(maxval([scene%n_dim, n_facet_node(scene%element%kinds(kind))]), &
            sum(n_face_facet(scene%element%kinds(kind)))), source=0)
      end associate
      n = 0
      do i = 1, size(surface%element)
         associate (e => surface%element(i), kind => scene%element%kinds(scene%element%kind( &
               surface%element(i))))
            associate (new => face_facets(kind, surface%face(i)))
               do k = 1, size(new, 2)
                  facet(:size(new, 1), n + k) = scene%element%node(new(:, k), e)
               end do
            end associate
            n = n + n_face_facet(kind)
         end associate
      end do
   end subroutine surface_facets

   !> The nodes of `surface` that its facets have; of a nodal one those that it names.
   pure subroutine facet_nodes(surface, facet, node)
      type(surface_t), intent(in) :: surface
      integer, intent(in) :: facet(:, :)                   !! of `surface_facets`
      integer, allocatable, intent(out) :: node(:)         !! ascending

      node = pack(facet, facet > 0)
      if (allocated(surface%node)) node = [node, surface%node]
      node = unique_sorted(node)
   end subroutine facet_nodes

   !> The facets of all profiles, which no element shows.
   pure subroutine profile_facets(scene, facet)
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: facet(:, :)     !! (n_dim, n_facet)
      integer, allocatable :: more(:, :), node(:)
      integer :: i

      allocate(node(0))
      do i = 1, size(scene%surface)
         if (.not. scene%surface(i)%is_profile) cycle
         call surface_facets(scene, scene%surface(i), more)
         node = [node, more]
      end do
      facet = reshape(node, [scene%n_dim, size(node)/scene%n_dim])
   end subroutine profile_facets

   !> The face that each facet of a surface of faces is of.
   pure subroutine faces_of_facets(scene, surface, face)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, allocatable, intent(out) :: face(:)         !! (n_facet) 1 to n_face
      integer :: i, n

      allocate(face(sum(n_face_facet(scene%element%kinds(scene%element%kind(surface%element))))))
      n = 0
      do i = 1, size(surface%element)
         associate (more => &
            n_face_facet(scene%element%kinds(scene%element%kind(surface%element(i)))))
            face(n + 1:n + more) = i
            n = n + more
         end associate
      end do
   end subroutine faces_of_facets

end module emcon_surface_facets
