! build: eight
!> The numbers of emcon_dgrad8 without second derivatives: values and gradients, bit by bit.
!>
!> Source: docs/theory.md, section 2.
module emcon_dgrad8_first
   include "emcon_dgrad_use.inc"
   implicit none
   private

   integer, parameter :: n_var = 8, n_second = 0

   include "emcon_dgrad_plane.inc"

end module emcon_dgrad8_first
