! build: derivatives
!> Discrete-gradient arithmetic over 11 variables: six nodes in the plane, and the
!> unknown of an implicit equation (`dg_root`).
!>
!> Source: docs/theory.md, section 2.
module emcon_dgrad11
   include "emcon_dgrad_use.inc"
   implicit none
   private

   integer, parameter :: n_var = 11, n_second = n_var

   include "emcon_dgrad_plane.inc"

end module emcon_dgrad11
