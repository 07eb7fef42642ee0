!> Discrete-gradient arithmetic over 3 variables: the three strain invariants of a constitutive law.
!>
!> Source: docs/theory.md, section 2.
module emcon_dgrad3
   include "emcon_dgrad_use.inc"
   implicit none
   private

   integer, parameter :: n_var = 3, n_second = n_var

   include "emcon_dgrad.inc"

end module emcon_dgrad3
