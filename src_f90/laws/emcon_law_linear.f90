!> Linear elasticity: W = lam/2 (tr E)^2 + mu E:E. Under NLGEOM this is St. Venant-Kirchhoff.
module emcon_law_linear
   use emcon_dgrad_near, only : dg_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_points_t, law_hold_one, law_respond_one, law_t, n_lane, take_elastic
   implicit none
   private
   public :: law_linear_t

   type, extends(law_t) :: law_linear_t
      real(wp) :: lam = 0.0_wp                   !! [M/(L T^2)]
      real(wp) :: mu = 0.0_wp
   contains
      procedure :: take => linear_take
      procedure :: energy
      procedure :: respond
      procedure :: hold
   end type law_linear_t

   logical, parameter :: is_near = .true.
   include "../dgrad/emcon_dgrad_operators.inc"

contains

   pure subroutine linear_take(self, constant, fault)
      class(law_linear_t), intent(inout) :: self
      real(wp), intent(in) :: constant(:)        !! E, nu
      character(len=:), allocatable, intent(out) :: fault   !! what is wrong; empty: nothing

      call take_elastic(constant, self%lam, self%mu, fault)
      self%shear = self%mu
      self%has_volume = .false.
   end subroutine linear_take

   !> For strains of any size: emcon_law_linear.inc.
   pure function energy(self, e1, e2, e3) result(w)
      use emcon_dgrad3, only : dg_t, operator(*), operator(-), operator(+)
      class(law_linear_t), intent(in) :: self
      include "emcon_law_linear.inc"
   end function energy

   !> The same in numbers for loops over points.
   pure function energy_near(self, e1, e2, e3) result(w)
      class(law_linear_t), intent(in) :: self
      include "emcon_law_linear.inc"
   end function energy_near

   pure subroutine respond(self, points, with_tangent)
      class(law_linear_t), intent(in) :: self
      include "emcon_law_lanes.inc"
   end subroutine respond

   pure subroutine hold(self, points)
      class(law_linear_t), intent(in) :: self
      include "emcon_law_held.inc"
   end subroutine hold

   include "../dgrad/emcon_dgrad_rules.inc"
   include "../dgrad/emcon_dgrad_near.inc"
   include "emcon_law_rules.inc"
   include "emcon_law_plane.inc"

end module emcon_law_linear
