! build: eight
!> Discrete-gradient arithmetic over 8 variables: five nodes in the plane.
!>
!> Source: docs/theory.md, section 2.
module emcon_dgrad8
   include "emcon_dgrad_use.inc"
   implicit none
   private

   integer, parameter :: n_var = 8, n_second = n_var

   include "emcon_dgrad_plane.inc"

end module emcon_dgrad8
