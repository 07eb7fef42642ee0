!> Discrete-gradient arithmetic over 1 variable: the place on a curve.
!>
!> Source: docs/theory.md, section 2.
module emcon_dgrad1
   include "emcon_dgrad_use.inc"
   implicit none
   private

   integer, parameter :: n_var = 1, n_second = n_var

   include "emcon_dgrad.inc"

end module emcon_dgrad1
