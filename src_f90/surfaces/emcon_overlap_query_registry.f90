!> The registry of what looks for overlap: what others see of it. Which kinds there are is known to
!> `emcon_overlap_query_kinds` alone.
module emcon_overlap_query_registry
   use emcon_overlap_query, only : overlap_query_t
   use emcon_scene, only : scene_t
   implicit none
   private
   public :: new_overlap_query

   interface
      !> What looks for overlap in `scene`, for its contact pairs.
      module subroutine new_overlap_query(scene, query)
         type(scene_t), intent(in) :: scene
         class(overlap_query_t), allocatable, intent(out) :: query
      end subroutine new_overlap_query
   end interface

end module emcon_overlap_query_registry
