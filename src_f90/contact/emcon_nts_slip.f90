!> Slip of a slave node over a step, with all its derivatives.
!>
!> Source: docs/theory.md, eq. (14e). Sign: slip > 0 is towards the last node of the edge.
module emcon_nts_slip
   use emcon_dgrad8, only : dg_dot, dg_t, difference, difference_t, operator(*), operator(/)
   use emcon_kinds, only : wp
   use emcon_nts_gap_value, only : first, last, slave
   implicit none
   private

   include "emcon_nts_slip.inc"

end module emcon_nts_slip
