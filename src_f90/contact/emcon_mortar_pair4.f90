!> Mortar integrals of a pair of edges with 4 master nodes: smoothed surfaces, and fixed points.
module emcon_mortar_pair4
   use emcon_dgrad15, only : dg_add_product_to, dg_add_to, dg_clip, dg_constant, &
      dg_cross, dg_dot, dg_negative_part, dg_root, dg_set_product, dg_set_sum, dg_sqrt, dg_t, &
      dg_variable, difference, difference_t, operator(*), operator(+), operator(-), operator(/)
   use emcon_dgrad_wide, only : change_t, wide_add_part, wide_t
   use emcon_kinds, only : wp
   use emcon_mortar_frame, only : end_rounding, frame_hit, frame_init, frame_meet, frame_t, &
      moment_area, moment_area_xi, moment_cover, moment_gap, moment_gap_xi, n_moment, &
      pair_stencil_t, place_first, place_last, local_master
   use emcon_rounded, only : rounded_clip
   implicit none
   private

   integer, parameter :: n_master = 4, k_root = 15

   include "emcon_mortar_pair.inc"

end module emcon_mortar_pair4
