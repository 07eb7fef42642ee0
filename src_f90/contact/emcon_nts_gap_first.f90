!> Gap and slip of a slave node over a step, without second derivatives.
!>
!> Source: docs/theory.md, eqs. (12) to (14e) and (14u) to (14x). Sign: gap > 0 is open.
module emcon_nts_gap_first
   use emcon_dgrad8_first, only : cross_ends, dg_above_negative, dg_cross, dg_dot, &
      dg_negative_part, dg_rounded_part, dg_sqrt, dg_t, difference, difference_t, dot_ends, ends, &
      operator(*), operator(+), operator(-), operator(/)
   use emcon_kinds, only : wp
   use emcon_nts_gap_value, only : edge_round_t, first, flat, last, right_angle, slave
   implicit none
   private

   include "emcon_nts_gap_step.inc"

end module emcon_nts_gap_first
