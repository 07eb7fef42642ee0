! build: derivatives
!> Discrete-gradient arithmetic over 9 variables: four nodes in space.
!>
!> Source: docs/theory.md, section 2.
module emcon_dgrad9
   use emcon_dgrad_series, only : atanh_excess, exp_of, expm1_of, log1p_excess, log1p_of, &
      sinh_ratio
   use emcon_kinds, only : wp
   use emcon_rounded, only : above_negative, above_negative_chord, above_negative_slope, &
      rounded_chord, rounded_clip, rounded_negative, rounded_negative_chord, &
      rounded_negative_slope, rounded_part, rounded_part_slope
   implicit none
   private

   integer, parameter :: n_var = 9, n_second = n_var

   include "emcon_dgrad_space.inc"

end module emcon_dgrad9
