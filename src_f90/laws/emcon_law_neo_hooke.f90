! build: lanes
!> Neo-Hookean law with Abaqus' constants: W = C10 (J^(-2/3) I1 - 3) + (J - 1)^2/D1.
module emcon_law_neo_hooke
   use emcon_dgrad_near, only : dg_t
   use emcon_kinds, only : wp
   use emcon_law, only : claim, law_points_t, law_hold_one, law_respond_one, law_volumetric_t, &
      n_lane
   implicit none
   private
   public :: law_neo_hooke_t

   type, extends(law_volumetric_t) :: law_neo_hooke_t
      real(wp) :: c10 = 0.0_wp                   !! [M/(L T^2)]
   contains
      procedure :: take => neo_hooke_take
      procedure :: energy
      procedure :: respond
      procedure :: hold
   end type law_neo_hooke_t

   logical, parameter :: is_near = .true.
   include "../dgrad/emcon_dgrad_operators.inc"

contains

   pure subroutine neo_hooke_take(self, constant, fault)
      class(law_neo_hooke_t), intent(inout) :: self
      real(wp), intent(in) :: constant(:)        !! C10, D1
      character(len=:), allocatable, intent(out) :: fault   !! what is wrong; empty: nothing

      self%c10 = constant(1)
      self%d(1) = constant(size(constant))
      self%shear = 2.0_wp*self%c10
      call claim(self%c10 > 0.0_wp, "C10", self%c10, "must be positive", fault)
      call claim(self%d(1) >= 0.0_wp, "D1", self%d(1), "must not be negative", fault)
   end subroutine neo_hooke_take

   !> For strains of any size: emcon_law_neo_hooke.inc.
   pure function energy(self, e1, e2, e3) result(w)
      use emcon_dgrad3, only : dg_expm1, dg_t, operator(*), operator(-), operator(+)
      use emcon_invariants, only : isochoric_excess, volume_energy, volume_excess
      class(law_neo_hooke_t), intent(in) :: self
      include "emcon_law_neo_hooke.inc"
   end function energy

   !> The same in numbers for loops over points.
   pure function energy_near(self, e1, e2, e3) result(w)
      class(law_neo_hooke_t), intent(in) :: self
      include "emcon_law_neo_hooke.inc"
   end function energy_near

   pure subroutine respond(self, points, with_tangent)
      class(law_neo_hooke_t), intent(in) :: self
      include "emcon_law_lanes.inc"
   end subroutine respond

   pure subroutine hold(self, points)
      class(law_neo_hooke_t), intent(in) :: self
      include "emcon_law_held.inc"
   end subroutine hold

   include "../dgrad/emcon_dgrad_rules.inc"
   include "../dgrad/emcon_dgrad_near.inc"
   include "emcon_law_rules.inc"
   include "emcon_law_plane.inc"

end module emcon_law_neo_hooke
