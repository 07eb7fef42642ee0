! build: lanes
!> Linear elasticity with its points side by side in space.
module emcon_law_linear_space
   use emcon_dgrad_near_space, only : dg_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_find_slopes_one, law_slopes_t, n_lane
   use emcon_law_linear, only : law_linear_t
   implicit none
   private
   public :: law_linear_space_t

   type, extends(law_linear_t) :: law_linear_space_t
   contains
      procedure :: find_slopes
   end type law_linear_space_t

   logical, parameter :: is_near = .true.
   include "../dgrad/emcon_dgrad_operators.inc"

contains

   pure function energy_near(self, e1, e2, e3) result(w)
      class(law_linear_space_t), intent(in) :: self
      include "emcon_law_linear.inc"
   end function energy_near

   pure subroutine find_slopes(self, points, with_second)
      class(law_linear_space_t), intent(in) :: self
      include "emcon_law_slopes_space.inc"
   end subroutine find_slopes

   include "../dgrad/emcon_dgrad_rules.inc"
   include "../dgrad/emcon_dgrad_near.inc"
   include "emcon_law_rules.inc"

end module emcon_law_linear_space
