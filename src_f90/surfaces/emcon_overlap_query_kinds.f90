!> What looks for overlap: one case for each dimension, for the plane and for space.
submodule (emcon_overlap_query_registry) emcon_overlap_query_kinds
   use emcon_overlap_query_plane, only : overlap_query_plane_t, overlap_query_plane_init
   use emcon_overlap_query_space, only : overlap_query_space_t, overlap_query_space_init
   implicit none

contains

   module procedure new_overlap_query
      type(overlap_query_plane_t), allocatable :: plane
      type(overlap_query_space_t), allocatable :: space

      if (size(scene%x, 1) == 2) then
         allocate(plane)
         call overlap_query_plane_init(plane, scene)
         call move_alloc(plane, query)
      else
         allocate(space)
         call overlap_query_space_init(space, scene)
         call move_alloc(space, query)
      end if
   end procedure new_overlap_query

end submodule emcon_overlap_query_kinds
