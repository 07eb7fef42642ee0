!> The numbers of discrete-gradient arithmetic for loops over many points in space: those of three
!> invariants. As emcon_dgrad_near otherwise.
!>
!> Source: docs/theory.md, section 2.
module emcon_dgrad_near_space
   use emcon_kinds, only : wp
   implicit none
   private

   integer, parameter :: n_var = 3, n_second = n_var

   include "emcon_dgrad_number.inc"

end module emcon_dgrad_near_space
