! build: derivatives
!> Discrete-gradient arithmetic over 9 variables: four nodes in space.
!>
!> Source: docs/theory.md, section 2.
module emcon_dgrad9
   include "emcon_dgrad_use.inc"
   implicit none
   private

   integer, parameter :: n_var = 9, n_second = n_var

   include "emcon_dgrad_space.inc"

end module emcon_dgrad9
