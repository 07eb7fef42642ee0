!> What looks for overlap: one case for each dimension, of nodes with three coordinates none.
submodule (emcon_overlap_query_registry) emcon_overlap_query_kinds
   use emcon_overlap_query_plane, only : overlap_query_plane_t, overlap_query_plane_init
   implicit none

contains

   module procedure new_overlap_query
      type(overlap_query_plane_t), allocatable :: plane

      if (size(scene%x, 1) /= 2) return
      allocate(plane)
      call overlap_query_plane_init(plane, scene)
      call move_alloc(plane, query)
   end procedure new_overlap_query

end submodule emcon_overlap_query_kinds
