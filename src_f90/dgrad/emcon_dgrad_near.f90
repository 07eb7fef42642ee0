!> The numbers of discrete-gradient arithmetic for loops over many points: those of two invariants,
!> the third of a plane strain being 0.
!>
!> Who computes with them includes the rules (emcon_dgrad_rules.inc) and the functions near 0
!> (emcon_dgrad_near.inc). The compiler then sees all of it at once: it leaves out what is not
!> asked for, second derivatives say, and takes several points at a time.
!> Source: docs/theory.md, section 2.
module emcon_dgrad_near
   use emcon_kinds, only : wp
   implicit none
   private

   integer, parameter :: n_var = 2, n_second = n_var

   include "emcon_dgrad_number.inc"

end module emcon_dgrad_near
