! build: derivatives
!> The numbers of emcon_dgrad11 without second derivatives: values and gradients, bit by bit.
!>
!> Source: docs/theory.md, section 2.
module emcon_dgrad11_first
   include "emcon_dgrad_use.inc"
   implicit none
   private

   integer, parameter :: n_var = 11, n_second = 0

   include "emcon_dgrad_plane.inc"

end module emcon_dgrad11_first
