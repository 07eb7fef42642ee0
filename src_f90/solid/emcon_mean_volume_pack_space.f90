! build: lanes
!> Elements in space, side by side, whose volume resists in the mean alone.
!>
!> Source: docs/theory.md, eq. (11c).
module emcon_mean_volume_pack_space
   use emcon_dgrad3, only : dg_t, dg_variable
   use emcon_element_pack, only : element_pack_t, pack_clear, pack_motion_t, pack_response_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_t, n_lane
   use emcon_law_points_space, only : answer => law_respond_points_space, &
      answer_change => law_change_points_space, change_t => change_points_space_t
   use emcon_pack_points_space, only : n_dim, n_strain, pack_add_point, pack_point, &
      pack_point_check, pack_point_t, place
   use emcon_shape, only : max_node => max_element_nodes
   implicit none
   private

   include "emcon_mean_volume_pack.inc"

end module emcon_mean_volume_pack_space
