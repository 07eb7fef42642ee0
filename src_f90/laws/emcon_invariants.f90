!> Invariants that laws have in common.
module emcon_invariants
   use emcon_dgrad3, only : dg_excess, dg_log1p, dg_sqrt, dg_t, operator(+), operator(*), &
      operator(-), operator(/)
   use emcon_kinds, only : wp
   implicit none
   private
   public :: isochoric_excess, volume_energy, volume_excess

   logical, parameter :: is_near = .false.

contains

   include "emcon_law_rules.inc"

end module emcon_invariants
