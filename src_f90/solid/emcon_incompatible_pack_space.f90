! build: lanes
!> Elements in space, side by side, with incompatible modes.
!>
!> The law answers to relaxed strains; what works on the nodes is its stress, returned by the
!> transpose of that map. Source: docs/theory.md, eqs. (11) and (11g).
module emcon_incompatible_pack_space
   use emcon_element_pack, only : element_pack_t, pack_clear, pack_motion_t, pack_response_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_t, n_lane
   use emcon_law_points_space, only : answer => law_respond_points_space
   use emcon_pack_points_space, only : column, n_dim, n_strain, pack_add_point, pack_point, &
      pack_point_check, pack_point_t, row
   implicit none
   private

   include "emcon_incompatible_pack.inc"

end module emcon_incompatible_pack_space
