!> Gap of a slave node over a smoothed master surface over a step, with all its derivatives.
!>
!> Source: docs/theory.md, eq. (14b). Sign: gap > 0 is open.
module emcon_hermite_gap
   use emcon_dgrad1, only : weight_t => dg_t, dg_constant, operator(*), operator(-)
   use emcon_dgrad13, only : dg_add_at, dg_add_block, dg_negative_part, dg_root, dg_sqrt, &
      dg_t, difference, difference_t, operator(*), operator(+), operator(-), operator(/)
   use emcon_hermite, only : at_end, hermite_curve, hermite_curve_t, hermite_stencil_t, &
      hermite_weights, hermite_weights_t, joined_pieces
   use emcon_hermite_gap_value, only : hermite_roots, hermite_lever, slave
   use emcon_kinds, only : wp
   implicit none
   private

   include "emcon_hermite_gap.inc"

end module emcon_hermite_gap
