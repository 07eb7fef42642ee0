!> The faces of a slave surface in space, and which of their nodes it means.
module emcon_slave_faces_space
   use emcon_errors, only : err_input, error_t, raise
   use emcon_facets, only : facets_init, facets_t
   use emcon_mesh, only : surface_t
   use emcon_outline_space, only : outline_faces_at
   use emcon_scene, only : scene_t, where_text
   use emcon_sort, only : find_sorted, unique_sorted
   use emcon_text, only : to_text
   implicit none
   private
   public :: slave_faces_init

contains

   !> The faces of `surface`, of which all nodes are meant. Nodes that are named without faces stand
   !> on those of elements, and of the nodes of these they alone are meant.
   subroutine slave_faces_init(self, scene, surface, is_meant, error)
      type(facets_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      logical, allocatable, intent(out) :: is_meant(:)       !! (n_node of `self`)
      type(error_t), allocatable, intent(out) :: error
      type(surface_t) :: faces
      integer, allocatable :: named(:)
      logical :: is_nodal
      integer :: i

      faces = surface
      is_nodal = allocated(surface%node) .and. .not. allocated(surface%edge)
      if (is_nodal .and. allocated(surface%element)) is_nodal = size(surface%element) == 0
      if (is_nodal) then
         named = unique_sorted(surface%node)
         call outline_faces_at(scene, surface%node, faces%edge)
         deallocate(faces%node)
      end if
      call facets_init(self, scene, faces, error)
      if (allocated(error)) return
      allocate(is_meant(size(self%node)), source=.true.)
      if (.not. is_nodal) return
      is_meant = [(find_sorted(named, self%node(i)) > 0, i = 1, size(self%node))]
      do i = 1, size(named)
         if (find_sorted(self%node, named(i)) > 0) cycle
         call raise(error, err_input, where_text(scene, surface%origin) // ": node " // &
            to_text(scene%node%label(named(i))) // " of surface " // surface%name // &
            " is on no outer face of an element, which its gap needs; leave it out")
         return
      end do
   end subroutine slave_faces_init

end module emcon_slave_faces_space
