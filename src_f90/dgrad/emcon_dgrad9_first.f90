! build: derivatives
!> The numbers of emcon_dgrad9 without second derivatives: values and gradients, bit by bit.
!>
!> Source: docs/theory.md, section 2.
module emcon_dgrad9_first
   include "emcon_dgrad_use.inc"
   implicit none
   private

   integer, parameter :: n_var = 9, n_second = 0

   include "emcon_dgrad_space.inc"

end module emcon_dgrad9_first
