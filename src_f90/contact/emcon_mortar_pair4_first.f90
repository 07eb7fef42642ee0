!> What emcon_mortar_pair4 gives, without second derivatives.
module emcon_mortar_pair4_first
   use emcon_dgrad15_first, only : dg_add_product_to, dg_add_to, dg_clip, dg_constant, &
      dg_cross, dg_dot, dg_negative_part, dg_root, dg_set_product, dg_set_sum, dg_sqrt, dg_t, &
      dg_variable, difference, difference_t, operator(*), operator(+), operator(-), operator(/)
   include "emcon_mortar_pair_use.inc"
   implicit none
   private

   integer, parameter :: n_master = 4, k_root = 15

   include "emcon_mortar_pair.inc"

end module emcon_mortar_pair4_first
